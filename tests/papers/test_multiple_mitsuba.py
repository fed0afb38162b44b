"""Mean radiance of a lumpy cloud, four scatterings and all of them, against Mitsuba 3's volpath."""

import math
import warnings
from functools import cache

import numpy as np
import pleinair as pa
import pytest
from pleinair.clouds import Params, Volume, render

G, ALBEDO = 0.6, 0.98
SUN = pa.Sun(35, 150)


def lumps(n=20, seed=3):
    z, y, x = (np.mgrid[0:n, 0:n, 0:n] + 0.5) / n
    rng = np.random.default_rng(seed)
    data = np.zeros((n, n, n))
    for _ in range(8):
        c, r = rng.uniform(0.35, 0.65, 3), rng.uniform(0.08, 0.2)
        data += np.exp(-((x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2) / r**2)
    return Volume(np.maximum(data - 0.3, 0).astype(np.float32), 1.0)


CLOUD = lumps()
LOW, HIGH = CLOUD.bounds
MIDDLE = (LOW + HIGH) / 2
EYE = MIDDLE + np.array([-60.0, 0.0, 0.0])
# Our rays go through the middle of a pixel, Mitsuba's anywhere in it: many pixels, for the mean over the picture.
CAMERA = pa.Camera.look_at(EYE, MIDDLE, 128, 128, fov=14)


@cache
def mitsuba():
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
    except ImportError:
        pytest.skip("mitsuba (group bench) is not installed")
    return mi


def mitsuba_mean(sigma, depth, spp, seeds):
    mi = mitsuba()
    to_world = mi.ScalarTransform4f().translate(LOW.tolist()).scale((HIGH - LOW).tolist())
    look = mi.ScalarTransform4f().look_at(EYE.tolist(), MIDDLE.tolist(), [0, 0, 1])
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "volpath", "max_depth": depth, "rr_depth": 10**6, "hide_emitters": True},
            "sensor": {
                "type": "perspective",
                "fov": 14.0,
                "fov_axis": "y",
                "near_clip": 1.0,
                "far_clip": 1e4,
                "to_world": look,
                "film": {
                    "type": "hdrfilm",
                    "width": 64,
                    "height": 64,
                    "rfilter": {"type": "box"},
                    "pixel_format": "luminance",
                },
                "sampler": {"type": "independent", "sample_count": spp},
            },
            "sun": {
                "type": "directional",
                "direction": [-c for c in SUN.direction],
                "irradiance": {"type": "spectrum", "value": 1.0},
            },
            "cloud": {
                "type": "cube",
                "to_world": to_world.translate([0.5] * 3).scale(0.5),
                "bsdf": {"type": "null"},
                "interior": {
                    "type": "heterogeneous",
                    "albedo": ALBEDO,
                    "scale": sigma,
                    "sigma_t": {
                        "type": "gridvolume",
                        "grid": mi.VolumeGrid(CLOUD.density[..., None]),
                        "to_world": to_world,
                        "wrap_mode": "clamp",
                    },
                    "phase": {"type": "hg", "g": G},
                },
            },
        }
    )
    means = [np.array(mi.render(scene, spp=spp, seed=s), float).mean() for s in range(seeds)]
    return np.mean(means), np.std(means, ddof=1) / math.sqrt(seeds)


@pytest.mark.parametrize(
    ("tau", "orders", "spp", "samples"), [(6.5, 4, 16, 40), (39.0, 4, 10, 40), (6.5, None, 12, 40), (39.0, None, 3, 12)]
)
def test_mean_radiance_is_that_of_mitsuba(tau, orders, spp, samples):
    mi = mitsuba()
    deepest = float(pa.clouds.Basis.precompute(CLOUD, CAMERA, SUN, sigma_t=[1.0]).depth.max())
    p = Params(g=G, sigma_t=tau / deepest, albedo=ALBEDO, ambient=0.0)
    theirs, their_error = mitsuba_mean(p.sigma_t, -1 if orders is None else orders + 1, spp, 8)
    means = []
    for seed in range(6):
        image = render(CLOUD, p, CAMERA, SUN, orders=orders, samples=samples, rng=seed, denoise=False)
        means.append((image.single + image.multiple)[..., 0].mean(dtype=float) / (4 * math.pi))
    ours, our_error = np.mean(means), np.std(means, ddof=1) / math.sqrt(6)
    error = math.hypot(their_error, our_error)
    print(mi.__version__, ours / theirs - 1, error / theirs, our_error / ours)
    assert error < 0.012 * theirs
    assert abs(ours - theirs) < 0.005 * theirs + 3 * error

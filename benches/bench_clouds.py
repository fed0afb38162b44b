"""Clouds: single scattering, the objective of eq 2 and the genetic search against their peers; one thread, CPU time."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version

import cv2
import numpy as np
import pleinair as pa
from pleinair.clouds import Basis, Params, render
from pleinair.fit import Photo, genetic, objective
from pleinair.report import Row, race
from scipy.ndimage import map_coordinates
from scipy.optimize import differential_evolution

ROOM = "inverse_clouds"
NUMPY = f"numpy {np.__version__}, steps of a voxel"
CLOUD = pa.clouds.procedural("cumulus", (96, 160, 160), rng=3)
CAMERA = pa.Camera.look_at((-3400, 1600, 1760), (1600, 1600, 1760), 320, 240, fov=35)
COARSE = CAMERA.resized(24, 18)
SUN = pa.Sun(40, 270)
HAZE = tuple(i / 10 for i in range(11))


def rel(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(np.asarray(a, float) - b) / np.linalg.norm(b))


def numpy_march(camera: pa.Camera, sigma: float) -> np.ndarray:
    """March eq 5 as one writes it in an afternoon: steps of a voxel, the Sun's leg by a sheared sum on the grid."""
    size, low = np.array(CLOUD.voxel_size), np.array(CLOUD.origin)
    density, step = CLOUD.density, float(CLOUD.voxel_size[0])
    nz, ny, nx = density.shape
    # Depth to the Sun at every texel, layer by layer along the axis nearest to it (x here), bilinear across.
    sx, sy, sz = SUN.direction
    length = step / abs(sx)
    to_sun = np.zeros_like(density)
    z, y = np.mgrid[0:nz, 0:ny].astype(np.float32)
    shift = [z + sz / abs(sx), y + sy / abs(sx)]
    order = range(nx - 2, -1, -1) if sx > 0 else range(1, nx)
    for i in order:
        before = i + (1 if sx > 0 else -1)
        layer = to_sun[:, :, before] + density[:, :, before] * length / 2
        to_sun[:, :, i] = map_coordinates(layer, shift, order=1) + density[:, :, i] * length / 2
    d = camera.directions().reshape(-1, 3)
    eye = np.array(camera.position)
    with np.errstate(divide="ignore"):
        a, b = (CLOUD.bounds[0] - eye) / d, (CLOUD.bounds[1] - eye) / d
    near, far = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
    light = np.zeros(len(d))
    hit = np.flatnonzero(far > near)
    depth, out = np.zeros(hit.size), np.zeros(hit.size)
    for k in range(int((far - near)[hit].max() / step) + 1):
        t = near[hit] + (k + 0.5) * step
        q = ((eye + d[hit] * t[:, None] - low) / size - 0.5).T[::-1]
        rho = map_coordinates(density, q, order=1) * step
        on = np.flatnonzero(rho > 0)
        leg = map_coordinates(to_sun, q[:, on], order=1)
        out[on] += sigma * rho[on] * np.exp(-sigma * (depth[on] + rho[on] / 2 + leg))
        depth += rho
    light[hit] = out
    return light.reshape(camera.height, camera.width)


def mitsuba_renders(sigma: float) -> dict:
    """Renderers of the same picture (same camera, g = 0, albedo 1, depth 2) by samples a pixel; none without Mitsuba."""
    try:
        name = f"mitsuba {version('mitsuba')} scalar_rgb"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
    except (ImportError, PackageNotFoundError):
        return {}
    low, high = CLOUD.bounds
    to_world = mi.ScalarTransform4f().translate(low.tolist()).scale((high - low).tolist())
    eye = np.array(CAMERA.position)
    light = [-c for c in SUN.direction]

    def scene(camera: pa.Camera, spp: int):
        return mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "volpath", "max_depth": 2, "hide_emitters": True},
                "sensor": {
                    "type": "perspective",
                    "fov": camera.fov,
                    "fov_axis": "y",
                    "near_clip": 1.0,
                    "far_clip": 1e6,
                    "to_world": mi.ScalarTransform4f().look_at(
                        eye.tolist(), np.add(eye, [1, 0, 0]).tolist(), [0, 0, 1]
                    ),
                    "film": {
                        "type": "hdrfilm",
                        "width": camera.width,
                        "height": camera.height,
                        "rfilter": {"type": "box"},
                        "pixel_format": "luminance",
                    },
                    "sampler": {"type": "independent", "sample_count": spp},
                },
                "sun": {"type": "directional", "direction": light, "irradiance": {"type": "spectrum", "value": 1.0}},
                "cloud": {
                    "type": "cube",
                    "to_world": to_world.translate([0.5] * 3).scale(0.5),
                    "bsdf": {"type": "null"},
                    "interior": {
                        "type": "heterogeneous",
                        "albedo": 1.0,
                        "scale": sigma,
                        "sigma_t": {
                            "type": "gridvolume",
                            "grid": mi.VolumeGrid(CLOUD.density[..., None]),
                            "to_world": to_world,
                            "wrap_mode": "clamp",
                        },
                        "phase": {"type": "isotropic"},
                    },
                },
            }
        )

    return {name: lambda camera, spp: np.array(mi.render(scene(camera, spp), spp=spp))[..., 0] * 4 * np.pi}


def scattering() -> Iterable[Row]:
    """Yield single scattering at 320×240; the error is rel-L2 against the reference method at 24×18."""
    deepest = float(Basis.precompute(CLOUD, COARSE, SUN, sigma_t=[0.01]).depth.max())
    p = Params(sigma_t=6.5 / deepest, ambient=0, albedo=1, g=0)
    exact = render(CLOUD, p, COARSE, SUN, method="reference").single[..., 0]
    errors = {
        "pleinair": rel(render(CLOUD, p, COARSE, SUN).single[..., 0], exact),
        NUMPY: rel(numpy_march(COARSE, p.sigma_t), exact),
    }
    contenders = {
        "pleinair": lambda: render(CLOUD, p, CAMERA, SUN),
        NUMPY: lambda: numpy_march(CAMERA, p.sigma_t),
    }
    for name, call in mitsuba_renders(p.sigma_t).items():
        name = f"{name}, 4 spp"
        contenders[name] = lambda call=call: call(CAMERA, 4)
        # Noise and bias of the full picture, against the picture of the fast method.
        errors[name] = rel(call(CAMERA, 4), render(CLOUD, p, CAMERA, SUN).single[..., 0])
    yield from race(
        ROOM,
        "single scattering, 320×240",
        "cumulus 96×160×160, τ 6.5",
        contenders,
        errors,
        "rel-L2",
        rounds=3,
        budget=20.0,
    )


def histogram_search() -> Iterable[Row]:
    """Yield one evaluation of eq 2: 11 haze × 3 channels × 64 bins; the error is that of O against numpy's."""
    basis = Basis.precompute(CLOUD, replace(CAMERA, fov=24.0), SUN)
    sky = np.broadcast_to(np.float32([0.1, 0.25, 0.6]), (240, 320, 3)).copy()
    p = Params(3.0, (1.0, 0.95, 0.85), 0.4, float(basis.sigma_t[9]), 0.97, 0.2)
    photo = Photo.analyse(basis.image(p, sky), cloud=basis.depth > 0, sky=sky, ground=None)
    core, on = objective(photo, basis, HAZE), basis.depth > 0
    n = int(on.sum())
    gene = [(2.0, 0.5, float(basis.sigma_t[8]) * 1.1, 0.9, 0.3)]
    q = replace(
        p, light_intensity=2.0, g=0.5, sigma_t=gene[0][2], albedo=0.9, ambient=0.3, light_color=photo.light_color
    )
    edges = np.concatenate([[-1], pa.color.srgb_decode(np.arange(1, 64) / 64), [1e30]]).astype(np.float32)

    def blended(count):
        cloud, behind = basis.image(q, sky)[on], sky[on]
        total = 0.0
        for c in range(3):
            a, b = np.ascontiguousarray(cloud[:, c]), np.ascontiguousarray(behind[:, c])
            best = np.inf
            for k in HAZE:
                clear = np.float32(np.exp(-k))
                best = min(best, np.abs(count(a * clear + b * (1 - clear)) / n - photo.histogram[c]).sum())
            total += best / 3
        return total

    def by_numpy(x):
        return np.bincount(np.searchsorted(edges, x, "right") - 1, minlength=64)[:64]

    def by_cv2(x):
        level = pa.color.srgb_encode(np.clip(x, 0, 0.9999999))
        return cv2.calcHist([level[:, None]], [0], None, [64], [0, 1]).ravel()

    ours, cv2_name, numpy_name = "pleinair", f"cv2 {cv2.__version__} calcHist", f"numpy {np.__version__}"
    exact = blended(by_numpy)
    errors = {
        ours: abs(core.evaluate(gene).ravel()[0] - exact),
        cv2_name: abs(blended(by_cv2) - exact),
        numpy_name: 0.0,
    }
    contenders = {
        ours: lambda: core.evaluate(gene),
        cv2_name: lambda: blended(by_cv2),
        numpy_name: lambda: blended(by_numpy),
    }
    where = f"320×240, {n} cloud pixels"
    rows = race(
        ROOM,
        "objective, 11 haze × 3 histograms",
        where,
        contenders,
        errors,
        "of O",
    )
    yield from rows
    # The goal is for a quarter of the picture.
    quarter = rows[0].seconds * 0.25 * 320 * 240 / n
    yield Row(
        ROOM,
        "objective, 19200 cloud pixels",
        where,
        ours,
        quarter,
        errors[ours],
        "of O",
        1.0,
    )


def search() -> Iterable[Row]:
    """Yield 4000 calls of a cheap objective; the error is the value reached (least is 0), mean of 5 seeds."""
    bounds = [(-5.0, 5.0)] * 5

    def bowl(x):
        return ((x - 1.0) ** 2).sum(-1)

    def ours(seed=0):
        return genetic(bowl, bounds, population=40, generations=100, rng=seed).fun

    def scipy(seed=0):
        return differential_evolution(
            lambda x: bowl(x.T),
            bounds,
            popsize=8,
            maxiter=99,
            tol=0,
            polish=False,
            rng=seed,
            vectorized=True,
            updating="deferred",
        ).fun

    name = f"scipy {version('scipy')} differential_evolution"
    errors = {"pleinair": np.mean([ours(s) for s in range(5)]), name: np.mean([scipy(s) for s in range(5)])}
    yield from race(
        ROOM,
        "genetic search, 4000 calls",
        "5-D bowl",
        {"pleinair": ours, name: scipy},
        errors,
        "reached",
    )


def rows() -> Iterable[Row]:
    pa.set_num_threads(1)
    try:
        yield from scattering()
        yield from histogram_search()
        yield from search()
    finally:
        pa.set_num_threads(None)

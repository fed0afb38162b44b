"""Mitsuba 3 under our panorama: the sky stands where our frame says, and a plane gets the light that we say."""

import warnings

import numpy as np
import pytest
from pleinair import exports

HEIGHT = 256


@pytest.fixture(scope="module")
def mi():
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
    except ImportError:
        pytest.skip("mitsuba (group bench) is not installed")
    return mi


def envmap(mi, path, up):
    turn = mi.ScalarTransform4f(exports.to_world("mitsuba", up=up))
    return {"type": "envmap", "filename": str(path), "to_world": turn}


@pytest.fixture(scope="module", params=["exr", "hdr", "pfm"])
def panorama(request, lobe_sky, tmp_path_factory):
    pytest.importorskip("OpenEXR")
    path = tmp_path_factory.mktemp("environment") / f"sky.{request.param}"
    return exports.save_environment(lobe_sky, path, HEIGHT)


def in_scene(direction, up):
    x, y, z = (float(v) for v in direction)
    return [x, y, z] if up == "z" else [x, z, -y]


def rows_from_pole_to_pole(directions, height):
    """Where we have what Mitsuba shows in a direction.

    Its rows, but not its columns, are stretched: the centres of the first and the last lie on the poles. What we say is
    at 90° is there, and everything else up to half a row from where it should be.
    """
    x, y, z = np.moveaxis(directions, -1, 0)
    from_zenith = (np.arccos(z) * (height - 1) + np.pi / 2) / height
    azimuth = np.arctan2(x, y)
    flat = np.sin(from_zenith)
    return np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), np.cos(from_zenith)], axis=-1)


@pytest.mark.parametrize("up", ["z", "y"])
def test_every_direction_is_where_we_say(mi, lobe_sky, panorama, up):
    light = mi.load_dict({"type": "scene", "sky": envmap(mi, panorama, up)}).environment()
    directions = np.random.default_rng(1).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    directions[0] = lobe_sky.axis
    seen = []
    for d in directions:
        hit = mi.SurfaceInteraction3f()
        hit.wi = [-v for v in in_scene(d, up)]
        seen.append(np.array(light.eval(hit)))
    wanted = lobe_sky.radiance(directions)
    shown = lobe_sky.radiance(rows_from_pole_to_pole(directions, HEIGHT))
    errors = [np.abs(np.array(seen) / sky - 1).max() for sky in (wanted, shown)]
    print(panorama.name, up, errors)
    # RGBE: 1/256 of the largest channel, which is up to three times the smallest here.
    assert errors[1] < (0.012 if panorama.suffix == ".hdr" else 0.001)
    assert 0.01 < errors[0] < 0.03, "the peer's half row is still there"
    for mirror in ([-1, 1, 1], [1, -1, 1], [1, 1, -1]):
        assert np.abs(lobe_sky.radiance(directions * mirror) / wanted - 1).max() > 1, "the sky knows its hands"


@pytest.mark.parametrize(
    "normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0.6, -0.64, 0.48)]
)
def test_a_plane_gets_the_light_that_we_say(mi, lobe_sky, panorama, normal):
    """A white Lambertian square sends irradiance / pi to a camera that sees nothing else."""
    n = np.array(normal, float)
    side = np.eye(3)[np.argmin(np.abs(n))].tolist()
    look = mi.ScalarTransform4f().look_at((3 * n).tolist(), [0, 0, 0], side)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "bsdf_samples": 0, "emitter_samples": 1},
            "sensor": {
                "type": "orthographic",
                "to_world": look,
                "film": {
                    "type": "hdrfilm",
                    "width": 32,
                    "height": 32,
                    "pixel_format": "rgb",
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": "stratified", "sample_count": 144},
            },
            "sky": envmap(mi, panorama, "z"),
            "plane": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 0], n.tolist(), side).scale(2.0),
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}},
            },
        }
    )
    theirs = np.pi * np.array(mi.render(scene), float).reshape(-1, 3).mean(axis=0)
    ours = lobe_sky.irradiance(n)
    print(panorama.name, normal, theirs / ours - 1)
    np.testing.assert_allclose(theirs, ours, rtol=0.005)

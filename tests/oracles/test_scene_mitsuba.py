"""Mitsuba 3 beside `Scene.radiance`: the same ground of one reflectance under our panorama and our Sun."""

import warnings
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair import exports
from pleinair.paint import AerialPerspective, Material, Palette, Style, style
from pleinair.plants import Strata, Surface
from pleinair.scene import Ground

REFLECTANCE = (0.12, 0.16, 0.07)
HALF, STEP = 30.0, 1.0


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


def plain(color, **more):
    """A style whose one material is one reflectance."""
    params = replace(
        style("corot").material("grass").params, variation=0.0, roughness=0.0, feather_min=0.0, feather_max=0.2,
        max_opacity=1.0, fullness=0.95, frequency=0.0, center_frequency=0.0, lightness_frequency=0.0, crest=1.0,
    )  # fmt: skip
    material = Material(Palette([color], [color], [color]), params)
    neutral = AerialPerspective(strength=0.0, value=(0.0, 1.0))
    return Style({"grass": material}, atmosphere=neutral, tint=0.0, **more)


def height(x, y):
    return 0.9 * np.exp(-((x / 9) ** 2) - ((y - 45) / 9) ** 2) + 0.4 * np.sin(x / 11) * np.cos(y / 13)


@pytest.mark.parametrize("elevation", [60, 20, 5])
def test_a_ground_is_as_bright_as_in_mitsuba(mi, elevation, tmp_path):
    pytest.importorskip("OpenEXR")
    albedo = float(pa.color.luminance(np.array(REFLECTANCE)))
    sky = pa.sky.Natural(sun=pa.Sun(elevation, 150), turbidity=3, ground_albedo=albedo)
    x, y = np.meshgrid(np.arange(-HALF, HALF + 1, STEP), np.arange(15, 75 + 1, STEP))
    z = height(x, y)
    field = Surface.heightfield(z, STEP, (-HALF, 15, 0))
    ground = Ground(
        field, "grass", Strata((90, 90), 2, displacement=0.0, size=(1.3, 1.3), fade_from=1.0), 1, roughness=0.0
    )
    camera = pa.Camera.look_at((0, 0, 18), (0, 45, 0), 96, 64, fov=40)
    scene = pa.Scene(sky, [ground], plain(REFLECTANCE), visibility=1e9, cast_shadows=False)
    ours = scene.radiance(camera)

    exports.save_environment(sky, tmp_path / "sky.exr", 256, light=True)
    lamp = sky.sun_light()
    mesh = mi.Mesh("field", x.size, 2 * (x.shape[0] - 1) * (x.shape[1] - 1), has_vertex_normals=False)
    n = x.shape[1]
    corner = (np.arange(x.shape[0] - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + n], 1), np.stack([corner + 1, corner + n + 1, corner + n], 1)]
    )
    mi_params = mi.traverse(mesh)
    mi_params["vertex_positions"] = np.stack([x, y, z], -1).ravel().astype(np.float32)
    mi_params["faces"] = faces.ravel().astype(np.uint32)
    mi_params.update()
    mesh.write_ply(str(tmp_path / "field.ply"))
    target = np.array([0, 45, 0.0])
    world = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "sky": {"type": "envmap", "filename": str(tmp_path / "sky.exr"),
                "to_world": mi.ScalarTransform4f(exports.to_world("mitsuba", up="z"))},
        "sun": {"type": "directional", "direction": [-v for v in lamp.direction],
                "irradiance": {"type": "rgb", "value": [max(v, 0.0) for v in lamp.irradiance]}},
        "field": {"type": "ply", "filename": str(tmp_path / "field.ply"), "face_normals": False,
                  "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(REFLECTANCE)}}}},
        "camera": {"type": "perspective", "fov": 40, "fov_axis": "y",
                   "to_world": mi.ScalarTransform4f.look_at([0, 0, 18.0], target.tolist(), [0, 0, 1.0]),
                   "film": {"type": "hdrfilm", "width": 96, "height": 64, "rfilter": {"type": "box"}},
                   "sampler": {"type": "independent", "sample_count": 400}},
    })  # fmt: skip
    theirs = np.array(mi.render(world, seed=1))[..., :3]
    solid = scene.stages(camera)["mask"] > 0.999
    # Blocks of eight pixels that are ground alone.
    blocks = lambda a: a.reshape(8, 8, 12, 8, -1).mean(axis=(1, 3))
    whole = blocks(solid.astype(float))[..., 0] == 1
    assert whole.sum() > 25
    error = blocks(ours)[whole] / blocks(theirs)[whole] - 1
    bright = pa.color.luminance(blocks(ours)[whole]) / pa.color.luminance(blocks(theirs)[whole]) - 1
    print(f"Sun {elevation}°: mean {error.mean(axis=0)}, worst {np.abs(error).max():.4f}, blocks {whole.sum()}")
    assert np.abs(error.mean(axis=0)).max() < 0.02
    assert np.abs(bright).mean() < 0.02
    # A stroke is as wide as the grid: under a Sun of 5° a block's slope is smoothed.
    assert np.abs(bright).max() < 0.05


def test_a_white_furnace_is_white():
    # A sky of radiance 1 all around, white paper before it and white ground under it: all is 1.
    class White(pa.sky.Sky):
        sun = pa.Sun(40, 180)
        absolute = True

        def radiance(self, directions, **_):
            return np.ones(np.shape(directions), np.float32)

        def render(self, camera, **_):
            return np.ones((camera.height, camera.width, 3), np.float32)

        def panorama(self, height=512, **_):
            return np.ones((height, 2 * height, 3), np.float32)

        def _lights(self):
            return []

    x, y = np.meshgrid(np.arange(-30, 31, 1.5), np.arange(5, 66, 1.5))
    field = Surface.heightfield(6 * np.sin(x / 8) * np.cos(y / 9), 1.5, (-30, 5, 0))
    ground = Ground(field, "grass", Strata((60, 60), 3, size=(1.6, 1.2)), 1)
    camera = pa.Camera(96, 64, fov=50, elevation=-5, position=(0, 0, 9))
    for visibility in (None, 200.0):
        seen = pa.Scene(White(), [ground], plain((1, 1, 1)), visibility=visibility).radiance(camera)
        assert np.abs(seen - 1).max() < 0.01, visibility


def test_the_sky_at_the_horizon_is_twice_a_lawn_of_fifteen_percent():
    sky = pa.sky.Natural(sun=pa.Sun(24, 245), turbidity=3.5)
    lawn = Ground(
        Surface.heightfield(np.zeros((2, 2)), 40.0, (-20, 5, 0)),
        "grass",
        Strata((40, 40), 3, size=(2, 1.5)),
        1,
        roughness=0.0,
    )
    scene = pa.Scene(sky, [lawn], plain((0.15, 0.15, 0.15)))
    seen = pa.color.luminance(scene.radiance(pa.Camera(96, 64, fov=40, elevation=-6, position=(0, 0, 3))))
    horizon = float(pa.color.luminance(sky.radiance([[0, 1, 0.01]]))[0])
    grass = float(np.median(seen[50:]))
    # By hand: .15 / pi of the light on a level plane.
    assert grass == pytest.approx(0.15 / np.pi * float(pa.color.luminance(sky.irradiance([(0, 0, 1)]))[0]), rel=0.01)
    # Twice, if the sky near the horizon is a tenth too bright, as it was before its first order was right.
    assert 1.5 < horizon / grass < 2.1


def test_the_landscape_has_its_sky_above_its_lawn():
    scene, camera = pa.demo.landscape(grown=False, trees=3)
    camera = camera.resized(320, 180)
    lightness = pa.color.rgb_to_lab(scene.paint(camera).astype(float))[..., 0]
    assert np.median(lightness[:80]) > np.median(lightness[150:]) + 3

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


@pytest.mark.parametrize(("kind", "elevation"), [("natural", 60), ("natural", 20), ("natural", 5), ("aoas", 40)])
def test_a_ground_is_as_bright_as_in_mitsuba(mi, kind, elevation, tmp_path):
    pytest.importorskip("OpenEXR")
    albedo = float(pa.color.luminance(np.array(REFLECTANCE)))
    if kind == "natural":
        sky = pa.sky.Natural(sun=pa.Sun(elevation, 150), turbidity=3, ground_albedo=albedo)
    else:
        # In its own unit.
        sky = pa.sky.Aoas(sun=pa.Sun(elevation, 150))
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
    print(f"{kind}, Sun {elevation}°: mean {error.mean(axis=0)}, worst {np.abs(error).max():.4f}, blocks {whole.sum()}")
    assert np.abs(error.mean(axis=0)).max() < 0.02
    assert np.abs(bright).mean() < 0.02
    # A stroke is as wide as the grid: under a Sun of 5° a block's slope is smoothed.
    assert np.abs(bright).max() < 0.05


class White(pa.sky.Sky):
    """A sky of radiance 1 all around, without lamps."""

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


def test_a_white_furnace_is_white():
    # White paper in it and white ground under it: all is 1.
    x, y = np.meshgrid(np.arange(-30, 31, 1.5), np.arange(5, 66, 1.5))
    field = Surface.heightfield(6 * np.sin(x / 8) * np.cos(y / 9), 1.5, (-30, 5, 0))
    ground = Ground(field, "grass", Strata((60, 60), 3, size=(1.6, 1.2)), 1)
    camera = pa.Camera(96, 64, fov=50, elevation=-5, position=(0, 0, 9))
    for visibility in (None, 200.0):
        seen = pa.Scene(White(), [ground], plain((1, 1, 1)), visibility=visibility).radiance(camera)
        assert np.abs(seen - 1).max() < 0.01, visibility
    volume = pa.clouds.procedural("cumulus", (12, 24, 24), voxel_size=25.0, origin=(-300, 900, 150), rng=3)
    cloudy = pa.Scene(White(), [ground], plain((1, 1, 1)), volume)
    assert np.abs(cloudy.radiance(replace(camera, elevation=10)) - 1).max() < 0.01
    cloud = cloudy.layers(replace(camera, elevation=10))["clouds"]
    assert (cloud.transmittance < 0.3).mean() > 0.005, "it is seen"
    there = cloud.transmittance < 0.9
    assert np.abs(cloud.radiance[there] / (1 - cloud.transmittance[there])[:, None] - 1).max() < 0.01


class Lamp(White):
    """Black, with a lamp of irradiance 1."""

    sun = pa.Sun(50, 200)

    def radiance(self, directions, **_):
        return np.zeros(np.shape(directions), np.float32)

    def render(self, camera, **_):
        return np.zeros((camera.height, camera.width, 3), np.float32)

    def panorama(self, height=512, **_):
        return np.zeros((height, 2 * height, 3), np.float32)

    def _lights(self):
        return [pa.sky.SunLight(self.sun.direction, (1.0, 1.0, 1.0), 0.27)]


def from_above(mi, camera, target, samples):
    return {
        "type": "perspective", "fov": camera.fov, "fov_axis": "y",
        "to_world": mi.ScalarTransform4f().look_at(list(camera.position), list(target), [0, 0, 1.0]),
        "film": {"type": "hdrfilm", "width": camera.width, "height": camera.height, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": samples},
    }  # fmt: skip


def level_ground(half, far=0.0, rows=90):
    field = Surface.heightfield(np.zeros((2, 2)), 2 * half, (-half, far - half, 0))
    wide = 3.6 * half / rows
    return Ground(field, "grass", Strata((rows, rows), 2, displacement=0.0, size=(wide, wide)), 1, roughness=0.0)


def blocks_of(picture, size=8):
    high, wide = (n // size for n in picture.shape[:2])
    return picture[: high * size, : wide * size].reshape(high, size, wide, size, -1).mean(axis=(1, 3))


def test_a_shadow_of_a_cloud_is_that_of_mitsuba(mi):
    z, y, x = (np.mgrid[0:24, 0:24, 0:24] + 0.5) / 24
    lump = np.exp(-(((x - 0.4) / 0.2) ** 2) - ((y - 0.55) / 0.25) ** 2 - ((z - 0.5) / 0.25) ** 2)
    volume = pa.clouds.Volume(np.maximum(lump - 0.1, 0).astype(np.float32), 10.0, (-120.0, -120.0, 200.0))
    sigma = 0.02
    # The shadow of the cloud's middle is on the ground under the lamp's beam.
    low, high = volume.bounds
    to = np.array(Lamp.sun.direction)
    middle = (low + high) / 2
    target = middle - middle[2] / to[2] * to
    camera = pa.Camera.look_at((target[0], target[1] - 40, 190.0), tuple(target), 96, 96, fov=60)
    scene = pa.Scene(
        Lamp(), [level_ground(200, rows=200)], plain((0.5, 0.5, 0.5)), pa.scene.Cloud(volume, pa.clouds.Params(sigma_t=sigma)),
        visibility=1e9,
    )  # fmt: skip
    ours = scene.radiance(camera)[..., 1]
    box = mi.ScalarTransform4f().translate(low.tolist()).scale((high - low).tolist())
    grid = {
        "type": "gridvolume",
        "grid": mi.VolumeGrid(volume.density[..., None]),
        "to_world": box,
        "wrap_mode": "clamp",
    }
    world = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": 4},
        "sun": {"type": "directional", "direction": (-to).tolist(), "irradiance": {"type": "rgb", "value": [1.0] * 3}},
        "ground": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(400.0),
                   "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.5] * 3}}},
        "cloud": {"type": "cube", "to_world": box.translate([0.5] * 3).scale(0.5), "bsdf": {"type": "null"},
                  "interior": {"type": "heterogeneous", "albedo": 0.0, "scale": sigma, "sigma_t": grid}},
        "camera": from_above(mi, camera, target, 256),
    })  # fmt: skip
    theirs = np.array(mi.render(world, seed=1))[..., 1]
    open_ = 0.5 / np.pi * to[2]
    own, other = (blocks_of(a)[..., 0] / open_ for a in (ours, theirs))
    assert other.min() < 0.5, "it is a shadow"
    assert other.max() > 0.99
    # Of the open ground's light.
    assert abs((own - other).mean()) < 0.01
    assert np.abs(own - other).max() < 0.03


def test_a_homogeneous_haze_is_that_of_mitsuba(mi):
    # Where the horizon has radiance 1, what is missing to it is dimmed by Beer's law: in Mitsuba a lamp in a haze that takes.
    camera = pa.Camera.look_at((0, 0, 150), (0, 150, 0), 96, 64, fov=40)
    # A stroke stands upright in the picture: seen from above it hides little that lies behind it.
    visibility, reflectance = 1000.0, 0.3
    ours = pa.Scene(
        White(), [level_ground(300, 200.0, rows=300)], plain((reflectance,) * 3), visibility=visibility
    ).radiance(camera)
    sigma = float(np.log(50) / visibility)
    haze = {"type": "homogeneous", "albedo": 0.0, "sigma_t": sigma}
    medium = mi.load_dict(haze)
    world = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": 4},
        "ground": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(5000.0),
                   "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}},
                   "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [1 - reflectance] * 3}}},
        "air": {"type": "sphere", "radius": 9000.0, "bsdf": {"type": "null"}, "interior": medium},
        "camera": from_above(mi, camera, (0, 150, 0), 400) | {"medium": medium},
    })  # fmt: skip
    theirs = np.array(mi.render(world, seed=1))[..., 1]
    own, other = blocks_of(1 - ours[..., 1:2])[..., 0], blocks_of(theirs)[..., 0]
    below = other > 0.02
    assert below.sum() > 40
    assert other[below].min() < 0.2
    assert other.max() > 0.3
    # Of the light of the horizon, and of what is dimmed.
    assert np.abs(own - other)[below].max() < 0.03
    assert np.abs(own[below].mean() / other[below].mean() - 1) < 0.03


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

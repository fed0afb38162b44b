"""Clouds of a scene: what docs/scene_light.md claims of their light, shadows, depth and cache, and where they are hardest."""

from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.clouds import Params, Volume
from pleinair.paint import Strokes
from pleinair.plants import Strata, Surface
from pleinair.scene import Cloud, Ground, clouds
from pleinair.scene.painting import light_left

DAY = pa.sky.Natural(sun=pa.Sun(35, 200), turbidity=2.5)
CAMERA = pa.Camera(160, 90, fov=50, elevation=8)
CUMULUS = pa.clouds.procedural("cumulus", (24, 40, 40), voxel_size=60.0, origin=(-1200, 3000, 700), rng=3)
SLAB = Volume(np.ones((4, 16, 16), np.float32), 25.0, (-200, -200, 300))
FLAT = Surface.heightfield(np.zeros((2, 2)), 1200.0, (-600, -600, 0))
FIELD = Ground(FLAT, "grass", Strata((60, 60), 1, size=(24, 20), displacement=0.0), rng=1, roughness=0.0)
CLEAR = {"visibility": 1e9}


def luminance(rgb):
    return pa.color.luminance(np.asarray(rgb, np.float64))


@pytest.fixture(autouse=True)
def _nothing_kept():
    clouds._cache.clear()


@pytest.fixture
def traced(monkeypatch):
    """Count what is traced."""
    calls = []
    whole = clouds.render
    monkeypatch.setattr(clouds, "render", lambda *a, **k: calls.append(a[2]) or whole(*a, **k))
    return calls


def test_a_cloud_is_that_of_a_trace_of_every_pixel():
    scene = pa.Scene(DAY, clouds=CUMULUS, **CLEAR)
    sky = DAY.render(CAMERA)
    params = scene._backdrop.cloud_params()
    own = pa.clouds.render(CUMULUS, params, CAMERA, DAY.sun, sky=sky, orders=None, samples=400, rng=1)
    seen = scene.radiance(CAMERA)
    there = own.transmittance < 0.98
    assert there.sum() > 400
    # The light of the whole, and pixel by pixel as far as paths leave noise.
    found, wanted = (luminance(x - sky * own.transmittance[..., None]).sum() for x in (seen, own.rgb))
    print(f"light of the cloud {found / wanted - 1:+.4f}")
    assert found == pytest.approx(wanted, rel=0.01)
    worst = np.abs(luminance(seen) - luminance(own.rgb))[there] / luminance(own.rgb[there]).mean()
    assert worst.mean() < 0.04
    # An element of the traced picture is a power of two of an angle: up to two pixels.
    beside = ~pa.image.dilate(own.transmittance < 1, 3)
    assert seen[beside] == pytest.approx(sky[beside], rel=2e-3), "and nothing beside it"


def test_a_still_sun_traces_once_and_frames_may_come_in_any_order(traced):
    scene = pa.Scene(DAY, [FIELD], clouds=CUMULUS, grown=False)
    cameras = [replace(CAMERA, azimuth=2.0 * k, position=(0.5 * k, 0.2 * k, 2)) for k in range(4)]
    frames = [scene.radiance(c) for c in cameras]
    assert len(traced) == 1
    clouds._cache.clear()
    assert np.array_equal(scene.radiance(cameras[2]), frames[2])
    assert np.array_equal(scene.radiance(cameras[0]), frames[0])
    scene.radiance(replace(CAMERA, azimuth=180))
    assert len(traced) == 2, "out of view nothing is traced"
    replace(scene, sky=replace(DAY, sun=pa.Sun(36, 200))).radiance(cameras[0])
    assert len(traced) == 3, "another Sun"


def test_a_camera_that_moves_sees_it_without_a_jump():
    scene = pa.Scene(DAY, clouds=CUMULUS, **CLEAR)
    walk = [scene.radiance(replace(CAMERA, position=(x, 0, 2))) for x in np.arange(0, 120, 10.0)]
    steps = [np.abs(a - b).mean() for a, b in zip(walk[1:], walk[:-1], strict=True)]
    assert max(steps) < 0.02 * walk[0].mean(), "where it is traced anew, too"


def test_drift_carries_it():
    moved = Cloud(CUMULUS, position=(80, 40, 0))
    carried = Cloud(CUMULUS, drift=(8, 4, 0))
    one = pa.Scene(DAY, clouds=moved).radiance(CAMERA)
    two = pa.Scene(DAY, clouds=carried, time=10).radiance(CAMERA)
    assert np.array_equal(one, two)
    shot = pa.Timeline(CAMERA, time=lambda t: 20 * t)
    assert np.array_equal(
        pa.Scene(DAY, clouds=carried).frame(shot, 0.5), pa.Scene(DAY, clouds=carried, time=10).paint(CAMERA)
    )
    # A volume that stands there itself is the same cloud.
    there = replace(CUMULUS, origin=tuple(np.array(CUMULUS.origin) + np.array([80, 40, 0])))
    assert luminance(pa.Scene(DAY, clouds=there).radiance(CAMERA)) == pytest.approx(luminance(one), rel=0.2)


def test_a_shadow_is_the_law_of_beer_and_lambert():
    # A slab of 100 m and .012 /m under a high Sun: on the ground behind it exp(-1.2 / sin) of its light is left.
    sky = replace(DAY, sun=pa.Sun(60, 180))
    scene = pa.Scene(sky, [FIELD], clouds=Cloud(SLAB, Params(sigma_t=0.012)), **CLEAR)
    ((part, strokes), *_) = scene.strokes().items()
    falls, bare = (
        one._environment.irradiance(strokes.normal, light_left(one, part, strokes))
        for one in (scene, pa.Scene(sky, [FIELD], **CLEAR))
    )
    lamp = np.array(sky.sun_light().irradiance) * sky.sun_light().direction[2]
    share = 1 - (bare - falls)[:, 1] / lamp[1]
    x, y, _ = strokes.position.T
    # The middle of the slab is at height 350: its shadow falls north of it.
    north = y - 350 / np.tan(np.radians(60))
    inside = (np.abs(x) < 140) & (np.abs(north) < 110)
    assert inside.sum() > 50
    assert share[inside] == pytest.approx(np.exp(-1.2 / np.sin(np.radians(60))), rel=0.03)
    assert (share[(np.abs(x) > 260) | (np.abs(north) > 280)] > 1 - 1e-5).all()
    picture = [
        s.radiance(pa.Camera(96, 64, fov=60, elevation=-60, position=(0, -100, 250))) for s in (scene, bare_scene(sky))
    ]
    ratio = luminance(picture[0]) / luminance(picture[1])
    assert 0.3 < ratio.min() < 0.75, "less than the Sun's share: the sky is left"
    assert ratio.max() == pytest.approx(1, abs=1e-3)


def bare_scene(sky):
    return pa.Scene(sky, [FIELD], **CLEAR)


def test_what_lies_above_a_cloud_has_all_of_its_light():
    sky = replace(DAY, sun=pa.Sun(60, 180))
    high = Strokes([[0, 0, 900.0], [0, 0, 100.0]], (0, 0, 1), (4, 4))
    left = pa.Scene(sky, clouds=SLAB)._backdrop.cloud_shadow(sky.sun.direction, high.position)
    assert left[0] == 1
    assert left[1] < 0.5


def test_clouds_shade_each_other():
    sky = replace(DAY, sun=pa.Sun(70, 180))
    below, above = Cloud(SLAB), Cloud(SLAB, position=(0, 60, 400))
    alone, both = (pa.Scene(sky, clouds=c)._backdrop._cloud_lights for c in ([below], [below, above]))
    assert both[0].light_intensity < 0.5 * alone[0].light_intensity
    assert both[1].light_intensity == pytest.approx(alone[0].light_intensity, rel=1e-6), "the upper one is in the Sun"


def test_water_mirrors_clouds():
    pond = Ground(
        Surface.heightfield(np.zeros((2, 2)), 80.0, (-40, 5, 0)),
        *("water", Strata((40, 40), 3, displacement=0.0, size=(6, 1.5), fade_from=1.0), 1),
        roughness=0.0,
    )
    camera = pa.Camera(160, 120, fov=40, elevation=-12, position=(0, 0, 2))
    low = Cloud(CUMULUS, position=(0, 0, -100))
    with_cloud, without = (pa.Scene(DAY, [pond], clouds=c, **CLEAR).radiance(camera) for c in (low, None))
    change = np.abs(luminance(with_cloud) - luminance(without))
    lower = change[45:]
    assert lower.max() > 500
    # It hangs where its mirror image is: at its elevation below the horizon.
    to = CUMULUS.bounds.mean(axis=0) - np.array([0, 0, 100])
    up = np.degrees(np.arctan2(to[2], np.hypot(to[0], to[1])))
    row = 60 - 60 / np.tan(np.radians(20)) * np.tan(np.radians(12 - up))
    assert abs((lower * (45 + np.arange(75))[:, None]).sum() / lower.sum() - row) < 14


@pytest.mark.parametrize(
    ("cloud", "camera", "shows"),
    [
        (Cloud(SLAB, position=(0, 0, -300)), pa.Camera(32, 24, position=(0, 0, 50)), True),
        (Cloud(CUMULUS, position=(0, 0, -4000)), replace(CAMERA, width=32, height=24), False),
        (Cloud(CUMULUS, position=(0, -9000, 0)), replace(CAMERA, width=32, height=24), False),
        (Cloud(SLAB, position=(0, 300, 0)), pa.Camera(1, 1, elevation=50), True),
    ],
    ids=["around the camera", "below the horizon", "behind the camera", "one pixel"],
)
def test_clouds_anywhere(cloud, camera, shows):
    field = [FIELD] if cloud.position[2] > -1000 else [replace(FIELD, undercoat=True)]
    seen, bare = (pa.Scene(DAY, field, clouds=c).radiance(camera) for c in (cloud, None))
    assert np.isfinite(seen).all()
    assert (seen >= 0).all()
    assert (np.abs(seen - bare).max() > 1) == shows
    for threads in (1, 2):
        pa.set_num_threads(threads)
        clouds._cache.clear()
        assert np.array_equal(pa.Scene(DAY, field, clouds=cloud).radiance(camera), seen)


def test_two_clouds_in_one_place_are_one_twice_as_thick():
    thin = Params(sigma_t=0.004)
    camera = pa.Camera(40, 30, fov=30, elevation=45, position=(0, -350, 0))
    one, two = (
        pa.Scene(DAY, clouds=[Cloud(SLAB, thin)] * n, **CLEAR)._backdrop.picture(camera, 1e9)[1] for n in (1, 2)
    )
    assert two == pytest.approx(one * one, abs=1e-6)
    assert 0.3 < one.min() < 0.9


def test_a_cloud_before_a_hill_hides_it():
    wall = Strokes([[x, 1500, z] for x in range(-900, 901, 60) for z in range(-60, 900, 60)], (0, -1, 0), (130, 130))
    camera = pa.Camera(64, 36, fov=40, elevation=12)
    near, far = Cloud(SLAB, Params(sigma_t=0.2), (0, 900, 0)), Cloud(SLAB, Params(sigma_t=0.2), (0, 2400, 500))
    bare, before, behind = (
        pa.Scene(DAY, [wall], clouds=c, cast_shadows=False, **CLEAR).radiance(camera) for c in (None, near, far)
    )
    assert (np.abs(before - bare).max(axis=2) > 100).mean() > 0.05
    through = 1 - pa.Scene(DAY, [wall], **CLEAR).stages(camera)["mask"][..., None]
    change = through * (pa.Scene(DAY, clouds=far, **CLEAR).radiance(camera) - DAY.render(camera))
    assert behind - bare == pytest.approx(change, abs=2), "and one behind it is hidden"
    assert through.min() < 0.6


def test_night_and_no_light():
    night = pa.sky.Natural(sun=pa.Sun(-30, 0), moon=pa.astro.Moon(40, 200), stars=None)
    lit = pa.Scene(night, clouds=CUMULUS, **CLEAR)
    bright = luminance(lit.radiance(CAMERA) - night.render(CAMERA))
    assert bright.max() > 1e-3, "the Moon lights it"
    dark = replace(night, moon=None, sunlight=False, milky_way=False, zodiacal_light=False, airglow=0.0)
    assert not pa.Scene(dark, clouds=CUMULUS).radiance(CAMERA).any()


def test_what_is_no_cloud_is_refused():
    with pytest.raises(TypeError, match="clouds must be Volume or Cloud"):
        pa.Scene(DAY, clouds=[CUMULUS, 3])
    with pytest.raises(TypeError, match="volume"):
        Cloud("cumulus")
    with pytest.raises(ValueError, match="drift"):
        Cloud(SLAB, drift=(0, 0, np.inf))
    with pytest.raises(ValueError, match="time"):
        pa.Scene(DAY, time=np.nan)

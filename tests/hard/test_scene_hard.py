"""Scenes where they are hardest: a pixel, straight up and down, inside a crown, no light, nothing in view, far from the origin."""

import copy
import pickle
import time
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.paint import Strokes
from pleinair.plants import Strata, Surface, Tree, preset, rock
from pleinair.scene import Ground, Placed

DAY = pa.sky.Natural(sun=pa.Sun(35, 200), turbidity=2.5)
CLOUD = pa.clouds.procedural("cumulus", (16, 24, 24), voxel_size=80.0, origin=(-1000, 2000, 600), rng=3)
FLAT = Surface.heightfield(np.zeros((2, 2)), 60.0, (-30, 0, 0))
OAK = Tree.grow(preset("oak"), rng=2)
POND = Ground(FLAT, "water", Strata((20, 20), 2, displacement=0.0, size=(4, 1), fade_from=1.0), rng=1)
STONE = Ground(rock((3, 3, 2), (0, 12, 0), rng=1), "rock", Strata((8, 8), 3, size=(1, 1)), 2, casts=True)
SCENE = pa.Scene(
    DAY, [POND, STONE, Placed(OAK, (3, 25, 0))], clouds=CLOUD, grown=False, sky_strokes=3000, visibility=3e3
)
CAMERA = pa.Camera(64, 36, fov=50, elevation=8, position=(0, -5, 2))


def over(scene, camera):
    """Check that a picture is its strokes over its backdrop, and in slabs that of the reference; return what they hide."""
    picture = scene.radiance(camera)
    assert picture.shape == (camera.height, camera.width, 3)
    assert picture.dtype == np.float32
    hidden, behind = scene.stages(camera)["mask"], scene._behind(camera)
    bare = hidden == 0
    assert np.array_equal(picture[bare], behind[bare]), "the backdrop where no stroke is"
    # What strokes hide of one backdrop they hide of another.
    other = replace(scene, sky_strokes=0 if scene.sky_strokes else 3000)
    change = (1 - hidden[..., None]) * (behind - other._behind(camera))
    white = 10 * scene.sky.adaptation()
    if bare.all():
        assert np.array_equal(scene.radiance(camera, order="slab"), picture)
    else:
        assert picture - other.radiance(camera) == pytest.approx(change, abs=1e-6 * white)
        slabs, exact = (scene.radiance(camera, order="slab", method=method) for method in ("fast", "reference"))
        assert np.abs(slabs - exact).max() < 2e-4 * white
    shown = scene.paint(camera)
    assert ((shown >= 0) & (shown <= 1)).all()
    assert np.array_equal(shown[bare], scene.backdrop(camera)[bare])
    return hidden


@pytest.mark.parametrize(
    ("camera", "least", "most"),
    [
        (pa.Camera(1, 1, position=(0, -5, 2)), 0.2, 0.6),
        (pa.Camera(1, 50, position=(0, -5, 2)), 0.3, 0.5),
        (pa.Camera(70, 1, position=(0, -5, 2)), 0.005, 0.05),
        # Straight up there is sky alone, straight down the plain before the pond, or the pond's strokes far apart.
        (replace(CAMERA, elevation=90), 0, 0),
        (replace(CAMERA, elevation=-90), 0, 0),
        (replace(CAMERA, elevation=-89.999, roll=33), 0, 0),
        (replace(CAMERA, elevation=-90, position=(0, 30, 20)), 0.2, 0.35),
        (replace(CAMERA, azimuth=180), 0, 0),
        (replace(CAMERA, fov=0.001), 0, 0),
        (replace(CAMERA, fov=179), 1e-6, 1e-3),
        # In the crown, and in a leaf of it.
        (replace(CAMERA, position=(3, 25, 6)), 0.99, 1),
        (replace(CAMERA, position=tuple(OAK.leaves.position[0] + [3, 25, 0])), 0.97, 1),
        # In the stone.
        (replace(CAMERA, position=(0, 12, 0.5)), 0.999, 1),
        # In the water's surface, and below it.
        (replace(CAMERA, position=(0, 30, 0)), 0.01, 0.1),
        (replace(CAMERA, position=(0, 30, -3)), 0.01, 0.2),
        (replace(CAMERA, position=(0, 3000, 900)), 0, 0),
    ],
    ids=repr,
)
def test_any_camera_gives_strokes_over_a_backdrop(camera, least, most):
    assert least <= over(SCENE, camera).mean() <= most


ZENITH, SUN_THERE, MOON_THERE = (0, 0, 1), pa.Sun(90, 120).direction, pa.Moon(30, 120).direction


@pytest.mark.parametrize(
    ("elevation", "moon", "lights"),
    [
        (90, None, [(SUN_THERE, 0.7, 0.8)]),
        (90, pa.Moon(30, 120), [(SUN_THERE, 0.7, 0.8)]),
        # The red half of a Sun gives less than the sky about it; 0.35 - 0.05 is what the sky alone gives.
        (0, None, [(ZENITH, 0.299, 0.3)]),
        (0, pa.Moon(30, 120), [(ZENITH, 0.299, 0.3)]),
        (-6, None, [(ZENITH, 0.3, 0.3)]),
        (-6, pa.Moon(30, 120), [(ZENITH, 0.25, 0.28), (MOON_THERE, 0.05, 0.11)]),
        (-90, None, [(ZENITH, 0.3, 0.3)]),
        (-90, pa.Moon(30, 120), [(MOON_THERE, 0.7, 0.8)]),
    ],
)
def test_a_sun_anywhere_lights_as_much_as_it_gives(elevation, moon, lights):
    sky = pa.sky.Natural(sun=pa.Sun(elevation, 120), moon=moon)
    scene = replace(SCENE, sky=sky)
    assert 0.1 < scene.stages(CAMERA)["mask"].mean() < 0.5
    if elevation == -6:
        over(scene, CAMERA)
    assert len(scene.light()) == len(lights)
    for light, (direction, least, most) in zip(scene.light(), lights, strict=True):
        assert light.direction == pytest.approx(direction, abs=1e-9)
        assert least - 1e-9 <= light.strength <= most + 1e-9


@pytest.mark.parametrize(
    "sky",
    [
        pa.sky.Aoas(sun=pa.Sun(-40, 0)),
        pa.sky.preset("coral"),
        pa.sky.CieGeneral(kind=1, sun=pa.Sun(20, 90), zenith_luminance=4000.0),
        pa.sky.Preetham(sun=pa.Sun(20, 90), turbidity=3),
        pa.sky.Physical(sun=pa.Sun(-5, 90)),
        pa.sky.Natural(sun=pa.Sun(-40, 90), airglow=0, milky_way=False, zodiacal_light=False, stars=None),
    ],
    ids=["Aoas by night", "a style", "CieGeneral", "Preetham", "Physical", "Natural without light"],
)
def test_every_sky_is_behind_as_the_eye_sees_it(sky, eye):
    scene = replace(SCENE, sky=sky)
    above = CAMERA.directions()[..., 2] > 0.01
    seen = replace(scene, sky_strokes=0, clouds=None).backdrop(CAMERA)[above]
    light = sky.render(CAMERA)
    if light.any():
        assert seen == pytest.approx(eye(sky, light)[above], abs=5e-4)
        assert seen.mean() > 0.01
    else:
        assert not seen.any()
        assert sky.sun.elevation == -40, "no sky but those two is without light"
    assert 0.1 < over(scene, CAMERA).mean() < 0.5


def timed(scene, camera):
    """Return a report on a frame, whose times are what it took."""
    start = time.perf_counter()
    report = scene.explain(camera)
    took = time.perf_counter() - start
    assert list(report["seconds"]) == ["sky", "strokes and shadows", "painting", "eye"]
    assert 0.5 * took < sum(report["seconds"].values()) <= took
    return report


def test_next_to_nothing():
    nothing = Strokes(np.zeros((0, 3)), (0, 0, 1), (1, 1))
    empty = Ground(Surface.heightfield(np.zeros((2, 2)), 1e-3), "grass", Strata((1, 1), 1))
    for objects in ([], [nothing], [empty], [nothing, nothing]):
        scene = pa.Scene(DAY, objects, sky_strokes=1)
        assert np.array_equal(scene.paint(CAMERA), scene.backdrop(CAMERA))
        report = timed(scene, CAMERA)
        assert [row["strokes"] for row in report["strokes"]] == ([1, 100] if objects == [empty] else [])
        assert report["left out"] == ([] if objects == [empty] else ["there are no objects: the picture is the sky"])
    bare = Placed(Tree.grow(preset("bare"), rng=1))
    assert [part.kind for part in pa.Scene(DAY, [bare]).parts] == ["trunk"]
    assert 0.005 < over(pa.Scene(DAY, [bare]), replace(CAMERA, position=(0, -20, 3))).mean() < 0.2


def test_far_from_the_origin_it_is_the_same_picture():
    away = np.array([1e5, -2e5, 300.0])

    def moved(by):
        tree = Placed(OAK, tuple(by + np.array([0, 25, 0])))
        stone = Ground(
            rock((3, 3, 2), by + np.array([4, 15, 0]), rng=1), "rock", Strata((8, 8), 3, size=(1, 1)), 2, casts=True
        )
        return pa.Scene(DAY, [tree, stone], grown=False).paint(
            replace(CAMERA, position=tuple(by + np.array([0, -5, 2])))
        )

    assert np.abs(moved(np.zeros(3)) - moved(away)).mean() < 2e-4


def test_a_fisheye_is_refused_by_name():
    for scene in (SCENE, pa.Scene(DAY)):
        for draw in (scene.paint, scene.backdrop, scene.stages, scene.explain):
            with pytest.raises(ValueError, match="perspective"):
                draw(pa.Camera.fisheye(64))
            with pytest.raises(TypeError, match="camera"):
                draw("x")
    with pytest.raises(TypeError, match="camera"):
        SCENE.strokes("x")
    with pytest.raises(TypeError, match="name"):
        SCENE.select(3)


def test_scenes_are_copied_and_pickled():
    picture = SCENE.paint(CAMERA)
    for other in (copy.deepcopy(SCENE), pickle.loads(pickle.dumps(SCENE))):
        assert np.array_equal(other.paint(CAMERA), picture)
    shot = pickle.loads(pickle.dumps(pa.Timeline({0: CAMERA, 1: replace(CAMERA, azimuth=9)})))
    assert shot.at(0.5)[0].azimuth == 4.5


@pytest.mark.parametrize("threads", [1, 2])
def test_threads_do_not_change_a_scene(threads):
    try:
        pa.set_num_threads(3 - threads)
        other = SCENE.paint(CAMERA, order="slab")
        pa.set_num_threads(threads)
        assert np.array_equal(SCENE.paint(CAMERA, order="slab"), other)
    finally:
        pa.set_num_threads(None)

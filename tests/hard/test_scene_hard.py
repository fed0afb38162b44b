"""Scenes where they are hardest: a pixel, straight up and down, inside a crown, no light, nothing in view, far from the origin."""

import copy
import pickle
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


def sound(picture, camera):
    assert picture.shape == (camera.height, camera.width, 3)
    assert picture.dtype == np.float32
    assert np.isfinite(picture).all()
    assert 0 <= picture.min() <= picture.max() <= 1


@pytest.mark.parametrize(
    "camera",
    [
        pa.Camera(1, 1, position=(0, -5, 2)),
        pa.Camera(1, 50, position=(0, -5, 2)),
        pa.Camera(70, 1, position=(0, -5, 2)),
        replace(CAMERA, elevation=90),
        replace(CAMERA, elevation=-90),
        replace(CAMERA, elevation=-89.999, roll=33),
        replace(CAMERA, azimuth=180),
        replace(CAMERA, fov=0.001),
        replace(CAMERA, fov=179),
        replace(CAMERA, position=(3, 25, 6)),
        replace(CAMERA, position=tuple(OAK.leaves.position[0] + [3, 25, 0])),
        replace(CAMERA, position=(0, 12, 0.5)),
        replace(CAMERA, position=(0, 30, 0)),
        replace(CAMERA, position=(0, 30, -3)),
        replace(CAMERA, position=(0, 3000, 900)),
    ],
    ids=repr,
)
@pytest.mark.parametrize("order", ["hard", "slab"])
def test_any_camera_gives_a_picture(camera, order):
    sound(SCENE.paint(camera, order=order), camera)
    assert np.isfinite(SCENE.stages(camera)["mask"]).all()


@pytest.mark.parametrize("elevation", [90, 0, -6, -90])
@pytest.mark.parametrize("moon", [None, pa.Moon(30, 120)])
def test_a_sun_anywhere_gives_a_picture(elevation, moon):
    sky = pa.sky.Natural(sun=pa.Sun(elevation, 120), moon=moon)
    scene = replace(SCENE, sky=sky)
    sound(scene.paint(CAMERA), CAMERA)
    assert scene.light()[0].strength > 0


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
def test_every_sky_gives_a_picture(sky):
    sound(replace(SCENE, sky=sky).paint(CAMERA), CAMERA)


def test_next_to_nothing():
    nothing = Strokes(np.zeros((0, 3)), (0, 0, 1), (1, 1))
    empty = Ground(Surface.heightfield(np.zeros((2, 2)), 1e-3), "grass", Strata((1, 1), 1))
    for objects in ([], [nothing], [empty], [nothing, nothing]):
        scene = pa.Scene(DAY, objects, sky_strokes=1)
        sound(scene.paint(CAMERA), CAMERA)
        assert scene.explain(CAMERA)["seconds"]
    bare = Placed(Tree.grow(preset("bare"), rng=1))
    assert [part.kind for part in pa.Scene(DAY, [bare]).parts] == ["trunk"]
    sound(pa.Scene(DAY, [bare]).paint(replace(CAMERA, position=(0, -20, 3))), CAMERA)


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

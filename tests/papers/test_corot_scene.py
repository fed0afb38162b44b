"""corot as one picture: a sky, trees and a ground; frames that depend on their time alone."""

import time
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.paint import Strokes
from pleinair.plants import Strata, Surface, Tree, preset
from pleinair.scene import Ground, Placed

SKY = pa.sky.Aoas(sun=pa.Sun(30, 200))
HILL = Surface.heightfield(2 * np.sin(np.add.outer(np.arange(12), np.arange(12)) / 3), spacing=8.0, origin=(-44, 0, 0))
GRASS = Ground(HILL, "grass", Strata(spans=(24, 24), count=3, size=(2.5, 1.8)), rng=1)
OAK = Tree.grow(preset("oak"), rng=2)
CAMERA = pa.Camera(160, 90, fov=45, elevation=4, position=(0, -12, 5))
SCENE = pa.Scene(SKY, [GRASS, Placed(OAK, (-6, 22, 0)), Placed(OAK, (9, 40, 0), turn=70, scale=1.2)], grown=False)


def test_a_picture_holds_all_before_the_sky():
    picture = SCENE.radiance(CAMERA)
    assert picture.shape == (90, 160, 3)
    assert picture.dtype == np.float32
    behind = SCENE._behind(CAMERA)
    # Porter and Duff's over: what is hidden of one backdrop is hidden of another.
    painted = replace(SCENE, sky_strokes=2000)
    through = 1 - SCENE.stages(CAMERA)["mask"][..., None]
    white = 10 * SCENE.sky.adaptation()
    change = through * (painted._behind(CAMERA) - behind)
    assert painted.radiance(CAMERA) - picture == pytest.approx(change, abs=1e-6 * white)
    assert np.array_equal(picture[through[..., 0] == 1], behind[through[..., 0] == 1])
    changed = (np.abs(SCENE.paint(CAMERA) - SCENE.backdrop(CAMERA)).max(axis=-1) > 0.02).mean()
    assert 0.1 < changed < 0.9, "strokes before a sky, on a toned ground"
    assert np.array_equal(pa.Scene(SKY).paint(CAMERA), pa.Scene(SKY).backdrop(CAMERA)), "nothing but the sky"


def test_the_same_bits_whatever_the_threads():
    try:
        pa.set_num_threads(1)
        one = SCENE.paint(CAMERA)
        pa.set_num_threads(2)
        assert np.array_equal(SCENE.paint(CAMERA), one)
    finally:
        pa.set_num_threads(None)


@pytest.mark.parametrize("order", ["hard", "slab"])
def test_the_fast_picture_is_that_of_the_reference(order):
    small = replace(CAMERA, width=48, height=27)
    fast, exact = (SCENE.paint(small, order=order, method=method) for method in ("fast", "reference"))
    assert np.abs(fast - exact).max() < 2e-4
    with pytest.raises(ValueError, match="method"):
        SCENE.paint(small, method="slow")


def test_a_frame_is_a_function_of_its_time():
    pan = pa.Timeline(lambda t: replace(CAMERA, azimuth=10 * t), circles=lambda t: (10 + 20 * t, 200.0))
    frames = list(SCENE.animate(pan, 3))
    for k in (2, 0, 1):
        assert np.array_equal(SCENE.frame(pan, k / 2), frames[k]), "in any order"
    assert not np.array_equal(frames[0], frames[2])


def test_keys_are_met_and_the_way_between_is_even():
    one, two = replace(CAMERA, azimuth=350.0), replace(CAMERA, azimuth=10.0, position=(4, -12, 5), elevation=8)
    shot = pa.Timeline({0.5: two, 0: one}, trunk_circles={0: (1, 2), 1: (5, 10)})
    for t, camera in ((0, one), (0.5, two), (1, two)):
        assert shot.at(t)[0].directions() == pytest.approx(camera.directions(), abs=1e-6)
        assert shot.at(t)[0].position == pytest.approx(camera.position)
    middle, changes = shot.at(0.25)
    assert (middle.azimuth % 360, middle.elevation, *middle.position) == pytest.approx((0, 6, 2, -12, 5), abs=1e-9)
    assert changes == {"trunk_circles": (2.0, 4.0)}
    tilted = pa.Timeline({0: CAMERA, 1: replace(CAMERA, roll=350)})
    assert tilted.at(0.5)[0].roll == pytest.approx(-5), "the shorter way"
    for wrong in ({}, {2: CAMERA}, {0: CAMERA, 1: pa.Camera(8, 8)}):
        with pytest.raises(ValueError, match="camera"):
            pa.Timeline(wrong)
    for keys in ({0: (1, 2, 3)}, {0: 5}, {0: "ab"}, {0: (2, 1)}):
        with pytest.raises((ValueError, TypeError), match="circles"):
            pa.Timeline(CAMERA, circles=keys)
    for t in (5, float("nan"), "x"):
        with pytest.raises((ValueError, TypeError), match="t must"):
            shot.at(t)


def test_a_moving_sun_moves_light_and_shadow():
    timeline = pa.Timeline(CAMERA, sky=lambda t: replace(SKY, sun=pa.Sun(30, 100 + 160 * t)))
    tree = pa.Scene(SKY, [Placed(OAK, (0, 22, 0))], grown=False)
    slopes = []
    for t in (0.0, 1.0):
        scene = replace(tree, sky=timeline.sky(t))
        crown = next(iter(scene.strokes(CAMERA).values()))
        final = pa.paint.shade(crown, scene.style, CAMERA, scene.light()).final
        slopes.append(np.corrcoef(crown.position[:, 0], final)[0, 1])
    assert slopes[0] > 0.1, "the sun in the east lights the eastern side"
    assert slopes[1] < -0.1, "and in the west the western"
    assert not np.array_equal(tree.frame(timeline, 0), tree.frame(timeline, 1))


def test_strokes_stay_on_ground_that_moves():
    waved = Surface.heightfield(
        2 * np.sin(np.add.outer(np.arange(12), np.arange(12)) / 3) + 1.0, spacing=8.0, origin=(-44, 0, 0)
    )
    p, q = GRASS.particles, GRASS.particles.on(waved)
    assert (q.position - p.position)[:, 2] == pytest.approx(1.0, abs=1e-9)
    assert np.array_equal(p.label, q.label)


KINDS = [
    ("grass1", "grass"),
    ("grass1", "undercoat"),
    ("tree1", "leaves"),
    ("tree1", "trunk"),
    ("tree2", "leaves"),
    ("tree2", "trunk"),
]


def test_a_tree_shades_itself_and_the_ground():
    lit = SCENE.strokes()
    assert [(part.name, part.kind) for part in lit] == KINDS
    assert [part.casts for part in lit] == [False, False, True, True, True, True]
    grass, crown = (
        np.asarray(strokes.lit)
        for part, strokes in lit.items()
        if part.name + part.kind in ("grass1grass", "tree1leaves")
    )
    assert crown.min() < 0.3
    assert crown.max() > 0.9
    assert grass.min() < 0.6, "grass in the shade of a crown"
    assert all(np.all(s.lit == 1) for s in replace(SCENE, cast_shadows=False).strokes().values())


def test_it_says_what_it_did():
    start = time.perf_counter()
    report = SCENE.explain(CAMERA)
    took = time.perf_counter() - start
    assert [(r["name"], r["kind"]) for r in report["strokes"]] == KINDS
    assert 0.5 * took < sum(report["seconds"].values()) <= took, "where the time went"
    away = SCENE.explain(replace(CAMERA, azimuth=180))
    assert any("behind the eye" in line for line in away["left out"])


def test_a_grove_of_twelve_trees_in_two_seconds():
    trees = [Tree.grow(preset(k), rng=i) for i, k in enumerate(("oak", "poplar", "birch", "willow"))]
    placed = [Placed(trees[k % 4], (7 * (k % 6) - 18, 24 + 9 * (k // 6), 0), turn=40 * k) for k in range(12)]
    scene = pa.Scene(SKY, [GRASS, *placed], grown=False)
    camera = replace(CAMERA, width=1280, height=720)
    scene.paint(camera)
    start = time.process_time()
    scene.paint(camera)
    # The goal is 2 s on two cores; CPU seconds do not see what else the machine does.
    assert time.process_time() - start < 4.0


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"sky": 3}, "sky"),
        ({"sky": SKY, "objects": [3]}, "objects"),
        ({"sky": SKY, "style": "rembrandt"}, "rembrandt"),
        ({"sky": SKY, "cast_shadows": 1}, "cast_shadows"),
        ({"sky": SKY, "clouds": 3}, "clouds"),
        ({"sky": SKY, "cloud_params": 3}, "cloud_params"),
        ({"sky": SKY, "cloud_params": pa.clouds.Params()}, "cloud_params"),
        ({"sky": SKY, "lights": [3]}, "lights"),
        ({"sky": SKY, "circles": (3, "x")}, "circles"),
        ({"sky": SKY, "circles": (9, 3)}, "circles"),
        ({"sky": SKY, "trunk_circles": (1, 2, 3)}, "trunk_circles"),
        ({"sky": SKY, "close": (np.nan, 3)}, "close"),
        ({"sky": SKY, "objects": [Ground(HILL, "gras")]}, "gras"),
        ({"sky": SKY, "objects": [Strokes([[0, 1, 0]], (0, 0, 1), (1, 1), material="nope")]}, "nope"),
        ({"sky": SKY, "materials": {"tree1/leaves": 3}}, "materials"),
        ({"sky": SKY, "sky_strokes": -1}, "sky_strokes"),
    ],
)
def test_what_is_wrong_is_named(arguments, name):
    with pytest.raises((ValueError, TypeError), match=name):
        pa.Scene(**arguments)


def test_strokes_of_ones_own():
    mine = Strokes([[0, 20, 5]], (0, -1, 0), (4, 4))
    alone = pa.Scene(SKY, [mine]).paint(CAMERA)
    assert np.abs(alone - pa.Scene(SKY).paint(CAMERA)).max() > 0.05
    with pytest.raises(TypeError, match="camera"):
        pa.Timeline(3)

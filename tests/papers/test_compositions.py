"""Landscapes one can choose among: each has a foreground, a middle and a distance, and water and lanes are left free."""

import dataclasses

import numpy as np
import pleinair as pa
import pytest
from pleinair.demo.terrain import COMPOSITIONS, Terrain
from skimage.color import rgb2lab

LESS = {"cloud": False, "grown": False}


@pytest.mark.parametrize("kind", COMPOSITIONS)
def test_each_has_a_foreground_a_middle_and_a_distance(kind):
    scene, camera = pa.demo.landscape(composition=kind, rng=5, **LESS)
    trees = np.array([t.position for t in scene.objects if hasattr(t, "turn")])
    away = trees[:, 1] - camera.position[1]
    assert (away < 50).any(), "a near tree frames the view"
    assert ((away >= 50) & (away < 110)).any()
    assert (away > 110).any()
    # The one nearest stands at an edge of the picture, not in its middle.
    x, y, _ = trees[np.argmin(away)] - camera.position
    assert 0.25 < abs(np.degrees(np.arctan2(x, y))) / (0.5 * camera.fov * 16 / 9) < 1.1
    assert bool(len(scene.select("water*"))) == (kind in ("pond", "river"))


@pytest.mark.parametrize("kind", ["pond", "river", "lane"])
@pytest.mark.parametrize("seed", range(4))
def test_nothing_stands_in_water_or_on_a_lane(kind, seed):
    scene, _ = pa.demo.landscape(composition=kind, rng=seed, trees=40, **LESS)
    name = "rock" if kind == "lane" else "water"
    surface = next(g.surface for g in scene.objects if getattr(g, "material", None) == (name,))
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 300), indexing="ij"), axis=-1)
    points = surface.at(grid.reshape(-1, 2))[0] if kind != "pond" else np.zeros((0, 3))
    for tree in (t for t in scene.objects if hasattr(t, "turn")):
        x, y, z = tree.position
        if kind == "pond":
            assert ((x - Terrain.pond[0]) / 17) ** 2 + ((y - Terrain.pond[1]) / 15) ** 2 > 1
        else:
            near = points[np.abs(points[:, 1] - y) < 4]
            if len(near):
                middle = 0.5 * (near[:, 0].min() + near[:, 0].max())
                assert abs(x - middle) > 2.0
        assert np.isfinite(z)


def test_seeds_give_other_landscapes_and_the_same_ones_again():
    drawn = [pa.demo.landscape(rng=seed, trees=2, **LESS)[0] for seed in range(1, 13)]
    kinds = [(bool(len(s.select("water*"))), len(s.objects)) for s in drawn]
    assert len(set(kinds)) >= 4, "not one composition whatever the seed"
    again = pa.demo.landscape(rng=3, trees=2, **LESS)[0]
    assert [o.position for o in again.objects if hasattr(o, "turn")] == [
        o.position for o in drawn[2].objects if hasattr(o, "turn")
    ]


def test_select_and_repainted_reach_everything():
    scene, camera = pa.demo.landscape(composition="lane", rng=2, trees=2, **LESS)
    rocks = scene.select("rock*")
    other = scene.repainted(scene.style.material("straw"), "rock*")
    assert len(rocks) >= 10, "the lane is one of them"
    view = camera.resized(96, 54)
    assert np.abs(scene.paint(view) - other.paint(view)).max() > 0.02


def test_a_camera_of_ones_own():
    own = pa.Camera(96, 54, fov=30, azimuth=20, elevation=4, position=(3, -20, 9))
    _, camera = pa.demo.landscape(trees=1, camera=own, **LESS)
    assert camera == own
    with pytest.raises(TypeError, match="camera"):
        pa.demo.landscape(camera=(1, 2, 3))
    with pytest.raises(ValueError, match="composition must be one of"):
        pa.demo.landscape(composition="beach")


@pytest.mark.parametrize("kind", COMPOSITIONS)
def test_values_of_a_corot_in_every_composition(kind):
    scene, camera = pa.demo.landscape(composition=kind, rng=7)
    camera = camera.resized(240, 135)
    light = rgb2lab(pa.color.srgb_encode(scene.paint(camera)))
    layers = scene.layers(camera)
    up = camera.directions()[..., 2]
    covered = layers["strokes"].transmittance < 0.05
    sky = (layers["strokes"].transmittance > 0.95) & (up > 0)
    foliage, grass = covered & (up > 0.02), covered & (up < -0.06)
    sky_l, foliage_l, grass_l = (float(np.median(light[m, 0])) for m in (sky, foliage, grass))
    assert sky_l >= foliage_l + 40
    assert sky_l >= grass_l + 30
    assert np.median(np.hypot(light[..., 1], light[..., 2])) <= 11


def test_the_hour_of_a_style_is_that_of_its_sky():
    for name in pa.paint.styles():
        sky = pa.demo.style_sky(name)
        scene, _ = pa.demo.landscape(style=name, trees=0, **LESS)
        assert scene.sky == sky
    assert pa.demo.style_sky("dusk").sun.elevation == -2.5
    assert dataclasses.replace(pa.demo.style_sky("moonlight")).moon is not None


def test_birches_have_a_white_bark():
    scene, camera = pa.demo.landscape(composition="clearing", rng=7, **LESS)
    camera = camera.resized(480, 270)
    brown = scene.repainted(scene.style.material("bark"), "birch*", "trunk")
    white, dark = (rgb2lab(pa.color.srgb_encode(s.paint(camera)))[..., 0] for s in (scene, brown))
    changed = np.abs(white - dark) > 5
    assert changed.sum() > 60
    assert np.median((white - dark)[changed]) > 9, "L*, in shadow too"
    assert changed.mean() < 0.05, "nothing else changes"

"""What a frame leaves out, keeps from another frame and mixes: the claims of docs/scene_light.md on cost, and their errors."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pleinair as pa
import pytest
from pleinair import paint
from pleinair.plants import Strata, Surface, Tree, preset
from pleinair.scene import Ground, Placed
from pleinair.scene.painting import lit_strokes, visible_strokes
from pleinair.scene.sun_grid import suns_about

SKY = pa.sky.Natural(sun=pa.Sun(30, 160), turbidity=3)
HILL = Ground(
    Surface.heightfield(2 * np.sin(np.arange(21) / 3) * np.ones((21, 1)), 8.0, (-80, -20, 0)),
    "grass",
    Strata((40, 40), 2, size=(3, 1.5)),
    1,
)
POND = Ground(
    Surface.heightfield(np.full((2, 2), 0.8), 30.0, (-15, 15, 0)), "water", Strata((20, 20), 3, size=(3, 0.5)), 2
)
TREES = [Placed(Tree.grow(preset("oak"), rng=2), (x, y, 0)) for x, y in ((-9, 50), (6, 58), (12, 90))]
SCENE = pa.Scene(SKY, [HILL, POND, *TREES], circles=(20.0, 200.0), grown=False)
CAMERA = pa.Camera(192, 108, fov=40, elevation=0, position=(0, -4, 4))


def cloudy(**more):
    volume = pa.clouds.procedural("cumulus", (12, 24, 24), voxel_size=50.0, origin=(-600, 3000, 900), rng=3)
    return replace(SCENE, clouds=volume, **more)


def moving(low, high):
    return pa.Timeline(CAMERA, sky=lambda t: replace(SKY, sun=pa.Sun(low + t * (high - low), 160.4)))


def states(scene, camera=CAMERA):
    return {row["layer"]: row for row in scene.explain(camera)["layers"]}


@pytest.mark.parametrize("turn", [0.0, 25.0, 180.0])
def test_what_is_out_of_view_changes_no_bit(turn):
    camera = replace(CAMERA, azimuth=turn)
    for scene in (replace(SCENE, objects=[HILL, *TREES]), SCENE):
        parts, seen = scene.strokes(camera), visible_strokes(scene, camera)
        assert sum(map(len, seen.values())) < 0.95 * sum(map(len, parts.values()))
        whole, some = (scene._canvas(p, scene._shaded(p, camera), camera, "hard") for p in (parts, seen))
        assert np.array_equal(whole.transmittance, some.transmittance)
        if scene is SCENE:
            # A sky answers many directions at once, within its tolerance: what water reflects depends on how many.
            assert np.abs(whole.rgb - some.rgb).max() < 1e-3 * whole.rgb.max()
        else:
            assert np.array_equal(whole.rgb, some.rgb)


def test_shadows_between_levels():
    # Beside those of exactly this frame's level of detail.
    moved = replace(CAMERA, position=(3, 13, 4))
    for camera in (CAMERA, moved):
        found = lit_strokes(SCENE, camera)
        lists, casts = list(found.values()), [part.casts for part in found]
        exact = paint.shadows(
            lists, SCENE.light()[0].direction, SCENE._style, casts=casts, camera=camera, circles=SCENE.circles
        )
        for part, strokes, own in zip(found, lists, exact, strict=True):
            if part.kind != "undercoat":
                assert np.abs(strokes.lit - own).mean() < 0.02, part.name


def test_a_frame_after_a_step_makes_no_shadow_anew():
    SCENE.paint(CAMERA)
    step = replace(CAMERA, position=(0.3, -3.6, 4), azimuth=2.0)
    rows = states(SCENE, step)
    assert rows["shadows of strokes"]["state"] == "kept"
    assert states(replace(SCENE, sky=replace(SKY, sun=pa.Sun(31.3, 160))))["shadows of strokes"]["state"] == "computed"


def test_what_is_absent_costs_nothing():
    bare = states(pa.Scene(SKY))
    for name in ("clouds", "plain", "sky strokes", "shadows of strokes", "shadows of clouds", "strokes", "water"):
        assert bare[name]["state"] == "skipped"
        assert bare[name]["milliseconds"] == 0
        assert len(bare[name]["why"]) > 8
    assert bare["sky"]["state"] == bare["eye"]["state"] == "computed"
    rows = states(cloudy(cast_shadows=False))
    assert rows["clouds"]["milliseconds"] > 0
    assert rows["shadows of clouds"]["why"] == "shadows are switched off"
    away = states(cloudy(), replace(CAMERA, azimuth=180))
    assert (away["clouds"]["state"], away["clouds"]["why"]) == ("skipped", "all are out of view")
    dry = states(replace(SCENE, objects=[HILL]))
    assert dry["water"]["why"] == "nothing reflects"


def test_corners_of_the_grid_share_one():
    rng = np.random.default_rng(0)
    for elevation, azimuth in np.stack([rng.uniform(-10, 90, 200), rng.uniform(0, 360, 200)], -1):
        to = np.array(pa.Sun(elevation, azimuth).direction)
        found = suns_about(to)
        assert sum(share for share, _ in found) == pytest.approx(1)
        assert all(np.degrees(np.arccos(np.clip(to @ one, -1, 1))) < 1.5 for _, one in found)
        mean = sum(share * np.array(one) for share, one in found)
        assert np.degrees(np.arccos(mean @ to / np.linalg.norm(mean))) < 0.01, "barycentric"


def test_light_of_a_sun_that_moves():
    # In the middle between two Suns of the grid, where a mix is farthest from the truth.
    scene = cloudy()
    middle = replace(scene, sky=replace(SKY, sun=pa.Sun(30.5, 160.4)))
    film = replace(middle)
    object.__setattr__(film, "_moving_sun", True)
    (mixed,), (own,) = (s._backdrop.clouds_seen(CAMERA, None) for s in (film, middle))
    there = own.transmittance < 0.9
    light = [float(pa.color.luminance(one.rgb[there]).sum()) for one in (mixed, own)]
    assert light[0] == pytest.approx(light[1], rel=0.01)
    (a, b) = (visible_strokes(s, CAMERA) for s in (film, middle))
    wrong = [np.abs(x.lit - y.lit).mean() for x, y in zip(a.values(), b.values(), strict=True) if np.ndim(x.lit)]
    assert max(wrong) < 0.02, wrong


def test_a_film_has_no_step_where_the_sun_passes_the_grid():
    film = moving(29.95, 30.05)
    pictures = [SCENE.frame(film, t) for t in np.linspace(0, 1, 9)]
    steps = [float(np.abs(b - a).mean()) for a, b in pairwise(pictures)]
    assert max(steps) < 2 * np.median(steps), steps


def test_frames_of_a_film_come_in_any_order_and_on_any_threads():
    film = moving(30.2, 30.8)
    scene = cloudy()
    forth = [scene.frame(film, t) for t in (0.0, 0.5, 1.0)]
    pa.set_num_threads(2)
    try:
        back = [scene.frame(film, t) for t in (1.0, 0.5, 0.0)]
    finally:
        pa.set_num_threads(None)
    assert all(np.array_equal(a, b) for a, b in zip(forth, reversed(back), strict=True))

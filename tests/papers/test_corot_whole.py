"""corot with the other three: clouds between sky and strokes, Sun and Moon as lights, water, rocks, painted skies."""

from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.paint import Light, Strokes, style
from pleinair.plants import Strata, Surface, Tree, preset, rock
from pleinair.scene import Ground, Placed
from pleinair.scene import strokes as scene_strokes

DAY = pa.sky.Natural(sun=pa.Sun(35, 200), turbidity=2.5)
CAMERA = pa.Camera(160, 90, fov=50, elevation=8)
CLOUD = pa.clouds.procedural("cumulus", (24, 40, 40), voxel_size=60.0, origin=(-1200, 3000, 700), rng=3)
FLAT = Surface.heightfield(np.zeros((2, 2)), 60.0, (-30, 0, 0))
TREE = Tree.grow(preset("shrub"), rng=1)


def luminance(rgb):
    return pa.color.luminance(np.asarray(rgb, np.float64))


@pytest.mark.parametrize(
    ("sky", "light"), [(DAY, 5e3), (pa.sky.Aoas(sun=pa.Sun(35, 200)), 0.3)], ids=["Natural", "Aoas"]
)
def test_a_cloud_is_that_of_clouds_render_after_the_eye(sky, light, eye):
    # Through a look-up and other paths: the same cloud, and the sky beside it to the bit.
    params = pa.clouds.Params(light_intensity=light, ambient=0.16 * light)
    own = pa.clouds.render(CLOUD, params, CAMERA, sky.sun, sky=sky.render(CAMERA), orders=None, samples=200, rng=0)
    seen = pa.Scene(sky, clouds=CLOUD, cloud_params=params, visibility=1e9).paint(CAMERA)
    there = own.transmittance < 0.9
    error = np.abs(seen - eye(sky, own.rgb))
    assert error[there].mean() < 0.04 * seen[there].mean()
    plain = pa.Scene(sky).paint(CAMERA)
    assert plain == pytest.approx(eye(sky, sky.render(CAMERA)), abs=2e-4)
    assert np.array_equal(seen[:, :9], plain[:, :9])
    assert np.abs(seen - plain).max() > 0.1, "a cloud is there"


def test_a_cloud_stands_behind_all_else():
    scene = pa.Scene(DAY, clouds=CLOUD, cloud_params=pa.clouds.Params(light_intensity=5e3, ambient=800.0))
    tree = Placed(Tree.grow(preset("oak"), rng=2), (0, 20, -4))
    both = replace(scene, objects=[tree], grown=False).paint(CAMERA)
    alone = replace(scene, clouds=None, cloud_params=None, objects=[tree], grown=False).paint(CAMERA)
    stages = replace(scene, objects=[tree], grown=False).stages(CAMERA)
    assert both[stages["mask"] > 0.999] == pytest.approx(alone[stages["mask"] > 0.999], abs=2e-3), "behind the tree"
    assert np.abs(both - alone).max() > 0.1


@pytest.mark.parametrize(
    "sky", [DAY, pa.sky.Aoas(sun=pa.Sun(35, 200)), pa.sky.CieGeneral(kind=12, sun=pa.Sun(35, 200))]
)
def test_a_cloud_is_as_white_as_its_sky_has_light_for(sky):
    scene = pa.Scene(sky, clouds=CLOUD)
    params = scene._backdrop.cloud_params()
    view = pa.Camera.look_at((0, 0, 1400), (0, 4000, 1400), 64, 64, fov=40)
    seen = pa.clouds.render(CLOUD, params, view, sky.sun, orders=None, samples=64, rng=0)
    bright = np.quantile(luminance(seen.rgb[seen.transmittance < 0.01]), 0.9)
    white = luminance(sky.irradiance([sky.sun.direction])[0]) / np.pi
    # A white wall that faces the Sun: a cloud is no brighter, and a thick one lit from behind us has most of it.
    assert 0.3 * white < bright < 1.1 * white


def test_a_cloud_out_of_view_costs_nothing_and_that_is_said():
    scene = pa.Scene(DAY, clouds=CLOUD)
    away = replace(CAMERA, azimuth=180)
    assert np.array_equal(scene.paint(away), pa.Scene(DAY).paint(away))
    assert "the cloud is out of view" in scene.explain(away)["left out"]
    assert "the cloud is out of view" not in scene.explain(CAMERA)["left out"]


def test_the_moon_lights_the_night_and_the_sun_the_day():
    night = pa.sky.Natural(sun=pa.Sun(-30, 0), moon=pa.Moon(40, 120))
    light, *more = pa.Scene(night).light()
    assert not more
    assert light.direction == pytest.approx(pa.Moon(40, 120).direction)
    day = replace(night, sun=pa.Sun(40, 300))
    assert [one.direction for one in pa.Scene(day).light()] == [pytest.approx(pa.Sun(40, 300).direction)]
    assert pa.Scene(replace(night, moon=None)).light()[0].strength < light.strength, "no lamp: faint, from the zenith"
    paper = Strokes([[0, 9, 0]], (0, 0, 1), (30, 30))
    shown = [
        pa.Scene(sky, [paper], cast_shadows=False).paint(replace(CAMERA, elevation=0)).mean() for sky in (day, night)
    ]
    assert shown[1] < 0.5 * shown[0], "what the Moon lights is shown darker than what the Sun lights"


def test_lights_of_ones_own_share_their_shadows():
    above, east = Light((0, 0, 1), 0.4), Light((1, 0, 0.001), 0.4)
    roof = Strokes([[0, 20, 6]], (0, 0, 1), (9, 9), label=[5])
    below = Strokes([[0, 20, 0], [0, 20, 0.1]], [[0, 0, 1], [1, 0, 0]], (0.5, 0.5), label=[7, 8])
    scene = pa.Scene(DAY, [roof, below], lights=[above, east])
    lit = list(scene.strokes().values())[1].lit
    from_above = list(replace(scene, lights=above).strokes().values())[1].lit
    # The stroke that faces up has its light from above alone, the other one from the east, where nothing stands.
    assert lit[0] == pytest.approx(from_above[0], abs=2e-3)
    assert from_above[0] < 0.7
    assert lit[1] == pytest.approx(1, abs=2e-3)


def test_names_are_unique_and_parts_are_found_by_name_and_kind():
    scene = pa.Scene(
        DAY, [Placed(TREE, (x, 9, 0), name="bush") for x in (-3, 0, 3)] + [Ground(FLAT, rng=1), TREE], grown=False
    )
    names = [part.name for part in scene.select(kind="leaves")]
    assert names == ["bush1", "bush2", "bush3", "tree1"]
    assert {part.kind for part in scene.select("bush2")} == {"leaves", "trunk"}
    assert [part.name for part in scene.select("bush*", "tr*")] == ["bush1", "bush2", "bush3"]
    assert scene.select("nothing") == ()
    white = scene.repainted(style("winter").material("grass"), "bush2", "leaves")
    camera = replace(CAMERA, elevation=0, position=(0, 0, 1))
    changed = np.abs(white.paint(camera) - scene.paint(camera)).max(axis=2) > 0.05
    columns = np.flatnonzero(changed.any(axis=0))
    assert changed.sum() > 30
    assert 45 < columns.min() < columns.max() < 115, "the middle one alone"
    with pytest.raises(ValueError, match="nothing"):
        scene.repainted(style("winter").material("grass"), "nothing")


def test_noise_chooses_among_materials_in_equal_shares():
    ground = Ground(FLAT, ("grass", "straw", "rock"), Strata((40, 40), 2), rng=1, patch=10.0, undercoat=False)
    kinds = pa.Scene(DAY, [ground]).strokes()
    counts = {part.kind: len(strokes) for part, strokes in kinds.items()}
    assert sum(counts.values()) == 3200
    assert max(counts.values()) - min(counts.values()) <= 1
    grass, straw = (kinds[part].position[:, :2] for part in list(kinds)[:2])
    near = np.linalg.norm(grass[:, None] - grass, axis=-1)
    near[near == 0] = np.inf
    other = np.linalg.norm(grass[:, None] - straw, axis=-1)
    assert (near.min(axis=1) < other.min(axis=1)).mean() > 0.6, "patches, not a sprinkling"
    single = Ground(FLAT, "grass", Strata((40, 40), 2), rng=1)
    assert np.array_equal(
        np.sort(single.strokes["grass"].label), np.sort(np.concatenate([s.label for s in kinds.values()]))
    )


def test_g4_nothing_behind_a_ground_shows_through_at_any_distance():
    x, y = np.meshgrid(np.linspace(-40, 40, 41), np.linspace(0, 80, 41))
    hill = Surface.heightfield(8 * np.exp(-(x**2 + (y - 40) ** 2) / 300), 2.0, (-40, 0, 0))
    cover = Strata((60, 60), 3, size=(1.6, 1.2))
    for surface, camera, rows in (
        (FLAT, pa.Camera(160, 90, fov=40, elevation=-20, position=(0, 2, 12)), slice(35, 90)),
        (hill, pa.Camera(160, 90, fov=40, elevation=2, position=(0, -10, 3)), slice(42, 62)),
    ):
        for circles in ((400, 800), (5, 60), (5, 5)):
            scene = pa.Scene(DAY, [Ground(surface, "grass", cover, rng=1)], circles=circles)
            mask = scene.stages(camera)["mask"][rows, 60:100]
            assert mask.mean() > 0.99, (circles, mask.mean())
    bare = pa.Scene(DAY, [Ground(FLAT, "grass", cover, rng=1, undercoat=False)])
    assert bare.stages(pa.Camera(160, 90, fov=40, elevation=-20, position=(0, 2, 12)))["mask"][35:].mean() < 0.9


def test_what_hides_stands_where_the_surface_is():
    # A pole behind a hill, lower than its top, is hidden; one that is higher is seen above it and not through it.
    x, y = np.meshgrid(np.linspace(-40, 40, 41), np.linspace(0, 80, 41))
    hill = Ground(Surface.heightfield(8 * np.exp(-(x**2 + (y - 40) ** 2) / 300), 2.0, (-40, 0, 0)), rng=1)
    z = np.linspace(0, 20, 60)
    pole = Strokes(np.stack([0 * z, 0 * z + 75, z], -1), (0, -1, 0), (3, 1), material="bark")
    camera = pa.Camera(160, 90, fov=30, elevation=8, position=(0, -10, 2))
    with_pole, without = (pa.Scene(DAY, o, cast_shadows=False).paint(camera) for o in ([hill, pole], [hill]))
    seen = np.flatnonzero(np.abs(with_pole - without).max(axis=2)[:, 78:82].mean(axis=1) > 0.03)
    to = np.array([[0, 75, 20.0], [0, 40, 8.0]]) - camera.position
    _, up, away = camera._axes() @ to.T
    top, crest = 45 - 45 / np.tan(np.radians(15)) * up / away
    assert abs(seen.min() - top) < 4
    assert abs(seen.max() - crest) < 6


def test_a_trunk_is_whole_however_near():
    oak = Tree.grow(preset("oak"), rng=2)
    for away in (3.0, 6.0, 30.0):
        camera = pa.Camera.look_at((0, -away, 1.7), (0, 0, 1.2), 200, 200, fov=np.degrees(2 * np.arctan(1.2 / away)))
        scene = pa.Scene(DAY, [oak], grown=False)
        parts = {part: strokes for part, strokes in scene.strokes(camera).items() if part.kind == "trunk"}
        canvas = scene._canvas(parts, scene._shaded(parts, camera), camera, "hard")
        assert canvas.transmittance[70:150, 90:110].mean() < 0.03, away


@pytest.mark.parametrize(
    "sky", [pa.sky.Natural(sun=pa.Sun(5, 250)), pa.sky.Aoas(sun=pa.Sun(5, 250))], ids=["Natural", "Aoas"]
)
def test_a_sun_that_sets_leaves_without_a_jump(sky):
    low = Surface.heightfield(np.zeros((2, 2)), 60.0, (-30, 0, 0))
    scene = pa.Scene(sky, [Ground(low, "grass", Strata((30, 30), 2), rng=1), Placed(TREE, (0, 9, 0))], grown=False)
    camera = replace(CAMERA, elevation=0, position=(0, 0, 1))

    def strength(elevation):
        lights = replace(scene, sky=replace(sky, sun=pa.Sun(elevation, 250))).light()
        return np.array(
            [sum(light.strength for light in lights if light.direction[2] < 0.9), sum(x.strength for x in lights)]
        )

    assert strength(3.0)[0] > 0.3
    assert strength(-2.0)[0] < 0.05, "what has set gives nothing"
    tiny = 1e-6
    for edge in (0.2, 0.0, -0.2, -0.2665, -0.2666, -0.2667, -0.3):
        assert np.abs(strength(edge + tiny) - strength(edge)).max() < 1e-3, edge
    frames = [
        replace(scene, sky=replace(sky, sun=pa.Sun(e, 250))).paint(camera, order="slab")
        for e in (-0.2666 + tiny, -0.2666 - tiny)
    ]
    assert 255 * np.abs(frames[0] - frames[1]).max() < 0.5


def test_a_repaint_survives_a_change_of_style_and_other_names():
    named = [Placed(TREE, (k, 9, 0), name="oak") for k in range(11)] + [Placed(TREE, (0, 12, 0), name="oak1")]
    scene = pa.Scene(DAY, named, grown=False)
    names = [part.name for part in scene.select(kind="leaves")]
    assert len(set(names)) == 12
    white = scene.repainted(style("winter").material("grass"), "oak2", "leaves")
    assert [s.material for s in replace(white, style="dusk").strokes().values()].count("oak2/leaves") == 1
    assert white.style == scene.style


def test_the_order_of_grounds_changes_nothing():
    stone = Ground(rock((6, 6, 4), (0, 20, 0), rng=1), "rock", Strata((12, 12), 4, size=(1, 1)), 3, casts=True)
    grass = Ground(FLAT, "grass", Strata((60, 60), 2), rng=2)
    one, two = (pa.Scene(DAY, objects).paint(CAMERA) for objects in ([stone, grass], [grass, stone]))
    assert np.abs(one - two).mean() < 1e-4
    empty = pa.Scene(DAY, [stone, grass], lights=[])
    assert empty.light() == ()
    # What has no light is as dark as in a light of next to no strength, which can cast no shadow either.
    unlit = replace(empty, lights=Light((0, 0, 1), 1e-9), cast_shadows=False)
    assert empty.paint(CAMERA) == pytest.approx(unlit.paint(CAMERA), abs=1e-6)


def test_water_is_the_sky_it_reflects():
    water = Ground(
        FLAT, "water", Strata((30, 30), 3, displacement=0.0, size=(4, 2), fade_from=1.0), rng=1, roughness=0.0
    )
    scene = pa.Scene(DAY, [water], visibility=1e9)
    camera = pa.Camera(120, 80, fov=30, elevation=-8, position=(0, -5, 2))
    ((part, strokes),) = scene.strokes(camera).items()
    (shading,) = scene._shaded({part: strokes}, camera)
    look = strokes.position - camera.position
    look /= np.linalg.norm(look, axis=1, keepdims=True)
    up = DAY.without_disc().radiance(look * [1, 1, -1])
    share = 0.02 + 0.98 * (1 - np.abs(look[:, 2:])) ** 5
    body = pa.paint.shade(strokes, scene._effective_style, camera, scene.light(), circles=scene.circles).sprites.color
    # The water's own colour is a reflectance, and all of its strokes lie level.
    middle = np.mean(scene.style.material("water").palette.mid, axis=0)
    falls = DAY.irradiance([(0, 0, 1)])[0] / np.pi
    own = body * (luminance(middle) / luminance(body))[:, None] ** 0.6 * falls
    assert shading.sprites.color == pytest.approx(share * up + (1 - share) * own, rel=5e-3)
    # What is flat before the eye is nearly all sky, what lies at its feet is the water's own colour.
    assert share.max() > 0.7
    assert share.min() < 0.2


def test_a_tree_stands_on_its_head_in_water():
    water = Ground(
        FLAT, "water", Strata((60, 60), 3, displacement=0.0, size=(4, 1), fade_from=1.0), rng=1, roughness=0.0
    )
    x, z = np.meshgrid(np.linspace(-4, 4, 17), np.linspace(0.5, 6, 12))
    wall = Strokes(np.stack([x, 58 + 0 * x, z], -1).reshape(-1, 3), (0, -1, 0.2), (1.5, 1.5))
    camera = pa.Camera(160, 120, fov=30, elevation=-3, position=(0, -5, 3))
    bare = pa.Scene(DAY, [water], cast_shadows=False).paint(camera)
    seen = pa.Scene(DAY, [water, wall], cast_shadows=False).paint(camera)
    changed = np.abs(seen - bare).max(axis=2) > 0.04
    to = np.array([[0, 58, 6], [0, 58, -3]]) - camera.position
    x, y, z = camera._axes() @ to.T
    rows = 60 - 60 / np.tan(np.radians(15)) * y / z
    assert changed[round(rows[1]) - 3 : round(rows[1]) + 3, 74:86].mean() > 0.7, "below the foot, as deep as it is high"
    assert not changed[-20:].any(), "and nowhere else"
    # A wall below the water is not mirrored above it.
    sunk = replace(wall, position=wall.position - [0, 0, 9])
    assert np.abs(pa.Scene(DAY, [water, sunk], cast_shadows=False).paint(camera) - bare)[-20:].max() < 0.02


def test_rocks_cast_shadows_and_their_strokes_do_not():
    stone = rock((6, 6, 4), (0, 20, 0), rng=1)
    strata = Strata((16, 16), 4, displacement=0.02, size=(1.2, 1.0), fade_from=1.0)
    grass = Ground(FLAT, "grass", Strata((60, 60), 2, size=(0.6, 0.6)), rng=2)
    low = replace(DAY, sun=pa.Sun(25, 270))
    for casts in (True, False):
        scene = pa.Scene(low, [Ground(stone, "rock", strata, 3, casts=casts), grass])
        parts = {part.kind: strokes for part, strokes in scene.strokes().items()}
        at, lit = parts["grass"].position, np.asarray(parts["grass"].lit)
        shade = (np.abs(at[:, 1] - 20) < 1) & (at[:, 0] > 3.5) & (at[:, 0] < 6)
        light = (np.abs(at[:, 1] - 20) < 1) & (at[:, 0] < -4)
        assert (lit[shade].mean() < 0.4) == casts
        assert lit[light].min() > 0.95
    assert np.asarray(parts["rock"].lit).min() == 1


def test_a_rock_is_one_closed_surface_of_its_size():
    trimesh = pytest.importorskip("trimesh")
    for seed in range(4):
        stone = rock((3, 2, 1), (5, 6, 7), rng=seed)
        mesh = trimesh.Trimesh(stone.vertices, stone.faces, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert 0.3 < mesh.volume / (4 / 3 * np.pi * 1.5 * 1.0 * 0.75) < 1
        assert (np.abs(mesh.bounds - [5, 6, 7]) <= [1.5, 1.0, 1.0 + 1e-9]).all()
    assert np.array_equal(rock(rng=3).vertices, rock(rng=np.random.SeedSequence(3)).vertices)
    assert np.abs(rock(rng=3).vertices - rock(rng=4).vertices).max() > 0.05
    with pytest.raises(ValueError, match="facets"):
        rock(facets=3)


def test_a_painted_sky_stays_among_the_stars():
    scene = pa.Scene(DAY, sky_strokes=4000)
    smooth = pa.Scene(DAY).paint(CAMERA)
    painted = scene.paint(CAMERA)
    assert 0.002 < np.abs(painted - smooth).mean() < 0.05, "strokes, of the sky's own colours"
    assert painted[:48].mean() == pytest.approx(smooth[:48].mean(), rel=0.01), "above the horizon"
    # Turned by whole pixels at its middle row, the same strokes are seen, moved.
    step = 8
    turn = np.degrees(np.arctan(step / (45 / np.tan(np.radians(25)))))
    narrow = pa.Camera(160, 90, fov=50, elevation=0)
    low = pa.sky.Aoas(sun=pa.Sun(35, 20), ambiguity=0.0)
    one, two = (pa.Scene(low, sky_strokes=4000).paint(replace(narrow, azimuth=a)) for a in (0.0, turn))
    here, there = one[16:34, 70 + step : 86 + step], two[16:34, 70:86]
    bare = pa.Scene(low).paint(narrow)
    detail = [x - bare[16:34, 70:86] for x in (here, there, one[16:34, 70:86])]
    along = [np.corrcoef(detail[1].ravel(), d.ravel())[0, 1] for d in (detail[0], detail[2])]
    assert along[0] > 0.8
    assert along[0] > along[1] + 0.2, "strokes move with the sky and not with the picture"


def test_the_air_of_the_sky_leaves_a_fiftieth_of_the_contrast_at_the_visibility():
    far = [100.0, 500.0, 1000.0, 2000.0]
    strokes = Strokes([[0.0, y, 0.0] for y in far], (0, -1, 0), (1, 1), label=[1] * 4)
    (own,), (seen,) = (
        scene._shaded(scene.strokes(), CAMERA)
        for scene in (pa.Scene(DAY, [strokes], visibility=v) for v in (1e9, 1000.0))
    )
    horizon = DAY.without_disc().radiance([[0, 1, 1e-3]])[0]
    contrast = (seen.sprites.color - horizon) / (own.sprites.color - horizon)
    # Koschmieder's law, at a tenth, a half, once and twice the visibility.
    assert contrast == pytest.approx(np.repeat(0.02 ** (np.array(far) / 1000)[:, None], 3, axis=1), abs=2e-3)
    assert np.ptp(own.sprites.color, axis=0).max() < 1e-3 * own.sprites.color.max(), "the style's own atmosphere is off"
    with pytest.raises(ValueError, match="visibility"):
        pa.Scene(DAY, visibility=0)


def test_stages_show_each_step_of_the_shader():
    scene = pa.Scene(DAY, [Placed(Tree.grow(preset("oak"), rng=2), (0, 20, -3))], grown=False)
    stages = scene.stages(CAMERA)
    there = stages["mask"] > 0.5
    assert all(s.shape == (90, 160) for s in stages.values())
    assert np.isfinite(stages["final"][there]).all()
    assert np.isnan(stages["final"][stages["mask"] == 0]).all()
    assert (stages["final"][there] <= stages["placed"][there] + 1e-6).all(), "shadows only take"
    assert stages["depth"][there].min() > 10
    assert np.isinf(pa.Scene(DAY).stages(CAMERA)["depth"]).all()


def test_lights_and_clouds_move_in_time():
    tree = Placed(Tree.grow(preset("oak"), rng=2), (0, 20, -3))
    scene = pa.Scene(DAY, [tree], clouds=CLOUD, grown=False)
    line = pa.Timeline(
        CAMERA,
        lights=lambda t: [Light((1 - 2 * t, -0.3, 0.5))],
        cloud_params=lambda t: pa.clouds.Params(light_intensity=1000 + 4000 * t),
        trunk_circles=lambda t: (5.0 + t, 50.0),
    )
    first, last = scene.frame(line, 0.0), scene.frame(line, 1.0)
    assert np.array_equal(first, scene.frame(line, 0.0)), "a frame is a function of its time"
    # The light goes from east to west, and the cloud becomes brighter.
    half = np.arange(160) < 80
    stages = scene.stages(CAMERA)
    crown = stages["mask"] > 0.9
    east = [float(f[crown & ~half].mean() - f[crown & half].mean()) for f in (first, last)]
    assert east[0] > east[1] + 0.005
    sky = (stages["mask"] == 0) & (pa.clouds.render(CLOUD, pa.clouds.Params(), CAMERA, DAY.sun).transmittance < 0.1)
    assert last[sky].mean() > first[sky].mean()


def test_the_law_of_growth_is_solved_once_whatever_the_light(monkeypatch):
    calls = []

    def counted(*given, **_):
        calls.append(1)
        return solved(*given, knots=3, pixels=48)

    solved = scene_strokes.growth
    monkeypatch.setattr(scene_strokes, "growth", counted)
    scene_strokes._law.cache_clear()
    tree = Placed(Tree.grow(preset("shrub"), rng=9), (0, 9, 0))
    for azimuth in (90, 180, 270):
        pa.Scene(replace(DAY, sun=pa.Sun(30, azimuth)), [tree, replace(tree, position=(3, 9, 0))]).strokes(CAMERA)
    scene_strokes._law.cache_clear()
    assert len(calls) == 1


def test_the_landscape_is_what_chapter_ii_sees_in_corot():
    scene, camera = pa.demo.landscape(style=pa.paint.style("corot"), cloud=False, grown=False)
    camera = camera.resized(320, 180)
    picture, stages = scene.paint(camera), scene.stages(camera)
    lab = pa.color.rgb_to_lab(np.asarray(picture, np.float64))
    solid = stages["mask"] > 0.98
    near, far = solid & (stages["depth"] < 30), solid & (stages["depth"] > 250) & (stages["depth"] < 1e4)
    assert near.sum() > 2000
    assert far.sum() > 300
    # Distance is cooler and paler, its contrast lower; what is near is warm.
    assert lab[near, 2].mean() > lab[far, 2].mean() + 12
    assert np.hypot(lab[near, 1], lab[near, 2]).mean() > 1.5 * np.hypot(lab[far, 1], lab[far, 2]).mean()
    assert lab[near, 0].std() > 1.3 * lab[far, 0].std()
    # Shadows are mixed with colour: nothing is black.
    assert np.quantile(lab[solid, 0], 0.001) > 10
    # The edges of foliage are broken: along the rim of the crowns there is much that is neither leaf nor sky.
    crowns = (stages["depth"] < 90) & (np.arange(180) < 100)[:, None]
    partly = crowns & (stages["mask"] > 0.05) & (stages["mask"] < 0.95)
    assert partly.sum() > 300
    # Detail is where the eye should go.
    detail = np.abs(np.diff(lab[..., 0], axis=1))
    assert detail[near[:, 1:]].mean() > 1.1 * detail[far[:, 1:]].mean()

"""Shen, Mallett and Shkurko 2019 (AOAS): eqs 5-8, figs 1 and 8-13, styles, and the light that a sky sheds."""

import itertools
import json
import math
import multiprocessing
import pickle
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.sky import Aoas, CloudPoints, CloudSpline, Principle, contact_sheet, from_json, mix, preset, presets
from scipy.optimize import least_squares

# Nothing but the air.
PLAIN = {"disc": 0.0, "ambiguity": 0.0, "cloud_complexity": 0.0, "shapes": ()}
CAMERA = pa.Camera(40, 28, fov=80, azimuth=180, elevation=25)


def rel(a, b, floor=0.0):
    return float((np.abs(np.asarray(a, float) - b) / (np.abs(b) + floor)).max())


# ---- Eqs 5-6: ambiguity.


def test_ambiguity_is_of_its_seed_and_nothing_else():
    sky = preset("pointillist")
    still = sky.render(CAMERA)
    for threads in (1, 2):
        pa.set_num_threads(threads)
        assert np.array_equal(sky.render(CAMERA), still)
    assert not np.array_equal(replace(sky, rng=6).render(CAMERA), still)
    assert np.array_equal(replace(sky, ambiguity=0.0, rng=6).render(CAMERA), replace(sky, ambiguity=0.0).render(CAMERA))
    assert np.array_equal(
        replace(preset("pointillist", **PLAIN)).render(CAMERA), replace(sky, ambiguity=0.0).render(CAMERA)
    )


def test_one_displacement_explains_a_cell_and_stays_in_its_neighbourhood():
    size, grain, rng = 0.4, 0.25, np.random.default_rng(3)
    skies = [Aoas(sun=pa.Sun(60, a), g=0.3, mie=0.02, ambiguity=size, grain=grain, rng=9) for a in (20, 140, 260)]
    found = []
    for low in np.array([(0.25, 0.5, 0.75), (0.5, 0.25, 0.75), (-0.5, 0.5, 0.5), (-0.25, 0.75, 0.5)]):
        d = low + grain * rng.uniform(0.05, 0.95, (400, 3))
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        d = d[((d > low + 0.01) & (d < low + grain - 0.01)).all(1)][:12]
        assert len(d) > 3
        seen = np.stack([s.radiance(d) for s in skies]).astype(float)

        def off(x, d=d, seen=seen):
            return np.log(np.stack([replace(s, ambiguity=0.0).radiance(d + x) for s in skies]) / seen).ravel()

        starts = [least_squares(off, rng.uniform(-0.2, 0.2, 3), diff_step=1e-3) for _ in range(3)]
        best = min(starts, key=lambda fit: fit.cost)
        assert np.abs(best.fun).max() < 2e-4
        assert np.abs(best.x).max() < size / 2 + 1e-3
        found.append(best.x)
    assert min(np.abs(a - b).max() for i, a in enumerate(found) for b in found[:i]) > 0.01


def test_a_turning_camera_finds_every_cell_again():
    sky = Aoas(sun=pa.Sun(30, 200), ambiguity=0.3, grain=0.1, rng=1, g=0.5)
    for azimuth in (180, 183.7, 201):
        camera = pa.Camera(64, 48, azimuth=azimuth, elevation=20)
        same = np.abs(sky.render(camera) / sky.radiance(camera.directions()[::-1])[::-1] - 1) < 1e-3
        assert same.mean() > 0.995


def test_a_small_neighbourhood_keeps_the_mean_and_a_huge_one_is_a_sky_still():
    sky = Aoas(sun=pa.Sun(50, 0), grain=1 / 200, g=0.5)
    mean = sky.render(CAMERA).mean((0, 1))
    for size in (0.02, 0.1):
        assert rel(replace(sky, ambiguity=size).render(CAMERA).mean((0, 1)), mean) < 0.02
    huge = replace(sky, ambiguity=1000.0).render(CAMERA)
    assert np.isfinite(huge).all()
    assert huge.std(axis=(0, 1)).min() > 0.05 * mean.max()


# ---- Eqs 7-8: clouds.


def hsv(rgb):
    return np.asarray(pa.color.rgb_to_hsv(np.asarray(rgb, np.float64)))


def saturation_factor(sky, camera=CAMERA):
    """By how much principles scale the saturation; hue and value stay, or it fails."""
    before = hsv(replace(sky, **PLAIN).render(camera))
    after = hsv(replace(sky, disc=0.0, ambiguity=0.0).render(camera))
    factor = after[..., 1] / before[..., 1]
    colored = factor > 1e-2  # grey has no hue
    turn = np.abs(after[..., 0] - before[..., 0])
    assert np.minimum(turn, 1 - turn)[colored].max() < 1e-5
    assert rel(after[..., 2], before[..., 2]) < 1e-5
    return factor


@pytest.mark.parametrize("name", ["noon", "crystal", "dystopia", "violet", "smiley", "heart"])
def test_clouds_change_nothing_but_the_saturation(name):
    factor = saturation_factor(preset(name))
    assert factor.min() > -1e-6
    assert factor.max() < 1 + 1e-5
    assert factor.min() < 0.5
    assert factor.max() > 0.6


def test_clouds_are_of_their_seed_and_of_the_dome():
    sky = preset("crystal")
    assert not np.array_equal(replace(sky, rng=3).render(CAMERA), sky.render(CAMERA))
    # The noise is of the fragment: whichever way one looks at it, and whatever colour the sky is.
    seen = saturation_factor(sky)
    assert np.abs(saturation_factor(replace(sky, rayleigh=(0.03, 0.01, 0.02))) - seen).max() < 1e-4
    viewer = (0.4, -0.2, 0.3)
    moved = replace(sky, viewer=viewer)
    d = sky.fragments(CAMERA.directions()) - np.array(viewer)
    factor = hsv(moved.radiance(d))[..., 1] / hsv(replace(moved, **PLAIN).radiance(d))[..., 1]
    assert np.abs(factor - seen).max() < 1e-4
    # Finer noise changes faster.
    rough = [np.abs(np.diff(saturation_factor(replace(sky, cloud_complexity=s)), axis=1)).mean() for s in (2, 8)]
    assert rough[1] > 2 * rough[0]


def distance(fragments, line):
    """On the dome, from every fragment to the nearest of many points."""
    chord = np.linalg.norm(fragments[..., None, :] - line, axis=-1).min(-1)
    return 2 * np.arcsin(np.minimum(chord / 2, 1))


def catmull_rom(points, closed, steps):
    """Centripetal, by Barry and Goldman's pyramid, thrown onto the dome."""
    p = np.asarray(points, float)
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    ring = [p[-1], *p, p[0], p[1]] if closed else [2 * p[0] - p[1], *p, 2 * p[-1] - p[-2]]
    out = []
    for q in zip(ring[:-3], ring[1:-2], ring[2:-1], ring[3:], strict=True):
        k = np.cumsum([0, *(np.sqrt(np.linalg.norm(b - a)) for a, b in itertools.pairwise(q))])
        t = np.linspace(k[1], k[2], steps)[:, None]
        level = list(q)
        for step in (1, 2, 3):
            level = [
                (level[i] * (k[i + step] - t) + level[i + 1] * (t - k[i])) / (k[i + step] - k[i])
                if step < 3
                else (level[i] * (k[2] - t) + level[i + 1] * (t - k[1])) / (k[2] - k[1])
                for i in range(len(level) - 1)
            ]
        out.append(level[0])
    line = np.concatenate(out)
    return line / np.linalg.norm(line, axis=1, keepdims=True)


POINTS = [(0, -3, 1), (0.4, -1, 0.9), (-0.5, -0.8, 0.3), (0.1, -0.9, 1.2)]


@pytest.mark.parametrize("viewer", [(0, 0, 0), (0.3, 0.2, 0.4)])
@pytest.mark.parametrize("radius", [0.05, 0.4, 3.0])
def test_points_fade_with_the_great_circle(viewer, radius):
    sky = Aoas(sun=pa.Sun(50, 20), viewer=viewer, shapes=[CloudPoints(POINTS, radius)])
    unit = np.array(POINTS) / np.linalg.norm(POINTS, axis=1, keepdims=True)
    want = 1 - np.maximum(0, 1 - distance(sky.fragments(CAMERA.directions()), unit) / radius)
    # A hundred thousandth of the radius, or what float32 makes of a place on the dome.
    assert np.abs(saturation_factor(sky) - want).max() < 1e-5 + 2e-7 / radius


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("radius", [0.1, 0.5])
def test_splines_fade_with_the_distance_to_the_curve(closed, radius):
    sky = Aoas(sun=pa.Sun(50, 20), shapes=[CloudSpline(POINTS, radius, closed)])
    fragments, seen = sky.fragments(CAMERA.directions()), saturation_factor(sky)
    # The curve is drawn in twelve lines from point to point: here the same lines, densely sampled.
    knots = catmull_rom(POINTS, closed, 13)
    share = np.linspace(0, 1, 200)[:, None]
    lines = np.concatenate([a + (b - a) * share for a, b in itertools.pairwise(knots)])
    want = 1 - np.maximum(0, 1 - distance(fragments, lines) / radius)
    assert np.abs(seen - want).max() < 5e-4
    assert want.min() < 0.1
    assert want.max() == 1
    # They leave the curve itself by up to 0.003 dome radii at a turn between points that are 50 degrees apart.
    want = 1 - np.maximum(0, 1 - distance(fragments, catmull_rom(POINTS, closed, 250)) / radius)
    assert np.abs(seen - want).max() < 3e-3 / radius


def test_several_shapes_multiply():
    one, two = CloudPoints(POINTS[:1], 0.6), CloudSpline(POINTS[1:], 0.5)
    sky = Aoas(sun=pa.Sun(50, 20))
    both = saturation_factor(replace(sky, shapes=[one, two]))
    each = saturation_factor(replace(sky, shapes=[one])) * saturation_factor(replace(sky, shapes=[two]))
    assert np.abs(both - each).max() < 1e-5


@pytest.mark.parametrize("name", ["smiley", "heart"])
def test_a_drawing_changes_the_sky_near_it_only(name):
    sky, camera = preset(name), pa.Camera(64, 48, fov=90, azimuth=180, elevation=22)
    bare = replace(sky, shapes=())
    near = camera.directions() @ np.array(pa.Sun(22, 180).direction) > math.cos(0.22 * 1.5)
    changed = np.abs(sky.render(camera) / bare.render(camera) - 1).max(-1) > 1e-4
    assert not changed[~near].any()
    assert 0.2 < changed[near].mean() < 0.95
    back = replace(camera, azimuth=0)
    assert rel(sky.render(back), bare.render(back).astype(float)) < 5e-7


# ---- Figs 11 and 12: hues.

HUES = {"yellow": (40, 65), "blue": (205, 245), "coral": (0, 20), "emerald": (140, 170), "violet": (255, 290)}


@pytest.mark.parametrize("name", HUES)
def test_a_sky_has_the_hue_of_its_name(name):
    low, high = HUES[name]
    for azimuth in (0, 90, 180, 270):
        picture = replace(preset(name), **PLAIN).render(replace(CAMERA, azimuth=azimuth))
        hue, saturation, _ = np.moveaxis(hsv(picture), -1, 0)
        assert low < 360 * np.percentile(hue, 2) < 360 * np.percentile(hue, 98) < high
        assert np.median(saturation) > 0.4


def test_the_grey_sky_is_grey():
    for azimuth in (0, 90, 180, 270):
        picture = preset("grey").render(replace(CAMERA, azimuth=azimuth))
        assert hsv(picture.mean((0, 1)))[1] < 0.1
        assert hsv(pa.color.srgb_encode(pa.tone.oneil(picture)))[..., 1].max() < 0.1


def test_sunset_is_redder_than_noon_near_the_sun():
    def red(sky):
        near = pa.Sun(sky.sun.elevation + 4, sky.sun.azimuth).direction
        r, _, b = replace(sky, **PLAIN).radiance(near)
        return r / b

    assert red(preset("sunset")) > 3 * red(preset("noon"))
    assert red(Aoas(sun=pa.Sun(1))) > 2 * red(Aoas(sun=pa.Sun(60)))
    rates = [red(replace(preset("clear"), sun=pa.Sun(e))) for e in (60, 30, 10, 3, 1)]
    assert rates == sorted(rates)


# ---- Styles: written, mixed, laid out.


def picture_of(name):
    return preset(name).render(CAMERA).tobytes()


@pytest.mark.parametrize("name", presets())
def test_a_style_survives_json_and_pickle(name):
    sky = preset(name, viewer=(0.1, 0, 0.2), ground=(0.1, 0.2, 0.3), rng=2**70 if name == "noon" else 3)
    for again in (
        from_json(sky.to_json()),
        from_json(json.dumps(json.loads(sky.to_json()))),
        pickle.loads(pickle.dumps(sky)),
    ):
        assert again == sky
        assert hash(again) == hash(sky)
        assert again.render(CAMERA).tobytes() == sky.render(CAMERA).tobytes()


def test_a_spawned_process_sees_the_same_sky():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(picture_of, ("violet",)) == picture_of("violet")


def test_between_two_styles():
    names = presets()
    for first, second in zip(names, names[1:] + names[:1], strict=True):
        a, b = preset(first), preset(second)
        assert mix(a, b, 0) == a
        assert mix(a, b, 1) == b
        assert mix(a, a, 0.3) == a
        styles = [mix(a, b, t) for t in np.linspace(0, 1, 11)]
        for value in (lambda s: s.sun.elevation, lambda s: s.rayleigh[0], lambda s: s.sun_intensity):
            steps = np.diff([value(s) for s in styles])
            assert (steps >= 0).all() or (steps <= 0).all()
        assert from_json(styles[5].to_json()) == styles[5]
    short = mix(Aoas(sun=pa.Sun(10, 350)), Aoas(sun=pa.Sun(10, 20)), 0.5).sun.azimuth
    assert short % 360 == pytest.approx(5)


def test_a_sheet_holds_the_pictures_it_says():
    sky, camera = preset("clear"), pa.Camera(32, 20, azimuth=200, elevation=15)
    sheet = contact_sheet(sky, camera=camera, gap=3, exposure=1.5, elevation=[5, 30], preset=["coral", "blue", "grey"])
    assert (sheet.shape, sheet.dtype) == ((43, 102, 3), np.float32)
    rest = np.ones((43, 102), bool)
    for i, elevation in enumerate((5, 30)):
        for j, name in enumerate(("coral", "blue", "grey")):
            part = np.s_[23 * i : 23 * i + 20, 35 * j : 35 * j + 32]
            want = preset(name, sun=pa.Sun(elevation, preset(name).sun.azimuth)).render(camera)
            assert np.array_equal(sheet[part], pa.tone.oneil(want, 1.5))
            rest[part] = False
    assert (sheet[rest] == 1).all()


# ---- Light.


def sphere(rows):
    """Directions of an equirectangular picture, and their solid angles."""
    polar, azimuth = (np.arange(rows)[:, None] + 0.5) * np.pi / rows, (np.arange(2 * rows) + 0.5) * np.pi / rows
    flat = np.sin(polar)
    d = np.stack(np.broadcast_arrays(flat * np.sin(azimuth), flat * np.cos(azimuth), np.cos(polar)), -1)
    weight = np.broadcast_to(2 * np.sin(np.pi / rows / 2) * flat * np.pi / rows, (rows, 2 * rows))
    return d.reshape(-1, 3), weight.reshape(-1, 1)


def brute_irradiance(sky, normals, rows=800):
    d, weight = sphere(rows)
    light = sky.radiance(d) * weight
    return np.array([np.maximum(d @ n, 0) @ light for n in normals])


NORMALS = np.array([(0, 0, 1), (1, 0, 0), (0, -0.6, 0.8), (0.48, 0.6, 0.64), (0, 0.6, -0.8)])


@pytest.mark.parametrize("name", ["clear", "sunset", "dusk", "heart", "violet"])
def test_irradiance_is_the_sum_over_the_sphere(name):
    sky = preset(name, disc=0.0)
    # The narrow peak of g = 0.99 wants a fine grid.
    want = brute_irradiance(sky, NORMALS, 300 if sky.g < 0.95 else 700)
    assert rel(sky.irradiance(NORMALS * 7, disc=False), want) < 5e-3
    light = sky.sun_light()
    sunny = sky.irradiance(NORMALS) - sky.irradiance(NORMALS, disc=False)
    assert np.abs(sunny - np.maximum(NORMALS @ light.direction, 0)[:, None] * light.irradiance).max() < 1e-9


def test_irradiance_knows_the_ground():
    sky = Aoas(sun=pa.Sun(40, 200), ground=(0.5, 1.0, 0.2), g=0.8)
    assert rel(sky.irradiance(NORMALS, disc=False), brute_irradiance(sky, NORMALS, 400)) < 5e-3
    assert rel(sky.irradiance((0, 0, -1), disc=False), np.pi * np.array(sky.ground)) < 5e-3


def test_sun_light_has_a_closed_form_at_the_zenith():
    for changes in ({}, {"mie_scale_height": 0.05, "mie": 0.03}, {"thickness": 2.0, "disc": 1.0}):
        sky = Aoas(sun=pa.Sun(90), **changes)
        t, scales = sky.thickness, (sky.scale_height, sky.mie_scale_height or sky.scale_height)
        depth = [s * (1 - math.exp(-t / s)) for s in scales]
        want = sky.sun_intensity * np.exp(-4 * np.pi * (np.array(sky.rayleigh) * depth[0] + sky.mie * depth[1]))
        light = sky.sun_light()
        assert rel(light.irradiance, want) < 1e-7
        assert light.angular_radius == (sky.disc or 0.2665)
    assert Aoas(sun=pa.Sun(-1)).sun_light().irradiance == (0, 0, 0)
    # The disc that is drawn sheds what the light does.
    sky = Aoas(sun=pa.Sun(50, 180), disc=2.0, mie=0.0)
    n = np.array(sky.sun.direction)
    drawn = brute_irradiance(sky, n[None], 1500) - brute_irradiance(sky.without_disc(), n[None], 1500)
    assert rel(drawn, np.array([sky.sun_light().irradiance])) < 1e-2


def basis(d):
    x, y, z = np.moveaxis(d, -1, 0)
    out = [0.28209479 + 0 * x, 0.48860251 * y, 0.48860251 * z, 0.48860251 * x, 1.09254843 * x * y, 1.09254843 * y * z]
    return np.stack([*out, 0.31539157 * (3 * z * z - 1), 1.09254843 * x * z, 0.54627422 * (x * x - y * y)])


def test_harmonics_are_the_projection_and_give_the_irradiance():
    sky = Aoas(sun=pa.Sun(40, 130), g=0.0)
    d, weight = sphere(400)
    projected = basis(d) @ (sky.radiance(d) * weight)
    got = sky.sh9()
    assert np.abs(got - projected).max() < 1e-3 * projected.max()
    n = np.random.default_rng(0).normal(size=(40, 3)) * (1, 1, 0.3) + (0, 0, 1.5)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    share = np.array([np.pi] + [2 * np.pi / 3] * 3 + [np.pi / 4] * 5)[:, None]
    # What degree 4 would add at a bright horizon is 6 %; where the ground is small there is no such brim, and 2 % hold.
    assert rel(basis(n).T @ (share * got), sky.irradiance(n, disc=False)) < 0.07
    small = replace(sky, radius_ratio=2.0)
    assert rel(basis(n).T @ (share * small.sh9()), small.irradiance(n, disc=False)) < 0.02


def test_a_probe_agrees_with_colour_science():
    # colour-science changes how numpy prints.
    with np.printoptions():
        colour = pytest.importorskip("colour")
    for name in presets():
        sky = preset(name)
        for view in ((90, 0), (30, 100), (5, 180)):
            probe = sky.probe(pa.Sun(*view).direction)
            xyz = colour.RGB_to_XYZ(np.array(probe.rgb), "ITU-R BT.709", apply_cctf_decoding=False)
            assert probe.luminance == pytest.approx(xyz[1], rel=1e-4)
            assert probe.xy == pytest.approx(xyz[:2] / xyz.sum(), rel=1e-4)
            cct = colour.temperature.xy_to_CCT(np.array(probe.xy), method="Hernandez 1999")
            known = 3000 <= cct <= 800_000
            assert math.isnan(probe.cct) if not known else probe.cct == pytest.approx(cct, rel=1e-6)
            assert math.isnan(probe.magnitude)


# ---- Exposure.


def test_oneils_curve_is_numpys():
    x = np.concatenate([10.0 ** np.linspace(-9, 3, 5000), [0.0]]).astype(np.float32)
    for exposure in (0.0, 0.3, 2.0, 50.0):
        want = pa.color.srgb_decode(-np.expm1(-exposure * x.astype(np.float64)))
        got = pa.tone.oneil(x, exposure)
        assert got.dtype == np.float32
        assert rel(got, want, 1e-30) < 1e-6


def test_levels_are_rounded_to_the_nearest():
    every = pa.color.srgb_decode(np.arange(256) / 255)
    assert (pa.tone.to_uint8(every) == np.arange(256)).all()
    x = np.random.default_rng(0).random(200_000).astype(np.float32) ** 3 * 1.1 - 0.01
    level = 255 * np.clip(pa.color.srgb_encode(x.astype(np.float64)), 0, 1)
    clear = np.abs(level % 1 - 0.5) > 1e-4
    assert clear.mean() > 0.999
    assert (pa.tone.to_uint8(x) == np.floor(level + 0.5))[clear].all()
    assert (np.diff(pa.tone.to_uint8(np.linspace(0, 1, 100_000)).astype(int)) >= 0).all()


# ---- Principles of the user's own.


class OwnClouds(Principle):
    def color(self, rgb, fragments, seed):
        assert seed == 12
        m = np.maximum(0, 1 - distance(fragments, np.array([[0, -0.8, 0.6]])) / 0.7)[:, None]
        value = rgb.max(-1, keepdims=True)
        return value - (1 - m) * (value - rgb)


class Mirrored(Principle):
    def move(self, fragments, seed):
        return fragments * (-1, 1, 1)


def test_a_principle_equal_to_a_built_in_one_gives_the_same_picture():
    for viewer in ((0, 0, 0), (0.2, 0.1, 0.3)):
        sky = Aoas(sun=pa.Sun(35, 160), rng=12, viewer=viewer)
        built_in = replace(sky, shapes=[CloudPoints([(0, -0.8, 0.6)], 0.7)])
        own = replace(sky, principles=[OwnClouds()])
        assert rel(own.render(CAMERA), built_in.render(CAMERA).astype(float)) < 1e-5
        assert rel(own.panorama(24), built_in.panorama(24).astype(float)) < 1e-5
    assert rel(replace(sky, principles=[Principle()]).render(CAMERA), sky.render(CAMERA).astype(float)) < 1e-5


def test_a_principle_moves_fragments_and_not_suns():
    sky = Aoas(sun=pa.Sun(35, 160), g=0.5)
    d = CAMERA.directions()
    assert rel(replace(sky, principles=[Mirrored()]).radiance(d), sky.radiance(d * (-1, 1, 1)).astype(float)) < 1e-6
    assert rel(replace(sky, principles=[Mirrored(), Mirrored()]).radiance(d), sky.radiance(d).astype(float)) < 1e-6

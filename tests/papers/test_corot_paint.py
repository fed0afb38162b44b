"""Losure 2008, painting: what docs/papers/corot.md claims of the shader (S), the detail (D) and the compositor."""

import dataclasses

import matplotlib.colors
import numpy as np
import pleinair as pa
import pytest
from pleinair import paint
from scipy.interpolate import CubicHermiteSpline
from scipy.ndimage import map_coordinates

NEUTRAL = paint.AerialPerspective(strength=0, saturation=0, value=(0, 1))
UP = paint.Light((0, 0, 1), strength=1.0)
# All in the foreground.
NEAR = {"circles": (1e6, 1e6)}


def plain(**params):
    """One material without any of the liberties."""
    bare = {"ambient": 0, "outer": 0, "inner": 0, "roughness": 0, "variation": 0, "shadow_bias": 0.4} | params
    palette = paint.Palette([(0, 0, 0)], [(0.5, 0.5, 0.5)], [(1, 1, 1)], mixing="light")
    material = paint.Material(palette, paint.StrokeParams(**bare))
    return paint.Style({"leaves": material}, atmosphere=NEUTRAL, tint=0)


def with_palette(style, palette):
    return dataclasses.replace(style, materials={"leaves": paint.Material(palette, style.material("leaves").params)})


def crown(n=2000, seed=0, size=0.7, center=(0.0, 20.0, 0.0), radius=3.0):
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(n, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    ratio = rng.random(n) ** (1 / 3)
    start = np.clip(1.02 - 0.9 * ratio + rng.normal(0, 0.05, n), 0.02, None)
    return paint.Strokes(
        v * ratio[:, None] * radius + center,
        v,
        size * rng.uniform(0.7, 1.3, (n, 1)) * [1, 1],
        center_ratio=ratio,
        branch_ratio=ratio,
        fade=np.stack([start, start + 0.12], axis=1),
        object=np.zeros(n, int),
        centers=[center],
        label=rng.integers(0, 2**32, n),
    )


def some(n=50, seed=1):
    rng = np.random.default_rng(seed)
    position = rng.uniform([-3, 8, -3], [3, 14, 3], (n, 3))
    ratios = rng.random((2, n))
    return paint.Strokes(position, rng.normal(size=(n, 3)), (0.5, 0.4), center_ratio=ratios[0], branch_ratio=ratios[1])


CAMERA = pa.Camera(160, 120, fov=40)


# --- S: the shader ------------------------------------------------------------------------------------------------


def test_s1_lightness_is_the_clamped_sum_over_lights():
    strokes = some()
    lights = [paint.Light((1, -2, 2), 0.7), paint.Light((-1, 0, 1), 0.9)]
    got = paint.shade(strokes, plain(), CAMERA, lights, **NEAR).lightness
    normal = strokes.normal / np.linalg.norm(strokes.normal, axis=1, keepdims=True)
    wanted = sum(x.strength * np.maximum(normal @ np.array(x.direction), 0) for x in lights)
    np.testing.assert_allclose(got, np.clip(wanted, 0, 1), atol=1e-6)
    assert got.max() == 1, "the sum is clamped"


def test_s2_outer_leaves_are_lighter_and_inner_ones_darker_until_they_are_far():
    ratio = np.linspace(0, 1, 21, dtype=np.float32)
    position = np.stack([0 * ratio, 10 + 0 * ratio, 0 * ratio], axis=1)
    strokes = paint.Strokes(position, (0, 0, 1), (1, 1), center_ratio=ratio, branch_ratio=ratio)
    style = plain(outer=0.3, inner=0.3, ambient=0.5)
    dark = [paint.Light((0, 0, -1))]
    near = paint.shade(strokes, style, CAMERA, dark, circles=(20, 30)).placed
    far = paint.shade(strokes, style, CAMERA, dark, circles=(1, 2)).placed
    assert (np.diff(near) >= 0).all()
    assert near[0] == pytest.approx(0.2, abs=1e-6)
    assert near[-1] == pytest.approx(0.8, abs=1e-6)
    assert far[0] == pytest.approx(0.5, abs=1e-6), "no darkening far away"


def test_s4_full_shadow_multiplies_by_exactly_the_shadow_bias():
    for bias in (0.2, 0.4, 0.5, 0.7):
        for curve in ("perlin", "schlick"):
            style = dataclasses.replace(plain(shadow_bias=bias), curve=curve)
            strokes = paint.Strokes([[0, 10, 0]] * 3, (0, 0, 1), (1, 1), lit=[0, 0.5, 1])
            shading = paint.shade(strokes, style, CAMERA, UP, **NEAR)
            assert shading.shadow[0] == np.float32(bias)
            assert shading.shadow[2] == 1
            if bias == 0.5:
                np.testing.assert_array_equal(shading.shadow, np.float32([0.5, 0.75, 1]))


def test_s5_shadow_chooses_the_colour_and_is_not_painted_over_it():
    style = dataclasses.replace(paint.style("corot"), atmosphere=NEUTRAL, tint=0, light_tint=0)
    strokes = dataclasses.replace(some(200), lit=np.random.default_rng(0).random(200))
    shading = paint.shade(strokes, style, CAMERA, paint.Light((1, -1, 1)), **NEAR)
    colors, which = paint.palette_colors(style.material("leaves").palette, shading.final)
    np.testing.assert_allclose(shading.sprites.color, colors, atol=1e-6)
    np.testing.assert_allclose(shading.palette, which, atol=1e-5)


def test_s6_strokes_cast_by_their_opacity_and_not_by_their_rectangles():
    style = plain(max_opacity=1.0)
    n = 96
    x = (np.arange(n) + 0.5) / n * 2 - 1
    ground = np.stack([*np.meshgrid(x, x), np.zeros((n, n))], axis=-1).reshape(-1, 3)
    caster = paint.Strokes([[0, 0, 5]], (0, 0, 1), (2, 2), label=[7])
    tiny = paint.Strokes(ground, (0, 0, 1), (2 / n, 2 / n), label=np.arange(n * n))
    own, lit = paint.shadows([caster, tiny], (0, 0, 1), style, casts=[True, False], pixels=512)
    assert own[0] == 1, "nothing is before it"
    shadow = lit.reshape(n, n) < 0.5
    params = style.material("leaves").params
    frequency = params.frequency + params.center_frequency + 0.5 * params.lightness_frequency
    # The light's view has axes of its own: the mask may be turned or mirrored.
    mask = paint.mask(7, n, n, frequency=frequency, opacity=1.0) > 0.5
    turns = [np.rot90(m, k) for m in (mask, mask.T) for k in range(4)]
    assert max((shadow & m).sum() / (shadow | m).sum() for m in turns) > 0.95
    assert shadow.mean() < 0.7, "not the rectangle"


def test_s6_shadows_are_the_product_of_what_stands_before():
    style = plain(max_opacity=0.5, feather_min=0.0, feather_max=0.0)
    stack = paint.Strokes([[0, 0, z] for z in (4, 3, 2, 1)], (0, 0, 1), (1, 1))
    # Full masks, so the transmittance is a half for each.
    lit = paint.shadows(stack, (0, 0, 1), style)[0]
    np.testing.assert_allclose(lit, [1, 0.5, 0.25, 0.125], rtol=1e-2)


def test_s7_frequency_rises_with_the_distance_from_the_centre_and_with_light():
    strokes = some()
    style = plain(frequency=2, center_frequency=5, lightness_frequency=3, stretch=(4, 0.5))
    shading = paint.shade(strokes, style, CAMERA, paint.Light((1, 1, 1)), **NEAR)
    wanted = 2 + 5 * strokes.center_ratio + 3 * shading.final
    np.testing.assert_allclose(shading.sprites.frequency, 4 * wanted, rtol=1e-5)
    np.testing.assert_allclose(shading.sprites.frequency_t, 0.5 * wanted, rtol=1e-5)


def test_s7_a_change_of_frequency_does_not_make_a_stroke_swim():
    # About the centre, noise is only scaled: at the centre itself it stays.
    for label in range(20):
        a, b = (paint.mask(label, 1, 1, frequency=f)[0, 0] for f in (3.0, 7.0))
        assert a == b


def test_s8_the_noise():
    rng = np.random.default_rng(0)
    at = rng.uniform(-1000, 1000, (400_000, 2))
    right, up = np.eye(2)
    n = paint.noise(5, at)
    assert abs(n.mean()) < 2e-3
    assert np.abs(n).max() <= 1
    # By hand: gradients uniform in the square have variance 1/3 in each coordinate; over a cell, with weights w(x) =
    # 1 - fade and fade, Var = 2/3 E[w² x² sum] E[w² sum].
    x = (np.arange(100_000) + 0.5) / 100_000
    f = x**3 * (x * (6 * x - 15) + 10)
    near, all_ = (((1 - f) * x) ** 2 + (f * (1 - x)) ** 2).mean(), ((1 - f) ** 2 + f**2).mean()
    assert n.var() == pytest.approx(2 / 3 * near * all_, rel=0.02)
    step = np.abs(paint.noise(5, at + 1e-6) - n)
    assert step.max() < 1e-5, "continuous, across the lattice too"
    assert abs(np.corrcoef(n, paint.noise(6, at))[0, 1]) < 0.01, "labels are independent"
    assert abs(np.corrcoef(n, paint.noise(5, at + right))[0, 1] - np.corrcoef(n, paint.noise(5, at + up))[0, 1]) < 0.01
    assert paint.coverage(0.4) == pytest.approx((0.5 + n > 0.4).mean(), abs=5e-3)


def test_s9_the_edge():
    areas = []
    e = ((np.arange(201) + 0.5) / 201 - 0.5) * np.pi
    for fullness in (0.2, 0.5, 0.8):
        # At frequency 0 the noise is one number for the stroke.
        m = paint.mask(1, 201, 201, frequency=0, fullness=fullness, feather_min=0, feather_max=1, opacity=1)
        bias = np.outer(np.cos(e), np.cos(e)) ** (np.log(fullness) / np.log(0.5))
        x = (0.5 + paint.noise(1, [0.0, 0.0])) * bias
        np.testing.assert_allclose(m, x * x * (3 - 2 * x), rtol=1e-5)
        areas.append((m > 0.1).mean())
    assert areas == sorted(areas), "fuller strokes are larger"
    border = paint.Sprites([[50, 50]], (60, 40), [1.0], (1, 1, 1), frequency=0, feather_min=0, feather_max=0, opacity=1)
    t = paint.composite(border, 100, 100).transmittance
    assert (t[:, :20] == 1).all()
    assert (t[:, 80:] == 1).all()
    assert (t[:30] == 1).all()
    assert t[50, 50] == 0


def test_s10_s11_feather_and_opacity():
    hard = paint.mask(3, 200, 200, feather_min=0.4, feather_max=0.4)
    assert set(np.unique(hard)) == {0.0, np.float64(np.float32(0.9))}, "a step, and the largest opacity"
    masks = [paint.mask(3, 200, 200, feather_min=0.5 - w, feather_max=0.5 + w) for w in (0.05, 0.1, 0.3)]
    between = [((m > 0.01) & (m < 0.89)).mean() for m in masks]
    assert between[0] < between[1] < between[2], "a wider gap is a softer edge"


def test_s12_palettes_meet_without_a_seam():
    for name in paint.styles():
        for kind in ("leaves", "grass", "rock", "bark"):
            palette = paint.style(name).material(kind).palette
            x = np.linspace(0, 1, 20_001)
            colors, which = paint.palette_colors(palette, x)
            assert np.abs(np.diff(colors, axis=0)).max() < 4e-3, (name, kind)
            assert (np.diff(which) >= 0).all()
            a, b, c, d = palette.cutoffs
            assert (which[x < a] == 0).all()
            assert (which[(x > b) & (x < c)] == 1).all()
            assert (which[x > d] == 2).all()


def test_k4_a_palette_is_that_of_its_picture():
    # Nine flats of one area each, in any order on the canvas: they come back, dark to light.
    colors = np.sort(np.random.default_rng(3).random((9, 3)) * 0.02, axis=0) + np.linspace(0.05, 0.9, 9)[:, None]
    canvas = np.repeat(np.random.default_rng(4).permutation(colors), 40, axis=0).reshape(18, 20, 3)
    palette = paint.Palette.from_picture(canvas, spline="catmull-rom")
    assert np.concatenate([palette.dark, palette.mid, palette.light]) == pytest.approx(colors, abs=1e-12)
    assert palette.spline == "catmull-rom"
    mask = np.zeros((18, 20), bool)
    mask[:, :10] = canvas[:, :10, 0] > 0.5
    bright = paint.Palette.from_picture(canvas, mask)
    shown = np.concatenate([bright.dark, bright.mid, bright.light])
    assert shown.min() > 0.5
    photo = pa.io.read(pa.demo.photograph())
    taken = paint.Palette.from_picture(photo, colors=4)
    order = pa.color.luminance(np.concatenate([taken.dark, taken.mid, taken.light]))
    assert (np.diff(order) > 0).all()
    assert order.mean() == pytest.approx(pa.color.luminance(photo).mean(), rel=1e-3), "equal shares of the pixels"
    with pytest.raises(ValueError, match="9 pixels"):
        paint.Palette.from_picture(canvas[:2, :4])


def test_s13_splines():
    knots = np.random.default_rng(3).random((5, 3))
    x = np.linspace(0, 1, 333)
    both = {"mixing": "light", "cutoffs": (0, 0, 1, 1), "raw": True}
    linear = paint.Palette([knots[0]], knots, [knots[-1]], **both)
    at = np.linspace(0, 1, 5)
    wanted = np.stack([np.interp(x, at, knots[:, c]) for c in range(3)], axis=1)
    np.testing.assert_allclose(paint.palette_colors(linear, x)[0], wanted, atol=2e-3)
    slope = np.gradient(knots, axis=0)
    slope[[0, -1]] *= 0.5
    wanted = CubicHermiteSpline(at, knots, slope * 4)(x)
    smooth = dataclasses.replace(linear, spline="catmull-rom")
    np.testing.assert_allclose(paint.palette_colors(smooth, x)[0], np.maximum(wanted, 0), atol=2e-3)


def test_s14_colour_varies_within_a_stroke_and_keeps_its_mean():
    n = 300
    rng = np.random.default_rng(0)
    center = np.stack([20 + 40 * (np.arange(n) % 20), 20 + 40 * (np.arange(n) // 20)], axis=1)
    flat = paint.Sprites(center, (36, 36), np.ones(n), (0.4, 0.3, 0.2), label=rng.integers(0, 2**32, n), opacity=1.0)
    varied = dataclasses.replace(flat, variation=(0.2, 0.1, 0.1))
    a, b = (paint.composite(s, 800, 600) for s in (flat, varied))
    np.testing.assert_array_equal(a.transmittance, b.transmittance)
    inside = a.transmittance < 0.01
    assert b.rgb[inside].std(axis=0)[0] > 0.02
    assert np.abs(b.rgb.sum((0, 1)) / a.rgb.sum((0, 1)) - 1).max() < 5e-3


def test_s15_s16_tint_and_distance():
    base = plain(ambient=0.6)
    base = with_palette(base, paint.Palette([(0.1, 0.3, 0.6)], [(0.1, 0.3, 0.6)], [(0.1, 0.3, 0.6)]))
    strokes = paint.Strokes([[0, 10, 0]], (0, 0, 1), (1, 1), object=[0], centers=[[0, 10, 0]], tint=[0.25])

    def color(style, **kw):
        return paint.shade(strokes, style, CAMERA, UP, **kw).sprites.color[0]

    mine = np.float32([0.1, 0.3, 0.6])
    np.testing.assert_allclose(color(base, **NEAR), mine, rtol=1e-6)
    tinted = dataclasses.replace(base, tints=((1, 0, 0), (0, 0, 1)), tint=0.1)
    np.testing.assert_allclose(color(tinted, **NEAR), 0.9 * mine + 0.1 * np.float32([0.75, 0, 0.25]), rtol=1e-5)
    air = paint.AerialPerspective(color=(0.5, 0.5, 0.5), strength=0.3, saturation=0.6, value=(0.3, 0.7), bias=0.2)
    far = dataclasses.replace(base, atmosphere=air)
    np.testing.assert_allclose(color(far, **NEAR), mine, rtol=1e-6, err_msg="the foreground is as it is")
    hsv = matplotlib.colors.rgb_to_hsv(pa.color.srgb_encode(0.7 * mine.astype(float) + 0.15))
    hsv[1], hsv[2] = min(hsv[1], 0.4), np.clip(hsv[2], 0.3, 0.7)
    wanted = pa.color.srgb_decode(matplotlib.colors.hsv_to_rgb(hsv))
    np.testing.assert_allclose(color(far, circles=(1, 2)), wanted, rtol=1e-5)


def test_g6_g11_random_normals_and_crests():
    n = 20_000
    strokes = paint.Strokes(np.tile([0.0, 10, 0], (n, 1)), (0, -1, 0), (1, 1))
    light = paint.Light((0, -1, 0), strength=1.0)
    smooth = paint.shade(strokes, plain(), CAMERA, light, **NEAR).lightness
    assert (smooth == 1).all(), "w = 0 is the surface's own shading"
    rough = paint.shade(strokes, plain(roughness=1.0), CAMERA, light, **NEAR).lightness
    # A random normal: half of them turned away, the others uniform in the cosine.
    assert (rough == 0).mean() == pytest.approx(0.5, abs=0.015)
    assert rough.mean() == pytest.approx(0.25, abs=0.01)
    normals = [[0, -1, 0], [0, -0.5, 0.866], [0, 0, 1]]
    strokes = paint.Strokes([[0, 10, 0]] * 3, normals, (1, 1))
    squeeze = paint.shade(strokes, plain(crest=0.3), CAMERA, light, **NEAR).sprites.squeeze
    assert squeeze[0] == 1
    assert squeeze[2] == pytest.approx(0.3)
    assert squeeze[0] > squeeze[1] > squeeze[2]
    one = paint.Sprites([[50, 50]], (40, 80), [1.0], (1, 1, 1), squeeze=0.3)
    rows = np.flatnonzero((paint.composite(one, 100, 100).transmittance < 1).any(axis=1))
    assert rows.min() >= 50 - 12 - 1
    assert rows.max() <= 50 + 12


def test_the_colours_of_light():
    style = with_palette(plain(ambient=0.5), paint.Palette([(0.5, 0.5, 0.5)], [(0.5, 0.5, 0.5)], [(0.5, 0.5, 0.5)]))
    strokes = paint.Strokes([[0, 10, 0]], (0, 0, 1), (1, 1))
    warm = paint.Light((0, 0, 1), 0.5, color=(2.0, 1.0, 0.5))
    r, g, b = paint.shade(strokes, style, CAMERA, warm, **NEAR).sprites.color[0]
    assert pa.color.luminance([[r, g, b]])[0] == pytest.approx(0.5, rel=1e-4)
    assert (r / g, b / g) == (pytest.approx(2), pytest.approx(0.5))


# --- D: detail and camera -----------------------------------------------------------------------------------------


def test_d1_distance_is_along_the_view_between_two_circles():
    x = np.linspace(-8, 8, 9)
    plane = paint.Strokes(np.stack([x, 0 * x + 20, x / 2], axis=1), (0, -1, 0), (1, 1))
    style = plain()
    d = paint.shade(plane, style, CAMERA, UP, circles=(10, 50)).distance
    np.testing.assert_allclose(d, 0.25, rtol=1e-6, err_msg="a plane across the view has one distance")
    for circles, wanted in (((20, 20), 1), ((20.01, 20.01), 0), ((30, 40), 0), ((1, 2), 1)):
        assert (paint.shade(plane, style, CAMERA, UP, circles=circles).distance == wanted).all(), circles
    rack = paint.shade(plane, style, CAMERA, UP, circles=(15, 25)).distance
    assert (rack == 0.5).all(), "circles move on their own"


def test_d4_a_tree_has_the_distance_of_its_centre():
    tree = crown(100)
    d = paint.shade(tree, plain(), CAMERA, UP, circles=(10, 30)).distance
    np.testing.assert_allclose(d, 0.5, rtol=1e-6)


def test_d5_leaves_fade_between_their_thresholds():
    strokes = paint.Strokes([[0, 10, 0]] * 3, (0, 0, 1), (1, 1), fade=[[0.2, 0.4], [0.5, 0.5], [2, 3]])
    opacity = np.array(
        [
            paint.shade(strokes, plain(), CAMERA, UP, circles=(10 - d, 11 - d)).sprites.opacity
            for d in np.linspace(0, 1, 101)
        ]
    )
    assert (np.diff(opacity, axis=0) <= 0).all()
    np.testing.assert_allclose(opacity[:, 2], 0.9, rtol=1e-6)
    assert opacity[19, 0] == pytest.approx(0.9)
    assert opacity[41, 0] == 0
    assert opacity[30, 0] == pytest.approx(0.45, rel=1e-3), "half way"
    assert set(np.unique(opacity[:, 1])) == {np.float32(0), np.float32(0.9)}, "equal thresholds are a step"


@pytest.fixture(scope="module")
def tree():
    style = dataclasses.replace(paint.style("corot"), largest=10.0, atmosphere=NEUTRAL)
    light = paint.Light((-0.6, -0.5, 0.7))
    strokes = crown(3000, size=0.8)
    return dataclasses.replace(strokes, growth=paint.growth(strokes, style, light, pixels=320)[None]), style, light


def seen(tree, style, light, eye, pixels, d):
    camera = pa.Camera.look_at(eye, tree.centers[0], pixels, pixels, fov=16)
    forward = (tree.centers[0] - eye) / np.linalg.norm(tree.centers[0] - eye)
    z = float((tree.centers[0] - eye) @ forward)
    circles = (z - d, z - d + 1)
    lit = paint.shadows(tree, light.direction, style, camera=camera, circles=circles, pixels=512)[0]
    canvas = paint.render(dataclasses.replace(tree, lit=lit), style, camera, light, circles=circles, order="hard")
    inside = canvas.transmittance < 0.5
    y = canvas.rgb @ np.float32([0.2126, 0.7152, 0.0722])
    return inside, y[inside].sum() / (1 - canvas.transmittance)[inside].sum()


def test_d6_d7_silhouette_and_tone_stay_while_the_outermost_leaves_go(tree):
    tree, style, light = tree
    law = tree.growth[0]
    assert law[0, 0] == 1
    assert (np.diff(law[0]) >= 0).all(), "strokes grow and never shrink"
    eye = np.array([3.0, -20.0, 6.0])
    whole, tone = seen(tree, style, light, eye, 400, 0.0)
    kept = {d: (1 - np.clip((d - tree.fade[:, 0]) / 0.12, 0, 1)).mean() for d in (0.1, 0.25, 0.4, 0.5)}
    for d, share in kept.items():
        assert share > 0.1
        now, light_now = seen(tree, style, light, eye, 400, d)
        assert now.sum() / whole.sum() == pytest.approx(1, abs=0.03), d
        assert (now & whole).sum() / (now | whole).sum() > 0.90, d
        assert light_now / tone == pytest.approx(1, abs=0.03), d
    without = dataclasses.replace(tree, growth=None)
    now, _ = seen(without, style, light, eye, 400, 0.5)
    assert now.sum() < 0.7 * whole.sum(), "it is the growth that does it"


def test_d8_detail_is_continuous(tree):
    tree, style, light = tree
    areas = [seen(tree, style, light, np.array([0.0, -20.0, 0.0]), 200, d)[0].sum() for d in np.linspace(0.3, 0.34, 9)]
    ring = np.pi * np.sqrt(areas[0] / np.pi) * 2
    assert np.abs(np.diff(areas)).max() < ring, "less than a pixel all around"


def test_d9_strokes_do_not_shrink_as_perspective_has_it(tree):
    tree, style, light = tree
    area, z = [], np.array([20.0, 40, 60, 80])
    for distance in z:
        camera = pa.Camera(400, 400, fov=20, position=(0, 20 - distance, 0))
        s = paint.shade(tree, style, camera, light, circles=(20, 120)).sprites
        area.append(np.median(s.size[s.opacity > 0.01].prod(axis=1)))
    power = -np.polyfit(np.log(z), np.log(area), 1)[0]
    assert power < 1.7, power


def test_the_extreme_foreground():
    strokes = paint.Strokes([[0, 0.5, 0]], (0, 0, 1), (1, 0.5))
    camera = pa.Camera(400, 400, fov=60)
    style = plain()
    size = paint.shade(strokes, style, camera, UP).sprites.size[0]
    assert size.max() <= style.largest * 400 * (1 + 1e-6), "a painter's size"
    assert size[0] / size[1] == pytest.approx(2)
    last = 0.0
    for y in np.geomspace(500, 0.01, 200):
        now = paint.shade(dataclasses.replace(strokes, position=[[0, y, 0]]), style, camera, UP).sprites.size[0, 0]
        assert now >= last, "never smaller when nearer"
        last = now
    ratio = np.linspace(0, 1, 11)
    row = paint.Strokes(np.tile([0, 5.0, 0], (11, 1)), (0, 0, 1), (1, 1), center_ratio=ratio)
    opacity = [paint.shade(row, style, camera, UP, close=(5 - e, 6 - e)).sprites.opacity for e in np.linspace(0, 1, 21)]
    assert (opacity[0] == 0).sum() > 5, "inner leaves give way"
    assert opacity[0][-1] > 0, "the outermost stay"
    assert (np.diff(opacity, axis=0) >= 0).all()
    assert (opacity[-1] == opacity[-1][0]).all(), "and all are back further away"


# --- The compositor -----------------------------------------------------------------------------------------------


def cloud(n=200, seed=0, twist=False, width=120, height=80, **kw):
    rng = np.random.default_rng(seed)
    return paint.Sprites(
        rng.uniform(-5, [width + 5, height + 5], (n, 2)),
        rng.uniform(6, 30, (n, 2)),
        rng.uniform(5, 9, n),
        rng.random((n, 3)),
        rotation=rng.uniform(-180, 180, n) if twist else 0.0,
        **kw,
    )


@pytest.mark.parametrize("order", ["hard", "slab"])
@pytest.mark.parametrize("twist", [False, True])
@pytest.mark.parametrize("variation", [None, (0.1, 0.2, 0.05)])
def test_the_fast_compositor_is_the_plain_formula(order, twist, variation):
    sprites = cloud(twist=twist, variation=variation, frequency=5.0, frequency_t=3.0)
    fast, slow = (paint.composite(sprites, 120, 80, order=order, delta=0.2, method=m) for m in ("fast", "reference"))
    assert np.abs(fast.rgb - slow.rgb).max() < 2e-5
    assert np.abs(fast.transmittance - slow.transmittance).max() < 2e-5


def test_one_stroke_alone_is_its_mask_in_any_order():
    one = paint.Sprites([[32, 32]], (50, 50), [5.0], (1, 1, 1), label=[9])
    hard = 1 - paint.composite(one, 64, 64).transmittance
    for delta in (1e-9, 0.1, 100.0):
        slab = 1 - paint.composite(one, 64, 64, order="slab", delta=delta).transmittance
        assert np.abs(slab - hard).max() < 1e-6
    middle = hard[7:57, 7:57]
    assert np.abs(middle - paint.mask(9, 50, 50)).max() < 1e-5


def test_thin_slabs_are_hard_order():
    sprites = cloud()
    gap = np.diff(np.sort(sprites.depth)).min()
    hard = paint.composite(sprites, 120, 80)
    for delta in (0.0, 0.4 * gap):
        slab = paint.composite(sprites, 120, 80, order="slab", delta=delta)
        assert np.abs(slab.rgb - hard.rgb).max() < 1e-5


def test_slabs_conserve_light():
    # A furnace: strokes of the light they stand in cannot be seen.
    sprites = dataclasses.replace(cloud(), color=(1, 1, 1))
    for order in ("hard", "slab"):
        canvas = paint.composite(sprites, 120, 80, order=order, delta=0.5)
        np.testing.assert_allclose(canvas.over((1.0, 1.0, 1.0)), 1, atol=2e-6)


def yaw(strokes, style, azimuth, **kw):
    camera = pa.Camera(160, 160, fov=30, azimuth=azimuth)
    return paint.shade(strokes, style, camera, paint.Light((1, -1, 1)), **NEAR).sprites, camera


def test_p1_turning_about_the_eye_changes_no_order():
    strokes, style = crown(1500), paint.style("corot")
    depths = [yaw(strokes, style, a)[0].depth for a in np.linspace(-5, 5, 21)]
    assert all((d == depths[0]).all() for d in depths), "the same bits: no swap is possible"


def test_p2_nothing_jumps_where_two_strokes_exchange_their_places():
    rng = np.random.default_rng(5)
    n = 300
    sprites = paint.Sprites(
        rng.uniform(0, 64, (n, 2)), (20, 20), rng.uniform(0, 2, n), rng.choice([0.15, 0.85], n)[:, None] * [1, 1, 1]
    )
    order = np.argsort(sprites.depth)
    jumps = {"hard": [], "slab": []}
    for k in range(40, 260, 20):
        i, j = order[k], order[k + 1]
        for how, found in jumps.items():
            pictures = []
            for sign in (-1, 1):
                depth = sprites.depth.copy()
                middle = 0.5 * (depth[i] + depth[j])
                depth[i], depth[j] = middle + sign * 1e-9, middle - sign * 1e-9
                moved = dataclasses.replace(sprites, depth=depth)
                pictures.append(paint.composite(moved, 64, 64, order=how, delta=0.05).rgb)
            found.append(np.abs(pictures[0] - pictures[1]).max() * 255)
    assert max(jumps["slab"]) <= 0.05
    assert max(jumps["hard"]) > 5, "there is something to pop"


def test_k1_strokes_stick_to_their_anchors():
    strokes = crown(40, size=2.0)
    style = plain()
    strays = []
    for t in np.linspace(0, 1, 12):
        camera = pa.Camera.look_at((4 * t, 0, 3 * t), (0, 20, 0), 240, 240, fov=30)
        sprites = paint.shade(strokes, style, camera, UP, **NEAR).sprites
        forward = np.array(camera.look_at((4 * t, 0, 3 * t), (0, 20, 0), 1, 1).directions()[0, 0])
        away = []
        for k in range(0, 40, 4):
            one = paint.Sprites(
                sprites.center[[k]],
                sprites.size[[k]],
                [1.0],
                (1, 1, 1),
                label=strokes.label[[k]],
                frequency=0.0,
                feather_min=0.0,
            )
            a = 1 - paint.composite(one, 240, 240).transmittance.astype(float)
            y, x = np.mgrid[:240, :240] + 0.5
            # The anchor by hand.
            v = strokes.position[k] - camera.position
            z = v @ forward
            right = np.cross(forward, [0, 0, 1])
            right /= np.linalg.norm(right)
            scale = 120 / np.tan(np.radians(15)) / z
            anchor = np.array([120 + v @ right * scale, 120 - v @ np.cross(right, forward) * scale])
            away.append(np.array([(a * x).sum(), (a * y).sum()]) / a.sum() - anchor)
        strays.append(away)
    strays = np.array(strays)
    assert np.abs(strays).max() < 0.25, "frequency 0: the mask is symmetric about the anchor"
    assert strays.std(axis=0).max() < 0.25


def warping_errors(**masks):
    """Error under true motion over an orbit of half a degree a frame, of four ways to order two-toned strokes."""
    strokes, style, pixels = crown(1500, size=1.2), plain(), 192
    tone = np.where(np.random.default_rng(0).random(1500) < 0.5, 0.15, 0.85)[:, None] * np.ones(3)
    found = {"by view depth": [], "by view depth, frozen": [], "slab": []}
    for t in range(4):
        frames = []
        for turn in np.radians([3.5 * t, 3.5 * t + 0.5]):
            eye = (20 * np.sin(turn), 20 - 20 * np.cos(turn), 0)
            camera = pa.Camera.look_at(eye, (0, 20, 0), pixels, pixels, fov=22)
            forward = pa.Camera.look_at(eye, (0, 20, 0), 1, 1).directions()[0, 0]
            sprites = paint.shade(strokes, style, camera, UP, **NEAR).sprites
            frames.append((dataclasses.replace(sprites, color=tone, **masks), (strokes.position - eye) @ forward))
        motion = frames[1][0].center - frames[0][0].center
        for how, errors in found.items():
            pictures = []
            for sprites, along in frames:
                if how == "slab":
                    pictures.append(paint.composite(sprites, pixels, pixels, order="slab", delta=0.3, seen=True))
                else:
                    depth = frames[0][1] if "frozen" in how else along
                    moved = dataclasses.replace(sprites, depth=depth)
                    pictures.append(paint.composite(moved, pixels, pixels, seen=True))
            index = pictures[0].index
            flow = motion[np.maximum(index, 0)]
            y, x = np.mgrid[:pixels, :pixels]
            there = map_coordinates(pictures[1].rgb[..., 0], [y + flow[..., 1], x + flow[..., 0]], order=1)
            inside = (index >= 0) & (pictures[0].transmittance < 0.1)
            errors.append(((there - pictures[0].rgb[..., 0]) ** 2)[inside].mean())
    return {how: float(np.mean(errors)) for how, errors in found.items()}


def test_w1_slabs_flicker_less_under_true_motion():
    smooth = warping_errors(frequency=0.0, frequency_t=0.0, feather_min=0.0)
    assert smooth["slab"] < smooth["by view depth"] / 3, smooth
    # Masks full of detail move across the pixels, and no order can help that: the error of an order that never changes.
    rough = warping_errors()
    assert rough["slab"] < rough["by view depth, frozen"] < rough["by view depth"], rough

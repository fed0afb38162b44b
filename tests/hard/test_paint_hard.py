"""Hard cases of pa.paint with a definite expectation."""

import dataclasses
import math
import pickle
import time

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core, paint

UP = paint.Light((0, 0, 1))
STYLE = paint.style("corot")
CAMERA = pa.Camera(96, 64, fov=40)


def sprites(n=400, seed=0, **kw):
    rng = np.random.default_rng(seed)
    values = {"center": rng.uniform(0, [200, 150], (n, 2)), "size": rng.uniform(2, 40, (n, 2))}
    values |= {"depth": rng.uniform(1, 9, n), "color": rng.random((n, 3))} | kw
    return paint.Sprites(**values)


def bits(canvas):
    return canvas.rgb.tobytes() + canvas.transmittance.tobytes()


@pytest.mark.parametrize("order", ["hard", "slab"])
@pytest.mark.parametrize("twist", [0.0, 33.0])
def test_every_simd_level_and_thread_count_gives_the_same_bits(order, twist):
    many = sprites(20_000, rotation=twist, variation=(0.1, 0.1, 0.1))
    seen = set()
    for threads in (1, 2):
        pa.set_num_threads(threads)
        for level in _core.simd_levels():
            _core.force_simd_level(level)
            seen.add(bits(paint.composite(many, 200, 150, order=order, delta=0.1)))
    assert len(seen) == 1


def test_shading_shadows_and_growth_do_not_depend_on_threads():
    rng = np.random.default_rng(0)
    n = 40_000
    start = rng.random(n)
    strokes = paint.Strokes(
        rng.normal((0, 10, 0), 1, (n, 3)),
        rng.normal(size=(n, 3)),
        (0.1, 0.1),
        fade=np.stack([start, start + 0.1], 1),
    )
    few = paint.Strokes(strokes.position[:300], strokes.normal[:300], (0.5, 0.5), fade=strokes.fade[:300])
    found = []
    for threads in (1, 2):
        pa.set_num_threads(threads)
        shading = paint.shade(strokes, STYLE, CAMERA, UP)
        parts = [
            shading.final,
            shading.sprites.color,
            shading.sprites.center,
            *paint.shadows(strokes, (1, 0, 1), STYLE),
        ]
        found.append([*parts, paint.growth(few, STYLE, UP, knots=4, pixels=48)])
    for a, b in zip(*found, strict=True):
        np.testing.assert_array_equal(a, b)


def test_nothing_to_paint():
    none = paint.Sprites(np.zeros((0, 2)), (1, 1), [], (1, 1, 1))
    for order in ("hard", "slab"):
        canvas = paint.composite(none, 5, 3, order=order, delta=1.0, seen=True)
        assert (canvas.rgb == 0).all()
        assert (canvas.transmittance == 1).all()
        assert (canvas.index == -1).all()
        assert np.isinf(canvas.depth).all()
    empty = paint.Strokes(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2)))
    assert paint.render(empty, STYLE, CAMERA, UP).transmittance.min() == 1
    assert paint.shadows(empty, (0, 0, 1), STYLE)[0].shape == (0,)
    assert paint.shadows([], (0, 0, 1), STYLE) == []
    assert (paint.growth(empty, STYLE, UP, knots=3) == 1).all()


def test_behind_the_camera_and_without_a_size_nothing_is_painted():
    for position, size in (((0, -5, 0), (1, 1)), ((0, 0, 0), (1, 1)), ((0, 5, 0), (0, 1)), ((0, 5, 0), (1, 0))):
        canvas = paint.render(paint.Strokes([position], (0, 0, 1), size), STYLE, CAMERA, UP)
        assert canvas.transmittance.min() == 1, (position, size)


def test_one_pixel_and_strange_sizes():
    for width, height in ((1, 1), (1, 200), (200, 1), (65, 33), (64, 32)):
        fast, slow = (paint.composite(sprites(), width, height, method=m) for m in ("fast", "reference"))
        assert fast.rgb.shape == (height, width, 3)
        assert np.abs(fast.rgb - slow.rgb).max() < 2e-4, "a closed tile leaves out 1e-4"


def test_full_opacity_in_slabs_is_capped():
    one = sprites(1, center=[[20, 20]], size=(30, 30), opacity=1.0, feather_min=0.0, feather_max=0.0)
    canvas = paint.composite(one, 40, 40, order="slab", delta=1.0)
    assert 0 < canvas.transmittance[20, 20] < 2e-6
    whole = paint.composite(one, 40, 40)
    np.testing.assert_allclose(canvas.rgb, whole.rgb, atol=5e-6)


def test_equal_depths_are_in_the_order_of_their_ids():
    a = sprites(50, depth=np.full(50, 3.0), id=np.arange(50))
    turn = np.arange(50)[::-1]
    fields = ("center", "size", "depth", "color", "label", "id")
    b = dataclasses.replace(a, **{name: getattr(a, name)[turn] for name in fields})
    assert bits(paint.composite(a, 200, 150)) == bits(paint.composite(b, 200, 150)), "not of their places"
    c = dataclasses.replace(a, id=a.id[turn])
    assert bits(paint.composite(a, 200, 150)) != bits(paint.composite(c, 200, 150))


def test_duplicates_and_coincident_slabs():
    one = sprites(1, center=[[20, 20]], size=(30, 30), label=[3])
    ten = sprites(10, center=np.tile([[20, 20]], (10, 1)), size=(30, 30), label=[3] * 10, depth=np.full(10, 2.0))
    t1 = paint.composite(one, 40, 40).transmittance.astype(float)
    for order in ("hard", "slab"):
        t = paint.composite(ten, 40, 40, order=order, delta=0.3).transmittance
        np.testing.assert_allclose(t, t1**10, atol=2e-5)


def test_many_strokes_in_one_tile():
    rng = np.random.default_rng(0)
    n = 100_000
    many = paint.Sprites(rng.uniform(8, 24, (n, 2)), (4, 4), rng.random(n), (0.5, 0.5, 0.5))
    start = time.perf_counter()
    for order in ("hard", "slab"):
        canvas = paint.composite(many, 32, 32, order=order, delta=0.1)
        np.testing.assert_allclose(canvas.over((0.5, 0.5, 0.5)), 0.5, atol=2e-4)
    assert time.perf_counter() - start < 20


def test_a_tile_with_too_many_strokes_under_way_is_painted_in_strips():
    rng = np.random.default_rng(3)
    n = 2000
    deep = paint.Sprites(
        rng.uniform(0, [64, 32], (n, 2)), (90, 90), rng.uniform(0, 1, n), rng.random((n, 3)), opacity=0.004
    )
    whole = paint.composite(deep, 64, 32, order="slab", delta=5.0)
    for row in range(0, 32, 8):
        part = paint.composite(
            dataclasses.replace(deep, center=deep.center - np.float32([0, row])), 64, 8, order="slab", delta=5.0
        )
        np.testing.assert_allclose(whole.rgb[row : row + 8], part.rgb, atol=2e-4)
        np.testing.assert_allclose(whole.transmittance[row : row + 8], part.transmittance, atol=2e-4)


@pytest.mark.parametrize("frequency", [0.0, 1e-3, 20.0, 1e3, 1e5])
def test_frequencies_from_nothing_to_above_nyquist(frequency):
    one = sprites(1, center=[[33.3, 31.7]], size=(50, 50), frequency=frequency)
    fast, slow = (paint.composite(one, 64, 64, method=m) for m in ("fast", "reference"))
    assert np.abs(fast.transmittance - slow.transmittance).max() < 2e-5
    if frequency >= 1e3:
        flat = paint.composite(dataclasses.replace(one, frequency=1e4, frequency_t=1e4), 64, 64)
        np.testing.assert_array_equal(fast.transmittance, flat.transmittance)


def test_what_pixels_cannot_carry_does_not_shimmer():
    # A stroke with cells below a pixel, moved by fractions of one: its paint stays the same to a few per cent.
    masses = []
    for shift in np.linspace(0, 1, 11):
        one = sprites(1, center=[[20 + shift, 20]], size=(12, 12), frequency=40.0)
        masses.append((1 - paint.composite(one, 40, 40).transmittance).sum())
    assert np.ptp(masses) < 0.02 * np.mean(masses)
    tiny = [
        (1 - paint.composite(sprites(1, center=[[20 + s, 20 + s]], size=(0.4, 0.4)), 40, 40).transmittance).sum()
        for s in np.linspace(0, 1, 11)
    ]
    assert min(tiny) > 0.3 * max(tiny), "strokes below a pixel do not vanish between pixel centres"


def test_a_twist_of_nothing_is_no_twist():
    a = paint.composite(sprites(100, rotation=1e-5), 200, 150)
    b = paint.composite(sprites(100), 200, 150)
    assert np.abs(a.rgb - b.rgb).max() < 1e-3
    one = sprites(1, center=[[32, 32]], size=(40, 20), label=[4])
    upright = paint.composite(one, 64, 64).transmittance
    turned = paint.composite(dataclasses.replace(one, rotation=90.0), 64, 64).transmittance
    assert np.abs(np.rot90(upright) - turned).max() < 2e-4, "counter-clockwise"


def test_far_from_the_origin_everything_is_the_same():
    rng = np.random.default_rng(0)
    # Steps of 2^-10 m, which 1e5 m away are still exact.
    position = np.round(rng.uniform([-4, 8, -3], [4, 16, 3], (500, 3)) * 1024) / 1024
    here = paint.Strokes(position, (0, -1, 1), (0.5, 0.5))
    pictures = []
    for away in (np.zeros(3), np.array([1e5, -1e5, 4096.0])):
        camera = dataclasses.replace(CAMERA, position=tuple(away))
        pictures.append(paint.render(dataclasses.replace(here, position=position + away), STYLE, camera, UP, delta=0.1))
    assert bits(pictures[0]) == bits(pictures[1])


def test_slabs_far_away_do_not_lose_their_depth():
    near = sprites(200)
    far = dataclasses.replace(near, depth=near.depth + 2.0**20)
    a, b = (paint.composite(s, 200, 150, order="slab", delta=0.25) for s in (near, far))
    assert np.abs(a.rgb - b.rgb).max() < 1e-5


def test_slabs_of_very_different_thickness():
    rng = np.random.default_rng(1)
    delta = 10.0 ** rng.uniform(-4, 0, 400)
    fast, slow = (
        paint.composite(sprites(), 60, 40, order="slab", delta=delta, method=m) for m in ("fast", "reference")
    )
    assert np.abs(fast.rgb - slow.rgb).max() < 2e-4


def test_seen_is_the_stroke_with_the_largest_weight():
    two = paint.Sprites(
        [[20, 20], [20, 20]], (30, 30), [2.0, 1.0], (1, 1, 1), opacity=[1.0, 0.2], feather_min=0, feather_max=0
    )
    canvas = paint.composite(two, 40, 40, seen=True)
    assert canvas.index[20, 20] == 0, "the near one is thin"
    assert canvas.depth[20, 20] == pytest.approx(0.2 * 1 + 0.8 * 2, rel=1e-6)
    assert canvas.index[0, 0] == -1
    assert paint.composite(two, 40, 40).index is None


def test_inputs_of_every_kind_are_read_and_never_changed():
    n = 30
    rng = np.random.default_rng(0)
    center = np.asfortranarray(rng.uniform(0, 60, (n, 2)))
    depth = rng.random(2 * n)[::2]
    for a in (center, depth):
        a.flags.writeable = False
    got = paint.Sprites(center, (9, 7), depth, (0.5, 0.2, 0.1), frequency=np.float32(3), id=list(range(n)))
    plain = paint.Sprites(
        center.copy(), np.tile([9.0, 7.0], (n, 1)), depth.copy(), np.tile([0.5, 0.2, 0.1], (n, 1)), frequency=3
    )
    assert bits(paint.composite(got, 60, 60)) == bits(paint.composite(plain, 60, 60))


BAD = {
    "center": [[math.nan, 1]],
    "size": [[1, math.inf]],
    "depth": [math.nan],
    "color": [[1, math.nan, 1]],
    "variation": [[math.inf, 0, 0]],
}


@pytest.mark.parametrize("name", BAD)
def test_numbers_that_are_none_are_refused_by_name(name):
    one = sprites(1, **{name: BAD[name]})
    with pytest.raises(ValueError, match=name):
        paint.composite(one, 8, 8)


@pytest.mark.parametrize(
    ("kw", "error", "match"),
    [
        ({"center": [[1, 2, 3]]}, ValueError, "center"),
        ({"size": [1, 2, 3]}, ValueError, "size"),
        ({"opacity": 1.5}, ValueError, "opacity"),
        ({"opacity": [math.nan]}, ValueError, "opacity"),
        ({"opacity": "much"}, (TypeError, ValueError), "opacity"),
        ({"rotation": math.nan}, ValueError, "rotation"),
        ({"label": [0.5]}, TypeError, "label"),
        ({"label": [-1]}, ValueError, "label"),
        ({"id": [1, 2]}, ValueError, "id"),
        ({"fullness": 1.0}, ValueError, "fullness"),
        ({"feather_min": 0.7, "feather_max": 0.6}, ValueError, "feather_max"),
        ({"feather_min": -0.1}, ValueError, "feather_min"),
        ({"frequency": -1}, ValueError, "frequency"),
        ({"squeeze": 0}, ValueError, "squeeze"),
        ({"depth": 3.0}, ValueError, "depth"),
    ],
)
def test_wrong_columns_are_refused_by_name(kw, error, match):
    with pytest.raises(error, match=match):
        sprites(1, **kw)


def test_wrong_arguments_are_refused_by_name():
    one = sprites(1)
    for kw, match in (
        ({"order": "z"}, "order"),
        ({"order": "slab"}, "delta"),
        ({"order": "slab", "delta": -1}, "delta"),
        ({"order": "slab", "delta": [1, 2]}, "delta"),
        ({"order": "slab", "delta": [math.nan]}, "delta"),
        ({"method": "exact"}, "method"),
    ):
        with pytest.raises(ValueError, match=match):
            paint.composite(one, 8, 8, **kw)
    for width in (0, -1, 2.5, 70_000):
        with pytest.raises((ValueError, TypeError), match="width"):
            paint.composite(one, width, 8)
    strokes = paint.Strokes([[0, 5, 0]], (0, 0, 1), (1, 1))
    with pytest.raises(ValueError, match="circles"):
        paint.shade(strokes, STYLE, CAMERA, UP, circles=(5, 1))
    with pytest.raises(TypeError, match="lights"):
        paint.shade(strokes, STYLE, CAMERA, [(0, 0, 1)])
    with pytest.raises(ValueError, match="object"):
        dataclasses.replace(strokes, object=[0])
    with pytest.raises(ValueError, match="growth"):
        dataclasses.replace(strokes, growth=np.ones((1, 2, 4)))
    with pytest.raises(ValueError, match="normal"):
        paint.Strokes([[0, 5, 0]], (0, 0, 0), (1, 1))
    with pytest.raises(ValueError, match="position"):
        paint.Strokes([[0, math.inf, 0]], (0, 0, 1), (1, 1))
    with pytest.raises(ValueError, match="name"):
        paint.style("monet")
    with pytest.raises(ValueError, match="dark"):
        paint.Palette([], ["#ffffff"], ["#ffffff"])
    with pytest.raises(ValueError, match="cutoffs"):
        paint.Palette(["#000000"], ["#ffffff"], ["#ffffff"], cutoffs=(0.5, 0.1, 0.6, 0.7))
    with pytest.raises(ValueError, match=r"mid\[0\]"):
        paint.Palette(["#000000"], ["green"], ["#ffffff"])


def test_a_palette_of_one_colour_and_cutoffs_that_meet():
    one = [(0.2, 0.3, 0.1)]
    for spline in ("linear", "catmull-rom"):
        for cutoffs in ((0, 0, 0, 0), (0.5, 0.5, 0.5, 0.5), (1, 1, 1, 1), (0, 1, 1, 1)):
            palette = paint.Palette(one, one, one, cutoffs=cutoffs, spline=spline)
            colors, which = paint.palette_colors(palette, np.linspace(0, 1, 101))
            np.testing.assert_allclose(colors, np.tile(np.float32(one), (101, 1)), rtol=1e-6)
            at = np.linspace(0, 1, 101)
            assert (which[at < cutoffs[0]] == 0).all()
            assert (which[at > cutoffs[3]] == 2).all()


def test_styles_survive_json_pickle_and_each_other():
    for name in paint.styles():
        style = paint.style(name)
        assert paint.Style.from_json(style.to_json()) == style
        assert pickle.loads(pickle.dumps(style)) == style
        assert hash(style) == hash(paint.Style.from_json(style.to_json()))
        for _, material in style.materials:
            assert paint.StrokeParams.from_json(material.params.to_json()) == material.params
    for text in ("[]", "{", '{"nothing": 1}', '{"materials": {}}'):
        with pytest.raises(ValueError):
            paint.Style.from_json(text)


def test_styles_that_are_none_are_refused():
    with pytest.raises(TypeError, match="materials"):
        paint.Style([1])
    with pytest.raises(ValueError, match="materials"):
        paint.Style.from_json("{}")
    with pytest.raises(ValueError, match="dark"):
        paint.Style.from_json('{"materials": {"leaves": {"palette": {"mid": ["#000000"]}}}}')


def test_joined_sprites_are_painted_together():
    a, b = sprites(50, seed=1), sprites(70, seed=2, variation=(0.1, 0, 0), rotation=20.0)
    both = paint.join([a, b])
    assert len(both) == 120
    behind = paint.composite(dataclasses.replace(b, depth=b.depth + 100), 200, 150)
    front = paint.composite(a, 200, 150)
    far = paint.join([a, dataclasses.replace(b, depth=b.depth + 100)])
    picture = paint.composite(far, 200, 150)
    np.testing.assert_allclose(picture.rgb, front.rgb + front.transmittance[..., None] * behind.rgb, atol=3e-4)


def test_pigment():
    assert pa.color.mix_pigments(np.zeros((0, 3)), (1.0, 1, 1)).shape == (0, 3)
    assert pa.color.mix_pigments((0.1, 0.2, 0.3), np.ones((4, 5, 3)), np.full((4, 1), 0.5)).shape == (4, 5, 3)
    corners = np.array(np.meshgrid([0.0, 1], [0.0, 1], [0.0, 1])).reshape(3, -1).T
    for t in (0.0, 0.3, 1.0):
        mixed = pa.color.mix_pigments(corners[:, None], corners[None], t)
        assert np.isfinite(mixed).all()
        assert mixed.min() >= 0
        assert mixed.max() <= 1.001
    with pytest.raises(ValueError, match="amount"):
        pa.color.mix_pigments((0.0, 0, 0), (1.0, 1, 1), 2)
    with pytest.raises(ValueError, match="a must"):
        pa.color.mix_pigments((0.0, -1, 0), (1.0, 1, 1))
    with pytest.raises(ValueError, match="broadcast"):
        pa.color.mix_pigments(np.zeros((2, 3)), np.zeros((3, 3)))

"""What `pleinair.color` accepts, refuses and leaves alone, and what it does at the ends of the numbers."""

import numpy as np
import pleinair as pa
import pytest
import skimage.color

C = pa.color
ELEMENT = [C.srgb_encode, C.srgb_decode]
PIXEL = {
    "rgb": [C.rgb_to_hsv, C.rgb_to_xyz, C.rgb_to_lab, C.luminance],
    "hsv": [C.hsv_to_rgb],
    "xyz": [C.xyz_to_rgb, C.xyz_to_xyy],
    "xyy": [C.xyy_to_xyz],
    "lab": [C.lab_to_rgb],
}
PIXELS = [f for functions in PIXEL.values() for f in functions]
NAMED = [(f, name) for name, functions in PIXEL.items() for f in functions] + [(f, "x") for f in ELEMENT]
ALL = ELEMENT + PIXELS


def ident(value):
    return getattr(value, "__name__", str(value))


@pytest.fixture
def x():
    return np.random.default_rng(6).random((5, 7, 3))


def shape_of(f, x):
    return x.shape[:-1] if f is C.luminance else x.shape


@pytest.mark.parametrize("f", ALL, ids=ident)
def test_layouts_and_dtypes_give_the_same(f, x):
    want = f(x)
    assert want.shape == shape_of(f, x)
    assert want.dtype == np.float64
    wide = np.zeros((5, 14, 3))
    wide[:, ::2] = x
    readonly = x.copy()
    readonly.flags.writeable = False
    flipped = np.ascontiguousarray(x[..., ::-1])[..., ::-1]
    unaligned = np.frombuffer(b"\0" + x.tobytes(), np.uint8)[1:].view(np.float64).reshape(x.shape)
    for same in (wide[:, ::2], np.asfortranarray(x), readonly, x.astype(">f8"), x.tolist(), flipped, unaligned):
        np.testing.assert_array_equal(f(same), want)
    single = f(x.astype("f4"))
    assert single.dtype == np.float32
    np.testing.assert_array_equal(f(x.astype(">f4")), single)
    half = f(x.astype("f2"))
    assert half.dtype == np.float64
    np.testing.assert_array_equal(half, f(x.astype("f2").astype("f8")))
    whole = np.rint(x).astype(np.int64)  # 0 and 1, as people write primaries
    np.testing.assert_array_equal(f(whole), f(whole.astype("f8")))


ENCODED = [
    pa.color.srgb_decode,
    pa.color.rgb_to_hsv,
    pa.color.hsv_to_rgb,
    lambda x: pa.color.rgb_to_lab(x, encoded=True),
]
LINEAR = [pa.color.srgb_encode, pa.color.rgb_to_xyz, pa.color.luminance, pa.color.rgb_to_lab]
COORDINATES = [pa.color.xyz_to_rgb, pa.color.xyz_to_xyy, pa.color.xyy_to_xyz, pa.color.lab_to_rgb]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_unsigned_integers_are_levels_where_encoded_values_are_meant(dtype):
    white = np.iinfo(dtype).max
    levels = np.random.default_rng(0).integers(0, white, (5, 7, 3), dtype, endpoint=True)
    for f in ENCODED:
        np.testing.assert_array_equal(f(levels), f(levels / white))
    for f in LINEAR + COORDINATES:
        with pytest.raises(TypeError, match=rf"must hold floats: {np.dtype(dtype).name} up to \d+ are levels"):
            f(levels)


def test_eight_bits_mean_what_scikit_image_has():
    orange = np.array([[[255, 128, 0]]], np.uint8)
    found = pa.color.rgb_to_lab(orange, encoded=True)
    assert found[0, 0, 0] == pytest.approx(67.05, abs=0.01)
    np.testing.assert_allclose(found, skimage.color.rgb2lab(orange), atol=0.01)
    np.testing.assert_allclose(pa.color.rgb_to_hsv(orange), skimage.color.rgb2hsv(orange), atol=1e-12)
    np.testing.assert_allclose(pa.color.srgb_decode(np.uint8(255)), 1.0)


def test_larger_whole_numbers_are_coordinates_or_refused():
    for f in ENCODED + LINEAR:
        with pytest.raises(TypeError, match="must hold floats: int64 up to 255 are levels"):
            f([255, 128, 0])
    for f in COORDINATES:
        np.testing.assert_array_equal(f([50, 10, 20]), f([50.0, 10.0, 20.0]))


@pytest.mark.parametrize("f", ALL, ids=ident)
def test_shapes(f, x):
    want = f(x)
    np.testing.assert_array_equal(f(x[2, 3]), want[2, 3])
    np.testing.assert_array_equal(f(x[2:3, 3:4]), want[2:3, 3:4])
    np.testing.assert_array_equal(f(x.reshape(5, 1, 7, 1, 3)), want.reshape(shape_of(f, x.reshape(5, 1, 7, 1, 3))))
    for empty in (np.zeros((0, 3)), np.zeros((4, 0, 3), np.float32)):
        assert f(empty).shape == shape_of(f, empty)
        assert f(empty).dtype == empty.dtype


@pytest.mark.parametrize("f", ELEMENT, ids=ident)
def test_elementwise_takes_any_shape(f):
    zero_d = f(0.5)
    assert isinstance(zero_d, np.ndarray)
    assert zero_d.shape == ()
    np.testing.assert_array_equal(f([0.5, 0.25])[0], zero_d)


@pytest.mark.parametrize(("f", "name"), NAMED, ids=ident)
def test_refusals_name_the_argument(f, name, x):
    if f not in ELEMENT:
        for bad, text in ((np.zeros((3, 4)), r"\(3, 4\)"), (np.float64(1), r"\(\)"), (np.zeros(2), r"\(2,\)")):
            with pytest.raises(ValueError, match=rf"^{name} must have shape \(\.\.\., 3\), got {text}$"):
                f(bad)
    for bad in (x.astype(complex), np.full((2, 3), "a"), np.full((2, 3), None)):
        with pytest.raises(TypeError, match=rf"^{name} must hold real numbers"):
            f(bad)
    with pytest.raises(TypeError, match=f"^{name} must be array_like"):
        f([[1.0, 2.0, 3.0], [1.0]])


@pytest.mark.parametrize("f", ALL, ids=ident)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_out(f, x, dtype):
    x = x.astype(dtype)
    before = x.copy()
    want = f(x)
    out = np.full(want.shape, np.nan, dtype)
    assert f(x, out=out) is out
    np.testing.assert_array_equal(out, want)
    np.testing.assert_array_equal(x, before)
    if want.shape == x.shape:
        assert f(x, out=x) is x
        np.testing.assert_array_equal(x, want)
    for bad, text in (
        (np.empty((*want.shape, 1), dtype), "out must have shape"),
        (np.empty(want.shape, np.float16), "out must have shape .* dtype"),
        (np.empty(want.shape, np.dtype(dtype).newbyteorder(">")), "out must have shape .* dtype"),
        (np.empty(want.shape[::-1], dtype).T, "C-contiguous"),
    ):
        with pytest.raises(ValueError, match=text):
            f(before, out=bad)
    fixed = np.zeros(want.shape, dtype)
    fixed.flags.writeable = False
    with pytest.raises(ValueError, match="writable"):
        f(before, out=fixed)
    assert not fixed.any()
    with pytest.raises(TypeError, match="out must be a numpy array"):
        f(before, out=[0.0])


def test_out_that_overlaps_the_input_in_part():
    memory = np.random.default_rng(7).random(33 * 3)
    x = memory[3:].reshape(32, 3)
    want = C.rgb_to_lab(x)
    np.testing.assert_array_equal(C.rgb_to_lab(x, out=memory[:-3].reshape(32, 3)), want)


@pytest.mark.parametrize("f", [C.rgb_to_xyz, C.xyz_to_rgb, C.rgb_to_lab, C.lab_to_rgb], ids=ident)
def test_matrix(f, x):
    np.testing.assert_array_equal(f(x, matrix=C.RGB_TO_XYZ), f(x))
    with pytest.raises(ValueError, match=r"^matrix must have shape \(3, 3\), got \(3,\)"):
        f(x, matrix=[1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match=r"^matrix must hold finite numbers"):
        f(x, matrix=np.full((3, 3), np.nan))
    with pytest.raises(TypeError, match=r"^matrix must hold real"):
        f(x, matrix=np.full((3, 3), 1j))
    if f is not C.rgb_to_xyz:
        with pytest.raises(ValueError, match=r"^matrix: must be finite and have an inverse"):
            f(x, matrix=np.ones((3, 3)))


def test_white_and_weights(x):
    for f in (C.rgb_to_lab, C.lab_to_rgb, C.xyz_to_xyy):
        for bad in ([1.0, 0.0, 1.0], [-1.0, 1.0, 1.0], [np.nan, 1.0, 1.0], [1.0, 1.0]):
            with pytest.raises(ValueError, match=r"^white must"):
                f(x, white=bad)
    np.testing.assert_array_equal(C.rgb_to_lab(x, white=C.D65), C.rgb_to_lab(x))
    np.testing.assert_array_equal(C.lab_to_rgb(x, white=C.D65), C.lab_to_rgb(x))
    with pytest.raises(ValueError, match=r"^weights must"):
        C.luminance(x, weights=[1.0, np.inf, 0.0])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_round_trips(dtype):
    rng = np.random.default_rng(8)
    eps = np.finfo(dtype).eps
    for x in (rng.random((4001, 3)), rng.uniform(0, 1e-3, (999, 3)), rng.uniform(-3, 60, (999, 3))):
        x = x.astype(dtype)
        scale = np.abs(x).max()
        # At the break the two branches of the standard miss each other by 2.9e-8.
        assert np.abs(C.srgb_encode(C.srgb_decode(x)) - x).max() <= 8 * eps * scale + 4e-8
        assert np.abs(C.xyz_to_rgb(C.rgb_to_xyz(x)) - x).max() <= 8 * eps * scale
        # In the dark Lab subtracts 4/29, which carries an error of its own.
        assert np.abs(C.lab_to_rgb(C.rgb_to_lab(x)) - x).max() <= 40 * eps * scale + 0.1 * eps
        lit = x[x.max(-1) > 0]
        assert np.abs(C.hsv_to_rgb(C.rgb_to_hsv(lit)) - lit).max() <= 8 * eps * scale
        sums = x.sum(-1, keepdims=True)
        good = (np.abs(sums[:, 0]) > 0.1 * scale) & (np.abs(x[:, 1]) > 0.1 * scale)
        assert np.abs(C.xyy_to_xyz(C.xyz_to_xyy(x[good])) - x[good]).max() <= 200 * eps * scale


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_ends_of_the_numbers(dtype):
    tiny = np.array([0, 1e-45, 1e-40, 1e-38], np.float32).astype(dtype)
    np.testing.assert_array_equal(C.srgb_encode(tiny), tiny * dtype(12.92))
    hsv = C.rgb_to_hsv(np.stack([tiny, tiny * 0, tiny * 0], -1))
    np.testing.assert_array_equal(hsv[:, 0], 0)
    np.testing.assert_array_equal(hsv[:, 1], [0, 1, 1, 1])
    ends = np.array([np.inf, -np.inf, np.nan, -0.0], dtype)
    for f in ELEMENT:
        np.testing.assert_array_equal(f(ends), ends)
        assert np.signbit(f(ends))[3]
    largest = np.finfo(dtype).max
    assert C.srgb_encode(largest) == pytest.approx(1.055 * float(largest) ** (1 / 2.4) - 0.055, rel=1e-6)
    assert C.srgb_decode(dtype(largest)) == np.inf
    assert (C.rgb_to_hsv(np.array([largest, 0, 0], dtype)) == [0, 1, largest]).all()
    assert C.rgb_to_hsv(np.array([1, 0, 1e-12 if dtype == np.float32 else 1e-20], dtype))[0] == 0


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("f", [C.rgb_to_hsv, C.hsv_to_rgb, C.luminance], ids=ident)
def test_nan_stays_in_its_pixel(f, dtype):
    x = np.full((40, 3), 0.5, dtype)
    x[17] = [0.2, 0.4, 0.8]
    for c in range(3):
        bad = x.copy()
        bad[17, c] = np.nan
        got = f(bad).reshape(40, -1)
        assert np.isnan(got[17]).all()
        np.testing.assert_array_equal(np.delete(got, 17, 0), np.delete(f(x).reshape(40, -1), 17, 0))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_nan_reaches_what_depends_on_it(dtype):
    nan = np.nan
    for f in (C.rgb_to_xyz, C.xyz_to_rgb, C.rgb_to_lab):
        for encoded in ({}, {"encoded": True}) if f is C.rgb_to_lab else ({},):
            assert np.isnan(f(np.array([0.1, nan, 0.3], dtype), **encoded)).all()
    np.testing.assert_array_equal(np.isnan(C.xyz_to_xyy(np.array([nan, 0.2, 0.3], dtype))), [True, True, False])
    np.testing.assert_array_equal(np.isnan(C.xyy_to_xyz(np.array([nan, 0.2, 0.3], dtype))), [True, False, True])
    assert np.isnan(C.lab_to_rgb(np.array([50, nan, 0], dtype), encoded=True)).all()


def test_hues_of_the_corners():
    corners = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]])
    for dtype in (np.float32, np.float64):
        hsv = C.rgb_to_hsv(corners.astype(dtype))
        np.testing.assert_allclose(hsv[:, 0] * 6, range(6), atol=4 * np.finfo(dtype).eps)
        np.testing.assert_array_equal(hsv[:, 1:], 1)
        np.testing.assert_allclose(C.hsv_to_rgb(hsv), corners, atol=3 * np.finfo(dtype).eps)


def test_lab_of_the_dark_has_its_digits_in_single_precision():
    """Lightness is 903.3 Y near black; 116 f - 16 would leave it half a per cent of rounding at a millionth."""
    rgb = 10.0 ** np.linspace(-12, 0, 200)[:, None] * np.random.default_rng(0).uniform(0.3, 1, (200, 3))
    double = C.rgb_to_lab(rgb)
    assert double[0, 0] == pytest.approx(24389 / 27 * C.luminance(rgb[0]), rel=1e-12)
    single = C.rgb_to_lab(rgb.astype(np.float32))
    scale = np.abs(double).max(axis=1, keepdims=True)
    np.testing.assert_allclose(single / scale, double / scale, atol=2e-6)
    np.testing.assert_allclose(C.lab_to_rgb(single), rgb, rtol=3e-5)

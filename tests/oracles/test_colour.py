"""colour-science 0.4.7 judges `pleinair.color`, and the golden values of the derived matrix."""

import warnings

import numpy as np
import pleinair as pa
import pytest

# colour warns of its optional dependencies when it is imported, and changes how numpy prints.
with warnings.catch_warnings(), np.printoptions():
    warnings.simplefilter("ignore")
    import colour

C = pa.color
SRGB = colour.RGB_COLOURSPACES["sRGB"]
ROUNDED = np.asarray(SRGB.matrix_RGB_to_XYZ)
WHITE = colour.xy_to_XYZ(SRGB.whitepoint)


def pixels(rng, low=0.0, high=1.0, n=20_000):
    x = rng.uniform(low, high, (n, 3))
    corners = np.stack(np.meshgrid([0.0, 0.5, 1.0], [0.0, 0.5, 1.0], [0.0, 0.5, 1.0]), -1).reshape(-1, 3)
    near_black = rng.uniform(0, 1e-4, (500, 3))
    return np.concatenate([x, corners, near_black])


@pytest.fixture
def x():
    return pixels(np.random.default_rng(1))


def close(got, want, tolerance):
    __tracebackhide__ = True
    assert got.shape == want.shape
    worst = np.abs(got - want).max()
    assert worst <= tolerance, f"largest difference {worst:g}, allowed {tolerance:g}"


def lab_of(rgb, matrix, white_xy):
    return colour.XYZ_to_Lab(rgb @ np.asarray(matrix).T, white_xy)


# --- transfer function -------------------------------------------------------------------------------------------


def test_encode(x):
    close(C.srgb_encode(x), colour.models.eotf_inverse_sRGB(x), 1e-15)
    close(C.srgb_encode(x.astype("f4")), colour.models.eotf_inverse_sRGB(x.astype("f4").astype("f8")), 2e-7)


def test_decode(x):
    # colour's break is encode(0.0031308) = 0.0404499; ours is the standard's 0.04045. Between them: 2.3e-9.
    between = (x > 0.040449936) & (x <= 0.04045)
    want = colour.models.eotf_sRGB(x)
    got = C.srgb_decode(x)
    close(np.where(between, 0, got), np.where(between, 0, want), 1e-15)
    close(got, want, 3e-9)
    close(C.srgb_decode(x.astype("f4")), colour.models.eotf_sRGB(x.astype("f4").astype("f8")), 2e-7)


def test_the_break_of_the_standard():
    v = np.array([0.040449936, 0.0404499999, 0.04045])
    np.testing.assert_allclose(C.srgb_decode(v), v / 12.92, rtol=1e-15)
    difference = np.abs(C.srgb_decode(v)[1:] - colour.models.eotf_sRGB(v)[1:]).max()
    assert 1e-9 < difference < 3e-9


def test_above_one_is_the_same_curve():
    x = np.geomspace(1, 1e6, 2000)
    np.testing.assert_allclose(C.srgb_encode(x), colour.models.eotf_inverse_sRGB(x), rtol=1e-14)
    np.testing.assert_allclose(C.srgb_decode(x), colour.models.eotf_sRGB(x), rtol=1e-14)
    np.testing.assert_allclose(C.srgb_encode(x.astype("f4")), C.srgb_encode(x), rtol=4e-7)


def test_negative_values_are_odd_where_colour_continues_the_line():
    assert colour.models.eotf_inverse_sRGB(-0.5) == pytest.approx(-6.46)
    assert C.srgb_encode(-0.5) == -C.srgb_encode(0.5)
    assert C.srgb_encode(-0.5) == pytest.approx(-0.735356983, abs=1e-9)


# --- HSV ---------------------------------------------------------------------------------------------------------


def test_hsv(x):
    got, want = C.rgb_to_hsv(x), colour.RGB_to_HSV(x)
    turn = np.abs(got[:, 0] - want[:, 0])
    assert np.minimum(turn, 1 - turn).max() <= 4e-16
    close(got[:, 1:], want[:, 1:], 4e-16)
    single = C.rgb_to_hsv(x.astype("f4"))
    want = colour.RGB_to_HSV(x.astype("f4").astype("f8"))
    turn = np.abs(single[:, 0] - want[:, 0])
    assert np.minimum(turn, 1 - turn).max() <= 2e-7
    close(single[:, 1:], want[:, 1:], 2e-7)


def test_hsv_of_bright_and_negative_channels():
    rng = np.random.default_rng(2)
    x = rng.uniform(-0.5, 40, (5000, 3))
    x = x[x.max(-1) > 0]
    got, want = C.rgb_to_hsv(x), colour.RGB_to_HSV(x)
    np.testing.assert_allclose(got[:, 1:], want[:, 1:], rtol=1e-14)
    turn = np.abs(got[:, 0] - want[:, 0])
    assert np.minimum(turn, 1 - turn).max() <= 1e-15
    assert (got[:, 0] >= 0).all()
    assert (got[:, 0] < 1).all()


def test_hsv_where_no_channel_is_positive_differs_from_colour():
    x = np.array([-0.2, -0.4, -0.6])
    assert colour.RGB_to_HSV(x)[1] == pytest.approx(-2)
    np.testing.assert_allclose(C.rgb_to_hsv(x)[1:], [0, -0.2])


def test_nan_in_hsv_differs_from_colour():
    with np.errstate(invalid="ignore"):
        assert np.isnan(colour.RGB_to_HSV([np.nan, 0.5, 0.2])).tolist() == [False, False, True]
    for c in range(3):
        x = np.array([0.3, 0.5, 0.2])
        x[c] = np.nan
        assert np.isnan(C.rgb_to_hsv(x)).all()
        assert np.isnan(C.rgb_to_hsv(x.astype("f4"))).all()


def test_hsv_to_rgb(x):
    close(C.hsv_to_rgb(x * [0.999999, 1, 3]), colour.HSV_to_RGB(x * [0.999999, 1, 3]), 3e-15)
    close(C.hsv_to_rgb(x.astype("f4") * np.float32(0.999)), colour.HSV_to_RGB(x.astype("f4") * np.float32(0.999)), 5e-7)


def test_hue_is_wrapped_where_colour_does_not():
    want = C.hsv_to_rgb([0.25, 0.7, 0.8])
    np.testing.assert_allclose(
        C.hsv_to_rgb([[1.25, 0.7, 0.8], [-0.75, 0.7, 0.8], [7.25, 0.7, 0.8]]), [want] * 3, atol=1e-14
    )
    assert np.abs(colour.HSV_to_RGB([1.25, 0.7, 0.8]) - want).max() > 0.1


# --- XYZ and xyY -------------------------------------------------------------------------------------------------


def test_xyz_with_colours_matrix(x):
    want = colour.RGB_to_XYZ(x, "sRGB")
    close(C.rgb_to_xyz(x, matrix=ROUNDED), want, 1e-15)
    close(C.rgb_to_xyz(x.astype("f4"), matrix=ROUNDED), want, 3e-7)
    # colour's own inverse is rounded to four digits too: M Minv - I reaches 3.5e-5.
    close(C.xyz_to_rgb(want, matrix=ROUNDED), x, 1e-14)
    close(C.xyz_to_rgb(want, matrix=ROUNDED), colour.XYZ_to_RGB(want, "sRGB"), 1e-4)
    # Default against derived matrix.
    close(C.rgb_to_xyz(x), want, 7e-5)


def test_the_derived_matrix():
    space = SRGB.copy()
    space.use_derived_transformation_matrices(True)
    close(C.RGB_TO_XYZ, np.asarray(space.matrix_RGB_to_XYZ), 1e-15)
    close(C.XYZ_TO_RGB, np.asarray(space.matrix_XYZ_to_RGB), 1e-14)
    close(C.D65, WHITE, 1e-15)
    close(C.RGB_TO_XYZ @ C.XYZ_TO_RGB, np.eye(3), 1e-15)
    for constant in (C.RGB_TO_XYZ, C.XYZ_TO_RGB, C.D65):
        with pytest.raises(ValueError, match="read-only"):
            constant[0] = 1


def test_xyy(x):
    close(C.xyz_to_xyy(x), colour.XYZ_to_xyY(x), 1e-15)
    close(C.xyz_to_xyy(x.astype("f4")), colour.XYZ_to_xyY(x.astype("f4").astype("f8")), 2e-7)
    got, want = C.xyy_to_xyz(x[:20_000]), colour.xyY_to_XYZ(x[:20_000])
    # 1 - x - y cancels, so Z is exact only against Y / y.
    assert (np.abs(got - want) <= 1e-15 * (1 + x[:20_000, 2:] / x[:20_000, 1:2])).all()


def test_xyy_of_black_and_of_y_zero():
    for dtype in (np.float32, np.float64):
        black = np.zeros((2, 3), dtype)
        np.testing.assert_array_equal(C.xyz_to_xyy(black), colour.XYZ_to_xyY(black))
        np.testing.assert_array_equal(C.xyz_to_xyy([0.5, -0.5, 0.0]), [0, 0, -0.5])
        none = np.array([0.3, 0.0, 0.5], dtype)
        np.testing.assert_array_equal(C.xyy_to_xyz(none), [0, 0.5, 0])
        np.testing.assert_array_equal(C.xyy_to_xyz(none), colour.xyY_to_XYZ(none))
        np.testing.assert_allclose(C.xyz_to_xyy(black, white=C.D65), [[0.3127, 0.3290, 0]] * 2, rtol=2e-7)


# --- Lab ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("matrix", [None, ROUNDED], ids=["derived", "rounded"])
def test_lab(x, matrix):
    m = C.RGB_TO_XYZ if matrix is None else matrix
    want = lab_of(x, m, SRGB.whitepoint)
    close(C.rgb_to_lab(x, matrix=matrix, white=WHITE), want, 1e-10)
    single = C.rgb_to_lab(x.astype("f4"), matrix=matrix, white=WHITE)
    reference = lab_of(x.astype("f4").astype("f8"), m, SRGB.whitepoint)
    assert np.linalg.norm(single - reference, axis=-1).max() <= 2e-4
    close(C.lab_to_rgb(want, matrix=matrix, white=WHITE), x, 1e-10)


def test_encoded_lab(x):
    # colour's break of the decoding costs up to 2.3e-9 in linear light, 2e-6 in Lab.
    want = lab_of(colour.models.eotf_sRGB(x), C.RGB_TO_XYZ, SRGB.whitepoint)
    outside = ((x <= 0.040449936) | (x > 0.04045)).all(-1)
    got = C.rgb_to_lab(x, encoded=True)
    close(got[outside], want[outside], 1e-10)
    close(got, want, 3e-6)
    assert np.linalg.norm(C.rgb_to_lab(x.astype("f4"), encoded=True) - got, axis=-1).max() <= 2e-4
    close(C.lab_to_rgb(got, encoded=True), x, 1e-7)  # the break of the transfer function jumps by 2.9e-8
    # A dark channel beside bright ones is a difference of floats near 1, times 3.24 and the slope 12.92 at black.
    close(C.lab_to_rgb(got.astype("f4"), encoded=True), x, 1e-5)


def test_lab_end_to_end_with_colours_defaults(x):
    want = colour.XYZ_to_Lab(colour.RGB_to_XYZ(x, "sRGB"), SRGB.whitepoint)
    assert np.linalg.norm(C.rgb_to_lab(x) - want, axis=-1).max() < 0.05


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("encoded", [False, True])
def test_greys_are_exactly_grey(dtype, encoded):
    grey = np.concatenate([np.linspace(0, 2, 3001), np.geomspace(1e-9, 1, 1000)]).astype(dtype)
    lab = C.rgb_to_lab(np.repeat(grey[:, None], 3, 1), encoded=encoded)
    np.testing.assert_array_equal(lab[:, 1:], 0)
    back = C.lab_to_rgb(lab, encoded=encoded)
    np.testing.assert_array_equal(back[:, 0], back[:, 1])
    np.testing.assert_array_equal(back[:, 2], back[:, 1])
    np.testing.assert_allclose(back[:, 0], grey, atol=1e-6 if dtype == np.float32 else 4e-8, rtol=1e-6)
    assert C.rgb_to_lab(np.ones(3, dtype), encoded=encoded)[0] == pytest.approx(100, abs=2e-5)


# --- golden values -----------------------------------------------------------------------------------------------


def test_golden_values():
    encoded = np.array([0.25, 0.5, 0.75])
    linear = [0.05087608817155679, 0.21404114048223255, 0.522521553968392]
    xyz = [0.19182369250207165, 0.2016158012589198, 0.5231696003345859]
    close(C.srgb_decode(encoded), np.array(linear), 2e-16)
    close(C.srgb_encode(linear), encoded, 3e-16)
    close(C.rgb_to_xyz(linear), np.array(xyz), 3e-16)
    close(C.xyz_to_xyy(xyz)[:2], np.array([0.20927535384246326, 0.21995832526389575]), 2e-16)
    lab = np.array([52.019407502717414, 0.10031215009881356, -39.361980025811796])
    close(C.rgb_to_lab(encoded, encoded=True), lab, 1e-12)
    close(C.rgb_to_lab([1.0, 0, 0]), np.array([53.23711559542936, 80.09011352310385, 67.20326351172214]), 1e-12)
    dark = np.array([2.0540194681560457, 0.07285589897090827, -2.2473293411088946])
    close(C.rgb_to_lab([0.02, 0.03, 0.05], encoded=True), dark, 1e-12)
    assert C.luminance(linear) == pytest.approx(xyz[1], abs=1e-15)
    assert C.luminance([1.0, 0.5, 0.25], weights=(0.25, 0.5, 1)) == 0.75


def test_all_byte_codes_survive():
    code = np.arange(256) / 255
    for dtype in (np.float16, np.float32, np.float64):
        linear = C.srgb_decode(code.astype(np.float32)).astype(dtype)
        np.testing.assert_array_equal(np.floor(C.srgb_encode(linear) * 255 + 0.5), np.arange(256))

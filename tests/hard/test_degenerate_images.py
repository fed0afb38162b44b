"""Empty, constant, strange and wrong pictures: a definite answer or a sentence that names the argument."""

import pickle

import numpy as np
import pleinair as pa
import pytest
from pleinair.image import Threshold, fill, histogram, otsu


@pytest.mark.parametrize("shape", [(0,), (0, 5), (5, 0), (0, 0, 3), (4, 0, 3)])
def test_empty_histogram_is_zero(shape):
    result = histogram(np.zeros(shape, np.float32))
    assert result.counts.shape == (shape[2] if len(shape) == 3 else 1, 256)
    assert result.counts.sum() == 0


def test_single_pixels_lines_and_columns():
    assert histogram(np.float32([[0.5]])).counts[0, 128] == 1
    assert histogram(np.full((1, 100_003), 0.5, np.float32)).counts[0, 128] == 100_003
    assert histogram(np.full((100_003, 1, 4), 3, np.uint8)).counts[:, 3].tolist() == [100_003] * 4


@pytest.mark.parametrize("value", [0.0, -0.0, 1.0, 0.3, np.nan, np.inf, -np.inf, 1e38, 5e-324])
def test_constant_pictures_lose_nothing(value):
    for dtype in (np.float32, np.float64):
        with np.errstate(all="ignore"):
            x = np.full((37, 41), value, dtype)
        r = histogram(x, 7)
        assert r.counts.sum() + r.under.sum() + r.over.sum() + r.nan.sum() == x.size
        assert r.nan.sum() == (x.size if np.isnan(value) else 0)


def views(x):
    """Yield the same values in other layouts."""
    wide = np.zeros((x.shape[0] * 2, x.shape[1] * 3, *x.shape[2:]), x.dtype)
    wide[::2, ::3] = x
    yield "strided", wide[::2, ::3]
    yield "reversed", x[::-1, ::-1][::-1, ::-1]
    yield "fortran", np.asfortranarray(x)
    yield "swapped bytes", x.astype(x.dtype.newbyteorder())
    frozen = x.copy()
    frozen.flags.writeable = False
    yield "read-only", frozen
    unaligned = np.frombuffer(bytearray(x.nbytes + 1), x.dtype, x.size, 1).reshape(x.shape)
    unaligned[...] = x
    yield "unaligned", unaligned


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_layout_does_not_matter(dtype):
    x = (np.random.default_rng(0).random((31, 43, 3)) * (200 if np.dtype(dtype).kind == "u" else 1)).astype(dtype)
    expected = histogram(x)
    cut = otsu(x)
    for name, view in views(x):
        before = view.copy()
        np.testing.assert_array_equal(histogram(view).counts, expected.counts, err_msg=name)
        assert otsu(view) == cut, name
        np.testing.assert_array_equal(view, before, err_msg=name)


def test_other_number_types():
    x = np.array([[0, 1, 1]])
    assert histogram(x.astype(bool), 2).counts.tolist() == [[1, 2]]
    assert histogram(x.astype(np.float16), 2).counts.tolist() == [[1, 2]]
    assert histogram(x.astype(np.int64), 2, (0, 1)).counts.tolist() == [[1, 2]]
    assert histogram([[0.0, 1.0]], 2).counts.tolist() == [[1, 1]]
    with pytest.raises(ValueError, match="range must be given"):
        histogram(x.astype(np.int64))


WRONG = [
    (lambda: histogram(np.zeros(())), ValueError, "img must have shape"),
    (lambda: histogram(np.zeros((2, 2, 5))), ValueError, "img must have shape"),
    (lambda: histogram(np.zeros((2, 2, 0))), ValueError, "img must have shape"),
    (lambda: histogram(np.zeros((2, 2, 2, 2))), ValueError, "img must have shape"),
    (lambda: histogram(np.zeros((2, 2), complex)), TypeError, "img must hold real"),
    (lambda: histogram("no"), TypeError, "img must"),
    (lambda: histogram(np.zeros((2, 2)), 0), ValueError, "bins must be"),
    (lambda: histogram(np.zeros((2, 2)), 2.5), TypeError, "bins must be"),
    (lambda: histogram(np.zeros((2, 2)), 1 << 21), ValueError, "bins must be"),
    (lambda: histogram(np.zeros((2, 2)), range=(1, 1)), ValueError, "range"),
    (lambda: histogram(np.zeros((2, 2)), range=(1, 0)), ValueError, "range"),
    (lambda: histogram(np.zeros((2, 2)), range=(0, np.nan)), ValueError, "range"),
    (lambda: histogram(np.zeros((2, 2)), range=(-1e308, 1e308)), ValueError, "range"),
    (lambda: histogram(np.zeros((2, 2)), range=3), TypeError, "range"),
    (lambda: histogram(np.zeros((2, 2)), mask=np.zeros((2, 3), bool)), ValueError, "mask must have shape"),
    (lambda: histogram(np.zeros((2, 2)), mask=np.zeros((2, 2))), TypeError, "mask must be boolean"),
    (lambda: otsu(np.zeros((0, 3))), ValueError, "img is empty"),
    (lambda: otsu(np.zeros((2, 2)), np.zeros((2, 2), bool)), ValueError, "mask is empty"),
    (lambda: otsu(np.zeros((2, 2), np.uint8), np.zeros((2, 2), bool)), ValueError, "mask is empty"),
    (lambda: otsu(np.array([0.0, np.nan])), ValueError, "img: must be finite"),
    (lambda: otsu(np.array([0.0, np.inf])), ValueError, "img: must be finite"),
    (lambda: otsu(np.array([0.0, np.nan]), nbins=8), ValueError, "img: must be finite"),
    (lambda: otsu(np.array([0.0, 1.0]), nbins=1), ValueError, "nbins"),
    (lambda: fill(np.zeros(4), np.zeros(4, bool)), ValueError, "img must have shape"),
    (lambda: fill(np.zeros((2, 2, 0)), np.zeros((2, 2), bool)), ValueError, "img must have shape"),
    (lambda: fill(np.zeros((2, 2)), np.zeros((2, 3), bool)), ValueError, "mask must have shape"),
    (lambda: fill(np.zeros((2, 2)), np.zeros((2, 2))), TypeError, "mask must be boolean"),
    (lambda: fill(np.zeros((2, 2)), np.ones((2, 2), bool)), ValueError, "mask: 1 masked region"),
    (lambda: fill(np.full((2, 2), np.nan), np.eye(2, dtype=bool)), ValueError, "img: must be finite"),
    (lambda: fill(np.full((2, 2), np.inf), np.zeros((2, 2), bool)), ValueError, "img: must be finite"),
    (lambda: fill(np.zeros((2, 2)), np.eye(2, dtype=bool), tolerance=0), ValueError, "tolerance must be in"),
    (lambda: fill(np.zeros((2, 2)), np.eye(2, dtype=bool), tolerance="x"), TypeError, "tolerance must be"),
    (lambda: fill(np.zeros((2, 2)), np.eye(2, dtype=bool), outside=(1, 2)), ValueError, "outside must be"),
    (lambda: fill(np.zeros((2, 2), complex), np.eye(2, dtype=bool)), TypeError, "img must hold real"),
    (lambda: otsu(np.array(["a"])), TypeError, "img must hold real"),
]


@pytest.mark.parametrize(("call", "error", "text"), WRONG, ids=map(str, range(len(WRONG))))
def test_wrong_arguments_are_named(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_otsu_ignores_what_is_masked_out():
    x = np.array([0.0, 0.1, 0.9, np.nan, np.inf], np.float32)
    assert otsu(x, np.array([1, 1, 1, 0, 0], bool)).value == pytest.approx(0.5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_one_class_is_that_value(dtype):
    for x in (np.full((3, 4), 7, dtype), np.full((1, 1), 7, dtype)):
        assert otsu(x) == Threshold(7.0, 0.0)
        assert otsu(x, nbins=16) == Threshold(7.0, 0.0)


def test_signed_zeros_are_one_class():
    assert otsu(np.array([0.0, -0.0, 0.0])).separability == 0


def test_results_survive_pickle_and_unpack():
    result = histogram(np.random.default_rng(0).random((9, 9, 3)) * 2 - 0.5, 8)
    copy = pickle.loads(pickle.dumps(result))
    counts, edges = copy
    np.testing.assert_array_equal(counts, result.counts)
    np.testing.assert_array_equal(edges, result.edges)
    np.testing.assert_array_equal(copy.under, result.under)
    np.testing.assert_array_equal(copy.over, result.over)
    np.testing.assert_array_equal(copy.nan, result.nan)
    assert "3 × 8 bins" in repr(copy)
    assert pickle.loads(pickle.dumps(otsu([0, 1.0]))) == otsu([0, 1.0])
    assert pa.image.Histogram is type(copy)


@pytest.mark.parametrize("shape", [(0, 0), (0, 3), (3, 0, 3)])
def test_empty_pictures_fill_to_themselves(shape):
    assert fill(np.zeros(shape), np.zeros(shape[:2], bool)).shape == shape


@pytest.mark.parametrize("shape", [(1, 4001), (4001, 1)])
def test_lines_are_interpolated_linearly(shape):
    line = np.linspace(0, 1, 4001).reshape(shape)
    mask = np.ones(shape, bool)
    mask.flat[[0, -1]] = False
    np.testing.assert_allclose(fill(line, mask), line, atol=0.05 / 255)
    mask.flat[-1] = True  # open end: the only known value is carried on
    np.testing.assert_array_equal(fill(line + 0.25, mask), 0.25)


def test_masked_nan_is_replaced_and_inputs_stay():
    x = np.float32([[1, np.nan, 3]])
    mask = np.isnan(x)
    np.testing.assert_array_equal(fill(x, mask), np.float32([[1, 2, 3]]))
    assert np.isnan(x[0, 1])
    np.testing.assert_array_equal(fill(np.array([[1, 0, 3]]), [[0, 1, 0]]), [[1.0, 2.0, 3.0]])


def test_extreme_units_are_filled():
    for scale in (1e-300, 1e300):
        x = np.array([[1.0, 0.0, 3.0]]) * scale
        np.testing.assert_allclose(fill(x, [[0, 1, 0]]), np.array([[1.0, 2.0, 3.0]]) * scale, rtol=1e-4)
    huge = np.array([[-8e307, 0.0, 8e307]])
    assert abs(fill(huge, [[0, 1, 0]])[0, 1]) < 1e305


def test_layout_does_not_matter_to_fill():
    x = np.random.default_rng(0).random((31, 43, 3))
    mask = np.random.default_rng(1).random((31, 43)) < 0.5
    expected = fill(x, mask)
    for name, view in views(x):
        np.testing.assert_array_equal(fill(view, mask), expected, err_msg=name)
    for name, view in views(mask):
        np.testing.assert_array_equal(fill(x, view), expected, err_msg=name)

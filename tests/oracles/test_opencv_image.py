"""pleinair.image against OpenCV, and where OpenCV is known to differ."""

import cv2
import numpy as np
import pleinair as pa
import pytest


def cv2_histogram(x, bins, low, high, mask=None):
    mask = None if mask is None else mask.astype(np.uint8)
    channels = x.shape[2] if x.ndim == 3 else 1
    return np.stack([cv2.calcHist([x], [c], mask, [bins], [low, high]).ravel() for c in range(channels)])


@pytest.fixture(scope="module")
def mask():
    out = np.random.default_rng(1).random((120, 161)) < 0.5
    out[:30] = True
    out[50:80] = False
    return out


@pytest.mark.parametrize("masked", [False, True])
def test_bytes_words_and_floats_are_equal(mask, masked):
    rng = np.random.default_rng(2)
    m = mask if masked else None
    u8 = rng.integers(0, 256, (120, 161, 3), dtype=np.uint8)
    np.testing.assert_array_equal(pa.image.histogram(u8, mask=m).counts, cv2_histogram(u8, 256, 0, 256, m))
    u16 = rng.integers(0, 65536, (120, 161, 3), dtype=np.uint16)
    np.testing.assert_array_equal(pa.image.histogram(u16, mask=m).counts, cv2_histogram(u16, 256, 0, 65536, m))
    f32 = rng.random((120, 161, 3), dtype=np.float32) * 1.4 - 0.2
    f32[f32 == 1] = 0.5
    for bins in (4, 100, 256):
        np.testing.assert_array_equal(
            pa.image.histogram(f32, bins, mask=m).counts, cv2_histogram(f32, bins, 0, 1, m), err_msg=str(bins)
        )


def test_it_drops_the_top_edge_and_we_close_it():
    x = np.ones((2, 2), np.float32)
    assert cv2_histogram(x, 4, 0, 1).sum() == 0
    assert pa.image.histogram(x, 4).counts.tolist() == [[0, 0, 0, 4]]
    byte = np.full((2, 2), 255, np.uint8)
    assert cv2_histogram(byte, 255, 0, 255).sum() == 0
    assert pa.image.histogram(byte, 255, (0, 255)).counts[0, -1] == 4


def test_widening_its_range_to_admit_one_moves_other_samples():
    x = np.random.default_rng(5).random((1500, 1500), dtype=np.float32)
    hacked = cv2_histogram(x, 256, 0, float(np.nextafter(np.float32(1), np.float32(2))))
    assert np.abs(hacked - pa.image.histogram(x).counts).sum() > 0


def test_it_counts_nan_as_zero_and_we_count_it_apart():
    x = np.array([[np.nan, 0.9]], np.float32)
    assert cv2_histogram(x, 4, 0, 1).tolist() == [[1, 0, 0, 1]]
    ours = pa.image.histogram(x, 4)
    assert ours.counts.tolist() == [[0, 0, 0, 1]]
    assert ours.nan.tolist() == [1]


def test_it_drops_what_is_outside_and_we_say_how_much():
    x = np.array([[-0.1, 1.1, np.inf, -np.inf, 0.5]], np.float32)
    assert cv2_histogram(x, 4, 0, 1).sum() == 1
    ours = pa.image.histogram(x, 4)
    assert (ours.under[0], ours.over[0], ours.counts.sum()) == (2, 2, 1)


def test_its_counts_are_floats_and_stop_at_two_to_24():
    x = np.zeros((4097, 4097), np.uint8)
    theirs = cv2.calcHist([x], [0], None, [256], [0, 256]).ravel()
    assert theirs.dtype == np.float32
    assert int(theirs[0]) == x.size - 1, "16 785 409 is no float32"
    assert pa.image.histogram(x).counts[0, 0] == x.size
    total = np.full((256, 1), 2.0**24, np.float32)
    more = cv2.calcHist([x[:1, :1]], [0], None, [256], [0, 256], total.copy(), True).ravel()
    assert more[0] == 2.0**24, "accumulating has stopped"


def test_it_refuses_doubles_and_signed_integers():
    for dtype in (np.float64, np.int16, np.int32):
        x = np.ones((2, 2), dtype)
        with pytest.raises(cv2.error):
            cv2.calcHist([x], [0], None, [4], [0, 4])
        assert pa.image.histogram(x, 4, (0, 4)).counts.tolist() == [[0, 4, 0, 0]]


def test_its_shape_has_changed_between_versions():
    shape = cv2.calcHist([np.zeros((2, 2), np.uint8)], [0], None, [256], [0, 256]).shape
    assert shape in {(256,), (256, 1)}


def test_empty_mask_counts_nothing_in_both():
    x = np.zeros((3, 3), np.uint8)
    none = np.zeros((3, 3), bool)
    assert cv2_histogram(x, 256, 0, 256, none).sum() == pa.image.histogram(x, mask=none).counts.sum() == 0


def objective(x, t):
    x = x.astype(float)
    low, high = x[x <= t], x[x > t]
    return 0.0 if not low.size or not high.size else low.size * high.size * (low.mean() - high.mean()) ** 2


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_otsu(dtype):
    rng = np.random.default_rng(3)
    for _ in range(300):
        x = rng.integers(0, rng.integers(3, 250), (1, rng.integers(5, 60))).astype(dtype)
        if x.min() == x.max():
            continue
        ours, theirs = pa.image.otsu(x).value, cv2.threshold(x, 0, 255, cv2.THRESH_OTSU)[0]
        same = np.array_equal(x > ours, x > theirs)
        assert same or objective(x, theirs) == pytest.approx(objective(x, ours), rel=1e-9)


def test_otsu_of_a_masked_picture():
    rng = np.random.default_rng(4)
    for k in range(20):
        x = np.where(rng.random((60, 70)) < 0.3, rng.normal(80, 15, (60, 70)), rng.normal(160, 20, (60, 70)))
        x = x.clip(0, 255).astype(np.uint8)
        mask = rng.random((60, 70)) < 0.3 + 0.03 * k
        theirs = cv2.thresholdWithMask(x, np.zeros_like(x), mask.astype(np.uint8) * 255, 0, 255, cv2.THRESH_OTSU)[0]
        ours = pa.image.otsu(x, mask).value
        same = np.array_equal(x[mask] > ours, x[mask] > theirs)
        assert same or objective(x[mask], theirs) == pytest.approx(objective(x[mask], ours), rel=1e-9)


def test_plateaus_and_ties():
    x = np.array([[10] * 5 + [200] * 5], np.uint8)
    assert pa.image.otsu(x).value == cv2.threshold(x, 0, 255, cv2.THRESH_OTSU)[0] == 10
    for counts, theirs in (([1, 1, 1], 1), ([3, 0, 0, 3, 0, 0, 3], 3)):
        x = np.repeat(np.arange(len(counts)), counts).astype(np.uint8)[None]
        assert cv2.threshold(x, 0, 255, cv2.THRESH_OTSU)[0] == theirs, "it takes the later of two equal cuts"
        assert pa.image.otsu(x).value == 0, "the first"


def test_a_constant_picture_is_all_foreground_there_and_none_here():
    x = np.full((4, 4), 7, np.uint8)
    assert cv2.threshold(x, 0, 255, cv2.THRESH_OTSU)[0] == 0
    ours = pa.image.otsu(x)
    assert not (x > ours.value).any()
    assert ours.separability == 0


def test_it_refuses_floats():
    x = np.random.default_rng(0).random((8, 8), dtype=np.float32)
    with pytest.raises(cv2.error):
        cv2.threshold(x, 0, 1, cv2.THRESH_OTSU)
    assert 0 < pa.image.otsu(x).value < 1

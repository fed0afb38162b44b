"""pleinair.image against scikit-image, and where scikit-image is known to differ."""

import numpy as np
import pleinair as pa
import pytest
from skimage.exposure import histogram as skimage_histogram
from skimage.filters import threshold_otsu


def objective(x, t):
    x = x.astype(float)
    low, high = x[x <= t], x[x > t]
    return 0.0 if not low.size or not high.size else low.size * high.size * (low.mean() - high.mean()) ** 2


def test_integer_histogram():
    x = np.random.default_rng(0).integers(0, 256, (64, 80), dtype=np.uint8)
    counts, centres = skimage_histogram(x, source_range="dtype")
    np.testing.assert_array_equal(pa.image.histogram(x).counts[0], counts)
    assert centres[0] == 0


def test_its_float_range_is_the_pictures_own_and_dtype_means_minus_one_to_one():
    x = np.random.default_rng(0).random((64, 80)) * 0.5 + 0.25
    counts, _ = skimage_histogram(x, 64)
    np.testing.assert_array_equal(pa.image.histogram(x, 64, (x.min(), x.max())).counts[0], counts)
    counts, centres = skimage_histogram(x * 4, 64, source_range="dtype")
    assert centres[0] < -0.9
    assert counts.sum() < x.size, "it drops what lies beyond 1 silently"
    ours = pa.image.histogram(x * 4, 64, (-1, 1))
    np.testing.assert_array_equal(ours.counts[0], counts)
    assert ours.over[0] == x.size - counts.sum()


def test_it_refuses_nan_where_we_count_it():
    x = np.array([0.0, np.nan, 1.0])
    with pytest.raises(ValueError):
        skimage_histogram(x)
    assert pa.image.histogram(x, 2).nan.tolist() == [1]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_otsu_of_integers(dtype):
    rng = np.random.default_rng(1)
    for _ in range(300):
        x = rng.integers(0, rng.integers(3, 250), rng.integers(5, 60), dtype=dtype)
        if x.min() == x.max():
            continue
        ours, theirs = pa.image.otsu(x).value, threshold_otsu(x)
        same = np.array_equal(x > ours, x > theirs)
        assert same or objective(x, theirs) == pytest.approx(objective(x, ours), rel=1e-12)


def test_plateaus_return_the_first_level():
    x = np.array([10] * 5 + [200] * 5, np.uint8)
    assert pa.image.otsu(x).value == threshold_otsu(x) == 10


def test_it_misses_the_first_of_equal_maximisers_sometimes():
    rng = np.random.default_rng(4)
    missed = 0
    for _ in range(1500):
        half = rng.integers(0, 5, rng.integers(2, 6))
        counts = np.concatenate([half, half[::-1]])
        if (counts > 0).sum() < 2:
            continue
        x = np.repeat(np.arange(counts.size), counts).astype(np.uint8)
        ours, theirs = pa.image.otsu(x).value, threshold_otsu(x)
        assert objective(x, theirs) == pytest.approx(objective(x, ours), rel=1e-9)
        if not np.array_equal(x > ours, x > theirs):
            assert ours < theirs, "ours is the first"
            missed += 1
    assert missed >= 1


def test_constant_pictures_have_no_foreground_in_either():
    x = np.full((4, 4), 7, np.uint8)
    assert threshold_otsu(x) == 7
    assert pa.image.otsu(x) == pa.image.Threshold(7.0, 0.0)


def test_empty_is_an_index_error_there_and_a_sentence_here():
    with pytest.raises((IndexError, ValueError)):
        threshold_otsu(np.zeros(0, np.uint8))
    with pytest.raises(ValueError, match="img is empty"):
        pa.image.otsu(np.zeros(0, np.uint8))


@pytest.mark.parametrize("nbins", [16, 64, 256, 1024])
def test_binned_mode_is_skimages_float_threshold(nbins):
    rng = np.random.default_rng(6)
    x = np.concatenate([rng.normal(0.3, 0.1, 3000), rng.normal(0.65, 0.12, 5000)])
    theirs = threshold_otsu(x, nbins)
    assert pa.image.otsu(x, nbins=nbins).value == pytest.approx(theirs, abs=1e-12)
    width = (x.max() - x.min()) / nbins
    assert abs(pa.image.otsu(x).value - theirs) <= 3 * width + 5e-3


def test_its_bin_centre_cuts_a_bin_in_half_and_loses_to_the_exact_cut():
    rng = np.random.default_rng(7)
    worse = 0
    for _ in range(20):
        x = np.concatenate([rng.normal(0.3, 0.1, 300), rng.normal(0.65, 0.12, 500)])
        ours, theirs = objective(x, pa.image.otsu(x).value), objective(x, threshold_otsu(x))
        assert ours >= theirs * (1 - 1e-12)
        worse += ours > theirs * (1 + 1e-9)
    assert worse >= 10


def test_an_outlier_ruins_the_binned_threshold():
    rng = np.random.default_rng(9)
    x = np.concatenate([rng.normal(0.45, 0.005, 200_000), rng.normal(0.5, 0.005, 200_000)])
    with_sun = np.append(x, 10.0)  # 256 bins of 0.037 each over two lobes 0.05 apart
    binned = pa.image.otsu(with_sun, nbins=256).value
    assert binned == pytest.approx(threshold_otsu(with_sun), abs=1e-9)
    assert not 0.47 < binned < 0.48
    assert 0.47 < pa.image.otsu(with_sun).value < 0.48

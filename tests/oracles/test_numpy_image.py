"""pleinair.image against numpy: histograms and the exact optimum of Otsu's criterion by brute force."""

from fractions import Fraction

import numpy as np
import pleinair as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st


@pytest.fixture(scope="module")
def noise():
    return np.random.default_rng(11).random((211, 307, 3), dtype=np.float32) * 1.2 - 0.1


def reference(x, bins, low, high):
    return np.histogram(x[np.isfinite(x)].astype(np.float64), bins, (low, high))[0]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("bins", [1, 4, 256, 1024])
def test_power_of_two_bins_are_numpys(noise, dtype, bins):
    x = noise.astype(dtype)
    result = pa.image.histogram(x, bins)
    counts, edges = result
    for c in range(3):
        expected, expected_edges = np.histogram(x[..., c], bins, (0, 1))
        np.testing.assert_array_equal(counts[c], expected)
        np.testing.assert_array_equal(edges, expected_edges)
        assert result.under[c] == (x[..., c] < 0).sum()
        assert result.over[c] == (x[..., c] > 1).sum()
    assert counts.dtype == np.uint64
    assert edges.dtype == np.float64


@pytest.mark.parametrize(("bins", "low", "high"), [(100, 0.0, 1.0), (256, 0.1, 0.9), (37, -0.05, 1.07)])
def test_any_range_away_from_edges_is_numpys(noise, bins, low, high):
    position = (noise.astype(np.float64) - low) * (bins / (high - low))
    inner = np.abs(position - np.rint(position)) > 1e-5
    assert inner.mean() > 0.99
    counts, _ = pa.image.histogram(noise, bins, (low, high), mask=inner.all(axis=2))
    for c in range(3):
        np.testing.assert_array_equal(counts[c], reference(noise[..., c][inner.all(axis=2)], bins, low, high))


def test_the_rule_at_the_edges_is_the_one_stated():
    low, high, bins = 0.1, 0.9, 256
    edges = np.linspace(low, high, bins + 1)
    x = np.concatenate([np.nextafter(edges, -1), edges, np.nextafter(edges, 2)])
    x = x[(x >= low) & (x <= high)]
    slot = np.minimum(np.floor((x - low) * (bins / (high - low))), bins - 1).astype(int)
    np.testing.assert_array_equal(pa.image.histogram(x, bins, (low, high)).counts[0], np.bincount(slot, minlength=bins))


def test_numpy_misplaces_single_precision_near_edges_and_we_do_not():
    edges = np.linspace(0, 1, 101).astype(np.float32)
    x = np.concatenate([np.nextafter(edges, np.float32(-1)), edges, np.nextafter(edges, np.float32(2))])
    x = x[(x >= 0) & (x <= 1)]
    ours = pa.image.histogram(x, 100, (0, 1)).counts[0]
    np.testing.assert_array_equal(ours, pa.image.histogram(x.astype(np.float64), 100, (0, 1)).counts[0])
    assert np.abs(np.histogram(x, 100, (0, 1))[0] - ours.astype(int)).sum() > 20


def test_bytes_and_words_are_bincounts():
    rng = np.random.default_rng(3)
    mask = rng.random((150, 170)) < 0.4
    mask[:40] = True
    mask[60:100] = False
    for dtype, top in ((np.uint8, 256), (np.uint16, 65536)):
        x = rng.integers(0, top, (150, 170, 3), dtype=dtype)
        for m in (None, mask):
            chosen = x.reshape(-1, 3) if m is None else x[m]
            counts, edges = pa.image.histogram(x, top, mask=m)
            assert (edges[0], edges[-1]) == (0, top)
            for c in range(3):
                np.testing.assert_array_equal(counts[c], np.bincount(chosen[:, c], minlength=top))
                folded, _ = pa.image.histogram(x, 16, mask=m)
                np.testing.assert_array_equal(folded[c], np.bincount(chosen[:, c] // (top // 16), minlength=16))


def test_closed_top_edge_outside_and_nan_are_counted_once():
    x = np.array([-0.1, 0.0, 0.25, 0.999, 1.0, 1.1, np.inf, -np.inf, np.nan, -0.0], np.float32)
    result = pa.image.histogram(x, 4)
    assert result.counts.tolist() == [[2, 1, 0, 2]]
    assert (result.under[0], result.over[0], result.nan[0]) == (2, 2, 1)
    assert result.counts.sum() + result.under[0] + result.over[0] + result.nan[0] == x.size


def test_boost_histogram_agrees_on_under_and_overflow(noise):
    bh = pytest.importorskip("boost_histogram")
    axis = bh.axis.Regular(64, 0, 1)
    ours = pa.image.histogram(noise[..., 0], 64)
    theirs = bh.Histogram(axis).fill(noise[..., 0].ravel().astype(np.float64)).view(flow=True)
    below = noise[..., 0] < 1  # boost sends the top edge to overflow
    assert below.mean() > 0.8
    np.testing.assert_array_equal(ours.counts[0], theirs[1:-1])
    assert (ours.under[0], ours.over[0]) == (theirs[0], theirs[-1])


def test_fast_histogram_agrees_below_the_top_edge(noise):
    fast = pytest.importorskip("fast_histogram")
    x = noise[..., 1].ravel()
    np.testing.assert_array_equal(pa.image.histogram(x).counts[0], fast.histogram1d(x, 256, (0, 1)))
    one = np.ones(5, np.float32)
    assert fast.histogram1d(one, 4, (0, 1)).sum() == 0, "it drops the top edge"
    assert pa.image.histogram(one, 4).counts.tolist() == [[0, 0, 0, 5]]


def exact_otsu(values, counts):
    """Return the first maximiser among the positions of `values` (integers) and all objectives, in rationals."""
    total = sum(counts)
    whole = sum(v * n for v, n in zip(values, counts, strict=True))
    w = s = 0
    objective = []
    for v, n in zip(values[:-1], counts[:-1], strict=True):
        w += n
        s += v * n
        objective.append(Fraction((whole * w - total * s) ** 2, w * (total - w)))
    return objective.index(max(objective)), max(objective)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64, np.int32])
def test_otsu_is_the_first_exact_maximiser(dtype):
    rng = np.random.default_rng(5)
    ties = 0
    for trial in range(700):
        levels = np.sort(rng.choice(250, rng.integers(2, 9), replace=False))
        counts = rng.integers(1, 6, levels.size)
        if trial % 2:  # symmetric: every cut but the middle one has an equal
            levels = np.unique(np.concatenate([levels, 250 - levels]))
            half = rng.integers(1, 6, levels.size)
            counts = half + half[::-1]
        x = rng.permutation(np.repeat(levels, counts)).astype(dtype)
        k, best = exact_otsu(levels.tolist(), counts.tolist())
        threshold = pa.image.otsu(x)
        np.testing.assert_array_equal(x > threshold.value, x > levels[k])
        if np.dtype(dtype).itemsize < 4 and np.dtype(dtype).kind == "u":
            assert threshold.value == levels[k]
        elif np.dtype(dtype).kind == "f":
            assert threshold.value == (levels[k] + levels[k + 1]) / 2
        mean = Fraction(int((levels * counts).sum()), int(counts.sum()))
        squares = sum(int(n) * (int(v) - mean) ** 2 for v, n in zip(levels, counts, strict=True))
        assert threshold.separability == pytest.approx(float(best / int(counts.sum()) / squares), rel=1e-12)
        ties += trial % 2
    assert ties == 350


def test_otsu_of_floats_is_partition_exact():
    rng = np.random.default_rng(8)
    for trial in range(60):
        x = np.concatenate([rng.normal(0.3, 0.1, 40), rng.normal(0.7, 0.1, 60)]).astype(np.float32)
        if trial % 3 == 0:
            x = x * np.float32(1e-30) if trial % 2 else x * np.float32(1e30)
        ordered = np.sort(x)
        scaled = [Fraction(float(v)) for v in ordered]
        total, whole = len(scaled), sum(scaled)
        w, s, best, where = 0, Fraction(0), Fraction(-1), None
        for i in range(total - 1):
            w, s = w + 1, s + scaled[i]
            if ordered[i] != ordered[i + 1]:
                objective = (whole * w - total * s) ** 2 / (w * (total - w))
                if objective > best:
                    best, where = objective, i
        threshold = pa.image.otsu(x)
        assert ordered[where] <= threshold.value < ordered[where + 1]
        assert (x > threshold.value).sum() == total - 1 - where, "and the comparison in float32 cuts there too"


def test_one_outlier_does_not_move_the_exact_threshold():
    rng = np.random.default_rng(2)
    x = np.concatenate([rng.normal(0.3, 0.03, 4000), rng.normal(0.7, 0.03, 6000)]).astype(np.float32)
    clean = pa.image.otsu(x).value
    hot = np.append(x, np.float32(50.0))
    assert 0.4 < clean < 0.6
    assert not (0.45 < pa.image.otsu(hot, nbins=256).value < 0.55), "256 bins over [0, 50] cannot"
    assert 0.4 < pa.image.otsu(np.append(x, np.float32(1.5))).value < 0.6


@settings(max_examples=200, deadline=None)
@given(
    bins=st.integers(1, 300),
    low=st.floats(-1e6, 1e6, allow_subnormal=False),
    width=st.floats(1e-6, 1e6, allow_subnormal=False),
)
def test_no_sample_lies_outside_the_edges_of_its_bin(bins, low, width):
    high = low + width
    edges = pa.image.histogram(np.zeros(1), bins, (low, high)).edges
    np.testing.assert_allclose(
        edges, np.linspace(low, high, bins + 1), rtol=0, atol=4 * np.spacing(max(abs(low), abs(high)))
    )
    assert (np.diff(edges) > 0).all()
    assert (edges[0], edges[-1]) == (low, high)
    near = np.concatenate([np.nextafter(edges, -np.inf), edges, np.nextafter(edges, np.inf)])
    near = near[(near >= low) & (near <= high)]
    found = pa.image.histogram(near, bins, (low, high)).counts[0]
    bin_of = np.minimum(np.searchsorted(edges, near, side="right") - 1, bins - 1)
    np.testing.assert_array_equal(found, np.bincount(bin_of, minlength=bins))


def test_ranges_that_bins_cannot_share_are_refused():
    with pytest.raises(ValueError, match=r"range: must be wide enough for 10 bins, got \(1e0, 1\.0000000000000002e0\)"):
        pa.image.histogram(np.ones(3), 10, (1, 1 + 2.2e-16))
    with pytest.raises(
        ValueError, match=r"range: must rise, and be finite and its width too, got \(-1\.7e308, 1\.7e308\)"
    ):
        pa.image.histogram(np.ones(3), 10, (-1.7e308, 1.7e308))

"""The same bits at every SIMD level and for every number of threads."""

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core

LEVELS = _core.simd_levels()
THREADS = (1, 2, 7)


@pytest.fixture(autouse=True)
def _restore():
    threads = pa.get_num_threads()
    yield
    _core.force_simd_level(None)
    pa.set_num_threads(threads)


def everywhere(call):
    """Yield the results of a call at every level and thread count."""
    for level in LEVELS:
        for threads in THREADS:
            _core.force_simd_level(level)
            pa.set_num_threads(threads)
            yield f"{level}, {threads} threads", call()


def bits(x):
    return np.ascontiguousarray(x).tobytes()


def same_bits(call):
    results = list(everywhere(call))
    assert len(results) == len(LEVELS) * len(THREADS)
    for name, result in results[1:]:
        assert result == results[0][1], name


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("masked", [False, True])
def test_histogram(dtype, masked):
    rng = np.random.default_rng(1)
    x = rng.random((701, 503, 3)) * 1.2 - 0.1
    x[::50] = np.nan
    x = np.nan_to_num(x * 200, nan=3).clip(0, 255).astype(dtype) if np.dtype(dtype).kind == "u" else x.astype(dtype)
    mask = rng.random((701, 503)) < 0.5 if masked else None

    def call():
        for bins, range_ in ((256, None), (100, (0.05, 0.95)), (1000, (0, 1))):
            r = pa.image.histogram(x, bins, range_, mask)
            yield bits(r.counts), bits(r.under), bits(r.over), bits(r.nan)

    same_bits(lambda: list(call()))


def test_otsu():
    rng = np.random.default_rng(2)
    x = rng.random((701, 503), dtype=np.float32)
    same_bits(lambda: (pa.image.otsu(x), pa.image.otsu(x, nbins=256), pa.image.otsu((x * 255).astype(np.uint8))))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_fill(dtype):
    rng = np.random.default_rng(3)
    x = rng.random((301, 403, 3)).astype(dtype)
    mask = rng.random((301, 403)) < 0.55
    mask[40:200, 50:350] = True
    same_bits(lambda: bits(pa.image.fill(x, mask)))


def test_segment_sky():
    rng = np.random.default_rng(4)
    y = np.linspace(0, 1, 300)[:, None, None]
    x = (np.array([0.1, 0.2, 0.5]) + 0.3 * y + rng.random((300, 400, 3)) * 0.05).astype(np.float32)
    x[60:120, 50:300] = 0.8
    x[220:] = rng.random((80, 400, 3)) * np.array([0.2, 0.25, 0.05])

    def call():
        for method in ("nbr", "chroma"):
            s = pa.image.segment_sky(x, method=method)
            yield bits(s.cloud), bits(s.ground), bits(s.feature), s.threshold, s.separability, s.contrast, s.verdict

    same_bits(lambda: list(call()))

"""Smoothing of a basis across its nodes and its low-rank form, against numpy's QR and SVD in double precision."""

import time
from collections.abc import Callable

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core
from scipy.stats import norm

G = np.tanh(np.linspace(0, np.arctanh(0.97), 12))
SIGMA = np.geomspace(1e-3, 0.1, 12)
GROUPS, PIXELS = 3, 700


def images(seed: int = 0) -> np.ndarray:
    """Light that is smooth across the nodes, with noise (groups, g, sigma, pixels)."""
    rng = np.random.default_rng(seed)
    a, b, c = rng.random((3, GROUPS, 1, 1, PIXELS))
    x, y = np.arctanh(G)[:, None, None], np.log(SIGMA)[:, None]
    clean = np.exp(-a * x) * (2 + np.cos(b * y + c)) + 0.1
    return (clean * (1 + 0.02 * rng.standard_normal(clean.shape))).astype(np.float32)


def judge_fit(multiple: np.ndarray, error: np.ndarray) -> np.ndarray:
    kind = np.polynomial.chebyshev.chebvander
    x, y = np.arctanh(G), np.log(SIGMA)
    u, v = (2 * (a - a[0]) / (a[-1] - a[0]) - 1 for a in (x, y))
    terms = np.einsum("gi,sj->gsij", kind(u, 5), kind(v, 7)).reshape(u.size * v.size, -1)
    out = []
    for flat, e in zip(multiple.reshape(GROUPS, -1, PIXELS).astype(float), error.reshape(GROUPS, -1), strict=True):
        weight = 1 / e[:, None]
        q = np.linalg.qr(terms * weight)[0]
        out.append(np.maximum(((q @ q.T) * weight.T / weight) @ flat, 0))
    return np.array(out).reshape(multiple.shape)


def judge_factors(multiple: np.ndarray, light: np.ndarray) -> np.ndarray:
    count = GROUPS * G.size * SIGMA.size
    scale = np.broadcast_to(light, multiple.shape[:3]).reshape(-1, 1)
    a = multiple.reshape(count, PIXELS) / scale
    q = start()
    for _ in range(2):
        q = np.linalg.qr(a.T @ np.linalg.qr(a @ q)[0])[0]
    u, s, v = np.linalg.svd(a @ q, full_matrices=False)
    return (((u[:, :32] * s[:32]) @ (v[:32] @ q.T)) * scale).reshape(multiple.shape)


def mix(z: np.ndarray) -> np.ndarray:
    # SplitMix64's finaliser (Steele, Lea and Flood 2014).
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def start(rows: int = PIXELS) -> np.ndarray:
    """Normal numbers, cut off at three deviations, of the counter-based generator: what a search starts from."""
    golden, count = np.uint64(0x9E3779B97F4A7C15), np.arange(rows * 40, dtype=np.uint64)
    with np.errstate(over="ignore"):
        key = mix(mix(np.array([0x103A4E], np.uint64) + golden))
        bits = mix(mix(key ^ (count * golden)) + count)
    tail = norm.cdf(-3)
    return norm.ppf(tail + (1 - 2 * tail) * ((bits >> np.uint64(11)) * 2.0**-53)).reshape(rows, 40)


def off(got: np.ndarray, want: np.ndarray) -> float:
    """Largest error over the largest value of its image."""
    return float((np.abs(got - want) / np.abs(want).max(-1, keepdims=True)).max())


def test_the_fit_across_nodes_is_that_of_numpy():
    multiple = images()
    error = np.random.default_rng(1).uniform(0.01, 0.4, multiple.shape[:3])
    want = judge_fit(multiple, error)
    _core.clouds_fit_nodes(multiple, G.tolist(), SIGMA.tolist(), error.reshape(-1).tolist())
    assert off(multiple, want) < 3e-7
    assert np.abs(multiple - images()).max() > 1e-3, "noise was there to be taken away"


def test_the_factors_are_those_of_numpys_svd():
    multiple = images()
    light = np.random.default_rng(2).uniform(0.1, 3, multiple.shape[1:3])
    by = light.reshape(-1).tolist() * GROUPS
    coefficients, components = _core.clouds_factors(multiple, by, (GROUPS, 144))
    assert coefficients.size == 32 * GROUPS * 144
    assert components.size == 32 * PIXELS
    want = judge_factors(multiple.astype(float), light)
    out = np.empty_like(multiple)
    _core.clouds_multiply(coefficients, components, 32, out)
    assert off(out, want) < 3e-7


def test_the_light_of_nodes_is_that_of_numpy():
    rng = np.random.default_rng(4)
    multiple, area = images(), 1000
    scattered = rng.random((5, 20, 50), dtype=np.float32)
    cosine = rng.uniform(-1, 1, (20, 50)).astype(np.float32)
    pixels = np.sort(rng.choice(area, PIXELS, replace=False)).astype(np.uint32)
    sigma = np.geomspace(1e-3, 0.1, 5)
    got = _core.clouds_node_light(scattered, sigma.tolist(), cosine, pixels, multiple, G.tolist(), SIGMA.tolist())
    at = cosine.reshape(-1)[pixels].astype(float)
    for j in (0, 5, 11):
        for m in (0, 4, 11):
            phase = (1 - G[j] ** 2) / (1 + G[j] ** 2 - 2 * G[j] * at) ** 1.5
            once = scattered.reshape(5, -1)[np.argmin(np.abs(sigma - SIGMA[m])), pixels] * phase
            want = np.sqrt(np.square(once + multiple[:, j, m].astype(float).sum(0)).mean())
            assert got[12 * j + m] == pytest.approx(want, rel=1e-6)


@pytest.mark.parametrize("threads", [1, 2])
def test_the_bits_do_not_depend_on_threads(threads):
    multiple = images()
    before = pa.get_num_threads()
    try:
        pa.set_num_threads(threads)
        found = _core.clouds_factors(multiple, None, (GROUPS, 144))
    finally:
        pa.set_num_threads(before)
    one = _core.clouds_factors(multiple, None, (GROUPS, 144))
    assert all(np.array_equal(a, b) for a, b in zip(found, one, strict=True))


def test_few_pixels_have_few_components():
    multiple = np.ascontiguousarray(images()[..., :7])
    coefficients, components = _core.clouds_factors(multiple, None, (GROUPS, 144))
    out = np.empty_like(multiple)
    _core.clouds_multiply(coefficients, components, components.size // 7, out)
    assert off(out, multiple) < 3e-7


def test_it_costs_about_what_numpy_takes():
    rng, count = np.random.default_rng(5), GROUPS * 144
    multiple, begin = rng.random((GROUPS, 12, 12, 4000), dtype=np.float32), rng.random((4000, 40), dtype=np.float32)

    def numpys() -> None:
        a, q = multiple.reshape(count, -1), begin
        for _ in range(2):
            q = np.linalg.qr(a.T @ np.linalg.qr(a @ q)[0])[0]
        _, s, v = np.linalg.svd(a @ q, full_matrices=False)
        assert (s[:32, None] * (v[:32] @ q.T)).shape == (32, 4000)

    def shortest(work: Callable[[], object]) -> float:
        times = []
        for _ in range(4):
            before = time.perf_counter()
            work()
            times.append(time.perf_counter() - before)
        return min(times)

    ours = shortest(lambda: _core.clouds_factors(multiple, [1.0] * count, (GROUPS, 144)))
    # The margin is for a busy machine; measured values are in the head of src/clouds/low_rank.rs.
    assert ours < 4 * shortest(numpys) + 0.1

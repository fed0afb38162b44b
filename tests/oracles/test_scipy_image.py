"""pleinair.image.fill against a sparse direct solution and against pyamg, on masks that are hard for iterations."""

import numpy as np
import pleinair as pa
import pytest
import scipy.sparse as sp
from scipy.ndimage import gaussian_filter
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu


def system(mask):
    """Return the matrix over the masked pixels and the one that sums their known neighbours."""
    h, w = mask.shape
    n = h * w
    pairs = []
    index = np.arange(n).reshape(h, w)
    for a, b in ((index[:, :-1], index[:, 1:]), (index[:-1], index[1:])):
        pairs += [(a.ravel(), b.ravel()), (b.ravel(), a.ravel())]
    i = np.concatenate([p[0] for p in pairs])
    j = np.concatenate([p[1] for p in pairs])
    adjacency = sp.csr_matrix((np.ones(i.size), (i, j)), (n, n))
    hole = np.flatnonzero(mask)
    known = np.flatnonzero(~mask)
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    a = sp.diags(degree[hole]) - adjacency[hole][:, hole]
    return a.tocsc(), adjacency[hole][:, known]


def direct(img, mask):
    """Return the exact solution (sparse LU in double precision)."""
    a, known = system(mask)
    out = img.astype(np.float64)
    out[mask] = splu(a, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(known @ out[~mask])
    return out


H, W = 120, 160


def sky(h=H, w=W):
    y, x = np.mgrid[:h, :w] / h
    glow = 0.5 * np.exp(-((x - 0.9) ** 2 + (y - 0.3) ** 2) * 30)
    noise = np.random.default_rng(0).normal(0, 0.02, (h, w))
    return (
        np.stack([0.2 + 0.3 * y + glow, 0.35 + 0.3 * y + glow, 0.8 - 0.1 * y + 0.3 * glow], axis=2) + noise[..., None]
    )


def masks():
    rng = np.random.default_rng(42)
    noise = gaussian_filter(rng.normal(size=(H, W)), 6)
    yield "clouds 47 %", noise > np.quantile(noise, 0.53)
    yield "islands 30 %", rng.random((H, W)) < 0.3
    yield "percolation 59.3 %", rng.random((H, W)) < 0.593
    yield "random 90 %", rng.random((H, W)) < 0.9
    serpentine = np.zeros((H, W), bool)
    serpentine[1::2, 1:-1] = True
    serpentine[2:-1:4, -2] = True
    serpentine[4:-1:4, 1] = True
    yield "serpentine", serpentine
    blobs = np.zeros((H, W), bool)
    for k in range(5):
        blobs[:, 4 + 32 * k : 28 + 32 * k] = True
        blobs[7 + 20 * k, :] = True
    blobs[:2, ::7] = False
    yield "blobs and bridges", blobs
    only = np.ones((H, W), bool)
    only[0] = False
    yield "top row known", only
    only = np.ones((H, W), bool)
    only[:, 0] = False
    yield "left column known", only
    lower = np.zeros((H, W), bool)
    lower[H // 3 :] = True
    yield "lower two thirds", lower
    one = np.ones((H, W), bool)
    one[50, 70] = False
    yield "one known pixel", one
    two = np.ones((H, W), bool)
    two[0, 0] = two[-1, -1] = False
    yield "two corners known", two
    single = np.zeros((H, W), bool)
    single[::2, ::2] = True
    yield "single pixels", single
    yield "nothing", np.zeros((H, W), bool)
    maze = np.ones((H, W), bool)
    maze[::2, :] = rng.random((H // 2, W)) < 0.08
    yield "rows joined by few pixels", maze


MASKS = dict(masks())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", MASKS)
def test_error_stays_below_a_twentieth_of_a_level(name, dtype):
    img = sky().astype(dtype)
    mask = MASKS[name]
    img[mask] = np.nan
    expected = direct(np.where(mask[..., None], 0, img), mask)
    out = pa.image.fill(img, mask)
    assert out.dtype == dtype
    np.testing.assert_array_equal(out[~mask], img[~mask])
    assert np.abs(out - expected).max() * 255 <= 0.05
    tight = pa.image.fill(img, mask, tolerance=1e-9)
    assert np.abs(tight - expected).max() <= (1e-6 if dtype == np.float32 else 1e-8)


def multigrid(img, mask):
    """Return the solution by algebraic multigrid, where a direct one takes seconds."""
    pyamg = pytest.importorskip("pyamg")
    a, known = system(mask)
    solver = pyamg.ruge_stuben_solver(a.tocsr())
    out = img.astype(np.float64)
    out[mask] = np.stack([solver.solve(b, tol=1e-10, accel="cg") for b in (known @ out[~mask]).T], axis=1)
    return out


def test_larger_pictures_hold_the_same_bound():
    rng = np.random.default_rng(1)
    for kind in ("clouds", "lower", "percolation", "top"):
        img = sky(480, 640)
        noise = gaussian_filter(rng.normal(size=(480, 640)), 12)
        mask = {
            "clouds": noise > np.quantile(noise, 0.53),
            "lower": np.arange(480)[:, None] + np.zeros(640) >= 160,
            "percolation": rng.random((480, 640)) < 0.593,
            "top": np.arange(480)[:, None] + np.zeros(640) >= 1,
        }[kind]
        expected = multigrid(img, mask)
        if kind == "clouds":
            assert np.abs(expected - direct(img, mask)).max() < 1e-7, "the judge"
        assert np.abs(pa.image.fill(img, mask) - expected).max() * 255 <= 0.05, kind


def test_units_do_not_matter():
    img, mask = sky(), MASKS["clouds 47 %"]
    base = pa.image.fill(img, mask)
    for scale, offset in ((1e6, 0.0), (1e-9, 0.0), (2.0, 5000.0), (-1.0, 1.0)):
        scaled = pa.image.fill(img * scale + offset, mask)
        np.testing.assert_allclose((scaled - offset) / scale, base, atol=1e-4)


def test_many_channels_are_filled_alike():
    rng = np.random.default_rng(3)
    img, mask = rng.random((40, 50, 7)), rng.random((40, 50)) < 0.4
    np.testing.assert_allclose(pa.image.fill(img, mask, tolerance=1e-9), direct(img, mask), atol=1e-8)
    for c in range(7):
        one = pa.image.fill(img[..., c], mask, tolerance=1e-9)
        np.testing.assert_allclose(one, direct(img, mask)[..., c], atol=1e-8)


def test_maximum_principle_and_means():
    img, mask = sky(), MASKS["clouds 47 %"]
    out = pa.image.fill(img, mask, tolerance=1e-10)
    inner = mask[1:-1, 1:-1]
    mean = (out[:-2, 1:-1] + out[2:, 1:-1] + out[1:-1, :-2] + out[1:-1, 2:]) / 4
    np.testing.assert_allclose(out[1:-1, 1:-1][inner], mean[inner], atol=1e-8)
    assert out[mask].min() >= img[~mask].min()
    assert out[mask].max() <= img[~mask].max()


def test_pyamg_solves_the_same_system():
    pyamg = pytest.importorskip("pyamg")
    img, mask = sky()[..., 0], MASKS["clouds 47 %"]
    a, known = system(mask)
    solver = pyamg.ruge_stuben_solver(a.tocsr())
    theirs = solver.solve(known @ img[~mask], tol=1e-10, accel="cg")
    np.testing.assert_allclose(pa.image.fill(img, mask, tolerance=1e-9)[mask], theirs, atol=1e-7)


def test_every_region_has_contact_unless_all_is_masked():
    rng = np.random.default_rng(6)
    mask = rng.random((60, 60)) < 0.5
    _, known = system(mask)
    count, region = connected_components(system(mask)[0], directed=False)
    assert count > 50
    contact = np.asarray(known.sum(axis=1)).ravel() > 0
    assert np.unique(region[contact]).size == count
    everything = np.ones((5, 6), bool)
    with pytest.raises(ValueError, match="mask: 1 masked region touches no known pixel"):
        pa.image.fill(np.zeros((5, 6)), everything)
    out = pa.image.fill(np.zeros((5, 6, 3), np.float32), everything, outside=(1, 2, 3))
    np.testing.assert_array_equal(out, np.broadcast_to(np.float32([1, 2, 3]), (5, 6, 3)))
    assert np.isnan(pa.image.fill(np.zeros((5, 6)), everything, outside=np.nan)).all()

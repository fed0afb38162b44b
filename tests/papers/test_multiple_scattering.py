"""Light of every order against exact slabs: order-resolved Henyey-Greenstein tables, Chandrasekhar's H function.

A slab is a box a million times wider than thick. The estimator works pixel by pixel, so 64 pixels that look at the
same point are 64 independent estimates: their scatter gives the standard error. Radiance for unit irradiance across
the beam is what is rendered with a phase function of mean 1, over 4 pi. `data/hg_slab_orders.csv` (by order, times
albedo^k) and `data/hg_slab_table.csv` (all orders) come from invariant embedding and adding, with no random numbers.
"""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pleinair as pa
import pytest
from pleinair.clouds import Basis, Conventions, Params, Volume, render

DATA = Path(__file__).parent / "data"
ORDERS = np.loadtxt(DATA / "hg_slab_orders.csv", delimiter=",")
TABLE = np.loadtxt(DATA / "hg_slab_table.csv", delimiter=",")
MUS = (1.0, 0.8, 0.5, 0.2)
WIDE = 1e6
SLAB = Volume(np.ones((6, 2, 2)), (WIDE, WIDE, 1 / 6), (-WIDE, -WIDE, 0))  # 1 m thick: sigma is the optical depth
ZENITH = pa.Sun(90)


def eye(mu, side, n=8):
    """A camera whose pixels all look at the slab along one direction: down at its top, or up at its bottom."""
    up = side == "T"
    if mu == 1:
        return pa.Camera(n, n, fov=0.01, elevation=90 if up else -90, position=(0, 0, -10 if up else 11))
    far = 10.0
    flat, height = math.sqrt(1 - mu * mu) * far, mu * far
    position = (flat, 0, -height if up else 1 + height)
    return pa.Camera.look_at(position, (0, 0, 0 if up else 1), n, n, fov=0.01)


def estimate(pixels):
    """Mean and standard error over pixels, the last axis."""
    x = np.asarray(pixels, float)
    return x.mean(-1), x.std(-1, ddof=1) / math.sqrt(x.shape[-1])


def once(g, tau, mu, side):
    """What is scattered once in a slab lit from the zenith."""
    cosine = mu if side == "T" else -mu
    p = (1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5 / (4 * math.pi)
    if side == "R":
        return p / (1 + mu) * -math.expm1(-tau * (1 + 1 / mu))
    return p * tau * math.exp(-tau) if mu == 1 else p / (1 - mu) * (math.exp(-tau) - math.exp(-tau / mu))


def together(values, exact):
    """Mean over cases of estimate / truth, weighted by certainty, and its standard error: common noise included."""
    x = np.asarray(values, float) / np.asarray(exact)[:, None]
    weight = 1 / x.var(1)
    return estimate(weight @ x / weight.sum())


# ---- Order by order.


@pytest.mark.parametrize(("side", "mu"), [("R", 1.0), ("R", 0.5), ("R", 0.2), ("T", 1.0), ("T", 0.8)])
def test_orders_2_to_5_of_slabs(side, mu):
    gs, taus = [0.0, 0.85], [1.0, 4.0, 16.0]
    basis = Basis.precompute(
        SLAB, eye(mu, side), ZENITH, sigma_t=taus, g=gs, orders=5, samples=12000, denoise=False, rng=[3, int(10 * mu)]
    )
    assert basis.exponents.tolist() == [2, 3, 4, 5]
    column = 5 + MUS.index(mu) + 4 * (side == "T")
    values, exact = [], []
    for row in ORDERS[ORDERS[:, 2] >= 2]:
        g, tau, k = gs.index(row[0]), taus.index(row[1]), int(row[2])
        values.append(basis.multiple[k - 2, g, tau] / (4 * np.pi))
        exact.append(row[column])
    mean, error = estimate(values)
    z = (mean - exact) / error
    assert np.abs(z).max() < 4, z
    assert np.sqrt((z**2).mean()) < 1.7, z
    ratio, spread = together(values, exact)
    assert spread < 0.0012
    assert abs(ratio - 1) < 3 * spread, (ratio, spread)
    assert abs(ratio - 1) < 0.003


@pytest.mark.parametrize(
    ("g", "tau", "side", "mu"), [(0.0, 4.0, "R", 1.0), (0.85, 16.0, "R", 0.2), (0.85, 1.0, "T", 0.5)]
)
def test_orders_of_render_are_differences(g, tau, side, mu):
    p, camera = Params(g=g, sigma_t=tau, albedo=0.9), eye(mu, side)
    column = 5 + MUS.index(mu) + 4 * (side == "T")
    exact = {int(r[2]): r[column] for r in ORDERS if r[0] == g and r[1] == tau}
    before = 0.0
    for k in (2, 3, 4, 5):
        image = render(SLAB, p, camera, ZENITH, orders=k, samples=4000, rng=1, denoise=False)
        so_far = image.multiple[..., 0].ravel().astype(float) / (4 * np.pi)
        mean, error = estimate(so_far - before)
        # Paths of the same rng are the same up to order k - 1.
        assert mean > 0
        assert abs(mean - 0.9**k * exact[k]) < 3.5 * error, k
        before = so_far
    first = image.single[..., 0].mean() / (4 * np.pi)
    assert first == pytest.approx(0.9 * exact[1], rel=1e-3)
    assert once(g, tau, mu, side) == pytest.approx(exact[1], rel=1e-6)


def test_integral_one_is_radiance_without_further_ado():
    p, camera = Params(g=0.85, sigma_t=4.0), eye(0.5, "R", 2)
    a = render(SLAB, p, camera, ZENITH, orders=4, samples=64, rng=1, denoise=False)
    how = Conventions(phase="integral-one")
    b = render(SLAB, p, camera, ZENITH, orders=4, samples=64, rng=1, denoise=False, conventions=how)
    np.testing.assert_allclose(b.multiple * 4 * np.pi, a.multiple, rtol=1e-5)


# ---- All orders.

NODES_G, NODES_TAU = [0.0, 0.5, 0.85], [1.0, 4.0, 16.0, 64.0]


@cache
def slabs(side, mu):
    return Basis.precompute(
        SLAB,
        eye(mu, side),
        ZENITH,
        sigma_t=NODES_TAU,
        g=NODES_G,
        orders=None,
        samples=1000,
        denoise=False,
        rng=[7, int(10 * mu)],
    )


@pytest.mark.parametrize(("side", "mu"), [("R", 1.0), ("R", 0.2), ("T", 0.5)])
def test_all_orders_of_slabs_at_any_albedo(side, mu):
    basis, column = slabs(side, mu), 5 + MUS.index(mu) + 4 * (side == "T")
    values, exact, z = [], [], []
    for row in TABLE:
        g, tau, albedo = row[:3]
        white = TABLE[(TABLE[:, 0] == g) & (TABLE[:, 1] == tau) & (TABLE[:, 2] == 1), column][0]
        p = Params(g=g, sigma_t=tau, albedo=albedo)
        x = albedo * once(g, tau, mu, side) + basis.higher_orders(p).ravel().astype(float) / (4 * np.pi)
        mean, error = estimate(x)
        # Orders share powers of the albedo: an error of a few thousandths of the light at albedo 1.
        shared = 0.004 * white if albedo < 1 else 0
        assert abs(mean - row[column]) < 4 * error + shared, (g, tau, albedo)
        if row[column] > 0.1 * white:
            values.append(x)
            exact.append(row[column])
            z.append((mean - row[column]) / error)
    assert np.sqrt(np.square(z).mean()) < 1.7
    ratio, spread = together(values, exact)
    assert abs(ratio - 1) < 3 * spread + 0.0005
    assert abs(ratio - 1) < 0.004


@pytest.mark.parametrize(
    ("g", "tau", "albedo", "side", "mu", "samples"),
    [
        (0.0, 16.0, 0.9, "T", 0.5, 6000),
        (0.5, 4.0, 0.99, "R", 0.8, 4000),
        (0.85, 16.0, 1.0, "R", 0.5, 1500),
        (0.85, 64.0, 0.99, "R", 0.2, 1500),
    ],
)
def test_all_orders_of_a_slab_by_render(g, tau, albedo, side, mu, samples):
    row = next(r for r in TABLE if tuple(r[:3]) == (g, tau, albedo))
    p = Params(g=g, sigma_t=tau, albedo=albedo)
    image = render(SLAB, p, eye(mu, side), ZENITH, orders=None, samples=samples, rng=11, denoise=False)
    mean, error = estimate((image.single + image.multiple)[..., 0].ravel() / (4 * np.pi))
    exact = row[5 + MUS.index(mu) + 4 * (side == "T")]
    assert error < 0.09 * exact
    assert abs(mean - exact) < 3 * error


# ---- Chandrasekhar: isotropic, semi-infinite.


def h_function(mu, w):
    """Closed form of H, by Gauss-Legendre."""
    x, weight = np.polynomial.legendre.leggauss(400)
    t = (x + 1) * np.pi / 4
    f = np.log(1 - w * t / np.tan(t)) / (np.cos(t) ** 2 + mu**2 * np.sin(t) ** 2)
    return math.exp(-mu / np.pi * (weight @ f) * np.pi / 4)


DEEP = 300.0
BY_ORDER = {  # per albedo^k for k = 2 ... 6, mu0 = 1
    1.0: (0.027579450, 0.020775297, 0.016452884, 0.013481232, 0.011325077),
    0.5: (0.032957098, 0.022966716, 0.017156795, 0.013433387, 0.010881656),
}


def test_the_h_function_is_the_printed_one():
    assert h_function(1, 0.9) == pytest.approx(1.850098517, abs=1e-8)
    assert h_function(0.5, 0.5) == pytest.approx(1.187735133, abs=1e-8)


@pytest.mark.parametrize("mu", BY_ORDER)
def test_orders_of_a_half_space(mu):
    basis = Basis.precompute(
        SLAB, eye(mu, "R"), ZENITH, sigma_t=[DEEP], g=[0], orders=5, samples=8000, denoise=False, rng=5
    )
    assert basis.exponents.tolist() == [2, 3, 4, 5]
    pixels, exact = basis.multiple[:, 0, 0] / (4 * np.pi), BY_ORDER[mu]
    mean, error = estimate(pixels)
    assert (np.abs(mean - exact[:4]) < 3.5 * error).all()
    assert (error < 0.003 * mean).all()
    six = render(
        SLAB,
        Params(g=0.0, sigma_t=DEEP, albedo=1.0),
        eye(mu, "R"),
        ZENITH,
        orders=6,
        samples=4000,
        rng=5,
        denoise=False,
    )
    mean, error = estimate(six.multiple[..., 0].ravel() / (4 * np.pi))
    assert abs(mean - sum(exact)) < 3 * error
    assert error < 0.004 * mean


@pytest.mark.parametrize(("mu", "mu0", "w"), [(1.0, 1.0, 0.9), (0.5, 0.3, 0.9), (0.2, 0.8, 0.99), (0.8, 0.2, 0.99)])
def test_a_half_space_of_all_orders(mu, mu0, w):
    exact = w / (4 * np.pi) * mu0 / (mu + mu0) * h_function(mu, w) * h_function(mu0, w)
    sun = pa.Sun(math.degrees(math.asin(mu0)), 200)
    p = Params(g=0.0, sigma_t=DEEP, albedo=w)
    image = render(SLAB, p, eye(mu, "R"), sun, orders=None, samples=2000, rng=2, denoise=False)
    mean, error = estimate((image.single + image.multiple)[..., 0].ravel() / (4 * np.pi))
    assert error < 0.012 * exact
    assert abs(mean - exact) < 3 * error

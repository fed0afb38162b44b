"""How good are the tables of `make_sky_truth.py`? Prints; an hour and 12 GB on one core; needs the same packages.

How to run: ``python scripts/check_sky_truth.py``, made with sasktran2 2026.10.1. It prints the first order against an
adaptive quadrature that holds nothing of sasktran2, and the change of all orders when one setting at a time is refined.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from make_sky_truth import H_AEROSOL, H_AIR, RADIUS, SOURCES, TOP, both, cornette_shanks, inputs, levels, radiance
from numpy.polynomial.legendre import leggauss
from scipy.integrate import quad


def quadrature(elevation: float, w: float, zenith: float, azimuth: float) -> float:
    """Return the first order with aerosol [1/sr] by adaptive quadrature, nothing of sasktran2 in it."""
    k = {name: float(v[0]) for name, v in inputs(np.array([w])).items()}
    e, z, a = np.radians([elevation, zenith, azimuth])
    sun, view = np.array([np.cos(e), 0, np.sin(e)]), np.array([np.sin(z) * np.cos(a), np.sin(z) * np.sin(a), np.cos(z)])
    c = float(sun @ view)
    phase = np.array([0.75 * (1 + c * c), 0.8 * cornette_shanks(np.float64(c))]) / (4 * np.pi)
    x, weight = leggauss(64)

    def densities(p: np.ndarray) -> np.ndarray:
        h = np.linalg.norm(p, axis=-1) - RADIUS
        return np.exp(-h / H_AIR) * k["rayleigh"], np.exp(-h / H_AEROSOL) * k["aerosol"]

    def depth(p: np.ndarray, d: np.ndarray, length: float) -> float:
        middle = min(max(float(-p @ d), 0.0), length)  # the lowest point, where the levels are crowded
        total = 0.0
        for end in (0.0, length):
            u = (x + 1) / 2
            s = middle + (end - middle) * u**2
            total += abs(end - middle) * float((weight * u * sum(densities(p + s[:, None] * d))).sum())
        return total

    def to_top(p: np.ndarray, d: np.ndarray) -> float:
        b = float(p @ d)
        return -b + float(np.sqrt(b * b + (RADIUS + TOP) ** 2 - p @ p))

    def lit(s: float) -> bool:
        p = start + s * view
        b = float(p @ sun)
        return b >= 0 or p @ p - b * b > RADIUS**2

    def integrand(s: float) -> float:
        p = start + s * view
        if not lit(s):
            return 0.0
        t = depth(start, view, s) + depth(p, sun, to_top(p, sun))
        return float(phase @ np.array(densities(p))) * np.exp(-t)

    start = np.array([0, 0, RADIUS])
    end = to_top(start, view)
    grid = np.linspace(0, end, 2001)
    edges = [v for u, v in pairwise(grid) if lit(u) != lit(v)]
    cuts = sorted([0.0, *edges, end / 30, end / 8, end / 3, end])
    return sum(quad(integrand, u, v, epsrel=1e-7, limit=200)[0] for u, v in pairwise(cuts))


# Source heights [m], half as far apart in the aerosol.
MORE = 1e3 * np.array([0.01, 0.15, 0.3, 0.45, 0.6, 0.8, 1, 1.25, 1.5, 1.85, 2.2, 2.6, 3, 3.5, 4, 4.7, 5.5])
MORE = np.concatenate([MORE, SOURCES[SOURCES > 6000]])


def check(cases: tuple[tuple[int, int, int], ...]) -> None:
    """Print the change of the radiance when one setting at a time is refined, and the quadrature's answer."""
    for e, z, a in ((45, 60, 90), (15, 85, 22.5), (5, 80, 180), (0, 85, 0), (-4, 60, 0), (-6, 70, 0)):
        ours = quadrature(e, 450, z, a)
        theirs = radiance(
            e, np.array([450.0]), aerosol=True, orders=1, zenith=[z], azimuth=[a], height=levels(100)
        ).item()
        print(f"first order, sun {e}, view {z}/{a}: quadrature {ours:.6e}, sasktran2 {theirs / ours - 1:+.1e}")
    w, few = np.array([370.0, 450, 550, 650]), {"aerosol": True, "zenith": [0, 60, 80, 85], "azimuth": [0, 90, 180]}
    finer = {
        "levels 200 m": {"height": levels(200)},
        "and 33 source heights": {"height": levels(200), "successive_orders_altitude_grid_m": MORE},
        "incoming 770": {"num_successive_orders_incoming": 770},
        "outgoing 1454": {"num_successive_orders_outgoing": 1454},
        "moments 128": {"num_singlescatter_moments": 128},
        "tolerance 1e-8": {"successive_orders_relative_tolerance": 1e-8},
        "discrete ordinates, 24": {"solver": "do", "num_sza": 5},
        "discrete ordinates, 40": {"solver": "do", "num_sza": 5, "num_streams": 40},
    }
    for e, used, more in cases:
        base = both(e, w, **few, num_sza=3)[0]
        print(f"sun {e}, all orders: largest and rms change relative to the settings used")
        for name, how in finer.items():
            d = both(e, w, **few, **{"num_sza": 3, **how})[0] / base - 1
            print(f"  {name:24} {np.abs(d).max():.4f} {np.sqrt((d * d).mean()):.4f}", flush=True)
        higher = [radiance(e, w, **few, num_sza=3, height=h) for h in (levels(400, 100_000), levels(400))]
        d = higher[0] / higher[1] - 1
        print(f"  {'air to 100 km':24} {np.abs(d).max():.4f} {np.sqrt((d * d).mean()):.4f}", flush=True)
        d = [radiance(e, w, **few, num_sza=n, num_successive_orders_incoming=110) for n in (used, more)]
        d = d[0] / d[1] - 1
        print(f"  num_sza {used} against {more:6} {np.abs(d).max():.4f} {np.sqrt((d * d).mean()):.4f}", flush=True)


if __name__ == "__main__":
    check(((45, 3, 5), (5, 9, 15), (-4, 21, 41)))

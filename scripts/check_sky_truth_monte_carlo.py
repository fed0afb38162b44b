# ruff: noqa: NPY002 - inside numba there is only the old generator
"""A judge of the judge: the aerosol table of `make_sky_truth.py` by an independent backward Monte Carlo.

How to run (half an hour on one core; made with numba 0.68, numpy 2.4)::

    pip install numba
    python scripts/check_sky_truth_monte_carlo.py tests/oracles/data/sky_truth_monte_carlo.csv

Paths start at the viewer and fly by delta tracking through the exponential densities themselves, in spherical geometry,
without a grid; at each scattering, and at the ground, the sun is looked at through an optical depth by quadrature.
The columns: wavelength [nm], sun elevation, view zenith, azimuth [degree], then radiance per unit solar irradiance
[1/sr] of the first order and of all others, each with its standard error.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numba
import numpy as np
from make_sky_truth import H_AEROSOL, H_AIR, RADIUS, TOP, G, inputs

POINTS = (
    # wavelength, sun elevation, view zenith, azimuth, paths
    (450, 45, 60, 90, 4e6), (450, 45, 0, 0, 2e7), (450, 45, 80, 180, 1e7), (450, 15, 60, 180, 1e7),
    (370, 15, 85, 180, 6e6), (450, 90, 60, 0, 6e6), (550, 30, 85, 45, 6e6), (730, 70, 50, 90, 2e7),
    (450, 5, 0, 0, 2e7), (450, 5, 80, 90, 1e7), (450, 5, 80, 180, 6e6), (650, 2, 85, 0, 1e7),
    (450, 0, 0, 0, 1.5e7), (450, 0, 80, 180, 1e7), (450, 0, 80, 0, 1e7), (370, -2, 85, 90, 1.5e7),
    (550, -4, 0, 0, 3e7), (550, -4, 80, 180, 3e7), (450, -4, 0, 0, 3e7), (450, -4, 80, 0, 2e7),
    (450, -4, 80, 180, 2e7), (650, -4, 80, 0, 2e7), (450, -6, 0, 0, 6e7), (450, -6, 80, 180, 6e7),
    (450, -6, 60, 0, 4e7), (550, -6, 80, 0, 4e7),
)  # fmt: skip
X, W = np.polynomial.legendre.leggauss(24)
X, W = (X + 1) / 2, W / 2


@numba.njit(fastmath=True)
def depth_to_sun(h, mu, molecules, particles):
    """Return the optical depth from height `h` to the sun, or -1 behind the ground."""
    r = RADIUS + h
    if mu < 0 and r * np.sqrt(1 - mu * mu) < RADIUS:
        return -1.0
    length = -r * mu + np.sqrt((RADIUS + TOP - r) * (RADIUS + TOP + r) + r * r * mu * mu)
    low = max(-r * mu, 0.0)
    total = 0.0
    for side in range(2):
        span = low if side == 0 else length - low
        sign = -1.0 if side == 0 else 1.0
        for k in range(X.size):
            s = low + sign * span * X[k] ** 3
            q = h * (2 * RADIUS + h) + 2 * r * s * mu + s * s
            height = q / (np.sqrt(RADIUS * RADIUS + q) + RADIUS)
            rho = molecules * np.exp(-height / H_AIR) + particles * np.exp(-height / H_AEROSOL)
            total += W[k] * 3 * X[k] ** 2 * span * rho
    return total


@numba.njit(fastmath=True)
def phase(c):
    """Return both phase functions [1/sr]."""
    aerosol = 1.5 * (1 - G * G) / (2 + G * G) * (1 + c * c) / (1 + G * G - 2 * G * c) ** 1.5
    return 0.75 * (1 + c * c) / (4 * np.pi), aerosol / (4 * np.pi)


@numba.njit(fastmath=True)
def turned(d, c):
    """Return the direction `d` turned by the angle of cosine `c`, the rest of it random."""
    f, sn = 2 * np.pi * np.random.random(), np.sqrt(max(0.0, 1 - c * c))
    u = np.array([-d[1], d[0], 0.0]) if abs(d[2]) < 0.999 else np.array([d[2], 0.0, -d[0]])
    u /= np.sqrt((u * u).sum())
    v = np.array([d[1] * u[2] - d[2] * u[1], d[2] * u[0] - d[0] * u[2], d[0] * u[1] - d[1] * u[0]])
    return c * d + sn * (np.cos(f) * u + np.sin(f) * v)


@numba.njit(fastmath=True)
def flight(p, d, molecules, particles):
    """Move `p` along `d` to the next event: 1 scattering, 2 ground, 3 space."""
    most = molecules + particles
    while True:
        s = -np.log(1 - np.random.random()) / most
        r = np.sqrt((p * p).sum())
        b = (p * d).sum()
        disc = b * b - (r - RADIUS) * (r + RADIUS)
        if disc > 0 and b < 0 and 0 < -b - np.sqrt(disc) <= s:
            p += d * (-b - np.sqrt(disc))
            return 2
        p += d * s
        h = np.sqrt((p * p).sum()) - RADIUS
        if h > TOP:
            return 3
        rho = molecules * np.exp(-h / H_AIR) + particles * np.exp(-h / H_AEROSOL)
        if np.random.random() * most < rho:
            return 1


@numba.njit(fastmath=True)
def walk(count, molecules, particles, albedo, sun, view, seed):
    """Return sum and sum of squares of the first order and of the rest."""
    np.random.seed(seed)
    total = np.zeros(4)
    for _ in range(count):
        p, d = np.array([0.0, 0.0, RADIUS + 0.01]), view.copy()
        weight, order, first, rest = 1.0, 0, 0.0, 0.0
        while weight > 1e-4 and order < 60:
            event = flight(p, d, molecules, particles)
            if event == 3:
                break
            order += 1
            r = np.sqrt((p * p).sum())
            mu = (p * sun).sum() / r
            if event == 2:
                if mu > 0:
                    rest += weight * albedo * mu / np.pi * np.exp(-depth_to_sun(0.0, mu, molecules, particles))
                weight *= albedo
                n = p / r
                d = turned(n, np.sqrt(np.random.random()))
                p += n * 1e-3
                continue
            h = r - RADIUS
            rayleigh, aerosol = molecules * np.exp(-h / H_AIR), 0.8 * particles * np.exp(-h / H_AEROSOL)
            weight *= (rayleigh + aerosol) / (rayleigh + aerosol / 0.8)
            t = depth_to_sun(h, mu, molecules, particles)
            if t >= 0:
                f = phase((d * sun).sum())
                value = weight * (rayleigh * f[0] + aerosol * f[1]) / (rayleigh + aerosol) * np.exp(-t)
                if order == 1:
                    first += value
                else:
                    rest += value
            from_air = np.random.random() * (rayleigh + aerosol) < rayleigh
            while True:
                c = 2 * np.random.random() - 1
                if not from_air:  # Henyey-Greenstein, which (1 + c^2) / 2 turns into Cornette-Shanks
                    k = (1 - G * G) / (1 + G * c)
                    c = (1 + G * G - k * k) / (2 * G)
                if np.random.random() * 2 <= 1 + c * c:
                    break
            d = turned(d, c)
        total += np.array([first, first * first, rest, rest * rest])
    return total


def radiance(w: float, elevation: float, zenith: float, azimuth: float, count: int, seed: int = 1) -> np.ndarray:
    """Return the first order, its standard error, the rest, its standard error [1/sr]."""
    k = {name: float(v[0]) for name, v in inputs(np.array([float(w)])).items()}
    e, z, a = np.radians([elevation, zenith, azimuth])
    sun = np.array([np.cos(e), 0.0, np.sin(e)])
    view = np.array([np.sin(z) * np.cos(a), np.sin(z) * np.sin(a), np.cos(z)])
    m = walk(count, k["rayleigh"], k["aerosol"], k["grass"], sun, view, seed) / count
    return np.array([m[0], np.sqrt((m[1] - m[0] ** 2) / count), m[2], np.sqrt((m[3] - m[2] ** 2) / count)])


def main() -> None:
    """Write the points."""
    rows = [np.r_[p[:4], radiance(*p[:4], int(p[4]))] for p in POINTS]
    head = "wavelength,sun,zenith,azimuth,first,first_error,rest,rest_error"
    np.savetxt(Path(sys.argv[1]), rows, fmt="%.7g", delimiter=",", header=head, comments="")


if __name__ == "__main__":
    main()

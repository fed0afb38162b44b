"""Sky radiance of three clear atmospheres by sasktran2, the outside judge of `pleinair.sky` by day and in twilight.

How to run (25 minutes and 8 GB on one core; made with sasktran2 2026.10.1, numpy 2.4, scipy 1.17, Python 3.11)::

    pip install sasktran2 scipy
    python scripts/make_sky_truth.py tests/oracles/data/sky_truth.npz
    python scripts/check_sky_truth.py                 # convergence, an independent quadrature and Monte Carlo

The atmosphere is that of Bruneton's comparison of clear-sky models: a ground sphere of 6360 km, air to 60 km (no
light is scattered above), no refraction, no polarisation, a point sun. Rayleigh: Penndorf 1957 at 15 C, scale height
8 km, phase 3/4 (1 + c^2). Aerosol: optical depth .04 (lambda / um)^-.8, scale height 1.2 km, single scattering albedo
.8, Cornette-Shanks g .7. Ozone: 300 DU as a triangle over 10, 25, 40 km, cross sections at 233 K (Bremen, as binned by
Bruneton: sasktran2 would have to fetch its own). Ground: Lambertian, .3, or grass (Feister and Grewe 1995).

==========  ==================================  =========  ===================================
table       atmosphere                          ground     sun elevation [degree]
==========  ==================================  =========  ===================================
rayleigh    Rayleigh                            .3         45 15 5
aerosol     Rayleigh, aerosol                   grass      90 70 45 30 15 5 2 0 -2 -4 -6
ozone       Rayleigh, ozone                     .3         15 0 -4 -6
==========  ==================================  =========  ===================================

For each table T the file holds ``T_elevation`` (n,) [degree] and ``T_all``, ``T_single`` (n, 24, 10, 9) [1/sr],
radiance per unit solar irradiance in all orders and in the first alone, over ``wavelength`` (24,) [nm], the middles of
bins of 20 nm, ``view_zenith`` (10,) and ``azimuth`` (9,) from the sun's [degree], seen from 0 m; and the inputs:
``solar`` [W/m^2/nm] (ASTM G173 outside the atmosphere, mean of each bin), ``rayleigh`` and ``aerosol`` [1/m at 0 m],
``ozone`` [m^2], ``grass`` [1]. ``about`` is JSON: the text above and the errors below. Luminance of a direction:
``683 * 20 * (T_all * (solar * ybar)[:, None, None]).sum(-3)``.

Method. Single scattering: exact, 100 m levels. The rest: successive orders less its own single scattering, 400 m
levels. Two traps of this version, both seen against an independent Monte Carlo:
successive orders are wrong on levels that are not evenly spaced (100 m below 6 km, 400 m above: the orders beyond
the first 5 % low at 5 degrees, 4 to 8 times too bright at -4), and `num_sza` 1, the default, is wrong in twilight.
Measured errors of ``T_all`` (`check_sky_truth.py`, `check_sky_truth_monte_carlo.py`), largest / rms over zenith 0 to
85, azimuth 0 to 180, 370 to 650 nm, when one setting is refined, for the sun at 45, 5 and -4:
levels 200 m .0033/.0008 .0049/.0012 .0066/.0020; 200 m and 33 to 125 source heights (30, 5) .0012/.0005 .0025/.0007;
incoming 770 .0004/.0001 .0006/.0002 .0034/.0017; outgoing 1454 .0018/.0005 .0043/.0009 .0049/.0014; moments 128 and
tolerance 1e-8 0; `num_sza` more 0 .0004/.0001 .015/.005 (all of it at 80 and 85 away from the sun). `T_single`
against adaptive quadrature: 6e-4 at worst (85/0, sun 2), else 2.4e-4 and less. Against Monte Carlo, ``T_all``: 11
points with the sun at 5 or above, rms .0023, worst -.0067 (85/45, sun 30); 15 points at 2 to -6, rms .0055, worst
.015, of which the noise of Monte Carlo is .0035 and .007.
The top is part of the definition: air to 100 km instead of 60 adds to the zenith 2.5 % (sun -4) and 34 % (sun -6) of
``T_single``, 0.2 % at most to ``T_all`` at 5. Discrete ordinates, which do not know that diffuse light sees a curved
earth, are 1.6 % (sun 45), 2.3 % (5) and 56 % (-4) off.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import sasktran2 as sk
from numpy.polynomial.legendre import leggauss, legvander

RADIUS, TOP, H_AIR, H_AEROSOL, G = 6_360_000.0, 60_000.0, 8000.0, 1200.0, 0.7
WAVELENGTH = 370.0 + 20.0 * np.arange(24)
ZENITH = np.array([0.0, 10, 20, 30, 40, 50, 60, 70, 80, 85])
AZIMUTH = np.linspace(0.0, 180.0, 9)
TABLES = {
    "rayleigh": (False, False, (45, 15, 5)),
    "aerosol": (True, False, (90, 70, 45, 30, 15, 5, 2, 0, -2, -4, -6)),
    "ozone": (False, True, (15, 0, -4, -6)),
}
# Every 10 nm from 360: Penndorf 1957, table III, at 0 C [1e-6/m].
PENNDORF = """70.45 62.82 56.20 50.43 45.40 40.98 37.08 33.65 30.60 27.89 25.48 23.33 21.40 19.66 18.10 16.69 15.42
14.26 13.21 12.26 11.39 10.60 9.876 9.212 8.604 8.045 7.531 7.057 6.620 6.217 5.844 5.498 5.178 4.881 4.605 4.348 4.109
3.886 3.678 3.484 3.302 3.132 2.973 2.824 2.684 2.583 2.481 2.380"""
# Every 10 nm from 360 to 800: albedo of grass, Feister and Grewe 1995.
GRASS = """.018 .019 .019 .020 .022 .024 .027 .029 .030 .031 .032 .032 .032 .033 .035 .040 .055 .073 .084 .089 .089 .079
.069 .063 .061 .057 .052 .051 .048 .042 .039 .035 .035 .043 .087 .156 .234 .334 .437 .513 .553 .571 .579 .581 .587"""
# Means of 360 to 370 nm and on: ASTM G173 outside the atmosphere [W/m^2/nm]; ozone at 233 K [1e-27 m^2].
SOLAR = """1.11776 1.14259 1.01249 1.14716 1.72765 1.73054 1.6887 1.61253 1.91198 2.03474 2.02042 2.02212 1.93377 1.95809
1.91686 1.8298 1.8685 1.8931 1.85149 1.8504 1.8341 1.8345 1.8147 1.78158 1.7533 1.6965 1.68194 1.64654 1.6048 1.52143
1.55622 1.5113 1.474 1.4482 1.41018 1.36775 1.34188 1.31429 1.28303 1.26758 1.2367 1.2082 1.18737 1.14683 1.12362 1.1058
1.07124 1.04992"""
OZONE = """1.18 .2182 .2818 .6636 1.527 2.763 5.52 8.451 15.82 23.16 36.69 49.24 77.52 90.16 148 160.2 213.9 275.5 309.1
350 426.6 467.2 439.8 470.1 501.9 430.5 374 321.5 266.2 223.8 185.2 147.3 120.9 94.23 74.55 65.66 51.05 41.5 42.28 32.37
24.51 28.01 25.34 16.24 14.65 20.78 13.83 7.105"""


def _numbers(text: str) -> np.ndarray:
    return np.array(text.split(), dtype=float)


def _tens(text: str, w: np.ndarray) -> np.ndarray:
    values = _numbers(text)
    return np.interp(w, 360 + 10 * np.arange(values.size), values)


SOLAR_BIN = _numbers(SOLAR).reshape(24, 2).mean(1)
OZONE_BIN = 1e-27 * _numbers(OZONE).reshape(24, 2).mean(1)


def inputs(w: np.ndarray) -> dict[str, np.ndarray]:
    """Return the coefficients at wavelengths `w` [nm]."""
    return {
        "rayleigh": _tens(PENNDORF, w) * 1e-6 * 273.16 / 288.16,
        "aerosol": 0.04 * (w / 1000) ** -0.8 / H_AEROSOL,
        "ozone": np.interp(w, WAVELENGTH, OZONE_BIN),
        "grass": _tens(GRASS, w),
    }


def ozone_density(h: np.ndarray) -> np.ndarray:
    """Return the ozone number density [1/m^3] at height `h` [m]: 300 DU over 10 to 40 km."""
    return 300 * 2.687e20 / 15_000 * np.clip(1 - np.abs(h - 25_000) / 15_000, 0, 1)


def cornette_shanks(c: np.ndarray) -> np.ndarray:
    """Return the aerosol's phase function [1], mean 1 over the sphere, for the cosine `c` of the scattering angle."""
    return 1.5 * (1 - G * G) / (2 + G * G) * (1 + c * c) / (1 + G * G - 2 * G * c) ** 1.5


def moments(count: int) -> np.ndarray:
    """Return its first Legendre moments, (2l + 1)/2 times the integral of phase and P_l; 64 leave 2e-8."""
    x, weight = leggauss(1024)
    return (legvander(x, count - 1).T @ (weight * cornette_shanks(x))) * (np.arange(count) + 0.5)


def levels(step: float, top: float = TOP) -> np.ndarray:
    """Return evenly spaced heights [m]."""
    return np.linspace(0, top, round(top / step) + 1)


# The heights [m] of the sources of successive orders: inside the air, dense where it is.
SOURCES = 1e3 * np.array([0.01, 0.3, 0.6, 1, 1.5, 2.2, 3, 4, 5.5, 7, 9, 11, 13.5, 16, 19, 22, 25, 28, 32, 36, 40, 45])
SOURCES = np.concatenate([SOURCES, [50e3, 55e3, 59.9e3]])


def radiance(
    elevation: float,
    w: np.ndarray,
    *,
    aerosol: bool = False,
    ozone: bool = False,
    orders: int | None = None,
    zenith: Sequence[float] | np.ndarray = ZENITH,
    azimuth: Sequence[float] | np.ndarray = AZIMUTH,
    height: np.ndarray | None = None,
    solver: str = "so",
    **options: object,
) -> np.ndarray:
    """Return radiance per unit solar irradiance [1/sr], (wavelength, zenith, azimuth).

    Parameters
    ----------
    elevation : float
        Sun [degree].
    w : (n,) ndarray
        Wavelength [nm].
    aerosol, ozone : bool
        What the air holds beside Rayleigh's molecules; the ground is grass with aerosol, else .3.
    orders : {None, 1}
        All, or the first alone.
    zenith, azimuth : sequence of float
        View [degree].
    height : ndarray, optional
        Evenly spaced levels [m].
    solver : {"so", "do"}
        Successive orders, or discrete ordinates.
    **options
        Attributes of `sasktran2.Config`.
    """
    height = levels(400) if height is None else height
    config = sk.Config()
    config.num_streams, config.num_singlescatter_moments = 24, 64
    config.single_scatter_source = sk.SingleScatterSource.Exact
    if orders is None and solver == "so":
        config.multiple_scatter_source = sk.MultipleScatterSource.SuccessiveOrders
        config.successive_orders_altitude_grid_m = SOURCES
        config.num_successive_orders_incoming, config.num_successive_orders_outgoing = 302, 770
        config.num_sza = 3 if elevation > 10 else 9 if elevation > 3 else 15 if elevation > -1 else 21
    elif orders is None:
        config.multiple_scatter_source = sk.MultipleScatterSource.DiscreteOrdinates
    for name, value in options.items():
        setattr(config, name, value)
    mu = float(np.sin(np.radians(elevation)))
    geometry = sk.Geometry1D(
        mu, 0.0, RADIUS, height, sk.InterpolationMethod.LinearInterpolation, sk.GeometryType.Spherical
    )
    rays = sk.ViewingGeometry()
    for z in np.radians(zenith):
        for a in np.radians(azimuth):
            rays.add_ray(sk.SolarAnglesObserverLocation(mu, float(a), float(np.cos(z)), 0.0))
    air = sk.Atmosphere(geometry, config, numwavel=len(w), calculate_derivatives=False)
    k, half = inputs(w), (height[1] - height[0]) / 2
    # Linear between the levels: scaled so that the column is that of the exponential.
    even = [np.exp(-height / s) * np.tanh(half / s) / (half / s) for s in (H_AIR, H_AEROSOL)]
    molecules = even[0][:, None] * k["rayleigh"]
    particles = even[1][:, None] * k["aerosol"] * aerosol
    extinction = molecules + particles + ozone * ozone_density(height)[:, None] * k["ozone"]
    scattering = molecules + 0.8 * particles
    air.storage.total_extinction[:] = extinction
    air.storage.ssa[:] = scattering / extinction
    share = molecules / scattering
    phase = moments(config.num_singlescatter_moments)[:, None, None] * (1 - share)
    phase[0] += share
    phase[2] += share / 2
    air.leg_coeff.a1[:] = phase
    air.surface.albedo[:] = k["grass"] if aerosol else 0.3
    result = sk.Engine(config, geometry, rays).calculate_radiance(air)["radiance"].to_numpy()[..., 0]
    return result.reshape(len(w), len(zenith), len(azimuth))


def both(elevation: float, w: np.ndarray, **options: object) -> tuple[np.ndarray, np.ndarray]:
    """Return radiance in all orders and in the first [1/sr]; the first by finer levels."""
    first = radiance(elevation, w, orders=1, **{**options, "height": levels(100)})
    rest = radiance(elevation, w, **options) - radiance(elevation, w, orders=1, **options)
    return first + rest, first


def main() -> None:
    """Write the tables."""
    parser = argparse.ArgumentParser(description="make the tables of sky radiance")
    parser.add_argument("out", type=Path)
    args = parser.parse_args()
    arrays = {"wavelength": WAVELENGTH, "view_zenith": ZENITH, "azimuth": AZIMUTH, "solar": SOLAR_BIN}
    arrays |= inputs(WAVELENGTH)
    for name, (aerosol, ozone, elevations) in TABLES.items():
        pairs = []
        for e in elevations:
            start = time.perf_counter()
            pairs.append(both(e, WAVELENGTH, aerosol=aerosol, ozone=ozone))
            print(name, e, f"{time.perf_counter() - start:.0f} s", file=sys.stderr, flush=True)
        arrays |= {f"{name}_elevation": np.array(elevations, float)}
        arrays |= {f"{name}_all": np.array([p[0] for p in pairs]), f"{name}_single": np.array([p[1] for p in pairs])}
    about = json.dumps({"made_with": "sasktran2 2026.10.1", "text": __doc__})
    np.savez_compressed(args.out, about=np.array(about), **{k: v.astype(np.float32) for k, v in arrays.items()})
    print(args.out, args.out.stat().st_size, "bytes", file=sys.stderr)


if __name__ == "__main__":
    main()

"""Sizes of drops and what they scatter: Marshall-Palmer, lognormal, Mie and Airy theory. Public as `pleinair.weather`."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import weather_drop_speed, weather_phase, weather_table
from .._support.inputs import array, real

# Angles of a table of fog, of rain with its narrow bows.
_FOG, _RAIN = 361, 3601
# Radii of a distribution that are summed: small drops of each have ripples that only many wash out.
_SIZES, _SMALL = 24, 96

Sizes = tuple[tuple[float, ...], tuple[float, ...]]


def bow_phase(
    angles: ArrayLike,
    wavelengths: ArrayLike,
    radius: float,
    *,
    spread: float = 0.0,
    disc: float = 0.0,
) -> NDArray[np.float64]:
    """Return the phase function of water drops: rainbow and fogbow.

    Parameters
    ----------
    angles : array_like (n,)
        Scattering angles, in [0, 180], equally spaced where `disc` is given [°]; 180 is the antisolar point.
    wavelengths : array_like (m,)
        In [360, 780] [nm].
    radius : float
        Median radius of the drops, in [1, 3000] [µm].
    spread : float
        Standard deviation of the logarithm of the radius, in [0, 1] [1]; 0 for drops of one size.
    disc : float
        Radius of the lamp's disc that smears it, in [0, 5] [°]: 0.2665 of the Sun.

    Returns
    -------
    ndarray (n, m) of float64
        Integrates to 1 over the sphere [1/sr]; of drops of more than 60 µm to one half, as their diffraction is left out.

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Notes
    -----
    Mie theory up to 60 µm, Airy theory over geometric optics above: angles within .1°, heights within 10 % from 50 µm.

    Examples
    --------
    >>> angles = np.arange(136, 142, 0.05)
    >>> peak = angles[bow_phase(angles, [640.0], 500.0, disc=0.2665).argmax()]
    >>> bool(abs(peak - 138.03) < 0.1)
    True
    """
    at, waves = (
        array(v, n, dtypes=(np.float64,), ndim=1) for v, n in ((angles, "angles"), (wavelengths, "wavelengths"))
    )
    for name, value, low, high, unit in (("angles", at, 0, 180, "°"), ("wavelengths", waves, 360, 780, "nm")):
        if not ((value >= low) & (value <= high)).all():
            msg = f"{name} must be in [{low}, {high}] [{unit}], got {value[~((value >= low) & (value <= high))][0]:g}"
            raise ValueError(msg)
    radii, weights = lognormal(real(radius, "radius", 1, 3000, "µm"), real(spread, "spread", 0, 1))
    disc = real(disc, "disc", 0, 5, "°")
    if disc and len(at) > 2 and not np.allclose(np.diff(at), at[1] - at[0], rtol=1e-6, atol=0):
        msg = "angles must be equally spaced where disc is given"
        raise ValueError(msg)
    found: NDArray[np.float64] = weather_phase(at.tolist(), radii, weights, waves.tolist(), disc)
    return found.reshape(len(at), len(waves))


def lognormal(radius: float, spread: float) -> Sizes:
    """Return radii [µm] and their numbers about a median."""
    if spread == 0:
        return (radius,), (1.0,)
    x = np.linspace(-2.5, 2.5, _SMALL if radius < 100 else _SIZES)
    # Of the numbers; the large ones that scatter most are within.
    return tuple((radius * np.exp(spread * (x + spread))).tolist()), tuple(np.exp(-0.5 * (x + spread) ** 2).tolist())


def marshall_palmer(rate: float) -> Sizes:
    """Return radii [µm] and their numbers in rain of a rate [mm/h]."""
    mean = 1 / (4.1 * rate**-0.21)
    d = np.geomspace(0.1, 8.0 * mean + 0.5, _SIZES)
    return tuple((500 * d).tolist()), tuple((np.exp(-d / mean) * d).tolist())


def fall_sizes(rate: float, *, flakes: bool = False) -> tuple[float, float, float]:
    """Return how many drops or flakes are in the air, their mean diameter, and the extinction of light by them.

    Parameters
    ----------
    rate : float
        Of rain, or of the water of snow, in [0.01, 300] [mm/h].
    flakes : bool
        Snow of a tenth of water's density.

    Returns
    -------
    tuple of float
        Number [1/m³], mean diameter [m], extinction of twice their sections [1/m].

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Notes
    -----
    Marshall and Palmer 1948: 8000 exp(-4.1 R^-0.21 D) of drops [1/m³/mm]; Gunn and Marshall 1958, melted:
    3800 R^-0.87 exp(-2.55 R^-0.48 D).

    Examples
    --------
    >>> number, diameter, extinction = fall_sizes(10.0)
    >>> round(number), round(1e3 * diameter, 2)
    (3165, 0.4)
    """
    rate = real(rate, "rate", 0.01, 300, "mm/h")
    most, slope = (3800 * rate**-0.87, 2.55 * rate**-0.48) if flakes else (8000.0, 4.1 * rate**-0.21)
    wide = 10 ** (1 / 3) if flakes else 1.0
    # Twice the mean section: pi/4 times the second moment, 2 / slope^3.
    return most / slope, wide * 1e-3 / slope, math.pi * most * wide**2 / slope**3 * 1e-6


def drop_speed(diameter: float) -> float:
    """Return the terminal speed of a raindrop.

    Parameters
    ----------
    diameter : float
        In [0.1, 6] [mm].

    Returns
    -------
    float
        Within 0.3 m/s of Gunn and Kinzer 1949 from 0.6 mm (Atlas et al. 1973) [m/s].

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Examples
    --------
    >>> round(drop_speed(2.0), 1)
    6.5
    """
    found: float = weather_drop_speed(real(diameter, "diameter", 0.1, 6, "mm"))
    return found


@functools.lru_cache(maxsize=64)
def phase_table(sizes: Sizes, color: tuple[float, float, float], disc: float, large: bool) -> Any:
    """Return a phase function in RGB from 0 to 180°, for a lamp's colour and disc [°]; of large drops without diffraction."""
    found: NDArray[np.float32] = weather_table(_RAIN if large else _FOG, *sizes, color, disc)
    # Large drops' half is diffracted, and stays in the beam.
    found = found * np.float32(2 if large else 1)
    found.flags.writeable = False
    return found

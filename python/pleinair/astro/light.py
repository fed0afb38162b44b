"""Magnitudes, colours and the light of the sky's sources: equations 10 to 12 and table 1 of realistic_sky.

Equation 11 and table 1 are printed with errors of decades; what is right, and why, stands at each function.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import (
    astro_irradiance,
    astro_magnitude,
    astro_milky_way,
    astro_star_colors,
    astro_temperature,
    astro_zodiacal,
)
from .._support.inputs import array, choice, shape_text, units


def magnitude_to_irradiance(magnitude: ArrayLike) -> NDArray[np.float64]:
    """Return the irradiance of apparent magnitudes: equation 11 of realistic_sky, corrected.

    It is printed as ``10 ** (-m - 19)``; it must be the inverse of equation 10, ``10 ** ((-m - 19) / 2.5)``.

    Parameters
    ----------
    magnitude : array_like, any shape
        Apparent magnitudes [mag].

    Returns
    -------
    ndarray of float64
        Of the same shape [W/m²]. The Sun's -26.74 gives 1247, 8 % below the solar constant.

    Raises
    ------
    TypeError
        `magnitude` does not hold real numbers.

    Examples
    --------
    >>> float(magnitude_to_irradiance(-26.74).round())
    1247.0
    """
    source = array(magnitude, "magnitude", dtypes=(np.float64,))
    out = np.empty_like(source)
    astro_irradiance(source, out)
    return out


def irradiance_to_magnitude(irradiance: ArrayLike) -> NDArray[np.float64]:
    """Return the apparent magnitude of irradiance: equation 10 of realistic_sky.

    Parameters
    ----------
    irradiance : array_like, any shape
        Not negative [W/m²].

    Returns
    -------
    ndarray of float64
        Of the same shape; inf where there is no light [mag].

    Raises
    ------
    ValueError, TypeError
        `irradiance` does not hold real numbers of at least 0.

    Examples
    --------
    >>> irradiance_to_magnitude([1e-10, 0]).tolist()
    [6.0, inf]
    """
    source = array(irradiance, "irradiance", dtypes=(np.float64,))
    if not (source >= 0).all():
        msg = f"irradiance must be in [0, inf] [W/m²], got {source[~(source >= 0)].flat[0]:g}"
        raise ValueError(msg)
    out = np.empty_like(source)
    astro_magnitude(source, out)
    return out


def color_temperature(b_v: ArrayLike, model: str = "ballesteros") -> NDArray[np.float64]:
    """Return the temperature of stars of a colour index.

    Parameters
    ----------
    b_v : array_like, any shape
        Colour indices B-V, in [-0.4, 6] [mag].
    model : {"ballesteros", "wang"}
        Ballesteros 2012, or equation 12 of realistic_sky: good near the Sun's 0.65, 26 900 K where a B star has 16 600 K.

    Returns
    -------
    ndarray of float64
        Of the same shape [K].

    Raises
    ------
    ValueError, TypeError
        `b_v` does not hold numbers in its range.

    Examples
    --------
    >>> color_temperature([-0.3, 0.65]).round(-1).tolist()
    [16600.0, 5780.0]
    """
    source = array(b_v, "b_v", dtypes=(np.float64,))
    choice(model, "model", ("ballesteros", "wang"))
    out = np.empty_like(source)
    astro_temperature(source, out, model == "wang")
    return out


def star_colors(temperature: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the linear Rec. 709 colours of luminance 1 of black bodies [1], shape (n, 3), of their temperatures [K]."""
    out = np.empty((*temperature.shape, 3))
    astro_star_colors(temperature, out)
    return out


def milky_way(directions: ArrayLike) -> NDArray[np.float64]:
    """Return the luminance of the starlight that is not among the stars of V ≤ 6.5: above all of the Milky Way.

    Its shape is that of A. Mellinger's photographic panorama without its single stars, blurred to 0.6°, with Andromeda and the
    Clouds of Magellan. Its levels are chosen so that fields of 10° have, with the stars of V ≤ 6.5, what is commonly quoted to 30 %
    (400 S10 at the galactic centre, 500 in Sagittarius, 32 at the poles), and are within 25 % of that. 1 S10, a star of V 10 in
    each square degree, is 8.4e-7 cd/m².

    Parameters
    ----------
    directions : array_like, shape (..., 3)
        Vectors of any length but zero: x to the equinox, z to the north pole of J2000 (ICRS) [1].

    Returns
    -------
    ndarray of float64, shape (...)
        Outside the air, diffuse galactic light included [cd/m²].

    Raises
    ------
    ValueError, TypeError
        `directions` does not hold finite vectors, or a zero one.

    Examples
    --------
    >>> centre, pole = (-0.05488, -0.87344, -0.48384), (-0.86767, -0.19808, 0.45598)
    >>> (milky_way([centre, pole]) / 8.4e-7).round().tolist()
    [307.0, 20.0]
    """
    to = units(directions, "directions")
    out = np.empty(to.shape[:-1])
    astro_milky_way(to, out)
    return out


def zodiacal_light(longitude: ArrayLike, latitude: ArrayLike) -> NDArray[np.float64]:
    """Return the luminance of the zodiacal light: sunlight scattered by dust between the planets.

    Leinert et al. 1998, table 17, interpolated; within 15° of the Sun, where the table ends, it goes on as elongation to the
    power -2.25 and is levelled within 1°.

    Parameters
    ----------
    longitude : array_like
        Ecliptic longitude from the Sun's, any finite angle [°].
    latitude : array_like
        Ecliptic latitude, in [-90, 90] [°]; broadcast with `longitude`.

    Returns
    -------
    ndarray of float64
        Of the common shape, outside the air [cd/m²].

    Raises
    ------
    ValueError, TypeError
        An angle is not a number in its range; the shapes do not broadcast.

    Examples
    --------
    >>> zodiacal_light([60, 90, 180], 0).round(6).tolist()
    [0.000347, 0.000178, 0.000158]
    """
    along, across = (array(v, n, dtypes=(np.float64,)) for v, n in ((longitude, "longitude"), (latitude, "latitude")))
    if not np.isfinite(along).all():
        msg = "longitude must be finite [°]"
        raise ValueError(msg)
    wrong = ~(np.abs(across) <= 90)
    if wrong.any():
        msg = f"latitude must be in [-90, 90] [°], got {across[wrong].flat[0]:g}"
        raise ValueError(msg)
    try:
        along, across = np.broadcast_arrays(along, across)
    except ValueError:
        shapes = " and ".join(shape_text(a.shape) for a in (along, across))
        msg = f"longitude and latitude must have shapes that broadcast, got {shapes}"
        raise ValueError(msg) from None
    out = np.empty(along.shape)
    # A whole turn is taken off before it costs digits.
    turned = np.radians(np.remainder(along, 360))
    astro_zodiacal(np.ascontiguousarray(turned), np.ascontiguousarray(np.radians(across)), out)
    return out


@dataclass(frozen=True)
class LightSource:
    """A row of table 1 of realistic_sky beside what is measured.

    Attributes
    ----------
    name : str
        What shines.
    printed : float
        Irradiance that the paper prints [W/m²].
    measured : float
        Irradiance by measurements; of a sky the horizontal irradiance of its hemisphere [W/m²].
    source : str
        Where the measured value comes from.
    """

    name: str
    printed: float
    measured: float
    source: str


_S10 = "a tenth magnitude star per square degree (S10), by equation 11"
_LIGHT_SOURCES = (
    LightSource("Sun", 1.3e3, 1361.0, "total solar irradiance, Kopp and Lean 2011"),
    LightSource("full Moon", 1.3e-3, 3.1e-3, "magnitude -12.73 (Allen) by equation 11"),
    LightSource("bright planet", 2.0e-6, 2.3e-6, "Venus at her brightest, magnitude -4.9, by equation 11"),
    LightSource("zodiacal light", 1.2e-7, 3.7e-6, "Leinert et al. 1998, table 17, over a hemisphere: 3.0e-6 to 4.4e-6"),
    LightSource("starlight", 3.0e-8, 2.6e-6, f"about 100 times {_S10}; Leinert et al. 1998; to a factor of 2"),
    LightSource("airglow", 5.1e-8, 3.8e-6, f"145 times {_S10}: the zenith at solar minimum; to a factor of 2"),
    LightSource(
        "diffuse galactic light", 9.1e-9, 6e-7, "a quarter of the starlight; Leinert et al. 1998; to a factor of 2"
    ),
    LightSource("cosmic light", 9.1e-10, 7.5e-8, "24 nW/(m² sr), Driver et al. 2016; printed as light of comets"),
)


def light_sources() -> tuple[LightSource, ...]:
    """Return table 1 of realistic_sky, the light of the sky's sources, beside measured values.

    Every diffuse row is printed 30 to 100 times too dark.

    Returns
    -------
    tuple of LightSource
        In the order of the paper.

    Examples
    --------
    >>> [s.name for s in light_sources()][:3]
    ['Sun', 'full Moon', 'bright planet']
    """
    return _LIGHT_SOURCES

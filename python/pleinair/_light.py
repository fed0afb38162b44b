"""Magnitudes, colour temperatures and the light of the sky's sources: equations 10 to 12 and table 1 of realistic_sky.

Equation 11 and table 1 are printed with errors of decades; what is right, and why, stands at each function.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._inputs import array, choice


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
    _core.astro_irradiance(source, out)
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
    _core.astro_magnitude(source, out)
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
    _core.astro_temperature(source, out, model == "wang")
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

"""What an instrument reads in one direction of a sky: luminance, chromaticity, colour temperature. Public as `pleinair.sky`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .._support.inputs import Array
from ..color import rgb_to_xyz


@dataclass(frozen=True)
class Probe:
    """What a sky is in one direction.

    Attributes
    ----------
    rgb : tuple of float
        Radiance, linear Rec. 709 [cd/m² of each channel, or relative].
    luminance : float
        [cd/m², or relative].
    xy : tuple of float
        Chromaticity, CIE 1931; NaN for black [1].
    cct : float
        Correlated colour temperature by Hernández-Andrés et al. 1999, which was made for skies; NaN beyond 3000 to
        800 000 K [K].
    magnitude : float
        Surface brightness, visual; NaN for relative skies and for black [mag/arcsec²].
    """

    rgb: tuple[float, float, float]
    luminance: float
    xy: tuple[float, float]
    cct: float
    magnitude: float


def colour_temperature(x: float, y: float) -> float:
    """Return the correlated colour temperature of a chromaticity (Hernández-Andrés, Lee and Romero 1999)."""
    n = (x - 0.3366) / (y - 0.1735) if y != 0.1735 else math.inf
    try:
        low = -949.86315 + 6253.80338 * math.exp(-n / 0.92159) + 28.70599 * math.exp(-n / 0.20039)
        low += 0.00004 * math.exp(-n / 0.07125)
        n = (x - 0.3356) / (y - 0.1691) if y != 0.1691 else math.inf
        high = 36284.48953 + 0.00228 * math.exp(-n / 0.07861) + 5.4535e-36 * math.exp(-n / 0.01543)
    except OverflowError:
        return math.nan
    kelvin = high if low > 50_000 else low
    return kelvin if 3000 <= kelvin <= 800_000 else math.nan


def probe_of(rgb: Array, absolute: bool) -> Probe:
    """Return a probe of one radiance."""
    x, y, z = (float(v) for v in rgb_to_xyz(np.asarray(rgb, np.float64)))
    total = x + y + z
    xy = (x / total, y / total) if total > 0 else (math.nan, math.nan)
    cct = colour_temperature(*xy) if total > 0 else math.nan
    # 0 mag/arcsec² is 1.08e5 cd/m² (Garstang 1986; Crumey 2014).
    magnitude = -2.5 * math.log10(y / 1.08e5) if absolute and y > 0 else math.nan
    r, g, b = (float(v) for v in rgb)
    return Probe((r, g, b), y, xy, cct, magnitude)

"""Snow that falls and snow that lies. Public as `pleinair.weather`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import weather_sky_view, weather_snow_cover
from .._support.inputs import array, check, integer, real
from .drops import Sizes, fall_sizes
from .rain import wind_of


@dataclass(frozen=True)
class Snow:
    """Falling flakes, and snow that lies where a surface is level enough and sees the sky.

    Parameters
    ----------
    rate : float
        Water of what falls, in [0, 30] [mm/h]: 1 is moderate; at 0 it has stopped.
    lying : float
        How much lies, in [0, 1] [1]: 0 nothing, 1 a deep cover.
    wind : tuple of float
        East and north, each in [-50, 50] [m/s].
    exposure : float
        Of streaks, in [1e-5, 1] [s].
    reflectance : float
        Of lying snow, in [0.3, 0.98] [1]; 0.9 when fresh.
    seed : int
        Of flakes, in [0, 2^53] [1].

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Examples
    --------
    >>> Snow(rate=0, lying=0.6).extinction
    0.0
    """

    rate: float = 0.7
    lying: float = 1.0
    wind: tuple[float, float] = (0.6, 0.3)
    exposure: float = 1 / 250
    reflectance: float = 0.88
    seed: int = 0

    def __post_init__(self) -> None:
        check(
            self,
            {
                "rate": (0, 30, "mm/h"),
                "lying": (0, 1, "1"),
                "exposure": (1e-5, 1, "s"),
                "reflectance": (0.3, 0.98, "1"),
            },
        )
        object.__setattr__(self, "wind", wind_of(self.wind))
        integer(self.seed, "seed", 0, 1 << 53)

    @property
    def extinction(self) -> float:
        """Of its flakes [1/m]."""
        return fall_sizes(max(self.rate, 0.01), flakes=True)[2] if self.rate else 0.0

    def _veil(self) -> tuple[str, list[float], int, float]:
        return "layer", [1000.0, 400.0], 0, self.extinction

    def _sizes(self) -> Sizes | None:
        return None

    def _above(self, z: float) -> float:
        del z
        # Light comes from a cloud's depth above: none straight from a lamp.
        return 10.0 if self.rate else 0.0

    def _fall(self) -> tuple[bool, float, float, float, float]:
        """Whether flakes, number [1/m³], least diameter and mean above it [m], how far they are drawn [m]."""
        number, mean, _ = fall_sizes(max(self.rate, 0.01), flakes=True)
        least = 1.5e-3
        return True, number * float(np.exp(-least / mean)) if self.rate else 0.0, least, mean, 9.0


def sky_view(heights: ArrayLike, spacing: float) -> NDArray[np.float64]:
    """Return the share of the sky that each place of a height field sees, weighed as a level surface does.

    Parameters
    ----------
    heights : array_like (ny, nx)
        Rows from south to north [m].
    spacing : float
        Between neighbours, in [1e-3, 1e5] [m].

    Returns
    -------
    ndarray (ny, nx) of float64
        In [0, 1]; at the bottom of a valley of two planes of slope a it is cos a [1].

    Raises
    ------
    ValueError, TypeError
        A height is not finite, or a value out of range.

    Examples
    --------
    >>> sky_view(np.zeros((3, 4)), 1.0).min()
    np.float64(1.0)
    """
    field = array(heights, "heights", dtypes=(np.float64,), ndim=2)
    if field.size == 0 or not np.isfinite(field).all():
        msg = "heights must be finite and of at least one place [m]"
        raise ValueError(msg)
    found: NDArray[np.float64] = weather_sky_view(field, field.shape[1], real(spacing, "spacing", 1e-3, 1e5, "m"))
    return found.reshape(field.shape)


def snow_cover(up: float, sky_view: float, amount: float = 1.0) -> float:
    """Return the share of a surface on which snow lies.

    Parameters
    ----------
    up : float
        Vertical part of its normal, in [-1, 1] [1].
    sky_view : float
        Share of the sky that snow falls from, in [0, 1] [1].
    amount : float
        `Snow.lying`, in [0, 1] [1].

    Returns
    -------
    float
        In [0, 1]; nothing on slopes over 60°, all on those under 30° that see half the sky [1].

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Examples
    --------
    >>> snow_cover(0.0, 1.0), snow_cover(1.0, 0.0), snow_cover(1.0, 1.0)
    (0.0, 0.0, 1.0)
    """
    found: float = weather_snow_cover(
        real(up, "up", -1, 1), real(sky_view, "sky_view", 0, 1), real(amount, "amount", 0, 1)
    )
    return found

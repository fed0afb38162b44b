"""Where the Sun is."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ._inputs import real

__all__ = ["Sun"]


@dataclass(frozen=True)
class Sun:
    """The Sun at a position of the sky.

    Parameters
    ----------
    elevation : float
        Above the horizon, in [-90, 90] [°].
    azimuth : float
        Clockwise from north, any finite angle [°].

    Raises
    ------
    ValueError, TypeError
        An angle is not a number in its range.

    Examples
    --------
    >>> Sun(elevation=35, azimuth=200)
    Sun(elevation=35.0, azimuth=200.0)
    """

    elevation: float
    azimuth: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "elevation", real(self.elevation, "elevation", -90, 90, "°"))
        object.__setattr__(self, "azimuth", real(self.azimuth, "azimuth", -math.inf, math.inf, "°"))

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector from the viewer to the Sun: x east, y north, z up [1].

        Examples
        --------
        >>> [round(x, 6) for x in Sun(elevation=0, azimuth=90).direction]
        [1.0, 0.0, 0.0]
        """
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        flat = math.cos(elevation)
        return math.sin(azimuth) * flat, math.cos(azimuth) * flat, math.sin(elevation)

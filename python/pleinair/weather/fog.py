"""Fog and haze that thin out with height. Public as `pleinair.weather`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import weather_depth
from .._support.inputs import array, check
from .drops import lognormal


@dataclass(frozen=True)
class Fog:
    """A layer of droplets, with its fogbow opposite the Sun.

    Parameters
    ----------
    visibility : float
        Meteorological range in it, in [1, 1e6] [m]: under 1000 it is fog, above mist and haze.
    top : float
        Height up to which it is even, in [-500, 10000] [m].
    thins : float
        Scale height above `top`, in [1, 10000] [m].
    radius : float
        Median radius of its droplets, in [1, 50] [µm].
    spread : float
        Standard deviation of the logarithm of the radius, in [0, 1] [1].

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Examples
    --------
    >>> fog = Fog(visibility=400, top=10, thins=30)
    >>> float(fog.optical_depth((0, 0, 2), [[0, 1, 0]], [400.0])[0].round(3))
    3.912
    """

    visibility: float = 500.0
    top: float = 5.0
    thins: float = 40.0
    radius: float = 8.0
    spread: float = 0.35

    def __post_init__(self) -> None:
        check(
            self,
            {
                "visibility": (1, 1e6, "m"),
                "top": (-500, 1e4, "m"),
                "thins": (1, 1e4, "m"),
                "radius": (1, 50, "µm"),
                "spread": (0, 1, "1"),
            },
        )

    @property
    def extinction(self) -> float:
        """Where it is densest: Koschmieder's, of a fiftieth of the contrast [1/m]."""
        return math.log(50) / self.visibility

    def optical_depth(self, eye: ArrayLike, directions: ArrayLike, distances: ArrayLike) -> NDArray[np.float64]:
        """Return optical depths from an eye.

        Parameters
        ----------
        eye : array_like (3,)
            [m].
        directions : array_like (n, 3)
            Unit vectors [1].
        distances : array_like (n,)
            May be infinite [m].

        Returns
        -------
        ndarray (n,) of float64
            [1].

        Raises
        ------
        ValueError, TypeError
            Shapes do not fit.

        Examples
        --------
        See `Fog`.
        """
        at = array(eye, "eye", dtypes=(np.float64,), ndim=1, last=3)
        to = array(directions, "directions", dtypes=(np.float64,), ndim=2, last=3)
        far = array(distances, "distances", dtypes=(np.float64,), ndim=1)
        if len(far) != len(to):
            msg = f"distances must have shape ({len(to)},), got ({len(far)},)"
            raise ValueError(msg)
        found: NDArray[np.float64] = weather_depth(
            "layer", [self.top, self.thins], 0, self.extinction, at.tolist(), to.tolist(), far.tolist()
        )
        return found

    def _sizes(self) -> Any:
        return lognormal(self.radius, self.spread)

    def _veil(self) -> tuple[str, list[float], int, float]:
        return "layer", [self.top, self.thins], 0, self.extinction

    def _above(self, z: float) -> float:
        """Optical depth straight up from a height [1]."""
        return self.extinction * (max(self.top - z, 0.0) + self.thins * math.exp(-max(z - self.top, 0.0) / self.thins))

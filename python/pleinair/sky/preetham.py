"""Preetham's analytic sky (Preetham, Shirley and Smits 1999). Public as `pleinair.sky`."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

from .._core import SkyModel
from .._support.inputs import DomainWarning, real
from ..astro import Sun
from .base import Sky, beta_of, check_above_horizon
from .cie_general import _TURBIDITY
from .physical import Air


@lru_cache(maxsize=64)
def _preetham(sun: Sun, turbidity: float) -> Any:
    return SkyModel.preetham(sun.direction, turbidity, Air(beta_of(turbidity)), sun.distance**-2)


@dataclass(frozen=True)
class Preetham(Sky):
    """The clear day sky of Preetham, Shirley and Smits 1999, in cd/m².

    Parameters
    ----------
    sun : Sun
        Not below the horizon; from 5° up the formula is what its authors made it for.
    turbidity : float
        How much aerosol, in [1, 20] [1]. It is held in [1.8, 10], with a warning: below, luminance is negative in
        places.

    Raises
    ------
    ValueError, TypeError
        A value is out of range, or the Sun is below the horizon.

    Warns
    -----
    DomainWarning
        The turbidity is outside [2, 6] or the Sun is below 5°.

    Notes
    -----
    Equations 7 and 8 of realistic_sky, with coefficients of its own for each of Y, x and y. It is 2 to 3 times as bright as
    the sky that it is a fit of (docs/papers/realistic_sky.md): for luminance that can be trusted use `Physical`. Below the
    horizon the sky has the light of the horizon.

    Examples
    --------
    >>> sky = Preetham(sun=Sun(60, 0), turbidity=2.53)
    >>> round(sky.probe((0, 0, 1)).luminance)
    8329
    """

    sun: Sun
    turbidity: float = 2.5

    absolute: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_above_horizon(self.sun)
        object.__setattr__(self, "turbidity", real(self.turbidity, "turbidity", 1, 20))
        low, high = _TURBIDITY
        if not low <= self.turbidity <= high:
            msg = f"turbidity {self.turbidity} is taken as {min(max(self.turbidity, low), high)}: Preetham's sky fails beyond"
            warnings.warn(msg, DomainWarning, stacklevel=3)
        elif not 2 <= self.turbidity <= 6:
            msg = f"turbidity {self.turbidity} is outside [2, 6], where Preetham's sky is plausible (Zotti et al. 2007)"
            warnings.warn(msg, DomainWarning, stacklevel=3)
        if self.sun.elevation < 5:
            msg = f"with the Sun at {self.sun.elevation}° Preetham's sky does not darken; Natural hands over to a twilight"
            warnings.warn(msg, DomainWarning, stacklevel=3)

    def _core(self, tolerance: float) -> Any:
        del tolerance
        low, high = _TURBIDITY
        return _preetham(self.sun, min(max(self.turbidity, low), high))

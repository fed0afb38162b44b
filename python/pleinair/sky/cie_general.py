"""The fifteen standard general skies of the CIE (ISO 15469). Public as `pleinair.sky`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

from .._core import PREETHAM_TURBIDITY, SkyModel
from .._support.inputs import integer, real, several
from ..astro import Sun
from .base import Sky, check_above_horizon

# Turbidities at which Preetham's formula has no negative luminance and no absurd zenith (src/sky/preetham.rs).
_TURBIDITY = PREETHAM_TURBIDITY


@lru_cache(maxsize=64)
def _cie(kind: int, sun: Sun, zenith: float, xy: tuple[float, float], turbidity: float | None, beam: float) -> Any:
    return SkyModel.cie_general(kind, sun.direction, zenith, xy, turbidity, beam)


@dataclass(frozen=True)
class CieGeneral(Sky):
    """One of the fifteen standard general skies of the CIE, in cd/m².

    Parameters
    ----------
    kind : int
        Type, in [1, 15] [1]: 1 overcast with a bright zenith, 5 uniform, 12 clear, 13 clear and polluted, 15 white-blue
        with a broad glow around the Sun.
    sun : Sun
        Not below the horizon.
    zenith_luminance : float
        In [0, 1e9] [cd/m²].
    chromaticity : tuple of float
        x and y of the whole sky, each in (0, 1) [1]; D65 by default. The standard has no colours.
    turbidity : float, optional
        Colours by Preetham's chromaticity for this turbidity instead, in [1.8, 10] [1]: what realistic_sky does.
    sun_illuminance : float
        Of the Sun's disc on a plane that faces it, in [0, 2e5]; the standard has none [lx].

    Raises
    ------
    ValueError, TypeError
        A value is out of range, or the Sun is below the horizon.

    Notes
    -----
    CIE S 011/E:2003, ISO 15469:2004; equations 6 and 7 of realistic_sky with the sun's zenith angle where it is due. At and
    below the horizon the sky has the luminance of the horizon.

    Examples
    --------
    >>> sky = CieGeneral(kind=12, sun=Sun(60, 0), zenith_luminance=4000.0)
    >>> round(sky.probe((0, -1, 1)).luminance)
    1818
    """

    kind: int
    sun: Sun
    zenith_luminance: float = 4000.0
    chromaticity: tuple[float, float] = (0.3127, 0.3290)
    turbidity: float | None = None
    sun_illuminance: float = 0.0

    absolute: ClassVar[bool] = True

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "kind", integer(self.kind, "kind", 1, 15))
        check_above_horizon(self.sun)
        put(self, "zenith_luminance", real(self.zenith_luminance, "zenith_luminance", 0, 1e9, "cd/m²"))
        xy = several(self.chromaticity, "chromaticity")
        if len(xy) != 2:
            msg = f"chromaticity must be x and y, got {self.chromaticity!r}"
            raise ValueError(msg)
        put(self, "chromaticity", tuple(real(v, "chromaticity", 1e-3, 1) for v in xy))
        if self.turbidity is not None:
            put(self, "turbidity", real(self.turbidity, "turbidity", *_TURBIDITY))
        put(self, "sun_illuminance", real(self.sun_illuminance, "sun_illuminance", 0, 2e5, "lx"))

    def _core(self, tolerance: float) -> Any:
        del tolerance
        fields = (self.kind, self.sun, self.zenith_luminance, self.chromaticity, self.turbidity, self.sun_illuminance)
        return _cie(*fields)

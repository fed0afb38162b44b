"""A clear sky in cd/m² by day and in twilight. Public as `pleinair.sky`.

Single and multiple scattering in a spherical atmosphere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

from .._core import SkyAtmosphere, SkyModel
from .._support.inputs import instance, real
from ..astro import Sun
from .base import SUN_RADIUS, Sky, beta_of


@dataclass(frozen=True)
class Air:
    """What the core reads of the air; the defaults are those of `Physical`."""

    beta: float
    pressure: float = 1013.25
    scale_height: float = 7200.0
    alpha: float = 1.3
    aerosol_scale_height: float = 1200.0
    aerosol_albedo: float = 0.85
    g: float = 0.7
    ozone: float = 300.0
    ground_albedo: float = 0.1


@lru_cache(maxsize=8)
def atmosphere(air: Air) -> SkyAtmosphere:
    """Follow all orders of scattering in an atmosphere; every sun uses them."""
    return SkyAtmosphere(air)


@lru_cache(maxsize=16)
def _built(air: Air, sun: Sun, altitude: float, disc: float, tolerance: float) -> Any:
    return SkyModel.physical(atmosphere(air), sun.direction, sun.distance**-2, altitude, disc, tolerance)


_RANGES = {
    "turbidity": (1, 12, "1"),
    "ozone": (0, 2000, "DU"),
    "ground_albedo": (0, 1, "1"),
    "altitude": (0, 15_000, "m"),
    "pressure": (0, 2000, "hPa"),
    "scale_height": (4000, 15_000, "m"),
    "alpha": (-1, 4, "1"),
    "aerosol_scale_height": (600, 10_000, "m"),
    "aerosol_albedo": (0, 1, "1"),
    "g": (-0.98, 0.98, "1"),
    "disc": (0, 30, "°"),
}


@dataclass(frozen=True)
class Physical(Sky):
    """A clear sky in cd/m²: molecules, aerosol, ozone, the ground, and light of every order of scattering.

    The atmosphere is spherical and spectral (16 bands). It is followed once, in about a second, for all positions of the
    Sun; a sky of another Sun then costs a table of 30 to 300 ms, a pixel some 15 ns.

    Parameters
    ----------
    sun : Sun
        Without refraction: at an elevation of 0 its middle is on the horizon. Its light goes with its distance.
    turbidity : float
        How much aerosol, in [1, 12] [1]: Ångström's β = 0.04608 turbidity − 0.04586 (Iqbal 1983, in Preetham et al.
        1999); 2 is very clear, 2.5 clear, 6 hazy.
    ozone : float
        Column, in [0, 2000] [DU].
    ground_albedo : float
        Of a Lambertian ground, in [0, 1] [1].
    altitude : float
        Of the observer above the ground, in [0, 15 000] [m].
    beta : float, optional
        Optical depth of the aerosol at 1 µm instead of a turbidity, in [0, 2] [1].
    alpha : float
        Ångström's exponent, in [-1, 4] [1].
    aerosol_albedo : float
        Single-scattering albedo of the aerosol, in [0, 1] [1].
    g : float
        Asymmetry of its Cornette-Shanks phase function, in [-0.98, 0.98] [1].
    aerosol_scale_height : float
        In [600, 10 000] [m].
    pressure : float
        On the ground, by which the number of molecules above it is known, in [0, 2000] [hPa].
    scale_height : float
        Of the molecules, in [4000, 15 000] [m]. The true one is 8.4 km near the ground and 6.5 km where twilight is made.
    disc : float
        Angular radius of the Sun's disc, with limb darkening; 0 for none, 0.2665 for the true one [°].

    Raises
    ------
    ValueError, TypeError
        A value is out of range or of the wrong kind.

    Notes
    -----
    Below the horizon is the ground, lit by the Sun and the sky, behind the air. Colours outside Rec. 709 have negative
    channels; nothing is clipped. Single scattering by quadrature, the other orders by moments with the aerosol's forward
    peak taken out (Nakajima and Tanaka 1988); within 5 % of a Monte Carlo from 45° to −6°.

    Examples
    --------
    >>> sky = Physical(sun=Sun(elevation=45, azimuth=180))
    >>> bool(1500 < sky.probe((0, 0, 1)).luminance < 4000)
    True
    """

    sun: Sun
    turbidity: float = 2.5
    ozone: float = Air.ozone
    ground_albedo: float = Air.ground_albedo
    altitude: float = 0.0
    beta: float | None = None
    alpha: float = Air.alpha
    aerosol_albedo: float = Air.aerosol_albedo
    g: float = Air.g
    aerosol_scale_height: float = Air.aerosol_scale_height
    pressure: float = Air.pressure
    scale_height: float = Air.scale_height
    disc: float = 0.0

    absolute: ClassVar[bool] = True

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.sun, "sun", Sun)
        for name, (low, high, unit) in _RANGES.items():
            put(self, name, real(getattr(self, name), name, low, high, unit))
        if self.beta is not None:
            put(self, "beta", real(self.beta, "beta", 0, 2))

    def _core(self, tolerance: float) -> Any:
        air = Air(
            beta_of(self.turbidity) if self.beta is None else self.beta,
            *(self.pressure, self.scale_height, self.alpha, self.aerosol_scale_height),
            *(self.aerosol_albedo, self.g, self.ozone, self.ground_albedo),
        )
        return _built(air, self.sun, self.altitude, math.radians(self.disc), tolerance)

    def without_disc(self) -> Physical:
        """Return the sky without the disc of the Sun.

        Returns
        -------
        Physical
            With `disc=0`.

        Examples
        --------
        >>> Physical(sun=Sun(30), disc=0.27).without_disc().disc
        0.0
        """
        return replace(self, disc=0.0) if self.disc else self

    def _disc_radius(self) -> float:
        return self.disc or SUN_RADIUS

"""A clear sky in cd/m² by day and in twilight. Public as `pleinair.sky`.

Single and multiple scattering in a spherical atmosphere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import SkyAtmosphere, SkyModel
from .._support.docs import documented
from .._support.inputs import Progress, array, instance, integer, real, reporter, units
from ..astro import Sun
from .base import SUN_RADIUS, Sky, beta_of
from .cloud_slab import CloudSlab


@dataclass(frozen=True)
class Air:
    """What the core reads of the air; the defaults are those of `Physical`."""

    beta: float
    pressure: float = 1013.25
    scale_height: float | None = None
    top: float = 100_000.0
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
def _built(air: Air, sun: Sun, altitude: float, disc: float, overcast: CloudSlab | None, tolerance: float) -> Any:
    return SkyModel.physical(atmosphere(air), sun.direction, sun.distance**-2, altitude, disc, overcast, tolerance)


_RANGES = {
    "turbidity": (1, 12, "1"),
    "ozone": (0, 2000, "DU"),
    "ground_albedo": (0, 1, "1"),
    "altitude": (0, 15_000, "m"),
    "pressure": (0, 2000, "hPa"),
    "top": (50_000, 120_000, "m"),
    "alpha": (-1, 4, "1"),
    "aerosol_scale_height": (600, 10_000, "m"),
    "aerosol_albedo": (0, 1, "1"),
    "g": (-0.98, 0.98, "1"),
    "disc": (0, 30, "°"),
}


class ScatteringSky(Sky):
    """What skies of scattered light have in common.

    Examples
    --------
    >>> isinstance(Physical(sun=Sun(45, 180)), ScatteringSky)
    True
    """

    absolute: ClassVar[bool] = True
    _noisy_reference: ClassVar[bool] = True

    @documented
    def monte_carlo(
        self, directions: ArrayLike, paths: int = 4096, *, key: int = 0, progress: Progress = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return radiance by a backward Monte Carlo, an independent solution, and its standard error.

        The first order of scattering is a quadrature, all others paths from the viewer through the spherical air; without
        the disc. The reference method of `radiance` is this with 1024 paths, of which each costs some 0.1 ms.

        Parameters
        ----------
        directions : array_like (..., 3)
            Vectors away from the viewer, of any length but zero.
        paths : int
            For each direction, in [16, 100 000 000]: the error goes with the root of their inverse.
        key : int
            Other keys give other paths, in [0, 2⁶³ − 1].
        {progress}

        Returns
        -------
        tuple of ndarray (..., 3) of float64
            Linear Rec. 709 and the standard error of each channel [cd/m²].

        Raises
        ------
        ValueError, TypeError
            A direction is zero or not finite, or an argument is out of range.

        Examples
        --------
        >>> sky = Physical(sun=Sun(elevation=45, azimuth=180), turbidity=2.5)
        >>> value, error = sky.monte_carlo((0, 0, 1), 64)
        >>> bool((error < 0.1 * value).all())
        True
        """
        to = units(array(directions, "directions", dtypes=(np.float64,), last=3), "directions")
        paths = integer(paths, "paths", 16, 100_000_000)
        key = integer(key, "key", 0, (1 << 63) - 1)
        out = np.empty((to.size // 3, 6))
        if to.size:
            tick, close = reporter(progress, "sky")
            try:
                self._core(1e-3).monte_carlo(np.ascontiguousarray(to), paths, key, out, tick)
            finally:
                close()
        return out[:, :3].reshape(to.shape), out[:, 3:].reshape(to.shape)


@dataclass(frozen=True)
class Physical(ScatteringSky):
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
    scale_height : float, optional
        Of molecules that fall off exponentially, in [4000, 15 000] [m]; by default they follow the U.S. Standard Atmosphere
        1976, whose scale height is 6.4 to 8.4 km.
    top : float
        Where the air ends, in [50 000, 120 000] [m].
    disc : float
        Angular radius of the Sun's disc, with limb darkening; 0 for none, 0.2665 for the true one [°].
    overcast : CloudSlab, optional
        An endless cloud over the observer; the disc is not drawn behind it.

    Raises
    ------
    ValueError, TypeError
        A value is out of range or of the wrong kind.

    Notes
    -----
    Below the horizon is the ground, lit by the Sun and the sky, behind the air. Colours outside Rec. 709 have negative
    channels; nothing is clipped. Single scattering by quadrature, the other orders by 45 moments of the light; the
    reference is an independent Monte Carlo, see docs/papers/realistic_sky.md for what lies between them.

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
    scale_height: float | None = None
    top: float = Air.top
    disc: float = 0.0
    overcast: CloudSlab | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.sun, "sun", Sun)
        for name, (low, high, unit) in _RANGES.items():
            put(self, name, real(getattr(self, name), name, low, high, unit))
        if self.beta is not None:
            put(self, "beta", real(self.beta, "beta", 0, 2))
        if self.scale_height is not None:
            put(self, "scale_height", real(self.scale_height, "scale_height", 4000, 15_000, "m"))
        if self.overcast is not None:
            instance(self.overcast, "overcast", CloudSlab)._over(self.altitude)

    def _core(self, tolerance: float) -> Any:
        air = Air(
            beta_of(self.turbidity) if self.beta is None else self.beta,
            *(self.pressure, self.scale_height, self.top, self.alpha, self.aerosol_scale_height),
            *(self.aerosol_albedo, self.g, self.ozone, self.ground_albedo),
        )
        return _built(air, self.sun, self.altitude, math.radians(self.disc), self.overcast, tolerance)

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

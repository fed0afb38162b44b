"""Rain, showers and rainbows. Public as `pleinair.weather`."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._support.inputs import check, flag, integer, real
from .drops import Sizes, fall_sizes, lognormal, marshall_palmer

# Of water.
_INDEX = 1.333


@dataclass(frozen=True)
class Rain:
    """Rain all around, or a shower in the distance: a curtain under its cloud, with its rainbow; streaks near the eye.

    Parameters
    ----------
    rate : float
        In [0.01, 300] [mm/h]: 1 is light, 10 heavy, 50 a cloudburst.
    distance : float
        Where it begins, in [0, 1e5] [m]; at 0 it falls around the eye.
    depth : float
        How far it reaches beyond, in [1, 1e5] [m].
    azimuth : float
        Of its middle, clockwise from north, in [-720, 720] [°].
    width : float
        Of the horizon, in [1, 360] [°].
    base : float
        Height of the cloud's base, in [10, 10000] [m].
    lit : float
        Share of it that the lamps reach past its own cloud, in [0, 1] [1]. Clouds of the scene shade it beside that.
    gloom : float
        Share of the light from all around that its own cloud takes, in [0, 1] [1].
    wind : tuple of float
        East and north, each in [-50, 50] [m/s].
    exposure : float
        Of streaks, in [1e-5, 1] [s].
    wet : bool
        Whether it darkens grounds, rocks and trunks, where it falls around the eye.
    seed : int
        Of drops and shafts, in [0, 2^53] [1].

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Notes
    -----
    Sizes of drops by Marshall and Palmer 1948, speeds by Gunn and Kinzer 1949, contrast of streaks by Garg and Nayar 2007,
    wet grounds by Lekner and Dorf 1988. Drops are spheres: real ones above 1 mm are flattened and their bows fainter.

    Examples
    --------
    >>> Rain(rate=8, distance=2000, azimuth=90, width=60).wet
    True
    """

    rate: float = 5.0
    distance: float = 0.0
    depth: float = 3000.0
    azimuth: float = 0.0
    width: float = 360.0
    base: float = 1200.0
    lit: float = 1.0
    gloom: float = 0.5
    wind: tuple[float, float] = (1.5, 0.5)
    exposure: float = 1 / 250
    wet: bool = True
    seed: int = 0

    def __post_init__(self) -> None:
        check(
            self,
            {
                "rate": (0.01, 300, "mm/h"),
                "distance": (0, 1e5, "m"),
                "depth": (1, 1e5, "m"),
                "azimuth": (-720, 720, "°"),
                "width": (1, 360, "°"),
                "base": (10, 1e4, "m"),
                "lit": (0, 1, "1"),
                "gloom": (0, 1, "1"),
                "exposure": (1e-5, 1, "s"),
            },
        )
        object.__setattr__(self, "wind", wind_of(self.wind))
        flag(self.wet, "wet")
        integer(self.seed, "seed", 0, 1 << 53)

    @property
    def extinction(self) -> float:
        """Of the sections of its drops; what they diffract stays in the beam [1/m]."""
        return 0.5 * fall_sizes(self.rate)[2]

    def _sizes(self) -> Sizes:
        return marshall_palmer(self.rate)

    def _veil(self) -> tuple[str, list[float], int, float]:
        lean = float(np.hypot(*self.wind)) / 6.0
        patchy = 0.0 if self.width >= 360 else 0.7
        far = self.distance + self.depth
        return (
            "curtain",
            [self.distance, far, self.base, self.azimuth, self.width / 2, lean, patchy],
            self.seed,
            self.extinction,
        )

    def _fall(self) -> tuple[bool, float, float, float, float]:
        """Whether flakes, number [1/m³], least diameter and mean above it [m], how far they are drawn [m]."""
        number, mean, _ = fall_sizes(self.rate)
        # Finer ones are no streaks but a veil.
        least = 1e-3
        return False, number * float(np.exp(-least / mean)), least, mean, 5.0


@dataclass(frozen=True)
class Rainbow:
    """A shower opposite the Sun or Moon that is all bow: drops of one kind, thin, lit by the lamp.

    Parameters
    ----------
    radius : float
        Median radius of its drops, in [1, 3000] [µm]: 500 for bright colours, 200 for supernumeraries, 10 for a fogbow.
    spread : float
        Standard deviation of the logarithm of the radius, in [0, 1] [1].
    optical_depth : float
        Through it at the horizon, in [0, 50] [1].
    distance, depth : float
        Where it begins, and how far it reaches beyond, in [0, 1e5] and [1, 1e5] [m].
    base : float
        Height of the cloud's base, in [10, 100000] [m]: where the bow ends.
    lit : float
        Share of it that the lamp reaches past clouds, in [0, 1] [1].

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Examples
    --------
    >>> Rainbow(radius=300).lit
    1.0
    """

    radius: float = 400.0
    spread: float = 0.3
    optical_depth: float = 0.8
    distance: float = 500.0
    depth: float = 2000.0
    base: float = 20000.0
    lit: float = 1.0

    def __post_init__(self) -> None:
        check(
            self,
            {
                "radius": (1, 3000, "µm"),
                "spread": (0, 1, "1"),
                "optical_depth": (0, 50, "1"),
                "distance": (0, 1e5, "m"),
                "depth": (1, 1e5, "m"),
                "base": (10, 1e5, "m"),
                "lit": (0, 1, "1"),
            },
        )

    @property
    def extinction(self) -> float:
        """Of its drops [1/m]."""
        return self.optical_depth / self.depth

    def _sizes(self) -> Sizes:
        return lognormal(self.radius, self.spread)

    def _veil(self) -> tuple[str, list[float], int, float]:
        far = self.distance + self.depth
        return "curtain", [self.distance, far, self.base, 0.0, 180.0, 0.0, 0.0], 0, self.extinction


def wind_of(value: Any) -> tuple[float, float]:
    """Return a wind of two parts [m/s]."""
    try:
        east, north = value
    except (TypeError, ValueError):
        msg = f"wind must be two numbers, each in [-50, 50] [m/s], got {value!r}"
        raise TypeError(msg) from None
    return real(east, "wind", -50, 50, "m/s"), real(north, "wind", -50, 50, "m/s")


@functools.lru_cache(maxsize=1)
def _reflected() -> tuple[float, float]:
    """Share of diffuse light that water reflects from outside, and from within [1]."""
    u = (np.arange(20000) + 0.5) / 20000
    c = np.sqrt(1 - u)
    t = np.sqrt(1 - u / _INDEX**2)
    r = 0.5 * (((c - _INDEX * t) / (c + _INDEX * t)) ** 2 + ((_INDEX * c - t) / (_INDEX * c + t)) ** 2)
    outside = float(r.mean())
    return outside, 1 - (1 - outside) / _INDEX**2


def wet_reflectance(dry: float) -> float:
    """Return the reflectance of a rough ground that a film of water covers.

    Parameters
    ----------
    dry : float
        Its reflectance when dry, in [0, 1] [1].

    Returns
    -------
    float
        Without the film's own gloss [1].

    Raises
    ------
    ValueError, TypeError
        It is out of range.

    Notes
    -----
    Lekner and Dorf 1988, after Ångström 1925: light that the ground scatters is partly thrown back by the film, by total
    reflection, until it is absorbed: (1 - r) (1 - p) d / (1 - p d) with r = 0.066 from outside and p = 0.47 from within. The
    step of index between film and ground, which they add, is left out: for dark grounds it darkens more.

    Examples
    --------
    >>> round(wet_reflectance(0.3), 2)
    0.17
    """
    dry = real(dry, "dry", 0, 1)
    outside, within = _reflected()
    return (1 - outside) * (1 - within) * dry / (1 - within * dry)

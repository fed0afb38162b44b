"""The planets that the eye sees: where they stand and how bright they are. Public as `pleinair.astro`.

Mercury, Venus, Mars, Jupiter and Saturn by VSOP87, magnitudes by their phase.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime

from .._core import astro_planets
from .._support.inputs import flag
from .bodies import _AU, Place, _coordinates, _InTheSky, _refractivity, _round, _up
from .time import seconds_of


@dataclass(frozen=True)
class Planet(_InTheSky):
    """A planet at a position of the sky.

    Attributes
    ----------
    name : str
        "Mercury", "Venus", "Mars", "Jupiter" or "Saturn".
    elevation : float
        Above the horizon [°].
    azimuth : float
        Clockwise from north [°].
    distance : float
        From the viewer [au].
    phase_angle : float
        At the planet between the Sun and the viewer [°].
    magnitude : float
        Apparent magnitude V outside the air [mag].
    b_v : float
        Colour index B-V [mag].
    """

    name: str
    elevation: float
    azimuth: float
    distance: float
    phase_angle: float
    magnitude: float
    b_v: float


def planets(
    when: datetime,
    place: Place,
    *,
    refraction: bool = True,
    pressure: float | None = None,
    temperature: float | None = None,
) -> tuple[Planet, ...]:
    """Return the planets that the eye sees, at an instant, seen from a place.

    Parameters
    ----------
    when : datetime
        With a time zone, in the years 1900 to 2100.
    place : Place
        Where from.
    refraction : bool
        Whether they stand where they are seen through air, as for `Sun.at`.
    pressure, temperature : float, optional
        At the place, as for `Sun.at` [hPa], [°C].

    Returns
    -------
    tuple of Planet
        Mercury, Venus, Mars, Jupiter, Saturn, also those below the horizon. Within 7″ of JPL's DE421 by skyfield;
        magnitudes by Mallama and Hilton 2018, of Mars without its rotation (0.06 mag).

    Warns
    -----
    DomainWarning
        `when` is outside 1950 to 2050.

    Raises
    ------
    ValueError, TypeError
        `when` has no time zone or is outside 1900 to 2100.

    Examples
    --------
    >>> from datetime import UTC, datetime
    >>> seen = planets(datetime(2020, 12, 21, 17, tzinfo=UTC), Place(48.8, 2.3))
    >>> [(p.name, round(p.elevation, 1), round(p.magnitude, 1)) for p in seen[3:]]
    [('Jupiter', 9.9, -2.0), ('Saturn', 10.0, 0.7)]
    """
    scale = _refractivity(flag(refraction, "refraction"), place, pressure, temperature)
    return _planets(seconds_of(when), place, scale)


_PLANETS = ("Mercury", "Venus", "Mars", "Jupiter", "Saturn")


def _planets(seconds: float, place: Place, refractivity: float | None) -> tuple[Planet, ...]:
    rows = zip(_PLANETS, astro_planets(seconds, _coordinates(place), refractivity), strict=True)
    return tuple(
        Planet(name, _up(elevation), _round(azimuth), distance / _AU, math.degrees(phase), magnitude, b_v)
        for name, (elevation, azimuth, distance, phase, magnitude, b_v, _) in rows
    )

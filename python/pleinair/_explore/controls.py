"""The sliders of the explorer: which numbers of a sky, a camera and an exposure they read and set.

One table serves every sky, because rows that a sky has no number for are left out. A new sky adds the rows it needs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from ..camera import Camera


@dataclass(frozen=True)
class Study:
    """What is looked at: a sky, from where, how exposed (None: so that the median of the picture is a middle grey)."""

    sky: Any
    camera: Camera
    exposure: float | None


def _midnight(when: datetime) -> datetime:
    """Return the beginning of a day."""
    return when.replace(hour=0, minute=0, second=0, microsecond=0)


@dataclass(frozen=True)
class Control:
    """A slider.

    Parameters
    ----------
    path : str
        What it sets, from a `Study` on: ``"sky.sun.elevation"``, ``"sky.rayleigh.0"``, ``"camera.fov"``; ``"hours"`` of an
        instant are those of its day.
    label : str
        What it is called.
    low, high, step : float
        Range and step of the slider [in `unit`]. The number beside the slider takes any value the sky takes.
    unit : str
        Unit, in brackets if it is spoken of.
    group : str
        Heading it stands under.
    log : bool
        The slider moves in powers of two.
    beside : str
        A number that must be there too, where two skies use one name for different things.

    Examples
    --------
    >>> from pleinair.camera import Camera
    >>> fov = Control("camera.fov", "field of view", 10, 150, 1, "°", "View")
    >>> fov.read(Study(None, Camera(64, 36, fov=50), 1.0))
    50.0
    """

    path: str
    label: str
    low: float
    high: float
    step: float
    unit: str
    group: str
    log: bool = False
    beside: str = ""

    def read(self, study: Any) -> int | float | None:
        """Return the value [in `unit`], or None where the study has no such number.

        Parameters
        ----------
        study : Study
            What is looked at.

        Examples
        --------
        See `Control`.
        """
        if self.beside and replace(self, path=self.beside, beside="").read(study) is None:
            return None
        if self.path.startswith("camera.") and study.camera.projection == "panorama":
            return None  # It sees everything, and is not turned.
        value = study
        for part in self.path.split("."):
            try:
                if isinstance(value, datetime) and part == "hours":
                    value = (value - _midnight(value)) / timedelta(hours=1)
                    continue
                value = value[int(part)] if part.isdecimal() else getattr(value, part)
            except (AttributeError, IndexError, TypeError):
                return None
        number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
        return (int(value) if isinstance(value, (int, np.integer)) else float(value)) if number else None


CONTROLS = (
    Control("sky.when.hours", "time of day", 0, 23.95, 0.05, "h", "Sun"),
    Control("sky.sun.elevation", "elevation", -20, 90, 0.1, "°", "Sun"),
    Control("sky.sun.azimuth", "azimuth", 0, 360, 0.5, "°", "Sun"),
    Control("sky.sun_intensity", "intensity", 0, 100, 0.5, "", "Sun"),
    Control("sky.disc", "disc radius", 0, 5, 0.05, "°", "Sun"),
    Control("sky.moon.elevation", "elevation", -20, 90, 0.1, "°", "Moon"),
    Control("sky.moon.azimuth", "azimuth", 0, 360, 0.5, "°", "Moon"),
    Control("sky.moon.phase_angle", "phase angle", 0, 180, 1, "°", "Moon"),
    Control("sky.stars", "faintest star", -2, 6.5, 0.1, "mag", "Night"),
    Control("sky.airglow", "airglow", 0, 500, 5, "S10", "Night"),
    Control("sky.rayleigh.0", "Rayleigh red", 0, 0.1, 0.0001, "", "Air"),
    Control("sky.rayleigh.1", "Rayleigh green", 0, 0.1, 0.0001, "", "Air"),
    Control("sky.rayleigh.2", "Rayleigh blue", 0, 0.1, 0.0001, "", "Air"),
    Control("sky.mie", "Mie", 0, 0.02, 0.0001, "", "Air"),
    Control("sky.g", "asymmetry g", -0.999, 0.999, 0.001, "", "Air"),
    Control("sky.radius_ratio", "radius ratio", 2, 200, 0.5, "", "Air"),
    Control("sky.scale_height", "scale height", 0.05, 1, 0.005, "", "Air", beside="sky.radius_ratio"),
    Control("sky.turbidity", "turbidity", 1.7, 10, 0.05, "", "Air"),
    Control("sky.ozone", "ozone", 0, 600, 5, "DU", "Air"),
    Control("sky.ground_albedo", "ground albedo", 0, 1, 0.01, "", "Air"),
    Control("sky.ambiguity", "ambiguity", 0, 0.5, 0.005, "", "Pattern"),
    Control("sky.grain", "grain", 1 / 4096, 1 / 8, 0.1, "", "Pattern", log=True),
    Control("sky.cloud_complexity", "cloud complexity", 0, 16, 0.1, "", "Pattern"),
    Control("sky.rng", "seed", 0, 999, 1, "", "Pattern"),
    Control("camera.azimuth", "azimuth", 0, 360, 0.5, "°", "View"),
    Control("camera.elevation", "elevation", -90, 90, 0.5, "°", "View"),
    Control("camera.fov", "field of view", 10, 150, 1, "°", "View"),
)
# Three controls that are one colour: the sky's hue is that of the Rayleigh vector where the air is thin.
TINTS = ({"label": "sky hue", "of": ["sky.rayleigh.0", "sky.rayleigh.1", "sky.rayleigh.2"]},)
DAY = ("sky.sun.elevation", "sky.sun.azimuth")


def day(latitude: float = 45.0) -> list[list[float]]:
    """Rows of hour [h], elevation [°], azimuth [°] of the Sun at an equinox, for the slider of the day."""
    rows = []
    for hour in np.arange(0, 24.01, 0.25):
        angle, lat = math.radians(15 * (hour - 12)), math.radians(latitude)
        east, north, up = -math.sin(angle), -math.sin(lat) * math.cos(angle), math.cos(lat) * math.cos(angle)
        azimuth = math.degrees(math.atan2(east, north)) % 360
        rows.append([float(hour), round(math.degrees(math.asin(up)), 2), round(azimuth, 2)])
    # The last row is midnight again, and the azimuth must not run back through the whole circle to reach it.
    rows[-1][2] = 360.0
    return rows


def applied(target: Any, changes: Mapping[str, Any]) -> Any:
    """Return the frozen `target` with the values at the dotted paths; each dataclass is rebuilt once."""
    here: dict[str, Any] = {}
    below: dict[str, dict[str, Any]] = {}
    for path, value in changes.items():
        head, _, tail = path.partition(".")
        if tail:
            below.setdefault(head, {})[tail] = value
        else:
            here[head] = value
    if isinstance(target, datetime):
        return _midnight(target) + timedelta(hours=float(here["hours"]))
    if isinstance(target, tuple):
        items = list(target)
        for head, value in here.items():
            items[int(head)] = value
        return tuple(items)
    for head, inner in below.items():
        here[head] = applied(getattr(target, head), inner)
    return replace(target, **here)

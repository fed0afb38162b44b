"""Animation of a scene by functions of time or key frames. Public as `pleinair.Timeline`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np

from .._support.inputs import circle, instance, real
from .._support.keys import LinearKeys, ascending
from ..camera import Camera
from ..clouds import Params
from ..paint import Light
from ..sky import Natural, Sky


@dataclass(frozen=True, eq=False)
class Timeline:
    """What changes over an animation, as functions of a time from 0 to 1, or as keys.

    Parameters
    ----------
    camera : Camera, mapping or callable
        `camera(t)`; one that stands still; or cameras by their times, between which position, direction and field of
        view go evenly.
    sky : callable, optional
        `sky(t)`: a moving Sun.
    objects : callable, optional
        `objects(t)`: trees that move, surfaces that deform under their strokes (`Particles.on`).
    circles, trunk_circles : mapping or callable, optional
        Of t, or pairs by their times: distances of foreground and background, the rack focus of the thesis [m].
    lights : callable, optional
        `lights(t)`: in place of the sky's own.
    cloud_params : callable, optional
        `cloud_params(t)`, such as `pleinair.clouds.keyframes(...).at`.
    time : callable, optional
        `time(t)`: how long clouds have drifted [s].
    adaptation : mapping or callable, optional
        What the eye is adapted to: of t, or by its times, between which its logarithm goes evenly; `Scene.adapting` finds that
        of an eye that takes its time [cd/m²].

    Raises
    ------
    ValueError, TypeError
        Something is neither a function nor keys with times in [0, 1].

    Examples
    --------
    >>> shot = Timeline({0: Camera(32, 24), 1: Camera(32, 24, azimuth=20)}, circles={0: (10, 50), 0.5: (40, 200)})
    >>> camera, changes = shot.at(0.25)
    >>> camera.azimuth, changes
    (5.0, {'circles': (25.0, 125.0)})
    """

    camera: Any
    sky: Callable[[float], Sky] | None = None
    objects: Callable[[float], Any] | None = None
    circles: Any = None
    trunk_circles: Any = None
    lights: Callable[[float], Light | list[Light]] | None = None
    cloud_params: Callable[[float], Params] | None = None
    time: Callable[[float], float] | None = None
    adaptation: Any = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        if isinstance(self.camera, Camera):
            put(self, "camera", CameraPath({0.0: self.camera}))
        elif isinstance(self.camera, Mapping):
            put(self, "camera", CameraPath(ascending(self.camera, "camera")))
        for name in ("circles", "trunk_circles"):
            if isinstance(value := getattr(self, name), Mapping):
                put(self, name, LinearKeys({t: circle(pair, name) for t, pair in ascending(value, name).items()}))
        if isinstance(self.adaptation, Mapping):
            put(self, "adaptation", EvenLogarithms(ascending(self.adaptation, "adaptation")))
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not callable(value) and (value is not None or field.name == "camera"):
                msg = f"{field.name} must be a function of a time from 0 to 1, got {type(value).__name__}"
                raise TypeError(msg)

    def at(self, t: float) -> tuple[Camera, dict[str, Any]]:
        """Return the camera of a time and what else of a scene is different then.

        Parameters
        ----------
        t : float
            In [0, 1] [1].

        Examples
        --------
        >>> Timeline(Camera(32, 24), circles=lambda t: (10 + t, 20)).at(0.5)[1]
        {'circles': (10.5, 20)}
        """
        t = real(t, "t", 0, 1)
        rest = [field.name for field in dataclasses.fields(self)[1:]]
        return self.camera(t), {name: change(t) for name in rest if (change := getattr(self, name)) is not None}


@dataclass(frozen=True)
class TimeLapse:
    """A true sky as time goes by: what a `Timeline` takes as `sky`, in files and other processes too.

    Parameters
    ----------
    sky : pleinair.sky.Natural
        The sky, of a place.
    begin, end : datetime
        Of the first and the last frame, with a time zone.

    Raises
    ------
    ValueError, TypeError
        The sky has no place, or a time no zone.

    Examples
    --------
    >>> from datetime import UTC, datetime
    >>> from pleinair import Place
    >>> noon = Natural(datetime(2024, 8, 5, 12, tzinfo=UTC), Place(45, 6))
    >>> TimeLapse(noon, noon.when, datetime(2024, 8, 5, 18, tzinfo=UTC))(0.5).when.hour
    15
    """

    sky: Natural
    begin: datetime
    end: datetime

    def __post_init__(self) -> None:
        instance(self.sky, "sky", Natural)
        if self.sky.place is None:
            msg = "sky must be of a place"
            raise ValueError(msg)
        for name in ("begin", "end"):
            if instance(getattr(self, name), name, datetime).utcoffset() is None:
                msg = f"{name} must have a time zone"
                raise ValueError(msg)

    def __call__(self, t: float) -> Natural:
        """Return the sky at a time of the film, in [0, 1]."""
        return replace(self.sky, when=self.begin + t * (self.end - self.begin))


class EvenLogarithms:
    """Positive numbers by their times, between which the logarithm goes evenly."""

    def __init__(self, keys: dict[float, Any]) -> None:
        self.keys = {t: real(value, "adaptation", 1e-8, 1e10, "cd/m²") for t, value in keys.items()}
        self.between = LinearKeys({t: (math.log(value),) for t, value in self.keys.items()})

    def __call__(self, t: float) -> float:
        """Return the number at a time."""
        return math.exp(self.between(t)[0])


class CameraPath:
    """A camera that goes from key to key."""

    def __init__(self, keys: dict[float, Any]) -> None:
        cameras = [instance(camera, "camera", Camera) for camera in keys.values()]
        self.keys: dict[float, Camera] = keys
        self.first: Camera = cameras[0]
        frame = [(c.width, c.height, c.projection) for c in cameras]
        if any(other != frame[0] for other in frame):
            msg = f"camera must have one size and projection at all times, got {frame}"
            raise ValueError(msg)
        # Angles go the shorter way round.
        azimuth, roll = (
            np.rad2deg(np.unwrap(np.deg2rad(angles))).tolist()
            for angles in ([c.azimuth for c in cameras], [c.roll for c in cameras])
        )
        rows = zip(cameras, azimuth, roll, strict=True)
        values = [(*c.position, turn, c.elevation, c.fov, tilt) for c, turn, tilt in rows]
        self.between = LinearKeys(dict(zip(keys, values, strict=True)))

    def __call__(self, t: float) -> Camera:
        """Return the camera at a time."""
        x, y, z, azimuth, elevation, fov, roll = self.between(t)
        return replace(self.first, position=(x, y, z), azimuth=azimuth, elevation=elevation, fov=fov, roll=roll)

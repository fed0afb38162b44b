"""What changes over an animation. Public as `pleinair.Timeline`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .camera import Camera
from .clouds import Params
from .paint import Light
from .sky import Sky


@dataclass(frozen=True, eq=False)
class Timeline:
    """What changes over an animation, as functions of a time from 0 to 1.

    Parameters
    ----------
    camera : Camera or callable
        `camera(t)`, or one that stands still.
    sky : callable, optional
        `sky(t)`: a moving Sun.
    objects : callable, optional
        `objects(t)`: trees that move, surfaces that deform under their strokes (`Particles.on`).
    circles, trunk_circles : callable, optional
        Of t: distances of foreground and background, the rack focus of the thesis.
    lights : callable, optional
        `lights(t)`: in place of the sky's own.
    cloud_params : callable, optional
        `cloud_params(t)`, such as `pleinair.clouds.keyframes(...).at`.

    Raises
    ------
    TypeError
        Something is not a function.

    Examples
    --------
    >>> Timeline(lambda t: t).sky is None
    True
    """

    camera: Any
    sky: Callable[[float], Sky] | None = None
    objects: Callable[[float], Any] | None = None
    circles: Callable[[float], tuple[float, float]] | None = None
    trunk_circles: Callable[[float], tuple[float, float]] | None = None
    lights: Callable[[float], Light | list[Light]] | None = None
    cloud_params: Callable[[float], Params] | None = None

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            still = field.name == "camera" and isinstance(value, Camera)
            if not (still or callable(value) or (value is None and field.name != "camera")):
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
        camera = self.camera if isinstance(self.camera, Camera) else self.camera(t)
        rest = [field.name for field in dataclasses.fields(self)[1:]]
        return camera, {name: change(t) for name in rest if (change := getattr(self, name)) is not None}

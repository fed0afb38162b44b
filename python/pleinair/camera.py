"""From where: the camera that skies, clouds and scenes share."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._inputs import integer, real, vector

__all__ = ["Camera"]


@dataclass(frozen=True)
class Camera:
    """A perspective camera.

    Parameters
    ----------
    width, height : int
        Size of the picture [px].
    fov : float
        Vertical field of view, in (0, 179] [°].
    azimuth : float
        Direction of view, clockwise from north [°].
    elevation : float
        Direction of view above the horizon, in [-90, 90] [°].
    roll : float
        Clockwise rotation of the viewer's head [°].
    position : tuple of float
        Eye: x east, y north, z up [m].

    Raises
    ------
    ValueError, TypeError
        A value is not a number in its range.

    Examples
    --------
    >>> camera = Camera(320, 240, fov=60, azimuth=200, elevation=15)
    >>> camera.directions().shape
    (240, 320, 3)
    """

    width: int
    height: int
    fov: float = 60.0
    azimuth: float = 0.0
    elevation: float = 0.0
    roll: float = 0.0
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "width", integer(self.width, "width", 1, 65536))
        put(self, "height", integer(self.height, "height", 1, 65536))
        put(self, "fov", real(self.fov, "fov", 1e-3, 179, "°"))
        put(self, "azimuth", real(self.azimuth, "azimuth", -math.inf, math.inf, "°"))
        put(self, "elevation", real(self.elevation, "elevation", -90, 90, "°"))
        put(self, "roll", real(self.roll, "roll", -math.inf, math.inf, "°"))
        put(self, "position", vector(self.position, "position"))

    @classmethod
    def look_at(
        cls, position: ArrayLike, target: ArrayLike, width: int, height: int, fov: float = 60.0, roll: float = 0.0
    ) -> Camera:
        """Return the camera at `position` that has `target` in the centre of its picture.

        Parameters
        ----------
        position, target : array_like (3,)
            Eye and what it looks at [m].
        width, height : int
            Size of the picture [px].
        fov : float
            Vertical field of view [°].
        roll : float
            Clockwise rotation of the viewer's head [°].

        Raises
        ------
        ValueError
            `target` is at `position`, or a value is out of range.

        Examples
        --------
        >>> Camera.look_at((0, 0, 0), (10, 0, 0), 320, 240).azimuth
        90.0
        """
        eye, there = vector(position, "position"), vector(target, "target")
        east, north, up = (b - a for a, b in zip(eye, there, strict=True))
        if not math.hypot(east, north, up) > 0:
            msg = f"target must differ from position, got both at {eye}"
            raise ValueError(msg)
        azimuth = math.degrees(math.atan2(east, north)) % 360 if east or north else 0.0
        elevation = math.degrees(math.atan2(up, math.hypot(east, north)))
        return cls(width, height, fov, azimuth, elevation, roll, eye)

    def resized(self, width: int, height: int) -> Camera:
        """Return the same view as a picture of another size.

        Parameters
        ----------
        width, height : int
            Size of the picture [px]; the vertical field of view stays.

        Examples
        --------
        >>> Camera(320, 240).resized(640, 480)
        Camera(width=640, height=480, fov=60.0, azimuth=0.0, elevation=0.0, roll=0.0, position=(0.0, 0.0, 0.0))
        """
        return replace(self, width=width, height=height)

    def directions(self) -> NDArray[np.float64]:
        """Return unit vectors through the pixels' centres, away from the viewer.

        Returns
        -------
        ndarray (height, width, 3) of float64
            Directions [1], row 0 at the top.

        Examples
        --------
        >>> Camera(1, 1, azimuth=90).directions().round(6).tolist()
        [[[1.0, 0.0, 0.0]]]
        """
        out = np.empty((self.height, self.width, 3))
        _core.camera_directions(self, out)
        return out

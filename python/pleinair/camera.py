"""Cameras: perspective, fisheye and panorama projections that skies, clouds and scenes share."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import camera_axes, camera_directions
from ._support.inputs import choice, flag, integer, real, vector

__all__ = ["Camera"]


@dataclass(frozen=True, repr=False)
class Camera:
    """A camera: perspective, or with a lens that sees a hemisphere and more.

    Parameters
    ----------
    width, height : int
        Size of the picture [px].
    fov : float
        Field of view [°]: of a perspective the vertical one, in [0.001, 179]; of a fisheye across its circle, which is as
        wide as the shorter side, in [0.001, 360]. A panorama has the whole sphere: 180 whatever is given.
    azimuth : float
        Direction of view, clockwise from north [°].
    elevation : float
        Direction of view above the horizon, in [-90, 90] [°].
    roll : float
        Clockwise rotation of the viewer's head [°].
    position : tuple of float
        Eye: x east, y north, z up [m].
    projection : {"perspective", "equidistant", "equal_area", "panorama"}
        Two kinds of fisheye: the angle from the axis goes with the distance from the middle, or equal areas are equal solid
        angles. A panorama is equirectangular, as `pleinair.sky.Sky.panorama` has it, and is not turned. Skies take all;
        clouds take perspectives.

    Raises
    ------
    ValueError, TypeError
        A value is not a number in its range.

    Notes
    -----
    The perspective is equation 22 of realistic_sky, with the rotation of the view, at the centres of pixels.

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
    projection: str = "perspective"

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "width", integer(self.width, "width", 1, 65536))
        put(self, "height", integer(self.height, "height", 1, 65536))
        choice(self.projection, "projection", ("perspective", "equidistant", "equal_area", "panorama"))
        put(self, "fov", real(self.fov, "fov", 1e-3, 179 if self.projection == "perspective" else 360, "°"))
        put(self, "azimuth", real(self.azimuth, "azimuth", -math.inf, math.inf, "°"))
        put(self, "elevation", real(self.elevation, "elevation", -90, 90, "°"))
        put(self, "roll", real(self.roll, "roll", -math.inf, math.inf, "°"))
        put(self, "position", vector(self.position, "position"))
        if self.projection == "panorama":
            put(self, "fov", 180.0)
            if self.width != 2 * self.height:
                msg = f"width must be twice the height of a panorama, got {self.width} × {self.height}"
                raise ValueError(msg)
            if self.azimuth or self.elevation or self.roll:
                msg = "azimuth, elevation and roll must be 0 for a panorama, which begins at north"
                raise ValueError(msg)

    def __repr__(self) -> str:
        kind = "" if self.projection == "perspective" else f", projection={self.projection!r}"
        return (
            f"Camera(width={self.width}, height={self.height}, fov={self.fov}, azimuth={self.azimuth}, "
            f"elevation={self.elevation}, roll={self.roll}, position={self.position}{kind})"
        )

    @classmethod
    def fisheye(
        cls,
        size: int,
        fov: float = 180.0,
        azimuth: float = 0.0,
        elevation: float = 90.0,
        roll: float = 0.0,
        equal_area: bool = False,
    ) -> Camera:
        """Return a camera that sees a hemisphere in a circle, by default the sky from the ground.

        Parameters
        ----------
        size : int
            Width and height of the picture [px].
        fov : float
            Across the circle, in [0.001, 360] [°].
        azimuth, elevation, roll : float
            As for `Camera` [°]. Of one that looks up, south is at the top if the azimuth is 0, and east on the right.
        equal_area : bool
            Whether equal areas are equal solid angles; otherwise equal distances from the middle are equal angles.

        Raises
        ------
        ValueError, TypeError
            A value is out of range.

        Examples
        --------
        >>> float(Camera.fisheye(257).directions()[128, 128, 2])
        1.0
        """
        size = integer(size, "size", 1, 65536)
        kind = "equal_area" if flag(equal_area, "equal_area") else "equidistant"
        return cls(size, size, fov, azimuth, elevation, roll, projection=kind)

    @classmethod
    def panorama(cls, height: int) -> Camera:
        """Return a camera that sees the whole sphere, twice as wide as high.

        Parameters
        ----------
        height : int
            Rows, in [1, 32768] [px].

        Raises
        ------
        ValueError, TypeError
            The height is out of range.

        Examples
        --------
        >>> Camera.panorama(16).directions()[0, 0].round(1).tolist()
        [0.0, 0.1, 1.0]
        """
        height = integer(height, "height", 1, 32768)
        return cls(2 * height, height, 180.0, projection="panorama")

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

    def _axes(self) -> NDArray[np.float64]:
        """Return unit vectors to the right and up in the picture, and along the axis."""
        return np.array(camera_axes(self))

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
            Directions [1], row 0 at the top; zero outside the circle of a fisheye.

        Examples
        --------
        >>> Camera(1, 1, azimuth=90).directions().round(6).tolist()
        [[[1.0, 0.0, 0.0]]]
        """
        out = np.empty((self.height, self.width, 3))
        camera_directions(self, out)
        return out

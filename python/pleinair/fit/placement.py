"""Where a photograph has its clouds, and a fitted cloud brought there, with its grain."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import grain_add, grain_deviation, image_blur, image_warp
from .._support.inputs import key
from ..camera import Camera
from ..image import dilate
from .photo import Photo


@dataclass(frozen=True)
class Placement:
    """From pixels of a picture of a cloud to those of a photograph: `photo = scale (pixel - middle) + to`, (row, column)."""

    scale: float
    middle: tuple[float, float]
    to: tuple[float, float]
    size: tuple[int, int]


def _middle(mask: NDArray[np.bool_]) -> tuple[float, float]:
    # The median lies in the largest cloud where a mean would lie between two.
    rows, columns = np.nonzero(mask)
    return float(np.median(rows)), float(np.median(columns))


def placement(cloud: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> Placement:
    """Return what brings the middle of a cloud to that of the photograph's clouds, and gives it their area."""
    size = cloud.shape[0], cloud.shape[1]
    if not cloud.any() or not wanted.any():
        scale = wanted.shape[0] / cloud.shape[0]
        return Placement(scale, (size[0] / 2, size[1] / 2), (wanted.shape[0] / 2, wanted.shape[1] / 2), size)
    return Placement(math.sqrt(wanted.sum() / cloud.sum()), _middle(cloud), _middle(wanted), size)


def aimed(camera: Camera, place: Placement, shape: tuple[int, int]) -> Camera:
    """Return the camera of a cloud's picture, zoomed and turned to have the cloud there in a picture of this shape."""
    height, width = shape
    rows, columns = place.size
    focal = 0.5 * rows / math.tan(math.radians(camera.fov) / 2)  # [px]
    # Direction of the middle of the cloud, and how far from the new axis it is to lie.
    up = camera.elevation - math.degrees(math.atan((place.middle[0] - 0.5 * rows) / focal))
    side = camera.azimuth + math.degrees(math.atan((place.middle[1] - 0.5 * columns) / focal))
    focal *= place.scale
    elevation = up + math.degrees(math.atan((place.to[0] - 0.5 * height) / focal))
    azimuth = side - math.degrees(math.atan((place.to[1] - 0.5 * width) / focal))
    fov = 2 * math.degrees(math.atan(0.5 * height / focal))
    return replace(
        camera, width=width, height=height, fov=fov, azimuth=azimuth, elevation=min(max(elevation, -90.0), 90.0)
    )


def warped(picture: NDArray[Any], place: Placement, shape: tuple[int, int], outside: float) -> NDArray[np.float32]:
    """Return a picture (rows, columns, 3) in the photograph's frame, between its pixels linearly."""
    values = np.ascontiguousarray(picture, np.float32)
    moved = image_warp(values, values.shape, shape, place.scale, place.middle, place.to, outside)
    return moved.reshape(*shape, values.shape[2])


def softened(values: NDArray[Any]) -> NDArray[np.float32]:
    """Return the mean of each pixel and its eight neighbours; the border repeats."""
    wide = np.ascontiguousarray(values, np.float32)
    shape = wide.shape if wide.ndim == 3 else (*wide.shape, 1)
    return image_blur(wide, shape).reshape(wide.shape)


def grain_of(photo: Photo) -> tuple[float, float, float]:
    """Return the deviation of the noise of the sky between the clouds, of each encoded channel [1]."""
    clear = ~dilate(photo.segmentation.cloud | photo.segmentation.ground, 3)
    return grain_deviation(photo.rgb, clear.shape, clear)


def grainy(picture: NDArray[np.float32], photo: Photo, rng: Any) -> NDArray[np.float32]:
    """Return a picture with the grain of a photograph, in its levels."""
    return grain_add(np.ascontiguousarray(picture), grain_of(photo), key(rng)).reshape(picture.shape)

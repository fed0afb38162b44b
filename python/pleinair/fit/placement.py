"""Where a photograph has its clouds, and a fitted cloud brought there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera


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
    rows, columns = picture.shape[:2]
    wide = np.pad(picture, ((1, 1), (1, 1), (0, 0)), constant_values=outside)
    y = np.clip((np.arange(shape[0]) - place.to[0]) / place.scale + place.middle[0] + 1, 0, rows + 0.999)
    x = np.clip((np.arange(shape[1]) - place.to[1]) / place.scale + place.middle[1] + 1, 0, columns + 0.999)
    top, left = y.astype(int), x.astype(int)
    down, right = (y - top)[:, None, None], (x - left)[None, :, None]
    upper = wide[top][:, left] * (1 - right) + wide[top][:, left + 1] * right
    lower = wide[top + 1][:, left] * (1 - right) + wide[top + 1][:, left + 1] * right
    return np.asarray(upper * (1 - down) + lower * down, np.float32)

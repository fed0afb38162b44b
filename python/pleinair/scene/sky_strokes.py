"""A sky painted in strokes that keep their places among the stars (thesis, F3)."""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..image import resize
from ..paint import Canvas, Sprites, composite

# Of the height of a direction, 1 at the zenith: what is painted reaches a little below the horizon [1].
_LOWEST = -0.03


def sky_strokes(picture: NDArray[np.float32], camera: Camera, count: int) -> Canvas:
    """Paint a sky in strokes that stay where they are among the stars (F3): long, level, of the colour behind them."""
    to = _spiral(count)
    k = np.arange(len(to))
    pixels = 0.5 * camera.height / math.tan(math.radians(0.5 * camera.fov))
    size = np.array([3.2, 1.3]) * (math.sqrt(4 * math.pi / count) * pixels)
    center, away = _projected(to, camera, pixels)
    frame = np.array([camera.width, camera.height])
    seen = (away > 0.1) & ((center > -size) & (center < size + frame)).all(axis=1)
    k, to, center = k[seen], to[seen], center[seen]
    # Of a stroke's own colour the detail is left out that it is too broad for, and what is below the horizon.
    coarse = max(1.0, 0.5 * size[1])
    small = resize(picture, max(1, round(camera.width / coarse)), max(1, round(camera.height / coarse)))
    rows, columns, _ = small.shape
    to[:, 2] = np.maximum(to[:, 2], 1.5 * coarse / pixels)
    x, y = (_projected(to, camera, pixels)[0] * [columns / camera.width, rows / camera.height]).T
    i, j = np.clip(y, 0, rows - 1).astype(np.int64), np.clip(x, 0, columns - 1).astype(np.int64)
    own = small[i, j]
    mixed = k * 2654435761 % 2**32
    sprites = Sprites(
        center,
        np.broadcast_to(size, (len(k), 2)),
        1.0 + mixed / 2**32,
        own,
        variation=0.06 * own,
        rotation=(mixed % 1024 / 1024 - 0.5) * 30,
        opacity=0.75,
        label=k,
        frequency=1.5,
        frequency_t=5.0,
        feather_min=0.3,
        feather_max=0.6,
    )
    return composite(sprites, camera.width, camera.height)


@functools.lru_cache(maxsize=2)
def _spiral(count: int) -> NDArray[np.float64]:
    """Return directions spread evenly over the sphere, from the zenith down to where none is painted any more."""
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    k, z = k[z > _LOWEST], z[z > _LOWEST]
    turn = k * (math.pi * (3 - math.sqrt(5)))
    ring = np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=-1)


def _projected(
    to: NDArray[np.float64], camera: Camera, pixels: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where directions are in the picture [px], and how far they go along the view; behind it anywhere."""
    x, y, away = np.einsum("ak,nk->an", camera._axes(), to)
    scale = pixels / np.where(np.abs(away) < 1e-9, 1e-9, away)
    return np.stack([0.5 * camera.width + scale * x, 0.5 * camera.height - scale * y], axis=-1), away

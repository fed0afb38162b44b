"""Reflection in level water: the mirrored picture, and how much of it is seen (Fresnel's law in Schlick's form)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..camera import Camera
from ..paint import Canvas, Shading, Sprites, Strokes, composite, join
from .frame import Backdrop

# Widest picture of what water reflects [px].
_MIRROR_WIDTH = 480


_DOWN = np.array([1.0, 1.0, -1.0])


# Reflectance of water seen from straight above [1].
_STILL_WATER = 0.02


def mirror_camera(camera: Camera) -> Camera:
    """Return the camera of what water reflects: its picture is smaller than the frame."""
    small = min(1.0, _MIRROR_WIDTH / camera.width)
    return camera.resized(max(1, round(camera.width * small)), max(1, round(camera.height * small)))


def mirrored_canvas(found: list[tuple[Strokes, Any]], level: float, view: Camera, lights: Any) -> Canvas:
    """Paint what stands above a level plane as it hangs below it: what calm water shows to a camera above.

    `found` has strokes above it and how to shade them: `shaded(strokes, camera, lights)`.
    """
    turned = tuple(replace(light, direction=light.direction * _DOWN) for light in lights)
    sprites = []
    for strokes, shaded in found:
        hung = strokes._with(
            position=strokes.position * _DOWN + [0, 0, 2 * level],
            normal=strokes.normal * _DOWN.astype(np.float32),
            centers=strokes.centers * _DOWN + [0, 0, 2 * level],
            twist=-np.asarray(strokes.twist) if np.ndim(strokes.twist) else -strokes.twist,
        )
        sprites.append(shaded(hung, view, turned).sprites)
    return composite(join(sprites), view.width, view.height)


def frame_box(sprites: Sprites, camera: Camera, view: Camera) -> tuple[float, float, float, float] | None:
    """Return what part of a smaller picture strokes of a frame look at [px]; None if none is in the frame."""
    reach, frame = 0.5 * sprites.size, np.array([camera.width, camera.height])
    inside = ((sprites.center > -reach) & (sprites.center < reach + frame)).all(axis=1)
    inside &= np.asarray(sprites.opacity) > 0
    if not inside.any():
        return None
    scale = np.array([view.width, view.height]) / frame
    there = np.clip(sprites.center[inside] * scale, 0, [view.width, view.height])
    left, top = (there.min(axis=0) - 1).tolist()
    right, bottom = (there.max(axis=0) + 1).tolist()
    return left, top, right, bottom


def fresnel_reflection(
    shading: Shading,
    strokes: Strokes,
    camera: Camera,
    behind: Backdrop,
    hung: Canvas | None,
    visibility: float | None,
    level: float,
) -> Shading:
    """Return strokes of water: what they reflect, more of it the flatter one looks (Schlick's form of Fresnel's law)."""
    if camera.position[2] <= level:
        # From below nothing of what is above is mirrored: water has its own colour.
        return replace(shading, sprites=replace(shading.sprites, variation=0.06 * shading.sprites.color))
    look = strokes.position - np.array(camera.position)
    look /= np.maximum(np.linalg.norm(look, axis=1, keepdims=True), 1e-9)
    facing = np.sum(look * strokes.normal, axis=1, keepdims=True)
    share = _STILL_WATER + (1 - _STILL_WATER) * (1 - np.abs(facing)) ** 5
    to = look - 2 * facing * strokes.normal
    image = behind.reflected(to)
    if behind.clouds:
        # Clouds stand as they are seen from below the water.
        below = np.array(camera.position) * _DOWN + [0, 0, 2 * level]
        for one in behind.clouds_seen(camera, visibility, below, to / np.linalg.norm(to, axis=1, keepdims=True)):
            image = one.rgb + one.transmittance[:, None] * image
    if hung is not None:
        rows, columns = hung.transmittance.shape
        x, y = (shading.sprites.center * [columns / camera.width, rows / camera.height]).T
        i, j = np.clip(y, 0, rows - 1).astype(np.int64), np.clip(x, 0, columns - 1).astype(np.int64)
        image = hung.rgb[i, j] + hung.transmittance[i, j, None] * image
    color = (share * image + (1 - share) * shading.sprites.color).astype(np.float32)
    return replace(shading, sprites=replace(shading.sprites, color=color, variation=0.06 * color))

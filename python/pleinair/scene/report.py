"""Diagnostics of a frame: the shader's stages as pictures, and which strokes are visible and which were left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..paint import Canvas, Shading, Strokes
from .parts import Part


@dataclass(frozen=True, eq=False)
class Layer:
    """What one part of a scene does to a picture.

    Attributes
    ----------
    radiance : ndarray (height, width, 3) of float32
        What it adds [unit of the sky].
    transmittance : ndarray (height, width) of float32
        What it lets through of all behind it [1].
    depth : ndarray (height, width) of float32
        How far away it is, infinite where it is not [m].
    """

    radiance: NDArray[np.float32]
    transmittance: NDArray[np.float32]
    depth: NDArray[np.float32]


_STAGES = ("lightness", "placed", "shadow", "final", "palette", "distance")


def stage_pictures(
    shaded: list[Shading], canvas: Canvas | None, shape: tuple[int, int]
) -> dict[str, NDArray[np.float32]]:
    """Return each step of the shader as a picture: each pixel shows its most visible stroke."""
    if canvas is None or canvas.index is None or canvas.depth is None:
        out = {name: np.full(shape, np.nan, np.float32) for name in _STAGES}
        return out | {"mask": np.zeros(shape, np.float32), "depth": np.full(shape, np.inf, np.float32)}
    nothing = np.float32(np.nan)  # which is what an index of -1 finds
    columns = {name: np.append(np.concatenate([getattr(one, name) for one in shaded]), nothing) for name in _STAGES}
    out = {name: column[canvas.index] for name, column in columns.items()}
    return out | {"mask": 1 - canvas.transmittance, "depth": canvas.depth}


def visibility_report(parts: Mapping[Part, Strokes], camera: Camera) -> tuple[list[dict[str, Any]], list[str]]:
    """Return how many strokes of each part are before the eye, and which are not."""
    forward = camera._axes()[2]
    rows: list[dict[str, Any]] = []
    left = [] if parts else ["there are no objects: the picture is the sky"]
    for part, strokes in parts.items():
        before = int(((strokes.position - np.array(camera.position)) @ forward > 0).sum())
        row = {"name": part.name, "kind": part.kind, "strokes": len(strokes), "before the eye": before}
        rows.append(row | {"casts": part.casts})
        if before < len(strokes):
            left.append(f"{part.name}, {part.kind}: {len(strokes) - before} strokes behind the eye")
    return rows, left

"""Strokes of bark: one for each face of a tree's stems."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from .tree import Tree


@functools.lru_cache(maxsize=64)
def bark_strokes(tree: Tree) -> tuple[NDArray[np.float64], ...]:
    """Return a stroke for each face of a tree's stems: middle, normal, way along the stem, width and height."""
    mesh = tree.lod(0, subdivisions=0)
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.quads, np.int64)]
    sides = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    some = np.linalg.norm(normal, axis=1) > 1e-9
    length = np.linalg.norm(sides, axis=2)
    # Sides 1 and 3 go along the stem where they are the longer pair on the whole.
    upright = length[:, [1, 3]].sum() >= length[:, [0, 2]].sum()
    along = sides[:, 1] - sides[:, 3] if upright else sides[:, 0] - sides[:, 2]
    width = length[:, [0, 2] if upright else [1, 3]].mean(axis=1)
    height = length[:, [1, 3] if upright else [0, 2]].mean(axis=1)
    size = np.stack([1.5 * width, 1.4 * height], axis=1)
    return corners.mean(axis=1)[some], normal[some], along[some], size[some]

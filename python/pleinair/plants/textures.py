"""Small textures of bark and leaves for exported trees, made here: no pictures of anybody's."""

from __future__ import annotations

import functools

import numpy as np

from ..io import MeshMaterial

# Texels of a side.
_SIDE = 64


@functools.cache
def bark_material() -> MeshMaterial:
    """Return bark: furrows along the stem (v), grey brown, that repeat without a seam."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[0:_SIDE, 0:_SIDE] * (2 * np.pi / _SIDE)
    height = np.zeros((_SIDE, _SIDE))
    for _ in range(40):
        across, along = rng.integers(2, 12), rng.integers(0, 3)
        height += np.sin(across * x + along * y + rng.uniform(0, 2 * np.pi)) / across
    height = (height - height.min()) / np.ptp(height)
    colour = np.array([58, 48, 40]) + height[..., None] * np.array([74, 66, 56])
    return MeshMaterial("bark", np.rint(colour).astype(np.uint8))


@functools.cache
def leaf_material() -> MeshMaterial:
    """Return a leaf: green with a lighter midrib, its outline in alpha."""
    y, x = (np.mgrid[0:_SIDE, 0:_SIDE] + 0.5) / _SIDE
    half = 0.46 * np.sin(np.pi * y) ** 0.75 * (1.15 - 0.4 * y)
    inside = np.abs(x - 0.5) < np.minimum(half, 0.48)
    rib = np.exp(-(((x - 0.5) / 0.02) ** 2)) + 0.5 * (np.abs(np.sin(9 * np.pi * (y + 1.2 * np.abs(x - 0.5)))) > 0.97)
    colour = np.array([78, 104, 52]) + np.clip(rib, 0, 1)[..., None] * np.array([44, 40, 26])
    # Outside the outline the colour continues: what is filtered at the edge has no fringe.
    return MeshMaterial("leaf", np.rint(np.concatenate([colour, 255.0 * inside[..., None]], axis=2)).astype(np.uint8))

"""Fields between uneven faces on even levels that keep each column's sum: what NetCDF and SHDOM readers share."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..._core import volume_even_levels
from ..files import UnreadableError

Field = NDArray[np.float64]


def fit_in(shape: tuple[int, ...], max_voxels: int, name: object) -> None:
    """Refuse a box that is too large, before memory is taken."""
    voxels = math.prod(shape)
    if voxels > max_voxels:
        size = " x ".join(map(str, shape[::-1]))
        msg = f"{name} needs a box of {size} voxels ({4e-9 * voxels:.3f} GB); max_voxels is {max_voxels}"
        raise UnreadableError(msg)


def faces_of(centres: Field) -> Field:
    """Faces of layers that have only centres: half-way between, the outermost as far on the other side."""
    if len(centres) == 1:
        return np.array([0.0, 2 * centres[0]])
    between = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - between[0]], between, [2 * centres[-1] - between[-1]]])


def even(
    field: Field, faces: Field, step: float | None, max_voxels: int, name: object
) -> tuple[NDArray[np.float32], float, float]:
    """Give the field on even levels, their step [m] and the lowest face [m].

    Layers that are even already stay as they are; others are cut to those with water and one step around.
    """
    thick = np.diff(faces, axis=0)
    if not (np.isfinite(thick).all() and (thick > 0).all()):
        msg = f"{name}: heights do not rise from level to level"
        raise UnreadableError(msg)
    mean = float(thick.mean())
    if faces.ndim == 1 and step is None and np.abs(thick - mean).max() <= 2e-3 * mean:
        return field.astype(np.float32), mean, float(faces[0])
    low, high = (np.broadcast_to(f.reshape((len(f), *faces.shape[1:], *(1,) * (3 - faces.ndim))), field.shape)
                 for f in (faces[:-1], faces[1:]))  # fmt: skip
    wet = field > 0
    if not wet.any():
        wet = np.ones_like(wet)
    dz = float((high - low)[wet].min()) if step is None else step
    base, top = float(low[wet].min()) - dz, float(high[wet].max())
    count = math.ceil((top - base) / dz) + 1
    nz, ny, nx = field.shape
    fit_in((count, ny, nx), max_voxels, name)
    numbers = volume_even_levels(
        np.ascontiguousarray(field), (nz, ny, nx), np.ascontiguousarray(faces, float), base, dz, count
    )
    return numbers.reshape(count, ny, nx), dz, base

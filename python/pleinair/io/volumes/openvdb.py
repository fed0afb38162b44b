"""OpenVDB volumes (.vdb): one grid of numbers as a dense box, by the extension's own reader (src/clouds/openvdb)."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..._core import openvdb_grids, openvdb_read
from ..._support.inputs import DomainWarning
from ..files import PathLike, UnreadableError

Box = tuple[NDArray[np.float32], tuple[float, float, float], tuple[float, float, float]]


def read_vdb(path: PathLike, grid: str | None, y_up: bool, max_voxels: int) -> Box:
    """Read one grid: values (nz, ny, nx), edges of a voxel and lowest corner (x, y, z) [units of the file's world].

    Without a name it is the grid called density, or the only one that can be read.
    """
    data = Path(path).read_bytes()
    try:
        grids, beyond = openvdb_grids(data)
    except ValueError as error:
        msg = f"{path}: {error}"
        raise UnreadableError(msg) from None
    found = ", ".join(f"{name!r} ({kind}, {kind_of})" for name, kind, kind_of, _, _ in grids) or "no grid"
    if beyond:
        found += f" and {beyond} more that cannot be reached"
    readable = [k for k, row in enumerate(grids) if not row[4]]
    if grid is None:
        named = [k for k in readable if grids[k][0] == "density"]
        chosen = (named or readable)[:1] if named or len(readable) == 1 else []
        if not chosen:
            why = "; ".join(f"{row[0]!r}: {row[4]}" for row in grids if row[4])
            say = "name one with grid=" if readable else f"none of them can be read as density ({why or 'it is empty'})"
            msg = f"{path} has {found}: {say}"
            raise UnreadableError(msg)
    else:
        chosen = [k for k, row in enumerate(grids) if row[0] == grid]
        if not chosen:
            msg = f"{path} has no grid {grid!r}; it has {found}"
            raise UnreadableError(msg)
    try:
        values, size, voxel, origin, background = openvdb_read(data, chosen[0], y_up, max_voxels)
    except ValueError as error:
        msg = f"{path}: {error}; it has {found}"
        raise UnreadableError(msg) from None
    if background != 0:
        msg = (
            f"{path}: grid {grids[chosen[0]][0]!r} is {background:g} everywhere outside of its box, a volume is 0 there"
        )
        warnings.warn(msg, DomainWarning, stacklevel=4)
    nx, ny, nz = size
    return values.reshape(nz, ny, nx), (voxel[0], voxel[1], voxel[2]), (origin[0], origin[1], origin[2])

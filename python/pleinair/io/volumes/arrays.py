"""Volumes in archives of arrays that are not ours, and in files of nothing but numbers."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from ..._support.inputs import Array, integer, shape_text
from ..files import DAMAGE, UnreadableError, read_array


def foreign_arrays(path: Path, grid: str | None) -> tuple[Array, Any, Any] | None:
    """Give a three-dimensional array of a foreign .npz, its voxel [m] and origin [m]; nothing if the archive is ours."""
    try:
        with zipfile.ZipFile(path) as stored:
            infos = {i.filename.removesuffix(".npy"): i for i in stored.infolist() if i.filename.endswith(".npy")}
            if "pleinair_kind" in infos:
                if grid is not None:
                    msg = f"{path} is a file of ours and has no grids to choose from: leave grid away"
                    raise UnreadableError(msg)
                return None
            shapes = {}
            for name, info in infos.items():
                with stored.open(info) as stream:
                    version = np.lib.format.read_magic(stream)
                    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else None
                    header = header or np.lib.format.read_array_header_2_0
                    shape, _, dtype = header(stream)
                    shapes[name] = (shape, dtype)
            fields = [name for name, (shape, dtype) in shapes.items() if len(shape) == 3 and dtype.kind in "fiu"]
            listed = ", ".join(f"{name} {shape_text(s)} {d}" for name, (s, d) in shapes.items()) or "no array"
            chosen = "density" if grid is None and "density" in fields else grid
            if chosen is None and len(fields) == 1:
                chosen = fields[0]
            if chosen not in fields:
                what = "is not one of ours and" if grid is None else f"has no volume {grid!r}; it"
                msg = f"{path} {what} holds {listed}: name one array of three dimensions with grid="
                raise UnreadableError(msg)

            def member(name: str) -> Array:
                with stored.open(infos[name]) as stream:
                    return read_array(stream, infos[name].file_size)

            size = member("voxel_size") if "voxel_size" in shapes and shapes["voxel_size"][0] in ((), (3,)) else 20.0
            low = member("origin") if "origin" in shapes and shapes["origin"][0] == (3,) else (0.0, 0.0, 0.0)
            return member(chosen), size, low
    except UnreadableError:
        raise
    except DAMAGE as error:
        msg = f"{path} is damaged or not an .npz file ({error})"
        raise UnreadableError(msg) from None


def raw_array(path: Path, dtype: Any, shape: Any) -> Array:
    """Read a file of nothing but numbers, x fastest."""
    if dtype is None or shape is None:
        msg = f"dtype and shape go together, got dtype={dtype!r}, shape={shape!r}"
        raise ValueError(msg)
    try:
        kind = np.dtype(dtype)
    except TypeError as error:
        msg = f"dtype must name a type of numbers such as '<f4', got {dtype!r} ({error})"
        raise TypeError(msg) from None
    if kind.kind not in "fiu" or np.ndim(shape) != 1 or len(shape) != 3:
        msg = f"dtype must be real numbers and shape (nz, ny, nx), got {kind} and {shape!r}"
        raise ValueError(msg)
    nz, ny, nx = (integer(n, "shape", 1, 2**32) for n in shape)
    wanted, found = math.prod((nz, ny, nx)) * kind.itemsize, path.stat().st_size
    if wanted != found:
        msg = f"{path} has {found} bytes, shape {shape_text((nz, ny, nx))} of {kind} needs {wanted}"
        raise UnreadableError(msg)
    numbers = np.fromfile(path, kind).reshape(nz, ny, nx)
    return numbers.astype(np.float64 if kind.itemsize > 4 else np.float32)

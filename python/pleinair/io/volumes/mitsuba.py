"""Mitsuba's grid volumes (.vol, version 3)."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..files import PathLike, UnreadableError, replacing

_VOL = struct.Struct("<3sBiiiii6f")


def read_vol(path: PathLike) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Read a Mitsuba .vol grid (version 3, float32, one channel): density (nz, ny, nx) and box (2, 3) [m]."""
    data = Path(path).read_bytes()
    if len(data) < _VOL.size or data[:3] != b"VOL":
        msg = f"{path} is not a Mitsuba volume"
        raise UnreadableError(msg)
    _, version, kind, nx, ny, nz, channels, *box = _VOL.unpack_from(data)
    if version != 3 or kind != 1 or channels != 1 or min(nx, ny, nz) < 1:
        msg = f"{path}: only version 3, float32, one channel, got version {version}, type {kind}, {channels} channels"
        raise UnreadableError(msg)
    if len(data) != _VOL.size + 4 * nx * ny * nz:
        msg = f"{path} is damaged: {nx} x {ny} x {nz} voxels need {4 * nx * ny * nz} bytes, got {len(data) - _VOL.size}"
        raise UnreadableError(msg)
    density = np.frombuffer(data, "<f4", offset=_VOL.size).reshape(nz, ny, nx)
    return density.astype(np.float32), np.array(box, float).reshape(2, 3)


def write_vol(path: PathLike, density: NDArray[np.float32], box: NDArray[np.float64]) -> Path:
    """Write a Mitsuba .vol grid."""
    nz, ny, nx = density.shape
    head = _VOL.pack(b"VOL", 3, 1, nx, ny, nz, 1, *box.ravel().tolist())
    return replacing(path, lambda stream: stream.write(head + density.astype("<f4").tobytes()))

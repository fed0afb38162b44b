"""Liquid water and effective radius in text: AT3D's tables (x,y,z,lwc,reff) and SHDOM's two-parameter files."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from ..files import UnreadableError
from .levels import even, faces_of, fit_in
from .openvdb import Box


def read_shdom(path: Path, step: float | None, max_voxels: int) -> Box:
    """Read extinction [1/m] (nz, ny, nx), voxel [m] and lowest corner [m]; lengths are km, lwc g/m³, radii µm in the file.

    AT3D counts cells from 0, SHDOM from 1. The lowest cell has its west and south faces at 0; a level is the centre of a
    layer.
    """
    try:
        text = path.read_text()
    except UnicodeDecodeError:
        msg = f"{path} is no text of SHDOM or AT3D"
        raise UnreadableError(msg) from None
    lines = [line for line in (raw.split("#")[0].strip() for raw in text.splitlines()) if line]
    try:
        table = len(lines) > 3 and lines[3].lower().replace(" ", "").startswith("x,y,z")
        if table:
            columns = lines[3].lower().replace(" ", "").split(",")
            if not {"lwc", "reff"} <= set(columns):
                msg = f"{path} has the columns {', '.join(columns)}; lwc and reff are needed"
                raise UnreadableError(msg)
            numbers = [[float(v) for v in line.split(",")] for line in lines[:3]]
            (nx, ny, nz), (dx, dy), levels, body, first = map(int, numbers[0]), numbers[1], numbers[2], lines[4:], 0
        else:
            if lines[0].split()[0] != "2":
                msg = f"{path} begins with {lines[0][:40]!r}: a table of AT3D or a two-parameter file of SHDOM is read"
                raise UnreadableError(msg)
            columns, first = ["x", "y", "z", "lwc", "reff"], 1
            nx, ny, nz = (int(v) for v in lines[1].split())
            dx, dy = (float(v) for v in lines[2].split())
            # Levels and their temperatures may run over several lines.
            at = 3
            rest: list[float] = []
            while len(rest) < 2 * nz:
                rest += [float(v) for v in lines[at].split()]
                at += 1
            levels, body = rest[:nz], lines[at:]
        if min(nx, ny, nz) < 1 or len(levels) != nz or not (dx > 0 and dy > 0):
            msg = f"{path}: {nx} x {ny} x {nz} cells of {dx} x {dy} km with {len(levels)} levels"
            raise UnreadableError(msg)
        fit_in((nz, ny, nx), max_voxels, path)
        rows = np.loadtxt(io.StringIO("\n".join(body)), delimiter="," if table else None, ndmin=2)
    except UnreadableError:
        raise
    except (ValueError, IndexError, OverflowError) as error:
        msg = f"{path} is damaged or no text of SHDOM or AT3D ({error})"
        raise UnreadableError(msg) from None
    if rows.size == 0:
        rows = np.zeros((0, len(columns)))
    if rows.shape[1] < len(columns) or not np.isfinite(rows).all():
        msg = f"{path}: rows of {rows.shape[1]} finite numbers, the columns are {', '.join(columns)}"
        raise UnreadableError(msg)
    place = rows[:, [columns.index(c) for c in "xyz"]] - first
    lwc, reff = rows[:, columns.index("lwc")], rows[:, columns.index("reff")]
    wrong = (place != np.floor(place)).any(1) | (place < 0).any(1) | (place >= (nx, ny, nz)).any(1)
    wrong |= (lwc < 0) | ((lwc > 0) & (reff <= 0))
    if wrong.any():
        row = int(np.argmax(wrong))
        msg = f"{path}: row {row + 1} of the cells, {rows[row].tolist()}, is outside of {nx} x {ny} x {nz} or no water"
        raise UnreadableError(msg)
    field = np.zeros((nz, ny, nx))
    x, y, z = place.astype(int).T
    # 1.5 lwc / (1000 kg/m³ · reff): grams and micrometres leave 1e-3 · 1e6 / 1e3 = 1.
    field[z, y, x] = 1.5 * lwc / np.maximum(reff, 1e-9)
    out, dz, base = even(field, faces_of(1000 * np.array(levels)), step, max_voxels, path)
    return out, (1000 * dx, 1000 * dy, dz), (0.0, 0.0, base)

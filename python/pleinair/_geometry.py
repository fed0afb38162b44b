"""Meshes, and files of them: GLB, PLY, OBJ. Public as `pleinair.plants`.

Written by hand: the formats are small, and what readers commonly drop (per-leaf columns in PLY) stays.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._inputs import Array, array, integer, shape_text
from .io import PathLike, replacing

Floats = NDArray[np.float64]


def freeze(*arrays: Array | None) -> None:
    for one in arrays:
        if one is not None:
            one.setflags(write=False)


def indices(value: Any, name: str, corners: tuple[int, ...], limit: int) -> NDArray[np.uint32]:
    """Return faces as uint32, each index below `limit`."""
    out = np.asarray(value)
    if out.size == 0:
        return np.zeros((0, corners[0]), np.uint32)
    if out.dtype.kind not in "ui":
        msg = f"{name} must hold integers, got dtype {out.dtype}"
        raise TypeError(msg)
    if out.ndim != 2 or out.shape[1] not in corners:
        allowed = " or ".join(f"(n, {c})" for c in corners)
        msg = f"{name} must have shape {allowed}, got {shape_text(out.shape)}"
        raise ValueError(msg)
    if int(out.min()) < 0 or int(out.max()) >= limit:
        msg = f"{name} must be in [0, {limit - 1}] [1], got [{out.min()}, {out.max()}]"
        raise ValueError(msg)
    return np.require(out, np.uint32, ["C", "A"])


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh of quadrilaterals, counter-clockwise seen from outside.

    Attributes
    ----------
    vertices : ndarray (n, 3) of float64
        x east, y north, z up [m].
    quads : ndarray (m, 4) of uint32
        Indices of corners.
    normals : ndarray (n, 3) of float64
        Unit, weighted by area.
    branch_id : ndarray (n,) of uint32
        Stem of a tree a vertex belongs to: 0 the trunk, then the branches; empty elsewhere.
    step : ndarray (n,) of float32
        Step of the stem's growth; between steps after subdivision; empty elsewhere.
    s : ndarray (n,) of float32
        Place along the stem, 0 at its beginning and 1 at its end [1]; empty elsewhere.
    """

    vertices: Floats
    quads: NDArray[np.uint32]
    normals: Floats
    branch_id: NDArray[np.uint32]
    step: NDArray[np.float32]
    s: NDArray[np.float32]

    def __post_init__(self) -> None:
        freeze(self.vertices, self.quads, self.normals, self.branch_id, self.step, self.s)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__post_init__()

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.quads)} quads)"

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """Two triangles for each quad, (2m, 3) of uint32.

        Examples
        --------
        >>> subdivide([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]], levels=0).triangles.tolist()
        [[0, 1, 2], [0, 2, 3]]
        """
        return self.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)

    @property
    def bounds(self) -> Floats:
        """Lowest and highest corner of the box around it, (2, 3) [m].

        Examples
        --------
        >>> subdivide([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]], levels=0).bounds.tolist()
        [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
        """
        if not len(self.vertices):
            return np.zeros((2, 3))
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])


def mesh_of(parts: tuple[Array, ...]) -> Mesh:
    vertices, quads, normals, *rest = parts
    empty = (np.zeros(0, np.uint32), np.zeros(0, np.float32), np.zeros(0, np.float32))
    stem, step, s = rest or empty
    return Mesh(vertices.reshape(-1, 3), quads.reshape(-1, 4), normals.reshape(-1, 3), stem, step, s)


def subdivide(vertices: Any, faces: Any, levels: int = 2) -> Mesh:
    """Return the Catmull-Clark subdivision of a mesh of quadrilaterals.

    Parameters
    ----------
    vertices : array_like (n, 3)
        Corners [m].
    faces : array_like (m, 4) of int
        Indices of corners, counter-clockwise seen from outside.
    levels : int
        Steps, each of which makes four faces of one, in [0, 10] [1].

    Returns
    -------
    Mesh
        First the vertices that were there, moved.

    Raises
    ------
    ValueError, TypeError
        An index points nowhere, a coordinate is not finite, an edge has more than two faces, or the result would have
        more than 2²⁶ faces.

    Notes
    -----
    Catmull and Clark (1978); boundaries become cubic B-splines.

    Examples
    --------
    >>> square = subdivide([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]], levels=1)
    >>> len(square.vertices), len(square.quads)
    (9, 4)
    """
    at = array(vertices, "vertices", dtypes=(np.float64,), ndim=2, last=3)
    if not np.isfinite(at).all():
        msg = "vertices must be finite"
        raise ValueError(msg)
    quads = indices(faces, "faces", (4,), len(at))
    return mesh_of(_core.plants_subdivide(at, quads, integer(levels, "levels", 0, 10)))


def square(quad: Any) -> Floats:
    """Return the square nearest to a quadrilateral.

    Parameters
    ----------
    quad : array_like (4, 3)
        Corners in order [m].

    Returns
    -------
    ndarray (4, 3) of float64
        Corners of the square, in the plane through the centroid at a right angle to the vector area: the term
        ¼ Σ z_k (−i)^k of the discrete Fourier transform of the projected corners, which is nearest in the sum of squared
        distances. The centroid stays [m].

    Raises
    ------
    ValueError, TypeError
        The corners are not finite, or span no area.

    Examples
    --------
    >>> square([[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1, 0]]).tolist()
    [[0.75, -0.75, 0.0], [3.25, -0.75, 0.0], [3.25, 1.75, 0.0], [0.75, 1.75, 0.0]]
    """
    at = array(quad, "quad", dtypes=(np.float64,), ndim=2, last=3)
    if at.shape != (4, 3) or not np.isfinite(at).all():
        msg = f"quad must be four finite points, got shape {shape_text(at.shape)}"
        raise ValueError(msg)
    out = _core.plants_square(at.tolist())
    if out is None:
        msg = "quad spans no area"
        raise ValueError(msg)
    return np.array(out)


@dataclass(frozen=True)
class Part:
    """One object of a file: triangles, quads or points with named columns."""

    name: str
    vertices: Floats
    faces: NDArray[np.uint32] | None
    normals: Array | None = None
    uv: Array | None = None
    columns: Mapping[str, Array] | None = None


def export(path: PathLike, parts: list[Part], about: dict[str, Any]) -> Path:
    """Write parts to a file whose ending names the format."""
    suffix = Path(path).suffix.lower()
    writers = {".glb": _glb, ".ply": _ply, ".obj": _obj}
    if suffix not in writers:
        msg = f"path must end in .glb, .ply or .obj, got {Path(path).name!r}"
        raise ValueError(msg)
    return replacing(path, lambda stream: writers[suffix](stream, parts, about))


def _corners(faces: NDArray[np.uint32]) -> NDArray[np.uint32]:
    return faces if faces.shape[1] == 3 else faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def _glb(stream: IO[bytes], parts: list[Part], about: dict[str, Any]) -> None:
    """Write glTF 2.0: y is up, so a node turns our z; custom columns are named `_NAME` and are float32."""
    chunks: list[bytes] = []
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    offset = 0

    def put(values: Array, kind: int, target: int, limits: bool = False) -> int:
        nonlocal offset
        data = values.tobytes()
        shape = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}[1 if values.ndim == 1 else values.shape[1]]
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(data), "target": target})
        entry = {"bufferView": len(views) - 1, "componentType": kind, "count": len(values), "type": shape}
        if limits:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        accessors.append(entry)
        padded = data + b"\0" * (-len(data) % 4)
        chunks.append(padded)
        offset += len(padded)
        return len(accessors) - 1

    meshes: list[dict[str, Any]] = []
    nodes: list[dict[str, Any]] = [{"rotation": [-(0.5**0.5), 0, 0, 0.5**0.5], "children": [], "name": about["name"]}]
    for part in parts:
        if not len(part.vertices) or (part.faces is not None and not len(part.faces)):
            continue
        attributes = {"POSITION": put(part.vertices.astype("<f4"), 5126, 34962, limits=True)}
        if part.normals is not None:
            attributes["NORMAL"] = put(part.normals.astype("<f4"), 5126, 34962)
        if part.uv is not None:
            attributes["TEXCOORD_0"] = put(part.uv.astype("<f4"), 5126, 34962)
        for name, values in (part.columns or {}).items():
            attributes[f"_{name.upper()}"] = put(values.astype("<f4"), 5126, 34962)
        primitive: dict[str, Any] = {"attributes": attributes, "mode": 0}
        if part.faces is not None:
            primitive |= {"mode": 4, "indices": put(_corners(part.faces).reshape(-1).astype("<u4"), 5125, 34963)}
        meshes.append({"name": part.name, "primitives": [primitive]})
        nodes.append({"name": part.name, "mesh": len(meshes) - 1})
        nodes[0]["children"].append(len(nodes) - 1)
    if not nodes[0]["children"]:
        del nodes[0]["children"]
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "pleinair", "extras": about},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
    }
    if meshes:
        document |= {"meshes": meshes, "accessors": accessors, "bufferViews": views}
        document["buffers"] = [{"byteLength": offset}]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = b"".join(chunks)
    total = 12 + 8 + len(text) + (8 + len(body) if body else 0)
    stream.write(np.array([0x46546C67, 2, total, len(text), 0x4E4F534A], "<u4").tobytes() + text)
    if body:
        stream.write(np.array([len(body), 0x004E4942], "<u4").tobytes() + body)


def _line(text: str) -> str:
    """Return text as one line of ASCII."""
    return "".join(c if " " <= c <= "~" else "?" for c in text)


_PLY = {"f4": "float", "f8": "double", "u4": "uint", "i4": "int", "u1": "uchar", "u2": "ushort"}


def _table(part: Part) -> Array:
    """Return a structured array of a part's vertices."""
    columns: dict[str, Array] = dict(zip("xyz", part.vertices.astype("<f8").T, strict=True))
    if part.normals is not None:
        columns |= dict(zip(("nx", "ny", "nz"), part.normals.astype("<f4").T, strict=True))
    if part.uv is not None:
        columns |= dict(zip(("u", "v"), part.uv.astype("<f4").T, strict=True))
    for name, values in (part.columns or {}).items():
        if values.ndim == 2:
            columns |= {f"{name}_{k}": values[:, k] for k in range(values.shape[1])}
        elif values.dtype == np.int64:
            # PLY has no integers of 64 bits.
            halves = np.ascontiguousarray(values).astype("<i8").view("<u4").reshape(-1, 2)
            columns |= {f"{name}_low": halves[:, 0], f"{name}_high": halves[:, 1]}
        else:
            columns[name] = values
    kinds = [(name, values.dtype.newbyteorder("<")) for name, values in columns.items()]
    out = np.empty(len(part.vertices), kinds)
    for name, values in columns.items():
        out[name] = values
    return out


def _ply(stream: IO[bytes], parts: list[Part], about: dict[str, Any]) -> None:
    """Write binary PLY: the first part's vertices and faces; points follow as an element of their own with every column."""
    header = ["ply", "format binary_little_endian 1.0", f"comment pleinair {_line(about['name'])}"]
    bodies: list[bytes] = []

    def element(name: str, table: Array) -> None:
        header.append(f"element {name} {len(table)}")
        names = table.dtype.names or ()
        header.extend(f"property {_PLY[table.dtype[n].str[1:]]} {n}" for n in names)
        bodies.append(table.tobytes())

    solid = [p for p in parts if p.faces is not None]
    if solid:
        tables = [_table(p) for p in solid]
        # Parts with other columns are not one element: what they share is kept.
        shared = [n for n in tables[0].dtype.names or () if all(n in (t.dtype.names or ()) for t in tables)]
        element("vertex", np.concatenate([_only(t, shared) for t in tables]) if len(tables) > 1 else tables[0])
        first = np.cumsum([0] + [len(t) for t in tables])
        rows = []
        count = 0
        for part, base in zip(solid, first, strict=False):
            assert part.faces is not None
            n = part.faces.shape[1]
            row = np.empty(len(part.faces), [("n", "u1"), ("v", "<u4", (n,))])
            row["n"], row["v"] = n, part.faces + np.uint32(base)
            rows.append(row.tobytes())
            count += len(row)
        header += [f"element face {count}", "property list uchar uint vertex_indices"]
        bodies.append(b"".join(rows))
    for part in parts:
        if part.faces is None:
            element(part.name if solid else "vertex", _table(part))
    stream.write(("\n".join([*header, "end_header"]) + "\n").encode() + b"".join(bodies))


def _only(table: Array, names: list[str]) -> Array:
    out = np.empty(len(table), [(n, table.dtype[n]) for n in names])
    for n in names:
        out[n] = table[n]
    return out


def _obj(stream: IO[bytes], parts: list[Part], about: dict[str, Any]) -> None:
    """Write Wavefront OBJ: one object for each part; columns are lost."""
    stream.write(f"# pleinair {_line(about['name'])}\n".encode())
    base = np.array([1, 1, 1])  # of v, vt, vn

    def lines(tag: str, values: Array) -> bytes:
        row = tag + " %.12g" * values.shape[1] + "\n"
        text: str = row * len(values) % tuple(np.asarray(values, np.float64).ravel().tolist())
        return text.encode()

    for part in parts:
        n = len(part.vertices)
        stream.write(f"o {part.name}\n".encode() + lines("v", part.vertices))
        if part.uv is not None:
            stream.write(lines("vt", part.uv))
        if part.normals is not None:
            stream.write(lines("vn", part.normals))
        if part.faces is None:
            row = "p %d\n" * n
            stream.write((row % tuple(range(int(base[0]), int(base[0]) + n))).encode())
        elif len(part.faces):
            first = part.faces.astype(np.int64)
            if part.uv is not None and part.normals is not None:
                corner, kinds = "%d/%d/%d", [0, 1, 2]
            elif part.normals is not None:
                corner, kinds = "%d//%d", [0, 2]
            else:
                corner, kinds = "%d", [0]
            row = "f " + " ".join([corner] * part.faces.shape[1]) + "\n"
            numbers = np.stack([first + base[k] for k in kinds], axis=-1)
            stream.write((row * len(first) % tuple(numbers.ravel().tolist())).encode())
        base += np.array([n, n if part.uv is not None else 0, n if part.normals is not None else 0])

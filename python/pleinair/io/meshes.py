"""Files of meshes: GLB (glTF 2.0, binary), PLY, OBJ.

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

from .._support.inputs import Array
from ..color import srgb_decode
from .files import PathLike, replacing


@dataclass(frozen=True)
class MeshPart:
    """One object of a file: triangles, quads or points with named columns."""

    name: str
    vertices: NDArray[np.floating]
    faces: NDArray[np.uint32] | None
    normals: Array | None = None
    uv: Array | None = None
    columns: Mapping[str, Array] | None = None
    # (n, 3): floats are linear light, bytes are sRGB.
    colors: Array | None = None


def write_mesh(path: PathLike, parts: list[MeshPart], about: dict[str, Any]) -> Path:
    """Write parts to a file whose ending names the format."""
    suffix = Path(path).suffix.lower()
    writers = {".glb": _glb, ".ply": _ply, ".obj": _obj}
    if suffix not in writers:
        msg = f"path must end in .glb, .ply or .obj, got {Path(path).name!r}"
        raise ValueError(msg)
    return replacing(path, lambda stream: writers[suffix](stream, parts, about))


def _corners(faces: NDArray[np.uint32]) -> NDArray[np.uint32]:
    return faces if faces.shape[1] == 3 else faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def _glb(stream: IO[bytes], parts: list[MeshPart], about: dict[str, Any]) -> None:
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
        if part.colors is not None:
            # glTF's vertex colours are linear.
            linear = part.colors if part.colors.dtype.kind == "f" else srgb_decode(part.colors / np.float32(255))
            attributes["COLOR_0"] = put(linear.astype("<f4"), 5126, 34962)
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


def _table(part: MeshPart) -> Array:
    """Return a structured array of a part's vertices."""
    columns: dict[str, Array] = dict(zip("xyz", part.vertices.T, strict=True))
    if part.normals is not None:
        columns |= dict(zip(("nx", "ny", "nz"), part.normals.astype("<f4").T, strict=True))
    if part.uv is not None:
        columns |= dict(zip(("u", "v"), part.uv.astype("<f4").T, strict=True))
    if part.colors is not None:
        columns |= dict(zip(("red", "green", "blue"), part.colors.T, strict=True))
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


def _ply(stream: IO[bytes], parts: list[MeshPart], about: dict[str, Any]) -> None:
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


def _obj(stream: IO[bytes], parts: list[MeshPart], about: dict[str, Any]) -> None:
    """Write Wavefront OBJ: one object for each part; columns are lost."""
    stream.write(f"# pleinair {_line(about['name'])}\n".encode())
    base = np.array([1, 1, 1])  # of v, vt, vn

    def lines(tag: str, values: Array) -> bytes:
        row = tag + (" %.9g" if values.dtype == np.float32 else " %.12g") * values.shape[1] + "\n"
        text: str = row * len(values) % tuple(np.asarray(values, np.float64).ravel().tolist())
        return text.encode()

    for part in parts:
        n = len(part.vertices)
        corners = part.vertices
        if part.colors is not None:
            shown = part.colors if part.colors.dtype.kind == "f" else part.colors / np.float32(255)
            corners = np.hstack([corners, shown.astype(corners.dtype)])
        stream.write(f"o {part.name}\n".encode() + lines("v", corners))
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

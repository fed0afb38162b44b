"""Files of meshes: GLB (glTF 2.0, binary), PLY, OBJ.

Written by hand: the formats are small, and what readers commonly drop (per-leaf columns in PLY) stays.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import Array, choice, flag
from ..color import srgb_decode
from .files import PathLike, replacing


@dataclass(frozen=True)
class MeshMaterial:
    """What a part of a glTF file is made of: a texture in sRGB, with alpha if its shape is cut out of the faces."""

    name: str
    texture: NDArray[np.uint8]  # (height, width, 3 or 4)


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
    material: MeshMaterial | None = None


def write_mesh(
    path: PathLike, parts: list[MeshPart], about: dict[str, Any], *, up: str = "z", triangles: bool = False
) -> Path:
    """Write parts to a file whose ending names the format; `up` and `triangles` are of .ply and .obj (glTF is y up)."""
    suffix = Path(path).suffix.lower()
    choice(up, "up", ("z", "y"))
    flag(triangles, "triangles")
    if suffix in (".ply", ".obj"):
        about = {**about, "up": up}
        if triangles:
            parts = [replace(p, faces=p.faces if p.faces is None else _corners(p.faces)) for p in parts]
        if up == "y":
            turned = [None if p.normals is None else _y_up(p.normals) for p in parts]
            parts = [replace(p, vertices=_y_up(p.vertices), normals=n) for p, n in zip(parts, turned, strict=True)]
    writers = {".glb": _glb, ".ply": _ply, ".obj": _obj}
    if suffix not in writers:
        msg = f"path must end in .glb, .ply or .obj, got {Path(path).name!r}"
        raise ValueError(msg)
    return replacing(path, lambda stream: writers[suffix](stream, parts, about))


def _corners(faces: NDArray[np.uint32]) -> NDArray[np.uint32]:
    return faces if faces.shape[1] == 3 else faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def _y_up(x: Array) -> Array:
    return np.stack([x[:, 0], x[:, 2], -x[:, 1]], axis=1)


def _png(levels: NDArray[np.uint8]) -> bytes:
    """Return a PNG of 8 bits: textures are small, and a file of a tree must not need Pillow."""
    height, width, channels = levels.shape

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    rows = np.concatenate([np.zeros((height, 1), np.uint8), levels.reshape(height, -1)], axis=1)
    body = chunk(b"IDAT", zlib.compress(rows.tobytes(), 9))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + body + chunk(b"IEND", b"")


def _scalars(columns: Mapping[str, Array]) -> dict[str, NDArray[np.float32]]:
    """Return columns as scalars of single precision, which every reader takes: Blender wants one width for all.

    Pairs become _0 and _1; integers that floats do not hold become their halves of 16 bits, the low one first.
    """
    out = {}
    for name, values in columns.items():
        parts: Array = values[:, None] if values.ndim == 1 else values
        if values.dtype.kind in "iu" and values.dtype.itemsize > 2 and (values.size and int(values.max()) >= 1 << 24):
            size = values.dtype.itemsize
            parts = np.ascontiguousarray(values).astype(f"<i{size}").view("<u2").reshape(len(values), -1)
        for k in range(parts.shape[1]):
            suffix = f"_{k}" if parts.shape[1] > 1 else ""
            out[f"_{name.upper()}{suffix}"] = parts[:, k].astype("<f4")
    return out


def _glb(stream: IO[bytes], parts: list[MeshPart], about: dict[str, Any]) -> None:
    """Write glTF 2.0: y is up, so a node turns our z; custom columns are named `_NAME` and are float32."""
    chunks: list[bytes] = []
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    offset = 0

    def view(data: bytes, **more: Any) -> int:
        nonlocal offset
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(data), **more})
        chunks.append(data + b"\0" * (-len(data) % 4))
        offset += len(chunks[-1])
        return len(views) - 1

    def put(values: Array, kind: int, target: int, limits: bool = False) -> int:
        shape = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}[1 if values.ndim == 1 else values.shape[1]]
        place = view(values.tobytes(), target=target)
        entry = {"bufferView": place, "componentType": kind, "count": len(values), "type": shape}
        if limits:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        accessors.append(entry)
        return len(accessors) - 1

    meshes: list[dict[str, Any]] = []
    materials: list[dict[str, Any]] = []
    textures: list[dict[str, Any]] = []
    images: list[dict[str, Any]] = []
    nodes: list[dict[str, Any]] = [{"rotation": [-(0.5**0.5), 0, 0, 0.5**0.5], "children": [], "name": about["name"]}]
    for part in parts:
        if not len(part.vertices) or (part.faces is not None and not len(part.faces)):
            continue
        extras: dict[str, Any] = {}
        attributes = {"POSITION": put(part.vertices.astype("<f4"), 5126, 34962, limits=True)}
        if part.normals is not None:
            attributes["NORMAL"] = put(part.normals.astype("<f4"), 5126, 34962)
        if part.uv is not None:
            # v is 0 at the top.
            attributes["TEXCOORD_0"] = put((part.uv * [1, -1] + [0, 1]).astype("<f4"), 5126, 34962)
        if part.colors is not None:
            # glTF's vertex colours are linear and in [0, 1]: brighter ones are divided by the brightest, which is said.
            linear = part.colors if part.colors.dtype.kind == "f" else srgb_decode(part.colors / np.float32(255))
            scale = max(1.0, float(linear.max()))
            extras = {"color_scale": scale} if scale > 1 else {}
            attributes["COLOR_0"] = put(np.clip(linear / np.float32(scale), 0, 1).astype("<f4"), 5126, 34962)
        for name, values in _scalars(part.columns or {}).items():
            attributes[name] = put(values, 5126, 34962)
        primitive: dict[str, Any] = {"attributes": attributes, "mode": 0}
        if part.faces is not None:
            primitive |= {"mode": 4, "indices": put(_corners(part.faces).reshape(-1).astype("<u4"), 5125, 34963)}
        if part.material is not None:
            primitive["material"] = len(materials)
            textures.append({"source": len(images), "sampler": 0})
            images.append({"bufferView": view(_png(part.material.texture)), "mimeType": "image/png"})
            surface = {"baseColorTexture": {"index": len(textures) - 1}, "metallicFactor": 0.0, "roughnessFactor": 0.9}
            cutout = {"alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True}
            shape = cutout if part.material.texture.shape[2] == 4 else {}
            materials.append({"name": part.material.name, "pbrMetallicRoughness": surface, **shape})
        meshes.append({"name": part.name, "primitives": [primitive], **({"extras": extras} if extras else {})})
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
    if materials:
        document |= {"materials": materials, "textures": textures, "images": images, "samplers": [{}]}
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
    header = ["ply", "format binary_little_endian 1.0", f"comment pleinair {_line(about['name'])}, {about['up']} up"]
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
    stream.write(f"# pleinair {_line(about['name'])}, {about['up']} up\n".encode())
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

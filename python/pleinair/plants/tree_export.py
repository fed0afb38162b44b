"""What a tree is in a file: a trunk with bark, leaves as textured cards or as points with every column, octahedra.

A trunk is as fine as 8000 triangles allow unless a level is asked for; leaves are quadrilaterals cut out by their texture.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..io import MeshPart
from .mesh import Mesh
from .textures import bark_material, leaf_material

# Most triangles of an exported trunk, unless a level is asked for.
_TRIANGLES = 8000


def tree_parts(tree: Any, mesh: Mesh, leaves: str, proxies: bool, textured: bool) -> list[MeshPart]:
    """Return the parts of a tree's file, its stems as `mesh`; only what is textured has places on its bark."""
    columns = {"branch_id": mesh.branch_id, "step": mesh.step, "s": mesh.s}
    uv = _bark_uv(tree, mesh) if textured else None
    parts = [MeshPart("trunk", mesh.vertices, mesh.quads, mesh.normals, uv, columns, material=bark_material())]
    if leaves != "none":
        parts.append(_cards(tree.leaves, textured) if leaves == "cards" else _points(tree.leaves))
    if proxies:
        extra = tree.leaves.proxies()
        parts.append(MeshPart("proxies", extra.vertices, extra.quads, extra.normals))
    return parts


def light_mesh(tree: Any) -> Mesh:
    """Return the stems at the finest level of detail that has few enough triangles."""
    for level, subdivisions in ((0, 2), (0, 1), (1, 1), (1, 0), (2, 0), (3, 0), (4, 0)):
        mesh: Mesh = tree.lod(level, subdivisions=subdivisions)
        if 2 * len(mesh.quads) <= _TRIANGLES:
            break
    return mesh


def _bark_uv(tree: Any, mesh: Mesh) -> NDArray[np.float64]:
    """Return places on the bark: round the stem, there and back so that there is no seam, and along it [m]."""
    rings = tree.rings
    first = np.flatnonzero(rings["along"] == 0)
    longest = np.maximum.reduceat(rings["along"], first) if len(first) else np.ones(1)
    around = np.abs(np.arctan2(mesh.normals[:, 1], mesh.normals[:, 0])) / np.pi
    along = mesh.s * longest[np.minimum(mesh.branch_id, len(longest) - 1)]
    return np.stack([around, along], axis=1)


def _cards(leaves: Any, textured: bool) -> MeshPart:
    """Return a rectangle for each leaf, its face along the normal and its height along the steepest way up."""
    n = leaves.normal
    right = np.cross([0.0, 0.0, 1.0], n)
    flat = np.linalg.norm(right, axis=1, keepdims=True)
    right = np.where(flat > 1e-9, right / np.maximum(flat, 1e-9), [1.0, 0.0, 0.0])
    up = np.cross(n, right)
    across = 0.5 * leaves.size[:, :1] * right
    along = 0.5 * leaves.size[:, 1:] * up
    corners = np.stack([-across - along, across - along, across + along, -across + along], axis=1)
    vertices = (leaves.position[:, None] + corners).reshape(-1, 3)
    columns = {name: np.repeat(values, 4, axis=0) for name, values in leaves._scalars().items()}
    uv = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (len(leaves), 1))
    faces = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 4)
    normals = np.repeat(n, 4, axis=0)
    if not textured:
        return MeshPart("leaves", vertices, faces, normals, uv, columns)
    # Leaves of one tree are not of one green.
    shade = (0.75 + 0.25 * (leaves.label % 1024 / 1024)).astype(np.float32)
    colors = np.repeat(np.repeat(shade[:, None], 3, axis=1), 4, axis=0)
    return MeshPart("leaves", vertices, faces, normals, uv, columns, colors, leaf_material())


def _points(leaves: Any) -> MeshPart:
    return MeshPart("leaves", leaves.position, None, leaves.normal, None, {"size": leaves.size, **leaves._scalars()})

"""Meshes of quadrilaterals. Public as `pleinair.plants`.

Catmull-Clark subdivision of a control mesh, and the nearest square of a quadrilateral.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import plants_square, plants_subdivide
from .._support.inputs import Aligned, Array, array, integer, shape_text

Floats = NDArray[np.float64]


def freeze(*arrays: Array | None) -> None:
    """Make arrays read-only."""
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
class Mesh(Aligned):
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
        super().__setstate__(state)
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
    """Return the mesh of the arrays that the core gives."""
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
    return mesh_of(plants_subdivide(at, quads, integer(levels, "levels", 0, 10)))


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
    out = plants_square(at.tolist())
    if out is None:
        msg = "quad spans no area"
        raise ValueError(msg)
    return np.array(out)

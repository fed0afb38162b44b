"""Cube maps of a sky, and their faces laid out in one picture. Public as `pleinair.exports`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.inputs import choice, integer, linear_light, shape_text
from .environment import _Y_UP, _float32

# Table 8.19 of the OpenGL 4.6 specification: centre of a face, then where s and t grow. y up.
_FACES = np.array(
    [
        [[+1, 0, 0], [0, 0, -1], [0, -1, 0]],
        [[-1, 0, 0], [0, 0, +1], [0, -1, 0]],
        [[0, +1, 0], [+1, 0, 0], [0, 0, +1]],
        [[0, -1, 0], [+1, 0, 0], [0, 0, -1]],
        [[0, 0, +1], [+1, 0, 0], [0, -1, 0]],
        [[0, 0, -1], [-1, 0, 0], [0, -1, 0]],
    ],
    dtype=float,
)


def cube_map(sky: Any, size: int) -> NDArray[np.float32]:
    """Return the six faces of a cube map, as OpenGL, Vulkan and Direct3D address them.

    In the engines' frame (X east, Y up, Z south) the faces look at +X, -X, +Y, -Y, +Z, -Z: east, west, up, down, south,
    north. With s to the right and t down, both from -1 to 1 over a face, pixels are at their centres and look at

    | face | 0: +X | 1: -X | 2: +Y | 3: -Y | 4: +Z | 5: -Z |
    |---|---|---|---|---|---|---|
    | (X, Y, Z) | (1, -t, -s) | (-1, -t, s) | (s, 1, t) | (s, -1, -t) | (s, -t, 1) | (-s, -t, -1) |

    so a face is the mirror image of what a viewer inside the cube sees, as everywhere in OpenGL.

    Parameters
    ----------
    sky : sky
        Its `radiance` is asked.
    size : int
        Edge of a face, in [1, 16384] [px].

    Returns
    -------
    ndarray (6, size, size, 3) of float32
        Radiance in the sky's unit, row 0 at t = -1.

    Raises
    ------
    ValueError, TypeError
        `size` is out of range, or `sky` is no sky.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> sky = SimpleNamespace(radiance=lambda directions: directions)  # shows its directions: east, north, up
    >>> cube_map(sky, 1)[:, 0, 0].astype(int).tolist()
    [[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, 1, 0]]
    """
    size = integer(size, "size", 1, 16384)
    s = (2 * np.arange(size) + 1) / size - 1
    out = np.empty((6, size, size, 3), np.float32)
    for face, axes in zip(out, _FACES @ _Y_UP, strict=True):
        directions = axes[0] + s[:, None] * axes[1] + s[:, None, None] * axes[2]
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        face[:] = _float32(sky, "radiance", directions, (size, size, 3))
    return out


# Row by row the faces of a layout; None is black. The lowest face of the tall cross stands on its head.
_LAYOUTS: dict[str, list[list[int | None]]] = {
    "strip": [[0, 1, 2, 3, 4, 5]],
    "cross": [[None, 2, None, None], [1, 4, 0, 5], [None, 3, None, None]],
    "tall cross": [[None, 2, None], [1, 4, 0], [None, 3, None], [None, 5, None]],
}


def cube_layout(faces: ArrayLike, kind: str = "strip") -> NDArray[np.float32]:
    """Lay the faces of a cube map out in one picture.

    Parameters
    ----------
    faces : array_like (6, size, size, 3)
        What `cube_map` returns.
    kind : str
        "strip": +X, -X, +Y, -Y, +Z, -Z from left to right, 6 x 1 faces. "cross", 4 x 3 faces: -X, +Z, +X, -Z in the
        middle, +Y above and -Y below +Z. "tall cross", 3 x 4 faces: -X, +Z, +X, above and below the same, and -Z at the
        bottom, turned by 180°. Neighbours in a cross are neighbours on the cube.

    Returns
    -------
    ndarray (height, width, 3) of float32
        The picture; what belongs to no face is 0.

    Raises
    ------
    ValueError, TypeError
        `faces` is no cube map, or `kind` is none of the three.

    Examples
    --------
    >>> cube_layout(np.zeros((6, 8, 8, 3)), "cross").shape
    (24, 32, 3)
    """
    cube = linear_light(faces, "faces")
    if cube.ndim != 4 or cube.shape[0] != 6 or cube.shape[1] != cube.shape[2] or cube.shape[3] != 3 or cube.size == 0:
        msg = f"faces must have shape (6, size, size, 3), got {shape_text(cube.shape)}"
        raise ValueError(msg)
    rows = _LAYOUTS[choice(kind, "kind", tuple(_LAYOUTS))]
    n = cube.shape[1]
    out = np.zeros((n * len(rows), n * len(rows[0]), 3), np.float32)
    for i, row in enumerate(rows):
        for j, face in enumerate(row):
            if face is not None:
                turn = -1 if i == 3 else 1
                out[i * n : i * n + n, j * n : j * n + n] = cube[face, ::turn, ::turn]
    return out

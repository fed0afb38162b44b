"""A skydome: a hemisphere of triangles with the colours of a sky. Public as `pleinair.exports`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import Array, choice, integer, real
from ..color import srgb_encode
from ..io import MeshPart, PathLike, write_mesh
from .environment import _float32


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a colour at every vertex.

    Attributes
    ----------
    vertices : ndarray (n, 3) of float32
        Positions: x east, y north, z up [m].
    faces : ndarray (m, 3) of int32
        Vertices of the triangles, counterclockwise as seen from the side that is shown.
    colors : ndarray (n, 3) of float32
        Linear light, Rec. 709.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    colors: NDArray[np.float32]

    def write(self, path: PathLike, *, colors: str = "float", up: str = "z") -> Path:
        """Write the mesh; the ending names the format.

        Parameters
        ----------
        path : path
            .ply: binary, little endian, properties x y z red green blue. .obj: lines `v x y z r g b`. .glb: COLOR_0.
        colors : str
            "float": linear light as it is. "uchar": sRGB clipped to [0, 1]; bytes in .ply, numbers in [0, 1] in .obj. A
            .glb has linear colours either way, in [0, 1]: those of a brighter sky are divided by the `color_scale` in the
            mesh's extras.
        up : {"z", "y"}
            Which axis is up in .ply and .obj, as their first lines say; .glb is y up.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            The ending or `colors` is none of these.

        Examples
        --------
        >>> import tempfile, pathlib
        >>> mesh = Mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32), np.eye(3, dtype=np.float32))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     print(mesh.write(pathlib.Path(folder) / "a.obj").read_text())
        # pleinair mesh, z up
        o mesh
        v 1 0 0 1 0 0
        v 0 1 0 0 1 0
        v 0 0 1 0 0 1
        f 1 2 3
        """
        encoded = choice(colors, "colors", ("float", "uchar")) == "uchar"
        shown: Array = self.colors
        if encoded:
            shown = np.rint(255 * srgb_encode(np.clip(self.colors, 0, 1))).astype(np.uint8)
        part = MeshPart("mesh", self.vertices, self.faces.astype(np.uint32), colors=shown)
        return write_mesh(path, [part], {"name": "mesh"}, up=up)


def skydome(sky: Any, rings: int = 64, radius: float = 1.0) -> Mesh:
    """Return a closed sphere around the origin that shows the sky to a viewer inside.

    Parameters
    ----------
    sky : sky
        Its `radiance` is asked in the direction of every vertex.
    rings : int
        Bands of faces from the zenith to the nadir, in [2, 4096] [1]; there are twice as many around.
    radius : float
        Of the sphere, above 0 [m].

    Returns
    -------
    Mesh
        2 + 2 rings (rings - 1) vertices; every edge belongs to two triangles, whose normals point inwards.

    Raises
    ------
    ValueError, TypeError
        A value is out of range, or `sky` is no sky.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> mesh = skydome(SimpleNamespace(radiance=lambda directions: np.ones_like(directions)), rings=8)
    >>> mesh.vertices.shape, mesh.faces.shape
    ((114, 3), (224, 3))
    """
    rings = integer(rings, "rings", 2, 4096)
    around = 2 * rings
    radius = real(radius, "radius", math.ulp(0.0), math.inf, "m")
    from_zenith = np.pi * np.arange(1, rings)[:, None] / rings
    azimuth = 2 * np.pi * np.arange(around) / around
    flat = np.sin(from_zenith)
    bands = np.stack(np.broadcast_arrays(flat * np.sin(azimuth), flat * np.cos(azimuth), np.cos(from_zenith)), axis=-1)
    directions = np.concatenate([[[0.0, 0, 1]], bands.reshape(-1, 3), [[0.0, 0, -1]]])
    index = 1 + np.arange(bands[..., 0].size).reshape(rings - 1, around)
    right = np.roll(index, -1, axis=1)  # towards growing azimuth, which is to the right for the viewer inside
    a, b, c, d = index[:-1], right[:-1], index[1:], right[1:]
    top, bottom = np.zeros(around, int), np.full(around, len(directions) - 1)
    faces = [(top, index[0], right[0]), (a, c, d), (a, d, b), (bottom, right[-1], index[-1])]
    return Mesh(
        (radius * directions).astype(np.float32),
        np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in faces]).astype(np.int32),
        _float32(sky, "radiance", directions, directions.shape),
    )

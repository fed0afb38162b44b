"""Surfaces and the particles scattered over them. Public as `pleinair.plants`.

Heightfields, meshes and NURBS, sampled in strata.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import (
    plants_blend,
    plants_by_area,
    plants_carry,
    plants_grid_faces,
    plants_normals,
    plants_nurbs,
    plants_on_grid,
    plants_scatter,
)
from .._support.docs import documented
from .._support.inputs import Aligned, array, instance, integer, key, real, several, shape_text
from ..io import MeshPart, PathLike, write_mesh
from .mesh import Floats, freeze, indices
from .strata import Strata
from .tree_params import size_of


@dataclass(frozen=True, eq=False, repr=False)
class Particles(Aligned):
    """Strokes on a surface, one element of each array for each.

    Each is bound to its place: `on` moves all of them to a deformed surface.

    Attributes
    ----------
    position : ndarray (n, 3) of float64
        x east, y north, z up [m].
    normal : ndarray (n, 3) of float64
        Unit, of the surface (the aggregate normal).
    random_normal : ndarray (n, 3) of float64
        Unit, uniform on the sphere; see `normals`.
    height : ndarray (n,) of float64
        0 lowest to 1 highest [1].
    size : ndarray (n, 2) of float32
        Width and height [m].
    fade : ndarray (n, 2) of float32
        Distances at which it begins to fade and is gone; (2, 3) never does [1].
    label : ndarray (n,) of uint32
        Random, the particle's own.
    uv : ndarray (n, 2) of float64
        Place in the unit square: parameters of a NURBS surface or a heightfield; on a mesh the cell and the place in it.
    face : ndarray (n,) of uint32
        Triangle of the surface; of a NURBS surface the cell.
    barycentric : ndarray (n, 3) of float64
        Weights of the triangle's corners; of a NURBS surface zero.
    displacement : float
        Largest way along the normal [m].
    """

    position: Floats
    normal: Floats
    random_normal: Floats
    height: Floats
    size: NDArray[np.float32]
    fade: NDArray[np.float32]
    label: NDArray[np.uint32]
    uv: Floats
    face: NDArray[np.uint32]
    barycentric: Floats
    displacement: float
    _like: tuple[Any, ...] = ()

    def __post_init__(self) -> None:
        freeze(*(v for v in vars(self).values() if isinstance(v, np.ndarray)))

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self.__post_init__()

    def __len__(self) -> int:
        return len(self.position)

    def __repr__(self) -> str:
        return f"Particles({len(self)})"

    @property
    def detail(self) -> NDArray[np.bool_]:
        """Which may fade, (n,) of bool.

        Examples
        --------
        >>> bool(Surface.heightfield(np.zeros((2, 2))).emit(Strata(fade_from=1), rng=1).detail.any())
        False
        """
        return self.fade[:, 0] < 2

    def normals(self, share: float = 0.3) -> Floats:
        """Return normals for lighting, between the surface's and the random ones.

        Parameters
        ----------
        share : float
            Of the random normal, in [0, 1] [1]; 0 gives the surface's own.

        Returns
        -------
        ndarray (n, 3) of float64
            Unit vectors.

        Raises
        ------
        ValueError, TypeError
            `share` is out of range.

        Notes
        -----
        Peterson and Lee (2006), corot paper IV.7.

        Examples
        --------
        >>> particles = Surface.heightfield(np.zeros((2, 2))).emit(rng=1)
        >>> particles.normals(0)[0].tolist()
        [0.0, 0.0, 1.0]
        """
        return plants_blend(self.normal, self.random_normal, real(share, "share", 0, 1)).reshape(-1, 3)

    def on(self, surface: Surface) -> Particles:
        """Return the particles where a deformed surface carries them.

        Parameters
        ----------
        surface : Surface
            With as many faces, if triangulated; a NURBS surface for particles of one.

        Returns
        -------
        Particles
            Places, heights, labels and sizes are the same; positions and normals the surface's.

        Raises
        ------
        ValueError, TypeError
            The surface is of another make.

        Examples
        --------
        >>> flat = Surface.heightfield(np.zeros((3, 3)))
        >>> raised = Surface.heightfield(np.full((3, 3), 5.0))
        >>> particles = flat.emit(rng=1)
        >>> bool(np.allclose(particles.on(raised).position, particles.position + [0, 0, 5]))
        True
        """
        instance(surface, "surface", Surface)
        if surface._like() != self._like:
            msg = f"surface must be a {' of '.join(map(str, self._like))} faces, got {surface!r}"
            raise ValueError(msg)
        position, normal = surface._place(self.uv, self.face, self.barycentric, self.height, self.displacement)
        return dataclasses.replace(self, position=position, normal=normal)


@dataclass(frozen=True)
class _Nurbs:
    points: Floats
    weights: Floats
    knots: tuple[list[float], list[float]]
    degree: tuple[int, int]


class Surface(Aligned):
    """A surface that strokes are scattered on: use `heightfield`, `mesh` or `nurbs`.

    Attributes
    ----------
    kind : str
        "heightfield", "mesh" or "nurbs".
    vertices : ndarray (n, 3) of float64
        Of the triangles; of a NURBS surface none [m].
    faces : ndarray (m, 3) of uint32
        Triangles, counter-clockwise seen from outside.
    normals : ndarray (n, 3) of float64
        Unit, of the vertices.
    """

    kind: str
    vertices: Floats
    faces: NDArray[np.uint32]
    normals: Floats
    _grid: tuple[int, int] | None
    _lattice: tuple[tuple[float, float], tuple[float, float, float]] | None
    _nurbs: _Nurbs | None

    def __init__(self) -> None:
        msg = "use Surface.heightfield, Surface.mesh or Surface.nurbs"
        raise TypeError(msg)

    @classmethod
    def _of(cls, kind: str, vertices: Floats, faces: NDArray[np.uint32], **rest: Any) -> Surface:
        out = object.__new__(cls)
        out.kind, out.vertices, out.faces = kind, vertices, faces
        out.normals = plants_normals(vertices, faces).reshape(-1, 3)
        out._grid, out._nurbs, out._lattice = rest.get("grid"), rest.get("nurbs"), rest.get("lattice")
        freeze(out.vertices, out.faces, out.normals)
        return out

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        freeze(self.vertices, self.faces, self.normals)

    def __repr__(self) -> str:
        if self._nurbs is not None:
            return f"Surface.nurbs(points={shape_text(self._nurbs.points.shape)}, degree={self._nurbs.degree})"
        return f"Surface.{self.kind}({len(self.vertices)} vertices, {len(self.faces)} faces)"

    def _like(self) -> tuple[Any, ...]:
        return ("NURBS surface",) if self._nurbs is not None else ("surface", len(self.faces))

    def arguments(self) -> dict[str, Any]:
        """Return what makes this surface again: arguments of `heightfield`, `mesh` or `nurbs`, whichever is its `kind`.

        Examples
        --------
        >>> flat = Surface.heightfield(np.zeros((3, 4)), spacing=2.0)
        >>> Surface.heightfield(**flat.arguments())
        Surface.heightfield(12 vertices, 12 faces)
        """
        if self._nurbs is not None:
            made = self._nurbs
            return {"points": made.points, "weights": made.weights, "knots": made.knots, "degree": made.degree}
        if self._lattice is not None and self._grid is not None:
            spacing, origin = self._lattice
            return {"z": self.vertices[:, 2].reshape(self._grid), "spacing": spacing, "origin": origin}
        return {"vertices": self.vertices, "faces": self.faces}

    @classmethod
    def heightfield(cls, z: ArrayLike, spacing: Any = 1.0, origin: ArrayLike = (0.0, 0.0, 0.0)) -> Surface:
        """Return a surface from heights on a grid.

        Parameters
        ----------
        z : array_like (ny, nx)
            Heights, at least 2 × 2, finite: rows run north, columns east [m].
        spacing : float or (float, float)
            Between columns and between rows, above 0 [m].
        origin : array_like (3,)
            Place of z[0, 0] at height 0 [m].

        Returns
        -------
        Surface
            Each cell is two triangles, split from its south-west to its north-east corner.

        Raises
        ------
        ValueError, TypeError
            A height is not finite, or the shape or spacing wrong.

        Examples
        --------
        >>> Surface.heightfield(np.zeros((3, 4)), spacing=2.0)
        Surface.heightfield(12 vertices, 12 faces)
        """
        heights = array(z, "z", dtypes=(np.float64,), ndim=2)
        if min(heights.shape) < 2:
            msg = f"z must be at least 2 × 2, got shape {shape_text(heights.shape)}"
            raise ValueError(msg)
        if not np.isfinite(heights).all():
            msg = "z must be finite"
            raise ValueError(msg)
        dx, dy = size_of(spacing, "spacing", "m")
        for step in (dx, dy):
            real(step, "spacing", 1e-9, 1e9, "m")
        at = array(origin, "origin", dtypes=(np.float64,))
        if at.shape != (3,) or not np.isfinite(at).all():
            msg = f"origin must be three finite numbers, got {at.tolist()}"
            raise ValueError(msg)
        ny, nx = heights.shape
        vertices = np.empty((ny, nx, 3))
        vertices[..., 0] = at[0] + dx * np.arange(nx)
        vertices[..., 1] = at[1] + dy * np.arange(ny)[:, None]
        vertices[..., 2] = at[2] + heights
        faces = plants_grid_faces(ny, nx).reshape(-1, 3)
        lattice = (float(dx), float(dy)), (float(at[0]), float(at[1]), 0.0)
        return cls._of("heightfield", vertices.reshape(-1, 3), faces, grid=(ny, nx), lattice=lattice)

    @classmethod
    def mesh(cls, vertices: ArrayLike, faces: ArrayLike) -> Surface:
        """Return a surface from a mesh.

        Parameters
        ----------
        vertices : array_like (n, 3)
            Corners, finite [m].
        faces : array_like (m, 3) or (m, 4) of int
            Indices of corners, counter-clockwise seen from outside; quadrilaterals become two triangles.

        Returns
        -------
        Surface
            Particles are scattered evenly over its area.

        Raises
        ------
        ValueError, TypeError
            An index points nowhere, or a coordinate is not finite.

        Examples
        --------
        >>> Surface.mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
        Surface.mesh(4 vertices, 2 faces)
        """
        at = array(vertices, "vertices", dtypes=(np.float64,), ndim=2, last=3).copy()
        found = indices(faces, "faces", (3, 4), len(at)).copy()
        if found.shape[1] == 4:
            found = found[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        return cls._of("mesh", at, found)

    @classmethod
    def nurbs(cls, points: ArrayLike, weights: ArrayLike | None = None, knots: Any = None, degree: Any = 3) -> Surface:
        """Return a NURBS surface.

        Parameters
        ----------
        points : array_like (nu, nv, 3)
            Control points [m].
        weights : array_like (nu, nv), optional
            Above 0 [1]; 1 if there are none.
        knots : (array_like, array_like), optional
            Along u and v, not descending: as many as points, and degree + 1 more [1]. Clamped and even if there are none.
        degree : int or (int, int)
            Along u and v, in [1, 15] [1].

        Returns
        -------
        Surface
            Its unit square is the range of the parameters.

        Raises
        ------
        ValueError, TypeError
            There are too few points for the degree, the knots do not fit, or a number is not finite.

        Notes
        -----
        Piegl and Tiller, The NURBS Book; checked against geomdl and scipy.

        Examples
        --------
        >>> hill = Surface.nurbs([[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 2]]], degree=1)
        >>> hill.at([[0.5, 0.5]])[0].tolist()
        [[0.5, 0.5, 0.5]]
        """
        at = array(points, "points", dtypes=(np.float64,), ndim=3, last=3).copy()
        nu, nv = at.shape[:2]
        heavy = np.ones((nu, nv)) if weights is None else array(weights, "weights", dtypes=(np.float64,), ndim=2).copy()
        if heavy.shape != (nu, nv):
            msg = f"weights must have shape ({nu}, {nv}), got {shape_text(heavy.shape)}"
            raise ValueError(msg)
        both = several(degree, "degree") if hasattr(degree, "__len__") else (degree, degree)
        if len(both) != 2:
            msg = f"degree must be an integer or two, got {degree!r}"
            raise ValueError(msg)
        p, q = (integer(d, "degree", 1, 15) for d in both)
        if knots is None:
            pair = [np.r_[np.zeros(d), np.linspace(0, 1, max(n - d + 1, 2)), np.ones(d)] for n, d in ((nu, p), (nv, q))]
        else:
            pair = [
                array(k, f"knots[{i}]", dtypes=(np.float64,), ndim=1) for i, k in enumerate(several(knots, "knots"))
            ]
            if len(pair) != 2:
                msg = f"knots must be two sequences, got {len(pair)}"
                raise ValueError(msg)
        freeze(at, heavy)
        made = _Nurbs(at, heavy, (pair[0].tolist(), pair[1].tolist()), (p, q))
        out = cls._of("nurbs", np.zeros((0, 3)), np.zeros((0, 3), np.uint32), nurbs=made)
        out.at([[0.5, 0.5]])  # refuses what is no surface
        return out

    def at(self, uv: ArrayLike) -> tuple[Floats, Floats]:
        """Return points and normals at places of the unit square.

        Parameters
        ----------
        uv : array_like (n, 2)
            In [0, 1]: u along the columns and v along the rows of a heightfield, the parameters of a NURBS surface [1].

        Returns
        -------
        points, normals : ndarray (n, 3) of float64
            Places [m] and unit normals. At a pole of a NURBS surface the normal is its limit.

        Raises
        ------
        ValueError, TypeError
            A place is outside the square; the surface is a mesh, which has none.

        Examples
        --------
        >>> points, normals = Surface.heightfield([[0, 1], [0, 1]]).at([[0.25, 0.5]])
        >>> points.tolist()
        [[0.25, 0.5, 0.25]]
        """
        places = array(uv, "uv", dtypes=(np.float64,), ndim=2, last=2)
        if not ((places >= 0) & (places <= 1)).all():
            msg = "uv must be in [0, 1] [1]"
            raise ValueError(msg)
        if self._grid is None and self._nurbs is None:
            msg = "a mesh has no parameters: only heightfields and NURBS surfaces have"
            raise ValueError(msg)
        face, weights = self._bind(places, (1, 1))
        return self._place(places, face, weights, np.full(len(places), 0.5), 0.0)

    @documented
    def emit(self, strata: Strata | None = None, rng: Any = None) -> Particles:
        """Strew particles.

        Parameters
        ----------
        strata : Strata, optional
            How many, how large, how high.
        {rng}

        Returns
        -------
        Particles
            `spans[0] * spans[1] * count` of them: exactly `count` in each cell of the unit square, u-cells outermost. A
            mesh is cut into as many pieces of equal area instead.

        Raises
        ------
        ValueError, TypeError
            There would be more than 2²⁶, or a mesh has no area.

        Notes
        -----
        The corot paper, IV.7.

        Examples
        --------
        >>> len(Surface.heightfield(np.zeros((2, 2))).emit(Strata(spans=(4, 3), count=2), rng=1))
        24
        """
        how = Strata() if strata is None else instance(strata, "strata", Strata)
        uv, height, random, size, fade, label = plants_scatter(how, key(rng))
        uv = uv.reshape(-1, 2)
        face, weights = self._bind(uv, how.spans)
        reach = how.displacement * how.unit
        position, normal = self._place(uv, face, weights, height, reach)
        return Particles(
            position,
            normal,
            random.reshape(-1, 3),
            height,
            size.reshape(-1, 2),
            fade.reshape(-1, 2),
            label,
            uv,
            face,
            weights,
            reach,
            self._like(),
        )

    def tessellated(self, spans: Any = (32, 32)) -> Surface:
        """Return a triangulated surface: what casts the shadow of the strokes.

        Parameters
        ----------
        spans : (int, int)
            Cells along u and v of a NURBS surface, each in [1, 10000] [1]; others are returned as they are.

        Returns
        -------
        Surface
            A mesh.

        Raises
        ------
        ValueError, TypeError
            `spans` is out of range.

        Examples
        --------
        >>> Surface.nurbs([[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]], degree=1).tessellated((2, 2))
        Surface.mesh(9 vertices, 8 faces)
        """
        if self._nurbs is None:
            return self
        nu, nv = (integer(n, "spans", 1, 10_000) for n in several(spans, "spans"))
        u, v = np.meshgrid(np.linspace(0, 1, nu + 1), np.linspace(0, 1, nv + 1))
        points, _ = self.at(np.stack([u.ravel(), v.ravel()], axis=-1))
        return Surface._of("mesh", points, plants_grid_faces(nv + 1, nu + 1).reshape(-1, 3))

    def export(self, path: PathLike, *, up: str = "z") -> Any:
        """Write the triangles to a file, beside its place and renamed.

        Parameters
        ----------
        path : path
            `.glb`, `.ply` or `.obj`.
        up : {"z", "y"}
            Which axis is up in .ply and .obj, as their first lines say; .glb is y up.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            The ending is none of these.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Surface.heightfield(np.zeros((2, 2))).export(f"{folder}/ground.ply").name
        'ground.ply'
        """
        solid = self.tessellated()
        about = {"name": "surface", "kind": self.kind}
        return write_mesh(path, [MeshPart("surface", solid.vertices, solid.faces, solid.normals)], about, up=up)

    def _bind(self, uv: Floats, spans: tuple[int, int]) -> tuple[NDArray[np.uint32], Floats]:
        if self._nurbs is not None:
            cells = np.minimum(uv * spans, np.array(spans) - 1).astype(np.uint32)
            return cells[:, 0] * np.uint32(spans[1]) + cells[:, 1], np.zeros((len(uv), 3))
        if self._grid is not None:
            face, weights = plants_on_grid(uv, *self._grid)
        else:
            face, weights = plants_by_area(uv, spans, self.vertices, self.faces)
        return face, weights.reshape(-1, 3)

    def _place(
        self, uv: Floats, face: NDArray[np.uint32], weights: Floats, height: Floats, reach: float
    ) -> tuple[Floats, Floats]:
        if self._nurbs is not None:
            n = self._nurbs
            shape = (n.points.shape[0], n.points.shape[1])
            parts = plants_nurbs(n.points, n.weights, shape, n.degree, n.knots, uv, height, reach)
        else:
            parts = plants_carry(self.vertices, self.normals, self.faces, face, weights, height, reach)
        return parts[0].reshape(-1, 3), parts[1].reshape(-1, 3)

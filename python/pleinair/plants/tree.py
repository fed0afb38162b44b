"""Procedural trees. Public as `pleinair.plants`.

A skeleton of trunk and branches, the control mesh around it and particles of leaves, grown from parameters and seeds.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import TreeSkeleton, plants_leaf_attributes
from .._support.inputs import (
    Aligned,
    Array,
    array,
    choice,
    flag,
    generator,
    instance,
    integer,
    key,
    several,
    shape_text,
)
from ..io import PathLike, write_mesh
from .mesh import Mesh, freeze, mesh_of
from .tree_export import light_mesh, tree_parts
from .tree_params import LeafParams, TreeParams

# What dresses leaves without moving them.
_LOOKS = (
    "center",
    "size",
    "variance",
    "inside_growth",
    "fades",
    "bias",
    "threshold_sigma",
    "fade_length",
    "fade_min",
    "outer",
)


@dataclass(frozen=True, eq=False, repr=False)
class Leaves(Aligned):
    """Leaves of a tree as particles, one element of each array for each.

    Attributes
    ----------
    position : ndarray (n, 3) of float64
        x east, y north, z up from the foot of the tree [m].
    normal : ndarray (n, 3) of float64
        Unit: the way the chain grew, but for its droop.
    size : ndarray (n, 2) of float32
        Width and height [m].
    label : ndarray (n,) of uint32
        Random, the particle's own; over 2³² it is the thesis' number between 0 and 1.
    id : ndarray (n,) of int64
        Random, the particle's own: the same leaf keeps it when other leaves come or go.
    branch_id : ndarray (n,) of uint32
        Stem it belongs to: 0 the trunk, then the branches.
    order : ndarray (n,) of uint16
        Place in its chain, from 0.
    branch_distance : ndarray (n,) of float32
        Along its chain from the vertex it sprouts from [m].
    branch_ratio : ndarray (n,) of float32
        The same over its largest, in [0, 1] [1].
    center_distance : ndarray (n,) of float32
        From the centre of the tree [m].
    center_ratio : ndarray (n,) of float32
        The same from 0 at the nearest to 1 at the farthest [1].
    fade : ndarray (n, 2) of float32
        Distances, 0 near and 1 far, at which it begins to fade and is gone; (2, 3) never does [1].
    center : tuple of float
        Centre of the tree [m].
    """

    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    size: NDArray[np.float32]
    label: NDArray[np.uint32]
    id: NDArray[np.int64]
    branch_id: NDArray[np.uint32]
    order: NDArray[np.uint16]
    branch_distance: NDArray[np.float32]
    branch_ratio: NDArray[np.float32]
    center_distance: NDArray[np.float32]
    center_ratio: NDArray[np.float32]
    fade: NDArray[np.float32]
    center: tuple[float, float, float]
    _params: LeafParams = field(default_factory=LeafParams)
    _unit: float = 1.0

    def __post_init__(self) -> None:
        freeze(*(getattr(self, name) for name in _COLUMNS))

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self.__post_init__()

    def __len__(self) -> int:
        return len(self.position)

    def __repr__(self) -> str:
        return f"Leaves({len(self)})"

    def table(self) -> Array:
        """Return the columns as a structured array.

        Returns
        -------
        ndarray (n,)
            With a field for each column.

        Examples
        --------
        >>> Tree.grow(TreeParams(), rng=1).leaves.table()["position"].shape[1]
        3
        """
        columns = {name: getattr(self, name) for name in _COLUMNS}
        out = np.empty(len(self), [(name, a.dtype, a.shape[1:]) for name, a in columns.items()])
        for name, values in columns.items():
            out[name] = values
        return out

    def select(self, which: Any) -> Leaves:
        """Return some of the leaves.

        Parameters
        ----------
        which : array_like
            A mask (n,) of bool, or indices.

        Returns
        -------
        Leaves
            With ratios and fades as they were.

        Raises
        ------
        ValueError, TypeError
            `which` is neither, or points nowhere.

        Examples
        --------
        >>> leaves = Tree.grow(TreeParams(), rng=1).leaves
        >>> bool((leaves.select(leaves.center_ratio < 0.5).center_ratio < 0.5).all())
        True
        """
        pick = np.asarray(which)
        if pick.dtype != np.bool_ and pick.dtype.kind not in "ui":
            msg = f"which must be a mask or indices, got dtype {pick.dtype}"
            raise TypeError(msg)
        if pick.dtype == np.bool_ and pick.shape != (len(self),):
            msg = f"which must have shape ({len(self)},), got {shape_text(pick.shape)}"
            raise ValueError(msg)
        try:
            return dataclasses.replace(self, **{name: getattr(self, name)[pick] for name in _COLUMNS})
        except IndexError as error:
            msg = f"which: {error}"
            raise ValueError(msg) from None

    def restyled(self, **changes: Any) -> Leaves:
        """Return the same leaves with other sizes, another centre or other fades; none moves.

        Parameters
        ----------
        **changes : Any
            Of `LeafParams`: center, size, variance, inside_growth, fades, bias, threshold_sigma, fade_length, fade_min,
            outer.

        Returns
        -------
        Leaves
            Positions, normals, labels and ids are the same bits.

        Raises
        ------
        ValueError, TypeError
            A parameter would move leaves, is unknown or out of range.

        Examples
        --------
        >>> leaves = Tree.grow(TreeParams(), rng=1).leaves
        >>> bool((leaves.restyled(size=0.1).position == leaves.position).all())
        True
        """
        for name in changes:
            choice(name, "changes", _LOOKS)
        params = dataclasses.replace(self._params, **changes)
        return _dressed({name: getattr(self, name) for name in _BODY}, params, self._unit)

    def proxies(self) -> Mesh:
        """Return an octahedron for each leaf, as wide as it: a preview for modellers, never to be rendered.

        Returns
        -------
        Mesh
            Three quadrilaterals through each centre, which show it from every side.

        Examples
        --------
        >>> leaves = Tree.grow(TreeParams(), rng=1).leaves
        >>> len(leaves.proxies().quads) == 3 * len(leaves)
        True
        """
        half = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
        cards = [(half[a], half[b]) for a, b in ((0, 1), (1, 2), (2, 0))]
        corners = np.array([[u, v, -u, -v] for u, v in cards]).reshape(12, 3)
        radius = 0.5 * self.size.mean(axis=1, dtype=float)
        vertices = (self.position[:, None] + radius[:, None, None] * corners).reshape(-1, 3)
        quads = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 4)
        normals = np.repeat(np.array([np.cross(u, v) for u, v in cards]), 4, axis=0)
        return mesh_of((vertices, quads, np.tile(normals, (len(self), 1))))

    def _scalars(self) -> dict[str, Array]:
        """Return every column but place, normal and size."""
        return {name: getattr(self, name) for name in _COLUMNS if name not in ("position", "normal", "size")}


_BODY = ("position", "normal", "label", "id", "branch_id", "order", "branch_distance")
_COLUMNS = (*_BODY, "size", "branch_ratio", "center_distance", "center_ratio", "fade")


def _dressed(body: dict[str, Array], params: LeafParams, unit: float) -> Leaves:
    dress = plants_leaf_attributes(body["position"], body["branch_distance"], body["id"], params, unit)
    (x, y, z), far, center_ratio, branch_ratio, size, fade = dress
    return Leaves(
        **body,
        size=size.reshape(-1, 2),
        branch_ratio=branch_ratio,
        center_distance=far,
        center_ratio=center_ratio,
        fade=fade.reshape(-1, 2),
        center=(x, y, z),
        _params=params,
        _unit=unit,
    )


@dataclass(frozen=True, repr=False)
class Tree:
    """A tree: use `Tree.grow`.

    The same parameters and seeds give the same bits, whatever the number of threads. What one part draws does not depend
    on the others: new seeds for the leaves leave trunk and branches as they are, new ones for the branches the trunk.

    Parameters
    ----------
    params : TreeParams
        Everything but chance.
    seeds : tuple of int
        For trunk, branches and leaves, each in [0, 2⁶⁴ − 1] [1].
    given : tuple or None
        Stems from elsewhere: use `Tree.from_stems`.

    Raises
    ------
    ValueError, TypeError
        The tree would be too large, or a seed is no 64-bit integer.

    Examples
    --------
    >>> tree = Tree.grow(TreeParams(), rng=1)
    >>> Tree(tree.params, tree.seeds) == tree
    True
    """

    params: TreeParams
    seeds: tuple[int, int, int]
    given: tuple[Any, ...] | None = None

    def __post_init__(self) -> None:
        instance(self.params, "params", TreeParams)
        given = several(self.seeds, "seeds")
        if len(given) != 3:
            msg = f"seeds must be three integers, got {given!r}"
            raise ValueError(msg)
        object.__setattr__(self, "seeds", tuple(integer(seed, "seeds", 0, 2**64 - 1) for seed in given))
        p, (trunk, branches, _) = self.params, self.seeds
        if self.given is None:
            grown = TreeSkeleton(p.trunk, p.branches, p.unit, trunk, branches)
        else:
            grown = TreeSkeleton.from_lines(self.given, p.unit)
        object.__setattr__(self, "_skeleton", grown)

    def __reduce__(self) -> tuple[Any, ...]:
        return Tree, (self.params, self.seeds, self.given)

    def __repr__(self) -> str:
        return f"Tree({self.params.name!r}, {len(self.stems) - 1} branches, seeds={self.seeds})"

    @classmethod
    def grow(cls, params: TreeParams | None = None, rng: Any = None) -> Tree:
        """Grow a tree.

        Parameters
        ----------
        params : TreeParams, optional
            Everything but chance; see also `preset`.
        rng : None, int, SeedSequence, BitGenerator or Generator
            Where the seeds of trunk, branches and leaves come from.

        Returns
        -------
        Tree
            With `trunk`, `leaves`, `lod`, `export`.

        Raises
        ------
        ValueError, TypeError
            The tree would be too large; an argument is of the wrong kind.

        Notes
        -----
        The corot paper, IV.3: a cube is extruded into a trunk, faces of the trunk into branches, and chains of particles
        sprout from the vertices.

        Examples
        --------
        >>> tree = Tree.grow(TreeParams(unit=0.5), rng=1)
        >>> tree.trunk.quads.shape[1], len(tree.leaves) > 1000
        (4, True)
        """
        params = TreeParams() if params is None else params
        trunk, branches, leaves = generator(rng).integers(0, 2**64, 3, np.uint64).tolist()
        return cls(params, (trunk, branches, leaves))

    @classmethod
    def from_stems(cls, stems: Any, params: TreeParams | None = None, rng: Any = None) -> Tree:
        """Return a tree with trunk and branches from elsewhere; only the leaves are ours.

        Parameters
        ----------
        stems : iterable of (points, widths) or (points, widths, level)
            Axes: points (k, 3) and widths (k,), at least two of them [unit]. The level is 0 for the first stem and 1 for
            others if there is none.
        params : TreeParams, optional
            Its leaves, unit and names count.
        rng : None, int, SeedSequence, BitGenerator or Generator
            Where the seed of the leaves comes from.

        Returns
        -------
        Tree
            Each stem a closed surface of its own.

        Raises
        ------
        ValueError, TypeError
            A stem has too few points, repeats one, or holds a number that is not finite.

        Examples
        --------
        >>> pole = ([[0, 0, 0], [0, 0, 1], [0, 0.2, 2]], [0.2, 0.15, 0.1])
        >>> len(Tree.from_stems([pole], rng=1).stems)
        1
        """
        lines = []
        for k, stem in enumerate(several(stems, "stems")):
            parts = several(stem, "stems")
            if len(parts) not in (2, 3):
                msg = f"stems must be (points, widths) or (points, widths, level), got {len(parts)} parts"
                raise ValueError(msg)
            points = array(parts[0], "stems points", dtypes=(np.float64,), ndim=2, last=3)
            widths = array(parts[1], "stems widths", dtypes=(np.float64,), ndim=1)
            level = integer(parts[2], "stems level", 0, 1000) if len(parts) == 3 else min(k, 1)
            lines.append((level, tuple(map(tuple, points.tolist())), tuple(widths.tolist())))
        if not lines:
            msg = "stems is empty"
            raise ValueError(msg)
        seed = key(rng)
        return cls(TreeParams() if params is None else params, (seed, seed, seed), tuple(lines))

    def regrow(self, *, trunk: Any = False, branches: Any = False, leaves: Any = False) -> Tree:
        """Return the tree with new seeds for some of its parts; the others keep theirs.

        Parameters
        ----------
        trunk, branches, leaves : rng or False
            What `grow` takes as `rng`; False keeps the seed.

        Returns
        -------
        Tree
            The sibling.

        Raises
        ------
        TypeError
            One is no `rng`.

        Examples
        --------
        >>> tree = Tree.grow(TreeParams(), rng=1)
        >>> bool((tree.regrow(leaves=2).trunk.vertices == tree.trunk.vertices).all())
        True
        """
        fresh = [
            seed if new is False else key(new) for seed, new in zip(self.seeds, (trunk, branches, leaves), strict=True)
        ]
        return Tree(self.params, (fresh[0], fresh[1], fresh[2]), self.given)

    @property
    def name(self) -> str:
        """Name of the tree.

        Examples
        --------
        >>> Tree.grow(TreeParams(name="poplar 3"), rng=1).name
        'poplar 3'
        """
        return self.params.name

    @property
    def kind(self) -> str:
        """Sort of the tree.

        Examples
        --------
        >>> Tree.grow(TreeParams(kind="poplar"), rng=1).kind
        'poplar'
        """
        return self.params.kind

    @property
    def id(self) -> float:
        """Random number of the tree in [0, 1) [1], from its seeds.

        Examples
        --------
        >>> 0 <= Tree.grow(TreeParams(), rng=1).id < 1
        True
        """
        return (self.seeds[0] ^ self.seeds[1] ^ self.seeds[2]) / 2**64 % 1.0

    @cached_property
    def trunk(self) -> Mesh:
        """Trunk and branches as one closed mesh, subdivided twice."""
        return self.lod(0)

    @cached_property
    def leaves(self) -> Leaves:
        """The leaves."""
        parts = self._skeleton.leaves(self.params.leaves, self.seeds[2])  # type: ignore[attr-defined]
        position, normal, far, order, stem, label, number = parts
        body = {
            "position": position.reshape(-1, 3),
            "normal": normal.reshape(-1, 3),
            "label": label,
            "id": number,
            "branch_id": stem,
            "order": order,
            "branch_distance": far,
        }
        return _dressed(body, self.params.leaves, self.params.unit)

    @cached_property
    def stems(self) -> Array:
        """Trunk and branches, a structured array.

        Fields level, parent (the stem it grows from), ring and side (of the face there; all 2³² − 1 for the trunk), and
        begin and end of its vertices in `lod(0, subdivisions=0)`.
        """
        raw = self._skeleton.stems().reshape(-1, 6)  # type: ignore[attr-defined]
        out = np.empty(len(raw), [(n, "u4") for n in ("level", "parent", "ring", "side", "begin", "end")])
        for k, name in enumerate(("level", "parent", "ring", "side")):
            out[name] = raw[:, k]
        out["begin"], out["end"] = 4 * raw[:, 4], 4 * (raw[:, 4] + raw[:, 5])
        freeze(out)
        return out

    @cached_property
    def rings(self) -> Array:
        """Sections of all stems in order, a structured array: four vertices each of `lod(0, subdivisions=0)`.

        Fields center [m], axis, along (from the stem's beginning [m]), and what was drawn for the step: length [unit],
        twist [°], taper [1], bend [°]; zero where nothing was extruded.
        """
        center, axis, along, steps = self._skeleton.rings()  # type: ignore[attr-defined]
        scalars = [(n, "f8") for n in ("along", "length", "twist", "taper", "bend")]
        out = np.empty(len(along), [("center", "f8", 3), ("axis", "f8", 3), *scalars])
        out["center"], out["axis"], out["along"] = center.reshape(-1, 3), axis.reshape(-1, 3), along
        for k, name in enumerate(("length", "twist", "taper", "bend")):
            out[name] = steps.reshape(-1, 4)[:, k]
        freeze(out)
        return out

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest corner of the box around trunk and leaves, (2, 3) [m].

        Examples
        --------
        >>> Tree.grow(TreeParams(), rng=1).bounds[0, 2] <= 0
        np.True_
        """
        low, high = self.lod(0, subdivisions=0).bounds
        if len(self.leaves):
            reach = 0.5 * self.leaves.size.max(axis=1, keepdims=True)
            low = np.minimum(low, (self.leaves.position - reach).min(axis=0))
            high = np.maximum(high, (self.leaves.position + reach).max(axis=0))
        return np.stack([low, high])

    def lod(self, level: int = 0, *, subdivisions: int | None = None) -> Mesh:
        """Return trunk and branches at a level of detail, all from one skeleton.

        Parameters
        ----------
        level : int
            In [0, 30] [1]: every 2^level-th ring of a stem, its first and last, and those that bear branches.
        subdivisions : int, optional
            Catmull-Clark steps, in [0, 6] [1]; 2, 1, 0 at levels 0, 1 and above. 0 gives what was extruded.

        Returns
        -------
        Mesh
            One closed surface.

        Raises
        ------
        ValueError, TypeError
            A number is out of range.

        Examples
        --------
        >>> tree = Tree.grow(TreeParams(), rng=1)
        >>> len(tree.lod(1).quads) < len(tree.lod(0).quads) / 4
        True
        """
        level = integer(level, "level", 0, 30)
        steps = max(2 - level, 0) if subdivisions is None else integer(subdivisions, "subdivisions", 0, 6)
        return mesh_of(self._skeleton.mesh(level, steps))  # type: ignore[attr-defined]

    def export(
        self,
        path: PathLike,
        *,
        level: int | None = None,
        leaves: str = "cards",
        proxies: bool = False,
        up: str = "z",
        triangles: bool = False,
    ) -> Path:
        """Write the tree to a file, beside its place and renamed.

        Parameters
        ----------
        path : path
            `.glb` (glTF 2.0, our z up turned to its y by a node; bark and leaves textured, parameters and seeds in the
            asset's extras), `.ply` (binary, double precision) or `.obj`.
        level : int, optional
            Of detail of the trunk, in [0, 30] [1]; by default the finest that has 8000 triangles at most.
        leaves : str
            "cards" (a rectangle for each leaf, facing along its normal), "points" (with every column; in `.ply` an
            element of its own) or "none".
        proxies : bool
            Whether to add an octahedron for each leaf.
        up : {"z", "y"}
            Which axis is up in .ply and .obj, as their first lines say; .glb is y up.
        triangles : bool
            Whether quadrilaterals are cut in .ply and .obj, for readers that take triangles alone (Mitsuba); .glb has
            triangles.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError, TypeError
            The ending is none of these; an argument is out of range.
        FileNotFoundError
            There is no such folder.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Tree.grow(TreeParams(), rng=1).export(f"{folder}/tree.glb").name
        'tree.glb'
        """
        choice(leaves, "leaves", ("cards", "points", "none"))
        mesh = light_mesh(self) if level is None else self.lod(level)
        textured = str(path).lower().endswith(".glb")
        parts = tree_parts(self, mesh, leaves, flag(proxies, "proxies"), textured)
        about = {"name": self.name, "kind": self.kind, "params": self.params.to_json(), "seeds": list(self.seeds)}
        return write_mesh(path, parts, about, up=up, triangles=triangles)

"""Objects of a scene: trees that stand somewhere, and grounds under strokes. Public as `pleinair.scene`."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import FieldsOnly, flag, instance, real, several, vector
from ..paint import Strokes, noise
from ..plants import Particles, Strata, Surface, Tree

# Size of its strokes, in the distances between them [1].
_COVERING = 2.6


@dataclass(frozen=True)
class Placed:
    """A tree that stands somewhere.

    Parameters
    ----------
    tree : Tree
        The tree.
    position : tuple of float
        Of its foot: x east, y north, z up [m].
    turn : float
        Counter-clockwise, seen from above [°].
    scale : float
        In [0.001, 1000] [1].
    name : str
        What `Scene.select` finds it by; a number is put behind it.

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Examples
    --------
    >>> from pleinair.plants import Tree, preset
    >>> Placed(Tree.grow(preset("shrub"), rng=1), (3, 20, 0)).position
    (3.0, 20.0, 0.0)
    """

    tree: Tree
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: float = 0.0
    scale: float = 1.0
    name: str = "tree"

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.tree, "tree", Tree)
        put(self, "position", vector(self.position, "position"))
        put(self, "turn", real(self.turn, "turn", -1e6, 1e6, "°"))
        put(self, "scale", real(self.scale, "scale", 1e-3, 1e3))
        instance(self.name, "name", str)

    def _moved(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        sin, cos = math.sin(math.radians(self.turn)), math.cos(math.radians(self.turn))
        turn = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        out: NDArray[np.float64] = np.asarray(x, np.float64) @ turn
        return out


@dataclass(frozen=True, eq=False)
class Ground(FieldsOnly):
    """A surface under strokes of one material: a meadow, a rock, water.

    Parameters
    ----------
    surface : Surface
        Where they are; its normals are on the side that is seen.
    material : str or sequence of str
        Of the style's; among several noise chooses, in equal shares (G9). Strokes of a reflective one have the colour of what
        they reflect, as if it were level.
    strata : Strata
        How strokes are scattered.
    rng : None, int or Generator
        Seed of where they are.
    casts : bool
        Whether the surface casts a shadow: a rock does. Its strokes only receive light (G8).
    undercoat : bool
        Whether the surface itself is painted under the strokes, opaque, so that nothing behind it shows through (G4).
    patch : float
        Size of the patches of several materials, in [1e-3, 1e6] [m].
    roughness : float
        Share of a random normal in the strokes' normals, in [0, 1] [1] (G6); water has waves of a tenth of it.
    name : str, optional
        What `Scene.select` finds it by, with a number behind it; by default the first material.

    Raises
    ------
    ValueError, TypeError
        A value is of the wrong kind.

    Examples
    --------
    >>> import numpy as np
    >>> hill = Surface.heightfield(np.zeros((4, 4)), spacing=10.0)
    >>> len(Ground(hill, "grass", Strata(spans=(3, 3), count=2), rng=1).particles)
    18
    """

    surface: Surface
    material: Any = "grass"
    strata: Strata = field(default_factory=Strata)
    rng: Any = None
    casts: bool = False
    undercoat: bool = True
    patch: float = 12.0
    roughness: float = 0.3
    name: str | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.surface, "surface", Surface)
        given = (self.material,) if isinstance(self.material, str) else several(self.material, "material")
        put(self, "material", tuple(dict.fromkeys(instance(one, "material", str) for one in given)))
        if not self.material:
            msg = "material must name at least one"
            raise ValueError(msg)
        instance(self.strata, "strata", Strata)
        flag(self.casts, "casts")
        flag(self.undercoat, "undercoat")
        put(self, "patch", real(self.patch, "patch", 1e-3, 1e6, "m"))
        put(self, "roughness", real(self.roughness, "roughness", 0, 1))
        put(self, "name", instance(self.material[0] if self.name is None else self.name, "name", str))

    @functools.cached_property
    def particles(self) -> Particles:
        """The strokes' places."""
        return self.surface.emit(self.strata, rng=self.rng)

    @functools.cached_property
    def strokes(self) -> dict[str, Strokes]:
        """The strokes by their material, the same in every frame."""
        return self._strokes(self.roughness)

    @functools.cached_property
    def ripples(self) -> dict[str, Strokes]:
        """The strokes as those of a reflective material lie: with waves of a tenth of the roughness."""
        return self._strokes(0.1 * self.roughness)

    def _strokes(self, roughness: float) -> dict[str, Strokes]:
        p = self.particles
        kinds = len(self.material)
        which = np.zeros(len(p), np.int64)
        if kinds > 1:
            # The edges of patches are broken up by each stroke's own chance.
            value = noise(0, p.position[:, :2] / self.patch) + 0.15 * (p.label / 2.0**32 - 0.5)
            which[np.argsort(value, kind="stable")] = np.arange(len(p)) * kinds // max(len(p), 1)
        normals = p.normals(roughness)
        out = {}
        for k, material in enumerate(self.material):
            of = which == k
            out[material] = Strokes(p.position[of], normals[of], p.size[of], p.label[of], material,
                                    center_ratio=p.height[of], fade=p.fade[of])  # fmt: skip
        return out

    @functools.cached_property
    def under(self) -> Strokes:
        """The surface itself: broad opaque strokes whose upper edges are its own."""
        solid = self.surface.tessellated()
        corners = solid.vertices[solid.faces.astype(np.int64)]
        area = (
            0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
        )
        # As many as to follow the surface's forms, not its strokes.
        side = int(np.clip(round(math.sqrt(len(self.particles) / 4)), 10, 100))
        strata = Strata((side, side), 1, displacement=0.0, fade_from=1.0)
        p = self.surface.emit(strata, rng=0)
        size = np.full((len(p), 2), _COVERING * math.sqrt(area) / side)
        depth = self.strata.displacement * self.strata.unit + 0.5 * size[:, :1]
        return Strokes(p.position - depth * p.normal, p.normal, size, p.label, self.material[0], center_ratio=0.0)

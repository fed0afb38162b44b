"""Shapes of plants and of the ground: trees, leaves, strokes on surfaces."""

from __future__ import annotations

from ._geometry import Mesh, square, subdivide
from ._rocks import rock
from ._strata import Strata
from ._surfaces import Particles, Surface
from ._tree_kinds import preset, presets
from ._tree_params import BranchParams, LeafParams, TreeParams, TrunkParams
from ._trees import Leaves, Tree

__all__ = [
    "BranchParams",
    "LeafParams",
    "Leaves",
    "Mesh",
    "Particles",
    "Strata",
    "Surface",
    "Tree",
    "TreeParams",
    "TrunkParams",
    "preset",
    "presets",
    "rock",
    "square",
    "subdivide",
]

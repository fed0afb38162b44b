"""Shapes of plants and of the ground: trees, leaves, strokes on surfaces."""

from __future__ import annotations

from .bark import bark_strokes as bark_strokes
from .mesh import Mesh, square, subdivide
from .rocks import rock
from .species import preset, presets
from .strata import Strata
from .surface import Particles, Surface
from .tree import Leaves, Tree
from .tree_params import BranchParams, LeafParams, TreeParams, TrunkParams

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

"""Skies for other programs: cube maps, skydomes, environment maps with the Sun beside them, backgrounds."""

from .cube import cube_layout, cube_map
from .dome import Mesh, skydome
from .environment import behind, save_environment, to_world
from .usd import usda

__all__ = [
    "Mesh",
    "behind",
    "cube_layout",
    "cube_map",
    "save_environment",
    "skydome",
    "to_world",
    "usda",
]

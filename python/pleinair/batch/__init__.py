"""Many photographs, many Suns, whole films: one function over many cells, here, in several processes or on a cluster."""

from .grid import Outcome, map_grid, results
from .jobs import fits, frames, precompute

__all__ = ["Outcome", "fits", "frames", "map_grid", "precompute", "results"]

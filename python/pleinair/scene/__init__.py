"""From where, when, in what order: a sky, clouds and plants as one painted picture (corot and the rest)."""

from .documents import load, save, schema
from .objects import Ground, Placed
from .parts import Part
from .scene import Scene
from .timeline import TimeLapse, Timeline

__all__ = [
    "Ground",
    "Part",
    "Placed",
    "Scene",
    "TimeLapse",
    "Timeline",
    "load",
    "save",
    "schema",
]

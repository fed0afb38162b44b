"""From where, when, in what order: a sky, clouds and plants as one painted picture (corot and the rest)."""

from .clouds import Cloud
from .documents import load, save, schema
from .objects import Ground, Placed
from .parts import Part
from .report import Layer
from .scene import Scene
from .timeline import TimeLapse, Timeline
from .weather import Weathered

__all__ = [
    "Cloud",
    "Ground",
    "Layer",
    "Part",
    "Placed",
    "Scene",
    "TimeLapse",
    "Timeline",
    "Weathered",
    "load",
    "save",
    "schema",
]

"""The explorer: a sky, a camera and an exposure under sliders."""

from .session import Explorer, explore

__all__ = [
    "Explorer",
    "explore",
]

"""Skies, clouds and painted landscapes: four papers as one system for outdoor scenes."""

from __future__ import annotations

import logging

from . import _core, astro, clouds, color, image, io
from ._core import get_num_threads, set_num_threads
from .astro import Sun
from .camera import Camera

__version__ = dict(_core.build_info())["version"]

logging.getLogger("pleinair").addHandler(logging.NullHandler())


class DomainWarning(UserWarning):
    """A model is used outside the range its paper supports."""


__all__ = [
    "Camera",
    "DomainWarning",
    "Sun",
    "__version__",
    "astro",
    "clouds",
    "color",
    "get_num_threads",
    "image",
    "io",
    "set_num_threads",
]

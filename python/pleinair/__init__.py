"""Skies, clouds and painted landscapes: four papers as one system for outdoor scenes."""

from __future__ import annotations

import logging

from . import _core, color, image
from ._core import get_num_threads, set_num_threads

__version__ = dict(_core.build_info())["version"]

logging.getLogger("pleinair").addHandler(logging.NullHandler())


class DomainWarning(UserWarning):
    """A model is used outside the range its paper supports."""


__all__ = [
    "DomainWarning",
    "__version__",
    "color",
    "get_num_threads",
    "image",
    "set_num_threads",
]

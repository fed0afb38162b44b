"""Skies, clouds and painted landscapes: four papers as one system for outdoor scenes."""

from __future__ import annotations

import logging

from . import (
    _core,
    astro,
    camera,
    clouds,
    color,
    demo,
    exports,
    fit,
    image,
    io,
    paint,
    plants,
    report,
    scene,
    sky,
    tone,
)
from ._core import get_num_threads
from ._explore import explore
from ._inputs import DomainWarning, integer
from .astro import Moon, Place, Sun
from .camera import Camera
from .scene import Scene, Timeline

__version__ = dict(_core.build_info())["version"]

logging.getLogger("pleinair").addHandler(logging.NullHandler())


def set_num_threads(threads: int | None) -> None:
    """Set the number of threads of every later call.

    Parameters
    ----------
    threads : int or None
        In [1, 1024] [1]; None returns to RAYON_NUM_THREADS, or to what the process may use.

    Raises
    ------
    ValueError, TypeError
        `threads` is out of range or not an integer.

    Examples
    --------
    >>> set_num_threads(2)
    >>> get_num_threads()
    2
    >>> set_num_threads(None)
    """
    _core.set_num_threads(None if threads is None else integer(threads, "threads", 1, 1024))


def show_versions() -> None:
    """Print what a bug report needs: this build, Python, numpy, the machine and the oracles that are installed.

    Examples
    --------
    >>> show_versions()
    pleinair...
    """
    import importlib.metadata
    import platform

    build = dict(_core.build_info())
    print(f"pleinair {build['version']} ({build['profile']}, {build['target']}-{build['os']})")
    print(f"SIMD {_core.simd_level()} of {', '.join(_core.simd_levels())}; {get_num_threads()} threads")
    print(f"Python {platform.python_version()}, {platform.platform()}")
    oracles = ("matplotlib", "scikit-image", "opencv-contrib-python-headless", "colour-science", "astropy")
    for name in ("numpy", "pillow", *oracles):
        try:
            print(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            print(f"{name} not installed")


__all__ = [
    "Camera",
    "DomainWarning",
    "Moon",
    "Place",
    "Scene",
    "Sun",
    "Timeline",
    "__version__",
    "astro",
    "camera",
    "clouds",
    "color",
    "demo",
    "explore",
    "exports",
    "fit",
    "get_num_threads",
    "image",
    "io",
    "paint",
    "plants",
    "report",
    "scene",
    "set_num_threads",
    "show_versions",
    "sky",
    "tone",
]

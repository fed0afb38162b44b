"""Threads of the process, and the build, machine and libraries it runs on. Public as `pleinair`."""

from __future__ import annotations

from .._core import build_info, get_num_threads, simd_level, simd_levels
from .._core import set_num_threads as core_set_num_threads
from .inputs import integer


def version() -> str:
    """Return the version of the build."""
    return dict(build_info())["version"]


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
    >>> import pleinair as pa
    >>> pa.set_num_threads(2)
    >>> pa.get_num_threads()
    2
    >>> pa.set_num_threads(None)
    """
    core_set_num_threads(None if threads is None else integer(threads, "threads", 1, 1024))


def show_versions() -> None:
    """Print what a bug report needs: this build, Python, numpy, the machine and the oracles that are installed.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.show_versions()
    pleinair...
    """
    import importlib.metadata
    import platform

    build = dict(build_info())
    print(f"pleinair {build['version']} ({build['profile']}, {build['target']}-{build['os']})")
    print(f"SIMD {simd_level()} of {', '.join(simd_levels())}; {get_num_threads()} threads")
    print(f"Python {platform.python_version()}, {platform.platform()}")
    oracles = ("matplotlib", "scikit-image", "opencv-contrib-python-headless", "colour-science", "astropy")
    for name in ("numpy", "pillow", *oracles):
        try:
            print(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            print(f"{name} not installed")

"""What scene files hold, written, read and described. Public as `pleinair.scene`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..io import PathLike
from .file import read, schema_of, write
from .scene import Scene


def schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files (draft 2020-12): what editors check and complete them by.

    Returns
    -------
    dict
        Of skies, clouds, trees, grounds, styles, cameras, timelines and scenes.

    Examples
    --------
    >>> sorted(schema()["properties"])[:4]
    ['camera', 'format', 'include', 'params']
    """
    return schema_of(Scene)


def load(path: PathLike, *, outside: bool = False) -> dict[str, Any]:
    """Read what a scene file holds.

    Parameters
    ----------
    path : path
        A .toml or .json file.
    outside : bool
        Whether files that it names may lie outside of its folder.

    Returns
    -------
    dict of str to object
        Of "scene", "camera", "timeline", "sky", "style", "tree", "volume", "params" those that are there.

    Raises
    ------
    ValueError
        The file is no TOML or JSON, a key is unknown, or a value out of range: the message has its place in the file.
    FileNotFoundError
        The file, or one that it names, is not there.

    Examples
    --------
    >>> import tempfile
    >>> from pleinair.sky import preset
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = save(f"{folder}/a.json", sky=preset("coral"))
    ...     load(path)["sky"] == preset("coral")
    True
    """
    return read(path, Scene, outside)


def save(path: PathLike, **objects: Any) -> Path:
    """Write what `load` reads; it gives back every bit.

    Parameters
    ----------
    path : path
        Ends in .toml or .json; arrays go to a file of this name and .npz beside it.
    **objects : object
        `scene`, `camera`, `timeline`, `sky`, `style`, `tree`, `volume`, `params`.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    TypeError
        Something has no place in a file: a function, say.
    ValueError
        There is no such ending.

    Examples
    --------
    >>> import tempfile
    >>> from pleinair import Camera
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(f"{folder}/view.toml", camera=Camera(64, 36)).name
    'view.toml'
    """
    return write(path, Scene, objects)

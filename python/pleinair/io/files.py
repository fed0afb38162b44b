"""Files written beside their place and renamed, and named arrays in .npz: nothing is half-written."""

from __future__ import annotations

import os
import secrets
import stat
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from .._support.inputs import Array

PathLike = str | os.PathLike[str]


def replacing(path: PathLike, save: Callable[[IO[bytes]], object]) -> Path:
    """Call `save(stream)` on a file beside `path`, then rename it to `path`: the old file or the new one is there, whole.

    A link is followed and the permissions of an old file stay; a new one has those that `open` would give it.
    """
    path = Path(path)
    target = path.resolve() if path.is_symlink() else path
    if not target.parent.is_dir():
        msg = f"there is no folder {target.parent}"
        raise FileNotFoundError(msg)
    mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else None
    part = target.parent / f".pleinair-{secrets.token_hex(8)}.part"
    try:
        # open() heeds the umask by itself; asking for it would change it for the whole process.
        with part.open("xb") as stream:
            save(stream)
            stream.flush()
            os.fsync(stream.fileno())
        if mode is not None:
            part.chmod(mode)
        part.replace(target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return path


# What numpy and zipfile raise for damage: RuntimeError is encrypted or patched, TypeError an array and no archive.
DAMAGE = (
    *(zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, KeyError, AttributeError, TypeError),
    *(RuntimeError, SyntaxError, tokenize.TokenError),
)


def write_arrays(path: PathLike, kind: str, arrays: Mapping[str, Any]) -> Path:
    """Write named arrays as a compressed .npz that says what it holds."""
    return replacing(path, lambda stream: np.savez_compressed(stream, pleinair_kind=np.array(kind), **arrays))


def read_arrays(path: PathLike, kind: str) -> dict[str, Array]:
    """Read what `write_arrays` wrote; a foreign or damaged file is refused by name."""
    path = Path(path)
    if not path.exists():
        msg = f"there is no file {path}"
        raise FileNotFoundError(msg)
    try:
        # numpy leaves a damaged archive open if it is given the path.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            found = str(stored["pleinair_kind"]) if "pleinair_kind" in stored.files else None
            arrays = {name: stored[name] for name in stored.files} if found == kind else {}
    except DAMAGE as error:
        msg = f"{path} is damaged or not an .npz file ({error})"
        raise ValueError(msg) from None
    if found != kind:
        msg = f"{path} must hold {kind!r}, it holds {'something foreign' if found is None else repr(found)}"
        raise ValueError(msg)
    return arrays

"""Files written beside their place and renamed, and named arrays in .npz: nothing is half-written."""

from __future__ import annotations

import lzma
import math
import os
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


class UnreadableError(ValueError):
    """A file that cannot be read as what it should be; the message says why."""


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
    part = target.parent / f".pleinair-{os.urandom(8).hex()}.part"
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


# What numpy, zipfile and their decompressors raise for damage: RuntimeError is encrypted or patched, TypeError an array and
# no archive, MemoryError a size that is a lie.
DAMAGE = (
    *(
        zipfile.BadZipFile,
        zlib.error,
        lzma.LZMAError,
        OSError,
        EOFError,
        ValueError,
        KeyError,
        AttributeError,
        TypeError,
    ),
    *(RuntimeError, SyntaxError, tokenize.TokenError, OverflowError, MemoryError, NotImplementedError),
)


def write_arrays(path: PathLike, kind: str, arrays: Mapping[str, Any]) -> Path:
    """Write named arrays as a compressed .npz that says what it holds."""
    return replacing(path, lambda stream: np.savez_compressed(stream, pleinair_kind=np.array(kind), **arrays))


def read_array(stream: IO[bytes], size: int) -> Array:
    """Read one .npy of `size` bytes; a header that claims more than there is is refused before memory is taken."""
    version = np.lib.format.read_magic(stream)
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = header(stream, max_header_size=10_000)
    claimed = math.prod(shape) * dtype.itemsize
    if dtype.hasobject or claimed > size:
        msg = f"an array of shape {shape} and dtype {dtype} does not fit into {size} bytes"
        raise ValueError(msg)
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)


def read_arrays(path: PathLike, kind: str) -> dict[str, Array]:
    """Read what `write_arrays` wrote; a foreign or damaged file is refused by name, before its arrays are read."""
    path = Path(path)
    if not path.exists():
        msg = f"there is no file {path}"
        raise FileNotFoundError(msg)

    def member(name: str, most: float = math.inf) -> Array:
        info = stored.getinfo(f"{name}.npy")
        if info.file_size > most:
            msg = f"{name} has {info.file_size} bytes"
            raise ValueError(msg)
        with stored.open(info) as stream:
            return read_array(stream, info.file_size)

    arrays = {}
    try:
        with zipfile.ZipFile(path) as stored:
            names = [name.removesuffix(".npy") for name in stored.namelist() if name.endswith(".npy")]
            found = str(member("pleinair_kind", 4096)) if "pleinair_kind" in names else None
            if found == kind:
                arrays = {name: member(name) for name in names}
    except DAMAGE as error:
        msg = f"{path} is damaged or not an .npz file ({error})"
        raise UnreadableError(msg) from None
    if found != kind:
        msg = f"{path} must hold {kind!r}, it holds {'something foreign' if found is None else repr(found)}"
        raise UnreadableError(msg)
    return arrays

"""Files: photographs, pictures, volumes. All are written beside their place and renamed: nothing is half-written."""

from __future__ import annotations

import os
import struct
import tempfile
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _hdr, color
from ._inputs import Array, array, light

__all__ = ["read", "write"]

PathLike = str | os.PathLike[str]


def _pillow() -> Any:
    try:
        from PIL import Image
    except ImportError:
        msg = "reading and writing pictures needs Pillow: pip install pillow"
        raise ImportError(msg) from None
    return Image


def replacing(path: PathLike, save: Callable[[IO[bytes]], object]) -> Path:
    """Call `save(stream)` on a temporary file beside `path`, then rename it to `path`."""
    path = Path(path)
    if not path.parent.is_dir():
        msg = f"there is no folder {path.parent}"
        raise FileNotFoundError(msg)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            save(stream)
        # mkstemp makes files for their owner alone; give what open() would have given.
        mask = os.umask(0)
        os.umask(mask)
        Path(name).chmod(0o666 & ~mask)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return path


def read(path: PathLike) -> NDArray[np.float32]:
    """Read a photograph, or a picture of high dynamic range, as linear light.

    Parameters
    ----------
    path : path
        JPEG, PNG or whatever Pillow reads: sRGB-encoded; transparency is dropped, the camera's orientation tag is
        honoured. OpenEXR (.exr), Radiance (.hdr), PFM (.pfm): linear; of .exr the data window of R, G, B or Y, of .hdr
        EXPOSURE and COLORCORR are undone. Grey pictures get three equal channels.

    Returns
    -------
    ndarray (height, width, 3) of float32
        Linear light, Rec. 709: in [0, 1] [1], or whatever .exr, .hdr and .pfm hold.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        The file is not a picture that can be read, or says that its primaries are not those of Rec. 709.
    ImportError
        Pillow, or OpenEXR for .exr, is not installed.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write(pathlib.Path(folder) / "grey.png", np.full((2, 3, 3), 0.25, np.float32))
    ...     read(path).shape
    (2, 3, 3)
    """
    path = Path(path)
    if not path.exists():
        msg = f"there is no file {path}"
        raise FileNotFoundError(msg)
    if (ending := path.suffix.lower()) in _hdr.READERS:
        try:
            return _hdr.decode(ending, path.read_bytes())
        except ValueError as error:
            msg = f"{path} is not a picture that can be read ({error})"
            raise ValueError(msg) from None
    Image = _pillow()
    from PIL import ImageOps, UnidentifiedImageError

    try:
        with Image.open(path) as opened:
            if opened.mode in ("I", "F", "I;16", "I;16B", "I;16L"):
                wide = np.asarray(opened, np.float64)
                scale = 1.0 if opened.mode == "F" else 65535.0
                grey = color.srgb_decode((wide / scale).astype(np.float32))
                return np.ascontiguousarray(np.broadcast_to(grey[..., None], (*grey.shape, 3)), np.float32)
            pixels = np.asarray(ImageOps.exif_transpose(opened).convert("RGB"))
    except (UnidentifiedImageError, OSError, SyntaxError, Image.DecompressionBombError) as error:
        msg = f"{path} is not a picture that can be read ({error})"
        raise ValueError(msg) from None
    levels = color.srgb_decode(np.arange(256, dtype=np.float64) / 255).astype(np.float32)
    linear: NDArray[np.float32] = levels[pixels]
    return linear


def write(
    path: PathLike,
    picture: ArrayLike,
    *,
    encoded: bool = False,
    half: bool = False,
    compression: str | None = None,
    tolerance: float = 0.01,
) -> Path:
    """Write a picture; the ending names the format.

    | ending | holds | refuses |
    |---|---|---|
    | .png, .jpg | 8-bit sRGB, clipped to [0, 1] | NaN |
    | .exr | float32, exact (or what `half` and `compression` leave) | what `half` and `compression` would destroy |
    | .hdr | Radiance RGBE: each channel to 1/256 of the largest of its pixel | negative, not finite, 2^127 or more |
    | .pfm | float32, exact | |

    Parameters
    ----------
    path : path
        Where to.
    picture : array_like (height, width, 3) or (height, width)
        Linear light. For .png and .jpg booleans become black and white and uint8 is written as it is.
    encoded : bool
        The values are sRGB-encoded already; .png and .jpg only.
    half : bool
        16-bit floats; .exr only. Values must be finite and in [-65504, 65504].
    compression : str or None
        Of .exr: "none", "rle", "zips", "zip" (the default), "piz"; and, which need not be exact and take only
        finite values, "pxr24", "b44", "b44a" (these two compress halves only), "dwaa", "dwab".
    tolerance : float
        Largest error that `half` and `compression` may make in a channel, relative to the largest channel of its pixel
        or, in the dark, to a thousandth of the picture's mean, in [0, 1] [1]. What was encoded is decoded and compared.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError
        The shape is wrong, the picture is empty, or the format cannot hold it.
    TypeError
        The picture holds integers where linear light is wanted, or no numbers.
    FileNotFoundError
        There is no such folder.
    ImportError
        Pillow, or OpenEXR for .exr, is not installed.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(pathlib.Path(folder) / "a.png", np.zeros((4, 4, 3))).name
    'a.png'
    """
    ending = Path(path).suffix.lower()
    if ending in _hdr.READERS:
        if encoded:
            msg = f"encoded must be False for {ending}, which holds linear light, got {encoded!r}"
            raise ValueError(msg)
        data = _hdr.encode(ending, picture, half=half, compression=compression, tolerance=tolerance)
        return replacing(path, lambda stream: stream.write(data))
    form = {".jpg": "JPEG", ".jpeg": "JPEG", ".png": "PNG"}.get(ending)
    if form is None:
        msg = f"path must end in .png, .jpg, .exr, .hdr or .pfm, got {Path(path).name!r}"
        raise ValueError(msg)
    if half or compression is not None:
        msg = f"half and compression must be left out for {ending} (they are of .exr), got {half!r}, {compression!r}"
        raise ValueError(msg)
    Image = _pillow()
    raw = np.asarray(picture)
    if raw.dtype == np.uint8:
        levels = raw
    else:
        values = array(raw, "picture") if raw.dtype == np.bool_ else light(raw, "picture")
        if np.isnan(values).any():
            msg = "picture must not hold NaN"
            raise ValueError(msg)
        if raw.dtype != np.bool_ and not encoded:
            values = color.srgb_encode(values)
        levels = (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
    if levels.size == 0 or levels.ndim not in (2, 3) or (levels.ndim == 3 and levels.shape[2] != 3):
        msg = f"picture must have shape (height, width, 3) or (height, width), got {levels.shape}"
        raise ValueError(msg)
    options = {"quality": 92} if form == "JPEG" else {}
    return replacing(path, lambda stream: Image.fromarray(levels).save(stream, form, **options))


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


_VOL = struct.Struct("<3sBiiiii6f")


def read_vol(path: PathLike) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Read a Mitsuba .vol grid (version 3, float32, one channel): density (nz, ny, nx) and box (2, 3) [m]."""
    data = Path(path).read_bytes()
    if len(data) < _VOL.size or data[:3] != b"VOL":
        msg = f"{path} is not a Mitsuba volume"
        raise ValueError(msg)
    _, version, kind, nx, ny, nz, channels, *box = _VOL.unpack_from(data)
    if version != 3 or kind != 1 or channels != 1 or min(nx, ny, nz) < 1:
        msg = f"{path}: only version 3, float32, one channel, got version {version}, type {kind}, {channels} channels"
        raise ValueError(msg)
    if len(data) != _VOL.size + 4 * nx * ny * nz:
        msg = f"{path} is damaged: {nx} x {ny} x {nz} voxels need {4 * nx * ny * nz} bytes, got {len(data) - _VOL.size}"
        raise ValueError(msg)
    density = np.frombuffer(data, "<f4", offset=_VOL.size).reshape(nz, ny, nx)
    return density.astype(np.float32), np.array(box, float).reshape(2, 3)


def write_vol(path: PathLike, density: NDArray[np.float32], box: NDArray[np.float64]) -> Path:
    """Write a Mitsuba .vol grid."""
    nz, ny, nx = density.shape
    head = _VOL.pack(b"VOL", 3, 1, nx, ny, nz, 1, *box.ravel().tolist())
    return replacing(path, lambda stream: stream.write(head + density.astype("<f4").tobytes()))

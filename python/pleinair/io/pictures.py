"""Pictures as files: photographs in 8 bits, OpenEXR, Radiance RGBE and PFM. Public as `pleinair.io`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.inputs import array, linear_light
from ..color import srgb_decode, srgb_encode
from . import hdr
from .files import PathLike, replacing


def _pillow() -> Any:
    try:
        from PIL import Image
    except ImportError:
        msg = "reading and writing pictures needs Pillow: pip install pillow"
        raise ImportError(msg) from None
    return Image


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
    if (ending := path.suffix.lower()) in hdr.READERS:
        try:
            return hdr.decode(ending, path.read_bytes())
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
                grey = srgb_decode((wide / scale).astype(np.float32))
                return np.ascontiguousarray(np.broadcast_to(grey[..., None], (*grey.shape, 3)), np.float32)
            pixels = np.asarray(ImageOps.exif_transpose(opened).convert("RGB"))
    except (UnidentifiedImageError, OSError, SyntaxError, Image.DecompressionBombError) as error:
        msg = f"{path} is not a picture that can be read ({error})"
        raise ValueError(msg) from None
    levels = srgb_decode(np.arange(256, dtype=np.float64) / 255).astype(np.float32)
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
    if ending in hdr.READERS:
        if encoded:
            msg = f"encoded must be False for {ending}, which holds linear light, got {encoded!r}"
            raise ValueError(msg)
        data = hdr.encode(ending, picture, half=half, compression=compression, tolerance=tolerance)
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
        values = array(raw, "picture") if raw.dtype == np.bool_ else linear_light(raw, "picture")
        if np.isnan(values).any():
            msg = "picture must not hold NaN"
            raise ValueError(msg)
        if raw.dtype != np.bool_ and not encoded:
            values = srgb_encode(values)
        levels = (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
    if levels.size == 0 or levels.ndim not in (2, 3) or (levels.ndim == 3 and levels.shape[2] != 3):
        msg = f"picture must have shape (height, width, 3) or (height, width), got {levels.shape}"
        raise ValueError(msg)
    options = {"quality": 92} if form == "JPEG" else {}
    return replacing(path, lambda stream: Image.fromarray(levels).save(stream, form, **options))

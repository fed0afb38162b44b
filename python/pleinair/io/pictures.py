"""Pictures as files: photographs in 8 bits, OpenEXR, Radiance RGBE and PFM. Public as `pleinair.io`."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.inputs import array, linear_light
from ..color import srgb_encode
from . import hdr
from .files import PathLike, replacing
from .photographs import pillow


def nearest_levels(encoded: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the 8-bit levels of encoded values, clipped to [0, 1]."""
    out: NDArray[np.uint8] = (np.clip(encoded, 0, 1) * 255 + 0.5).astype(np.uint8)
    return out


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
        parts = hdr.encode(ending, picture, half=half, compression=compression, tolerance=tolerance)
        return replacing(path, lambda stream: stream.writelines(parts))
    form = {".jpg": "JPEG", ".jpeg": "JPEG", ".png": "PNG"}.get(ending)
    if form is None:
        msg = f"path must end in .png, .jpg, .exr, .hdr or .pfm, got {Path(path).name!r}"
        raise ValueError(msg)
    if half or compression is not None:
        msg = f"half and compression must be left out for {ending} (they are of .exr), got {half!r}, {compression!r}"
        raise ValueError(msg)
    Image = pillow()
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
        levels = nearest_levels(values)
    if levels.size == 0 or levels.ndim not in (2, 3) or (levels.ndim == 3 and levels.shape[2] != 3):
        msg = f"picture must have shape (height, width, 3) or (height, width), got {levels.shape}"
        raise ValueError(msg)
    options = {"quality": 92} if form == "JPEG" else {}
    # Encoded in memory: a disk that is full must not leave a picture that is cut.
    encoded_file = io.BytesIO()
    Image.fromarray(levels).save(encoded_file, form, **options)
    return replacing(path, lambda stream: stream.write(encoded_file.getbuffer()))

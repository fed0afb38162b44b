"""Reading pictures as linear light, whatever their depth, profile, alpha and orientation. Public as `pleinair.io.read`.

PNG and TIFF are decoded by the core, which keeps 16 bits and floats; the other formats by Pillow, which has 8 bits of them.
Colours go by cICP, the ICC profile, sRGB, gAMA and cHRM, in this order of the PNG standard; a picture that says nothing is
sRGB.
"""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import PictureEncoding, picture_decode
from .._support.inputs import DomainWarning, choice, integer
from . import hdr
from .files import PathLike, UnreadableError

# Of Pillow's formats those that need no other program and lose nothing in 8 bits.
_FORMATS = ("BMP", "GIF", "JPEG", "MPO", "PNG", "PPM", "TIFF", "WEBP")
_PNG, _TIFFS = b"\x89PNG\r\n\x1a\n", (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_WHITE = {np.dtype(np.uint8): 255.0, np.dtype(np.uint16): 65535.0, np.dtype(np.uint32): 2.0**32 - 1}
_REMEDY = "profile='srgb' reads its numbers as sRGB"


def pillow() -> Any:
    """Return Pillow's module, or say how to get it."""
    try:
        from PIL import Image
    except ImportError:
        msg = "reading and writing pictures needs Pillow: pip install 'pleinair[io]'"
        raise ImportError(msg) from None
    return Image


def read(path: PathLike, *, profile: str = "embedded", max_pixels: int = 250_000_000) -> NDArray[np.float32]:
    """Read a photograph, or a picture of high dynamic range, as linear light.

    Parameters
    ----------
    path : path
        JPEG, PNG, TIFF, BMP, GIF, WebP, PPM: the camera's orientation is honoured, colours without their alpha are
        returned, those multiplied by it are divided. Floats in TIFF are linear light. OpenEXR (.exr), Radiance (.hdr), PFM
        (.pfm): linear; of .exr the data window of R, G, B or Y, of .hdr EXPOSURE and COLORCORR are undone. Grey pictures
        get three equal channels.
    profile : {"embedded", "srgb"}
        Whether what the file says of its colours is honoured (cICP, ICC, gAMA, cHRM), or its numbers are sRGB.
    max_pixels : int
        Larger pictures are refused before memory is taken, in [1, 10**10] [px]. Linear light takes 12 bytes a pixel.

    Returns
    -------
    ndarray (height, width, 3) of float32
        Linear light, Rec. 709: in [0, 1] [1] where the picture's colours lie in Rec. 709, outside where they do not (a
        Display P3 red is (1.22, -0.04, -0.02)); cd/m² for PQ; or whatever .exr, .hdr, .pfm and float TIFF hold.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    UnreadableError
        The file is not a picture that can be read, is too large, or has colours that cannot be known: CMYK without a profile,
        Lab, HLG, a damaged profile.
    ImportError
        Pillow, or OpenEXR for .exr, is not installed.

    Warns
    -----
    DomainWarning
        A profile of look-up tables was applied by littleCMS, which has 8 bits and clips to sRGB.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from pleinair.io import write
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write(pathlib.Path(folder) / "grey.png", np.full((2, 3, 3), 0.25, np.float32))
    ...     read(path).shape
    (2, 3, 3)
    """
    path = Path(path)
    choice(profile, "profile", ("embedded", "srgb"))
    most = integer(max_pixels, "max_pixels", 1, 10**10)
    if not path.exists():
        msg = f"there is no file {path}"
        raise FileNotFoundError(msg)
    try:
        data = path.read_bytes()
        if (ending := path.suffix.lower()) in hdr.READERS:
            return hdr.decode(ending, data, most)
        if data.startswith(_PNG):
            return _core_picture(data, profile, most)
        if data.startswith(_TIFFS):
            try:
                return _core_picture(data, profile, most)
            except ValueError as error:
                # Palettes, JPEG inside and the like are Pillow's, which has 8 bits of them.
                return _pillow_picture(data, profile, most, error)
        return _pillow_picture(data, profile, most)
    except (ValueError, OSError) as error:
        msg = f"{path} is not a picture that can be read ({error})"
        raise UnreadableError(msg) from None


def _core_picture(data: bytes, profile: str, most: int) -> NDArray[np.float32]:
    samples, about = picture_decode(data, most)
    if about["channels"] == "cmyk":
        if about["profile"] is None:
            msg = "it is CMYK without a profile: no colour is meant by its numbers"
            raise ValueError(msg)
        return _pillow_picture(data, profile, most)
    channels, stride = (1 if about["channels"] == "grey" else 3), about["stride"]
    encoding = PictureEncoding.srgb()
    if profile == "embedded":
        encoding = _png_encoding(about, samples.dtype, channels)
    orientation = about["orientation"]
    if about["exif"]:
        exif = pillow().Exif()
        exif.load(about["exif"])
        orientation = exif.get(0x0112, orientation)
    white = _WHITE.get(samples.dtype, 1.0)
    if about["alpha"] == "premultiplied":
        rows = samples.reshape(-1, stride)
        alpha = rows[:, channels : channels + 1].astype(np.float32) / np.float32(white)
        samples = np.divide(
            rows / np.float32(white), alpha, where=alpha > 0, out=np.zeros(rows.shape, np.float32)
        ).ravel()
        white = 1.0
    return _linear(samples, about["height"], about["width"], channels, stride, white, encoding, orientation)


def _png_encoding(about: dict[str, Any], dtype: Any, channels: int) -> PictureEncoding:
    """Return what a PNG or TIFF says of its colours, in the order of the PNG standard."""
    if about["cicp"] is not None:
        return PictureEncoding.cicp(about["cicp"])
    if about["profile"] is not None:
        return _icc(about["profile"], channels)
    if dtype == np.float32:
        return PictureEncoding.linear_light()
    # Writers of sRGB put gAMA 0.45455 in for readers of old; it means sRGB.
    if about["srgb"] or about["gamma"] is None or abs(about["gamma"] - 0.45455) < 1e-4:
        return PictureEncoding.srgb()
    if about["gamma"] == 0:
        msg = "its gamma is 0"
        raise ValueError(msg)
    return PictureEncoding.power(1 / about["gamma"], about["chromaticities"] if channels == 3 else None)


def _icc(data: bytes, channels: int) -> PictureEncoding:
    wanted = b"GRAY" if channels == 1 else b"RGB "
    if data[16:20] != wanted:
        msg = f"its ICC profile is of {data[16:20]!r} and its samples are {wanted.decode().strip()}; {_REMEDY}"
        raise ValueError(msg)
    try:
        return PictureEncoding.icc(data)
    except ValueError as error:
        msg = f"its ICC {error}; {_REMEDY}"
        raise ValueError(msg) from None


def _pillow_picture(data: bytes, profile: str, most: int, before: ValueError | None = None) -> NDArray[np.float32]:
    """Read a picture of 8 bits; `before` is why the core did not read it."""
    Image = pillow()
    Image.init()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            opened = Image.open(io.BytesIO(data), formats=[f for f in _FORMATS if f in Image.OPEN])
        with opened:
            width, height = opened.size
            if width * height > most:
                msg = f"{width} x {height} pixels are more than the {most} that are allowed"
                raise ValueError(msg)
            _refuse_deep(opened, data, before)
            orientation = opened.getexif().get(0x0112, 1)
            icc = opened.info.get("icc_profile") if profile == "embedded" else None
            if opened.mode in ("I;16", "I;16B", "I;16L"):
                levels: NDArray[Any] = np.asarray(opened).astype(np.uint16)[..., None]
            elif opened.mode == "CMYK" or (icc and _tables_alone(icc)):
                levels, icc = _by_littlecms(opened, icc), None
            else:
                grey = opened.mode in ("1", "L", "LA")
                levels = np.asarray(opened.convert("L" if grey else "RGB"))
                levels = levels[..., None] if grey else levels
    except Image.DecompressionBombError as error:
        raise ValueError(str(error)) from None
    except (Image.UnidentifiedImageError, OSError, SyntaxError, EOFError, TypeError, KeyError, IndexError) as error:
        # Pillow's own words name a buffer where there is no path.
        reason = "of no format that is read here" if isinstance(error, Image.UnidentifiedImageError) else str(error)
        raise ValueError(reason) from None
    encoding = _icc(icc, levels.shape[2]) if icc else PictureEncoding.srgb()
    flat = np.ascontiguousarray(levels).ravel()
    return _linear(flat, height, width, levels.shape[2], levels.shape[2], _WHITE[levels.dtype], encoding, orientation)


def _refuse_deep(opened: Any, data: bytes, before: ValueError | None) -> None:
    """Refuse what Pillow would cut to 8 bits in silence, and colour spaces that it would guess."""
    bits = opened.tag_v2.get(258, (8,)) if opened.format == "TIFF" else (8,)
    if max(bits if isinstance(bits, tuple) else (bits,)) > 8 and not opened.mode.startswith("I;16"):
        raise ValueError(str(before))
    head = rb"P[36]\s+(?:#[^\n]*\s+)*\d+\s+(?:#[^\n]*\s+)*\d+\s+(\d+)"
    if opened.format == "PPM" and (found := re.match(head, data)) and int(found[1]) > 255:
        msg = "a PPM of more than 8 bits would lose them"
        raise ValueError(msg)
    if opened.mode not in ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "RGBX", "CMYK", "YCbCr", "I;16", "I;16B", "I;16L"):
        msg = f"its mode is {opened.mode}, which is not read"
        raise ValueError(msg)


def _tables_alone(icc: bytes) -> bool:
    try:
        PictureEncoding.icc(icc)
    except ValueError as error:
        return "look-up tables" in str(error)
    return False


def _by_littlecms(opened: Any, icc: bytes | None) -> NDArray[np.uint8]:
    if icc is None:
        msg = "it is CMYK without a profile: no colour is meant by its numbers"
        raise ValueError(msg)
    from PIL import ImageCms

    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(icc))
        shown = ImageCms.profileToProfile(opened, source, ImageCms.createProfile("sRGB"), outputMode="RGB")
    except (ImageCms.PyCMSError, OSError) as error:
        msg = f"its ICC profile cannot be applied ({error}); {_REMEDY}"
        raise ValueError(msg) from None
    msg = "a profile of look-up tables was applied by littleCMS: 8 bits, clipped to sRGB"
    warnings.warn(msg, DomainWarning, stacklevel=4)
    return np.asarray(shown)


def _linear(
    samples: Any, height: int, width: int, channels: int, stride: int, white: float, encoding: Any, orientation: Any
) -> NDArray[np.float32]:
    out = np.empty((height, width, 3), np.float32)
    encoding.linear(samples, channels, stride, white, out)
    return np.ascontiguousarray(upright(out, orientation))


def upright(picture: NDArray[np.float32], orientation: Any) -> NDArray[np.float32]:
    """Return a picture turned by TIFF's orientation, 1 to 8; anything else leaves it as it is."""
    if orientation in (5, 6, 7, 8):
        picture = picture.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        picture = picture[::-1]
    if orientation in (2, 3, 6, 7):
        picture = picture[:, ::-1]
    return picture

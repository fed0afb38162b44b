"""Pictures of high dynamic range as bytes: OpenEXR, Radiance RGBE and PFM, linear light in, linear light out.

What a file would destroy is refused before it is written. An OpenEXR file that is not exact is decoded again and
compared. RGBE keeps each channel to 1/256 of the pixel's largest: mantissas are rounded, which is right for every
reader that takes them as they are (all but Radiance's own, which adds a half and so errs by up to 1/128). Bounds are
held by tests/oracles/test_hdr_files.py.
"""

from __future__ import annotations

import importlib
import io
import math
import re
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import picture_limits, rgbe_decode, rgbe_encode
from .._support.inputs import DomainWarning, choice, linear_light, real, shape_text

Picture = NDArray[np.float32]

COMPRESSIONS = ("none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab")
EXACT = COMPRESSIONS[:5]
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # x, y of red, green, blue and white
HALF = float(np.finfo(np.float16).max)


def openexr() -> Any:
    """Return the library."""
    try:
        return importlib.import_module("OpenEXR")
    except ImportError:
        msg = "reading and writing .exr needs OpenEXR: pip install 'pleinair[io]'"
        raise ImportError(msg) from None


def _float32(picture: ArrayLike) -> Picture:
    """Return `picture` as float32 (height, width, 3)."""
    values = linear_light(picture, "picture")
    if values.size == 0 or values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[2] != 3):
        msg = f"picture must have shape (height, width, 3) or (height, width), got {shape_text(values.shape)}"
        raise ValueError(msg)
    with np.errstate(over="ignore"):
        out = values.astype(np.float32, copy=False)
    if out is not values and (np.isinf(out) & np.isfinite(values)).any():
        msg = f"picture must fit float32 (at most {np.finfo(np.float32).max:.4g}), got {np.abs(values).max():g}"
        raise ValueError(msg)
    return np.ascontiguousarray(np.broadcast_to(out[..., None], (*out.shape, 3)) if out.ndim == 2 else out)


def _finite(picture: Picture, what: str) -> None:
    if not np.isfinite(picture).all():
        msg = f"picture must be finite for {what}, got {np.isnan(picture).sum()} NaN and {np.isinf(picture).sum()} inf"
        raise ValueError(msg)


def relative_error(stored: Picture, picture: Picture) -> float:
    """Return the largest difference of a channel relative to the largest channel of its pixel [1].

    Pixels darker than a thousandth of the mean are measured against that thousandth.
    """
    peak = np.abs(picture).max(axis=-1).astype(np.float64)
    with np.errstate(invalid="ignore"):
        gap = np.abs(stored.astype(np.float64) - picture).max(axis=-1)
    return float((gap / np.maximum(peak, max(1e-3 * peak.mean(), np.finfo(np.float64).tiny))).max())


# OpenEXR


def _write_exr(picture: Picture, half: bool, compression: str, tolerance: float) -> bytes:
    exr = openexr()
    what = " and ".join(["half=True"] * half + [f"compression={compression!r}"] * (compression not in EXACT))
    if what:
        _finite(picture, what)
    if half and np.abs(picture).max() > HALF:
        msg = f"picture must be in [-{HALF:.0f}, {HALF:.0f}] for half=True, got {np.abs(picture).max():g}: scale it"
        raise ValueError(msg)
    method = getattr(exr, f"{'NO' if compression == 'none' else compression.upper()}_COMPRESSION")
    header = {"compression": method, "type": exr.scanlineimage}
    header |= {"chromaticities": REC709}
    stream = io.BytesIO()
    exr.File(header, {"RGB": picture.astype(np.float16) if half else picture}).write(stream)
    data = stream.getvalue()
    if what:
        error = relative_error(_read_exr(data, picture.size), picture)
        if not error <= tolerance:
            msg = f"picture must survive {what} within tolerance={tolerance:g} [1], its error is {error:.3g}"
            raise ValueError(msg)
    return data


def small_enough(width: int, height: int, most: int) -> None:
    """Refuse a picture of too many pixels."""
    if width * height > most:
        msg = f"{width} x {height} pixels are more than the {most} that are allowed"
        raise ValueError(msg)


def _read_exr(data: bytes, most: int) -> Picture:
    exr = openexr()
    try:
        low, high = exr.File(io.BytesIO(data), header_only=True).header()["dataWindow"]
        width, height = (int(b) - int(a) + 1 for a, b in zip(low, high, strict=True))
        small_enough(width, height, most)
        stored = exr.File(io.BytesIO(data), separate_channels=True)
        found = {name: channel.pixels for name, channel in stored.channels().items()}
    except (RuntimeError, TypeError, KeyError, MemoryError) as error:
        raise ValueError(str(error)) from None
    _primaries(stored.header().get("chromaticities"), 0.002)
    names = "RGB" if {*"RGB"} <= found.keys() else "YYY" if "Y" in found and not {"RY", "BY"} & found.keys() else ""
    if not names or any(found[name].dtype.kind not in "fu" for name in names):
        msg = f"it must have flat channels R, G, B or Y, it has {', '.join(sorted(found)) or 'none'}"
        raise ValueError(msg)
    return np.stack([found[name] for name in names], axis=-1).astype(np.float32)


def _primaries(found: Any, within: float) -> None:
    """Refuse colours that are not those of Rec. 709; a file that does not say means them."""
    if found is not None and (np.shape(found) != (8,) or not np.allclose(found, REC709, rtol=0, atol=within)):
        msg = f"its primaries and white must be those of Rec. 709, they are {found}"
        raise ValueError(msg)


# Radiance RGBE


def _write_hdr(picture: Picture) -> list[bytes | memoryview]:
    finite, least, largest = picture_limits(picture)
    if not finite:
        _finite(picture, ".hdr")
    if least < 0:
        msg = f"picture must not be negative for .hdr (use .exr, or pleinair.color.into_gamut), got {least:g}"
        raise ValueError(msg)
    if largest >= 2.0**127:
        msg = f"picture must be below 2^127 for .hdr (use .exr), got {largest:g}"
        raise ValueError(msg)
    height, width = picture.shape[:2]
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nPRIMARIES={' '.join(map(str, REC709))}\n\n-Y {height} +X {width}\n"
    return [head.encode(), rgbe_encode(picture, width).data]


def _read_hdr(data: bytes, most: int) -> Picture:
    head, _, rest = data.partition(b"\n\n")
    text = head.decode("latin-1")
    size, _, body = rest.partition(b"\n")
    axes = re.fullmatch(rb"([-+])Y (\d+) ([-+])X (\d+)", size)
    if not text.startswith(("#?RADIANCE", "#?RGBE")) or "FORMAT=32-bit_rle_rgbe" not in text or not axes:
        msg = "it must begin with #?RADIANCE, hold 32-bit_rle_rgbe and be stored by rows"
        raise ValueError(msg)
    height, width = int(axes[2]), int(axes[4])
    small_enough(width, height, most)
    if not 0 < height * width <= 64 * len(body):  # no run is denser
        msg = f"its size is {width} x {height}, it holds {len(body)} bytes"
        raise ValueError(msg)

    def said(key: str) -> list[list[float]]:
        return [[float(word) for word in line.split()] for line in re.findall(rf"(?m)^{key}=(.*)$", text)]

    # Radiance's own primaries have an equal-energy white; every reader takes them for those of Rec. 709.
    for primaries in said("PRIMARIES"):
        _primaries(primaries, 0.025)
    with np.errstate(over="ignore"):
        scale = math.prod(e for (e,) in said("EXPOSURE")) * np.prod([(1.0, 1.0, 1.0), *said("COLORCORR")], axis=0)
    if not (np.isfinite(scale).all() and (scale > 0).all()) or scale.max() > 1e30 or scale.min() < 1e-30:
        msg = f"its EXPOSURE and COLORCORR must be in [1e-30, 1e30], they multiply to {scale.tolist()}"
        raise ValueError(msg)
    out = rgbe_decode(body, (height, width), tuple(scale.tolist())).reshape(height, width, 3)
    return np.ascontiguousarray(out[:: -1 if axes[1] == b"+" else 1, :: -1 if axes[3] == b"-" else 1])


# PFM


def _write_pfm(picture: Picture) -> list[bytes | memoryview]:
    height, width, _ = picture.shape
    return [f"PF\n{width} {height}\n-1.0\n".encode(), np.ascontiguousarray(picture[::-1], "<f4").data]


def _read_pfm(data: bytes, most: int) -> Picture:
    head = re.match(rb"P([Ff])\s+(\d+)\s+(\d+)\s+([-+.\deE]+)[\n\r ]", data)
    if not head:
        msg = "it must begin with PF or Pf, its size and its scale"
        raise ValueError(msg)
    height, width, channels = int(head[3]), int(head[2]), 3 if head[1] == b"F" else 1
    small_enough(width, height, most)
    try:
        scale = float(head[4])
    except ValueError:
        scale = 0.0
    if not (math.isfinite(scale) and scale):
        msg = f"its scale must be a number other than 0, it is {head[4].decode()}"
        raise ValueError(msg)
    order = "<f4" if scale < 0 else ">f4"
    if not 0 < height * width * channels * 4 == len(data) - head.end():
        msg = f"its size is {width} x {height}, it holds {len(data) - head.end()} bytes"
        raise ValueError(msg)
    pixels = np.frombuffer(data, order, offset=head.end()).reshape(height, width, channels)[::-1]
    if abs(scale) != 1:
        # Mitsuba and OpenImageIO multiply by it, OpenCV and PyAV divide, Pillow ignores it (findings/pfm-scale-line-….sh).
        msg = f"samples are multiplied by the scale of the .pfm, {abs(scale):g}: programs disagree on it"
        warnings.warn(msg, DomainWarning, stacklevel=4)
        pixels = pixels.astype(np.float32) * np.float32(abs(scale))
    return np.ascontiguousarray(np.broadcast_to(pixels, (height, width, 3)), np.float32)


READERS: dict[str, Callable[[bytes, int], Picture]] = {".exr": _read_exr, ".hdr": _read_hdr, ".pfm": _read_pfm}


def encode(
    ending: str,
    picture: ArrayLike,
    *,
    half: bool = False,
    compression: str | None = None,
    tolerance: float = 0.01,
) -> list[bytes | memoryview]:
    """Return `picture` as the parts of a file with this ending (a key of `READERS`); see `pleinair.io.write`."""
    tolerance = real(tolerance, "tolerance", 0, 1)
    values = _float32(picture)
    if ending == ".exr":
        known = choice("zip" if compression is None else compression, "compression", COMPRESSIONS)
        return [_write_exr(values, bool(half), known, tolerance)]
    if half or compression is not None:
        msg = f"half and compression must be left out for {ending} (they are of .exr), got {half!r}, {compression!r}"
        raise ValueError(msg)
    return _write_hdr(values) if ending == ".hdr" else _write_pfm(values)


def decode(ending: str, data: bytes, max_pixels: int = 250_000_000) -> Picture:
    """Return the picture that `data`, a file with this ending, holds; damage is a ValueError."""
    return READERS[ending](data, max_pixels)

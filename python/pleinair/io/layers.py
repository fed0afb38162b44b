"""Layers of a picture in one OpenEXR file, for compositing: radiance, opacity and depth of each. Public as `pleinair.io`.

A layer is the channels NAME.R, NAME.G, NAME.B (premultiplied, as OpenEXR has it), NAME.A = 1 - transmittance and NAME.Z. The
plain channels R, G, B are all layers over each other, so that any viewer shows the picture. float32, exact but for the rounding
of 1 - transmittance, 6e-8 (tests/oracles/test_layer_files.py: Mitsuba reads them).
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import array, instance, shape_text
from .files import PathLike, replacing
from .hdr import REC709, openexr, small_enough

# The parts of a layer, and the channels they are written to.
_PARTS = ("radiance", "transmittance", "depth")


def _checked(name: str, layer: Any) -> tuple[NDArray[np.float32], ...]:
    """Return radiance, transmittance and depth of a layer."""
    if not re.fullmatch(r"[A-Za-z0-9_ -]+", instance(name, "layers", str)):
        msg = f"layers must have names of letters, digits, spaces, - and _, got {name!r}"
        raise ValueError(msg)
    light, through, depth = (
        np.ascontiguousarray(array(getattr(layer, part), f"{name}.{part}"), np.float32) for part in _PARTS
    )
    if light.ndim != 3 or light.shape[2] != 3 or not light.size or not through.shape == depth.shape == light.shape[:2]:
        shapes = ", ".join(shape_text(a.shape) for a in (light, through, depth))
        msg = f"layers must have shapes (height, width, 3), (height, width), (height, width), {name} has {shapes}"
        raise ValueError(msg)
    if not (np.isfinite(light).all() and through.min() >= 0 and through.max() <= 1) or np.isnan(depth).any():
        msg = f"layers must have finite radiance, transmittance in [0, 1] [1] and depth in [0, inf] [m]: {name} has not"
        raise ValueError(msg)
    return light, through, depth


def write_layers(path: PathLike, layers: Mapping[str, Any]) -> Path:
    """Write layers to one OpenEXR file that compositing programs open: NAME.R, .G, .B, .A and .Z, and the whole as R, G, B.

    Parameters
    ----------
    path : path
        Ends in .exr.
    layers : mapping of str to Layer
        The farthest first, as `Scene.layers` returns them: anything with `radiance` (height, width, 3), `transmittance` and
        `depth` (height, width) [1] [m].

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError, TypeError
        There is no layer, a name or a shape is wrong, or a value has no place in a layer.
    FileNotFoundError
        There is no such folder.
    ImportError
        OpenEXR is not installed: pip install 'pleinair[io]'.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from pleinair import Camera, Scene, Sun
    >>> from pleinair.sky import Natural
    >>> layers = Scene(Natural(sun=Sun(30, 160))).layers(Camera(32, 24))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_layers(pathlib.Path(folder) / "a.exr", layers).name
    'a.exr'
    """
    if Path(path).suffix.lower() != ".exr":
        msg = f"path must end in .exr, got {Path(path).name!r}"
        raise ValueError(msg)
    found = {name: _checked(name, layer) for name, layer in instance(layers, "layers", Mapping).items()}
    if not found:
        msg = "layers must hold at least one"
        raise ValueError(msg)
    shapes = {light.shape for light, _, _ in found.values()}
    if len(shapes) > 1:
        msg = f"layers must have one size, got {', '.join(map(shape_text, sorted(shapes)))}"
        raise ValueError(msg)
    exr = openexr()
    whole = np.zeros(shapes.pop(), np.float32)
    channels: dict[str, NDArray[np.float32]] = {}
    for name, (light, through, depth) in found.items():
        whole = light + through[..., None] * whole
        channels |= {f"{name}.{c}": np.ascontiguousarray(light[..., k]) for k, c in enumerate("RGB")}
        channels |= {f"{name}.A": 1 - through, f"{name}.Z": depth}
    channels |= {c: np.ascontiguousarray(whole[..., k]) for k, c in enumerate("RGB")}
    # A list of the names keeps the order, which a file of channels does not.
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage, "chromaticities": REC709}
    stream = io.BytesIO()
    exr.File(header | {"layers": "\n".join(found)}, channels).write(stream)
    return replacing(path, lambda out: out.write(stream.getvalue()))


def read_layers(path: PathLike, *, max_pixels: int = 200_000_000) -> dict[str, dict[str, NDArray[np.float32]]]:
    """Read layers that `write_layers` wrote, or another program with the same channels.

    Parameters
    ----------
    path : path
        An .exr.
    max_pixels : int
        A larger picture is refused [1].

    Returns
    -------
    dict of str to dict
        For each layer "radiance" (height, width, 3), "transmittance" and "depth" (height, width), of float32; 0 and infinity
        where it has no A and no Z. The farthest first, if the file says so, or by name.

    Raises
    ------
    ValueError
        It is no such file.
    FileNotFoundError
        There is no such file.
    ImportError
        OpenEXR is not installed: pip install 'pleinair[io]'.

    Examples
    --------
    >>> import tempfile
    >>> from pleinair import Camera, Scene, Sun
    >>> from pleinair.sky import Natural
    >>> layers = Scene(Natural(sun=Sun(30, 160))).layers(Camera(32, 24))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     back = read_layers(write_layers(f"{folder}/a.exr", layers))
    >>> bool((back["sky"]["radiance"] == layers["sky"].radiance).all())
    True
    """
    exr = openexr()
    data = Path(path).read_bytes()
    try:
        low, high = exr.File(io.BytesIO(data), header_only=True).header()["dataWindow"]
        width, height = (int(b) - int(a) + 1 for a, b in zip(low, high, strict=True))
        small_enough(width, height, max_pixels)
        file = exr.File(io.BytesIO(data), separate_channels=True)
        found = {name: np.asarray(channel.pixels, np.float32) for name, channel in file.channels().items()}
        said = str(file.header().get("layers", "")).split("\n")
    except (RuntimeError, TypeError, KeyError, MemoryError) as error:
        msg = f"{path} cannot be read as layers: {error}"
        raise ValueError(msg) from None
    names = {name.rsplit(".", 1)[0] for name in found if "." in name}
    out = {}
    for name in [*(n for n in said if n in names), *sorted(names - {*said})]:
        if not {f"{name}.{c}" for c in "RGB"} <= found.keys():
            continue
        light = np.stack([found[f"{name}.{c}"] for c in "RGB"], axis=-1)
        alpha = found.get(f"{name}.A", np.ones(light.shape[:2], np.float32))
        depth = found.get(f"{name}.Z", np.full(light.shape[:2], np.inf, np.float32))
        out[name] = {"radiance": light, "transmittance": 1 - alpha, "depth": depth}
    if not out:
        msg = f"{path} has no layers, its channels are {', '.join(sorted(found)) or 'none'}"
        raise ValueError(msg)
    return out

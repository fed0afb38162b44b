"""Skies for other programs: cube maps, skydomes, environment maps with the Sun beside them, backgrounds.

Any object is a sky that has the methods used: `radiance(directions)` (..., 3) -> (..., 3), `panorama(height)`,
`render(camera)`, `sun_light()`, `sh9()`. Our frame is x east, y north, z up; engines have y up. Turned that way,
(x, y, z) becomes (x, z, -y): east stays +X, up is +Y, south is +Z, and a panorama is OpenEXR's lat-long environment
map. tests/house/test_exports.py holds the formulas, tests/oracles/test_environment_mitsuba.py one renderer's picture of
them; docs/exports.md is the page for users.
"""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.inputs import DomainWarning, choice, instance, integer, linear_light, real, shape_text, vector
from ..camera import Camera
from ..color import into_gamut
from ..io import PathLike, replacing
from ..io import write as io_write

# Columns are where east, north and up of our frame go in the frame with y up.
_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def _ask(sky: Any, method: str, *args: Any) -> Any:
    """Return `sky.method(*args)`."""
    call = getattr(sky, method, None)
    if not callable(call):
        msg = f"sky must have a method {method}, got {type(sky).__name__}"
        raise TypeError(msg)
    return call(*args)


def sunlight(sun: Any) -> list[float]:
    """Return the irradiance of a light in the gamut: files of other programs have no negative colours."""
    given = np.array(vector(sun.irradiance, "sun_light.irradiance"))
    inside: list[float] = into_gamut(given).tolist()
    return inside


def _float32(sky: Any, method: str, argument: Any, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return what a method of the sky gives, as float32 of the shape it must have."""
    out = np.asarray(_ask(sky, method, argument), np.float32)
    if out.shape != shape:
        msg = f"sky must give shape {shape_text(shape)} from {method}, got {shape_text(out.shape)}"
        raise ValueError(msg)
    return out


_CONVENTIONS = {
    "frame": "x east, y north, z up; right-handed",
    "direction": "unit vector towards the light",
    "irradiance": "of a plane that faces the light, in the panorama's unit times sr; linear, Rec. 709 primaries, D65",
    "angular_radius": "degrees",
    "sh9": "sky without the Sun's disc; orthonormal real harmonics, no Condon-Shortley sign, z up, (l, m) = (0, 0), (1, -1), (1, 0), (1, 1), (2, -2) to (2, 2); RGB",
    "panorama": "equirectangular: row 0 below the zenith, column 0 east of north, azimuth grows to the right; pixels are centred, so pixel (i, j) looks at elevation 90 - 180 (i + 1/2) / height, azimuth 180 (j + 1/2) / height degrees",
}


def save_environment(
    sky: Any,
    path: PathLike,
    height: int = 512,
    *,
    scale: float = 1.0,
    light: bool = False,
    half: bool = False,
    compression: str | None = None,
    tolerance: float = 0.01,
) -> Path:
    """Write the sky's panorama and, if wanted, the Sun as a separate light beside it.

    Parameters
    ----------
    sky : sky
        Its `panorama` is written; `sun_light` and `sh9` too with `light`.
    path : path
        .exr, .hdr, .pfm, or .png and .jpg, which clip to [0, 1]. Pixels are centred: the first row lies half a pixel below
        the zenith. (OpenEXR's `envmap` attribute means rows that lie on the poles, so it is not set.) .hdr has no
        negative channels: colours beyond its primaries lose saturation, with a DomainWarning that counts them.
    height : int
        Of the panorama, in [1, 16384] [px]; it is twice as wide.
    scale : float
        Every value is multiplied by it, the Sun's too, above 0 [1].
    light : bool
        Write {direction, irradiance, angular_radius, sh9, conventions} as JSON to `path` with the ending .json. The
        panorama is then that of `without_disc()`, where the sky has it: the Sun's disc is not counted twice.
    half, compression : bool, str or None
        Of .exr, as in `pleinair.io.write`.
    tolerance : float
        As in `pleinair.io.write`, in [0, 1] [1].

    Returns
    -------
    Path
        The panorama.

    Raises
    ------
    ValueError, TypeError
        A value is out of range, the format cannot hold the sky, or `sky` is no sky.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from types import SimpleNamespace
    >>> sky = SimpleNamespace(panorama=lambda height: np.ones((height, 2 * height, 3), np.float32))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_environment(sky, pathlib.Path(folder) / "sky.hdr", 64).name
    'sky.hdr'
    """
    height = integer(height, "height", 1, 16384)
    scale = real(scale, "scale", math.ulp(0.0), math.inf)
    path = Path(path)
    text = None
    if light:
        sun = _ask(sky, "sun_light")
        description = {
            "panorama": path.name,
            "scale": scale,
            "direction": vector(sun.direction, "sun_light().direction"),
            "irradiance": [scale * e for e in sunlight(sun)],
            "angular_radius": real(sun.angular_radius, "sun_light().angular_radius", 0, 180, "°"),
            "sh9": (scale * np.asarray(_ask(sky, "sh9"), float)).tolist(),
            "conventions": _CONVENTIONS,
        }
        sky = _ask(sky, "without_disc") if hasattr(sky, "without_disc") else sky
        text = json.dumps(description, indent=1, allow_nan=False).encode()
    picture = _float32(sky, "panorama", height, (height, 2 * height, 3)) * np.float32(scale)
    if path.suffix.lower() == ".hdr" and (beyond := int((picture < 0).any(axis=-1).sum())):
        msg = f"{beyond} of {picture[..., 0].size} pixels are beyond the primaries and lose saturation: .exr keeps them"
        warnings.warn(msg, DomainWarning, stacklevel=2)
        picture = into_gamut(picture)
    io_write(path, picture, half=half, compression=compression, tolerance=tolerance)
    if text is not None:
        replacing(path.with_suffix(".json"), lambda stream: stream.write(text))
    return path


# Where the x, y and z of the frame in which a program reads a lat-long picture lie in ours. Mitsuba and USD have y up
# and the picture's centre, south, at +z. Cycles has z up, u = (pi - atan2(y, x)) / (2 pi), so the centre at +x.
_READS = {"mitsuba": _Y_UP.T, "usd": _Y_UP.T, "blender": np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])}


def to_world(app: str, up: str = "z") -> NDArray[np.float64]:
    """Return the rotation that puts a panorama where our frame says, in another program.

    Parameters
    ----------
    app : str
        "mitsuba": `to_world` of an `envmap`. "usd": transform of a DomeLight of format latlong (for row vectors:
        transposed). "blender": the turn of the World's Environment Texture; its Mapping node of type Point takes the
        inverse, which is 90° about Z.
    up : str
        The program's scene has "z" up (x east, y north, z up) or "y" up (x east, y up, z south).

    Returns
    -------
    ndarray (4, 4) of float64
        For column vectors: from the frame in which the program reads the picture to its scene [1].

    Raises
    ------
    ValueError
        `app` or `up` is not one of these.

    Examples
    --------
    >>> to_world("usd", up="y").astype(int).tolist()
    [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    """
    turn = _READS[choice(app, "app", tuple(_READS))]
    out = np.eye(4)
    out[:3, :3] = turn if choice(up, "up", ("z", "y")) == "z" else _Y_UP @ turn
    return out + 0.0  # no -0


def _facing(direction: ArrayLike, up: str) -> NDArray[np.float64]:
    """Return a rotation whose third column is `direction`, given in our frame, in a scene with that axis up."""
    z = np.asarray(direction, float)
    if not (length := np.linalg.norm(z)) > 0:
        msg = f"sun_light.direction must not be zero, got {z.tolist()}"
        raise ValueError(msg)
    z = z / length
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    out: NDArray[np.float64] = np.stack([x, np.cross(z, x), z], axis=1)
    return out if up == "z" else _Y_UP @ out


def behind(rgba: ArrayLike, sky: Any, camera: Camera, *, premultiplied: bool = True) -> NDArray[np.float32]:
    """Put the sky behind a picture with transparency, in linear light.

    Parameters
    ----------
    rgba : array_like (height, width, 4)
        Linear light in the sky's unit, and alpha in [0, 1] [1].
    sky : sky
        Its `render` is asked.
    camera : Camera
        The one that made `rgba`.
    premultiplied : bool
        The colours are multiplied by alpha already, as renderers write them; light with alpha 0 is added to the sky.

    Returns
    -------
    ndarray (height, width, 3) of float32
        rgb + (1 - alpha) sky, or alpha rgb + (1 - alpha) sky.

    Raises
    ------
    ValueError, TypeError
        Sizes differ, `rgba` is not finite or holds integers, alpha is outside [0, 1], or `sky` is no sky.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> camera = Camera(2, 2)
    >>> sky = SimpleNamespace(render=lambda camera: np.full((2, 2, 3), 8.0, np.float32))
    >>> behind(np.full((2, 2, 4), 0.5), sky, camera)[0, 0].tolist()
    [4.5, 4.5, 4.5]
    """
    layer = linear_light(rgba, "rgba")
    size = (instance(camera, "camera", Camera).height, camera.width)
    if layer.shape != (*size, 4):
        msg = f"rgba must have shape {shape_text((*size, 4))}, the camera's, got {shape_text(layer.shape)}"
        raise ValueError(msg)
    if not np.isfinite(layer).all():
        msg = "rgba must be finite, got NaN or inf"
        raise ValueError(msg)
    rgb, alpha = layer[..., :3], layer[..., 3:]
    if (alpha < 0).any() or (alpha > 1).any():
        msg = f"rgba must have alpha in [0, 1] [1], got [{alpha.min():g}, {alpha.max():g}]"
        raise ValueError(msg)
    out = (rgb if premultiplied else alpha * rgb) + (1 - alpha) * _float32(sky, "render", camera, (*size, 3))
    return out.astype(np.float32)

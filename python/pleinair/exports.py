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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _hdr, color, io
from ._inputs import Array, choice, instance, integer, light, real, shape_text, vector
from .camera import Camera

__all__ = ["Mesh", "behind", "cube_layout", "cube_map", "save_environment", "skydome", "to_world", "usda"]

# Columns are where east, north and up of our frame go in the frame with y up.
_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])

# Table 8.19 of the OpenGL 4.6 specification: centre of a face, then where s and t grow. y up.
_FACES = np.array(
    [
        [[+1, 0, 0], [0, 0, -1], [0, -1, 0]],
        [[-1, 0, 0], [0, 0, +1], [0, -1, 0]],
        [[0, +1, 0], [+1, 0, 0], [0, 0, +1]],
        [[0, -1, 0], [+1, 0, 0], [0, 0, -1]],
        [[0, 0, +1], [+1, 0, 0], [0, -1, 0]],
        [[0, 0, -1], [-1, 0, 0], [0, -1, 0]],
    ],
    dtype=float,
)


def _ask(sky: Any, method: str, *args: Any) -> Any:
    """Return `sky.method(*args)`."""
    call = getattr(sky, method, None)
    if not callable(call):
        msg = f"sky must have a method {method}, got {type(sky).__name__}"
        raise TypeError(msg)
    return call(*args)


def _float32(sky: Any, method: str, argument: Any, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return what a method of the sky gives, as float32 of the shape it must have."""
    out = np.asarray(_ask(sky, method, argument), np.float32)
    if out.shape != shape:
        msg = f"sky must give shape {shape_text(shape)} from {method}, got {shape_text(out.shape)}"
        raise ValueError(msg)
    return out


def cube_map(sky: Any, size: int) -> NDArray[np.float32]:
    """Return the six faces of a cube map, as OpenGL, Vulkan and Direct3D address them.

    In the engines' frame (X east, Y up, Z south) the faces look at +X, -X, +Y, -Y, +Z, -Z: east, west, up, down, south,
    north. With s to the right and t down, both from -1 to 1 over a face, pixels are at their centres and look at

    | face | 0: +X | 1: -X | 2: +Y | 3: -Y | 4: +Z | 5: -Z |
    |---|---|---|---|---|---|---|
    | (X, Y, Z) | (1, -t, -s) | (-1, -t, s) | (s, 1, t) | (s, -1, -t) | (s, -t, 1) | (-s, -t, -1) |

    so a face is the mirror image of what a viewer inside the cube sees, as everywhere in OpenGL.

    Parameters
    ----------
    sky : sky
        Its `radiance` is asked.
    size : int
        Edge of a face, in [1, 16384] [px].

    Returns
    -------
    ndarray (6, size, size, 3) of float32
        Radiance in the sky's unit, row 0 at t = -1.

    Raises
    ------
    ValueError, TypeError
        `size` is out of range, or `sky` is no sky.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> sky = SimpleNamespace(radiance=lambda directions: directions)  # shows its directions: east, north, up
    >>> cube_map(sky, 1)[:, 0, 0].astype(int).tolist()
    [[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, 1, 0]]
    """
    size = integer(size, "size", 1, 16384)
    s = (2 * np.arange(size) + 1) / size - 1
    out = np.empty((6, size, size, 3), np.float32)
    for face, axes in zip(out, _FACES @ _Y_UP, strict=True):
        directions = axes[0] + s[:, None] * axes[1] + s[:, None, None] * axes[2]
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        face[:] = _float32(sky, "radiance", directions, (size, size, 3))
    return out


# Row by row the faces of a layout; None is black. The lowest face of the tall cross stands on its head.
_LAYOUTS: dict[str, list[list[int | None]]] = {
    "strip": [[0, 1, 2, 3, 4, 5]],
    "cross": [[None, 2, None, None], [1, 4, 0, 5], [None, 3, None, None]],
    "tall cross": [[None, 2, None], [1, 4, 0], [None, 3, None], [None, 5, None]],
}


def cube_layout(faces: ArrayLike, kind: str = "strip") -> NDArray[np.float32]:
    """Lay the faces of a cube map out in one picture.

    Parameters
    ----------
    faces : array_like (6, size, size, 3)
        What `cube_map` returns.
    kind : str
        "strip": +X, -X, +Y, -Y, +Z, -Z from left to right, 6 x 1 faces. "cross", 4 x 3 faces: -X, +Z, +X, -Z in the
        middle, +Y above and -Y below +Z. "tall cross", 3 x 4 faces: -X, +Z, +X, above and below the same, and -Z at the
        bottom, turned by 180°. Neighbours in a cross are neighbours on the cube.

    Returns
    -------
    ndarray (height, width, 3) of float32
        The picture; what belongs to no face is 0.

    Raises
    ------
    ValueError, TypeError
        `faces` is no cube map, or `kind` is none of the three.

    Examples
    --------
    >>> cube_layout(np.zeros((6, 8, 8, 3)), "cross").shape
    (24, 32, 3)
    """
    cube = light(faces, "faces")
    if cube.ndim != 4 or cube.shape[0] != 6 or cube.shape[1] != cube.shape[2] or cube.shape[3] != 3 or cube.size == 0:
        msg = f"faces must have shape (6, size, size, 3), got {shape_text(cube.shape)}"
        raise ValueError(msg)
    rows = _LAYOUTS[choice(kind, "kind", tuple(_LAYOUTS))]
    n = cube.shape[1]
    out = np.zeros((n * len(rows), n * len(rows[0]), 3), np.float32)
    for i, row in enumerate(rows):
        for j, face in enumerate(row):
            if face is not None:
                turn = -1 if i == 3 else 1
                out[i * n : i * n + n, j * n : j * n + n] = cube[face, ::turn, ::turn]
    return out


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a colour at every vertex.

    Attributes
    ----------
    vertices : ndarray (n, 3) of float32
        Positions: x east, y north, z up [m].
    faces : ndarray (m, 3) of int32
        Vertices of the triangles, counterclockwise as seen from the side that is shown.
    colors : ndarray (n, 3) of float32
        Linear light, Rec. 709.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    colors: NDArray[np.float32]

    def write(self, path: io.PathLike, *, colors: str = "float") -> Path:
        """Write the mesh; the ending names the format.

        Parameters
        ----------
        path : path
            .ply: binary, little endian, properties x y z red green blue. .obj: lines `v x y z r g b`.
        colors : str
            "float": linear light as it is. "uchar": sRGB clipped to [0, 1]; bytes in .ply, numbers in [0, 1] in .obj.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            The ending or `colors` is none of these.

        Examples
        --------
        >>> import tempfile, pathlib
        >>> mesh = Mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32), np.eye(3, dtype=np.float32))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     print(mesh.write(pathlib.Path(folder) / "a.obj").read_text())
        v 1 0 0 1 0 0
        v 0 1 0 0 1 0
        v 0 0 1 0 0 1
        f 1 2 3
        """
        encoded = choice(colors, "colors", ("float", "uchar")) == "uchar"
        ending = Path(path).suffix.lower()
        if ending not in (".ply", ".obj"):
            msg = f"path must end in .ply or .obj, got {Path(path).name!r}"
            raise ValueError(msg)
        shown = self.colors
        if encoded:
            shown = np.rint(255 * color.srgb_encode(np.clip(self.colors, 0, 1))).astype(np.uint8)
        data = self._ply(shown) if ending == ".ply" else self._obj(shown / np.float32(255) if encoded else shown)
        return io.replacing(path, lambda stream: stream.write(data))

    def _ply(self, colors: Array) -> bytes:
        kind, code = ("uchar", "u1") if colors.dtype == np.uint8 else ("float", "<f4")
        vertices = np.empty(len(self.vertices), [("position", "<f4", 3), ("color", code, 3)])
        vertices["position"], vertices["color"] = self.vertices, colors
        faces = np.empty(len(self.faces), [("count", "u1"), ("corners", "<i4", 3)])
        faces["count"], faces["corners"] = 3, self.faces
        head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
        head += [f"property float {name}" for name in "xyz"]
        head += [f"property {kind} {name}" for name in ("red", "green", "blue")]
        head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
        return "\n".join(head).encode() + vertices.tobytes() + faces.tobytes()

    def _obj(self, colors: Array) -> bytes:
        lines = ["v " + " ".join(f"{x:.9g}" for x in row) for row in np.hstack([self.vertices, colors]).tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (self.faces + 1).tolist()]
        return ("\n".join(lines) + "\n").encode()


def skydome(sky: Any, rings: int = 64, radius: float = 1.0) -> Mesh:
    """Return a closed sphere around the origin that shows the sky to a viewer inside.

    Parameters
    ----------
    sky : sky
        Its `radiance` is asked in the direction of every vertex.
    rings : int
        Bands of faces from the zenith to the nadir, in [2, 4096] [1]; there are twice as many around.
    radius : float
        Of the sphere, above 0 [m].

    Returns
    -------
    Mesh
        2 + 2 rings (rings - 1) vertices; every edge belongs to two triangles, whose normals point inwards.

    Raises
    ------
    ValueError, TypeError
        A value is out of range, or `sky` is no sky.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> mesh = skydome(SimpleNamespace(radiance=lambda directions: np.ones_like(directions)), rings=8)
    >>> mesh.vertices.shape, mesh.faces.shape
    ((114, 3), (224, 3))
    """
    rings = integer(rings, "rings", 2, 4096)
    around = 2 * rings
    radius = real(radius, "radius", math.ulp(0.0), math.inf, "m")
    from_zenith = np.pi * np.arange(1, rings)[:, None] / rings
    azimuth = 2 * np.pi * np.arange(around) / around
    flat = np.sin(from_zenith)
    bands = np.stack(np.broadcast_arrays(flat * np.sin(azimuth), flat * np.cos(azimuth), np.cos(from_zenith)), axis=-1)
    directions = np.concatenate([[[0.0, 0, 1]], bands.reshape(-1, 3), [[0.0, 0, -1]]])
    index = 1 + np.arange(bands[..., 0].size).reshape(rings - 1, around)
    right = np.roll(index, -1, axis=1)  # towards growing azimuth, which is to the right for the viewer inside
    a, b, c, d = index[:-1], right[:-1], index[1:], right[1:]
    top, bottom = np.zeros(around, int), np.full(around, len(directions) - 1)
    faces = [(top, index[0], right[0]), (a, c, d), (a, d, b), (bottom, right[-1], index[-1])]
    return Mesh(
        (radius * directions).astype(np.float32),
        np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in faces]).astype(np.int32),
        _float32(sky, "radiance", directions, directions.shape),
    )


_CONVENTIONS = {
    "frame": "x east, y north, z up; right-handed",
    "direction": "unit vector towards the light",
    "irradiance": "of a plane that faces the light, in the panorama's unit times sr; linear, Rec. 709 primaries, D65",
    "angular_radius": "degrees",
    "sh9": "sky without the Sun's disc; orthonormal real harmonics, no Condon-Shortley sign, z up, (l, m) = (0, 0), (1, -1), (1, 0), (1, 1), (2, -2) to (2, 2); RGB",
    "panorama": "OpenEXR lat-long: row 0 at the zenith, column 0 at north, azimuth grows to the right, pixel centres",
}


def save_environment(
    sky: Any,
    path: io.PathLike,
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
        .exr (marked as a lat-long environment map), .hdr, .pfm, or .png and .jpg, which clip to [0, 1].
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
            "irradiance": [scale * e for e in vector(sun.irradiance, "sun_light().irradiance")],
            "angular_radius": real(sun.angular_radius, "sun_light().angular_radius", 0, 180, "°"),
            "sh9": (scale * np.asarray(_ask(sky, "sh9"), float)).tolist(),
            "conventions": _CONVENTIONS,
        }
        sky = _ask(sky, "without_disc") if hasattr(sky, "without_disc") else sky
        text = json.dumps(description, indent=1, allow_nan=False).encode()
    picture = _float32(sky, "panorama", height, (height, 2 * height, 3)) * np.float32(scale)
    if path.suffix.lower() == ".exr":
        data = _hdr.encode(
            ".exr", picture, half=half, compression=compression, tolerance=tolerance, attributes=_hdr.latlong()
        )
        io.replacing(path, lambda stream: stream.write(data))
    else:
        io.write(path, picture, half=half, compression=compression, tolerance=tolerance)
    if text is not None:
        io.replacing(path.with_suffix(".json"), lambda stream: stream.write(text))
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


_STAGE = """#usda 1.0
(
    defaultPrim = "Environment"
    metersPerUnit = 1
    upAxis = "{up}"
)

def Xform "Environment"
{{
    def DomeLight "Sky"
    {{
        float inputs:intensity = 1
        asset inputs:texture:file = @{panorama}@
        token inputs:texture:format = "latlong"
        matrix4d xformOp:transform = {transform}
        uniform token[] xformOpOrder = ["xformOp:transform"]
    }}
{sun}}}
"""

# A DistantLight shines along its -z; normalize makes its intensity an irradiance.
_SUN = """
    def DistantLight "Sun"
    {{
        float inputs:angle = {angle:.9g}
        color3f inputs:color = ({red:.9g}, {green:.9g}, {blue:.9g})
        float inputs:intensity = {intensity:.9g}
        bool inputs:normalize = 1
        matrix4d xformOp:transform = {transform}
        uniform token[] xformOpOrder = ["xformOp:transform"]
    }}
"""


def _matrix4d(rotation: NDArray[np.float64]) -> str:
    """Return a rotation for column vectors as USD writes it, for row vectors."""
    rows = np.eye(4)
    rows[:3, :3] = rotation.T
    return "( " + ", ".join("(" + ", ".join(f"{x + 0.0:.17g}" for x in row) + ")" for row in rows) + " )"


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


def usda(panorama: io.PathLike, sun_light: Any = None, *, up: str = "z") -> str:
    """Return a USD scene description with the sky as a DomeLight and the Sun as a DistantLight.

    Parameters
    ----------
    panorama : path
        Of the picture, as the .usda file will name it (relative to itself, or absolute).
    sun_light : SunLight or None
        With `direction`, `irradiance` and `angular_radius` [°]; None leaves the Sun out.
    up : str
        Axis of the stage: "z" (x east, y north) or "y" (x east, z south).

    Returns
    -------
    str
        The text of a .usda file.

    Raises
    ------
    ValueError, TypeError
        A value is not one of these.

    Examples
    --------
    >>> print(usda("sky.exr").splitlines()[0])
    #usda 1.0
    """
    name = Path(panorama).as_posix()
    if "@" in name or not name.isprintable():
        msg = f"panorama must be printable without '@', got {name!r}"
        raise ValueError(msg)
    axis = choice(up, "up", ("z", "y"))
    sun = ""
    if sun_light is not None:
        irradiance = vector(sun_light.irradiance, "sun_light.irradiance", 0)
        intensity = max(irradiance)
        red, green, blue = (e / intensity if intensity else 1.0 for e in irradiance)
        sun = _SUN.format(
            intensity=intensity,
            red=red,
            green=green,
            blue=blue,
            angle=2 * real(sun_light.angular_radius, "sun_light.angular_radius", 0, 90, "°"),
            transform=_matrix4d(_facing(vector(sun_light.direction, "sun_light.direction"), axis)),
        )
    transform = _matrix4d(to_world("usd", axis)[:3, :3])
    return _STAGE.format(up=axis.upper(), panorama=name, transform=transform, sun=sun)


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
    layer = light(rgba, "rgba")
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

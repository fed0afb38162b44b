"""How a cloud looks: parameters, conventions, pictures. Public as `pleinair.clouds`."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._inputs import Progress, array, choice, instance, light, real, reporter, shape_text, vector
from ._orders import Paths
from ._volumes import Volume
from .astro import Sun
from .camera import Camera


@dataclass(frozen=True)
class Params:
    """The rendering parameters of Table 1 of the paper.

    Parameters
    ----------
    light_intensity : float
        Intensity of the light on the cloud, L_in, at least 0 [1].
    light_color : tuple of float
        Its colour, c_in, linear RGB, at least 0 [1].
    g : float
        Asymmetry of the Henyey-Greenstein phase function, in [-0.999, 0.999], positive is forward [1].
    sigma_t : float
        Extinction per metre and unit of density, at least 0 [1/m].
    albedo : float
        Single-scattering albedo β, in [0, 1] [1]. In single scattering only its product with the intensity shows.
    ambient : float
        Ambient light L_amb, at least 0 [1].
    haze : tuple of float
        Extinction of the air κ_a for R, G, B per unit of haze distance, at least 0 [1].
    ambient_color : tuple of float, optional
        Colour of the ambient light, linear RGB, at least 0 [1]; by default the light's.
    haze_height : float
        Height H over which the air thins out by e, in [1, 1e9] [m]; counts with `Conventions(haze="height")` alone.

    Raises
    ------
    ValueError, TypeError
        A value is not a number in its range.

    Examples
    --------
    >>> Params(g=0.7).g
    0.7
    """

    light_intensity: float = 1.0
    light_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    g: float = 0.85
    sigma_t: float = 0.05
    albedo: float = 0.99
    ambient: float = 0.1
    haze: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ambient_color: tuple[float, float, float] | None = None
    haze_height: float = 8000.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "light_intensity", real(self.light_intensity, "light_intensity", 0, 1e30))
        put(self, "light_color", vector(self.light_color, "light_color", 0, 1e30))
        put(self, "g", real(self.g, "g", -0.999, 0.999))
        put(self, "sigma_t", real(self.sigma_t, "sigma_t", 0, 1e9, "1/m"))
        put(self, "albedo", real(self.albedo, "albedo", 0, 1))
        put(self, "ambient", real(self.ambient, "ambient", 0, 1e30))
        put(self, "haze", vector(self.haze, "haze", 0, 1e30))
        if self.ambient_color is not None:
            put(self, "ambient_color", vector(self.ambient_color, "ambient_color", 0, 1e30))
        put(self, "haze_height", real(self.haze_height, "haze_height", 1, 1e9, "m"))

    def to_json(self) -> str:
        """Return the parameters as JSON.

        Examples
        --------
        >>> Params.from_json(Params(g=0.7).to_json()) == Params(g=0.7)
        True
        """
        return json.dumps(dataclasses.asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Params:
        """Return parameters from what `to_json` gave.

        Parameters
        ----------
        text : str
            A JSON object with the names of the parameters.

        Raises
        ------
        ValueError
            The text is not JSON or holds other names.

        Examples
        --------
        >>> Params.from_json('{"g": 0.5}').g
        0.5
        """
        try:
            values = json.loads(text)
            names = {f.name for f in dataclasses.fields(cls)}
            if not isinstance(values, dict) or not values.keys() <= names:
                raise ValueError(f"the names must be among {sorted(names)}")
            given: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
            return cls(**given)
        except (ValueError, TypeError) as error:
            msg = f"text must be a JSON object of parameters: {error}"
            raise ValueError(msg) from None


@dataclass(frozen=True)
class Conventions:
    """How parameters get their meaning, where the paper leaves it open; `Conventions.paper()` is its letter.

    Parameters
    ----------
    ambient : {"extinction", "paper"}
        The ambient term of eq 5: L_amb (1 − exp(−σ S)), which tends to L_amb in an opaque cloud, or the printed one,
        which is divided by σ and so depends on the unit of length.
    phase : {"mean-one", "integral-one"}
        Whether the phase function has mean 1 or integral 1 over the sphere.
    interpolation : {"cubic", "linear"}
        Between the extinctions of a basis: cubic in log σ, or linear in σ.
    haze : {"unit", "distance", "height"}
        The distance t_c of eq 3: 1 for every pixel, or the distance to the cloud over its mean, or, over its mean, the
        path in air whose density falls off with height as exp(−z / H), H being `Params.haze_height`.
    light : {"uniform", "air"}
        Whether the Sun's light has one colour for the whole cloud, or has come through that same air and is dimmer and
        of another colour where the cloud is low (needs haze="height"; `light_color` is that of the cloud's top).

    Raises
    ------
    ValueError
        A word is none of these, or light="air" stands without haze="height".

    Examples
    --------
    >>> Conventions.paper()
    Conventions(ambient='paper', phase='mean-one', interpolation='linear', haze='unit', light='uniform')
    """

    ambient: str = "extinction"
    phase: str = "mean-one"
    interpolation: str = "cubic"
    haze: str = "unit"
    light: str = "uniform"

    def __post_init__(self) -> None:
        choice(self.ambient, "ambient", ("extinction", "paper"))
        choice(self.phase, "phase", ("mean-one", "integral-one"))
        choice(self.interpolation, "interpolation", ("cubic", "linear"))
        choice(self.haze, "haze", ("unit", "distance", "height"))
        choice(self.light, "light", ("uniform", "air"))
        if self.light == "air" and self.haze != "height":
            msg = f"light must be 'uniform' unless haze is 'height', got 'air' with haze {self.haze!r}"
            raise ValueError(msg)

    @classmethod
    def paper(cls) -> Conventions:
        """Return the conventions of the paper's letter.

        Examples
        --------
        >>> Conventions.paper().ambient
        'paper'
        """
        return cls(ambient="paper", interpolation="linear")

    @property
    def words(self) -> tuple[str, str, str]:
        """What the core is told."""
        return self.ambient, self.phase, self.interpolation


@dataclass(frozen=True, eq=False)
class CloudImage:
    """A rendered cloud and what it is made of.

    Attributes
    ----------
    rgb : ndarray (height, width, 3) of float32
        The picture, L_cg of eq 3, linear light.
    single, multiple : ndarray (height, width, 3) of float32
        Light scattered once, and more often, before haze.
    transmittance : ndarray (height, width) of float32
        Of the cloud, in [0, 1] [1].
    distance : ndarray (height, width) of float32
        From the eye to the first density, infinite where there is none [m].
    """

    rgb: NDArray[np.float32]
    single: NDArray[np.float32]
    multiple: NDArray[np.float32]
    transmittance: NDArray[np.float32]
    distance: NDArray[np.float32]

    def __repr__(self) -> str:
        height, width, _ = self.rgb.shape
        return f"CloudImage({width}x{height}, {(self.transmittance < 1).mean():.0%} cloud)"


def check_scene(cloud: Volume, camera: Camera, sun: Sun) -> None:
    """Refuse what is no scene."""
    instance(cloud, "cloud", Volume)
    instance(camera, "camera", Camera)
    instance(sun, "sun", Sun)


def sky_pixels(sky: Any, camera: Camera) -> NDArray[np.float32]:
    """Return the sky behind a picture as float32 (height, width, 3): a colour, a picture or a sky with `render`."""
    size = (camera.height, camera.width, 3)
    if sky is None:
        return np.zeros(size, np.float32)
    if hasattr(sky, "render"):
        sky = sky.render(camera)
    pixels = light(sky, "sky", last=3) if np.ndim(sky) > 1 else array(sky, "sky", last=3)
    if pixels.shape not in ((3,), size):
        msg = f"sky must be a colour (3,), a picture {shape_text(size)} or a sky, got {shape_text(pixels.shape)}"
        raise ValueError(msg)
    if not (np.abs(pixels) <= 1e30).all():
        msg = "sky must be finite and at most 1e30 in magnitude, got NaN, infinity or more"
        raise ValueError(msg)
    return np.ascontiguousarray(np.broadcast_to(pixels, size), dtype=np.float32)


View = tuple[Camera, Sun, Conventions]
"""From where, lit from where, and how parameters are read."""
AirPaths = tuple[NDArray[np.float32] | None, NDArray[np.float32] | None]


def air_paths(distance: NDArray[np.float32], view: View, haze_height: float) -> AirPaths:
    """Return t_c of eq 3 for each pixel (None: 1 everywhere) and that of the light before it (None: 0 everywhere)."""
    camera, sun, conventions = view
    if conventions.haze == "unit":
        return None, None
    if conventions.haze == "distance":
        seen = distance[np.isfinite(distance)]
        return distance / np.float32(seen.mean() if seen.size else 1.0), None
    far, light = _core.clouds_haze(distance, camera, sun.direction, haze_height)
    return far.reshape(distance.shape), light.reshape(distance.shape) if conventions.light == "air" else None


def compose(
    parts: tuple[NDArray[np.float32], ...],
    nodes: list[float],
    params: Params,
    sky: NDArray[np.float32],
    view: View,
    multiple: NDArray[np.float32] | None = None,
) -> CloudImage:
    """Return the picture of `params` from depth, distance, cosine, single-scattered light and that of higher orders."""
    depth, distance, cosine, scattered = parts
    rgb, single = np.empty((*depth.shape, 3), np.float32), np.empty((*depth.shape, 3), np.float32)
    transmittance = np.empty(depth.shape, np.float32)
    conventions = view[2]
    far, before = air_paths(distance, view, params.haze_height)
    _core.clouds_compose(
        depth,
        cosine,
        scattered,
        nodes,
        multiple,
        sky,
        far,
        before,
        params,
        conventions.words,
        rgb,
        single,
        transmittance,
    )
    more = np.zeros_like(single)
    if multiple is not None:
        scale = params.light_intensity * (1.0 if conventions.phase == "mean-one" else 1 / (4 * np.pi))
        more += multiple[..., None] * np.array(params.light_color, np.float32) * np.float32(scale)
    return CloudImage(rgb, single, more, transmittance, distance)


def march(
    cloud: Volume,
    camera: Camera,
    sun: Sun,
    sigmas: list[float],
    method: str,
    progress: Progress,
    what: str,
    paths: Paths | None = None,
) -> tuple[tuple[NDArray[np.float32], ...], tuple[NDArray[np.uint32], NDArray[np.float32]] | None]:
    """Return images of depth, distance, cosine and single-scattered light; and pixels and images of higher orders."""
    callback, close = reporter(progress, what)
    try:
        depth, distance, cosine, scattered, more = _core.clouds_march(
            cloud.density,
            cloud.density.shape,
            cloud.voxel_size,
            cloud.origin,
            camera,
            sun.direction,
            sigmas,
            method,
            paths,
            callback,
        )
    finally:
        close()
    size = (camera.height, camera.width)
    images = depth.reshape(size), distance.reshape(size), cosine.reshape(size), scattered.reshape(-1, *size)
    return images, more


def smooth(
    images: NDArray[np.float32],
    light: NDArray[np.float64],
    pixels: NDArray[np.uint32],
    depth: NDArray[np.float32],
    single: NDArray[np.float32],
    sigmas: list[float],
    progress: Progress,
) -> NDArray[np.float64]:
    """Smooth sampled images of `pixels` in place, guided by depth and single-scattered light at a few extinctions.

    `light` is the root mean square of all light where each image belongs. Returns their noise before, relative to it.
    """
    path = depth.reshape(-1)[pixels]
    guides = [np.ones_like(path)] + [image.reshape(-1)[pixels] for image in single]
    guides += [-np.expm1(-np.float32(sigma) * path) for sigma in sigmas]
    callback, close = reporter(progress, "smoothing")
    try:
        flat = light.reshape(-1).tolist()
        return np.array(_core.clouds_smooth(images, pixels, depth.shape[1], np.stack(guides), flat, callback))
    finally:
        close()

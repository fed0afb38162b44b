"""Pictures of a participating medium. Public as `pleinair.clouds`.

Ray marching for single scattering (eqs 3 to 5), composition of the orders, haze as aerial perspective, denoising.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import clouds_compose, clouds_guided_filter, clouds_haze, clouds_march
from .._support.inputs import Aligned, Progress, array, instance, linear_light, reporter, shape_text
from ..astro import Sun
from ..camera import Camera
from .order_groups import PathSettings
from .params import Conventions, Params
from .volume import Volume


@dataclass(frozen=True, eq=False)
class CloudImage(Aligned):
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
    pixels = linear_light(sky, "sky", last=3) if np.ndim(sky) > 1 else array(sky, "sky", last=3)
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
    far, light = clouds_haze(distance, camera, sun.direction, haze_height)
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
    clouds_compose(
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
    paths: PathSettings | None = None,
) -> tuple[tuple[NDArray[np.float32], ...], tuple[NDArray[np.uint32], NDArray[np.float32]] | None]:
    """Return images of depth, distance, cosine and single-scattered light; and pixels and images of higher orders."""
    callback, close = reporter(progress, what)
    try:
        depth, distance, cosine, scattered, more = clouds_march(
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
        return np.array(clouds_guided_filter(images, pixels, depth.shape[1], np.stack(guides), flat, callback))
    finally:
        close()

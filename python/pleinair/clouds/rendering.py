"""Rendering a cloud as a participating medium. Public as `pleinair.clouds.render`.

Single scattering by ray marching, higher orders by path tracing, or the reference of both.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._support.docs import documented
from .._support.inputs import Progress, choice, instance, integer, key
from ..astro import Sun
from ..camera import Camera
from .images import CloudImage, check_scene, compose, march, sky_pixels, smooth
from .order_groups import PathSettings, checked, together
from .params import Conventions, Params
from .volume import Volume


@documented
def render(
    cloud: Volume,
    params: Params,
    camera: Camera,
    sun: Sun,
    *,
    sky: Any = None,
    orders: int | None = 1,
    samples: int = 64,
    denoise: bool = True,
    rng: Any = None,
    method: str = "fast",
    conventions: Conventions | None = None,
    progress: Progress = None,
) -> CloudImage:
    """Render a cloud in front of a sky (eqs 3-9).

    Parameters
    ----------
    cloud : Volume
        The density.
    params : Params
        The light and the particles.
    camera : Camera
        From where.
    sun : Sun
        Direction of the light.
    sky : array_like (3,) or (height, width, 3), optional
        Linear light behind the cloud; black where it is not given.
    orders : int or None
        Orders of scattering: 1 is single scattering, the paper has 4, None is all of them [1].
    samples : int
        PathSettings of a pixel for the orders from 2 on, at least 1 [1]. The error falls like its square root.
    denoise : bool
        Smooth the light of these orders, guided by optical depth and single-scattered light, more where there is more
        noise. Without it is unbiased and noisy; that of the reference method always is.
    rng : None, int, SeedSequence, BitGenerator or Generator
        Of the paths. Same `rng`, same picture, whatever the number of threads.
    method : {"fast", "reference"}
        The reference has exact depths to the Sun, adaptive quadrature in float64 for the first order and the plain
        estimator, without branches, for the others (slow: the oracle of the tests).
    conventions : Conventions, optional
        Readings of the paper.
    {progress}

    Returns
    -------
    CloudImage
        The picture and its parts.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range or of the wrong shape.

    Examples
    --------
    >>> from pleinair import Camera, Sun
    >>> cloud = Volume(np.ones((4, 4, 4)), 25.0)
    >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
    >>> image = render(cloud, Params(sigma_t=0.02), camera, Sun(45, 180), sky=(0.2, 0.4, 0.8))
    >>> image.rgb.shape, float(image.transmittance[0, 0])
    ((24, 32, 3), 1.0)
    """
    orders = checked(orders)
    choice(method, "method", ("fast", "reference"))
    conventions = instance(Conventions() if conventions is None else conventions, "conventions", Conventions)
    check_scene(cloud, camera, sun)
    instance(params, "params", Params)
    samples, seed = integer(samples, "samples", 1, 10**9), key(rng)
    background = sky_pixels(sky, camera)
    paths, sigmas = None, [params.sigma_t]
    if orders != 1 and params.albedo > 0 and params.sigma_t > 0:
        sum_up = together(orders)
        paths = PathSettings([params.g], [params.sigma_t], 1, sum_up, orders is None, params.albedo, samples, seed)
        if denoise and method == "fast":
            sigmas = [params.sigma_t * share for share in (0.05, 0.25, 1.0)]
    parts, more = march(cloud, camera, sun, sigmas, method, progress, "cloud", paths)
    single = parts[3]
    parts = (*parts[:3], single[-1:])
    multiple = None
    if more is not None:
        pixels, light = more
        if len(sigmas) > 1 and pixels.size:
            scale = np.array([np.sqrt(np.square(light, dtype=np.float64).mean())])
            smooth(light, scale, pixels, parts[0], single, sigmas, progress)
        multiple = np.zeros(parts[0].shape, np.float32)
        multiple.reshape(-1)[pixels] = light
    return compose(parts, [params.sigma_t], params, background, (camera, sun, conventions), multiple)

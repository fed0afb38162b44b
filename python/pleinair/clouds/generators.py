"""Procedural and simulated clouds. Public as `pleinair.clouds`.

Kinds such as cumulus, stratocumulus and cirrus by noise, and a fluid simulation of buoyant moist air on a grid.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import clouds_procedural, clouds_simulated
from .._support.docs import documented
from .._support.inputs import DomainWarning, Progress, array, choice, integer, key, real, reporter, vector
from .volume import Volume, triple

KINDS = ("cumulus", "cumulonimbus", "stratocumulus", "cirrus")


def _shape(shape: Any, high: int) -> tuple[int, int, int]:
    try:
        nz, ny, nx = shape
    except (TypeError, ValueError):
        msg = f"shape must be (nz, ny, nx), got {shape!r}"
        raise ValueError(msg) from None
    return integer(nz, "shape[0]", 8, high), integer(ny, "shape[1]", 8, high), integer(nx, "shape[2]", 8, high)


@documented
def procedural(
    kind: str = "cumulus",
    shape: tuple[int, int, int] = (96, 160, 160),
    *,
    voxel_size: Any = 20.0,
    origin: ArrayLike = (0.0, 0.0, 800.0),
    rng: Any = None,
    progress: Progress = None,
) -> Volume:
    """Grow a cloud.

    Parameters
    ----------
    kind : {"cumulus", "cumulonimbus", "stratocumulus", "cirrus"}
        A fair-weather heap with a flat base; a tower with an anvil; a layer of cells that fills its box from side to
        side; thin streaks of falling ice. See the notes for the boxes that suit them.
    shape : tuple of int
        Voxels (nz, ny, nx), each in [8, 4096] [1].
    voxel_size : float or array_like (3,)
        Edge of a voxel, or its edges along x, y, z [m].
    origin : array_like (3,)
        Lowest corner of the box [m].
    {rng}
    {progress}

    Returns
    -------
    Volume
        Density in [0, 1], clear at all faces of its box; a stratocumulus at the lowest and highest only.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Notes
    -----
    Heaps of spheres with eroded surfaces, after Ebert et al. 2009; sheets and streaks of noise. Forms are made in
    voxels: they fill whatever box they are given, and `voxel_size` stretches them.

    Examples
    --------
    >>> procedural("cumulus", (24, 40, 40), rng=3) == procedural("cumulus", (24, 40, 40), rng=3)
    True
    >>> deck = procedural("stratocumulus", (16, 48, 48), voxel_size=(50, 50, 25), rng=3)
    >>> bool((deck.density.max(axis=0) > 0).mean() > 0.6)
    True
    """
    choice(kind, "kind", KINDS)
    size = _shape(shape, 4096)
    edges, low = triple(voxel_size, "voxel_size"), vector(origin, "origin")
    callback, close = reporter(progress, kind)
    try:
        density = clouds_procedural(kind, size, key(rng), callback)
    finally:
        close()
    return Volume(density.reshape(size), edges, low)


@dataclass(frozen=True)
class _Weather:
    """What the core reads."""

    shape: tuple[int, int, int]
    voxel_size: tuple[float, float, float]
    times: list[float]
    step: float
    surface_heat_flux: float
    radius: float
    perturbation: float
    temperature: float
    humidity: float
    lapse: float
    confinement: float
    key: int
    keep_all_fields: bool = False


@overload
def simulated(
    shape: tuple[int, int, int] = ...,
    *,
    voxel_size: Any = ...,
    origin: ArrayLike = ...,
    duration: float = ...,
    times: None = None,
    step: float = ...,
    heat: float = ...,
    radius: float | None = ...,
    unevenness: float = ...,
    temperature: float = ...,
    humidity: float = ...,
    lapse: float = ...,
    confinement: float = ...,
    rng: Any = ...,
    progress: Progress = ...,
) -> Volume: ...
@overload
def simulated(
    shape: tuple[int, int, int] = ...,
    *,
    voxel_size: Any = ...,
    origin: ArrayLike = ...,
    duration: float = ...,
    times: ArrayLike,
    step: float = ...,
    heat: float = ...,
    radius: float | None = ...,
    unevenness: float = ...,
    temperature: float = ...,
    humidity: float = ...,
    lapse: float = ...,
    confinement: float = ...,
    rng: Any = ...,
    progress: Progress = ...,
) -> list[Volume]: ...
@documented
def simulated(
    shape: tuple[int, int, int] = (64, 64, 64),
    *,
    voxel_size: Any = 32.0,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    duration: float = 1100.0,
    times: ArrayLike | None = None,
    step: float = 10.0,
    heat: float = 500.0,
    radius: float | None = None,
    unevenness: float = 0.5,
    temperature: float = 298.0,
    humidity: float = 0.7,
    lapse: float = 0.0058,
    confinement: float = 0.15,
    rng: Any = None,
    progress: Progress = None,
) -> Volume | list[Volume]:
    """Simulate a cumulus that grows over a warm patch of ground.

    Parameters
    ----------
    shape : tuple of int
        Voxels (nz, ny, nx), each in [8, 512] [1]. The box begins at the ground and holds the air below the cloud too.
    voxel_size : float or array_like (3,)
        Edge of a voxel, or its edges along x, y, z, in [1, 1000] [m]. The box may be 100 m to 16 km high.
    origin : array_like (3,)
        Lowest corner of the box, on the ground [m].
    duration : float
        How long the air is warmed, in (0, 86400] [s].
    times : array_like (n,), optional
        Times to return, rising, in [0, 86400] [s]; instead of `duration`.
    step : float
        Longest time step, in [0.01, 60] [s]. Shorter ones are taken where the wind asks for them, so any is stable.
    heat : float
        Heat from the middle of the patch, in [0, 20000] [W/m²].
    radius : float, optional
        Distance at which it has fallen to 1/e, in [1, 1e6] [m]; about a third of the box's shorter side.
    unevenness : float
        How unevenly the patch heats, in [0, 1] [1]; with 0 the cloud is as symmetric as its box.
    temperature : float
        Temperature at the ground, in [250, 320] [K].
    humidity : float
        Relative humidity at the ground, in [0.01, 0.95] [1].
    lapse : float
        Fall of temperature with height above the mixed layer, in [0, 0.00976] [K/m]. Steeper is more unstable.
    confinement : float
        Strength of the vorticity confinement, in [0, 0.5] [1]. More of it would feed eddies without end.
    {rng}
    {progress}

    Returns
    -------
    Volume or list of Volume
        The cloud at the end, or at each of `times`. Its density is the mass of droplets divided by the largest anywhere
        in what is returned.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Warns
    -----
    DomainWarning
        No droplets have formed at any of the times.

    Notes
    -----
    Moist Boussinesq air after Miyazaki, Dobashi and Nishita 2002, in a closed box whose walls let slip. The air is
    mixed up to nine tenths of the height at which it condenses (about 125 m for each kelvin between temperature and
    dew point), conditionally unstable above, and capped by an inversion in the uppermost fifth of the box.

    Examples
    --------
    >>> cloud = simulated((24, 16, 16), voxel_size=100.0, duration=900, rng=1)
    >>> float(cloud.density.max()), float(cloud.density[0].max())
    (1.0, 0.0)
    """
    weather = _weather(
        shape,
        voxel_size,
        duration,
        times,
        step,
        heat,
        radius,
        unevenness,
        temperature,
        humidity,
        lapse,
        confinement,
        rng,
    )
    low = vector(origin, "origin")
    callback, close = reporter(progress, "simulation")
    try:
        clouds, _, _ = clouds_simulated(weather, callback)
    finally:
        close()
    peak = max(float(cloud.max()) for cloud in clouds)
    if peak == 0:
        warnings.warn("no cloud has formed: more heat, humidity, height or time", DomainWarning, stacklevel=2)
        peak = 1.0
    volumes = [Volume((cloud / np.float32(peak)).reshape(weather.shape), weather.voxel_size, low) for cloud in clouds]
    return volumes[0] if times is None else volumes


def _weather(
    shape: Any,
    voxel_size: Any,
    duration: Any,
    times: Any,
    step: Any,
    heat: Any,
    radius: Any,
    unevenness: Any,
    temperature: Any,
    humidity: Any,
    lapse: Any,
    confinement: Any,
    rng: Any,
) -> _Weather:
    size, edges = _shape(shape, 512), triple(voxel_size, "voxel_size", 1.0, 1000.0)
    real(size[0] * edges[2], "shape[0] * voxel_size[2]", 100, 16_000, "m")
    if times is None:
        moments = [real(duration, "duration", 1e-3, 86_400, "s")]
    else:
        rising: NDArray[np.float64] = array(times, "times", dtypes=(np.float64,), ndim=1)
        moments = [real(t, f"times[{i}]", 0, 86_400, "s") for i, t in enumerate(rising)]
        if not moments or (np.diff(rising) < 0).any():
            msg = f"times must rise and hold at least one, got {rising.tolist()}"
            raise ValueError(msg)
    patch = (
        0.32 * min(size[1] * edges[1], size[2] * edges[0]) if radius is None else real(radius, "radius", 1, 1e6, "m")
    )
    return _Weather(
        size,
        edges,
        moments,
        real(step, "step", 0.01, 60, "s"),
        real(heat, "heat", 0, 20_000, "W/m²"),
        patch,
        real(unevenness, "unevenness", 0, 1),
        real(temperature, "temperature", 250, 320, "K"),
        real(humidity, "humidity", 0.01, 0.95),
        real(lapse, "lapse", 0, 0.00976, "K/m"),
        real(confinement, "confinement", 0, 0.5),
        key(rng),
    )

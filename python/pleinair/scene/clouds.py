"""Clouds of a scene: traced once for a still Sun, seen from any camera nearby, with shadows. Public as `pleinair.scene`.

A cloud is traced in a picture that holds its box, from a place on a grid near the eye whose step is a fiftieth of the distance;
a frame looks that picture up, moved by the distance of each pixel (`src/scene/cloud.rs`). So a frame is a pure function of
its camera and Sun, in any order, and a moving camera traces anew only when it has come to another place of the grid. What a cloud
leaves of a lamp's light on what lies behind it is read from a picture of the cloud seen from the lamp.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import scene_cloud
from .._support.inputs import instance, vector
from ..astro import Sun
from ..camera import Camera
from ..clouds import Params, Volume, render
from .report import tell

# Paths of a traced picture, for each of its pixels at least and at most [1], and its widest [px].
_PATHS, _FEWEST, _MOST, _WIDEST = 450_000, 16, 96, 448
# Lamps are taken to stand on a grid of this step when light in a cloud is followed [°].
_STEP = 1 / 16
# Pixels of a frame that one traced pixel is for, in a frame this wide [px].
_FRAME = 320
# A place near the eye, in the distance of the box [1], and when the eye is too near for that, in its size [1].
_GRID, _NEAR = 1 / 48, 0.3
# Size of the picture from a lamp [px], and how far away the lamp is, in the box's size [1].
_SHADOW, _LAMP = 192, 200.0
# Traced pictures that are kept.
_KEPT = 24

# Lamps and their shares of the light [1].
Lamps = Sequence[tuple[float, Sun]]
# Directions of the pixels of a camera.
Looks = Callable[[Camera], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Cloud:
    """A cloud of a scene.

    Parameters
    ----------
    volume : Volume
        The density.
    params : Params, optional
        Its particles, and factors of the scene's own light: `light_intensity` of the brightest lamp, `light_color` of its colour,
        `ambient` (and `ambient_color`) of the sky's. By default a white cloud in all of both. `haze` is left out: the scene's air
        is before it.
    position : tuple of float
        By which the volume is moved: x east, y north, z up [m].
    drift : tuple of float
        How it is carried along, from where it stands at the scene's time 0 [m/s].

    Raises
    ------
    ValueError, TypeError
        A value is of the wrong kind or not finite.

    Examples
    --------
    >>> from pleinair.clouds import procedural
    >>> Cloud(procedural("cumulus", (8, 12, 12), rng=1), position=(0, 900, 0), drift=(8, 0, 0)).at(60)
    (480.0, 900.0, 0.0)
    """

    volume: Volume
    params: Params | None = None
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.volume, "volume", Volume)
        if self.params is not None:
            instance(self.params, "params", Params)
        put(self, "position", vector(self.position, "position"))
        put(self, "drift", vector(self.drift, "drift"))

    def at(self, time: float) -> tuple[float, float, float]:
        """Return by how much the volume is moved at a time [m].

        Parameters
        ----------
        time : float
            The scene's [s].

        Returns
        -------
        tuple of float
            x east, y north, z up [m].

        Examples
        --------
        See `Cloud`.
        """
        x, y, z = (p + time * d for p, d in zip(self.position, self.drift, strict=True))
        return x, y, z


@dataclass(frozen=True, eq=False)
class Seen:
    """What a camera sees of a cloud: light, transmittance [1] and distance [m] along some directions."""

    rgb: NDArray[np.float32]
    transmittance: NDArray[np.float32]
    distance: NDArray[np.float32]


def _lit(found: Seen, params: Params) -> Seen:
    """Return what is seen of a cloud, traced in light of strength one, in the light of parameters."""
    sun = np.array(params.light_color, np.float32) * np.float32(params.light_intensity)
    color = params.light_color if params.ambient_color is None else params.ambient_color
    sky = np.array(color, np.float32) * np.float32(params.ambient)
    return replace(found, rgb=found.rgb * sun + (1 - found.transmittance)[..., None] * sky)


@dataclass(frozen=True, eq=False)
class _Traced:
    """A picture of a cloud, from a place in the volume's own frame."""

    volume: Volume
    camera: Camera
    rgb: NDArray[np.float32]
    transmittance: NDArray[np.float32]
    distance: NDArray[np.float32]

    def look(self, eye: NDArray[np.float64], directions: NDArray[np.float64]) -> Seen:
        flat = np.ascontiguousarray(directions.reshape(-1, 3), np.float64)
        out = np.empty((len(flat), 5), np.float32)
        scene_cloud(self.camera, self.rgb, self.transmittance, self.distance, eye.tolist(), flat, out)
        shape = directions.shape[:-1]
        return Seen(out[:, :3].reshape(*shape, 3), out[:, 3].reshape(shape), out[:, 4].reshape(shape))


_cache: OrderedDict[Any, _Traced] = OrderedDict()


def _kept(key: Any, make: Any) -> _Traced:
    """Return what is kept under a key, or make it; the pictures used longest ago are forgotten."""
    found = _cache.pop(key, None)
    tell("shadows of clouds" if key[-1] == "shadow" else "clouds", found is None)
    if found is None:
        found = make()
    _cache[key] = found
    while len(_cache) > _KEPT:
        _cache.popitem(last=False)
    return found


def _corners(volume: Volume) -> NDArray[np.float64]:
    low, high = volume.bounds
    return np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)])


def in_frustum(volume: Volume, offset: Any, camera: Camera) -> bool:
    """Return whether the box of a cloud may be in the picture."""
    x, y, z = camera._axes() @ (_corners(volume) + offset - camera.position).T
    up = math.tan(math.radians(0.5 * camera.fov))
    across = up * camera.width / camera.height
    # Out of view if all corners are beyond one side.
    return not any(bool((side < 0).all()) for side in (z, z * across - x, z * across + x, z * up - y, z * up + y))


def _frame(volume: Volume, offset: Any, camera: Camera) -> tuple[slice, slice]:
    """Return the rows and columns of a picture that the box of a cloud is within."""
    x, y, z = camera._axes() @ (_corners(volume) + offset - camera.position).T
    if z.min() <= 1e-6:
        return slice(0, camera.height), slice(0, camera.width)
    scale = 0.5 * camera.height / math.tan(math.radians(0.5 * camera.fov))
    column, row = 0.5 * camera.width + scale * x / z, 0.5 * camera.height - scale * y / z
    rows, columns = (
        slice(max(0, math.floor(v.min()) - 2), min(n, max(0, math.ceil(v.max()) + 2)))
        for v, n in ((row, camera.height), (column, camera.width))
    )
    return rows, columns


def _place(volume: Volume, eye: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the place of the grid from which a cloud is traced for an eye, None for an eye within or beside it."""
    low, high = volume.bounds
    away = float(np.linalg.norm(np.maximum(np.maximum(low - eye, eye - high), 0)))
    if away < _NEAR * float(np.linalg.norm(high - low)):
        return None
    step = 2.0 ** math.floor(math.log2(_GRID * away))
    return np.asarray(np.round(eye / step) * step)


def _direct(
    volume: Volume, params: Params, lamps: Lamps, camera: Camera, offset: NDArray[np.float64], looks: Looks
) -> Seen:
    """Trace a cloud for a frame itself: the eye is in it."""
    small = min(1.0, _FRAME / camera.width)
    view = camera.resized(max(1, round(camera.width * small)), max(1, round(camera.height * small)))
    view = replace(view, position=tuple((np.array(camera.position) - offset).tolist()))
    traced = _mixed(volume, params, lamps, view)
    return _lit(traced.look(np.array(view.position), looks(camera)), params)


def _mixed(volume: Volume, params: Params, lamps: Lamps, view: Camera) -> _Traced:
    """Return a picture of a cloud in the light of some lamps, each with its share."""
    (first, lamp), *others = lamps
    found = _traced(volume, params, lamp, view)
    if not others:
        return found
    rgb = np.float32(first) * found.rgb
    for share, lamp in others:
        rgb += np.float32(share) * _traced(volume, params, lamp, view).rgb
    return replace(found, rgb=rgb)


def _traced(volume: Volume, params: Params, lamp: Sun, view: Camera) -> _Traced:
    # Light is in proportion to its intensity, and the ambient light to what a cloud hides: both come later, so that a picture
    # serves every strength and colour of them. The air of the scene is before it, not that of the parameters.
    params = Params(g=params.g, sigma_t=params.sigma_t, albedo=params.albedo, ambient=0.0)
    lamp = Sun(round(lamp.elevation / _STEP) * _STEP, round(lamp.azimuth / _STEP) * _STEP % 360)
    key = (id(volume), params, lamp, view)

    def make() -> _Traced:
        samples = min(max(_PATHS // (view.width * view.height), _FEWEST), _MOST)
        image = render(volume, params, view, lamp, orders=None, samples=samples, rng=0)
        there = np.isfinite(image.distance)
        usual = float(np.median(image.distance[there])) if there.any() else 1.0
        distance = np.where(there, image.distance, np.float32(usual)).astype(np.float32)
        return _Traced(volume, view, image.rgb, image.transmittance, distance)

    return _kept(key, make)


def seen(
    volume: Volume,
    params: Params,
    lamps: Lamps,
    offset: Any,
    camera: Camera,
    eye: NDArray[np.float64],
    directions: NDArray[np.float64] | None = None,
    looks: Looks = Camera.directions,
) -> Seen:
    """Return what is seen of a cloud from `eye`, along the pixels of a camera, as `looks` has them, or other directions."""
    offset = np.asarray(offset, np.float64)
    own = eye - offset
    place = _place(volume, own)
    if place is None:
        if directions is not None:
            none = np.ones(directions.shape[:-1], np.float32)
            return Seen(np.zeros(directions.shape, np.float32), none, np.full_like(none, np.inf))
        return _direct(volume, params, lamps, camera, offset, looks)
    middle = volume.bounds.mean(axis=0)
    aimed = Camera.look_at(place, middle, 2, 2, fov=60)
    x, y, z = aimed._axes() @ (_corners(volume) - place).T
    # A pixel's angle is a power of two, so that a camera that zooms does not trace for each frame.
    pixel = 2 * math.tan(math.radians(0.5 * camera.fov)) / camera.height * max(1.0, camera.width / _FRAME)
    pixel = 2.0 ** math.floor(math.log2(pixel))
    across, up = 1.04 * float(np.abs(x / z).max()), 1.04 * float(np.abs(y / z).max())
    pixel = max(pixel, 2 * across / _WIDEST, 2 * up / _WIDEST)
    width, height = max(4, math.ceil(2 * across / pixel)), max(4, math.ceil(2 * up / pixel))
    fov = math.degrees(2 * math.atan(0.5 * height * pixel))
    view = Camera.look_at(place, middle, width, height, fov=fov)
    traced = _mixed(volume, params, lamps, view)
    if directions is not None:
        return _lit(traced.look(own, directions), params)
    # Only the part of the picture that the box is in.
    shape = (camera.height, camera.width)
    rows, columns = _frame(volume, offset, camera)
    all_of = Seen(np.zeros((*shape, 3), np.float32), np.ones(shape, np.float32), np.full(shape, np.inf, np.float32))
    part = _lit(traced.look(own, looks(camera)[rows, columns]), params)
    all_of.rgb[rows, columns] = part.rgb
    all_of.transmittance[rows, columns] = part.transmittance
    all_of.distance[rows, columns] = part.distance
    return all_of


def reaches(volume: Volume, to: Any, offset: Any, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Return whether a cloud may shade anything in a box: the shadow of its own box's sphere may reach the box's sphere."""
    to = np.array(to)
    around = 0.5 * (low + high) - offset - volume.bounds.mean(axis=0)
    reach = 0.5 * float(np.linalg.norm(volume.bounds[1] - volume.bounds[0])) + 0.5 * float(np.linalg.norm(high - low))
    return not (float(np.linalg.norm(around - (around @ to) * to)) > reach or around @ to > reach)


def shadow(
    volume: Volume, params: Params, lamp: Sun, offset: Any, places: NDArray[np.float64]
) -> NDArray[np.float32] | None:
    """Return which share of a lamp's light a cloud leaves at places; None where all of it is left."""
    if not len(places):
        return None
    # Before anything is traced: does the shadow reach the places, and which of them?
    if not reaches(volume, lamp.direction, offset, places.min(axis=0), places.max(axis=0)):
        return None
    low, high = volume.bounds
    middle, size = volume.bounds.mean(axis=0), float(np.linalg.norm(high - low))
    to = np.array(lamp.direction)
    own = np.asarray(places, np.float64) - offset
    along = np.einsum("nk,k", own - middle, to)
    beside = np.linalg.norm(own - middle - along[:, None] * to, axis=1)
    behind = (along < 0.5 * size) & (beside < 0.5 * size)
    if not behind.any():
        return None
    at = middle + _LAMP * size * to
    fov = math.degrees(2 * math.asin(0.52 / _LAMP))
    view = Camera.look_at(at, middle, _SHADOW, _SHADOW, fov=fov)
    key = (id(volume), params.sigma_t, lamp, "shadow")

    def make() -> _Traced:
        bare = Params(sigma_t=params.sigma_t)
        image = render(volume, bare, view, lamp, orders=1)
        distance = np.where(np.isfinite(image.distance), image.distance, np.float32(0)).astype(np.float32)
        return _Traced(volume, view, image.rgb, image.transmittance, distance)

    traced = _kept(key, make)
    out = np.ones(len(own), np.float32)
    way = own[behind] - at
    far = np.linalg.norm(way, axis=1)
    found = traced.look(at, way / far[:, None])
    # What is nearer to the lamp than the cloud has all of its light.
    out[behind] = np.where(far < found.distance, 1.0, found.transmittance)
    return out

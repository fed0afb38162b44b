"""Weather in a scene: fog, rain and snow in its light, before what is seen, on what lies there and near the eye.

Fog takes of the lamps' light before it reaches the land and spreads it. Every veil adds what its own drops shed of the scene's
lamps, and of the mean of sky and land. Flakes and drops near the eye are drawn over the picture last. All of it in the sky's unit.
"""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .._core import weather_fall, weather_lay_snow, weather_veil
from .._support.inputs import Array, instance, several
from ..color import luminance
from ..paint import Shading, Sprites
from ..sky import CloudSlab, Natural, Physical, Sky
from ..weather import Fog, Overcast, Rain, Rainbow, Snow, phase_table, wet_reflectance

_KINDS = (Fog, Overcast, Rain, Rainbow, Snow)
# Asymmetry of flakes, and angles of their phase function.
_FLAKES, _ANGLES = 0.75, 361
# What of a lamp's light a layer passes on down that it spreads [1].
_DOWN = 0.7
# Of what falls near the eye, in light from all around: the field that a drop shows is 165° wide (Garg and Nayar 2007) [1].
_DROP = 0.94
# Least radius of a size for which diffraction is left out [µm], and that of a disc that smears [°].
_LARGE, _DISC = 60.0, 0.2665


def weather_of(value: Any, sky: Sky | None = None) -> tuple[Any, ...]:
    """Return the weather of a scene, if its sky can have it."""
    found = (value,) if isinstance(value, _KINDS) else several(value, "weather")
    for one in found:
        if not isinstance(one, _KINDS):
            msg = f"weather must be Fog, Overcast, Rain, Rainbow or Snow, got {type(one).__name__}"
            raise TypeError(msg)
    if sum(isinstance(one, Overcast) for one in found) > 1:
        msg = "weather must have one Overcast at most"
        raise ValueError(msg)
    if sky is not None:
        sky_under(sky, tuple(found))
    return tuple(found)


def sky_under(sky: Sky, weather: tuple[Any, ...]) -> Sky:
    """Return the sky with the deck of `Overcast`, the same one without."""
    for one in weather:
        if isinstance(one, Overcast):
            if not isinstance(sky, (Natural, Physical)):
                msg = f"sky must be Natural or Physical under Overcast, got {type(sky).__name__}"
                raise TypeError(msg)
            slab = CloudSlab(optical_depth=one.optical_depth, base=one.base, thickness=one.thickness)
            sky = replace(sky, overcast=slab)
    return sky


def lamp_share(to: Any, weather: tuple[Any, ...], z: float = 0.0) -> float:
    """Return what layers leave of a lamp's light at a height [m]."""
    depth = sum(one._above(z) for one in weather if isinstance(one, (Fog, Snow)))
    return math.exp(-depth / max(float(to[2]), 0.02)) if depth else 1.0


def spread(lamps: Any, weather: tuple[Any, ...]) -> NDArray[np.float64]:
    """Return the even light that layers make of that of lamps, linear RGB."""
    out = np.zeros(3)
    for to, rgb in lamps:
        out += _DOWN * max(float(to[2]), 0.0) * (1 - lamp_share(to, weather)) * np.array(rgb) / math.pi
    return out


@functools.lru_cache(maxsize=1)
def _flakes() -> NDArray[np.float32]:
    cosine = np.cos(np.linspace(0, math.pi, _ANGLES))
    g = _FLAKES
    value = (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
    return np.repeat(value.astype(np.float32)[:, None], 3, axis=1).reshape(-1)


def _phase(one: Any, rgb: NDArray[np.float64], radius: float) -> NDArray[np.float32]:
    sizes = one._sizes()
    if sizes is None:
        return _flakes()
    most = float(rgb.max())
    # Near enough a colour that the Sun's next minute finds it again.
    color = tuple(np.round(rgb / most, 2).tolist())
    found: NDArray[np.float32] = phase_table(sizes, color, round(radius, 3), max(sizes[0]) > _LARGE)
    return found


def veil(
    weather: tuple[Any, ...],
    lamps: Any,
    around: NDArray[np.float64],
    eye: Any,
    rays: NDArray[np.float64],
    rgb: NDArray[np.float32],
    *,
    endless: bool = False,
    variation: NDArray[np.float32] | None = None,
    shade: Any = None,
    shape: tuple[int, int] | None = None,
) -> None:
    """Put weather before radiance at places [m], or in directions without end; in place, the farthest first.

    `lamps` are directions, irradiances and radii [°]; `shade` gives what clouds leave of a lamp's light at places; `shape` is that
    of a picture, if `rays` are its.
    """
    vary = np.zeros((0, 3), np.float32) if variation is None else variation
    found = [one for one in weather if not isinstance(one, Overcast) and one.extinction > 0]
    far = lambda one: getattr(one, "distance", 0.0)
    for one in sorted(found, key=far, reverse=True):
        share = getattr(one, "lit", 1.0)
        each = []
        for to, light, radius in lamps:
            left = share * lamp_share(to, weather, float(eye[2]))
            if left > 1e-6 and light.max() > 0 and to[2] > -0.02:
                each.append((tuple(to), tuple((left * light).tolist()), _phase(one, light, min(radius, 1.0))))
        # Under an overcast sky what is around is that sky's already.
        gloom = 0.0 if any(isinstance(w, Overcast) for w in weather) else getattr(one, "gloom", 0.0)
        lit = np.zeros(0, np.float32)
        part, own, more = None, rgb, vary
        if not endless and getattr(one, "distance", 0.0) > 0:
            # What stands before a curtain costs nothing.
            part = np.flatnonzero(np.hypot(*(rays - np.asarray(eye))[:, :2].T) > one.distance)
            if not len(part):
                continue
            own, more = rgb[part], vary[part] if len(vary) else vary
        at = rays if part is None else rays[part]
        if shade is not None and each and isinstance(one, (Rain, Rainbow)):
            lit = _shaded(one, each[0][0], np.asarray(eye), at, endless, shade, shape)
        kind, numbers, seed, extinction = one._veil()
        ambient = tuple(((1 - gloom) * around).tolist())
        at = np.ascontiguousarray(at)
        weather_veil(kind, numbers, seed, extinction, each, ambient, tuple(eye), at, endless, lit, own, more)
        if part is not None:
            rgb[part] = own
            if len(vary):
                vary[part] = more


def _shaded(
    one: Any, to: Any, eye: Any, rays: NDArray[np.float64], endless: bool, shade: Any, shape: tuple[int, int] | None
) -> NDArray[np.float32]:
    """Return what clouds leave of a lamp's light in the middle of a curtain; of a picture at every eighth pixel, mixed between."""
    way = rays if endless else rays - eye
    if shape is not None:
        rows, columns = (np.unique(np.append(np.arange(0, n, 8), n - 1)) for n in shape)
        way = way.reshape(*shape, 3)[rows][:, columns].reshape(-1, 3)
    way = way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9)
    got = shade(to, eye + (one.distance + 0.5 * min(one.depth, 1 / one.extinction)) * way)
    if got is None:
        return np.zeros(0, np.float32)
    found: NDArray[np.float32] = got.astype(np.float32)
    if shape is not None:
        found = found.reshape(len(rows), len(columns))
        for axis, (n, known) in enumerate(zip(shape, (rows, columns), strict=True)):
            x = np.interp(np.arange(n), known, np.arange(len(known)))
            low = np.minimum(x.astype(int), max(len(known) - 2, 0))
            t = (x - low).astype(np.float32)
            t = t[:, None] if axis == 0 else t
            first = np.take(found, low, axis=axis)
            found = first + t * (np.take(found, np.minimum(low + 1, len(known) - 1), axis=axis) - first)
    return np.ascontiguousarray(found, np.float32).reshape(-1)


def on_ground(albedo: NDArray[np.float64], weather: tuple[Any, ...]) -> NDArray[np.float64]:
    """Return the reflectance of level land, wet or under snow."""
    for one in weather:
        if isinstance(one, Rain) and one.wet and one.distance == 0:
            y = float(luminance(albedo))
            albedo = albedo * (wet_reflectance(min(y, 1.0)) / y if y > 0 else 1.0)
        elif isinstance(one, Snow):
            albedo = albedo + min(2 * one.lying, 1.0) * (one.reflectance - albedo)
    return albedo


def lies(weather: tuple[Any, ...]) -> bool:
    """Return whether snow lies."""
    return any(isinstance(one, Snow) and one.lying > 0 for one in weather)


def on_strokes(
    weather: tuple[Any, ...],
    one: Shading,
    reflectance: NDArray[np.float64],
    falls: NDArray[np.float32],
    normals: NDArray[np.float32],
    open_: NDArray[np.float32] | None,
    leaves: bool,
) -> Shading:
    """Return strokes wet or under snow, in their own light; leaves shed water."""
    sprites = one.sprites
    rgb = np.array(sprites.color, np.float32)
    vary = np.zeros((0, 3), np.float32) if sprites.variation is None else np.array(sprites.variation, np.float32)
    for kind in weather:
        if isinstance(kind, Rain) and kind.wet and kind.distance == 0 and not leaves:
            y = min(float(luminance(reflectance)), 1.0)
            share = np.float32(wet_reflectance(y) / y if y > 0 else 1.0)
            rgb *= share
            vary *= share
        elif isinstance(kind, Snow) and kind.lying > 0 and open_ is not None:
            snow = (kind.reflectance / math.pi * falls).astype(np.float32)
            up = np.ascontiguousarray(normals[:, 2], np.float64)
            if leaves:
                # A leaf's place, and not its turn, says whether something lies there.
                up = np.clip(0.6 + 0.5 * up, -1, 1)
            weather_lay_snow(up, np.ascontiguousarray(open_, np.float32), kind.lying, snow, rgb, vary)
    return replace(
        one, sprites=Sprites._of(**sprites.__dict__ | {"color": rgb, "variation": vary if len(vary) else None})
    )


def falling(
    weather: tuple[Any, ...], picture: NDArray[np.float32], camera: Any, around: NDArray[np.float64], time: float
) -> None:
    """Draw drops and flakes near the eye, in place."""
    for one in weather:
        if not isinstance(one, (Rain, Snow)) or getattr(one, "distance", 0.0) > 0:
            continue
        flakes, number, least, mean, reach = one._fall()
        count = min(int(number * (2 * reach) ** 3), 4_000_000)
        if not count:
            continue
        color = tuple((_DROP * around).tolist())
        focal = 0.5 * camera.height / math.tan(math.radians(0.5 * camera.fov))
        weather_fall(
            flakes, count, (least, mean), reach, one.wind, one.exposure, time, color, one.seed,
            camera.position, camera._axes().tolist(), focal, (camera.width, camera.height), picture,
        )  # fmt: skip


class UnderWeather:
    """What a scene and a sky do about weather."""

    def with_weather(self, *weather: Any) -> Self:
        """Return the scene in more weather.

        Parameters
        ----------
        *weather : Fog, Overcast, Rain, Rainbow or Snow
            Of `pleinair.weather`.

        Returns
        -------
        Scene
            All else is the same.

        Raises
        ------
        TypeError
            It is none of these.

        Examples
        --------
        >>> from pleinair import Camera, Scene, Sun
        >>> from pleinair.sky import Natural
        >>> foggy = Scene(Natural(sun=Sun(5, 90))).with_weather(Fog(visibility=200))
        >>> foggy.radiance(Camera(32, 24, elevation=5)).shape
        (24, 32, 3)
        """
        own: Any = self
        return replace(own, weather=(*own.weather, *weather_of(weather)))  # type: ignore[no-any-return]


class Weathered(Sky):
    """A sky seen through weather, without a scene: for `radiance`, `render`, `panorama`.

    Parameters
    ----------
    sky : Sky
        What is behind.
    weather : Fog, Overcast, Rain, Rainbow, Snow or iterable of them
        Of `pleinair.weather`.

    Raises
    ------
    TypeError
        A value is of the wrong kind.

    Examples
    --------
    >>> from pleinair import Sun
    >>> from pleinair.sky import Preetham
    >>> bow = Weathered(Preetham(Sun(20, 180)), Rainbow())
    >>> bow.radiance([[0.0, 0.93, 0.37]]).shape
    (1, 3)
    """

    @property
    def _in_core(self) -> bool:
        return False

    def __init__(self, sky: Sky, weather: Any) -> None:
        instance(sky, "sky", Sky)
        self.weather = weather_of(weather)
        self.sky = sky_under(sky, self.weather)

    def __eq__(self, other: object) -> bool:
        """Compare sky and weather."""
        return isinstance(other, Weathered) and (self.sky, self.weather) == (other.sky, other.weather)

    def __hash__(self) -> int:
        """Agree with equality."""
        return hash((type(self), self.weather))

    @property
    def absolute(self) -> bool:  # type: ignore[override]
        """Whether radiance is in cd/m²."""
        return self.sky.absolute

    def _core(self, tolerance: float) -> Any:
        return self.sky._core(tolerance)

    @functools.cached_property
    def _around(self) -> NDArray[np.float64]:
        """Mean light from all around."""
        bare = self.sky.without_disc()
        lamps = [(lamp.direction, np.clip(lamp.irradiance, 0, None)) for lamp in bare._lights()]
        up = np.clip(bare.irradiance([(0.0, 0.0, 1.0)])[0], 0, None) / math.pi
        # The whole sphere's sum over 4 pi; below the horizon is what the sky has there.
        mean: NDArray[np.float64] = np.clip(bare.sh9()[0], 0, None) * 0.282095
        ground = getattr(self.sky, "ground_albedo", 0.18)
        around: NDArray[np.float64] = 0.5 * (mean + ground * up) + spread(lamps, self.weather)
        return around

    def _colored(self, rgb: Array, directions: NDArray[np.float64]) -> Array:
        light = np.ascontiguousarray(rgb, np.float32).reshape(-1, 3)
        bare = self.sky.without_disc()
        lamps = [(x.direction, np.clip(x.irradiance, 0, None), x.angular_radius) for x in bare._lights()]
        veil(self.weather, lamps, self._around, (0.0, 0.0, 2.0), directions.reshape(-1, 3), light, endless=True)
        return light.astype(rgb.dtype).reshape(rgb.shape)

    def without_disc(self) -> Sky:
        """Return it before a sky without discs.

        Returns
        -------
        Sky
            In the same weather.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Weathered(Aoas(sun=Sun(45, 180), disc=0.27), Fog()).without_disc().sky.disc
        0.0
        """
        return Weathered(self.sky.without_disc(), [w for w in self.weather if not isinstance(w, Overcast)])

    def _where(self) -> Any:
        return self.sky._where()

    def _lights(self) -> Any:
        return self.sky._lights()

    def _disc_radius(self) -> float:
        return self.sky._disc_radius()

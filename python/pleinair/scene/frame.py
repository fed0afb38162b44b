"""The background of a frame and its light, in the sky's unit.

Sky and cloud behind everything, light sources and their irradiance, the air before what is seen, and the one tone
reproduction of the whole picture. It is adapted to the whole sky and not to the part in view, so that a camera that turns
changes nothing.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import scene_air, scene_dome, scene_extinction, scene_irradiance, scene_project, scene_radiance
from ..camera import Camera
from ..clouds import Params
from ..color import luminance
from ..paint import Light, Material, Shading, Sprites, Strokes
from ..sky import Sky, SunLight
from ..tone import present
from .clouds import Cloud, Seen, in_frustum, reaches, seen, shadow
from .report import layer
from .sun_grid import sun_at, suns_about
from .weather import lamp_share, spread, veil

# Rows of the panorama that is looked at for the light of the whole sky.
_ROWS = 32
# Directions in which the horizon is looked at.
_AZIMUTHS = 720
# Of a light that is the only one, on a surface that faces it [1].
_STRENGTH = 0.8
# How much of its own shading a palette leaves to the light [1].
_LIT = 0.6
# Display white without a lamp in view, in adaptations [1], and how far beyond the frame a lamp begins to count [°].
_WHITE, _MARGIN = 10.0, 8.0
# What the eye is adapted to under a sky that is not in cd/m² [cd/m²].
_DAYLIGHT = 3000.0
# A disc's greatest radiance over its mean [1].
_LIMB = 1.25
# What no cloud under a sky of a unit of its own is brighter by [1].
_TOO_BRIGHT = 100.0
# A light fainter than this share of all is left out [1], and this strength is taken from all, so that none ends abruptly.
_FAINT, _FAINTEST = 1e-4, 2e-3


@dataclass(frozen=True, eq=False)
class Environment:
    """What lights a scene: lamps, the sky's harmonics, radiance of the ground."""

    lamps: tuple[Any, ...]
    sky: Any
    ground: tuple[float, ...]

    def irradiance(self, normals: NDArray[np.float32], visible: Any) -> NDArray[np.float32]:
        """Return irradiance of planes; `visible` has the share of each lamp's light that reaches each, None for all."""
        n = len(normals)
        shares = [np.ones(n, np.float32) if v is None else v for v in visible or [None] * len(self.lamps)]
        given = np.concatenate([np.zeros(0, np.float32), *shares]).astype(np.float32)
        out = np.empty((n, 3), np.float32)
        scene_irradiance(list(self.lamps), self.sky, self.ground, np.ascontiguousarray(normals), given, out)
        return out


def lit(shading: Shading, material: Material, irradiance: NDArray[np.float32]) -> Shading:
    """Return strokes whose colours are radiance: the palette's as reflectances under an irradiance."""
    sprites = shading.sprites
    rgb = np.array(sprites.color, np.float32)
    vary = np.zeros((0, 3), np.float32) if sprites.variation is None else np.array(sprites.variation, np.float32)
    scene_radiance(rgb, vary, irradiance, float(luminance(reflectance(material))), _LIT)
    return replace(
        shading, sprites=Sprites._of(**sprites.__dict__ | {"color": rgb, "variation": vary if len(vary) else None})
    )


def reflectance(material: Material) -> NDArray[np.float64]:
    """Return the reflectance of a material: the mean of its palette's middle, linear RGB [1]."""
    mean: NDArray[np.float64] = np.mean(np.array(material.palette.mid, np.float64), axis=0)
    return mean


@dataclass(frozen=True, eq=False)
class Backdrop:
    """A sky and its clouds, and what they do to a scene."""

    sky: Sky
    # Each with parameters in the sky's unit, where they were given so.
    clouds: tuple[tuple[Cloud, Params | None], ...] = ()
    time: float = 0.0
    # Whether light in clouds is a mix of that of Suns on a grid.
    moving_sun: bool = False
    # Reflectance of the land that clouds stand over, linear RGB [1].
    ground: tuple[float, ...] = (0.0, 0.0, 0.0)
    weather: tuple[Any, ...] = ()
    # Whether a plain hides what is below the horizon.
    plain: bool = False

    @functools.cached_property
    def _dome(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The upper half of the sky without discs, in rows, and the solid angle of each of a row's pixels [sr]."""
        upper = self._bare.panorama(_ROWS)[: _ROWS // 2].astype(np.float64)
        edges = np.cos(np.linspace(0, math.pi / 2, _ROWS // 2 + 1))
        return upper, (edges[:-1] - edges[1:]) * math.pi / _ROWS

    @functools.cached_property
    def _ambient(self) -> NDArray[np.float64]:
        """Mean light of the sky's upper half, linear RGB."""
        upper, solid = self._dome
        mean: NDArray[np.float64] = (upper * solid[:, None, None]).sum(axis=(0, 1)) / (2 * math.pi)
        return mean

    @functools.cached_property
    def _around(self) -> NDArray[np.float64]:
        """Mean light from all directions, the sky's and the land's, linear RGB.

        A cloud of albedo 1 sheds it again as far as it hides what is behind, by all orders of scattering: the furnace.
        """
        # The land in grey: what a palette colours is not all that a cloud looks down on.
        below = self.environment(None, np.full(3, float(luminance(np.array(self.ground))))).ground
        mean: NDArray[np.float64] = 0.5 * (np.clip(self._ambient, 0, None) + below)
        return mean

    @functools.cached_property
    def light_sources(self) -> tuple[SunLight, ...]:
        """Sun and Moon as far as they light anything, the brightest first."""
        found = [(float(luminance(irradiance_of(lamp))), lamp) for lamp in self._bare._lights()]
        most = max((y for y, _ in found), default=0.0)
        found = [pair for pair in found if pair[0] > _FAINT * most]
        return tuple(lamp for _, lamp in sorted(found, key=lambda pair: -pair[0]))

    def _weathered(self, eye: Any, rays: Any, rgb: NDArray[np.float32], **more: Any) -> None:
        """Put the weather before radiance, in place."""
        lamps = [(lamp.direction, irradiance_of(lamp), lamp.angular_radius) for lamp in self.light_sources]
        shade = self.cloud_shadow if self.clouds else None
        with layer("weather"):
            veil(self.weather, lamps, self._around + self.spread, eye, rays, rgb, shade=shade, **more)

    @functools.cached_property
    def spread(self) -> NDArray[np.float64]:
        """The even light that layers of weather make of that of the lamps."""
        return spread(((lamp.direction, irradiance_of(lamp)) for lamp in self.light_sources), self.weather)

    @functools.cached_property
    def lights(self) -> tuple[Light, ...]:
        """The light sources as a painter sees them, and light from the zenith as far as they do not outshine the sky.

        Every strength is continuous in all that moves: a lamp that sets has none left.
        """
        each = [irradiance_of(lamp) for lamp in self.light_sources]
        seen = [float(luminance(rgb)) for rgb in each]
        total = sum(seen) + max(math.pi * float(luminance(self._ambient)), 0.0) / 3
        out = []
        for lamp, rgb, y in zip(self.light_sources, each, seen, strict=True):
            strength = _STRENGTH * y / total - _FAINTEST
            if strength > 0:
                # Most of the way to white: a low sun's own colour would leave leaves no green.
                out.append(Light(lamp.direction, strength, tuple((0.65 + 0.35 * rgb / rgb.max()).tolist())))
        diffuse = 0.35 * (1 - sum(seen) / total if total > 0 else 1.0) - 0.05
        if diffuse > 0:
            out.append(Light((0.0, 0.0, 1.0), diffuse))
        return tuple(sorted(out, key=lambda light: -light.strength))

    def white(self, camera: Camera, adaptation: float) -> float:
        """Return what becomes display white: ten adaptations, or the disc of a lamp in view, and between.

        A function of the camera and not of the picture, so that nothing jumps when leaves cover the Sun.
        """
        white = _WHITE * adaptation
        up = math.tan(math.radians(0.5 * camera.fov))
        across = up * camera.width / camera.height
        for lamp in self.light_sources:
            x, y, z = camera._axes() @ np.array(lamp.direction)
            if z <= 0:
                continue
            beyond = max(math.atan2(abs(x), z) - math.atan(across), math.atan2(abs(y), z) - math.atan(up), 0.0)
            t = max(1 - math.degrees(beyond) / _MARGIN, 0.0)
            radius = math.radians(lamp.angular_radius)
            disc = _LIMB * float(luminance(irradiance_of(lamp))) / (math.pi * radius * radius)
            if disc > white and t > 0:
                white *= (disc / white) ** (t * t * (3 - 2 * t))
        return white

    def shown(
        self, rgb: NDArray[np.float32], camera: Camera, exposure: float, adaptation: float | None
    ) -> NDArray[np.float32]:
        """Return light of the scene as the display shows it, linear in [0, 1]."""
        if exposure <= 0:
            return np.zeros_like(rgb)
        eye = self.adaptation if adaptation is None else adaptation
        if not self.sky.absolute:
            # By day, whatever the unit.
            white, by = self.white(camera, eye) * _DAYLIGHT / eye, np.float32(_DAYLIGHT / eye)
            return present(rgb * by, _DAYLIGHT, False, fov=camera.fov, white=white, ev=math.log2(exposure))
        return present(rgb, eye, fov=camera.fov, white=self.white(camera, eye), ev=math.log2(exposure))

    @functools.cached_property
    def adaptation(self) -> float:
        """Of an eye under this sky [unit of the sky].

        Skies in units of their own have Suns that are not in proportion: there it is between sky and ground.
        """
        eye = self._bare.adaptation()
        if self.sky.absolute:
            return eye
        upper = np.maximum(luminance(self._dome[0]), 1e-8)
        sky = math.exp(float((np.log(upper) * self._dome[1][:, None]).sum()) / (2 * math.pi))
        return math.sqrt(sky * max(2 * eye - sky, 1e-8))

    @functools.cached_property
    def _harmonics(self) -> list[list[float]]:
        """What the sky alone sheds on planes."""
        axis = self.light_sources[0].direction if self.light_sources else (0.0, 0.0, 1.0)
        to, solid = scene_dome(axis)
        light = np.clip(self._bare.radiance(to.reshape(-1, 3)), 0, None).astype(np.float32)
        if self.weather:
            light += self.spread.astype(np.float32)
        return scene_project(to, solid, light.reshape(-1))

    def environment(self, lights: tuple[Light, ...] | None, ground: NDArray[np.float64]) -> Environment:
        """Return what lights a scene whose ground has a reflectance, linear RGB; `lights` are in place of the sky's."""
        lamps = [
            (x.direction, tuple((lamp_share(x.direction, self.weather) * irradiance_of(x)).tolist()))
            for x in self.light_sources
        ]
        if lights is not None:
            most = max((float(luminance(np.array(rgb))) for _, rgb in lamps), default=0.0)
            most = most or math.pi * max(float(luminance(self._ambient)), 0.0)
            lamps = [
                (light.direction, tuple((most * light.strength / _STRENGTH * np.array(light.color)).tolist()))
                for light in lights
            ]
        bare = Environment(tuple(lamps), self._harmonics, (0.0, 0.0, 0.0))
        falls = bare.irradiance(np.array([[0, 0, 1]], np.float32), None)[0].astype(np.float64)
        return replace(bare, ground=tuple((ground * falls / math.pi).tolist()))

    def reflected(self, directions: NDArray[np.float64], weathered: bool = True) -> NDArray[np.float32]:
        """Return the sky in directions, those below the horizon as at the horizon."""
        up = directions * [1, 1, 0] + [0, 0, 1] * np.maximum(directions[..., 2:], 1e-3)
        up /= np.linalg.norm(up, axis=-1, keepdims=True)
        light = np.clip(self._bare.radiance(up), 0, None).astype(np.float32)
        if self.weather and weathered:
            self._weathered((0.0, 0.0, 2.0), up.reshape(-1, 3), light.reshape(-1, 3), endless=True)
        return light

    @functools.cached_property
    def _horizon(self) -> NDArray[np.float32]:
        """The sky at the horizon, clockwise from north."""
        turn = np.linspace(0, 2 * math.pi, _AZIMUTHS, endpoint=False)
        return self.reflected(np.stack([np.sin(turn), np.cos(turn), 0 * turn], axis=-1), False)

    @functools.cached_property
    def _horizon_rows(self) -> list[list[float]]:
        return self._horizon.tolist()  # type: ignore[no-any-return]

    def _air(self, visibility: float | None) -> tuple[list[list[float]], tuple[float, float]]:
        """Return extinction [1/m] of two kinds of particles and their scale heights [m]."""
        level = (math.inf, math.inf)
        if visibility is not None:
            # Koschmieder: a fiftieth of the contrast is left at the visibility.
            return [[0.0] * 3, [math.log(50) / visibility] * 3], level
        made = self.sky._ground_air()
        return ([[0.0] * 3] * 2, level) if made is None else (scene_extinction(*made), made[3])

    def directions(self, camera: Camera) -> NDArray[np.float64]:
        """Return the directions of a frame's pixels, the same ones until the frame is done."""
        found: tuple[Camera, NDArray[np.float64]] | None = self.__dict__.get("_looked")
        if found is None or found[0] != camera:
            found = camera, camera.directions()
            self.__dict__["_looked"] = found
        return found[1]

    def done(self) -> None:
        """Forget what only one frame needs."""
        self.__dict__.pop("_looked", None)

    def through_air(
        self,
        places: NDArray[np.float64],
        camera: Camera,
        visibility: float | None,
        rgb: NDArray[np.float32],
        variation: NDArray[np.float32] | None = None,
    ) -> None:
        """Put the air of this sky before radiance at places [m], in place: what is lost, the horizon behind it adds."""
        extinction, scale = self._air(visibility)
        if np.any(extinction):
            with layer("air"):
                vary = np.zeros((0, 3), np.float32) if variation is None else variation
                scene_air(extinction, scale, self._horizon_rows, camera.position, places, rgb, vary)
        if self.weather:
            self._weathered(camera.position, places, rgb, variation=variation)

    def ground_plane(
        self,
        picture: NDArray[np.float32],
        camera: Camera,
        radiance: NDArray[np.float64],
        shade: NDArray[np.float64],
        level: float,
        visibility: float | None,
        through: NDArray[np.float32] | None = None,
    ) -> NDArray[np.float64]:
        """Paint a level ground of one radiance below the horizon of a picture, through air, as far as one can see.

        In the shadow of clouds it has that of `shade`. Returned are its distances, of all directions [m].
        """
        all_of = self.directions(camera)
        below = all_of[..., 2] < 0
        if through is not None:
            # What strokes hide is not looked at.
            below &= through > 0
        to = all_of[below]
        away = max(camera.position[2] - level, 1.0) / np.maximum(-to[:, 2], 1e-9)
        places = camera.position + away[:, None] * to
        left = self.cloud_shadow(self.light_sources[0].direction, places) if self.light_sources else None
        if left is None:
            rgb = np.repeat(radiance.astype(np.float32)[None], len(to), axis=0)
        else:
            rgb = (shade + left[:, None] * (radiance - shade)).astype(np.float32)
        self.through_air(places, camera, visibility, rgb)
        picture[below] = rgb
        out = np.full(below.shape, np.inf)
        out[below] = away
        return out

    def cloud_params(self, which: int = 0) -> Params:
        """Return a cloud's parameters in the sky's unit: those given, or factors of this very sky and its brightest lamp."""
        return self._cloud_params[which]

    @functools.cached_property
    def _cloud_params(self) -> tuple[Params, ...]:
        return tuple(map(self._params_of, range(len(self.clouds))))

    def _params_of(self, which: int) -> Params:
        cloud, given = self.clouds[which]
        if given is not None:
            return given
        rgb = irradiance_of(self.light_sources[0]) if self.light_sources else np.zeros(3)
        most = float(rgb.max())
        color = rgb / most if most > 0 else np.ones(3)
        ambient = self._around
        # The phase function's mean is 1, so light of irradiance E scatters with E / 4 pi.
        own = cloud.params
        if own is None:
            return Params(
                light_intensity=most / (4 * math.pi),
                light_color=tuple(color.tolist()),
                albedo=1.0,
                ambient=1.0,
                ambient_color=tuple(ambient.tolist()),
            )
        tint = np.ones(3) if own.ambient_color is None else np.array(own.ambient_color)
        return replace(
            own,
            light_intensity=own.light_intensity * most / (4 * math.pi),
            light_color=tuple((color * own.light_color).tolist()),
            ambient_color=tuple((tint * ambient).tolist()),
        )

    @functools.cached_property
    def _cloud_lights(self) -> tuple[Params, ...]:
        """Parameters of all clouds, each in the shade of the others: the mean of the share that reaches its box."""
        out = []
        for k, (cloud, given) in enumerate(self.clouds):
            params = self.cloud_params(k)
            if len(self.clouds) > 1 and given is None and self.light_sources:
                low, high = cloud.volume.bounds + cloud.at(self.time)
                grid = np.stack(np.meshgrid(*np.linspace(low, high, 5)[1:4].T), axis=-1).reshape(-1, 3)
                left = self.cloud_shadow(self.light_sources[0].direction, grid, skip=k)
                share = 1.0 if left is None else float(left.mean())
                params = replace(params, light_intensity=share * params.light_intensity)
            out.append(params)
        return tuple(out)

    def clouds_reach(self, to: Any, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
        """Return whether any cloud may take light of a lamp from a box."""
        return any(reaches(cloud.volume, to, cloud.at(self.time), low, high) for cloud, _ in self.clouds)

    def cloud_shadow(self, to: Any, places: NDArray[np.float64], skip: int = -1) -> NDArray[np.float32] | None:
        """Return which share of a lamp's light clouds leave at places; None where all of it is left."""
        out = None
        if not self.clouds:
            return out
        with layer("shadows of clouds"):
            for k, (cloud, _) in enumerate(self.clouds):
                left = None
                if k != skip:
                    left = shadow(cloud.volume, self.cloud_params(k), sun_at(to), cloud.at(self.time), places)
                if left is not None:
                    out = left if out is None else out * left
        return out

    def in_view(self, camera: Camera) -> list[bool]:
        """Return for each cloud whether its box may be in the picture."""
        return [in_frustum(cloud.volume, cloud.at(self.time), camera) for cloud, _ in self.clouds]

    def clouds_seen(
        self,
        camera: Camera,
        visibility: float | None,
        eye: NDArray[np.float64] | None = None,
        directions: NDArray[np.float64] | None = None,
    ) -> list[Seen]:
        """Return what is seen of the clouds through air, the farthest first: by a camera, or from an eye in directions."""
        with layer("clouds"):
            return self._clouds_seen(camera, visibility, eye, directions)

    def _clouds_seen(
        self,
        camera: Camera,
        visibility: float | None,
        eye: NDArray[np.float64] | None,
        directions: NDArray[np.float64] | None,
    ) -> list[Seen]:
        if not self.clouds:
            return []
        found = []
        lamp = self.light_sources[0].direction if self.light_sources else (0.0, 0.0, 1.0)
        lamps = [(w, sun_at(one)) for w, one in suns_about(lamp)] if self.moving_sun else [(1.0, sun_at(lamp))]
        at = np.array(camera.position) if eye is None else eye
        there = self.in_view(camera) if directions is None else [True] * len(self.clouds)
        for (cloud, _), params, within in zip(
            self.clouds, self._cloud_lights if any(there) else [None] * len(there), there, strict=True
        ):
            if not within or params is None:
                continue
            one = seen(cloud.volume, params, lamps, cloud.at(self.time), camera, at, directions, self.directions)
            cover = one.transmittance < 1
            if not cover.any():
                continue
            to = (self.directions(camera) if directions is None else directions)[cover]
            far = one.distance[cover].astype(np.float64)
            places = at + np.where(np.isfinite(far), far, 0.0)[:, None] * to
            rgb, air = np.ascontiguousarray(one.rgb[cover]), np.zeros((len(to), 3), np.float32)
            view = replace(camera, position=tuple(at.tolist()))
            # The air before it takes of the cloud's light, and adds its own as far as the cloud hides what is behind.
            self.through_air(places, view, visibility, air, rgb)
            one.rgb[cover] = rgb + (1 - one.transmittance[cover])[:, None] * air
            found.append(one)
        return sorted(found, key=lambda s: -float(np.median(s.distance[s.transmittance < 1])))

    def points(self, camera: Camera) -> NDArray[np.float32] | None:
        """Return what is too small to be painted, discs and stars; None for nothing."""
        if not self._shows_points(camera):
            return None
        sky: Any = self._bare
        if getattr(sky, "stars", None) is not None:
            sky = replace(sky, stars=None)
        points = np.clip(self.sky.render(camera) - sky.render(camera), 0, None)
        return points if points.any() else None

    @functools.cached_property
    def _bare(self) -> Sky:
        """The sky without discs, from which all light is taken."""
        return self.sky.without_disc()

    def _shows_points(self, camera: Camera) -> bool:
        """Return whether a disc may be in the picture, or stars are.

        If not, the sky without discs is the same and made already, for its light.
        """
        stars = getattr(self.sky, "stars", None) is not None
        if self.sky == self._bare and not stars:
            return False
        up = math.tan(math.radians(0.5 * camera.fov))
        across = up * camera.width / camera.height
        for lamp in self._bare._lights():
            x, y, z = camera._axes() @ np.array(lamp.direction)
            # A disc is a degree wide at most, or what a sky of its own makes of it.
            wide = math.tan(math.radians(min(max(1.0, 2 * lamp.angular_radius), 60.0)))
            if z > 0 and abs(x) < (across + wide) * z and abs(y) < (up + wide) * z:
                return True
        return stars and (self.sky._where().elevation < 0 or not getattr(self.sky, "sunlight", True))

    def bare_picture(self, camera: Camera) -> NDArray[np.float32]:
        """Return the sky without clouds."""
        seen = (self.sky if self._shows_points(camera) else self._bare).render(camera)
        if self.weather:
            to = self.directions(camera)
            # A plain hides what is well below the horizon: its rows cost nothing.
            rows = np.flatnonzero((to[..., 2] >= -0.05).any(axis=1)) if self.plain else np.arange(len(to))
            if len(rows):
                some = slice(int(rows[0]), int(rows[-1]) + 1)
                part, light = to[some], seen[some].reshape(-1, 3)
                rays = part.reshape(-1, 3)
                self._weathered(camera.position, rays, light, endless=True, shape=part.shape[:2])
        return seen

    def picture(
        self, camera: Camera, visibility: float | None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Return sky and clouds, and what the clouds let through; None where there are none."""
        sky, through = self.bare_picture(camera), None
        for one in self.clouds_seen(camera, visibility):
            sky = one.rgb + one.transmittance[..., None] * sky
            through = one.transmittance if through is None else through * one.transmittance
        return sky, through


def check_unit(sky: Sky, params: Params) -> None:
    """Refuse clouds in cd/m² before a sky in a unit of its own."""
    most = max((float(irradiance_of(lamp).max()) for lamp in sky._lights()), default=1.0) / (4 * math.pi)
    ambient = max(params.light_color if params.ambient_color is None else params.ambient_color) * params.ambient
    for name, value in (("light_intensity", params.light_intensity * max(params.light_color)), ("ambient", ambient)):
        if value > _TOO_BRIGHT * max(most, 1.0):
            msg = (
                f"cloud_params must be in the unit of {type(sky).__name__}, whose lamp gives clouds {most:.3g}, not in cd/m²: "
                f"their {name} is {value:.4g}; leave cloud_params out, or use a pleinair.scene.Cloud, whose params are factors"
            )
            raise ValueError(msg)


def irradiance_of(lamp: SunLight) -> NDArray[np.float64]:
    """Return the irradiance of a lamp; that of a red Sun has negative channels."""
    rgb: NDArray[np.float64] = np.clip(np.array(lamp.irradiance), 0, None)
    return rgb


def combined_visibility(strokes: Strokes, lights: tuple[Light, ...], shares: Any) -> NDArray[np.float32]:
    """Return the share of all lights that reaches strokes, from that of each."""
    facing = [light.strength * np.clip(strokes.normal @ np.array(light.direction), 0, None) for light in lights]
    all_of = np.sum(facing, axis=0)
    some = np.sum([f * share for f, share in zip(facing, shares, strict=True)], axis=0)
    # What faces no light keeps the mean: no light is taken from it either way.
    out = np.where(all_of > 1e-9, some / np.maximum(all_of, 1e-9), np.mean(shares, axis=0))
    both: NDArray[np.float32] = np.clip(out, 0, 1).astype(np.float32)
    return both

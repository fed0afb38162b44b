"""The background of a frame and its light.

Sky and cloud behind everything, light sources and their irradiance, aerial perspective by Koschmieder's law, and the
one tone mapping of the whole picture. It is adapted to the whole sky and not to the part in view, so that a camera that
turns changes nothing.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..astro import Sun
from ..camera import Camera
from ..clouds import Params, Volume, render
from ..color import luminance
from ..image import resize
from ..paint import Light, Shading, Strokes
from ..sky import Sky, SunLight
from ..tone import log_average, oneil, scotopic, tumblin_rushmeier

# Rows of the panorama that is looked at for the light of the whole sky.
_ROWS = 32
# Directions in which the horizon is looked at.
_AZIMUTHS = 720
# Widest picture in which a cloud is traced [px], and paths for each of its pixels.
_CLOUD_WIDTH = 320
_CLOUD_SAMPLES = 24
# Of a light that is the only one, on a surface that faces it [1].
_STRENGTH = 0.8
# How bright paper is shown by day [1].
_WHITE = 0.75
# Luminance above the adaptation, in its unit, from which highlights are compressed [1].
_SHOULDER = 0.6
# A light fainter than this share of all is left out [1], and this strength is taken from all, so that none ends abruptly.
_FAINT, _FAINTEST = 1e-4, 2e-3


@dataclass(frozen=True, eq=False)
class Backdrop:
    """A sky and a cloud, and what they do to a scene."""

    sky: Sky
    cloud: Volume | None
    params: Params | None

    @functools.cached_property
    def _dome(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The upper half of the sky without discs, in rows, and the solid angle of each of a row's pixels [sr]."""
        upper = self.sky.without_disc().panorama(_ROWS)[: _ROWS // 2].astype(np.float64)
        edges = np.cos(np.linspace(0, math.pi / 2, _ROWS // 2 + 1))
        return upper, (edges[:-1] - edges[1:]) * math.pi / _ROWS

    @functools.cached_property
    def _ambient(self) -> NDArray[np.float64]:
        """Mean light of the sky's upper half, linear RGB."""
        upper, solid = self._dome
        mean: NDArray[np.float64] = (upper * solid[:, None, None]).sum(axis=(0, 1)) / (2 * math.pi)
        return mean

    @functools.cached_property
    def light_sources(self) -> tuple[SunLight, ...]:
        """Sun and Moon as far as they light anything, the brightest first."""
        found = [(float(luminance(irradiance_of(lamp))), lamp) for lamp in self.sky._lights()]
        most = max((y for y, _ in found), default=0.0)
        found = [pair for pair in found if pair[0] > _FAINT * most]
        return tuple(lamp for _, lamp in sorted(found, key=lambda pair: -pair[0]))

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

    def tone_mapped(self, rgb: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return light of the sky as the display shows it, linear in [0, 1]."""
        if not self.sky.absolute:
            return np.clip(oneil(rgb), 0, 1)
        # Highlights are kept: above the adaptation luminance rises like its logarithm. And where it is dark the eye sees
        # no colours.
        above = np.maximum(luminance(rgb) / np.float32(self._adaptation) - 1, 0)
        kept = ((1 + _SHOULDER * np.log1p(above / _SHOULDER)) / (1 + above)).astype(np.float32)
        return tumblin_rushmeier(scotopic(rgb * kept[..., None]), self._adaptation)

    @functools.cached_property
    def _white_diffuse(self) -> NDArray[np.float64]:
        """Light of white paper that lies in the open, linear RGB."""
        upper, solid = self._dome
        down = np.cos((np.arange(_ROWS // 2) + 0.5) * math.pi / _ROWS)
        light = (upper * (solid * down)[:, None, None]).sum(axis=(0, 1))
        for lamp in self.light_sources:
            light += max(lamp.direction[2], 0.0) * irradiance_of(lamp)
        paper: NDArray[np.float64] = light / math.pi
        return paper

    @functools.cached_property
    def _adaptation(self) -> float:
        """Of an eye that looks at the sky and at what the sky lights: between the two, nearer the sky [cd/m²]."""
        sky = log_average(self._dome[0])
        paper = max(float(luminance(self._white_diffuse)), sky, 1e-8)
        return float(sky**0.8 * paper**0.2)

    @functools.cached_property
    def exposure(self) -> float:
        """How bright paints are, in [0.35, 1] [1]: the root of how bright white paper is shown, over that by day.

        Palettes are a painter's, who keeps colours in the dark; at night the paper alone would leave none.
        """
        seen = self.tone_mapped(self._white_diffuse.astype(np.float32).reshape(1, 3))
        return min(max(math.sqrt(float(luminance(seen)[0]) / _WHITE), 0.35), 1.0)

    def reflected(self, directions: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the sky in directions, those below the horizon as at the horizon, as the display shows it."""
        up = directions * [1, 1, 0] + [0, 0, 1] * np.maximum(directions[..., 2:], 1e-3)
        light = self.sky.without_disc().radiance(up / np.linalg.norm(up, axis=-1, keepdims=True))
        return self.tone_mapped(light.astype(np.float32))

    @functools.cached_property
    def _horizon(self) -> NDArray[np.float32]:
        """The sky at the horizon, clockwise from north, as the display shows it."""
        turn = np.linspace(0, 2 * math.pi, _AZIMUTHS, endpoint=False)
        return self.reflected(np.stack([np.sin(turn), np.cos(turn), 0 * turn], axis=-1))

    def _koschmieder(
        self, to: NDArray[np.float64], away: NDArray[np.float64], visibility: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return which share of its light is left of what lies so far in directions, and what the air adds."""
        # Koschmieder: a fiftieth of the contrast is left at the visibility.
        share = np.exp(-math.log(50) / visibility * away)[:, None]
        turn = np.round(np.arctan2(to[:, 0], to[:, 1]) * (_AZIMUTHS / (2 * math.pi))).astype(np.int64) % _AZIMUTHS
        return share, (1 - share) * self._horizon[turn]

    def aerial_perspective(self, shading: Shading, strokes: Strokes, camera: Camera, visibility: float) -> Shading:
        """Return strokes behind the air of this sky: what they lose of their light, the horizon behind them adds."""
        to = strokes.position - np.array(camera.position)
        share, air = self._koschmieder(to, np.linalg.norm(to, axis=1), visibility)
        sprites = shading.sprites
        rgb = (share * sprites.color + air).astype(np.float32)
        variation = None if sprites.variation is None else (share * sprites.variation).astype(np.float32)
        return replace(shading, sprites=replace(sprites, color=rgb, variation=variation))

    def ground_plane(
        self, picture: NDArray[np.float32], camera: Camera, paint: NDArray[np.float64], level: float, visibility: float
    ) -> None:
        """Paint a level ground of one colour below the horizon of a picture, through air, as far as one can see."""
        to = camera.directions()
        below = to[..., 2] < 0
        to = to[below]
        away = max(camera.position[2] - level, 1.0) / np.maximum(-to[:, 2], 1e-9)
        share, air = self._koschmieder(to, away, visibility)
        picture[below] = share * paint + air

    def cloud_params(self) -> Params:
        """Return the cloud's parameters: those given, or what this very sky and its brightest lamp give a cloud."""
        if self.params is not None:
            return self.params
        rgb = irradiance_of(self.light_sources[0]) if self.light_sources else np.zeros(3)
        most = float(rgb.max())
        # The phase function's mean is 1, so light of irradiance E scatters with E / 4 pi.
        return Params(
            light_intensity=most / (4 * math.pi),
            light_color=tuple((rgb / most).tolist()) if most > 0 else (1.0, 1.0, 1.0),
            albedo=1.0,
            ambient=1.0,
            ambient_color=tuple((0.5 * np.clip(self._ambient, 0, None)).tolist()),
        )

    def box_in_frustum(self, camera: Camera) -> bool:
        """Return whether the cloud's box may be in the picture."""
        if self.cloud is None:
            return False
        low, high = self.cloud.bounds
        corners = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)])
        x, y, z = camera._axes() @ (corners - camera.position).T
        up = math.tan(math.radians(0.5 * camera.fov))
        across = up * camera.width / camera.height
        # Out of view if all corners are beyond one side.
        return not any(bool((side < 0).all()) for side in (z, z * across - x, z * across + x, z * up - y, z * up + y))

    def picture(self, camera: Camera, progress: Any = None) -> NDArray[np.float32]:
        """Return sky and cloud as the display shows them."""
        sky = self.sky.render(camera)
        if self.cloud is not None and self.box_in_frustum(camera):
            params = self.cloud_params()
            small = min(1.0, _CLOUD_WIDTH / camera.width)
            view = camera.resized(max(1, round(camera.width * small)), max(1, round(camera.height * small)))
            x, y, z = self.light_sources[0].direction if self.light_sources else (0.0, 0.0, 1.0)
            lamp = Sun(math.degrees(math.asin(min(max(z, -1.0), 1.0))), math.degrees(math.atan2(x, y)) % 360)
            traced = render(
                self.cloud, params, view, lamp, orders=None, samples=_CLOUD_SAMPLES, rng=0, progress=progress
            )
            clear = np.exp(-np.array(params.haze, np.float32))
            through = traced.transmittance[..., None] * clear + (1 - clear)
            light, share = (
                resize(np.ascontiguousarray(part, np.float32), camera.width, camera.height)
                for part in (traced.rgb, through)
            )
            sky = light + share * sky
        return self.tone_mapped(sky)


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

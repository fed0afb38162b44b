"""The interface of every sky model. Public as `pleinair.sky`.

Radiance, rendered pictures, panoramas, irradiance, spherical harmonics, probes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.docs import documented
from .._support.inputs import Array, Progress, array, choice, flag, instance, integer, real, reporter, shape_text, units
from ..astro import Sun
from ..camera import Camera
from ..color import luminance
from ..tone import Display, scotopic, show
from .probe import Probe, probe_of

# Angular radius of the Sun seen from the Earth.
SUN_RADIUS = 0.2665
# Directions of one call where principles of the user's own run in Python: bounds their memory.
_CHUNK = 1 << 18
# Rows of the panorama, reflectance [1] and least luminance [unit of the sky] of what an eye adapts to.
_DOME_ROWS, _GREY, _BLACK = 32, 0.18, 1e-8
# What a picture is shown on.
_DISPLAY = Display()
# Directions between two reports of progress of the reference method.
_CHUNK_REFERENCE = 1 << 9


def beta_of(turbidity: float) -> float:
    """Return Ångström's β of a turbidity (Iqbal 1983, in Preetham et al. 1999)."""
    return max(0.0, 0.04608 * turbidity - 0.04586)


@dataclass(frozen=True)
class SunLight:
    """The Sun, or the Moon, as a light of its own.

    Attributes
    ----------
    direction : tuple of float
        Unit vector to it [1].
    irradiance : tuple of float
        Of a plane that faces it, after the air, linear RGB [unit of the sky × sr].
    angular_radius : float
        Of its disc [°].
    """

    direction: tuple[float, float, float]
    irradiance: tuple[float, float, float]
    angular_radius: float


class Sky:
    """What all skies have in common; make one of its kinds, such as `Aoas`.

    Examples
    --------
    >>> from pleinair import Sun
    >>> from pleinair.sky import Aoas
    >>> isinstance(Aoas(sun=Sun(45, 180)), Sky)
    True
    """

    # Whether radiance is in cd/m².
    absolute: ClassVar[bool] = False
    # Whether the reference method is a Monte Carlo, whose noise a probe does not want.
    _noisy_reference: ClassVar[bool] = False
    sun: Sun

    def _core(self, tolerance: float) -> Any:
        """Return the core's sky for a relative error of the fast method."""
        raise NotImplementedError

    def _moved(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what principles in Python make of directions; the same array if there are none."""
        return directions

    def _colored(self, rgb: Array, directions: NDArray[np.float64]) -> Array:
        """Return what principles in Python make of colours."""
        del directions
        return rgb

    @property
    def _in_core(self) -> bool:
        """Whether the core alone makes this sky."""
        return True

    @documented
    def radiance(
        self,
        directions: ArrayLike,
        *,
        method: str = "fast",
        tolerance: float = 1e-3,
        progress: Progress = None,
    ) -> Array:
        """Return the radiance seen in directions.

        Parameters
        ----------
        directions : array_like (..., 3)
            Vectors away from the viewer, of any length but zero: x east, y north, z up.
        method : {"fast", "reference"}
            The reference is in float64, without tables: of `Physical` and `Natural` a backward Monte Carlo of 1024 paths, of
            other skies adaptive quadrature or the formula itself.
        tolerance : float
            Relative error wanted of the fast method, in [1e-4, 0.1] [1]; the cheapest setting that holds it is chosen.
        {progress}

        Returns
        -------
        ndarray (..., 3)
            Linear Rec. 709, float32; float64 by the reference method.

        Raises
        ------
        ValueError, TypeError
            A direction is zero or not finite, or an argument is out of range.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Aoas(sun=Sun(45, 180)).radiance([[0, 0, 1], [0, 1, 0.1]]).shape
        (2, 3)
        """
        to = array(directions, "directions", dtypes=(np.float64,), last=3)
        exact = choice(method, "method", ("fast", "reference")) == "reference"
        tolerance = real(tolerance, "tolerance", 1e-4, 0.1)
        out = np.empty(to.shape, np.float64 if exact else np.float32)
        core = self._core(tolerance)
        if to.size == 0:
            return out
        tick, close = reporter(progress, "sky")
        try:
            if self._in_core:
                (core.reference if exact else core.radiance)(to, out, tick)
                return out
            flat, into = units(to, "directions").reshape(-1, 3), out.reshape(-1, 3)
            for first in range(0, len(flat), _CHUNK):
                part = np.ascontiguousarray(flat[first : first + _CHUNK])
                moved = self._moved(part)
                rgb = np.empty(part.shape, out.dtype)
                (core.reference if exact else core.radiance)(moved, rgb, None)
                into[first : first + _CHUNK] = self._colored(rgb, part)
                if tick is not None:
                    tick(min(first + _CHUNK, len(flat)), len(flat))
        finally:
            close()
        return out

    def _picture(self, shape: tuple[int, int], directions: Any, draw: Any, how: Any) -> NDArray[np.float32]:
        """Return a picture drawn by the core, or from directions where the core is not enough."""
        method, tolerance, progress = how
        fast = choice(method, "method", ("fast", "reference")) == "fast"
        out = np.empty((*shape, 3), np.float32)
        if fast and self._in_core:
            core = self._core(real(tolerance, "tolerance", 1e-4, 0.1))
            tick, close = reporter(progress, "sky")
            try:
                draw(core, out, tick)
            finally:
                close()
            return out
        rows = max(1, (_CHUNK if fast else _CHUNK_REFERENCE) // shape[1])
        tick, close = reporter(progress, "sky")
        try:
            for first in range(0, shape[0], rows):
                last = min(first + rows, shape[0])
                some = directions(first, last)
                # Outside the circle of a fisheye there is no direction: any does, and is black.
                none = ~some.any(axis=-1)
                some[none] = (0, 0, 1)
                out[first:last] = self.radiance(some, method=method, tolerance=tolerance)
                out[first:last][none] = 0
                if tick is not None:
                    tick(last, shape[0])
        finally:
            close()
        return out

    @documented
    def render(
        self, camera: Camera, *, method: str = "fast", tolerance: float = 1e-3, progress: Progress = None
    ) -> NDArray[np.float32]:
        """Return the picture of a camera.

        Parameters
        ----------
        camera : Camera
            Direction of view and size; its position does not matter.
        method : {"fast", "reference"}
            As for `radiance`.
        tolerance : float
            As for `radiance` [1].
        {progress}

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear Rec. 709, row 0 at the top.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> Aoas(sun=Sun(20, 200)).render(Camera(64, 36, azimuth=200, elevation=15)).shape
        (36, 64, 3)
        """
        instance(camera, "camera", Camera)
        directions = _rows(camera.directions) if method == "reference" or not self._in_core else None
        how = (method, tolerance, progress)
        draw = lambda core, out, tick: core.render(camera, out, tick)
        return self._picture((camera.height, camera.width), directions, draw, how)

    @documented
    def show(
        self,
        camera: Camera,
        adaptation: float,
        display: Display = _DISPLAY,
        *,
        night: bool = False,
        tolerance: float = 1e-3,
        progress: Progress = None,
    ) -> NDArray[np.uint8]:
        """Return the picture of a camera as a display shows it: sky and tone reproduction in one pass.

        Parameters
        ----------
        camera : Camera
            As for `render`.
        adaptation : float
            What the eye is adapted to, in [1e-8, 1e10]: `adaptation()`, or a log-average [cd/m²].
        display : Display
            What it is shown on.
        night : bool
            Whether the eye sees like rods where it is dark, as for `pleinair.tone.show`.
        tolerance : float
            As for `radiance` [1].
        {progress}

        Returns
        -------
        ndarray (height, width, 3) of uint8
            To the bit what `pleinair.tone.show(sky.render(camera), adaptation)` gives; the light of the whole picture, four
            times as large, is never in memory.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Preetham
        >>> Preetham(sun=Sun(40, 180)).show(Camera(64, 36), 3000.0).shape
        (36, 64, 3)
        """
        instance(camera, "camera", Camera)
        adapted = real(adaptation, "adaptation", 1e-8, 1e10, "cd/m²")
        shape = instance(display, "display", Display)._core()
        if not self._in_core:
            light = self.render(camera, tolerance=tolerance, progress=progress)
            return show(light, adapted, display, night=night)
        out = np.empty((camera.height, camera.width, 3), np.uint8)
        core, rods = self._core(real(tolerance, "tolerance", 1e-4, 0.1)), flag(night, "night")
        tick, close = reporter(progress, "sky")
        try:
            core.show(camera, out, adapted, shape, rods, tick)
        finally:
            close()
        return out

    @documented
    def panorama(
        self, height: int = 512, *, method: str = "fast", tolerance: float = 1e-3, progress: Progress = None
    ) -> NDArray[np.float32]:
        """Return the whole sphere as an equirectangular picture.

        Row 0 is the zenith; column 0 begins at north and azimuth grows to the right. Turned to y up by
        (x, y, z) → (x, z, −y), that is OpenEXR's lat-long environment map (docs/exports.md).

        Parameters
        ----------
        height : int
            Rows, in [1, 16384]; there are twice as many columns [px].
        method : {"fast", "reference"}
            As for `radiance`.
        tolerance : float
            As for `radiance` [1].
        {progress}

        Returns
        -------
        ndarray (height, 2 height, 3) of float32
            Linear Rec. 709.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Aoas(sun=Sun(20, 200)).panorama(16).shape
        (16, 32, 3)
        """
        height = integer(height, "height", 1, 16384)

        def directions(first: int, last: int) -> NDArray[np.float64]:
            polar = (np.arange(first, last)[:, None] + 0.5) * (math.pi / height)
            azimuth = (np.arange(2 * height)[None] + 0.5) * (math.pi / height)
            x, y = np.sin(azimuth) * np.sin(polar), np.cos(azimuth) * np.sin(polar)
            return np.stack(np.broadcast_arrays(x, y, np.cos(polar)), axis=-1)

        how = (method, tolerance, progress)
        draw = lambda core, out, tick: core.panorama(height, out, tick)
        return self._picture((height, 2 * height), directions, draw, how)

    def probe(self, direction: ArrayLike) -> Probe:
        """Return what the sky is in one direction: without tables, by the reference method unless that is a Monte Carlo.

        Parameters
        ----------
        direction : array_like (3,)
            Away from the viewer, of any length but zero.

        Returns
        -------
        Probe
            Luminance, chromaticity, colour temperature, surface brightness.

        Raises
        ------
        ValueError, TypeError
            The direction is zero, not finite or of the wrong shape.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Aoas(sun=Sun(45, 180)).probe((0, 0, 1)).cct > 15000
        True
        """
        to = array(direction, "direction", dtypes=(np.float64,))
        if to.shape != (3,):
            msg = f"direction must have shape (3,), got {shape_text(to.shape)}"
            raise ValueError(msg)
        rgb = self.radiance(to[None], method="fast" if self._noisy_reference else "reference")[0]
        return probe_of(rgb.astype(np.float64), self.absolute)

    def _ground_pressure(self) -> float:
        """Pressure at the ground [hPa]."""
        return float(getattr(self, "pressure", 1013.25))

    def _ground_air(self) -> tuple[float, float, float, tuple[float, float]] | None:
        """Return pressure [hPa], Ångström's β and α and the scale heights [m] of this sky's air, None if it has none."""
        turbidity, beta = getattr(self, "turbidity", None), getattr(self, "beta", None)
        if turbidity is None:
            return None
        # Of the standard atmosphere: its column over its density at the ground.
        scale = getattr(self, "scale_height", None) or 8440.0, getattr(self, "aerosol_scale_height", 1200.0)
        alpha = getattr(self, "alpha", 1.3)
        return self._ground_pressure(), beta_of(turbidity) if beta is None else beta, alpha, scale

    def without_disc(self) -> Sky:
        """Return the sky without the disc of the Sun, for use beside `sun_light`.

        Returns
        -------
        Sky
            Itself where it draws no disc.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Aoas(sun=Sun(45, 180), disc=0.27).without_disc().disc
        0.0
        """
        return self

    def _where(self) -> Sun:
        """Return the Sun."""
        return self.sun

    def _lights(self) -> list[SunLight]:
        """Return the lights that have discs."""
        return [self.sun_light()]

    def _disc_radius(self) -> float:
        """Return the angular radius of the Sun as a light [°]."""
        return SUN_RADIUS

    def sun_light(self) -> SunLight:
        """Return the Sun as a separate light: what of it comes through the air and past the ground.

        Returns
        -------
        SunLight
            Direction, irradiance, angular radius; no irradiance when it has set.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> light = Aoas(sun=Sun(5, 180)).sun_light()
        >>> light.irradiance[0] > 2 * light.irradiance[2]
        True
        """
        radius = self._disc_radius()
        r, g, b = self._core(1e-3).direct_irradiance(math.radians(radius))
        return SunLight(self._where().direction, (r, g, b), radius)

    def adaptation(self, *, tolerance: float = 1e-3) -> float:
        """Return what an eye is adapted to that stands under this sky: all of it, and a grey ground.

        Parameters
        ----------
        tolerance : float
            As for `radiance`: that of the pictures that are made beside it costs nothing more [1].

        Returns
        -------
        float
            In the dark as rods see it. Half of it the log-average of the sky without discs, half a ground of reflectance 0.18 that sky, Sun and Moon
            light [unit of the sky].

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Preetham
        >>> 2000 < Preetham(sun=Sun(45, 180)).adaptation() < 8000
        True
        """
        rows = _DOME_ROWS // 2
        edges = np.cos(np.linspace(0, math.pi / 2, rows + 1))
        share = (edges[:-1] - edges[1:])[:, None] / _DOME_ROWS / 2
        polar = (np.arange(rows)[:, None] + 0.5) * (math.pi / _DOME_ROWS)
        turn = (np.arange(2 * _DOME_ROWS) + 0.5) * (math.pi / _DOME_ROWS)
        x, y, z = np.broadcast_arrays(np.sin(turn) * np.sin(polar), np.cos(turn) * np.sin(polar), np.cos(polar))
        light = self.radiance(np.stack([x, y, z], axis=-1), tolerance=tolerance)
        lamps = np.array([lamp.irradiance for lamp in self._lights()], np.float32).reshape(-1, 3)
        if self.absolute:
            # In the dark, what rods see of it.
            light, lamps = scotopic(light), scotopic(lamps) if len(lamps) else lamps
        upper = np.maximum(luminance(light.astype(float)), 0)
        # A direction that meets a disc stands for too much: the light of discs comes below.
        upper = np.minimum(upper, 1e3 * np.median(upper))
        paper = float((2 * upper * share * z).sum())
        for lamp, rgb in zip(self._lights(), lamps.astype(float), strict=True):
            paper += max(lamp.direction[2], 0.0) * max(float(luminance(rgb)), 0.0) / math.pi
        seen = math.exp(float((np.log(np.maximum(upper, _BLACK)) * share).sum()))
        return max(0.5 * seen + 0.5 * _GREY * paper, _BLACK)

    def irradiance(self, normals: ArrayLike, *, disc: bool = True) -> NDArray[np.float64]:
        """Return the irradiance of planes: the light of the whole sphere on them.

        Parameters
        ----------
        normals : array_like (..., 3)
            Vectors of any length but zero.
        disc : bool
            With the light of the discs of Sun and Moon; without, the sky alone.

        Returns
        -------
        ndarray (..., 3) of float64
            Linear Rec. 709 [unit of the sky × sr].

        Raises
        ------
        ValueError, TypeError
            A normal is zero or not finite.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Aoas(sun=Sun(45, 180)).irradiance([(0, 0, 1), (0, -1, 0)]).shape
        (2, 3)
        """
        n = units(normals, "normals")
        out, _ = self.without_disc()._dome(n)
        for light in self._lights() if disc else []:
            facing = np.clip(n @ np.array(light.direction), 0, None)
            out += facing[..., None] * np.array(light.irradiance)
        return out

    def sh9(self) -> NDArray[np.float64]:
        """Return the sky, without the Sun's disc, in real spherical harmonics up to degree 2.

        Orthonormal, without the Condon-Shortley sign, z up, in the order (l, m) = (0, 0), (1, −1), (1, 0), (1, 1),
        (2, −2), (2, −1), (2, 0), (2, 1), (2, 2): Y = 0.282, 0.489 y, 0.489 z, 0.489 x, 1.093 xy, 1.093 yz,
        0.315 (3z² − 1), 1.093 xz, 0.546 (x² − y²). The irradiance of a plane is the sum of coefficient × Y(normal) ×
        (π, 2π/3, π/4 for l = 0, 1, 2) (Ramamoorthi and Hanrahan 2001).

        Returns
        -------
        ndarray (9, 3) of float64
            A row for each coefficient, linear Rec. 709.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Aoas(sun=Sun(45, 180)).sh9().shape
        (9, 3)
        """
        _, harmonics = self.without_disc()._dome(np.zeros((0, 3)))
        return harmonics

    def _dome(self, normals: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return irradiance of planes and harmonics of the whole sphere."""
        if not self._in_core:
            msg = "irradiance and sh9 need a sky without principles in Python: sky = replace(sky, principles=())"
            raise ValueError(msg)
        out = np.empty(normals.shape)
        harmonics = self._core(1e-3).irradiance(self._where().direction, normals, out)
        return out, np.array(harmonics)


def _rows(directions: Any) -> Any:
    """Return a function that gives some rows of a camera's directions."""
    found = directions()
    return lambda first, last: found[first:last]


def check_above_horizon(sun: Any) -> Sun:
    """Return a Sun that is not below the horizon, where formulas of the day end."""
    found: Sun = instance(sun, "sun", Sun)
    if found.elevation < 0:
        msg = f"sun must not be below the horizon for a sky by formula, got {found.elevation}°; Natural has twilight and night"
        raise ValueError(msg)
    return found

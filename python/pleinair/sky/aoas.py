"""Skies in the manner of AOAS: one skydome, lit once, freely styled. Public as `pleinair.sky`."""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import SkyModel, sky_dome_points
from .._support.inputs import (
    Array,
    DomainWarning,
    array,
    choice,
    flag,
    instance,
    integer,
    key,
    real,
    several,
    units,
    vector,
)
from ..astro import Sun
from ..camera import Camera
from .base import SUN_RADIUS, Sky

# O'Neil's constants: K times the wavelengths 650, 570 and 475 nm to the power of -4.
RAYLEIGH = (0.014005, 0.0236825, 0.04911)


class Principle:
    """Base of principles of your own: override `move`, `color`, or both.

    A principle works on fragments: where view rays meet the skydome, in dome radii from its centre. Those of `Aoas` itself
    (ambiguity, cloud complexity, shapes) run in the core; these run in Python, on arrays, in the order given.

    Examples
    --------
    >>> from pleinair.sky import Aoas
    >>> class Bands(Principle):
    ...     def color(self, rgb, fragments, seed):
    ...         return rgb * (1 + 0.2 * np.sin(40 * fragments[..., 2:]))
    >>> Aoas(sun=Sun(30, 180), principles=[Bands()]).render(Camera(16, 9)).shape
    (9, 16, 3)
    """

    def move(self, fragments: Array, seed: int) -> Array:
        """Return fragments that stand for the given ones, as ambiguity does.

        Parameters
        ----------
        fragments : ndarray (n, 3) of float64
            Points of the dome.
        seed : int
            The sky's `rng` [1].

        Returns
        -------
        ndarray (n, 3)
            Any points but the viewer's own.

        Examples
        --------
        >>> Principle().move(np.eye(3), 0).shape
        (3, 3)
        """
        del seed
        return fragments

    def color(self, rgb: Array, fragments: Array, seed: int) -> Array:
        """Return new colours of fragments, as clouds do.

        Parameters
        ----------
        rgb : ndarray (n, 3)
            Linear light.
        fragments : ndarray (n, 3) of float64
            Points of the dome, before anything moved them.
        seed : int
            The sky's `rng` [1].

        Returns
        -------
        ndarray (n, 3)
            Linear light.

        Examples
        --------
        >>> Principle().color(np.ones((1, 3)), np.eye(3)[:1], 0).tolist()
        [[1.0, 1.0, 1.0]]
        """
        del fragments, seed
        return rgb


def _points(value: ArrayLike) -> tuple[tuple[float, float, float], ...]:
    """Return points of the dome as they are kept."""
    points = array(value, "points", dtypes=(np.float64,), ndim=2, last=3)
    if not len(points):
        msg = "points must hold at least one point, got none"
        raise ValueError(msg)
    units(points, "points")
    return tuple((x, y, z) for x, y, z in points.tolist())


@dataclass(frozen=True)
class CloudPoints:
    """A cloud around points of the skydome, which fades out linearly with distance.

    Parameters
    ----------
    points : array_like (n, 3)
        Directions from the dome's centre, of any length but zero.
    radius : float
        Distance on the dome at which the cloud ends, in (0, π] [dome radii].

    Raises
    ------
    ValueError, TypeError
        There are no points, one is zero or not finite, or the radius is out of range.

    Examples
    --------
    >>> CloudPoints([(0, 1, 1)], radius=0.2).radius
    0.2
    """

    points: Any
    radius: float = 0.1

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _points(self.points))
        object.__setattr__(self, "radius", real(self.radius, "radius", 1e-4, math.pi, "dome radii"))

    def _core(self) -> tuple[Any, float, bool, bool]:
        return (units(self.points, "points").tolist(), self.radius, False, False)


@dataclass(frozen=True)
class CloudSpline:
    """A cloud along a centripetal Catmull-Rom spline on the skydome, which fades out linearly with distance.

    The spline is drawn as twelve straight lines between neighbouring points.

    Parameters
    ----------
    points : array_like (n, 3)
        Directions from the dome's centre that the spline passes, of any length but zero; repeated ones count once.
    radius : float
        Distance on the dome at which the cloud ends, in (0, π] [dome radii].
    closed : bool
        The last point is joined to the first.

    Raises
    ------
    ValueError, TypeError
        There are no points, one is zero or not finite, or the radius is out of range.

    Examples
    --------
    >>> CloudSpline([(0, 1, 1), (1, 1, 1)], radius=0.2).closed
    False
    """

    points: Any
    radius: float = 0.1
    closed: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _points(self.points))
        object.__setattr__(self, "radius", real(self.radius, "radius", 1e-4, math.pi, "dome radii"))
        object.__setattr__(self, "closed", flag(self.closed, "closed"))

    def _core(self) -> tuple[Any, float, bool, bool]:
        return (units(self.points, "points").tolist(), self.radius, True, self.closed)


@dataclass(frozen=True)
class _Settings:
    """What the core reads."""

    sun: tuple[float, float, float]
    rayleigh: tuple[float, float, float]
    mie: float
    g: float
    sun_intensity: float
    radius_ratio: float
    thickness: float
    scale_heights: tuple[float, float]
    viewer: tuple[float, float, float]
    radial_apex: bool
    shadow: bool
    polynomial_depth: bool
    samples: int | None
    left_rule: bool
    ground: tuple[float, float, float] | None
    disc: float
    ambiguity: float
    grain: float
    cloud_complexity: float
    shapes: tuple[Any, ...]
    key: int
    tolerance: float


# A camera that moves through one sky makes its tables once.
@lru_cache(maxsize=16)
def _built(settings: _Settings) -> SkyModel:
    return SkyModel.aoas(settings)


_RANGES = {
    "mie": (0, 1e3),
    "g": (-0.9999, 0.9999),
    "sun_intensity": (0, 1e30),
    "radius_ratio": (1, 1e6),
    "thickness": (1e-3, 1e3),
    "ambiguity": (0, 1e3),
    "grain": (1e-5, 10),
    "cloud_complexity": (0, 1e4),
}


@dataclass(frozen=True)
class Aoas(Sky):
    """A styled sky: single scattering on one skydome, and what may change in it (AOAS).

    Radiance is relative. Lengths of the air are in O'Neil's thickness of the atmosphere; the defaults are his.

    Parameters
    ----------
    sun : Sun
        Direction of the light (the paper's day cycle).
    rayleigh : array_like (3,)
        Scattering constants of red, green and blue, in [0, 1000] [1/thickness]; any vector, by which the hue is chosen.
    mie : float
        Scattering constant of the aerosol, in [0, 1000] [1/thickness].
    g : float
        Asymmetry of the aerosol, in [-0.9999, 0.9999], positive is forward [1].
    sun_intensity : float
        Irradiance of the Sun above the air, at least 0 [relative].
    radius_ratio : float
        Radius of the ground, in [1, 1e6] [thickness].
    scale_height : float
        Height in which the density falls by e, at least a hundredth of the thickness [thickness].
    mie_scale_height : float, optional
        The same of the aerosol [thickness]; by default that of the molecules, as O'Neil has it.
    thickness : float
        Height of the top of the air, for which the dome stands, in [0.001, 1000] [O'Neil's thickness].
    viewer, dome_center : tuple of float
        Places in the scene [m, or any unit of the scene].
    dome_radius : float
        Radius of the skydome, above 0 [the same unit].
    apex : {"constant", "radial"}
        Eq 2: up is z, or from the dome's centre to the viewer as printed, which turns the horizon with the viewer.
    ground : {"horizon"} or array_like (3,)
        Below the horizon: the horizon continues, or a ground of this radiance [relative]; (0, 0, 0) is black.
    shadow : bool
        The ground hides the Sun; O'Neil has no such test, and light where there should be night.
    disc : float
        Angular radius of the Sun's disc, 0 for none, 0.2665 for the true one, at most 30 [°].
    optical_depth : {"exact", "oneil"}
        Quadrature, or O'Neil's polynomial, which holds for radius_ratio 40 and scale_height 0.25 only.
    samples : int, optional
        Equal steps along a ray, as in O'Neil and eq 3, in [1, 10000] [1]; by default quadrature to the tolerance.
    sampling : {"midpoint", "start"}
        Where steps are sampled: eq 3 says at their start, which errs by 45 % for five of them.
    ambiguity : float
        Size of the neighbourhood from which a fragment's colour is taken (eqs 5-6), in [0, 1000] [dome radii].
    grain : float
        Size of a cell of the dome that is moved as one, in [1e-5, 10] [dome radii].
    cloud_complexity : float
        Noise cells on a dome radius (eqs 7-8), 0 for no clouds, at most 10 000 [1].
    shapes : iterable of CloudPoints or CloudSpline
        Clouds of given shape.
    principles : iterable of Principle
        Your own.
    rng : None, int, SeedSequence, BitGenerator or Generator
        Of ambiguity and clouds; drawn from once and kept as an integer.

    Raises
    ------
    ValueError, TypeError
        A value is out of range or of the wrong kind.

    Warns
    -----
    DomainWarning
        The viewer is below the ground (and put on it), or O'Neil's polynomial is used beyond what it was fitted to.

    Notes
    -----
    Shen, Mallett and Shkurko 2019; O'Neil 2005. docs/papers/aoas.md has every equation and decision.

    Examples
    --------
    >>> sky = Aoas(sun=Sun(elevation=35, azimuth=200), rayleigh=(0.03, 0.02, 0.012), cloud_complexity=4)
    >>> sky.render(Camera(32, 18, azimuth=200, elevation=15)).dtype
    dtype('float32')
    """

    sun: Sun
    rayleigh: Any = RAYLEIGH
    mie: float = 0.001
    g: float = 0.99
    sun_intensity: float = 20.0
    radius_ratio: float = 40.0
    scale_height: float = 0.25
    mie_scale_height: float | None = None
    thickness: float = 1.0
    viewer: Any = (0.0, 0.0, 0.0)
    dome_center: Any = (0.0, 0.0, 0.0)
    dome_radius: float = 1.0
    apex: str = "constant"
    ground: Any = "horizon"
    shadow: bool = True
    disc: float = 0.0
    optical_depth: str = "exact"
    samples: int | None = None
    sampling: str = "midpoint"
    ambiguity: float = 0.0
    grain: float = 1 / 512
    cloud_complexity: float = 0.0
    shapes: Any = ()
    principles: Any = ()
    rng: Any = 0

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.sun, "sun", Sun)
        put(self, "rayleigh", vector(self.rayleigh, "rayleigh", 0, 1e3))
        for name, (low, high) in _RANGES.items():
            put(self, name, real(getattr(self, name), name, low, high, _unit(name)))
        low = 0.01 * self.thickness
        put(self, "scale_height", real(self.scale_height, "scale_height", low, 1e3, "thickness"))
        if self.mie_scale_height is not None:
            put(self, "mie_scale_height", real(self.mie_scale_height, "mie_scale_height", low, 1e3, "thickness"))
        put(self, "viewer", vector(self.viewer, "viewer"))
        put(self, "dome_center", vector(self.dome_center, "dome_center"))
        put(self, "dome_radius", real(self.dome_radius, "dome_radius", 1e-30, 1e30, "m"))
        choice(self.apex, "apex", ("constant", "radial"))
        if isinstance(self.ground, str):
            choice(self.ground, "ground", ("horizon",))
        else:
            put(self, "ground", vector(self.ground, "ground", 0))
        put(self, "shadow", flag(self.shadow, "shadow"))
        put(self, "disc", real(self.disc, "disc", 0, 30, "°"))
        choice(self.optical_depth, "optical_depth", ("exact", "oneil"))
        if self.samples is not None:
            put(self, "samples", integer(self.samples, "samples", 1, 10_000))
        choice(self.sampling, "sampling", ("midpoint", "start"))
        put(self, "shapes", several(self.shapes, "shapes"))
        for shape in self.shapes:
            if not isinstance(shape, (CloudPoints, CloudSpline)):
                msg = f"shapes must hold CloudPoints and CloudSpline, got {type(shape).__name__}"
                raise TypeError(msg)
        put(
            self,
            "principles",
            tuple(instance(p, "principles", Principle) for p in several(self.principles, "principles")),
        )
        plain = isinstance(self.rng, (int, np.integer)) and not isinstance(self.rng, bool) and self.rng >= 0
        put(self, "rng", int(self.rng) if plain else key(self.rng))
        self._warn()

    def _warn(self) -> None:
        x, y, z = (self.thickness * v for v in self._place())
        # The ground is a ball: aside of the centre it is lower.
        below = -(2 * self.radius_ratio * z + x * x + y * y + z * z)
        if self.apex == "constant" and below > 0:
            msg = f"the viewer is {below / (2 * self.radius_ratio * self.thickness):g} dome radii below the ground and is put on it"
            warnings.warn(msg, DomainWarning, stacklevel=4)
        fitted = math.isclose(self.radius_ratio, 40, rel_tol=0.05) and math.isclose(
            self.scale_height, 0.25, rel_tol=0.05
        )
        if self.optical_depth == "oneil" and not (fitted and self.thickness == 1 and self.mie_scale_height is None):
            msg = "optical_depth='oneil' was fitted to radius_ratio 40, scale_height 0.25, thickness 1"
            warnings.warn(msg, DomainWarning, stacklevel=4)

    def _place(self) -> tuple[float, float, float]:
        """Return the viewer in dome radii from the dome's centre."""
        x, y, z = (
            min(max((v - c) / self.dome_radius, -1e9), 1e9) for v, c in zip(self.viewer, self.dome_center, strict=True)
        )
        return x, y, z

    def _core(self, tolerance: float) -> SkyModel:
        mie_scale = self.scale_height if self.mie_scale_height is None else self.mie_scale_height
        return _built(
            _Settings(
                sun=self.sun.direction,
                rayleigh=self.rayleigh,
                mie=self.mie,
                g=self.g,
                sun_intensity=self.sun_intensity,
                radius_ratio=self.radius_ratio,
                thickness=self.thickness,
                scale_heights=(self.scale_height, mie_scale),
                viewer=self._place(),
                radial_apex=self.apex == "radial",
                shadow=self.shadow,
                polynomial_depth=self.optical_depth == "oneil",
                samples=self.samples,
                left_rule=self.sampling == "start",
                ground=None if self.ground == "horizon" else self.ground,
                disc=math.radians(self.disc),
                ambiguity=self.ambiguity,
                grain=self.grain,
                cloud_complexity=self.cloud_complexity,
                shapes=tuple((tuple(map(tuple, points)), *rest) for points, *rest in (s._core() for s in self.shapes)),
                key=key(self.rng),
                tolerance=tolerance,
            )
        )

    @property
    def _in_core(self) -> bool:
        return not self.principles

    def fragments(self, directions: ArrayLike) -> NDArray[np.float64]:
        """Return where view rays meet the skydome, P_f of eq 1.

        Parameters
        ----------
        directions : array_like (..., 3)
            Vectors away from the viewer, of any length but zero.

        Returns
        -------
        ndarray (..., 3) of float64
            In dome radii from the dome's centre; the far point for a viewer outside.

        Raises
        ------
        ValueError, TypeError
            The shape is wrong, or a vector is zero or not finite.

        Examples
        --------
        >>> Aoas(sun=Sun(30), viewer=(0, 0, 0.5)).fragments([0, 0, 1]).tolist()
        [0.0, 0.0, 1.0]
        """
        to = units(directions, "directions")
        out = np.empty(to.shape)
        sky_dome_points(self._place(), to, out)
        return out

    def _moved(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        fragments = self.fragments(directions)
        moved = fragments
        for principle in self.principles:
            moved = np.asarray(principle.move(moved, self.rng), float)
            if moved.shape != fragments.shape:
                msg = f"{type(principle).__name__}.move must keep the shape {fragments.shape}, got {moved.shape}"
                raise ValueError(msg)
        # Where nothing moved, the direction keeps its digits.
        if moved is fragments:
            return directions
        return np.ascontiguousarray(moved - np.array(self._place()))

    def _colored(self, rgb: Array, directions: NDArray[np.float64]) -> Array:
        fragments = self.fragments(directions)
        for principle in self.principles:
            colored = np.asarray(principle.color(rgb, fragments, self.rng))
            if colored.shape != fragments.shape:
                msg = f"{type(principle).__name__}.color must keep the shape {fragments.shape}, got {colored.shape}"
                raise ValueError(msg)
            rgb = colored
        return rgb

    def seen_by(self, camera: Camera) -> Aoas:
        """Return the sky as a camera in the scene sees it: its position becomes the viewer's.

        Parameters
        ----------
        camera : Camera
            With its position in the unit of the scene.

        Returns
        -------
        Aoas
            The same sky for another viewer.

        Examples
        --------
        >>> Aoas(sun=Sun(30), dome_radius=100).seen_by(Camera(16, 9, position=(1, 2, 3))).viewer
        (1.0, 2.0, 3.0)
        """
        return replace(self, viewer=instance(camera, "camera", Camera).position)

    def without_disc(self) -> Aoas:
        """Return the sky without the disc of the Sun.

        Returns
        -------
        Aoas
            With `disc=0`.

        Examples
        --------
        >>> Aoas(sun=Sun(30), disc=0.3).without_disc().disc
        0.0
        """
        return replace(self, disc=0.0) if self.disc else self

    def _disc_radius(self) -> float:
        return self.disc or SUN_RADIUS

    def to_json(self) -> str:
        """Return the sky as JSON; `pleinair.sky.from_json` reads it back.

        Returns
        -------
        str
            All parameters.

        Raises
        ------
        ValueError
            The sky has principles of your own, which are code.

        Examples
        --------
        >>> from pleinair.sky import from_json
        >>> sky = Aoas(sun=Sun(30, 200), cloud_complexity=3)
        >>> from_json(sky.to_json()) == sky
        True
        """
        if self.principles:
            msg = "a sky with principles of your own cannot be written as JSON: they are code"
            raise ValueError(msg)
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "principles"}
        values["sun"] = {"elevation": self.sun.elevation, "azimuth": self.sun.azimuth}
        if self.sun.distance != 1:
            values["sun"]["distance"] = self.sun.distance
        values["shapes"] = [{"kind": type(s).__name__, **asdict(s)} for s in self.shapes]
        return json.dumps({"kind": "aoas", **values}, indent=2)


def _unit(name: str) -> str:
    return {"mie": "1/thickness", "radius_ratio": "thickness", "ambiguity": "dome radii", "grain": "dome radii"}.get(
        name, "1"
    )

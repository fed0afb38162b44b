"""Projected strokes and their alpha compositing, in hard order or in slabs of depth. Public as `pleinair.paint`."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import paint_composite, paint_mask, paint_noise, paint_over
from .._support.docs import documented
from .._support.inputs import (
    Aligned,
    Array,
    Progress,
    array,
    choice,
    flag,
    instance,
    integer,
    linear_light,
    real,
    reporter,
    shape_text,
)

Floats = NDArray[np.float32]


def rows(value: ArrayLike, name: str, count: int, *last: int, dtype: type = np.float32) -> Array:
    """Return one row for each of `count` strokes; a single row is every stroke's."""
    out = array(value, name, dtypes=(dtype,) if dtype in (np.float32, np.float64) else (np.float32, np.float64))
    if out.shape == last and last:
        out = np.broadcast_to(out, (count, *last))
    if out.shape != (count, *last):
        msg = f"{name} must have shape {shape_text((count, *last))}, got {shape_text(out.shape)}"
        raise ValueError(msg)
    return np.ascontiguousarray(out, dtype=dtype)


def column(value: ArrayLike, name: str, count: int, low: float, high: float, unit: str = "1") -> Any:
    """Return a number, or an array (count,) of float32, in `[low, high]`."""
    if np.ndim(value) == 0:
        return real(
            np.asarray(value).item() if isinstance(value, (np.ndarray, np.generic)) else value, name, low, high, unit
        )
    out = rows(value, name, count)
    if out.size and not (out.min() >= low and out.max() <= high):
        msg = f"{name} must be in [{low:g}, {high:g}] [{unit}], got {out.min():g} to {out.max():g}"
        raise ValueError(msg)
    return out


def whole(value: ArrayLike, name: str, count: int, dtype: type) -> Array:
    """Return an integer for each of `count` strokes."""
    out = np.asarray(value)
    if out.dtype.kind not in "iu":
        msg = f"{name} must hold integers, got dtype {out.dtype}"
        raise TypeError(msg)
    if out.shape != (count,):
        msg = f"{name} must have shape ({count},), got {shape_text(out.shape)}"
        raise ValueError(msg)
    limits = np.iinfo(dtype)
    if out.size and (int(out.min()) < limits.min or int(out.max()) > limits.max):
        msg = f"{name} must be in [{limits.min}, {limits.max}], got {out.min()} to {out.max()}"
        raise ValueError(msg)
    return np.ascontiguousarray(out, dtype=dtype)


@dataclass(frozen=True, eq=False)
class Sprites(Aligned):
    """Strokes as the picture sees them: rectangles with a mask, a colour and a depth.

    A number stands for every stroke; an array has one for each.

    Parameters
    ----------
    center : array_like (n, 2)
        Centre, to the right and down from the picture's top left corner [px].
    size : array_like (n, 2) or (2,)
        Width and height; without either a stroke is not painted. Below 2.5 px it is that wide, and fainter [px].
    depth : array_like (n,)
        Distance from the eye, which is the order; equal ones are in the order of `id` [m].
    color : array_like (n, 3) or (3,)
        Linear light.
    variation : array_like (n, 3) or (3,), optional
        What a noise of +1 adds to the colour within the stroke; its mean is 0.
    rotation : float or array_like (n,)
        Counter-clockwise, about the view axis [°]. Upright strokes are painted twice as fast.
    opacity : float or array_like (n,)
        Largest opacity, in [0, 1] [1].
    label : array_like (n,) of int, optional
        Seeds of the masks, below 2³²; the index if there are none.
    frequency : float or array_like (n,)
        Cells of noise across the width, in [0, 1e5] [1]. What is finer than 2 px fades to the noise's mean.
    frequency_t : float or array_like (n,), optional
        Cells of noise across the height [1]; as `frequency`.
    color_frequency : float or array_like (n,)
        Cells of the noise of the colour [1].
    fullness : float or array_like (n,)
        Bias of the edge, in (0, 1) [1]: a fuller stroke fills more of its rectangle.
    feather_min, feather_max : float or array_like (n,)
        Noise below which there is no paint, and above which it is full, at least 0 and in this order [1].
    squeeze : float or array_like (n,)
        Share of the height that is painted, in [0.001, 1] [1].
    id : array_like (n,) of int, optional
        Decides which of two strokes of the same depth is in front; the index if there is none.

    Raises
    ------
    ValueError, TypeError
        A column has the wrong shape or is out of range.

    Examples
    --------
    >>> stroke = Sprites([[16, 12]], [20, 10], [3.0], [0.2, 0.4, 0.1])
    >>> len(stroke)
    1
    """

    center: Any
    size: Any
    depth: Any
    color: Any
    variation: Any = None
    rotation: Any = 0.0
    opacity: Any = 0.9
    label: Any = None
    frequency: Any = 4.0
    frequency_t: Any = None
    color_frequency: Any = 8.0
    fullness: Any = 0.8
    feather_min: Any = 0.4
    feather_max: Any = 0.6
    squeeze: Any = 1.0
    id: Any = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        depth = array(self.depth, "depth", dtypes=(np.float64,), ndim=1)
        n = len(depth)
        put(self, "depth", depth)
        put(self, "center", rows(self.center, "center", n, 2))
        put(self, "size", rows(self.size, "size", n, 2))
        put(self, "color", rows(self.color, "color", n, 3))
        if self.variation is not None:
            put(self, "variation", rows(self.variation, "variation", n, 3))
        put(self, "rotation", column(self.rotation, "rotation", n, -1e6, 1e6, "°"))
        put(self, "opacity", column(self.opacity, "opacity", n, 0, 1))
        label = np.arange(n, dtype=np.uint32) if self.label is None else whole(self.label, "label", n, np.uint32)
        put(self, "label", label)
        if self.frequency_t is None:
            put(self, "frequency_t", self.frequency)
        for name in ("frequency", "frequency_t", "color_frequency"):
            put(self, name, column(getattr(self, name), name, n, 0, 1e5))
        put(self, "fullness", column(self.fullness, "fullness", n, 1e-6, 1 - 1e-6))
        put(self, "feather_min", column(self.feather_min, "feather_min", n, 0, 1e6))
        put(self, "feather_max", column(self.feather_max, "feather_max", n, 0, 1e6))
        if np.any(np.asarray(self.feather_max) < np.asarray(self.feather_min)):
            msg = "feather_max must not be below feather_min"
            raise ValueError(msg)
        put(self, "squeeze", column(self.squeeze, "squeeze", n, 1e-3, 1))
        if self.id is not None:
            put(self, "id", whole(self.id, "id", n, np.int64))

    @classmethod
    def _of(cls, **columns: Any) -> Sprites:
        """Return sprites of columns that the core made: they are known to be right, and nothing is looked at again."""
        out = object.__new__(cls)
        out.__dict__.update(columns)
        return out

    def __len__(self) -> int:
        return len(self.depth)

    @property
    def radians(self) -> Any:
        """The rotation as the core takes it [rad]."""
        if isinstance(self.rotation, float):
            return math.radians(self.rotation)
        return np.deg2rad(self.rotation)


@dataclass(frozen=True, eq=False)
class Canvas:
    """Painted strokes, over nothing yet.

    Attributes
    ----------
    rgb : ndarray (height, width, 3) of float32
        Their light, premultiplied.
    transmittance : ndarray (height, width) of float32
        Share of the light from behind that comes through [1].
    depth : ndarray (height, width) of float32 or None
        Mean depth of what is seen [m]; infinite where nothing is.
    index : ndarray (height, width) of int64 or None
        The stroke with the largest weight; -1 where none is.
    """

    rgb: Floats
    transmittance: Floats
    depth: Floats | None = None
    index: NDArray[np.int64] | None = None

    def over(self, sky: ArrayLike) -> Floats:
        """Return the picture in front of a sky.

        Parameters
        ----------
        sky : array_like (3,) or (height, width, 3)
            Linear light behind the strokes.

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear light.

        Raises
        ------
        ValueError, TypeError
            The sky has another shape, or holds integers.

        Examples
        --------
        >>> empty = composite(Sprites(np.zeros((0, 2)), (1, 1), [], (1, 1, 1)), 4, 3)
        >>> empty.over((0.2, 0.4, 0.8))[0, 0].tolist() == np.float32([0.2, 0.4, 0.8]).tolist()
        True
        """
        behind = linear_light(sky, "sky", last=3)
        if behind.shape not in ((3,), self.rgb.shape):
            msg = f"sky must have shape (3,) or {shape_text(self.rgb.shape)}, got {shape_text(behind.shape)}"
            raise ValueError(msg)
        out = np.empty_like(self.rgb)
        full = np.ascontiguousarray(np.broadcast_to(behind, self.rgb.shape), dtype=np.float32)
        paint_over(self.rgb, self.transmittance, full, out)
        return out


@documented
def composite(
    sprites: Sprites,
    width: int,
    height: int,
    *,
    order: str = "hard",
    delta: ArrayLike | None = None,
    method: str = "fast",
    seen: bool = False,
    progress: Progress = None,
) -> Canvas:
    """Paint strokes, near over far.

    Parameters
    ----------
    sprites : Sprites
        The strokes.
    width, height : int
        Size of the picture [px].
    order : {"hard", "slab"}
        In hard order a stroke hides those behind it. In slab order it is a layer of even extinction, `delta` thick to
        both sides of its depth, and mixes with those it overlaps: nothing jumps when two strokes exchange their places.
        One stroke alone is the same in both; with a `delta` of 0 all are.
    delta : float or array_like (n,), optional
        Half thickness in slab order, in [0, 1e12] [m].
    method : {"fast", "reference"}
        The reference goes pixel by pixel in float64 (slow: the oracle of the tests).
    seen : bool
        Return mean depth and index of the stroke with the largest weight too, in hard order.
    {progress}

    Returns
    -------
    Canvas
        Light and transmittance.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range; a stroke with an area has a property that is not finite.

    Examples
    --------
    >>> strokes = Sprites([[16, 12], [18, 12]], (20, 10), [3.0, 2.0], [[0.2, 0.4, 0.1], [0.5, 0.5, 0.2]])
    >>> canvas = composite(strokes, 32, 24)
    >>> canvas.rgb.shape, float(canvas.transmittance[0, 0])
    ((24, 32, 3), 1.0)
    """
    instance(sprites, "sprites", Sprites)
    width, height = integer(width, "width", 1, 65536), integer(height, "height", 1, 65536)
    slab = choice(order, "order", ("hard", "slab")) == "slab"
    exact = choice(method, "method", ("fast", "reference")) == "reference"
    if slab and delta is None:
        msg = "delta must be given with order='slab'"
        raise ValueError(msg)
    thickness: Any = 0.0
    if slab and delta is not None:
        if np.ndim(delta) == 0:
            thickness = real(np.asarray(delta).item(), "delta", 0, 1e12, "m")
        else:
            thickness = rows(delta, "delta", len(sprites), dtype=np.float64)
    rgb = np.empty((height, width, 3), np.float32)
    through = np.empty((height, width), np.float32)
    extra = None
    if flag(seen, "seen") and not exact:
        extra = (np.empty((height, width), np.float32), np.empty((height, width), np.int64))
    callback, close = reporter(progress, "paint")
    try:
        paint_composite(sprites, slab, thickness, (width, height), rgb, through, extra, exact, callback)
    finally:
        close()
    return Canvas(rgb, through, *(extra or (None, None)))


@dataclass(frozen=True)
class _Mask:
    """What the core reads."""

    label: int
    frequency: tuple[float, float]
    fullness: float
    feather: tuple[float, float]
    opacity: float
    squeeze: float


def mask(
    label: int,
    width: int,
    height: int,
    *,
    frequency: Any = 4.0,
    fullness: float = 0.8,
    feather_min: float = 0.4,
    feather_max: float = 0.6,
    opacity: float = 0.9,
    squeeze: float = 1.0,
) -> NDArray[np.float64]:
    """Return the mask of one stroke (S8-S11), by the plain formula.

    Parameters
    ----------
    label : int
        Seed, below 2³² [1].
    width, height : int
        Points across and down, at pixel centres, in [1, 65536] [1].
    frequency : float or tuple of float
        Cells of noise across, or across and down, in [0, 1e5] [1].
    fullness : float
        Bias of the edge, in (0, 1) [1].
    feather_min, feather_max : float
        Noise below which there is no paint, and above which it is full [1].
    opacity : float
        Largest opacity, in [0, 1] [1].
    squeeze : float
        Share of the height that is painted, in [0.001, 1] [1].

    Returns
    -------
    ndarray (height, width) of float64
        Opacity [1].

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Examples
    --------
    >>> float(mask(3, 32, 32).max()) <= 0.9
    True
    """
    along, down = frequency if np.ndim(frequency) == 1 else (frequency, frequency)
    low = real(feather_min, "feather_min", 0, 1e6)
    shape = _Mask(
        integer(label, "label", 0, 2**32 - 1),
        (real(along, "frequency", 0, 1e5), real(down, "frequency", 0, 1e5)),
        real(fullness, "fullness", 1e-6, 1 - 1e-6),
        (low, real(feather_max, "feather_max", low, 1e6)),
        real(opacity, "opacity", 0, 1),
        real(squeeze, "squeeze", 1e-3, 1),
    )
    s = (np.arange(integer(width, "width", 1, 65536)) + 0.5) / width
    t = (np.arange(integer(height, "height", 1, 65536)) + 0.5) / height
    at = np.stack(np.meshgrid(s, t), axis=-1)
    out = np.empty(at.shape[:2])
    paint_mask(shape, at, out)
    return out


def noise(label: int, at: ArrayLike) -> NDArray[np.float64]:
    """Return the noise of masks (S8) at points of its lattice.

    Parameters
    ----------
    label : int
        Seed, below 2³² [1].
    at : array_like (..., 2)
        Points, in cells [1].

    Returns
    -------
    ndarray (...) of float64
        In [-1, 1], mean 0, standard deviation about 0.17 [1]; a mask takes 1/2 more of it.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Examples
    --------
    >>> float(abs(noise(1, [[0.25, 7.5]])).max()) <= 1
    True
    """
    points = array(at, "at", dtypes=(np.float64,), last=2)
    if not np.isfinite(points).all() or (np.abs(points) > 1e6).any():
        msg = "at must hold finite points within 1e6 cells"
        raise ValueError(msg)
    out = np.empty(points.shape[:-1])
    paint_noise(integer(label, "label", 0, 2**32 - 1), points, out)
    return out


def coverage(threshold: ArrayLike) -> NDArray[np.float64]:
    """Return the share of a mask's noise that lies above a threshold, which tells what `feather_min` leaves (S8).

    Parameters
    ----------
    threshold : array_like (...)
        Of the noise of mean 1/2, as `feather_min` is [1].

    Returns
    -------
    ndarray (...) of float64
        Share in [0, 1] [1], within 0.003.

    Raises
    ------
    TypeError
        The thresholds are not numbers.

    Examples
    --------
    >>> coverage([0.0, 0.5, 1.0]).round(2).tolist()
    [1.0, 0.5, 0.0]
    """
    wanted = array(threshold, "threshold", dtypes=(np.float64,))
    return np.asarray(1 - np.searchsorted(_sample(), wanted, side="right") / len(_sample()))


@functools.cache
def _sample() -> NDArray[np.float64]:
    """Values of the noise, sorted."""
    side = (np.arange(512) + 0.5) * (341 / 512)
    return np.sort(np.clip(0.5 + noise(12, np.stack(np.meshgrid(side, side), axis=-1)), 0, 1).ravel())

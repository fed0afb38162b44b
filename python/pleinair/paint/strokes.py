"""Strokes in the world, the lights on them, and the result of every stage of the shader. Public as `pleinair.paint`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import Aligned, array, instance, real, shape_text, units, vector
from .material import paint
from .sprites import Floats, Sprites, column, rows, whole

# What has one entry for each stroke, or one for all.
_COLUMNS = (
    "position",
    "normal",
    "size",
    "label",
    "center_ratio",
    "branch_ratio",
    "fade",
    "twist",
    "lit",
    "object",
    "id",
)


@dataclass(frozen=True, eq=False)
class Strokes(Aligned):
    """Strokes in the world: any list of points with normals and sizes.

    Parameters
    ----------
    position : array_like (n, 3)
        Where they are: x east, y north, z up [m].
    normal : array_like (n, 3) or (3,)
        Of the surface or crown they stand for; any length but zero.
    size : array_like (n, 2) or (2,)
        Width and height [m].
    label : array_like (n,) of int, optional
        Seeds of masks and variation, below 2³²; the index if there are none.
    material : str
        Which of a style's materials.
    center_ratio : float or array_like (n,)
        0 at the centre of the crown or deepest in the surface, 1 outermost, in [0, 1] [1].
    branch_ratio : float or array_like (n,)
        0 where the branch begins, 1 at its tip, in [0, 1] [1].
    fade : array_like (n, 2), optional
        Distances `d` at which a stroke begins to fade and is gone [1]; above 1 it never does.
    twist : float or array_like (n,)
        Counter-clockwise rotation about the view axis [°].
    lit : float or array_like (n,)
        Share of the light that reaches the stroke, in [0, 1] [1]; see `shadows`.
    object : array_like (n,) of int, optional
        Index of the tree a stroke belongs to. `d` is then the tree's, one for all of its strokes.
    centers : array_like (m, 3), optional
        Centres of the trees [m].
    tint : array_like (m,), optional
        Where each tree's tint lies between the style's two, in [0, 1] [1].
    growth : array_like (m, 3, k), optional
        What `growth` returned for each tree.
    id : array_like (n,) of int, optional
        Decides which of two strokes at the same distance is in front; the index if there is none.

    Raises
    ------
    ValueError, TypeError
        A column has the wrong shape or is out of range.

    Examples
    --------
    >>> strokes = Strokes([[0, 10, 0], [1, 11, 0]], (0, 0, 1), (0.5, 0.3))
    >>> len(strokes), strokes.material
    (2, 'leaves')
    """

    position: Any
    normal: Any
    size: Any
    label: Any = None
    material: str = "leaves"
    center_ratio: Any = 1.0
    branch_ratio: Any = 0.0
    fade: Any = None
    twist: Any = 0.0
    lit: Any = 1.0
    object: Any = None
    centers: Any = None
    tint: Any = None
    growth: Any = None
    id: Any = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        position = array(self.position, "position", dtypes=(np.float64,), ndim=2, last=3)
        if not np.isfinite(position).all():
            msg = "position must be finite"
            raise ValueError(msg)
        n = len(position)
        put(self, "position", position)
        put(self, "normal", rows(units(self.normal, "normal"), "normal", n, 3))
        size = rows(self.size, "size", n, 2)
        if size.size and not (np.isfinite(size).all() and size.min() >= 0):
            msg = "size must be finite and at least 0 [m]"
            raise ValueError(msg)
        put(self, "size", size)
        label = np.arange(n, dtype=np.uint32) if self.label is None else whole(self.label, "label", n, np.uint32)
        put(self, "label", label)
        put(self, "material", instance(self.material, "material", str))
        for name in ("center_ratio", "branch_ratio", "lit"):
            put(self, name, column(getattr(self, name), name, n, 0, 1))
        if self.fade is not None:
            fade = rows(self.fade, "fade", n, 2)
            if np.isnan(fade).any() or (fade[:, 0] > fade[:, 1]).any():
                msg = "fade must hold two distances that rise"
                raise ValueError(msg)
            put(self, "fade", fade)
        put(self, "twist", column(self.twist, "twist", n, -1e6, 1e6, "°"))
        self._objects(n)
        if self.id is not None:
            put(self, "id", whole(self.id, "id", n, np.int64))

    def _objects(self, n: int) -> None:
        put = object.__setattr__
        centers = array(np.zeros((0, 3)) if self.centers is None else self.centers, "centers", ndim=2, last=3)
        m = len(centers)
        put(self, "centers", np.ascontiguousarray(centers, dtype=np.float64))
        tint = np.full(m, 0.5) if self.tint is None else rows(self.tint, "tint", m, dtype=np.float64)
        if tint.size and not (tint.min() >= 0 and tint.max() <= 1):
            msg = "tint must be in [0, 1] [1]"
            raise ValueError(msg)
        put(self, "tint", tint)
        if self.object is not None:
            index = whole(self.object, "object", n, np.uint32)
            if n and int(index.max()) >= m:
                msg = f"object must be below the number of centers, {m}, got {index.max()}"
                raise ValueError(msg)
            put(self, "object", index)
        if self.growth is not None:
            law = array(self.growth, "growth", dtypes=(np.float64,), ndim=3)
            if law.shape[:2] != (m, 3) or law.shape[2] < 1 or not (np.isfinite(law).all() and (law >= 0).all()):
                msg = f"growth must have shape ({m}, 3, k) and hold finite numbers, got {shape_text(law.shape)}"
                raise ValueError(msg)
            put(self, "growth", law)

    def __len__(self) -> int:
        return len(self.position)

    def _with(self, index: NDArray[np.int64] | None = None, **changes: Any) -> Strokes:
        """Return some of the strokes, with columns that are known to be right: nothing is looked at again."""
        out = object.__new__(Strokes)
        state = dict(self.__dict__)
        if index is not None:
            for name in _COLUMNS:
                if isinstance(state[name], np.ndarray) and state[name].ndim:
                    state[name] = state[name][index]
        out.__dict__.update(state | changes)
        return out


@dataclass(frozen=True)
class Light:
    """A light from far away.

    Parameters
    ----------
    direction : array_like (3,)
        To the light; any length but zero.
    strength : float
        Lightness it gives a surface that faces it, in [0, 100] [1].
    color : color
        Its colour: linear RGB [1] or '#rrggbb' of sRGB, of any luminance.

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range; the colour is black.

    Examples
    --------
    >>> Light((0, 0, 2)).direction
    (0.0, 0.0, 1.0)
    """

    direction: Any
    strength: float = 0.8
    color: Any = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        put = object.__setattr__
        x, y, z = units(vector(self.direction, "direction"), "direction").tolist()
        put(self, "direction", (x, y, z))
        put(self, "strength", real(self.strength, "strength", 0, 100))
        put(self, "color", paint(self.color, "color"))
        if not max(self.color) > 0:
            msg = "color must not be black"
            raise ValueError(msg)


def source(light: Light) -> tuple[Any, float, tuple[float, float, float]]:
    """Return what the core reads: direction, strength, colour of luminance 1."""
    r, g, b = light.color
    y = 0.2126 * r + 0.7152 * g + 0.0722 * b
    return light.direction, light.strength, (r / y, g / y, b / y)


@dataclass(frozen=True)
class Shading:
    """What became of each stroke, stage by stage in the thesis' order.

    Attributes
    ----------
    lightness : ndarray (n,) of float32
        Of illumination alone [1] (S1).
    placed : ndarray (n,) of float32
        With the place in the crown [1] (S2).
    shadow : ndarray (n,) of float32
        Factor of the shadow [1] (S4).
    final : ndarray (n,) of float32
        What chose the colour [1] (S5).
    palette : ndarray (n,) of float32
        0 dark, 1 middle, 2 light, and between [1] (S12).
    distance : ndarray (n,) of float32
        `d`, 0 near and 1 far [1] (D1).
    sprites : Sprites
        Masks, colours, places and depths.
    """

    lightness: Floats
    placed: Floats
    shadow: Floats
    final: Floats
    palette: Floats
    distance: Floats
    sprites: Sprites

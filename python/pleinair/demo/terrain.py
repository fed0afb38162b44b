"""The ground of the demonstration landscapes: hills, water, a lane, and what is built far away."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..plants import Surface

__all__ = ["COMPOSITIONS", "Terrain", "building"]

#: What the middle of a landscape is.
COMPOSITIONS = ("river", "pond", "lane", "clearing", "hills")


@dataclass(frozen=True)
class Terrain:
    """A ground, as heights over places [m].

    Attributes
    ----------
    kind : str
        One of `COMPOSITIONS`.
    hills : tuple
        Height, middle and widths of each.
    bend, phase : float
        How far a river or a lane swings [m], and where it begins to [rad].
    """

    kind: str
    hills: tuple[tuple[float, float, float, float, float], ...]
    bend: float
    phase: float

    #: Middle of the pond [m].
    pond = (1.0, 38.0)

    @classmethod
    def drawn(cls, kind: str, rng: np.random.Generator) -> Terrain:
        """Draw hills and bends."""
        high = 1.5 if kind == "hills" else 1.0
        hills = [
            (26.0 * high, -150.0, 330.0, 110.0, 90.0),
            (34.0 * high, 120.0, 420.0, 160.0, 90.0),
            (20.0 * high, 10.0, 520.0, 260.0, 70.0),
        ]
        if kind != "pond":
            hills = [
                (
                    float(h * rng.uniform(0.7, 1.3)),
                    float(x + rng.uniform(-90, 90)),
                    y,
                    float(w * rng.uniform(0.7, 1.3)),
                    d,
                )
                for h, x, y, w, d in hills
            ]
        return cls(kind, tuple(hills), float(rng.uniform(8, 15)), float(rng.uniform(0, 2 * np.pi)))

    def middle(self, y: ArrayLike) -> NDArray[np.float64]:
        """Where a river or a lane runs, at a distance to the north [m]."""
        y = np.asarray(y, np.float64)
        # Further away it swings wider, as a river does that is seen along its valley.
        return np.asarray(self.bend * (0.4 + y / 90) * np.sin(y / 34 + self.phase) * np.clip(y / 25, 0, 1))

    def half_width(self, y: ArrayLike) -> NDArray[np.float64]:
        """Of the river or the lane [m]."""
        y = np.asarray(y, np.float64)
        return np.asarray(np.where(y > 0, 7.0 + 0.03 * y, 7.0) if self.kind == "river" else 2.3 + 0.01 * y)

    def height(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Return the height of the ground [m]: a valley, hills behind it, and the bed of its water."""
        x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
        rolling = 2.2 * np.sin(x / 47 + 0.6) * np.cos(y / 61)
        valley = 7 * (x / 90) ** 2 / (1 + (x / 90) ** 2)
        hills = sum(h * np.exp(-(((x - cx) / wx) ** 2) - ((y - cy) / wy) ** 2) for h, cx, cy, wx, wy in self.hills)
        ground: NDArray[np.float64] = np.asarray(rolling + valley + hills)
        if self.kind == "pond":
            px, py = self.pond
            ground = ground - 4.5 * np.exp(-((((x - px) / 17) ** 2 + ((y - py) / 15) ** 2) ** 2))
        if self.kind == "river":
            off = np.abs(x - self.middle(y)) / (self.half_width(y) + 7.0)
            bank = np.exp(-(off**4)) * (y < 260)
            ground = ground * (1 - bank) + (self.level - 2.2) * bank
        return ground

    @property
    def level(self) -> float:
        """Of its water [m]."""
        return float(self.height(*self.pond)) + 3.7 if self.kind == "pond" else -0.6

    def water(self) -> Surface | None:
        """Return the surface of its water."""
        if self.kind == "pond":
            px, py = self.pond
            return Surface.heightfield(np.full((2, 2), self.level), (44.0, 40.0), (px - 22, py - 20, 0.0))
        return self._band(np.linspace(-6, 230, 60), self.level) if self.kind == "river" else None

    def lane(self) -> Surface | None:
        """Return a path that the feet of cattle have made."""
        return self._band(np.linspace(-8, 190, 80), None) if self.kind == "lane" else None

    def _band(self, y: NDArray[np.float64], level: float | None) -> Surface:
        middle, half = self.middle(y), self.half_width(y) + (6.0 if level is not None else 0.0)
        across = np.linspace(-1, 1, 4)
        x = middle[:, None] + half[:, None] * across
        z = np.full(x.shape, level) if level is not None else self.height(x, y[:, None]) + 0.5
        # Across first, so that normals point up; a lane lies on the tips of the grass that does not grow there.
        points = np.stack([x, np.broadcast_to(y[:, None], x.shape), z], axis=-1)
        return Surface.nurbs(points.swapaxes(0, 1), degree=1)

    def free(self, x: float, y: float) -> bool:
        """Whether a tree may stand there: not in water, not on the lane."""
        if self.kind in ("river", "lane"):
            return bool(abs(x - float(self.middle(y))) > float(self.half_width(y)) + 4.0)
        return self.kind != "pond" or bool(((x - self.pond[0]) / 19) ** 2 + ((y - self.pond[1]) / 17) ** 2 > 1)


def building(at: tuple[float, float, float], size: tuple[float, float, float], roof: float, turn: float) -> list[Any]:
    """Walls and the roof of a house or a tower, for strokes: its foot, width, depth and height, its roof's [m], its turn [°]."""
    w, d, h = size
    corners = np.array([(-w, -d), (w, -d), (w, d), (-w, d), (-w, -d)]) / 2
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    corners = corners @ np.array([[c, s], [-s, c]])

    def ring(scale: float, z: float) -> NDArray[np.float64]:
        return np.column_stack([corners * scale, np.full(5, z)]) + at

    walls = Surface.nurbs(np.stack([ring(1.0, -2.0), ring(1.0, h)], axis=1), degree=1)
    top = Surface.nurbs(np.stack([ring(1.15, h), ring(0.04, h + roof)], axis=1), degree=1)
    return [walls, top]

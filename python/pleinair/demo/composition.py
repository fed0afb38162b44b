"""A landscape to start from: hills, a pond, rocks and a grove. Public as `pleinair.demo.landscape`."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.inputs import generator, instance, integer
from ..astro import Moon, Sun
from ..camera import Camera
from ..clouds import procedural
from ..paint import Style
from ..paint import style as named
from ..plants import Strata, Surface, Tree, preset, rock
from ..scene import Ground, Placed, Scene
from ..sky import Natural, Sky

# The ground's grid: columns and rows, their distance and the south-west corner [m].
_CELLS, _STEP, _CORNER = 96, 6.0, (-288.0, -30.0)
_POND = (1.0, 38.0)
_KINDS = ("oak", "birch", "thesis", "poplar")


def _height(x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
    """Return the height of the ground [m]: a valley with a pond, hills behind it."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    rolling = 2.2 * np.sin(x / 47 + 0.6) * np.cos(y / 61)
    valley = 7 * (x / 90) ** 2 / (1 + (x / 90) ** 2)
    hills = sum(
        h * np.exp(-(((x - cx) / wx) ** 2) - ((y - cy) / wy) ** 2)
        for h, cx, cy, wx, wy in ((26, -150, 330, 110, 90), (34, 120, 420, 160, 90), (20, 10, 520, 260, 70))
    )
    pond = 4.5 * np.exp(-((((x - _POND[0]) / 17) ** 2 + ((y - _POND[1]) / 15) ** 2) ** 2))
    return np.asarray(rolling + valley + hills - pond)


@functools.lru_cache(maxsize=32)
def _tree(kind: str, seed: int) -> Tree:
    """Return a tree: one object, so that what is solved for it is solved once."""
    return Tree.grow(preset(kind), rng=seed)


def landscape(
    behind: Sky | None = None,
    *,
    style: Style | str = "corot",
    trees: int = 12,
    cloud: bool = True,
    rng: Any = 1,
    grown: bool = True,
) -> tuple[Scene, Camera]:
    """Return a landscape of hills, a pond, rocks and a grove, and a camera in it.

    Parameters
    ----------
    behind : Sky, optional
        By default that of the style: noon, a winter day, dusk, a moonlit night; a hazy afternoon of others.
    style : Style or str
        The manner, or the name of one, which then has its grade.
    trees : int
        How many, in [0, 10000] [1].
    cloud : bool
        With a cumulus over the hills.
    rng : None, int or Generator
        Where trees and rocks stand, and what they look like.
    grown : bool
        As for `Scene`.

    Returns
    -------
    Scene
        Trees of four kinds, "rock" and "grass" of the style's materials, "water".
    Camera
        1280 × 720, looking north.

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Examples
    --------
    >>> scene, camera = landscape(trees=3, cloud=False, grown=False)
    >>> len(scene.select(kind="leaves")), len(scene.select("rock*", "rock"))
    (3, 9)
    """
    count = integer(trees, "trees", 0, 10_000)
    stream = generator(rng)
    x = _CORNER[0] + _STEP * np.arange(_CELLS)
    y = _CORNER[1] + _STEP * np.arange(_CELLS)
    z = _height(x, y[:, None])
    hill = Surface.heightfield(z, _STEP, (*_CORNER, 0.0))
    level = float(_height(*_POND)) + 3.7
    pond = Surface.heightfield(np.full((2, 2), level), (44.0, 40.0), (_POND[0] - 22, _POND[1] - 20, 0.0))
    # What lies before the painter's feet is scattered more densely, in smaller strokes.
    near = (np.linspace(-40, 40, 41), np.linspace(-14, 36, 26))
    lawn = Surface.heightfield(_height(near[0], near[1][:, None]), 2.0, (near[0][0], near[1][0], 0.0))
    meadow = ("grass", "straw")
    seeds = stream.integers(0, 2**31, 8).tolist()

    def scattered(
        surface: Surface, material: Any, seed: int, spans: tuple[int, int], size: tuple[float, float], **more: Any
    ) -> Ground:
        return Ground(surface, material, Strata(spans, size=size, variance=0.25, **more), seed, patch=22.0)

    objects: list[Any] = [
        # An undercoat, then blades; their sizes are a painter's, not a botanist's.
        scattered(hill, meadow, seeds[0], (130, 130), (9, 4), count=2, displacement=0.05, fade_from=1.0),
        scattered(hill, meadow, seeds[1], (150, 150), (2.4, 1.5), count=4, displacement=0.3, inside_growth=1.0),
        scattered(lawn, meadow, seeds[2], (60, 40), (2.2, 1.2), count=2, displacement=0.05, fade_from=1.0),
        scattered(lawn, meadow, seeds[3], (90, 60), (0.9, 0.8), count=3, displacement=0.2, inside_growth=0.6),
        scattered(pond, "water", seeds[4], (26, 26), (3.4, 0.5), count=4, displacement=0.0, fade_from=1.0),
    ]
    for k in range(9):
        at = (float(stream.uniform(-9, 12)), float(stream.uniform(6, 22))) if k < 4 else _shore(stream)
        size = stream.uniform(0.7, 2.0) * np.array([1.3, 1.1, 0.8])
        stone = rock(size, (*at, float(_height(*at)) - 0.1), rng=seeds[5] + k)
        strata = Strata(
            (12, 12), 3, displacement=0.04, size=(0.36 * size[0], 0.36 * size[1]), variance=0.25, fade_from=1.0
        )
        objects.append(Ground(stone, "rock", strata, seeds[5] + k, casts=True))
    for k in range(count):
        at = _place(stream, k)
        kind = _KINDS[k % len(_KINDS)]
        where = (*at, float(_height(*at)) - 0.2)
        turn, scale = float(stream.uniform(0, 360)), float(stream.uniform(0.8, 1.25))
        objects.append(Placed(_tree(kind, seeds[6] % 1000 + k % 4), where, turn, scale, name=kind))
    manner = named(style, grade=True) if isinstance(style, str) else style
    found = _sky_of(style) if behind is None else instance(behind, "behind", Sky)
    volume = None
    if cloud:
        # Of the seeds near this one, the first whose cloud has a cumulus' outline from here.
        volume = procedural("cumulus", (40, 64, 96), voxel_size=40.0, origin=(-2300, 4700, 650), rng=seeds[7] + 5)
    camera = Camera(1280, 720, fov=44, elevation=2.5, position=(0, -12, float(_height(0, -12)) + 5.0))
    scene = Scene(found, objects, manner, volume, circles=(35.0, 420.0), grown=grown, sky_strokes=60_000)
    return scene, camera


def _sky_of(style: Style | str) -> Sky:
    """Return the hour and the sky of a style: an afternoon where it has none of its own."""
    skies = {
        "impressionist_noon": Natural(sun=Sun(58, 195), turbidity=2.5),
        "winter": Natural(sun=Sun(14, 225), turbidity=2.2),
        "dusk": Natural(sun=Sun(-2.5, 335), turbidity=4.0),
        "moonlight": Natural(sun=Sun(-30, 150), moon=Moon(34, 320), turbidity=2.2),
    }
    afternoon = Natural(sun=Sun(24, 245), turbidity=3.5)
    return skies.get(style, afternoon) if isinstance(style, str) else afternoon


def _shore(stream: np.random.Generator) -> tuple[float, float]:
    """Return a place at the edge of the pond."""
    turn = stream.uniform(0, 2 * np.pi)
    return _POND[0] + 17 * float(np.cos(turn)), _POND[1] + 15 * float(np.sin(turn))


# Where the trees stand: a group on the left, two on the right, the others far away [m].
_PLACES = ((-21, 36), (22, 44), (-28, 30), (30, 54), (-16, 60), (-33, 48), (21, 70))


def _place(stream: np.random.Generator, k: int) -> tuple[float, float]:
    """Return where a tree stands: groups to both sides that leave the middle open, some far away."""
    if k < len(_PLACES):
        x, y = _PLACES[k]
        return x + float(stream.uniform(-2, 2)), y + float(stream.uniform(-2, 2))
    return float(stream.uniform(-75, 75)), float(stream.uniform(110, 200))

"""Landscapes to start from: foreground, middle and distance. Public as `pleinair.demo.landscape`."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from .._support.inputs import choice, generator, instance, integer
from ..astro import Moon, Sun
from ..camera import Camera
from ..clouds import procedural
from ..paint import Style, style_hour
from ..paint import style as named
from ..plants import Strata, Surface, Tree, preset, rock
from ..scene import Ground, Placed, Scene
from ..sky import Natural, Sky
from .terrain import COMPOSITIONS, Terrain, building

# The ground's grid: columns and rows, their distance and the south-west corner [m].
_CELLS, _STEP, _CORNER = 96, 6.0, (-288.0, -30.0)
_KINDS = ("oak", "birch", "thesis", "poplar")


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
    composition: str | None = None,
    camera: Camera | None = None,
) -> tuple[Scene, Camera]:
    """Return a landscape of hills, water or a lane, rocks and trees, and a camera in it.

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
        Which landscape: its composition, its hills, where trees and rocks stand and what they look like, whether a village
        stands far away.
    grown : bool
        As for `Scene`.
    composition : str, optional
        One of ``"pond"``, ``"river"``, ``"lane"``, ``"clearing"``, ``"hills"``; by default `rng` draws it. Each has a near
        tree that frames the view, a middle and a distance.
    camera : Camera, optional
        Instead of the one that looks north over it.

    Returns
    -------
    Scene
        Trees of four kinds, "rock", "grass", "straw" and "bark" of the style's materials, "water".
    Camera
        `camera`, or 1280 × 720, looking north.

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
    seeds = stream.integers(0, 2**31, 8).tolist()
    # Of its own, so that a composition that is asked for leaves the trees and rocks of a seed as they are.
    own = np.random.default_rng(seeds[3])
    drawn = str(own.choice(COMPOSITIONS))
    kind = drawn if composition is None else choice(composition, "composition", COMPOSITIONS)
    land = Terrain.drawn(kind, own)
    x = _CORNER[0] + _STEP * np.arange(_CELLS)
    y = _CORNER[1] + _STEP * np.arange(_CELLS)
    hill = Surface.heightfield(land.height(x, y[:, None]), _STEP, (*_CORNER, 0.0))
    # What lies before the painter's feet is scattered more densely, in smaller strokes.
    near = (np.linspace(-40, 40, 41), np.linspace(-14, 36, 26))
    lawn = Surface.heightfield(land.height(near[0], near[1][:, None]), 2.0, (near[0][0], near[1][0], 0.0))
    meadow = ("grass", "straw")

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
    ]
    water, lane = land.water(), land.lane()
    if water is not None:
        # A river is close: many strokes, and an undercoat that hides its bed.
        fine = (26, 26) if kind == "pond" else (14, 190)
        layers = [(fine, (3.4, 0.5), 4)] if kind == "pond" else [((8, 110), (7.0, 1.6), 3), (fine, (3.4, 0.5), 4)]
        for spans, size_of, strokes in layers:
            objects.append(
                scattered(water, "water", seeds[4], spans, size_of, count=strokes, displacement=0.0, fade_from=1.0)
            )
    if lane is not None:
        objects.append(
            scattered(lane, "rock", seeds[4], (7, 200), (1.1, 0.5), count=4, displacement=0.02, fade_from=1.0)
        )
    if own.uniform() < 0.6 and kind != "pond":
        objects += _village(land, own, seeds[4])
    for k in range(9):
        at = (float(stream.uniform(-9, 12)), float(stream.uniform(6, 22))) if k < 4 else _shore(stream, land)
        size = stream.uniform(0.7, 2.0) * np.array([1.3, 1.1, 0.8])
        stone = rock(size, (*at, float(land.height(*at)) - 0.1), rng=seeds[5] + k)
        strata = Strata(
            (12, 12), 3, displacement=0.04, size=(0.36 * size[0], 0.36 * size[1]), variance=0.25, fade_from=1.0
        )
        objects.append(Ground(stone, "rock", strata, seeds[5] + k, casts=True))
    for k in range(count):
        at = _place(stream, k, land)
        species = _KINDS[k % len(_KINDS)]
        where = (*at, float(land.height(*at)) - 0.2)
        turn, scale = float(stream.uniform(0, 360)), float(stream.uniform(0.8, 1.25))
        scale *= 1.35 if k == 0 and kind != "pond" else 1.0
        objects.append(Placed(_tree(species, seeds[6] % 1000 + k % 4), where, turn, scale, name=species))
    manner = named(style, grade=True) if isinstance(style, str) else style
    found = (
        style_sky(style if isinstance(style, str) else "corot") if behind is None else instance(behind, "behind", Sky)
    )
    volume = None
    if cloud:
        # Of the seeds near this one, the first whose cloud has a cumulus' outline from here.
        west = -2300 if kind == "pond" else float(own.uniform(-4200, 600))
        volume = procedural("cumulus", (40, 64, 96), voxel_size=40.0, origin=(west, 4700, 650), rng=seeds[7] + 5)
    if camera is None:
        camera = Camera(1280, 720, fov=44, elevation=2.5, position=(0, -12, float(land.height(0, -12)) + 5.0))
    else:
        camera = instance(camera, "camera", Camera)
    scene = Scene(found, objects, manner, volume, circles=(35.0, 420.0), grown=grown, sky_strokes=60_000)
    white = dict(manner.materials).get("birch")
    if white is not None and "birch" in {tree.name for tree in objects if isinstance(tree, Placed)}:
        scene = scene.repainted(white, "birch*", "trunk")
    return scene, camera


def style_sky(name: str) -> Natural:
    """Return the hour and the sky of a style: an afternoon where it has none of its own.

    Parameters
    ----------
    name : str
        One of `pleinair.paint.styles()`.

    Returns
    -------
    Natural
        With the Sun, the Moon and the turbidity of the style.

    Raises
    ------
    ValueError
        There is no such style.

    Examples
    --------
    >>> style_sky("dusk").sun.elevation
    -2.5
    """
    hour = dict(style_hour(name))
    moon = hour.pop("moon", None)
    return Natural(sun=Sun(*hour.pop("sun")), moon=None if moon is None else Moon(*moon), **hour)


def _village(land: Terrain, rng: np.random.Generator, seed: int) -> list[Ground]:
    """Return a tower and some houses on a slope far away, in strokes of straw and bark."""
    x, y = float(rng.uniform(-55, 55)), float(rng.uniform(170, 215))
    parts: list[tuple[tuple[float, float], tuple[float, float, float], float]] = [((x, y), (5.5, 5.5, 15.0), 5.0)]
    for _ in range(int(rng.integers(3, 7))):
        at = (x + float(rng.uniform(-26, 26)), y + float(rng.uniform(-14, 10)))
        parts.append((at, (float(rng.uniform(6, 11)), 6.0, float(rng.uniform(3.5, 6))), 3.0))
    found = []
    for k, (at, size, top) in enumerate(parts):
        surfaces = building((*at, float(land.height(*at))), size, top, float(rng.uniform(-30, 30)))
        for surface, material in zip(surfaces, ("straw", "bark"), strict=True):
            strata = Strata((16, 6), 3, displacement=0.02, size=(0.9, 0.7), variance=0.2, fade_from=1.0)
            found.append(Ground(surface, material, strata, seed + k, casts=True))
    return found


def _shore(stream: np.random.Generator, land: Terrain) -> tuple[float, float]:
    """Return a place at the edge of the water or of the lane."""
    turn = stream.uniform(0, 2 * np.pi)
    if land.kind == "pond":
        return land.pond[0] + 17 * float(np.cos(turn)), land.pond[1] + 15 * float(np.sin(turn))
    y = 12 + 70 * float(turn) / (2 * np.pi)
    side = 1.0 if np.sin(7 * turn) > 0 else -1.0
    return float(land.middle(y)) + side * (float(land.half_width(y)) + 2.0), y


# Where the trees stand [m]: the first frames the view; groups to both sides leave the middle open; the rest far away.
_PLACES = {
    "pond": ((-21, 36), (22, 44), (-28, 30), (30, 54), (-16, 60), (-33, 48), (21, 70)),
    "river": ((-15, 20), (19, 46), (-24, 38), (27, 58), (-30, 70), (24, 88), (-20, 96)),
    "lane": ((15, 21), (-17, 40), (21, 48), (-24, 58), (14, 72), (-13, 84), (25, 92)),
    "clearing": ((-17, 24), (24, 36), (-27, 46), (-18, 68), (4, 78), (22, 66), (33, 48)),
    "hills": ((-16, 24), (30, 60), (-40, 90), (46, 110), (-20, 120), (12, 105), (60, 130)),
}


def _place(stream: np.random.Generator, k: int, land: Terrain) -> tuple[float, float]:
    """Return where a tree stands."""
    places = _PLACES[land.kind]
    x: float
    y: float
    if k < len(places):
        x, y = places[k]
        x, y = x + float(stream.uniform(-2, 2)), y + float(stream.uniform(-2, 2))
    else:
        x, y = float(stream.uniform(-75, 75)), float(stream.uniform(110, 200))
    while not land.free(x, y):
        # Aside, away from the middle of the water or the lane.
        x += 2.0 if x >= float(land.middle(y)) else -2.0
    return x, y

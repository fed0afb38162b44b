"""Shadows that the strokes of a scene leave each other, at levels of detail, made once for a still Sun.

Which strokes cast depends on how far away their object is (level of detail): so the light that reaches each stroke is found at
a few levels, with every object at that level, and between two of them it is a mix. A camera that moves costs nothing, and nothing
jumps. The silhouette that casts is nearly the same at every level (`paint.growth`), so it does little that a neighbour may be
at another one. Error: `test_shadows_between_levels`. Cost: a map for each level that an object that casts is at.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..paint import Strokes, Style, shadows
from .report import tell
from .sun_grid import suns_about

# Steps of the distance d from 0 to 1 [1]; with four the error is the same in two digits.
_LEVELS = 2
# Maps that are kept.
_KEPT = 36

_cache: OrderedDict[Any, tuple[list[Strokes], list[NDArray[np.float32]]]] = OrderedDict()


def _at_level(strokes: Strokes, level: int) -> Strokes:
    """Return strokes whose objects are at a level for an eye at the origin that looks north, with circles at 0 and 1 m."""
    centers = np.tile([0.0, level / _LEVELS, 0.0], (max(len(strokes.centers), 1), 1))
    index = np.zeros(len(strokes), np.uint32) if strokes.object is None else strokes.object
    return strokes._with(object=index, centers=centers, tint=np.full(len(centers), 0.5))


def _maps(
    lists: Sequence[Strokes], casts: Sequence[bool], to: Any, style: Style, levels: Sequence[int]
) -> list[list[NDArray[np.float32]]]:
    """Return which share of a light reaches each stroke, with all objects at each level."""
    # One number for the style, which has hundreds: it is looked up as often as there are levels.
    key = (tuple(map(id, lists)), tuple(casts), to, hash(style))
    out = []
    for level in levels:
        found = _cache.pop((key, level), None)
        tell("shadows of strokes", found is None)
        if found is None:
            there = [_at_level(one, level) for one in lists]
            # The lists are kept with it, so that no other ones get their ids.
            found = list(lists), shadows(there, to, style, casts=casts, camera=Camera(1, 1), circles=(0.0, 1.0))
        _cache[key, level] = found
        out.append(found[1])
    while len(_cache) > _KEPT:
        _cache.popitem(last=False)
    return out


def distance_of(strokes: Strokes, camera: Camera, circles: Any) -> NDArray[np.float64]:
    """Return `d` (D1) of each stroke, or of each object if the strokes are those of objects (D4)."""
    places = strokes.position if strokes.object is None else strokes.centers
    along = np.einsum("nk,k", places - np.array(camera.position), camera._axes()[2])
    near, far = circles
    found: NDArray[np.float64] = (
        np.clip((along - near) / (far - near), 0, 1) if far > near else (along >= far).astype(np.float64)
    )
    return found


def _shadows_of_one(
    lists: Sequence[Strokes],
    casts: Sequence[bool],
    to: Any,
    style: Style,
    camera: Camera | None,
    circles: Any,
    chosen: Sequence[NDArray[np.int64] | None],
) -> list[NDArray[np.float32]]:
    """Return which share of a light reaches the chosen ones of each list (None for all), as a camera has their detail."""

    def part(values: NDArray[Any], which: NDArray[np.int64] | None) -> NDArray[Any]:
        return values if which is None else values[which]

    if camera is None:
        (first,) = _maps(lists, casts, to, style, [0])
        return [part(one, which) for one, which in zip(first, chosen, strict=True)]
    far = [distance_of(one, camera, circles) for one in lists]
    ends = [(d.min(), d.max()) for d, cast in zip(far, casts, strict=True) if cast]
    if not ends:
        return [np.ones(len(part(one.label, which)), np.float32) for one, which in zip(lists, chosen, strict=True)]
    # Where nothing casts, no other level is looked at.
    low, high = _LEVELS * min(a for a, _ in ends), _LEVELS * max(b for _, b in ends)
    least = math.floor(low)
    maps = _maps(lists, casts, to, style, range(least, math.ceil(high) + 1))
    out = []
    for k, (one, which) in enumerate(zip(lists, chosen, strict=True)):
        d = np.clip(_LEVELS * far[k], low, high)
        if d.size == 1:
            below = math.floor(d[0])
            share = np.float32(d[0] - below)
            mixed = part(maps[below - least][k], which)
            if share > 0:
                mixed = (1 - share) * mixed + share * part(maps[below - least + 1][k], which)
        else:
            d = part(d if one.object is None else d[one.object], which)
            start = np.floor(d)
            shares = (d - start).astype(np.float32)
            mixed = np.zeros(len(d), np.float32)
            for level, own in enumerate(maps, least):
                weight = np.where(start == level, 1 - shares, np.where(start == level - 1, shares, np.float32(0)))
                mixed += weight * part(own[k], which)
        out.append(mixed)
    return out


def stroke_shadows(
    lists: Sequence[Strokes],
    casts: Sequence[bool],
    to: Any,
    style: Style,
    camera: Camera | None,
    circles: Any,
    chosen: Sequence[NDArray[np.int64] | None],
    moving_sun: bool,
) -> list[NDArray[np.float32]]:
    """Return which share of a light reaches the chosen ones of each list; that of a Sun that moves as a mix of some of a grid."""
    suns = suns_about(to) if moving_sun else [(1.0, to)]
    (share, first), *others = suns
    out = _shadows_of_one(lists, casts, first, style, camera, circles, chosen)
    if others:
        out = [np.float32(share) * one for one in out]
        for part, sun in others:
            for total, one in zip(out, _shadows_of_one(lists, casts, sun, style, camera, circles, chosen), strict=True):
                total += np.float32(part) * one
    return out

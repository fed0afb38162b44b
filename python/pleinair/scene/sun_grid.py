"""Suns on a grid a degree apart, and how much each counts for one between them (barycentric interpolation).

What light does to a cloud or to strokes changes slowly with the Sun: in a film it is computed for the Suns of a grid and mixed, so
that most frames compute none. The mix is continuous: a Sun on an edge is between two of the grid, whichever triangle it is
taken to be in.
"""

from __future__ import annotations

import math
from typing import Any

from ..astro import Sun

# Of the grid in elevation and azimuth [°].
_STEP = 1.0


def sun_at(direction: Any) -> Sun:
    """Return a lamp in a direction as the Sun of `pleinair.clouds`."""
    x, y, z = direction
    return Sun(math.degrees(math.asin(min(max(z, -1.0), 1.0))), math.degrees(math.atan2(x, y)) % 360)


def suns_about(direction: Any) -> list[tuple[float, tuple[float, float, float]]]:
    """Return the corners of the triangle of the grid that a direction is in, with their shares [1]."""
    at = sun_at(direction)
    e, a = at.elevation / _STEP, at.azimuth / _STEP
    low, left = math.floor(e), math.floor(a)
    up, along = e - low, a - left
    middle = (1, 0) if up >= along else (0, 1)
    found = ((1 - max(up, along), (0, 0)), (abs(up - along), middle), (min(up, along), (1, 1)))
    out = []
    for share, (i, j) in found:
        if share > 1e-9:
            x, y, z = Sun(min((low + i) * _STEP, 90.0), (left + j) * _STEP % 360).direction
            out.append((share, (x, y, z)))
    return out

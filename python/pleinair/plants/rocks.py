"""Rocks: balls cut by planes with rounded edges. Public as `pleinair.plants.rock`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._support.docs import documented
from .._support.inputs import generator, integer, real, vector
from .surface import Surface


@documented
def rock(
    size: ArrayLike = (2.0, 1.5, 1.2),
    position: ArrayLike = (0.0, 0.0, 0.0),
    *,
    facets: int = 14,
    sharpness: float = 12.0,
    rng: Any = None,
) -> Surface:
    """Return the surface of a rock: a ball cut by planes whose edges the weather has rounded.

    Parameters
    ----------
    size : array_like (3,)
        Width, depth and height above the ground, in [1e-6, 1e6] [m].
    position : array_like (3,)
        Of the middle of its foot; a third of the rock is below [m].
    facets : int
        Planes, in [4, 1000] [1].
    sharpness : float
        Of the edges, in [2, 200] [1]: 2 is nearly a ball.
    {rng}

    Returns
    -------
    Surface
        A closed mesh of 24 × 48 patches.

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Notes
    -----
    The corot paper has rocks of NURBS with strokes of a material of their own (its IV.7); the form is ours.

    Examples
    --------
    >>> rock((2, 2, 1), rng=1)
    Surface.mesh(1106 vertices, 2208 faces)
    """
    extent = np.array(vector(size, "size", 1e-6, 1e6)) * [0.5, 0.5, 0.75]
    foot = np.array(vector(position, "position"))
    count, power = integer(facets, "facets", 4, 1000), real(sharpness, "sharpness", 2, 200)
    stream = generator(rng)
    planes = stream.normal(size=(count, 3))
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    away = stream.uniform(0.75, 1.0, count)
    rows, columns = 24, 48
    polar = np.linspace(0, np.pi, rows + 1)[1:-1, None]
    turn = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    ring = np.stack(np.broadcast_arrays(np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)), -1)
    to = np.concatenate([[[0, 0, 1]], ring.reshape(-1, 3), [[0, 0, -1]]])
    # The nearest plane decides; a mean of high power rounds the edges, and the ball of radius 1 is one more plane.
    reach = (1 + (np.maximum(to @ planes.T, 0) / away) ** power @ np.ones(count)) ** (-1 / power)
    vertices = to * reach[:, None] * extent + foot + [0, 0, extent[2] / 3]
    first = 1 + np.arange(rows - 2)[:, None] * columns
    here, east = first + np.arange(columns), first + (np.arange(columns) + 1) % columns
    sides = np.stack([here, here + columns, east + columns, east], -1).reshape(-1, 4)
    last = 1 + (rows - 2) * columns
    one = np.arange(columns)
    two = (one + 1) % columns
    top = np.stack([np.zeros_like(one), 1 + one, 1 + two], -1)
    bottom = np.stack([np.full_like(one, last + columns), last + two, last + one], -1)
    faces = np.concatenate([top, sides[:, [0, 1, 2]], sides[:, [0, 2, 3]], bottom])
    return Surface.mesh(vertices, faces)

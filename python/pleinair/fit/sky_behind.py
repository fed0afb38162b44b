"""The sky behind the clouds of a photograph: wisps that the mask leaves are found, the fill follows the sky's own gradient."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..image import Segmentation, dilate, fill
from .blur import blurred

# Wisps differ from the smooth sky by more than this many deviations of its noise, and by at least so much [1].
_DEVIATIONS, _LEAST = 3.0, 0.01
_ROUNDS = 4
# Pixels of a side on which the smooth sky is fitted.
_GRID = 96


def _ends(n: int, at: NDArray[Any]) -> NDArray[np.float64]:
    """Return places of pixels between -1 and 1."""
    return np.asarray(2 * (at + 0.5) / n - 1, np.float64)


def _samples(sky: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return rows and columns of some pixels of the sky, and what a clear sky is made of there.

    A cubic from bottom to top, which tilts and bends from side to side.
    """
    step = max(1, max(sky.shape) // _GRID)
    rows, columns = (step * at for at in np.nonzero(sky[::step, ::step]))
    y, x = _ends(sky.shape[0], rows), _ends(sky.shape[1], columns)
    return rows, columns, np.stack([np.ones_like(y), y, y * y, y**3, x, x * y, x * x], -1)


def _surface(c: NDArray[np.float64], rows: NDArray[Any], width: int) -> NDArray[np.float64]:
    """Return what the coefficients (7, channels) of such a sky make of whole rows (rows, width, channels)."""
    height = len(rows)
    y, x = _ends(height, rows)[:, None, None], _ends(width, np.arange(width))[None, :, None]
    return np.asarray(c[0] + y * (c[1] + y * (c[2] + y * c[3])) + x * (c[4] + y * c[5] + x * c[6]))


def smooth_sky(rgb: NDArray[np.float32], sky: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return a smooth surface through the light of those pixels that are sky (height, width, 3), in its logarithm."""
    height, width = sky.shape
    rows, columns, terms = _samples(sky)
    # Few pixels say nothing of far corners: the surface is level there.
    ridge = 1e-3 * len(rows) * np.diag([0.0, 1, 1, 1, 1, 1, 1])
    light = np.log(np.maximum(rgb[rows, columns].astype(np.float64), 1e-5))
    weight = np.ones(len(rows))
    for _ in range(_ROUNDS):
        scaled = terms * weight[:, None]
        surface = np.linalg.solve(scaled.T @ terms + ridge, scaled.T @ light)
        off = np.abs(light - terms @ surface).max(axis=1)
        weight = 1 / np.maximum(1, off / (1.5 * np.median(off) + 1e-9)) ** 2
    # Where no sky is seen the surface is that of the nearest row of it: a cubic would run away.
    seen = np.clip(np.arange(height), *np.quantile(rows, (0.01, 0.99)))
    return np.asarray(np.exp(_surface(np.asarray(surface, np.float64), seen, width)))


def wisps(found: Segmentation, hidden: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return pixels of the sky that are paler than its smooth surface by more than its noise: thin cloud beside the mask."""
    sky = ~hidden
    if sky.sum() < 256:
        return np.zeros_like(sky)
    height, width = sky.shape
    rows, columns, terms = _samples(sky)
    # Wisps are wider than the grain.
    soft = blurred(blurred(found.feature.astype(np.float64)))
    feature = soft[rows, columns]
    keep = np.ones(len(rows), bool)
    for _ in range(_ROUNDS):
        surface = np.linalg.lstsq(terms[keep], feature[keep], rcond=None)[0]
        off = feature - terms @ surface
        noise = 1.4826 * np.median(np.abs(off[keep] - np.median(off[keep])))
        limit = max(_DEVIATIONS * noise, _LEAST)
        keep = off > -limit
        if keep.sum() < 64:
            return np.zeros_like(sky)
    out: NDArray[np.bool_] = sky & (soft - _surface(surface[:, None], np.arange(height), width)[..., 0] < -limit)
    return out


def sky_behind(rgb: NDArray[np.float32], found: Segmentation, margin: int) -> NDArray[np.float32] | None:
    """Return the sky without clouds and ground; None where there is none.

    What the light differs from the smooth surface by is the solution of Laplace's equation over what is hidden: the fill
    meets the sky around it, and goes from bottom to top as the sky does.
    """
    covered = found.cloud | found.ground
    hidden = dilate(covered, margin)
    if hidden.all():
        hidden = covered
    if hidden.all():
        return None
    thin = dilate(wisps(found, hidden), max(2, margin))
    if (~(hidden | thin)).mean() > 0.02:
        hidden = hidden | thin
    smooth = smooth_sky(rgb, ~hidden)
    ratio = np.clip(rgb / smooth, 0.05, 20).astype(np.float32)
    filled = fill(ratio, hidden).astype(np.float64) * smooth
    return np.where(hidden[..., None], filled, rgb).astype(np.float32)

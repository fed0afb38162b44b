"""The sky behind the clouds of a photograph: wisps that the mask leaves are found, the fill follows the sky's own gradient."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..image import Segmentation, dilate, fill
from .blur import blurred

# Wisps differ from the smooth sky by more than this many deviations of its noise, and by at least so much [1].
_DEVIATIONS, _LEAST = 3.0, 0.01
_ROUNDS = 4
# Pixels of a side on which the smooth sky is fitted.
_GRID = 96


def _terms(height: int, width: int, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return what a clear sky is made of near a place: a cubic from bottom to top, which tilts and bends from side to side."""
    y, x = 2 * (rows + 0.5) / height - 1, 2 * (columns + 0.5) / width - 1
    return np.stack([np.ones_like(y), y, y * y, y**3, x, x * y, x * x], -1)


class SmoothSky:
    """A smooth surface through the logarithm of the light of those pixels that are sky."""

    def __init__(self, rgb: NDArray[np.float32], sky: NDArray[np.bool_]) -> None:
        self.shape = height, width = sky.shape
        step = max(1, max(sky.shape) // _GRID)
        rows, columns = np.nonzero(sky[::step, ::step])
        rows, columns = rows * step, columns * step
        # Where no sky is seen the surface is that of the nearest row of it: a cubic would run away.
        self.rows = np.quantile(rows, (0.01, 0.99))
        terms = _terms(height, width, rows, columns)
        # Few pixels say nothing of far corners: the surface is level there.
        ridge = 1e-3 * len(rows) * np.diag([0.0, 1, 1, 1, 1, 1, 1])
        light = np.log(np.maximum(rgb[rows, columns].astype(np.float64), 1e-5))
        weight = np.ones(len(rows))
        for _ in range(_ROUNDS):
            scaled = terms * weight[:, None]
            self.surface = np.linalg.solve(scaled.T @ terms + ridge, scaled.T @ light)
            off = np.abs(light - terms @ self.surface).max(axis=1)
            weight = 1 / np.maximum(1, off / (1.5 * np.median(off) + 1e-9)) ** 2

    def light(self) -> NDArray[np.float64]:
        """Return the surface (height, width, 3), linear light."""
        height, width = self.shape
        rows, columns = np.mgrid[0:height, 0:width]
        return np.asarray(np.exp(_terms(height, width, np.clip(rows, *self.rows), columns) @ self.surface))


def wisps(found: Segmentation, hidden: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return pixels of the sky that are paler than its smooth surface by more than its noise: thin cloud beside the mask."""
    sky = ~hidden
    if sky.sum() < 256:
        return np.zeros_like(sky)
    height, width = sky.shape
    step = max(1, max(sky.shape) // _GRID)
    rows, columns = np.nonzero(sky[::step, ::step])
    terms = _terms(height, width, rows * step, columns * step)
    # Wisps are wider than the grain.
    soft = blurred(blurred(found.feature.astype(np.float64)))
    feature = soft[rows * step, columns * step]
    keep = np.ones(len(rows), bool)
    for _ in range(_ROUNDS):
        surface = np.linalg.lstsq(terms[keep], feature[keep], rcond=None)[0]
        off = feature - terms @ surface
        noise = 1.4826 * np.median(np.abs(off[keep] - np.median(off[keep])))
        limit = max(_DEVIATIONS * noise, _LEAST)
        keep = off > -limit
        if keep.sum() < 64:
            return np.zeros_like(sky)
    all_rows, all_columns = np.mgrid[0:height, 0:width]
    off = soft - _terms(height, width, all_rows, all_columns) @ surface
    out: NDArray[np.bool_] = sky & (off < -limit)
    return out


def sky_behind(
    rgb: NDArray[np.float32], found: Segmentation, margin: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]] | None:
    """Return the sky without clouds and ground, and what of it was filled in; None where there is none.

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
    smooth = SmoothSky(rgb, ~hidden).light()
    ratio = np.clip(rgb / smooth, 0.05, 20).astype(np.float32)
    filled = fill(ratio, hidden).astype(np.float64) * smooth
    out = np.where(hidden[..., None], filled, rgb).astype(np.float32)
    return out, hidden

"""A whole basis of all orders at 320x240; the error is the noise of its nodes, from two seeds, relative L2."""

from __future__ import annotations

import time
from collections.abc import Iterable

import numpy as np
import pleinair as pa
from pleinair.clouds import Basis
from pleinair.report import Row

ROOM = "inverse_clouds"
SLOW = True
WHERE = "320×240, cumulus 150×150×256, 12 g × 12 σ_t, 128 paths"


def errors(a: Basis, b: Basis) -> np.ndarray:
    """Noise of each (g, σ_t), relative to all its light."""
    cosine = a.cosine.reshape(-1)[a.pixels].astype(float)
    single = a.scattered.reshape(a.sigma_t.size, -1)[:, a.pixels]
    out = np.empty((a.g.size, a.extinctions.size))
    for j, g in enumerate(a.g):
        phase = (1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5
        for m, sigma in enumerate(a.extinctions):
            once = single[int(np.argmin(np.abs(a.sigma_t - sigma)))] * phase
            x, y = a.multiple[:, j, m].sum(0), b.multiple[:, j, m].sum(0)
            out[j, m] = np.sqrt(np.square(x - y).mean() / 2 / np.square(once + (x + y) / 2).mean())
    return out


def rows() -> Iterable[Row]:
    cloud = pa.clouds.procedural("cumulus", (150, 256, 150), rng=3)
    low, high = cloud.bounds
    middle = (low + high) / 2
    camera = pa.Camera.look_at(tuple(middle - (12000, 0, 800)), tuple(middle), 320, 240, fov=17)
    bases, seconds = [], []
    for seed in (1, 2):
        cpu = time.process_time()
        raw = Basis.precompute(cloud, camera, pa.Sun(40, 220), orders=None, denoise=False, rng=seed)
        middle_cpu = time.process_time()
        unsmoothed = raw.multiple.copy()
        resumed = time.process_time()
        smooth = raw._smoothed(None)
        seconds.append(middle_cpu - cpu + time.process_time() - resumed)
        bases.append((unsmoothed, smooth))
    after = errors(bases[0][1], bases[1][1])
    for unsmoothed, smooth in bases:
        np.copyto(smooth.multiple, unsmoothed)
    before = errors(bases[0][1], bases[1][1])
    cost = float(np.mean(seconds))
    for task, wrong in (
        ("basis, all orders, worst node", after.max()),
        ("basis, all orders, median node", np.median(after)),
        ("basis, all orders, median node, not smoothed", np.median(before)),
        ("basis, all orders, worst node, not smoothed", before.max()),
    ):
        yield Row(ROOM, task, WHERE, "pleinair", cost, float(wrong), "rel-L2", 1.0)

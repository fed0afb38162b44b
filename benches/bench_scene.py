"""A landscape from sky to strokes: hills of grass, rocks, a pond and twelve trees, with shadows and reflections.

Wall time on all threads, as the goal has it. The error is the largest difference from the reference compositor, on a small picture
of the same scene. Nobody else is there to race: llvmpipe and Skia are raced stroke by stroke in bench_paint.py.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pleinair as pa
from pleinair.report import Row, race

ROOM = "corot"


def rows() -> Iterator[Row]:
    """Measure."""
    scene, camera = pa.demo.landscape(cloud=False)
    small = camera.resized(96, 54)
    wrong = {
        order: float(
            np.abs(np.subtract(*(scene.paint(small, order=order, method=m) for m in ("fast", "reference")))).max()
        )
        for order in ("hard", "slab")
    }
    strokes = sum(map(len, scene.strokes().values()))
    moved = pa.Timeline({0: camera, 1: replace(camera, azimuth=10.0)})
    contenders = {
        "pleinair, one picture": lambda: scene.paint(camera),
        "pleinair, a frame in slabs": lambda: scene.frame(moved, 0.5),
    }
    errors = dict(zip(contenders, wrong.values(), strict=True))
    task, what = "landscape of 12 trees, wall", f"{strokes} strokes, 1280×720"
    yield from race(ROOM, task, what, contenders, errors, "1", rounds=5, budget=60, clock=time.perf_counter)
    begin = time.perf_counter()
    cloudy, _ = pa.demo.landscape()
    cloudy.paint(camera)
    yield Row(
        ROOM,
        task,
        "the same with a cumulus, from nothing",
        "pleinair",
        time.perf_counter() - begin,
        wrong["hard"],
        "1",
        1.0,
    )
    # What is kept between frames: by a camera that moves on, and by a Sun that moves within a degree.
    sun = pa.Timeline(camera, sky=lambda t: replace(cloudy.sky, sun=pa.Sun(24.1 + 0.6 * t, 245.1 + 0.6 * t)))
    cloudy.frame(sun, 0.0)
    for what, paint, error in (
        ("the same, a step further", lambda k: cloudy.paint(replace(camera, azimuth=0.5 * k)), wrong["hard"]),
        ("a frame of a film whose Sun moves", lambda k: cloudy.frame(sun, 0.2 * k), 0.01),
    ):
        paint(1)
        spent = []
        for k in (2, 3, 4):
            begin = time.perf_counter()
            paint(k)
            spent.append(time.perf_counter() - begin)
        yield Row(ROOM, task, what, "pleinair", min(spent), error, "1", 1.0)

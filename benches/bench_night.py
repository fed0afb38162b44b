"""Day and night by `Natural` and by formula beside a copy of the frame and numpy.

The paper realistic_sky draws 1280 × 1024 on a GeForce GTX 260+: 210 frames a second by day, 320 by night. Wall time with two
threads, in the same rounds as `frame.copy()`; formulas beside numpy in CPU time of one thread. Errors: of a frame, against the
reference method at a few of its pixels; of tone reproduction, against its own formula in float64.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from datetime import UTC, datetime

import numpy as np
import pleinair as pa
from pleinair.report import Row, race

ROOM = "realistic_sky"
PARIS = pa.Place(48.8, 2.3)
FRAME = pa.Camera(1280, 1024, fov=60, azimuth=190, elevation=28)
DAY = pa.sky.Natural(datetime(2024, 6, 20, 12, tzinfo=UTC), PARIS)
DARK = pa.sky.Natural(datetime(2024, 8, 5, 23, tzinfo=UTC), PARIS)
MOONLIT = pa.sky.Natural(datetime(2024, 1, 25, 22, tzinfo=UTC), PARIS)


def wrong(sky: pa.sky.Natural) -> float:
    """Largest error of a frame at pixels without a star, relative to the value plus a thousandth of the largest."""
    bare = dataclasses.replace(sky, stars=None, discs=False)
    rows, columns = slice(5, None, 170), slice(7, None, 211)
    exact = bare.radiance(FRAME.directions()[rows, columns], method="reference")
    frame = bare.render(FRAME)[rows, columns]
    return float((np.abs(frame - exact) / (np.abs(exact) + 1e-3 * exact.max())).max())


def frames() -> Iterator[Row]:
    """Frames against copying one."""
    pa.set_num_threads(2)
    wall = {"rounds": 30, "clock": time.perf_counter}
    for name, sky in (("day", DAY), ("dark sky, 8 874 stars", DARK), ("full moon", MOONLIT)):
        frame = sky.render(FRAME)
        contenders = {"pleinair": lambda sky=sky: sky.render(FRAME), "frame.copy()": frame.copy}
        task = f"frame of Natural, {name}; 2 threads, wall"
        errors = {"pleinair": wrong(sky), "frame.copy()": 0.0}
        yield from race(ROOM, task, "1280×1024", contenders, errors, "1", **wall)
    frame = DAY.render(FRAME)
    seen = pa.tone.tumblin_rushmeier(frame)
    shown = pa.color.luminance(seen).astype(float)
    share = pa.tone.display_level(pa.color.luminance(frame), pa.tone.log_average(frame)) ** 2.2
    day, dark = pa.tone.log_average(frame), pa.tone.log_average(DARK.render(FRAME))
    error = {"pleinair": float(np.abs(shown - share).max()), "frame.copy()": 0.0}
    contenders = {"pleinair": lambda: DAY.show(FRAME, day), "frame.copy()": frame.copy}
    task = "day frame with tone reproduction to uint8; 2 threads, wall"
    yield from race(ROOM, task, "1280×1024", contenders, error, "1", **wall)
    night = {"pleinair": lambda: DARK.show(FRAME, dark, night=True), "frame.copy()": frame.copy}
    task = "night frame with night vision and tone reproduction to uint8; 2 threads, wall"
    yield from race(ROOM, task, "1280×1024", night, error, "1", **wall)


def in_numpy(sky: pa.sky.CieGeneral, to: np.ndarray) -> np.ndarray:
    """CIE type 12 as one would write it in numpy: luminance."""
    a, b, c, d, e = -1, -0.32, 10, -3, 0.45
    sun = np.array(sky.sun.direction, np.float32)
    zenith = np.clip(to[..., 2], 1e-6, None)
    g = np.arccos(np.clip(to @ sun, -1, 1))
    f = lambda g: 1 + c * (np.exp(d * g) - np.exp(d * np.pi / 2)) + e * np.cos(g) ** 2
    s = np.arccos(sun[2])
    return sky.zenith_luminance * (1 + a * np.exp(b / zenith)) * f(g) / ((1 + a * np.exp(b)) * f(s))


def formulas() -> Iterator[Row]:
    """A standard sky beside numpy."""
    pa.set_num_threads(1)
    sky = pa.sky.CieGeneral(12, pa.Sun(40, 190))
    to = FRAME.directions().astype(np.float32)
    exact = pa.color.luminance(sky.radiance(FRAME.directions()[::64, ::64], method="reference"))
    above = FRAME.directions()[::64, ::64, 2] > 0

    def off(picture: np.ndarray) -> float:
        return float((np.abs(picture[::64, ::64] / exact - 1))[above].max())

    contenders = {"pleinair": lambda: sky.render(FRAME), "numpy, directions given": lambda: in_numpy(sky, to)}
    found = pa.color.luminance(sky.render(FRAME))
    errors = {"pleinair": off(found), "numpy, directions given": off(in_numpy(sky, to))}
    yield from race(
        ROOM, "CIE type 12; pleinair in colour, numpy luminance alone", "1280×1024", contenders, errors, "1"
    )


def rows() -> Iterator[Row]:
    """Measure."""
    try:
        yield from frames()
        yield from formulas()
    finally:
        pa.set_num_threads(None)

"""What a knob buys, and how cost grows: bins of Otsu's threshold, pixels, voxels, strokes.

CPU time of one thread. Otsu's error is what is lost of the between-class variance of the best cut.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pleinair as pa
from pleinair import paint
from pleinair.report import Row, race
from skimage.filters import threshold_otsu

NOTHING = float("nan")


def bins() -> Iterator[Row]:
    """Otsu on a grey picture: ours exact and binned beside scikit-image's bins."""
    rng = np.random.default_rng(1)
    grey = np.where(rng.random((480, 640)) < 0.4, rng.gamma(2.0, 0.05, (480, 640)), rng.normal(0.7, 0.15, (480, 640)))
    grey = grey.astype(np.float32)

    def between(t: float) -> float:
        low, high = grey[grey <= t].astype(float), grey[grey > t].astype(float)
        return low.size * high.size * (low.mean() - high.mean()) ** 2

    best = between(float(pa.image.otsu(grey).value))
    calls, errors, knobs = {"pleinair, exact": lambda: pa.image.otsu(grey).value}, {"pleinair, exact": 0.0}, {}
    for n in (8, 16, 32, 64, 128, 256, 1024, 4096):
        for family, call in (
            ("pleinair, bins", lambda n=n: pa.image.otsu(grey, nbins=n).value),
            ("scikit-image", lambda n=n: threshold_otsu(grey, nbins=n)),
        ):
            name = f"{family}, {n} bins"
            calls[name], knobs[name] = call, (family, f"{n}")
            errors[name] = max(0.0, 1 - between(float(call())) / best)
    knobs["pleinair, exact"] = ("pleinair, exact", "exact")
    yield from race("image", "Otsu, by bins", "VGA, f32", calls, errors, "1", knobs=knobs, rounds=7, budget=15)


def pixels() -> Iterator[Row]:
    """Frames of skies, and histograms, of more and more pixels."""
    skies = {
        "aoas": pa.sky.Aoas(sun=pa.Sun(35, 200)),
        "realistic_sky": pa.sky.Natural(sun=pa.Sun(35, 200)),
    }
    for room, sky in skies.items():
        for width in (160, 320, 640, 1280, 2560):
            camera = pa.Camera(width, width * 9 // 16, fov=70, azimuth=180, elevation=25)
            calls = {"pleinair": lambda sky=sky, camera=camera: sky.render(camera)}
            yield from race(
                *(room, "frame, by pixels", f"{width}×{width * 9 // 16}", calls, {"pleinair": NOTHING}, "1"),
                rounds=7,
                size=width * (width * 9 // 16),
                size_unit="pixels",
            )
    rng = np.random.default_rng(0)
    for side in (64, 256, 1024, 4096):
        x = rng.integers(0, 256, (side, side, 3), dtype=np.uint8)
        calls = {
            "pleinair": lambda x=x: pa.image.histogram(x)[0],
            "numpy bincount, the channels as one": lambda x=x: np.bincount(x.reshape(-1), minlength=256),
        }
        yield from race(
            *("image", "histogram, by pixels", f"{side}×{side}", calls, dict.fromkeys(calls, NOTHING), "counts"),
            rounds=7,
            size=side * side,
            size_unit="pixels",
        )


def voxels() -> Iterator[Row]:
    """A cumulus of more and more voxels: made, and rendered with light scattered once."""
    for side in (24, 48, 96, 144):
        start = time.process_time()
        cloud = pa.clouds.procedural("cumulus", (side, side, side), rng=3)
        made = time.process_time() - start
        low, high = cloud.bounds
        at = (low + high) / 2
        far = 2.5 * float(np.max(high - low))
        camera = pa.Camera.look_at((at[0], at[1] - far, at[2]), tuple(at), 160, 120, fov=30)
        p = pa.clouds.Params(g=0.85, sigma_t=0.01, albedo=0.99, ambient=0.0)
        start = time.process_time()
        pa.clouds.render(cloud, p, camera, pa.Sun(40, 200), orders=1)
        seen = time.process_time() - start
        where, grows = f"{side}³", {"size": side**3, "size_unit": "voxels"}
        yield Row(
            "inverse_clouds", "procedural cumulus, by voxels", where, "pleinair", made, NOTHING, "1", 1.0, **grows
        )
        task = "single scattering 160×120, by voxels"
        yield Row("inverse_clouds", task, where, "pleinair", seen, NOTHING, "1", 1.0, **grows)


def strokes() -> Iterator[Row]:
    """A canvas of more and more strokes, of the same area in all."""
    rng = np.random.default_rng(0)
    for n in (2_000, 20_000, 200_000, 1_000_000):
        size = 24.0 * (20_000 / n) ** 0.5 * rng.uniform(0.7, 1.3, (n, 1)) * np.ones(2)
        sprites = paint.Sprites(rng.random((n, 2)) * [1280, 720], size, rng.uniform(1, 10, n), rng.random((n, 3)))
        calls = {"pleinair": lambda s=sprites: paint.composite(s, 1280, 720)}
        yield from race(
            *("corot", "canvas of 11.9 Mpx of strokes, by strokes", f"{n}", calls, {"pleinair": NOTHING}, "1"),
            rounds=3,
            size=n,
            size_unit="strokes",
        )


def rows() -> Iterator[Row]:
    """Measure."""
    pa.set_num_threads(1)
    try:
        yield from bins()
        yield from pixels()
        yield from voxels()
        yield from strokes()
    finally:
        pa.set_num_threads(None)

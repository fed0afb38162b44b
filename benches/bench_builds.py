"""This build beside an earlier one, turn by turn in two processes: what has become faster, and whether the answer is the same.

benches/baseline.sh builds the earlier one. CPU time of one thread each, timed in its own process; the error is the largest difference
of the two answers where both are arrays, in their own unit: a changed law shows here, and says nothing of which is right.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from pleinair.report import Baseline, Row, race

# Room, task, input, statements before, expression.
CASES = [
    (
        "image",
        "histogram 3×256, u8",
        "12 MP",
        "import numpy as np; x = np.random.default_rng(0).integers(0, 256, (3000, 4000, 3), dtype=np.uint8)",
        "pa.image.histogram(x)[0]",
    ),
    (
        "image",
        "histogram 3×256, f32",
        "12 MP",
        "import numpy as np; x = np.random.default_rng(0).random((3000, 4000, 3), dtype=np.float32)",
        "pa.image.histogram(x)[0]",
    ),
    (
        "image",
        "Otsu, f32, exact",
        "12 MP",
        (
            "import numpy as np; g = np.random.default_rng(1)\n"
            "x = np.where(g.random((3000, 4000)) < .4, g.normal(.3, .1, (3000, 4000)), g.normal(.7, .1, (3000, 4000)))\n"
            "x = x.astype(np.float32)"
        ),
        "np.array(pa.image.otsu(x).value)",
    ),
    *(
        (
            "corot",
            "strokes in hard order",
            f"{n}×{size} px",
            (
                "import numpy as np; from pleinair import paint; g = np.random.default_rng(0)\n"
                f"n = {n}; at = g.random((n, 2)) * [1280, 720]; size = {size} * g.uniform(.7, 1.3, (n, 1)) * np.ones(2)\n"
                "s = paint.Sprites(at, size, g.uniform(1, 10, n), g.random((n, 3)), rotation=0.0)"
            ),
            "paint.composite(s, 1280, 720).rgb",
        )
        for n, size in ((20_000, 24), (200_000, 12), (1_000_000, 8))
    ),
    *(
        (
            "corot",
            f"tree, {kind}",
            "trunk and leaves",
            f"how = pa.plants.preset({kind!r})",
            "(lambda t: (t.trunk, t.leaves.position)[1])(pa.plants.Tree.grow(how, rng=1))",
        )
        for kind in ("thesis", "oak", "pine")
    ),
    (
        "aoas",
        "frame, physical",
        "1280×720",
        "sky = pa.sky.Aoas(sun=pa.Sun(35, 200)); cam = pa.Camera(1280, 720, fov=70, azimuth=180, elevation=25)",
        "sky.render(cam)",
    ),
    (
        "aoas",
        "frame with tone and 8 bits",
        "640×360",
        "sky = pa.sky.Aoas(sun=pa.Sun(35, 200)); cam = pa.Camera(640, 360, fov=70, azimuth=180, elevation=25)",
        "pa.tone.to_uint8(pa.tone.oneil(sky.render(cam)))",
    ),
    *(
        (
            "realistic_sky",
            "another Sun",
            f"320×240, Sun at {elevation}°",
            (
                "import itertools; k = itertools.count(); cam = pa.Camera(320, 240, fov=60, azimuth=180, elevation=30)\n"
                "pa.sky.Physical(pa.Sun(33, 180)).render(cam)"
            ),
            f"pa.sky.Physical(pa.Sun({elevation} + 1e-3 * next(k), 180)).render(cam)",
        )
        for elevation in (40, 10, 0.5)
    ),
    *(
        (
            "realistic_sky",
            f"{name} with tone reproduction to 8 bits",
            "1280×1024",
            (
                "from datetime import UTC, datetime\n"
                f"sky = pa.sky.Natural(datetime({when}, tzinfo=UTC), pa.Place(48.8, 2.3))\n"
                "cam = pa.Camera(1280, 1024, fov=60, azimuth=190, elevation=28)\n"
                "eye = pa.tone.log_average(sky.render(cam))\n"
                "def shown():\n"
                f"    if hasattr(sky, 'show'):\n        return sky.show(cam, eye, night={night})\n"
                f"    return pa.tone.show(sky.render(cam), eye, night={night})"
            ),
            "shown()",
        )
        for name, when, night in (("a day frame", "2024, 6, 20, 12", False), ("a night frame", "2024, 8, 5, 23", True))
    ),
    (
        "inverse_clouds",
        "procedural cumulus",
        "150×150×256",
        "",
        "pa.clouds.procedural('cumulus', (150, 150, 256), rng=3).density",
    ),
    (
        "inverse_clouds",
        "simulated cumulus, 200 steps",
        "64×64×64",
        "",
        "pa.clouds.simulated((64, 64, 64), duration=1000.0, step=5.0, rng=1).density",
    ),
    (
        "inverse_clouds",
        "single scattering",
        "320×240, cumulus 96×160×160, τ 6.5",
        (
            "cloud = pa.clouds.procedural('cumulus', (96, 160, 160), rng=3)\n"
            "low, high = cloud.bounds; at = (low + high) / 2\n"
            "cam = pa.Camera.look_at(tuple(at - (0, 6000, 800)), tuple(at), 320, 240, fov=30)\n"
            "deep = float(pa.clouds.Basis.precompute(cloud, cam, pa.Sun(40, 200), sigma_t=[.01]).depth.max())\n"
            "p = pa.clouds.Params(g=.85, sigma_t=6.5 / deep * 1.0, albedo=.99, ambient=0.0)"
        ),
        "pa.clouds.render(cloud, p, cam, pa.Sun(40, 200), orders=1).single",
    ),
]


def _difference(a: object, b: object) -> float:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray) and a.shape == b.shape:
        return float(np.abs(a.astype(float) - b.astype(float)).max())
    return math.nan


def rows() -> Iterator[Row]:
    """Yield every case, where there is an earlier build."""
    for room, task, where, setup, expression in CASES:
        with Baseline(setup) as old:
            old.space["pa"].set_num_threads(1)
            both = old.both(expression)
            if len(both) < 2:
                print(f"bench_builds: left out, there is no {old.name}: benches/baseline.sh builds it")
                return
            answers = [call() for call in both.values()]
            errors = {old.name: _difference(*answers), "pleinair": 0.0}
            yield from race(room, f"{task}, both builds", where, both, errors, "apart", rounds=9, budget=20)
            old.space["pa"].set_num_threads(None)

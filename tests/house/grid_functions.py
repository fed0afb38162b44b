"""What workers call in the tests of grids: they import it by name."""

import hashlib
import os
import time
from pathlib import Path

import numpy as np
import pleinair as pa

CLOUD = pa.clouds.procedural("cumulus", (8, 12, 12), rng=3)
CAMERA = pa.Camera.look_at((0, -800, 900), (240, 240, 960), 24, 16, fov=50)


def noise(cell, volume, rng):
    """Numbers of the cell's own generator, and of the shared array."""
    return (rng.random(4) + float(volume[cell % len(volume)].sum())).tolist()


def slow_noise(cell, volume, rng):
    time.sleep(0.03)
    return noise(cell, volume, rng)


def picture(cell, volume, rng):
    sun = pa.Sun(10 + 3 * cell, 200)
    return pa.clouds.render(CLOUD, pa.clouds.Params(), CAMERA, sun, orders=2, samples=2, rng=rng).rgb


def who(cell, volume):
    time.sleep(0.05)
    return os.getpid()


def threads(cell):
    from threadpoolctl import threadpool_info

    return [pa.get_num_threads(), max([p["num_threads"] for p in threadpool_info()], default=1)]


def poison(cell, folder):
    """Cell 3 kills its worker, always."""
    if cell == 3:
        os._exit(9)
    time.sleep(0.02)
    return cell * cell


def dies_once(cell, folder):
    """The worker of cell 8 dies the first time."""
    marker = Path(folder) / "died"
    if cell == 8 and not marker.exists():
        marker.write_text(str(os.getpid()))
        os.kill(os.getpid(), 9)
    time.sleep(0.02)
    return [cell * cell, os.getpid()]


def fails(cell):
    if cell % 2:
        msg = f"cell {cell} is odd"
        raise ValueError(msg)
    return {"half": cell // 2}


def arrays(cell):
    return {"a": np.full(3, cell), "b": np.ones((2, 2), np.float32)} if cell else np.arange(4)


def digest(values):
    return hashlib.sha256(repr([np.asarray(v).tobytes() for v in values]).encode()).hexdigest()

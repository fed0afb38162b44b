"""Grids of cells: overhead of a cell, throughput of two workers, memory over a thousand photographs.

python benches/bench_batch.py [PHOTOGRAPHS]
"""

import os
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pleinair as pa
from pleinair.batch import map_grid, results

CLOUD = pa.clouds.procedural("cumulus", (24, 32, 32), rng=3)
CAMERA = pa.Camera.look_at((320, -1200, 500), (320, 320, 900), 80, 60, fov=40)


def nothing(cell):
    return cell


def work(cell, rng):
    """Half a second of paths."""
    image = pa.clouds.render(CLOUD, pa.clouds.Params(), CAMERA, pa.Sun(30 + cell, 200), orders=8, samples=40, rng=rng)
    return float(image.rgb.sum())


def pool(count):
    return lambda: ProcessPoolExecutor(count, mp_context=get_context("spawn"))


def seconds(call):
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def overhead():
    """Milliseconds a cell that does nothing costs, in this process and in a pool that is warm."""
    here = seconds(lambda: results(map_grid(nothing, range(2000)))) / 2000
    with pool(2)() as workers:
        results(map_grid(nothing, range(10), executor=workers))
        there = statistics.median(
            seconds(lambda: results(map_grid(nothing, range(500), executor=workers))) / 500 for _ in range(5)
        )
    return 1e3 * here, 1e3 * there


def throughput(cells=24):
    """How much faster two workers are than one process with one thread; both warm, alternating."""
    pa.set_num_threads(1)
    ratios = []
    with pool(2)() as workers:
        results(map_grid(work, range(4), rng=0, executor=workers))
        for _ in range(3):
            one, two = {}, {}
            a = seconds(lambda: one.update(v=results(map_grid(work, range(cells), rng=0))))  # noqa: B023
            b = seconds(lambda: two.update(v=results(map_grid(work, range(cells), rng=0, executor=workers))))  # noqa: B023
            assert one == two, "the same bits"
            ratios.append(a / b)
    return statistics.median(ratios)


def memory(count):
    """Largest growth of this process over so many photographs, after the first ten [MB]; seconds for each."""
    rng = np.random.default_rng(0)
    basis = pa.clouds.Basis.precompute(CLOUD, CAMERA, pa.Sun(40, 200), orders=4, samples=8, rng=0)

    def photographs():
        for _ in range(count):
            picture = np.full((120, 160, 3), (0.1, 0.3, 0.8), np.float32)
            picture[20:80, 30:130] = np.linspace(0.3, 0.6 + 0.4 * rng.random(), 100)[:, None]
            yield picture

    seen = []
    start = time.process_time()
    # Cells are taken before the first call: paths would be strings.
    for outcome in pa.batch.fits(photographs(), basis, analyse={"ground": None}, generations=5):
        assert outcome.error is None, outcome.error
        seen.append(int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
    return (max(seen[10:]) - seen[10]) / 1e6, (time.process_time() - start) / count


if __name__ == "__main__":
    here, there = overhead()
    print(f"overhead of a cell: {here:.3f} ms in this process, {there:.3f} ms in a pool of two (goal: 20)")
    print(f"two workers: {throughput():.2f} times one process (goal: 1.7), the same bits")
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    grown, each = memory(count)
    print(f"{count} photographs: {grown:+.1f} MB after the tenth (goal: 30), {1e3 * each:.0f} ms of CPU each")

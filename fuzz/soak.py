"""Minutes of ordinary work in several threads with signals at random moments: memory, threads and descriptors stay flat.

    python fuzz/soak.py --seconds 600      # `make soak`

Fails if the resident memory grows by more than 40 MB after the first fifth, a thread or a descriptor is left, a result differs
from the first of its kind, an interrupt takes longer than half a second, or a file is left half-written.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pleinair as pa

CAMERA = pa.Camera(160, 90, fov=60, azimuth=200, elevation=15)
CLOUD = pa.clouds.procedural("cumulus", (24, 32, 32), rng=1)
VIEW = pa.Camera.look_at((320, -1200, 950), (320, 320, 1000), 32, 24, fov=30)
SUN = pa.Sun(30, 200)
PICTURE = np.random.default_rng(0).random((120, 160, 3)).astype(np.float32)
MASK = np.random.default_rng(1).random((120, 160)) < 0.3


def file_of(folder: Path) -> bytes:
    """Write a picture and read it, by a name of this thread's own."""
    path = pa.io.write(folder / f"{threading.get_ident()}.png", PICTURE)
    return pa.io.read(path).tobytes()


WORK = {
    "aoas": lambda _: pa.sky.Aoas(sun=SUN, cloud_complexity=3, rng=1).render(CAMERA).tobytes(),
    "physical": lambda _: pa.sky.Physical(sun=SUN).render(CAMERA).tobytes(),
    "cloud": lambda _: pa.clouds.render(CLOUD, pa.clouds.Params(), VIEW, SUN, orders=3, samples=2, rng=0).rgb.tobytes(),
    "lab": lambda _: pa.color.rgb_to_lab(PICTURE).tobytes(),
    "fill": lambda _: pa.image.fill(PICTURE, MASK).tobytes(),
    "otsu": lambda _: np.float64(pa.image.otsu(PICTURE[..., 0]).value).tobytes(),
    "tree": lambda _: pa.plants.Tree.grow(pa.plants.preset("shrub"), rng=1).leaves.position.tobytes(),
    "file": file_of,
}


def resident() -> float:
    """Resident memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def run(seconds: float, workers: int = 3) -> dict[str, float]:
    """Work for so long; what was counted."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    counts: dict[str, float] = {"calls": 0, "interrupts": 0, "differences": 0, "slowest interrupt": 0.0}
    lock, stop = threading.Lock(), threading.Event()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        known = {name: hashlib.sha256(call(folder)).digest() for name, call in WORK.items()}
        descriptors = len(list(Path("/proc/self/fd").iterdir()))

        def work(seed: int) -> None:
            chance = random.Random(seed)
            while not stop.is_set():
                name = chance.choice(sorted(WORK))
                same = hashlib.sha256(WORK[name](folder)).digest() == known[name]
                with lock:
                    counts["calls"] += 1
                    counts["differences"] += not same

        threads = [threading.Thread(target=work, args=(k,)) for k in range(workers)]
        before = threading.active_count()
        for thread in threads:
            thread.start()
        began, chance, base = time.monotonic(), random.Random(0), None
        while (now := time.monotonic() - began) < seconds:
            if base is None and now > seconds / 5:
                base = resident()
            sent: list[float] = []

            def fire(sent: list[float] = sent) -> None:
                sent.append(time.monotonic())
                os.kill(os.getpid(), signal.SIGINT)

            timer = threading.Timer(chance.uniform(0.02, 0.4), fire)
            try:
                timer.start()
                pa.clouds.render(CLOUD, pa.clouds.Params(), VIEW, SUN, orders=None, samples=4000, rng=0)
                timer.join()
                time.sleep(0.05)
            except KeyboardInterrupt:
                counts["interrupts"] += 1
                counts["slowest interrupt"] = max(counts["slowest interrupt"], time.monotonic() - sent[0])
        stop.set()
        for thread in threads:
            thread.join()
        counts["seconds"] = round(time.monotonic() - began, 1)
        counts["growth [MB]"] = round(resident() - (base or resident()), 1)
        counts["threads left"] = threading.active_count() - before
        counts["descriptors left"] = len(list(Path("/proc/self/fd").iterdir())) - descriptors
        counts["files left"] = len([p for p in folder.iterdir() if p.suffix == ".part"])
    return counts


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0, help="how long [s]")
    counts = run(parser.parse_args().seconds)
    print(json.dumps(counts))
    wrong = [name for name in ("differences", "threads left", "descriptors left", "files left") if counts[name]]
    if counts["growth [MB]"] > 40 or counts["slowest interrupt"] > 0.5 or not counts["interrupts"]:
        wrong.append("growth or interrupts")
    print("FAULTS", wrong) if wrong else print("flat")
    return len(wrong)


if __name__ == "__main__":
    sys.exit(main())

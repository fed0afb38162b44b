"""Peak memory of the calls that need most, each in a fresh interpreter: beyond what was resident before the call."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from pleinair.report import Baseline, Row

SLOW = True
# Room, task, statements before, statement, bytes that the answer or its input has.
CASES = [
    (
        "inverse_clouds",
        "peak memory of Basis.precompute over the saved basis",
        "320×240, cumulus 96×160×160, all orders, 32 paths",
        (
            "import os, tempfile\n"
            "cloud = pa.clouds.procedural('cumulus', (96, 160, 160), rng=3); low, high = cloud.bounds; at = (low + high) / 2\n"
            "cam = pa.Camera.look_at(tuple(at - (0, 6000, 800)), tuple(at), 320, 240, fov=30)"
        ),
        "b = pa.clouds.Basis.precompute(cloud, cam, pa.Sun(40, 200), orders=None, samples=32, rng=1)",
        "(lambda p: (b.save(p), os.path.getsize(p))[1])(os.path.join(tempfile.mkdtemp(), 'b.npz'))",
    ),
    (
        "aoas",
        "peak memory of a panorama over the picture",
        "16384×8192",
        "sky = pa.sky.Aoas(sun=pa.Sun(35, 200)); cam = pa.Camera.panorama(16384)",
        "b = sky.render(cam)",
        "b.nbytes",
    ),
    (
        "image",
        "peak memory of a fill",
        "12 MP, 40 % of RGB",
        (
            "import numpy as np; from scipy.ndimage import gaussian_filter; g = np.random.default_rng(1)\n"
            "x = g.random((3000, 4000, 3), dtype=np.float32); n = gaussian_filter(g.normal(size=(3000, 4000)), 12)\n"
            "m = n > np.quantile(n, .6); del n"
        ),
        "b = pa.image.fill(x, m)",
        "10**9",
    ),
    (
        "inverse_clouds",
        "peak memory of a render over the volume",
        "400³, all orders, 64×48, a path a pixel",
        (
            "cloud = pa.clouds.procedural('cumulus', (400, 400, 400), rng=3); low, high = cloud.bounds; at = (low + high) / 2\n"
            "far = 2.5 * float(max(high - low)); at = at.tolist()\n"
            "cam = pa.Camera.look_at((at[0], at[1] - far, at[2]), tuple(at), 64, 48, fov=30)\n"
            "p = pa.clouds.Params(g=.85, sigma_t=.01, albedo=.99, ambient=0.0)"
        ),
        "b = pa.clouds.render(cloud, p, cam, pa.Sun(40, 200), orders=None, samples=1)",
        "cloud.density.nbytes",
    ),
]

SCRIPT = """
import json, time
import pleinair as pa
pa.set_num_threads(1)
def status(name):
    with open("/proc/self/status") as lines:
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(name))
exec({setup!r})
with open("/proc/self/clear_refs", "w") as f:
    f.write("5")  # what was highest until now is forgotten
before, start = status("VmRSS:"), time.process_time()
exec({call!r})
spent, peak = time.process_time() - start, status("VmHWM:") - before
print(json.dumps([spent, peak, eval({of!r})]))
"""


def rows() -> Iterator[Row]:
    """Yield peak memory; the error is its ratio to what the task names."""
    if not Path("/proc/self/clear_refs").exists():
        print("bench_memory: left out, this system does not tell a peak")
        return
    for room, task, where, setup, call, of in CASES:
        code = SCRIPT.format(setup=setup, call=call, of=of)
        builds = {"pleinair": sys.executable}
        earlier = Baseline.interpreter()
        if earlier is not None:
            builds[Baseline.name] = earlier
        ours = 0.0
        for name, python in builds.items():
            begin = time.monotonic()
            env, code_of = Baseline.environment(python), [python, "-P", "-c", code]
            done = subprocess.run(code_of, capture_output=True, text=True, check=False, cwd="/", env=env)
            if done.returncode:
                print(
                    f"{task}, {name}: left out after {time.monotonic() - begin:.0f} s: {done.stderr.splitlines()[-1]}"
                )
                continue
            spent, peak, size = json.loads(done.stdout.splitlines()[-1])
            ours = ours or spent
            yield Row(room, task, where, name, spent, peak / size, "of it", spent / ours, memory=peak)

"""Skies and the machine: bits, threads, memory, progress, Ctrl-C."""

import subprocess
import sys
import threading
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core
from pleinair.sky import Aoas, CloudSpline, Principle, preset
from pleinair.sky.aoas import _built

SUN = pa.Sun(30, 180)
SKY = Aoas(sun=SUN)
CAMERA = pa.Camera(203, 117, fov=80, azimuth=180, elevation=25)
ALL = Aoas(
    sun=pa.Sun(4, 170), ambiguity=0.2, grain=0.01, cloud_complexity=5, disc=1, mie_scale_height=0.1, viewer=(0, 0, 0.1),
    shapes=[CloudSpline([(1, -1, 0.5), (0, -1, 1), (-1, -1, 0.3)], 0.3)], ground=(0.1, 0.2, 0.3),
)  # fmt: skip


def directions(count, seed=0):
    return np.random.default_rng(seed).normal(size=(count, 3))


def bits():
    out = []
    for sky in (ALL, preset("dusk"), preset("turbulent")):
        out.append(sky.render(CAMERA).tobytes())
        out.append(sky.panorama(60).tobytes())
        out.append(sky.radiance(CAMERA.directions()[:2]).tobytes())
        out.append(sky.radiance(CAMERA.directions()[50, :9], method="reference").tobytes())
        out.append(sky.irradiance(np.eye(3)).tobytes())
        out.append(sky.sh9().tobytes())
    light = np.linspace(-0.5, 3, 100_003, dtype=np.float32)
    return [*out, pa.tone.oneil(light).tobytes(), pa.tone.to_uint8(light).tobytes()]


def test_the_same_bits_at_every_simd_level_and_for_any_threads():
    expected = None
    for level in _core.simd_levels():
        for threads in (1, 2):
            _core.force_simd_level(level)
            pa.set_num_threads(threads)
            _built.cache_clear()  # tables are made anew
            found = bits()
            expected = expected or found
            assert [a == b for a, b in zip(found, expected, strict=True)] == [True] * len(found), (level, threads)


def test_the_same_bits_whatever_was_asked_before():
    d = directions(4000)
    _built.cache_clear()
    first = ALL.radiance(d)
    ALL.panorama(20)
    assert np.array_equal(ALL.radiance(d), first)
    # A list in two halves: tables are used either way.
    assert np.array_equal(np.concatenate([ALL.radiance(d[:1500]), ALL.radiance(d[1500:])]), first)


def test_threads_of_the_user_share_a_sky():
    _built.cache_clear()
    results = [None] * 4

    def look(i):
        results[i] = ALL.render(CAMERA).tobytes()

    threads = [threading.Thread(target=look, args=(i,)) for i in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert len(set(results)) == 1


MEMORY = """
import pleinair as pa
from pleinair.sky import Aoas, Principle
sky = {sky}
sky.panorama(64)

def kept(name):
    lines = open("/proc/self/status").read().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(name))

open("/proc/self/clear_refs", "w").write("5")
now = kept("VmRSS")
picture = sky.panorama({rows})
print((kept("VmHWM") - now) / picture.nbytes)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("rows", [1024, 2048])
def test_a_panorama_needs_its_own_memory_and_no_more(rows):
    """A sixty-fourth of 16k: directions are made block by block, so all that grows with the picture is the picture."""
    # The peak of this process alone: ru_maxrss would begin at that of the parent.
    code = MEMORY.format(sky="Aoas(sun=pa.Sun(30, 180), cloud_complexity=3, ambiguity=0.1)", rows=rows)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert float(run.stdout) < 1.25


LONG = """
import os, signal, threading, time
import numpy as np
import pleinair as pa
from pleinair import _core
from pleinair.sky import Aoas, Principle, preset
pa.set_num_threads({threads})
fired = []
signal.signal(signal.SIGINT, signal.default_int_handler)
def fire():
    time.sleep(0.3)
    fired.append(time.monotonic())
    os.kill(os.getpid(), signal.SIGINT)
thread = threading.Thread(target=fire)
d = np.random.default_rng(0).normal(size=(60_000, 3))
thread.start()
try:
    {call}
    print("finished")
except KeyboardInterrupt:
    print("interrupted", time.monotonic() - fired[0])
print("usable", _core._spin(2, 1))
"""

CALLS = {
    "reference picture": "preset('dusk').render(pa.Camera(640, 480), method='reference')",
    "reference list": "preset('dusk').radiance(d, method='reference')",
    "reference panorama": "Aoas(sun=pa.Sun(30)).panorama(512, method='reference')",
    "principles": "Aoas(sun=pa.Sun(30), principles=[Principle()]).render(pa.Camera(640, 480), method='reference')",
    "fast": "preset('dusk', sun=pa.Sun(-0.01, 180)).render(pa.Camera(8000, 6000, azimuth=180, elevation=20))",
}
MEDIUM = (
    "[preset('dusk', sun=pa.Sun(-0.01, 180)).render(pa.Camera(1280, 860, azimuth=180, elevation=20)) for _ in '12']"
)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("call", CALLS)
def test_ctrl_c_stops_a_long_look(call, threads):
    stopped(CALLS[call], threads)


def test_ctrl_c_stops_a_picture_that_the_table_does_not_hold():
    stopped(MEDIUM, 1)


def stopped(call, threads):
    code = LONG.format(call=call, threads=threads)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stderr
    words = run.stdout.split()
    assert words[0] == "interrupted", run.stdout
    assert float(words[1]) < 0.5, f"KeyboardInterrupt after {words[1]} s"
    assert words[2:] == ["usable", "2"]


OWN = replace(SKY, principles=[Principle()])


LOOKS = {
    "picture": lambda tick: SKY.render(pa.Camera(800, 600), progress=tick),
    "panorama": lambda tick: SKY.panorama(600, progress=tick),
    "list": lambda tick: SKY.radiance(directions(50_000), progress=tick),
    "reference list": lambda tick: SKY.radiance(directions(2000), method="reference", progress=tick),
    "reference picture": lambda tick: SKY.render(pa.Camera(30, 20), method="reference", progress=tick),
    "own picture": lambda tick: OWN.render(pa.Camera(800, 600), progress=tick),
    "own list": lambda tick: OWN.radiance(directions(2000), progress=tick),
}


@pytest.mark.parametrize("name", LOOKS)
def test_progress_is_called_and_its_exception_arrives(name):
    seen, call = [], LOOKS[name]
    call(lambda done, total: seen.append((done, total)))
    assert seen
    assert seen == sorted(seen)
    assert len({total for _, total in seen}) == 1
    assert all(0 <= done <= total for done, total in seen)
    with pytest.raises(ZeroDivisionError):
        call(lambda done, total: 1 / 0)


def test_progress_of_a_reference_picture_moves():
    seen = []
    SKY.render(pa.Camera(64, 48), method="reference", progress=lambda done, total: seen.append(done / total))
    assert len(seen) > 3


def test_the_fast_method_can_be_stopped_while_it_makes_its_tables():
    whole = ALL.render(CAMERA)
    _built.cache_clear()

    def no(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        ALL.render(CAMERA, progress=no)
    assert np.array_equal(ALL.render(CAMERA), whole)

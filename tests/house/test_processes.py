"""Threads, signals and processes: fork, spawn, pickle, Ctrl-C, the same bits at any thread count."""

import copy
import dataclasses
import json
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from datetime import UTC, datetime

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core

CLOUD = pa.clouds.procedural("cumulus", (16, 24, 24), rng=1)
CAMERA = pa.Camera.look_at((-500, 100, 800), (240, 240, 950), 48, 36, fov=40)
SUN = pa.Sun(40, 120)
PLACE, WHEN = pa.Place(48.8, 2.3), datetime(2024, 6, 20, 22, tzinfo=UTC)


def small_fit():
    picture = np.full((32, 32, 3), (0.1, 0.3, 0.8), np.float32)
    picture[8:20, 8:24] = np.linspace(0.3, 0.9, 16)[:, None]
    photo = pa.fit.Photo.analyse(picture, ground=None)
    basis = pa.clouds.Basis.precompute(CLOUD, CAMERA, SUN)
    return pa.fit.clouds(photo, basis, generations=4, rng=0)


def answer(_=None):
    return pa.clouds.render(CLOUD, pa.clouds.Params(sigma_t=0.02), CAMERA, SUN).rgb.tobytes()


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_child_forked_after_a_warm_call_works():
    pa.set_num_threads(2)
    expected = answer()
    _core._spin(4, 1)  # the pool is warm
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(write, b"y" if answer() == expected else b"n")
        finally:
            os._exit(0)
    os.close(write)
    end = time.monotonic() + 15
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            assert status == 0
            assert os.read(read, 1) == b"y"
            break
        time.sleep(0.02)
    else:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        pytest.fail("the forked child hangs")
    os.close(read)
    assert answer() == expected, "the parent works on"


def test_a_spawned_process_gives_the_same_bits():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(answer) == answer()


def public_objects():
    fit = small_fit()
    return {
        "Camera": CAMERA,
        "Sun": SUN,
        "Place": PLACE,
        "Moon": pa.astro.moon(WHEN, PLACE),
        "Stars": pa.astro.stars(WHEN, PLACE, limit=2.0),
        "Planet": pa.astro.planets(WHEN, PLACE)[1],
        "LightSource": pa.astro.light_sources()[1],
        "Volume": CLOUD,
        "Params": pa.clouds.Params(g=0.5),
        "Conventions": pa.clouds.Conventions.paper(),
        "CloudImage": fit.basis.render(fit.best.params),
        "Basis": fit.basis,
        "Bases": pa.clouds.Bases([fit.basis]),
        "Keyframes": pa.clouds.keyframes((0, 1), (pa.clouds.Params(), pa.clouds.Params(g=0.2))),
        "SkyFit": pa.fit.sky(np.full((4, 4, 3), 0.4), generations=1, rng=0),
        "Tried": fit.tried[0],
        "Photo": fit.photo,
        "Segmentation": fit.photo.segmentation,
        "Candidate": fit.best,
        "CloudFit": fit,
        "DifferentialEvolution": pa.fit.DifferentialEvolution(patience=3),
        "GeneticAlgorithm": pa.fit.GeneticAlgorithm(bits=16),
        "Found": pa.fit.genetic(lambda x: (x**2).sum(axis=1), [(0, 1)], generations=2, rng=0),
        "Threshold": pa.image.otsu(np.arange(9, dtype=np.uint8)),
        "Histogram": pa.image.histogram(np.zeros((4, 4), np.uint8)),
        "Row": pa.report.Row("a", "b", "c", "d", 1.0, 0.0, "1", 1.0),
    }


OBJECTS = public_objects()


def arrays(thing):
    if isinstance(thing, np.ndarray):
        return [thing]
    if isinstance(thing, (list, tuple)):
        return [a for item in thing for a in arrays(item)]
    if hasattr(thing, "__dict__"):
        return [a for item in vars(thing).values() for a in arrays(item)]
    return []


@pytest.mark.parametrize("name", OBJECTS)
def test_every_public_object_survives_pickle(name):
    thing = OBJECTS[name]
    again = pickle.loads(pickle.dumps(thing))
    if name == "CloudFit":
        again = again.attach(thing.photo, thing.basis)
    assert type(again) is type(thing)
    assert repr(again) == repr(thing)
    assert len(arrays(again)) == len(arrays(thing))
    assert all(
        np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in zip(arrays(again), arrays(thing), strict=True)
    )


def test_a_fit_travels_without_photograph_and_basis():
    fit = OBJECTS["CloudFit"]
    assert len(pickle.dumps(fit)) < 20_000, "a basis has tens of megabytes"
    assert len(fit.to_json()) < 20_000
    for again in (pickle.loads(pickle.dumps(fit)), pa.fit.CloudFit.from_json(fit.to_json())):
        assert (again.ranked, again.noise, again.spread, again.tried) == (fit.ranked, fit.noise, fit.spread, fit.tried)
        assert (again.sun, again.camera, again.orders, again.stopped) == (fit.sun, fit.camera, fit.orders, fit.stopped)
        assert np.array_equal(again.history, fit.history)
        with pytest.raises(ValueError, match=r"fit.attach\(photo, basis\)"):
            again.picture()
        assert np.array_equal(again.attach(fit.photo, fit.basis).picture(), fit.picture())
    assert np.array_equal(copy.deepcopy(copy.copy(fit)).ranked, fit.ranked)
    assert copy.copy(fit).photo is fit.photo
    other = dataclasses.replace(fit.basis, sun=pa.Sun(10, 20))
    with pytest.raises(ValueError, match="basis must have the sun of the fit"):
        fit.attach(fit.photo, other)


def test_a_scene_that_was_painted_travels_as_light_as_before():
    scene, camera = pa.demo.landscape(trees=1, cloud=False, grown=False)
    fresh = pickle.dumps(scene)
    picture = scene.paint(camera.resized(48, 27))
    assert len(pickle.dumps(scene)) == len(fresh)
    assert np.array_equal(pickle.loads(fresh).paint(camera.resized(48, 27)), picture)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "sky"}, "kind 'cloud fit'"),
        ({"format": 99}, "format 99"),
        ({"noise": "much"}, "could not convert"),
        ({"ranked": [{"params": {"g": 3}, "objective": 1}]}, "g must be in"),
        ({"sun": {"elevation": 100}}, "elevation"),
        ({"history": {}}, "it has no 'best'"),
    ],
)
def test_json_that_is_no_fit_is_refused_by_name(change, words):
    text = json.dumps(OBJECTS["CloudFit"].to_dict() | change)
    with pytest.raises(ValueError, match=words):
        pa.fit.CloudFit.from_json(text)


def test_every_public_class_is_in_that_list():
    classes = {
        name
        for module in (pa.astro, pa.camera, pa.clouds, pa.fit, pa.image, pa.report)
        for name in module.__all__
        if isinstance(getattr(module, name), type) and not issubclass(getattr(module, name), Exception)
    }
    # An earlier build is a process of its own.
    assert classes - {"Baseline"} <= set(OBJECTS)


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_bits_do_not_depend_on_threads(threads):
    pa.set_num_threads(1)
    expected = answer()
    history = small_fit().history.tobytes()
    cloud = CLOUD.density.tobytes()
    pa.set_num_threads(threads)
    assert answer() == expected
    assert small_fit().history.tobytes() == history
    assert pa.clouds.procedural("cumulus", (16, 24, 24), rng=1).density.tobytes() == cloud


@pytest.mark.parametrize("level", _core.simd_levels())
def test_bits_do_not_depend_on_the_simd_level(level):
    expected = answer()
    history = small_fit().history.tobytes()
    _core.force_simd_level(level)
    assert _core.simd_level() == level
    for threads in (1, 2):
        pa.set_num_threads(threads)
        assert answer() == expected
        assert small_fit().history.tobytes() == history


# The first call finds a cold pool, the second a warm one.
LONG = """
import os, signal, sys, threading, time
import numpy as np
import pleinair as pa
from pleinair import _core
pa.set_num_threads({threads})
# Whoever runs the tests in the background may ignore the signal.
signal.signal(signal.SIGINT, signal.default_int_handler)
# Python itself may lose a signal that comes while a module is imported (in a callback of the import lock).
import pleinair.clouds, pleinair.demo, pleinair.fit
pa.io.read(pa.demo.photograph())
def fire():
    time.sleep(0.25)
    fired.append(time.monotonic())
    os.kill(os.getpid(), signal.SIGINT)
for pool in ("cold", "warm"):
    fired = []
    threading.Thread(target=fire).start()
    try:
        {call}
        print(pool, "finished")
    except KeyboardInterrupt:
        print(pool, "interrupted", time.monotonic() - fired[0])
print("usable", _core._spin(2, 1))
"""

CALLS = {
    "dilate": "pa.image.dilate(np.eye(4000, dtype=bool), 1500)",
    "resize": "pa.image.resize(np.ones((20, 20, 3)), 20000, 15000)",
    "spin": "_core._spin(100000, 5)",
    "procedural": "pa.clouds.procedural('cumulus', (600, 900, 900), rng=1)",
    "cumulonimbus": "pa.clouds.procedural('cumulonimbus', (600, 900, 900), rng=1)",
    "stratocumulus": "pa.clouds.procedural('stratocumulus', (600, 900, 900), rng=1)",
    "cirrus": "pa.clouds.procedural('cirrus', (600, 900, 900), rng=1)",
    "simulated": "pa.clouds.simulated((64, 96, 96), rng=1)",
    "fit": "pa.fit.clouds(*(lambda p, c: (p, pa.clouds.Basis.precompute(c, pa.Camera.look_at((0, -3000, 900), "
    "(480, 480, 1000), 320, 240, fov=20), pa.Sun(30, 90))))(pa.fit.Photo.analyse(pa.io.read("
    "pa.demo.photograph())), pa.clouds.procedural('cumulus', (32, 48, 48), rng=1)), "
    "generations=10**6, patience=None)",
    "reference": "pa.clouds.render(pa.clouds.procedural('cumulus', (32, 48, 48), rng=1), pa.clouds.Params(), "
    "pa.Camera.look_at((0, -3000, 900), (480, 480, 1000), 640, 480, fov=30), pa.Sun(30, 90), method='reference')",
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c_stops_long_work_at_once(call, threads):
    code = LONG.format(call=CALLS[call], threads=threads)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stderr
    *runs, last = run.stdout.splitlines()
    assert [line.split()[:2] for line in runs] == [["cold", "interrupted"], ["warm", "interrupted"]], run.stdout
    for line in runs:
        assert float(line.split()[2]) < 0.2, f"KeyboardInterrupt after {line} s"
    assert last == "usable 2"


def test_ctrl_c_leaves_no_file_behind(tmp_path):
    code = textwrap.dedent(f"""
        import signal, threading, time
        signal.signal(signal.SIGINT, signal.default_int_handler)
        import pleinair as pa
        threading.Timer(0.4, lambda: __import__("os").kill(__import__("os").getpid(), 2)).start()
        try:
            pa.clouds.procedural("cumulus", (600, 900, 900), rng=1).save({str(tmp_path / "cloud.npz")!r})
        except KeyboardInterrupt:
            print("interrupted")
    """)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert run.stdout.strip() == "interrupted", run.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = CLOUD.save(tmp_path / "cloud.npz")
    before = path.read_bytes()

    def fail(stream):
        stream.write(b"half")
        raise RuntimeError("disk")

    with pytest.raises(RuntimeError, match="disk"):
        pa.io.replacing(path, fail)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["cloud.npz"]


def test_progress_counts_up_and_its_exception_stops_the_work():
    seen = []
    _core._spin(20, 10, lambda done, total: seen.append((done, total)))
    assert seen
    assert seen == sorted(seen)
    assert {total for _, total in seen} == {20}
    assert seen[-1] == (20, 20)
    with pytest.raises(ZeroDivisionError):
        _core._spin(10_000, 10, lambda done, total: 1 / 0)


def test_the_gil_is_free_meanwhile():
    ticks, stop = [0], threading.Event()

    def tick():
        while not stop.wait(0.002):
            ticks[0] += 1

    thread = threading.Thread(target=tick)
    thread.start()
    _core._spin(30, 10)
    stop.set()
    thread.join()
    assert ticks[0] > 20


def test_threads_are_set_and_refused():
    pa.set_num_threads(3)
    assert pa.get_num_threads() == 3
    pa.set_num_threads(None)
    for bad in (0, 2000):
        with pytest.raises(ValueError, match="threads"):
            pa.set_num_threads(bad)
    code = "import pleinair; print(pleinair.get_num_threads())"
    env = {**os.environ, "RAYON_NUM_THREADS": "5"}
    assert (
        subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
        == "5\n"
    )


def test_show_versions_says_what_a_report_needs(capsys):
    pa.show_versions()
    text = capsys.readouterr().out
    assert pa.__version__ in text
    assert np.__version__ in text
    assert _core.simd_level() in text


def test_an_unknown_simd_level_is_refused():
    with pytest.raises(ValueError, match="level"):
        _core.force_simd_level("mmx")

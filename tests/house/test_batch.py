"""Grids of cells with real processes: the same bits anywhere, workers and drivers that are killed, stores that resume."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path

import grid_functions as g
import loky
import numpy as np
import pleinair as pa
import pytest
from pleinair.batch import map_grid, results

VOLUME = np.random.default_rng(0).random((5, 7, 3))
HERE = str(Path(__file__).parent)


@pytest.fixture(scope="module", autouse=True)
def importable():
    # Spawned workers look where the parent's path says.
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(x for x in (HERE, before) if x)
    yield
    if before is None:
        del os.environ["PYTHONPATH"]
    else:
        os.environ["PYTHONPATH"] = before


def pool():
    return ProcessPoolExecutor(2, mp_context=get_context("spawn"))


def loky_pool():
    return loky.ProcessPoolExecutor(2)


FACTORIES = {"spawn": pool, "loky": loky_pool}


@pytest.fixture(scope="module")
def client():
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def serial():
    return g.digest(results(map_grid(g.picture, range(6), shared=[VOLUME], rng=7)))


@pytest.mark.parametrize("name", FACTORIES)
def test_processes_give_the_bits_of_one(name, serial):
    got = results(map_grid(g.picture, range(6), shared=[VOLUME], rng=7, executor=FACTORIES[name]))
    assert g.digest(got) == serial


def test_threads_give_them_too(serial):
    with ThreadPoolExecutor(2) as threads:
        assert g.digest(results(map_grid(g.picture, range(6), shared=[VOLUME], rng=7, executor=threads))) == serial


def test_dask_gives_them_too_and_loses_a_worker(client, serial, tmp_path):
    executor = client.get_executor(pure=False, retries=2)
    assert g.digest(results(map_grid(g.picture, range(6), shared=[VOLUME], rng=7, executor=executor))) == serial
    got = sorted(map_grid(g.dies_once, range(24), shared=[str(tmp_path)], executor=executor), key=lambda o: o.index)
    assert [o.value[0] for o in got] == [k * k for k in range(24)]
    dead = int((tmp_path / "died").read_text())
    assert dead not in {o.value[1] for o in got if o.index >= 8}, "its cells were done by others"
    assert len({o.value[1] for o in got}) >= 2


def test_dask_loses_a_worker_after_the_eighth_result_and_no_bit(client):
    executor = client.get_executor(pure=False, retries=2)
    before = set(client.run(os.getpid).values())
    got = []
    for outcome in map_grid(g.picture, range(24), shared=[VOLUME], rng=7, executor=executor):
        got.append(outcome)
        if len(got) == 8:
            victim = next(iter(client.run(os.getpid).values()))
            os.kill(victim, signal.SIGKILL)
    assert g.digest(results(got)) == g.digest(results(map_grid(g.picture, range(24), shared=[VOLUME], rng=7)))
    client.wait_for_workers(2, timeout=30)
    after = set(client.run(os.getpid).values())
    assert victim not in after
    assert after - before, "another worker came"


def test_dask_fits_precomputes_and_paints(client, tmp_path, basis):
    executor = client.get_executor(pure=False, retries=2)
    photos = [photograph(k) for k in range(12)]
    more = {"analyse": {"ground": None}, "generations": 3, "rng": 3}
    here, there = (results(pa.batch.fits(photos, basis, executor=e, **more)) for e in (None, executor))
    assert [f.ranked for f in here] == [f.ranked for f in there]
    suns = [pa.Sun(20 + 10 * k, 160) for k in range(6)]
    made = [
        results(pa.batch.precompute(g.CLOUD, g.CAMERA, suns, store=tmp_path / name, executor=e))
        for name, e in (("here", None), ("there", executor))
    ]
    for a, b in zip(*made, strict=True):
        assert np.array_equal(pa.clouds.Basis.load(a).scattered, pa.clouds.Basis.load(b).scattered)
    scene = pa.Scene(pa.sky.Aoas(sun=pa.Sun(30, 160)))
    pan = pa.Timeline({0: pa.Camera(32, 24), 1: pa.Camera(32, 24, azimuth=20)})
    films = [
        results(pa.batch.frames(scene, pan, store=tmp_path / name, seconds=1, executor=e))
        for name, e in (("one", None), ("two", executor))
    ]
    assert [a.read_bytes() for a in films[0]] == [b.read_bytes() for b in films[1]]
    assert len(films[0]) == 24


@pytest.mark.parametrize("name", FACTORIES)
def test_a_worker_that_dies_costs_nothing_but_time(name, tmp_path):
    got = sorted(
        map_grid(g.dies_once, range(24), shared=[str(tmp_path)], executor=FACTORIES[name]), key=lambda o: o.index
    )
    assert [o.value[0] for o in got] == [k * k for k in range(24)]
    dead = int((tmp_path / "died").read_text())
    assert got[8].value[1] != dead


def test_a_cell_that_kills_its_workers_loses_nothing_else():
    got = sorted(map_grid(g.poison, range(12), shared=["x"], executor=pool), key=lambda o: o.index)
    assert [o.value for o in got] == [None if k == 3 else k * k for k in range(12)]
    assert "its worker died each time" in got[3].error


def test_an_executor_of_the_users_is_not_made_anew(tmp_path):
    with pool() as mine, pytest.raises(BrokenExecutor):
        list(map_grid(g.poison, range(12), shared=["x"], executor=mine))


def test_a_factory_whose_workers_never_start_ends():
    made = []

    class Broken:
        def submit(self, *args):
            raise BrokenProcessPool("no worker")

        def shutdown(self, **how):
            pass

    def factory():
        made.append(1)
        return Broken()

    with pytest.raises(BrokenProcessPool):
        list(map_grid(g.fails, range(3), executor=factory, max_restarts=2))
    assert len(made) == 3


def test_workers_use_one_thread_each():
    assert results(map_grid(g.threads, range(4), executor=pool)) == [[1, 1]] * 4


def test_failures_are_records_with_their_sentence():
    got = list(map_grid(g.fails, range(5)))
    assert [o.error for o in got] == [None, "ValueError: cell 1 is odd", None, "ValueError: cell 3 is odd", None]
    with pytest.raises(RuntimeError, match="2 of 5 cells failed: cell 1: ValueError: cell 1 is odd"):
        results(got)


def test_a_store_resumes_and_holds_whole_files_only(tmp_path):
    before = list(map_grid(g.noise, range(9), shared=[VOLUME], rng=5))
    first = map_grid(g.noise, range(9), shared=[VOLUME], rng=5, store=tmp_path)
    assert [next(first).index for _ in range(4)] == [0, 1, 2, 3]
    first.close()
    names = sorted(p.name for p in tmp_path.iterdir())
    assert names == ["0000.json", "0001.json", "0002.json", "0003.json", "grid.json"]
    done = []
    again = list(
        map_grid(g.noise, range(9), shared=[VOLUME], rng=5, store=tmp_path, progress=lambda *a: done.append(a))
    )
    assert [o.value for o in again] == [o.value for o in before]
    assert [o.seconds == 0 for o in again] == [True] * 4 + [False] * 5
    assert done == [(k + 1, 9) for k in range(9)]


def test_arrays_come_back_from_a_store(tmp_path):
    for _ in range(2):
        one, two = results(map_grid(g.arrays, range(2), store=tmp_path))
        assert one.tolist() == [0, 1, 2, 3]
        assert two["a"].tolist() == [1, 1, 1]
        assert two["b"].dtype == np.float32


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"cells": range(8)}, "cells"),
        ({"rng": 6}, r"seed \d+ instead of \d+"),
        ({"shared": [VOLUME + 1]}, "task"),
        ({"function": g.slow_noise}, "task"),
    ],
)
def test_a_store_of_another_grid_is_refused(tmp_path, change, word):
    usual = {"function": g.noise, "cells": range(9), "shared": [VOLUME], "rng": 5, "store": tmp_path}

    def run(function, cells, **more):
        return list(map_grid(function, cells, **more))

    run(**usual)
    with pytest.raises(ValueError, match=f"store must be an empty folder or one of this grid.*{word}"):
        run(**usual | change)


def test_a_damaged_store_is_refused(tmp_path):
    (tmp_path / "grid.json").write_text("[1")
    with pytest.raises(ValueError, match="is damaged"):
        map_grid(g.fails, range(3), store=tmp_path)


def test_a_store_that_cannot_be_a_folder_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        map_grid(g.fails, range(3), store=tmp_path / "file")


def test_what_a_store_cannot_hold_is_a_failure_of_its_cell(tmp_path):
    got = list(map_grid(g.who.__class__, [g.who.__code__], store=tmp_path))
    assert got[0].error.startswith("TypeError")


DRIVER = """
import sys
sys.path.insert(0, {here!r})
import numpy as np
import grid_functions as g
from pleinair.batch import map_grid
volume = np.random.default_rng(0).random((5, 7, 3))
for outcome in map_grid(g.slow_noise, range(40), shared=[volume], rng=5, store={store!r}):
    print(outcome.index, flush=True)
"""


def driver(store):
    code = DRIVER.format(here=HERE, store=str(store))
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)


def test_a_killed_driver_resumes_to_the_same_digest(tmp_path):
    with driver(tmp_path) as process:
        for _ in range(15):
            process.stdout.readline()
        process.kill()
        assert process.wait() == -signal.SIGKILL
    kept = list(tmp_path.glob("0*.json"))
    assert 15 <= len(kept) < 40
    again = map_grid(g.slow_noise, range(40), shared=[VOLUME], rng=5, store=tmp_path, executor=pool)
    assert g.digest(results(again)) == g.digest(results(map_grid(g.noise, range(40), shared=[VOLUME], rng=5)))
    assert not [p.name for p in tmp_path.iterdir() if not p.name.endswith(".json")], "no litter"


def test_two_processes_share_a_store(tmp_path):
    with driver(tmp_path) as one, driver(tmp_path) as other:
        assert [one.wait(60), other.wait(60)] == [0, 0]
    got = map_grid(g.slow_noise, range(40), shared=[VOLUME], rng=5, store=tmp_path)
    assert g.digest(results(got)) == g.digest(results(map_grid(g.noise, range(40), shared=[VOLUME], rng=5)))


CTRL_C = """
import sys, time
sys.path.insert(0, {here!r})
import grid_functions as g
import numpy as np
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pleinair.batch import map_grid
if __name__ == "__main__":
    factory = lambda: ProcessPoolExecutor(2, mp_context=get_context("spawn"))
    try:
        for k, _ in enumerate(map_grid(g.slow_noise, range(10_000), shared=[np.ones((5, 7, 3))], rng=1, executor=factory)):
            if k == 5:
                print("ready", flush=True)
    except KeyboardInterrupt:
        print("interrupted", time.time(), flush=True)
"""


def test_ctrl_c_ends_a_grid_of_processes(tmp_path):
    script = tmp_path / "run.py"
    script.write_text(CTRL_C.format(here=HERE))
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True, process_group=0) as process:
        assert process.stdout.readline() == "ready\n"
        sent = time.time()
        process.send_signal(signal.SIGINT)
        word, at = process.stdout.readline().split()
        assert word == "interrupted"
        assert float(at) - sent < 0.5, "0.2 s on an idle machine"
        assert process.wait(20) == 0


def test_wrong_arguments_are_refused_by_name():
    for change, words in (
        ({"function": 3}, "function must be callable"),
        ({"executor": 3}, "executor must have submit"),
        ({"max_restarts": -1}, "max_restarts"),
        ({"threads": 0}, "threads"),
        ({"rng": "x"}, "rng"),
    ):
        arguments = {"function": abs, "cells": [1]} | change
        with pytest.raises((TypeError, ValueError), match=words):
            map_grid(arguments.pop("function"), arguments.pop("cells"), **arguments)
    with pytest.raises(TypeError, match=r"shared\[0\] must be picklable"):
        list(map_grid(g.who, [1], shared=[lambda: 0], executor=pool))


def photograph(seed):
    rng = np.random.default_rng(seed)
    picture = np.full((32, 40, 3), (0.1, 0.3, 0.8), np.float32)
    picture[8:20, 8:30] = np.linspace(0.3, 0.7 + 0.3 * rng.random(), 22)[:, None]
    return picture


@pytest.fixture(scope="module")
def basis():
    return pa.clouds.Basis.precompute(g.CLOUD, g.CAMERA, pa.Sun(40, 160))


def test_fits_of_many_photographs(tmp_path, basis):
    paths = [pa.io.write(tmp_path / f"{k}.png", photograph(k)) for k in range(4)]
    (tmp_path / "4.png").write_bytes(b"no picture")
    photos = [*paths, tmp_path / "4.png", np.zeros((1, 1, 3), np.float32)]
    more = {"analyse": {"ground": None}, "generations": 4, "rng": 3}
    here = list(pa.batch.fits(photos, basis, **more))
    stored = basis.save(tmp_path / "basis.npz")
    there = sorted(pa.batch.fits(photos, stored, executor=pool, store=tmp_path / "fits", **more), key=lambda o: o.index)
    assert [o.error is None for o in here] == [True] * 4 + [False] * 2
    assert "4.png" in here[4].error
    for a, b in zip(here, there, strict=True):
        assert a.error == b.error
        if a.value:
            assert (a.value.ranked, a.value.noise) == (b.value.ranked, b.value.noise)
    alone = pa.fit.clouds(
        pa.fit.Photo.analyse(pa.io.read(paths[2]), ground=None),
        basis,
        generations=4,
        rng=np.random.default_rng(np.random.SeedSequence(_key(3), spawn_key=(2,))),
    )
    assert alone.ranked == here[2].value.ranked, "a cell's numbers are those of its index"


def _key(rng):
    from pleinair._support.inputs import key

    return key(rng)


def test_bases_for_many_suns(tmp_path):
    suns = [pa.Sun(20 + 10 * k, 160) for k in range(3)]
    made = list(pa.batch.precompute(g.CLOUD, g.CAMERA, suns, store=tmp_path, orders=2, samples=2))
    assert [pa.clouds.Basis.load(o.value).sun for o in made] == suns
    files = {p: p.stat().st_mtime_ns for p in tmp_path.iterdir()}
    again = list(pa.batch.precompute(g.CLOUD, g.CAMERA, suns, store=tmp_path, orders=2, samples=2, executor=pool))
    assert [o.value for o in again] == [o.value for o in made]
    assert {p: p.stat().st_mtime_ns for p in tmp_path.iterdir()} == files, "nothing is done twice"
    made[1].value.unlink()
    gone = list(pa.batch.precompute(g.CLOUD, g.CAMERA, suns, store=tmp_path, orders=2, samples=2))
    assert "was taken away" in gone[1].error


def test_frames_of_a_film(tmp_path):
    scene = pa.Scene(pa.sky.Aoas(sun=pa.Sun(30, 160)))
    pan = pa.Timeline({0: pa.Camera(32, 24), 1: pa.Camera(32, 24, azimuth=20)})
    got = list(pa.batch.frames(scene, pan, store=tmp_path, seconds=0.25, fps=24, executor=pool))
    assert [o.error for o in got] == [None] * 6
    want = [pa.tone.to_uint8(frame) for frame in scene.animate(pan, 6)]
    for one in got:
        from PIL import Image

        assert np.abs(np.asarray(Image.open(one.value)).astype(int) - want[one.index]).max() <= 1


def test_outcomes_are_plain():
    one = pa.batch.Outcome(3, [1.5], None, 0.25)
    assert json.loads(json.dumps(dataclasses.asdict(one))) == {
        "index": 3,
        "value": [1.5],
        "error": None,
        "seconds": 0.25,
    }


def test_the_page_of_pipelines_runs(tmp_path):
    page = Path(__file__).parents[2] / "docs" / "pipelines.md"
    if not page.exists():
        pytest.fail("docs/pipelines.md is not there")
    code = [block.split("```")[0] for block in page.read_text(encoding="utf-8").split("```python\n")[1:]]
    assert len(code) >= 4
    for k, block in enumerate(code):
        script = tmp_path / f"example_{k}.py"
        script.write_text(textwrap.dedent(block))
        done = subprocess.run(
            [sys.executable, str(script)], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == 0, f"example {k}: {done.stderr[-3000:]}"
    (tmp_path / "scene.toml").write_text(page.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0])
    assert pa.Scene.load(tmp_path / "scene.toml").sky.turbidity == 3

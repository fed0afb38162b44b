"""The report: its pages, its targets, and that it fails where a ratio has fallen."""

import csv
import re
import sys
import textwrap
import tomllib
from pathlib import Path

import pleinair as pa
import pytest
from pleinair.report import Baseline, Row, check, race, run, write

ROOT = Path(__file__).parents[2]

BENCH = """
import math
from pathlib import Path
from pleinair.report import Row
SLOW = {slow}
def rows():
    yield Row("image", "sum", "1e3", "pleinair", 1e-3, 1e-7, "1", 1.0)
    yield Row("image", "sum", "1e3", "rival 1.2.3", {ratio} * 1e-3, 1e-3, "1", {ratio}, noise=0.01)
    for n in (1, 10, 100):
        yield Row("image", "sum, by numbers", "f32", f"pleinair, {{n}}", n * 1e-6, 0.1 / n, "1", 1.0,
                  family="pleinair", setting=str(n), size=n, size_unit="numbers", floor=1e-4)
"""
TARGET = '[[target]]\ntask = "sum"\nrival = "rival"\nratio = 3.0\nheadline = "A sum"\n'


def checkout(folder, ratio, slow=False):
    benches = folder / "benches"
    benches.mkdir(exist_ok=True)
    (benches / "bench_sums.py").write_text(BENCH.format(ratio=ratio, slow=slow))
    (benches / "TARGETS.toml").write_text(TARGET)
    return folder


def test_pages_say_what_was_measured(tmp_path, capsys):
    rows = run(checkout(tmp_path, 2.0))
    folder = tmp_path / "docs" / "report"
    first = (folder / "README.md").read_text()
    assert "| A sum | rival 1.2.3 | 2 × | 1e-07 | 0.001 | ≥ 3 × **missed** |" in first
    assert "0 of 1 targets are met" in first
    page = (folder / "image.md").read_text()
    for picture in ("image_settings.png", "image_growth.png"):
        assert picture in page
        assert (folder / picture).stat().st_size > 5000
    assert "pleinair report --only sums" in page
    assert len(rows) == 5
    assert [row.met for row in rows] == [None, False, None, None, None]
    assert not list(folder.glob(".*")), "nothing half written is left"


def test_a_target_that_is_met(tmp_path):
    run(checkout(tmp_path, 4.0))
    first = (tmp_path / "docs" / "report" / "README.md").read_text()
    assert "≥ 3 × met |" in first
    assert "1 of 1 targets are met" in first


def test_a_ratio_that_falls_is_found(tmp_path, capsys):
    run(checkout(tmp_path, 4.0))
    assert check(checkout(tmp_path, 3.9)) == [], "within its noise"
    assert check(checkout(tmp_path, 5.0)) == [], "faster is no fault"
    (line,) = check(checkout(tmp_path, 2.0))
    assert line.startswith("sum, 1e3, against rival 1.2.3: 2, was 4")


def test_what_is_missing_is_said(tmp_path, capsys):
    with pytest.raises(FileNotFoundError, match=r"no docs/report/rows\.csv"):
        check(checkout(tmp_path, 4.0))
    (tmp_path / "benches" / "bench_other.py").write_text("import a_rival_that_nobody_has\n")
    rows = run(tmp_path)
    assert "bench_other: left out, there is no a_rival_that_nobody_has" in capsys.readouterr().out
    assert len(rows) == 5
    checkout(tmp_path, 4.0, slow=True)
    assert run(tmp_path, quick=True) == []


def test_a_bench_that_fails_loses_nothing_of_the_others(tmp_path, capsys):
    checkout(tmp_path, 4.0)
    (tmp_path / "benches" / "bench_broken.py").write_text("def rows():\n    yield from ()\n    raise KeyError('no')\n")
    with pytest.raises(RuntimeError, match="bench_broken failed"):
        run(tmp_path)
    assert "| A sum |" in (tmp_path / "docs" / "report" / "README.md").read_text()


def test_a_race_knows_its_noise():
    class Timed:
        """A call that says itself what it took, a little more every time."""

        def __init__(self, cost):
            self.cost, self.calls = cost, 0

        def __call__(self):
            return None

        def seconds(self, n):
            self.calls += 1
            return n * self.cost * (1 + 0.01 * (self.calls % 3))

    ours, theirs = race(
        *("image", "wait", "1", {"ours": Timed(2e-3), "theirs": Timed(6e-3)}, {}, "1"),
        knobs={"theirs": ("a curve", "6")},
        rounds=7,
        size=3.0,
    )
    assert theirs.ratio == pytest.approx(3.0)
    assert ours.ratio == 1
    assert 0 <= theirs.noise < 0.3
    assert (theirs.family, theirs.setting, theirs.size) == ("a curve", "6", 3.0)


def test_an_earlier_build_in_a_process_of_its_own(monkeypatch):
    # Any interpreter that imports pleinair is one; here this one stands in.
    monkeypatch.setenv("PLEINAIR_BASELINE", sys.executable)
    with Baseline("import numpy as np; x = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)") as old:
        both = old.both("pa.image.histogram(x)[0]")
        assert list(both) == ["pleinair", Baseline.name]
        assert all((call() == both["pleinair"]()).all() for call in both.values())
        assert both[Baseline.name].seconds(3) > 0
    monkeypatch.setenv("PLEINAIR_BASELINE", "/nowhere/python")
    with Baseline("x = 1") as none:
        assert not none.there
        assert list(none.both("x")) == ["pleinair"]


def test_rows_and_write_take_what_they_say(tmp_path):
    row = Row("aoas", "b", "c", "ours", 1e-3, float("nan"), "1", 1.0)
    write([row], tmp_path)
    assert textwrap.dedent((tmp_path / "aoas.md").read_text()).count("| ours |") == 1
    assert pa.report.machine() in (tmp_path / "README.md").read_text()


def test_targets_name_tasks_of_the_benches():
    """A target that no row has is held by nothing: each task's words stand in a bench."""
    targets = tomllib.loads((ROOT / "benches" / "TARGETS.toml").read_text())["target"]
    assert len(targets) > 30
    assert sum("headline" in t for t in targets) >= 10
    reported = {row["task"] for row in _rows()}
    for target in targets:
        assert ("ratio" in target) == ("rival" in target), target
        assert "ratio" in target or "error" in target, target
        assert target["task"] in reported, target["task"]


def _rows():

    with (ROOT / "docs" / "report" / "rows.csv").open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_stored_report_is_whole():
    folder = ROOT / "docs" / "report"
    first = (folder / "README.md").read_text()
    for page in re.findall(r"\]\((\w+\.md)\)", first):
        text = (folder / page).read_text()
        assert all((folder / name).exists() for name in re.findall(r"\]\((\w+\.png)\)", text)), page
    assert len(first.splitlines()) < 90, "one page"
    assert {row["room"] for row in _rows()} >= {"aoas", "realistic_sky", "corot", "inverse_clouds", "image", "color"}

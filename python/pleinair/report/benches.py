"""Running the benches of a checkout, and holding what they measure to targets and to the last report."""

from __future__ import annotations

import csv
import importlib.util
import math
import os
import re
import sys
import tomllib
import traceback
from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from .baseline import Baseline
from .pages import as_number, as_time, write
from .rounds import _PATIENCE, Row

__all__ = ["check", "run"]

#: A ratio may fall by this and by so many of its own standard errors [1].
_SLACK, _ERRORS = 0.05, 4.0


def _load(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        msg = f"cannot load {path}"
        raise ImportError(msg)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


def _targets(root: Path) -> list[dict[str, Any]]:
    path = root / "benches" / "TARGETS.toml"
    return tomllib.loads(path.read_text())["target"] if path.exists() else []


def _aim(row: Row, targets: Iterable[dict[str, Any]]) -> Row:
    """Hold a row to the targets that name it: `ratio` at least, `error` at most."""
    for target in targets:
        if row.task != target["task"] or target.get("input", row.input) != row.input:
            continue
        if "ratio" in target and row.method.startswith(target["rival"]):
            goal = float(target["ratio"])
            words = f"≥ {goal:.3g} ×" if goal >= 1 else f"≥ 1/{1 / goal:.3g}"
            row = replace(row, goal=words, met=row.ratio >= goal)
        ours = row.method.startswith(target.get("method", "pleinair")) and not row.method.startswith(Baseline.name)
        if "error" in target and ours:
            row = replace(row, goal=f"error ≤ {target['error']:g}", met=row.error <= target["error"])
    return row


def _measure(root: Path, only: str, quick: bool) -> tuple[list[Row], list[str]]:
    benches = sorted(root.glob("benches/bench_*.py"))
    if not benches:
        msg = f"no benches/bench_*.py below {root}: run this in a checkout of pleinair"
        raise FileNotFoundError(msg)
    targets = _targets(root)
    patience = dict(_PATIENCE)
    if quick:
        _PATIENCE.update(rounds=0.3, budget=0.15)
    rows: list[Row] = []
    failed: list[str] = []
    try:
        for path in benches:
            if only not in path.stem:
                continue
            try:
                bench = _load(path)
            except ModuleNotFoundError as lacking:
                print(f"{path.stem}: left out, there is no {lacking.name}", flush=True)
                continue
            if not hasattr(bench, "rows"):
                continue
            if quick and getattr(bench, "SLOW", False):
                print(f"{path.stem}: left out of a quick report", flush=True)
                continue
            try:
                for measured in bench.rows():
                    row = replace(_aim(measured, targets), bench=path.stem)
                    print(
                        f"{row.room:8} {row.task:34} {row.input:10} {row.method:28} {as_time(row.seconds):>9} "
                        f"{as_number(row.error):>8} {row.unit:6} {row.ratio:7.3g} {row.goal} "
                        f"{'' if row.met is None else 'met' if row.met else 'MISSED'}",
                        flush=True,
                    )
                    rows.append(row)
            except Exception:  # noqa: BLE001 (of a bench, whatever it is)
                # What the others took many minutes to measure is not lost.
                traceback.print_exc()
                failed.append(path.stem)
    finally:
        _PATIENCE.update(patience)
    return rows, failed


def run(root: str | os.PathLike[str] = ".", only: str = "", *, quick: bool = False) -> list[Row]:
    """Run the benches of a checkout and rewrite its ``docs/report/``.

    Parameters
    ----------
    root : path
        The checkout.
    only : str
        Run only the benches whose name contains this, and write nothing.
    quick : bool
        Fewer rounds, and without the benches that take minutes; writes nothing.

    Returns
    -------
    list of Row
        What was measured.

    Raises
    ------
    FileNotFoundError
        There are no benches below `root`.
    RuntimeError
        A bench failed; all that was measured is written.

    Examples
    --------
    >>> run("/nowhere")
    Traceback (most recent call last):
    FileNotFoundError: no benches/bench_*.py below /nowhere: run this in a checkout of pleinair
    """
    root = Path(root)
    rows, failed = _measure(root, only, quick)
    if not only and not quick:
        write(rows, root / "docs" / "report", _targets(root))
    if failed:
        msg = f"{', '.join(failed)} failed: what they had not measured yet is missing"
        raise RuntimeError(msg)
    return rows


def _key(row: Row) -> tuple[str, str, str, str]:
    """Name a row the same in every version of its rival."""
    return row.room, row.task, row.input, re.sub(r" \d+(\.\d+)+\S*", "", row.method)


def _stored(path: Path) -> list[Row]:
    kinds = {f.name: f.type for f in fields(Row) if f.name != "met"}

    def read(line: dict[str, str]) -> Row:
        values: dict[str, Any] = {k: float(v) if kinds[k] == "float" else v for k, v in line.items() if k in kinds}
        return Row(**values)

    with path.open(newline="") as stream:
        return [read(line) for line in csv.DictReader(stream)]


def check(root: str | os.PathLike[str] = ".", only: str = "", *, quick: bool = False) -> list[str]:
    """Measure again, and say which ratios have fallen below the last report's beyond their noise.

    A ratio is that of a rival's time to ours, so another machine counts as far as it changes both alike. What has fallen is measured a
    second time before it counts.

    Parameters
    ----------
    root : path
        The checkout, with its ``docs/report/rows.csv``.
    only : str
        Only the benches whose name contains this.
    quick : bool
        As for `run`.

    Returns
    -------
    list of str
        A line for each that has fallen.

    Raises
    ------
    FileNotFoundError
        There are no benches, or no report, below `root`.

    Examples
    --------
    >>> check("/nowhere")
    Traceback (most recent call last):
    FileNotFoundError: no docs/report/rows.csv below /nowhere: `pleinair report` writes it
    """
    root = Path(root)
    stored = root / "docs" / "report" / "rows.csv"
    if not stored.exists():
        msg = f"no docs/report/rows.csv below {root}: `pleinair report` writes it"
        raise FileNotFoundError(msg)
    before = {_key(row): row for row in _stored(stored)}

    def fallen(rows: Iterable[Row]) -> dict[tuple[str, str, str, str], str]:
        found = {}
        for row in rows:
            old = before.get(_key(row))
            if old is None or row.ratio == 1.0 or not (math.isfinite(row.ratio) and math.isfinite(old.ratio)):
                continue
            noise = [x if math.isfinite(x) else 0.0 for x in (row.noise, old.noise)]
            slack = _SLACK + _ERRORS * math.hypot(*noise)
            if row.ratio < old.ratio * (1 - slack):
                line = f"{row.task}, {row.input}, against {row.method}: {row.ratio:.3g}, was {old.ratio:.3g} (± {slack:.0%})"
                found[_key(row)] = line
        return found

    rows, _ = _measure(root, only, quick)
    first = fallen(rows)
    if not first:
        return []
    again = {row.bench for row in rows if _key(row) in first}
    second = fallen([row for bench in sorted(again) for row in _measure(root, bench, quick)[0]])
    return [line for key, line in second.items() if key in first]

"""Speed against error: race contenders in one process on one input, and write the table.

The benches of a checkout (`benches/bench_*.py`) each offer ``rows() -> Iterable[Row]``; ``pleinair report`` runs them
and rewrites ``docs/speed_vs_error.{md,csv,png}``. A contender's answer is checked before it is timed; times are CPU
seconds of one thread unless a row says otherwise, medians over interleaved rounds; a ratio is the rival's time over
ours in the same rounds.
"""

from __future__ import annotations

import csv
import gc
import importlib.util
import math
import os
import platform
import statistics
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from ._core import simd_level

__all__ = ["Row", "machine", "race", "run", "write"]


@dataclass(frozen=True)
class Row:
    """One contender on one input.

    Attributes
    ----------
    room, task, input, method : str
        What was measured, on what, and who did it.
    seconds : float
        Median CPU time of a call [s].
    error : float
        Distance from the truth, in `unit`.
    unit : str
        Unit of the error.
    ratio : float
        Time over pleinair's in the same rounds [1].
    goal : str
        What the project set itself.
    met : bool or None
        Whether it is reached; None without a goal.
    """

    room: str
    task: str
    input: str
    method: str
    seconds: float
    error: float
    unit: str
    ratio: float
    goal: str = ""
    met: bool | None = None


def race(
    room: str,
    task: str,
    input: str,
    contenders: Mapping[str, Callable[[], Any]],
    errors: Mapping[str, float],
    unit: str,
    *,
    goals: Mapping[str, float] | None = None,
    rounds: int = 15,
    budget: float = 4.0,
    clock: Callable[[], float] = time.process_time,
) -> list[Row]:
    """Time `contenders` against each other, the first being ours.

    Parameters
    ----------
    room, task, input : str
        What is measured, on what.
    contenders : mapping of str to callable
        Calls without arguments; the first is pleinair.
    errors : mapping of str to float
        Error of each contender [unit], measured by the caller before timing (NaN: cannot be compared).
    unit : str
        Unit of the errors.
    goals : mapping of str to float, optional
        Smallest ratio [1] wanted over each rival.
    rounds : int
        Interleaved rounds; the median of each contender's times is reported [1].
    budget : float
        Wall time after which no further round is begun [s].
    clock : callable
        `time.perf_counter` for wall time, where threads are part of what is measured [s].

    Returns
    -------
    list of Row
        One row for each contender.

    Examples
    --------
    >>> rows = race("demo", "sum", "1e3", {"ours": lambda: sum(range(1000))}, {"ours": 0.0}, "1", rounds=3)
    >>> rows[0].ratio
    1.0
    """
    goals = goals or {}
    repeats: dict[str, int] = {}
    for name, call in contenders.items():
        call()
        start = clock()
        call()
        once = max(clock() - start, 1e-7)
        repeats[name] = max(1, min(1000, math.ceil(2e-3 / once)))
    times: dict[str, list[float]] = {name: [] for name in contenders}
    end = time.monotonic() + budget
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        for round_ in range(rounds):
            if round_ >= 3 and time.monotonic() > end:
                break
            for name, call in contenders.items():
                n = repeats[name]
                start = clock()
                for _ in range(n):
                    call()
                times[name].append((clock() - start) / n)
    finally:
        if was_enabled:
            gc.enable()
    ours = next(iter(contenders))
    mine = statistics.median(times[ours])
    rows = []
    for name in contenders:
        seconds = statistics.median(times[name])
        # Ratios within a round: both sides saw the same machine.
        ratio = statistics.median(t / m for t, m in zip(times[name], times[ours], strict=True) if m > 0)
        goal = goals.get(name)
        rows.append(
            Row(
                room=room,
                task=task,
                input=input,
                method=name,
                seconds=seconds if name != ours else mine,
                error=float(errors.get(name, math.nan)),
                unit=unit,
                ratio=1.0 if name == ours else ratio,
                goal="" if goal is None else f"≥ {goal:.3g}×",
                met=None if goal is None else ratio >= goal,
            )
        )
    return rows


def _load(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        msg = f"cannot load {path}"
        raise ImportError(msg)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


def _number(x: float) -> str:
    return "–" if math.isnan(x) else "0" if x == 0 else f"{x:.2g}"


def _time(seconds: float) -> str:
    if math.isnan(seconds):
        return "–"
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds:.3g} s"


def machine() -> str:
    """Return one line about this machine.

    Examples
    --------
    >>> "Python" in machine()
    True
    """
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    return f"{model}, {os.cpu_count()} cores, {simd_level()}, Python {platform.python_version()}"


def write(rows: Iterable[Row], folder: str | os.PathLike[str]) -> None:
    """Write ``speed_vs_error.{md,csv,png}`` into `folder`.

    Parameters
    ----------
    rows : iterable of Row
        What was measured.
    folder : path
        Where the three files go; each is written beside its place and renamed.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write([Row("a", "b", "c", "ours", 1e-3, 0.0, "1", 1.0)], folder)
    ...     sorted(p.suffix for p in pathlib.Path(folder).iterdir())
    ['.csv', '.md', '.png']
    """
    table = list(rows)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    text = [
        "# Speed against error",
        "",
        "Written by `make report`; do not edit. Median CPU time of one call on one thread unless a row says otherwise,",
        "contenders interleaved in one process on the same input. *ratio* is the rival's time over ours in the same",
        "rounds; *error* is against the truth named in the bench.",
        "",
        f"Machine: {machine()}.",
    ]
    for room in dict.fromkeys(row.room for row in table):
        text += [
            "",
            f"## {room}",
            "",
            "| task | input | method | time | error | ratio | goal |",
            "|---|---|---|--:|--:|--:|---|",
        ]
        for row in table:
            if row.room == room:
                mark = "" if row.met is None else " met" if row.met else " **missed**"
                unit = "" if row.unit == "1" else f" {row.unit}"
                error = f"{_number(row.error)}{unit}" if not math.isnan(row.error) else "–"
                text.append(
                    f"| {row.task} | {row.input} | {row.method} | {_time(row.seconds)} | {error} "
                    f"| {_number(row.ratio) if math.isnan(row.ratio) else format(row.ratio, '.3g')} | {row.goal}{mark} |"
                )
    _replace(folder / "speed_vs_error.md", ("\n".join(text) + "\n").encode())
    temporary = folder / ".speed_vs_error.csv.part"
    with temporary.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, [f.name for f in fields(Row)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in table)
    temporary.replace(folder / "speed_vs_error.csv")
    _plot(table, folder / "speed_vs_error.png")


def _replace(path: Path, data: bytes) -> None:
    temporary = path.with_name(f".{path.name}.part")
    temporary.write_bytes(data)
    temporary.replace(path)


def _plot(rows: list[Row], path: Path) -> None:
    import matplotlib as mpl

    mpl.use("Agg", force=False)
    import matplotlib.pyplot as plt
    from matplotlib.ticker import NullFormatter

    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.room, row.task, row.input), []).append(row)
    # Where nobody errs there is nothing to plot against.
    timed = {key: [r for r in members if r.seconds > 0] for key, members in groups.items()}
    groups = {key: members for key, members in timed.items() if any(r.error > 0 for r in members)}
    columns = 4
    height = max(1, math.ceil(len(groups) / columns))
    figure, axes = plt.subplots(height, columns, figsize=(4.6 * columns, 3.0 * height), squeeze=False)
    for axis in axes.flat:
        axis.set_visible(False)
    for axis, ((room, task, input_), members) in zip(axes.flat, groups.items(), strict=False):
        axis.set_visible(True)
        axis.set_xscale("log")
        axis.set_yscale("log")
        floor = min((r.error for r in members if r.error > 0), default=1e-8) / 10
        for k, row in enumerate(members):
            # Names above and below in turn: neighbours often lie close together.
            shift = (4, 5) if k % 2 == 0 else (4, -9)
            error = floor if not row.error > 0 else row.error
            axis.scatter(row.seconds, error, s=60 if k == 0 else 30, marker="*" if k == 0 else "o", zorder=3)
            axis.annotate(row.method, (row.seconds, error), fontsize=7, xytext=shift, textcoords="offset points")
        axis.set_title(textwrap.fill(f"{room}: {task}, {input_}", 56), fontsize=8)
        axis.tick_params(labelsize=7)
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.grid(alpha=0.3)
        errors = [floor if not r.error > 0 else r.error for r in members]
        axis.set_ylim(min(errors) / 5, max(errors) * 5)
        axis.set_xlim(min(r.seconds for r in members) / 2, max(r.seconds for r in members) * 12)
    figure.supxlabel("CPU time of a call [s]", fontsize=8)
    figure.supylabel("error (at the lower edge: none or not comparable)", fontsize=8)
    figure.tight_layout()
    temporary = path.with_name(f".{path.stem}.part.png")
    figure.savefig(temporary, dpi=90)
    plt.close(figure)
    temporary.replace(path)


def run(root: str | os.PathLike[str] = ".", only: str = "") -> list[Row]:
    """Run the benches of a checkout and rewrite its ``docs/speed_vs_error.*``.

    Parameters
    ----------
    root : path
        The checkout.
    only : str
        Run only the benches whose name contains this, and write nothing.

    Returns
    -------
    list of Row
        What was measured.

    Raises
    ------
    FileNotFoundError
        There are no benches below `root`.

    Examples
    --------
    >>> run("/nowhere")
    Traceback (most recent call last):
    FileNotFoundError: no benches/bench_*.py below /nowhere: run this in a checkout of pleinair
    """
    benches = sorted(Path(root).glob("benches/bench_*.py"))
    if not benches:
        msg = f"no benches/bench_*.py below {root}: run this in a checkout of pleinair"
        raise FileNotFoundError(msg)
    rows: list[Row] = []
    for path in benches:
        if only in path.stem:
            for row in _load(path).rows():
                print(
                    f"{row.room:8} {row.task:34} {row.input:10} {row.method:28} {_time(row.seconds):>9} "
                    f"{_number(row.error):>8} {row.unit:6} {row.ratio:7.3g} {row.goal} "
                    f"{'' if row.met is None else 'met' if row.met else 'MISSED'}",
                    flush=True,
                )
                rows.append(row)
    if not only:
        write(rows, Path(root) / "docs")
    return rows

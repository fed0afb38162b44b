"""A race: contenders take turns on one input, each against ours in the same round."""

from __future__ import annotations

import gc
import math
import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .._core import simd_level

__all__ = ["Row", "machine", "race"]


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
    noise : float
        Standard error of the ratio over the rounds, relative [1].
    family, setting : str
        Where a method has a knob: the curve that the row is a point of, and where the knob stands.
    size : float
        Where the cost of an input grows: how large it is, in `size_unit` [1].
    size_unit : str
        Of `size`: pixels, voxels, strokes.
    memory : float
        Peak memory beyond what was there before the call; NaN where it was not measured [byte].
    floor : float
        Error of the truth itself; NaN where it is exact [unit].
    bench : str
        Which file of benches/ measured it.
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
    noise: float = math.nan
    family: str = ""
    setting: str = ""
    size: float = math.nan
    size_unit: str = ""
    memory: float = math.nan
    floor: float = math.nan
    bench: str = ""


#: How many rounds and how much time `race` may take: `pleinair report --quick` takes less.
_PATIENCE = {"rounds": 1.0, "budget": 1.0}


def race(
    room: str,
    task: str,
    input: str,
    contenders: Mapping[str, Callable[[], Any]],
    errors: Mapping[str, float],
    unit: str,
    *,
    knobs: Mapping[str, tuple[str, str]] | None = None,
    rounds: int = 15,
    budget: float = 4.0,
    clock: Callable[[], float] = time.process_time,
    **given: Any,
) -> list[Row]:
    """Time `contenders` against each other, the first being ours.

    Parameters
    ----------
    room, task, input : str
        What is measured, on what.
    contenders : mapping of str to callable
        Calls without arguments; the first is pleinair. One that has a method ``seconds(n)`` times n calls itself, as
        `Baseline` does in its own process.
    errors : mapping of str to float
        Error of each contender [unit], measured by the caller before timing (NaN: cannot be compared).
    unit : str
        Unit of the errors.
    knobs : mapping of str to (str, str), optional
        Of contenders that are points of a curve: its name, and where the knob stands.
    rounds : int
        Interleaved rounds; the median of each contender's times is reported [1].
    budget : float
        Wall time after which no further round is begun [s].
    clock : callable
        `time.perf_counter` for wall time, where threads are part of what is measured [s].
    given : Any
        Further attributes of the rows, as `Row.size`.

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
    rounds = max(3, round(rounds * _PATIENCE["rounds"])) if rounds > 1 else rounds
    end = time.monotonic() + budget * _PATIENCE["budget"]

    def spent(call: Callable[[], Any], n: int) -> float:
        own = getattr(call, "seconds", None)
        if own is not None:
            return float(own(n))
        start = clock()
        for _ in range(n):
            call()
        return clock() - start

    repeats: dict[str, int] = {}
    for name, call in contenders.items():
        call()
        repeats[name] = max(1, min(1000, math.ceil(2e-3 / max(spent(call, 1), 1e-7))))
    times: dict[str, list[float]] = {name: [] for name in contenders}
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        for round_ in range(rounds):
            if round_ >= 3 and time.monotonic() > end:
                break
            for name, call in contenders.items():
                times[name].append(spent(call, repeats[name]) / repeats[name])
    finally:
        if was_enabled:
            gc.enable()
    ours = next(iter(contenders))
    rows = []
    for name in contenders:
        # Ratios within a round: both sides saw the same machine.
        ratios = [t / m for t, m in zip(times[name], times[ours], strict=True) if m > 0] or [math.nan]
        ratio = 1.0 if name == ours else statistics.median(ratios)
        family, setting = (knobs or {}).get(name, ("", ""))
        row = Row(
            room, task, input, name, statistics.median(times[name]), float(errors.get(name, math.nan)), unit, ratio
        )
        rows.append(replace(row, noise=_noise(ratios), family=family, setting=setting, **given))
    return rows


def _noise(ratios: list[float]) -> float:
    """Relative standard error of a median, from the middle half of the values."""
    if len(ratios) < 3:
        return math.nan
    low, middle, high = statistics.quantiles(ratios, n=4)
    return 0.93 * (high - low) / math.sqrt(len(ratios)) / middle if middle > 0 else math.nan


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

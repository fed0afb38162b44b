"""One search among several models of which only one can be right: Suns, and heights of the air."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._core import CloudObjective, Search
from .optimise import Settings

Row = tuple[float, float, int]


@dataclass(eq=False)
class Entrant:
    """A model in the race: its objective and its search."""

    core: CloudObjective
    search: Search
    ended: bool = False
    best: float = math.inf
    calls: int = 0
    rows: list[Row] = field(default_factory=list)


def lap(entrants: int) -> float:
    """Return the calls of the whole race over those of the winner."""
    total, before, running = 0.0, 0.0, entrants
    halvings = math.ceil(math.log2(entrants))
    for r in range(halvings + 1):
        milestone = 2.0 ** (r - halvings)
        total += running * (milestone - before)
        before, running = milestone, math.ceil(running / 2)
    return total


def race(
    cores: list[CloudObjective],
    told: Callable[[int], Settings],
    generations: int,
    progress: Callable[[int, int], object] | None,
) -> tuple[list[Entrant], list[Row]]:
    """Run searches side by side and drop the worse half each time the calls of the others have doubled.

    The searches are not begun anew: the winner's is as long, undisturbed, as the calls allow. `told(generations)`
    returns the settings of one search. Returns the entrants and the history of the race.
    """
    longest = max(1, round(generations / lap(len(cores))))
    settings = [told(longest) for _ in cores]
    entrants = [Entrant(core, Search(s)) for core, s in zip(cores, settings, strict=True)]
    size, target = settings[0].population, settings[0].target
    total = size * generations
    halvings = math.ceil(math.log2(len(cores)))
    running, history = list(entrants), list[Row]()
    calls, best = 0, math.inf
    for r in range(halvings + 1):
        milestone = size * longest * 2.0 ** (r - halvings)
        for entrant in running:
            while not entrant.ended and entrant.calls < milestone and best > target:
                asked = [tuple(x) for x in entrant.search.ask()]
                values = entrant.core.evaluate(asked).reshape(-1, 4)[:, 0]
                entrant.ended = entrant.search.tell(values.tolist())
                entrant.calls += len(asked)
                calls += len(asked)
                finite = values[np.isfinite(values)]
                if finite.size:
                    entrant.best = min(entrant.best, float(finite.min()))
                best = min(best, entrant.best)
                history.append((best, float(finite.mean()) if finite.size else math.nan, calls))
                if progress is not None:
                    progress(min(calls, total), total)
        running = sorted(running, key=lambda e: e.best)[: math.ceil(len(running) / 2)]
    return entrants, history


def outcome(entrants: list[Entrant]) -> tuple[Entrant, list[tuple[int, list[float], float]], str]:
    """Return the winner, everything ranked with the number of its entrant, best first, and why the winner stopped."""
    winner = min(entrants, key=lambda e: e.best)
    ranked: list[tuple[int, list[float], float]] = []
    for i, entrant in enumerate(entrants):
        ranked += [(i, x, value) for x, value in entrant.search.outcome()[0]]
    stopped: Any = winner.search.outcome()[2]
    # A race that was over before the winner's search: every call is spent.
    return winner, sorted(ranked, key=lambda x: x[2]), "generations" if stopped == "running" else stopped

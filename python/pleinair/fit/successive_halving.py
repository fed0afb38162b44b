"""Successive halving: one search among several models of which only one can be right (Suns, heights of the air).

A bandit of a fixed budget (Karnin et al. 2013, Jamieson and Talwalkar 2016): every arm is a search of its own, and the
worse half is dropped each time the calls of the others have doubled.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._core import CloudObjective, Search
from .optimise import SearchSettings

Row = tuple[float, float, int]


@dataclass(eq=False)
class Arm:
    """A model, its objective and its search."""

    core: CloudObjective
    search: Search
    ended: bool = False
    best: float = math.inf
    calls: int = 0
    rows: list[Row] = field(default_factory=list)


def total_budget(arms: int) -> float:
    """Return the calls of all arms over those of the winner."""
    total, before, running = 0.0, 0.0, arms
    halvings = math.ceil(math.log2(arms))
    for r in range(halvings + 1):
        milestone = 2.0 ** (r - halvings)
        total += running * (milestone - before)
        before, running = milestone, math.ceil(running / 2)
    return total


def successive_halving(
    cores: list[CloudObjective],
    settings_for: Callable[[int], SearchSettings],
    generations: int,
    progress: Callable[[int, int], object] | None,
) -> tuple[list[Arm], list[Row]]:
    """Run searches side by side and drop the worse half each time the calls of the others have doubled.

    The searches are not begun anew: the winner's is as long, undisturbed, as the calls allow. `settings_for(generations)`
    returns the settings of one search. Returns the arms and the history of all.
    """
    longest = max(1, round(generations / total_budget(len(cores))))
    settings = [settings_for(longest) for _ in cores]
    arms = [Arm(core, Search(s)) for core, s in zip(cores, settings, strict=True)]
    size, target = settings[0].population, settings[0].target
    total = size * generations
    halvings = math.ceil(math.log2(len(cores)))
    running, history = list(arms), list[Row]()
    calls, best = 0, math.inf
    for r in range(halvings + 1):
        milestone = size * longest * 2.0 ** (r - halvings)
        for arm in running:
            while not arm.ended and arm.calls < milestone and best > target:
                asked = [tuple(x) for x in arm.search.ask()]
                values = arm.core.evaluate(asked).reshape(-1, 4)[:, 0]
                arm.ended = arm.search.tell(values.tolist())
                arm.calls += len(asked)
                calls += len(asked)
                finite = values[np.isfinite(values)]
                if finite.size:
                    arm.best = min(arm.best, float(finite.min()))
                best = min(best, arm.best)
                history.append((best, float(finite.mean()) if finite.size else math.nan, calls))
                if progress is not None:
                    progress(min(calls, total), total)
        running = sorted(running, key=lambda e: e.best)[: math.ceil(len(running) / 2)]
    return arms, history


def outcome(arms: list[Arm]) -> tuple[Arm, list[tuple[int, list[float], float]], str]:
    """Return the winner, everything ranked with the number of its arm, best first, and why the winner stopped."""
    winner = min(arms, key=lambda e: e.best)
    ranked: list[tuple[int, list[float], float]] = []
    for i, arm in enumerate(arms):
        ranked += [(i, x, value) for x, value in arm.search.outcome()[0]]
    stopped: Any = winner.search.outcome()[2]
    # Halvings that were over before the winner's search: every call is spent.
    return winner, sorted(ranked, key=lambda x: x[2]), "generations" if stopped == "running" else stopped

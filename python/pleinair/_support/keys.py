"""Values between key frames: which two keys a time lies between, and numbers that go evenly from one to the next."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .inputs import real


def between(times: Sequence[float], time: float) -> tuple[int, int, float, float]:
    """Return the keys before and after a time, how long it is since the first, and how long the second is after it.

    Before the first key and after the last one both are that key: nothing moves there.
    """
    after = bisect_right(times, time)
    if after in (0, len(times)):
        end = max(after - 1, 0)
        return end, end, 0.0, 1.0
    return after - 1, after, time - times[after - 1], times[after] - times[after - 1]


def ascending(keys: Mapping[Any, Any], name: str) -> dict[float, Any]:
    """Return keys by their times in [0, 1], the first one first."""
    if not keys:
        msg = f"{name} must have at least one key"
        raise ValueError(msg)
    return dict(sorted((real(t, f"{name}'s time", 0, 1), value) for t, value in keys.items()))


@dataclass(frozen=True)
class LinearKeys:
    """Rows of numbers by their times; called with a time, the row there."""

    keys: dict[float, tuple[float, ...]]

    def __call__(self, t: float) -> tuple[float, ...]:
        a, b, since, span = between(tuple(self.keys), t)
        first, second = (list(self.keys.values())[k] for k in (a, b))
        return tuple(float((y - x) / span * since + x) for x, y in zip(first, second, strict=True))

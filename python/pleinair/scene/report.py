"""Diagnostics of a frame: the shader's stages as pictures, which strokes are visible, what each layer cost and why.

While a frame is explained each layer tells its own time, without that of the layers within it, and whether something was
computed or kept from another frame. Elsewhere telling costs nothing.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..paint import Canvas, Shading, Strokes
from .parts import Part


@dataclass(frozen=True, eq=False)
class Layer:
    """What one part of a scene does to a picture.

    Attributes
    ----------
    radiance : ndarray (height, width, 3) of float32
        What it adds [unit of the sky].
    transmittance : ndarray (height, width) of float32
        What it lets through of all behind it [1].
    depth : ndarray (height, width) of float32
        How far away it is, infinite where it is not [m].
    """

    radiance: NDArray[np.float32]
    transmittance: NDArray[np.float32]
    depth: NDArray[np.float32]


@dataclass
class Account:
    """What the layers of one frame cost: milliseconds of each, and how often it computed something or found it kept."""

    seconds: dict[str, float] = field(default_factory=dict)
    computed: dict[str, int] = field(default_factory=dict)
    kept: dict[str, int] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)
    _since: float = 0.0

    def turn(self) -> None:
        """Give the time since the last turn to the innermost layer."""
        now = time.perf_counter()
        if self._open:
            name = self._open[-1]
            self.seconds[name] = self.seconds.get(name, 0.0) + now - self._since
        self._since = now


_account: ContextVar[Account | None] = ContextVar("account", default=None)


@contextmanager
def accounted(account: Account) -> Iterator[None]:
    """Let layers tell an account."""
    before = _account.set(account)
    try:
        yield
    finally:
        _account.reset(before)


@contextmanager
def layer(name: str) -> Iterator[None]:
    """Work on a layer."""
    account = _account.get()
    if account is None:
        yield
        return
    account.turn()
    account._open.append(name)
    try:
        yield
    finally:
        account.turn()
        account._open.pop()


def tell(name: str, computed: bool) -> None:
    """Say that something of a layer was computed, or kept from before."""
    account = _account.get()
    if account is not None:
        counts = account.computed if computed else account.kept
        counts[name] = counts.get(name, 0) + 1


# Largest relative error of each layer [1], as the tests named in docs/scene_light.md hold it; 0 of what is exact.
_ERRORS = {
    "sky": 0.01,
    "clouds": 0.01,
    "plain": 0.0,
    "sky strokes": 0.0,
    "shadows of strokes": 0.02,
    "shadows of clouds": 0.01,
    "strokes": 0.012,
    "water": 0.02,
    "air": 0.01,
    "eye": 0.0,
}


def layer_rows(account: Account, why: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return a row for each layer; `why` has the reasons of those that are not in the frame."""
    rows = []
    for name, error in _ERRORS.items():
        row: dict[str, Any] = {"layer": name}
        if name not in account.seconds or name in why:
            rows.append(row | {"state": "skipped", "why": why.get(name, "nothing in the frame needs it"),
                               "milliseconds": 0.0, "error": 0.0})  # fmt: skip
            continue
        made, kept = account.computed.get(name, 0), account.kept.get(name, 0)
        state = "kept" if kept and not made else "computed"
        reason = f"{made} computed, {kept} kept from another frame" if made + kept else "made for each frame"
        rows.append(row | {"state": state, "why": reason, "milliseconds": 1e3 * account.seconds[name], "error": error})
    return rows


_STAGES = ("lightness", "placed", "shadow", "final", "palette", "distance")


def stage_pictures(
    shaded: list[Shading], canvas: Canvas | None, shape: tuple[int, int]
) -> dict[str, NDArray[np.float32]]:
    """Return each step of the shader as a picture: each pixel shows its most visible stroke."""
    if canvas is None or canvas.index is None or canvas.depth is None:
        out = {name: np.full(shape, np.nan, np.float32) for name in _STAGES}
        return out | {"mask": np.zeros(shape, np.float32), "depth": np.full(shape, np.inf, np.float32)}
    nothing = np.float32(np.nan)  # which is what an index of -1 finds
    columns = {name: np.append(np.concatenate([getattr(one, name) for one in shaded]), nothing) for name in _STAGES}
    out = {name: column[canvas.index] for name, column in columns.items()}
    return out | {"mask": 1 - canvas.transmittance, "depth": canvas.depth}


def visibility_report(parts: Mapping[Part, Strokes], camera: Camera) -> tuple[list[dict[str, Any]], list[str]]:
    """Return how many strokes of each part are before the eye, and which are not."""
    forward = camera._axes()[2]
    rows: list[dict[str, Any]] = []
    left = [] if parts else ["there are no objects: the picture is the sky"]
    for part, strokes in parts.items():
        before = int(((strokes.position - np.array(camera.position)) @ forward > 0).sum())
        row = {"name": part.name, "kind": part.kind, "strokes": len(strokes), "before the eye": before}
        rows.append(row | {"casts": part.casts})
        if before < len(strokes):
            left.append(f"{part.name}, {part.kind}: {len(strokes) - before} strokes behind the eye")
    return rows, left

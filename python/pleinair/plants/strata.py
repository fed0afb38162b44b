"""Stratified sampling of strokes on a surface (corot, Fig. 24). Public as `pleinair.plants`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .._support.inputs import integer, real, several
from .._support.schema import JsonFields
from .tree_params import size_of


@dataclass(frozen=True)
class Strata(JsonFields):
    """How strokes are scattered on a surface (Fig. 24, whose numbers are the defaults).

    Parameters
    ----------
    spans : (int, int)
        Cells along u and v, each in [1, 1000000] [1].
    count : int
        Particles of a cell, in [1, 1000000] [1].
    displacement : float
        Largest way along the normal, up or down [unit].
    fade_from : float
        Height, in [0, 1] [1], above which a particle is detail and may fade with distance; lower ones never do.
    fade_length : float
        Longest distance over which a detail fades, in [0, 1] [1].
    fade_min : float
        Shortest such distance, in [0, 1] [1].
    unit : float
        Metres of one unit, in [1e-6, 1e6] [m].
    size : float or (float, float)
        Width and height of a particle [unit].
    variance : float
        Deviation of the size as a share of it, in [0, 1] [1].
    inside_growth : float
        Growth of the deepest over the highest particle as a share, in [-0.9, 100] [1].

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> Strata(spans=(20, 10), size=(0.1, 0.4)).count
    5
    """

    spans: Any = (5, 5)
    count: int = 5
    displacement: float = 0.1
    fade_from: float = 0.6
    fade_length: float = 0.2
    fade_min: float = 0.1
    unit: float = 1.0
    size: Any = (1.0, 1.0)
    variance: float = 0.0
    inside_growth: float = 0.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        spans = several(self.spans, "spans")
        if len(spans) != 2:
            msg = f"spans must be two integers, got {self.spans!r}"
            raise ValueError(msg)
        put(self, "spans", tuple(integer(n, "spans", 1, 1_000_000) for n in spans))
        put(self, "count", integer(self.count, "count", 1, 1_000_000))
        put(self, "displacement", real(self.displacement, "displacement", 0, 1e9, "unit"))
        for name in ("fade_from", "fade_length", "fade_min", "variance"):
            put(self, name, real(getattr(self, name), name, 0, 1))
        put(self, "unit", real(self.unit, "unit", 1e-6, 1e6, "m"))
        put(self, "size", size_of(self.size, "size", "unit"))
        put(self, "inside_growth", real(self.inside_growth, "inside_growth", -0.9, 100))

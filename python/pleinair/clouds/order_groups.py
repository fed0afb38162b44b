"""Orders of multiple scattering, and the settings of the path tracer that estimates them.

Which orders are gathered into one image; next-event estimation, Russian roulette and splitting are in
src/clouds/multiple.rs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import integer

EXPONENTS = (2, 3, 4, 6, 9, 14, 24, 45, 90, 220, 600)
"""Powers of the albedo that stand for the orders from 2 on; the last for all beyond it too."""

OrderWeights = tuple[tuple[int, float], tuple[int, float], tuple[int, float], tuple[int, float]]


@dataclass(frozen=True)
class PathSettings:
    """Settings of the path tracer for the orders from 2 on."""

    g: list[float]
    sigma: list[float]
    groups: int
    order_weights: list[OrderWeights]
    unbounded_orders: bool
    albedo: float
    samples: int
    key: int


def checked(orders: int | None) -> int | None:
    """Return the number of orders, None for all."""
    return None if orders is None else integer(orders, "orders", 1, 100_000)


def together(orders: int | None) -> list[OrderWeights]:
    """Return weights that add up all orders from 2 on."""
    one: OrderWeights = ((0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0))
    return [one] * (1 if orders is None else orders - 1)


@lru_cache(maxsize=2048)
def _least_squares(powers: tuple[int, ...], order: int) -> NDArray[np.float64]:
    # Weights of four powers that come closest to albedo^order over all albedos and are exact at albedo 1.
    albedo = np.exp(-np.geomspace(1e-5, 3, 400))
    a = albedo[:, None] ** np.array(powers, float)
    w = np.linalg.lstsq(a[:, :-1] - a[:, -1:], albedo**order - a[:, -1], rcond=None)[0]
    return np.append(w, 1 - w.sum())


def grouped(orders: int | None) -> tuple[list[float], list[OrderWeights]]:
    """Return the powers of the albedo that are kept, and how orders 2, 3, ... are shared out among them.

    Orders up to 4, and all powers kept, are exact. Others are mixtures of the four nearest powers: exact at albedo 1,
    within 0.3 % of 1 below order 60 and 1.5 % at any, for every albedo.
    """
    last = EXPONENTS[-1] if orders is None else orders
    powers = [e for e in EXPONENTS if e < last] + [last]
    order_weights: list[OrderWeights] = []
    for order in range(2, last + 1):
        if order in powers:
            first, weights = powers.index(order), np.array([1.0])
        else:
            above = int(np.searchsorted(powers, order))
            first = max(0, min(above - 2, len(powers) - 4))
            weights = _least_squares(tuple(powers[first : first + 4]), order)
        pairs = [(first + i, float(w)) for i, w in enumerate(weights)] + [(0, 0.0)] * (4 - len(weights))
        order_weights.append((pairs[0], pairs[1], pairs[2], pairs[3]))
    return [float(e) for e in powers], order_weights

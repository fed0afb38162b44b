"""The mean of a pixel's neighbourhood."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def blurred(values: NDArray[Any]) -> NDArray[Any]:
    """Return the mean of each pixel and its eight neighbours; the border repeats."""
    wide = np.pad(values, ((1, 1), (1, 1), *[(0, 0)] * (values.ndim - 2)), mode="edge")
    rows = wide[:-2] + wide[1:-1] + wide[2:]
    out: NDArray[Any] = (rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / 9
    return out

"""One way to run an element-wise kernel of the core: input checked, output allocated or checked, both handed over."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .inputs import Array, color_values, shape_text


def apply_kernel(
    kernel: Callable[..., None],
    value: ArrayLike,
    name: str,
    out: Any,
    *args: Any,
    last: int | None = 3,
    drop: bool = False,
    meaning: str = "coordinates",
) -> Array:
    """Run `kernel` from `value` into `out` or a new array; `drop`: the result has no last axis."""
    x = color_values(value, name, meaning, last)
    shape = x.shape[:-1] if drop else x.shape
    if out is None:
        result = np.empty(shape, x.dtype)
    else:
        if not isinstance(out, np.ndarray):
            msg = f"out must be a numpy array, got {type(out).__name__}"
            raise TypeError(msg)
        if out.shape != shape or out.dtype != x.dtype:
            msg = (
                f"out must have shape {shape_text(shape)} and dtype {x.dtype}, "
                f"got shape {shape_text(out.shape)} and dtype {out.dtype}"
            )
            raise ValueError(msg)
        if not (out.flags.c_contiguous and out.flags.writeable and out.flags.aligned):
            msg = "out must be C-contiguous, aligned and writable"
            raise ValueError(msg)
        result = out
        if np.may_share_memory(x, result):
            x = x.copy()
    # A subclass is written through its plain view.
    kernel(x, np.asarray(result), *args)
    return result

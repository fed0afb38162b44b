# Written by hand and checked against the built module by `mypy.stubtest` (make check).
# Users see the typed modules beside this file; arrays arrive here contiguous and of the right dtype.
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Progress: TypeAlias = Callable[[int, int], object] | None

# house
def simd_levels() -> list[str]: ...
def simd_level() -> str: ...
def force_simd_level(level: str | None) -> None: ...
def build_info() -> list[tuple[str, str]]: ...
def get_num_threads() -> int: ...
def set_num_threads(threads: int | None) -> None: ...
def _spin(steps: int, milliseconds: int, progress: Progress = None) -> int: ...

# color

# image
_Pixels: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32] | NDArray[np.float64]
_Counts: TypeAlias = NDArray[np.uint64]

def histogram_counts(
    img: _Pixels, channels: int, bins: int, low: float, high: float, mask: NDArray[np.bool_] | None
) -> tuple[_Counts, _Counts, _Counts, _Counts]: ...
def otsu_threshold(img: _Pixels, mask: NDArray[np.bool_] | None, nbins: int | None) -> tuple[float, float]: ...
def laplace_fill(
    img: _Pixels,
    shape: tuple[int, int, int],
    mask: NDArray[np.bool_],
    outside: list[float] | None,
    tolerance: float,
) -> NDArray[Any]: ...
def ground_mask(photo: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.bool_]: ...
def classify_sky(
    photo: NDArray[np.float32], shape: tuple[int, int], ground: NDArray[np.bool_], method: str, prior: float
) -> tuple[NDArray[np.bool_], NDArray[np.float32], float, float, float, str]: ...

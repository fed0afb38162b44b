# Written by hand and checked against the built module by `mypy.stubtest` (make check).
# Users see the typed modules beside this file; arrays arrive here contiguous and of the right dtype.
from collections.abc import Callable
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

Progress = Callable[[int, int], object] | None

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

# clouds
def camera_directions(camera: object, out: NDArray[np.float64]) -> None: ...
def clouds_procedural(
    kind: str, shape: tuple[int, int, int], key: int, progress: Progress = None
) -> NDArray[np.float32]: ...
def clouds_check(
    density: NDArray[np.float32],
    shape: tuple[int, int, int],
    voxel: tuple[float, float, float],
    origin: tuple[float, float, float],
) -> None: ...
def clouds_march(
    density: NDArray[np.float32],
    shape: tuple[int, int, int],
    voxel: tuple[float, float, float],
    origin: tuple[float, float, float],
    camera: object,
    sun: tuple[float, float, float],
    sigmas: list[float],
    method: str,
    progress: Progress = None,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]: ...
def clouds_compose(
    depth: NDArray[np.float32],
    cosine: NDArray[np.float32],
    scattered: NDArray[np.float32],
    nodes: list[float],
    sky: NDArray[np.float32],
    haze_distance: NDArray[np.float32] | None,
    params: object,
    conventions: tuple[str, str, str],
    rgb: NDArray[np.float32],
    single: NDArray[np.float32],
    transmittance: NDArray[np.float32],
) -> None: ...

# fit
@final
class Genetic:
    def __new__(cls, settings: object) -> Self: ...
    def ask(self) -> list[list[float]]: ...
    def tell(self, values: list[float]) -> bool: ...
    def outcome(self) -> tuple[list[tuple[list[float], float]], list[tuple[float, float, int]], str]: ...

@final
class CloudObjective:
    def __new__(
        cls,
        depth: NDArray[np.float32],
        cosine: NDArray[np.float32],
        scattered: NDArray[np.float32],
        nodes: list[float],
        sky: NDArray[np.float32],
        haze_distance: NDArray[np.float32] | None,
        color: tuple[float, float, float],
        histogram: NDArray[np.float64],
        haze: list[float],
        conventions: tuple[str, str, str],
    ) -> Self: ...
    def pixels(self) -> int: ...
    def evaluate(self, population: list[tuple[float, ...]]) -> NDArray[np.float64]: ...
    def histograms(self, gene: tuple[float, ...]) -> NDArray[np.uint32] | None: ...
    def search(
        self, settings: object, progress: Progress = None
    ) -> tuple[list[tuple[list[float], float]], list[tuple[float, float, int]], str]: ...

def fit_mean(rgb: NDArray[np.float32], mask: NDArray[np.bool_]) -> tuple[float, float, float]: ...
def fit_histogram(rgb: NDArray[np.float32], mask: NDArray[np.bool_], bins: int) -> NDArray[np.float64]: ...
def image_resize(
    picture: NDArray[np.float32], shape: tuple[int, ...], size: tuple[int, int], out: NDArray[np.float32]
) -> None: ...

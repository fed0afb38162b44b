"""What runs in a worker: one cell, with its own random numbers, and what all cells share, read once in each process."""

from __future__ import annotations

import os
import pickle
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._support.process import set_num_threads

# What this process has read of the grid it works for.
_READ: dict[str, Any] = {}


@dataclass(frozen=True)
class Spilled:
    """A shared object that lies in a file of the grid's own temporary folder, to be read once in each process."""

    path: str

    def read(self) -> Any:
        """Return the object; arrays are memory maps."""
        if self.path not in _READ:
            if self.path.endswith(".npy"):
                _READ[self.path] = np.load(self.path, mmap_mode="r")
            else:
                _READ[self.path] = pickle.loads(Path(self.path).read_bytes())
        return _READ[self.path]


class Shared:
    """Arguments that all cells share, as they go to an executor: handed over once and not with each cell."""

    def __init__(self, executor: Any) -> None:
        self.executor = executor
        self.folder: tempfile.TemporaryDirectory[str] | None = None

    def handed_over(self, shared: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return what stands for the arguments in calls: themselves, scattered futures of Dask, or files."""
        if self.executor is None:
            return shared
        client: Any = getattr(self.executor, "_client", None)  # of Dask's executor
        if hasattr(client, "scatter"):
            # In a list: of a list or a dict Dask would scatter each item.
            return tuple(x if _light(x) else client.scatter([x], broadcast=True)[0] for x in shared)
        return tuple(x if _light(x) else self._spill(x, i) for i, x in enumerate(shared))

    def _spill(self, value: Any, index: int) -> Spilled:
        if self.folder is None:
            self.folder = tempfile.TemporaryDirectory(prefix="pleinair-")
        path = Path(self.folder.name) / f"{index}"
        if isinstance(value, np.ndarray) and not value.dtype.hasobject:
            path = path.with_suffix(".npy")
            np.save(path, value, allow_pickle=False)
        else:
            path = path.with_suffix(".bin")
            try:
                path.write_bytes(pickle.dumps(value, protocol=5))
            except Exception as error:  # noqa: BLE001 -- whatever an object raises
                msg = f"shared[{index}] must be picklable for other processes, got {type(value).__name__}: {error}"
                raise TypeError(msg) from None
        return Spilled(str(path))

    def close(self) -> None:
        """Remove the temporary folder."""
        if self.folder is not None:
            self.folder.cleanup()


def _light(value: Any) -> bool:
    # Futures of Dask are resolved by Dask; a class or a function goes by its name.
    return (
        value is None or isinstance(value, (str, bytes, int, float, Path, type)) or hasattr(value, "add_done_callback")
    )


def run(
    function: Callable[..., Any],
    index: int,
    cell: Any,
    seed: int | None,
    driver: int,
    threads: int | None,
    *shared: Any,
) -> tuple[Any, str | None, float]:
    """Work on one cell: its result or the sentence of its failure, and the seconds it took."""
    if os.getpid() != driver and threads is not None:
        _limit(threads)
    more = {} if seed is None else {"rng": np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index,)))}
    start = time.perf_counter()
    try:
        given = [x.read() if isinstance(x, Spilled) else x for x in shared]
        value = function(cell, *given, **more)
    except Exception as error:  # noqa: BLE001 -- a cell that fails is a record, the others go on
        return None, f"{type(error).__name__}: {error}", time.perf_counter() - start
    return value, None, time.perf_counter() - start


def _limit(threads: int) -> None:
    """Use that many threads in this process, ours and BLAS': one worker a core must not start threads for all of them."""
    if _READ.get("threads") == threads:
        return
    _READ["threads"] = threads
    set_num_threads(threads)
    try:
        from threadpoolctl import threadpool_limits  # type: ignore[import-untyped, unused-ignore]
    except ImportError:
        return
    threadpool_limits(threads)

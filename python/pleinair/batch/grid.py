"""One function over many cells, on anything with the `submit` of concurrent.futures: resumable, and the same bits anywhere."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from .._support.docs import documented
from .._support.fingerprint import fingerprint
from .._support.inputs import Progress, integer, key, reporter
from ..io import PathLike
from . import worker
from .store import Store

# Cells that are handed out at a time: enough to keep a cluster busy, few enough to end quickly.
_WINDOW = 128
# Between two looks at signals [s].
_POLL = 0.05
# That workers have to finish a cell when a grid is left [s].
_GRACE = 10.0


@dataclass(frozen=True)
class Outcome:
    """What became of one cell.

    Attributes
    ----------
    index : int
        Number of the cell.
    value : object
        What the function returned; None if it failed.
    error : str or None
        Why it failed, in a sentence.
    seconds : float
        Time it took; 0 if it lay in the store [s].
    """

    index: int
    value: Any = None
    error: str | None = None
    seconds: float = 0.0


def results(outcomes: Iterable[Outcome]) -> list[Any]:
    """Return the values in the order of their cells.

    Parameters
    ----------
    outcomes : iterable of Outcome
        As `map_grid` yields them.

    Raises
    ------
    RuntimeError
        Cells have failed: it names them, when all have been worked on.

    Examples
    --------
    >>> results(map_grid(abs, [-1, 2, -3]))
    [1, 2, 3]
    """
    found = sorted(outcomes, key=lambda one: one.index)
    failed = [one for one in found if one.error is not None]
    if failed:
        first = "; ".join(f"cell {one.index}: {one.error}" for one in failed[:3])
        msg = f"{len(failed)} of {len(found)} cells failed: {first}{' …' if len(failed) > 3 else ''}"
        raise RuntimeError(msg)
    return [one.value for one in found]


@documented
def map_grid(
    function: Callable[..., Any],
    cells: Iterable[Any],
    *,
    executor: Executor | Callable[[], Any] | None = None,
    store: PathLike | None = None,
    shared: Sequence[Any] = (),
    rng: Any = None,
    threads: int | None = 1,
    max_restarts: int = 3,
    progress: Progress = None,
) -> Iterator[Outcome]:
    """Call `function(cell, *shared)` for every cell, and yield what became of each as it comes.

    A cell that fails is a record with its sentence; the others go on. Nothing depends on the order of the cells or on
    who works on them: one process, several and a resumed run give the same bits.

    Parameters
    ----------
    function : callable
        For executors of processes it must be importable: a function of a module.
    cells : iterable
        First arguments of the calls; all are taken before the first call.
    executor : concurrent.futures.Executor, callable, or None
        None works here, cell by cell. An executor is used as it is: `client.get_executor(pure=False, retries=2)` of
        Dask, say. A callable makes one: `lambda: ProcessPoolExecutor(2)`; it is called again when a worker dies.
    store : path, optional
        Folder that keeps each result in a file of its own: JSON data, arrays, or dicts of arrays. Cells whose result is
        there are not worked on again. It is refused when it is of another grid.
    shared : sequence
        Further arguments, the same for all cells; they go to each process once. Arrays arrive as memory maps.
    rng : None, int, SeedSequence, BitGenerator or Generator
        If given, `function` gets `rng=`, a Generator of its own for each cell.
    threads : int or None
        Of each worker process, so that workers do not share cores [1]; None leaves them alone.
    max_restarts : int
        How often an executor is made anew without a finished cell in between, in [0, 1000] [1].
    {progress}

    Yields
    ------
    Outcome
        Of the cells in the store first, then as they are done.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range, or the store is of another grid.
    concurrent.futures.BrokenExecutor
        Workers die, and there is no factory, or it has been called often enough.

    Examples
    --------
    >>> [one.value for one in map_grid(pow, [1, 2, 3], shared=[2])]
    [1, 4, 9]
    >>> failed = list(map_grid(int, ["7", "x"]))[1]
    >>> failed.index, failed.value, failed.error.split(":")[0]
    (1, None, 'ValueError')
    """
    called: Any = function
    if not callable(called):
        msg = f"function must be callable, got {type(called).__name__}"
        raise TypeError(msg)
    todo = list(cells)
    seed = None if rng is None else key(rng)
    restarts = integer(max_restarts, "max_restarts", 0, 1000)
    if threads is not None:
        threads = integer(threads, "threads", 1, 4096)
    engine: Any = executor
    if engine is not None and not hasattr(engine, "submit") and not callable(engine):
        msg = f"executor must have submit, or be a callable that makes one, got {type(engine).__name__}"
        raise TypeError(msg)
    kept = None
    if store is not None:
        name = f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', type(function).__name__)}"
        what = [x for x in shared if not hasattr(x, "add_done_callback")]
        kept = Store(store, f"{name} {fingerprint(what)}", todo, seed)
    tick, close = reporter(progress, "cells")
    return _Grid(function, todo, tuple(shared), executor, kept, seed, threads, restarts).outcomes(tick, close)


class _Grid:
    """A grid at work."""

    def __init__(
        self,
        function: Callable[..., Any],
        cells: list[Any],
        shared: tuple[Any, ...],
        executor: Any,
        store: Store | None,
        seed: int | None,
        threads: int | None,
        restarts: int,
    ) -> None:
        self.function, self.cells, self.shared, self.store = function, cells, shared, store
        self.seed, self.threads, self.restarts = seed, threads, restarts
        self.factory = executor if executor is not None and not hasattr(executor, "submit") else None
        self.executor: Any = None if self.factory else executor
        self.suspects: set[int] = set()

    def outcomes(self, tick: Any, close: Callable[[], None]) -> Iterator[Outcome]:
        """Yield what was stored, then what is worked out."""
        done = 0
        try:
            left = []
            for index in range(len(self.cells)):
                if self.store is not None and self.store.has(index):
                    done += 1
                    if tick is not None:
                        tick(done, len(self.cells))
                    yield Outcome(index, self.store.get(index))
                else:
                    left.append(index)
            for outcome in self._work(left):
                done += 1
                if tick is not None:
                    tick(done, len(self.cells))
                yield outcome
        finally:
            close()

    def _finish(self, index: int, value: Any, error: str | None, seconds: float) -> Outcome:
        if error is None and self.store is not None:
            try:
                self.store.put(index, value)
            except TypeError as wrong:
                value, error = None, f"TypeError: {wrong}"
        return Outcome(index, value, error, seconds)

    def _work(self, left: list[int]) -> Iterator[Outcome]:
        if not left:
            return
        if self.executor is None and self.factory is None:
            for index in left:
                if self.store is not None and self.store.has(index):  # by another process on the same store
                    yield Outcome(index, self.store.get(index))
                    continue
                got = worker.run(self.function, index, self.cells[index], self.seed, os.getpid(), None, *self.shared)
                yield self._finish(index, *got)
            return
        executor: Any = self.factory() if self.factory else self.executor
        # Threads of this process share its memory.
        shared = worker.Shared(None if isinstance(executor, ThreadPoolExecutor) else executor)
        waiting = deque(left)
        barren = 0
        try:
            arguments = shared.handed_over(self.shared)
            while waiting:
                before = len(waiting)
                broken = yield from self._round(executor, waiting, arguments)
                if broken is None:
                    continue
                barren = 0 if len(waiting) < before else barren + 1
                if barren > self.restarts:
                    raise broken
                if isinstance(broken, CancelledError):
                    self.suspects.clear()
                    arguments = shared.handed_over(self.shared)
                elif self.factory is not None:
                    _end(executor)
                    executor = self.factory()
                else:
                    raise broken
        except BaseException:
            if self.factory is not None:
                _end(executor)
            raise
        else:
            if self.factory is not None:
                executor.shutdown()
        finally:
            shared.close()

    def _round(self, executor: Any, waiting: deque[int], shared: tuple[Any, ...]) -> Any:
        """Hand out cells until none is left or a worker has died; return what broke the executor."""
        flying: dict[Future[Any], int] = {}
        # A cell that was in flight when a worker died goes alone: if one dies again, it was this cell.
        alone = next((index for index in waiting if index in self.suspects), None)
        queue = waiting
        if alone is not None:
            waiting.remove(alone)
            queue = deque([alone])
        driver = -1 if self.threads is None else os.getpid()
        try:
            while queue or flying:
                while queue and len(flying) < _WINDOW:
                    index = queue.popleft()
                    if self.store is not None and self.store.has(index):  # by another process on the same store
                        yield Outcome(index, self.store.get(index))
                        continue
                    call = (index, self.cells[index], self.seed, driver, self.threads, *shared)
                    try:
                        with _signals_later():
                            flying[executor.submit(worker.run, self.function, *call)] = index
                    except BrokenExecutor as broken:
                        waiting.appendleft(index)
                        return (yield from self._broken(broken, flying, waiting, None))
                for future in [f for f in list(flying) if f.done()] or _soon(flying):
                    index = flying.pop(future)
                    try:
                        value, error, seconds = future.result()
                    except BrokenExecutor as broken:
                        flying[future] = index
                        return (yield from self._broken(broken, flying, waiting, alone))
                    except CancelledError as lost:  # a worker of Dask took what was scattered with it
                        flying[future] = index
                        return (yield from self._broken(lost, flying, waiting, None))
                    except Exception as failed:  # noqa: BLE001 -- of the executor: a worker that died too often
                        value, error, seconds = None, f"{type(failed).__name__}: {failed}", 0.0
                    self.suspects.discard(index)
                    yield self._finish(index, value, error, seconds)
        except BaseException:
            for future in flying:
                future.cancel()
            raise
        return None

    def _broken(self, broken: BaseException, flying: dict[Any, int], waiting: deque[int], alone: int | None) -> Any:
        """Put cells that were in flight back; the one that was alone is what kills workers."""
        for future, index in sorted(flying.items(), key=lambda pair: pair[1], reverse=True):
            if future.done() and not future.cancelled() and future.exception() is None:
                yield self._finish(index, *future.result())
                continue
            if index == alone:
                self.suspects.discard(index)
                yield Outcome(index, error=f"{type(broken).__name__}: its worker died each time, without a word")
                continue
            self.suspects.add(index)
            waiting.appendleft(index)
        flying.clear()
        return broken


def _soon(flying: dict[Any, int]) -> list[Any]:
    """Wait a little for a future; return those that are done."""
    end = time.monotonic() + _POLL
    while time.monotonic() < end:
        done = [future for future in flying if future.done()]
        if done:
            return done
        time.sleep(0.002)
    return []


@contextlib.contextmanager
def _signals_later() -> Iterator[None]:
    """Hold Ctrl-C back for a moment: one in the middle of `submit` would leave an executor that never ends."""
    usual = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(usual):
        yield
        return
    held: list[Any] = []
    signal.signal(signal.SIGINT, lambda *what: held.append(what))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
        if held:
            usual(*held[0])


def _end(executor: Any) -> None:
    """End an executor of our own without waiting: workers finish the cell they are at, or are ended after a while."""
    processes = list((getattr(executor, "_processes", None) or {}).values())
    with contextlib.suppress(Exception), _signals_later():
        executor.shutdown(wait=False, cancel_futures=True)

    def insist() -> None:
        time.sleep(_GRACE)
        for process in processes:
            with contextlib.suppress(Exception):
                process.kill()

    if processes:
        # An interpreter that ends waits for its workers; one that never got the word would keep it for ever.
        threading.Thread(target=insist, daemon=True).start()

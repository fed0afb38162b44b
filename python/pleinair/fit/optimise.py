"""Global optimisation of any vectorised objective. Public as `pleinair.fit`.

The paper's genetic algorithm, and differential evolution (L-SHADE) with a covariance matrix adaptation (CMA-ES) at the
end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import Search
from .._support.docs import documented
from .._support.inputs import Progress, array, instance, integer, key, real, reporter, shape_text

__all__ = ["Found", "differential", "genetic"]

HISTORY = np.dtype([("best", np.float64), ("mean", np.float64), ("calls", np.int64)])
_POPULATION = 20


@dataclass(frozen=True)
class DifferentialEvolution:
    """Settings of `differential`, for `fit.clouds(method=...)`.

    Parameters
    ----------
    population : int, optional
        Individuals of the first population, at least 2 [1]; by default chosen by the number of calls.
    polish : bool
        Whether the last calls (300 of 1000, 800 of 4000) are spent on refining the best.
    target : float, optional
        ε_O: end when the best objective is not above this [1]; by default never.
    patience : int, optional
        n_suc: end when the best has not changed for so many generations [1]; by default never.

    Raises
    ------
    ValueError, TypeError
        A setting is out of range.

    Examples
    --------
    >>> DifferentialEvolution(polish=False).population is None
    True
    """

    population: int | None = None
    polish: bool = True
    target: float | None = None
    patience: int | None = None

    def __post_init__(self) -> None:
        instance(self.polish, "polish", bool)
        _check(self)


@dataclass(frozen=True)
class GeneticAlgorithm:
    """Settings of `genetic`, the paper's, for `fit.clouds(method=...)`.

    Parameters
    ----------
    population : int, optional
        Individuals of a generation, at least 2 [1]; by default 20.
    bits : int
        Of a parameter, in [1, 32] [1].
    crossover : float
        Probability that a pair is crossed, in [0, 1] [1].
    mutation : float, optional
        Probability that a bit flips, in [0, 1] [1]; by default one bit of a parameter on average.
    target : float, optional
        ε_O: end when the best objective is not above this [1]; by default never.
    patience : int, optional
        n_suc: end when the best has not changed for so many generations [1]; by default never.

    Raises
    ------
    ValueError, TypeError
        A setting is out of range.

    Examples
    --------
    >>> GeneticAlgorithm(bits=16).crossover
    0.9
    """

    population: int | None = None
    bits: int = 32
    crossover: float = 0.9
    mutation: float | None = None
    target: float | None = None
    patience: int | None = None

    def __post_init__(self) -> None:
        integer(self.bits, "bits", 1, 32)
        real(self.crossover, "crossover", 0, 1)
        if self.mutation is not None:
            real(self.mutation, "mutation", 0, 1)
        _check(self)


Method = DifferentialEvolution | GeneticAlgorithm


def _check(method: Method) -> None:
    if method.population is not None:
        integer(method.population, "population", 2, 10**6)
    if method.target is not None:
        real(method.target, "target", -1e300, 1e300)
    if method.patience is not None:
        integer(method.patience, "patience", 1, 10**9)


@dataclass(frozen=True)
class SearchSettings:
    """A search as the core reads it."""

    method: str
    bounds: list[tuple[float, float]]
    scales: list[str]
    population: int
    generations: int
    target: float
    patience: int
    n_best: int
    min_separation: float
    key: int
    bits: int
    crossover: float
    mutation: float
    first: int | None
    polish: bool


def search_settings(
    method: Method,
    bounds: Sequence[tuple[float, float]],
    generations: int,
    keep: int,
    distinct: float,
    rng: Any,
    scales: Sequence[str] = (),
) -> SearchSettings:
    """Check a search and put its settings together."""
    pairs = array(bounds, "bounds", dtypes=(np.float64,), ndim=2, last=2)
    if pairs.shape[0] == 0 or not np.isfinite(pairs).all() or (pairs[:, 0] > pairs[:, 1]).any():
        msg = f"bounds must be finite pairs (low, high) with low <= high, got {pairs.tolist()}"
        raise ValueError(msg)
    generations = integer(generations, "generations", 1, 10**9)
    ga = method if isinstance(method, GeneticAlgorithm) else GeneticAlgorithm()
    return SearchSettings(
        method="ga" if method is ga else "differential",
        bounds=[(float(low), float(high)) for low, high in pairs],
        scales=list(scales),
        population=_POPULATION if method.population is None else method.population,
        generations=generations,
        target=-np.inf if method.target is None else method.target,
        patience=10**9 if method.patience is None else method.patience,
        n_best=integer(keep, "keep", 1, 10**6),
        min_separation=real(distinct, "distinct", 0, 1),
        key=key(rng),
        bits=ga.bits,
        crossover=ga.crossover,
        mutation=1 / (ga.bits * len(pairs)) if ga.mutation is None else ga.mutation,
        first=method.population,
        polish=isinstance(method, DifferentialEvolution) and method.polish,
    )


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    Attributes
    ----------
    x : ndarray (d,) of float64
        The best parameters.
    fun : float
        Their objective.
    calls : int
        Objective evaluations.
    ranked : list of (ndarray (d,), float)
        The best individuals with their objectives, no two alike, best first.
    history : structured ndarray (populations,)
        `best` so far, `mean` of the population, `calls` so far.
    stopped : str
        "target", "patience" or "generations" (all calls are spent).
    """

    x: NDArray[np.float64]
    fun: float
    calls: int
    ranked: list[tuple[NDArray[np.float64], float]]
    history: NDArray[Any]
    stopped: str


@documented
def genetic(
    objective: Callable[[NDArray[np.float64]], ArrayLike],
    bounds: Sequence[tuple[float, float]],
    *,
    population: int = 20,
    generations: int = 100,
    bits: int = 32,
    crossover: float = 0.9,
    mutation: float | None = None,
    target: float = 0.0,
    patience: int | None = None,
    keep: int = 8,
    distinct: float = 0.0,
    rng: Any = None,
    progress: Progress = None,
) -> Found:
    """Minimise a vectorised objective with the genetic algorithm of section 4.2.

    Parameters
    ----------
    objective : callable
        Takes parameters (population, d) float64, returns their objectives (population,), each at least 0; NaN is
        never chosen.
    bounds : sequence of (float, float)
        Lowest and highest value of each parameter [its unit].
    population : int
        Individuals of a generation, at least 2 [1].
    generations : int
        Most generations [1].
    bits : int
        Bits of a parameter, in [1, 32] [1].
    crossover : float
        Probability that a pair is crossed at two points, in [0, 1] [1].
    mutation : float, optional
        Probability that a bit flips, in [0, 1] [1]; by default one bit of a gene on average.
    target : float
        End when the best objective is not above this [1].
    patience : int, optional
        End the evolution when the best has not changed for so many of its generations [1]; by default never. The polish is not left out.
    keep : int
        Individuals to remember [1].
    distinct : float
        They differ by more than this share of its range in at least one parameter, in [0, 1] [1].
    {rng}
    progress : None, True or callable
        `progress(done, total)` in objective calls; True shows a tqdm bar.

    Returns
    -------
    Found
        The best, the ranked, the history.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range, or the objective returns a wrong shape or a negative value.

    Notes
    -----
    Two-point crossover, elitism, fitness 1 / (1 + O) as in the paper; it leaves the rates and the selection (here a
    roulette wheel) open.

    Examples
    --------
    >>> found = genetic(lambda x: ((x - 1) ** 2).sum(axis=1), [(-5, 5)] * 2, population=50, rng=0)
    >>> bool(found.fun < 1.0), found.calls
    (True, 5000)
    """
    method = GeneticAlgorithm(population, bits, crossover, mutation, target, patience)
    return run_search(objective, search_settings(method, bounds, generations, keep, distinct, rng), progress)


@documented
def differential(
    objective: Callable[[NDArray[np.float64]], ArrayLike],
    bounds: Sequence[tuple[float, float]],
    *,
    population: int | None = None,
    generations: int = 100,
    polish: bool = True,
    target: float | None = None,
    patience: int | None = None,
    keep: int = 8,
    distinct: float = 0.0,
    rng: Any = None,
    progress: Progress = None,
) -> Found:
    """Minimise a vectorised objective by differential evolution that adapts its rates and shrinks its population.

    Parameters
    ----------
    objective : callable
        Takes parameters (n, d) float64, returns their objectives (n,); NaN is never chosen. n changes from call to
        call.
    bounds : sequence of (float, float)
        Lowest and highest value of each parameter [its unit]; equal ones freeze it.
    population : int, optional
        Individuals of the first population, at least 2 (below 4, 4 are drawn) [1]. By default it grows with the number
        of calls (20 for 1000, 50 for 4000), and a generation counts as 20 calls.
    generations : int
        population × generations is the number of objective calls [1]: all are spent unless `target` or `patience` ends
        the search, and the polish is among them.
    polish : bool
        Spend the last calls (300 of 1000, 800 of 4000) on a covariance matrix adaptation from the best points found. It sees ranks
        only, so it works on objectives that are constant in pieces, as those of histograms are.
    target : float, optional
        End when the best objective is not above this [1]; by default never.
    patience : int, optional
        End the evolution when the best has not changed for so many of its generations [1]; by default never. The polish is not left out.
    keep : int
        Individuals to remember [1].
    distinct : float
        They differ by more than this share of its range in at least one parameter, in [0, 1] [1].
    {rng}
    progress : None, True or callable
        `progress(done, total)` in objective calls; True shows a tqdm bar.

    Returns
    -------
    Found
        The best, the ranked, the history.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range, or the objective returns a wrong shape or nothing but NaN.

    Notes
    -----
    L-SHADE (Tanabe and Fukunaga 2014) without its archive, then CMA-ES (Hansen and Ostermeier 2001).

    Examples
    --------
    >>> found = differential(lambda x: ((x - 1) ** 2).sum(axis=1), [(-5, 5)] * 2, generations=50, rng=0)
    >>> bool(found.fun < 1e-6), found.calls
    (True, 1000)
    """
    method = DifferentialEvolution(population, polish, target, patience)
    return run_search(objective, search_settings(method, bounds, generations, keep, distinct, rng), progress)


def run_search(
    objective: Callable[[NDArray[np.float64]], ArrayLike], settings: SearchSettings, progress: Progress
) -> Found:
    search = Search(settings)
    callback, close = reporter(progress, settings.method)
    try:
        ended = False
        while not ended:
            asked = np.array(search.ask())
            values = array(objective(asked), "objective", dtypes=(np.float64,))
            if values.shape != (len(asked),):
                msg = f"objective must return shape ({len(asked)},), got {shape_text(values.shape)}"
                raise ValueError(msg)
            ended = search.tell(values.tolist())
            if callback is not None:
                callback(search.calls(), settings.population * settings.generations)
    finally:
        close()
    return found(*search.outcome())


def found(ranked: list[tuple[list[float], float]], history: list[tuple[float, float, int]], stopped: str) -> Found:
    if not ranked:
        msg = "objective must return a number for at least one individual, got only NaN"
        raise ValueError(msg)
    pairs = [(np.array(x), value) for x, value in ranked]
    rows = np.array(history, dtype=HISTORY)
    return Found(pairs[0][0], pairs[0][1], int(rows["calls"][-1]), pairs, rows, stopped)

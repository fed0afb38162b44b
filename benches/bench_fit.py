"""Searches at equal calls on the objective of eq 2: ours, the paper's, scipy's, pycma's; the error is O, mean of seeds.

Each contender may spend exactly so many calls and starts again from elsewhere when it has converged before.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from importlib.metadata import version

import numpy as np
import pleinair as pa
from pleinair.clouds import Basis, Params
from pleinair.fit import Photo, objective
from pleinair.report import Row, race
from scipy.optimize import differential_evolution

try:
    import cma
except ImportError:
    cma = None

ROOM = "inverse_clouds"
SLOW = True
SEEDS = 20
WIDTH, HEIGHT = 120, 90
HAZE = tuple(i / 10 for i in range(11))
CLOUD = pa.clouds.procedural("cumulus", (48, 80, 80), rng=3)
CAMERA = pa.Camera.look_at((800, -2700, 500), (800, 800, 700), WIDTH, HEIGHT, fov=22)
BASIS = Basis.precompute(CLOUD, CAMERA, pa.Sun(40, 200))
SKY = np.broadcast_to(
    np.float32([0.12, 0.25, 0.6]) * np.linspace(0.7, 1.3, HEIGHT, dtype=np.float32)[:, None, None], (HEIGHT, WIDTH, 3)
)

Objective = Callable[[np.ndarray], np.ndarray]


def photographs() -> dict[str, Photo]:
    """Return what is to be explained, from easy to impossible."""

    def made(rgb: np.ndarray, on: np.ndarray) -> Photo:
        return Photo.analyse(np.ascontiguousarray(rgb, np.float32), cloud=on, sky=SKY, ground=None)

    deepest = float(BASIS.depth.max())
    truths = {
        "T1, the model's own picture": Params(4.0, (1, 0.95, 0.85), 0.4, 8 / deepest, 0.97, 0.25, (0.1, 0.2, 0.3)),
        "T1b, another, dense and forward": Params(7.0, (1, 0.97, 0.9), 0.75, 20 / deepest, 0.9, 0.45, (0, 0.1, 0.4)),
    }
    found = {
        name: replace(made(BASIS.image(p, SKY), BASIS.depth > 0), light_color=p.light_color)
        for name, p in truths.items()
    }
    other = pa.clouds.procedural("cumulus", (40, 64, 96), rng=11)
    eye = pa.Camera.look_at((950, -2700, 300), (950, 650, 600), WIDTH, HEIGHT, fov=24)
    basis = Basis.precompute(other, eye, pa.Sun(25, 120))
    p = Params(5.0, (1, 0.95, 0.85), 0.6, 15 / float(basis.depth.max()), 0.98, 0.3, (0.1, 0.1, 0.2))
    on = basis.depth > 0
    toned = np.clip(1.6 * basis.image(p, SKY) ** 1.4, 0, 1)
    found["T2, another cloud and Sun, tone-clipped"] = made(np.where(on[..., None], toned, SKY), on)
    found["T3, a photograph"] = Photo.analyse(pa.io.read(pa.demo.photograph()))
    return found


class SpentError(Exception):
    """All calls are spent."""


class Counted:
    """An objective on the unit box that can be called so many times; remembers the best."""

    def __init__(self, f: Objective, low: np.ndarray, high: np.ndarray, calls: int) -> None:
        self.f, self.low, self.high, self.left, self.best = f, low, high, calls, np.inf

    def __call__(self, unit: np.ndarray) -> np.ndarray:
        if len(unit) > self.left:
            raise SpentError
        self.left -= len(unit)
        values = self.f(np.clip(self.low + (self.high - self.low) * unit, self.low, self.high))
        self.best = min(self.best, values.min())
        return values


def scipy_search(f: Counted, seed: int, popsize: int) -> float:
    try:
        for again in range(10**6):
            differential_evolution(
                lambda x: f(x[None])[0], [(0, 1)] * 5, popsize=popsize, maxiter=10**6, polish=False, rng=[seed, again]
            )
    except SpentError:
        pass
    return f.best


def cma_search(f: Counted, seed: int, size: int, growth: int) -> float:
    rng = np.random.default_rng(seed)
    try:
        for again in range(10**6):
            told = {"bounds": [0, 1], "verbose": -9, "seed": 1000 * seed + again + 1, "popsize": size * growth**again}
            run = cma.CMAEvolutionStrategy(rng.random(5), 0.3, told)
            while not run.stop():
                asked = run.ask()
                run.tell(asked, f(np.array(asked)).tolist())
    except SpentError:
        pass
    return f.best


def contenders(calls: int) -> dict[str, Callable[[Objective, np.ndarray, np.ndarray, int], float]]:
    """Name each search: a callable of objective, bounds and seed that returns the best it reached."""

    def ours(search):
        return lambda f, low, high, seed: (
            search(f, list(zip(low, high, strict=True)), generations=calls // 20, rng=seed).fun
        )

    scipy_name = f"scipy {version('scipy')} differential_evolution"
    all_of_them = {"pleinair": ours(pa.fit.differential), "pleinair, the paper's GA": ours(pa.fit.genetic)}
    for popsize in (3, 8):
        all_of_them[f"{scipy_name}, popsize={popsize}"] = lambda f, low, high, seed, k=popsize: scipy_search(
            Counted(f, low, high, calls), seed, k
        )
    if cma is not None:
        for size, growth, words in ((8, 1, "8"), (16, 1, "16")):
            all_of_them[f"pycma {cma.__version__}, population {words}"] = lambda f, low, high, seed, k=size, g=growth: (
                cma_search(Counted(f, low, high, calls), seed, k, g)
            )
    return all_of_them


def rows() -> Iterable[Row]:
    pa.set_num_threads(1)
    try:
        for name, photo in photographs().items():
            core = objective(photo, BASIS, HAZE)
            low = np.array([0, 0, BASIS.sigma_t[0], 0, 0.0])
            high = np.array([10, 0.97, BASIS.sigma_t[-1], 1, 1.0])

            def f(x, core=core):
                return core.evaluate([tuple(row) for row in x.tolist()]).reshape(-1, 4)[:, 0]

            # The curve of the first; of the others two points.
            for calls in (250, 500, 1000, 2000, 4000) if name.startswith("T1,") else (1000, 4000):
                all_of_them = contenders(calls)
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # pycma warns when it comes to rest
                    reached = {
                        who: [search(f, low, high, seed) for seed in range(SEEDS)]
                        for who, search in all_of_them.items()
                    }
                    measured = race(
                        ROOM,
                        "search, by calls",
                        name,
                        {
                            who: lambda search=search, f=f, low=low, high=high: search(f, low, high, 0)
                            for who, search in all_of_them.items()
                        },
                        {who: float(np.mean(v)) for who, v in reached.items()},
                        f"O (± {np.std(reached['pleinair']):.3f})",
                        knobs={who: (who, f"{calls}") for who in all_of_them},
                        rounds=1,
                        size=calls,
                        size_unit="calls",
                    )
                yield from (replace(row, method=f"{row.method}, {calls} calls") for row in measured)
    finally:
        pa.set_num_threads(None)

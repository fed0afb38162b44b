"""Inverse rendering of a cloud from a photograph (inverse_clouds, section 4.2). Public as `pleinair.fit`.

Parameters whose picture has the colour histogram of the photograph's clouds, found by differential evolution or the
paper's genetic algorithm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from .._core import CloudObjective
from .._support.docs import documented
from .._support.inputs import Progress, array, choice, instance, key, real, reporter
from ..clouds import Bases, Basis, Params, air_paths
from .optimise import DifferentialEvolution, GeneticAlgorithm, SearchSettings, found, search_settings
from .photo import Photo, UnfittableError
from .result import LEVEL, Candidate, CloudFit, Tried, pair_of
from .successive_halving import outcome, successive_halving

_MEANING = {"light_intensity": (0.0, 1e30), "g": (-0.999, 0.999), "albedo": (0.0, 1.0), "ambient": (0.0, 1e30)}
_GENES = ("light_intensity", "g", "sigma_t", "albedo", "ambient")
# In what each is searched: extinctions of clouds go by factors, asymmetries by how far they are from 1.
_SCALES = ("linear", "atanh", "log", "linear", "linear")
_HAZE = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_HEIGHTS = (1000.0, 2000.0, 4000.0, 8000.0)


def objective(
    photo: Photo, basis: Basis, haze: Sequence[float], *, like: Params | None = None, weigh: str = "pixels"
) -> CloudObjective:
    """Return the fused objective of eq 2 for a photograph on a basis, with the haze to search over.

    What is neither searched nor the photograph's is that of `like`: the height of the air, the colour of the ambient
    light. A rendered pixel counts 1, or its opacity.
    """
    like = Params() if like is None else like
    far, before = air_paths(basis.distance, (basis.camera, basis.sun, basis.conventions), like.haze_height)
    orders = None
    if basis.multiple.size:
        mixture, images = basis.mixed()
        orders = basis.nodes, mixture, images
    return CloudObjective(
        basis.depth,
        basis.cosine,
        basis.scattered,
        basis.sigma_t.tolist(),
        photo.sky_for(basis.camera),
        far,
        photo.light_color,
        np.ascontiguousarray(photo.histogram),
        list(haze),
        basis.conventions.words,
        orders,
        before,
        like.ambient_color,
        weigh == "opacity",
    )


@documented
def clouds(
    photo: Photo,
    basis: Basis | Bases,
    *,
    method: str | DifferentialEvolution | GeneticAlgorithm = "differential",
    generations: int = 100,
    keep: int = 8,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    haze: Sequence[float] = _HAZE,
    haze_heights: Sequence[float] | None = None,
    skylight: bool = False,
    weigh: str | None = None,
    distinct: float = 0.05,
    rng: Any = None,
    progress: Progress = None,
    **settings: Any,
) -> CloudFit:
    """Find the parameters that make a cloud look like the clouds of a photograph (section 4.2).

    Parameters
    ----------
    photo : Photo
        From `Photo.analyse`.
    basis : pleinair.clouds.Basis or pleinair.clouds.Bases
        Precomputed images of the cloud; with several Suns the best is found: searches run side by side, and the worse
        half is dropped each time the calls of the others have doubled.
    method : {"differential", "ga"}, DifferentialEvolution or GeneticAlgorithm
        Differential evolution, the best at equal calls, or the paper's genetic algorithm; by name both end at the
        objective 0 and after 20 generations, each of `population` calls, without a better one. The paper has a target of
        0.5, above its own mean result of 0.40.
    generations : int
        Most generations [1]. population × generations is the number of objective calls, the polish among them.
    keep : int
        Ranked parameters to return [1].
    bounds : mapping of str to (float, float), optional
        Lowest and highest value of `light_intensity`, `g`, `sigma_t`, `albedo`, `ambient` [as in `Params`]. By default
        (0, 10), (0, 0.97), the range of the basis, (0, 1), (0, 1): the paper's, with g kept off the delta function at 1.
    haze : sequence of float
        Extinctions of the air to search over for each channel, at least 0 [1].
    haze_heights : sequence of float, optional
        Heights H of the air to try, in [1, 1e9] [m], for bases with `Conventions(haze="height")`; by default 1, 2, 4
        and 8 km. They share the calls as Suns do.
    skylight : bool
        Whether the ambient light has the colour of the photograph's sky, `Photo.sky_color`, instead of the light's.
    weigh : {"opacity", "pixels"}, optional
        What a rendered pixel counts in its histogram: its opacity, 1 − transmittance, so that sky seen through the rims of
        the cloud does not count as cloud, by default where the clouds were found in the photograph; or 1, the paper's
        reading of eq 2, by default where they were given: such a mask may hold all that the cloud touches.
    distinct : float
        Ranked parameters differ by more than this share of its range in at least one of them, in [0, 1] [1]. Other
        parameters may still look alike.
    {rng}
    progress : None, True or callable
        `progress(done, total)` in objective calls; True shows a tqdm bar.
    **settings : object
        Single settings of the method: `population`, `polish`, `bits`, `crossover`, `mutation`, `target`, `patience`.

    Returns
    -------
    CloudFit
        Ranked parameters, history, pictures.

    Raises
    ------
    UnfittableError
        The photograph cannot be fitted: the message says why.
    ValueError, TypeError
        An argument is out of range.

    Examples
    --------
    >>> import pleinair as pa
    >>> picture = np.full((32, 32, 3), (0.1, 0.3, 0.8), np.float32)
    >>> picture[8:20, 8:24] = np.linspace(0.3, 0.9, 16)[:, None]
    >>> photo = pa.fit.Photo.analyse(picture, ground=None)
    >>> cloud = pa.clouds.procedural("cumulus", (16, 24, 24), rng=1)
    >>> camera = pa.Camera.look_at((0, -800, 900), (240, 240, 960), 40, 30, fov=50)
    >>> basis = pa.clouds.Basis.precompute(cloud, camera, pa.Sun(40, 160))
    >>> fit = pa.fit.clouds(photo, basis, generations=5, rng=0)
    >>> fit.calls, fit.picture(rank=0).shape, len(fit.ranked)
    (100, (30, 40, 3), 8)
    >>> fit.render(cloud, size=(20, 15)).rgb.shape
    (15, 20, 3)
    >>> fit.replace().shape, fit.replace(cloud=cloud, samples=1).shape
    ((32, 32, 3), (32, 32, 3))
    >>> low, high = fit.intervals["sigma_t"]
    >>> low <= fit.best.params.sigma_t <= high, fit.table().dtype.names[:3]
    (True, ('rank', 'objective', 'light_intensity'))
    >>> small = pa.fit.CloudFit.from_json(fit.to_json())
    >>> small.best == fit.best, small.attach(photo, basis).picture().shape
    (True, (30, 40, 3))
    """
    instance(photo, "photo", Photo)
    views: list[Basis] = list(basis) if isinstance(basis, Bases) else [instance(basis, "basis", Basis)]
    first = views[0]
    instance(skylight, "skylight", bool)
    if weigh is None:
        weigh = "pixels" if photo.cloud_given else "opacity"
    choice(weigh, "weigh", ("opacity", "pixels"))
    if photo.problems:
        msg = "photo cannot be fitted: " + "; ".join(photo.problems)
        raise UnfittableError(msg)
    ranges: dict[str, tuple[float, float]] = {
        "light_intensity": (0.0, 10.0),
        "g": (max(0.0, float(first.g[0])), float(first.g[-1])) if first.g.size else (0.0, 0.97),
        "sigma_t": (float(first.sigma_t[0]), float(first.sigma_t[-1])),
        "albedo": (0.0, 1.0),
        "ambient": (0.0, 1.0),
    }
    for name, pair in (bounds or {}).items():
        if name not in ranges:
            msg = f"bounds must be of {', '.join(ranges)}, got {name!r}"
            raise ValueError(msg)
        low, high = ranges["sigma_t"] if name == "sigma_t" else _MEANING[name]
        if name == "g" and first.g.size:
            low, high = float(first.g[0]), float(first.g[-1])
        unit = "1/m" if name == "sigma_t" else "1"
        a, b = pair_of(pair, f"bounds[{name!r}]")
        ranges[name] = (real(a, f"bounds[{name!r}]", low, high, unit), real(b, f"bounds[{name!r}]", low, high, unit))
    extinctions = [real(k, "haze", 0, 1e9) for k in array(haze, "haze", dtypes=(np.float64,), ndim=1)]
    likes = [replace(like, ambient_color=photo.sky_color if skylight else None) for like in _air(first, haze_heights)]
    models = [(view, like) for view in views for like in likes]
    cores = [objective(photo, view, extinctions, like=like, weigh=weigh) for view, like in models]
    generator = np.random.default_rng(key(rng)) if len(models) > 1 else rng

    searcher = _searcher(method, settings)

    def settings_for(generations: int) -> SearchSettings:
        return search_settings(
            searcher, [ranges[name] for name in _GENES], generations, keep, distinct, generator, _SCALES
        )

    searched = settings_for(generations)
    callback, close = reporter(progress, "fit")
    try:
        if len(models) == 1:
            individuals, history, stopped, noise, spread = cores[0].search(searched, callback)
            ranking, calls = [(0, x, value) for x, value in individuals], [history[-1][2]]
            values = [individuals[0][1] if individuals else np.inf]
        else:
            arms, history = successive_halving(cores, settings_for, searched.generations, callback)
            best, ranking, stopped = outcome(arms)
            noise = best.core.noise_floor(searched.key)
            spread = best.search.spread(noise)
            values, calls = [e.best for e in arms], [e.calls for e in arms]
    finally:
        close()
    which = int(np.argmin(values))
    chosen = models[which][0]
    # Ranks are of one Sun: pictures of the fit are made from its basis.
    ranking = [(i, x, value) for i, x, value in ranking if models[i][0] is chosen][: searched.n_best]
    result = found([(x, value) for _, x, value in ranking], history, stopped)
    ranked = []
    for i, x, fun in ranking:
        red, green, blue = cores[i].evaluate([tuple(x)])[1:].tolist()
        genes: dict[str, Any] = dict(zip(_GENES, x, strict=True))
        params = replace(models[i][1], light_color=photo.light_color, haze=(red, green, blue), **genes)
        ranked.append(Candidate(params, fun))
    tried = [
        Tried(view.sun, like.haze_height if view.conventions.haze == "height" else None, float(value), int(n))
        for (view, like), value, n in zip(models, values, calls, strict=True)
    ]
    shares = dict(zip(_GENES, spread, strict=True))
    known = cores[which].intervals(searched, float(values[which]), noise, LEVEL) if ranking else []
    tried.sort(key=lambda t: t.objective)
    return CloudFit(
        ranked,
        result.history,
        result.stopped,
        *(chosen.sun, chosen.camera, chosen.conventions, chosen.orders),
        fitted=(photo, chosen),
        noise=noise,
        spread=shares,
        intervals=dict(zip(_GENES, known, strict=False)),
        searched=ranges,
        tried=tuple(tried),
    )


def _searcher(method: Any, settings: dict[str, Any]) -> DifferentialEvolution | GeneticAlgorithm:
    """Return the settings of the method, with single ones in place of its own."""
    if not isinstance(method, (DifferentialEvolution, GeneticAlgorithm)):
        kinds = {"differential": DifferentialEvolution, "ga": GeneticAlgorithm}
        if method not in kinds:
            msg = f"method must be 'differential', 'ga', a DifferentialEvolution or a GeneticAlgorithm, got {method!r}"
            raise ValueError(msg)
        method = kinds[method](target=0.0, patience=20)
    mine = {f.name for f in fields(method)}
    known = {f.name for kind in (DifferentialEvolution, GeneticAlgorithm) for f in fields(kind)}
    for name in settings:
        if name not in known:
            msg = f"clouds() has no argument {name!r}; settings of a method are {', '.join(sorted(known))}"
            raise TypeError(msg)
    # Settings of the other method are allowed and of no effect, so that methods can be compared by name.
    out: DifferentialEvolution | GeneticAlgorithm = replace(method, **{k: v for k, v in settings.items() if k in mine})
    return out


def _air(basis: Basis, heights: Sequence[float] | None) -> list[Params]:
    """Return parameters that stand for the heights of the air to try."""
    if basis.conventions.haze != "height":
        if heights is not None:
            msg = "haze_heights must be None unless the basis has Conventions(haze='height')"
            raise ValueError(msg)
        return [Params()]
    if heights is None:
        return [Params(haze_height=h) for h in _HEIGHTS]
    given = array(heights, "haze_heights", dtypes=(np.float64,), ndim=1).tolist()
    if not given or len(set(given)) < len(given):
        msg = f"haze_heights must be different heights, at least one, got {given}"
        raise ValueError(msg)
    return [Params(haze_height=real(h, "haze_heights", 1, 1e9, "m")) for h in given]

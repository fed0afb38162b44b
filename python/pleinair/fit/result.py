"""What a fit of a cloud to a photograph comes to: ranked parameters, how the search went, pictures, a few kB of JSON.

Public as `pleinair.fit.CloudFit`.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.docs import documented
from .._support.inputs import Progress, flag, instance, integer
from .._support.process import version
from .._support.schema import build, json_object
from ..astro import Sun
from ..camera import Camera
from ..clouds import Basis, CloudImage, Conventions, Params, Volume, render
from .optimise import HISTORY
from .photo import Photo, png_of
from .placement import aimed, grainy, placement, softened, warped

# A parameter is undetermined when its interval spans more than this share of what was searched, in the search's scale.
_UNDETERMINED = 0.5
# A fit whose objective is so many times the noise floor has the wrong model.
_MISFIT = 3.0
# Level of the intervals.
LEVEL = 0.9
_FORMAT = 1

_SCALE = {"sigma_t": math.log, "g": math.atanh}


@dataclass(frozen=True)
class Candidate:
    """Parameters and the objective they reach.

    Attributes
    ----------
    params : pleinair.clouds.Params
        The parameters.
    objective : float
        O of eq 2, in [0, 2] [1].
    """

    params: Params
    objective: float


@dataclass(frozen=True)
class Tried:
    """What one Sun and one height of the air came to in a fit.

    Attributes
    ----------
    sun : Sun
        Direction of the light.
    haze_height : float or None
        H of air that thins out with height [m]; None with other conventions.
    objective : float
        The lowest O that was found with them [1].
    calls : int
        Objective evaluations spent on them.
    """

    sun: Sun
    haze_height: float | None
    objective: float
    calls: int


@dataclass(frozen=True, eq=False)
class CloudFit:
    """A finished fit: the ranked parameters, how the search went, and pictures of them.

    Attributes
    ----------
    ranked : list of Candidate
        The best, no two alike, best first.
    history : structured ndarray (populations,)
        `best` so far, `mean` of the population, `calls` so far.
    stopped : str
        "target", "patience" or "generations" (all calls are spent).
    photo, basis
        What was fitted; of several bases the one of the best Sun. A fit that was unpickled or read from JSON has neither
        (asking raises ValueError) until `attach` puts them back.
    noise : float
        The noise floor of the objective [1]: O between the histograms of the photograph and resamplings of them with as
        many pixels as the picture's cloud has. Fits whose objectives differ by less are equally good.
    spread : dict of str to float
        Extent of each parameter among all evaluated candidates within `noise` of the best, as a share of its range [1].
        It is at least as large as stated: candidates that were not evaluated may be as good, too. It knows nothing of
        misfit: `intervals` do.
    intervals : dict of str to (float, float)
        Lowest and highest plausible value of each parameter, at the level 0.9 [as in `Params`]. They allow for as much as the
        model is wrong: of targets made by another cloud, another camera and a tone curve, 80 % and more of the true values
        lie inside (docs/papers/inverse_clouds.md).
    searched : dict of str to (float, float)
        Lowest and highest value of each parameter that was searched [as in `Params`].
    tried : tuple of Tried
        Suns and heights of the air that were tried, best first.
    sun, camera, conventions, orders
        Of the basis.
    fitted : (Photo, Basis) or None
        `photo` and `basis` where the fit has them.
    """

    ranked: list[Candidate]
    history: NDArray[Any]
    stopped: str
    sun: Sun
    camera: Camera
    conventions: Conventions
    orders: int | None
    fitted: tuple[Photo, Basis] | None = field(default=None, repr=False)
    noise: float = 0.0
    spread: dict[str, float] = field(default_factory=dict)
    intervals: dict[str, tuple[float, float]] = field(default_factory=dict)
    searched: dict[str, tuple[float, float]] = field(default_factory=dict)
    tried: tuple[Tried, ...] = ()

    def __repr__(self) -> str:
        return f"CloudFit({self._words()})"

    def _words(self) -> str:
        open_ = ", ".join(self.undetermined) or "none"
        return (
            f"O = {self.best.objective:.3f} with a noise floor of {self.noise:.3f}, {self.calls} calls, "
            f"stopped by {self.stopped}, undetermined: {open_}"
        )

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters that the photograph does not determine: their interval is more than half of what was searched."""

        def share(name: str) -> float:
            scale = _SCALE.get(name, float)
            (low, high), (least, most) = (map(scale, pair) for pair in (self.intervals[name], self.searched[name]))
            return (high - low) / (most - least) if most > least else 0.0

        return tuple(name for name in self.intervals if share(name) > _UNDETERMINED)

    @property
    def explained(self) -> str:
        """One sentence on how well the cloud explains the photograph, and what that means for its parameters."""
        times = self.best.objective / self.noise if self.noise > 0 else math.inf
        if times <= _MISFIT:
            return f"O is {times:.1f} times its noise floor: the cloud explains the photograph's colours."
        return (
            f"O is {times:.1f} times its noise floor: no parameters of this cloud have the photograph's colours, and the "
            "best are those of a wrong model; trust the intervals and not the digits."
        )

    def table(self) -> NDArray[Any]:
        """Return the ranked parameters as a structured array, a row for each: `pandas.DataFrame(fit.table())` reads it.

        Returns
        -------
        structured ndarray (ranks,)
            `rank`, `objective`, the parameters of the search, `haze_r`, `haze_g`, `haze_b` [as in `Params`].

        Examples
        --------
        See `clouds`.
        """
        names = ("light_intensity", "g", "sigma_t", "albedo", "ambient")
        kinds = [("rank", np.int64), *((n, np.float64) for n in ("objective", *names, "haze_r", "haze_g", "haze_b"))]
        rows = [
            (rank, c.objective, *(getattr(c.params, name) for name in names), *c.params.haze)
            for rank, c in enumerate(self.ranked)
        ]
        return np.array(rows, dtype=kinds)

    @property
    def best(self) -> Candidate:
        """The candidate of rank 0."""
        return self.ranked[0]

    @property
    def calls(self) -> int:
        """Objective evaluations."""
        return int(self.history["calls"][-1])

    def __getstate__(self) -> dict[str, Any]:
        # A basis has tens of megabytes: results of many photographs go from process to process without.
        return vars(self) | {"fitted": None}

    def __copy__(self) -> CloudFit:
        return replace(self)

    def attach(self, photo: Photo, basis: Basis) -> CloudFit:
        """Return the fit with its photograph and basis, which pictures of it need.

        Parameters
        ----------
        photo : Photo
            The photograph that was fitted.
        basis : pleinair.clouds.Basis
            The basis that it was fitted with.

        Raises
        ------
        ValueError
            The basis has another camera, Sun or convention than that of the fit.

        Examples
        --------
        See `clouds`.
        """
        instance(photo, "photo", Photo)
        instance(basis, "basis", Basis)
        for name in ("sun", "camera", "conventions", "orders"):
            got, own = getattr(basis, name), getattr(self, name)
            if got != own:
                msg = f"basis must have the {name} of the fit, {own}, got {got}"
                raise ValueError(msg)
        return replace(self, fitted=(photo, basis))

    def _attached(self) -> tuple[Photo, Basis]:
        if self.fitted is None:
            msg = "the fit came without its photograph and basis: fit.attach(photo, basis) first"
            raise ValueError(msg)
        return self.fitted

    @property
    def photo(self) -> Photo:
        """The photograph that was fitted."""
        return self._attached()[0]

    @property
    def basis(self) -> Basis:
        """The basis that it was fitted with."""
        return self._attached()[1]

    def to_dict(self) -> dict[str, Any]:
        """Return what was found as plain data: parameters, objectives, noise floor, Sun, camera, versions, history.

        Examples
        --------
        See `clouds`.
        """
        flat = dataclasses.asdict
        return {
            "kind": "cloud fit",
            "format": _FORMAT,
            "versions": {"pleinair": version(), "numpy": np.__version__},
            "ranked": [flat(candidate) for candidate in self.ranked],
            "noise": self.noise,
            "spread": self.spread,
            "intervals": {name: list(pair) for name, pair in self.intervals.items()},
            "searched": {name: list(pair) for name, pair in self.searched.items()},
            "explained": self.explained,
            "stopped": self.stopped,
            "sun": flat(self.sun),
            "camera": flat(self.camera),
            "conventions": flat(self.conventions),
            "orders": self.orders,
            "tried": [flat(one) for one in self.tried],
            "history": {str(name): self.history[name].tolist() for name in HISTORY.names or ()},
        }

    def to_json(self) -> str:
        """Return `to_dict` as JSON of a few kB, without photograph and basis; `from_json` reads it.

        Examples
        --------
        See `clouds`.
        """
        return json.dumps(self.to_dict())

    @classmethod
    def from_json(cls, text: str) -> CloudFit:
        """Return a fit from what `to_json` gave, without photograph and basis.

        Parameters
        ----------
        text : str
            JSON of a fit.

        Raises
        ------
        ValueError, TypeError
            The text is not JSON of a fit, or of a later format.

        Examples
        --------
        See `clouds`.
        """
        return cls.from_dict(json_object(text, "a CloudFit"))

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> CloudFit:
        """Return a fit from what `to_dict` gave, without photograph and basis.

        Parameters
        ----------
        data : mapping
            Of a fit.

        Raises
        ------
        ValueError, TypeError
            The data are not those of a fit, or of a later format.

        Examples
        --------
        See `clouds`.
        """
        return _read(cls, instance(data, "data", Mapping))

    def picture(self, rank: int = 0) -> NDArray[np.float32]:
        """Return the picture of a candidate at the size of the basis, in front of the photograph's sky.

        Parameters
        ----------
        rank : int
            Place among the ranked, 0 is the best [1].

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear light.

        Raises
        ------
        ValueError
            There is no such rank, or the fit has no photograph and basis.

        Examples
        --------
        See `clouds`.
        """
        rank = integer(rank, "rank", 0, len(self.ranked) - 1)
        return self.basis.image(self.ranked[rank].params, self.photo.sky_for(self.camera))

    @documented
    def render(
        self,
        cloud: Volume,
        camera: Camera | None = None,
        sun: Sun | None = None,
        *,
        rank: int = 0,
        size: tuple[int, int] | None = None,
        sky: Any = None,
        samples: int = 64,
        rng: Any = None,
        method: str = "fast",
        progress: Progress = None,
    ) -> CloudImage:
        """Render a cloud with fitted parameters, at another size, from another place or under another Sun.

        Parameters
        ----------
        cloud : Volume
            The density: the fitted one or any other.
        camera : Camera, optional
            From where; by default the camera of the fit.
        sun : Sun, optional
            Direction of the light; by default the Sun of the fit.
        rank : int
            Place among the ranked, 0 is the best [1].
        size : (int, int), optional
            Width and height of the picture [px].
        sky : array_like (3,) or (height, width, 3), optional
            Light behind the cloud; by default the photograph's sky, filling the picture.
        samples : int
            Paths of a pixel, if the basis has more than one order of scattering [1].
        rng : None, int, SeedSequence, BitGenerator or Generator
            Of the paths.
        method : {"fast", "reference"}
            See `pleinair.clouds.render`.
        {progress}

        Returns
        -------
        pleinair.clouds.CloudImage
            The picture and its parts.

        Raises
        ------
        ValueError
            An argument is out of range.

        Examples
        --------
        See `clouds`.
        """
        rank = integer(rank, "rank", 0, len(self.ranked) - 1)
        camera = camera or self.camera
        if size is not None:
            camera = camera.resized(*pair_of(size, "size"))
        return render(
            cloud,
            self.ranked[rank].params,
            camera,
            sun or self.sun,
            sky=self.photo.sky_for(camera) if sky is None else sky,
            orders=self.orders,
            samples=samples,
            rng=rng,
            method=method,
            conventions=self.conventions,
            progress=progress,
        )

    @documented
    def replace(
        self,
        photo: Photo | None = None,
        *,
        cloud: Volume | None = None,
        rank: int = 0,
        grain: bool = True,
        samples: int = 8,
        rng: Any = 0,
        progress: Progress = None,
    ) -> NDArray[np.float32]:
        """Return a photograph with the fitted cloud in place of its own: in its sky, behind its ground, with its grain.

        Parameters
        ----------
        photo : Photo, optional
            By default the one that was fitted.
        cloud : Volume, optional
            The density, rendered anew at the photograph's size; by default the basis' picture, which has fewer pixels.
        rank : int
            Place among the ranked, 0 is the best [1].
        grain : bool
            Whether what replaces the photograph's clouds and the sky behind them has the noise that its sky has.
        samples : int
            Paths of a pixel, with `cloud` [1].
        {rng}
        {progress}

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear light, of the photograph's size. The cloud is where the photograph's are, and as large.

        Raises
        ------
        ValueError
            The photograph's sky is not known, or the fit has neither basis nor photograph.

        Examples
        --------
        See `clouds`.
        """
        photo = self.photo if photo is None else instance(photo, "photo", Photo)
        flag(grain, "grain")
        height, width, _ = photo.rgb.shape
        if cloud is None:
            params = self.ranked[integer(rank, "rank", 0, len(self.ranked) - 1)].params
            dark, bright = (self.basis.image(params, (level,) * 3) for level in (0.0, 1.0))
            own = bright - dark
            place = placement(self.basis.depth > 0, photo.cloud)
            made = warped(dark, place, (height, width), 0.0) + warped(own, place, (height, width), 1.0) * photo.sky_for(
                self.camera.resized(width, height)
            )
        else:
            footprint = self.basis.depth > 0
            camera = aimed(self.camera, placement(footprint, photo.cloud), (height, width))
            sky = photo.sky_for(camera)
            made = self.render(cloud, camera, rank=rank, sky=sky, samples=samples, rng=rng, progress=progress).rgb
        whole = photo.rgb
        # The edge of the ground is softened over a pixel: a mask has steps.
        land = softened(photo.segmentation.ground.astype(np.float32))[..., None]
        if grain:
            made = grainy(made, photo, rng)
        out: NDArray[np.float32] = np.where(land >= 1, whole, land * whole + (1 - land) * made).astype(np.float32)
        return out

    def _repr_html_(self) -> str:
        cells = []
        for rank, candidate in enumerate(self.ranked):
            p = candidate.params
            words = (
                f"<b>{rank}</b>: O = {candidate.objective:.3f}<br>L<sub>in</sub> {p.light_intensity:.2f}, g {p.g:.2f}, "
                f"σ {p.sigma_t:.2g}/m<br>β {p.albedo:.2f}, L<sub>amb</sub> {p.ambient:.2f}<br>"
                f"κ {', '.join(f'{k:.1f}' for k in p.haze)}"
            )
            try:
                picture = f'<img width="240" src="data:image/png;base64,{png_of(self.picture(rank))}"><br>'
            except (ImportError, ValueError):  # no Pillow, or no photograph
                picture = ""
            cells.append(f'<td style="text-align:left">{picture}{words}</td>')
        rows = "".join(f"<tr>{''.join(cells[i : i + 4])}</tr>" for i in range(0, len(cells), 4))
        known = ", ".join(f"{name} {low:.3g} to {high:.3g}" for name, (low, high) in self.intervals.items())
        return f"<p>{self._words()}</p><p>{self.explained}</p><p>intervals: {known}</p><table>{rows}</table>"


def _pairs(data: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    return {str(name): (float(low), float(high)) for name, (low, high) in data.items()}


def _read(cls: type[CloudFit], data: Mapping[str, Any]) -> CloudFit:
    if data.get("kind") != "cloud fit" or not isinstance(data.get("format"), int):
        msg = "a CloudFit must be read from its data, of the kind 'cloud fit' with a format"
        raise ValueError(msg)
    if data["format"] > _FORMAT:
        msg = (
            f"the data are of a CloudFit of format {data['format']}: this pleinair, {version()}, reads up to {_FORMAT}"
        )
        raise ValueError(msg)
    try:
        columns = [data["history"][name] for name in HISTORY.names or ()]
        history = np.array(list(zip(*columns, strict=True)), dtype=HISTORY)
        orders = data["orders"]
        return cls(
            ranked=[Candidate(build(Params, c["params"]), float(c["objective"])) for c in data["ranked"]],
            history=history,
            stopped=str(data["stopped"]),
            sun=build(Sun, data["sun"]),
            camera=build(Camera, data["camera"]),
            conventions=build(Conventions, data["conventions"]),
            orders=None if orders is None else int(orders),
            noise=float(data["noise"]),
            spread={str(name): float(value) for name, value in data["spread"].items()},
            intervals=_pairs(data.get("intervals", {})),
            searched=_pairs(data.get("searched", {})),
            tried=tuple(
                Tried(build(Sun, t["sun"]), t["haze_height"], float(t["objective"]), int(t["calls"]))
                for t in data["tried"]
            ),
        )
    except KeyError as error:
        msg = f"a CloudFit must be read from its data: it has no {error}"
        raise ValueError(msg) from None
    except (ValueError, TypeError, AttributeError, OverflowError) as error:
        msg = f"a CloudFit must be read from its data: {error}"
        raise ValueError(msg) from None


def pair_of(value: Any, name: str) -> tuple[Any, Any]:
    """Return two values."""
    try:
        a, b = value
    except (TypeError, ValueError):
        msg = f"{name} must be a pair, got {value!r}"
        raise TypeError(msg) from None
    return a, b

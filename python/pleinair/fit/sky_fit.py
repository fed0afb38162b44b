"""The sky that gives a picture its sky: reference picture in, style or air out (AOAS, Fig. 1). Public as `pleinair.fit.sky`.

Differential evolution for the least mean colour difference in Lab between the picture and the shown sky. Of a style: the
Sun's place, the scattering of molecules (the Rayleigh vector) and of haze, the intensity. Of the air: the Sun's place,
turbidity and ozone, looked up in a table of clear skies (scripts/make_clear_sky_table.py, within 3 % of `Physical`), the
best judged by `Physical` itself; the exposure is that of equal median luminance.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.docs import documented
from .._support.inputs import Progress, boolean_mask, choice, instance, integer, linear_light, real
from ..astro import Sun
from ..camera import Camera
from ..color import luminance, rgb_to_lab
from ..image import resize
from ..sky import Aoas, Natural, Physical
from ..tone import oneil
from .optimise import DifferentialEvolution, run_search, search_settings

FittedSky: TypeAlias = Aoas | Physical | Natural

# Searched, with the bounds and the scale of each. The azimuth is from the view's, the elevation of the view joins them
# where no camera is given.
_GENES = {
    "elevation": (-3.0, 90.0, "linear"),
    "azimuth": (-180.0, 180.0, "linear"),
    "red": (1e-4, 0.3, "log"),
    "green": (1e-4, 0.3, "log"),
    "blue": (1e-4, 0.3, "log"),
    "mie": (1e-6, 0.05, "log"),
    "g": (0.0, 0.995, "atanh"),
    "sun_intensity": (1.0, 400.0, "log"),
}
_AIR = {
    "elevation": (-4.0, 89.0, "linear"),
    "azimuth": (-180.0, 180.0, "linear"),
    "turbidity": (1.5, 10.0, "log"),
    "ozone": (100.0, 600.0, "linear"),
}
_VIEW = (-5.0, 45.0, "linear")
# Axes of the table and what is searched along them.
_NODES = (("ozone", "ozone"), ("turbidity", "turbidity"), ("sun", "elevation"))
# Pixels of the longer side in the search, and of the picture that the answer is judged on.
_SEARCHED, _JUDGED = 40, 160
# Styles within so much of the best are as good: a difference that nobody sees [ΔE].
_ALIKE = 0.5


@dataclass(frozen=True, eq=False)
class SkyFit:
    """The styles that come closest to a picture's sky.

    Attributes
    ----------
    ranked : list of (Aoas, Physical or Natural, float)
        Skies and their mean colour difference from the picture in the search [ΔE], best first.
    camera : Camera
        The view; what was found of it where none was given.
    exposure : float
        Of O'Neil's curve, by which a style is shown [1]; of an air, what its cd/m² are multiplied by [m²/cd].
    difference : float
        Median colour difference of the best over the picture's sky [ΔE].
    intervals : dict of str to (float, float)
        Lowest and highest value of each parameter among styles that look the same (within half a ΔE of the best).
    picture : ndarray (height, width, 3) of float32
        What was asked for, small.
    calls : int
        Skies that were tried [1].
    """

    ranked: list[tuple[FittedSky, float]]
    camera: Camera
    exposure: float
    difference: float
    intervals: dict[str, tuple[float, float]]
    picture: NDArray[np.float32] = field(repr=False)
    calls: int = 0

    @property
    def sky(self) -> FittedSky:
        """The best sky."""
        return self.ranked[0][0]

    def show(self, camera: Camera | None = None, rank: int = 0) -> NDArray[np.float32]:
        """Return a found sky as it is compared with the picture, linear light (height, width, 3).

        Parameters
        ----------
        camera : Camera, optional
            From where; by default the view that was found.
        rank : int
            Place among the ranked, 0 is the best [1].

        Examples
        --------
        See `sky`.
        """
        found = self.ranked[integer(rank, "rank", 0, len(self.ranked) - 1)][0]
        return _shown(found, self.camera if camera is None else camera, self.exposure)

    def preview(self) -> NDArray[np.float32]:
        """Return the picture and the best sky side by side (height, 2 width, 3), linear light.

        Examples
        --------
        See `sky`.
        """
        height, width, _ = self.picture.shape
        return np.concatenate([self.picture, self.show(self.camera.resized(width, height))], axis=1)

    def to_json(self) -> str:
        """Return the best sky as JSON, with what is known of it beside: a style, or model, Sun, turbidity and ozone of an air.

        Examples
        --------
        See `sky`.
        """
        if isinstance(self.sky, Aoas):
            sky = json.loads(self.sky.to_json())
        else:
            name = "natural" if isinstance(self.sky, Natural) else "physical"
            given = {"turbidity": self.sky.turbidity, "ozone": self.sky.ozone}
            sky = {"model": name, "sun": dataclasses.asdict(instance(self.sky.sun, "sun", Sun)), **given}
        about = {"difference": self.difference, "exposure": self.exposure, "camera": dataclasses.asdict(self.camera)}
        return json.dumps({"sky": sky, "fit": about | {"intervals": self.intervals}})


def _aimed(genes: dict[str, float], view: Camera) -> Camera:
    """Return the view, at the elevation that is searched with the rest where no camera was given."""
    return dataclasses.replace(view, elevation=genes["view"]) if "view" in genes else view


def _style(genes: dict[str, float], view: Camera) -> tuple[Aoas, Camera]:
    camera = _aimed(genes, view)
    sun = Sun(genes["elevation"], (camera.azimuth + genes["azimuth"]) % 360)
    vector = (genes["red"], genes["green"], genes["blue"])
    return Aoas(sun, vector, mie=genes["mie"], g=genes["g"], sun_intensity=genes["sun_intensity"]), camera


def _air(genes: dict[str, float], view: Camera, model: str) -> tuple[FittedSky, Camera]:
    camera = _aimed(genes, view)
    sun = Sun(genes["elevation"], (camera.azimuth + genes["azimuth"]) % 360)
    kind = Physical if model == "physical" else Natural
    return kind(sun=sun, turbidity=genes["turbidity"], ozone=genes["ozone"]), camera


def _shown(sky: FittedSky, camera: Camera, exposure: float) -> NDArray[np.float32]:
    if isinstance(sky, Aoas):
        return oneil(sky.render(camera), exposure)
    return np.asarray(np.clip(sky.without_disc().render(camera) * np.float32(exposure), 0, 1), np.float32)


@functools.cache
def _table() -> dict[str, NDArray[Any]]:
    with as_file(files("pleinair.data") / "clear_skies.npz") as path, np.load(path) as stored:
        return {name: stored[name].astype(np.float32) for name in stored.files}


def _weights(nodes: NDArray[np.float32], value: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the first of two nodes and the share of the second, beyond the ends by the last two."""
    at = np.clip(np.searchsorted(nodes, value, side="right") - 1, 0, len(nodes) - 2)
    return at, (value - nodes[at]) / (nodes[at + 1] - nodes[at])


class _ClearSkies:
    """Skies of the table as seen by a camera: the directions of its pixels stay while the air changes."""

    def __init__(self, camera: Camera, seen: NDArray[np.bool_]) -> None:
        self.camera, self.seen, self.elevation = camera, seen, math.nan

    def _aim(self, camera: Camera) -> None:
        if camera.elevation != self.elevation:
            self.elevation = camera.elevation
            d = camera.directions()[self.seen]
            self.zenith = np.degrees(np.arccos(np.clip(d[:, 2], -1, 1)))
            self.azimuth = np.degrees(np.arctan2(d[:, 0], d[:, 1]))

    def light(self, genes: dict[str, float]) -> NDArray[np.float64]:
        """Radiance of the seen pixels (n, 3) [cd/m²]."""
        table = _table()
        self._aim(_aimed(genes, self.camera))
        dome: Any = 0.0
        (o, a), (k, b), (e, c) = (_weights(table[n], genes[g]) for n, g in _NODES)
        for corner in range(8):
            x, y, z = corner & 1, corner >> 1 & 1, corner >> 2
            share = (a if x else 1 - a) * (b if y else 1 - b) * (c if z else 1 - c)
            dome = dome + table["radiance"][o + x, k + y, e + z] * np.float32(share)
        aside = np.abs((self.azimuth - self.camera.azimuth - genes["azimuth"] + 180) % 360 - 180)
        i, u = _weights(table["zenith"], np.minimum(self.zenith, 90.0))
        j, v = _weights(table["azimuth"], aside)
        u, v = u[:, None], v[:, None]
        upper = dome[i, j] * (1 - v) + dome[i, j + 1] * v
        lower = dome[i + 1, j] * (1 - v) + dome[i + 1, j + 1] * v
        return np.asarray(np.exp(upper * (1 - u) + lower * u), np.float64)


def _middle(light: NDArray[Any]) -> float:
    """Median luminance: what is cut off at white does not move it."""
    return float(np.median(luminance(np.ascontiguousarray(light, np.float32))))


@documented
def sky(
    picture: ArrayLike,
    model: str = "aoas",
    *,
    mask: ArrayLike | None = None,
    camera: Camera | None = None,
    exposure: float = 2.0,
    generations: int = 75,
    keep: int = 4,
    rng: Any = None,
    progress: Progress = None,
) -> SkyFit:
    """Find the sky that gives a picture its sky: a style, or the air.

    Parameters
    ----------
    picture : array_like (height, width, 3)
        A photograph, a poster or a painting, as `pleinair.io.read` reads it: linear light, white is 1.
    model : {"aoas", "physical", "natural"}
        A style, or the Sun's place, turbidity and ozone of a `Physical` or `Natural` sky.
    mask : array_like (height, width) of bool, optional
        Where the picture shows a sky without clouds, such as `Photo.segmentation.sky`; by default everywhere.
    camera : Camera, optional
        The view; by default one of 60° to the south, whose elevation is searched, too.
    exposure : float
        Of O'Neil's curve, by which styles are shown, in [1e-6, 1e6] [1]. That of an air is found.
    generations : int
        Most generations of 20 skies, in [1, 100000] [1].
    keep : int
        Skies to return, in [1, 1000] [1].
    {rng}
    {progress}

    Returns
    -------
    SkyFit
        Styles, how close they come, and how far each parameter is known.

    Raises
    ------
    ValueError, TypeError
        The picture is no picture, the mask leaves nothing of it, or an argument is out of range.

    Notes
    -----
    Shen, Mallett and Shkurko 2019, Fig. 1: the way back from a reference picture. Differences are those of CIE 1976. An air
    has the colours that an air can have: a poster or a picture with a white balance of its own wants a style.

    Examples
    --------
    >>> import pleinair as pa
    >>> view = Camera(48, 32, 60, 180, 20)
    >>> poster = pa.tone.oneil(pa.sky.preset("coral").render(view), 2.0)
    >>> found = pa.fit.sky(poster, camera=view, generations=4, rng=0)
    >>> found.calls, found.preview().shape
    (80, (32, 96, 3))
    >>> found.show().shape
    (32, 48, 3)
    """
    choice(model, "model", ("aoas", "physical", "natural"))
    rgb = linear_light(picture, "picture", ndim=3, last=3).astype(np.float32)
    if rgb.size == 0 or not np.isfinite(rgb).all():
        msg = f"picture must be finite and not empty, got shape {rgb.shape}"
        raise ValueError(msg)
    where = np.ones(rgb.shape[:2], np.bool_) if mask is None else boolean_mask(mask, "mask", rgb.shape[:2])
    exposure = real(exposure, "exposure", 1e-6, 1e6)
    height, width = where.shape
    view = Camera(width, height, 60.0, 180.0, 20.0) if camera is None else instance(camera, "camera", Camera)
    view = view.resized(width, height)
    if model != "aoas" and camera is not None:
        where = where & (view.directions()[..., 2] > 0)  # below the horizon is no sky
    small, seen = _reduced(rgb, where, _SEARCHED)
    if not seen.any():
        msg = "mask must leave some of the picture's sky"
        raise ValueError(msg)
    searched = _GENES if model == "aoas" else _AIR
    genes = dict(searched) if camera is not None else searched | {"view": _VIEW}
    target = rgb_to_lab(small)[seen]
    middle = _middle(small[seen])
    eye = view.resized(small.shape[1], small.shape[0])
    tried: list[tuple[NDArray[np.float64], float]] = []
    skies = _ClearSkies(eye, seen)

    def named(x: NDArray[np.float64]) -> dict[str, float]:
        return dict(zip(genes, x.tolist(), strict=True))

    def of(x: NDArray[np.float64]) -> tuple[FittedSky, Camera]:
        return _style(named(x), view) if model == "aoas" else _air(named(x), view, model)

    def off(x: NDArray[np.float64]) -> float:
        if model == "aoas":
            style, at = of(x)
            at = at.resized(eye.width, eye.height)
            shown = rgb_to_lab(oneil(style.render(at, tolerance=0.01), exposure))[seen]
        else:
            light = skies.light(named(x))
            light *= middle / max(_middle(light), 1e-12)
            shown = rgb_to_lab(np.clip(light, 0, 1).astype(np.float32))
        return float(np.sqrt(np.square(shown - target).sum(-1)).mean())

    def objective(rows: NDArray[np.float64]) -> NDArray[np.float64]:
        values = np.array([off(x) for x in rows])
        tried.extend(zip(rows.copy(), values, strict=True))
        return values

    settings = search_settings(
        DifferentialEvolution(population=20),
        [(low, high) for low, high, _ in genes.values()],
        integer(generations, "generations", 1, 100_000),
        integer(keep, "keep", 1, 1000),
        0.05,
        rng,
        [scale for _, _, scale in genes.values()],
    )
    found = run_search(objective, settings, progress)
    ranked = [(*of(x), value) for x, value in found.ranked]
    best, at, _ = ranked[0]
    judged, inside = _reduced(rgb, where, _JUDGED)
    size = (judged.shape[1], judged.shape[0])
    if model != "aoas":
        light = best.without_disc().render(at.resized(*size))
        exposure = _middle(judged[inside]) / max(_middle(light[inside]), 1e-12)
        shown = np.clip(light * np.float32(exposure), 0, 1)
    else:
        shown = _shown(best, at.resized(*size), exposure)
    alike = np.array([x for x, value in tried if value <= found.fun + _ALIKE])
    spans = {name: (float(a), float(b)) for name, a, b in zip(genes, alike.min(0), alike.max(0), strict=True)}
    difference = float(np.median(np.sqrt(np.square(rgb_to_lab(shown) - rgb_to_lab(judged)).sum(-1))[inside]))
    return SkyFit([(one, value) for one, _, value in ranked], at, exposure, difference, spans, judged, found.calls)


def _reduced(
    rgb: NDArray[np.float32], where: NDArray[np.bool_], side: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return a picture of at most so many pixels a side, and which of its pixels are all sky."""
    scale = min(1.0, side / max(where.shape))
    height, width = (max(1, round(n * scale)) for n in where.shape)
    return resize(rgb, width, height), resize(where.astype(np.float32), width, height) > 0.99

"""The sky style that gives a picture its sky: reference picture in, style out (AOAS, Fig. 1). Public as `pleinair.fit.sky`.

The Sun's place, the scattering of molecules (the Rayleigh vector) and of haze, and the intensity are searched by
differential evolution for the least mean colour difference in Lab between the picture and the shown style.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._support.docs import documented
from .._support.inputs import Progress, boolean_mask, choice, instance, integer, linear_light, real
from ..astro import Sun
from ..camera import Camera
from ..color import rgb_to_lab
from ..image import resize
from ..sky import Aoas
from ..tone import oneil
from .optimise import DifferentialEvolution, run_search, search_settings

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
_VIEW = (-5.0, 45.0, "linear")
# Pixels of the longer side in the search, and of the picture that the answer is judged on.
_SEARCHED, _JUDGED = 40, 160
# Styles within so much of the best are as good: a difference that nobody sees [ΔE].
_ALIKE = 0.5


@dataclass(frozen=True, eq=False)
class SkyFit:
    """The styles that come closest to a picture's sky.

    Attributes
    ----------
    ranked : list of (Aoas, float)
        Styles and their mean colour difference from the picture in the search [ΔE], best first.
    camera : Camera
        The view; what was found of it where none was given.
    exposure : float
        Of O'Neil's curve, by which the style is shown [1].
    difference : float
        Median colour difference of the best over the picture's sky [ΔE].
    intervals : dict of str to (float, float)
        Lowest and highest value of each parameter among styles that look the same (within half a ΔE of the best).
    picture : ndarray (height, width, 3) of float32
        What was asked for, small.
    calls : int
        Styles that were tried [1].
    """

    ranked: list[tuple[Aoas, float]]
    camera: Camera
    exposure: float
    difference: float
    intervals: dict[str, tuple[float, float]]
    picture: NDArray[np.float32] = field(repr=False)
    calls: int = 0

    @property
    def sky(self) -> Aoas:
        """The best style."""
        return self.ranked[0][0]

    def preview(self) -> NDArray[np.float32]:
        """Return the picture and the best style side by side (height, 2 width, 3), linear light.

        Examples
        --------
        See `sky`.
        """
        height, width, _ = self.picture.shape
        shown = oneil(self.sky.render(self.camera.resized(width, height)), self.exposure)
        return np.concatenate([self.picture, shown], axis=1)

    def to_json(self) -> str:
        """Return the best style as JSON of a style, with what is known of it beside.

        Examples
        --------
        See `sky`.
        """
        about = {"difference": self.difference, "exposure": self.exposure, "camera": dataclasses.asdict(self.camera)}
        return json.dumps({"sky": json.loads(self.sky.to_json()), "fit": about | {"intervals": self.intervals}})


def _style(genes: dict[str, float], view: Camera) -> tuple[Aoas, Camera]:
    camera = view if "view" not in genes else dataclasses.replace(view, elevation=genes["view"])
    sun = Sun(genes["elevation"], (camera.azimuth + genes["azimuth"]) % 360)
    vector = (genes["red"], genes["green"], genes["blue"])
    return Aoas(sun, vector, mie=genes["mie"], g=genes["g"], sun_intensity=genes["sun_intensity"]), camera


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
    """Find the sky style that gives a picture its sky.

    Parameters
    ----------
    picture : array_like (height, width, 3)
        A photograph, a poster or a painting, as `pleinair.io.read` reads it: linear light, white is 1.
    model : {"aoas"}
        What is searched.
    mask : array_like (height, width) of bool, optional
        Where the picture shows a sky without clouds, such as `Photo.segmentation.sky`; by default everywhere.
    camera : Camera, optional
        The view; by default one of 60° to the south, whose elevation is searched, too.
    exposure : float
        Of O'Neil's curve, by which styles are shown, in [1e-6, 1e6] [1].
    generations : int
        Most generations of 20 styles, in [1, 100000] [1].
    keep : int
        Styles to return, in [1, 1000] [1].
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
    Shen, Mallett and Shkurko 2019, Fig. 1: the way back from a reference picture. Differences are those of CIE 1976.

    Examples
    --------
    >>> import pleinair as pa
    >>> view = Camera(48, 32, 60, 180, 20)
    >>> poster = pa.tone.oneil(pa.sky.preset("coral").render(view), 2.0)
    >>> found = pa.fit.sky(poster, camera=view, generations=4, rng=0)
    >>> found.calls, found.preview().shape
    (80, (32, 96, 3))
    """
    choice(model, "model", ("aoas",))
    rgb = linear_light(picture, "picture", ndim=3, last=3).astype(np.float32)
    if rgb.size == 0 or not np.isfinite(rgb).all():
        msg = f"picture must be finite and not empty, got shape {rgb.shape}"
        raise ValueError(msg)
    where = np.ones(rgb.shape[:2], np.bool_) if mask is None else boolean_mask(mask, "mask", rgb.shape[:2])
    exposure = real(exposure, "exposure", 1e-6, 1e6)
    height, width = where.shape
    view = Camera(width, height, 60.0, 180.0, 20.0) if camera is None else instance(camera, "camera", Camera)
    view = view.resized(width, height)
    small, seen = _reduced(rgb, where, _SEARCHED)
    if not seen.any():
        msg = "mask must leave some of the picture's sky"
        raise ValueError(msg)
    genes = dict(_GENES) if camera is not None else _GENES | {"view": _VIEW}
    target = rgb_to_lab(small)[seen]
    eye = view.resized(small.shape[1], small.shape[0])
    tried: list[tuple[NDArray[np.float64], float]] = []

    def off(x: NDArray[np.float64]) -> float:
        style, at = _style(dict(zip(genes, x.tolist(), strict=True)), eye)
        shown = rgb_to_lab(oneil(style.render(at, tolerance=0.01), exposure))[seen]
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
    ranked = [(_style(dict(zip(genes, x.tolist(), strict=True)), view), value) for x, value in found.ranked]
    best, at = ranked[0][0]
    alike = np.array([x for x, value in tried if value <= found.fun + _ALIKE])
    spans = {name: (float(a), float(b)) for name, a, b in zip(genes, alike.min(0), alike.max(0), strict=True)}
    judged, seen = _reduced(rgb, where, _JUDGED)
    shown = rgb_to_lab(oneil(best.render(at.resized(judged.shape[1], judged.shape[0])), exposure))
    difference = float(np.median(np.sqrt(np.square(shown - rgb_to_lab(judged)).sum(-1))[seen]))
    return SkyFit(
        [(style, value) for (style, _), value in ranked], at, exposure, difference, spans, judged, found.calls
    )


def _reduced(
    rgb: NDArray[np.float32], where: NDArray[np.bool_], side: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return a picture of at most so many pixels a side, and which of its pixels are all sky."""
    scale = min(1.0, side / max(where.shape))
    height, width = (max(1, round(n * scale)) for n in where.shape)
    return resize(rgb, width, height), resize(where.astype(np.float32), width, height) > 0.99

"""Image operations without physics: histograms, Otsu's threshold, segmentation of sky and cloud, Laplace fill, resizing."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import (
    classify_sky,
    ground_mask,
    histogram_counts,
    histogram_edges,
    image_resize,
    laplace_fill,
    mask_dilate,
    otsu_threshold,
)
from ._support.inputs import (
    Aligned,
    DomainWarning,
    array,
    boolean_mask,
    choice,
    integer,
    linear_light,
    real,
    shape_text,
)

__all__ = [
    "Histogram",
    "Segmentation",
    "Threshold",
    "dilate",
    "fill",
    "histogram",
    "otsu",
    "resize",
    "segment_sky",
]

_NATIVE = (np.uint8, np.uint16, np.float32, np.float64)
_RANGES = {np.dtype(np.uint8): (0.0, 256.0), np.dtype(np.uint16): (0.0, 65536.0)}


class Histogram(tuple[NDArray[np.uint64], NDArray[np.float64]]):
    """Counts and bin edges of a picture: unpacks as ``counts, edges``.

    Attributes
    ----------
    counts : ndarray of uint64, shape (channels, bins)
        Samples in each bin [1].
    edges : ndarray of float64, shape (bins + 1,)
        Edges of the bins, in the units of the picture.
    under, over, nan : ndarray of uint64, shape (channels,)
        Samples below the first edge, above the last, and NaN [1].
    """

    under: NDArray[np.uint64]
    over: NDArray[np.uint64]
    nan: NDArray[np.uint64]

    def __new__(
        cls,
        counts: NDArray[np.uint64],
        edges: NDArray[np.float64],
        under: NDArray[np.uint64],
        over: NDArray[np.uint64],
        nan: NDArray[np.uint64],
    ) -> Self:
        """Put the five arrays together."""
        self = super().__new__(cls, (counts, edges))
        self.under, self.over, self.nan = under, over, nan
        return self

    @property
    def counts(self) -> NDArray[np.uint64]:
        """Samples in each bin, shape (channels, bins) [1]."""
        return self[0]

    @property
    def edges(self) -> NDArray[np.float64]:
        """Edges of the bins, shape (bins + 1,)."""
        return self[1]

    def __getnewargs__(self) -> tuple[Any, ...]:
        return (self[0], self[1], self.under, self.over, self.nan)

    def __repr__(self) -> str:
        channels, bins = self.counts.shape
        return (
            f"Histogram({channels} × {bins} bins over [{self.edges[0]:g}, {self.edges[-1]:g}], {self.counts.sum()} in, "
            f"{self.under.sum()} under, {self.over.sum()} over, {self.nan.sum()} NaN)"
        )


@dataclass(frozen=True)
class Threshold:
    """Where two classes part: class 1 is ``x > value``.

    Attributes
    ----------
    value : float
        The threshold, in the units of the picture.
    separability : float
        Variance between the classes over the total variance, in [0, 1] [1]; 0 where there is only one class.
    """

    value: float
    separability: float


@dataclass(frozen=True, eq=False)
class Segmentation(Aligned):
    """Ground, cloud and sky of a photograph; each pixel is exactly one of them.

    Attributes
    ----------
    cloud, ground, sky : ndarray of bool, shape (h, w)
        The classes: always the best guess, whatever the verdict.
    feature : ndarray of float32, shape (h, w)
        What the pixels were judged by, larger is bluer [1].
    threshold : float
        Sky is ``feature > threshold`` [1] unless `verdict` is "overcast" or the classes are `inverted`.
    separability : float
        Variance between the two sides of the threshold over the variance of the feature, in [0, 1] [1].
    contrast : float
        Median step of the feature across the border between the sides over the difference of their means [1].
    verdict : str
        "mixed", "cloudless", "overcast" or "night".
    method : str
        "nbr" or "chroma".
    structure : float
        Deviation of what a cubic surface leaves of the feature [1]: clouds have structure where they have no edges.
    confidence : float
        How clear the verdict is, in [0.5, 1] [1].
    inverted : bool
        Whether the sky is redder than its clouds, as under a low Sun: cloud is ``feature > threshold``.
    """

    cloud: NDArray[np.bool_]
    ground: NDArray[np.bool_]
    sky: NDArray[np.bool_]
    feature: NDArray[np.float32]
    threshold: float
    separability: float
    contrast: float
    verdict: str
    method: str
    structure: float = 0.0
    confidence: float = 1.0
    inverted: bool = False


def histogram(
    img: ArrayLike,
    bins: int = 256,
    range: tuple[float, float] | None = None,  # numpy's name for it
    mask: ArrayLike | None = None,
) -> Histogram:
    """Count the samples of each channel exactly.

    The bin of x is ``floor((x - low) * (bins / (high - low)))`` in double precision, and the last bin includes its
    upper edge, as in `numpy.histogram`. For each channel, ``counts.sum() + under + over + nan`` is the number of
    pixels looked at.

    Parameters
    ----------
    img : array_like, shape (n,), (h, w) or (h, w, c) with c ≤ 4
        The picture. uint8, uint16, float32 and float64 are read as they are, other real numbers as float64.
    bins : int
        Number of bins, 1 to 2²⁰ [1].
    range : (float, float), optional
        Lower and upper edge [unit of the picture]. Default: (0, 1) for floats and booleans, (0, 256) for
        uint8, (0, 65536) for uint16; other integers need it.
    mask : array_like of bool, shape (n,) or (h, w), optional
        Count only the pixels where this is true.

    Returns
    -------
    Histogram
        ``counts`` uint64 (channels, bins) and ``edges`` float64 (bins + 1,): bin k counts the samples x with
        ``edges[k] <= x < edges[k + 1]``, the last one x = ``edges[-1]`` too; beside them `under`, `over` and `nan`,
        uint64 (channels,).

    Raises
    ------
    ValueError
        A shape, range or number of bins that is not allowed, by the name of its argument.
    TypeError
        Not numbers, by the name of the argument.

    Examples
    --------
    >>> import numpy as np, pleinair as pa
    >>> counts, edges = pa.image.histogram(np.array([[0.1, 0.3], [0.3, 1.0]]), bins=4)
    >>> counts.tolist(), edges.tolist()
    ([[1, 2, 0, 1]], [0.0, 0.25, 0.5, 0.75, 1.0])
    """
    picture = array(img, "img", dtypes=_NATIVE)
    given = np.asarray(img)
    if not 1 <= picture.ndim <= 3 or (picture.ndim == 3 and not 1 <= picture.shape[2] <= 4):
        msg = f"img must have shape (n,), (h, w) or (h, w, c) with c <= 4, got {shape_text(picture.shape)}"
        raise ValueError(msg)
    channels = picture.shape[2] if picture.ndim == 3 else 1
    bins = integer(bins, "bins", 1, 1 << 20)
    if range is None:
        if given.dtype.kind in "iu" and picture.dtype not in _RANGES:
            msg = f"range must be given for dtype {given.dtype}"
            raise ValueError(msg)
        range = _RANGES.get(picture.dtype, (0.0, 1.0))
    try:
        low, high = (float(x) for x in range)
    except (TypeError, ValueError):
        msg = f"range must be two numbers (low, high), got {range!r}"
        raise TypeError(msg) from None
    inside = None if mask is None else boolean_mask(mask, "mask", picture.shape[:2])
    counts, under, over, nan = histogram_counts(picture, channels, bins, low, high, inside)
    return Histogram(counts.reshape(channels, bins), histogram_edges(bins, low, high), under, over, nan)


def otsu(img: ArrayLike, mask: ArrayLike | None = None, nbins: int | None = None) -> Threshold:
    """Find the threshold that separates two classes best (Otsu 1979).

    Of all cuts "class 0 is x ≤ t" the one with the largest variance between the classes, and of equal ones the first.
    uint8 and uint16 pictures: exact over their levels, ties included, in integer arithmetic. Others: exact over the
    sorted samples, which are cut midway between two neighbours; for the comparison the samples are rounded to a grid
    of at least 2⁴⁰ steps over their range (up to 4 million samples; half as many steps whenever that number doubles).
    The value returned is a number of the picture's own dtype, so that ``img > value`` is the partition found.

    Parameters
    ----------
    img : array_like, any shape
        The samples, all of one kind. uint8, uint16, float32 and float64 are read as they are, others as float64.
    mask : array_like of bool, shape of img, optional
        Look only at the samples where this is true.
    nbins : int, optional
        For floating-point samples, the threshold of a histogram of so many bins [1] over [min, max] instead, returned
        as the centre of the last bin of class 0: what `skimage.filters.threshold_otsu` computes, and as fragile
        against outliers. Integer pictures have their levels as bins, whatever this says.

    Returns
    -------
    Threshold
        `value` in the units of the picture, `separability` in [0, 1] [1]. Samples that are all equal give that value
        and separability 0: no foreground.

    Raises
    ------
    ValueError
        No samples, or samples that are NaN or infinite where they are looked at.
    TypeError
        Not numbers, by the name of the argument.

    Examples
    --------
    >>> import numpy as np, pleinair as pa
    >>> pa.image.otsu(np.array([10, 12, 11, 200, 210], dtype=np.uint8))
    Threshold(value=12.0, separability=0.998...)
    """
    picture = array(img, "img", dtypes=_NATIVE)
    inside = None if mask is None else boolean_mask(mask, "mask", picture.shape)
    if nbins is not None:
        nbins = integer(nbins, "nbins", 2, 1 << 20)
    return Threshold(*otsu_threshold(picture, inside, nbins))


def fill(
    img: ArrayLike,
    mask: ArrayLike,
    *,
    outside: ArrayLike | None = None,
    tolerance: float = 0.05 / 255,
) -> NDArray[Any]:
    """Continue a picture smoothly into its masked pixels: Laplace's equation.

    Each masked pixel becomes the mean of its neighbours (four, fewer at the border of the picture, where the normal
    derivative vanishes); known pixels keep their values. Pérez, Gangnet, Blake 2003 without guidance; the sky behind
    the clouds of Dobashi et al. 2012 §4.1.

    Parameters
    ----------
    img : array_like, shape (h, w) or (h, w, c)
        The picture. float32 and float64 are kept, other real numbers become float64. Masked pixels may hold anything.
    mask : array_like of bool, shape (h, w)
        True where the picture is to be filled.
    outside : float or array_like, shape (c,), optional
        What a picture gets that is masked everywhere, in its units; may be NaN. Default: that is an error, because
        nothing determines the fill. (Any other masked region touches a known pixel.)
    tolerance : float
        Largest error wanted, as a fraction of the range of the known values around the holes, per channel [1],
        in [1e-12, 1].

    Returns
    -------
    ndarray, shape and dtype of img
        A filled copy.

    Raises
    ------
    ValueError
        NaN or infinity in known pixels, no known pixel at all while `outside` is not given, or wrong shapes.
    TypeError
        Not numbers, by the name of the argument.

    Examples
    --------
    >>> import numpy as np, pleinair as pa
    >>> ramp = np.linspace(0, 1, 5) + np.zeros((5, 1))
    >>> mask = np.zeros((5, 5), bool)
    >>> mask[1:4, 1:4] = True
    >>> np.abs(pa.image.fill(np.where(mask, 9, ramp), mask) - ramp).max() < 1e-4
    np.True_
    """
    picture = array(img, "img")
    if picture.ndim not in (2, 3) or 0 in picture.shape[2:]:
        msg = f"img must have shape (h, w) or (h, w, c), got {shape_text(picture.shape)}"
        raise ValueError(msg)
    h, w = picture.shape[:2]
    channels = picture.shape[2] if picture.ndim == 3 else 1
    hole = boolean_mask(mask, "mask", (h, w))
    tolerance = real(tolerance, "tolerance", 1e-12, 1.0)
    colour = None
    if outside is not None:
        value = array(outside, "outside", dtypes=(np.float64,))
        if value.shape not in ((), (channels,)):
            msg = f"outside must be a number or have shape ({channels},), got {shape_text(value.shape)}"
            raise ValueError(msg)
        colour = np.broadcast_to(value, (channels,)).tolist()
    out = laplace_fill(picture, (h, w, channels), hole, colour, tolerance)
    return out.reshape(picture.shape)


def _linear(photo: ArrayLike) -> NDArray[np.float32]:
    """Return a picture as linear float32 (h, w, 3); uint8 is taken as sRGB."""
    if getattr(photo, "dtype", np.asarray(photo).dtype) != np.uint8:
        photo = linear_light(photo, "photo")
    picture = array(photo, "photo", dtypes=(np.uint8, np.float32, np.float64), ndim=3, last=3)
    if 0 in picture.shape:
        msg = f"photo must not be empty, got shape {shape_text(picture.shape)}"
        raise ValueError(msg)
    if picture.dtype == np.uint8:
        code = np.arange(256) / 255
        table = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4).astype(np.float32)
        return table[picture]
    if not np.isfinite(picture).all() or np.abs(picture).max() > 1e30:
        msg = "photo must be finite and below 1e30 in magnitude, got NaN, infinity or more"
        raise ValueError(msg)
    return picture.astype(np.float32, copy=False)


def segment_sky(
    photo: ArrayLike,
    *,
    method: str = "nbr",
    ground: ArrayLike | str | None = "auto",
    cloud: ArrayLike | None = None,
    prior: float = 0.05,
) -> Segmentation:
    """Tell ground, cloud and sky of a photograph apart.

    The sky is judged by (B − R) / (B + R) of linear light and Otsu's threshold (1979) of its histogram, mixed with a
    little of a prior of two lobes, N(0.12, 0.08) for cloud and N(0.58, 0.10) for sky. Dobashi et al. 2012 §4.1 classify
    by chroma and let the user correct: ``method="chroma"``, `ground` and `cloud`.

    The split is believed (`verdict` "mixed") if each side holds 0.5 % of the pixels, the means of the sides differ by
    0.1, and they meet at edges: `contrast` ≥ 0.19, which haze at the horizon and the glow of the Sun do not reach.
    Otherwise the verdict is "overcast" (everything is cloud) where the pixels are grey, nine of ten features below 0.25
    and nine of ten within 0.4 of each other, and "cloudless" (everything is sky) elsewhere. In red light the feature is
    negative throughout and does not tell cloud from glow: a threshold below 0, or a mean below -0.3, comes with a
    `pleinair.DomainWarning`; give `cloud` there.

    Parameters
    ----------
    photo : array_like, shape (h, w, 3)
        Linear light, Rec. 709 primaries, any unit; uint8 is taken as sRGB and decoded. Negative light counts as none.
    method : {"nbr", "chroma"}
        "chroma": HSV saturation of the sRGB-encoded values and Otsu's threshold without a prior.
    ground : "auto", None or array_like of bool, shape (h, w)
        What is not sky. "auto" looks for a skyline with land, water or trees below it; None: there is no ground.
    cloud : array_like of bool, shape (h, w), optional
        The clouds, as the user sees them: only the ground is taken out, and the verdict follows.
    prior : float
        Weight of the prior, in [0, 1) [1].

    Returns
    -------
    Segmentation
        The three masks, the feature [1], the threshold [1] and how far to trust it.

    Raises
    ------
    ValueError
        NaN or infinity, wrong shapes, or no sky at all.
    TypeError
        Not numbers, by the name of the argument.

    Examples
    --------
    >>> import numpy as np, pleinair as pa
    >>> photo = np.full((60, 80, 3), (0.1, 0.2, 0.5), np.float32)
    >>> photo[20:40, 20:60] = 0.8
    >>> found = pa.image.segment_sky(photo)
    >>> found.verdict, int(found.cloud.sum())
    ('mixed', 800)
    """
    picture = _linear(photo)
    method = choice(method, "method", ("nbr", "chroma"))
    prior = real(prior, "prior", 0.0, 0.99)
    shape = (picture.shape[0], picture.shape[1])
    if ground is None:
        land: NDArray[np.bool_] = np.zeros(shape, np.bool_)
    elif isinstance(ground, str):
        choice(ground, "ground", ("auto",))
        land = ground_mask(picture, shape).reshape(shape)
    else:
        land = boolean_mask(ground, "ground", shape)
    given = None if cloud is None else boolean_mask(cloud, "cloud", shape)
    found, feature, (threshold, inverted), separability, signs, judged = classify_sky(
        picture, shape, land, method, prior
    )
    (contrast, structure), (verdict, confidence) = signs, judged
    clouds = found.reshape(shape) if given is None else given & ~land
    sky = ~(clouds | land)
    if given is not None:
        verdict = "cloudless" if not clouds.any() else "mixed" if sky.any() else "overcast"
        confidence = 1.0
    elif method == "nbr" and (threshold < 0 if verdict == "mixed" else feature.mean(where=~land.ravel()) < -0.3):
        msg = "photo: the light is red (features below 0), where colour does not tell cloud from sky; give cloud="
        warnings.warn(msg, DomainWarning, stacklevel=2)
    return Segmentation(
        *(clouds, land, sky, feature.reshape(shape), threshold, separability, contrast, verdict, method),
        structure=structure,
        confidence=confidence,
        inverted=inverted and given is None,
    )


def dilate(mask: ArrayLike, radius: int) -> NDArray[np.bool_]:
    """Grow a mask by a disc.

    Parameters
    ----------
    mask : array_like of bool, shape (h, w)
        The mask.
    radius : int
        Pixels within this distance of a set one, centre to centre, become set; in [0, 4096] [px].

    Returns
    -------
    ndarray of bool, shape (h, w)
        The grown mask.

    Raises
    ------
    ValueError, TypeError
        `mask` is not two-dimensional or not boolean, `radius` is out of range.

    Examples
    --------
    >>> dilate(np.array([[False, False, True]]), 1).tolist()
    [[False, True, True]]
    """
    shape = np.shape(mask)
    if len(shape) != 2:
        msg = f"mask must have 2 dimensions, got shape {shape_text(shape)}"
        raise ValueError(msg)
    given = boolean_mask(mask, "mask", shape)
    return mask_dilate(given, shape, integer(radius, "radius", 0, 4096)).reshape(shape)


def resize(picture: ArrayLike, width: int, height: int) -> NDArray[np.float32]:
    """Resize a picture of linear light by averaging areas.

    Parameters
    ----------
    picture : array_like of float, shape (h, w, c) or (h, w)
        Linear light.
    width, height : int
        The new size, in [1, 65536] [px].

    Returns
    -------
    ndarray of float32, shape (height, width, c) or (height, width)
        Each pixel is the mean of what it covers: the mean light is kept. Enlarging repeats pixels.

    Raises
    ------
    ValueError, TypeError
        `picture` is empty or of the wrong rank, a size is out of range.

    Examples
    --------
    >>> resize(np.array([[0.0, 1.0], [2.0, 3.0]]), 1, 1).tolist()
    [[1.5]]
    """
    pixels = array(picture, "picture").astype(np.float32, copy=False)
    if pixels.ndim not in (2, 3) or pixels.size == 0:
        msg = f"picture must have shape (h, w) or (h, w, c) and pixels, got {shape_text(pixels.shape)}"
        raise ValueError(msg)
    size = (integer(height, "height", 1, 65536), integer(width, "width", 1, 65536))
    cube = pixels.reshape(*pixels.shape[:2], -1)
    out = np.empty((*size, *pixels.shape[2:]), np.float32)
    image_resize(cube, cube.shape, size, out)
    return out

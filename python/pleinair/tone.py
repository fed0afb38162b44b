"""Tone reproduction: the one eye, Tumblin-Rushmeier, O'Neil's curve, night vision, exposure, dithered 8 bits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import (
    tone_display,
    tone_dither,
    tone_levels,
    tone_log_average,
    tone_oneil,
    tone_out_of_gamut,
    tone_present,
    tone_reproduce,
    tone_scotopic,
    tone_show,
)
from ._support.inputs import array, flag, instance, linear_light, real, shape_text

__all__ = [
    "Display",
    "display_level",
    "display_luminance",
    "expose",
    "log_average",
    "oneil",
    "out_of_gamut",
    "present",
    "scotopic",
    "show",
    "to_uint8",
    "tumblin_rushmeier",
]

# The least and the greatest adaptation that is taken [cd/m²]; the eye of the model stops at 1e-3.
_LIGHT = (1e-8, 1e10)


@dataclass(frozen=True)
class Display:
    """A display and the room it stands in.

    Parameters
    ----------
    peak : float
        Greatest luminance, in [1, 1e5] [cd/m²].
    contrast : float
        Greatest over the least, which is the room's light that it reflects, in [1.01, 1e7] [1].
    gamma : float
        Exponent from level to light, in [0.5, 5] [1]; only `display_level` needs it.
    adaptation : float or None
        What an eye that looks at it is adapted to, in [1e-3, 1e5]; None for peak / √contrast [cd/m²].

    Raises
    ------
    ValueError, TypeError
        A value is not a number in its range.

    Notes
    -----
    Equation 17 of realistic_sky: light = ambient + peak × level^gamma.

    Examples
    --------
    >>> Display(peak=100, contrast=100).ambient
    1.0
    """

    peak: float = 100.0
    contrast: float = 100.0
    gamma: float = 2.2
    adaptation: float | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "peak", real(self.peak, "peak", 1, 1e5, "cd/m²"))
        put(self, "contrast", real(self.contrast, "contrast", 1.01, 1e7))
        put(self, "gamma", real(self.gamma, "gamma", 0.5, 5))
        if self.adaptation is not None:
            put(self, "adaptation", real(self.adaptation, "adaptation", 1e-3, 1e5, "cd/m²"))

    @property
    def ambient(self) -> float:
        """Light of the room on the display [cd/m²]."""
        return self.peak / self.contrast

    def _core(self) -> tuple[float, float, float]:
        eye = self.peak / math.sqrt(self.contrast) if self.adaptation is None else self.adaptation
        return self.peak, self.ambient, eye


def _single(rgb: ArrayLike, **shape: int) -> NDArray[np.float32]:
    """Return light as contiguous float32; what is beyond its range is infinite."""
    with np.errstate(over="ignore"):
        # Not ascontiguousarray, which makes a list of one number.
        return np.asarray(linear_light(rgb, "rgb", **shape), np.float32)


def _picture(rgb: ArrayLike) -> NDArray[np.float32]:
    """Return colours, at least one."""
    x = _single(rgb, last=3)
    if x.size == 0:
        msg = f"rgb must not be empty, got shape {shape_text(x.shape)}"
        raise ValueError(msg)
    return x


def _adapted(x: NDArray[np.float32], adaptation: float | None) -> float:
    """Return what the eye is adapted to [cd/m²]."""
    if adaptation is None:
        return float(tone_log_average(x))
    return real(adaptation, "adaptation", *_LIGHT, "cd/m²")


def log_average(rgb: ArrayLike) -> float:
    """Return the log-average luminance of a picture, what an eye that looks at the scene is adapted to.

    Parameters
    ----------
    rgb : array_like (..., 3)
        Linear Rec. 709 [cd/m²]. Pixels darker than 1e-8 count as that.

    Returns
    -------
    float
        exp(mean(log(luminance))) [cd/m²].

    Raises
    ------
    ValueError, TypeError
        `rgb` is empty, holds NaN or integers, or is not of shape (..., 3).

    Examples
    --------
    >>> round(log_average([[1.0, 1.0, 1.0], [100.0, 100.0, 100.0]]), 4)
    10.0
    """
    return float(tone_log_average(_picture(rgb)))


def _displayed(luminance: ArrayLike, adaptation: float, display: Display, share: bool) -> NDArray[np.float64]:
    x = array(luminance, "luminance", dtypes=(np.float64,))
    if np.isnan(x).any():
        msg = "luminance must not hold NaN"
        raise ValueError(msg)
    out = np.empty(x.shape)
    adaptation = real(adaptation, "adaptation", *_LIGHT, "cd/m²")
    tone_display(x, out, adaptation, instance(display, "display", Display)._core(), share)
    return out


def display_luminance(luminance: ArrayLike, adaptation: float, display: Display = Display()) -> NDArray[np.float64]:
    """Return the luminance of a display that is as bright to the eye as one of the scene.

    Parameters
    ----------
    luminance : array_like
        Of the scene, of any shape [cd/m²].
    adaptation : float
        What the eye in the scene is adapted to, in [1e-8, 1e10] [cd/m²]; less than 1e-3 counts as that.
    display : Display
        What it is shown on.

    Returns
    -------
    ndarray of float64
        Not limited to what the display can do [cd/m²].

    Raises
    ------
    ValueError, TypeError
        A value is NaN or out of range.

    Notes
    -----
    Equation 16 of realistic_sky (Tumblin and Rushmeier 1993).

    Examples
    --------
    >>> display_luminance([1.0, 10.0, 100.0], adaptation=10.0).round(6).tolist()
    [1.0, 10.0, 100.0]
    """
    return _displayed(luminance, adaptation, display, share=False)


def display_level(luminance: ArrayLike, adaptation: float, display: Display = Display()) -> NDArray[np.float64]:
    """Return the level of a display that is as bright to the eye as a luminance of the scene.

    Parameters
    ----------
    luminance : array_like
        Of the scene, of any shape [cd/m²].
    adaptation : float
        As for `display_luminance` [cd/m²].
    display : Display
        What it is shown on.

    Returns
    -------
    ndarray of float64
        In [0, 1] [1]; what the display cannot show is 0 or 1.

    Raises
    ------
    ValueError, TypeError
        A value is NaN or out of range.

    Notes
    -----
    Equations 18 and 19 of realistic_sky, the bracket limited to [0, 1] before the root is taken.

    Examples
    --------
    >>> display_level([0.0, 1e9], adaptation=10.0).tolist()
    [0.0, 1.0]
    """
    share = _displayed(luminance, adaptation, display, share=True)
    out: NDArray[np.float64] = share ** (1 / display.gamma)
    return out


def tumblin_rushmeier(
    rgb: ArrayLike, adaptation: float | None = None, display: Display = Display()
) -> NDArray[np.float32]:
    """Return a scene as a display shows it that is as bright to the eye.

    Parameters
    ----------
    rgb : array_like (..., 3)
        Linear Rec. 709, such that luminance is in cd/m² [cd/m²].
    adaptation : float or None
        What the eye in the scene is adapted to, in [1e-8, 1e10]; None for the log-average of `rgb` [cd/m²].
    display : Display
        What it is shown on.

    Returns
    -------
    ndarray of float32
        Linear light of the display in [0, 1], of the same shape: ready for `to_uint8`. A colour that it cannot show is
        moved towards grey at the same luminance, as far as is needed; one too bright is white.

    Raises
    ------
    ValueError, TypeError
        `rgb` is empty, holds NaN or integers, is not of shape (..., 3), or a value is out of range.

    Notes
    -----
    Equations 13 to 19 of realistic_sky; what the paper prints otherwise is in docs/papers/realistic_sky.md. Below an
    adaptation of 1e-3 cd/m² the eye adapts no further: where the paper's contrast is inverted, at the moonless sky's 1.6e-4
    and below, the picture just gets darker.

    Examples
    --------
    >>> seen = tumblin_rushmeier([[1000.0, 1000.0, 1000.0]], display=Display(adaptation=50))
    >>> [round(float(x), 3) for x in seen[0]]
    [0.78, 0.78, 0.78]
    """
    x = _picture(rgb)
    out = np.empty(x.shape, np.float32)
    tone_reproduce(x, out, _adapted(x, adaptation), instance(display, "display", Display)._core())
    return out


def scotopic(rgb: ArrayLike) -> NDArray[np.float32]:
    """Return a scene as the eye sees it in the dark: without colours, bluish, blue lights brighter than red ones.

    Parameters
    ----------
    rgb : array_like (..., 3)
        Linear Rec. 709, such that luminance is in cd/m² [cd/m²].

    Returns
    -------
    ndarray of float32
        Of the same shape [cd/m²]. Pixels of 4 cd/m² and more are the same bits; those below 0.01 cd/m² have the
        chromaticity (0.25, 0.25).

    Raises
    ------
    ValueError, TypeError
        `rgb` is empty, holds NaN or integers, or is not of shape (..., 3).

    Notes
    -----
    Equations 20 and 21 of realistic_sky with the scotopic luminance of Larson et al. 1997,
    V = Y (1.33 (1 + (Y + Z) / X) − 1.68), held below 16 Y.

    Examples
    --------
    >>> scotopic([[10.0, 5.0, 1.0]]).tolist()
    [[10.0, 5.0, 1.0]]
    """
    x = _picture(rgb)
    out = np.empty(x.shape, np.float32)
    tone_scotopic(x, out)
    return out


def show(
    rgb: ArrayLike, adaptation: float | None = None, display: Display = Display(), *, night: bool = False
) -> NDArray[np.uint8]:
    """Return the sRGB levels of a scene after tone reproduction: three steps in one pass.

    Parameters
    ----------
    rgb : array_like (..., 3)
        As for `tumblin_rushmeier` [cd/m²].
    adaptation : float or None
        As for `tumblin_rushmeier`; the log-average is that of `rgb` also by night [cd/m²].
    display : Display
        What it is shown on.
    night : bool
        Whether `scotopic` comes before.

    Returns
    -------
    ndarray of uint8
        To the bit what `to_uint8(tumblin_rushmeier(rgb))` gives, of `scotopic(rgb)` where `night`.

    Raises
    ------
    ValueError, TypeError
        As for `tumblin_rushmeier`.

    Examples
    --------
    >>> show([[10.0, 10.0, 10.0], [0.0, 0.0, 0.0]]).tolist()
    [[81, 81, 81], [0, 0, 0]]
    """
    x = _picture(rgb)
    out = np.empty(x.shape, np.uint8)
    core = instance(display, "display", Display)._core()
    tone_show(x, out, _adapted(x, adaptation), core, flag(night, "night"))
    return out


def present(
    rgb: ArrayLike,
    adaptation: float | None = None,
    night: bool = True,
    glare: bool = True,
    *,
    fov: float = 50.0,
    white: float | None = None,
    ev: float = 0.0,
) -> NDArray[np.float32]:
    """Return a scene as an eye sees it, on a display: the one way from cd/m² to a picture.

    What the eye is adapted to is shown at a fifth of the display's light by day and darker by night; above it lightness grows with the
    logarithm of light up to `white`, so that skies, clouds and a Sun's disc keep their forms.

    Parameters
    ----------
    rgb : array_like (..., 3)
        Linear Rec. 709, such that luminance is in cd/m² [cd/m²].
    adaptation : float or None
        What the eye is adapted to, in [1e-8, 1e10] [cd/m²]: `Sky.adaptation` of the sky that it is under; None for the
        log-average of `rgb`. Below 1e-4 the eye adapts no further.
    night : bool
        See as rods do where it is dark (`scotopic`); without, colours stay as in a camera.
    glare : bool
        Scatter light that is too bright for a display as the eye does; only pictures (height, width, 3) have it.
    fov : float
        Height of the picture, in [1e-3, 360]: how far glare reaches in it [°].
    white : float or None
        Luminance that becomes display white, in [0, 1e30]; None for the brightest of the picture. It is seven times the
        adaptation at least by day, and a million times it at most [cd/m²].
    ev : float
        Stops by which the picture is brighter, in [-100, 100] [EV].

    Returns
    -------
    ndarray of float32
        Linear light of the display in [0, 1], of the same shape: ready for `to_uint8(..., dither=True)`.

    Raises
    ------
    ValueError, TypeError
        `rgb` is empty, holds NaN or integers, is not of shape (..., 3), or a value is out of range.

    Notes
    -----
    Glare is that of Spencer et al. 1995; the key falls at night with the power by which Tumblin and Rushmeier's brightness
    does. The paper's operator is `tumblin_rushmeier`. Formulas: docs/scene_light.md.

    Examples
    --------
    >>> grey, sky = present([[3000.0, 3000.0, 3000.0], [9000.0, 9000.0, 9000.0]], adaptation=3000.0)
    >>> [round(float(x[0]), 2) for x in (grey, sky)]
    [0.2, 0.54]
    """
    x = _picture(rgb)
    adapted = _adapted(x, adaptation)
    if adaptation is None and flag(night, "night") and adapted < 4:
        adapted = float(tone_log_average(scotopic(x)))
    if white is not None:
        white = real(white, "white", 0, 1e30, "cd/m²")
    exposure = 2.0 ** real(ev, "ev", -100, 100, "EV")
    rows = real(fov, "fov", 1e-3, 360, "°")
    pixel = rows / x.shape[0] if flag(glare, "glare") and x.ndim == 3 else None
    out = np.empty(x.shape, np.float32)
    width = x.shape[-2] if x.ndim > 1 else 1
    tone_present(x, out, width, adapted, exposure, white, flag(night, "night"), pixel)
    return out


def out_of_gamut(rgb: ArrayLike) -> tuple[int, int]:
    """Return how many pixels have a channel below 0, and how many one above 1.

    Parameters
    ----------
    rgb : array_like (..., 3)
        Linear Rec. 709 of a display [1].

    Returns
    -------
    tuple of int
        Pixels with a colour beyond the primaries, pixels with a channel too bright.

    Raises
    ------
    ValueError, TypeError
        `rgb` is empty, holds NaN or integers, or is not of shape (..., 3).

    Examples
    --------
    >>> out_of_gamut([[0.5, -0.1, 0.5], [0.5, 0.5, 1.5], [0.0, 1.0, 0.5]])
    (1, 1)
    """
    below, above = tone_out_of_gamut(_picture(rgb))
    return below, above


def expose(rgb: ArrayLike, ev: float = 0.0) -> NDArray[np.float32]:
    """Return light after an exposure by stops, as a camera with a linear sensor sees it.

    Parameters
    ----------
    rgb : array_like
        Linear light of any shape.
    ev : float
        Stops: one doubles, in [-200, 200] [EV].

    Returns
    -------
    ndarray of float32
        `rgb × 2^ev`, of the same shape; not clipped.

    Raises
    ------
    ValueError, TypeError
        `rgb` holds integers, or `ev` is out of range.

    Examples
    --------
    >>> expose([[0.25, 0.5, 1.0]], ev=1).tolist()
    [[0.5, 1.0, 2.0]]
    """
    ev = real(ev, "ev", -200, 200, "EV")
    x = linear_light(rgb, "rgb")
    with np.errstate(over="ignore"):
        out: NDArray[np.float32] = (x * x.dtype.type(2.0**ev)).astype(np.float32)
    return out


def oneil(rgb: ArrayLike, exposure: float = 2.0) -> NDArray[np.float32]:
    """Return light after O'Neil's exposure curve, by which AOAS shows its skies.

    O'Neil writes 1 − exp(−exposure × light) to the screen as it is; what is returned is the linear light of that level,
    so that `to_uint8` and `pleinair.io.write` show what he shows.

    Parameters
    ----------
    rgb : array_like
        Linear light of any shape, relative.
    exposure : float
        In [0, 1e6] [1]; O'Neil has 2.

    Returns
    -------
    ndarray of float32
        Linear light in [0, 1], of the same shape; relative error below 1e-6.

    Raises
    ------
    ValueError, TypeError
        `rgb` holds integers, or `exposure` is out of range.

    Notes
    -----
    O'Neil 2005, "Accurate Atmospheric Scattering", GPU Gems 2, chapter 16.

    Examples
    --------
    >>> to_uint8(oneil([0.0, 0.5])).tolist()
    [0, 161]
    """
    exposure = real(exposure, "exposure", 0, 1e6)
    x = _single(rgb)
    out = np.empty(x.shape, np.float32)
    tone_oneil(x, out, exposure)
    return out


def to_uint8(rgb: ArrayLike, dither: bool = False) -> NDArray[np.uint8]:
    """Return sRGB levels of linear light, rounded to the nearest or dithered.

    Parameters
    ----------
    rgb : array_like
        Linear light of any shape; values outside [0, 1] are clipped. NaN is refused.
    dither : bool
        Add blue noise before rounding, triangular between levels 1 and 254, so that slow gradients have no contour lines:
        for pictures, (height, width, 3) or (height, width). It depends on the place alone, and black stays black.

    Returns
    -------
    ndarray of uint8
        Of the same shape.

    Raises
    ------
    ValueError, TypeError
        `rgb` holds NaN or integers, or is no picture where it is to be dithered.

    Examples
    --------
    >>> to_uint8([0.0, 0.214, 1.0, 7.0]).tolist()
    [0, 127, 255, 255]
    """
    x = _single(rgb)
    # A sum is NaN if anything is; of inf and -inf too, which is looked at closely then.
    with np.errstate(invalid="ignore", over="ignore"):
        total = float(np.add.reduce(x, axis=None))
    if math.isnan(total) and np.isnan(x).any():
        msg = "rgb must not hold NaN"
        raise ValueError(msg)
    out = np.empty(x.shape, np.uint8)
    if not flag(dither, "dither"):
        tone_levels(x, out)
        return out
    if x.ndim not in (2, 3) or (x.ndim == 3 and x.shape[2] != 3):
        msg = f"rgb must have shape (height, width, 3) or (height, width) to be dithered, got {shape_text(x.shape)}"
        raise ValueError(msg)
    if x.size:
        tone_dither(x, out, (x.shape[1], 3 if x.ndim == 3 else 1))
    return out

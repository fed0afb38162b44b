"""After the eye or camera: from the light of a scene to a display."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._inputs import light, real

__all__ = ["expose", "oneil", "to_uint8"]


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
    x = light(rgb, "rgb")
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
    x = np.ascontiguousarray(light(rgb, "rgb"), np.float32)
    out = np.empty(x.shape, np.float32)
    _core.tone_oneil(x, out, exposure)
    return out


def to_uint8(rgb: ArrayLike) -> NDArray[np.uint8]:
    """Return sRGB levels of linear light, rounded to the nearest.

    Parameters
    ----------
    rgb : array_like
        Linear light of any shape; values outside [0, 1] are clipped. NaN is refused.

    Returns
    -------
    ndarray of uint8
        Of the same shape.

    Raises
    ------
    ValueError, TypeError
        `rgb` holds NaN or integers.

    Examples
    --------
    >>> to_uint8([0.0, 0.214, 1.0, 7.0]).tolist()
    [0, 127, 255, 255]
    """
    x = np.ascontiguousarray(light(rgb, "rgb"), np.float32)
    # A sum is NaN if anything is; of inf and -inf too, which is looked at closely then.
    with np.errstate(invalid="ignore", over="ignore"):
        total = float(np.add.reduce(x, axis=None))
    if math.isnan(total) and np.isnan(x).any():
        msg = "rgb must not hold NaN"
        raise ValueError(msg)
    out = np.empty(x.shape, np.uint8)
    _core.tone_levels(x, out)
    return out

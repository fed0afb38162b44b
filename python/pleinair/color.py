"""Coordinates of colour: the sRGB transfer function, HSV, XYZ, xyY and Lab.

Pictures are linear light with Rec. 709 primaries and D65; only `srgb_encode`, `srgb_decode` and ``encoded=True`` leave
it. Nothing is clipped. float32 and float64 are kept, any other real dtype becomes float64, anything else is a
TypeError. ``out=`` takes a C-contiguous array of the result's shape and dtype, which may be the input itself.
Constants, read-only: `RGB_TO_XYZ`, derived from the primaries and the white (0.3127, 0.3290) of Rec. 709; `XYZ_TO_RGB`,
its inverse; `D65`, XYZ of RGB (1, 1, 1) [1].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import color_constants, color_inverse, color_transform, pigment_mix
from ._core import hsv_to_rgb as core_hsv_to_rgb
from ._core import into_gamut as core_into_gamut
from ._core import lab_to_rgb as core_lab_to_rgb
from ._core import luminance as core_luminance
from ._core import rgb_to_hsv as core_rgb_to_hsv
from ._core import rgb_to_lab as core_rgb_to_lab
from ._core import srgb_decode as core_srgb_decode
from ._core import srgb_encode as core_srgb_encode
from ._core import xyy_to_xyz as core_xyy_to_xyz
from ._core import xyz_to_xyy as core_xyz_to_xyy
from ._support.docs import documented
from ._support.inputs import Array, array, shape_text, vector
from ._support.kernels import apply_kernel

__all__ = [
    "D65",
    "RGB_TO_XYZ",
    "XYZ_TO_RGB",
    "hsv_to_rgb",
    "into_gamut",
    "lab_to_rgb",
    "luminance",
    "mix_pigments",
    "rgb_to_hsv",
    "rgb_to_lab",
    "rgb_to_xyz",
    "srgb_decode",
    "srgb_encode",
    "xyy_to_xyz",
    "xyz_to_rgb",
    "xyz_to_xyy",
]


def _constant(values: object) -> NDArray[np.float64]:
    out = np.array(values, np.float64)
    out.flags.writeable = False
    return out


RGB_TO_XYZ, XYZ_TO_RGB, D65 = map(_constant, color_constants())


def _matrix(value: ArrayLike | None) -> list[list[float]]:
    if value is None:
        return RGB_TO_XYZ.tolist()  # type: ignore[no-any-return]
    out = array(value, "matrix", dtypes=(np.float64,))
    if out.shape != (3, 3):
        msg = f"matrix must have shape (3, 3), got {shape_text(out.shape)}"
        raise ValueError(msg)
    if not np.isfinite(out).all():
        msg = f"matrix must hold finite numbers, got {out.tolist()}"
        raise ValueError(msg)
    return out.tolist()  # type: ignore[no-any-return]


def _white(value: ArrayLike | None) -> tuple[float, float, float] | None:
    if value is None:
        return None
    out = vector(value, "white", low=0.0)
    if min(out) == 0.0:
        msg = f"white must be positive, got {list(out)}"
        raise ValueError(msg)
    return out


@documented
def srgb_encode(x: ArrayLike, *, out: Array | None = None) -> Array:
    """Return the sRGB encoded values of linear light.

    Parameters
    ----------
    x : array_like, any shape
        Linear light [1].
    {out}

    Returns
    -------
    ndarray
        Encoded values [1], shape of `x`.

    Raises
    ------
    ValueError
        `out` does not fit.

    Notes
    -----
    IEC 61966-2-1, with the odd extension ``sign(x) f(abs(x))`` for negative values and the same curve above 1.
    Largest error on [0, 1]: 1.7e-7 in float32.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.srgb_encode([0.0, 0.5, 1.0]).round(4)
    array([0.    , 0.7354, 1.    ])
    """
    return apply_kernel(core_srgb_encode, x, "x", out, last=None, meaning="light")


@documented
def srgb_decode(x: ArrayLike, *, out: Array | None = None) -> Array:
    """Return the linear light of sRGB encoded values.

    Parameters
    ----------
    x : array_like, any shape
        Encoded values [1]; levels of 8 and 16 bits (uint8, uint16) are divided by 255 and 65535.
    {out}

    Returns
    -------
    ndarray
        Linear light [1], shape of `x`.

    Raises
    ------
    ValueError
        `out` does not fit.

    Notes
    -----
    IEC 61966-2-1, with the odd extension ``sign(x) f(abs(x))`` for negative values and the same curve above 1.
    Largest error on [0, 1]: 2.0e-7 in float32.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.srgb_decode([0.0, 0.5, 1.0]).round(4)
    array([0.   , 0.214, 1.   ])
    """
    return apply_kernel(core_srgb_decode, x, "x", out, last=None, meaning="encoded")


@documented
def rgb_to_hsv(rgb: ArrayLike, *, out: Array | None = None) -> Array:
    """Return hue, saturation and value of RGB.

    Parameters
    ----------
    rgb : array_like (..., 3)
        RGB [1], linear or encoded: the result belongs to the same.
    {out}

    Returns
    -------
    ndarray
        Hue in [0, 1) [turns], saturation [1] and value [1], shape (..., 3).

    Raises
    ------
    ValueError
        The last axis is not 3 long, or `out` does not fit.

    Notes
    -----
    Smith, "Color gamut transform pairs", SIGGRAPH 1978, without an epsilon. Greys have hue 0; saturation is 0 where
    no channel is above 0, and above 1 where the smallest is negative. NaN in a channel gives NaN in all three outputs.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.rgb_to_hsv([0.25, 0.5, 0.5])
    array([0.5, 0.5, 0.5])
    """
    return apply_kernel(core_rgb_to_hsv, rgb, "rgb", out, meaning="encoded")


@documented
def hsv_to_rgb(hsv: ArrayLike, *, out: Array | None = None) -> Array:
    """Return RGB of hue, saturation and value.

    Parameters
    ----------
    hsv : array_like (..., 3)
        Hue [turns], any number: it is wrapped to [0, 1); saturation [1] and value [1].
    {out}

    Returns
    -------
    ndarray
        RGB [1], shape (..., 3).

    Raises
    ------
    ValueError
        The last axis is not 3 long, or `out` does not fit.

    Notes
    -----
    Smith, "Color gamut transform pairs", SIGGRAPH 1978. Linear in value and in saturation, also outside [0, 1]. NaN in
    hue or value gives NaN in all three outputs, NaN in saturation as well.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.hsv_to_rgb([0.5, 0.5, 0.5])
    array([0.25, 0.5 , 0.5 ])
    """
    return apply_kernel(core_hsv_to_rgb, hsv, "hsv", out, meaning="encoded")


@documented
def rgb_to_xyz(rgb: ArrayLike, *, matrix: ArrayLike | None = None, out: Array | None = None) -> Array:
    """Return CIE XYZ of linear RGB.

    Parameters
    ----------
    rgb : array_like (..., 3)
        Linear RGB [1].
    matrix : array_like (3, 3), optional
        XYZ of linear RGB [1]; `RGB_TO_XYZ` by default.
    {out}

    Returns
    -------
    ndarray
        XYZ [1], shape (..., 3).

    Raises
    ------
    ValueError
        The last axis is not 3 long, `matrix` cannot be used, or `out` does not fit.

    Notes
    -----
    CIE 15:2018 with the primaries of ITU-R BT.709-6. The derived matrix differs from the rounded one of
    IEC 61966-2-1 by up to 6.2e-5.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.rgb_to_xyz([1.0, 1.0, 1.0]).round(4)
    array([0.9505, 1.    , 1.0891])
    """
    return apply_kernel(color_transform, rgb, "rgb", out, _matrix(matrix), meaning="light")


@documented
def xyz_to_rgb(xyz: ArrayLike, *, matrix: ArrayLike | None = None, out: Array | None = None) -> Array:
    """Return linear RGB of CIE XYZ.

    Parameters
    ----------
    xyz : array_like (..., 3)
        XYZ [1].
    matrix : array_like (3, 3), optional
        XYZ of linear RGB [1]; `RGB_TO_XYZ` by default. Its inverse is applied.
    {out}

    Returns
    -------
    ndarray
        Linear RGB [1], shape (..., 3) (CIE 15:2018, ITU-R BT.709-6).

    Raises
    ------
    ValueError
        The last axis is not 3 long, `matrix` has no inverse or the wrong shape, or `out` does not fit.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.xyz_to_rgb(pa.color.D65).round(12)
    array([1., 1., 1.])
    """
    return apply_kernel(color_transform, xyz, "xyz", out, color_inverse(_matrix(matrix)))


@documented
def xyz_to_xyy(xyz: ArrayLike, *, white: ArrayLike | None = None, out: Array | None = None) -> Array:
    """Return CIE xyY, chromaticity and luminance, of XYZ.

    Parameters
    ----------
    xyz : array_like (..., 3)
        XYZ [1].
    white : array_like (3,), optional
        XYZ whose chromaticity is given where X + Y + Z = 0 [1]; without it the chromaticity there is (0, 0).
    {out}

    Returns
    -------
    ndarray
        x [1], y [1] and Y (unit of the input), shape (..., 3) (CIE 15:2018).

    Raises
    ------
    ValueError
        The last axis is not 3 long, `white` is not positive, or `out` does not fit.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.xyz_to_xyy(pa.color.D65).round(6)
    array([0.3127, 0.329 , 1.    ])
    >>> pa.color.xyz_to_xyy([0.0, 0.0, 0.0], white=pa.color.D65).round(6)
    array([0.3127, 0.329 , 0.    ])
    """
    return apply_kernel(core_xyz_to_xyy, xyz, "xyz", out, _white(white))


@documented
def xyy_to_xyz(xyy: ArrayLike, *, out: Array | None = None) -> Array:
    """Return CIE XYZ of xyY, chromaticity and luminance.

    Parameters
    ----------
    xyy : array_like (..., 3)
        x [1], y [1] and Y [1].
    {out}

    Returns
    -------
    ndarray
        XYZ (unit of Y), shape (..., 3); (0, Y, 0) where y = 0 (CIE 15:2018).

    Raises
    ------
    ValueError
        The last axis is not 3 long, or `out` does not fit.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.xyy_to_xyz([0.25, 0.25, 1.0])
    array([1., 1., 2.])
    """
    return apply_kernel(core_xyy_to_xyz, xyy, "xyy", out)


@documented
def rgb_to_lab(
    rgb: ArrayLike,
    *,
    matrix: ArrayLike | None = None,
    white: ArrayLike | None = None,
    encoded: bool = False,
    out: Array | None = None,
) -> Array:
    """Return CIE L*a*b* of RGB.

    Parameters
    ----------
    rgb : array_like (..., 3)
        RGB [1], linear unless `encoded`.
    matrix : array_like (3, 3), optional
        XYZ of linear RGB [1]; `RGB_TO_XYZ` by default.
    white : array_like (3,), optional
        XYZ of the white [1]; by default the row sums of the matrix, so that greys have a = b = 0.
    encoded : bool
        Whether the RGB side carries the sRGB transfer function; one pass does both.
    {out}

    Returns
    -------
    ndarray
        L* (100 is the white), a* and b* [1], shape (..., 3).

    Raises
    ------
    ValueError
        The last axis is not 3 long, `matrix` or `white` cannot be used, or `out` does not fit.

    Notes
    -----
    CIE 15:2018 with the exact constants 216/24389 and 841/108, its linear part continued below 0. Largest error on
    [0, 1]: 7e-5 ΔE in float32.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.rgb_to_lab([1.0, 0.0, 0.0]).round(3)
    array([53.237, 80.09 , 67.203])
    >>> pa.color.rgb_to_lab([0.25, 0.5, 0.75], encoded=True).round(3)
    array([ 52.019,   0.1  , -39.362])
    """
    return apply_kernel(
        core_rgb_to_lab,
        rgb,
        "rgb",
        out,
        _matrix(matrix),
        _white(white),
        bool(encoded),
        meaning="encoded" if encoded else "light",
    )


@documented
def lab_to_rgb(
    lab: ArrayLike,
    *,
    matrix: ArrayLike | None = None,
    white: ArrayLike | None = None,
    encoded: bool = False,
    out: Array | None = None,
) -> Array:
    """Return RGB of CIE L*a*b*.

    Parameters
    ----------
    lab : array_like (..., 3)
        L* (100 is the white), a* and b* [1].
    matrix : array_like (3, 3), optional
        XYZ of linear RGB [1]; `RGB_TO_XYZ` by default.
    white : array_like (3,), optional
        XYZ of the white [1]; by default the row sums of the matrix.
    encoded : bool
        Whether the RGB side carries the sRGB transfer function; one pass does both.
    {out}

    Returns
    -------
    ndarray
        RGB [1], shape (..., 3), linear unless `encoded`; outside [0, 1] where the colour is out of gamut.

    Raises
    ------
    ValueError
        The last axis is not 3 long, `matrix` or `white` cannot be used, or `out` does not fit.

    Notes
    -----
    CIE 15:2018 with the exact constants 216/24389 and 841/108, its linear part continued below 0.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.lab_to_rgb([50.0, 0.0, 0.0], encoded=True).round(4)
    array([0.4663, 0.4663, 0.4663])
    """
    return apply_kernel(core_lab_to_rgb, lab, "lab", out, _matrix(matrix), _white(white), bool(encoded))


@documented
def into_gamut(rgb: ArrayLike, *, out: Array | None = None) -> Array:
    """Return light without negative channels, each pixel's luminance kept: colours beyond the primaries lose saturation.

    Parameters
    ----------
    rgb : array_like (..., 3)
        Linear Rec. 709, any unit; negative channels are colours that its primaries cannot mix, as those of a red Sun.
    {out}

    Returns
    -------
    ndarray (..., 3)
        Pixels with a negative channel moved towards grey of their own luminance until that channel is 0; the others
        bit for bit. Light without luminance becomes black.

    Raises
    ------
    ValueError, TypeError
        The shape is wrong, or `rgb` holds levels.

    Notes
    -----
    Count what is changed with ``(rgb < 0).any(axis=-1)``, or `pleinair.tone.out_of_gamut`.

    Examples
    --------
    >>> import pleinair as pa
    >>> red = pa.color.into_gamut([1.0, 0.1, -0.05])
    >>> red.round(3), float((pa.color.luminance(red) - pa.color.luminance([1.0, 0.1, -0.05])).round(9))
    (array([0.891, 0.127, 0.   ]), 0.0)
    """
    return apply_kernel(core_into_gamut, rgb, "rgb", out, meaning="light")


@documented
def luminance(rgb: ArrayLike, *, weights: ArrayLike | None = None, out: Array | None = None) -> Array:
    """Return the luminance of linear RGB.

    Parameters
    ----------
    rgb : array_like (..., 3)
        Linear RGB [1] or [cd/m²].
    weights : array_like (3,), optional
        Weights of the channels [1]; by default the row Y of `RGB_TO_XYZ`.
    {out}

    Returns
    -------
    ndarray
        Luminance in the unit of the input, shape (...).

    Raises
    ------
    ValueError
        The last axis is not 3 long, `weights` are not three finite numbers, or `out` does not fit.

    Notes
    -----
    ITU-R BT.709-6. OpenCV and scikit-image use other weights for their greys.

    Examples
    --------
    >>> import pleinair as pa
    >>> pa.color.luminance([[1.0, 1.0, 1.0], [0.0, 1.0, 0.0]]).round(4)
    array([1.    , 0.7152])
    """
    return apply_kernel(
        core_luminance,
        rgb,
        "rgb",
        out,
        vector(RGB_TO_XYZ[1] if weights is None else weights, "weights"),
        drop=True,
        meaning="light",
    )


def mix_pigments(a: ArrayLike, b: ArrayLike, amount: ArrayLike = 0.5) -> NDArray[np.float64]:
    """Mix two colours as paint.

    Parameters
    ----------
    a, b : array_like (..., 3)
        Linear RGB in [0, 1] [1]; shapes broadcast.
    amount : array_like (...)
        Share of `b`, in [0, 1] [1].

    Returns
    -------
    ndarray (..., 3) of float64
        Linear RGB [1]; exactly `a` at 0 and `b` at 1.

    Raises
    ------
    ValueError, TypeError
        A colour or a share is out of range, or shapes do not broadcast.

    Notes
    -----
    Kubelka and Munk with one constant on smooth spectra (Jakob and Hanika 2019), each paint as strong as the square of its
    share times its luminance. Blue and yellow give green. Microseconds for each: meant for palettes, not for pictures.

    Examples
    --------
    >>> import pleinair as pa
    >>> yellow, blue = pa.color.srgb_decode([[252, 211, 0], [0, 33, 133]] / np.float64(255))
    >>> r, g, b = pa.color.mix_pigments(yellow, blue)
    >>> bool(g > 2 * r and g > 2 * b)
    True
    """
    first, second = (array(x, name, dtypes=(np.float64,), last=3) for x, name in ((a, "a"), (b, "b")))
    share = array(amount, "amount", dtypes=(np.float64,))
    for x, name in ((first, "a"), (second, "b"), (share, "amount")):
        if x.size and not (x.min() >= 0 and x.max() <= 1):
            msg = f"{name} must be in [0, 1] [1], got {x.min():g} to {x.max():g}"
            raise ValueError(msg)
    try:
        shape = np.broadcast_shapes(first.shape[:-1], second.shape[:-1], share.shape)
    except ValueError as error:
        msg = f"a, b and amount must broadcast: {error}"
        raise ValueError(msg) from None
    first, second = (np.ascontiguousarray(np.broadcast_to(x, (*shape, 3))) for x in (first, second))
    out = np.empty((*shape, 3))
    pigment_mix(first, second, np.ascontiguousarray(np.broadcast_to(share, shape)), out)
    return out

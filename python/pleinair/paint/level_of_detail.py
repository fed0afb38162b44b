"""Level of detail of strokes (corot). Public as `pleinair.paint`.

Stochastic simplification (Cook et al. 2007): the order in which strokes give way with distance, and the growth of the
others that keeps the silhouette.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import paint_simplification_order, paint_size_compensation
from .._support.docs import documented
from .._support.inputs import Array, Progress, flag, instance, integer, real, reporter
from .material import Style
from .shading import _bake, _shader
from .strokes import Strokes


@documented
def thin(
    strokes: Strokes,
    style: Style,
    lights: Any,
    *,
    outer: float = 1.0,
    pixels: int = 160,
    progress: Progress = None,
) -> Strokes:
    """Deal the thresholds of one object's strokes anew: those vanish first without which the silhouette stays (D5, D6).

    Looked at from nine sides, with its masks: always the stroke whose loss changes the silhouette least, and among equals
    the outermost. The thresholds themselves stay, each goes to another stroke.

    Parameters
    ----------
    strokes : Strokes
        One tree, with `fade`.
    style : Style
        Masks.
    lights : Light or iterable of Light
        What lights it: masks depend on lightness (S7).
    outer : float
        What being the outermost takes off the cost of a stroke's loss, in means of that cost, in [0, 1e6] [1]. With much
        the order is by the distance from the centre alone, the thesis'.
    pixels : int
        Size of the pictures, in [16, 4096] [px].
    {progress}

    Returns
    -------
    Strokes
        The same ones with other `fade`; themselves if they have none.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Examples
    --------
    >>> from pleinair.paint import Light, style as named
    >>> rng = np.random.default_rng(0)
    >>> tree = Strokes(rng.normal(size=(50, 3)), (0, 0, 1), (0.5, 0.5), fade=np.sort(rng.random((50, 2))))
    >>> thinned = thin(tree, named("corot"), Light((0, 0, 1)), pixels=48)
    >>> bool((np.sort(thinned.fade[:, 0]) == np.sort(tree.fade[:, 0])).all())
    True
    """
    instance(strokes, "strokes", Strokes)
    instance(style, "style", Style)
    outer, pixels = real(outer, "outer", 0, 1e6), integer(pixels, "pixels", 16, 4096)
    material = style.material(strokes.material)
    shader = _shader(style, material, lights, (0, 1), (0, 0))
    if strokes.fade is None:
        return strokes
    callback, close = reporter(progress, "thin")
    try:
        order = paint_simplification_order(strokes, shader, _bake(material.palette), outer, pixels, callback)
    finally:
        close()
    fade = np.empty_like(strokes.fade)
    fade[np.asarray(order, np.int64)] = strokes.fade[np.argsort(strokes.fade[:, 0], kind="stable")]
    return dataclasses.replace(strokes, fade=fade)


@documented
def growth(
    strokes: Strokes,
    style: Style,
    lights: Any,
    *,
    shadows: bool = True,
    knots: int = 12,
    pixels: int = 160,
    progress: Progress = None,
) -> NDArray[np.float64]:
    """Solve how one object's strokes grow while others fade, so that its silhouette and its tone stay (D5-D8).

    Parameters
    ----------
    strokes : Strokes
        One tree, with `fade`; best after `thin`.
    style : Style
        Masks and colours.
    lights : Light or iterable of Light
        What lights it.
    shadows : bool
        The strokes shade each other from the first light, anew at each distance, as `shadows` with the frame's camera
        does. Without it they keep their `lit`.
    knots : int
        Distances `d` from 0 to 1 for which it is solved, in [2, 1024] [1].
    pixels : int
        Size of the pictures that are compared, in [16, 4096] [px]. Small strokes have less grain: the law is for an object
        of about this size. Half or twice of it costs a few percent of the area and the tone while half of the leaves are
        left, and more beyond (docs/papers/corot.md).
    {progress}

    Returns
    -------
    ndarray (3, knots) of float64
        At evenly spaced `d`: factors of the size, which never fall; factors of the lightness; shares of the darkness inside
        (S2) that are left [1]. Stacked for all trees they are the `growth` of `Strokes`.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Examples
    --------
    >>> from pleinair.paint import Light, style as named
    >>> rng = np.random.default_rng(0)
    >>> tree = Strokes(rng.normal(size=(50, 3)), (0, 0, 1), (0.5, 0.5), fade=np.sort(rng.random((50, 2))))
    >>> law = growth(tree, named("corot"), Light((0, 0, 1)), knots=3, pixels=48)
    >>> law.shape, float(law[0, 0])
    ((3, 3), 1.0)
    """
    instance(strokes, "strokes", Strokes)
    instance(style, "style", Style)
    knots, pixels = integer(knots, "knots", 2, 1024), integer(pixels, "pixels", 16, 4096)
    material = style.material(strokes.material)
    shader = _shader(style, material, lights, (0, 1), (0, 0))
    callback, close = reporter(progress, "growth")
    try:
        law = paint_size_compensation(
            strokes, shader, _bake(material.palette), flag(shadows, "shadows"), knots, pixels, callback
        )
    finally:
        close()
    out: Array = np.asarray(law).reshape(3, knots)
    return out

"""Shading of strokes, from the world to a painted picture. Public as `pleinair.paint`.

Lighting, palette, aerial perspective, projection, deep shadows and level of detail.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._core import PaintPalette, paint_light_view, paint_light_visibility, paint_lod, paint_shade
from .._support.docs import documented
from .._support.inputs import Progress, array, choice, circle, instance, integer, reporter, several, units, vector
from ..camera import Camera
from .material import Material, Style
from .sprites import Canvas, Floats, Sprites, composite
from .strokes import Light, Shading, Strokes, source


@dataclass(frozen=True)
class _Shader:
    """A style, one of its materials and what a call adds, as the core reads them."""

    style: Style
    material: Material
    lights: list[Any]
    far: tuple[float, float]
    close: tuple[float, float]


def _shader(style: Style, material: Material, lights: Any, near: Any, close: Any) -> _Shader:
    sources = (lights,) if isinstance(lights, Light) else several(lights, "lights")
    inside, outside = circle(close, "close")
    return _Shader(
        style,
        material,
        [source(instance(light, "lights", Light)) for light in sources],
        circle(near, "circles"),
        # The core's are from where strokes begin to give way down to where they are gone.
        (outside, inside),
    )


@functools.lru_cache(maxsize=64)
def _bake(palette: Any) -> Any:
    """Bake a palette once: mixing as paint takes a millisecond for a few thousand entries."""
    material = Material(palette)
    return PaintPalette(_shader(Style((("", material),)), material, (), (0, 1), (0, 0)))


def palette_colors(palette: Any, lightness: ArrayLike) -> tuple[Floats, Floats]:
    """Return the colours that a palette gives to lightnesses.

    Parameters
    ----------
    palette : Palette
        The palette.
    lightness : array_like (n,)
        In [0, 1] [1]; clamped.

    Returns
    -------
    ndarray (n, 3) of float32
        Linear RGB.
    ndarray (n,) of float32
        0 dark, 1 middle, 2 light, and between [1].

    Examples
    --------
    >>> from pleinair.paint import style
    >>> colors, which = palette_colors(style("corot").material("leaves").palette, [0, 0.3, 1])
    >>> which.tolist()
    [0.0, 1.0, 2.0]
    """
    values = array(lightness, "lightness", dtypes=(np.float64,), ndim=1)
    found = _bake(palette).colors(values.tolist())
    colors = np.array([c for c, _ in found], np.float32).reshape(-1, 3)
    return colors, np.array([w for _, w in found], np.float32)


def shade(
    strokes: Strokes,
    style: Style,
    camera: Camera,
    lights: Any,
    *,
    circles: ArrayLike = (50.0, 500.0),
    close: ArrayLike = (0.0, 0.0),
) -> Shading:
    """Light, colour and project strokes (S1-S17).

    Parameters
    ----------
    strokes : Strokes
        The strokes, of one material.
    style : Style
        The manner.
    camera : Camera
        From where. A stroke behind it is not painted.
    lights : Light or iterable of Light
        What lights them.
    circles : tuple of float
        Distances along the view: up to the first all is foreground (`d` = 0), from the second on background (`d` = 1)
        [m]. Equal ones are a step. Trees and trunks may have their own, and they may move from frame to frame.
    close : tuple of float
        In the extreme foreground: the distance at which inner strokes are gone, and that from which on they give way [m].

    Returns
    -------
    Shading
        Every stage.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Examples
    --------
    >>> from pleinair.paint import style as named
    >>> strokes = Strokes([[0, 10, 0]], (0, -1, 0), (1, 1))
    >>> shading = shade(strokes, named("corot"), Camera(64, 48), Light((0, -1, 1)))
    >>> shading.sprites.center.tolist()
    [[32.0, 24.0]]
    """
    instance(strokes, "strokes", Strokes)
    instance(style, "style", Style)
    instance(camera, "camera", Camera)
    material = style.material(strokes.material)
    params = material.params
    n = len(strokes)
    table, depth = np.empty((n, 20), np.float32), np.empty(n)
    shader = _shader(style, material, lights, circles, close)
    paint_shade(strokes, shader, _bake(material.palette), camera, table, depth)
    columns = [np.ascontiguousarray(table[:, k]) for k in range(20)]
    block = np.ascontiguousarray
    sprites = Sprites._of(
        center=block(table[:, 9:11]),
        size=block(table[:, 11:13]),
        depth=depth,
        color=block(table[:, 13:16]),
        variation=block(table[:, 16:19]) if params.variation > 0 else None,
        rotation=strokes.twist,
        opacity=columns[8],
        label=strokes.label,
        frequency=columns[6],
        frequency_t=columns[7],
        color_frequency=params.color_frequency,
        fullness=params.fullness,
        feather_min=params.feather_min,
        feather_max=params.feather_max,
        squeeze=columns[19],
        id=strokes.id,
    )
    lightness, placed, shadow, final, palette, distance = columns[:6]
    return Shading(lightness, placed, shadow, final, palette, distance, sprites)


def join(sprites: Any) -> Sprites:
    """Return several lists of sprites as one, to be composited together.

    Parameters
    ----------
    sprites : iterable of Sprites
        In any order; ties of depth keep it where there are no ids.

    Returns
    -------
    Sprites
        All of them.

    Raises
    ------
    ValueError, TypeError
        There is none.

    Examples
    --------
    >>> one = Sprites([[4, 4]], (2, 2), [1.0], (1, 1, 1))
    >>> len(join([one, one]))
    2
    """
    parts = [instance(s, "sprites", Sprites) for s in several(sprites, "sprites")]
    if not parts:
        msg = "sprites must hold at least one"
        raise ValueError(msg)
    together: dict[str, Any] = {}
    for entry in dataclasses.fields(Sprites):
        name = entry.name
        values = [getattr(part, name) for part in parts]
        if name == "variation" and any(v is not None for v in values):
            values = [np.zeros_like(p.color) if v is None else v for v, p in zip(values, parts, strict=True)]
        if name == "id" and any(v is None for v in values):
            together[name] = None
        elif all(isinstance(v, float) and v == values[0] for v in values) or all(v is None for v in values):
            together[name] = values[0]
        else:
            full = [
                np.full(len(p), v, np.float32) if isinstance(v, float) else v
                for v, p in zip(values, parts, strict=True)
            ]
            together[name] = np.concatenate(full)
    return Sprites._of(**together)


def _detail(strokes: Strokes, style: Style, camera: Camera | None, circles: Any) -> Floats:
    """Return share and growth of each stroke at its distance from a camera, shape (n, 2)."""
    out = np.ones((len(strokes), 2), np.float32)
    if camera is not None:
        material = style.material(strokes.material)
        shader = _shader(style, material, (), circles, (0, 0))
        paint_lod(strokes, shader, _bake(material.palette), instance(camera, "camera", Camera), out)
    return out


@documented
def shadows(
    strokes: Any,
    direction: ArrayLike,
    style: Style,
    *,
    casts: Any = True,
    camera: Camera | None = None,
    circles: ArrayLike = (50.0, 500.0),
    pixels: int = 1024,
    progress: Progress = None,
) -> list[Floats]:
    """Return which share of a light reaches each stroke, through the strokes that stand in its way (S6).

    Parameters
    ----------
    strokes : Strokes or iterable of Strokes
        All that stand in the light together.
    direction : array_like (3,)
        To the light.
    style : Style
        Masks: strokes cast by what is painted of them, not by their rectangles.
    casts : bool or iterable of bool
        Which of `strokes` take light away; the others only receive (G8).
    camera : Camera, optional
        Of the frame: strokes that have faded there cast no more, those that have grown cast as they are painted.
        Without it all strokes cast as they are in the foreground.
    circles : tuple of float
        As for `shade` [m].
    pixels : int
        Size of the light's view, in [16, 16384] [px].
    {progress}

    Returns
    -------
    list of ndarray (n,) of float32
        For each of `strokes`, for its `lit` [1].

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Examples
    --------
    >>> from pleinair.paint import style as named
    >>> pair = Strokes([[0, 0, 5], [0, 0, 0]], (0, 0, 1), (1, 1))
    >>> above, below = shadows(pair, (0, 0, 1), named("corot"))[0]
    >>> bool(above == 1), bool(below < 1)
    (True, True)
    """
    instance(style, "style", Style)
    parts: list[Strokes] = [strokes] if isinstance(strokes, Strokes) else list(several(strokes, "strokes"))
    parts = [instance(s, "strokes", Strokes) for s in parts]
    flags = [casts] * len(parts) if isinstance(casts, (bool, np.bool_)) else list(several(casts, "casts"))
    if len(flags) != len(parts):
        msg = f"casts must be one for each of {len(parts)} lists of strokes, got {len(flags)}"
        raise ValueError(msg)
    pixels = integer(pixels, "pixels", 16, 16384)
    if not parts or not sum(map(len, parts)):
        return [np.ones(len(s), np.float32) for s in parts]
    x, y, z = units(vector(direction, "direction"), "direction").tolist()
    position = np.concatenate([s.position for s in parts])
    details = [_detail(s, style, camera, circles) for s in parts]
    size = np.concatenate([s.size * d[:, 1:] for s, d in zip(parts, details, strict=True)])
    center, px, depth = paint_light_view(position, size, (x, y, z), pixels)
    n = len(position)

    def each(of: Any) -> Floats:
        return np.concatenate([np.broadcast_to(np.float32(of(s)), (len(s),)) for s in parts])

    def params(s: Strokes) -> Any:
        return style.material(s.material).params

    def frequency(s: Strokes) -> Any:
        p = params(s)
        return p.frequency + p.center_frequency * np.asarray(s.center_ratio) + 0.5 * p.lightness_frequency

    sprites = Sprites(
        center=center.reshape(n, 2),
        size=px.reshape(n, 2),
        depth=depth,
        color=(0.0, 0.0, 0.0),
        rotation=each(lambda s: s.twist),
        opacity=each(lambda s: params(s).max_opacity),
        label=np.concatenate([s.label for s in parts]),
        frequency=each(lambda s: frequency(s) * params(s).stretch[0]),
        frequency_t=each(lambda s: frequency(s) * params(s).stretch[1]),
        fullness=each(lambda s: params(s).fullness),
        feather_min=each(lambda s: params(s).feather_min),
        feather_max=each(lambda s: params(s).feather_max),
    )
    taken = np.concatenate([d[:, 0] * np.float32(bool(f)) for d, f in zip(details, flags, strict=True)])
    out = np.empty(n, np.float32)
    callback, close = reporter(progress, "shadows")
    try:
        paint_light_visibility(sprites, taken, pixels, out, callback)
    finally:
        close()
    return [np.ascontiguousarray(a) for a in np.split(out, np.cumsum([len(s) for s in parts])[:-1])]


@documented
def render(
    strokes: Any,
    style: Style,
    camera: Camera,
    lights: Any,
    *,
    circles: ArrayLike = (50.0, 500.0),
    close: ArrayLike = (0.0, 0.0),
    order: str = "slab",
    delta: ArrayLike | None = None,
    seen: bool = False,
    progress: Progress = None,
) -> Canvas:
    """Paint strokes through a camera: `shade`, `join`, `composite`.

    Parameters
    ----------
    strokes : Strokes or iterable of Strokes
        All that is to be seen.
    style : Style
        The manner.
    camera : Camera
        From where.
    lights : Light or iterable of Light
        What lights them.
    circles, close : tuple of float
        As for `shade` [m].
    order : {"slab", "hard"}
        As for `composite`; slabs, where nothing jumps in an animation.
    delta : float, optional
        Half thickness of a stroke in depth [m]; a quarter of the median width.
    seen : bool
        Return mean depth and index of the stroke with the largest weight too.
    {progress}

    Returns
    -------
    Canvas
        Light and transmittance.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range.

    Examples
    --------
    >>> from pleinair.paint import style as named
    >>> tree = Strokes(np.random.default_rng(0).normal(size=(200, 3)) + [0, 12, 0], (0, 0, 1), (0.6, 0.6))
    >>> canvas = render(tree, named("corot"), Camera(64, 48), Light((0, -1, 1)))
    >>> bool(canvas.transmittance.min() < 0.5)
    True
    """
    parts: list[Strokes] = [strokes] if isinstance(strokes, Strokes) else list(several(strokes, "strokes"))
    choice(order, "order", ("slab", "hard"))
    if not parts:
        msg = "strokes must hold at least one list"
        raise ValueError(msg)
    shaded = [shade(s, style, camera, lights, circles=circles, close=close) for s in parts]
    if delta is None and order == "slab":
        widths = np.concatenate([s.size[:, 0] for s in parts])
        delta = 0.25 * float(np.median(widths)) if widths.size else 0.0
    sprites = join([s.sprites for s in shaded])
    return composite(sprites, camera.width, camera.height, order=order, delta=delta, seen=seen, progress=progress)

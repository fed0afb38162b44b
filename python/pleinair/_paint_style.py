"""What a painter chooses: strokes, palettes, distance, styles. Public as `pleinair.paint`."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import color
from ._inputs import choice, flag, instance, json_object, real, several, vector

Triple = tuple[float, float, float]


def paint(value: Any, name: str) -> Triple:
    """Return linear RGB of a colour: three numbers of linear light, or '#rrggbb' of sRGB."""
    if isinstance(value, str):
        text = value.removeprefix("#")
        try:
            if len(text) != 6:
                raise ValueError
            levels = [int(text[i : i + 2], 16) / 255 for i in (0, 2, 4)]
        except ValueError:
            msg = f"{name} must be three numbers of linear light or '#rrggbb', got {value!r}"
            raise ValueError(msg) from None
        r, g, b = color.srgb_decode(np.array(levels)).tolist()
        return r, g, b
    return vector(value, name, 0.0)


def pair(value: Any, name: str, low: float, high: float) -> tuple[float, float]:
    """Return two numbers in `[low, high]`."""
    two = several(value, name)
    if len(two) != 2:
        msg = f"{name} must hold two numbers, got {len(two)}"
        raise ValueError(msg)
    return real(two[0], f"{name}[0]", low, high), real(two[1], f"{name}[1]", low, high)


def _check(params: Any, limits: Mapping[str, tuple[float, float]]) -> None:
    for name, (low, high) in limits.items():
        object.__setattr__(params, name, real(getattr(params, name), name, low, high))


@dataclass(frozen=True)
class StrokeParams:
    """How one kind of stroke is lit, shaped and thinned out. Defaults are the thesis' leaves (Fig. 21).

    Parameters
    ----------
    frequency, center_frequency, lightness_frequency : float
        Cells of noise across a stroke, and what the place in the crown and the lightness add, in [0, 1000] [1] (S7).
    stretch : tuple of float
        Factors of the frequency across and along, in [0, 100] [1]. Grass: more across (G10).
    fullness : float
        Bias of the edge, in (0, 1) [1] (S9).
    feather_min, feather_max : float
        Noise below which there is no paint and above which it is full, in [0, 2] [1] (S10).
    max_opacity : float
        Largest opacity, in [0, 1] [1] (S11).
    fade_gain : float
        Gain of the fading with distance, in (0, 1) [1]; above 0.5 it eases in and out.
    color_frequency : float
        Cells of the noise that varies the colour within a stroke, in [0, 1000] [1] (S14).
    variation : float
        Lightness that this noise adds or takes, in [0, 1] [1]; its mean is 0.
    ambient : float
        Lightness without any light, in [0, 1] [1].
    outer, outer_gain : float
        Most lightness that the tips of branches gain, in [0, 1], and the gain of their place [1] (S2).
    inner, inner_gain : float
        Most that the heart of a crown, or the depth of a surface, loses, in [0, 1], and its gain [1]; gone far away.
    shadow_bias : float
        Factor of the lightness in full shadow, in (0, 1) [1] (S4).
    roughness : float
        Share of a random normal in the normal, in [0, 1] [1] (G6).
    crest : float
        Share of the height that is left where the surface is seen edge on, in [0.001, 1] [1]; 1 is off (G11).

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> grass = StrokeParams(stretch=(4, 1), crest=0.3)
    >>> StrokeParams.from_json(grass.to_json()) == grass
    True
    """

    frequency: float = 1.0
    center_frequency: float = 5.0
    lightness_frequency: float = 5.0
    stretch: tuple[float, float] = (1.0, 1.0)
    fullness: float = 0.8
    feather_min: float = 0.4
    feather_max: float = 0.6
    max_opacity: float = 0.9
    fade_gain: float = 0.6
    color_frequency: float = 8.0
    variation: float = 0.06
    ambient: float = 0.15
    outer: float = 0.25
    outer_gain: float = 0.6
    inner: float = 0.3
    inner_gain: float = 0.6
    shadow_bias: float = 0.4
    roughness: float = 0.15
    crest: float = 1.0

    def __post_init__(self) -> None:
        small, most = 1e-6, 1 - 1e-6
        limits = dict.fromkeys(("frequency", "center_frequency", "lightness_frequency", "color_frequency"), (0.0, 1e3))
        limits |= dict.fromkeys(("fullness", "fade_gain", "outer_gain", "inner_gain", "shadow_bias"), (small, most))
        limits |= dict.fromkeys(("max_opacity", "variation", "ambient", "outer", "inner", "roughness"), (0.0, 1.0))
        limits |= {"feather_min": (0.0, 2.0), "feather_max": (0.0, 2.0), "crest": (1e-3, 1.0)}
        _check(self, limits)
        object.__setattr__(self, "stretch", pair(self.stretch, "stretch", 0, 100))
        if self.feather_max < self.feather_min:
            msg = f"feather_max must not be below feather_min, got {self.feather_max:g} and {self.feather_min:g}"
            raise ValueError(msg)

    def to_json(self) -> str:
        """Return the parameters as JSON, every bit of them.

        Examples
        --------
        >>> StrokeParams().to_json()[:18]
        '{"frequency": 1.0,'
        """
        return json.dumps(dataclasses.asdict(self))

    @classmethod
    def from_json(cls, text: str) -> StrokeParams:
        """Return the parameters that `to_json` wrote.

        Parameters
        ----------
        text : str
            JSON.

        Raises
        ------
        ValueError, TypeError
            It is not JSON of these parameters.

        Examples
        --------
        >>> StrokeParams.from_json('{"inner": 0.2}').inner
        0.2
        """
        out: StrokeParams = _build(cls, json_object(text, f"a {cls.__name__}"))
        return out


def _build(cls: Any, data: Any) -> Any:
    names = {f.name for f in dataclasses.fields(cls)}
    if not isinstance(data, dict) or not set(data) <= names:
        extra = sorted(set(data) - names) if isinstance(data, dict) else type(data).__name__
        msg = f"text must hold an object with fields of {cls.__name__}, got {extra}"
        raise ValueError(msg)
    return cls(**data)


@dataclass(frozen=True)
class Palette:
    """Colours of dark, middle and light strokes (S12, S13).

    Parameters
    ----------
    dark, mid, light : sequence of colours
        At least one each, evenly spaced: linear RGB, or '#rrggbb' of sRGB.
    cutoffs : tuple of float
        Lightness at which dark begins to give way and is gone, and likewise middle, rising in [0, 1] [1]. The thesis'
        figure has 0.10, 0.60 and 0.65 for four fields; the first is 0 here.
    spline : {"linear", "catmull-rom"}
        Between colours: the thesis says that the two neighbours decide; RenderMan's `spline` is the other.
    mixing : {"pigment", "light"}
        Mix as paint (Kubelka and Munk), where blue and yellow are green, or as light.
    raw : bool
        Look up by the lightness itself rather than by its place between the palette's own cutoffs.

    Raises
    ------
    ValueError, TypeError
        A palette is empty, or the cutoffs do not rise.

    Examples
    --------
    >>> Palette(["#20281c"], ["#56633a", "#7d8a52"], ["#b9b98a"]).cutoffs
    (0.0, 0.1, 0.6, 0.65)
    """

    dark: Any
    mid: Any
    light: Any
    cutoffs: tuple[float, float, float, float] = (0.0, 0.1, 0.6, 0.65)
    spline: str = "linear"
    mixing: str = "pigment"
    raw: bool = False

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("dark", "mid", "light"):
            colors = tuple(paint(c, f"{name}[{i}]") for i, c in enumerate(several(getattr(self, name), name)))
            if not colors:
                msg = f"{name} must hold at least one colour"
                raise ValueError(msg)
            put(self, name, colors)
        cutoffs = tuple(real(x, f"cutoffs[{i}]", 0, 1) for i, x in enumerate(several(self.cutoffs, "cutoffs")))
        if len(cutoffs) != 4 or any(b < a for a, b in itertools.pairwise(cutoffs)):
            msg = f"cutoffs must be four numbers that rise in [0, 1] [1], got {cutoffs}"
            raise ValueError(msg)
        put(self, "cutoffs", cutoffs)
        choice(self.spline, "spline", ("linear", "catmull-rom"))
        choice(self.mixing, "mixing", ("pigment", "light"))
        flag(self.raw, "raw")


@dataclass(frozen=True)
class Atmosphere:
    """What distance does to colours (S16), at `d` = 1; nothing at 0.

    Parameters
    ----------
    color : color
        Towards which colours go: linear RGB or '#rrggbb' of sRGB.
    strength : float
        How far, in [0, 1] [1].
    saturation : float
        Share of the saturation that is forbidden, in [0, 1] [1].
    value : tuple of float
        Least and most value of HSV, in [0, 1] [1].
    bias : float
        Bias of the distance, in (0, 1) [1]: below 0.5 it acts late.

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> Atmosphere().value
    (0.2, 0.78)
    """

    color: Any = (0.45, 0.55, 0.62)
    strength: float = 0.03
    saturation: float = 0.0
    value: tuple[float, float] = (0.2, 0.78)
    bias: float = 0.1

    def __post_init__(self) -> None:
        object.__setattr__(self, "color", paint(self.color, "color"))
        _check(self, {"strength": (0, 1), "saturation": (0, 1), "bias": (1e-6, 1 - 1e-6)})
        low, high = pair(self.value, "value", 0, 1)
        if high < low:
            msg = f"value must rise, got {(low, high)}"
            raise ValueError(msg)
        object.__setattr__(self, "value", (low, high))


@dataclass(frozen=True)
class Material:
    """A kind of stroke and its colours: what several objects may share (G9).

    Parameters
    ----------
    palette : Palette
        The colours.
    params : StrokeParams
        The strokes.

    Examples
    --------
    >>> style("corot").material("leaves").params.max_opacity
    0.9
    """

    palette: Palette
    params: StrokeParams = field(default_factory=StrokeParams)

    def __post_init__(self) -> None:
        put = object.__setattr__
        if isinstance(self.palette, dict):
            put(self, "palette", _build(Palette, self.palette))
        if isinstance(self.params, dict):
            put(self, "params", _build(StrokeParams, self.params))
        instance(self.palette, "palette", Palette)
        instance(self.params, "params", StrokeParams)


@dataclass(frozen=True)
class Style:
    """Everything that makes a manner of painting.

    Parameters
    ----------
    materials : mapping of str to Material
        By name; what has no entry is painted as the first.
    atmosphere : Atmosphere
        What distance does to colours.
    tints : tuple of two colours
        Between which each object has its own (S15).
    tint : float
        How much of it, in [0, 1] [1].
    light_tint : float
        How much the colour of the light colours the paint, in [0, 1] [1].
    largest : float
        Largest stroke, of the picture's height, in (0, 10] [1]: nearer ones hardly grow.
    sparse : float
        Share of a crown's radius from which strokes give way in the extreme foreground, in [0, 2] [1].
    exposure : float
        Factor of all colours, in [0, 1e9] [1]: paints are reflectances, a physical sky is in cd/m².
    curve : {"perlin", "schlick"}
        Bias and gain (S3).

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> corot = style("corot")
    >>> Style.from_json(corot.to_json()) == corot
    True
    """

    materials: Any
    atmosphere: Atmosphere = field(default_factory=Atmosphere)
    tints: Any = ((0.25, 0.2, 0.08), (0.12, 0.2, 0.2))
    tint: float = 0.02
    light_tint: float = 1.0
    largest: float = 0.12
    sparse: float = 0.9
    exposure: float = 1.0
    curve: str = "perlin"

    def __post_init__(self) -> None:
        put = object.__setattr__
        named = self.materials.items() if isinstance(self.materials, Mapping) else several(self.materials, "materials")
        materials = []
        for name, material in named:
            built = _build(Material, material) if isinstance(material, dict) else material
            materials.append((str(name), instance(built, f"materials[{name!r}]", Material)))
        if not materials:
            msg = "materials must hold at least one"
            raise ValueError(msg)
        put(self, "materials", tuple(materials))
        if isinstance(self.atmosphere, dict):
            put(self, "atmosphere", _build(Atmosphere, self.atmosphere))
        instance(self.atmosphere, "atmosphere", Atmosphere)
        tints = tuple(paint(c, f"tints[{i}]") for i, c in enumerate(several(self.tints, "tints")))
        if len(tints) != 2:
            msg = f"tints must be two colours, got {len(tints)}"
            raise ValueError(msg)
        put(self, "tints", tints)
        limits = {"tint": (0, 1), "light_tint": (0, 1), "largest": (1e-4, 10), "sparse": (0, 2), "exposure": (0, 1e9)}
        _check(self, limits)
        choice(self.curve, "curve", ("perlin", "schlick"))

    def material(self, name: str) -> Material:
        """Return a material; the first for a name that the style does not know.

        Parameters
        ----------
        name : str
            Such as "leaves".

        Examples
        --------
        >>> style("corot").material("grass").params.stretch
        (4.0, 1.0)
        """
        known: dict[str, Material] = dict(self.materials)
        return known.get(name, next(iter(known.values())))

    def to_json(self) -> str:
        """Return the style as JSON, every bit of it.

        Examples
        --------
        >>> Style.from_json(style("winter").to_json()) == style("winter")
        True
        """
        data = dataclasses.asdict(self)
        data["materials"] = {name: dataclasses.asdict(material) for name, material in self.materials}
        return json.dumps(data)

    @classmethod
    def from_json(cls, text: str) -> Style:
        """Return the style that `to_json` wrote.

        Parameters
        ----------
        text : str
            JSON.

        Raises
        ------
        ValueError, TypeError
            It is not JSON of a style.

        Examples
        --------
        >>> Style.from_json(style("dusk").to_json()).curve
        'perlin'
        """
        out: Style = _build(cls, json_object(text, f"a {cls.__name__}"))
        return out


def _style(
    leaves: tuple[tuple[str, ...], ...],
    grass: tuple[tuple[str, ...], ...],
    straw: tuple[tuple[str, ...], ...],
    rock: tuple[tuple[str, ...], ...],
    bark: tuple[tuple[str, ...], ...],
    water: tuple[tuple[str, ...], ...],
    leaf: Mapping[str, Any] | None = None,
    **more: Any,
) -> Style:
    blade = StrokeParams(
        frequency=2.0,
        center_frequency=4.0,
        lightness_frequency=2.0,
        stretch=(4, 1),
        crest=0.3,
        inner=0.2,
        outer=0.1,
        ambient=0.2,
    )
    stone = StrokeParams(
        frequency=2.0, center_frequency=2.0, lightness_frequency=2.0, roughness=0.3, inner=0.15, outer=0.05
    )
    wood = StrokeParams(
        frequency=2.0,
        center_frequency=0.0,
        lightness_frequency=1.0,
        stretch=(2, 0.6),
        fullness=0.9,
        feather_min=0.25,
        inner=0.0,
        outer=0.0,
        variation=0.1,
    )
    # Long level strokes (F3); what they reflect gives them their colour.
    ripple = StrokeParams(
        center_frequency=0.0, lightness_frequency=0.0, stretch=(0.7, 4), feather_min=0.25, feather_max=0.55, outer=0.0
    )
    kinds = (
        ("leaves", leaves, StrokeParams(**(leaf or {}))),
        ("grass", grass, blade),
        ("straw", straw, blade),
        ("rock", rock, stone),
        ("bark", bark, wood),
        ("water", water, ripple),
    )
    return Style(
        tuple((name, Material(Palette(colors[0], colors[1], colors[2]), params)) for name, colors, params in kinds),
        **more,
    )


# Corot's silvery greens and pale yellows, dark mixed with browns rather than black (thesis II); the others are ours.
_STYLES: dict[str, Style] = {
    "corot": _style(
        (("#1f2318", "#2b3022", "#34382a"), ("#434a33", "#59613f", "#707650"), ("#8f9068", "#b3ad82", "#d0c79c")),
        (("#24281b", "#32361f"), ("#4a4f30", "#666a3e", "#7d7f4e"), ("#999764", "#b9b384")),
        (("#2f2d1d", "#403c26"), ("#615b38", "#807848", "#988d58"), ("#b3a66e", "#cfc28c")),
        (("#33302b", "#45403a"), ("#6a6359", "#8a8274"), ("#b0a692", "#cfc5ae")),
        (("#241f1a", "#332b23"), ("#4d4236", "#6a5d4d"), ("#94866f", "#b5a68c")),
        (("#23291f",), ("#3a4334", "#4d5747"), ("#6d7763",)),
        atmosphere=Atmosphere(color="#a4b3bf", strength=0.55, saturation=0.35, bias=0.3),
    ),
    "impressionist_noon": _style(
        (("#1d3557", "#274b3f", "#2f5d3a"), ("#3f7d3c", "#6a9d3a", "#8fb441"), ("#c5cf4d", "#ecdf6b", "#f8efa4")),
        (("#2d4a6b", "#3f6b4a"), ("#6f9b3f", "#9dba45"), ("#d9d25a", "#f3e58a")),
        (("#4a4f6b", "#6a6a4a"), ("#a3953f", "#c4a845"), ("#ecd06a", "#f8e6a0")),
        (("#4a4a75", "#615f86"), ("#9c8aa0", "#c0a6a6"), ("#ecd2ae", "#f8e8cc")),
        (("#3a2f55", "#54406a"), ("#7d5f6f", "#a07f78"), ("#d3a982", "#edcfa2")),
        (("#1f3f5c",), ("#2f6478", "#3f7f80"), ("#79aba0",)),
        leaf={"variation": 0.14, "feather_min": 0.42, "feather_max": 0.52, "shadow_bias": 0.5, "max_opacity": 0.95},
        atmosphere=Atmosphere(color="#9fc3ea", strength=0.4, saturation=0.1, value=(0.3, 0.95)),
        tint=0.04,
    ),
    "winter": _style(
        (("#2e2f35", "#3b3a3f"), ("#57534f", "#6f6a63"), ("#9b9690", "#cfcdca", "#eef0f2")),
        (("#6c7684", "#8591a0"), ("#aab4bf", "#c6cdd4"), ("#e3e7ea", "#f7f7f5")),
        (("#6b6a68", "#86827c"), ("#a59d90", "#bdb5a8"), ("#d8d2c8", "#efece6")),
        (("#3a3c42", "#4d4f55"), ("#777a80", "#9a9ca0"), ("#cfd2d6", "#f0f1f2")),
        (("#201d1f", "#2e2a2b"), ("#474143", "#625b5b"), ("#8d8684", "#b9b3af")),
        (("#33393f",), ("#525c66", "#6d7883"), ("#9aa6b0",)),
        leaf={"max_opacity": 0.8, "variation": 0.04},
        atmosphere=Atmosphere(color="#c9d2dc", strength=0.5, saturation=0.5, value=(0.35, 0.92)),
    ),
    "dusk": _style(
        (("#101421", "#181b2b", "#1f2030"), ("#2b2a38", "#3b3440", "#4d3d44"), ("#7a5148", "#a8694c", "#d98f5b")),
        (("#15182a", "#1f2033"), ("#332d3d", "#473a45"), ("#7c5a4e", "#b07a58")),
        (("#1c1a2a", "#282333"), ("#40343d", "#574542"), ("#8f654e", "#c08a5e")),
        (("#1d1e30", "#2a2838"), ("#453c4a", "#5f4d55"), ("#97705f", "#c99069")),
        (("#0f1019", "#181722"), ("#29242f", "#3a3038"), ("#6b4c45", "#9b6a50")),
        (("#0e1320",), ("#1f2435", "#2b2f42"), ("#4f4a5a",)),
        leaf={"ambient": 0.08, "shadow_bias": 0.3},
        atmosphere=Atmosphere(color="#6a5a78", strength=0.45, saturation=0.2, value=(0.12, 0.6)),
        tint=0.03,
    ),
    "moonlight": _style(
        (("#0c1016", "#121823", "#181f2c"), ("#222b3a", "#2b3646", "#374353"), ("#55647a", "#7d8da3", "#a9b6c6")),
        (("#10151d", "#182029"), ("#26303b", "#333f4a"), ("#586777", "#8593a2")),
        (("#14171d", "#1e2229"), ("#323640", "#454a54"), ("#6c7280", "#9aa1ad")),
        (("#15181f", "#20242c"), ("#393f4a", "#505763"), ("#858d9b", "#bac1cb")),
        (("#0b0e14", "#14171e"), ("#20252e", "#2d333d"), ("#565f6d", "#838d9c")),
        (("#0a0e15",), ("#182130", "#223044"), ("#4c6079",)),
        leaf={"ambient": 0.08, "shadow_bias": 0.25, "variation": 0.03},
        atmosphere=Atmosphere(color="#2a3648", strength=0.5, saturation=0.4, value=(0.08, 0.6)),
        tint=0.02,
    ),
}


def styles() -> list[str]:
    """Return the names of the styles.

    Returns
    -------
    list of str
        For `style`.

    Examples
    --------
    >>> styles()
    ['corot', 'impressionist_noon', 'winter', 'dusk', 'moonlight']
    """
    return list(_STYLES)


def style(name: str) -> Style:
    """Return a style by its name; `dataclasses.replace` changes parts of it.

    Parameters
    ----------
    name : str
        One of `styles()`.

    Returns
    -------
    Style
        With the materials leaves, grass, straw, rock, bark and water.

    Raises
    ------
    ValueError
        There is no such style.

    Examples
    --------
    >>> style("corot").curve
    'perlin'
    """
    return _STYLES[choice(name, "name", tuple(_STYLES))]


def circle(value: Any, name: str) -> tuple[float, float]:
    """Return two distances [m]; infinity is allowed."""
    two = several(value, name)
    if len(two) != 2:
        msg = f"{name} must hold two distances, got {len(two)}"
        raise ValueError(msg)
    low, high = (1e300 if x == math.inf else real(x, f"{name}[{i}]", 0, 1e300, "m") for i, x in enumerate(two))
    if high < low:
        msg = f"{name} must rise, got {(low, high)}"
        raise ValueError(msg)
    return low, high

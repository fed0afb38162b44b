"""Materials of strokes and styles of painting: form of a stroke, palette, aerial perspective. Public as `pleinair.paint`."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .._support.inputs import (
    boolean_mask,
    check,
    choice,
    flag,
    instance,
    integer,
    linear_light,
    pair,
    real,
    several,
    vector,
)
from .._support.schema import JsonFields, build
from ..color import luminance, srgb_decode
from .grade import Grade

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
        r, g, b = srgb_decode(np.array(levels)).tolist()
        return r, g, b
    return vector(value, name, 0.0)


@dataclass(frozen=True)
class StrokeParams(JsonFields):
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
        check(self, limits)
        object.__setattr__(self, "stretch", pair(self.stretch, "stretch", 0, 100))
        if self.feather_max < self.feather_min:
            msg = f"feather_max must not be below feather_min, got {self.feather_max:g} and {self.feather_min:g}"
            raise ValueError(msg)


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

    @classmethod
    def from_picture(cls, rgb: ArrayLike, mask: ArrayLike | None = None, colors: int = 3, **more: Any) -> Palette:
        """Return the palette of a picture, such as a painting or a photograph (the thesis' K4).

        Parameters
        ----------
        rgb : array_like (height, width, 3)
            Linear light; only colours between 0 and 1 become paints.
        mask : array_like (height, width) of bool, optional
            Which pixels: those of its trees, say.
        colors : int
            For dark, middle and light strokes each, in [1, 64] [1].
        **more : object
            Other parameters of `Palette`.

        Returns
        -------
        Palette
            Each colour is the mean of an equal share of the pixels, in the order of their luminance.

        Raises
        ------
        ValueError, TypeError
            Fewer pixels than colours are left.

        Examples
        --------
        >>> [round(x, 2) for x in Palette.from_picture(np.linspace(0, 1, 27).reshape(9, 1, 3), colors=1).mid[0]]
        [0.46, 0.5, 0.54]
        """
        picture = linear_light(rgb, "rgb", ndim=3, last=3).astype(np.float64)
        count = 3 * integer(colors, "colors", 1, 64)
        use = np.ones(picture.shape[:2], np.bool_) if mask is None else boolean_mask(mask, "mask", picture.shape[:2])
        pixels = np.clip(picture[use], 0, 1)
        pixels = pixels[np.isfinite(pixels).all(axis=1)]
        if len(pixels) < count:
            msg = f"rgb must have at least {count} pixels to take colours from, got {len(pixels)}"
            raise ValueError(msg)
        pixels = pixels[np.argsort(luminance(pixels), kind="stable")]
        found = [tuple(part.mean(axis=0).tolist()) for part in np.array_split(pixels, count)]
        return cls(found[:colors], found[colors : 2 * colors], found[2 * colors :], **more)


@dataclass(frozen=True)
class AerialPerspective:
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
    >>> AerialPerspective().value
    (0.2, 0.78)
    """

    color: Any = (0.45, 0.55, 0.62)
    strength: float = 0.03
    saturation: float = 0.0
    value: tuple[float, float] = (0.2, 0.78)
    bias: float = 0.1

    def __post_init__(self) -> None:
        object.__setattr__(self, "color", paint(self.color, "color"))
        check(self, {"strength": (0, 1), "saturation": (0, 1), "bias": (1e-6, 1 - 1e-6)})
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
    reflective : bool
        Whether strokes have the colour of what they mirror, as calm water has: on a level ground they do.

    Examples
    --------
    >>> Material(Palette(["#20281c"], ["#56633a"], ["#b9b98a"])).params.max_opacity
    0.9
    """

    NESTED: ClassVar = {"palette": Palette, "params": StrokeParams}

    palette: Palette
    params: StrokeParams = field(default_factory=StrokeParams)
    reflective: bool = False

    def __post_init__(self) -> None:
        instance(self.palette, "palette", Palette)
        instance(self.params, "params", StrokeParams)
        flag(self.reflective, "reflective")


@dataclass(frozen=True)
class Style(JsonFields):
    """Everything that makes a manner of painting.

    Parameters
    ----------
    materials : mapping of str to Material
        By name; what has no entry is painted as the first.
    atmosphere : AerialPerspective
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
    grade : Grade
        What is made of the light once it is known.

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> from pleinair.paint import style
    >>> corot = style("corot")
    >>> Style.from_json(corot.to_json()) == corot
    True
    """

    NESTED: ClassVar = {"atmosphere": AerialPerspective, "grade": Grade}

    materials: Any
    atmosphere: AerialPerspective = field(default_factory=AerialPerspective)
    tints: Any = ((0.25, 0.2, 0.08), (0.12, 0.2, 0.2))
    tint: float = 0.02
    light_tint: float = 1.0
    largest: float = 0.12
    sparse: float = 0.9
    exposure: float = 1.0
    curve: str = "perlin"
    grade: Grade = field(default_factory=Grade)

    def __post_init__(self) -> None:
        put = object.__setattr__
        named = self.materials.items() if isinstance(self.materials, Mapping) else several(self.materials, "materials")
        materials = []
        for entry in named:
            if not isinstance(entry, tuple | list) or len(entry) != 2:
                msg = f"materials must be a mapping or pairs of a name and a Material, got {entry!r}"
                raise TypeError(msg)
            name, material = entry
            made = build(Material, material) if isinstance(material, dict) else material
            materials.append((str(name), instance(made, f"materials[{name!r}]", Material)))
        if not materials:
            msg = "materials must hold at least one"
            raise ValueError(msg)
        put(self, "materials", tuple(materials))
        instance(self.atmosphere, "atmosphere", AerialPerspective)
        instance(self.grade, "grade", Grade)
        tints = tuple(paint(c, f"tints[{i}]") for i, c in enumerate(several(self.tints, "tints")))
        if len(tints) != 2:
            msg = f"tints must be two colours, got {len(tints)}"
            raise ValueError(msg)
        put(self, "tints", tints)
        limits = {"tint": (0, 1), "light_tint": (0, 1), "largest": (1e-4, 10), "sparse": (0, 2), "exposure": (0, 1e9)}
        check(self, limits)
        choice(self.curve, "curve", ("perlin", "schlick"))

    def material(self, name: str) -> Material:
        """Return a material; the first for a name that the style does not know.

        Parameters
        ----------
        name : str
            Such as "leaves".

        Examples
        --------
        >>> from pleinair.paint import style
        >>> style("corot").material("grass").params.stretch
        (4.0, 1.0)
        """
        known: dict[str, Material] = dict(self.materials)
        return known.get(name, next(iter(known.values())))

    def _data(self) -> dict[str, Any]:
        data = dataclasses.asdict(self)
        return data | {"materials": {name: dataclasses.asdict(material) for name, material in self.materials}}

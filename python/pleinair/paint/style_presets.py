"""Manners of painting: materials, distance, tints, and styles by name. Public as `pleinair.paint`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .._support.inputs import choice
from .material import Atmosphere, Material, Palette, StrokeParams, Style


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
        feather_min=0.05,
        feather_max=0.35,
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

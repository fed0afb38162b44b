"""What mark is on the canvas: strokes, styles, palettes, the compositor (corot)."""

from __future__ import annotations

from ._detail import growth, thin
from ._paint_params import Atmosphere, Material, Palette, StrokeParams
from ._paint_style import Style, style, styles
from ._painting import join, palette_colors, render, shade, shadows
from ._sprites import Canvas, Sprites, composite, coverage, mask, noise
from ._strokes import Light, Shading, Strokes

__all__ = [
    "Atmosphere",
    "Canvas",
    "Light",
    "Material",
    "Palette",
    "Shading",
    "Sprites",
    "StrokeParams",
    "Strokes",
    "Style",
    "composite",
    "coverage",
    "growth",
    "join",
    "mask",
    "noise",
    "palette_colors",
    "render",
    "shade",
    "shadows",
    "style",
    "styles",
    "thin",
]

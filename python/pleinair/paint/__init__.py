"""What mark is on the canvas: strokes, styles, palettes, the compositor (corot)."""

from __future__ import annotations

from .grade import Grade
from .level_of_detail import growth, thin
from .material import AerialPerspective, Material, Palette, StrokeParams, Style
from .shading import join, palette_colors, render, shade, shadows
from .sprites import Canvas, Sprites, composite, coverage, mask, noise
from .strokes import Light, Shading, Strokes
from .style_presets import style, style_hour, styles

__all__ = [
    "AerialPerspective",
    "Canvas",
    "Grade",
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
    "style_hour",
    "styles",
    "thin",
]

"""Styles by name, read from data/painting_styles.toml when one is first asked for. Public as `pleinair.paint`."""

from __future__ import annotations

import functools
import tomllib
from pathlib import Path
from typing import Any

from .._support.inputs import choice
from .._support.schema import build
from .material import Style

_FILE = Path(__file__).parents[1] / "data" / "painting_styles.toml"


@functools.cache
def _tables() -> dict[str, dict[str, Any]]:
    """Return the styles as the tables that `build` takes."""
    text = tomllib.loads(_FILE.read_text(encoding="utf-8"))
    tables = {}
    for name, table in text["styles"].items():
        palettes, own = table.pop("palettes"), table.pop("strokes", {})
        materials = {
            material: {
                **text["materials"][material],
                "palette": palette,
                "params": text["materials"][material]["params"] | own.get(material, {}),
            }
            for material, palette in palettes.items()
        }
        tables[name] = {"materials": materials, **table}
    return tables


@functools.cache
def _built(name: str) -> Style:
    style: Style = build(Style, _tables()[name])
    return style


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
    return list(_tables())


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
    return _built(choice(name, "name", tuple(_tables())))

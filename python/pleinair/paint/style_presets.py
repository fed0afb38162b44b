"""Styles by name, read from data/painting_styles.toml when one is first asked for. Public as `pleinair.paint`."""

from __future__ import annotations

import functools
import tomllib
from pathlib import Path
from typing import Any

from .._support.inputs import choice, flag
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
def _built(name: str, grade: bool) -> Style:
    table = dict(_tables()[name])
    own = table.pop("grade", {})
    table.pop("hour")
    style: Style = build(Style, table | ({"grade": own} if grade else {}))
    return style


def style_hour(name: str) -> dict[str, Any]:
    """Return the Sun, the Moon and the turbidity of a style, for the sky that is painted in it.

    Parameters
    ----------
    name : str
        One of `styles()`.

    Returns
    -------
    dict
        ``"sun"`` and, where it lights, ``"moon"``: elevation and azimuth [°]; ``"turbidity"`` [1].

    Raises
    ------
    ValueError
        There is no such style.

    Examples
    --------
    >>> style_hour("dusk")
    {'sun': [-2.5, 335], 'turbidity': 4.0}
    """
    return dict(_tables()[choice(name, "name", tuple(_tables()))]["hour"])


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


def style(name: str, *, grade: bool = False) -> Style:
    """Return a style by its name; `dataclasses.replace` changes parts of it.

    Parameters
    ----------
    name : str
        One of `styles()`.
    grade : bool
        With the grade of its manner, what it makes of the light; otherwise light is shown as it is.

    Returns
    -------
    Style
        With the materials leaves, grass, straw, rock, bark, birch (the bark of birches) and water.

    Raises
    ------
    ValueError
        There is no such style.

    Examples
    --------
    >>> style("corot").curve, style("corot", grade=True).grade.sky
    ('perlin', 1.55)
    """
    return _built(choice(name, "name", tuple(_tables())), flag(grade, "grade"))

"""The parts of a scene: one kind of stroke of one object each, by names that `Scene.select` finds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..paint import Material, Strokes, Style
from ..plants import bark_strokes
from .objects import Ground, Placed

# The kind of the part that is a ground's own surface.
UNDERCOAT = "undercoat"


@dataclass(frozen=True, eq=False)
class Part:
    """One kind of stroke of one object of a scene.

    Attributes
    ----------
    name : str
        The object's, unique in its scene.
    kind : str
        "leaves" or "trunk" of a tree, a material of a ground or its "undercoat", "strokes".
    object : Placed, Ground or Strokes
        What it is a part of.
    """

    name: str
    kind: str
    object: Placed | Ground | Strokes

    @property
    def casts(self) -> bool:
        """Whether it takes light from others: of a ground that casts, the surface does and not its strokes."""
        if isinstance(self.object, Ground):
            return self.object.casts and self.kind == UNDERCOAT
        return True


def parts_of(objects: tuple[Any, ...], style: Style) -> tuple[Part, ...]:
    """Return the parts of objects, each object with a name of its own."""
    parts: list[Part] = []
    count: dict[str, int] = {}
    used: set[str] = set()
    for one in objects:
        base = "strokes" if isinstance(one, Strokes) else one.name
        name = base
        while name == base or name in used:
            count[base] = count.get(base, 0) + 1
            name = f"{base}{count[base]}"
        used.add(name)
        if isinstance(one, Placed):
            kinds = [
                k for k, some in (("leaves", len(one.tree.leaves)), ("trunk", len(bark_strokes(one.tree)[0]))) if some
            ]
        elif isinstance(one, Ground):
            # What is under a mirror is not seen.
            solid = (one.undercoat or one.casts) and not style.material(one.material[0]).reflective
            kinds = [*one.material, *([UNDERCOAT] if solid else [])]
        else:
            kinds = ["strokes"]
        parts += [Part(name, kind, one) for kind in kinds]
    return tuple(parts)


def own_material(part: Part) -> str:
    """Return the name of the material that is this part's alone."""
    return f"{part.name}/{part.kind}"


def material_of(part: Part, style: Style) -> Material:
    """Return what a part is painted in: its own material where the style has one, or that of its kind."""
    known: dict[str, Material] = dict(style.materials)
    return known.get(own_material(part), style.material(part.kind))

"""The strokes that objects of a scene are painted in: crowns, stems, grounds and the base layer under them."""

from __future__ import annotations

import functools
import weakref
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..paint import Light, Material, Strokes, Style, growth, thin
from ..plants import Tree, bark_strokes
from .objects import Ground, Placed
from .parts import UNDERCOAT, Part, material_of, own_material

# Light for which the growth of crowns is solved: one for all frames, whatever their light.
_STUDIO = Light((-0.6, -0.5, 0.62))
# Distances for which it is solved: within 0.8 % of the growth of 24 of them, for half the cost of twelve.
_KNOTS = 7


# The strokes of an object as they stand, for each manner of painting them: made once, so that what depends on them is too.
_standing: weakref.WeakKeyDictionary[Any, dict[Any, Strokes]] = weakref.WeakKeyDictionary()


def strokes_of(part: Part, style: Style, grown: bool, camera: Camera | None) -> Strokes:
    """Return the strokes of a part, painted as its own material where the style has one."""
    found = standing(part, style, grown)
    if camera is None or part.kind != "trunk" or not isinstance(part.object, Placed):
        return found
    return found._with(twist=lean(part, camera))


def standing(part: Part, style: Style, grown: bool) -> Strokes:
    """Return the strokes of a part as no camera turns them: always the same ones."""
    own = own_material(part) if own_material(part) in dict(style.materials) else None
    reflective = isinstance(part.object, Ground) and part.kind != UNDERCOAT and material_of(part, style).reflective
    grown = grown and part.kind == "leaves" and isinstance(part.object, Placed)
    law = (style.material(own or "leaves"), style.curve) if grown else None
    known, key = _standing.setdefault(part.object, {}), (part.kind, own, reflective, law)
    if key not in known:
        made = _made(part, own, reflective, law)
        if made is part.object:
            return made
        known[key] = made
    return known[key]


def _made(part: Part, own: str | None, reflective: bool, law: Any) -> Strokes:
    found = part.object
    if isinstance(found, Placed):
        found = _leaves(found) if part.kind == "leaves" else _trunk(found)
    elif isinstance(found, Ground):
        found = found.under if part.kind == UNDERCOAT else (found.ripples if reflective else found.strokes)[part.kind]
    if own is not None:
        found = replace(found, material=own)
    if law is not None and isinstance(part.object, Placed):
        fade, growing = _law(part.object.tree, *law)
        found = replace(found, fade=fade, growth=growing[None])
    return found


def lean(part: Part, camera: Camera, index: Any = slice(None)) -> NDArray[np.float32]:
    """Return how strokes of a trunk are turned, to lie along their stems: the angle of each in the picture [°]."""
    right, up, _ = camera._axes()
    turned = part.object._moved(bark_strokes(part.object.tree)[2][index])  # type: ignore[union-attr]
    twist = np.degrees(np.arctan2(-np.einsum("nk,k", turned, right), np.einsum("nk,k", turned, up)))
    out: NDArray[np.float32] = ((twist + 90) % 180 - 90).astype(np.float32)
    return out


def with_undercoats(style: Style, parts: tuple[Part, ...]) -> Style:
    """Return a style that knows the materials of the surfaces under its grounds."""
    known = dict(style.materials)
    more = {}
    for part in parts:
        if part.kind == UNDERCOAT and isinstance(part.object, Ground):
            first = part.object.material[0]
            own = known.get(f"{part.name}/{first}", style.material(first))
            plain = replace(
                own.params,
                **dict.fromkeys(
                    ("frequency", "center_frequency", "lightness_frequency", "feather_min", "variation"), 0.0
                ),
                feather_max=0.3,
                max_opacity=1.0,
                fullness=0.95,
                roughness=0.0,
                crest=1.0,
            )
            more[own_material(part)] = known.get(own_material(part), replace(own, params=plain))
    return replace(style, materials=known | more)


@functools.lru_cache(maxsize=256)
def _law(tree: Tree, material: Material, curve: str) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Solve which leaves of a tree fade first and how the others grow, once for each material."""
    style = Style({"leaves": material}, curve=curve)
    crown = thin(_leaves(Placed(tree)), style, _STUDIO)
    return crown.fade, growth(crown, style, _STUDIO, knots=_KNOTS)


def _middle(one: Placed) -> NDArray[np.float64]:
    """Return the centre of the crown where it stands."""
    return np.array(one.position) + one.scale * one._moved(np.array([one.tree.leaves.center]))


def _leaves(one: Placed) -> Strokes:
    """Return the crown of a tree where it stands."""
    leaves = one.tree.leaves
    return Strokes(
        np.array(one.position) + one.scale * one._moved(leaves.position),
        one._moved(leaves.normal),
        leaves.size * np.float32(one.scale),
        leaves.label,
        center_ratio=leaves.center_ratio,
        branch_ratio=leaves.branch_ratio,
        fade=leaves.fade,
        object=np.zeros(len(leaves), np.int64),
        centers=_middle(one),
        tint=[one.tree.id],
    )


def _trunk(one: Placed) -> Strokes:
    """Return the stems of a tree where it stands."""
    place, normal, _, size = bark_strokes(one.tree)
    return Strokes(
        np.array(one.position) + one.scale * one._moved(place),
        one._moved(normal),
        size * one.scale,
        material="bark",
        object=np.zeros(len(place), np.int64),
        centers=_middle(one),
        tint=[one.tree.id],
    )

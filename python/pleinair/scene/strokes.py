"""The strokes that objects of a scene are painted in: crowns, stems, grounds and the base layer under them."""

from __future__ import annotations

import functools
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


def strokes_of(part: Part, style: Style, grown: bool, camera: Camera | None) -> Strokes:
    """Return the strokes of a part, painted as its own material where the style has one."""
    found = part.object
    if isinstance(found, Placed):
        found = _leaves(found) if part.kind == "leaves" else _trunk(found, camera)
    elif isinstance(found, Ground):
        if part.kind == UNDERCOAT:
            found = found.under
        else:
            found = (found.ripples if material_of(part, style).reflective else found.strokes)[part.kind]
    own = own_material(part)
    if own in dict(style.materials):
        found = replace(found, material=own)
    if grown and part.kind == "leaves" and isinstance(part.object, Placed):
        fade, law = _law(part.object.tree, style.material(found.material), style.curve)
        found = replace(found, fade=fade, growth=law[None])
    return found


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
    return crown.fade, growth(crown, style, _STUDIO)


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


def _trunk(one: Placed, camera: Camera | None) -> Strokes:
    """Return the stems of a tree where it stands."""
    place, normal, along, size = bark_strokes(one.tree)
    twist: Any = 0.0
    if camera is not None:
        # Strokes lie along their stems: the angle of the stem in the picture.
        turned = one._moved(along)
        right, up, _ = camera._axes()
        twist = np.degrees(np.arctan2(-(turned @ right), turned @ up))
        twist = (twist + 90) % 180 - 90
    return Strokes(
        np.array(one.position) + one.scale * one._moved(place),
        one._moved(normal),
        size * one.scale,
        material="bark",
        twist=twist,
        object=np.zeros(len(place), np.int64),
        centers=_middle(one),
        tint=[one.tree.id],
    )

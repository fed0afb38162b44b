"""What stands in a scene and the strokes it is painted in. Public as `pleinair.scene`."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._inputs import flag, instance, real, several, vector
from .camera import Camera
from .paint import Light, Material, Strokes, Style, growth, noise, thin
from .plants import Particles, Strata, Surface, Tree

# The kind of the part that is a ground's own surface.
UNDERCOAT = "undercoat"
# Size of its strokes, in the distances between them [1].
_COVERING = 2.6
# Light for which the growth of crowns is solved: one for all frames, whatever their light.
_STUDIO = Light((-0.6, -0.5, 0.62))


@dataclass(frozen=True)
class Placed:
    """A tree that stands somewhere.

    Parameters
    ----------
    tree : Tree
        The tree.
    position : tuple of float
        Of its foot: x east, y north, z up [m].
    turn : float
        Counter-clockwise, seen from above [°].
    scale : float
        In [0.001, 1000] [1].
    name : str
        What `Scene.select` finds it by; a number is put behind it.

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Examples
    --------
    >>> from pleinair.plants import Tree, preset
    >>> Placed(Tree.grow(preset("shrub"), rng=1), (3, 20, 0)).position
    (3.0, 20.0, 0.0)
    """

    tree: Tree
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: float = 0.0
    scale: float = 1.0
    name: str = "tree"

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.tree, "tree", Tree)
        put(self, "position", vector(self.position, "position"))
        put(self, "turn", real(self.turn, "turn", -1e6, 1e6, "°"))
        put(self, "scale", real(self.scale, "scale", 1e-3, 1e3))
        instance(self.name, "name", str)

    def _moved(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        sin, cos = math.sin(math.radians(self.turn)), math.cos(math.radians(self.turn))
        turn = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        out: NDArray[np.float64] = np.asarray(x, np.float64) @ turn
        return out


@dataclass(frozen=True, eq=False)
class Ground:
    """A surface under strokes of one material: a meadow, a rock, water.

    Parameters
    ----------
    surface : Surface
        Where they are; its normals are on the side that is seen.
    material : str or sequence of str
        Of the style's; among several noise chooses, in equal shares (G9). Strokes of "water" have the colour of what
        they reflect, as if it were level.
    strata : Strata
        How strokes are strewn.
    rng : None, int or Generator
        Seed of where they are.
    casts : bool
        Whether the surface casts a shadow: a rock does. Its strokes only receive light (G8).
    undercoat : bool
        Whether the surface itself is painted under the strokes, opaque, so that nothing behind it shows through (G4).
    patch : float
        Size of the patches of several materials, in [1e-3, 1e6] [m].
    roughness : float
        Share of a random normal in the strokes' normals, in [0, 1] [1] (G6); water has waves of a tenth of it.
    name : str, optional
        What `Scene.select` finds it by, with a number behind it; by default the first material.

    Raises
    ------
    ValueError, TypeError
        A value is of the wrong kind.

    Examples
    --------
    >>> import numpy as np
    >>> hill = Surface.heightfield(np.zeros((4, 4)), spacing=10.0)
    >>> len(Ground(hill, "grass", Strata(spans=(3, 3), count=2), rng=1).particles)
    18
    """

    surface: Surface
    material: Any = "grass"
    strata: Strata = field(default_factory=Strata)
    rng: Any = None
    casts: bool = False
    undercoat: bool = True
    patch: float = 12.0
    roughness: float = 0.3
    name: str | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.surface, "surface", Surface)
        given = (self.material,) if isinstance(self.material, str) else several(self.material, "material")
        put(self, "material", tuple(dict.fromkeys(instance(one, "material", str) for one in given)))
        if not self.material:
            msg = "material must name at least one"
            raise ValueError(msg)
        instance(self.strata, "strata", Strata)
        flag(self.casts, "casts")
        flag(self.undercoat, "undercoat")
        put(self, "patch", real(self.patch, "patch", 1e-3, 1e6, "m"))
        put(self, "roughness", real(self.roughness, "roughness", 0, 1))
        put(self, "name", instance(self.material[0] if self.name is None else self.name, "name", str))

    @functools.cached_property
    def particles(self) -> Particles:
        """The strokes' places."""
        return self.surface.emit(self.strata, rng=self.rng)

    @functools.cached_property
    def strokes(self) -> dict[str, Strokes]:
        """The strokes by their material, the same in every frame."""
        p = self.particles
        kinds = len(self.material)
        which = np.zeros(len(p), np.int64)
        if kinds > 1:
            # The edges of patches are broken up by each stroke's own chance.
            value = noise(0, p.position[:, :2] / self.patch) + 0.15 * (p.label / 2.0**32 - 0.5)
            which[np.argsort(value, kind="stable")] = np.arange(len(p)) * kinds // max(len(p), 1)
        out = {}
        for k, material in enumerate(self.material):
            normals = p.normals(self.roughness * (0.1 if material == "water" else 1.0))
            of = which == k
            out[material] = Strokes(p.position[of], normals[of], p.size[of], p.label[of], material,
                                    center_ratio=p.height[of], fade=p.fade[of])  # fmt: skip
        return out

    @functools.cached_property
    def under(self) -> Strokes:
        """The surface itself: broad opaque strokes whose upper edges are its own."""
        solid = self.surface.tessellated()
        corners = solid.vertices[solid.faces.astype(np.int64)]
        area = (
            0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
        )
        # As many as to follow the surface's forms, not its strokes.
        side = int(np.clip(round(math.sqrt(len(self.particles) / 4)), 10, 100))
        strata = Strata((side, side), 1, displacement=0.0, fade_from=1.0)
        p = self.surface.emit(strata, rng=0)
        size = np.full((len(p), 2), _COVERING * math.sqrt(area) / side)
        depth = self.strata.displacement * self.strata.unit + 0.5 * size[:, :1]
        return Strokes(p.position - depth * p.normal, p.normal, size, p.label, self.material[0], center_ratio=0.0)


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


def parts_of(objects: tuple[Any, ...]) -> tuple[Part, ...]:
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
            kinds = [k for k, some in (("leaves", len(one.tree.leaves)), ("trunk", len(bark(one.tree)[0]))) if some]
        elif isinstance(one, Ground):
            # Water is level and what is under it is not seen.
            solid = one.undercoat or one.casts
            kinds = [*one.material, *([UNDERCOAT] if solid and one.material[0] != "water" else [])]
        else:
            kinds = ["strokes"]
        parts += [Part(name, kind, one) for kind in kinds]
    return tuple(parts)


def strokes_of(part: Part, style: Style, grown: bool, camera: Camera | None) -> Strokes:
    """Return the strokes of a part, painted as its own material where the style has one."""
    found = part.object
    if isinstance(found, Placed):
        found = _leaves(found) if part.kind == "leaves" else _trunk(found, camera)
    elif isinstance(found, Ground):
        found = found.under if part.kind == UNDERCOAT else found.strokes[part.kind]
    own = own_material(part)
    if own in dict(style.materials):
        found = replace(found, material=own)
    if grown and part.kind == "leaves" and isinstance(part.object, Placed):
        fade, law = _law(part.object.tree, style.material(found.material), style.curve)
        found = replace(found, fade=fade, growth=law[None])
    return found


def own_material(part: Part) -> str:
    """Return the name of the material that is this part's alone."""
    return f"{part.name}/{part.kind}"


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


@functools.lru_cache(maxsize=64)
def bark(tree: Tree) -> tuple[NDArray[np.float64], ...]:
    """Return a stroke for each face of a tree's stems: middle, normal, way along the stem, width and height."""
    mesh = tree.lod(0, subdivisions=0)
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.quads, np.int64)]
    sides = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    some = np.linalg.norm(normal, axis=1) > 1e-9
    length = np.linalg.norm(sides, axis=2)
    # Sides 1 and 3 go along the stem where they are the longer pair on the whole.
    upright = length[:, [1, 3]].sum() >= length[:, [0, 2]].sum()
    along = sides[:, 1] - sides[:, 3] if upright else sides[:, 0] - sides[:, 2]
    width = length[:, [0, 2] if upright else [1, 3]].mean(axis=1)
    height = length[:, [1, 3] if upright else [0, 2]].mean(axis=1)
    size = np.stack([1.5 * width, 1.4 * height], axis=1)
    return corners.mean(axis=1)[some], normal[some], along[some], size[some]


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
    place, normal, along, size = bark(one.tree)
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

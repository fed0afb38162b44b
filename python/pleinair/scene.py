"""From where, when, in what order: a sky, clouds and plants as one painted picture (corot and the rest)."""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import tone
from ._inputs import Progress, flag, instance, integer, real, reporter, several, vector
from .camera import Camera
from .paint import Canvas, Light, Strokes, Style, composite, growth, join, shade, shadows, thin
from .paint import style as named
from .plants import Particles, Strata, Surface, Tree
from .sky import Sky

__all__ = ["Ground", "Placed", "Scene", "Timeline"]


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

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.tree, "tree", Tree)
        put(self, "position", vector(self.position, "position"))
        put(self, "turn", real(self.turn, "turn", -1e6, 1e6, "°"))
        put(self, "scale", real(self.scale, "scale", 1e-3, 1e3))

    def _moved(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        sin, cos = math.sin(math.radians(self.turn)), math.cos(math.radians(self.turn))
        turn = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        out: NDArray[np.float64] = np.asarray(x, np.float64) @ turn
        return out


@dataclass(frozen=True, eq=False)
class Ground:
    """A surface under strokes of one material.

    Parameters
    ----------
    surface : Surface
        A hill, a rock, water.
    material : str
        One of the style's.
    strata : Strata
        How strokes are strewn.
    rng : None, int or Generator
        Seed of where they are.

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
    material: str = "grass"
    strata: Strata = field(default_factory=Strata)
    rng: Any = None

    def __post_init__(self) -> None:
        instance(self.surface, "surface", Surface)
        instance(self.material, "material", str)
        instance(self.strata, "strata", Strata)

    @functools.cached_property
    def particles(self) -> Particles:
        """The strokes' places."""
        return self.surface.emit(self.strata, rng=self.rng)

    @functools.cached_property
    def strokes(self) -> Strokes:
        """The strokes, the same in every frame."""
        p = self.particles
        normals = p.normals(0.3)
        return Strokes(p.position, normals, p.size, p.label, self.material, center_ratio=p.height, fade=p.fade)


@dataclass(frozen=True, eq=False)
class Scene:
    """A sky and what stands under it, to be painted.

    Parameters
    ----------
    sky : Sky
        Behind everything; its Sun lights the scene.
    objects : iterable of Placed, Tree, Ground or Strokes
        What there is. A tree alone stands at the origin.
    style : Style or str
        The manner, or the name of one.
    circles : tuple of float
        Distances along the view up to which all is foreground, and from which on background [m].
    trunk_circles : tuple of float, optional
        The same for trunks; by default `circles` [m].
    close : tuple of float
        In the extreme foreground, where inner strokes are gone and from where they give way [m].
    cast_shadows : bool
        Whether strokes take light from each other.
    grown : bool
        Whether strokes of trees grow with distance so that silhouettes hold; solved once for each tree, a second or two.

    Raises
    ------
    ValueError, TypeError
        A value is of the wrong kind or out of range.

    Examples
    --------
    >>> from pleinair import Camera, Sun
    >>> from pleinair.sky import Aoas
    >>> from pleinair.plants import Tree, preset
    >>> shrub = Placed(Tree.grow(preset("shrub"), rng=1), (0, 12, 0))
    >>> scene = Scene(Aoas(sun=Sun(30, 160)), [shrub], grown=False, cast_shadows=False)
    >>> scene.paint(Camera(64, 48, elevation=5)).shape
    (48, 64, 3)
    """

    sky: Sky
    objects: Any = ()
    style: Any = "corot"
    circles: tuple[float, float] = (40.0, 400.0)
    trunk_circles: tuple[float, float] | None = None
    close: tuple[float, float] = (0.0, 0.0)
    cast_shadows: bool = True
    grown: bool = True

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.sky, "sky", Sky)
        put(self, "style", named(self.style) if isinstance(self.style, str) else instance(self.style, "style", Style))
        objects = tuple(Placed(o) if isinstance(o, Tree) else o for o in several(self.objects, "objects"))
        for one in objects:
            if not isinstance(one, (Placed, Ground, Strokes)):
                msg = f"objects must be Placed, Tree, Ground or Strokes, got {type(one).__name__}"
                raise TypeError(msg)
        put(self, "objects", objects)
        flag(self.cast_shadows, "cast_shadows")
        flag(self.grown, "grown")

    def light(self) -> Light:
        """Return the Sun as what lights the strokes: its direction, and its colour as far as a painter shows it.

        Returns
        -------
        Light
            From the zenith, faint, when the Sun has set.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Scene(Aoas(sun=Sun(30, 180))).light().direction[2] > 0.4
        True
        """
        lamp = self.sky.sun_light()
        color = np.clip(np.array(lamp.irradiance), 0, None)
        if color.max() <= 0:
            return Light((0.0, 0.0, 1.0), strength=0.3)
        # Half way to white: a low sun's own colour would leave leaves no green.
        color = 0.5 + 0.5 * color / color.max()
        return Light(lamp.direction, color=tuple(float(c) for c in color))

    def strokes(self, camera: Camera | None = None) -> list[tuple[Strokes, bool]]:
        """Return the strokes of all objects, and whether each list casts shadows.

        Parameters
        ----------
        camera : Camera, optional
            Of a frame: with it strokes are shaded by what the frame shows of the others.

        Returns
        -------
        list of (Strokes, bool)
            Crowns and trunks of trees, strokes of grounds (which only receive shadows), strokes as they were given.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> from pleinair.plants import Tree, preset
        >>> scene = Scene(Aoas(sun=Sun(30, 160)), [Tree.grow(preset("shrub"), rng=1)], grown=False)
        >>> [s.material for s, _ in scene.strokes()]
        ['leaves', 'bark']
        """
        style, light = self.style, self.light()
        parts: list[tuple[Strokes, bool]] = []
        for one in self.objects:
            if isinstance(one, Strokes):
                parts.append((one, True))
            elif isinstance(one, Ground):
                if len(one.particles):
                    parts.append((one.strokes, False))
            else:
                parts += [(s, True) for s in _planted(one, style, light, self.grown, camera)]
        if not self.cast_shadows or not parts:
            return parts
        lists = [s for s, _ in parts]
        lit = shadows(lists, light.direction, style, casts=[c for _, c in parts], camera=camera, circles=self.circles)
        return [(replace(s, lit=share), c) for (s, c), share in zip(parts, lit, strict=True)]

    def paint(self, camera: Camera, *, order: str = "hard", progress: Progress = None) -> NDArray[np.float32]:
        """Paint a frame.

        Parameters
        ----------
        camera : Camera
            A perspective.
        order : {"hard", "slab"}
            Slabs for frames of an animation, where nothing may jump; a single picture is crisper without.
        progress : None, True or callable
            `progress(done, total)`; True shows a tqdm bar.

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear light in [0, 1], ready for `pleinair.tone.to_uint8`.

        Raises
        ------
        ValueError, TypeError
            The camera is not a perspective, or an argument is out of range.

        Examples
        --------
        See `Scene`.
        """
        behind = self.backdrop(camera)
        parts = [s for s, _ in self.strokes(camera)]
        if not parts:
            return behind
        return self._painted(parts, camera, order, progress).over(behind)

    def _painted(self, parts: list[Strokes], camera: Camera, order: str, progress: Progress) -> Canvas:
        style, light = self.style, self.light()
        trunks = self.trunk_circles or self.circles
        shaded = []
        for one in parts:
            circles = trunks if one.material == "bark" else self.circles
            shaded.append(shade(one, style, camera, light, circles=circles, close=self.close).sprites)
        widths = np.concatenate([one.size[:, 0] for one in parts])
        delta = 0.25 * float(np.median(widths)) if order == "slab" and widths.size else None
        size = camera.width, camera.height
        return composite(join(shaded), *size, order=order, delta=delta, progress=progress)

    def backdrop(self, camera: Camera) -> NDArray[np.float32]:
        """Return the sky behind everything, as a display shows it.

        Parameters
        ----------
        camera : Camera
            From where.

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear light in [0, 1]: a relative sky by O'Neil's curve, one in cd/m² by Tumblin and Rushmeier's operator.
            Below the horizon, if there is a ground, the tone of its palette.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> bool(Scene(Aoas(sun=Sun(30, 160))).backdrop(Camera(32, 24)).max() <= 1)
        True
        """
        sky = self.sky.render(camera)
        seen = tone.tumblin_rushmeier(sky) if self.sky.absolute else np.clip(tone.oneil(sky), 0, 1)
        ground = next((o for o in self.objects if isinstance(o, Ground)), None)
        if ground is not None:
            # A painter's toned canvas: where strokes leave gaps it is the ground's own colour that shows.
            color = np.array(self.style.material(ground.material).palette.mid[0], np.float32)
            right, up, forward = camera._axes()
            scale = 2 * math.tan(math.radians(0.5 * camera.fov)) / camera.height
            across = (np.arange(camera.width) + 0.5 - 0.5 * camera.width) * (scale * right[2])
            down = (0.5 * camera.height - np.arange(camera.height) - 0.5) * (scale * up[2])
            seen[forward[2] + across + down[:, None] < 0] = color
        return seen

    def explain(self, camera: Camera) -> dict[str, Any]:
        """Paint a frame and say what was modelled, what it cost, and what was left out.

        Parameters
        ----------
        camera : Camera
            A perspective.

        Returns
        -------
        dict
            "strokes": how many of each object, and how many of them are before the eye; "seconds": of each step;
            "sky": what of it is computed, where it says so; "left out": why something costs nothing.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> report = Scene(Aoas(sun=Sun(30, 160))).explain(Camera(32, 24))
        >>> report["strokes"], report["left out"]
        ([], ['there are no objects: the picture is the sky'])
        """
        begin = time.perf_counter()
        behind = self.backdrop(camera)
        sky = time.perf_counter()
        parts = self.strokes(camera)
        lit = time.perf_counter()
        if parts:
            self._painted([s for s, _ in parts], camera, "hard", None).over(behind)
        end = time.perf_counter()
        forward = camera._axes()[2]
        rows: list[dict[str, Any]] = []
        left = [] if parts else ["there are no objects: the picture is the sky"]
        for strokes, casts in parts:
            before = int(((strokes.position - np.array(camera.position)) @ forward > 0).sum())
            rows.append(
                {"material": strokes.material, "strokes": len(strokes), "before the eye": before, "casts": casts}
            )
            if before < len(strokes):
                left.append(f"{strokes.material}: {len(strokes) - before} strokes behind the eye")
        if parts and not self.cast_shadows:
            left.append("shadows are switched off")
        seconds = {"sky": sky - begin, "strokes and shadows": lit - sky, "painting": end - lit}
        return {"strokes": rows, "seconds": seconds, "sky": getattr(self.sky, "parts", None), "left out": left}

    def animate(self, timeline: Timeline, frames: int, *, progress: Progress = None) -> Iterator[NDArray[np.float32]]:
        """Paint frames one after the other; each depends on its time alone.

        Parameters
        ----------
        timeline : Timeline
            What changes.
        frames : int
            How many, in [1, 1000000] [1].
        progress : None, True or callable
            `progress(done, total)`; True shows a tqdm bar.

        Returns
        -------
        iterator of ndarray (height, width, 3) of float32
            As `paint` returns them, in slabs, where nothing jumps.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> scene = Scene(Aoas(sun=Sun(30, 160)))
        >>> pan = Timeline(lambda t: Camera(32, 24, azimuth=90 * t))
        >>> len(list(scene.animate(pan, 3)))
        3
        """
        instance(timeline, "timeline", Timeline)
        count = integer(frames, "frames", 1, 1_000_000)

        def each() -> Iterator[NDArray[np.float32]]:
            tick, close = reporter(progress, "frames")
            try:
                for k in range(count):
                    yield self.frame(timeline, k / max(count - 1, 1))
                    if tick is not None:
                        tick(k + 1, count)
            finally:
                close()

        return each()

    def frame(self, timeline: Timeline, t: float) -> NDArray[np.float32]:
        """Paint the frame of one time: a pure function of scene, timeline and time.

        Parameters
        ----------
        timeline : Timeline
            What changes.
        t : float
            In [0, 1] [1].

        Returns
        -------
        ndarray (height, width, 3) of float32
            As `paint` returns it, in slabs.

        Raises
        ------
        ValueError, TypeError
            `t` is out of range.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> scene = Scene(Aoas(sun=Sun(30, 160)))
        >>> scene.frame(Timeline(Camera(32, 24)), 0.5).shape
        (24, 32, 3)
        """
        t = real(t, "t", 0, 1)
        changes = {name: at(t) for name in ("sky", "objects", "circles") if (at := getattr(timeline, name)) is not None}
        scene = replace(self, **changes) if changes else self
        camera = timeline.camera if isinstance(timeline.camera, Camera) else timeline.camera(t)
        return scene.paint(camera, order="slab")


@dataclass(frozen=True, eq=False)
class Timeline:
    """What changes over an animation, as functions of a time from 0 to 1.

    Parameters
    ----------
    camera : Camera or callable
        `camera(t)`, or one that stands still.
    sky : callable, optional
        `sky(t)`: moving lights.
    objects : callable, optional
        `objects(t)`: trees that move, surfaces that deform under their strokes (`Particles.on`).
    circles : callable, optional
        `circles(t)`: distances of foreground and background, the rack focus of the thesis.

    Raises
    ------
    TypeError
        Something is not a function.

    Examples
    --------
    >>> Timeline(lambda t: t).sky is None
    True
    """

    camera: Any
    sky: Callable[[float], Sky] | None = None
    objects: Callable[[float], Any] | None = None
    circles: Callable[[float], tuple[float, float]] | None = None

    def __post_init__(self) -> None:
        for name in ("camera", "sky", "objects", "circles"):
            value = getattr(self, name)
            if not (value is None or callable(value) or (name == "camera" and isinstance(value, Camera))):
                msg = f"{name} must be a function of a time from 0 to 1, got {type(value).__name__}"
                raise TypeError(msg)


@functools.lru_cache(maxsize=64)
def _bark(tree: Tree) -> tuple[NDArray[np.float64], ...]:
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


@functools.lru_cache(maxsize=64)
def _law(tree: Tree, style: Style, light: Light) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Solve which leaves of a tree fade first and how the others grow, once for each style and light."""
    leaves = tree.leaves
    crown = Strokes(leaves.position, leaves.normal, leaves.size, leaves.label, center_ratio=leaves.center_ratio,
                    branch_ratio=leaves.branch_ratio, fade=leaves.fade, id=leaves.id)  # fmt: skip
    crown = thin(crown, style, light)
    return crown.fade, growth(crown, style, light)


def _planted(one: Placed, style: Style, light: Light, grown: bool, camera: Camera | None) -> list[Strokes]:
    """Return crown and trunk of a tree where it stands."""
    tree, leaves, foot = one.tree, one.tree.leaves, np.array(one.position)
    middle = foot + one.scale * one._moved(np.array([leaves.center]))[0]
    parts = []
    if len(leaves):
        fade, law = _law(tree, style, light) if grown else (leaves.fade, None)
        parts.append(
            Strokes(
                foot + one.scale * one._moved(leaves.position),
                one._moved(leaves.normal),
                leaves.size * np.float32(one.scale),
                leaves.label,
                center_ratio=leaves.center_ratio,
                branch_ratio=leaves.branch_ratio,
                fade=fade,
                object=np.zeros(len(leaves), np.int64),
                centers=middle[None],
                tint=[tree.id],
                growth=None if law is None else law[None],
            )
        )
    place, normal, along, size = _bark(tree)
    if len(place):
        turned = one._moved(along)
        twist: Any = 0.0
        if camera is not None:
            # Strokes lie along their stems: the angle of the stem in the picture.
            right, up, _ = camera._axes()
            twist = np.degrees(np.arctan2(-(turned @ right), turned @ up))
            twist = (twist + 90) % 180 - 90
        parts.append(
            Strokes(
                foot + one.scale * one._moved(place),
                one._moved(normal),
                size * one.scale,
                material="bark",
                twist=twist,
                object=np.zeros(len(place), np.int64),
                centers=middle[None],
                tint=[tree.id],
            )
        )
    return parts

"""A scene, painted as one picture or as the frames of an animation. Public as `pleinair.Scene`.

Sky, clouds, trees and grounds, composed from far to near.
"""

from __future__ import annotations

import functools
import time
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.docs import documented
from .._support.inputs import Progress, choice, circle, flag, instance, integer, real, several
from ..camera import Camera
from ..clouds import Params, Volume
from ..io import PathLike
from ..paint import (
    AerialPerspective,
    Canvas,
    Light,
    Material,
    Shading,
    Strokes,
    Style,
    composite,
    join,
    shade,
    shadows,
    styles,
)
from ..paint import style as style_by_name
from ..plants import Tree
from ..sky import Sky
from .file import read, write
from .film import Animated
from .frame import Backdrop, combined_visibility
from .objects import Ground, Placed
from .parts import UNDERCOAT, Part, material_of, own_material, parts_of
from .report import stage_pictures, visibility_report
from .sky_strokes import sky_strokes
from .strokes import strokes_of, with_undercoats
from .timeline import Timeline
from .water import any_in_frame, fresnel_reflection, mirrored_canvas

# Slabs are a share of a stroke's own width thick, to both sides [1]. Strokes of a ground are broad and lie close to
# what stands on it, with which they should not mix.
_SLAB, _SLAB_OF_LEAVES = 0.25, 1.0


@dataclass(frozen=True, eq=False)
class Scene(Animated):
    """A sky and what stands under it, to be painted.

    Parameters
    ----------
    sky : Sky
        Behind everything; its Sun and Moon light the scene.
    objects : iterable of Placed, Tree, Ground or Strokes
        What there is. A tree alone stands at the origin.
    style : Style or str
        The manner, or the name of one.
    clouds : Volume, optional
        A cloud between the sky and all else.
    cloud_params : Params, optional
        Its parameters, in the sky's unit of light; by default what this sky and its Sun give a white cloud.
    lights : Light or iterable of Light, optional
        In place of the sky's own.
    circles : tuple of float
        Distances along the view up to which all is foreground, and from which on background [m].
    trunk_circles : tuple of float, optional
        The same for trunks; by default `circles` [m].
    close : tuple of float
        In the extreme foreground, where inner strokes are gone and from where they give way [m].
    cast_shadows : bool
        Whether strokes take light from each other.
    grown : bool
        Whether strokes of trees grow with distance so that silhouettes hold; solved once for each tree and style.
    visibility : float, optional
        Meteorological range, in [1, 1e9] [m]: the air is then that of the sky, in the colours of its horizon, and not
        the style's `atmosphere`.
    materials : mapping of str to Material
        Of single parts, by "name/kind", whatever the style: what `repainted` sets. Names follow the order of the objects.
    sky_strokes : int
        Strokes over the whole sphere in which the sky is painted, in [0, 10000000] [1]; 0 leaves it smooth.

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
    clouds: Volume | None = None
    cloud_params: Params | None = None
    lights: Any = None
    circles: tuple[float, float] = (40.0, 400.0)
    trunk_circles: tuple[float, float] | None = None
    close: tuple[float, float] = (0.0, 0.0)
    cast_shadows: bool = True
    grown: bool = True
    visibility: float | None = None
    materials: Any = ()
    sky_strokes: int = 0

    def __post_init__(self) -> None:
        put = object.__setattr__
        instance(self.sky, "sky", Sky)
        if isinstance(self.style, str):
            put(self, "style", style_by_name(choice(self.style, "style", tuple(styles()))))
        instance(self.style, "style", Style)
        objects = tuple(Placed(o) if isinstance(o, Tree) else o for o in several(self.objects, "objects"))
        for one in objects:
            if not isinstance(one, (Placed, Ground, Strokes)):
                msg = f"objects must be Placed, Tree, Ground or Strokes, got {type(one).__name__}"
                raise TypeError(msg)
            wanted = one.material if isinstance(one, Ground) else (one.material,) if isinstance(one, Strokes) else ()
            for material in wanted:
                choice(material, "material", tuple(name for name, _ in self.style.materials))
        put(self, "objects", objects)
        put(self, "materials", tuple(dict(self.materials).items()))
        for name, material in self.materials:
            instance(material, f"materials[{name!r}]", Material)
        for name, kind in (("clouds", Volume), ("cloud_params", Params)):
            if getattr(self, name) is not None:
                instance(getattr(self, name), name, kind)
        if self.cloud_params is not None and self.clouds is None:
            msg = "cloud_params are of no use without clouds"
            raise ValueError(msg)
        for name in ("circles", "trunk_circles", "close"):
            if getattr(self, name) is not None or name != "trunk_circles":
                put(self, name, circle(getattr(self, name), name))
        if self.lights is not None:
            lights = (self.lights,) if isinstance(self.lights, Light) else several(self.lights, "lights")
            put(self, "lights", tuple(instance(light, "lights", Light) for light in lights))
        flag(self.cast_shadows, "cast_shadows")
        flag(self.grown, "grown")
        if self.visibility is not None:
            put(self, "visibility", real(self.visibility, "visibility", 1, 1e9, "m"))
        put(self, "sky_strokes", integer(self.sky_strokes, "sky_strokes", 0, 10_000_000))

    @functools.cached_property
    def _backdrop(self) -> Backdrop:
        return Backdrop(self.sky, self.clouds, self.cloud_params)

    @functools.cached_property
    def _style(self) -> Style:
        """The style with what single parts are painted in."""
        own = replace(self.style, materials=dict(self.style.materials) | dict(self.materials))
        return with_undercoats(own, self.parts)

    @functools.cached_property
    def _effective_style(self) -> Style:
        """The style, as bright as the display shows white paper under this sky."""
        style = self._style
        if self.visibility is not None:
            style = replace(style, atmosphere=AerialPerspective(strength=0.0, value=(0.0, 1.0)))
        return replace(style, exposure=style.exposure * self._backdrop.exposure)

    @functools.cached_property
    def _full_size_style(self) -> Style:
        """The style of what is whole however near it is; strokes of crowns and grounds keep a painter's size."""
        return replace(self._effective_style, largest=10.0)

    @functools.cached_property
    def parts(self) -> tuple[Part, ...]:
        """What the objects consist of, with names of their own."""
        return parts_of(self.objects, self.style)

    @classmethod
    def load(cls, path: PathLike, *, outside: bool = False) -> Scene:
        """Read the scene of a file; `pleinair.scene.load` also reads its camera and timeline.

        Parameters
        ----------
        path : path
            A .toml or .json file, see `pleinair.scene.schema`.
        outside : bool
            Whether files that it names may lie outside of its folder.

        Raises
        ------
        ValueError
            There is no scene in it, or something is wrong: the message has its place in the file.
        FileNotFoundError
            The file, or one that it names, is not there.

        Examples
        --------
        See `save`.
        """
        found = read(path, cls, outside)
        if "scene" not in found:
            msg = f"{path} holds no scene but {', '.join(found) or 'nothing'}"
            raise ValueError(msg)
        scene: Scene = found["scene"]
        return scene

    def save(self, path: PathLike, *, camera: Camera | None = None, timeline: Timeline | None = None) -> Path:
        """Write the scene to a file that `load` reads, every bit of it.

        Parameters
        ----------
        path : path
            Ends in .toml or .json; arrays go to a file of this name and .npz beside it.
        camera : Camera, optional
            To be kept with it.
        timeline : Timeline, optional
            To be kept with it; of keys and `TimeLapse`, not of functions.

        Raises
        ------
        TypeError
            Something has no place in a file: a function, say.

        Examples
        --------
        >>> import tempfile
        >>> from pleinair.sky import preset
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Scene.load(Scene(preset("coral")).save(f"{folder}/a.toml")).sky == preset("coral")
        True
        """
        return write(path, type(self), {"scene": self, "camera": camera, "timeline": timeline})

    def select(self, name: str = "*", kind: str = "*") -> tuple[Part, ...]:
        """Return parts by name and kind.

        Parameters
        ----------
        name : str
            With * and ? for any characters: "oak*", "oak2".
        kind : str
            "leaves" or "trunk" of trees, a material of a ground or its "undercoat", "strokes"; with * and ? too.

        Returns
        -------
        tuple of Part
            In the order of the objects.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> from pleinair.plants import preset
        >>> shrub = Tree.grow(preset("shrub"), rng=1)
        >>> scene = Scene(Aoas(sun=Sun(30, 160)), [Placed(shrub, (x, 12, 0), name="shrub") for x in (-5, 5)])
        >>> [part.name for part in scene.select("shrub*", "leaves")]
        ['shrub1', 'shrub2']
        """
        instance(name, "name", str)
        instance(kind, "kind", str)
        return tuple(part for part in self.parts if fnmatchcase(part.name, name) and fnmatchcase(part.kind, kind))

    def repainted(self, material: Material, name: str = "*", kind: str = "*") -> Scene:
        """Return the scene with some parts in another material.

        Parameters
        ----------
        material : Material
            Palette and strokes.
        name, kind : str
            Which, as for `select`.

        Returns
        -------
        Scene
            All else is the same.

        Raises
        ------
        ValueError, TypeError
            There is no such part.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> from pleinair.plants import preset
        >>> scene = Scene(Aoas(sun=Sun(30, 160)), [Tree.grow(preset("shrub"), rng=1)], grown=False)
        >>> autumn = scene.repainted(style_by_name("dusk").material("leaves"), kind="leaves")
        >>> [strokes.material for strokes in autumn.strokes().values()]
        ['tree1/leaves', 'bark']
        """
        found = self.select(name, kind)
        if not found:
            msg = f"there is no part of name {name!r} and kind {kind!r}; there are {[(p.name, p.kind) for p in self.parts]}"
            raise ValueError(msg)
        own = dict.fromkeys(map(own_material, found), instance(material, "material", Material))
        return replace(self, materials=dict(self.materials) | own)

    def light(self) -> tuple[Light, ...]:
        """Return what lights the strokes: Sun and Moon as far as a painter shows their colours, or the lights given.

        Returns
        -------
        tuple of Light
            The brightest first. From the zenith, faint, when all have set.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> Scene(Aoas(sun=Sun(30, 180))).light()[0].direction[2] > 0.4
        True
        """
        return self._backdrop.lights if self.lights is None else self.lights

    def strokes(self, camera: Camera | None = None) -> dict[Part, Strokes]:
        """Return the strokes of all parts, each with the light that reaches it.

        Parameters
        ----------
        camera : Camera, optional
            Of a frame: with it strokes are shaded by what the frame shows of the others.

        Returns
        -------
        dict of Part to Strokes
            In the order of the objects.

        Examples
        --------
        >>> from pleinair import Sun
        >>> from pleinair.sky import Aoas
        >>> from pleinair.plants import Tree, preset
        >>> scene = Scene(Aoas(sun=Sun(30, 160)), [Tree.grow(preset("shrub"), rng=1)], grown=False)
        >>> [(part.name, part.kind) for part in scene.strokes()]
        [('tree1', 'leaves'), ('tree1', 'trunk')]
        """
        if camera is not None:
            instance(camera, "camera", Camera)
        found = {part: strokes_of(part, self._style, self.grown, camera) for part in self.parts}
        found = {part: strokes for part, strokes in found.items() if len(strokes)}
        lights = self.light()
        if not (self.cast_shadows and found and lights):
            return found
        lists, casts = list(found.values()), [part.casts for part in found]
        shares = [
            shadows(lists, light.direction, self._style, casts=casts, camera=camera, circles=self.circles)
            for light in lights
        ]
        lit = shares[0]
        if len(lights) > 1:
            lit = [combined_visibility(s, lights, own) for s, *own in zip(lists, *shares, strict=True)]
        # Only what a surface looks like depends on its own strokes: it is lit as if it lay bare.
        return {
            part: strokes if part.kind == UNDERCOAT else replace(strokes, lit=share)
            for (part, strokes), share in zip(found.items(), lit, strict=True)
        }

    @documented
    def paint(
        self, camera: Camera, *, order: str = "hard", method: str = "fast", progress: Progress = None
    ) -> NDArray[np.float32]:
        """Paint a frame.

        Parameters
        ----------
        camera : Camera
            A perspective.
        order : {"hard", "slab"}
            Slabs for frames of an animation, where nothing may jump; a single picture is crisper without.
        method : {"fast", "reference"}
            How strokes are composited: the reference goes pixel by pixel in float64. Skies and clouds have references of
            their own.
        {progress}

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
        choice(order, "order", ("hard", "slab"))
        choice(method, "method", ("fast", "reference"))
        _perspective(camera)
        behind = self.backdrop(camera)
        parts = self.strokes(camera)
        if parts:
            shaded = self._shaded(parts, camera)
            behind = self._canvas(parts, shaded, camera, order, method=method, progress=progress).over(behind)
        # Light of a colour of its own may make a paint brighter than white.
        return np.clip(behind, 0, 1, out=behind)

    def _shaded(self, parts: dict[Part, Strokes], camera: Camera) -> list[Shading]:
        """Return the strokes of all parts as they are painted."""

        def shaded(part: Part, strokes: Strokes, camera: Camera, lights: Any) -> Shading:
            circles = self.trunk_circles if part.kind == "trunk" and self.trunk_circles else self.circles
            style = self._full_size_style if part.kind in ("trunk", UNDERCOAT) else self._effective_style
            one = shade(strokes, style, camera, lights, circles=circles, close=self.close)
            if self.visibility is None:
                return one
            return self._backdrop.aerial_perspective(one, strokes, camera, self.visibility)

        out = []
        mirrors = {
            part for part in parts if isinstance(part.object, Ground) and material_of(part, self._style).reflective
        }
        dry = [(strokes, functools.partial(shaded, part)) for part, strokes in parts.items() if part not in mirrors]
        for part, strokes in parts.items():
            one = shaded(part, strokes, camera, self.light())
            if part in mirrors:
                level = float(strokes.position[:, 2].mean())
                seen = dry and any_in_frame(one.sprites, camera)
                hung = mirrored_canvas(dry, level, camera, self.light()) if seen else None
                one = fresnel_reflection(one, strokes, camera, self._backdrop, hung)
            out.append(one)
        return out

    def _canvas(
        self, parts: dict[Part, Strokes], shaded: list[Shading], camera: Camera, order: str, **more: Any
    ) -> Canvas:
        delta = None
        if order == "slab":
            shares = [_SLAB_OF_LEAVES if part.kind == "leaves" else _SLAB for part in parts]
            widths = [strokes.size[:, 0].astype(np.float64) for strokes in parts.values()]
            delta = np.concatenate([share * width for share, width in zip(shares, widths, strict=True)])
        sprites = join(one.sprites for one in shaded)
        return composite(sprites, camera.width, camera.height, order=order, delta=delta, **more)

    def backdrop(self, camera: Camera) -> NDArray[np.float32]:
        """Return sky and clouds behind everything, as a display shows them.

        Parameters
        ----------
        camera : Camera
            From where.

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear light in [0, 1]: a relative sky by O'Neil's curve, one in cd/m² by Tumblin and Rushmeier's operator,
            adapted to the whole sky. Below the horizon, if there is a ground, a plain of the broadest one's tone, in air.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> bool(Scene(Aoas(sun=Sun(30, 160))).backdrop(Camera(32, 24)).max() <= 1)
        True
        """
        _perspective(camera)
        seen = self._backdrop.picture(camera)
        if self.sky_strokes:
            seen = sky_strokes(seen, camera, self.sky_strokes).over(seen)
        grounds = [(p, p.object.particles) for p in self.parts if p.kind == UNDERCOAT and isinstance(p.object, Ground)]
        if grounds:
            # Beyond the broadest ground its tone continues to the horizon, where it is the horizon's.
            part, p = max(grounds, key=lambda pair: float(np.ptp(pair[1].position[:, :2], axis=0).prod()))
            tone = np.array(self._style.material(own_material(part)).palette.mid[0]) * self._backdrop.exposure
            level = float(np.median(p.position[:, 2]))
            self._backdrop.ground_plane(seen, camera, tone, level, self.visibility or 4 * self.circles[1])
        return seen

    def stages(self, camera: Camera) -> dict[str, NDArray[np.float32]]:
        """Return what the shader did, stage by stage, as pictures: each pixel shows its most visible stroke.

        Parameters
        ----------
        camera : Camera
            A perspective.

        Returns
        -------
        dict of str to ndarray (height, width) of float32
            "lightness", "placed", "shadow", "final", "palette" and "distance" of `pleinair.paint.Shading`, NaN where
            there is no stroke; "mask", what the strokes hide of the sky [1]; "depth", infinite where there are none [m].

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> mine = Strokes([[0, 12, 1]], (0, -1, 0), (4, 4))
        >>> stages = Scene(Aoas(sun=Sun(30, 180)), [mine]).stages(Camera(64, 48, elevation=5))
        >>> stages["distance"].shape, bool(stages["mask"].max() > 0)
        ((48, 64), True)
        """
        _perspective(camera)
        parts = self.strokes(camera)
        shaded = self._shaded(parts, camera)
        canvas = self._canvas(parts, shaded, camera, "hard", seen=True) if parts else None
        return stage_pictures(shaded, canvas, (camera.height, camera.width))

    def explain(self, camera: Camera) -> dict[str, Any]:
        """Paint a frame and say what was modelled, what it cost, and what was left out.

        Parameters
        ----------
        camera : Camera
            A perspective.

        Returns
        -------
        dict
            "strokes": how many of each part, and how many of them are before the eye; "seconds": of each step;
            "sky": what of it is computed, where it says so; "left out": why something costs nothing.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> report = Scene(Aoas(sun=Sun(30, 160))).explain(Camera(32, 24))
        >>> report["strokes"], report["left out"]
        ([], ['there are no objects: the picture is the sky'])
        """
        _perspective(camera)
        begin = time.perf_counter()
        behind = self.backdrop(camera)
        sky = time.perf_counter()
        parts = self.strokes(camera)
        lit = time.perf_counter()
        if parts:
            self._canvas(parts, self._shaded(parts, camera), camera, "hard").over(behind)
        end = time.perf_counter()
        rows, left = visibility_report(parts, camera)
        if parts and not self.cast_shadows:
            left.append("shadows are switched off")
        if self.clouds is not None:
            if not self._backdrop.box_in_frustum(camera):
                left.append("the cloud is out of view")
            left.append("the cloud casts no shadow on the ground")
        dark = len(self.sky._lights()) - len(self._backdrop.light_sources)
        if dark and self.lights is None:
            left.append(f"{dark} of Sun and Moon: set, or too faint beside the other")
        seconds = {"sky": sky - begin, "strokes and shadows": lit - sky, "painting": end - lit}
        return {"strokes": rows, "seconds": seconds, "sky": getattr(self.sky, "parts", None), "left out": left}


def _perspective(camera: Camera) -> None:
    if instance(camera, "camera", Camera).projection != "perspective":
        msg = f"camera must be a perspective, got {camera!r}"
        raise ValueError(msg)

"""A scene, painted as one picture or as the frames of an animation. Public as `pleinair.Scene`.

Sky, clouds, trees and grounds, composed from far to near.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._support.docs import documented
from .._support.inputs import FieldsOnly, Progress, choice, circle, flag, instance, integer, real, several
from ..camera import Camera
from ..clouds import Params, Volume
from ..io import PathLike
from ..paint import AerialPerspective, Light, Material, Strokes, Style, styles
from ..paint import style as style_by_name
from ..plants import Tree
from ..sky import Sky
from .clouds import Cloud
from .file import read, write
from .film import Animated
from .frame import Backdrop, Environment, check_unit
from .objects import Ground, Placed
from .painting import (
    behind,
    box_of,
    canvas_of,
    clouded,
    explained,
    layers_of,
    lit_strokes,
    plain_of,
    radiance_of,
    shaded_parts,
    sky_share,
    visible_strokes,
)
from .parts import Part, own_material, parts_of
from .report import Layer, layer, stage_pictures
from .strokes import with_undercoats
from .timeline import Timeline
from .weather import UnderWeather, sky_under, weather_of

_GROUND = 0.18  # Reflectance of one that nobody painted [1].


@dataclass(frozen=True, eq=False)
class Scene(FieldsOnly, Animated, UnderWeather):
    """A sky and what stands under it, to be painted.

    Parameters
    ----------
    sky : Sky
        Behind everything; its Sun and Moon light the scene.
    objects : iterable of Placed, Tree, Ground or Strokes
        What there is. A tree alone stands at the origin.
    style : Style or str
        The manner, or the name of one.
    clouds : Volume, Cloud or iterable of them, optional
        They stand in the sky's light, cast shadows, are mirrored in water and are before or behind strokes by their distance.
    cloud_params : Params, optional
        Of plain volumes, in the sky's unit of light; by default what this sky and its Sun give a white cloud.
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
        Meteorological range, in [1, 1e9] [m], instead of that of the sky's own air; the style's `atmosphere` is then
        left out.
    materials : mapping of str to Material
        Of single parts, by "name/kind", whatever the style: what `repainted` sets. Names follow the order of the objects.
    sky_strokes : int
        Strokes over the whole sphere in which the sky is painted, in [0, 10000000] [1]; 0 leaves it smooth.
    adaptation : float, optional
        What the eye is adapted to, in [1e-8, 1e10]; by default that of the whole sky, `Sky.adaptation` [cd/m²].
    time : float
        How long clouds have drifted, and rain and snow have fallen, in [-1e9, 1e9] [s].
    weather : Fog, Overcast, Rain, Rainbow, Snow or iterable of them
        Of `pleinair.weather`.

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
    clouds: Any = None
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
    adaptation: float | None = None
    time: float = 0.0
    weather: Any = ()
    # Set in frames of a film whose sky changes.
    _moving_sun: ClassVar[bool] = False

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
        if self.clouds is not None and not isinstance(self.clouds, Volume):
            put(self, "clouds", (self.clouds,) if isinstance(self.clouds, Cloud) else several(self.clouds, "clouds"))
        if wrong := [type(one).__name__ for one in self._clouds if not isinstance(one, (Volume, Cloud))]:
            msg = f"clouds must be Volume or Cloud, got {wrong[0]}"
            raise TypeError(msg)
        put(self, "time", real(self.time, "time", -1e9, 1e9, "s"))
        put(self, "weather", weather_of(self.weather, self.sky))
        if self.cloud_params is not None:
            instance(self.cloud_params, "cloud_params", Params)
            if not self.sky.absolute:
                check_unit(self.sky, self.cloud_params)
            if self.clouds is None:
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
        for name, least, most, unit in (("visibility", 1, 1e9, "m"), ("adaptation", 1e-8, 1e10, "cd/m²")):
            if getattr(self, name) is not None:
                put(self, name, real(getattr(self, name), name, least, most, unit))
        put(self, "sky_strokes", integer(self.sky_strokes, "sky_strokes", 0, 10_000_000))

    _behind = behind
    _radiance = radiance_of
    _shaded = shaded_parts
    _canvas = staticmethod(canvas_of)

    @property
    def eye(self) -> float:
        """What the eye is adapted to: what is given, or what the sky asks for [unit of the sky]."""
        return self._backdrop.adaptation if self.adaptation is None else self.adaptation

    @functools.cached_property
    def _backdrop(self) -> Backdrop:
        each = ((Cloud(o), self.cloud_params) if isinstance(o, Volume) else (o, None) for o in self._clouds)
        more = tuple(self._ground.tolist()), self.weather, self._plain is not None
        return Backdrop(sky_under(self.sky, self.weather), tuple(each), self.time, self._moving_sun, *more)

    @functools.cached_property
    def _ground(self) -> NDArray[np.float64]:
        """Reflectance of the land, linear RGB."""
        return np.full(3, getattr(self.sky, "ground_albedo", _GROUND)) if self._plain is None else self._plain[0]

    @property
    def _clouds(self) -> tuple[Any, ...]:
        return (self.clouds,) if isinstance(self.clouds, Volume) else tuple(self.clouds or ())

    @functools.cached_property
    def _style(self) -> Style:
        """The style with what single parts are painted in."""
        own = replace(self.style, materials=dict(self.style.materials) | dict(self.materials))
        return with_undercoats(own, self.parts)

    @functools.cached_property
    def _effective_style(self) -> Style:
        """The style as reflectances: its exposure comes last, colours of light are those of the lamps."""
        style = self._style
        if self.visibility is not None:
            style = replace(style, atmosphere=AerialPerspective(strength=0.0, value=(0.0, 1.0)))
        return replace(style, exposure=1.0, light_tint=0.0)

    _box = functools.cached_property(box_of)
    _clouded = functools.cached_property(clouded)

    @functools.cached_property
    def _plain(self) -> tuple[NDArray[np.float64], float] | None:
        """Reflectance and level [m] of the broadest ground."""
        return plain_of(self)

    @functools.cached_property
    def _environment(self) -> Environment:
        return self._backdrop.environment(self.lights, self._ground)

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
        return lit_strokes(self, camera)

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
        mirrors = self._style.grade.mirrors
        return self._shown(*self._radiance(camera, order, method, progress, mirrors), camera)

    def _shown(self, rgb: NDArray[np.float32], sky: NDArray[np.float32], camera: Camera) -> NDArray[np.float32]:
        grade = self._style.grade
        with layer("eye"):
            light = grade.values(rgb, sky)
            return grade.colors(self._backdrop.shown(light, camera, self._style.exposure, self.adaptation))

    @documented
    def radiance(
        self, camera: Camera, *, order: str = "hard", method: str = "fast", progress: Progress = None
    ) -> NDArray[np.float32]:
        """Return what a camera measures: the frame before grade and tone reproduction.

        Palettes are reflectances, lit by Sun and Moon past what stands in their way, by the whole sky and by the ground,
        behind the sky's own air.

        Parameters
        ----------
        camera : Camera
            A perspective.
        order, method : str
            As for `paint`.
        {progress}

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear Rec. 709 [unit of the sky].

        Raises
        ------
        ValueError, TypeError
            The camera is not a perspective, or an argument is out of range.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Natural
        >>> bool(Scene(Natural(sun=Sun(30, 160))).radiance(Camera(32, 24, elevation=20)).mean() > 1000)
        True
        """
        choice(order, "order", ("hard", "slab"))
        choice(method, "method", ("fast", "reference"))
        _perspective(camera)
        return self._radiance(camera, order, method, progress)[0]

    def backdrop(self, camera: Camera) -> NDArray[np.float32]:
        """Return sky and clouds behind everything, as a display shows them.

        Parameters
        ----------
        camera : Camera
            From where.

        Returns
        -------
        ndarray (height, width, 3) of float32
            Linear light in [0, 1]: a relative sky by O'Neil's curve, one in cd/m² by `pleinair.tone.present`, adapted to
            the whole sky. Below the horizon, if there is a ground, a plain of the broadest one's tone, in air.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> bool(Scene(Aoas(sun=Sun(30, 160))).backdrop(Camera(32, 24)).max() <= 1)
        True
        """
        _perspective(camera)
        return self._shown(self._behind(camera), sky_share(self, camera), camera)

    def layers(self, camera: Camera) -> dict[str, Layer]:
        """Return a frame in layers, the farthest first: each over those before it is `radiance`.

        Parameters
        ----------
        camera : Camera
            A perspective.

        Returns
        -------
        dict of str to Layer
            "sky"; "clouds", if there are any and the sky is not painted in strokes, which are of its clouds too; "plain",
            the level ground beyond the broadest one, if there is a ground; "strokes", with what clouds hide of them, if there
            are any. `pleinair.io.write_layers` writes them to one .exr.

        Raises
        ------
        ValueError, TypeError
            The camera is not a perspective.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Natural
        >>> mine = Strokes([[0, 12, 1]], (0, -1, 0), (4, 4))
        >>> layers = Scene(Natural(sun=Sun(30, 180)), [mine]).layers(Camera(64, 48, elevation=5))
        >>> list(layers), layers["strokes"].radiance.shape
        (['sky', 'strokes'], (48, 64, 3))
        """
        _perspective(camera)
        return layers_of(self, camera)

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
        parts = visible_strokes(self, camera)
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
            "strokes": how many of each part, and how many of them are before the eye; "layers": for each whether it was
            computed, kept from another frame or skipped, why, its milliseconds and its largest relative error [1]; "seconds":
            of each step; "sky": what of it is computed, where it says so; "left out": why something costs nothing.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> from pleinair.sky import Aoas
        >>> report = Scene(Aoas(sun=Sun(30, 160))).explain(Camera(32, 24))
        >>> report["strokes"], report["left out"]
        ([], ['there are no objects: the picture is the sky'])
        """
        _perspective(camera)
        return explained(self, camera)


def _perspective(camera: Camera) -> None:
    if instance(camera, "camera", Camera).projection != "perspective":
        msg = f"camera must be a perspective, got {camera!r}"
        raise ValueError(msg)

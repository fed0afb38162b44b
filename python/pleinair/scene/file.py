"""Scenes in files: TOML or JSON for people and programs, arrays in an .npz beside it; what kinds of objects they hold."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from .._support.documents import Kind, Reader, Writer, json_schema, of_dataclass, parse, unknown, within
from .._support.inputs import instance
from ..astro import Moon, Place, Sun
from ..camera import Camera
from ..clouds import Params, Volume, procedural
from ..clouds import load as load_volume
from ..io import PathLike, read_arrays, replacing, write_arrays
from ..paint import AerialPerspective, Grade, Light, Material, Palette, StrokeParams, Strokes, Style, style, styles
from ..plants import Strata, Surface, Tree, TreeParams, preset
from ..sky import Aoas, CieGeneral, CloudPoints, CloudSlab, CloudSpline, Natural, Physical, Preetham, Sky
from ..sky import preset as sky_preset
from ..weather import Fog, Overcast, Rain, Rainbow, Snow
from .clouds import Cloud
from .objects import Ground, Placed
from .timeline import TimeLapse, Timeline

FORMAT = 1
_SKIES = {"aoas": Aoas, "natural": Natural, "physical": Physical, "preetham": Preetham, "cie_general": CieGeneral}
_KIND = "scene arrays"


@dataclass(frozen=True)
class _Keys:
    """Values by their times, as a file has them."""

    times: tuple[float, ...]
    values: tuple[Any, ...]


@lru_cache(maxsize=1)
def _plain_kinds(scene: Any) -> dict[str, Kind]:
    array = np.ndarray | float
    point = tuple[float, float, float]
    kinds = {
        "sun": of_dataclass(Sun),
        "moon": of_dataclass(Moon),
        "place": of_dataclass(Place),
        "camera": of_dataclass(Camera),
        "cloud_slab": of_dataclass(CloudSlab),
        "cloud_points": of_dataclass(CloudPoints, points=tuple[point, ...]),
        "cloud_spline": of_dataclass(CloudSpline, points=tuple[point, ...]),
        "params": of_dataclass(Params),
        "fog": of_dataclass(Fog),
        "overcast": of_dataclass(Overcast),
        "rain": of_dataclass(Rain),
        "rainbow": of_dataclass(Rainbow),
        "snow": of_dataclass(Snow),
        "strata": of_dataclass(Strata),
        "palette": of_dataclass(Palette),
        "stroke_params": of_dataclass(StrokeParams),
        "material": of_dataclass(Material),
        "aerial_perspective": of_dataclass(AerialPerspective),
        "grade": of_dataclass(Grade),
        "light": of_dataclass(Light),
        "strokes": of_dataclass(
            Strokes,
            **dict.fromkeys(
                ("position", "normal", "size", "label", "fade", "object", "centers", "growth", "id"), np.ndarray
            ),
            **dict.fromkeys(("center_ratio", "branch_ratio", "twist", "lit", "tint"), array),
        ),
        "placed": of_dataclass(Placed),
        "cloud": of_dataclass(Cloud),
        "ground": of_dataclass(Ground, material=tuple[str, ...] | str, rng=int),
        "time_lapse": of_dataclass(TimeLapse),
        "keys": of_dataclass(_Keys),
        "tree_params": of_dataclass(TreeParams),
        "timeline": _timeline(),
        "scene": of_dataclass(
            scene,
            objects=tuple[Placed | Tree | Ground | Strokes, ...],
            clouds=Volume | tuple[Volume | Cloud, ...],
            style=Style | str,
            lights=tuple[Light, ...],
            materials=dict[str, Material],
            weather=tuple[Fog | Overcast | Rain | Rainbow | Snow, ...],
        ),
    }
    for hidden in ("trunk", "branches", "leaves"):
        hint = kinds["tree_params"].fields[hidden]
        for cls in (
            a
            for a in (*getattr(hint, "__args__", ()), hint)
            if isinstance(a, type) and hasattr(a, "__dataclass_fields__")
        ):
            kinds.setdefault(f"tree_{hidden}", of_dataclass(cls))
    more = {"aoas": {"shapes": tuple[CloudPoints | CloudSpline, ...], "rng": int}}
    for name, cls in _SKIES.items():
        kinds[name] = of_dataclass(cls, **more.get(name, {}))
    return kinds


def _timeline() -> Kind:
    usual = of_dataclass(Timeline)

    def keys(value: Any) -> Any:
        found = getattr(value, "keys", None)
        return _Keys(tuple(found), tuple(found.values())) if isinstance(found, Mapping) else value

    def take(value: Timeline) -> dict[str, Any]:
        out = {name: keys(got) for name, got in usual.take(value).items()}
        camera = out["camera"]
        return out | {"camera": camera.values[0] if isinstance(camera, _Keys) and camera.times == (0.0,) else camera}

    def make(**given: Any) -> Timeline:
        named: dict[str, Any] = {
            n: dict(zip(v.times, v.values, strict=True)) if isinstance(v, _Keys) else v for n, v in given.items()
        }
        return Timeline(**named)

    fields = {"camera": Camera | _Keys, "sky": TimeLapse, "circles": _Keys, "trunk_circles": _Keys, "adaptation": _Keys}
    return Kind(Timeline, fields, ("camera",), take, make)


def _kinds(scene: Any, folder: Path | None = None, outside: bool = False) -> dict[str, Kind]:
    kinds = dict(_plain_kinds(scene))
    aoas = kinds["aoas"]
    kinds["aoas"] = replace(aoas, fields=aoas.fields | {"preset": str}, make=_named(sky_preset, Aoas))
    painted = of_dataclass(Style, materials=dict[str, Material], tints=tuple[Any, ...])
    whole = kinds["scene"]

    def parts(value: Any) -> dict[str, Any]:
        # Pairs in the object, a table in the file.
        taken = dict(whole.take(value))
        return taken | ({"materials": dict(taken["materials"])} if "materials" in taken else {})

    kinds["scene"] = replace(whole, take=parts)
    kinds["style"] = Kind(Style, painted.fields | {"preset": str}, (), _style_fields, _named(_style, Style))

    def grow(**given: Any) -> Volume:
        if "file" in given:
            own = given.pop("file")
            _alone(given, "file")
            return load_volume(own if folder is None else within(folder, own, "file", outside))
        if "procedural" in given:
            return procedural(given.pop("procedural"), **given)
        return Volume(**given)

    volume: dict[str, Any] = {"file": str, "procedural": str, "shape": tuple[int, int, int], "rng": int}
    volume |= {
        "density": np.ndarray,
        "voxel_size": tuple[float, float, float] | float,
        "origin": tuple[float, float, float],
    }
    kinds["volume"] = Kind(
        Volume, volume, (), lambda v: {n: getattr(v, n) for n in ("density", "voxel_size", "origin")}, grow
    )
    tree = {"preset": str, "params": TreeParams, "seeds": tuple[int, int, int], "rng": int}
    kinds["tree"] = Kind(Tree, tree, (), _tree_fields, _tree)
    surface = {
        "kind": str,
        "z": np.ndarray,
        "spacing": tuple[float, float] | float,
        "origin": tuple[float, float, float],
    }
    surface |= dict.fromkeys(("vertices", "faces", "points", "weights"), np.ndarray)
    surface["knots"] = cast("Any", tuple[tuple[float, ...], ...])
    surface["degree"] = cast("Any", tuple[int, int] | int)
    kinds["surface"] = Kind(Surface, surface, ("kind",), lambda s: {"kind": s.kind} | s.arguments(), _surface)
    return kinds


def _alone(given: Mapping[str, Any], name: str) -> None:
    if given:
        msg = f"{', '.join(given)} cannot stand beside {name}"
        raise ValueError(msg)


def _named(by_name: Any, usual: Any) -> Any:
    def make(**given: Any) -> Any:
        return by_name(given.pop("preset"), **given) if "preset" in given else usual(**given)

    return make


def _style(name: str, **changes: Any) -> Style:
    return replace(style(name), **changes)


def _style_fields(value: Style) -> dict[str, Any]:
    plain = replace(value, grade=Grade())
    for name in styles():
        if style(name) == plain:
            return {"preset": name} | ({} if value == plain else {"grade": value.grade})
    fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    return fields | {"materials": dict(value.materials)}


def _tree_fields(value: Tree) -> dict[str, Any]:
    if value.given is not None:
        msg = "a tree of stems from elsewhere cannot be written: a file has no place for them"
        raise TypeError(msg)
    try:
        known = preset(value.params.name) == value.params
    except ValueError:
        known = False
    return ({"preset": value.params.name} if known else {"params": value.params}) | {"seeds": value.seeds}


def _tree(**given: Any) -> Tree:
    params = preset(given.pop("preset")) if "preset" in given else given.pop("params", None)
    if "seeds" in given:
        seeds = given.pop("seeds")
        _alone(given, "seeds")
        return Tree(TreeParams() if params is None else params, seeds)
    return Tree.grow(params, **given)


def _surface(kind: str, **given: Any) -> Surface:
    makers: dict[str, Any] = {"heightfield": Surface.heightfield, "mesh": Surface.mesh, "nurbs": Surface.nurbs}
    if kind not in makers:
        msg = f"kind must be one of {', '.join(makers)}, got {kind!r}"
        raise ValueError(msg)
    made: Surface = makers[kind](**given)
    return made


def document(scene: Any) -> dict[str, Any]:
    """Return what a file may hold."""
    return {
        "scene": scene,
        "camera": Camera,
        "timeline": Timeline,
        "sky": Sky,
        "style": Style,
        "tree": Tree,
        "volume": Volume,
        "params": Params,
    }


def schema_of(scene: Any) -> dict[str, Any]:
    """Return the JSON Schema of files."""
    return json_schema(_kinds(scene), document(scene), "A scene of pleinair", FORMAT)


def read(path: PathLike, scene: Any, outside: bool) -> dict[str, Any]:
    """Return what a file holds."""
    path = Path(path)
    data, name, folder = parse(path, outside=outside), path.name, path.parent
    form = data.pop("format", None)
    if type(form) is not int or form < 1:
        msg = f"{name} must say its format: format = {FORMAT}"
        raise ValueError(msg)
    if form > FORMAT:
        msg = f"{name} is of format {form}: this pleinair reads up to {FORMAT}"
        raise ValueError(msg)
    reader = Reader(_kinds(scene, folder, outside), folder, outside, lru_cache(partial(read_arrays, kind=_KIND)))
    out, known = {}, document(scene)
    for key, value in data.items():
        if key not in known:
            raise ValueError(unknown(name, key, tuple(known)))
        try:
            found = style(value) if key == "style" and isinstance(value, str) else reader.object(value, known[key], key)
        except (ValueError, TypeError) as error:
            msg = f"{name}: {error}"
            raise ValueError(msg) from None
        if not isinstance(found, known[key]):
            msg = f"{name}: {key} must be a table, got {value!r}"
            raise ValueError(msg)  # noqa: TRY004 -- the text is wrong, not its type
        out[key] = found
    return out


def write(path: PathLike, scene: Any, objects: Mapping[str, Any]) -> Path:
    """Write what `read` reads."""
    path, known = Path(path), document(scene)
    writer = Writer(_kinds(scene), f"{path.name}.npz")
    data: dict[str, Any] = {"format": FORMAT}
    for name, value in objects.items():
        if name not in known:
            raise TypeError(unknown("a scene's file", name, tuple(known)))
        if value is not None:
            data[name] = writer.plain(instance(value, name, known[name]), known[name], name)
    if path.suffix.lower() == ".toml":
        try:
            import tomli_w
        except ImportError:
            msg = "writing .toml needs tomli-w: pip install 'pleinair[io]'; .json needs nothing"
            raise ImportError(msg) from None
        text = tomli_w.dumps(data)
    elif path.suffix.lower() == ".json":
        text = json.dumps(data, indent=1) + "\n"
    else:
        msg = f"path must end in .toml or .json, got {path.name!r}"
        raise ValueError(msg)
    if writer.arrays:
        write_arrays(path.with_name(f"{path.name}.npz"), _KIND, writer.arrays)
    return replacing(path, lambda stream: stream.write(text.encode()))

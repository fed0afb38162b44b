"""Objects in files of TOML and JSON: by the names of their fields, what is not said has its default, errors say where.

A table is a dataclass. Where a field takes several kinds, its `type` says which. Arrays lie in an .npz beside the file.
"""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from .schema import nearest

# Of a file: a scene is some kB, its arrays lie beside it.
_LARGEST = 16 << 20
_DEEPEST = 32
# Arrays up to this many elements are written as lists.
_SMALL = 64


@dataclasses.dataclass(frozen=True)
class Kind:
    """A kind of object that documents hold.

    `fields` names what is written and its type; `take` and `make` go from an object to them and back, for what is no
    dataclass or has another constructor.
    """

    cls: type
    fields: dict[str, Any]
    required: tuple[str, ...]
    take: Callable[[Any], Mapping[str, Any]]
    make: Callable[..., Any]


def of_dataclass(cls: Any, **types_: Any) -> Kind:
    """Return the kind of a dataclass; `types_` say more of fields than their annotations do."""
    hints = typing.get_type_hints(cls)
    fields = {f.name: types_.get(f.name, hints[f.name]) for f in dataclasses.fields(cls) if f.init}
    nothing = (dataclasses.MISSING, dataclasses.MISSING)
    required = tuple(f.name for f in dataclasses.fields(cls) if f.init and (f.default, f.default_factory) == nothing)

    def take(value: Any) -> dict[str, Any]:
        out = {}
        for f in dataclasses.fields(cls):
            got = getattr(value, f.name)
            default = f.default_factory() if f.default_factory is not dataclasses.MISSING else f.default
            if f.init and (f.name in required or not _same(got, default)):
                out[f.name] = got
        return out

    return Kind(cls, fields, required, take, cls)


def _same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    try:
        return type(a) is type(b) and bool(a == b)
    except ValueError:
        return False


class Writer:
    """From objects to plain data."""

    def __init__(self, kinds: Mapping[str, Kind], arrays: str) -> None:
        self.kinds, self.file = kinds, arrays
        self.names = {kind.cls: name for name, kind in kinds.items()}
        self.arrays: dict[str, Any] = {}

    def plain(self, value: Any, hint: Any, path: str) -> Any:
        """Return the plain data of a value."""
        if isinstance(value, np.ndarray):
            return self._array(value, path)
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        if isinstance(value, np.generic):
            return value.item()
        if isinstance(value, datetime):
            return value.isoformat()
        name = self.names.get(type(value))
        if name is not None:
            kind = self.kinds[name]
            out = {} if type(value) in _classes(hint) and len(_classes(hint)) == 1 else {"type": name}
            for key, inner in kind.take(value).items():
                # TOML has no null.
                out[key] = "none" if inner is None else self.plain(inner, kind.fields[key], f"{path}.{key}")
            return out
        if isinstance(value, Mapping):
            return {str(k): self.plain(v, _item(hint), f"{path}.{k}") for k, v in value.items()}
        if isinstance(value, (list, tuple)):
            return [self.plain(v, _item(hint), f"{path}[{i}]") for i, v in enumerate(value)]
        msg = f"{path} cannot be written: a file has no place for {_name(type(value))}"
        raise TypeError(msg)

    def _array(self, value: Any, path: str) -> Any:
        if 0 < value.size <= _SMALL:
            return value.tolist()
        name = path.replace("[", "_").replace("]", "").replace(".", "_")
        self.arrays[name] = value
        return {"file": self.file, "array": name}


class Reader:
    """From plain data to objects."""

    def __init__(self, kinds: Mapping[str, Kind], folder: Path, outside: bool, load: Callable[[Path], Any]) -> None:
        self.kinds, self.folder, self.outside, self.load = kinds, folder, outside, load
        self.names = {kind.cls: name for name, kind in kinds.items()}

    def object(self, data: Any, hint: Any, path: str) -> Any:
        """Return the object of plain data."""
        if isinstance(data, Mapping):
            if set(data) == {"file", "array"}:
                return self._array(data, path)
            return self._table(data, hint, path)
        if isinstance(data, list):
            classes = _classes(hint)
            if np.ndarray in classes:
                return np.asarray(data)
            return tuple(self.object(v, _item(hint), f"{path}[{i}]") for i, v in enumerate(data))
        if data == "none" and type(None) in _classes(hint):
            return None
        if isinstance(data, str) and datetime in _classes(hint):
            try:
                return datetime.fromisoformat(data)
            except ValueError:
                msg = f"{path} must be a time of ISO 8601, such as 2024-08-05T22:30+02:00, got {data!r}"
                raise ValueError(msg) from None
        return data

    def _table(self, data: Mapping[str, Any], hint: Any, path: str) -> Any:
        wanted = [cls for cls in self.names if any(issubclass(cls, c) for c in _classes(hint) if c is not object)]
        if "type" in data:
            name = data["type"]
            if name not in self.kinds:
                raise ValueError(unknown(f"{path}.type", name, tuple(self.kinds)))
            kind = self.kinds[name]
            if wanted and kind.cls not in wanted:
                msg = f"{path} must be of type {' or '.join(self.names[c] for c in wanted)}, got {name!r}"
                raise ValueError(msg)
        elif len(wanted) == 1 or (wanted and _classes(hint)[0] in self.names):
            # Of several kinds the one that is named first needs no type.
            kind = self.kinds[self.names[wanted[0] if len(wanted) == 1 else _classes(hint)[0]]]
        elif dict in _classes(hint):
            return {k: self.object(v, _item(hint), f"{path}.{k}") for k, v in data.items()}
        else:
            allowed = ", ".join(self.names[c] for c in wanted) or ", ".join(self.kinds)
            msg = f"{path} must say its type: {allowed}"
            raise ValueError(msg)
        given = {}
        for key, value in data.items():
            if key == "type":
                continue
            if key not in kind.fields:
                raise ValueError(unknown(path, key, tuple(kind.fields)))
            given[key] = self.object(value, kind.fields[key], f"{path}.{key}")
        missing = [key for key in kind.required if key not in given]
        if missing:
            msg = f"{path} must have {', '.join(missing)}"
            raise ValueError(msg)
        try:
            return kind.make(**given)
        except (ValueError, TypeError, OverflowError) as error:
            text = str(error)
            field = next((key for key in given if text.startswith(key)), None)
            where = path if field is None else f"{path}.{field}"
            msg = f"{where}: {text}"
            raise ValueError(msg) from None

    def _array(self, data: Mapping[str, Any], path: str) -> Any:
        arrays = self.load(within(self.folder, data["file"], f"{path}.file", self.outside))
        if data["array"] not in arrays:
            raise ValueError(unknown(f"{path}.array", data["array"], tuple(arrays)))
        return arrays[data["array"]]


def within(folder: Path, name: Any, path: str, outside: bool) -> Path:
    """Return a path that a file names, from its folder, and inside of it unless that is allowed."""
    if not isinstance(name, str):
        msg = f"{path} must be a path, got {name!r}"
        raise ValueError(msg)  # noqa: TRY004 -- the text is wrong, not its type
    found = (folder / name).resolve()
    if not outside and not found.is_relative_to(folder.resolve()):
        msg = f"{path} must stay in the file's folder, got {name!r}; outside=True allows others"
        raise ValueError(msg)
    return found


def parse(path: Path, *, outside: bool = False, above: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Return the data of a TOML or JSON file, with what it includes: tables under tables, its own before the others'."""
    path = path.resolve()
    if path in above or len(above) > _DEEPEST:
        msg = f"{path} includes itself: {' → '.join(p.name for p in (*above, path))}"
        raise ValueError(msg)
    if not path.is_file():
        msg = f"there is no file {path}"
        raise FileNotFoundError(msg)
    if path.stat().st_size > _LARGEST:
        msg = f"{path} has {path.stat().st_size} bytes; a scene's file has at most {_LARGEST}: arrays lie beside it"
        raise ValueError(msg)
    data = text_data(path.read_text(encoding="utf-8"), path.suffix.lower(), str(path))
    base: dict[str, Any] = {}
    included = data.pop("include", [])
    for name in [included] if isinstance(included, str) else included:
        other = parse(within(path.parent, name, "include", outside), outside=outside, above=(*above, path))
        base = _merged(base, other)
    return _merged(base, data)


def text_data(text: str, ending: str, what: str) -> dict[str, Any]:
    """Return the table that a text of TOML or JSON holds."""
    if ending not in (".toml", ".json"):
        msg = f"{what} must end in .toml or .json"
        raise ValueError(msg)
    try:
        if ending == ".json":
            data = json.loads(text)
        else:
            import tomllib

            data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        msg = f"{what} is no {ending[1:].upper()}: {error}"
        raise ValueError(msg) from None
    if not isinstance(data, dict):
        msg = f"{what} must hold a table, got {type(data).__name__}"
        raise ValueError(msg)  # noqa: TRY004 -- the text is wrong, not its type
    return data


def _merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    out = dict(base)
    for key, value in over.items():
        both = isinstance(value, dict) and isinstance(out.get(key), dict)
        out[key] = _merged(out[key], value) if both else value
    return out


def unknown(path: str, name: Any, known: tuple[str, ...]) -> str:
    """Return the sentence for a name that is not known, with the nearest that is."""
    near = nearest(str(name), known)
    hint = f"there are {', '.join(known)}" if near is None else f"did you mean {near!r}?"
    return f"{path} has no {name!r}: {hint}"


def _classes(hint: Any) -> tuple[Any, ...]:
    """Return the classes that a type is made of: those of a union, or itself."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return tuple(c for arg in typing.get_args(hint) for c in _classes(arg))
    origin = typing.get_origin(hint)
    if origin is not None:
        return (origin,) if isinstance(origin, type) else ()
    return (hint,) if isinstance(hint, type) else ()


def _item(hint: Any) -> Any:
    """Return the type of the items of a tuple, list or mapping."""
    for part in typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,):
        arguments = [a for a in typing.get_args(part) if a is not Ellipsis]
        if arguments:
            return arguments[-1]
    return Any


def _name(cls: type) -> str:
    return "a function" if cls is types.FunctionType else f"a {cls.__name__}"


_JSON = {
    bool: "boolean",
    int: "integer",
    float: "number",
    str: "string",
    tuple: "array",
    list: "array",
}


def json_schema(kinds: Mapping[str, Kind], document: Mapping[str, Any], title: str, form: int) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of documents that hold these kinds."""
    names = {kind.cls: name for name, kind in kinds.items()}

    def of(hint: Any) -> dict[str, Any]:
        arguments = typing.get_args(hint)
        if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
            return {"anyOf": [of(a) for a in arguments]}
        known = [
            name
            for cls, name in names.items()
            if isinstance(hint, type) and issubclass(cls, hint) and hint is not object
        ]
        if hint in names and len(known) == 1:
            return {"$ref": f"#/$defs/{names[hint]}"}
        if known:
            return {"anyOf": [{"allOf": [{"$ref": f"#/$defs/{n}"}, {"required": ["type"]}]} for n in known]}
        origin = typing.get_origin(hint)
        if origin in (tuple, list):
            items = [a for a in arguments if a is not Ellipsis]
            if origin is tuple and Ellipsis not in arguments and items:
                return {
                    "type": "array",
                    "prefixItems": [of(a) for a in items],
                    "minItems": len(items),
                    "maxItems": len(items),
                }
            return {"type": "array", "items": of(items[0]) if items else {}}
        if origin is dict:
            return {"type": "object", "additionalProperties": of(arguments[1])}
        if hint is datetime:
            return {"type": "string", "format": "date-time"}
        if hint is np.ndarray or origin is np.ndarray:
            return {"anyOf": [{"type": "array"}, {"$ref": "#/$defs/array file"}]}
        if hint is type(None):
            return {"enum": ["none", None]}
        return {"type": _JSON[hint]} if hint in _JSON else {}

    definitions: dict[str, Any] = {
        "array file": {
            "type": "object",
            "properties": {"file": {"type": "string"}, "array": {"type": "string"}},
            "required": ["file", "array"],
            "additionalProperties": False,
        }
    }
    for name, kind in kinds.items():
        about = (kind.cls.__doc__ or name).strip().partition("\n")[0]
        definitions[name] = {
            "title": about,
            "type": "object",
            "properties": {"type": {"const": name}} | {key: of(hint) for key, hint in kind.fields.items()},
            "required": list(kind.required),
            "additionalProperties": False,
        }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "type": "object",
        "properties": {
            "format": {"type": "integer", "maximum": form, "minimum": 1},
            "include": {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]},
        }
        | {key: of(hint) for key, hint in document.items()},
        "required": ["format"],
        "additionalProperties": False,
        "$defs": definitions,
    }

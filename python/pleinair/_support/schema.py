"""The one way to and from JSON: objects by the names of their fields, every bit of every number."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable
from typing import Any, ClassVar, Self

from .inputs import instance


def json_object(text: Any, what: str) -> dict[str, Any]:
    """Return the object that a text of JSON holds."""
    instance(text, "text", str)
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:  # an integer of 4300 digits, brackets nested too deep
        msg = f"text must be JSON of {what}: {error}"
        raise ValueError(msg) from None
    if not isinstance(data, dict):
        msg = f"text must be JSON of {what}: it holds no object but {type(data).__name__}"
        raise ValueError(msg)  # noqa: TRY004 -- the text is wrong, not its type
    return data


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the name that somebody who wrote another may have meant."""
    from difflib import get_close_matches

    return next(iter(get_close_matches(name, list(known), 1)), None)


def build(cls: Any, data: Any) -> Any:
    """Return an object of a dataclass from a mapping of its fields; `cls.NESTED` says which hold dataclasses."""
    if not isinstance(data, dict):
        msg = f"a {cls.__name__} must be an object with its fields, got {type(data).__name__}"
        raise ValueError(msg)  # noqa: TRY004 -- the text is wrong, not its type
    fields = dataclasses.fields(cls)
    names = [f.name for f in fields if f.init]
    for name in data:
        if name not in names:
            near = nearest(name, names)
            hint = f"; there are {', '.join(names)}" if near is None else f": did you mean {near!r}?"
            msg = f"a {cls.__name__} has no field {name!r}{hint}"
            raise ValueError(msg)
    without = (dataclasses.MISSING, dataclasses.MISSING)
    missing = [f.name for f in fields if (f.default, f.default_factory) == without and f.name not in data]
    if missing:
        msg = f"a {cls.__name__} must have {', '.join(missing)}"
        raise ValueError(msg)
    nested = getattr(cls, "NESTED", {})
    values = {}
    for name, value in data.items():
        kind = nested.get(name)
        if kind is None:
            values[name] = tuple(value) if isinstance(value, list) else value
        elif isinstance(value, list):
            values[name] = tuple(build(kind, one) for one in value)
        else:
            values[name] = build(kind, value)
    return cls(**values)


class JsonFields:
    """A frozen dataclass that is written as JSON and read back: pleinair's parameters are."""

    # Dataclasses that fields hold, one or a sequence of them.
    NESTED: ClassVar[dict[str, Any]] = {}

    def _data(self) -> dict[str, Any]:
        data: dict[str, Any] = dataclasses.asdict(self)  # type: ignore[call-overload]
        return data

    def to_json(self) -> str:
        """Return the parameters as JSON; `from_json` gives back every bit.

        Examples
        --------
        >>> from pleinair.clouds import Params
        >>> Params.from_json(Params(g=0.7).to_json()) == Params(g=0.7)
        True
        """
        return json.dumps(self._data())

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return parameters from what `to_json` gave.

        Parameters
        ----------
        text : str
            A JSON object with the names of the parameters; those that are missing take their defaults.

        Raises
        ------
        ValueError, TypeError
            The text is not JSON, or a parameter is unknown or out of range.

        Examples
        --------
        >>> from pleinair.plants import Strata
        >>> Strata.from_json('{"count": 3}').count
        3
        """
        data = json_object(text, f"a {cls.__name__}")
        try:
            out: Self = build(cls, data)
        except (ValueError, TypeError, OverflowError) as error:
            msg = f"text must be JSON of a {cls.__name__}: {error}"
            raise ValueError(msg) from None
        return out

"""The one way to and from JSON: objects by the names of their fields, every bit of every number."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

from .inputs import instance


def build(cls: Any, data: Any) -> Any:
    """Return an object of a dataclass from a mapping of its fields."""
    fields = dataclasses.fields(cls)
    names = {f.name for f in fields}
    if not isinstance(data, dict) or not set(data) <= names:
        extra = sorted(set(data) - names) if isinstance(data, dict) else type(data).__name__
        msg = f"text must hold an object with fields of {cls.__name__}, got {extra}"
        raise ValueError(msg)
    without = (dataclasses.MISSING, dataclasses.MISSING)
    missing = [f.name for f in fields if (f.default, f.default_factory) == without and f.name not in data]
    if missing:
        msg = f"text must hold {', '.join(missing)} of a {cls.__name__}"
        raise ValueError(msg)
    return cls(**data)


def json_object(text: Any, what: str) -> dict[str, Any]:
    """Return the object that a text of JSON holds."""
    instance(text, "text", str)
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        msg = f"text must be JSON of {what}: {error}"
        raise ValueError(msg) from None
    if not isinstance(data, dict):
        msg = f"text must be JSON of {what}: it holds no object but {type(data).__name__}"
        raise ValueError(msg)  # noqa: TRY004 -- the text is wrong, not its type
    return data

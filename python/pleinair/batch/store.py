"""Results on disk, one small file a cell, written beside its place and renamed: what is there is whole, and is not done again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._support.fingerprint import fingerprint
from .._support.process import version
from ..io import PathLike, read_arrays, replacing, write_arrays

_MANIFEST = "grid.json"
_FORMAT = 1


class Store:
    """A folder that holds a grid's results by the number of their cell."""

    def __init__(self, folder: PathLike, task: str, cells: Sequence[Any], seed: int | None) -> None:
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.width = max(4, len(str(len(cells))))
        about = {"kind": "grid", "format": _FORMAT, "task": task, "cells": fingerprint(list(cells)), "seed": seed}
        path = self.folder / _MANIFEST
        if path.exists():
            self._same(path, about)
        else:
            about["pleinair"] = version()
            replacing(path, lambda stream: stream.write(json.dumps(about).encode()))

    def _same(self, path: Path, about: dict[str, Any]) -> None:
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
            other = [name for name in about if found.get(name) != about[name]]
        except (ValueError, AttributeError) as error:
            msg = f"store must be an empty folder or one of this grid: {path} is damaged: {error}"
            raise ValueError(msg) from None
        if other:
            words = ", ".join(f"{name} {found.get(name)!r} instead of {about[name]!r}" for name in other)
            msg = f"store must be an empty folder or one of this grid: {self.folder} is of another, with {words}"
            raise ValueError(msg)

    def _path(self, index: int, ending: str) -> Path:
        return self.folder / f"{index:0{self.width}d}{ending}"

    def has(self, index: int) -> bool:
        """Return whether a cell's result is there."""
        return any(self._path(index, ending).exists() for ending in (".json", ".npz"))

    def put(self, index: int, value: Any) -> None:
        """Write the result of a cell: JSON data, an array, or a dict of arrays."""
        if isinstance(value, np.ndarray):
            value = {"": value}
        if isinstance(value, dict) and value and all(isinstance(v, np.ndarray) for v in value.values()):
            arrays = {f"a{name}": v for name, v in value.items()}
            write_arrays(self._path(index, ".npz"), "cell", arrays)
            return
        try:
            text = json.dumps(value)
        except (TypeError, ValueError):
            msg = (
                "a store holds JSON data, arrays and dicts of arrays: the function must return such "
                f"(x.to_dict(), say), got {type(value).__name__}"
            )
            raise TypeError(msg) from None
        replacing(self._path(index, ".json"), lambda stream: stream.write(text.encode()))

    def get(self, index: int) -> Any:
        """Return the result of a cell."""
        path = self._path(index, ".json")
        if path.exists():
            return json.loads(path.read_text(encoding="utf-8"))
        arrays = {name[1:]: v for name, v in read_arrays(self._path(index, ".npz"), "cell").items() if name[0] == "a"}
        return arrays[""] if list(arrays) == [""] else arrays

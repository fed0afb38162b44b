"""What an object is, as a digest: equal for equal arguments in every process."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np


def fingerprint(value: Any) -> str:
    """Return a digest of what a value holds, in 16 hexadecimal digits."""
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()[:16]


def _feed(digest: Any, value: Any) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif value is None or isinstance(value, (str, bytes, int, float, complex, np.generic, PurePath)):
        digest.update(f"{type(value).__name__} {value!s};".encode())
    elif isinstance(value, Mapping):
        digest.update(f"mapping {len(value)};".encode())
        for name in value:
            _feed(digest, name)
            _feed(digest, value[name])
    elif isinstance(value, (list, tuple)):
        digest.update(f"{type(value).__name__} {len(value)};".encode())
        for item in value:
            _feed(digest, item)
    elif isinstance(value, type) or hasattr(value, "__code__"):
        digest.update(f"{value.__module__}.{value.__qualname__};".encode())
        code = getattr(value, "__code__", None)
        if code is not None:  # functions of one name may differ
            digest.update(code.co_code)
            _feed(digest, tuple(c for c in code.co_consts if not hasattr(c, "co_code")))
            _feed(digest, tuple(cell.cell_contents for cell in value.__closure__ or ()))
    elif hasattr(value, "__dataclass_fields__"):
        _feed(digest, type(value))
        for name in value.__dataclass_fields__:
            _feed(digest, getattr(value, name))
    else:
        try:
            _feed(digest, value.__reduce_ex__(4)[:3])
        except TypeError:  # it cannot be pickled: all that is known is its kind
            _feed(digest, type(value))

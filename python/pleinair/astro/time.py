"""Time: aware datetimes as seconds since 1970 UTC, and the years in which positions are measured."""

from __future__ import annotations

import warnings
from datetime import UTC, datetime
from typing import Any

import numpy as np

from .._support.inputs import DomainWarning

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_YEARS = (1900, 2100)
_MEASURED = (1950, 2050)


def seconds_of(when: Any, stacklevel: int | None = 3) -> float:
    """Return seconds since 1970 UTC of an aware datetime; a warning is of this frame, None for no warning."""
    remedy = "use datetime(..., tzinfo=datetime.UTC) or a zoneinfo.ZoneInfo"
    if isinstance(when, np.datetime64):
        msg = f"when must be an aware datetime: numpy.datetime64 has no time zone; {remedy}"
        raise ValueError(msg)  # noqa: TRY004 -- the same refusal as of a naive datetime
    if not isinstance(when, datetime):
        msg = f"when must be an aware datetime, got {type(when).__name__}"
        raise TypeError(msg)
    if when.utcoffset() is None:
        msg = f"when must be an aware datetime: without a time zone {when} may be any of 26 hours; {remedy}"
        raise ValueError(msg)
    since = when - _EPOCH
    year = 1970 + since.total_seconds() / (365.2425 * 86400)
    # Years that are not close to an end need no calendar.
    if year < _YEARS[0] + 1 or year > _MEASURED[1]:
        first, last = (datetime(y, 1, 1, tzinfo=UTC) - _EPOCH for y in (_YEARS[0], _YEARS[1] + 1))
        if not first <= since < last:
            msg = f"when must be in the years [{_YEARS[0]}, {_YEARS[1]}] UTC, got {when}"
            raise ValueError(msg)
    measured = datetime(_MEASURED[0], 1, 1, tzinfo=UTC) <= when < datetime(_MEASURED[1] + 1, 1, 1, tzinfo=UTC)
    if stacklevel is not None and not measured:
        msg = f"positions are measured from {_MEASURED[0]} to {_MEASURED[1]} only; {when} may be off by arcminutes"
        warnings.warn(msg, DomainWarning, stacklevel=stacklevel)
    return since.total_seconds()

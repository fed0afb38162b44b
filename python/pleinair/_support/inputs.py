"""array_like in, contiguous arrays out, with the argument's name in every error."""

from __future__ import annotations

import math
import operator
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[Any]
Progress = bool | Callable[[int, int], object] | None


class DomainWarning(UserWarning):
    """A model is used outside the range its paper supports."""

    __module__ = "pleinair"


def shape_text(shape: tuple[int, ...]) -> str:
    """Return a shape as people write it."""
    return "(" + ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "") + ")"


def array(
    value: ArrayLike,
    name: str,
    *,
    dtypes: tuple[type, ...] = (np.float32, np.float64),
    ndim: int | None = None,
    last: int | None = None,
) -> Array:
    """Return `value` as a C-contiguous array of one of `dtypes` in native byte order.

    A dtype already in `dtypes` is kept; anything else real becomes the last of them if that loses nothing that
    matters here (integers and half floats to float64), and complex, text and objects are refused by name.
    """
    # Where numpy.ma has not been loaded there are no masked arrays, and loading it takes 5 ms.
    if (ma := sys.modules.get("numpy.ma")) is not None and isinstance(value, ma.MaskedArray) and ma.is_masked(value):
        msg = f"{name} must not be a masked array: pass mask= where it is offered, or fill it"
        raise TypeError(msg)
    try:
        out = np.asarray(value)
    except (TypeError, ValueError) as error:
        msg = f"{name} must be array_like, got {type(value).__name__} ({error})"
        raise TypeError(msg) from None
    native = out.dtype.newbyteorder("=")
    if native.type not in dtypes:
        if native.kind not in "buif":
            msg = f"{name} must hold real numbers, got dtype {out.dtype}"
            raise TypeError(msg)
        if dtypes[-1] not in (np.float32, np.float64):
            allowed = ", ".join(np.dtype(d).name for d in dtypes)
            msg = f"{name} must have dtype {allowed}, got {out.dtype}"
            raise TypeError(msg)
        native = np.dtype(dtypes[-1])
    if ndim is not None and out.ndim != ndim:
        msg = f"{name} must have {ndim} dimensions, got shape {shape_text(out.shape)}"
        raise ValueError(msg)
    if last is not None and (out.ndim == 0 or out.shape[-1] != last):
        msg = f"{name} must have shape (..., {last}), got {shape_text(out.shape)}"
        raise ValueError(msg)
    return np.require(out, dtype=native, requirements=["C", "A"])


class FieldsOnly:
    """A dataclass that is pickled as its fields, without what it has worked out and keeps."""

    def __getstate__(self) -> dict[str, Any]:
        from dataclasses import fields

        return {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]


class Aligned:
    """A dataclass whose arrays are aligned after unpickling, wherever the pickle put them.

    Arrays of a pickle with out-of-band buffers lie where the transport left them, at any address; the core wants them aligned.
    """

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            if isinstance(value, np.ndarray) and not value.flags.aligned:
                state[name] = np.require(value, requirements=["C", "A"])
        self.__dict__.update(state)


def boolean_mask(value: ArrayLike, name: str, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return `value` as a C-contiguous boolean array of exactly `shape`."""
    out = np.asarray(value)
    if out.dtype != np.bool_:
        if out.dtype.kind not in "ui":
            msg = f"{name} must be boolean (or integer, where nonzero is true), got dtype {out.dtype}"
            raise TypeError(msg)
        out = out != 0
    if out.shape != shape:
        msg = f"{name} must have shape {shape_text(shape)}, got {shape_text(out.shape)}"
        raise ValueError(msg)
    return np.ascontiguousarray(out)


def real(value: Any, name: str, low: float, high: float, unit: str = "1") -> float:
    """Return a finite number in `[low, high]`."""
    span = "finite" if math.isinf(high) else f"in [{low:g}, {high:g}]"
    try:
        if isinstance(value, (str, bytes, bool, np.bool_)):
            raise TypeError
        out = float(value)
    except (TypeError, ValueError):
        msg = f"{name} must be a number, {span} [{unit}], got {value!r}"
        raise TypeError(msg) from None
    except OverflowError:
        msg = f"{name} must be {span} [{unit}], got a number that no float holds"
        raise ValueError(msg) from None
    if not low <= out <= high or math.isinf(out):
        msg = f"{name} must be {span} [{unit}], got {out:g}"
        raise ValueError(msg)
    return out


def integer(value: Any, name: str, low: int, high: int) -> int:
    """Return an integer in `[low, high]`."""
    try:
        out = operator.index(value)
    except TypeError:
        msg = f"{name} must be an integer in [{low}, {high}], got {value!r}"
        raise TypeError(msg) from None
    if isinstance(value, (bool, np.bool_)):
        msg = f"{name} must be an integer in [{low}, {high}], got {value!r}"
        raise TypeError(msg)
    if not low <= out <= high:
        msg = f"{name} must be in [{low}, {high}], got {out}"
        raise ValueError(msg)
    return out


def choice(value: Any, name: str, allowed: tuple[str, ...]) -> str:
    """Return `value` if it is one of `allowed`."""
    if not isinstance(value, str) or value not in allowed:
        msg = f"{name} must be one of {', '.join(map(repr, allowed))}, got {value!r}"
        raise ValueError(msg)
    return str(value)


def vector(value: ArrayLike, name: str, low: float = -math.inf, high: float = math.inf) -> tuple[float, float, float]:
    """Return three finite numbers in `[low, high]`."""
    out = array(value, name, dtypes=(np.float64,))
    if out.shape != (3,):
        msg = f"{name} must have shape (3,), got {shape_text(out.shape)}"
        raise ValueError(msg)
    if not np.isfinite(out).all() or (out < low).any() or (out > high).any():
        msg = f"{name} must hold finite numbers in [{low:g}, {high:g}], got {out.tolist()}"
        raise ValueError(msg)
    return float(out[0]), float(out[1]), float(out[2])


def units(value: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return vectors of any length but zero as unit vectors, shape (..., 3)."""
    out = array(value, name, dtypes=(np.float64,), last=3)
    # Scaled first: squares of huge and tiny numbers leave the range of numbers.
    largest = np.abs(out).max(axis=-1, keepdims=True, initial=0.0)
    if not np.isfinite(largest).all() or (largest == 0).any():
        msg = f"{name} must be finite vectors, none of them zero"
        raise ValueError(msg)
    out = out / largest
    return np.ascontiguousarray(out / np.linalg.norm(out, axis=-1, keepdims=True))


def flag(value: Any, name: str) -> bool:
    """Return a truth value."""
    if not isinstance(value, (bool, np.bool_)):
        msg = f"{name} must be True or False, got {value!r}"
        raise TypeError(msg)
    return bool(value)


def several(value: Any, name: str) -> tuple[Any, ...]:
    """Return the elements of an iterable."""
    try:
        return tuple(value)
    except TypeError:
        msg = f"{name} must be an iterable, got {type(value).__name__}"
        raise TypeError(msg) from None


def instance(value: Any, name: str, kind: type) -> Any:
    """Return `value` if it is an instance of `kind`."""
    if not isinstance(value, kind):
        msg = f"{name} must be a {kind.__name__}, got {type(value).__name__}"
        raise TypeError(msg)
    return value


def linear_light(value: ArrayLike, name: str, **shape: Any) -> Array:
    """Return a picture of linear light as floats; integers are refused, because they are levels of some encoding."""
    kind = getattr(value, "dtype", np.asarray(value).dtype).kind
    if kind in "iu":
        msg = f"{name} must hold linear light as floats (uint8 photographs: pleinair.io.read), got integers"
        raise TypeError(msg)
    return array(value, name, **shape)


def color_values(value: ArrayLike, name: str, meaning: str, last: int | None = None) -> Array:
    """Return numbers of a colour space as floats.

    `meaning` is "encoded" (8- and 16-bit levels are divided by their white, as scikit-image does), "light" (levels are
    refused: they are of some encoding) or "coordinates" (XYZ, xyY, Lab: whole numbers are numbers).
    """
    try:
        raw = np.asarray(value)
    except (TypeError, ValueError):
        return array(value, name, last=last)  # which says what is wrong with it
    if raw.dtype.kind in "iu" and raw.size:
        levels = raw.dtype.kind == "u" and raw.dtype.itemsize <= 2
        if levels and meaning == "encoded":
            return array(raw / float(np.iinfo(raw.dtype).max), name, last=last)
        if levels or (meaning != "coordinates" and (raw.max() > 1 or raw.min() < -1)):
            remedy = "pleinair.color.srgb_decode" if meaning == "light" else "divide by their white"
            msg = f"{name} must hold floats: {raw.dtype} up to {raw.max()} are levels of some encoding ({remedy})"
            raise TypeError(msg)
    return array(value, name, last=last)


def generator(rng: Any) -> np.random.Generator:
    """Return the generator of one `rng` argument (SPEC 7)."""
    try:
        if isinstance(rng, (bool, np.bool_)):
            raise TypeError("a truth value")
        return np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        msg = f"rng must be None, an int, a SeedSequence, a BitGenerator or a Generator, got {rng!r} ({error})"
        raise TypeError(msg) from None


def key(rng: Any) -> int:
    """Draw the 64-bit key of the core's counter-based streams from one `rng` argument (SPEC 7)."""
    return int(generator(rng).integers(0, 2**64, dtype=np.uint64))


def reporter(progress: Any, what: str) -> tuple[Callable[[int, int], object] | None, Callable[[], None]]:
    """Return `(callback, close)` for a `progress` argument: None, True (a tqdm bar) or a callable `(done, total)`."""
    if progress is None or progress is False:
        return None, lambda: None
    if progress is not True:
        if not callable(progress):
            msg = f"progress must be None, True or a callable (done, total), got {progress!r}"
            raise TypeError(msg)
        return progress, lambda: None
    try:
        from tqdm.auto import tqdm
    except ImportError:
        msg = "progress=True needs tqdm: pip install tqdm, or pass a callable (done, total)"
        raise ImportError(msg) from None
    bar = tqdm(desc=what, leave=False)

    def update(done: int, total: int) -> None:
        bar.total = total
        bar.update(done - bar.n)

    return update, bar.close


def bar_where_it_is(wanted: bool) -> bool | None:
    """Return the `progress` of a command: a bar where one is wanted and tqdm is installed."""
    from importlib.util import find_spec

    return True if wanted and find_spec("tqdm") is not None else None


def circle(value: Any, name: str) -> tuple[float, float]:
    """Return two distances [m]; infinity is allowed."""
    two = several(value, name)
    if len(two) != 2:
        msg = f"{name} must hold two distances, got {len(two)}"
        raise ValueError(msg)
    low, high = (1e300 if x == math.inf else real(x, f"{name}[{i}]", 0, 1e300, "m") for i, x in enumerate(two))
    if high < low:
        msg = f"{name} must rise, got {(low, high)}"
        raise ValueError(msg)
    return low, high


def pair(value: Any, name: str, low: float, high: float) -> tuple[float, float]:
    """Return two numbers in `[low, high]`."""
    two = several(value, name)
    if len(two) != 2:
        msg = f"{name} must hold two numbers, got {len(two)}"
        raise ValueError(msg)
    return real(two[0], f"{name}[0]", low, high), real(two[1], f"{name}[1]", low, high)


def check(params: Any, limits: Mapping[str, tuple[float, float] | tuple[float, float, str]]) -> None:
    """Put numbers of a frozen dataclass within their limits (least, greatest, unit), or refuse them by name."""
    for name, limit in limits.items():
        object.__setattr__(params, name, real(getattr(params, name), name, *limit))

"""Key-frame interpolation of rendering parameters (inverse_clouds, Figs. 13 and 15). Public as `pleinair.clouds.keyframes`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._support.inputs import array, choice, instance, real
from .._support.keys import between
from .params import Params

_NUMBERS = ("light_intensity", "g", "albedo", "ambient")
_COLORS = ("light_color", "haze")
# Both are scales of an exponential.
_SCALES = ("sigma_t", "haze_height")


@dataclass(frozen=True)
class Keyframes:
    """Parameters as a function of time. Make one with `keyframes`.

    Attributes
    ----------
    times : tuple of float
        Ascending times of the keys.
    params : tuple of Params
        The parameters at those times.
    scales : str
        How `sigma_t` and `haze_height` go from key to key: "geometric" or "linear".
    """

    times: tuple[float, ...]
    params: tuple[Params, ...]
    scales: str = "geometric"

    def at(self, time: float) -> Params:
        """Return the parameters at a time; before the first and after the last key they stand still.

        Parameters
        ----------
        time : float
            In the unit of the keys, any unit, finite [1].

        Returns
        -------
        Params
            Exactly those of a key at its time.

        Raises
        ------
        ValueError, TypeError
            `time` is not a finite number.

        Examples
        --------
        >>> keyframes((0, 10), (Params(g=0.2), Params(g=0.6))).at(5).g
        0.4
        """
        time = real(time, "time", -math.inf, math.inf)
        before, after, since, span = between(self.times, time)
        a, b = self.params[before], self.params[after]
        f = since / span
        if f == 0 or a == b:
            return a
        values: dict[str, Any] = {n: _linear(getattr(a, n), getattr(b, n), f) for n in _NUMBERS}
        for name in _SCALES:
            mix = _geometric if self.scales == "geometric" else _linear
            values[name] = mix(getattr(a, name), getattr(b, name), f)
        for name in _COLORS:
            values[name] = _color(getattr(a, name), getattr(b, name), f)
        if a.ambient_color is not None or b.ambient_color is not None:
            values["ambient_color"] = _color(a.ambient_color or a.light_color, b.ambient_color or b.light_color, f)
        return Params(**values)

    def __call__(self, time: float) -> Params:
        """Return the parameters at a time, as `at` does."""
        return self.at(time)


def _linear(a: float, b: float, f: float) -> float:
    return a + f * (b - a)


def _geometric(a: float, b: float, f: float) -> float:
    return a if a == b else a * (b / a) ** f


def _color(a: tuple[float, ...], b: tuple[float, ...], f: float) -> tuple[float, ...]:
    return tuple(_linear(x, y, f) for x, y in zip(a, b, strict=True))


def keyframes(times: ArrayLike, params: Iterable[Params], *, scales: str = "geometric") -> Keyframes:
    """Interpolate parameters, such as those of fits to several photographs, for an animation (section 5.2).

    Parameters
    ----------
    times : array_like (n,)
        Ascending times of the keys, in any unit.
    params : iterable of Params
        The parameters at those times.
    scales : {"geometric", "linear"}
        How `sigma_t` and `haze_height` go from key to key; "linear" is the paper's, for everything. Linearly, a cloud
        that thickens does nearly all of it in the first frames, because light falls off exponentially with σ_t.

    Returns
    -------
    Keyframes
        Call it, or its `at`, with a time. All other parameters, colours among them, are interpolated linearly.

    Raises
    ------
    ValueError, TypeError
        Times do not ascend, their number is not that of the parameters, or there is none; σ_t is 0 and
        `scales="geometric"`.

    Examples
    --------
    >>> film = keyframes((0, 1), (Params(sigma_t=0.01), Params(sigma_t=0.04, light_color=(1, 0.5, 0))))
    >>> round(film(0.5).sigma_t, 6), film(0.5).light_color
    (0.02, (1.0, 0.75, 0.5))
    """
    at = array(times, "times", dtypes=(np.float64,), ndim=1)
    keys = tuple(instance(p, "params", Params) for p in params)
    if at.size == 0 or not np.isfinite(at).all() or (np.diff(at) <= 0).any():
        msg = f"times must be finite and ascend, got {at.tolist()}"
        raise ValueError(msg)
    if len(keys) != at.size:
        msg = f"params must hold one for each of the {at.size} times, got {len(keys)}"
        raise ValueError(msg)
    choice(scales, "scales", ("geometric", "linear"))
    if scales == "geometric" and any(p.sigma_t == 0 for p in keys) and len({p.sigma_t for p in keys}) > 1:
        msg = "params must have sigma_t above 0 [1/m] with scales='geometric', got 0; use scales='linear'"
        raise ValueError(msg)
    return Keyframes(tuple(at.tolist()), keys, scales)

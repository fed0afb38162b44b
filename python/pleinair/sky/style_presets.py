"""Named styles of AOAS skies, interpolation between styles, contact sheets. Public as `pleinair.sky`."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import choice, instance, integer, real, several
from .._support.schema import json_object
from ..astro import Sun
from ..camera import Camera
from ..tone import oneil
from .aoas import RAYLEIGH, Aoas, CloudPoints, CloudSpline


def _on_dome(azimuth: float, elevation: float, outline: Iterable[tuple[float, float]]) -> list[tuple[float, ...]]:
    """Return points of a drawing, in radians right and up of a place, on the dome."""
    forward = np.array(Sun(elevation, azimuth).direction)
    right = np.array([math.cos(math.radians(azimuth)), -math.sin(math.radians(azimuth)), 0])
    up = np.cross(right, forward)
    return [tuple((forward + x * right + y * up).tolist()) for x, y in outline]


def _smiley(azimuth: float, elevation: float, size: float) -> tuple[Any, ...]:
    """Return a face: an outline, a mouth, two eyes."""
    turn = np.linspace(0, 2 * np.pi, 13)[:-1]
    outline = _on_dome(azimuth, elevation, zip(size * np.cos(turn), size * np.sin(turn), strict=True))
    smile = np.radians(np.linspace(205, 335, 7))
    mouth = _on_dome(azimuth, elevation, zip(0.6 * size * np.cos(smile), 0.6 * size * np.sin(smile), strict=True))
    eyes = _on_dome(azimuth, elevation, [(-0.35 * size, 0.3 * size), (0.35 * size, 0.3 * size)])
    return (
        CloudSpline(outline, radius=0.22 * size, closed=True),
        CloudSpline(mouth, radius=0.2 * size),
        CloudPoints(eyes, radius=0.25 * size),
    )


def _heart(azimuth: float, elevation: float, size: float) -> tuple[Any, ...]:
    """Return a heart: a curve with a cusp above and below, so two splines."""
    t = np.linspace(0, np.pi, 9)
    x = size * np.sin(t) ** 3
    y = size / 16 * (13 * np.cos(t) - 5 * np.cos(2 * t) - 2 * np.cos(3 * t) - np.cos(4 * t))
    return tuple(
        CloudSpline(_on_dome(azimuth, elevation, zip(side * x, y, strict=True)), radius=0.3 * size) for side in (1, -1)
    )


# Fig. 1, 11, 12 and 13 of the paper, and some of our own. The Sun stands in the south, as do the drawn clouds.
@functools.cache
def _presets() -> dict[str, dict[str, Any]]:
    return {
        "clear": {"sun": Sun(40, 215)},
        "grey": {"sun": Sun(40, 215), "rayleigh": (0.0096, 0.01, 0.0108), "mie": 0.0004, "sun_intensity": 45.0},
        "yellow": {"sun": Sun(40, 215), "rayleigh": (0.02, 0.0145, 0.003), "mie": 0.0003, "sun_intensity": 50.0},
        "blue": {"sun": Sun(50, 215), "rayleigh": (0.003, 0.0085, 0.026), "mie": 0.0002, "sun_intensity": 45.0},
        "coral": {"sun": Sun(35, 215), "rayleigh": (0.022, 0.0085, 0.0065), "mie": 0.0003, "sun_intensity": 55.0},
        "sunrise": {
            "sun": Sun(3, 180),
            "rayleigh": (0.018, 0.038, 0.08),
            "mie": 0.006,
            "g": 0.85,
            "mie_scale_height": 0.08,
            "sun_intensity": 18.0,
        },
        "noon": {"sun": Sun(75, 180), "cloud_complexity": 3.0, "sun_intensity": 26.0, "rng": 4},
        "sunset": {
            "sun": Sun(0.7, 180),
            "rayleigh": (0.02, 0.05, 0.1),
            "mie": 0.01,
            "g": 0.78,
            "mie_scale_height": 0.08,
            "sun_intensity": 20.0,
            "disc": 0.8,
        },
        "dusk": {
            "sun": Sun(-3, 180),
            "rayleigh": (0.022, 0.05, 0.1),
            "mie": 0.008,
            "g": 0.75,
            "mie_scale_height": 0.1,
            "sun_intensity": 45.0,
        },
        "crystal": {
            "sun": Sun(60, 215),
            "rayleigh": (0.002, 0.008, 0.0165),
            "mie": 0.0002,
            "sun_intensity": 45.0,
            "cloud_complexity": 5.0,
            "rng": 2,
        },
        "dystopia": {
            "sun": Sun(14, 185),
            "rayleigh": (0.03, 0.011, 0.0015),
            "mie": 0.0012,
            "g": 0.95,
            "sun_intensity": 34.0,
            "cloud_complexity": 4.0,
            "rng": 11,
        },
        "turbulent": {
            "sun": Sun(45, 215),
            "rayleigh": (0.02, 0.0135, 0.003),
            "mie": 0.0002,
            "sun_intensity": 34.0,
            "ambiguity": 0.12,
            "grain": 1 / 400,
            "cloud_complexity": 2.5,
            "rng": 3,
        },
        "pointillist": {
            "sun": Sun(25, 200),
            "rayleigh": (0.008, 0.013, 0.03),
            "mie": 0.0004,
            "sun_intensity": 32.0,
            "ambiguity": 0.3,
            "grain": 1 / 110,
            "rng": 5,
        },
        "smiley": {"sun": Sun(50, 215), "shapes": _smiley(180, 22, 0.22)},
        "heart": {
            "sun": Sun(45, 215),
            "rayleigh": (0.021, 0.0085, 0.0105),
            "mie": 0.0003,
            "sun_intensity": 55.0,
            "shapes": _heart(180, 22, 0.22),
        },
        "emerald": {"sun": Sun(30, 215), "rayleigh": (0.004, 0.017, 0.0105), "mie": 0.0003, "sun_intensity": 50.0},
        "violet": {
            "sun": Sun(16, 205),
            "rayleigh": (0.012, 0.006, 0.02),
            "mie": 0.0004,
            "sun_intensity": 34.0,
            "cloud_complexity": 2.5,
            "rng": 8,
        },
    }


def presets() -> list[str]:
    """Return the names of the styles.

    Returns
    -------
    list of str
        For `preset`.

    Examples
    --------
    >>> "coral" in presets()
    True
    """
    return list(_presets())


def preset(name: str, **changes: Any) -> Aoas:
    """Return a named style.

    Parameters
    ----------
    name : str
        One of `presets()`.
    **changes : Any
        Parameters of `Aoas` that replace those of the style.

    Returns
    -------
    Aoas
        The sky.

    Raises
    ------
    ValueError, TypeError
        There is no such style, or a change is out of range.

    Examples
    --------
    >>> preset("coral", sun=Sun(5, 180)).sun.elevation
    5.0
    """
    choice(name, "name", tuple(_presets()))
    return Aoas(**{**_presets()[name], **changes})


_SHAPES = {"CloudPoints": CloudPoints, "CloudSpline": CloudSpline}


def from_json(text: str) -> Aoas:
    """Return the sky that `to_json` wrote.

    Parameters
    ----------
    text : str
        JSON. Parameters that are missing take their defaults.

    Returns
    -------
    Aoas
        The sky.

    Raises
    ------
    ValueError, TypeError
        It is not JSON of a sky, or a parameter is unknown or out of range.

    Examples
    --------
    >>> from_json('{"kind": "aoas", "sun": {"elevation": 30}}').sun
    Sun(elevation=30.0, azimuth=0.0)
    """
    values = json_object(text, "a sky")
    if values.pop("kind", None) != "aoas" or not isinstance(values.get("sun"), dict):
        msg = "text must be a JSON object with kind 'aoas' and a sun"
        raise ValueError(msg)
    known = {f.name for f in dataclasses.fields(Aoas)} - {"principles"}
    unknown = set(values) - known
    if unknown:
        msg = f"text has unknown parameters {sorted(unknown)}"
        raise ValueError(msg)
    try:
        values["sun"] = Sun(**values["sun"])
        shapes = []
        for shape in values.get("shapes", []):
            rest = dict(shape)
            shapes.append(_SHAPES[rest.pop("kind")](**rest))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        msg = f"text has a sun or a shape that is none ({error})"
        raise ValueError(msg) from None
    return Aoas(**{**values, "shapes": shapes})


# Between zero and something a geometric mean is zero: those go linearly.
_SCALES = ("mie", "sun_intensity", "radius_ratio", "scale_height", "thickness", "dome_radius", "grain")
_LINEAR = ("ambiguity", "cloud_complexity", "disc")


def _between(a: float, b: float, t: float, geometric: bool = False) -> float:
    if a == b:
        return a
    return a * (b / a) ** t if geometric and a > 0 and b > 0 else a + (b - a) * t


def mix(sky_a: Aoas, sky_b: Aoas, t: float) -> Aoas:
    """Return a style between two: transfer it a little, or interpolate an animation.

    Parameters
    ----------
    sky_a, sky_b : Aoas
        The styles at 0 and at 1.
    t : float
        In [0, 1] [1].

    Returns
    -------
    Aoas
        Scattering constants, intensity and lengths go geometrically, angles and sizes of patterns linearly (the azimuth
        the short way round); shapes of one sky grow while those of the other shrink; what cannot be mixed (readings,
        seeds, principles) changes at one half. Exactly the given sky at 0 and 1.

    Raises
    ------
    ValueError, TypeError
        `t` is out of range.

    Examples
    --------
    >>> mix(preset("clear"), preset("coral"), 0.5).sun.elevation
    37.5
    """
    a: Aoas = instance(sky_a, "sky_a", Aoas)
    b: Aoas = instance(sky_b, "sky_b", Aoas)
    t = real(t, "t", 0, 1)
    if t in (0, 1) or a == b:
        return b if t == 1 else a
    near = a if t < 0.5 else b
    turn = (b.sun.azimuth - a.sun.azimuth + 180) % 360 - 180
    values: dict[str, Any] = {
        "sun": Sun(_between(a.sun.elevation, b.sun.elevation, t), a.sun.azimuth + t * turn),
        "rayleigh": tuple(_between(x, y, t, True) for x, y in zip(a.rayleigh, b.rayleigh, strict=True)),
        "g": _between(a.g, b.g, t),
    }
    for name in _SCALES + _LINEAR:
        values[name] = _between(getattr(a, name), getattr(b, name), t, name in _SCALES)
    for name in ("viewer", "dome_center"):
        values[name] = tuple(_between(x, y, t) for x, y in zip(getattr(a, name), getattr(b, name), strict=True))
    if a.mie_scale_height is not None or b.mie_scale_height is not None:
        ends = [s.scale_height if s.mie_scale_height is None else s.mie_scale_height for s in (a, b)]
        values["mie_scale_height"] = _between(ends[0], ends[1], t, True)
    if isinstance(a.ground, tuple) and isinstance(b.ground, tuple):
        values["ground"] = tuple(_between(x, y, t) for x, y in zip(a.ground, b.ground, strict=True))
    if a.shapes != b.shapes:
        grown = [(s, 1 - t) for s in a.shapes] + [(s, t) for s in b.shapes]
        values["shapes"] = tuple(dataclasses.replace(s, radius=max(s.radius * w, 1e-4)) for s, w in grown)
    return dataclasses.replace(near, **values)


def contact_sheet(
    sky: Aoas,
    *,
    camera: Camera | None = None,
    exposure: float = 2.0,
    gap: int = 4,
    **parameters: Iterable[Any],
) -> NDArray[np.float32]:
    """Return a sheet of pictures over one or two parameters.

    Parameters
    ----------
    sky : Aoas
        What all pictures share.
    camera : Camera or None
        Of each picture; by default 192 × 108 pixels towards the Sun's azimuth.
    exposure : float
        Of O'Neil's curve, in [0, 1e6] [1].
    gap : int
        White between the pictures [px].
    **parameters : iterable
        One or two names with the values each takes: parameters of `Aoas`, or "elevation" and "azimuth" of the Sun. The
        first goes down, the second to the right; "preset" replaces the whole style.

    Returns
    -------
    ndarray (height, width, 3) of float32
        Linear light in [0, 1], after the exposure curve: ready for `pleinair.io.write`.

    Raises
    ------
    ValueError, TypeError
        There are no or more than two parameters, a name is unknown, or a value is out of range.

    Examples
    --------
    >>> sheet = contact_sheet(preset("clear"), elevation=[5, 40], rayleigh=[(0.01, 0.02, 0.05), (0.05, 0.02, 0.02)])
    >>> sheet.shape
    (220, 388, 3)
    """
    instance(sky, "sky", Aoas)
    if not 1 <= len(parameters) <= 2:
        msg = f"parameters must be one or two names with their values, got {len(parameters)}"
        raise ValueError(msg)
    default = Camera(192, 108, fov=70, azimuth=sky.sun.azimuth, elevation=20)
    camera = default if camera is None else instance(camera, "camera", Camera)
    gap = integer(gap, "gap", 0, 10_000)
    names = list(parameters)
    values = [list(several(v, name)) for name, v in parameters.items()]
    if any(not v for v in values):
        msg = "parameters must each have at least one value"
        raise ValueError(msg)
    down, right = (values[0], values[1]) if len(values) == 2 else ([None], values[0])
    height, width = camera.height, camera.width
    sheet = np.ones((len(down) * (height + gap) - gap, len(right) * (width + gap) - gap, 3), np.float32)
    for i, first in enumerate(down):
        for j, second in enumerate(right):
            changes = [(names[0], first), (names[1], second)] if len(names) == 2 else [(names[0], second)]
            styled = sky
            # A preset first: the other parameter changes it.
            for name, value in sorted(changes, key=lambda change: change[0] != "preset"):
                styled = _changed(styled, name, value)
            y, x = i * (height + gap), j * (width + gap)
            sheet[y : y + height, x : x + width] = oneil(styled.render(camera), exposure)
    return sheet


def _changed(sky: Aoas, name: str, value: Any) -> Aoas:
    """Return a sky with one parameter changed."""
    if name == "preset":
        return preset(value)
    if name in ("elevation", "azimuth"):
        return dataclasses.replace(sky, sun=dataclasses.replace(sky.sun, **{name: value}))
    choice(name, "parameters", tuple(f.name for f in dataclasses.fields(Aoas)))
    return dataclasses.replace(sky, **{name: value})


__all__ = ["RAYLEIGH", "contact_sheet", "from_json", "mix", "preset", "presets"]

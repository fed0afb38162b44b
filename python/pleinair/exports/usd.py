"""A sky as a USD stage: dome light and distant light. Public as `pleinair.exports`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import choice, real, vector
from ..io import PathLike
from .environment import _facing, sunlight, to_world

_STAGE = """#usda 1.0
(
    defaultPrim = "Environment"
    metersPerUnit = 1
    upAxis = "{up}"
)

def Xform "Environment"
{{
    def DomeLight "Sky"
    {{
        float inputs:intensity = 1
        asset inputs:texture:file = @{panorama}@
        token inputs:texture:format = "latlong"
        matrix4d xformOp:transform = {transform}
        uniform token[] xformOpOrder = ["xformOp:transform"]
    }}
{sun}}}
"""


# A DistantLight shines along its -z; normalize makes its intensity an irradiance.
_SUN = """
    def DistantLight "Sun"
    {{
        float inputs:angle = {angle:.9g}
        color3f inputs:color = ({red:.9g}, {green:.9g}, {blue:.9g})
        float inputs:intensity = {intensity:.9g}
        bool inputs:normalize = 1
        matrix4d xformOp:transform = {transform}
        uniform token[] xformOpOrder = ["xformOp:transform"]
    }}
"""


def _matrix4d(rotation: NDArray[np.float64]) -> str:
    """Return a rotation for column vectors as USD writes it, for row vectors."""
    rows = np.eye(4)
    rows[:3, :3] = rotation.T
    return "( " + ", ".join("(" + ", ".join(f"{x + 0.0:.17g}" for x in row) + ")" for row in rows) + " )"


def usda(panorama: PathLike, sun_light: Any = None, *, up: str = "z") -> str:
    """Return a USD scene description with the sky as a DomeLight and the Sun as a DistantLight.

    Parameters
    ----------
    panorama : path
        Of the picture, as the .usda file will name it (relative to itself, or absolute).
    sun_light : SunLight or None
        With `direction`, `irradiance` and `angular_radius` [°]; None leaves the Sun out.
    up : str
        Axis of the stage: "z" (x east, y north) or "y" (x east, z south).

    Returns
    -------
    str
        The text of a .usda file.

    Raises
    ------
    ValueError, TypeError
        A value is not one of these.

    Examples
    --------
    >>> print(usda("sky.exr").splitlines()[0])
    #usda 1.0
    """
    name = Path(panorama).as_posix()
    if "@" in name or not name.isprintable():
        msg = f"panorama must be printable without '@', got {name!r}"
        raise ValueError(msg)
    axis = choice(up, "up", ("z", "y"))
    sun = ""
    if sun_light is not None:
        irradiance = sunlight(sun_light)
        intensity = max(irradiance)
        red, green, blue = (e / intensity if intensity else 1.0 for e in irradiance)
        sun = _SUN.format(
            intensity=intensity,
            red=red,
            green=green,
            blue=blue,
            angle=2 * real(sun_light.angular_radius, "sun_light.angular_radius", 0, 90, "°"),
            transform=_matrix4d(_facing(vector(sun_light.direction, "sun_light.direction"), axis)),
        )
    transform = _matrix4d(to_world("usd", axis)[:3, :3])
    return _STAGE.format(up=axis.upper(), panorama=name, transform=transform, sun=sun)

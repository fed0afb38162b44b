"""One picture for each weather, and a sheet of them. Public as `pleinair.demo`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import integer
from ..astro import Sun
from ..camera import Camera
from ..io import PathLike, write
from ..scene import Weathered
from ..sky import Natural
from ..tone import present, to_uint8
from ..weather import Fog, Overcast, Rain, Rainbow, Snow
from .composition import landscape
from .papers import contact_sheet

# Exposure of what a photographer or painter would lift [1].
_LIFTED = 1.5


def _painted(sky: Any, weather: Any, size: tuple[int, int], style: str = "corot", **more: Any) -> NDArray[np.float32]:
    light = more.pop("exposure", 1.0)
    scene, camera = landscape(sky, style=style, cloud=False, rng=1)
    manner = replace(scene.style, exposure=scene.style.exposure * light)
    scene = replace(scene, style=manner).with_weather(*weather)
    return scene.paint(replace(camera, width=size[0], height=size[1], **more))


def weathers(out: PathLike = "out", *, height: int = 270, say: Callable[[str], object] = print) -> NDArray[np.float32]:
    """Write a sheet of fog, overcast, rain, snow, a shower with its rainbow and a bow at sunset into a folder.

    Parameters
    ----------
    out : path
        The folder; it is made if it is not there.
    height : int
        Of each picture, in [9, 2160] [px].
    say : callable
        Called with a line for each step.

    Returns
    -------
    ndarray (2 height, 48 height / 9, 3) of float32
        The sheet, linear light; in the folder: weather.png.

    Raises
    ------
    ValueError, TypeError
        `height` is out of range.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     weathers(folder, height=18, say=lambda line: None).shape
    (36, 96, 3)
    """
    rows = integer(height, "height", 9, 2160)
    size = (16 * rows // 9, rows)
    noon = Natural(sun=Sun(40, 200), turbidity=3)

    def bow() -> NDArray[np.float32]:
        sky = Weathered(Natural(sun=Sun(4, 180), turbidity=3), Rainbow(radius=450, spread=0.25))
        camera = Camera(*size, fov=66, azimuth=0, elevation=32.5)
        return present(sky.render(camera), sky.adaptation(), fov=camera.fov)

    shower = Rain(rate=9, distance=400, depth=2500, azimuth=8, width=150, base=1600, gloom=0.75)
    made: dict[str, Callable[[], NDArray[np.float32]]] = {
        "fog at dawn": lambda: _painted(
            Natural(sun=Sun(7, 40), turbidity=3), [Fog(visibility=130, top=4, thins=16)], size, exposure=1.25
        ),
        "overcast": lambda: _painted(noon, [Overcast(25)], size, exposure=_LIFTED),
        "rain": lambda: _painted(
            noon, [Overcast(40), Rain(rate=30, exposure=1 / 1000, seed=3)], size, exposure=_LIFTED
        ),
        "snow": lambda: _painted(
            Natural(sun=Sun(25, 200), turbidity=2.2),
            [Overcast(20), Snow(rate=1.2, exposure=1 / 500)],
            size,
            "winter",
            exposure=1.3,
        ),
        "a shower opposite the Sun": lambda: _painted(
            Natural(sun=Sun(14, 184), turbidity=3), [shower], size, fov=62, elevation=13
        ),
        "the bow of a low Sun": bow,
    }
    pictures = []
    for name, paint in made.items():
        pictures.append(paint())
        say(name)
    sheet = contact_sheet(pictures, columns=3)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    write(folder / "weather.png", to_uint8(sheet, dither=True))
    return sheet

"""The grade of a painting: what a manner makes of the light once it is known. Public as `pleinair.paint.Grade`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import tone_colors, tone_values
from .._support.inputs import check, vector
from .._support.schema import JsonFields


@dataclass(frozen=True)
class Grade(JsonFields):
    """What a painter makes of the light once it is known: values of sky and land, saturation, the colour of shadows.

    `Scene.radiance` knows nothing of it.

    Parameters
    ----------
    sky, land : float
        Stops by which sky with its clouds and land are lighter than they are, in [-8, 8] [1].
    saturation : float
        Distance of shown colours from grey of equal luminance, as a factor, in [0, 3] [1].
    shadows : tuple of float
        Hue of what is darker than a tenth of white, linear RGB, at least 0 [1].
    tint : float
        How far shadows go towards that hue, in [0, 1] [1].

    Raises
    ------
    ValueError, TypeError
        A parameter is out of range.

    Examples
    --------
    >>> import dataclasses
    >>> from pleinair.paint import Grade, style
    >>> dataclasses.replace(style("corot"), grade=Grade()).grade.sky
    0.0
    """

    sky: float = 0.0
    land: float = 0.0
    saturation: float = 1.0
    shadows: Any = (0.5, 0.5, 0.5)
    tint: float = 0.0

    def __post_init__(self) -> None:
        check(self, {"sky": (-8, 8), "land": (-8, 8), "saturation": (0, 3), "tint": (0, 1)})
        object.__setattr__(self, "shadows", vector(self.shadows, "shadows", 0, 1))

    def values(self, rgb: NDArray[np.float32], share: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return light (height, width, 3) with these values; `share` (height, width) of each pixel is sky [1].

        Examples
        --------
        >>> light, sky = np.ones((1, 2, 3), np.float32), np.float32([[1, 0]])
        >>> Grade(sky=1, land=-1).values(light, sky)[0, :, 0].tolist()
        [2.0, 0.5]
        """
        if self.sky == 0 and self.land == 0:
            return rgb
        out = np.array(rgb, np.float32, order="C")
        tone_values(out, np.ascontiguousarray(share, np.float32), (self.sky, self.land))
        return out

    def colors(self, rgb: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a shown picture, linear light in [0, 1], with these colours.

        Examples
        --------
        >>> Grade(saturation=0).colors(np.float32([[[1, 0, 0]]])).round(4).tolist()
        [[[0.2126, 0.2126, 0.2126]]]
        """
        if self.saturation == 1 and self.tint == 0:
            return rgb
        out = np.array(rgb, np.float32, order="C")
        tone_colors(out, self.saturation, self.shadows, self.tint)
        return out

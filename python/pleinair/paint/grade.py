"""The grade of a painting: what a manner makes of the light once it is known. Public as `pleinair.paint.Grade`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import tone_colors, tone_values
from .._support.inputs import check, vector
from .._support.schema import JsonFields

# Share of the stops between land and sky that water takes.
_MIRRORED = 0.7


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
    >>> dataclasses.replace(style("corot"), grade=Grade(sky=1)).grade.sky
    1.0
    """

    sky: float = 0.0
    land: float = 0.0
    saturation: float = 1.0
    shadows: Any = (0.5, 0.5, 0.5)
    tint: float = 0.0

    def __post_init__(self) -> None:
        check(self, {"sky": (-8, 8), "land": (-8, 8), "saturation": (0, 3), "tint": (0, 1)})
        object.__setattr__(self, "shadows", vector(self.shadows, "shadows", 0, 1))

    @property
    def mirrors(self) -> float:
        """Factor by which water is lighter than land, since it shows the sky: most of the stops between them [1]."""
        return float(2 ** (_MIRRORED * (self.sky - self.land)))

    def values(self, rgb: NDArray[np.float32], share: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return light with these values.

        Parameters
        ----------
        rgb : ndarray (height, width, 3) of float32
            Linear light, any unit.
        share : ndarray (height, width) of float32
            How much of each pixel is sky, in [0, 1] [1].

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
        """Return a shown picture with these colours.

        Parameters
        ----------
        rgb : ndarray (height, width, 3) of float32
            Linear light in [0, 1].

        Examples
        --------
        >>> Grade(saturation=0).colors(np.float32([[[1, 1, 1], [0, 0, 0]]])).round(3).tolist()
        [[[1.0, 1.0, 1.0], [0.0, 0.0, 0.0]]]
        """
        if self.saturation == 1 and self.tint == 0:
            return rgb
        out = np.array(rgb, np.float32, order="C")
        tone_colors(out, self.saturation, self.shadows, self.tint)
        return out

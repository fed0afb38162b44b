"""An overcast day as weather: the cloud slab of the sky. Public as `pleinair.weather`."""

from __future__ import annotations

from dataclasses import dataclass

from .._support.inputs import check


@dataclass(frozen=True)
class Overcast:
    """A deck of stratus over all: in a scene the sky has it as its `overcast`, a `pleinair.sky.CloudSlab`.

    Parameters
    ----------
    optical_depth : float
        In [4, 500] [1]: 20 to 30 is an ordinary overcast day, 60 and more a dark one.
    base : float
        Height of its base, in [0, 8000] [m].
    thickness : float
        In [1, 7000] [m].

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Notes
    -----
    For skies that compute light in air, `Natural` and `Physical`; others are refused by name.

    Examples
    --------
    >>> Overcast(optical_depth=40).optical_depth
    40.0
    """

    optical_depth: float = 25.0
    base: float = 1000.0
    thickness: float = 800.0

    def __post_init__(self) -> None:
        check(
            self,
            {
                "optical_depth": (4, 500, "1"),
                "base": (0, 8000, "m"),
                "thickness": (1, 7000, "m"),
            },
        )

"""An endless cloud over a sky: stratus, an overcast day or night (beyond realistic_sky). Public as `pleinair.sky`."""

from __future__ import annotations

from dataclasses import dataclass

from .._support.inputs import check


@dataclass(frozen=True)
class CloudSlab:
    """A homogeneous cloud deck without end, for the `overcast` of `Natural` and `Physical`.

    Parameters
    ----------
    optical_depth : float
        In [4, 500] [1]: 5 to 10 is a thin layer, 20 to 30 an ordinary overcast day, 60 and more a dark one. A thinner cloud
        shows the Sun.
    base : float
        Height of its base above the ground, in [0, 8000] [m].
    thickness : float
        In [1, 7000] [m].
    g : float
        Asymmetry of its Henyey-Greenstein phase function, in [0, 0.9] [1]; 0.85 for droplets, 0.75 for ice.
    albedo : float
        Single-scattering albedo, in [0.5, 1] [1]; 1 in visible light but for soot.

    Raises
    ------
    ValueError, TypeError
        A value is out of range.

    Notes
    -----
    Plane-parallel radiative transfer of all orders by adding and doubling (van de Hulst 1963; Grant and Hunt 1969): in the
    cloud, in the air below it, between it and the ground, and between it and the air above. It is lit by the beams of Sun and
    Moon and by the sky above its top. The same from everywhere below, so that no edge lights it at dusk.

    Examples
    --------
    >>> from pleinair import Sun
    >>> from pleinair.sky import Physical
    >>> grey = Physical(Sun(40, 180), overcast=CloudSlab(optical_depth=25))
    >>> blue = Physical(Sun(40, 180))
    >>> bool(grey.probe((0, 0, 1)).xy[0] > blue.probe((0, 0, 1)).xy[0] + 0.03)
    True
    """

    optical_depth: float = 25.0
    base: float = 1000.0
    thickness: float = 800.0
    g: float = 0.85
    albedo: float = 1.0

    def __post_init__(self) -> None:
        check(
            self,
            {
                "optical_depth": (4, 500, "1"),
                "base": (0, 8000, "m"),
                "thickness": (1, 7000, "m"),
                "g": (0, 0.9, "1"),
                "albedo": (0.5, 1, "1"),
            },
        )

    def _over(self, altitude: float) -> CloudSlab:
        """Return it if the observer is below it."""
        if altitude > self.base:
            msg = f"altitude must be below the base of the overcast, in [0, {self.base:g}] [m], not {altitude:g}"
            raise ValueError(msg)
        return self

"""Rendering parameters of a cloud, and the conventions in which they are read. Public as `pleinair.clouds`."""

from __future__ import annotations

from dataclasses import dataclass

from .._support.inputs import choice, real, vector
from .._support.schema import JsonFields


@dataclass(frozen=True)
class Params(JsonFields):
    """The rendering parameters of Table 1 of the paper.

    Parameters
    ----------
    light_intensity : float
        Intensity of the light on the cloud, L_in, at least 0 [1].
    light_color : tuple of float
        Its colour, c_in, linear RGB, at least 0 [1].
    g : float
        Asymmetry of the Henyey-Greenstein phase function, in [-0.999, 0.999], positive is forward [1].
    sigma_t : float
        Extinction per metre and unit of density, at least 0 [1/m].
    albedo : float
        Single-scattering albedo β, in [0, 1] [1]. In single scattering only its product with the intensity shows.
    ambient : float
        Ambient light L_amb, at least 0 [1].
    haze : tuple of float
        Extinction of the air κ_a for R, G, B per unit of haze distance, at least 0 [1].
    ambient_color : tuple of float, optional
        Colour of the ambient light, linear RGB, at least 0 [1]; by default the light's.
    haze_height : float
        Height H over which the air thins out by e, in [1, 1e9] [m]; counts with `Conventions(haze="height")` alone.

    Raises
    ------
    ValueError, TypeError
        A value is not a number in its range.

    Examples
    --------
    >>> Params(g=0.7).g
    0.7
    """

    light_intensity: float = 1.0
    light_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    g: float = 0.85
    sigma_t: float = 0.05
    albedo: float = 0.99
    ambient: float = 0.1
    haze: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ambient_color: tuple[float, float, float] | None = None
    haze_height: float = 8000.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "light_intensity", real(self.light_intensity, "light_intensity", 0, 1e30))
        put(self, "light_color", vector(self.light_color, "light_color", 0, 1e30))
        put(self, "g", real(self.g, "g", -0.999, 0.999))
        put(self, "sigma_t", real(self.sigma_t, "sigma_t", 0, 1e9, "1/m"))
        put(self, "albedo", real(self.albedo, "albedo", 0, 1))
        put(self, "ambient", real(self.ambient, "ambient", 0, 1e30))
        put(self, "haze", vector(self.haze, "haze", 0, 1e30))
        if self.ambient_color is not None:
            put(self, "ambient_color", vector(self.ambient_color, "ambient_color", 0, 1e30))
        put(self, "haze_height", real(self.haze_height, "haze_height", 1, 1e9, "m"))


@dataclass(frozen=True)
class Conventions:
    """How parameters get their meaning, where the paper leaves it open; `Conventions.paper()` is its letter.

    Parameters
    ----------
    ambient : {"extinction", "paper"}
        The ambient term of eq 5: L_amb (1 − exp(−σ S)), which tends to L_amb in an opaque cloud, or the printed one,
        which is divided by σ and so depends on the unit of length.
    phase : {"mean-one", "integral-one"}
        Whether the phase function has mean 1 or integral 1 over the sphere.
    interpolation : {"cubic", "linear"}
        Between the extinctions of a basis: cubic in log σ, or linear in σ.
    haze : {"unit", "distance", "height"}
        The distance t_c of eq 3: 1 for every pixel, or the distance to the cloud over its mean, or, over its mean, the
        path in air whose density falls off with height as exp(−z / H), H being `Params.haze_height`.
    light : {"uniform", "air"}
        Whether the Sun's light has one colour for the whole cloud, or has come through that same air and is dimmer and
        of another colour where the cloud is low (needs haze="height"; `light_color` is that of the cloud's top).

    Raises
    ------
    ValueError
        A word is none of these, or light="air" stands without haze="height".

    Examples
    --------
    >>> Conventions.paper()
    Conventions(ambient='paper', phase='mean-one', interpolation='linear', haze='unit', light='uniform')
    """

    ambient: str = "extinction"
    phase: str = "mean-one"
    interpolation: str = "cubic"
    haze: str = "unit"
    light: str = "uniform"

    def __post_init__(self) -> None:
        choice(self.ambient, "ambient", ("extinction", "paper"))
        choice(self.phase, "phase", ("mean-one", "integral-one"))
        choice(self.interpolation, "interpolation", ("cubic", "linear"))
        choice(self.haze, "haze", ("unit", "distance", "height"))
        choice(self.light, "light", ("uniform", "air"))
        if self.light == "air" and self.haze != "height":
            msg = f"light must be 'uniform' unless haze is 'height', got 'air' with haze {self.haze!r}"
            raise ValueError(msg)

    @classmethod
    def paper(cls) -> Conventions:
        """Return the conventions of the paper's letter.

        Examples
        --------
        >>> Conventions.paper().ambient
        'paper'
        """
        return cls(ambient="paper", interpolation="linear")

    @property
    def words(self) -> tuple[str, str, str]:
        """Their words as the core reads them."""
        return self.ambient, self.phase, self.interpolation

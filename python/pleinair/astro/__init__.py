"""Where the Sun, the Moon and the stars are, and how bright; the diffuse lights of the dark sky."""

from .bodies import Moon, Place, Stars, Sun, moon, sidereal_time, stars
from .bodies import _moon as _moon
from .bodies import _refractivity as _refractivity
from .bodies import _stars as _stars
from .light import (
    LightSource,
    color_temperature,
    irradiance_to_magnitude,
    light_sources,
    magnitude_to_irradiance,
    milky_way,
    zodiacal_light,
)
from .light import star_colors as star_colors
from .solar_system import Planet, planets
from .solar_system import _planets as _planets
from .time import seconds_of as seconds_of

__all__ = [
    "LightSource",
    "Moon",
    "Place",
    "Planet",
    "Stars",
    "Sun",
    "color_temperature",
    "irradiance_to_magnitude",
    "light_sources",
    "magnitude_to_irradiance",
    "milky_way",
    "moon",
    "planets",
    "sidereal_time",
    "stars",
    "zodiacal_light",
]

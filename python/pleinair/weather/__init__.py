"""What falls and what veils: fog, rain, snow, an overcast sky, rainbows. For `Scene(weather=...)`."""

from .drops import bow_phase, drop_speed, fall_sizes
from .drops import phase_table as phase_table
from .fog import Fog
from .overcast import Overcast
from .rain import Rain, Rainbow, wet_reflectance
from .snow import Snow, sky_view, snow_cover

__all__ = [
    "Fog",
    "Overcast",
    "Rain",
    "Rainbow",
    "Snow",
    "bow_phase",
    "drop_speed",
    "fall_sizes",
    "sky_view",
    "snow_cover",
    "wet_reflectance",
]

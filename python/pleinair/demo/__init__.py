"""The four papers at work, every step written as a picture."""

from .composition import landscape, style_sky
from .papers import camera_for as camera_for
from .papers import day_and_night, day_strip, fit_photo, paintings, photograph, sky_styles
from .weather import weathers

__all__ = [
    "day_and_night",
    "day_strip",
    "fit_photo",
    "landscape",
    "paintings",
    "photograph",
    "sky_styles",
    "style_sky",
    "weathers",
]

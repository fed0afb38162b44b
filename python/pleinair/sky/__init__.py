"""How bright is that direction: skies to look at, to style, to light a scene with (aoas, realistic_sky)."""

from __future__ import annotations

from .aoas import Aoas, CloudPoints, CloudSpline, Principle
from .base import Sky, SunLight
from .cie_general import CieGeneral
from .cloud_slab import CloudSlab
from .natural import Natural
from .physical import Physical
from .preetham import Preetham
from .probe import Probe
from .style_presets import contact_sheet, from_json, mix, preset, presets

__all__ = [
    "Aoas",
    "CieGeneral",
    "CloudPoints",
    "CloudSlab",
    "CloudSpline",
    "Natural",
    "Physical",
    "Preetham",
    "Principle",
    "Probe",
    "Sky",
    "SunLight",
    "contact_sheet",
    "from_json",
    "mix",
    "preset",
    "presets",
]

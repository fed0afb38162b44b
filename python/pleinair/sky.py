"""How bright is that direction: skies to look at, to style, to light a scene with (aoas, realistic_sky)."""

from __future__ import annotations

from ._aoas import Aoas, CloudPoints, CloudSpline, Principle
from ._formulas import CieGeneral, Preetham
from ._natural import Natural
from ._physical import Physical
from ._skies import Probe, Sky, SunLight
from ._styles import contact_sheet, from_json, mix, preset, presets

__all__ = [
    "Aoas",
    "CieGeneral",
    "CloudPoints",
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

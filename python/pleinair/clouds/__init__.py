"""What happens to light in a cloud: volumes, scattering of every order, precomputed images (inverse_clouds)."""

from .animation import Keyframes, keyframes
from .basis import Basis
from .basis_set import Bases
from .generators import KINDS as KINDS
from .generators import procedural, simulated
from .images import CloudImage
from .images import air_paths as air_paths
from .loading import load
from .params import Conventions, Params
from .rendering import render
from .volume import Volume

__all__ = [
    "Bases",
    "Basis",
    "CloudImage",
    "Conventions",
    "Keyframes",
    "Params",
    "Volume",
    "keyframes",
    "load",
    "procedural",
    "render",
    "simulated",
]

"""Which parameters explain this photograph: the fit of Dobashi et al. 2012 (inverse_clouds)."""

from .cloud_fit import clouds
from .cloud_fit import objective as objective
from .optimise import DifferentialEvolution, Found, GeneticAlgorithm, differential, genetic
from .photo import Photo, UnfittableError
from .result import Candidate, CloudFit, Tried
from .sky_fit import SkyFit, sky

__all__ = [
    "Candidate",
    "CloudFit",
    "DifferentialEvolution",
    "Found",
    "GeneticAlgorithm",
    "Photo",
    "SkyFit",
    "Tried",
    "UnfittableError",
    "clouds",
    "differential",
    "genetic",
    "sky",
]

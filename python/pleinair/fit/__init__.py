"""Which parameters explain this photograph: the fit of Dobashi et al. 2012 (inverse_clouds)."""

from .cloud_fit import Candidate, CloudFit, Tried, clouds
from .optimise import Found, differential, genetic
from .photo import Photo

__all__ = [
    "Candidate",
    "CloudFit",
    "Found",
    "Photo",
    "Tried",
    "clouds",
    "differential",
    "genetic",
]

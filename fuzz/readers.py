"""Mutated files into every reader, wrong arrays into every public function of arrays: only documented exceptions may come out.

    python fuzz/readers.py --seconds 60 --seed 0      # `make fuzz` runs it for an hour

A fault is anything but ValueError, TypeError, FileNotFoundError or ImportError, a panic's text, a message of a reader without
the file's name, or more memory than a limit. Faults are printed with seed and case; the exit code counts them.
"""

from __future__ import annotations

import argparse
import io
import json
import resource
import sys
import tempfile
import time
import warnings
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np
import pleinair as pa
from PIL import Image

FINE = (ValueError, TypeError, FileNotFoundError, ImportError)
MEMORY = 8 << 30


def seeds(folder: Path) -> dict[str, tuple[bytes, object]]:
    """Small valid files of every kind, and what reads them."""
    rng = np.random.default_rng(0)
    picture = rng.random((9, 11, 3)).astype(np.float32)
    cloud = pa.clouds.procedural("cumulus", (8, 8, 8), rng=1)
    camera = pa.Camera.look_at((80, -600, 900), (80, 80, 860), 8, 6, fov=20)
    basis = pa.clouds.Basis.precompute(cloud, camera, pa.Sun(40, 200), orders=2, samples=1, rng=0)
    out: dict[str, tuple[bytes, object]] = {}
    for ending in ("png", "jpg", "exr", "hdr", "pfm"):
        out[f"a.{ending}"] = (pa.io.write(folder / f"a.{ending}", picture).read_bytes(), pa.io.read)
    levels = Image.fromarray((255 * picture).astype(np.uint8))
    for form in ("TIFF", "BMP", "GIF", "WEBP", "PPM"):
        stream = io.BytesIO()
        levels.save(stream, form)
        out[f"b.{form.lower()}"] = (stream.getvalue(), pa.io.read)
    photographs = Path(__file__).parents[1] / "tests" / "data" / "photographs"
    for path in sorted(photographs.glob("*.[pjt][npi][gf]")):
        out[path.name] = (path.read_bytes(), pa.io.read)
    out["c.npz"] = (cloud.save(folder / "c.npz").read_bytes(), pa.clouds.load)
    out["c.vol"] = (cloud.save(folder / "c.vol").read_bytes(), pa.clouds.load)
    for path in sorted((photographs.parent / "volumes").glob("*.vdb")):
        out[path.name] = (path.read_bytes(), pa.clouds.load)
    table = "# a cloud\n3,2,2\n.02,.03\n.5,.54\nx,y,z,lwc,reff\n0,1,1,.2,10\n2,0,0,.1,5\n"
    out["c.txt"] = (table.encode(), pa.clouds.load)
    out["c.part"] = (b"2\n3 2 2\n.02 .03\n.5 .54\n290 289\n1 2 2 .2 10\n", pa.clouds.load)
    np.save(folder / "c.npy", cloud.density)
    out["c.npy"] = ((folder / "c.npy").read_bytes(), pa.clouds.load)
    out["basis.npz"] = (basis.save(folder / "basis.npz").read_bytes(), pa.clouds.Basis.load)
    bases = pa.clouds.Bases([basis])
    out["bases.npz"] = (bases.save(folder / "bases.npz").read_bytes(), pa.clouds.Bases.load)

    def text(parse: object) -> object:
        return lambda path: parse(path.read_bytes().decode("utf-8", "replace"))  # type: ignore[operator]

    sky = pa.sky.Aoas(sun=pa.Sun(30, 200), cloud_complexity=3)
    for name, made, parse in (
        ("params.json", pa.clouds.Params().to_json(), pa.clouds.Params.from_json),
        ("tree.json", pa.plants.preset("oak").to_json(), pa.plants.TreeParams.from_json),
        ("strata.json", pa.plants.Strata().to_json(), pa.plants.Strata.from_json),
        ("style.json", pa.paint.style("corot").to_json(), pa.paint.Style.from_json),
        ("sky.json", sky.to_json(), pa.sky.from_json),
    ):
        out[name] = (made.encode(), text(parse))
    return out


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Bits flipped, bytes set, pieces cut, doubled, moved or replaced by numbers that lie."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 6))):
        if not out:
            break
        at, kind = int(rng.integers(len(out))), int(rng.integers(7))
        if kind == 0:
            out[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            out[at] = int(rng.choice([0, 1, 127, 128, 255]))
        elif kind == 2:
            del out[at:]
        elif kind == 3:
            del out[at : at + int(rng.integers(1, 40))]
        elif kind == 4:
            out[at:at] = out[at : at + int(rng.integers(1, 40))]
        elif kind == 5:
            value = int(rng.choice([0, 1, 2**15, 2**16 - 1, 2**31 - 1, 2**32 - 1]))
            out[at : at + 4] = value.to_bytes(4, str(rng.choice(["little", "big"])))  # type: ignore[arg-type]
        else:
            out[at : at + 8] = rng.bytes(8)
    return bytes(out)


def repacked(data: bytes, rng: np.random.Generator) -> bytes:
    """Return an archive whose members are mutated and whose checksums are right: damage gets past zip."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = str(rng.choice(sorted(members)))
    members[name] = mutated(members[name], rng)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return stream.getvalue()


def odd_array(rng: np.random.Generator) -> np.ndarray:
    """Return an array nobody wants."""
    shapes = [(), (0,), (1,), (3,), (2, 3), (5, 4, 3), (1, 1, 3), (0, 3), (4, 4, 4), (7, 1)]
    shape = shapes[int(rng.integers(len(shapes)))]
    kinds = ["f4", "f8", "f2", ">f8", "u1", "u2", "i8", "?", "c16", "U3", "O", "M8[s]"]
    kind = kinds[int(rng.integers(len(kinds)))]
    base = rng.normal(0, 10.0 ** rng.integers(-3, 4), shape)
    if kind in ("f4", "f8", "f2", ">f8") and base.size and rng.random() < 0.5:
        base = np.where(rng.random(shape) < 0.3, rng.choice([np.nan, np.inf, -np.inf, 0.0, 1e308, -1e-320]), base)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if kind in ("U3", "O"):
            array = base.astype("U3").astype(kind)
        elif kind == "M8[s]":
            array = np.zeros(shape, kind)
        else:
            array = base.astype(kind)
    if array.ndim and rng.random() < 0.3:
        array = array[::-1] if rng.random() < 0.5 else np.asfortranarray(array)
    if rng.random() < 0.2:
        array = array.copy()
        array.flags.writeable = False
    if rng.random() < 0.1 and array.ndim:
        array = np.ma.masked_array(array, rng.random(array.shape) < 0.5)
    return array


CALLS = {
    "srgb_encode": pa.color.srgb_encode,
    "srgb_decode": pa.color.srgb_decode,
    "rgb_to_hsv": pa.color.rgb_to_hsv,
    "hsv_to_rgb": pa.color.hsv_to_rgb,
    "rgb_to_xyz": pa.color.rgb_to_xyz,
    "xyz_to_xyy": pa.color.xyz_to_xyy,
    "xyy_to_xyz": pa.color.xyy_to_xyz,
    "rgb_to_lab": pa.color.rgb_to_lab,
    "lab_to_rgb": pa.color.lab_to_rgb,
    "luminance": pa.color.luminance,
    "into_gamut": pa.color.into_gamut,
    "histogram": lambda x: pa.image.histogram(x, 16, (0, 1)),
    "otsu": pa.image.otsu,
    "fill": lambda x: pa.image.fill(x, np.zeros(np.shape(x)[:2], bool)),
    "dilate": lambda x: pa.image.dilate(x, 2),
    "resize": lambda x: pa.image.resize(x, 5, 4),
    "segment_sky": pa.image.segment_sky,
    "tumblin_rushmeier": pa.tone.tumblin_rushmeier,
    "scotopic": pa.tone.scotopic,
    "expose": pa.tone.expose,
    "to_uint8": pa.tone.to_uint8,
    "radiance": pa.sky.Aoas(sun=pa.Sun(30, 200)).radiance,
    "irradiance": pa.sky.Aoas(sun=pa.Sun(30, 200)).irradiance,
    "volume": lambda x: pa.clouds.Volume(x, 10.0),
    "photo": pa.fit.Photo.analyse,
    "heightfield": lambda x: pa.plants.Surface.heightfield(x, spacing=1.0),
    "subdivide": lambda x: pa.plants.subdivide(x, [[0, 1, 2, 3]], 1),
    "strokes": lambda x: pa.paint.Strokes(x, (0, 0, 1), (1, 1)),
    "noise": lambda x: pa.paint.noise(0, x),
    "sun": lambda x: pa.Sun(x, x),
    "params": lambda x: pa.clouds.Params(g=x, light_color=x),
}


def fault(error: BaseException, name: str = "") -> str | None:
    """Say what is wrong with an exception, or nothing."""
    text = str(error)
    if not isinstance(error, FINE):
        return f"{type(error).__name__}: {text[:200]}"
    if "panick" in text or "unwrap()" in text:
        return f"a panic's text: {text[:200]}"
    if name and name not in text:
        return f"without the file's name: {text[:200]}"
    return None


def run(seconds: float, seed: int) -> tuple[Counter, list[str]]:
    """Fuzz for so many seconds; the counts, and the faults."""
    rng = np.random.default_rng(seed)
    counts: Counter = Counter()
    faults: list[str] = []
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, hard))
    try:
        with tempfile.TemporaryDirectory() as place, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            np.seterr(all="ignore")
            folder = Path(place)
            files = seeds(folder)
            names = sorted(files)
            ends = time.monotonic() + seconds
            while time.monotonic() < ends:
                name = names[int(rng.integers(len(names)))]
                data, read = files[name]
                again = zipfile.is_zipfile(io.BytesIO(data)) and rng.random() < 0.5
                bad = repacked(data, rng) if again else mutated(data, rng)
                path = folder / f"x-{name}"
                path.write_bytes(bad)
                counts["files"] += 1
                try:
                    read(path)  # type: ignore[operator]
                    counts["files read"] += 1
                except BaseException as error:
                    if isinstance(error, KeyboardInterrupt):
                        raise
                    wrong = fault(error, "" if name.endswith(".json") else path.name)
                    if wrong:
                        faults.append(f"{name}, seed {seed}, file {counts['files']}: {wrong}")
                for _ in range(2):
                    call = str(rng.choice(sorted(CALLS)))
                    array = odd_array(rng)
                    counts["calls"] += 1
                    try:
                        CALLS[call](array)
                        counts["calls answered"] += 1
                    except BaseException as error:
                        if isinstance(error, KeyboardInterrupt):
                            raise
                        wrong = fault(error)
                        if wrong:
                            faults.append(f"{call}({array.dtype}, {array.shape}), seed {seed}: {wrong}")
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    return counts, faults


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="how long [s]")
    parser.add_argument("--seed", type=int, default=0, help="of mutations [1]")
    args = parser.parse_args()
    counts, faults = run(args.seconds, args.seed)
    for line in sorted(set(faults)):
        print("FAULT", line)
    print(json.dumps({**counts, "seconds": args.seconds, "faults": len(faults)}))
    return min(len(faults), 100)


if __name__ == "__main__":
    sys.exit(main())

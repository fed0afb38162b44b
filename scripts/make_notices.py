"""Write THIRD_PARTY_LICENSES.txt: the licences of every crate in the extension, and of the data in the package.

Run it after a change of dependencies; tests/house/test_package.py says when.
"""

import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]
HEAD = """The compiled extension of pleinair contains the Rust crates below, under the licences printed after them. Data of others
in the package, with their licences, are listed in pleinair/data/SOURCES.md and at the end of this file.
"""


def crates() -> list[dict]:
    """Packages that are compiled into the extension, by name; build scripts and macros run elsewhere."""
    command = [
        "cargo",
        "metadata",
        "--format-version",
        "1",
        "--features",
        "python",
        "--filter-platform",
        "x86_64-unknown-linux-gnu",
    ]
    data = json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout)
    nodes = {node["id"]: node for node in data["resolve"]["nodes"]}
    todo, seen = [data["resolve"]["root"]], set()
    while todo:
        node = nodes[todo.pop()]
        for dependency in node["deps"]:
            normal = any(kind["kind"] is None for kind in dependency["dep_kinds"])
            if normal and dependency["pkg"] not in seen:
                seen.add(dependency["pkg"])
                todo.append(dependency["pkg"])
    return sorted((p for p in data["packages"] if p["id"] in seen), key=lambda p: p["name"])


def texts(package: dict) -> list[str]:
    """Licence and copyright files of a crate."""
    folder = Path(package["manifest_path"]).parent
    names = sorted(
        p for p in folder.iterdir() if p.name.upper().startswith(("LICEN", "COPYING", "NOTICE")) and p.is_file()
    )
    return [p.read_text(encoding="utf-8", errors="replace").strip() for p in names]


def main() -> None:
    """Group crates by the text of a licence, so that each is printed once."""
    found = crates()
    by_text: dict[str, list[str]] = {}
    for package in found:
        for text in texts(package):
            by_text.setdefault(text, []).append(package["name"])
    lines = [HEAD, "Crate, version, licence, authors", ""]
    # Names without addresses.
    authors = {p["id"]: ", ".join(a.split("<")[0].strip() for a in p["authors"]) or "see its repository" for p in found}
    lines += [f"{p['name']} {p['version']}: {p['license']}; {authors[p['id']]}" for p in found]
    for text, names in sorted(by_text.items(), key=lambda item: item[1]):
        lines += ["", "=" * 100, "Of " + ", ".join(sorted(set(names))), "", text]
    stars = ROOT / "tests/data/d3-celestial_LICENSE"
    lines += [
        "",
        "=" * 100,
        "Of the star table and, in the tests, the outlines of the Milky Way (d3-celestial)",
        "",
        stars.read_text().strip(),
        "",
        "=" * 100,
        "Of the map of the Milky Way",
        "",
        "Made from the all-sky Milky Way panorama of Axel Mellinger, University of Potsdam, who gives permission to modify and",
        "redistribute it if proper credit to the original image is given (as recorded in Debian's stellarium-data 0.22.2).",
        "",
        "=" * 100,
        "Of the map of the Moon",
        "",
        "Made from maps by the USGS Astrogeology Research Program and from Celestia's lunar textures, based on Clementine data: in",
        "the public domain (as recorded in Debian's stellarium-data 0.22.2).",
        "",
    ]
    (ROOT / "THIRD_PARTY_LICENSES.txt").write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()

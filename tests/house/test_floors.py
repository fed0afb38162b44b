"""The import law in Python: a module sees modules of lower floors only."""

import ast
from pathlib import Path

import pleinair
import pytest

ROOT = Path(pleinair.__file__).parent
# Anything may be imported lazily, inside a function, by the command line and the report.
FLOORS = {
    "_core": 0,
    "_inputs": 0,
    "color": 1,
    "image": 1,
    "_instant": 1,
    "_light": 1,
    "astro": 2,
    "camera": 1,
    "_hdr": 1,
    "io": 2,
    "tone": 2,
    "_skies": 3,
    "_aoas": 4,
    "_physical": 4,
    "_formulas": 5,
    "_natural": 5,
    "_styles": 5,
    "sky": 6,
    "_geometry": 3,
    "_tree_params": 1,
    "_tree_kinds": 2,
    "_trees": 4,
    "_strata": 2,
    "_surfaces": 4,
    "_rocks": 5,
    "plants": 6,
    "_volumes": 3,
    "_orders": 1,
    "_makers": 4,
    "_looks": 4,
    "_keyframes": 5,
    "_basis": 5,
    "_bases": 6,
    "clouds": 7,
    "_paint_params": 2,
    "_paint_style": 3,
    "_sprites": 2,
    "_strokes": 3,
    "_painting": 4,
    "_detail": 5,
    "paint": 6,
    "_objects": 7,
    "_account": 8,
    "_backdrop": 8,
    "_timeline": 8,
    "scene": 9,
    "_photo": 8,
    "_search": 1,
    "_race": 2,
    "fit": 9,
    "exports": 9,
    "_widget": 0,
    "_controls": 2,
    "_explore": 9,
    "_landscape": 10,
    "demo": 11,
    "report": 10,
    "__init__": 12,
    "__main__": 13,
}


def imports(path: Path) -> list[tuple[int, str]]:
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.level or (node.module or "").startswith("pleinair")):
            module = (node.module or "").removeprefix("pleinair").lstrip(".")
            if module:
                found.append((node.lineno, module.split(".")[0]))
            else:
                found += [(node.lineno, alias.name) for alias in node.names if alias.name in FLOORS]
        elif isinstance(node, ast.Import):
            found += [(node.lineno, a.name.split(".")[1]) for a in node.names if a.name.startswith("pleinair.")]
    return found


def violations(root: Path) -> tuple[int, list[str]]:
    count, wrong = 0, []
    for path in sorted(root.glob("*.py")):
        mine = FLOORS.get(path.stem)
        if mine is None:
            wrong.append(f"{path.name} is not in the table")
            continue
        for line, other in imports(path):
            count += 1
            theirs = FLOORS.get(other)
            if theirs is None or not (theirs < mine or (theirs == mine == 0)):
                wrong.append(f"{path.name}:{line}: must not see {other}")
    return count, wrong


def test_modules_look_down_only():
    count, wrong = violations(ROOT)
    assert count > 15, "the scan must find imports"
    assert not wrong, "\n".join(wrong)


def test_the_law_can_be_broken(tmp_path):
    (tmp_path / "color.py").write_text("from .fit import Photo\nfrom . import image\nimport pleinair.clouds\n")
    (tmp_path / "attic.py").write_text("")
    _, wrong = violations(tmp_path)
    assert len(wrong) == 4, wrong


def test_import_loads_numpy_only():
    import subprocess
    import sys

    code = "import sys, pleinair; print(' '.join(sorted(m for m in sys.modules if '.' not in m)))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    heavy = {"matplotlib", "PIL", "OpenEXR", "scipy", "skimage", "cv2", "colour", "tqdm", "pandas", "IPython"}
    assert "numpy" in loaded
    assert not heavy & set(loaded)


@pytest.mark.parametrize("path", sorted(ROOT.glob("*.py")), ids=lambda p: p.name)
def test_a_file_is_one_thing(path):
    assert len(path.read_text().splitlines()) <= 600, "a long file asks to be two"

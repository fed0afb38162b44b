"""The import law in Python: a room looks down only, sees other rooms by their faces, and no two files import each other."""

import ast
import subprocess
import sys
from pathlib import Path

import pleinair
import pytest

ROOT = Path(pleinair.__file__).parent
# Rooms and the floors they are on. Within a room files may see each other, but not in a circle.
FLOORS = [
    {"_core", "_support"},
    {"astro", "camera", "color", "image"},
    {"io", "tone"},
    {"clouds", "paint", "plants", "sky", "weather"},
    {"exports", "scene"},
    {"fit"},
    {"_explore", "batch", "demo", "report"},
    {"__init__", "__main__"},
]
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
# Rooms of floor 0 that others of it may use; and the room without a face, whose files others import.
FOUNDATION, FACELESS = {"_core"}, "_support"


def module(path, root):
    """The dotted name of a file below the root: a room's face has the room's name."""
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


def imports(path, root):
    """Line, dotted module below the root, and names that a file imports from this package, wherever in the file."""
    parts = path.relative_to(root).with_suffix("").parts
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] == "pleinair":
                    yield node.lineno, ".".join(alias.name.split(".")[1:]) or "__init__", []
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                base = parts[: len(parts) - node.level]
            elif (node.module or "").split(".")[0] == "pleinair":
                base, node.module = (), node.module.removeprefix("pleinair").lstrip(".")
            else:
                continue
            target = ".".join((*base, node.module) if node.module else base)
            yield node.lineno, target or "__init__", [alias.name for alias in node.names]


def graph(root):
    """Imports between files: file to the files it sees, when it is loaded or later."""
    files = {module(path, root): path for path in sorted(root.rglob("*.py"))}
    edges = {}
    for name, path in files.items():
        seen = set()
        for _, target, names in imports(path, root):
            below = {f"{target}.{n}" for n in names if f"{target}.{n}" in files}
            seen |= below or ({target} & set(files))
        edges[name] = seen - {name}
    return edges


def circle(edges):
    """Return files that import each other, the first one twice, or nothing."""
    done, way = set(), []

    def visit(name):
        if name in way:
            return [*way[way.index(name) :], name]
        if name in done:
            return None
        way.append(name)
        found = next((c for n in sorted(edges[name]) if (c := visit(n))), None)
        way.pop()
        done.add(name)
        return found

    return next((c for name in sorted(edges) if (c := visit(name))), None)


def violations(root):
    count, wrong = 0, []
    for path in sorted(root.rglob("*.py")):
        where = path.relative_to(root)
        mine = where.parts[0].removesuffix(".py")
        if mine not in FLOOR:
            wrong.append(f"{where}: room {mine} is not in the table")
            continue
        for line, target, names in imports(path, root):
            count += 1
            other = target.split(".")[0]
            if other == "__init__":
                # The command line is above the package's face, and a report reads the version there.
                wrong += [f"{where}:{line}: {n} through the top" for n in names if mine not in ("__init__", "__main__")]
                wrong += [f"{where}:{line}: {n} is above" for n in names if FLOOR.get(n, 0) > FLOOR[mine]]
            elif other not in FLOOR:
                wrong.append(f"{where}:{line}: {target} is no room")
            elif other != mine:
                below = FLOOR[other] < FLOOR[mine] or (FLOOR[other] == 0 and other in FOUNDATION)
                if not below:
                    wrong.append(f"{where}:{line}: {mine} must not see {other}")
                if "." in target and other != FACELESS and mine != "__init__":
                    wrong.append(f"{where}:{line}: {target} is behind the face of {other}")
    found = circle(graph(root))
    if found:
        wrong.append("circle: " + " -> ".join(found))
    return count, wrong


def test_rooms_look_down_only():
    count, wrong = violations(ROOT)
    assert count > 200, "the scan must find imports"
    assert not wrong, "\n".join(wrong)
    assert len(FLOORS) <= 8


def test_the_law_can_be_broken(tmp_path):
    files = {
        "color.py": "from .fit import Photo\nfrom . import image\nimport pleinair.clouds\n",  # up, through the top, up
        "attic.py": "",  # no room
        "sky/aoas.py": "from ..clouds import Volume\nfrom ..io.files import replacing\nfrom .base import Sky\n",
        "sky/base.py": "def late():\n    from .aoas import Aoas\n",  # a circle, though only when called
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    _, wrong = violations(tmp_path)
    assert sorted(w.split(":")[0] for w in wrong) == ["attic.py", "circle", *["color.py"] * 3, *["sky/aoas.py"] * 2], (
        wrong
    )
    assert wrong[-1] == "circle: sky.aoas -> sky.base -> sky.aoas"


@pytest.mark.parametrize("path", sorted(p for p in ROOT.glob("*/__init__.py")), ids=lambda p: p.parent.name)
def test_a_face_only_shows_what_is_behind_it(path):
    tree = ast.parse(path.read_text())
    assert ast.get_docstring(tree)
    for node in tree.body[1:]:
        is_all = isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__"
        assert isinstance(node, ast.ImportFrom) or is_all, f"line {node.lineno} does something"
    files = {p.stem for p in path.parent.glob("*.py")}
    names = {alias.asname or alias.name for n in tree.body if isinstance(n, ast.ImportFrom) for alias in n.names}
    assert not files & names, "a file with the name of a public function hides it"


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()


def test_import_loads_nothing():
    loaded = set(run("import sys, pleinair; print(' '.join(sys.modules))"))
    assert "pleinair" in loaded
    assert not {"numpy", "typing", "pleinair._core", "pleinair._support"} & loaded


def test_a_room_loads_itself_and_what_is_below_it():
    loaded = set(run("import sys, pleinair; pleinair.color; print(' '.join(sys.modules))"))
    mine = {name for name in loaded if name.startswith("pleinair")}
    support = {f"pleinair._support{n}" for n in ("", ".docs", ".inputs", ".kernels")}
    assert mine == {"pleinair", "pleinair._core", "pleinair.color"} | support
    loaded = set(run("import sys, pleinair; pleinair.sky; print(' '.join(sys.modules))"))
    heavy = {"matplotlib", "PIL", "OpenEXR", "scipy", "skimage", "cv2", "colour", "tqdm", "pandas", "IPython", "av"}
    assert "numpy" in loaded
    assert not heavy & loaded
    assert not {f"pleinair.{n}" for n in ("clouds", "paint", "plants", "fit", "scene", "exports", "_explore")} & loaded


def test_every_name_is_there_and_a_wrong_one_is_not():
    code = "import pleinair; from pleinair import *; print(*(n for n in pleinair.__all__ if n not in globals()))"
    assert run(code) == []
    assert set(pleinair.__all__) <= set(dir(pleinair))
    with pytest.raises(AttributeError, match="module 'pleinair' has no attribute 'nonsense'"):
        _ = pleinair.nonsense


@pytest.mark.parametrize("path", sorted(ROOT.rglob("*.py")), ids=lambda p: module(p, ROOT))
def test_a_file_is_one_thing(path):
    assert len(path.read_text().splitlines()) <= 600, "a long file asks to be two"

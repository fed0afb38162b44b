"""Notebooks run from beginning to end, hold the pictures of their own code, and are read as code is."""

import ast
import base64
import hashlib
import io
import json
import re
from pathlib import Path
from typing import ClassVar

import pleinair as pa
import pytest
from PIL import Image

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))


def cells(path):
    return json.loads(path.read_text())["cells"]


def test_there_are_notebooks():
    assert [path.name[:2] for path in NOTEBOOKS] == ["00", "01", "02", "03", "04", "05"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_stored_pictures_are_those_of_the_code(path):
    """scripts/run_notebooks.py stores them with a checksum of the code that made them."""
    book = json.loads(path.read_text())
    sources = ["".join(c["source"]) for c in book["cells"] if c["cell_type"] == "code"]
    checksum = hashlib.sha256("\0".join(sources).encode()).hexdigest()
    assert book["metadata"]["pleinair"]["checksum"] == checksum, f"run scripts/run_notebooks.py {path.stem}"
    assert path.stat().st_size <= 400_000
    outputs = [o for c in book["cells"] if c["cell_type"] == "code" for o in c["outputs"]]
    pictures = [o["data"]["image/jpeg"] for o in outputs if "image/jpeg" in o.get("data", {})]
    assert len(pictures) >= 4
    for picture in pictures:
        assert Image.open(io.BytesIO(base64.b64decode(picture))).width <= 640


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_nothing_volatile_is_stored(path):
    book = json.loads(path.read_text())
    assert set(book["metadata"]) == {"kernelspec", "language_info", "pleinair"}
    for cell in book["cells"]:
        assert cell["metadata"] == {}
        if cell["cell_type"] == "code":
            assert cell["execution_count"] is None
            assert all(o["output_type"] in ("stream", "display_data") for o in cell["outputs"])
            assert all(o.get("name", "stdout") == "stdout" for o in cell["outputs"]), "no warnings"
    assert not re.search(r"/(home|root|work|tmp|Users)/", path.read_text()), "no path of a machine"


def small(scene, camera):
    return scene, camera.resized(160, 90)


class Fewer(ast.NodeTransformer):
    """The same lines with fewer paths and generations, and a third of the pixels and strokes a side: to see that they run.

    What they show is measured elsewhere: `pleinair report` and tests/papers.
    """

    MOST: ClassVar = {"samples": 6, "generations": 20}
    SIZES: ClassVar = {"Camera": (0, 1), "resized": (0, 1), "look_at": (2, 3), "fisheye": (0,), "Strata": (0,)}

    def visit_keyword(self, node):
        self.generic_visit(node)
        if node.arg in self.MOST and isinstance(node.value, ast.Constant) and isinstance(node.value.value, int):
            node.value = ast.Constant(min(node.value.value, self.MOST[node.arg]))
        return node

    def visit_Assign(self, node):
        self.generic_visit(node)
        if ast.unparse(node.targets[0]) in ("WIDTH, HEIGHT", "(WIDTH, HEIGHT)"):
            node.value = ast.Tuple([ast.Constant(size.value // 2) for size in node.value.elts], ast.Load())
        return node

    def visit_Call(self, node):
        self.generic_visit(node)
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        # Air of another turbidity takes seconds to be followed.
        node.keywords = [keyword for keyword in node.keywords if keyword.arg != "turbidity"]
        if name == "arange" and len(node.args) == 3 and isinstance(node.args[2], ast.Constant):
            node.args[2] = ast.Constant(3 * node.args[2].value)
        for k in self.SIZES.get(name, ()):
            if k < len(node.args):
                sizes = node.args[k].elts if isinstance(node.args[k], ast.Tuple) else [node.args[k]]
                for size in sizes:
                    if isinstance(size, ast.Constant) and isinstance(size.value, int):
                        size.value = -(-size.value // 3)
        return node


def test_fewer_changes_numbers_and_nothing_else():
    code = "a = f(1, samples=64, generations=9, rng=3)\nb = pa.Camera(480, 271, fov=40)\nc = g(480, samples=n)\nd = Strata((50, 90), 3)\ne = np.arange(0, 9, 0.5)"
    want = "a = f(1, samples=6, generations=9, rng=3)\nb = pa.Camera(160, 91, fov=40)\nc = g(480, samples=n)\nd = Strata((17, 30), 3)\ne = np.arange(0, 9, 1.5)"
    assert ast.unparse(Fewer().visit(ast.parse(code))) == want


@pytest.mark.timeout(400)
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_it_runs(path, monkeypatch, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    shown = []

    def show():
        for number in plt.get_fignums():
            # Drawn, not only laid out.
            plt.figure(number).savefig(tmp_path / f"{len(shown)}.png", dpi=40)
            shown.append(number)
        plt.close("all")

    # Growth is solved in tests/papers/test_corot_detail.py.
    whole = pa.demo.landscape
    monkeypatch.setattr(pa.demo, "landscape", lambda *a, **k: small(*whole(*a, **k, grown=False, trees=1)))
    strip = pa.demo.day_strip
    monkeypatch.setattr(pa.demo, "day_strip", lambda place, when, **k: strip(place, when[::8], **k))
    monkeypatch.setattr(plt, "show", show)
    monkeypatch.chdir(tmp_path)
    space: dict = {}
    for cell in cells(path):
        if cell["cell_type"] == "code":
            code = ast.fix_missing_locations(Fewer().visit(ast.parse("".join(cell["source"]))))
            exec(compile(code, f"{path.name}:{cell['id']}", "exec"), space)  # noqa: S102 - the notebook is ours
    assert shown

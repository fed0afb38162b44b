"""Notebooks run from beginning to end, hold no outputs, and are read as code is."""

import ast
import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))


def cells(path):
    return json.loads(path.read_text())["cells"]


def test_there_are_notebooks():
    assert NOTEBOOKS


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_outputs_are_stripped(path):
    for cell in cells(path):
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            assert cell["execution_count"] is None


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

    monkeypatch.setattr(plt, "show", show)
    monkeypatch.chdir(tmp_path)
    space: dict = {}
    for cell in cells(path):
        if cell["cell_type"] == "code":
            code = "".join(cell["source"])
            ast.parse(code)
            exec(compile(code, f"{path.name}:{cell['id']}", "exec"), space)  # noqa: S102 - the notebook is ours
    assert shown

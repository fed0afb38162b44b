"""Our .glb files in the programs that people bring them to: Khronos' validator and Blender.

Both are large, and neither is a development dependency: `npm install gltf-validator` in a folder that GLTF_VALIDATOR names,
and a Python that has `pip install bpy`, which BLENDER_PYTHON names (or this one).
"""

import importlib.util
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pleinair as pa
import pytest
from pleinair.plants import Tree

DOME = pa.exports.skydome(pa.sky.Aoas(sun=pa.Sun(30, 200)), rings=16, radius=50)
TREE = Tree.grow(pa.plants.preset("oak"), rng=3)
FILES = ("tree.glb", "points.glb", "dome.glb")
VALIDATE = """
const fs = require('fs'), validator = require('gltf-validator');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))
    .then(report => console.log(JSON.stringify(report)));
"""
OPEN = """
import json, sys
import bpy
from mathutils import Vector
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
bpy.context.view_layer.update()
def brightest(mesh):
    colors = mesh.color_attributes[0]
    at = max(range(len(colors.data)), key=lambda i: sum(colors.data[i].color[:3]))
    return at if colors.domain == "POINT" else mesh.loops[at].vertex_index

found = [o for o in bpy.data.objects if o.type == "MESH"]
print("found", json.dumps({
    "vertices": sum(len(o.data.vertices) for o in found),
    "corners": [[f((o.matrix_world @ Vector(v))[i] for o in found for v in o.bound_box) for i in range(3)] for f in (min, max)],
    "attributes": sorted({a.name for o in found for a in o.data.attributes}),
    "materials": sorted(m.name for m in bpy.data.materials),
    "images": sorted(list(i.size) for i in bpy.data.images if i.size[0]),
    "brightest": [list(o.matrix_world @ o.data.vertices[brightest(o.data)].co) for o in found if o.data.color_attributes],
    "uv": [[min(u), max(u)] for u in [[l.uv[1] for o in found for m in o.data.uv_layers[:1] for l in m.data]] if u],
}))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("glb")
    TREE.export(place / "tree.glb")
    TREE.export(place / "points.glb", leaves="points", proxies=True)
    DOME.write(place / "dome.glb")
    return place


@pytest.fixture(scope="module")
def validator():
    node, place = shutil.which("node"), os.environ.get("GLTF_VALIDATOR")
    if node is None or place is None:
        pytest.skip("GLTF_VALIDATOR names no folder with Khronos' glTF validator")
    return lambda path: json.loads(
        subprocess.run([node, "-e", VALIDATE, str(path)], cwd=place, check=True, capture_output=True, text=True).stdout
    )


@pytest.fixture(scope="module")
def blender():
    python = os.environ.get("BLENDER_PYTHON")
    if python is None and importlib.util.find_spec("bpy") is None:
        pytest.skip("BLENDER_PYTHON names no Python with Blender's bpy")

    def opened(path):
        done = subprocess.run(
            [python or sys.executable, "-c", OPEN, str(path)], check=False, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, done.stderr[-2000:]
        return json.loads(next(x for x in done.stdout.splitlines() if x.startswith("found ")).removeprefix("found "))

    return opened


@pytest.mark.parametrize("name", FILES)
def test_khronos_validator_finds_nothing(name, folder, validator):
    issues = validator(folder / name)["issues"]
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


def test_blender_opens_a_tree(folder, blender):
    found = blender(folder / "tree.glb")
    assert found["vertices"] > 1000
    assert {"_FADE_0", "_FADE_1"} <= set(found["attributes"])
    assert found["materials"] == ["bark", "leaf"]
    assert len(found["images"]) == 2
    low, high = np.array(found["corners"])
    assert np.abs(np.array([low, high]) - TREE.bounds).max() < 0.1 * TREE.bounds[1, 2], "upright: Blender's z is ours"


def test_blender_opens_points_and_a_dome(folder, blender):
    assert blender(folder / "points.glb")["vertices"] > 100
    found = blender(folder / "dome.glb")
    assert np.abs(found["corners"]) == pytest.approx(50, abs=1e-3)
    (brightest,) = found["brightest"]
    ours = DOME.vertices[DOME.colors.sum(axis=1).argmax()]
    assert brightest == pytest.approx(ours, abs=1e-3), "the same corner of the sky is the brightest"

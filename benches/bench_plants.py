"""Trees beside ez-tree 1.1 (three.js, in Node without a browser), NURBS surfaces beside geomdl and scipy.

ez-tree runs where `node` is on the path and EZ_TREE names a folder with @dgreenheck/ez-tree and three in node_modules. Both
sides count CPU time of one thread for a new seed each time: trunk, branches and leaves with normals, no files. The error of a
tree is the largest deviation of a leaf from its chain, in units of the tree; ez-tree's trees are others and cannot be compared.
"""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import time
from collections.abc import Iterable

import numpy as np
import pleinair as pa
from pleinair.report import Row, race

ROOM = "corot"
# Ours, theirs.
CASES = (("thesis", "Aspen Large"), ("oak", "Oak Large"), ("pine", "Pine Large"))

SCRIPT = """
class El { constructor() { this.style = {}; } addEventListener() {} removeEventListener() {} setAttribute() {} }
globalThis.document = { createElementNS() { return new El(); }, createElement() { return new El(); } };
globalThis.self = globalThis; globalThis.window = globalThis; globalThis.Image = El;
const { Tree } = await import('@dgreenheck/ez-tree');
const t = new Tree(); t.loadPreset(process.argv.at(-1));
const times = [];
for (let i = 0; i < 41; i++) {
  t.options.seed = i + 1;
  const before = process.cpuUsage(); t.generate(); times.push(process.cpuUsage(before).user / 1e6);
}
times.sort((a, b) => a - b);
const count = (t.branchesMesh.geometry.index.count + t.leavesMesh.geometry.index.count) / 3;
console.log(JSON.stringify({ seconds: times[20], triangles: count }));
"""


def ez_tree(kind: str) -> tuple[float, int] | None:
    """Median CPU time and triangles of a tree, or None where ez-tree is not there."""
    folder, node = os.environ.get("EZ_TREE"), shutil.which("node")
    if folder is None or node is None:
        return None
    run = subprocess.run(
        [node, "--input-type=module", "-", kind], input=SCRIPT, cwd=folder, capture_output=True, text=True, check=True
    )
    found = json.loads(run.stdout)
    return float(found["seconds"]), int(found["triangles"])


def trees() -> Iterable[Row]:
    for kind, theirs in CASES:
        how = pa.plants.preset(kind)
        plain = pa.plants.Tree.grow(how.replace(leaves__droop=0.0), rng=0).leaves
        steps = how.leaves.steps
        at, normal = plain.position.reshape(-1, steps, 3), plain.normal.reshape(-1, steps, 3)
        error = float(np.abs(at[:, 1:] - at[:, :-1] - how.leaves.distance * normal[:, 1:]).max())
        seconds, triangles, leaves = [], [], []
        for seed in range(41):
            before = time.process_time()
            tree = pa.plants.Tree.grow(how, rng=seed)
            wood, foliage = tree.trunk, tree.leaves
            seconds.append(time.process_time() - before)
            triangles.append(2 * len(wood.quads))
            leaves.append(len(foliage))
        cost = float(np.median(seconds))
        what = f"{np.median(triangles):.0f} triangles, {np.median(leaves):.0f} leaves"
        yield Row(ROOM, f"tree, {kind}", what, "pleinair", cost, error, "units", 1.0)
        rival = ez_tree(theirs)
        if rival is not None:
            ratio = rival[0] / cost
            name = f"ez-tree, {theirs}, {rival[1]} triangles"
            yield Row(ROOM, f"tree, {kind}", what, name, rival[0], float("nan"), "units", ratio)


def nurbs() -> Iterable[Row]:
    from geomdl import NURBS
    from scipy.interpolate import NdBSpline

    rng = np.random.default_rng(0)
    grid = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0), indexing="ij"), axis=-1)
    points = np.concatenate([grid, rng.random((20, 20, 1))], axis=-1)
    knots = np.r_[np.zeros(3), np.linspace(0, 1, 18), np.ones(3)]
    uv = rng.random((2000, 2))
    ours = pa.plants.Surface.nurbs(points, None, (knots, knots))
    theirs = NURBS.Surface()
    theirs.degree_u = theirs.degree_v = 3
    theirs.ctrlpts2d = np.concatenate([points, np.ones((20, 20, 1))], axis=-1).tolist()
    theirs.knotvector_u = theirs.knotvector_v = knots.tolist()
    spline = NdBSpline((knots, knots), points, (3, 3))
    truth = np.array(theirs.evaluate_list(uv.tolist()))
    yield from race(
        ROOM,
        "NURBS surface, 2000 points; ours with normals",
        "20×20 control points, degree 3",
        {
            "pleinair": lambda: ours.at(uv),
            "scipy NdBSpline (no weights, no normals)": lambda: spline(uv),
            "geomdl (points alone)": lambda: theirs.evaluate_list(uv.tolist()),
        },
        {
            "pleinair": float(np.abs(ours.at(uv)[0] - truth).max()),
            "scipy NdBSpline (no weights, no normals)": float(np.abs(spline(uv) - truth).max()),
            "geomdl (points alone)": 0.0,
        },
        "m",
    )


def rows() -> Iterable[Row]:
    return itertools.chain(trees(), nurbs())

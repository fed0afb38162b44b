"""Hard cases of plants with a definite expectation: a right answer, or an error that names the argument."""

import dataclasses
import math
import os
import pickle
import subprocess
import sys

import numpy as np
import pleinair as pa
import pytest
import trimesh
from pleinair import _core
from pleinair.plants import (
    BranchParams,
    LeafParams,
    Strata,
    Surface,
    Tree,
    TreeParams,
    TrunkParams,
    square,
    subdivide,
)

NAN, INF = math.nan, math.inf
QUAD = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def closed(tree):
    mesh = tree.lod(0, subdivisions=1)
    body = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    return np.isfinite(mesh.vertices).all() and body.is_watertight and body.euler_number == 2


# Wild parameters: nothing folds, nothing is NaN.
@pytest.mark.parametrize("seed", range(4))
def test_huge_deviations_do_not_break_a_tree(seed):
    wild = {"length": (0.5, 5.0), "twist": (0, 500), "taper": (0.9, 10), "bend": 90, "roughness": 0.2}
    how = TreeParams(
        TrunkParams(**wild, steps=30, tropism=90),
        (BranchParams(**wild, probability=0.7, low=0, joint=(0.1, 5), joint_taper=(0.5, 9), tropism=-90, angle=180),),
        LeafParams(wobble=180, droop=90, variance=1, fade_length=(3, 100), threshold_sigma=10),
    )
    tree = Tree.grow(how, rng=seed)
    assert closed(tree)
    leaves = tree.leaves
    assert np.isfinite(leaves.position).all()
    assert (leaves.size > 0).all()
    assert (leaves.fade[:, 0] <= leaves.fade[:, 1]).all()
    assert np.allclose(np.linalg.norm(leaves.normal, axis=1), 1)
    axis = tree.rings["axis"]
    assert np.allclose(np.linalg.norm(axis, axis=1), 1)


def test_trees_of_next_to_nothing():
    stump = Tree.grow(TreeParams(TrunkParams(steps=0), ()), rng=1)
    assert len(stump.lod(0, subdivisions=0).quads) == 6
    assert len(stump.leaves) == 0
    assert stump.leaves.table().shape == (0,)
    assert stump.leaves.restyled(size=3).size.shape == (0, 2)
    assert len(stump.leaves.proxies().quads) == 0
    assert stump.bounds.shape == (2, 3)
    flat = Tree.grow(TreeParams(TrunkParams(max_length=0), ()), rng=1)
    assert len(flat.lod(0, subdivisions=0).quads) == 6
    one = Tree.grow(TreeParams(TrunkParams(steps=1), (), LeafParams(probability=1, steps=1, lowest_step=2)), rng=1)
    assert len(one.leaves) == 4
    still = Tree.grow(TreeParams(leaves=LeafParams(distance=0)), rng=1).leaves
    assert (still.branch_ratio == 0).all()
    assert len(Tree.grow(TreeParams(leaves=LeafParams(steps=0)), rng=1).leaves) == 0


def test_a_stem_ends_before_its_corners_meet():
    tree = Tree.grow(TreeParams(TrunkParams(steps=500, max_length=1e9, width=1.0, taper=0.5, length=0.3), ()), rng=1)
    corners = tree.lod(0, subdivisions=0).vertices.reshape(-1, 4, 3)
    assert np.linalg.norm(corners[:, 0] - corners[:, 2], axis=1).min() > 1e-7
    assert closed(tree)


def test_all_leaves_at_one_distance():
    how = TreeParams(TrunkParams(steps=1, width=1.0), (), LeafParams(probability=1, steps=1, lowest_step=2, distance=0))
    leaves = Tree.grow(how, rng=1).leaves
    assert np.isfinite(leaves.center_ratio).all()
    assert np.isfinite(leaves.fade).all()


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_extreme_units(unit):
    tree = Tree.grow(pa.plants.preset("oak", unit=unit), rng=1)
    assert closed(tree)
    plain = Tree.grow(pa.plants.preset("oak"), rng=1)
    assert np.allclose(tree.bounds / unit, plain.bounds, rtol=1e-5)
    assert np.allclose(tree.leaves.center_ratio, plain.leaves.center_ratio, atol=1e-4)


def test_too_large_a_tree_is_refused():
    bush = BranchParams(probability=1, low=0, steps=400, length=0.1, max_length=1e9, taper=1.0)
    trunk = TrunkParams(steps=5000, length=0.1, max_length=1e9, taper=1.0)
    with pytest.raises(ValueError, match="rings"):
        Tree.grow(TreeParams(trunk, (bush, bush)), rng=1)
    many = LeafParams(steps=60_000, probability=1, lowest_step=0)
    with pytest.raises(ValueError, match="leaves"):
        Tree.grow(TreeParams(TrunkParams(steps=2000, taper=1.0, max_length=1e9), (), many), rng=1).leaves


PARTS = {
    TrunkParams: {"width": 0, "steps": -1, "max_height": NAN, "length": (1, -1), "twist": 61, "taper": (1.1, 0), "bend": -1,
                  "roughness": 0.3, "tropism": 91, "max_length": INF},
    BranchParams: {"probability": 1.1, "low": NAN, "high": INF, "joint": 0, "joint_taper": 0, "angle": 181,
                   "profile": (1, -1, 1), "steps": 10**9, "length": NAN},
    LeafParams: {"lowest_step": -1, "probability": NAN, "angle": -1, "distance": INF, "steps": 60_001, "wobble": 181,
                 "droop": -1, "center": (0, 0, NAN), "size": (1, NAN), "variance": 2, "inside_growth": -1, "bias": 11,
                 "fade_length": (-1, 0), "fade_min": -1, "outer": 1.5, "threshold_sigma": -1},
    Strata: {"spans": (0, 5), "count": 0, "displacement": -1, "fade_from": 1.1, "fade_length": -0.1, "fade_min": 2,
             "unit": 0, "size": -1, "variance": 1.5, "inside_growth": NAN},
    TreeParams: {"unit": 0},
}  # fmt: skip


@pytest.mark.parametrize(("kind", "name"), [(k, n) for k, names in PARTS.items() for n in names])
def test_parameters_out_of_range_are_named(kind, name):
    with pytest.raises(ValueError, match=name):
        kind(**{name: PARTS[kind][name]})


@pytest.mark.parametrize(("kind", "name"), [(k, f.name) for k in PARTS for f in dataclasses.fields(k)])
def test_parameters_of_the_wrong_kind_are_refused(kind, name):
    with pytest.raises((TypeError, ValueError)):
        kind(**{name: object()})
    with pytest.raises((TypeError, ValueError)):
        kind(**{name: {"a": 1}})


def test_wrong_json_is_refused():
    for text in ("", "[]", "{", '{"nose": 1}', '{"leaves": {"nose": 1}}', '{"trunk": {"width": NaN}}', '{"trunk": 3}',
                 '{"branches": [3]}', '{"leaves": {"size": "big"}}'):  # fmt: skip
        with pytest.raises(ValueError, match="text"):
            TreeParams.from_json(text)
        with pytest.raises(ValueError, match="text"):
            Strata.from_json(text.replace("leaves", "nose").replace("trunk", "nose").replace("branches", "nose"))
    with pytest.raises(TypeError, match="text"):
        TreeParams.from_json(3)


def test_wrong_changes_are_refused():
    for changes in ({"nose": 1}, {"leaves__nose": 1}, {"nose__size": 1}, {"leaves__probability": "x"}):
        with pytest.raises(TypeError):
            TreeParams().replace(**changes)
    leaves = Tree.grow(rng=1).leaves
    with pytest.raises(ValueError, match="changes"):
        leaves.restyled(distance=3)
    with pytest.raises(ValueError, match="which"):
        leaves.select(np.ones(3, bool))
    with pytest.raises(ValueError, match="which"):
        leaves.select([10**9])
    with pytest.raises(TypeError, match="which"):
        leaves.select([0.5])
    with pytest.raises(ValueError, match="name"):
        pa.plants.preset("lamp post")


@pytest.mark.parametrize("rng", ["x", True, 1.5, [-1]])
def test_wrong_rng_is_named(rng):
    for call in (lambda: Tree.grow(rng=rng), lambda: Surface.heightfield(np.zeros((2, 2))).emit(rng=rng)):
        with pytest.raises((TypeError, ValueError)):
            call()
    with pytest.raises((TypeError, ValueError)):
        Tree.grow(rng=1).regrow(leaves="x")


def test_every_rng_of_spec_7():
    seeds = [1, np.random.SeedSequence(1), np.random.PCG64(1), np.random.default_rng(1)]
    trees = [Tree.grow(rng=rng) for rng in seeds]
    assert all(t.seeds == trees[0].seeds for t in trees[1:])
    assert Tree.grow().seeds != Tree.grow().seeds
    generator = np.random.default_rng(1)
    assert Tree.grow(rng=generator) != Tree.grow(rng=generator)


def test_trees_of_wrong_seeds():
    for seeds in ((1, 2), (1, 2, -1), (1, 2, 2**64), (1, 2, 0.5), 7):
        with pytest.raises((TypeError, ValueError), match="seeds"):
            Tree(TreeParams(), seeds)
    with pytest.raises(TypeError, match="params"):
        Tree.grow({"unit": 1})


# B2 with no area.
@pytest.mark.parametrize(
    "quad",
    [np.zeros((4, 3)), [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], [[1, 2, 3]] * 4, [[0, 0, 0], [1, 0, 0]] * 2],
)
def test_quadrilaterals_without_area(quad):
    with pytest.raises(ValueError, match="quad"):
        square(quad)


@pytest.mark.parametrize("scale", [1e-150, 1e-30, 1e30, 1e150])
def test_squares_of_any_size(scale):
    quad = np.array([[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1, 0]]) * scale
    assert np.allclose(square(quad) / scale, [[0.75, -0.75, 0], [3.25, -0.75, 0], [3.25, 1.75, 0], [0.75, 1.75, 0]])


def test_squares_of_three_corners_and_of_nonsense():
    # Two corners in one: still an area.
    got = square([[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]])
    sides = np.roll(got, -1, axis=0) - got
    assert np.allclose(np.sum(sides**2, axis=1), np.sum(sides[0] ** 2)), "equal sides"
    assert np.allclose(np.sum(sides * np.roll(sides, -1, axis=0), axis=1), 0), "right angles"
    assert np.allclose(got.mean(axis=0), [0.5, 0.25, 0]), "about the corners' mean"
    for bad in (np.zeros((3, 3)), [[NAN, 0, 0], *QUAD[1:]], "x", None):
        with pytest.raises((TypeError, ValueError), match="quad"):
            square(bad)


def test_meshes_that_cannot_be_subdivided():
    fan = np.array([*QUAD, [0, 0, 1], [1, 0, 1], [0, 0, -1], [1, 0, -1]], float)
    with pytest.raises(ValueError, match="more than two faces"):
        subdivide(fan, [[0, 1, 2, 3], [1, 0, 4, 5], [0, 1, 7, 6]], 1)
    for faces, error in (([[0, 1, 2, 9]], ValueError), ([[0, 1, 2, -1]], ValueError), ([[0.5, 1, 2, 3]], TypeError),
                         ([[0, 1, 2]], ValueError), ([0, 1, 2, 3], ValueError)):  # fmt: skip
        with pytest.raises(error, match="faces"):
            subdivide(QUAD, faces, 1)
    with pytest.raises(ValueError, match="vertices"):
        subdivide([[0, 0, NAN], *QUAD[1:]], [[0, 1, 2, 3]])
    with pytest.raises(ValueError, match="levels"):
        subdivide(QUAD, [[0, 1, 2, 3]], 11)
    empty = subdivide(np.zeros((0, 3)), np.zeros((0, 4), int), 3)
    assert empty.vertices.shape == (0, 3)
    # A vertex that no face uses stays.
    lone = subdivide([*QUAD, [9, 9, 9]], [[0, 1, 2, 3]], 2)
    assert lone.vertices[4].tolist() == [9, 9, 9]
    # Two sheets that meet in a point.
    bow = subdivide([*QUAD, [2, 1, 0], [2, 2, 0], [1, 2, 0]], [[0, 1, 2, 3], [2, 4, 5, 6]], 2)
    assert bow.vertices[2].tolist() == [1, 1, 0]


def test_surfaces_of_wrong_arrays():
    for z in (np.zeros((1, 5)), np.zeros((0, 0)), np.zeros(5), [[0, NAN], [0, 0]], [[0, INF], [0, 0]]):
        with pytest.raises(ValueError, match="z must"):
            Surface.heightfield(z)
    for z in ([["a", "b"], ["c", "d"]], np.zeros((2, 2), complex), None):
        with pytest.raises((TypeError, ValueError), match="z must"):
            Surface.heightfield(z)
    for spacing in (0, -1, NAN, (1, 0), (1, 2, 3), "x"):
        with pytest.raises((TypeError, ValueError), match="spacing"):
            Surface.heightfield(np.zeros((2, 2)), spacing)
    with pytest.raises(ValueError, match="origin"):
        Surface.heightfield(np.zeros((2, 2)), 1, (0, 0))
    for faces in ([[0, 1, 4]], [[0, 1, -1]], [[0, 1]]):
        with pytest.raises(ValueError, match="faces"):
            Surface.mesh(QUAD, faces)
    with pytest.raises(ValueError, match="vertices"):
        Surface.mesh([[NAN, 0, 0], *QUAD[1:]], [[0, 1, 2]])
    with pytest.raises(TypeError, match="Surface"):
        Surface()


def test_meshes_without_area_bear_nothing():
    for vertices, faces in ((np.zeros((3, 3)), [[0, 1, 2]]), (QUAD, np.zeros((0, 3), int)), (np.zeros((0, 3)), [])):
        with pytest.raises(ValueError, match="area"):
            Surface.mesh(vertices, faces).emit(rng=1)
    # Flat triangles among others get none.
    mixed = Surface.mesh(QUAD, [[0, 0, 0], [0, 1, 2], [1, 1, 2], [0, 2, 3], [3, 3, 3]])
    p = mixed.emit(Strata(spans=(20, 20)), rng=1)
    assert set(p.face) == {1, 3}
    with pytest.raises(ValueError, match="mesh"):
        mixed.at([[0.5, 0.5]])


KNOTS = [0, 0, 0, 0, 1, 1, 1, 1]


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"points": np.full((4, 4, 3), NAN)}, "points"),
        ({"points": np.zeros((4, 4))}, "points"),
        ({"weights": np.zeros((4, 4))}, "weights"),
        ({"weights": np.ones((4, 3))}, "weights"),
        ({"weights": np.full((4, 4), INF)}, "weights"),
        ({"knots": (KNOTS, KNOTS[:-1])}, "knots_v"),
        ({"knots": (KNOTS[::-1], KNOTS)}, "knots_u"),
        ({"knots": ([0] * 8, KNOTS)}, "knots_u"),
        ({"knots": ([0, 0, 0, 0, NAN, 1, 1, 1], KNOTS)}, "knots_u"),
        ({"knots": (KNOTS,)}, "knots"),
        ({"degree": 4}, "degree"),
        ({"degree": 0}, "degree"),
        ({"degree": (3, 3, 3)}, "degree"),
        ({"degree": 16}, "degree"),
    ],
)
def test_nurbs_that_are_none(changes, name):
    good = {"points": np.random.default_rng(0).random((4, 4, 3)), "weights": np.ones((4, 4)), "knots": (KNOTS, KNOTS)}
    Surface.nurbs(**good)
    with pytest.raises(ValueError, match=name):
        Surface.nurbs(**{**good, **changes})


def test_degenerate_nurbs():
    # A cone's tip: the normal is the limit from inside, finite and of length 1.
    tip = np.zeros((3, 2, 3))
    tip[:, 1] = [[1, 0, 1], [0, 1, 1], [-1, 0, 1]]
    at, normals = Surface.nurbs(tip, degree=(2, 1)).at([[0.5, 0], [0, 0], [1, 0]])
    assert np.allclose(at, 0)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1)
    # A surface that is a line, or a point, has no normal: the zenith.
    for points in (np.zeros((2, 2, 3)), np.array([[[0, 0, 0], [0, 0, 0]], [[1, 0, 0], [1, 0, 0]]], float)):
        assert Surface.nurbs(points, degree=1).at([[0.3, 0.6]])[1].tolist() == [[0, 0, 1]]
    # Tiny and huge.
    flat = np.array([[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]], float)
    for scale in (1e-100, 1e100):
        assert np.allclose(Surface.nurbs(flat * scale, degree=1).at([[0.3, 0.6]])[1], [[0, 0, 1]])


def test_places_outside_a_surface():
    hill = Surface.heightfield(np.zeros((2, 2)))
    for uv in ([[1.1, 0]], [[-0.1, 0]], [[NAN, 0]]):
        with pytest.raises(ValueError, match="uv"):
            hill.at(uv)
    assert hill.at(np.zeros((0, 2)))[0].shape == (0, 3)
    corners, _ = hill.at([[0, 0], [1, 0], [0, 1], [1, 1]])
    assert corners.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]


def test_particles_on_a_surface_of_another_make():
    p = Surface.heightfield(np.zeros((3, 3))).emit(rng=1)
    nurbs = Surface.nurbs(np.random.default_rng(0).random((4, 4, 3)))
    for other in (Surface.heightfield(np.zeros((4, 3))), nurbs):
        with pytest.raises(ValueError, match="surface"):
            p.on(other)
    with pytest.raises(ValueError, match="surface"):
        nurbs.emit(rng=1).on(Surface.heightfield(np.zeros((3, 3))))
    with pytest.raises(TypeError, match="surface"):
        p.on(None)


def test_too_many_particles_are_refused():
    with pytest.raises(ValueError, match="particles"):
        Surface.heightfield(np.zeros((2, 2))).emit(Strata(spans=(10**6, 10**6), count=10**6), rng=1)


def test_inputs_of_every_layout_give_the_same_bits():
    r = np.random.default_rng(0)
    z = r.random((8, 6))
    want = Surface.heightfield(z).emit(rng=1).position.tobytes()
    wide = np.empty((8, 12))
    wide[:, ::2] = z
    frozen = z.copy()
    frozen.setflags(write=False)
    for same in (wide[:, ::2], np.asfortranarray(z), frozen, z.astype(">f8"), z.tolist()):
        assert Surface.heightfield(same).emit(rng=1).position.tobytes() == want
    keep = frozen.copy()
    Surface.heightfield(frozen).emit(rng=2)
    assert np.array_equal(keep, frozen)
    body = trimesh.creation.icosphere(1)
    mesh = Surface.mesh(body.vertices, body.faces).emit(rng=1).position.tobytes()
    for faces in (
        body.faces.astype(np.int32),
        body.faces.astype(">u8"),
        np.asfortranarray(body.faces),
        body.faces.tolist(),
    ):
        assert Surface.mesh(np.asfortranarray(body.vertices), faces).emit(rng=1).position.tobytes() == mesh
    # What is given can be changed afterwards.
    mine = np.array(body.vertices)
    surface = Surface.mesh(mine, body.faces)
    mine[:] = 0
    assert surface.emit(rng=1).position.tobytes() == mesh


def test_far_from_the_origin_particles_keep_their_digits():
    z = np.random.default_rng(0).random((9, 9))
    near, far = Surface.heightfield(z), Surface.heightfield(z, origin=(1e5, -1e5, 1e3))
    a, b = near.emit(rng=1), far.emit(rng=1)
    assert np.allclose(b.position - [1e5, -1e5, 1e3], a.position, atol=1e-9)
    assert np.allclose(b.normal, a.normal, atol=1e-8)


def test_results_cannot_be_changed():
    tree = Tree.grow(rng=1)
    p = Surface.heightfield(np.zeros((2, 2))).emit(rng=1)
    for one in (tree.leaves.position, tree.trunk.vertices, tree.stems, tree.rings, p.position, tree.leaves.fade):
        with pytest.raises(ValueError, match="read-only"):
            one[0] = 0
    for thing in (tree.leaves, p, tree.trunk, Surface.heightfield(np.zeros((2, 2)))):
        again = pickle.loads(pickle.dumps(thing))
        for name, value in vars(thing).items():
            if isinstance(value, np.ndarray):
                other = getattr(again, name)
                assert np.array_equal(other, value)
                assert not other.flags.writeable
    with pytest.raises(dataclasses.FrozenInstanceError):
        tree.params = None


@pytest.mark.parametrize("level", _core.simd_levels())
def test_simd_levels_do_not_change_bits(level):
    tree = Tree.grow(pa.plants.preset("willow"), rng=1)
    want = tree.leaves.table().tobytes() + tree.trunk.vertices.tobytes()
    _core.force_simd_level(level)
    again = Tree.grow(pa.plants.preset("willow"), rng=1)
    assert again.leaves.table().tobytes() + again.trunk.vertices.tobytes() == want


def test_a_process_of_its_own_grows_the_same_tree():
    code = (
        "import pleinair as pa, hashlib; t = pa.plants.Tree.grow(pa.plants.preset('oak'), rng=5); "
        "print(hashlib.sha256(t.leaves.table().tobytes() + t.trunk.vertices.tobytes()).hexdigest())"
    )
    runs = [
        subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "RAYON_NUM_THREADS": n},
        ).stdout
        for n in ("1", "3")
    ]
    assert runs[0] == runs[1]


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path, monkeypatch):
    tree = Tree.grow(rng=1)
    for name in ("tree.fbx", "tree", "tree.glb.txt"):
        with pytest.raises(ValueError, match="path"):
            tree.export(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        tree.export(tmp_path / "nowhere" / "tree.glb")
    with pytest.raises(ValueError, match="leaves"):
        tree.export(tmp_path / "tree.glb", leaves="balls")
    old = tmp_path / "old.glb"
    old.write_bytes(b"old")
    monkeypatch.setattr("pleinair.io.meshes._corners", lambda faces: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        tree.export(old)
    assert old.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["old.glb"]


@pytest.mark.parametrize("suffix", ["glb", "ply", "obj"])
@pytest.mark.parametrize("leaves", ["cards", "points"])
def test_files_of_bare_and_oddly_named_trees(tmp_path, suffix, leaves):
    how = TreeParams(TrunkParams(steps=0), (), name="Bäume\nend_header\n\x00木")
    tree = Tree.grow(how, rng=1)
    path = tree.export(tmp_path / f"tree.{suffix}", leaves=leaves, proxies=True)
    read = trimesh.load(path, process=False)
    mesh = next(iter(read.geometry.values())) if hasattr(read, "geometry") else read
    assert len(mesh.vertices) == len(tree.trunk.vertices)


@pytest.mark.parametrize(
    "stem",
    [
        ([[0, 0, 0]], [1]),
        ([[0, 0, 0], [0, 0, 0]], [1, 1]),
        ([[0, 0, 0], [0, 0, 1]], [1, 0]),
        ([[0, 0, 0], [0, 0, NAN]], [1, 1]),
        ([[0, 0, 0], [0, 0, 1]], [1, 1, 1]),
        ([[0, 0], [0, 1]], [1, 1]),
        ([[0, 0, 0], [0, 0, 1]],),
        ([[0, 0, 0], [0, 0, 1]], [1, 1], -1),
        5,
    ],
)
def test_stems_that_are_none(stem):
    with pytest.raises((TypeError, ValueError), match="stem"):
        Tree.from_stems([stem], rng=1)
    with pytest.raises(ValueError, match="stems"):
        Tree.from_stems([], rng=1)


def test_a_stem_that_turns_back():
    mesh = Tree.from_stems([([[0, 0, 0], [0, 0, 1], [0, 0, 0.5], [1, 0, 0.5]], [0.1] * 4)], rng=1).trunk
    body = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert body.is_watertight
    assert body.euler_number == 2

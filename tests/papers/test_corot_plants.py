"""What the corot paper says of trees (IV.3) and of strokes on surfaces (IV.7), statement by statement.

Counts, areas and volumes are judged by trimesh, statistics by scipy, the rest by closed forms.
"""

import math
import pickle

import numpy as np
import pleinair as pa
import pytest
import scipy.optimize
import scipy.stats
import trimesh
from pleinair.plants import BranchParams, LeafParams, Strata, Surface, Tree, TreeParams, TrunkParams

# Deviation of a normal cut off at three deviations.
CUT = math.sqrt(1 - 6 * scipy.stats.norm.pdf(3) / (1 - 2 * scipy.stats.norm.cdf(-3)))


def params(*, trunk=None, branches=(), leaves=None, **rest):
    """A trunk that is regular unless told otherwise, no branches."""
    plain = {
        "width": 1.0,
        "steps": 10,
        "max_length": 1e6,
        "length": 1.0,
        "twist": 0.0,
        "taper": 1.0,
        "bend": 0.0,
        "roughness": 0.0,
    }
    levels = tuple(
        BranchParams(
            **{"joint": 0.05, "joint_taper": 0.5, "angle": 90.0, "profile": (1, 1, 1), "low": 0.0, **plain_stem, **b}
        )
        for b in branches
    )
    return TreeParams(TrunkParams(**{**plain, **(trunk or {})}), levels, LeafParams(**(leaves or {})), **rest)


plain_stem = {
    "steps": 5,
    "max_length": 1e6,
    "length": 0.5,
    "twist": 0.0,
    "taper": 0.9,
    "bend": 0.0,
    "roughness": 0.0,
    "tropism": 0.0,
}


def solid(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


def edges(mesh):
    sides = np.sort(np.stack([mesh.quads, np.roll(mesh.quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    return np.unique(sides, axis=0, return_counts=True)


# T1: V = 8 + 4 n, F = 6 + 4 n, E = 12 + 8 n, closed, all quadrilaterals.
@pytest.mark.parametrize("n", [0, 1, 7, 40])
def test_a_trunk_is_a_cube_extruded(n):
    cage = Tree.grow(params(trunk={"steps": n, "bend": 5, "roughness": 0.05}), rng=3).lod(0, subdivisions=0)
    found, shared = edges(cage)
    assert (len(cage.vertices), len(cage.quads), len(found)) == (8 + 4 * n, 6 + 4 * n, 12 + 8 * n)
    assert (shared == 2).all()
    body = solid(cage)
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.euler_number == 2
    assert body.volume > 0


def test_a_trunk_ends_at_its_length_or_height():
    tree = Tree.grow(params(trunk={"max_length": 6.3, "bend": 8, "steps": 100}), rng=1)
    steps = np.linalg.norm(np.diff(tree.rings["center"], axis=0), axis=1)
    assert steps.sum() == pytest.approx(6.3, abs=1e-12)
    low = Tree.grow(params(trunk={"max_height": 4.5}), rng=1)
    assert low.bounds[1, 2] >= 4.5
    assert low.rings["center"][-2, 2] < 4.5
    assert len(Tree.grow(params(trunk={"steps": 3}), rng=1).rings) == 2 + 3


@pytest.mark.parametrize("kind", pa.plants.presets())
def test_the_whole_tree_is_one_closed_surface(kind):
    tree = Tree.grow(pa.plants.preset(kind), rng=5)
    for level, subdivisions in ((0, 0), (0, 1), (1, None), (2, None), (9, 1)):
        body = solid(tree.lod(level, subdivisions=subdivisions))
        assert body.is_watertight, (level, subdivisions)
        assert body.is_winding_consistent
        assert body.euler_number == 2
        assert body.volume > 0


# T2: a unit that doubles doubles every coordinate, bit for bit.
@pytest.mark.parametrize("unit", [2.0, 0.125, 1024.0])
def test_powers_of_two_scale_exactly(unit):
    one = Tree.grow(pa.plants.preset("oak"), rng=1)
    other = Tree.grow(pa.plants.preset("oak", unit=unit), rng=1)
    assert np.array_equal(one.trunk.vertices * unit, other.trunk.vertices)
    assert np.array_equal(one.trunk.quads, other.trunk.quads)
    assert np.array_equal(one.leaves.position * unit, other.leaves.position)
    assert np.array_equal(one.leaves.normal, other.leaves.normal)
    assert np.array_equal(one.leaves.size * np.float32(unit), other.leaves.size)
    assert np.array_equal(one.leaves.label, other.leaves.label)
    assert np.array_equal(one.leaves.id, other.leaves.id)


# T3: base + gaussian variation, cut off at three deviations.
def test_steps_have_the_statistics_they_are_asked_for():
    n = 10_000
    # A taper so near 1 that a trunk of 10 000 steps has a width left.
    asked = {"length": (2.0, 0.2), "twist": (7.0, 3.0), "taper": (0.9998, 0.00005), "bend": 2.0}
    tree = Tree.grow(params(trunk={"steps": n, "width": 1.0, **asked}), rng=11)
    rings = tree.rings
    # Measured on the mesh, not taken from the record of what was drawn.
    corners = tree.lod(0, subdivisions=0).vertices.reshape(-1, 4, 3)
    centers = corners.mean(axis=1)
    length = np.linalg.norm(np.diff(centers, axis=0), axis=1)[1:]
    width = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    taper = (width[1:] / width[:-1])[1:]
    axis = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    tilt = np.degrees(2 * np.arcsin(0.5 * np.linalg.norm(np.diff(axis, axis=0), axis=1)))[1:]
    arm = corners[:, 0] - centers
    arm /= np.linalg.norm(arm, axis=1, keepdims=True)
    twist = []
    for a, b, u, v in zip(axis[1:], axis[2:], arm[1:], arm[2:], strict=False):
        # Carried along by the smallest turn that takes one axis to the other.
        w = np.cross(a, b)
        moved = u + np.cross(w, u) + np.cross(w, np.cross(w, u)) / (1 + a @ b)
        twist.append(math.degrees(math.atan2(np.cross(moved, v) @ b, moved @ v)))
    for name, seen, (base, sigma) in (
        ("length", length, asked["length"]),
        ("twist", np.array(twist), asked["twist"]),
        ("taper", taper, asked["taper"]),
    ):
        deviation = sigma * CUT
        assert abs(seen.mean() - base) < 4 * deviation / math.sqrt(n), name
        kurtosis_error = deviation / math.sqrt(2 * n)
        assert abs(seen.std() - deviation) < 4 * kurtosis_error, name
        assert np.abs(seen - base).max() <= 3 * sigma * (1 + 1e-6), name
        # The record is what was built.
        assert np.allclose(rings[name][2:], seen, rtol=1e-6, atol=1e-6), name
    # The tilt is the absolute value of a normal angle.
    assert abs(math.sqrt((tilt**2).mean()) - 2.0 * CUT) < 4 * 2.0 / math.sqrt(2 * n)


def test_without_variation_a_tree_is_regular():
    cage = Tree.grow(params(trunk={"twist": 0, "taper": 0.9, "steps": 6}), rng=1).lod(0, subdivisions=0)
    other = Tree.grow(params(trunk={"twist": 0, "taper": 0.9, "steps": 6}), rng=99).lod(0, subdivisions=0)
    assert np.array_equal(cage.vertices, other.vertices)
    rings = cage.vertices.reshape(-1, 4, 3)
    width = 1.0 * 0.9 ** np.r_[0, np.arange(7)]
    assert np.allclose(np.abs(rings[..., :2]), 0.5 * width[:, None, None], atol=1e-13)
    assert np.allclose(rings[..., 2], np.r_[0, np.arange(1, 8)][:, None], atol=1e-13)


# T4: roughness makes faces that are neither square nor planar; without it the sections are squares.
def test_roughness_unmakes_squares():
    def unlike(rough):
        tree = Tree.grow(params(trunk={"roughness": rough, "twist": 5}), rng=2)
        r = tree.lod(0, subdivisions=0).vertices.reshape(-1, 4, 3)[2:]
        side = np.linalg.norm(r - np.roll(r, -1, axis=1), axis=2)
        return (side.max(axis=1) / side.min(axis=1) - 1).max()

    assert unlike(0.0) < 1e-12
    assert unlike(0.05) > 0.05


# T5: the area of sections never grows outwards, along the trunk and from trunk to branch.
@pytest.mark.parametrize("kind", ["oak", "pine", "thesis"])
def test_sections_only_shrink(kind):
    tree = Tree.grow(pa.plants.preset(kind), rng=8)
    rings = tree.lod(0, subdivisions=0).vertices.reshape(-1, 4, 3)
    area = 0.5 * np.linalg.norm(np.cross(rings[:, 2] - rings[:, 0], rings[:, 3] - rings[:, 1]), axis=1)
    for stem in tree.stems:
        mine = area[stem["begin"] // 4 : stem["end"] // 4]
        assert (np.diff(mine) <= 1e-12 * mine[0]).all()
        if stem["level"] > 0:
            first = tree.stems[stem["parent"]]["begin"] // 4 + stem["ring"]
            k, j = stem["side"], (stem["side"] + 1) % 4
            quad = [rings[first, k], rings[first, j], rings[first + 1, j], rings[first + 1, k]]
            face = 0.5 * np.linalg.norm(np.cross(quad[2] - quad[0], quad[3] - quad[1]))
            assert mine[0] <= face * (1 + 1e-12)


# T6: subdivision makes four faces of one, and stems round.
def test_subdivided_stems_are_round():
    tree = Tree.grow(params(trunk={"steps": 12, "twist": 0.0}), rng=1)
    cage, smooth = tree.lod(0, subdivisions=0), tree.trunk
    assert len(smooth.quads) == 16 * len(cage.quads)
    middle = (smooth.vertices[:, 2] > 4) & (smooth.vertices[:, 2] < 9)
    radius = np.linalg.norm(smooth.vertices[middle, :2], axis=1)
    assert radius.max() / radius.min() <= 1.05
    # The cubic B-spline of a square: 2/3 of its half diagonal at the corners, 11/24 of its side between.
    assert radius.max() == pytest.approx(2 / 3 * math.sqrt(0.5), rel=0.05)


# T7: levels of detail come from one skeleton.
@pytest.mark.parametrize("kind", ["oak", "poplar", "bare"])
def test_coarse_trunks_are_cut_from_the_same_rings(kind):
    tree = Tree.grow(pa.plants.preset(kind), rng=4)
    fine = tree.lod(0, subdivisions=0)
    known = {v.tobytes() for v in fine.vertices}
    before = len(fine.quads)
    for level in (1, 2, 3):
        coarse = tree.lod(level, subdivisions=0)
        assert all(v.tobytes() in known for v in coarse.vertices), "no vertex is new"
        assert len(coarse.quads) < before
        before = len(coarse.quads)
        # Base and tip of every stem stay.
        for k, stem in enumerate(tree.stems):
            own = coarse.vertices[coarse.branch_id == k]
            assert np.array_equal(own[:4], fine.vertices[stem["begin"] : stem["begin"] + 4])
            assert np.array_equal(own[-4:], fine.vertices[stem["end"] - 4 : stem["end"]])
    assert len(tree.lod(1, subdivisions=0).quads) < 0.75 * len(fine.quads)


# T8: levels of branches.
def test_levels_of_branches():
    two = params(branches=[{"probability": 0.5}, {"probability": 0.5, "steps": 2}], trunk={"steps": 8})
    tree = Tree.grow(two, rng=2)
    assert set(tree.stems["level"]) == {0, 1, 2}
    for stem in tree.stems[1:]:
        assert tree.stems[stem["parent"]]["level"] == stem["level"] - 1
    assert (np.diff(tree.stems["level"].astype(int)) >= 0).all()
    assert len(Tree.grow(params(), rng=2).stems) == 1


# T9, L6: same parameters and seeds, same bits; only the seed changed: a sibling.
def test_seeds_decide():
    how = pa.plants.preset("birch")
    a, b, c = Tree.grow(how, rng=1), Tree.grow(how, rng=1), Tree.grow(how, rng=2)
    assert a == b
    assert a != c
    assert a.trunk.vertices.tobytes() == b.trunk.vertices.tobytes()
    assert a.leaves.table().tobytes() == b.leaves.table().tobytes()
    assert a.leaves.table().tobytes() != c.leaves.table().tobytes()
    assert a.trunk.vertices.shape != c.trunk.vertices.shape or not np.array_equal(a.trunk.vertices, c.trunk.vertices)
    # Siblings: alike in size.
    assert 0.5 < len(a.leaves) / len(c.leaves) < 2
    assert np.allclose(a.bounds[1, 2], c.bounds[1, 2], rtol=0.3)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_do_not_change_bits(threads):
    how = pa.plants.preset("oak", leaves__steps=60)
    pa.set_num_threads(threads)
    tree = Tree.grow(how, rng=1)
    leaves = tree.leaves.table().tobytes()
    hill = Surface.heightfield(np.random.default_rng(0).random((20, 30))).emit(Strata(spans=(90, 90)), rng=1)
    pa.set_num_threads(1)
    assert Tree.grow(how, rng=1).leaves.table().tobytes() == leaves
    again = Surface.heightfield(np.random.default_rng(0).random((20, 30))).emit(Strata(spans=(90, 90)), rng=1)
    assert again.position.tobytes() == hill.position.tobytes()


# B1: every face within the heights is tested.
def test_branches_are_bernoulli_trials():
    def count(p, seed=1, low=2.0, high=30.0):
        how = params(
            trunk={"steps": 60, "twist": 3}, branches=[{"probability": p, "low": low, "high": high, "steps": 0}]
        )
        return Tree.grow(how, rng=seed)

    cage = count(0.0).lod(0, subdivisions=0)
    sides = cage.vertices[cage.quads[1:-1]].mean(axis=1)[:, 2]
    n = int(((sides >= 2.0) & (sides <= 30.0)).sum())
    assert len(count(0.0).stems) == 1
    assert len(count(1.0).stems) == 1 + n
    seen = np.array([len(count(0.3, seed).stems) - 1 for seed in range(40)])
    assert abs(seen.sum() - 40 * n * 0.3) < 4 * math.sqrt(40 * n * 0.3 * 0.7)
    # Ends are no sides.
    assert len(count(1.0, low=-10, high=1e9).stems) == 1 + 4 * 61


def test_branches_start_within_their_heights():
    tree = Tree.grow(params(trunk={"steps": 30}, branches=[{"probability": 1, "low": 5.2, "high": 9.9}]), rng=1)
    cage = tree.lod(0, subdivisions=0)
    for stem in tree.stems[1:]:
        ring = tree.stems[0]["begin"] // 4 + stem["ring"]
        quad = cage.vertices.reshape(-1, 4, 3)[[ring, ring + 1]]
        assert 5.2 <= quad[..., 2].mean() <= 9.9


# B2: the first face of a branch is planar and square.
def test_first_faces_of_branches_are_squares():
    tree = Tree.grow(pa.plants.preset("oak", trunk__roughness=0.1, trunk__bend=12), rng=3)
    rings = tree.lod(0, subdivisions=0).vertices.reshape(-1, 4, 3)
    for stem in tree.stems[1:]:
        q = rings[stem["begin"] // 4]
        edge = np.linalg.norm(q - np.roll(q, -1, axis=0), axis=1)
        assert np.ptp(edge) < 1e-9 * edge[0]
        diagonals = np.linalg.norm(q[2] - q[0]), np.linalg.norm(q[3] - q[1])
        assert diagonals[0] == pytest.approx(diagonals[1], rel=1e-9)
        normal = np.cross(q[1] - q[0], q[2] - q[1])
        assert abs((q[3] - q[0]) @ normal) < 1e-6 * edge[0] ** 3


@pytest.mark.parametrize("seed", range(8))
def test_the_nearest_square_is_that_of_least_squares(seed):
    r = np.random.default_rng(seed)
    quad = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]) + 0.5 * r.standard_normal((4, 3))
    got = pa.plants.square(quad)
    center = quad.mean(axis=0)
    assert np.allclose(got.mean(axis=0), center, atol=1e-12)
    normal = np.cross(quad[2] - quad[0], quad[3] - quad[1])
    normal /= np.linalg.norm(normal)
    assert np.abs((got - center) @ normal).max() < 1e-12
    u = np.cross(normal, [1.0, 0, 0])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    flat = (quad - center) @ np.stack([u, v], axis=1)
    turns = [np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), k) for k in range(4)]

    def error(arm):
        return np.concatenate([turn @ arm - p for turn, p in zip(turns, flat, strict=True)])

    best = scipy.optimize.least_squares(error, [1.0, 0.0], xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    mine = (got - center) @ np.stack([u, v], axis=1)
    assert np.allclose(mine[0], best, atol=1e-9)
    # Idempotent.
    assert np.allclose(pa.plants.square(got), got, atol=1e-12)


# B3, Fig. 12: a smaller first step bulges less.
def test_a_small_joint_bulges_less():
    volumes = []
    for joint in (0.8, 0.4, 0.2, 0.1, 0.05, 0.02):
        # Branches of one ring of faces, of the same length whatever the joint.
        branch = {"probability": 1, "low": 4.2, "high": 5, "joint": joint, "max_length": 4, "taper": 1.0, "steps": 40}
        tree = Tree.grow(params(trunk={"steps": 9}, branches=[branch]), rng=1)
        assert len(tree.stems) == 5
        volumes.append(solid(tree.trunk).volume)
    assert (np.diff(volumes) < 0).all()


# B4: branches end at their length.
def test_branches_end_at_their_length():
    branch = {"probability": 1, "max_length": (3.0, 0.4), "steps": 100, "bend": 5, "length": (0.4, 0.05)}
    tree = Tree.grow(params(trunk={"steps": 150}, branches=[branch]), rng=1)
    ends = np.array([tree.rings["along"][s["end"] // 4 - 1] for s in tree.stems[1:]])
    n = len(ends)
    assert n > 500
    # A stem that has less than a fiftieth of a step to go ends.
    assert abs(ends.mean() - 3.0) < 4 * 0.4 / math.sqrt(n) + 0.4 / 50
    assert np.abs(ends - 3).max() <= 3 * 0.4 + 1e-9


# B5: new branches, same trunk; new leaves, same wood.
def test_parts_have_seeds_of_their_own():
    tree = Tree.grow(pa.plants.preset("poplar"), rng=1)
    own = tree.stems[0]["end"]
    wood, leaves = tree.lod(0, subdivisions=0), tree.leaves
    other = tree.regrow(branches=7)
    assert np.array_equal(other.lod(0, subdivisions=0).vertices[:own], wood.vertices[:own])
    assert not np.array_equal(other.stems, tree.stems)
    leafy = tree.regrow(leaves=7)
    assert leafy.trunk.vertices.tobytes() == tree.trunk.vertices.tobytes()
    assert not np.array_equal(leafy.leaves.position[:50], leaves.position[:50])
    # Another trunk: the branches' and leaves' seeds stay.
    assert tree.regrow(trunk=7).seeds[1:] == tree.seeds[1:]
    # A part that is not there takes nothing from the others.
    bare = Tree(tree.params.replace(branches=()), tree.seeds)
    assert np.array_equal(bare.lod(0, subdivisions=0).vertices, wood.vertices[:own])


def test_a_branch_keeps_its_shape_when_others_go():
    how = params(trunk={"steps": 20}, branches=[{"probability": 0.8, "bend": 5}])
    many = Tree.grow(how, rng=1)
    few = Tree(how.replace(branches__probability=0.3), many.seeds)

    def by_face(tree):
        cage = tree.lod(0, subdivisions=0).vertices
        return {(s["ring"], s["side"]): cage[s["begin"] : s["end"]].tobytes() for s in tree.stems[1:]}

    a, b = by_face(many), by_face(few)
    assert b.keys() < a.keys()
    assert all(a[k] == b[k] for k in b)


# B6: where each branch begins and ends.
def test_vertices_know_their_branch():
    tree = Tree.grow(pa.plants.preset("thesis"), rng=1)
    cage = tree.lod(0, subdivisions=0)
    assert tree.stems["begin"][0] == 0
    assert (tree.stems["begin"][1:] == tree.stems["end"][:-1]).all()
    assert tree.stems["end"][-1] == len(cage.vertices)
    for k, stem in enumerate(tree.stems):
        own = slice(stem["begin"], stem["end"])
        assert (cage.branch_id[own] == k).all()
        assert cage.s[own][-1] == 1
        assert (np.diff(cage.s[own]) >= 0).all()
        first = 0 if k == 0 else 1
        assert np.array_equal(cage.step[own], np.repeat(np.arange((stem["end"] - stem["begin"]) // 4) + first, 4))
    smooth = tree.trunk
    assert set(smooth.branch_id) == set(range(len(tree.stems)))
    assert smooth.s.min() >= 0
    assert smooth.s.max() <= 1


# L1: which vertices may sprout, and how many do.
def test_vertices_sprout_by_chance():
    def tree(p, **leaves):
        how = params(
            trunk={"steps": 20},
            branches=[{"probability": 0.5, "low": 3}],
            leaves={
                "probability": p,
                "steps": 1,
                "lowest_step": 9,
                "trim_top": 2,
                "from_center": 2,
                "from_tip": 1,
                **leaves,
            },
        )
        return Tree.grow(how, rng=6)

    whole = tree(1.0)
    # Trunk: rings 9 to 21 but the last two; branches: steps 2 to 6 but the last.
    rings = [len(range(9, 22)) - 2] + [(s["end"] - s["begin"]) // 4 - 2 for s in whole.stems[1:]]
    n = 4 * sum(rings)
    assert len(whole.leaves) == n
    assert len(tree(0.0).leaves) == 0
    some = len(tree(0.75).leaves)
    assert abs(some - 0.75 * n) < 4 * math.sqrt(n * 0.75 * 0.25)
    assert (tree(1.0, first_level=1).leaves.branch_id > 0).all()
    # Fewer leaves: the same ones, some gone.
    assert set(tree(0.3).leaves.id) < set(tree(0.75).leaves.id) < set(whole.leaves.id)


# L2: a chain of exact spacing.
@pytest.mark.parametrize("unit", [1.0, 0.3])
def test_leaves_hang_in_chains(unit):
    tree = Tree.grow(params(leaves={"distance": 0.45, "wobble": 20, "lowest_step": 1}, unit=unit), rng=1)
    p, n = tree.leaves.position.reshape(-1, 7, 3), tree.leaves.normal.reshape(-1, 7, 3)
    assert np.allclose(p[:, 1:], p[:, :-1] + 0.45 * unit * n[:, 1:], atol=1e-12)
    root = p[:, 0] - 0.45 * unit * n[:, 0]
    cage = tree.lod(0, subdivisions=0).vertices
    assert np.abs(root[:, None] - cage[None]).max(axis=2).min(axis=1).max() < 1e-12, "the first from a vertex"
    assert np.allclose(np.linalg.norm(n, axis=2), 1, atol=1e-12)
    assert np.allclose(tree.leaves.branch_distance.reshape(-1, 7), 0.45 * unit * np.arange(1, 8), rtol=1e-6)
    assert np.array_equal(tree.leaves.order.reshape(-1, 7), np.tile(np.arange(7), (len(p), 1)))


# L3: 140 degrees from the backward direction, outwards; the wobble adds up.
def test_leaves_leave_at_their_angle():
    tree = Tree.grow(params(trunk={"twist": 20}, leaves={"angle": 140, "wobble": 0, "lowest_step": 1}), rng=1)
    n = tree.leaves.normal
    assert np.allclose(n[:, 2], math.cos(math.radians(40)), atol=1e-12)
    roots = tree.leaves.position.reshape(-1, 7, 3)[:, 0] - 0.45 * n.reshape(-1, 7, 3)[:, 0]
    out = roots[:, :2] / np.linalg.norm(roots[:, :2], axis=1, keepdims=True)
    assert np.allclose(n.reshape(-1, 7, 3)[:, 0, :2], math.sin(math.radians(40)) * out, atol=1e-12)
    wobbly = Tree.grow(
        params(trunk={"steps": 800}, leaves={"wobble": 5, "probability": 1, "lowest_step": 1, "steps": 9}), rng=1
    )
    n = wobbly.leaves.normal.reshape(-1, 9, 3)
    turn = np.degrees(np.arccos(np.clip((n[:, 1:] * n[:, :-1]).sum(axis=2), -1, 1)))
    assert abs(math.sqrt((turn**2).mean()) - 5 * CUT) < 4 * 5 / math.sqrt(2 * turn.size)
    # A random walk on the sphere: the cosines multiply (Perrin 1928).
    once = np.mean(np.cos(np.radians(5 * scipy.stats.truncnorm.rvs(-3, 3, size=200_000, random_state=1))))
    for k in (2, 4, 8):
        cosine = (n[:, k] * n[:, 0]).sum(axis=1)
        assert abs(cosine.mean() - once**k) < 4 * cosine.std() / math.sqrt(len(cosine)) + 1e-4


# L4: what a particle stores.
def test_what_a_leaf_stores():
    leaves = Tree.grow(pa.plants.preset("birch"), rng=1).leaves
    table = leaves.table()
    assert set(table.dtype.names) == {
        "position", "normal", "size", "label", "id", "branch_id", "order", "branch_distance", "branch_ratio",
        "center_distance", "center_ratio", "fade",
    }  # fmt: skip
    assert len(np.unique(leaves.id)) == len(leaves)
    assert scipy.stats.kstest(leaves.label / 2**32, "uniform").pvalue > 1e-4
    assert np.allclose(leaves.center, leaves.position.mean(axis=0))
    far = np.linalg.norm(leaves.position - leaves.center, axis=1)
    assert np.allclose(leaves.center_distance, far, rtol=1e-6)
    assert np.allclose(leaves.center_ratio, (far - far.min()) / np.ptp(far), atol=1e-6)
    assert (leaves.center_ratio.min(), leaves.center_ratio.max()) == (0, 1)
    assert np.allclose(leaves.branch_ratio, leaves.branch_distance / leaves.branch_distance.max())


# L5: the centre can be moved and moves nothing else.
def test_the_centre_is_a_locator():
    leaves = Tree.grow(pa.plants.preset("oak", unit=0.5), rng=1).leaves
    moved = leaves.restyled(center=(1.0, 2.0, 9.0))
    assert moved.center == (0.5, 1.0, 4.5)
    assert np.allclose(moved.center_distance, np.linalg.norm(leaves.position - [0.5, 1, 4.5], axis=1), rtol=1e-6)
    for name in ("position", "normal", "label", "id", "branch_id", "branch_ratio", "order"):
        assert np.array_equal(getattr(moved, name), getattr(leaves, name)), name


# L9: sizes change without a new emission.
def test_sizes_change_and_leaves_stay():
    tree = Tree.grow(pa.plants.preset("oak", unit=2.0), rng=1)
    leaves = tree.leaves
    plain = leaves.restyled(size=(0.2, 0.5), variance=0, inside_growth=0)
    assert np.allclose(plain.size, [0.4, 1.0])
    assert leaves.position.tobytes() == plain.position.tobytes()
    assert leaves.id.tobytes() == plain.id.tobytes()
    grown = leaves.restyled(size=1.0, variance=0, inside_growth=0.5)
    assert np.allclose(grown.size[:, 0], 2 * (1 + 0.5 * (1 - leaves.center_ratio)), rtol=1e-6)
    varied = leaves.restyled(size=1.0, variance=0.2, inside_growth=0).size[:, 0] / 2
    assert abs(varied.mean() - 1) < 4 * 0.2 / math.sqrt(len(leaves))
    assert abs(varied.std() - 0.2 * CUT) < 4 * 0.2 / math.sqrt(2 * len(leaves))
    other = Tree.grow(tree.params.replace(leaves__size=0.1), rng=1).leaves
    assert other.position.tobytes() == leaves.position.tobytes()


# D5, Fig. 13: two thresholds, the outermost first to go, a shortest separation.
def test_fades_go_from_outside():
    leaves = Tree.grow(pa.plants.preset("oak"), rng=1).leaves.restyled(bias=0)
    exact = leaves.restyled(threshold_sigma=0, fade_length=(3.0, 0.0), fade_min=1.5)
    begin, gone = exact.fade.T
    order = np.argsort(exact.center_distance, kind="stable")
    assert (np.diff(begin[order]) <= 0).all()
    assert begin.min() > 0
    assert begin.max() < 1
    assert scipy.stats.kstest(begin, "uniform").pvalue > 0.999, "ranks are evenly spread"
    assert np.allclose(gone - begin, 3 / 6, atol=1e-6)
    varied = leaves.restyled(fade_length=(2.0, 1.0), fade_min=1.5)
    length = varied.fade[:, 1] - varied.fade[:, 0]
    assert length.min() >= 1.5 / 6 - 1e-6
    assert length.max() > 2.5 / 6
    assert np.allclose(leaves.restyled(bias=0.25).fade, leaves.fade + 0.25, atol=1e-6)
    noisy = leaves.restyled(threshold_sigma=0.1, fade_length=3.0).fade[:, 0] - begin
    assert abs(noisy.std() - 0.1 * CUT) < 4 * 0.1 / math.sqrt(2 * len(leaves))
    assert (leaves.restyled(fades=False).fade == [2, 3]).all()
    # outer=0: chance alone.
    rank = scipy.stats.spearmanr(leaves.center_distance, leaves.restyled(outer=0.0, threshold_sigma=0).fade[:, 0])
    assert abs(rank.statistic) < 4 / math.sqrt(len(leaves))


# L11: leaves for wood from elsewhere.
def test_leaves_on_stems_from_elsewhere():
    t = np.linspace(0, 3, 40)
    helix = np.stack([np.cos(t), np.sin(t), 2 * t], axis=-1)
    stems = [(helix, np.full(40, 0.3)), ([[1, 0, 2], [3, 0, 2], [5, 0, 3]], [0.1, 0.08, 0.05])]
    how = TreeParams(leaves=LeafParams(lowest_step=3, from_center=1, probability=1, steps=2), unit=0.5)
    tree = Tree.from_stems(stems, how, rng=1)
    cage = tree.lod(0, subdivisions=0)
    assert np.allclose(cage.vertices.reshape(-1, 4, 3).mean(axis=1)[:40], 0.5 * helix, atol=1e-12)
    body = solid(cage)
    assert body.is_watertight
    assert body.euler_number == 4, "two closed surfaces"
    # A tube of square section has the volume of its section times its length.
    turn = np.linalg.norm(np.diff(0.5 * helix, axis=0), axis=1).sum() * (0.5 * 0.3) ** 2
    parts = body.split(only_watertight=True)
    assert max(p.volume for p in parts) == pytest.approx(turn, rel=2e-3)
    assert len(tree.leaves) == 2 * 4 * ((40 - 3) + 3)
    tangent = np.stack([-np.sin(t), np.cos(t), np.full(40, 2.0)], axis=-1) / math.sqrt(5)
    first = tree.leaves.normal[::2][4 : 4 * 30].reshape(-1, 4, 3)
    # 140 degrees from the backward tangent, but for the first step's wobble of 2.45 degrees.
    angles = np.degrees(np.arccos((first * tangent[4 : 4 + len(first), None]).sum(axis=2)))
    assert np.abs(angles - 40).max() < 3 * 2.45 + 0.1
    assert pickle.loads(pickle.dumps(tree)) == tree
    assert tree.regrow(leaves=3).trunk.vertices.tobytes() == tree.trunk.vertices.tobytes()


def test_panels_numbers_are_the_defaults():
    leaves, strata = LeafParams(), Strata()
    assert (leaves.lowest_step, leaves.trim_top, leaves.from_center, leaves.from_tip) == (9, 0, 2, 0)
    assert (leaves.probability, leaves.angle, leaves.distance, leaves.steps) == (0.75, 140, 0.45, 7)
    assert (leaves.wobble, leaves.fade_length[0], leaves.fade_min, leaves.fades) == (2.45, 3.0, 1.5, True)
    assert (strata.spans, strata.count, strata.displacement, strata.fade_from) == ((5, 5), 5, 0.1, 0.6)
    assert (strata.fade_length, strata.fade_min, strata.unit, strata.size) == (0.2, 0.1, 1.0, (1.0, 1.0))
    assert (strata.variance, strata.inside_growth) == (0, 0)


@pytest.mark.parametrize("kind", pa.plants.presets())
def test_parameters_survive(kind):
    how = pa.plants.preset(kind, unit=0.1 + 0.2)
    assert TreeParams.from_json(how.to_json()) == how
    assert TreeParams.from_json(how.to_json()).to_json() == how.to_json()
    assert pickle.loads(pickle.dumps(how)) == how
    assert len({how, how.replace()}) == 1
    tree = Tree.grow(how, rng=3)
    again = pickle.loads(pickle.dumps(tree))
    assert again == tree
    assert again.leaves.table().tobytes() == tree.leaves.table().tobytes()
    assert tree.kind == kind


HILL = np.fromfunction(lambda j, i: 2 * np.sin(0.4 * i) + np.cos(0.3 * j), (16, 21))


def surfaces():
    sphere = trimesh.creation.icosphere(2, 3.0)
    points = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0), indexing="ij"), axis=-1)
    points = np.concatenate([points, np.sin(points.sum(axis=-1, keepdims=True))], axis=-1)
    return {
        "heightfield": Surface.heightfield(HILL, (0.5, 0.8)),
        "mesh": Surface.mesh(sphere.vertices, sphere.faces),
        "nurbs": Surface.nurbs(points, 1 + points[..., 0]),
    }


SURFACES = surfaces()


# G1: exactly k in each cell.
@pytest.mark.parametrize("kind", SURFACES)
def test_each_cell_holds_exactly_its_particles(kind):
    p = SURFACES[kind].emit(Strata(spans=(7, 11), count=3), rng=2)
    assert len(p) == 7 * 11 * 3
    cell = np.floor(p.uv * [7, 11]).astype(int)
    assert (np.unique(cell[:, 0] * 11 + cell[:, 1], return_counts=True)[1] == 3).all()
    inside = p.uv * [7, 11] - cell
    assert scipy.stats.kstest(inside.ravel(), "uniform").pvalue > 1e-4
    assert np.allclose(np.linalg.norm(p.normal, axis=1), 1)


def test_a_mesh_is_strewn_by_area():
    box = trimesh.creation.box((1, 2, 4))
    surface = Surface.mesh(box.vertices, box.faces)
    p = surface.emit(Strata(spans=(10, 10), count=40), rng=1)
    share = box.area_faces / box.area
    seen = np.bincount(p.face, minlength=len(share))
    # Only the two strata at the ends of a face are shared with others.
    assert np.abs(seen - 4000 * share).max() < 2 * 40
    # Even within a face, too: chi squared of quarters.
    for face in range(len(share)):
        b = p.barycentric[p.face == face]
        quarter = np.where((b > 0.5).any(axis=1), b.argmax(axis=1), 3)
        assert scipy.stats.chisquare(np.bincount(quarter, minlength=4)).pvalue > 1e-4


# G2: up or down by at most the height.
@pytest.mark.parametrize("kind", SURFACES)
def test_heights(kind):
    surface = SURFACES[kind]
    p = surface.emit(Strata(spans=(40, 40), displacement=0.2, unit=0.5), rng=3)
    assert p.height.min() >= 0
    assert p.height.max() < 1
    assert scipy.stats.kstest(p.height, "uniform").pvalue > 1e-4
    flat = surface.emit(Strata(spans=(40, 40), displacement=0), rng=3)
    moved = p.position - flat.position
    assert np.allclose(moved, p.normal * ((2 * p.height - 1) * 0.1)[:, None], atol=1e-12)
    if kind != "mesh":
        assert np.allclose(flat.position, surface.at(p.uv)[0], atol=1e-12)


# G3: sizes.
def test_sizes_of_strokes():
    hill = SURFACES["heightfield"]
    p = hill.emit(Strata(spans=(50, 50), size=(0.2, 0.6), unit=2, inside_growth=1.5), rng=1)
    assert np.allclose(p.size, np.array([0.4, 1.2]) * (1 + 1.5 * (1 - p.height))[:, None], rtol=1e-6)
    v = hill.emit(Strata(spans=(50, 50), variance=0.1), rng=1).size[:, 0]
    assert abs(v.mean() - 1) < 4 * 0.1 / math.sqrt(len(v))
    assert abs(v.std() - 0.1 * CUT) < 4 * 0.1 / math.sqrt(2 * len(v))


# G4: only what is high fades.
def test_only_detail_fades():
    p = SURFACES["heightfield"].emit(Strata(spans=(50, 50), fade_from=0.6, fade_length=0.3, fade_min=0.1), rng=1)
    assert np.array_equal(p.detail, p.height > 0.6)
    assert (p.fade[~p.detail] == [2, 3]).all()
    begin, gone = p.fade[p.detail].T
    assert begin.min() >= 0
    assert gone.max() <= 1
    length = gone - begin
    assert length.min() >= 0.1 - 1e-6
    assert length.max() <= 0.3 + 1e-6
    assert scipy.stats.kstest((length - 0.1) / 0.2, "uniform").pvalue > 1e-4
    # As many of the lower ones in each cell at every distance: they are the underlayer, and stay.
    assert SURFACES["heightfield"].emit(Strata(fade_from=1.0), rng=1).detail.sum() == 0


# G6: between the aggregate and a random normal.
def test_normals_are_blended():
    p = SURFACES["mesh"].emit(Strata(spans=(60, 60)), rng=1)
    assert np.array_equal(p.normals(0), p.normal)
    assert np.allclose(p.normals(1), p.random_normal, atol=1e-15)
    mixed = 0.6 * p.normal + 0.4 * p.random_normal
    assert np.allclose(p.normals(0.4), mixed / np.linalg.norm(mixed, axis=1, keepdims=True), atol=1e-12)
    # Uniform on the sphere: each coordinate is (Archimedes), and the mean vanishes.
    for k in range(3):
        assert scipy.stats.kstest((p.random_normal[:, k] + 1) / 2, "uniform").pvalue > 1e-4


# F2: particles are bound to their surface.
@pytest.mark.parametrize("kind", SURFACES)
def test_a_deformed_surface_carries_its_particles(kind):
    surface = SURFACES[kind]
    strata = Strata(spans=(9, 9), displacement=0.3)
    p = surface.emit(strata, rng=1)
    assert p.on(surface).position.tobytes() == p.position.tobytes()
    turn = scipy.spatial.transform.Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    if kind == "nurbs":
        n = surface._nurbs
        other = Surface.nurbs(n.points @ turn.T + [1, 2, 3], n.weights, n.knots, n.degree)
    else:
        other = Surface.mesh(surface.vertices @ turn.T + [1, 2, 3], surface.faces)
    moved = p.on(other)
    # A rigid motion moves every particle with it, whatever its height.
    assert np.allclose(moved.position, p.position @ turn.T + [1, 2, 3], atol=1e-12)
    assert np.allclose(moved.normal, p.normal @ turn.T, atol=1e-12)
    for name in ("label", "height", "uv", "size", "fade", "random_normal"):
        assert getattr(moved, name).tobytes() == getattr(p, name).tobytes()

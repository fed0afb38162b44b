"""Geometry against geomdl (NURBS), scipy (B-splines), trimesh and pygltflib (meshes and files), and closed forms."""

import io
import json
import math

import matplotlib.tri
import numpy as np
import pleinair as pa
import pygltflib
import pytest
import scipy.interpolate
import scipy.stats
import trimesh
from geomdl import NURBS, operations
from PIL import Image
from pleinair.plants import Strata, Surface, Tree


def random_surface(seed, degree, counts):
    r = np.random.default_rng(seed)
    u, v = np.meshgrid(*(np.arange(n, dtype=float) for n in counts), indexing="ij")
    points = np.stack([u, v, np.zeros_like(u)], axis=-1) + 0.4 * r.standard_normal((*counts, 3))
    knots = []
    for n, p in zip(counts, degree, strict=True):
        inner = np.sort(r.random(n - p - 1))
        knots.append(np.r_[np.zeros(p + 1), inner, np.ones(p + 1)])
    return points, r.uniform(0.3, 3.0, counts), knots


@pytest.mark.parametrize(
    ("seed", "degree", "counts"),
    [(0, (3, 3), (7, 6)), (1, (2, 4), (5, 9)), (2, (1, 1), (4, 3)), (3, (5, 2), (6, 3)), (4, (3, 3), (4, 4))],
)
def test_rational_surfaces_are_those_of_geomdl(seed, degree, counts):
    points, weights, knots = random_surface(seed, degree, counts)
    theirs = NURBS.Surface()
    theirs.degree_u, theirs.degree_v = degree
    homogeneous = np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)
    theirs.ctrlpts2d = homogeneous.tolist()
    theirs.knotvector_u, theirs.knotvector_v = (k.tolist() for k in knots)
    ours = Surface.nurbs(points, weights, knots, degree)
    uv = np.random.default_rng(9).random((60, 2))
    uv[:6] = [[0, 0], [1, 1], [0, 1], [1, 0], [0.5, 0], [0, 0.5]]
    at, normals = ours.at(uv)
    assert np.allclose(at, theirs.evaluate_list(uv.tolist()), atol=1e-12)
    want = np.array([operations.normal(theirs, list(p), normalize=True)[1] for p in uv])
    assert np.allclose(normals, want, atol=1e-9)


def test_knots_that_repeat_inside_are_those_of_geomdl():
    points, weights, _ = random_surface(5, (3, 2), (8, 6))
    knots = [np.array([0, 0, 0, 0, 0.4, 0.4, 0.4, 0.7, 1, 1, 1, 1.0]), np.array([0, 0, 0, 0.5, 0.5, 0.9, 1, 1, 1])]
    theirs = NURBS.Surface()
    theirs.degree_u, theirs.degree_v = 3, 2
    theirs.ctrlpts2d = np.concatenate([points * weights[..., None], weights[..., None]], axis=-1).tolist()
    theirs.knotvector_u, theirs.knotvector_v = (k.tolist() for k in knots)
    uv = np.stack(np.meshgrid([0, 0.2, 0.4, 0.7, 0.83, 1], [0, 0.3, 0.5, 0.9, 1.0]), axis=-1).reshape(-1, 2)
    at, _ = Surface.nurbs(points, weights, knots, (3, 2)).at(uv)
    assert np.allclose(at, theirs.evaluate_list(uv.tolist()), atol=1e-12)


@pytest.mark.parametrize("clamped", [True, False])
def test_surfaces_without_weights_are_those_of_scipy(clamped):
    points, _, knots = random_surface(7, (3, 2), (9, 7))
    if not clamped:
        knots = [np.arange(13.0), np.arange(10.0) ** 1.1]
    theirs = scipy.interpolate.NdBSpline(tuple(knots), points, (3, 2))
    uv = np.random.default_rng(1).random((500, 2))
    span = [(k[d], k[-d - 1]) for k, d in zip(knots, (3, 2), strict=True)]
    real = np.stack([low + (high - low) * uv[:, i] for i, (low, high) in enumerate(span)], axis=-1)
    at, normals = Surface.nurbs(points, None, knots, (3, 2)).at(uv)
    assert np.allclose(at, theirs(real), atol=1e-12)
    su, sv = theirs(real, nu=(1, 0)), theirs(real, nu=(0, 1))
    cross = np.cross(su, sv)
    assert np.allclose(normals, cross / np.linalg.norm(cross, axis=1, keepdims=True), atol=1e-10)


def sphere():
    """A sphere of radius 2 as a surface of revolution: nine points round, five from pole to pole."""
    r = math.sqrt(0.5)
    around = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], float)
    up = np.array([[0, -1], [1, -1], [1, 0], [1, 1], [0, 1]], float)
    points = np.array([[[2 * a[0] * p[0], 2 * a[1] * p[0], 2 * p[1]] for p in up] for a in around])
    weights = np.outer([1, r, 1, r, 1, r, 1, r, 1], [1, r, 1, r, 1])
    knots = ([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], [0, 0, 0, 1, 1, 2, 2, 2])
    return Surface.nurbs(points, weights, knots, 2)


def test_a_sphere_is_round_and_its_poles_have_normals():
    r = np.random.default_rng(2)
    uv = np.concatenate([r.random((2000, 2)), [[0.3, 0], [0.3, 1], [0, 0], [1, 1], [0, 0.5], [1, 0.5]]])
    at, normals = sphere().at(uv)
    assert np.abs(np.linalg.norm(at, axis=1) - 2).max() < 1e-14 * 8
    assert np.abs(normals - at / 2).max() < 1e-6
    away = (uv[:, 1] > 1e-3) & (uv[:, 1] < 1 - 1e-3)
    assert np.abs(normals - at / 2)[away].max() < 1e-12


def test_tessellations_approach_the_sphere():
    for n, bound in ((16, 0.06), (64, 0.004), (128, 0.001)):
        solid = sphere().tessellated((2 * n, n))
        body = trimesh.Trimesh(solid.vertices, solid.faces)
        assert body.area == pytest.approx(16 * math.pi, rel=bound)
        # Outwards: the volume is positive and that of the sphere.
        assert body.volume == pytest.approx(32 / 3 * math.pi, rel=2 * bound)


# Catmull and Clark's rules on a cube of edge 2, by hand.
def test_a_subdivided_cube():
    box = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    once = pa.plants.subdivide(box, faces, 1)
    assert len(once.vertices) == 8 + 12 + 6
    assert len(once.quads) == 24
    assert np.allclose(once.vertices[:8], 5 / 9 * box, atol=1e-15)
    sizes = np.sort(np.abs(once.vertices[8:20]), axis=1)
    assert np.allclose(sizes, [0, 0.75, 0.75], atol=1e-15)
    assert np.allclose(np.sort(np.abs(once.vertices[20:]), axis=1), [0, 0, 1], atol=1e-15)
    for levels in (1, 2, 4):
        m = pa.plants.subdivide(box, faces, levels)
        body = trimesh.Trimesh(m.vertices, m.triangles, process=False)
        assert body.is_watertight
        assert body.euler_number == 2
        assert len(m.quads) == 6 * 4**levels
    # Halstead, Kass and DeRose (1993): a vertex of valence 3 ends at (9 P + 4 E + F) / 24, E and F the sums of its neighbours.
    deep = pa.plants.subdivide(box, faces, 9)
    for i in range(8):
        ring = [j for j in range(8) if np.abs(box[i] - box[j]).sum() == 2]
        across = [j for j in range(8) if np.abs(box[i] - box[j]).sum() == 4]
        limit = (9 * box[i] + 4 * box[ring].sum(axis=0) + box[across].sum(axis=0)) / 24
        assert np.allclose(deep.vertices[i], limit, atol=2e-5)


def test_a_subdivided_grid_is_a_bicubic_b_spline():
    r = np.random.default_rng(0)
    n = 8
    grid = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).astype(float)
    points = np.concatenate([grid, r.random((n, n, 1))], axis=-1)
    faces = [
        [i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1] for i in range(n - 1) for j in range(n - 1)
    ]
    # The same spline on knots half as wide has the subdivided points as its control points.
    cubic = scipy.interpolate.NdBSpline((np.arange(n + 4.0) - 2,) * 2, points, (3, 3))
    mesh = pa.plants.subdivide(points.reshape(-1, 3), faces, 1)
    by_place = {}
    index = np.rint(2 * mesh.vertices[:, :2]).astype(int)
    for (i, j), p in zip(index, mesh.vertices, strict=True):
        by_place[i, j] = p
    m = 2 * n - 1
    fine = np.full((m, m, 3), np.nan)
    # Inside, x and y are linear, so a refined point lies at its half-integer place.
    for i in range(1, m - 1):
        for j in range(1, m - 1):
            fine[i, j] = by_place[i, j]
    control = fine[1:-1, 1:-1]
    knots = 0.5 * (np.arange(len(control) + 4.0) - 2) + 0.5
    refined = scipy.interpolate.NdBSpline((knots, knots), control, (3, 3))
    uv = 1.5 + r.random((200, 2)) * (n - 4)
    assert np.allclose(refined(uv), cubic(uv), atol=1e-12)


def test_a_subdivided_boundary_is_a_b_spline_curve():
    r = np.random.default_rng(3)
    n = 9
    side = np.stack([np.arange(n), r.random(n), r.random(n)], axis=-1)
    points = np.concatenate([side, side + np.array([0, 0, 5])])
    faces = [[i, i + 1, n + i + 1, n + i] for i in range(n - 1)]
    mesh = pa.plants.subdivide(points, faces, 1)
    rule = np.concatenate([(side[:-2] + 6 * side[1:-1] + side[2:]) / 8, 0.5 * (side[1:] + side[:-1])])
    for p in rule:
        assert np.abs(mesh.vertices - p).max(axis=1).min() < 1e-14


def test_normals_and_areas_are_those_of_trimesh():
    body = trimesh.creation.icosphere(3, 2.0)
    body.vertices *= [1, 2, 0.5]
    ours = Surface.mesh(body.vertices, body.faces)
    weights = body.area_faces[:, None]
    theirs = np.zeros_like(body.vertices)
    for k in range(3):
        np.add.at(theirs, body.faces[:, k], body.face_normals * weights)
    theirs /= np.linalg.norm(theirs, axis=1, keepdims=True)
    assert np.allclose(ours.normals, theirs, atol=1e-12)
    p = ours.emit(Strata(spans=(40, 40), displacement=0), rng=1)
    want = trimesh.triangles.barycentric_to_points(body.triangles[p.face], p.barycentric)
    assert np.allclose(p.position, want, atol=1e-12)
    assert (
        scipy.stats.chisquare(
            np.bincount(p.face, minlength=len(body.faces)), len(p) * body.area_faces / body.area
        ).pvalue
        > 0.5
    )  # strata are more even than chance


def test_heightfields_are_those_of_matplotlib():
    r = np.random.default_rng(0)
    z = r.random((7, 9))
    hill = Surface.heightfield(z, (0.5, 2.0), origin=(10, 20, 30))
    uv = r.random((400, 2))
    at, _ = hill.at(uv)
    x, y = 10 + 4 * uv[:, 0], 20 + 12 * uv[:, 1]
    assert np.allclose(at[:, 0], x)
    assert np.allclose(at[:, 1], y)
    # Piecewise linear on the same triangles.
    ground = matplotlib.tri.Triangulation(hill.vertices[:, 0], hill.vertices[:, 1], hill.faces)
    linear = matplotlib.tri.LinearTriInterpolator(ground, hill.vertices[:, 2])
    assert np.allclose(at[:, 2], linear(x, y), atol=1e-12)


TREE = Tree.grow(pa.plants.preset("birch", unit=0.37, name="Birke"), rng=4)


def check_trunk(vertices, faces, tolerance):
    mesh = TREE.trunk
    size = np.abs(mesh.vertices).max()
    assert np.abs(vertices - mesh.vertices).max() <= tolerance * size
    assert np.array_equal(faces, mesh.triangles)


def test_glb_is_read_by_trimesh(tmp_path):
    scene = trimesh.load(TREE.export(tmp_path / "tree.glb", level=0), process=False)
    assert set(scene.geometry) == {"trunk", "leaves"}
    trunk = scene.geometry["trunk"]
    check_trunk(trunk.vertices, trunk.faces, 1e-7)
    assert np.allclose(trunk.vertex_attributes["_S"].ravel(), TREE.trunk.s, atol=1e-7)
    assert np.array_equal(trunk.vertex_attributes["_BRANCH_ID"].ravel(), TREE.trunk.branch_id)
    cards = scene.geometry["leaves"]
    assert len(cards.vertices) == 4 * len(TREE.leaves)
    middle = cards.vertices.reshape(-1, 4, 3).mean(axis=1)
    assert np.abs(middle - TREE.leaves.position).max() < 1e-6
    # A card's face looks along its normal, and is as large as its leaf.
    assert np.allclose(cards.face_normals[::2], TREE.leaves.normal, atol=1e-3)
    corners = cards.vertices.reshape(-1, 4, 3)
    assert np.allclose(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1), TREE.leaves.size[:, 0], atol=1e-5)
    assert np.allclose(np.linalg.norm(corners[:, 3] - corners[:, 0], axis=1), TREE.leaves.size[:, 1], atol=1e-5)
    # glTF's y is up.
    placed = scene.to_geometry().bounds
    assert placed[1, 1] == pytest.approx(TREE.bounds[1, 2], rel=0.05)
    assert placed[0, 1] == pytest.approx(min(TREE.trunk.bounds[0, 2], cards.bounds[0, 2]), abs=1e-6)


def test_glb_is_valid_for_pygltflib(tmp_path):
    path = TREE.export(tmp_path / "tree.glb", leaves="points", proxies=True)
    file = pygltflib.GLTF2().load(path)
    data = file.binary_blob()
    assert file.asset.version == "2.0"
    assert file.buffers[0].byteLength == len(data)
    for view in file.bufferViews:
        assert view.byteOffset % 4 == 0
        assert view.byteOffset + view.byteLength <= len(data)

    def column(mesh, name):
        accessor = file.accessors[getattr(mesh.primitives[0].attributes, name)]
        view = file.bufferViews[accessor.bufferView]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor.type]
        out = np.frombuffer(data, "<f4", accessor.count * width, view.byteOffset).reshape(accessor.count, width)
        if name == "POSITION":
            assert accessor.min == out.min(axis=0).tolist()
            assert accessor.max == out.max(axis=0).tolist()
        return out

    leaves = next(m for m in file.meshes if m.name == "leaves")
    assert leaves.primitives[0].mode == pygltflib.POINTS
    assert np.array_equal(column(leaves, "POSITION"), TREE.leaves.position.astype("f4"))
    for name, values in (("_SIZE", TREE.leaves.size), ("_FADE", TREE.leaves.fade)):
        # Scalars: Blender refuses a mesh whose custom attributes are of two widths.
        assert np.array_equal(np.hstack([column(leaves, f"{name}_{k}") for k in (0, 1)]), values)
    # Integers of 64 bits survive in quarters, the low one first.
    quarters = np.hstack([column(leaves, f"_ID_{k}") for k in range(4)]).astype(np.uint64)
    found = sum(quarters[:, k] << np.uint64(16 * k) for k in range(4))
    assert np.array_equal(found.view(np.int64), TREE.leaves.id.astype(np.int64))
    for mesh in file.meshes:
        kinds = {file.accessors[v].type for k, v in vars(mesh.primitives[0].attributes).items() if k[0] == "_" and v}
        assert kinds <= {"SCALAR"}
    assert np.array_equal(column(leaves, "_CENTER_RATIO")[:, 0], TREE.leaves.center_ratio)
    assert {m.name for m in file.meshes} == {"trunk", "leaves", "proxies"}
    # What made the tree is in the file.
    extras = file.asset.extras
    again = Tree(pa.plants.TreeParams.from_json(extras["params"]), tuple(extras["seeds"]))
    assert again == TREE


def read_ply(path):
    """A reader of nobody's making: the header says what follows."""
    data = path.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    kinds = {"float": "<f4", "double": "<f8", "uint": "<u4", "int": "<i4", "uchar": "u1", "ushort": "<u2"}
    elements, at = {}, 0
    lines = [line.split() for line in head.decode().splitlines()]
    assert lines[0] == ["ply"]
    assert lines[1] == ["format", "binary_little_endian", "1.0"]
    current = None
    for line in lines:
        if line[0] == "element":
            current = line[1]
            elements[current] = (int(line[2]), [])
        elif line[0] == "property":
            elements[current][1].append(line[1:])
    out = {}
    for name, (count, properties) in elements.items():
        if properties[0][0] == "list":
            rows = []
            for _ in range(count):
                n = body[at]
                rows.append(np.frombuffer(body, "<u4", n, at + 1))
                at += 1 + 4 * n
            out[name] = rows
        else:
            dtype = np.dtype([(p[1], kinds[p[0]]) for p in properties])
            out[name] = np.frombuffer(body, dtype, count, at)
            at += count * dtype.itemsize
    assert at == len(body)
    return out


def test_ply_keeps_every_column(tmp_path):
    path = TREE.export(tmp_path / "tree.ply", level=0, leaves="points")
    found = read_ply(path)
    vertices = np.stack([found["vertex"][c] for c in "xyz"], axis=-1)
    assert np.array_equal(vertices, TREE.trunk.vertices), "double precision: every bit"
    assert np.array_equal(np.array(found["face"]), TREE.trunk.quads)
    assert np.array_equal(found["vertex"]["branch_id"], TREE.trunk.branch_id)
    leaves = found["leaves"]
    assert np.array_equal(np.stack([leaves[c] for c in "xyz"], axis=-1), TREE.leaves.position)
    assert np.array_equal(leaves["size_1"], TREE.leaves.size[:, 1])
    assert np.array_equal(leaves["label"], TREE.leaves.label)
    assert np.array_equal(leaves["fade_0"], TREE.leaves.fade[:, 0])
    for name in ("branch_id", "order", "branch_distance", "branch_ratio", "center_distance", "center_ratio"):
        assert np.array_equal(leaves[name], getattr(TREE.leaves, name)), name
    assert np.array_equal((leaves["id_high"].astype(np.int64) << 32) | leaves["id_low"], TREE.leaves.id)
    # And it opens elsewhere.
    read = trimesh.load(path, process=False)
    assert np.array_equal(read.vertices, TREE.trunk.vertices)
    assert len(read.faces) == 2 * len(TREE.trunk.quads)
    assert read.is_watertight
    # Quadrilaterals that are not planar may be cut the other way.
    theirs = trimesh.Trimesh(TREE.trunk.vertices, TREE.trunk.triangles, process=False)
    assert read.volume == pytest.approx(theirs.volume, rel=1e-3)


def test_ply_with_cards_is_read_by_trimesh(tmp_path):
    mesh = trimesh.load(TREE.export(tmp_path / "tree.ply", level=0), process=False)
    n, leaves = len(TREE.trunk.vertices), 4 * len(TREE.leaves)
    assert len(mesh.vertices) == n + leaves
    assert np.array_equal(mesh.vertices[:n], TREE.trunk.vertices)
    assert len(mesh.faces) == len(TREE.trunk.triangles) + leaves // 2
    assert mesh.faces.max() == n + leaves - 1


@pytest.mark.parametrize("leaves", ["cards", "points", "none"])
def test_obj_is_read_by_trimesh(tmp_path, leaves):
    path = TREE.export(tmp_path / "tree.obj", level=0, leaves=leaves)
    scene = trimesh.load(path, process=False, maintain_order=True, split_object=True, group_material=False)
    parts = scene.geometry if hasattr(scene, "geometry") else {"trunk": scene}
    trunk = next(g for k, g in parts.items() if "leaves" not in k)
    triangles = TREE.trunk.vertices[TREE.trunk.triangles]
    got = np.asarray(trunk.triangles)[: len(triangles)]
    # Triangles of a quadrilateral may be cut the other way: corners and areas stay.
    assert np.abs(got.reshape(-1, 3).max(axis=0) - triangles.reshape(-1, 3).max(axis=0)).max() < 1e-7
    assert trimesh.triangles.area(got).sum() == pytest.approx(trimesh.triangles.area(triangles).sum(), rel=1e-4)
    text = path.read_text().splitlines()
    at = np.array([line.split()[1:] for line in text if line.startswith("v ")], float)
    assert np.abs(at[: len(TREE.trunk.vertices)] - TREE.trunk.vertices).max() < 1e-10
    rows = [line.split()[1:] for line in text if line.startswith("f ")]
    quads = np.array([[int(c.split("/")[0]) for c in row] for row in rows])
    assert np.array_equal(quads[: len(TREE.trunk.quads)], TREE.trunk.quads + 1)
    assert quads.max() <= len(at)
    assert sum(line.startswith("p ") for line in text) == (len(TREE.leaves) if leaves == "points" else 0)


@pytest.mark.parametrize("suffix", ["glb", "ply", "obj"])
def test_surfaces_are_read_by_trimesh(tmp_path, suffix):
    hill = Surface.heightfield(np.random.default_rng(0).random((5, 6)), 0.25)
    read = trimesh.load(hill.export(tmp_path / f"hill.{suffix}"), process=False)
    mesh = next(iter(read.geometry.values())) if hasattr(read, "geometry") else read
    assert np.abs(mesh.vertices - hill.vertices).max() < 1e-7
    assert np.array_equal(mesh.faces, hill.faces)


def test_glb_header_is_that_of_the_standard(tmp_path):
    data = TREE.export(tmp_path / "tree.glb").read_bytes()
    magic, version, total, length, kind = np.frombuffer(data, "<u4", 5).tolist()
    assert (magic.to_bytes(4, "little"), version, total) == (b"glTF", 2, len(data))
    assert kind == 0x4E4F534A
    assert length % 4 == 0
    assert json.loads(data[20 : 20 + length])["scene"] == 0


@pytest.mark.parametrize("kind", [k for k in pa.plants.presets() if k != "bare"])
def test_a_tree_for_another_program_is_light_and_textured(tmp_path, kind):
    tree = Tree.grow(pa.plants.preset(kind), rng=1)
    file = pygltflib.GLTF2().load(tree.export(tmp_path / "tree.glb"))
    data = file.binary_blob()
    by_name = {mesh.name: mesh.primitives[0] for mesh in file.meshes}
    assert file.accessors[by_name["trunk"].indices].count <= 3 * 8000
    for name, mode in (("trunk", "OPAQUE"), ("leaves", "MASK")):
        material = file.materials[by_name[name].material]
        assert (material.alphaMode or "OPAQUE") == mode
        view = file.bufferViews[
            file.images[file.textures[material.pbrMetallicRoughness.baseColorTexture.index].source].bufferView
        ]
        texture = Image.open(io.BytesIO(data[view.byteOffset : view.byteOffset + view.byteLength]))
        texture.load()  # checks every chunk
        assert texture.size == (64, 64)
        if mode == "MASK":
            alpha = np.asarray(texture)[..., 3]
            assert set(np.unique(alpha)) == {0, 255}
            assert 0.3 < (alpha > 0).mean() < 0.8
    # v is 0 at the top of a texture: the upper corners of a leaf have it.
    leaves = by_name["leaves"].attributes
    view = file.bufferViews[file.accessors[leaves.TEXCOORD_0].bufferView]
    uv = np.frombuffer(data, "<f4", 8, view.byteOffset).reshape(4, 2)
    view = file.bufferViews[file.accessors[leaves.POSITION].bufferView]
    corner = np.frombuffer(data, "<f4", 12, view.byteOffset).reshape(4, 3)
    assert np.argmax(corner[:, 2]) in np.flatnonzero(uv[:, 1] == 0)


@pytest.mark.parametrize("suffix", ["ply", "obj"])
def test_the_axis_that_is_up_is_said_and_turned(tmp_path, suffix):
    hill = pa.plants.Surface.heightfield(np.arange(12.0).reshape(3, 4), spacing=2.0)
    read = {}
    for up in ("z", "y"):
        path = hill.export(tmp_path / f"{up}.{suffix}", up=up)
        assert f"surface, {up} up".encode() in path.read_bytes()[:200]
        read[up] = trimesh.load(path, process=False).vertices
    assert np.allclose(read["y"], np.stack([read["z"][:, 0], read["z"][:, 2], -read["z"][:, 1]], axis=1), atol=1e-9)
    with pytest.raises(ValueError, match="up must be one of 'z', 'y'"):
        hill.export(tmp_path / f"a.{suffix}", up="x")


def test_triangles_on_request(tmp_path):
    element = read_ply(TREE.export(tmp_path / "tree.ply", leaves="none", triangles=True))
    assert {len(face) for face in element["face"]} == {3}

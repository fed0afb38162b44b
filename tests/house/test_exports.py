"""Skies for other programs: where every pixel looks, closed meshes, compositing."""

import json
import re
import warnings
from types import SimpleNamespace

import numpy as np
import pleinair as pa
import pygltflib
import pytest
from pleinair import exports

SHOWS = SimpleNamespace(radiance=lambda directions: directions)  # a sky whose colour is the direction


def y_up(d):
    """East stays x, up is y, south is z."""
    return np.stack([d[..., 0], d[..., 2], -d[..., 1]], axis=-1)


def opengl(d):
    """Face, s and t in [0, 1] of a direction: section 8.13 of the OpenGL 4.6 specification, as it is written there."""
    x, y, z = d
    sc, tc, ma, face = max(
        *((-z, -y, x, 0), (z, -y, -x, 1), (x, z, y, 2), (x, -z, -y, 3), (x, -y, z, 4), (-x, -y, -z, 5)),
        key=lambda row: row[2],
    )
    return face, (sc / ma + 1) / 2, (tc / ma + 1) / 2


# Cube maps


@pytest.mark.parametrize("size", [1, 2, 5, 16])
def test_every_pixel_of_a_cube_map_is_where_opengl_looks_it_up(size):
    cube = y_up(exports.cube_map(SHOWS, size))
    assert cube.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(cube, axis=-1), 1, rtol=1e-6)
    for face, row, column in np.ndindex(6, size, size):
        f, s, t = opengl(cube[face, row, column].astype(float))
        assert f == face
        assert (s * size - 0.5, t * size - 0.5) == pytest.approx((column, row), abs=1e-4)


def test_the_seams_of_a_cube_map_agree(lobe_sky):
    """Neighbours across an edge of the cube differ no more than neighbours within a face."""
    n = 64
    directions = exports.cube_map(SHOWS, n)
    radiance = exports.cube_map(lobe_sky, n)
    border = np.zeros((6, n, n), bool)
    border[:, [0, -1], :] = border[:, :, [0, -1]] = True
    face = np.nonzero(border)[0]
    d, colour = directions[border].astype(float), radiance[border]
    cosine = np.where(face[:, None] == face, -1, d @ d.T)
    nearest = cosine.argmax(axis=1)
    apart = np.degrees(np.arccos(np.clip(cosine.max(axis=1), -1, 1)))
    assert apart.max() < 1.5 * np.degrees(2 / n)
    step = np.abs(np.diff(radiance, axis=2)).max()
    assert np.abs(colour - colour[nearest]).max() < 1.5 * step


@pytest.mark.parametrize("kind", ["cross", "tall cross"])
def test_neighbours_in_a_cross_are_neighbours_on_the_cube(kind):
    n = 16
    picture = exports.cube_layout(exports.cube_map(SHOWS, n), kind)
    filled = np.linalg.norm(picture, axis=-1) > 0
    assert filled.sum() == 6 * n * n
    assert picture.shape == ((3 * n, 4 * n, 3) if kind == "cross" else (4 * n, 3 * n, 3))
    for axis in (0, 1):
        both = np.logical_and(*(np.take(filled, range(k, filled.shape[axis] + k - 1), axis) for k in (0, 1)))
        assert np.linalg.norm(np.diff(picture, axis=axis), axis=-1)[both].max() < 2.2 / n


def test_a_strip_is_the_faces_in_order():
    cube = exports.cube_map(SHOWS, 4)
    strip = exports.cube_layout(cube)
    np.testing.assert_array_equal(strip.reshape(4, 6, 4, 3).swapaxes(0, 1), cube)


# Skydomes


@pytest.mark.parametrize("rings", [2, 3, 16])
def test_a_skydome_is_closed_and_looks_inwards(lobe_sky, rings):
    mesh = exports.skydome(lobe_sky, rings=rings, radius=50)
    v = mesh.vertices.astype(float)
    np.testing.assert_allclose(np.linalg.norm(v, axis=-1), 50, rtol=1e-6)
    np.testing.assert_allclose(mesh.colors, lobe_sky.radiance(v / 50), rtol=1e-5)
    assert len(v) == 2 + 2 * rings * (rings - 1)
    edges = {(a, b) for f in mesh.faces.tolist() for a, b in zip(f, f[1:] + f[:1], strict=True)}
    assert len(edges) == 3 * len(mesh.faces), "no edge twice in one direction"
    assert edges == {(b, a) for a, b in edges}, "every edge has its other side"
    assert len(v) - len(edges) // 2 + len(mesh.faces) == 2, "a sphere"
    a, b, c = (v[mesh.faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    assert (np.sum(normal * (a + b + c), axis=-1) < 0).all(), "normals point inwards"


def read_ply(path):
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = head.decode().splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    n, m = (int(line.split()[2]) for line in lines if line.startswith("element"))
    kinds = {"float": "<f4", "uchar": "u1"}
    fields = [(p[2], kinds[p[1]]) for p in map(str.split, lines) if p[0] == "property" and p[1] != "list"]
    vertices = np.frombuffer(body, fields, n)
    faces = np.frombuffer(body, [("count", "u1"), ("corners", "<i4", 3)], m, offset=vertices.nbytes)
    assert vertices.nbytes + faces.nbytes == len(body)
    assert (faces["count"] == 3).all()
    return vertices, faces["corners"]


@pytest.mark.parametrize("colors", ["float", "uchar"])
def test_a_mesh_is_read_back(tmp_path, lobe_sky, colors):
    mesh = exports.skydome(SimpleNamespace(radiance=lambda d: lobe_sky.radiance(d) / 20), rings=4)
    shown = mesh.colors
    if colors == "uchar":
        shown = np.rint(255 * pa.color.srgb_encode(np.clip(shown, 0, 1)))
    vertices, faces = read_ply(mesh.write(tmp_path / "dome.ply", colors=colors))
    np.testing.assert_array_equal(np.stack([vertices[k] for k in "xyz"], axis=-1), mesh.vertices)
    np.testing.assert_array_equal(np.stack([vertices[k] for k in ("red", "green", "blue")], axis=-1), shown)
    np.testing.assert_array_equal(faces, mesh.faces)
    lines = [line.split() for line in mesh.write(tmp_path / "dome.obj", colors=colors).read_text().splitlines()]
    rows = np.array([line[1:] for line in lines if line[0] == "v"], float)
    np.testing.assert_allclose(rows[:, :3], mesh.vertices, rtol=1e-7)
    np.testing.assert_allclose(rows[:, 3:], shown / (255 if colors == "uchar" else 1), rtol=1e-6)
    np.testing.assert_array_equal(np.array([line[1:] for line in lines if line[0] == "f"], int) - 1, mesh.faces)
    with pytest.raises(ValueError, match=r"path must end in .glb, .ply or .obj, got 'dome.stl'"):
        mesh.write(tmp_path / "dome.stl")


def test_a_dome_of_gltf_has_linear_colours(tmp_path, lobe_sky):
    mesh = exports.skydome(SimpleNamespace(radiance=lambda d: lobe_sky.radiance(d) / 20), rings=4)
    # Half a level, where the curve of sRGB is steepest.
    for colors, most, tolerance in (("float", np.inf, 1e-7), ("uchar", 1.0, 0.5 / 255 * 2.4 * 1.055)):
        path = mesh.write(tmp_path / "dome.glb", colors=colors)
        read = pygltflib.GLTF2().load(path)
        accessor = read.accessors[read.meshes[0].primitives[0].attributes.COLOR_0]
        view = read.bufferViews[accessor.bufferView]
        found = np.frombuffer(read.binary_blob(), "<f4", 3 * accessor.count, view.byteOffset).reshape(-1, 3)
        scale = read.meshes[0].extras.get("color_scale", 1.0)
        assert found.max() <= 1, "as the standard wants"
        np.testing.assert_allclose(scale * found, np.minimum(mesh.colors, most), atol=2 * tolerance)


# Environments


def test_the_sun_is_written_beside_the_sky(tmp_path, lobe_sky):
    exr = pytest.importorskip("OpenEXR")
    path = exports.save_environment(lobe_sky, tmp_path / "noon.exr", 16, scale=0.5, light=True, half=True)
    np.testing.assert_allclose(pa.io.read(path), lobe_sky.panorama(16) / 2, rtol=1e-3)
    # That attribute puts the first and last row on the poles; our pixels are centred.
    assert "envmap" not in exr.File(str(path)).header()
    assert "pixels are centred" in json.loads((tmp_path / "noon.json").read_text())["conventions"]["panorama"]
    beside = json.loads((tmp_path / "noon.json").read_text())
    assert beside["direction"] == list(lobe_sky.axis)
    assert beside["irradiance"] == [1.5, 1, 0.75]
    assert beside["angular_radius"] == 0.2666
    np.testing.assert_array_equal(beside["sh9"], lobe_sky.sh9() / 2)
    assert "z up" in beside["conventions"]["frame"]


@pytest.mark.parametrize("ending", ["hdr", "pfm", "png"])
def test_an_environment_of_every_format(tmp_path, lobe_sky, ending):
    path = exports.save_environment(lobe_sky, tmp_path / f"sky.{ending}", 8, scale=0.02)
    np.testing.assert_allclose(pa.io.read(path), 0.02 * lobe_sky.panorama(8), atol=0.006)
    assert [f.name for f in tmp_path.iterdir()] == [path.name]


def test_nothing_is_written_where_the_sky_cannot_be(tmp_path, lobe_sky):
    dark = SimpleNamespace(panorama=lobe_sky.panorama)
    with pytest.raises(TypeError, match="sky must have a method sun_light, got SimpleNamespace"):
        exports.save_environment(dark, tmp_path / "a.hdr", 8, light=True)
    with pytest.raises(ValueError, match="within tolerance"):
        exports.save_environment(lobe_sky, tmp_path / "a.exr", 8, half=True, tolerance=1e-6, light=True)
    assert not list(tmp_path.iterdir())


# Where other programs look a lat-long picture up: u to the right, v down, both in [0, 1].
READS = {
    # Mitsuba 3, src/emitters/envmap.cpp
    "mitsuba": lambda x, y, z: (np.arctan2(x, -z) / (2 * np.pi) % 1, np.arccos(y) / np.pi),
    # UsdLux DomeLight, latlong: latitude 0, longitude 0 is +z, longitude 90 is +x, the left edge is longitude 180
    "usd": lambda x, y, z: ((np.pi - np.arctan2(x, z)) / (2 * np.pi), 0.5 - np.arcsin(y) / np.pi),
    # Cycles, direction_to_equirectangular; its v goes up
    "blender": lambda x, y, z: (
        (np.pi - np.arctan2(y, x)) / (2 * np.pi),
        0.5 - np.arctan2(z, np.hypot(x, y)) / np.pi,
    ),
}


@pytest.mark.parametrize("app", READS)
@pytest.mark.parametrize("up", ["z", "y"])
def test_other_programs_find_our_pixels(app, up, lobe_sky):
    height = 32
    ours = lobe_sky.panorama_directions(height)
    scene = ours if up == "z" else y_up(ours)
    turn = exports.to_world(app, up=up)
    np.testing.assert_allclose(turn @ turn.T, np.eye(4), atol=1e-15)
    assert np.linalg.det(turn) == pytest.approx(1)
    u, v = READS[app](*np.moveaxis(scene @ turn[:3, :3], -1, 0))
    rows, columns = np.mgrid[0:height, 0 : 2 * height]
    np.testing.assert_allclose(u * 2 * height - 0.5, columns, atol=1e-9)
    np.testing.assert_allclose(v * height - 0.5, rows, atol=1e-9)


# Compositing


def test_alpha_1_is_the_picture_and_alpha_0_the_sky(lobe_sky):
    camera = pa.Camera(8, 6, azimuth=40, elevation=20)
    sky = lobe_sky.render(camera)
    rgba = np.random.default_rng(0).random((6, 8, 4)).astype(np.float32)
    rgb = rgba[..., :3].copy()
    for premultiplied in (True, False):
        rgba[..., 3] = 1
        np.testing.assert_array_equal(exports.behind(rgba, lobe_sky, camera, premultiplied=premultiplied), rgb)
    rgba[..., 3] = 0
    np.testing.assert_array_equal(exports.behind(rgba, lobe_sky, camera, premultiplied=False), sky)
    np.testing.assert_array_equal(exports.behind(0 * rgba, lobe_sky, camera), sky)
    rgba[..., 3] = 0.25
    straight = exports.behind(rgba, lobe_sky, camera, premultiplied=False)
    np.testing.assert_allclose(straight, 0.25 * rgb + 0.75 * sky, rtol=1e-6)
    np.testing.assert_allclose(exports.behind(rgba * [0.25, 0.25, 0.25, 1], lobe_sky, camera), straight, rtol=1e-6)
    assert straight.dtype == np.float32
    # A layer made of the sky itself vanishes before it.
    itself = np.concatenate([sky, np.random.default_rng(1).random((6, 8, 1))], axis=-1)
    np.testing.assert_allclose(exports.behind(itself, lobe_sky, camera, premultiplied=False), sky, rtol=1e-6)


CAMERA = pa.Camera(4, 4)
RGBA = np.ones((4, 4, 4), np.float32)
BAD = RGBA.copy()
BAD[0, 0, 3] = 1.5


@pytest.mark.parametrize(
    ("call", "error", "match"),
    [
        (lambda sky: exports.behind(RGBA[..., :3], sky, CAMERA), ValueError, r"rgba must have shape \(4, 4, 4\)"),
        (lambda sky: exports.behind(RGBA, sky, pa.Camera(4, 5)), ValueError, r"rgba must have shape \(5, 4, 4\)"),
        (lambda sky: exports.behind(RGBA.astype("u1"), sky, CAMERA), TypeError, "rgba must hold linear light"),
        (lambda sky: exports.behind(RGBA * np.nan, sky, CAMERA), ValueError, "rgba must be finite"),
        (lambda sky: exports.behind(BAD, sky, CAMERA), ValueError, r"alpha in \[0, 1\] \[1\], got \[1, 1.5\]"),
        (lambda sky: exports.behind(RGBA, sky, "front"), TypeError, "camera must be a Camera, got str"),
        (lambda sky: exports.behind(RGBA, None, CAMERA), TypeError, "sky must have a method render, got NoneType"),
        (lambda sky: exports.cube_map(sky, 0), ValueError, r"size must be in \[1, 16384\]"),
        (
            lambda sky: exports.cube_map(SimpleNamespace(radiance=np.max), 2),
            ValueError,
            r"sky must give shape \(2, 2, 3\)",
        ),
        (lambda sky: exports.cube_layout(np.ones((5, 2, 2, 3))), ValueError, r"faces must have shape \(6, size"),
        (lambda sky: exports.cube_layout(np.ones((6, 2, 2, 3)), "row"), ValueError, "kind must be one of 'strip'"),
        (lambda sky: exports.skydome(sky, rings=1), ValueError, r"rings must be in \[2, 4096\]"),
        (lambda sky: exports.skydome(sky, radius=0), ValueError, "radius must be"),
        (lambda sky: exports.save_environment(sky, "a.tif", 2), ValueError, "path must end in"),
        (lambda sky: exports.save_environment(sky, "a.exr", 2, scale=0), ValueError, "scale must be"),
        (lambda sky: exports.to_world("maya"), ValueError, "app must be one of 'mitsuba', 'usd', 'blender'"),
        (lambda sky: exports.to_world("usd", up="x"), ValueError, "up must be one of 'z', 'y'"),
        (lambda sky: exports.usda("a@b.exr"), ValueError, "panorama must be printable without '@'"),
    ],
)
def test_wrong_arguments_are_named(lobe_sky, call, error, match):
    with pytest.raises(error, match=match):
        call(lobe_sky)


@pytest.mark.parametrize("elevation", [0.0, 0.5, 1.0, 2.0, 3.0])
def test_a_sun_at_the_horizon_goes_into_every_format(tmp_path, elevation):
    """Its light is redder than the primaries: a negative blue, which .hdr and USD cannot hold."""
    sky = pa.sky.Physical(sun=pa.Sun(elevation, 200))
    sun = sky.sun_light()
    given = np.array(sun.irradiance)
    assert given.min() < 0
    text = exports.usda("sky.hdr", sun)
    colour = [float(x) for x in re.search(r"inputs:color = \((.*)\)", text)[1].split(",")]
    intensity = [float(x) for x in re.findall(r"inputs:intensity = (\S+)", text)][-1]
    assert min(colour) >= 0
    mapped = intensity * np.array(colour)
    assert pa.color.luminance(mapped) == pytest.approx(pa.color.luminance(given), rel=1e-5)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        path = exports.save_environment(sky, tmp_path / "sky.hdr", 32, light=True)
    found, whole = pa.io.read(path), sky.without_disc().panorama(32)
    beyond = (whole < 0).any(axis=-1)
    assert any(f"{beyond.sum()} of 2048 pixels" in str(w.message) for w in caught) == bool(beyond.any())
    luminance = pa.color.luminance(whole)
    np.testing.assert_allclose(pa.color.luminance(found), luminance, rtol=0.01, atol=1e-3 * luminance.max())


def test_colours_are_mapped_at_their_luminance():
    rgb = np.random.default_rng(0).normal(0.3, 0.5, (1000, 3))
    found = pa.color.into_gamut(rgb)
    y = pa.color.luminance(rgb)
    outside = (rgb < 0).any(axis=-1)
    np.testing.assert_array_equal(found[~outside], rgb[~outside])
    assert (found >= 0).all()
    np.testing.assert_allclose(pa.color.luminance(found), np.maximum(y, 0), atol=1e-12)
    some = outside & (y > 0)
    # On the way to grey hue stays: what is left of the colour is one factor of all its differences from grey.
    left = (found - y[:, None])[some] / (rgb - y[:, None])[some]
    np.testing.assert_allclose(left, left[:, :1].repeat(3, axis=1), atol=1e-6)
    np.testing.assert_allclose(found[some].min(axis=1), 0, atol=1e-12)

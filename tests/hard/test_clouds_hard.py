"""Clouds at their limits: nothing, one voxel, the eye inside, opaque, anisotropic; bad input and damaged files."""

import math
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.clouds import Basis, Conventions, Params, Volume, load, render

J = Params(ambient=0.0, albedo=1.0, g=0.0)  # what is scattered once is J itself
SUN = pa.Sun(40, 200)
HEAP = pa.clouds.procedural("cumulus", (24, 32, 32), rng=6)
VIEW = pa.Camera.look_at((320, -1200, 950), (320, 320, 1000), 20, 15, fov=30)


def rel(a, b):
    return float(np.linalg.norm(np.asarray(a, float) - b) / np.linalg.norm(b))


# ---- Volumes and places.


@pytest.mark.parametrize("method", ["fast", "reference"])
def test_an_empty_volume_is_not_there(method):
    empty = Volume(np.zeros((5, 6, 7)))
    for position in ((-500, 50, 50), (70, 60, 50)):  # from outside and from inside
        camera = pa.Camera.look_at(position, (71, 61, 50), 8, 6)
        image = render(empty, Params(5.0, ambient=1.0), camera, SUN, sky=(0.2, 0.4, 0.8), method=method)
        np.testing.assert_allclose(image.rgb, np.broadcast_to([0.2, 0.4, 0.8], (6, 8, 3)), rtol=1e-6)
        assert (image.transmittance == 1).all()
        assert np.isinf(image.distance).all()
        assert not image.single.any()
    with pytest.raises(ValueError, match="does not see the cloud"):
        Basis.precompute(empty, VIEW, SUN)


@pytest.mark.parametrize("method", ["fast", "reference"])
def test_one_voxel_is_a_homogeneous_box(method):
    cloud = Volume([[[2.0]]], (10, 20, 30))
    camera = pa.Camera.look_at((-5000, 10, 15), (5, 10, 15), 1, 1, fov=0.01)
    for sigma in (1e-6, 0.02, 1.0):
        image = render(cloud, replace(J, sigma_t=sigma), camera, pa.Sun(90), method=method)
        assert image.transmittance[0, 0] == pytest.approx(math.exp(-sigma * 20), rel=1e-5)
        exact = math.exp(-sigma * 30) * -math.expm1(-sigma * 20)
        assert image.single[0, 0, 0] == pytest.approx(exact, rel=1e-4)
        assert image.distance[0, 0] == pytest.approx(5000)


@pytest.mark.parametrize("method", ["fast", "reference"])
@pytest.mark.parametrize("sigma", [1e-8, 0.01, 1e3])
def test_the_eye_inside(method, sigma):
    cloud = Volume(np.ones((10, 10, 10)), 10.0)
    # Looking straight at the Sun from 30 m below the top: S + D = 30 m everywhere.
    camera = pa.Camera(1, 1, fov=0.01, elevation=90, position=(50, 50, 70))
    image = render(cloud, replace(J, sigma_t=sigma), camera, pa.Sun(90), method=method)
    assert image.single[0, 0, 0] == pytest.approx(30 * sigma * math.exp(-30 * sigma), rel=1e-4, abs=1e-30)
    assert image.transmittance[0, 0] == pytest.approx(math.exp(-30 * sigma), rel=1e-5, abs=1e-30)
    assert image.distance[0, 0] == 0
    # Away from it: D grows as S does.
    down = pa.Camera(1, 1, fov=0.01, elevation=-90, position=(50, 50, 70))
    image = render(cloud, replace(J, sigma_t=sigma), down, pa.Sun(90), method=method)
    exact = math.exp(-30 * sigma) * -math.expm1(-140 * sigma) / 2
    assert image.single[0, 0, 0] == pytest.approx(exact, rel=1e-4, abs=1e-30)


def test_the_eye_inside_sees_all_round():
    camera = pa.Camera(16, 12, fov=170, position=(320, 320, 1000))
    fast, exact = (render(HEAP, replace(J, sigma_t=0.02), camera, SUN, method=m) for m in ("fast", "reference"))
    assert (exact.distance[exact.transmittance < 1] < 700).all(), "half of the box's diagonal"
    assert rel(fast.single, exact.single) < 1e-2
    np.testing.assert_allclose(fast.transmittance, exact.transmittance, rtol=1e-4)


def test_a_sun_below_the_horizon_lights_from_below():
    cloud = Volume(np.ones((10, 10, 10)), 10.0)
    camera = pa.Camera.look_at((-5000, 50, 20), (50, 50, 20), 1, 1, fov=0.01)
    image = render(cloud, replace(J, sigma_t=0.02), camera, pa.Sun(-90))
    assert image.single[0, 0, 0] == pytest.approx(math.exp(-0.4) * -math.expm1(-2), rel=1e-4)
    for elevation in (-5.0, -60.0):
        fast, exact = (render(HEAP, J, VIEW, pa.Sun(elevation, 30), method=m).single for m in ("fast", "reference"))
        assert rel(fast, exact) < 1e-2


@pytest.mark.parametrize("method", ["fast", "reference"])
def test_rays_in_faces_and_edges(method):
    cloud = Volume(np.ones((4, 4, 4)), 25.0)
    for y, z in ((0, 50), (100, 50), (50, 0), (0, 0), (100, 100), (-1e-9, 50), (1e-9, 50), (50, 100 - 1e-9)):
        camera = pa.Camera.look_at((-300, y, z), (50, y, z), 1, 1, fov=0.01)
        for sun in (pa.Sun(90), pa.Sun(-90), pa.Sun(0, 0), pa.Sun(0, 90), pa.Sun(30, 45)):
            image = render(cloud, replace(J, sigma_t=0.01), camera, sun, method=method)
            s, j = -math.log(image.transmittance[0, 0]) / 0.01, image.single[0, 0, 0]
            assert min(abs(s), abs(s - 100)) < 1e-2, (y, z)
            assert 0 <= j <= 1 - math.exp(-1) + 1e-5


def test_hair_thin_and_opaque():
    deepest = float(Basis.precompute(HEAP, VIEW, SUN, sigma_t=[1.0]).depth.max())
    thin = render(HEAP, replace(J, sigma_t=1e-6 / deepest), VIEW, SUN)
    depth = Basis.precompute(HEAP, VIEW, SUN, sigma_t=[1.0]).depth
    assert rel(thin.single[..., 0], depth * 1e-6 / deepest) < 1e-5
    for method in ("fast", "reference"):
        thick = render(HEAP, replace(J, sigma_t=1e4 / deepest), VIEW, SUN, method=method)
        given = thick.single[..., 0]
        assert (given <= (1 - thick.transmittance) * (1 + 1e-5)).all(), "no more than is taken from the beam"
        assert thick.single.max() > 0.05, "the lit skin of an opaque cloud is bright"


def test_opaque_fast_agrees_with_opaque_reference():
    deepest = float(Basis.precompute(HEAP, VIEW, SUN, sigma_t=[1.0]).depth.max())
    p = replace(J, sigma_t=1e3 / deepest)
    fast, exact = (render(HEAP, p, VIEW, SUN, method=m).single for m in ("fast", "reference"))
    assert rel(fast, exact) < 0.05  # tens of optical depths in a voxel


@pytest.mark.parametrize("scale", [(1, 1, 20), (50, 1, 1), (3, 7, 0.2)])
def test_anisotropic_voxels(scale):
    rng = np.random.default_rng(1)
    data = rng.random((9, 9, 9))
    for axis in range(3):
        data = (np.roll(data, 1, axis) + 2 * data + np.roll(data, -1, axis)) / 4
    cloud = Volume(data, scale)
    middle, size = np.array(scale) * 4.5, np.linalg.norm(np.array(scale) * 9)
    camera = pa.Camera.look_at(middle - np.array([0.8, 0.5, 0.2]) * 3 * size, middle, 21, 15, fov=15)
    sigma = 3 / size
    basis = Basis.precompute(cloud, camera, SUN, sigma_t=[sigma])
    assert basis.depth.max() > 0
    exact = render(cloud, replace(J, sigma_t=sigma), camera, SUN, method="reference").single[..., 0]
    assert rel(basis.scattered[0], exact) < 5e-3
    # Metres are metres: the same cloud and view, ten times as large, at a tenth of the extinction.
    large = Volume(data, np.array(scale) * 10)
    far = pa.Camera.look_at((middle - np.array([0.8, 0.5, 0.2]) * 3 * size) * 10, middle * 10, 21, 15, fov=15)
    other = render(large, replace(J, sigma_t=sigma / 10), far, SUN).single[..., 0]
    assert rel(other, basis.scattered[0]) < 1e-4


@pytest.mark.parametrize("sun", [pa.Sun(40, 270), pa.Sun(40, 180), pa.Sun(70, 30)], ids=["front", "side", "high"])
def test_a_rough_field(sun, rough):
    cloud = rough
    assert 0.01 < cloud.density.max() < 0.2, "extinction in 1/m"
    camera = pa.Camera.look_at((-1500, 370, 900), (320, 370, 940), 24, 18, fov=28)
    fast, exact = (render(cloud, replace(J, sigma_t=1.0), camera, sun, method=m) for m in ("fast", "reference"))
    assert (exact.transmittance < 0.1).any()
    assert rel(fast.single, exact.single) < 1e-2  # up to 2 optical depths in a voxel
    np.testing.assert_allclose(fast.transmittance, exact.transmittance, rtol=1e-5)


def test_a_picture_of_one_pixel():
    image = render(HEAP, J, VIEW.resized(1, 1), SUN)
    assert image.rgb.shape == (1, 1, 3)
    assert Basis.precompute(HEAP, VIEW.resized(1, 1), SUN).image(Params(sigma_t=0.02)).shape == (1, 1, 3)


# ---- Input.


@pytest.mark.parametrize(
    ("density", "word"),
    [
        (np.full((2, 2, 2), np.nan), r"density.*nan|density.*NaN"),
        (np.full((2, 2, 2), np.inf), "density"),
        (np.full((2, 2, 2), -1e-9), "density.*negative"),
        (np.full((2, 2, 2), 1e39), "density"),
        (np.ones((2, 2)), "density"),
        (np.ones((1, 2, 2, 2)), "density"),
        (np.ones((0, 2, 2)), "density"),
        (np.ones((2, 2, 2), complex), "density"),
        ([["a"]], "density"),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
def test_densities_are_refused_by_name(density, word):
    with pytest.raises((ValueError, TypeError), match=word):
        Volume(density)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"voxel_size": 0}, "voxel_size"),
        ({"voxel_size": (1, 2)}, "voxel_size"),
        ({"voxel_size": (1, -2, 1)}, "voxel_size"),
        ({"voxel_size": np.nan}, "voxel_size"),
        ({"origin": (0, 0, np.inf)}, "origin"),
        ({"origin": 3.0}, "origin"),
    ],
)
def test_sizes_are_refused_by_name(change, word):
    with pytest.raises((ValueError, TypeError), match=word):
        Volume(np.ones((2, 2, 2)), **change)


@pytest.mark.filterwarnings("error")
def test_a_density_too_large_for_single_precision_is_refused_without_a_warning():
    with pytest.raises(ValueError, match="density"):
        Volume(np.full((2, 2, 2), 1e39))


# Clouds have 0.1 / m. The reference, which goes from face to face, loses the face to rounding from 1e12 / m on.
@pytest.mark.parametrize(
    ("method", "density"), [("fast", 1e3), ("fast", 1e15), ("fast", 1e36), ("reference", 1e3), ("reference", 1e9)]
)
def test_enormous_densities_are_a_surface(method, density):
    cloud = Volume(np.full((3, 3, 3), density), 10.0)
    camera = pa.Camera.look_at((-100, 15, 15), (15, 15, 15), 4, 3, fov=5)
    # A surface: light that comes in at a slant and leaves along the view (Lommel and Seeliger).
    slant = -pa.Sun(40, 250).direction[0]
    image = render(cloud, replace(J, sigma_t=1.0), camera, pa.Sun(40, 250), sky=(1, 1, 1), method=method)
    assert not image.transmittance.any()
    assert image.distance == pytest.approx(100, rel=2e-3)
    assert image.single == pytest.approx(slant / (slant + 1), rel=1e-3)
    assert image.rgb == pytest.approx(image.single, rel=1e-6), "no sky comes through"


@pytest.mark.parametrize(("method", "density"), [("fast", 1e37), ("reference", 1e15)])
def test_a_cloud_too_dense_for_a_method_is_refused(method, density):
    cloud = Volume(np.full((3, 3, 3), density), 10.0)
    camera = pa.Camera.look_at((-100, 15, 15), (15, 15, 15), 4, 3, fov=5)
    with pytest.raises(ValueError, match=r"sigma_t times the largest density .*1/m"):
        render(cloud, replace(J, sigma_t=1.0), camera, pa.Sun(40, 250), sky=(1, 1, 1), method=method)


def test_any_layout_of_memory_gives_the_same_cloud():
    plain = np.ascontiguousarray(HEAP.density)
    padded = np.zeros((48, 32, 64), np.float32)
    padded[::2, :, ::2] = plain
    read_only = plain.copy()
    read_only.setflags(write=False)
    layouts = (
        plain.astype(np.float64),
        np.asfortranarray(plain),
        padded[::2, :, ::2],
        plain[::-1].copy()[::-1],
        plain.astype(">f4"),
        plain.astype(">f8"),
        read_only,
        plain.tolist(),
    )
    for other in layouts:
        assert Volume(other, HEAP.voxel_size, HEAP.origin) == HEAP


def test_input_is_neither_changed_nor_shared():
    mine = np.array(HEAP.density)
    before, sky = mine.copy(), np.random.default_rng(0).random((15, 20, 3)).astype(np.float32)
    kept = sky.copy()
    cloud = Volume(mine)
    render(cloud, J, VIEW, SUN, sky=sky)
    np.testing.assert_array_equal(mine, before)
    np.testing.assert_array_equal(sky, kept)
    mine[:] = 7
    np.testing.assert_array_equal(cloud.density, before)
    with pytest.raises(ValueError, match="read-only"):
        cloud.density[0, 0, 0] = 1


# ---- Files.


@pytest.mark.parametrize("ending", [".npz", ".npy", ".vol"])
def test_a_volume_comes_back(tmp_path, ending):
    cloud = Volume(HEAP.density, (20, 25, 12.5), (-4, 8, 800))
    back = load(cloud.save(tmp_path / f"cloud{ending}"))
    np.testing.assert_array_equal(back.density, cloud.density)
    if ending == ".npy":
        back = load(tmp_path / "cloud.npy", voxel_size=cloud.voxel_size, origin=cloud.origin)
    np.testing.assert_allclose(back.bounds, cloud.bounds, rtol=1e-6)
    assert (back == cloud) or ending == ".vol"
    assert [p.name for p in tmp_path.iterdir()] == [f"cloud{ending}"]


def test_a_vol_is_what_mitsuba_reads(tmp_path):
    data = Volume(np.arange(24.0).reshape(2, 3, 4), 5.0).save(tmp_path / "a.vol").read_bytes()
    assert data[:4] == b"VOL\x03"
    assert np.frombuffer(data, "<i4", 5, 4).tolist() == [1, 4, 3, 2, 1]
    assert np.frombuffer(data, "<f4", 6, 24).tolist() == [0, 0, 0, 20, 15, 10]
    assert np.frombuffer(data, "<f4", -1, 48).tolist() == list(range(24))


def damaged(path):
    """Ways in which a file may be broken, each written in turn."""
    whole = path.read_bytes()
    n = len(whole)
    cuts = [whole[: n * k // 7] for k in range(7)]
    flips = []
    for at in [*range(max(0, n - 300), n, 3), *range(0, min(n, 200), 3), *np.random.default_rng(0).integers(0, n, 40)]:
        flips.append(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1 :])
    return cuts, flips


def attempt(read, path):
    """What was read, or None and the words of the ValueError; any other error passes."""
    try:
        return read(path), ""
    except ValueError as error:
        return None, str(error)


@pytest.mark.parametrize("ending", [".npz", ".npy", ".vol"])
def test_damaged_volumes_are_refused_by_file_name(tmp_path, ending):
    path = HEAP.save(tmp_path / f"cloud{ending}")
    whole = load(path)
    cuts, flips = damaged(path)
    for content in [*cuts, b"", b"this is a text\n" * 9]:
        path.write_bytes(content)
        with pytest.raises(ValueError, match=f"cloud{ending}"):
            load(path)
    for content in flips:
        path.write_bytes(content)
        found, words = attempt(load, path)
        # Raw formats carry no checksum; an archive may hide a flip only outside what it holds.
        assert f"cloud{ending}" in words if found is None else ending != ".npz" or found == whole


def test_foreign_archives_are_refused_by_file_name(tmp_path):
    np.savez(tmp_path / "other.npz", a=np.ones(3))
    np.savez(tmp_path / "half.npz", pleinair_kind=np.array("volume/1"), density=np.ones((2, 2, 2)))
    np.savez(tmp_path / "objects.npz", pleinair_kind=np.array({"a": 1}, dtype=object))
    basis = Basis.precompute(HEAP, VIEW, SUN, sigma_t=[0.01]).save(tmp_path / "basis.npz")
    HEAP.save(tmp_path / "a.npz").rename(tmp_path / "archive.npy")
    HEAP.save(tmp_path / "a.npy").rename(tmp_path / "array.npz")
    np.save(tmp_path / "text.npy", np.array(["a"]))
    for name in ("other.npz", "half.npz", "objects.npz", basis.name, "archive.npy", "array.npz", "text.npy"):
        with pytest.raises(ValueError, match=name):
            load(tmp_path / name)
    for name in ("other.npz", "half.npz"):
        with pytest.raises(ValueError, match=name):
            Basis.load(tmp_path / name)
    with pytest.raises(FileNotFoundError, match=r"none\.vol"):
        load(tmp_path / "none.vol")
    with pytest.raises(ValueError, match=r"\.npz, \.npy or \.vol"):
        HEAP.save(tmp_path / "cloud.txt")


def test_a_basis_comes_back_whole(tmp_path):
    camera, how = replace(VIEW, roll=7.5, azimuth=0.1 + 0.2), Conventions("paper", "integral-one", "linear", "distance")
    basis = Basis.precompute(HEAP, camera, pa.Sun(33.3, 1 / 3), conventions=how)
    back = Basis.load(basis.save(tmp_path / "b.npz"))
    assert (back.camera, back.sun, back.conventions) == (basis.camera, basis.sun, basis.conventions)
    for name in ("depth", "distance", "cosine", "sigma_t", "scattered"):
        one, two = getattr(basis, name), getattr(back, name)
        assert one.dtype == two.dtype
        np.testing.assert_array_equal(one, two)
    p = Params(sigma_t=float(basis.sigma_t[3]) * 1.1, haze=(0.1, 0.2, 0.3))
    np.testing.assert_array_equal(back.image(p, (0.1, 0.2, 0.3)), basis.image(p, (0.1, 0.2, 0.3)))
    path = tmp_path / "b.npz"
    cuts, flips = damaged(path)
    for content in [*cuts, b"", b"text" * 99]:
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"b\.npz"):
            Basis.load(path)
    for content in flips:
        path.write_bytes(content)
        again, words = attempt(Basis.load, path)
        assert "b.npz" in words if again is None else np.array_equal(again.scattered, basis.scattered)


# ---- Progress and refusals.


@pytest.mark.parametrize("work", ["render", "reference", "basis", "procedural"])
def test_progress_rises_to_its_total(work):
    seen = []
    calls = {
        "render": lambda f: render(HEAP, J, VIEW, SUN, progress=f),
        "reference": lambda f: render(HEAP, J, VIEW, SUN, method="reference", progress=f),
        "basis": lambda f: Basis.precompute(HEAP, VIEW, SUN, progress=f),
        "procedural": lambda f: pa.clouds.procedural("cumulus", (64, 96, 96), rng=1, progress=f),
    }
    calls[work](lambda done, total: seen.append((done, total)))
    assert len({total for _, total in seen}) == 1
    assert seen[-1][0] == seen[-1][1]
    assert [d for d, _ in seen] == sorted(d for d, _ in seen)
    assert all(0 <= d <= t for d, t in seen)
    with pytest.raises(TypeError, match="progress"):
        calls[work]("yes")


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"orders": 0}, "orders"),
        ({"method": "slow"}, "method"),
        ({"sky": (1, 2)}, "sky"),
        ({"sky": np.ones((3, 4, 3))}, "sky"),
        ({"sky": (0, np.nan, 0)}, "sky"),
    ],
)
def test_what_render_refuses(change, word):
    with pytest.raises(ValueError, match=word):
        render(HEAP, J, VIEW, SUN, **change)


@pytest.mark.parametrize(
    "change",
    [
        {"g": 1.0},
        {"g": -1.0},
        {"sigma_t": -1},
        {"sigma_t": "thick"},
        {"albedo": 1.1},
        {"ambient": np.nan},
        {"haze": (0, -1, 0)},
        {"light_intensity": -1},
        {"light_color": (1, 1)},
    ],
)
def test_what_params_refuse(change):
    with pytest.raises((ValueError, TypeError), match=next(iter(change))):
        Params(**change)


def test_a_basis_refuses_what_it_does_not_span():
    basis = Basis.precompute(HEAP, VIEW, SUN, sigma_t=[0.01, 0.02])
    for sigma in (0.0099, 0.0201, 0.0):
        with pytest.raises(ValueError, match="sigma_t"):
            basis.image(Params(sigma_t=sigma))
    for nodes in ([], [0.0, 0.1], [0.2, 0.1], [0.1, 0.1], [np.nan], [-0.1, 0.1], [[0.1]]):
        with pytest.raises(ValueError, match="sigma_t"):
            Basis.precompute(HEAP, VIEW, SUN, sigma_t=nodes)


@pytest.mark.parametrize("sigma", [0.0, 1e-45, 1e-40, 1e-20, 1e-12, 1e-6, 1e-4, 1e-3, 0.01, 0.1])
@pytest.mark.parametrize("ambient", ["extinction", "paper"])
def test_the_ambient_term_of_the_thinnest_cloud(sigma, ambient):
    """(1 - exp(-sigma S)) / sigma tends to S: 100 m here, not 0 and not NaN."""
    cloud = Volume(np.ones((4, 4, 4), np.float32), 25.0)
    camera = pa.Camera.look_at((50, -1000, 50), (50, 50, 50), 3, 3, fov=1)
    params = Params(sigma_t=sigma, light_intensity=0.0, ambient=0.5)
    conventions = Conventions(ambient=ambient)
    seen = render(cloud, params, camera, pa.Sun(40, 180), conventions=conventions).rgb[1, 1, 0]
    wanted = 0.5 * (
        -np.expm1(-sigma * 100.0) if ambient == "extinction" else -np.expm1(-sigma * 100.0) / sigma if sigma else 100.0
    )
    # Below 1e-38 single floats have steps of 1.4e-45, and sigma is one of them.
    assert seen == pytest.approx(wanted, rel=1e-5, abs=1e-43)

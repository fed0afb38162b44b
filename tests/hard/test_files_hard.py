"""Files that lie, files that are links, disks that are full, pickles at odd addresses: a right answer or a named error."""

import io
import os
import pickle
import stat
import zipfile

import numpy as np
import pleinair as pa
import pytest
from PIL import Image

CLOUD = pa.clouds.procedural("cumulus", (8, 12, 12), rng=1)


def basis():
    camera = pa.Camera.look_at((120, -900, 900), (120, 120, 880), 12, 9, fov=20)
    return pa.clouds.Basis.precompute(CLOUD, camera, pa.Sun(40, 200), orders=3, samples=2, rng=0)


def at_odd_addresses(thing):
    """Pickle with out-of-band buffers, each put one byte after an aligned address, as Dask's transport may."""
    buffers = []
    data = pickle.dumps(thing, protocol=5, buffer_callback=buffers.append)
    moved = []
    for buffer in buffers:
        raw = buffer.raw()
        room = np.zeros(raw.nbytes + 65, np.uint8)
        start = -room.ctypes.data % 64 + 1
        room[start : start + raw.nbytes] = np.frombuffer(raw, np.uint8)
        moved.append(memoryview(room)[start : start + raw.nbytes])
    return pickle.loads(data, buffers=moved), len(moved)


def test_pickles_whose_arrays_are_not_aligned():
    found, count = at_odd_addresses(CLOUD)
    assert count == 1
    assert found == CLOUD
    assert found.density.flags.aligned
    images = basis()
    copy, _ = at_odd_addresses(images)
    params = pa.clouds.Params(sigma_t=0.02, g=0.5)
    np.testing.assert_array_equal(copy.image(params, (0.1, 0.2, 0.4)), images.image(params, (0.1, 0.2, 0.4)))
    picture = np.full((32, 32, 3), (0.1, 0.3, 0.8), np.float32)
    picture[8:20, 8:24] = np.linspace(0.3, 0.9, 16)[:, None]
    photo = pa.fit.Photo.analyse(picture, ground=None)
    again, _ = at_odd_addresses(photo)
    one, two = (pa.fit.clouds(p, images, generations=2, rng=0).history for p in (photo, again))
    np.testing.assert_array_equal(one, two)
    strokes = pa.paint.Strokes([[0, 12, 1]], (0, -1, 0), (4, 4))
    moved, _ = at_odd_addresses(strokes)
    style, light, camera = pa.paint.style("corot"), pa.paint.Light((0, -1, 1)), pa.Camera(32, 24)
    a, b = (pa.paint.render([s], style, camera, light).rgb for s in (strokes, moved))
    np.testing.assert_array_equal(a, b)


def test_a_file_of_another_kind_is_not_read_through(tmp_path):
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in (("pleinair_kind", np.array("basis/2")), ("density", np.zeros(50_000_000, np.float32))):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, array)
    before = pa.io.files.read_array
    read = []
    pa.io.files.read_array = lambda stream, size: read.append(size) or before(stream, size)
    try:
        with pytest.raises(ValueError, match="must hold 'volume/1', it holds 'basis/2'"):
            pa.clouds.load(path)
    finally:
        pa.io.files.read_array = before
    assert len(read) == 1, "its name only"
    assert read[0] < 4096


def header(shape):
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f4", "fortran_order": False, "shape": shape})
    return stream.getvalue()


def test_a_header_that_claims_more_than_there_is(tmp_path):
    (tmp_path / "a.npy").write_bytes(header((1700, 1700, 1700)) + b"\0" * 64)
    with pytest.raises(ValueError, match=r"a\.npy is damaged.*does not fit into \d+ bytes"):
        pa.clouds.load(tmp_path / "a.npy")
    path = CLOUD.save(tmp_path / "a.npz")
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members["density.npy"] = header((1700, 1700, 1700)) + b"\0" * 64
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    with pytest.raises(ValueError, match=r"a\.npz is damaged.*does not fit into \d+ bytes"):
        pa.clouds.load(path)


DAMAGES = {
    "NaN in an image": ("scattered", lambda a: np.where(np.arange(a.size).reshape(a.shape) == 3, np.nan, a)),
    "negative depth": ("depth", lambda a: a - 1),
    "NaN depth": ("depth", lambda a: a * np.nan),
    "images of float64": ("scattered", lambda a: a.astype(np.float64)),
    "pixels of another kind": ("pixels", lambda a: a.astype(np.int64) - 1),
    "pixels that are not there": ("pixels", lambda a: a + np.uint32(10**6)),
    "nodes that fall": ("sigma_t", lambda a: a[::-1]),
    "text": ("depth", lambda a: a.astype(str)),
}


@pytest.mark.parametrize("what", DAMAGES)
def test_a_basis_that_could_not_be_used_is_not_loaded(tmp_path, what):
    path = basis().save(tmp_path / "b.npz")
    with np.load(path) as stored:
        arrays = dict(stored)
    name, damage = DAMAGES[what]
    arrays[name] = damage(arrays[name])
    np.savez_compressed(path, **arrays)
    with pytest.raises(ValueError, match=r"b\.npz is damaged"):
        pa.clouds.Basis.load(path)


def test_orders_that_are_no_number(tmp_path):
    path = basis().save(tmp_path / "b.npz")
    with np.load(path) as stored:
        arrays = dict(stored)
    arrays["about"] = np.array(str(arrays["about"]).replace('"orders": 3', '"orders": "many"'))
    np.savez_compressed(path, **arrays)
    with pytest.raises(ValueError, match=r"orders must be a number or None, it is 'many'"):
        pa.clouds.Basis.load(path)


HUGE = [
    (lambda: pa.Sun(10**400), r"elevation must be in \[-90, 90\] \[°\], got a number that no float holds"),
    (lambda: pa.clouds.Params.from_json('{"g": 1' + "0" * 400 + "}"), "text must be JSON of a Params: g must be"),
    (lambda: pa.clouds.Params.from_json("[" * 100_000), "text must be JSON of a Params"),
    (lambda: pa.sky.from_json("[" * 100_000), "text must be JSON of a sky"),
    (lambda: pa.clouds.Params.from_json('{"gee": 1}'), "a Params has no field 'gee'"),
    (lambda: pa.clouds.Params.from_json('{"sigmat": 1}'), "no field 'sigmat': did you mean 'sigma_t'"),
]


@pytest.mark.parametrize(("call", "message"), HUGE, ids=range(len(HUGE)))
def test_what_no_number_holds_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_a_new_file_is_that_of_open_and_an_old_one_keeps_its_permissions(tmp_path):
    old = os.umask(0o027)
    try:
        path = pa.io.write(tmp_path / "a.png", np.zeros((2, 2, 3)))
    finally:
        os.umask(old)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    path.chmod(0o600)
    pa.io.write(path, np.ones((2, 2, 3)))
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_link_is_followed(tmp_path):
    (tmp_path / "real").mkdir()
    target = pa.io.write(tmp_path / "real" / "a.png", np.zeros((2, 2, 3)))
    (tmp_path / "link.png").symlink_to(target)
    pa.io.write(tmp_path / "link.png", np.ones((2, 2, 3)))
    assert (tmp_path / "link.png").is_symlink()
    np.testing.assert_array_equal(pa.io.read(target), 1)


def test_a_name_as_long_as_the_disk_allows(tmp_path):
    path = pa.io.write(tmp_path / ("n" * 251 + ".png"), np.zeros((2, 2, 3)))
    assert path.exists()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("ending", ["jpg", "png", "hdr", "pfm"])
def test_a_full_disk_leaves_the_old_picture(tmp_path, monkeypatch, ending):
    path = pa.io.write(tmp_path / f"a.{ending}", np.full((40, 40, 3), 0.5, np.float32))
    before = path.read_bytes()

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space left"):
        pa.io.write(path, np.random.default_rng(0).random((40, 40, 3)))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_picture_is_encoded_before_a_file_is_touched(tmp_path, monkeypatch):
    """Pillow may write a JPEG in part and not say so: it never sees the file."""
    seen = []
    save = Image.Image.save
    monkeypatch.setattr(Image.Image, "save", lambda self, to, *a, **k: seen.append(type(to)) or save(self, to, *a, **k))
    pa.io.write(tmp_path / "a.jpg", np.zeros((4, 4, 3)))
    assert seen == [io.BytesIO]


@pytest.mark.parametrize("ending", ["exr", "hdr", "pfm"])
def test_views_of_every_kind_are_written_as_they_look(tmp_path, ending):
    """OpenEXR's own module writes a view in the order of memory."""
    picture = np.random.default_rng(0).random((6, 8, 3)).astype(np.float32)
    for view in (picture[::-1], picture[:, ::-1], picture[..., ::-1], picture.swapaxes(0, 1), picture[::2, 1::2]):
        found = pa.io.read(pa.io.write(tmp_path / f"a.{ending}", view))
        np.testing.assert_allclose(found, view, atol=0 if ending != "hdr" else 1 / 256)

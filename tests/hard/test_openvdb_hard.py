"""OpenVDB files that lie, end early or are too large: a sentence with the file's name, before memory is taken."""

import resource
import struct
from pathlib import Path

import numpy as np
import pleinair as pa
import pytest
from pleinair._core import openvdb_grids, openvdb_read

VOLUMES = Path(__file__).parents[1] / "data" / "volumes"


def everything(data):
    for k in range(len(openvdb_grids(data)[0])):
        openvdb_read(data, k, False, 1 << 22)


@pytest.mark.parametrize("name", ["none_active", "zip_active_half", "blosc_all", "two_grids", "instance"])
def test_every_cut_is_refused(name):
    data = (VOLUMES / f"{name}.vdb").read_bytes()
    everything(data)
    for cut in [*range(0, len(data), 97), *range(600), *range(len(data) - 200, len(data))]:
        with pytest.raises(ValueError, match="file: "):
            everything(data[:cut])


def test_thousands_of_mutations():
    rng = np.random.default_rng(0)
    files = [(VOLUMES / f"{n}.vdb").read_bytes() for n in ("float_dense", "blosc_all", "zip_active", "tiles_leaf")]
    read, said = 0, []
    for k in range(3000):
        data = bytearray(files[k % 4])
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(data) if rng.random() < 0.5 else 900))
            data[at : at + 4] = int(rng.choice([0, 1, 255, 2**31 - 1, 2**32 - 1, rng.integers(2**32)])).to_bytes(
                4, "little"
            )
        try:
            everything(bytes(data))
            read += 1
        except ValueError as error:
            said.append(str(error))
    assert not [text for text in said if "panick" in text]
    assert 100 < read < 2900


def test_a_grid_of_many_gigabytes_is_refused_before_memory_is_taken(tmp_path):
    data = (VOLUMES / "two_grids.vdb").read_bytes()
    far = bytearray((VOLUMES / "tiles_big_negative.vdb").read_bytes())
    root = struct.pack("<3i", -4096, -4096, -4096)
    at = far.index(root)
    far[at : at + 12] = struct.pack("<3i", -4096 * 2**10, -4096, -4096)
    path = tmp_path / "far.vdb"
    path.write_bytes(far)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ValueError, match=r"far.vdb: .* voxels \(\d+\.\d+ GB\); max_voxels is 268435456"):
        pa.clouds.load(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"8 x 9 x 10 voxels .* max_voxels is 719"):
        pa.clouds.load(path, max_voxels=719)
    assert pa.clouds.load(path, max_voxels=720).density.shape == (10, 9, 8)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_value_that_is_not_finite_is_named(tmp_path, value):
    data = (VOLUMES / "none_active.vdb").read_bytes()
    plain = struct.pack("<f", 0.96484375)
    assert data.count(plain) == 1
    path = tmp_path / "bad.vdb"
    path.write_bytes(data.replace(plain, struct.pack("<f", value)))
    with pytest.raises(ValueError, match=r"bad.vdb: .*(NaN|inf) at index \(7, 8, 9\) \(grid 'density'\)"):
        pa.clouds.load(path)


def test_a_background_that_is_not_zero_is_kept_and_said():
    with pytest.warns(pa.DomainWarning, match=r"'density' is 0.5 everywhere outside"):
        cloud = pa.clouds.load(VOLUMES / "background_half.vdb")
    assert cloud.density[4, 4, 2] == 0.0  # (i + j + k) % 5 == 0: active there
    assert cloud.density[9, 8, 7] == np.float32(0.96484375)


def test_a_frustum_is_refused_by_name(tmp_path):
    data = (VOLUMES / "none_active.vdb").read_bytes().replace(b"UniformScaleMap", b"UniformFrustumX")
    path = tmp_path / "frustum.vdb"
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"frustum.vdb has 'density' .*UniformFrustumX is not affine"):
        pa.clouds.load(path)


def test_an_empty_grid_is_one_empty_voxel():
    cloud = pa.clouds.load(VOLUMES / "empty.vdb")
    assert cloud.density.tolist() == [[[0.0]]]


def test_other_files_and_options_are_refused(tmp_path):
    path = tmp_path / "a.vdb"
    path.write_bytes(b"PK\3\4 no volume at all")
    with pytest.raises(ValueError, match=r"a.vdb: file: is no OpenVDB file"):
        pa.clouds.load(path)
    with pytest.raises(ValueError, match=r"time is no option of this kind of file: a.vdb"):
        pa.clouds.load(path, time=1)


def test_foreign_archives_and_raw_numbers(tmp_path):
    field = np.arange(24, dtype=np.float64).reshape(2, 3, 4)
    np.savez(tmp_path / "two.npz", water=field, ice=2 * field, time=np.arange(3))
    with pytest.raises(ValueError, match=r"two.npz .*water \(2, 3, 4\) float64, ice .*time \(3,\)"):
        pa.clouds.load(tmp_path / "two.npz")
    assert np.array_equal(pa.clouds.load(tmp_path / "two.npz", grid="ice").density, 2 * field)
    np.savez(tmp_path / "one.npz", field=field, voxel_size=np.array([1.0, 2.0, 3.0]))
    assert pa.clouds.load(tmp_path / "one.npz").voxel_size == (1, 2, 3)
    (tmp_path / "a.raw").write_bytes(field.astype(">u2").tobytes())
    cloud = pa.clouds.load(tmp_path / "a.raw", dtype=">u2", shape=(2, 3, 4), voxel_size=(1, 1, 20))
    assert np.array_equal(cloud.density, field)
    with pytest.raises(ValueError, match=r"a.raw has 48 bytes, shape \(2, 3, 5\) of >u2 needs 60"):
        pa.clouds.load(tmp_path / "a.raw", dtype=">u2", shape=(2, 3, 5))


def test_tables_of_at3d_and_shdom_are_the_same_cloud(tmp_path):
    (tmp_path / "a.txt").write_text("# cloud\n3,2,2\n.02,.03\n.5,.54\nx,y,z,lwc,reff\n0,1,1,.2,10\n2,0,0,.1,5\n")
    (tmp_path / "b.part").write_text("2\n3 2 2\n.02 .03\n.5 .54\n290 289\n1 2 2 .2 10\n3 1 1 .1 5\n")
    a, b = pa.clouds.load(tmp_path / "a.txt", sigma=1.0), pa.clouds.load(tmp_path / "b.part", sigma=1.0)
    assert a == b
    assert a.voxel_size == pytest.approx((20, 30, 40))
    assert a.origin == pytest.approx((0, 0, 480))
    # .2 g/m³ of droplets of 10 µm: 1.5 · .2e-3 / (1000 · 10e-6) = .03 per metre.
    assert a.density[1, 1, 0] == pytest.approx(0.03)
    assert a.density[0, 0, 2] == pytest.approx(0.03)
    (tmp_path / "c.txt").write_text("3,2,2\n.02,.03\n.5,.54\nx,y,z,lwc,reff\n3,1,1,.2,10\n")
    with pytest.raises(ValueError, match=r"c.txt: row 1 .* outside of 3 x 2 x 2"):
        pa.clouds.load(tmp_path / "c.txt")


def test_rico(not_committed):
    path = not_committed("volumes/rico32x37x26.txt")
    rows = np.loadtxt(path, delimiter=",", skiprows=5)
    cloud = pa.clouds.load(path, sigma=1.0)
    assert cloud.density.sum(dtype=float) == pytest.approx((1.5 * rows[:, 3] / rows[:, 4]).sum(), rel=1e-6)

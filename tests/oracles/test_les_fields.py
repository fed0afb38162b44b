"""Fields of SAM, CM1 and WRF: extinction at cells against numbers computed beside the files (les.json), and columns."""

import json
from pathlib import Path

import numpy as np
import pleinair as pa
import pytest

VOLUMES = Path(__file__).parents[1] / "data" / "volumes"
EXPECTED = json.loads((VOLUMES / "les.json").read_text())


@pytest.fixture(scope="module")
def netcdf():
    return pytest.importorskip("netCDF4", reason="netCDF4 is not installed")


def at(cloud, x, y, height):
    z = (height - cloud.origin[2]) / cloud.voxel_size[2]
    return cloud.density[int(z), y, x]


def test_sam(netcdf):
    cloud = pa.clouds.load(VOLUMES / "sam_tiny.nc", sigma=1.0)
    for cell in EXPECTED["sam_tiny.nc"]["voxels"]:
        i, j, k = cell["ijk"]
        assert cloud.density[k, j, i] == pytest.approx(cell["extinction_1_per_m"], rel=1e-5)
    half = pa.clouds.load(VOLUMES / "sam_tiny.nc", kind="sam", radius=20e-6)
    assert half.density == pytest.approx(cloud.density / 0.05 / 2, rel=1e-5)


def test_cm1_in_thin_steps(netcdf):
    cloud = pa.clouds.load(VOLUMES / "cm1_tiny.nc", sigma=1.0, step=5.0)
    with netcdf.Dataset(VOLUMES / "cm1_tiny.nc") as data:
        heights = 1000 * np.asarray(data["zh"][:], float)
    for cell in EXPECTED["cm1_tiny.nc"]["voxels"][:2]:
        i, j, k = cell["ijk"]
        assert at(cloud, i, j, heights[k]) == pytest.approx(cell["extinction_1_per_m"], rel=1e-5)
    assert cloud.voxel_size == pytest.approx((50, 50, 5), rel=1e-5)


def test_wrf_in_thin_steps(netcdf):
    cloud = pa.clouds.load(VOLUMES / "wrfout_tiny.nc", sigma=1.0, step=5.0)
    for cell in EXPECTED["wrfout_tiny.nc"]["voxels"][:2]:
        i, j, _ = cell["ijk"]
        assert at(cloud, i, j, cell["height_m"]) == pytest.approx(cell["extinction_1_per_m"], rel=1e-5)


@pytest.mark.parametrize("step", [None, 13.0, 400.0])
def test_columns_keep_their_water(netcdf, step):
    with netcdf.Dataset(VOLUMES / "cm1_tiny.nc") as data:
        data.set_auto_mask(False)
        q, th, p, qv = (np.asarray(data[n][0], float) for n in ("qc", "th", "prs", "qv"))
        thick = 1000 * np.diff(np.asarray(data["zf"][:], float))
    water = q * p / (287.04 * th * (p / 1e5) ** (287.04 / 1005.7) * (1 + 0.608 * qv - q))
    column = np.einsum("kji,k->ji", water, thick)
    cloud = pa.clouds.load(VOLUMES / "cm1_tiny.nc", sigma=1.0, step=step)
    # Radius 10 µm everywhere: extinction is 150 m²/kg times the water.
    assert cloud.density.sum(0, dtype=float) * cloud.voxel_size[2] == pytest.approx(150 * column, rel=1e-5, abs=1e-9)


def test_unknown_content_is_listed(netcdf, tmp_path):
    path = tmp_path / "other.nc"
    with netcdf.Dataset(path, "w") as data:
        data.createDimension("x", 3)
        data.createVariable("rain", "f4", ("x",)).units = "mm"
    with pytest.raises(ValueError, match=r"other.nc is of no model .*it has rain\(x\) \[mm\]"):
        pa.clouds.load(path)
    with pytest.raises(ValueError, match=r"other.nc lacks QC; it has rain"):
        pa.clouds.load(path, kind="sam")
    path.write_bytes((VOLUMES / "sam_tiny.nc").read_bytes()[:300])
    with pytest.raises(ValueError, match=r"other.nc"):
        pa.clouds.load(path)


def test_a_missing_value_and_a_time_that_is_not_there(netcdf, tmp_path):
    path = tmp_path / "hole.nc"
    path.write_bytes((VOLUMES / "sam_tiny.nc").read_bytes())
    with netcdf.Dataset(path, "a") as data:
        data["QN"][0, 1, 2, 3] = np.nan
    with pytest.raises(ValueError, match=r"hole.nc: QN is missing or not finite at \(1, 2, 3\)"):
        pa.clouds.load(path)
    with pytest.raises(ValueError, match=r"time must be in \[-1, 0\]"):
        pa.clouds.load(VOLUMES / "sam_tiny.nc", time=1)
    with pytest.raises(ValueError, match=r"8 x 7 x 9 voxels .* max_voxels is 503"):
        pa.clouds.load(VOLUMES / "sam_tiny.nc", max_voxels=503)


class Labelled:
    """What is asked of an xarray variable or dataset, without xarray."""

    def __init__(self, **has):
        self.__dict__.update(has)

    def __getitem__(self, index):
        return self.values[index]


def test_open_datasets(netcdf):
    cloud = pa.clouds.load(VOLUMES / "wrfout_tiny.nc")
    with netcdf.Dataset(VOLUMES / "wrfout_tiny.nc") as data:
        data.set_auto_mask(False)
        assert pa.clouds.load(data) == cloud
        variables = {
            n: Labelled(dims=v.dimensions, shape=v.shape, values=v[...], attrs={k: v.getncattr(k) for k in v.ncattrs()})
            for n, v in data.variables.items()
        }
        attributes = {k: data.getncattr(k) for k in data.ncattrs()}
    assert pa.clouds.load(Labelled(variables=variables, attrs=attributes)) == cloud

"""Volumes from files: ours, OpenVDB, fields of large-eddy simulations, SHDOM's text, arrays. Public as `clouds.load`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._support.inputs import choice, integer, real, vector
from ..io import (
    DAMAGE,
    UnreadableError,
    foreign_arrays,
    is_dataset,
    raw_array,
    read_array,
    read_arrays,
    read_les,
    read_shdom,
    read_vdb,
    read_vol,
)
from .volume import Volume, triple

_OPTIONS = {
    ".npz": {"grid"},
    ".npy": set(),
    ".vol": set(),
    ".vdb": {"grid", "up", "max_voxels"},
    ".nc": {"kind", "time", "step", "radius", "sigma", "max_voxels"},
    ".txt": {"step", "sigma", "max_voxels"},
    "raw": {"dtype", "shape"},
}
_ALIAS = {".nc4": ".nc", ".cdf": ".nc", ".csv": ".txt", ".dat": ".txt", ".part": ".txt"}


def _ours(path: Path, grid: str | None) -> tuple[Any, Any, Any]:
    """Give density, voxel and origin of an archive: ours, or a foreign one."""
    foreign = foreign_arrays(path, grid)
    if foreign is not None:
        return foreign
    stored = read_arrays(path, "volume/1")
    try:
        return stored["density"], stored["voxel_size"], stored["origin"]
    except KeyError as error:
        msg = f"{path} is damaged: {error} is missing"
        raise UnreadableError(msg) from None


def load(
    path: Any,
    *,
    grid: str | None = None,
    kind: str | None = None,
    voxel_size: Any = None,
    origin: ArrayLike | None = None,
    sigma: float | None = None,
    radius: float | None = None,
    time: int | None = None,
    step: float | None = None,
    up: str | None = None,
    dtype: Any = None,
    shape: tuple[int, int, int] | None = None,
    max_voxels: int | None = None,
) -> Volume:
    """Read a volume: `.npz`, `.npy`, `.vol` (Mitsuba), `.vdb` (OpenVDB), `.nc` (SAM, CM1, WRF), `.txt` (SHDOM, AT3D), raw.

    Densities of .vdb, .npz, .npy, .vol and raw files are kept as they are, without unit: `Params.sigma_t` makes
    extinction [1/m] of them. NetCDF and SHDOM hold liquid water content and effective radius of droplets; their
    extinction is 1.5 lwc / (1000 kg/m³ · radius) [1/m], and the density is that divided by `sigma`, so that
    `Params(sigma_t=sigma)`, the default, renders the field's own optical depth. Uneven levels are resampled to even ones,
    and each column keeps its sum.

    Parameters
    ----------
    path : path or Dataset
        The file, or an open `xarray.Dataset` or `netCDF4.Dataset` of a model.
    grid : str, optional
        Grid of a .vdb, array of an .npz. Without it `density`, or the only one that there is.
    kind : {"sam", "cm1", "wrf"}, optional
        Model of a NetCDF file; by its variables without it.
    voxel_size : float or array_like (3,), optional
        Edge of a voxel [m]; replaces what the file says (20 m for .npy and raw arrays).
    origin : array_like (3,), optional
        Lowest corner of the box [m]; replaces what the file says.
    sigma : float, optional
        Extinction that density 1 stands for [1/m], .05 without it: NetCDF and SHDOM.
    radius : float, optional
        Effective radius of droplets [m] where the file has none, 10e-6 without it: NetCDF.
    time : int, optional
        Which time of a NetCDF file, the first without it [1].
    step : float, optional
        Height of a voxel [m] where levels are uneven, the thinnest layer with water without it.
    up : {"z", "y"}, optional
        Which axis of a .vdb is height; "y" in files of Houdini and many others.
    dtype : dtype, optional
        Of a file of nothing but numbers, x fastest, such as `"<f4"`; any ending.
    shape : (nz, ny, nx), optional
        Voxels of such a file [1].
    max_voxels : int, optional
        Most voxels of a box, 2²⁸ (1 GB) without it; compared before memory is taken [1].

    Returns
    -------
    Volume
        The cloud.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        The file is foreign, damaged or too large, its content is not known (what it has is listed), its density cannot be
        a cloud, or an option is not one of its format.
    ImportError
        NetCDF without netCDF4: `pip install "pleinair[netcdf]"`.

    Examples
    --------
    >>> load("nowhere.npz")
    Traceback (most recent call last):
    FileNotFoundError: there is no file nowhere.npz
    """
    dataset = is_dataset(path)
    if not dataset:
        path = Path(path)
        if not path.exists():
            msg = f"there is no file {path}"
            raise FileNotFoundError(msg)
    name = "the dataset" if dataset else path.name
    suffix = ".nc" if dataset else path.suffix.lower()
    suffix = "raw" if dtype is not None or shape is not None else _ALIAS.get(suffix, suffix)
    if suffix not in _OPTIONS:
        msg = f"path must end in .npz, .npy, .vol, .vdb, .nc or .txt, or have dtype= and shape=, got {name!r}"
        raise ValueError(msg)
    given: dict[str, Any] = {
        "grid": grid,
        "kind": kind,
        "sigma": sigma,
        "radius": radius,
        "time": time,
        "step": step,
        "up": up,
    }
    given |= {"dtype": dtype, "shape": shape, "max_voxels": max_voxels}
    for option, value in given.items():
        if value is not None and option not in _OPTIONS[suffix]:
            msg = f"{option} is no option of this kind of file: {name}"
            raise ValueError(msg)
    most = integer(2**28 if max_voxels is None else max_voxels, "max_voxels", 1, 2**32)
    unit = real(0.05 if sigma is None else sigma, "sigma", 1e-12, 1e9, "1/m")
    drop = real(10e-6 if radius is None else radius, "radius", 1e-7, 1e-3, "m")
    height = None if step is None else real(step, "step", 1e-3, 1e6, "m")
    size: Any = 20.0
    low: Any = (0.0, 0.0, 0.0)
    density: Any
    if suffix == ".npz":
        density, size, low = _ours(path, grid)
    elif suffix == ".vol":
        density, box = read_vol(path)
        nz, ny, nx = density.shape
        size, low = (box[1] - box[0]) / (nx, ny, nz), box[0]
    elif suffix == ".vdb":
        density, size, low = read_vdb(path, grid, choice(up or "z", "up", ("z", "y")) == "y", most)
    elif suffix == ".nc":
        density, size, low = read_les(path, kind, time or 0, drop, height, most, voxel_size)
        density = density / np.float32(unit)
    elif suffix == ".txt":
        density, size, low = read_shdom(path, height, most)
        density = density / np.float32(unit)
    elif suffix == "raw":
        density = raw_array(path, dtype, shape)
    else:
        try:
            with path.open("rb") as stream:
                density = read_array(stream, path.stat().st_size)
        except DAMAGE as error:
            msg = f"{path} is damaged or not an .npy file ({error})"
            raise UnreadableError(msg) from None
    size = size if voxel_size is None else triple(voxel_size, "voxel_size")
    low = low if origin is None else vector(origin, "origin")
    try:
        return Volume(density, size, low)
    except (ValueError, TypeError) as error:
        msg = f"{path if not dataset else name} holds no cloud: {error}"
        raise UnreadableError(msg) from None

"""Clouds of large-eddy simulations in NetCDF: SAM, CM1 and WRF, by the names and units their files state.

Droplets' extinction is 1.5 lwc / (1000 kg/m³ · radius) [1/m]; liquid water content is mixing ratio times the density of air
by the ideal gas law with virtual temperature. Units are read, never guessed. `tests/oracles/test_les_fields.py` holds the
numbers.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._support.inputs import choice, integer, shape_text
from ..files import UnreadableError
from .levels import even, faces_of, fit_in
from .openvdb import Box

KINDS = ("sam", "cm1", "wrf")
_GAS = 287.04  # of dry air [J/(kg K)]
_UNITS = {
    "ratio": {"kg/kg": 1.0, "kg kg-1": 1.0, "kg kg^-1": 1.0, "g/kg": 1e-3, "g kg-1": 1e-3, "g kg^-1": 1e-3},
    "pressure": {"pa": 1.0, "hpa": 100.0, "mb": 100.0, "mbar": 100.0, "millibar": 100.0},
    "length": {"m": 1.0, "km": 1000.0, "meters": 1.0, "metres": 1.0, "meter": 1.0},
    "temperature": {"k": 1.0, "kelvin": 1.0},
    "geopotential": {"m2 s-2": 1.0, "m2/s2": 1.0, "m^2/s^2": 1.0},
}
_ALONG = {"x": {"x", "xh", "ni", "west_east"}, "y": {"y", "yh", "nj", "south_north"}}
_TIMES = {"time", "Time"}


@dataclass(frozen=True)
class _Variable:
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    units: str
    missing: tuple[float, ...]
    part: Callable[[tuple[Any, ...]], Any]


@dataclass(frozen=True)
class _Fields:
    """Variables of a file at one time."""

    name: object
    variables: dict[str, _Variable]
    attributes: dict[str, Any]
    time: int

    def listed(self) -> str:
        """Say what there is."""
        each = self.variables.items()
        text = [f"{n}({', '.join(v.dims)})" + (f" [{v.units}]" if v.units else "") for n, v in each]
        return ", ".join(text) or "no variable"

    def fail(self, what: str) -> UnreadableError:
        """Make an error with the file's name and its list."""
        return UnreadableError(f"{self.name} {what}; it has {self.listed()}")

    def get(self, name: str, quantity: str) -> NDArray[np.float64]:
        """Give a variable at the time wanted, in SI units, without the dimension of time."""
        found = self.variables.get(name)
        if found is None:
            raise self.fail(f"lacks {name}")
        factor = _UNITS[quantity].get(found.units.lower())
        if factor is None:
            raise self.fail(f"has {name} in {found.units!r}; {', '.join(_UNITS[quantity])} are read")
        index: tuple[Any, ...] = ()
        if found.dims and found.dims[0] in _TIMES:
            if not -found.shape[0] <= self.time < found.shape[0]:
                msg = f"time must be in [{-found.shape[0]}, {found.shape[0] - 1}] [1], got {self.time}: {self.name}"
                raise ValueError(msg)
            index = (self.time,)
        values = np.asarray(found.part(index), float)
        unset = ~np.isfinite(values) | np.isin(values, found.missing)
        if unset.any():
            at = shape_text(tuple(int(i) for i in np.unravel_index(int(np.argmax(unset)), values.shape)))
            msg = f"{self.name}: {name} is missing or not finite at {at}, {int(unset.sum())} of {values.size} values"
            raise UnreadableError(msg)
        return values * factor

    def has(self, *names: str) -> bool:
        """Whether all are there."""
        return set(names) <= set(self.variables)


def is_dataset(value: Any) -> bool:
    """Whether this is an open dataset of xarray or netCDF4 (neither is imported)."""
    return hasattr(value, "variables") and (hasattr(value, "attrs") or hasattr(value, "ncattrs"))


def _attributes(of: Any) -> dict[str, Any]:
    return dict(of.attrs) if hasattr(of, "attrs") else {name: of.getncattr(name) for name in of.ncattrs()}


@contextlib.contextmanager
def _opened(path: Any, time: int) -> Iterator[_Fields]:
    """Open a file or take a dataset."""
    name = "the dataset" if is_dataset(path) else path
    with contextlib.ExitStack() as stack:
        data = path
        if not is_dataset(path):
            try:
                import netCDF4  # type: ignore[import-not-found, unused-ignore]
            except ImportError:
                msg = 'NetCDF files need netCDF4: pip install "pleinair[netcdf]"'
                raise ImportError(msg) from None
            try:
                data = stack.enter_context(netCDF4.Dataset(Path(path)))
            except (OSError, RuntimeError, ValueError) as error:
                msg = f"{path} is damaged or no NetCDF file ({error})"
                raise UnreadableError(msg) from None
            # 9.97e36 where nothing was written is found by its number; masks would hide it.
            data.set_auto_mask(False)
        variables = {}
        for key, variable in data.variables.items():
            about = _attributes(variable)
            dims = tuple(variable.dims if hasattr(variable, "dims") else variable.dimensions)
            missing = [about[m] for m in ("_FillValue", "missing_value") if np.size(about.get(m, ())) == 1]
            missing = [float(m) for m in missing if np.asarray(m).dtype.kind in "fiu"]

            def part(index: tuple[Any, ...], variable: Any = variable) -> Any:
                try:
                    return variable[index] if index else variable[...]
                except (OSError, RuntimeError, IndexError) as error:
                    msg = f"{name} is damaged ({error})"
                    raise UnreadableError(msg) from None

            units = str(about.get("units", "")).strip()
            unset = (*missing, float(np.float32(9.969209968386869e36)))
            variables[str(key)] = _Variable(dims, tuple(variable.shape), units, unset, part)
        yield _Fields(name, variables, _attributes(data), time)


def _spacing(fields: _Fields, name: str) -> tuple[float, float]:
    """Step of an axis of cell centres [m] and its first face [m]."""
    centres = fields.get(name, "length").ravel()
    if len(centres) < 2:
        return 0.0, 0.0
    steps = np.diff(centres)
    step = float((centres[-1] - centres[0]) / (len(centres) - 1))
    if step <= 0 or np.abs(steps - step).max() > 2e-3 * step:
        raise fields.fail(f"has uneven steps along {name}, {steps.min():g} to {steps.max():g} m: resample it")
    return step, float(centres[0]) - step / 2


def _density(pressure: Any, temperature: Any, vapour: Any, condensate: Any) -> Any:
    """Density of moist air [kg/m³]."""
    return pressure / (_GAS * temperature * (1 + 0.608 * vapour - condensate))


def _horizontal(fields: _Fields, names: tuple[str, str], given: Any) -> list[tuple[float, float]]:
    """Step and first face along x and y [m]; an axis of one cell has the other's step."""
    if given is not None:
        return [(1.0, 0.0), (1.0, 0.0)]
    (dx, x0), (dy, y0) = (_spacing(fields, name) for name in names)
    if max(dx, dy) == 0:
        raise fields.fail("has one column, whose width is not known: give voxel_size")
    dx, dy = dx or dy, dy or dx
    return [(dx, x0), (dy, y0)]


def _sam(f: _Fields, given: Any) -> tuple[Any, ...]:
    water = "QN" if f.has("QN") else "QC"
    q = f.get(water, "ratio")
    vapour = f.get("QV", "ratio") if f.has("QV") else 0.0
    air = _density(f.get("p", "pressure")[:, None, None], f.get("TABS", "temperature"), vapour, q)
    return q * air, None, faces_of(f.get("z", "length")), *_horizontal(f, ("x", "y"), given)


def _cm1(f: _Fields, given: Any) -> tuple[Any, ...]:
    q, pressure = f.get("qc", "ratio"), f.get("prs", "pressure")
    vapour = f.get("qv", "ratio") if f.has("qv") else 0.0
    temperature = f.get("th", "temperature") * (pressure / 1e5) ** (_GAS / 1005.7)
    faces = f.get("zf", "length") if f.has("zf") else faces_of(f.get("zh", "length"))
    return q * _density(pressure, temperature, vapour, q), None, faces, *_horizontal(f, ("xh", "yh"), given)


def _wrf(f: _Fields, given: Any) -> tuple[Any, ...]:
    q, pressure = f.get("QCLOUD", "ratio"), f.get("P", "pressure") + f.get("PB", "pressure")
    vapour = f.get("QVAPOR", "ratio") if f.has("QVAPOR") else 0.0
    temperature = (300 + f.get("T", "temperature")) * (pressure / 1e5) ** (2 / 7)
    faces = (f.get("PH", "geopotential") + f.get("PHB", "geopotential")) / 9.81
    radii = f.get("RE_CLOUD", "length") if f.has("RE_CLOUD") else None
    if given is None and not {"DX", "DY"} <= set(f.attributes):
        raise f.fail("lacks its global attributes DX and DY: give voxel_size")
    dx, dy = (float(f.attributes[k]) if given is None else 1.0 for k in ("DX", "DY"))
    return q * _density(pressure, temperature, vapour, q), radii, faces, (dx, 0.0), (dy, 0.0)


def read_les(
    path: Any, kind: str | None, time: int, radius: float, step: float | None, max_voxels: int, given: Any
) -> Box:
    """Read extinction [1/m] (nz, ny, nx), voxel [m] and lowest corner [m] of one time of a model's file."""
    time = integer(time, "time", -(2**31), 2**31)
    with _opened(path, time) as fields:
        signs = {"wrf": ("QCLOUD", "PH", "PHB"), "cm1": ("qc", "prs", "th"), "sam": ("TABS", "p")}
        if kind is None:
            kind = next((k for k, names in signs.items() if fields.has(*names)), None)
            if kind is None:
                raise fields.fail("is of no model that is known (SAM, CM1, WRF)")
        main = {"sam": "QN" if fields.has("QN") else "QC", "cm1": "qc", "wrf": "QCLOUD"}[choice(kind, "kind", KINDS)]
        if main in fields.variables:
            variable = fields.variables[main]
            spatial = [d for d in variable.dims if d not in _TIMES]
            if len(spatial) != 3 or spatial[2] not in _ALONG["x"] or spatial[1] not in _ALONG["y"]:
                raise fields.fail(f"has {main} over {', '.join(variable.dims)}; (time, height, y, x) is read")
            fit_in(variable.shape[-3:], max_voxels, fields.name)
        water, radii, faces, (dx, x0), (dy, y0) = {"sam": _sam, "cm1": _cm1, "wrf": _wrf}[kind](fields, given)
        # Advection leaves a trace below 0; it is no water.
        water = np.maximum(water, 0.0)
        if radii is None:
            radii = radius
        field = 1.5 * water / (1000.0 * np.where(np.asarray(radii) > 0, radii, radius))
        if len(faces) != len(field) + 1:
            raise fields.fail(f"has {len(field)} layers and {len(faces)} faces")
        out, dz, base = even(field, faces, step, max_voxels, fields.name)
    return out, (dx, dy, dz), (x0, y0, base)

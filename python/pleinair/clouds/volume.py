"""Volumes of cloud density, saved to .npz, .npy and Mitsuba's .vol. Public as `pleinair.clouds`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import clouds_check
from .._support.inputs import Aligned, array, real, shape_text, vector
from ..io import PathLike, replacing, write_arrays, write_vol


def triple(value: Any, name: str, low: float = 1e-9, high: float = 1e9) -> tuple[float, float, float]:
    """Return three numbers in `[low, high]`; one alone is all three."""
    if np.ndim(value) == 0:
        value = (value, value, value)
    x, y, z = vector(value, name)
    return real(x, name, low, high, "m"), real(y, name, low, high, "m"), real(z, name, low, high, "m")


@dataclass(frozen=True, eq=False)
class Volume(Aligned):
    """A volume of cloud density.

    Parameters
    ----------
    density : array_like (nz, ny, nx)
        Density of cloud particles, finite and not negative [1]; kept as a read-only float32 copy. It is interpolated
        trilinearly between texel centres, constant from the outermost centres to the box, and zero outside.
    voxel_size : float or array_like (3,)
        Edge of a voxel, or its edges along x, y, z [m].
    origin : array_like (3,)
        Lowest corner of the box: x east, y north, z up [m].

    Raises
    ------
    ValueError, TypeError
        The density is empty, of the wrong rank, NaN, infinite or negative anywhere, or a size is not above 0.

    Examples
    --------
    >>> cloud = Volume(np.ones((2, 3, 4)), voxel_size=20.0, origin=(0, 0, 800))
    >>> cloud.bounds.tolist()
    [[0.0, 0.0, 800.0], [80.0, 60.0, 840.0]]
    """

    density: NDArray[np.float32]
    voxel_size: tuple[float, float, float] = (20.0, 20.0, 20.0)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        density = array(self.density, "density", dtypes=(np.float32, np.float64), ndim=3)
        with np.errstate(over="ignore"):  # what is too large becomes infinite, and is refused below
            density = density.astype(np.float32, order="C", copy=True)
        put = object.__setattr__
        put(self, "voxel_size", triple(self.voxel_size, "voxel_size"))
        put(self, "origin", vector(self.origin, "origin"))
        clouds_check(density, density.shape, self.voxel_size, self.origin)
        density.setflags(write=False)
        put(self, "density", density)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Volume):
            return NotImplemented
        same = self.voxel_size == other.voxel_size and self.origin == other.origin
        return same and np.array_equal(self.density, other.density)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        shape = shape_text(self.density.shape)
        return f"Volume(density={shape}, voxel_size={self.voxel_size}, origin={self.origin})"

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self.density.setflags(write=False)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest corner of the box, (2, 3) [m].

        Examples
        --------
        >>> Volume(np.ones((1, 1, 1)), 5.0).bounds.tolist()
        [[0.0, 0.0, 0.0], [5.0, 5.0, 5.0]]
        """
        low = np.array(self.origin)
        nz, ny, nx = self.density.shape
        return np.stack([low, low + np.array(self.voxel_size) * (nx, ny, nz)])

    def save(self, path: PathLike) -> Path:
        """Write the volume; the ending names the format.

        Parameters
        ----------
        path : path
            `.npz` keeps everything, `.vol` (Mitsuba) everything in single precision, `.npy` the density alone.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            The ending is none of these.

        Examples
        --------
        >>> import tempfile, pathlib
        >>> from pleinair.clouds import load
        >>> cloud = Volume(np.ones((2, 3, 4)))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     load(cloud.save(pathlib.Path(folder) / "cloud.npz")) == cloud
        True
        """
        suffix = Path(path).suffix.lower()
        if suffix == ".npz":
            return write_arrays(
                path, "volume/1", {"density": self.density, "voxel_size": self.voxel_size, "origin": self.origin}
            )
        if suffix == ".vol":
            return write_vol(path, self.density, self.bounds)
        if suffix == ".npy":
            return replacing(path, lambda stream: np.save(stream, self.density))
        msg = f"path must end in .npz, .npy or .vol, got {Path(path).name!r}"
        raise ValueError(msg)

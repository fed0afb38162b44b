"""Precomputed images of one cloud under several Suns. Public as `pleinair.clouds.Bases`."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._support.inputs import Progress, instance
from ..astro import Sun
from ..camera import Camera
from ..io import PathLike, read_arrays, write_arrays
from .basis import Basis
from .params import Conventions
from .volume import Volume

_KIND = "bases/1"


class Bases(Sequence[Basis]):
    """Bases of one cloud and camera under several Suns, for a photograph whose Sun is not known (section 6).

    Make one with `Bases.precompute` or `Bases.load`, or from bases that were computed before.

    Parameters
    ----------
    bases : iterable of Basis
        At least one; all with the same camera, conventions, extinctions and path through the cloud.

    Raises
    ------
    ValueError, TypeError
        There is none, or they are not of one cloud and camera.

    Examples
    --------
    >>> from pleinair import Camera, Sun
    >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
    >>> cloud = Volume(np.ones((4, 4, 4)), 25.0)
    >>> Bases([Basis.precompute(cloud, camera, Sun(45, a)) for a in (90, 180)])
    Bases(2 suns, 32x24)
    """

    def __init__(self, bases: Iterable[Basis]) -> None:
        all_: tuple[Basis, ...] = tuple(instance(b, "bases", Basis) for b in bases)
        if not all_:
            msg = "bases must hold at least one basis"
            raise ValueError(msg)
        first = all_[0]
        for other in all_[1:]:
            same = (other.camera, other.conventions, other.nodes) == (first.camera, first.conventions, first.nodes)
            # Path and distance do not depend on the Sun: they tell whether the cloud is the same.
            alike = ("depth", "distance", "sigma_t")
            if not same or not all(np.array_equal(getattr(first, n), getattr(other, n)) for n in alike):
                msg = "bases must be of one cloud, one camera and the same extinctions, conventions and orders"
                raise ValueError(msg)
        self._all = all_

    @classmethod
    def precompute(
        cls, cloud: Volume, camera: Camera, suns: Iterable[Sun], *, progress: Progress = None, **kwargs: Any
    ) -> Bases:
        """Compute a basis for each Sun.

        Parameters
        ----------
        cloud : Volume
            The density.
        camera : Camera
            From where.
        suns : iterable of Sun
            Directions of the light, at least one.
        progress : None, True or callable
            `progress(done, total)` of each basis; True shows a tqdm bar.
        **kwargs : Any
            Whatever else `Basis.precompute` takes.

        Returns
        -------
        Bases
            In the order of `suns`.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range, or the camera does not see the cloud.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
        >>> bases = Bases.precompute(Volume(np.ones((4, 4, 4)), 25.0), camera, [Sun(45, a) for a in (0, 90, 180)])
        >>> len(bases), bases[1].sun, bases.suns[2].azimuth
        (3, Sun(elevation=45.0, azimuth=90.0), 180.0)
        """
        wanted = [instance(sun, "suns", Sun) for sun in suns]
        return cls(Basis.precompute(cloud, camera, sun, progress=progress, **kwargs) for sun in wanted)

    def __getitem__(self, index: Any) -> Any:
        return type(self)(self._all[index]) if isinstance(index, slice) else self._all[index]

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[Basis]:
        return iter(self._all)

    def __repr__(self) -> str:
        return f"Bases({len(self)} suns, {self.camera.width}x{self.camera.height})"

    @property
    def suns(self) -> tuple[Sun, ...]:
        """Directions of the light.

        Examples
        --------
        See `precompute`.
        """
        return tuple(b.sun for b in self)

    @property
    def camera(self) -> Camera:
        """From where.

        Examples
        --------
        See `precompute`.
        """
        return self._all[0].camera

    @property
    def nbytes(self) -> int:
        """Size of all images [byte].

        Examples
        --------
        See `precompute`.
        """
        return sum(b.nbytes for b in self)

    def save(self, path: PathLike) -> Path:
        """Write all bases as one .npz.

        Parameters
        ----------
        path : path
            Where to; the ending must be .npz.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            The ending is another.

        Examples
        --------
        >>> import tempfile, pathlib
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
        >>> bases = Bases.precompute(Volume(np.ones((4, 4, 4)), 25.0), camera, [Sun(45, 0), Sun(45, 90)])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Bases.load(bases.save(pathlib.Path(folder) / "bases.npz")).suns == bases.suns
        True
        """
        if Path(path).suffix.lower() != ".npz":
            msg = f"path must end in .npz, got {Path(path).name!r}"
            raise ValueError(msg)
        stored: dict[str, Any] = {"suns": np.array([(s.elevation, s.azimuth) for s in self.suns])}
        for i, basis in enumerate(self):
            for field in dataclasses.fields(basis):
                value = getattr(basis, field.name)
                # What does not depend on the Sun is stored once.
                first = getattr(self._all[0], field.name)
                if isinstance(value, np.ndarray) and (i == 0 or not np.array_equal(value, first)):
                    stored[f"{i}/{field.name}"] = value
        about: dict[str, Any] = {n: dataclasses.asdict(getattr(self._all[0], n)) for n in ("camera", "conventions")}
        about["orders"] = self._all[0].orders
        return write_arrays(path, _KIND, {**stored, "about": np.array(json.dumps(about))})

    @classmethod
    def load(cls, path: PathLike) -> Bases:
        """Read what `save` wrote.

        Parameters
        ----------
        path : path
            The file.

        Raises
        ------
        FileNotFoundError
            There is no such file.
        ValueError
            The file is foreign or damaged.

        Examples
        --------
        >>> Bases.load("nowhere.npz")
        Traceback (most recent call last):
        FileNotFoundError: there is no file nowhere.npz
        """
        stored = read_arrays(path, _KIND)
        try:
            about = json.loads(str(stored["about"]))
            camera = Camera(**{**about["camera"], "position": tuple(about["camera"]["position"])})
            conventions = Conventions(**about["conventions"])
            names = [n.removeprefix("0/") for n in stored if n.startswith("0/")]
            bases = []
            for i, (elevation, azimuth) in enumerate(stored["suns"].tolist()):
                images = {n: stored.get(f"{i}/{n}", stored[f"0/{n}"]) for n in names}
                sun = Sun(elevation, azimuth)
                basis = Basis(camera=camera, sun=sun, conventions=conventions, orders=about["orders"], **images)
                basis._check()
                bases.append(basis)
            return cls(bases)
        except (KeyError, TypeError, ValueError) as error:
            msg = f"{path} is damaged: {error}"
            raise ValueError(msg) from None

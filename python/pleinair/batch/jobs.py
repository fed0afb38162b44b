"""The jobs of pipelines as grids: fits of many photographs, bases for many Suns, the frames of a film."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

from .._support.docs import documented
from .._support.fingerprint import fingerprint
from .._support.inputs import Progress, choice, instance
from ..astro import Sun
from ..camera import Camera
from ..clouds import Bases, Basis, Volume
from ..fit import CloudFit, Photo, clouds
from ..io import PathLike, frame_count, frame_time, write
from ..scene import Scene, Timeline
from .grid import Outcome, map_grid

_LOADED: dict[str, Basis | Bases] = {}
_PICTURES = (".png", ".jpg", ".exr", ".hdr", ".pfm")


def _basis(basis: Any) -> Basis | Bases:
    if isinstance(basis, (Basis, Bases)):
        return basis
    path = str(basis)
    if path not in _LOADED:
        try:
            _LOADED[path] = Bases.load(path)
        except ValueError:
            _LOADED[path] = Basis.load(path)
    return _LOADED[path]


def _photo(photo: Any, analyse: Mapping[str, Any]) -> Photo:
    if isinstance(photo, Photo):
        return photo
    return Photo.analyse(photo, **analyse)


def _fit(photo: Any, basis: Any, analyse: Mapping[str, Any], options: Mapping[str, Any], rng: Any) -> dict[str, Any]:
    return clouds(_photo(photo, analyse), _basis(basis), rng=rng, **options).to_dict()


@documented
def fits(
    photos: Iterable[Any],
    basis: Basis | Bases | PathLike,
    *,
    analyse: Mapping[str, Any] | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
    store: PathLike | None = None,
    rng: Any = 0,
    threads: int | None = 1,
    max_restarts: int = 3,
    progress: Progress = None,
    **options: Any,
) -> Iterator[Outcome]:
    """Fit a cloud to each of many photographs, and yield each fit as it comes.

    Parameters
    ----------
    photos : iterable
        Paths of pictures, arrays (height, width, 3) of linear light, or `Photo`s.
    basis : Basis, Bases, or path
        Of the cloud. A path is read once in each process: for a cluster, one that all its machines see.
    analyse : mapping, optional
        Arguments of `Photo.analyse`.
    executor, store, threads, max_restarts : object
        See `map_grid` [1].
    rng : None, int, SeedSequence, BitGenerator or Generator
        Each photograph has random numbers of its own from it.
    {progress}
    **options : object
        Arguments of `pleinair.fit.clouds`.

    Yields
    ------
    Outcome
        Its value is a `CloudFit` without photograph and basis: see `CloudFit.attach`. A photograph that cannot be read
        or fitted is an outcome with an error.

    Raises
    ------
    ValueError, TypeError
        See `map_grid` [1].

    Examples
    --------
    >>> import numpy as np
    >>> import pleinair as pa
    >>> picture = np.full((32, 32, 3), (0.1, 0.3, 0.8), np.float32)
    >>> picture[8:20, 8:24] = np.linspace(0.3, 0.9, 16)[:, None]
    >>> cloud = pa.clouds.procedural("cumulus", (16, 24, 24), rng=1)
    >>> camera = pa.Camera.look_at((0, -800, 900), (240, 240, 960), 40, 30, fov=50)
    >>> basis = pa.clouds.Basis.precompute(cloud, camera, pa.Sun(40, 160))
    >>> found = list(fits([picture, "nowhere.jpg"], basis, analyse={"ground": None}, generations=3))
    >>> found[0].value.calls, found[1].error.split(":")[0]
    (60, 'FileNotFoundError')
    """
    if not isinstance(basis, (Basis, Bases)):
        basis = str(basis)
        _basis(basis)
    cells = [str(photo) if isinstance(photo, Path) else photo for photo in photos]
    given = {**(analyse or {})}, dict(options)
    found = map_grid(
        _fit,
        cells,
        executor=executor,
        store=store,
        shared=(basis, *given),
        rng=rng,
        threads=threads,
        max_restarts=max_restarts,
        progress=progress,
    )
    return (one if one.error else replace(one, value=CloudFit.from_dict(one.value)) for one in found)


def _precompute(sun: Sun, cloud: Volume, camera: Camera, folder: str, options: Mapping[str, Any], rng: Any) -> str:
    name = f"basis_{fingerprint(sun)}.npz"
    Basis.precompute(cloud, camera, sun, rng=rng, **options).save(Path(folder) / name)
    return name


@documented
def precompute(
    cloud: Volume,
    camera: Camera,
    suns: Iterable[Sun],
    *,
    store: PathLike,
    executor: Executor | Callable[[], Executor] | None = None,
    rng: Any = 0,
    threads: int | None = 1,
    max_restarts: int = 3,
    progress: Progress = None,
    **options: Any,
) -> Iterator[Outcome]:
    """Precompute the basis of a cloud for each of many Suns, into a folder.

    Parameters
    ----------
    cloud : Volume
        The density.
    camera : Camera
        From where.
    suns : iterable of Sun
        Directions of the light.
    store : path
        Folder for the files; a second call does what is missing.
    executor, threads, max_restarts : object
        See `map_grid` [1].
    rng : None, int, SeedSequence, BitGenerator or Generator
        Of the paths; each Sun has random numbers of its own from it.
    {progress}
    **options : object
        Arguments of `Basis.precompute`.

    Yields
    ------
    Outcome
        Its value is the path of a file that `Basis.load` reads.

    Raises
    ------
    ValueError, TypeError
        See `map_grid` [1].

    Examples
    --------
    >>> import tempfile
    >>> import pleinair as pa
    >>> cloud = pa.clouds.procedural("cumulus", (8, 12, 12), rng=1)
    >>> camera = pa.Camera.look_at((0, -800, 900), (240, 240, 960), 8, 6, fov=50)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = list(precompute(cloud, camera, [pa.Sun(20, 160), pa.Sun(40, 160)], store=folder))
    ...     pa.clouds.Basis.load(made[1].value).sun
    Sun(elevation=40.0, azimuth=160.0)
    """
    instance(cloud, "cloud", Volume)
    instance(camera, "camera", Camera)
    cells = [instance(sun, "suns", Sun) for sun in suns]
    folder = Path(store)
    found = map_grid(
        _precompute,
        cells,
        executor=executor,
        store=folder,
        shared=(cloud, camera, str(folder.absolute()), dict(options)),
        rng=rng,
        threads=threads,
        max_restarts=max_restarts,
        progress=progress,
    )
    return _files(found, folder)


def _files(found: Iterator[Outcome], folder: Path) -> Iterator[Outcome]:
    for one in found:
        path = None if one.error else folder / one.value
        if path is not None and not path.exists():
            yield replace(one, value=None, error=f"FileNotFoundError: {path} was taken away: remove its record, too")
        else:
            yield replace(one, value=path)


def _frame(
    k: int, scene: Scene, timeline: Timeline, count: int, folder: str, ending: str, options: Mapping[str, Any]
) -> str:
    name = f"frame_{k:06d}{ending}"
    write(Path(folder) / name, scene.frame(timeline, frame_time(k, count)), **options)
    return name


@documented
def frames(
    scene: Scene,
    timeline: Timeline,
    *,
    store: PathLike,
    seconds: float = 5.0,
    fps: float = 24.0,
    ending: str = ".png",
    executor: Executor | Callable[[], Executor] | None = None,
    threads: int | None = 1,
    max_restarts: int = 3,
    progress: Progress = None,
    **options: Any,
) -> Iterator[Outcome]:
    """Paint the frames of a film into a folder, each a file of its own.

    Parameters
    ----------
    scene : Scene
        What is painted.
    timeline : Timeline
        What changes; functions of it must be importable where executors of processes work (keys always are).
    store : path
        Folder for the pictures; a second call does what is missing.
    seconds : float
        Length, in (0, 86400] [s].
    fps : float
        Frames a second, in (0, 1000] [1/s].
    ending : str
        ".png", ".jpg", ".exr", ".hdr" or ".pfm".
    executor, threads, max_restarts : object
        See `map_grid` [1].
    {progress}
    **options : object
        Arguments of `pleinair.io.write`.

    Yields
    ------
    Outcome
        Its value is the path of a picture.

    Raises
    ------
    ValueError, TypeError
        See `map_grid` [1].

    Examples
    --------
    >>> import tempfile
    >>> import pleinair as pa
    >>> scene = pa.Scene(pa.sky.Aoas(sun=pa.Sun(30, 160)))
    >>> pan = pa.Timeline({0: pa.Camera(32, 24), 1: pa.Camera(32, 24, azimuth=20)})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [one.value.name for one in frames(scene, pan, store=folder, seconds=0.1, fps=20)]
    ['frame_000000.png', 'frame_000001.png']
    """
    instance(scene, "scene", Scene)
    instance(timeline, "timeline", Timeline)
    count = frame_count(seconds, fps)
    folder = Path(store)
    found = map_grid(
        _frame,
        range(count),
        executor=executor,
        store=folder,
        shared=(scene, timeline, count, str(folder.absolute()), choice(ending, "ending", _PICTURES), dict(options)),
        threads=threads,
        max_restarts=max_restarts,
        progress=progress,
    )
    return _files(found, folder)

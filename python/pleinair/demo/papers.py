"""The four papers' main jobs from beginning to end, every step written as a picture. Public as `pleinair.demo`."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.docs import documented
from .._support.inputs import bar_where_it_is, instance, integer, real, reporter
from ..astro import Place, Sun
from ..camera import Camera
from ..clouds import Basis, Volume, procedural
from ..color import srgb_encode
from ..fit import CloudFit, Photo, UnfittableError
from ..fit import clouds as fit_clouds
from ..image import resize
from ..io import PathLike, read, replacing, write
from ..paint import style, styles
from ..sky import Natural, preset, presets
from ..tone import oneil, present, to_uint8
from .composition import landscape, style_sky

# A larger photograph is averaged down first: its pictures here are 640 pixels wide.
_LARGEST = 1600
# Between instants that are rendered, in twilight and otherwise [min]; where the Sun is then [°].
_TWILIGHT, _QUIET, _DUSK = 6.0, 30.0, (-20.0, 6.0)
# Digits of the hour scale: rows from the top, in octal.
_DIGITS = ("75557", "26227", "71747", "71717", "55711", "74717", "74757", "71111", "75757", "75717")


def photograph() -> Path:
    """Return the path of the photograph that comes with the package (see data/SOURCES.md).

    Returns
    -------
    Path
        A JPEG of a fair-weather cumulus.

    Examples
    --------
    >>> photograph().name
    'cumulus_mountain_picos.jpg'
    """
    return Path(str(resources.files("pleinair") / "data" / "cumulus_mountain_picos.jpg"))


def camera_for(cloud: Volume, width: int, height: int) -> Camera:
    """Return a camera on the ground south of a cloud that has it filling most of the picture."""
    low, high = cloud.bounds
    middle = (low + high) / 2
    away = 1.5 * float(max(high[0] - low[0], (high[2] - low[2]) * width / height))
    eye = (middle[0], middle[1] - away, 2.0)
    return Camera.look_at(eye, middle, width, height, fov=32.0)


def fit_photo(
    path: PathLike,
    out: PathLike = "out",
    *,
    sun: Sun | None = None,
    cloud: PathLike | None = None,
    sky: Sequence[float] | None = None,
    rng: Any = 5,
    generations: int = 100,
    say: Callable[[str], object] = print,
    bar: bool = True,
) -> CloudFit:
    """Fit a cloud to a photograph and write the steps into a folder.

    Parameters
    ----------
    path : path
        The photograph.
    out : path
        The folder; it is made if it is not there.
    sun : Sun, optional
        Direction of the light on the cloud; by default high on the viewer's left.
    cloud : path, optional
        A picture of the photograph's size, bright where the clouds are, instead of finding them.
    sky : sequence of float, optional
        Linear colour of the sky behind the clouds, instead of filling it in [1].
    rng : None, int, SeedSequence, BitGenerator or Generator
        Which cloud is grown, and the search.
    generations : int
        Most generations of the search [1].
    say : callable
        Called with one line for each step.
    bar : bool
        Show progress bars where tqdm is installed.

    Returns
    -------
    pleinair.fit.CloudFit
        The fit. In the folder: photo, mask, sky, fits (contact sheet), convergence (with matplotlib), final, in_photo, cloud.npz
        and params.json.

    Raises
    ------
    FileNotFoundError, ValueError
        The photograph is missing, cannot be read, or cannot be fitted (the message says why).

    Examples
    --------
    >>> fit_photo("nowhere.jpg")
    Traceback (most recent call last):
    FileNotFoundError: there is no file nowhere.jpg
    """
    generations = integer(generations, "generations", 1, 10**6)
    start = time.perf_counter()
    progress = bar_where_it_is(bar)

    def step(text: str) -> None:
        say(f"{time.perf_counter() - start:5.1f} s  {text}")

    rgb = _at_most(read(path), _LARGEST)
    clouds_seen = None
    if cloud is not None:
        given = _at_most(read(cloud), _LARGEST)
        if given.shape != rgb.shape:
            msg = f"cloud must be a picture of the photograph's size {rgb.shape[:2]}, got {given.shape[:2]}"
            raise ValueError(msg)
        clouds_seen = given.mean(axis=2) > 0.2
    photo = Photo.analyse(rgb, cloud=clouds_seen, sky=sky)
    if photo.problems:
        msg = f"{path}: " + "; ".join(photo.problems)
        raise UnfittableError(msg)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    write(folder / "photo.png", rgb)
    write(folder / "mask.png", _overlay(rgb, photo))
    write(folder / "sky.png", np.zeros_like(rgb) if photo.sky is None else photo.sky)
    light = ", ".join(f"{c:.2f}" for c in photo.light_color)
    step(f"photograph: {photo.cloud.mean():.0%} cloud, {photo.segmentation.ground.mean():.0%} ground, light ({light})")

    grown = procedural("cumulus", (96, 160, 160), rng=rng, progress=progress)
    grown.save(folder / "cloud.npz")
    step("cloud: a cumulus of 160 x 160 x 96 voxels of 20 m")

    camera = camera_for(grown, 200, 150)
    sun = sun or Sun(elevation=48, azimuth=250)
    basis = Basis.precompute(grown, camera, sun, orders=None, samples=64, rng=rng, progress=progress)
    nodes = f"{basis.g.size} asymmetries, {basis.extinctions.size} extinctions"
    step(f"basis: every order of scattering, {nodes}, {basis.nbytes / 2**20:.0f} MiB")

    found = fit_clouds(photo, basis, generations=generations, rng=rng, progress=progress)
    best = found.best
    step(f"fit: O = {best.objective:.3f} after {found.calls} calls, stopped by {found.stopped}")
    sheet = [found.picture(rank) for rank in range(len(found.ranked))]
    write(folder / "fits.png", contact_sheet(sheet))
    if _convergence(found, folder / "convergence.png"):
        step("pictures of the ranked fits and of the convergence")

    final = found.render(grown, size=(640, 480), samples=8, rng=rng, progress=progress)
    write(folder / "final.png", final.rgb)
    write(folder / "in_photo.png", found.replace(cloud=grown, samples=8, rng=rng, progress=progress))
    step("the fitted cloud in the photograph, in place of its own")
    text = best.params.to_json() + "\n"
    replacing(folder / "params.json", lambda stream: stream.write(text.encode()))
    step(f"final picture at 640 x 480: everything is in {folder}")
    return found


def sky_styles(out: PathLike = "out", *, say: Callable[[str], object] = print) -> NDArray[np.float32]:
    """Write a sheet of all named sky styles into a folder.

    Parameters
    ----------
    out : path
        The folder; it is made if it is not there.
    say : callable
        Called with one line.

    Returns
    -------
    ndarray (height, width, 3) of float32
        The sheet, linear light; in the folder: sky_styles.png.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sky_styles(folder, say=lambda line: None).shape
    (900, 1280, 3)
    """
    start = time.perf_counter()
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    camera = Camera(320, 180, fov=70, azimuth=180, elevation=18)
    sheet = contact_sheet([oneil(preset(name).render(camera)) for name in presets()])
    write(folder / "sky_styles.png", to_uint8(sheet, dither=True))
    say(f"{time.perf_counter() - start:5.1f} s  skies: {len(presets())} styles of AOAS in {folder}")
    return sheet


@documented
def day_strip(
    place: Place,
    instants: Sequence[datetime],
    *,
    width: int = 1280,
    height: int = 240,
    azimuth: float = 180.0,
    fov: float = 60.0,
    hours: bool = False,
    progress: Any = None,
) -> NDArray[np.float32]:
    """Return one direction of the sky through time, from left to right, each column at its own instant.

    Parameters
    ----------
    place : Place
        Where from.
    instants : sequence of datetime
        At least 2, with time zones, later and later: the strip goes from the first to the last. Each is rendered, and
        others between them, six minutes apart in twilight and thirty otherwise; in between light goes evenly by its
        logarithm, and so does what the eye is adapted to. Stars are those of the nearest instant.
    width, height : int
        Size of the strip [px].
    azimuth : float
        Direction of view, clockwise from north [°].
    fov : float
        What is seen above the horizon, in [1, 90] [°].
    hours : bool
        With a scale of the hours beneath, in the time zone of the first instant: 16 rows more.
    {progress}

    Returns
    -------
    ndarray (height, width, 3) of float32
        Linear light of a display after `pleinair.tone.present`, each column for an eye of its own adaptation.

    Raises
    ------
    ValueError, TypeError
        `instants` are fewer than 2 or not later and later, or a value is out of range.

    Examples
    --------
    >>> evening = [datetime(2024, 8, 4, hour, tzinfo=UTC) for hour in (18, 20)]
    >>> day_strip(Place(45, 6), evening, width=60, height=20).shape
    (20, 60, 3)
    """
    width, height = integer(width, "width", 2, 65536), integer(height, "height", 2, 65536)
    fov = real(fov, "fov", 1, 90, "°")
    instance(place, "place", Place)
    for when in instants:
        Sun.at(when, place)  # Says what is wrong with a time.
    if len(instants) < 2 or any(b <= a for a, b in pairwise(instants)):
        msg = "instants must be at least 2, each later than the one before"
        raise ValueError(msg)
    times = _dense(place, instants)
    seconds = np.array([(when - instants[0]).total_seconds() for when in times])
    at = seconds / seconds[-1] * (width - 1)
    columns = np.arange(width)
    light = np.empty((len(times), height, 3), np.float32)
    eyes = np.empty(len(times))
    stars = np.zeros((height, width, 3), np.float32)
    nearest = np.abs(columns[:, None] - at).argmin(axis=1)
    tick, close = reporter(progress, "day")
    try:
        for i, when in enumerate(times):
            smooth = Natural(when, place, turbidity=2, stars=None)
            own = columns[nearest == i]
            reach = int(np.abs(own - at[i]).max()) + 4 if own.size else 1
            camera = Camera(2 * reach + 1, height, fov, azimuth, elevation=fov / 2)
            seen = smooth.render(camera, tolerance=1e-2)
            light[i], eyes[i] = seen[:, reach], smooth.adaptation(tolerance=1e-2)
            if own.size and smooth.bodies()[0].elevation < 0:
                points = replace(smooth, stars=Natural.stars).render(camera, tolerance=1e-2) - seen
                _crossings(points, reach, at[i], own, seconds[-1] / (width - 1) * height / fov, stars)
            if tick is not None:
                tick(i + 1, len(times))
    finally:
        close()
    strip = np.empty((height, width, 3), np.float32)
    logs, adapted = np.log(np.maximum(light, 1e-12)), np.interp(columns, at, np.log(eyes))
    for x in columns.tolist():
        after = min(max(int(np.searchsorted(at, x)), 1), len(at) - 1)
        share = np.float32((x - at[after - 1]) / (at[after] - at[after - 1]))
        here = np.exp((1 - share) * logs[after - 1] + share * logs[after]) + np.maximum(stars[:, x], 0)
        # Display white is that of the eye alone: a column with a star is no darker than its neighbours.
        strip[:, x : x + 1] = present(here[:, None], float(np.exp(adapted[x])), glare=False, white=0.0)
    return np.concatenate([strip, _hour_scale(instants[0], float(seconds[-1]), width)]) if hours else strip


def _crossings(
    points: NDArray[np.float32], middle: int, at: float, own: NDArray[np.int64], pace: float, into: NDArray[np.float32]
) -> None:
    """Add stars where they cross the middle of a picture in time: in columns `own` around `at`.

    `pace` is seconds of a column times pixels of a degree: stars go a degree in 240 s, as near the equator.
    """
    bright = points.max(axis=2)
    ring = np.pad(bright, 1)
    height, width = bright.shape
    around = [ring[j : j + height, i : i + width] for j in range(3) for i in range(3)]
    for y, x in np.argwhere((bright == np.max(around, axis=0)) & (bright > 1e-6)).tolist():
        # One that is beyond the middle has crossed it before.
        column = round(at - (x - middle) * 240 / pace)
        if 1 <= y < height - 1 and 1 <= x < width - 1 and own[0] <= column <= own[-1]:
            left, right = max(column - 1, 0), min(column + 2, into.shape[1])
            into[y - 1 : y + 2, left:right] += points[
                y - 1 : y + 2, x - 1 + left - column + 1 : x - 1 + right - column + 1
            ]


def _dense(place: Place, instants: Sequence[datetime]) -> list[datetime]:
    """Return instants with others between them, so close that light goes evenly from one to the next."""
    out = [instants[0]]
    for a, b in pairwise(instants):
        now = a
        while now < b:
            dusk = _DUSK[0] < Sun.at(now, place).elevation < _DUSK[1]
            # A long step may lead into twilight.
            ahead = _DUSK[0] < Sun.at(now + timedelta(minutes=_QUIET), place).elevation < _DUSK[1]
            now = min(now + timedelta(minutes=_TWILIGHT if dusk or ahead else _QUIET), b)
            out.append(now)
    return out


def _hour_scale(first: datetime, seconds: float, width: int) -> NDArray[np.float32]:
    """Return the hours as ticks and numbers, light on dark, 16 rows high."""
    scale = np.full((16, width), 0.004, np.float32)
    hour = first.replace(minute=0, second=0, microsecond=0)
    while (after := (hour - first).total_seconds()) <= seconds:
        x = round(after / seconds * (width - 1))
        if 0 <= x < width:
            scale[:4, x] = 0.5
        if 7 <= x < width - 8:
            for k, digit in enumerate(f"{hour.hour:02d}"):
                rows = [int(row) for row in _DIGITS[int(digit)]]
                for j, row in enumerate(rows):
                    for i in range(3):
                        if row >> (2 - i) & 1:
                            scale[6 + j, x - 4 + 5 * k + i] = 0.5
        hour += timedelta(hours=1)
    return np.repeat(scale[..., None], 3, axis=2)


def day_and_night(out: PathLike = "out", *, say: Callable[[str], object] = print) -> NDArray[np.float32]:
    """Write a strip of the southern sky from an afternoon to midnight into a folder.

    Parameters
    ----------
    out : path
        The folder; it is made if it is not there.
    say : callable
        Called with one line.

    Returns
    -------
    ndarray (height, width, 3) of float32
        The strip, linear light; in the folder: day_and_night.png.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     day_and_night(folder, say=lambda line: None).shape
    (256, 1280, 3)
    """
    start = time.perf_counter()
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    midnight = datetime(2024, 8, 5, tzinfo=UTC)
    strip = day_strip(Place(45, 6, 1500), [midnight + timedelta(hours=hour) for hour in (-7, -0.5)], hours=True)
    write(folder / "day_and_night.png", to_uint8(strip, dither=True))
    say(f"{time.perf_counter() - start:5.1f} s  a sky from day to night in {folder}")
    return strip


def paintings(out: PathLike = "out", *, width: int = 1280, say: Callable[[str], object] = print) -> NDArray[np.float32]:
    """Write the landscape in Corot's manner, and small in every style beside another landscape, into a folder.

    Parameters
    ----------
    out : path
        The folder; it is made if it is not there.
    width : int
        Of the large picture, whose height is 9/16 of it, in [32, 65536] [px].
    say : callable
        Called with one line.

    Returns
    -------
    ndarray (height, width, 3) of float32
        The large picture, linear light; in the folder: painting.png and painting_styles.png.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     paintings(folder, width=64, say=lambda line: None).shape
    (36, 64, 3)
    """
    start = time.perf_counter()
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    width = integer(width, "width", 32, 65536)
    scene, camera = landscape()
    large = scene.paint(camera.resized(width, width * 9 // 16))
    write(folder / "painting.png", to_uint8(large, dither=True))
    small = camera.resized(width // 2, width * 9 // 32)
    sheet = [scene.paint(small)]
    for name in styles():
        if name != "corot":
            sheet.append(replace(scene, sky=style_sky(name), style=style(name, grade=True)).paint(small))
    sheet.append(landscape(rng=2)[0].paint(small))
    write(folder / "painting_styles.png", to_uint8(contact_sheet(sheet, columns=3), dither=True))
    say(f"{time.perf_counter() - start:5.1f} s  a landscape in {len(sheet) - 1} styles, and another, in {folder}")
    return large


def _at_most(picture: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """Return a picture whose longer side is at most so many pixels."""
    height, width, _ = picture.shape
    if max(height, width) <= side:
        return picture
    scale = side / max(height, width)
    return resize(picture, max(1, round(width * scale)), max(1, round(height * scale)))


def _overlay(rgb: NDArray[np.float32], photo: Photo) -> NDArray[np.float32]:
    """Show clouds red and ground green over a dimmed photograph."""
    shown = rgb * np.float32(0.5)
    shown[photo.cloud] += np.array([0.5, 0.0, 0.0], np.float32)
    shown[photo.segmentation.ground] += np.array([0.0, 0.12, 0.0], np.float32)
    return shown


def contact_sheet(pictures: list[NDArray[np.float32]], columns: int = 4) -> NDArray[np.float32]:
    """Put pictures on a contact sheet, white where there is none."""
    height, width, _ = pictures[0].shape
    rows = -(-len(pictures) // columns)
    sheet = np.ones((rows * height, columns * width, 3), np.float32)
    for i, picture in enumerate(pictures):
        y, x = i // columns * height, i % columns * width
        sheet[y : y + height, x : x + width] = picture
    return sheet


def _convergence(found: CloudFit, path: Path) -> bool:
    """Plot the objective against calls, and the histograms of photograph and fit; False without matplotlib."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return False
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    left.plot(found.history["calls"], found.history["best"], label="best so far")
    left.plot(found.history["calls"], found.history["mean"], alpha=0.6, label="mean of the generation")
    left.set(xlabel="objective calls", ylabel="objective O (eq 2)")
    left.legend()
    picture = found.picture(0)
    seen = found.basis.depth > 0
    bins = found.photo.histogram.shape[1]
    levels = (np.arange(bins) + 0.5) / bins
    for channel, name in enumerate(("tab:red", "tab:green", "tab:blue")):
        encoded = np.clip(srgb_encode(np.ascontiguousarray(picture[..., channel][seen])), 0, 1)
        counts, _ = np.histogram(encoded, bins=bins, range=(0, 1))
        right.plot(levels, found.photo.histogram[channel], color=name)
        right.plot(levels, counts / max(counts.sum(), 1), color=name, linestyle=":")
    right.set(xlabel="encoded level", ylabel="share of the cloud pixels", title="photograph (line) and fit (dots)")
    replacing(path, lambda stream: figure.savefig(stream, format="png", dpi=100))
    return True

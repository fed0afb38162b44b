"""The command line: ``pleinair`` or ``python -m pleinair``."""

from __future__ import annotations

import argparse
import dataclasses
import json
import shutil
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import datetime
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from . import __version__, batch, clouds, demo, exports, fit, io, report, sky, tone
from ._support.inputs import bar_where_it_is
from .astro import Place, Sun
from .camera import Camera
from .paint import styles
from .scene import Timeline
from .scene import load as scene_file

__all__ = ["main"]


def _seed(text: str) -> int:
    if not text.isdecimal():
        msg = f"must be an integer of at least 0, got {text}"
        raise argparse.ArgumentTypeError(msg)
    return int(text)


def _instant(text: str) -> datetime:
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        msg = f"must be ISO 8601, such as 2024-08-05T22:30+02:00, got {text}"
        raise argparse.ArgumentTypeError(msg) from None
    if when.utcoffset() is None:
        msg = f"needs a time zone, such as {text}Z or {text}+02:00"
        raise argparse.ArgumentTypeError(msg)
    return when


def _whereabouts(command: argparse.ArgumentParser) -> None:
    """Add what says where the Sun and the stars are."""
    command.add_argument(
        "--sun", type=float, nargs=2, metavar=("ELEVATION", "AZIMUTH"), help="direction of the Sun [°]"
    )
    when = "ISO 8601 with a time zone: 2024-08-05T22:30+02:00"
    command.add_argument("--when", type=_instant, metavar="TIME", help=when)
    command.add_argument("--place", type=float, nargs=2, metavar=("LATITUDE", "LONGITUDE"), help="north and east [°]")
    command.add_argument("--altitude", type=float, default=0.0, metavar="M", help="of the place (default: 0) [m]")


def _more(commands: Any) -> None:
    """Add clouds, films and conversions."""
    cloud = commands.add_parser("cloud", help="grow a cloud and render it (png, jpg, exr, hdr), or keep it (npz, vol)")
    cloud.add_argument(
        "volume", metavar="FILE", nargs="?", help="a volume (.npz, .vol, .npy, .vdb, .nc, .txt), not grown"
    )
    cloud.add_argument("--kind", default="cumulus", help=f"{', '.join(clouds.KINDS)} (default: cumulus)")
    cloud.add_argument("--shape", type=int, nargs=3, default=(96, 160, 160), metavar=("Z", "Y", "X"), help="[voxels]")
    cloud.add_argument("--seed", type=_seed, default=5, help="which cloud is grown, and the paths (default: 5)")
    cloud.add_argument(
        "--sun", type=float, nargs=2, default=(48.0, 250.0), metavar=("ELEVATION", "AZIMUTH"), help="[°]"
    )
    cloud.add_argument("--orders", type=int, default=4, help="of scattering (default: 4)")
    cloud.add_argument("--samples", type=int, default=16, help="paths of a pixel (default: 16)")
    cloud.add_argument("--params", metavar="FILE", help="params.json of a fit")
    cloud.add_argument("--size", type=int, nargs=2, default=(640, 480), metavar=("WIDTH", "HEIGHT"), help="[px]")
    cloud.add_argument("--out", default="cloud.png", metavar="FILE", help="to write (default: cloud.png)")
    film = commands.add_parser("film", help="a day's sky, a turn below a style, or a painted day (mp4, webm, mkv)")
    film.add_argument("style", metavar="STYLE", nargs="?", help="a sky style: the view turns; without it a true sky")
    film.add_argument("--sun", type=float, nargs=2, metavar=("ELEVATION", "AZIMUTH"), help="direction of the Sun [°]")
    film.add_argument("--from", dest="begin", type=_instant, metavar="TIME", help="first frame, ISO 8601 with a zone")
    film.add_argument("--to", dest="end", type=_instant, metavar="TIME", help="last frame")
    film.add_argument("--place", type=float, nargs=2, metavar=("LATITUDE", "LONGITUDE"), help="north and east [°]")
    film.add_argument("--altitude", type=float, default=0.0, metavar="M", help="of the place (default: 0) [m]")
    film.add_argument("--paint", metavar="STYLE", help="paint the landscape under that sky in a style")
    film.add_argument("--turn", type=float, default=0.0, help="of the view, from first to last frame [°]")
    film.add_argument("--seconds", type=float, default=5.0, help="length (default: 5) [s]")
    film.add_argument("--fps", type=float, default=24.0, help="frames a second (default: 24) [1/s]")
    film.add_argument("--size", type=int, nargs=2, default=(1280, 720), metavar=("WIDTH", "HEIGHT"), help="[px]")
    film.add_argument("--fov", type=float, default=70.0, help="vertical field of view [°]")
    film.add_argument("--azimuth", type=float, default=180.0, help="direction of view, clockwise from north [°]")
    film.add_argument("--elevation", type=float, default=18.0, help="direction of view above the horizon [°]")
    film.add_argument("--restart", action="store_true", help="begin anew, whatever an interrupted film has left")
    film.add_argument("--quiet", action="store_true", help="no progress")
    film.add_argument("--out", default="film.mp4", metavar="FILE", help="film to write (default: film.mp4)")
    other = commands.add_parser("convert", help="a picture or a volume from one format to another, by their endings")
    other.add_argument("source", metavar="IN", help="picture, or volume (.npz, .vol, .npy)")
    other.add_argument("out", metavar="OUT", help="picture (png, jpg, exr, hdr, pfm), or volume (npz, vol)")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="pleinair", description="Skies, clouds and painted landscapes.")
    parser.add_argument("--version", action="version", version=f"pleinair {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def common(command: argparse.ArgumentParser) -> None:
        command.add_argument("--out", default="out", metavar="DIR", help="folder for the pictures (default: out)")
        command.add_argument("--seed", type=_seed, default=5, help="which cloud is grown, and the search (default: 5)")
        command.add_argument("--generations", type=int, default=100, help="most generations (default: 100)")
        command.add_argument("--quiet", action="store_true", help="no progress and no report")
        command.add_argument("--json", action="store_true", help="results as JSON on standard output, a line each")

    run = commands.add_parser("demo", help="fit a cloud to the photograph that comes with the package")
    common(run)
    one = commands.add_parser("fit", help="fit a cloud to your photograph")
    one.add_argument(
        "photo", metavar="PHOTO", nargs="+", help="JPEG or PNG with clouds and some sky; several, for a list"
    )
    one.add_argument(
        "--volume",
        metavar="FILE",
        help="cloud to fit (.npz, .vol, .npy, .vdb, .nc, .txt), instead of one that is grown",
    )
    one.add_argument("--kind", metavar="KIND", default="cumulus", help=f"of cloud to grow: {', '.join(clouds.KINDS)}")
    one.add_argument(
        "--basis", metavar="FILE", help="precomputed images (.npz); made and kept there if it is not there"
    )
    one.add_argument("--jobs", type=int, default=1, metavar="N", help="processes that fit (default: 1)")
    one.add_argument(
        "--jsonl", metavar="FILE", help="a line of JSON for each photograph (default: fits.jsonl in --out)"
    )
    one.add_argument("--resume", action="store_true", help="do not fit again what an interrupted list has fitted")
    one.add_argument("--cloud", metavar="MASK", help="picture of the photograph's size, white where the clouds are")
    one.add_argument("--sky", type=float, nargs=3, metavar=("R", "G", "B"), help="linear colour of the sky behind them")
    one.add_argument("--sun", type=float, nargs=2, metavar=("ELEVATION", "AZIMUTH"), help="direction of the light [°]")
    common(one)
    view = commands.add_parser(
        "sky", help="render a sky style, or the true sky of a place (png, jpg; exr, hdr: as light)"
    )
    known = f"{', '.join(sky.presets())}, or a .json file of a sky; without it the true sky of --when and --place"
    view.add_argument("style", metavar="STYLE", nargs="?", help=known)
    _whereabouts(view)
    view.add_argument(
        "--colors", action="store_true", help="keep the colours of the dark, as a camera does (true skies)"
    )
    view.add_argument("--out", default="sky.png", metavar="FILE", help="picture to write (default: sky.png)")
    view.add_argument("--size", type=int, nargs=2, default=(1280, 720), metavar=("WIDTH", "HEIGHT"), help="[px]")
    view.add_argument("--fov", type=float, default=70.0, help="vertical field of view [°]")
    view.add_argument("--azimuth", type=float, default=180.0, help="direction of view, clockwise from north [°]")
    view.add_argument("--elevation", type=float, default=18.0, help="direction of view above the horizon [°]")
    view.add_argument("--exposure", type=float, help="of O'Neil's curve, for png and jpg of a style (default: 2)")
    view.add_argument("--panorama", action="store_true", help="the whole sphere, HEIGHT rows, with the Sun in a .json")
    paint = commands.add_parser("paint", help="paint a landscape of hills, water, rocks and trees (png, jpg)")
    paint.add_argument(
        "style",
        metavar="STYLE",
        nargs="?",
        default="corot",
        help=f"{', '.join(styles())}, or a scene's file (.toml, .json)",
    )
    paint.add_argument("--sky", metavar="STYLE", help="a sky style or a .json file of a sky, instead of a true sky")
    _whereabouts(paint)
    paint.add_argument("--out", default="painting.png", metavar="FILE", help="picture to write (default: painting.png)")
    paint.add_argument("--size", type=int, nargs=2, metavar=("WIDTH", "HEIGHT"), help="(default: 1280 720) [px]")
    paint.add_argument("--trees", type=int, default=12, metavar="N", help="how many (default: 12)")
    paint.add_argument("--seed", type=_seed, default=1, help="which landscape (default: 1)")
    paint.add_argument(
        "--composition", metavar="NAME", help="pond, river, lane, clearing or hills (default: the seed draws it)"
    )
    paint.add_argument(
        "--position", type=float, nargs=3, metavar=("X", "Y", "Z"), help="of the eye, instead of the landscape's [m]"
    )
    paint.add_argument("--no-cloud", action="store_true", help="a cloudless sky")
    paint.add_argument("--fov", type=float, help="vertical field of view, instead of the landscape's own [°]")
    paint.add_argument("--azimuth", type=float, help="direction of view, clockwise from north [°]")
    paint.add_argument("--elevation", type=float, help="direction of view above the horizon [°]")
    _more(commands)
    for each in commands.choices.values():
        if "--json" not in each.format_usage():
            each.add_argument("--json", action="store_true", help="what was written, as JSON on standard output")
    table = commands.add_parser("report", help="measure speed and error beside the rivals (in a checkout)")
    table.add_argument("--only", default="", metavar="WORD", help="only benches with this word; writes nothing")
    table.add_argument("--quick", action="store_true", help="fewer rounds, without the slow benches; writes nothing")
    table.add_argument("--check", action="store_true", help="fail where a ratio has fallen below the last report's")
    table.add_argument("--root", default=".", metavar="DIR", help="the checkout (default: here)")
    return parser


def _found(given: argparse.Namespace, style: str | None, sun: Sun | None) -> sky.Sky:
    """Return the sky of a style, a file, or a place."""
    found: sky.Sky
    if given.altitude and given.place is None:
        msg = "--altitude is that of a --place"
        raise ValueError(msg)
    if style is None:
        where = None if given.place is None else Place(given.place[0], given.place[1], given.altitude)
        return sky.Natural(given.when, where, sun=sun)
    found = sky.from_json(Path(style).read_text()) if style.endswith(".json") else sky.preset(style)
    return found if sun is None else dataclasses.replace(found, sun=sun)


def _paint(given: argparse.Namespace, sun: Sun | None) -> None:
    """Paint a landscape, or the scene of a file, and write it."""
    from_file = given.style.endswith((".toml", ".json"))
    if from_file and (given.when or given.place or given.sky or sun or given.no_cloud):
        msg = "the sky, the Sun and the clouds of a scene's file are in it"
        raise ValueError(msg)
    natural = given.when is not None or given.place is not None
    if natural and given.sky is not None:
        msg = "give --sky, or --when and --place for the true sky of a place"
        raise ValueError(msg)
    if Path(given.out).suffix.lower() not in (".png", ".jpg", ".jpeg"):
        msg = f"--out must end in .png, .jpg or .jpeg: a painting is no light to measure; got {given.out}"
        raise ValueError(msg)
    if from_file:
        found = scene_file(given.style)
        if "scene" not in found:
            msg = f"{given.style} holds no scene but {', '.join(found) or 'nothing'}"
            raise ValueError(msg)
        camera = found.get("camera", Camera(1280, 720, fov=44, elevation=2.5, position=(0, -12, 3)))
        camera = camera if given.size is None else camera.resized(*given.size)
        picture = found["scene"].paint(_options_of(given, camera))
        io.write(given.out, tone.to_uint8(picture, dither=True))
        return
    behind = _found(given, given.sky, sun) if natural or given.sky or sun or given.altitude else None
    scene, camera = demo.landscape(
        behind,
        style=given.style,
        trees=given.trees,
        cloud=not given.no_cloud,
        rng=given.seed,
        composition=given.composition,
    )
    picture = scene.paint(_options_of(given, camera.resized(*(given.size or (1280, 720)))))
    io.write(given.out, tone.to_uint8(picture, dither=True))


def _sky(given: argparse.Namespace, sun: Sun | None) -> None:
    """Render a style, or the sky of a place, and write it."""
    natural = given.when is not None or given.place is not None
    if natural == (given.style is not None):
        msg = "give a style, or --when and --place for the true sky of a place"
        raise ValueError(msg)
    shown = Path(given.out).suffix.lower() in (".png", ".jpg", ".jpeg")
    if given.colors and not (natural and shown):
        msg = "--colors is for pictures (png, jpg) of a true sky (--when and --place)"
        raise ValueError(msg)
    if given.exposure is not None and (natural or not shown):
        msg = "--exposure is of pictures (png, jpg) of a style: a true sky is shown as an eye sees it, light is written as it is"
        raise ValueError(msg)
    found = _found(given, given.style, sun)
    width, height = given.size
    if given.panorama and not shown:
        exports.save_environment(found, given.out, height, light=True)
        return
    camera = Camera(width, height, given.fov, given.azimuth, given.elevation)
    light = found.panorama(height) if given.panorama else found.render(camera)
    if not shown:
        io.write(given.out, light)
        return
    if natural:
        fov = 180.0 if given.panorama else given.fov
        light = tone.present(light, found.adaptation(), night=not given.colors, fov=fov)
    else:
        light = tone.oneil(light, 2.0 if given.exposure is None else given.exposure)
    io.write(given.out, tone.to_uint8(light, dither=True))


def _options_of(given: argparse.Namespace, camera: Camera) -> Camera:
    """Return the camera with what was given in place of its own."""
    own = {name: getattr(given, name) for name in ("fov", "azimuth", "elevation", "position")}
    return dataclasses.replace(camera, **{name: value for name, value in own.items() if value is not None})


def _grown(given: argparse.Namespace, shape: tuple[int, int, int], progress: Any) -> clouds.Volume:
    if given.volume is not None:
        return clouds.load(given.volume)
    return clouds.procedural(given.kind, shape, rng=given.seed, progress=progress)


def _cloud(given: argparse.Namespace, sun: Sun | None) -> None:
    """Grow or load a cloud, and render or keep it."""
    grown = _grown(given, given.shape, None)
    if Path(given.out).suffix.lower() in (".npz", ".vol"):
        grown.save(given.out)
        return
    params = clouds.Params() if given.params is None else clouds.Params.from_json(Path(given.params).read_text())
    camera = demo.camera_for(grown, *given.size)
    seen = clouds.render(
        *(grown, params, camera, sun or Sun(48, 250)),
        sky=(0.16, 0.3, 0.6),
        orders=given.orders,
        samples=given.samples,
        rng=given.seed,
    )
    io.write(given.out, seen.rgb)


def _film(given: argparse.Namespace, sun: Sun | None) -> None:
    """Film a day, or a turn of the view."""
    day = (given.begin, given.end, given.place)
    if any(x is None for x in day) != all(x is None for x in day):
        msg = "--from, --to and --place go together: the day's sky of a place"
        raise ValueError(msg)
    if (given.style is None) == (given.begin is None):
        msg = "give a sky style, or --from, --to and --place for the true sky of a place"
        raise ValueError(msg)
    if given.style is None:
        place, span = Place(given.place[0], given.place[1], given.altitude), given.end - given.begin

        def day_sky(t: float) -> sky.Sky:
            return sky.Natural(given.begin + t * span, place)

        behind: Any = day_sky
    else:
        behind = _Still(_found(given, given.style, sun))

    width, height = given.size
    camera = Camera(width, height, given.fov, given.azimuth, given.elevation)
    resume, progress = not given.restart, bar_where_it_is(not given.quiet)
    shot = {"seconds": given.seconds, "fps": given.fps, "resume": resume, "progress": progress}
    if given.paint is not None:
        scene, camera = demo.landscape(behind(0.0), style=given.paint, cloud=False)
        camera = camera.resized(width, height)

    def at(t: float) -> Camera:
        return dataclasses.replace(camera, azimuth=camera.azimuth + t * given.turn)

    if given.paint is not None:
        scene.film(given.out, Timeline(at, sky=None if given.begin is None else behind), **shot)
        return
    count = io.frame_count(given.seconds, given.fps)

    def frame(k: int) -> Any:
        t = io.frame_time(k, count)
        above = behind(t)
        light = above.render(at(t))
        shown = tone.oneil(light) if given.style else tone.present(light, above.adaptation(), fov=at(t).fov)
        return tone.to_uint8(shown, dither=True)

    about = [str(x) for x in (*day, given.style, given.sun, *given.size, given.turn, given.fov)]
    about += [str(x) for x in (given.azimuth, given.elevation)]
    io.film(given.out, frame, (width, height), codec=None, quality=None, identity=" ".join(about), **shot)


def _convert(given: argparse.Namespace) -> None:
    """Write a picture or a volume in another format."""
    volumes = (".npz", ".vol", ".npy")
    source, out = (Path(x).suffix.lower() for x in (given.source, given.out))
    if (source in volumes) != (out in volumes):
        msg = f"{given.source} and {given.out} must both be pictures, or both volumes (npz, vol, npy)"
        raise ValueError(msg)
    if source in volumes:
        clouds.load(given.source).save(given.out)
    else:
        io.write(given.out, io.read(given.source))


def _fit(given: argparse.Namespace, sun: Sun | None) -> int:
    """Fit one photograph with pictures of each step, or many into a list."""
    one = given.command == "demo" or (len(given.photo) == 1 and not (given.jsonl or given.basis or given.volume))
    if one:
        path = demo.photograph() if given.command == "demo" else given.photo[0]
        found = demo.fit_photo(
            path,
            given.out,
            sun=sun,
            cloud=getattr(given, "cloud", None),
            sky=getattr(given, "sky", None),
            rng=given.seed,
            generations=given.generations,
            say=_silent if given.quiet else lambda line: print(line, file=_told(given)),
            bar=not given.quiet,
        )
        if given.json:
            print(json.dumps({"photo": str(path), "fit": found.to_dict()}), flush=True)
        return 0
    return _fit_many(given, sun)


def _told(given: argparse.Namespace) -> Any:
    return sys.stderr if given.json else sys.stdout


def _fit_many(given: argparse.Namespace, sun: Sun | None) -> int:
    if given.cloud or given.sky:
        msg = "--cloud and --sky are of one photograph"
        raise ValueError(msg)
    if given.jobs < 1:
        msg = f"--jobs must be at least 1, got {given.jobs}"
        raise ValueError(msg)
    folder = Path(given.out)
    folder.mkdir(parents=True, exist_ok=True)
    lines = folder / "fits.jsonl" if given.jsonl is None else Path(given.jsonl)
    store = lines.with_name(lines.name + ".parts")
    if not given.resume and store.exists():
        shutil.rmtree(store)
    bar = bar_where_it_is(not given.quiet)
    kept = folder / "basis.npz" if given.basis is None else Path(given.basis)
    if given.basis is None or not kept.exists():
        grown = _grown(given, (96, 160, 160), bar)
        camera, light = demo.camera_for(grown, 200, 150), sun or Sun(48, 250)
        clouds.Basis.precompute(grown, camera, light, orders=None, samples=64, rng=given.seed, progress=bar).save(kept)
    outcomes = batch.fits(
        given.photo,
        kept,
        executor=None if given.jobs == 1 else lambda: ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")),
        store=store,
        rng=given.seed,
        generations=given.generations,
        progress=bar,
    )
    rows: dict[int, dict[str, Any]] = {}
    start = time.perf_counter()
    for found in outcomes:
        row: dict[str, Any] = {"photo": given.photo[found.index]}
        row |= {"error": found.error} if found.error else {"fit": found.value.to_dict()}
        rows[found.index] = row
        if given.json:
            print(json.dumps(row), flush=True)
        elif found.error:
            print(f"pleinair: {row['photo']}: {found.error.partition(': ')[2]}", file=sys.stderr)
        elif not given.quiet:
            best = found.value.best
            print(
                f"{row['photo']}: O = {best.objective:.3f} (noise {found.value.noise:.3f}), {best.params}", flush=True
            )
    text = "".join(json.dumps(rows[i]) + "\n" for i in sorted(rows))
    io.replacing(lines, lambda stream: stream.write(text.encode()))
    failed = [row["error"] for row in rows.values() if "error" in row]
    if not failed:
        shutil.rmtree(store)
    if not given.quiet:
        took = time.perf_counter() - start
        print(f"{len(rows) - len(failed)} of {len(rows)} fitted in {took:.1f} s: {lines}", file=_told(given))
    unreadable = [error for error in failed if not error.startswith("UnfittableError")]
    return 0 if not failed else 4 if len(unreadable) == len(failed) else 3


class _Still:
    """One sky at all times."""

    def __init__(self, own: sky.Sky) -> None:
        self.own = own

    def __call__(self, t: float) -> sky.Sky:  # noqa: ARG002 -- whatever the time
        return self.own


def _silent(line: str) -> None:
    """Say nothing."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        By default those of the process.

    Returns
    -------
    int
        0 for success; 2 for arguments that are wrong; 3 where photographs could not be fitted, 4 where an input cannot
        be read; 130 for Ctrl-C.

    Examples
    --------
    >>> main(["fit", "nowhere.jpg", "--quiet"])
    4
    """
    given = _parser().parse_args(arguments)
    try:
        start = time.perf_counter()
        code = _run(given)
        if given.command in ("sky", "paint", "cloud", "film", "convert") and given.json:
            print(json.dumps({"out": given.out, "seconds": round(time.perf_counter() - start, 3)}))
        return code
    except fit.UnfittableError as error:
        code, words = 3, str(error)
    except (OSError, io.UnreadableError) as error:
        code, words = 4, str(error)
    except (ValueError, TypeError, ImportError) as error:
        code, words = 2, str(error)
    except KeyboardInterrupt:
        code, words = 130, "interrupted"
    print(f"pleinair: {words}", file=sys.stderr)
    return code


def _run(given: argparse.Namespace) -> int:
    sun = Sun(*given.sun) if getattr(given, "sun", None) else None
    if given.command == "report":
        if given.check:
            fallen = report.check(given.root, given.only, quick=given.quick)
            print("\n".join(["slower than the last report:", *fallen]) if fallen else "no ratio has fallen")
            return 1 if fallen else 0
        report.run(given.root, given.only, quick=given.quick)
    elif given.command == "sky":
        _sky(given, sun)
    elif given.command == "paint":
        _paint(given, sun)
    elif given.command == "cloud":
        _cloud(given, sun)
    elif given.command == "film":
        _film(given, sun)
    elif given.command == "convert":
        _convert(given)
    else:
        code = _fit(given, sun)
        if given.command == "demo":
            for picture in (demo.sky_styles, demo.day_and_night, demo.paintings):
                picture(given.out, say=_silent if given.quiet else print)
        return code
    return 0


if __name__ == "__main__":
    sys.exit(main())

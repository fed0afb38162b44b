"""The command line: ``pleinair`` or ``python -m pleinair``."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from . import __version__, demo, exports, io, report, sky, tone
from .astro import Place, Sun
from .camera import Camera
from .paint import styles

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


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="pleinair", description="Skies, clouds and painted landscapes.")
    parser.add_argument("--version", action="version", version=f"pleinair {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def common(command: argparse.ArgumentParser) -> None:
        command.add_argument("--out", default="out", metavar="DIR", help="folder for the pictures (default: out)")
        command.add_argument("--seed", type=_seed, default=5, help="which cloud is grown, and the search (default: 5)")
        command.add_argument("--generations", type=int, default=100, help="most generations (default: 100)")
        command.add_argument("--quiet", action="store_true", help="no progress bars")

    run = commands.add_parser("demo", help="fit a cloud to the photograph that comes with the package")
    common(run)
    one = commands.add_parser("fit", help="fit a cloud to your photograph")
    one.add_argument("photo", metavar="PHOTO", help="JPEG or PNG with clouds and some sky")
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
    view.add_argument(
        "--exposure", type=float, default=2.0, help="of O'Neil's curve, for png and jpg of a style (default: 2)"
    )
    view.add_argument("--panorama", action="store_true", help="the whole sphere, HEIGHT rows, with the Sun in a .json")
    paint = commands.add_parser("paint", help="paint a landscape of hills, a pond, rocks and trees (png, jpg)")
    paint.add_argument("style", metavar="STYLE", nargs="?", default="corot", help=", ".join(styles()))
    paint.add_argument("--sky", metavar="STYLE", help="a sky style or a .json file of a sky, instead of a true sky")
    _whereabouts(paint)
    paint.add_argument("--out", default="painting.png", metavar="FILE", help="picture to write (default: painting.png)")
    paint.add_argument("--size", type=int, nargs=2, default=(1280, 720), metavar=("WIDTH", "HEIGHT"), help="[px]")
    paint.add_argument("--trees", type=int, default=12, metavar="N", help="how many (default: 12)")
    paint.add_argument("--seed", type=_seed, default=1, help="where trees and rocks stand (default: 1)")
    paint.add_argument("--no-cloud", action="store_true", help="a cloudless sky")
    table = commands.add_parser("report", help="measure speed and error beside the rivals (in a checkout)")
    table.add_argument("--only", default="", metavar="WORD", help="only benches with this word; writes nothing")
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
    """Paint a landscape and write it."""
    natural = given.when is not None or given.place is not None
    if natural and given.sky is not None:
        msg = "give --sky, or --when and --place for the true sky of a place"
        raise ValueError(msg)
    if Path(given.out).suffix.lower() not in (".png", ".jpg", ".jpeg"):
        msg = f"--out must end in .png, .jpg or .jpeg: a painting is no light to measure; got {given.out}"
        raise ValueError(msg)
    behind = _found(given, given.sky, sun) if natural or given.sky or sun or given.altitude else None
    scene, camera = demo.landscape(
        behind, style=given.style, trees=given.trees, cloud=not given.no_cloud, rng=given.seed
    )
    io.write(given.out, tone.to_uint8(scene.paint(camera.resized(*given.size)), dither=True))


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
        light = tone.oneil(light, given.exposure)
    io.write(given.out, tone.to_uint8(light, dither=True))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        By default those of the process.

    Returns
    -------
    int
        0 for success, 1 for an error that was explained, 130 for Ctrl-C.

    Examples
    --------
    >>> main(["fit", "nowhere.jpg", "--quiet"])
    1
    """
    given = _parser().parse_args(arguments)
    try:
        if given.command == "report":
            report.run(given.root, given.only)
            return 0
        sun = Sun(*given.sun) if getattr(given, "sun", None) else None
        if given.command == "sky":
            _sky(given, sun)
            return 0
        if given.command == "paint":
            _paint(given, sun)
            return 0
        path = demo.photograph() if given.command == "demo" else given.photo
        demo.fit_photo(
            path,
            given.out,
            sun=sun,
            cloud=getattr(given, "cloud", None),
            sky=getattr(given, "sky", None),
            rng=given.seed,
            generations=given.generations,
            bar=not given.quiet,
        )
        if given.command == "demo":
            demo.sky_styles(given.out)
            demo.day_and_night(given.out)
            demo.paintings(given.out)
    except (FileNotFoundError, ValueError, TypeError, ImportError, OSError) as error:
        print(f"pleinair: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("pleinair: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())

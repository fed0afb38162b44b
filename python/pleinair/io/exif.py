"""What a camera wrote into a photograph of when, where and through which lens it was taken (EXIF 3.0)."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

from ..astro import Place, Sun
from ..camera import Camera
from .files import PathLike
from .photographs import pillow

# Half the diagonal of the film that focal lengths are compared with, 36 mm x 24 mm [mm].
_HALF_DIAGONAL = math.hypot(36, 24) / 2
# Cameras whose clock was never set say one of these years.
_UNSET = range(1990, 2101)


@dataclass(frozen=True)
class PhotoFacts:
    """When, where and through which lens a photograph was taken, as far as it says so.

    Attributes
    ----------
    when : datetime or None
        With a time zone.
    place : pleinair.Place or None
        Where the camera stood.
    direction : float or None
        Of the view, clockwise from true north [°].
    focal_length : float or None
        Of the lens on 36 mm film with the same diagonal field [m].
    doubts : tuple of str
        What was there and was not believed, a sentence each.
    """

    when: datetime | None = None
    place: Place | None = None
    direction: float | None = None
    focal_length: float | None = None
    doubts: tuple[str, ...] = ()

    @property
    def sun(self) -> Sun | None:
        """The Sun then and there; None where it cannot be known.

        Examples
        --------
        >>> PhotoFacts(datetime(2024, 6, 21, 12, tzinfo=UTC), Place(48.8, 2.3)).sun.elevation > 60
        True
        """
        if self.when is None or self.place is None:
            return None
        return Sun.at(self.when, self.place)

    def camera(self, width: int, height: int) -> Camera | None:
        """Return a camera with the photograph's field of view; None where it cannot be known.

        Parameters
        ----------
        width, height : int
            Of the whole photograph [px].

        Examples
        --------
        >>> round(PhotoFacts(focal_length=0.05).camera(300, 200).fov, 2)
        26.99
        """
        if self.focal_length is None:
            return None
        share = height / math.hypot(width, height)
        fov = 2 * math.degrees(math.atan(share * _HALF_DIAGONAL / (1000 * self.focal_length)))
        return Camera(width, height, fov, 0.0 if self.direction is None else self.direction)


def photo_facts(path: PathLike) -> PhotoFacts:
    """Return what a photograph says of its time, place and lens; nothing where it says nothing.

    Parameters
    ----------
    path : path
        JPEG, PNG, TIFF or WebP.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ImportError
        Pillow is not installed.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from pleinair.io import write
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     photo_facts(write(f"{folder}/a.png", np.zeros((4, 4, 3))))
    PhotoFacts(when=None, place=None, direction=None, focal_length=None, doubts=())
    """
    path = Path(path)
    if not path.exists():
        msg = f"there is no file {path}"
        raise FileNotFoundError(msg)
    Image = pillow()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(path.read_bytes())) as picture:
                found = picture.getexif()
                camera, gps = dict(found.get_ifd(0x8769)), dict(found.get_ifd(0x8825))
    except Exception:  # noqa: BLE001 -- whatever a damaged block makes Pillow raise: it says nothing
        return PhotoFacts()
    doubts: list[str] = []

    def believed(read: Callable[[], Any], what: str) -> Any:
        try:
            return read()
        except (ValueError, TypeError, ZeroDivisionError, IndexError, KeyError, OverflowError, AttributeError) as error:
            doubts.append(f"the photograph's {what} is not believed: {error}")
            return None

    satellites = believed(lambda: _satellite_time(gps), "satellite time")
    when = believed(lambda: _time(camera, satellites), "time")
    place = believed(lambda: _place(gps), "place")
    direction = believed(lambda: _direction(gps), "direction")
    focal = believed(lambda: _focal_length(camera), "focal length")
    return PhotoFacts(when, place, direction, focal, tuple(doubts))


def _text(value: Any) -> str:
    text = value.decode("ascii", "replace") if isinstance(value, bytes) else str(value)
    return text.strip("\0 ")


def _number(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        msg = f"it holds {value}"
        raise ValueError(msg)
    return number


def _satellite_time(gps: Mapping[int, Any]) -> datetime | None:
    if 29 not in gps or 7 not in gps:
        return None
    day = datetime.strptime(_text(gps[29]), "%Y:%m:%d").replace(tzinfo=UTC)
    hours, minutes, seconds = (_number(v) for v in gps[7])
    return day + timedelta(hours=hours, minutes=minutes, seconds=seconds)


def _time(camera: Mapping[int, Any], satellites: datetime | None) -> datetime | None:
    """Return the time of the exposure: the camera's clock with its zone, or with that between it and the satellites."""
    if 36867 not in camera:
        return _believable(satellites)
    local = datetime.strptime(_text(camera[36867]), "%Y:%m:%d %H:%M:%S")
    fraction = _text(camera.get(37521, ""))
    if fraction.isdecimal():
        local += timedelta(seconds=float(f"0.{fraction}"))
    zone = _text(camera.get(36881, ""))
    if zone:
        return _believable(datetime.fromisoformat(f"{local.isoformat()}{'+00:00' if zone == 'Z' else zone}"))
    if satellites is None:
        return None  # a clock without a zone tells no time
    quarters = round((local - satellites.replace(tzinfo=None)).total_seconds() / 900)
    return _believable(local.replace(tzinfo=timezone(timedelta(minutes=15 * quarters))))


def _believable(when: datetime | None) -> datetime | None:
    if when is not None and when.year not in _UNSET:
        msg = f"it says {when.year}"
        raise ValueError(msg)
    return when


def _place(gps: Mapping[int, Any]) -> Place | None:
    if 2 not in gps or 4 not in gps:
        return None

    def angle(parts: Any, sign: str) -> float:
        degrees, minutes, seconds = (*(_number(v) for v in parts), 0.0, 0.0)[:3]
        return (degrees + minutes / 60 + seconds / 3600) * (-1 if sign in ("S", "W") else 1)

    latitude, longitude = angle(gps[2], _text(gps.get(1, "N"))), angle(gps[4], _text(gps.get(3, "E")))
    if latitude == 0 and longitude == 0:
        msg = "it says 0°, 0°"
        raise ValueError(msg)
    altitude = _number(gps.get(6, 0.0)) * (-1 if gps.get(5) in (1, b"\x01") else 1)
    return Place(latitude, longitude, altitude)


def _direction(gps: Mapping[int, Any]) -> float | None:
    # Magnetic directions would need a model of the field.
    return _number(gps[17]) % 360 if 17 in gps and _text(gps.get(16, "T")) == "T" else None


def _focal_length(camera: Mapping[int, Any]) -> float | None:
    if not camera.get(41989):  # 0 is unknown
        return None
    length = _number(camera[41989]) / 1000
    if not 0.004 <= length <= 5:
        msg = f"it says {1000 * length:g} mm"
        raise ValueError(msg)
    return length

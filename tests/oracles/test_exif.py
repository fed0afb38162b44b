"""Time, place and lens of photographs, against numbers that were written into them by hand (tests/data/photographs)."""

import json
import math
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pleinair as pa
import pytest
from PIL import Image

PHOTOS = Path(__file__).parents[1] / "data" / "photographs"
EXPECTED = json.loads((PHOTOS / "expected.json").read_text())


def test_everything_is_read():
    want, got = EXPECTED["exif_full.jpg"], pa.io.photo_facts(PHOTOS / "exif_full.jpg")
    assert got.when == datetime.fromisoformat(want["utc"])
    assert got.when.utcoffset() == timedelta(hours=2)
    assert got.place.latitude == pytest.approx(want["latitude"], abs=1e-9)
    assert got.place.longitude == pytest.approx(want["longitude"], abs=1e-9)
    assert got.place.altitude == want["altitude_m"]
    assert got.direction == want["direction_true_deg"]
    assert got.focal_length == pytest.approx(want["focal_35mm"] / 1000)
    assert got.doubts == ()
    camera = got.camera(300, 200)
    assert camera.azimuth == 271.5
    across = 2 * math.degrees(math.atan(1.5 * math.tan(math.radians(camera.fov / 2))))
    assert across == pytest.approx(want["hfov_deg"], abs=1e-3)
    # Upright or turned, the lens is the same.
    tall = got.camera(200, 300)
    assert tall.fov == pytest.approx(across, abs=1e-9)


def test_a_clock_without_a_zone_has_that_to_the_satellites():
    got = pa.io.photo_facts(PHOTOS / "exif_no_offset.jpg")
    assert got.when == datetime(2001, 6, 21, 18, 15, 30, tzinfo=UTC) + timedelta(seconds=got.when.microsecond / 1e6)
    assert got.when.utcoffset() == timedelta(hours=2)
    assert got.focal_length is None
    assert got.camera(30, 20) is None


def test_below_the_sea():
    got, want = pa.io.photo_facts(PHOTOS / "exif_below_sea.jpg").place, EXPECTED["exif_below_sea.jpg"]
    assert (got.latitude, got.longitude, got.altitude) == (want["latitude"], want["longitude"], want["altitude_m"])


def written(path, camera=None, gps=None):
    exif = Image.Exif()
    exif.get_ifd(0x8769).update(camera or {})
    exif.get_ifd(0x8825).update(gps or {})
    Image.fromarray(np.full((32, 48, 3), 90, np.uint8)).save(path, exif=exif)
    return path


HERE = {1: "N", 2: (48.0, 51.0, 30.0), 3: "E", 4: (2.0, 17.0, 40.0)}


def test_the_sun_of_a_photograph(tmp_path):
    path = written(tmp_path / "a.jpg", {36867: "2024:06:20 20:06:50", 36881: "+00:00"}, HERE)
    photo = pa.fit.Photo.analyse(path, ground=None)
    want = pa.Sun.at(datetime(2024, 6, 20, 20, 6, 50, tzinfo=UTC), pa.Place(48 + 51.5 / 60, 2 + 17 / 60 + 40 / 3600))
    assert photo.sun.elevation == pytest.approx(want.elevation, abs=1e-9)
    assert photo.sun.azimuth == pytest.approx(want.azimuth, abs=1e-9)
    assert photo.camera is None


@pytest.mark.parametrize(
    ("camera", "gps", "doubt"),
    [
        ({36867: "1970:01:01 00:00:00", 36881: "+00:00"}, {}, "it says 1970"),
        ({36867: "0000:00:00 00:00:00", 36881: "+00:00"}, {}, "time"),
        ({36867: "yesterday"}, {}, "time"),
        ({36867: "2024:06:20 20:06:50", 36881: "+99:00"}, {}, "time"),
        ({}, HERE | {2: (0.0, 0.0, 0.0), 4: (0.0, 0.0, 0.0)}, "0°, 0°"),
        ({}, HERE | {2: (95.0, 0.0, 0.0)}, "latitude"),
        ({41989: 60000}, {}, "60000 mm"),
    ],
)
def test_what_cannot_be_is_doubted_and_left_open(tmp_path, camera, gps, doubt):
    got = pa.io.photo_facts(written(tmp_path / "a.jpg", camera, gps))
    assert (got.when, got.place, got.focal_length) == (None, None, None)
    assert any(doubt in text for text in got.doubts), got.doubts


def test_what_says_nothing_says_nothing(tmp_path):
    for path in (
        written(tmp_path / "a.jpg"),
        written(tmp_path / "b.jpg", {36867: "2024:06:20 20:06:50"}),
        pa.io.write(tmp_path / "a.exr", np.ones((4, 4, 3))),
    ):
        assert pa.io.photo_facts(path) == pa.io.PhotoFacts()
    (tmp_path / "c.jpg").write_bytes((PHOTOS / "exif_full.jpg").read_bytes()[:300])
    pa.io.photo_facts(tmp_path / "c.jpg")
    with pytest.raises(FileNotFoundError):
        pa.io.photo_facts(tmp_path / "d.jpg")


def test_nothing_of_it_is_written(tmp_path):
    path = written(tmp_path / "a.jpg", {36867: "2024:06:20 20:06:50", 36881: "+00:00"}, HERE)
    copy = pa.io.write(tmp_path / "b.jpg", pa.io.read(path))
    assert pa.io.photo_facts(copy) == pa.io.PhotoFacts()

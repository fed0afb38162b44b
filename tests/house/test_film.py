"""Videos and films: sizes, lengths, colours; films that are killed and resumed are equal to those made in one go."""

import itertools
import signal
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pleinair as pa
import pytest

PATCHES = {(200, 40, 40): (20, 30), (40, 200, 40): (20, 200), (40, 40, 200): (100, 30), (230, 220, 210): (100, 200)}
ENCODERS = [
    ("a.mp4", "h264"),
    ("a.webm", "vp9"),
    ("b.mp4", "av1"),
    ("a.mkv", "ffv1"),
    ("b.mkv", "h264"),
    ("b.webm", "av1"),
]


def bars(k, height=180, width=320):
    y, x = np.mgrid[0:height, 0:width]
    levels = np.stack([x // 2 + k, y + 30, 120 + 0 * x], -1).astype(np.uint8)
    for color, (top, left) in PATCHES.items():
        levels[top : top + 24, left : left + 24] = color
    return levels


def decoded(path):
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        about = stream.average_rate, float(file.duration / av.time_base), stream.codec_context.color_range
        more = stream.codec_context.colorspace, stream.codec_context.color_primaries, stream.codec_context.color_trc
        matrix = None if stream.codec_context.name == "ffv1" else av.video.reformatter.Colorspace.ITU709
        frames = [f.reformat(format="rgb24", src_colorspace=matrix).to_ndarray() for f in file.decode(stream)]
    return np.array(frames), *about, more


@pytest.mark.parametrize(("name", "codec"), ENCODERS)
def test_colours_length_and_size(tmp_path, name, codec):
    frames = [bars(k) for k in range(12)]
    got, rate, seconds, limited, tags = decoded(pa.io.write_video(tmp_path / name, frames, fps=12, codec=codec))
    assert got.shape == (12, 180, 320, 3)
    assert rate == 12
    assert seconds == pytest.approx(1, abs=0.002)
    off = np.abs(got.astype(int) - np.array(frames))
    if codec == "ffv1":
        assert not off.any(), "lossless"
        return
    assert (limited, *tags) == (1, 1, 1, 1)
    assert off.mean() <= 2.5
    for top, left in PATCHES.values():
        assert off[:, top + 8 : top + 16, left + 8 : left + 16].mean() <= 4, "Rec. 601 is 15 off"


def test_linear_light_and_files_are_frames(tmp_path):
    light = [np.full((16, 16, 3), v, np.float32) for v in (0, 0.2158605, 2)]
    got = decoded(pa.io.write_video(tmp_path / "a.mkv", light))[0]
    assert got[:, 3, 3, 0].tolist() == [0, 128, 255]
    paths = [pa.io.write(tmp_path / f"{k}.png", x) for k, x in enumerate(light)]
    assert np.array_equal(decoded(pa.io.write_video(tmp_path / "b.mkv", paths))[0], got)


def test_a_rate_of_film_is_kept(tmp_path):
    path = pa.io.write_video(tmp_path / "a.mp4", [bars(k) for k in range(24)], fps=24000 / 1001)
    assert decoded(path)[1] == Fraction(24000, 1001)


@pytest.mark.parametrize(("name", "size"), [("a.mp4", (46, 34)), ("a.mkv", (45, 33))])
def test_odd_sizes_are_padded_and_said(tmp_path, name, size):
    frames = [np.full((33, 45, 3), 90, np.uint8)] * 3
    if name == "a.mkv":
        path = pa.io.write_video(tmp_path / name, frames)
    else:
        with pytest.warns(pa.DomainWarning, match="45 x 33 are padded to 46 x 34"):
            path = pa.io.write_video(tmp_path / name, frames)
    got = decoded(path)[0]
    assert got.shape[2:0:-1] == size
    assert np.abs(got.astype(int) - 90).max() <= 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"path": "a.avi"}, "path's ending"),
        ({"path": "a.mp4", "codec": "vp9"}, "codec of .mp4"),
        ({"frames": []}, "at least one frame"),
        ({"frames": [bars(0), bars(0, 140)]}, "frame 1 must have the shape of the first"),
        ({"frames": [np.full((8, 8, 3), np.nan)]}, "finite"),
        ({"frames": [np.zeros((8, 8))]}, "frames"),
        ({"fps": 0}, "fps"),
        ({"quality": 99}, "quality"),
    ],
)
def test_wrong_arguments_are_refused_and_leave_nothing(tmp_path, change, words):
    arguments = {"path": "a.mkv", "frames": [bars(0)]} | change
    with pytest.raises((ValueError, TypeError), match=words):
        pa.io.write_video(tmp_path / arguments.pop("path"), arguments.pop("frames"), **arguments)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_said(tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"):
        pa.io.write_video(tmp_path / "nowhere" / "a.mkv", [bars(0)])


SCENE = pa.Scene(pa.sky.Aoas(sun=pa.Sun(30, 160), cloud_complexity=3))
PAN = pa.Timeline({0: pa.Camera(64, 48), 1: pa.Camera(64, 48, azimuth=40)})


@pytest.mark.parametrize("name", ["a.mkv", "a.mp4", "a.webm"])
def test_segments_join_to_the_film_in_one_go(tmp_path, name):
    path = SCENE.film(tmp_path / name, PAN, seconds=2.5, fps=10)
    assert [p.name for p in tmp_path.iterdir()] == [name], "no litter"
    got, rate, seconds, _, _ = decoded(path)
    assert (len(got), rate) == (25, 10)
    assert seconds == pytest.approx(2.5, abs=0.01)
    want = np.array([pa.tone.to_uint8(f) for f in SCENE.animate(PAN, 25)]).astype(int)
    off = np.abs(got.astype(int) - want)
    assert off.max() <= 1 if name == "a.mkv" else off.mean() <= 2.5


FILM = """
import sys, time
import pleinair as pa
scene = pa.Scene(pa.sky.Aoas(sun=pa.Sun(30, 160), cloud_complexity=3))
pan = pa.Timeline({0: pa.Camera(64, 48), 1: pa.Camera(64, 48, azimuth=40)})
def tick(done, total):
    print(done, flush=True)
    time.sleep(0.01)
scene.film(sys.argv[1], pan, seconds=4.5, fps=10, progress=tick)
"""


@pytest.mark.parametrize("name", ["a.mkv", "a.mp4"])
def test_a_killed_film_goes_on_where_it_was(tmp_path, name):
    whole = SCENE.film(tmp_path / f"whole{Path(name).suffix}", PAN, seconds=4.5, fps=10)
    path = tmp_path / name
    with subprocess.Popen([sys.executable, "-c", FILM, str(path)], stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            if int(line) == 30:
                process.kill()
                break
        assert process.wait() == -signal.SIGKILL
    assert not path.exists(), "the final name is that of whole films"
    kept = sorted(p.name for p in (tmp_path / f"{name}.parts").iterdir())
    assert sum(n.startswith("segment") for n in kept) >= 2
    # A frame that is there is not painted again.
    calls = []
    original = pa.Scene.frame
    try:
        pa.Scene.frame = lambda self, timeline, t: calls.append(t) or original(self, timeline, t)
        SCENE.film(path, PAN, seconds=4.5, fps=10)
    finally:
        pa.Scene.frame = original
    assert 10 <= len(calls) <= 16, "45 frames less those that were finished"
    assert np.array_equal(decoded(path)[0], decoded(whole)[0])
    assert path.read_bytes() == whole.read_bytes() or name == "a.mkv"
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted({path.name, whole.name})


def test_what_was_left_by_another_film_is_not_taken_up(tmp_path):
    path = tmp_path / "a.mkv"

    class Enough(Exception):
        pass

    def stop(done, total):
        if done == 5:
            raise Enough

    with pytest.raises(Enough):
        SCENE.film(path, PAN, seconds=1, fps=10, progress=stop)
    other = pa.Scene(pa.sky.Aoas(sun=pa.Sun(31, 160), cloud_complexity=3))
    with pytest.raises(ValueError, match=r"holds another film \(its of is not of this one\)"):
        other.film(path, PAN, seconds=1, fps=10)
    with pytest.raises(ValueError, match="its count"):
        SCENE.film(path, PAN, seconds=2, fps=10)
    assert len(decoded(other.film(path, PAN, seconds=1, fps=10, resume=False))[0]) == 10
    assert [p.name for p in tmp_path.iterdir()] == ["a.mkv"]


def test_progress_counts_every_frame(tmp_path):
    ticks = []
    SCENE.film(tmp_path / "a.mkv", PAN, seconds=0.5, fps=10, progress=lambda *a: ticks.append(a))
    assert ticks == list(zip(range(1, 6), itertools.repeat(5), strict=False))


def test_ctrl_c_stops_a_film_and_keeps_its_frames(tmp_path):
    path = tmp_path / "a.mkv"
    with subprocess.Popen(
        [sys.executable, "-c", FILM, str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        for line in process.stdout:
            if int(line) == 5:
                break
        sent = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.stdout.read()
        assert process.wait() in (1, 130, -signal.SIGINT)
        assert time.monotonic() - sent < 1
        assert "KeyboardInterrupt" in process.stderr.read()
    assert len(list((tmp_path / "a.mkv.parts").glob("frame_*.png"))) >= 5
    assert not list((tmp_path / "a.mkv.parts").glob("*.part"))

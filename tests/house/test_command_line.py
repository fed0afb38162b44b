"""The command line of pipelines: lists of photographs, exit codes, clouds, films, conversions."""

import json
import os
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pleinair as pa
import pytest
from pleinair.__main__ import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("cli")
    cloud = pa.clouds.procedural("cumulus", (12, 16, 16), rng=1)
    cloud.save(place / "cloud.npz")
    camera = pa.Camera.look_at((0, -800, 900), (160, 160, 900), 32, 24, fov=40)
    pa.clouds.Basis.precompute(cloud, camera, pa.Sun(40, 160)).save(place / "basis.npz")
    rng = np.random.default_rng(0)
    for k in range(3):
        picture = np.full((32, 48, 3), (0.1, 0.3, 0.8), np.float32)
        picture[6:18, 8:38] = np.linspace(0.3, 0.7 + 0.3 * rng.random(), 30)[:, None]
        pa.io.write(place / f"{k}.png", picture)
    pa.io.write(place / "night.png", np.zeros((32, 48, 3), np.float32))
    (place / "bad.png").write_bytes(b"no picture")
    return place


def fit(folder, *names, out="out", more=()):
    photos = [str(folder / name) for name in names]
    common = [
        "--basis",
        str(folder / "basis.npz"),
        "--out",
        str(folder / out),
        "--generations",
        "3",
        "--json",
        "--quiet",
    ]
    return main(["fit", *photos, *common, *more])


def rows(text):
    return [json.loads(line) for line in text.splitlines()]


def test_a_list_of_photographs(folder, capsys):
    assert fit(folder, "0.png", "1.png", "2.png") == 0
    found = rows(capsys.readouterr().out)
    assert [row["photo"] for row in found] == [str(folder / f"{k}.png") for k in range(3)]
    assert rows((folder / "out" / "fits.jsonl").read_text()) == found
    fits = [pa.fit.CloudFit.from_dict(row["fit"]) for row in found]
    assert len({one.best.objective for one in fits}) == 3
    assert not (folder / "out" / "fits.jsonl.parts").exists()


@pytest.mark.parametrize(
    ("names", "code"),
    [
        (("0.png", "night.png"), 3),
        (("0.png", "night.png", "bad.png"), 3),
        (("0.png", "bad.png", "nowhere.png"), 4),
    ],
)
def test_exit_codes_say_what_failed(folder, names, code, capsys):
    assert fit(folder, *names, out=f"code{len(names)}{code}") == code
    found = rows(capsys.readouterr().out)
    assert ["fit" in row for row in found] == [True] + [False] * (len(names) - 1)
    assert all(row["error"] for row in found[1:])


def test_resuming_fits_only_what_is_missing(folder, capsys, monkeypatch):
    assert fit(folder, "0.png", "bad.png", out="again") == 4
    first = rows(capsys.readouterr().out)
    calls = []
    whole = pa.fit.Photo.analyse
    monkeypatch.setattr(pa.fit.Photo, "analyse", lambda *a, **k: calls.append(a) or whole(*a, **k))
    assert fit(folder, "0.png", "bad.png", out="again", more=["--resume"]) == 4
    assert rows(capsys.readouterr().out) == first
    assert [name for (name,) in calls] == [str(folder / "bad.png")], "the first was there"


def test_jobs_give_the_same_fits(folder, capsys):
    assert fit(folder, "0.png", "1.png", out="one") == 0
    one = capsys.readouterr().out
    assert fit(folder, "0.png", "1.png", out="two", more=["--jobs", "2"]) == 0
    assert sorted(capsys.readouterr().out.splitlines()) == sorted(one.splitlines())


def test_clouds_and_conversions(folder):
    vol = folder / "cloud.vol"
    assert main(["convert", str(folder / "cloud.npz"), str(vol)]) == 0
    assert pa.clouds.load(vol) == pa.clouds.load(folder / "cloud.npz")
    assert main(["cloud", str(vol), "--size", "24", "16", "--samples", "1", "--out", str(folder / "c.png")]) == 0
    assert pa.io.read(folder / "c.png").shape == (16, 24, 3)
    assert main(["cloud", "--shape", "8", "8", "8", "--out", str(folder / "grown.npz")]) == 0
    assert pa.clouds.load(folder / "grown.npz").density.shape == (8, 8, 8)
    assert main(["convert", str(folder / "0.png"), str(folder / "0.exr")]) == 0
    assert np.array_equal(pa.io.read(folder / "0.exr"), pa.io.read(folder / "0.png"))


def test_films(folder):
    small = ["--seconds", "0.3", "--fps", "10", "--size", "32", "18", "--quiet"]
    day = ["--from", "2024-08-05T19:00+02:00", "--to", "2024-08-05T22:30+02:00", "--place", "45", "6"]
    for name, arguments in (
        ("turn.mkv", ["coral", "--turn", "40"]),
        ("day.mkv", day),
        ("painted.mkv", [*day, "--paint", "corot"]),
    ):
        assert main(["film", *arguments, *small, "--out", str(folder / name)]) == 0
        with av.open(str(folder / name)) as file:
            frames = [f.to_ndarray(format="rgb24") for f in file.decode(video=0)]
        assert np.shape(frames) == (3, 18, 32, 3)
        assert not np.array_equal(frames[0], frames[2])
    want = pa.tone.to_uint8(pa.tone.oneil(pa.sky.preset("coral").render(pa.Camera(32, 18, 70, 180 + 40, 18))))
    with av.open(str(folder / "turn.mkv")) as file:
        last = [f.to_ndarray(format="rgb24") for f in file.decode(video=0)][-1]
    assert np.abs(last.astype(int) - want).max() <= 1


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["fit", "nowhere.jpg"], 4, "nowhere.jpg"),
        (["fit", "a.jpg", "b.jpg", "--jobs", "0"], 2, "--jobs"),
        (["fit", "a.jpg", "b.jpg", "--cloud", "m.png"], 2, "one photograph"),
        (["sky", "coral", "--exposure", "2", "--out", "x.exr"], 2, "--exposure"),
        (["film"], 2, "give a sky style"),
        (["film", "coral", "--place", "45", "6"], 2, "go together"),
        (["film", "coral", "--out", "film.avi"], 2, "ending"),
        (["convert", "a.png", "b.npz"], 2, "both"),
        (["convert", "nowhere.npz", "b.npz"], 4, "nowhere.npz"),
        (["cloud", "--kind", "fluffy"], 2, "kind"),
        (["cloud", "nowhere.npz"], 4, "nowhere.npz"),
    ],
)
def test_codes_and_words_of_errors(arguments, code, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == code
    message = capsys.readouterr().err
    assert message.startswith("pleinair: ")
    assert words in message
    assert message.count("\n") == 1
    assert not [p for p in tmp_path.iterdir() if p.name != "out"]


@pytest.mark.parametrize("name", ["bad.png", "bad.npz", "bad.vol", "bad.npy"])
def test_what_is_damaged_cannot_be_read(name, capsys, tmp_path):
    (tmp_path / name).write_bytes(b"neither a picture nor a volume")
    assert main(["convert", str(tmp_path / name), str(tmp_path / f"b{name[-4:]}")]) == 4
    assert name in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("command", ["sky", "fit", "cloud", "paint", "film", "convert", "report", "demo"])
def test_help_says_units(command):
    done = subprocess.run(
        [sys.executable, "-m", "pleinair", command, "--help"], capture_output=True, text=True, check=True
    )
    assert "usage: pleinair" in done.stdout
    if command in ("sky", "film", "paint"):
        assert "[°]" in done.stdout
        assert "[px]" in done.stdout


def test_sixty_photographs_take_no_more_memory_than_ten(folder, capsys, monkeypatch):
    from pleinair import batch

    seen = []
    whole = batch.fits

    def watched(*arguments, **options):
        for outcome in whole(*arguments, **options):
            seen.append(int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
            yield outcome

    monkeypatch.setattr(batch, "fits", watched)
    assert fit(folder, *[f"{k % 3}.png" for k in range(60)], out="sixty") == 0
    assert len(rows(capsys.readouterr().out)) == 60
    assert max(seen[10:]) - seen[10] < 30e6

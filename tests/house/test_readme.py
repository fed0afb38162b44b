"""The README's example runs, its commands exist, and its links lead somewhere."""

import re
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pleinair as pa
import pytest
from pleinair.demo import papers

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text()


def test_the_example_runs_and_is_ten_lines(tmp_path, monkeypatch, capsys):
    examples = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    assert len(examples) == 4
    monkeypatch.chdir(tmp_path)
    space = {}
    for code in examples:
        assert len([line for line in code.splitlines() if line.strip()]) <= 10
        exec(compile(code, "README.md", "exec"), space)  # noqa: S102 - the example is ours
    assert pa.io.read(tmp_path / "coral.png").shape == (720, 1280, 3)
    assert (tmp_path / "coral.json").exists()
    assert pa.io.read(tmp_path / "night.png").shape == (720, 1280, 3)
    assert pa.io.read(tmp_path / "oak.png").shape == (720, 1280, 3)
    said = capsys.readouterr().out
    assert "O = " in said
    assert "('dark sky', 'stars', 'discs') 21." in said
    assert space["fit"].best.objective < 0.6
    assert pa.io.read(tmp_path / "cloud.png").shape == (480, 640, 3)


def test_its_commands_are_in_the_makefile():
    targets = re.findall(r"^([a-z]+):.*##", (ROOT / "Makefile").read_text(), re.MULTILINE)
    for command in re.findall(r"^make (\w+)", TEXT, re.MULTILINE):
        assert command in targets
    assert {"demo", "test", "check", "report", "docs", "clean", "help"} <= set(targets)


@pytest.mark.parametrize("link", re.findall(r"\]\(([\w/.]+)\)", TEXT))
def test_its_links_lead_somewhere(link):
    assert (ROOT / link).exists()


def test_the_version_is_one():
    cargo = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)
    assert cargo.group(1) == pa.__version__


def test_the_command_line(tmp_path):
    def run(*arguments):
        command = [sys.executable, "-m", "pleinair", *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=100, check=False, cwd=tmp_path)

    assert run("--version").stdout.strip() == f"pleinair {pa.__version__}"
    assert run().returncode == 2
    done = run("sky", "sunset", "--sun", "3", "200", "--size", "64", "36", "--out", "sky.png")
    assert done.returncode == 0, done.stderr
    assert pa.io.read(tmp_path / "sky.png").shape == (36, 64, 3)
    done = run("sky", "coral", "--panorama", "--size", "64", "32", "--out", "sky.exr")
    assert done.returncode == 0, done.stderr
    assert pa.io.read(tmp_path / "sky.exr").shape == (32, 64, 3)
    assert (tmp_path / "sky.json").exists()
    wrong = run("sky", "nosuch")
    assert wrong.returncode == 2
    assert "coral" in wrong.stderr


def test_a_fit_from_the_command_line(tmp_path, monkeypatch):
    from pleinair.__main__ import main

    # In this process, of a basis of fewer pixels: the whole one takes seconds.
    whole = papers.camera_for
    monkeypatch.setattr(papers, "camera_for", lambda cloud, width, height: whole(cloud, width // 4, height // 4))
    arguments = ["--out", str(tmp_path / "mine"), "--generations", "3", "--quiet", "--seed", "2"]
    assert main(["fit", str(pa.demo.photograph()), *arguments]) == 0
    made = {p.name for p in (tmp_path / "mine").iterdir()}
    assert made == {
        "photo.png", "mask.png", "sky.png", "fits.png", "convergence.png", "final.png", "in_photo.png", "cloud.npz", "params.json",
    }  # fmt: skip
    assert pa.io.read(tmp_path / "mine" / "final.png").shape == (480, 640, 3)
    found = pa.clouds.Params.from_json((tmp_path / "mine" / "params.json").read_text())
    # In the ranges that are searched, and no corner of them.
    assert 0 < found.g < 0.97
    assert 0 < found.light_intensity < 10
    assert 1e-4 < found.sigma_t < 1


def test_the_true_sky_from_the_command_line(tmp_path, capsys):
    from pleinair.__main__ import main

    def run(*arguments):
        return main(["sky", *map(str, arguments), "--size", "48", "24"])

    place, when = ("--place", 48.8, -2.3), ("--when", "2024-08-06T00:30+02:00")
    there = pa.Place(48.8, -2.3, 500)
    sky = pa.sky.Natural(datetime(2024, 8, 5, 22, 30, tzinfo=UTC), there)
    seen = sky.render(pa.Camera(48, 24, 70, 180, 18))
    for colors in (False, True):
        out = tmp_path / f"{colors}.png"
        assert run(*when, *place, "--altitude", 500, "--out", out, *["--colors"] * colors) == 0
        shown = pa.tone.present(seen, sky.adaptation(), night=not colors, fov=70)
        assert (pa.tone.to_uint8(pa.io.read(out)) == pa.tone.to_uint8(shown, dither=True)).all()
    assert run(*when, *place, "--altitude", 500, "--panorama", "--out", tmp_path / "sky.exr") == 0
    assert (pa.io.read(tmp_path / "sky.exr") == sky.without_disc().panorama(24)).all()
    assert (tmp_path / "sky.json").exists()
    for arguments, words in (
        ((), "give a style"),
        (("coral", *when, *place), "give a style"),
        (when, "together"),
        (("coral", "--colors"), "--colors"),
        ((*when, *place, "--colors", "--out", tmp_path / "n.exr"), "--colors"),
        ((*when, "--place", 91, 0), "latitude"),
        (("--when", "1700-01-01T00:00Z", *place), "1900"),
    ):
        assert run(*arguments) == 2, arguments
        assert words in capsys.readouterr().err
    for instant in ("yesterday", "2024-08-05T22:30"):
        with pytest.raises(SystemExit) as stop:
            run("--when", instant, *place)
        assert stop.value.code == 2
        assert "+02:00" in capsys.readouterr().err


def test_a_painting_from_the_command_line(tmp_path, capsys, monkeypatch):
    from pleinair.__main__ import main

    def run(*arguments):
        return main(["paint", *map(str, arguments), "--size", "64", "36", "--trees", "1", "--no-cloud"])

    # Growth is solved elsewhere (tests/papers/test_corot_detail.py): here only that the command paints its scene.
    whole = pa.demo.landscape
    monkeypatch.setattr(pa.demo, "landscape", lambda *a, **k: whole(*a, **k, grown=False))
    scene, camera = pa.demo.landscape(style="winter", trees=1, cloud=False)
    out = tmp_path / "w.png"
    assert run("winter", "--out", out) == 0
    assert (
        pa.tone.to_uint8(pa.io.read(out)) == pa.tone.to_uint8(scene.paint(camera.resized(64, 36)), dither=True)
    ).all()
    assert run("dusk", "--sky", "coral", "--out", tmp_path / "c.png") == 0
    when = ("--when", "2024-08-05T17:30Z", "--place", 45, 6)
    assert run("corot", *when, "--out", tmp_path / "t.jpg") == 0
    pictures = [pa.io.read(tmp_path / name) for name in ("w.png", "c.png", "t.jpg")]
    assert all(p.shape == (36, 64, 3) for p in pictures)
    assert abs(pictures[0] - pictures[1]).mean() > 0.02
    for arguments, words in (
        (("rembrandt", "--out", out), "rembrandt"),
        (("corot", "--out", tmp_path / "a.exr"), "--out"),
        (("corot", "--sky", "coral", *when), "--sky"),
        (("corot", "--when", "2024-08-05T17:30Z"), "together"),
        (("corot", "--altitude", 100), "--place"),
    ):
        assert run(*arguments) == 2, arguments
        assert words in capsys.readouterr().err


def test_a_strip_of_a_day():
    place = pa.Place(45, 6)
    hours = [datetime(2024, 8, 4, hour, tzinfo=UTC) for hour in (12, 18, 21, 23)]
    strip = pa.demo.day_strip(place, hours, width=56, height=12)
    assert strip.shape == (12, 56, 3)
    assert strip[:, -8:].max() < strip[:, :8].min()
    # An instant's column is its own picture's.
    first = pa.sky.Natural(hours[0], place, turbidity=2)
    light = first.render(pa.Camera(1, 12, 60, 180, 30), tolerance=1e-2)
    shown = pa.tone.to_uint8(pa.tone.present(light, first.adaptation(), glare=False, white=0.0))
    assert np.abs(pa.tone.to_uint8(strip[:, :1]).astype(int) - shown).max() <= 2
    for bad in (hours[:1], hours[::-1], [hours[0]] * 2):
        with pytest.raises(ValueError, match="instants"):
            pa.demo.day_strip(place, bad)
    with pytest.raises(ValueError, match="time zone"):
        pa.demo.day_strip(place, [datetime(2024, 8, 4), datetime(2024, 8, 5)])


def pictures(folder):
    """Photographs that cannot be fitted, and words of the message."""
    import numpy as np

    rng = np.random.default_rng(0)
    (folder / "text.jpg").write_text("this is not a picture")
    (folder / "empty.png").write_bytes(b"")
    pa.io.write(folder / "tiny.png", np.full((4, 4, 3), 0.5))
    grey = np.repeat(rng.uniform(0.2, 0.8, (64, 64, 1)), 3, axis=2)
    pa.io.write(folder / "grey.png", grey)
    rows = np.linspace(0, 1, 96)[:, None, None]
    clear = (1 - rows) * (0.08, 0.2, 0.6) + rows * (0.2, 0.4, 0.8) + rng.normal(0, 0.002, (96, 128, 3))
    pa.io.write(folder / "clear.png", clear)
    overcast = 0.45 + 0.03 * rng.standard_normal((96, 128, 1)).cumsum(axis=1) / 11 * np.ones(3) + (0, 0.002, 0.012)
    pa.io.write(folder / "overcast.png", overcast)
    return {
        "missing.jpg": "there is no file",
        "text.jpg": "not a picture",
        "empty.png": "not a picture",
        "tiny.png": "16 x 16",
        "grey.png": "grey",
        "clear.png": "no clouds",
        "overcast.png": "overcast",
    }


def test_a_photograph_that_cannot_be_fitted_gets_a_clear_message(tmp_path, capsys):
    from pleinair.__main__ import main

    for name, words in pictures(tmp_path).items():
        assert main(["fit", str(tmp_path / name), "--out", str(tmp_path / "out"), "--quiet"]) == (
            4 if name in ("missing.jpg", "text.jpg", "empty.png") else 3
        ), name
        message = capsys.readouterr().err
        assert message.startswith("pleinair: "), message
        assert words in message, f"{name}: {message}"
        assert message.count("\n") == 1, "one line"
    assert not (tmp_path / "out").exists(), "nothing is half-written"

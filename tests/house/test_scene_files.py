"""Scenes in files: every object comes back bit for bit, and what is wrong is said with its place in the file."""

import json
import pickle
import subprocess
import sys
from datetime import UTC, datetime

import jsonschema
import numpy as np
import pleinair as pa
import pytest
from pleinair.plants import Strata, Surface, Tree, preset
from pleinair.scene import Ground, Placed, TimeLapse

WHEN = datetime(2024, 8, 5, 12, tzinfo=UTC)
PLACE = pa.Place(45, 6, 500)
SUN = pa.Sun(30, 200)
SKIES = {
    "coral": pa.sky.preset("coral"),
    "heart": pa.sky.preset("heart") if "heart" in pa.sky.presets() else pa.sky.preset("smiley"),
    "natural": pa.sky.Natural(WHEN, PLACE, turbidity=3.25, stars=None),
    "given": pa.sky.Natural(sun=SUN, moon=pa.astro.moon(WHEN, PLACE), day=12),
    "physical": pa.sky.Physical(SUN, turbidity=2.5),
    "overcast": pa.sky.Natural(sun=SUN, overcast=pa.sky.CloudSlab(12.5), light_pollution=1e-3),
    "preetham": pa.sky.Preetham(SUN, 3.0),
    "cie": pa.sky.CieGeneral(3, SUN),
}
RNG = np.random.default_rng(0)
HEIGHTS = RNG.normal(size=(12, 9))
SURFACES = {
    "heightfield": Surface.heightfield(HEIGHTS, (2.5, 1.5), (-3.0, 7.0, 0.75)),
    "mesh": Surface.mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]], [[0, 1, 2, 3]]),
    "nurbs": Surface.nurbs(RNG.normal(size=(5, 6, 3)), degree=(3, 2)),
}


@pytest.fixture(params=["toml", "json"])
def ending(request):
    return request.param


def validated(path):
    data = json.loads(path.read_text()) if path.suffix == ".json" else __import__("tomllib").loads(path.read_text())
    jsonschema.Draft202012Validator(pa.scene.schema()).validate(data)
    return data


@pytest.mark.parametrize("name", SKIES)
def test_every_sky_comes_back(name, ending, tmp_path):
    path = pa.scene.save(tmp_path / f"a.{ending}", sky=SKIES[name])
    assert pa.scene.load(path) == {"sky": SKIES[name]}
    validated(path)


@pytest.mark.parametrize("name", SURFACES)
def test_grounds_come_back(name, ending, tmp_path):
    ground = Ground(SURFACES[name], ("grass", "straw"), Strata((5, 4), 2), 3, casts=True)
    scene = pa.Scene(SKIES["coral"], [ground])
    again = pa.Scene.load(scene.save(tmp_path / f"a.{ending}"))
    got, want = again.objects[0].surface, ground.surface
    assert np.array_equal(got.vertices, want.vertices)
    assert np.array_equal(got.faces, want.faces)
    assert np.array_equal(again.objects[0].particles.position, ground.particles.position)
    validated(tmp_path / f"a.{ending}")


def test_the_landscape_comes_back_and_paints_the_same_picture(ending, tmp_path):
    scene, camera = pa.demo.landscape(trees=2, rng=4)
    camera = camera.resized(96, 54)
    path = scene.save(tmp_path / f"scene.{ending}", camera=camera)
    assert path.stat().st_size < 60_000, "arrays lie beside it"
    found = pa.scene.load(path)
    assert found["camera"] == camera
    assert np.array_equal(found["scene"].paint(camera), scene.paint(camera))
    assert found["scene"].clouds == scene.clouds
    validated(path)
    # Twice is the same text.
    again = found["scene"].save(tmp_path / f"again.{ending}", camera=camera)
    assert again.read_text().replace("again", "scene") == path.read_text()


def test_styles_materials_lights_and_strokes_come_back(ending, tmp_path):
    style = pa.paint.style("dusk")
    own = pa.paint.Style(dict(style.materials), exposure=1.5)
    strokes = pa.paint.Strokes([[0, 5, 1], [1, 6, 2]], [0, -1, 0], [[0.5, 0.25]] * 2, material="leaves", lit=0.5)
    scene = pa.Scene(
        SKIES["coral"],
        [Placed(Tree.grow(preset("shrub"), rng=1), (0, 12, 0), 30, name="bush"), strokes],
        own,
        lights=pa.paint.Light((0, 0, 1), 2.0),
        materials={"bush0/leaves": style.material("grass")},
        visibility=5e3,
        trunk_circles=(10, 20),
    )
    again = pa.Scene.load(scene.save(tmp_path / f"a.{ending}"))
    assert again.style == own
    assert again.lights == scene.lights
    assert again.materials == scene.materials
    assert (again.visibility, again.trunk_circles, again.circles) == (5e3, (10.0, 20.0), (40.0, 400.0))
    assert again.objects[0] == scene.objects[0]
    assert all(
        np.array_equal(getattr(again.objects[1], n), getattr(strokes, n)) for n in ("position", "normal", "size", "lit")
    )
    assert pa.Scene.load(pa.Scene(SKIES["coral"], style="dusk").save(tmp_path / f"b.{ending}")).style == style
    assert '"dusk"' in (tmp_path / f"b.{ending}").read_text()


def test_timelines_of_keys_come_back(ending, tmp_path):
    day = TimeLapse(SKIES["natural"], WHEN, datetime(2024, 8, 5, 21, 30, tzinfo=UTC))
    shot = pa.Timeline(
        {0: pa.Camera(32, 24), 0.5: pa.Camera(32, 24, azimuth=20), 1: pa.Camera(32, 24, fov=30)},
        sky=day,
        circles={0: (10, 50), 0.5: (40, 200)},
    )
    again = pa.scene.load(pa.scene.save(tmp_path / f"a.{ending}", timeline=shot))["timeline"]
    for t in (0, 0.2, 0.7, 1):
        assert again.at(t) == shot.at(t)
    assert pickle.loads(pickle.dumps(again)).at(0.2) == shot.at(0.2), "for workers of a grid"
    validated(tmp_path / f"a.{ending}")
    still = pa.Timeline(pa.Camera(32, 24))
    assert pa.scene.load(pa.scene.save(tmp_path / f"b.{ending}", timeline=still))["timeline"].at(0.3) == still.at(0.3)


def test_what_is_code_has_no_place(tmp_path):
    with pytest.raises(TypeError, match=r"timeline\.sky cannot be written: a file has no place for a function"):
        pa.scene.save(tmp_path / "a.json", timeline=pa.Timeline(pa.Camera(8, 8), sky=lambda t: SKIES["coral"]))
    with pytest.raises(TypeError, match="principles"):
        pa.scene.save(tmp_path / "a.json", sky=pa.sky.Aoas(sun=SUN, principles=[pa.sky.Principle()]))
    assert not list(tmp_path.iterdir())


def test_by_hand(tmp_path):
    pa.clouds.procedural("cumulus", (8, 8, 8), rng=1).save(tmp_path / "cloud.npz")
    (tmp_path / "light.toml").write_text(
        '[scene.sky]\ntype = "natural"\nturbidity = 2.5\nsun = {elevation = 20, azimuth = 100}\n'
    )
    (tmp_path / "a.toml").write_text(
        """
        format = 1
        include = "light.toml"
        [camera]
        width = 64
        height = 36
        [scene]
        style = "corot"
        clouds = {file = "cloud.npz"}
        sky = {turbidity = 3}
        [[scene.objects]]
        type = "placed"
        position = [0, 12, 0]
        tree = {preset = "shrub", rng = 1}
        [[scene.objects]]
        type = "ground"
        material = "grass"
        surface = {kind = "heightfield", z = [[0, 0], [0, 1]], spacing = 20}
        strata = {shape = [4, 4]}
        """.replace("strata = {shape = [4, 4]}", "rng = 2")
    )
    found = pa.scene.load(tmp_path / "a.toml")
    scene = found["scene"]
    assert scene.sky == pa.sky.Natural(sun=pa.Sun(20, 100), turbidity=3)
    assert scene.clouds == pa.clouds.load(tmp_path / "cloud.npz")
    assert scene.objects[0].tree == Tree.grow(preset("shrub"), rng=1)
    assert scene.objects[1].surface.vertices[:, 2].tolist() == [0, 0, 0, 1]
    validated_data = __import__("tomllib").loads((tmp_path / "a.toml").read_text())
    validated_data["scene"]["sky"]["type"] = "natural"
    jsonschema.Draft202012Validator(pa.scene.schema()).validate(validated_data)


GOOD = 'format = 1\n[scene.sky]\ntype = "natural"\nsun = {elevation = 20}\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[scene]", "must say its format"),
        ("format = 9", "format 9: this pleinair reads up to 1"),
        ("format = 1\nscenes = 3", "has no 'scenes': did you mean 'scene'?"),
        (GOOD + "turbitity = 3", "scene.sky has no 'turbitity': did you mean 'turbidity'?"),
        (GOOD + "turbidity = 300", r"scene.sky.turbidity: turbidity must be in \[1, 12\]"),
        (GOOD + 'turbidity = "3"', "scene.sky.turbidity: turbidity must be"),
        (GOOD + "turbidity = nan", "scene.sky.turbidity: turbidity must be"),
        (GOOD.replace("20", "200"), r"scene.sky.sun.elevation: elevation must be in \[-90, 90\]"),
        (GOOD.replace("natural", "naturel"), "scene.sky.type has no 'naturel': did you mean 'natural'"),
        (GOOD.replace('type = "natural"', ""), "scene.sky must say its type: aoas"),
        ('format = 1\n[scene]\nstyle = "corot"', "scene must have sky"),
        (GOOD + '[scene]\nstyle = "corott"', "scene.style: style must be one of 'corot'"),
        ('format = 1\nstyle = "corott"', "corot"),
        ("format = 1\ncamera = 3", "camera must be a table, got 3"),
        ("format = 1\n[camera]\nwidth = 64", "camera must have height"),
        ('format = 1\n[volume]\nfile = "../x.npz"', "must stay in the file's folder"),
        ('format = 1\n[volume]\nfile = "x.npz"\nprocedural = "cumulus"', "cannot stand beside file"),
        ('format = 1\ninclude = "a.toml"', "includes itself"),
        ('format = 1\ninclude = "../other.toml"', "must stay in the file's folder"),
        (
            'format = 1\n[timeline]\ncamera = {type = "sun", elevation = 3}',
            "timeline.camera must be of type camera or keys",
        ),
        (
            'format = 1\n[sky]\ntype = "natural"\nwhen = "noon"\nplace = {latitude = 4, longitude = 5}',
            "sky.when must be a time",
        ),
        ("format = 1\n[volume]\ndensity = {file = 'a.npz', array = 'b'}", "there is no file"),
        ("format = ", "is no TOML"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(text, words, tmp_path):
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises((ValueError, FileNotFoundError), match=words):
        pa.scene.load(tmp_path / "a.toml")


def test_files_outside_need_leave(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    pa.clouds.procedural("cumulus", (8, 8, 8), rng=1).save(tmp_path / "cloud.npz")
    (inner / "a.toml").write_text('format = 1\n[volume]\nfile = "../cloud.npz"')
    assert pa.scene.load(inner / "a.toml", outside=True)["volume"].density.shape == (8, 8, 8)


def test_a_huge_file_is_refused_unread(tmp_path):
    with (tmp_path / "a.toml").open("wb") as stream:
        stream.truncate(100_000_000)
    with pytest.raises(ValueError, match="100000000 bytes"):
        pa.scene.load(tmp_path / "a.toml")


def test_deep_nesting_and_damage_are_refused(tmp_path):
    (tmp_path / "a.json").write_text("[" * 100_000)
    with pytest.raises(ValueError, match="is no JSON"):
        pa.scene.load(tmp_path / "a.json")
    (tmp_path / "b.json").write_text("[1]")
    with pytest.raises(ValueError, match="must hold a table"):
        pa.scene.load(tmp_path / "b.json")
    with pytest.raises(ValueError, match=r"\.toml or \.json"):
        pa.scene.save(tmp_path / "a.yaml", camera=pa.Camera(8, 8))
    with pytest.raises(FileNotFoundError):
        pa.scene.load(tmp_path / "none.toml")
    path = pa.scene.save(tmp_path / "c.json", camera=pa.Camera(8, 8))
    with pytest.raises(ValueError, match="holds no scene but camera"):
        pa.Scene.load(path)


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(pa.scene.schema())
    wrong = {"format": 1, "camera": {"width": 64, "height": 36, "fov": "wide"}}
    with pytest.raises(jsonschema.ValidationError, match="wide"):
        jsonschema.Draft202012Validator(pa.scene.schema()).validate(wrong)


def test_a_scene_from_the_command_line(tmp_path):
    scene = pa.Scene(SKIES["coral"], [Placed(Tree.grow(preset("shrub"), rng=1), (0, 12, 0))], grown=False)
    path = scene.save(tmp_path / "scene.toml", camera=pa.Camera(64, 36))
    command = [sys.executable, "-m", "pleinair", "paint", str(path), "--out", "a.png", "--size", "32", "18"]
    subprocess.run(command, cwd=tmp_path, check=True)
    want = pa.tone.to_uint8(scene.paint(pa.Camera(64, 36).resized(32, 18)))
    assert np.abs(pa.tone.to_uint8(pa.io.read(tmp_path / "a.png")).astype(int) - want).max() <= 1

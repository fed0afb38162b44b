"""The explorer without a browser: messages in, pictures and errors out."""

import ast
import base64
import dataclasses
import io
import json
import subprocess
import sys
import warnings
from datetime import datetime
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pleinair as pa
import pytest
from PIL import Image
from pleinair._explore.controls import Control, Study, day
from pleinair._explore.session import Session

SKY = pa.sky.Aoas(sun=pa.Sun(elevation=35, azimuth=200))
CAMERA = pa.Camera(96, 54, fov=60, azimuth=200, elevation=15)


@pytest.fixture
def session():
    return Session(Study(SKY, CAMERA, 2.0))


def draw(session, values=None, **rest):
    return session.handle({"kind": "draw", "id": 1, "view": "a", "values": values or {}, **rest})


def pixels(data):
    with Image.open(io.BytesIO(data)) as picture:
        return np.asarray(picture.convert("RGB"))


def shown(sky, camera=CAMERA, exposure=2.0):
    return pa.tone.to_uint8(pa.tone.oneil(sky.render(camera), exposure=exposure), dither=True)


def test_every_control_sets_its_field_and_nothing_else(session):
    start = Study(SKY, CAMERA, 2.0)
    paths = [c.path for c in session.controls]
    for wanted in ("sun.elevation", "sun.azimuth", "rayleigh.0", "rayleigh.1", "rayleigh.2", "mie", "g", "sun_intensity",
                   "radius_ratio", "scale_height", "ambiguity", "cloud_complexity", "rng"):  # fmt: skip
        assert f"sky.{wanted}" in paths
    assert {"camera.azimuth", "camera.elevation", "camera.fov", "exposure"} <= set(paths)
    for control in session.controls:
        assert control.low < control.high
        assert 0 < control.step < control.high - control.low
        before = control.read(start)
        low, high = (control.low, control.high) if control.path != "sky.rng" else (3, 9)
        value = low + 0.25 * (high - low) if not isinstance(before, int) else 5
        after = session.asked({"values": {control.path: value}})
        assert control.read(after) == value, control.path
        changed = {c.path for c in session.controls if c.read(after) != c.read(start)}
        assert changed == {control.path}
    assert start == session.start, "the start is never changed"


LENSES = {
    "fisheye": pa.Camera.fisheye(64),
    "equal_area": pa.Camera(64, 40, fov=120, elevation=30, projection="equal_area"),
    "panorama": pa.Camera.panorama(125),
}


@pytest.mark.parametrize("name", LENSES)
def test_every_lens_can_be_explored(name):
    camera = LENSES[name]
    session = Session(Study(SKY, camera, 2.0))
    header, data = draw(session)
    assert (pixels(data) == shown(SKY, camera)).all()
    assert draw(session, coarse=True)[0]["kind"] == "picture"
    views = {c.path for c in session.controls if c.path.startswith("camera.")}
    assert views == (set() if name == "panorama" else {"camera.azimuth", "camera.elevation", "camera.fov"})
    for path in views:
        assert draw(session, {path: 70.0})[0]["kind"] == "picture"
    for x, y in ((0, 0), (camera.width // 2, camera.height // 2)):
        header, _ = session.handle({"kind": "probe", "x": x, "y": y})
        assert header["kind"] == "text"
        assert ("outside" in header["text"]) == (name != "panorama" and x == 0)
    header, _ = session.handle({"kind": "python"})
    scope = {}
    exec(compile(header["text"], "snippet", "exec"), scope)  # noqa: S102 - the snippet is what is tested
    assert scope["camera"] == camera


def test_the_ends_of_the_sliders_can_be_rendered(session):
    for control in session.controls:
        for value in (control.low, control.high):
            value = int(value) if control.path == "sky.rng" else value
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", pa.DomainWarning)
                header, _ = draw(session, {control.path: value}, coarse=True)
            assert header["kind"] == "picture", (control.path, value, header)


def test_untouched_values_keep_every_bit(session):
    header, data = draw(session, session.spec()["bases"][""])
    assert session.study.sky == SKY
    assert header["kind"] == "picture"
    assert (pixels(data) == shown(SKY)).all()


def test_an_exact_picture_is_the_skys_own_and_a_coarse_one_is_smaller(session):
    values = {"sky.sun.elevation": 12.5, "sky.rayleigh.1": 0.03, "camera.fov": 80, "exposure": 1.5}
    want_sky = dataclasses.replace(SKY, sun=pa.Sun(12.5, 200), rayleigh=(SKY.rayleigh[0], 0.03, SKY.rayleigh[2]))
    want_camera = dataclasses.replace(CAMERA, fov=80)
    header, data = draw(session, values)
    assert header | {"ms": 0} == {
        "kind": "picture", "id": 1, "view": "a", "of": "draw", "mime": "image/png", "coarse": False, "exposure": 1.5,
        "width": 96, "height": 54, "ms": 0,
    }  # fmt: skip
    assert (pixels(data) == shown(want_sky, want_camera, 1.5)).all()
    assert (session.study.sky, session.study.camera, session.study.exposure) == (want_sky, want_camera, 1.5)
    json.dumps(header)

    header, data = draw(session, values, coarse=True)
    assert (header["width"], header["height"], header["mime"], header["coarse"]) == (48, 27, "image/jpeg", True)
    coarse = shown(want_sky, want_camera.resized(48, 27), 1.5).astype(float)
    assert np.abs(pixels(data) - coarse).mean() < 6


def test_a_slow_sky_gets_coarser_pictures(session):
    sizes = []
    for pace in (1e-9, 3e-5, 1e-3):
        session.pace = pace
        sizes.append(draw(session, coarse=True)[0]["width"])
    assert sizes == [48, 32, 12]


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"values": {"sky.sun.elevation": 95}}, "elevation must be in [-90, 90] [°], got 95"),
        ({"values": {"sky.mie": "a lot"}}, "mie"),
        ({"values": {"sky.mie": None}}, "mie"),
        ({"values": {"sky.g": float("nan")}}, "g must be"),
        ({"values": {"sky.rng": 2.5}}, "rng"),
        ({"values": {"sky.colour": 1.0}}, "no control 'sky.colour'"),
        ({"values": {"sky.__class__": 1.0}}, "no control"),
        ({"values": {"camera.fov": 200}}, "fov"),
        ({"values": {"exposure": 0}}, "exposure"),
        ({"base": "nowhere"}, "no preset 'nowhere'"),
        ({"values": 3}, "AttributeError"),
        ({"kind": "dance"}, "no message 'dance'"),
        ({"kind": "probe"}, "KeyError"),
    ],
)
def test_bad_values_are_answered_and_the_session_lives_on(session, message, words):
    header, data = session.handle({"kind": "draw", "id": 7, "view": "b"} | message)
    assert (header["kind"], header["id"], header["view"], data) == ("error", 7, "b", b"")
    assert words in header["text"], header["text"]
    assert session.study == session.start
    assert draw(session)[0]["kind"] == "picture"


def test_an_interrupt_is_an_answer_too(session, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(session, "picture", stop)
    assert draw(session)[0]["text"] == "interrupted"


def test_warnings_are_shown(session, monkeypatch):
    picture = session.picture

    def doubtful(*arguments):
        warnings.warn("outside the range of the paper", pa.DomainWarning, stacklevel=1)
        return picture(*arguments)

    monkeypatch.setattr(session, "picture", doubtful)
    assert draw(session)[0]["note"] == "outside the range of the paper"


def test_whole_numbers_from_javascript_stay_seeds(session):
    draw(session, {"sky.rng": 12.0})
    assert session.study.sky.rng == 12
    assert isinstance(session.study.sky.rng, int)


def test_presets(session):
    bases = session.spec()["bases"]
    names = [name for name in pa.sky.presets() if isinstance(pa.sky.preset(name), pa.sky.Aoas)]
    assert names
    assert list(bases) == ["", *names]
    for name in names:
        header, data = draw(session, base=name)
        assert header["kind"] == "picture"
        assert session.study.sky == pa.sky.preset(name)
        assert (pixels(data) == shown(pa.sky.preset(name))).all()
        draw(session, bases[name], base=name)
        assert session.study.sky == pa.sky.preset(name), "its values on it change nothing"
    # A preset may hold what no slider shows: values are put into it, not into the sky one began with.
    draw(session, {"sky.mie": 0.002}, base=names[-1])
    assert session.study.sky == dataclasses.replace(pa.sky.preset(names[-1]), mie=0.002)


def test_an_answer_depends_on_its_request_alone(session):
    values = [{"sky.sun.elevation": 40.0}, {"sky.sun.elevation": 3.0, "sky.mie": 0.004}, {"camera.fov": 90}]
    forward = [draw(session, v)[1] for v in values]
    late = [draw(session, v)[1] for v in reversed(values)]
    assert forward == late[::-1]
    ids = [session.handle({"kind": "draw", "id": i, "view": "x", "values": {}})[0]["id"] for i in (9, 4, 5)]
    assert ids == [9, 4, 5], "numbers are echoed; the page drops the late ones"


def run(snippet):
    space = {}
    exec(compile(snippet, "snippet", "exec"), space)  # noqa: S102 - the snippet is what is tested
    return space


@pytest.mark.parametrize("base", ["", *pa.sky.presets()])
@pytest.mark.parametrize(
    "values",
    [
        {},
        {
            "sky.sun.elevation": 1 / 3,
            "sky.rayleigh.2": 0.1 / 3,
            "sky.g": -0.123456789,
            "sky.rng": 42,
            "camera.fov": 33.3,
        },
        {"sky.ambiguity": 0.05, "sky.cloud_complexity": 4.0, "exposure": None},
    ],
    ids=["as given", "changed", "automatic"],
)
def test_the_snippet_makes_the_same_picture(session, base, values):
    message = {"base": base, "values": values, "id": 1, "view": "a"}
    header, data = session.handle({"kind": "draw", **message})
    assert header["kind"] == "picture", header
    space = run(session.handle({"kind": "python", **message})[0]["text"])
    assert space["sky"] == session.study.sky
    assert space["camera"] == session.study.camera
    assert (space["picture"] == pixels(data)).all()
    again = pa.sky.from_json(session.handle({"kind": "json", **message})[0]["text"])
    assert again == session.study.sky


def test_a_sky_that_is_not_ours_leaves_as_json_or_says_why(session):
    @dataclasses.dataclass(frozen=True)
    class Flat:
        level: float = 0.2
        turbidity: float = 3.0

        def render(self, camera):
            return np.full((camera.height, camera.width, 3), self.level, np.float32)

    flat = Session(Study(Flat(), CAMERA, None))
    assert [c.path for c in flat.controls if c.path.startswith("sky.")] == ["sky.turbidity"]
    assert list(flat.spec()["bases"]) == [""]
    header, data = draw(flat, {"sky.turbidity": 4})
    assert header["exposure"] == pytest.approx(np.log(2) / 0.2)
    assert (pixels(data) == shown(Flat(), exposure=np.log(2) / np.float32(0.2))).all()
    assert "no to_json" in flat.handle({"kind": "python"})[0]["text"]
    assert "azimuth 200." in flat.handle({"kind": "probe", "x": 48, "y": 27})[0]["text"]


NATURALS = [
    pa.sky.Natural(datetime(2024, 8, 5, 22, 30, tzinfo=ZoneInfo("Europe/Paris")), pa.Place(45, 6)),
    pa.sky.Natural(sun=pa.Sun(-3, 280), moon=pa.astro.Moon(20, 100, phase_angle=30), stars=None),
    pa.sky.Physical(pa.Sun(20, 200)),
]


@pytest.mark.parametrize("sky", NATURALS, ids=["place", "night", "physical"])
def test_skies_in_candela(sky):
    explorer = pa.explore(sky, size=(32, 18))
    session = explorer.session
    paths = {c.path for c in session.controls}
    assert {"sky.turbidity", "sky.ozone", "sky.ground_albedo"} <= paths
    natural = isinstance(sky, pa.sky.Natural)
    assert ("sky.airglow" in paths) == natural
    assert ("sky.when.hours" in paths) == (natural and sky.when is not None)
    assert ("sky.sun.elevation" in paths) == (sky.sun is not None)
    assert ("sky.moon.phase_angle" in paths) == (natural and sky.moon is not None)
    assert ("sky.stars" in paths) == (natural and sky.stars is not None)
    for control in session.controls:
        now = control.read(session.start)
        assert control.path == "exposure" or control.read(session.asked({"values": {control.path: now}})) == now
        value = control.low + 0.25 * (control.high - control.low)
        assert control.read(session.asked({"values": {control.path: value}})) == pytest.approx(value), control.path
    changes = {"sky.turbidity": 3.5, "sky.when.hours": 20.2}
    header, data = draw(session, {path: value for path, value in changes.items() if path in paths})
    assert header["kind"] == "picture", header
    space = run(explorer.python)
    assert space["sky"] == explorer.sky != sky
    assert (space["picture"] == pixels(data)).all()
    assert session.handle({"kind": "probe", "x": 3, "y": 3})[0]["kind"] == "text"


def test_a_time_of_day_stays_on_its_day_and_in_its_zone():
    session = Session(Study(NATURALS[0], CAMERA, 1.0))
    assert {c.path: c.read(session.start) for c in session.controls}["sky.when.hours"] == 22.5
    moved = session.asked({"values": {"sky.when.hours": 6.25}}).sky.when
    assert moved.isoformat() == "2024-08-05T06:15:00+02:00"


def test_a_black_sky_has_an_automatic_exposure(session):
    header, _ = draw(session, {"sky.sun_intensity": 0.0, "exposure": None})
    assert header["kind"] == "picture"
    assert header["exposure"] > 0


def test_the_probe(session):
    header, data = session.handle({"kind": "probe", "id": 3, "view": "a", "x": 47.9, "y": 27.2, "values": {}})
    assert (header["kind"], header["of"], header["id"], data) == ("text", "probe", 3, b"")
    direction = CAMERA.directions()[27, 47]
    azimuth = np.degrees(np.arctan2(direction[0], direction[1])) % 360
    assert f"azimuth {azimuth:.1f}°" in header["text"]
    assert "\n" not in header["text"]
    for x, y in ((-5, 1e9), (1e9, -1)):
        assert session.handle({"kind": "probe", "x": x, "y": y})[0]["kind"] == "text"


def test_the_day_rises_in_the_east():
    rows = day()
    hours, elevations, azimuths = np.array(rows).T
    assert (hours == np.arange(0, 24.01, 0.25)).all()
    assert elevations[hours == 12] == 45
    assert azimuths[hours == 12] == 180
    assert abs(elevations[hours == 6]) < 0.01
    assert azimuths[hours == 6] == 90
    assert (np.diff(azimuths) > 0).all()


def test_the_face_is_checked():
    with pytest.raises(TypeError, match="sky must be a sky"):
        pa.explore("blue")
    with pytest.raises(TypeError, match="camera must be a Camera"):
        pa.explore(SKY, camera=3)
    with pytest.raises(ValueError, match="size must be in"):
        pa.explore(SKY, size=(0, 10))
    with pytest.raises(TypeError, match=r"size must be \(width, height\)"):
        pa.explore(SKY, size=10)
    with pytest.raises(ValueError, match="exposure must be a number or 'auto'"):
        pa.explore(SKY, exposure="bright")
    with pytest.raises(ValueError, match="exposure"):
        pa.explore(SKY, exposure=-1)
    assert pa.explore(SKY, size=(32, 18)).camera == pa.Camera(32, 18, azimuth=200, elevation=15)
    assert pa.explore(SKY, camera=CAMERA).camera == CAMERA
    assert pa.explore(SKY, size=(32, 18)).exposure == 2
    assert pa.explore(SKY, size=(32, 18), exposure="auto").exposure is None


def test_where_there_is_no_kernel_there_is_a_picture():
    explorer = pa.explore(SKY, camera=CAMERA)
    data, metadata = explorer._repr_mimebundle_(include=None, exclude=None)
    assert metadata["image/png"]["alt"].startswith("Aoas sky")
    assert (pixels(base64.b64decode(data["image/png"])) == shown(SKY)).all()
    assert "application/vnd.jupyter.widget-view+json" in data
    assert data["text/plain"] == "Explorer(Aoas, 96 × 54)"
    json.dumps(data)
    explorer.session.handle({"kind": "draw", "values": {"sky.sun.elevation": 5}})
    assert (pixels(explorer._repr_png_()) == shown(dataclasses.replace(SKY, sun=pa.Sun(5, 200)))).all()
    assert run(explorer.python)["sky"] == explorer.sky


def test_without_anywidget_there_is_a_warning_and_a_picture(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "pleinair._explore.widget", raising=False)
    with pytest.warns(UserWarning, match=r"pip install 'pleinair\[explore\]'"):
        explorer = pa.explore(SKY, camera=CAMERA)
    data, _ = explorer._repr_mimebundle_()
    assert set(data) == {"text/plain", "image/png"}
    assert "a picture only" in repr(explorer)


def test_without_pillow_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(ImportError, match=r"pip install 'pleinair\[explore\]'"):
        pa.explore(SKY, camera=CAMERA)


def test_anywidget_carries_the_messages(monkeypatch):
    explorer = pa.explore(SKY, camera=CAMERA)
    widget = explorer.widget
    page = Path(pa.__file__).parent / "_explore" / "static" / "explore.js"
    assert str(widget._esm) == page.read_text()
    assert "canvas" in str(widget._css)
    assert widget.spec["size"] == [96, 54]
    assert widget.poster.startswith(b"\xff\xd8")
    json.dumps(widget.spec)
    sent = []
    monkeypatch.setattr(widget, "_send", lambda message, buffers=None: sent.append((message, buffers)))
    # What a comm delivers from the page, through ipywidgets' own dispatch.
    content = {"kind": "draw", "id": 1, "view": "v", "values": {"sky.mie": 0.003}, "coarse": False}
    widget._handle_msg({"content": {"data": {"method": "custom", "content": content}}, "buffers": []})
    widget._handle_msg({"content": {"data": {"method": "custom", "content": content | {"base": "?"}}}, "buffers": []})
    (good, buffers), (bad, none) = sent
    assert good["method"] == bad["method"] == "custom"
    assert good["content"]["kind"] == "picture"
    assert (pixels(bytes(buffers[0])) == shown(dataclasses.replace(SKY, mie=0.003))).all()
    assert explorer.sky.mie == 0.003
    assert bad["content"]["kind"] == "error"
    assert not none


def test_the_page_needs_nothing_from_elsewhere():
    static = Path(pa.__file__).parent / "_explore" / "static"
    found = {path.name: path.read_text() for path in static.iterdir()}
    assert set(found) == {"explore.js", "explore.css"}
    for name, text in found.items():
        for word in ("http:", "https:", "//cdn", "import ", "@import", "url("):
            assert word not in text, f"{name} must not hold {word}"
    assert len(found["explore.js"].splitlines()) < 300


def test_the_module_is_numpy_only_until_it_is_used():
    code = "import sys, pleinair as pa; pa.explore; print({'anywidget', 'PIL', 'traitlets'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ast.literal_eval(done.stdout.replace("set()", "[]")) == []


def test_a_control_reads_numbers_only():
    control = Control("sky.rng", "seed", 0, 9, 1, "", "Pattern")
    for rng in (None, True, "x", np.random.default_rng(0)):
        assert control.read(Study(dataclasses.make_dataclass("Other", ["rng"])(rng), CAMERA, 1.0)) is None

"""The explorer: a sky, a camera and an exposure under sliders. Public as `pleinair.explore`.

`Session` answers messages and knows no notebook; `widget` carries its messages through anywidget; the page is
`static/explore.js`. A request holds all its values, so an answer depends on nothing but the request.
"""

from __future__ import annotations

import base64
import dataclasses
import io
import math
import time
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pleinair.sky as skies

from .._support.inputs import instance, integer, real
from ..astro import Moon, Place, Sun
from ..camera import Camera
from ..sky import preset, presets
from ..tone import oneil, present, to_uint8
from .controls import CONTROLS, DAY, TINTS, Control, Study, applied, day

Answer = tuple[dict[str, Any], bytes]
INSTALL = "pip install 'pleinair[explore]'"
# A coarse picture should cost no more than this [s], or dragging stutters.
COARSE_SECONDS = 0.02


def code(value: Any) -> str:
    """Return Python that makes `value` again; fields that are at their defaults are left out."""
    if isinstance(value, datetime):
        return f"datetime.fromisoformat({value.isoformat()!r})"
    if isinstance(value, (Sun, Camera, Place)):
        name = f"pa.{type(value).__name__}"
    elif isinstance(value, Moon):
        name = "pa.astro.Moon"
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        name = f"pa.sky.{type(value).__name__}"
        if getattr(skies, type(value).__name__, None) is not type(value):
            msg = f"{type(value).__name__} is not in pleinair.sky"
            raise ValueError(msg)
    elif isinstance(value, (list, tuple)):
        inner = ", ".join(map(code, value))
        if isinstance(value, list):
            return f"[{inner}]"
        return f"({inner},)" if len(value) == 1 else f"({inner})"
    elif isinstance(value, np.ndarray):
        return code(value.tolist())
    elif isinstance(value, (np.integer, np.floating)):
        return code(value.item())
    elif value is None or isinstance(value, (bool, int, str)) or (isinstance(value, float) and math.isfinite(value)):
        return repr(value)
    else:
        msg = f"a {type(value).__name__} cannot be written as Python"
        raise ValueError(msg)
    parts = []
    for entry in dataclasses.fields(value):
        mine = getattr(value, entry.name)
        default = entry.default_factory() if callable(entry.default_factory) else entry.default
        if entry.init and not same(mine, default):
            parts.append(f"{entry.name}={code(mine)}")
    return f"{name}({', '.join(parts)})"


def same(a: Any, b: Any) -> bool:
    """Whether two values are equal, also where they hold arrays."""
    try:
        return type(a) is type(b) and bool(a == b)
    except ValueError:
        return False


def json_of(sky: Any) -> str:
    """Return the sky's JSON, or say that it has none."""
    if not hasattr(sky, "to_json"):
        msg = f"{type(sky).__name__} has no to_json"
        raise TypeError(msg)
    return str(sky.to_json())


def encoded(levels: NDArray[np.uint8], mime: str) -> bytes:
    """Return the file of a picture."""
    try:
        from PIL import Image
    except ImportError:
        msg = f"the explorer's pictures need Pillow: {INSTALL}"
        raise ImportError(msg) from None
    stream = io.BytesIO()
    # Level 1 is four times as fast as the default and a tenth larger: the picture crosses the wire once.
    options = {"compress_level": 1} if mime == "image/png" else {"quality": 85}
    Image.fromarray(levels).save(stream, mime.removeprefix("image/"), **options)
    return stream.getvalue()


def described(found: Any) -> list[str]:
    """Lines of a probe: a dataclass, a mapping, a named tuple or anything that prints."""
    if dataclasses.is_dataclass(found) and not isinstance(found, type):
        items: Iterable[tuple[str, Any]] = [(f.name, getattr(found, f.name)) for f in dataclasses.fields(found)]
    elif isinstance(found, Mapping):
        items = found.items()
    elif hasattr(found, "_asdict"):
        items = found._asdict().items()
    else:
        return [str(found)]

    def text(value: Any) -> str:
        if np.ndim(value):
            return ", ".join(text(x) for x in np.asarray(value).ravel())
        return f"{value:.4g}" if isinstance(value, (float, np.floating)) else str(value)

    def defined(value: Any) -> bool:
        numbers = np.asarray(value)
        return value is not None and not (numbers.dtype.kind == "f" and bool(np.isnan(numbers).any()))

    # What is not defined here, like the magnitude of a relative sky, is NaN.
    known = [(name, value) for name, value in items if defined(value)]
    units = {"cct": " K", "magnitude": " mag/arcsec²"}
    return [f"{name.replace('_', ' ')} {text(value)}{units.get(name, '')}" for name, value in known]


@dataclass
class Session:
    """The explorer without a notebook: a message goes in, a header and the bytes of a picture come out.

    Parameters
    ----------
    start : Study
        What is shown first.

    Attributes
    ----------
    study : Study
        What the last answered request showed.
    """

    start: Study
    study: Study = field(init=False)
    # Seconds per pixel of the last pictures [s]: decides how coarse a coarse picture is.
    pace: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        self.study = self.start
        kind = type(self.start.sky)
        found = {name: preset(name) for name in presets()}
        self.bases = {"": self.start.sky} | {name: sky for name, sky in found.items() if type(sky) is kind}
        self.controls = [c for c in CONTROLS if c.read(self.start) is not None]
        still = self.start.exposure or self.picture(self.start, coarse=True)[1]
        self.controls.append(Control("exposure", "exposure", still / 64, still * 64, 0.05, "", "View", log=True))

    def spec(self) -> dict[str, Any]:
        """Return what the page needs to build itself: sizes, controls, presets and their values."""

        def values(sky: Any) -> dict[str, float | None]:
            study = replace(self.start, sky=sky)
            return {c.path: c.read(study) for c in self.controls if sky is self.start.sky or c.path.startswith("sky.")}

        paths = {c.path for c in self.controls}
        return {
            "size": [self.start.camera.width, self.start.camera.height],
            "title": type(self.start.sky).__name__,
            "controls": [dataclasses.asdict(c) for c in self.controls],
            "bases": {name: values(sky) for name, sky in self.bases.items()},
            "tints": [tint for tint in TINTS if paths.issuperset(tint["of"])],
            "day": {"of": DAY, "rows": day()} if paths.issuperset(DAY) else None,
            "json": hasattr(self.start.sky, "to_json"),
        }

    def asked(self, message: Mapping[str, Any]) -> Study:
        """Return the study a message asks for: a base (the sky itself or a preset) with the values put in.

        Raises
        ------
        ValueError, TypeError
            A base or a control is unknown, or the sky or the camera refuses a value.
        """
        base, values = message.get("base", ""), message.get("values", {})
        if base not in self.bases:
            msg = f"there is no preset {base!r}"
            raise ValueError(msg)
        study = replace(self.start, sky=self.bases[base])
        known = {c.path: c for c in self.controls}
        changes: dict[str, Any] = {}
        for path, value in values.items():
            if path not in known:
                msg = f"{type(study.sky).__name__} has no control {path!r}"
                raise ValueError(msg)
            now = known[path].read(study)
            if path == "exposure":
                changes[path] = None if value is None else real(value, path, 1e-9, 1e6, "1")
            elif value != now:
                # JavaScript has no integers; a seed must stay one.
                whole = isinstance(now, int) and isinstance(value, float) and value.is_integer()
                changes[path] = int(value) if whole else value
        out: Study = applied(study, changes)
        return out

    def picture(self, study: Study, coarse: bool = False) -> tuple[NDArray[np.uint8], float]:
        """Return a study's picture as it is shown (height, width, 3), and the exposure it was given [1]."""
        camera = study.camera
        if coarse:
            seconds = self.pace * camera.width * camera.height
            part = next((n for n in (2, 3, 4, 6) if seconds <= COARSE_SECONDS * n * n), 8)
            rows = max(camera.height // part, 1)
            # A panorama stays twice as wide as high.
            columns = 2 * rows if camera.projection == "panorama" else max(camera.width // part, 1)
            camera = camera.resized(columns, rows)
        began = time.perf_counter()
        rgb = study.sky.render(camera)
        exposure = study.exposure
        absolute = bool(getattr(study.sky, "absolute", False))
        if exposure is None and absolute:
            exposure = 1.0  # The eye is adapted to the sky already.
        if exposure is None:
            middle = float(np.median(rgb[..., 1]))
            exposure = min(max(math.log(2) / middle, 1e-9), 1e6) if 0 < middle < math.inf else 1.0
        if absolute:
            fov = 180.0 if camera.projection == "panorama" else camera.fov
            shown = present(rgb, study.sky.adaptation(), fov=fov, ev=math.log2(exposure))
        else:
            shown = oneil(rgb, exposure=exposure)
        levels = to_uint8(shown, dither=True)
        pace = (time.perf_counter() - began) / (camera.width * camera.height)
        self.pace = (self.pace + pace) / 2 if self.pace else pace
        return levels, exposure

    def python(self, study: Study) -> str:
        """Return Python that makes the picture of `study` again, bit for bit."""
        try:
            sky = code(study.sky)
        except ValueError:
            sky = f"pa.sky.from_json({json_of(study.sky)!r})"
        exposure = self.picture(study)[1] if study.exposure is None else study.exposure
        light = "sky.render(camera)"
        if getattr(study.sky, "absolute", False):
            fov = 180.0 if study.camera.projection == "panorama" else study.camera.fov
            shown = f"pa.tone.present({light}, sky.adaptation(), fov={fov!r}, ev={math.log2(exposure)!r})"
        else:
            shown = f"pa.tone.oneil({light}, exposure={exposure!r})"
        needs = "from datetime import datetime\n\n" if "datetime." in sky else ""
        return (
            f"{needs}import pleinair as pa\n\n"
            f"sky = {sky}\n"
            f"camera = {code(study.camera)}\n"
            f"picture = pa.tone.to_uint8({shown}, dither=True)\n"
        )

    def probe(self, study: Study, x: float, y: float) -> str:
        """Return what the sky says in the direction of pixel `(x, y)` [px], as one line."""
        camera = study.camera
        column, row = (min(max(int(v), 0), n - 1) for v, n in ((x, camera.width), (y, camera.height)))
        direction = camera.directions()[row, column]
        if not direction.any():
            return "outside the circle of the lens"
        azimuth = math.degrees(math.atan2(direction[0], direction[1])) % 360
        lines = [f"azimuth {azimuth:.1f}°", f"elevation {math.degrees(math.asin(direction[2])):.1f}°"]
        if hasattr(study.sky, "probe"):
            lines += described(study.sky.probe(direction))
        elif hasattr(study.sky, "radiance"):
            lines += described({"rgb": study.sky.radiance(direction)})
        return " · ".join(lines)

    def handle(self, message: Mapping[str, Any]) -> Answer:
        """Answer one message of the page; whatever goes wrong is an answer too.

        Parameters
        ----------
        message : mapping
            ``kind`` is ``"draw"``, ``"probe"``, ``"python"`` or ``"json"``; ``id`` and ``view`` come back in the
            header; ``base`` and ``values`` are the preset and the controls; ``coarse`` asks for a small JPEG,
            ``x`` and ``y`` are the probe_of pixel [px].

        Returns
        -------
        header : dict
            ``kind`` is ``"picture"``, ``"text"`` or ``"error"``.
        data : bytes
            The picture's file, or nothing.
        """
        header: dict[str, Any] = {"id": message.get("id"), "view": message.get("view"), "of": message.get("kind")}
        data = b""
        # The page waits for every answer: even an interrupt of the kernel has to be one.
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                study = self.asked(message)
                match message.get("kind"):
                    case "draw":
                        coarse = bool(message.get("coarse", False))
                        began = time.perf_counter()
                        levels, exposure = self.picture(study, coarse)
                        mime = "image/jpeg" if coarse else "image/png"
                        data = encoded(levels, mime)
                        self.study = study
                        header |= {
                            "kind": "picture", "mime": mime, "coarse": coarse, "exposure": exposure,
                            "width": levels.shape[1], "height": levels.shape[0],
                            "ms": round(1e3 * (time.perf_counter() - began), 1),
                        }  # fmt: skip
                    case "probe":
                        header |= {"kind": "text", "text": self.probe(study, message["x"], message["y"])}
                    case "python":
                        header |= {"kind": "text", "text": self.python(study)}
                    case "json":
                        header |= {"kind": "text", "text": json_of(study.sky)}
                    case kind:
                        msg = f"there is no message {kind!r}"
                        raise ValueError(msg)
            if caught:
                header["note"] = "; ".join(dict.fromkeys(str(w.message) for w in caught))
        except KeyboardInterrupt:
            header |= {"kind": "error", "text": "interrupted"}
        except Exception as error:  # noqa: BLE001 - a sky may fail in any way
            header |= {"kind": "error", "text": f"{type(error).__name__}: {error}"}
        return header, data


class Explorer:
    """What `pleinair.explore` returns: the sky under the sliders, and a picture of it where there are none.

    A notebook shows the widget. Where no kernel runs (GitHub, nbviewer, a page of HTML) or anywidget is missing, the
    same output is the picture of the last sky shown before it was saved.

    Parameters
    ----------
    session : Session
        Answers the page.
    widget : anywidget.AnyWidget or None
        The page; None shows the picture only.

    Examples
    --------
    >>> explorer = Explorer(Session(Study(skies.Aoas(sun=Sun(35, 200)), Camera(64, 36), 2.0)), None)
    >>> explorer
    Explorer(Aoas, 64 × 36; a picture only: pip install 'pleinair[explore]')
    >>> sorted(explorer._repr_mimebundle_()[0])
    ['image/png', 'text/plain']
    """

    def __init__(self, session: Session, widget: Any = None) -> None:
        self.session = session
        self.widget = widget

    @property
    def sky(self) -> Any:
        """The sky shown last, with what the sliders have done to it."""
        return self.session.study.sky

    @property
    def camera(self) -> Camera:
        """The camera it was seen with."""
        return self.session.study.camera

    @property
    def exposure(self) -> float | None:
        """The exposure it was shown with [1]; None is automatic."""
        return self.session.study.exposure

    @property
    def python(self) -> str:
        """Python that makes the picture shown last, bit for bit."""
        return self.session.python(self.session.study)

    def __repr__(self) -> str:
        camera, kind = self.camera, type(self.sky).__name__
        only = "" if self.widget is not None else f"; a picture only: {INSTALL}"
        return f"Explorer({kind}, {camera.width} × {camera.height}{only})"

    def _repr_png_(self) -> bytes:
        return encoded(self.session.picture(self.session.study)[0], "image/png")

    def _repr_mimebundle_(self, **_: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        data, metadata = ({}, {}) if self.widget is None else self.widget._repr_mimebundle_()
        picture = base64.b64encode(self._repr_png_()).decode()
        alt = {"alt": f"{type(self.sky).__name__} sky seen through {self.camera}"}
        return {**data, "text/plain": repr(self), "image/png": picture}, {**metadata, "image/png": alt}


def explore(
    sky: Any,
    *,
    camera: Camera | None = None,
    size: tuple[int, int] | None = None,
    exposure: float | str | None = None,
) -> Explorer:
    """Show a sky in a notebook under sliders, with a picture that follows them.

    A coarse picture follows the hand, an exact one stands when it rests. A click on the picture probes the sky; what
    was found leaves as Python or JSON, or is read from the returned object in the next cell.

    Parameters
    ----------
    sky : any sky of `pleinair.sky`
        Where to begin; it is not changed.
    camera : Camera, optional
        From where; towards the Sun by default, 15° above the horizon.
    size : tuple of int, optional
        Width and height of the picture [px]; by default the camera's, or 640 × 360.
    exposure : float, "auto" or None
        Factor of the light before tone mapping [1]. By default 2 for skies of relative radiance, whose curve is O'Neil's;
        "auto" follows the median of their picture. For skies in cd/m², which the eye of `pleinair.tone.present` sees,
        "auto" is the default and 1: it is adapted to the whole sky.

    Returns
    -------
    Explorer
        Shows itself; `sky`, `camera`, `exposure` and `python` are what was shown last.

    Raises
    ------
    ValueError, TypeError
        `sky` cannot be rendered, or another argument is out of range.
    ImportError
        Pillow is missing. Without anywidget there is a warning and a picture without sliders.

    Examples
    --------
    >>> explorer = explore(skies.Aoas(sun=Sun(elevation=35, azimuth=200)), size=(64, 36))
    >>> explorer.sky.sun
    Sun(elevation=35.0, azimuth=200.0)
    """
    if not dataclasses.is_dataclass(sky) or isinstance(sky, type) or not hasattr(sky, "render"):
        msg = f"sky must be a sky of pleinair.sky, got {type(sky).__name__}"
        raise TypeError(msg)
    if camera is None:
        sun = sky.bodies()[0] if hasattr(sky, "bodies") else getattr(sky, "sun", None)
        camera = Camera(640, 360, azimuth=getattr(sun, "azimuth", 0.0) % 360, elevation=15.0)
    else:
        instance(camera, "camera", Camera)
    if size is not None:
        try:
            width, height = size
        except (TypeError, ValueError):
            msg = f"size must be (width, height) [px], got {size!r}"
            raise TypeError(msg) from None
        camera = camera.resized(integer(width, "size", 1, 4096), integer(height, "size", 1, 4096))
    if exposure is None:
        exposure = 2.0 if hasattr(sky, "sun_intensity") else "auto"
    if isinstance(exposure, str) and exposure != "auto":
        msg = f"exposure must be a number or 'auto', got {exposure!r}"
        raise ValueError(msg)
    level = None if exposure == "auto" else real(exposure, "exposure", 1e-9, 1e6, "1")
    session = Session(Study(sky, camera, level))
    try:
        from .widget import Shell
    except ImportError:
        warnings.warn(f"anywidget is not installed, so there are no sliders: {INSTALL}", UserWarning, stacklevel=2)
        return Explorer(session)
    poster = encoded(session.picture(session.start)[0], "image/jpeg")
    return Explorer(session, Shell(session.spec(), poster, session.handle))

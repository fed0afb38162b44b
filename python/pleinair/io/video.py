"""Videos by PyAV: H.264, VP9, AV1, FFV1 with Rec. 709 colours that players show right; films that resume where they were killed.

PyAV turns RGB to YUV by the matrix of Rec. 601 whatever the colour tags say: frames are converted to Rec. 709 by name. FFV1
holds the levels themselves, bit for bit. Public as `pleinair.io.write_video`; films as `pleinair.Scene.film`.
"""

from __future__ import annotations

import json
import os
import shutil
import warnings
from collections.abc import Callable, Iterable, Iterator, Sized
from dataclasses import asdict, dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.docs import documented
from .._support.inputs import DomainWarning, Progress, array, choice, flag, integer, real, reporter
from ..color import srgb_encode
from .files import PathLike, replacing
from .photographs import pillow
from .pictures import nearest_levels

_CODECS = {"h264": "libx264", "vp9": "libvpx-vp9", "av1": "libsvtav1", "ffv1": "ffv1"}
# Containers by ending, their names, and what they hold, the usual first.
_CONTAINERS = {
    ".mp4": ("mp4", ("h264", "av1")),
    ".webm": ("webm", ("vp9", "av1")),
    ".mkv": ("matroska", tuple(_CODECS)[::-1]),
}
# One frame in, one packet out: packets of segments are joined by counting.
_OPTIONS = {
    "h264": {"preset": "medium", "bf": "0"},
    "vp9": {"deadline": "good", "cpu-used": "4", "auto-alt-ref": "0", "b": "0"},
    "av1": {"preset": "8"},
    "ffv1": {"level": "3"},
}
_QUALITY = {"h264": 18, "vp9": 24, "av1": 24, "ffv1": 0}
_PARTS = ".parts"
_FORMAT = 1


def _av() -> Any:
    try:
        import av
    except ImportError:
        msg = "videos need PyAV: pip install 'pleinair[video]'"
        raise ImportError(msg) from None
    return av


@dataclass(frozen=True)
class Encoding:
    """How frames become a video: codec, container, rate, size of the picture and of the padded picture."""

    codec: str
    container: str
    rate: str
    quality: int
    width: int
    height: int
    padded: tuple[int, int]

    @classmethod
    def of(cls, path: Path, shape: tuple[int, ...], fps: float, codec: str | None, quality: int | None) -> Encoding:
        """Check arguments, and say so where a picture is padded."""
        _av()
        container, codecs = _CONTAINERS[choice(path.suffix.lower(), "path's ending", tuple(_CONTAINERS))]
        codec = codecs[0] if codec is None else choice(codec, f"codec of {path.suffix}", codecs)
        rate = Fraction(real(fps, "fps", 1e-3, 1000, "1/s")).limit_denominator(1001)
        quality = _QUALITY[codec] if quality is None else integer(quality, "quality", 0, 63)
        height, width = shape[:2]
        even = (width, height) if codec == "ffv1" else (width + width % 2, height + height % 2)
        if even != (width, height):
            msg = f"frames of {width} x {height} are padded to {even[0]} x {even[1]}: {codec} halves colours both ways"
            warnings.warn(msg, DomainWarning, stacklevel=4)
        return cls(codec, container, str(rate), quality, width, height, even)

    @property
    def fraction(self) -> Fraction:
        """Frames a second."""
        return Fraction(self.rate)

    def encode(self, stream: Any, frames: Iterable[NDArray[np.uint8]]) -> int:
        """Write frames of levels to a binary stream as a whole video; return how many."""
        av = _av()
        os.environ.setdefault("SVT_LOG", "1")  # SVT-AV1 writes a page to standard error otherwise
        count = 0
        with av.open(stream, "w", format=self.container) as out:
            video = out.add_stream(_CODECS[self.codec], rate=self.fraction, options=self._options())
            video.width, video.height = self.padded
            video.pix_fmt = "bgr0" if self.codec == "ffv1" else "yuv420p"
            context = video.codec_context
            context.time_base = 1 / self.fraction
            context.thread_count = 1  # the same bits whatever the machine
            context.gop_size = 1 if self.codec == "ffv1" else 48
            if self.codec != "ffv1":
                # Limited range; primaries, transfer curve and matrix of Rec. 709.
                context.color_range = context.colorspace = context.color_primaries = context.color_trc = 1
            for levels in frames:
                out.mux(video.encode(self._frame(av, levels, count)))
                count += 1
            out.mux(video.encode(None))
        return count

    def _options(self) -> dict[str, str]:
        given = dict(_OPTIONS[self.codec])
        return given if self.codec == "ffv1" else given | {"crf": str(self.quality)}

    def _frame(self, av: Any, levels: NDArray[np.uint8], k: int) -> Any:
        if levels.shape != (self.height, self.width, 3):
            msg = f"frame {k} must have the shape of the first, {(self.height, self.width, 3)}, got {levels.shape}"
            raise ValueError(msg)
        right, below = self.padded[0] - self.width, self.padded[1] - self.height
        if right or below:
            levels = np.pad(levels, ((0, below), (0, right), (0, 0)), mode="edge")
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(levels), format="rgb24")
        if self.codec == "ffv1":
            frame = frame.reformat(format="bgr0")
        else:
            matrix, limits = av.video.reformatter.Colorspace.ITU709, av.video.reformatter.ColorRange.MPEG
            frame = frame.reformat(format="yuv420p", dst_colorspace=matrix, dst_color_range=limits)
        frame.pts, frame.time_base = k, 1 / self.fraction
        return frame

    def join(self, stream: Any, segments: Iterable[Path]) -> None:
        """Write the packets of segments, one after the other, to a binary stream, without encoding them again."""
        av = _av()
        count = 0
        with av.open(stream, "w", format=self.container) as out:
            video = None
            for path in segments:
                with av.open(str(path)) as part:
                    source = part.streams.video[0]
                    if video is None:
                        video = out.add_stream_from_template(source)
                        video.time_base = 1 / self.fraction
                    for packet in part.demux(source):
                        if packet.size == 0:
                            continue
                        packet.stream = video
                        packet.time_base = 1 / self.fraction
                        packet.pts = packet.dts = count
                        packet.duration = 1
                        out.mux(packet)
                        count += 1


def levels_of(frame: Any, name: str = "frames") -> NDArray[np.uint8]:
    """Return a frame as sRGB levels: of linear light, of levels, or of a picture's file."""
    if isinstance(frame, (str, os.PathLike)):
        with pillow().open(frame) as picture:
            return np.asarray(picture.convert("RGB"))
    given = np.asarray(frame)
    if given.dtype == np.uint8 and given.ndim == 3 and given.shape[2] == 3:
        return given
    light = array(frame, name, dtypes=(np.float32, np.float64), ndim=3, last=3)
    if not np.isfinite(light).all():
        msg = f"{name} must be finite: a frame has NaN or infinite light"
        raise ValueError(msg)
    return nearest_levels(srgb_encode(light))


def frame_count(seconds: float, fps: float) -> int:
    """Return how many frames a film has."""
    return max(1, round(real(seconds, "seconds", 1e-3, 86_400, "s") * real(fps, "fps", 1e-3, 1000, "1/s")))


def frame_time(k: int, count: int) -> float:
    """Return when in [0, 1] a frame is: the first at 0, the last at 1."""
    return k / max(count - 1, 1)


@documented
def write_video(
    path: PathLike,
    frames: Iterable[Any],
    *,
    fps: float = 24.0,
    codec: str | None = None,
    quality: int | None = None,
    progress: Progress = None,
) -> Path:
    """Write frames as a video.

    | ending | codecs, the usual first |
    |---|---|
    | .mp4 | "h264", "av1" |
    | .webm | "vp9", "av1" |
    | .mkv | "ffv1" (lossless), "av1", "vp9", "h264" |

    Parameters
    ----------
    path : path
        Where to; the file has its name when it is whole.
    frames : iterable
        Arrays (height, width, 3) of linear light, clipped to [0, 1] and sRGB-encoded, or of uint8 levels; or paths of
        pictures. All of one size. Odd sizes are padded by their last row or column where the codec needs it, with a
        warning; nothing is resized.
    fps : float
        Frames a second, 24000/1001 is kept exactly, in [0.001, 1000] [1/s].
    codec : str, optional
        See above.
    quality : int, optional
        Constant rate factor, in [0, 63], lower is better [1]: 18 for H.264, 24 for VP9 and AV1.
    {progress}

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError, TypeError
        There is no frame, frames differ in size, hold NaN, or an argument is out of range.
    FileNotFoundError
        There is no such folder.
    ImportError
        PyAV is not installed: pip install 'pleinair[video]'.

    Warns
    -----
    DomainWarning
        Frames are padded.

    Examples
    --------
    >>> import tempfile
    >>> fade = [np.full((48, 64, 3), k / 9, np.float32) for k in range(10)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_video(f"{folder}/fade.mkv", fade, fps=10).stat().st_size > 0
    True
    """
    path = Path(path)
    total = len(frames) if isinstance(frames, Sized) else 0
    each = iter(frames)
    try:
        first = levels_of(next(each))
    except StopIteration:
        msg = "frames must hold at least one frame"
        raise ValueError(msg) from None
    how = Encoding.of(path, first.shape, fps, codec, quality)
    tick, close = reporter(progress, "frames")

    def counted() -> Iterator[NDArray[np.uint8]]:
        yield first
        for k, frame in enumerate(each, 1):
            if tick is not None:
                tick(k, max(total, k))
            yield levels_of(frame)
        if tick is not None and total:
            tick(total, total)

    try:
        return replacing(path, lambda stream: how.encode(_Seekable(stream), counted()))
    finally:
        close()


class _Seekable:
    """A file as PyAV takes it: to be written and sought, not closed."""

    def __init__(self, stream: Any) -> None:
        self.write, self.seek, self.tell, self.flush = stream.write, stream.seek, stream.tell, stream.flush


@dataclass(frozen=True)
class Film:
    """A film whose frames are functions of their number, written in segments so that a killed one goes on where it was.

    Beside the film lies a folder, its name and ".parts": pictures of the segment that is worked on, and finished segments.
    It is removed when the film is whole.
    """

    path: Path
    how: Encoding
    count: int
    segment: int
    identity: str

    @property
    def parts(self) -> Path:
        """The folder of what is finished."""
        return self.path.with_name(self.path.name + _PARTS)

    def begin(self, resume: bool) -> None:
        """Take up what is there, or begin anew."""
        about = {"kind": "film", "format": _FORMAT, "count": self.count, "segment": self.segment, "of": self.identity}
        about |= {"encoding": json.loads(json.dumps(asdict(self.how)))}
        manifest = self.parts / "film.json"
        if self.parts.exists() and not resume:
            shutil.rmtree(self.parts)
        if manifest.exists():
            try:
                found = json.loads(manifest.read_text(encoding="utf-8"))
                other = [name for name in about if found.get(name) != about[name]]
            except (ValueError, AttributeError):
                other = ["text"]
            if other:
                msg = (
                    f"{self.parts} holds another film (its {', '.join(other)} {'is' if len(other) == 1 else 'are'} not of "
                    "this one): remove it, or give resume=False"
                )
                raise ValueError(msg)
            return
        if not self.parts.parent.is_dir():
            msg = f"there is no folder {self.parts.parent}"
            raise FileNotFoundError(msg)
        self.parts.mkdir(exist_ok=True)
        replacing(manifest, lambda stream: stream.write(json.dumps(about).encode()))

    def make(self, frame: Callable[[int], NDArray[Any]], tick: Any) -> Path:
        """Make what is missing and join it."""
        Image = pillow()
        segments = []
        for start in range(0, self.count, self.segment):
            done = self.parts / f"segment_{start:07d}{self.path.suffix}"
            segments.append(done)
            end = min(start + self.segment, self.count)
            if not done.exists():
                pictures = []
                for k in range(start, end):
                    picture = self.parts / f"frame_{k:07d}.png"
                    pictures.append(picture)
                    if not picture.exists():
                        shown = Image.fromarray(levels_of(frame(k)))
                        replacing(picture, partial(shown.save, format="PNG", compress_level=1))
                    if tick is not None:
                        tick(k + 1, self.count)
                replacing(done, partial(self._encode, pictures))
            elif tick is not None:
                tick(end, self.count)
            for k in range(start, end):
                (self.parts / f"frame_{k:07d}.png").unlink(missing_ok=True)
        replacing(self.path, lambda stream: self.how.join(_Seekable(stream), segments))
        shutil.rmtree(self.parts)
        return self.path

    def _encode(self, pictures: list[Path], stream: Any) -> int:
        return self.how.encode(_Seekable(stream), map(levels_of, pictures))


def film(
    path: PathLike,
    frame: Callable[[int], NDArray[Any]],
    size: tuple[int, int],
    *,
    seconds: float,
    fps: float,
    codec: str | None,
    quality: int | None,
    resume: bool,
    identity: str,
    progress: Progress,
) -> Path:
    """Write a film of `frame(k)`, the frames of width and height `size`, that resumes where it was killed."""
    path = Path(path)
    count = frame_count(seconds, fps)
    how = Encoding.of(path, size[::-1], fps, codec, quality)
    made = Film(path, how, count, max(2, min(48, round(how.fraction))), identity)
    made.begin(flag(resume, "resume"))
    tick, close = reporter(progress, "frames")
    try:
        return made.make(frame, tick)
    finally:
        close()

"""A scene in time: frames that depend on their time alone, and films of them that resume where they were killed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .._support.docs import documented
from .._support.fingerprint import fingerprint
from .._support.inputs import Progress, instance, integer, real, reporter
from ..camera import Camera
from ..io import PathLike, film, frame_count, frame_time
from .timeline import Timeline


class Animated:
    """What a scene does over a timeline."""

    def paint(self, camera: Camera, *, order: str = "hard") -> NDArray[np.float32]:
        """Paint one picture: of the scene itself."""
        raise NotImplementedError

    @documented
    def animate(self, timeline: Timeline, frames: int, *, progress: Progress = None) -> Iterator[NDArray[np.float32]]:
        """Paint frames one after the other; each depends on its time alone.

        Parameters
        ----------
        timeline : Timeline
            What changes.
        frames : int
            How many, in [1, 1000000] [1].
        {progress}

        Returns
        -------
        iterator of ndarray (height, width, 3) of float32
            As `paint` returns them, in slabs, where nothing jumps.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range.

        Examples
        --------
        >>> from pleinair import Camera, Scene, Sun, Timeline
        >>> from pleinair.sky import Aoas
        >>> scene = Scene(Aoas(sun=Sun(30, 160)))
        >>> pan = Timeline(lambda t: Camera(32, 24, azimuth=90 * t))
        >>> len(list(scene.animate(pan, 3)))
        3
        """
        instance(timeline, "timeline", Timeline)
        count = integer(frames, "frames", 1, 1_000_000)

        def each() -> Iterator[NDArray[np.float32]]:
            tick, close = reporter(progress, "frames")
            try:
                for k in range(count):
                    yield self.frame(timeline, frame_time(k, count))
                    if tick is not None:
                        tick(k + 1, count)
            finally:
                close()

        return each()

    def frame(self, timeline: Timeline, t: float) -> NDArray[np.float32]:
        """Paint the frame of one time: a pure function of scene, timeline and time.

        Where the timeline moves the Sun, light within clouds and shadows of strokes are those of Suns a degree apart and a mix
        between them, within 1 % of the light and 0.02 of the shadow (docs/scene_light.md); where the Sun stands still
        they are its own, as in `paint`.

        Parameters
        ----------
        timeline : Timeline
            What changes.
        t : float
            In [0, 1] [1].

        Returns
        -------
        ndarray (height, width, 3) of float32
            As `paint` returns it, in slabs.

        Raises
        ------
        ValueError, TypeError
            `t` is out of range.

        Examples
        --------
        >>> from pleinair import Camera, Scene, Sun, Timeline
        >>> from pleinair.sky import Aoas
        >>> scene = Scene(Aoas(sun=Sun(30, 160)))
        >>> scene.frame(Timeline(Camera(32, 24)), 0.5).shape
        (24, 32, 3)
        """
        camera, changes = instance(timeline, "timeline", Timeline).at(t)
        scene = replace(self, **changes) if changes else self  # type: ignore[type-var]
        if "sky" in changes:
            object.__setattr__(scene, "_moving_sun", True)
        return scene.paint(camera, order="slab")

    @documented
    def adapting(
        self, timeline: Timeline, *, seconds: float = 5.0, constant: float = 0.4, progress: Progress = None
    ) -> Timeline:
        """Return a timeline whose eye follows the light of the sky with a delay, so that a film does not flicker.

        The logarithm of the adaptation comes near that of the sky as `exp(-t / constant)`, from that of the first frame, at rest,
        on. It is a function of time alone: frames may be painted in any order.

        Parameters
        ----------
        timeline : Timeline
            What changes.
        seconds : float
            Length of the film, in [0.001, 86400] [s].
        constant : float
            Time constant of the eye, in [0.001, 1e6] [s]: by default that of rods in Durand and Dorsey (2000); cones take 0.1.
        {progress}

        Returns
        -------
        Timeline
            With `adaptation` by its times, four to a time constant and 1000 at most.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range.

        Notes
        -----
        F. Durand and J. Dorsey, "Interactive tone mapping", Eurographics Workshop on Rendering, 2000, section 4.2.

        Examples
        --------
        >>> from pleinair import Camera, Scene, Sun, Timeline
        >>> from pleinair.sky import Natural
        >>> dusk = Timeline(Camera(32, 24), sky=lambda t: Natural(sun=Sun(2 - 8 * t, 270)))
        >>> slow = Scene(Natural(sun=Sun(2, 270))).adapting(dusk, seconds=2, constant=1)
        >>> round(slow.adaptation(1.0) / Natural(sun=Sun(-6, 270)).adaptation(), 1) > 1
        True
        """
        instance(timeline, "timeline", Timeline)
        seconds = real(seconds, "seconds", 1e-3, 86_400, "s")
        constant = real(constant, "constant", 1e-3, 1e6, "s")
        count = min(max(2, math.ceil(4 * seconds / constant)), 1000)
        tick, close = reporter(progress, "adaptation")
        wanted = []
        try:
            for k in range(count + 1):
                _, changes = timeline.at(k / count)
                scene = replace(self, **changes) if changes else self  # type: ignore[type-var]
                wanted.append(math.log(scene.eye))  # type: ignore[attr-defined]
                if tick is not None:
                    tick(k + 1, count + 1)
        finally:
            close()
        # Exact for light whose logarithm goes evenly between two times.
        step = seconds / count / constant
        left = math.exp(-step)
        mean = (1 - left) / step
        slow = [wanted[0]]
        for before, now in pairwise(wanted):
            slow.append(left * slow[-1] + (mean - left) * before + (1 - mean) * now)
        return replace(timeline, adaptation={k / count: math.exp(value) for k, value in enumerate(slow)})

    @documented
    def film(
        self,
        path: PathLike,
        timeline: Timeline,
        *,
        seconds: float = 5.0,
        fps: float = 24.0,
        codec: str | None = None,
        quality: int | None = None,
        adaptation: float | None = None,
        resume: bool = True,
        progress: Progress = None,
    ) -> Path:
        """Paint a film; one that was killed goes on where it was.

        What is finished lies in a folder beside the film, its name and ".parts", until the film is whole. A scene with
        no objects films its sky.

        Parameters
        ----------
        path : path
            Ends in .mp4, .webm or .mkv, see `pleinair.io.write_video`.
        timeline : Timeline
            What changes.
        seconds : float
            Length, in [0.001, 86400] [s].
        fps : float
            Frames a second, in [0.001, 1000] [1/s].
        codec, quality : object
            See `pleinair.io.write_video`.
        adaptation : float, optional
            Time constant with which the eye follows the light, see `adapting` [s]. Without it each frame is seen by an eye that
            has come to rest under its own sky.
        resume : bool
            Whether to take up what a killed film left, or to begin anew.
        {progress}

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range, or what was left is of another film.
        FileNotFoundError
            There is no such folder.
        ImportError
            PyAV is not installed: pip install 'pleinair[video]'.

        Examples
        --------
        >>> import tempfile
        >>> from pleinair import Camera, Scene, Sun, Timeline
        >>> from pleinair.sky import Aoas
        >>> scene = Scene(Aoas(sun=Sun(30, 160)))
        >>> pan = Timeline({0: Camera(32, 24), 1: Camera(32, 24, azimuth=20)})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     scene.film(f"{folder}/pan.mp4", pan, seconds=0.5, fps=10).name
        'pan.mp4'
        """
        instance(timeline, "timeline", Timeline)
        count = frame_count(seconds, fps)
        camera, _ = timeline.at(0.0)
        identity = fingerprint((self, timeline) if adaptation is None else (self, timeline, adaptation))
        shot = timeline if adaptation is None else self.adapting(timeline, seconds=seconds, constant=adaptation)
        return film(
            path,
            lambda k: self.frame(shot, frame_time(k, count)),
            (camera.width, camera.height),
            seconds=seconds,
            fps=fps,
            codec=codec,
            quality=quality,
            resume=resume,
            identity=identity,
            progress=progress,
        )

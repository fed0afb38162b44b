"""Image analysis of a photograph before a fit (inverse_clouds, section 4.1). Public as `pleinair.fit.Photo`.

Segmentation of cloud, sky and ground, the sky behind the clouds by a Laplace fill, the colour of the light, the
histogram.
"""

from __future__ import annotations

import base64
import html
import io as stdio
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import fit_histogram, fit_mean
from .._core import sky_behind as clear_sky
from .._support.inputs import (
    Aligned,
    DomainWarning,
    boolean_mask,
    choice,
    instance,
    integer,
    linear_light,
    shape_text,
    vector,
)
from ..astro import Sun
from ..camera import Camera
from ..clouds import Basis
from ..color import luminance as color_luminance
from ..color import srgb_decode, srgb_encode
from ..image import Segmentation, otsu, resize, segment_sky
from ..io import PathLike, PhotoFacts, nearest_levels, photo_facts, pillow, read

# A verdict of no clouds that refuses a photograph; a less certain one warns.
_SURE = 0.75
# In a notebook: the widest side of a picture [px], linear colours of cloud, sky and ground.
_SHOWN = 320
_CLASSES = ((1.0, 1.0, 1.0), (0.05, 0.15, 0.5), (0.08, 0.12, 0.03))


class UnfittableError(ValueError):
    """A photograph whose clouds cannot be fitted; the message says why."""


@dataclass(frozen=True, eq=False)
class Photo(Aligned):
    """What a photograph tells about its clouds (section 4.1). Make one with `Photo.analyse`.

    Attributes
    ----------
    rgb : ndarray (height, width, 3) of float32
        The photograph, linear light.
    segmentation : pleinair.image.Segmentation
        Masks of cloud, sky and ground, with threshold and separability.
    sky : ndarray (height, width, 3) of float32, or None
        The sky behind the clouds, linear light; None where it cannot be known.
    light_color : tuple of float
        Colour of the light on the clouds, c_in, largest channel 1 [1].
    histogram : ndarray (3, bins) of float64
        Encoded levels of the cloud pixels, each channel of sum 1.
    problems : tuple of str
        Why the photograph cannot be fitted; empty if it can.
    facts : pleinair.io.PhotoFacts
        When, where and through which lens it was taken, as far as its file says so.
    cloud_given : bool
        Whether the clouds were given and not found.
    """

    rgb: NDArray[np.float32]
    segmentation: Segmentation
    sky: NDArray[np.float32] | None
    light_color: tuple[float, float, float]
    histogram: NDArray[np.float64]
    problems: tuple[str, ...] = ()
    facts: PhotoFacts = field(default_factory=PhotoFacts)
    cloud_given: bool = False

    def _repr_html_(self) -> str:
        """Draw the photograph, what was found in it, and the sky behind."""
        height, width, _ = self.rgb.shape
        small = max(height, width) / _SHOWN
        size = max(1, round(width / small)), max(1, round(height / small))
        classes = np.zeros(self.rgb.shape, np.float32)
        for mask, color in zip((self.cloud, self.segmentation.sky, self.segmentation.ground), _CLASSES, strict=True):
            classes[mask] = color
        drawn = [("photograph", self.rgb), ("cloud, sky, ground", classes)]
        if self.sky is not None:
            drawn.append(("sky behind", self.sky))
        try:
            cells = "".join(
                f'<td>{words}<br><img src="data:image/png;base64,{png_of(resize(picture, *size))}"></td>'
                for words, picture in drawn
            )
        except ImportError:  # no Pillow
            cells = ""
        found = self.segmentation
        verdict = f"{found.verdict} (confidence {found.confidence:.2f})"
        lines = [f"{self!r}", f"verdict: {verdict}", *(f"problem: {p}" for p in self.problems)]
        return f"<table><tr>{cells}</tr></table><p>" + "<br>".join(html.escape(line) for line in lines) + "</p>"

    def __repr__(self) -> str:
        height, width, _ = self.rgb.shape
        share = f"{self.cloud.mean():.0%} cloud, {self.segmentation.ground.mean():.0%} ground"
        color = ", ".join(f"{c:.2f}" for c in self.light_color)
        return f"Photo({width}x{height}, {share}, light ({color}), problems={self.problems})"

    @property
    def cloud(self) -> NDArray[np.bool_]:
        """Mask of the cloud pixels, (height, width).

        Examples
        --------
        >>> picture = np.full((32, 32, 3), (0.1, 0.3, 0.8), np.float32)
        >>> picture[8:20, 8:24] = 0.9
        >>> float(Photo.analyse(picture, ground=None).cloud.mean())
        0.1875
        """
        return self.segmentation.cloud

    @property
    def sun(self) -> Sun | None:
        """The Sun when and where the photograph was taken; None where its file does not say.

        Examples
        --------
        >>> Photo.analyse(np.full((32, 32, 3), (0.1, 0.3, 0.8)), ground=None).sun is None
        True
        """
        return self.facts.sun

    @property
    def camera(self) -> Camera | None:
        """A camera with the photograph's field of view, and its direction if known; None where its file has no lens.

        Examples
        --------
        >>> Photo.analyse(np.full((32, 32, 3), (0.1, 0.3, 0.8)), ground=None).camera is None
        True
        """
        height, width, _ = self.rgb.shape
        return self.facts.camera(width, height)

    @property
    def sky_color(self) -> tuple[float, float, float]:
        """Colour of the sky light, largest channel 1 [1]: the mean of the sky over the picture.

        Raises
        ------
        ValueError
            The photograph's sky is not known, or black.

        Examples
        --------
        >>> picture = np.full((32, 32, 3), (0.2, 0.4, 0.8), np.float32)
        >>> picture[8:20, 8:24] = 0.9
        >>> [round(c, 3) for c in Photo.analyse(picture, ground=None).sky_color]
        [0.25, 0.5, 1.0]
        """
        if self.sky is None:
            msg = "photo has no sky: " + ("; ".join(self.problems) or "pass sky= to Photo.analyse")
            raise ValueError(msg)
        red, green, blue = np.maximum(self.sky.mean(axis=(0, 1), dtype=np.float64), 0).tolist()
        peak = max(red, green, blue)
        if peak <= 0:
            msg = "photo has a black sky, which has no colour"
            raise ValueError(msg)
        return red / peak, green / peak, blue / peak

    @classmethod
    def edited(
        cls,
        picture: ArrayLike,
        cloud: Basis | ArrayLike,
        *,
        sky: ArrayLike | None = None,
        light_color: tuple[float, float, float] | None = None,
        bins: int = 64,
    ) -> Photo:
        """Take a rendered and then edited picture as the target of a fit (section 6).

        Parameters
        ----------
        picture : array_like (height, width, 3)
            Linear light as from `pleinair.io.read`, or uint8 sRGB.
        cloud : Basis or array_like (height, width) of bool
            Where the clouds are: pixels that see the cloud of a basis, at the picture's size, or a mask.
        sky : array_like (height, width, 3) or (3,), optional
            The sky behind the clouds, linear light; by default it is filled in from the edited picture.
        light_color : tuple of float, optional
            Colour of the light on the clouds, linear RGB, at least 0 [1]; by default that of the bright cloud pixels.
        bins : int
            Levels of the histogram, in [2, 256] [1].

        Returns
        -------
        Photo
            The target; `problems` says what was not found.

        Raises
        ------
        ValueError, TypeError
            As `analyse`.

        Examples
        --------
        >>> from pleinair import Camera, Sun, clouds
        >>> volume = clouds.procedural("cumulus", (16, 24, 24), rng=1)
        >>> camera = Camera.look_at((0, -800, 900), (240, 240, 960), 40, 30, fov=50)
        >>> basis = clouds.Basis.precompute(volume, camera, Sun(40, 160))
        >>> picture = basis.image(clouds.Params(light_intensity=4), sky=(0.1, 0.2, 0.5))
        >>> Photo.edited(0.8 * picture**1.2, basis).problems
        ()
        """
        height, width = np.shape(picture)[:2] if np.ndim(picture) == 3 else (0, 0)
        if isinstance(cloud, Basis):
            seen = cloud.depth > 0
            if seen.shape != (height, width) and min(height, width) > 0:
                seen = resize(seen.astype(np.float32), width, height) > 0.5
            cloud = seen
        photo = cls.analyse(picture, cloud=cloud, sky=sky, ground=None, bins=bins)
        return photo if light_color is None else replace(photo, light_color=vector(light_color, "light_color", 0, 1e30))

    @classmethod
    def analyse(
        cls,
        photo: ArrayLike | PathLike,
        *,
        bins: int = 64,
        method: str = "nbr",
        ground: Any = "auto",
        cloud: ArrayLike | None = None,
        sky: ArrayLike | None = None,
        margin: int | None = None,
    ) -> Photo:
        """Find the clouds of a photograph, the colour of their light and the sky behind them.

        Parameters
        ----------
        photo : array_like (height, width, 3), or path
            Linear light as from `pleinair.io.read`, or uint8 sRGB. Of a file, time, place and lens are taken too: `facts`.
        bins : int
            Levels of the histogram, in [2, 256] [1].
        method : {"nbr", "chroma"}
            How cloud and sky are told apart; see `pleinair.image.segment_sky`.
        ground : "auto", None or array_like (height, width) of bool
            What is neither cloud nor sky.
        cloud : array_like (height, width) of bool, optional
            The clouds, where the user knows better.
        sky : array_like (height, width, 3) or (3,), optional
            The sky behind the clouds, linear light, instead of filling it in.
        margin : int, optional
            Clouds and ground are grown by so many pixels before the sky is filled in, in [0, 256] [px]: thin rims would
            bleed into the sky otherwise. By default 1.5 % of the picture's smaller side.

        Returns
        -------
        Photo
            What was found; `problems` says what was not.

        Raises
        ------
        ValueError, TypeError
            The photograph is too small, not a colour picture, or holds NaN; an argument is out of range.

        Notes
        -----
        The light's colour is the mean of the brighter of two classes of cloud pixels (Otsu on luminance). The paper
        leaves its magnitude open, which L_in takes up: the largest channel is made 1, and a channel below 0 is made 0. The
        sky over cloud, ground and wisps beside the clouds is a smooth surface times the solution of Laplace's equation.

        Examples
        --------
        >>> picture = np.full((32, 32, 3), (0.1, 0.3, 0.8), np.float32)
        >>> picture[8:20, 8:24] = 0.9
        >>> photo = Photo.analyse(picture, ground=None)
        >>> photo.light_color, photo.problems
        ((1.0, 1.0, 1.0), ())
        """
        facts = PhotoFacts()
        if isinstance(photo, (str, Path)):
            facts, photo = photo_facts(photo), read(photo)
        pixels = np.asarray(photo)
        if pixels.dtype == np.uint8:
            levels = srgb_decode(np.arange(256) / 255.0).astype(np.float32)
            pixels = levels[pixels]
        rgb = linear_light(pixels, "photo", ndim=3, last=3).astype(np.float32, copy=False)
        if min(rgb.shape[:2]) < 16:
            msg = f"photo must have at least 16 x 16 pixels, got {shape_text(rgb.shape)}"
            raise UnfittableError(msg)
        if not np.isfinite(rgb).all():
            msg = "photo must be finite, got NaN or infinity"
            raise UnfittableError(msg)
        bins = integer(bins, "bins", 2, 256)
        margin = round(0.015 * min(rgb.shape[:2])) if margin is None else integer(margin, "margin", 0, 256)
        choice(method, "method", ("nbr", "chroma"))
        if cloud is not None:
            cloud = boolean_mask(cloud, "cloud", rgb.shape[:2])
        grey = float(np.ptp(rgb, axis=2).max()) < 2e-3
        if grey and isinstance(ground, str):
            ground = None  # land is found by colour
        problems = []
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", DomainWarning)
            found = segment_sky(rgb, method=method, ground=ground, cloud=cloud)
        problems += [str(w.message).removeprefix("photo: ") for w in caught if issubclass(w.category, DomainWarning)]
        if grey and cloud is None:
            problems.append("the photograph is grey: clouds cannot be told from sky by colour; pass cloud=")
        elif cloud is None and found.verdict == "cloudless":
            words = f"the photograph shows no clouds (confidence {found.confidence:.2f})"
            if found.confidence >= _SURE:
                problems.append(words + "; pass cloud= if it does: segmentation.cloud is the best guess")
            else:
                warnings.warn(f"photo: perhaps {words}: its best guess is fitted", DomainWarning, stacklevel=2)
        elif cloud is None and found.verdict == "night":
            problems.append("the photograph is of the night, where colour does not tell cloud from sky; pass cloud=")
        elif cloud is None and found.verdict == "overcast" and sky is None:
            problems.append(
                "the photograph is overcast: no sky is seen beside the clouds, and the light's colour would come out "
                "grey; pass sky= (and cloud= if only part is cloud)"
            )
        if not found.cloud.any() and not problems:
            problems.append("no pixel is cloud")
        behind: NDArray[np.float32] | None = None
        if sky is not None:
            given = linear_light(sky, "sky", last=3)
            if given.shape not in ((3,), rgb.shape) or not np.isfinite(given).all():
                msg = f"sky must be finite, of shape (3,) or {shape_text(rgb.shape)}, got {shape_text(given.shape)}"
                raise ValueError(msg)
            behind = np.ascontiguousarray(np.broadcast_to(given, rgb.shape), np.float32)
        elif not problems:
            clear = clear_sky(rgb, rgb.shape[:2], found.cloud | found.ground, found.feature, margin)
            if clear is None:
                problems.append("no sky is seen beside the clouds; pass sky=")
            else:
                behind = clear.reshape(rgb.shape)
        c_in, histogram = (1.0, 1.0, 1.0), np.zeros((3, bins))
        if found.cloud.any():
            luminance = color_luminance(rgb)
            threshold = otsu(luminance, mask=found.cloud)
            bright = found.cloud & (luminance > threshold.value)
            red, green, blue = fit_mean(rgb, bright if bright.any() else found.cloud)
            peak = max(red, green, blue)
            if peak > 1e-6:
                c_in = (max(red / peak, 0.0), max(green / peak, 0.0), max(blue / peak, 0.0))
            else:
                problems.append("the cloud pixels hold no light")
            histogram = fit_histogram(rgb, found.cloud, bins).reshape(3, bins)
        return cls(rgb, found, behind, c_in, histogram, tuple(problems), facts, cloud is not None)

    def sky_for(self, camera: Camera) -> NDArray[np.float32]:
        """Return the sky behind the clouds at the size of a camera's picture, which it fills.

        Parameters
        ----------
        camera : Camera
            Whose picture.

        Returns
        -------
        ndarray (height, width, 3) of float32
            Area-averaged, linear light.

        Raises
        ------
        ValueError
            The photograph's sky is not known.

        Examples
        --------
        >>> picture = np.full((32, 32, 3), (0.1, 0.3, 0.8), np.float32)
        >>> picture[8:20, 8:24] = 0.9
        >>> Photo.analyse(picture, ground=None).sky_for(Camera(8, 6)).shape
        (6, 8, 3)
        """
        instance(camera, "camera", Camera)
        if self.sky is None:
            msg = "photo has no sky: " + ("; ".join(self.problems) or "pass sky= to Photo.analyse")
            raise ValueError(msg)
        return resize(self.sky, camera.width, camera.height)


def png_of(picture: NDArray[np.float32]) -> str:
    """Return a picture as the base64 of a PNG."""
    Image = pillow()
    levels = nearest_levels(srgb_encode(picture))
    stream = stdio.BytesIO()
    Image.fromarray(levels).save(stream, "PNG")
    return base64.b64encode(stream.getvalue()).decode("ascii")

"""The noise of a photograph's sky, and the same on what is put into it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.inputs import generator
from ..color import srgb_decode, srgb_encode
from ..image import dilate
from .blur import blurred
from .photo import Photo


def grain_of(photo: Photo) -> NDArray[np.float64]:
    """Return the deviation of the noise of the sky between the clouds, of each encoded channel [1].

    What a pixel differs from the mean of its neighbourhood has 8/9 of the variance of white noise.
    """
    clear = ~dilate(photo.segmentation.cloud | photo.segmentation.ground, 3)
    clear[[0, -1]] = clear[:, [0, -1]] = False
    if clear.sum() < 64:
        return np.zeros(3)
    encoded = srgb_encode(np.clip(photo.rgb, 0, 1))
    # The median: stars, birds and the edges of veils are no grain.
    off = np.abs(encoded - blurred(encoded))[clear]
    return np.asarray(np.median(off, axis=0) / 0.6745 * np.sqrt(9 / 8), np.float64)


def grainy(picture: NDArray[np.float32], photo: Photo, rng: Any) -> NDArray[np.float32]:
    """Return a picture with the grain of a photograph, in its levels."""
    noise = generator(rng).standard_normal(picture.shape) * grain_of(photo)
    encoded = srgb_encode(np.clip(picture, 0, None).astype(np.float64)) + noise
    return srgb_decode(np.clip(encoded, 0, None)).astype(np.float32)

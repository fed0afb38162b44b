"""Colour conversions beside numpy, OpenCV, scikit-image and colour-science: one thread, float32, ``out=`` where it is.

Truth: the same conversion by colour-science or by the formula in float64 on the same float32 input, with the matrix and
white of the contender where a library fixes its own (its error is then that of its arithmetic, not of its constants).
At 12 megapixels errors are those of every 97th row, and scikit-image and colour-science are timed once where a call
needs more than 0.5 s, the first touch of their memory included.
"""

import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import cv2
import numpy as np
import pleinair as pa
import skimage
from pleinair.report import Row, race
from skimage import color as sk
from skimage.color.colorconv import xyz_from_rgb

with warnings.catch_warnings(), np.printoptions():
    warnings.simplefilter("ignore")
    import colour

C = pa.color
F = np.float32
NUMPY, OPENCV = f"numpy {np.__version__}", f"opencv {cv2.__version__}"
SKIMAGE, COLOUR = f"scikit-image {skimage.__version__}", f"colour-science {colour.__version__}"
SIZES = {"VGA": (480, 640), "12MP": (3000, 4000)}
TURNS = np.array([1 / 360, 1, 1])
SRGB = colour.RGB_COLOURSPACES["sRGB"]
# OpenCV's own matrix; scikit-image's is the same to six digits.
CV_MATRIX = np.array([[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]])
SK_WHITE = np.array([0.95047, 1.0, 1.08883])

Call = Callable[[], Any]
# Name: (call, truth on a sample of pixels).
Contenders = dict[str, tuple[Call, Callable[[Any], Any]]]


def encode(x: Any) -> Any:
    """IEC 61966-2-1 as one would write it in numpy, in the precision of the input."""
    return np.where(x <= 0.0031308, x * x.dtype.type(12.92), F(1.055) * x ** F(1 / 2.4) - F(0.055)).astype(x.dtype)


def decode(x: Any) -> Any:
    """The inverse of `encode`."""
    return np.where(x <= 0.04045, x / x.dtype.type(12.92), ((x + F(0.055)) / F(1.055)) ** F(2.4)).astype(x.dtype)


def exact_encode(x: Any) -> Any:
    x = x.astype("f8")
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def exact_decode(x: Any) -> Any:
    x = x.astype("f8")
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def to_lab(matrix: Any, white: Any) -> Callable[[Any], Any]:
    return lambda x: colour.XYZ_to_Lab(exact_decode(x) @ np.asarray(matrix).T, colour.XYZ_to_xy(white))


def from_lab(matrix: Any, white: Any) -> Callable[[Any], Any]:
    inverse = np.linalg.inv(matrix)

    def call(lab: Any) -> Any:
        linear = colour.Lab_to_XYZ(lab.astype("f8"), colour.XYZ_to_xy(white)) @ inverse.T
        return np.where(linear < 0, linear, exact_encode(np.abs(linear)))

    return call


def cyclic(got: Any, want: Any) -> float:
    """Largest error of HSV, the hue on its circle."""
    d = np.abs(got.astype("f8") - want)
    d[..., 0] = np.minimum(d[..., 0], 1 - d[..., 0])
    return float(d.max())


def largest(got: Any, want: Any) -> float:
    return float(np.abs(got.astype("f8") - want).max())


def distance(got: Any, want: Any) -> float:
    return float(np.linalg.norm(got.astype("f8") - want, axis=-1).max())


def tasks(x: Any) -> Iterator[tuple[str, Any, Contenders, Callable[[Any, Any], float], str]]:
    """Yield task, input, contenders, measure of the error and its unit."""
    # Written once, so that no contender pays for the first touch of the pages.
    out, dst = np.ones_like(x), np.ones_like(x)
    hsv, lab, xyz = C.rgb_to_hsv(x), C.rgb_to_lab(x, encoded=True), C.rgb_to_xyz(x)
    degrees = hsv * F([360, 1, 1])
    xyy = C.xyz_to_xyy(xyz)
    matrix = C.RGB_TO_XYZ.astype("f4").T.copy()
    exact_rgb_of = colour.HSV_to_RGB
    yield (
        "sRGB encode",
        x,
        {
            "pleinair": (lambda: C.srgb_encode(x, out=out), exact_encode),
            NUMPY: (lambda: encode(x), exact_encode),
            COLOUR: (lambda: colour.models.eotf_inverse_sRGB(x), exact_encode),
        },
        largest,
        "1",
    )
    yield (
        "sRGB decode",
        x,
        {
            "pleinair": (lambda: C.srgb_decode(x, out=out), exact_decode),
            NUMPY: (lambda: decode(x), exact_decode),
            COLOUR: (lambda: colour.models.eotf_sRGB(x), exact_decode),
        },
        largest,
        "1",
    )
    to_hsv = lambda p: colour.RGB_to_HSV(p.astype("f8"))
    yield (
        "RGB to HSV",
        x,
        {
            "pleinair": (lambda: C.rgb_to_hsv(x, out=out), to_hsv),
            OPENCV: (lambda: cv2.cvtColor(x, cv2.COLOR_RGB2HSV, dst=dst), lambda p: to_hsv(p) / TURNS),
            SKIMAGE: (lambda: sk.rgb2hsv(x), to_hsv),
            COLOUR: (lambda: colour.RGB_to_HSV(x), to_hsv),
        },
        cyclic,
        "1",
    )
    yield (
        "HSV to RGB",
        hsv,
        {
            "pleinair": (lambda: C.hsv_to_rgb(hsv, out=out), lambda p: exact_rgb_of(p.astype("f8"))),
            OPENCV: (
                lambda: cv2.cvtColor(degrees, cv2.COLOR_HSV2RGB, dst=dst),
                lambda p: exact_rgb_of(p.astype("f8")),
            ),
            SKIMAGE: (lambda: sk.hsv2rgb(hsv), lambda p: exact_rgb_of(p.astype("f8"))),
            COLOUR: (lambda: colour.HSV_to_RGB(hsv), lambda p: exact_rgb_of(p.astype("f8"))),
        },
        largest,
        "1",
    )
    yield (
        "RGB to XYZ",
        x,
        {
            "pleinair": (lambda: C.rgb_to_xyz(x, out=out), lambda p: p.astype("f8") @ C.RGB_TO_XYZ.T),
            NUMPY: (lambda: np.matmul(x, matrix, out=dst), lambda p: p.astype("f8") @ C.RGB_TO_XYZ.T),
            OPENCV: (lambda: cv2.cvtColor(x, cv2.COLOR_RGB2XYZ, dst=dst), lambda p: p.astype("f8") @ CV_MATRIX.T),
            COLOUR: (
                lambda: colour.RGB_to_XYZ(x, SRGB, chromatic_adaptation_transform=None),
                lambda p: p.astype("f8") @ np.asarray(SRGB.matrix_RGB_to_XYZ).T,
            ),
        },
        largest,
        "1",
    )
    white = C.D65
    yield (
        "sRGB to Lab",
        x,
        {
            "pleinair": (lambda: C.rgb_to_lab(x, encoded=True, out=out), to_lab(C.RGB_TO_XYZ, white)),
            OPENCV: (lambda: cv2.cvtColor(x, cv2.COLOR_RGB2Lab, dst=dst), to_lab(CV_MATRIX, CV_MATRIX.sum(1))),
            SKIMAGE: (lambda: sk.rgb2lab(x), to_lab(xyz_from_rgb, SK_WHITE)),
            COLOUR: (
                lambda: colour.XYZ_to_Lab(
                    colour.RGB_to_XYZ(x, SRGB, chromatic_adaptation_transform=None, apply_cctf_decoding=True)
                ),
                to_lab(SRGB.matrix_RGB_to_XYZ, colour.xy_to_XYZ(SRGB.whitepoint)),
            ),
        },
        distance,
        "ΔE",
    )
    yield (
        "Lab to sRGB",
        lab,
        {
            "pleinair": (lambda: C.lab_to_rgb(lab, encoded=True, out=out), from_lab(C.RGB_TO_XYZ, white)),
            OPENCV: (lambda: cv2.cvtColor(lab, cv2.COLOR_Lab2RGB, dst=dst), from_lab(CV_MATRIX, CV_MATRIX.sum(1))),
            SKIMAGE: (lambda: sk.lab2rgb(lab), from_lab(xyz_from_rgb, SK_WHITE)),
            COLOUR: (
                lambda: colour.XYZ_to_RGB(
                    colour.Lab_to_XYZ(lab), SRGB, chromatic_adaptation_transform=None, apply_cctf_encoding=True
                ),
                from_lab(SRGB.matrix_RGB_to_XYZ, colour.xy_to_XYZ(SRGB.whitepoint)),
            ),
        },
        largest,
        "1",
    )
    yield (
        "XYZ to xyY",
        xyz,
        {
            "pleinair": (lambda: C.xyz_to_xyy(xyz, out=out), lambda p: colour.XYZ_to_xyY(p.astype("f8"))),
            COLOUR: (lambda: colour.XYZ_to_xyY(xyz), lambda p: colour.XYZ_to_xyY(p.astype("f8"))),
        },
        largest,
        "1",
    )
    yield (
        "xyY to XYZ",
        xyy,
        {
            "pleinair": (lambda: C.xyy_to_xyz(xyy, out=out), lambda p: colour.xyY_to_XYZ(p.astype("f8"))),
            COLOUR: (lambda: colour.xyY_to_XYZ(xyy), lambda p: colour.xyY_to_XYZ(p.astype("f8"))),
        },
        largest,
        "1",
    )


def rows() -> Iterable[Row]:
    """Yield what was measured."""
    threads = pa.get_num_threads()
    cv_threads = cv2.getNumThreads()
    pa.set_num_threads(1)
    cv2.setNumThreads(1)
    try:
        for size, (height, width) in SIZES.items():
            x = np.random.default_rng(1).random((height, width, 3), dtype=F)
            for task, source, contenders, measure, unit in tasks(x):
                errors: dict[str, float] = {}
                fast: dict[str, Call] = {}
                slow: dict[str, float] = {}
                sample = source[:: 1 if size == "VGA" else 97]
                for name, (call, truth) in contenders.items():
                    start = time.process_time()
                    got = call()
                    once = time.process_time() - start
                    got = got[:: 1 if size == "VGA" else 97]
                    want = truth(sample)
                    if task == "RGB to HSV" and name == OPENCV:
                        got, want = got * TURNS, want * TURNS
                    errors[name] = measure(got, want)
                    if once > 0.5 and name in (SKIMAGE, COLOUR):
                        slow[name] = once
                    else:
                        fast[name] = call
                assert errors["pleinair"] < (2e-4 if unit == "ΔE" else 1e-5), (task, errors)
                measured = race("color", task, size, fast, errors, unit, rounds=7, budget=0.7)
                yield from measured
                for name, once in slow.items():
                    ratio = once / measured[0].seconds
                    yield Row("color", task, size, name, once, errors[name], unit, ratio)
    finally:
        pa.set_num_threads(threads)
        cv2.setNumThreads(cv_threads)

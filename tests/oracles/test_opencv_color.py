"""OpenCV 5 judges `pleinair.color`, within what its own epsilons and tables allow."""

import cv2
import numpy as np
import pleinair as pa
import pytest

C = pa.color
MATRIX = np.array([[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]])


@pytest.fixture
def x():
    return np.random.default_rng(4).random((120, 170, 3), dtype=np.float32)


def test_hsv(x):
    got, want = C.rgb_to_hsv(x), cv2.cvtColor(x, cv2.COLOR_RGB2HSV)
    lit = x.max(-1) >= 0.02
    turn = np.abs(got[..., 0] - want[..., 0] / 360)[lit]
    # FLT_EPSILON in its denominators, so only above 0.02; a hue is worth little where the colour is nearly grey.
    spread = (x.max(-1) - x.min(-1))[lit]
    assert np.minimum(turn, 1 - turn)[spread > 0.01].max() <= 2e-5
    assert np.abs(got[..., 1] - want[..., 1])[lit].max() <= 1e-5
    np.testing.assert_array_equal(got[..., 2], want[..., 2])


def test_its_saturation_fades_in_the_dark():
    dark = np.array([[[6e-8, 3e-8, 0.0]]], np.float32)
    assert cv2.cvtColor(dark, cv2.COLOR_RGB2HSV)[0, 0, 1] < 0.5
    assert C.rgb_to_hsv(dark)[0, 0, 1] == 1


def test_hsv_to_rgb(x):
    degrees = x * np.float32([360, 1, 1])
    # Degrees are rounded to 1.5e-5 at 360, which is 2.5e-7 of a sector on top of our own 2.3e-7.
    assert np.abs(C.hsv_to_rgb(x) - cv2.cvtColor(degrees, cv2.COLOR_HSV2RGB)).max() <= 1e-6


def test_xyz_with_its_matrix(x):
    want = cv2.cvtColor(x, cv2.COLOR_RGB2XYZ)
    assert np.abs(C.rgb_to_xyz(x, matrix=MATRIX) - want).max() <= 3e-7
    assert np.abs(C.xyz_to_rgb(want, matrix=MATRIX) - cv2.cvtColor(want, cv2.COLOR_XYZ2RGB)).max() <= 5e-6


def test_lab(x):
    # A trilinear table of 33^3 nodes: up to 0.67 ΔE on its own grid, whatever the matrix.
    distance = np.linalg.norm(C.rgb_to_lab(x, encoded=True) - cv2.cvtColor(x, cv2.COLOR_RGB2Lab), axis=-1)
    assert distance.max() <= 0.75
    assert distance.mean() <= 0.2
    assert distance.max() > 0.1


def test_linear_lab(x):
    # LRGB2Lab is computed, with splines for the root: no large table, the same matrix and white to four digits.
    distance = np.linalg.norm(C.rgb_to_lab(x) - cv2.cvtColor(x, cv2.COLOR_LRGB2Lab), axis=-1)
    assert distance.max() <= 0.75


def test_lab_to_rgb(x):
    lab = C.rgb_to_lab(x, encoded=True)
    assert np.abs(C.lab_to_rgb(lab, encoded=True) - x).max() <= 1e-5  # a dark channel beside bright ones
    # Its white and its inverse gamma are splines over rounded constants.
    assert np.abs(C.lab_to_rgb(lab, encoded=True) - cv2.cvtColor(lab, cv2.COLOR_Lab2RGB)).max() <= 5e-3


def test_it_clips_lab_and_ours_does_not():
    bright = np.full((1, 1, 3), 2, np.float32)
    assert cv2.cvtColor(bright, cv2.COLOR_RGB2Lab)[0, 0, 0] == pytest.approx(100, abs=0.1)
    assert C.rgb_to_lab(bright, encoded=True)[0, 0, 0] == pytest.approx(181.7, abs=0.1)


def test_it_makes_colours_of_nan():
    bad = np.full((1, 1, 3), np.nan, np.float32)
    assert np.isfinite(cv2.cvtColor(bad, cv2.COLOR_RGB2Lab)).all()
    assert np.isnan(C.rgb_to_lab(bad, encoded=True)).all()


def test_bytes():
    codes = np.random.default_rng(5).integers(0, 256, (100, 100, 3), dtype=np.uint8)
    got = C.rgb_to_lab(codes / 255, encoded=True)
    want = cv2.cvtColor(codes, cv2.COLOR_RGB2Lab).astype(float)
    difference = np.abs(got - (want * [100 / 255, 1, 1] - [0, 128, 128])).reshape(-1, 3).max(0)
    assert (difference <= [0.6, 2.3, 1.5]).all(), difference

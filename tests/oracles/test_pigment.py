"""Kubelka and Munk against coloraide-extras, and its spectra against colour-science."""

import numpy as np
import pleinair as pa
import pytest
from coloraide import Color as Base
from coloraide_extras.interpolate.spectral import Spectral


class Color(Base):
    """coloraide with spectral mixtures."""


Color.register(Spectral())


def theirs(a, b, t):
    colors = [Color("srgb", [x / 255 for x in c]) for c in (a, b)]
    mixed = Color.interpolate(colors, space="srgb-linear", method="spectral")(t)
    return np.clip(mixed.convert("srgb").coords(nans=False), 0, 1)


def ours(a, b, t):
    first, second = pa.color.srgb_decode(np.array([a, b]) / 255)
    return pa.color.srgb_encode(pa.color.mix_pigments(first, second, t))


def distance(x, y):
    return float(np.linalg.norm(np.subtract(*(pa.color.rgb_to_lab(c, encoded=True) for c in (x, y)))))


YELLOW, BLUE = (252, 211, 0), (0, 33, 133)


def test_yellow_and_blue_are_the_same_green():
    # Both recover spectra from RGB, each in its own way: saturated colours differ.
    assert distance(theirs(YELLOW, BLUE, 0.5), ours(YELLOW, BLUE, 0.5)) < 6
    r, g, b = ours(YELLOW, BLUE, 0.5)
    assert g > 1.8 * r
    assert g > 1.8 * b


@pytest.mark.parametrize(
    ("a", "b"),
    [((120, 90, 50), (60, 80, 110)), ((67, 74, 51), (179, 173, 130)), ((90, 98, 120), (200, 180, 150))],
)
@pytest.mark.parametrize("t", [0.25, 0.5, 0.75])
def test_paints_of_a_landscape_mix_alike(a, b, t):
    assert distance(theirs(a, b, t), ours(a, b, t)) < 2


def test_paint_is_not_light():
    light = pa.color.srgb_encode(pa.color.srgb_decode(np.array([YELLOW, BLUE]) / 255).mean(axis=0))
    assert distance(light, ours(YELLOW, BLUE, 0.5)) > 40, "light gives a greyish yellow"


def test_a_grey_is_mixed_from_black_and_white():
    mixed = pa.color.mix_pigments(np.zeros(3), np.ones(3), np.linspace(0, 1, 11))
    assert np.ptp(mixed, axis=1).max() < 1e-6
    assert (np.diff(mixed[:, 0]) > 0).all()

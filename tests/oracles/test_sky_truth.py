"""`Physical` against independent Monte Carlo: another program's values, and its own reference, which shares no solution.

The values are those of a backward Monte Carlo written outside this project, in the air of `Physical`'s defaults with
β = 0.0693 (turbidity 10 where said), noise 1 to 3 % by day and 1 to 2 % in twilight; it agrees with sasktran2 to 1.4 %.
"""

import math

import numpy as np
import pleinair as pa
import pytest

# Elevation of the Sun, zenith angle, azimuth from the Sun [°]; luminance [cd/m²].
DAY = [
    (1, 85, 0, 3070), (1, 85, 30, 1260), (1, 85, 90, 498), (30, 85, 180, 5240), (30, 89.5, 90, 4250),
    (30, 62, 0, 41_520), (30, 55, 0, 32_700),
]  # fmt: skip
TWILIGHT = [(-6, 0.429), (-8, 0.0339), (-10, 0.00497), (-11, 0.00208)]
UP = (0, 0, 1)


def to(zenith, azimuth):
    z, a = math.radians(zenith), math.radians(azimuth)
    return math.sin(a) * math.sin(z), math.cos(a) * math.sin(z), math.cos(z)


def luminance(elevation, direction=UP, **air):
    return float(
        pa.color.luminance(pa.sky.Physical(pa.Sun(elevation, 0), **air).radiance([direction]).astype(float))[0]
    )


def test_the_day_is_that_of_the_truth():
    errors = [luminance(e, to(z, a), beta=0.0693) / want - 1 for e, z, a, want in DAY]
    errors.append(luminance(10, to(80, 30), turbidity=10) / 4358 - 1)
    assert np.sqrt(np.mean(np.square(errors))) <= 0.03, errors
    assert np.abs(errors).max() <= 0.06, errors


def test_twilight_is_that_of_the_truth():
    # 5 %, and two standard errors of what is known to 1.5 %.
    for elevation, want in TWILIGHT:
        assert luminance(elevation, beta=0.0693) == pytest.approx(want, rel=0.05 + 0.03), elevation


def test_twilight_falls_without_a_staircase():
    elevations = np.arange(-2, -14.01, -0.05)
    slopes = np.diff(np.log([luminance(e, beta=0.0693) for e in elevations])) / 0.05
    # In a quarter of a degree the slope changes by 0.067 at most, at -8.1°, where the goal is 0.05: where the zenith's single
    # scattering ends, the fall bends by itself. It used to be 0.6.
    changes = [np.ptp(slopes[i : i + 6]) for i in range(len(slopes) - 5)]
    assert max(changes) < 0.075
    assert np.median(changes) < 0.04
    # A staircase bends to and fro: here every change goes the way of those around it.
    bends = np.diff(slopes)
    around = np.convolve(bends, np.ones(9) / 9, mode="same")
    assert np.abs(bends - around)[5:-5].max() < 0.012


@pytest.mark.parametrize(
    ("turbidity", "albedo", "elevation"),
    [
        (1.5, 0.8, 60),
        (2.5, 0.1, 30),
        (10, 0, 30),
        (10, 0.8, 10),
        (2.5, 0.3, 4),
        (6, 0.1, 1),
        (1.5, 0, 0),
        (2.5, 0.1, -4),
    ],
)
def test_fast_is_the_reference_in_all_air(turbidity, albedo, elevation):
    sky = pa.sky.Physical(pa.Sun(elevation, 0), turbidity=turbidity, ground_albedo=albedo)
    directions = [to(z, a) for z, a in ((20, 60), (70, 150), (85, 20), (88.5, 100), (130, 45))]
    fast = pa.color.luminance(sky.radiance(directions).astype(float))
    exact, error = (pa.color.luminance(v) for v in sky.monte_carlo(directions, 3072, key=elevation + 90))
    assert (error <= 0.1 * exact).all()
    assert (np.abs(fast - exact) <= 0.03 * exact + 3 * error).all(), (fast / exact, error / exact)


def test_the_reference_is_the_truth_and_says_its_error():
    sky = pa.sky.Physical(pa.Sun(1, 0), beta=0.0693)
    value, error = (pa.color.luminance(v) for v in sky.monte_carlo([to(85, 0), to(85, 30)], 8192))
    assert (np.abs(value - (3070, 1260)) < 3 * error + 0.03 * value).all()
    assert (error < 0.015 * value).all()
    again, _ = sky.monte_carlo([to(85, 0)], 512, key=7)
    more = [float(pa.color.luminance(sky.monte_carlo([to(85, 0)], 512, key=k)[0])[0]) for k in range(20, 32)]
    said = float(pa.color.luminance(sky.monte_carlo([to(85, 0)], 512, key=7)[1])[0])
    assert 0.4 * said < np.std(more) < 2.2 * said, "its scatter is its error"
    assert np.array_equal(again, sky.monte_carlo([to(85, 0)], 512, key=7)[0]), "a key gives the same paths"

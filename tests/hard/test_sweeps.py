"""Sweeps over whole valid ranges (hypothesis): finite, not negative, bounded, continuous; single precision is double's."""

from datetime import UTC, datetime

import numpy as np
import pleinair as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

SWEEP = settings(
    max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
VIEW = pa.Camera(12, 8, 90, 30, 20)
CLOUD = pa.clouds.procedural("cumulus", (8, 10, 12), rng=4)
EYE = pa.Camera.look_at((0, -900, 500), (120, 100, 880), 10, 8, fov=30)


def floats(low, high, width=64):
    # Bounds that single precision has, where it is asked for.
    low, high = (float(np.float32(v)) if width == 32 else v for v in (low, high))
    return st.floats(low, high, allow_nan=False, allow_infinity=False, width=width)


def light(shape, dtype=np.float64, high=1.0):
    width = 32 if dtype == np.float32 else 64
    return arrays.arrays(dtype, shape, elements=floats(0, high, width))


@SWEEP
@given(light((7, 3)))
def test_colour_spaces_there_and_back(rgb):
    for there, back in (
        (pa.color.srgb_encode, pa.color.srgb_decode),
        (pa.color.rgb_to_xyz, pa.color.xyz_to_rgb),
        (pa.color.rgb_to_hsv, pa.color.hsv_to_rgb),
        (pa.color.rgb_to_lab, pa.color.lab_to_rgb),
    ):
        found = there(rgb)
        assert np.isfinite(found).all()
        np.testing.assert_allclose(back(found), rgb, rtol=1e-6, atol=2e-7)


@SWEEP
@given(light((7, 3), np.float32, high=65504.0))
def test_single_precision_is_doubles(rgb):
    for function in (pa.color.srgb_encode, pa.color.rgb_to_xyz, pa.color.rgb_to_lab, pa.color.luminance, pa.tone.oneil):
        single, double = function(rgb), function(rgb.astype(np.float64))
        assert single.dtype == np.float32
        scale = np.abs(double).max() + 1e-12
        assert np.abs(single - double).max() <= 3e-6 * scale, function.__name__


@SWEEP
@given(light((50,), high=1.0), st.integers(2, 300))
def test_histograms_hold_every_sample(samples, bins):
    found = pa.image.histogram(samples[:, None], bins, (0, 1))
    assert found.counts.sum() == samples.size
    threshold = pa.image.otsu(samples)
    assert samples.min() <= threshold.value <= samples.max()


@SWEEP
@given(
    floats(-90, 90),
    floats(0, 360),
    floats(0, 0.3),
    floats(0, 0.1),
    floats(-0.999, 0.999),
    floats(0, 1e4),
    st.sampled_from(["constant", "radial"]),
)
def test_styles_are_light(elevation, azimuth, rayleigh, mie, g, complexity, apex):
    sky = pa.sky.Aoas(
        pa.Sun(elevation, azimuth), (rayleigh, rayleigh / 2, rayleigh / 4), mie=mie, g=g, apex=apex,
        cloud_complexity=complexity,
    )  # fmt: skip
    found = sky.render(VIEW)
    assert np.isfinite(found).all()
    assert (found >= 0).all()
    shown = pa.tone.oneil(found)
    assert ((shown >= 0) & (shown <= 1)).all()


# An atmosphere is followed once: the Sun goes everywhere in each of a few.
@pytest.mark.parametrize(("turbidity", "ozone", "albedo"), [(1.0, 0.0, 0.0), (2.5, 300.0, 0.1), (12.0, 600.0, 1.0)])
def test_the_air_is_light_wherever_the_sun_is(turbidity, ozone, albedo):
    to = np.random.default_rng(0).normal(size=(40, 3))
    to[:, 2] = np.abs(to[:, 2])
    before = None
    for elevation in np.linspace(-20, 90, 23):
        sun = pa.Sun(float(elevation), 130)
        sky = pa.sky.Physical(sun, turbidity, ozone=ozone, ground_albedo=albedo)
        found = sky.radiance(to)
        assert np.isfinite(found).all()
        total = found @ (0.2126, 0.7152, 0.0722)
        assert (total >= 0).all()
        # A millionth of a degree changes nothing that is seen.
        near = pa.sky.Physical(
            pa.Sun(float(np.clip(elevation + 1e-6, -90, 90)), 130), turbidity, ozone=ozone, ground_albedo=albedo
        )
        np.testing.assert_allclose(near.radiance(to), found, rtol=1e-4, atol=1e-6 * max(found.max(), 1e-9))
        if before is not None and elevation < 0:
            assert total.mean() > before, "night falls"
        before = total.mean()


@SWEEP
@given(
    floats(1e-5, 1),
    floats(-0.99, 0.99),
    floats(0, 1),
    floats(0, 10),
    floats(0, 1),
    floats(-89, 89),
    floats(0, 360),
)
def test_clouds_are_light(sigma, g, albedo, intensity, ambient, elevation, azimuth):
    params = pa.clouds.Params(light_intensity=intensity, g=g, sigma_t=sigma, albedo=albedo, ambient=ambient)
    image = pa.clouds.render(
        CLOUD, params, EYE, pa.Sun(elevation, azimuth), sky=(0.1, 0.2, 0.5), orders=2, samples=1, rng=0
    )
    assert np.isfinite(image.rgb).all()
    assert (image.rgb >= 0).all()
    assert ((image.transmittance >= 0) & (image.transmittance <= 1)).all()
    thinner = pa.clouds.render(
        CLOUD, pa.clouds.Params(g=g, sigma_t=0.5 * sigma), EYE, pa.Sun(elevation, azimuth), sky=(0, 0, 0)
    )
    assert (thinner.transmittance >= image.transmittance - 1e-6).all(), "less is more transparent"


@SWEEP
@given(light((6, 7, 3), np.float32, high=1e5), floats(1e-6, 1e5))
def test_an_eye_sees_within_the_display(scene, adaptation):
    for shown in (pa.tone.tumblin_rushmeier(scene, adaptation), pa.tone.scotopic(scene)):
        assert np.isfinite(shown).all()
        assert (shown >= 0).all()


@SWEEP
@given(st.datetimes(min_value=datetime(1950, 1, 1), max_value=datetime(2050, 1, 1)), floats(-90, 90), floats(-180, 180))
def test_the_sun_and_the_moon_are_somewhere(when, latitude, longitude):
    when = when.replace(tzinfo=UTC)
    place = pa.Place(latitude, longitude)
    for body in (pa.Sun.at(when, place), pa.astro.moon(when, place)):
        assert -90 <= body.elevation <= 90
        assert np.linalg.norm(body.direction) == pytest.approx(1, abs=1e-9)

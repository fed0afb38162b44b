"""Fog, rain and snow beside closed forms, quadrature, Gunn and Kinzer, Garg and Nayar, and the standard overcast skies."""

import math
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair import Camera, Scene, Sun
from pleinair.color import luminance
from pleinair.sky import CieGeneral, CloudSlab, Natural, Physical
from pleinair.weather import (
    Fog,
    Overcast,
    Rainbow,
    Snow,
    drop_speed,
    fall_sizes,
    sky_view,
    snow_cover,
    wet_reflectance,
)
from scipy import ndimage
from scipy.integrate import quad

VIEW = Camera(48, 32, fov=50, azimuth=0, elevation=10, position=(0, 0, 2))
SKY = Natural(sun=Sun(20, 180))


@pytest.mark.parametrize(
    ("z", "slope", "far"), [(2.0, 0.3, 500.0), (150.0, -0.5, 290.0), (2.0, 0.02, math.inf), (9.0, 0, 70)]
)
def test_depth_of_fog_is_the_integral_of_its_density(z, slope, far):
    fog = Fog(visibility=300, top=12, thins=25)
    to = [math.sqrt(1 - slope**2), 0.0, slope]

    def density(s):
        return math.exp(-max(z + slope * s - 12, 0) / 25)

    end = min(far, 3e4)
    cut = (12 - z) / slope if slope else 1.0
    want = fog.extinction * quad(density, 0, end, points=[min(max(cut, 0), end)], limit=500)[0]
    assert fog.optical_depth((0, 0, z), [to], [far])[0] == pytest.approx(want, rel=1e-6)


def test_fog_that_swallows_everything_is_its_own_light():
    wall = pa.paint.Strokes([[0, 30, 2]], (0, -1, 0), (40, 40))
    fog = Fog(visibility=1, top=5000)
    empty, full = (Scene(SKY, o, weather=fog).radiance(VIEW) for o in ([], [wall]))
    assert np.isfinite(full).all()
    np.testing.assert_allclose(full, empty, rtol=1e-3)
    assert luminance(full).min() > 100


def test_absent_weather_changes_no_bit():
    wall = pa.paint.Strokes([[0, 30, 2]], (0, -1, 0), (4, 4))
    bare = Scene(SKY, [wall])
    nothing = replace(bare, weather=[Rainbow(optical_depth=0), Snow(rate=0, lying=0)])
    assert (bare.radiance(VIEW) == nothing.radiance(VIEW)).all()


def test_overcast_is_the_slab_and_a_standard_sky():
    slab = CloudSlab(optical_depth=25, base=1000, thickness=800)
    # A spiral of equal areas over the upper half.
    z, turn = (np.arange(500) + 0.5) / 500, 2.399963 * np.arange(500)
    flat = np.sqrt(1 - z * z)
    to = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=-1)
    sky = pa.scene.Weathered(Physical(Sun(45, 180)), Overcast())
    light = luminance(sky.radiance(to))
    np.testing.assert_allclose(light, luminance(Physical(Sun(45, 180), overcast=slab).radiance(to)), rtol=1e-6)
    rms = []
    for kind in range(1, 6):
        gap = np.log(light) - np.log(luminance(CieGeneral(kind, Sun(45, 180)).radiance(to)))
        rms.append((gap - gap.mean()).std())
    assert min(rms) < 0.15


def test_drops_fall_as_gunn_and_kinzer_measured():
    # Table 2 of Gunn and Kinzer 1949.
    for diameter, speed in [(0.6, 2.47), (1, 4.03), (2, 6.49), (3, 8.06), (4, 8.83), (5, 9.09)]:
        assert abs(drop_speed(diameter) - speed) < 0.32


def test_rain_carries_its_own_rate():
    # The flux of water by Marshall and Palmer's drops is the rate within the error of their law.
    for rate in (2.0, 10.0, 40.0):
        number, mean, extinction = fall_sizes(rate)
        slope = 1e-3 / mean
        flux = quad(
            lambda d: number * slope * math.exp(-slope * d) * math.pi / 6 * d**3 * drop_speed(max(d, 0.1)), 0, 6
        )[0]
        assert flux * 1e-9 * 3.6e6 == pytest.approx(rate, rel=0.2)
        sections = quad(lambda d: number * slope * math.exp(-slope * d) * math.pi / 4 * (1e-3 * d) ** 2, 0, 20)[0]
        assert extinction == pytest.approx(2 * sections, rel=1e-3)


def streaks(exposure, size=3e-3, count=300, reach=4.0, focal=2000.0, seed=5):
    from pleinair._core import weather_fall

    picture = np.zeros((400, 400, 3), np.float32)
    axes = [[1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]]
    eye, still, white, both = (0, 0, 0), (0, 0), (1.0, 1.0, 1.0), (400, 400)
    sizes = (size, 1e-9)
    weather_fall(False, count, sizes, reach, still, exposure, 0.0, white, seed, eye, axes, focal, both, picture)
    return picture[..., 0]


def test_contrast_of_streaks_is_garg_and_nayars():
    # A pixel is covered for D / v of the exposure T: contrast falls as 1 / T, and length grows as v T.
    size = 3e-3
    for exposure in (1 / 60, 1 / 30):
        # One streak to a picture, so that none cross: its middle, wider than a pixel, has the contrast; far ones fade.
        alone = [streaks(exposure, size, 2000, 20.0, 8000.0, seed) for seed in range(120)]
        peaks = np.array([p.max() for p in alone if ndimage.label(p > 0)[1] == 1])
        want = size / (drop_speed(3.0) * exposure + size)
        assert len(peaks) > 10
        assert peaks.max() == pytest.approx(want, rel=1e-4)
        # Three eighths of the volume do not fade.
        assert (peaks > 0.98 * want).mean() > 0.2


def test_length_of_a_streak_is_speed_times_exposure():
    exposure, size = 1 / 250, 2e-3
    one = next(p for p in (streaks(exposure, size, count) for count in range(1, 3000)) if (p > 0).any())
    tall = np.ptp(np.nonzero(one.max(axis=1) > 0.5 * one.max())[0]) + 1
    wide = np.ptp(np.nonzero(one.max(axis=0) > 0.5 * one.max())[0]) + 1
    assert tall / wide == pytest.approx(drop_speed(2.0) * exposure / size + 1, rel=0.35)


def test_a_wet_ground_is_darker_as_lekner_and_dorf_say():
    # r from outside 0.066 and p from within 0.47 are handbook values of water; black and white stay.
    assert wet_reflectance(0) == 0
    assert 0.5 < wet_reflectance(0.3) / 0.3 < 0.65
    assert wet_reflectance(1.0) == pytest.approx(1 - 0.066, abs=2e-3)


@pytest.mark.parametrize("degrees", [10, 30, 50])
def test_the_bottom_of_a_wedge_sees_its_cosine(degrees):
    slope = math.tan(math.radians(degrees))
    x = np.abs(np.arange(-60, 61))
    valley = np.broadcast_to(slope * x, (61, 121))
    assert sky_view(valley, 1.0)[30, 60] == pytest.approx(math.cos(math.radians(degrees)), abs=0.01)


def test_snow_lies_by_slope_and_sky():
    assert snow_cover(0.0, 1.0) == 0
    assert snow_cover(1.0, 0.0) == 0
    assert snow_cover(1.0, 1.0) == 1
    covers = [snow_cover(up, 1.0) for up in np.linspace(0, 1, 21)]
    assert covers == sorted(covers)


def bow_at(scene_sky, weather, azimuth=0):
    """Elevation [°] of the brightest places against the sky without weather, on a vertical line."""
    elevation = np.arange(0.5, 60, 0.1)
    e, a = np.radians(elevation), math.radians(azimuth)
    to = np.stack([np.cos(e) * math.sin(a), np.cos(e) * math.cos(a), np.sin(e)], axis=-1)
    seen = pa.scene.Weathered(scene_sky, weather).radiance(to)
    return elevation, seen


def test_a_bow_stands_opposite_the_sun():
    elevation, seen = bow_at(SKY, Rainbow())
    red = seen[:, 0] - seen[:, 2]
    # Descartes at 620 nm: 42.2° from the antisolar point, here 20° below the horizon; drops of 400 µm bring it .3° in.
    assert abs(elevation[red.argmax()] - (42.2 - 20)) < 0.4

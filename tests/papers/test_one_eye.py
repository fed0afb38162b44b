"""`tone.present` and dithered levels: what docs/scene_light.md claims of the eye."""

import math
import pathlib
import tempfile
import warnings
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core

with warnings.catch_warnings(), np.printoptions():
    warnings.simplefilter("ignore")
    import colour

T = pa.tone
RNG = np.random.default_rng(3)


def lightness(levels):
    """L* of 8-bit levels, by colour-science."""
    return colour.XYZ_to_Lab(colour.sRGB_to_XYZ(np.asarray(levels) / 255.0))[..., 0]


def seen(sky, camera, **more):
    shown = T.present(sky.render(camera), sky.adaptation(), fov=camera.fov, **more)
    return T.to_uint8(shown, dither=True)


def clipped(levels):
    return (levels == 255).any(axis=-1).mean()


@pytest.mark.parametrize("fov", [6.0, 50.0])
def test_a_low_sun_is_a_disc(fov):
    sky = pa.sky.Natural(sun=pa.Sun(2, 245), turbidity=3)
    levels = seen(sky, pa.Camera(640, 360, fov=fov, azimuth=245, elevation=2))
    assert clipped(levels) <= 0.01
    # Two pixels or more within the limb, and beyond it.
    pixel = fov / 360
    inside, beyond = (round(r / pixel) for r in (0.15, 0.2665 + 2 * pixel))
    row = lightness(levels[180 if fov < 10 else 179])
    middle = 320
    assert row[middle - inside : middle + inside + 1].min() >= row[middle + beyond] + 10
    assert row[middle - inside : middle + inside + 1].min() >= row[middle - beyond] + 10
    # And light falls on beyond the limb: the eye's own.
    assert row[middle + beyond] > row[middle + beyond + round(1.0 / pixel)] + 3


@pytest.mark.parametrize("elevation", [30, 60])
def test_a_high_sun_leaves_the_sky(elevation):
    sky = pa.sky.Natural(sun=pa.Sun(elevation, 180), turbidity=3)
    levels = seen(sky, pa.Camera(320, 180, fov=60, azimuth=180, elevation=elevation))
    assert clipped(levels) <= 0.02
    assert np.median(lightness(levels)) < 75


def test_night_is_dark_and_darker_without_a_moon():
    grey = np.array([math.pi, math.pi, math.pi])
    found = []
    for sky in (
        pa.sky.Natural(sun=pa.Sun(24, 245)),
        pa.sky.Natural(sun=pa.Sun(-30, 0), moon=pa.astro.Moon(40, 230)),
        pa.sky.Natural(sun=pa.Sun(-30, 0), moon=None),
    ):
        paper = sky.irradiance([(0, 0, 1)])[0] / grey
        found.append(float(lightness(T.to_uint8(T.present(0.18 * paper[None], sky.adaptation())))[0]))
    day, moon, stars = found
    assert 40 < day < 60
    assert 12 < moon < 30
    assert 4 < stars < moon - 3


def test_a_bright_star_is_larger_and_brighter():
    there = pa.sky.Natural(datetime(2024, 8, 5, 22, 30, tzinfo=UTC), pa.Place(45, 6))
    stars = pa.astro.stars(there.when, there.place, limit=5.5)
    directions, magnitudes = stars.directions, stars.magnitudes
    low = directions[:, 2] < 0.4
    vega = directions[np.argmin(magnitudes + 9 * low)]

    def spot(direction):
        azimuth = math.degrees(math.atan2(direction[0], direction[1]))
        camera = pa.Camera(161, 121, fov=12, azimuth=azimuth % 360, elevation=math.degrees(math.asin(direction[2])))
        levels = lightness(seen(there, camera))
        return levels[45:76, 65:96] - np.median(levels)

    bright = spot(vega)
    faint = spot(directions[np.argmin(np.abs(magnitudes - 5) + 9 * low)])
    assert bright.max() > faint.max() + 10
    assert (bright > 8).sum() > 4 * (faint > 8).sum() > 0


def test_glare_is_spencers():
    # Spencer et al. 1995, table of the photopic eye, written anew: share of a point's light for each steradian.
    pixel = 0.05
    light = np.full((241, 241, 3), 1e-3, np.float32)
    light[120, 120] = 1e9
    at = np.array([3, 5, 8, 13, 21, 34, 55])
    want = 0.478 * 20.91 / (at * pixel + 0.02) ** 3 + 0.138 * 72.37 / (at * pixel + 0.02) ** 2
    want *= 1e9 * math.radians(pixel) ** 2
    # Read back through the curve: shown by day, without the Sun's white, light below the adaptation is in proportion.
    shown = T.present(light, 1e6, fov=241 * pixel, white=0.0, night=False)
    grey = T.present(np.full((1, 1, 3), 1e6, np.float32), 1e6, night=False)[0, 0, 0]
    got = shown[120, 120 + at, 0] / grey * 1e6
    linear = want < 1e6
    assert linear.sum() >= 3
    assert np.abs(np.log(got / want))[linear].max() < math.log(1.4)
    off = T.present(light, 1e6, fov=241 * pixel, glare=False, night=False)
    assert off[120, 130].max() < 1e-6


def test_what_needs_no_glare_keeps_its_bits():
    light = RNG.uniform(100, 8000, (40, 50, 3)).astype(np.float32)
    np.testing.assert_array_equal(T.present(light, 3000.0), T.present(light, 3000.0, glare=False))
    np.testing.assert_array_equal(T.present(light, 3000.0, night=False), T.present(light, 3000.0)), "day has no rods"
    assert (T.present(np.zeros((3, 4, 3), np.float32)) == 0).all(), "no light at all"
    assert (T.present(np.zeros((3, 4, 3), np.float32), 1e-8) == 0).all()


def test_the_same_bits_at_every_simd_level_and_thread_count():
    light = (10 ** RNG.uniform(-3, 6, (97, 131, 1)) * RNG.uniform(-0.02, 1, (97, 131, 3))).astype(np.float32)
    want = None
    try:
        for threads in (1, 2):
            pa.set_num_threads(threads)
            for level in _core.simd_levels():
                _core.force_simd_level(level)
                shown = T.present(light, 20.0)
                got = shown.tobytes() + T.to_uint8(shown, dither=True).tobytes()
                want = want or got
                assert got == want, (threads, level)
    finally:
        _core.force_simd_level(None)
        pa.set_num_threads(None)


def test_dither_keeps_the_mean_of_a_block():
    ramp = np.linspace(0.0004, 0.9, 64 * 40)[None, :, None] * np.linspace(0.7, 1, 128)[:, None, None]
    light = np.broadcast_to(ramp, (128, 64 * 40, 3)) * [1.0, 0.8, 0.5]
    exact = 255 * colour.cctf_encoding(light, function="sRGB")
    levels = T.to_uint8(light, dither=True)
    blocks = (levels - exact).reshape(2, 64, 40, 64, 3).mean(axis=(1, 3))
    assert np.abs(blocks).max() < 0.1
    # An even field, at any place of the tile.
    for value in (0.3, 1.0, 7.5, 100.2, 253.7, 254.6):
        even = T.to_uint8(np.full((97, 101, 3), pa.color.srgb_decode(value / 255)), dither=True)
        assert np.abs(even[13:77, 29:93].mean(axis=(0, 1)) - value).max() < 0.02
        assert np.ptp(even.astype(int)) <= 2
    ends = np.zeros((64, 64, 3))
    assert (T.to_uint8(ends, dither=True) == 0).all(), "zero stays zero"
    assert (T.to_uint8(ends + 1, dither=True) == 255).all()
    np.testing.assert_array_equal(T.to_uint8(light[..., 0], dither=True), levels[..., 0]), "of one channel"
    with pytest.raises(ValueError, match=r"\(height, width, 3\)"):
        T.to_uint8(np.zeros((4, 4)).ravel(), dither=True)


def test_a_night_sky_has_no_contours():
    sky = pa.sky.Natural(sun=pa.Sun(-30, 0), moon=None, stars=None)
    levels = seen(sky, pa.Camera(640, 200, fov=40, azimuth=90, elevation=45))

    def longest(picture):
        same = (picture[:, 1:] == picture[:, :-1]).all(axis=-1)
        edges = [np.diff(np.flatnonzero(~np.concatenate([[False], row, [False]]))).max() for row in same]
        return max(edges)

    assert levels.min() > 0
    assert longest(levels) <= 40
    plain = T.to_uint8(T.present(sky.render(pa.Camera(640, 200, fov=40, azimuth=90, elevation=45)), sky.adaptation()))
    assert longest(plain) > 40, "without dither there are"


def test_adaptation_is_that_of_the_sky_and_its_ground():
    # A sky of one luminance L: its log-average is L, paper in the open has L, grey ground 0.18 L.
    sky = pa.sky.CieGeneral(kind=5, sun=pa.Sun(40, 180), zenith_luminance=1000.0)
    lamps = sum(
        lamp.direction[2] * float(pa.color.luminance(np.array(lamp.irradiance))) / math.pi for lamp in sky._lights()
    )
    assert sky.adaptation() == pytest.approx(0.5 * 1000 + 0.09 * (1000 + lamps), rel=0.01)
    day = pa.sky.Natural(sun=pa.Sun(24, 245), turbidity=3.5)
    assert day.adaptation(tolerance=1e-2) == pytest.approx(day.adaptation(), rel=1e-2)
    # A turn of camera or a disc in view changes nothing.
    assert replace(day, sun=pa.Sun(24, 65)).adaptation() == pytest.approx(day.adaptation(), rel=5e-3)


def test_exposure_and_white():
    light = np.full((1, 1, 3), 500.0, np.float32)
    once, twice = (T.present(light, 3000.0, ev=ev)[0, 0, 0] for ev in (0, 1))
    assert twice == pytest.approx(2 * once, rel=1e-5)
    bright = np.full((1, 1, 3), 9e4, np.float32)
    assert T.present(bright, 3000.0)[0, 0, 0] == pytest.approx(1, abs=1e-5), "the brightest is white"
    assert T.present(bright, 3000.0, white=1e9)[0, 0, 0] < 0.8, "where the Sun is"
    for bad in ({"ev": 1e3}, {"white": -1.0}, {"fov": 0.0}, {"adaptation": 0.0}):
        with pytest.raises(ValueError, match=next(iter(bad))):
            T.present(light, **bad)
    with pytest.raises(ValueError, match="NaN"):
        T.present(light * np.nan, 1.0)


def test_a_strip_of_a_day_has_no_seams():
    place = pa.Place(45, 6)
    evening = [datetime(2024, 8, 4, hour, tzinfo=UTC) for hour in (17, 21)]
    strip = pa.demo.day_strip(place, evening, width=240, height=24)
    levels = 255 * pa.color.srgb_encode(strip).mean(axis=(0, 2))
    steps = np.abs(np.diff(levels))
    # The dusk of an hour goes over seventy columns: no column is apart from both of its neighbours.
    assert steps.max() < 5
    assert np.abs(np.diff(levels, 2)).max() < 2.5
    scale = pa.demo.day_strip(place, [evening[0], datetime(2024, 8, 4, 18, tzinfo=UTC)], width=90, height=8, hours=True)
    assert scale.shape == (24, 90, 3)
    ticks = np.flatnonzero(scale[8, :, 0] > 0.1)
    assert ticks.tolist() == [0, 89]


def test_an_eye_follows_the_light_with_its_time_constant():
    # A sky that becomes a hundred times darker within a moment: what is left is e^(-t / constant) of the logarithm.
    noon, dusk = (pa.sky.Natural(sun=pa.Sun(e, 250)) for e in (30, -6))
    scene = pa.Scene(noon)
    still = scene.adapting(pa.Timeline(pa.Camera(8, 6)), seconds=3, constant=0.5)
    assert [still.adaptation(t) for t in (0, 0.3, 1)] == pytest.approx([noon.adaptation()] * 3)
    seconds, constant = 4.0, 0.5
    step = pa.Timeline(pa.Camera(8, 6), sky=lambda t: noon if t < 1e-9 else dusk)
    eye = scene.adapting(step, seconds=seconds, constant=constant).adaptation
    a, b = np.log(noon.adaptation()), np.log(dusk.adaptation())
    for t in (0.25, 0.5, 1.0):
        left = (np.log(eye(t)) - b) / (a - b)
        # The step takes the first eighth of a second, in which the light falls evenly.
        assert left == pytest.approx(np.exp(-(t * seconds - 0.0625) / constant), rel=0.02, abs=1e-4)


def test_a_film_does_not_flicker():
    # A sky that flickers by a third from one moment to the next: the frames of a slow eye keep their tone to each other.
    bright, dim = (pa.sky.Natural(sun=pa.Sun(e, 250)) for e in (30, 20))
    camera = pa.Camera(32, 18, elevation=10)
    flicker = pa.Timeline(camera, sky=lambda t: bright if round(t * 40) % 2 else dim)
    scene = pa.Scene(bright)
    slow = scene.adapting(flicker, seconds=2.0, constant=2.0)
    assert np.ptp(np.log([slow.adaptation(t) for t in np.linspace(0.5, 1, 21)])) < 0.25 * np.log(
        bright.adaptation() / dim.adaptation()
    )
    # It is of the time alone: in any order, saved and read.
    times = (0.7, 0.1, 0.4)
    assert [np.array_equal(scene.frame(slow, t), scene.frame(slow, t)) for t in times] == [True] * 3
    fixed = replace(slow, sky=None)
    folder = pathlib.Path(tempfile.mkdtemp())
    pa.scene.save(folder / "a.json", timeline=fixed)
    back = pa.scene.load(folder / "a.json")["timeline"]
    assert [back.adaptation(t) for t in times] == [fixed.adaptation(t) for t in times]
    with pytest.raises(ValueError, match=r"constant must be in \[0.001, 1e\+06\] \[s\]"):
        scene.adapting(flicker, constant=0)
    with pytest.raises(ValueError, match="adaptation"):
        pa.Timeline(camera, adaptation={0: 0.0, 1: 3.0})

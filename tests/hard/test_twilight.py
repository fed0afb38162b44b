"""From noon to midnight and back at every place and date: nothing missing, nothing negative, nothing that jumps."""

import math
import warnings
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise

import numpy as np
import pleinair as pa
import pytest
from pleinair import DomainWarning, Place, Sun
from pleinair.astro import Moon
from pleinair.sky import CieGeneral, Natural, Preetham

UP = (0, 0, 1)
PARIS = Place(48.8, 2.3)
# Up, around, at and under the horizon, and straight down.
SOME = np.array([UP, *(Sun(e, a).direction for e in (60, 12, 0.3, 0, -1, -40) for a in (0, 140, 260)), (0, 0, -1)])


def luminance(sky, directions=(UP,)):
    return pa.color.luminance(sky.radiance(np.array(directions, float)).astype(float))


def level(sky):
    return float(luminance(sky)[0])


def illuminance(sky, **how):
    return float(pa.color.luminance(sky.irradiance(UP, **how)))


# ---- Every degree.


@pytest.mark.parametrize(("altitude", "step"), [(0, 1), (15_000, 6)])
def test_no_degree_of_the_sun_gives_nan(altitude, step):
    for elevation in range(-90, 91, step):
        seen = Natural(sun=Sun(elevation, 30), altitude=altitude).radiance(SOME)
        assert np.isfinite(seen).all(), elevation
        assert (pa.color.luminance(seen) >= 0).all(), elevation
        assert pa.color.luminance(seen[0]) > 1e-5, elevation


@pytest.mark.parametrize(("sun", "step"), [(-30, 2), (-8, 10), (20, 10)])
def test_a_moon_at_any_degree_adds_its_light_and_no_more(sun, step):
    without = luminance(Natural(sun=Sun(sun, 30)), SOME)
    for elevation in range(-90, 91, step):
        moon = Moon(elevation, 200, phase_angle=2.0 * abs(elevation), limb_from_zenith=4.0 * elevation)
        sky = Natural(sun=Sun(sun, 30), moon=moon)
        seen = luminance(sky.without_disc(), np.vstack([SOME, moon.direction]))
        # The quadrature is turned to the brightest light.
        assert (seen[:-1] >= without * (1 - 1e-3)).all(), elevation
        light = float(pa.color.luminance(np.array(sky.moon_light().irradiance)))
        # Full at the horizon, a new one at the zenith: outside the air no more than its magnitude says, and some of it.
        outside = moon.illuminance
        assert 0 <= light <= outside, elevation
        assert light == 0 if elevation < -1 else light > 0.3 * outside if elevation > 20 else True, elevation
        # Light that comes down is light that was taken from the beam.
        if sun == -30:
            assert (seen[:-1] - without).max() < 10 * outside, elevation


@pytest.mark.parametrize("day", ["preetham", 1, 5, 12, 15])
def test_formulas_of_a_day_at_every_sun(day):
    for elevation in (90, 60, 8.001, 8, 7.999, 5, 2.001, 2, 1.999, 0, -1e-9, -6, -18.5, -90):
        seen = luminance(Natural(sun=Sun(elevation, 30), day=day, discs=False), SOME)
        if elevation < 2:
            # Of a formula nothing is left.
            air = luminance(Natural(sun=Sun(elevation, 30), discs=False), SOME)
            assert seen == pytest.approx(air, rel=1e-6), elevation
        elif elevation >= 8:
            # A whole sky of the formula, ground below it.
            formula = Preetham(Sun(elevation, 30), 2.5) if day == "preetham" else CieGeneral(day, Sun(elevation, 30))
            above = luminance(formula.without_disc(), SOME[:10])
            above *= seen[0] / above[0]
            assert seen[:10] == pytest.approx(above, rel=1e-3), elevation
        assert (seen > 0).all(), elevation


def test_the_sky_never_brightens_as_the_sun_goes_down():
    heights = [90, 80, *range(68, 20, -12), *range(16, -25, -4), -30, -60, -90]
    lux = [illuminance(Natural(sun=Sun(e))) for e in heights]
    # To what the quadrature, which is turned to the Sun, has of the night.
    assert all(b < a * (1 + 1e-5) for a, b in pairwise(lux))
    # From 1.3e5 lx to the 1e-3 and less of a natural night.
    assert lux[0] > 1e5
    assert 1e-4 < lux[-1] < 2e-3
    # Night does not depend on how far down the Sun is.
    assert lux[-2] == pytest.approx(lux[-1], rel=3e-5)


def test_neither_sun_nor_moon_that_sets_makes_a_step():
    # The centre of what is held: parts come and go at -5, -20.9, -21 and +4; the Moon's light at -12.
    def pairs(make, edges):
        return [level(make(e + s)) for e in edges for s in (1e-3, -1e-3)]

    sun = np.array(pairs(lambda e: Natural(sun=Sun(e), moon=Moon(40, 90)), (4.01, 4, 0, -5, -12, -20.9, -21))).reshape(
        -1, 2
    )
    assert np.abs(sun[:, 1] / sun[:, 0] - 1).max() < 4e-3
    moon = np.array(pairs(lambda e: Natural(sun=Sun(-40), moon=Moon(e)), (0.27, 0, -0.27, -6, -12, -12.1))).reshape(
        -1, 2
    )
    assert np.abs(moon[:, 1] / moon[:, 0] - 1).max() < 4e-3


# ---- The Moon.


def test_a_new_moon():
    dark = Natural(sun=Sun(-40))
    for model in ("krisciunas", "wang"):
        full = luminance(Natural(sun=Sun(-40), moon=Moon(30, 100, model=model)), [Moon(30, 100).direction])[0]
        for phase in (180, 179.999, 175):
            moon = Moon(30, 100, phase_angle=phase, model=model)
            sky = Natural(sun=Sun(-40), moon=moon)
            assert np.isfinite(sky.render(pa.Camera(12, 12, 1, azimuth=100, elevation=30))).all()
            assert level(sky) == pytest.approx(level(dark), rel=0.05)
            # Its disc is earth-lit: brighter than the dark sky, far darker than when full.
            disc = luminance(sky, [moon.direction])[0] - luminance(sky.without_disc(), [moon.direction])[0]
            assert 1e-6 < disc / full < 1e-3


def test_a_moon_without_light_and_a_place_without_moon():
    on = Natural(sun=Sun(-40), moon=Moon(40, 100))
    off = replace(on, moonlight=False)
    assert off.moon_light() is None
    assert off.bodies()[1] is None
    assert off.radiance(SOME).tobytes() == Natural(sun=Sun(-40)).radiance(SOME).tobytes()
    assert Natural(sun=Sun(-40)).moon_light() is None


def test_without_sunlight_a_day_is_a_night():
    night = Natural(sun=Sun(-40), moon=Moon(40, 100))
    for elevation in (50, 1, -3, -10):
        off = Natural(sun=Sun(elevation, 200), moon=Moon(40, 100), sunlight=False)
        assert "sunlight" not in off.parts
        assert off.sun_light().irradiance == (0, 0, 0)
        assert luminance(off, SOME) == pytest.approx(luminance(night, SOME), rel=1e-3)
    when = datetime(2024, 6, 20, 12, tzinfo=UTC)
    assert "stars" in Natural(when, PARIS, sunlight=False).parts
    for day in ("preetham", 12):
        off = Natural(sun=Sun(50, 200), day=day, sunlight=False)
        assert "formula" not in off.parts
        assert luminance(off, SOME) == pytest.approx(luminance(Natural(sun=Sun(-40)), SOME), rel=1e-3)


# ---- Eclipses.


def test_an_eclipse_by_its_geometry():
    sun = Sun(40, 180)
    bare = illuminance(Natural(sun=sun))
    near = Moon(40, 180, distance=356_000, phase_angle=180)
    assert near.angular_radius > sun.angular_radius
    total = illuminance(Natural(sun=sun, moon=near))
    # Of the order of twilight with the Sun 5 to 7° down, by the size of the shadow.
    assert 0.3 < total < 20
    assert total / bare < 3e-4
    far = Moon(40, 180, distance=406_000, phase_angle=180)
    annular = Natural(sun=sun, moon=far)
    ring = limb(far, sun)
    # Air beside the line to the Sun has more of it.
    assert ring < illuminance(annular, disc=False) / illuminance(Natural(sun=sun), disc=False) < 1.5 * ring
    found = [illuminance(Natural(sun=sun, moon=replace(near, elevation=40 + e))) for e in (0, 0.1, 0.2, 0.4, 0.6)]
    assert (np.diff(found) > -1e-6 * bare).all(), "the closer, the darker"
    assert found[-1] == pytest.approx(bare, rel=1e-3)


def limb(moon, sun):
    """Share of a Sun's light that is in its ring, darkened at the limb by 1 - 0.6 (1 - m): an integral over m."""
    # The Moon's radius in an eclipse, k = 0.272281.
    m = math.sqrt(1 - (moon.angular_radius * 0.272281 * 6378.137 / 1737.4 / sun.angular_radius) ** 2)
    return (0.4 * m**2 + 0.6 * m**3 * 2 / 3) / 0.8


@pytest.mark.parametrize("day", ["preetham", 12])
def test_an_eclipse_of_a_formula(day):
    sun = Sun(40, 180)
    moon = Moon(40, 180, distance=356_000, phase_angle=180)
    bare, total = (luminance(Natural(sun=sun, moon=m, day=day), SOME[:4]) for m in (None, moon))
    assert (total < 1e-3 * bare).all()


def test_an_eclipsed_sun_as_a_light_is_eclipsed():
    sun = Sun(40, 180)
    whole = np.array(Natural(sun=sun).sun_light().irradiance)
    total = Natural(sun=sun, moon=Moon(40, 180, distance=356_000, phase_angle=180))
    assert (np.array(total.sun_light().irradiance) < 1e-3 * whole).all()
    annular = Natural(sun=sun, moon=Moon(40, 180, distance=406_000, phase_angle=180))
    ring = limb(annular.bodies()[1], sun)
    assert np.array(annular.sun_light().irradiance) / whole == pytest.approx(ring, rel=3e-3)
    # And so is the disc that is drawn.
    camera = pa.Camera(200, 200, 1, azimuth=180, elevation=40)
    disc = lambda s: pa.color.luminance(s.render(camera).astype(float) - s.without_disc().render(camera)).sum()
    assert disc(annular) / disc(Natural(sun=sun)) == pytest.approx(ring, rel=0.01)
    assert luminance(annular, [sun.direction])[0] < 1e6, "the middle is the Moon"


@pytest.mark.parametrize("elevation", [90, 0, -0.2, -5, -90])
def test_an_eclipse_anywhere(elevation):
    bare = luminance(Natural(sun=Sun(elevation, 180), discs=False), SOME)
    for off in (0, 0.53) if elevation < 0 else (1e-12, 0.1):
        moon = Moon(max(elevation - off, -90), 180, phase_angle=180)
        sky = Natural(sun=Sun(elevation, 180), moon=moon)
        assert np.isfinite(sky.radiance(np.vstack([SOME, moon.direction]))).all()
        seen = luminance(sky.without_disc(), SOME)
        assert (seen <= bare * (1 + 1e-3)).all(), "an eclipse takes light"
        if elevation >= 0:
            # 0.1° apart more than half of the Sun is behind the Moon.
            assert (seen < (0.5 if off == 0.1 else 0.05) * bare).all()
        assert np.isfinite(sky.panorama(32, tolerance=0.05)).all()


# ---- Places and dates.


@pytest.mark.parametrize(
    "place", [Place(90, 0), Place(-90, 123), Place(89.999, -500), Place(78.2, 15.6), Place(0, 180)]
)
def test_polar_day_and_night(place):
    for month in (3, 6, 9, 12):
        for hour in (0, 7, 13, 19):
            sky = Natural(datetime(2024, month, 21, hour, tzinfo=UTC), place)
            assert np.isfinite(sky.radiance(SOME)).all()
            assert level(sky) > 1e-5
    if place.latitude < 78:
        return
    heights = [Natural(datetime(2024, 6, 20, h, tzinfo=UTC), place).bodies()[0].elevation for h in range(0, 24, 3)]
    assert min(heights) > 11, "the Sun does not set"
    heights = [Natural(datetime(2024, 12, 20, h, tzinfo=UTC), place).bodies()[0].elevation for h in range(0, 24, 3)]
    assert max(heights) < -11, "nor rise"


def test_at_a_pole_the_sun_goes_round_at_one_height():
    start = datetime(2024, 6, 20, tzinfo=UTC)
    suns = [Natural(start + timedelta(hours=h), Place(90, 0)).bodies()[0] for h in range(0, 24, 2)]
    assert np.ptp([s.elevation for s in suns]) < 0.01
    assert suns[0].elevation == pytest.approx(23.4, abs=0.1)
    turn = np.unwrap(np.radians([s.azimuth for s in suns]))
    assert np.diff(np.degrees(turn)) == pytest.approx(30, abs=0.1)


@pytest.mark.parametrize("year", [1900, 1949, 2051, 2100])
def test_the_ends_of_the_calendar(year):
    for when in (datetime(year, 1, 1, tzinfo=UTC), datetime(year, 12, 31, 23, 59, 59, tzinfo=UTC)):
        with pytest.warns(DomainWarning, match="1950 to 2050") as caught:
            sky = Natural(when, PARIS)
        # Once, and where the user stands.
        assert [w.filename for w in caught] == [__file__]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert np.isfinite(sky.radiance(SOME)).all()
            assert np.isfinite(sky.panorama(24, tolerance=0.05)).all()
            assert np.isfinite(sky.irradiance(UP)).all()


@pytest.mark.parametrize(
    "when",
    [datetime(1899, 12, 31, 23, 59, tzinfo=UTC), datetime(2101, 1, 1, tzinfo=UTC), datetime(1, 1, 1, tzinfo=UTC)],
)
def test_beyond_the_calendar(when):
    with pytest.raises(ValueError, match=r"when must be in the years \[1900, 2100\]"):
        Natural(when, PARIS)
    # Also where the Sun and Moon are given: the stars need the instant.
    with pytest.raises(ValueError, match="when must be in the years"):
        Natural(when, PARIS, sun=Sun(-40), moon=Moon(10))


def test_an_instant_needs_a_zone_even_if_sun_and_moon_are_given():
    with pytest.raises(ValueError, match="time zone"):
        Natural(datetime(2024, 1, 1), PARIS, sun=Sun(-40), moon=Moon(10))
    with pytest.raises(TypeError, match="when"):
        Natural("2024-01-01", PARIS)
    with pytest.raises(TypeError, match="place"):
        Natural(datetime(2024, 1, 1, tzinfo=UTC), (48.8, 2.3))


def test_the_moon_passes_the_zenith():
    # Somewhere between the tropics it does every month.
    best = None
    for hour in range(24 * 28):
        when = datetime(2024, 1, 1, tzinfo=UTC) + timedelta(hours=hour)
        moon = pa.astro.moon(when, Place(10, 0))
        best = max(best, (moon.elevation, when)) if best else (moon.elevation, when)
    near = [best[1] + timedelta(minutes=m) for m in range(-30, 31, 5)]
    sky = max((Natural(when, Place(10, 0)) for when in near), key=lambda s: s.bodies()[1].elevation)
    assert sky.bodies()[1].elevation > 80
    assert np.isfinite(sky.radiance(SOME)).all()
    assert np.isfinite(sky.render(pa.Camera.fisheye(64), tolerance=0.05)).all()


def test_what_an_eye_sees_of_a_night():
    # From noon to a moonless night a picture has neither NaN nor an inverted contrast.
    camera = pa.Camera(48, 32, 70, azimuth=180, elevation=20)
    for sky in (Natural(sun=Sun(30, 180)), Natural(sun=Sun(-6, 180)), Natural(sun=Sun(-40), airglow=0)):
        x = sky.render(camera)
        y = pa.color.luminance(x.astype(float))
        assert pa.tone.log_average(x) == pytest.approx(math.exp(np.log(np.maximum(y, 1e-8)).mean()), rel=1e-4)
        shown = pa.color.luminance(pa.tone.tumblin_rushmeier(x).astype(float))
        order = np.argsort(y, axis=None)
        assert (np.diff(shown.ravel()[order]) >= -1e-6).all()
        assert pa.tone.show(x, night=True).shape == x.shape

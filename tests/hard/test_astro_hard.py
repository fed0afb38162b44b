"""The sky of poles, of the ends of the calendar, of eclipses and of wrong arguments."""

import math
import pickle
import warnings
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from zoneinfo import ZoneInfo, available_timezones

import numpy as np
import pleinair as pa
import pytest
from pleinair import astro

PARIS = pa.Place(48.8, 2.3)
NOON = datetime(2024, 6, 20, 12, tzinfo=UTC)


def numbers(thing):
    return [v for v in vars(thing).values() if isinstance(v, float)]


def apart(a, b):
    return math.degrees(2 * math.asin(min(1.0, math.dist(a.direction, b.direction) / 2)))


@pytest.mark.parametrize("latitude", [90.0, -90.0, 89.999999, -89.999999])
def test_at_the_poles_the_sun_circles_at_its_declination(latitude):
    suns = [pa.Sun.at(NOON + timedelta(hours=h), pa.Place(latitude, 0), refraction=False) for h in range(24)]
    for sun in suns:
        assert sun.elevation == pytest.approx(math.copysign(23.44, latitude), abs=0.02)
    turned = np.diff(np.unwrap([s.azimuth for s in suns], period=360))
    # Clockwise in the north, against it in the south.
    assert turned == pytest.approx(math.copysign(15, latitude), abs=0.01)


def test_polar_day_and_night():
    north, south = pa.Place(75, 20), pa.Place(-75, 20)
    hours = [NOON + timedelta(hours=h) for h in range(24)]
    assert min(pa.Sun.at(h, north).elevation for h in hours) > 5
    assert max(pa.Sun.at(h, south).elevation for h in hours) < -5


def test_refraction_lifts_the_horizon_and_not_the_zenith():
    when = datetime(2024, 3, 20, 5, 50, tzinfo=UTC)
    lifts = []
    for minute in range(80):
        time = when + timedelta(minutes=minute)
        truly, seen = (pa.Sun.at(time, pa.Place(0, 0), refraction=r) for r in (False, True))
        assert seen.azimuth == truly.azimuth
        lifts.append((truly.elevation, seen.elevation - truly.elevation))
    near = min(lifts, key=lambda pair: abs(pair[0]))
    assert near[1] == pytest.approx(0.47, abs=0.04)
    high = pa.Place(0, 0, 100_000)
    assert pa.Sun.at(NOON, high).elevation == pytest.approx(pa.Sun.at(NOON, high, refraction=False).elevation, abs=1e-5)


def test_the_moon_at_the_zenith():
    # Where the Moon stands in the zenith: search along the Earth, then on it.
    place = pa.Place(0, 0)
    for _ in range(6):
        seen = astro.moon(NOON, place, refraction=False)
        away, azimuth = math.radians(90 - seen.elevation), math.radians(seen.azimuth)
        lat = math.radians(place.latitude)
        new = math.asin(math.sin(lat) * math.cos(away) + math.cos(lat) * math.sin(away) * math.cos(azimuth))
        step = math.atan2(
            math.sin(azimuth) * math.sin(away) * math.cos(lat), math.cos(away) - math.sin(lat) * math.sin(new)
        )
        place = pa.Place(math.degrees(new), place.longitude + math.degrees(step))
    seen = astro.moon(NOON, place)
    assert seen.elevation > 89.99
    assert all(map(math.isfinite, numbers(seen)))
    # The radius of the Earth nearer than from its limb.
    limb = astro.moon(NOON, pa.Place(0, place.longitude + 90))
    assert limb.distance - seen.distance == pytest.approx(6378, abs=400)
    assert seen.angular_radius > limb.angular_radius


@pytest.mark.parametrize("model", ["krisciunas", "wang"])
def test_the_light_of_every_phase(model):
    phases = np.concatenate([[0, 1e-300, 1e-12, 1e-6], np.arange(0, 180, 0.25), 180 - np.array([1e-6, 1e-12, 0])])
    moons = [pa.astro.Moon(30, 120, phase_angle=p, model=model) for p in np.sort(phases)]
    light = np.array([[m.magnitude, m.irradiance, m.illuminance, m.illuminated_fraction] for m in moons])
    assert np.isfinite(light).all()
    assert (np.diff(light[:, 0]) >= 0).all()
    assert (np.diff(light[:, 1:], axis=0) <= 0).all()
    assert (light[:, 1:3] > 0).all()
    assert light[0, 3] == 1
    assert light[-1, 3] < 1e-30


def test_half_moon_is_a_tenth_of_the_full_as_measured_and_a_third_by_the_paper():
    share = {}
    for model in ("krisciunas", "wang"):
        full, half = (pa.astro.Moon(30, phase_angle=p, model=model).irradiance for p in (0, 90))
        share[model] = half / full
    assert share["krisciunas"] == pytest.approx(0.091, abs=0.001)
    assert share["wang"] == pytest.approx(0.377, abs=0.001)
    assert pa.astro.Moon(30, model="wang").magnitude == pytest.approx(-12.73, abs=0.02)


def test_the_eclipse_of_1999():
    when, place = datetime(1999, 8, 11, 10, 32, tzinfo=UTC), pa.Place(48.8, 8.0, 200)
    sun, new = pa.Sun.at(when, place), astro.moon(when, place)
    best = min(
        apart(pa.Sun.at(when + timedelta(minutes=m), place), astro.moon(when + timedelta(minutes=m), place))
        for m in range(-10, 11)
    )
    assert best < 0.02, "totality passed here"
    assert new.angular_radius > sun.angular_radius
    later = datetime(1999, 8, 11, 11, 3, tzinfo=UTC)
    sun, new = pa.Sun.at(later, place), astro.moon(later, place)
    assert apart(sun, new) < 0.3
    assert new.illuminated_fraction < 1e-4
    assert new.magnitude > -4.5


def test_the_full_moon_of_a_lunar_eclipse():
    when = datetime(2019, 1, 21, 5, 12, tzinfo=UTC)
    full = astro.moon(when, pa.Place(40, -75))
    assert full.phase_angle < 1.0
    assert full.illuminated_fraction > 0.9999
    assert apart(pa.Sun.at(when, pa.Place(40, -75), False), astro.moon(when, pa.Place(40, -75), refraction=False)) > 178


CALLS = [
    lambda when, place: pa.Sun.at(when, place),
    lambda when, place: astro.moon(when, place),
    lambda when, place: astro.stars(when, place, 2.0),
    lambda when, place: astro.sidereal_time(when, place),
]


@pytest.mark.parametrize("call", CALLS, ids=["sun", "moon", "stars", "sidereal"])
class TestWhen:
    def test_naive_datetimes_are_refused(self, call):
        with pytest.raises(ValueError, match="when must be an aware datetime"):
            call(datetime(2024, 6, 20, 12), PARIS)
        with pytest.raises(ValueError, match="when must be an aware datetime"):
            call(np.datetime64("2024-06-20T12:00"), PARIS)

    @pytest.mark.parametrize("when", ["2024-06-20", 1.7e9, None])
    def test_what_is_no_date_is_refused(self, call, when):
        with pytest.raises(TypeError, match="when"):
            call(when, PARIS)

    @pytest.mark.parametrize("place", [(48.8, 2.3), None, "Paris"])
    def test_what_is_no_place_is_refused(self, call, place):
        with pytest.raises(TypeError, match="place"):
            call(NOON, place)

    @pytest.mark.parametrize(
        "when",
        [
            datetime(1899, 12, 31, 23, 59, 59, tzinfo=UTC),
            datetime(2101, 1, 1, tzinfo=UTC),
            datetime(1, 1, 1, tzinfo=timezone(timedelta(hours=14))),
            datetime(9999, 12, 31, 23, tzinfo=timezone(timedelta(hours=-12))),
            datetime(1900, 1, 1, tzinfo=timezone(timedelta(hours=1))),
        ],
    )
    def test_other_centuries_are_refused(self, call, when):
        with pytest.raises(ValueError, match=r"when must be in the years \[1900, 2100\]"):
            call(when, PARIS)

    @pytest.mark.parametrize(
        "when",
        [
            datetime(1900, 1, 1, tzinfo=UTC),
            datetime(1949, 12, 31, 23, 59, 59, tzinfo=UTC),
            datetime(2051, 1, 1, tzinfo=UTC),
            datetime(2100, 12, 31, 23, 59, 59, 999999, tzinfo=UTC),
        ],
    )
    def test_far_dates_warn(self, call, when):
        with pytest.warns(pa.DomainWarning, match="1950 to 2050") as caught:
            call(when, PARIS)
        assert len(caught) == 1

    @pytest.mark.parametrize("when", [datetime(1950, 1, 1, tzinfo=UTC), datetime(2050, 12, 31, 23, 59, 59, tzinfo=UTC)])
    def test_near_dates_do_not(self, call, when):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            call(when, PARIS)


def same(a, b):
    if isinstance(a, pa.astro.Stars):
        return np.array_equal(a.directions, b.directions)
    return a == b


@pytest.mark.parametrize("call", CALLS, ids=["sun", "moon", "stars", "sidereal"])
def test_an_instant_is_the_same_in_every_zone(call):
    known = {"Europe/Paris", "Pacific/Chatham", "America/St_Johns"} & available_timezones()
    zones = [*map(ZoneInfo, sorted(known)), *(timezone(timedelta(hours=h)) for h in (-12, 5.5, 14))]
    first = call(NOON, PARIS)
    for zone in zones:
        assert NOON.astimezone(zone).utcoffset() != NOON.utcoffset()
        assert same(call(NOON.astimezone(zone), PARIS), first)


@pytest.mark.parametrize("turn", [-720, -360, 360, 3600])
def test_a_whole_turn_of_longitude_changes_nothing(turn):
    here, there = pa.Place(10, 100), pa.Place(10, 100 + turn)
    assert pa.Sun.at(NOON, here).direction == pytest.approx(pa.Sun.at(NOON, there).direction, abs=1e-12)
    assert astro.moon(NOON, here).direction == pytest.approx(astro.moon(NOON, there).direction, abs=1e-12)
    assert astro.sidereal_time(NOON, here) == pytest.approx(astro.sidereal_time(NOON, there), abs=1e-9)
    east, west = pa.Place(10, 180), pa.Place(10, -180)
    assert pa.Sun.at(NOON, east).direction == pytest.approx(pa.Sun.at(NOON, west).direction, abs=1e-12)


def test_every_degree_is_a_number():
    for latitude in range(-90, 91, 5):
        for longitude in range(-180, 181, 9):
            place = pa.Place(latitude, longitude)
            when = NOON + timedelta(hours=latitude * 37 + longitude)
            for seen in (pa.Sun.at(when, place), astro.moon(when, place)):
                assert all(map(math.isfinite, numbers(seen)))
                up, around = math.radians(seen.elevation), math.radians(seen.azimuth)
                there = (math.cos(up) * math.sin(around), math.cos(up) * math.cos(around), math.sin(up))
                assert seen.direction == pytest.approx(there, abs=1e-12)
    seen = astro.stars(NOON, pa.Place(-90, 0))
    assert np.linalg.norm(seen.directions, axis=-1) == pytest.approx(1, abs=1e-12)


def test_stars_rise_by_refraction_only():
    truly, seen = (astro.stars(NOON, PARIS, refraction=r).directions for r in (False, True))
    assert (seen[:, 2] >= truly[:, 2] - 1e-15).all()
    low = np.abs(truly[:, 2]) < 0.005
    assert low.any()
    assert np.degrees(seen[low, 2] - truly[low, 2]) == pytest.approx(0.48, abs=0.09)
    deep = truly[:, 2] < -0.1
    assert np.array_equal(seen[deep], truly[deep])


def test_stars():
    every = astro.stars(NOON, PARIS)
    assert len(every) == 8874
    assert every.directions.shape == (8874, 3)
    few = astro.stars(NOON, PARIS, limit=2.5)
    assert (few.magnitudes <= 2.5).all()
    assert np.array_equal(few.directions, every.directions[: len(few)])
    assert len(astro.stars(NOON, PARIS, limit=-2)) == 0
    assert astro.stars(NOON, PARIS, limit=-2).directions.shape == (0, 3)
    assert (every.temperatures > 2000).all()
    assert (every.temperatures < 20_000).all()
    assert astro.stars(NOON, PARIS, model="wang").temperatures.max() > 25_000
    for limit in (11, math.nan, math.inf):
        with pytest.raises(ValueError, match="limit"):
            astro.stars(NOON, PARIS, limit=limit)
    with pytest.raises(ValueError, match="model"):
        astro.stars(NOON, PARIS, model="planck")


def test_the_light_of_all_stars():
    """Naked-eye stars give what is known: about 2e-4 lx on a horizontal plane are all stars, these a part of them."""
    every = astro.stars(NOON, PARIS)
    total = astro.magnitude_to_irradiance(every.magnitudes).sum()
    table = {s.name: s for s in astro.light_sources()}
    assert table["starlight"].printed < total / 2 < table["starlight"].measured


def test_wrong_places_and_angles():
    for latitude in (90.1, -91, math.nan, math.inf):
        with pytest.raises(ValueError, match="latitude"):
            pa.Place(latitude, 0)
    with pytest.raises(ValueError, match="longitude"):
        pa.Place(0, math.inf)
    with pytest.raises(ValueError, match="altitude"):
        pa.Place(0, 0, 1e6)
    with pytest.raises(TypeError, match="latitude"):
        pa.Place("48", 2)
    with pytest.raises(ValueError, match="phase_angle"):
        pa.astro.Moon(0, phase_angle=181)
    with pytest.raises(ValueError, match="distance"):
        pa.Sun(0, distance=0)
    with pytest.raises(ValueError, match="model"):
        astro.moon(NOON, PARIS, model="moon")
    with pytest.raises(TypeError, match="refraction"):
        pa.Sun.at(NOON, PARIS, refraction=1)


def test_light_of_wrong_numbers():
    with pytest.raises(ValueError, match="irradiance"):
        astro.irradiance_to_magnitude([1, -1])
    with pytest.raises(ValueError, match="irradiance"):
        astro.irradiance_to_magnitude(math.nan)
    with pytest.raises(ValueError, match="b_v"):
        astro.color_temperature(-0.56, model="wang")
    with pytest.raises(ValueError, match="model"):
        astro.color_temperature(0.5, model="planck")
    m = np.linspace(-30, 30, 61)
    assert astro.irradiance_to_magnitude(astro.magnitude_to_irradiance(m)) == pytest.approx(m, abs=1e-12)


def test_a_sun_is_what_it_was():
    sun = pa.Sun(35, 200)
    assert repr(sun) == "Sun(elevation=35.0, azimuth=200.0)"
    assert sun == pa.Sun(35, 200, 1.0)
    assert sun != pa.Sun(35, 200, 1.01)
    seen = pa.Sun.at(NOON, PARIS)
    assert eval(repr(seen), {"Sun": pa.Sun}) == seen
    assert replace(seen, elevation=3).distance == seen.distance
    sky = pa.sky.Aoas(sun=seen)
    assert pa.sky.from_json(sky.to_json()) == sky


def test_everything_survives_pickle():
    for thing in (PARIS, pa.Sun.at(NOON, PARIS), astro.moon(NOON, PARIS), astro.light_sources()):
        assert pickle.loads(pickle.dumps(thing)) == thing
    seen = astro.stars(NOON, PARIS, 2)
    assert np.array_equal(pickle.loads(pickle.dumps(seen)).directions, seen.directions)

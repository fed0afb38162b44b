"""astropy judges where the Sun, the Moon and the stars are, 1950 to 2050, poles and mountains included.

Its built-in ephemeris (erfa epv00, moon98) and its bundled Earth rotation are used; nothing is downloaded. moon98 is
Meeus's series too: how far that is from the truth (18.3″ at most, 1950 to 2100) is erfa's own statement.
"""

import warnings
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core, astro

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import astropy.units as u
    from astropy.coordinates import TETE, AltAz, EarthLocation, SkyCoord, get_body, get_sun
    from astropy.time import Time
    from astropy.utils import iers

COUNT = 420
PLACES = [
    pa.Place(90, 0),
    pa.Place(-90, 0, 2800),
    pa.Place(48.8, 2.3, 100),
    pa.Place(-0.2, -78.5, 2850),
    pa.Place(-45.9, 170.5),
]


@pytest.fixture(autouse=True)
def _offline():
    before = iers.conf.auto_download, iers.conf.auto_max_age
    iers.conf.auto_download, iers.conf.auto_max_age = False, None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # dubious years, and polar motion outside of the tables
        yield
    iers.conf.auto_download, iers.conf.auto_max_age = before


def instants(first=1950, last=2050, count=COUNT, seed=5):
    start, stop = datetime(first, 1, 1, tzinfo=UTC), datetime(last, 12, 31, tzinfo=UTC)
    seconds = np.random.default_rng(seed).uniform(0, (stop - start).total_seconds(), count)
    return [start + timedelta(seconds=float(s)) for s in np.sort(seconds)]


def theirs(when):
    """The same instants, turned by the measured and forecast rotation of the Earth; outside of the tables UT1 is UTC."""
    time = Time(when, scale="utc")
    dut = np.zeros(len(when))
    # The later table wins where it is the final one.
    for table in (iers.IERS_Auto.open(), iers.IERS_B.open()):
        known = (time.mjd > table["MJD"][0].value) & (time.mjd < table["MJD"][-1].value)
        if known.any():
            dut[known] = table.ut1_utc(time[known].jd1, time[known].jd2).value
    time.delta_ut1_utc = dut
    return time


def unix(when):
    return when.timestamp()


def arcseconds(a, b):
    """Angles between unit vectors, exact also when they are small."""
    a, b = (np.asarray(v) / np.linalg.norm(v, axis=-1, keepdims=True) for v in (a, b))
    return np.degrees(2 * np.arcsin(np.linalg.norm(a - b, axis=-1) / 2)) * 3600


def local(altaz):
    alt, az = altaz.alt.rad, altaz.az.rad
    return np.stack([np.cos(alt) * np.sin(az), np.cos(alt) * np.cos(az), np.sin(alt)], axis=-1)


def where(place):
    return EarthLocation.from_geodetic(place.longitude * u.deg, place.latitude * u.deg, place.altitude * u.m)


# Of the Moon astropy has the truncated series alone, 18" from the truth by its own statement: see the test below.
@pytest.mark.parametrize(("index", "limit"), [(0, 1.0), (1, 20.0)], ids=["sun", "moon"])
def test_geocentric(index, limit, record_property):
    when = instants()
    ours = np.array([_core.astro_geocentric(unix(w))[index] for w in when])
    time = theirs(when)
    body = get_sun(time) if index == 0 else get_body("moon", time)
    true = body.transform_to(TETE(obstime=time))
    error = arcseconds(ours, true.cartesian.xyz.to_value(u.km).T)
    record_property("worst_arcseconds", float(error.max()))
    print(f"{['sun', 'moon'][index]}: median {np.median(error):.2f}″, worst {error.max():.2f}″")
    assert error.max() < limit
    away = np.linalg.norm(ours, axis=-1) / true.distance.to_value(u.km) - 1
    print(f"distance: worst {np.abs(away).max():.1e}")
    # astropy measures from the Earth of now to the Moon of 1.3 s ago, through which both move 38 km: 1e-4 of its distance.
    assert np.abs(away).max() < (1e-5 if index == 0 else 1.2e-4)


def test_the_moon_is_that_of_de421():
    """By skyfield 1.55, at instants that the fit of our sines has not seen: apparent right ascension and declination."""
    rows = np.loadtxt(Path(__file__).parent / "data" / "moon_de421.csv", delimiter=",", skiprows=1)
    ours = np.array([_core.astro_geocentric(unix)[1] for unix in rows[:, 0]])
    right, north = rows[:, 1], rows[:, 2]
    there = np.stack([np.cos(north) * np.cos(right), np.cos(north) * np.sin(right), np.sin(north)], -1)
    error = arcseconds(ours, there)
    print(f"the Moon: rms {np.sqrt(np.mean(error**2)):.2f}″, worst {error.max():.2f}″")
    assert error.max() < 0.5
    assert np.sqrt(np.mean(error**2)) < 0.2


@pytest.mark.parametrize("place", PLACES, ids=lambda p: f"{p.latitude}")
def test_from_a_place(place):
    when = instants(seed=int(place.latitude * 10) % 1000)
    time = theirs(when)
    frame = AltAz(obstime=time, location=where(place))
    for name, limit in (("sun", 5.0), ("moon", 20.0)):
        see = (lambda w: pa.Sun.at(w, place, refraction=False)) if name == "sun" else (
            lambda w: astro.moon(w, place, refraction=False)
        )  # fmt: skip
        seen = [see(w) for w in when]
        body = get_body(name, time, where(place)).transform_to(frame)
        error = arcseconds([s.direction for s in seen], local(body))
        print(f"{name} from {place.latitude}: median {np.median(error):.2f}″, worst {error.max():.2f}″")
        assert error.max() < limit
        away = np.array([s.distance for s in seen]) / body.distance.to_value(u.au if name == "sun" else u.km)
        assert np.abs(away - 1).max() < (1e-5 if name == "sun" else 2e-4)


def test_phase_and_limb():
    place = PLACES[2]
    when = instants(count=200)
    time = theirs(when)
    seen = [astro.moon(w, place, refraction=False) for w in when]
    frame = TETE(obstime=time, location=where(place))
    moon, sun = (get_body(n, time, where(place)).transform_to(frame) for n in ("moon", "sun"))
    to_moon, to_sun = (b.cartesian.xyz.to_value(u.km).T for b in (moon, sun))
    cosine = np.sum(-to_moon * (to_sun - to_moon), axis=-1)
    cosine /= np.linalg.norm(to_moon, axis=-1) * np.linalg.norm(to_sun - to_moon, axis=-1)
    phase = np.degrees(np.arccos(cosine))
    assert np.abs(phase - [s.phase_angle for s in seen]).max() < 0.01
    assert np.abs((1 + cosine) / 2 - [s.illuminated_fraction for s in seen]).max() < 1e-4
    # Away from full and new moon, where the limb has a direction.
    limb = moon.position_angle(sun).deg
    turned = (limb - [s.bright_limb for s in seen] + 180) % 360 - 180
    assert np.abs(turned[(phase > 10) & (phase < 170)]).max() < 0.05
    zenith = SkyCoord(np.zeros(200) * u.deg, np.full(200, 90) * u.deg, frame=AltAz(obstime=time, location=where(place)))
    parallactic = moon.position_angle(zenith.transform_to(frame)).deg
    turned = (limb - parallactic - [s.limb_from_zenith for s in seen] + 180) % 360 - 180
    high = np.array([s.elevation for s in seen]) < 80
    assert np.abs(turned[high & (phase > 10) & (phase < 170)]).max() < 0.1


@pytest.mark.parametrize("place", PLACES[2:], ids=lambda p: f"{p.latitude}")
def test_sidereal_time(place):
    when = instants(1972, 2025)  # measured; of later years only forecasts are in the table
    ours = np.array([astro.sidereal_time(w, place) for w in when])
    true = theirs(when).sidereal_time("apparent", longitude=place.longitude * u.deg).deg
    error = ((ours - true + 180) % 360 - 180) * 240
    print(f"sidereal time: worst {np.abs(error).max():.3f} s")
    assert np.abs(error).max() < 0.1


@pytest.mark.parametrize("year", [1950, 1975, 2000, 2024, 2050])
def test_stars(year):
    """From the same positions at J2000; proper motion, which the table does not have, is not judged here."""
    place = PLACES[2]
    when = datetime(year, 4, 17, 21, 30, tzinfo=UTC)
    ours = astro.stars(when, place, refraction=False).directions
    time = theirs([when])[0]
    # The table's own positions: those of a sky without precession, nutation, aberration and rotation.
    catalogue = icrs_of_the_table()
    sky = SkyCoord(catalogue[:, 0] * u.deg, catalogue[:, 1] * u.deg).transform_to(
        AltAz(obstime=time, location=where(place))
    )
    error = arcseconds(ours, local(sky))
    print(f"stars {year}: median {np.median(error):.2f}″, worst {error.max():.2f}″")
    assert error.max() < 20


def icrs_of_the_table():
    packed = np.frombuffer((Path(__file__).parents[2] / "src/astro/tables/stars.bin").read_bytes(), "<u8")
    north = (packed >> 19) & (2**22 - 1)
    return np.stack([(packed >> 41) / 2**23 * 360, north / 2**22 * 180 - 90], axis=-1)


# Hipparcos, ICRS at epoch and equinox 2000, from the printed Bright Star lists: name, right ascension, declination, V, B-V.
BRIGHT = [
    ("Sirius", "06h45m08.917s", "-16d42m58.02s", -1.44, 0.009),
    ("Vega", "18h36m56.336s", "+38d47m01.28s", 0.03, -0.001),
    ("Betelgeuse", "05h55m10.305s", "+07d24m25.43s", 0.45, 1.500),
    ("Polaris", "02h31m49.095s", "+89d15m50.79s", 1.97, 0.636),
    ("Antares", "16h29m24.460s", "-26d25m55.21s", 1.06, 1.865),
]


@pytest.mark.parametrize(("name", "right", "north", "magnitude", "b_v"), BRIGHT, ids=lambda x: str(x)[:10])
def test_bright_stars_stand_where_they_do(name, right, north, magnitude, b_v):
    place, when = PLACES[3], datetime(2000, 1, 1, 12, tzinfo=UTC)
    sky = SkyCoord(right, north).transform_to(AltAz(obstime=theirs([when])[0], location=where(place)))
    ours = astro.stars(when, place, refraction=False)
    error = arcseconds(ours.directions, local(sky))
    nearest = int(error.argmin())
    assert error[nearest] < 20
    assert ours.magnitudes[nearest] == pytest.approx(magnitude, abs=0.02)
    assert ours.b_v[nearest] == pytest.approx(b_v, abs=0.011)


def test_refraction():
    """erfa's model, at sea level in air of 15 °C."""
    place = pa.Place(0, 0)
    when = [datetime(2020, 3, 20, 6, tzinfo=UTC) + timedelta(minutes=3 * i) for i in range(118)]
    time = theirs(when)
    air = {"pressure": 1013.25 * u.hPa, "temperature": 15 * u.deg_C, "relative_humidity": 0.3, "obswl": 0.55 * u.um}
    sun = get_body("sun", time, where(place))
    lift = [sun.transform_to(AltAz(obstime=time, location=where(place), **a)).alt.deg for a in (air, {})]
    ours = np.array([[pa.Sun.at(w, place, r).elevation for w in when] for r in (True, False)])
    lift, ours, high = lift[0] - lift[1], ours[0] - ours[1], ours[1] > 10  # where erfa's own model holds
    assert high.sum() > 90
    error = np.abs(ours - lift)[high] * 3600
    print(f"refraction above 10°: worst {error.max():.1f}″, {np.max(np.abs(ours / lift - 1)[high]):.3f} of it")
    assert error.max() < 14
    assert ours[high] == pytest.approx(lift[high], rel=0.06)

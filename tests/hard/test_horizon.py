"""The horizon, the zenith and the ends of formulas: realistic_sky where its models break."""

import math
import warnings
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pleinair as pa
import pytest
from pleinair import DomainWarning, Place, Sun
from pleinair.astro import Moon
from pleinair.sky import CieGeneral, Natural, Preetham

UP = (0, 0, 1)
RADIUS = 6_360_000.0


def to(elevation, azimuth):
    return Sun(elevation, azimuth).direction


def luminance(sky, directions, method="fast"):
    return pa.color.luminance(sky.radiance(np.array(directions, float), method=method).astype(float))


def preetham(sun, turbidity=2.5):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DomainWarning)
        return Preetham(sun, turbidity)


def formulas(sun):
    return [*(CieGeneral(kind, sun) for kind in range(1, 16)), *(preetham(sun, t) for t in (1.8, 2.53, 6, 10))]


# ---- Turbidity.


@pytest.mark.parametrize("turbidity", [1, 1.20287, 1.25, 1.5, 1.64313, 1.79])
def test_preetham_below_its_turbidities_is_held_and_says_so(turbidity):
    # 1 + A e^B is 0 at 1.64313; B is 0 at 1.20287, below which e^(B / cos) overflows; luminance is negative to 1.75.
    with pytest.warns(DomainWarning, match=rf"turbidity {turbidity}.* is taken as 1\.8"):
        sky = Preetham(Sun(40, 10), turbidity)
    picture = sky.panorama(40)
    assert np.isfinite(picture).all()
    assert (pa.color.luminance(picture) > 0).all()
    assert picture.tobytes() == preetham(Sun(40, 10), 1.8).panorama(40).tobytes()


@pytest.mark.parametrize("turbidity", [1.8, 2, 4, 6, 10])
@pytest.mark.parametrize("elevation", [0, 1e-7, 5, 45, 90])
def test_preetham_is_positive_where_it_is_used(turbidity, elevation):
    picture = preetham(Sun(elevation, 123), turbidity).panorama(40)
    assert np.isfinite(picture).all()
    assert (pa.color.luminance(picture) > 0).all()


def test_preetham_warns_of_what_is_implausible_only():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for turbidity, elevation in ((2, 5), (6, 90), (2.53, 45)):
            Preetham(Sun(elevation), turbidity)
    # 76 000 cd/m² at the zenith for a turbidity of 10 (facts); Zotti et al. 2007 restrict it.
    for turbidity, text in ((6.1, r"outside \[2, 6\]"), (1.9, r"outside \[2, 6\]"), (11, "taken as 10"), (20, "as 10")):
        with pytest.warns(DomainWarning, match=text) as caught:
            Preetham(Sun(45), turbidity)
        assert len(caught) == 1
        assert caught[0].filename == __file__
    with pytest.warns(DomainWarning, match="Natural"):
        Preetham(Sun(4.9))
    for wrong in (0.99, 20.1, math.nan, -1):
        with pytest.raises(ValueError, match=r"turbidity must be in \[1, 20\]"):
            Preetham(Sun(45), wrong)


def test_turbidities_of_the_others():
    for wrong in (1.79, 10.1):
        with pytest.raises(ValueError, match=r"turbidity must be in \[1\.8, 10\]"):
            CieGeneral(12, Sun(45), turbidity=wrong)
    for turbidity in (1, 1.64313, 12):
        for day in ("preetham", 12):
            with pytest.warns(DomainWarning, match=r"\[1\.8, 10\]") as caught:
                sky = Natural(sun=Sun(45), day=day, turbidity=turbidity)
            assert caught[0].filename == __file__
            # Air of another turbidity takes a second to be followed.
            if turbidity == 1.64313:
                # Here Preetham's coefficients divide by zero; the formula is that of 1.8, as bright as its air at the zenith.
                seen = luminance(sky, [UP, to(1, 0), to(45, 90)])
                held = preetham(Sun(45), 1.8) if day == "preetham" else CieGeneral(12, Sun(45))
                want = luminance(held, [UP, to(1, 0), to(45, 90)])
                assert seen / seen[0] == pytest.approx(want / want[0], rel=1e-3)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            Natural(sun=Sun(45), turbidity=turbidity)


# ---- A Sun that is not up.


@pytest.mark.parametrize("elevation", [-1e-12, -4, -90])
def test_a_formula_refuses_a_sun_below_the_horizon_and_names_what_takes_it(elevation):
    for make in (Preetham, lambda sun: CieGeneral(12, sun), lambda sun: CieGeneral(5, sun)):
        with pytest.raises(ValueError, match=r"sun must not be below the horizon.*Natural"):
            make(Sun(elevation))
    ours, air = (luminance(Natural(sun=Sun(elevation), **day), [UP, to(1, 0)]) for day in ({"day": "preetham"}, {}))
    assert ours == pytest.approx(air, rel=1e-6)


def test_a_sun_is_between_nadir_and_zenith():
    for wrong in (-90.001, -100, 90.001, math.nan, math.inf):
        with pytest.raises(ValueError, match=r"elevation must be in \[-90, 90\]"):
            Sun(wrong)


@pytest.mark.parametrize(
    "sky",
    [CieGeneral(12, Sun(0, 50)), preetham(Sun(0, 50)), Natural(sun=Sun(0, 50))],
    ids=["cie", "preetham", "natural"],
)
@pytest.mark.filterwarnings("ignore:.*Natural hands over:pleinair.DomainWarning")
def test_a_sun_on_the_horizon(sky):
    picture = sky.panorama(64, tolerance=0.05)
    assert np.isfinite(picture).all()
    # Half of its disc is left, redder than Rec. 709 has: green and blue may be negative.
    light, whole = (
        float(pa.color.luminance(np.array(s.sun_light().irradiance))) for s in (sky, replace(sky, sun=Sun(0.2666, 50)))
    )
    # Half of the disc, through more air than any of the whole one; without a turbidity a CIE sky has no disc.
    assert light == whole == 0 if isinstance(sky, CieGeneral) else 0.01 * whole < light < 0.5 * whole


# ---- The horizon of the formulas.


@pytest.mark.parametrize("sky", formulas(Sun(35, 60)), ids=range(19))
def test_gradation_has_its_limit_at_the_horizon(sky):
    for azimuth in (60, 61, 150, 240):
        edges = [to(math.degrees(e), azimuth) for e in (1e-5, 1e-6, 1e-9, 1e-12, 1e-300)]
        flat = (math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth)), 0.0)
        below = [(*flat[:2], z) for z in (-0.0, -1e-300, -1e-9, -1e-6, -0.5)]
        for method in ("reference", "fast"):
            seen = luminance(sky, [flat, *edges, *below], method)
            assert np.isfinite(seen).all()
            # The indicatrix of type 15 changes by 4e-5 on the way to a cosine of 1e-5, the gradation not at all.
            assert seen == pytest.approx(seen[0], rel=4e-5), (azimuth, method)
    assert np.isfinite(sky.radiance([(0, 0, -1), (1e-20, 0, -1)])).all()
    assert np.isfinite(sky.radiance([(0, 0, -1), (1e-20, 0, -1)], method="reference")).all()


@pytest.mark.parametrize("kind", range(1, 16))
def test_the_limit_at_the_horizon_is_the_indicatrix(kind):
    # phi is 1 at cos = 0: of the printed formula only f is left, over both at the zenith.
    a, b, c, d, e = pa_types()[kind - 1]
    f = lambda g: 1 + c * (math.exp(d * g) - math.exp(d * math.pi / 2)) + e * math.cos(g) ** 2
    sky = CieGeneral(kind, Sun(60, 0), zenith_luminance=1.0)
    for azimuth in (0, 90, 180):
        g = math.acos(math.cos(math.radians(azimuth)) * 0.5)
        want = f(g) / (f(math.radians(30)) * (1 + a * math.exp(b)))
        flat = (math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth)), 0)
        assert luminance(sky, [flat], "reference")[0] == pytest.approx(want, rel=1e-9)
        assert luminance(sky, [flat])[0] == pytest.approx(want, rel=1e-5)


def pa_types():
    """The table of CIE S 011/E:2003."""
    rows = """4,-.7,0,-1,0|4,-.7,2,-1.5,.15|1.1,-.8,0,-1,0|1.1,-.8,2,-1.5,.15|0,-1,0,-1,0|0,-1,2,-1.5,.15|0,-1,5,-2.5,.3
0,-1,10,-3,.45|-1,-.55,2,-1.5,.15|-1,-.55,5,-2.5,.3|-1,-.55,10,-3,.45|-1,-.32,10,-3,.45|-1,-.32,16,-3,.3
-1,-.15,16,-3,.3|-1,-.15,24,-2.8,.15"""
    return [[float(v) for v in row.split(",")] for row in rows.replace("\n", "|").split("|")]


# ---- Looking at the Sun.


@pytest.mark.parametrize("seed", range(6))
def test_a_view_into_the_sun_has_an_angle(seed):
    # The arc cosine of a rounded product is NaN for 3.7 % of these.
    rng = np.random.default_rng(seed)
    sun = Sun(float(rng.uniform(0, 90)), float(rng.uniform(0, 360)))
    at = np.array(sun.direction)
    many = np.concatenate([
        at * rng.uniform(0.1, 10, (50_000, 1)),
        at + rng.normal(scale=3e-16, size=(30_000, 3)),
        at + 10 ** rng.uniform(-9, -3, (20_000, 1)) * rng.normal(size=(20_000, 3)),
    ])  # fmt: skip
    plain = [Natural(sun=sun), Natural(sun=sun, day=12)] if seed < 2 else []
    for sky in (CieGeneral(15, sun), CieGeneral(12, sun, turbidity=2.5), preetham(sun), *plain):
        seen = sky.radiance(many)
        assert np.isfinite(seen).all()
        if not isinstance(sky, Natural):
            exact = sky.radiance(many, method="reference")
            assert np.isfinite(exact).all()
            assert np.abs(seen / exact - 1).max() < 1e-4


# ---- The zenith.


@pytest.mark.parametrize("off", [0, 1e-7, 1e-13])
def test_sun_and_moon_in_the_zenith(off):
    ring = np.array([to(20, a) for a in range(0, 360, 7)])
    sun, moon = Sun(90 - off, 77), Moon(90 - off, 203)
    for sky in (*formulas(sun), Natural(sun=sun), Natural(sun=Sun(-40), moon=moon), Natural(sun=sun, day="preetham")):
        seen = luminance(sky, ring)
        assert np.ptp(seen) < 2e-4 * seen.mean(), sky
        for picture in (sky.panorama(33), sky.render(pa.Camera.fisheye(33)), sky.render(pa.Camera(9, 9, elevation=90))):
            assert np.isfinite(picture).all()
    lit = Natural(sun=sun)
    assert luminance(lit, [UP])[0] > 1e8, "the disc is there"
    assert luminance(lit, [to(89.9, 200)])[0] > 1e8
    assert luminance(lit, [to(89.6, 200)])[0] < 1e6
    moonlit = Natural(sun=Sun(-40), moon=moon)
    assert luminance(moonlit, [UP])[0] > 1000
    # A full Moon gives 0.26 lx above the air (facts), a tenth of which is lost on the way down.
    assert pa.color.luminance(np.array(moonlit.moon_light().irradiance)) == pytest.approx(0.24, rel=0.05)


def test_a_disc_in_the_zenith_has_its_light_in_a_panorama():
    # Every column of the first row holds a part of it.
    sky = Natural(sun=Sun(90))
    for height in (32, 64, 301, 800):
        disc = pa.color.luminance(sky.panorama(height).astype(float) - sky.without_disc().panorama(height))
        step = math.pi / height
        rows = 2 * math.sin(step / 2) * np.sin((np.arange(height) + 0.5) * step) * step
        got = (disc * rows[:, None]).sum()
        assert got == pytest.approx(float(pa.color.luminance(np.array(sky.sun_light().irradiance))), rel=0.01), height


# ---- The horizon of the air.


@pytest.mark.parametrize("altitude", [0, 0.5, 2, 10, 1700, 15_000])
@pytest.mark.parametrize("sun", [Sun(25, 90), Sun(-3, 90)], ids=["day", "twilight"])
def test_sky_ends_where_the_earth_does(altitude, sun):
    # h(2R + h), not (R + h)² - R²: in single precision that is 32 % off for an eye half a metre up.
    sky = Natural(sun=sun, altitude=altitude, discs=False, ground_albedo=0.9)
    dip = math.degrees(math.acos(RADIUS / (RADIUS + altitude)))
    for azimuth in (90, 180, 270):
        near = 1e-5 if altitude else 1e-9
        edge = [to(-dip + d, azimuth) for d in (0.02, 0.01, near, -near, -0.01, -0.02)]
        seen = luminance(sky, edge)
        assert np.isfinite(seen).all()
        assert seen[2] == pytest.approx(2 * seen[1] - seen[0], rel=0.03), "sky to its edge"
        assert seen[3] == pytest.approx(2 * seen[4] - seen[5], rel=0.2), "ground from its edge"


@pytest.mark.parametrize("altitude", [0, 0.5, 2, 10, 15_000])
def test_no_white_stripe(altitude):
    dip = math.degrees(math.acos(RADIUS / (RADIUS + altitude)))
    for sun in (Sun(25, 90), Sun(2, 0), Sun(-3, 0)):
        sky = Natural(sun=sun, altitude=altitude, discs=False)
        camera = pa.Camera(2, 400, 0.4, elevation=-dip)
        seen = pa.color.luminance(sky.render(camera)).astype(float)
        assert np.ptp(seen, axis=1).max() < 1e-3 * seen.max(), "rows are of one height"
        row = seen[:, 1]
        # One edge at most, after which the ground goes on in the same sense, as it comes nearer: a stripe would turn back.
        step = np.diff(np.log(row))
        edge = step[np.abs(step) > 0.02]
        assert len(set(np.sign(edge))) <= 1, edge
        assert np.flatnonzero(np.abs(step) > 0.02).tolist() == list(range(199, 199 + len(edge)))


def test_an_observer_up_to_15_km():
    for altitude in (0, 15_000):
        for elevation in (90, 3, 0, -5, -12, -30, -90):
            sky = Natural(sun=Sun(elevation), moon=Moon(10, 90), altitude=altitude)
            seen = sky.radiance([UP, to(3, 0), to(0, 0), to(-2, 0), to(-3.5, 90), (0, 0, -1)])
            assert np.isfinite(seen).all()
            assert (luminance(sky, [UP, to(3, 0)]) > 0).all()
    for wrong in (-1, 15_001, math.nan):
        with pytest.raises(ValueError, match=r"altitude must be in \[0, 15000\] \[m\]"):
            Natural(sun=Sun(0), altitude=wrong)
    when = datetime(2024, 6, 20, 12, tzinfo=UTC)
    # The Dead Sea is on the ground; a balloon is higher than this sky goes, which is said.
    low, shore = (luminance(Natural(when, Place(31.5, 35.5, height)), [UP]) for height in (-430, 0))
    assert low == pytest.approx(shore, rel=1e-4), "but for the parallax of the Moon and the Sun"
    with pytest.warns(DomainWarning, match="altitude"):
        Natural(when, Place(48.8, 2.3, 30_000))


def test_an_equirectangular_zenith_is_one_direction():
    sky = Natural(sun=Sun(30, 100))
    top = sky.panorama(512)[0]
    assert np.ptp(top, axis=0).max() < 0.01 * top.max()

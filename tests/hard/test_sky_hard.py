"""Skies where something is zero, huge, on an edge, or passed by mistake."""

import itertools
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.sky import Aoas, CloudPoints, CloudSpline, Principle, contact_sheet, from_json, mix, preset

SUN = pa.Sun(30, 180)
SKY = Aoas(sun=SUN)
CAMERA = pa.Camera(40, 28, fov=80, azimuth=180, elevation=25)


def directions(count, seed=0):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d[::3, 2] *= 0.02  # near the horizon
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def rel(a, b, floor=0.0):
    return float((np.abs(np.asarray(a, float) - b) / (np.abs(b) + floor)).max())


# ---- The sun anywhere.


@pytest.mark.parametrize("elevation", [90, 0, -0.01, -5, -20, -90])
def test_the_sun_at_an_edge(elevation):
    for changes in ({}, {"disc": 2.0, "viewer": (0, 0, 0.3), "ground": (0.1, 0.2, 0.3)}, {"shadow": False}):
        sky = Aoas(sun=pa.Sun(elevation), **changes)
        d = directions(1100)
        fast, few = sky.radiance(d), sky.radiance(d[:64])
        assert np.isfinite(fast).all()
        assert (fast >= 0).all()
        if elevation == -20 and not sky.shadow:
            continue  # test_the_reference_ends_without_a_shadow_too
        exact = sky.radiance(d[:64], method="reference")
        # Sky or ground is told apart in float32.
        clear = np.abs(d[:64, 2] + np.sqrt(1 - (40 / (40 + sky.viewer[2])) ** 2)) > 1e-6
        assert rel(few[clear], exact[clear], 1e-6 * fast.max() + 1e-30) < 2e-4
        if elevation >= 0:
            assert rel(fast[:64][clear], exact[clear], 1e-3 * fast.max()) < 1e-3
        else:
            assert np.abs(fast[:64] - exact)[clear].max() <= 5e-3 * fast.max()
    if elevation <= -20:
        # Towards a low horizon a ray leaves the shadow later than a sunset: at -20 it still meets light.
        assert not Aoas(sun=pa.Sun(elevation)).panorama(32)[: 5 if elevation == -20 else 32].any()


def test_the_sun_in_the_zenith_shines_the_same_all_round():
    for elevation in (90, 90 - 1e-9, 90 - 1e-5):
        ring = np.array([pa.Sun(20, a).direction for a in range(0, 360, 7)])
        for few in (ring, np.concatenate([ring] * 21)):
            seen = Aoas(sun=pa.Sun(elevation, 77)).radiance(few)
            assert rel(seen, seen.mean(0, dtype=float)) < 1e-5


def test_no_degree_of_the_sun_gives_nan():
    camera = pa.Camera(46, 24, fov=150, azimuth=0, elevation=0)
    for elevation in range(-90, 91):
        assert np.isfinite(Aoas(sun=pa.Sun(elevation)).render(camera, tolerance=0.05)).all(), elevation
    zenith = [Aoas(sun=pa.Sun(e)).radiance([0, 0, 1])[2] for e in range(-13, 91)]
    assert np.isfinite(zenith).all()
    assert (np.diff(zenith[:13]) >= 0).all()


@pytest.mark.parametrize("g", [0.999, -0.999, 0.9999, 0.0])
def test_a_view_into_the_sun(g):
    sky = Aoas(sun=SUN, g=g, mie=0.01)
    to = np.array(SUN.direction) * (1 if g >= 0 else -1)
    for towards in (to, np.nextafter(to, 2), to * 3):
        exact = sky.radiance(towards, method="reference")
        assert np.isfinite(exact).all()
        assert rel(sky.radiance(towards), exact) < 1e-4
        many = np.concatenate([towards[None], directions(1100)])
        assert rel(sky.radiance(many)[0], exact) < 1e-3
    if to[2] < 0:
        # Below the horizon molecules keep the horizon's phase: no common factor.
        return
    # Its peak, 1.5 (1 - g^2) / (2 + g^2) * 2 / (1 - g)^3, is there.
    k = abs(g)
    peak = 3 * (1 - k * k) / (2 + k * k) / (1 - k) ** 3
    mie = sky.radiance(to, method="reference") - Aoas(sun=SUN, g=0.0, mie=0.01).radiance(to, method="reference")
    flat = Aoas(sun=SUN, g=0.0, mie=0.01).radiance(to, method="reference")
    share = 0.01 / (0.01 + np.array(sky.rayleigh))
    assert rel(mie, flat * share * (peak / 1.5 - 1), 1e-12) < 1e-5


# ---- The horizon and the viewer.


@pytest.mark.parametrize("viewer", [(0, 0, 0), (0, 0, 0.3)])
@pytest.mark.parametrize("elevation", [40, 1, -3])
def test_nothing_jumps_at_the_horizon(viewer, elevation):
    sky = Aoas(sun=pa.Sun(elevation, 90), viewer=viewer, g=0.5)
    dip = -np.degrees(np.arccos(40 / (40 + viewer[2])))
    for azimuth in (0, 90, 200):
        d = np.array([pa.Sun(dip + np.degrees(e), azimuth).direction for e in (-1e-6, -1e-9, 0, 1e-9, 1e-6)])
        for seen in (sky.radiance(d), sky.radiance(d, method="reference"), sky.radiance(np.tile(d, (230, 1)))[:5]):
            assert np.ptp(seen, axis=0).max() < 1e-4 * seen.max() + 1e-12


def test_the_viewer_at_the_rim_and_beyond():
    ground = (0.1, 0.2, 0.3)
    for place in ((1, 0, 0), (0, 0, 1), (0, 0, 1 - 1e-9), (0, 0, 1 + 1e-9), (0.6, 0, 0.8), (0, 0, 3), (0, 0, 1e6)):
        for apex in ("constant", "radial"):
            sky = Aoas(sun=SUN, viewer=place, apex=apex, ground=ground)
            many, exact = sky.radiance(directions(1100)), sky.radiance(directions(1100)[:30], method="reference")
            # Sky or ground is told apart in float32.
            clear = np.abs(directions(1100)[:30, 2]) > 1e-3
            assert rel(many[:30][clear], exact[clear], 1e-3 * many.max() + 1e-30) < 2e-3, (place, apex)
            assert np.isfinite(sky.fragments(directions(30))).all()
    # From above the air space is black, and the ground is seen through all of it.
    sky = Aoas(sun=SUN, viewer=(0, 0, 3), ground=ground)
    assert not sky.radiance([0, 0, 1]).any()
    assert not sky.radiance([0, 1, 0.1], method="reference").any()
    down = sky.radiance([0, 0, -1], method="reference")
    rim = Aoas(sun=SUN, viewer=(0, 0, 1), ground=ground).radiance([0, 0, -1], method="reference")
    assert rel(down, rim) < 1e-7
    assert (down > np.array(ground) * np.exp(-4 * np.pi * 0.25 * (np.array(sky.rayleigh) + 0.001))).all()
    # No jump where one leaves the air.
    for view in ((0, 0, -1), (0, 1, -0.5), (1, 0, -0.3)):
        inner, outer = (Aoas(sun=SUN, viewer=(0, 0, 1 + e), ground=ground) for e in (-1e-9, 1e-9))
        assert rel(inner.radiance(view, method="reference"), outer.radiance(view, method="reference")) < 1e-6


def test_a_viewer_below_the_ground_is_told_and_put_on_it():
    with pytest.warns(pa.DomainWarning, match="below the ground"):
        low = Aoas(sun=SUN, viewer=(0, 0, -0.5))
    assert rel(low.render(CAMERA), SKY.render(CAMERA).astype(float)) < 1e-6


def test_no_warning_where_the_round_ground_is_lower_still():
    # Eq 2: |(1, 0, 40 - 0.001)| is 40.0115, above the ground of radius 40.
    sky = Aoas(sun=SUN, viewer=(1, 0, -0.001))
    assert sky.radiance([0, 0, 1]).any()


def earth(height, sun=20):
    return Aoas(
        sun=pa.Sun(sun, 90), radius_ratio=106, dome_radius=60e3, viewer=(0, 0, height), scale_height=0.133,
        mie_scale_height=0.02, ground=(0.1, 0.1, 0.1),
    )  # fmt: skip


def from_the_horizon(height, steps):
    dip = -np.degrees(np.arccos(1 / (1 + height / (106 * 60e3))))
    return np.array([pa.Sun(dip + e, 90 + a).direction for e in steps for a in (2, 90, 180)])


@pytest.mark.parametrize("height", [0.5, 2.0, 1e-3])
def test_half_a_metre_above_an_earth(height):
    sky = earth(height)
    around = from_the_horizon(height, (-40, -1, 0.001, 0.02, 0.3, 5, 60))
    exact = sky.radiance(around, method="reference")
    assert rel(sky.radiance(np.concatenate([around, directions(1100)]))[: len(around)], exact) < 1e-3
    assert rel(sky.radiance(around), exact) < 1e-4
    # It is next to nothing of 60 km: the sky is that of the ground.
    assert rel(exact[12:], earth(0).radiance(around[12:], method="reference")) < 2e-2


def test_the_ground_just_below_the_horizon():
    around = from_the_horizon(0.5, (-0.02, -0.005))
    exact = earth(0.5).radiance(around, method="reference")
    assert rel(earth(0.5).radiance(np.concatenate([around, directions(1100)]))[: len(around)], exact) < 1e-3


# ---- Strange air.


def test_air_of_zero_and_of_lead():
    for rayleigh in ((0, 0, 0), (0, 0.02, 1000), (1000, 1000, 1000), (1e-12, 1, 100)):
        for elevation in (90, 20, 0, -3):
            for viewer in ((0, 0, 0), (0, 0, 0.9)):
                sky = Aoas(sun=pa.Sun(elevation, 45), rayleigh=rayleigh, mie=0.0, viewer=viewer)
                fast = sky.radiance(directions(1100)).astype(float)
                assert np.isfinite(fast).all()
                assert not fast[:, np.array(rayleigh) == 0].any()
                if viewer == (0, 0, 0):
                    some = directions(1100)[:12]
                    exact = sky.radiance(some, method="reference")
                    assert np.isfinite(exact).all()
                    assert rel(sky.radiance(some), exact, 1e-6 * max(fast.max(), 1e-30)) < 1e-3
    one = Aoas(sun=SUN, sun_intensity=1.0).render(CAMERA).astype(float)
    for light in (0.0, 1e30):
        np.testing.assert_allclose(Aoas(sun=SUN, sun_intensity=light).render(CAMERA), light * one, rtol=1e-5)


def ends(sky, view):
    """Return the largest channel of the reference in a process that may take three seconds."""
    code = f"import pleinair as p; s = p.sky.Aoas({sky}); print(max(s.radiance(p.Sun({view}).direction, method='reference')))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=3, check=True)
    return float(run.stdout)


def test_the_reference_ends_where_nothing_is_seen():
    assert 0 <= ends("p.Sun(0), rayleigh=(1000,) * 3, mie=0.0, viewer=(0, 0, 0.9)", "10, 30") < 1e-20


def test_the_reference_ends_without_a_shadow_too():
    assert 0 <= ends("p.Sun(-20), shadow=False", "1, 84") < 1e-14


def test_clouds_over_a_black_sky_are_black():
    sky = preset("smiley", rayleigh=(0, 0, 0), mie=0.0, cloud_complexity=3.0, ambiguity=0.1)
    assert not sky.render(CAMERA).any()
    sky.irradiance([0, 0, 1])
    assert np.isnan(sky.probe([0, 0, 1]).xy).all()


REFUSED = [
    ("rayleigh", {"rayleigh": (-0.1, 0, 0)}),
    ("rayleigh", {"rayleigh": (0, 0, 1001)}),
    ("rayleigh", {"rayleigh": 0.01}),
    ("g", {"g": 1.0}),
    ("scale_height", {"scale_height": 0.001}),
    ("ground", {"ground": "black"}),
    ("ground", {"ground": (0, -1, 0)}),
    ("apex", {"apex": "up"}),
    ("samples", {"samples": 0}),
    ("samples", {"samples": 2.5}),
    ("sun", {"sun": (45, 180)}),
    ("disc", {"disc": 31}),
    ("dome_radius", {"dome_radius": 0}),
    ("shapes", {"shapes": [(0, 0, 1)]}),
    ("principles", {"principles": [print]}),
    ("rng", {"rng": "seed"}),
]
NUMBERS = ["mie", "g", "sun_intensity", "radius_ratio", "scale_height", "mie_scale_height", "thickness", "dome_radius"]
NUMBERS += ["disc", "ambiguity", "grain", "cloud_complexity"]
for bad, name in itertools.product((np.nan, np.inf, -np.inf), NUMBERS):
    REFUSED.append((name, {name: bad}))
for bad, name in itertools.product((np.nan, np.inf), ("rayleigh", "viewer", "dome_center", "ground")):
    REFUSED.append((name, {name: (0, bad, 0)}))


@pytest.mark.parametrize(("name", "changes"), REFUSED, ids=[f"{i}-{name}" for i, (name, _) in enumerate(REFUSED)])
def test_a_wrong_parameter_is_named(name, changes):
    with pytest.raises((ValueError, TypeError), match=rf"^{name} "):
        Aoas(**{"sun": SUN, **changes})


COUNT = itertools.count()


def wrong(name, call, *marks):
    return pytest.param(name, call, marks=marks, id=f"{next(COUNT)}-{name}")


WRONG = [
    wrong("directions", lambda: SKY.radiance([[0, 0, 1], [0, 0, 0]])),
    wrong("directions", lambda: SKY.radiance([[0, np.nan, 1]], method="reference")),
    wrong("directions", lambda: SKY.radiance([[0, np.inf, 1]])),
    wrong("directions", lambda: SKY.radiance(np.ones((3, 2)))),
    wrong("directions", lambda: SKY.radiance(1.0)),
    wrong("directions", lambda: SKY.radiance("up")),
    wrong("directions", lambda: replace(SKY, principles=[Principle()]).radiance([0, 0, 0])),
    wrong("directions", lambda: SKY.fragments([0, 1])),
    wrong("directions", lambda: SKY.fragments([0, 0, 0])),
    wrong("directions", lambda: SKY.fragments([0, np.nan, 0])),
    wrong("direction", lambda: SKY.probe([[0, 0, 1]])),
    wrong("normals", lambda: SKY.irradiance([0, 0, 0])),
    wrong("normals", lambda: SKY.irradiance([0, np.nan, 1])),
    wrong("method", lambda: SKY.render(CAMERA, method="exact")),
    wrong("tolerance", lambda: SKY.render(CAMERA, tolerance=np.nan)),
    wrong("tolerance", lambda: SKY.radiance([0, 0, 1], tolerance=0)),
    wrong("camera", lambda: SKY.render(None)),
    wrong("camera", lambda: SKY.seen_by(SKY)),
    wrong("height", lambda: SKY.panorama(0)),
    wrong("height", lambda: SKY.panorama(16385)),
    wrong("height", lambda: SKY.panorama(4.0)),
    wrong("progress", lambda: SKY.render(CAMERA, progress=3)),
    wrong("points", lambda: CloudPoints([])),
    wrong("points", lambda: CloudPoints([(0, 0, 0)])),
    wrong("points", lambda: CloudSpline([(0, 0, np.inf)])),
    wrong("points", lambda: CloudSpline((0, 0, 1))),
    wrong("radius", lambda: CloudPoints([(0, 0, 1)], 0)),
    wrong("radius", lambda: CloudSpline([(0, 0, 1)], np.nan)),
    wrong("name", lambda: preset("pink")),
    wrong("t", lambda: mix(SKY, SKY, np.nan)),
    wrong("sky_b", lambda: mix(SKY, None, 0.5)),
    wrong("text", lambda: from_json("{")),
    wrong("text", lambda: from_json('{"kind": "aoas", "sun": {"elevation": 3}, "haze": 2}')),
    wrong("text", lambda: from_json('{"kind": "aoas", "sun": {"elevation": 300}}')),
    wrong("mie", lambda: from_json('{"kind": "aoas", "sun": {"elevation": 30}, "mie": NaN}')),
    wrong("text", lambda: from_json(3)),
    wrong("exposure", lambda: contact_sheet(SKY, elevation=[5], exposure=-1)),
    wrong("elevation", lambda: contact_sheet(SKY, elevation=["low"])),
    wrong("camera", lambda: contact_sheet(SKY, elevation=[5], camera=3)),
    wrong("gap", lambda: contact_sheet(SKY, elevation=[5, 6], gap=1.5)),
    wrong("gap", lambda: contact_sheet(SKY, elevation=[5, 6], gap=-4)),
    wrong("elevation", lambda: contact_sheet(SKY, elevation=5)),
    wrong("shapes", lambda: Aoas(sun=SUN, shapes=CloudPoints([(0, 0, 1)]))),
    wrong("principles", lambda: Aoas(sun=SUN, principles=Principle())),
    wrong("rng", lambda: Aoas(sun=SUN, rng=True)),
    wrong("shadow", lambda: Aoas(sun=SUN, shadow="no")),
    wrong("rgb", lambda: pa.tone.to_uint8([0.1, np.nan])),
    wrong("rgb", lambda: pa.tone.oneil([1, 2])),
]


@pytest.mark.parametrize(("name", "call"), WRONG)
def test_a_wrong_argument_is_named(name, call):
    with pytest.raises((ValueError, TypeError), match=rf"^{name}\b"):
        call()


def test_a_seed_of_numpy_is_a_seed():
    assert preset("noon", rng=np.int64(4)) == preset("noon", rng=4)


# ---- Patterns at their ends.


def test_neighbourhoods_of_nothing_and_beyond_the_dome():
    assert np.array_equal(replace(SKY, ambiguity=0.0, grain=0.3, rng=5).render(CAMERA), SKY.render(CAMERA))
    for size, grain, viewer in itertools.product((1e-9, 2.5, 1000), (1e-5, 10), ((0, 0, 0), (0, 0, 1), (0, 0, 5))):
        assert np.isfinite(replace(SKY, ambiguity=size, grain=grain, viewer=viewer).render(CAMERA)).all()
    for complexity, viewer in itertools.product((1e-9, 1e4), ((0, 0, 0), (0, 0, 5), (0, 0, 1e6))):
        assert np.isfinite(replace(SKY, cloud_complexity=complexity, viewer=viewer).render(CAMERA)).all()


SPLINES = {
    "one point": [(0, -1, 0.5)],
    "repeated": [(0, -1, 0.5)] * 4,
    "repeated amid": [(0.5, -1, 0.5), (0, -1, 0.5), (0, -2, 1), (-0.5, -1, 0.5)],
    "through the zenith": [(0, 1, 1), (0, 0, 1), (0, -1, 1)],
    "opposite": [(0, -1, 0.5), (0, 1, -0.5)],
    "all ways": [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)],
}


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("name", SPLINES)
def test_odd_splines_pass_their_points(name, closed):
    sky = replace(SKY, shapes=[CloudSpline(SPLINES[name], 0.3, closed)])
    assert np.isfinite(sky.panorama(24)).all()
    at = sky.radiance(SPLINES[name])
    assert np.ptp(at, axis=-1).max() < 1e-3 * at.max(), "grey where the spline passes"


def test_a_spline_of_one_point_is_that_point():
    for points in (SPLINES["one point"], SPLINES["repeated"]):
        spline, point = (replace(SKY, shapes=[s]) for s in (CloudSpline(points, 0.3), CloudPoints(points[:1], 0.3)))
        assert np.array_equal(spline.render(CAMERA), point.render(CAMERA))


# ---- Arrays of every kind.


def test_pictures_and_lists_of_next_to_nothing():
    assert SKY.render(pa.Camera(1, 1)).shape == (1, 1, 3)
    assert SKY.panorama(1).shape == (1, 2, 3)
    for sky, method in itertools.product((SKY, replace(SKY, principles=[Principle()])), ("fast", "reference")):
        for shape in ((0, 3), (0, 4, 3), (5, 0, 3)):
            assert sky.radiance(np.empty(shape), method=method).shape == shape
    assert SKY.irradiance(np.empty((0, 3))).shape == (0, 3)
    assert pa.tone.to_uint8(np.empty((0, 3))).shape == (0, 3)


def test_any_array_of_directions_will_do():
    d = directions(1200).reshape(30, 40, 3)
    want = SKY.radiance(d)
    wide = np.zeros((30, 80, 6))
    wide[:, ::2, ::2] = d
    locked = d.copy()
    locked.setflags(write=False)
    for same in (
        wide[:, ::2, ::2],
        np.asfortranarray(d),
        locked,
        d.tolist(),
        d.astype(">f8"),
        d[::-1, ::-1][::-1, ::-1],
    ):
        assert np.array_equal(SKY.radiance(same), want)
    single = SKY.radiance(d.astype(np.float32))
    assert rel(single, SKY.radiance(d.astype(np.float32).astype(float))) == 0
    whole = np.array([(0, 0, 1), (3, -2, 1), (0, 5, 2)])
    for dtype in (np.int8, np.int64, np.float16):
        assert np.array_equal(SKY.radiance(whole.astype(dtype)), SKY.radiance(whole.astype(float)))
    before = d.copy()
    preset("turbulent").radiance(d)
    preset("turbulent").radiance(d[:1], method="reference")
    replace(SKY, principles=[Principle()]).radiance(d)
    SKY.irradiance(d[0])
    assert np.array_equal(d, before)


@pytest.mark.parametrize("scale", [1e-310, 1e-200, 1e-30, 7.0, 1e200, 1e307])
def test_directions_of_any_length_will_do(scale):
    d = directions(1100)
    for method, some in (("fast", d), ("fast", d[:20]), ("reference", d[:20])):
        assert rel(SKY.radiance(some * scale, method=method), SKY.radiance(some, method=method).astype(float)) < 1e-6


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1e30, 1e200])
def test_fragments_normals_and_points_of_any_length_will_do(scale):
    d = directions(20)
    drawn = replace(SKY, shapes=[CloudPoints(d[:3], 0.5)]).radiance(d)
    problems = []
    with np.errstate(all="ignore"):
        for name, call in {
            "fragments": lambda: rel(SKY.fragments(d * scale), SKY.fragments(d)) < 1e-9,
            "points": lambda: np.allclose(replace(SKY, shapes=[CloudPoints(d[:3] * scale, 0.5)]).radiance(d), drawn),
            "normals": lambda: rel(SKY.irradiance(d * scale), SKY.irradiance(d)) < 1e-9,
        }.items():
            try:
                problems += [] if call() else [name]
            except ValueError as error:
                problems.append(f"{name}: {error}")
    assert not problems


def test_levels_of_infinities_need_no_warning():
    assert pa.tone.to_uint8([np.inf, 0.0]).tolist() == [255, 0]
    assert pa.tone.oneil(np.array([np.inf], np.float32)).tolist() == [1]
    assert pa.tone.to_uint8([[-np.inf, -1.0], [2.0, 1e30]]).tolist() == [[0, 0], [255, 255]]


def test_levels_of_both_infinities_need_no_warning():
    assert pa.tone.to_uint8([np.inf, -np.inf]).tolist() == [255, 0]

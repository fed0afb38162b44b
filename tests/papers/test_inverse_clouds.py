"""Dobashi et al. 2012 against its printed equations: a plain numpy march, closed forms, histograms, and the search."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pleinair as pa
import pytest
from pleinair.clouds import Basis, Conventions, Params, Volume, render

EXACT = {"ambient": 0.0, "albedo": 1.0, "g": 0.0}  # p = 1: what is scattered once is J itself


# ---- The paper's equations in numpy, from the print; nothing is shared with the product but cameras and numbers.


def trilinear(cloud):
    """Density at world points: texel centres at i + 0.5, clamped to the box, zero outside."""
    padded = np.pad(cloud.density.astype(np.float64), 1, mode="edge")
    top = np.array(cloud.density.shape)[::-1]
    low, size = np.array(cloud.origin), np.array(cloud.voxel_size)
    flat, row = padded.ravel(), padded.shape[2]
    plane = row * padded.shape[1]

    def at(points):
        q = (points - low) / size
        inside = ((q >= 0) & (q <= top)).all(-1)
        q = np.clip(q, 0, top) + 0.5
        i = np.minimum(q.astype(np.int64), top)
        x, y, z = np.moveaxis(q - i, -1, 0)
        k = i[..., 0] + row * i[..., 1] + plane * i[..., 2]

        def along_x(o):
            return flat[k + o] * (1 - x) + flat[k + o + 1] * x

        def along_y(o):
            return along_x(o) * (1 - y) + along_x(o + row) * y

        return np.where(inside, along_y(0) * (1 - z) + along_y(plane) * z, 0.0)

    return at


def span(cloud, points, directions):
    low, high = cloud.bounds
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - points) / directions, (high - points) / directions
    near = np.fmax(np.nanmax(np.minimum(a, b), -1), 0)
    return near, np.maximum(np.nanmin(np.maximum(a, b), -1), near)


def optical_path(cloud, at, points, direction, steps):
    near, far = span(cloud, points, direction)
    h = (far - near) / steps
    total = np.zeros(len(points))
    for rows in np.array_split(np.arange(len(points)), max(1, len(points) * steps // 300_000)):
        t = near[rows, None] + (np.arange(steps) + 0.5) * h[rows, None]
        total[rows] = at(points[rows, None] + direction * t[..., None]).sum(1)
    return total * h


def march(cloud, camera, sun, sigmas, steps, sun_steps, pixels=None):
    """J and S of eq 5 by the midpoint rule, both legs marched; `pixels` selects from the flat picture."""
    at = trilinear(cloud)
    d = camera.directions().reshape(-1, 3)
    d = d if pixels is None else d[pixels]
    eye = np.broadcast_to(np.array(camera.position), d.shape)
    near, far = span(cloud, eye, d)
    h = (far - near) / steps
    x = eye[:, None] + d[:, None] * (near[:, None] + (np.arange(steps) + 0.5) * h[:, None])[..., None]
    rho = at(x) * h[:, None]
    depth = np.cumsum(rho, 1) - rho / 2
    lit, toward = rho > 0, np.array(sun.direction)
    to_sun = np.zeros_like(rho)
    to_sun[lit] = optical_path(cloud, at, x[lit], toward, sun_steps)
    return np.stack([(s * rho * np.exp(-s * (depth + to_sun))).sum(1) for s in sigmas]), rho.sum(1)


def hg(g, cosine):
    return (1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5


def eqs_3_to_9(p, j, s, cosine, sky, distance=1.0):
    """The picture of `p`: eq 5 with an ambient term of extinction, eq 9, eq 4 and eq 3."""
    color = np.array(p.light_color)
    through = np.exp(-p.sigma_t * s)[..., None]
    single = color * (p.light_intensity * p.albedo * hg(p.g, cosine) * j)[..., None]
    cloud = single + color * p.ambient * (1 - through) + through * sky
    clear = np.exp(-np.array(p.haze) * np.asarray(distance)[..., None])
    return cloud * clear + (1 - clear) * sky, single


def rel(a, b):
    return float(np.linalg.norm(np.asarray(a, float) - b) / np.linalg.norm(b))


def smooth_cloud(shape=(10, 12, 14), seed=4):
    rng = np.random.default_rng(seed)
    data = rng.random(shape)
    for axis in range(3):
        data = (np.roll(data, 1, axis) + 2 * data + np.roll(data, -1, axis)) / 4
    return Volume(np.maximum(data - 0.35, 0) * 5, (9.0, 11.0, 7.0), (-20.0, 5.0, 100.0))


def around(cloud, azimuth, elevation, width, height, fov=30, far=4.0):
    """A camera that looks at the middle of a cloud, in the direction given."""
    low, high = cloud.bounds
    middle, size = (low + high) / 2, np.linalg.norm(high - low)
    back = np.array(pa.Sun(elevation, azimuth).direction) * size * far
    return pa.Camera.look_at(middle - back, middle, width, height, fov=fov)


# ---- Eq 5 against the march.

SMALL = smooth_cloud()
SIGMAS = (0.002, 0.02, 0.1)
SUNS = {"front": pa.Sun(30, 240), "side": pa.Sun(50, 130), "back": pa.Sun(20, 75), "below": pa.Sun(-40, 10)}


@pytest.mark.parametrize("where", SUNS)
def test_eq_5_is_what_a_plain_march_finds(where):
    sun, camera = SUNS[where], around(SMALL, 65, -10, 9, 7, fov=14)
    coarse, _ = march(SMALL, camera, sun, SIGMAS, 100, 40)
    half, _ = march(SMALL, camera, sun, SIGMAS, 200, 80)
    fine, depth = march(SMALL, camera, sun, SIGMAS, 400, 160)
    # The fast bound is wider than on the cumulus: up to an optical depth in a voxel of a rough cloud.
    for m, sigma in enumerate(SIGMAS):
        # Halving the steps shows the second order of the march and bounds what is left in it.
        first, second = rel(coarse[m], fine[m]), rel(half[m], fine[m])
        assert second < first / 2.5
        own = second / 2
        p = Params(sigma_t=sigma, **EXACT)
        for method, bound in (("reference", 2e-5), ("fast", 5e-3)):
            image = render(SMALL, p, camera, sun, method=method)
            assert rel(image.single[..., 0].ravel(), fine[m]) < own + bound, (method, sigma, own)
            assert np.abs(image.transmittance.ravel() - np.exp(-sigma * depth)).max() < 1e-3


def test_eqs_3_4_and_9_compose_what_eq_5_gives():
    camera, sun = around(SMALL, 65, -10, 9, 7, fov=14), SUNS["side"]
    j, depth = march(SMALL, camera, sun, (0.02,), 400, 160)
    cosine = camera.directions().reshape(-1, 3) @ np.array(sun.direction)
    sky = np.random.default_rng(0).random((7, 9, 3))
    p = Params(2.5, (1.0, 0.9, 0.7), 0.6, 0.02, 0.97, 0.3, (0.1, 0.0, 0.8))
    expected, single = eqs_3_to_9(p, j[0], depth, cosine, sky.reshape(-1, 3))
    image = render(SMALL, p, camera, sun, sky=sky, method="reference")
    assert rel(image.rgb.reshape(-1, 3), expected) < 5e-5
    assert rel(image.single.reshape(-1, 3), single) < 5e-5
    assert not image.multiple.any()
    # t_c as the distance to the cloud over its mean: infinitely far where there is no cloud.
    far = render(SMALL, p, camera, sun, sky=sky, method="reference", conventions=Conventions(haze="distance"))
    t = image.distance.ravel() / image.distance[np.isfinite(image.distance)].mean()
    t[np.isinf(t)] = 1e9
    expected, _ = eqs_3_to_9(p, j[0], depth, cosine, sky.reshape(-1, 3), t)
    assert rel(far.rgb.reshape(-1, 3), expected) < 5e-5


# ---- The fast method against the reference: 0.2 % of the single-scattered light is promised in src/clouds/march.rs.


@cache
def cumulus():
    return pa.clouds.procedural("cumulus", (96, 160, 160), rng=3)


EAST = pa.Camera.look_at((-3400, 1600, 1760), (1600, 1600, 1760), 24, 18, fov=35)


@cache
def deepest():
    return float(Basis.precompute(cumulus(), EAST, pa.Sun(40, 200), sigma_t=[0.01]).depth.max())


def fast_error(tau, sun):
    p = Params(sigma_t=tau / deepest(), **EXACT)
    exact = render(cumulus(), p, EAST, sun, method="reference").single
    return rel(render(cumulus(), p, EAST, sun).single, exact)


@pytest.mark.parametrize("tau", [6.5, 39])
@pytest.mark.parametrize("azimuth", [270, 180, 330], ids=["front", "side", "front-side"])
def test_fast_agrees_with_reference(tau, azimuth):
    assert fast_error(tau, pa.Sun(40, azimuth)) < 2e-3


@pytest.mark.parametrize(("tau", "bound"), [(6.5, 3e-3), (39, 1.5e-2)])
def test_fast_agrees_less_well_where_almost_no_light_is_left(tau, bound):
    assert fast_error(tau, pa.Sun(35, 90)) < bound  # Sun behind the cloud, in the plane of view


def test_reference_is_right_on_the_cumulus():
    # A few pixels by the plain march, so that the two methods of the product do not only agree with each other.
    sun, sigmas = pa.Sun(40, 180), (6.5 / deepest(), 39 / deepest())
    image = render(cumulus(), Params(sigma_t=sigmas[0], **EXACT), EAST, sun, method="reference")
    pixels = np.flatnonzero(image.transmittance.ravel() < 1)[::9]
    fine, _ = march(cumulus(), EAST, sun, sigmas, 1200, 300, pixels)
    assert rel(image.single[..., 0].ravel()[pixels], fine[0]) < 1e-4
    thick = render(cumulus(), Params(sigma_t=sigmas[1], **EXACT), EAST, sun, method="reference")
    assert rel(thick.single[..., 0].ravel()[pixels], fine[1]) < 5e-4


# ---- Closed forms. A homogeneous box of 100 m, 20 voxels across, seen by one pixel from 100 km.

SIGMA = (1e-6, 1e-3, 0.02, 0.3, 10.0, 1e4)


def one_pixel(sigma, density, towards, sun, method="fast", wide=1, **more):
    cloud = Volume(np.full((20, 20 * wide, 20 * wide), density), 5.0, (-50 * wide, -50 * wide, 0))
    target = np.array([0.0, 0.0, 37.0])
    camera = pa.Camera.look_at(target - 1e5 * np.array(towards), target, 1, 1, fov=0.01)
    image = render(cloud, Params(sigma_t=sigma, **(EXACT | more)), camera, sun, method=method)
    return float(image.single[0, 0, 0]), float(image.transmittance[0, 0]), float(image.rgb[0, 0, 0])


@pytest.mark.parametrize("sigma", SIGMA)
@pytest.mark.parametrize("method", ["fast", "reference"])
@pytest.mark.parametrize("density", [1.0, 0.25])
def test_a_homogeneous_box_has_closed_forms(sigma, method, density):
    tau = sigma * density * 100
    cases = {
        "overhead": (pa.Sun(90, 0), math.exp(-sigma * density * 63) * -math.expm1(-tau)),
        "nadir": (pa.Sun(-90, 0), math.exp(-sigma * density * 37) * -math.expm1(-tau)),
        "behind the eye": (pa.Sun(0, 270), -math.expm1(-2 * tau) / 2),
        "ahead": (pa.Sun(0, 90), tau * math.exp(-tau)),
        "left": (pa.Sun(0, 0), math.exp(-sigma * density * 50) * -math.expm1(-tau)),
    }
    for name, (sun, exact) in cases.items():
        j, through, _ = one_pixel(sigma, density, (1, 0, 0), sun, method)
        assert j == pytest.approx(exact, rel=5e-5 if method == "fast" else 1e-6, abs=1e-30), name
        assert through == pytest.approx(math.exp(-tau), rel=2e-5, abs=1e-30), name


@pytest.mark.parametrize("sigma", SIGMA)
@pytest.mark.parametrize("elevation", [90, 60, 30, 12])
@pytest.mark.parametrize("method", ["fast", "reference"])
def test_a_slab_has_closed_forms(sigma, elevation, method):
    sun = pa.Sun(elevation, 123)
    slant = 1 + 1 / math.sin(math.radians(elevation))
    j, through, _ = one_pixel(sigma, 1.0, (0, 0, -1), sun, method, wide=12)
    assert j == pytest.approx(-math.expm1(-sigma * 100 * slant) / slant, rel=1e-4 if method == "fast" else 1e-6)
    assert through == pytest.approx(math.exp(-sigma * 100), rel=2e-5, abs=1e-30)


@pytest.mark.parametrize("sigma", SIGMA)
def test_the_ambient_term_in_both_conventions(sigma):
    cloud = Volume(np.ones((4, 4, 4)), 25.0)
    camera = pa.Camera.look_at((-1e5, 50, 50), (50, 50, 50), 1, 1, fov=0.01)
    p = Params(light_intensity=0, ambient=0.7, light_color=(1, 0.5, 0.25), sigma_t=sigma)
    for word, factor in (("extinction", 1.0), ("paper", 1 / sigma)):
        rgb = render(cloud, p, camera, pa.Sun(40), conventions=Conventions(ambient=word)).rgb[0, 0]
        exact = 0.7 * factor * -math.expm1(-100 * sigma)
        # 1 − exp(−x) is formed in single precision: an absolute error of half a unit of 1.
        np.testing.assert_allclose(rgb, exact * np.array(p.light_color), rtol=2e-5, atol=0.7 * factor * 1.2e-7)


# ---- Invariants.


@pytest.mark.parametrize("g", [-0.99, -0.5, 0.0, 0.5, 0.85, 0.99])
def test_the_phase_function_in_both_conventions(g):
    # Looking along x at a thin box, the Sun going round: the light is J (equal by symmetry) times p(cos).
    cloud, camera = Volume(np.ones((1, 1, 1)), 1.0), pa.Camera.look_at((-99, 0.5, 0.5), (0.5,) * 3, 1, 1, fov=0.001)
    for elevation in (0.0, 3.0, 90.0, -45.0, 135.0):
        sun = pa.Sun(min(elevation, 180 - elevation), 90 if elevation <= 90 else 270)
        p = Params(sigma_t=1e-5, ambient=0, albedo=1, g=g)
        plain = float(render(cloud, replace(p, g=0.0), camera, sun).single[0, 0, 0])
        one = float(render(cloud, p, camera, sun).single[0, 0, 0])
        cosine = math.cos(math.radians(elevation))
        assert one / plain == pytest.approx(hg(g, cosine), rel=2e-3 if abs(g) > 0.9 else 2e-5)
        conventions = Conventions(phase="integral-one")
        other = float(render(cloud, p, camera, sun, conventions=conventions).single[0, 0, 0])
        assert other == pytest.approx(one / (4 * math.pi), rel=1e-6)
    mu = -1 + (np.arange(2_000_000) + 0.5) / 1e6
    assert hg(g, mu).mean() == pytest.approx(1, abs=1e-4), "mean 1 over the sphere"


def test_no_cloud_is_sky_in_every_haze_and_endless_haze_is_sky():
    rng = np.random.default_rng(1)
    camera = around(SMALL, 65, -10, 16, 12, fov=30)
    sky = rng.random((12, 16, 3)).astype(np.float32)
    empty = Volume(np.zeros((4, 4, 4)))
    for haze in ((0, 0, 0), (0.1, 1, 30), (1e30,) * 3):
        for word in ("unit", "distance"):
            p, how = Params(haze=haze, ambient=0.5), Conventions(haze=word)
            assert np.array_equal(render(empty, p, camera, pa.Sun(30), sky=sky, conventions=how).rgb, sky) or (
                np.abs(render(empty, p, camera, pa.Sun(30), sky=sky, conventions=how).rgb - sky).max() < 1.2e-7
            )
    endless = render(SMALL, Params(5.0, haze=(1e3,) * 3), camera, pa.Sun(30), sky=sky)
    assert (endless.transmittance < 0.9).any()
    np.testing.assert_array_equal(endless.rgb, sky)


def test_single_scattering_is_linear_and_bounded_by_what_is_taken_out():
    camera, sun = around(SMALL, 65, -10, 16, 12, fov=20), SUNS["front"]
    p = Params(sigma_t=0.03, **EXACT)
    image = render(SMALL, p, camera, sun)
    j = image.single[..., 0]
    assert (j >= 0).all()
    assert (j <= (1 - image.transmittance) * (1 + 1e-5) + 1e-7).all(), "furnace: light that is not taken is not given"
    for name, factor in (("light_intensity", 3.0), ("albedo", 0.25), ("light_color", (0.5, 2.0, 1.0))):
        scaled = render(SMALL, replace(p, **{name: factor}), camera, sun).single
        np.testing.assert_allclose(scaled, image.single * factor, rtol=1e-6)
    assert not render(SMALL, replace(p, albedo=0.0), camera, sun).rgb.any()
    assert not render(SMALL, replace(p, sigma_t=0.0), camera, sun).single.any()


def test_light_is_proportional_to_a_small_extinction():
    camera, sun = around(SMALL, 65, -10, 16, 12, fov=20), SUNS["side"]
    basis = Basis.precompute(SMALL, camera, sun, sigma_t=[1e-9, 1e-8, 1e-7])
    for m, sigma in enumerate(basis.sigma_t):
        assert rel(basis.scattered[m] / sigma, basis.depth) < 1e-4
    assert ((basis.depth > 0) == np.isfinite(basis.distance)).all()


def test_light_over_extinction_is_completely_monotone():
    # J / σ is the Laplace transform of a positive measure of S + D: differences alternate, the logarithm is convex.
    camera, sun = around(SMALL, 65, -10, 16, 12, fov=20), SUNS["side"]
    basis = Basis.precompute(SMALL, camera, sun, sigma_t=np.arange(1, 11) * 0.012)
    f = (basis.scattered / basis.sigma_t[:, None, None])[:, basis.depth > 5].astype(float)
    assert f.shape[1] > 20
    for order in range(1, 5):
        assert ((-1) ** order * np.diff(f, order, axis=0) > -1e-6 * f[0]).all(), order
    assert (np.diff(np.log(f), 2, axis=0) > -1e-5).all()


# ---- Section 4.3: interpolation.

HEAP = pa.clouds.procedural("cumulus", (48, 80, 80), rng=5)
SOUTH = around(HEAP, 0, 5, 24, 18, fov=22)


def interpolation_errors(basis, sigmas):
    p = Params(ambient=0, g=0.3)
    pairs = [replace(p, sigma_t=float(s)) for s in sigmas]
    how = basis.conventions
    return [rel(basis.image(q), render(HEAP, q, SOUTH, basis.sun, conventions=how).rgb) for q in pairs]


@pytest.mark.parametrize("sun", [pa.Sun(40, 130), pa.Sun(25, 10)], ids=["front", "back"])
def test_the_default_extinctions_interpolate_well_and_the_papers_do_not(sun):
    basis = Basis.precompute(HEAP, SOUTH, sun)
    assert basis.sigma_t.size == 19
    np.testing.assert_allclose(basis.sigma_t[1:] / basis.sigma_t[:-1], math.sqrt(2))
    between = np.sqrt(basis.sigma_t[1:] * basis.sigma_t[:-1])
    assert max(interpolation_errors(basis, between)) < 5e-3
    paper = Basis.precompute(HEAP, SOUTH, sun, conventions=Conventions(interpolation="linear"))
    assert paper.sigma_t.size == 11
    assert paper.sigma_t[0] == 0
    lowest = np.array([0.15, 0.3, 0.5]) * paper.sigma_t[1]
    assert min(interpolation_errors(paper, lowest)) > 0.05, "the first cell of eleven equal steps"

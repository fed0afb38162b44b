"""Laws of many-times scattered light: reciprocity, positivity, orders, fast against plain, a basis without bias.

The judge of last resort is `analog`: delta tracking and a marched leg to the Sun in numpy, from the textbook, sharing
nothing with the product but the volume and the camera's rays.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pleinair as pa
import pytest
from pleinair.clouds import Basis, Params, Volume, render

ONE = Params(g=0.5, sigma_t=1.0, albedo=1.0)


def blobs(shape=(12, 13, 14), seed=3):
    """A lumpy cloud of 1 m voxels that fades out before its box ends."""
    z, y, x = np.meshgrid(*[(np.arange(n) + 0.5) for n in shape], indexing="ij")
    rng = np.random.default_rng(seed)
    data = np.zeros(shape)
    for _ in range(7):
        c, r = rng.uniform(4, 9, 3), rng.uniform(1.5, 3.5)
        data += np.exp(-((x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2) / r**2)
    return Volume(np.maximum(data - 0.2, 0), 1.0)


CLOUD = blobs()
SIDE = pa.Sun(35, 150)


def looking(cloud, azimuth, elevation, n, fov=None, far=200.0):
    """A camera far off that looks along a direction at the middle of the cloud and sees all of it."""
    low, high = cloud.bounds
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    along = np.array(pa.Sun(elevation, azimuth).direction)
    fov = math.degrees(2 * math.atan(0.5 / far)) if fov is None else fov
    return pa.Camera.look_at(middle - along * size * far, middle, n, n, fov=fov)


VIEW = looking(CLOUD, 60, -12, 8)
DEEPEST = float(Basis.precompute(CLOUD, looking(CLOUD, 60, -12, 64), SIDE, sigma_t=[1.0]).depth.max())
NARROW = looking(CLOUD, 60, -12, 8, fov=0.02)


def light(p, *, camera=VIEW, sun=SIDE, cloud=CLOUD, orders=4, samples=500, seeds=8, method="fast", start=0):
    """Sum over the picture of the light of orders 2 and up, and its standard error over repeats."""
    how = {"orders": orders, "samples": samples, "method": method, "denoise": False}
    x = [render(cloud, p, camera, sun, rng=start + i, **how).multiple[..., 0] for i in range(seeds)]
    sums = np.array(x, float).sum((1, 2))
    return sums.mean(), sums.std(ddof=1) / math.sqrt(seeds)


def apart(a, b):
    """Difference of two estimates in standard errors, and in parts of the second."""
    return (a[0] - b[0]) / math.hypot(a[1], b[1]), a[0] / b[0] - 1


# ---- An independent judge.


def analog(cloud, p, camera, sun, count, last, seed):
    """Mean radiance of orders 2 to `last` over the camera's rays (phase of mean 1), and its standard error."""
    rng = np.random.default_rng(seed)
    padded = np.pad(cloud.density.astype(float), 1, mode="edge")
    top = np.array(cloud.density.shape)[::-1] * np.array(cloud.voxel_size)
    size, toward = np.array(cloud.voxel_size), np.array(sun.direction)

    def density(points):
        inside = ((points >= 0) & (points <= top)).all(-1)
        q = np.clip(points / size, 0, top / size) + 0.5
        i = np.minimum(q.astype(int), np.array(padded.shape)[::-1] - 2)
        f = q - i
        out = np.zeros(len(points))
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(np.array(corner), f, 1 - f), -1)
            j = i + np.array(corner)
            out += weight * padded[j[:, 2], j[:, 1], j[:, 0]]
        return np.where(inside, out, 0)

    def edges(x, d):
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = -x / d, (top - x) / d
        return np.fmax(np.minimum(a, b).max(-1), 0), np.maximum(a, b).min(-1)

    def lit(x):
        steps = 64
        far = edges(x, toward)[1]
        total = np.zeros(len(x))
        for n in range(steps):
            total += density(x + toward * (far * (n + 0.5) / steps)[:, None])
        return np.exp(-p.sigma_t * total * far / steps)

    def phase(cosine):
        return (1 - p.g**2) / (1 + p.g**2 - 2 * p.g * cosine) ** 1.5

    rays = camera.directions().reshape(-1, 3)
    d = rays[np.arange(count) % len(rays)]
    x = np.broadcast_to(np.array(camera.position) - np.array(cloud.origin), d.shape)
    majorant = p.sigma_t * cloud.density.max()
    value, alive = np.zeros(count), np.arange(count)
    x = x + d * edges(x, d)[0][:, None]
    for order in range(1, last + 1):
        flying, kept = np.ones(len(alive), bool), np.ones(len(alive), bool)
        while flying.any():
            f = np.flatnonzero(flying)
            x[f] += d[f] * (-np.log1p(-rng.random(len(f))) / majorant)[:, None]
            gone = ((x[f] < -1e-9) | (x[f] > top + 1e-9)).any(-1)
            kept[f[gone]] = False
            hit = rng.random(len(f)) * majorant < p.sigma_t * density(x[f])
            flying[f[gone | hit]] = False
        alive, x, d = alive[kept], x[kept], d[kept]
        if order > 1:
            value[alive] += p.albedo**order * phase(d @ toward) * lit(x)
        u, turn = rng.random(len(alive)), rng.random(len(alive)) * 2 * np.pi
        g = p.g if p.g else 1e-6
        cosine = (1 + g**2 - ((1 - g**2) / (1 - g + 2 * g * u)) ** 2) / (2 * g)
        helper = np.where(np.abs(d[:, :1]) > 0.9, [[0.0, 1, 0]], [[1.0, 0, 0]])
        a = np.cross(helper, d)
        a /= np.linalg.norm(a, axis=1)[:, None]
        sine = np.sqrt(np.maximum(1 - cosine**2, 0))
        d = d * cosine[:, None] + sine[:, None] * (a * np.cos(turn)[:, None] + np.cross(d, a) * np.sin(turn)[:, None])
    return value.mean(), value.std(ddof=1) / math.sqrt(count)


@pytest.mark.parametrize(
    ("g", "tau", "count"), [(0.0, 6.0, 30_000), (0.6, 6.0, 30_000), (0.0, 40.0, 20_000)], ids=["thin", "hg", "thick"]
)
def test_a_textbook_path_tracer_agrees(g, tau, count):
    p = Params(g=g, sigma_t=tau / DEEPEST, albedo=0.95)
    exact = analog(CLOUD, p, NARROW, SIDE, count, 4, seed=5)
    ours = light(p, camera=NARROW, samples=1500)
    z, off = apart((ours[0] / 64, ours[1] / 64), exact)
    assert abs(z) < 3, (z, off)
    assert exact[1] < 0.02 * exact[0]


# ---- Two estimators of ours.


@pytest.mark.parametrize("tau", [6.5, 39.0, 400.0])
@pytest.mark.parametrize("g", [0.0, 0.6])
def test_fast_is_the_plain_estimator(g, tau):
    p = Params(g=g, sigma_t=tau / DEEPEST, albedo=1.0)
    fast = light(p, camera=looking(CLOUD, 60, -12, 24), samples=250)
    plain = light(p, camera=looking(CLOUD, 60, -12, 24), samples=250, method="reference", start=50)
    z, off = apart(fast, plain)
    assert abs(z) < 3.5, (z, off)
    assert abs(off) < 0.005 + 3 * math.hypot(fast[1] / fast[0], plain[1] / plain[0])


@pytest.mark.parametrize("sun", [pa.Sun(90), pa.Sun(-20, 240), pa.Sun(0, 90)], ids=["zenith", "below", "along x"])
def test_optically_thick_voxels_are_not_darkened(sun):
    # Looking up depths to the Sun once took 2 to 60 % from clouds like this one: tens of optical depths in a voxel.
    rough = Volume(np.random.default_rng(1).random((8, 8, 8)), 10.0)
    p, camera = Params(g=0.0, sigma_t=0.5, albedo=1.0), looking(rough, 60, -12, 20)
    fast = light(p, cloud=rough, camera=camera, sun=sun, samples=150)
    plain = light(p, cloud=rough, camera=camera, sun=sun, samples=150, method="reference", start=50)
    z, off = apart(fast, plain)
    assert abs(z) < 3.5, (z, off)
    assert math.hypot(fast[1] / fast[0], plain[1] / plain[0]) < 0.01


# ---- Laws.


@pytest.mark.parametrize("cloud", [CLOUD, Volume(np.ones((3, 4, 5)), 3.0)], ids=["lumpy", "box"])
@pytest.mark.parametrize("g", [0.0, 0.7])
def test_camera_and_sun_may_change_places(cloud, g):
    p = Params(g=g, sigma_t=8 / 15 if cloud is not CLOUD else 10 / DEEPEST, albedo=0.98)
    # What a cloud of parallel rays carries: the sum over a grid of them.
    ways = [(40.0, -25.0), (170.0, 10.0)]
    there, back = ((light(p, cloud=cloud, camera=looking(cloud, *a, 60), sun=opposite(*b), samples=16, orders=6))
                   for a, b in (ways, ways[::-1]))  # fmt: skip
    z, off = apart(there, back)
    assert abs(off) < 0.004 + 3 * math.hypot(there[1] / there[0], back[1] / back[0]), (z, off)


def opposite(azimuth, elevation):
    """The Sun that shines along the reverse of a camera's direction of view."""
    return pa.Sun(-elevation, azimuth + 180)


def test_a_slab_is_reciprocal():
    slab = Volume(np.ones((4, 2, 2)), (1e6, 1e6, 0.25), (-1e6, -1e6, 0))

    def seen(mu, mu0):
        far, flat = 10.0, math.sqrt(1 - mu * mu)
        camera = pa.Camera.look_at((far * flat, 0, 1 + far * mu), (0, 0, 1), 8, 8, fov=0.01)
        sun = pa.Sun(math.degrees(math.asin(mu0)), 0)
        total, error = light(
            Params(g=0.7, sigma_t=5.0, albedo=0.99), cloud=slab, camera=camera, sun=sun, orders=None, samples=100
        )
        return total / mu0, error / mu0

    z, off = apart(seen(0.3, 0.9), seen(0.9, 0.3))
    assert abs(z) < 3, (z, off)


def test_orders_add_up_to_all():
    p = replace(ONE, sigma_t=2 / DEEPEST, albedo=0.9)
    pixels = [
        render(CLOUD, p, VIEW, SIDE, orders=k, samples=100, rng=1, denoise=False).multiple.sum() for k in (2, 4, 8, 30)
    ]
    endless = render(CLOUD, p, VIEW, SIDE, orders=None, samples=100, rng=1, denoise=False).multiple.sum()
    assert (np.diff(pixels) > 0).all(), "every order adds light"
    assert pixels[-1] == pytest.approx(endless, rel=2e-3)
    assert not render(CLOUD, p, VIEW, SIDE, orders=1).multiple.any()


def test_orders_are_powers_of_albedo_and_linear_in_light():
    p = Params(g=0.6, sigma_t=5 / DEEPEST)
    basis = Basis.precompute(
        CLOUD, VIEW, SIDE, sigma_t=[p.sigma_t], g=[0.6], orders=4, samples=200, denoise=False, rng=3
    )
    by_order = basis.multiple[:, 0, 0].astype(float)
    for albedo in (0.0, 0.3, 0.77, 1.0):
        got = basis.higher_orders(replace(p, albedo=albedo)).ravel()[basis.pixels]
        np.testing.assert_allclose(got, sum(albedo**k * x for k, x in zip((2, 3, 4), by_order, strict=True)), rtol=1e-4)
        # The same paths in render: at most four scatterings are never ended by chance.
        image = render(CLOUD, replace(p, albedo=albedo), VIEW, SIDE, orders=4, samples=200, rng=3, denoise=False)
        np.testing.assert_allclose(image.multiple[..., 0].ravel()[basis.pixels], got, rtol=1e-4)
    tinted = replace(p, light_intensity=3.0, light_color=(1.0, 0.5, 0.25), albedo=0.77)
    plain = basis.higher_orders(tinted)
    np.testing.assert_allclose(basis.render(tinted).multiple, 3 * plain[..., None] * [1, 0.5, 0.25], rtol=1e-5)


@cache
def many():
    # Extinctions 1 : 100 and asymmetries to the extremes.
    low = 0.4 / DEEPEST
    return Basis.precompute(
        CLOUD,
        VIEW,
        SIDE,
        sigma_t=low * np.geomspace(1, 100, 12),
        g=[-0.9, -0.5, 0.0, 0.4, 0.7, 0.85, 0.93, 0.97],
        orders=4,
        samples=3000,
        denoise=False,
        rng=8,
    )


def test_light_over_sigma_to_the_k_is_completely_monotone():
    # sigma^k times the Laplace transform of a positive measure: with the same paths at every node this holds pixel by
    # pixel and exactly. Divided differences in sigma alternate in sign; ln is convex.
    basis = many()
    s = basis.extinctions
    for k, images in zip((2, 3, 4), basis.multiple.astype(float), strict=True):
        f = images.transpose(1, 0, 2) / s[:, None, None] ** k
        scale = f.max(0)
        on = f[-1] > 1e-6 * scale
        difference, steps = f, 1
        for sign in (-1, 1, -1):
            h = (s[steps:] - s[:-steps])[:, None, None]
            difference = np.diff(difference, axis=0) / h
            noise = 2e-6 * scale * (2 / np.diff(s).min()) ** steps
            assert (sign * difference >= -noise).all(), (k, steps)
            steps += 1
        assert on.any()
        slope = np.diff(np.log(np.maximum(f, 1e-300)), axis=0) / np.diff(s)[:, None, None]
        assert (np.diff(slope, axis=0)[:, on] >= -1e-3 * np.abs(slope[1:, on])).all(), k


def test_thin_clouds_go_like_sigma_to_the_k():
    thin = 1e-4 / DEEPEST  # paths that scatter so often come from the third node
    basis = Basis.precompute(
        CLOUD, VIEW, SIDE, sigma_t=[thin, 2 * thin, 1.0], g=[0.0, 0.8], orders=4, samples=4000, denoise=False, rng=3
    )
    a, b = basis.multiple[:, :, 0].astype(float), basis.multiple[:, :, 1].astype(float)
    for k in (2, 3, 4):
        np.testing.assert_allclose(b[k - 2], a[k - 2] * 2.0**k, rtol=1e-3)
        assert (a[k - 2] > 0).any()


# ---- A basis without smoothing has no bias.


def scores(places, seeds=10):
    """z of the sum over the picture, basis against render, at (g, sigma) places."""
    found, basis = [], many()
    mine = {at: [] for at in places}
    for seed in range(seeds):
        fresh = Basis.precompute(
            CLOUD,
            VIEW,
            SIDE,
            sigma_t=basis.extinctions,
            g=basis.g,
            orders=4,
            samples=300,
            denoise=False,
            rng=100 + seed,
        )
        for at in places:
            mine[at].append(fresh.higher_orders(Params(g=at[0], sigma_t=at[1], albedo=0.93)).sum(dtype=float))
    for at in places:
        x = np.array(mine[at])
        p = Params(g=at[0], sigma_t=at[1], albedo=0.93)
        found.append(apart((x.mean(), x.std(ddof=1) / math.sqrt(seeds)), light(p, samples=1000, start=7000)))
    return np.array(found)


def test_a_basis_is_unbiased_at_its_nodes():
    basis = many()
    places = [(float(basis.g[i]), float(basis.extinctions[j])) for i in (0, 2, 5, 7) for j in (0, 5, 11)]
    z = scores(places)[:, 0]
    assert np.abs(z).max() < 4.5, z
    assert 0.3 < np.sqrt((z**2).mean()) < 1.8, z


def test_a_basis_is_unbiased_between_its_nodes():
    s = many().extinctions
    places = [(g, float(np.sqrt(s[j] * s[j + 1]))) for g in (0.2, 0.6, 0.8, 0.9) for j in (0, 5, 10)]
    z, off = scores(places).T
    # Whoever has little noise shows the error of interpolation.
    assert (np.abs(off) < 0.005 + np.abs(off / z) * 3.5).all(), (z, off)


def off_the_nodes(dense, thinned, axis):
    """Relative L2 errors of a basis with every second node at those it was deprived of, worst over the other axis."""
    found = {}
    for i, g in enumerate(dense.g):
        for m, sigma in enumerate(dense.extinctions):
            at = i if axis == 0 else m
            if at % 2:
                p = Params(g=float(g), sigma_t=float(sigma), albedo=1.0)
                a, b = thinned.higher_orders(p).astype(float), dense.higher_orders(p).astype(float)
                found[at] = max(found.get(at, 0.0), np.linalg.norm(a - b) / np.linalg.norm(b))
    return list(found.values())


# The steps of a basis by default: 12 extinctions from 0.4 to 40 optical depths, 12 asymmetries from 0 to 0.97. A core of
# 16 nodes holds a part of them at half the step.
@pytest.mark.parametrize("start", [0, 4, 8, 12])
def test_between_extinctions_1_to_100(start):
    # One path set for all nodes: no noise in the difference, it is interpolation alone.
    s = np.geomspace(0.4, 40, 23)[start : start + 11] / DEEPEST
    dense = Basis.precompute(
        CLOUD, VIEW, SIDE, sigma_t=s, g=[0.0, 0.6, 0.85], orders=4, samples=4000, denoise=False, rng=9
    )
    thinned = replace(dense, extinctions=dense.extinctions[::2], multiple=dense.multiple[:, :, ::2])
    found = off_the_nodes(dense, thinned, 1)
    assert max(found[1:]) < 0.006
    # The cell at the thin end, where the light grows like sigma^k.
    assert found[0] < 0.02


@pytest.mark.parametrize("start", [0, 8], ids=["wide", "sharp"])
def test_between_asymmetries(start):
    g = np.tanh(np.linspace(0, np.arctanh(0.97), 23))[start : start + 15]
    s = np.array([1.0, 6.0, 40.0]) / DEEPEST
    dense = Basis.precompute(CLOUD, VIEW, SIDE, sigma_t=s, g=g, orders=4, samples=4000, denoise=False, rng=9)
    thinned = replace(dense, g=dense.g[::2], multiple=dense.multiple[:, ::2])
    assert max(off_the_nodes(dense, thinned, 0)) < 0.005


def test_random_numbers_repeat():
    def sample(rng, orders=4):
        return render(
            CLOUD, replace(ONE, sigma_t=1.0), VIEW, SIDE, orders=orders, samples=16, rng=rng, denoise=False
        ).multiple

    assert (sample(1) == sample(np.random.SeedSequence(1))).all()
    on = sample(1) > 0
    assert (sample(1) != sample(2))[on].mean() > 0.99
    generator = np.random.default_rng(1)
    first, second = sample(generator), sample(generator)
    assert (first != second)[on].mean() > 0.99, "a generator goes on"
    assert (first == sample(np.random.default_rng(1))).all()

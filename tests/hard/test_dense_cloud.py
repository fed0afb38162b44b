"""Many times scattered light at its limits: nothing, one voxel, the eye inside, faces, hair thin, opaque, extreme g."""

import math
import subprocess
import sys
import textwrap
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core
from pleinair.clouds import Basis, Params, Volume, render

P = Params(g=0.6, sigma_t=0.05, albedo=1.0, ambient=0.0)
SUN = pa.Sun(40, 200)
HEAP = pa.clouds.procedural("cumulus", (24, 32, 32), rng=6)
VIEW = pa.Camera.look_at((320, -1200, 950), (320, 320, 1000), 12, 9, fov=25)
BOX = Volume(np.ones((4, 4, 4)), 25.0)
DEEPEST = float(Basis.precompute(HEAP, VIEW, SUN, sigma_t=[1.0]).depth.max())


def light(cloud, p, camera, sun, orders=None, samples=64, rng=0, method="fast", denoise=False):
    image = render(cloud, p, camera, sun, orders=orders, samples=samples, rng=rng, method=method, denoise=denoise)
    assert np.isfinite(image.rgb).all()
    assert (image.multiple >= 0).all()
    return image.multiple[..., 0].astype(float)


def estimate(pixels):
    x = np.ravel(pixels)
    return x.mean(), x.std(ddof=1) / math.sqrt(x.size)


def same(a, b, most=3.5):
    """Whether two sets of independent pixels have the same mean."""
    (a, da), (b, db) = estimate(a), estimate(b)
    assert abs(a - b) < most * math.hypot(da, db), (a, b, da, db)


# ---- Volumes and places.


@pytest.mark.parametrize("method", ["fast", "reference"])
def test_an_empty_volume_scatters_nothing(method):
    empty = Volume(np.zeros((5, 6, 7)))
    for position in ((-500, 50, 50), (70, 60, 50)):
        camera = pa.Camera.look_at(position, (71, 61, 50), 8, 6)
        for denoise in (False, True):
            assert not light(empty, P, camera, SUN, method=method, denoise=denoise).any()
    with pytest.raises(ValueError, match="does not see the cloud"):
        Basis.precompute(empty, VIEW, SUN, orders=4)
    for denoise in (False, True):
        dark = Basis.precompute(empty, VIEW, SUN, orders=4, sigma_t=[0.1], samples=2, denoise=denoise)
        assert dark.pixels.size == 0
        assert (dark.image(Params(sigma_t=0.1), sky=(1, 2, 3)) == [1, 2, 3]).all()


def test_one_voxel_is_the_box_of_many():
    whole, fine = Volume([[[2.0]]], (10, 20, 30)), Volume(np.full((6, 5, 4), 2.0), (2.5, 4, 5))
    camera = pa.Camera.look_at((-500, -300, 200), (5, 10, 15), 12, 12, fov=0.05)
    for sigma in (0.01, 0.1, 10.0):
        p = replace(P, sigma_t=sigma)
        a, b = (light(c, p, camera, pa.Sun(60, 240), 6, 400, i) for i, c in enumerate((whole, fine)))
        assert a.mean() > 0
        same(a, b)


@pytest.mark.parametrize("method", ["fast", "reference"])
def test_the_eye_inside_an_endless_fog_of_light(method):
    # Deep in a conservative box nothing depends on where one looks: the field is that of diffusion, nearly even.
    cloud = Volume(np.ones((10, 10, 10)), 10.0)
    eye = (50.0, 50.0, 50.0)
    p = Params(g=0.0, sigma_t=0.3, albedo=1.0)
    seen = {
        e: light(cloud, p, pa.Camera(6, 6, fov=1, elevation=e, position=eye), pa.Sun(90), None, 150, 1, method)
        for e in (90, 0, -90)
    }
    up, flat, down = (seen[e].mean() for e in (90, 0, -90))
    assert up > flat > down > 0, "light comes from the Sun's side"
    assert up < 2 * down
    # Outside, right at a face, and inside by a hair: the same light.
    near = [pa.Camera(8, 8, fov=1, azimuth=90, position=(x, 50, 50)) for x in (-1e-6, 1e-6)]
    same(*(light(cloud, p, c, SUN, 5, 300, i, method) for i, c in enumerate(near)))


def test_behind_the_cloud_and_straight_through():
    # The camera looks into the Sun through the cloud: orders 2 and up of a sharp phase function are finite and forward.
    camera = pa.Camera.look_at((-300, 50, 50), (50, 50, 50), 12, 12, fov=0.05)
    for g in (0.6, 0.9, 0.99):
        p = replace(P, g=g, sigma_t=0.02)
        fast = light(BOX, p, camera, pa.Sun(0, 90), 4, 1500)
        behind = light(BOX, p, camera, pa.Sun(0, 270), 4, 1500, 1)
        assert fast.mean() > 3 * behind.mean() > 0
    p = replace(P, g=0.6, sigma_t=0.02)
    same(light(BOX, p, camera, pa.Sun(0, 90), 4, 1500), light(BOX, p, camera, pa.Sun(0, 90), 4, 1500, 2, "reference"))


@pytest.mark.parametrize("method", ["fast", "reference"])
def test_rays_that_graze_faces_and_edges(method):
    inner = light(BOX, P, pa.Camera.look_at((-300, 50, 50), (50, 50, 50), 4, 4, fov=0.01), SUN, 4, 200, 0, method)
    for y, z in ((0, 50), (100, 50), (50, 0), (0, 0), (100, 100), (-1e-9, 50), (1e-9, 50), (50, 100 - 1e-9)):
        camera = pa.Camera.look_at((-300, y, z), (50, y, z), 1, 1, fov=0.01)
        for sun in (pa.Sun(90), pa.Sun(-90), pa.Sun(0, 0), pa.Sun(0, 90), pa.Sun(30, 45)):
            got = light(BOX, P, camera, sun, 4, 200, 0, method)
            assert 0 <= got[0, 0] < 20 * inner.mean(), (y, z)
    # Rays just inside a face see the same.
    just = [pa.Camera.look_at((-300, y, 50), (50, y, 50), 8, 8, fov=0.001) for y in (99.9, 99.98)]
    same(*(light(BOX, P, c, SUN, 4, 400, i, method) for i, c in enumerate(just)), most=5)


# ---- Parameters.


def test_hair_thin():
    # Orders k and up are negligible: order 2 goes like sigma^2, all orders is order 2.
    camera = pa.Camera.look_at((-300, 50, 50), (50, 50, 50), 6, 6, fov=0.05)
    basis = Basis.precompute(
        BOX, camera, SUN, sigma_t=[1e-8, 1e-2], g=[0.6], orders=None, samples=2000, denoise=False, rng=1
    )
    tiny = basis.multiple[:, 0, 0].mean(-1, dtype=float)
    large = basis.multiple[0, 0, 1].mean(dtype=float)
    assert tiny[0] > 1e-14, "a millionth of optical depth still scatters twice"
    assert (np.abs(tiny[1:]) < 1e-5 * tiny[0]).all()
    assert large < tiny[0] * (1e-2 / 1e-8) ** 2 < 20 * large
    assert light(BOX, replace(P, sigma_t=1e-8), camera, SUN).max() < 1e-6


def half_space_h(mu, w):
    x, weight = np.polynomial.legendre.leggauss(200)
    t = (x + 1) * np.pi / 4
    f = np.log(1 - w * t / np.tan(t)) / (np.cos(t) ** 2 + mu**2 * np.sin(t) ** 2)
    return math.exp(-mu / np.pi * (weight @ f) * np.pi / 4)


def test_opaque_is_a_half_space_and_energy_is_conserved():
    # 1e4 optical depths. H at albedo 1 is 2.907810529: reflected radiance H^2 / (8 pi) for the Sun behind the eye.
    slab = Volume(np.ones((3, 2, 2)), (1e6, 1e6, 1 / 3), (-1e6, -1e6, 0))
    camera = pa.Camera(8, 8, fov=0.01, elevation=-90, position=(0, 0, 11))
    for w, samples in ((0.9, 1000), (0.999, 150)):
        image = render(
            slab,
            Params(g=0.0, sigma_t=1e4, albedo=w),
            camera,
            pa.Sun(90),
            orders=None,
            samples=samples,
            rng=1,
            denoise=False,
        )
        mean, error = estimate((image.single + image.multiple)[..., 0].astype(float) / (4 * np.pi))
        exact = w / (8 * np.pi) * half_space_h(1, w) ** 2
        assert abs(mean - exact) < 3.5 * error, w
        assert error < 0.03 * exact


def test_what_goes_in_comes_out_at_albedo_one():
    # By reciprocity the light that leaves a slab in all directions for one of incidence is what it sends in one
    # direction under light from all: a furnace of Suns. Sums over mu0 by Gauss-Legendre, over both sides: 1.
    slab = Volume(np.ones((4, 2, 2)), (1e6, 1e6, 0.25), (-1e6, -1e6, 0))
    g, tau, mu = 0.5, 8.0, 1.0
    camera = pa.Camera(6, 6, fov=0.01, elevation=-90, position=(0, 0, 11))
    x, weight = np.polynomial.legendre.leggauss(8)
    p = Params(g=g, sigma_t=tau, albedo=1.0)
    total, variance = math.exp(-tau / mu), 0.0
    for mu0, w in zip((x + 1) / 2, weight / 2, strict=True):
        for side in (1, -1):
            sun = pa.Sun(side * math.degrees(math.asin(mu0)), 0)
            image = render(
                slab, p, camera, sun, orders=None, samples=400, rng=[int(mu0 * 1e6), side + 1], denoise=False
            )
            # L = int L(mu; mu0) dmu0 dphi with radiance 1 from everywhere; per unit of irradiance across the beam.
            mean, error = estimate((image.single + image.multiple)[..., 0].astype(float) / (4 * np.pi))
            total += 2 * np.pi * w * mean
            variance += (2 * np.pi * w * error) ** 2
    assert math.sqrt(variance) < 0.01
    assert abs(total - 1) < 3.5 * math.sqrt(variance) + 0.002


@pytest.mark.parametrize("g", [-0.99, 0.99])
def test_extreme_asymmetries(g):
    camera = pa.Camera.look_at((-300, 50, 50), (50, 50, 50), 12, 12, fov=0.05)
    p = Params(g=g, sigma_t=0.03, albedo=1.0)
    sun = pa.Sun(20, 90)  # 20 degrees off the Sun in front
    fast = light(BOX, p, camera, sun, 3, 6000, 1)
    plain = light(BOX, p, camera, sun, 3, 6000, 2, "reference")
    same(fast, plain, most=4)
    both = Basis.precompute(
        BOX, camera, sun, sigma_t=[0.03], g=[-0.99, 0.99], orders=3, samples=6000, denoise=False, rng=4
    )
    same(both.higher_orders(p).astype(float), fast, most=4)
    assert np.isfinite(light(BOX, replace(p, sigma_t=10.0), camera, sun, None, 4)).all()


def test_black_and_white():
    assert not light(HEAP, replace(P, albedo=0.0), VIEW, SUN).any()
    basis = Basis.precompute(HEAP, VIEW, SUN, sigma_t=[0.05], g=[0.6], orders=None, samples=16, denoise=False, rng=1)
    assert not basis.higher_orders(replace(P, albedo=0.0)).any()
    # Many orders: a thick white cloud converges and is lit by no more than what falls on it.
    p = Params(g=0.85, sigma_t=300 / DEEPEST, albedo=1.0)
    white = light(HEAP, p, VIEW, SUN, None, 32)
    few = light(HEAP, p, VIEW, SUN, 4, 32)
    assert white.sum() > 2 * few.sum()
    on = white[white > 0]
    assert 0.1 < on.mean() < 4 * np.pi, "a radiance of the order of 1 / pi per unit of irradiance"
    assert not light(HEAP, replace(P, sigma_t=0.0), VIEW, SUN).any()


@pytest.mark.parametrize("factor", [1.0, 20.0])
def test_a_rough_field(factor, rough):
    cloud = rough
    camera = pa.Camera.look_at((-1500, 370, 900), (320, 370, 940), 24, 18, fov=28)
    for sun in (pa.Sun(40, 270), pa.Sun(70, 30)):
        sums = {
            m: [
                light(cloud, Params(g=0.0, sigma_t=factor, albedo=1.0), camera, sun, 5, 60, r, m).sum()
                for r in range(6)
            ]
            for m in ("fast", "reference")
        }
        a, b = (estimate(np.array(s)) for s in sums.values())
        assert abs(a[0] - b[0]) < 4 * math.hypot(a[1], b[1]), (a, b)
        assert math.hypot(a[1] / a[0], b[1] / b[0]) < 0.015


# ---- The same bits.


def answer():
    image = render(HEAP, P, VIEW, SUN, orders=None, samples=12, rng=3)
    basis = Basis.precompute(HEAP, VIEW, SUN, sigma_t=[0.01, 0.05, 0.2], g=[0, 0.85], orders=None, samples=12, rng=3)
    return image.rgb.tobytes() + basis.multiple.tobytes()


def test_threads_and_simd_levels_give_the_same_bits():
    expected = answer()
    for level in _core.simd_levels():
        _core.force_simd_level(level)
        for threads in (1, 2):
            pa.set_num_threads(threads)
            assert answer() == expected, (level, threads)


def test_random_numbers():
    def sample(rng, **more):
        return Basis.precompute(HEAP, VIEW, SUN, sigma_t=[0.05], g=[0.6], orders=4, samples=8, rng=rng, **more).multiple

    assert (sample(1) == sample(np.random.SeedSequence(1))).all()
    assert (sample(1) != sample(2)).mean() > 0.5
    a, b = sample(1, denoise=False), sample(2, denoise=False)
    x, y = (np.ravel(s - 0.5 * (a + b)) for s in (a, b))
    assert np.corrcoef(x, -y)[0, 1] == pytest.approx(1, abs=1e-5)
    pixels = a.sum((0, 1, 2)) - b.sum((0, 1, 2))
    assert abs(np.corrcoef(pixels[1:], pixels[:-1])[0, 1]) < 0.6, "neighbours have random numbers of their own"


# ---- Input.


@pytest.mark.parametrize("bad", [np.nan, -1e-9, np.inf])
def test_densities_are_refused_before_any_light(bad):
    data = np.ones((3, 3, 3))
    data[1, 1, 1] = bad
    with pytest.raises(ValueError, match="density"):
        Volume(data)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"orders": 0}, "orders"),
        ({"orders": -1}, "orders"),
        ({"orders": 2.5}, "orders"),
        ({"orders": "all"}, "orders"),
        ({"orders": True}, "orders"),
        ({"orders": 10**9}, "orders"),
        ({"samples": 0}, "samples"),
        ({"samples": -4}, "samples"),
        ({"samples": 1.5}, "samples"),
        ({"samples": None}, "samples"),
        ({"rng": "dice"}, "rng"),
        ({"rng": -1}, "rng"),
    ],
)
def test_arguments_of_both_are_refused_by_name(change, word):
    arguments = {"orders": 4, "samples": 2, "rng": 0} | change
    with pytest.raises((ValueError, TypeError), match=word):
        render(HEAP, P, VIEW, SUN, **arguments)
    with pytest.raises((ValueError, TypeError), match=word):
        Basis.precompute(HEAP, VIEW, SUN, **arguments)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"g": [1.0]}, "g must"),
        ({"g": [0.5, 0.5]}, "g must"),
        ({"g": [0.5, 0.2]}, "g must"),
        ({"g": []}, "g must"),
        ({"g": [np.nan]}, "g must"),
        ({"g": np.linspace(0, 0.9, 17)}, "g must"),
        ({"g": 0.5}, "g"),
        ({"sigma_t": [0.1, 0.05]}, "sigma_t"),
        ({"sigma_t": [-1.0]}, "sigma_t"),
        ({"sigma_t": [np.inf]}, "sigma_t"),
        ({"memory": 1000.0}, r"memory must be at least the \d+ MB"),
        ({"memory": np.nan}, "memory"),
    ],
)
def test_arguments_of_a_basis_are_refused_by_name(change, word):
    with pytest.raises((ValueError, TypeError), match=word):
        Basis.precompute(HEAP, VIEW, SUN, orders=4, samples=2, **change)


def test_parameters_outside_a_basis_are_refused_by_name():
    basis = Basis.precompute(HEAP, VIEW, SUN, sigma_t=[0.01, 0.1], g=[0.2, 0.8], orders=4, samples=2, rng=0)
    for change, word in (
        ({"g": 0.9}, "g"),
        ({"g": 0.0}, "g"),
        ({"sigma_t": 0.2}, "sigma_t"),
        ({"sigma_t": 0.001}, "sigma"),
    ):
        with pytest.raises(ValueError, match=word):
            basis.image(replace(P, **change))


def test_foreign_and_damaged_files_are_refused_by_name(tmp_path):
    basis = Basis.precompute(HEAP, VIEW, SUN, sigma_t=[0.01, 0.1], g=[0.2, 0.8], orders=None, samples=2, rng=0)
    path = basis.save(tmp_path / "light.npz")
    again = Basis.load(path)
    assert (again.multiple == basis.multiple).all()
    assert (again.higher_orders(P) == basis.higher_orders(P)).all()
    with np.load(path) as stored:
        arrays = dict(stored)
    broken = {
        "missing": {k: v for k, v in arrays.items() if k != "multiple"},
        "short": arrays | {"multiple": arrays["multiple"][..., :-1]},
        "pixels": arrays | {"pixels": arrays["pixels"] + np.uint32(10**6)},
        "nodes": arrays | {"g": arrays["g"][:1]},
        "about": arrays | {"about": np.array("{")},
    }
    for name, content in broken.items():
        np.savez(tmp_path / f"{name}.npz", **content)
        with pytest.raises(ValueError, match=name):
            Basis.load(tmp_path / f"{name}.npz")
    for name, content in {"cut": path.read_bytes()[:-200], "text": b"a,b\n1,2\n", "empty": b""}.items():
        (tmp_path / f"{name}.npz").write_bytes(content)
        with pytest.raises(ValueError, match=name):
            Basis.load(tmp_path / f"{name}.npz")
    with pytest.raises(ValueError, match="cloud"):
        Basis.load(HEAP.save(tmp_path / "cloud.npz"))


@pytest.mark.parametrize("what", ["basis", "render"])
def test_ctrl_c_in_the_middle_leaves_no_file(tmp_path, what):
    path = tmp_path / "light.npz"
    scene = "cloud, camera, sun, orders=None, samples=10**6, rng=0"
    call = {
        "basis": f"Basis.precompute({scene}).save({str(path)!r})",
        "render": f"np.savez({str(path)!r}, render(cloud, Params(sigma_t=0.1), {scene[7:]}).rgb)",
    }[what]
    code = textwrap.dedent(f"""
        import os, signal, threading, time
        import numpy as np
        import pleinair as pa
        from pleinair.clouds import Basis, Params, render
        signal.signal(signal.SIGINT, signal.default_int_handler)
        cloud, sun = pa.clouds.procedural("cumulus", (24, 32, 32), rng=6), pa.Sun(40, 200)
        camera = pa.Camera.look_at((320, -1200, 950), (320, 320, 1000), 64, 48, fov=30)
        fired = []
        def fire():
            fired.append(time.monotonic())
            os.kill(os.getpid(), 2)
        threading.Timer(0.6, fire).start()
        try:
            {call}
            print("finished")
        except KeyboardInterrupt:
            print("interrupted", time.monotonic() - fired[0])
        print(render(cloud, Params(), camera.resized(2, 2), sun, orders=3, samples=1).rgb.shape)
    """)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    words = run.stdout.split()
    assert words[0] == "interrupted", run.stdout + run.stderr
    assert float(words[1]) < 0.5
    assert words[2:] == ["(2,", "2,", "3)"]
    assert list(tmp_path.iterdir()) == []

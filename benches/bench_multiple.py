"""Light of many orders against Mitsuba 3: CPU time of a sample times its variance, both from two independent runs."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable
from importlib.metadata import PackageNotFoundError, version

import numpy as np
import pleinair as pa
from pleinair.report import Row
from scipy.ndimage import zoom

ROOM = "inverse_clouds"


def lumps() -> pa.clouds.Volume:
    """Return a cloud that fills a third of its box: a heap of soft spheres, roughened."""
    rng = np.random.default_rng(1)
    size = np.array([256, 150, 150])
    z, y, x = np.mgrid[0:256, 0:150, 0:150].astype(np.float32)
    heap = np.zeros(size, np.float32)
    for _ in range(40):
        c, r = rng.uniform([30, 40, 40], [226, 110, 110]), rng.uniform(22, 48)
        d = ((z - c[0]) ** 2 + (y - c[1]) ** 2 + (x - c[2]) ** 2) / r**2
        heap += np.where(d < 1, (1 - d) ** 2, 0)
    rough = np.zeros(size)
    for octave in range(5):
        n = 4 * 2**octave
        noise = rng.standard_normal((2 * n, n, n))
        rough += zoom(noise, size / noise.shape, order=1)[:256, :150, :150] * 0.5**octave
    density = np.pad(np.clip((heap - 0.18 + 0.16 * rough) * 1.6, 0, 1)[1:-1, 1:-1, 1:-1], 1)
    return pa.clouds.Volume(density.astype(np.float32), 1.0)


CLOUD = lumps()
CAMERA = pa.Camera.look_at((-430, 75, 128), (75, 75, 128), 40, 30, fov=30.53)
SUN = pa.Sun(40.5, 203.2)
CASES = ((4, False), (4, True), (None, False), (None, True))
SLOW = True
Render = Callable[[int, int], np.ndarray]


def ours(sigma: float, orders: int | None) -> Render:
    p = pa.clouds.Params(g=0.85, sigma_t=sigma, albedo=0.99, ambient=0.0)
    how = pa.clouds.Conventions(phase="integral-one")

    def render(samples: int, seed: int) -> np.ndarray:
        image = pa.clouds.render(
            CLOUD, p, CAMERA, SUN, orders=orders, samples=samples, denoise=False, rng=seed, conventions=how
        )
        return (image.single + image.multiple)[..., 0].astype(float)

    return render


def mitsuba(sigma: float, orders: int | None) -> Render | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
    except ImportError:
        return None
    low, high = CLOUD.bounds
    to_world = mi.ScalarTransform4f().translate(low.tolist()).scale((high - low).tolist())
    eye, ahead = np.array(CAMERA.position), CAMERA.directions()[14:16, 19:21].mean((0, 1))
    film = {
        "type": "hdrfilm",
        "width": CAMERA.width,
        "height": CAMERA.height,
        "rfilter": {"type": "box"},
        "pixel_format": "luminance",
    }
    density = {
        "type": "gridvolume",
        "grid": mi.VolumeGrid(CLOUD.density[..., None]),
        "to_world": to_world,
        "wrap_mode": "clamp",
    }
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {
                "type": "volpath",
                "max_depth": -1 if orders is None else orders + 1,
                "rr_depth": 100_000,
                "hide_emitters": True,
            },
            "sensor": {
                "type": "perspective",
                "fov": CAMERA.fov,
                "fov_axis": "y",
                "near_clip": 1.0,
                "far_clip": 1e6,
                "to_world": mi.ScalarTransform4f().look_at(eye.tolist(), (eye + ahead).tolist(), [0, 0, 1]),
                "film": film,
            },
            "sun": {
                "type": "directional",
                "direction": [-c for c in SUN.direction],
                "irradiance": {"type": "spectrum", "value": 1.0},
            },
            "cloud": {
                "type": "cube",
                "to_world": to_world.translate([0.5] * 3).scale(0.5),
                "bsdf": {"type": "null"},
                "interior": {
                    "type": "heterogeneous",
                    "albedo": 0.99,
                    "scale": sigma,
                    "sigma_t": density,
                    "phase": {"type": "hg", "g": 0.85},
                },
            },
        }
    )
    return lambda samples, seed: np.array(mi.render(scene, spp=samples, seed=seed))[..., 0].astype(float)


def measured(render: Render, samples: int) -> tuple[float, float, float]:
    """CPU seconds of one sample of the picture, without what is done once; its variance; the mean."""
    start = time.process_time()
    render(1, 9)
    once = time.process_time() - start
    start = time.process_time()
    a, b = render(samples, 1), render(samples, 2)
    cost = max((time.process_time() - start) / 2 - once, 1e-9) / (samples - 1)
    return cost, float(np.square(a - b).mean() / 2 * samples), float((a + b).mean() / 2)


def curves(sigma: float) -> Iterable[Row]:
    """Time and error against the number of paths of a pixel; the truth is the mean of 16 384 of ours, with its own error."""
    task, where = "all orders, τ 6.5, by paths of a pixel", "lumps 150×150×256, 40×30"
    render, rival = ours(sigma, None), mitsuba(sigma, None)
    halves = [render(8192, seed) for seed in (11, 12)]
    truth = (halves[0] + halves[1]) / 2
    scale = np.sqrt(np.square(truth).mean())
    floor = float(np.sqrt(np.square(halves[0] - halves[1]).mean()) / 2 / scale)
    for family, call, numbers in (
        ("pleinair", render, (4, 16, 64, 256, 1024)),
        ("mitsuba volpath", rival, (4, 16, 64, 256)),
    ):
        for n in numbers if call else ():
            start = time.process_time()
            picture = call(n, 3)
            spent = time.process_time() - start
            wrong = float(np.sqrt(np.square(picture - truth).mean()) / scale)
            yield Row(
                *(ROOM, task, where, f"{family}, {n} paths", spent, wrong, "rel-L2", float("nan")),
                family=family,
                setting=f"{n}",
                size=n,
                size_unit="paths of a pixel",
                floor=floor,
            )


def rows() -> Iterable[Row]:
    pa.set_num_threads(1)
    deepest = float(pa.clouds.Basis.precompute(CLOUD, CAMERA, SUN, sigma_t=[0.01]).depth.max())
    try:
        for orders, thick in CASES:
            sigma = (39.0 if thick else 6.5) / deepest
            words = f"{'all' if orders is None else orders} orders, τ {39 if thick else 6.5:g}, CPU × variance"
            mine = measured(ours(sigma, orders), 600 if orders else 300)
            rival = mitsuba(sigma, orders)
            where = "lumps 150×150×256, 40×30, a path a pixel"
            noise = mine[1] ** 0.5 / mine[2]
            yield Row(ROOM, words, where, "pleinair", mine[0], noise, "rel. σ", 1.0)
            if rival:
                theirs = measured(rival, 128)
                try:
                    name = f"mitsuba {version('mitsuba')} volpath"
                except PackageNotFoundError:
                    name = "mitsuba volpath"
                # To one noise, not of one sample.
                ratio = theirs[0] * theirs[1] / (mine[0] * mine[1])
                yield Row(ROOM, words, where, name, theirs[0], theirs[1] ** 0.5 / theirs[2], "rel. σ", ratio)
        yield from curves(6.5 / deepest)
    finally:
        pa.set_num_threads(None)

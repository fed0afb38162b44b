"""Skies beside a copy of the frame, numpy, O'Neil's samples and Mitsuba's sunsky.

Truth of a sky: pleinair's reference method, which the tests hold against an independent quadrature. Wall time with two
threads where the row says so, against `frame.copy()` in the same rounds; everything else CPU time of one thread. Mitsuba's
sky is another model: its speed is comparable, its error is not.
"""

from __future__ import annotations

import dataclasses
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pleinair as pa
from pleinair.report import Row, race

ROOM = "aoas"
SKY = pa.sky.Aoas(sun=pa.Sun(35, 200))
WIDE = pa.Camera(1280, 720, fov=60, azimuth=200, elevation=15)
SMALL = WIDE.resized(320, 180)


def error(picture: np.ndarray, truth: np.ndarray) -> float:
    """Largest error relative to the value plus a thousandth of the largest."""
    return float((np.abs(picture - truth) / (truth + 1e-3 * truth.max())).max())


def median(picture: np.ndarray, truth: np.ndarray) -> float:
    return float(np.median(np.abs(picture - truth) / truth))


def plain(camera: pa.Camera, samples: int) -> np.ndarray:
    """O'Neil's shader as one would write it in numpy: midpoints, his polynomial, all pixels at once."""
    sky = SKY
    to = camera.directions().reshape(-1, 3).astype(np.float32)
    to[:, 2] = np.maximum(to[:, 2], 0)
    sun = np.array(sky.sun.direction, np.float32)
    radius, scale = np.float32(sky.radius_ratio), np.float32(sky.scale_height)

    def depth(cosine: np.ndarray) -> np.ndarray:
        x = 1 - cosine
        return scale * np.exp(-0.00287 + x * (0.459 + x * (3.83 + x * (-6.80 + x * 5.25))))

    up = radius * to[:, 2]
    far = np.sqrt(up**2 + (radius + 1) ** 2 - radius**2) - up
    step = far / samples
    k = 4 * np.pi * (np.array(sky.rayleigh, np.float32) + np.float32(sky.mie))
    start = depth(to[:, 2])
    total = np.zeros_like(to)
    for i in range(samples):
        at = to * (step * np.float32(i + 0.5))[:, None]
        at[:, 2] += radius
        r = np.sqrt((at**2).sum(axis=1))
        density = np.exp((radius - r) / scale)
        optical = start + density * (depth(at @ sun / r) - depth((at * to).sum(axis=1) / r))
        total += np.exp(-optical[:, None] * k) * (density * step)[:, None]
    c = to @ sun
    g = np.float32(sky.g)
    rayleigh = 0.75 * (1 + c * c)
    mie = 1.5 * (1 - g * g) / (2 + g * g) * (1 + c * c) / (1 + g * g - 2 * g * c) ** 1.5
    light = total * (rayleigh[:, None] * np.array(sky.rayleigh, np.float32) + (mie * np.float32(sky.mie))[:, None])
    return (sky.sun_intensity * light).reshape(camera.height, camera.width, 3)


def sunsky() -> tuple[str, object] | None:
    """Mitsuba's sky through the same camera, one sample a pixel."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
    except ImportError:
        return None
    forward = WIDE.directions()[359:361, 639:641].mean((0, 1)).tolist()
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": False},
            "sensor": {
                "type": "perspective",
                "fov": 60,
                "fov_axis": "y",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 0], forward, [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": WIDE.width, "height": WIDE.height, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent", "sample_count": 1},
            },
            "sky": {"type": "sunsky", "sun_direction": list(SKY.sun.direction), "turbidity": 3.0},
        }
    )
    return f"mitsuba {mi.__version__} sunsky (another model)", lambda: mi.render(scene, spp=1)


def threads_against_a_copy() -> Iterator[Row]:
    """Wall time with two threads against copying the frame."""
    pa.set_num_threads(2)
    frame = SKY.render(WIDE)
    truth = SKY.render(SMALL, method="reference")
    styles = {
        "physical": SKY,
        "ambiguity": dataclasses.replace(SKY, ambiguity=0.05),
        "ambiguity and clouds": dataclasses.replace(SKY, ambiguity=0.05, cloud_complexity=4),
        "smiley": pa.sky.preset("smiley"),
        "sun at 1°": dataclasses.replace(SKY, sun=pa.Sun(1, 200)),
    }
    for name, sky in styles.items():
        exact = truth if sky is SKY else sky.render(SMALL, method="reference")
        # At the border of two cells of ambiguity the last bit of a direction decides: the largest error says nothing.
        wrong = (median if sky.ambiguity else error)(sky.render(SMALL), exact)
        contenders = {"pleinair": lambda sky=sky: sky.render(WIDE), "frame.copy()": frame.copy}
        errors = {"pleinair": wrong, "frame.copy()": 0.0}
        task = f"frame, {name}; 2 threads, wall"
        yield from race(ROOM, task, "1280×720", contenders, errors, "1", rounds=40, clock=time.perf_counter)


def preview() -> Iterator[Row]:
    """A changed style: everything from parameters to levels."""
    pa.set_num_threads(2)
    camera = WIDE.resized(640, 360)
    for name, base in (
        ("a plain sky", SKY),
        ("ambiguity and clouds", dataclasses.replace(SKY, ambiguity=0.05, cloud_complexity=4)),
        ("sun at 1°", dataclasses.replace(SKY, sun=pa.Sun(1, 200))),
    ):
        count = iter(range(10**6))

        def change(base: pa.sky.Aoas = base, count: Iterator[int] = count) -> np.ndarray:
            # Never the same twice: nothing may come from the cache.
            sky = dataclasses.replace(base, rayleigh=(0.014 + 1e-8 * next(count), 0.024, 0.049))
            return pa.tone.to_uint8(pa.tone.oneil(sky.render(camera)))

        sky = dataclasses.replace(base, rayleigh=(0.014, 0.024, 0.049))
        truth = sky.render(SMALL, method="reference")
        yield from race(
            *(ROOM, f"preview of a changed style, {name}; 2 threads, wall", "640×360", {"pleinair": change}),
            *({"pleinair": (median if sky.ambiguity else error)(sky.render(SMALL), truth)}, "1"),
            rounds=40,
            clock=time.perf_counter,
        )


def rivals() -> Iterator[Row]:
    """Whole frames on one thread: numpy's port of O'Neil, Mitsuba."""
    pa.set_num_threads(1)
    truth = SKY.render(SMALL, method="reference")
    contenders = {"pleinair": lambda: SKY.render(WIDE)}
    errors = {"pleinair": median(SKY.render(SMALL), truth)}
    for samples in (2, 5):
        name = f"numpy, O'Neil's shader, {samples} samples"
        contenders[name] = lambda samples=samples: plain(WIDE, samples)
        # Above the horizon only: below it pleinair continues the horizon with the true sun angle.
        high = SMALL.directions()[..., 2] > 0
        errors[name] = median(plain(SMALL, samples)[high], truth[high])
    other = sunsky()
    if other is not None:
        contenders[other[0]] = other[1]
    yield from race(ROOM, "frame", "1280×720", contenders, errors, "median", rounds=5, budget=20)


def samples_and_tolerances() -> Iterator[Row]:
    """Eq 3 as printed, O'Neil's midpoints and polynomial, and ours: error against the cost of a frame."""
    pa.set_num_threads(1)
    for sun in (35, 5, -4):
        sky = dataclasses.replace(SKY, sun=pa.Sun(sun, 200))
        truth = sky.render(SMALL, method="reference")
        high = SMALL.directions()[..., 2] > 0
        # The table would hide the cost of samples; 900 directions are integrated one by one.
        few = np.ascontiguousarray(SMALL.directions()[high][::50][:900])
        styles = {}
        knobs = {}
        for tolerance in (1e-3, 1e-1, 3e-2, 1e-2, 3e-4, 1e-4):
            styles[name := f"pleinair, tolerance {tolerance:g}"] = (sky, tolerance)
            knobs[name] = ("pleinair", f"tolerance {tolerance:g}")
        for n in (2, 3, 5, 9, 17):
            knobs[f"O'Neil, {n} midpoints, polynomial"] = ("O'Neil 2005, midpoints and polynomial", f"{n}")
            styles[f"O'Neil, {n} midpoints, polynomial"] = (
                dataclasses.replace(sky, samples=n, optical_depth="oneil", shadow=False),
                1e-3,
            )
        for n in (5, 16, 50, 160):
            knobs[f"eq 3 as printed, {n} samples"] = ("eq 3 as printed", f"{n} samples")
            styles[f"eq 3 as printed, {n} samples"] = (dataclasses.replace(sky, samples=n, sampling="start"), 1e-3)
        contenders, errors = {}, {}
        for name, (style, tolerance) in styles.items():
            if style.samples is None:
                contenders[name] = lambda style=style, tolerance=tolerance: style.render(SMALL, tolerance=tolerance)
            else:
                contenders[name] = lambda style=style, few=few: style.radiance(few)
            errors[name] = median(style.render(SMALL, tolerance=tolerance)[high], truth[high])
        rows = race(
            ROOM, f"single scattering, sun at {sun}°", "320×180", contenders, errors, "median", knobs=knobs, rounds=5
        )
        scale = SMALL.width * SMALL.height / len(few)
        for row in rows:
            stepped = "pleinair" not in row.method
            seconds = row.seconds * (scale if stepped else 1)
            yield dataclasses.replace(row, seconds=seconds, ratio=row.ratio * (scale if stepped else 1))


def single_scattering() -> Iterator[Row]:
    """What the first order alone misses: sasktran2's first order against all of its orders (no time)."""
    with np.load(Path(__file__).parents[1] / "tests" / "oracles" / "data" / "sky_truth.npz") as truth:
        weight = np.exp(-0.5 * ((truth["wavelength"] - 557) / 42) ** 2)
        for elevation, once, all_orders in zip(
            *(truth["aerosol_elevation"], truth["aerosol_single"], truth["aerosol_all"]), strict=True
        ):
            first, every = (np.einsum("wza,w->za", x.astype(float), weight) for x in (once, all_orders))
            missed = float(np.median(1 - first / every))
            task = f"single scattering beside all orders (sasktran2), sun at {elevation:g}°"
            yield Row(ROOM, task, "luminance", "the first order alone", float("nan"), missed, "median", float("nan"))


def mitsubas(sun: pa.Sun, turbidity: float, to: np.ndarray) -> tuple[str, np.ndarray] | None:
    """Luminance of Mitsuba's sky in directions, without its Sun."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
    except ImportError:
        return None
    towards = np.array(sun.direction)
    sky = mi.load_dict(
        {"type": "sunsky", "sun_direction": towards.tolist(), "turbidity": turbidity, "sun_scale": 0.0, "albedo": 0.1}
    )
    values = []
    for d in to:
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*(-d).tolist())
        values.append(pa.color.luminance(np.array(sky.eval(si), float)))
    # 3.9.1 was seen to mirror azimuths in pictures; asked for radiance in a direction, as here, its Sun is where it was put.
    near = int(np.argmax(to @ towards))
    assert values[near] > np.median(values)
    return f"mitsuba {mi.__version__} sunsky (Hosek and Wilkie)", np.array(values)


def peers() -> Iterator[Row]:
    """Clear skies of others, the same directions and the same truth: a Monte Carlo of the default air (no time)."""
    count = np.arange(60) + 0.5
    z = np.sin(np.radians(3)) + (1 - np.sin(np.radians(3))) * count / 60
    turn = np.pi * (3 - np.sqrt(5)) * count
    to = np.stack([np.sqrt(1 - z * z) * np.sin(turn), np.sqrt(1 - z * z) * np.cos(turn), z], axis=1)
    for elevation in (60, 30, 5):
        sun = pa.Sun(elevation, 137)
        far = to[to @ np.array(sun.direction) < np.cos(np.radians(10))]
        value, _ = pa.sky.Physical(sun).monte_carlo(far, 512)
        truth = np.log(pa.color.luminance(value))
        skies = {
            "pleinair Physical": pa.sky.Physical(sun),
            "Preetham, turbidity 2.5": pa.sky.Preetham(sun, turbidity=2.5),
            "CIE 12": pa.sky.CieGeneral(12, sun),
        }
        seen = {name: pa.color.luminance(sky.radiance(far).astype(float)) for name, sky in skies.items()}
        other = mitsubas(sun, 2.5, far)
        if other is not None:
            seen[other[0]] = other[1]
        for name, values in seen.items():
            # One free factor: their units and aerosols differ.
            wrong = float((np.log(values) - truth).std())
            task = f"clear sky beside a Monte Carlo, sun at {elevation}°, one free factor"
            yield Row(
                "realistic_sky", task, f"{len(far)} directions", name, float("nan"), wrong, "rms of ln", float("nan")
            )


def physical() -> Iterator[Row]:
    """A physical sky: its frame, its table, its atmosphere, beside Mitsuba's."""
    pa.set_num_threads(2)
    sky = pa.sky.Physical(sun=pa.Sun(35, 200))
    frame = sky.render(WIDE)
    count = iter(range(10**6))
    suns = {"pleinair": lambda: pa.sky.Physical(sun=pa.Sun(35 + 1e-6 * next(count), 200)).render(SMALL)}
    airs = {"pleinair": lambda: pa.sky.Physical(sun=pa.Sun(35, 200), ozone=300 + 1e-6 * next(count)).probe((0, 0, 1))}
    exact = sky.radiance(SMALL.directions()[::30, ::40], method="reference")
    wrong = error(sky.render(SMALL)[::30, ::40], exact)
    wall = {"rounds": 9, "clock": time.perf_counter}
    contenders = {"pleinair": lambda: sky.render(WIDE), "frame.copy()": frame.copy}
    errors = {"pleinair": wrong, "frame.copy()": 0.0}
    yield from race("realistic_sky", "frame of Physical; 2 threads, wall", "1280×720", contenders, errors, "1", **wall)
    yield from race("realistic_sky", "another Sun; 2 threads, wall", "320×180", suns, {"pleinair": wrong}, "1", **wall)
    task = "another atmosphere, all orders; 2 threads, wall"
    yield from race("realistic_sky", task, "one direction", airs, {"pleinair": 0.014}, "rms", **wall)


def rows() -> Iterator[Row]:
    """Measure."""
    try:
        yield from threads_against_a_copy()
        yield from preview()
        yield from rivals()
        yield from samples_and_tolerances()
        yield from single_scattering()
        yield from peers()
        yield from physical()
    finally:
        pa.set_num_threads(None)

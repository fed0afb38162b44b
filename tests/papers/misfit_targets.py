"""Targets that no parameters of a fitted cloud explain: another cloud, another camera, 8 bits and a camera's tone curve.

`python tests/papers/misfit_targets.py [cases] [seed]` prints how often intervals hold the true value, and how wide they are.
"""

import math
import sys

import numpy as np
import pleinair as pa

NAMES = ("light_intensity", "g", "sigma_t", "albedo", "ambient")
WIDTH, HEIGHT = 96, 72
CLOUDS, VIEWS = 4, 3
SKY = (
    np.array([0.12, 0.25, 0.55]) * np.linspace(0.7, 1.4, HEIGHT)[:, None, None] + np.zeros((HEIGHT, WIDTH, 3))
).astype(np.float32)


def views(rng):
    """Return bases by (Sun, cloud): all of a Sun have the light from the same side of the picture."""
    out = []
    for _ in range(VIEWS):
        elevation, side = rng.uniform(15, 70), rng.uniform(0, 360)
        of_sun = []
        for seed in range(CLOUDS):
            cloud = pa.clouds.procedural("cumulus", (32, 48, 48), voxel_size=40.0, rng=seed)
            middle = np.array([960, 960, 1350.0])
            angle = rng.uniform(0, 2 * np.pi)
            away = np.array([math.sin(angle), math.cos(angle), rng.uniform(-0.25, 0.1)])
            place = middle + rng.uniform(2500, 4000) * away
            camera = pa.Camera.look_at(tuple(place), tuple(middle), WIDTH, HEIGHT, fov=rng.uniform(30, 45))
            sun = pa.Sun(elevation, (camera.azimuth + side) % 360)
            of_sun.append(pa.clouds.Basis.precompute(cloud, camera, sun))
        out.append(of_sun)
    return out


def photographed(light, rng):
    """Return levels by one of three tone curves: sRGB, a shoulder, an S."""
    light, curve = np.clip(light, 0, None), rng.integers(3)
    if curve == 1:
        light = 1.35 * light * (1 + light / 6) / (1 + light)
    levels = pa.color.srgb_encode(np.clip(light, 0, 1))
    if curve == 2:
        levels = 0.35 * levels**2 * (3 - 2 * levels) + 0.65 * levels
    return np.rint(np.clip(levels, 0, 1) * 255).astype(np.uint8)


def targets(count, seed):
    """Yield (photo, basis of another cloud, true parameters by name): parameters are even in the scales of the search."""
    rng = np.random.default_rng(seed)
    bases = views(rng)
    done = 0
    while done < count:
        suns = bases[rng.integers(VIEWS)]
        true, fitted = (suns[i] for i in rng.choice(CLOUDS, 2, replace=False))
        low = max(true.sigma_t[0], fitted.sigma_t[0])
        high = min(true.sigma_t[-1], fitted.sigma_t[-1])
        u = rng.uniform(0, 1, 5)
        values = (10 * u[0], math.tanh(u[1] * math.atanh(0.97)), low * (high / low) ** u[2], u[3], u[4])
        haze = tuple(rng.choice(np.linspace(0, 0.5, 6), 3))
        params = pa.clouds.Params(
            **dict(zip(NAMES, map(float, values), strict=True)), light_color=(1, 0.97, 0.92), haze=haze
        )
        picture = true.image(params, SKY)
        if not 0.05 < picture[true.depth > 0].mean() < 0.95:
            continue  # black or white
        photo = pa.fit.Photo.edited(photographed(picture, rng), true)
        if photo.problems:
            continue
        done += 1
        yield photo, fitted, dict(zip(NAMES, map(float, values), strict=True))


def share(name, value, bounds):
    """Place of a value between its bounds, in the scale of the search."""
    scale = {"sigma_t": math.log, "g": math.atanh}.get(name, float)
    low, high = map(scale, bounds)
    return (scale(value) - low) / (high - low)


def judged(count, seed, generations=50):
    """Return for each parameter which intervals held the true value, and their widths as a share of the box."""
    held, widths = {n: [] for n in NAMES}, {n: [] for n in NAMES}
    ratios = []
    for photo, basis, truth in targets(count, seed):
        fit = pa.fit.clouds(photo, basis, generations=generations, rng=0)
        ratios.append(fit.best.objective / fit.noise)
        for name in NAMES:
            low, high = fit.intervals[name]
            held[name].append(low <= truth[name] <= high)
            widths[name].append(share(name, high, fit.searched[name]) - share(name, low, fit.searched[name]))
    return held, widths, ratios


if __name__ == "__main__":
    given = [int(a) for a in sys.argv[1:]]
    held, widths, ratios = judged(*(given + [160, 5][len(given) :]))
    print(f"O over its noise floor: median {np.median(ratios):.1f}")
    for name in NAMES:
        print(f"{name:16s} inside {np.mean(held[name]):.2f}, median width {np.median(widths[name]):.2f} of the box")

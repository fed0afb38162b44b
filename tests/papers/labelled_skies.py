"""Rendered skies whose clouds are known pixel by pixel: 504 photographs of nine kinds, with a camera's faults.

Skies in cd/m² by `Physical`, clouds of `pleinair.clouds` before them, land below a third, a random camera: exposure, white
balance, tone curve, vignetting, noise, 8 bits. A pixel is cloud where the cloud takes more than a quarter of what is behind
it. Land is rendered too and is no cloud. Seeds are fixed.
"""

from dataclasses import dataclass

import numpy as np
import pleinair as pa
from scipy.ndimage import gaussian_filter

KINDS = ("clear", "cumulus", "thin", "overcast", "glare", "pale", "dusk", "night", "bright gap")
EACH = 56
WIDTH, HEIGHT = 160, 120
OPAQUE = 0.25
# Colour of white paper in the sunshine of noon, linear Rec. 709 over its green.
DAYLIGHT = np.array([1.05, 1.0, 0.95])


@dataclass(frozen=True)
class Labelled:
    """One photograph (HEIGHT, WIDTH, 3) of uint8 and its masks."""

    kind: str
    picture: np.ndarray
    cloud: np.ndarray
    ground: np.ndarray


def _suns(kind, rng):
    low, high = {"dusk": (-3, 3), "night": (20, 60), "pale": (4, 14), "glare": (15, 45)}.get(kind, (15, 65))
    return float(rng.uniform(low, high))


def _shapes():
    """Optical depth for each kind of cloud (rows, columns) and how much light it scatters, of several clouds."""
    sets = {}
    for kind, edges, size, place in (
        ("cumulus", (20.0, 20.0, 20.0), (48, 80, 80), (500, -500, 500)),
        ("stratocumulus", (60.0, 60.0, 20.0), (24, 96, 96), (2880, 2880, 10)),
        ("cirrus", (80.0, 80.0, 40.0), (16, 96, 96), (3840, 3840, 10)),
    ):
        images = []
        for seed in range(4):
            cloud = pa.clouds.procedural(kind, size, voxel_size=edges, rng=seed)
            middle = np.array(cloud.density.shape)[::-1] * edges / 2 + cloud.origin
            for turn in range(2):
                aim = middle if kind == "cumulus" else (middle[0] - 500 + 1000 * turn, middle[1] + 900, cloud.origin[2])
                camera = pa.Camera.look_at(place, tuple(aim), WIDTH, HEIGHT, fov=45 + 10 * turn)
                basis = pa.clouds.Basis.precompute(cloud, camera, pa.Sun(40, 60 + 170 * turn))
                images.append((basis.depth, basis))
        sets[kind] = images
    return sets


def _cloud(kind, sets, rng):
    """Return opacity (rows, columns) and brightness of the scattered light, 1 for white paper in the open."""
    if kind == "overcast":
        noise = sum(gaussian_filter(rng.normal(size=(HEIGHT, WIDTH)), s) * s for s in (12, 6, 3))
        return np.ones((HEIGHT, WIDTH)), 0.5 + 0.08 * noise / noise.std()
    shape = {"thin": "cirrus", "bright gap": "stratocumulus"}.get(kind)
    shape = shape or rng.choice(["cumulus", "stratocumulus"])
    depth, basis = sets[shape][rng.integers(len(sets[shape]))]
    flip = bool(rng.integers(2))
    # Optical depth of the middle of the cloud.
    low, high = {"cirrus": (0.3, 2.0), "cumulus": (3, 20), "stratocumulus": (4, 20)}[shape]
    sigma = float(np.exp(rng.uniform(np.log(low), np.log(high))) / np.median(depth[depth > 0]))
    known = float(np.clip(sigma, basis.sigma_t[0], basis.sigma_t[-1]))
    lit = basis.render(pa.clouds.Params(light_intensity=1.0, g=0.6, sigma_t=known, ambient=0.0))
    opacity = 1 - np.exp(-sigma * depth)
    # Light scattered once, normalised, over a floor of the light of all orders and of the sky.
    once = lit.single.mean(-1) / max(float(np.quantile(lit.single, 0.98)), 1e-9)
    floor = 0.15 if kind == "bright gap" else 0.45
    shade = opacity * (floor + (0.3 if kind == "bright gap" else 0.6) * np.clip(once, 0, 1))
    return (opacity[:, ::-1], shade[:, ::-1]) if flip else (opacity, shade)


def _photograph(light, rng):
    """Return uint8 levels of linear light as a camera writes them."""
    y, x = (np.mgrid[:HEIGHT, :WIDTH] + 0.5) / (HEIGHT, WIDTH)[0] - 0.5
    light = light * rng.uniform(0.93, 1.07, 3) * (1 - rng.uniform(0, 0.35) * (x**2 + y**2))[..., None]
    level = np.quantile(light.mean(-1), rng.uniform(0.8, 0.97))
    light = light * rng.uniform(0.5, 0.85) / max(level, 1e-12)
    if rng.integers(2):  # a shoulder, as most cameras have
        light = light * (1 + light / 2.2) / (1 + light)
    levels = pa.color.srgb_encode(np.clip(light, 0, None)) + rng.normal(0, rng.uniform(0.002, 0.006), light.shape)
    return np.rint(np.clip(levels, 0, 1) * 255).astype(np.uint8)


def _glow(camera, sun):
    """Glare of the lens around the Sun, 1 at its middle."""
    angle = np.degrees(np.arccos(np.clip(camera.directions() @ np.array(sun.direction), -1, 1)))
    return (1 / (1 + (angle / 4.0) ** 2))[..., None]


def labelled_skies(each=EACH):
    """Yield the photographs, kind by kind."""
    sets = _shapes()
    for number, kind in enumerate(KINDS):
        for index in range(each):
            rng = np.random.default_rng([number, index])
            if index % 14 == 0:  # a sky serves fourteen photographs
                sun = pa.Sun(_suns(kind, rng), 180.0)
                haze = {"pale": (4, 8), "night": (2, 4)}.get(kind, (1.8, 4))
                sky = pa.sky.Physical(sun, turbidity=float(rng.uniform(*haze)))
            azimuth = 180 + rng.uniform(-12, 12) if kind == "glare" else rng.uniform(0, 360)
            tilt = {"glare": sun.elevation + rng.uniform(-8, 8), "pale": rng.uniform(4, 14)}.get(
                kind, rng.uniform(14, 60)
            )
            camera = pa.Camera(WIDTH, HEIGHT, float(rng.uniform(35, 60)), azimuth % 360, float(tilt))
            light = np.maximum(sky.without_disc().render(camera).astype(float), 0)
            # White paper in the open; the camera is balanced to that of the day.
            lamp = sky.sun_light()
            lit = np.asarray(lamp.irradiance) * max(np.sin(np.radians(sun.elevation)), 0.02)
            white = (np.asarray(sky.irradiance((0.0, 0.0, 1.0)), float) + lit) / np.pi
            balance = white / white[1]
            if kind == "dusk":  # cameras follow the light half way
                balance = np.sqrt(balance * DAYLIGHT)
            light, white = light / balance, white / balance
            opacity, shade = np.zeros((HEIGHT, WIDTH)), np.zeros((HEIGHT, WIDTH))
            if kind != "clear":
                opacity, shade = _cloud(kind, sets, rng)
                strength = rng.uniform(0.8, 1.2) * (rng.uniform(0.2, 0.5) if kind == "bright gap" else 1.0)
                if kind in ("pale", "dusk"):
                    strength *= 1.5
                light = light * (1 - opacity)[..., None] + strength * shade[..., None] * white
            if kind == "glare":
                light = light + _glow(camera, sun) * rng.uniform(0.5, 2.5) * white
            ground = camera.directions()[..., 2] < 0
            if ground.any() or (index % 3 == 0 and kind != "night"):
                x = np.linspace(0, 1, WIDTH)
                line = rng.uniform(0.75, 0.92) + 0.04 * np.sin(rng.uniform(2, 9) * x + rng.uniform(0, 6))
                ground |= (np.arange(HEIGHT)[:, None] / HEIGHT) > line
                texture = rng.uniform(0.4, 1.6, (HEIGHT, WIDTH, 1))
                color = rng.choice([(0.05, 0.08, 0.02), (0.12, 0.1, 0.06), (0.05, 0.05, 0.05)])
                light = np.where(ground[..., None], color * texture * white, light)
            if kind == "night":
                # Light of the Moon: a millionth of the Sun's, so that little but noise is left of it.
                levels = _photograph(light, rng) / 255 * rng.uniform(0.1, 0.3)
                picture = np.rint(np.clip(levels + rng.normal(0, 0.01, light.shape), 0, 1) * 255).astype(np.uint8)
            else:
                picture = _photograph(light, rng)
            yield Labelled(kind, picture, (opacity > OPAQUE) & ~ground, ground)

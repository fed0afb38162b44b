"""Settings that every test may change are put back after it."""

import csv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def _settings():
    import pleinair
    from pleinair import _core

    yield
    pleinair.set_num_threads(None)
    _core.force_simd_level(None)


@pytest.fixture(scope="session")
def measured():
    """Daylight and twilight by site and elevation of the Sun (shared/data/README.md)."""
    path = Path(__file__).parents[2] / "shared" / "data" / "measured" / "spitschan2016_by_elevation.csv"
    if not path.exists():
        pytest.skip("the measurements are in shared/data, which is absent")
    with path.open() as stream:
        return {(r["site"], int(r["elev_deg"])): r for r in csv.DictReader(stream)}


class LobeSky:
    """A smooth sky in closed form, unlike itself in every direction: a gradient and a lobe off every axis."""

    axis = np.array([0.48, 0.64, 0.6])  # east of north, and up

    def radiance(self, directions):
        d = np.asarray(directions, float)
        x, y, z = d[..., :1], d[..., 1:2], d[..., 2:]
        gradient = np.concatenate([2 + x, 2 + y, 2 + z], axis=-1)
        lobe = np.exp(12 * (np.sum(d * self.axis, axis=-1, keepdims=True) - 1))
        return (gradient + lobe * [30.0, 20, 10]).astype(np.float32)

    def panorama_directions(self, height):
        elevation = np.pi / 2 - np.pi * (np.arange(height)[:, None] + 0.5) / height
        azimuth = np.pi * (np.arange(2 * height) + 0.5) / height
        flat = np.cos(elevation)
        parts = np.broadcast_arrays(flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(elevation))
        return np.stack(parts, axis=-1)

    def panorama(self, height):
        return self.radiance(self.panorama_directions(height))

    def render(self, camera):
        return self.radiance(camera.directions())

    def irradiance(self, normals, height=256):
        """By the midpoint rule over the panorama."""
        d = self.panorama_directions(height)
        weight = np.sqrt(1 - d[..., 2:] ** 2) * (np.pi / height) ** 2
        cosine = np.maximum(np.asarray(normals, float) @ d.reshape(-1, 3).T, 0)
        return cosine @ (weight * self.radiance(d)).reshape(-1, 3)

    def sun_light(self):
        return SimpleNamespace(direction=tuple(self.axis), irradiance=(3.0, 2.0, 1.5), angular_radius=0.2666)

    def sh9(self):
        return np.arange(27.0).reshape(9, 3)


@pytest.fixture(scope="session")
def lobe_sky():
    return LobeSky()

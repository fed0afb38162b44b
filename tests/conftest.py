"""Settings that every test may change are put back after it; data; the skips that are accepted."""

import csv
import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

ACCEPTED = Path(__file__).with_name("accepted_skips.txt")


class Skips:
    """Lists every skip whose reason `accepted_skips.txt` does not have; where CI is set, one of them fails the run."""

    def __init__(self, accepted):
        lines = (line.strip() for line in accepted.read_text().splitlines())
        self.accepted = {line for line in lines if line and not line.startswith("#")}
        self.found = set()

    def pytest_runtest_logreport(self, report):
        if report.skipped and not hasattr(report, "wasxfail"):
            reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
            self.found.add((report.nodeid.partition("[")[0], reason.removeprefix("Skipped: ")))

    pytest_collectreport = pytest_runtest_logreport

    def new(self):
        return sorted((test, reason) for test, reason in self.found if reason not in self.accepted)

    def pytest_sessionfinish(self, session, exitstatus):
        if self.new() and os.environ.get("CI") and exitstatus == 0:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter):
        if self.new():
            terminalreporter.section("skips that tests/accepted_skips.txt does not have")
            for test, reason in self.new():
                terminalreporter.line(f"{test}: {reason}")


def pytest_configure(config):
    if not hasattr(config, "workerinput"):  # where the reports of all workers come together
        config.pluginmanager.register(Skips(ACCEPTED))


@pytest.fixture(autouse=True)
def _settings():
    import pleinair
    from pleinair import _core

    yield
    pleinair.set_num_threads(None)
    _core.force_simd_level(None)


@pytest.fixture(scope="session")
def data():
    """The folder of measured data (tests/data/README.md)."""
    return Path(__file__).with_name("data")


@pytest.fixture(scope="session")
def not_committed():
    """Give the path of a file that may not be committed, or skip."""

    def path(name):
        found = Path(os.environ.get("PLEINAIR_DATA", os.devnull), name)
        if not found.exists():
            pytest.skip("may not be committed: PLEINAIR_DATA names no folder that has it")
        return found

    return path


@pytest.fixture(scope="session")
def measured(data):
    """Daylight and twilight by site and elevation of the Sun."""
    with (data / "spitschan2016_by_elevation.csv").open() as stream:
        return {(r["site"], int(r["elev_deg"])): r for r in csv.DictReader(stream)}


@pytest.fixture(scope="session", params=["rough", "RICO"])
def rough(request):
    """A cumulus with extinctions up to 2.1 a voxel: of a large-eddy simulation (GPL), and ours, as deep and rougher."""
    from pleinair.clouds import Volume

    beta = np.zeros((26, 37, 32))
    if request.param == "RICO":
        rows = np.loadtxt(
            request.getfixturevalue("not_committed")("volumes/rico32x37x26.txt"), delimiter=",", skiprows=5
        )
        x, y, z = rows[:, :3].astype(int).T
        beta[z, y, x] = 1.5 * rows[:, 3] / np.maximum(rows[:, 4], 1e-9)
    else:
        z, y, x = np.indices(beta.shape)
        height = 1 - ((z - 12.5) / 11) ** 2 - ((y - 18) / 15) ** 2 - ((x - 15.5) / 13) ** 2
        noise = np.random.default_rng(7).lognormal(0, 0.5, beta.shape)
        beta[height > 0.35] = ((0.2 + height) * noise)[height > 0.35]
        beta *= 0.105 / beta.max()
    return Volume(beta, (20.0, 20.0, 40.0), (0, 0, 420))


@pytest.fixture(scope="session")
def eye():
    """Give what a display shows of light of a sky with no lamp in view, linear in [0, 1]: as `Scene.backdrop` says."""
    import pleinair as pa

    def shown(sky, rgb):
        eye = sky.adaptation()
        rgb = np.asarray(rgb, np.float32)
        if sky.absolute:
            return pa.tone.present(rgb, eye, white=10 * eye)
        # Between the log-average of the sky and grey ground, of which the adaptation is the mean, and as by day.
        upper = pa.color.luminance(sky.without_disc().panorama(32)[:16].astype(float))
        edges = np.cos(np.linspace(0, np.pi / 2, 17))
        dome = np.exp((np.log(np.maximum(upper, 1e-8)).mean(axis=1) * (edges[:-1] - edges[1:])).sum())
        eye = np.sqrt(dome * max(2 * eye - dome, 1e-8))
        return pa.tone.present(rgb * np.float32(3000 / eye), 3000.0, False, white=3e4)

    return shown


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

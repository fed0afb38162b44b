"""Procedural kinds by what they look like in numbers; the simulation by conservation laws and closed forms."""

import dataclasses
import hashlib
import math
import subprocess
import sys

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core
from pleinair.clouds import generators

procedural, simulated = pa.clouds.procedural, pa.clouds.simulated
KINDS = ("cumulus", "cumulonimbus", "stratocumulus", "cirrus")
SHAPES = {
    "cumulus": (48, 80, 80),
    "cumulonimbus": (80, 80, 80),
    "stratocumulus": (24, 96, 96),
    "cirrus": (32, 96, 96),
}


def digest(a):
    return hashlib.sha256(np.ascontiguousarray(a)).hexdigest()


# ---- Procedural kinds.


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rng", [0, 1, 2])
def test_every_kind_is_a_cloud_in_its_box(kind, rng):
    d = procedural(kind, SHAPES[kind], rng=rng).density
    assert d.max() == (np.float32(0.1) if kind == "cirrus" else 1)
    assert d.min() == 0
    assert not d[[0, -1]].any()
    if kind != "stratocumulus":
        assert not d[:, [0, -1]].any()
        assert not d[:, :, [0, -1]].any()
    assert not np.array_equal(d, procedural(kind, SHAPES[kind], rng=rng + 10).density)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", [(8, 8, 8), (8, 30, 11), (64, 8, 8), (9, 8, 64), (40, 24, 64), (12, 200, 12)])
def test_every_kind_fills_the_boxes_nobody_thinks_of(kind, shape):
    cloud = procedural(kind, shape, voxel_size=(1e-9, 1e9, 3), rng=1)
    assert cloud.density.shape == shape
    assert 0 < (cloud.density > 0).mean() < 0.95


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_do_not_depend_on_threads_or_processes(kind):
    code = f"import pleinair as pa; print(__import__('hashlib').sha256(pa.clouds.procedural({kind!r}, (20, 30, 34), rng=5).density).hexdigest())"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    for threads in (1, 2, 5):
        pa.set_num_threads(threads)
        assert digest(procedural(kind, (20, 30, 34), rng=5).density) == other


@pytest.mark.parametrize("rng", range(4))
def test_a_cumulonimbus_is_a_tower_with_a_wider_anvil_on_a_flat_base(rng):
    d = procedural("cumulonimbus", (96, 96, 96), rng=rng).density
    area = (d > 0.05).sum(axis=(1, 2))
    layers = np.flatnonzero(area)
    low, high = layers[0], layers[-1]
    assert high - low > 70, "it fills its box's height"
    share = (np.arange(96) - low) / (high - low)
    anvil, waist = area[share > 0.8].max(), area[(share > 0.55) & (share < 0.75)].min()
    assert anvil > 2 * waist
    # The base: lowest filled voxels of the columns under the tower's foot lie within a few voxels.
    foot = np.argmax(d > 0.05, axis=0)[(d[: low + 12] > 0.05).any(axis=0)]
    assert np.percentile(foot, 80) - foot.min() <= 7


@pytest.mark.parametrize("rng", range(4))
def test_a_cumulus_has_a_flat_base(rng):
    d = procedural("cumulus", (64, 96, 96), rng=rng).density
    foot = np.argmax(d > 0.02, axis=0)[(d > 0.02).any(axis=0)]
    assert (foot <= foot.min() + 4).mean() > 0.5


@pytest.mark.parametrize("rng", range(4))
def test_stratocumulus_covers_the_sky_in_a_layer(rng):
    d = procedural("stratocumulus", (32, 160, 160), rng=rng).density
    cover = (d > 0.02).any(axis=0)
    assert 0.7 < cover.mean() < 0.999, "most of the sky, with gaps"
    for side in (cover[0], cover[-1], cover[:, 0], cover[:, -1]):
        assert side.mean() > 0.3, "up to the side faces"
    foot = np.argmax(d > 0.02, axis=0)[cover]
    assert np.std(foot) < 2.5, "a flat base"
    # Cells: the thickness varies on scales much below the box's.
    path = d.sum(axis=0)
    assert np.std(path) > 0.2 * path.mean()
    quarters = path.reshape(2, 80, 2, 80).mean(axis=(1, 3))
    assert np.std(quarters) < 0.35 * quarters.mean(), "and every part of the box has some"


@pytest.mark.parametrize("rng", range(4))
def test_cirrus_is_thin_and_streaky(rng):
    cloud = procedural("cirrus", (40, 128, 128), voxel_size=40.0, rng=rng)
    depth = cloud.density.astype(float).sum(axis=0) * 40 * pa.clouds.Params().sigma_t
    # Visible cirrus has optical depths of 0.03 to 0.3, thick ones up to 3 (Sassen and Cho 1992).
    assert 1e-3 < depth.mean() < 0.3
    assert depth.max() < 3
    # Streaks: what changes along x, the direction of the wind to 20°, changes faster across it.
    y, x = (np.abs(np.diff(depth, axis=axis)).mean() for axis in (0, 1))
    assert y > 1.3 * x


def test_wrong_arguments_of_kinds_are_named():
    with pytest.raises(ValueError, match=r"kind must be one of 'cumulus', 'cumulonimbus'.*'cirus'"):
        procedural("cirus")
    with pytest.raises(ValueError, match=r"shape\[1\] must be in \[8, 4096\], got 7"):
        procedural("cirrus", (8, 7, 8))
    for name in ("voxel_size", "origin"):
        with pytest.raises(ValueError, match=name):
            procedural("cirrus", (4000, 4000, 4000), **{name: (1, math.nan, 1)})  # refused before the work


# ---- The simulation. Constants from outside: CODATA and the usual ones of moist air.

CP, G, L = 1004.7, 9.80665, 2.5008e6
USUAL = {
    "shape": (24, 24, 24),
    "voxel_size": 80.0,
    "duration": 1000.0,
    "times": None,
    "step": 10.0,
    "heat": 500.0,
    "radius": None,
    "unevenness": 0.5,
    "temperature": 298.0,
    "humidity": 0.7,
    "lapse": 0.0058,
    "confinement": 0.15,
    "rng": 3,
}


@dataclasses.dataclass
class Run:
    clouds: list
    steps: list
    water: np.ndarray
    temperature: np.ndarray
    velocity: tuple
    edges: tuple

    @property
    def cloud(self):
        return self.clouds[-1]

    @property
    def energy(self):
        """T + (g z − L q_c) / c_p in kelvins."""
        z = (np.arange(self.cloud.shape[0]) + 0.5) * self.edges[2]
        return self.temperature.astype(float) + (G * z[:, None, None] - L * self.cloud) / CP


def run(**changes):
    weather = dataclasses.replace(generators._weather(**(USUAL | changes)), keep_all_fields=True)
    clouds, steps, air = _core.clouds_simulated(weather)
    water, temperature, u, v, w, _ = (a.reshape(weather.shape) for a in air)
    clouds = [c.reshape(weather.shape).astype(float) for c in clouds]
    return Run(clouds, steps, water, temperature, (u, v, w), weather.voxel_size)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"shape": (20, 9, 31), "voxel_size": (120.0, 60.0, 90.0)},
        {"heat": 4000.0, "confinement": 0.5},
        {"humidity": 0.95, "temperature": 305.0, "lapse": 0.0085},
    ],
    ids=["usual", "oblong", "violent", "tropical"],
)
def test_water_and_energy_are_conserved(changes):
    before, after = run(**changes, times=[0.0]), run(**changes)
    assert after.cloud.max() > 1e-4, "something has happened"
    total = before.water.sum(dtype=float)
    assert abs(after.water.sum(dtype=float) / total - 1) < 1e-5
    assert after.water.min() > -1e-6
    assert (after.cloud <= after.water + 1e-7).all()


def test_energy_rises_by_the_heat_that_was_put_in():
    changes = {"unevenness": 0.0, "radius": 400.0}
    before, after = run(**changes, times=[0.0]), run(**changes)
    x = (np.arange(24) + 0.5 - 12) * 80 / 400
    power = 500 * np.exp(-(x[:, None] ** 2) - x**2).sum() * 80**2  # W
    density = 101325 / 287.05 / 298.0
    gained = (after.energy - before.energy).sum() * density * CP * 80**3
    assert gained / (power * 1000) == pytest.approx(1, abs=2e-3)


def test_the_wind_has_no_divergence_and_passes_no_wall():
    r = run()
    u, v, w = (a.astype(float) for a in r.velocity)
    assert not u[:, :, 0].any()
    assert not v[:, 0].any()
    assert not w[0].any()
    wide = [np.concatenate([a, np.zeros_like(np.take(a, [0], axis))], axis) for a, axis in ((u, 2), (v, 1), (w, 0))]
    div = sum(np.diff(a, axis=axis) for a, axis in zip(wide, (2, 1, 0), strict=True))
    speed = max(np.abs(a).max() for a in (u, v, w))
    assert speed > 2
    assert np.abs(div).max() < 1e-5 * speed


@pytest.mark.parametrize("humidity", [0.05, 0.7, 0.95])
def test_without_heat_the_air_stays_at_rest(humidity):
    start, r = run(heat=0.0, humidity=humidity, times=[0.0]), run(heat=0.0, humidity=humidity, duration=2000.0)
    assert not any(a.any() for a in r.velocity)
    assert not r.cloud.any()
    assert np.array_equal(r.water, start.water)
    assert np.array_equal(r.temperature, start.temperature)


def test_dry_air_makes_no_cloud_and_says_so():
    with pytest.warns(pa.DomainWarning, match="no cloud has formed"):
        cloud = simulated((16, 16, 16), voxel_size=100, humidity=0.05, duration=300, rng=1)
    assert not cloud.density.any()


@pytest.mark.parametrize(("temperature", "humidity"), [(298, 0.8), (298, 0.7), (298, 0.6), (285, 0.65), (308, 0.7)])
def test_the_base_lies_at_the_lifting_condensation_level(temperature, humidity):
    # Bolton 1980, eq 22: the temperature at which lifted air condenses; dry air cools by g / c_p.
    condenses = 1 / (1 / (temperature - 55) - math.log(humidity) / 2840) + 55
    level = (temperature - condenses) * CP / G
    r = run(temperature=temperature, humidity=humidity, shape=(40, 24, 24), voxel_size=(80.0, 80.0, 50.0))
    base = np.flatnonzero((r.cloud > 1e-5).any(axis=(1, 2)))[0] * 50.0
    # The air that rises is up to half a kelvin warmer than the ground was, and a cell is 50 m high.
    assert level - 50 <= base <= level + 50 + 125 * 0.5


def test_a_cloudy_parcel_is_saturated_and_what_is_not_has_no_droplets():
    # Saturation after Tetens as in the WMO guide, not the formula of the core: they agree to 1 %.
    r = run()
    p = 101325 * (1 - 0.0065 / 298 * (np.arange(24) + 0.5) * 80) ** 5.2559
    e = 611.2 * np.exp(17.62 * (r.temperature - 273.15) / (r.temperature - 30.03))
    holds = 0.622 * e / (p[:, None, None] - 0.378 * e)
    vapour, cloudy = r.water - r.cloud, r.cloud > 1e-5
    assert cloudy.sum() > 50
    np.testing.assert_allclose(vapour[cloudy], holds[cloudy], rtol=0.015)
    assert (vapour <= holds * 1.015).all()


def test_an_even_patch_grows_an_even_cloud():
    c = run(unevenness=0.0, duration=900.0).cloud
    assert c.max() > 1e-4
    for mirrored in (c[:, ::-1], c[:, :, ::-1], c.transpose(0, 2, 1)):
        np.testing.assert_allclose(mirrored, c, atol=1e-3 * c.max())


@pytest.mark.parametrize("step", [0.5, 3.0, 10.0, 60.0])
def test_any_accepted_step_is_stable_and_long_ones_change_little(step):
    r, fine = run(step=step, unevenness=0.0), run(step=2.0, unevenness=0.0)
    speed = max(np.abs(a).max() for a in r.velocity)
    assert 2 < speed < 25
    assert r.cloud.sum() == pytest.approx(fine.cloud.sum(), rel=0.25)
    if step < 3:
        assert r.steps[-1] >= 1000 / step


@pytest.mark.parametrize(
    "changes",
    [
        {"heat": 20_000.0, "confinement": 0.5, "step": 60.0, "duration": 400.0},
        {"lapse": 0.00976, "humidity": 0.95, "temperature": 320.0, "step": 60.0},
        {"shape": (16, 8, 8), "voxel_size": 1000.0, "temperature": 250.0, "step": 60.0, "duration": 7200.0},
        {"shape": (100, 8, 8), "voxel_size": 1.0, "step": 60.0, "duration": 60.0},
        {"shape": (8, 40, 8), "voxel_size": (1000.0, 1.0, 500.0), "step": 60.0, "duration": 20.0},
        {"radius": 1.0, "heat": 20_000.0},
        {"radius": 1e6, "heat": 2000.0},
    ],
)
def test_extreme_weather_stays_finite_and_conserves_water(changes):
    before, r = run(**changes, times=[0.0]), run(**changes)
    assert all(np.isfinite(a).all() for a in (r.water, r.temperature, *r.velocity))
    assert abs(r.water.sum(dtype=float) / before.water.sum(dtype=float) - 1) < 1e-5
    assert max(np.abs(a).max() for a in r.velocity) < 150


def test_times_make_an_animation_on_one_scale():
    kw = {"voxel_size": 80.0, "rng": 3}
    clouds = simulated((24, 24, 24), times=[0, 900, 900, 1000], **kw)
    assert [c.density.max() > 0 for c in clouds] == [False, True, True, True]
    assert clouds[1] == clouds[2]
    assert max(c.density.max() for c in clouds) == 1
    alone = simulated((24, 24, 24), duration=900, **kw)
    np.testing.assert_allclose(alone.density * clouds[1].density.max(), clouds[1].density, atol=1e-6)


def test_the_default_cumulus_stays_clear_of_its_box():
    d = simulated((32, 32, 32), voxel_size=64.0, rng=1).density
    assert (d > 0.01).mean() > 0.01
    for face in (d[0], d[-1], d[:, 0], d[:, -1], d[:, :, 0], d[:, :, -1]):
        assert not face.any()


def test_the_simulation_does_not_depend_on_threads_levels_or_processes():
    kw = "(12, 17, 14), voxel_size=120, duration=1000, rng=2"
    code = f"import pleinair as pa; print(__import__('hashlib').sha256(pa.clouds.simulated({kw}).density).hexdigest())"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    for threads in (1, 2, 3):
        pa.set_num_threads(threads)
        for level in _core.simd_levels():
            _core.force_simd_level(level)
            got = simulated((12, 17, 14), voxel_size=120, duration=1000, rng=2).density
            assert digest(got) == other, (threads, level)


def test_progress_rises_to_its_total():
    seen = []
    simulated((24, 24, 24), voxel_size=80, duration=600, rng=1, progress=lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen)
    assert seen[-1] == (1000, 1000)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("step", 0),
        ("step", 61),
        ("step", math.nan),
        ("duration", 0),
        ("duration", math.nan),
        ("times", []),
        ("times", [3, 2]),
        ("times", [math.nan]),
        ("heat", -1),
        ("heat", math.nan),
        ("radius", 0),
        ("radius", math.inf),
        ("unevenness", 1.5),
        ("temperature", 20),
        ("humidity", 1.0),
        ("humidity", math.nan),
        ("lapse", 0.01),
        ("confinement", 0.51),
        ("voxel_size", 1e9),
        ("voxel_size", (10, math.nan, 10)),
        ("shape", (7, 8, 8)),
        ("shape", (513, 8, 8)),
        ("shape", 24),
        ("origin", (0, math.nan, 0)),
    ],
)
def test_wrong_weather_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=name):
        simulated(**({"shape": (24, 24, 24)} | {name: value}))


def test_a_box_of_a_foreign_height_is_refused():
    with pytest.raises(ValueError, match="voxel_size"):
        simulated((64, 8, 8), voxel_size=(100, 100, 900))
    with pytest.raises(ValueError, match="voxel_size"):
        simulated((8, 8, 8), voxel_size=10)


def test_wrong_kinds_of_things_are_type_errors():
    for name, value in (("heat", "much"), ("step", None), ("shape", (8, 8, 8.0)), ("progress", 3), ("rng", "seed")):
        with pytest.raises(TypeError, match=name):
            simulated(**({"shape": (24, 24, 24)} | {name: value}))

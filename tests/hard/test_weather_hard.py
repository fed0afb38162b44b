"""Weather at its ends: a Sun too high for a bow, at the horizon, a Moon's bow, fog, walls, roofs, no light, wrong numbers."""

import math
import pickle
from dataclasses import fields, replace

import numpy as np
import pleinair as pa
import pytest
from pleinair import Camera, Moon, Scene, Sun
from pleinair.color import luminance
from pleinair.paint import Strokes
from pleinair.sky import Aoas, Natural
from pleinair.weather import Fog, Overcast, Rain, Rainbow, Snow

VIEW = Camera(48, 32, fov=60, azimuth=0, elevation=10, position=(0, 0, 2))
SKY = Natural(sun=Sun(20, 180))


def column(sky, weather, low=0.3, high=80.0, azimuth=0.0):
    elevation = np.arange(low, high, 0.1)
    e, a = np.radians(elevation), math.radians(azimuth)
    to = np.stack([np.cos(e) * math.sin(a), np.cos(e) * math.cos(a), np.sin(e)], axis=-1)
    return elevation, pa.scene.Weathered(sky, weather).radiance(to).astype(float)


def test_at_43_degrees_the_primary_has_set_and_the_secondary_stands_8_high():
    # Even drops, so that the secondary's light is beside nothing.
    sky = Natural(sun=Sun(43, 180))
    elevation, seen = column(sky, Rainbow(optical_depth=3), 0.3, 20)
    _, none = column(sky, Rainbow(optical_depth=3, lit=0), 0.3, 20)
    bow = seen[:, 0] - none[:, 0]
    at = elevation[bow.argmax()]
    assert abs(at - (50.9 - 43)) < 0.5


def test_at_sunset_it_is_half_a_circle():
    sky = Natural(sun=Sun(0.5, 180))
    for azimuth in (0, 20, 35):
        elevation, seen = column(sky, Rainbow(), azimuth=azimuth, high=50)
        _, none = column(sky, Rainbow(lit=0), azimuth=azimuth, high=50)
        top = elevation[(seen - none)[:, 0].argmax()]
        # As far from the antisolar point, half a degree below the horizon, at every azimuth: 42.2° of red by Descartes.
        cosine = math.cos(math.radians(top)) * math.cos(math.radians(azimuth)) * math.cos(math.radians(0.5))
        cosine -= math.sin(math.radians(top)) * math.sin(math.radians(0.5))
        assert abs(math.degrees(math.acos(cosine)) - 42.2) < 0.6


def test_the_moon_has_a_bow():
    night = Natural(sun=Sun(-40, 20), moon=Moon(20, 180))
    elevation, seen = column(night, Rainbow(), high=40)
    _, none = column(night, Rainbow(lit=0), high=40)
    bow = (seen - none)[:, 0]
    assert bow.max() > 0
    assert abs(elevation[bow.argmax()] - 22.4) < 0.7


def test_a_shaded_shower_has_none():
    _, seen = column(SKY, Rainbow(lit=0), high=40)
    _, thin = column(SKY, Rainbow(lit=0.5), high=40)
    _, full = column(SKY, Rainbow(), high=40)
    np.testing.assert_allclose(thin - seen, 0.5 * (full - seen), rtol=0.02, atol=0.5)


@pytest.mark.parametrize("sky", [SKY, Aoas(sun=Sun(20, 180))])
def test_every_weather_is_finite_under_every_kind_of_sky(sky):
    weather = [Fog(), Rain(), Rain(distance=500, width=40), Rainbow(), Snow()]
    for one in weather:
        seen = Scene(sky, [Strokes([[0, 12, 1]], (0, -1, 0), (4, 4))], weather=one).paint(VIEW)
        assert np.isfinite(seen).all()
        assert seen.max() > 0.02


def test_a_wall_and_a_place_under_a_roof_stay_bare():
    n = 40
    x, y = np.meshgrid(np.linspace(-3, 3, n), np.linspace(9, 15, n))
    floor = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    roof = np.add(floor, (0, 0, 2.5))
    wall = np.stack([x, 16 + 0 * y, y - 9], axis=-1).reshape(-1, 3)

    def strokes(places, normal):
        return Strokes(places, normal, (0.4, 0.4), material="rock")

    def mean(objects, lying, camera):
        return luminance(Scene(SKY, objects, weather=Snow(rate=0, lying=lying)).radiance(camera)).mean()

    down = Camera(24, 24, fov=15, azimuth=0, elevation=-10, position=(0, -2, 2.4))
    open_ = mean([strokes(floor, (0, 0, 1))], 1.0, down) / mean([strokes(floor, (0, 0, 1))], 0.0, down)
    under = [strokes(floor, (0, 0, 1)), strokes(roof, (0, 0, 1))]
    covered = mean(under, 1.0, down) / mean(under, 0.0, down)
    assert open_ > 1.5
    assert covered < 0.5 * (1 + open_)
    ahead = Camera(24, 24, fov=8, azimuth=0, elevation=5, position=(0, -2, 2))
    upright = [strokes(wall, (0, -1, 0))]
    assert mean(upright, 1.0, ahead) == pytest.approx(mean(upright, 0.0, ahead), rel=1e-6)


def test_rain_without_light_is_black():
    dark = Natural(sun=Sun(-40, 0), airglow=0.0, stars=None) if "airglow" in {f.name for f in fields(Natural)} else None
    sky = dark or Natural(sun=Sun(-40, 0))
    seen = Scene(sky, weather=[Rain(rate=20)]).radiance(VIEW)
    bare = Scene(sky).radiance(VIEW)
    assert np.isfinite(seen).all()
    assert seen.max() <= bare.max() + 1e-3


@pytest.mark.parametrize("kind", [Fog, Overcast, Rain, Rainbow, Snow])
def test_wrong_numbers_are_refused_by_name(kind):
    for field in fields(kind):
        for wrong in (math.nan, -1e9, math.inf, "much", None):
            if field.name in ("wet", "seed", "wind"):
                continue
            with pytest.raises((ValueError, TypeError), match=field.name):
                kind(**{field.name: wrong})


def test_wrong_kinds_are_refused():
    with pytest.raises(TypeError, match="weather must be"):
        Scene(SKY, weather=["rain"])
    with pytest.raises(TypeError, match="wind"):
        Rain(wind=3)
    with pytest.raises(TypeError, match="Natural or Physical"):
        Scene(Aoas(sun=Sun(20, 180)), weather=Overcast())
    with pytest.raises(ValueError, match="one Overcast"):
        Scene(SKY, weather=[Overcast(), Overcast()])


def test_any_number_of_threads_gives_the_same_bits():
    camera = replace(VIEW, width=400, height=300)
    weather = [Fog(visibility=2000), Rain(distance=300, width=50), Rain(rate=8), Snow()]
    found = []
    for threads in (1, 2):
        pa.set_num_threads(threads)
        try:
            found.append(Scene(SKY, weather=weather).radiance(camera))
        finally:
            pa.set_num_threads(None)
    assert (found[0] == found[1]).all()


def test_what_falls_is_a_function_of_time():
    scene = Scene(SKY, weather=[Rain(rate=20, wet=False)])
    first, later, again = (replace(scene, time=t).radiance(VIEW) for t in (0.0, 0.02, 0.0))
    assert (first == again).all()
    assert (first != later).any()


def test_weather_survives_pickle_and_files(tmp_path):
    scene = Scene(SKY, weather=[Fog(), Overcast(), Rain(), Rainbow(), Snow()])
    assert pickle.loads(pickle.dumps(scene)).weather == scene.weather
    assert Scene.load(scene.save(tmp_path / "a.toml")).weather == scene.weather

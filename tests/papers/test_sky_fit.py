"""The sky style of a picture: styles that are known come back, and the answer says how close it is."""

import json

import numpy as np
import pleinair as pa
import pytest
from skimage.color import deltaE_cie76, rgb2lab

CAMERA = pa.Camera(72, 48, 60, 180, 20)


def style(seed):
    rng = np.random.default_rng(seed)
    vector = np.exp(rng.uniform(np.log(0.003), np.log(0.06), 3))
    sun = pa.Sun(rng.uniform(2, 70), rng.uniform(90, 270))
    mie, g = float(np.exp(rng.uniform(np.log(1e-4), np.log(5e-3)))), float(rng.uniform(0.8, 0.99))
    return pa.sky.Aoas(sun, tuple(vector), mie=mie, g=g, sun_intensity=float(rng.uniform(10, 60)))


def difference(a, b):
    """Median ΔE by scikit-image."""
    return float(np.median(deltaE_cie76(*(rgb2lab(pa.color.srgb_encode(x)) for x in (a, b)))))


def test_styles_come_back():
    """`benches/bench_fit.py` has twenty."""
    differences = []
    for seed in range(5):
        picture = pa.tone.oneil(style(seed).render(CAMERA), 2.0)
        found = pa.fit.sky(picture, camera=CAMERA, rng=seed)
        shown = pa.tone.oneil(found.sky.render(CAMERA), found.exposure)
        differences.append(difference(shown, picture))
        assert found.difference == pytest.approx(differences[-1], abs=0.15), "what it says is what it is"
        assert found.calls == 1500
    assert np.median(differences) <= 2


def test_what_shows_is_known_and_what_does_not_is_said():
    truth = style(1)
    picture = pa.tone.oneil(truth.render(CAMERA), 2.0)
    found = pa.fit.sky(picture, camera=CAMERA, generations=100, rng=0)
    low, high = found.intervals["elevation"]
    assert low - 5 <= truth.sun.elevation <= high + 5
    assert all(a <= b for a, b in found.intervals.values())
    assert found.ranked[0][1] <= found.ranked[-1][1]


def test_the_answer_travels():
    picture = pa.tone.oneil(style(2).render(CAMERA), 2.0)
    found = pa.fit.sky(picture, generations=5, rng=3)
    again = json.loads(found.to_json())
    assert pa.sky.from_json(json.dumps(again["sky"])) == found.sky
    assert again["fit"]["difference"] == found.difference
    assert found.preview().shape == (48, 144, 3)
    np.testing.assert_array_equal(found.preview()[:, :72], picture)
    same = pa.fit.sky(picture, generations=5, rng=3)
    assert same.sky == found.sky


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"picture": np.full((8, 8, 3), np.nan)}, "finite"),
        ({"picture": np.zeros((8, 8))}, "picture"),
        ({"model": "magic"}, "model must be one of"),
        ({"mask": np.zeros((8, 8), bool)}, "leave some"),
        ({"mask": np.ones((4, 8), bool)}, "mask must have shape"),
        ({"exposure": 0}, "exposure"),
        ({"generations": 0}, "generations"),
    ],
)
def test_wrong_arguments_are_named(change, words):
    arguments = {"picture": np.ones((8, 8, 3), np.float32), "rng": 0} | change
    with pytest.raises((ValueError, TypeError), match=words):
        pa.fit.sky(arguments.pop("picture"), **arguments)


def test_one_pixel_has_an_answer():
    assert pa.fit.sky(np.full((1, 1, 3), 0.4), generations=3, rng=0).calls == 60


@pytest.mark.parametrize("seed", range(4))
def test_the_air_of_our_own_renders_lies_in_its_intervals(seed):
    rng = np.random.default_rng(seed)
    truth = pa.sky.Physical(
        pa.Sun(rng.uniform(3, 65), rng.uniform(60, 300)),
        turbidity=float(np.exp(rng.uniform(np.log(1.7), np.log(8)))),
        ozone=float(rng.uniform(250, 400)),
    )
    light = truth.render(CAMERA)
    picture = np.clip(light * (0.5 / np.quantile(light, 0.9)), 0, 1).astype(np.float32)
    found = pa.fit.sky(picture, "physical", camera=CAMERA, rng=seed)
    known = {"elevation": truth.sun.elevation, "azimuth": truth.sun.azimuth - CAMERA.azimuth}
    for name, value in (known | {"turbidity": truth.turbidity, "ozone": truth.ozone}).items():
        low, high = found.intervals[name]
        assert low <= value <= high, (name, value, low, high)
    assert found.difference < 0.6
    assert found.sky.turbidity == pytest.approx(truth.turbidity, rel=0.1)
    shown = found.show(CAMERA)
    upper = CAMERA.directions()[..., 2] > 0.05
    assert difference(shown[upper][None], picture[upper][None]) == pytest.approx(found.difference, abs=0.3)


def test_natural_skies_are_found_and_travel():
    truth = pa.sky.Natural(sun=pa.Sun(25, 150), turbidity=3.0)
    light = truth.render(CAMERA)
    picture = np.clip(light * (0.6 / np.quantile(light, 0.9)), 0, 1).astype(np.float32)
    found = pa.fit.sky(picture, "natural", camera=CAMERA, rng=1, generations=40)
    assert isinstance(found.sky, pa.sky.Natural)
    assert found.sky.sun.elevation == pytest.approx(25, abs=4)
    assert found.preview().shape == (48, 144, 3)
    told = json.loads(found.to_json())["sky"]
    assert told.pop("model") == "natural"
    assert pa.sky.Natural(**{**told, "sun": pa.Sun(**told["sun"])}) == found.sky


def test_a_photographs_sky_is_that_of_an_air(data):
    photo = pa.io.read(data / "clear_dune.jpg")
    sky = pa.image.segment_sky(photo).sky
    air = pa.fit.sky(photo, "physical", mask=sky, rng=0)
    style = pa.fit.sky(photo, "aoas", mask=sky, rng=0)
    assert air.difference <= 6
    assert style.difference <= 6


def test_the_table_of_the_search_is_the_sky():
    from pleinair.fit.sky_fit import _ClearSkies

    seen = CAMERA.directions()[..., 2] > 0.02
    for elevation, turbidity, ozone in ((45.0, 1.8, 204.0), (20.0, 4.2, 300.0), (2.0, 2.5, 400.0)):
        genes = {"elevation": elevation, "azimuth": 110.0, "turbidity": turbidity, "ozone": ozone}
        sun = pa.Sun(elevation, (CAMERA.azimuth + 110) % 360)
        exact = pa.sky.Physical(sun, turbidity=turbidity, ozone=ozone).render(CAMERA)[seen]
        ratio = _ClearSkies(CAMERA, seen).light(genes) / exact
        assert np.abs(ratio - 1).max() < 0.1
        assert np.abs(ratio.mean() - 1) < 0.03

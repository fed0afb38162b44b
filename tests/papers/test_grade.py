"""The grade of a painting: its law in numpy, and the values of a Corot (Solitude, 1866: facts of ../shared, L* and chroma)."""

import dataclasses

import numpy as np
import pleinair as pa
import pytest
from pleinair.paint import Grade, Style, style
from skimage.color import rgb2lab

WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def painted(name, **less):
    scene, camera = pa.demo.landscape(style=name, **less)
    camera = camera.resized(480, 270)
    return scene, camera, scene.paint(camera)


@pytest.fixture(scope="module")
def corot():
    return painted("corot")


def lab(picture):
    return rgb2lab(pa.color.srgb_encode(picture))


def test_the_law_is_that_of_numpy():
    rng = np.random.default_rng(0)
    light, share = rng.random((7, 9, 3), np.float32), rng.random((7, 9), np.float32)
    grade = Grade(sky=1.3, land=-0.7, saturation=0.4, shadows=(0.5, 0.3, 0.1), tint=0.6)
    gain = 2**-0.7 + share * (2**1.3 - 2**-0.7)
    np.testing.assert_allclose(grade.values(light, share), light * gain[..., None], rtol=2e-6)
    dark = 0.15 * light
    y = dark @ WEIGHTS
    plain = y[..., None] + 0.4 * (dark - y[..., None])
    depth = 0.6 * np.clip(1 - y / 0.1, 0, 1)[..., None]
    hue = np.array([0.5, 0.3, 0.1]) / (np.array([0.5, 0.3, 0.1]) @ WEIGHTS)
    expected = np.clip(plain + depth * (y[..., None] * hue - plain), 0, 1)
    np.testing.assert_allclose(grade.colors(dark), expected, atol=1e-6)
    assert Grade().values(light, share) is light
    assert Grade().colors(light) is light


def test_the_grade_comes_after_the_light(corot):
    scene, camera, picture = corot
    plain = dataclasses.replace(scene, style="corot")
    np.testing.assert_array_equal(plain.radiance(camera), scene.radiance(camera))
    assert np.abs(plain.paint(camera) - picture).max() > 0.1


def test_water_shows_the_lighter_sky(corot):
    scene, _, picture = corot
    dull = dataclasses.replace(scene, style=dataclasses.replace(style("corot"), grade=Grade(sky=1.55, land=-0.75)))
    assert dull.style.grade.mirrors == pytest.approx(2 ** (0.7 * 2.3))
    rows, columns = slice(190, 200), slice(200, 300)  # the middle of the pond
    assert np.median(lab(picture)[rows, columns, 0]) > np.median(lab(picture)[220:260, :, 0]) + 15
    assert Grade(land=2).mirrors < 1


def test_values_of_a_corot(corot):
    scene, camera, picture = corot
    values = lab(picture)
    layers = scene.layers(camera)
    up = camera.directions()[..., 2]
    covered = layers["strokes"].transmittance < 0.05
    sky = (layers["strokes"].transmittance > 0.95) & (up > 0)
    foliage, grass = covered & (up > 0.01), covered & (up < -0.05)
    light = {
        name: float(np.median(values[..., 0][m])) for name, m in (("sky", sky), ("foliage", foliage), ("grass", grass))
    }
    assert light["sky"] >= light["foliage"] + 40, light
    assert light["sky"] >= light["grass"] + 30, light
    low, high = np.quantile(values[..., 0], [0.05, 0.95])
    assert high - low >= 65
    assert np.median(np.hypot(values[..., 1], values[..., 2])) <= 11


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("impressionist_noon", 62, 80), ("winter", 60, 85), ("dusk", 55, 80), ("moonlight", 25, 50)],
)
def test_styles_bring_their_hour(name, low, high):
    scene, camera, picture = painted(name, trees=2, cloud=False, grown=False)
    sky = (scene.layers(camera)["strokes"].transmittance > 0.95) & (camera.directions()[..., 2] > 0)
    assert low <= np.median(lab(picture)[..., 0][sky]) <= high
    assert (scene.sky.sun.elevation < 0) == (name in ("dusk", "moonlight"))


def test_a_grade_travels_and_is_checked():
    one = style("corot", grade=True)
    assert one.grade != style("corot").grade == Grade()
    assert Style.from_json(one.to_json()) == one
    for wrong in ({"sky": 9}, {"saturation": -1}, {"tint": 2}, {"shadows": (1, 1)}, {"land": np.nan}):
        with pytest.raises((ValueError, TypeError), match=next(iter(wrong))):
            Grade(**wrong)

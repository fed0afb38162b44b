"""What a stranger passes by mistake gets a right answer or an error that names the argument."""

import numpy as np
import pleinair as pa
import pytest

CLOUD = pa.clouds.procedural("cumulus", (12, 16, 16), rng=1)
CAMERA = pa.Camera.look_at((0, -600, 900), (160, 160, 900), 16, 12, fov=40)
SUN, PARAMS = pa.Sun(40, 160), pa.clouds.Params(sigma_t=0.02)
PICTURE = np.full((32, 32, 3), (0.1, 0.3, 0.8), np.float32)
PICTURE[8:20, 8:24] = np.linspace(0.3, 0.9, 16)[:, None]
BASIS = pa.clouds.Basis.precompute(CLOUD, CAMERA, SUN)
PHOTO = pa.fit.Photo.analyse(PICTURE, ground=None)


WRONG = [
    ("cloud", lambda: pa.clouds.render(None, PARAMS, CAMERA, SUN)),
    ("params", lambda: pa.clouds.render(CLOUD, {}, CAMERA, SUN)),
    ("camera", lambda: pa.clouds.render(CLOUD, PARAMS, None, SUN)),
    ("sun", lambda: pa.clouds.render(CLOUD, PARAMS, CAMERA, (40, 160))),
    ("conventions", lambda: pa.clouds.render(CLOUD, PARAMS, CAMERA, SUN, conventions="paper")),
    ("sky", lambda: pa.clouds.render(CLOUD, PARAMS, CAMERA, SUN, sky=np.zeros((12, 16, 3), np.uint8))),
    ("params", lambda: BASIS.image(None)),
    ("photo", lambda: pa.fit.clouds(PICTURE, BASIS)),
    ("basis", lambda: pa.fit.clouds(PHOTO, PHOTO)),
    ("camera", lambda: PHOTO.sky_for(None)),
    ("bounds", lambda: pa.fit.clouds(PHOTO, BASIS, bounds={"g": 0.5})),
    ("haze", lambda: pa.fit.clouds(PHOTO, BASIS, haze=None)),
    ("size", lambda: pa.fit.clouds(PHOTO, BASIS, generations=1, rng=0).render(CLOUD, size=64)),
    ("objective", lambda: pa.fit.genetic(lambda x: ["a"] * len(x), [(0, 1)])),
    ("objective", lambda: pa.fit.genetic(lambda x: x[:, 0] + 1j, [(0, 1)])),
    ("photo", lambda: pa.fit.Photo.analyse((PICTURE * 255).astype(int))),
    ("photo", lambda: pa.image.segment_sky((PICTURE * 255).astype(np.uint16))),
    ("picture", lambda: pa.io.write("never.png", np.full((4, 4, 3), 128))),
    ("elevation", lambda: pa.Sun("45")),
    ("g", lambda: pa.clouds.Params(g=True)),
    ("img", lambda: pa.image.histogram(np.ma.masked_array([[0.1, 0.9]], [[0, 1]]))),
    ("threads", lambda: pa.set_num_threads(1.5)),
    ("threads", lambda: pa.set_num_threads("2")),
    ("threads", lambda: pa.set_num_threads(True)),
    ("method", lambda: pa.image.segment_sky(PICTURE, method=np.array(["nbr"]))),
]


@pytest.mark.parametrize(("name", "call"), WRONG, ids=[f"{i}-{name}" for i, (name, _) in enumerate(WRONG)])
def test_the_argument_is_named(name, call):
    with pytest.raises((TypeError, ValueError), match=name):
        call()


def test_numbers_far_outside_are_refused_too():
    for threads in (-1, 10**30):
        with pytest.raises(ValueError, match="threads"):
            pa.set_num_threads(threads)
    with pytest.raises(ValueError, match="sky"):
        pa.clouds.render(CLOUD, PARAMS, CAMERA, SUN, sky=[1e300] * 3)


def test_black_clouds_are_a_problem_and_not_a_light():
    dark = PICTURE.copy()
    mask = np.zeros((32, 32), bool)
    mask[8:20, 8:24] = True
    for level in (0.0, -1.0):
        dark[mask] = level
        photo = pa.fit.Photo.analyse(dark, ground=None, cloud=mask)
        assert photo.light_color == (1.0, 1.0, 1.0)
        assert "no light" in " ".join(photo.problems)


def test_red_clouds_are_a_problem_until_the_user_shows_them():
    sunset = np.full((48, 64, 3), (0.6, 0.3, 0.1), np.float32)
    sunset[10:30, 10:50] = (0.15, 0.1, 0.08)
    photo = pa.fit.Photo.analyse(sunset, ground=None)
    assert any("red" in p or "no clouds" in p or "overcast" in p for p in photo.problems), photo
    mask = np.zeros((48, 64), bool)
    mask[10:30, 10:50] = True
    assert pa.fit.Photo.analyse(sunset, ground=None, cloud=mask).problems == ()


def test_only_the_product_of_intensity_and_albedo_shows():
    a = pa.clouds.Params(light_intensity=4, albedo=0.5, sigma_t=0.02)
    b = pa.clouds.Params(light_intensity=2, albedo=1.0, sigma_t=0.02)
    assert np.array_equal(BASIS.image(a), BASIS.image(b))


def test_a_target_that_is_reached_ends_the_search():
    found = pa.fit.genetic(lambda x: np.zeros(len(x)), [(0, 1)], rng=0)
    assert (found.stopped, found.calls) == ("target", 20)


def test_reprs_are_short():
    fit = pa.fit.clouds(PHOTO, BASIS, generations=2, rng=0)
    for thing in (PHOTO, fit, BASIS, CLOUD, BASIS.render(PARAMS)):
        assert len(repr(thing)) < 200

"""Photographs that are none, or half of one: a right answer, or one sentence that says what is wrong."""

import numpy as np
import pleinair as pa
import pytest
from pleinair.fit import Photo


def scene(height, width, horizon=0.8):
    """A sky with clouds over dark grass, with a camera's noise."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[0:height, 0:width] / max(height, width)
    top = height / max(height, width)
    sky = np.stack([0.08 + 0.1 * y, 0.2 + 0.12 * y, 0.5 + 0.1 * y], -1)
    for at in ((0.25 * top, 0.3), (0.4 * top, 0.7)):
        sky[np.hypot(y - at[0], x - at[1] * width / max(height, width)) < 0.12 * top] = 0.85
    grass = (y > horizon * top)[..., None]
    light = np.where(grass, np.array([0.05, 0.09, 0.02]) * rng.uniform(0.3, 1.7, (height, width, 1)), sky)
    return (light * rng.normal(1, 0.01, light.shape)).clip(0, 1).astype(np.float32)


@pytest.mark.parametrize(
    "shape", [(90, 400), (400, 90), (60, 60), (16, 16)], ids=["panorama", "portrait", "square", "least"]
)
def test_any_shape_is_understood(shape):
    photo = Photo.analyse(scene(*shape))
    assert photo.cloud.shape == shape
    assert photo.sky is not None or photo.problems


@pytest.mark.parametrize("shape", [(1, 1), (1, 200), (15, 400)])
def test_too_small_is_said(shape):
    with pytest.raises(pa.fit.UnfittableError, match="at least 16 x 16 pixels"):
        Photo.analyse(np.full((*shape, 3), 0.5, np.float32))


def test_black_and_white_is_a_problem_and_not_a_guess():
    grey = scene(120, 160).mean(-1, keepdims=True).repeat(3, -1)
    photo = Photo.analyse(grey)
    assert any("grey" in problem for problem in photo.problems)
    with pytest.raises(pa.fit.UnfittableError, match="grey"):
        pa.fit.clouds(photo, basis())


def basis():
    cloud = pa.clouds.procedural("cumulus", (12, 16, 16), rng=1)
    return pa.clouds.Basis.precompute(
        cloud, pa.Camera.look_at((0, -600, 900), (160, 160, 900), 32, 24, fov=40), pa.Sun(40, 90)
    )


def test_only_ground_is_one_sentence():
    rng = np.random.default_rng(0)
    ground = np.array([0.06, 0.1, 0.02]) * rng.uniform(0.3, 1.7, (120, 160, 1))
    with pytest.raises(ValueError, match="leaves no pixel of the sky"):
        Photo.analyse(ground.astype(np.float32))


def test_half_a_sky_is_enough():
    photo = Photo.analyse(scene(120, 160, horizon=0.5))
    assert photo.segmentation.ground.mean() == pytest.approx(0.5, abs=0.03)
    assert photo.problems == ()


def test_a_fisheyes_black_frame_is_no_cloud():
    picture = scene(160, 160, horizon=2)
    y, x = np.mgrid[-1:1:160j, -1:1:160j]
    picture[np.hypot(x, y) > 1] = 0
    outside = np.hypot(x, y) > 1.03
    photo = Photo.analyse(picture, ground=np.hypot(x, y) > 1)
    assert not photo.cloud[outside].any()
    assert photo.problems == ()


def test_a_truncated_file_is_named(tmp_path, data):
    whole = (data / "clear_dune.jpg").read_bytes()
    path = tmp_path / "half.jpg"
    path.write_bytes(whole[: len(whole) // 3])
    with pytest.raises(pa.io.UnreadableError, match=r"half\.jpg"):
        Photo.analyse(path)


def test_a_notebook_draws_what_was_found():
    photo = Photo.analyse(scene(120, 160))
    drawn = photo._repr_html_()
    assert drawn.count("<img") == 3
    assert "mixed" in drawn
    grey = Photo.analyse(np.full((32, 32, 3), 0.5, np.float32))
    assert "problem: " in grey._repr_html_()
    assert grey._repr_html_().count("<img") == 2

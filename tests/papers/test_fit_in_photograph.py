"""The sky behind the clouds, and the fitted cloud in the photograph: against scenes whose truth is known."""

import numpy as np
import pleinair as pa
import pytest
from pleinair.color import srgb_decode, srgb_encode
from pleinair.fit.placement import aimed, grain_of, placement, softened
from scipy.ndimage import uniform_filter

CLOUD = pa.clouds.procedural("cumulus", (32, 48, 48), rng=2)
CAMERA = pa.Camera.look_at((480, -1800, 700), (480, 480, 900), 100, 75, fov=40)
SUN = pa.Sun(45, 220)
BASIS = pa.clouds.Basis.precompute(CLOUD, CAMERA, SUN)


def scene(seed=0, noise=0.004, wisp=0.06):
    """A sky with a gradient, sharp clouds with wisps around them, a hill: picture, sky, masks of cloud and of hill."""
    rng = np.random.default_rng(seed)
    h, w = 150, 200
    y, x = np.mgrid[0:h, 0:w] / h
    sky = np.exp(np.stack([-2.4 + 1.2 * y**1.5, -1.5 + 0.7 * y**1.5, -0.7 + 0.2 * y], -1) + 0.08 * x[..., None])
    opacity, thin = np.zeros((h, w)), np.zeros((h, w))
    for _ in range(3):
        cy, cx, r = rng.uniform(0.15, 0.5), rng.uniform(0.2, 1.1), rng.uniform(0.07, 0.12)
        d = np.hypot(y - cy, x - cx) / r
        opacity = np.maximum(opacity, (d < 1) * 1.0)
        thin = np.maximum(thin, wisp * np.exp(-((d - 1.6) ** 2) / 0.1) * (d > 1))
    veil = np.maximum(opacity, thin)[..., None]
    hill = y > 0.8 + 0.05 * np.sin(5 * x)
    light = np.where(hill[..., None], (0.05, 0.08, 0.03), sky * (1 - veil) + 0.85 * veil)
    levels = srgb_encode(light) + rng.normal(0, noise, light.shape)
    return srgb_decode(np.clip(levels, 0, 1)).astype(np.float32), sky, opacity > 0, hill


@pytest.mark.parametrize("seed", range(4))
def test_the_sky_behind_is_the_sky(seed):
    picture, sky, cloud, hill = scene(seed)
    photo = pa.fit.Photo.analyse(picture, cloud=cloud, ground=hill)
    off = np.abs(photo.sky / sky - 1).max(-1)
    assert np.median(off[cloud]) < 0.04
    assert np.quantile(off[cloud], 0.95) < 0.10
    # Thin cloud beside the mask is not sky: left in, it would be a pale ring around the gap.
    rings = pa.image.dilate(cloud, 10) & ~cloud & ~hill
    assert np.quantile(off[rings], 0.95) < 0.12
    plain = pa.image.fill(picture, pa.image.dilate(cloud | hill, 2))
    assert np.quantile(off[cloud], 0.9) < 0.5 * np.quantile(np.abs(plain / sky - 1).max(-1)[cloud], 0.9)


def test_the_gradient_goes_on_under_the_hill_and_no_further():
    picture, sky, cloud, hill = scene(1)
    photo = pa.fit.Photo.analyse(picture, cloud=cloud, ground=hill)
    assert (photo.sky[hill] < 1.5 * sky[~hill].max(axis=0)).all()
    assert (photo.sky > 0).all()


@pytest.mark.parametrize("noise", [0.002, 0.01, 0.03])
def test_grain_is_measured(noise):
    picture, _, cloud, hill = scene(2, noise, wisp=0)
    photo = pa.fit.Photo.analyse(picture, cloud=cloud, ground=hill)
    assert grain_of(photo) == pytest.approx([noise] * 3, rel=0.1)


def test_the_blur_is_scipys():
    values = np.random.default_rng(0).random((9, 12, 3))
    np.testing.assert_allclose(softened(values), uniform_filter(values, (3, 3, 1), mode="nearest"), atol=1e-6)


@pytest.mark.parametrize(("row", "column", "radius"), [(40, 60, 18), (70, 150, 25), (25, 100, 15)])
def test_a_camera_is_aimed_at_the_place(row, column, radius):
    y, x = np.mgrid[0:120, 0:180]
    wanted = np.hypot(y - row, x - column) < radius
    seen = BASIS.depth > 0
    camera = aimed(CAMERA, placement(seen, wanted), wanted.shape)
    image = pa.clouds.render(CLOUD, pa.clouds.Params(), camera, SUN, sky=(0.1, 0.2, 0.5))
    got = np.isfinite(image.distance)
    rows, columns = np.nonzero(got)
    assert np.median(rows) == pytest.approx(row, abs=2.5)
    assert np.median(columns) == pytest.approx(column, abs=2.5)
    assert got.sum() == pytest.approx(wanted.sum(), rel=0.15)


def test_the_cloud_is_in_the_photograph():
    picture, _, cloud, hill = scene(3)
    photo = pa.fit.Photo.analyse(picture, cloud=cloud, ground=hill)
    fit = pa.fit.clouds(photo, BASIS, generations=15, rng=0)
    for made in (fit.replace(), fit.replace(cloud=CLOUD)):
        assert made.shape == picture.shape
        assert np.isfinite(made).all()
        inside = ~pa.image.dilate(~hill, 2)
        np.testing.assert_array_equal(made[inside], picture[inside])
        # Where neither is, the photograph's sky with its grain.
        far = ~pa.image.dilate(cloud | hill, 60)
        if far.any():
            assert np.abs(srgb_encode(made[far]) - srgb_encode(photo.sky[far])).std() < 0.012
        bright = (made.sum(-1) > 1.3 * photo.sky.sum(-1)) & ~hill
        assert bright.sum() == pytest.approx(cloud.sum(), rel=0.6), "a cloud of about that size"
    assert not np.array_equal(fit.replace(grain=False), fit.replace())
    np.testing.assert_array_equal(fit.replace(rng=4), fit.replace(rng=4))
    small = pa.fit.CloudFit.from_json(fit.to_json())
    with pytest.raises(ValueError, match="attach"):
        small.replace()


def test_large_photographs_are_filled_as_small_ones():
    picture, _, cloud, hill = scene(1, noise=0, wisp=0)
    large, opaque, land = (np.kron(a, np.ones((9, 9) + (1,) * (a.ndim - 2), a.dtype)) for a in (picture, cloud, hill))
    small = pa.fit.Photo.analyse(picture, cloud=cloud, ground=hill)
    big = pa.fit.Photo.analyse(large, cloud=opaque, ground=land, margin=18)
    off = np.abs(pa.image.resize(big.sky, 200, 150) / small.sky - 1).max(-1)
    assert np.quantile(off[cloud], 0.95) < 0.01, "blocks of pixels are filled"
    assert np.abs(big.sky[~pa.image.dilate(opaque | land, 60)] - large[~pa.image.dilate(opaque | land, 60)]).max() == 0

"""pleinair.image.segment_sky: pictures whose masks we made, and photographs whose masks we looked at."""

import numpy as np
import pleinair as pa
import pytest
from pleinair.image import segment_sky
from scipy.ndimage import gaussian_filter
from skimage.color import rgb2hsv


def scene(seed, coverage=0.4, h=300, w=400, land=True):
    """Return a linear picture of a sky with clouds over land, and its masks."""
    rng = np.random.default_rng(seed)
    noise = gaussian_filter(rng.normal(size=(h, w)), h / 15)
    noise /= noise.std()
    y, x = np.mgrid[:h, :w] / h
    sky = np.stack([0.08 + 0.15 * y, 0.20 + 0.2 * y, 0.50 + 0.15 * y], axis=2)
    cloud = noise > np.quantile(noise, 1 - coverage)
    opacity = np.clip(0.55 + 0.5 * (noise - np.quantile(noise, 1 - coverage)), 0, 1) * cloud
    shade = 0.75 + 0.1 * gaussian_filter(rng.normal(size=(h, w)), h / 40) * h / 10
    img = sky + opacity[..., None] * (np.stack([shade, shade, shade * 1.03], axis=2) - sky)
    ground = y > 0.7 + 0.08 * np.sin(5 * x + seed) if land else np.zeros((h, w), bool)
    texture = rng.uniform(0.3, 1.7, (h, w, 1))
    img = np.where(ground[..., None], np.array([0.09, 0.11, 0.03]) * texture, img)
    img = img * rng.normal(1, 0.01, img.shape)
    return img.astype(np.float32), cloud & ~ground, ground


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("land", [True, False])
def test_synthetic_masks_are_found(seed, land):
    img, cloud, ground = scene(seed, land=land)
    found = segment_sky(img)
    assert found.verdict == "mixed"
    assert (found.ground != ground).mean() <= 0.005
    assert (found.cloud != cloud).mean() <= 0.03
    np.testing.assert_array_equal(found.cloud.astype(int) + found.ground + found.sky, 1)
    assert found.feature.dtype == np.float32
    assert found.separability > 0.5
    sky = ~found.ground
    np.testing.assert_array_equal(found.cloud[sky], found.feature[sky] <= found.threshold)


@pytest.mark.parametrize("coverage", [0.05, 0.2, 0.6, 0.9])
def test_any_coverage(coverage):
    img, cloud, _ = scene(3, coverage, land=False)
    found = segment_sky(img)
    assert found.verdict == "mixed"
    assert (found.cloud != cloud).mean() <= 0.03


def test_noise_is_not_split():
    rng = np.random.default_rng(0)
    for colour, verdict in (
        ((0.1, 0.2, 0.5), "cloudless"),
        ((0.5, 0.5, 0.52), "overcast"),
        ((0.9, 0.9, 0.9), "overcast"),
    ):
        img = (np.array(colour) * rng.normal(1, 0.03, (200, 300, 3))).astype(np.float32)
        found = segment_sky(img)
        assert found.verdict == verdict
        assert found.cloud.all() == (verdict == "overcast")
        assert found.cloud.any() == (verdict == "overcast")
        assert not found.ground.any()


def test_a_hazy_gradient_is_not_split():
    y = np.linspace(0, 1, 240)[:, None, None] + np.zeros((1, 320, 1))
    img = (np.array([0.1, 0.2, 0.5]) * (1 - y) + np.array([0.55, 0.6, 0.65]) * y).astype(np.float32)
    found = segment_sky(img)
    assert found.verdict == "cloudless"
    assert found.contrast < 0.19


def test_exposure_and_units_do_not_matter():
    img, cloud, ground = scene(2)
    for scale in (1e-3, 300.0, 20000.0):
        found = segment_sky(img * scale)
        assert (found.cloud != cloud).mean() <= 0.03
        assert (found.ground != ground).mean() <= 0.01


def test_bytes_are_decoded_as_srgb():
    img, cloud, ground = scene(4)
    x = img.clip(0, 1)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    found = segment_sky(np.rint(encoded * 255).astype(np.uint8))
    assert (found.cloud != cloud).mean() <= 0.03
    assert (found.ground != ground).mean() <= 0.005


def test_features_are_what_they_are_said_to_be():
    img, _, _ = scene(1)
    img = img.clip(0.001, 1)
    found = segment_sky(img, ground=None)
    np.testing.assert_allclose(found.feature, (img[..., 2] - img[..., 0]) / (img[..., 2] + img[..., 0]), atol=1e-6)
    encoded = np.where(img <= 0.0031308, 12.92 * img, 1.055 * img.astype(float) ** (1 / 2.4) - 0.055)
    chroma = segment_sky(img, method="chroma", ground=None)
    np.testing.assert_allclose(chroma.feature, rgb2hsv(encoded)[..., 1], atol=3e-6)
    edges = pa.image.histogram(chroma.feature, 256, (-1, 1))
    # An edge is the least number that its bin counts: within the rounding of x + 1 of the even one.
    assert np.abs(edges.edges - chroma.threshold).min() <= 2.0**-52
    plain = pa.image.otsu(np.floor((chroma.feature.astype(float) + 1) * 128).astype(np.uint8)).value
    assert chroma.threshold == (plain + 1) / 128 - 1, "Otsu without a prior"


def test_masks_of_the_user_are_obeyed():
    img, cloud, ground = scene(5)
    rough = np.zeros_like(ground)
    rough[150:] = True
    found = segment_sky(img, ground=rough)
    np.testing.assert_array_equal(found.ground, rough)
    given = segment_sky(img, ground=ground, cloud=cloud | ground)
    np.testing.assert_array_equal(given.cloud, cloud)
    assert given.verdict == "mixed"
    assert segment_sky(img, ground=ground, cloud=np.zeros_like(cloud)).verdict == "cloudless"
    assert segment_sky(img, ground=ground, cloud=np.ones_like(cloud)).verdict == "overcast"


def test_the_prior_is_weighed():
    img, _, _ = scene(0, 0.4)
    thresholds = [segment_sky(img, prior=p).threshold for p in (0.0, 0.05, 0.9)]
    assert 0.2 < thresholds[2] < 0.5, "between the lobes"


def test_red_light_is_said_to_be_out_of_reach():
    img, _, _ = scene(0, land=False)
    with pytest.warns(pa.DomainWarning, match="light is red"):
        segment_sky(img * np.float32([6, 1, 0.3]), ground=None)


@pytest.mark.parametrize(
    ("kwargs", "error", "text"),
    [
        ({"photo": np.zeros((4, 4))}, ValueError, "photo must have 3 dimensions"),
        ({"photo": np.zeros((4, 4, 4))}, ValueError, "photo must have shape"),
        ({"photo": np.zeros((0, 4, 3))}, ValueError, "photo must not be empty"),
        ({"photo": np.full((4, 4, 3), np.nan)}, ValueError, "photo must be finite and"),
        ({"photo": np.zeros((4, 4, 3), complex)}, TypeError, "photo must hold real"),
        ({"method": "magic"}, ValueError, "method must be one of"),
        ({"prior": 1.0}, ValueError, "prior must be in"),
        ({"ground": "no"}, ValueError, "ground must be one of"),
        ({"ground": np.zeros((3, 4), bool)}, ValueError, "ground must have shape"),
        ({"ground": np.ones((4, 4), bool)}, ValueError, "ground: leaves no pixel"),
        ({"cloud": np.zeros((3, 4), bool)}, ValueError, "cloud must have shape"),
    ],
    ids=str,
)
def test_wrong_arguments_are_named(kwargs, error, text):
    with pytest.raises(error, match=text):
        segment_sky(**{"photo": np.ones((4, 4, 3)), **kwargs})


def test_tiny_and_black_pictures_have_an_answer():
    for shape in ((1, 1, 3), (1, 50, 3), (50, 1, 3), (8, 8, 3), (9, 7, 3)):
        for value in (0, 1, 0.3):
            found = segment_sky(np.full(shape, value, np.float32), ground=None)
            assert found.verdict == ("overcast" if value else "night"), "grey, or black"
            assert found.cloud.all()


@pytest.mark.parametrize("seed", range(4))
def test_soft_clouds_have_structure_and_no_edges(seed):
    # Veils: a random field without a frequency above a tenth of the picture, over a smooth sky.
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:180, 0:240] / 240
    veil = sum(
        rng.normal() * np.cos(2 * np.pi * (rng.uniform(-6, 6) * x + rng.uniform(-6, 6) * y) + rng.uniform(0, 6))
        for _ in range(40)
    )
    veil = np.clip(0.4 + 0.4 * veil / veil.std(), 0, 1)[..., None]
    clear = np.array([0.1, 0.2, 0.5]) * (1.2 - 0.4 * y[..., None])
    cloudy = segment_sky((clear * (1 - veil) + 0.5 * veil).astype(np.float32), ground=None)
    assert cloudy.verdict == "mixed"
    assert cloudy.structure > 0.03
    assert np.corrcoef(cloudy.cloud.ravel(), veil.ravel())[0, 1] > 0.7
    smooth = segment_sky(clear.astype(np.float32), ground=None)
    assert (smooth.verdict, smooth.structure < 0.01) == ("cloudless", True)
    assert smooth.confidence > 0.9


def test_the_verdict_does_not_empty_the_guess():
    y = np.linspace(0, 1, 240)[:, None, None] + np.zeros((1, 320, 1))
    img = (np.array([0.1, 0.2, 0.5]) * (1 - y) + np.array([0.55, 0.6, 0.65]) * y).astype(np.float32)
    found = segment_sky(img)
    assert found.verdict == "cloudless"
    np.testing.assert_array_equal(found.cloud, (found.feature <= found.threshold) & ~found.ground)
    assert found.cloud.any()
    night = segment_sky(0.01 * img, ground=None)
    assert night.verdict == "night"
    assert 0.5 <= night.confidence <= 1


# verdict, cloud as a share of what is not ground, ground as a share of the picture: as we saw them, with some room
SEEN = {
    "clear_dune": ("cloudless", (0, 1), (0.32, 0.38)),
    "clouds_mountain_sherburne": ("mixed", (0.1, 0.35), (0.58, 0.65)),
    "cumulus_cirrus_kite": ("mixed", (0.07, 0.16), (0, 0)),
    "cumulus_mountain_picos": ("mixed", (0.18, 0.30), (0.70, 0.76)),
    "horizon_cumulus_bridge": ("mixed", (0.1, 0.36), (0.12, 0.20)),
    "kyc_altostratus": ("overcast", (1, 1), (0, 0)),
    "kyc_cirrocumulus": ("mixed", (0.4, 0.75), (0, 0)),
    "kyc_cumulus": ("mixed", (0.4, 0.52), (0.28, 0.34)),
    "kyc_stratus": ("overcast", (1, 1), (0.3, 0.4)),
    "sun_in_view_mountain": ("cloudless", (0, 1), (0.5, 0.6)),
    "sunset_afterglow_pier": ("cloudless", (0, 1), (0.53, 0.6)),
    "sunset_clouds_boats": ("mixed", (0.2, 0.8), (0.63, 0.74)),
}


@pytest.mark.parametrize("name", SEEN)
def test_photographs(name, recwarn, data, not_committed):
    path = data / f"{name}.jpg"
    if not path.exists():
        path = not_committed(f"photos/{name}.jpg")
    image = pytest.importorskip("PIL.Image")
    with image.open(path) as picture:
        photo = np.asarray(picture.convert("RGB"))
    verdict, cloud, ground = SEEN[name]
    if name == "sunset_clouds_boats":
        with pytest.warns(pa.DomainWarning):
            found = segment_sky(photo)
    else:
        found = segment_sky(photo)
    assert found.verdict == verdict
    assert ground[0] <= found.ground.mean() <= ground[1]
    assert cloud[0] <= found.cloud.sum() / (~found.ground).sum() <= cloud[1]

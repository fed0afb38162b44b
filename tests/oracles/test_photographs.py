"""Photographs of every depth, profile, alpha and orientation, against colour-science and the numbers they were made of.

The files of tests/data/photographs are tiny and our own (their README says how they were made); expected.json has linear light
computed with colour-science 0.4.7.
"""

import json
import warnings
from pathlib import Path

import numpy as np
import pleinair as pa
import pytest
from PIL import Image, ImageCms

FOLDER = Path(__file__).parents[1] / "data" / "photographs"
EXPECTED = {k: v for k, v in json.loads((FOLDER / "expected.json").read_text()).items() if "." in k}


def middles(picture, shape, patch):
    """The middle pixel of every patch."""
    return picture[patch // 2 :: patch, patch // 2 :: patch][: shape[0], : shape[1]]


def save(path, picture, **options):
    picture.save(path, **options)
    return path


def read(name, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return pa.io.read(FOLDER / name, **options)


@pytest.mark.parametrize("name", [k for k, v in EXPECTED.items() if "linear_srgb" in v])
def test_colours_are_those_of_colour_science(name):
    wanted = np.array(EXPECTED[name]["linear_srgb"])
    found = middles(read(name), wanted.shape, EXPECTED[name].get("patch_px", 16))
    # Colorants of profiles have 16 binary places; JPEG may be two levels off.
    tolerance = 0.012 if name.endswith(".jpg") else 5e-4 if "icc" in name or "cicp" in name else 1e-6
    np.testing.assert_allclose(found, wanted, rtol=0, atol=tolerance)


def test_the_level_of_the_report_of_a_wide_gamut_photograph(tmp_path):
    """Display P3 (80, 140, 230): read as sRGB its blue is too weak and its red twice as strong."""
    with Image.open(FOLDER / "display_p3_icc.png") as opened:
        profile = opened.info["icc_profile"]
    path = save(tmp_path / "p3.png", Image.new("RGB", (4, 4), (80, 140, 230)), icc_profile=profile)
    np.testing.assert_allclose(pa.io.read(path)[0, 0], (0.039, 0.270, 0.847), atol=1e-3)
    np.testing.assert_allclose(pa.io.read(path, profile="srgb")[0, 0], (0.080, 0.262, 0.791), atol=1e-3)


def test_pq_is_in_candelas():
    wanted = np.array(EXPECTED["cicp_rec2100_pq16.png"]["linear_srgb_cd_m2"])
    found = middles(read("cicp_rec2100_pq16.png"), wanted.shape, 4)
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=2.0)


@pytest.mark.parametrize("name", ["rgb16.png", "rgb16.tif"])
def test_sixteen_bits_stay(name):
    levels = np.array(EXPECTED[name]["patches_16bit"])
    wanted = pa.color.srgb_decode(levels / 65535.0)
    np.testing.assert_allclose(middles(read(name), levels.shape, 4), wanted, rtol=3e-7, atol=1e-9)


def test_a_level_of_sixteen_bits_that_eight_lose(tmp_path):
    np.testing.assert_allclose(read("gray16.png")[0, 2, 0], 256 / 65535 / 12.92, rtol=1e-6)
    # 255 of 65535 is .000301 of white, not 0.
    path = save(tmp_path / "dark.png", Image.fromarray(np.full((2, 2), 255, np.uint16)))
    np.testing.assert_allclose(pa.io.read(path), 0.000301, rtol=1e-3)


@pytest.mark.parametrize("name", ["float_gray.tif", "float_rgb.tif", "float_rgb_predictor3.tif"])
def test_floats_in_tiff_are_light_as_it_is(name):
    wanted = np.array(EXPECTED[name]["values"])
    wanted = wanted[0][:, None] if wanted.ndim == 2 and "gray" in name else wanted
    patch = EXPECTED[name].get("patch_px", 1)
    found = read(name)[0, patch // 2 :: patch]
    np.testing.assert_array_equal(found, np.broadcast_to(wanted, found.shape).astype(np.float32))


@pytest.mark.parametrize("name", ["rgba.png", "gray_alpha.png", "palette.png", "palette_trns.png"])
def test_straight_alpha_and_palettes_leave_colours_alone(name):
    entry = EXPECTED[name]
    levels = np.array(entry.get("patches", entry.get("rgb")))
    levels = levels[..., :1] if "gray" in name else levels[..., :3]
    found = middles(read(name), levels.shape, entry.get("patch_px", 16))
    np.testing.assert_allclose(found, np.broadcast_to(pa.color.srgb_decode(levels / 255.0), found.shape), atol=1e-6)


def test_colours_multiplied_by_alpha_are_divided(tmp_path):
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    straight, alpha = np.array([200, 100, 50]) / 255, np.array([1.0, 0.5, 0.25])
    rows = np.concatenate([np.rint(65535 * straight[None] * alpha[:, None]), 65535 * alpha[:, None]], axis=1)
    path = tmp_path / "premultiplied.tif"
    tifffile.imwrite(path, rows[None].astype(np.uint16), photometric="rgb", extrasamples=["assocalpha"])
    np.testing.assert_allclose(pa.io.read(path)[0], np.tile(pa.color.srgb_decode(straight), (3, 1)), atol=2e-4)


@pytest.mark.parametrize("k", range(1, 9))
def test_every_orientation_is_upright(k):
    found = read(f"orientation_{k}.jpg")
    assert found.shape == (16, 24, 3)
    corners = [found[y, x] > 0.5 for y, x in ((3, 3), (3, -4), (-4, 3), (-4, -4))]
    np.testing.assert_array_equal(corners, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])


@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation_holds_at_every_depth(tmp_path, orientation):
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    from PIL import ImageOps

    eight = np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8)
    exif = Image.Exif()
    exif[0x0112] = orientation
    save(tmp_path / "a.png", Image.fromarray(eight), exif=exif)
    with Image.open(tmp_path / "a.png") as opened:
        wanted = pa.color.srgb_decode(np.asarray(ImageOps.exif_transpose(opened)) / 255.0)
    np.testing.assert_allclose(pa.io.read(tmp_path / "a.png"), wanted, atol=1e-6)
    tags = [(274, "H", 1, orientation, True)]
    tifffile.imwrite(tmp_path / "a.tif", eight.astype(np.uint16) * 257, photometric="rgb", extratags=tags)
    np.testing.assert_allclose(pa.io.read(tmp_path / "a.tif"), wanted, atol=1e-6)


@pytest.mark.parametrize("name", ["cmyk.jpg", "cmyk.tif"])
def test_cmyk_without_a_profile_is_refused(name):
    with pytest.raises(ValueError, match=rf"{name} is not a picture that can be read \(it is CMYK without a profile"):
        read(name)


def test_a_profile_of_the_wrong_kind_is_refused_and_the_remedy_named(tmp_path):
    lab = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    path = save(tmp_path / "a.png", Image.new("RGB", (2, 2), (90, 90, 90)), icc_profile=lab)
    with pytest.raises(ValueError, match=r"its ICC profile is of b'Lab '.*profile='srgb' reads its numbers as sRGB"):
        pa.io.read(path)
    np.testing.assert_allclose(pa.io.read(path, profile="srgb"), pa.color.srgb_decode(90 / 255), atol=1e-6)


def test_integers_of_32_bits(tmp_path):
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    levels = np.array([[0, 2**31, 2**32 - 1]], np.uint32)
    tifffile.imwrite(tmp_path / "a.tif", levels)
    wanted = pa.color.srgb_decode(levels / (2.0**32 - 1))
    np.testing.assert_allclose(pa.io.read(tmp_path / "a.tif")[..., 0], wanted, rtol=1e-6)
    tifffile.imwrite(tmp_path / "b.tif", levels.astype(np.int32))
    with pytest.raises(ValueError, match="signed integers have no level that is white"):
        pa.io.read(tmp_path / "b.tif")


def test_other_programs_are_never_called(tmp_path):
    """A page of PostScript under the name of a picture: Pillow would hand it to Ghostscript."""
    (tmp_path / "a.png").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\nshowpage\n")
    with pytest.raises(
        ValueError, match=r"a\.png is not a picture that can be read \(of no format that is read here\)"
    ):
        pa.io.read(tmp_path / "a.png")


@pytest.mark.parametrize("name", ["rgb16.png", "rgb16.tif", "untagged.png", "srgb_icc_v4.jpg"])
def test_a_size_above_the_limit_is_refused(name):
    with pytest.raises(ValueError, match=r"pixels are more than the 100 that are allowed"):
        read(name, max_pixels=100)


def test_absurd_headers_of_hdr_and_pfm(tmp_path):
    path = pa.io.write(tmp_path / "a.hdr", np.ones((2, 9, 3), np.float32))
    whole = path.read_bytes()
    for exposure in (b"0", b"nan", b"inf", b"-1", b"1e-300"):
        path.write_bytes(whole.replace(b"FORMAT", b"EXPOSURE=" + exposure + b"\nFORMAT", 1))
        with pytest.raises(ValueError, match="its EXPOSURE and COLORCORR must be in"):
            pa.io.read(path)
    path.write_bytes(whole.replace(b"FORMAT", b"EXPOSURE=4\nFORMAT", 1))
    np.testing.assert_allclose(pa.io.read(path), 0.25, rtol=4e-3)
    samples = np.arange(1, 7, dtype="<f4")
    (tmp_path / "a.pfm").write_bytes(b"PF\n2 1\n-2.0\n" + samples.tobytes())
    with pytest.warns(pa.DomainWarning, match="multiplied by the scale"):
        found = pa.io.read(tmp_path / "a.pfm")
    np.testing.assert_array_equal(found.ravel(), 2 * samples)  # as Mitsuba 3.9 does; OpenCV 5.0 divides
    (tmp_path / "a.pfm").write_bytes(b"PF\n2 1\n0.0\n" + samples.tobytes())
    with pytest.raises(ValueError, match="its scale must be a number other than 0"):
        pa.io.read(tmp_path / "a.pfm")

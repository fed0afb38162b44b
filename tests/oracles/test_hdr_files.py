"""Files of high dynamic range: OpenEXR, OpenCV and Mitsuba read what we write, and we what they write."""

import contextlib
import subprocess
import sys
import warnings

import numpy as np
import pleinair as pa
import pytest

cv2 = pytest.importorskip("cv2")
exr = pytest.importorskip("OpenEXR")

RNG = np.random.default_rng(5)
WIDTHS = (1, 7, 8, 127, 128, 129, 300)


def noise(height, width, decades=6.0):
    """Values over many decades, with runs of every length and black pixels in them."""
    p = 10 ** RNG.uniform(-decades / 2, decades / 2, (height, width, 3))
    p[height // 3 : height // 2] = p[height // 3 : height // 2, :1]
    p[:, width // 2 :] = np.where(RNG.random((height, (width + 1) // 2, 1)) < 0.6, 0, p[:, width // 2 :])
    return p.astype(np.float32)


@pytest.fixture(scope="module")
def smooth():
    y, x = np.mgrid[0:64, 0:96] / 64
    lobe = 500 * np.exp(-30 * ((x - 0.9) ** 2 + (y - 0.3) ** 2))
    return np.stack([1 + x + lobe, 1 + y + 0.8 * lobe, 2 + 0.5 * lobe], axis=-1).astype(np.float32)


@pytest.fixture(scope="module")
def mitsuba():
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
    except ImportError:
        pytest.skip("mitsuba (group bench) is not installed")
    return mi


def opencv_read(path):
    return np.ascontiguousarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., ::-1])


def quantum(picture):
    """1/256 of the largest channel of each pixel."""
    return picture.max(axis=-1, keepdims=True).astype(float) / 256


# Others read ours


@pytest.mark.parametrize("compression", [None, "none", "rle", "zips", "zip", "piz"])
def test_openexr_reads_every_bit(tmp_path, compression):
    p = noise(40, 61)
    pa.io.write(tmp_path / "a.exr", p, compression=compression)
    stored = exr.File(str(tmp_path / "a.exr"))
    assert stored.channels()["RGB"].pixels.tobytes() == p.tobytes()
    np.testing.assert_allclose(stored.header()["chromaticities"], (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
    assert pa.io.read(tmp_path / "a.exr").tobytes() == p.tobytes()


@pytest.mark.parametrize("ending", ["exr", "hdr", "pfm"])
def test_mitsuba_reads_ours(tmp_path, mitsuba, ending):
    p = noise(40, 61)
    path = pa.io.write(tmp_path / f"a.{ending}", p)
    theirs = np.array(mitsuba.Bitmap(str(path)), np.float32)[..., :3]
    np.testing.assert_array_equal(theirs, pa.io.read(path))
    assert (np.abs(theirs - p) <= (quantum(p) if ending == "hdr" else 0)).all()


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("ending", ["hdr", "pfm"])
def test_opencv_reads_ours(tmp_path, width, ending):
    p = noise(9, width)
    path = pa.io.write(tmp_path / f"a.{ending}", p)
    np.testing.assert_array_equal(opencv_read(path), pa.io.read(path))


@pytest.mark.parametrize("shape", [(9, w) for w in WIDTHS] + [(2, 32767), (2, 32768)])
def test_rgbe_is_within_a_256th_of_the_largest_channel(tmp_path, shape):
    p = noise(*shape, decades=60)
    back = pa.io.read(pa.io.write(tmp_path / "a.hdr", p))
    assert back.shape == p.shape
    assert (np.abs(back.astype(float) - p) <= quantum(p)).all()
    assert np.abs((back.astype(float) - p) / np.maximum(quantum(p), 1e-300)).max() > 0.4, "the bound is not idle"


def test_rgbe_at_the_edges(tmp_path):
    tiny = np.float32(2.0**-128)
    values = [np.nextafter(np.float32(2.0**127), np.float32(0)), 255.7, 256.0, 1.0, 0.0, 1e-45, tiny, 1.00001, 3.0, 9.0]
    p = np.repeat(np.array(values, np.float32)[None, :, None], 3, axis=2)
    back = pa.io.read(pa.io.write(tmp_path / "a.hdr", p))
    bound = np.where(p < tiny, p, quantum(p))  # below the format's least exponent there is only zero
    assert (np.abs(back.astype(float) - p) <= bound).all()


# We read theirs


def test_we_read_opencv(tmp_path, smooth):
    for ending, bound in (("hdr", 2.001 * quantum(smooth)), ("pfm", 0)):  # OpenCV cuts mantissas off
        path = tmp_path / f"a.{ending}"
        assert cv2.imwrite(str(path), smooth[..., ::-1])
        back = pa.io.read(path)
        assert (np.abs(back - smooth) <= bound).all()
        np.testing.assert_array_equal(back, opencv_read(path))


@pytest.mark.parametrize("ending", ["exr", "hdr", "pfm"])
def test_we_read_mitsuba(tmp_path, mitsuba, smooth, ending):
    path = tmp_path / f"a.{ending}"
    mitsuba.Bitmap(smooth).write(str(path))
    np.testing.assert_array_equal(pa.io.read(path), np.array(mitsuba.Bitmap(str(path)), np.float32)[..., :3])


def write_exr(path, channels, **header):
    exr.File({"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage, **header}, channels).write(str(path))


def test_we_read_halves_grey_alpha_and_layers(tmp_path, smooth):
    path = tmp_path / "a.exr"
    half = smooth.astype(np.float16)
    write_exr(path, {"RGBA": np.concatenate([half, half[..., :1]], axis=-1), "depth.Z": smooth[..., 0].copy()})
    np.testing.assert_array_equal(pa.io.read(path), half.astype(np.float32))
    write_exr(path, {"Y": smooth[..., 0].copy()})
    np.testing.assert_array_equal(pa.io.read(path), np.repeat(smooth[..., :1], 3, axis=-1))


def test_foreign_colours_are_refused(tmp_path, smooth):
    path = tmp_path / "a.exr"
    write_exr(path, {"RGB": smooth}, chromaticities=(0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767))
    with pytest.raises(ValueError, match=r"a\.exr .*primaries .* Rec. 709"):
        pa.io.read(path)
    write_exr(path, {"X": smooth[..., 0].copy()})
    with pytest.raises(ValueError, match=r"channels R, G, B or Y, it has X"):
        pa.io.read(path)


HDR = b"#?RADIANCE\n%sFORMAT=32-bit_rle_rgbe\n\n%s\n"
TWO = bytes((128, 64, 32, 129, 128, 128, 128, 130))


def test_the_header_of_radiance_is_obeyed(tmp_path):
    path = tmp_path / "a.hdr"
    first, second = [1.0, 0.5, 0.25], [2.0, 2.0, 2.0]
    for head, size, wanted in (
        (b"", b"-Y 1 +X 2", [[first, second]]),
        (b"", b"-Y 1 -X 2", [[second, first]]),
        (b"", b"+Y 2 +X 1", [[second], [first]]),
        (b"EXPOSURE=4\nEXPOSURE=.5\nCOLORCORR=1 2 1\n", b"-Y 2 +X 1", [[[0.5, 0.125, 0.125]], [[1, 0.5, 1]]]),
        (b"PRIMARIES=.64 .33 .29 .6 .15 .06 .333 .333\n", b"-Y 1 +X 2", [[first, second]]),
    ):
        path.write_bytes(HDR % (head, size) + TWO)
        np.testing.assert_array_equal(pa.io.read(path), wanted)
    for head, size in ((b"", b"+X 2 -Y 1"), (b"PRIMARIES=.7 .3 .17 .8 .13 .05 .31 .33\n", b"-Y 1 +X 2")):
        path.write_bytes(HDR % (head, size) + TWO)
        with pytest.raises(ValueError, match=r"a\.hdr is not a picture"):
            pa.io.read(path)


def test_pfm_of_either_order_and_grey(tmp_path):
    path = tmp_path / "a.pfm"
    path.write_bytes(b"Pf\n2 2\n1.0\n" + np.arange(4, dtype=">f4").tobytes())
    np.testing.assert_array_equal(pa.io.read(path)[..., 1], [[2, 3], [0, 1]])


# What halves and lossy compressions may do


@pytest.mark.parametrize("compression", ["zip", "pxr24", "b44", "b44a", "dwaa", "dwab"])
@pytest.mark.parametrize("half", [False, True])
def test_what_is_not_exact_stays_within_the_tolerance(tmp_path, smooth, half, compression):
    path = pa.io.write(tmp_path / "a.exr", smooth, half=half, compression=compression, tolerance=0.05)
    error = (np.abs(pa.io.read(path) - smooth).max(axis=-1) / smooth.max(axis=-1)).max()
    print(compression, half, error, path.stat().st_size)
    assert error <= 0.05
    exact = not half and compression in ("zip", "b44", "b44a")
    assert (error == 0) == exact
    if not exact:
        with pytest.raises(ValueError, match=r"within tolerance=.*its error is"):
            pa.io.write(path, smooth, half=half, compression=compression, tolerance=0.5 * error)


@pytest.mark.parametrize(
    ("value", "options", "match"),
    [
        (65505.0, {"half": True}, r"picture must be in \[-65504, 65504\] for half=True"),
        (-7e4, {"half": True}, r"picture must be in \[-65504, 65504\]"),
        (1e9, {"compression": "dwaa"}, "picture must survive compression='dwaa' within"),
        (np.nan, {"half": True}, "picture must be finite for half=True, got 1 NaN and 0 inf"),
        (np.inf, {"compression": "pxr24"}, "picture must be finite for compression='pxr24', got 0 NaN and 1 inf"),
    ],
)
def test_what_would_be_destroyed_is_refused(tmp_path, smooth, value, options, match):
    p = smooth.copy()
    p[3, 4, 1] = value
    with pytest.raises(ValueError, match=match):
        pa.io.write(tmp_path / "a.exr", p, **options)
    assert not list(tmp_path.iterdir())
    assert pa.io.read(pa.io.write(tmp_path / "a.exr", p)).tobytes() == p.tobytes(), "float32 holds it"


def test_a_picture_too_dark_for_halves_is_refused(tmp_path, smooth):
    with pytest.raises(ValueError, match="within tolerance"):
        pa.io.write(tmp_path / "a.exr", smooth * np.float32(1e-9), half=True)


# Hard cases


@pytest.mark.parametrize("ending", ["exr", "pfm"])
def test_float32_is_kept_to_the_bit(tmp_path, ending):
    p = RNG.integers(0, 2**32, (17, 13, 3), dtype=np.uint32).view(np.float32)  # NaN, inf and denormals among them
    p[0, 0] = np.nan, np.inf, -np.inf
    path = pa.io.write(tmp_path / f"a.{ending}", p)
    back = pa.io.read(path)
    np.testing.assert_array_equal(
        np.where(np.isnan(p), 0, p).view(np.uint32), np.where(np.isnan(back), 0, back).view("u4")
    )


@pytest.mark.parametrize("ending", ["exr", "hdr", "pfm"])
def test_every_layout_of_memory_is_the_same_picture(tmp_path, smooth, ending):
    path = tmp_path / f"a.{ending}"
    wanted = pa.io.read(pa.io.write(path, smooth.copy()))
    big = np.zeros((128, 288, 3), np.float32)
    big[::2, ::3] = smooth
    frozen = smooth.copy()
    frozen.setflags(write=False)
    for same in (big[::2, ::3], frozen, smooth.astype(float), np.asfortranarray(smooth), smooth.astype(">f4")):
        back = pa.io.read(pa.io.write(path, same))
        np.testing.assert_array_equal(back, wanted)
        assert back.dtype == np.float32
        assert back.flags.c_contiguous
    one = pa.io.read(pa.io.write(path, np.full((1, 1, 3), 0.5)))
    assert one.tolist() == [[[0.5, 0.5, 0.5]]]
    grey = pa.io.read(pa.io.write(path, np.full((3, 9), 0.25)))
    np.testing.assert_array_equal(grey, np.full((3, 9, 3), 0.25))
    assert pa.io.read(pa.io.write(tmp_path / f"A.{ending.upper()}", smooth)).shape == smooth.shape


@pytest.mark.parametrize(
    ("picture", "error", "match"),
    [
        (np.zeros((4, 4, 3), np.uint8), TypeError, "picture must hold linear light"),
        (np.zeros((4, 4, 3), complex), TypeError, "picture must hold real numbers"),
        (np.zeros((4, 4, 4)), ValueError, r"picture must have shape .* got \(4, 4, 4\)"),
        (np.zeros((0, 4, 3)), ValueError, r"picture must have shape .* got \(0, 4, 3\)"),
        (np.full((4, 4, 3), 1e39), ValueError, "picture must fit float32"),
    ],
)
@pytest.mark.parametrize("ending", ["exr", "hdr", "pfm"])
def test_what_is_no_picture_is_refused(tmp_path, ending, picture, error, match):
    with pytest.raises(error, match=match):
        pa.io.write(tmp_path / f"a.{ending}", picture)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("value", "match"),
    [
        (-1e-3, "picture must not be negative for .hdr"),
        (np.nan, "finite for .hdr"),
        (np.inf, "finite"),
        (2e38, "2.127"),
    ],
)
def test_what_rgbe_cannot_hold_is_refused(tmp_path, value, match):
    p = np.ones((4, 9, 3), np.float32)
    p[1, 2, 0] = value
    with pytest.raises(ValueError, match=match):
        pa.io.write(tmp_path / "a.hdr", p)


@pytest.mark.parametrize(
    ("name", "options", "match"),
    [
        ("a.exr", {"compression": "jpeg"}, "compression must be one of 'none'"),
        ("a.exr", {"tolerance": 2}, r"tolerance must be in \[0, 1\]"),
        ("a.exr", {"encoded": True}, "encoded must be False for .exr"),
        ("a.hdr", {"half": True}, "half and compression must be left out for .hdr"),
        ("a.png", {"compression": "zip"}, "half and compression must be left out for .png"),
        ("a.tif", {}, "path must end in .png, .jpg, .exr, .hdr or .pfm, got 'a.tif'"),
    ],
)
def test_options_that_do_not_fit_are_refused(tmp_path, name, options, match):
    with pytest.raises(ValueError, match=match):
        pa.io.write(tmp_path / name, np.ones((4, 4, 3)), **options)


@pytest.mark.parametrize("ending", ["exr", "hdr", "pfm"])
def test_nothing_is_half_written(tmp_path, smooth, ending, monkeypatch):
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        pa.io.write(tmp_path / "nowhere" / f"a.{ending}", smooth)
    with pytest.raises(FileNotFoundError, match="there is no file"):
        pa.io.read(tmp_path / f"a.{ending}")
    path = pa.io.write(tmp_path / f"a.{ending}", smooth)
    before = path.read_bytes()

    def broken(*_, **__):
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setattr(pa.io.hdr, f"_write_{ending}", broken)
        with pytest.raises(MemoryError):
            pa.io.write(path, smooth + 1)
    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", broken)
        with pytest.raises(MemoryError):
            pa.io.write(path, smooth + 1)
    assert [f.name for f in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == before


@pytest.mark.parametrize("ending", ["exr", "hdr", "pfm"])
def test_damage_is_named(tmp_path, ending):
    path = pa.io.write(tmp_path / f"a.{ending}", noise(20, 40))
    whole = path.read_bytes()
    for damaged in (b"", b"\0" * 100, whole[: len(whole) // 2], whole[:-1], whole[:40]):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match=rf"a\.{ending} is not a picture that can be read"):
            pa.io.read(path)
    rng = np.random.default_rng(0)
    for _ in range(300):
        bad = bytearray(whole)
        for at in rng.integers(0, min(len(bad), 400), 3):
            bad[at] = rng.integers(256)
        path.write_bytes(bad)
        with contextlib.suppress(ValueError):  # and nothing else
            assert pa.io.read(path).dtype == np.float32


def test_a_missing_library_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(ImportError, match=r"pip install 'pleinair\[io\]'"):
        pa.io.write(tmp_path / "a.exr", np.ones((4, 4, 3)))
    pa.io.write(tmp_path / "a.hdr", np.ones((4, 4, 3)))


MEMORY = """
import resource, sys
import numpy as np
import pleinair as pa
import pleinair.io
picture = np.exp(np.random.default_rng(0).standard_normal((2000, 2500, 3), np.float32))
pa.io.write(sys.argv[1], picture[:16])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
pa.io.write(sys.argv[1], picture)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 / picture.nbytes)
"""


def test_writing_radiance_takes_no_more_than_the_picture_again(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, str(tmp_path / "a.hdr")], capture_output=True, text=True, check=True
    )
    assert float(done.stdout) <= 1.2

"""Same bits of every colour conversion at each SIMD level and number of threads."""

import numpy as np
import pleinair as pa
import pytest
from pleinair import _core

C = pa.color
CALLS = {
    "srgb_encode": C.srgb_encode,
    "srgb_decode": C.srgb_decode,
    "rgb_to_hsv": C.rgb_to_hsv,
    "hsv_to_rgb": C.hsv_to_rgb,
    "rgb_to_xyz": C.rgb_to_xyz,
    "xyz_to_rgb": C.xyz_to_rgb,
    "xyz_to_xyy": C.xyz_to_xyy,
    "xyy_to_xyz": C.xyy_to_xyz,
    "rgb_to_lab": C.rgb_to_lab,
    "rgb_to_lab encoded": lambda x: C.rgb_to_lab(x, encoded=True),
    "lab_to_rgb": lambda x: C.lab_to_rgb(x * 60),
    "lab_to_rgb encoded": lambda x: C.lab_to_rgb(x * 60, encoded=True),
    "luminance": C.luminance,
}


@pytest.fixture(autouse=True)
def settings():
    threads = pa.get_num_threads()
    yield
    _core.force_simd_level(None)
    pa.set_num_threads(threads)


def pixels(n, dtype):
    rng = np.random.default_rng(n)
    x = rng.uniform(-0.2, 1.4, (n, 3)).astype(dtype)
    x[::7] *= dtype(1e-4)
    x[::11] *= dtype(1e3)
    x[5 % n :: 13] = x[5 % n :: 13, :1]
    x[3 % n :: 97, 1] = np.nan
    x[4 % n :: 89, 2] = np.inf
    x[6 % n :: 83] = 0
    return x


def same(a, b):
    # NaN has many patterns and only that it is one is promised.
    bits = np.uint32 if a.dtype == np.float32 else np.uint64
    return bool(((a.view(bits) == b.view(bits)) | (np.isnan(a) & np.isnan(b))).all())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", CALLS)
def test_levels_and_threads(name, dtype):
    call = CALLS[name]
    assert _core.simd_level() == _core.simd_levels()[-1], "the widest of them is in use"
    # One thread for small inputs; 49157 pixels make seven bands, the last of 5 pixels.
    for n in (1, 7, 33, 259, 3 * 8192 * 2 + 5):
        x = pixels(n, dtype)
        pa.set_num_threads(1)
        want = call(x)
        assert np.isfinite(want).mean() > 0.7
        for level in _core.simd_levels():
            _core.force_simd_level(level)
            for threads in (1, 2, 7) if n > 10_000 else (1,):
                pa.set_num_threads(threads)
                assert same(call(x), want), f"{level}, {threads} threads, {n} pixels"
        _core.force_simd_level(None)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", CALLS)
def test_a_pixel_does_not_depend_on_its_place(name, dtype):
    x = pixels(300, dtype)
    want = CALLS[name](x)
    for i in (0, 1, 31, 32, 255, 256, 299):
        assert same(CALLS[name](x[i : i + 1]), want[i : i + 1])

"""realistic_sky, eq 22, and lenses: against gluUnProject in numpy, the projections of FITS (wcslib) and OpenCV's fisheye."""

import itertools
import math
import pickle
from dataclasses import replace

import cv2
import numpy as np
import pleinair as pa
import pytest
from astropy.wcs import WCS
from pleinair import Camera

SUN = pa.Sun(35, 200)
SKY = pa.sky.CieGeneral(12, SUN)
VIEWS = [
    Camera(64, 48, fov=60),
    Camera(33, 57, fov=100, azimuth=200, elevation=15),
    Camera(40, 20, fov=25, azimuth=-71.3, elevation=-40, roll=33),
    Camera(21, 21, fov=150, azimuth=310, elevation=88, roll=-100),
    Camera(5, 7, fov=0.01, azimuth=123, elevation=45),
    Camera(1, 1, fov=40, azimuth=17, elevation=90, roll=5),
]
# FITS' name of each projection and its scale: degrees of its plane from the middle to the rim.
FITS = {
    "perspective": ("TAN", lambda fov: math.degrees(math.tan(math.radians(fov / 2)))),
    "equidistant": ("ARC", lambda fov: fov / 2),
    "equal_area": ("ZEA", lambda fov: math.degrees(2 * math.sin(math.radians(fov / 4)))),
}


def turn(axis, angle):
    """Rotation matrix about x, y or z, counter-clockwise seen from its tip [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    out = np.eye(4)
    out[i, i] = out[j, j] = c
    out[i, j], out[j, i] = -s, s
    return out


def unproject(camera, near=1.0, far=2.0):
    """gluUnProject of the centres of pixels: the inverse of projection × view rotation, window origin at the lower left."""
    f = 1 / math.tan(math.radians(camera.fov) / 2)
    perspective = np.zeros((4, 4))
    perspective[0, 0], perspective[1, 1] = f * camera.height / camera.width, f
    perspective[2, 2:] = (far + near) / (near - far), 2 * far * near / (near - far)
    perspective[3, 2] = -1
    # OpenGL's eye looks along -z with y up. World to eye: azimuth to north, elevation to the horizon, north to -z, roll.
    azimuth, elevation, roll = np.radians([camera.azimuth, camera.elevation, camera.roll])
    view = turn(2, roll) @ turn(0, -math.pi / 2) @ turn(0, -elevation) @ turn(2, azimuth)
    row, column = np.mgrid[: camera.height, : camera.width] + 0.5
    x, y = 2 * column / camera.width - 1, 2 * (camera.height - row) / camera.height - 1
    clip = np.stack([x, y, np.ones_like(x), np.ones_like(x)], -1)
    p = np.linalg.solve(perspective @ view, clip.reshape(-1, 4).T).T.reshape(clip.shape)
    p = p[..., :3] / p[..., 3:]
    return p / np.linalg.norm(p, axis=-1, keepdims=True)


def fits(camera):
    """Directions of the centres of pixels by wcslib, and which of them are within the circle."""
    name, scale = FITS[camera.projection]
    half = camera.height / 2 if camera.projection == "perspective" else min(camera.width, camera.height) / 2
    w = WCS(naxis=2)
    w.wcs.ctype = [f"RA---{name}", f"DEC--{name}"]
    w.wcs.crval = [camera.azimuth, camera.elevation]
    w.wcs.cunit = ["deg", "deg"]
    # Azimuth grows to the right, rows grow downwards; FITS numbers the first pixel's centre 1.
    w.wcs.crpix = [camera.width / 2 + 0.5, camera.height / 2 + 0.5]
    c, s = math.cos(math.radians(camera.roll)), math.sin(math.radians(camera.roll))
    w.wcs.pc = np.array([[c, s], [-s, c]]) @ np.diag([1, -1])
    w.wcs.cdelt = [scale(camera.fov) / half] * 2
    w.wcs.lonpole = 180
    row, column = np.mgrid[: camera.height, : camera.width] + 1.0
    longitude, latitude = np.radians(w.wcs_pix2world(column.ravel(), row.ravel(), 1))
    to = np.stack([np.sin(longitude) * np.cos(latitude), np.cos(longitude) * np.cos(latitude), np.sin(latitude)], -1)
    inside = np.hypot(row - w.wcs.crpix[1], column - w.wcs.crpix[0]) <= half
    return to.reshape(camera.height, camera.width, 3), inside


# ---- Eq 22.


@pytest.mark.parametrize("camera", VIEWS, ids=str)
def test_eq_22_is_what_opengl_unprojects(camera):
    # As printed it lacks the rotation of the view, the division by w, and pixels' centres.
    assert np.abs(camera.directions() - unproject(camera)).max() < 1e-12


def test_the_picture_is_as_a_viewer_sees_it():
    to = Camera(3, 3, azimuth=90).directions()
    assert to[1, 1] == pytest.approx([1, 0, 0], abs=1e-15)
    assert to[0, 1, 2] > 0, "row 0 is at the top"
    assert to[1, 2, 1] < 0, "who looks east has south on the right"
    tilted = Camera(3, 3, azimuth=90, roll=20).directions()
    assert tilted[1, 2, 2] < 0, "a head turned clockwise sees the horizon rise on the right, and ground there"


# ---- Lenses.


@pytest.mark.parametrize("projection", FITS)
def test_projections_are_those_of_fits(projection):
    for fov, (azimuth, elevation, roll), (width, height) in itertools.product(
        (20, 100, 170) if projection == "perspective" else (20, 180, 250, 359),
        ((0, 0, 0), (200, 15, 0), (75, -50, 130), (310, 80, -20)),
        ((64, 48), (31, 57)),
    ):
        camera = Camera(width, height, fov, azimuth, elevation, roll, projection=projection)
        want, inside = fits(camera)
        got = camera.directions()
        if projection == "perspective":
            inside[:] = True
        assert np.abs(got - want)[inside].max() < 1e-12
        assert (got[~inside] == 0).all(), "outside the circle there is no direction"
        assert np.abs(np.linalg.norm(got[inside], axis=-1) - 1).max() < 1e-15 * 4


def test_an_equidistant_fisheye_is_opencvs():
    camera = Camera.fisheye(101, fov=160, azimuth=40, elevation=20, roll=10)
    d = camera.directions()
    middle, right, top = d[50, 50], d[50, 60], d[40, 50]
    x, y = (v - v @ middle * middle for v in (right, -top))
    axes = np.stack([x / np.linalg.norm(x), y / np.linalg.norm(y), middle])
    seen = d[d.any(-1)] @ axes.T
    focal = 50.5 / math.radians(80)
    matrix = np.array([[focal, 0, 50.0], [0, focal, 50.0], [0, 0, 1]])
    places, _ = cv2.fisheye.projectPoints(seen[:, None], np.zeros(3), np.zeros(3), matrix, np.zeros(4))
    want = np.argwhere(d.any(-1))[:, ::-1]
    assert np.abs(places[:, 0] - want).max() < 1e-9


@pytest.mark.parametrize("fov", [90, 180, 360])
def test_equal_areas_are_equal_solid_angles(fov):
    size = 400
    to = Camera.fisheye(size, fov, elevation=30, equal_area=True).directions()
    used = to.any(-1)
    cap = 2 * math.pi * (1 - math.cos(math.radians(fov / 2)))
    pixel = cap / (math.pi * (size / 2) ** 2)
    whole = used[:-1, :-1] & used[1:, :-1] & used[:-1, 1:] & used[1:, 1:]
    across, down, back = to[:-1, 1:] - to[:-1, :-1], to[1:, :-1] - to[:-1, :-1], to[1:, 1:]
    area = 0.5 * np.linalg.norm(np.cross(across, down), axis=-1)
    area += 0.5 * np.linalg.norm(np.cross(back - to[:-1, 1:], back - to[1:, :-1]), axis=-1)
    # Towards the rim of 360° pixels are slivers around one point, and chords are shorter than arcs.
    near = to[:-1, :-1] @ to[size // 2, size // 2] > -0.5
    assert area[whole & near] == pytest.approx(pixel, rel=4e-3)
    assert used.sum() * pixel == pytest.approx(cap, rel=1e-3)


def test_a_fisheye_looks_up_by_default():
    to = Camera.fisheye(101).directions()
    assert to[50, 50] == pytest.approx([0, 0, 1], abs=1e-15)
    assert to[0, 50, 1] < -0.99, "south at the top"
    assert to[50, 100, 0] > 0.99, "east on the right"
    assert not to[0, 0].any()
    assert Camera.fisheye(101, azimuth=180).directions()[0, 50, 1] > 0.99, "or north"
    assert (to[to.any(-1)][:, 2] >= 0).all(), "a hemisphere and no more"
    around = Camera.fisheye(64, fov=360).directions()
    assert around[..., 2].min() < -0.99, "all of the sphere"


@pytest.mark.parametrize("equal_area", [False, True])
def test_pixels_on_the_rim(equal_area):
    # Odd by even: the centres of some pixels are on the circle itself.
    for width in range(1, 60, 2):
        camera = Camera(width, width + 1, 180, elevation=90, projection="equal_area" if equal_area else "equidistant")
        to = camera.directions()
        assert np.isfinite(to).all()
        assert to[0, width // 2] == pytest.approx([0, -1, 0], abs=1e-12)
        rgb = SKY.render(camera)
        assert rgb[0, width // 2] == pytest.approx(SKY.radiance([[0, -1, 1e-9]])[0], rel=1e-5)
        assert ((rgb > 0).all(-1) == to.any(-1)).all()
    whole = Camera(3, 4, 360, elevation=90, projection="equal_area" if equal_area else "equidistant").directions()
    assert whole[0, 1] == pytest.approx([0, 0, -1], abs=1e-7)


def test_a_panorama_is_the_skys():
    for height in (1, 2, 33, 128):
        to = Camera.panorama(height).directions()
        row, column = np.mgrid[:height, : 2 * height] + 0.5
        polar, azimuth = row / height * np.pi, column / height * np.pi
        want = np.stack([np.sin(azimuth) * np.sin(polar), np.cos(azimuth) * np.sin(polar), np.cos(polar)], -1)
        assert np.abs(to - want).max() < 1e-15 * 4
    for sky in (SKY, pa.sky.Preetham(SUN, 3.0), pa.sky.Aoas(sun=SUN, ambiguity=0.05, cloud_complexity=3)):
        for method in ("fast", "reference"):
            seen = sky.render(Camera.panorama(24), method=method)
            np.testing.assert_array_equal(seen, sky.panorama(24, method=method))


# ---- Skies through them.

LENSES = {
    "perspective": Camera(61, 40, fov=80, azimuth=190, elevation=30, roll=12),
    "equidistant": Camera(61, 40, fov=200, azimuth=190, elevation=70, roll=12, projection="equidistant"),
    "equal_area": Camera.fisheye(50, equal_area=True),
    "panorama": Camera.panorama(31),
}
SKIES = {
    "cie": SKY,
    "preetham": pa.sky.Preetham(SUN, 3.0),
    "aoas": pa.sky.Aoas(sun=SUN),
}


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("name", ["cie", "preetham", "aoas"])
def test_a_picture_is_the_radiance_of_its_directions(name, lens):
    sky, camera = SKIES[name], LENSES[lens]
    to = camera.directions()
    used = to.any(-1)
    for method in ("fast", "reference") if name == "cie" else ("fast",):
        rgb = sky.render(camera, method=method)
        assert rgb.shape == (camera.height, camera.width, 3)
        assert (rgb[~used] == 0).all(), "black outside the circle"
        want = sky.radiance(np.tile(to[used], (2, 1)), method=method)[: used.sum()]
        # Directions in single precision, and a Sun's glow; a perspective may be interpolated to the tolerance.
        rel = 1e-3 if lens == "perspective" and method == "fast" else 2e-5
        assert rgb[used] == pytest.approx(want, rel=rel, abs=1e-6 * float(want.max()))


def test_what_a_fisheye_adds_up_to_is_the_irradiance():
    size = 300
    camera = Camera.fisheye(size, equal_area=True)
    for sky in (SKY, pa.sky.Preetham(SUN, 4.0), pa.sky.CieGeneral(5, SUN, zenith_luminance=1000)):
        up = camera.directions()[..., 2:]
        got = (sky.render(camera).astype(float) * up).sum((0, 1)) * 2 * math.pi / (math.pi * (size / 2) ** 2)
        assert got == pytest.approx(sky.irradiance((0, 0, 1), disc=False), rel=2e-3)


def test_what_cannot_look_through_a_lens_says_so():
    cloud = pa.clouds.Volume(np.ones((4, 4, 4)), 25.0)
    for name in ("equidistant", "equal_area", "panorama"):
        camera = LENSES[name]
        for call in (
            lambda camera=camera: pa.clouds.render(cloud, pa.clouds.Params(), camera, SUN, sky=(0, 0, 0)),
            lambda camera=camera: pa.clouds.Basis.precompute(cloud, camera, SUN),
        ):
            with pytest.raises(ValueError, match=rf"^camera must have the projection 'perspective' here, got '{name}'"):
                call()


# ---- The value.


def test_it_is_a_value():
    for camera in (*VIEWS, *LENSES.values()):
        assert pickle.loads(pickle.dumps(camera)) == camera
        assert eval(repr(camera), {"Camera": Camera}) == camera
        assert hash(camera) == hash(replace(camera))
    assert Camera(20, 10, projection="panorama") == Camera.panorama(10)
    assert Camera.fisheye(9, equal_area=True) == Camera(9, 9, 180, elevation=90, projection="equal_area")
    assert Camera.panorama(10).resized(40, 20) == Camera.panorama(20)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"projection": "fisheye"}, "projection must be one of 'perspective', .*, got 'fisheye'"),
        ({"projection": None}, "projection must be one of"),
        ({"fov": 180}, r"fov must be in \[0.001, 179\]"),
        ({"projection": "equal_area", "fov": 361}, r"fov must be in \[0.001, 360\]"),
        ({"projection": "equidistant", "fov": math.nan}, "fov must be in"),
        ({"projection": "panorama", "width": 21}, "width must be twice the height of a panorama, got 21 × 10"),
        ({"projection": "panorama", "azimuth": 5}, "azimuth, elevation and roll must be 0 for a panorama"),
        ({"width": 0}, "width must be in"),
    ],
)
def test_refusals(arguments, text):
    with pytest.raises(ValueError, match=f"^{text}"):
        Camera(**{"width": 20, "height": 10, **arguments})
    with pytest.raises(TypeError, match=r"^equal_area"):
        Camera.fisheye(10, equal_area=1)
    with pytest.raises(ValueError, match=r"^height"):
        Camera.panorama(0)

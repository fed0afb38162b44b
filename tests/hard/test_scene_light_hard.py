"""Where the light of a scene is hardest: units, water from below, nothing, Ctrl-C. Rows of docs/hard_cases.md."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.clouds import Params
from pleinair.paint import Strokes
from pleinair.plants import Strata, Surface, Tree, preset
from pleinair.scene import Cloud, Ground, Placed

DAY = pa.sky.Natural(sun=pa.Sun(35, 200), turbidity=2.5)
CAMERA = pa.Camera(64, 48, fov=50, elevation=4, position=(0, -8, 3))
FIELD = Ground(Surface.heightfield(np.zeros((2, 2)), 60.0, (-30, 12, 0)), "grass", Strata((30, 30), 2), rng=1)
POND = Ground(
    Surface.heightfield(np.full((2, 2), 0.2), 40.0, (-20, -14, 0)),
    "water",
    Strata((30, 30), 3, size=(3, 1)),
    2,
    roughness=0,
)
TREE = Placed(Tree.grow(preset("shrub"), rng=1), (0, 14, 0))
CLOUD = pa.clouds.procedural("cumulus", (8, 16, 16), voxel_size=60.0, origin=(-500, 3000, 500), rng=3)


def test_clouds_in_another_unit_than_their_sky_are_refused():
    relative = pa.sky.Aoas(sun=pa.Sun(35, 200))
    in_candela = pa.Scene(DAY, clouds=CLOUD)._backdrop.cloud_params()
    with pytest.raises(ValueError, match=r"must be in the unit of Aoas, whose lamp gives clouds .*, not in cd/m²"):
        pa.Scene(relative, clouds=CLOUD, cloud_params=in_candela)
    with pytest.raises(ValueError, match="ambient is"):
        pa.Scene(relative, clouds=CLOUD, cloud_params=Params(ambient=1.0, ambient_color=(4000.0, 4500.0, 6000.0)))
    own = pa.Scene(relative, clouds=CLOUD)._backdrop.cloud_params()
    same = pa.Scene(relative, clouds=CLOUD, cloud_params=own).radiance(CAMERA)
    assert np.array_equal(same, pa.Scene(relative, clouds=CLOUD).radiance(CAMERA))
    # Factors have no unit.
    assert pa.Scene(relative, clouds=Cloud(CLOUD, Params(light_intensity=1.0))).radiance(CAMERA).max() < 100
    pa.Scene(DAY, clouds=CLOUD, cloud_params=in_candela)


def test_water_from_below_has_its_own_colour():
    scene = pa.Scene(DAY, [POND, FIELD, TREE], grown=False, sky_strokes=0, clouds=CLOUD, visibility=1e9)
    below = pa.Camera(32, 24, fov=40, elevation=60, position=(0, 0, -9))

    def painted(one):
        layer = one.layers(below)["strokes"]
        some = layer.transmittance < 0.8
        assert some.mean() > 0.2
        return layer.radiance[some] / (1 - layer.transmittance[some])[:, None]

    # As dark as its palette under the light from above, whatever stands there: no mirror, no Sun.
    own, alone = painted(scene), painted(replace(scene, objects=[POND], clouds=None))
    assert np.median(own) == pytest.approx(np.median(alone), rel=0.02)
    assert own.max() < 0.3 * float(DAY.irradiance([(0, 0, 1)]).max()) / np.pi
    above = scene.radiance(replace(below, position=(0, 0, 4), elevation=-60))
    assert np.isfinite(above).all()
    # The moment the eye dips in.
    for z in (0.2 - 1e-9, 0.2, 0.2 + 1e-9):
        assert np.isfinite(scene.radiance(replace(below, position=(0, -10, z), elevation=0))).all()


@pytest.mark.parametrize(
    "camera",
    [
        pa.Camera(1, 1, fov=50, position=(0, -8, 3)),
        replace(CAMERA, azimuth=180),
        replace(CAMERA, position=(0, 200, 3)),
    ],
    ids=["one pixel", "looking away", "past everything"],
)
def test_what_is_behind_the_camera_is_not_seen(camera):
    full = pa.Scene(DAY, [FIELD, TREE], grown=False, clouds=CLOUD)
    behind = replace(full, objects=[FIELD, TREE, Placed(TREE.tree, (0, -60, 0))]) if camera.azimuth == 0 else full
    a, b = (scene.radiance(camera) for scene in (full, behind))
    assert a.shape == (camera.height, camera.width, 3)
    assert np.isfinite(a).all()
    if camera.position[1] > 0:
        assert np.array_equal(a, b)
    if camera.azimuth == 180:
        assert full.stages(camera)["mask"].max() == 0
    pa.set_num_threads(2)
    try:
        assert np.array_equal(full.radiance(camera), a)
    finally:
        pa.set_num_threads(None)


@pytest.mark.parametrize("visibility", [0, -1.0, 0.999, 1.1e9, np.nan])
def test_visibility_out_of_range_is_refused(visibility):
    with pytest.raises(ValueError, match=r"visibility must be in \[1, 1e\+09\] \[m\]"):
        pa.Scene(DAY, visibility=visibility)


def test_two_grounds_and_clouds_in_one_place_are_drawn_in_one_order():
    twice = pa.Scene(DAY, [FIELD, FIELD, TREE, TREE], grown=False, clouds=[CLOUD, CLOUD])
    picture = twice.radiance(CAMERA)
    assert np.isfinite(picture).all()
    assert np.array_equal(replace(twice).radiance(CAMERA), picture)


def test_strokes_far_from_each_other_have_one_shadow_map():
    # A scene a hundred kilometres wide: its map is coarse, and what is alone stays in full light.
    strokes = Strokes([[0, 10, 0.0], [1e5, 10, 0], [0, 1e5, 0]], (0, 0, 1), (2, 2))
    (lit,) = (s.lit for s in pa.Scene(DAY, [strokes]).strokes(CAMERA).values())
    assert lit == pytest.approx(1, abs=1e-6)


_PAINT = """
import os, signal, sys, threading, time
import pleinair as pa
at = [0.0]
def hit():
    at[0] = time.process_time()
    os.kill(os.getpid(), signal.SIGINT)
try:
    scene, camera = pa.demo.landscape(trees=4)
    threading.Timer(float(sys.argv[1]), hit).start()
    scene.paint(camera)
    scene.frame(pa.Timeline(camera, sky=lambda t: pa.sky.Natural(sun=pa.Sun(20.5 + t, 240.5))), 0.0)
    time.sleep(60)
except KeyboardInterrupt:
    print(time.process_time() - at[0])
"""


@pytest.mark.parametrize("delay", [0.2, 1.3, 2.9])
def test_ctrl_c_ends_a_frame(delay):
    # In CPU seconds: what else the machine does is not seen.
    done = subprocess.run(
        [sys.executable, "-c", _PAINT, str(delay)], capture_output=True, check=False, text=True, timeout=110
    )
    assert done.returncode == 0, done.stderr
    assert 0 <= float(done.stdout) < 0.2

"""Other programs beside `io.write_layers`: Mitsuba reads each layer and the whole."""

import types
import warnings
from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.plants import Strata, Surface, Tree, preset
from pleinair.scene import Ground, Placed

pytest.importorskip("OpenEXR")

SKY = pa.sky.Natural(sun=pa.Sun(35, 200), turbidity=2.5)
CAMERA = pa.Camera(96, 54, fov=50, elevation=6, position=(0, -5, 2))
FIELD = Ground(Surface.heightfield(np.zeros((2, 2)), 60.0, (-30, 0, 0)), "grass", Strata((40, 40), 2), rng=1)
TREE = Placed(Tree.grow(preset("shrub"), rng=1), (0, 9, 0))
CLOUD = pa.clouds.procedural("cumulus", (8, 16, 16), voxel_size=60.0, origin=(-500, 3000, 500), rng=3)
SCENE = pa.Scene(SKY, [FIELD, TREE], clouds=CLOUD, grown=False)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    layers = SCENE.layers(CAMERA)
    assert list(layers) == ["sky", "clouds", "plain", "strokes"]
    return pa.io.write_layers(tmp_path_factory.mktemp("layers") / "a.exr", layers), layers


def test_mitsuba_reads_each_layer(file):
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mitsuba as mi

            mi.set_variant("scalar_rgb")
    except ImportError:
        pytest.skip("mitsuba (group bench) is not installed")
    path, layers = file
    bitmap = mi.Bitmap(str(path))
    names = [field.name for field in bitmap.struct_()]
    pixels = dict(zip(names, np.moveaxis(np.array(bitmap), -1, 0), strict=True))
    whole = np.stack([pixels[c] for c in "RGB"], axis=-1)
    assert whole == pytest.approx(SCENE.radiance(CAMERA), rel=1e-5, abs=1e-2)
    for name, layer in layers.items():
        for k, channel in enumerate("RGB"):
            assert np.array_equal(pixels[f"{name}.{channel}"], layer.radiance[..., k]), (name, channel)
        assert np.array_equal(pixels[f"{name}.A"], 1 - layer.transmittance), name
        assert np.array_equal(pixels[f"{name}.Z"], layer.depth), name


def test_a_reader_of_pictures_reads_the_whole(file):
    path, _ = file
    seen = pa.io.read(path)
    assert seen == pytest.approx(SCENE.radiance(CAMERA), rel=1e-5, abs=1e-2)


def test_it_comes_back_as_it_was(file):
    path, layers = file
    back = pa.io.read_layers(path)
    assert list(back) == list(layers)
    for name, layer in layers.items():
        assert np.array_equal(back[name]["radiance"], layer.radiance)
        assert np.array_equal(back[name]["depth"], layer.depth)
        assert np.abs(back[name]["transmittance"] - layer.transmittance).max() <= 2**-24


def test_a_cloud_before_strokes_is_in_their_layer():
    near = pa.scene.Cloud(CLOUD, position=(400, -2985, -520))
    hill = Ground(
        Surface.heightfield(np.full((2, 2), 40.0), 900.0, (-450, 900, 0)), "grass", Strata((30, 30), 2), rng=1
    )
    scene = replace(SCENE, objects=[hill], clouds=near, cast_shadows=False)
    camera = replace(CAMERA, position=(0, -700, 60), elevation=0)
    picture = 0
    for layer in scene.layers(camera).values():
        picture = layer.radiance + layer.transmittance[..., None] * picture
    assert picture == pytest.approx(scene.radiance(camera), rel=1e-4, abs=1e-1)


@pytest.mark.parametrize(
    ("layers", "wrong"),
    [
        ({}, "at least one"),
        ({"a.b": None}, "names"),
        ({"a": types.SimpleNamespace(radiance=np.ones((2, 2)), transmittance=np.ones((2, 2)), depth=np.ones((2, 2)))}, "shapes"),
        ({"a": types.SimpleNamespace(radiance=np.ones((2, 2, 3)), transmittance=2 * np.ones((2, 2)), depth=np.ones((2, 2)))}, "transmittance"),
    ],
)  # fmt: skip
def test_what_is_no_layer_is_refused(layers, wrong, tmp_path):
    with pytest.raises(ValueError, match=wrong):
        pa.io.write_layers(tmp_path / "a.exr", layers)
    with pytest.raises(ValueError, match=r"\.exr"):
        pa.io.write_layers(tmp_path / "a.png", layers)


def test_a_file_without_layers_is_refused(tmp_path):
    plain = pa.io.write(tmp_path / "plain.exr", np.ones((4, 4, 3)))
    with pytest.raises(ValueError, match="no layers, its channels are"):
        pa.io.read_layers(plain)
    (tmp_path / "no.exr").write_bytes(b"not at all")
    with pytest.raises(ValueError, match=r"no\.exr"):
        pa.io.read_layers(tmp_path / "no.exr")
    with pytest.raises(ValueError, match="allowed"):
        pa.io.read_layers(plain, max_pixels=10)

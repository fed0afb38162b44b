"""What docs/scene_light.md claims of a scene's light: layers, units, hard cases."""

from dataclasses import replace

import numpy as np
import pleinair as pa
import pytest
from pleinair.paint import Strokes
from pleinair.plants import Strata, Surface, Tree, preset
from pleinair.scene import Ground, Placed
from pleinair.scene.painting import light_left

DAY = pa.sky.Natural(sun=pa.Sun(35, 200), turbidity=2.5)
CAMERA = pa.Camera(96, 54, fov=50, elevation=6, position=(0, -5, 2))
FIELD = Ground(Surface.heightfield(np.zeros((2, 2)), 60.0, (-30, 0, 0)), "grass", Strata((40, 40), 2), rng=1)
TREE = Placed(Tree.grow(preset("shrub"), rng=1), (0, 9, 0))
SCENE = pa.Scene(DAY, [FIELD, TREE], grown=False, sky_strokes=3000)


def test_layers_over_each_other_are_the_picture():
    layers = SCENE.layers(CAMERA)
    assert list(layers) == ["sky", "plain", "strokes"]
    picture = 0
    for layer in layers.values():
        picture = layer.radiance + layer.transmittance[..., None] * picture
    assert picture == pytest.approx(SCENE.radiance(CAMERA), rel=1e-5, abs=1e-2)
    for name, layer in layers.items():
        there = layer.transmittance < 0.5
        assert np.isinf(layer.depth[there]).all() == (name == "sky"), name
    near = layers["strokes"].depth[30:, 40:56]
    assert 3 < near[np.isfinite(near)].min() < 15


def test_light_is_linear_in_the_sky():
    class Twice(pa.sky.Sky):
        sun, absolute, one = DAY.sun, True, DAY

        def radiance(self, directions, **more):
            return 2 * self.one.radiance(directions, **more)

        def render(self, camera, **more):
            return 2 * self.one.render(camera, **more)

        def panorama(self, height=512, **more):
            return 2 * self.one.panorama(height, **more)

        def without_disc(self):
            return TwiceBare()

        def _lights(self):
            (lamp,) = DAY._lights()
            return [replace(lamp, irradiance=tuple(2 * x for x in lamp.irradiance))]

    class TwiceBare(Twice):
        one = DAY.without_disc()

    scene = replace(SCENE, sky_strokes=0, visibility=5e3)
    once, twice = scene.radiance(CAMERA), replace(scene, sky=Twice()).radiance(CAMERA)
    assert twice == pytest.approx(2 * once, rel=1e-3)
    # And the eye, adapted to twice as much, sees the same.
    assert np.abs(scene.paint(CAMERA) - replace(scene, sky=Twice()).paint(CAMERA)).max() < 0.01


def test_shadows_leave_the_light_of_the_sky():
    white = Strokes([[0, 20, 0]], (0, 0, 1), (4, 4), material="straw", label=[3])
    roof = Strokes([[0, 20, 8]] * 6, (0, 0, 1), (40, 40), label=range(6))
    scene = pa.Scene(replace(DAY, sun=pa.Sun(80, 200)), [roof, white], visibility=1e9)
    parts = scene.strokes()
    fall = [
        scene._environment.irradiance(strokes.normal, light_left(scene, part, strokes))[0]
        for part, strokes in parts.items()
    ][1]
    sky = scene.sky.irradiance([(0, 0, 1)], disc=False)[0]
    whole = scene.sky.irradiance([(0, 0, 1)])[0]
    share = (fall - sky) / (whole - sky)
    assert share == pytest.approx(np.repeat(parts[list(parts)[1]].lit[0], 3), abs=0.02)
    assert share.max() < 0.3, "six coats of a roof"


@pytest.mark.parametrize("visibility", [1.0, 1e9])
def test_the_ends_of_visibility(visibility):
    seen = replace(SCENE, visibility=visibility, sky_strokes=0).radiance(CAMERA)
    assert np.isfinite(seen).all()
    horizon = DAY.without_disc().radiance([[0, 1, 1e-3]])[0]
    ground = seen[-6:].reshape(-1, 3)
    if visibility == 1:
        assert ground == pytest.approx(np.broadcast_to(horizon, ground.shape), rel=0.1), "nothing but air"
    else:
        clear = replace(SCENE, sky=replace(DAY, turbidity=1.0), sky_strokes=0).radiance(CAMERA)
        assert np.abs(np.log(ground.mean(axis=0) / clear[-6:].reshape(-1, 3).mean(axis=0))).max() < 0.2


def test_air_is_that_of_the_sky():
    far = Strokes([[0.0, 3000.0, 0.0]], (0, -1, 0), (900, 900), material="grass")
    # The style's own atmosphere is part of its palettes.
    bare = replace(SCENE.style, atmosphere=pa.paint.AerialPerspective(strength=0.0, value=(0.0, 1.0)))
    shares = []
    for turbidity in (2.0, 6.0):
        sky = replace(DAY, turbidity=turbidity)
        own, seen = (
            scene._shaded(scene.strokes(), CAMERA)[0].sprites.color[0]
            for scene in (pa.Scene(sky, [far], bare, visibility=v) for v in (1e9, None))
        )
        horizon = sky.without_disc().radiance([[0, 1, 1e-3]])[0]
        shares.append((seen - horizon) / (own - horizon))
    # Turbidity 2: beta .0463, aerosol .0463 / 1200 m × .55^-1.3 and molecules 1.2e-5 /m: 3 km leave e^-.29 of green.
    assert shares[0][1] == pytest.approx(np.exp(-3000 * (0.0463 / 1200 * 0.543**-1.3 + 1.25e-5)), rel=0.03)
    assert (shares[0] > shares[1]).all(), "more aerosol leaves less"
    assert shares[0][0] > shares[0][1] > shares[0][2], "and blue is scattered most"


def test_no_light_at_all_is_black():
    dark = pa.sky.Natural(sun=pa.Sun(-40, 90), airglow=0, milky_way=False, zodiacal_light=False, stars=None)
    scene = replace(SCENE, sky=dark)
    assert not scene.radiance(CAMERA).any()
    assert not scene.paint(CAMERA).any()


def test_the_moon_lights_when_the_sun_is_down():
    night = pa.sky.Natural(sun=pa.Sun(-30, 0), moon=pa.astro.Moon(40, 200), stars=None)
    scene = replace(SCENE, sky=night, sky_strokes=0)
    moonless = replace(scene, sky=replace(night, moon=None))
    with_moon, without = scene.radiance(CAMERA)[-8:].mean(), moonless.radiance(CAMERA)[-8:].mean()
    assert with_moon > 20 * without > 0
    ground = scene.paint(CAMERA)[-8:].mean()
    assert moonless.paint(CAMERA)[-8:].mean() < ground < 0.1


def test_a_sun_behind_leaves_is_shown_as_one_beside_them():
    # White is a function of the camera: what is not covered by the leaf keeps its bits.
    sky = pa.sky.Natural(sun=pa.Sun(6, 0), turbidity=3)
    leaf = Strokes([[0, 9, 3.0]] * 9, (0, -1, 0), (1.4, 1.4), label=range(9))
    bare, seen = pa.Scene(sky, visibility=1e9), pa.Scene(sky, [leaf], visibility=1e9)
    camera = pa.Camera(128, 72, fov=40, elevation=8, position=(0, 0, 2))
    far = np.s_[:, :20]
    off = [one.shown(scene.radiance(camera), camera, 1.0, None) for scene in (bare, seen) for one in [scene._backdrop]]
    # The eye's own glare is less.
    assert np.abs(off[0][far] - off[1][far]).max() < 0.05
    turned = [bare._backdrop.white(replace(camera, azimuth=a), 1000.0) for a in np.arange(0, 60, 0.5)]
    assert (np.diff(turned) <= 0).all()
    assert np.abs(np.diff(np.log10(turned))).max() < 0.45, "a lamp comes into view by and by"
    assert turned[-1] == 1e4

"""Pixar's USD reads our stage: what its schemas say of the dome and the Sun is what we mean."""

from types import SimpleNamespace

import numpy as np
import pleinair as pa
import pytest

pytest.importorskip("pxr", reason="usd-core (group bench) is not installed")


def matrix(prim):
    from pxr import UsdGeom

    return np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize(("elevation", "azimuth"), [(35, 120), (-5, 200), (90, 0), (0, 90), (-90, 10)])
def test_the_stage_shines_from_where_we_say(up, elevation, azimuth):
    from pxr import Usd, UsdGeom, UsdLux

    direction = pa.Sun(elevation, azimuth).direction
    sun = SimpleNamespace(direction=direction, irradiance=(3.0, 2.0, 0.5), angular_radius=0.2666)
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(pa.exports.usda("skies/noon.exr", sun, up=up))
    assert UsdGeom.GetStageUpAxis(stage) == up.upper()

    light = UsdLux.DistantLight(stage.GetPrimAtPath("/Environment/Sun"))
    x, y, z = direction
    np.testing.assert_allclose(matrix(light.GetPrim())[:3, 2], (x, y, z) if up == "z" else (x, z, -y), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(matrix(light.GetPrim())), 1)
    irradiance = np.array(light.GetColorAttr().Get()) * light.GetIntensityAttr().Get()
    np.testing.assert_allclose(irradiance, sun.irradiance, rtol=1e-6)
    assert light.GetNormalizeAttr().Get() is True
    assert light.GetAngleAttr().Get() == pytest.approx(0.5332)

    dome = UsdLux.DomeLight(stage.GetPrimAtPath("/Environment/Sky"))
    assert dome.GetTextureFileAttr().Get().path == "skies/noon.exr"
    assert dome.GetTextureFormatAttr().Get() == "latlong"
    # What USD itself does to a dome, whose pole is +y, on a stage with this axis up.
    own = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(own, up.upper())
    theirs = UsdLux.DomeLight.Define(own, "/dome")
    theirs.OrientToStageUpAxis()
    np.testing.assert_allclose(matrix(dome.GetPrim()), matrix(theirs.GetPrim()), atol=1e-12)


def test_a_sky_without_a_sun():
    from pxr import Usd

    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(pa.exports.usda("night.exr"))
    assert [p.GetName() for p in stage.GetPrimAtPath("/Environment").GetChildren()] == ["Sky"]

"""Every style at every hour: a finite picture of the display, that is neither black nor white."""

import numpy as np
import pleinair as pa
import pytest

ELEVATIONS = (-18, -12, -6, -0.3, 0, 3, 15, 45, 90)


@pytest.mark.parametrize("name", pa.paint.styles())
def test_a_style_at_every_hour(name):
    for elevation in ELEVATIONS:
        sky = pa.sky.Natural(sun=pa.Sun(elevation, 200), turbidity=2.5)
        scene, camera = pa.demo.landscape(sky, style=name, trees=1, cloud=False, grown=False)
        picture = scene.paint(camera.resized(64, 36))
        assert np.isfinite(picture).all(), elevation
        assert picture.min() >= 0, elevation
        assert picture.max() <= 1, elevation
        spread = float(np.percentile(picture, 95) - np.percentile(picture, 5))
        assert spread > 0.01, f"at {elevation}° there is something to see, got {spread}"

"""corot in motion: what a camera that moves does to the strokes of a whole tree, with the masks trees are painted with."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pleinair as pa
import pytest
from pleinair import paint, plants
from scipy.ndimage import map_coordinates

WIDTH, HEIGHT, FRAMES = 160, 120, 120
OAK = plants.Tree.grow(plants.preset("oak"), rng=1)
SCENE = pa.Scene(pa.sky.Aoas(sun=pa.Sun(26, 235)), [OAK], grown=False)
PATHS = {
    "orbit": lambda t: (30 * np.sin(t), -30 * np.cos(t), 4.0),
    "dolly": lambda t: (0.4 * t, -42 + 20 * t, 4.0),
}


def frames(path):
    """Sprites, depths along the view and the slabs' thickness, frame by frame."""
    (crown,) = (s for part, s in SCENE.strokes().items() if part.kind == "leaves")
    for t in np.linspace(0, 1, FRAMES):
        camera = pa.Camera.look_at(PATHS[path](t), (0, 0, 7), WIDTH, HEIGHT, fov=34)
        sprites = paint.shade(crown, SCENE.style, camera, SCENE.light(), circles=(400, 800)).sprites
        along = (crown.position - camera.position) @ camera._axes()[2]
        yield sprites, along, crown.size[:, 0].astype(float)


def painted(frame, how, frozen):
    sprites, along, thickness = frame
    if how == "slab":
        return paint.composite(sprites, WIDTH, HEIGHT, order="slab", delta=thickness, seen=True)
    depth = along if how == "by view depth" else frozen
    return paint.composite(replace(sprites, depth=depth), WIDTH, HEIGHT, seen=True)


def warping_errors(path):
    """W1: squared error of a frame against the next one, moved back by the true motion of each pixel's stroke."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    found = {"by view depth": [], "never reordered": [], "slab": []}
    last = None
    for frame in frames(path):
        if last is not None:
            motion = frame[0].center - last[0].center
            errors, inside = {}, True
            for how in found:
                one, two = (painted(f, how, last[1]) for f in (last, frame))
                flow = motion[np.maximum(one.index, 0)]
                at = [y + flow[..., 1], x + flow[..., 0]]
                moved = np.stack([map_coordinates(two.rgb[..., c], at, order=1) for c in range(3)], axis=-1)
                errors[how] = np.square(moved - one.rgb).sum(axis=-1)
                inside = inside & (one.index >= 0) & (one.transmittance < 0.1)
            for how, values in found.items():
                values.append(errors[how][inside])
        last = frame
    return {how: np.concatenate(values) for how, values in found.items()}


@pytest.mark.parametrize("path", PATHS)
def test_w1_what_an_order_adds_is_a_third_in_slabs(path):
    found = warping_errors(path)
    # Masks full of detail move across the pixels and past each other, which no order can help: what an order does is
    # what exceeds, pixel by pixel, the least of those that are compared (StopThePop's measure).
    least = np.minimum(found["by view depth"], found["slab"])
    excess = {how: float((e - least).mean()) for how, e in found.items()}
    assert excess["slab"] < excess["by view depth"] / 3, excess
    # The whole error is hardly that of reordering: an order that never changes has nearly all of it.
    whole = {how: float(e.mean()) for how, e in found.items()}
    assert whole["slab"] < 0.8 * whole["never reordered"], whole
    assert whole["never reordered"] > 0.98 * whole["by view depth"], whole


def test_c4_frames_follow_each_other_without_a_step():
    # A dolly through the circles: leaves fade, the camera comes nearer, and no frame differs much more than the last one.
    pictures = []
    for t in np.linspace(0, 1, 24):
        camera = pa.Camera.look_at((0.0, -46 + 24 * t, 4.0), (0, 0, 7), WIDTH, HEIGHT, fov=34)
        pictures.append(replace(SCENE, circles=(20.0, 46.0)).paint(camera, order="slab"))
    steps = np.array([np.abs(b - a).mean() for a, b in pairwise(pictures)])
    assert (steps > 0).all()
    assert (steps[1:] / steps[:-1]).max() < 1.25, steps

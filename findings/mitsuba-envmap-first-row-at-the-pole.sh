#!/bin/sh
# Mitsuba's environment map puts its first row on the zenith, but its first column half a pixel from the seam
# Library: Mitsuba 3.9.1, emitter envmap, bilinear
# Guess: a latlong picture is sampled at pixel centres in both directions: row i lies at (i + 0.5) / H of the
#   way from zenith to nadir.
# Seen: columns are so, at (j + 0.5) / W; rows lie at i / (H - 1): row 0 is the zenith itself and the picture is
#   stretched by H / (H - 1).
# For pictures: a sun near the zenith sits half a pixel off, and a map of few rows differs from the same map in
#   another program. Use many rows.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'mitsuba==3.9.1'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
from math import cos, pi, sin
import mitsuba as mi, numpy as np

print("mitsuba", version("mitsuba"))
mi.set_variant("scalar_rgb")
H, W = 8, 16
ramp = np.zeros((H, W, 3), "f4")
ramp[..., 0] = np.arange(W)
ramp[..., 1] = np.arange(H)[:, None]
scene = mi.load_dict({"type": "scene", "e": {"type": "envmap", "bitmap": mi.Bitmap(ramp)}})
def at(u, v):  # the documented up is +Y
    d = [sin(2 * pi * u) * sin(pi * v), cos(pi * v), -cos(2 * pi * u) * sin(pi * v)]
    si = scene.ray_intersect(mi.Ray3f([0, 0, 0], d))
    return np.array(scene.environment().eval(si))[:2]

for j in (1, 4, 9):
    for i in (0, 2, 5, 7):
        column, row = at((j + 0.5) / W, (i + 0.5) / H)
        print("centre of row", i, "column", j, "-> row %.3f column %.3f" % (row, column))
        assert abs(column - j) < 1e-3
        assert abs(row - (i + 0.5) / H * (H - 1)) < 1e-3
EOF

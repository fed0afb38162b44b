#!/bin/sh
# meshio reads the vertex colours of an OBJ file as coordinates 4 to 6
# Library: meshio 5.3.5; trimesh 5.2.0 for comparison
# Guess: "v x y z r g b" gives points of shape (n, 3), and the colours as point_data or dropped.
# Seen: points has the shape (n, 6) and point_data is empty; trimesh reads the same lines as colours.
# For pictures: slice points[:, :3] after reading an OBJ by meshio; the rest are the colours.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'meshio==5.3.5' 'trimesh==5.2.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import meshio, numpy as np, trimesh

print("meshio", v("meshio"), "trimesh", v("trimesh"))
with open("a.obj", "w") as f:
    f.write("v 0 0 0 0.5 0.25 1\nv 1 0 0 1 1 1\nv 0 1 0 0 0 0\nf 1 2 3\n")
a = meshio.read("a.obj")
b = trimesh.load("a.obj", process=False)
print("meshio", a.points.shape, a.point_data, "trimesh", b.vertices.shape, b.visual.vertex_colors[0])
assert a.points.shape == (3, 6) and not a.point_data and a.points[0].tolist() == [0, 0, 0, 0.5, 0.25, 1]
assert b.vertices.shape == (3, 3) and b.visual.vertex_colors[0].tolist() == [128, 64, 255, 255]
EOF

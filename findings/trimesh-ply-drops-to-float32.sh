#!/bin/sh
# trimesh reads double PLY vertices and writes them back as float, while its OBJ keeps them
# Library: trimesh 5.2.0
# Guess: vertices are float64 in trimesh and PLY has double, so reading and writing a PLY file keeps them.
# Seen: property float: 4500000.123 m comes back as 4500000.0. The OBJ text of the same points keeps 8 decimals.
# For pictures: a terrain in Earth-centred or map metres moves by up to a quarter of a metre. Subtract an origin
#   before exporting.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'trimesh==5.2.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import io
import numpy as np, trimesh

print("trimesh", version("trimesh"))
ply = b"""ply
format ascii 1.0
element vertex 3
property double x
property double y
property double z
element face 1
property list uchar int vertex_indices
end_header
4500000.123 0 0
4500001.123 0 0
4500000.123 1 0
3 0 1 2
"""
load = lambda data, kind: trimesh.load(io.BytesIO(data), file_type=kind, process=False)
mesh = load(ply, "ply")
again = load(mesh.export(file_type="ply"), "ply")
text = load(mesh.export(file_type="obj").encode(), "obj")
for name, m in (("read", mesh), ("through PLY", again), ("through OBJ", text)):
    print(name, m.vertices[0])
assert abs(mesh.vertices[0, 0] - 4500000.123) < 1e-6 and abs(text.vertices[:, 0].min() - 4500000.123) < 1e-6
assert again.vertices[0, 0] == np.float32(4500000.123) == 4500000.0
assert b"property float x" in mesh.export(file_type="ply")
EOF

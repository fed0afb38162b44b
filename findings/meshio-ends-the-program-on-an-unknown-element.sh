#!/bin/sh
# meshio.read of a PLY file with one more element raises SystemExit
# Library: meshio 5.3.5; plyfile 1.1.5 reads the same file
# Guess: elements it does not know are skipped, as PLY intends; or an exception of its own (meshio.ReadError) is
#   raised.
# Seen: SystemExit(1), which `except Exception` does not catch: a batch that skips bad files ends at the first
#   one.
# For pictures: point clouds with a camera or a material element need plyfile or trimesh, or `except
#   SystemExit`.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'meshio==5.3.5' 'plyfile==1.1.5'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import meshio
from plyfile import PlyData

print("meshio", v("meshio"), "plyfile", v("plyfile"))
with open("a.ply", "w") as f:
    f.write("""ply
format ascii 1.0
element vertex 1
property float x
property float y
property float z
element camera 1
property float fov
end_header
0 0 0
60
""")
print([e.name for e in PlyData.read("a.ply").elements])
try:
    meshio.read("a.ply")
except Exception as e:
    raise SystemExit("an ordinary exception: %r" % e)
except SystemExit as e:
    print("SystemExit", e.code)
    assert e.code == 1
else:
    raise SystemExit("it was read")
EOF

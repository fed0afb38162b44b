#!/bin/sh
# trimesh keeps the low byte of 16-bit vertex colours in a GLB file
# Library: trimesh 5.2.0; the valid file is made by pygltflib 1.16.5
# Guess: COLOR_0 as normalized unsigned short, which glTF allows, is divided by 65535 (or rounded to 8 bits).
# Seen: 32768 (0.5) becomes 0 of 255, 257 (0.004) becomes 1, 511 (0.008) becomes 255. Float and 8-bit COLOR_0
#   are read right; the same cut happens to a uint16 array given to Trimesh.
# For pictures: clouds and hills with 16-bit colours come out as noise. Write float or 8-bit colours for readers
#   that use trimesh.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'trimesh==5.2.0' 'pygltflib==1.16.5'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import numpy as np, pygltflib as g, trimesh

print("trimesh", v("trimesh"), "pygltflib", v("pygltflib"))
def read_back(colours, component_type, normalized):
    position = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "f4").tobytes()
    blob = position + colours.tobytes()
    primitive = g.Primitive(attributes=g.Attributes(POSITION=0, COLOR_0=1))
    file = g.GLTF2(
        scene=0, scenes=[g.Scene(nodes=[0])], nodes=[g.Node(mesh=0)], meshes=[g.Mesh(primitives=[primitive])],
        accessors=[
            g.Accessor(bufferView=0, componentType=g.FLOAT, count=3, type="VEC3", min=[0, 0, 0], max=[1, 1, 0]),
            g.Accessor(bufferView=1, componentType=component_type, count=3, type="VEC4", normalized=normalized),
        ],
        bufferViews=[g.BufferView(buffer=0, byteLength=36), g.BufferView(buffer=0, byteOffset=36, byteLength=len(blob) - 36)],
        buffers=[g.Buffer(byteLength=len(blob))],
    )
    file.set_binary_blob(blob)
    file.save("a.glb")
    (mesh,) = trimesh.load("a.glb").geometry.values()
    return np.asarray(mesh.visual.vertex_colors)[0].tolist()

short = np.tile(np.array([32768, 257, 511, 65535], "u2"), (3, 1))
seen = {
    "short": read_back(short, g.UNSIGNED_SHORT, True),
    "float": read_back((short / 65535).astype("f4"), g.FLOAT, False),
    "byte": read_back(np.round(short / 257).astype("u1"), g.UNSIGNED_BYTE, True),
}
print(seen)
assert seen["short"] == [0, 1, 255, 255]
assert seen["float"] == seen["byte"] == [128, 1, 2, 255]
EOF

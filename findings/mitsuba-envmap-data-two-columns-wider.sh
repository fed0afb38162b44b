#!/bin/sh
# The pixels of a Mitsuba environment map are two columns wider than the picture
# Library: Mitsuba 3.9.1, emitter envmap
# Guess: traverse(scene)["e.data"] has the shape of the picture that was loaded.
# Seen: a picture of 4 x 8 is held as 4 x 10; the first and the last column repeat the other end of the picture.
# For pictures: writing a sky of the picture's own shape into the parameter, or comparing gradients with the
#   picture, is off by one column.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'mitsuba==3.9.1'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import mitsuba as mi, numpy as np

print("mitsuba", version("mitsuba"))
mi.set_variant("scalar_rgb")
picture = np.repeat(np.arange(1, 9, dtype="f4")[None, :, None], 4, 0).repeat(3, 2)
scene = mi.load_dict({"type": "scene", "e": {"type": "envmap", "bitmap": mi.Bitmap(picture)}})
data = np.array(mi.traverse(scene)["e.data"])
print(picture.shape, "->", data.shape, data[0, :, 0])
assert data.shape == (4, 10, 3)
assert data[0, :, 0].tolist() == [8, 1, 2, 3, 4, 5, 6, 7, 8, 1]
EOF

#!/bin/sh
# An (h, w, 3) array given to OpenEXR as "XYZ" is stored as XYZ.R, XYZ.G, XYZ.B
# Library: OpenEXR 3.5.3 (Python module); OpenImageIO 3.2.2.0 reads the names
# Guess: since "RGB" is split into R, G and B, "XYZ" is split into X, Y and Z.
# Seen: only RGB and RGBA are split by letters. Any other name becomes a layer whose channels are called R, G,
#   B.
# For pictures: give tristimulus values, normals and motion as separate contiguous channels, or other programs
#   take them for colours.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'OpenEXR==3.5.3' 'OpenImageIO==3.2.2.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import numpy as np, OpenEXR, OpenImageIO as oiio

print("OpenEXR", version("OpenEXR"), "OpenImageIO", version("OpenImageIO"))
seen = {}
for name in ("RGB", "XYZ"):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {name: np.zeros((2, 2, 3), "f4")}).write("a.exr")
    seen[name] = list(oiio.ImageBuf("a.exr").spec().channelnames)
print(seen)
assert seen["RGB"] == ["R", "G", "B"]
assert seen["XYZ"] == ["XYZ.R", "XYZ.G", "XYZ.B"]
EOF

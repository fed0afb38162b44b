#!/bin/sh
# A 16-bit integer picture written to EXR by OpenImageIO loses its low bits
# Library: OpenImageIO 3.2.2.0
# Guess: EXR has no 16-bit integers but has uint32 and float, which hold them; one of those is taken, or the
#   write is refused.
# Seen: write() answers True and stores half floats of value / 65535: 2049 comes back as 2050, and 5 bits of a
#   bright pixel are gone.
# For pictures: convert a 16-bit photograph of the sky to float32 before writing EXR.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'OpenImageIO==3.2.2.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import numpy as np, OpenImageIO as oiio

print("OpenImageIO", version("OpenImageIO"))
a = np.array([0, 1, 2049, 60001, 65535], "u2").reshape(1, -1, 1)
assert oiio.ImageBuf(a).write("a.exr")
back = oiio.ImageBuf("a.exr")
got = back.get_pixels(oiio.UINT16).ravel()
print(back.spec().format, "written", a.ravel(), "read", got)
assert str(back.spec().format) == "half"
assert got[2] == 2050 and got[3] != 60001 and got[4] == 65535
EOF

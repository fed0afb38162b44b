#!/bin/sh
# The same EXR file with ACES primaries: Mitsuba converts it to Rec. 709 on reading, OpenImageIO does not
# Library: Mitsuba 3.9.1, OpenImageIO 3.2.2.0; the file is written by OpenEXR 3.5.3
# Guess: a reader returns the stored numbers and leaves the chromaticities attribute to the caller.
# Seen: OpenImageIO does so. Mitsuba applies a matrix: a saturated AP0 green becomes negative red and blue.
# For pictures: in Mitsuba do not convert a second time. In OpenImageIO the primaries are still yours to handle.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'OpenEXR==3.5.3' 'OpenImageIO==3.2.2.0' 'mitsuba==3.9.1'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import mitsuba as mi, numpy as np, OpenEXR, OpenImageIO as oiio

print("mitsuba", v("mitsuba"), "OpenImageIO", v("OpenImageIO"), "OpenEXR", v("OpenEXR"))
mi.set_variant("scalar_rgb")
green = np.zeros((2, 2, 3), "f4")
green[..., 1] = 1
ap0 = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "chromaticities": ap0}
OpenEXR.File(header, {"RGB": green}).write("ap0.exr")
a = np.array(mi.Bitmap("ap0.exr"))[0, 0]
b = oiio.ImageBuf("ap0.exr").get_pixels(oiio.FLOAT)[0, 0]
print("stored [0 1 0], Mitsuba", a, "OpenImageIO", b)
assert b.tolist() == [0, 1, 0]
assert a[0] < -0.9 and a[1] > 1.3 and a[2] < 0
EOF

#!/bin/sh
# A count of 1000 in a uint channel of an EXR file is 2.3e-7 when OpenImageIO reads it as float
# Library: OpenImageIO 3.2.2.0; Mitsuba 3.9.1 and OpenEXR 3.5.3 return 1000
# Guess: uint channels of EXR hold identifiers and counts, so asking for float converts the number.
# Seen: get_pixels(FLOAT) divides by 4294967295, as for an 8-bit colour.
# For pictures: masks, object ids and sample counts beside a sky must be read as UINT32.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'OpenEXR==3.5.3' 'OpenImageIO==3.2.2.0' 'mitsuba==3.9.1'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import mitsuba as mi, numpy as np, OpenEXR, OpenImageIO as oiio

print("OpenImageIO", v("OpenImageIO"), "mitsuba", v("mitsuba"), "OpenEXR", v("OpenEXR"))
mi.set_variant("scalar_rgb")
header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
OpenEXR.File(header, {"Y": np.full((2, 2), 1000, "u4")}).write("a.exr")
a = oiio.ImageBuf("a.exr")
got = float(a.get_pixels(oiio.FLOAT).ravel()[0])
print("OpenImageIO float", got, "uint", a.get_pixels(oiio.UINT32).ravel()[0], "Mitsuba", np.array(mi.Bitmap("a.exr")).ravel()[0])
assert np.isclose(got, 1000 / (2**32 - 1))
assert a.get_pixels(oiio.UINT32).ravel()[0] == 1000 and np.array(mi.Bitmap("a.exr")).ravel()[0] == 1000
EOF

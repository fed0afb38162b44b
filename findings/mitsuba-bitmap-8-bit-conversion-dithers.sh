#!/bin/sh
# A uniform grey converted to 8 bits by Mitsuba has two values
# Library: Mitsuba 3.9.1, Bitmap.convert
# Guess: converting float to uint8 rounds, so a uniform picture stays uniform.
# Seen: linear 0.5 (sRGB 187.5 of 255) becomes a pattern of 187 and 188: the conversion dithers, and no argument
#   of convert turns it off.
# For pictures: good against bands in a sky, bad for exact comparison of pictures. For tests convert by numpy.
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
grey = mi.Bitmap(np.full((64, 64, 3), 0.5, "f4"))
a = np.array(grey.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True))
values, counts = np.unique(a, return_counts=True)
print(dict(zip(values.tolist(), counts.tolist())))
assert values.tolist() == [187, 188] and counts.min() > 0.2 * a.size
EOF

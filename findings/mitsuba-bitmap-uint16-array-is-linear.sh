#!/bin/sh
# The same grey as an 8-bit and a 16-bit array is 0.216 and 0.502 in Mitsuba
# Library: Mitsuba 3.9.1, class Bitmap; OpenCV 5.0.0.93 writes the PNG
# Guess: both integer arrays are taken as sRGB-coded pictures, as both PNG files are.
# Seen: a uint8 array has srgb_gamma on, a uint16 array has it off; the same uint16 pixels from a PNG file have
#   it on.
# For pictures: a 16-bit photograph given as an array is 2.3 times too bright in the mid-tones. Call
#   bitmap.set_srgb_gamma(True).
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'mitsuba==3.9.1' 'opencv-contrib-python-headless==5.0.0.93'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import cv2, mitsuba as mi, numpy as np

print("mitsuba", version("mitsuba"))
mi.set_variant("scalar_rgb")
def linear(bitmap):
    return float(np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))[0, 0, 0])

a8, a16 = np.full((2, 2, 3), 128, "u1"), np.full((2, 2, 3), 128 * 257, "u2")
cv2.imwrite("a.png", a16)
seen = {"uint8 array": linear(mi.Bitmap(a8)), "uint16 array": linear(mi.Bitmap(a16)), "uint16 PNG": linear(mi.Bitmap("a.png"))}
print(seen)
assert np.allclose(list(seen.values()), [0.21586, 0.50196, 0.21586], atol=1e-4)
fixed = mi.Bitmap(a16)
fixed.set_srgb_gamma(True)
assert abs(linear(fixed) - 0.21586) < 1e-4
EOF

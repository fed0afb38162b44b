#!/bin/sh
# A Radiance picture that says XYZE: one reader says XYZ, one says RGB, one refuses
# Library: Mitsuba 3.9.1, PyAV 18.1.0, OpenCV 5.0.0.93
# Guess: FORMAT=32-bit_rle_xyze is converted to RGB by whoever reads it, or refused.
# Seen: nobody converts. PyAV returns X, Y, Z under the name gbrpf32le (planes of green, blue, red); Mitsuba
#   returns the same numbers but calls the pixels XYZ; OpenCV returns None.
# For pictures: through PyAV a white sky (X 0.95, Y 1, Z 1.09) comes out bluish. Look at the FORMAT line first.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'mitsuba==3.9.1' 'av==18.1.0' 'opencv-contrib-python-headless==5.0.0.93'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import av, cv2, mitsuba as mi, numpy as np

print("mitsuba", v("mitsuba"), "av", v("av"), "OpenCV", v("opencv-contrib-python-headless"))
mi.set_variant("scalar_rgb")
pixel = [122, 128, 139, 129]  # X 0.953, Y 1, Z 1.086: white
for kind in ("rgbe", "xyze"):
    with open(kind + ".hdr", "wb") as f:
        f.write(b"#?RADIANCE\nFORMAT=32-bit_rle_%s\n\n-Y 1 +X 1\n" % kind.encode() + bytes(pixel))
bitmap = mi.Bitmap("xyze.hdr")
a = np.array(bitmap).ravel()
b = next(av.open("xyze.hdr").decode(video=0)).to_ndarray().ravel()
frame = next(av.open("xyze.hdr").decode(video=0))
print("Mitsuba", bitmap.pixel_format(), a, "PyAV", frame.format.name, b, "stored XYZ", np.array(pixel[:3]) / 128)
assert np.allclose(a, np.array(pixel[:3]) / 128) and np.allclose(b, a)
assert bitmap.pixel_format() == mi.Bitmap.PixelFormat.XYZ and frame.format.name == "gbrpf32le"
assert cv2.imread("rgbe.hdr", -1) is not None and cv2.imread("xyze.hdr", -1) is None
EOF

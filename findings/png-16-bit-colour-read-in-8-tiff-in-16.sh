#!/bin/sh
# The same 16-bit colour picture is read by imageio in 16 bits from TIFF and in 8 bits from PNG
# Library: imageio 2.38.1 (Pillow 13.0.0 for PNG, tifffile 2026.3.3 for TIFF)
# Guess: the dtype follows the file's bit depth; one function gives the same array for both files; a lossy read
#   warns.
# Seen: the PNG arrives as uint8 with the low byte cut off (not rounded), silently; a grey 16-bit PNG does
#   arrive as uint16.
# For pictures: 65535 levels of a twilight gradient become 256. Read 16-bit colour PNG by OpenCV
#   (IMREAD_UNCHANGED), OpenImageIO or Mitsuba.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'imageio==2.38.1' 'Pillow==13.0.0' 'tifffile==2026.3.3' 'opencv-contrib-python-headless==5.0.0.93'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
import warnings
from importlib.metadata import version as v
import cv2, imageio.v3 as iio, numpy as np, tifffile

warnings.simplefilter("error")
for p in ("imageio", "pillow", "tifffile"):
    print(p, v(p))
a = np.array([[[256, 511, 65535], [1, 2, 1000]]], "u2")
cv2.imwrite("a.png", a[..., ::-1])
cv2.imwrite("grey.png", a[..., 0])
tifffile.imwrite("a.tif", a, photometric="rgb")
png, tif, grey = iio.imread("a.png"), iio.imread("a.tif"), iio.imread("grey.png")
print("PNG", png.dtype, png.tolist(), "TIFF", tif.dtype, tif.tolist(), "grey PNG", grey.dtype)
assert tif.dtype == np.uint16 and (tif == a).all()
assert png.dtype == np.uint8 and (png == a >> 8).all()
assert grey.dtype == np.uint16 and (cv2.imread("a.png", cv2.IMREAD_UNCHANGED)[..., ::-1] == a).all()
EOF

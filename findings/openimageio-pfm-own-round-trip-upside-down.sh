#!/bin/sh
# OpenImageIO turns its own PFM file upside down on reading
# Library: OpenImageIO 3.2.2.0; OpenCV 5.0.0.93 as the witness
# Guess: what it writes it reads back the same way up.
# Seen: it writes the bottom row first, as PFM wants, and OpenCV reads that the right way up; its own reader
#   then returns the bottom row as row 0.
# For pictures: an environment map that went through OpenImageIO as PFM has the ground above the sky. Flip after
#   reading, or use EXR.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'opencv-contrib-python-headless==5.0.0.93' 'OpenImageIO==3.2.2.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import cv2, numpy as np, OpenImageIO as oiio

print("OpenImageIO", v("OpenImageIO"), "OpenCV", v("opencv-contrib-python-headless"))
picture = np.array([[10, 11], [20, 21], [30, 31]], "f4")[..., None]
assert oiio.ImageBuf(picture).write("a.pfm")
own = oiio.ImageBuf("a.pfm").get_pixels(oiio.FLOAT)[..., 0]
other = cv2.imread("a.pfm", cv2.IMREAD_UNCHANGED)
print("written", picture[:, 0, 0], "OpenCV", other[:, 0], "OpenImageIO", own[:, 0])
assert (other == picture[..., 0]).all()
assert (own == picture[::-1, :, 0]).all()
EOF

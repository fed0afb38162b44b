#!/bin/sh
# OpenCV's floating-point Lab and Luv stop at L* = 100, while its XYZ does not
# Library: OpenCV 5.0.0.93 cvtColor; scikit-image 0.26.0 for comparison
# Guess: float32 pictures are converted by the formula, whatever their range, as COLOR_RGB2XYZ does.
# Seen: RGB 4 gives Y 4 but L* 100, also from linear light (COLOR_LRGB2Lab), where the formula gives 168.1;
#   scikit-image's rgb2lab does not clip.
# For pictures: the sun, and any sky brighter than the white level, has one colour in OpenCV's Lab. Expose
#   first.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'opencv-contrib-python-headless==5.0.0.93' 'scikit-image==0.26.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import cv2, numpy as np
from skimage.color import rgb2lab

print("OpenCV", v("opencv-contrib-python-headless"), "scikit-image", v("scikit-image"))
bright = np.full((1, 1, 3), 4, "f4")
lightness = lambda code: float(cv2.cvtColor(bright, code)[0, 0, 0])
formula = 116 * 4 ** (1 / 3) - 16
seen = {n: lightness(getattr(cv2, "COLOR_" + n)) for n in ("RGB2Lab", "LRGB2Lab", "RGB2Luv", "LRGB2Luv")}
print(seen, "linear light by the formula", formula, "scikit-image, sRGB-coded", rgb2lab(bright)[0, 0, 0])
assert all(abs(s - 100) < 0.01 for s in seen.values())
assert abs(cv2.cvtColor(bright, cv2.COLOR_RGB2XYZ)[0, 0, 1] - 4) < 1e-3
assert rgb2lab(bright)[0, 0, 0] > 300
EOF

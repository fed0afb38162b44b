#!/bin/sh
# OpenCV's Drago and Reinhard tone mapping turn the darkest pixel into NaN where it is grey or black
# Library: OpenCV 5.0.0.93, createTonemapDrago and createTonemapReinhard with their defaults
# Guess: black stays black, and a uniform picture stays uniform; an operator that takes logarithms adds a small
#   number first.
# Seen: a grey ramp, from 0 or from 0.5, comes out with one NaN, its darkest pixel. A uniform picture is NaN all
#   over with Reinhard, not with Drago.
# For pictures: black borders and night give NaN, which turns into some number in 8 bits. Pass the result
#   through numpy.nan_to_num.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'opencv-contrib-python-headless==5.0.0.93'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import cv2, numpy as np

print("OpenCV", version("opencv-contrib-python-headless"))
def ramp(low, high):
    return np.linspace(low, high, 64, dtype="f4").reshape(8, 8, 1).repeat(3, 2)

for make in (cv2.createTonemapDrago, cv2.createTonemapReinhard):
    seen = [int(np.isnan(make().process(picture)).all(2).sum()) for picture in (ramp(0, 1), ramp(0.5, 1), ramp(0.5, 0.5))]
    print(make.__name__, "NaN pixels of 64 in a ramp from 0, from 0.5, and a uniform grey:", seen)
    assert seen[:2] == [1, 1] and seen[2] == (0 if "Drago" in make.__name__ else 64)
    assert np.isnan(make().process(ramp(0, 1))[0, 0]).all()
EOF

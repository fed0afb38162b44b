#!/bin/sh
# An 8-bit picture that became int64 is black in scikit-image's colour conversions
# Library: scikit-image 0.26.0, skimage.color
# Guess: values 0..255 in int64 (after a sum or np.array of Python numbers) convert as they do in uint8, or are
#   refused.
# Seen: integers are divided by the largest number of their type: rgb2lab gives L* 0 instead of 53.6, rgb2gray
#   1e-17; no warning. Hue and saturation survive, so rgb2hsv looks half right.
# For pictures: cast sums and differences of photographs to float / 255 by hand.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'scikit-image==0.26.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import numpy as np
from skimage import color

print("scikit-image", version("scikit-image"))
a = np.array([[[200, 100, 50]]])
assert a.dtype == np.int64
L8, L64 = (color.rgb2lab(x)[0, 0, 0] for x in (a.astype("u1"), a))
print("L*", L8, L64, "grey", color.rgb2gray(a), "hsv", color.rgb2hsv(a))
assert abs(L8 - 53.63) < 0.01 and L64 < 1e-6 and color.rgb2gray(a)[0, 0] < 1e-15
assert np.allclose(color.rgb2hsv(a)[0, 0, :2], [1 / 18, 0.75])
EOF

#!/bin/sh
# scikit-image goes to XYZ and Lab without clipping and clips on the way back
# Library: scikit-image 0.26.0, skimage.color
# Guess: xyz2rgb is the inverse of rgb2xyz, lab2rgb of rgb2lab, for any float picture.
# Seen: RGB 2 goes to XYZ and Lab far above white, as it should, and comes back as 1; negative (out of gamut)
#   colours come back as 0.
# For pictures: a change of hue or lightness made in Lab cuts every highlight of an HDR sky, in float64, without
#   a warning.
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
rgb = np.array([[[2.0, 2.0, 2.0], [0.5, 0.25, 0.75]]])
for there, back in (("rgb2xyz", "xyz2rgb"), ("rgb2lab", "lab2rgb")):
    middle = getattr(color, there)(rgb)
    end = getattr(color, back)(middle)
    print(there, middle[0, 0], back, end[0])
    assert np.allclose(end[0, 0], 1) and np.allclose(end[0, 1], rgb[0, 1], atol=1e-4)
    assert middle[0, 0, 1 if there == "rgb2xyz" else 0] > 4
green = color.xyz2rgb(np.array([[[0.1, 0.5, 0.1]]]))
print("a green outside sRGB:", green)
assert green.min() == 0
EOF

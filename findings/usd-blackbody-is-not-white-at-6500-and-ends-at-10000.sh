#!/bin/sh
# USD's colour temperature is not white at 6500 K and stops at 10000 K
# Library: usd-core 26.11, UsdLux.BlackbodyTemperatureAsRgb (what enableColorTemperature uses)
# Guess: 6500 K, the fallback, is (1, 1, 1), the white of its Rec. 709 primaries; hotter than 10000 K goes on
#   getting bluer.
# Seen: 6500 K is about (1.04, 0.98, 1.03), a light magenta, as a black body is not daylight; 10000 and 40000 K
#   give the same colour. All have luminance 1.
# For pictures: a clear blue sky (15000 K and more) cannot be had by colorTemperature; author the colour.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'usd-core==26.11'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
from pxr import UsdLux

print("usd-core", version("usd-core"))
rgb = {t: tuple(UsdLux.BlackbodyTemperatureAsRgb(t)) for t in (2856, 6500, 8000, 10000, 40000)}
for t, c in rgb.items():
    print(t, "K", ["%.4f" % x for x in c])
    assert abs(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2] - 1) < 1e-3
assert rgb[6500][0] > 1.03 and rgb[6500][1] < 0.99 and rgb[6500][2] > 1.03
assert rgb[10000] == rgb[40000] != rgb[8000]
EOF

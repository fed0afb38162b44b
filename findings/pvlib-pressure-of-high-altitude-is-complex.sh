#!/bin/sh
# pvlib's pressure at 50 km is a complex number, and at 20 km a fifth too low
# Library: pvlib 0.16.1, atmosphere.alt2pres
# Guess: the standard atmosphere with its layers (5475 Pa at 20 km, 76 Pa at 50 km), or NaN beyond its range.
# Seen: the formula of the lowest layer is used everywhere: 4328 Pa at 20 km, 7e-7 Pa at 44 km; a Python float
#   above 44.3 km gives a complex number, a numpy array NaN.
# For pictures: air mass and Rayleigh depth from a balloon or aircraft above 11 km need another source.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'pvlib==0.16.1'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import warnings
import numpy as np
from pvlib.atmosphere import alt2pres

warnings.simplefilter("ignore")
print("pvlib", version("pvlib"))
for h in (11000, 20000, 44000, 50000):
    print(h, "m:", alt2pres(h))
assert abs(alt2pres(11000) - 22632) < 10  # the standard atmosphere: 22632 Pa
assert 4300 < alt2pres(20000) < 4350 and alt2pres(44000) < 1e-5
assert isinstance(alt2pres(50000), complex) and np.isnan(alt2pres(np.array([50000.0]))[0])
EOF

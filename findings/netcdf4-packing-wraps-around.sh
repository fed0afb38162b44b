#!/bin/sh
# netCDF4 packs a value beyond the range into a small one
# Library: netCDF4 1.7.5.1.post1, a uint8 variable with scale_factor 0.01
# Guess: a value too big for the packed type is clipped to the largest, masked, or refused.
# Seen: 2.56 is stored as 256 mod 256 = 0 and 3.0 as 44 (0.44), without an error.
# For pictures: the brightest pixels of a packed sky turn black. Clip to the packed range first.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'netCDF4==1.7.5.1.post1'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import netCDF4, numpy as np

print("netCDF4", version("netCDF4"))
with netCDF4.Dataset("a.nc", "w") as d:
    d.createDimension("x", 3)
    p = d.createVariable("p", "u1", ("x",))
    p.scale_factor = 0.01
    p[:] = np.array([1.0, 2.56, 3.0])
with netCDF4.Dataset("a.nc") as d:
    seen = np.ma.getdata(d["p"][:])
print("written [1, 2.56, 3], read", seen)
assert np.allclose(seen, [1, 0, 0.44])
EOF

#!/bin/sh
# netCDF4 masks the saturated pixels of an integer picture that declares no fill value
# Library: netCDF4 1.7.5.1.post1; h5netcdf 1.8.2 reads the same file
# Guess: without _FillValue, missing_value or valid_range every number is data; the byte type at least has no
#   default fill.
# Seen: 255 of a uint8 and 65535 of a uint16 come back masked (the library's default fill values); h5netcdf
#   returns them.
# For pictures: the sun's disc in a camera's counts vanishes from means and maxima. Call set_auto_mask(False),
#   or declare another _FillValue.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'netCDF4==1.7.5.1.post1' 'h5netcdf==1.8.2' 'h5py==3.16.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
import subprocess, sys
from importlib.metadata import version as v
import netCDF4, numpy as np

print("netCDF4", v("netCDF4"), "h5netcdf", v("h5netcdf"))
with netCDF4.Dataset("a.nc", "w") as d:
    d.createDimension("x", 3)
    for kind in ("u1", "u2"):
        d.createVariable(kind, kind, ("x",))[:] = np.array([0, 1, np.iinfo(kind).max], kind)
    assert not [n for k in ("u1", "u2") for n in d[k].ncattrs()]
with netCDF4.Dataset("a.nc") as d:
    for kind in ("u1", "u2"):
        a = d[kind][:]
        print("netCDF4", a)
        assert np.ma.getmaskarray(a).tolist() == [False, False, True] and a.max() == 1
    d.set_auto_mask(False)
    assert d["u1"][:].tolist() == [0, 1, 255]
other = "import h5netcdf; f = h5netcdf.File('a.nc', 'r'); print(f['u1'][:].tolist(), f['u2'][:].tolist())"
out = subprocess.run([sys.executable, "-c", other], check=True, capture_output=True, text=True).stdout.strip()
print("h5netcdf", out)
assert out == "[0, 1, 255] [0, 1, 65535]"
EOF

#!/bin/sh
# The part of a NetCDF variable nobody wrote is missing if netCDF4 made the file and 0 if h5netcdf did
# Library: h5netcdf 1.8.2, netCDF4 1.7.5.1.post1
# Guess: the default fill value belongs to the format, so both libraries leave 9.97e36 (masked on reading) in
#   the hole.
# Seen: in h5netcdf's file both libraries read 0 there, a valid value; in netCDF4's file netCDF4 masks it and
#   h5netcdf shows 9.97e36.
# For pictures: a tile that failed is black sky in one file and a hole in the other. Pass fillvalue to
#   h5netcdf's create_variable.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'netCDF4==1.7.5.1.post1' 'h5netcdf==1.8.2' 'h5py==3.16.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
import subprocess, sys
from importlib.metadata import version as v

print("netCDF4", v("netCDF4"), "h5netcdf", v("h5netcdf"))
def run(code):  # one process for each library
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.strip()

run("""
import h5netcdf
with h5netcdf.File("h.nc", "w") as f:
    f.dimensions = {"x": 3}
    f.create_variable("a", ("x",), "f4")[:2] = [1, 2]
""")
run("""
import netCDF4
with netCDF4.Dataset("n.nc", "w") as d:
    d.createDimension("x", 3)
    d.createVariable("a", "f4", ("x",))[:2] = [1, 2]
""")
seen = {}
for name in ("h.nc", "n.nc"):
    seen[name, "netCDF4"] = run("import netCDF4; print(netCDF4.Dataset('%s')['a'][:])" % name)
    seen[name, "h5netcdf"] = run("import h5netcdf; f = h5netcdf.File('%s', 'r'); print(f['a'][:].tolist())" % name)
for k, s in seen.items():
    print(k, s)
assert seen["h.nc", "netCDF4"] == "[1. 2. 0.]" and seen["h.nc", "h5netcdf"] == "[1.0, 2.0, 0.0]"
assert seen["n.nc", "netCDF4"] == "[1.0 2.0 --]" and "e+36" in seen["n.nc", "h5netcdf"]
EOF

#!/bin/sh
# Below the horizon ephem lifts the sun by nearly 90', skyfield jumps by 39' at -1 degree, pvlib stops at the rim
# Library: ephem 4.2.1, skyfield 1.55, pvlib 0.16.1
# Guess: all three follow the same curve to about half a degree below the horizon and then let it fade to zero.
# Seen: ephem goes on growing to 87' at a true -3.8 degrees and is gone at -12; skyfield's is 39' at -0.99 and 0
#   at -1.01; pvlib has none at -1.85 where ephem has 51'.
# For pictures: in twilight compute the true altitude (pressure 0); a film across sunset jumps by more than the
#   sun's diameter.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'ephem==4.2.1' 'skyfield==1.55' 'pvlib==0.16.1' 'pandas==3.1.1'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
from math import degrees
import ephem, pandas as pd
from pvlib.solarposition import get_solarposition
from skyfield.earthlib import refract

print("ephem", v("ephem"), "skyfield", v("skyfield"), "pvlib", v("pvlib"))
def by_ephem(time, pressure):
    o = ephem.Observer()
    o.lat, o.lon, o.pressure, o.temp, o.date = "0", "0", pressure, 10, time
    return degrees(ephem.Sun(o).alt)

lift = {}
for clock in ("05:20", "05:48", "05:52", "06:00"):
    time = "2024/3/20 " + clock
    true = by_ephem(time, 0)
    lift[clock] = (by_ephem(time, 1010) - true) * 60
    print("ephem: true %.2f, lifted by %.1f'" % (true, lift[clock]))
assert lift["05:20"] < 0.1 and 80 < lift["05:52"] < 92 and 45 < lift["06:00"] < 56
jump = {a: (refract(a, 10, 1010) - a) * 60 for a in (-0.99, -1.01)}
print("skyfield", jump)
assert jump[-0.99] > 38 and jump[-1.01] == 0
p = get_solarposition(pd.DatetimeIndex(["2024-03-20 06:00"], tz="UTC"), 0, 0).iloc[0]
print("pvlib true %.3f apparent %.3f" % (p["elevation"], p["apparent_elevation"]))
assert p["elevation"] == p["apparent_elevation"] and p["elevation"] < -1.8
EOF

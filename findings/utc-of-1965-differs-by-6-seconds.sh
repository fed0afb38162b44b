#!/bin/sh
# The same UTC date of 1965 is two instants, 6 seconds apart, in skyfield and astropy
# Library: skyfield 1.55, astropy 8.0.2
# Guess: both give the same Terrestrial Time for a UTC date after 1960, when UTC began.
# Seen: 8.3 s apart in 1961, 6.0 s in 1965, 0 in 1980. astropy has the drifting UTC of 1960-1971; skyfield goes
#   on with the 10 s of 1972.
# For pictures: old photographs of eclipses and the moon: 6 s move the moon's shadow by several kilometres. Give
#   TT where it matters.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'astropy==8.0.2' 'skyfield==1.55'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
from astropy.time import Time
from skyfield.api import load

print("skyfield", v("skyfield"), "astropy", v("astropy"))
scale = load.timescale(builtin=True)
seen = {}
for year in (1961, 1965, 1971, 1980):
    a, b = scale.utc(year, 7, 1), Time("%d-07-01" % year, scale="utc").tt
    seen[year] = float((a.whole - b.jd1) + (a.tt_fraction - b.jd2)) * 86400
print(seen)
assert abs(seen[1961] - 8.34) < 0.05 and abs(seen[1965] - 6.03) < 0.05 and abs(seen[1971] - 0.58) < 0.05
assert abs(seen[1980]) < 1e-3
EOF

#!/bin/sh
# At the same surface pressure a cold atmosphere scatters a quarter less in colour-science
# Library: colour-science 0.4.7, colour.phenomena.rayleigh_optical_depth
# Guess: the optical depth of the whole column follows from the surface pressure (the mass of air), so the
#   temperature argument has next to no effect.
# Seen: at 550 nm and 1013.25 hPa it is 0.0731 at 250 K, 0.0972 at the default 288.15 K and 0.1053 at 300 K: T
#   squared, as the density changes and the refractive index does not.
# For pictures: leave the temperature at its default and scale by pressure, or blue skies change brightness with
#   the weather.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'colour-science==0.4.7'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
import warnings
from importlib.metadata import version
import numpy as np

warnings.simplefilter("ignore")  # matplotlib is not needed
from colour.phenomena import rayleigh_optical_depth

print("colour-science", version("colour-science"))
T = np.array([250, 288.15, 300])
tau = np.array([float(rayleigh_optical_depth(550e-7, temperature=t)) for t in T])
print(dict(zip(T.tolist(), tau.tolist())))
assert np.allclose(tau / tau[1], (T / T[1]) ** 2, rtol=1e-6)
half = float(rayleigh_optical_depth(550e-7, pressure=101325 / 2))
assert np.isclose(half, tau[1] / 2)
EOF

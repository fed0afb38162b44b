#!/bin/sh
# The PQ signal of a slightly negative luminance is above 100 in colour-science
# Library: colour-science 0.4.7, eotf_inverse_ST2084; the sRGB curve of the same package for comparison
# Guess: below 0 the curve gives 0, a small negative number, or NaN.
# Seen: -1 cd/m2 gives 106.7 where the whole signal range is 0..1; the sRGB curve continues as a straight line
#   (-0.5 gives -6.46).
# For pictures: negative components are usual after a change of primaries. One of them becomes a white spot in
#   an HDR video. Clip at 0 first.
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
from colour.models import eotf_inverse_sRGB, eotf_inverse_ST2084

print("colour-science", version("colour-science"))
seen = {L: float(eotf_inverse_ST2084(L)) for L in (-1.0, 0.0, 1.0, 10000.0)}
print(seen, "sRGB of -0.5:", float(eotf_inverse_sRGB(-0.5)))
assert seen[-1.0] > 100 and seen[0.0] < 1e-5 and abs(seen[10000.0] - 1) < 1e-9
assert np.isclose(eotf_inverse_sRGB(-0.5), -6.46)
EOF

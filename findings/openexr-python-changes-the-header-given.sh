#!/bin/sh
# A header dict can be used for one OpenEXR picture only
# Library: OpenEXR 3.5.3 (Python module, class File)
# Guess: the header passed to File is read, so one dict serves for a whole series of pictures.
# Seen: writing puts dataWindow, displayWindow and more into the caller's dict; the next picture of another size
#   is refused with a ValueError about a window nobody set.
# For pictures: pass dict(header) for each picture.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'OpenEXR==3.5.3'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import numpy as np, OpenEXR

print("OpenEXR", version("OpenEXR"))
header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
before = set(header)
OpenEXR.File(header, {"RGB": np.zeros((2, 4, 3), "f4")}).write("a.exr")
print("added to our dict:", sorted(set(header) - before))
assert "dataWindow" in header
try:
    OpenEXR.File(header, {"RGB": np.zeros((3, 3, 3), "f4")}).write("b.exr")
except ValueError as e:
    print("ValueError:", e)
else:
    raise SystemExit("the second picture was written")
EOF

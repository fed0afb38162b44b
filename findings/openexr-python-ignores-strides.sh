#!/bin/sh
# The OpenEXR module writes a transposed view in the order of its memory
# Library: OpenEXR 3.5.3 (Python module, class File)
# Guess: a numpy view is written as numpy shows it, or refused for not being contiguous.
# Seen: a transposed square picture is written untransposed, without a word; img[..., 0] as a channel writes R,
#   G, B, R ... of the first pixels.
# For pictures: np.ascontiguousarray before each OpenEXR.File; the usual {"R": img[..., 0], "G": img[..., 1]} is
#   scrambled.
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
def write_and_read(pixels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Y": pixels}).write("a.exr")
    return OpenEXR.File("a.exr").channels()["Y"].pixels

square = np.arange(4, dtype="f4").reshape(2, 2)
got = write_and_read(square.T)
print("shown", square.T.tolist(), "written", got.tolist())
assert (got == square).all() and not (got == square.T).all()
img = np.arange(12, dtype="f4").reshape(2, 2, 3)
got = write_and_read(img[..., 0])
print("shown", img[..., 0].tolist(), "written", got.tolist())
assert got.tolist() == [[0, 1], [2, 3]]
assert (write_and_read(np.ascontiguousarray(img[..., 0])) == img[..., 0]).all()
EOF

#!/bin/sh
# Installing PyAV changes what imageio reads from a grey PFM file: float32 becomes 8 bits, clipped, with a frame axis
# Library: imageio 2.38.1 with Pillow 13.0.0, without and with PyAV 18.1.0
# Guess: another plugin adds formats; a file that could be read before stays the same array. A float format
#   stays float.
# Seen: float32 (2, 2) [0 0.5 3 1000] before; uint8 (1, 2, 2, 3) with everything from 1 up at 255 after `pip
#   install av`. A .hdr, unreadable before, is also read so.
# For pictures: never read radiance by a bare imageio.imread; name the plugin or use the format's own library.
#   Check the dtype.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'imageio==2.38.1' 'Pillow==13.0.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
import subprocess, sys
import numpy as np

with open("grey.pfm", "wb") as f:
    f.write(b"Pf\n2 2\n-1.0\n" + np.array([[3, 1000], [0, 0.5]], "<f4").tobytes())
with open("sun.hdr", "wb") as f:  # one row: 1.0 and 512.0
    f.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes([128, 128, 128, 129, 128, 128, 128, 138]))
read = """
import imageio.v3 as iio
from importlib.metadata import version
print("imageio", version("imageio"))
for name in ("grey.pfm", "sun.hdr"):
    try:
        a = iio.imread(name)
        print(name, a.dtype, a.shape, a.ravel().tolist())
    except OSError as e:
        print(name, "OSError")
"""
def run():
    out = subprocess.run([sys.executable, "-c", read], check=True, capture_output=True, text=True).stdout
    print(out)
    return out.splitlines()[1:]

before = run()
subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "av==18.1.0"], check=True)
after = run()
assert before == ["grey.pfm float32 (2, 2) [0.0, 0.5, 3.0, 1000.0]", "sun.hdr OSError"]
assert after[0].startswith("grey.pfm uint8 (1, 2, 2, 3) [0, 0, 0, 1") and after[0].endswith(" 255, 255, 255, 255, 255, 255]")
assert after[1] == "sun.hdr uint8 (1, 1, 2, 3) [255, 255, 255, 255, 255, 255]"
EOF

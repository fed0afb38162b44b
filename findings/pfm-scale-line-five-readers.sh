#!/bin/sh
# One PFM file, five readers, three answers, by what the size of the scale line means to each
# Library: OpenCV 5.0.0.93, PyAV 18.1.0, Mitsuba 3.9.1, OpenImageIO 3.2.2.0, Pillow 13.0.0
# Guess: only the sign of the scale line matters (byte order); if its size is used, all multiply by it.
# Seen: a pixel of 3 under the scale -2.0 is 6 in Mitsuba and OpenImageIO, 1.5 in OpenCV and PyAV (they divide)
#   and 3 in Pillow.
# For pictures: write -1.0 and nothing else. A sky stored with its exposure in the scale line is wrong by the
#   square of it between two of these.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'opencv-contrib-python-headless==5.0.0.93' 'mitsuba==3.9.1' 'OpenImageIO==3.2.2.0' 'Pillow==13.0.0' 'av==18.1.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import av, cv2, mitsuba as mi, numpy as np, OpenImageIO as oiio
from PIL import Image

for p in ("opencv-contrib-python-headless", "av", "mitsuba", "OpenImageIO", "pillow"):
    print(p, v(p))
mi.set_variant("scalar_rgb")
name = "grey.pfm"
with open(name, "wb") as f:
    f.write(b"Pf\n2 2\n-2.0\n" + np.full((2, 2), 3, "<f4").tobytes())
seen = {
    "OpenCV": cv2.imread(name, cv2.IMREAD_UNCHANGED),
    "PyAV": next(av.open(name).decode(video=0)).to_ndarray(),
    "Mitsuba": np.array(mi.Bitmap(name)),
    "OpenImageIO": oiio.ImageBuf(name).get_pixels(oiio.FLOAT),
    "Pillow": np.array(Image.open(name)),
}
seen = {k: float(a.ravel()[0]) for k, a in seen.items()}
print(seen)
assert seen == {"OpenCV": 1.5, "PyAV": 1.5, "Mitsuba": 6, "OpenImageIO": 6, "Pillow": 3}
EOF

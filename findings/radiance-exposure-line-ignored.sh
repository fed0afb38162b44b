#!/bin/sh
# Four readers of Radiance pictures, none of which uses the EXPOSURE line
# Library: Mitsuba 3.9.1, OpenCV 5.0.0.93, OpenImageIO 3.2.2.0, PyAV 18.1.0
# Guess: the line tells what the pixels have been multiplied by, so at least one reader divides by it.
# Seen: EXPOSURE=2 changes no pixel in any of the four, and only OpenImageIO keeps it, as the attribute
#   hdr:exposure.
# For pictures: an absolute radiance survives only if the caller divides by the line (several lines multiply).
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'mitsuba==3.9.1' 'opencv-contrib-python-headless==5.0.0.93' 'OpenImageIO==3.2.2.0' 'av==18.1.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version as v
import av, cv2, mitsuba as mi, numpy as np, OpenImageIO as oiio

for p in ("mitsuba", "opencv-contrib-python-headless", "OpenImageIO", "av"):
    print(p, v(p))
mi.set_variant("scalar_rgb")
for name, line in (("plain.hdr", b""), ("exposed.hdr", b"EXPOSURE=2.0\n")):
    with open(name, "wb") as f:
        f.write(b"#?RADIANCE\n" + line + b"FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n" + bytes([128, 64, 32, 129]))
readers = {
    "Mitsuba": lambda n: np.array(mi.Bitmap(n)).ravel(),
    "OpenCV": lambda n: cv2.imread(n, -1)[..., ::-1].ravel(),
    "OpenImageIO": lambda n: oiio.ImageBuf(n).get_pixels(oiio.FLOAT).ravel(),
    "PyAV": lambda n: next(av.open(n).decode(video=0)).to_ndarray().ravel(),
}
for k, read in readers.items():
    print(k, read("plain.hdr"), read("exposed.hdr"))
    assert np.allclose(read("plain.hdr"), [1, 0.5, 0.25]) and (read("plain.hdr") == read("exposed.hdr")).all()
kept = [a.name for a in oiio.ImageBuf("exposed.hdr").spec().extra_attribs if "expos" in a.name.lower()]
print("OpenImageIO keeps", kept)
assert kept == ["hdr:exposure"]
EOF

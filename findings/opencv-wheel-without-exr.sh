#!/bin/sh
# The OpenCV 5.0 wheel has no EXR at all; the environment variable that used to enable it does nothing
# Library: opencv-contrib-python-headless 5.0.0.93
# Guess: OPENCV_IO_ENABLE_OPENEXR=1, set before the import, enables EXR as with the 4.x wheels.
# Seen: the build says OpenEXR: NO. imread returns None for a valid file, imwrite raises "could not find a
#   writer"; .hdr and .pfm are still there.
# For pictures: scripts that read skies by cv2.imread("sky.exr", -1) get None after the upgrade, and fail later.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'opencv-contrib-python-headless==5.0.0.93' 'OpenEXR==3.5.3'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
import os
os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
from importlib.metadata import version
import cv2, numpy as np, OpenEXR

print("OpenCV", version("opencv-contrib-python-headless"))
print([line.strip() for line in cv2.getBuildInformation().splitlines() if "EXR" in line])
header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
OpenEXR.File(header, {"RGB": np.ones((2, 2, 3), "f4")}).write("a.exr")
assert cv2.imread("a.exr", cv2.IMREAD_UNCHANGED) is None
assert not cv2.haveImageWriter("b.exr") and cv2.haveImageWriter("b.hdr") and cv2.haveImageWriter("b.pfm")
try:
    cv2.imwrite("b.exr", np.ones((2, 2, 3), "f4"))
except cv2.error as e:
    print(e)
else:
    raise SystemExit("written")
EOF

#!/bin/sh
# A video tagged BT.709 is encoded by the BT.601 matrix and decoded by BT.709
# Library: PyAV 18.1.0, FFV1, yuv444p
# Guess: setting the codec context's colorspace makes PyAV convert RGB frames by that matrix, so the colours
#   survive.
# Seen: pure red gives Y 81, Cb 90, Cr 240 (BT.601) with and without the tag. Without it red comes back as red;
#   with it as (255, 24, 0).
# For pictures: sunsets in tagged videos turn orange. Reformat each frame to yuv444p with
#   dst_colorspace="itu709" first, or do not tag.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'av==18.1.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import av, numpy as np

print("PyAV", version("av"))
red = np.zeros((32, 32, 3), "u1")
red[..., 0] = 255
def encode(tag, convert=False):
    with av.open("a.mkv", "w") as c:
        s = c.add_stream("ffv1", rate=1)
        s.width, s.height, s.pix_fmt = 32, 32, "yuv444p"
        if tag is not None:
            s.codec_context.colorspace = tag
        frame = av.VideoFrame.from_ndarray(red, "rgb24")
        if convert:
            frame = frame.reformat(format="yuv444p", dst_colorspace="itu709")
        for p in list(s.encode(frame)) + list(s.encode()):
            c.mux(p)
    with av.open("a.mkv") as c:
        f = next(c.decode(video=0))
        return [int(np.frombuffer(p, "u1")[0]) for p in f.planes], f.to_ndarray(format="rgb24")[0, 0].tolist()

bt709 = 1
for tag in (None, bt709):
    yuv, rgb = encode(tag)
    print("tag", tag, "stored", yuv, "decoded", rgb)
    assert yuv == [81, 90, 240]
    assert (rgb[1] > 15) == (tag == bt709) and rgb[0] >= 253
yuv, rgb = encode(bt709, convert=True)
print("tagged and converted by hand", yuv, rgb)
assert yuv != [81, 90, 240] and rgb[1] <= 2
EOF

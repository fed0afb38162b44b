#!/bin/sh
# A zarr array made smaller and larger again shows the old numbers in the new part
# Library: zarr 3.1.6, Array.resize
# Guess: what resize cuts off is gone; what it adds is the fill value.
# Seen: [1 2 3 4] in chunks of 2, resized to 3 and back to 4, is [1 2 3 4] again; cut at the edge of a chunk it
#   is [1 2 0 0]. Only whole chunks are deleted.
# For pictures: a film of frames cut and extended shows a frame that was cut off. Write the fill value over the
#   rest first.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'zarr==3.1.6'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import zarr

print("zarr", version("zarr"))
seen = {}
for cut in (2, 3):
    a = zarr.create_array("a%d.zarr" % cut, shape=(4,), chunks=(2,), dtype="f4", fill_value=0)
    a[:] = [1, 2, 3, 4]
    a.resize((cut,))
    a.resize((4,))
    seen[cut] = a[:].tolist()
print(seen)
assert seen == {2: [1, 2, 0, 0], 3: [1, 2, 3, 4]}
EOF

#!/bin/sh
# A zarr array written in full reports three of four chunks as not initialized
# Library: zarr 3.1.6
# Guess: nchunks_initialized counts the chunks that have been written, so it can tell how far a job has come.
# Seen: a chunk equal to the fill value is not stored, and one that was stored and is overwritten by it is
#   deleted.
# For pictures: black (or clear) tiles never count as done. Keep a list of finished tiles, or create with
#   config={"write_empty_chunks": True}.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'zarr==3.1.6'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
import numpy as np, zarr

print("zarr", version("zarr"))
def count(**kw):
    a = zarr.create_array(store={}, shape=(4, 4), chunks=(2, 2), dtype="f4", fill_value=0, **kw)
    a[:] = 1
    full = a.nchunks_initialized
    picture = np.zeros((4, 4), "f4")
    picture[:2, :2] = 1
    a[:] = picture
    return full, a.nchunks_initialized

print("default", count(), "write_empty_chunks", count(config={"write_empty_chunks": True}))
assert count() == (4, 1) and count(config={"write_empty_chunks": True}) == (4, 4)
EOF

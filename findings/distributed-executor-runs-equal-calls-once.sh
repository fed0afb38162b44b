#!/bin/sh
# Five submissions of a random frame to distributed's executor give the same frame five times
# Library: distributed 2026.8.0, Client.get_executor
# Guess: an object with the interface of concurrent.futures runs every submission.
# Seen: equal calls are taken for one call and run once, also by map. get_executor(pure=False) runs each.
# For pictures: noise, clouds from a seed drawn inside, and functions called for writing a file are done once.
#   Pass pure=False or the seed.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'distributed==2026.8.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
from distributed import Client

def draw(scale):
    import random
    return scale * random.random()

if __name__ == "__main__":
    print("distributed", version("distributed"))
    with Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        seen = {}
        for name, ex in (("default", client.get_executor()), ("pure=False", client.get_executor(pure=False))):
            seen[name] = len({f.result() for f in [ex.submit(draw, 1) for _ in range(5)]}), len(set(ex.map(draw, [1] * 5)))
        print("different results of (submit, map):", seen)
        assert seen == {"default": (1, 1), "pure=False": (5, 5)}
EOF

#!/bin/sh
# A dict of options scattered to the workers of distributed arrives as one future for each option
# Library: distributed 2026.8.0, Client.scatter
# Guess: scatter(x) sends one object and returns one future of it, whatever x is.
# Seen: a list, a tuple, a set and a dict are taken apart: one future for each item, in a container of the same kind.
#   An empty dict or list is a ValueError about unpacking. [x] and the first future of it hand x over whole.
# For pipelines: settings that go with each task are a dict; a function gets futures inside of it, or the run stops at
#   options that nobody has given.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'numpy==2.4.6' 'distributed==2026.8.0'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
from distributed import Client, Future

if __name__ == "__main__":
    print("distributed", version("distributed"))
    with Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        seen = {}
        for name, value in (("dict", {"g": 0.5, "bins": 64}), ("list", [1, 2]), ("tuple", (1, 2)), ("number", 3)):
            got = client.scatter(value)
            seen[name] = "future" if isinstance(got, Future) else f"{type(got).__name__} of {len(got)}"
        whole = client.scatter([{"g": 0.5}])[0].result()
        empty = []
        for nothing in ({}, []):
            try:
                empty.append(repr(client.scatter(nothing)))
            except ValueError as error:
                empty.append(str(error))
        print(seen, "| [dict][0]:", whole, "| {} and []:", empty)
        assert seen == {"dict": "dict of 2", "list": "list of 2", "tuple": "tuple of 2", "number": "future"}
        assert whole == {"g": 0.5}
        assert all(text.startswith("not enough values to unpack") for text in empty)
EOF

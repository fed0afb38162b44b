#!/usr/bin/env bash
# Build an earlier commit of pleinair into a virtual environment of its own, to be measured beside this one in one run.
#
#   benches/baseline.sh [COMMIT] [FOLDER]      # 5196074 into target/baseline
#
# FOLDER/venv/bin/python imports that build; FOLDER/source is its checkout. The other packages are those of .venv
# (`make build` first), so that both builds meet the same numpy.
set -euo pipefail
cd "$(dirname "$0")/.."
commit=${1:-5196074}
folder=$(realpath -m "${2:-target/baseline}")
packages=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')

mkdir -p "$folder/source"
git archive "$commit" | tar -x -C "$folder/source"
test -x "$folder/venv/bin/python" || .venv/bin/python -m venv --without-pip "$folder/venv"
own=$("$folder/venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
# A plain line in a .pth file adds the folder without reading the .pth files in it: not the editable build of .venv.
echo "$packages" > "$own/packages-of-the-checkout.pth"
(cd "$folder/source" && "$packages/../../../bin/python" -m maturin build --release --quiet --target-dir "$folder/target" --out "$folder/wheel")
.venv/bin/python -m pip --python "$folder/venv/bin/python" install --quiet --no-deps --force-reinstall "$folder"/wheel/*.whl
"$folder/venv/bin/python" -P -c 'import pleinair; print(pleinair.__version__, "of '"$commit"' in", pleinair.__file__)'

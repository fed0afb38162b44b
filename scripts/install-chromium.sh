#!/usr/bin/env bash
# A Chromium for the tests marked `browser` (tests/browser/chromium.py); they are skipped where there is none.
# Does nothing where one is installed. Otherwise Debian's own is: that needs root or sudo, and downloads nothing else.
set -euo pipefail
for name in chromium chromium-browser google-chrome; do
    if command -v "$name" >/dev/null; then
        "$name" --version
        exit 0
    fi
done
if ! command -v apt-get >/dev/null; then
    echo "install-chromium.sh: no apt-get here; install chromium by the system's own means" >&2
    exit 1
fi
as_root=()
if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium fonts-dejavu-core
chromium --version

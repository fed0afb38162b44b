#!/usr/bin/env bash
# Debian's Chromium and its driver, for the tests marked `browser`; they are skipped where it is absent.
# Needs root (or sudo). Nothing else is downloaded: selenium is given the paths of both programs.
set -euo pipefail
if command -v chromium >/dev/null && command -v chromedriver >/dev/null; then
    chromium --version
    exit 0
fi
as_root=()
if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" apt-get install -y -qq --no-install-recommends chromium chromium-driver fonts-dejavu-core
chromium --version

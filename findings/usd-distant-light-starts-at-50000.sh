#!/bin/sh
# A USD DistantLight nobody gave an intensity has 50000, every other light 1
# Library: usd-core 26.11, UsdLux
# Guess: the fallback intensity of all lights is 1.
# Seen: DistantLight 50000 with normalize off; DomeLight, SphereLight, RectLight, DiskLight, CylinderLight 1.
# For pictures: a sky exported as a dome beside a sun whose intensity is left out, or "reset", is 50000 times
#   too dark beside it. Author both.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'usd-core==26.11'
cd "$dir"
"$dir/venv/bin/python" - <<'EOF'
from importlib.metadata import version
from pxr import Usd, UsdLux

print("usd-core", version("usd-core"))
stage = Usd.Stage.CreateInMemory()
seen = {}
for kind in ("DistantLight", "DomeLight", "SphereLight", "RectLight", "DiskLight", "CylinderLight"):
    light = getattr(UsdLux, kind).Define(stage, "/" + kind)
    seen[kind] = light.GetIntensityAttr().Get()
    assert light.GetNormalizeAttr().Get() is False and not light.GetIntensityAttr().HasAuthoredValue()
print(seen)
assert seen.pop("DistantLight") == 50000 and set(seen.values()) == {1}
EOF

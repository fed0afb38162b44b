"""What a wheel must carry: the licences of what is compiled into it."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_every_crate_is_named_with_its_licence():
    spec = importlib.util.spec_from_file_location("make_notices", ROOT / "scripts" / "make_notices.py")
    notices = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(notices)
    text = (ROOT / "THIRD_PARTY_LICENSES.txt").read_text(encoding="utf-8")
    found = notices.crates()
    assert len(found) > 20
    for package in found:
        line = f"{package['name']} {package['version']}: {package['license']}"
        assert line in text, f"{line} is missing: run scripts/make_notices.py"
    assert "BSD" in text[text.index("numpy 0.") :][:60]
    assert "d3-celestial" in text
    assert "Axel Mellinger" in text

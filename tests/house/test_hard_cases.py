"""docs/hard_cases.md names tests that are there."""

import re
from pathlib import Path

TESTS = Path(__file__).parents[1]
TEXT = (TESTS.parent / "docs" / "hard_cases.md").read_text(encoding="utf-8")
ROWS = re.findall(r"`([\w/]+\.py)::(test_\w*)(…?)`", TEXT)


def test_every_row_has_its_test():
    assert len(ROWS) > 40
    missing = []
    for file, name, rest in ROWS:
        path = TESTS / file
        found = re.findall(r"^def (test_\w+)", path.read_text(), re.MULTILINE) if path.exists() else []
        if not any(f.startswith(name) if rest else f == name for f in found):
            missing.append(f"{file}::{name}")
    assert not missing, missing


def test_every_row_of_a_table_of_cases_has_a_test():
    for line in TEXT.splitlines():
        cells = [c.strip() for c in line.strip("|").split("|")]
        if line.startswith("|") and len(cells) == 4 and cells[0] not in ("case", "---"):
            assert "::test_" in cells[3], line

"""A skip that `tests/accepted_skips.txt` does not have fails a run where CI is set, and is listed anywhere."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
KNOWN = """
import pytest

def test_accepted(not_committed):
    not_committed("nosuch/file")
"""
NEW = """
@pytest.mark.skipif(True, reason="nobody knows of this")
def test_marked(): pass

def test_called():
    pytest.skip("nor of this")
"""
MODULE = 'import pytest\npytest.importorskip("no_such_module", reason="a whole file")\n'


LISTED = ["test_marked: nobody knows of this", "test_called: nor of this", "test_b.py: a whole file"]


@pytest.mark.parametrize(
    ("ci", "files", "code", "listed", "workers"),
    [
        (True, {"test_a.py": KNOWN}, 0, [], []),
        (True, {"test_a.py": KNOWN + NEW, "test_b.py": MODULE}, 1, LISTED, []),
        (True, {"test_a.py": KNOWN + NEW, "test_b.py": MODULE}, 1, LISTED, ["-n", "1"]),
        (False, {"test_a.py": KNOWN + NEW}, 0, LISTED[:2], []),
    ],
    ids=["accepted", "new", "of a worker", "not in CI"],
)
def test_a_new_skip_fails_in_ci(tmp_path, ci, files, code, listed, workers):
    for name in ("conftest.py", "accepted_skips.txt"):
        shutil.copy(TESTS / name, tmp_path)
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    environment = {k: v for k, v in os.environ.items() if k not in ("CI", "PYTEST_ADDOPTS", "PLEINAIR_DATA")}
    command = [sys.executable, "-m", "pytest", "-q", "-c", os.devnull, "--rootdir", ".", *workers]
    run = subprocess.run(
        command,
        env=environment | ({"CI": "true"} if ci else {}),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        cwd=tmp_path,
    )
    assert run.returncode == code, run.stdout + run.stderr
    heading = "skips that tests/accepted_skips.txt does not have"
    assert (heading in run.stdout) == bool(listed)
    for line in listed:
        assert line in run.stdout.partition(heading)[2]
    assert "test_accepted:" not in run.stdout

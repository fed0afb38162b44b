"""The fuzzer of fuzz/readers.py: it finds what it looks for, and nothing in a few seconds."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

PATH = Path(__file__).parents[2] / "fuzz" / "readers.py"
SPEC = importlib.util.spec_from_file_location("readers", PATH)
READERS = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(READERS)

FAULTS = [
    (ValueError("a.png is damaged"), "a.png", None),
    (ValueError("it is damaged"), "a.png", "without the file's name"),
    (ValueError("called `Option::unwrap()` on a `None` value"), "", "a panic's text"),
    (IndexError("7"), "", "IndexError"),
    (MemoryError(), "", "MemoryError"),
    (BaseException("PanicException"), "", "BaseException"),
]


@pytest.mark.parametrize(("error", "name", "wrong"), FAULTS)
def test_a_fault_is_told_from_a_refusal(error, name, wrong):
    found = READERS.fault(error, name)
    assert (found is None) == (wrong is None)
    assert wrong is None or wrong in found


def test_nothing_undocumented_comes_out():
    command = [sys.executable, str(PATH), "--seconds", "4", "--seed", "20"]
    run = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | {"RAYON_NUM_THREADS": "1"}, check=False
    )
    assert run.returncode == 0, run.stdout
    counts = json.loads(run.stdout.splitlines()[-1])
    assert counts["files"] > 100
    assert counts["files read"] > 0
    assert counts["calls answered"] > 50

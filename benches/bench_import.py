"""What an import costs: `pleinair` and its rooms beyond numpy, beside an earlier build where there is one.

Each contender is a fresh interpreter, interleaved with the others; medians of wall seconds. benches/baseline.sh builds
the earlier one into target/baseline, or PLEINAIR_BASELINE names its interpreter.
"""

from __future__ import annotations

import compileall
import statistics
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import pleinair
from pleinair.report import Baseline, Row

TITLE = "Import"
CODES = {
    "nothing": "pass",
    "numpy": "import numpy",
    "pleinair": "import pleinair",
    "numpy and pleinair": "import numpy, pleinair",
    "pleinair.color": "import pleinair; pleinair.color",
    "pleinair.sky": "import pleinair; pleinair.sky",
    "pleinair.Scene": "import pleinair; pleinair.Scene",
}


def seconds(python: str, code: str) -> float:
    """Wall seconds of a fresh interpreter."""
    began = time.perf_counter()
    subprocess.run([python, "-P", "-c", code], check=True, cwd="/", env=Baseline.environment(python))
    return time.perf_counter() - began


def medians(repeats: int = 15) -> dict[tuple[str, str], float]:
    """Median wall seconds of each code in each build, interleaved."""
    builds = {"pleinair": sys.executable}
    earlier = Baseline.interpreter()
    if earlier is not None:
        builds[Baseline.name] = earlier
    # Installed packages are compiled; a checkout may not be, where PYTHONDONTWRITEBYTECODE is set.
    compileall.compile_dir(Path(pleinair.__file__).parent, quiet=2)
    times: dict[tuple[str, str], list[float]] = {}
    for _ in range(repeats):
        for build, python in builds.items():
            for name, code in CODES.items():
                times.setdefault((build, name), []).append(seconds(python, code))
    return {key: statistics.median(values) for key, values in times.items()}


def rows() -> Iterable[Row]:
    """Rows of the report: seconds beyond numpy alone, of `pleinair` beyond nothing; the answer is that it imports."""
    found = medians()
    for name in ("numpy and pleinair", "pleinair.color", "pleinair.sky", "pleinair.Scene"):
        ours = found["pleinair", name] - found["pleinair", "numpy"]
        for build in dict.fromkeys(b for b, _ in found):
            cost = found[build, name] - found[build, "numpy"]
            yield Row("import", name, "a fresh interpreter", build, cost, 0.0, "1", cost / ours)


if __name__ == "__main__":
    found = medians()
    for build in dict.fromkeys(b for b, _ in found):
        empty, numpy = found[build, "nothing"], found[build, "numpy"]
        print(f"{build}: interpreter {1e3 * empty:.1f} ms, numpy {1e3 * (numpy - empty):.1f} ms more")
        print(f"  import pleinair: {1e3 * (found[build, 'pleinair'] - empty):.1f} ms beyond nothing")
        print(f"  import numpy, pleinair: {1e3 * (found[build, 'numpy and pleinair'] - numpy):.1f} ms beyond numpy")
        for room in ("pleinair.color", "pleinair.sky", "pleinair.Scene"):
            print(f"  {room}: {1e3 * (found[build, room] - numpy):.1f} ms beyond numpy")

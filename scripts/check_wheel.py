"""Install the wheel of a folder in fresh environments, with the oldest and the newest numpy, without a compiler in the path,
and use it as README does."""

import os
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

WANTED = (
    "THIRD_PARTY_LICENSES.txt",
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "SOURCES.md",
    "py.typed",
    "_core.pyi",
    "painting_styles.toml",
)


# The oldest that pyproject.toml allows, and whatever is newest.
NUMPYS = ("numpy==2.0.0", "numpy")


def use(wheel: Path, numpy: str, lines: str) -> None:
    """Run README's lines in an environment that holds the wheel and that numpy."""
    with tempfile.TemporaryDirectory() as place:
        subprocess.run([sys.executable, "-m", "venv", f"{place}/venv"], check=True)
        python = f"{place}/venv/bin/python"
        subprocess.run([python, "-m", "pip", "install", "--quiet", f"{wheel.resolve()}[io]", numpy], check=True)
        bare = {"PATH": f"{place}/venv/bin", "HOME": place}
        subprocess.run([python, "-c", lines], cwd=place, env=bare, check=True)
        subprocess.run([f"{place}/venv/bin/pleinair", "--version"], cwd=place, env=bare, check=True)
        made = sorted(p.name for p in Path(place).iterdir() if p.is_file())
    assert made == ["coral.exr", "coral.json", "coral.png"], made


def main(folder: str) -> None:
    """Check names and contents of the wheel, then run README's lines with it."""
    (wheel,) = Path(folder).glob("*.whl")
    assert re.search(r"-cp311-abi3-manylinux_2_(1\d|2[0-8])_", wheel.name) or sys.platform != "linux", wheel.name
    oldest = re.search(r'"numpy>=([\d.]+)"', (Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
    assert oldest is not None
    assert NUMPYS[0].startswith(f"numpy=={oldest[1]}"), NUMPYS
    names = zipfile.ZipFile(wheel).namelist()
    missing = [w for w in WANTED if not any(n.endswith(w) for n in names)]
    assert not missing, f"the wheel lacks {missing}"
    size = wheel.stat().st_size
    assert size <= 6e6, f"the wheel has {size} bytes"
    readme = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    lines = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)[1]  # a sky in five lines
    for numpy in NUMPYS:
        use(wheel, numpy, lines)
    where = f"without a compiler, with {' and '.join(NUMPYS)} ({os.uname().machine})"
    print(f"{wheel.name}: {size / 1e6:.2f} MB, installed and used {where}")


if __name__ == "__main__":
    main(*sys.argv[1:])

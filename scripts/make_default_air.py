"""Write src/air/tables/default_air.bin: the light of all orders in the default air, followed by the core itself.

After a change of `src/air`, of the grid of src/air/multiple.rs or of the defaults::

    python scripts/make_default_air.py

`the_stored_air_is_what_was_followed` (src/sky/physical.rs) holds the table to the computation.
"""

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    """Run the test that writes it, then the one that holds it."""
    cargo = ["cargo", "test", "--release", "--lib", "--quiet", "--"]
    subprocess.run([*cargo, "--ignored", "write_default_air"], cwd=ROOT, check=True)
    subprocess.run([*cargo, "the_stored_air_is_what_was_followed", "--nocapture"], cwd=ROOT, check=True)


if __name__ == "__main__":
    main()

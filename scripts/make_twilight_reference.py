"""Write tests/data/twilight_reference.csv: zenith luminance in twilight by the Monte Carlo of `Physical.monte_carlo`.

The reference is independent of the fast method but for what the air is (src/air/monte_carlo.rs); it takes half an hour on
one core, so its numbers are kept. `tests/hard/test_twilight.py` holds the fast method to them.

python scripts/make_twilight_reference.py
"""

from pathlib import Path

import numpy as np
import pleinair as pa

OUT = Path(__file__).resolve().parents[1] / "tests/data/twilight_reference.csv"
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def paths_at(elevation: float) -> int:
    """Return how many paths give a standard error of about a hundredth."""
    if elevation > -5.75:
        return 100_000
    return 600_000 if elevation > -9.75 else 1_600_000


def main() -> None:
    """Follow the paths."""
    lines = [
        "# zenith luminance of Physical(turbidity=2.5) by Physical.monte_carlo; key 14",
        "elevation_deg,paths,luminance_cd_m2,standard_error_cd_m2",
    ]
    for elevation in np.arange(-2.0, -12.25, -0.5):
        sky = pa.sky.Physical(pa.astro.Sun(float(elevation), 0))
        value, error = sky.monte_carlo((0, 0, 1), paths_at(elevation), key=14)
        # Channels go up and down together: their errors add.
        lines.append(f"{elevation:.1f},{paths_at(elevation)},{value @ WEIGHTS:.5g},{error @ WEIGHTS:.2g}")
        print(lines[-1], flush=True)
        OUT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

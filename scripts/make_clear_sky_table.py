"""Make python/pleinair/data/clear_skies.npz: clear skies of `Physical` on a coarse grid, for the search of `fit.sky`.

Logarithms of radiance in cd/m² (float16) by ozone, turbidity, elevation of the Sun, zenith angle and azimuth from the Sun.
`fit.sky` looks the best places of a search up in it and judges them by `Physical` itself.
"""

from pathlib import Path

import numpy as np
import pleinair as pa

OZONE = (150.0, 450.0)
TURBIDITY = (1.5, 1.8, 2.2, 2.8, 3.7, 5.0, 6.5, 8.2, 10.0)
SUN = (-4.0, -2.0, 0.0, 1.5, 3.5, 6.0, 10.0, 15.0, 21.0, 28.0, 36.0, 45.0, 56.0, 70.0, 89.0)
ZENITH = np.degrees(np.arccos(np.linspace(1, 0, 19) ** 1.6))  # denser towards the horizon
ZENITH[-1] = 89.7
AZIMUTH = 180 * np.linspace(0, 1, 19) ** 1.5  # denser towards the Sun


def main() -> None:
    z, a = np.radians(ZENITH)[:, None], np.radians(AZIMUTH)[None]
    directions = np.stack(np.broadcast_arrays(np.sin(z) * np.sin(a), np.sin(z) * np.cos(a), np.cos(z)), -1)
    table = np.empty((len(OZONE), len(TURBIDITY), len(SUN), *directions.shape), np.float16)
    for i, ozone in enumerate(OZONE):
        for j, turbidity in enumerate(TURBIDITY):
            for k, elevation in enumerate(SUN):
                sky = pa.sky.Physical(pa.Sun(elevation, 0.0), turbidity=turbidity, ozone=ozone)
                table[i, j, k] = np.log(np.maximum(sky.radiance(directions), 1e-6))
    path = Path(__file__).parents[1] / "python/pleinair/data/clear_skies.npz"
    np.savez_compressed(path, ozone=OZONE, turbidity=TURBIDITY, sun=SUN, zenith=ZENITH, azimuth=AZIMUTH, radiance=table)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()

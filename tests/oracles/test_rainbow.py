"""Rainbow and fogbow beside miepython's peaks (tests/data/rainbow_peaks.csv), Mie theory of SciPy's Bessel functions, Descartes."""

import csv
from pathlib import Path

import numpy as np
import pytest
from pleinair.weather import bow_phase
from scipy.special import spherical_jn, spherical_yn

PEAKS = Path(__file__).parent.parent / "data" / "rainbow_peaks.csv"
# Lines of a band of 20 nm [nm].
LINES = np.array([-8.0, -4.0, 0.0, 4.0, 8.0])


def rows(radius):
    with PEAKS.open() as stream:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(stream) if float(row["r"]) == radius]


def peak(row, which, low, high, step):
    """How far the highest place of a bow is from miepython's, and the ratio of the heights."""
    angles = np.arange(low, high, step)
    seen = bow_phase(angles, row["lam"] + LINES, row["r"], disc=0.2665).mean(axis=1)
    inside = slice(int(0.3 / step), -int(0.3 / step))
    at = seen[inside].argmax()
    return angles[inside][at] - row[f"peak{which}"], seen[inside][at] / row[f"p{which}"]


@pytest.mark.parametrize("radius", [200, 500, 1000])
def test_primary_is_miepythons(radius):
    off, ratio = np.transpose([peak(row, 1, 136.5, 142, 0.02) for row in rows(radius)])
    assert np.abs(off).max() < 0.1
    assert np.abs(ratio - 1).max() < 0.1


def test_primary_of_small_drops():
    # Drops of one size have ripples of 0.1 to 0.2° on top of the bow, which move with the lines of a band: the mean holds.
    off, ratio = np.transpose([peak(row, 1, 136.5, 142, 0.05) for row in rows(50)])
    assert abs(off.mean()) < 0.05
    assert np.abs(off).max() < 0.2
    assert np.abs(ratio - 1).max() < 0.1


@pytest.mark.parametrize(("radius", "within"), [(200, 0.2), (500, 0.1), (1000, 0.1)])
def test_secondary_is_miepythons(radius, within):
    off, ratio = np.transpose([peak(row, 2, 123.5, 131, 0.02) for row in rows(radius)])
    assert abs(off.mean()) < 0.1
    assert np.abs(off).max() < within
    assert np.abs(ratio - 1).max() < 0.1


def mie_of_scipy(x, m, cosines):
    """Phase function by Bohren and Huffman's equations 4.53, 4.74 with SciPy's Bessel functions."""
    last = int(x + 4.05 * x ** (1 / 3) + 2)
    n = np.arange(1, last + 1)
    psi, dpsi = x * spherical_jn(n, x), spherical_jn(n, x) + x * spherical_jn(n, x, True)
    chi, dchi = -x * spherical_yn(n, x), -spherical_yn(n, x) - x * spherical_yn(n, x, True)
    xi, dxi = psi - 1j * chi, dpsi - 1j * dchi
    y = m * x
    inner, dinner = y * spherical_jn(n, y), spherical_jn(n, y) + y * spherical_jn(n, y, True)
    a = (m * inner * dpsi - psi * dinner) / (m * inner * dxi - xi * dinner)
    b = (inner * dpsi - m * psi * dinner) / (inner * dxi - m * xi * dinner)
    s1, s2 = np.zeros(len(cosines), complex), np.zeros(len(cosines), complex)
    before, pi = np.zeros(len(cosines)), np.ones(len(cosines))
    for k in n:
        tau = k * cosines * pi - (k + 1) * before
        by = (2 * k + 1) / (k * (k + 1))
        s1 += by * (a[k - 1] * pi + b[k - 1] * tau)
        s2 += by * (a[k - 1] * tau + b[k - 1] * pi)
        before, pi = pi, ((2 * k + 1) * cosines * pi - (k + 1) * before) / k
    scattered = 2 / x**2 * ((2 * n + 1) * (abs(a) ** 2 + abs(b) ** 2)).sum()
    return (abs(s1) ** 2 + abs(s2) ** 2) / (2 * np.pi * x**2 * scattered)


@pytest.mark.parametrize("radius", [3.0, 10.0, 40.0])
def test_small_drops_are_mies(radius):
    from pleinair._core import weather_index

    angles = np.linspace(0, 180, 37)
    m = weather_index(550.0)
    want = mie_of_scipy(2 * np.pi * radius * 1e3 / 550, m, np.cos(np.radians(angles)))
    np.testing.assert_allclose(bow_phase(angles, [550.0], radius)[:, 0], want, rtol=1e-6)


def test_index_is_daimons():
    from pleinair._core import weather_index

    for row in rows(500):
        assert abs(weather_index(row["lam"]) - row["n"]) < 1e-4


def test_dark_band_and_order_of_colours():
    # Alexander's band is darker than both sides; the primary is red outside, the secondary red inside.
    angles = np.arange(120, 150, 0.05)
    p = bow_phase(angles, [450.0, 650.0], 500.0, spread=0.2, disc=0.2665)
    inside, band, outside = (p[(angles > a) & (angles < b)].mean() for a, b in ((143, 148), (131, 136), (121, 124)))
    assert band < 0.5 * inside
    assert band < 0.8 * outside
    first = angles[p[:, 0].argmax()] - angles[p[:, 1].argmax()]
    assert first > 1
    low = angles < 132
    second = angles[low][p[low, 0].argmax()] - angles[low][p[low, 1].argmax()]
    assert second < -1


def test_supernumeraries_are_where_airys_function_has_them():
    # The second maximum of Ai² is at z = 3.2482, the first at 1.0188 (Abramowitz and Stegun, table 10.13).
    radius, wave = 300.0, 550.0
    angles = np.arange(138, 142, 0.005)
    p = bow_phase(angles, [wave], radius)[:, 0]
    tops = angles[1:-1][(p[1:-1] > p[:-2]) & (p[1:-1] > p[2:])]
    n = 1.3338
    h = 9 / 4 * np.sqrt((4 - n**2) / (n**2 - 1) ** 3)
    scale = np.degrees((h / (2 * np.pi * radius * 1e3 / wave) ** 2) ** (1 / 3))
    assert abs((tops[1] - tops[0]) - (3.2482 - 1.0188) * scale) < 0.03


def test_a_fogbow_over_sizes_is_the_mean_of_scipys():
    from pleinair._core import weather_index

    # Of many more sizes than ours.
    angles, m = np.arange(130, 160, 1.0), weather_index(550.0)
    y = np.linspace(-3.2, 3.6, 300)
    radii = 8 * np.exp(0.35 * y)
    weights = np.exp(-0.5 * y * y) * radii**2
    each = [mie_of_scipy(2 * np.pi * r * 1e3 / 550, m, np.cos(np.radians(angles))) for r in radii]
    want = np.average(each, axis=0, weights=weights)
    mine = bow_phase(angles, [550.0], 8.0, spread=0.35)[:, 0]
    np.testing.assert_allclose(mine, want, rtol=0.1)
    assert abs(angles[mine.argmax()] - angles[want.argmax()]) <= 1


def test_a_fogbow_is_white_and_broad():
    angles = np.arange(125, 165, 0.1)
    p = bow_phase(angles, [450.0, 550.0, 650.0], 10.0, spread=0.3, disc=0.2665)
    top = p.max(axis=0)
    assert top.max() / top.min() < 1.4
    mean = p.mean(axis=1)
    wide = angles[mean > 0.5 * (mean.max() + mean[(angles > 128) & (angles < 132)].min())]
    assert np.ptp(wide) > 5
    assert 139 < angles[mean.argmax()] < 145

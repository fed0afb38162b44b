"""Histograms, thresholds and fills against their peers: one thread, CPU time, answers compared first."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import version

import cv2
import fast_histogram
import numpy as np
import pleinair as pa
import pyamg
import scipy.sparse as sp
from pleinair.report import Row, race
from scipy.ndimage import gaussian_filter
from scipy.sparse.linalg import spsolve
from skimage.exposure import histogram as skimage_histogram
from skimage.filters import threshold_otsu

OURS = "pleinair"
CV2 = f"cv2 {cv2.__version__}"
NUMPY = f"numpy {np.__version__}"
SKIMAGE = f"skimage {version('scikit-image')}"
FAST = f"fast_histogram {version('fast-histogram')}"
PYAMG = f"pyamg {version('pyamg')} rs+cg 1e-5"
SCIPY = f"scipy {version('scipy')} spsolve"
SIZES = {"VGA": (480, 640), "12 MP": (3000, 4000)}


def histograms() -> Iterable[Row]:
    """Yield 3 channels × 256 bins; the error is the largest difference of a count from numpy's on float64."""
    rng = np.random.default_rng(0)
    for size, (h, w) in SIZES.items():
        bytes_ = rng.integers(0, 256, (h, w, 3), dtype=np.uint8)
        for kind, img, top in (
            ("u8", bytes_, 256.0),
            ("u8 constant", np.full((h, w, 3), 77, np.uint8), 256.0),
            ("f32", rng.random((h, w, 3), dtype=np.float32), 1.0),
        ):
            contenders = {
                OURS: lambda img=img: pa.image.histogram(img)[0],
                CV2: lambda img=img, top=top: np.stack(
                    [cv2.calcHist([img], [c], None, [256], [0, top]).ravel() for c in range(3)]
                ),
                NUMPY: lambda img=img, top=top: np.stack(
                    [np.histogram(img[..., c], 256, (0, top))[0] for c in range(3)]
                ),
                FAST: lambda img=img, top=top: np.stack(
                    [fast_histogram.histogram1d(img[..., c], 256, (0, top)) for c in range(3)]
                ),
            }
            if kind == "u8":
                contenders[SKIMAGE] = lambda img=img: skimage_histogram(img, source_range="dtype", channel_axis=-1)[0]
            sample = img[: 1 << 8]
            truth = np.stack([np.histogram(sample[..., c].astype(float), 256, (0, top))[0] for c in range(3)])
            part = {OURS: pa.image.histogram(sample)[0].astype(float)}
            part[CV2] = np.stack([cv2.calcHist([sample], [c], None, [256], [0, top]).ravel() for c in range(3)])
            part[NUMPY] = np.stack([np.histogram(sample[..., c], 256, (0, top))[0] for c in range(3)])
            part[FAST] = np.stack([fast_histogram.histogram1d(sample[..., c], 256, (0, top)) for c in range(3)])
            errors = {name: float(np.abs(counts - truth).max()) for name, counts in part.items()}
            assert errors[OURS] == 0
            yield from race(
                "image",
                f"histogram 3×256, {kind}",
                size,
                contenders,
                errors,
                "counts",
                rounds=9 if size == "VGA" else 5,
            )


def thresholds() -> Iterable[Row]:
    """Yield Otsu's threshold; the error is what is lost of the between-class variance, relative to the best cut."""
    rng = np.random.default_rng(1)
    for size, (h, w) in SIZES.items():
        x = np.where(rng.random((h, w)) < 0.4, rng.normal(0.3, 0.1, (h, w)), rng.normal(0.7, 0.1, (h, w)))
        for kind, img in (("u8", (x * 255).clip(0, 255).astype(np.uint8)), ("f32", x.astype(np.float32))):
            contenders = {
                OURS: lambda img=img: pa.image.otsu(img).value,
                SKIMAGE: lambda img=img: threshold_otsu(img),
            }
            if kind == "u8":
                contenders[CV2] = lambda img=img: cv2.threshold(img, 0, 255, cv2.THRESH_OTSU)[0]
            else:
                contenders["pleinair nbins=256"] = lambda img=img: pa.image.otsu(img, nbins=256).value

            def between(t: float, img: np.ndarray = img) -> float:
                high = img > t
                n = high.sum() / high.size
                wide = img.astype(np.float64)
                return n * (1 - n) * (wide.mean(where=high) - wide.mean(where=~high)) ** 2

            best = between(contenders[OURS]())
            errors = {name: max(0.0, 1 - between(call()) / best) for name, call in contenders.items()}
            assert all(between(call()) <= best * (1 + 1e-12) for call in contenders.values())
            yield from race("image", f"Otsu, {kind}", size, contenders, errors, "1", rounds=5)


def system(mask: np.ndarray) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Return the five-point matrix over the masked pixels and the one that sums their known neighbours."""
    h, w = mask.shape
    index = np.arange(h * w).reshape(h, w)
    east, south = (index[:, :-1].ravel(), index[:, 1:].ravel()), (index[:-1].ravel(), index[1:].ravel())
    i = np.concatenate([east[0], east[1], south[0], south[1]])
    j = np.concatenate([east[1], east[0], south[1], south[0]])
    adjacency = sp.csr_matrix((np.ones(i.size), (i, j)), (h * w, h * w))
    hole, known = np.flatnonzero(mask), np.flatnonzero(~mask)
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    rows = adjacency[hole]
    return (sp.diags(degree[hole]) - rows[:, hole]).tocsr(), rows[:, known].tocsr()


def fills() -> Iterable[Row]:
    """Yield the fill of a picture of each size; the error is the largest, in 8-bit levels, from a finer solution."""
    for size, share in (("VGA", 0.469), ("12 MP", 0.4)):
        h, w = SIZES[size]
        rng = np.random.default_rng(1)
        y, x = np.mgrid[:h, :w] / h
        glow = 0.5 * np.exp(-((x - 0.9) ** 2 + (y - 0.3) ** 2) * 30)
        img = np.stack([0.2 + 0.3 * y + glow, 0.35 + 0.3 * y + glow, 0.8 - 0.1 * y + 0.3 * glow], axis=2)
        img = (img + rng.normal(0, 0.02, (h, w, 1))).astype(np.float32)
        noise = gaussian_filter(rng.normal(size=(h, w)), 12)
        mask = noise > np.quantile(noise, 1 - share)

        def direct(img: np.ndarray = img, mask: np.ndarray = mask) -> np.ndarray:
            a, known = system(mask)
            out = img.astype(float)
            out[mask] = spsolve(a.tocsc(), known @ out[~mask])
            return out

        def amg(img: np.ndarray = img, mask: np.ndarray = mask, tol: float = 1e-5) -> np.ndarray:
            a, known = system(mask)
            b = known @ img[~mask].astype(float)
            solver = pyamg.ruge_stuben_solver(a)
            out = img.astype(float)
            out[mask] = np.stack([solver.solve(b[:, c], tol=tol, accel="cg") for c in range(3)], axis=1)
            return out

        contenders = {OURS: lambda img=img, mask=mask: pa.image.fill(img, mask), PYAMG: amg}
        # A direct solution of 12 MP would need more memory than most machines have.
        truth = direct() if size == "VGA" else amg(tol=1e-10)
        if size == "VGA":
            contenders[SCIPY] = direct
        errors = {name: float(np.abs(call() - truth).max() * 255) for name, call in contenders.items()}
        assert errors[OURS] < 0.1
        task = f"Laplace fill, {100 * share:.0f} % of RGB"
        yield from race("image", task, size, contenders, errors, "levels", rounds=5 if size == "VGA" else 1)


def rows() -> Iterable[Row]:
    """Yield every row of the room."""
    threads, theirs = pa.get_num_threads(), cv2.getNumThreads()
    pa.set_num_threads(1)
    cv2.setNumThreads(1)
    try:
        yield from histograms()
        yield from thresholds()
        yield from fills()
    finally:
        pa.set_num_threads(threads)
        cv2.setNumThreads(theirs)

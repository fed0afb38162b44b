"""Precomputed scattering images of a cloud (inverse_clouds, section 4). Public as `pleinair.clouds.Basis`.

Optical paths, single scattering at nodes of extinction, and higher orders at nodes of extinction and asymmetry, kept as
a low-rank product once they are denoised.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import clouds_factors, clouds_fit_nodes, clouds_higher_orders, clouds_multiply, clouds_node_light
from .._support.docs import documented
from .._support.inputs import Aligned, Progress, array, instance, integer, key, real
from ..astro import Sun
from ..camera import Camera
from ..io import PathLike, UnreadableError, read_arrays, write_arrays
from .images import CloudImage, check_scene, compose, march, sky_pixels, smooth
from .order_groups import PathSettings, checked, grouped
from .params import Conventions, Params
from .volume import Volume

_IMAGES = (
    "depth",
    "distance",
    "cosine",
    "sigma_t",
    "scattered",
    "pixels",
    "g",
    "extinctions",
    "exponents",
    "multiple",
    "mixture",
    "images",
)
_NODES = 16  # most asymmetries and extinctions of the core
_DEFAULT = 12  # of those, where a basis has more of single scattering


def _asymmetries(g: ArrayLike | None, conventions: Conventions) -> NDArray[np.float64]:
    if g is None:
        if conventions.interpolation == "linear":
            return np.append(np.linspace(0, 0.9, 10), 0.97)
        return np.tanh(np.linspace(0, np.arctanh(0.97), 12))
    nodes = array(g, "g", dtypes=(np.float64,), ndim=1)
    if not 1 <= nodes.size <= _NODES or not (np.abs(nodes) <= 0.999).all() or (np.diff(nodes) <= 0).any():
        msg = f"g must be 1 to {_NODES} ascending numbers in [-0.999, 0.999], got {nodes.tolist()}"
        raise ValueError(msg)
    return nodes


def _extinctions(sigma_t: NDArray[np.float64], conventions: Conventions) -> NDArray[np.float64]:
    nodes = sigma_t[sigma_t > 0]
    if nodes.size <= _DEFAULT:
        return nodes
    if conventions.interpolation == "linear":
        return np.linspace(nodes[0], nodes[-1], _DEFAULT)
    return np.geomspace(nodes[0], nodes[-1], _DEFAULT)


def _factors(
    multiple: NDArray[np.float32], light: NDArray[np.float64] | None = None
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the strongest components of images, each weighed by its light: mixture and components."""
    shape = multiple.shape[:3]
    groups, n = shape[0], multiple.shape[3]
    by = None if light is None else light.reshape(-1).tolist() * groups
    mixture, images = clouds_factors(multiple, by, (groups, shape[1] * shape[2]))
    return mixture.reshape(-1, *shape), images.reshape(-1, n)


@dataclass(frozen=True, eq=False)
class Basis(Aligned):
    """Precomputed images of one cloud, camera and Sun: the light of any parameters in a moment (section 4.3).

    Make one with `Basis.precompute` or `Basis.load`.

    Attributes
    ----------
    depth : ndarray (height, width) of float32
        Density-weighted path S [m].
    distance : ndarray (height, width) of float32
        From the eye to the first density [m].
    cosine : ndarray (height, width) of float32
        Cosine of the scattering angle [1].
    sigma_t : ndarray (m,) of float64
        Extinctions of the images, ascending [1/m].
    scattered : ndarray (m, height, width) of float32
        Light scattered once, without phase function and albedo [1].
    pixels : ndarray (n,) of uint32
        Pixels that see the cloud, counted row by row.
    g, extinctions, exponents : ndarray of float64
        Nodes of the images of higher orders: asymmetries [1], extinctions [1/m], powers of the albedo [1].
    multiple : ndarray (powers, asymmetries, extinctions, n) of float32
        Light scattered twice and more often, for albedo 1; empty with one order [1].
    mixture, images : ndarray (rank, powers, asymmetries, extinctions), (rank, n) of float32
        What the images of a smoothed basis are mixed from; empty if it was not smoothed [1].
    orders : int or None
        Orders of scattering, None for all [1].
    camera, sun, conventions
        What the images were made with.
    """

    depth: NDArray[np.float32]
    distance: NDArray[np.float32]
    cosine: NDArray[np.float32]
    sigma_t: NDArray[np.float64]
    scattered: NDArray[np.float32]
    camera: Camera
    sun: Sun
    conventions: Conventions = field(default_factory=Conventions)
    pixels: NDArray[np.uint32] = field(default_factory=lambda: np.zeros(0, np.uint32))
    g: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    extinctions: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    exponents: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    multiple: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 0, 0, 0), np.float32))
    mixture: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 0, 0, 0), np.float32))
    images: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 0), np.float32))
    orders: int | None = 1

    @classmethod
    @documented
    def precompute(
        cls,
        cloud: Volume,
        camera: Camera,
        sun: Sun,
        *,
        sigma_t: ArrayLike | None = None,
        orders: int | None = 1,
        g: ArrayLike | None = None,
        samples: int = 128,
        denoise: bool = True,
        memory: float = 4e9,
        rng: Any = None,
        conventions: Conventions | None = None,
        progress: Progress = None,
    ) -> Basis:
        """March a cloud once for many extinctions, and follow paths for many asymmetries and extinctions at once.

        Parameters
        ----------
        cloud : Volume
            The density.
        camera : Camera
            From where.
        sun : Sun
            Direction of the light.
        sigma_t : array_like (m,), optional
            Ascending extinctions to compute [1/m]. By default 19 (ratio √2), from a largest optical depth through the
            picture of 1/8 to one of 64; with linear interpolation, as in the paper, 11 at equal steps from 0 to there.
        orders : int or None
            Orders of scattering: 1 is single scattering, the paper has 4, None is all of them [1].
        g : array_like (n,), optional
            Ascending asymmetries of the images of higher orders, at most 16 in [-0.999, 0.999] [1]. By default 12 from
            0 to 0.97, dense near 1.
        samples : int
            PathSettings of a pixel for the orders from 2 on [1].
        denoise : bool
            Smooth the images of these orders, guided by optical depth and single-scattered light. Without, they are
            unbiased and noisy.
        memory : float
            Most bytes that the images may take; more is refused before the work starts [byte].
        rng : None, int, SeedSequence, BitGenerator or Generator
            Of the paths. Same `rng`, same basis, whatever the number of threads.
        conventions : Conventions, optional
            Readings of the paper.
        {progress}

        Returns
        -------
        Basis
            The images.

        Raises
        ------
        ValueError, TypeError
            An argument is out of range, or the camera does not see the cloud.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> cloud = Volume(np.ones((4, 4, 4)), 25.0)
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
        >>> Basis.precompute(cloud, camera, Sun(45, 180)).scattered.shape
        (19, 24, 32)
        """
        orders = checked(orders)
        conventions = instance(Conventions() if conventions is None else conventions, "conventions", Conventions)
        check_scene(cloud, camera, sun)
        samples, seed = integer(samples, "samples", 1, 10**9), key(rng)
        seen = march(cloud, camera, sun, [], "fast", None, "")[0][0]
        if sigma_t is None:
            deepest = float(seen.max())
            if not deepest > 0:
                msg = "camera does not see the cloud: no ray meets any density"
                raise ValueError(msg)
            if conventions.interpolation == "linear":
                nodes = np.linspace(0.0, 64.0 / deepest, 11)
            elif orders == 1:
                nodes = 2.0 ** np.arange(-3, 6.01, 0.5) / deepest
            else:
                nodes = np.geomspace(0.4, 40.0, 15) / deepest
        else:
            nodes = array(sigma_t, "sigma_t", dtypes=(np.float64,), ndim=1)
            if nodes.size == 0 or not np.isfinite(nodes).all() or (np.diff(nodes) <= 0).any() or nodes[0] < 0:
                msg = f"sigma_t must ascend from at least 0 [1/m], got {nodes.tolist()}"
                raise ValueError(msg)
            if conventions.interpolation == "cubic" and nodes[0] <= 0:
                msg = "sigma_t must be above 0 [1/m] for interpolation in log σ; use conventions with 'linear'"
                raise ValueError(msg)
        plan, exponents = None, np.zeros(0)
        asymmetries, extinctions = np.zeros(0), np.zeros(0)
        if orders != 1:
            asymmetries, extinctions = _asymmetries(g, conventions), _extinctions(nodes, conventions)
            powers, shared = grouped(orders)
            exponents = np.array(powers)
            plan = PathSettings(
                asymmetries.tolist(), extinctions.tolist(), len(powers), shared, orders is None, 1.0, samples, seed
            )
        images = exponents.size * asymmetries.size * extinctions.size * np.count_nonzero(seen)
        size = 4 * (int(images) + (3 + nodes.size) * seen.size)
        if size > real(memory, "memory", 0, 1e15, "byte"):
            msg = f"memory must be at least the {size / 1e6:.0f} MB of this basis, got {memory / 1e6:.0f} MB"
            raise ValueError(msg)
        what = f"basis, {size / 1e6:.0f} MB"
        parts, more = march(cloud, camera, sun, nodes.tolist(), "fast", progress, what, plan)
        depth, distance, cosine, scattered = parts
        basis = cls(depth, distance, cosine, nodes, scattered, camera, sun, conventions)
        if more is None:
            return basis
        pixels, light = more
        multiple = light.reshape(exponents.size, asymmetries.size, extinctions.size, pixels.size)
        basis = replace(
            basis,
            pixels=pixels,
            g=asymmetries,
            extinctions=extinctions,
            exponents=exponents,
            multiple=multiple,
            orders=orders,
        )
        return basis._smoothed(progress) if denoise and pixels.size else basis

    def _smoothed(self, progress: Progress) -> Basis:
        """Smooth the images of higher orders in place and return the basis with what they are mixed from."""
        nodes = (self.g.tolist(), self.extinctions.tolist())
        seen = (self.scattered, self.sigma_t.tolist(), self.cosine, self.pixels)
        light = np.array(clouds_node_light(*seen, self.multiple, *nodes)).reshape(self.multiple.shape[1:3])
        # What a cloud shows as a thin, a middling and a thick one.
        three = [int(i) for i in np.linspace(0, self.sigma_t.size - 1, 5)[1:4].round()]
        noise = smooth(
            self.multiple,
            np.broadcast_to(light, self.multiple.shape[:3]),
            self.pixels,
            self.depth,
            self.scattered[three],
            self.sigma_t[three].tolist(),
            progress,
        )
        # Windows leave about a twentieth of a strong noise, and of a weak one what is allowed.
        left = np.maximum(0.05 * noise, 0.01).reshape(self.multiple.shape[:3])
        clouds_fit_nodes(self.multiple, *nodes, (left * light).reshape(-1).tolist())
        # What is left beyond the strongest components is noise.
        mixture, images = _factors(self.multiple, light)
        clouds_multiply(mixture, images, len(mixture), self.multiple)
        return replace(self, mixture=mixture, images=images)

    def higher_orders(self, params: Params) -> NDArray[np.float32] | None:
        """Return the light of the orders from 2 on (height, width), without intensity; None with one order.

        Parameters
        ----------
        params : Params
            Of which `g`, `sigma_t` and `albedo` count.

        Raises
        ------
        ValueError
            They lie outside the basis.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 8, 6, fov=30)
        >>> cloud = Volume(np.ones((4, 4, 4)), 25.0)
        >>> basis = Basis.precompute(cloud, camera, Sun(45, 180), orders=4, samples=8, rng=0)
        >>> basis.higher_orders(Params(sigma_t=0.02)).shape
        (6, 8)
        """
        if self.multiple.size == 0:
            return None
        at = (params.g, params.sigma_t, params.albedo)
        out = np.zeros(self.depth.shape, np.float32)
        images = np.ascontiguousarray(self.multiple)
        out.reshape(-1)[self.pixels] = clouds_higher_orders(self.nodes, at, self.conventions.words, images)
        return out

    def mixed(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return few images that the many of higher orders are mixed from, for searches that compose thousands of times.

        Returns
        -------
        mixture : ndarray (rank, powers, asymmetries, extinctions) of float32
            How much of each image is in each of theirs.
        images : ndarray (rank, n) of float32
            The images.

        Notes
        -----
        A smoothed basis has no more than 32 independent images: the mixture is exact. Of the noise of another it keeps
        a part: a truncated singular value decomposition (Halko, Martinsson and Tropp 2011).

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 8, 6, fov=30)
        >>> cloud = Volume(np.ones((4, 4, 4)), 25.0)
        >>> basis = Basis.precompute(cloud, camera, Sun(45, 180), orders=4, samples=8, rng=0)
        >>> mixture, images = basis.mixed()
        >>> mixture.shape[1:] == basis.multiple.shape[:3], len(mixture) == len(images)
        (True, True)
        """
        if self.images.size or not self.multiple.size:
            return self.mixture, self.images
        return _factors(self.multiple)

    @property
    def nodes(self) -> tuple[list[float], list[float], list[float]]:
        """Asymmetries [1], extinctions [1/m] and powers of the albedo [1] of the images of higher orders.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 8, 6, fov=30)
        >>> cloud = Volume(np.ones((4, 4, 4)), 25.0)
        >>> Basis.precompute(cloud, camera, Sun(45, 180), orders=4, samples=8, rng=0).nodes[2]
        [2.0, 3.0, 4.0]
        """
        return self.g.tolist(), self.extinctions.tolist(), self.exponents.tolist()

    def render(self, params: Params, sky: Any = None) -> CloudImage:
        """Compose the picture of `params` with all its parts.

        Parameters
        ----------
        params : Params
            The light and the particles; `sigma_t` within the basis [1/m].
        sky : array_like (3,) or (height, width, 3), optional
            Linear light behind the cloud.

        Returns
        -------
        CloudImage
            The picture and its parts.

        Raises
        ------
        ValueError
            `params.sigma_t` lies outside the basis.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
        >>> basis = Basis.precompute(Volume(np.ones((4, 4, 4)), 25.0), camera, Sun(45, 180))
        >>> basis.render(Params(sigma_t=0.02)).transmittance.shape
        (24, 32)
        """
        instance(params, "params", Params)
        parts = (self.depth, self.distance, self.cosine, self.scattered)
        background = sky_pixels(sky, self.camera)
        more = self.higher_orders(params)
        view = (self.camera, self.sun, self.conventions)
        return compose(parts, self.sigma_t.tolist(), params, background, view, more)

    def image(self, params: Params, sky: Any = None) -> NDArray[np.float32]:
        """Return the picture of `params` (height, width, 3), linear light; see `render`.

        Parameters
        ----------
        params : Params
            The light and the particles; `sigma_t` within the basis [1/m].
        sky : array_like (3,) or (height, width, 3), optional
            Linear light behind the cloud.

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
        >>> basis = Basis.precompute(Volume(np.ones((4, 4, 4)), 25.0), camera, Sun(45, 180))
        >>> basis.image(Params(sigma_t=0.02), sky=(0.2, 0.4, 0.8)).shape
        (24, 32, 3)
        """
        return self.render(params, sky).rgb

    @property
    def nbytes(self) -> int:
        """Size of the images [byte].

        Examples
        --------
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
        >>> Basis.precompute(Volume(np.ones((4, 4, 4)), 25.0), camera, Sun(45, 180)).nbytes
        67584
        """
        return sum(
            a.nbytes for a in (self.depth, self.distance, self.cosine, self.scattered, self.multiple, self.images)
        )

    def save(self, path: PathLike) -> Path:
        """Write the basis as .npz.

        Parameters
        ----------
        path : path
            Where to; the ending must be .npz.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            The ending is another.

        Examples
        --------
        >>> import tempfile, pathlib
        >>> from pleinair import Camera, Sun
        >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
        >>> basis = Basis.precompute(Volume(np.ones((4, 4, 4)), 25.0), camera, Sun(45, 180))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Basis.load(basis.save(pathlib.Path(folder) / "basis.npz")).sun
        Sun(elevation=45.0, azimuth=180.0)
        """
        if Path(path).suffix.lower() != ".npz":
            msg = f"path must end in .npz, got {Path(path).name!r}"
            raise ValueError(msg)
        about = {
            "camera": dataclasses.asdict(self.camera),
            "sun": dataclasses.asdict(self.sun),
            "conventions": dataclasses.asdict(self.conventions),
            "orders": self.orders,
        }
        images = {n: getattr(self, n) for n in _IMAGES}
        return write_arrays(path, "basis/2", {**images, "about": np.array(json.dumps(about))})

    @classmethod
    def load(cls, path: PathLike) -> Basis:
        """Read what `save` wrote.

        Parameters
        ----------
        path : path
            The file.

        Raises
        ------
        FileNotFoundError
            There is no such file.
        ValueError
            The file is foreign or damaged.

        Examples
        --------
        >>> Basis.load("nowhere.npz")
        Traceback (most recent call last):
        FileNotFoundError: there is no file nowhere.npz
        """
        stored = read_arrays(path, "basis/2")
        try:
            about = json.loads(str(stored["about"]))
            camera = Camera(**{**about["camera"], "position": tuple(about["camera"]["position"])})
            images = {n: stored[n] for n in _IMAGES}
            how = Conventions(**about["conventions"])
            basis = cls(camera=camera, sun=Sun(**about["sun"]), conventions=how, orders=about["orders"], **images)
            basis._check()
        except (KeyError, TypeError, ValueError) as error:
            msg = f"{path} is damaged: {error}"
            raise UnreadableError(msg) from None
        return basis

    def _check(self) -> None:
        size = (self.camera.height, self.camera.width)
        shape = (self.exponents.size, self.g.size, self.extinctions.size, self.pixels.size)
        right = all(getattr(self, n).shape == size for n in ("depth", "distance", "cosine"))
        if not right or self.scattered.shape != (self.sigma_t.size, *size) or self.multiple.shape != shape:
            raise ValueError("its images differ in size")
        for name in ("depth", "distance", "cosine", "scattered", "multiple", "mixture", "images"):
            array = getattr(self, name)
            if array.dtype != np.float32:
                msg = f"{name} must be float32, it is {array.dtype}"
                raise ValueError(msg)
            # A pixel without cloud is infinitely far away.
            wrong = np.isnan(array) if name == "distance" else ~np.isfinite(array)
            if wrong.any() or (name == "depth" and (array < 0).any()):
                msg = f"{name} has {int(wrong.sum())} values that are no numbers, or negative ones"
                raise ValueError(msg)
        nodes = (self.sigma_t, self.g, self.extinctions, self.exponents)
        if (
            not all(n.ndim == 1 and n.dtype == np.float64 and np.isfinite(n).all() for n in nodes)
            or not self.sigma_t.size
        ):
            raise ValueError("its nodes are no numbers")
        if any((np.diff(n) <= 0).any() for n in nodes[:3]):
            raise ValueError("its nodes do not ascend")
        if self.pixels.dtype != np.uint32 or (self.pixels.size and int(self.pixels.max()) >= self.depth.size):
            raise ValueError("it names pixels that are not there")
        if self.images.size and (
            self.images.ndim != 2
            or self.images.shape[1] != self.pixels.size
            or self.mixture.shape != (len(self.images), *shape[:3])
        ):
            raise ValueError("its mixture and images do not belong together")
        orders: Any = self.orders
        if orders is not None and (isinstance(orders, bool) or not isinstance(orders, int)):
            msg = f"orders must be a number or None, it is {orders!r}"
            raise ValueError(msg)

    def __repr__(self) -> str:
        height, width = self.depth.shape
        low, high = self.sigma_t[0], self.sigma_t[-1]
        text = f"Basis({width}x{height}, {self.sigma_t.size} extinctions in [{low:.3g}, {high:.3g}] 1/m"
        return text + (f", {self.g.size} asymmetries)" if self.g.size else ")")

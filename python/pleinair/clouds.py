"""What happens to light in a cloud: volumes, single scattering, precomputed images (inverse_clouds)."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, io
from ._inputs import Progress, array, choice, instance, integer, light, real, reporter, shape_text, vector
from ._makers import procedural, simulated
from ._volumes import Volume, load
from .astro import Sun
from .camera import Camera

__all__ = ["Basis", "CloudImage", "Conventions", "Params", "Volume", "load", "procedural", "render", "simulated"]


@dataclass(frozen=True)
class Params:
    """The rendering parameters of Table 1 of the paper.

    Parameters
    ----------
    light_intensity : float
        Intensity of the light on the cloud, L_in, at least 0 [1].
    light_color : tuple of float
        Its colour, c_in, linear RGB, at least 0 [1].
    g : float
        Asymmetry of the Henyey-Greenstein phase function, in [-0.999, 0.999], positive is forward [1].
    sigma_t : float
        Extinction per metre and unit of density, at least 0 [1/m].
    albedo : float
        Single-scattering albedo β, in [0, 1] [1]. In single scattering only its product with the intensity shows.
    ambient : float
        Ambient light L_amb, of the light's colour, at least 0 [1].
    haze : tuple of float
        Extinction of the air κ_a for R, G, B per unit of haze distance, at least 0 [1].

    Raises
    ------
    ValueError, TypeError
        A value is not a number in its range.

    Examples
    --------
    >>> Params(g=0.7).g
    0.7
    """

    light_intensity: float = 1.0
    light_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    g: float = 0.85
    sigma_t: float = 0.05
    albedo: float = 0.99
    ambient: float = 0.1
    haze: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "light_intensity", real(self.light_intensity, "light_intensity", 0, 1e30))
        put(self, "light_color", vector(self.light_color, "light_color", 0, 1e30))
        put(self, "g", real(self.g, "g", -0.999, 0.999))
        put(self, "sigma_t", real(self.sigma_t, "sigma_t", 0, 1e9, "1/m"))
        put(self, "albedo", real(self.albedo, "albedo", 0, 1))
        put(self, "ambient", real(self.ambient, "ambient", 0, 1e30))
        put(self, "haze", vector(self.haze, "haze", 0, 1e30))

    def to_json(self) -> str:
        """Return the parameters as JSON.

        Examples
        --------
        >>> Params.from_json(Params(g=0.7).to_json()) == Params(g=0.7)
        True
        """
        return json.dumps(dataclasses.asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Params:
        """Return parameters from what `to_json` gave.

        Parameters
        ----------
        text : str
            A JSON object with the names of the parameters.

        Raises
        ------
        ValueError
            The text is not JSON or holds other names.

        Examples
        --------
        >>> Params.from_json('{"g": 0.5}').g
        0.5
        """
        try:
            values = json.loads(text)
            names = {f.name for f in dataclasses.fields(cls)}
            if not isinstance(values, dict) or not values.keys() <= names:
                raise ValueError(f"the names must be among {sorted(names)}")
            given: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
            return cls(**given)
        except (ValueError, TypeError) as error:
            msg = f"text must be a JSON object of parameters: {error}"
            raise ValueError(msg) from None


@dataclass(frozen=True)
class Conventions:
    """How parameters get their meaning, where the paper leaves it open; `Conventions.paper()` is its letter.

    Parameters
    ----------
    ambient : {"extinction", "paper"}
        The ambient term of eq 5: L_amb (1 − exp(−σ S)), which tends to L_amb in an opaque cloud, or the printed one,
        which is divided by σ and so depends on the unit of length.
    phase : {"mean-one", "integral-one"}
        Whether the phase function has mean 1 or integral 1 over the sphere.
    interpolation : {"cubic", "linear"}
        Between the extinctions of a basis: cubic in log σ, or linear in σ.
    haze : {"unit", "distance"}
        The distance t_c of eq 3: 1 for every pixel, or the distance to the cloud over its mean.

    Raises
    ------
    ValueError
        A word is none of these.

    Examples
    --------
    >>> Conventions.paper()
    Conventions(ambient='paper', phase='mean-one', interpolation='linear', haze='unit')
    """

    ambient: str = "extinction"
    phase: str = "mean-one"
    interpolation: str = "cubic"
    haze: str = "unit"

    def __post_init__(self) -> None:
        choice(self.ambient, "ambient", ("extinction", "paper"))
        choice(self.phase, "phase", ("mean-one", "integral-one"))
        choice(self.interpolation, "interpolation", ("cubic", "linear"))
        choice(self.haze, "haze", ("unit", "distance"))

    @classmethod
    def paper(cls) -> Conventions:
        """Return the conventions of the paper's letter.

        Examples
        --------
        >>> Conventions.paper().ambient
        'paper'
        """
        return cls(ambient="paper", interpolation="linear")

    @property
    def words(self) -> tuple[str, str, str]:
        """What the core is told."""
        return self.ambient, self.phase, self.interpolation


@dataclass(frozen=True, eq=False)
class CloudImage:
    """A rendered cloud and what it is made of.

    Attributes
    ----------
    rgb : ndarray (height, width, 3) of float32
        The picture, L_cg of eq 3, linear light.
    single, multiple : ndarray (height, width, 3) of float32
        Light scattered once, and more often, before haze.
    transmittance : ndarray (height, width) of float32
        Of the cloud, in [0, 1] [1].
    distance : ndarray (height, width) of float32
        From the eye to the first density, infinite where there is none [m].
    """

    rgb: NDArray[np.float32]
    single: NDArray[np.float32]
    multiple: NDArray[np.float32]
    transmittance: NDArray[np.float32]
    distance: NDArray[np.float32]

    def __repr__(self) -> str:
        height, width, _ = self.rgb.shape
        return f"CloudImage({width}x{height}, {(self.transmittance < 1).mean():.0%} cloud)"


def _orders(orders: int) -> int:
    # One order until multiple scattering lands; the check keeps nobody waiting for light that will not come.
    return integer(orders, "orders", 1, 1)


def _scene(cloud: Volume, camera: Camera, sun: Sun) -> None:
    instance(cloud, "cloud", Volume)
    instance(camera, "camera", Camera)
    instance(sun, "sun", Sun)


def sky_pixels(sky: Any, camera: Camera) -> NDArray[np.float32]:
    """Return the sky behind a picture as float32 (height, width, 3): a colour, a picture or a sky with `render`."""
    size = (camera.height, camera.width, 3)
    if sky is None:
        return np.zeros(size, np.float32)
    if hasattr(sky, "render"):
        sky = sky.render(camera)
    pixels = light(sky, "sky", last=3) if np.ndim(sky) > 1 else array(sky, "sky", last=3)
    if pixels.shape not in ((3,), size):
        msg = f"sky must be a colour (3,), a picture {shape_text(size)} or a sky, got {shape_text(pixels.shape)}"
        raise ValueError(msg)
    if not (np.abs(pixels) <= 1e30).all():
        msg = "sky must be finite and at most 1e30 in magnitude, got NaN, infinity or more"
        raise ValueError(msg)
    return np.ascontiguousarray(np.broadcast_to(pixels, size), dtype=np.float32)


def _march(
    cloud: Volume, camera: Camera, sun: Sun, sigmas: list[float], method: str, progress: Progress, what: str
) -> tuple[NDArray[np.float32], ...]:
    callback, close = reporter(progress, what)
    try:
        depth, distance, cosine, scattered = _core.clouds_march(
            cloud.density,
            cloud.density.shape,
            cloud.voxel_size,
            cloud.origin,
            camera,
            sun.direction,
            sigmas,
            method,
            callback,
        )
    finally:
        close()
    size = (camera.height, camera.width)
    return depth.reshape(size), distance.reshape(size), cosine.reshape(size), scattered.reshape(-1, *size)


def haze_distance(distance: NDArray[np.float32], conventions: Conventions) -> NDArray[np.float32] | None:
    """Return t_c of eq 3 for each pixel, or None where it is 1 everywhere."""
    if conventions.haze == "unit":
        return None
    seen = distance[np.isfinite(distance)]
    return distance / np.float32(seen.mean() if seen.size else 1.0)


def _compose(
    parts: tuple[NDArray[np.float32], ...],
    nodes: list[float],
    params: Params,
    sky: NDArray[np.float32],
    conventions: Conventions,
) -> CloudImage:
    depth, distance, cosine, scattered = parts
    rgb, single = np.empty((*depth.shape, 3), np.float32), np.empty((*depth.shape, 3), np.float32)
    transmittance = np.empty(depth.shape, np.float32)
    far = haze_distance(distance, conventions)
    _core.clouds_compose(
        depth, cosine, scattered, nodes, sky, far, params, conventions.words, rgb, single, transmittance
    )
    return CloudImage(rgb, single, np.zeros_like(single), transmittance, distance)


def render(
    cloud: Volume,
    params: Params,
    camera: Camera,
    sun: Sun,
    *,
    sky: Any = None,
    orders: int = 1,
    method: str = "fast",
    conventions: Conventions | None = None,
    progress: Progress = None,
) -> CloudImage:
    """Render a cloud in front of a sky (eqs 3-5 and 9).

    Parameters
    ----------
    cloud : Volume
        The density.
    params : Params
        The light and the particles.
    camera : Camera
        From where.
    sun : Sun
        Direction of the light.
    sky : array_like (3,) or (height, width, 3), optional
        Linear light behind the cloud; black where it is not given.
    orders : int
        Orders of scattering; 1 is single scattering [1].
    method : {"fast", "reference"}
        Tabulated, or adaptive quadrature in float64 with exact legs (slow: the oracle of the tests).
    conventions : Conventions, optional
        Readings of the paper.
    progress : None, True or callable
        `progress(done, total)`; True shows a tqdm bar.

    Returns
    -------
    CloudImage
        The picture and its parts.

    Raises
    ------
    ValueError, TypeError
        An argument is out of range or of the wrong shape.

    Examples
    --------
    >>> from pleinair import Camera, Sun
    >>> cloud = Volume(np.ones((4, 4, 4)), 25.0)
    >>> camera = Camera.look_at((-300, 50, 50), (50, 50, 50), 32, 24, fov=30)
    >>> image = render(cloud, Params(sigma_t=0.02), camera, Sun(45, 180), sky=(0.2, 0.4, 0.8))
    >>> image.rgb.shape, float(image.transmittance[0, 0])
    ((24, 32, 3), 1.0)
    """
    _orders(orders)
    choice(method, "method", ("fast", "reference"))
    conventions = instance(Conventions() if conventions is None else conventions, "conventions", Conventions)
    _scene(cloud, camera, sun)
    instance(params, "params", Params)
    background = sky_pixels(sky, camera)
    parts = _march(cloud, camera, sun, [params.sigma_t], method, progress, "cloud")
    return _compose(parts, [params.sigma_t], params, background, conventions)


@dataclass(frozen=True, eq=False)
class Basis:
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

    @classmethod
    def precompute(
        cls,
        cloud: Volume,
        camera: Camera,
        sun: Sun,
        *,
        sigma_t: ArrayLike | None = None,
        orders: int = 1,
        conventions: Conventions | None = None,
        progress: Progress = None,
    ) -> Basis:
        """March a cloud once for many extinctions.

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
        orders : int
            Orders of scattering; 1 is single scattering [1].
        conventions : Conventions, optional
            Readings of the paper.
        progress : None, True or callable
            `progress(done, total)`; True shows a tqdm bar.

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
        _orders(orders)
        conventions = instance(Conventions() if conventions is None else conventions, "conventions", Conventions)
        _scene(cloud, camera, sun)
        if sigma_t is None:
            deepest = float(_march(cloud, camera, sun, [], "fast", None, "")[0].max())
            if not deepest > 0:
                msg = "camera does not see the cloud: no ray meets any density"
                raise ValueError(msg)
            if conventions.interpolation == "linear":
                nodes = np.linspace(0.0, 64.0 / deepest, 11)
            else:
                nodes = 2.0 ** np.arange(-3, 6.01, 0.5) / deepest
        else:
            nodes = array(sigma_t, "sigma_t", dtypes=(np.float64,), ndim=1)
            if nodes.size == 0 or not np.isfinite(nodes).all() or (np.diff(nodes) <= 0).any() or nodes[0] < 0:
                msg = f"sigma_t must ascend from at least 0 [1/m], got {nodes.tolist()}"
                raise ValueError(msg)
            if conventions.interpolation == "cubic" and nodes[0] <= 0:
                msg = "sigma_t must be above 0 [1/m] for interpolation in log σ; use conventions with 'linear'"
                raise ValueError(msg)
        depth, distance, cosine, scattered = _march(cloud, camera, sun, nodes.tolist(), "fast", progress, "basis")
        return cls(depth, distance, cosine, nodes, scattered, camera, sun, conventions)

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
        return _compose(parts, self.sigma_t.tolist(), params, sky_pixels(sky, self.camera), self.conventions)

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
        return sum(a.nbytes for a in (self.depth, self.distance, self.cosine, self.scattered))

    def save(self, path: io.PathLike) -> Path:
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
        }
        images = {n: getattr(self, n) for n in ("depth", "distance", "cosine", "sigma_t", "scattered")}
        return io.write_arrays(path, "basis/1", {**images, "about": np.array(json.dumps(about))})

    @classmethod
    def load(cls, path: io.PathLike) -> Basis:
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
        stored = io.read_arrays(path, "basis/1")
        try:
            about = json.loads(str(stored["about"]))
            camera = Camera(**{**about["camera"], "position": tuple(about["camera"]["position"])})
            basis = cls(
                stored["depth"],
                stored["distance"],
                stored["cosine"],
                stored["sigma_t"],
                stored["scattered"],
                camera,
                Sun(**about["sun"]),
                Conventions(**about["conventions"]),
            )
            size = (camera.height, camera.width)
            if basis.depth.shape != size or basis.scattered.shape != (basis.sigma_t.size, *size):
                raise ValueError("its images differ in size")
        except (KeyError, TypeError, ValueError) as error:
            msg = f"{path} is damaged: {error}"
            raise ValueError(msg) from None
        return basis

    def __repr__(self) -> str:
        height, width = self.depth.shape
        low, high = self.sigma_t[0], self.sigma_t[-1]
        return f"Basis({width}x{height}, {self.sigma_t.size} extinctions in [{low:.3g}, {high:.3g}] 1/m)"

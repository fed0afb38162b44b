# Written by hand and checked against the built module by `mypy.stubtest` (make check).
# Users see the typed modules beside this file; arrays arrive here contiguous and of the right dtype.
from collections.abc import Callable, Sequence
from typing import Any, Self, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float32] | NDArray[np.float64]
_Matrix: TypeAlias = list[list[float]]
_Progress: TypeAlias = Callable[[int, int], object] | None

__all__ = [
    "PREETHAM_TURBIDITY",
    "CloudObjective",
    "PaintPalette",
    "PictureEncoding",
    "Search",
    "SkyAtmosphere",
    "SkyModel",
    "TreeSkeleton",
    "_spin",
    "astro_catalogue",
    "astro_earth_shadow",
    "astro_geocentric",
    "astro_irradiance",
    "astro_magnitude",
    "astro_milky_way",
    "astro_moon",
    "astro_moonlight",
    "astro_planets",
    "astro_seen",
    "astro_sidereal",
    "astro_standard_air",
    "astro_star_colors",
    "astro_stars",
    "astro_sun",
    "astro_temperature",
    "astro_zodiacal",
    "build_info",
    "camera_axes",
    "camera_directions",
    "classify_sky",
    "clouds_check",
    "clouds_compose",
    "clouds_factors",
    "clouds_fit_nodes",
    "clouds_guided_filter",
    "clouds_haze",
    "clouds_higher_orders",
    "clouds_march",
    "clouds_multiply",
    "clouds_node_light",
    "clouds_procedural",
    "clouds_simulated",
    "color_constants",
    "color_inverse",
    "color_transform",
    "fit_histogram",
    "fit_mean",
    "force_simd_level",
    "get_num_threads",
    "grain_add",
    "grain_deviation",
    "ground_mask",
    "histogram_counts",
    "histogram_edges",
    "hsv_to_rgb",
    "image_blur",
    "image_resize",
    "image_warp",
    "into_gamut",
    "lab_to_rgb",
    "laplace_fill",
    "luminance",
    "mask_dilate",
    "openvdb_grids",
    "openvdb_read",
    "otsu_threshold",
    "paint_composite",
    "paint_light_view",
    "paint_light_visibility",
    "paint_lod",
    "paint_mask",
    "paint_noise",
    "paint_over",
    "paint_shade",
    "paint_simplification_order",
    "paint_size_compensation",
    "picture_decode",
    "picture_limits",
    "pigment_mix",
    "plants_blend",
    "plants_by_area",
    "plants_carry",
    "plants_grid_faces",
    "plants_leaf_attributes",
    "plants_normals",
    "plants_nurbs",
    "plants_on_grid",
    "plants_scatter",
    "plants_square",
    "plants_subdivide",
    "rgb_to_hsv",
    "rgb_to_lab",
    "rgbe_decode",
    "rgbe_encode",
    "scene_air",
    "scene_cloud",
    "scene_dome",
    "scene_extinction",
    "scene_in_view",
    "scene_irradiance",
    "scene_project",
    "scene_radiance",
    "set_num_threads",
    "simd_level",
    "simd_levels",
    "sky_behind",
    "sky_dome_points",
    "srgb_decode",
    "srgb_encode",
    "tone_colors",
    "tone_display",
    "tone_dither",
    "tone_levels",
    "tone_log_average",
    "tone_oneil",
    "tone_out_of_gamut",
    "tone_present",
    "tone_reproduce",
    "tone_scotopic",
    "tone_show",
    "tone_values",
    "volume_even_levels",
    "weather_depth",
    "weather_drop_speed",
    "weather_fall",
    "weather_index",
    "weather_lay_snow",
    "weather_phase",
    "weather_sky_view",
    "weather_snow_cover",
    "weather_table",
    "weather_veil",
    "xyy_to_xyz",
    "xyz_to_xyy",
]

# house
def simd_levels() -> list[str]: ...
def simd_level() -> str: ...
def force_simd_level(level: str | None) -> None: ...
def build_info() -> list[tuple[str, str]]: ...
def get_num_threads() -> int: ...
def set_num_threads(threads: int | None) -> None: ...
def _spin(steps: int, milliseconds: int, progress: _Progress = None) -> int: ...

# astro
_Place: TypeAlias = tuple[float, float, float]

def astro_sun(unix: float, place: _Place, refractivity: float | None) -> tuple[float, float, float]: ...
def astro_planets(unix: float, place: _Place, refractivity: float | None) -> list[list[float]]: ...
def astro_standard_air(altitude: float) -> tuple[float, float]: ...
def astro_moon(unix: float, place: _Place, refractivity: float | None) -> list[float]: ...
def astro_geocentric(unix: float) -> list[list[float]]: ...
def astro_earth_shadow(unix: float, place: _Place) -> tuple[float, list[float], float, float]: ...
def astro_moonlight(phase: float, distance: float, sun_distance: float, wang: bool) -> list[float]: ...
def astro_sidereal(unix: float, place: _Place) -> float: ...
def astro_stars(
    unix: float, place: _Place, refractivity: float | None, limit: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
def astro_catalogue() -> NDArray[np.float64]: ...
def astro_seen(
    unix: float,
    place: _Place,
    refractivity: float | None,
    directions: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None: ...
def astro_irradiance(magnitude: NDArray[np.float64], out: NDArray[np.float64]) -> None: ...
def astro_magnitude(irradiance: NDArray[np.float64], out: NDArray[np.float64]) -> None: ...
def astro_temperature(b_v: NDArray[np.float64], out: NDArray[np.float64], wang: bool) -> None: ...
def astro_star_colors(temperature: NDArray[np.float64], out: NDArray[np.float64]) -> None: ...
def astro_milky_way(directions: NDArray[np.float64], out: NDArray[np.float64]) -> None: ...
def astro_zodiacal(longitude: NDArray[np.float64], latitude: NDArray[np.float64], out: NDArray[np.float64]) -> None: ...

# color
def srgb_encode(x: _Floats, out: _Floats) -> None: ...
def srgb_decode(x: _Floats, out: _Floats) -> None: ...
def rgb_to_hsv(rgb: _Floats, out: _Floats) -> None: ...
def hsv_to_rgb(hsv: _Floats, out: _Floats) -> None: ...
def color_transform(x: _Floats, out: _Floats, matrix: _Matrix) -> None: ...
def color_inverse(matrix: _Matrix) -> _Matrix: ...
def color_constants() -> tuple[_Matrix, _Matrix, list[float]]: ...
def pigment_mix(
    a: NDArray[np.float64], b: NDArray[np.float64], amount: NDArray[np.float64], out: NDArray[np.float64]
) -> None: ...
def into_gamut(rgb: _Floats, out: _Floats) -> None: ...
def luminance(rgb: _Floats, out: _Floats, weights: Sequence[float]) -> None: ...
def xyz_to_xyy(xyz: _Floats, out: _Floats, white: Sequence[float] | None) -> None: ...
def xyy_to_xyz(xyy: _Floats, out: _Floats) -> None: ...
def rgb_to_lab(rgb: _Floats, out: _Floats, matrix: _Matrix, white: Sequence[float] | None, encoded: bool) -> None: ...
def lab_to_rgb(lab: _Floats, out: _Floats, matrix: _Matrix, white: Sequence[float] | None, encoded: bool) -> None: ...

# image

def picture_limits(picture: NDArray[np.float32]) -> tuple[bool, float, float]: ...
def rgbe_encode(picture: NDArray[np.float32], width: int) -> NDArray[np.uint8]: ...
def rgbe_decode(body: bytes, size: tuple[int, int], scale: tuple[float, float, float]) -> NDArray[np.float32]: ...
def openvdb_grids(data: bytes) -> tuple[list[tuple[str, str, str, str, str]], int]: ...
def openvdb_read(
    data: bytes, grid: int, y_up: bool, max_voxels: int
) -> tuple[NDArray[np.float32], list[int], list[float], list[float], float]: ...
def volume_even_levels(
    field: NDArray[np.float64],
    shape: tuple[int, int, int],
    faces: NDArray[np.float64],
    low: float,
    step: float,
    count: int,
) -> NDArray[np.float32]: ...
def picture_decode(data: bytes, most: int) -> tuple[NDArray[Any], dict[str, Any]]: ...

@final
class PictureEncoding:
    @staticmethod
    def srgb() -> PictureEncoding: ...
    @staticmethod
    def linear_light() -> PictureEncoding: ...
    @staticmethod
    def icc(profile: bytes) -> PictureEncoding: ...
    @staticmethod
    def cicp(points: tuple[int, int, int, int]) -> PictureEncoding: ...
    @staticmethod
    def power(gamma: float, chromaticities: Sequence[Sequence[float]] | None = None) -> PictureEncoding: ...
    def linear(
        self, samples: NDArray[Any], channels: int, stride: int, white: float, out: NDArray[np.float32]
    ) -> None: ...

def mask_dilate(mask: NDArray[np.bool_], size: tuple[int, ...], radius: int) -> NDArray[np.bool_]: ...
def image_resize(
    picture: NDArray[np.float32], shape: tuple[int, ...], size: tuple[int, int], out: NDArray[np.float32]
) -> None: ...
def image_blur(picture: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]: ...
def image_warp(
    picture: NDArray[np.float32],
    shape: tuple[int, ...],
    size: tuple[int, int],
    scale: float,
    middle: tuple[float, float],
    to: tuple[float, float],
    outside: float,
) -> NDArray[np.float32]: ...
def sky_behind(
    photo: NDArray[np.float32],
    shape: tuple[int, ...],
    covered: NDArray[np.bool_],
    feature: NDArray[np.float32],
    margin: int,
) -> NDArray[np.float32] | None: ...

_Pixels: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32] | NDArray[np.float64]
_Counts: TypeAlias = NDArray[np.uint64]

def histogram_edges(bins: int, low: float, high: float) -> NDArray[np.float64]: ...
def histogram_counts(
    img: _Pixels, channels: int, bins: int, low: float, high: float, mask: NDArray[np.bool_] | None
) -> tuple[_Counts, _Counts, _Counts, _Counts]: ...
def otsu_threshold(img: _Pixels, mask: NDArray[np.bool_] | None, nbins: int | None) -> tuple[float, float]: ...
def laplace_fill(
    img: _Pixels,
    shape: tuple[int, int, int],
    mask: NDArray[np.bool_],
    outside: list[float] | None,
    tolerance: float,
) -> NDArray[Any]: ...
def ground_mask(photo: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.bool_]: ...
def classify_sky(
    photo: NDArray[np.float32], shape: tuple[int, int], ground: NDArray[np.bool_], method: str, prior: float
) -> tuple[
    NDArray[np.bool_], NDArray[np.float32], tuple[float, bool], float, tuple[float, float], tuple[str, float]
]: ...

# clouds
def camera_axes(camera: Any) -> list[list[float]]: ...
def camera_directions(camera: object, out: NDArray[np.float64]) -> None: ...
def clouds_procedural(
    kind: str, shape: tuple[int, int, int], key: int, progress: _Progress = None
) -> NDArray[np.float32]: ...
def clouds_simulated(
    weather: object, progress: _Progress = None
) -> tuple[list[NDArray[np.float32]], list[int], list[NDArray[np.float32]]]: ...
def clouds_check(
    density: NDArray[np.float32],
    shape: tuple[int, int, int],
    voxel: tuple[float, float, float],
    origin: tuple[float, float, float],
) -> None: ...
def clouds_march(
    density: NDArray[np.float32],
    shape: tuple[int, int, int],
    voxel: tuple[float, float, float],
    origin: tuple[float, float, float],
    camera: object,
    sun: tuple[float, float, float],
    sigmas: list[float],
    method: str,
    paths: object | None = None,
    progress: _Progress = None,
) -> tuple[
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    tuple[NDArray[np.uint32], NDArray[np.float32]] | None,
]: ...
def clouds_guided_filter(
    images: NDArray[np.float32],
    pixels: NDArray[np.uint32],
    width: int,
    guides: NDArray[np.float32],
    light: list[float],
    progress: _Progress = None,
) -> list[float]: ...
def clouds_node_light(
    scattered: NDArray[np.float32],
    sigma_t: list[float],
    cosine: NDArray[np.float32],
    pixels: NDArray[np.uint32],
    multiple: NDArray[np.float32],
    g: list[float],
    extinctions: list[float],
) -> list[float]: ...
def clouds_fit_nodes(
    multiple: NDArray[np.float32], g: list[float], extinctions: list[float], error: list[float]
) -> None: ...
def clouds_factors(
    multiple: NDArray[np.float32], light: list[float] | None, nodes: tuple[int, int]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...
def clouds_multiply(
    coefficients: NDArray[np.float32], components: NDArray[np.float32], rank: int, multiple: NDArray[np.float32]
) -> None: ...
def clouds_higher_orders(
    nodes: tuple[list[float], list[float], list[float]],
    at: tuple[float, float, float],
    conventions: tuple[str, str, str],
    multiple: NDArray[np.float32],
) -> NDArray[np.float32]: ...
def clouds_haze(
    distance: NDArray[np.float32], camera: object, sun: tuple[float, float, float], scale_height: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...
def clouds_compose(
    depth: NDArray[np.float32],
    cosine: NDArray[np.float32],
    scattered: NDArray[np.float32],
    nodes: list[float],
    multiple: NDArray[np.float32] | None,
    sky: NDArray[np.float32],
    haze_distance: NDArray[np.float32] | None,
    light_path: NDArray[np.float32] | None,
    params: object,
    conventions: tuple[str, str, str],
    rgb: NDArray[np.float32],
    single: NDArray[np.float32],
    transmittance: NDArray[np.float32],
) -> None: ...

# fit
@final
class Search:
    def __new__(cls, settings: object) -> Self: ...
    def ask(self) -> list[list[float]]: ...
    def tell(self, values: list[float]) -> bool: ...
    def calls(self) -> int: ...
    def spread(self, within: float) -> list[float]: ...
    def outcome(self) -> tuple[list[tuple[list[float], float]], list[tuple[float, float, int]], str]: ...

@final
class CloudObjective:
    def __new__(
        cls,
        depth: NDArray[np.float32],
        cosine: NDArray[np.float32],
        scattered: NDArray[np.float32],
        nodes: list[float],
        sky: NDArray[np.float32],
        haze_distance: NDArray[np.float32] | None,
        color: tuple[float, float, float],
        histogram: NDArray[np.float64],
        haze: list[float],
        conventions: tuple[str, str, str],
        orders: tuple[tuple[list[float], list[float], list[float]], NDArray[np.float32], NDArray[np.float32]]
        | None = None,
        light_path: NDArray[np.float32] | None = None,
        ambient_color: tuple[float, float, float] | None = None,
        opacity: bool = False,
    ) -> Self: ...
    def pixels(self) -> int: ...
    def evaluate(self, population: list[tuple[float, ...]]) -> NDArray[np.float64]: ...
    def noise_floor(self, key: int) -> float: ...
    def histograms(self, gene: tuple[float, ...]) -> NDArray[np.uint32] | None: ...
    def intervals(self, settings: object, best: float, floor: float, level: float) -> list[tuple[float, float]]: ...
    def search(
        self, settings: object, progress: _Progress = None
    ) -> tuple[list[tuple[list[float], float]], list[tuple[float, float, int]], str, float, list[float]]: ...

def fit_mean(rgb: NDArray[np.float32], mask: NDArray[np.bool_]) -> tuple[float, float, float]: ...
def fit_histogram(rgb: NDArray[np.float32], mask: NDArray[np.bool_], bins: int) -> NDArray[np.float64]: ...
def grain_deviation(
    rgb: NDArray[np.float32], size: tuple[int, ...], clear: NDArray[np.bool_]
) -> tuple[float, float, float]: ...
def grain_add(rgb: NDArray[np.float32], deviation: Sequence[float], key: int) -> NDArray[np.float32]: ...

# sky
@final
class SkyAtmosphere:
    def __new__(cls, air: Any) -> Self: ...
    @property
    def orders(self) -> int: ...

PREETHAM_TURBIDITY: tuple[float, float]

@final
class SkyModel:
    @staticmethod
    def aoas(settings: Any) -> SkyModel: ...
    @staticmethod
    def physical(
        atmosphere: SkyAtmosphere,
        sun: Sequence[float],
        intensity: float,
        altitude: float,
        disc: float,
        overcast: Any,
        tolerance: float,
    ) -> SkyModel: ...
    @staticmethod
    def cie_general(
        kind: int,
        sun: Sequence[float],
        zenith_luminance: float,
        chromaticity: Sequence[float],
        turbidity: float | None,
        sun_illuminance: float,
    ) -> SkyModel: ...
    @staticmethod
    def preetham(sun: Sequence[float], turbidity: float, air: Any, intensity: float) -> SkyModel: ...
    @staticmethod
    def natural(
        atmosphere: SkyAtmosphere,
        scene: Any,
        stars: NDArray[np.float64],
        starlight: NDArray[np.float64],
        tolerance: float,
    ) -> SkyModel: ...
    def render(self, camera: Any, out: NDArray[np.float32], progress: _Progress = None) -> None: ...
    def show(
        self,
        camera: Any,
        out: NDArray[np.uint8],
        adaptation: float,
        display: tuple[float, float, float],
        night: bool,
        progress: _Progress = None,
    ) -> None: ...
    def panorama(self, height: int, out: NDArray[np.float32], progress: _Progress = None) -> None: ...
    def radiance(
        self, directions: NDArray[np.float64], out: NDArray[np.float32], progress: _Progress = None
    ) -> None: ...
    def reference(
        self, directions: NDArray[np.float64], out: NDArray[np.float64], progress: _Progress = None
    ) -> None: ...
    def monte_carlo(
        self,
        directions: NDArray[np.float64],
        paths: int,
        key: int,
        out: NDArray[np.float64],
        progress: _Progress = None,
    ) -> None: ...
    def irradiance(
        self, axis: Sequence[float], normals: NDArray[np.float64], out: NDArray[np.float64]
    ) -> list[list[float]]: ...
    def direct_irradiance(self, radius: float) -> list[float]: ...
    @property
    def components(self) -> list[str]: ...
    @property
    def moonlight(self) -> tuple[list[float], list[float]] | None: ...
    @property
    def table_size(self) -> list[int] | None: ...

def sky_dome_points(viewer: Sequence[float], directions: NDArray[np.float64], out: NDArray[np.float64]) -> None: ...

# paint
@final
class PaintPalette:
    def __new__(cls, shader: Any) -> Self: ...
    def colors(self, lightness: Sequence[float]) -> list[tuple[list[float], float]]: ...

def paint_composite(
    sprites: Any,
    slab: bool,
    delta: float | NDArray[np.float64],
    size: Sequence[int],
    rgb: NDArray[np.float32],
    transmittance: NDArray[np.float32],
    id_depth: tuple[NDArray[np.float32], NDArray[np.int64]] | None,
    exact: bool,
    progress: _Progress = None,
) -> None: ...
def paint_over(
    rgb: NDArray[np.float32], transmittance: NDArray[np.float32], behind: NDArray[np.float32], out: NDArray[np.float32]
) -> None: ...
def paint_mask(shape: Any, at: NDArray[np.float64], out: NDArray[np.float64]) -> None: ...
def paint_noise(label: int, at: NDArray[np.float64], out: NDArray[np.float64]) -> None: ...
def paint_shade(
    strokes: Any,
    shader: Any,
    palette: PaintPalette,
    camera: Any,
    rows: NDArray[np.float32],
    depth: NDArray[np.float64],
) -> None: ...
def paint_lod(strokes: Any, shader: Any, palette: PaintPalette, camera: Any, out: NDArray[np.float32]) -> None: ...
def paint_size_compensation(
    strokes: Any,
    shader: Any,
    palette: PaintPalette,
    shadows: bool,
    knots: int,
    pixels: int,
    progress: _Progress = None,
) -> list[float]: ...
def paint_simplification_order(
    strokes: Any, shader: Any, palette: PaintPalette, outer: float, pixels: int, progress: _Progress = None
) -> list[int]: ...
def paint_light_view(
    position: NDArray[np.float64], size: NDArray[np.float32], to: Sequence[float], pixels: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]]: ...
def paint_light_visibility(
    sprites: Any, casts: NDArray[np.float32] | None, pixels: int, out: NDArray[np.float32], progress: _Progress = None
) -> None: ...

# tone
def tone_oneil(light: NDArray[np.float32], out: NDArray[np.float32], exposure: float) -> None: ...
def tone_levels(light: NDArray[np.float32], out: NDArray[np.uint8]) -> None: ...
def tone_dither(light: NDArray[np.float32], out: NDArray[np.uint8], shape: tuple[int, int]) -> None: ...
def tone_present(
    light: NDArray[np.float32],
    out: NDArray[np.float32],
    width: int,
    adaptation: float,
    exposure: float,
    white: float | None,
    night: bool,
    pixel: float | None,
) -> None: ...
def tone_values(rgb: NDArray[np.float32], share: NDArray[np.float32], stops: tuple[float, float]) -> None: ...
def tone_colors(
    rgb: NDArray[np.float32], saturation: float, shadows: tuple[float, float, float], tint: float
) -> None: ...
def tone_log_average(light: NDArray[np.float32]) -> float: ...
def tone_reproduce(
    light: NDArray[np.float32], out: NDArray[np.float32], adaptation: float, display: Sequence[float]
) -> None: ...
def tone_scotopic(light: NDArray[np.float32], out: NDArray[np.float32]) -> None: ...
def tone_show(
    light: NDArray[np.float32], out: NDArray[np.uint8], adaptation: float, display: Sequence[float], night: bool
) -> None: ...
def tone_display(
    luminance: NDArray[np.float64],
    out: NDArray[np.float64],
    adaptation: float,
    display: Sequence[float],
    as_fraction: bool,
) -> None: ...
def tone_out_of_gamut(light: NDArray[np.float32]) -> list[int]: ...

# plants
_F32: TypeAlias = NDArray[np.float32]
_F64: TypeAlias = NDArray[np.float64]
_U32: TypeAlias = NDArray[np.uint32]

@final
class TreeSkeleton:
    def __new__(
        cls, trunk: object, branches: Sequence[object], unit: float, trunk_key: int, branch_key: int
    ) -> Self: ...
    @staticmethod
    def from_lines(lines: Sequence[tuple[int, Any, Any]], unit: float) -> TreeSkeleton: ...
    def mesh(self, level: int, subdivisions: int) -> tuple[_F64, _U32, _F64, _U32, _F32, _F32]: ...
    def stems(self) -> _U32: ...
    def rings(self) -> tuple[_F64, _F64, _F64, _F64]: ...
    def leaves(
        self, params: object, key: int
    ) -> tuple[_F64, _F64, _F32, NDArray[np.uint16], _U32, _U32, NDArray[np.int64]]: ...

def plants_leaf_attributes(
    position: _F64, branch_distance: _F32, id: NDArray[np.int64], params: object, unit: float
) -> tuple[tuple[float, float, float], _F32, _F32, _F32, _F32, _F32]: ...
def plants_square(quad: Sequence[Sequence[float]]) -> list[list[float]] | None: ...
def plants_subdivide(vertices: _F64, quads: _U32, levels: int) -> tuple[_F64, _U32, _F64]: ...
def plants_grid_faces(rows: int, columns: int) -> _U32: ...
def plants_normals(vertices: _F64, faces: _U32) -> _F64: ...
def plants_scatter(params: object, key: int) -> tuple[_F64, _F64, _F64, _F32, _F32, _U32]: ...
def plants_on_grid(uv: _F64, rows: int, columns: int) -> tuple[_U32, _F64]: ...
def plants_by_area(uv: _F64, spans: tuple[int, int], vertices: _F64, faces: _U32) -> tuple[_U32, _F64]: ...
def plants_carry(
    vertices: _F64, normals: _F64, faces: _U32, face: _U32, barycentric: _F64, height: _F64, displacement: float
) -> tuple[_F64, _F64]: ...
def plants_nurbs(
    points: _F64,
    weights: _F64,
    count: tuple[int, int],
    degree: tuple[int, int],
    knots: tuple[list[float], list[float]],
    uv: _F64,
    height: _F64,
    displacement: float,
) -> tuple[_F64, _F64]: ...
def plants_blend(normals: _F64, random: _F64, weight: float) -> _F64: ...

# scene
def scene_dome(axis: tuple[float, float, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def scene_project(
    to: NDArray[np.float64], solid: NDArray[np.float64], light: NDArray[np.float32]
) -> list[list[float]]: ...
def scene_irradiance(
    lamps: Any,
    sky: Any,
    ground: Any,
    normals: NDArray[np.float32],
    visible: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None: ...
def scene_radiance(
    colors: NDArray[np.float32],
    variation: NDArray[np.float32],
    irradiance: NDArray[np.float32],
    middle: float,
    own: float,
) -> None: ...
def scene_extinction(pressure: float, beta: float, alpha: float, scale: Any) -> list[list[float]]: ...
def scene_air(
    extinction: Any,
    scale: Any,
    horizon: Any,
    eye: Any,
    places: NDArray[np.float64],
    colors: NDArray[np.float32],
    variation: NDArray[np.float32],
) -> None: ...
def scene_cloud(
    camera: Any,
    rgb: NDArray[np.float32],
    transmittance: NDArray[np.float32],
    distance: NDArray[np.float32],
    eye: Any,
    directions: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None: ...
def scene_in_view(
    camera: Any,
    position: NDArray[np.float64],
    size: NDArray[np.float32],
    growth: float,
    window: tuple[float, float, float, float],
    mirror: float | None,
) -> NDArray[np.int64]: ...
def weather_index(wavelength: float) -> float: ...
def weather_phase(
    angles: list[float], radii: Any, weights: Any, wavelengths: list[float], disc: float
) -> NDArray[np.float64]: ...
def weather_table(count: int, radii: Any, weights: Any, color: Any, disc: float) -> NDArray[np.float32]: ...
def weather_veil(
    kind: str,
    numbers: list[float],
    seed: int,
    extinction: float,
    lamps: Any,
    ambient: Any,
    eye: Any,
    rays: NDArray[np.float64],
    endless: bool,
    lit: NDArray[np.float32],
    colors: NDArray[np.float32],
    variation: NDArray[np.float32],
) -> None: ...
def weather_depth(
    kind: str, numbers: list[float], seed: int, extinction: float, eye: Any, to: Any, distance: list[float]
) -> NDArray[np.float64]: ...
def weather_drop_speed(diameter: float) -> float: ...
def weather_fall(
    flakes: bool,
    count: int,
    sizes: Any,
    reach: float,
    wind: Any,
    exposure: float,
    time: float,
    color: Any,
    seed: int,
    eye: Any,
    axes: Any,
    focal: float,
    size: Any,
    picture: NDArray[np.float32],
) -> None: ...
def weather_sky_view(heights: NDArray[np.float64], width: int, spacing: float) -> NDArray[np.float64]: ...
def weather_snow_cover(up: float, sky_view: float, amount: float) -> float: ...
def weather_lay_snow(
    up: NDArray[np.float64],
    sky_view: NDArray[np.float32],
    amount: float,
    snow_light: NDArray[np.float32],
    colors: NDArray[np.float32],
    variation: NDArray[np.float32],
) -> None: ...

//! `_core`: what `pleinair.clouds` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use glam::DVec3;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::camera::Camera;
use super::run::{long, quick, to_py};
use crate::clouds::bases::{Ambient, BasisImages, CloudParams, Composed, Conventions, Interpolation, Phase, compose};
use crate::clouds::denoise::{self, Guide};
use crate::clouds::density::Grid;
use crate::clouds::haze;
use crate::clouds::low_rank::{self, SingleImages};
use crate::clouds::march::{MarchMethod, march, march_with};
use crate::clouds::multiple::{EstimatorSettings, sample_multiple};
use crate::clouds::orders::BasisNodes;
use crate::clouds::procedural::{self, Kind};
use crate::clouds::simulated;
use crate::clouds::sun::SunOpticalDepth;

/// `pleinair.clouds.Params`.
#[derive(FromPyObject)]
pub(crate) struct Params {
    light_intensity: f64,
    light_color: [f64; 3],
    g: f64,
    sigma_t: f64,
    albedo: f64,
    ambient: f64,
    ambient_color: Option<[f64; 3]>,
    haze: [f64; 3],
}

impl Params {
    fn core(&self) -> CloudParams {
        CloudParams {
            intensity: self.light_intensity,
            color: self.light_color,
            g: self.g,
            sigma: self.sigma_t,
            albedo: self.albedo,
            ambient: self.ambient,
            ambient_color: self.ambient_color.unwrap_or(self.light_color),
            haze: self.haze,
        }
    }
}

/// Conventions from the words of the Python face.
pub(crate) fn conventions((ambient, phase, interpolation): (&str, &str, &str)) -> PyResult<Conventions> {
    Ok(Conventions {
        ambient: match ambient {
            "extinction" => Ambient::Extinction,
            "paper" => Ambient::Paper,
            other => return Err(PyValueError::new_err(format!("unknown ambient {other:?}"))),
        },
        phase: match phase {
            "mean-one" => Phase::MeanOne,
            "integral-one" => Phase::IntegralOne,
            other => return Err(PyValueError::new_err(format!("unknown phase {other:?}"))),
        },
        interpolation: match interpolation {
            "cubic" => Interpolation::Cubic,
            "linear" => Interpolation::Linear,
            other => return Err(PyValueError::new_err(format!("unknown interpolation {other:?}"))),
        },
    })
}

type Image<'py> = Bound<'py, PyArray1<f32>>;
type Images<'py> = (Image<'py>, Image<'py>, Image<'py>, Image<'py>, Option<(Bound<'py, PyArray1<u32>>, Image<'py>)>);
/// Weights of orders 2, 3, ...: up to four (group, weight) each.
type OrderWeights = Vec<[(u16, f32); 4]>;

/// Density of a procedural cloud.
#[pyfunction]
#[pyo3(signature = (kind, shape, key, progress=None))]
fn clouds_procedural<'py>(
    py: Python<'py>,
    kind: &str,
    shape: [usize; 3],
    key: u64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let kind = Kind::named(kind).map_err(|e| to_py(&e))?;
    let [nz, ny, nx] = shape;
    let density = long(py, progress, |job| procedural::density(kind, [nx, ny, nz], key, job))?;
    Ok(density.into_pyarray(py))
}

/// What a simulation is told by `pleinair.clouds.simulated`.
#[derive(FromPyObject)]
struct Weather {
    shape: [usize; 3],
    voxel_size: [f64; 3],
    times: Vec<f64>,
    step: f64,
    surface_heat_flux: f64,
    radius: f64,
    perturbation: f64,
    temperature: f64,
    humidity: f64,
    lapse: f64,
    confinement: f64,
    key: u64,
    keep_all_fields: bool,
}

/// Droplets at each time with the steps taken, and the air at the last: water, temperature, velocities, divergence.
#[pyfunction]
#[pyo3(signature = (weather, progress=None))]
fn clouds_simulated<'py>(
    py: Python<'py>,
    weather: Weather,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Vec<Image<'py>>, Vec<u64>, Vec<Image<'py>>)> {
    let [nz, ny, nx] = weather.shape;
    let asked = simulated::SimulationSettings {
        size: [nx, ny, nz],
        voxel: weather.voxel_size,
        times: weather.times,
        step: weather.step,
        surface_heat_flux: weather.surface_heat_flux,
        radius: weather.radius,
        perturbation: weather.perturbation,
        temperature: weather.temperature,
        humidity: weather.humidity,
        lapse: weather.lapse,
        confinement: weather.confinement,
        key: weather.key,
        keep_all_fields: weather.keep_all_fields,
    };
    let seen = long(py, progress, |job| simulated::simulate(&asked, job))?;
    let (mut clouds, mut steps, mut air) = (Vec::new(), Vec::new(), Vec::new());
    for snapshot in seen {
        clouds.push(snapshot.cloud.into_pyarray(py));
        steps.push(snapshot.steps);
        if let Some(inside) = snapshot.air {
            let [u, v, w] = inside.velocity;
            let all = [inside.water, inside.temperature, u, v, w, inside.divergence];
            air = all.into_iter().map(|field| field.into_pyarray(py)).collect();
        }
    }
    Ok((clouds, steps, air))
}

/// Refuse a density that cannot be a cloud.
#[pyfunction]
fn clouds_check(
    py: Python<'_>,
    density: PyReadonlyArrayDyn<'_, f32>,
    shape: [usize; 3],
    voxel: [f64; 3],
    origin: [f64; 3],
) -> PyResult<()> {
    let data = slice(&density, "density")?;
    let [nz, ny, nx] = shape;
    quick(py, 0, |_| Grid::validate(data, [nx, ny, nz], DVec3::from(voxel), DVec3::from(origin)))
}

/// Images of depth, distance, cosine and single-scattered light; with `paths` also the pixels that see the cloud and
/// their images (group, g, sigma) of light scattered more than once.
#[pyfunction]
#[pyo3(signature = (density, shape, voxel, origin, camera, sun, sigmas, method, paths=None, progress=None))]
fn clouds_march<'py>(
    py: Python<'py>,
    density: PyReadonlyArrayDyn<'py, f32>,
    shape: [usize; 3],
    voxel: [f64; 3],
    origin: [f64; 3],
    camera: Camera,
    sun: [f64; 3],
    sigmas: Vec<f64>,
    method: &str,
    paths: Option<Paths>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Images<'py>> {
    let data = slice(&density, "density")?;
    let camera = camera.pinhole()?;
    let method = match method {
        "fast" => MarchMethod::Fast,
        "reference" => MarchMethod::Reference,
        other => return Err(PyValueError::new_err(format!("unknown method {other:?}"))),
    };
    let [nz, ny, nx] = shape;
    let settings = paths.map(|p| EstimatorSettings {
        g: p.g,
        sigma: p.sigma,
        groups: p.groups,
        order_weights: p.order_weights,
        unbounded_orders: p.unbounded_orders,
        albedo: p.albedo,
        reference: method == MarchMethod::Reference,
        samples: p.samples,
        key: p.key,
    });
    let (images, more) = long(py, progress, |job| {
        let grid = Grid::new(data, [nx, ny, nz], DVec3::from(voxel), DVec3::from(origin))?;
        let sun = DVec3::from(sun);
        let Some(settings) = &settings else { return Ok((march(&grid, &camera, sun, &sigmas, method, job)?, None)) };
        settings.validate()?;
        let table = SunOpticalDepth::new(&grid, sun, job)?;
        let exact = if method == MarchMethod::Fast { Some(&table) } else { None };
        let images = march_with(&grid, &camera, sun, &sigmas, exact, job)?;
        Ok((images, Some(sample_multiple(&grid, &camera, &table, settings, job)?)))
    })?;
    let more = more.map(|m| (m.pixels.into_pyarray(py), m.images.into_pyarray(py)));
    Ok((
        images.column_density.into_pyarray(py),
        images.first_hit_distance.into_pyarray(py),
        images.cosine.into_pyarray(py),
        images.single_scattering.into_pyarray(py),
        more,
    ))
}

/// What is to be known of higher orders, as attributes of a Python object.
#[derive(FromPyObject)]
struct Paths {
    g: Vec<f64>,
    sigma: Vec<f64>,
    groups: usize,
    order_weights: OrderWeights,
    unbounded_orders: bool,
    albedo: f64,
    samples: usize,
    key: u64,
}

/// Smooth `images` of `pixels`, one after the other, in place, guided by noiseless ones; returns their noise before.
#[pyfunction]
#[pyo3(signature = (images, pixels, width, guides, light, progress=None))]
fn clouds_guided_filter(
    py: Python<'_>,
    mut images: PyReadwriteArrayDyn<'_, f32>,
    pixels: PyReadonlyArrayDyn<'_, u32>,
    width: usize,
    guides: PyReadonlyArrayDyn<'_, f32>,
    light: Vec<f64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<f64>> {
    let images = slice_mut(&mut images, "images")?;
    let (pixels, guides) = (slice(&pixels, "pixels")?, slice(&guides, "guides")?);
    long(py, progress, |job| {
        let guides: Vec<&[f32]> = guides.chunks_exact(pixels.len().max(1)).collect();
        denoise::guided_filter(images, &Guide::new(pixels, width, &guides)?, &light, job)
    })
}

/// Root mean square of all light of each node (g, sigma_t) of a basis.
#[pyfunction]
fn clouds_node_light<'py>(
    py: Python<'py>,
    scattered: PyReadonlyArrayDyn<'py, f32>,
    sigma_t: Vec<f64>,
    cosine: PyReadonlyArrayDyn<'py, f32>,
    pixels: PyReadonlyArrayDyn<'py, u32>,
    multiple: PyReadonlyArrayDyn<'py, f32>,
    g: Vec<f64>,
    extinctions: Vec<f64>,
) -> PyResult<Vec<f64>> {
    let once = SingleImages {
        single_scattering: slice(&scattered, "scattered")?,
        sigma: &sigma_t,
        cosine: slice(&cosine, "cosine")?,
        pixels: slice(&pixels, "pixels")?,
    };
    let multiple = slice(&multiple, "multiple")?;
    long(py, None, |job| low_rank::node_light(&once, multiple, &g, &extinctions, job))
}

/// Fit polynomials across the nodes (g, sigma_t) to every pixel of the images of higher orders, in place.
#[pyfunction]
fn clouds_fit_nodes(
    py: Python<'_>,
    mut multiple: PyReadwriteArrayDyn<'_, f32>,
    g: Vec<f64>,
    extinctions: Vec<f64>,
    error: Vec<f64>,
) -> PyResult<()> {
    let multiple = slice_mut(&mut multiple, "multiple")?;
    long(py, None, |job| low_rank::fit_nodes(multiple, &g, &extinctions, &error, job))
}

/// The strongest components of images weighed by their light: coefficients `(rank, images)`, components
/// `(rank, pixels)`.
#[pyfunction]
fn clouds_factors<'py>(
    py: Python<'py>,
    multiple: PyReadonlyArrayDyn<'py, f32>,
    light: Option<Vec<f64>>,
    nodes: [usize; 2],
) -> PyResult<(Image<'py>, Image<'py>)> {
    let multiple = slice(&multiple, "multiple")?;
    let found = long(py, None, |job| {
        let light = light.unwrap_or_else(|| low_rank::total_light(multiple, nodes[0], nodes[1]));
        low_rank::factors(multiple, &light, job)
    })?;
    Ok((found.coefficients.into_pyarray(py), found.components.into_pyarray(py)))
}

/// Images from their coefficients and components, into `multiple`.
#[pyfunction]
fn clouds_multiply(
    py: Python<'_>,
    coefficients: PyReadonlyArrayDyn<'_, f32>,
    components: PyReadonlyArrayDyn<'_, f32>,
    rank: usize,
    mut multiple: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let (coefficients, components) = (slice(&coefficients, "coefficients")?, slice(&components, "components")?);
    let factors = low_rank::Factors { coefficients: coefficients.to_vec(), components: components.to_vec(), rank };
    let multiple = slice_mut(&mut multiple, "multiple")?;
    long(py, None, |job| factors.multiply(multiple, job))
}

/// Light of the orders from 2 on of a basis at (g, sigma_t, albedo), in each pixel that sees the cloud.
#[pyfunction]
fn clouds_higher_orders<'py>(
    py: Python<'py>,
    nodes: (Vec<f64>, Vec<f64>, Vec<f64>),
    at: [f64; 3],
    conventions: (String, String, String),
    multiple: PyReadonlyArrayDyn<'py, f32>,
) -> PyResult<Image<'py>> {
    let how = self::conventions((&conventions.0, &conventions.1, &conventions.2))?;
    let (g, sigma, exponents) = nodes;
    let orders = BasisNodes { g, sigma, exponents, coefficients: Vec::new() };
    let multiple = slice(&multiple, "multiple")?;
    let light = quick(py, multiple.len(), |job| {
        orders.validate()?;
        low_rank::weighted_sum(&orders.weights(at[0], at[1], at[2], how.interpolation)?, multiple, job)
    })?;
    Ok(light.into_pyarray(py))
}

/// Optical paths in air that thins out with height: from the eye, and from the Sun.
#[pyfunction]
fn clouds_haze<'py>(
    py: Python<'py>,
    distance: PyReadonlyArrayDyn<'py, f32>,
    camera: Camera,
    sun: [f64; 3],
    scale_height: f64,
) -> PyResult<(Image<'py>, Image<'py>)> {
    let distance = slice(&distance, "distance")?;
    let camera = camera.pinhole()?;
    let paths = quick(py, distance.len(), |_| haze::paths(&camera, distance, DVec3::from(sun), scale_height))?;
    Ok((paths.far.into_pyarray(py), paths.light.into_pyarray(py)))
}

/// Compose a picture into `rgb`, `single` and `transmittance`.
#[pyfunction]
#[pyo3(signature = (depth, cosine, scattered, nodes, multiple, sky, haze_distance, light_path, params, conventions, rgb, single, transmittance))]
fn clouds_compose(
    py: Python<'_>,
    depth: PyReadonlyArrayDyn<'_, f32>,
    cosine: PyReadonlyArrayDyn<'_, f32>,
    scattered: PyReadonlyArrayDyn<'_, f32>,
    nodes: Vec<f64>,
    multiple: Option<PyReadonlyArrayDyn<'_, f32>>,
    sky: PyReadonlyArrayDyn<'_, f32>,
    haze_distance: Option<PyReadonlyArrayDyn<'_, f32>>,
    light_path: Option<PyReadonlyArrayDyn<'_, f32>>,
    params: Params,
    conventions: (String, String, String),
    mut rgb: PyReadwriteArrayDyn<'_, f32>,
    mut single: PyReadwriteArrayDyn<'_, f32>,
    mut transmittance: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let how = self::conventions((&conventions.0, &conventions.1, &conventions.2))?;
    let haze_distance = haze_distance.as_ref().map(|a| slice(a, "haze_distance")).transpose()?;
    let light_path = light_path.as_ref().map(|a| slice(a, "light_path")).transpose()?;
    let parts = BasisImages {
        column_density: slice(&depth, "depth")?,
        cosine: slice(&cosine, "cosine")?,
        single_scattering: slice(&scattered, "scattered")?,
        nodes: &nodes,
        multiple: multiple.as_ref().map(|a| slice(a, "multiple")).transpose()?,
        sky: slice(&sky, "sky")?,
        haze_distance,
        light_path,
    };
    let params = params.core();
    let mut out = Composed {
        rgb: slice_mut(&mut rgb, "rgb")?,
        single: slice_mut(&mut single, "single")?,
        transmittance: slice_mut(&mut transmittance, "transmittance")?,
    };
    quick(py, parts.column_density.len(), |job| compose(&parts, &params, how, &mut out, job))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(clouds_procedural, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_simulated, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_check, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_march, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_guided_filter, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_node_light, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_fit_nodes, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_factors, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_multiply, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_higher_orders, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_haze, module)?)?;
    module.add_function(wrap_pyfunction!(clouds_compose, module)?)?;
    Ok(())
}

//! `_core`: what `pleinair.scene` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use glam::DVec3;
use numpy::{PyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::camera::Camera;
use super::run::{quick, sized, to_py};
use crate::scene::air::{self, Air};
use crate::scene::cloud::Impostor;
use crate::scene::culling;
use crate::scene::light::{self, Environment, HARMONICS, Lamp};

type Dome<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// Directions of the upper half sphere, densely around `axis`, and their solid angles.
#[pyfunction]
fn scene_dome(py: Python<'_>, axis: [f64; 3]) -> Dome<'_> {
    let (to, solid) = light::dome(DVec3::from_array(axis));
    (PyArray1::from_vec(py, to), PyArray1::from_vec(py, solid))
}

/// Coefficients of the irradiance by a sky of which `light` is seen in those directions.
#[pyfunction]
fn scene_project(
    to: PyReadonlyArrayDyn<'_, f64>,
    solid: PyReadonlyArrayDyn<'_, f64>,
    light: PyReadonlyArrayDyn<'_, f32>,
) -> PyResult<Vec<[f64; 3]>> {
    let (to, solid, light) = (slice(&to, "to")?, slice(&solid, "solid")?, slice(&light, "light")?);
    light::project(to, solid, light).map(|found| found.to_vec()).map_err(|e| to_py(&e))
}

/// Irradiance of planes: `lamps` are directions and irradiances.
#[pyfunction]
fn scene_irradiance(
    py: Python<'_>,
    lamps: Vec<([f64; 3], [f64; 3])>,
    sky: Vec<[f64; 3]>,
    ground: [f64; 3],
    normals: PyReadonlyArrayDyn<'_, f32>,
    visible: PyReadonlyArrayDyn<'_, f32>,
    mut out: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let (normals, visible) = (slice(&normals, "normals")?, slice(&visible, "visible")?);
    let out = slice_mut(&mut out, "out")?;
    let lamps = lamps.into_iter().map(|(to, irradiance)| Lamp { to, irradiance }).collect();
    let sky = <[[f64; 3]; HARMONICS]>::try_from(sky)
        .map_err(|got| PyValueError::new_err(format!("sky must have {HARMONICS} coefficients, got {}", got.len())))?;
    let world = Environment { lamps, sky, ground };
    sized(py, 20 * out.len(), |job| world.irradiance(job, normals, visible, out))
}

/// Make radiance of palette colours in place.
#[pyfunction]
fn scene_radiance(
    py: Python<'_>,
    mut colors: PyReadwriteArrayDyn<'_, f32>,
    mut variation: PyReadwriteArrayDyn<'_, f32>,
    irradiance: PyReadonlyArrayDyn<'_, f32>,
    middle: f64,
    own: f64,
) -> PyResult<()> {
    let (colors, variation) = (slice_mut(&mut colors, "colors")?, slice_mut(&mut variation, "variation")?);
    let irradiance = slice(&irradiance, "irradiance")?;
    quick(py, colors.len(), |job| light::radiance(job, colors, variation, irradiance, middle, own))
}

/// Extinction of molecules and aerosol in each channel [1/m].
#[pyfunction]
fn scene_extinction(pressure: f64, beta: f64, alpha: f64, scale: [f64; 2]) -> [[f64; 3]; 2] {
    air::extinction(pressure, beta, alpha, scale)
}

/// Put the air before colours at places, in place.
#[pyfunction]
fn scene_air(
    py: Python<'_>,
    extinction: [[f64; 3]; 2],
    scale: [f64; 2],
    horizon: Vec<[f32; 3]>,
    eye: [f64; 3],
    places: PyReadonlyArrayDyn<'_, f64>,
    mut colors: PyReadwriteArrayDyn<'_, f32>,
    mut variation: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let places = slice(&places, "places")?;
    let (colors, variation) = (slice_mut(&mut colors, "colors")?, slice_mut(&mut variation, "variation")?);
    let air = Air { extinction, scale, horizon };
    sized(py, 20 * places.len(), |job| air.before(job, DVec3::from_array(eye), places, colors, variation))
}

/// Rows of light, transmittance and distance of a traced cloud along unit directions from an eye.
#[pyfunction]
fn scene_cloud(
    py: Python<'_>,
    camera: Camera,
    rgb: PyReadonlyArrayDyn<'_, f32>,
    transmittance: PyReadonlyArrayDyn<'_, f32>,
    distance: PyReadonlyArrayDyn<'_, f32>,
    eye: [f64; 3],
    directions: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let (rgb, transmittance) = (slice(&rgb, "rgb")?, slice(&transmittance, "transmittance")?);
    let (distance, directions) = (slice(&distance, "distance")?, slice(&directions, "directions")?);
    let out = slice_mut(&mut out, "out")?;
    let camera = camera.pinhole()?;
    let map = Impostor { camera: &camera, rgb, transmittance, distance };
    sized(py, 8 * directions.len(), |job| map.seen(job, DVec3::from_array(eye), directions, out))
}

/// Indices of strokes that may be in a window of a picture, or hang mirrored in it.
#[pyfunction]
fn scene_in_view<'py>(
    py: Python<'py>,
    camera: Camera,
    position: PyReadonlyArrayDyn<'_, f64>,
    size: PyReadonlyArrayDyn<'_, f32>,
    growth: f64,
    window: [f64; 4],
    mirror: Option<f64>,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let (position, size) = (slice(&position, "position")?, slice(&size, "size")?);
    let found = culling::in_view(&camera.pinhole()?, position, size, growth, window, mirror);
    found.map(|list| PyArray1::from_vec(py, list)).map_err(|e| to_py(&e))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(scene_dome, module)?)?;
    module.add_function(wrap_pyfunction!(scene_project, module)?)?;
    module.add_function(wrap_pyfunction!(scene_irradiance, module)?)?;
    module.add_function(wrap_pyfunction!(scene_radiance, module)?)?;
    module.add_function(wrap_pyfunction!(scene_extinction, module)?)?;
    module.add_function(wrap_pyfunction!(scene_air, module)?)?;
    module.add_function(wrap_pyfunction!(scene_cloud, module)?)?;
    module.add_function(wrap_pyfunction!(scene_in_view, module)?)?;
    Ok(())
}

//! `_core`: what `pleinair.weather` and `pleinair.scene` call.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use glam::DVec3;
use numpy::{PyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::run::{long, quick, sized};
use crate::weather::fall::{self, Fall};
use crate::weather::veil::{Lamp, Shape, Veil};
use crate::weather::{drops, snow};

/// A direction to a lamp, its irradiance, its phase function in RGB.
type Lamps<'py> = Vec<([f64; 3], [f64; 3], PyReadonlyArrayDyn<'py, f32>)>;

/// Index of water in air.
#[pyfunction]
fn weather_index(wavelength: f64) -> f64 {
    drops::water(wavelength)
}

/// Phase functions of drops, angle by wavelength.
#[pyfunction]
fn weather_phase(
    py: Python<'_>,
    angles: Vec<f64>,
    radii: Vec<f64>,
    weights: Vec<f64>,
    wavelengths: Vec<f64>,
    disc: f64,
) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let found = long(py, None, |job| {
        let raw = drops::phase(job, &angles, &radii, &weights, &wavelengths)?;
        let step = if angles.len() > 1 { angles[1] - angles[0] } else { 1.0 };
        Ok(if disc > 0.0 { drops::smear(&raw, wavelengths.len(), step, disc) } else { raw })
    })?;
    Ok(PyArray1::from_vec(py, found))
}

/// A phase function in RGB for a lamp's colour.
#[pyfunction]
fn weather_table(
    py: Python<'_>,
    count: usize,
    radii: Vec<f64>,
    weights: Vec<f64>,
    color: [f64; 3],
    disc: f64,
) -> PyResult<Bound<'_, PyArray1<f32>>> {
    let found = long(py, None, |job| drops::table(job, count.max(2), &radii, &weights, color, disc))?;
    Ok(PyArray1::from_vec(py, found.into_iter().flatten().collect()))
}

fn shape_of(kind: &str, n: &[f64], seed: u64) -> Shape {
    let at = |k: usize| n.get(k).copied().unwrap_or(0.0);
    if kind == "layer" {
        Shape::Layer { top: at(0), scale: at(1) }
    } else {
        let (azimuth, half) = (at(3).to_radians(), at(4).to_radians());
        Shape::Curtain { near: at(0), far: at(1), base: at(2), azimuth, half, lean: at(5), patchy: at(6), seed }
    }
}

/// Put weather before colours, in place.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "all that light passes")]
fn weather_veil(
    py: Python<'_>,
    kind: String,
    numbers: Vec<f64>,
    seed: u64,
    extinction: f64,
    lamps: Lamps<'_>,
    ambient: [f64; 3],
    eye: [f64; 3],
    rays: PyReadonlyArrayDyn<'_, f64>,
    endless: bool,
    lit: PyReadonlyArrayDyn<'_, f32>,
    mut colors: PyReadwriteArrayDyn<'_, f32>,
    mut variation: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let (rays, lit) = (slice(&rays, "rays")?, slice(&lit, "lit")?);
    let (colors, variation) = (slice_mut(&mut colors, "colors")?, slice_mut(&mut variation, "variation")?);
    let lamps = lamps
        .iter()
        .map(|(to, irradiance, phase)| {
            let phase = slice(phase, "phase")?.as_chunks::<3>().0.to_vec();
            Ok(Lamp { to: DVec3::from_array(*to), irradiance: *irradiance, phase })
        })
        .collect::<PyResult<Vec<_>>>()?;
    let veil = Veil { shape: shape_of(&kind, &numbers, seed), extinction, lamps, ambient };
    let eye = DVec3::from_array(eye);
    sized(py, 20 * rays.len(), |job| veil.before(job, eye, rays, endless, lit, colors, variation))
}

/// Optical depths along unit vectors to distances.
#[pyfunction]
fn weather_depth(
    py: Python<'_>,
    kind: String,
    numbers: Vec<f64>,
    seed: u64,
    extinction: f64,
    eye: [f64; 3],
    to: Vec<[f64; 3]>,
    distance: Vec<f64>,
) -> Bound<'_, PyArray1<f64>> {
    let veil = Veil { shape: shape_of(&kind, &numbers, seed), extinction, lamps: vec![], ambient: [0.0; 3] };
    let eye = DVec3::from_array(eye);
    let all = to.iter().zip(&distance).map(|(to, far)| veil.depth(eye, DVec3::from_array(*to), *far)).collect();
    PyArray1::from_vec(py, all)
}

/// Fall speed of drops [m/s] for a diameter [mm].
#[pyfunction]
fn weather_drop_speed(diameter: f64) -> f64 {
    fall::drop_speed(diameter)
}

/// Draw what falls near the eye, in place.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "a camera and what falls")]
fn weather_fall(
    py: Python<'_>,
    flakes: bool,
    count: usize,
    sizes: [f64; 2],
    reach: f64,
    wind: [f64; 2],
    exposure: f64,
    time: f64,
    color: [f32; 3],
    seed: u64,
    eye: [f64; 3],
    axes: [[f64; 3]; 3],
    focal: f64,
    size: [usize; 2],
    mut picture: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let picture = slice_mut(&mut picture, "picture")?;
    let fall = Fall { flakes, count, sizes, reach, wind, exposure, time, color, seed };
    let axes = axes.map(DVec3::from_array);
    sized(py, 100 * count + picture.len(), |job| {
        fall::draw(job, &fall, DVec3::from_array(eye), axes, focal, size, picture)
    })
}

/// Sky view of a height field.
#[pyfunction]
fn weather_sky_view<'py>(
    py: Python<'py>,
    heights: PyReadonlyArrayDyn<'py, f64>,
    width: usize,
    spacing: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let heights = slice(&heights, "heights")?;
    let found = long(py, None, |job| snow::sky_view(job, heights, width, spacing))?;
    Ok(PyArray1::from_vec(py, found))
}

/// Share of a surface that snow covers.
#[pyfunction]
fn weather_snow_cover(up: f64, sky_view: f64, amount: f64) -> f64 {
    snow::cover(up, sky_view, amount)
}

/// Lay snow on colours, in place.
#[pyfunction]
fn weather_lay_snow(
    py: Python<'_>,
    up: PyReadonlyArrayDyn<'_, f64>,
    sky_view: PyReadonlyArrayDyn<'_, f32>,
    amount: f64,
    snow_light: PyReadonlyArrayDyn<'_, f32>,
    mut colors: PyReadwriteArrayDyn<'_, f32>,
    mut variation: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let (up, sky_view) = (slice(&up, "up")?, slice(&sky_view, "sky_view")?);
    let snow_light = slice(&snow_light, "snow_light")?;
    let (colors, variation) = (slice_mut(&mut colors, "colors")?, slice_mut(&mut variation, "variation")?);
    quick(py, colors.len(), |_| snow::lay(up, sky_view, amount, snow_light, colors, variation))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(weather_index, module)?)?;
    module.add_function(wrap_pyfunction!(weather_phase, module)?)?;
    module.add_function(wrap_pyfunction!(weather_table, module)?)?;
    module.add_function(wrap_pyfunction!(weather_veil, module)?)?;
    module.add_function(wrap_pyfunction!(weather_depth, module)?)?;
    module.add_function(wrap_pyfunction!(weather_drop_speed, module)?)?;
    module.add_function(wrap_pyfunction!(weather_fall, module)?)?;
    module.add_function(wrap_pyfunction!(weather_sky_view, module)?)?;
    module.add_function(wrap_pyfunction!(weather_snow_cover, module)?)?;
    module.add_function(wrap_pyfunction!(weather_lay_snow, module)?)?;
    Ok(())
}

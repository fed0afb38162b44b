//! `_core`: what `pleinair.tone` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use numpy::{PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::run::{quick, sized, to_py};
use crate::tone::dither;
use crate::tone::exposure;
use crate::tone::grade;
use crate::tone::present::{self, Eye};
use crate::tone::scotopic;
use crate::tone::tumblin_rushmeier::{self, Display, Operator};

#[pyfunction]
fn tone_oneil(
    py: Python<'_>,
    light: PyReadonlyArrayDyn<'_, f32>,
    mut out: PyReadwriteArrayDyn<'_, f32>,
    exposure: f32,
) -> PyResult<()> {
    let (light, out) = (slice(&light, "rgb")?, slice_mut(&mut out, "out")?);
    quick(py, light.len(), |job| exposure::oneil(job, light, out, exposure))
}

#[pyfunction]
fn tone_levels(
    py: Python<'_>,
    light: PyReadonlyArrayDyn<'_, f32>,
    mut out: PyReadwriteArrayDyn<'_, u8>,
) -> PyResult<()> {
    let (light, out) = (slice(&light, "rgb")?, slice_mut(&mut out, "out")?);
    quick(py, light.len(), |job| exposure::levels(job, light, out))
}

/// `shape` is the width of a row \[px\] and the numbers of a pixel.
#[pyfunction]
fn tone_dither(
    py: Python<'_>,
    light: PyReadonlyArrayDyn<'_, f32>,
    mut out: PyReadwriteArrayDyn<'_, u8>,
    shape: [usize; 2],
) -> PyResult<()> {
    let (light, out) = (slice(&light, "rgb")?, slice_mut(&mut out, "out")?);
    sized(py, 2 * light.len(), |job| dither::levels(job, light, out, shape[0], shape[1]))
}

/// `pixel` is the angle of a pixel \[°\] if the eye scatters light.
#[pyfunction]
fn tone_present(
    py: Python<'_>,
    light: PyReadonlyArrayDyn<'_, f32>,
    mut out: PyReadwriteArrayDyn<'_, f32>,
    width: usize,
    adaptation: f64,
    exposure: f64,
    white: Option<f64>,
    night: bool,
    pixel: Option<f64>,
) -> PyResult<()> {
    let (light, out) = (slice(&light, "rgb")?, slice_mut(&mut out, "out")?);
    let eye = Eye { adaptation, exposure, white, night, glare: pixel };
    sized(py, 4 * light.len(), |job| present::present(job, light, out, width, &eye))
}

/// A display: peak, ambient light, adaptation [cd/m2].
type Shown = [f64; 3];

pub(super) fn operator(adaptation: f64, [peak, ambient, own]: Shown) -> Operator {
    Operator::new(adaptation, Display { peak, ambient, adaptation: own })
}

/// Values of sky and land \[stops\], in place; `share` of each pixel is sky.
#[pyfunction]
fn tone_values(
    py: Python<'_>,
    mut rgb: PyReadwriteArrayDyn<'_, f32>,
    share: PyReadonlyArrayDyn<'_, f32>,
    stops: [f64; 2],
) -> PyResult<()> {
    let (rgb, share) = (slice_mut(&mut rgb, "rgb")?, slice(&share, "share")?);
    sized(py, rgb.len(), |job| grade::values(job, rgb, share, stops))
}

/// Saturation and the hue of shadows of a shown picture, in place.
#[pyfunction]
fn tone_colors(
    py: Python<'_>,
    mut rgb: PyReadwriteArrayDyn<'_, f32>,
    saturation: f64,
    shadows: [f64; 3],
    tint: f64,
) -> PyResult<()> {
    let rgb = slice_mut(&mut rgb, "rgb")?;
    sized(py, 2 * rgb.len(), |job| grade::colors(job, rgb, saturation, shadows, tint))
}

#[pyfunction]
fn tone_log_average(py: Python<'_>, light: PyReadonlyArrayDyn<'_, f32>) -> PyResult<f64> {
    let light = slice(&light, "rgb")?;
    sized(py, light.len(), |job| tumblin_rushmeier::log_average(job, light))
}

#[pyfunction]
fn tone_reproduce(
    py: Python<'_>,
    light: PyReadonlyArrayDyn<'_, f32>,
    mut out: PyReadwriteArrayDyn<'_, f32>,
    adaptation: f64,
    display: Shown,
) -> PyResult<()> {
    let (light, out) = (slice(&light, "rgb")?, slice_mut(&mut out, "out")?);
    sized(py, 2 * light.len(), |job| tumblin_rushmeier::reproduce(job, light, out, &operator(adaptation, display)))
}

#[pyfunction]
fn tone_scotopic(
    py: Python<'_>,
    light: PyReadonlyArrayDyn<'_, f32>,
    mut out: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let (light, out) = (slice(&light, "rgb")?, slice_mut(&mut out, "out")?);
    sized(py, 2 * light.len(), |job| scotopic::scotopic(job, light, out))
}

#[pyfunction]
fn tone_show(
    py: Python<'_>,
    light: PyReadonlyArrayDyn<'_, f32>,
    mut out: PyReadwriteArrayDyn<'_, u8>,
    adaptation: f64,
    display: Shown,
    night: bool,
) -> PyResult<()> {
    let (light, out) = (slice(&light, "rgb")?, slice_mut(&mut out, "out")?);
    sized(py, 2 * light.len(), |job| tumblin_rushmeier::show(job, light, out, &operator(adaptation, display), night))
}

/// Luminance of the display for luminances of the scene, and its fraction of the greatest, in [0, 1].
#[pyfunction]
fn tone_display(
    luminance: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
    adaptation: f64,
    display: Shown,
    as_fraction: bool,
) -> PyResult<()> {
    let (scene, out) = (slice(&luminance, "luminance")?, slice_mut(&mut out, "out")?);
    tumblin_rushmeier::display(scene, out, &operator(adaptation, display), as_fraction).map_err(|e| to_py(&e))
}

#[pyfunction]
fn tone_out_of_gamut(py: Python<'_>, light: PyReadonlyArrayDyn<'_, f32>) -> PyResult<[u64; 2]> {
    let light = slice(&light, "rgb")?;
    sized(py, light.len(), |job| tumblin_rushmeier::out_of_gamut(job, light))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(tone_oneil, module)?)?;
    module.add_function(wrap_pyfunction!(tone_levels, module)?)?;
    module.add_function(wrap_pyfunction!(tone_dither, module)?)?;
    module.add_function(wrap_pyfunction!(tone_present, module)?)?;
    module.add_function(wrap_pyfunction!(tone_values, module)?)?;
    module.add_function(wrap_pyfunction!(tone_colors, module)?)?;
    module.add_function(wrap_pyfunction!(tone_log_average, module)?)?;
    module.add_function(wrap_pyfunction!(tone_reproduce, module)?)?;
    module.add_function(wrap_pyfunction!(tone_scotopic, module)?)?;
    module.add_function(wrap_pyfunction!(tone_show, module)?)?;
    module.add_function(wrap_pyfunction!(tone_display, module)?)?;
    module.add_function(wrap_pyfunction!(tone_out_of_gamut, module)?)?;
    Ok(())
}

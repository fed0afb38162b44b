//! `_core`: what `pleinair.tone` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use numpy::{PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::run::quick;
use crate::tone::exposure;

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

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(tone_oneil, module)?)?;
    module.add_function(wrap_pyfunction!(tone_levels, module)?)?;
    Ok(())
}

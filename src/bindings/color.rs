//! `_core`: what `pleinair.color` calls. Each function takes an input and an output array of one dtype, `f32` or `f64`.

use numpy::{PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::run::{sized, to_py};
use crate::color::{pigment, spaces, transfer};

type Any<'a, 'py> = &'a Bound<'py, PyAny>;

/// Call a generic kernel on the slices of both arrays.
macro_rules! through {
    ($x:ident, $out:ident, |$job:ident, $src:ident, $dst:ident| $kernel:expr) => {{
        let py = $x.py();
        if let (Ok(x), Ok(mut out)) =
            ($x.extract::<PyReadonlyArrayDyn<'_, f32>>(), $out.extract::<PyReadwriteArrayDyn<'_, f32>>())
        {
            let ($src, $dst) = (slice(&x, "the input")?, slice_mut(&mut out, "out")?);
            sized(py, 16 * $src.len(), |$job| $kernel)
        } else if let (Ok(x), Ok(mut out)) =
            ($x.extract::<PyReadonlyArrayDyn<'_, f64>>(), $out.extract::<PyReadwriteArrayDyn<'_, f64>>())
        {
            let ($src, $dst) = (slice(&x, "the input")?, slice_mut(&mut out, "out")?);
            sized(py, 16 * $src.len(), |$job| $kernel)
        } else {
            Err(PyTypeError::new_err("the input and out must be different arrays, both float32 or both float64"))
        }
    }};
}

#[pyfunction]
fn srgb_encode(x: Any<'_, '_>, out: Any<'_, '_>) -> PyResult<()> {
    through!(x, out, |job, src, dst| transfer::encode_all(job, src, dst))
}

#[pyfunction]
fn srgb_decode(x: Any<'_, '_>, out: Any<'_, '_>) -> PyResult<()> {
    through!(x, out, |job, src, dst| transfer::decode_all(job, src, dst))
}

#[pyfunction]
fn rgb_to_hsv(rgb: Any<'_, '_>, out: Any<'_, '_>) -> PyResult<()> {
    through!(rgb, out, |job, src, dst| spaces::rgb_to_hsv(job, src, dst))
}

#[pyfunction]
fn hsv_to_rgb(hsv: Any<'_, '_>, out: Any<'_, '_>) -> PyResult<()> {
    through!(hsv, out, |job, src, dst| spaces::hsv_to_rgb(job, src, dst))
}

#[pyfunction]
fn color_transform(x: Any<'_, '_>, out: Any<'_, '_>, matrix: spaces::Matrix) -> PyResult<()> {
    through!(x, out, |job, src, dst| spaces::transform(job, src, dst, &matrix))
}

#[pyfunction]
fn color_inverse(matrix: spaces::Matrix) -> PyResult<spaces::Matrix> {
    spaces::inverse(&matrix).map_err(|e| to_py(&e))
}

#[pyfunction]
fn into_gamut(rgb: Any<'_, '_>, out: Any<'_, '_>) -> PyResult<()> {
    through!(rgb, out, |job, src, dst| spaces::into_gamut(job, src, dst))
}

#[pyfunction]
fn luminance(rgb: Any<'_, '_>, out: Any<'_, '_>, weights: [f64; 3]) -> PyResult<()> {
    through!(rgb, out, |job, src, dst| spaces::luminance(job, src, dst, weights))
}

#[pyfunction]
#[pyo3(signature = (xyz, out, white))]
fn xyz_to_xyy(xyz: Any<'_, '_>, out: Any<'_, '_>, white: Option<[f64; 3]>) -> PyResult<()> {
    let black = white.map_or([0.0; 2], spaces::chromaticity);
    through!(xyz, out, |job, src, dst| spaces::xyz_to_xyy(job, src, dst, black))
}

#[pyfunction]
fn xyy_to_xyz(xyy: Any<'_, '_>, out: Any<'_, '_>) -> PyResult<()> {
    through!(xyy, out, |job, src, dst| spaces::xyy_to_xyz(job, src, dst))
}

#[pyfunction]
#[pyo3(signature = (rgb, out, matrix, white, encoded))]
fn rgb_to_lab(
    rgb: Any<'_, '_>,
    out: Any<'_, '_>,
    matrix: spaces::Matrix,
    white: Option<[f64; 3]>,
    encoded: bool,
) -> PyResult<()> {
    let lab = spaces::Lab::new(&matrix, white, encoded).map_err(|e| to_py(&e))?;
    through!(rgb, out, |job, src, dst| spaces::rgb_to_lab(job, src, dst, &lab))
}

#[pyfunction]
#[pyo3(signature = (lab, out, matrix, white, encoded))]
fn lab_to_rgb(
    lab: Any<'_, '_>,
    out: Any<'_, '_>,
    matrix: spaces::Matrix,
    white: Option<[f64; 3]>,
    encoded: bool,
) -> PyResult<()> {
    let space = spaces::Lab::new(&matrix, white, encoded).map_err(|e| to_py(&e))?;
    through!(lab, out, |job, src, dst| spaces::lab_to_rgb(job, src, dst, &space))
}

/// RGB to XYZ, XYZ to RGB and the white.
#[pyfunction]
fn color_constants() -> (spaces::Matrix, spaces::Matrix, [f64; 3]) {
    (spaces::RGB_TO_XYZ, spaces::XYZ_TO_RGB, spaces::D65)
}

#[pyfunction]
#[allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]
fn pigment_mix(
    py: Python<'_>,
    a: PyReadonlyArrayDyn<'_, f64>,
    b: PyReadonlyArrayDyn<'_, f64>,
    amount: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (a, b, t) = (slice(&a, "a")?, slice(&b, "b")?, slice(&amount, "amount")?);
    let out = slice_mut(&mut out, "out")?;
    sized(py, 20_000 * t.len(), |job| pigment::mix(job, a, b, t, out))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(srgb_encode, module)?)?;
    module.add_function(wrap_pyfunction!(srgb_decode, module)?)?;
    module.add_function(wrap_pyfunction!(rgb_to_hsv, module)?)?;
    module.add_function(wrap_pyfunction!(hsv_to_rgb, module)?)?;
    module.add_function(wrap_pyfunction!(color_transform, module)?)?;
    module.add_function(wrap_pyfunction!(color_inverse, module)?)?;
    module.add_function(wrap_pyfunction!(into_gamut, module)?)?;
    module.add_function(wrap_pyfunction!(luminance, module)?)?;
    module.add_function(wrap_pyfunction!(xyz_to_xyy, module)?)?;
    module.add_function(wrap_pyfunction!(xyy_to_xyz, module)?)?;
    module.add_function(wrap_pyfunction!(rgb_to_lab, module)?)?;
    module.add_function(wrap_pyfunction!(lab_to_rgb, module)?)?;
    module.add_function(wrap_pyfunction!(color_constants, module)?)?;
    module.add_function(wrap_pyfunction!(pigment_mix, module)?)?;
    Ok(())
}

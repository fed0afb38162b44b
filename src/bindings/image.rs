//! `_core`: what `pleinair.image` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::run;
use crate::image::{blur, clear_sky, grow, histogram, laplace, otsu, resize, segment, skyline, warp};

/// A picture in one of the number types that are read without a copy.
#[derive(FromPyObject)]
enum Pixels<'py> {
    Byte(PyReadonlyArrayDyn<'py, u8>),
    Word(PyReadonlyArrayDyn<'py, u16>),
    Single(PyReadonlyArrayDyn<'py, f32>),
    Double(PyReadonlyArrayDyn<'py, f64>),
}

type Mask<'py> = Option<PyReadonlyArrayDyn<'py, bool>>;
type Counts<'py> = Bound<'py, PyArray1<u64>>;

fn optional<'a>(mask: &'a Mask<'_>) -> PyResult<Option<&'a [bool]>> {
    mask.as_ref().map(|m| slice(m, "mask")).transpose()
}

/// Edges of the bins of a histogram.
#[pyfunction]
#[pyo3(signature = (bins, low, high))]
fn histogram_edges(py: Python<'_>, bins: usize, low: f64, high: f64) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let bins = histogram::Bins::new(bins, low, high).map_err(|e| run::to_py(&e))?;
    Ok(bins.edges().into_pyarray(py))
}

/// Counts of each channel: bins, under, over, NaN.
#[pyfunction]
#[pyo3(signature = (img, channels, bins, low, high, mask))]
fn histogram_counts<'py>(
    py: Python<'py>,
    img: Pixels<'py>,
    channels: usize,
    bins: usize,
    low: f64,
    high: f64,
    mask: Mask<'py>,
) -> PyResult<(Counts<'py>, Counts<'py>, Counts<'py>, Counts<'py>)> {
    let mask = optional(&mask)?;
    let bins = histogram::Bins::new(bins, low, high).map_err(|e| run::to_py(&e))?;
    let counts = match &img {
        Pixels::Byte(a) => {
            let data = slice(a, "img")?;
            run::quick(py, data.len(), |job| histogram::bytes(job, data, channels, mask, &bins))
        }
        Pixels::Word(a) => {
            let data = slice(a, "img")?;
            run::quick(py, data.len(), |job| histogram::samples(job, data, channels, mask, &bins))
        }
        Pixels::Single(a) => {
            let data = slice(a, "img")?;
            run::quick(py, data.len(), |job| histogram::samples(job, data, channels, mask, &bins))
        }
        Pixels::Double(a) => {
            let data = slice(a, "img")?;
            run::quick(py, data.len(), |job| histogram::samples(job, data, channels, mask, &bins))
        }
    }?;
    Ok((
        counts.bins.into_pyarray(py),
        counts.under.into_pyarray(py),
        counts.over.into_pyarray(py),
        counts.nan.into_pyarray(py),
    ))
}

/// `(value, separability)`; `nbins` chooses the binned form for floating-point samples.
#[pyfunction]
#[pyo3(signature = (img, mask, nbins))]
fn otsu_threshold<'py>(
    py: Python<'py>,
    img: Pixels<'py>,
    mask: Mask<'py>,
    nbins: Option<usize>,
) -> PyResult<(f64, f64)> {
    let mask = optional(&mask)?;
    let cut = match &img {
        Pixels::Byte(a) => {
            let data = slice(a, "img")?;
            run::quick(py, data.len(), |job| otsu::of_bytes(job, data, mask))
        }
        Pixels::Word(a) => {
            let data = slice(a, "img")?;
            run::quick(py, data.len(), |job| otsu::of_words(job, data, mask))
        }
        Pixels::Single(a) => {
            let data = slice(a, "img")?;
            run::sized(py, 64 * data.len(), |job| otsu::of_samples(job, data, mask, nbins))
        }
        Pixels::Double(a) => {
            let data = slice(a, "img")?;
            run::sized(py, 64 * data.len(), |job| otsu::of_samples(job, data, mask, nbins))
        }
    }?;
    Ok((cut.value, cut.separability))
}

fn filled<'py, T: Element + crate::image::Sample>(
    py: Python<'py>,
    data: &[T],
    shape: (usize, usize, usize),
    mask: &[bool],
    outside: Option<&[f64]>,
    tolerance: f64,
    from: impl Fn(f64) -> T + Send,
) -> PyResult<Bound<'py, PyAny>> {
    let out = run::long(py, None, |job| laplace::fill(job, data, shape, mask, outside, tolerance, from))?;
    Ok(out.into_pyarray(py).into_any())
}

/// A filled copy of a float32 or float64 picture, flat.
#[pyfunction]
#[pyo3(signature = (img, shape, mask, outside, tolerance))]
fn laplace_fill<'py>(
    py: Python<'py>,
    img: Pixels<'py>,
    shape: (usize, usize, usize),
    mask: PyReadonlyArrayDyn<'py, bool>,
    outside: Option<Vec<f64>>,
    tolerance: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let (mask, outside) = (slice(&mask, "mask")?, outside.as_deref());
    match &img {
        Pixels::Single(a) => filled(py, slice(a, "img")?, shape, mask, outside, tolerance, |x| x as f32),
        Pixels::Double(a) => filled(py, slice(a, "img")?, shape, mask, outside, tolerance, |x| x),
        _ => Err(PyTypeError::new_err("img must have dtype float32 or float64")),
    }
}

/// Mask of what is not sky in a linear-light (h, w, 3) picture, flat.
#[pyfunction]
#[pyo3(signature = (photo, shape))]
fn ground_mask<'py>(
    py: Python<'py>,
    photo: PyReadonlyArrayDyn<'py, f32>,
    shape: (usize, usize),
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let rgb = slice(&photo, "photo")?;
    Ok(run::long(py, None, |job| skyline::ground(job, rgb, shape.0, shape.1))?.into_pyarray(py))
}

/// `(cloud, feature, threshold, separability, contrast, verdict)`, the masks flat.
type Classes<'py> =
    (Bound<'py, PyArray1<bool>>, Bound<'py, PyArray1<f32>>, (f64, bool), f64, (f64, f64), (&'static str, f64));

/// Classify the pixels outside `ground`.
#[pyfunction]
#[pyo3(signature = (photo, shape, ground, method, prior))]
fn classify_sky<'py>(
    py: Python<'py>,
    photo: PyReadonlyArrayDyn<'py, f32>,
    shape: (usize, usize),
    ground: PyReadonlyArrayDyn<'py, bool>,
    method: &str,
    prior: f64,
) -> PyResult<Classes<'py>> {
    let (rgb, ground) = (slice(&photo, "photo")?, slice(&ground, "ground")?);
    let method = segment::CloudFeature::named(method).map_err(|e| run::to_py(&e))?;
    let found = run::long(py, None, |job| segment::classify(job, rgb, shape, ground, method, prior))?;
    Ok((
        found.cloud.into_pyarray(py),
        found.feature.into_pyarray(py),
        (found.threshold, found.inverted),
        found.separability,
        (found.contrast, found.structure),
        (found.verdict.name(), found.confidence),
    ))
}

/// Grow a mask by a disc.
#[pyfunction]
fn mask_dilate<'py>(
    py: Python<'py>,
    mask: PyReadonlyArrayDyn<'py, bool>,
    size: [usize; 2],
    radius: usize,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let mask = slice(&mask, "mask")?;
    let out = run::sized(py, mask.len() * (2 * radius + 1), |job| grow::dilate(mask, size, radius, job))?;
    Ok(out.into_pyarray(py))
}

/// Area-average `picture` of `shape` into `out` of `size`.
#[pyfunction]
fn image_resize(
    py: Python<'_>,
    picture: PyReadonlyArrayDyn<'_, f32>,
    shape: [usize; 3],
    size: [usize; 2],
    mut out: PyReadwriteArrayDyn<'_, f32>,
) -> PyResult<()> {
    let (picture, out) = (slice(&picture, "picture")?, slice_mut(&mut out, "out")?);
    run::sized(py, 8 * (picture.len() + out.len()), |job| resize::resize(picture, shape, size, out, job))
}

/// Mean of each pixel of `shape` and its eight neighbours, flat.
#[pyfunction]
fn image_blur<'py>(
    py: Python<'py>,
    picture: PyReadonlyArrayDyn<'py, f32>,
    shape: [usize; 3],
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let picture = slice(&picture, "picture")?;
    Ok(run::sized(py, picture.len(), |job| blur::blur(picture, shape, job))?.into_pyarray(py))
}

/// `picture((at - to) / scale + middle)`, of `size`, flat; `outside` beyond its pixels.
#[pyfunction]
#[pyo3(signature = (picture, shape, size, scale, middle, to, outside))]
fn image_warp<'py>(
    py: Python<'py>,
    picture: PyReadonlyArrayDyn<'py, f32>,
    shape: [usize; 3],
    size: [usize; 2],
    scale: f64,
    middle: [f64; 2],
    to: [f64; 2],
    outside: f32,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let picture = slice(&picture, "picture")?;
    let work = 3 * size[0] * size[1];
    let place = (scale, middle, to);
    Ok(run::sized(py, work, |job| warp::warp(picture, shape, size, place, outside, job))?.into_pyarray(py))
}

/// The sky behind what covers it, flat; None where there is none.
#[pyfunction]
#[pyo3(signature = (photo, shape, covered, feature, margin))]
fn sky_behind<'py>(
    py: Python<'py>,
    photo: PyReadonlyArrayDyn<'py, f32>,
    shape: (usize, usize),
    covered: PyReadonlyArrayDyn<'py, bool>,
    feature: PyReadonlyArrayDyn<'py, f32>,
    margin: usize,
) -> PyResult<Option<Bound<'py, PyArray1<f32>>>> {
    let (rgb, covered, feature) = (slice(&photo, "photo")?, slice(&covered, "covered")?, slice(&feature, "feature")?);
    let found = run::long(py, None, |job| clear_sky::behind(rgb, shape, covered, feature, margin, job))?;
    Ok(found.map(|sky| sky.into_pyarray(py)))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(histogram_counts, module)?)?;
    module.add_function(wrap_pyfunction!(histogram_edges, module)?)?;
    module.add_function(wrap_pyfunction!(otsu_threshold, module)?)?;
    module.add_function(wrap_pyfunction!(laplace_fill, module)?)?;
    module.add_function(wrap_pyfunction!(ground_mask, module)?)?;
    module.add_function(wrap_pyfunction!(classify_sky, module)?)?;
    module.add_function(wrap_pyfunction!(mask_dilate, module)?)?;
    module.add_function(wrap_pyfunction!(image_resize, module)?)?;
    module.add_function(wrap_pyfunction!(image_blur, module)?)?;
    module.add_function(wrap_pyfunction!(image_warp, module)?)?;
    module.add_function(wrap_pyfunction!(sky_behind, module)?)?;
    Ok(())
}

//! `_core`: what `pleinair.io` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use numpy::{IntoPyArray, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use super::arrays::{slice, slice_mut};
use super::run;
use crate::clouds::levels::{Levels, even_levels};
use crate::clouds::openvdb;
use crate::color::profile::Encoding;
use crate::image::decode::{self, Channels, Samples};
use crate::image::rgbe;

/// Samples of a PNG or TIFF, flat, and what the file says of them.
#[pyfunction]
#[pyo3(signature = (data, most))]
fn picture_decode<'py>(py: Python<'py>, data: &[u8], most: usize) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyDict>)> {
    let found = run::sized(py, usize::MAX, |_| decode::decode(data, most))?;
    let about = PyDict::new(py);
    let bytes = |b: Option<Vec<u8>>| b.map(|b| PyBytes::new(py, &b));
    about.set_item("width", found.size[0])?;
    about.set_item("height", found.size[1])?;
    about.set_item("stride", found.samples_per_pixel)?;
    about.set_item(
        "channels",
        match found.channels {
            Channels::Grey => "grey",
            Channels::Rgb => "rgb",
            Channels::Cmyk => "cmyk",
        },
    )?;
    about
        .set_item("alpha", found.alpha.map(|premultiplied| if premultiplied { "premultiplied" } else { "straight" }))?;
    about.set_item("profile", bytes(found.profile))?;
    about.set_item("cicp", found.cicp.map(|c| (c[0], c[1], c[2], c[3])))?;
    about.set_item("gamma", found.gamma)?;
    about.set_item("srgb", found.srgb)?;
    about.set_item("chromaticities", found.chromaticities)?;
    about.set_item("exif", bytes(found.exif))?;
    about.set_item("orientation", found.orientation)?;
    let samples = match found.samples {
        Samples::Byte(v) => v.into_pyarray(py).into_any(),
        Samples::Word(v) => v.into_pyarray(py).into_any(),
        Samples::Long(v) => v.into_pyarray(py).into_any(),
        Samples::Float(v) => v.into_pyarray(py).into_any(),
    };
    Ok((samples, about))
}

/// Whether a picture is finite, and its least and largest value.
#[pyfunction]
fn picture_limits(py: Python<'_>, picture: PyReadonlyArrayDyn<'_, f32>) -> PyResult<(bool, f32, f32)> {
    let picture = slice(&picture, "picture")?;
    run::sized(py, picture.len(), |job| rgbe::limits(picture, job))
}

/// The body of a Radiance file.
#[pyfunction]
fn rgbe_encode<'py>(
    py: Python<'py>,
    picture: PyReadonlyArrayDyn<'py, f32>,
    width: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let picture = slice(&picture, "picture")?;
    let body = run::sized(py, usize::MAX, |job| rgbe::encode(picture, width, job))?;
    Ok(body.into_pyarray(py).into_any())
}

/// The light of the body of a Radiance file.
#[pyfunction]
fn rgbe_decode<'py>(py: Python<'py>, body: &[u8], size: [usize; 2], scale: [f64; 3]) -> PyResult<Bound<'py, PyAny>> {
    let light = run::sized(py, usize::MAX, |job| rgbe::decode(body, size, scale, job))?;
    Ok(light.into_pyarray(py).into_any())
}

/// How the numbers of a picture become linear light.
#[pyclass(frozen, module = "pleinair._core")]
struct PictureEncoding(Encoding);

#[derive(FromPyObject)]
enum Pixels<'py> {
    Byte(PyReadonlyArrayDyn<'py, u8>),
    Word(PyReadonlyArrayDyn<'py, u16>),
    Long(PyReadonlyArrayDyn<'py, u32>),
    Single(PyReadonlyArrayDyn<'py, f32>),
}

#[pymethods]
impl PictureEncoding {
    /// sRGB.
    #[staticmethod]
    fn srgb() -> Self {
        Self(Encoding::srgb())
    }

    /// Linear Rec. 709.
    #[staticmethod]
    fn linear_light() -> Self {
        Self(Encoding::linear_light())
    }

    /// An ICC profile of curves and a matrix, or of one grey curve.
    #[staticmethod]
    fn icc(profile: &[u8]) -> PyResult<Self> {
        Encoding::icc(profile).map(Self).map_err(|e| run::to_py(&e))
    }

    /// Code points of H.273: primaries, transfer function, matrix, full range.
    #[staticmethod]
    fn cicp(points: (u8, u8, u8, u8)) -> PyResult<Self> {
        Encoding::cicp([points.0, points.1, points.2, points.3]).map(Self).map_err(|e| run::to_py(&e))
    }

    /// A power, and where they are given the chromaticities of white, red, green and blue.
    #[staticmethod]
    #[pyo3(signature = (gamma, chromaticities=None))]
    fn power(gamma: f64, chromaticities: Option<[[f64; 2]; 4]>) -> PyResult<Self> {
        Encoding::power(gamma, chromaticities).map(Self).map_err(|e| run::to_py(&e))
    }

    /// Fill linear Rec. 709 (pixels, 3) from samples whose level `white` is 1.
    fn linear(
        &self,
        py: Python<'_>,
        samples: Pixels<'_>,
        channels: usize,
        stride: usize,
        white: f64,
        mut out: PyReadwriteArrayDyn<'_, f32>,
    ) -> PyResult<()> {
        let (shape, out) = ([channels, stride], slice_mut(&mut out, "out")?);
        match &samples {
            Pixels::Byte(a) => {
                let data = slice(a, "samples")?;
                run::sized(py, 8 * out.len(), |job| self.0.linear(job, data, shape, white, out))
            }
            Pixels::Word(a) => {
                let data = slice(a, "samples")?;
                run::sized(py, 8 * out.len(), |job| self.0.linear(job, data, shape, white, out))
            }
            Pixels::Long(a) => {
                let data = slice(a, "samples")?;
                run::sized(py, 64 * out.len(), |job| self.0.linear(job, data, shape, white, out))
            }
            Pixels::Single(a) => {
                let data = slice(a, "samples")?;
                run::sized(py, 64 * out.len(), |job| self.0.linear(job, data, shape, white, out))
            }
        }
    }
}

/// Name, type, class, map, and why it cannot be read or "".
type Entry = (String, String, String, String, String);
/// Values, voxels, edges, lowest corner and background.
type Dense<'py> = (Bound<'py, PyAny>, [usize; 3], [f64; 3], [f64; 3], f32);

/// The grids of an OpenVDB file, (name, type, class, map, why it cannot be read or ""), and how many are beyond those.
#[pyfunction]
fn openvdb_grids(py: Python<'_>, data: &[u8]) -> PyResult<(Vec<Entry>, usize)> {
    run::sized(py, usize::MAX, |job| {
        let file = openvdb::File::open(data, job)?;
        Ok((file.entries.into_iter().map(|e| (e.name, e.kind, e.class, e.map, e.problem)).collect(), file.beyond))
    })
}

/// A grid as a dense box: values (z, y, x) flat, and voxels, edges, lowest corner along x, y, z, and the background.
#[pyfunction]
#[pyo3(signature = (data, grid, y_up, max_voxels))]
fn openvdb_read<'py>(py: Python<'py>, data: &[u8], grid: usize, y_up: bool, max_voxels: u64) -> PyResult<Dense<'py>> {
    let dense = run::sized(py, usize::MAX, |job| openvdb::File::open(data, job)?.read(grid, y_up, max_voxels, job))?;
    Ok((dense.values.into_pyarray(py).into_any(), dense.size, dense.voxel, dense.origin, dense.background))
}

/// A field of uneven layers on `count` even ones that keep each column's sum, flat.
#[pyfunction]
fn volume_even_levels<'py>(
    py: Python<'py>,
    field: PyReadonlyArrayDyn<'py, f64>,
    shape: [usize; 3],
    faces: PyReadonlyArrayDyn<'py, f64>,
    low: f64,
    step: f64,
    count: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let (field, faces) = (slice(&field, "field")?, slice(&faces, "faces")?);
    let levels = Levels { low, step, count };
    let out = run::sized(py, 20 * field.len(), |job| even_levels(field, shape, faces, levels, job))?;
    Ok(out.into_pyarray(py).into_any())
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(picture_decode, module)?)?;
    module.add_function(wrap_pyfunction!(picture_limits, module)?)?;
    module.add_function(wrap_pyfunction!(rgbe_encode, module)?)?;
    module.add_function(wrap_pyfunction!(rgbe_decode, module)?)?;
    module.add_function(wrap_pyfunction!(openvdb_grids, module)?)?;
    module.add_function(wrap_pyfunction!(openvdb_read, module)?)?;
    module.add_function(wrap_pyfunction!(volume_even_levels, module)?)?;
    module.add_class::<PictureEncoding>()?;
    Ok(())
}

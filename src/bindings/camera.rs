//! `_core`: what `pleinair.Camera` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use glam::DVec3;
use numpy::PyReadwriteArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::slice_mut;
use super::run::{quick, to_py};
use crate::math::fisheye::Fisheye;
use crate::math::geometry::{Pinhole, Projection};
use crate::sky::model::ViewRays;

/// `pleinair.Camera`.
#[derive(FromPyObject)]
pub(crate) struct Camera {
    width: usize,
    height: usize,
    fov: f64,
    azimuth: f64,
    elevation: f64,
    roll: f64,
    position: [f64; 3],
    projection: String,
}

/// A camera of any projection.
pub(crate) enum Lens {
    Pinhole(Pinhole),
    Fisheye(Fisheye),
    Panorama([usize; 2]),
}

impl Lens {
    pub(crate) fn rays(&self) -> ViewRays<'_> {
        match self {
            Self::Pinhole(camera) => ViewRays::Camera(camera),
            Self::Fisheye(camera) => ViewRays::Fisheye(camera),
            Self::Panorama([width, height]) => ViewRays::Panorama { width: *width, height: *height },
        }
    }
}

impl Camera {
    fn frame(&self, fov: f64) -> PyResult<Pinhole> {
        let angles = [self.azimuth, self.elevation, self.roll].map(f64::to_radians);
        let angles = [angles[0], angles[1], angles[2], fov.to_radians()];
        Pinhole::new(DVec3::from(self.position), angles, [self.width, self.height]).map_err(|e| to_py(&e))
    }

    /// The perspective camera, of which others are not.
    pub(crate) fn pinhole(&self) -> PyResult<Pinhole> {
        if self.projection != "perspective" {
            let text = format!("camera must have the projection 'perspective' here, got '{}'", self.projection);
            return Err(PyValueError::new_err(text));
        }
        self.frame(self.fov)
    }

    pub(crate) fn lens(&self) -> PyResult<Lens> {
        let equal_area = match Projection::named(&self.projection).map_err(|e| to_py(&e))? {
            Projection::Perspective => return Ok(Lens::Pinhole(self.pinhole()?)),
            Projection::Panorama => return Ok(Lens::Panorama([self.width, self.height])),
            Projection::EqualArea => true,
            Projection::Equidistant => false,
        };
        // The axes are those of any perspective camera that looks there.
        let Pinhole { right, up, forward, .. } = self.frame(60.0)?;
        let half = (0.5 * self.fov).to_radians();
        let eye = Fisheye { right, up, forward, half, equal_area, width: self.width, height: self.height };
        eye.validate().map_err(|e| to_py(&e))?;
        Ok(Lens::Fisheye(eye))
    }
}

/// Directions of pixels; zero where there is none.
#[pyfunction]
fn camera_directions(py: Python<'_>, camera: Camera, mut out: PyReadwriteArrayDyn<'_, f64>) -> PyResult<()> {
    let lens = camera.lens()?;
    let rays = lens.rays();
    let out = slice_mut(&mut out, "out")?;
    quick(py, out.len(), |job| rays.directions(job, out))
}

/// Unit vectors to the right and up in a camera's picture, and along its axis.
#[pyfunction]
fn camera_axes(camera: Camera) -> PyResult<[[f64; 3]; 3]> {
    let Pinhole { right, up, forward, .. } = camera.frame(60.0)?;
    Ok([right, up, forward].map(|v| v.to_array()))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(camera_directions, module)?)?;
    module.add_function(wrap_pyfunction!(camera_axes, module)?)?;
    Ok(())
}

//! `_core`: what `pleinair.sky` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use std::sync::Arc;

use glam::DVec3;
use numpy::{PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::clouds::Camera;
use super::run::{long, sized, to_py};
use crate::air::single::March;
use crate::error::Result;
use crate::job::Job;
use crate::sky::aoas::{Aoas, Ground, Settings};
use crate::sky::field::{Field, Look, reference, render};
use crate::sky::light::Dome;
use crate::sky::pattern::{Pattern, Shape, fragment};
use crate::sky::physical::{self, Atmosphere, Physical};

/// What `pleinair.sky.Aoas` says of itself.
#[allow(clippy::struct_excessive_bools, reason = "they are the fields of a Python object")]
#[derive(FromPyObject)]
struct AoasSettings {
    sun: [f64; 3],
    rayleigh: [f64; 3],
    mie: f64,
    g: f64,
    sun_intensity: f64,
    radius_ratio: f64,
    thickness: f64,
    scale_heights: [f64; 2],
    viewer: [f64; 3],
    radial_apex: bool,
    shadow: bool,
    oneil: bool,
    samples: Option<usize>,
    at_start: bool,
    ground: Option<[f64; 3]>,
    disc: f64,
    ambiguity: f64,
    grain: f64,
    cloud_complexity: f64,
    /// Points, radius, whether they are a spline, whether it is closed.
    shapes: Vec<(Vec<[f64; 3]>, f64, bool, bool)>,
    key: u64,
    tolerance: f64,
}

impl AoasSettings {
    fn settings(self) -> Settings {
        let shape = |(points, radius, spline, closed): (Vec<[f64; 3]>, f64, bool, bool)| {
            let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
            if spline { Shape::spline(&points, closed, radius) } else { Shape::points(&points, radius) }
        };
        let viewer = DVec3::from(self.viewer);
        let mut pattern = Pattern::new(self.key);
        pattern.viewer = viewer.as_vec3().to_array();
        pattern.ambiguity = self.ambiguity as f32;
        pattern.grain = self.grain as f32;
        pattern.complexity = self.cloud_complexity as f32;
        pattern.shapes = self.shapes.into_iter().map(shape).collect();
        Settings {
            sun: DVec3::from(self.sun),
            rayleigh: self.rayleigh,
            mie: self.mie,
            g: self.g,
            intensity: self.sun_intensity,
            radius: self.radius_ratio,
            thickness: self.thickness,
            scales: self.scale_heights,
            viewer,
            radial_apex: self.radial_apex,
            shadow: self.shadow,
            polynomial: self.oneil,
            march: self.samples.map(|samples| March { samples, at_start: self.at_start }),
            ground: self.ground.map_or(Ground::Horizon, Ground::Color),
            disc: self.disc,
            pattern,
            tolerance: self.tolerance,
        }
    }
}

/// Nanoseconds of a direction, by which the way into the core is chosen; more where cells are integrated one by one.
const COST: usize = 30;
const COST_LOW_SUN: usize = 400;
const COST_REFERENCE: usize = 100_000;

type Progress<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// A sky ready to be looked at.
#[pyclass(frozen, module = "pleinair._core")]
struct SkyField {
    field: Box<dyn Field + Send + Sync>,
    /// Nanoseconds of a direction.
    cost: usize,
}

#[pymethods]
impl SkyField {
    /// The sky of AOAS.
    #[staticmethod]
    fn aoas(settings: AoasSettings) -> PyResult<Self> {
        let sky = Aoas::new(settings.settings()).map_err(|e| to_py(&e))?;
        let cost = if sky.low_sun() { COST_LOW_SUN } else { COST };
        Ok(Self { field: Box::new(sky), cost })
    }

    /// The sky of an atmosphere.
    #[staticmethod]
    fn physical(
        atmosphere: &SkyAtmosphere,
        sun: [f64; 3],
        intensity: f64,
        altitude: f64,
        disc: f64,
        tolerance: f64,
    ) -> PyResult<Self> {
        let sky = Physical::new(atmosphere.0.clone(), DVec3::from(sun), intensity, altitude, disc, tolerance)
            .map_err(|e| to_py(&e))?;
        Ok(Self { field: Box::new(sky), cost: COST_LOW_SUN })
    }

    #[pyo3(signature = (camera, out, progress=None))]
    fn render(
        &self,
        py: Python<'_>,
        camera: Camera,
        mut out: PyReadwriteArrayDyn<'_, f32>,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let camera = camera.pinhole()?;
        self.look(py, Look::Camera(&camera), slice_mut(&mut out, "out")?, progress)
    }

    #[pyo3(signature = (height, out, progress=None))]
    fn panorama(
        &self,
        py: Python<'_>,
        height: usize,
        mut out: PyReadwriteArrayDyn<'_, f32>,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let all = Look::Panorama { width: 2 * height, height };
        self.look(py, all, slice_mut(&mut out, "out")?, progress)
    }

    #[pyo3(signature = (directions, out, progress=None))]
    fn radiance(
        &self,
        py: Python<'_>,
        directions: PyReadonlyArrayDyn<'_, f64>,
        mut out: PyReadwriteArrayDyn<'_, f32>,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let list = slice(&directions, "directions")?;
        self.look(py, Look::List(list), slice_mut(&mut out, "out")?, progress)
    }

    #[pyo3(signature = (directions, out, progress=None))]
    fn reference(
        &self,
        py: Python<'_>,
        directions: PyReadonlyArrayDyn<'_, f64>,
        mut out: PyReadwriteArrayDyn<'_, f64>,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let look = Look::List(slice(&directions, "directions")?);
        let out = slice_mut(&mut out, "out")?;
        let work = |job: &Job| reference(job, &*self.field, &look, out);
        if progress.is_some() { long(py, progress, work) } else { sized(py, COST_REFERENCE * look.count(), work) }
    }

    /// Irradiance of planes, and the nine harmonics.
    fn irradiance(
        &self,
        py: Python<'_>,
        axis: [f64; 3],
        normals: PyReadonlyArrayDyn<'_, f64>,
        mut out: PyReadwriteArrayDyn<'_, f64>,
    ) -> PyResult<[[f64; 3]; 9]> {
        let (normals, out) = (slice(&normals, "normals")?, slice_mut(&mut out, "out")?);
        let work = |job: &Job| -> Result<_> {
            let dome = Dome::new(job, &*self.field, DVec3::from(axis))?;
            dome.irradiance(job, normals, out)?;
            Ok(dome.harmonics())
        };
        sized(py, 100_000 * self.cost + 80_000 * normals.len(), work)
    }

    /// The sun's light that arrives, for a disc of this radius [rad].
    fn sunlight(&self, radius: f64) -> [f64; 3] {
        self.field.sunlight(radius)
    }

    /// Size of the table above the horizon, if it is made.
    #[getter]
    fn table_size(&self) -> Option<[usize; 2]> {
        self.field.table_size()
    }
}

impl SkyField {
    /// Fill `out` with what is seen.
    fn look(&self, py: Python<'_>, look: Look<'_>, out: &mut [f32], progress: Progress<'_, '_>) -> PyResult<()> {
        let work = |job: &Job| render(job, &*self.field, &look, out);
        if progress.is_some() { long(py, progress, work) } else { sized(py, self.cost * look.count(), work) }
    }
}

/// What `pleinair.sky.Physical` says of its air.
#[derive(FromPyObject)]
struct AirSettings {
    pressure: f64,
    scale_height: f64,
    beta: f64,
    alpha: f64,
    aerosol_scale_height: f64,
    aerosol_albedo: f64,
    g: f64,
    ozone: f64,
    ground_albedo: f64,
}

/// An atmosphere and the light of all orders in it, for every sun.
#[pyclass(frozen, module = "pleinair._core")]
struct SkyAtmosphere(Arc<Atmosphere>);

#[pymethods]
impl SkyAtmosphere {
    #[new]
    fn new(py: Python<'_>, air: AirSettings) -> PyResult<Self> {
        let set = physical::Settings {
            pressure: air.pressure,
            molecules: air.scale_height,
            beta: air.beta,
            alpha: air.alpha,
            aerosol: air.aerosol_scale_height,
            aerosol_albedo: air.aerosol_albedo,
            g: air.g,
            ozone: air.ozone,
            ground_albedo: air.ground_albedo,
        };
        let made = long(py, None, |job| Atmosphere::new(job, set))?;
        Ok(Self(Arc::new(made)))
    }

    /// How many orders of scattering were followed.
    #[getter]
    fn orders(&self) -> usize {
        self.0.followed()
    }
}

/// Where rays meet the unit dome.
#[pyfunction]
fn sky_fragments(
    py: Python<'_>,
    viewer: [f64; 3],
    directions: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (list, out) = (slice(&directions, "directions")?, slice_mut(&mut out, "out")?);
    sized(py, 4 * list.len(), |job| {
        job.bands(out, 3 << 14, |band, out| {
            for (to, from) in out.chunks_exact_mut(3).zip(list[(band * 3) << 14..].chunks_exact(3)) {
                to.copy_from_slice(&fragment(DVec3::from(viewer), DVec3::from_slice(from)).to_array());
            }
            Ok(())
        })
    })
}

/// Add this file's classes and functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<SkyField>()?;
    module.add_class::<SkyAtmosphere>()?;
    module.add_function(wrap_pyfunction!(sky_fragments, module)?)?;
    Ok(())
}

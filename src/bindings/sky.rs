//! `_core`: what `pleinair.sky` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use std::sync::Arc;

use glam::DVec3;
use numpy::{PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::camera::Camera;
use super::run::{long, sized, to_py};
use crate::air::multiple::C;
use crate::air::optics::{self, Optics};
use crate::air::single::RayMarch;
use crate::astro::Observer;
use crate::astro::refraction::RefractingAir;
use crate::astro::selenography::EarthShadow;
use crate::error::Result;
use crate::job::Job;
use crate::sky::aoas::{Aoas, AoasParams, Ground};
use crate::sky::discs::{ApparentStar, Lens};
use crate::sky::light::EnvironmentSampling;
use crate::sky::model::{SkyModel, ViewRays};
use crate::sky::modulation::{Modulation, Shape, fragments};
use crate::sky::natural::{self, Body, DayModel, Natural, SkyScene};
use crate::sky::night::{NightSky, NightSources};
use crate::sky::overcast::{CloudDeck, OvercastSky, SkyGlow};
use crate::sky::perez::Tint;
use crate::sky::physical::{Atmosphere, Physical};
use crate::sky::render::{monte_carlo, reference, render, shown};
use crate::sky::{cie_general, preetham};

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
    polynomial_depth: bool,
    samples: Option<usize>,
    left_rule: bool,
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
    fn settings(self) -> AoasParams {
        let shape = |(points, radius, spline, closed): (Vec<[f64; 3]>, f64, bool, bool)| {
            let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
            if spline { Shape::spline(&points, closed, radius) } else { Shape::points(&points, radius) }
        };
        let viewer = DVec3::from(self.viewer);
        let mut modulation = Modulation::new(self.key);
        modulation.viewer = viewer.as_vec3().to_array();
        modulation.ambiguity = self.ambiguity as f32;
        modulation.grain = self.grain as f32;
        modulation.complexity = self.cloud_complexity as f32;
        modulation.shapes = self.shapes.into_iter().map(shape).collect();
        AoasParams {
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
            polynomial: self.polynomial_depth,
            march: self.samples.map(|samples| RayMarch { samples, left_rule: self.left_rule }),
            ground: self.ground.map_or(Ground::Horizon, Ground::Color),
            disc: self.disc,
            modulation,
            tolerance: self.tolerance,
        }
    }
}

type MoonSeen = ([f64; 3], [f64; 3], f64, f64, [f64; 3], f64, f64);
/// Libration in longitude and latitude, the axis from the zenith; middle of the Earth's shadow, radii of Earth and Sun.
type MoonMarked = ([f64; 2], f64, Option<([f64; 3], f64, f64)>);

/// What `pleinair.sky.Natural` says of itself; lengths in metres, angles in radians, light in lx.
#[allow(clippy::struct_excessive_bools, reason = "they are the fields of a Python object")]
/// What gives the sunlit sky its radiance.
#[derive(FromPyObject)]
enum Day {
    Cie(usize),
    Named(String),
}

#[derive(FromPyObject)]
struct NaturalScene {
    /// Direction as seen, without refraction, angular radius, light over the mean.
    sun: ([f64; 3], [f64; 3], f64, f64),
    /// The same with its illuminance, direction from it to the Sun, earthshine over its light, share of copper light.
    moon: Option<MoonSeen>,
    /// What is on its disc.
    moon_marks: Option<MoonMarked>,
    /// "physical", "preetham", or the number of a type of the CIE.
    day: Day,
    turbidity: f64,
    discs: bool,
    milky_way: bool,
    zodiacal_light: bool,
    airglow: f64,
    /// Seconds since 1970 and a place.
    observer: Option<(f64, [f64; 3])>,
    altitude: f64,
    /// Altitude above the ellipsoid and refractivity over the standard's, if there is refraction.
    refraction: Option<(f64, f64)>,
    /// Zenith luminance of a city's light.
    light_pollution: f64,
    overcast: Option<Deck>,
}

/// What `pleinair.sky.CloudSlab` says of itself.
#[derive(FromPyObject)]
struct Deck {
    optical_depth: f64,
    base: f64,
    thickness: f64,
    g: f64,
    albedo: f64,
}

impl Deck {
    fn deck(&self) -> CloudDeck {
        let Self { optical_depth: depth, base, thickness, g, albedo } = *self;
        CloudDeck { depth, base, thickness, g, albedo }
    }
}

impl NaturalScene {
    fn day_model(&self) -> DayModel {
        match &self.day {
            Day::Cie(kind) => DayModel::CieGeneral(*kind),
            Day::Named(name) if name == "preetham" => DayModel::Preetham,
            Day::Named(_) => DayModel::Atmosphere,
        }
    }

    fn scene(self, job: &Job, atmosphere: &Arc<Atmosphere>, stars: Vec<ApparentStar>) -> Result<SkyScene> {
        let body =
            |to: [f64; 3], truly: [f64; 3], radius, light| Body { to: to.into(), truly: truly.into(), radius, light };
        let sun = body(self.sun.0, self.sun.1, self.sun.2, self.sun.3);
        let (libration, axis, shadow) = self.moon_marks.unwrap_or_default();
        let shadow = shadow.map(|(middle, earth, sun)| EarthShadow { middle: middle.into(), earth, sun });
        let moon = self.moon.map(|(to, truly, radius, light, lit, earthshine, copper)| natural::MoonDisc {
            body: body(to, truly, radius, light),
            sun: DVec3::from(lit),
            earthshine,
            copper,
            libration,
            axis,
            shadow,
        });
        let formula = natural::formula(atmosphere, self.day_model(), self.turbidity, &sun, self.altitude)?;
        let sources = NightSources { milky_way: self.milky_way, zodiacal: self.zodiacal_light, airglow: self.airglow };
        let deck = self.overcast.as_ref().map(Deck::deck);
        let glow = (self.light_pollution > 0.0)
            .then(|| SkyGlow::new(job, atmosphere, self.light_pollution, self.altitude))
            .transpose()?;
        let night = if natural::needs_night_sky(&sun, &sources) {
            let observer = self.observer.map(|(unix, place)| Observer::new(unix, place, None)).transpose()?;
            let albedo = atmosphere.ground_albedo();
            let height = deck.map_or(self.altitude, |deck| deck.top());
            Some(NightSky::new(job, sources, observer.as_ref(), &atmosphere.optics, height, albedo, &stars)?)
        } else {
            None
        };
        let lens = Lens::new(self.refraction.map(|(altitude, scale)| RefractingAir { altitude, scale }));
        Ok(SkyScene { sun, moon, formula, night, stars, discs: self.discs, lens, glow, deck })
    }
}

/// Nanoseconds of a direction, by which the way into the core is chosen; more where cells are integrated one by one.
const COST: usize = 30;
const COST_LOW_SUN: usize = 400;
const COST_REFERENCE: usize = 100_000;

type Progress<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// A sky ready to be looked at.
#[pyclass(frozen, name = "SkyModel", module = "pleinair._core")]
struct Sky {
    field: Box<dyn SkyModel + Send + Sync>,
    /// Nanoseconds of a direction.
    cost: usize,
    /// What it computes, where that depends on the scene.
    components: Vec<&'static str>,
    /// Direction and light of the Moon.
    moon: Option<([f64; 3], [f64; 3])>,
}

impl Sky {
    fn of(field: impl SkyModel + Send + 'static, cost: usize) -> Self {
        Self { field: Box::new(field), cost, components: Vec::new(), moon: None }
    }
}

#[pymethods]
impl Sky {
    /// The sky of AOAS.
    #[staticmethod]
    fn aoas(settings: AoasSettings) -> PyResult<Self> {
        let sky = Aoas::new(settings.settings()).map_err(|e| to_py(&e))?;
        let cost = if sky.low_sun() { COST_LOW_SUN } else { COST };
        Ok(Self::of(sky, cost))
    }

    /// The sky of an atmosphere.
    #[staticmethod]
    fn physical(
        py: Python<'_>,
        atmosphere: &SkyAtmosphere,
        sun: [f64; 3],
        intensity: f64,
        altitude: f64,
        disc: f64,
        overcast: Option<Deck>,
        tolerance: f64,
    ) -> PyResult<Self> {
        let seen = |h| Physical::new(atmosphere.0.clone(), DVec3::from(sun), [intensity; C], h, disc, tolerance);
        let Some(deck) = overcast.map(|d| d.deck()) else {
            return Ok(Self::of(seen(altitude).map_err(|e| to_py(&e))?, COST_LOW_SUN));
        };
        let sky = long(py, None, |job| {
            let skies = [seen(deck.top())?, seen(altitude)?];
            OvercastSky::new(job, &atmosphere.0, deck, skies, altitude, tolerance)
        })?;
        Ok(Self::of(sky, COST_LOW_SUN))
    }

    /// A standard sky of the CIE: even chromaticity, or that of Preetham for a turbidity; light of the disc in lx.
    #[staticmethod]
    fn cie_general(
        kind: usize,
        sun: [f64; 3],
        zenith_luminance: f64,
        chromaticity: [f64; 2],
        turbidity: Option<f64>,
        sun_illuminance: f64,
    ) -> PyResult<Self> {
        let sun = DVec3::from(sun);
        let make = || {
            let tint = turbidity.map_or(Ok(Tint::Even(chromaticity)), |t| preetham::tint(t, sun))?;
            cie_general::sky(kind, sun, zenith_luminance, tint, [sun_illuminance; 3])
        };
        Ok(Self::of(make().map_err(|e| to_py(&e))?, COST))
    }

    /// Preetham's sky; its sun shines through this air.
    #[staticmethod]
    fn preetham(sun: [f64; 3], turbidity: f64, air: AirSettings, intensity: f64) -> PyResult<Self> {
        let sun = DVec3::from(sun);
        let make = || {
            let optics = Optics::new(&Job::serial(), &air.settings())?;
            preetham::sky(turbidity, sun, optics.attenuated(0.0, sun.z.max(0.0), &[intensity; C]))
        };
        Ok(Self::of(make().map_err(|e| to_py(&e))?, COST))
    }

    /// A sky by day and by night. Stars: directions and light above the air.
    #[staticmethod]
    fn natural(
        py: Python<'_>,
        atmosphere: &SkyAtmosphere,
        scene: NaturalScene,
        stars: PyReadonlyArrayDyn<'_, f64>,
        starlight: PyReadonlyArrayDyn<'_, f64>,
        tolerance: f64,
    ) -> PyResult<Self> {
        let (to, light) = (slice(&stars, "stars")?, slice(&starlight, "starlight")?);
        let star = |(to, light): (&[f64; 3], &[f64; 3])| ApparentStar { to: DVec3::from(*to), light: *light };
        let list = to.as_chunks().0.iter().zip(light.as_chunks().0).map(star).collect();
        let made = long(py, None, |job| {
            let altitude = scene.altitude;
            let scene = scene.scene(job, &atmosphere.0, list)?;
            Natural::new(job, atmosphere.0.clone(), scene, altitude, tolerance)
        })?;
        let components = made.components();
        let moon = made.moonlight().map(|(to, light)| (to.to_array(), light));
        Ok(Self { components, moon, ..Self::of(made, COST_LOW_SUN) })
    }

    #[pyo3(signature = (camera, out, progress=None))]
    fn render(
        &self,
        py: Python<'_>,
        camera: Camera,
        mut out: PyReadwriteArrayDyn<'_, f32>,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let lens = camera.lens()?;
        self.radiance_along(py, lens.rays(), slice_mut(&mut out, "out")?, progress)
    }

    /// The levels that a display shows of a camera's picture: its peak, ambient light and adaptation [cd/m2].
    #[pyo3(signature = (camera, out, adaptation, display, night, progress=None))]
    fn show(
        &self,
        py: Python<'_>,
        camera: Camera,
        mut out: PyReadwriteArrayDyn<'_, u8>,
        adaptation: f64,
        display: [f64; 3],
        night: bool,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let (lens, out) = (camera.lens()?, slice_mut(&mut out, "out")?);
        let operator = super::tone::operator(adaptation, display);
        let look = lens.rays();
        let work = |job: &Job| shown(job, &*self.field, &look, (&operator, night), out);
        if progress.is_some() { long(py, progress, work) } else { sized(py, self.cost * look.count(), work) }
    }

    #[pyo3(signature = (height, out, progress=None))]
    fn panorama(
        &self,
        py: Python<'_>,
        height: usize,
        mut out: PyReadwriteArrayDyn<'_, f32>,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let all = ViewRays::Panorama { width: 2 * height, height };
        self.radiance_along(py, all, slice_mut(&mut out, "out")?, progress)
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
        self.radiance_along(py, ViewRays::List(list), slice_mut(&mut out, "out")?, progress)
    }

    #[pyo3(signature = (directions, out, progress=None))]
    fn reference(
        &self,
        py: Python<'_>,
        directions: PyReadonlyArrayDyn<'_, f64>,
        mut out: PyReadwriteArrayDyn<'_, f64>,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let look = ViewRays::List(slice(&directions, "directions")?);
        let out = slice_mut(&mut out, "out")?;
        let work = |job: &Job| reference(job, &*self.field, &look, out);
        if progress.is_some() { long(py, progress, work) } else { sized(py, COST_REFERENCE * look.count(), work) }
    }

    /// Radiance and its standard error, by so many paths.
    #[pyo3(signature = (directions, paths, key, out, progress=None))]
    fn monte_carlo(
        &self,
        py: Python<'_>,
        directions: PyReadonlyArrayDyn<'_, f64>,
        paths: usize,
        key: u64,
        mut out: PyReadwriteArrayDyn<'_, f64>,
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let (list, out) = (slice(&directions, "directions")?, slice_mut(&mut out, "out")?);
        long(py, progress, |job| monte_carlo(job, &*self.field, list, (paths, key), out))
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
            let sampling = EnvironmentSampling::new(job, &*self.field, DVec3::from(axis))?;
            sampling.irradiance(job, normals, out)?;
            Ok(sampling.harmonics())
        };
        sized(py, 100_000 * self.cost + 80_000 * normals.len(), work)
    }

    /// The sun's light that arrives, for a disc of this radius [rad].
    fn direct_irradiance(&self, radius: f64) -> [f64; 3] {
        self.field.direct_irradiance(radius)
    }

    /// What is computed.
    #[getter]
    fn components(&self) -> Vec<&'static str> {
        self.components.clone()
    }

    /// Direction of the Moon and the light of its disc that arrives.
    #[getter]
    fn moonlight(&self) -> Option<([f64; 3], [f64; 3])> {
        self.moon
    }

    /// Size of the table above the horizon, if it is made.
    #[getter]
    fn table_size(&self) -> Option<[usize; 2]> {
        self.field.table_size()
    }
}

impl Sky {
    /// Fill `out` with what is seen.
    fn radiance_along(
        &self,
        py: Python<'_>,
        look: ViewRays<'_>,
        out: &mut [f32],
        progress: Progress<'_, '_>,
    ) -> PyResult<()> {
        let work = |job: &Job| render(job, &*self.field, &look, out);
        if progress.is_some() { long(py, progress, work) } else { sized(py, self.cost * look.count(), work) }
    }
}

/// What `pleinair.sky.Physical` says of its air.
#[derive(FromPyObject)]
struct AirSettings {
    pressure: f64,
    scale_height: Option<f64>,
    top: f64,
    beta: f64,
    alpha: f64,
    aerosol_scale_height: f64,
    aerosol_albedo: f64,
    g: f64,
    ozone: f64,
    ground_albedo: f64,
}

impl AirSettings {
    fn settings(&self) -> optics::AirComposition {
        optics::AirComposition {
            pressure: self.pressure,
            rayleigh_scale_height: self.scale_height,
            top: self.top,
            beta: self.beta,
            alpha: self.alpha,
            aerosol_scale_height: self.aerosol_scale_height,
            aerosol_albedo: self.aerosol_albedo,
            g: self.g,
            ozone: self.ozone,
            ground_albedo: self.ground_albedo,
        }
    }
}

/// An atmosphere and the light of all orders in it, for every sun.
#[pyclass(frozen, module = "pleinair._core")]
struct SkyAtmosphere(Arc<Atmosphere>);

#[pymethods]
impl SkyAtmosphere {
    #[new]
    fn new(py: Python<'_>, air: AirSettings) -> PyResult<Self> {
        let set = air.settings();
        let made = long(py, None, |job| Atmosphere::new(job, set))?;
        Ok(Self(Arc::new(made)))
    }

    /// How many orders of scattering were followed.
    #[getter]
    fn orders(&self) -> usize {
        self.0.num_orders()
    }
}

/// Where rays meet the unit dome.
#[pyfunction]
fn sky_dome_points(
    py: Python<'_>,
    viewer: [f64; 3],
    directions: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (list, out) = (slice(&directions, "directions")?, slice_mut(&mut out, "out")?);
    sized(py, 4 * list.len(), |job| fragments(job, DVec3::from(viewer), list, out))
}

/// Add this file's classes and functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("PREETHAM_TURBIDITY", (preetham::TURBIDITY[0], preetham::TURBIDITY[1]))?;
    module.add_class::<Sky>()?;
    module.add_class::<SkyAtmosphere>()?;
    module.add_function(wrap_pyfunction!(sky_dome_points, module)?)?;
    Ok(())
}

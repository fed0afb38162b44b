//! `_core`: what `pleinair.fit` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use numpy::{IntoPyArray, PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use super::arrays::slice;
use super::clouds::conventions;
use super::run::{long, quick, sized, to_py};
use crate::clouds::bases::BasisImages;
use crate::clouds::orders::BasisNodes;
use crate::error::Error;
use crate::fit::clouds::{evaluate, search};
use crate::fit::differential::{self, Differential};
use crate::fit::genetic::{Genetic, Rates};
use crate::fit::grain;
use crate::fit::intervals::intervals;
use crate::fit::noise_floor::noise_floor;
use crate::fit::objective::Objective;
use crate::fit::photo;
use crate::fit::search::{self, Record, Scale, SearchSettings, Stop};

/// Settings of a search, as attributes of a Python object.
#[derive(FromPyObject)]
struct PySettings {
    method: String,
    bounds: Vec<(f64, f64)>,
    scales: Vec<String>,
    population: usize,
    generations: usize,
    target: f64,
    patience: usize,
    n_best: usize,
    min_separation: f64,
    key: u64,
    bits: u32,
    crossover: f64,
    mutation: f64,
    first: Option<usize>,
    polish: bool,
}

type Boxed = Box<dyn search::Search + Send + Sync>;

fn begin(s: PySettings) -> PyResult<Boxed> {
    let settings = SearchSettings {
        bounds: s.bounds,
        scales: s.scales.iter().map(|name| Scale::named(name)).collect::<Result<_, _>>().map_err(|e| to_py(&e))?,
        population: s.population,
        generations: s.generations,
        target: s.target,
        patience: s.patience,
        n_best: s.n_best,
        min_separation: s.min_separation,
        key: s.key,
    };
    let first = s.first.unwrap_or_else(|| differential::population(settings.calls()));
    let rates = Rates { bits: s.bits, crossover: s.crossover, mutation: s.mutation };
    let begun = match s.method.as_str() {
        "ga" => Genetic::new(settings, rates).map(|x| Box::new(x) as Boxed),
        "differential" => Differential::new(settings, first, s.polish).map(|x| Box::new(x) as Boxed),
        other => {
            let reason = format!("must be \"differential\" or \"ga\", got {other:?}");
            Err(Error::Data { name: "method", reason })
        }
    };
    begun.map_err(|e| to_py(&e))
}

type Ranked = Vec<(Vec<f64>, f64)>;
type History = Vec<(f64, f64, usize)>;

fn outcome(record: &Record) -> (Ranked, History, &'static str) {
    let stopped = match record.stopped() {
        None => "running",
        Some(Stop::Target) => "target",
        Some(Stop::Patience) => "patience",
        Some(Stop::Generations) => "generations",
    };
    (
        record.ranked().iter().map(|r| (r.x.clone(), r.value)).collect(),
        record.history().iter().map(|g| (g.best, g.mean, g.calls)).collect(),
        stopped,
    )
}

/// A search, one population at a time.
#[pyclass(module = "pleinair._core", name = "Search")]
struct Search(Boxed);

#[pymethods]
impl Search {
    #[new]
    fn new(settings: PySettings) -> PyResult<Self> {
        begin(settings).map(Self)
    }

    /// Parameters to evaluate.
    fn ask(&self) -> Vec<Vec<f64>> {
        self.0.ask()
    }

    /// Take their objectives; true when the search has ended.
    fn tell(&mut self, values: Vec<f64>) -> PyResult<bool> {
        self.0.tell(&values).map_err(|e| to_py(&e))?;
        Ok(self.0.record().stopped().is_some())
    }

    /// Objective calls so far.
    fn calls(&self) -> usize {
        self.0.record().calls()
    }

    /// Extent of each parameter among the individuals within `within` of the best, as a fraction of its range.
    fn spread(&self, within: f64) -> Vec<f64> {
        self.0.record().spread(within)
    }

    /// Ranked individuals, history and why it stopped.
    fn outcome(&self) -> (Ranked, History, &'static str) {
        outcome(self.0.record())
    }
}

/// Nodes (g, sigma_t, exponents), the coefficients of a mixture of images, and those images.
type PyOrders<'py> = ((Vec<f64>, Vec<f64>, Vec<f64>), PyReadonlyArrayDyn<'py, f32>, PyReadonlyArrayDyn<'py, f32>);

/// The fused objective of eq 2 on a basis.
#[pyclass(module = "pleinair._core", name = "CloudObjective", frozen)]
struct CloudObjective(Objective);

#[pymethods]
impl CloudObjective {
    #[new]
    #[pyo3(signature = (depth, cosine, scattered, nodes, sky, haze_distance, color, histogram, haze, conventions, orders=None, light_path=None, ambient_color=None, opacity=false))]
    fn new(
        py: Python<'_>,
        depth: PyReadonlyArrayDyn<'_, f32>,
        cosine: PyReadonlyArrayDyn<'_, f32>,
        scattered: PyReadonlyArrayDyn<'_, f32>,
        nodes: Vec<f64>,
        sky: PyReadonlyArrayDyn<'_, f32>,
        haze_distance: Option<PyReadonlyArrayDyn<'_, f32>>,
        color: [f64; 3],
        histogram: PyReadonlyArrayDyn<'_, f64>,
        haze: Vec<f64>,
        conventions: (String, String, String),
        orders: Option<PyOrders<'_>>,
        light_path: Option<PyReadonlyArrayDyn<'_, f32>>,
        ambient_color: Option<[f64; 3]>,
        opacity: bool,
    ) -> PyResult<Self> {
        let how = self::conventions((&conventions.0, &conventions.1, &conventions.2))?;
        let haze_distance = haze_distance.as_ref().map(|a| slice(a, "haze_distance")).transpose()?;
        let light_path = light_path.as_ref().map(|a| slice(a, "light_path")).transpose()?;
        let parts = BasisImages {
            column_density: slice(&depth, "depth")?,
            cosine: slice(&cosine, "cosine")?,
            single_scattering: slice(&scattered, "scattered")?,
            nodes: &nodes,
            multiple: None,
            sky: slice(&sky, "sky")?,
            haze_distance,
            light_path,
        };
        let target = slice(&histogram, "histogram")?;
        let orders = match &orders {
            None => None,
            Some((nodes, coefficients, images)) => {
                let (g, sigma, exponents) = nodes.clone();
                let orders =
                    BasisNodes { g, sigma, exponents, coefficients: slice(coefficients, "coefficients")?.to_vec() };
                Some((orders, slice(images, "multiple")?.to_vec()))
            }
        };
        let objective = quick(py, 0, |_| {
            let objective = Objective::new(&parts, color, target, haze, how)?;
            let objective = objective.with_ambient(ambient_color.unwrap_or(color))?;
            let objective = if opacity { objective.with_opacity()? } else { objective };
            match orders {
                None => Ok(objective),
                Some((orders, images)) => objective.with_orders(orders, images),
            }
        })?;
        Ok(Self(objective))
    }

    /// Cloud pixels.
    fn pixels(&self) -> usize {
        self.0.pixels()
    }

    /// Objective and haze of each row `(intensity, g, sigma_t, albedo, ambient)`: four numbers a row.
    fn evaluate<'py>(&self, py: Python<'py>, population: Vec<[f64; 5]>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let population: Vec<Vec<f64>> = population.into_iter().map(|x| x.to_vec()).collect();
        let work = population.len() * self.0.pixels();
        let values = quick(py, work, |job| evaluate(&self.0, &population, job))?;
        let flat: Vec<f64> = values.iter().flat_map(|v| [v.objective, v.haze[0], v.haze[1], v.haze[2]]).collect();
        Ok(flat.into_pyarray(py))
    }

    /// Counts of the cloud pixels, (3, hazes, bins); none outside the basis.
    fn histograms<'py>(&self, py: Python<'py>, gene: [f64; 5]) -> PyResult<Option<Bound<'py, PyArray1<u32>>>> {
        let counts = quick(py, 0, |_| Ok(self.0.histograms(gene)))?;
        Ok(counts.map(|c| c.into_pyarray(py)))
    }

    /// Noise floor of the objective.
    fn noise_floor(&self, py: Python<'_>, key: u64) -> PyResult<f64> {
        quick(py, 0, |job| noise_floor(self.0.target(), self.0.pixels(), key, job))
    }

    /// Interval of each parameter at a level; `best` is the best objective, `floor` the noise floor.
    fn intervals(
        &self,
        py: Python<'_>,
        settings: PySettings,
        best: f64,
        floor: f64,
        level: f64,
    ) -> PyResult<Vec<(f64, f64)>> {
        let begun = begin(settings)?;
        long(py, None, move |job| intervals(&self.0, begun.record().settings(), (best, floor), level, job))
    }

    /// Run a search to its end: what it found, the noise floor, and the spread of each parameter within it.
    #[pyo3(signature = (settings, progress=None))]
    fn search(
        &self,
        py: Python<'_>,
        settings: PySettings,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Ranked, History, &'static str, f64, Vec<f64>)> {
        let key = settings.key;
        let mut begun = begin(settings)?;
        let (floor, begun) = long(py, progress, move |job| {
            search(&self.0, &mut *begun, job)?;
            Ok((noise_floor(self.0.target(), self.0.pixels(), key, job)?, begun))
        })?;
        let (ranked, history, stopped) = outcome(begun.record());
        Ok((ranked, history, stopped, floor, begun.record().spread(floor)))
    }
}

/// Mean colour where `mask` is set.
#[pyfunction]
fn fit_mean(
    py: Python<'_>,
    rgb: PyReadonlyArrayDyn<'_, f32>,
    mask: PyReadonlyArrayDyn<'_, bool>,
) -> PyResult<[f64; 3]> {
    let (rgb, mask) = (slice(&rgb, "rgb")?, slice(&mask, "mask")?);
    quick(py, 0, |_| photo::mean(rgb, mask))
}

/// Histograms (3, bins) of the pixels where `mask` is set.
#[pyfunction]
fn fit_histogram<'py>(
    py: Python<'py>,
    rgb: PyReadonlyArrayDyn<'py, f32>,
    mask: PyReadonlyArrayDyn<'py, bool>,
    bins: usize,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (rgb, mask) = (slice(&rgb, "rgb")?, slice(&mask, "mask")?);
    let counts = quick(py, mask.len(), |job| photo::histograms(rgb, mask, bins, job))?;
    Ok(counts.into_pyarray(py))
}

/// Deviation of the noise of each encoded channel where `clear` is set.
#[pyfunction]
fn grain_deviation(
    py: Python<'_>,
    rgb: PyReadonlyArrayDyn<'_, f32>,
    size: [usize; 2],
    clear: PyReadonlyArrayDyn<'_, bool>,
) -> PyResult<[f64; 3]> {
    let (rgb, clear) = (slice(&rgb, "rgb")?, slice(&clear, "clear")?);
    sized(py, 20 * rgb.len(), |job| grain::deviation(rgb, size, clear, job))
}

/// A picture with such noise, flat.
#[pyfunction]
fn grain_add<'py>(
    py: Python<'py>,
    rgb: PyReadonlyArrayDyn<'py, f32>,
    deviation: [f64; 3],
    key: u64,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let rgb = slice(&rgb, "rgb")?;
    Ok(sized(py, 20 * rgb.len(), |job| grain::add(rgb, deviation, key, job))?.into_pyarray(py))
}

/// Add this file's classes to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Search>()?;
    module.add_class::<CloudObjective>()?;
    module.add_function(wrap_pyfunction!(fit_mean, module)?)?;
    module.add_function(wrap_pyfunction!(fit_histogram, module)?)?;
    module.add_function(wrap_pyfunction!(grain_deviation, module)?)?;
    module.add_function(wrap_pyfunction!(grain_add, module)?)
}

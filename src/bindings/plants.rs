//! `_core`: what `pleinair.plants` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use glam::DVec3;
use numpy::{IntoPyArray, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use super::arrays::slice;
use super::run::quick;
use super::surfaces::{Array, flat, points, triples};
use crate::plants::cage::QuadMesh;
use crate::plants::leaves::{self, Foliage};
use crate::plants::skeleton::{Branches, Growth, Skeleton, Trunk, Varied};
use crate::plants::square::Square;
use crate::plants::subdivide::subdivide;

type Pair = (f64, f64);

fn varied((base, sigma): Pair) -> Varied {
    Varied { base, sigma }
}

fn angles((base, sigma): Pair) -> Varied {
    Varied { base: base.to_radians(), sigma: sigma.to_radians() }
}

/// `pleinair.plants.TrunkParams`.
#[derive(FromPyObject)]
struct PyTrunk {
    width: Pair,
    max_height: Option<f64>,
    steps: usize,
    max_length: Pair,
    length: Pair,
    twist: Pair,
    taper: Pair,
    bend: f64,
    roughness: f64,
    tropism: f64,
}

/// `pleinair.plants.BranchParams`.
#[derive(FromPyObject)]
struct PyBranches {
    low: f64,
    high: Option<f64>,
    probability: f64,
    joint: Pair,
    joint_taper: Pair,
    angle: f64,
    profile: [f64; 3],
    steps: usize,
    max_length: Pair,
    length: Pair,
    twist: Pair,
    taper: Pair,
    bend: f64,
    roughness: f64,
    tropism: f64,
}

/// `pleinair.plants.LeafParams`.
#[derive(FromPyObject)]
struct PyFoliage {
    lowest_step: usize,
    trim_top: usize,
    from_center: usize,
    from_tip: usize,
    first_level: usize,
    probability: f64,
    angle: f64,
    distance: f64,
    steps: usize,
    wobble: f64,
    droop: f64,
    center: Option<[f64; 3]>,
    size: [f64; 2],
    variance: f64,
    inside_growth: f64,
    fades: bool,
    bias: f64,
    threshold_sigma: f64,
    fade_length: Pair,
    fade_min: f64,
    outer: f64,
}

impl PyTrunk {
    fn core(self) -> Trunk {
        Trunk {
            width: varied(self.width),
            max_height: self.max_height.unwrap_or(f64::INFINITY),
            growth: Growth {
                steps: self.steps,
                max_length: varied(self.max_length),
                length: varied(self.length),
                twist: angles(self.twist),
                taper: varied(self.taper),
                bend: self.bend.to_radians(),
                roughness: self.roughness,
                tropism: self.tropism.to_radians(),
            },
        }
    }
}

impl PyBranches {
    fn core(self) -> Branches {
        Branches {
            range: [self.low, self.high.unwrap_or(f64::INFINITY)],
            probability: self.probability,
            joint: varied(self.joint),
            joint_taper: varied(self.joint_taper),
            angle: self.angle.to_radians(),
            profile: self.profile,
            growth: Growth {
                steps: self.steps,
                max_length: varied(self.max_length),
                length: varied(self.length),
                twist: angles(self.twist),
                taper: varied(self.taper),
                bend: self.bend.to_radians(),
                roughness: self.roughness,
                tropism: self.tropism.to_radians(),
            },
        }
    }
}

impl PyFoliage {
    fn core(self) -> Foliage {
        Foliage {
            lowest_step: self.lowest_step,
            trim_top: self.trim_top,
            from_center: self.from_center,
            from_tip: self.from_tip,
            first_level: self.first_level,
            probability: self.probability,
            angle: self.angle.to_radians(),
            distance: self.distance,
            steps: self.steps,
            wobble: self.wobble.to_radians(),
            droop: self.droop.to_radians(),
            center: self.center.map(DVec3::from),
            size: self.size,
            variance: self.variance,
            inside_growth: self.inside_growth,
            fades: self.fades,
            bias: self.bias,
            threshold_sigma: self.threshold_sigma,
            fade: varied(self.fade_length),
            fade_min: self.fade_min,
            outer: self.outer,
        }
    }
}

/// Vertices, quads, normals, and of a tree stem, step and place along the stem.
type MeshArrays<'py> =
    (Array<'py, f64>, Array<'py, u32>, Array<'py, f64>, Array<'py, u32>, Array<'py, f32>, Array<'py, f32>);

fn arrays(py: Python<'_>, mesh: QuadMesh, normals: Vec<DVec3>) -> MeshArrays<'_> {
    let column = |get: fn(&crate::plants::cage::Origin) -> f32| -> Vec<f32> { mesh.origins.iter().map(get).collect() };
    let (step, s) = (column(|o| o.step), column(|o| o.s));
    let stem: Vec<u32> = mesh.origins.iter().map(|o| o.stem).collect();
    (
        points(py, mesh.vertices),
        flat(py, mesh.quads),
        points(py, normals),
        stem.into_pyarray(py),
        step.into_pyarray(py),
        s.into_pyarray(py),
    )
}

/// Trunk and branches of a tree, before any mesh.
#[pyclass(frozen, module = "pleinair._core")]
pub(crate) struct TreeSkeleton {
    tree: Skeleton,
    unit: f64,
}

#[pymethods]
impl TreeSkeleton {
    #[new]
    fn new(
        py: Python<'_>,
        trunk: PyTrunk,
        branches: Vec<PyBranches>,
        unit: f64,
        trunk_key: u64,
        branch_key: u64,
    ) -> PyResult<Self> {
        let trunk = trunk.core();
        let branches: Vec<Branches> = branches.into_iter().map(PyBranches::core).collect();
        let tree = quick(py, 0, |_| Skeleton::grow(&trunk, &branches, [trunk_key, branch_key]))?;
        Ok(Self { tree, unit })
    }

    /// From stems of others: level, points of the axis, widths.
    #[staticmethod]
    fn from_lines(py: Python<'_>, lines: Vec<(usize, Vec<[f64; 3]>, Vec<f64>)>, unit: f64) -> PyResult<Self> {
        let lines: Vec<_> =
            lines.into_iter().map(|(level, at, w)| (level, at.into_iter().map(DVec3::from).collect(), w)).collect();
        let tree = quick(py, 0, |_| Skeleton::from_lines(&lines))?;
        Ok(Self { tree, unit })
    }

    /// Mesh at a level of detail, subdivided.
    fn mesh<'py>(&self, py: Python<'py>, level: u32, subdivisions: usize) -> PyResult<MeshArrays<'py>> {
        let (mesh, normals) = quick(py, 0, |_| {
            let mesh = subdivide(self.tree.mesh(level, self.unit), subdivisions)?;
            let normals = mesh.normals();
            Ok((mesh, normals))
        })?;
        Ok(arrays(py, mesh, normals))
    }

    /// For each stem: level, parent stem, ring and side (all 2^32 - 1 of the trunk), first ring, number of rings.
    fn stems<'py>(&self, py: Python<'py>) -> Array<'py, u32> {
        let row = |s: &crate::plants::skeleton::Stem| {
            let [a, b, c] = s.parent.map_or([u32::MAX; 3], |p| p.map(|x| x as u32));
            [s.level as u32, a, b, c, s.rings[0] as u32, s.rings[1] as u32]
        };
        flat(py, self.tree.stems.iter().map(row).collect())
    }

    /// Centres, axes and distances along the stem of all rings, and the numbers drawn for their steps.
    fn rings<'py>(&self, py: Python<'py>) -> (Array<'py, f64>, Array<'py, f64>, Array<'py, f64>, Array<'py, f64>) {
        let rings = &self.tree.rings;
        (
            points(py, rings.iter().map(|r| r.center * self.unit).collect()),
            points(py, rings.iter().map(|r| r.axis).collect()),
            rings.iter().map(|r| r.along * self.unit).collect::<Vec<_>>().into_pyarray(py),
            flat(py, self.tree.steps.iter().map(|&[l, t, p, b]| [l, t.to_degrees(), p, b.to_degrees()]).collect()),
        )
    }

    /// Leaves: position, normal, distance along the chain, order, stem, label, id.
    #[allow(clippy::type_complexity, reason = "one array for each column")]
    fn leaves<'py>(
        &self,
        py: Python<'py>,
        params: PyFoliage,
        key: u64,
    ) -> PyResult<(
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, f32>,
        Array<'py, u16>,
        Array<'py, u32>,
        Array<'py, u32>,
        Array<'py, i64>,
    )> {
        let how = params.core();
        let work = self.tree.rings.len() * 4 * how.steps;
        let all = quick(py, work, |job| leaves::emit(&self.tree, &how, self.unit, key, job))?;
        Ok((
            points(py, all.position),
            points(py, all.normal),
            all.branch_distance.into_pyarray(py),
            all.order.into_pyarray(py),
            all.stem.into_pyarray(py),
            all.label.into_pyarray(py),
            all.id.into_pyarray(py),
        ))
    }
}

/// Ratios, sizes and fades of leaves: centre, distance from it, its ratio, ratio along the chain, size, fade.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "one array for each column")]
fn plants_leaf_attributes<'py>(
    py: Python<'py>,
    position: PyReadonlyArrayDyn<'py, f64>,
    branch_distance: PyReadonlyArrayDyn<'py, f32>,
    id: PyReadonlyArrayDyn<'py, i64>,
    params: PyFoliage,
    unit: f64,
) -> PyResult<([f64; 3], Array<'py, f32>, Array<'py, f32>, Array<'py, f32>, Array<'py, f32>, Array<'py, f32>)> {
    let how = params.core();
    let at: Vec<DVec3> = triples(&position, "position")?.iter().map(|&p| DVec3::from(p)).collect();
    let (far, id) = (slice(&branch_distance, "branch_distance")?, slice(&id, "id")?);
    let d = quick(py, 0, |_| leaves::dress(&at, far, id, &how, unit))?;
    Ok((
        d.center.to_array(),
        d.center_distance.into_pyarray(py),
        d.center_ratio.into_pyarray(py),
        d.branch_ratio.into_pyarray(py),
        flat(py, d.size),
        flat(py, d.fade),
    ))
}

/// The square nearest to a quadrilateral, or None.
#[pyfunction]
fn plants_square(quad: [[f64; 3]; 4]) -> Option<[[f64; 3]; 4]> {
    Square::nearest(quad.map(DVec3::from)).map(|s| s.corners().map(|c| c.to_array()))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<TreeSkeleton>()?;
    module.add_function(wrap_pyfunction!(plants_leaf_attributes, module)?)?;
    module.add_function(wrap_pyfunction!(plants_square, module)?)?;
    Ok(())
}

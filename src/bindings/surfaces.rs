//! `_core`: what `pleinair.plants` calls for surfaces.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use glam::DVec3;
use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::slice;
use super::run::quick;
use crate::plants::cage::QuadMesh;
use crate::plants::nurbs::{Direction, Nurbs};
use crate::plants::strata::{self, Strata};
use crate::plants::subdivide::subdivide;
use crate::plants::surface::{Surface, SurfacePoint};

pub(super) type Array<'py, T> = Bound<'py, PyArray1<T>>;

pub(super) fn flat<T: Element, const N: usize>(py: Python<'_>, rows: Vec<[T; N]>) -> Array<'_, T> {
    rows.into_flattened().into_pyarray(py)
}

pub(super) fn points(py: Python<'_>, rows: Vec<DVec3>) -> Array<'_, f64> {
    flat(py, rows.into_iter().map(|p| p.to_array()).collect())
}

pub(super) fn triples<'a, T: Element>(array: &'a PyReadonlyArrayDyn<'_, T>, name: &str) -> PyResult<&'a [[T; 3]]> {
    exact(slice(array, name)?.as_chunks::<3>(), name)
}

pub(super) fn pairs<'a>(array: &'a PyReadonlyArrayDyn<'_, f64>, name: &str) -> PyResult<&'a [[f64; 2]]> {
    exact(slice(array, name)?.as_chunks::<2>(), name)
}

pub(super) fn exact<'a, T, const N: usize>((rows, rest): (&'a [[T; N]], &[T]), name: &str) -> PyResult<&'a [[T; N]]> {
    if rest.is_empty() { Ok(rows) } else { Err(PyValueError::new_err(format!("{name} must have shape (n, {N})"))) }
}

/// Catmull-Clark subdivision: vertices, quads and normals.
#[pyfunction]
fn plants_subdivide<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArrayDyn<'py, f64>,
    quads: PyReadonlyArrayDyn<'py, u32>,
    levels: usize,
) -> PyResult<(Array<'py, f64>, Array<'py, u32>, Array<'py, f64>)> {
    let mesh = QuadMesh {
        vertices: triples(&vertices, "vertices")?.iter().map(|&p| DVec3::from(p)).collect(),
        quads: exact(slice(&quads, "faces")?.as_chunks::<4>(), "faces")?.to_vec(),
        origins: Vec::new(),
    };
    let (mesh, normals) = quick(py, 0, |_| {
        let mesh = subdivide(mesh, levels)?;
        let normals = mesh.normals();
        Ok((mesh, normals))
    })?;
    Ok((points(py, mesh.vertices), flat(py, mesh.quads), points(py, normals)))
}

/// Triangles of a grid of vertices.
#[pyfunction]
fn plants_grid_faces(py: Python<'_>, rows: usize, columns: usize) -> Array<'_, u32> {
    flat(py, strata::grid_faces(rows, columns))
}

/// Unit normals of the vertices of a triangulated surface; refuses one that is none.
#[pyfunction]
fn plants_normals<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArrayDyn<'py, f64>,
    faces: PyReadonlyArrayDyn<'py, u32>,
) -> PyResult<Array<'py, f64>> {
    let surface = Surface { vertices: triples(&vertices, "vertices")?, faces: triples(&faces, "faces")? };
    let normals = quick(py, 0, |_| {
        surface.validate()?;
        Ok(surface.normals())
    })?;
    Ok(flat(py, normals))
}

/// `pleinair.plants.Strata`.
#[derive(FromPyObject)]
struct PyStrata {
    spans: [usize; 2],
    count: usize,
    fade_from: f64,
    fade_length: f64,
    fade_min: f64,
    size: [f64; 2],
    unit: f64,
    variance: f64,
    inside_growth: f64,
}

/// Places in the unit square, heights, random normals, sizes, fades, labels.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "one array for each column")]
fn plants_scatter(
    py: Python<'_>,
    params: PyStrata,
    key: u64,
) -> PyResult<(Array<'_, f64>, Array<'_, f64>, Array<'_, f64>, Array<'_, f32>, Array<'_, f32>, Array<'_, u32>)> {
    let how = Strata {
        spans: params.spans,
        count: params.count,
        fade_from: params.fade_from,
        fade: [params.fade_length, params.fade_min],
        size: params.size.map(|s| s * params.unit),
        variance: params.variance,
        inside_growth: params.inside_growth,
    };
    let all = quick(py, 0, |_| strata::scatter(&how, key))?;
    Ok((
        flat(py, all.uv),
        all.height.into_pyarray(py),
        flat(py, all.random),
        flat(py, all.size),
        flat(py, all.fade),
        all.label.into_pyarray(py),
    ))
}

fn places(py: Python<'_>, places: Vec<SurfacePoint>) -> (Array<'_, u32>, Array<'_, f64>) {
    let face: Vec<u32> = places.iter().map(|p| p.face).collect();
    (face.into_pyarray(py), flat(py, places.into_iter().map(|p| p.barycentric).collect()))
}

/// Faces and barycentric weights of places on a grid.
#[pyfunction]
fn plants_on_grid<'py>(
    py: Python<'py>,
    uv: PyReadonlyArrayDyn<'py, f64>,
    rows: usize,
    columns: usize,
) -> PyResult<(Array<'py, u32>, Array<'py, f64>)> {
    let uv = pairs(&uv, "uv")?;
    let all = quick(py, 0, |_| Ok(strata::on_grid(uv, rows, columns)))?;
    Ok(places(py, all))
}

/// Faces and barycentric weights of places on a mesh, by area.
#[pyfunction]
fn plants_by_area<'py>(
    py: Python<'py>,
    uv: PyReadonlyArrayDyn<'py, f64>,
    spans: [usize; 2],
    vertices: PyReadonlyArrayDyn<'py, f64>,
    faces: PyReadonlyArrayDyn<'py, u32>,
) -> PyResult<(Array<'py, u32>, Array<'py, f64>)> {
    let surface = Surface { vertices: triples(&vertices, "vertices")?, faces: triples(&faces, "faces")? };
    let uv = pairs(&uv, "uv")?;
    let all = quick(py, 0, |_| strata::by_area(uv, spans, &surface))?;
    Ok(places(py, all))
}

/// Points moved by `(2 height - 1) displacement` along their normals, and the normals.
fn lifted<'py>(
    py: Python<'py>,
    at: Vec<(DVec3, DVec3)>,
    height: &[f64],
    displacement: f64,
) -> (Array<'py, f64>, Array<'py, f64>) {
    let moved = crate::plants::surface::lift(&at, height, displacement);
    (points(py, moved), points(py, at.into_iter().map(|p| p.1).collect()))
}

/// Positions and normals of particles bound to a triangulated surface.
#[pyfunction]
fn plants_carry<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArrayDyn<'py, f64>,
    normals: PyReadonlyArrayDyn<'py, f64>,
    faces: PyReadonlyArrayDyn<'py, u32>,
    face: PyReadonlyArrayDyn<'py, u32>,
    barycentric: PyReadonlyArrayDyn<'py, f64>,
    height: PyReadonlyArrayDyn<'py, f64>,
    displacement: f64,
) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
    let surface = Surface { vertices: triples(&vertices, "vertices")?, faces: triples(&faces, "faces")? };
    let normals = triples(&normals, "normals")?;
    let weights = triples(&barycentric, "barycentric")?;
    let places: Vec<SurfacePoint> = slice(&face, "face")?
        .iter()
        .zip(weights)
        .map(|(&face, &barycentric)| SurfacePoint { face, barycentric })
        .collect();
    let at = quick(py, places.len(), |job| surface.carry(normals, &places, job))?;
    Ok(lifted(py, at, slice(&height, "height")?, displacement))
}

/// Positions and normals of particles at places of a NURBS surface.
#[pyfunction]
fn plants_nurbs<'py>(
    py: Python<'py>,
    points: PyReadonlyArrayDyn<'py, f64>,
    weights: PyReadonlyArrayDyn<'py, f64>,
    count: [usize; 2],
    degree: [usize; 2],
    knots: (Vec<f64>, Vec<f64>),
    uv: PyReadonlyArrayDyn<'py, f64>,
    height: PyReadonlyArrayDyn<'py, f64>,
    displacement: f64,
) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
    let at: Vec<DVec3> = triples(&points, "points")?.iter().map(|&p| DVec3::from(p)).collect();
    let weights = slice(&weights, "weights")?;
    let uv = pairs(&uv, "uv")?;
    let directions = [Direction { degree: degree[0], knots: knots.0 }, Direction { degree: degree[1], knots: knots.1 }];
    let at = quick(py, 8 * uv.len(), |job| Nurbs::new(&at, weights, count, directions)?.evaluate(uv, job))?;
    Ok(lifted(py, at, slice(&height, "height")?, displacement))
}

/// Unit normals between those of a surface and random ones.
#[pyfunction]
fn plants_blend<'py>(
    py: Python<'py>,
    normals: PyReadonlyArrayDyn<'py, f64>,
    random: PyReadonlyArrayDyn<'py, f64>,
    weight: f64,
) -> PyResult<Array<'py, f64>> {
    let (normals, random) = (triples(&normals, "normals")?, triples(&random, "random")?);
    let mixed = quick(py, 0, |_| Ok(strata::blend(normals, random, weight)))?;
    Ok(flat(py, mixed))
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(plants_subdivide, module)?)?;
    module.add_function(wrap_pyfunction!(plants_grid_faces, module)?)?;
    module.add_function(wrap_pyfunction!(plants_normals, module)?)?;
    module.add_function(wrap_pyfunction!(plants_scatter, module)?)?;
    module.add_function(wrap_pyfunction!(plants_on_grid, module)?)?;
    module.add_function(wrap_pyfunction!(plants_by_area, module)?)?;
    module.add_function(wrap_pyfunction!(plants_carry, module)?)?;
    module.add_function(wrap_pyfunction!(plants_nurbs, module)?)?;
    module.add_function(wrap_pyfunction!(plants_blend, module)?)?;
    Ok(())
}

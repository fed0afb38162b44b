//! `_core`: what `pleinair.paint` calls.
#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

use numpy::{PyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::prelude::*;

use super::arrays::{slice, slice_mut};
use super::camera::Camera;
use super::run::{long, quick, sized, to_py};
use crate::job::Job;
use crate::paint::composite::{self, Canvas, Order};
use crate::paint::level_of_detail;
use crate::paint::light::{BiasGain, DirectionalLight, Illumination};
use crate::paint::mask::MaskShape;
use crate::paint::palette::{AerialPerspective, Palettes, Spline};
use crate::paint::sprite::{self, PerStroke};
use crate::paint::stroke::{self, LodRanges};
use crate::paint::{mask, reference, shadow, simplification};

/// A number for all strokes, or an array with one for each.
#[derive(FromPyObject)]
enum Number<'py> {
    #[pyo3(transparent)]
    Many(PyReadonlyArrayDyn<'py, f32>),
    #[pyo3(transparent)]
    One(f32),
}

impl Number<'_> {
    fn column(&self, name: &str) -> PyResult<PerStroke<'_, f32>> {
        Ok(match self {
            Self::One(x) => PerStroke::One(*x),
            Self::Many(list) => PerStroke::Many(slice(list, name)?),
        })
    }
}

/// A distance for all strokes, or an array with one for each.
#[derive(FromPyObject)]
enum Distance<'py> {
    #[pyo3(transparent)]
    Many(PyReadonlyArrayDyn<'py, f64>),
    #[pyo3(transparent)]
    One(f64),
}

/// `pleinair.paint.Sprites`.
#[derive(FromPyObject)]
struct Sprites<'py> {
    center: PyReadonlyArrayDyn<'py, f32>,
    size: PyReadonlyArrayDyn<'py, f32>,
    depth: PyReadonlyArrayDyn<'py, f64>,
    color: PyReadonlyArrayDyn<'py, f32>,
    variation: Option<PyReadonlyArrayDyn<'py, f32>>,
    radians: Number<'py>,
    opacity: Number<'py>,
    label: PyReadonlyArrayDyn<'py, u32>,
    frequency: Number<'py>,
    frequency_t: Number<'py>,
    color_frequency: Number<'py>,
    fullness: Number<'py>,
    feather_min: Number<'py>,
    feather_max: Number<'py>,
    squeeze: Number<'py>,
    id: Option<PyReadonlyArrayDyn<'py, i64>>,
}

impl<'py> Sprites<'py> {
    fn core<'a>(&'a self, delta: &'a Distance<'py>) -> PyResult<sprite::Sprites<'a>> {
        Ok(sprite::Sprites {
            centre: slice(&self.center, "center")?,
            size: slice(&self.size, "size")?,
            depth: slice(&self.depth, "depth")?,
            color: slice(&self.color, "color")?,
            variation: self.variation.as_ref().map(|v| slice(v, "variation")).transpose()?,
            rotation: self.radians.column("rotation")?,
            opacity: self.opacity.column("opacity")?,
            label: PerStroke::Many(slice(&self.label, "label")?),
            frequency_s: self.frequency.column("frequency")?,
            frequency_t: self.frequency_t.column("frequency_t")?,
            frequency_color: self.color_frequency.column("color_frequency")?,
            fullness: self.fullness.column("fullness")?,
            feather_min: self.feather_min.column("feather_min")?,
            feather_max: self.feather_max.column("feather_max")?,
            foreshortening: self.squeeze.column("squeeze")?,
            delta: match delta {
                Distance::One(x) => PerStroke::One(*x),
                Distance::Many(list) => PerStroke::Many(slice(list, "delta")?),
            },
            id: self.id.as_ref().map(|v| slice(v, "id")).transpose()?,
        })
    }
}

type Plane<'py> = PyReadwriteArrayDyn<'py, f32>;

#[pyfunction]
#[pyo3(signature = (sprites, slab, delta, size, rgb, transmittance, id_depth, exact, progress=None))]
fn paint_composite(
    py: Python<'_>,
    sprites: Sprites<'_>,
    slab: bool,
    delta: Distance<'_>,
    size: [usize; 2],
    mut rgb: Plane<'_>,
    mut transmittance: Plane<'_>,
    mut id_depth: Option<(Plane<'_>, PyReadwriteArrayDyn<'_, i64>)>,
    exact: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<()> {
    let strokes = sprites.core(&delta)?;
    let id_depth = match &mut id_depth {
        Some((depth, index)) => Some((slice_mut(depth, "depth")?, slice_mut(index, "index")?)),
        None => None,
    };
    let canvas = Canvas {
        width: size[0],
        height: size[1],
        rgb: slice_mut(&mut rgb, "rgb")?,
        transmittance: slice_mut(&mut transmittance, "transmittance")?,
        id_depth,
    };
    let order = if slab { Order::Slab } else { Order::Hard };
    let work = |job: &Job| {
        if exact {
            reference::composite(job, &strokes, order, canvas)
        } else {
            composite::composite(job, &strokes, order, canvas)
        }
    };
    // About two microseconds for each stroke.
    let cost = 2000 * strokes.count() + size[0] * size[1];
    if exact || progress.is_some() { long(py, progress, work) } else { sized(py, cost, work) }
}

#[pyfunction]
fn paint_over(
    py: Python<'_>,
    rgb: PyReadonlyArrayDyn<'_, f32>,
    transmittance: PyReadonlyArrayDyn<'_, f32>,
    behind: PyReadonlyArrayDyn<'_, f32>,
    mut out: Plane<'_>,
) -> PyResult<()> {
    let (rgb, through) = (slice(&rgb, "rgb")?, slice(&transmittance, "transmittance")?);
    let (behind, out) = (slice(&behind, "sky")?, slice_mut(&mut out, "out")?);
    quick(py, out.len(), |job| composite::over(job, rgb, through, behind, out))
}

/// Opacity of one mask at points `(s, t)`, by the plain formula.
#[pyfunction]
fn paint_mask(
    py: Python<'_>,
    shape: Mask,
    at: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (at, out) = (slice(&at, "at")?, slice_mut(&mut out, "out")?);
    let mask = shape.core();
    quick(py, 100 * out.len(), |job| mask::alphas(job, &mask, at, out))
}

/// Noise of a label at points, by the plain formula.
#[pyfunction]
fn paint_noise(
    py: Python<'_>,
    label: u32,
    at: PyReadonlyArrayDyn<'_, f64>,
    mut out: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (at, out) = (slice(&at, "at")?, slice_mut(&mut out, "out")?);
    let key = sprite::key(label);
    quick(py, 50 * out.len(), |job| mask::noises(job, key, at, out))
}

/// One mask.
#[derive(FromPyObject)]
struct Mask {
    label: u32,
    frequency: [f32; 2],
    fullness: f64,
    feather: [f32; 2],
    opacity: f32,
    squeeze: f32,
}

impl Mask {
    fn core(&self) -> mask::Mask {
        mask::Mask {
            frequency: self.frequency,
            key: sprite::key(self.label),
            power: mask::power_of(self.fullness),
            feather: mask::feather_of(self.feather),
            opacity: self.opacity,
            foreshortening: self.squeeze,
            carried: 1.0,
        }
    }
}

/// `pleinair.paint.Strokes`.
#[derive(FromPyObject)]
struct Strokes<'py> {
    position: PyReadonlyArrayDyn<'py, f64>,
    normal: PyReadonlyArrayDyn<'py, f32>,
    size: PyReadonlyArrayDyn<'py, f32>,
    label: PyReadonlyArrayDyn<'py, u32>,
    center_ratio: Number<'py>,
    branch_ratio: Number<'py>,
    fade: Option<PyReadonlyArrayDyn<'py, f32>>,
    lit: Number<'py>,
    object: Option<PyReadonlyArrayDyn<'py, u32>>,
    centers: PyReadonlyArrayDyn<'py, f64>,
    tint: PyReadonlyArrayDyn<'py, f64>,
    growth: Option<PyReadonlyArrayDyn<'py, f64>>,
}

impl Strokes<'_> {
    fn core(&self) -> PyResult<stroke::Strokes<'_>> {
        Ok(stroke::Strokes {
            position: slice(&self.position, "position")?,
            normal: slice(&self.normal, "normal")?,
            size: slice(&self.size, "size")?,
            label: slice(&self.label, "label")?,
            centre: self.center_ratio.column("center_ratio")?,
            branch: self.branch_ratio.column("branch_ratio")?,
            fade: self.fade.as_ref().map(|f| slice(f, "fade")).transpose()?,
            light_visibility: self.lit.column("lit")?,
            object: self.object.as_ref().map(|f| slice(f, "object")).transpose()?,
            centres: slice(&self.centers, "centers")?,
            tints: slice(&self.tint, "tint")?,
            size_compensation: self.growth.as_ref().map_or(Ok(&[][..]), |f| slice(f, "growth"))?,
        })
    }
}

/// `pleinair.paint.StrokeParams`.
#[derive(FromPyObject)]
struct StrokeParams {
    frequency: f64,
    center_frequency: f64,
    lightness_frequency: f64,
    stretch: [f64; 2],
    fullness: f32,
    feather_min: f32,
    feather_max: f32,
    max_opacity: f64,
    fade_gain: f64,
    variation: f64,
    ambient: f64,
    outer: f64,
    outer_gain: f64,
    inner: f64,
    inner_gain: f64,
    shadow_bias: f64,
    roughness: f64,
    crest: f64,
}

/// `pleinair.paint.Palette`.
#[derive(FromPyObject)]
struct Palette {
    dark: Vec<[f64; 3]>,
    mid: Vec<[f64; 3]>,
    light: Vec<[f64; 3]>,
    cutoffs: [f64; 4],
    spline: String,
    mixing: String,
    raw: bool,
}

/// `pleinair.paint.Material`.
#[derive(FromPyObject)]
struct Material {
    palette: Palette,
    params: StrokeParams,
}

/// `pleinair.paint.AerialPerspective`.
#[derive(FromPyObject)]
struct Air {
    color: [f64; 3],
    strength: f64,
    saturation: f64,
    value: [f64; 2],
    bias: f64,
}

/// `pleinair.paint.Style`.
#[derive(FromPyObject)]
struct Style {
    atmosphere: Air,
    tints: [[f64; 3]; 2],
    tint: f64,
    light_tint: f64,
    largest: f64,
    sparse: f64,
    exposure: f64,
    curve: String,
}

/// A style, one of its materials, and what a call adds: distances of near and far, and the lights.
#[derive(FromPyObject)]
struct Shader {
    style: Style,
    material: Material,
    far: [f64; 2],
    close: [f64; 2],
    /// Direction, strength, colour.
    lights: Vec<([f64; 3], f64, [f64; 3])>,
}

impl Shader {
    fn palettes(&self) -> Palettes {
        let p = &self.material.palette;
        Palettes {
            colors: [p.dark.clone(), p.mid.clone(), p.light.clone()],
            cutoffs: p.cutoffs,
            spline: if p.spline == "catmull-rom" { Spline::CatmullRom } else { Spline::Linear },
            pigment: p.mixing == "pigment",
            raw: p.raw,
        }
    }

    fn mask_shape(&self) -> MaskShape {
        let p = &self.material.params;
        MaskShape { fullness: p.fullness, feather: [p.feather_min, p.feather_max] }
    }

    fn lights(&self) -> Vec<DirectionalLight> {
        self.lights.iter().map(|&(to, strength, color)| DirectionalLight { to, strength, color }).collect()
    }

    fn core(&self, palette: &PaintPalette) -> stroke::Shader {
        let (p, s, air) = (&self.material.params, &self.style, &self.style.atmosphere);
        stroke::Shader {
            illumination: Illumination {
                ambient: p.ambient,
                outer: [p.outer, p.outer_gain],
                inner: [p.inner, p.inner_gain],
                shadow_bias: p.shadow_bias,
                curve: if s.curve == "schlick" { BiasGain::Schlick } else { BiasGain::Perlin },
            },
            roughness: p.roughness,
            frequency: [p.frequency, p.center_frequency, p.lightness_frequency],
            stretch: p.stretch,
            opacity: p.max_opacity,
            fade_gain: p.fade_gain,
            crest: p.crest,
            variation: p.variation,
            palette: palette.0.clone(),
            tints: s.tints,
            tint: s.tint,
            light_tint: s.light_tint,
            aerial_perspective: AerialPerspective {
                color: air.color,
                strength: air.strength,
                saturation: air.saturation,
                value: air.value,
                bias: air.bias,
            },
            lod: LodRanges { lod_range: self.far, near_fade: self.close },
            max_stroke_size: s.largest,
            near_culling: s.sparse,
            exposure: s.exposure,
        }
    }
}

/// A baked palette.
#[pyclass(frozen, module = "pleinair._core")]
struct PaintPalette(crate::paint::palette::Baked);

#[pymethods]
impl PaintPalette {
    #[new]
    fn new(py: Python<'_>, shader: Shader) -> PyResult<Self> {
        let palettes = shader.palettes();
        py.detach(|| palettes.bake()).map(Self).map_err(|e| to_py(&e))
    }

    /// Linear RGB and place among the palettes of each lightness.
    fn colors(&self, lightness: Vec<f64>) -> Vec<([f64; 3], f64)> {
        lightness.into_iter().map(|l| (self.0.color(l), self.0.which(l))).collect()
    }
}

#[pyfunction]
fn paint_shade(
    py: Python<'_>,
    strokes: Strokes<'_>,
    shader: Shader,
    palette: &PaintPalette,
    camera: Camera,
    mut rows: Plane<'_>,
    mut depth: PyReadwriteArrayDyn<'_, f64>,
) -> PyResult<()> {
    let (list, camera) = (strokes.core()?, camera.pinhole()?);
    let (rows, depth) = (slice_mut(&mut rows, "rows")?, slice_mut(&mut depth, "depth")?);
    let (core, lights) = (shader.core(palette), shader.lights());
    sized(py, 1000 * depth.len(), |job| stroke::shade(job, &list, &core, &lights, &camera, rows, depth))
}

/// Fraction and growth of each stroke at its distance.
#[pyfunction]
fn paint_lod(
    py: Python<'_>,
    strokes: Strokes<'_>,
    shader: Shader,
    palette: &PaintPalette,
    camera: Camera,
    mut out: Plane<'_>,
) -> PyResult<()> {
    let (list, camera) = (strokes.core()?, camera.pinhole()?);
    let (core, out) = (shader.core(palette), slice_mut(&mut out, "out")?);
    quick(py, 20 * out.len(), |job| stroke::detail(job, &list, &core, &camera, out))
}

#[pyfunction]
#[pyo3(signature = (strokes, shader, palette, shadows, knots, pixels, progress=None))]
fn paint_size_compensation(
    py: Python<'_>,
    strokes: Strokes<'_>,
    shader: Shader,
    palette: &PaintPalette,
    shadows: bool,
    knots: usize,
    pixels: usize,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<f64>> {
    let list = strokes.core()?;
    let (core, lights, mask_shape) = (shader.core(palette), shader.lights(), shader.mask_shape());
    long(py, progress, |job| level_of_detail::solve(job, &list, &core, &lights, mask_shape, shadows, knots, pixels))
}

#[pyfunction]
#[pyo3(signature = (strokes, shader, palette, outer, pixels, progress=None))]
fn paint_simplification_order(
    py: Python<'_>,
    strokes: Strokes<'_>,
    shader: Shader,
    palette: &PaintPalette,
    outer: f64,
    pixels: usize,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<u32>> {
    let list = strokes.core()?;
    let (core, lights, mask_shape) = (shader.core(palette), shader.lights(), shader.mask_shape());
    long(py, progress, |job| {
        simplification::simplification_order(job, &list, &core, &lights, mask_shape, outer, pixels)
    })
}

/// Centre [px], size [px], distance towards the light [m].
type View<'py> = (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f64>>);

#[pyfunction]
fn paint_light_view<'py>(
    py: Python<'py>,
    position: PyReadonlyArrayDyn<'_, f64>,
    size: PyReadonlyArrayDyn<'_, f32>,
    to: [f64; 3],
    pixels: usize,
) -> PyResult<View<'py>> {
    let (position, size) = (slice(&position, "position")?, slice(&size, "size")?);
    let (centre, size, depth) = quick(py, 10 * position.len(), |_| shadow::view(position, size, to.into(), pixels))?;
    Ok((PyArray1::from_vec(py, centre), PyArray1::from_vec(py, size), PyArray1::from_vec(py, depth)))
}

#[pyfunction]
#[pyo3(signature = (sprites, casts, pixels, out, progress=None))]
fn paint_light_visibility(
    py: Python<'_>,
    sprites: Sprites<'_>,
    casts: Option<PyReadonlyArrayDyn<'_, f32>>,
    pixels: usize,
    mut out: Plane<'_>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<()> {
    let delta = Distance::One(0.0);
    let list = sprites.core(&delta)?;
    let casts = casts.as_ref().map(|c| slice(c, "casts")).transpose()?;
    let out = slice_mut(&mut out, "out")?;
    let cost = 2000 * list.count();
    let work = |job: &Job| shadow::light_visibility(job, &list, casts, pixels, out);
    if progress.is_some() { long(py, progress, work) } else { sized(py, cost, work) }
}

/// Add this file's functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PaintPalette>()?;
    module.add_function(wrap_pyfunction!(paint_over, module)?)?;
    module.add_function(wrap_pyfunction!(paint_mask, module)?)?;
    module.add_function(wrap_pyfunction!(paint_noise, module)?)?;
    module.add_function(wrap_pyfunction!(paint_shade, module)?)?;
    module.add_function(wrap_pyfunction!(paint_lod, module)?)?;
    module.add_function(wrap_pyfunction!(paint_size_compensation, module)?)?;
    module.add_function(wrap_pyfunction!(paint_simplification_order, module)?)?;
    module.add_function(wrap_pyfunction!(paint_light_view, module)?)?;
    module.add_function(wrap_pyfunction!(paint_light_visibility, module)?)?;
    module.add_function(wrap_pyfunction!(paint_composite, module)?)?;
    Ok(())
}

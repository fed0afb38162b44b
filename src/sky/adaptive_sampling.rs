//! Adaptive image sampling: a picture of a smooth sky interpolated from every eighth pixel, refined where it bends
//! (floor 3).
//!
//! The light of a clear sky differs little from one pixel to the next, and what bends it, the aureole, the horizon, the
//! edge of the Earth's shadow, is in few places. The sky is computed at a mesh of pixels and in the middle of its
//! cells; a cell whose middle four-point interpolation does not meet within a quarter of the tolerance, its neighbours,
//! cells across the horizon and those around Sun and Moon are computed pixel by pixel. Discs and stars are not in the
//! mesh at all.
//!
//! Error: the tolerance, of the value and a thousandth of the brightest node (`a_mesh_is_the_sky`). Cost: 1 ns a pixel
//! on one core beside 1/30 of the cost of the sky; a sky that is nowhere smooth costs that much more.

use glam::DVec3;

use super::model::{BLOCK, Block, FLOOR, SkyModel, Smooth, ViewRays};
use crate::error::Result;
use crate::job::Job;
use crate::math::geometry::Pinhole;
use crate::math::interpolation::lagrange4;
use crate::math::lanes;

/// Pixels between nodes.
const STEP: usize = 8;
/// Nodes beyond the picture, on the left and above.
const MARGIN: usize = 1;
/// Numbers of a cell's row: three channels of each pixel.
const ROW: usize = 3 * STEP;
/// 1 where a number of a cell's row is of the channel.
const CHANNELS: [[f32; ROW]; 3] = {
    let mut out = [[0.0; ROW]; 3];
    let mut q = 0;
    while q < ROW {
        out[q % 3][q] = 1.0;
        q += 1;
    }
    out
};
/// Fraction of the tolerance that the middle of a cell may use.
const MIDDLE_TOLERANCE: f32 = 0.25;
/// Pictures of fewer pixels are computed as they are.
const LEAST: usize = 1 << 15;
/// Degrees of a pixel beyond which cells are too wide to be smooth \[rad\].
const COARSE: f64 = 0.004;

/// Light at the nodes, and the cells that are not smooth.
#[derive(Debug)]
pub struct AdaptiveSampling<'a> {
    camera: &'a Pinhole,
    /// Nodes of a row, and their light, row by row.
    wide: usize,
    nodes: Vec<[f32; 3]>,
    /// Cells of a row, and whether each has to be computed.
    cells: usize,
    refined: Vec<bool>,
    /// Weights of four nodes for the pixels between two of them.
    weights: [[f32; 4]; STEP],
}

/// Light at places of a camera's picture, given by pixel coordinates.
fn light(model: &dyn SkyModel, camera: &Pinhole, places: impl Iterator<Item = [f64; 2]>, out: &mut Vec<[f32; 3]>) {
    let mut block = Block::default();
    let places: Vec<[f64; 2]> = places.collect();
    for some in places.chunks(BLOCK) {
        for (i, [x, y]) in some.iter().enumerate() {
            let to = camera.through(x + 0.5, y + 0.5).as_vec3();
            (block.to[0][i], block.to[1][i], block.to[2][i]) = (to.x, to.y, to.z);
        }
        model.shade(&mut block, false);
        out.extend((0..some.len()).map(|i| [block.light[0][i], block.light[1][i], block.light[2][i]]));
    }
}

impl<'a> AdaptiveSampling<'a> {
    /// A mesh of a picture that is worth one.
    pub fn new(job: &Job, model: &dyn SkyModel, rays: &ViewRays<'a>) -> Result<Option<Self>> {
        let (ViewRays::Camera(camera), Some(smooth)) = (rays, model.smooth()) else { return Ok(None) };
        let pixel = 2.0 * camera.half_tan / camera.height as f64;
        if camera.width * camera.height < LEAST || pixel > COARSE {
            return Ok(None);
        }
        let cells = camera.width.div_ceil(STEP);
        let (wide, high) = (cells + 3, camera.height.div_ceil(STEP) + 3);
        let at = |i: usize| (i as f64 - MARGIN as f64) * STEP as f64;
        let row = |y: f64, first: f64, count: usize| {
            let mut out = Vec::with_capacity(count);
            light(model, camera, (0..count).map(|i| [at(i) + first, y]), &mut out);
            out
        };
        let nodes = job.map(high, |j| Ok(row(at(j), 0.0, wide)))?.concat();
        let half = 0.5 * STEP as f64;
        // The middles of the cells: node 1 is at pixel 0.
        let middles = job.map(high - 3, |j| Ok(row(at(j + 1) + half, STEP as f64 + half, cells)))?;
        let weights = std::array::from_fn(|k| lagrange4(1.0 + k as f32 / STEP as f32));
        let mut sampling = Self { camera, wide, nodes, cells, refined: Vec::new(), weights };
        sampling.refined = sampling.refine_mask(job, &smooth, &middles)?;
        Ok(Some(sampling))
    }

    fn refine_mask(&self, job: &Job, smooth: &Smooth, middles: &[Vec<[f32; 3]>]) -> Result<Vec<bool>> {
        let (high, cells) = (middles.len(), self.cells);
        let mut largest = [1e-30_f32; 3];
        for node in &self.nodes {
            for c in 0..3 {
                largest[c] = largest[c].max(node[c].abs());
            }
        }
        let floor = largest.map(|x| FLOOR as f32 * x);
        let tolerance = MIDDLE_TOLERANCE * smooth.tolerance as f32;
        let half = lagrange4(1.5);
        let at = |i: usize| (i as f64 - MARGIN as f64) * STEP as f64 + 0.5;
        let up = job.map(high + 3, |j| {
            Ok((0..self.wide).map(|i| self.camera.through(at(i), at(j)).z >= smooth.horizon).collect::<Vec<_>>())
        })?;
        let bad = job.map(high, |j| {
            // Down the columns first, then along the row.
            let rows = [0, 1, 2, 3].map(|k: usize| &self.nodes[(j + k) * self.wide..][..self.wide]);
            let down: Vec<[f32; 3]> = (0..self.wide)
                .map(|i| [0, 1, 2].map(|c: usize| (0..4).map(|k| half[k] * rows[k][i][c]).sum()))
                .collect();
            let ups: Vec<usize> = (0..self.wide).map(|i| (0..4).filter(|k| up[j + k][i]).count()).collect();
            let cell = |i: usize| {
                let want = middles[j][i];
                let off = (0..3).any(|c| {
                    let got: f32 = (0..4).map(|k| half[k] * down[i + k][c]).sum();
                    let error = (got - want[c]).abs();
                    // Not a number is not smooth.
                    error.is_nan() || error > tolerance * (want[c].abs() + floor[c])
                });
                let above: usize = ups[i..i + 4].iter().sum();
                off || (above > 0 && above < 16)
            };
            Ok((0..cells).map(cell).collect::<Vec<_>>())
        })?;
        // A cell and what is around it span this angle.
        let pixel = 2.0 * self.camera.half_tan / self.camera.height as f64;
        let reach = 2.2 * STEP as f64 * pixel;
        let cones: Vec<(DVec3, f64)> = smooth
            .cones
            .iter()
            .map(|(to, cos)| (*to, (cos.clamp(-1.0, 1.0).acos() + reach).min(std::f64::consts::PI).cos()))
            .collect();
        let middle = |i: usize| (i * STEP) as f64 + 0.5 * STEP as f64;
        let refined = job.map(high, |j| {
            let near = |i: usize| {
                (j.saturating_sub(1)..(j + 2).min(high))
                    .any(|b| bad[b][i.saturating_sub(1)..(i + 2).min(cells)].iter().any(|x| *x))
            };
            let within = |i: usize| {
                let to = self.camera.through(middle(i), middle(j));
                cones.iter().any(|(axis, cos)| to.dot(*axis) > *cos)
            };
            Ok((0..cells).map(|i| near(i) || within(i)).collect::<Vec<_>>())
        })?;
        Ok(refined.concat())
    }

    /// Pixels of a row of cells.
    pub fn row_of_cells(&self) -> usize {
        STEP * self.camera.width
    }

    /// Fraction of the cells that are computed pixel by pixel.
    pub fn refined_fraction(&self) -> f64 {
        self.refined.iter().filter(|r| **r).count() as f64 / self.refined.len() as f64
    }

    /// Fill in a row of cells, which may be cut off below.
    pub fn fill(&self, model: &dyn SkyModel, chunk: usize, out: &mut [f32]) {
        let width = self.camera.width;
        let refined = &self.refined[chunk * self.cells..(chunk + 1) * self.cells];
        let mut line = vec![0.0_f32; 3 * self.wide];
        for (k, out) in out.chunks_exact_mut(3 * width).enumerate() {
            let rows =
                [0, 1, 2, 3].map(|j: usize| &self.nodes.as_flattened()[3 * (chunk + j) * self.wide..][..line.len()]);
            lanes::run(
                #[inline(always)]
                || {
                    blend(rows, self.weights[k], &mut line);
                    resample_row(&line, &self.weights, out);
                },
            );
        }
        let rows = out.len() / (3 * width);
        let pixels: Vec<[usize; 2]> = refined
            .iter()
            .enumerate()
            .filter(|(_, refined)| **refined)
            .flat_map(|(i, _)| {
                let columns = i * STEP..((i + 1) * STEP).min(width);
                (0..rows).flat_map(move |y| columns.clone().map(move |x| [x, y]))
            })
            .collect();
        let mut found = Vec::with_capacity(pixels.len());
        let places = pixels.iter().map(|[x, y]| [*x as f64, (chunk * STEP + y) as f64]);
        light(model, self.camera, places, &mut found);
        for ([x, y], light) in pixels.iter().zip(found) {
            out[3 * (y * width + x)..][..3].copy_from_slice(&light);
        }
    }
}

/// Four rows of nodes as one.
#[inline(always)]
fn blend(rows: [&[f32]; 4], weights: [f32; 4], out: &mut [f32]) {
    let [a, b, c, d] = rows;
    for ((((o, a), b), c), d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        *o = weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d;
    }
}

/// A node's three numbers, eight times over: by products with 0 and 1, since a vector read from what was written number by
/// number would wait for it.
#[inline(always)]
fn repeated(line: &[f32], i: usize) -> [f32; ROW] {
    let (r, g, b) = (line[3 * i], line[3 * i + 1], line[3 * i + 2]);
    let mut out = [0.0; ROW];
    for (q, x) in out.iter_mut().enumerate() {
        *x = r * CHANNELS[0][q] + g * CHANNELS[1][q] + b * CHANNELS[2][q];
    }
    out
}

/// A cell's row between four nodes.
#[inline(always)]
fn between(by: &[[f32; ROW]; 4], [a, b, c, d]: &[[f32; ROW]; 4]) -> [f32; ROW] {
    let mut row = [0.0_f32; ROW];
    for q in 0..ROW {
        row[q] = by[0][q] * a[q] + by[1][q] * b[q] + by[2][q] * c[q] + by[3][q] * d[q];
    }
    row
}

/// A row of nodes as a row of pixels.
#[inline(always)]
fn resample_row(line: &[f32], weights: &[[f32; 4]; STEP], out: &mut [f32]) {
    // The weights of each number of a cell's row.
    let mut by = [[0.0_f32; ROW]; 4];
    for (m, by) in by.iter_mut().enumerate() {
        for (q, w) in by.iter_mut().enumerate() {
            *w = weights[q / 3][m];
        }
    }
    let mut four = [[0.0; ROW], repeated(line, 0), repeated(line, 1), repeated(line, 2)];
    let (whole, rest) = out.as_chunks_mut::<ROW>();
    for (i, out) in whole.iter_mut().enumerate() {
        four = [four[1], four[2], four[3], repeated(line, i + 3)];
        *out = between(&by, &four);
    }
    if !rest.is_empty() {
        four = [four[1], four[2], four[3], repeated(line, whole.len() + 3)];
        rest.copy_from_slice(&between(&by, &four)[..rest.len()]);
    }
}

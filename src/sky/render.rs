//! Rendering a sky: every pixel for itself, or a smooth sky by adaptive sampling; the reference method in `f64` (floor
//! 3).
//!
//! [`shown`] makes 8-bit levels of each chunk while it is in the cache: the light of the whole picture is never stored.
//!
//! Directions are made in blocks of [`BLOCK`], channels are interleaved into the picture, discs and stars added last.
//! The error is that of the model, or its tolerance where it is interpolated (`a_mesh_is_the_sky`). Black outside a
//! fisheye.

use glam::DVec3;

use super::adaptive_sampling::AdaptiveSampling;
use super::model::{BLOCK, Block, SkyModel, SparsePixels, ViewRays, offsets};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::fisheye::Fisheye;
use crate::math::lanes;
use crate::tone::tumblin_rushmeier::{self, Operator};

/// Directions of a chunk, the unit of work of a thread.
const CHUNK: usize = 64 * BLOCK;

/// Black outside the circle of a fisheye: [`Fisheye::inside`] of a block, as exact.
#[inline(always)]
fn darken(camera: &Fisheye, first: usize, count: usize, light: &mut [[f32; BLOCK]; 3]) {
    let [xs, ys] = offsets([camera.width, camera.height], first, count);
    let across = camera.width.min(camera.height) as f64;
    for i in 0..BLOCK {
        let (x, y) = (f64::from(xs[i]), f64::from(ys[i]));
        let inside = x * x + y * y <= across * across;
        for channel in light.iter_mut() {
            channel[i] = if inside { channel[i] } else { 0.0 };
        }
    }
}

/// Few directions are those that cost less one by one than a table.
pub const FEW_RAYS: usize = 1024;

/// A sky and what is looked at, ready to be made chunk by chunk.
struct Chunks<'a> {
    model: &'a dyn SkyModel,
    rays: &'a ViewRays<'a>,
    sampling: Option<AdaptiveSampling<'a>>,
    without_table: bool,
    /// Sine and cosine of each column of a panorama.
    columns: Vec<(f32, f32)>,
}

impl<'a> Chunks<'a> {
    fn new(job: &Job, model: &'a dyn SkyModel, rays: &'a ViewRays<'a>) -> Result<Self> {
        rays.validate()?;
        let without_table = rays.count() < FEW_RAYS;
        if !without_table {
            model.prepare(job)?;
        }
        let sampling = if without_table { None } else { AdaptiveSampling::new(job, model, rays)? };
        let columns = match rays {
            ViewRays::Panorama { width, .. } if sampling.is_none() => (0..*width)
                .map(|x| {
                    let (sin, cos) = ((0.5 + x as f64) / *width as f64 * std::f64::consts::TAU).sin_cos();
                    (sin as f32, cos as f32)
                })
                .collect(),
            _ => Vec::new(),
        };
        Ok(Self { model, rays, sampling, without_table, columns })
    }

    /// Pixels of a chunk, the unit of work of a thread.
    fn size(&self) -> usize {
        self.sampling.as_ref().map_or(CHUNK, AdaptiveSampling::row_of_cells)
    }

    /// Light of a chunk without its discs and stars.
    fn fill(&self, chunk: usize, out: &mut [f32]) {
        if let Some(sampling) = &self.sampling {
            sampling.fill(self.model, chunk, out);
            return;
        }
        // Every direction for itself.
        let mut block = Block::default();
        for (k, out) in out.chunks_mut(3 * BLOCK).enumerate() {
            let first = chunk * CHUNK + k * BLOCK;
            lanes::run(
                #[inline(always)]
                || self.rays.fill(&self.columns, first, out.len() / 3, &mut block),
            );
            self.model.shade(&mut block, self.without_table);
            if let ViewRays::Fisheye(camera) = self.rays {
                lanes::run(
                    #[inline(always)]
                    || darken(camera, first, out.len() / 3, &mut block.light),
                );
            }
            let [r, g, b] = &block.light;
            for (((pixel, r), g), b) in out.as_chunks_mut::<3>().0.iter_mut().zip(r).zip(g).zip(b) {
                *pixel = [*r, *g, *b];
            }
        }
    }
}

/// Add light to single pixels, in their order; the first pixel of `out` is `first`.
fn add(overlay: &[(usize, [f32; 3])], first: usize, out: &mut [f32]) {
    for (index, light) in overlay {
        let at = 3 * (index - first);
        for c in 0..3 {
            out[at + c] += light[c];
        }
    }
}

/// Radiance of every direction of `rays`, channels interleaved.
pub fn render(job: &Job, model: &dyn SkyModel, rays: &ViewRays<'_>, out: &mut [f32]) -> Result<()> {
    expect(out.len(), rays.count())?;
    let chunks = Chunks::new(job, model, rays)?;
    job.expect(rays.count().div_ceil(chunks.size()) as u64);
    job.chunks(out, 3 * chunks.size(), |chunk, out| {
        chunks.fill(chunk, out);
        job.advance(1)
    })?;
    add(&model.overlay(rays), 0, out);
    Ok(())
}

/// The levels that Tumblin and Rushmeier's operator shows of [`render`], to the bit, in one pass.
pub fn shown(
    job: &Job,
    model: &dyn SkyModel,
    rays: &ViewRays<'_>,
    (operator, night): (&Operator, bool),
    out: &mut [u8],
) -> Result<()> {
    expect(out.len(), rays.count())?;
    let chunks = Chunks::new(job, model, rays)?;
    let size = chunks.size();
    let mut overlay: SparsePixels = model.overlay(rays);
    // Stable: what falls on one pixel is added in one order.
    overlay.sort_by_key(|(index, _)| *index);
    job.expect(rays.count().div_ceil(size) as u64);
    job.chunks(out, 3 * size, |chunk, out| {
        let mut light = vec![0.0_f32; out.len()];
        chunks.fill(chunk, &mut light);
        let (first, last) = (chunk * size, chunk * size + out.len() / 3);
        let from = overlay.partition_point(|(index, _)| *index < first);
        let to = overlay.partition_point(|(index, _)| *index < last);
        add(&overlay[from..to], first, &mut light);
        tumblin_rushmeier::show(&Job::serial(), &light, out, operator, night)?;
        job.advance(1)
    })
}

/// The same by the reference method.
pub fn reference(job: &Job, model: &dyn SkyModel, rays: &ViewRays<'_>, out: &mut [f64]) -> Result<()> {
    const CHUNK: usize = 64;
    rays.validate()?;
    let count = rays.count();
    expect(out.len(), count)?;
    job.expect(count.div_ceil(CHUNK) as u64);
    job.chunks(out, 3 * CHUNK, |chunk, out| {
        for (i, pixel) in out.chunks_exact_mut(3).enumerate() {
            let to = rays.at(chunk * CHUNK + i);
            pixel.copy_from_slice(&if to == DVec3::ZERO { [0.0; 3] } else { model.reference(to) });
        }
        job.advance(1)
    })
}

/// Radiance by Monte Carlo, and its standard error.
pub fn monte_carlo(
    job: &Job,
    model: &dyn SkyModel,
    directions: &[f64],
    (paths, key): (usize, u64),
    out: &mut [f64],
) -> Result<()> {
    let rays = ViewRays::List(directions);
    rays.validate()?;
    expect(out.len() / 2, rays.count())?;
    job.expect(rays.count() as u64);
    job.chunks(out, 6, |i, out| {
        let (light, error) = model.monte_carlo(rays.at(i), paths, key.wrapping_add(i as u64));
        out[..3].copy_from_slice(&light);
        out[3..].copy_from_slice(&error);
        job.advance(1)
    })
}

fn expect(got: usize, count: usize) -> Result<()> {
    if got == 3 * count {
        return Ok(());
    }
    Err(Error::Shape { name: "out", expected: format!("({count}, 3)"), got: format!("{got} numbers") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geometry::{Pinhole, direction};
    use crate::sky::cie_general;
    use crate::sky::perez::Tint;

    #[test]
    fn a_mesh_is_the_sky() {
        let sun = direction(1.0, 0.6);
        let sky = cie_general::sky(13, sun, 4000.0, Tint::Even([0.3127, 0.329]), [0.0; 3]).expect("valid");
        let job = Job::serial();
        for (azimuth, size) in [(1.1, [317, 211]), (4.0, [256, 200])] {
            let camera = Pinhole::new(DVec3::ZERO, [azimuth, 0.4, 0.2, 0.7], size).expect("valid");
            let rays = ViewRays::Camera(&camera);
            let sampling = AdaptiveSampling::new(&job, &sky, &rays).expect("made").expect("worth it");
            assert!(sampling.refined_fraction() < 0.5, "{} are rough", sampling.refined_fraction());
            let mut out = vec![0.0; 3 * rays.count()];
            render(&job, &sky, &rays, &mut out).expect("rendered");
            let largest = out.iter().fold(0.0_f32, |a, &b| a.max(b));
            for (i, got) in out.as_chunks::<3>().0.iter().enumerate() {
                let want = sky.reference(rays.at(i));
                for c in 0..3 {
                    let bound = 1e-3 * (want[c].abs() + 1e-3 * f64::from(largest));
                    assert!((f64::from(got[c]) - want[c]).abs() < bound, "{i}: {} against {}", got[c], want[c]);
                }
            }
        }
    }
}

//! Rendering a sky: every pixel for itself, or a smooth sky by adaptive sampling; the reference method in `f64` (floor
//! 3).
//!
//! Directions are made in blocks of [`BLOCK`], channels are interleaved into the picture, discs and stars added last.
//! The error is that of the model, or its tolerance where it is interpolated (`a_mesh_is_the_sky`). Black outside a
//! fisheye.

use glam::DVec3;

use super::adaptive_sampling::AdaptiveSampling;
use super::model::{BLOCK, Block, SkyModel, ViewRays, offsets};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::fisheye::Fisheye;
use crate::math::lanes;

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

/// Radiance of every direction of `rays`, channels interleaved.
pub fn render(job: &Job, model: &dyn SkyModel, rays: &ViewRays<'_>, out: &mut [f32]) -> Result<()> {
    rays.validate()?;
    let count = rays.count();
    expect(out.len(), count)?;
    let without_table = count < FEW_RAYS;
    if !without_table {
        model.prepare(job)?;
    }
    let sampling = if without_table { None } else { AdaptiveSampling::new(job, model, rays)? };
    match &sampling {
        Some(sampling) => {
            let rows = 3 * sampling.row_of_cells();
            job.expect(out.len().div_ceil(rows) as u64);
            job.chunks(out, rows, |chunk, out| {
                sampling.fill(model, chunk, out);
                job.advance(1)
            })?;
        }
        None => every(job, model, rays, out, without_table)?,
    }
    for (index, light) in model.overlay(rays) {
        for c in 0..3 {
            out[3 * index + c] += light[c];
        }
    }
    Ok(())
}

/// Every direction for itself.
fn every(job: &Job, model: &dyn SkyModel, rays: &ViewRays<'_>, out: &mut [f32], without_table: bool) -> Result<()> {
    let count = rays.count();
    let columns: Vec<(f32, f32)> = match rays {
        ViewRays::Panorama { width, .. } => (0..*width)
            .map(|x| {
                let (sin, cos) = ((0.5 + x as f64) / *width as f64 * std::f64::consts::TAU).sin_cos();
                (sin as f32, cos as f32)
            })
            .collect(),
        _ => Vec::new(),
    };
    job.expect(count.div_ceil(CHUNK) as u64);
    job.chunks(out, 3 * CHUNK, |chunk, out| {
        let mut block = Block::default();
        for (k, out) in out.chunks_mut(3 * BLOCK).enumerate() {
            let first = chunk * CHUNK + k * BLOCK;
            lanes::run(
                #[inline(always)]
                || rays.fill(&columns, first, out.len() / 3, &mut block),
            );
            model.shade(&mut block, without_table);
            if let ViewRays::Fisheye(camera) = rays {
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

//! Pictures of a sky: every pixel for itself, or a smooth sky by adaptive sampling (floor 3).

use glam::DVec3;

use super::adaptive_sampling::Mesh;
use super::model::{BLOCK, Block, Field, Look, offsets};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::fisheye::Fisheye;
use crate::math::lanes;

/// Directions of a band, the unit of work of a thread.
const BAND: usize = 64 * BLOCK;

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
pub const FEW: usize = 1024;

/// Radiance of every direction of `look`, channels interleaved.
pub fn render(job: &Job, field: &dyn Field, look: &Look<'_>, out: &mut [f32]) -> Result<()> {
    look.validate()?;
    let count = look.count();
    expect(out.len(), count)?;
    let few = count < FEW;
    if !few {
        field.prepare(job)?;
    }
    let mesh = if few { None } else { Mesh::new(job, field, look)? };
    match &mesh {
        Some(mesh) => {
            let rows = 3 * mesh.band();
            job.expect(out.len().div_ceil(rows) as u64);
            job.bands(out, rows, |band, out| {
                mesh.fill(field, band, out);
                job.advance(1)
            })?;
        }
        None => every(job, field, look, out, few)?,
    }
    for (index, light) in field.overlay(look) {
        for c in 0..3 {
            out[3 * index + c] += light[c];
        }
    }
    Ok(())
}

/// Every direction for itself.
fn every(job: &Job, field: &dyn Field, look: &Look<'_>, out: &mut [f32], few: bool) -> Result<()> {
    let count = look.count();
    let columns: Vec<(f32, f32)> = match look {
        Look::Panorama { width, .. } => (0..*width)
            .map(|x| {
                let (sin, cos) = ((0.5 + x as f64) / *width as f64 * std::f64::consts::TAU).sin_cos();
                (sin as f32, cos as f32)
            })
            .collect(),
        _ => Vec::new(),
    };
    job.expect(count.div_ceil(BAND) as u64);
    job.bands(out, 3 * BAND, |band, out| {
        let mut block = Block::default();
        for (k, out) in out.chunks_mut(3 * BLOCK).enumerate() {
            let first = band * BAND + k * BLOCK;
            lanes::run(
                #[inline(always)]
                || look.fill(&columns, first, out.len() / 3, &mut block),
            );
            field.shade(&mut block, few);
            if let Look::Fisheye(camera) = look {
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
pub fn reference(job: &Job, field: &dyn Field, look: &Look<'_>, out: &mut [f64]) -> Result<()> {
    const BAND: usize = 64;
    look.validate()?;
    let count = look.count();
    expect(out.len(), count)?;
    job.expect(count.div_ceil(BAND) as u64);
    job.bands(out, 3 * BAND, |band, out| {
        for (i, pixel) in out.chunks_exact_mut(3).enumerate() {
            let to = look.at(band * BAND + i);
            pixel.copy_from_slice(&if to == DVec3::ZERO { [0.0; 3] } else { field.reference(to) });
        }
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
            let look = Look::Camera(&camera);
            let mesh = Mesh::new(&job, &sky, &look).expect("made").expect("worth it");
            assert!(mesh.share() < 0.5, "{} are rough", mesh.share());
            let mut out = vec![0.0; 3 * look.count()];
            render(&job, &sky, &look, &mut out).expect("rendered");
            let largest = out.iter().fold(0.0_f32, |a, &b| a.max(b));
            for (i, got) in out.as_chunks::<3>().0.iter().enumerate() {
                let want = sky.reference(look.at(i));
                for c in 0..3 {
                    let bound = 1e-3 * (want[c].abs() + 1e-3 * f64::from(largest));
                    assert!((f64::from(got[c]) - want[c]).abs() < bound, "{i}: {} against {}", got[c], want[c]);
                }
            }
        }
    }
}

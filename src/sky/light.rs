//! Environment sampling: irradiance and spherical harmonics of a sky, for lighting scenes (floor 3).
//!
//! The sphere is sampled in rings around the sun whose polar angle grows with the square, so that an aerosol's peak of
//! a degree is met by many rings; each sample stands for its exact solid angle. Error below 2e-4 of a white sky's
//! irradiance for any plane (`a_white_sky_sheds_pi_on_every_plane`). Cost: 74 000 directions, a few milliseconds.

use glam::DVec3;

use super::model::{SkyModel, ViewRays};
use super::render::render;
use crate::error::Result;
use crate::job::Job;

/// Rings and samples of a ring.
const RINGS: usize = 384;
const ROUND: usize = 192;

/// Samples of a sky: direction, and radiance times solid angle.
#[derive(Debug, Clone)]
pub struct EnvironmentSampling {
    samples: Vec<(DVec3, DVec3)>,
}

impl EnvironmentSampling {
    /// Sample a sky, densely around `axis`.
    pub fn new(job: &Job, model: &dyn SkyModel, axis: DVec3) -> Result<Self> {
        let aside = axis.any_orthonormal_vector();
        let other = axis.cross(aside);
        let edge = |i: usize| std::f64::consts::PI * (i as f64 / RINGS as f64).powi(2);
        let mut list = Vec::with_capacity(3 * RINGS * ROUND);
        let mut areas = Vec::with_capacity(RINGS);
        for i in 0..RINGS {
            let (low, high) = (edge(i), edge(i + 1));
            // cos low - cos high without cancellation.
            let band = 2.0 * (0.5 * (high - low)).sin() * (0.5 * (high + low)).sin();
            areas.push(band * std::f64::consts::TAU / ROUND as f64);
            let (sin, cos) = (0.5 * (low + high)).sin_cos();
            for j in 0..ROUND {
                // Every other ring is turned by half a step.
                let turn = (j as f64 + 0.5 * (i % 2) as f64) / ROUND as f64 * std::f64::consts::TAU;
                let (s, c) = turn.sin_cos();
                list.extend((axis * cos + (aside * c + other * s) * sin).to_array());
            }
        }
        let mut light = vec![0.0_f32; list.len()];
        render(job, model, &ViewRays::List(&list), &mut light)?;
        let samples = list.chunks_exact(3).zip(light.chunks_exact(3)).enumerate().map(|(i, (to, rgb))| {
            let rgb = DVec3::new(f64::from(rgb[0]), f64::from(rgb[1]), f64::from(rgb[2]));
            (DVec3::from_slice(to), rgb * areas[i / ROUND])
        });
        Ok(Self { samples: samples.chain(model.points()).collect() })
    }

    /// Irradiance of planes with these unit normals (`x, y, z` in turn).
    pub fn irradiance(&self, job: &Job, normals: &[f64], out: &mut [f64]) -> Result<()> {
        job.expect(normals.len() as u64 / 3);
        job.chunks(out, 3, |i, out| {
            let normal = DVec3::from_slice(&normals[3 * i..]);
            let sum = self.samples.iter().fold(DVec3::ZERO, |sum, (to, light)| sum + *light * to.dot(normal).max(0.0));
            out.copy_from_slice(&sum.to_array());
            job.advance(1)
        })
    }

    /// Coefficients of the nine real spherical harmonics up to degree 2, in the order (l, m) = (0, 0), (1, -1), (1, 0),
    /// (1, 1), (2, -2) ... (2, 2), orthonormal, without the Condon-Shortley sign, z up.
    pub fn harmonics(&self) -> [[f64; 3]; 9] {
        let mut sum = [DVec3::ZERO; 9];
        for (to, light) in &self.samples {
            for (s, y) in sum.iter_mut().zip(harmonics(*to)) {
                *s += *light * y;
            }
        }
        sum.map(|s| s.to_array())
    }
}

/// The harmonics of a direction.
fn harmonics(DVec3 { x, y, z }: DVec3) -> [f64; 9] {
    let pi = std::f64::consts::PI;
    let (a, b, c) = ((1.0 / (4.0 * pi)).sqrt(), (3.0 / (4.0 * pi)).sqrt(), (15.0 / (4.0 * pi)).sqrt());
    let d = (5.0 / (16.0 * pi)).sqrt();
    [a, b * y, b * z, b * x, c * x * y, c * y * z, d * (3.0 * z * z - 1.0), c * x * z, 0.5 * c * (x * x - y * y)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::model::{BLOCK, Block};

    struct White(fn(DVec3) -> f64);

    impl SkyModel for White {
        fn shade(&self, block: &mut Block, _: bool) {
            for i in 0..BLOCK {
                let to = DVec3::from_array([0, 1, 2].map(|k: usize| f64::from(block.to[k][i])));
                for c in 0..3 {
                    block.light[c][i] = (self.0)(to) as f32;
                }
            }
        }

        fn reference(&self, to: DVec3) -> [f64; 3] {
            [(self.0)(to); 3]
        }

        fn direct_irradiance(&self, _: f64) -> [f64; 3] {
            [0.0; 3]
        }
    }

    const PLANES: [[f64; 3]; 4] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [0.48, 0.6, 0.64]];

    #[test]
    fn a_white_sky_sheds_pi_on_every_plane() {
        let job = Job::serial();
        for axis in [DVec3::Z, DVec3::new(0.36, 0.48, 0.8), -DVec3::Y] {
            let sampling = EnvironmentSampling::new(&job, &White(|_| 1.0), axis).expect("sampled");
            for n in PLANES {
                let mut out = [0.0; 3];
                sampling.irradiance(&job, &n, &mut out).expect("summed");
                assert!((out[0] / std::f64::consts::PI - 1.0).abs() < 2e-4, "{n:?}: {}", out[0]);
            }
        }
    }

    #[test]
    fn harmonics_are_orthonormal_and_give_the_irradiance_of_a_smooth_sky() {
        let job = Job::serial();
        let sky = White(|d| 1.0 + 0.5 * d.z - 0.3 * d.x + 0.2 * d.x * d.y);
        let sampling = EnvironmentSampling::new(&job, &sky, DVec3::Z).expect("sampled");
        let sh = sampling.harmonics();
        let pi = std::f64::consts::PI;
        assert!((sh[0][0] - (4.0 * pi).sqrt()).abs() < 1e-3, "mean");
        assert!((sh[2][0] - 0.5 * (4.0 * pi / 3.0).sqrt()).abs() < 1e-3, "z");
        assert!((sh[3][0] + 0.3 * (4.0 * pi / 3.0).sqrt()).abs() < 1e-3, "x");
        // Ramamoorthi and Hanrahan 2001: factors pi, 2 pi / 3, pi / 4 of the degrees.
        for n in PLANES {
            let mut out = [0.0; 3];
            sampling.irradiance(&job, &n, &mut out).expect("summed");
            let y = harmonics(DVec3::from_array(n));
            let factor = |k: usize| {
                if k == 0 {
                    pi
                } else if k < 4 {
                    2.0 * pi / 3.0
                } else {
                    pi / 4.0
                }
            };
            let e: f64 = (0..9).map(|k| factor(k) * sh[k][0] * y[k]).sum();
            assert!((e - out[0]).abs() < 2e-3, "{n:?}: {e} against {}", out[0]);
        }
    }
}

//! What a ray meets in a scattering medium: places along it with the transmittance to them, for light that is kept as
//! moments and for sunlight (floor 2).
//!
//! Places crowd with the cube of the distance where the air is dense: at the near end of a ray upwards, at the far end of
//! one downwards. Nothing of it depends on the sun.

use std::sync::LazyLock;

use super::legendre::{MODES, MOMENTS, Truncated, schmidt, start};
use super::profile::SPECIES;
use super::scattering::{C, Channels, SphericalAir};
use crate::math::elementary::exp64;
use crate::math::quadrature::Gauss;

/// Samples of a ray, or of each half of one that passes a lowest point.
const N: usize = 12;
/// The same for sunlight, which varies where it has grazed the ground.
const FINE: usize = 20;
/// Aerosol that scatters less than this fraction of what molecules do needs no more moments than they.
const POOR: f64 = 0.01;
/// Modes of light that is even over degree 2.
pub(super) const FEW: usize = 3;

static RULE: LazyLock<Gauss<N>> = LazyLock::new(Gauss::new);
static FINE_RULE: LazyLock<Gauss<FINE>> = LazyLock::new(Gauss::new);

/// What scatters.
#[derive(Debug, Clone)]
pub struct ScatteringMedium {
    /// Extinction, the forward peak of the aerosol left out.
    pub air: SphericalAir,
    /// Scattering on the ground by molecules and, without its peak, by aerosol \[1/m\].
    pub scattering: [[f64; C]; 2],
    /// Phase functions of molecules and of aerosol.
    pub phases: [Truncated; 2],
    /// Albedo of the ground.
    pub albedo: f64,
}

/// One sample of a ray: place between heights, distance, cosine to the vertical there, scattering times length times
/// transmittance, functions of its direction times the moments of the phase functions.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    pub(super) level: usize,
    pub(super) weight_above: f32,
    pub(super) h: f64,
    pub(super) mu: f64,
    pub(super) s: f64,
    pub(super) modes: usize,
    pub(super) weights: [Channels; 2],
    pub(super) molecules: [f32; MOMENTS],
    pub(super) aerosol: [f32; MOMENTS],
}

/// A sample for sunlight: the same, and the stretch of the ray it stands for with the densities at its ends.
#[derive(Debug, Clone)]
pub(super) struct SunlitSample {
    pub(super) h: f64,
    pub(super) s: f64,
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) log_slope: f64,
    pub(super) weights: [Channels; 2],
}

/// A ray from a height: its samples, its end on the ground with the transmittance.
#[derive(Debug, Clone)]
pub(super) struct Path {
    pub(super) mu: f64,
    pub(super) samples: Vec<Sample>,
    pub(super) sunlit: Vec<SunlitSample>,
    pub(super) ground: Option<(f64, Channels)>,
}

/// Integral over a length of an exponential of this slope that begins at 1.
#[inline(always)]
pub(super) fn column(slope: f64, length: f64) -> f64 {
    let x = slope * length;
    if x.abs() < 1e-6 { length } else { length * (x.exp() - 1.0) / x }
}

/// Cosine of the azimuth of a direction from the sun, from the cosines to the vertical and between them.
#[inline(always)]
pub(super) fn azimuth(mu: f64, nu: f64, mu_sun: f64) -> f32 {
    let across = ((1.0 - mu * mu) * (1.0 - mu_sun * mu_sun)).max(0.0).sqrt();
    let c = if across > 1e-9 { (nu - mu * mu_sun) / across } else { 0.0 };
    let c = if c > 1.0 { 1.0 } else { c };
    (if c > -1.0 { c } else { -1.0 }) as f32
}

/// Cosines of the multiples of an azimuth, from its cosine.
#[inline(always)]
pub(super) fn multiples(c: f32) -> [f32; MODES] {
    let mut out = [1.0; MODES];
    out[1] = c;
    for m in 2..MODES {
        out[m] = 2.0 * c * out[m - 1] - out[m - 2];
    }
    out
}

/// Weights of four nodes for a cubic through them at `x`.
#[inline(always)]
pub(super) fn cubic(x: f64, nodes: [f64; 4]) -> [f32; 4] {
    std::array::from_fn(|i| {
        let mut w = 1.0;
        for j in 0..4 {
            if j != i {
                w *= (x - nodes[j]) / (nodes[i] - nodes[j]);
            }
        }
        w as f32
    })
}

impl ScatteringMedium {
    /// Height above which the aerosol needs no more moments than molecules.
    pub(super) fn rich(&self) -> f64 {
        let share = |h: f64| {
            let d = self.air.profile.densities(h);
            let most = (0..C).map(|c| self.scattering[1][c] / self.scattering[0][c].max(1e-30)).fold(0.0, f64::max);
            most * d[1] / d[0]
        };
        let top = self.air.profile.shell.thickness;
        let steps = 240;
        (0..steps).map(|i| top * f64::from(i) / f64::from(steps)).find(|&h| share(h) < POOR).unwrap_or(top)
    }

    /// Samples of a ray.
    pub(super) fn path(&self, heights: &[f64], rich: f64, h: f64, mu: f64) -> Path {
        let (samples, ground) = self.marched::<N>(&RULE, h, mu);
        let sample = |s: SunlitSample| {
            let shell = &self.air.profile.shell;
            let here = ((shell.radius + h) * mu + s.s) / (shell.radius + s.h);
            self.sample(heights, rich, s.h, here.clamp(-1.0, 1.0), s.s, s.weights)
        };
        Path { mu, samples: samples.into_iter().map(sample).collect(), sunlit: Vec::new(), ground }
    }

    /// Places for sunlight.
    pub(super) fn sunlit(&self, h: f64, mu: f64) -> Vec<SunlitSample> {
        self.marched::<FINE>(&FINE_RULE, h, mu).0
    }

    /// Places of a ray by a rule, and its end on the ground with the transmittance.
    fn marched<const M: usize>(
        &self,
        rule: &Gauss<M>,
        h: f64,
        mu: f64,
    ) -> (Vec<SunlitSample>, Option<(f64, Channels)>) {
        let shell = &self.air.profile.shell;
        let ground = shell.ground(h, mu);
        let end = ground.unwrap_or_else(|| shell.distance_to_top(h, mu, shell.thickness));
        let lowest = -(shell.radius + h) * mu;
        // Samples crowd where the air is dense: at the near end of a ray upwards, at the far end of one downwards.
        let parts: &[(f64, f64, bool)] = if ground.is_some() {
            &[(0.0, end, true)]
        } else if lowest > 0.0 {
            &[(0.0, lowest, true), (lowest, end, false)]
        } else {
            &[(0.0, end, false)]
        };
        let mut passed = [0.0; SPECIES];
        let mut samples = Vec::with_capacity(2 * M);
        for &(from, to, far) in parts {
            let length = to - from;
            // Distance and its derivative along the rule's unit interval.
            let at = |t: f64| {
                if far { (1.0 - (1.0 - t).powi(3), 3.0 * (1.0 - t).powi(2)) } else { (t.powi(3), 3.0 * t * t) }
            };
            let steps: [(f64, f64); M] = std::array::from_fn(|i| {
                let (x, slope) = at(rule.nodes[i]);
                (from + length * x, length * slope)
            });
            let log = |s: f64| self.air.profile.densities(shell.height(h, mu, s))[0].ln();
            let densities = steps.map(|(s, _)| self.air.profile.densities(shell.height(h, mu, s)));
            let (mut t, mut edge, mut log_edge) = (0.0, from, log(from));
            for i in 0..M {
                let (s, slope) = steps[i];
                let integrals: [f64; SPECIES] = std::array::from_fn(|k| {
                    passed[k] + (0..M).map(|j| rule.running[j][i] * steps[j].1 * densities[j][k]).sum::<f64>()
                });
                let clear = self.air.depths(integrals).map(|t| exp64(-t.max(0.0)));
                let weights = [0, 1].map(|k: usize| {
                    let scale = rule.weights[i] * slope * densities[i][k];
                    std::array::from_fn(|c| (scale * self.scattering[k][c] * clear[c]) as f32)
                });
                t += rule.weights[i];
                let next = if i + 1 == M { to } else { from + length * at(t).0 };
                let log_next = log(next);
                let log_slope = (log_next - log_edge) / (next - edge).max(1e-9);
                samples.push(SunlitSample { h: shell.height(h, mu, s), s, from: edge, to: next, log_slope, weights });
                (edge, log_edge) = (next, log_next);
            }
            for k in 0..SPECIES {
                passed[k] += (0..M).map(|j| rule.weights[j] * steps[j].1 * densities[j][k]).sum::<f64>();
            }
        }
        let clear = self.air.depths(passed).map(|t| exp64(-t) as f32);
        (samples, ground.map(|s| (s, clear)))
    }

    fn sample(&self, heights: &[f64], rich: f64, h: f64, mu: f64, s: f64, weights: [Channels; 2]) -> Sample {
        let i = heights.partition_point(|&x| x <= h).clamp(1, heights.len() - 1) - 1;
        let weight_above = ((h - heights[i]) / (heights[i + 1] - heights[i])).clamp(0.0, 1.0) as f32;
        let basis = schmidt(mu);
        let modes = if h < rich { MODES } else { FEW };
        let [mut molecules, mut aerosol] = [[0.0; MOMENTS]; 2];
        for m in 0..modes {
            for l in m..modes {
                let q = start(m) + l - m;
                let of = |k: usize| ((2 * l + 1) as f64 * self.phases[k].chi[l]) as f32 * basis[q];
                (molecules[q], aerosol[q]) = (if l < FEW { of(0) } else { 0.0 }, of(1));
            }
        }
        Sample { level: i, weight_above, h, mu, s, modes, weights, molecules, aerosol }
    }
}

//! Multiple scattering in a spherical atmosphere lit by one sun: every order, by Legendre moments of the light (floor 2).
//!
//! Light that was scattered at least once has no features sharper than the phase functions, so at a point it is kept as
//! its moments up to degree 8 ([`legendre`](super::legendre)), x being the sun's side of the local horizon: what a phase
//! function with moments `chi_l` makes of them in a direction is `sum of (2 l + 1) chi_l A_lm S_lm(mu) cos(m azimuth)`,
//! exact for molecules. Of the aerosol's peak only what is beyond degree 8 counts as not scattered (delta-M, Wiscombe
//! 1977): a tenth of Cornette and Shanks' function of g = 0.7. The caller adds the first order exactly, in whole air.
//!
//! The moments live on a grid of heights and sun angles. One order comes from the last by rays from every grid point, to
//! the ground and back from it (albedo, Lambert) or out of the air; what a ray scatters is first summed over degrees for
//! all suns, then over azimuths. Between grid points moments are interpolated over their mean, whose logarithm is nearly
//! linear in twilight; in the end, between sun angles, by a cubic, so that nothing steps. Orders go on until what is left, as
//! a geometric series, is below a hundredth, and is added.
//!
//! Error against Monte Carlo: tests below and docs/papers/realistic_sky.md.

use std::sync::LazyLock;

use super::legendre::{MODES, MOMENTS, schmidt, start};
pub use super::ray_samples::ScatteringMedium;
use super::ray_samples::{FEW, Path, Sample, azimuth, column, cubic, multiples};
pub use super::scattering::{C, Channels};
use super::stored::{Light, Moments};
use crate::error::Result;
use crate::job::Job;
use crate::math::elementary::exp;
use crate::math::lanes;
use crate::math::quadrature::Gauss;

/// Heights of the grid.
const HEIGHTS: usize = 30;
/// Polar angles above and below the horizon, azimuths of a half-turn.
const POLAR: usize = 9;
const ROUND: usize = 10;
/// At most so many orders.
const MOST: usize = 60;
/// Steps of the look-up from cosines to sun angles.
const STEPS: usize = 4096;

/// Orders in azimuth of what is scattered at a sample, for one sun.
type Modes = [Channels; MODES];

/// All orders from the first on, for a sun of irradiance 1.
#[derive(Debug)]
pub struct MultipleScattering {
    medium: ScatteringMedium,
    heights: Vec<f64>,
    /// Below this height all moments are kept.
    rich: f64,
    suns: Vec<f64>,
    first: Vec<u16>,
    /// Moments over their mean, sun angle within height, and the logarithm of the mean.
    moments: Vec<Moments>,
    logs: Vec<f32>,
    /// Irradiance of the ground by the sky and by the sun, for the sun angles.
    sky_on_ground: Vec<Channels>,
    sun_on_ground: Vec<Channels>,
    /// How many orders were followed.
    pub num_orders: usize,
}

/// Angles of the suns of the grid from the zenith \[degrees\].
fn sun_angles() -> Vec<f64> {
    let steps = [(0.0, 5.0, 15), (75.0, 3.0, 4), (87.0, 1.0, 1), (88.0, 0.5, 26), (101.0, 1.0, 9), (110.0, 2.0, 5)];
    steps.iter().flat_map(|&(from, step, count)| (0..count).map(move |i| from + step * f64::from(i))).collect()
}

impl MultipleScattering {
    /// Before any light is followed.
    fn dark(medium: ScatteringMedium) -> Self {
        let top = medium.air.profile.shell.thickness;
        let heights: Vec<f64> = (0..HEIGHTS).map(|i| top * (i as f64 / (HEIGHTS - 1) as f64).powf(2.4)).collect();
        let suns: Vec<f64> = sun_angles().into_iter().map(|a| a.to_radians().cos()).collect();
        let first = (0..=STEPS)
            .map(|i| {
                let mu = 1.0 - 2.0 * i as f64 / STEPS as f64;
                suns.partition_point(|&s| s > mu).clamp(1, suns.len() - 1) as u16 - 1
            })
            .collect();
        let sun_on_ground: Vec<Channels> =
            suns.iter().map(|&mu| medium.air.sunlight(0.0, mu).map(|t| t * mu.max(0.0) as f32)).collect();
        let rich = medium.rich();
        Self {
            medium,
            heights,
            rich,
            suns,
            first,
            moments: Vec::new(),
            logs: Vec::new(),
            sky_on_ground: Vec::new(),
            sun_on_ground,
            num_orders: 0,
        }
    }

    /// Grid points, and those of them that keep all moments.
    fn points(&self) -> [usize; 2] {
        [self.heights.len(), self.heights.partition_point(|&h| h < self.rich)].map(|n| n * self.suns.len())
    }

    /// The light that was followed in this medium before, from its bytes; `None` where they are of another grid.
    pub fn stored(medium: ScatteringMedium, bytes: &[u8]) -> Option<Self> {
        let mut all = Self::dark(medium);
        let [points, rich] = all.points();
        let light = Light::decode(bytes, points, rich, all.suns.len())?;
        (all.moments, all.logs, all.sky_on_ground, all.num_orders) =
            (light.moments, light.logs, light.ground, light.orders);
        Some(all)
    }

    /// The same as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let (moments, logs, ground) = (self.moments.clone(), self.logs.clone(), self.sky_on_ground.clone());
        Light { moments, logs, ground, orders: self.num_orders }.encode(self.points()[1])
    }

    /// Follow light through a medium until no more is left.
    pub fn new(job: &Job, medium: ScatteringMedium) -> Result<Self> {
        let mut all = Self::dark(medium);
        let count = all.points()[0];
        let paths = all.paths(job)?;
        let mut total = vec![[[0.0_f32; C]; MOMENTS]; count];
        let mut ground = vec![[0.0_f32; C]; all.suns.len()];
        let mut before = [0.0_f64; C];
        for order in 1..=MOST {
            let (moments, on_ground) = all.order(job, &paths, order)?;
            let mut now = [0.0_f64; C];
            for m in &moments {
                for c in 0..C {
                    now[c] += f64::from(m[0][c]);
                }
            }
            // What all further orders add, were each the same fraction of the last.
            let ratio: [f64; C] = std::array::from_fn(|c| (now[c] / before[c].max(1e-300)).min(0.98));
            let last = order > 3
                && (0..C).all(|c| {
                    let sum: f64 = total.iter().map(|m| f64::from(m[0][c])).sum();
                    now[c] * ratio[c] / (1.0 - ratio[c]) < 1e-2 * sum
                });
            let tail: Channels = std::array::from_fn(|c| if last { (1.0 / (1.0 - ratio[c])) as f32 } else { 1.0 });
            for (t, m) in total.iter_mut().zip(&moments) {
                for q in 0..MOMENTS {
                    for c in 0..C {
                        t[q][c] += m[q][c] * tail[c];
                    }
                }
            }
            for (t, g) in ground.iter_mut().zip(&on_ground) {
                for c in 0..C {
                    t[c] += g[c] * tail[c];
                }
            }
            all.num_orders = order;
            if last {
                break;
            }
            before = now;
            all.store(&moments, on_ground);
        }
        all.store(&total, ground);
        Ok(all)
    }

    fn store(&mut self, moments: &[Moments], on_ground: Vec<Channels>) {
        let mean = |m: &Moments| (m[0].iter().sum::<f32>() / C as f32).max(1e-30);
        self.logs = moments.iter().map(|m| mean(m).ln()).collect();
        self.moments = moments
            .iter()
            .map(|m| {
                let scale = 1.0 / mean(m);
                m.map(|band| band.map(|x| x * scale))
            })
            .collect();
        self.sky_on_ground = on_ground;
    }

    /// Rays from every height, first those above the horizon.
    fn paths(&self, job: &Job) -> Result<Vec<Vec<(Path, f64)>>> {
        let rule = Gauss::<POLAR>::new();
        job.map(self.heights.len(), |i| {
            let h = self.heights[i];
            let radius = self.medium.air.profile.shell.radius;
            let horizon = -(h * (2.0 * radius + h)).sqrt() / (radius + h) * (1.0 - 1e-9);
            let mut paths = Vec::with_capacity(2 * POLAR);
            for (span, tiny) in [(1.0 - horizon, 0.0), (-(1.0 + horizon), -1e-8)] {
                for k in 0..POLAR {
                    // Dense towards the horizon.
                    let t = rule.nodes[k];
                    let mu = (horizon + tiny + span * t * t).clamp(-1.0, 1.0);
                    let mut path = self.medium.path(&self.heights, self.rich, h, mu);
                    path.sunlit = self.medium.sunlit(h, mu);
                    paths.push((path, span.abs() * 2.0 * t * rule.weights[k]));
                }
            }
            Ok(paths)
        })
    }

    /// Moments of the light that was scattered `order` times, from what is stored of the order before.
    fn order(&self, job: &Job, paths: &[Vec<(Path, f64)>], order: usize) -> Result<(Vec<Moments>, Vec<Channels>)> {
        let suns = self.suns.len();
        let levels = job.map(self.heights.len(), |i| {
            Ok(lanes::run(
                #[inline(always)]
                || {
                    let mut moments = vec![[[0.0_f32; C]; MOMENTS]; suns];
                    let mut down = vec![[0.0_f32; C]; suns];
                    let mut lights = vec![[[0.0_f32; C]; ROUND]; suns];
                    let modes = if self.heights[i] < self.rich { MODES } else { FEW };
                    for (path, weight) in &paths[i] {
                        self.lights(path, self.heights[i], order, &mut lights);
                        let basis = schmidt(path.mu);
                        let w = (weight / (2.0 * ROUND as f64)) as f32;
                        for j in 0..suns {
                            Self::gather(&lights[j], modes, w, &basis, &mut moments[j]);
                            if i == 0 && path.mu > 0.0 {
                                let scale = w * path.mu as f32 * (4.0 * std::f64::consts::PI) as f32;
                                for light in &lights[j] {
                                    for c in 0..C {
                                        down[j][c] += scale * light[c];
                                    }
                                }
                            }
                        }
                    }
                    (moments, down)
                },
            ))
        })?;
        let ground = levels[0].1.clone();
        Ok((levels.into_iter().flat_map(|level| level.0).collect(), ground))
    }

    /// Add the moments of the light in directions of one polar angle.
    #[inline(always)]
    fn gather(lights: &[Channels; ROUND], modes: usize, w: f32, basis: &[f32; MOMENTS], moments: &mut Moments) {
        for m in 0..modes {
            let mut sum = [0.0_f32; C];
            for (light, cosines) in lights.iter().zip(&*COSINES) {
                for c in 0..C {
                    sum[c] += light[c] * cosines[m];
                }
            }
            for l in m..modes {
                let q = start(m) + l - m;
                let scale = w * basis[q];
                for c in 0..C {
                    moments[q][c] += scale * sum[c];
                }
            }
        }
    }

    /// Light along a path in several planes for every sun of the grid.
    #[inline(always)]
    fn lights(&self, path: &Path, h: f64, order: usize, out: &mut [[Channels; ROUND]]) {
        let radius = self.medium.air.profile.shell.radius;
        let flat = (1.0 - path.mu * path.mu).max(0.0).sqrt();
        let nus = |mu_sun: f64| -> [f64; ROUND] {
            let across = flat * (1.0 - mu_sun * mu_sun).max(0.0).sqrt();
            std::array::from_fn(|k| path.mu * mu_sun + across * f64::from(COSINES[k][1]))
        };
        out.fill([[0.0; C]; ROUND]);
        let count = if order == 1 { 0 } else { self.suns.len() };
        let mut modes = vec![[[0.0; C]; MODES]; count];
        let mut logs = vec![0.0; count];
        if order == 1 {
            for (light, &mu_sun) in out.iter_mut().zip(&self.suns) {
                let nu = nus(mu_sun);
                for r in 0..ROUND {
                    self.by_sun(path, h, mu_sun, nu[r], &mut light[r]);
                }
            }
        }
        for sample in path.samples.iter().filter(|_| order > 1) {
            self.sources(sample, 0..self.suns.len(), &mut modes, &mut logs);
            for (light, &mu_sun) in out.iter_mut().zip(&self.suns) {
                let nu = nus(mu_sun);
                for r in 0..ROUND {
                    let sun = (((radius + h) * mu_sun + sample.s * nu[r]) / (radius + sample.h)).clamp(-1.0, 1.0);
                    let (j, f) = self.sun(sun);
                    let cosines = multiples(azimuth(sample.mu, nu[r], sun));
                    add(sample.modes, &modes[j..], &logs[j..], [1.0 - f, f], &cosines, &mut light[r]);
                }
            }
        }
        let irradiance = if order == 1 { &self.sun_on_ground } else { &self.sky_on_ground };
        for (light, &mu_sun) in out.iter_mut().zip(&self.suns) {
            let nu = nus(mu_sun);
            for r in 0..ROUND {
                self.reflected(path, h, mu_sun, nu[r], irradiance, &mut light[r]);
            }
        }
    }

    /// Add what a ray scatters of sunlight. Of a stretch that is partly in the shadow of the ground, the part outside
    /// scatters as its share of the molecules: so nothing jumps as the sun moves.
    #[inline(always)]
    fn by_sun(&self, path: &Path, h: f64, mu_sun: f64, nu: f64, light: &mut Channels) {
        let shell = &self.medium.air.profile.shell;
        // The angle to the sun, and so the phase functions, are the same along a ray.
        let phase = self.medium.phases.map(|p| (p.at(nu) / (4.0 * std::f64::consts::PI)) as f32);
        let shadow = shell.shadow(h, path.mu, mu_sun, nu);
        for sample in &path.sunlit {
            let mut places = [(sample.s, sample.h, 1.0), (0.0, 0.0, 0.0)];
            if let Some((from, to)) = shadow.filter(|(a, b)| *a < sample.to && *b > sample.from) {
                let all = column(sample.log_slope, sample.to - sample.from);
                let lit = |a: f64, b: f64| {
                    let s = 0.5 * (a + b);
                    let before = (sample.log_slope * (a - sample.from)).exp();
                    if b > a {
                        (s, shell.height(h, path.mu, s), before * column(sample.log_slope, b - a) / all)
                    } else {
                        (0.0, 0.0, 0.0)
                    }
                };
                places = [lit(sample.from, from), lit(to.max(sample.from), sample.to)];
            }
            for (s, height, share) in places {
                if share <= 0.0 {
                    continue;
                }
                let sun = (((shell.radius + h) * mu_sun + s * nu) / (shell.radius + height)).clamp(-1.0, 1.0);
                let lit = self.medium.air.sunlight(height, sun);
                let scale = phase.map(|p| p * share as f32);
                for c in 0..C {
                    light[c] += lit[c] * (sample.weights[0][c] * scale[0] + sample.weights[1][c] * scale[1]);
                }
            }
        }
    }

    /// What the stored light scatters at a sample for some suns of the grid: orders in azimuth over their mean, and its
    /// logarithm.
    #[inline(always)]
    fn sources(&self, sample: &Sample, suns: std::ops::Range<usize>, modes: &mut [Modes], logs: &mut [f32]) {
        let count = self.suns.len();
        let (below, above) = (sample.level * count, (sample.level + 1) * count);
        let (g, kept) = (sample.weight_above, sample.modes);
        for (out, j) in suns.enumerate() {
            let (low, high) = (&self.moments[below + j], &self.moments[above + j]);
            logs[out] = self.logs[below + j] + g * (self.logs[above + j] - self.logs[below + j]);
            for m in 0..kept {
                let (mut molecules, mut aerosol) = ([0.0_f32; C], [0.0_f32; C]);
                for l in m..kept {
                    let q = start(m) + l - m;
                    for c in 0..C {
                        let value = low[q][c] + g * (high[q][c] - low[q][c]);
                        aerosol[c] += sample.aerosol[q] * value;
                        if l < FEW {
                            molecules[c] += sample.molecules[q] * value;
                        }
                    }
                }
                for c in 0..C {
                    modes[out][m][c] = sample.weights[0][c] * molecules[c] + sample.weights[1][c] * aerosol[c];
                }
            }
        }
    }

    /// Add what the ground at the end of a path sends back of its irradiance.
    #[inline(always)]
    fn reflected(&self, path: &Path, h: f64, mu_sun: f64, nu: f64, irradiance: &[Channels], light: &mut Channels) {
        if let Some((s, clear)) = &path.ground {
            let radius = self.medium.air.profile.shell.radius;
            let (j, f) = self.sun((((radius + h) * mu_sun + s * nu) / radius).clamp(-1.0, 1.0));
            let scale = (self.medium.albedo / std::f64::consts::PI) as f32;
            let (a, b) = (&irradiance[j], &irradiance[j + 1]);
            for c in 0..C {
                light[c] += scale * clear[c] * (a[c] + f * (b[c] - a[c]));
            }
        }
    }

    /// Place between the sun angles.
    #[inline(always)]
    fn sun(&self, mu: f64) -> (usize, f32) {
        let step = ((1.0 - mu) * (0.5 * STEPS as f64)) as usize;
        let mut j = self.first[step.min(STEPS)] as usize;
        // A step may hold the border of two angles.
        j += usize::from(j + 2 < self.suns.len() && mu < self.suns[j + 1]);
        let f = (self.suns[j] - mu) / (self.suns[j] - self.suns[j + 1]);
        (j, f.clamp(0.0, 1.0) as f32)
    }

    /// Light of the second and later orders along rays of one angle to the vertical from height `h`, whose cosines to the
    /// sun are `nus`, and what the ground at their end sends; and what the first order scattered by the phase functions
    /// without their peak. `shade` is a factor of sunlight on the ground at a distance, along a ray of some cosine to the sun.
    pub fn radiance(
        &self,
        h: f64,
        mu: f64,
        mu_sun: f64,
        nus: &[f64],
        shade: impl Fn(f64, f64) -> f64,
        out: &mut [Channels],
    ) {
        let path = self.medium.path(&self.heights, self.rich, h, mu);
        lanes::run(
            #[inline(always)]
            || self.along(&path, h, mu_sun, nus, shade, out),
        );
    }

    #[inline(always)]
    fn along(
        &self,
        path: &Path,
        h: f64,
        mu_sun: f64,
        nus: &[f64],
        shade: impl Fn(f64, f64) -> f64,
        out: &mut [Channels],
    ) {
        let radius = self.medium.air.profile.shell.radius;
        let most = self.suns.len();
        let mut modes = vec![[[0.0; C]; MODES]; most];
        let mut logs = vec![0.0; most];
        let mut places = vec![(0.0, 0); nus.len()];
        out.fill([0.0; C]);
        for sample in &path.samples {
            let (mut low, mut high) = (most, 0);
            for (place, &nu) in places.iter_mut().zip(nus) {
                let sun = (((radius + h) * mu_sun + sample.s * nu) / (radius + sample.h)).clamp(-1.0, 1.0);
                let j = self.sun(sun).0.clamp(1, most - 3) - 1;
                *place = (sun, j);
                (low, high) = (low.min(j), high.max(j + 4));
            }
            self.sources(sample, low..high, &mut modes, &mut logs);
            for ((&(sun, j), &nu), light) in places.iter().zip(nus).zip(&mut *out) {
                let w = cubic(sun.max(self.suns[most - 1]), std::array::from_fn(|k| self.suns[j + k]));
                let cosines = multiples(azimuth(sample.mu, nu, sun));
                add(sample.modes, &modes[j - low..], &logs[j - low..], w, &cosines, light);
            }
        }
        for (light, &nu) in out.iter_mut().zip(nus) {
            self.reflected(path, h, mu_sun, nu, &self.sky_on_ground, light);
            if let Some((s, clear)) = &path.ground {
                let sun = (((radius + h) * mu_sun + s * nu) / radius).clamp(-1.0, 1.0);
                let direct = self.medium.air.sunlight(0.0, sun);
                let scale = (self.medium.albedo / std::f64::consts::PI * sun.max(0.0) * shade(*s, nu)) as f32;
                for c in 0..C {
                    light[c] += scale * clear[c] * direct[c];
                }
            }
        }
    }
}

/// Cosines of multiples of the azimuths of a half-turn.
static COSINES: LazyLock<[[f32; MODES]; ROUND]> = LazyLock::new(|| {
    std::array::from_fn(|k| {
        std::array::from_fn(|m| (m as f64 * (k as f64 + 0.5) / ROUND as f64 * std::f64::consts::PI).cos() as f32)
    })
});

/// Add light in a direction, interpolated between suns.
#[inline(always)]
fn add<const K: usize>(
    kept: usize,
    modes: &[Modes],
    logs: &[f32],
    w: [f32; K],
    cosines: &[f32; MODES],
    light: &mut Channels,
) {
    let mut log = 0.0;
    for k in 0..K {
        log += w[k] * logs[k];
    }
    let scale = exp(log);
    let mut sum = [0.0_f32; C];
    for k in 0..K {
        let node = &modes[k];
        for m in 0..kept {
            let factor = w[k] * cosines[m];
            for c in 0..C {
                sum[c] += factor * node[m][c];
            }
        }
    }
    for c in 0..C {
        light[c] += scale * sum[c];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::air::legendre::Truncated;
    use crate::air::phase::{CornetteShanks, rayleigh};
    use crate::air::profile::{Molecules, Profile};
    use crate::air::scattering::SphericalAir;
    use crate::air::shell::Shell;
    use crate::air::single::Ray;

    /// Elevation of the sun, zenith angle and azimuth from the sun of the view \[degrees\]; radiance of the first and of all
    /// further orders: scripts/check_sky_truth_monte_carlo.py (error below 0.5 %, 1 % at -6 degrees).
    const MONTE_CARLO: [[f64; 5]; 16] = [
        [-6.0, 0.0, 0.0, 4.055353e-06, 7.475808e-06],
        [-6.0, 80.0, 180.0, 0.000000e+00, 1.879683e-05],
        [-6.0, 60.0, 0.0, 3.910708e-05, 2.551499e-05],
        [0.0, 0.0, 0.0, 1.284138e-03, 7.210032e-04],
        [0.0, 80.0, 180.0, 2.893106e-03, 2.376974e-03],
        [0.0, 80.0, 0.0, 5.403411e-03, 3.280883e-03],
        [5.0, 80.0, 90.0, 8.852817e-03, 9.472429e-03],
        [5.0, 0.0, 0.0, 4.167407e-03, 2.551898e-03],
        [15.0, 60.0, 180.0, 1.779029e-02, 1.048519e-02],
        [45.0, 0.0, 0.0, 1.784949e-02, 6.045258e-03],
        [45.0, 80.0, 180.0, 3.335037e-02, 2.401075e-02],
        [45.0, 60.0, 90.0, 1.921810e-02, 1.199200e-02],
        [-4.0, 0.0, 0.0, 8.814150e-05, 5.342530e-05],
        [-4.0, 80.0, 0.0, 7.040320e-04, 3.229350e-04],
        [-4.0, 80.0, 180.0, 3.110430e-06, 1.326040e-04],
        [5.0, 80.0, 180.0, 1.603630e-02, 1.058830e-02],
    ];

    /// Molecules (8 km) and aerosol (1.2 km, albedo 0.8, Cornette-Shanks 0.7) at 450 nm over a ground of albedo 0.032,
    /// the air ending at 60 km.
    fn medium() -> (SphericalAir, ScatteringMedium, [f64; 2]) {
        let shell = Shell { radius: 6.36e6, thickness: 6e4 };
        let (m, a) = (27.89e-6 * 273.16 / 288.16, 0.04 * 0.45_f64.powf(-0.8) / 1200.0);
        let phase = CornetteShanks::<f64>::new(0.7);
        let truncated = Truncated::new(|x| phase.at(1.0 - x, 1.0 + x, f64::sqrt));
        let profile = Profile::new(shell, Molecules::Exponential(8000.0), 1200.0, [1e4, 2.5e4, 4e4]);
        let air = SphericalAir::new(&Job::serial(), profile, [[m; C], [a; C], [0.0; C]]).expect("made");
        let medium = ScatteringMedium {
            air: air.with_aerosol([a * (1.0 - 0.8 * truncated.peak); C]),
            scattering: [[m; C], [(1.0 - truncated.peak) * 0.8 * a; C]],
            phases: [Truncated::new(|x| rayleigh(1.0 - x)), truncated],
            albedo: 0.032,
        };
        (air, medium, [m, 0.8 * a])
    }

    #[test]
    fn all_orders_agree_with_a_monte_carlo_by_day_and_in_twilight() {
        let (air, medium, [m, a]) = medium();
        let (thinned, truncated, scattered) = (medium.air.extinction[1], medium.phases[1], medium.scattering[1][0]);
        let all = MultipleScattering::new(&Job::serial(), medium).expect("followed");
        let phase = CornetteShanks::<f64>::new(0.7);
        let mut square = 0.0;
        for [elevation, zenith, azimuth, single, multiple] in MONTE_CARLO {
            let [e, z, azimuth] = [elevation, zenith, azimuth].map(f64::to_radians);
            let (mu, mu_sun) = (z.cos(), e.sin());
            let nu = mu * mu_sun + z.sin() * e.cos() * azimuth.cos();
            let s = air.scatter(&Ray { h: 0.0, mu, mu_sun, nu }, &thinned, None);
            let [whole, thin] = [s.whole, s.thinned].map(|x| [f64::from(x[0][0]), f64::from(x[1][0])]);
            let scale = 1.0 / (4.0 * std::f64::consts::PI);
            let aerosol = a * phase.at(1.0 - nu, 1.0 + nu, f64::sqrt);
            let once = scale * (m * rayleigh(1.0 - nu) * whole[0] + aerosol * whole[1]);
            assert!((once - single).abs() < 0.01 * (single + multiple), "the first order: {once} against {single}");
            let more = scale
                * (m * rayleigh(1.0 - nu) * (thin[0] - whole[0]) + scattered * truncated.at(nu) * (thin[1] - whole[1]));
            let mut rest = [[0.0; C]];
            all.radiance(0.0, mu, mu_sun, &[nu], |_, _| 1.0, &mut rest);
            let error = (once + more + f64::from(rest[0][0])) / (single + multiple) - 1.0;
            square += error * error;
            assert!(error.abs() < 0.03, "sun {elevation}, view {zenith}: {error}");
        }
        let rms = (square / MONTE_CARLO.len() as f64).sqrt();
        assert!(rms < 0.015, "root mean square {rms}");
    }

    #[test]
    fn a_white_ground_sheds_more_light_and_needs_more_orders() {
        let (_, mut white, _) = medium();
        white.albedo = 1.0;
        let (_, mut black, _) = medium();
        black.albedo = 0.0;
        let [white, black] = [white, black].map(|m| MultipleScattering::new(&Job::serial(), m).expect("followed"));
        for mu_sun in [1.0, 0.5, 0.1] {
            let [a, b] = [&white, &black].map(|all| {
                let mut out = [[0.0; C]];
                all.radiance(0.0, 0.9, mu_sun, &[0.5], |_, _| 1.0, &mut out);
                out[0][0]
            });
            assert!(a > b && a < 10.0 * b, "{a} over white, {b} over black");
        }
        assert!(white.num_orders > black.num_orders, "more light, more orders");
    }
}

//! Multiple scattering in a spherical atmosphere lit by one sun: every order, by the moments of the light (floor 2).
//!
//! Light that was scattered at least once has no sharp features, so at a point it is kept as its first moments: mean
//! `M`, flux `F_z, F_x` and pressure `K_zz, K_zx, K_xx`, x being the sun's side of the local horizon. What a phase
//! function with Legendre coefficients `chi` makes of them in a direction is
//! `M + 3 chi_1 (w F) + 5 chi_2 (3/2 w K w - M/2)`, exact for molecules. The forward peak of aerosol, beyond the second
//! coefficient, counts as not scattered at all (delta-M, Wiscombe 1977), in the transmittance too; single scattering
//! with the whole phase function is added by the caller (TMS, Nakajima and Tanaka 1988).
//!
//! The moments live on a grid of heights and sun angles: a spherical atmosphere is the same everywhere but for those.
//! One order comes from the last by rays from every grid point in 128 directions, to the ground and back from it
//! (albedo, Lambert) or out of the air. What a ray meets does not depend on the sun, so its transmittances are computed
//! once. Between sun angles moments are interpolated over their mean, whose logarithm is linear in twilight. Orders go
//! on until what is left, as a geometric series, is below a thousandth.
//!
//! Error against sasktran2: docs/papers/realistic_sky.md. Cost: 54 x 24 points, 30-60 ms an order on one thread.

use std::sync::LazyLock;

use super::single::ParticipatingMedium;
use crate::error::Result;
use crate::job::Job;
use crate::math::elementary::{exp, exp64};
use crate::math::lanes;
use crate::math::quadrature::Gauss;

/// Wavelengths.
pub const C: usize = 16;
/// One number for each wavelength.
pub type Channels = [f32; C];

/// Heights of the grid.
const HEIGHTS: usize = 24;
/// Samples of a ray, or of each half of one that passes a lowest point.
const N: usize = 12;
/// Polar angles above and below the horizon, azimuths of a half-turn.
const POLAR: usize = 8;
const ROUND: usize = 8;
/// Moments of a point.
const MOMENTS: usize = 6;
/// At most so many orders.
const MOST: usize = 40;
/// Steps of the look-up from cosines to sun angles.
const STEPS: usize = 2048;

static RULE: LazyLock<Gauss<N>> = LazyLock::new(Gauss::new);

/// What scatters.
#[derive(Debug, Clone)]
pub struct ScatteringMedium {
    /// Extinction, the forward peak of the aerosol left out.
    pub air: ParticipatingMedium<C>,
    /// Scattering on the ground by molecules and, without its peak, by aerosol \[1/length\].
    pub scattering: [[f64; C]; 2],
    /// First two Legendre coefficients of the aerosol's phase function without its peak, over `2 l + 1`.
    pub chi: [f64; 2],
    /// Albedo of the ground.
    pub albedo: f64,
}

/// Moments of the light at one grid point.
type Moments = [Channels; MOMENTS];

/// One sample of a ray: place between heights, cosine to the vertical there, distance, and scattering times length
/// times transmittance.
#[derive(Debug, Clone)]
struct Sample {
    level: usize,
    weight_above: f32,
    h: f64,
    mu: f64,
    s: f64,
    weights: [Channels; 2],
}

/// A ray from a height: its samples, its end on the ground with the transmittance.
#[derive(Debug, Clone)]
struct Path {
    mu: f64,
    samples: Vec<Sample>,
    ground: Option<(f64, Channels)>,
}

/// All orders from the first on, for a sun of irradiance 1.
#[derive(Debug)]
pub struct MultipleScattering {
    medium: ScatteringMedium,
    heights: Vec<f64>,
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

impl ScatteringMedium {
    /// Place between the heights.
    fn level(heights: &[f64], h: f64) -> (usize, f32) {
        let i = heights.partition_point(|&x| x <= h).clamp(1, heights.len() - 1) - 1;
        (i, ((h - heights[i]) / (heights[i + 1] - heights[i])).clamp(0.0, 1.0) as f32)
    }

    /// Samples of a ray.
    fn path(&self, heights: &[f64], h: f64, mu: f64) -> Path {
        let shell = &self.air.shell;
        let rule = &*RULE;
        let ground = shell.ground(h, mu);
        let end = ground.unwrap_or_else(|| shell.distance_to_top(h, mu, shell.thickness));
        let lowest = -(shell.radius + h) * mu;
        // Samples crowd where the air is dense: at the near end of a ray upwards, at the far end of one downwards.
        let parts: Vec<(f64, f64, bool)> = if ground.is_some() {
            vec![(0.0, end, true)]
        } else if lowest > 0.0 {
            vec![(0.0, lowest, true), (lowest, end, false)]
        } else {
            vec![(0.0, end, false)]
        };
        let mut passed = [0.0; 3];
        let mut samples = Vec::with_capacity(2 * N);
        for (from, to, far) in parts {
            let length = to - from;
            // Distance and its derivative along the rule's unit interval.
            let at = |t: f64| {
                if far { (1.0 - (1.0 - t).powi(3), 3.0 * (1.0 - t).powi(2)) } else { (t.powi(3), 3.0 * t * t) }
            };
            let steps: [(f64, f64); N] = std::array::from_fn(|i| {
                let (x, slope) = at(rule.nodes[i]);
                (from + length * x, length * slope)
            });
            let densities: [[f64; 3]; N] = std::array::from_fn(|i| self.air.densities(shell.height(h, mu, steps[i].0)));
            for i in 0..N {
                let (s, slope) = steps[i];
                let integrals: [f64; 3] = std::array::from_fn(|k| {
                    passed[k] + (0..N).map(|j| rule.running[j][i] * steps[j].1 * densities[j][k]).sum::<f64>()
                });
                let clear = self.air.depths(integrals).map(|t| exp64(-t.max(0.0)));
                let height = shell.height(h, mu, s);
                let (level, weight_above) = Self::level(heights, height);
                let weights = [0, 1].map(|k: usize| {
                    let scale = rule.weights[i] * slope * densities[i][k];
                    std::array::from_fn(|c| (scale * self.scattering[k][c] * clear[c]) as f32)
                });
                let here = ((shell.radius + h) * mu + s) / (shell.radius + height);
                samples.push(Sample { level, weight_above, h: height, mu: here, s, weights });
            }
            for k in 0..3 {
                passed[k] += (0..N).map(|j| rule.weights[j] * steps[j].1 * densities[j][k]).sum::<f64>();
            }
        }
        let clear = self.air.depths(passed).map(|t| exp64(-t) as f32);
        Path { mu, samples, ground: ground.map(|s| (s, clear)) }
    }

    /// Transmittance from one height to suns, black in the shadow of the ground.
    #[inline(always)]
    fn sunlight<const M: usize>(&self, h: f64, mu_sun: &[f64; M]) -> [Channels; M] {
        let shell = &self.air.shell;
        let dip = -(h * (2.0 * shell.radius + h)).sqrt() / (shell.radius + h);
        let mut out = [[0.0; C]; M];
        if mu_sun.iter().all(|&mu| mu < dip) {
            return out;
        }
        let columns = self.air.columns_above_fast(&[h; M], mu_sun);
        for i in 0..M {
            if mu_sun[i] >= dip {
                let depths = self.air.depths([0, 1, 2].map(|k: usize| columns[k][i]));
                for c in 0..C {
                    out[i][c] = exp(-depths[c] as f32);
                }
            }
        }
        out
    }
}

/// Cosines of a direction to the vertical and to the sun's side of the horizon, from its cosine to the sun.
#[inline(always)]
fn local(mu: f64, nu: f64, mu_sun: f64) -> (f32, f32) {
    let across = (1.0 - mu_sun * mu_sun).sqrt();
    let x = if across > 1e-6 { (nu - mu * mu_sun) / across } else { 0.0 };
    let most = (1.0 - mu * mu).max(0.0).sqrt();
    (mu as f32, x.clamp(-most, most) as f32)
}

/// The terms of a direction that multiply the moments, for a phase function with these coefficients.
#[inline(always)]
fn terms(mu: f32, x: f32, chi: [f32; 2]) -> [f32; MOMENTS] {
    let y2 = 1.0 - mu * mu - x * x;
    let (one, two) = (3.0 * chi[0], 7.5 * chi[1]);
    // K_yy is M - K_zz - K_xx.
    [1.0 - 2.5 * chi[1] + two * y2, one * mu, one * x, two * (mu * mu - y2), 2.0 * two * mu * x, two * (x * x - y2)]
}

impl MultipleScattering {
    /// Follow light through a medium until no more is left.
    pub fn new(job: &Job, medium: ScatteringMedium) -> Result<Self> {
        let top = medium.air.shell.thickness;
        let heights: Vec<f64> = (0..HEIGHTS).map(|i| top * (i as f64 / (HEIGHTS - 1) as f64).powf(2.2)).collect();
        let angles = (0..=16).map(|i| 5.0 * f64::from(i)).chain((82..=118).map(f64::from));
        let suns: Vec<f64> = angles.map(|a| a.to_radians().cos()).collect();
        let first = (0..=STEPS)
            .map(|i| {
                let mu = 1.0 - 2.0 * i as f64 / STEPS as f64;
                suns.partition_point(|&s| s > mu).clamp(1, suns.len() - 1) as u16 - 1
            })
            .collect();
        let sun_on_ground: Vec<Channels> =
            suns.iter().map(|&mu| medium.sunlight(0.0, &[mu])[0].map(|t| t * mu.max(0.0) as f32)).collect();
        let count = heights.len() * suns.len();
        let mut all = Self {
            medium,
            heights,
            suns,
            first,
            moments: Vec::new(),
            logs: Vec::new(),
            sky_on_ground: Vec::new(),
            sun_on_ground,
            num_orders: 0,
        };
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
                    now[c] * ratio[c] / (1.0 - ratio[c]) < 2e-2 * sum
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

    /// Keep moments over their mean.
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
            let radius = self.medium.air.shell.radius;
            let horizon = -(h * (2.0 * radius + h)).sqrt() / (radius + h) * (1.0 - 1e-9);
            let mut paths = Vec::with_capacity(2 * POLAR);
            for (span, tiny) in [(1.0 - horizon, 0.0), (-(1.0 + horizon), -1e-8)] {
                for k in 0..POLAR {
                    // Dense towards the horizon.
                    let t = rule.nodes[k];
                    let mu = (horizon + tiny + span * t * t).clamp(-1.0, 1.0);
                    paths.push((self.medium.path(&self.heights, h, mu), span.abs() * 2.0 * t * rule.weights[k]));
                }
            }
            Ok(paths)
        })
    }

    /// Moments of the light that was scattered `order` times, from what is stored of the order before.
    fn order(&self, job: &Job, paths: &[Vec<(Path, f64)>], order: usize) -> Result<(Vec<Moments>, Vec<Channels>)> {
        let suns = self.suns.len();
        let points = job.map(self.heights.len() * suns, |index| {
            let (i, j) = (index / suns, index % suns);
            Ok(lanes::run(
                #[inline(always)]
                || {
                    let mut moments = [[0.0_f32; C]; MOMENTS];
                    let mut down = [0.0_f32; C];
                    let mu_sun = self.suns[j];
                    let sun_flat = (1.0 - mu_sun * mu_sun).sqrt();
                    for (path, weight) in &paths[i] {
                        let mu = path.mu;
                        let flat = (1.0 - mu * mu).max(0.0).sqrt();
                        let across: [f64; ROUND] = std::array::from_fn(|k| {
                            flat * ((k as f64 + 0.5) / ROUND as f64 * std::f64::consts::PI).cos()
                        });
                        let nu = across.map(|x| mu * mu_sun + x * sun_flat);
                        let lights = if order == 1 {
                            self.by_sun(path, self.heights[i], mu_sun, &nu)
                        } else {
                            nu.map(|nu| self.along(path, self.heights[i], mu_sun, nu))
                        };
                        // Both sides of the sun's plane, over the whole sphere.
                        let w = (2.0 * weight / (4.0 * ROUND as f64)) as f32;
                        let mu = mu as f32;
                        for (light, x) in lights.iter().zip(across) {
                            let x = x as f32;
                            let basis = [1.0, mu, x, mu * mu, mu * x, x * x];
                            for q in 0..MOMENTS {
                                for c in 0..C {
                                    moments[q][c] += w * basis[q] * light[c];
                                }
                            }
                            if mu > 0.0 {
                                for c in 0..C {
                                    down[c] += w * mu * light[c] * (4.0 * std::f64::consts::PI) as f32;
                                }
                            }
                        }
                    }
                    (moments, down)
                },
            ))
        })?;
        let ground = points[..suns].iter().map(|p| p.1).collect();
        Ok((points.into_iter().map(|p| p.0).collect(), ground))
    }

    /// Light along a path in several planes, scattered once.
    #[inline(always)]
    fn by_sun(&self, path: &Path, h: f64, mu_sun: f64, nu: &[f64; ROUND]) -> [Channels; ROUND] {
        let radius = self.medium.air.shell.radius;
        let chi = self.chi();
        let mut light = [[0.0_f32; C]; ROUND];
        for sample in &path.samples {
            let sun = nu.map(|nu| (((radius + h) * mu_sun + sample.s * nu) / (radius + sample.h)).clamp(-1.0, 1.0));
            let lit = self.medium.sunlight(sample.h, &sun);
            for i in 0..ROUND {
                let n = nu[i] as f32;
                let phase = chi.map(|chi| {
                    (1.0 + 3.0 * chi[0] * n + 2.5 * chi[1] * (3.0 * n * n - 1.0)) / (4.0 * std::f32::consts::PI)
                });
                for c in 0..C {
                    let scattered = sample.weights[0][c] * phase[0] + sample.weights[1][c] * phase[1];
                    light[i][c] += scattered * lit[i][c];
                }
            }
        }
        for i in 0..ROUND {
            self.reflected(path, h, mu_sun, nu[i], &self.sun_on_ground, &mut light[i]);
        }
        light
    }

    /// Coefficients of the phase functions.
    #[inline(always)]
    fn chi(&self) -> [[f32; 2]; 2] {
        [[0.0, 0.1], self.medium.chi.map(|x| x as f32)]
    }

    /// Light along a path, scattered from the stored moments.
    #[inline(always)]
    fn along(&self, path: &Path, h: f64, mu_sun: f64, nu: f64) -> Channels {
        let radius = self.medium.air.shell.radius;
        let chi = self.chi();
        let mut light = [0.0_f32; C];
        for sample in &path.samples {
            let sun = (((radius + h) * mu_sun + sample.s * nu) / (radius + sample.h)).clamp(-1.0, 1.0);
            self.scattered(sample, sun, nu, &chi, &mut light);
        }
        self.reflected(path, h, mu_sun, nu, &self.sky_on_ground, &mut light);
        light
    }

    /// Add what the ground at the end of a path sends back of its irradiance.
    #[inline(always)]
    fn reflected(&self, path: &Path, h: f64, mu_sun: f64, nu: f64, irradiance: &[Channels], light: &mut Channels) {
        if let Some((s, clear)) = &path.ground {
            let radius = self.medium.air.shell.radius;
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

    /// Add what the stored light scatters at a sample into the ray.
    #[inline(always)]
    fn scattered(&self, sample: &Sample, mu_sun: f64, nu: f64, chi: &[[f32; 2]; 2], light: &mut Channels) {
        let (j, f) = self.sun(mu_sun);
        let (i, g) = (sample.level, sample.weight_above);
        let suns = self.suns.len();
        let at = [i * suns + j, i * suns + j + 1, (i + 1) * suns + j, (i + 1) * suns + j + 1];
        let weight = [(1.0 - g) * (1.0 - f), (1.0 - g) * f, g * (1.0 - f), g * f];
        let mut log = 0.0;
        for k in 0..4 {
            log += weight[k] * self.logs[at[k]];
        }
        let scale = exp(log);
        let (mu, x) = local(sample.mu, nu, mu_sun);
        let of = chi.map(|chi| terms(mu, x, chi));
        let mut source = [[0.0_f32; C]; 2];
        for q in 0..MOMENTS {
            let m = at.map(|k| &self.moments[k][q]);
            for c in 0..C {
                let value = weight[0] * m[0][c] + weight[1] * m[1][c] + weight[2] * m[2][c] + weight[3] * m[3][c];
                source[0][c] += of[0][q] * value;
                source[1][c] += of[1][q] * value;
            }
        }
        for k in 0..2 {
            for c in 0..C {
                light[c] += scale * sample.weights[k][c] * source[k][c];
            }
        }
    }

    /// Light of the second and later orders into a ray from height `h`, and what the ground at its end sends.
    pub fn radiance(&self, h: f64, mu: f64, mu_sun: f64, nu: f64) -> [f64; C] {
        let path = self.medium.path(&self.heights, h, mu);
        lanes::run(
            #[inline(always)]
            || {
                let mut light = self.along(&path, h, mu_sun, nu);
                if let Some((s, clear)) = &path.ground {
                    let radius = self.medium.air.shell.radius;
                    let sun = ((radius + h) * mu_sun + s * nu) / radius;
                    let [direct] = self.medium.sunlight(0.0, &[sun.clamp(-1.0, 1.0)]);
                    let scale = (self.medium.albedo / std::f64::consts::PI * sun.max(0.0)) as f32;
                    for c in 0..C {
                        light[c] += scale * clear[c] * direct[c];
                    }
                }
                light.map(f64::from)
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::air::phase::{CornetteShanks, rayleigh};
    use crate::air::shell::Shell;
    use crate::air::single::Ray;
    use crate::math::quadrature::adaptive;

    /// Elevation of the sun, zenith angle and azimuth from the sun of the view \[degrees\]; radiance of the first and
    /// of all further orders for a sun of irradiance 1: a backward Monte Carlo of the same spherical atmosphere,
    /// written independently (scripts/check_sky_truth_monte_carlo.py; statistical error below 0.5 %, 1 % at -6
    /// degrees).
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

    /// Molecules (8 km) and aerosol (1.2 km, albedo 0.8, Cornette-Shanks 0.7) at 450 nm over a ground of albedo 0.032.
    fn medium() -> (ScatteringMedium, f64, f64) {
        let shell = Shell { radius: 6.36e6, thickness: 6e4 };
        let (m, a) = (27.89e-6 * 273.16 / 288.16, 0.04 * 0.45_f64.powf(-0.8) / 1200.0);
        let phase = CornetteShanks::<f64>::new(0.7);
        let chi = |polynomial: fn(f64) -> f64| {
            let mut f = |x: f64| phase.at(1.0 - x, 1.0 + x, f64::sqrt) * polynomial(x);
            0.5 * adaptive(&mut f, -1.0, 1.0, 1e-10)
        };
        let (one, two, peak) = (chi(|x| x), chi(|x| 1.5 * x * x - 0.5), chi(|x| (2.5 * x * x - 1.5) * x));
        let air = ParticipatingMedium::new(shell, [8000.0, 1200.0], [[m; C], [a * (1.0 - 0.8 * peak); C]], true, false);
        let medium = ScatteringMedium {
            air,
            scattering: [[m; C], [(1.0 - peak) * 0.8 * a; C]],
            chi: [(one - peak) / (1.0 - peak), (two - peak) / (1.0 - peak)],
            albedo: 0.032,
        };
        (medium, m, 0.8 * a)
    }

    #[test]
    fn all_orders_agree_with_a_monte_carlo_by_day_and_in_twilight() {
        let (medium, m, a) = medium();
        let thin = medium.air.clone();
        let all = MultipleScattering::new(&Job::serial(), medium).expect("followed");
        let phase = CornetteShanks::<f64>::new(0.7);
        let mut square = 0.0;
        for [elevation, zenith, azimuth, single, multiple] in MONTE_CARLO {
            let [e, z, azimuth] = [elevation, zenith, azimuth].map(f64::to_radians);
            let (mu, mu_sun) = (z.cos(), e.sin());
            let nu = mu * mu_sun + z.sin() * e.cos() * azimuth.cos();
            let s = thin.scatter(&Ray { h: 0.0, mu, mu_sun, nu });
            let aerosol = a * phase.at(1.0 - nu, 1.0 + nu, f64::sqrt);
            let once = (m * rayleigh(1.0 - nu) * s.rayleigh[0] + aerosol * s.mie[0]) / (4.0 * std::f64::consts::PI);
            let error = (once + all.radiance(0.0, mu, mu_sun, nu)[0]) / (single + multiple) - 1.0;
            println!("sun {elevation}, view {zenith} at {azimuth:.2}: {:+.2} %", 100.0 * error);
            square += error * error;
            assert!(error.abs() < 0.055, "sun {elevation}, view {zenith}: {error}");
        }
        let rms = (square / MONTE_CARLO.len() as f64).sqrt();
        assert!(rms < 0.03, "root mean square {rms}");
    }

    #[test]
    fn a_white_ground_sheds_more_light_and_needs_more_orders() {
        let (mut white, _, _) = medium();
        white.albedo = 1.0;
        let (mut black, _, _) = medium();
        black.albedo = 0.0;
        let [white, black] = [white, black].map(|m| MultipleScattering::new(&Job::serial(), m).expect("followed"));
        for mu_sun in [1.0, 0.5, 0.1] {
            let (a, b) = (white.radiance(0.0, 0.9, mu_sun, 0.5)[0], black.radiance(0.0, 0.9, mu_sun, 0.5)[0]);
            assert!(a > b && a < 10.0 * b, "{a} over white, {b} over black");
        }
        assert!(white.num_orders > black.num_orders, "more light, more orders");
    }
}

//! Backward Monte Carlo of a clear sky, the reference of the fast solution: paths from the viewer through the spherical
//! air in `f64`, with a stated standard error (floor 2).
//!
//! It shares with the fast method what the air is ([`Profile`], extinction, phase functions) and nothing of how light is
//! followed: no moments, no peak counted apart, no tables of columns. The first order is a quadrature. For all others a
//! path starts at the viewer; where along a ray it scatters is drawn in proportion to the extinction of a band chosen at
//! random or, as often, evenly over the logarithm of the density, so that thin air in sunlight is met; then a direction
//! by the phase function; there the whole ray's first order is added ("next event" of a line), and so on until the path
//! is played out (Russian roulette). One path serves all bands: its weight in each is its probability there over the mean
//! of those in all (Veach's balance heuristic). The first five dimensions are rotated points of the R5 sequence
//! (Roberts 2018) in [`BATCHES`] independent batches, whose scatter is the standard error.
//!
//! Held against an independent program's values in `tests/oracles/test_sky_truth.py`. Cost: 0.1 ms a path.

use super::phase::{CornetteShanks, rayleigh};
use super::profile::{Profile, SPECIES};
use super::scattering::C;
use super::single::Ray;
use crate::math::elementary::exp64;
use crate::math::quadrature::gauss_legendre;
use crate::math::random::Stream;

use glam::DVec3;

/// Radiance in the bands.
pub type Bands = [f64; C];

/// Independent repetitions.
pub const BATCHES: usize = 16;
/// Events of a path at most.
const EVENTS: usize = 200;
/// Places of a ray's first order in each of its parts; of a column.
const LINE: usize = 28;
const COLUMN: usize = 20;
/// Steps of a ray in which a place is drawn.
const STEPS: usize = 40;

/// Air, its ground, and how light is followed in it.
#[derive(Debug, Clone)]
pub struct MonteCarlo {
    profile: Profile,
    extinction: [Bands; SPECIES],
    aerosol_albedo: f64,
    phase: CornetteShanks<f64>,
    ground_albedo: f64,
    line: Vec<(f64, f64)>,
    column: Vec<(f64, f64)>,
}

/// A ray cut into steps, for drawing places along it.
struct Steps {
    at: [f64; 2 * STEPS + 1],
    /// Columns from the start.
    passed: [[f64; SPECIES]; 2 * STEPS + 1],
    /// Running sum of what is drawn evenly over the logarithm of the density.
    even: [f64; 2 * STEPS + 1],
    count: usize,
}

impl MonteCarlo {
    /// Of air with this extinction (molecules, aerosol, ozone).
    pub fn new(
        profile: Profile,
        extinction: [Bands; SPECIES],
        aerosol_albedo: f64,
        g: f64,
        ground_albedo: f64,
    ) -> Self {
        let (line, column) = (gauss_legendre(LINE), gauss_legendre(COLUMN));
        Self { profile, extinction, aerosol_albedo, phase: CornetteShanks::new(g), ground_albedo, line, column }
    }

    fn depths(&self, columns: [f64; SPECIES]) -> Bands {
        let e = &self.extinction;
        std::array::from_fn(|c| e[0][c] * columns[0] + e[1][c] * columns[1] + e[2][c] * columns[2])
    }

    /// Ends of a ray's parts: its lowest point and its end, and whether that is the ground.
    fn ends(&self, h: f64, mu: f64) -> (f64, f64, bool) {
        let shell = &self.profile.shell;
        if let Some(ground) = shell.ground(h, mu) {
            return (ground, ground, true);
        }
        ((-(shell.radius + h) * mu).max(0.0), shell.distance_to_top(h, mu, shell.thickness), false)
    }

    /// Columns to the top along a ray that does not meet the ground.
    fn columns(&self, h: f64, mu: f64) -> [f64; SPECIES] {
        let (low, end, _) = self.ends(h, mu);
        let mut sum = [0.0; SPECIES];
        for (length, sign) in [(low, -1.0), (end - low, 1.0)] {
            if length <= 0.0 {
                continue;
            }
            for &(x, w) in &self.column {
                // Dense at the lowest point.
                let (s, slope) = (x * x * x, 3.0 * x * x);
                let densities = self.profile.densities(self.profile.shell.height(h, mu, low + sign * length * s));
                for k in 0..SPECIES {
                    sum[k] += w * slope * length * densities[k];
                }
            }
        }
        sum
    }

    /// Sunlight at a point.
    fn sunlight(&self, h: f64, mu_sun: f64) -> Option<Bands> {
        if self.profile.shell.ground(h, mu_sun).is_some() {
            return None;
        }
        Some(self.depths(self.columns(h, mu_sun)).map(|t| exp64(-t)))
    }

    /// The first order along a ray and, where `ground`, what the ground at its end sends of sunlight, for a sun of
    /// irradiance 1.
    fn first(&self, ray: &Ray, ground: bool) -> Bands {
        let shell = &self.profile.shell;
        let (low, end, hit) = self.ends(ray.h, ray.mu);
        let (near, far) = (1.0 - ray.nu, 1.0 + ray.nu);
        let scale = 1.0 / (4.0 * std::f64::consts::PI);
        let phases = [scale * rayleigh(near), scale * self.aerosol_albedo * self.phase.at(near, far, f64::sqrt)];
        let mut cuts = vec![0.0, low, end];
        if let Some((a, b)) = shell.shadow(ray.h, ray.mu, ray.mu_sun, ray.nu) {
            cuts.extend([a, b]);
        }
        // Aerosol lies low: a part that begins in it has a cut above.
        cuts.retain(|s| (0.0..=end).contains(s));
        cuts.sort_by(f64::total_cmp);
        let mut sum = [0.0; C];
        let mut passed = [0.0; SPECIES];
        let sun_at = |s: f64| {
            let h = shell.height(ray.h, ray.mu, s);
            (h, (((shell.radius + ray.h) * ray.mu_sun + s * ray.nu) / (shell.radius + h)).clamp(-1.0, 1.0))
        };
        for w in cuts.windows(2) {
            let (from, to) = (w[0], w[1]);
            if to - from < 1e-6 {
                continue;
            }
            let (h, mu) = sun_at(0.5 * (from + to));
            let lit = shell.ground(h, mu).is_none();
            // Dense at the lower end.
            let down = shell.height(ray.h, ray.mu, to) < shell.height(ray.h, ray.mu, from);
            let (mut column, mut at, mut before) =
                (passed, from, self.profile.densities(shell.height(ray.h, ray.mu, from)));
            for i in 0..self.line.len() {
                let (x, weight) = if down { self.line[self.line.len() - 1 - i] } else { self.line[i] };
                let (fraction, slope) = (x * x * x, 3.0 * x * x);
                let s = if down { to - (to - from) * fraction } else { from + (to - from) * fraction };
                let (h, mu) = sun_at(s);
                let densities = self.profile.densities(h);
                let between =
                    mean(before, densities, || self.profile.densities(shell.height(ray.h, ray.mu, 0.5 * (at + s))));
                for k in 0..SPECIES {
                    column[k] += (s - at) * between[k];
                }
                (at, before) = (s, densities);
                if lit {
                    let up = self.columns(h, mu);
                    let depths = self.depths([0, 1, 2].map(|k: usize| column[k] + up[k]));
                    let w = weight * slope * (to - from);
                    for c in 0..C {
                        let scattered = self.extinction[0][c] * densities[0] * phases[0]
                            + self.extinction[1][c] * densities[1] * phases[1];
                        sum[c] += w * scattered * exp64(-depths[c]);
                    }
                }
            }
            let end = self.profile.densities(shell.height(ray.h, ray.mu, to));
            let between = mean(before, end, || self.profile.densities(shell.height(ray.h, ray.mu, 0.5 * (at + to))));
            for k in 0..SPECIES {
                passed[k] = column[k] + (to - at) * between[k];
            }
        }
        if hit && ground {
            let (_, mu) = sun_at(end);
            if let Some(light) = self.sunlight(0.0, mu) {
                let clear = self.depths(passed);
                for c in 0..C {
                    sum[c] += self.ground_albedo / std::f64::consts::PI * mu * light[c] * exp64(-clear[c]);
                }
            }
        }
        sum
    }

    fn steps(&self, h: f64, mu: f64, low: f64, end: f64) -> Steps {
        let shell = &self.profile.shell;
        let mut out = Steps {
            at: [0.0; 2 * STEPS + 1],
            passed: [[0.0; SPECIES]; 2 * STEPS + 1],
            even: [0.0; 2 * STEPS + 1],
            count: 0,
        };
        let mut before = self.profile.densities(h);
        for (from, to, far) in [(0.0, low, true), (low, end, false)] {
            if to - from < 1e-6 {
                continue;
            }
            for i in 1..=STEPS {
                let x = i as f64 / STEPS as f64;
                let s = from + (to - from) * if far { 1.0 - (1.0 - x).powi(3) } else { x.powi(3) };
                let (n, at) = (out.count, out.at[out.count]);
                let densities = self.profile.densities(shell.height(h, mu, s));
                let middle = mean(before, densities, || self.profile.densities(shell.height(h, mu, 0.5 * (at + s))));
                out.at[n + 1] = s;
                for k in 0..SPECIES {
                    out.passed[n + 1][k] = out.passed[n][k] + (s - at) * middle[k];
                }
                // Evenly over the steps, which crowd where the air is dense, as far as light comes.
                let seen = exp64(-self.depths(out.passed[n]).iter().fold(f64::INFINITY, |a, &b| a.min(b)));
                out.even[n + 1] = out.even[n] + seen.max(1e-6);
                out.count = n + 1;
                before = densities;
            }
        }
        out
    }

    /// Radiance of the second and later orders and of light from the ground along the ray `to` from a height, by one path.
    fn path(&self, h: f64, to: DVec3, sun: DVec3, mut random: impl FnMut() -> f64) -> Bands {
        let shell = &self.profile.shell;
        let mut sum = [0.0; C];
        let mut weight = [1.0; C];
        let (mut at, mut direction) = (DVec3::new(0.0, 0.0, shell.radius + h), to);
        let mut height = h;
        for event in 0..EVENTS {
            let radius = shell.radius + height;
            let mu = (at.dot(direction) / radius).clamp(-1.0, 1.0);
            let (low, end, hit) = self.ends(height, mu);
            let steps = self.steps(height, mu, low, end);
            let n = steps.count;
            if n == 0 && !(hit && self.ground_albedo > 0.0) {
                break;
            }
            let total = self.depths(steps.passed[n]);
            // A path that meets the ground reflects there or scatters before, as often; on the ground there is no air before.
            let reflects = match (hit && self.ground_albedo > 0.0, n) {
                (false, _) => 0.0,
                (true, 0) => 1.0,
                (true, _) => 0.5,
            };
            if random() < reflects {
                let normal = (at + direction * end).normalize();
                for c in 0..C {
                    weight[c] *= self.ground_albedo * exp64(-total[c]) / reflects;
                }
                let (u, v) = (random(), random());
                let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
                let aside = normal.any_orthonormal_vector();
                direction = (aside * cos + normal.cross(aside) * sin) * u.sqrt() + normal * (1.0 - u).max(0.0).sqrt();
                (at, height) = (normal * shell.radius, 0.0);
            } else {
                let (even, band) = (random(), random());
                let x = random();
                let seen: Bands = total.map(|t| -(-t).exp_m1());
                // Place along the ray, drawn within a step linearly in distance.
                let i = if even < 0.5 {
                    let want = x * steps.even[n];
                    steps.even[1..=n].partition_point(|&e| e < want).min(n - 1)
                } else {
                    let band = ((band * C as f64) as usize).min(C - 1);
                    let want = -(-x * seen[band]).ln_1p();
                    let depth = |p: &[f64; SPECIES]| (0..SPECIES).map(|k| self.extinction[k][band] * p[k]).sum::<f64>();
                    steps.passed[1..=n].partition_point(|p| depth(p) < want).min(n - 1)
                };
                let (a, b) = (steps.at[i], steps.at[i + 1]);
                let s = a + (b - a) * random();
                let length = b - a;
                let (near, far) = (self.depths(steps.passed[i]), self.depths(steps.passed[i + 1]));
                // Density of drawing this place: of the two ways, and of the band.
                let mut density = 0.5 * (steps.even[i + 1] - steps.even[i]) / steps.even[n] / length;
                for c in 0..C {
                    let share = (exp64(-near[c]) - exp64(-far[c])) / seen[c].max(1e-300);
                    density += 0.5 / C as f64 * share / length;
                }
                let h = shell.height(height, mu, s);
                let densities = self.profile.densities(h);
                let between = mean(self.profile.densities(shell.height(height, mu, a)), densities, || {
                    self.profile.densities(shell.height(height, mu, 0.5 * (a + s)))
                });
                let depths = self.depths([0, 1, 2].map(|k: usize| steps.passed[i][k] + (s - a) * between[k]));
                // Which scatters is drawn by the middle of the bands' shares; the weights make up for the rest.
                let scatter: [Bands; 2] = [
                    std::array::from_fn(|c| self.extinction[0][c] * densities[0]),
                    std::array::from_fn(|c| self.aerosol_albedo * self.extinction[1][c] * densities[1]),
                ];
                let strength = |k: usize| (0..C).map(|c| weight[c] * scatter[k][c]).sum::<f64>();
                let (m, p) = (strength(0), strength(1));
                if m + p <= 0.0 {
                    break;
                }
                let from_air = random() * (m + p) < m;
                let cos = if from_air { draw_rayleigh(&mut random) } else { self.draw_aerosol(&mut random) };
                let turn = std::f64::consts::TAU * random();
                let aside = direction.any_orthonormal_vector();
                let other = direction.cross(aside);
                let sine = (1.0 - cos * cos).max(0.0).sqrt();
                let next = direction * cos + (aside * turn.cos() + other * turn.sin()) * sine;
                let phases = [rayleigh(1.0 - cos), self.phase.at(1.0 - cos, 1.0 + cos, f64::sqrt)];
                // Density of the direction, of both species.
                let drawn = (m * phases[0] + p * phases[1]) / (m + p);
                for c in 0..C {
                    let value = (scatter[0][c] * phases[0] + scatter[1][c] * phases[1]) * exp64(-depths[c]);
                    weight[c] *= value / (density * drawn * (1.0 - reflects));
                }
                let place = at + direction * s;
                at = place.normalize() * (shell.radius + h);
                height = h;
                direction = next.normalize();
            }
            let up = at / (shell.radius + height);
            let ray =
                Ray { h: height, mu: direction.dot(up).clamp(-1.0, 1.0), mu_sun: sun.dot(up), nu: direction.dot(sun) };
            let light = self.first(&ray, true);
            for c in 0..C {
                sum[c] += weight[c] * light[c];
            }
            // Roulette on what is left of the path.
            let most = weight.iter().fold(0.0_f64, |a, &b| a.max(b));
            let go_on = if event < 2 { 1.0 } else { most.clamp(0.05, 0.95) };
            if most <= 0.0 || random() > go_on {
                break;
            }
            weight = weight.map(|w| w / go_on);
        }
        sum
    }

    fn draw_aerosol(&self, random: &mut impl FnMut() -> f64) -> f64 {
        let g = self.phase.asymmetry();
        loop {
            // Henyey and Greenstein's, which (1 + c^2) / 2 turns into Cornette and Shanks'.
            let x = 2.0 * random() - 1.0;
            let c = if g.abs() < 1e-3 {
                x
            } else {
                let k = (1.0 - g * g) / (1.0 + g * x);
                (1.0 + g * g - k * k) / (2.0 * g)
            };
            if 2.0 * random() <= 1.0 + c * c {
                return c.clamp(-1.0, 1.0);
            }
        }
    }

    /// Radiance of all orders seen from `h` \[m\] in the direction `to` for a sun of irradiance 1, z being the vertical:
    /// the first order, the others by `paths` paths, and the others of each batch.
    pub fn radiance(&self, h: f64, to: DVec3, sun: DVec3, paths: usize, key: u64) -> (Bands, Bands, [Bands; BATCHES]) {
        let first = self.first(&Ray { h, mu: to.z, mu_sun: sun.z, nu: to.dot(sun) }, true);
        let each = paths.div_ceil(BATCHES);
        // 1 / x of the real root of x^6 = x + 1 and its powers.
        let root = 1.134_724_138_401_519_5_f64;
        let batches = std::array::from_fn(|batch| {
            let stream = Stream::new(key, batch as u64);
            let mut sum = [0.0; C];
            for i in 0..each {
                let mut count = 0_u64;
                let random = || {
                    count += 1;
                    let at = if count <= 5 {
                        let step = root.powi(-(count as i32));
                        return (stream.uniform(count) + step * i as f64).fract();
                    } else {
                        (i as u64 + 1) << 20 | count
                    };
                    stream.uniform(at)
                };
                let found = self.path(h, to, sun, random);
                for c in 0..C {
                    sum[c] += found[c] / each as f64;
                }
            }
            sum
        });
        let rest = std::array::from_fn(|c| batches.iter().map(|b: &Bands| b[c]).sum::<f64>() / BATCHES as f64);
        (first, rest, batches)
    }
}

/// Mean densities over a stretch by Simpson's rule.
#[inline(always)]
fn mean(a: [f64; SPECIES], b: [f64; SPECIES], middle: impl Fn() -> [f64; SPECIES]) -> [f64; SPECIES] {
    let middle = middle();
    std::array::from_fn(|k| (a[k] + 4.0 * middle[k] + b[k]) / 6.0)
}

fn draw_rayleigh(random: &mut impl FnMut() -> f64) -> f64 {
    loop {
        let c = 2.0 * random() - 1.0;
        if 2.0 * random() <= 1.0 + c * c {
            return c;
        }
    }
}

//! Single scattering (in-scattering) of one distant sun along a ray through an atmosphere, a participating medium
//! (floor 2): the line integral behind aerial perspective and the colour of a clear sky.
//!
//! AOAS eq 4 as O'Neil 2005 means it:
//! `I = E sum_c K_c F_c(angle) integral of rho exp(-4 pi (K_R + K_M)(depth to the sun + depth to the eye)) ds`, here
//! without `E`, `K` and the phase functions, which belong to the direction and not to the path. A ray is cut where the
//! shadow of the ground begins and ends, at its lowest point, and into panels that are neither thick nor many scale
//! heights high; each panel is a Gauss-Legendre sum whose running integral gives the depth to the eye.
//! [`ParticipatingMedium::reference`] is adaptive to 1e-9 (`panels_agree_with_adaptive_quadrature`: within 3e-5, and
//! 2e-4 where a grazing sun is behind hundreds of optical depths).
//!
//! [`RayMarch`] is the paper's way: equal steps, sampled at their middle, or at their start as eq 3 says.

use std::sync::LazyLock;

use super::shell::{ExponentialColumn, Shell, oneil};
use crate::math::elementary::exp64;
use crate::math::quadrature::{Gauss, adaptive, gauss_legendre};

/// Points of a panel.
const N: usize = 12;
/// Scale heights and optical depths that a panel spans at most.
const E_FOLDINGS: f64 = 4.0;
/// The same where a low sun is behind so much air that its light ends within a scale height.
const E_FOLDINGS_OPAQUE: f64 = 1.25;
const THICK: f64 = 6.0;
/// Beyond this optical depth nothing is seen.
const BLACK: f64 = 45.0;

static RULE: LazyLock<Gauss<N>> = LazyLock::new(Gauss::new);
static GAS_RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| gauss_legendre(48));

/// Equal steps along the ray, as in AOAS and O'Neil.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RayMarch {
    /// How many.
    pub samples: usize,
    /// Sampled at their start (eq 3 as printed) and not in their middle.
    pub left_rule: bool,
}

/// A shell of air with Rayleigh and aerosol scattering in `C` channels, and a gas that absorbs.
#[derive(Debug, Clone)]
pub struct ParticipatingMedium<const C: usize> {
    /// Ground and top.
    pub shell: Shell,
    columns: [ExponentialColumn; 2],
    alike: bool,
    /// Extinction on the ground by molecules and aerosol, and by the gas where it is densest, of each channel.
    extinction: [[f64; C]; 3],
    /// Heights between which the gas grows from nothing to its densest and back.
    layer: Option<[f64; 3]>,
    e_foldings: f64,
    shadow: bool,
    polynomial: bool,
}

/// What is seen along a ray, per unit of `E K F`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleScattering<const C: usize> {
    /// Integral for molecules.
    pub rayleigh: [f64; C],
    /// Integral for aerosol.
    pub mie: [f64; C],
    /// Transmittance: the fraction of the light that comes through from the far end.
    pub transmittance: [f64; C],
}

impl<const C: usize> Default for SingleScattering<C> {
    fn default() -> Self {
        Self { rayleigh: [0.0; C], mie: [0.0; C], transmittance: [1.0; C] }
    }
}

/// A ray from a point at height `h`: cosines of its angle and of the sun's to the vertical, and of that between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Height of the eye.
    pub h: f64,
    /// Ray and vertical.
    pub mu: f64,
    /// Sun and vertical.
    pub mu_sun: f64,
    /// Ray and sun.
    pub nu: f64,
}

impl<const C: usize> ParticipatingMedium<C> {
    /// Air that scatters with these extinctions on the ground (molecules, aerosol) and scale heights. `shadow`: the
    /// ground hides the sun; `polynomial`: depths by O'Neil's polynomial.
    pub fn new(shell: Shell, scales: [f64; 2], scattering: [[f64; C]; 2], shadow: bool, polynomial: bool) -> Self {
        // Optical depth along the ground, Chapman's sqrt(pi r H / 2).
        let level = |k: &[f64; C], scale: f64| {
            let thickest = k.iter().fold(0.0_f64, |a, &k| a.max(k));
            thickest * (0.5 * std::f64::consts::PI * shell.radius * scale).sqrt()
        };
        let opaque = level(&scattering[0], scales[0]).max(level(&scattering[1], scales[1])) > 40.0;
        Self {
            e_foldings: if opaque { E_FOLDINGS_OPAQUE } else { E_FOLDINGS },
            shell,
            columns: scales.map(|s| ExponentialColumn::new(&shell, s)),
            alike: scales[0] == scales[1],
            extinction: [scattering[0], scattering[1], [0.0; C]],
            layer: None,
            shadow,
            polynomial,
        }
    }

    /// With a gas that absorbs, in a layer that begins, is densest and ends at these heights.
    #[must_use]
    pub fn absorbing(mut self, layer: [f64; 3], extinction: [f64; C]) -> Self {
        self.layer = Some(layer);
        self.extinction[2] = extinction;
        self
    }

    /// Density of the gas at a height, 1 where it is densest.
    #[inline(always)]
    pub fn gas(&self, h: f64) -> f64 {
        match self.layer {
            None => 0.0,
            Some([low, peak, high]) => {
                let x = if h < peak { (h - low) / (peak - low) } else { (high - h) / (high - peak) };
                if x > 0.0 { x } else { 0.0 }
            }
        }
    }

    /// Densities of molecules, aerosol and gas at a height.
    #[inline(always)]
    pub fn densities(&self, h: f64) -> [f64; 3] {
        [self.columns[0].density(h), self.columns[1].density(h), self.gas(h)]
    }

    /// Integral of the gas from each point to the top.
    #[inline(always)]
    fn gas_depth<const M: usize>(&self, h: &[f64; M], mu: &[f64; M]) -> [f64; M] {
        let mut sum = [0.0; M];
        if self.layer.is_some() {
            let mut end = [0.0; M];
            for i in 0..M {
                end[i] = self.shell.distance_to_top(h[i], mu[i], self.shell.thickness);
            }
            for &(x, w) in &*GAS_RULE {
                for i in 0..M {
                    sum[i] += w * self.gas(self.shell.height(h[i], mu[i], x * end[i]));
                }
            }
            for i in 0..M {
                sum[i] *= end[i];
            }
        }
        sum
    }

    /// Integrals of the densities from each point to the top, without adaptive quadrature.
    #[inline(always)]
    pub fn columns_above_fast<const M: usize>(&self, h: &[f64; M], mu: &[f64; M]) -> [[f64; M]; 3] {
        let [molecules, aerosol] = [0, 1].map(|k: usize| self.columns[k].depth(&self.shell, h, mu));
        [molecules, aerosol, self.gas_depth(h, mu)]
    }

    /// Cosine of the sun's angle to the vertical after the distance `s`, and the height there.
    #[inline(always)]
    fn along(&self, ray: &Ray, s: f64) -> (f64, f64) {
        let h = self.shell.height(ray.h, ray.mu, s);
        let mu = ((self.shell.radius + ray.h) * ray.mu_sun + s * ray.nu) / (self.shell.radius + h);
        (h, mu)
    }

    /// Distance to the end of a ray, and whether that is the ground.
    pub fn end(&self, ray: &Ray) -> (f64, bool) {
        match self.shell.ground(ray.h, ray.mu) {
            Some(s) => (s, true),
            None => (self.shell.distance_to_top(ray.h, ray.mu, self.shell.thickness), false),
        }
    }

    /// Ascending distances at which the integrand or its derivative jumps, ends included, and the shadow.
    fn cuts(&self, ray: &Ray) -> ([f64; 5], usize, Option<(f64, f64)>) {
        let (end, _) = self.end(ray);
        let shadow = if self.shadow { self.shell.shadow(ray.h, ray.mu, ray.mu_sun, ray.nu) } else { None };
        let lowest = -(self.shell.radius + ray.h) * ray.mu;
        let (from, to) = shadow.unwrap_or((0.0, 0.0));
        let mut cuts = [0.0; 5];
        let mut count = 1;
        let mut inner = [lowest, from, to];
        inner.sort_by(f64::total_cmp);
        for s in inner {
            if s > cuts[count - 1] && s < end {
                cuts[count] = s;
                count += 1;
            }
        }
        cuts[count] = end;
        (cuts, count, shadow)
    }

    /// Optical depths of the channels for the integrals of the densities.
    #[inline(always)]
    pub fn depths(&self, integrals: [f64; 3]) -> [f64; C] {
        let e = &self.extinction;
        std::array::from_fn(|c| e[0][c] * integrals[0] + e[1][c] * integrals[1] + e[2][c] * integrals[2])
    }

    /// Light scattered into a ray, by panels.
    #[inline(always)]
    pub fn scatter(&self, ray: &Ray) -> SingleScattering<C> {
        let mut out = SingleScattering::default();
        let mut passed = [0.0; 3];
        let (cuts, count, shadow) = self.cuts(ray);
        // What is left of the steeper species so far above its densest place needs no care.
        let steep = usize::from(self.columns[1].scale < self.columns[0].scale);
        let lowest = self.shell.height(ray.h, ray.mu, (-(self.shell.radius + ray.h) * ray.mu).clamp(0.0, cuts[count]));
        let gone = lowest + 16.0 * self.columns[steep].scale;
        for k in 0..count {
            let (from, to) = (cuts[k], cuts[k + 1]);
            let middle = 0.5 * (from + to);
            let sunlit = shadow.is_none_or(|(a, b)| middle < a || middle > b);
            let mut a = from;
            while a < to {
                let mut b = to;
                let live = self.depths(passed).map(|t| t < BLACK);
                // Halved until it is smooth; what follows is cut in the same way.
                for _ in 0..30 {
                    let (ha, hb) = (self.shell.height(ray.h, ray.mu, a), self.shell.height(ray.h, ray.mu, b));
                    let low = ha.min(hb);
                    let thick = self.depths(self.densities(low).map(|rho| rho * (b - a)));
                    let e_foldings = (ha - hb).abs() / self.columns[if low < gone { steep } else { 1 - steep }].scale;
                    if e_foldings <= self.e_foldings && (0..C).all(|c| !live[c] || thick[c] <= THICK) {
                        break;
                    }
                    b = a + 0.5 * (b - a);
                }
                self.panel(ray, a, b, sunlit && live.contains(&true), &mut passed, &mut out);
                a = b;
            }
        }
        out.transmittance = self.depths(passed).map(|t| exp64(-t));
        out
    }

    #[inline(always)]
    fn panel(&self, ray: &Ray, a: f64, b: f64, sunlit: bool, passed: &mut [f64; 3], out: &mut SingleScattering<C>) {
        let rule = &*RULE;
        let length = b - a;
        let (mut h, mut mu) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (h[i], mu[i]) = self.along(ray, a + length * rule.nodes[i]);
        }
        let mut density = [[0.0; N]; 3];
        let mut depth = [[0.0; N]; 3];
        for k in 0..3 {
            if (k == 1 && self.alike) || (k == 2 && self.layer.is_none()) {
                continue;
            }
            for i in 0..N {
                density[k][i] = if k == 2 { self.gas(h[i]) } else { self.columns[k].density(h[i]) };
            }
            if sunlit {
                depth[k] = if k == 2 {
                    self.gas_depth(&h, &mu)
                } else if self.polynomial {
                    let column = &self.columns[k];
                    std::array::from_fn(|i| column.density(h[i]) * oneil(column.scale, mu[i]))
                } else {
                    self.columns[k].depth(&self.shell, &h, &mu)
                };
                for i in 0..N {
                    depth[k][i] += passed[k];
                }
                for j in 0..N {
                    for i in 0..N {
                        depth[k][i] += length * rule.running[j][i] * density[k][j];
                    }
                }
            }
            let mut whole = 0.0;
            for i in 0..N {
                whole += rule.weights[i] * density[k][i];
            }
            passed[k] += length * whole;
        }
        if self.alike {
            density[1] = density[0];
            depth[1] = depth[0];
            passed[1] = passed[0];
        }
        if sunlit {
            let e = &self.extinction;
            for c in 0..C {
                let mut light = [0.0; N];
                for i in 0..N {
                    let t = e[0][c] * depth[0][i] + e[1][c] * depth[1][i] + e[2][c] * depth[2][i];
                    light[i] = length * rule.weights[i] * exp64(-t);
                }
                let (mut molecules, mut aerosol) = (0.0, 0.0);
                for i in 0..N {
                    molecules += light[i] * density[0][i];
                    aerosol += light[i] * density[1][i];
                }
                out.rayleigh[c] += molecules;
                out.mie[c] += aerosol;
            }
        }
    }

    /// Integrals of the densities from a point to the top of the air, by adaptive quadrature.
    fn columns_above(&self, h: f64, mu: f64) -> [f64; 3] {
        self.columns_between(h, mu, self.shell.distance_to_top(h, mu, self.shell.thickness))
    }

    /// The same over a distance.
    fn columns_between(&self, h: f64, mu: f64, length: f64) -> [f64; 3] {
        let gas = self.layer.map_or(0.0, |layer| {
            // Between the heights where its density bends it is smooth.
            let b = (self.shell.radius + h) * mu;
            let mut cuts = vec![0.0, -b, length];
            for bend in layer {
                let square = b * b + (bend - h) * (2.0 * self.shell.radius + bend + h);
                if square > 0.0 {
                    cuts.extend([-b - square.sqrt(), -b + square.sqrt()]);
                }
            }
            cuts.retain(|s| (0.0..=length).contains(s));
            cuts.sort_by(f64::total_cmp);
            let piece = |w: &[f64]| {
                let gas = |x: f64| self.gas(self.shell.height(h, mu, w[0] + (w[1] - w[0]) * x));
                (w[1] - w[0]) * GAS_RULE.iter().map(|&(x, weight)| weight * gas(x)).sum::<f64>()
            };
            cuts.windows(2).map(piece).sum()
        });
        let [molecules, aerosol] = [0, 1].map(|k: usize| self.columns[k].between(&self.shell, h, mu, length));
        [molecules, aerosol, gas]
    }

    /// Transmittance from a point to the top of the air.
    pub fn to_the_top(&self, h: f64, mu: f64) -> [f64; C] {
        self.depths(self.columns_above(h, mu)).map(|t| (-t).exp())
    }

    /// The depths to the sun and to the eye at a point of a march.
    fn marched(&self, ray: &Ray, s: f64) -> [f64; 3] {
        let (h, mu) = self.along(ray, s);
        if !self.polynomial {
            let (sun, eye) = (self.columns_above(h, mu), self.columns_between(ray.h, ray.mu, s));
            return [0, 1, 2].map(|k| sun[k] + eye[k]);
        }
        // O'Neil: the depth to the eye is that to the top from the eye less that from the point.
        let here = ((self.shell.radius + ray.h) * ray.mu + s) / (self.shell.radius + h);
        let [molecules, aerosol] = [0, 1].map(|k: usize| {
            let column = &self.columns[k];
            let eye = column.density(ray.h) * oneil(column.scale, ray.mu);
            eye + column.density(h) * (oneil(column.scale, mu) - oneil(column.scale, here))
        });
        [molecules, aerosol, 0.0]
    }

    /// Light scattered into a ray, by equal steps.
    pub fn march(&self, ray: &Ray, march: RayMarch) -> SingleScattering<C> {
        let mut out = SingleScattering::default();
        let (end, _) = self.end(ray);
        let shadow = if self.shadow { self.shell.shadow(ray.h, ray.mu, ray.mu_sun, ray.nu) } else { None };
        let step = end / march.samples as f64;
        for i in 0..march.samples {
            let s = step * (i as f64 + if march.left_rule { 0.0 } else { 0.5 });
            if shadow.is_some_and(|(a, b)| s > a && s < b) {
                continue;
            }
            let depths = self.depths(self.marched(ray, s));
            let h = self.shell.height(ray.h, ray.mu, s);
            for c in 0..C {
                let light = step * exp64(-depths[c]);
                out.rayleigh[c] += light * self.columns[0].density(h);
                out.mie[c] += light * self.columns[1].density(h);
            }
        }
        out.transmittance = self.depths(self.columns_between(ray.h, ray.mu, end)).map(|t| exp64(-t));
        out
    }

    /// Light scattered into a ray, by adaptive quadrature to a relative error of about 1e-9.
    pub fn reference(&self, ray: &Ray) -> SingleScattering<C> {
        let mut out = SingleScattering::default();
        let (cuts, count, shadow) = self.cuts(ray);
        let mut passed = [0.0; 3];
        let shell = &self.shell;
        let rough = self.scatter(ray);
        for k in 0..count {
            let (from, to) = (cuts[k], cuts[k + 1]);
            let middle = 0.5 * (from + to);
            // Where this part of the ray begins.
            let start = Ray {
                h: shell.height(ray.h, ray.mu, from),
                mu: {
                    let r = shell.radius + ray.h;
                    (r * ray.mu + from) / (shell.radius + shell.height(ray.h, ray.mu, from))
                },
                ..*ray
            };
            if shadow.is_none_or(|(a, b)| middle < a || middle > b) {
                // Where nothing comes through, an error relative to nothing would never be small enough.
                let all = self.columns_between(start.h, start.mu, to - from);
                for c in 0..C {
                    for species in 0..2 {
                        let mut integrand = |s: f64| {
                            let (h, mu) = self.along(ray, s);
                            let eye = self.columns_between(start.h, start.mu, s - from);
                            let sun = if self.polynomial {
                                [0, 1, 2].map(|k| {
                                    let column = &self.columns[k.min(1)];
                                    if k == 2 { 0.0 } else { column.density(h) * oneil(column.scale, mu) }
                                })
                            } else {
                                self.columns_above(h, mu)
                            };
                            let total = [0, 1, 2].map(|k| sun[k] + eye[k] + passed[k]);
                            self.columns[species].density(h) * (-self.depths(total)[c]).exp()
                        };
                        let about = if species == 0 { rough.rayleigh[c] } else { rough.mie[c] };
                        let value = adaptive(&mut integrand, from, to, 1e-9 * about + 1e-13 * all[species]);
                        if species == 0 {
                            out.rayleigh[c] += value;
                        } else {
                            out.mie[c] += value;
                        }
                    }
                }
            }
            let part = self.columns_between(start.h, start.mu, to - from);
            for k in 0..3 {
                passed[k] += part[k];
            }
        }
        out.transmittance = self.depths(passed).map(|t| (-t).exp());
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONEIL: [f64; 3] = [0.0025 * 5.602, 0.0025 * 9.473, 0.0025 * 19.644];

    /// `4 pi K`.
    fn full(rayleigh: [f64; 3], mie: f64) -> [[f64; 3]; 2] {
        [rayleigh, [mie; 3]].map(|k| k.map(|k| 4.0 * std::f64::consts::PI * k))
    }

    fn air(radius: f64, scales: [f64; 2], rayleigh: [f64; 3], mie: f64) -> ParticipatingMedium<3> {
        ParticipatingMedium::new(Shell { radius, thickness: 1.0 }, scales, full(rayleigh, mie), true, false)
    }

    fn rays(h: f64) -> Vec<Ray> {
        let mut out = Vec::new();
        for sun in [90.0_f64, 50.0, 20.0, 5.0, 0.0, -0.01, -2.0, -5.0, -10.0] {
            for view in [90.0_f64, 60.0, 20.0, 5.0, 1.0, 1e-4, -3.0] {
                for azimuth in [0.0_f64, 60.0, 180.0] {
                    let (s, v) = (sun.to_radians(), view.to_radians());
                    let nu = s.sin() * v.sin() + s.cos() * v.cos() * azimuth.to_radians().cos();
                    out.push(Ray { h, mu: v.sin(), mu_sun: s.sin(), nu });
                }
            }
        }
        out
    }

    #[test]
    fn panels_agree_with_adaptive_quadrature() {
        for air in [
            air(40.0, [0.25; 2], ONEIL, 0.001),
            air(106.0, [0.133, 0.02], ONEIL.map(|k| 0.5 * k), 0.004),
            air(10.0, [0.3; 2], ONEIL.map(|k| 4.0 * k), 0.01),
            air(40.0, [0.25; 2], [0.0, 1.0, 100.0], 0.0),
        ] {
            for h in [0.0, 0.4] {
                for ray in rays(h) {
                    let (got, want) = (air.scatter(&ray), air.reference(&ray));
                    let floor = 1e-12;
                    for c in 0..3 {
                        for (g, w) in [(got.rayleigh[c], want.rayleigh[c]), (got.mie[c], want.mie[c])] {
                            let error = (g - w).abs() / (w + floor);
                            let bound = if air.extinction[0][2] > 100.0 { 2e-4 } else { 3e-5 };
                            assert!(error < bound, "{ray:?} channel {c}: {g:e} against {w:e}");
                        }
                        let (g, w) = (got.transmittance[c], want.transmittance[c]);
                        assert!((g - w).abs() <= 1e-7 * w + 1e-15, "transmittance {g:e} against {w:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn many_steps_tend_to_the_integral_and_the_middle_is_better_than_the_start() {
        let air = air(40.0, [0.25; 2], ONEIL, 0.001);
        let ray = Ray { h: 0.0, mu: 0.3, mu_sun: 0.5, nu: 0.6 };
        let exact = air.reference(&ray).rayleigh[2];
        let error =
            |samples, left_rule| (air.march(&ray, RayMarch { samples, left_rule }).rayleigh[2] / exact - 1.0).abs();
        assert!(error(5, true) > 0.2, "eq 3 as printed: {}", error(5, true));
        assert!(error(5, false) < 0.06, "midpoints: {}", error(5, false));
        assert!(error(400, false) < 1e-5, "converged: {}", error(400, false));
    }

    #[test]
    fn thin_air_scatters_in_proportion_to_its_column() {
        let air = air(40.0, [0.25; 2], [1e-9; 3], 0.0);
        let ray = Ray { h: 0.0, mu: 1.0, mu_sun: 1.0, nu: 1.0 };
        let column = 0.25 * (1.0 - (-4.0_f64).exp());
        assert!((air.scatter(&ray).rayleigh[0] / column - 1.0).abs() < 1e-7, "closed form");
        // One species, seen and lit along one line: the integral of exp(-2 K m) dm has a closed form.
        let k = 0.05;
        let thick =
            ParticipatingMedium::new(Shell { radius: 40.0, thickness: 1.0 }, [0.25; 2], full([k; 3], 0.0), true, false);
        let up = thick.scatter(&ray).rayleigh[1];
        let t = 4.0 * std::f64::consts::PI * k * column;
        assert!(
            (up / (column * (-t).exp()) - 1.0).abs() < 1e-12,
            "sun in the zenith, looked at: all light has passed it"
        );
    }
}

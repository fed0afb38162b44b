//! Light of one distant sun, scattered once (floor 2).
//!
//! AOAS eq 4 as O'Neil 2005 means it: `I = E sum_c K_c F_c(angle) integral of rho exp(-4 pi (K_R + K_M)(depth to the sun +
//! depth to the eye)) ds`, here without `E`, `K` and the phase functions, which belong to the direction and not to the
//! path. A ray is cut where the shadow of the ground begins and ends, at its lowest point, and into panels that are
//! neither thick nor many scale heights high; each panel is a Gauss-Legendre sum whose running integral gives the depth
//! to the eye. [`Air::reference`] is adaptive to 1e-9
//! (`panels_agree_with_adaptive_quadrature`: within 3e-5, and 2e-4 where a grazing sun is behind hundreds of optical depths).
//!
//! [`March`] is the paper's way: equal steps, sampled at their middle, or at their start as eq 3 says.

use std::sync::LazyLock;

use super::shell::{Column, Shell, oneil};
use crate::math::elementary::exp64;
use crate::math::quadrature::{Gauss, adaptive};

/// Points of a panel.
const N: usize = 12;
/// Scale heights and optical depths that a panel spans at most.
const FOLDS: f64 = 4.0;
/// The same where a low sun is behind so much air that its light ends within a scale height.
const FOLDS_OPAQUE: f64 = 1.25;
const THICK: f64 = 6.0;
/// Beyond this optical depth nothing is seen.
const BLACK: f64 = 45.0;

static RULE: LazyLock<Gauss<N>> = LazyLock::new(Gauss::new);

/// Equal steps along the ray, as in AOAS and O'Neil.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct March {
    /// How many.
    pub samples: usize,
    /// Sampled at their start (eq 3 as printed) and not in their middle.
    pub at_start: bool,
}

/// A shell of air with Rayleigh and aerosol scattering.
#[derive(Debug, Clone)]
pub struct Air {
    /// Ground and top.
    pub shell: Shell,
    columns: [Column; 2],
    alike: bool,
    /// `4 pi K` of Rayleigh scattering for each channel, and of the aerosol.
    extinction: [f64; 3],
    aerosol: f64,
    folds: f64,
    shadow: bool,
    polynomial: bool,
}

/// What is seen along a ray, per unit of `E K F`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scattered {
    /// Integral for molecules.
    pub rayleigh: [f64; 3],
    /// Integral for aerosol.
    pub mie: [f64; 3],
    /// Share of the light that comes through from the far end.
    pub transmittance: [f64; 3],
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

impl Air {
    /// Air with scattering constants `rayleigh` and `mie` and two scale heights. `shadow`: the ground hides the sun;
    /// `polynomial`: depths by O'Neil's polynomial.
    pub fn new(shell: Shell, scales: [f64; 2], rayleigh: [f64; 3], mie: f64, shadow: bool, polynomial: bool) -> Self {
        let full = 4.0 * std::f64::consts::PI;
        // Optical depth along the ground, Chapman's sqrt(pi r H / 2).
        let level = |k: f64, scale: f64| full * k * (0.5 * std::f64::consts::PI * shell.radius * scale).sqrt();
        let thickest = rayleigh.iter().fold(0.0_f64, |a, &k| a.max(k));
        let opaque = level(thickest, scales[0]).max(level(mie, scales[1])) > 8.0;
        Self {
            folds: if opaque { FOLDS_OPAQUE } else { FOLDS },
            shell,
            columns: scales.map(|s| Column::new(&shell, s)),
            alike: scales[0] == scales[1],
            extinction: rayleigh.map(|k| full * k),
            aerosol: full * mie,
            shadow,
            polynomial,
        }
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
            None => (self.shell.reach(ray.h, ray.mu, self.shell.thickness), false),
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

    /// Optical depths of the channels for the integrals of both densities.
    #[inline(always)]
    fn depths(&self, molecules: f64, aerosol: f64) -> [f64; 3] {
        [0, 1, 2].map(|c| self.extinction[c] * molecules + self.aerosol * aerosol)
    }

    /// Light scattered into a ray, by panels.
    #[inline(always)]
    pub fn scatter(&self, ray: &Ray) -> Scattered {
        let mut out = Scattered::default();
        let mut passed = [0.0; 2];
        let (cuts, count, shadow) = self.cuts(ray);
        // What is left of the steeper species so far above its densest place needs no care.
        let steep = usize::from(self.columns[1].scale < self.columns[0].scale);
        let lowest = self.shell.height(ray.h, ray.mu, (-(self.shell.radius + ray.h) * ray.mu).clamp(0.0, cuts[count]));
        let gone = lowest + 16.0 * self.columns[steep].scale;
        for k in 0..count {
            let (from, to) = (cuts[k], cuts[k + 1]);
            let middle = 0.5 * (from + to);
            let lit = shadow.is_none_or(|(a, b)| middle < a || middle > b);
            let mut a = from;
            while a < to {
                let mut b = to;
                let live = self.depths(passed[0], passed[1]).map(|t| t < BLACK);
                // Halved until it is smooth; what follows is cut in the same way.
                for _ in 0..30 {
                    let (ha, hb) = (self.shell.height(ray.h, ray.mu, a), self.shell.height(ray.h, ray.mu, b));
                    let low = ha.min(hb);
                    let thick =
                        self.depths(self.columns[0].density(low) * (b - a), self.columns[1].density(low) * (b - a));
                    let folds = (ha - hb).abs() / self.columns[if low < gone { steep } else { 1 - steep }].scale;
                    if folds <= self.folds && (0..3).all(|c| !live[c] || thick[c] <= THICK) {
                        break;
                    }
                    b = a + 0.5 * (b - a);
                }
                self.panel(ray, a, b, lit && live.contains(&true), &mut passed, &mut out);
                a = b;
            }
        }
        out.transmittance = self.depths(passed[0], passed[1]).map(|t| exp64(-t));
        out
    }

    #[inline(always)]
    fn panel(&self, ray: &Ray, a: f64, b: f64, lit: bool, passed: &mut [f64; 2], out: &mut Scattered) {
        let rule = &*RULE;
        let length = b - a;
        let (mut h, mut mu) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (h[i], mu[i]) = self.along(ray, a + length * rule.nodes[i]);
        }
        let species = if self.alike { 1 } else { 2 };
        let mut density = [[0.0; N]; 2];
        let mut depth = [[0.0; N]; 2];
        for k in 0..species {
            let column = &self.columns[k];
            for i in 0..N {
                density[k][i] = column.density(h[i]);
            }
            if lit {
                depth[k] = if self.polynomial {
                    std::array::from_fn(|i| column.density(h[i]) * oneil(column.scale, mu[i]))
                } else {
                    column.depth(&self.shell, &h, &mu)
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
        if lit {
            for c in 0..3 {
                let mut light = [0.0; N];
                for i in 0..N {
                    let t = self.extinction[c] * depth[0][i] + self.aerosol * depth[1][i];
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

    /// Transmittance from a point to the top of the air.
    pub fn to_the_top(&self, h: f64, mu: f64) -> [f64; 3] {
        let depth = |k: usize| self.columns[k].exact(&self.shell, h, mu);
        self.depths(depth(0), depth(1)).map(|t| (-t).exp())
    }

    /// The depths to the sun and to the eye at a point of a march, for one species.
    fn marched(&self, k: usize, ray: &Ray, s: f64) -> f64 {
        let column = &self.columns[k];
        let (h, mu) = self.along(ray, s);
        if self.polynomial {
            // O'Neil: the depth to the eye is that to the top from the eye less that from the point.
            let here = ((self.shell.radius + ray.h) * ray.mu + s) / (self.shell.radius + h);
            let eye = column.density(ray.h) * oneil(column.scale, ray.mu);
            eye + column.density(h) * (oneil(column.scale, mu) - oneil(column.scale, here))
        } else {
            column.depth(&self.shell, &[h], &[mu])[0] + column.between(&self.shell, ray.h, ray.mu, s)
        }
    }

    /// Light scattered into a ray, by equal steps.
    pub fn march(&self, ray: &Ray, march: March) -> Scattered {
        let mut out = Scattered::default();
        let (end, _) = self.end(ray);
        let shadow = if self.shadow { self.shell.shadow(ray.h, ray.mu, ray.mu_sun, ray.nu) } else { None };
        let step = end / march.samples as f64;
        for i in 0..march.samples {
            let s = step * (i as f64 + if march.at_start { 0.0 } else { 0.5 });
            if shadow.is_some_and(|(a, b)| s > a && s < b) {
                continue;
            }
            let depths = self.depths(self.marched(0, ray, s), self.marched(1, ray, s));
            let h = self.shell.height(ray.h, ray.mu, s);
            for c in 0..3 {
                let light = step * exp64(-depths[c]);
                out.rayleigh[c] += light * self.columns[0].density(h);
                out.mie[c] += light * self.columns[1].density(h);
            }
        }
        let through = [0, 1].map(|k| self.columns[k].between(&self.shell, ray.h, ray.mu, end));
        out.transmittance = self.depths(through[0], through[1]).map(|t| exp64(-t));
        out
    }

    /// Light scattered into a ray, by adaptive quadrature to a relative error of about 1e-9.
    pub fn reference(&self, ray: &Ray) -> Scattered {
        let mut out = Scattered::default();
        let (cuts, count, shadow) = self.cuts(ray);
        let mut passed = [0.0; 2];
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
                for c in 0..3 {
                    for species in 0..2 {
                        let mut integrand = |s: f64| {
                            let (h, mu) = self.along(ray, s);
                            let total = [0, 1].map(|k| {
                                let column = &self.columns[k];
                                let sun = if self.polynomial {
                                    column.density(h) * oneil(column.scale, mu)
                                } else {
                                    column.exact(shell, h, mu)
                                };
                                sun + passed[k] + column.between(shell, start.h, start.mu, s - from)
                            });
                            self.columns[species].density(h) * (-self.depths(total[0], total[1])[c]).exp()
                        };
                        let about = if species == 0 { rough.rayleigh[c] } else { rough.mie[c] };
                        let value = adaptive(&mut integrand, from, to, 1e-9 * about);
                        if species == 0 {
                            out.rayleigh[c] += value;
                        } else {
                            out.mie[c] += value;
                        }
                    }
                }
            }
            for k in 0..2 {
                passed[k] += self.columns[k].between(shell, start.h, start.mu, to - from);
            }
        }
        out.transmittance = self.depths(passed[0], passed[1]).map(|t| (-t).exp());
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONEIL: [f64; 3] = [0.0025 * 5.602, 0.0025 * 9.473, 0.0025 * 19.644];

    fn air(radius: f64, scales: [f64; 2], rayleigh: [f64; 3], mie: f64) -> Air {
        Air::new(Shell { radius, thickness: 1.0 }, scales, rayleigh, mie, true, false)
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
                            let bound = if air.extinction[2] > 100.0 { 2e-4 } else { 3e-5 };
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
        let error = |samples, at_start| (air.march(&ray, March { samples, at_start }).rayleigh[2] / exact - 1.0).abs();
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
        let thick = Air::new(Shell { radius: 40.0, thickness: 1.0 }, [0.25; 2], [k; 3], 0.0, true, false);
        let up = thick.scatter(&ray).rayleigh[1];
        let t = 4.0 * std::f64::consts::PI * k * column;
        assert!(
            (up / (column * (-t).exp()) - 1.0).abs() < 1e-12,
            "sun in the zenith, looked at: all light has passed it"
        );
    }
}

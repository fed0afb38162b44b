//! Skies by formula: luminance as a product of gradation and indicatrix (Perez et al. 1993), coloured or white (floor
//! 3).
//!
//! The five-coefficient sky luminance distribution of Perez et al. 1993, eqs 6-8 of the paper realistic_sky:
//! `F = (1 + A e^(B / cos)) (1 + C (e^(D g) - l) + E cos^2 g)` with `g` the angle from the sun. The CIE has
//! `l = e^(D pi/2)`, Preetham has `l = 0`: the paper mixes them, which costs up to 8 % of type 12 and 30 % of type 15.
//!
//! At the horizon the gradation has its limit, not an epsilon; below it the sky goes on as it is there. Angles come
//! from the distance of unit vectors: the arc cosine of a product is NaN for one in 27 directions that look at the sun.
//! Error of the fast method 1e-5. Cost: one exponential for each factor, no table.

use glam::DVec3;

use super::limb::fraction_above_horizon;
use super::model::{BLOCK, Block, SkyModel, Smooth};
use crate::color::spaces::XYZ_TO_RGB;
use crate::math::elementary::{Real, exp};
use crate::math::geometry::angle;
use crate::math::lanes;

/// Coefficients of one distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Perez {
    /// `A` to `E`.
    pub coefficients: [f64; 5],
    /// What is taken from the exponential of the indicatrix.
    pub level: f64,
}

impl Perez {
    /// As the CIE has it: the indicatrix is 1 square to the sun.
    pub fn cie(coefficients: [f64; 5]) -> Self {
        Self { coefficients, level: (coefficients[3] * std::f64::consts::FRAC_PI_2).exp() }
    }

    /// As Preetham has it.
    pub fn preetham(coefficients: [f64; 5]) -> Self {
        Self { coefficients, level: 0.0 }
    }

    /// Gradation times indicatrix at the cosine `mu` to the zenith and the angle `g` from the sun.
    pub fn at(&self, mu: f64, g: f64) -> f64 {
        product(self.coefficients, self.level, mu, g, g.cos(), f64::exp)
    }
}

/// Gradation times indicatrix.
#[inline(always)]
fn product<T: Real>([a, b, c, d, e]: [T; 5], level: T, mu: T, g: T, cos: T, exp: impl Fn(T) -> T) -> T {
    let one = T::of(1.0);
    // Below this the exponential of any B < 0 is nothing; B = 0 has A = 0.
    let least = T::of(1e-6);
    let up = if mu > least { mu } else { least };
    (one + a * exp(b / up)) * (one + c * (exp(d * g) - level) + e * cos * cos)
}

/// Chromaticities over the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tint {
    /// The same everywhere.
    Even([f64; 2]),
    /// A distribution for each of `x` and `y`, and their factors.
    Varied([(Perez, f64); 2]),
}

/// A sky by formula.
#[derive(Debug, Clone)]
pub struct Formula {
    /// Direction of the sun.
    pub sun: DVec3,
    /// Distribution of luminance and its factor \[cd/m2\].
    pub luminance: (Perez, f64),
    /// Colour.
    pub tint: Tint,
    /// Light of the sun's disc on a plane that faces it \[lx of each channel\].
    pub beam: [f64; 3],
}

/// RGB of a chromaticity and a luminance.
#[inline(always)]
pub(super) fn rgb<T: Real>(x: T, y: T, luminance: T) -> [T; 3] {
    let by = luminance / y;
    let (a, c) = (x * by, (T::of(1.0) - x - y) * by);
    XYZ_TO_RGB.map(|m| T::of(m[0]) * a + T::of(m[1]) * luminance + T::of(m[2]) * c)
}

impl Formula {
    /// Zenith angle of the sun \[rad\].
    pub fn sun_zenith(sun: DVec3) -> f64 {
        sun.angle_between(DVec3::Z)
    }

    /// A distribution and what it must be multiplied by to have `value` at the zenith.
    pub fn scaled(perez: Perez, value: f64, sun: DVec3) -> (Perez, f64) {
        (perez, value / perez.at(1.0, Self::sun_zenith(sun)))
    }

    fn light(&self, mu: f64, g: f64) -> [f64; 3] {
        let of = |(perez, factor): &(Perez, f64)| factor * perez.at(mu, g);
        let luminance = of(&self.luminance);
        match &self.tint {
            Tint::Even([x, y]) => rgb(*x, *y, 1.0).map(|v| v * luminance),
            Tint::Varied([x, y]) => rgb(of(x), of(y), luminance),
        }
    }
}

/// A distribution and its factor in single precision.
#[derive(Debug, Clone, Copy)]
struct Distribution {
    coefficients: [f32; 5],
    level: f32,
    factor: f32,
}

impl Distribution {
    fn new((perez, factor): &(Perez, f64)) -> Self {
        Self { coefficients: perez.coefficients.map(|c| c as f32), level: perez.level as f32, factor: *factor as f32 }
    }

    #[inline(always)]
    fn at(&self, mu: f32, g: f32, cos: f32) -> f32 {
        self.factor * product(self.coefficients, self.level, mu, g, cos, exp)
    }
}

impl Formula {
    #[inline(always)]
    fn shade_by(&self, block: &mut Block, light: impl Fn(f32, f32, f32) -> [f32; 3]) {
        let sun = self.sun.as_vec3().to_array();
        // Local, so that nothing may alias.
        let [xs, ys, zs] = block.to;
        let mut out = [[0.0_f32; BLOCK]; 3];
        for i in 0..BLOCK {
            let (x, y, z) = (xs[i], ys[i], zs[i]);
            let below = z < 0.0;
            let across = x * x + y * y;
            let some = across > 1e-30;
            let lift = 1.0 / if some { across } else { 1.0 }.sqrt();
            let lift = if below { lift } else { 1.0 };
            let (x, y, z) = (x * lift, y * lift, if below { 0.0 } else { z });
            let (dx, dy, dz) = (x - sun[0], y - sun[1], z - sun[2]);
            // Straight down has no azimuth: it is as if square to the sun.
            let square = dx * dx + dy * dy + dz * dz;
            let square = if below && !some { 2.0 } else { square };
            let [r, g, b] = light(z, angle(square), 1.0 - 0.5 * square);
            (out[0][i], out[1][i], out[2][i]) = (r, g, b);
        }
        block.light = out;
    }
}

/// A direction above the horizon, or what lies on it in the same azimuth; none of straight down.
fn lifted(to: DVec3) -> DVec3 {
    if to.z >= 0.0 { to } else { DVec3::new(to.x, to.y, 0.0).normalize_or_zero() }
}

impl SkyModel for Formula {
    fn shade(&self, block: &mut Block, _: bool) {
        lanes::run(
            #[inline(always)]
            || match self.tint {
                Tint::Even([x, y]) => {
                    let color = rgb(x as f32, y as f32, 1.0);
                    let luminance = Distribution::new(&self.luminance);
                    self.shade_by(
                        block,
                        #[inline(always)]
                        move |mu, g, cos| {
                            let y = luminance.at(mu, g, cos);
                            [color[0] * y, color[1] * y, color[2] * y]
                        },
                    );
                }
                Tint::Varied([x, y]) => {
                    let [x, y, luminance] = [&x, &y, &self.luminance].map(Distribution::new);
                    self.shade_by(
                        block,
                        #[inline(always)]
                        move |mu, g, cos| rgb(x.at(mu, g, cos), y.at(mu, g, cos), luminance.at(mu, g, cos)),
                    );
                }
            },
        );
    }

    fn reference(&self, to: DVec3) -> [f64; 3] {
        let to = lifted(to);
        let none = to == DVec3::ZERO;
        let half = 0.5 * (to - self.sun).length();
        let g = if none { std::f64::consts::FRAC_PI_2 } else { 2.0 * half.min(1.0).asin() };
        self.light(to.z, g)
    }

    fn smooth(&self) -> Option<Smooth> {
        Some(Smooth { tolerance: 1e-3, horizon: 0.0, cones: vec![(self.sun, 0.999)] })
    }

    fn direct_irradiance(&self, radius: f64) -> [f64; 3] {
        let visible = fraction_above_horizon(self.sun.z, 0.0, radius);
        self.beam.map(|x| x * visible)
    }
}

//! A spherical shell of air whose density falls off exponentially with height: ray lengths, the Earth's shadow, optical
//! depth (Chapman's function by quadrature) (floor 2).
//!
//! Lengths are in units of the caller's choice. A point is its height `h` above the ground, a ray the cosine `mu` of
//! its angle to the local vertical: heights are carried as such and never as a difference of radii, which in single
//! precision is wrong by a third half a metre above the Earth, and are factored everywhere: `h (2 r + h)` and not
//! `R^2 - r^2`.
//!
//! Optical depth is a Gauss-Legendre sum from the ray's lowest point, cut where 20 scale heights of air are below; no
//! table, so it is right for any radius and scale height. Relative error below 1e-7 against adaptive quadrature
//! (`depth_to_the_top_agrees_with_adaptive_quadrature`). O'Neil's polynomial, fitted for a radius of 40 thicknesses and
//! a scale height of a quarter, stays as [`oneil`].

use crate::math::elementary::exp64;
use crate::math::quadrature::{adaptive, gauss_legendre};

/// Nothing to speak of is above this many scale heights: `e^-20` is 2e-9.
const CUT: f64 = 20.0;

/// The ground and the top of the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shell {
    /// Radius of the ground.
    pub radius: f64,
    /// Height of the top.
    pub thickness: f64,
}

impl Shell {
    /// Height after the distance `s`.
    #[inline(always)]
    pub fn height(&self, h: f64, mu: f64, s: f64) -> f64 {
        let r = self.radius + h;
        let (b, c) = (2.0 * r * mu, s * s);
        let square = r * r + b * s + c;
        let square = if square > 0.0 { square } else { 0.0 };
        h + (b * s + c) / (square.sqrt() + r)
    }

    /// Distance from a point below height `top` to it, going outwards.
    #[inline(always)]
    pub fn distance_to_top(&self, h: f64, mu: f64, top: f64) -> f64 {
        let b = (self.radius + h) * mu;
        let gap = (top - h) * (2.0 * self.radius + top + h);
        let gap = if gap > 0.0 { gap } else { 0.0 };
        let root = (b * b + gap).sqrt();
        let sum = if b > 0.0 { b + root } else { 1.0 };
        if b > 0.0 { gap / sum } else { root - b }
    }

    /// Distance to the ground, if the ray hits it.
    pub fn ground(&self, h: f64, mu: f64) -> Option<f64> {
        let b = (self.radius + h) * mu;
        let gap = h * (2.0 * self.radius + h);
        // A ray along the ground does not enter it.
        (mu < 0.0 && b * b > gap).then(|| gap / ((b * b - gap).sqrt() - b))
    }

    /// Distances between which a ray is in the shadow of the ground; `mu_sun` and `nu` are the cosines of the sun's
    /// angle to the vertical and to the ray.
    pub fn shadow(&self, h: f64, mu: f64, mu_sun: f64, nu: f64) -> Option<(f64, f64)> {
        let r = self.radius + h;
        // Inside the cylinder behind the ground: a t^2 + 2 b t + c < 0.
        let a = (1.0 - nu * nu).max(1e-30);
        let b = r * (mu - mu_sun * nu);
        let c = h * (2.0 * self.radius + h) - (r * mu_sun).powi(2);
        let square = b * b - a * c;
        if square <= 0.0 {
            return None;
        }
        let q = -(b + square.sqrt().copysign(b));
        let (one, two) = (q / a, if q == 0.0 { 0.0 } else { c / q });
        let (mut low, mut high) = (one.min(two), one.max(two));
        // And on the side away from the sun: r mu_sun + t nu < 0.
        if nu > 0.0 {
            high = high.min(-r * mu_sun / nu);
        } else if nu < 0.0 {
            low = low.max(-r * mu_sun / nu);
        } else if mu_sun >= 0.0 {
            return None;
        }
        (high > low && high > 0.0).then_some((low.max(0.0), high))
    }
}

/// Gauss-Legendre rules for the integrals of one scale height.
#[derive(Debug, Clone)]
pub struct ExponentialColumn {
    /// Scale height.
    pub scale: f64,
    inverse: f64,
    rule: Vec<(f64, f64)>,
}

impl ExponentialColumn {
    /// For a scale height in a shell.
    pub fn new(shell: &Shell, scale: f64) -> Self {
        let e_foldings = (shell.thickness / scale).min(CUT);
        let points = if e_foldings <= 4.5 { 10 } else { 8 + e_foldings.ceil() as usize };
        Self { scale, inverse: 1.0 / scale, rule: gauss_legendre(points) }
    }

    /// Density at a height, 1 on the ground.
    #[inline(always)]
    pub fn density(&self, h: f64) -> f64 {
        // Below ground, where a ray without a shadow passes, the air is as good as opaque.
        let x = -h * self.inverse;
        exp64(if x > 60.0 { 60.0 } else { x })
    }

    /// Integral of the density over `length` of a ray, going outwards.
    #[inline(always)]
    fn outwards<const N: usize>(&self, shell: &Shell, h: &[f64; N], mu: &[f64; N], length: &[f64; N]) -> [f64; N] {
        let mut sum = [0.0; N];
        for &(x, w) in &self.rule {
            for i in 0..N {
                sum[i] += w * self.density(shell.height(h[i], mu[i], x * length[i]));
            }
        }
        for i in 0..N {
            sum[i] *= length[i];
        }
        sum
    }

    /// Integral of the density from each point to the top of the air, as if the ground were air too.
    #[inline(always)]
    pub fn depth<const N: usize>(&self, shell: &Shell, h: &[f64; N], mu: &[f64; N]) -> [f64; N] {
        // Measured from the lowest point of each ray, in which both ways are outwards.
        let (mut low, mut slope, mut back, mut ahead) = ([0.0; N], [0.0; N], [0.0; N], [0.0; N]);
        let mut down = false;
        for i in 0..N {
            let inwards = if mu[i] < 0.0 { -(shell.radius + h[i]) * mu[i] } else { 0.0 };
            down |= inwards > 0.0;
            low[i] = shell.height(h[i], mu[i], inwards);
            slope[i] = if mu[i] < 0.0 { 0.0 } else { mu[i] };
            let cut = low[i] + CUT * self.scale;
            ahead[i] =
                shell.distance_to_top(low[i], slope[i], if cut < shell.thickness { cut } else { shell.thickness });
            back[i] = if inwards < ahead[i] { inwards } else { ahead[i] };
        }
        let mut sum = self.outwards(shell, &low, &slope, &ahead);
        if down {
            let more = self.outwards(shell, &low, &slope, &back);
            for i in 0..N {
                sum[i] += more[i];
            }
        }
        sum
    }

    /// The same by adaptive quadrature, to a relative error of about 1e-9.
    pub fn exact(&self, shell: &Shell, h: f64, mu: f64) -> f64 {
        self.between(shell, h, mu, shell.distance_to_top(h, mu, shell.thickness))
    }

    /// Integral of the density from a point over the distance `length`, by adaptive quadrature.
    pub fn between(&self, shell: &Shell, h: f64, mu: f64, length: f64) -> f64 {
        let lowest = (-(shell.radius + h) * mu).clamp(0.0, length);
        let mut density = |s: f64| self.density(shell.height(h, mu, s));
        // Relative to what is at least there: the densest point over a scale height, or over the ray if it is shorter.
        let scale = density(lowest) * length.min(self.scale);
        let tolerance = 1e-10 * scale;
        adaptive(&mut density, 0.0, lowest, tolerance) + adaptive(&mut density, lowest, length, tolerance)
    }
}

/// O'Neil's polynomial for the optical depth to the top over density and thickness (GPU Gems 2, chapter 16), for a
/// radius of 40 thicknesses and a scale height of a quarter only.
pub fn oneil(scale: f64, cosine: f64) -> f64 {
    let x = 1.0 - cosine;
    scale * (-0.00287 + x * (0.459 + x * (3.83 + x * (-6.80 + x * 5.25)))).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHELLS: [(f64, f64, f64); 5] =
        [(40.0, 1.0, 0.25), (106.0, 1.0, 0.133), (106.0, 1.0, 0.02), (5.0, 2.0, 0.5), (1000.0, 1.0, 0.25)];

    #[test]
    fn depth_to_the_top_agrees_with_adaptive_quadrature() {
        for (radius, thickness, scale) in SHELLS {
            let shell = Shell { radius, thickness };
            let column = ExponentialColumn::new(&shell, scale);
            for h in [0.0, 1e-6, 0.1, 0.5, 0.9] {
                let h = h * thickness;
                // Down to the ray that grazes the ground.
                let graze = -(h * (2.0 * radius + h)).sqrt() / (radius + h);
                for mu in [1.0, 0.7, 0.2, 0.05, 0.01, 0.0, 0.3 * graze, graze] {
                    let got = column.depth(&shell, &[h], &[mu])[0];
                    let want = column.exact(&shell, h, mu);
                    assert!((got / want - 1.0).abs() < 1e-7, "{radius} {scale} {h} {mu}: {got} against {want}");
                }
            }
        }
    }

    #[test]
    fn a_vertical_column_has_a_closed_form_and_a_low_sun_is_chapmans() {
        let shell = Shell { radius: 40.0, thickness: 1.0 };
        let column = ExponentialColumn::new(&shell, 0.25);
        let up = column.depth(&shell, &[0.2], &[1.0])[0];
        let exact = 0.25 * ((-0.8_f64).exp() - (-4.0_f64).exp());
        assert!((up / exact - 1.0).abs() < 1e-12, "{up} against {exact}");
        // Chapman's function at the horizon, X e^X K1(X) for X = r / H, by its asymptotic series.
        let x: f64 = 106.0 / 0.02;
        let chapman = (0.5 * std::f64::consts::PI * x).sqrt() * (1.0 + 3.0 / (8.0 * x) - 15.0 / (128.0 * x * x));
        let shell = Shell { radius: 106.0, thickness: 1.0 };
        let level = ExponentialColumn::new(&shell, 0.02).depth(&shell, &[0.0], &[0.0])[0] / 0.02;
        assert!((level / chapman - 1.0).abs() < 1e-7, "{level} against {chapman}");
    }

    #[test]
    fn the_polynomial_is_oneils() {
        let shell = Shell { radius: 40.0, thickness: 1.0 };
        let column = ExponentialColumn::new(&shell, 0.25);
        for (cosine, low, high) in [(1.0, 0.98, 1.023), (0.5, 0.98, 1.023), (0.0, 0.97, 0.98), (-0.1, 0.6, 0.78)] {
            let ratio = oneil(0.25, cosine) / column.depth(&shell, &[0.0], &[cosine])[0];
            assert!((low..high).contains(&ratio), "cos {cosine}: {ratio} of the true depth");
        }
    }

    #[test]
    fn rays_end_where_circles_say() {
        let shell = Shell { radius: 40.0, thickness: 1.0 };
        assert!((shell.distance_to_top(0.0, 0.0, 1.0) - 9.0).abs() < 1e-12, "41^2 - 40^2 = 9^2");
        assert_eq!(shell.distance_to_top(0.25, 1.0, 1.0), 0.75, "straight up");
        assert_eq!(shell.ground(0.25, -1.0), Some(0.25), "straight down");
        assert_eq!(shell.ground(0.0, 1e-9), None, "up from the ground");
        assert_eq!(shell.ground(0.0, -1e-9), Some(0.0), "down from the ground");
        assert!((shell.height(0.0, 0.0, 9.0) - 1.0).abs() < 1e-14, "the top");
        // Half a metre above an Earth of 6360 km.
        let earth = Shell { radius: 6.36e6, thickness: 6e4 };
        let dip = -(0.5_f64 * (2.0 * 6.36e6 + 0.5)).sqrt() / (6.36e6 + 0.5);
        assert!(earth.ground(0.5, dip * 0.999_999).is_none() && earth.ground(0.5, dip * 1.000_001).is_some(), "dip");
    }

    #[test]
    fn the_shadow_is_a_cylinder() {
        let shell = Shell { radius: 40.0, thickness: 1.0 };
        // Sun 5 degrees below the horizon, straight up: lit from r (1 / cos 5 - 1) on.
        let mu_sun = -(5.0_f64.to_radians().sin());
        let (low, high) = shell.shadow(0.0, 1.0, mu_sun, mu_sun).expect("in shadow");
        assert_eq!(low, 0.0, "from the viewer on");
        assert!((high - 40.0 * (1.0 / 5.0_f64.to_radians().cos() - 1.0)).abs() < 1e-12, "up to the cylinder: {high}");
        assert!(shell.shadow(0.0, 0.5, 0.2, 0.3).is_none(), "above the tangent plane with the sun above it");
        assert!(shell.shadow(0.0, 0.0, 1.0, 0.0).is_none(), "along the ground under a sun in the zenith");
        assert!(shell.shadow(0.0, 1.0, -1.0, -1.0).is_some_and(|(a, b)| a == 0.0 && b > 1.0), "sun at the nadir");
    }
}

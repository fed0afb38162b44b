//! Phase functions of air, of mean 1 over the sphere: Rayleigh and Cornette-Shanks (Mie, aerosol) (floor 2).
//!
//! AOAS takes them from O'Neil 2005: Rayleigh's, and Cornette and Shanks' (1992) for aerosol. O'Neil measures the angle
//! against the view ray and so writes `g = -0.99`; here `g > 0` is forward. Angles come as `1 - cos`, from the distance
//! of the unit vectors: a cosine in `f32` loses the forward peak (at `g = 0.99` it is all within half a degree).

use crate::math::elementary::Real;

/// Rayleigh's phase function of `near = 1 - cos`.
#[inline(always)]
pub fn rayleigh<T: Real>(near: T) -> T {
    let c = T::of(1.0) - near;
    T::of(0.75) * (T::of(1.0) + c * c)
}

/// Cornette and Shanks' phase function of one asymmetry.
#[derive(Debug, Clone, Copy)]
pub struct CornetteShanks<T> {
    top: T,
    base: T,
    slope: T,
    forward: bool,
    g: f64,
}

impl<T: Real> CornetteShanks<T> {
    /// For the asymmetry `g` in `(-1, 1)`.
    pub fn new(g: f64) -> Self {
        Self {
            top: T::of(1.5 * (1.0 - g * g) / (2.0 + g * g)),
            base: T::of((1.0 - g.abs()).powi(2)),
            slope: T::of(2.0 * g.abs()),
            forward: g >= 0.0,
            g,
        }
    }

    /// The asymmetry `g` it was made with.
    pub fn asymmetry(&self) -> f64 {
        self.g
    }

    /// At an angle given by `near = 1 - cos` and `far = 1 + cos`; `root` is the square root.
    #[inline(always)]
    pub fn at(&self, near: T, far: T, root: impl Fn(T) -> T) -> T {
        let c = T::of(1.0) - near;
        let s = self.base + self.slope * if self.forward { near } else { far };
        self.top * (T::of(1.0) + c * c) / (s * root(s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quadrature::adaptive;

    #[test]
    fn the_mean_over_the_sphere_is_one_and_the_peak_is_forward() {
        let mean = 0.5 * adaptive(&mut |c| rayleigh(1.0 - c), -1.0, 1.0, 1e-12);
        assert!((mean - 1.0).abs() < 1e-12, "Rayleigh: {mean}");
        for g in [-0.999, -0.5, 0.0, 0.3, 0.76, 0.99, 0.999] {
            let phase = CornetteShanks::<f64>::new(g);
            let at = |c: f64| phase.at(1.0 - c, 1.0 + c, f64::sqrt);
            let mean = 0.5 * adaptive(&mut |c| at(c), -1.0, 1.0, 1e-10);
            assert!((mean - 1.0).abs() < 1e-8, "g = {g}: {mean}");
            assert!((at(1.0) - at(-1.0)) * g >= 0.0, "g = {g} points forward");
        }
        assert_eq!(CornetteShanks::<f64>::new(0.0).at(0.3, 1.7, f64::sqrt), rayleigh(0.3), "g = 0 is Rayleigh's");
    }
}

//! Nodes of a basis of higher orders: interpolation weights of its images for any asymmetry, extinction and
//! albedo (section 4.3 of inverse_clouds and its wish for clusters of orders).
//!
//! The light of order `k` is a multiple of `albedo^k`. Orders are gathered in groups that stand for the powers
//! `exponents`; an order between two of them is divided among the nearest four such that `albedo^k` comes out right
//! for every albedo (`pleinair._orders`), so a picture needs one image a group and no knowledge of the albedo before.
//! Between nodes: six-point Lagrange in `ln sigma` and in `atanh g`, in which the images are smooth.

use super::bases::Interpolation;
use crate::error::{Error, Result};
use crate::math::interpolation::{lagrange, within};

/// Points of the interpolation.
const POINTS: usize = 6;

/// Nodes of a basis, and how few images stand for its many.
#[derive(Debug, Clone, Default)]
pub struct BasisNodes {
    /// Asymmetries, ascending.
    pub g: Vec<f64>,
    /// Extinctions \[1/m\], ascending.
    pub sigma: Vec<f64>,
    /// Powers of the albedo, one a group.
    pub exponents: Vec<f64>,
    /// Images as mixtures of `rank` others: `(rank, group, g, sigma)`; empty if they stand for themselves.
    pub coefficients: Vec<f32>,
}

impl BasisNodes {
    /// Images of the basis.
    pub fn images(&self) -> usize {
        self.g.len() * self.sigma.len() * self.exponents.len()
    }

    /// Images that pictures are mixed from.
    pub fn rank(&self) -> usize {
        if self.coefficients.is_empty() { self.images() } else { self.coefficients.len() / self.images() }
    }

    /// Refuse nodes that do not ascend or a mixture of the wrong size.
    pub fn validate(&self) -> Result<()> {
        for (name, nodes) in [("g", &self.g), ("sigma_t", &self.sigma), ("orders", &self.exponents)] {
            if nodes.windows(2).any(|w| w[0] >= w[1]) {
                return Err(Error::Data { name, reason: "the nodes of a basis must ascend".into() });
            }
        }
        if self.images() > 0 && !self.coefficients.len().is_multiple_of(self.images()) {
            let got = format!("{} elements", self.coefficients.len());
            return Err(Error::Shape { name: "mixture", expected: "(rank, groups, g, sigma)".into(), got });
        }
        Ok(())
    }

    /// Weights of the images at `(g, sigma, albedo)`; refuses what lies outside the nodes.
    pub fn weights(&self, g: f64, sigma: f64, albedo: f64, how: Interpolation) -> Result<Vec<f32>> {
        if self.images() == 0 {
            return Ok(Vec::new());
        }
        let g = within("g", &self.g, g, "1")?;
        let ((gi, gw), (si, sw)) = if how == Interpolation::Linear {
            // Below the first extinction linearly to nothing at none.
            let low = self.sigma[0];
            let (si, mut sw) = lagrange(&self.sigma, sigma.max(low), 2);
            if sigma < low {
                for w in &mut sw {
                    *w *= sigma / low;
                }
            } else {
                within("sigma_t", &self.sigma, sigma, "1/m")?;
            }
            (lagrange(&self.g, g, 2), (si, sw))
        } else {
            let sigma = within("sigma_t", &self.sigma, sigma, "1/m")?;
            let wide: Vec<f64> = self.g.iter().map(|g| g.atanh()).collect();
            let logs: Vec<f64> = self.sigma.iter().map(|s| s.ln()).collect();
            (lagrange(&wide, g.atanh(), POINTS), lagrange(&logs, sigma.ln(), POINTS))
        };
        let mut weights = vec![0.0_f32; self.images()];
        for (e, exponent) in self.exponents.iter().enumerate() {
            let power = albedo.powf(*exponent);
            for (i, gw) in gw.iter().enumerate() {
                for (k, sw) in sw.iter().enumerate() {
                    weights[(e * self.g.len() + gi + i) * self.sigma.len() + si + k] = (power * gw * sw) as f32;
                }
            }
        }
        if self.coefficients.is_empty() {
            return Ok(weights);
        }
        let used: Vec<(usize, f32)> = weights.iter().copied().enumerate().filter(|&(_, w)| w != 0.0).collect();
        Ok(self
            .coefficients
            .chunks_exact(weights.len())
            .map(|row| used.iter().map(|&(i, w)| row[i] * w).sum())
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_exact_and_polynomials_are_reproduced() {
        let orders = BasisNodes {
            g: vec![-0.3, 0.0, 0.3, 0.6, 0.8, 0.9, 0.95],
            sigma: (0..8).map(|i| 0.01 * 1.6_f64.powi(i)).collect(),
            exponents: vec![2.0, 3.0, 6.0],
            coefficients: Vec::new(),
        };
        orders.validate().expect("valid");
        let w = orders.weights(0.6, orders.sigma[5], 0.5, Interpolation::Cubic).expect("inside");
        assert!((w[3 * 8 + 5] - 0.25).abs() < 1e-6, "albedo squared at its node");
        assert!(w.iter().filter(|w| w.abs() > 1e-6).count() == 3, "one node a group");
        // A product of fifth powers of the variables is spanned.
        let f = |g: f64, s: f64| (1.0 + g.atanh().powi(5)) * (2.0 + s.ln()).powi(5);
        for (g, s) in [(0.1, 0.013), (0.93, 0.2), (-0.25, 0.09)] {
            let w = orders.weights(g, s, 1.0, Interpolation::Cubic).expect("inside");
            let got: f64 = (0..7 * 8).map(|i| f64::from(w[i]) * f(orders.g[i / 8], orders.sigma[i % 8])).sum();
            assert!((got - f(g, s)).abs() < 1e-4 * (1.0 + f(g, s).abs()), "{got} against {}", f(g, s));
        }
        assert!(orders.weights(0.97, 0.02, 1.0, Interpolation::Cubic).is_err(), "g outside");
        assert!(orders.weights(0.5, 1.0, 1.0, Interpolation::Cubic).is_err(), "sigma outside");
    }

    #[test]
    fn a_mixture_is_what_its_rows_say() {
        let mut orders =
            BasisNodes { g: vec![0.0, 0.5], sigma: vec![0.1, 0.2], exponents: vec![2.0], coefficients: Vec::new() };
        let plain = orders.weights(0.2, 0.13, 0.9, Interpolation::Linear).expect("inside");
        orders.coefficients = vec![1.0, 0.0, 2.0, 0.0, 0.0, 1.0, 0.0, -1.0];
        assert_eq!(orders.rank(), 2, "two rows of four");
        let mixed = orders.weights(0.2, 0.13, 0.9, Interpolation::Linear).expect("inside");
        assert!((mixed[0] - (plain[0] + 2.0 * plain[2])).abs() < 1e-6, "first row");
        assert!((mixed[1] - (plain[1] - plain[3])).abs() < 1e-6, "second row");
        let thin = orders.weights(0.2, 0.01, 0.9, Interpolation::Linear).expect("below the first");
        let low = orders.weights(0.2, 0.1, 0.9, Interpolation::Linear).expect("the first");
        assert!((thin[0] - 0.1 * low[0]).abs() < 1e-6, "linear to nothing");
    }
}

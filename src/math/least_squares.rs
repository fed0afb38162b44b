//! Linear least squares of a few terms by normal equations (Gauss), in f64 (floor 0): surfaces through pictures.
//!
//! Terms of size 1; a fraction of the unit matrix added to the equations leaves at 0 what the samples say nothing of.
//! Elimination without pivoting is stable, because the matrix is symmetric and positive definite. Relative error about the
//! rounding times the condition of the equations: below 1e-9 for cubic surfaces over a picture.

/// Middle of place `at` of `n` between -1 and 1: terms of a surface over a picture are of size 1 there.
#[inline(always)]
pub fn centered(n: usize, at: usize) -> f64 {
    2.0 * (at as f64 + 0.5) / n as f64 - 1.0
}

/// Normal equations of `N` terms.
#[derive(Debug, Clone)]
pub struct NormalEquations<const N: usize> {
    matrix: [[f64; N]; N],
    right: [f64; N],
}

impl<const N: usize> Default for NormalEquations<N> {
    fn default() -> Self {
        Self { matrix: [[0.0; N]; N], right: [0.0; N] }
    }
}

impl<const N: usize> NormalEquations<N> {
    /// Add a sample of `value` where the terms are `terms`.
    pub fn add(&mut self, weight: f64, terms: &[f64; N], value: f64) {
        for i in 0..N {
            for j in 0..N {
                self.matrix[i][j] += weight * terms[i] * terms[j];
            }
            self.right[i] += weight * terms[i] * value;
        }
    }

    /// The coefficients, with `ridge` added to the diagonal from term `from` on.
    pub fn solve(mut self, ridge: f64, from: usize) -> [f64; N] {
        let (a, b) = (&mut self.matrix, &mut self.right);
        for i in from..N {
            a[i][i] += ridge;
        }
        for i in 0..N {
            let (pivot, value) = (a[i], b[i]);
            for k in i + 1..N {
                let by = if pivot[i] == 0.0 { 0.0 } else { a[k][i] / pivot[i] };
                for j in i..N {
                    a[k][j] -= by * pivot[j];
                }
                b[k] -= by * value;
            }
        }
        let mut out = [0.0; N];
        for i in (0..N).rev() {
            let known: f64 = (i + 1..N).map(|j| a[i][j] * out[j]).sum();
            out[i] = if a[i][i] == 0.0 { 0.0 } else { (b[i] - known) / a[i][i] };
        }
        out
    }

    /// Sum of the diagonal: the scale of a ridge.
    pub fn trace(&self) -> f64 {
        (0..N).map(|i| self.matrix[i][i]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_found() {
        let mut equations = NormalEquations::<4>::default();
        let terms = |x: f64| [1.0, x, x * x, x * x * x];
        let cubic = |x: f64| 3.0 - x + 0.5 * x * x - 2.0 * x * x * x;
        for k in 0..50 {
            let x = f64::from(k) / 25.0 - 1.0;
            equations.add(1.0 + f64::from(k % 3), &terms(x), cubic(x));
        }
        let found = equations.solve(0.0, 0);
        for (a, b) in found.iter().zip([3.0, -1.0, 0.5, -2.0]) {
            assert!((a - b).abs() < 1e-12, "{found:?}");
        }
        assert_eq!(NormalEquations::<3>::default().solve(0.0, 0), [0.0; 3], "nothing known");
    }
}

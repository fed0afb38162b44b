//! The best of cuts by Otsu's criterion, compared exactly: in f64 where that decides, in 320-bit integers otherwise
//! (floor 1; [`otsu`](super::otsu)).

use std::cmp::Ordering;

/// Where the classes part and how well they do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threshold {
    /// Class 1 is `x > value`.
    pub value: f64,
    /// Variance between the classes over the total variance, in `[0, 1]`; 0 where there is only one class.
    pub separability: f64,
}

/// `d^2 / q`, kept as it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ratio {
    d: u128,
    q: u128,
    pub(super) rough: f64,
}

/// Little-endian 320-bit unsigned integer.
type Wide = [u64; 5];

/// `a * b`; the caller knows that it fits.
fn times(a: Wide, b: u128) -> Wide {
    let mut out = [0_u64; 5];
    for (j, factor) in [b as u64, (b >> 64) as u64].into_iter().enumerate() {
        let mut carry = 0_u128;
        for i in 0..5 - j {
            let sum = u128::from(out[i + j]) + u128::from(a[i]) * u128::from(factor) + carry;
            out[i + j] = sum as u64;
            carry = sum >> 64;
        }
    }
    out
}

fn wide(x: u128) -> Wide {
    [x as u64, (x >> 64) as u64, 0, 0, 0]
}

impl Ratio {
    /// `(S w - N s)^2 / (w (N - w))` for `0 < w < N`.
    pub(super) fn new(all: u64, sum: i128, w: u64, s: i128) -> Self {
        let d = (sum * i128::from(w) - i128::from(all) * s).unsigned_abs();
        let q = u128::from(w) * u128::from(all - w);
        let root = d as f64;
        Self { d, q, rough: root * root / q as f64 }
    }

    pub(super) fn cmp(&self, other: &Self) -> Ordering {
        // Each rough value is off by at most 2 eps from d and 2 from the product, the quotient and q.
        let margin = 16.0 * f64::EPSILON * self.rough.max(other.rough);
        if (self.rough - other.rough).abs() > margin {
            return self.rough.total_cmp(&other.rough);
        }
        let left = times(times(wide(self.d), self.d), other.q);
        let right = times(times(wide(other.d), other.d), self.q);
        left.iter().rev().cmp(right.iter().rev())
    }
}

/// First best cut of values in rising order: `(position, ratio, N)`, or `None` where all samples are equal.
/// `values` yields `(value, count)` with counts above zero and integer values >= 0 whose sum is below 2^63.
pub(super) fn best_cut<I: Iterator<Item = (i64, u64)> + Clone>(values: I) -> Option<(usize, Ratio, u64)> {
    let (mut all, mut sum) = (0_u64, 0_i128);
    for (v, n) in values.clone() {
        all += n;
        sum += i128::from(v) * i128::from(n);
    }
    let mut best: Option<(usize, Ratio)> = None;
    let (mut w, mut s) = (0_u64, 0_i128);
    // Most cuts are far from the best: f64 alone refuses those, its rounding counted in their favour.
    let (all_f, sum_f) = (all as f64, sum as f64);
    let mut bar = -1.0;
    for (k, (v, n)) in values.enumerate() {
        w += n;
        s += i128::from(v) * i128::from(n);
        if w == all {
            break;
        }
        // The sums are non-negative and below 2^63: both products are off by at most 2 eps of themselves.
        let (w_f, s_f) = (w as f64, s as i64 as f64);
        let (left, right) = (sum_f * w_f, all_f * s_f);
        let most = (left - right).abs() + 4.0 * f64::EPSILON * (left + right);
        if most * most < bar * (w_f * (all_f - w_f)) {
            continue;
        }
        let here = Ratio::new(all, sum, w, s);
        if best.is_none_or(|(_, b)| here.cmp(&b) == Ordering::Greater) {
            best = Some((k, here));
            bar = here.rough * (1.0 - 1e-14);
        }
    }
    best.map(|(k, ratio)| (k, ratio, all))
}

/// Between-class over total variance, from the cut and the mean and sum of squared deviations of the samples.
pub(super) fn separability(ratio: &Ratio, all: u64, squares: f64) -> f64 {
    // sigma_B^2 N = d^2 / (N q), sigma_T^2 N = sum of squared deviations.
    if squares > 0.0 { (ratio.rough / all as f64 / squares).min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_products_are_exact() {
        let x = u128::MAX - 12345;
        let cube = times(times(wide(x), 3), 5);
        let direct = times(wide(x), 15);
        assert_eq!(cube, direct, "associative");
        let square = times(wide(1 << 100), 1 << 100);
        assert_eq!(square, [0, 0, 0, 1 << 8, 0], "2^200");
    }
}

//! Otsu's threshold, exactly (floor 1): N. Otsu, A threshold selection method from gray-level histograms, IEEE
//! Transactions on Systems, Man, and Cybernetics 9(1), 1979, 62-66.
//!
//! Of all cuts "class 0 is x <= t" the one with the largest variance between the classes, that is the largest
//! `(S w - N s)^2 / (w (N - w))` (N samples of sum S, of which w of sum s in class 0), and of equal ones the first.
//! The rationals are compared exactly: in f64 where they differ by more than 16 eps, in 320-bit integers otherwise.
//! Rounding makes the usual implementations pick a later maximiser on symmetric histograms.
//!
//! * Integer levels: exact.
//! * Floating-point samples: the samples are sorted and cut between neighbours. For the sums each sample is rounded to
//!   a grid of `2^k` steps over `[min, max]`, k = 62 - log2 N (at least 40 below 4 million samples): the cut is the
//!   exact optimum of the samples so rounded, hence of the samples themselves wherever they lie on that grid (8-, 16-
//!   and 24-bit data do when their range is a power of two of their step).
//! * `binned`: a histogram of n bins over `[min, max]`, whose bin centre is returned (what scikit-image does).
//!
//! Cost: a histogram for integers; a radix sort of the samples otherwise (`docs/speed_vs_error.md`).

use std::cmp::Ordering;

use super::{Sample, check_mask, histogram};
use crate::error::{Error, Result};
use crate::job::Job;

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
struct Ratio {
    d: u128,
    q: u128,
    rough: f64,
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
    fn new(all: u64, sum: i128, w: u64, s: i128) -> Self {
        let d = (sum * i128::from(w) - i128::from(all) * s).unsigned_abs();
        let q = u128::from(w) * u128::from(all - w);
        let root = d as f64;
        Self { d, q, rough: root * root / q as f64 }
    }

    fn cmp(&self, other: &Self) -> Ordering {
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
fn best_cut<I: Iterator<Item = (i64, u64)> + Clone>(values: I) -> Option<(usize, Ratio, u64)> {
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
fn separability(ratio: &Ratio, all: u64, squares: f64) -> f64 {
    // sigma_B^2 N = d^2 / (N q), sigma_T^2 N = sum of squared deviations.
    if squares > 0.0 { (ratio.rough / all as f64 / squares).min(1.0) } else { 0.0 }
}

/// Otsu's threshold of a histogram of the levels 0, 1, 2 …: the value is a level.
pub fn of_counts(counts: &[u64], name: &'static str) -> Result<Threshold> {
    let used = || counts.iter().enumerate().filter(|&(_, &n)| n > 0).map(|(v, &n)| (v as i64, n));
    let first = used().next().ok_or(Error::Empty { name })?.0;
    let Some((k, ratio, all)) = best_cut(used()) else {
        return Ok(Threshold { value: first as f64, separability: 0.0 });
    };
    let mean = used().map(|(v, n)| v as f64 * n as f64).sum::<f64>() / all as f64;
    let squares = used().map(|(v, n)| (v as f64 - mean) * (v as f64 - mean) * n as f64).sum::<f64>();
    let level = used().nth(k).map_or(first, |(v, _)| v);
    Ok(Threshold { value: level as f64, separability: separability(&ratio, all, squares) })
}

/// Threshold of an 8-bit picture, exact over its levels.
pub fn of_bytes(job: &Job, data: &[u8], mask: Option<&[bool]>) -> Result<Threshold> {
    of_counts(&histogram::levels(job, data, 1, mask)?, empty_name(mask))
}

/// Threshold of a 16-bit picture, exact over its levels.
pub fn of_words(job: &Job, data: &[u16], mask: Option<&[bool]>) -> Result<Threshold> {
    let bins = histogram::Bins::new(1 << 16, 0.0, 65536.0)?;
    of_counts(&histogram::samples(job, data, 1, mask, &bins)?.bins, empty_name(mask))
}

fn empty_name(mask: Option<&[bool]>) -> &'static str {
    if mask.is_some_and(|m| !m.is_empty()) { "mask" } else { "img" }
}

/// Floating-point samples that can be sorted by their bits and whose midpoints exist.
pub trait Float: Sample {
    /// Unsigned integer of the same size.
    type Key: Copy + Default + Into<u64> + Send + Sync;
    /// Bits that rise with the value.
    fn key(self) -> Self::Key;
    /// How many of them there are.
    const BITS: u32;
    /// The value of such bits.
    fn from_key(key: Self::Key) -> Self;
    /// A value `t` of this type with `a <= t < b`, the rounded midpoint if that is one.
    fn between(a: Self, b: Self) -> Self;
}

macro_rules! float {
    ($t:ty, $u:ty, $bits:expr) => {
        impl Float for $t {
            type Key = $u;
            const BITS: u32 = $bits;
            #[inline(always)]
            fn key(self) -> $u {
                let bits = self.to_bits();
                let flip = if bits >> ($bits - 1) == 0 { 1 << ($bits - 1) } else { <$u>::MAX };
                bits ^ flip
            }
            #[inline(always)]
            fn from_key(key: $u) -> Self {
                let flip = if key >> ($bits - 1) == 0 { <$u>::MAX } else { 1 << ($bits - 1) };
                <$t>::from_bits(key ^ flip)
            }
            fn between(a: Self, b: Self) -> Self {
                let t = a / 2.0 + b / 2.0;
                if a <= t && t < b { t } else { a }
            }
        }
    };
}
float!(f32, u32, 32);
float!(f64, u64, 64);

/// Samples inside the mask, all finite.
fn chosen<T: Float>(data: &[T], mask: Option<&[bool]>) -> Result<Vec<T>> {
    check_mask(mask, data.len())?;
    let all: Vec<T> = match mask {
        None => data.to_vec(),
        Some(m) => data.iter().zip(m).filter(|&(_, &inside)| inside).map(|(&x, _)| x).collect(),
    };
    if all.is_empty() {
        return Err(Error::Empty { name: empty_name(mask) });
    }
    let strange = all.iter().filter(|x| !x.double().is_finite()).count();
    if strange > 0 {
        let reason = format!("must be finite where it is looked at, got {strange} values that are NaN or infinite");
        return Err(Error::Data { name: "img", reason });
    }
    Ok(all)
}

/// Keys in rising order: least significant digit first, 11 bits at a time; digits that all keys share are skipped.
fn sorted_keys<T: Float>(job: &Job, samples: &[T]) -> Result<Vec<T::Key>> {
    const DIGIT: u32 = 11;
    let mut keys: Vec<T::Key> = samples.iter().map(|x| x.key()).collect();
    let mut other = vec![T::Key::default(); keys.len()];
    for shift in (0..T::BITS).step_by(DIGIT as usize) {
        job.check()?;
        let digit = |k: T::Key| ((k.into() >> shift) & ((1 << DIGIT) - 1)) as usize;
        let mut starts = vec![0_usize; 1 << DIGIT];
        for &k in &keys {
            starts[digit(k)] += 1;
        }
        if starts.contains(&keys.len()) {
            continue;
        }
        let mut at = 0;
        for s in &mut starts {
            at += std::mem::replace(s, at);
        }
        for &k in &keys {
            let place = &mut starts[digit(k)];
            other[*place] = k;
            *place += 1;
        }
        std::mem::swap(&mut keys, &mut other);
    }
    Ok(keys)
}

/// Threshold of floating-point samples: the midpoint between the two neighbours at the best cut.
pub fn of_floats<T: Float>(job: &Job, data: &[T], mask: Option<&[bool]>) -> Result<Threshold> {
    let samples = chosen(data, mask)?;
    let keys = sorted_keys(job, &samples)?;
    drop(samples);
    let value = |i: usize| T::from_key(keys[i]);
    let (low, high) = (value(0).double(), value(keys.len() - 1).double());
    if low == high {
        return Ok(Threshold { value: low, separability: 0.0 });
    }
    // Both ends halved where their difference overflows. A power of two as scale keeps the grid exact; it is applied in
    // two factors, either of which exists even where their product does not.
    let halve = if (high - low).is_finite() { 1.0 } else { 0.5 };
    let exponent = (high * halve - low * halve).log2().floor() as i32 + 1;
    let shift = 62 - keys.len().ilog2() as i32 - exponent;
    let (up, down) = (2f64.powi(shift / 2), 2f64.powi(shift - shift / 2));
    let grid = |x: f64| ((x * halve - low * halve) * up * down).round_ties_even() as i64;
    // Distinct values with their counts; -0 and +0 are one value. `ends[k]` is the place behind group k.
    let mut groups: Vec<(i64, u64)> = Vec::with_capacity(keys.len());
    let mut ends: Vec<usize> = Vec::with_capacity(keys.len());
    let mut last = T::from_key(keys[0]);
    let mut start = 0;
    for i in 1..=keys.len() {
        if i < keys.len() {
            let x = value(i);
            if x == last {
                continue;
            }
            groups.push((grid(last.double()), (i - start) as u64));
            last = x;
        } else {
            groups.push((grid(last.double()), (i - start) as u64));
        }
        ends.push(i);
        start = i;
    }
    job.check()?;
    let Some((k, ratio, all)) = best_cut(groups.iter().copied()) else {
        return Ok(Threshold { value: low, separability: 0.0 });
    };
    let mean = groups.iter().map(|&(v, n)| v as f64 * n as f64).sum::<f64>() / all as f64;
    let squares = groups.iter().map(|&(v, n)| (v as f64 - mean) * (v as f64 - mean) * n as f64).sum::<f64>();
    let cut = T::between(value(ends[k] - 1), value(ends[k]));
    Ok(Threshold { value: cut.double(), separability: separability(&ratio, all, squares) })
}

/// [`of_floats`], or [`binned`] where a number of bins is given.
pub fn of_samples<T: Float>(job: &Job, data: &[T], mask: Option<&[bool]>, bins: Option<usize>) -> Result<Threshold> {
    match bins {
        None => of_floats(job, data, mask),
        Some(bins) => binned(job, data, mask, bins),
    }
}

/// Threshold of a histogram of `bins` bins over `[min, max]`: the centre of the last bin of class 0.
pub fn binned<T: Float>(job: &Job, data: &[T], mask: Option<&[bool]>, bins: usize) -> Result<Threshold> {
    let samples = chosen(data, mask)?;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for x in &samples {
        low = low.min(x.double());
        high = high.max(x.double());
    }
    if low == high {
        return Ok(Threshold { value: low, separability: 0.0 });
    }
    let layout = histogram::Bins::new(bins, low, high)?;
    let cut = of_counts(&histogram::samples(job, &samples, 1, None, &layout)?.bins, "img")?;
    let edges = layout.edges();
    let bin = cut.value as usize;
    Ok(Threshold { value: 0.5 * (edges[bin] + edges[bin + 1]), separability: cut.separability })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_go_to_the_first() {
        for (counts, want) in [
            (&[1, 1, 1][..], 0.0),
            (&[3, 0, 0, 3, 0, 0, 3][..], 0.0),
            (&[0, 5, 0, 0, 0, 5][..], 1.0),
            (&[0, 0, 7][..], 2.0),
        ] {
            let cut = of_counts(counts, "img").expect("not empty");
            assert_eq!(cut.value, want, "{counts:?}");
        }
    }

    #[test]
    fn wide_products_are_exact() {
        let x = u128::MAX - 12345;
        let cube = times(times(wide(x), 3), 5);
        let direct = times(wide(x), 15);
        assert_eq!(cube, direct, "associative");
        let square = times(wide(1 << 100), 1 << 100);
        assert_eq!(square, [0, 0, 0, 1 << 8, 0], "2^200");
    }

    #[test]
    fn huge_counts_do_not_overflow() {
        // 2^36 samples, symmetric: the tie must be seen.
        let cut = of_counts(&[1 << 34, 0, 1 << 34, 1 << 34, 0, 1 << 34], "img").expect("not empty");
        assert_eq!(cut.value, 2.0, "the middle cut is best");
        let mut counts = vec![0; 65536];
        (counts[0], counts[32767], counts[65534]) = (1 << 35, 1 << 35, 1 << 35);
        assert_eq!(of_counts(&counts, "img").expect("not empty").value, 0.0, "first of two equal cuts");
    }

    #[test]
    fn keys_rise_and_return() {
        let xs = [f32::MIN, -1.0, -0.0, 0.0, f32::from_bits(1), 1.0, f32::MAX];
        assert!(xs.windows(2).all(|p| p[0].key() < p[1].key()), "order");
        assert!(xs.iter().all(|&x| f32::from_key(x.key()).to_bits() == x.to_bits()), "round trip");
    }

    #[test]
    fn neighbours_and_extremes_are_cut_between() {
        let pairs = [(1.0_f32, 1.0_f32.next_up()), (f32::MIN, f32::MAX), (0.0, f32::from_bits(1))];
        for (a, b) in pairs {
            let cut = of_floats(&Job::serial(), &[b, a, b], None).expect("two classes");
            assert!(f64::from(a) <= cut.value && cut.value < f64::from(b), "{a:e} {b:e} -> {}", cut.value);
            assert!((cut.separability - 1.0).abs() < 1e-9, "two values separate wholly: {}", cut.separability);
        }
        let cut = of_floats(&Job::serial(), &[f64::MIN, f64::MAX, f64::MAX], None).expect("two classes");
        assert!(cut.value.is_finite() && cut.separability > 0.999, "no overflow");
    }
}

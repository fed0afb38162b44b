//! Otsu's threshold of floating-point samples: of few by a sort, of many by branch and bound over bins, both exact (floor 1).
//!
//! Counts and sums are taken by the leading bits of each sample ([`Leading`]), and only samples are sorted that lie where
//! the best cut may be: the criterion of [`otsu`](super::otsu) is convex in `(w, s)`, the number and the sum of class 0, and
//! the cuts within a bin lie in a triangle whose corners are known, so no cut in it is better than the best corner. The cut
//! found is that of the sort, to the bit (`bins_and_a_sort_find_the_same_cut`). Three passes, 2.5 ns a sample; a sort of
//! all is 30 ns.

use std::cmp::Ordering;

use super::Sample;
use super::otsu_cut::{Ratio, Threshold, best_cut, separability};
use crate::error::Result;
use crate::job::Job;
use crate::math::lanes;

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
    /// Such bits, from the low ones of a number.
    fn key_of(bits: u64) -> Self::Key;
    /// The nearest value of this type.
    fn from_double(x: f64) -> Self;
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
            fn key_of(bits: u64) -> $u {
                bits as $u
            }
            #[inline(always)]
            fn from_double(x: f64) -> Self {
                x as $t
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

/// Keys in rising order: least significant digit first, 11 bits at a time; digits that all keys share are skipped.
pub(super) fn sorted_keys<T: Float>(job: &Job, samples: &[T]) -> Result<Vec<T::Key>> {
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

/// The grid that samples are rounded to for sums: `2^k` steps over `[low, high]`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    low: f64,
    halve: f64,
    up: f64,
    down: f64,
}

impl Steps {
    /// For `count` samples between two that differ.
    pub(super) fn new(count: usize, low: f64, high: f64) -> Self {
        // Both ends halved where their difference overflows. A power of two as scale keeps the grid exact; it is applied
        // in two factors, either of which exists even where their product does not.
        let halve = if (high - low).is_finite() { 1.0 } else { 0.5 };
        let exponent = (high * halve - low * halve).log2().floor() as i32 + 1;
        let shift = 62 - count.ilog2() as i32 - exponent;
        Self { low, halve, up: 2f64.powi(shift / 2), down: 2f64.powi(shift - shift / 2) }
    }

    /// Before it is rounded.
    #[inline(always)]
    pub(super) fn place(&self, x: f64) -> f64 {
        (x * self.halve - self.low * self.halve) * self.up * self.down
    }

    pub(super) fn of(&self, x: f64) -> i64 {
        self.place(x).round_ties_even() as i64
    }
}

/// Least and greatest of some samples.
pub(super) fn extremes<T: Float>(samples: &[T]) -> [T; 2] {
    lanes::run(
        #[inline(always)]
        || {
            let (mut low, mut high) = ([samples[0]; 16], [samples[0]; 16]);
            for row in samples.chunks(16) {
                for ((low, high), &x) in low.iter_mut().zip(&mut high).zip(row) {
                    *low = if x < *low { x } else { *low };
                    *high = if x > *high { x } else { *high };
                }
            }
            let [mut a, mut b] = [low[0], high[0]];
            for (&low, &high) in low.iter().zip(&high) {
                a = if low < a { low } else { a };
                b = if high > b { high } else { b };
            }
            [a, b]
        },
    )
}

/// The best cut of samples whose bits are in rising order.
pub(super) fn of_sorted<T: Float>(keys: &[T::Key]) -> Threshold {
    let value = |i: usize| T::from_key(keys[i]);
    let (low, high) = (value(0).double(), value(keys.len() - 1).double());
    if low == high {
        return Threshold { value: low, separability: 0.0 };
    }
    let steps = Steps::new(keys.len(), low, high);
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
            groups.push((steps.of(last.double()), (i - start) as u64));
            last = x;
        } else {
            groups.push((steps.of(last.double()), (i - start) as u64));
        }
        ends.push(i);
        start = i;
    }
    let Some((k, ratio, all)) = best_cut(groups.iter().copied()) else {
        return Threshold { value: low, separability: 0.0 };
    };
    let mean = groups.iter().map(|&(v, n)| v as f64 * n as f64).sum::<f64>() / all as f64;
    let squares = groups.iter().map(|&(v, n)| (v as f64 - mean) * (v as f64 - mean) * n as f64).sum::<f64>();
    let cut = T::between(value(ends[k] - 1), value(ends[k]));
    Threshold { value: cut.double(), separability: separability(&ratio, all, squares) }
}

/// Leading bits of a sample that choose its bin: a large picture fills more bins than it costs to clear them.
fn leading_bits(count: usize) -> u32 {
    if count < 1 << 20 { 16 } else { 18 }
}

/// Samples whose bits and steps of the grid are found at once.
const AT_ONCE: usize = 256;

/// Counts and sums of many samples by their leading bits.
struct Leading {
    /// Samples and the sum of their steps.
    bins: Vec<[u64; 2]>,
    /// The bin of the least sample.
    first: usize,
    /// Bits of a sample that do not matter.
    shift: u32,
}

/// Bits that rise with the value; of both zeros those of +0.
#[inline(always)]
fn bits_of<T: Float>(x: T) -> T::Key {
    if x.double() == 0.0 { T::from_double(0.0).key() } else { x.key() }
}

#[inline(always)]
fn bin_of<T: Float>(x: T, shift: u32) -> usize {
    (bits_of(x).into() >> shift) as usize
}

impl Leading {
    fn new<T: Float>(job: &Job, samples: &[T], ends: [T; 2], steps: &Steps) -> Result<Self> {
        // At least 2^16 samples: a step is below 2^47, and adding this rounds to one, kept in the low bits.
        const MAGIC: f64 = 1.5 * (1_u64 << 52) as f64;
        let shift = T::BITS - leading_bits(samples.len());
        let [first, last] = ends.map(|x| bin_of(x, shift));
        let mut bins = vec![[0_u64; 2]; last - first + 1];
        let (mut places, mut values) = ([0_u64; AT_ONCE], [0_u64; AT_ONCE]);
        for (k, some) in samples.chunks(AT_ONCE).enumerate() {
            if k.is_multiple_of(4096) {
                job.check()?;
            }
            lanes::run(
                #[inline(always)]
                || {
                    for ((place, value), &x) in places.iter_mut().zip(&mut values).zip(some) {
                        *place = bits_of(x).into() >> shift;
                        *value = (steps.place(x.double()) + MAGIC).to_bits().wrapping_sub(MAGIC.to_bits());
                    }
                },
            );
            for (place, value) in places.iter().zip(&values).take(some.len()) {
                let bin = &mut bins[*place as usize - first];
                bin[0] += 1;
                bin[1] += value;
            }
        }
        Ok(Self { bins, first, shift })
    }

    /// The bin of a sample.
    #[inline(always)]
    fn bin<T: Float>(&self, x: T) -> usize {
        bin_of(x, self.shift) - self.first
    }

    /// Least and greatest step that a sample of a bin may have.
    fn ends<T: Float>(&self, bin: usize, [low, high]: [T; 2], steps: &Steps) -> [f64; 2] {
        let at = |bin: usize| T::from_key(T::key_of(((self.first + bin) as u64) << self.shift));
        let from = if bin == 0 { low } else { at(bin) };
        let to = if bin + 1 == self.bins.len() { high } else { at(bin + 1) };
        [steps.of(from.double()) as f64, steps.of(to.double()) as f64]
    }
}

/// The sum of squares of a block's steps from their mean, in sixteen parts so that every SIMD level adds alike.
#[inline(always)]
fn squared<T: Float>(some: &[T], steps: &Steps, mean: f64, sums: &mut [f64; 16]) {
    for row in some.chunks(16) {
        for (sum, &x) in sums.iter_mut().zip(row) {
            let off = steps.place(x.double()) - mean;
            *sum += off * off;
        }
    }
}

/// The best cut of many samples that are not all equal.
pub(super) fn of_many<T: Float>(job: &Job, samples: &[T], ends: [T; 2]) -> Result<Threshold> {
    let steps = Steps::new(samples.len(), ends[0].double(), ends[1].double());
    let leading = Leading::new(job, samples, ends, &steps)?;
    let (mut all, mut sum) = (0_u64, 0_i128);
    for [n, s] in &leading.bins {
        all += n;
        sum += i128::from(*s);
    }
    let (all_f, sum_f) = (all as f64, sum as f64);
    let criterion = |w: f64, s: f64| {
        let d = sum_f * w - all_f * s;
        // At either end every cut is empty.
        if w <= 0.0 || w >= all_f { 0.0 } else { d * d / (w * (all_f - w)) }
    };
    // The best of the cuts between bins is below the best of all.
    let (mut w, mut s, mut best) = (0.0, 0.0, 0.0_f64);
    for [n, part] in &leading.bins {
        (w, s) = (w + *n as f64, s + *part as f64);
        best = best.max(criterion(w, s));
    }
    // The first samples of a bin have at least its least step and leave at most its greatest: their `(w, s)` lie in the
    // triangle between the bin's ends and where the two lines meet. f64 is off by a few eps of products up to `N S`.
    // Where k of N samples lie far above all others, d is a small difference: its square is off by up to 4 eps sqrt(N / k).
    let slack = 1e-10 * best + 64.0 * f64::EPSILON * sum_f * sum_f;
    let (mut w, mut s) = (0.0, 0.0);
    let mut wanted = vec![false; leading.bins.len()];
    for (k, [n, part]) in leading.bins.iter().enumerate() {
        let (m, t) = (*n as f64, *part as f64);
        if m > 0.0 {
            let [low, high] = leading.ends(k, ends, &steps);
            let few = if high > low { ((high * m - t) / (high - low)).clamp(0.0, m) } else { m };
            wanted[k] =
                criterion(w + few, s + low * few).max(criterion(w, s)).max(criterion(w + m, s + t)) >= best - slack;
        }
        (w, s) = (w + m, s + t);
    }
    job.check()?;
    let mut few: Vec<T> = Vec::new();
    few.extend(samples.iter().filter(|&&x| wanted[leading.bin(x)]));
    let keys = sorted_keys(job, &few)?;
    drop(few);
    // Every cut that may be best in rising order: within the wanted bins, and behind each other bin.
    let value = |i: usize| T::from_key(keys[i]);
    let mut found: Option<(Ratio, usize, usize)> = None;
    let (mut w, mut s, mut i) = (0_u64, 0_i128, 0);
    let mut consider = |w: u64, s: i128, bin: usize, behind: usize| {
        if w == 0 || w == all {
            return;
        }
        let here = Ratio::new(all, sum, w, s);
        if found.is_none_or(|(b, _, _)| here.cmp(&b) == Ordering::Greater) {
            found = Some((here, bin, behind));
        }
    };
    for (k, &[n, part]) in leading.bins.iter().enumerate() {
        if wanted[k] {
            let end = i + n as usize;
            while i < end {
                let x = value(i);
                let start = i;
                while i < end && value(i) == x {
                    i += 1;
                }
                w += (i - start) as u64;
                s += i128::from(steps.of(x.double())) * (i - start) as i128;
                consider(w, s, k, i);
            }
        } else if n > 0 {
            (w, s) = (w + n, s + i128::from(part));
            consider(w, s, k, i);
        }
    }
    let Some((ratio, bin, behind)) = found else {
        return Ok(Threshold { value: ends[0].double(), separability: 0.0 });
    };
    // The neighbours of the cut: sorted ones, or the outermost of a bin that was not.
    let outer = |bin: usize, least: bool| {
        let of = samples.iter().copied().filter(|&x| leading.bin(x) == bin);
        of.reduce(|a, b| if (b < a) == least { b } else { a })
    };
    let within = |i: usize, bin: usize| i < keys.len() && leading.bin(value(i)) == bin;
    let below = if wanted[bin] { Some(value(behind - 1)) } else { outer(bin, false) };
    let above = if within(behind, bin) {
        Some(value(behind))
    } else {
        let next = (bin + 1..leading.bins.len()).find(|&k| leading.bins[k][0] > 0);
        next.and_then(|k| if wanted[k] { Some(value(behind)) } else { outer(k, true) })
    };
    let mean = sum_f / all_f;
    let mut sums = [0.0; 16];
    for some in samples.chunks(AT_ONCE) {
        lanes::run(
            #[inline(always)]
            || squared(some, &steps, mean, &mut sums),
        );
    }
    let cut = below.zip(above).map_or(ends[0], |(a, b)| T::between(a, b));
    Ok(Threshold { value: cut.double(), separability: separability(&ratio, all, sums.iter().sum()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_and_a_sort_find_the_same_cut() {
        let job = Job::serial();
        let random = crate::math::random::Stream::new(7, 3);
        let mut taken = 0;
        let mut next = || {
            taken += 1;
            random.uniform(taken)
        };
        for kind in 0..8 {
            let samples: Vec<f32> = (0..70_000)
                .map(|i| {
                    let (u, v) = (next(), next());
                    let x = match kind {
                        0 => u,
                        1 => {
                            if u < 0.4 {
                                0.3 + 0.1 * v
                            } else {
                                0.7 + 0.1 * v
                            }
                        }
                        // A few that outshine all, as a picture of the Sun.
                        2 => {
                            if i % 5000 == 0 {
                                1e30 * v
                            } else {
                                v
                            }
                        }
                        3 => (u - 0.5) * 10f64.powf(20.0 * v - 10.0),
                        // Levels, many equal, and the two halves alike: the first of equal cuts.
                        4 => (u * 7.0).floor(),
                        5 => {
                            if i % 2 == 0 {
                                -0.0
                            } else {
                                0.0 * v + f64::from(i % 3 == 0)
                            }
                        }
                        6 => f64::from(i % 3 - 1),
                        _ => {
                            if i == 0 {
                                1.0
                            } else {
                                0.25
                            }
                        }
                    };
                    x as f32
                })
                .collect();
            let wide: Vec<f64> = samples.iter().map(|&x| f64::from(x) * (1.0 + 1e-9)).collect();
            let many = of_many(&job, &samples, extremes(&samples)).expect("cut");
            let sorted = of_sorted::<f32>(&sorted_keys(&job, &samples).expect("sorted"));
            assert_eq!(many.value, sorted.value, "kind {kind}");
            assert!((many.separability - sorted.separability).abs() < 1e-12, "{many:?} {sorted:?}");
            let many = of_many(&job, &wide, extremes(&wide)).expect("cut");
            let sorted = of_sorted::<f64>(&sorted_keys(&job, &wide).expect("sorted"));
            assert_eq!(many.value, sorted.value, "kind {kind} in f64");
        }
    }

    #[test]
    fn keys_rise_and_return() {
        let xs = [f32::MIN, -1.0, -0.0, 0.0, f32::from_bits(1), 1.0, f32::MAX];
        assert!(xs.windows(2).all(|p| p[0].key() < p[1].key()), "order");
        assert!(xs.iter().all(|&x| f32::from_key(x.key()).to_bits() == x.to_bits()), "round trip");
    }
}

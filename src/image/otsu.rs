//! Otsu's threshold, exactly (floor 1): N. Otsu, A threshold selection method from gray-level histograms, IEEE
//! Transactions on Systems, Man, and Cybernetics 9(1), 1979, 62-66.
//!
//! Of all cuts "class 0 is x <= t" the one with the largest variance between the classes, that is the largest
//! `(S w - N s)^2 / (w (N - w))` (N samples of sum S, of which w of sum s in class 0), and of equal ones the first.
//! The rationals are compared exactly: in f64 where they differ by more than 16 eps, in 320-bit integers otherwise.
//! Rounding makes the usual implementations pick a later maximiser on symmetric histograms.
//!
//! * Integer levels: exact.
//! * Floating-point samples: cut between neighbours. For the sums each sample is rounded to
//!   a grid of `2^k` steps over `[min, max]`, k = 62 - log2 N (at least 40 below 4 million samples): the cut is the
//!   exact optimum of the samples so rounded, hence of the samples themselves wherever they lie on that grid (8-, 16-
//!   and 24-bit data do when their range is a power of two of their step).
//! * `binned`: a histogram of n bins over `[min, max]`, whose bin centre is returned (what scikit-image does).
//!
//! Cost: a histogram for integers; of many floating-point samples three passes and a sort of a few of them
//! ([`otsu_float`](super::otsu_float)), of few a radix sort.

use std::borrow::Cow;

pub use super::otsu_cut::Threshold;
use super::otsu_cut::{best_cut, separability};
pub use super::otsu_float::Float;
use super::otsu_float::{extremes, of_many, of_sorted, sorted_keys};
use super::{Sample, check_mask, histogram};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::lanes;

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

/// Samples inside the mask, all finite.
fn chosen<'a, T: Float>(data: &'a [T], mask: Option<&[bool]>) -> Result<Cow<'a, [T]>> {
    check_mask(mask, data.len())?;
    let all = match mask {
        None => Cow::Borrowed(data),
        Some(m) => Cow::Owned(data.iter().zip(m).filter(|&(_, &inside)| inside).map(|(&x, _)| x).collect()),
    };
    if all.is_empty() {
        return Err(Error::Empty { name: empty_name(mask) });
    }
    let strange: u64 = lanes::run(
        #[inline(always)]
        || {
            let mut strange = 0;
            for &x in &*all {
                strange += u64::from(!(x.double() - x.double() == 0.0));
            }
            strange
        },
    );
    if strange > 0 {
        let reason = format!("must be finite where it is looked at, got {strange} values that are NaN or infinite");
        return Err(Error::Data { name: "img", reason });
    }
    Ok(all)
}

/// Samples below this are sorted, all of them \[1\].
const MANY: usize = 1 << 16;

/// Threshold of floating-point samples: the midpoint between the two neighbours at the best cut.
pub fn of_floats<T: Float>(job: &Job, data: &[T], mask: Option<&[bool]>) -> Result<Threshold> {
    let samples = chosen(data, mask)?;
    if samples.len() >= MANY {
        let ends = extremes(&samples);
        if ends[0] == ends[1] {
            return Ok(Threshold { value: ends[0].double(), separability: 0.0 });
        }
        return of_many(job, &samples, ends);
    }
    Ok(of_sorted::<T>(&sorted_keys(job, &samples)?))
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
    let [low, high] = extremes(&samples).map(Sample::double);
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
    fn huge_counts_do_not_overflow() {
        // 2^36 samples, symmetric: the tie must be seen.
        let cut = of_counts(&[1 << 34, 0, 1 << 34, 1 << 34, 0, 1 << 34], "img").expect("not empty");
        assert_eq!(cut.value, 2.0, "the middle cut is best");
        let mut counts = vec![0; 65536];
        (counts[0], counts[32767], counts[65534]) = (1 << 35, 1 << 35, 1 << 35);
        assert_eq!(of_counts(&counts, "img").expect("not empty").value, 0.0, "first of two equal cuts");
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

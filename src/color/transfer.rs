//! The sRGB transfer function, IEC 61966-2-1:1999, between linear light and encoded values.
//!
//! The constants are those of the standard, 0.0031308 and 0.04045, which leave a step of 2.9e-8 at the break. Negative
//! values take the odd extension `sign(x) f(|x|)`, values above 1 the same curve; nothing is clipped, NaN stays NaN.
//!
//! | function | largest absolute error on `[0, 1]`, `f32` | largest relative error, `f64` |
//! |---|---|---|
//! | [`encode`] | 1.7e-7 | 1e-15 |
//! | [`decode`] | 2.0e-7 | 1e-15 |
//!
//! The tests of this file hold these. Cost: about 40 vector operations in `f32` for an element.

use super::each;
use crate::error::Result;
use crate::job::Job;
use crate::math::elementary::Real;

/// Encoded value `[1]` of linear light `[1]`.
#[inline(always)]
pub fn encode<T: Real>(linear: T) -> T {
    let a = linear.magnitude();
    // 1.055 y - 0.055, so that 1.055 is not rounded and white stays white.
    let y = a.root_12_5();
    let curve = y + (y - T::of(1.0)) * T::of(0.055);
    let line = a * T::of(12.92);
    let y = if a > T::of(0.0031308) { curve } else { line };
    y.copysign(linear)
}

/// Linear light `[1]` of an encoded value `[1]`.
#[inline(always)]
pub fn decode<T: Real>(encoded: T) -> T {
    let a = encoded.magnitude();
    // The two rounded factors still have the sum 1, in both precisions: white stays white.
    let curve = (a * T::of(1.0 / 1.055) + T::of(0.055 / 1.055)).power_12_5();
    let line = a * T::of(1.0 / 12.92);
    // A comparison with NaN is false: it takes the line, which keeps it.
    let y = if a > T::of(0.04045) { curve } else { line };
    y.copysign(encoded)
}

/// [`encode`] by the standard's words, with the library's power.
pub fn encode_exact(x: f64) -> f64 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// [`decode`] by the standard's words, with the library's power.
pub fn decode_exact(v: f64) -> f64 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// [`encode`] over a slice.
pub fn encode_all<T: Real>(job: &Job, linear: &[T], out: &mut [T]) -> Result<()> {
    each(
        job,
        linear,
        out,
        #[inline(always)]
        |x| encode(x),
    )
}

/// [`decode`] over a slice.
pub fn decode_all<T: Real>(job: &Job, encoded: &[T], out: &mut [T]) -> Result<()> {
    each(
        job,
        encoded,
        out,
        #[inline(always)]
        |x| decode(x),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_is_within_its_error_bound() {
        let (mut there, mut back) = (0.0_f64, 0.0_f64);
        for i in 0..=4_000_000 {
            let x = i as f32 / 4e6;
            // The break of `f32` is the nearest float, so its own side is the exact one there.
            there = there.max((f64::from(encode(x)) - encode_exact(f64::from(x))).abs());
            back = back.max((f64::from(decode(x)) - decode_exact(f64::from(x))).abs());
        }
        println!("encode {there:e}, decode {back:e}");
        assert!(there < 1.7e-7, "encode: absolute error {there:e}");
        assert!(back < 2.0e-7, "decode: absolute error {back:e}");
    }

    #[test]
    fn double_precision_is_within_its_error_bound() {
        let (mut there, mut back) = (0.0_f64, 0.0_f64);
        for i in 1..=400_000 {
            let x = f64::from(i) * 1e-5;
            there = there.max((encode(x) / encode_exact(x) - 1.0).abs());
            back = back.max((decode(x) / decode_exact(x) - 1.0).abs());
        }
        println!("encode {there:e}, decode {back:e}");
        assert!(there < 1e-15, "encode: relative error {there:e}");
        assert!(back < 1e-15, "decode: relative error {back:e}");
    }

    #[test]
    fn the_ends_and_the_odd_extension() {
        fn ends<T: Real + Into<f64>>() {
            for f in [encode::<T>, decode::<T>] {
                let get = |x: f64| -> f64 { f(T::of(x)).into() };
                assert_eq!(get(0.0), 0.0, "black");
                assert!(get(-0.0).is_sign_negative(), "the sign of zero");
                assert_eq!(get(1.0), 1.0, "white");
                assert_eq!(get(-0.3), -get(0.3), "odd");
                assert_eq!(get(-0.001), -get(0.001), "odd");
                assert_eq!(get(f64::INFINITY), f64::INFINITY, "infinity");
                assert_eq!(get(f64::NEG_INFINITY), f64::NEG_INFINITY, "infinity");
                assert!(get(f64::NAN).is_nan(), "NaN propagates");
            }
        }
        ends::<f32>();
        ends::<f64>();
    }

    #[test]
    fn lengths_must_agree() {
        assert!(encode_all(&Job::serial(), &[0.0_f32; 3], &mut [0.0; 2]).is_err(), "two for three");
    }
}

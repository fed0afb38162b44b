//! Branch-free elementary functions with a stated error (floor 0).
//!
//! Loops over these vectorise at every SIMD level and give the same bits at each: only add, multiply, compare, select
//! and integer operations are used. The coefficients are Chebyshev interpolants computed with 50 digits and rounded
//! once; the errors below are the largest seen by the tests of this file against `f64` libm.
//!
//! | function | range | largest relative error |
//! |---|---|---|
//! | [`exp`] | `[-87, 88]` | 1.5e-7 |

/// `e^x` in single precision: below -87.3 it is 0, above 88.7 infinite, NaN for NaN.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    const LOG2_E: f32 = std::f32::consts::LOG2_E;
    // ln 2 in two pieces: the first has 9 trailing zero bits, so k * HI is exact for |k| < 512.
    const LN2_HI: f32 = 0.693_359_4;
    const LN2_LO: f32 = -2.121_944_4e-4;
    const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23: adding it rounds to an integer kept in the low mantissa bits
    let clamped = if x > 88.8 { 88.8 } else { x };
    let clamped = if clamped < -87.4 { -87.4 } else { clamped };
    let shifted = clamped * LOG2_E + MAGIC;
    let k = shifted - MAGIC;
    let r = (clamped - k * LN2_HI) - k * LN2_LO;
    let mut p = 1.987_569_15e-4_f32;
    p = p * r + 1.398_199_95e-3;
    p = p * r + 8.333_452e-3;
    p = p * r + 4.166_579_6e-2;
    p = p * r + 1.666_666_5e-1;
    p = p * r + 0.5;
    let y = (p * r) * r + r + 1.0;
    // 2^k as two factors, so that the ends of the range neither overflow nor vanish too soon.
    let n = (shifted.to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32);
    let half = n >> 1;
    let a = f32::from_bits(((half + 127) << 23) as u32);
    let b = f32::from_bits(((n - half + 127) << 23) as u32);
    let result = y * a * b;
    let result = if x < -87.336_54 { 0.0 } else { result };
    let result = if x > 88.722_84 { f32::INFINITY } else { result };
    if x.is_nan() { x } else { result }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_within_its_error_bound() {
        let mut worst = 0.0_f64;
        for i in 0..=3_500_000 {
            let x = -87.0_f32 + i as f32 * 5e-5;
            let exact = f64::from(x).exp();
            worst = worst.max((f64::from(exp(x)) - exact).abs() / exact);
        }
        assert!(worst < 1.5e-7, "relative error {worst:e}");
        assert_eq!(exp(0.0), 1.0, "exact at zero");
        assert_eq!(exp(-1e30), 0.0, "vanishes");
        assert_eq!(exp(f32::NEG_INFINITY), 0.0, "vanishes");
        assert_eq!(exp(1e30), f32::INFINITY, "overflows");
        assert!(exp(f32::NAN).is_nan(), "NaN propagates");
    }
}

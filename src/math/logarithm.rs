//! Natural logarithms in loops that vectorise (floor 0): the exponent's bits and a series of the mantissa.
//!
//! Error of [`ln`] 1.2e-7 relative, near 1 too; of [`mean_ln`] 2e-7 absolute. Both are for positive normal numbers.

use super::elementary::series;

/// The exponent and the mantissa in `[sqrt(1/2), sqrt(2))` of a positive normal number.
#[inline(always)]
fn split(x: f32) -> (f32, f32) {
    const MAGIC: f32 = 12_582_912.0;
    // From the bits of sqrt(1/2) on, a step of the exponent's field is a step of the exponent.
    let above = x.to_bits().wrapping_sub(0x3f35_04f3);
    let exponent = (above as i32) >> 23;
    let mantissa = f32::from_bits((above & 0x007f_ffff).wrapping_add(0x3f35_04f3));
    // An integer to a float without a conversion: into the low bits of 1.5 * 2^23.
    (f32::from_bits((exponent as u32).wrapping_add(MAGIC.to_bits())) - MAGIC, mantissa)
}

/// Natural logarithm of a positive normal number (Cephes' polynomial). Anything else gives some number.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    const C: [f32; 9] = [
        3.333_333_1e-1,
        -2.499_999_4e-1,
        2.000_071_5e-1,
        -1.666_805_8e-1,
        1.424_932_3e-1,
        -1.242_014_1e-1,
        1.167_699_9e-1,
        -1.151_461_0e-1,
        7.037_683_6e-2,
    ];
    let (e, m) = split(x);
    let t = m - 1.0;
    let z = t * t;
    // ln 2 in two pieces, of which the first is exact times any exponent.
    let y = series(&C, t) * t * z - e * 2.121_944_4e-4 - 0.5 * z;
    t + y + e * 0.693_359_4
}

/// Mean natural logarithm of positive numbers, a multiple of 16 of them: one logarithm for sixteen.
#[inline(always)]
pub fn mean_ln<const N: usize>(values: &[f32; N]) -> f64 {
    const LANES: usize = 16;
    let (mut exponents, mut product) = ([0.0_f32; LANES], [1.0_f32; LANES]);
    let mut sum = 0.0;
    for some in values.as_chunks::<LANES>().0.chunks(16) {
        for row in some {
            for k in 0..LANES {
                let (exponent, mantissa) = split(row[k]);
                exponents[k] += exponent;
                product[k] *= mantissa;
            }
        }
        // Sixteen mantissas stay within 2^8 of 1.
        for p in &mut product {
            sum += f64::from(ln(*p));
            *p = 1.0;
        }
    }
    let whole: f64 = exponents.iter().map(|&e| f64::from(e)).sum();
    (sum + whole * std::f64::consts::LN_2) / N as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ln_is_within_its_error_bound() {
        let mut worst = 0.0_f64;
        for i in 0..3_000_000_u32 {
            // Every exponent, and densely around 1, where the logarithm vanishes.
            let x = if i & 1 == 0 {
                f32::from_bits(0x0080_0000 + i * 700)
            } else {
                1.0 + (f64::from(i) / 1.5e6 - 1.0) as f32 * 0.4
            };
            let exact = f64::from(x).ln();
            if exact != 0.0 {
                worst = worst.max((f64::from(ln(x)) - exact).abs() / exact.abs());
            }
        }
        assert!(worst < 1.2e-7, "relative error {worst:e}");
        assert_eq!(ln(1.0), 0.0, "exact at one");
    }

    #[test]
    fn logarithms_are_those_of_libm() {
        for i in 0..200_000 {
            let x = 10.0_f64.powf(f64::from(i) / 200_000.0 * 76.0 - 37.9) as f32;
            let want = f64::from(x).ln();
            assert!((f64::from(ln(x)) - want).abs() < 1.5e-7 * want.abs().max(1.0), "{x}: {} {want}", ln(x));
        }
        assert_eq!(ln(1.0), 0.0, "exact");
        assert!(ln(0.0) < -87.0 && ln(f32::INFINITY) > 88.0 && ln(f32::NAN).is_finite(), "ends");
    }

    #[test]
    fn a_mean_of_logarithms() {
        let values: [f32; 256] = std::array::from_fn(|i| 10.0_f32.powf(i as f32 / 10.0 - 8.0));
        let want = values.iter().map(|&x| f64::from(x).ln()).sum::<f64>() / 256.0;
        assert!((mean_ln(&values) - want).abs() < 2e-7, "{} against {want}", mean_ln(&values));
    }
}

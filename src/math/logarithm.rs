//! Natural logarithms in loops that vectorise (floor 0): the exponent's bits and a series of the mantissa.
//!
//! Error of [`ln`] 1.2e-7 relative, or absolute below 1; of [`mean_ln`] 2e-7 absolute. Subnormal numbers count as the
//! smallest normal one.

/// The exponent and the mantissa in `[sqrt(1/2), sqrt(2))` of a positive number.
#[inline(always)]
fn split(x: f32) -> (f32, f32) {
    const MAGIC: f32 = 12_582_912.0;
    let x = if x > f32::MIN_POSITIVE { x } else { f32::MIN_POSITIVE };
    // From the bits of sqrt(1/2) on, a step of the exponent's field is a step of the exponent.
    let above = x.to_bits().wrapping_sub(0x3f35_04f3);
    let exponent = (above as i32) >> 23;
    let mantissa = f32::from_bits((above & 0x007f_ffff).wrapping_add(0x3f35_04f3));
    // An integer to a float without a conversion: into the low bits of 1.5 * 2^23.
    (f32::from_bits((exponent as u32).wrapping_add(MAGIC.to_bits())) - MAGIC, mantissa)
}

/// Natural logarithm of a positive number; infinity gives 88.7, NaN the logarithm of the smallest.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    let (exponent, m) = split(if x < f32::MAX { x } else { f32::MAX });
    let z = (m - 1.0) / (m + 1.0);
    let w = z * z;
    let series = 2.0 + w * (2.0 / 3.0 + w * (0.4 + w * (2.0 / 7.0 + w * (2.0 / 9.0))));
    // ln 2 in two pieces, of which the first is exact times any exponent.
    exponent * 0.693_359_4 + (z * series - exponent * 2.121_944_4e-4)
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

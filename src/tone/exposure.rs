//! Exposure: from scene to display without a model of the eye, O'Neil's curve and 8-bit sRGB levels (floor 2).
//!
//! O'Neil 2005 (GPU Gems 2, ch. 16) writes `1 - exp(-exposure x)` to the screen as it is; here it is the linear light
//! whose sRGB encoding that is. Relative error 1e-6 (`the_curve_keeps_its_digits_near_nothing`). Units: linear light
//! \[1\].

use crate::color::transfer::{decode, encode};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::elementary::exp;
use crate::math::lanes;

/// Numbers of a chunk.
const CHUNK: usize = 1 << 15;

fn same(light: usize, out: usize) -> Result<()> {
    if light == out {
        return Ok(());
    }
    Err(Error::Shape { name: "out", expected: format!("({light},)"), got: format!("({out},)") })
}

/// Linear light whose sRGB encoding is `1 - exp(-exposure x)`: O'Neil 2005 writes that to the screen as it is. 0 stays
/// 0, everything ends below 1. Relative error 1e-6, also of dim light.
pub fn oneil(job: &Job, light: &[f32], out: &mut [f32], exposure: f32) -> Result<()> {
    same(light.len(), out.len())?;
    job.chunks(out, CHUNK, |chunk, out| {
        let light = &light[chunk * CHUNK..chunk * CHUNK + out.len()];
        lanes::run(
            #[inline(always)]
            || {
                for (o, &x) in out.iter_mut().zip(light) {
                    let t = exposure * x;
                    // Of a small difference nothing is left after rounding: there the series is exact.
                    let series = t * (1.0 - t * (0.5 - t * (1.0 / 6.0 - t * (1.0 / 24.0 - t * (1.0 / 120.0)))));
                    let curve = 1.0 - exp(-t);
                    *o = decode(if t.abs() < 0.12 { series } else { curve });
                }
            },
        );
        Ok(())
    })
}

/// sRGB level of linear light in `[0, 1]`: adding 2^23 rounds, the level is in the low bits.
#[inline(always)]
pub(super) fn level(x: f32) -> u8 {
    (encode(x) * 255.0 + 8_388_608.0).to_bits() as u8
}

/// sRGB levels of linear light: encoded, clipped to `[0, 1]`, rounded to the nearest of 256. NaN becomes 0.
pub fn levels(job: &Job, light: &[f32], out: &mut [u8]) -> Result<()> {
    same(light.len(), out.len())?;
    job.chunks(out, CHUNK, |chunk, out| {
        let light = &light[chunk * CHUNK..chunk * CHUNK + out.len()];
        lanes::run(
            #[inline(always)]
            || {
                for (o, &x) in out.iter_mut().zip(light) {
                    let x = if x > 0.0 { x } else { 0.0 };
                    let x = if x < 1.0 { x } else { 1.0 };
                    *o = level(x);
                }
            },
        );
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_keeps_its_digits_near_nothing() {
        let light: Vec<f32> = (0..4000).map(|i| 10.0_f32.powf(i as f32 / 400.0 - 8.0)).collect();
        let mut out = vec![0.0; light.len()];
        oneil(&Job::serial(), &light, &mut out, 2.0).expect("same length");
        for (x, y) in light.iter().zip(&out) {
            let exact = decode(-(-2.0 * f64::from(*x)).exp_m1());
            assert!((f64::from(*y) / exact - 1.0).abs() < 1e-6, "{x}: {y} against {exact}");
        }
    }

    #[test]
    fn every_level_is_met_by_its_own_light() {
        let light: Vec<f32> = (0..=255_u8).map(|v| decode(f32::from(v) / 255.0)).collect();
        let mut out = vec![0; 256];
        levels(&Job::serial(), &light, &mut out).expect("same length");
        assert!(out.iter().enumerate().all(|(i, &v)| i == usize::from(v)), "round trip");
        let mut ends = [7; 5];
        let odd = [f32::NAN, -1.0, 2.0, f32::INFINITY, f32::NEG_INFINITY];
        levels(&Job::serial(), &odd, &mut ends).expect("same length");
        assert_eq!(ends, [0, 0, 255, 255, 0], "clipped");
    }
}

//! Scotopic (night) vision: the loss of colour and the blue shift of a dark-adapted eye (floor 2).
//!
//! The paper realistic_sky, section 3, eqs 20 and 21. Eq 21 does not say what V is: here the scotopic luminance of
//! Larson et al. 1997, `Y (1.33 (1 + (Y + Z) / X) - 1.68)`, its ratio to Y held below [`RATIO`], which a deep blue
//! light has. Between 0.01 and 4 cd/m2 (mesopic vision) both are mixed by a smoothstep of the logarithm.
//!
//! Units: cd/m2 of each channel. Cost: one logarithm a pixel.

use super::pixels::{over, same};
use crate::color::spaces::{RGB_TO_XYZ, XYZ_TO_RGB};
use crate::error::Result;
use crate::job::Job;
use crate::math::interpolation::hermite_step;
use crate::math::logarithm::ln;

/// The largest ratio of scotopic luminance to luminance: that of blue light of 460 nm.
pub const RATIO: f32 = 16.0;
/// Ratio of luminance to scotopic luminance of white (eq 21).
const WHITE: f32 = 0.4468;
/// Chromaticity of what rods see (after eq 19).
const ROD: [f32; 2] = [0.25, 0.25];
/// What a dark-adapted eye makes of a colour (eqs 20 and 21).
#[inline(always)]
pub(super) fn dim(pixel: [f32; 3]) -> [f32; 3] {
    dim_adapted(pixel, 0.0)
}

/// [`dim`] for an eye whose rods are dazzled: rods and cones are weighed as if a pixel had `least` \[cd/m2\] at least.
#[inline(always)]
pub(super) fn dim_adapted(pixel: [f32; 3], least: f32) -> [f32; 3] {
    let of = |m: [f64; 3]| m[0] as f32 * pixel[0] + m[1] as f32 * pixel[1] + m[2] as f32 * pixel[2];
    let (x, y, z) = (of(RGB_TO_XYZ[0]), of(RGB_TO_XYZ[1]), of(RGB_TO_XYZ[2]));
    let seen = y > 0.0;
    // log10 from the natural one; eq 20.
    let weighed = if y > least { y } else { least };
    let t = (ln(if weighed > 1e-30 { weighed } else { 1e-30 }) * std::f32::consts::LOG10_E + 2.0) * (1.0 / 2.6);
    let t = if t > 0.0 { t } else { 0.0 };
    let day = t >= 1.0;
    let t = if t < 1.0 { t } else { 1.0 };
    let s = hermite_step(t);
    let some = x > 1e-30;
    let inner = 1.33 * (1.0 + (y + z) / if some { x } else { 1.0 }) - 1.68;
    let inner = if some { inner } else { RATIO };
    let inner = if inner < RATIO { inner } else { RATIO };
    let inner = if inner > 0.0 { inner } else { 0.0 };
    let sum = x + y + z;
    let sum = if sum > 1e-30 { sum } else { 1.0 };
    let (u, v) = ((1.0 - s) * ROD[0] + s * (x / sum), (1.0 - s) * ROD[1] + s * (y / sum));
    let bright = WHITE * (1.0 - s) * (y * inner) + s * y;
    let by = bright / if v > 1e-6 { v } else { 1e-6 };
    let (a, c) = (u * by, (1.0 - u - v) * by);
    let of = |m: [f64; 3]| m[0] as f32 * a + m[1] as f32 * bright + m[2] as f32 * c;
    let night = [of(XYZ_TO_RGB[0]), of(XYZ_TO_RGB[1]), of(XYZ_TO_RGB[2])];
    let pick = |day_light: f32, night: f32| {
        let night = if seen { night } else { 0.0 };
        if day { day_light } else { night }
    };
    [pick(pixel[0], night[0]), pick(pixel[1], night[1]), pick(pixel[2], night[2])]
}

/// A picture as eyes see it that are adapted to its darkness, pixel by pixel.
pub fn scotopic(job: &Job, light: &[f32], out: &mut [f32]) -> Result<()> {
    #[allow(clippy::redundant_closure, reason = "the function itself would be called for each pixel: 40 times slower")]
    over(
        job,
        light,
        out,
        #[inline(always)]
        |pixel| dim(pixel),
        same,
    )
}

//! HSV, XYZ, xyY and Lab, pixel by pixel.
//!
//! - RGB and XYZ: the matrix derived from the primaries and the white (0.3127, 0.3290) of Rec. 709 (ITU-R BT.709-6,
//!   IEC 61966-2-1), computed with 50 digits and rounded once, and its exact inverse. The rounded four-digit matrix of
//!   IEC 61966-2-1 differs from it by up to 6.2e-5.
//! - Lab: CIE 15:2018 with the exact constants 216/24389 and 841/108. The white is the row sums of the matrix. A row of
//!   the matrix over white sums to 1, so it is applied as `G + m_R (R - G) + m_B (B - G)`: then greys have a and b of
//!   exactly zero, and the way back gives three equal channels. An infinite channel gives infinity or NaN.
//! - HSV: Smith, "Color gamut transform pairs", SIGGRAPH 1978, hue in turns `[0, 1)`, no epsilon in the denominators;
//!   greys have hue 0, and saturation is 0 where the largest channel is not above 0. NaN in a channel gives NaN in all
//!   three outputs, because each depends on all three channels.
//! - xyY of a colour with X + Y + Z = 0 has the chromaticity (0, 0) unless a white is given; XYZ of y = 0 is (0, Y, 0).
//!
//! | conversion | largest error, `f32` | `f64` |
//! |---|---|---|
//! | RGB to HSV on `[0, 1]` | 1.5e-7 turns, 6.0e-8, 0 | 4e-16, 2e-16, 0 |
//! | HSV to RGB on `[0, 1]` | 3.0e-7 | 6e-16 |
//! | linear RGB to Lab on `[0, 1]` | 1.5e-4 ΔE | 3e-13 ΔE |
//! | Lab to linear RGB on `[0, 1]` | 1.2e-6 | 3e-15 |
//!
//! The tests of this file hold these. Cost: near memory bandwidth for HSV, XYZ and xyY; about 250 vector operations a
//! pixel for encoded RGB to Lab.

use super::transfer::{decode, encode};
use super::{alone, mix, pixels, staged};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::elementary::Real;

/// A 3 × 3 matrix, row by row.
pub type Matrix = [[f64; 3]; 3];

/// XYZ of linear Rec. 709 RGB `[1]`.
pub const RGB_TO_XYZ: Matrix = [
    [0.4123907992659595, 0.35758433938387796, 0.1804807884018343],
    [0.21263900587151036, 0.7151686787677559, 0.07219231536073371],
    [0.01933081871559185, 0.11919477979462599, 0.9505321522496606],
];

/// Linear Rec. 709 RGB of XYZ `[1]`.
pub const XYZ_TO_RGB: Matrix = [
    [3.2409699419045213, -1.5373831775700935, -0.4986107602930033],
    [-0.9692436362808798, 1.8759675015077206, 0.04155505740717561],
    [0.05563007969699361, -0.20397695888897657, 1.0569715142428786],
];

/// XYZ of RGB (1, 1, 1) `[1]`: the row sums of [`RGB_TO_XYZ`].
pub const D65: [f64; 3] = row_sums(&RGB_TO_XYZ);

const fn row_sums(m: &Matrix) -> [f64; 3] {
    [m[0][0] + m[0][1] + m[0][2], m[1][0] + m[1][1] + m[1][2], m[2][0] + m[2][1] + m[2][2]]
}

/// The inverse of a matrix.
pub fn inverse(m: &Matrix) -> Result<Matrix> {
    if m == &RGB_TO_XYZ {
        return Ok(XYZ_TO_RGB);
    }
    let minor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
    let size = m.iter().flatten().fold(0.0_f64, |s, x| if x.abs() > s { x.abs() } else { s });
    // NaN fails the comparison as well.
    if !(determinant.abs() > 1e-12 * size * size * size && determinant.is_finite()) {
        return Err(Error::Data { name: "matrix", reason: "must be finite and have an inverse".to_owned() });
    }
    let mut out = [[0.0; 3]; 3];
    for (i, row) in out.iter_mut().enumerate() {
        for (j, x) in row.iter_mut().enumerate() {
            *x = minor(j, i) / determinant;
        }
    }
    Ok(out)
}

#[inline(always)]
fn dot<T: Real>(row: [T; 3], x: [T; 3]) -> T {
    row[0] * x[0] + row[1] * x[1] + row[2] * x[2]
}

fn cast<T: Real>(m: &Matrix) -> [[T; 3]; 3] {
    m.map(|row| row.map(T::of))
}

/// `out = m x` for each pixel.
pub fn transform<T: Real>(job: &Job, x: &[T], out: &mut [T], m: &Matrix) -> Result<()> {
    let m = cast::<T>(m);
    pixels(
        job,
        x,
        out,
        #[inline(always)]
        |x| [dot(m[0], x), dot(m[1], x), dot(m[2], x)],
    )
}

/// `out = weights · x` for each pixel, one element for three.
pub fn luminance<T: Real>(job: &Job, rgb: &[T], out: &mut [T], weights: [f64; 3]) -> Result<()> {
    let w = weights.map(T::of);
    pixels(
        job,
        rgb,
        out,
        #[inline(always)]
        |x| [dot(w, x)],
    )
}

#[inline(always)]
fn hsv_of_rgb<T: Real>([r, g, b]: [T; 3]) -> [T; 3] {
    let zero = T::of(0.0);
    // Comparisons alone would lose a NaN among the channels.
    let nothing = if (r != r) | (g != g) | (b != b) { T::NAN } else { zero };
    // The channels in order, and the hue of the largest less the sign that its neighbours will have: two exchanges
    // in place of three cases.
    let green_first = g >= b;
    let (p, q) = if green_first { (g, b) } else { (b, g) };
    let red_first = r >= p;
    let (high, w) = if red_first { (r, p) } else { (p, r) };
    let from_red = if green_first { zero } else { T::of(-1.0) };
    let from_other = if green_first { T::of(-1.0 / 3.0) } else { T::of(2.0 / 3.0) };
    let origin = if red_first { from_red } else { from_other };
    let low = if q < w { q } else { w };
    let high = high + nothing;
    let d = high - low;
    let h = (origin + (w - q) / (d * T::of(6.0))).magnitude();
    let s = d / high;
    // A grey has h = 0 / 0; a red with a trace of blue can round to a full turn.
    [if h < T::of(1.0) { h } else { nothing }, if high > zero { s } else { nothing }, high]
}

/// Hue in turns, saturation and value of RGB.
pub fn rgb_to_hsv<T: Real>(job: &Job, rgb: &[T], out: &mut [T]) -> Result<()> {
    pixels(job, rgb, out, hsv_of_rgb)
}

#[inline(always)]
fn rgb_of_hsv<T: Real>([h, s, v]: [T; 3]) -> [T; 3] {
    #[inline(always)]
    fn ramp<T: Real>(x: T) -> T {
        let x = if x < T::of(0.0) { T::of(0.0) } else { x };
        if x > T::of(1.0) { T::of(1.0) } else { x }
    }
    let (two, six) = (T::of(2.0), T::of(6.0));
    let h = h - h.floor();
    let amount = v * s;
    // The distances are taken before the factor 6: near the ramps they are small, and so is their rounding.
    let r = ramp(two - six * (h - T::of(0.5)).magnitude());
    let g = ramp(six * (h - T::of(1.0 / 3.0)).magnitude() - T::of(1.0));
    let b = ramp(six * (h - T::of(2.0 / 3.0)).magnitude() - T::of(1.0));
    [v - amount * r, v - amount * g, v - amount * b]
}

/// RGB of hue in turns (any number, wrapped), saturation and value.
pub fn hsv_to_rgb<T: Real>(job: &Job, hsv: &[T], out: &mut [T]) -> Result<()> {
    pixels(job, hsv, out, rgb_of_hsv)
}

#[inline(always)]
fn xyy_of_xyz<T: Real>([x, y, z]: [T; 3], black: [T; 2]) -> [T; 3] {
    let sum = x + y + z;
    let none = sum == T::of(0.0);
    let (u, v) = (x / sum, y / sum);
    [if none { black[0] } else { u }, if none { black[1] } else { v }, y]
}

/// Chromaticity and luminance of XYZ; `black` is the chromaticity where X + Y + Z = 0.
pub fn xyz_to_xyy<T: Real>(job: &Job, xyz: &[T], out: &mut [T], black: [f64; 2]) -> Result<()> {
    let black = black.map(T::of);
    pixels(
        job,
        xyz,
        out,
        #[inline(always)]
        |x| xyy_of_xyz(x, black),
    )
}

/// The chromaticity of XYZ; (0, 0) where X + Y + Z = 0.
pub fn chromaticity([x, y, z]: [f64; 3]) -> [f64; 2] {
    let sum = x + y + z;
    if sum == 0.0 { [0.0; 2] } else { [x / sum, y / sum] }
}

#[inline(always)]
fn xyz_of_xyy<T: Real>([x, y, luminance]: [T; 3]) -> [T; 3] {
    let zero = T::of(0.0);
    let none = y == zero;
    let by = luminance / y;
    let (u, w) = (x * by, (T::of(1.0) - x - y) * by);
    [if none { zero } else { u }, luminance, if none { zero } else { w }]
}

/// XYZ of chromaticity and luminance; (0, Y, 0) where y = 0.
pub fn xyy_to_xyz<T: Real>(job: &Job, xyy: &[T], out: &mut [T]) -> Result<()> {
    pixels(job, xyy, out, xyz_of_xyy)
}

/// The linear part of Lab, both ways: rows that give their white to grey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lab {
    /// Ratios to white of RGB: the sum of the row and the weights of R - G and B - G.
    to: Matrix,
    /// RGB of ratios to white: the sum of the row and the weights of X - Y and Z - Y.
    from: Matrix,
    encoded: bool,
}

impl Lab {
    /// Lab of RGB with this matrix to XYZ, relative to `white` (the row sums of the matrix if none is given). `encoded`:
    /// the RGB side carries the sRGB transfer function.
    pub fn new(matrix: &Matrix, white: Option<[f64; 3]>, encoded: bool) -> Result<Self> {
        let inverse = inverse(matrix)?;
        let sums = row_sums(matrix);
        let w = white.unwrap_or(sums);
        if !w.iter().all(|&x| x > 0.0 && x.is_finite()) {
            return Err(Error::Data { name: "white", reason: format!("must be positive and finite, got {w:?}") });
        }
        let mut to = [[0.0; 3]; 3];
        let mut from = [[0.0; 3]; 3];
        for i in 0..3 {
            to[i] = [sums[i] / w[i], matrix[i][0] / w[i], matrix[i][2] / w[i]];
            let n = [inverse[i][0] * w[0], inverse[i][1] * w[1], inverse[i][2] * w[2]];
            // The inverse of a matrix gives its row sums exactly one; its rounding would tint greys.
            from[i] = [if w == sums { 1.0 } else { n[0] + n[1] + n[2] }, n[0], n[2]];
        }
        Ok(Self { to, from, encoded })
    }
}

#[inline(always)]
fn pivoted<T: Real>(row: [T; 3], [a, pivot, b]: [T; 3]) -> T {
    row[0] * pivot + (row[1] * (a - pivot) + row[2] * (b - pivot))
}

/// The cube root above the knee of Lab, its tangent below.
#[inline(always)]
fn lightness<T: Real>(t: T) -> T {
    let line = t * T::of(841.0 / 108.0) + T::of(4.0 / 29.0);
    // Computed on both sides of the choice: a root behind a branch would not vectorise.
    let root = t.cbrt_normal();
    if t > T::of(216.0 / 24389.0) { root } else { line }
}

#[inline(always)]
fn unlightness<T: Real>(f: T) -> T {
    let line = (f - T::of(4.0 / 29.0)) * T::of(108.0 / 841.0);
    let cube = f * f * f;
    if f > T::of(6.0 / 29.0) { cube } else { line }
}

/// Lab of RGB.
pub fn rgb_to_lab<T: Real>(job: &Job, rgb: &[T], out: &mut [T], lab: &Lab) -> Result<()> {
    let m = cast::<T>(&lab.to);
    let encoded = lab.encoded;
    staged(
        job,
        rgb,
        out,
        #[inline(always)]
        |planes| {
            if encoded {
                alone(planes, decode);
            }
            mix(
                planes,
                #[inline(always)]
                |x| [pivoted(m[0], x), pivoted(m[1], x), pivoted(m[2], x)],
            );
            alone(planes, lightness);
            mix(
                planes,
                #[inline(always)]
                |[x, y, z]| [y * T::of(116.0) - T::of(16.0), (x - y) * T::of(500.0), (y - z) * T::of(200.0)],
            );
        },
    )
}

/// RGB of Lab.
pub fn lab_to_rgb<T: Real>(job: &Job, values: &[T], out: &mut [T], lab: &Lab) -> Result<()> {
    let m = cast::<T>(&lab.from);
    let encoded = lab.encoded;
    staged(
        job,
        values,
        out,
        #[inline(always)]
        |planes| {
            mix(
                planes,
                #[inline(always)]
                |[l, a, b]| {
                    let y = (l + T::of(16.0)) * T::of(1.0 / 116.0);
                    let x = unlightness(y + a * T::of(1.0 / 500.0));
                    let z = unlightness(y - b * T::of(1.0 / 200.0));
                    let t = [x, unlightness(y), z];
                    [pivoted(m[0], t), pivoted(m[1], t), pivoted(m[2], t)]
                },
            );
            if encoded {
                alone(planes, encode);
            }
        },
    )
}

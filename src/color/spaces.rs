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
//! | RGB to HSV on `[0, 1]` | 8e-8 turns, 9e-8, 0 | 2e-16 turns, 2e-16, 0 |
//! | HSV to RGB on `[0, 1]` | 2.3e-7 | 3e-16 |
//! | linear RGB to Lab on `[0, 1]` | 7e-5 ΔE | 3e-13 ΔE |
//! | Lab to linear RGB on `[0, 1]` | 7e-7 | 2e-15 |
//!
//! The tests of this file hold these. Cost: near memory bandwidth for HSV, XYZ and xyY; about 170 vector operations a
//! pixel for encoded RGB to Lab.

use super::transfer::{decode, encode};
use super::{alone, mix, pixels, singles, staged};
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

/// Colours without negative channels: those beyond the primaries go towards grey of their own luminance until the lowest
/// channel is 0 (gamut mapping at constant luminance); light without luminance becomes black, NaN stays NaN.
pub fn into_gamut<T: Real>(job: &Job, rgb: &[T], out: &mut [T]) -> Result<()> {
    let w = [T::of(RGB_TO_XYZ[1][0]), T::of(RGB_TO_XYZ[1][1]), T::of(RGB_TO_XYZ[1][2])];
    pixels(
        job,
        rgb,
        out,
        #[inline(always)]
        |x| {
            let zero = T::of(0.0);
            let y = dot(w, x);
            let low = if x[0] < x[1] { x[0] } else { x[1] };
            let low = if x[2] < low { x[2] } else { low };
            // The fraction of the colour that is left; the lowest channel is then y + t (low - y) = 0.
            let t = if y > zero { y / (y - low) } else { zero };
            let grey = if y > zero { y } else { zero };
            let mapped = [0, 1, 2].map(|c| {
                let v = grey + t * (x[c] - y);
                if v > zero { v } else { zero }
            });
            if low < zero { mapped } else { x }
        },
    )
}

/// `out = weights · x` for each pixel, one element for three.
pub fn luminance<T: Real>(job: &Job, rgb: &[T], out: &mut [T], weights: [f64; 3]) -> Result<()> {
    let w = weights.map(T::of);
    singles(
        job,
        rgb,
        out,
        #[inline(always)]
        |x| dot(w, x),
    )
}

#[inline(always)]
#[allow(clippy::eq_op, clippy::needless_bitwise_bool, reason = "a test for NaN without branches, in either precision")]
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

/// Hue in turns, saturation and value of one colour.
pub fn hsv_of(rgb: [f64; 3]) -> [f64; 3] {
    hsv_of_rgb(rgb)
}

/// RGB of one hue in turns, saturation and value.
pub fn rgb_of(hsv: [f64; 3]) -> [f64; 3] {
    rgb_of_hsv(hsv)
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

/// Luminance of linear RGB.
pub fn luminance_of([r, g, b]: [f64; 3]) -> f64 {
    RGB_TO_XYZ[1][0] * r + RGB_TO_XYZ[1][1] * g + RGB_TO_XYZ[1][2] * b
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
    /// Lab of RGB with this matrix to XYZ, relative to `white` (the row sums of the matrix if none is given).
    /// `encoded`: the RGB side carries the sRGB transfer function.
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

/// The cube root above the knee of Lab; below it the tangent, without its value at 0, 4/29, which would swallow the digits of
/// dark colours. So what is at most 2/29 is a tangent, and what is more than 6/29 a root.
#[inline(always)]
fn lightness<T: Real>(t: T) -> T {
    let line = t * T::of(841.0 / 108.0);
    // Computed on both sides of the choice: a root behind a branch would not vectorise.
    let root = t.cbrt_normal();
    if t > T::of(216.0 / 24389.0) { root } else { line }
}

#[inline(always)]
fn unlightness<T: Real>(f: T) -> T {
    let line = f * T::of(108.0 / 841.0);
    let whole = f + T::of(4.0 / 29.0);
    let cube = whole * whole * whole;
    if f > T::of(2.0 / 29.0) { cube } else { line }
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
                |[x, y, z]| {
                    let (knee, zero) = (T::of(4.0 / 29.0), T::of(0.0));
                    let [ox, oy, oz] = [x, y, z].map(|f| if f > knee { knee } else { zero });
                    let offset = if y > knee { T::of(16.0) } else { zero };
                    let (red, blue) = ((x - y) + (oy - ox), (y - z) + (oz - oy));
                    [y * T::of(116.0) - offset, red * T::of(500.0), blue * T::of(200.0)]
                },
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
                    let y = l * T::of(1.0 / 116.0);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of `[0, 1]^3`: a grid with its faces, and a low-discrepancy sequence.
    fn cube() -> Vec<f64> {
        let mut out = Vec::new();
        for i in 0..17 * 17 * 17 {
            out.extend([i % 17, i / 17 % 17, i / 289].map(|k| f64::from(k) / 16.0));
        }
        for i in 1..=200_000 {
            let i = f64::from(i);
            out.extend(
                [i * 0.819_172_513_396_164_4, i * 0.671_043_606_703_789_3, i * 0.549_700_477_901_970_2].map(f64::fract),
            );
        }
        out
    }

    type Call<'a, T> = &'a dyn Fn(&[T], &mut [T]) -> Result<()>;

    /// Largest error of each channel against `exact`, and the largest distance, over `input` rounded to `T`.
    fn worst<T: Real + Into<f64>>(input: &[f64], call: Call<'_, T>, exact: impl Fn([f64; 3]) -> [f64; 3]) -> [f64; 4] {
        let x: Vec<T> = input.iter().map(|&x| T::of(x)).collect();
        let mut y = vec![T::of(0.0); x.len()];
        call(&x, &mut y).expect("the lengths agree");
        let mut out = [0.0_f64; 4];
        for (p, q) in x.as_chunks::<3>().0.iter().zip(y.as_chunks::<3>().0) {
            let want = exact(p.map(Into::into));
            let d = [0, 1, 2].map(|c| (q[c].into() - want[c]).abs());
            for c in 0..3 {
                out[c] = out[c].max(d[c]);
            }
            out[3] = out[3].max((d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt());
        }
        out
    }

    fn exact_hsv([r, g, b]: [f64; 3]) -> [f64; 3] {
        let (high, low) = (r.max(g).max(b), r.min(g).min(b));
        let d = high - low;
        let h = if d == 0.0 {
            0.0
        } else if high == r {
            (g - b) / d
        } else if high == g {
            2.0 + (b - r) / d
        } else {
            4.0 + (r - g) / d
        };
        [(h / 6.0).rem_euclid(1.0), if high > 0.0 { d / high } else { 0.0 }, high]
    }

    fn exact_rgb([h, s, v]: [f64; 3]) -> [f64; 3] {
        [5.0, 3.0, 1.0].map(|n: f64| {
            let k = (n + 6.0 * h).rem_euclid(6.0);
            v - v * s * k.min(4.0 - k).clamp(0.0, 1.0)
        })
    }

    fn exact_lab(rgb: [f64; 3]) -> [f64; 3] {
        let f = [0, 1, 2].map(|i| {
            let t = dot(RGB_TO_XYZ[i], rgb) / D65[i];
            if t > 216.0 / 24389.0 { t.cbrt() } else { 841.0 / 108.0 * t + 4.0 / 29.0 }
        });
        [116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])]
    }

    fn exact_from_lab([l, a, b]: [f64; 3]) -> [f64; 3] {
        let y = (l + 16.0) / 116.0;
        let t = [y + a / 500.0, y, y - b / 200.0];
        let t = t.map(|f| if f > 6.0 / 29.0 { f.powi(3) } else { (f - 4.0 / 29.0) * 108.0 / 841.0 });
        XYZ_TO_RGB.map(|row| dot(row, [t[0] * D65[0], t[1] * D65[1], t[2] * D65[2]]))
    }

    fn held<T: Real + Into<f64>>(bounds: [[f64; 3]; 2], distances: [f64; 2]) {
        let job = Job::serial();
        let cube = cube();
        let lab = Lab::new(&RGB_TO_XYZ, None, false).expect("the default");
        let hsv = worst::<T>(&cube, &|x, y| rgb_to_hsv(&job, x, y), exact_hsv);
        let rgb = worst::<T>(&cube, &|x, y| hsv_to_rgb(&job, x, y), exact_rgb);
        let there = worst::<T>(&cube, &|x, y| rgb_to_lab(&job, x, y, &lab), exact_lab);
        let colours: Vec<f64> = cube.as_chunks::<3>().0.iter().flat_map(|&p| exact_lab(p)).collect();
        let back = worst::<T>(&colours, &|x, y| lab_to_rgb(&job, x, y, &lab), exact_from_lab);
        println!("HSV {hsv:?}\nRGB {rgb:?}\nLab {there:?}\nfrom Lab {back:?}");
        for c in 0..3 {
            assert!(hsv[c] <= bounds[0][c], "HSV, channel {c}: {:e}", hsv[c]);
            assert!(rgb[c] <= bounds[1][c], "RGB, channel {c}: {:e}", rgb[c]);
            assert!(back[c] <= distances[1], "from Lab, channel {c}: {:e}", back[c]);
        }
        assert!(there[3] <= distances[0], "Lab: {:e}", there[3]);
    }

    #[test]
    fn single_precision_is_within_its_error_bounds() {
        held::<f32>([[8e-8, 9e-8, 0.0], [2.3e-7; 3]], [7e-5, 7e-7]);
    }

    #[test]
    fn double_precision_is_within_its_error_bounds() {
        held::<f64>([[2e-16, 2e-16, 0.0], [3e-16; 3]], [3e-13, 2e-15]);
    }

    #[test]
    fn the_matrices_are_inverse_and_the_sums_are_the_white() {
        for (i, row) in RGB_TO_XYZ.iter().enumerate() {
            for j in 0..3 {
                let product = dot(*row, [XYZ_TO_RGB[0][j], XYZ_TO_RGB[1][j], XYZ_TO_RGB[2][j]]);
                assert!((product - f64::from(u8::from(i == j))).abs() < 4e-16, "row {i}, column {j}: {product}");
            }
        }
        let [x, y] = chromaticity(D65);
        assert!((x - 0.3127).abs() < 1e-15 && (y - 0.3290).abs() < 1e-15, "the white of Rec. 709: {x} {y}");
        let general = inverse(&[[2.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 8.0, 0.0]]).expect("it has an inverse");
        assert_eq!(general, [[0.5, 0.0, 0.0], [0.0, 0.0, 0.125], [0.0, 0.25, 0.0]], "by hand");
        assert!(inverse(&[[1.0; 3]; 3]).is_err(), "singular");
        assert!(inverse(&[[f64::NAN; 3]; 3]).is_err(), "not finite");
        assert!(Lab::new(&RGB_TO_XYZ, Some([0.0, 1.0, 1.0]), false).is_err(), "a white without X");
    }

    #[test]
    fn every_length_is_covered() {
        // Around the sizes of the blocks and of the chunks, each pixel gets its own colour.
        for pixels in [1, 63, 64, 65, 255, 257, 8191, 8193] {
            let x: Vec<f32> = (0..3 * pixels).map(|i| (i % 251) as f32 / 250.0).collect();
            let mut y = vec![f32::NAN; x.len()];
            rgb_to_hsv(&Job::serial(), &x, &mut y).expect("the lengths agree");
            let mut z = vec![f32::NAN; x.len()];
            let lab = Lab::new(&RGB_TO_XYZ, None, false).expect("the default");
            rgb_to_lab(&Job::serial(), &x, &mut z, &lab).expect("the lengths agree");
            for (i, p) in x.as_chunks::<3>().0.iter().enumerate() {
                let want = exact_hsv(p.map(f64::from));
                assert!((f64::from(y[3 * i + 2]) - want[2]).abs() < 1e-6, "HSV of pixel {i} of {pixels}");
                let want = exact_lab(p.map(f64::from));
                assert!((f64::from(z[3 * i]) - want[0]).abs() < 1e-3, "Lab of pixel {i} of {pixels}");
            }
        }
        assert!(rgb_to_hsv(&Job::serial(), &[0.0_f32; 4], &mut [0.0; 4]).is_err(), "not whole pixels");
    }
}

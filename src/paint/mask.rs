//! The procedural alpha mask of a brush stroke (thesis IV.4.4, Figs 17-20): gradient noise on the stroke's own
//! coordinates, times an edge that falls to zero at the border, through a smooth step.
//!
//! With `s`, `t` in `[0, 1]` across the sprite: `n = min(1, 0.5 + a noise((s - 1/2) f_s, (t - 1/2) f_t))`, scaled about
//! the centre so that a change of frequency does not make the stroke swim; `e = (sin(pi s) cos(pi (t - 1/2)))^p` with
//! `p = ln(fullness) / ln(1/2)`, which is Perlin's bias and keeps the product separable; `alpha = opacity
//! smoothstep(min, max, n e)`. The thesis' Fig. 19 (the code) is lost, so the noise is ours: gradient noise in two
//! dimensions whose gradients fill the square `[-1, 1]^2`, quintic fade, mean 1/2, at most 1 in size, exactly.
//!
//! Where a cell of the lattice is below two pixels the noise fades to its mean and is gone at one pixel: what the
//! pixels cannot carry would only shimmer.
//!
//! On an upright sprite everything that depends on the column only is computed once, and each row of the lattice once
//! for all the picture's rows in it: four products for each pixel are left of the noise. A twisted sprite pays for the
//! whole. Both agree with [`alpha`], the plain formula in `f64`, within 2e-5 (tests of this file).

use crate::error::Result;
use crate::job::Job;
use crate::math::elementary::Real;
use crate::math::interpolation::{hermite_step, smoothstep};
use crate::math::logarithm::ln;
use crate::math::noise::mix32;

/// Lanes of a group.
pub(super) const GROUP: usize = 8;
/// Most groups of a row of a tile, and one more because a sprite's groups begin at its own first pixel.
pub(super) const GROUPS: usize = 9;

/// One number for each lane.
pub(super) type Lane<T> = [T; GROUP];

const COLUMN: u32 = 0x8DA6_B343;
const ROW: u32 = 0xD816_3841;
const MIX: [u32; 2] = [0x7FEB_352D, 0x846C_A68B];
/// Tells the noise of colours from the noise of masks.
const OTHER: u32 = 0x9E37_79B9;
/// `2^-31`, which turns a hash into a number in `[-1, 1)`.
const UNIT: f32 = 1.0 / 2_147_483_648.0;

/// Everything about one mask that does not depend on the pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mask {
    /// Cells across the sprite, along `s` and `t` \[1\].
    pub frequency: [f32; 2],
    /// Seed of the noise.
    pub key: u32,
    /// `ln(fullness) / ln(1/2)`.
    pub power: f32,
    /// Noise times edge below which nothing is painted, and the width of the step to full paint \[1\].
    pub feather: [f32; 2],
    /// Largest opacity \[1\].
    pub opacity: f32,
    /// Fraction of the sprite's height that the edge leaves, 1 for all of it \[1\].
    pub foreshortening: f32,
    /// Strength of the noise, 1 where the pixels can carry it \[1\].
    pub carried: f32,
}

/// Shape of the masks, which [`shade`](super::stroke::shade) does not choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaskShape {
    /// Bias of the edge \[1\].
    pub fullness: f32,
    /// Noise below which there is no paint, and above which it is full \[1\].
    pub feather: [f32; 2],
}

/// Power of an edge of this fullness (S9).
pub fn power_of(fullness: f64) -> f32 {
    (fullness.ln() / 0.5_f64.ln()) as f32
}

/// Where a feather begins and how wide it is, from its ends.
pub fn feather_of([low, high]: [f32; 2]) -> [f32; 2] {
    [low, high - low]
}

/// How much of a noise with cells of this size \[px\] the pixels can carry: all from 2 on, nothing below 1.
pub fn carried(cell: f64) -> f64 {
    smoothstep(1.0, 2.0, cell)
}

#[inline(always)]
fn fade<T: Real>(t: T) -> T {
    t * t * t * (t * (t * T::of(6.0) - T::of(15.0)) + T::of(10.0))
}

/// Gradient of a corner of the lattice, in `[-2^31, 2^31)`.
#[inline(always)]
fn gradient(column: u32, row: u32) -> [f32; 2] {
    let h = (column ^ row).wrapping_mul(MIX[0]);
    let h = (h ^ (h >> 15)).wrapping_mul(MIX[1]);
    [h as i32 as f32, (h << 16) as i32 as f32]
}

/// Where the sprite's centre lies in its lattice, so that no place of the lattice is every stroke's centre.
#[inline(always)]
pub(super) fn origin(key: u32) -> [f32; 2] {
    let h = mix32(key ^ OTHER);
    [(h >> 16) as f32 * (1.0 / 65536.0), (h & 0xffff) as f32 * (1.0 / 65536.0)]
}

/// Noise of a key at a point, in `[-1, 1]`: the plain formula.
pub fn noise(key: u32, u: f64, v: f64) -> f64 {
    let [o, w] = origin(key).map(f64::from);
    let (u, v) = (u + o, v + w);
    let (i, j) = (u.floor(), v.floor());
    let (x, y) = (u - i, v - j);
    let hash = |k: f64, factor: u32| (k as i64 as u32).wrapping_mul(factor);
    let corner = |a: f64, b: f64| {
        let [gx, gy] = gradient(hash(i + a, COLUMN) ^ key, hash(j + b, ROW)).map(|g| f64::from(g) * f64::from(UNIT));
        gx * (x - a) + gy * (y - b)
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let (fx, fy) = (fade(x), fade(y));
    mix(mix(corner(0.0, 0.0), corner(1.0, 0.0), fx), mix(corner(0.0, 1.0), corner(1.0, 1.0), fx), fy)
}

/// Key of the noise that varies the colour within a stroke.
pub(super) fn colour_key(key: u32) -> u32 {
    mix32(key.wrapping_add(OTHER))
}

/// Opacity at `(s, t)`: the plain formula (S7-S11).
pub fn alpha(mask: &Mask, s: f64, t: f64) -> f64 {
    // The edge's own height, tightened about the middle.
    let e = (t - 0.5) / f64::from(mask.foreshortening);
    if !(s > 0.0 && s < 1.0 && e.abs() < 0.5) {
        return 0.0;
    }
    let edge = ((std::f64::consts::PI * s).sin() * (std::f64::consts::PI * e).cos()).powf(f64::from(mask.power));
    let [f, g] = mask.frequency.map(f64::from);
    let n = 0.5 + f64::from(mask.carried) * noise(mask.key, (s - 0.5) * f, (t - 0.5) * g);
    let m = n.min(1.0) * edge - f64::from(mask.feather[0]);
    let width = f64::from(mask.feather[1]);
    let x = if width > 0.0 { (m / width).clamp(0.0, 1.0) } else { f64::from(u8::from(m > 0.0)) };
    // Not `hermite_step(x)`: opacity is multiplied in first, and the bits of the oracle stay.
    f64::from(mask.opacity) * x * x * (3.0 - 2.0 * x)
}

/// [`alpha`] at points, `s, t` in turn.
pub fn alphas(job: &Job, mask: &Mask, at: &[f64], out: &mut [f64]) -> Result<()> {
    at_points(job, at, out, |s, t| alpha(mask, s, t))
}

/// [`noise`] at points, `u, v` in turn.
pub fn noises(job: &Job, key: u32, at: &[f64], out: &mut [f64]) -> Result<()> {
    at_points(job, at, out, |u, v| noise(key, u, v))
}

fn at_points(job: &Job, at: &[f64], out: &mut [f64], value: impl Fn(f64, f64) -> f64 + Sync) -> Result<()> {
    const CHUNK: usize = 1024;
    job.chunks(out, CHUNK, |chunk, out| {
        for (k, out) in out.iter_mut().enumerate() {
            let i = 2 * (CHUNK * chunk + k);
            *out = value(at[i], at[i + 1]);
        }
        Ok(())
    })
}

/// Noise of an upright sprite over a run of columns, row by row of the lattice.
#[derive(Debug, Clone)]
pub(super) struct Lattice {
    from_left: [Lane<f32>; GROUPS],
    faded: [Lane<f32>; GROUPS],
    column: [[Lane<u32>; GROUPS]; 2],
    /// For each of two neighbouring rows: the part that the columns make, and the part that grows down the row.
    rows: [[[Lane<f32>; GROUPS]; 2]; 2],
    held: [i32; 2],
    down: f32,
}

impl Lattice {
    pub(super) fn new() -> Self {
        let zero = [[0.0; GROUP]; GROUPS];
        Self {
            from_left: zero,
            faded: zero,
            column: [[[0; GROUP]; GROUPS]; 2],
            rows: [[zero; 2]; 2],
            held: [i32::MIN; 2],
            down: 0.0,
        }
    }

    /// Begin with `groups` groups of columns whose first has `s - 1/2 = first`, `step` apart.
    #[inline(always)]
    pub(super) fn begin(&mut self, key: u32, frequency: f32, first: f32, step: f32, groups: usize) {
        let [o, down] = origin(key);
        self.down = down;
        self.held = [i32::MIN; 2];
        for k in 0..groups {
            let at = (k * GROUP) as f32;
            for i in 0..GROUP {
                let u = (first + (at + i as f32) * step) * frequency + o;
                let (cell, c) = cell(u);
                let x = u - cell;
                self.from_left[k][i] = x;
                self.faded[k][i] = fade(x);
                self.column[0][k][i] = c.wrapping_mul(COLUMN) ^ key;
                self.column[1][k][i] = c.wrapping_add(1).wrapping_mul(COLUMN) ^ key;
            }
        }
    }

    #[inline(always)]
    fn hold(&mut self, row: i32, groups: usize) {
        let slot = (row & 1) as usize;
        if self.held[slot] == row {
            return;
        }
        self.held[slot] = row;
        let hash = (row as u32).wrapping_mul(ROW);
        let [along, down] = &mut self.rows[slot];
        for k in 0..groups {
            for i in 0..GROUP {
                let [a, b] = gradient(self.column[0][k][i], hash);
                let [c, d] = gradient(self.column[1][k][i], hash);
                let (x, f) = (self.from_left[k][i], self.faded[k][i]);
                let (a, c) = (a * x, c * (x - 1.0));
                along[k][i] = a + (c - a) * f;
                down[k][i] = b + (d - b) * f;
            }
        }
    }

    /// Make ready the rows of the lattice around `(t - 1/2) f_t = v`; returns the factors for [`at`](Self::at).
    #[inline(always)]
    pub(super) fn row(&mut self, v: f32, strength: f32, groups: usize) -> ([f32; 4], [usize; 2]) {
        let v = v + self.down;
        let (cell, j) = cell(v);
        let (y, j) = (v - cell, j as i32);
        self.hold(j, groups);
        self.hold(j.wrapping_add(1), groups);
        let w = fade(y);
        let (p, q) = ((1.0 - w) * strength * UNIT, w * strength * UNIT);
        let slot = (j & 1) as usize;
        ([p, p * y, q, q * (y - 1.0)], [slot, 1 - slot])
    }

    /// Noise of one group of the row.
    #[inline(always)]
    pub(super) fn at(&self, k: usize, ([a, b, c, d], [p, q]): ([f32; 4], [usize; 2])) -> Lane<f32> {
        let (low, high) = (&self.rows[p], &self.rows[q]);
        let mut out = [0.0; GROUP];
        for i in 0..GROUP {
            out[i] = (a * low[0][k][i] + b * low[1][k][i]) + (c * high[0][k][i] + d * high[1][k][i]);
        }
        out
    }
}

/// The edge along `s` of an upright sprite: `sin(pi s)^p` for `s - 1/2 = x`, 0 outside.
#[inline(always)]
pub(super) fn edge(x: f32, p: f32) -> f32 {
    power(cosine(x), p)
}

/// `cos(pi x)` for `x` in `[-1/2, 1/2]`, exactly zero from the ends on.
#[inline(always)]
fn cosine(x: f32) -> f32 {
    let z = x * x;
    // Chebyshev interpolant of cos(pi x) / (1/4 - x^2) in x^2: the zeros are exact, the relative error is below 3e-7.
    let p = 3.999_999_3 + z * (-3.739_113_4 + z * (1.276_100_1 - z * 0.216_654_4));
    // Not 1/4 - z, which would cancel at the ends.
    let q = (0.5 - x) * (0.5 + x);
    if q > 0.0 { q * p } else { 0.0 }
}

/// Opacity of `noise` times `edge` (S10, S11).
#[inline(always)]
pub(super) fn threshold(noise: f32, edge: f32, low: f32, steep: f32, opacity: f32) -> f32 {
    let n = 0.5 + noise;
    let n = if n < 1.0 { n } else { 1.0 };
    let x = (n * edge - low) * steep;
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < 1.0 { x } else { 1.0 };
    opacity * hermite_step(x)
}

/// Noise of pixels of a twisted sprite.
#[inline(always)]
pub(super) fn twisted<const N: usize>(key: u32, origin: [f32; 2], u: &[f32; N], v: &[f32; N]) -> [f32; N] {
    let mut out = [0.0; N];
    for i in 0..N {
        let (u, v) = (u[i] + origin[0], v[i] + origin[1]);
        let ((ci, i_bits), (cj, j_bits)) = (cell(u), cell(v));
        let (x, y) = (u - ci, v - cj);
        let (a, c) = (i_bits.wrapping_mul(COLUMN), j_bits.wrapping_mul(ROW));
        let (b, d) = (a.wrapping_add(COLUMN) ^ key, c.wrapping_add(ROW));
        let a = a ^ key;
        let (g00, g10, g01, g11) = (gradient(a, c), gradient(b, c), gradient(a, d), gradient(b, d));
        let (f, w) = (fade(x), fade(y));
        let (p, q) = (g00[0] * x, g10[0] * (x - 1.0));
        let low = (p + (q - p) * f) + (g00[1] + (g10[1] - g00[1]) * f) * y;
        let (p, q) = (g01[0] * x, g11[0] * (x - 1.0));
        let high = (p + (q - p) * f) + (g01[1] + (g11[1] - g01[1]) * f) * (y - 1.0);
        out[i] = (low + (high - low) * w) * UNIT;
    }
    out
}

/// The edge of a twisted sprite, for `s - 1/2` and `(t - 1/2) / foreshortening`.
#[inline(always)]
pub(super) fn twisted_edge(x: f32, y: f32, p: f32) -> f32 {
    power(cosine(x) * cosine(y), p)
}

/// The cell a coordinate below `2^22` lies in, as a float and as bits. On a border it may be either of the two, where
/// noise is the same from both.
#[inline(always)]
fn cell(x: f32) -> (f32, u32) {
    const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23
    let shifted = (x - 0.5) + MAGIC;
    (shifted - MAGIC, shifted.to_bits().wrapping_sub(MAGIC.to_bits()))
}

/// `x^p` for `x` in `[0, 1]` and `p` in `[0, 40]`, 0 below 1e-30; relative error below `p` 1e-6.
#[inline(always)]
fn power(x: f32, p: f32) -> f32 {
    let some = if x > 1e-30 { x } else { 1e-30 };
    let y = decay(-p * ln(some));
    if x > 1e-30 { y } else { 0.0 }
}

/// `e^-x` for `x` in `[0, 87]`, clamped: [`exp`](crate::math::elementary::exp) without the ends of the range, for which
/// these loops have no time.
#[inline(always)]
pub(super) fn decay(x: f32) -> f32 {
    const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < 87.0 { x } else { 87.0 };
    let shifted = x * -std::f32::consts::LOG2_E + MAGIC;
    let k = shifted - MAGIC;
    let r = (-x - k * 0.693_359_4) + k * 2.121_944_4e-4;
    let z = r * r;
    let p = (0.5 + r * 1.666_666_5e-1)
        + z * ((4.166_579_6e-2 + r * 8.333_452e-3) + z * (1.398_199_95e-3 + r * 1.987_569_15e-4));
    let y = 1.0 + (r + z * p);
    let n = shifted.to_bits().wrapping_sub(MAGIC.to_bits());
    f32::from_bits(y.to_bits().wrapping_add(n << 23))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_edges_and_decay_are_within_their_bounds() {
        let (mut worst, mut turned, mut fallen) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..=20_000 {
            let x = f64::from((f64::from(k) / 20_000.0 - 0.5) as f32);
            let c = if x.abs() < 0.5 { (std::f64::consts::PI * x).cos() } else { 0.0 };
            for p in [0.1, 0.32, 1.0, 2.5] {
                worst = worst.max((f64::from(edge(x as f32, p as f32)) - c.powf(p)).abs());
                let both = f64::from(twisted_edge(x as f32, 0.25, p as f32));
                turned = turned.max((both - (c * 0.5_f64.sqrt()).powf(p)).abs());
            }
            let y = f64::from(k) * 1e-3;
            fallen = fallen.max((f64::from(decay(y as f32)) / (-f64::from(y as f32)).exp() - 1.0).abs());
        }
        assert!(worst < 1e-6 && turned < 1e-6, "edge {worst:e}, {turned:e}");
        assert!(fallen < 2e-7, "decay {fallen:e}");
        for x in [-0.5, 0.5, 0.6, -3.0, 1e6] {
            assert_eq!(edge(x, 0.3), 0.0, "exactly nothing from the border on: {x}");
        }
        assert_eq!(decay(0.0), 1.0, "exact");
        assert!((edge(0.0, 0.3) - 1.0).abs() < 3e-7, "full in the middle");
    }

    #[test]
    fn the_lattice_by_rows_and_the_whole_noise_are_the_plain_formula() {
        let mut lattice = Lattice::new();
        let mut worst = 0.0_f64;
        for key in [1, 77, 0xdead_beef] {
            let (frequency, first, step) = (5.0_f32, -0.5_f32, 1.0 / 40.0);
            lattice.begin(key, frequency, first, step, 5);
            for row in 0..40 {
                let v = (row as f32 / 40.0 - 0.5) * 7.0;
                let factors = lattice.row(v, 1.0, 5);
                for k in 0..5 {
                    let got = lattice.at(k, factors);
                    let u: Lane<f32> = std::array::from_fn(|i| (first + (k * GROUP + i) as f32 * step) * frequency);
                    let whole = twisted(key, origin(key), &u, &[v; GROUP]);
                    for i in 0..GROUP {
                        let exact = noise(key, f64::from(u[i]), f64::from(v));
                        worst = worst.max((f64::from(got[i]) - exact).abs()).max((f64::from(whole[i]) - exact).abs());
                    }
                }
            }
        }
        assert!(worst < 2e-6, "error {worst:e}");
    }

    #[test]
    fn pixels_carry_what_they_can() {
        assert_eq!((carried(0.5), carried(1.0), carried(2.0), carried(f64::INFINITY)), (0.0, 0.0, 1.0, 1.0), "ends");
        assert!(
            (1..100).all(|k| carried(1.0 + f64::from(k) / 100.0) >= carried(0.99 + f64::from(k) / 100.0)),
            "monotone"
        );
    }
}

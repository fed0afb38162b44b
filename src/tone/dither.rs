//! Dither of 8-bit levels by triangular blue noise: no banding (contour lines) in skies (floor 2).
//!
//! Noise of one tile of 64 x 64 ranks by void and cluster (Ulichney 1993), which has no low frequencies, so the eye sees
//! neither it nor a contour. Its distribution is a triangle of two levels' width, by which mean and variance of the error
//! do not depend on the value (Lipshitz, Wannamaker and Vanderkooy 1992). Below level 1 and above 254, where a triangle
//! would be cut, it is a rectangle of one level: the mean stays right, and black stays black. Each channel has the tile at
//! a place of its own. Deterministic: the noise depends on the pixel's place alone.
//!
//! Units: linear light in `[0, 1]` \[1\] to levels. Error of the mean over a tile below 0.01 levels
//! (`the_mean_of_a_tile_is_the_value`). Cost: 30 ms for the tile, once; 2 ns a number.

use std::sync::OnceLock;

use crate::color::transfer::encode;
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::elementary::exp64;
use crate::math::lanes;
use crate::math::noise::mix32;

/// Side of the tile \[px\].
const SIDE: usize = 64;
const AREA: usize = SIDE * SIDE;
/// Where the tile begins for each channel \[px\].
const SHIFT: [[usize; 2]; 3] = [[0, 0], [21, 37], [43, 11]];
/// Width of the filter by which voids and clusters are found \[px\].
const SIGMA: f64 = 1.9;

/// Energy of a pattern of points on a torus.
struct Pattern {
    /// What a point adds at each offset.
    filter: Vec<f64>,
    on: Vec<bool>,
    energy: Vec<f64>,
}

impl Pattern {
    fn new() -> Self {
        let square = |i: usize| (i.min(SIDE - i) * i.min(SIDE - i)) as f64;
        let filter = (0..AREA).map(|k| exp64(-(square(k / SIDE) + square(k % SIDE)) / (2.0 * SIGMA * SIGMA))).collect();
        Self { filter, on: vec![false; AREA], energy: vec![0.0; AREA] }
    }

    fn set(&mut self, at: usize, on: bool) {
        self.on[at] = on;
        let sign = if on { 1.0 } else { -1.0 };
        let (y, x) = (at / SIDE, at % SIDE);
        for (j, row) in self.energy.as_chunks_mut::<SIDE>().0.iter_mut().enumerate() {
            let filter = &self.filter[((j + SIDE - y) % SIDE) * SIDE..][..SIDE];
            for (i, e) in row.iter_mut().enumerate() {
                *e += sign * filter[(i + SIDE - x) % SIDE];
            }
        }
    }

    /// The point with most of the others around it, or the gap with fewest.
    fn extreme(&self, on: bool) -> usize {
        let mut best = AREA;
        for k in (0..AREA).filter(|&k| self.on[k] == on) {
            let better = |b: usize| {
                if on { self.energy[k] > self.energy[b] } else { self.energy[k] < self.energy[b] }
            };
            if best == AREA || better(best) {
                best = k;
            }
        }
        best
    }
}

/// Ranks of a tile.
fn void_and_cluster() -> Vec<usize> {
    let mut start = Pattern::new();
    let points = AREA / 10;
    let mut key = 0_u32;
    while start.on.iter().filter(|&&x| x).count() < points {
        let at = mix32(key) as usize % AREA;
        key += 1;
        if !start.on[at] {
            start.set(at, true);
        }
    }
    // Points move from clusters to voids until they would come back.
    for _ in 0..AREA {
        let cluster = start.extreme(true);
        start.set(cluster, false);
        let void = start.extreme(false);
        start.set(void, true);
        if void == cluster {
            break;
        }
    }
    let mut rank = vec![0; AREA];
    let kept = (start.on.clone(), start.energy.clone());
    for k in (0..points).rev() {
        let at = start.extreme(true);
        start.set(at, false);
        rank[at] = k;
    }
    (start.on, start.energy) = kept;
    for k in points..AREA {
        let at = start.extreme(false);
        start.set(at, true);
        rank[at] = k;
    }
    rank
}

/// Noise of a pixel: triangular in `[-1, 1]`, and rectangular in `[-1/2, 1/2]`, of the same rank.
type Noise = [[f32; SIDE]; SIDE];

fn tile() -> &'static [Noise] {
    static TILE: OnceLock<Vec<Noise>> = OnceLock::new();
    TILE.get_or_init(|| {
        let mut out = vec![[[0.0; SIDE]; SIDE]; 2];
        for (k, rank) in void_and_cluster().into_iter().enumerate() {
            let u = (rank as f64 + 0.5) / AREA as f64;
            let triangle = if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() };
            out[0][k / SIDE][k % SIDE] = triangle as f32;
            out[1][k / SIDE][k % SIDE] = (u - 0.5) as f32;
        }
        out
    })
}

/// Dithered sRGB levels of linear light: rows of `width` pixels of `channels` numbers, 1 or 3. NaN becomes 0.
pub fn levels(job: &Job, light: &[f32], out: &mut [u8], width: usize, channels: usize) -> Result<()> {
    if light.len() != out.len() || width == 0 || !light.len().is_multiple_of(width * channels) || channels > SHIFT.len()
    {
        let expected = format!("({}, {width}, {channels})", light.len());
        return Err(Error::Shape { name: "out", expected, got: format!("({},)", out.len()) });
    }
    let (triangle, rectangle) = (&tile()[0], &tile()[1]);
    let row = width * channels;
    job.chunks(out, row, |y, out| {
        let light = &light[y * row..(y + 1) * row];
        let (mut wide, mut narrow) = ([[0.0_f32; SIDE]; 3], [[0.0_f32; SIDE]; 3]);
        for c in 0..channels {
            for x in 0..SIDE {
                let (j, i) = ((y + SHIFT[c][0]) % SIDE, (x + SHIFT[c][1]) % SIDE);
                (wide[c][x], narrow[c][x]) = (triangle[j][i], rectangle[j][i]);
            }
        }
        // In the order of the numbers of a tile's row.
        let (mut long, mut short) = ([0.0_f32; 3 * SIDE], [0.0_f32; 3 * SIDE]);
        for k in 0..channels * SIDE {
            (long[k], short[k]) = (wide[k % channels][k / channels], narrow[k % channels][k / channels]);
        }
        lanes::run(
            #[inline(always)]
            || {
                for (out, light) in out.chunks_mut(channels * SIDE).zip(light.chunks(channels * SIDE)) {
                    for (((o, &x), &t), &r) in out.iter_mut().zip(light).zip(&long).zip(&short) {
                        let x = if x > 0.0 { x } else { 0.0 };
                        let v = encode(if x < 1.0 { x } else { 1.0 }) * 255.0;
                        let end = if v < 127.5 { v } else { 255.0 - v };
                        // Adding 2^23 rounds; the level is in the low bits.
                        let v = v + if end >= 1.0 { t } else { r };
                        let v = if v > 0.0 { v } else { 0.0 };
                        *o = (v + 8_388_608.0).to_bits() as u8;
                    }
                }
            },
        );
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::transfer::decode;

    #[test]
    fn the_mean_of_a_tile_is_the_value() {
        for value in [0.0, 0.02, 0.4, 0.97, 1.0, 1.3, 17.5, 100.25, 253.9, 254.0, 254.6, 255.0_f64] {
            let light = vec![decode(value / 255.0) as f32; 3 * AREA];
            let mut out = vec![0; light.len()];
            levels(&Job::serial(), &light, &mut out, SIDE, 3).expect("same length");
            for c in 0..3 {
                let mean = out.iter().skip(c).step_by(3).map(|&x| f64::from(x)).sum::<f64>() / AREA as f64;
                assert!((mean - value).abs() < 0.01, "{value}: {mean}");
            }
        }
    }

    #[test]
    fn the_noise_is_blue() {
        // Power at low frequencies against the mean: by sums over blocks, whose variance white noise would divide by
        // their area alone.
        let triangle = &tile()[0];
        let variance = triangle.as_flattened().iter().map(|x| f64::from(x * x)).sum::<f64>() / AREA as f64;
        assert!((variance - 1.0 / 6.0).abs() < 1e-4, "of a triangle: {variance}");
        let mut blocks = 0.0;
        for block in 0..64 {
            let (y, x) = (block / 8 * 8, block % 8 * 8);
            let mean = (0..64).map(|k| f64::from(triangle[y + k / 8][x + k % 8])).sum::<f64>() / 64.0;
            blocks += mean * mean / 64.0;
        }
        assert!(blocks < 0.1 * variance / 64.0, "{} of white noise", blocks / (variance / 64.0));
        let mut seen = vec![false; AREA];
        for r in void_and_cluster() {
            seen[r] = true;
        }
        assert!(seen.iter().all(|&x| x), "every rank once");
    }
}

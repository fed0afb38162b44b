//! The sky behind the clouds of a photograph (floor 1): inpainting along the gradient of a clear sky.
//!
//! Dobashi et al. 2012, §4.1, fill what clouds hide by Laplace's equation. A membrane is flat where a sky is not, and takes
//! the wisps around a cloud for sky. So a smooth surface of the logarithm of light, a cubic from bottom to top that tilts and
//! bends from side to side, is fitted to the sky by weighted least squares (Geman and McClure's weights, which leave outliers
//! out), wisps paler than a like surface of the colour by more than three deviations of its noise count as hidden, and
//! Laplace's equation is solved for what light and surface differ by ([`fill`](super::laplace::fill)).
//!
//! Linear light in and out. Error: `test_the_sky_behind_is_the_sky` (median below 4 % behind clouds of scenes whose sky is
//! known).

use super::blur::blur;
use super::grow::dilate;
use super::laplace::fill;
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::elementary;
use crate::math::least_squares::{NormalEquations, centered};

/// Wisps differ from the smooth sky by more than this many deviations of its noise, and by at least so much \[1\].
const DEVIATIONS: f64 = 3.0;
const LEAST: f64 = 0.01;
const ROUNDS: usize = 4;
/// Pixels of a side on which the smooth sky is fitted.
const GRID: usize = 96;
/// Pixels that a sky must have for its wisps to be told, and samples that are left of them.
const FEWEST: usize = 256;
const FEWEST_SAMPLES: usize = 64;
/// Pixels that are filled in one by one.
const MOST: usize = 1 << 20;
/// Light that the logarithm is taken of at least \[1\].
const DARKEST: f32 = 1e-5;

/// Of the fill, as a fraction of the range of what surrounds it: a twentieth of an 8-bit level.
const TOLERANCE: f64 = 0.05 / 255.0;

const TERMS: usize = 7;

/// What a clear sky is made of at a place in [-1, 1].
fn terms(y: f64, x: f64) -> [f64; TERMS] {
    [1.0, y, y * y, y * y * y, x, x * y, x * x]
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if values.len() % 2 == 1 { upper } else { 0.5 * (lower + upper) }
}

/// Some pixels of the sky: their index and terms.
struct Samples {
    pixels: Vec<usize>,
    terms: Vec<[f64; TERMS]>,
}

impl Samples {
    fn new(hidden: &[bool], height: usize, width: usize) -> Self {
        let step = (height.max(width) / GRID).max(1);
        let places = (0..height).step_by(step).flat_map(|y| (0..width).step_by(step).map(move |x| (y, x)));
        let seen: Vec<(usize, usize)> = places.filter(|&(y, x)| !hidden[y * width + x]).collect();
        Self {
            pixels: seen.iter().map(|&(y, x)| y * width + x).collect(),
            terms: seen.iter().map(|&(y, x)| terms(centered(height, y), centered(width, x))).collect(),
        }
    }
}

fn dot(a: &[f64; TERMS], b: &[f64; TERMS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A surface by row and column.
struct Surface([f64; TERMS]);

impl Surface {
    /// Coefficients of 1, x and x² in a row.
    fn row(&self, y: f64) -> [f64; 3] {
        let c = &self.0;
        [c[0] + y * (c[1] + y * (c[2] + y * c[3])), c[4] + y * c[5], c[6]]
    }
}

/// Logarithm of the light of each channel of a clear sky, from those pixels that are not hidden, and the rows between which
/// it was seen.
fn smooth(rgb: &[f32], hidden: &[bool], height: usize, width: usize) -> ([Surface; 3], [f64; 2]) {
    let samples = Samples::new(hidden, height, width);
    let count = samples.pixels.len();
    let light: Vec<[f64; 3]> =
        samples.pixels.iter().map(|&p| [0, 1, 2].map(|c| f64::from(rgb[3 * p + c].max(DARKEST)).ln())).collect();
    let mut weights = vec![1.0; count];
    let mut surface = [[0.0; TERMS]; 3];
    for _ in 0..ROUNDS {
        for (c, surface) in surface.iter_mut().enumerate() {
            let mut equations = NormalEquations::default();
            for ((terms, light), &weight) in samples.terms.iter().zip(&light).zip(&weights) {
                equations.add(weight, terms, light[c]);
            }
            // Few pixels say nothing of far corners: the surface is level there.
            *surface = equations.solve(1e-3 * count as f64, 1);
        }
        let off: Vec<f64> = samples
            .terms
            .iter()
            .zip(&light)
            .map(|(terms, light)| (0..3).map(|c| (light[c] - dot(terms, &surface[c])).abs()).fold(0.0, f64::max))
            .collect();
        let scale = 1.5 * median(&mut off.clone()) + 1e-9;
        for (weight, off) in weights.iter_mut().zip(off) {
            *weight = (off / scale).max(1.0).powi(-2);
        }
    }
    let mut rows: Vec<f64> = samples.pixels.iter().map(|&p| (p / width) as f64).collect();
    rows.sort_unstable_by(f64::total_cmp);
    let quantile = |q: f64| rows[((count - 1) as f64 * q).round() as usize];
    (surface.map(Surface), [quantile(0.01), quantile(0.99)])
}

/// Pixels of the sky that are paler than its smooth surface by more than its noise: thin cloud beside the mask.
fn wisps(feature: &[f32], hidden: &[bool], height: usize, width: usize, job: &Job) -> Result<Vec<bool>> {
    let mut out = vec![false; hidden.len()];
    if hidden.iter().filter(|h| !**h).count() < FEWEST {
        return Ok(out);
    }
    let samples = Samples::new(hidden, height, width);
    // Wisps are wider than the grain.
    let soft = blur(&blur(feature, [height, width, 1], job)?, [height, width, 1], job)?;
    let value: Vec<f64> = samples.pixels.iter().map(|&p| f64::from(soft[p])).collect();
    let mut keep = vec![true; value.len()];
    let (mut surface, mut limit) = ([0.0; TERMS], 0.0);
    for _ in 0..ROUNDS {
        let mut equations = NormalEquations::default();
        for ((terms, &value), _) in samples.terms.iter().zip(&value).zip(&keep).filter(|(_, k)| **k) {
            equations.add(1.0, terms, value);
        }
        let ridge = 1e-12 * equations.trace();
        surface = equations.solve(ridge, 0);
        let off: Vec<f64> = samples.terms.iter().zip(&value).map(|(t, v)| v - dot(t, &surface)).collect();
        let mut near: Vec<f64> = off.iter().zip(&keep).filter(|(_, k)| **k).map(|(o, _)| *o).collect();
        let middle = median(&mut near);
        let mut apart: Vec<f64> = near.iter().map(|o| (o - middle).abs()).collect();
        limit = (DEVIATIONS * 1.4826 * median(&mut apart)).max(LEAST);
        keep = off.iter().map(|&o| o > -limit).collect();
        if keep.iter().filter(|k| **k).count() < FEWEST_SAMPLES {
            return Ok(out);
        }
    }
    let surface = Surface(surface);
    let across: Vec<f64> = (0..width).map(|x| centered(width, x)).collect();
    job.chunks(&mut out, width, |y, row| {
        let [level, slope, bend] = surface.row(centered(height, y));
        for (i, out) in row.iter_mut().enumerate() {
            let (x, p) = (across[i], y * width + i);
            *out = !hidden[p] && f64::from(soft[p]) - (level + x * (slope + x * bend)) < -limit;
        }
        Ok(())
    })?;
    Ok(out)
}

/// Multiply or divide the picture by the smooth surface: `of(value, smooth)`.
fn by_surface(
    picture: &mut [f32],
    (surface, seen): (&[Surface; 3], [f64; 2]),
    (height, width): (usize, usize),
    of: impl Fn(f32, f32) -> f32 + Sync,
    job: &Job,
) -> Result<()> {
    let across: Vec<f64> = (0..width).map(|x| centered(width, x)).collect();
    job.chunks(picture, 3 * width, |y, row| {
        // Where no sky is seen the surface is that of the nearest row of it: a cubic would run away.
        let y = 2.0 * ((y as f64).clamp(seen[0], seen[1]) + 0.5) / height as f64 - 1.0;
        let rows = [0, 1, 2].map(|c| surface[c].row(y));
        for (pixel, &x) in row.chunks_exact_mut(3).zip(&across) {
            for (value, [level, slope, bend]) in pixel.iter_mut().zip(&rows) {
                *value = of(*value, elementary::exp((level + x * (slope + x * bend)) as f32));
            }
        }
        Ok(())
    })
}

/// What is hidden filled in, on blocks of pixels where there are many: what light and surface differ by is smooth, and the
/// grain of single pixels along the border would draw streaks.
fn continued(mut ratio: Vec<f32>, hidden: &[bool], (height, width): (usize, usize), job: &Job) -> Result<Vec<f32>> {
    let block = ((height * width) as f64 / MOST as f64).sqrt().ceil() as usize;
    if block <= 1 {
        return fill(job, &ratio, (height, width, 3), hidden, None, TOLERANCE, |v| v as f32);
    }
    let (rows, columns) = (height.div_ceil(block), width.div_ceil(block));
    let mut means = vec![0.0_f32; 3 * rows * columns];
    job.chunks(&mut means, 3 * columns, |row, out| {
        for (column, mean) in out.chunks_exact_mut(3).enumerate() {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for y in row * block..((row + 1) * block).min(height) {
                for p in y * width + column * block..y * width + ((column + 1) * block).min(width) {
                    if !hidden[p] {
                        for c in 0..3 {
                            sum[c] += ratio[3 * p + c];
                        }
                        count += 1.0;
                    }
                }
            }
            // No pixel is seen: NaN, until it is filled.
            for c in 0..3 {
                mean[c] = sum[c] / count;
            }
        }
        Ok(())
    })?;
    let unseen: Vec<bool> = means.chunks_exact(3).map(|m| m[0].is_nan()).collect();
    let filled = fill(job, &means, (rows, columns, 3), &unseen, None, TOLERANCE, |v| v as f32)?;
    let place = |at: usize, count: usize| {
        let place = ((at as f32 + 0.5) / block as f32 - 0.5).clamp(0.0, (count - 1) as f32);
        (place as usize, (place as usize + 1).min(count - 1), place - place.floor())
    };
    job.chunks(&mut ratio, 3 * width, |y, line| {
        let (above, below, down) = place(y, rows);
        for (x, pixel) in line.chunks_exact_mut(3).enumerate().filter(|(x, _)| hidden[y * width + x]) {
            let (left, right, along) = place(x, columns);
            let at = |row: usize, column: usize, c: usize| filled[3 * (row * columns + column) + c];
            for (c, value) in pixel.iter_mut().enumerate() {
                let upper = at(above, left, c) + along * (at(above, right, c) - at(above, left, c));
                let lower = at(below, left, c) + along * (at(below, right, c) - at(below, left, c));
                *value = upper + down * (lower - upper);
            }
        }
        Ok(())
    })?;
    Ok(ratio)
}

/// The sky without clouds and ground, both grown by `margin`; `None` where there is none. `feature` is what sky and cloud
/// were told apart by, larger for bluer.
pub fn behind(
    rgb: &[f32],
    (height, width): (usize, usize),
    covered: &[bool],
    feature: &[f32],
    margin: usize,
    job: &Job,
) -> Result<Option<Vec<f32>>> {
    let pixels = height * width;
    if rgb.len() != 3 * pixels || covered.len() != pixels || feature.len() != pixels {
        let got = format!("{}, {} and {} elements", rgb.len(), covered.len(), feature.len());
        return Err(Error::Shape { name: "photo", expected: format!("{pixels} pixels"), got });
    }
    if covered.iter().all(|c| *c) {
        return Ok(None);
    }
    let size = [height, width];
    let mut hidden = dilate(covered, size, margin, job)?;
    if hidden.iter().all(|h| *h) {
        hidden = covered.to_vec();
    }
    let thin = dilate(&wisps(feature, &hidden, height, width, job)?, size, margin.max(2), job)?;
    let left = hidden.iter().zip(&thin).filter(|(h, t)| !**h && !**t).count();
    if left as f64 > 0.02 * pixels as f64 {
        for (h, t) in hidden.iter_mut().zip(&thin) {
            *h |= t;
        }
    }
    let (surface, seen) = smooth(rgb, &hidden, height, width);
    let mut out = rgb.to_vec();
    by_surface(&mut out, (&surface, seen), (height, width), |x, s| (x / s).clamp(0.05, 20.0), job)?;
    out = continued(out, &hidden, (height, width), job)?;
    by_surface(&mut out, (&surface, seen), (height, width), |x, s| x * s, job)?;
    for ((out, rgb), _) in out.chunks_exact_mut(3).zip(rgb.chunks_exact(3)).zip(&hidden).filter(|(_, h)| !**h) {
        out.copy_from_slice(rgb);
    }
    Ok(Some(out))
}

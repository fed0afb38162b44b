//! Glare: what the eye scatters of light too bright for a display (point spread function, veiling luminance, bloom)
//! (floor 2).
//!
//! Spencer, Shirley, Zimmerman and Greenberg 1995 ("Physically-based glare effects for digital images"): of a point's
//! light a part is scattered as `a / (t + 0.02)^3 + b / (t + 0.02)^2` over the angle `t` in degrees, most of it close by;
//! in the dark, with wide pupils, more of it far away. Their lenticular halo is left out. Only light above what the
//! display shows is scattered: for the rest the eyes of whoever looks at the display do it. So an ordinary picture keeps
//! its bits and costs one comparison a pixel.
//!
//! The spread is a sum of bell curves of a pyramid (Burt and Adelson 1983), each an octave wider, whose weights are the
//! light that the function sheds between their radii. What goes beyond the picture is lost. Error: within a factor of
//! 1.4 of the function from two pixels to the fourth of the picture's height (`a_point_spreads_like_the_function`), its
//! sum to 1e-5. Cost: 60 ns a pixel where something is scattered.

use super::pixels::{CHUNK, luminance, pixels_of};
use crate::error::Result;
use crate::job::Job;
use crate::math::lanes;

/// Amplitudes and offset \[°\] of the function's three parts, each of which sums to 1 over the sphere.
const CORE: [f64; 2] = [2.61e6, 0.02];
const CUBE: [f64; 2] = [20.91, 0.02];
const SQUARE: [f64; 2] = [72.37, 0.02];
/// Weights of the parts by day, and in the dark.
const DAY: [f64; 3] = [0.384, 0.478, 0.138];
const DARK: [f64; 3] = [0.282, 0.478, 0.207 + 0.033];
/// Ends of the mesopic range \[cd/m2\], as in `scotopic`.
const MESOPIC: [f64; 2] = [0.01, 4.0];
/// How far light is scattered \[°\].
const FARTHEST: f64 = 90.0;
/// Radius within which half of a bell curve's light is, in its standard deviations.
const HALF: f64 = 1.177_410_022_515_474_7;

/// The eye's point spread function.
#[derive(Debug, Clone, Copy)]
pub struct PointSpread {
    weights: [f64; 3],
}

impl PointSpread {
    /// Of an eye adapted to a luminance \[cd/m2\].
    pub fn new(adaptation: f64) -> Self {
        let [low, high] = MESOPIC.map(f64::ln);
        let t = ((adaptation.max(1e-30).ln() - low) / (high - low)).clamp(0.0, 1.0);
        let mixed = [0, 1, 2].map(|k: usize| DARK[k] + (DAY[k] - DARK[k]) * t);
        let all = mixed.iter().sum::<f64>();
        Self { weights: mixed.map(|w| w / all) }
    }

    /// Share of a point's light for each solid angle at an angle \[°\] from it \[1/sr\].
    pub fn density(&self, angle: f64) -> f64 {
        let [core, cube, square] = self.weights;
        core * CORE[0] * (-(angle / CORE[1]).powi(2)).exp()
            + cube * CUBE[0] / (angle + CUBE[1]).powi(3)
            + square * SQUARE[0] / (angle + SQUARE[1]).powi(2)
    }

    /// Share of a point's light within an angle \[°\], 1 at 90°; angles are taken as if the sphere were flat.
    pub fn within(&self, angle: f64) -> f64 {
        let part = |r: f64| {
            let [core, cube, square] = self.weights;
            core * (1.0 - (-(r / CORE[1]).powi(2)).exp())
                + cube * CUBE[0] * r * r / (2.0 * CUBE[1] * (r + CUBE[1]).powi(2)) * FLAT
                + square * SQUARE[0] * (((r + SQUARE[1]) / SQUARE[1]).ln() + SQUARE[1] / (r + SQUARE[1]) - 1.0) * FLAT
        };
        (part(angle) / part(FARTHEST)).min(1.0)
    }
}

/// `2 pi` square degrees in steradians.
const FLAT: f64 = std::f64::consts::TAU * (std::f64::consts::PI / 180.0) * (std::f64::consts::PI / 180.0);

/// Standard deviation of what level `k` of the pyramid adds to the picture \[px\].
fn deviation(k: usize) -> f64 {
    if k == 0 { 0.4 } else { (2.0 * (4.0_f64.powi(k as i32) - 1.0) / 3.0).sqrt() }
}

/// A picture of three channels.
struct Level {
    width: usize,
    height: usize,
    light: Vec<f32>,
}

impl Level {
    /// Half as large, by the binomial filter of five.
    fn smaller(&self, job: &Job) -> Result<Self> {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut light = vec![0.0_f32; 3 * width * height];
        let clamp = |i: isize, n: usize| i.clamp(0, n as isize - 1) as usize;
        job.chunks(&mut light, 3 * width, |y, out| {
            let rows = [0, 1, 2, 3, 4].map(|k: isize| {
                &self.light[3 * self.width * clamp(2 * y as isize + k - 2, self.height)..][..3 * self.width]
            });
            lanes::run(
                #[inline(always)]
                || {
                    let down: Vec<f32> = (0..3 * self.width)
                        .map(|i| {
                            ((rows[0][i] + rows[4][i]) + 4.0 * (rows[1][i] + rows[3][i]) + 6.0 * rows[2][i]) / 16.0
                        })
                        .collect();
                    for (x, pixel) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                        let at = |k: isize| 3 * clamp(2 * x as isize + k, self.width);
                        for (c, v) in pixel.iter_mut().enumerate() {
                            let (far, near) = (down[at(-2) + c] + down[at(2) + c], down[at(-1) + c] + down[at(1) + c]);
                            *v = (far + 4.0 * near + 6.0 * down[at(0) + c]) / 16.0;
                        }
                    }
                },
            );
            Ok(())
        })?;
        Ok(Self { width, height, light })
    }

    /// Make `self` a share of itself, and add a smaller level.
    fn collect(&mut self, job: &Job, share: f32, from: &Self) -> Result<()> {
        let (width, height) = (self.width, self.height);
        job.chunks(&mut self.light, 3 * width, |y, out| {
            let at = |j: isize| {
                &from.light[3 * from.width * (j.clamp(0, from.height as isize - 1) as usize)..][..3 * from.width]
            };
            let j = (y / 2) as isize;
            debug_assert!(y < height, "a row of the picture");
            let rows = if y.is_multiple_of(2) { [at(j - 1), at(j), at(j + 1)] } else { [at(j), at(j), at(j + 1)] };
            let weights: [f32; 3] = if y.is_multiple_of(2) { [0.125, 0.75, 0.125] } else { [0.0, 0.5, 0.5] };
            lanes::run(
                #[inline(always)]
                || {
                    let across: Vec<f32> = (0..3 * from.width)
                        .map(|i| weights[0] * rows[0][i] + weights[1] * rows[1][i] + weights[2] * rows[2][i])
                        .collect();
                    for (x, pixel) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                        let i = x / 2;
                        let (left, right) = (3 * i.saturating_sub(1), 3 * (i + 1).min(from.width - 1));
                        for (c, v) in pixel.iter_mut().enumerate() {
                            let even = 0.125 * (across[left + c] + across[right + c]) + 0.75 * across[3 * i + c];
                            let odd = 0.5 * (across[3 * i + c] + across[right + c]);
                            *v = share * *v + if x.is_multiple_of(2) { even } else { odd };
                        }
                    }
                },
            );
            Ok(())
        })
    }
}

/// A picture with what the eye scatters of the light above `bright` \[cd/m2\]; `None` if nothing is as bright.
///
/// `pixel` is the angle of a pixel in the middle of the picture \[°\].
pub fn glare(
    job: &Job,
    light: &[f32],
    width: usize,
    spread: &PointSpread,
    bright: f32,
    pixel: f64,
) -> Result<Option<Vec<f32>>> {
    let pixels = pixels_of(light)?;
    let some = job.map(pixels.len().div_ceil(CHUNK), |k| {
        let part = &pixels[k * CHUNK..pixels.len().min((k + 1) * CHUNK)];
        Ok(lanes::run(
            #[inline(always)]
            || part.iter().fold(false, |any, &p| any | (luminance(p) > bright)),
        ))
    })?;
    if !some.contains(&true) {
        return Ok(None);
    }
    let height = pixels.len() / width;
    let mut out = light.to_vec();
    let mut first = Level { width, height, light: vec![0.0; light.len()] };
    job.chunks(&mut first.light, 3 * width, |y, over| {
        for (to, &p) in over.as_chunks_mut::<3>().0.iter_mut().zip(&pixels[y * width..]) {
            let l = luminance(p);
            if l > bright {
                let share = if l < f32::INFINITY { 1.0 - bright / l } else { 0.0 };
                *to = p.map(|c| share * c);
            }
        }
        Ok(())
    })?;
    // The levels, and the radii between them.
    let mut levels = vec![first];
    while levels.last().is_some_and(|l| l.width.max(l.height) > 3) {
        let next = levels[levels.len() - 1].smaller(job)?;
        levels.push(next);
    }
    let edge = |k: usize| pixel * HALF * (deviation(k - 1) * deviation(k)).sqrt();
    let share = |k: usize| (spread.within(edge(k + 1)) - if k > 0 { spread.within(edge(k)) } else { 0.0 }) as f32;
    let Some(mut sum) = levels.pop() else { return Ok(None) };
    let last = share(levels.len());
    for x in &mut sum.light {
        *x *= last;
    }
    while let Some(mut level) = levels.pop() {
        let kept = share(levels.len());
        if levels.is_empty() {
            // Of the picture itself what was bright is replaced by what is left of it.
            job.chunks(&mut out, CHUNK, |k, out| {
                for (o, &x) in out.iter_mut().zip(&level.light[k * CHUNK..]) {
                    *o -= x;
                }
                Ok(())
            })?;
        }
        level.collect(job, kept, &sum)?;
        sum = level;
    }
    job.chunks(&mut out, CHUNK, |k, out| {
        for (o, &x) in out.iter_mut().zip(&sum.light[k * CHUNK..]) {
            *o += x;
        }
        Ok(())
    })?;
    Ok(Some(out))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_function_sums_to_one() {
        for adaptation in [1e-4, 0.3, 3000.0] {
            let spread = PointSpread::new(adaptation);
            // By rings of equal ratio, against the closed form.
            let (mut sum, steps) = (0.0, 200_000);
            for k in 0..steps {
                let at = |x: f64| 1e-6 * (x / f64::from(steps) * (90e6_f64).ln()).exp();
                let (a, b) = (at(f64::from(k)), at(f64::from(k) + 1.0));
                sum += spread.density(0.5 * (a + b)) * FLAT * 0.5 * (b * b - a * a);
            }
            assert!((sum - 1.0).abs() < 0.01, "Spencer's parts sum to 1 within a percent: {sum}");
            assert!((spread.within(90.0) - 1.0).abs() < 1e-12, "all of it");
        }
        assert!(PointSpread::new(1e-4).density(5.0) > 1.5 * PointSpread::new(1e4).density(5.0), "wide pupils");
    }

    #[test]
    fn a_point_spreads_like_the_function() {
        let (width, height, pixel) = (257, 257, 0.08);
        let mut light = vec![0.0_f32; 3 * width * height];
        let middle = 3 * (128 * width + 128);
        light[middle..middle + 3].fill(1e6);
        let spread = PointSpread::new(1000.0);
        let out = glare(&Job::serial(), &light, width, &spread, 1.0, pixel).expect("a picture").expect("it is bright");
        let solid = (pixel.to_radians()).powi(2);
        for r in [2_usize, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64] {
            // A mean over the four directions.
            let at = |x: usize, y: usize| f64::from(out[3 * (y * width + x)]);
            let mean = 0.25 * (at(128 + r, 128) + at(128 - r, 128) + at(128, 128 + r) + at(128, 128 - r));
            let want = 1e6 * solid * spread.density(r as f64 * pixel);
            assert!((0.7..1.4).contains(&(mean / want)), "{r} px: {}", mean / want);
        }
        let sum = out.iter().step_by(3).map(|&x| f64::from(x)).sum::<f64>() / 1e6;
        // What goes beyond the picture is lost: of the function outside of ten degrees.
        assert!((spread.within(6.0)..1.00001).contains(&sum), "{sum}");
    }

    #[test]
    fn what_a_display_shows_is_not_scattered() {
        let light = vec![5.0_f32; 3 * 40 * 30];
        let spread = PointSpread::new(1.0);
        assert!(glare(&Job::serial(), &light, 40, &spread, 6.0, 0.1).expect("a picture").is_none(), "the same bits");
        // A white field stays even.
        let out = glare(&Job::serial(), &light, 40, &spread, 1.0, 0.1).expect("a picture").expect("bright");
        let (low, high) = out.iter().fold((f32::MAX, 0.0_f32), |(a, b), &x| (a.min(x), b.max(x)));
        assert!(high - low < 1e-4 && low > 4.0, "{low} to {high}");
    }
}

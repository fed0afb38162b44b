//! Inpainting by Laplace's equation: the smooth continuation of a picture into a hole (membrane interpolation) (floor
//! 1).
//!
//! Five-point Laplacian; the value of a known 4-neighbour is given (Dirichlet), a neighbour beyond the picture's border
//! is left out (natural condition). This is the "sky behind the clouds" of Dobashi et al., An inverse problem approach
//! for automatically adjusting the parameters for rendering clouds using photographs, ACM Transactions on Graphics
//! 31(6), 2012, §4.1, and the guidance-free case of Pérez, Gangnet, Blake, Poisson image editing, ACM Transactions on
//! Graphics 22(3), 2003.
//!
//! Method: conjugate gradients, preconditioned by one V(1,1) cycle of red-black Gauss-Seidel over 2 × 2 aggregates
//! ([`multigrid`](super::multigrid), [`gradients`](super::gradients)), in f32; around it a defect correction in f64,
//! which removes the floor of the f32 residual (0.07 of an 8-bit level where three sides of the picture are open). Each
//! channel is scaled to the range of its own boundary values, so a tolerance is a fraction of that range whatever the
//! units. The iteration stops on the size of the correction, not on the residual: at 12 megapixels a relative residual
//! of 2e-4 still means 10 levels. By the maximum principle the result is kept within the boundary's values.
//!
//! A picture is one connected grid, so each masked region touches a known pixel unless the mask covers everything;
//! then nothing determines the fill, and it is refused or given the value of the caller's choice.
//!
//! Error: below 0.05 of an 8-bit level at the default tolerance on every mask of `tests/oracles/test_scipy_image.py`.
//! Cost: `benches/bench_image.py`.

use super::gradients::Solver;
use super::multigrid::{Boundary, Hierarchy};
use super::{Sample, check_mask};
use crate::error::{Error, Result};
use crate::job::Job;

/// Outer corrections before we admit defeat; three are enough for everything we have met.
const OUTER: usize = 40;

/// Indices of the 4-neighbours of pixel `i` within the picture.
fn neighbours(i: usize, w: usize, h: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (i % w, i / w);
    [(x > 0).then(|| i - 1), (x + 1 < w).then(|| i + 1), (y > 0).then(|| i - w), (y + 1 < h).then(|| i + w)]
        .into_iter()
        .flatten()
}

/// Up to four channels of the boundary: their lowest values and ranges.
struct Scale {
    low: [f64; 4],
    size: [f64; 4],
}

/// One problem: up to four channels of a picture.
struct Problem<'a, T> {
    data: &'a [T],
    channels: usize,
    first: usize,
    count: usize,
    w: usize,
    h: usize,
    mask: &'a [bool],
}

impl<T: Sample> Problem<'_, T> {
    fn value(&self, pixel: usize, c: usize) -> f64 {
        self.data[pixel * self.channels + self.first + c].double()
    }

    fn scale(&self, pixels: &[Vec<u32>; 2]) -> Scale {
        let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
        for &i in pixels.iter().flatten() {
            for j in neighbours(i as usize, self.w, self.h) {
                if !self.mask[j] {
                    for c in 0..self.count {
                        let v = self.value(j, c);
                        low[c] = low[c].min(v);
                        high[c] = high[c].max(v);
                    }
                }
            }
        }
        let mut scale = Scale { low: [0.0; 4], size: [1.0; 4] };
        for c in 0..self.count {
            let size = high[c] - low[c];
            // A constant boundary, or one whose range cannot be told from rounding, needs no solving.
            if size > 0.0 {
                scale.size[c] = size;
            }
            scale.low[c] = low[c];
        }
        scale
    }

    /// Sum of the scaled known neighbours of each unknown that has any.
    fn boundary(&self, pixels: &[Vec<u32>; 2], scale: &Scale) -> [Boundary; 2] {
        [0, 1].map(|colour| {
            let mut found = Boundary::default();
            for (k, &i) in pixels[colour].iter().enumerate() {
                let (mut sum, mut some) = ([0.0; 4], false);
                for j in neighbours(i as usize, self.w, self.h) {
                    if !self.mask[j] {
                        some = true;
                        for c in 0..self.count {
                            sum[c] += (self.value(j, c) - scale.low[c]) / scale.size[c];
                        }
                    }
                }
                if some {
                    found.push(k, sum);
                }
            }
            found
        })
    }

    /// Solve, and hand each unknown pixel's values to `put(pixel, channel, value)`.
    fn solve(
        &self,
        job: &Job,
        hierarchy: &Hierarchy,
        tolerance: f64,
        mut put: impl FnMut(usize, usize, f64),
    ) -> Result<()> {
        let pixels = &hierarchy.pixels;
        let scale = self.scale(pixels);
        let sides = self.boundary(pixels, &scale);
        let mut solver = Solver::new(hierarchy);
        let mut x: [Vec<[f64; 4]>; 2] = {
            let start = solver.guess(job, hierarchy.boundary(&sides))?;
            [0, 1].map(|k| start.nodes(k).iter().map(|n| n.map(f64::from)).collect::<Vec<_>>())
        };
        let mut done = false;
        for round in 0..OUTER {
            let defect = hierarchy.defect(job, &sides, &x)?;
            let correction = solver.solve(job, defect, if round == 0 { tolerance } else { tolerance / 2.0 })?;
            for colour in 0..2 {
                for (x, e) in x[colour].iter_mut().zip(correction.nodes(colour)) {
                    for c in 0..4 {
                        x[c] += f64::from(e[c]);
                    }
                }
            }
            if f64::from(correction.largest()) <= tolerance / 2.0 {
                done = true;
                break;
            }
        }
        if !done {
            let reason = format!("the fill did not settle to tolerance {tolerance:e} in {OUTER} corrections");
            return Err(Error::Data { name: "tolerance", reason });
        }
        // The picture is copied only now that the solver's memory is free.
        drop(solver);
        for colour in 0..2 {
            for (&i, x) in pixels[colour].iter().zip(&x[colour]) {
                for c in 0..self.count {
                    // `min`, `max`: the discrete maximum principle.
                    put(i as usize, c, scale.low[c] + scale.size[c] * x[c].clamp(0.0, 1.0));
                }
            }
        }
        Ok(())
    }
}

/// Fill the masked pixels of an `(h, w, channels)` picture. `tolerance` is a fraction of the range of the boundary's
/// values. A mask that covers everything gives `outside` (one value for each channel) or is refused.
pub fn fill<T: Sample>(
    job: &Job,
    data: &[T],
    shape: (usize, usize, usize),
    mask: &[bool],
    outside: Option<&[f64]>,
    tolerance: f64,
    from: impl Fn(f64) -> T,
) -> Result<Vec<T>> {
    let (h, w, channels) = shape;
    if data.len() != h * w * channels || channels == 0 || h * w >= 1 << 31 {
        let got = format!("{} samples", data.len());
        return Err(Error::Shape { name: "img", expected: "(h, w) or (h, w, c), below 2^31 pixels".into(), got });
    }
    check_mask(Some(mask), h * w)?;
    if let Some(colour) = outside
        && colour.len() != channels
    {
        let (expected, got) = (format!("({channels},)"), format!("({},)", colour.len()));
        return Err(Error::Shape { name: "outside", expected, got });
    }
    let strange = data
        .chunks_exact(channels)
        .zip(mask)
        .filter(|&(pixel, &hole)| !hole && pixel.iter().any(|x| !x.double().is_finite()))
        .count();
    if strange > 0 {
        let reason = format!("must be finite outside the mask, got {strange} pixels with NaN or infinity");
        return Err(Error::Data { name: "img", reason });
    }
    let unknowns = mask.iter().filter(|&&hole| hole).count();
    if unknowns == 0 {
        return Ok(data.to_vec());
    }
    if unknowns == mask.len() {
        let Some(colour) = outside else {
            let reason = "1 masked region touches no known pixel (the mask covers the whole picture), so nothing \
                          determines it; give outside= a value for it";
            return Err(Error::Data { name: "mask", reason: reason.into() });
        };
        let mut out = data.to_vec();
        for pixel in out.chunks_exact_mut(channels) {
            for (x, &v) in pixel.iter_mut().zip(colour) {
                *x = from(v);
            }
        }
        return Ok(out);
    }
    job.check()?;
    let hierarchy = Hierarchy::new(job, mask, w, h)?;
    let mut out = Vec::new();
    for first in (0..channels).step_by(4) {
        let count = (channels - first).min(4);
        let problem = Problem { data, channels, first, count, w, h, mask };
        problem.solve(job, &hierarchy, tolerance, |i, c, v| {
            if out.is_empty() {
                out = data.to_vec();
            }
            out[i * channels + first + c] = from(v);
        })?;
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(data: &[f64], w: usize, mask: &[bool]) -> Vec<f64> {
        fill(&Job::serial(), data, (data.len() / w, w, 1), mask, None, 1e-9, |v| v).expect("it settles")
    }

    #[test]
    fn a_plane_is_continued_as_a_plane() {
        let (w, h) = (37, 23);
        let plane: Vec<f64> = (0..w * h).map(|i| 3.0 * (i % w) as f64 - 2.0 * (i / w) as f64 + 100.0).collect();
        let mask: Vec<bool> =
            (0..w * h).map(|i| (3..w - 3).contains(&(i % w)) && (2..h - 2).contains(&(i / w))).collect();
        let out = filled(&plane, w, &mask);
        let worst = out.iter().zip(&plane).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6, "planes are harmonic: off by {worst}");
    }

    #[test]
    fn one_known_pixel_spreads_everywhere() {
        let mut mask = vec![true; 40 * 30];
        mask[77] = false;
        let mut data = vec![0.0; 40 * 30];
        data[77] = 0.37;
        assert!(filled(&data, 40, &mask).iter().all(|&x| x == 0.37), "a constant");
    }

    #[test]
    fn nothing_known_is_refused() {
        let call = |outside| fill(&Job::serial(), &[0.0_f32; 6], (2, 3, 1), &[true; 6], outside, 1e-3, |v| v as f32);
        assert!(call(None).is_err(), "refused without a value");
        assert_eq!(call(Some(&[0.5])), Ok(vec![0.5; 6]), "or that value everywhere");
    }
}

//! Denoising of Monte Carlo renderings by a guided filter: local linear regression on noiseless features (floor 3).
//!
//! Light scattered many times is nearly a linear function of what is known without noise nearby: the optical depth and
//! the light scattered once, at a few extinctions. In a square window around each pixel the sampled image is fitted by
//! such a function (least squares with a small ridge), and the fits of all windows over a pixel are averaged there (He,
//! Sun and Tang 2013, with several guides; Bitterli et al. 2016 for rendering). The window grows with the noise of the
//! image, which the first pass measures, so that what is clean is left nearly alone.

use crate::error::{Error, Result};
use crate::job::Job;

/// Half widths of the windows \[px\].
const RADII: [usize; 5] = [2, 5, 10, 20, 40];
/// The window that measures the noise.
const MEASURE: usize = 2;
/// Fraction of the mean power of the guides that is added to each.
const RIDGE: f64 = 1e-3;
/// Noise that is left alone, relative to the light of the node: half width per noise is chosen against it.
const WANTED: f64 = 0.02;
/// Most guides.
const GUIDES: usize = 8;

/// Noiseless images of the pixels that see the cloud, within the rectangle that holds them all.
#[derive(Debug)]
pub struct Guide {
    width: usize,
    height: usize,
    /// Where each of the pixels lies in the rectangle.
    places: Vec<usize>,
    /// Guides, each a rectangle, zero off the cloud.
    guides: Vec<Vec<f32>>,
    /// 1 on the cloud.
    mask: Vec<f32>,
}

/// Sums over windows of half width `r`.
fn box_sum(image: &[f32], width: usize, height: usize, r: usize, rows: &mut [f32], out: &mut [f32]) {
    for (row, to) in image.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        let mut sum: f64 = row[..r.min(width)].iter().map(|&x| f64::from(x)).sum();
        for x in 0..width {
            if x + r < width {
                sum += f64::from(row[x + r]);
            }
            if x > r {
                sum -= f64::from(row[x - r - 1]);
            }
            to[x] = sum as f32;
        }
    }
    let mut sums = vec![0.0_f64; width];
    let add = |sums: &mut [f64], y: usize, sign: f64| {
        for (s, &v) in sums.iter_mut().zip(&rows[y * width..(y + 1) * width]) {
            *s += sign * f64::from(v);
        }
    };
    for y in 0..r.min(height) {
        add(&mut sums, y, 1.0);
    }
    for y in 0..height {
        if y > r {
            add(&mut sums, y - r - 1, -1.0);
        }
        if y + r < height {
            add(&mut sums, y + r, 1.0);
        }
        for (o, s) in out[y * width..(y + 1) * width].iter_mut().zip(&sums) {
            *o = *s as f32;
        }
    }
}

/// The fit of one half width: inverses of the guides' moments in every window, and how many windows lie over a pixel.
struct Fit {
    radius: usize,
    /// For each pixel a symmetric matrix, row by row.
    inverse: Vec<f32>,
    over: Vec<f32>,
}

impl Guide {
    /// From `guides`, each of the `pixels` of a picture `width` wide.
    pub fn new(pixels: &[u32], width: usize, guides: &[&[f32]]) -> Result<Self> {
        if guides.is_empty() || guides.len() > GUIDES || guides.iter().any(|g| g.len() != pixels.len()) {
            let expected = format!("1 to {GUIDES} images of {} pixels", pixels.len());
            return Err(Error::Shape { name: "guides", expected, got: format!("{} images", guides.len()) });
        }
        let at = |p: u32| (p as usize % width, p as usize / width);
        let low = pixels.iter().fold((usize::MAX, usize::MAX), |l, &p| (l.0.min(at(p).0), l.1.min(at(p).1)));
        let high = pixels.iter().fold((0, 0), |h, &p| (h.0.max(at(p).0), h.1.max(at(p).1)));
        let (w, h) = if pixels.is_empty() { (0, 0) } else { (high.0 - low.0 + 1, high.1 - low.1 + 1) };
        let places: Vec<usize> = pixels.iter().map(|&p| (at(p).1 - low.1) * w + at(p).0 - low.0).collect();
        let lay = |values: &[f32]| {
            // Guides of equal power, so that the ridge weighs them alike.
            let power = values.iter().map(|&v| f64::from(v) * f64::from(v)).sum::<f64>() / pixels.len().max(1) as f64;
            let scale = if power > 0.0 { 1.0 / power.sqrt() } else { 0.0 } as f32;
            let mut out = vec![0.0; w * h];
            for (&place, &v) in places.iter().zip(values) {
                out[place] = v * scale;
            }
            out
        };
        let guides = guides.iter().map(|g| lay(g)).collect();
        let mask = lay(&vec![1.0; pixels.len()]);
        Ok(Self { width: w, height: h, places, guides, mask })
    }

    fn fit(&self, radius: usize, job: &Job) -> Result<Fit> {
        let n = self.guides.len();
        let area = self.width * self.height;
        let pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i..n).map(move |j| (i, j))).collect();
        let moments = job.map(pairs.len(), |k| {
            let (i, j) = pairs[k];
            let product: Vec<f32> = self.guides[i].iter().zip(&self.guides[j]).map(|(a, b)| a * b).collect();
            let (mut rows, mut out) = (vec![0.0; area], vec![0.0; area]);
            box_sum(&product, self.width, self.height, radius, &mut rows, &mut out);
            Ok(out)
        })?;
        let mut inverse = vec![0.0_f32; self.places.len() * n * n];
        job.chunks(&mut inverse, 256 * n * n, |chunk, out| {
            for (k, out) in out.chunks_exact_mut(n * n).enumerate() {
                let place = self.places[chunk * 256 + k];
                let mut a = vec![0.0_f64; n * n];
                for (moment, &(i, j)) in moments.iter().zip(&pairs) {
                    a[i * n + j] = f64::from(moment[place]);
                    a[j * n + i] = a[i * n + j];
                }
                let power = (0..n).map(|i| a[i * n + i]).sum::<f64>() / n as f64;
                for i in 0..n {
                    a[i * n + i] += RIDGE * power + 1e-12;
                }
                for (o, v) in out.iter_mut().zip(invert(&a, n)) {
                    *o = v as f32;
                }
            }
            Ok(())
        })?;
        let (mut rows, mut over) = (vec![0.0; area], vec![0.0; area]);
        box_sum(&self.mask, self.width, self.height, radius, &mut rows, &mut over);
        Ok(Fit { radius, inverse, over })
    }

    /// Fit `image` (one value a pixel) in all windows.
    fn apply(&self, fit: &Fit, image: &[f32]) -> Vec<f32> {
        let n = self.guides.len();
        let area = self.width * self.height;
        let mut laid = vec![0.0_f32; area];
        for (&place, &v) in self.places.iter().zip(image) {
            laid[place] = v;
        }
        let (mut product, mut rows, mut sums) = (vec![0.0; area], vec![0.0; area], vec![0.0; area]);
        let mut cross = vec![0.0_f32; self.places.len() * n];
        for (i, guide) in self.guides.iter().enumerate() {
            for ((p, a), b) in product.iter_mut().zip(&laid).zip(guide) {
                *p = a * b;
            }
            box_sum(&product, self.width, self.height, fit.radius, &mut rows, &mut sums);
            for (k, &place) in self.places.iter().enumerate() {
                cross[k * n + i] = sums[place];
            }
        }
        let mut out = vec![0.0_f32; self.places.len()];
        // Off the cloud `product` is zero, as `laid` was.
        for (i, guide) in self.guides.iter().enumerate() {
            for (k, &place) in self.places.iter().enumerate() {
                let row = &fit.inverse[(k * n + i) * n..][..n];
                product[place] = row.iter().zip(&cross[k * n..]).map(|(a, c)| a * c).sum();
            }
            box_sum(&product, self.width, self.height, fit.radius, &mut rows, &mut sums);
            for (o, &place) in out.iter_mut().zip(&self.places) {
                *o += sums[place] * guide[place] / fit.over[place].max(1e-9);
            }
        }
        out
    }
}

/// Inverse of a symmetric positive matrix, by Cholesky.
fn invert(a: &[f64], n: usize) -> Vec<f64> {
    let mut l = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            l[i * n + j] =
                if i == j { (a[i * n + i] - dot).max(1e-300).sqrt() } else { (a[i * n + j] - dot) / l[j * n + j] };
        }
    }
    let mut inverse = vec![0.0; n * n];
    for column in 0..n {
        let mut x = vec![0.0; n];
        for i in 0..n {
            let dot: f64 = (0..i).map(|k| l[i * n + k] * x[k]).sum();
            x[i] = (f64::from(u8::from(i == column)) - dot) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let dot: f64 = (i + 1..n).map(|k| l[k * n + i] * x[k]).sum();
            x[i] = (x[i] - dot) / l[i * n + i];
        }
        for i in 0..n {
            inverse[i * n + column] = x[i];
        }
    }
    inverse
}

fn rms(x: impl Iterator<Item = f32>, n: usize) -> f64 {
    (x.map(|v| f64::from(v) * f64::from(v)).sum::<f64>() / n.max(1) as f64).sqrt()
}

/// Smooth `images`, one after the other, each of the pixels of `guide`. `light` is what each is small or large against:
/// the root mean square of all light of its node. Returns the noise of each image relative to that, before.
pub fn guided_filter(images: &mut [f32], guide: &Guide, light: &[f64], job: &Job) -> Result<Vec<f64>> {
    let n = guide.places.len();
    if images.len() != light.len() * n {
        let got = format!("{} elements", images.len());
        return Err(Error::Shape { name: "images", expected: format!("({}, {n})", light.len()), got });
    }
    if n == 0 {
        return Ok(vec![0.0; light.len()]);
    }
    job.expect(2 * light.len() as u64);
    let fits = RADII.iter().map(|&r| guide.fit(r, job)).collect::<Result<Vec<_>>>()?;
    let noises = {
        let images = &*images;
        job.map(light.len(), |k| {
            let image = &images[k * n..(k + 1) * n];
            let smooth = guide.apply(&fits[MEASURE], image);
            job.advance(1)?;
            let noise = rms(image.iter().zip(&smooth).map(|(a, b)| a - b), n);
            Ok(if light[k] > 0.0 { noise / light[k] } else { 0.0 })
        })?
    };
    job.chunks(images, n, |k, image| {
        // The error left is about noise * sqrt(guides / window) / 2.
        let wide = 0.25 * noises[k] / WANTED * (guide.guides.len() as f64).sqrt();
        let fit = fits.iter().find(|f| f.radius as f64 >= wide).unwrap_or(&fits[RADII.len() - 1]);
        if wide > 0.5 {
            let smoothed = guide.apply(fit, image);
            for (to, from) in image.iter_mut().zip(smoothed) {
                *to = from.max(0.0);
            }
        }
        job.advance(1)
    })?;
    Ok(noises)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn disc(width: usize) -> Vec<u32> {
        let half = width as i64 / 2;
        (0..width * width)
            .filter(|&p| {
                let (x, y) = ((p % width) as i64 - half, (p / width) as i64 - half);
                x * x + y * y < half * half - 3
            })
            .map(|p| p as u32)
            .collect()
    }

    #[test]
    fn box_sums_are_sums_over_boxes() {
        let (w, h) = (13, 9);
        let image: Vec<f32> = (0..w * h).map(|i| ((i * 37) % 101) as f32).collect();
        for r in [0, 1, 3, 20] {
            let (mut rows, mut out) = (vec![0.0; w * h], vec![0.0; w * h]);
            box_sum(&image, w, h, r, &mut rows, &mut out);
            for y in 0..h {
                for x in 0..w {
                    let sum: f32 = (y.saturating_sub(r)..(y + r + 1).min(h))
                        .map(|v| (x.saturating_sub(r)..(x + r + 1).min(w)).map(|u| image[v * w + u]).sum::<f32>())
                        .sum();
                    assert!((out[y * w + x] - sum).abs() < 1e-2, "({x}, {y}), r = {r}");
                }
            }
        }
    }

    #[test]
    fn what_the_guides_span_is_kept_and_noise_is_not() {
        let width = 90;
        let pixels = disc(width);
        let at = |p: &u32| ((*p as usize % width) as f32 / 90.0, (*p as usize / width) as f32 / 90.0);
        let one = vec![1.0; pixels.len()];
        let edge: Vec<f32> = pixels.iter().map(|p| if at(p).0 + at(p).1 > 1.0 { 2.0 } else { 0.5 }).collect();
        let wave: Vec<f32> = pixels.iter().map(|p| (9.0 * at(p).0).sin()).collect();
        let truth: Vec<f32> = edge.iter().zip(&wave).map(|(e, w)| 1.0 + 0.7 * e + 0.2 * w).collect();
        let s = Stream::new(3, 3);
        let noisy: Vec<f32> =
            truth.iter().enumerate().map(|(i, t)| t + 3.0 * (s.uniform(i as u64) as f32 - 0.5)).collect();
        let guide = Guide::new(&pixels, width, &[&one, &edge, &wave]).expect("valid");
        let light = rms(truth.iter().copied(), truth.len());
        let mut images: Vec<f32> = truth.iter().chain(&noisy).copied().collect();
        let noise = guided_filter(&mut images, &guide, &[light; 2], &Job::serial()).expect("runs");
        let error = |x: &[f32]| rms(x.iter().zip(&truth).map(|(a, b)| a - b), truth.len()) / light;
        assert!(error(&images[..truth.len()]) < 2e-3, "the clean one: {}", error(&images[..truth.len()]));
        assert!(error(&images[truth.len()..]) < 0.03, "the noisy one: {}", error(&images[truth.len()..]));
        assert!((noise[1] - error(&noisy)).abs() < 0.05 * noise[1], "noise {} of {}", noise[1], error(&noisy));
    }
}

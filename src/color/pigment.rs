//! Colours mixed as paint (floor 1): spectra by a smooth upsampling, mixed by Kubelka and Munk, back to RGB.
//!
//! - Reflectance of a colour: a sigmoid of a quadratic polynomial in the wavelength (Jakob and Hanika 2019), solved by
//!   Newton's method for XYZ under D65 with the 1931 observer. Always within (0, 1), smooth, and exact to 1e-6 inside
//!   the gamut; a colour on its border is first moved inside by [`MARGIN`].
//! - Mixture: `K/S = (1 - R)^2 / 2R`, averaged over the paints by their concentrations, `R = 1 + K/S - sqrt((K/S)^2 +
//!   2 K/S)` (Kubelka and Munk 1931, one constant). A paint's concentration is the square of its weight times its
//!   luminance, as in spectral.js and coloraide-extras: by weights alone a dark paint would swallow a light one.
//!
//! Blue and yellow give green; black is no special case. Cost: microseconds, so palettes are baked.

use super::spaces::{Matrix, RGB_TO_XYZ, XYZ_TO_RGB, inverse};
use super::spectrum::observer;

/// Bands of the spectra: 380 to 730 nm by 10.
pub const BANDS: usize = 36;

/// Least and most reflectance, and how far from the gamut's border a colour is taken \[1\].
pub const MARGIN: f64 = 1e-4;

/// Relative power of D65 from 380 nm by 10 (CIE 15:2018, Table 1).
const D65: [f64; BANDS] = [
    49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811, 109.354,
    107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886,
    83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856,
];

/// A spectrum of reflectance.
pub type Reflectance = [f64; BANDS];

/// What turns spectra into linear RGB such that a white reflectance is exactly white.
#[derive(Debug, Clone)]
pub struct SpectralBasis {
    /// Linear RGB of each band.
    weights: [[f64; 3]; BANDS],
}

impl Default for SpectralBasis {
    fn default() -> Self {
        Self::new()
    }
}

fn apply(m: &Matrix, x: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// Luminance of linear RGB.
fn luminance(rgb: [f64; 3]) -> f64 {
    apply(&RGB_TO_XYZ, rgb)[1]
}

impl SpectralBasis {
    /// The 1931 observer under D65.
    pub fn new() -> Self {
        let mut weights = observer::<BANDS>();
        let mut white = [0.0; 3];
        for (w, power) in weights.iter_mut().zip(D65) {
            for k in 0..3 {
                w[k] *= power;
                white[k] += w[k];
            }
        }
        // Each of X, Y, Z is scaled so that white is D65 of Rec. 709 and not that of the table's ten digits.
        for w in &mut weights {
            let xyz = [0, 1, 2].map(|k: usize| w[k] / white[k] * super::spaces::D65[k]);
            *w = apply(&XYZ_TO_RGB, xyz);
        }
        Self { weights }
    }

    /// Linear RGB of a reflectance.
    pub fn rgb(&self, reflectance: &Reflectance) -> [f64; 3] {
        let mut out = [0.0; 3];
        for (r, w) in reflectance.iter().zip(&self.weights) {
            for k in 0..3 {
                out[k] += r * w[k];
            }
        }
        out
    }

    /// A smooth reflectance of this linear RGB, which is clipped into the gamut.
    pub fn reflectance(&self, rgb: [f64; 3]) -> Reflectance {
        let goal = rgb.map(|x| x.clamp(MARGIN, 1.0 - MARGIN));
        // From the grey of the mean, whose spectrum is flat, in steps towards the colour; shorter ones where Newton's
        // method does not arrive.
        let grey = (goal[0] + goal[1] + goal[2]) / 3.0;
        let mut c = [0.0, 0.0, logit(grey)];
        let (mut done, mut step) = (0.0, 0.25);
        while done < 1.0 && step > 1e-4 {
            let next = f64::min(1.0, done + step);
            let target = goal.map(|x| grey + (x - grey) * next);
            match self.solve(target, c) {
                Some(found) => (c, done, step) = (found, next, step * 1.5),
                None => step *= 0.5,
            }
        }
        spectrum(c)
    }

    /// Newton's method for the polynomial whose colour is `goal`.
    fn solve(&self, goal: [f64; 3], mut c: [f64; 3]) -> Option<[f64; 3]> {
        for _ in 0..12 {
            let r = spectrum(c);
            let have = self.rgb(&r);
            let miss = [0, 1, 2].map(|k: usize| goal[k] - have[k]);
            if miss.iter().all(|m| m.abs() < 1e-10) {
                return Some(c);
            }
            let mut slope = [[0.0; 3]; 3];
            for (band, w) in self.weights.iter().enumerate() {
                let x = place(band);
                let p = (c[0] * x + c[1]) * x + c[2];
                let d = 0.5 / (1.0 + p * p).powf(1.5);
                for k in 0..3 {
                    for (m, power) in [x * x, x, 1.0].into_iter().enumerate() {
                        slope[k][m] += w[k] * d * power;
                    }
                }
            }
            let change = apply(&inverse(&slope).ok()?, miss);
            for k in 0..3 {
                c[k] += change[k];
            }
            if !c.iter().all(|x| x.abs() < 1e5) {
                return None;
            }
        }
        None
    }
}

/// A band's wavelength, from -1 to 1.
fn place(band: usize) -> f64 {
    2.0 * band as f64 / (BANDS - 1) as f64 - 1.0
}

/// Jakob and Hanika's sigmoid.
fn sigmoid(p: f64) -> f64 {
    0.5 + 0.5 * p / (1.0 + p * p).sqrt()
}

/// Its inverse.
fn logit(r: f64) -> f64 {
    let x = 2.0 * r - 1.0;
    x / (1.0 - x * x).sqrt()
}

fn spectrum(c: [f64; 3]) -> Reflectance {
    std::array::from_fn(|band| {
        let x = place(band);
        sigmoid((c[0] * x + c[1]) * x + c[2])
    })
}

/// A colour as paint.
#[derive(Debug, Clone)]
pub struct Paint {
    absorption: Reflectance,
    strength: f64,
    /// What the upsampling and the gamut's margin lose of the colour: a pure paint keeps its own.
    rest: [f64; 3],
}

/// `K/S` of a reflectance.
pub fn absorption(r: f64) -> f64 {
    (1.0 - r) * (1.0 - r) / (2.0 * r)
}

/// Reflectance of a `K/S`.
pub fn reflectance(a: f64) -> f64 {
    // 1 + a - sqrt(a^2 + 2a), without the cancellation.
    1.0 / (1.0 + a + (a * a + 2.0 * a).sqrt())
}

impl Paint {
    /// The paint of a linear RGB colour.
    pub fn new(basis: &SpectralBasis, rgb: [f64; 3]) -> Self {
        let r = basis.reflectance(rgb);
        let have = basis.rgb(&r);
        Self {
            absorption: r.map(absorption),
            strength: luminance(have).max(1e-6),
            rest: [0, 1, 2].map(|k: usize| rgb[k] - have[k]),
        }
    }

    /// Linear RGB of this paint with the weight `t` of another, clipped into the gamut.
    pub fn mix(&self, other: &Self, t: f64, basis: &SpectralBasis) -> [f64; 3] {
        let (a, b) = ((1.0 - t) * (1.0 - t) * self.strength, t * t * other.strength);
        let scattering_fraction = b / (a + b);
        let mixed: Reflectance = std::array::from_fn(|k| {
            reflectance(self.absorption[k] + (other.absorption[k] - self.absorption[k]) * scattering_fraction)
        });
        let rgb = basis.rgb(&mixed);
        [0, 1, 2].map(|k: usize| (rgb[k].clamp(0.0, 1.0) + self.rest[k] + (other.rest[k] - self.rest[k]) * t).max(0.0))
    }
}

/// `out = a` with the weight `t` of `b`, mixed as paint, colour by colour; linear RGB.
pub fn mix(job: &crate::job::Job, a: &[f64], b: &[f64], t: &[f64], out: &mut [f64]) -> crate::error::Result<()> {
    let basis = SpectralBasis::new();
    job.chunks(out, 3 * 256, |chunk, out| {
        for (k, pixel) in out.chunks_exact_mut(3).enumerate() {
            let i = chunk * 256 + k;
            let color = |list: &[f64]| [list[3 * i], list[3 * i + 1], list[3 * i + 2]];
            let [a, b] = [color(a), color(b)].map(|c| Paint::new(&basis, c));
            pixel.copy_from_slice(&a.mix(&b, t[i], &basis));
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kubelka_munk_is_its_own_inverse() {
        for k in 1..1000 {
            let r = f64::from(k) / 1000.0;
            assert!((reflectance(absorption(r)) - r).abs() < 1e-12, "at {r}");
        }
        assert_eq!(reflectance(0.0), 1.0, "nothing absorbs");
    }

    #[test]
    fn spectra_have_their_colours() {
        let basis = SpectralBasis::new();
        let white = basis.rgb(&[1.0; BANDS]);
        assert!(white.iter().all(|x| (x - 1.0).abs() < 1e-12), "white {white:?}");
        let mut worst = 0.0_f64;
        for k in 0..1000 {
            let rgb = [k % 10, k / 10 % 10, k / 100].map(|i| f64::from(i) / 9.0);
            let r = basis.reflectance(rgb);
            assert!(r.iter().all(|&x| x > 0.0 && x < 1.0), "{rgb:?}");
            let inside = rgb.map(|x| x.clamp(MARGIN, 1.0 - MARGIN));
            let have = basis.rgb(&r);
            worst = (0..3).fold(worst, |w, c| w.max((have[c] - inside[c]).abs()));
        }
        assert!(worst < 1e-6, "error {worst:e}");
    }

    #[test]
    fn a_mixture_begins_and_ends_with_its_paints() {
        let basis = SpectralBasis::new();
        let (a, b) = ([0.9, 0.6, 0.0], [0.0, 0.01, 0.3]);
        let [p, q] = [a, b].map(|c| Paint::new(&basis, c));
        for (t, wanted) in [(0.0, a), (1.0, b)] {
            let got = p.mix(&q, t, &basis);
            assert!((0..3).all(|k| (got[k] - wanted[k]).abs() < 1e-12), "{got:?}");
        }
        let green = p.mix(&q, 0.5, &basis);
        assert!(green[1] > 2.0 * green[0] && green[1] > 2.0 * green[2], "yellow and blue are green: {green:?}");
    }
}

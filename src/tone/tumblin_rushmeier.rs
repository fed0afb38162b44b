//! Tone mapping after Tumblin and Rushmeier (1993): HDR light to a display, by the brightness an adapted eye sees
//! (floor 2).
//!
//! The paper realistic_sky, section 3, eqs 13-19; night vision is in [`scotopic`](super::scotopic). The display is
//! asked for the brightness that the scene has, for an eye adapted to each. What is printed and what is done:
//!
//! - The argument of alpha and beta is the adaptation, in cd/m2; only the base `pi 1e-4 L_w` is in lamberts, and per
//!   pixel. The adaptation is the log-average of the picture; its mean would be the sun's.
//! - Alpha, the contrast, is 0 at an adaptation of 1.6e-4 cd/m2, a moonless sky, and below it contrast is inverted. An eye
//!   adapts no further than [`MIN_ADAPTATION`] here.
//! - A colour that the display has not is moved towards the grey of its luminance until it has.
//!
//! Error of the display's light 2e-6 relative (`the_picture_is_the_formula`). Cost: one logarithm and one exponential a
//! pixel.

use super::exposure::level;
use super::pixels::{BLOCK, CHUNK, hole, holes, luminance, over, pixels_of, same};
use super::scotopic::dim;
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::elementary::exp;
use crate::math::lanes;
use crate::math::logarithm::{ln, mean_ln};

/// The least adaptation of the eye \[cd/m2\].
pub const MIN_ADAPTATION: f64 = 1e-3;
/// What counts as black in the log-average \[cd/m2\].
pub const BLACK: f32 = 1e-8;
/// The brightest channel that is told from a brighter one \[cd/m2\].
const BRIGHT: f32 = 1e37;
/// Lamberts of a cd/m2.
const LAMBERT: f64 = std::f64::consts::PI * 1e-4;
/// A display.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Display {
    /// Greatest luminance \[cd/m2\].
    pub peak: f64,
    /// Luminance of the room that it reflects \[cd/m2\].
    pub ambient: f64,
    /// What an eye that looks at it is adapted to \[cd/m2\].
    pub adaptation: f64,
}

/// The light of a display for a luminance of the scene: `factor L^power` \[cd/m2\] (eq 16).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Operator {
    /// Logarithm of the factor.
    pub ln_factor: f64,
    /// Contrast of the scene over that of the display.
    pub power: f64,
    display: Display,
}

/// Alpha and beta of an adaptation \[cd/m2\] (eq 14).
fn eye(adaptation: f64) -> [f64; 2] {
    let l = adaptation.max(MIN_ADAPTATION).log10();
    [0.4 * l + 1.519, -0.4 * l * l + 0.218 * l + 6.1642]
}

impl Operator {
    /// For an eye adapted to a scene \[cd/m2\] and a display.
    pub fn new(adaptation: f64, display: Display) -> Self {
        let ([alpha, beta], [alpha_d, beta_d]) = (eye(adaptation), eye(display.adaptation));
        let power = alpha / alpha_d;
        let log = (beta - beta_d) / alpha_d + (power - 1.0) * LAMBERT.log10();
        Self { ln_factor: log * std::f64::consts::LN_10, power, display }
    }

    /// Eq 16: luminance of the display for one of the scene \[cd/m2\]; not limited.
    pub fn luminance(&self, scene: f64) -> f64 {
        if scene > 0.0 { (self.ln_factor + self.power * scene.ln()).exp() } else { 0.0 }
    }

    /// Its fraction of the display's greatest, in `[0, 1]`: eq 18 without the root.
    pub fn display_fraction(&self, scene: f64) -> f64 {
        ((self.luminance(scene) - self.display.ambient) / self.display.peak).clamp(0.0, 1.0)
    }
}

/// Log-average luminance of a picture \[cd/m2\]: `exp(mean(log(max(L, 1e-8))))`.
pub fn log_average(job: &Job, light: &[f32]) -> Result<f64> {
    let pixels = pixels_of(light)?;
    if pixels.is_empty() {
        return Err(Error::Empty { name: "rgb" });
    }
    let sums = job.map(pixels.len().div_ceil(CHUNK), |chunk| {
        let some = &pixels[chunk * CHUNK..pixels.len().min((chunk + 1) * CHUNK)];
        let mut sum = 0.0;
        for block in some.chunks(BLOCK) {
            let mut values = [1.0_f32; BLOCK];
            let (part, holes) = lanes::run(
                #[inline(always)]
                || {
                    for (v, &pixel) in values.iter_mut().zip(block) {
                        let y = luminance(pixel);
                        let y = if y > BLACK { y } else { BLACK };
                        *v = if y < f32::MAX { y } else { f32::MAX };
                    }
                    (mean_ln(&values) * BLOCK as f64, holes(block.as_flattened()))
                },
            );
            if holes {
                return Err(hole());
            }
            sum += part;
        }
        Ok(sum)
    })?;
    Ok((sums.iter().sum::<f64>() / pixels.len() as f64).exp())
}

/// What an operator does to a pixel.
#[derive(Debug, Clone, Copy)]
struct Kernel {
    ln_factor: f32,
    power: f32,
    ambient: f32,
    scale: f32,
}

impl Kernel {
    fn new(operator: &Operator) -> Self {
        Self {
            ln_factor: operator.ln_factor as f32,
            power: operator.power as f32,
            ambient: operator.display.ambient as f32,
            scale: (1.0 / operator.display.peak) as f32,
        }
    }

    /// Light of the display in `[0, 1]`.
    #[inline(always)]
    fn shown(&self, pixel: [f32; 3]) -> [f32; 3] {
        // What is endless is only very bright: it has a colour.
        let pixel = pixel.map(|c| if c < BRIGHT { c } else { BRIGHT });
        let y = luminance(pixel);
        let light = y > 1e-30;
        let y = if light { y } else { 1e-30 };
        let v = (exp(self.ln_factor + self.power * ln(y)) - self.ambient) * self.scale;
        let v = if v > 0.0 { v } else { 0.0 };
        let v = if v < 1.0 { v } else { 1.0 };
        // What a channel may be over the luminance, and how far towards grey the worst one has to go.
        let (by, most) = (1.0 / y, 1.0 / (v + 1e-30));
        let colour = pixel.map(|c| c * by);
        // Both quotients are monotone, so the largest and the least channel are the worst: two divisions, not six.
        let [r, g, b] = colour;
        let (high, low) = if r > g { (r, g) } else { (g, r) };
        let (high, low) = (if b > high { b } else { high }, if b < low { b } else { low });
        let over = if high > most { (most - 1.0) / (high - 1.0) } else { 1.0 };
        let under = if low < 0.0 { 1.0 / (1.0 - low) } else { 1.0 };
        let keep = if over < under { over } else { under };
        let v = if light { v } else { 0.0 };
        colour.map(|q| {
            let x = v * (1.0 + keep * (q - 1.0));
            let x = if x > 0.0 { x } else { 0.0 };
            if x < 1.0 { x } else { 1.0 }
        })
    }
}

/// Luminance of the display for luminances of the scene \[cd/m2\], or its `fraction` of the greatest.
pub fn display(scene: &[f64], out: &mut [f64], operator: &Operator, fraction: bool) -> Result<()> {
    if scene.len() != out.len() {
        let expected = format!("({},)", scene.len());
        return Err(Error::Shape { name: "out", expected, got: format!("({},)", out.len()) });
    }
    for (o, &l) in out.iter_mut().zip(scene) {
        *o = if fraction { operator.display_fraction(l) } else { operator.luminance(l) };
    }
    Ok(())
}

/// A picture as a display shows it: linear light in `[0, 1]`.
pub fn reproduce(job: &Job, light: &[f32], out: &mut [f32], operator: &Operator) -> Result<()> {
    let kernel = Kernel::new(operator);
    over(
        job,
        light,
        out,
        #[inline(always)]
        move |pixel| kernel.shown(pixel),
        same,
    )
}

/// The sRGB levels of [`reproduce`], of [`scotopic`](super::scotopic::scotopic) light where `night`.
pub fn show(job: &Job, light: &[f32], out: &mut [u8], operator: &Operator, night: bool) -> Result<()> {
    let kernel = Kernel::new(operator);
    if night {
        return over(
            job,
            light,
            out,
            #[inline(always)]
            move |pixel| kernel.shown(dim(pixel)),
            level,
        );
    }
    over(
        job,
        light,
        out,
        #[inline(always)]
        move |pixel| kernel.shown(pixel),
        level,
    )
}

/// How many pixels have a channel below 0, and how many one above 1.
pub fn out_of_gamut(job: &Job, light: &[f32]) -> Result<[u64; 2]> {
    let pixels = pixels_of(light)?;
    let counts = job.map(pixels.len().div_ceil(CHUNK), |chunk| {
        let some = &pixels[chunk * CHUNK..pixels.len().min((chunk + 1) * CHUNK)];
        let [mut under, mut over] = [0_u64; 2];
        if holes(some.as_flattened()) {
            return Err(hole());
        }
        for p in some {
            under += u64::from(p[0] < 0.0 || p[1] < 0.0 || p[2] < 0.0);
            over += u64::from(p[0] > 1.0 || p[1] > 1.0 || p[2] > 1.0);
        }
        Ok([under, over])
    })?;
    Ok(counts.into_iter().fold([0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::spaces::RGB_TO_XYZ;
    use crate::tone::scotopic::scotopic;

    const DISPLAY: Display = Display { peak: 100.0, ambient: 1.0, adaptation: 10.0 };

    #[test]
    fn golden_values() {
        // Eq 16 with the constants of eq 14; an identity where both eyes are adapted alike.
        for (adaptation, want) in [(0.01, 2.985_007), (1.0, 6.683_159), (100.0, 14.962_984), (1e3, 22.389_089)] {
            let got = Operator::new(adaptation, DISPLAY).luminance(adaptation);
            assert!((got / want - 1.0).abs() < 1e-6, "{adaptation}: {got}");
        }
        for scene in [1.0, 10.0, 100.0] {
            assert!((Operator::new(10.0, DISPLAY).luminance(scene) / scene - 1.0).abs() < 1e-12, "{scene}");
        }
        let other = Display { adaptation: 50.0, ..DISPLAY };
        for (scene, want) in [(1000.0, 79.016_45), (5000.0, 101.039_99), (50.0, 50.0), (1e-3, 9.575_19)] {
            let got = Operator::new(scene, other).luminance(scene);
            assert!((got - want).abs() < 1e-5, "{scene}: {got}");
        }
    }

    #[test]
    fn the_picture_is_the_formula() {
        let light: Vec<f32> = (0..3000).map(|i| 10.0_f32.powf((i % 997) as f32 / 120.0 - 4.0)).collect();
        let mut out = vec![0.0; light.len()];
        let operator = Operator::new(30.0, DISPLAY);
        reproduce(&Job::serial(), &light, &mut out, &operator).expect("same length");
        for (from, to) in light.as_chunks::<3>().0.iter().zip(out.as_chunks::<3>().0) {
            let y = |p: &[f32; 3]| (0..3).map(|c| RGB_TO_XYZ[1][c] * f64::from(p[c])).sum::<f64>();
            let want = operator.display_fraction(y(from));
            assert!((y(to) - want).abs() < 2e-6 * want.max(0.03), "{from:?}: {} against {want}", y(to));
            assert!(to.iter().all(|x| (0.0..=1.0).contains(x)), "in the display's gamut");
        }
        let mut levels = vec![0_u8; light.len()];
        let mut twice = vec![0_u8; light.len()];
        for night in [false, true] {
            show(&Job::serial(), &light, &mut levels, &operator, night).expect("same length");
            let mut seen = light.clone();
            if night {
                scotopic(&Job::serial(), &light, &mut seen).expect("same length");
            }
            reproduce(&Job::serial(), &seen, &mut out, &operator).expect("same length");
            crate::tone::exposure::levels(&Job::serial(), &out, &mut twice).expect("same length");
            assert_eq!(levels, twice, "one pass is three");
        }
    }

    #[test]
    fn contrast_is_never_inverted() {
        for exponent in -60..50 {
            let operator = Operator::new(10.0_f64.powf(0.1 * f64::from(exponent)), DISPLAY);
            assert!(operator.power > 0.15, "contrast at 1e{}", 0.1 * f64::from(exponent));
        }
    }
}

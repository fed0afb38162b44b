//! One eye: how a scene in cd/m2 is shown, with a filmic shoulder, glare, night vision and a night key (tone mapping,
//! HDR to display) (floor 2).
//!
//! The eye is adapted to one luminance. That is shown as 21 % of the display's white by day, and darker by night: the key. Below
//! it light is shown in proportion; above it lightness grows with the logarithm of light, steadily from the same slope to
//! `white`, the brightest there is, which becomes display white. Without a lamp in view that is seven times the
//! adaptation; with the Sun it is its disc, which keeps its limb.
//!
//! - **Key**: `0.21 / (1 + (100 / L)^0.6)^0.3`. Its power at night, 0.18, is that by which Tumblin and Rushmeier's
//!   brightness of what one is adapted to grows ([`tumblin_rushmeier`](super::tumblin_rushmeier); its test
//!   `test_brightness_of_what_one_is_adapted_to_is_a_power`). What a moonlit eye is adapted to has L* 24, one under stars 15.
//! - **Lightness** `l = 116 y^(1/3) - 16` of CIE Lab, without its line near black.
//! - **Glare** of what is beyond the display's white ([`glare`](super::glare)), then **scotopic vision**
//!   ([`scotopic`](super::scotopic)); the rods of an eye adapted to day see nothing in its shadows.
//! - A colour that the display has not is moved towards the grey of its luminance, softly: no channel reaches the end
//!   before the luminance does.
//!
//! Units: cd/m2 of each channel to light of a display in `[0, 1]` \[1\]. Error of the curve 3e-6
//! (`the_curve_is_its_formula`). Cost: three logarithms or so a pixel.

use super::glare::{PointSpread, glare};
use super::pixels::{CHUNK, luminance, over, pixels_of, same};
use super::scotopic::dim_adapted;
use crate::error::Result;
use crate::job::Job;
use crate::math::lanes;
use crate::math::logarithm::ln;

/// What the eye adapts to at least \[cd/m2\]: below, it is only darker.
pub const LEAST: f64 = 1e-4;
/// Display light of what the eye is adapted to, by day \[1\].
const GREY: f64 = 0.21;
/// Display light at which what is in proportion ends at the latest, over the grey: white is at least so far \[1\].
const SPAN: f64 = 1.44;
/// White is at most so many adaptations: the Sun's disc over a dark sky.
const FARTHEST: f64 = 1e6;
/// The brightest channel that is told from a brighter one \[cd/m2\].
const BRIGHT: f32 = 1e37;
/// Of the adaptation, what the darkest shadow counts as when rods and cones are weighed \[1\].
const RODS: f32 = 0.1;

/// How far towards the display's end a channel may be beyond the luminance \[1\].
const ROOM: f32 = 0.9;

/// An eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eye {
    /// What it is adapted to \[cd/m2\].
    pub adaptation: f64,
    /// Factor of the light \[1\].
    pub exposure: f64,
    /// What becomes display white \[cd/m2\]; the brightest of the picture if there is none.
    pub white: Option<f64>,
    /// Whether it sees like rods where it is dark.
    pub night: bool,
    /// Angle of a pixel \[°\] if the eye scatters light.
    pub glare: Option<f64>,
}

/// Display light of what an eye is adapted to \[1\].
pub fn key(adaptation: f64) -> f64 {
    GREY / (1.0 + (100.0 / adaptation.max(LEAST)).powf(0.6)).powf(0.3)
}

fn lightness(y: f64) -> f64 {
    116.0 * y.cbrt() - 16.0
}

/// The curve, for light over the adaptation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    key: f64,
    /// Light over the adaptation that is white.
    white: f64,
    /// How fast the shoulder bends.
    bend: f64,
}

impl Curve {
    /// With this key and white over the adaptation.
    pub fn new(key: f64, white: f64) -> Self {
        let white = white.clamp(SPAN / key, FARTHEST);
        // The slope of lightness at the adaptation, over what is left of it; the shoulder begins with it.
        let slope = 116.0 / 3.0 * key.cbrt() / (100.0 - lightness(key));
        let (mut low, mut high) = (0.0, 1e3);
        for _ in 0..200 {
            let bend = 0.5 * (low + high);
            if bend / (bend * (white - 1.0)).ln_1p() < slope {
                low = bend;
            } else {
                high = bend;
            }
        }
        Self { key, white, bend: 0.5 * (low + high) }
    }

    /// Display light of light over the adaptation \[1\].
    pub fn of(&self, x: f64) -> f64 {
        if x <= 1.0 {
            return self.key * x.max(0.0);
        }
        let along = (self.bend * (x - 1.0)).ln_1p() / (self.bend * (self.white - 1.0)).ln_1p();
        let from = lightness(self.key);
        ((from + (100.0 - from) * along.min(1.0) + 16.0) / 116.0).powi(3)
    }
}

#[derive(Debug, Clone, Copy)]
struct Kernel {
    /// Light over the adaptation of a cd/m2.
    scale: f32,
    key: f32,
    bend: f32,
    /// Cube root of display light at the adaptation, and what the logarithm adds.
    root: f32,
    rise: f32,
    /// What a pixel counts as at least when rods and cones are weighed \[cd/m2\].
    rods: f32,
}

impl Kernel {
    /// Display light of light over the adaptation.
    #[inline(always)]
    fn curve(&self, x: f32) -> f32 {
        let above = if x > 1.0 { x - 1.0 } else { 0.0 };
        let root = self.root + self.rise * ln(1.0 + self.bend * above);
        let root = if root < 1.0 { root } else { 1.0 };
        if x > 1.0 { root * root * root } else { self.key * x }
    }

    #[inline(always)]
    fn shown(&self, pixel: [f32; 3]) -> [f32; 3] {
        let pixel = pixel.map(|c| if c < BRIGHT { c } else { BRIGHT });
        let y = luminance(pixel);
        let light = y > 1e-30;
        let y = if light { y } else { 1e-30 };
        let v = self.curve(y * self.scale);
        let by = 1.0 / y;
        let colour = pixel.map(|c| c * by);
        let most = if colour[0] > colour[1] { colour[0] } else { colour[1] };
        let most = if colour[2] > most { colour[2] } else { most };
        let least = if colour[0] < colour[1] { colour[0] } else { colour[1] };
        let least = if colour[2] < least { colour[2] } else { least };
        // How far the brightest channel is beyond the grey, over what it gets at most: t becomes t / (1 + t^4)^(1/4).
        let room = ROOM * (1.0 - v);
        let t = v * (most - 1.0) / (room + 1e-6);
        let t = if t < 1e4 { t } else { 1e4 };
        let keep = 1.0 / (1.0 + t * t * (t * t)).sqrt().sqrt();
        let under = if least < 0.0 { 1.0 / (1.0 - least) } else { 1.0 };
        let keep = if under < keep { under } else { keep };
        let v = if light { v } else { 0.0 };
        colour.map(|q| {
            let x = v * (1.0 + keep * (q - 1.0));
            let x = if x > 0.0 { x } else { 0.0 };
            if x < 1.0 { x } else { 1.0 }
        })
    }
}

/// The brightest luminance of a picture \[cd/m2\].
fn brightest(job: &Job, light: &[f32]) -> Result<f64> {
    let pixels = pixels_of(light)?;
    let most = job.map(pixels.len().div_ceil(CHUNK), |k| {
        let part = &pixels[k * CHUNK..pixels.len().min((k + 1) * CHUNK)];
        Ok(lanes::run(
            #[inline(always)]
            || part.iter().fold(0.0_f32, |most, &p| if luminance(p) > most { luminance(p) } else { most }),
        ))
    })?;
    Ok(most.into_iter().map(f64::from).fold(0.0, f64::max))
}

/// Show a picture in rows of `width` pixels: linear light of the display in `[0, 1]`.
pub fn present(job: &Job, light: &[f32], out: &mut [f32], width: usize, eye: &Eye) -> Result<()> {
    let adaptation = eye.adaptation.max(LEAST);
    let key = key(adaptation);
    let by = eye.exposure / adaptation;
    let spread = match eye.glare {
        Some(pixel) => {
            glare(job, light, width, &PointSpread::new(adaptation), (SPAN / key / by).min(1e37) as f32, pixel)?
        }
        None => None,
    };
    let light = spread.as_deref().unwrap_or(light);
    let white = match eye.white {
        Some(white) => white,
        None => brightest(job, light)?,
    };
    let curve = Curve::new(key, white * by);
    let kernel = Kernel {
        scale: by as f32,
        key: key as f32,
        bend: curve.bend as f32,
        root: key.cbrt() as f32,
        rise: ((1.0 - key.cbrt()) / (curve.bend * (curve.white - 1.0)).ln_1p()) as f32,
        rods: RODS * adaptation as f32,
    };
    if eye.night {
        return over(
            job,
            light,
            out,
            #[inline(always)]
            move |pixel| kernel.shown(dim_adapted(pixel, kernel.rods)),
            same,
        );
    }
    over(
        job,
        light,
        out,
        #[inline(always)]
        move |pixel| kernel.shown(pixel),
        same,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const EYE: Eye = Eye { adaptation: 2600.0, exposure: 1.0, white: None, night: false, glare: None };

    #[test]
    fn the_curve_is_its_formula() {
        let light: Vec<f32> = (0..3000).map(|i| 10.0_f32.powf((i / 3) as f32 / 80.0 - 3.0)).collect();
        let mut out = vec![0.0; light.len()];
        for white in [None, Some(9e3), Some(1e9)] {
            present(&Job::serial(), &light, &mut out, 100, &Eye { white, ..EYE }).expect("same length");
            let k = key(EYE.adaptation);
            let curve = Curve::new(k, white.unwrap_or(f64::from(light[2999])) / EYE.adaptation);
            let mut last = -1.0;
            for (from, to) in light.iter().zip(&out).step_by(3) {
                let want = curve.of(f64::from(*from) / EYE.adaptation);
                assert!((f64::from(*to) - want).abs() < 3e-6, "{from}: {to} against {want}");
                assert!(f64::from(*to) >= last - 1e-6, "brighter is never darker");
                last = f64::from(*to);
            }
        }
    }

    #[test]
    fn the_shoulder_begins_with_the_slope_of_what_is_below() {
        for adaptation in [1e-4, 0.01, 5.0, 3000.0, 2e4] {
            for white in [0.0, 20.0, 5e4, 1e9] {
                let curve = Curve::new(key(adaptation), white);
                let h = 1e-5;
                let (below, above) = (curve.of(1.0) - curve.of(1.0 - h), curve.of(1.0 + h) - curve.of(1.0));
                assert!((above / below - 1.0).abs() < 1e-3, "{adaptation}, {white}: {above} after {below}");
                assert!((curve.of(curve.white) - 1.0).abs() < 1e-12, "white is white");
            }
        }
    }

    #[test]
    fn night_is_dark_and_darker_without_a_moon() {
        let l = |adaptation: f64| lightness(key(adaptation));
        assert!((50.0..54.0).contains(&l(3000.0)), "day {}", l(3000.0));
        assert!((20.0..27.0).contains(&l(0.01)), "moon {}", l(0.01));
        assert!((11.0..19.0).contains(&l(2e-4)), "stars {}", l(2e-4));
        assert!(l(0.0) == l(LEAST) && l(LEAST) > 10.0, "no further");
        // Tumblin and Rushmeier's power over three decades of the night, for their display, to which an eye of 10 is adapted.
        let power = (key(1e-2) / key(1e-4)).log10() / 2.0;
        let theirs = 0.33586 / (0.4 * 10.0_f64.log10() + 1.519);
        assert!((power - theirs).abs() < 0.02, "{power} against {theirs}");
    }

    #[test]
    fn colours_do_not_clip_before_their_luminance_does() {
        let mut light = Vec::new();
        for i in 0..500 {
            let f = 10.0_f32.powf(i as f32 / 100.0);
            light.extend([3000.0 * f, 800.0 * f, -20.0 * f]);
        }
        let mut out = vec![0.0; light.len()];
        present(&Job::serial(), &light, &mut out, 500, &EYE).expect("same length");
        let clipped = out.as_chunks::<3>().0.iter().filter(|p| p.iter().any(|&x| x > 0.9985)).count();
        assert!(clipped < 10, "{clipped} of 500 over five decades");
    }
}

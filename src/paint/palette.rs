//! From lightness to colour (S12-S16): three palettes (colour ramps), tint, and aerial perspective: the pull of colours
//! towards that of the distance ([`AerialPerspective`], S16).
//!
//! Dark, middle and light colours are three splines over the parts of the lightness between their cutoffs; between the
//! start and the end of a cutoff both neighbours are evaluated and mixed. Mixtures are of light or of paint
//! ([`pigment`](crate::color::pigment)). All of it is baked into a table of lightness.

use super::light::BiasGain;
use crate::color::pigment::{Paint, SpectralBasis};
use crate::color::spaces::{hsv_of, rgb_of};
use crate::color::transfer::{decode, encode};
use crate::error::{Error, Result};
use crate::math::lanes;

/// How colours between knots are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spline {
    /// Between the two neighbours (the thesis' words).
    Linear,
    /// Through all of them, with slopes of the neighbours (RenderMan's `spline`), clamped at 0.
    CatmullRom,
}

/// Three palettes and where they meet.
#[derive(Debug, Clone, PartialEq)]
pub struct Palettes {
    /// Linear RGB, evenly spaced, of dark, middle and light; one colour at least.
    pub colors: [Vec<[f64; 3]>; 3],
    /// Lightness at which dark begins to give way and is gone, and likewise middle; in order.
    pub cutoffs: [f64; 4],
    /// Between knots.
    pub spline: Spline,
    /// Mix as paint rather than as light.
    pub pigment: bool,
    /// Look colours up by the lightness itself rather than by its place between the palette's own cutoffs.
    pub raw: bool,
}

/// Steps of a baked palette.
const STEPS: usize = 1024;

/// Palettes as a table of lightness.
#[derive(Debug, Clone)]
pub struct Baked {
    colors: Vec<[f32; 3]>,
    cutoffs: [f64; 4],
}

/// Rises from 0 at `start` to 1 at `end`; a step where they are equal.
pub fn linear_step(x: f64, start: f64, end: f64) -> f64 {
    if end > start { ((x - start) / (end - start)).clamp(0.0, 1.0) } else { f64::from(u8::from(x >= end)) }
}

impl Palettes {
    /// Weights of dark, middle and light at a lightness: their sum is 1.
    pub fn weights(&self, lightness: f64) -> [f64; 3] {
        let [a, b, c, d] = self.cutoffs;
        let (past_dark, light) = (linear_step(lightness, a, b), linear_step(lightness, c, d));
        [1.0 - past_dark, past_dark - light, light]
    }

    /// The part of the lightness that a palette is spread over.
    fn span(&self, which: usize) -> [f64; 2] {
        let [a, b, c, d] = self.cutoffs;
        if self.raw { [0.0, 1.0] } else { [[0.0, b], [a, d], [c, 1.0]][which] }
    }

    /// The colour of a lightness.
    fn color(&self, lightness: f64, mixer: &Mixer) -> [f64; 3] {
        let weights = self.weights(lightness);
        let mut out: Option<([f64; 3], f64)> = None;
        for which in 0..3 {
            if weights[which] > 0.0 {
                let [low, high] = self.span(which);
                let x = if high > low { ((lightness - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
                let here = self.along(which, x, mixer);
                out = Some(match out {
                    None => (here, weights[which]),
                    Some((color, sum)) => {
                        let all = sum + weights[which];
                        (mixer.mix(color, here, weights[which] / all), all)
                    }
                });
            }
        }
        // Weights sum to 1, so there is one.
        out.map_or([0.0; 3], |(color, _)| color)
    }

    fn along(&self, which: usize, x: f64, mixer: &Mixer) -> [f64; 3] {
        let list = &self.colors[which];
        let last = list.len() - 1;
        let at = x * last as f64;
        let k = (at as usize).min(last.saturating_sub(1));
        let t = at - k as f64;
        let knot = |i: isize| list[i.clamp(0, last as isize) as usize];
        let (p, q) = (knot(k as isize), knot(k as isize + 1));
        match self.spline {
            Spline::Linear => mixer.mix(p, q, t),
            Spline::CatmullRom => {
                let (o, r) = (knot(k as isize - 1), knot(k as isize + 2));
                [0, 1, 2].map(|c: usize| {
                    let (a, b) = (0.5 * (q[c] - o[c]), 0.5 * (r[c] - p[c]));
                    let (d, s) = (q[c] - p[c], t);
                    (p[c] + s * (a + s * (3.0 * d - 2.0 * a - b + s * (a + b - 2.0 * d)))).max(0.0)
                })
            }
        }
    }

    /// Bake the table.
    pub fn bake(&self) -> Result<Baked> {
        let ordered = self.cutoffs.windows(2).all(|w| w[0] <= w[1]);
        if !ordered || self.cutoffs[0] < 0.0 || self.cutoffs[3] > 1.0 {
            let reason = format!("must rise within [0, 1], got {:?}", self.cutoffs);
            return Err(Error::Data { name: "cutoffs", reason });
        }
        for list in &self.colors {
            if list.is_empty() {
                return Err(Error::Empty { name: "palette" });
            }
            if list.iter().flatten().any(|x| !(*x >= 0.0 && x.is_finite())) {
                return Err(Error::Data { name: "palette", reason: "must hold finite colours, at least 0".into() });
            }
        }
        let mixer = Mixer { basis: self.pigment.then(SpectralBasis::new) };
        let color = |k: usize| self.color(k as f64 / STEPS as f64, &mixer).map(|x| x as f32);
        Ok(Baked { colors: (0..=STEPS).map(color).collect(), cutoffs: self.cutoffs })
    }
}

struct Mixer {
    basis: Option<SpectralBasis>,
}

impl Mixer {
    fn mix(&self, a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
        match &self.basis {
            _ if t <= 0.0 || a == b => a,
            _ if t >= 1.0 => b,
            None => [0, 1, 2].map(|k: usize| a[k] + (b[k] - a[k]) * t),
            Some(basis) => Paint::new(basis, a).mix(&Paint::new(basis, b), t, basis),
        }
    }
}

impl Baked {
    /// Linear RGB of a lightness.
    pub fn color(&self, lightness: f64) -> [f64; 3] {
        let x = lightness.clamp(0.0, 1.0) * STEPS as f64;
        let k = (x as usize).min(STEPS - 1);
        let t = x - k as f64;
        let (p, q) = (self.colors[k], self.colors[k + 1]);
        [0, 1, 2].map(|c: usize| f64::from(p[c]) + (f64::from(q[c]) - f64::from(p[c])) * t)
    }

    /// Which palette: 0 dark, 1 middle, 2 light, and between.
    pub fn which(&self, lightness: f64) -> f64 {
        let [a, b, c, d] = self.cutoffs;
        linear_step(lightness, a, b) + linear_step(lightness, c, d)
    }
}

/// What distance does to colours (S16).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AerialPerspective {
    /// Linear RGB towards which colours go.
    pub color: [f64; 3],
    /// How far they go \[1\].
    pub strength: f64,
    /// How much of the saturation is forbidden \[1\].
    pub saturation: f64,
    /// Least and most value (HSV of sRGB) \[1\].
    pub value: [f64; 2],
    /// Bias of the distance \[1\].
    pub bias: f64,
}

impl AerialPerspective {
    /// A colour at the distance `d` in `[0, 1]`; unchanged at 0.
    pub fn apply(&self, rgb: [f64; 3], d: f64, curve: BiasGain) -> [f64; 3] {
        self.apply_three([rgb; 3], curve.bias(d, self.bias))[0]
    }

    /// The same for three colours, whose channels go through the transfer function side by side; the distance has its bias.
    pub(super) fn apply_three(&self, rgb: [[f64; 3]; 3], d: f64) -> [[f64; 3]; 3] {
        if d == 0.0 {
            return rgb;
        }
        let mut flat = [0.0; 9];
        for (k, x) in rgb.as_flattened().iter().enumerate() {
            flat[k] = x + (self.color[k % 3] - x) * self.strength * d;
        }
        lanes::run(
            #[inline(always)]
            || {
                for x in &mut flat {
                    *x = encode(*x);
                }
            },
        );
        let (most, low, high) = (1.0 - self.saturation * d, self.value[0] * d, 1.0 + (self.value[1] - 1.0) * d);
        for color in flat.as_chunks_mut::<3>().0 {
            let [h, s, v] = hsv_of(*color);
            *color = rgb_of([h, s.min(most), v.min(high).max(low)]);
        }
        lanes::run(
            #[inline(always)]
            || {
                for x in &mut flat {
                    *x = decode(*x);
                }
            },
        );
        [[flat[0], flat[1], flat[2]], [flat[3], flat[4], flat[5]], [flat[6], flat[7], flat[8]]]
    }
}

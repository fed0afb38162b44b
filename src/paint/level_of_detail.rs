//! Level of detail of strokes: size compensation, how strokes grow while others fade away, so that an object keeps its
//! silhouette and its tone (D5-D8).
//!
//! No closed law of growth holds the silhouette: with the usual square root of the number of strokes a crown of which
//! the outermost go first (the thesis' way) loses up to a third of its area. So the law is solved for each object when
//! it is built, with the masks it will be painted with, looked at from several sides. At evenly spaced distances `d`,
//! one after the other, growth is found such that the area where at least half of the light is kept away equals that at
//! `d = 0`; then, from the weights of the strokes in the picture, how much of the darkness inside goes such that the
//! mean luminance does, and a factor of the lightness for what that cannot do. Less darkness lightens the side in
//! shadow more than that in the sun, and no factor undoes it: so no more goes than must (the thesis takes all of it
//! away). Growth never falls with distance. [`simplification`](super::simplification) chooses who fades first.

use super::light::{DirectionalLight, Lightness};
use super::mask::MaskShape;
use super::shadow;
use super::side_view::{SideView, orbit_views};
use super::sprite::{PerStroke, Sprites, check_len};
use super::stroke::{Shader, Strokes};
use crate::error::{Error, Result, in_range};
use crate::job::Job;

/// Sides from which an object is painted; of an even number half would show the same outline as the other, reversed.
const SIDES: usize = 5;
/// Largest growth.
const MOST: f64 = 16.0;
/// Error of the area at which the search for the growth ends \[1\].
const NEAR: f64 = 2e-3;

/// With `shadows`, what the strokes leave each other of the first light at each distance is part of their tone.
///
/// One row of numbers each: growth, factor of lightness and fraction of the darkness
/// inside that is left at `knots` distances from 0 to 1. The strokes are one
/// object's; distance's colours are left out.
pub fn solve(
    job: &Job,
    strokes: &Strokes<'_>,
    shader: &Shader,
    lights: &[DirectionalLight],
    mask_shape: MaskShape,
    shadows: bool,
    knots: usize,
    pixels: usize,
) -> Result<Vec<f64>> {
    in_range("knots", knots as f64, 2.0, 1024.0, "1")?;
    let n = checked(strokes, pixels)?;
    if n == 0 {
        return Ok(vec![1.0; 3 * knots]);
    }
    let views = orbit_views(job, strokes, shader, lights, mask_shape, [SIDES, pixels], [0.25, 0.2])?;
    job.expect(knots as u64);
    let problem = LodProblem { job, strokes, shader, lights, mask_shape, views: &views, shadows, pixels };
    let opacity = problem.opacity(0.0);
    let area = problem.area(1.0, &opacity)?;
    let tone = problem.tone(0.0, 1.0, &opacity)?;
    let wanted = tone.of(1.0, &tone.light(1.0));
    let mut law = vec![1.0; 3 * knots];
    let mut slope = 1.0;
    for k in 1..knots {
        let d = k as f64 / (knots - 1) as f64;
        let opacity = problem.opacity(d);
        let last = law[k - 1];
        let guess = if k > 1 { last * last / law[k - 2] } else { last };
        let growth = problem.growth(&opacity, area, last, guess, &mut slope)?;
        law[k] = growth;
        let tone = problem.tone(d, growth, &opacity)?;
        [law[knots + k], law[2 * knots + k]] = tone.kept(wanted, law[knots + k - 1]);
        job.advance(1)?;
    }
    job.advance(1)?;
    Ok(law)
}

/// The number of strokes, if they can be looked at from all sides.
pub(super) fn checked(strokes: &Strokes<'_>, pixels: usize) -> Result<usize> {
    in_range("pixels", pixels as f64, 16.0, 4096.0, "px")?;
    let n = strokes.validate()?;
    check_len("position", strokes.position.len(), n, 3)?;
    if strokes.position.iter().all(|x| x.is_finite()) {
        return Ok(n);
    }
    Err(Error::Data { name: "position", reason: format!("must be {n} finite points") })
}

/// An object and all that it takes to paint it.
struct LodProblem<'a> {
    job: &'a Job,
    strokes: &'a Strokes<'a>,
    shader: &'a Shader,
    lights: &'a [DirectionalLight],
    mask_shape: MaskShape,
    views: &'a [SideView],
    shadows: bool,
    pixels: usize,
}

/// What the mean luminance of a silhouette depends on, as a factor of lightness changes it.
struct Tone<'a> {
    problem: &'a LodProblem<'a>,
    weight: Vec<f64>,
    lit: Vec<f32>,
}

impl Tone<'_> {
    /// Lightness of each stroke and colour of its light, where the fraction `dark` of the darkness inside is left.
    fn light(&self, dark: f64) -> Vec<Lightness> {
        let LodProblem { strokes, shader, lights, .. } = self.problem;
        let lit = |i: usize| f64::from(if self.lit.is_empty() { strokes.light_visibility.get(i) } else { self.lit[i] });
        (0..strokes.count()).map(|i| strokes.light(i, 1.0 - dark, lit(i), shader, lights)).collect()
    }

    /// Mean luminance.
    fn of(&self, factor: f64, light: &[Lightness]) -> f64 {
        let LodProblem { shader, strokes, .. } = self.problem;
        let tint = strokes.tints.first().copied().unwrap_or(0.5);
        let (mut sum, mut whole) = (0.0, 0.0);
        for (light, &w) in light.iter().zip(&self.weight) {
            if w > 0.0 {
                let lightness = (light.full * factor).min(1.0);
                let [r, g, b] = shader.near_color(lightness, Some(tint), light.color).map(|x| x * shader.exposure);
                sum += w * (0.2126 * r + 0.7152 * g + 0.0722 * b);
                whole += w;
            }
        }
        if whole > 0.0 { sum / whole } else { 0.0 }
    }

    /// Factor of lightness, about `guess`, and darkness left at which the mean luminance is `wanted`.
    fn kept(&self, wanted: f64, guess: f64) -> [f64; 2] {
        let light = self.light(1.0);
        let mut dark = (1.0, self.of(1.0, &light) / wanted);
        if !(wanted > 0.0 && dark.1 > 0.0) {
            return [1.0; 2];
        }
        // Too light with all of it, or too dark with none.
        if dark.1 >= 1.0 {
            return [self.factor(wanted, guess, &light), 1.0];
        }
        let light = self.light(0.0);
        let mut bright = (0.0, self.of(1.0, &light) / wanted);
        if bright.1 <= 1.0 {
            return [self.factor(wanted, guess, &light), 0.0];
        }
        let mut left = 1.0;
        for _ in 0..4 {
            left = dark.0 + (bright.0 - dark.0) * (1.0 - dark.1) / (bright.1 - dark.1);
            let now = (left, self.of(1.0, &self.light(left)) / wanted);
            if (now.1 - 1.0).abs() < 2e-3 {
                break;
            }
            if now.1 > 1.0 {
                bright = now;
            } else {
                dark = now;
            }
        }
        [1.0, left]
    }

    /// The factor at which the mean luminance is `wanted`, about `guess`.
    fn factor(&self, wanted: f64, guess: f64, light: &[Lightness]) -> f64 {
        let (mut factor, mut now) = (guess, self.of(guess, light));
        for _ in 0..8 {
            if !(now > 0.0 && wanted > 0.0) || (now / wanted - 1.0).abs() < 1e-4 {
                break;
            }
            factor = f64::clamp(factor * wanted / now, 0.25, 4.0);
            now = self.of(factor, light);
        }
        factor
    }
}

impl LodProblem<'_> {
    /// Opacities at the distance `d`.
    fn opacity(&self, d: f64) -> Vec<f32> {
        let Self { strokes, shader, .. } = self;
        (0..strokes.count()).map(|i| (shader.opacity * strokes.visible(i, d, shader)) as f32).collect()
    }

    /// Area of the silhouette from all sides \[px\].
    fn area(&self, growth: f64, opacity: &[f32]) -> Result<f64> {
        let areas = self.job.map(self.views.len(), |k| self.views[k].area(growth, opacity))?;
        Ok(areas.iter().sum::<usize>() as f64)
    }

    /// What the strokes are worth and how light they are at the distance `d`.
    fn tone(&self, d: f64, growth: f64, opacity: &[f32]) -> Result<Tone<'_>> {
        let n = self.strokes.count();
        let parts = self.job.map(self.views.len(), |k| {
            let mut weight = vec![0.0; n];
            self.views[k].weigh(growth, opacity, &mut weight)?;
            Ok(weight)
        })?;
        let weight = (0..n).map(|i| parts.iter().map(|part| part[i]).sum()).collect();
        Ok(Tone { problem: self, weight, lit: self.lit(d, growth)? })
    }

    /// What the strokes leave each other of the first light, at a distance; nothing where shadows are not wanted.
    fn lit(&self, d: f64, growth: f64) -> Result<Vec<f32>> {
        let (true, Some(light)) = (self.shadows, self.lights.first()) else { return Ok(Vec::new()) };
        let n = self.strokes.count();
        // Coarser ones let too much light through.
        let pixels = self.pixels * 8 / 5;
        let size: Vec<f32> = self.strokes.size.iter().map(|x| x * growth as f32).collect();
        let (centre, size, depth) = shadow::view(self.strokes.position, &size, light.to.into(), pixels)?;
        let frequency = |i: usize| {
            let [base, by_centre, by_light] = self.shader.frequency;
            base + by_centre * f64::from(self.strokes.centre.get(i)) + 0.5 * by_light
        };
        let along = |k: usize| (0..n).map(|i| (frequency(i) * self.shader.stretch[k]) as f32).collect::<Vec<f32>>();
        let casts: Vec<f32> = (0..n).map(|i| self.strokes.visible(i, d, self.shader) as f32).collect();
        let (s, t) = (along(0), along(1));
        let black = vec![0.0; 3 * n];
        let sprites = Sprites {
            centre: &centre,
            size: &size,
            depth: &depth,
            color: &black,
            variation: None,
            rotation: PerStroke::One(0.0),
            opacity: PerStroke::One(self.shader.opacity as f32),
            label: PerStroke::Many(self.strokes.label),
            frequency_s: PerStroke::Many(&s),
            frequency_t: PerStroke::Many(&t),
            frequency_color: PerStroke::One(0.0),
            fullness: PerStroke::One(self.mask_shape.fullness),
            feather_min: PerStroke::One(self.mask_shape.feather[0]),
            feather_max: PerStroke::One(self.mask_shape.feather[1]),
            foreshortening: PerStroke::One(1.0),
            delta: PerStroke::One(0.0),
            id: None,
        };
        let mut out = vec![1.0; n];
        shadow::light_visibility(&Job::new(self.job.threads()), &sprites, Some(&casts), pixels, &mut out)?;
        Ok(out)
    }

    /// The growth, not below `least`, at which the area is `wanted`, sought from `guess` on. `slope` is that of the
    /// logarithm of the area by that of the growth, kept from search to search.
    fn growth(&self, opacity: &[f32], wanted: f64, least: f64, guess: f64, slope: &mut f64) -> Result<f64> {
        if wanted == 0.0 {
            return Ok(least);
        }
        let (mut low, mut high) = (least, MOST);
        let (mut at, mut best) = (guess.clamp(least, MOST), (f64::INFINITY, least));
        let mut last: Option<(f64, f64)> = None;
        for _ in 0..10 {
            let area = self.area(at, opacity)?;
            let error = area / wanted - 1.0;
            if error.abs() < best.0 {
                best = (error.abs(), at);
            }
            if error.abs() < NEAR || (at <= least && error > 0.0) {
                break;
            }
            if error > 0.0 {
                high = high.min(at);
            } else {
                low = low.max(at);
            }
            if high - low < 1e-3 {
                break;
            }
            // Areas are counted: a slope from two that are near each other is chance.
            if let Some((before, from)) = last
                && (at / before).ln().abs() > 3e-3
                && area > 0.0
                && from > 0.0
            {
                *slope = ((area / from).ln() / (at / before).ln()).clamp(0.2, 2.0);
            }
            last = Some((at, area));
            let next = if area > 0.0 { at * (wanted / area).powf(1.0 / *slope) } else { 2.0 * at };
            at = if next > low && next < high { next } else { 0.5 * (low + high.min(2.0 * low)) };
            at = at.clamp(least, MOST);
        }
        Ok(best.1)
    }
}

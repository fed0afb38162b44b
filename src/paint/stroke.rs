//! The shader of strokes in the world: lit, coloured and projected in the thesis' order: illumination, its
//! modification, shadow, mask, palette, atmosphere. Every stage can be read from the table that [`shade`] fills.
//!
//! A stroke is a rectangle in the picture's plane (L7). Everything is taken from the eye in `f64` before it becomes
//! `f32`, so a scene far from the origin paints the same. Its depth is its distance from the eye, its `d` its distance
//! along the view between two circles (D1), of its object's centre if it has one (D4).
//!
//! Frequencies are `f_0 + k_c centre + k_l lightness` (S7; `f_0` is ours), with the lightness of the foreground without
//! shadows: masks that followed light and distance would change the silhouette, and shimmer. In the extreme foreground
//! strokes keep a painter's size: above the largest they hardly grow, `w / (1 + (w / largest)^4)^(1/4)`, and those
//! inside a crown give way first (the thesis' V.3).

use glam::DVec3;

use super::light::{DirectionalLight, Illumination, Lightness, ShadingPoint};
use super::palette::{AerialPerspective, Baked, linear_step};
use super::sprite::{PerStroke, check_len};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::geometry::Pinhole;
use crate::math::noise::mix32;

/// Strokes, one column for each property.
#[derive(Debug, Clone, Copy)]
pub struct Strokes<'a> {
    /// Where \[m\].
    pub position: &'a [f64],
    /// Unit normals of the surface or crown they stand for.
    pub normal: &'a [f32],
    /// Width and height \[m\].
    pub size: &'a [f32],
    /// Seeds.
    pub label: &'a [u32],
    /// 0 at the centre of its crown or deepest in its surface, 1 outermost \[1\].
    pub centre: PerStroke<'a, f32>,
    /// 0 where its branch begins, 1 at the tip \[1\].
    pub branch: PerStroke<'a, f32>,
    /// Distances `d` at which it begins to fade and is gone \[1\].
    pub fade: Option<&'a [f32]>,
    /// Visibility: the fraction of the light that reaches it \[1\].
    pub light_visibility: PerStroke<'a, f32>,
    /// Index of its object.
    pub object: Option<&'a [u32]>,
    /// Centres \[m\] of the objects.
    pub centres: &'a [f64],
    /// Where each object's tint lies between the two \[1\].
    pub tints: &'a [f64],
    /// For each object, at evenly spaced distances `d` from 0 to 1: growth of its strokes, then factors of their
    /// lightness, then fractions of the inner darkness that are left ([`level_of_detail`](super::level_of_detail))
    /// \[1\].
    pub size_compensation: &'a [f64],
}

/// Distances along the view \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LodRanges {
    /// Up to which all is foreground (`d = 0`), and from which all is background (`d = 1`).
    pub lod_range: [f64; 2],
    /// From which on inner strokes begin to give way, and where they are gone; the first is the larger.
    pub near_fade: [f64; 2],
}

/// All that is the same for every stroke.
#[derive(Debug, Clone)]
pub struct Shader {
    /// Lightness.
    pub illumination: Illumination,
    /// Fraction of a random normal in the normal \[1\].
    pub roughness: f64,
    /// `f_0`, `k_c`, `k_l` \[1\].
    pub frequency: [f64; 3],
    /// Factors of the frequency along `s` and `t` \[1\].
    pub stretch: [f64; 2],
    /// Largest opacity \[1\].
    pub opacity: f64,
    /// Gain of the fading \[1\].
    pub fade_gain: f64,
    /// Fraction of the height that is left at a crest \[1\].
    pub crest: f64,
    /// Lightness that the colour's noise adds or takes \[1\].
    pub variation: f64,
    /// Colours of lightness.
    pub palette: Baked,
    /// Two tints.
    pub tints: [[f64; 3]; 2],
    /// How much of them \[1\].
    pub tint: f64,
    /// How much the light's colour colours \[1\].
    pub light_tint: f64,
    /// What distance does.
    pub aerial_perspective: AerialPerspective,
    /// Where near and far are.
    pub lod: LodRanges,
    /// Largest stroke, of the picture's height \[1\].
    pub max_stroke_size: f64,
    /// Fraction of a crown's radius from which strokes give way in the extreme foreground \[1\].
    pub near_culling: f64,
    /// Factor of all colours.
    pub exposure: f64,
}

/// Numbers in a row of the table: lightness S1, S2, factor of the shadow, lightness; palette, `d`; frequencies;
/// opacity; centre, size \[px\]; colour, variation; squeeze.
pub const ROW: usize = 20;

/// A unit vector, evenly distributed.
fn random_normal(label: u32) -> DVec3 {
    let unit = |seed: u32| f64::from(mix32(label ^ seed)) / f64::from(u32::MAX);
    let (z, turn) = (2.0 * unit(0x51ab_c0de) - 1.0, std::f64::consts::TAU * unit(0x0dd_ba11));
    let flat = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(flat * turn.cos(), flat * turn.sin(), z)
}

/// A table over `[0, 1]` between its knots; 1 if it is empty.
fn lerp_table(knots: &[f64], x: f64) -> f64 {
    match knots {
        [] => 1.0,
        [one] => *one,
        _ => {
            let at = x.clamp(0.0, 1.0) * (knots.len() - 1) as f64;
            let k = (at as usize).min(knots.len() - 2);
            knots[k] + (knots[k + 1] - knots[k]) * (at - k as f64)
        }
    }
}

/// Fraction of a stroke that is left at closeness `close` in `[0, 1]`: inner strokes go first, the outermost stay.
pub fn near_visibility(centre: f64, close: f64, culling: f64) -> f64 {
    const SOFT: f64 = 0.15;
    ((centre - close * culling) / SOFT + 1.0).clamp(0.0, 1.0)
}

impl Strokes<'_> {
    /// How many.
    pub fn count(&self) -> usize {
        self.label.len()
    }

    pub(super) fn validate(&self) -> Result<usize> {
        let n = self.count();
        check_len("position", self.position.len(), n, 3)?;
        check_len("normal", self.normal.len(), n, 3)?;
        check_len("size", self.size.len(), n, 2)?;
        self.centre.expect("center_ratio", n)?;
        self.branch.expect("branch_ratio", n)?;
        self.fade.map_or(Ok(()), |f| check_len("fade", f.len(), n, 2))?;
        self.light_visibility.expect("lit", n)?;
        let objects = self.tints.len();
        check_len("centers", self.centres.len(), objects, 3)?;
        if !(self.size_compensation.is_empty() || self.size_compensation.len().is_multiple_of(3 * objects)) {
            check_len("growth", self.size_compensation.len(), objects, 3)?;
        }
        if let Some(list) = self.object {
            check_len("object", list.len(), n, 1)?;
            if let Some(&wrong) = list.iter().find(|&&k| k as usize >= objects) {
                let reason = format!("must be below the number of objects, {objects}, got {wrong}");
                return Err(Error::Data { name: "object", reason });
            }
        }
        Ok(n)
    }

    /// Fraction of a stroke that is left at the distance `d` (D5, S11).
    pub(super) fn visible(&self, i: usize, d: f64, shader: &Shader) -> f64 {
        let left = self.fade.map_or(1.0, |f| 1.0 - linear_step(d, f64::from(f[2 * i]), f64::from(f[2 * i + 1])));
        shader.illumination.curve.gain(left, shader.fade_gain)
    }

    /// Distance `d` of a stroke: its object's along the view, or its own.
    fn far(&self, i: usize, along: f64, shader: &Shader, camera: &Pinhole) -> f64 {
        let anchor = self.object.map_or(along, |list| {
            let centre = DVec3::from_slice(&self.centres[3 * list[i] as usize..]);
            (centre - camera.position).dot(camera.forward)
        });
        linear_step(anchor, shader.lod.lod_range[0], shader.lod.lod_range[1])
    }

    /// Growth, factor of lightness and darkness left of a stroke's object at the distance `d`; without a law the
    /// darkness goes with distance.
    fn law(&self, i: usize, d: f64, knots: usize) -> [f64; 3] {
        self.object.filter(|_| knots > 0).map_or([1.0, 1.0, 1.0 - d], |list| {
            let first = 3 * list[i] as usize * knots;
            [0, 1, 2].map(|k: usize| lerp_table(&self.size_compensation[first + k * knots..][..knots], d))
        })
    }

    fn knots(&self) -> usize {
        if self.tints.is_empty() { 0 } else { self.size_compensation.len() / self.tints.len() / 3 }
    }

    /// Normal of the surface or crown a stroke stands for.
    fn facing(&self, i: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|k: usize| f64::from(self.normal[3 * i + k])))
    }

    /// Lightness of a stroke as at the distance `d`, if the fraction `lit` of the light reaches it.
    pub(super) fn light(
        &self,
        i: usize,
        d: f64,
        light_visibility: f64,
        shader: &Shader,
        lights: &[DirectionalLight],
    ) -> Lightness {
        let (aggregate, w) = (self.facing(i), shader.roughness);
        let mixed = if w > 0.0 { aggregate * (1.0 - w) + random_normal(self.label[i]) * w } else { aggregate };
        let normal = mixed.normalize_or(aggregate).to_array();
        let [centre, branch] = [&self.centre, &self.branch].map(|c| f64::from(c.get(i)).clamp(0.0, 1.0));
        shader.illumination.of(lights, &ShadingPoint { normal, centre, branch, far: d, light_visibility })
    }

    pub(super) fn at(&self, i: usize) -> DVec3 {
        DVec3::from_slice(&self.position[3 * i..])
    }
}

/// Fill in a row of [`ROW`] numbers and the depth \[m\] of each stroke. `far` and `close` are [`LodRanges`] along the
/// view.
pub fn shade(
    job: &Job,
    strokes: &Strokes<'_>,
    shader: &Shader,
    lights: &[DirectionalLight],
    camera: &Pinhole,
    rows: &mut [f32],
    depth: &mut [f64],
) -> Result<()> {
    const CHUNK: usize = 2048;
    let n = strokes.validate()?;
    camera.validate()?;
    check_len("rows", rows.len(), n, ROW)?;
    check_len("depth", depth.len(), n, 1)?;
    job.chunks(depth, CHUNK, |chunk, depth| {
        for (k, d) in depth.iter_mut().enumerate() {
            *d = (strokes.at(chunk * CHUNK + k) - camera.position).length();
        }
        Ok(())
    })?;
    let knots = strokes.knots();
    job.chunks(rows, ROW * CHUNK, |chunk, rows| {
        for (k, row) in rows.chunks_exact_mut(ROW).enumerate() {
            let i = chunk * CHUNK + k;
            let object = strokes.object.map(|list| list[i] as usize);
            shade_stroke(strokes, i, object, knots, shader, lights, camera, row);
        }
        Ok(())
    })
}

/// Fraction and growth of each stroke at its distance, two numbers each: what a shadow map of the frame needs.
pub fn detail(job: &Job, strokes: &Strokes<'_>, shader: &Shader, camera: &Pinhole, out: &mut [f32]) -> Result<()> {
    const CHUNK: usize = 4096;
    let n = strokes.validate()?;
    check_len("out", out.len(), n, 2)?;
    let knots = strokes.knots();
    job.chunks(out, 2 * CHUNK, |chunk, out| {
        for (k, pair) in out.chunks_exact_mut(2).enumerate() {
            let i = chunk * CHUNK + k;
            let along = (strokes.at(i) - camera.position).dot(camera.forward);
            let d = strokes.far(i, along, shader, camera);
            pair[0] = strokes.visible(i, d, shader) as f32;
            pair[1] = strokes.law(i, d, knots)[0] as f32;
        }
        Ok(())
    })
}

fn shade_stroke(
    strokes: &Strokes<'_>,
    i: usize,
    object: Option<usize>,
    knots: usize,
    shader: &Shader,
    lights: &[DirectionalLight],
    camera: &Pinhole,
    row: &mut [f32],
) {
    let from_eye = strokes.at(i) - camera.position;
    let along = from_eye.dot(camera.forward);
    let LodRanges { near_fade, .. } = shader.lod;
    let d = strokes.far(i, along, shader, camera);
    let closeness = 1.0 - linear_step(along, near_fade[1], near_fade[0]);
    let centre = f64::from(strokes.centre.get(i)).clamp(0.0, 1.0);
    let aggregate = strokes.facing(i);
    let [growth, factor, dark] = strokes.law(i, d, knots);
    let light = strokes.light(i, 1.0 - dark, f64::from(strokes.light_visibility.get(i)), shader, lights);

    let [base, by_centre, by_light] = shader.frequency;
    let frequency = base + by_centre * centre + by_light * light.steady;
    let curve = shader.illumination.curve;
    let nearby = curve.gain(near_visibility(centre, closeness, shader.near_culling), shader.fade_gain);
    let visible = strokes.visible(i, d, shader) * nearby;
    let facing = (aggregate.dot(from_eye) / from_eye.length().max(1e-300)).abs();
    let foreshortening = shader.crest + (1.0 - shader.crest) * curve.bias(facing.min(1.0), 0.75);

    let lightness = (light.full * factor).min(1.0);

    let biased = curve.bias(d, shader.aerial_perspective.bias);
    let at = [lightness, lightness - shader.variation, lightness + shader.variation];
    let [color, low, high] = shader.colors(at, biased, object.map(|k| strokes.tints[k]), light.color);
    let mut vary = [0.0; 3];
    if shader.variation > 0.0 {
        // Noise is within [-1, 1]: so no colour falls below zero, and the mean is the stroke's own.
        vary = [0, 1, 2].map(|k: usize| (0.5 * (high[k] - low[k])).clamp(-color[k], color[k]));
    }

    let scale = 0.5 * camera.height as f64 / camera.half_tan;
    let (mut centre_px, mut size) = ([0.0; 2], [0.0; 2]);
    if along > 1e-9 {
        let at = |v: f64| (v / along * scale).clamp(-1e7, 1e7);
        centre_px = [
            0.5 * camera.width as f64 + at(from_eye.dot(camera.right)),
            0.5 * camera.height as f64 - at(from_eye.dot(camera.up)),
        ];
        size = [0, 1].map(|k: usize| f64::from(strokes.size[2 * i + k]) * growth * scale / along);
        let much = size[0].max(size[1]) / (shader.max_stroke_size * camera.height as f64);
        let smaller = if much > 1e6 { 1.0 / much } else { (1.0 + much.powi(4)).powf(-0.25) };
        size = size.map(|s| s * smaller);
    }
    let out = [
        light.plain,
        light.placed,
        light.shadow,
        lightness,
        shader.palette.which(lightness),
        d,
        frequency * shader.stretch[0],
        frequency * shader.stretch[1],
        shader.opacity * visible,
        centre_px[0],
        centre_px[1],
        size[0],
        size[1],
        color[0],
        color[1],
        color[2],
        vary[0],
        vary[1],
        vary[2],
        foreshortening,
    ];
    for (to, x) in row.iter_mut().zip(out) {
        *to = x as f32;
    }
}

impl Shader {
    /// Colours of lightnesses; `biased` is the distance after its bias.
    fn colors(&self, lightness: [f64; 3], biased: f64, tint: Option<f64>, light: [f64; 3]) -> [[f64; 3]; 3] {
        let rgb = lightness.map(|l| self.near_color(l, tint, light));
        self.aerial_perspective.apply_three(rgb, biased).map(|rgb| rgb.map(|x| x * self.exposure))
    }

    /// The colour of a lightness before the air.
    pub(super) fn near_color(&self, lightness: f64, tint: Option<f64>, light: [f64; 3]) -> [f64; 3] {
        let mut rgb = self.palette.color(lightness);
        if let Some(t) = tint
            && self.tint > 0.0
        {
            for k in 0..3 {
                let wanted = self.tints[0][k] + (self.tints[1][k] - self.tints[0][k]) * t;
                rgb[k] += (wanted - rgb[k]) * self.tint;
            }
        }
        [0, 1, 2].map(|k: usize| rgb[k] * (1.0 + (light[k] - 1.0) * self.light_tint))
    }
}

//! How strokes grow while others fade away, so that an object keeps its silhouette and its tone (D5-D8).
//!
//! Where the outermost leaves go first (the thesis' way), no closed law of growth holds the silhouette: with the usual
//! square root of the number of strokes a crown loses up to a third of its area. So the law is solved for each object
//! when it is built: at evenly spaced distances `d` the object is painted from several sides by the real pipeline, the
//! growth is found by bisection such that the area where at least half of the light is kept away equals that at `d = 0`,
//! and then a factor of the lightness such that the mean luminance does. Growth never falls with distance.

use glam::DVec3;

use super::composite::{Canvas, Order, composite};
use super::light::Light;
use super::shadow;
use super::sprite::{Column, Sprites};
use super::stroke::{Circles, ROW, Shader, Strokes, shade};
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::geometry::Pinhole;

/// Shape of the masks, which [`shade`] does not choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Bias of the edge \[1\].
    pub fullness: f32,
    /// Noise below which there is no paint, and above which it is full \[1\].
    pub feather: [f32; 2],
}

/// Sides from which an object is painted.
const VIEWS: usize = 3;
/// Largest growth.
const MOST: f64 = 16.0;

/// With `shadows`, what the strokes leave each other of the first light at each distance is part of their tone.
///
/// One row of numbers each: growth and factor of lightness at `knots` distances from 0 to 1. The strokes are one
/// object's; distance's colours are left out.
pub fn solve(
    job: &Job,
    strokes: &Strokes<'_>,
    shader: &Shader,
    lights: &[Light],
    look: Look,
    shadows: bool,
    knots: usize,
    pixels: usize,
) -> Result<Vec<f64>> {
    in_range("knots", knots as f64, 2.0, 1024.0, "1")?;
    in_range("pixels", pixels as f64, 16.0, 4096.0, "px")?;
    let n = strokes.count();
    if n == 0 {
        return Ok(vec![1.0; 2 * knots]);
    }
    if strokes.position.len() != 3 * n || !strokes.position.iter().all(|x| x.is_finite()) {
        return Err(Error::Data { name: "position", reason: format!("must be {n} finite points") });
    }
    let mut shader = shader.clone();
    shader.distance.strength = 0.0;
    shader.distance.saturation = 0.0;
    shader.distance.value = [0.0, 1.0];
    shader.largest = 1e6;
    let views = cameras(strokes, pixels);
    job.expect(knots as u64);
    let object = vec![0_u32; n];
    let scene = Scene { strokes, shader: &shader, lights, look, views: &views, shadows, object: &object };
    let lit = scene.lit(job, 0.0, 1.0)?;
    let (area, tone) = scene.measure(&scene.seen(0.0, 1.0, &lit)?, 1.0)?;
    let found = job.map(knots, |k| {
        if k == 0 {
            return Ok([1.0, 1.0]);
        }
        let d = k as f64 / (knots - 1) as f64;
        let growth = scene.growth(&scene.seen(d, 1.0, &lit)?, area)?;
        let lit = scene.lit(&Job::serial(), d, growth)?;
        let (mut factor, mut now) = (1.0, scene.measure(&scene.seen(d, 1.0, &lit)?, growth)?.1);
        for _ in 0..4 {
            if !(now > 0.0 && tone > 0.0) || (now / tone - 1.0).abs() < 2e-3 {
                break;
            }
            factor = f64::clamp(factor * tone / now, 0.25, 4.0);
            now = scene.measure(&scene.seen(d, factor, &lit)?, growth)?.1;
        }
        job.advance(1)?;
        Ok([growth, factor])
    })?;
    let mut most = 1.0_f64;
    let growth = found.iter().map(|pair| {
        most = most.max(pair[0]);
        most
    });
    Ok(growth.collect::<Vec<_>>().into_iter().chain(found.iter().map(|pair| pair[1])).collect())
}

/// Cameras around the strokes, far enough for a nearly parallel view.
fn cameras(strokes: &Strokes<'_>, pixels: usize) -> Vec<(Pinhole, f64)> {
    let n = strokes.count();
    let (mut low, mut high, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0.0_f64);
    for i in 0..n {
        let p = DVec3::from_slice(&strokes.position[3 * i..]);
        (low, high) = (low.min(p), high.max(p));
        most = most.max(f64::from(strokes.size[2 * i].max(strokes.size[2 * i + 1])));
    }
    let centre = 0.5 * (low + high);
    // The diagonal of the box leaves room for strokes that grow.
    let radius = (0.5 * (high - low).length()).max(0.5 * (high - low).max_element() + most).max(1e-6);
    let away = 8.0 * radius;
    (0..VIEWS)
        .map(|k| {
            let turn = std::f64::consts::TAU * (k as f64 + 0.25) / VIEWS as f64;
            let forward = DVec3::new(turn.cos(), turn.sin(), 0.0);
            let camera = Pinhole {
                position: centre - forward * away,
                right: DVec3::new(turn.sin(), -turn.cos(), 0.0),
                up: DVec3::Z,
                forward,
                half_tan: radius / (away - radius),
                width: pixels,
                height: pixels,
            };
            (camera, away)
        })
        .collect()
}

/// An object and all that it takes to paint it.
struct Scene<'a> {
    strokes: &'a Strokes<'a>,
    shader: &'a Shader,
    lights: &'a [Light],
    look: Look,
    views: &'a [(Pinhole, f64)],
    shadows: bool,
    object: &'a [u32],
}

/// The strokes of one view.
struct Seen {
    centre: Vec<f32>,
    size: Vec<f32>,
    depth: Vec<f64>,
    color: Vec<f32>,
    /// Opacity, frequencies, squeeze.
    rest: [Vec<f32>; 4],
}

impl Scene<'_> {
    /// The strokes at the distance `d`, not grown, with a factor of their lightness, from every side.
    fn seen(&self, d: f64, factor: f64, lit: &[f32]) -> Result<Vec<Seen>> {
        let n = self.strokes.count();
        let view = |(camera, away): &(Pinhole, f64)| {
            let mut shader = self.shader.clone();
            // The object's centre is `away` along the view: so it has this `d`.
            shader.circles = Circles { far: [away - d, away - d + 1.0], close: [0.0, 0.0] };
            let centre = (camera.position + camera.forward * *away).to_array();
            let strokes = Strokes {
                object: Some(self.object),
                centres: &centre,
                tints: &[0.5],
                growth: &[1.0, factor],
                lit: if lit.is_empty() { self.strokes.lit } else { Column::Many(lit) },
                ..*self.strokes
            };
            let (mut rows, mut depth) = (vec![0.0; ROW * n], vec![0.0; n]);
            shade(&Job::serial(), &strokes, &shader, self.lights, camera, &mut rows, &mut depth)?;
            let pick = |from: usize, many: usize| -> Vec<f32> {
                rows.chunks_exact(ROW).flat_map(|row| row[from..from + many].iter().copied()).collect()
            };
            let rest = [8, 6, 7, 19].map(|k: usize| pick(k, 1));
            Ok(Seen { centre: pick(9, 2), size: pick(11, 2), depth, color: pick(13, 3), rest })
        };
        self.views.iter().map(view).collect()
    }

    /// What the strokes leave each other of the first light, at a distance; nothing where shadows are not wanted.
    fn lit(&self, job: &Job, d: f64, growth: f64) -> Result<Vec<f32>> {
        let (true, Some(light)) = (self.shadows, self.lights.first()) else { return Ok(Vec::new()) };
        let n = self.strokes.count();
        let size: Vec<f32> = self.strokes.size.iter().map(|x| x * growth as f32).collect();
        let pixels = self.views[0].0.width;
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
            rotation: Column::One(0.0),
            opacity: Column::One(self.shader.opacity as f32),
            label: Column::Many(self.strokes.label),
            frequency_s: Column::Many(&s),
            frequency_t: Column::Many(&t),
            frequency_color: Column::One(0.0),
            fullness: Column::One(self.look.fullness),
            feather_min: Column::One(self.look.feather[0]),
            feather_max: Column::One(self.look.feather[1]),
            squeeze: Column::One(1.0),
            delta: Column::One(0.0),
            id: None,
        };
        let mut out = vec![1.0; n];
        shadow::lit(job, &sprites, Some(&casts), pixels, &mut out)?;
        Ok(out)
    }

    /// Area of the silhouette \[px\] and mean luminance within it, over all views.
    fn measure(&self, seen: &[Seen], growth: f64) -> Result<(f64, f64)> {
        let (mut area, mut light, mut weight) = (0.0, 0.0, 0.0);
        for (seen, (camera, _)) in seen.iter().zip(self.views) {
            let size: Vec<f32> = seen.size.iter().map(|x| x * growth as f32).collect();
            let [opacity, along, down, squeeze] = &seen.rest;
            let sprites = Sprites {
                centre: &seen.centre,
                size: &size,
                depth: &seen.depth,
                color: &seen.color,
                variation: None,
                rotation: Column::One(0.0),
                opacity: Column::Many(opacity),
                label: Column::Many(self.strokes.label),
                frequency_s: Column::Many(along),
                frequency_t: Column::Many(down),
                frequency_color: Column::One(0.0),
                fullness: Column::One(self.look.fullness),
                feather_min: Column::One(self.look.feather[0]),
                feather_max: Column::One(self.look.feather[1]),
                squeeze: Column::Many(squeeze),
                delta: Column::One(0.0),
                id: None,
            };
            let (width, height) = (camera.width, camera.height);
            let (mut rgb, mut through) = (vec![0.0; 3 * width * height], vec![0.0; width * height]);
            let canvas = Canvas { width, height, rgb: &mut rgb, transmittance: &mut through, seen: None };
            composite(&Job::serial(), &sprites, Order::Hard, canvas)?;
            for (pixel, t) in rgb.chunks_exact(3).zip(&through) {
                if *t < 0.5 {
                    area += 1.0;
                    light += f64::from(0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2]);
                    weight += f64::from(1.0 - t);
                }
            }
        }
        Ok((area, if weight > 0.0 { light / weight } else { 0.0 }))
    }

    /// The growth at which the area is `wanted`.
    fn growth(&self, seen: &[Seen], wanted: f64) -> Result<f64> {
        let area = |growth: f64| Ok::<f64, Error>(self.measure(seen, growth)?.0);
        let (mut low, mut high) = (1.0, 1.0);
        let (mut below, mut above) = (area(low)?, f64::INFINITY);
        if below >= wanted || wanted == 0.0 {
            return Ok(1.0);
        }
        while high < MOST && above >= f64::INFINITY {
            high *= 1.5;
            let now = area(high)?;
            if now >= wanted {
                above = now;
            } else {
                (low, below) = (high, now);
            }
        }
        if above >= f64::INFINITY {
            return Ok(MOST);
        }
        for _ in 0..12 {
            if (above - wanted).min(wanted - below) < 2e-3 * wanted || high - low < 1e-3 {
                break;
            }
            // Between the chord and the middle: the area is nearly straight, but counted.
            let chord = low + (high - low) * (wanted - below) / (above - below);
            let middle = 0.5 * chord + 0.25 * (low + high);
            let now = area(middle)?;
            if now >= wanted { (high, above) = (middle, now) } else { (low, below) = (middle, now) }
        }
        Ok(if above - wanted < wanted - below { high } else { low })
    }
}

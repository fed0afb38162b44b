//! The same picture pixel by pixel in `f64`, with the plain formula of the mask and all strokes of each pixel: the
//! oracle of the tests.

use super::composite::{Canvas, Order};
use super::mask::{alpha, noise};
use super::sprite::{Memo, Sprite, Sprites};
use crate::error::Result;
use crate::job::Job;

/// Opacity and colour of a stroke at a point of the picture.
fn at(sprite: &Sprite, x: f64, y: f64) -> (f64, [f64; 3]) {
    let (dx, dy) = (x - f64::from(sprite.x), y - f64::from(sprite.y));
    let [c, s] = sprite.turn.map(f64::from);
    let [w, h] = sprite.half.map(f64::from);
    let (p, q) = ((dx * c - dy * s) / (2.0 * w), (dx * s + dy * c) / (2.0 * h));
    let a = alpha(&sprite.mask, p + 0.5, q + 0.5);
    let f = f64::from(sprite.fine);
    let tone = if a > 0.0 && sprite.fine_carried > 0.0 {
        f64::from(sprite.fine_carried) * noise(sprite.fine_key, p * f, q * f)
    } else {
        0.0
    };
    (a, [0, 1, 2].map(|k: usize| f64::from(sprite.color[k]) + f64::from(sprite.vary[k]) * tone))
}

/// Light and transmittance of strokes at one point, nearest first.
fn hard(sprites: &[Sprite], x: f64, y: f64) -> ([f64; 3], f64) {
    let (mut light, mut transmittance) = ([0.0; 3], 1.0);
    for sprite in sprites {
        let (a, color) = at(sprite, x, y);
        for k in 0..3 {
            light[k] += transmittance * a * color[k];
        }
        transmittance *= 1.0 - a;
    }
    (light, transmittance)
}

/// The same with strokes as layers: every interval between two ends is integrated with all strokes that hold there.
fn slabs(sprites: &[Sprite], x: f64, y: f64) -> ([f64; 3], f64) {
    let parts: Vec<(f64, f64, f64, [f64; 3])> = sprites
        .iter()
        .filter_map(|sprite| {
            let (a, color) = at(sprite, x, y);
            let delta = sprite.delta.max(1e-9 * sprite.depth.abs().max(1.0));
            let sigma = -(1.0 - a).max(1e-6).ln() / (2.0 * delta);
            (a > 0.0).then_some((sprite.depth - delta, sprite.depth + delta, sigma, color))
        })
        .collect();
    let mut ends: Vec<f64> = parts.iter().flat_map(|p| [p.0, p.1]).collect();
    ends.sort_by(f64::total_cmp);
    let (mut light, mut transmittance) = ([0.0; 3], 1.0);
    for pair in ends.windows(2) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let (mut sigma, mut emission) = (0.0, [0.0; 3]);
        for (_, _, s, color) in parts.iter().filter(|p| p.0 <= middle && middle <= p.1) {
            sigma += s;
            for k in 0..3 {
                emission[k] += s * color[k];
            }
        }
        if sigma > 0.0 && pair[1] > pair[0] {
            let rest = (-sigma * (pair[1] - pair[0])).exp();
            for k in 0..3 {
                light[k] += transmittance * (1.0 - rest) * emission[k] / sigma;
            }
            transmittance *= rest;
        }
    }
    (light, transmittance)
}

/// Composite strokes onto a canvas, slowly. Depth and index are not filled in.
pub fn composite(job: &Job, strokes: &Sprites<'_>, order: Order, canvas: Canvas<'_>) -> Result<()> {
    strokes.validate()?;
    let Canvas { width, height, rgb, transmittance, .. } = canvas;
    let (mut sprites, mut memo) = (Vec::new(), Memo::default());
    for i in 0..strokes.count() {
        sprites.extend(strokes.sprite(i, &mut memo)?);
    }
    sprites.sort_by(|a, b| a.depth.total_cmp(&b.depth).then((a.id, a.index).cmp(&(b.id, b.index))));
    job.expect(height as u64);
    let mut rows: Vec<(&mut [f32], &mut [f32])> =
        rgb.chunks_mut((3 * width).max(1)).zip(transmittance.chunks_mut(width.max(1))).collect();
    job.chunks(&mut rows, 1, |y, row| {
        let (rgb, transmittance) = &mut row[0];
        let y = y as f64 + 0.5;
        let near: Vec<Sprite> =
            sprites.iter().filter(|s| (y - f64::from(s.y)).abs() <= f64::from(s.reach()[1]) + 1.0).copied().collect();
        for x in 0..width {
            let at = x as f64 + 0.5;
            let (light, rest) = if order == Order::Slab { slabs(&near, at, y) } else { hard(&near, at, y) };
            for k in 0..3 {
                rgb[3 * x + k] = light[k] as f32;
            }
            transmittance[x] = rest as f32;
        }
        job.advance(1)
    })
}

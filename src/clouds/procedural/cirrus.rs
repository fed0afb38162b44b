//! Cirrus: ice that falls from small heads and is left behind by the faster wind above.
//!
//! Heads form near the top of the box. What falls from one comes into slower wind and trails behind it: steeply at
//! first, then nearly level, in the shape of a hook (cirrus uncinus). A trail is a bundle of fibres, wider and thinner
//! towards its end where the ice evaporates.

use super::shape::{CloudShape, edge_falloff, margin};
use crate::math::interpolation::smoothstep;
use crate::math::noise::Perlin;
use crate::math::random::Stream;

/// Trails in a square box.
const TRAILS: f64 = 34.0;

/// One head and what falls from it, in a frame along and across the wind. Lengths are in units of the box's smaller
/// horizontal edge, heights in units of the room between its margins.
struct Trail {
    head: [f64; 2],
    height: f64,
    length: f64,
    drop: f64,
    width: f64,
    curl: f64,
    weight: f64,
    seed: f64,
}

pub(super) struct Cirrus {
    size: [usize; 3],
    unit: f64,
    margin: f64,
    room: f64,
    wind: [f64; 2],
    trails: Vec<Trail>,
    fibres: Perlin,
    veil: Perlin,
}

impl Cirrus {
    pub(super) fn new(size: [usize; 3], key: u64) -> Self {
        let [nx, ny, nz] = size;
        let small = nx.min(ny) as f64;
        let random = Stream::new(key, 0xE0);
        let mut counter = 0;
        let mut draw = |low: f64, high: f64| {
            counter += 1;
            low + (high - low) * random.uniform(counter)
        };
        let turn: f64 = draw(-0.35, 0.35);
        let wind = if nx >= ny { [turn.cos(), turn.sin()] } else { [turn.sin(), turn.cos()] };
        // The box as the wind sees it: half its extent along and across.
        let (half_x, half_y) = (0.5 * nx as f64 / small, 0.5 * ny as f64 / small);
        let along = half_x * wind[0].abs() + half_y * wind[1].abs();
        let across = half_x * wind[1].abs() + half_y * wind[0].abs();
        let count = (TRAILS * (4.0 * half_x * half_y).min(12.0)) as usize;
        let trails = (0..count)
            .map(|i| {
                // A few long ones, many short ones.
                let large = 1.0 / (1.0 + 0.35 * (i % 8) as f64);
                Trail {
                    head: [draw(-0.5, 1.0) * along, draw(-0.95, 0.95) * across],
                    height: draw(0.62, 0.96),
                    length: draw(0.55, 1.0) * (0.25 + 0.75 * large),
                    drop: draw(0.35, 0.6) * (0.4 + 0.6 * large),
                    width: draw(0.025, 0.05) * (0.45 + 0.55 * large),
                    curl: draw(-0.10, 0.10),
                    weight: draw(0.35, 1.0) * (0.5 + 0.5 * large),
                    seed: draw(0.0, 400.0),
                }
            })
            .collect();
        let margin = margin(nz);
        Self {
            size,
            unit: 1.0 / small,
            margin,
            room: nz as f64 - 2.0 * margin,
            wind,
            trails,
            fibres: Perlin::new(key, 0xE1),
            veil: Perlin::new(key, 0xE2),
        }
    }

    /// Density of one trail at (along, across, height).
    fn trail(&self, trail: &Trail, [along, across, height]: [f64; 3]) -> f64 {
        // Where along the trail: 0 at its head, 1 at its end.
        let t = (trail.head[0] - along) / trail.length;
        if !(-0.06..1.0).contains(&t) {
            return 0.0;
        }
        let behind = t.max(0.0);
        let spread = trail.width * (0.35 + 1.3 * behind.sqrt());
        let side = across - trail.head[1] - trail.curl * behind * behind;
        let middle = trail.height - trail.drop * (1.0 - (-6.0 * behind).exp()) * (0.75 + 0.25 * behind);
        let thick = 0.05 + 0.10 * behind.sqrt();
        let (a, b) = (side / spread, (height - middle) / thick);
        let far = a * a + b * b;
        if far > 4.0 {
            return 0.0;
        }
        // Fibres follow the trail: they vary fast across it and slowly along it.
        let wander = 0.5 * self.veil.at(3.0 * t, trail.seed, 0.5);
        let n = self.fibres.fbm(2.2 * t + trail.seed, 2.3 * (a + wander), 1.3 * b, 4, 0.65);
        let strands = smoothstep(-0.25, 0.75, n + 0.12);
        let body = (-1.4 * far).exp() * (1.0 - 0.25 * far).max(0.0);
        // The head is a small dense tuft.
        let lump = 1.0 + 1.6 * (-(t / 0.05).powi(2)).exp();
        trail.weight * body * strands * lump * smoothstep(-0.06, 0.0, t) * (1.0 - behind) * (1.0 - 0.3 * behind)
    }
}

impl CloudShape for Cirrus {
    fn fill_row(&self, j: usize, k: usize, row: &mut [f32]) {
        let [nx, ny, nz] = self.size;
        // Trails fade out well before the side faces, or their ends would draw the box in the sky.
        let fade = |i: usize, n: usize| edge_falloff(i, n) * smoothstep(0.0, 0.12, i.min(n - 1 - i) as f64 / n as f64);
        let open = fade(j, ny) * edge_falloff(k, nz);
        if open == 0.0 {
            return;
        }
        let [c, s] = self.wind;
        let height = (k as f64 + 0.5 - self.margin) / self.room;
        let y = (j as f64 + 0.5 - 0.5 * ny as f64) * self.unit;
        // Trails that pass this layer.
        let near: Vec<&Trail> =
            self.trails.iter().filter(|t| height < t.height + 0.12 && height > t.height - t.drop - 0.32).collect();
        for (i, out) in row.iter_mut().enumerate() {
            let x = (i as f64 + 0.5 - 0.5 * nx as f64) * self.unit;
            let (along, across) = (c * x + s * y, c * y - s * x);
            let sum: f64 = near.iter().map(|t| self.trail(t, [along, across, height])).sum();
            // A trace of ice between the trails.
            let level = (-((height - 0.45) / 0.2).powi(2)).exp();
            let haze = if level > 0.02 {
                let n = self.veil.fbm(1.5 * along, 7.0 * across, 1.2 * height, 4, 0.55);
                0.10 * level * smoothstep(0.0, 0.7, n)
            } else {
                0.0
            };
            *out = ((sum + haze) * open * fade(i, nx)) as f32;
        }
    }
}

//! Strokes as layers in depth.
//!
//! A stroke of opacity `alpha` fills `[d - delta, d + delta]` with the extinction `-ln(1 - alpha) / 2 delta`; its colour
//! is its emission. Sprites face the camera, so the depths where strokes begin and end come in one order for all pixels
//! of a tile. Between two of them nothing changes but what has been passed through: `T *= e^(-s x)`, `C += T (1 - e^(-s
//! x)) (sum of s c) / s`. A pixel is brought forward only when a stroke that covers it begins or ends. One stroke alone
//! gives its `alpha`, and all is continuous in every depth. Kin: Baran et al. 2011 (mixed-order compositing), EVER.

use super::composite::{Plane, STRIDE, Scratch, Tile, cover, lane, varied};
use super::mask::{GROUP, Lane, decay};
use super::tiles::{Event, HEIGHT};
use crate::math::lanes;
use crate::math::logarithm::ln;

/// What is under way in the pixels of a tile.
pub(super) struct Slabs {
    /// Sum of extinctions, over twice the largest half thickness, and of extinction times colour.
    extinction: Plane,
    emission: [Plane; 3],
    /// How many strokes: sums of floats do not return to zero by themselves.
    count: Plane,
    /// Where the pixel stands, in ticks that wrap around: only distances within strokes matter, which are short.
    last: Vec<i32>,
}

/// Ticks in the largest half thickness.
const TICKS: f64 = (1_u32 << 26) as f64;

impl Slabs {
    pub(super) fn new() -> Self {
        let plane = || vec![0.0; STRIDE * HEIGHT];
        Self {
            extinction: plane(),
            emission: [plane(), plane(), plane()],
            count: plane(),
            last: vec![0; STRIDE * HEIGHT],
        }
    }

    /// Paint the strokes of a tile; `delta` is the largest half thickness, above zero.
    pub(super) fn paint(&mut self, events: &[Event<'_>], delta: f64, tile: &mut Tile, scratch: &mut Scratch) {
        self.extinction.fill(0.0);
        self.emission.iter_mut().for_each(|plane| plane.fill(0.0));
        self.count.fill(0.0);
        self.last.fill(0);
        lanes::run(
            #[inline(always)]
            || {
                for (k, event) in events.iter().enumerate() {
                    if k % 128 == 127 && tile.closed() {
                        return;
                    }
                    self.event(event, delta, tile, scratch);
                }
            },
        );
    }

    #[inline(always)]
    fn event(&mut self, event: &Event<'_>, delta: f64, tile: &mut Tile, scratch: &mut Scratch) {
        let sprite = event.sprite;
        let now = (event.depth / delta * TICKS) as i64 as i32;
        // A layer thinner than a hundred thousandth of the largest is that thick.
        let thinner = (delta / sprite.delta.max(1e-5 * delta)) as f32;
        let (sign, step) = if event.ends { (-thinner, -1.0) } else { (thinner, 1.0) };
        let Tile { at, size, light: [r, g, b], through } = tile;
        let Self { extinction, emission: [sr, sg, sb], count, last } = self;
        let flat = sprite.color.map(|c| [c; GROUP]);
        let toned = sprite.fine_carried > 0.0;
        cover(
            sprite,
            *at,
            *size,
            scratch,
            #[inline(always)]
            |place: usize, alpha: &[Lane<f32>], tone: &[Lane<f32>]| {
                for (k, (alpha, tone)) in alpha.iter().zip(tone).enumerate() {
                    let place = place + k * GROUP;
                    let color = if toned { varied(&flat, sprite.vary, tone) } else { flat };
                    let s = lane(extinction, place);
                    let old = *s;
                    let share = forward(now, lane(through, place), lane(last, place), &old);
                    let (change, open) = change(alpha, sign, step, lane(count, place));
                    let mut new = old;
                    for i in 0..GROUP {
                        new[i] = (old[i] + change[i]) * open[i];
                    }
                    *s = new;
                    let planes = [(&mut *r, &mut *sr), (&mut *g, &mut *sg), (&mut *b, &mut *sb)];
                    for ((light, emission), color) in planes.into_iter().zip(color) {
                        let (light, emission) = (lane(light, place), lane(emission, place));
                        let (mut c, mut e) = (*light, *emission);
                        for i in 0..GROUP {
                            c[i] += share[i] * e[i];
                            e[i] = (e[i] + change[i] * color[i]) * open[i];
                        }
                        (*light, *emission) = (c, e);
                    }
                }
            },
        );
    }
}

/// Bring the transmittance of eight pixels to a depth; what the light gains for each emission.
#[inline(always)]
fn forward(now: i32, through: &mut Lane<f32>, last: &mut Lane<i32>, s: &Lane<f32>) -> Lane<f32> {
    /// Of a tick in the largest thickness.
    const PER_TICK: f32 = (0.5 / TICKS) as f32;
    let (t, since) = (*through, *last);
    let mut rest = [0.0; GROUP];
    for i in 0..GROUP {
        let depth = s[i] * (now.wrapping_sub(since[i]) as f32 * PER_TICK);
        rest[i] = decay(depth);
    }
    let (mut share, mut left) = ([0.0; GROUP], [0.0; GROUP]);
    for i in 0..GROUP {
        let some = if s[i] > 1e-30 { s[i] } else { 1e-30 };
        share[i] = t[i] * (1.0 - rest[i]) / some;
        left[i] = t[i] * rest[i];
    }
    *last = [now; GROUP];
    *through = left;
    share
}

/// What a stroke changes of the extinction of eight pixels, and 0 for those where no stroke is left.
#[inline(always)]
fn change(alpha: &Lane<f32>, sign: f32, step: f32, count: &mut Lane<f32>) -> (Lane<f32>, Lane<f32>) {
    let mut n = *count;
    let (mut change, mut open) = ([0.0; GROUP], [0.0; GROUP]);
    for i in 0..GROUP {
        let rest = 1.0 - alpha[i];
        let depth = -ln(if rest > 1e-6 { rest } else { 1e-6 });
        change[i] = depth * sign;
    }
    for i in 0..GROUP {
        n[i] += if alpha[i] > 0.0 { step } else { 0.0 };
        open[i] = if n[i] > 0.0 { 1.0 } else { 0.0 };
    }
    *count = n;
    (change, open)
}

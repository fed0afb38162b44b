//! Order-independent compositing of strokes as layers in depth: each a slab of even extinction and emission.
//!
//! A stroke of opacity `alpha` fills `[d - delta, d + delta]` with the extinction `-ln(1 - alpha) / 2 delta`; its
//! colour is its emission. Sprites face the camera, so the depths where strokes begin and end come in one order for all
//! pixels of a tile. Between two of them nothing changes but what has been passed through: with the sum `S` of
//! extinctions, `T *= e^(-S x)`, `W += T (1 - e^(-S x)) / S`. `W` is the integral of the transmittance along the depth,
//! so a stroke of extinction `s` and colour `c` gives the light `s c (W at its end - W at its begin)`: no sums of
//! emissions are kept. A pixel is brought forward only when a stroke that covers it begins or ends. One stroke alone
//! gives its `alpha`, and all is continuous in every depth. Kin: Baran et al. 2011 (mixed-order compositing), EVER.

use super::cover::{AREA, MOST, Scratch, TileWindow, cover};
use super::mask::{GROUP, Lane, decay};
use super::sprite::Sprite;
use super::tile::{Plane, Tile, lane, textured_color};
use super::tile_binning::{Event, HEIGHT};
use crate::math::lanes;
use crate::math::logarithm::ln;

/// What is under way in the pixels of a tile.
pub(super) struct Slabs {
    /// Sum of extinctions, over twice the largest half thickness.
    extinction: Plane,
    /// How many strokes: sums of floats do not return to zero by themselves.
    count: Plane,
    /// Integral of the transmittance along the depth, where there were strokes. Thin strokes are small differences of
    /// it.
    passed: Vec<f64>,
    /// Where the pixel stands, in ticks that wrap around: only distances within strokes matter, which are short.
    last: Vec<i32>,
    /// Strokes that have begun, in places of their own; those that are free again; the place of each stroke of the
    /// tile.
    active: Vec<ActiveInterval>,
    free: Vec<u32>,
    places: Vec<u32>,
}

/// A stroke that has begun: groups of eight pixels in which it has paint.
#[derive(Default)]
struct ActiveInterval {
    count: usize,
    /// Place of the first pixel in the planes.
    place: Vec<u32>,
    /// Opacity first, then extinction.
    extinction: Vec<Lane<f32>>,
    /// Noise of the colour, of strokes whose colour varies.
    tone: Vec<Lane<f32>>,
    /// What had been passed.
    passed: Vec<Lane<f64>>,
}

impl ActiveInterval {
    /// Make room for so many groups.
    #[inline(always)]
    fn reserve(&mut self, groups: usize, toned: bool) {
        if self.place.len() < groups {
            self.place.resize(groups, 0);
            self.extinction.resize(groups, [0.0; GROUP]);
            self.passed.resize(groups, [0.0; GROUP]);
        }
        if toned && self.tone.len() < groups {
            self.tone.resize(groups, [0.0; GROUP]);
        }
    }

    /// Evaluate the mask of a stroke. Groups without paint are left out by counting, not by a branch that is guessed.
    #[inline(always)]
    fn cover(&mut self, sprite: &Sprite, window: &TileWindow, scratch: &mut Scratch) {
        let toned = sprite.fine_carried > 0.0;
        self.reserve(window.groups(sprite), toned);
        let Self { place: places, extinction, tone: tones, .. } = self;
        let mut count = 0;
        cover(
            sprite,
            window,
            scratch,
            #[inline(always)]
            |place: usize, alpha: &[Lane<f32>], tone: &[Lane<f32>]| {
                for (k, (alpha, tone)) in alpha.iter().zip(tone).enumerate() {
                    places[count] = (place + k * GROUP) as u32;
                    extinction[count] = *alpha;
                    if toned {
                        tones[count] = *tone;
                    }
                    count += usize::from(alpha.iter().fold(0, |any, a| any | a.to_bits()) != 0);
                }
            },
        );
        self.count = count;
    }
}

/// Ticks in the largest half thickness.
const TICKS: f64 = (1_u32 << 26) as f64;
/// Most groups of strokes under way at a time (100 bytes each): a tile where there are more is painted in strips.
const MOST_ACTIVE: usize = 1 << 18;
/// The place of strokes that are not seen.
const NOWHERE: u32 = u32::MAX;

impl Slabs {
    pub(super) fn new() -> Self {
        Self {
            extinction: vec![0.0; AREA],
            count: vec![0.0; AREA],
            passed: vec![0.0; AREA],
            last: vec![0; AREA],
            active: Vec::new(),
            free: Vec::new(),
            places: Vec::new(),
        }
    }

    /// Paint the strokes of a tile; `delta` is the largest half thickness, above zero.
    pub(super) fn paint(&mut self, events: &[Event<'_>], delta: f64, tile: &mut Tile, scratch: &mut Scratch) {
        self.extinction.fill(0.0);
        self.count.fill(0.0);
        self.passed.fill(0.0);
        self.last.fill(0);
        let whole = tile.window;
        let rows = (HEIGHT / strips(events, tile)).max(1);
        for first in (whole.from[1]..whole.end[1]).step_by(rows) {
            tile.window.from[1] = first;
            tile.window.end[1] = whole.end[1].min(first + rows);
            tile.open_blocks = u64::MAX;
            self.places.clear();
            self.places.resize(events.len() / 2, NOWHERE);
            lanes::run(
                #[inline(always)]
                || self.events(events, delta, tile, scratch),
            );
        }
        tile.window = whole;
    }

    #[inline(always)]
    fn events(&mut self, events: &[Event<'_>], delta: f64, tile: &mut Tile, scratch: &mut Scratch) {
        let mut opaque = false;
        for (k, event) in events.iter().enumerate() {
            opaque |= k % 16 == 15 && tile.update_occlusion();
            let now = (event.depth / delta * TICKS) as i64 as i32;
            // A layer thinner than a hundred thousandth of the largest is that thick.
            let thinner = (delta / event.sprite.delta.max(1e-5 * delta)) as f32;
            let place = &mut self.places[event.local as usize];
            if event.ends {
                if *place != NOWHERE {
                    self.free.push(*place);
                    let place = *place as usize;
                    self.end(event, now, place, tile);
                }
            } else if !opaque && tile.shows(event.sprite) {
                *place = self.free.pop().unwrap_or_else(|| {
                    self.active.push(ActiveInterval::default());
                    self.active.len() as u32 - 1
                });
                let active = &mut self.active[*place as usize];
                active.cover(event.sprite, &tile.window, scratch);
                let place = *place as usize;
                self.begin(now, thinner, place, tile);
            }
        }
    }

    #[inline(always)]
    fn begin(&mut self, now: i32, thinner: f32, place: usize, tile: &mut Tile) {
        let Self { extinction, count, passed, last, active, .. } = self;
        let stroke = &mut active[place];
        for mine in stroke.extinction[..stroke.count].as_flattened_mut() {
            let rest = 1.0 - *mine;
            *mine = -thinner * ln(if rest > 1e-6 { rest } else { 1e-6 });
        }
        let all = stroke.place.iter().zip(&stroke.extinction).zip(&mut stroke.passed);
        for ((&place, mine), held) in all.take(stroke.count) {
            let place = place as usize;
            let (s, n) = (lane(extinction, place), lane(count, place));
            *held = forward(now, lane(&mut tile.transmittance, place), lane(last, place), lane(passed, place), s);
            let (mut sum, mut number) = (*s, *n);
            for i in 0..GROUP {
                sum[i] += mine[i];
                number[i] += if mine[i] > 0.0 { 1.0 } else { 0.0 };
            }
            (*s, *n) = (sum, number);
        }
    }

    #[inline(always)]
    fn end(&mut self, event: &Event<'_>, now: i32, place: usize, tile: &mut Tile) {
        let Self { extinction, count, passed, last, active, .. } = self;
        let stroke = &active[place];
        let sprite = event.sprite;
        let flat = sprite.color.map(|c| [c; GROUP]);
        let toned = sprite.fine_carried > 0.0;
        let Tile { light: [r, g, b], transmittance, .. } = tile;
        let all = stroke.place.iter().zip(&stroke.extinction).zip(&stroke.passed);
        for (k, ((&place, mine), held)) in all.take(stroke.count).enumerate() {
            let color = if toned { textured_color(&flat, sprite.vary, &stroke.tone[k]) } else { flat };
            let place = place as usize;
            let (s, n) = (lane(extinction, place), lane(count, place));
            let until = forward(now, lane(transmittance, place), lane(last, place), lane(passed, place), s);
            let (mut sum, mut number, mut w) = (*s, *n, [0.0; GROUP]);
            for i in 0..GROUP {
                w[i] = mine[i] * (until[i] - held[i]) as f32;
                number[i] -= if mine[i] > 0.0 { 1.0 } else { 0.0 };
                sum[i] = if number[i] > 0.0 { sum[i] - mine[i] } else { 0.0 };
            }
            (*s, *n) = (sum, number);
            for (light, color) in [&mut *r, &mut *g, &mut *b].into_iter().zip(color) {
                let light = lane(light, place);
                let mut c = *light;
                for i in 0..GROUP {
                    c[i] += w[i] * color[i];
                }
                *light = c;
            }
        }
    }
}

/// In how many strips a tile must be painted for want of memory.
fn strips(events: &[Event<'_>], tile: &Tile) -> usize {
    if events.len() / 2 * MOST <= MOST_ACTIVE {
        return 1;
    }
    let (mut now, mut most) = (0, 0);
    for event in events {
        let groups = tile.window.groups(event.sprite);
        now = if event.ends { now - groups } else { now + groups };
        most = most.max(now);
    }
    most.div_ceil(MOST_ACTIVE).max(1)
}

/// Bring eight pixels to a depth; how much has been passed there.
#[inline(always)]
fn forward(
    now: i32,
    transmittance: &mut Lane<f32>,
    last: &mut Lane<i32>,
    passed: &mut Lane<f64>,
    s: &Lane<f32>,
) -> Lane<f64> {
    /// Of a tick in the largest thickness.
    const PER_TICK: f32 = (0.5 / TICKS) as f32;
    let (t, since, s, mut sum) = (*transmittance, *last, *s, *passed);
    let mut left = [0.0; GROUP];
    for i in 0..GROUP {
        let rest = decay(s[i] * (now.wrapping_sub(since[i]) as f32 * PER_TICK));
        let some = if s[i] > 1e-30 { s[i] } else { 1e-30 };
        sum[i] += f64::from(t[i] * (1.0 - rest) / some);
        left[i] = t[i] * rest;
    }
    *last = [now; GROUP];
    *transmittance = left;
    *passed = sum;
    sum
}

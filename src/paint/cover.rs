//! Rasterisation of a stroke: its mask over the pixels of a tile, eight at a time.
//!
//! The groups of a twisted stroke are listed first and then evaluated two at a time: one alone is a chain of two
//! hundred cycles, most of them waiting.

use super::mask::{GROUP, GROUPS, Lane, Lattice, edge, origin, threshold, twisted, twisted_edge};
use super::sprite::Sprite;
use super::tile_binning::{HEIGHT, WIDTH};

/// Floats of a row of a tile in memory: a group may stand over its right border.
pub(super) const STRIDE: usize = WIDTH + GROUP;
pub(super) const AREA: usize = STRIDE * HEIGHT;
/// Most groups of a stroke in a tile.
pub(super) const MOST: usize = GROUPS * HEIGHT;

/// Groups of a twisted stroke that are evaluated together.
const PAIR: usize = 2;
const WIDE: usize = PAIR * GROUP;

/// A part of the picture.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TileWindow {
    /// Column and row of its first pixel in memory.
    pub(super) at: [usize; 2],
    /// First column and row, and those behind the last.
    pub(super) from: [usize; 2],
    pub(super) end: [usize; 2],
}

impl TileWindow {
    /// The pixels of a stroke in it: columns and rows, empty if there are none.
    #[inline(always)]
    pub(super) fn pixels(&self, sprite: &Sprite) -> [usize; 4] {
        let [x0, x1, y0, y1] = sprite.pixels(self.end);
        [x0.max(self.from[0]), x1, y0.max(self.from[1]), y1]
    }

    /// Most groups of a stroke in it, and one more.
    #[inline(always)]
    pub(super) fn groups(&self, sprite: &Sprite) -> usize {
        let [x0, x1, y0, y1] = self.pixels(sprite);
        x1.saturating_sub(x0).div_ceil(GROUP) * y1.saturating_sub(y0) + 1
    }
}

/// Room for what the pixels of a stroke have in common.
pub(super) struct Scratch {
    across: [Lane<f32>; GROUPS],
    down: [Lane<f32>; HEIGHT / GROUP],
    grain: Lattice,
    tone: Lattice,
    alpha: [Lane<f32>; GROUPS],
    vary: [Lane<f32>; GROUPS],
    /// For each group of a twisted stroke: its first pixel in the planes and from the stroke's centre.
    place: [u32; MOST + PAIR],
    from_centre: [[f32; 2]; MOST + PAIR],
}

impl Scratch {
    pub(super) fn new() -> Self {
        Self {
            across: [[0.0; GROUP]; GROUPS],
            down: [[0.0; GROUP]; HEIGHT / GROUP],
            grain: Lattice::new(),
            tone: Lattice::new(),
            alpha: [[0.0; GROUP]; GROUPS],
            vary: [[0.0; GROUP]; GROUPS],
            place: [0; MOST + PAIR],
            from_centre: [[0.0; 2]; MOST + PAIR],
        }
    }
}

/// Evaluate the mask of a stroke in a frame; `row` gets the place of the first pixel in the planes, opacity and colour
/// noise of groups side by side.
#[inline(always)]
pub(super) fn cover(
    sprite: &Sprite,
    window: &TileWindow,
    scratch: &mut Scratch,
    row: impl FnMut(usize, &[Lane<f32>], &[Lane<f32>]),
) {
    let pixels = window.pixels(sprite);
    let [x0, x1, y0, y1] = pixels;
    if x0 >= x1 || y0 >= y1 {
        return;
    }
    if sprite.turn[1] == 0.0 {
        upright(sprite, window.at, pixels, scratch, row);
    } else {
        turned(sprite, window.at, pixels, scratch, row);
    }
}

#[inline(always)]
fn steepness(width: f32) -> f32 {
    if width > 1e-30 { 1.0 / width } else { 1e30 }
}

#[inline(always)]
fn upright(
    sprite: &Sprite,
    at: [usize; 2],
    [x0, x1, y0, y1]: [usize; 4],
    scratch: &mut Scratch,
    mut row: impl FnMut(usize, &[Lane<f32>], &[Lane<f32>]),
) {
    let Scratch { across, down, grain, tone, alpha, vary, .. } = scratch;
    let mask = &sprite.mask;
    let step = sprite.half.map(|h| 0.5 / h);
    let groups = (x1 - x0).div_ceil(GROUP);
    let left = (x0 as f32 + 0.5 - sprite.x) * step[0];
    for k in 0..groups {
        for i in 0..GROUP {
            across[k][i] = edge(left + ((k * GROUP + i) as f32) * step[0], mask.power);
        }
    }
    let top = (y0 as f32 + 0.5 - sprite.y) * step[1];
    let loose = 1.0 / mask.foreshortening;
    for k in 0..(y1 - y0).div_ceil(GROUP) {
        for i in 0..GROUP {
            down[k][i] = edge((top + ((k * GROUP + i) as f32) * step[1]) * loose, mask.power);
        }
    }
    let (noisy, toned) = (mask.carried > 0.0, sprite.fine_carried > 0.0);
    if noisy {
        grain.begin(mask.key, mask.frequency[0], left, step[0], groups);
    }
    if toned {
        tone.begin(sprite.fine_key, sprite.fine, left, step[0], groups);
    }
    let (low, steep, opacity) = (mask.feather[0], steepness(mask.feather[1]), mask.opacity);
    for y in y0..y1 {
        let e = down[(y - y0) / GROUP][(y - y0) % GROUP];
        if e <= low {
            continue;
        }
        let t = top + ((y - y0) as f32) * step[1];
        if noisy {
            let factors = grain.row(t * mask.frequency[1], mask.carried, groups);
            for k in 0..groups {
                let n = grain.at(k, factors);
                for i in 0..GROUP {
                    alpha[k][i] = threshold(n[i], across[k][i] * e, low, steep, opacity);
                }
            }
        } else {
            for k in 0..groups {
                for i in 0..GROUP {
                    alpha[k][i] = threshold(0.0, across[k][i] * e, low, steep, opacity);
                }
            }
        }
        if toned {
            let factors = tone.row(t * sprite.fine, sprite.fine_carried, groups);
            for k in 0..groups {
                vary[k] = tone.at(k, factors);
            }
        }
        row((y - at[1]) * STRIDE + x0 - at[0], &alpha[..groups], &vary[..groups]);
    }
}

#[inline(always)]
fn turned(
    sprite: &Sprite,
    at: [usize; 2],
    [x0, x1, y0, y1]: [usize; 4],
    scratch: &mut Scratch,
    mut row: impl FnMut(usize, &[Lane<f32>], &[Lane<f32>]),
) {
    let Scratch { place: places, from_centre, .. } = scratch;
    let mask = &sprite.mask;
    let ([c, s], [w, h]) = (sprite.turn, sprite.inner);
    let (over_c, over_s) = (1.0 / c, 1.0 / s);
    let mut groups = 0;
    for y in y0..y1 {
        let dy = y as f32 + 0.5 - sprite.y;
        // Where the row crosses both pairs of sides; a division by zero leaves the row as it is.
        let ends = [((dy * s - w) * over_c, (dy * s + w) * over_c), ((-dy * c - h) * over_s, (-dy * c + h) * over_s)];
        let enter = ends[0].0.min(ends[0].1).max(ends[1].0.min(ends[1].1)) + sprite.x;
        let leave = ends[0].0.max(ends[0].1).min(ends[1].0.max(ends[1].1)) + sprite.x;
        let bound = |x: f32| (x - 0.5).ceil().clamp(x0 as f32, x1 as f32) as usize;
        let (a, b) = (bound(enter - 0.01), bound(leave + 0.01));
        let place = (y - at[1]) * STRIDE + a - at[0];
        let mut k = 0;
        while a + k < b {
            from_centre[groups] = [(a + k) as f32 + 0.5 - sprite.x, dy];
            places[groups] = (place + k) as u32;
            groups += 1;
            k += GROUP;
        }
    }
    // What is behind the last group is evaluated and not used.
    from_centre[groups] = [0.0; 2];
    let step = sprite.half.map(|h| 0.5 / h);
    let loose = 1.0 / mask.foreshortening;
    let (noisy, toned) = (mask.carried > 0.0, sprite.fine_carried > 0.0);
    let (corner, fine_corner) = (origin(mask.key), origin(sprite.fine_key));
    let (low, steep, opacity) = (mask.feather[0], steepness(mask.feather[1]), mask.opacity);
    for first in (0..groups).step_by(PAIR) {
        let (mut p, mut q) = ([0.0; WIDE], [0.0; WIDE]);
        for j in 0..PAIR {
            let [left, dy] = from_centre[first + j];
            for i in 0..GROUP {
                let dx = left + i as f32;
                p[j * GROUP + i] = (dx * c - dy * s) * step[0];
                q[j * GROUP + i] = (dx * s + dy * c) * step[1];
            }
        }
        let scaled = |list: &[f32; WIDE], f: f32| list.map(|x| x * f);
        let (mut n, mut alpha, mut fine) = ([0.0; WIDE], [0.0; WIDE], [0.0; WIDE]);
        if noisy {
            n = twisted(mask.key, corner, &scaled(&p, mask.frequency[0]), &scaled(&q, mask.frequency[1]));
        }
        for i in 0..WIDE {
            let e = twisted_edge(p[i], q[i] * loose, mask.power);
            alpha[i] = threshold(n[i] * mask.carried, e, low, steep, opacity);
        }
        if toned {
            fine = twisted(sprite.fine_key, fine_corner, &scaled(&p, sprite.fine), &scaled(&q, sprite.fine));
        }
        for i in 0..WIDE {
            fine[i] *= sprite.fine_carried;
        }
        let (alpha, fine) = (alpha.as_chunks().0, fine.as_chunks().0);
        for j in 0..PAIR.min(groups - first) {
            row(places[first + j] as usize, &alpha[j..=j], &fine[j..=j]);
        }
    }
}

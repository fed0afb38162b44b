//! Strokes to a picture: light in front of a transmittance, so that any sky can stand behind.
//!
//! Front to back in tiles of 64 × 32 pixels of single precision. In hard order, a stroke is a sheet at its depth, nearest
//! first: `C += T alpha c`, `T *= 1 - alpha`. In slab order it is a layer `[d - delta, d + delta]` of even extinction
//! (see `slab.rs`), which removes the jumps of hard order when two strokes exchange their places.
//!
//! The order is by distance from the eye (the thesis' L8 sorts by depth): a camera that turns about its eye changes no
//! order at all, where one by depth along the view does. A frame is a pure function of its strokes: same bits for every
//! SIMD level and thread count. Once every pixel of a tile lets less than 1e-4 through, strokes further behind are left
//! out; that is the error against [`reference`](super::reference), times the brightest stroke's light.

use super::mask::{GROUP, GROUPS, Lane, Lattice, edge, origin, threshold, twisted, twisted_edge};
use super::seen::Seen;
use super::slab;
use super::sprite::{Sprite, Sprites, same};
use super::tiles::{Event, HEIGHT, Tiles, WIDTH};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::lanes;

/// Which stroke is in front.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// The nearer one.
    Hard,
    /// Both where they overlap in depth.
    Slab,
}

/// Where the picture goes: each of `width * height` pixels, row 0 at the top.
#[derive(Debug)]
pub struct Canvas<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Light of the strokes, premultiplied.
    pub rgb: &'a mut [f32],
    /// Share of the light from behind that comes through \[1\].
    pub transmittance: &'a mut [f32],
    /// Mean depth of what is seen, infinite where nothing is \[m\], and index of the stroke with the largest weight, -1
    /// where none is. In hard order.
    pub seen: Option<(&'a mut [f32], &'a mut [i64])>,
}

/// One row of tiles of a canvas.
struct Band<'a> {
    rgb: &'a mut [f32],
    transmittance: &'a mut [f32],
    seen: Option<(&'a mut [f32], &'a mut [i64])>,
}

/// Floats of a row of a tile in memory: a group may stand over its right border.
pub(super) const STRIDE: usize = WIDTH + GROUP;
pub(super) const AREA: usize = STRIDE * HEIGHT;
/// A tile that lets less through everywhere is closed \[1\].
pub(super) const CLOSED: f32 = 1e-4;

/// A plane of a tile.
pub(super) type Plane = Vec<f32>;

/// The pixels of a tile.
pub(super) struct Tile {
    /// The tile's pixels in the picture: first column and row, columns and rows.
    pub(super) at: [usize; 2],
    pub(super) size: [usize; 2],
    pub(super) light: [Plane; 3],
    pub(super) through: Plane,
}

impl Tile {
    pub(super) fn new() -> Self {
        let plane = || vec![0.0; AREA];
        Self { at: [0; 2], size: [0; 2], light: [plane(), plane(), plane()], through: plane() }
    }

    pub(super) fn begin(&mut self, at: [usize; 2], size: [usize; 2]) {
        (self.at, self.size) = (at, size);
        self.light.iter_mut().for_each(|plane| plane.fill(0.0));
        self.through.fill(1.0);
    }

    /// Nothing behind would be seen.
    #[inline(always)]
    pub(super) fn closed(&self) -> bool {
        let mut most = 0.0_f32;
        for row in self.through.chunks_exact(STRIDE).take(self.size[1]) {
            for &t in &row[..self.size[0]] {
                most = if t > most { t } else { most };
            }
        }
        most < CLOSED
    }
}

/// Eight pixels of a plane.
#[inline(always)]
pub(super) fn lane<T>(plane: &mut [T], at: usize) -> &mut Lane<T> {
    plane[at..].first_chunk_mut().expect("a tile's rows are padded by a group")
}

/// Room for the masks of a sprite.
pub(super) struct Scratch {
    across: [Lane<f32>; GROUPS],
    down: [Lane<f32>; HEIGHT / GROUP],
    grain: Lattice,
    tone: Lattice,
    alpha: [Lane<f32>; GROUPS],
    vary: [Lane<f32>; GROUPS],
}

impl Scratch {
    pub(super) fn new() -> Self {
        let zero = [[0.0; GROUP]; GROUPS];
        Self {
            across: zero,
            down: [[0.0; GROUP]; HEIGHT / GROUP],
            grain: Lattice::new(),
            tone: Lattice::new(),
            alpha: zero,
            vary: zero,
        }
    }
}

/// Evaluate the mask of `sprite` over a tile; `row` gets the place of the first pixel in the planes, opacity and colour
/// noise of its groups.
#[inline(always)]
pub(super) fn cover(
    sprite: &Sprite,
    at: [usize; 2],
    size: [usize; 2],
    scratch: &mut Scratch,
    row: impl FnMut(usize, &[Lane<f32>], &[Lane<f32>]),
) {
    let [x0, x1, y0, y1] = sprite.pixels([at[0] + size[0], at[1] + size[1]]);
    let (x0, y0) = (x0.max(at[0]), y0.max(at[1]));
    if x0 >= x1 || y0 >= y1 {
        return;
    }
    if sprite.turn[1] == 0.0 {
        upright(sprite, at, [x0, x1, y0, y1], scratch, row);
    } else {
        turned(sprite, at, [x0, x1, y0, y1], scratch, row);
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
    let Scratch { across, down, grain, tone, alpha, vary } = scratch;
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
    let loose = 1.0 / mask.squeeze;
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
    let Scratch { alpha, vary, .. } = scratch;
    let mask = &sprite.mask;
    let ([c, s], [w, h]) = (sprite.turn, sprite.inner);
    let step = sprite.half.map(|h| 0.5 / h);
    let loose = 1.0 / mask.squeeze;
    let (noisy, toned) = (mask.carried > 0.0, sprite.fine_carried > 0.0);
    let (corner, fine_corner) = (origin(mask.key), origin(sprite.fine_key));
    let (low, steep, opacity) = (mask.feather[0], steepness(mask.feather[1]), mask.opacity);
    for y in y0..y1 {
        let dy = y as f32 + 0.5 - sprite.y;
        // Where the row crosses both pairs of sides; a division by zero leaves the row as it is.
        let ends = [((dy * s - w) / c, (dy * s + w) / c), ((-dy * c - h) / s, (-dy * c + h) / s)];
        let enter = ends[0].0.min(ends[0].1).max(ends[1].0.min(ends[1].1)) + sprite.x;
        let leave = ends[0].0.max(ends[0].1).min(ends[1].0.max(ends[1].1)) + sprite.x;
        let bound = |x: f32| (x - 0.5).ceil().clamp(x0 as f32, x1 as f32) as usize;
        let (a, b) = (bound(enter - 0.01), bound(leave + 0.01));
        if a >= b {
            continue;
        }
        let groups = (b - a).div_ceil(GROUP);
        let left = a as f32 + 0.5 - sprite.x;
        for k in 0..groups {
            let (mut p, mut q) = ([0.0; GROUP], [0.0; GROUP]);
            for i in 0..GROUP {
                let dx = left + ((k * GROUP + i) as f32);
                p[i] = (dx * c - dy * s) * step[0];
                q[i] = (dx * s + dy * c) * step[1];
            }
            let scaled = |list: &Lane<f32>, f: f32| list.map(|x| x * f);
            let mut n = [0.0; GROUP];
            if noisy {
                n = twisted(mask.key, corner, &scaled(&p, mask.frequency[0]), &scaled(&q, mask.frequency[1]));
            }
            for i in 0..GROUP {
                let e = twisted_edge(p[i], q[i] * loose, mask.power);
                alpha[k][i] = threshold(n[i] * mask.carried, e, low, steep, opacity);
            }
            if toned {
                let n = twisted(sprite.fine_key, fine_corner, &scaled(&p, sprite.fine), &scaled(&q, sprite.fine));
                for i in 0..GROUP {
                    vary[k][i] = n[i] * sprite.fine_carried;
                }
            }
        }
        row((y - at[1]) * STRIDE + a - at[0], &alpha[..groups], &vary[..groups]);
    }
}

/// Put eight pixels of paint behind what is there.
#[inline(always)]
fn behind(tile: [&mut Plane; 4], place: usize, alpha: &Lane<f32>, color: [&Lane<f32>; 3]) {
    let [r, g, b, t] = tile;
    let through = lane(t, place);
    let old = *through;
    let (mut w, mut rest) = ([0.0; GROUP], [0.0; GROUP]);
    for i in 0..GROUP {
        w[i] = alpha[i] * old[i];
        rest[i] = old[i] - w[i];
    }
    // Whole groups are read and written: the planes might share memory for all that the compiler knows.
    *through = rest;
    for (plane, color) in [r, g, b].into_iter().zip(color) {
        let plane = lane(plane, place);
        let mut sum = *plane;
        for i in 0..GROUP {
            sum[i] += w[i] * color[i];
        }
        *plane = sum;
    }
}

/// Paint the strokes of a tile in hard order.
#[inline(always)]
fn hard(events: &[Event<'_>], tile: &mut Tile, scratch: &mut Scratch) {
    for (k, event) in events.iter().enumerate() {
        if k % 64 == 63 && tile.closed() {
            return;
        }
        let sprite = event.sprite;
        let Tile { at, size, light: [r, g, b], through } = tile;
        let flat = sprite.color.map(|c| [c; GROUP]);
        if sprite.fine_carried > 0.0 {
            cover(
                sprite,
                *at,
                *size,
                scratch,
                #[inline(always)]
                |place: usize, alpha: &[Lane<f32>], tone: &[Lane<f32>]| {
                    for (k, (alpha, tone)) in alpha.iter().zip(tone).enumerate() {
                        let color = varied(&flat, sprite.vary, tone);
                        behind([r, g, b, through], place + k * GROUP, alpha, [&color[0], &color[1], &color[2]]);
                    }
                },
            );
        } else {
            cover(
                sprite,
                *at,
                *size,
                scratch,
                #[inline(always)]
                |place: usize, alpha: &[Lane<f32>], _: &[Lane<f32>]| {
                    for (k, alpha) in alpha.iter().enumerate() {
                        behind([r, g, b, through], place + k * GROUP, alpha, [&flat[0], &flat[1], &flat[2]]);
                    }
                },
            );
        }
    }
}

/// The colour of eight pixels of a stroke whose colour varies.
#[inline(always)]
pub(super) fn varied(flat: &[Lane<f32>; 3], vary: [f32; 3], tone: &Lane<f32>) -> [Lane<f32>; 3] {
    let mut out = *flat;
    for c in 0..3 {
        for i in 0..GROUP {
            out[c][i] = flat[c][i] + vary[c] * tone[i];
        }
    }
    out
}

/// Composite strokes onto a canvas.
pub fn composite(job: &Job, strokes: &Sprites<'_>, order: Order, canvas: Canvas<'_>) -> Result<()> {
    let (width, height) = (canvas.width, canvas.height);
    check(&canvas)?;
    let tiles = Tiles::new(job, strokes, [width, height])?;
    let mut bands = cut(canvas);
    job.expect(tiles.rows as u64);
    job.bands(&mut bands, 1, |row, band| {
        let band = &mut band[0];
        let (mut tile, mut scratch, mut events) = (Tile::new(), Scratch::new(), Vec::new());
        let mut slabs = (order == Order::Slab && tiles.delta > 0.0).then(slab::Slabs::new);
        let mut seen = band.seen.is_some().then(Seen::new);
        let rows = HEIGHT.min(height - row * HEIGHT);
        for column in 0..tiles.columns {
            job.check()?;
            let x = column * WIDTH;
            tile.begin([x, row * HEIGHT], [WIDTH.min(width - x), rows]);
            let index = row * tiles.columns + column;
            if let Some(slabs) = &mut slabs {
                tiles.events(index, &mut events);
                slabs.paint(&events, tiles.delta, &mut tile, &mut scratch);
            } else {
                tiles.sorted(index, &mut events);
                lanes::run(
                    #[inline(always)]
                    || hard(&events, &mut tile, &mut scratch),
                );
            }
            if let Some(seen) = &mut seen {
                tiles.sorted(index, &mut events);
                lanes::run(
                    #[inline(always)]
                    || seen.look(&events, &tile, &mut scratch),
                );
            }
            write(&tile, seen.as_ref(), band, width);
        }
        job.advance(1)
    })
}

/// Strokes in front of what is behind them: `out = rgb + transmittance behind`.
pub fn over(job: &Job, rgb: &[f32], transmittance: &[f32], behind: &[f32], out: &mut [f32]) -> Result<()> {
    const BAND: usize = 1 << 15;
    let n = transmittance.len();
    for (name, got) in [("rgb", rgb.len()), ("sky", behind.len()), ("out", out.len())] {
        same(name, got, n, 3)?;
    }
    job.bands(out, 3 * BAND, |band, out| {
        let first = band * BAND;
        for (k, pixel) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (t, at) = (transmittance[first + k], 3 * (first + k));
            *pixel = [0, 1, 2].map(|c: usize| rgb[at + c] + t * behind[at + c]);
        }
        Ok(())
    })
}

fn check(canvas: &Canvas<'_>) -> Result<()> {
    let count = canvas.width * canvas.height;
    let seen = canvas.seen.as_ref().is_none_or(|(depth, index)| depth.len() == count && index.len() == count);
    if canvas.rgb.len() == 3 * count && canvas.transmittance.len() == count && seen {
        return Ok(());
    }
    Err(Error::Shape {
        name: "out",
        expected: format!("({}, {}, ...)", canvas.height, canvas.width),
        got: format!("{} and {} numbers", canvas.rgb.len(), canvas.transmittance.len()),
    })
}

fn cut(canvas: Canvas<'_>) -> Vec<Band<'_>> {
    let size = (canvas.width * HEIGHT).max(1);
    let both = canvas.rgb.chunks_mut(3 * size).zip(canvas.transmittance.chunks_mut(size));
    match canvas.seen {
        None => both.map(|(rgb, transmittance)| Band { rgb, transmittance, seen: None }).collect(),
        Some((depth, index)) => both
            .zip(depth.chunks_mut(size).zip(index.chunks_mut(size)))
            .map(|((rgb, transmittance), seen)| Band { rgb, transmittance, seen: Some(seen) })
            .collect(),
    }
}

fn write(tile: &Tile, seen: Option<&Seen>, band: &mut Band<'_>, width: usize) {
    let [columns, rows] = tile.size;
    for y in 0..rows {
        let (from, to) = (y * STRIDE, y * width + tile.at[0]);
        let [r, g, b] = tile.light.each_ref().map(|plane| &plane[from..from + columns]);
        let out = &mut band.rgb[3 * to..3 * (to + columns)];
        for (((pixel, r), g), b) in out.as_chunks_mut::<3>().0.iter_mut().zip(r).zip(g).zip(b) {
            *pixel = [*r, *g, *b];
        }
        band.transmittance[to..to + columns].copy_from_slice(&tile.through[from..from + columns]);
        if let (Some(seen), Some((depth, index))) = (seen, &mut band.seen) {
            for x in 0..columns {
                let (sum, deep) = (seen.planes[1][from + x], seen.planes[3][from + x]);
                depth[to + x] = if sum > 0.0 { deep / sum } else { f32::INFINITY };
                index[to + x] = i64::from(seen.index[from + x]);
            }
        }
    }
}

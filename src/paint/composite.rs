//! Alpha compositing of strokes front to back: premultiplied light in front of a transmittance, so that any sky can
//! stand behind (Porter and Duff's `over`).
//!
//! Front to back in tiles of 64 × 32 pixels of single precision. In hard order, a stroke is a sheet at its depth,
//! nearest first: `C += T alpha c`, `T *= 1 - alpha`. In slab order it is a layer `[d - delta, d + delta]` of even
//! extinction (see `slab.rs`), which removes the jumps of hard order when two strokes exchange their places.
//!
//! The order is by distance from the eye (the thesis' L8 sorts by depth): a camera that turns about its eye changes no
//! order at all, where one by depth along the view does. A frame is a pure function of its strokes: same bits for every
//! SIMD level and thread count. Where every pixel of a block of 8 × 4 lets less than 1e-4 through, strokes further
//! behind are left out; that is the error against [`reference`](super::reference), times the brightest stroke's light.

use super::cover::{STRIDE, Scratch, cover};
use super::id_buffer::IdDepthBuffer;
use super::mask::{GROUP, Lane};
use super::slab;
use super::sprite::{Sprites, check_len};
use super::tile::{Plane, Tile, lane, textured_color};
use super::tile_binning::{Event, HEIGHT, Tiles, WIDTH};
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
    /// Transmittance: the fraction of the light from behind that comes through \[1\].
    pub transmittance: &'a mut [f32],
    /// Mean depth of what is seen, infinite where nothing is \[m\], and index of the stroke with the largest weight, -1
    /// where none is. In hard order.
    pub id_depth: Option<(&'a mut [f32], &'a mut [i64])>,
}

/// One row of tiles of a canvas.
struct TileRow<'a> {
    rgb: &'a mut [f32],
    transmittance: &'a mut [f32],
    id_depth: Option<(&'a mut [f32], &'a mut [i64])>,
}

/// Put eight pixels of paint behind what is there.
#[inline(always)]
fn composite_under(tile: [&mut Plane; 4], place: usize, alpha: &Lane<f32>, color: [&Lane<f32>; 3]) {
    let [r, g, b, t] = tile;
    let transmittance = lane(t, place);
    let old = *transmittance;
    let (mut w, mut rest) = ([0.0; GROUP], [0.0; GROUP]);
    for i in 0..GROUP {
        w[i] = alpha[i] * old[i];
        rest[i] = old[i] - w[i];
    }
    // Whole groups are read and written: the planes might share memory for all that the compiler knows.
    *transmittance = rest;
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
        if k % 16 == 15 && tile.update_occlusion() {
            return;
        }
        let sprite = event.sprite;
        if !tile.shows(sprite) {
            continue;
        }
        let Tile { window, light: [r, g, b], transmittance, .. } = tile;
        let flat = sprite.color.map(|c| [c; GROUP]);
        if sprite.fine_carried > 0.0 {
            cover(
                sprite,
                window,
                scratch,
                #[inline(always)]
                |place: usize, alpha: &[Lane<f32>], tone: &[Lane<f32>]| {
                    for (k, (alpha, tone)) in alpha.iter().zip(tone).enumerate() {
                        let color = textured_color(&flat, sprite.vary, tone);
                        composite_under(
                            [r, g, b, transmittance],
                            place + k * GROUP,
                            alpha,
                            [&color[0], &color[1], &color[2]],
                        );
                    }
                },
            );
        } else {
            cover(
                sprite,
                window,
                scratch,
                #[inline(always)]
                |place: usize, alpha: &[Lane<f32>], _: &[Lane<f32>]| {
                    for (k, alpha) in alpha.iter().enumerate() {
                        composite_under(
                            [r, g, b, transmittance],
                            place + k * GROUP,
                            alpha,
                            [&flat[0], &flat[1], &flat[2]],
                        );
                    }
                },
            );
        }
    }
}

/// Composite strokes onto a canvas.
pub fn composite(job: &Job, strokes: &Sprites<'_>, order: Order, canvas: Canvas<'_>) -> Result<()> {
    let (width, height) = (canvas.width, canvas.height);
    check(&canvas)?;
    let tiles = Tiles::new(job, strokes, [width, height])?;
    let mut chunks = cut(canvas);
    job.expect(tiles.rows as u64);
    job.chunks(&mut chunks, 1, |row, chunk| {
        let chunk = &mut chunk[0];
        let (mut tile, mut scratch, mut events) = (Tile::new(), Scratch::new(), Vec::new());
        let mut slabs = (order == Order::Slab && tiles.delta > 0.0).then(slab::Slabs::new);
        let mut id_depth = chunk.id_depth.is_some().then(IdDepthBuffer::new);
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
            if let Some(id_depth) = &mut id_depth {
                tiles.sorted(index, &mut events);
                lanes::run(
                    #[inline(always)]
                    || id_depth.look(&events, &tile.window, &mut scratch),
                );
            }
            write(&tile, id_depth.as_ref(), chunk, width);
        }
        job.advance(1)
    })
}

/// Strokes in front of what is behind them: `out = rgb + transmittance behind`.
pub fn over(job: &Job, rgb: &[f32], transmittance: &[f32], behind: &[f32], out: &mut [f32]) -> Result<()> {
    const CHUNK: usize = 1 << 15;
    let n = transmittance.len();
    for (name, got) in [("rgb", rgb.len()), ("sky", behind.len()), ("out", out.len())] {
        check_len(name, got, n, 3)?;
    }
    job.chunks(out, 3 * CHUNK, |chunk, out| {
        let first = chunk * CHUNK;
        for (k, pixel) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (t, at) = (transmittance[first + k], 3 * (first + k));
            *pixel = [0, 1, 2].map(|c: usize| rgb[at + c] + t * behind[at + c]);
        }
        Ok(())
    })
}

fn check(canvas: &Canvas<'_>) -> Result<()> {
    let count = canvas.width * canvas.height;
    let id_depth = canvas.id_depth.as_ref().is_none_or(|(depth, index)| depth.len() == count && index.len() == count);
    if canvas.rgb.len() == 3 * count && canvas.transmittance.len() == count && id_depth {
        return Ok(());
    }
    Err(Error::Shape {
        name: "out",
        expected: format!("({}, {}, ...)", canvas.height, canvas.width),
        got: format!("{} and {} numbers", canvas.rgb.len(), canvas.transmittance.len()),
    })
}

fn cut(canvas: Canvas<'_>) -> Vec<TileRow<'_>> {
    let size = (canvas.width * HEIGHT).max(1);
    let both = canvas.rgb.chunks_mut(3 * size).zip(canvas.transmittance.chunks_mut(size));
    match canvas.id_depth {
        None => both.map(|(rgb, transmittance)| TileRow { rgb, transmittance, id_depth: None }).collect(),
        Some((depth, index)) => both
            .zip(depth.chunks_mut(size).zip(index.chunks_mut(size)))
            .map(|((rgb, transmittance), id_depth)| TileRow { rgb, transmittance, id_depth: Some(id_depth) })
            .collect(),
    }
}

fn write(tile: &Tile, id_depth: Option<&IdDepthBuffer>, chunk: &mut TileRow<'_>, width: usize) {
    let [columns, rows] = tile.size();
    for y in 0..rows {
        let (from, to) = (y * STRIDE, y * width + tile.window.at[0]);
        let [r, g, b] = tile.light.each_ref().map(|plane| &plane[from..from + columns]);
        let out = &mut chunk.rgb[3 * to..3 * (to + columns)];
        for (((pixel, r), g), b) in out.as_chunks_mut::<3>().0.iter_mut().zip(r).zip(g).zip(b) {
            *pixel = [*r, *g, *b];
        }
        chunk.transmittance[to..to + columns].copy_from_slice(&tile.transmittance[from..from + columns]);
        if let (Some(id_depth), Some((depth, index))) = (id_depth, &mut chunk.id_depth) {
            for x in 0..columns {
                let (sum, deep) = (id_depth.planes[1][from + x], id_depth.planes[3][from + x]);
                depth[to + x] = if sum > 0.0 { deep / sum } else { f32::INFINITY };
                index[to + x] = i64::from(id_depth.index[from + x]);
            }
        }
    }
}

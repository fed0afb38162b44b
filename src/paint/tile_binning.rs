//! Tile binning: which strokes touch which tile, sorted by depth.
//!
//! Strokes are dealt out chunk by chunk, each into lists of its own: chunks can then be dealt out by several threads,
//! and what a tile reads lies together. Each tile sorts its own strokes by depth, ties by id and index: the order does
//! not depend on chunks or threads.

use super::sprite::{Memo, Sprite, Sprites};
use crate::error::Result;
use crate::job::Job;

/// Columns of a tile.
pub(super) const WIDTH: usize = 64;
/// Rows of a tile.
pub(super) const HEIGHT: usize = 32;

/// Strokes of a chunk, tile by tile.
struct Chunk {
    first: Vec<u32>,
    sprites: Vec<Sprite>,
}

/// All strokes, tile by tile.
pub(super) struct Tiles {
    chunks: Vec<Chunk>,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Largest half thickness in depth.
    pub(super) delta: f64,
}

impl Tiles {
    pub(super) fn new(job: &Job, strokes: &Sprites<'_>, size: [usize; 2]) -> Result<Self> {
        strokes.validate()?;
        let (columns, rows) = (size[0].div_ceil(WIDTH), size[1].div_ceil(HEIGHT));
        let count = strokes.count();
        // A chunk's lists cost a number for each tile.
        let length = 4096.max(4 * columns * rows);
        let made = job.map(count.div_ceil(length), |k| {
            chunk(strokes, k * length..count.min((k + 1) * length), size, columns, rows)
        })?;
        let delta = made.iter().fold(0.0_f64, |most, c| most.max(c.1));
        Ok(Self { chunks: made.into_iter().map(|c| c.0).collect(), columns, rows, delta })
    }

    /// The strokes of a tile, in no order.
    fn of(&self, tile: usize) -> impl Iterator<Item = &Sprite> {
        self.chunks.iter().flat_map(move |c| &c.sprites[c.first[tile] as usize..c.first[tile + 1] as usize])
    }

    /// The strokes of a tile, nearest first.
    pub(super) fn sorted<'a>(&'a self, tile: usize, into: &mut Vec<Event<'a>>) {
        into.clear();
        into.extend(self.of(tile).enumerate().map(|(k, s)| Event::new(s.depth, s, false, k)));
        into.sort_unstable_by(Event::compare);
    }

    /// Where the strokes of a tile begin and end in depth, nearest first.
    pub(super) fn events<'a>(&'a self, tile: usize, into: &mut Vec<Event<'a>>) {
        into.clear();
        into.extend(self.of(tile).enumerate().flat_map(|(k, s)| {
            [Event::new(s.depth - s.delta, s, false, k), Event::new(s.depth + s.delta, s, true, k)]
        }));
        into.sort_unstable_by(Event::compare);
    }
}

/// A stroke begins or ends at a depth.
#[derive(Clone, Copy)]
pub(super) struct Event<'a> {
    key: u64,
    pub(super) depth: f64,
    pub(super) sprite: &'a Sprite,
    pub(super) ends: bool,
    /// Which stroke of its tile.
    pub(super) local: u32,
}

impl<'a> Event<'a> {
    fn new(depth: f64, sprite: &'a Sprite, ends: bool, local: usize) -> Self {
        let bits = (depth + 0.0).to_bits();
        // Bits of floats in their order: all turned for negative numbers, the sign only for others.
        let key = bits ^ (((bits as i64 >> 63) as u64) | 1 << 63);
        Self { key, depth, sprite, ends, local: local as u32 }
    }

    fn compare(a: &Self, b: &Self) -> std::cmp::Ordering {
        let rest = |e: &Self| (e.sprite.id, e.sprite.index, e.ends);
        a.key.cmp(&b.key).then_with(|| rest(a).cmp(&rest(b)))
    }
}

fn chunk(
    strokes: &Sprites<'_>,
    range: std::ops::Range<usize>,
    size: [usize; 2],
    columns: usize,
    rows: usize,
) -> Result<(Chunk, f64)> {
    let mut ready = Vec::with_capacity(range.len());
    let mut first = vec![0_u32; columns * rows + 1];
    let (mut delta, mut memo) = (0.0_f64, Memo::default());
    for i in range {
        let Some(sprite) = strokes.sprite(i, &mut memo)? else { continue };
        let [x0, x1, y0, y1] = sprite.pixels(size);
        if x0 >= x1 || y0 >= y1 {
            continue;
        }
        delta = delta.max(sprite.delta);
        let touched = [x0 / WIDTH, (x1 - 1) / WIDTH, y0 / HEIGHT, (y1 - 1) / HEIGHT].map(|t| t as u32);
        for row in touched[2]..=touched[3] {
            for column in touched[0]..=touched[1] {
                first[row as usize * columns + column as usize + 1] += 1;
            }
        }
        ready.push((sprite, touched));
    }
    for t in 1..first.len() {
        first[t] += first[t - 1];
    }
    let Some(&(any, _)) = ready.first() else { return Ok((Chunk { first, sprites: Vec::new() }, delta)) };
    let mut sprites = vec![any; first[columns * rows] as usize];
    let mut next = first.clone();
    for (sprite, [left, right, top, bottom]) in &ready {
        for row in *top..=*bottom {
            for column in *left..=*right {
                let place = &mut next[row as usize * columns + column as usize];
                sprites[*place as usize] = *sprite;
                *place += 1;
            }
        }
    }
    Ok((Chunk { first, sprites }, delta))
}

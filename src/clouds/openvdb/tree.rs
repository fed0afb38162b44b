//! The tree of an OpenVDB grid (32³ nodes of 16³ nodes of 8³ leaves) and its values as a dense box.
//!
//! Topology first (masks and tiles), then the box is known and compared with its limit, then the leaves' values go
//! straight to their place: memory is the box and 80 bytes a leaf. Values are those that `getValue` of OpenVDB gives,
//! inactive ones too, inside the box of the active ones. Tiles and leaves never overlap in a sound file, so their sum of
//! voxels bounds the work.

use super::bytes::{Cursor, bad, half};
use crate::error::Result;
use crate::job::Job;

/// The type of a grid's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    Single,
    Double,
    Int32,
    Int64,
}

/// How a grid's values are stored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    pub(super) number: Number,
    /// Buffers are in half precision; single values are not.
    pub(super) half: bool,
    /// 1 zlib, 2 active values only, 4 Blosc.
    pub(super) compression: u32,
}

/// A cube of one value.
#[derive(Debug, Clone, Copy)]
struct Tile {
    origin: [i32; 3],
    edge: i32,
    value: f32,
    active: bool,
}

#[derive(Debug, Clone)]
struct Leaf {
    origin: [i32; 3],
    mask: [u8; 64],
}

/// Where a tree has what.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    pub(super) background: f32,
    tiles: Vec<Tile>,
    leaves: Vec<Leaf>,
}

/// A box of voxels in index space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Extent {
    pub(super) low: [i64; 3],
    pub(super) size: [u64; 3],
}

/// Where a voxel of an [`Extent`] goes: `start + Σ step · (index − low)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placing {
    pub(super) start: i64,
    pub(super) step: [i64; 3],
}

fn on(mask: &[u8], bit: usize) -> bool {
    mask[bit >> 3] >> (bit & 7) & 1 == 1
}

/// Coordinates of child `n` of a node of `edge` children.
fn place(n: usize, edge: usize) -> [i32; 3] {
    [(n / (edge * edge)) as i32, (n / edge % edge) as i32, (n % edge) as i32]
}

impl Number {
    fn bytes(self) -> usize {
        if matches!(self, Self::Single | Self::Int32) { 4 } else { 8 }
    }

    fn value(self, bytes: &[u8]) -> f32 {
        let mut long = [0; 8];
        long[..bytes.len()].copy_from_slice(bytes);
        let short = [long[0], long[1], long[2], long[3]];
        match self {
            Self::Single => f32::from_le_bytes(short),
            Self::Double => f64::from_le_bytes(long) as f32,
            Self::Int32 => i32::from_le_bytes(short) as f32,
            Self::Int64 => i64::from_le_bytes(long) as f32,
        }
    }
}

impl Layout {
    fn one(self, from: &mut Cursor<'_>) -> Result<f32> {
        Ok(self.number.value(from.take(self.number.bytes())?))
    }

    fn buffer(self, from: &mut Cursor<'_>, count: usize) -> Result<Vec<f32>> {
        if self.half {
            // Without values a buffer of halves has no length either; one of other numbers has.
            if count == 0 {
                return Ok(Vec::new());
            }
            let bytes = from.buffer(2 * count, self.compression)?;
            return Ok(bytes.chunks_exact(2).map(|b| half(u16::from_le_bytes([b[0], b[1]]))).collect());
        }
        let width = self.number.bytes();
        let bytes = from.buffer(width * count, self.compression)?;
        Ok(bytes.chunks_exact(width).map(|b| self.number.value(b)).collect())
    }

    /// All values of a node, whichever of them are stored.
    fn node(self, from: &mut Cursor<'_>, mask: &[u8], background: f32) -> Result<Vec<f32>> {
        let count = 8 * mask.len();
        let kind = from.array::<1>()?[0];
        let mut inactive = [if kind == 0 { background } else { -background }, background];
        if matches!(kind, 2 | 4 | 5) {
            inactive[0] = self.one(from)?;
        }
        match kind {
            0..=4 | 6 => {}
            5 => inactive[1] = self.one(from)?,
            _ => return Err(bad(format!("is damaged: a node of kind {kind}"))),
        }
        let choice = if (3..=5).contains(&kind) { Some(from.take(mask.len())?) } else { None };
        let stored: usize = mask.iter().map(|b| b.count_ones() as usize).sum();
        if self.compression & 2 == 0 || kind == 6 || stored == count {
            return self.buffer(from, count);
        }
        let mut active = self.buffer(from, stored)?.into_iter();
        let value = |n: usize| {
            let given = if on(mask, n) { active.next() } else { None };
            given.unwrap_or_else(|| inactive[usize::from(choice.is_some_and(|c| on(c, n)))])
        };
        Ok((0..count).map(value).collect())
    }
}

/// Corner of a node of the root.
fn corner(from: &mut Cursor<'_>) -> Result<[i32; 3]> {
    let mut out = [0; 3];
    for v in &mut out {
        *v = i32::from_le_bytes(from.array()?);
        if v.unsigned_abs() > 1 << 30 {
            return Err(bad(format!("is damaged: a node at index {v}")));
        }
    }
    Ok(out)
}

impl Tree {
    /// Masks and tiles; at most `most` tiles of a cube of 8 voxels each are kept.
    pub(super) fn topology(from: &mut Cursor<'_>, layout: Layout, most: u64, job: &Job) -> Result<Self> {
        let buffers = from.u32()?;
        if buffers != 1 {
            return Err(bad(format!("has {buffers} buffers for each leaf; 1 is read")));
        }
        let background = layout.one(from)?;
        let (tiles, children) = (from.u32()?, from.u32()?);
        let mut tree = Self { background, tiles: Vec::new(), leaves: Vec::new() };
        for _ in 0..tiles {
            let origin = corner(from)?;
            let value = layout.one(from)?;
            let active = from.array::<1>()?[0] != 0;
            tree.tiles.push(Tile { origin, edge: 4096, value, active });
        }
        for _ in 0..children {
            let origin = corner(from)?;
            tree.inner(from, layout, origin, 32, 128, most, job)?;
        }
        Ok(tree)
    }

    /// A node of `edge`³ children of `child`³ voxels, and what is below it.
    fn inner(
        &mut self,
        from: &mut Cursor<'_>,
        layout: Layout,
        origin: [i32; 3],
        edge: usize,
        child: i32,
        most: u64,
        job: &Job,
    ) -> Result<()> {
        job.check()?;
        let (children, active) = (from.take(edge.pow(3) / 8)?, from.take(edge.pow(3) / 8)?);
        let values = layout.node(from, active, self.background)?;
        let at = |n: usize| {
            let p = place(n, edge);
            [origin[0] + p[0] * child, origin[1] + p[1] * child, origin[2] + p[2] * child]
        };
        for (n, &value) in values.iter().enumerate() {
            let active = on(active, n);
            if !on(children, n) && (active || value.to_bits() != self.background.to_bits()) {
                self.tiles.push(Tile { origin: at(n), edge: child, value, active });
            }
        }
        if self.tiles.len() as u64 > most / 512 {
            return Err(bad(format!("has more than {} tiles of 8 voxels and more: max_voxels is {most}", most / 512)));
        }
        for n in (0..edge.pow(3)).filter(|&n| on(children, n)) {
            if edge == 32 {
                self.inner(from, layout, at(n), 16, 8, most, job)?;
            } else {
                self.leaves.push(Leaf { origin: at(n), mask: from.array()? });
            }
        }
        Ok(())
    }

    /// The box of the active voxels; nothing if there is none.
    pub(super) fn extent(&self) -> Option<Extent> {
        let (mut low, mut high) = ([i64::MAX; 3], [i64::MIN; 3]);
        let mut grow = |a: [i32; 3], edge: i32| {
            for k in 0..3 {
                low[k] = low[k].min(i64::from(a[k]));
                high[k] = high[k].max(i64::from(a[k]) + i64::from(edge));
            }
        };
        for tile in self.tiles.iter().filter(|t| t.active) {
            grow(tile.origin, tile.edge);
        }
        for leaf in &self.leaves {
            for n in (0..512).filter(|&n| on(&leaf.mask, n)) {
                let p = place(n, 8);
                grow([leaf.origin[0] + p[0], leaf.origin[1] + p[1], leaf.origin[2] + p[2]], 1);
            }
        }
        let size = [0, 1, 2].map(|k| high[k].saturating_sub(low[k]));
        (size[0] > 0).then_some(Extent { low, size: size.map(i64::unsigned_abs) })
    }

    /// Fill `out` with the values inside `extent`, reading the leaves' from the file.
    pub(super) fn fill(
        &self,
        from: &mut Cursor<'_>,
        layout: Layout,
        extent: &Extent,
        placing: &Placing,
        out: &mut [f32],
        job: &Job,
    ) -> Result<()> {
        out.fill(self.background);
        let mut work = out.len() as u64;
        let high = [0, 1, 2].map(|k| extent.low[k] + extent.size[k] as i64);
        // Calls `put` for the part of a cube that is inside; fails where cubes overlap.
        let mut cube = |origin: [i32; 3], edge: i32, value: &dyn Fn([i64; 3]) -> f32| -> Result<()> {
            let o = origin.map(i64::from);
            let a = [0, 1, 2].map(|k| o[k].max(extent.low[k]));
            let b = [0, 1, 2].map(|k| (o[k] + i64::from(edge)).min(high[k]).max(a[k]));
            let voxels = (b[0] - a[0]) as u64 * (b[1] - a[1]) as u64 * (b[2] - a[2]) as u64;
            work = work.checked_sub(voxels).ok_or_else(|| bad("is damaged: nodes of the tree overlap"))?;
            for x in a[0]..b[0] {
                job.check()?;
                for y in a[1]..b[1] {
                    for z in a[2]..b[2] {
                        let v = value([x - o[0], y - o[1], z - o[2]]);
                        let index = [x, y, z];
                        if !v.is_finite() {
                            return Err(bad(format!("has the value {v} at index ({x}, {y}, {z})")));
                        }
                        let to: i64 = (0..3).map(|k| (index[k] - extent.low[k]) * placing.step[k]).sum();
                        if let Some(slot) = out.get_mut((placing.start + to) as usize) {
                            *slot = v;
                        }
                    }
                }
            }
            Ok(())
        };
        for tile in &self.tiles {
            cube(tile.origin, tile.edge, &|_| tile.value)?;
        }
        for leaf in &self.leaves {
            let values = leaf.values(from, layout, self.background)?;
            cube(leaf.origin, 8, &|p| values[(64 * p[0] + 8 * p[1] + p[2]) as usize])?;
        }
        Ok(())
    }

    /// Go past the leaves' values.
    pub(super) fn skip(&self, from: &mut Cursor<'_>, layout: Layout) -> Result<()> {
        self.leaves.iter().try_for_each(|leaf| leaf.values(from, layout, self.background).map(|_| ()))
    }
}

impl Leaf {
    fn values(&self, from: &mut Cursor<'_>, layout: Layout, background: f32) -> Result<Vec<f32>> {
        let mask = from.take(64)?;
        if mask != self.mask {
            return Err(bad(format!("is damaged: two masks of the leaf at {:?}", self.origin)));
        }
        layout.node(from, mask, background)
    }
}

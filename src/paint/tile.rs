//! The pixels of a tile while it is painted: colour planes, transmittance, and an occlusion mask of blocks that are
//! opaque.
//!
//! A block of 8 x 4 pixels is opaque below a transmittance of 1e-4: what is behind it is not painted.

use super::cover::{AREA, STRIDE, TileWindow};
use super::mask::{GROUP, Lane};
use super::sprite::Sprite;
use super::tile_binning::HEIGHT;

/// What lets less through is closed \[1\].
const OPAQUE: f32 = 1e-4;
/// Rows of a block; its columns are those of a group.
const BLOCK: usize = HEIGHT / 8;

/// A plane of a tile.
pub(super) type Plane = Vec<f32>;

/// The pixels of a tile.
pub(super) struct Tile {
    pub(super) window: TileWindow,
    pub(super) light: [Plane; 3],
    pub(super) transmittance: Plane,
    /// A bit for each block behind which something might be seen: eight in each of eight rows.
    pub(super) open_blocks: u64,
}

impl Tile {
    pub(super) fn new() -> Self {
        let plane = || vec![0.0; AREA];
        Self {
            window: TileWindow::default(),
            light: [plane(), plane(), plane()],
            transmittance: plane(),
            open_blocks: 0,
        }
    }

    pub(super) fn begin(&mut self, at: [usize; 2], size: [usize; 2]) {
        self.window = TileWindow { at, from: at, end: [at[0] + size[0], at[1] + size[1]] };
        self.light.iter_mut().for_each(|plane| plane.fill(0.0));
        self.transmittance.fill(1.0);
        self.open_blocks = u64::MAX;
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> [usize; 2] {
        let TileWindow { at, end, .. } = self.window;
        [end[0] - at[0], end[1] - at[1]]
    }

    /// Find the blocks that are closed; whether all are.
    #[inline(always)]
    pub(super) fn update_occlusion(&mut self) -> bool {
        self.close_below(OPAQUE)
    }

    /// Find the blocks that let less than `limit` through everywhere; whether all do.
    #[inline(always)]
    pub(super) fn close_below(&mut self, limit: f32) -> bool {
        let size = self.size();
        self.open_blocks = 0;
        for row in 0..size[1].div_ceil(BLOCK) {
            for column in 0..size[0].div_ceil(GROUP) {
                let mut most = [0.0_f32; GROUP];
                for y in row * BLOCK..size[1].min((row + 1) * BLOCK) {
                    let transmittance = lane(&mut self.transmittance, y * STRIDE + column * GROUP);
                    for i in 0..GROUP {
                        most[i] = if transmittance[i] > most[i] { transmittance[i] } else { most[i] };
                    }
                }
                // Beyond the right border are pixels of no picture.
                let inside = GROUP.min(size[0] - column * GROUP);
                let open = most[..inside].iter().any(|&t| t >= limit);
                self.open_blocks |= u64::from(open) << (8 * row + column);
            }
        }
        self.open_blocks == 0
    }

    /// Whether any of a stroke might be seen.
    #[inline(always)]
    pub(super) fn shows(&self, sprite: &Sprite) -> bool {
        self.open_blocks & self.blocks(sprite) != 0
    }

    /// A bit for each block that a stroke may be in.
    #[inline(always)]
    pub(super) fn blocks(&self, sprite: &Sprite) -> u64 {
        let [x0, x1, y0, y1] = self.window.pixels(sprite);
        if x0 >= x1 || y0 >= y1 {
            return 0;
        }
        let [x, y] = self.window.at;
        let (left, right) = ((x0 - x) / GROUP, (x1 - 1 - x) / GROUP);
        let (top, bottom) = ((y0 - y) / BLOCK, (y1 - 1 - y) / BLOCK);
        let columns = (0xff >> (7 - (right - left))) << left;
        let rows = (u64::MAX >> (8 * (7 - (bottom - top)))) << (8 * top);
        rows & (columns * 0x0101_0101_0101_0101)
    }
}

/// Eight pixels of a plane.
#[inline(always)]
pub(super) fn lane<T>(plane: &mut [T], at: usize) -> &mut Lane<T> {
    plane[at..].first_chunk_mut().expect("a tile's rows are padded by a group")
}

/// The colour of eight pixels of a stroke whose colour varies.
#[inline(always)]
pub(super) fn textured_color(flat: &[Lane<f32>; 3], vary: [f32; 3], tone: &Lane<f32>) -> [Lane<f32>; 3] {
    let mut out = *flat;
    for c in 0..3 {
        for i in 0..GROUP {
            out[c][i] = flat[c][i] + vary[c] * tone[i];
        }
    }
    out
}

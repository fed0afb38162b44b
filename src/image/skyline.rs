//! Skyline detection (floor 1): one row for each column of a photograph, below which there is land, water, trees.
//!
//! Our own method; the papers leave this to the user's hand. On a grid of at most 200 × 200 cells each cell gets a
//! score in favour of ground: texture, green, dark, and warm colours (more so under a blue sky) speak for it, blue and
//! bright against it, and the lower the likelier. A row whose wide mean speaks for ground makes everything below it
//! ground too: a lake below a shore is as blue as the sky. The skyline is then the path from the left to the right edge
//! with the least sum of scores above it minus scores below, plus a price for each step up or down and minus a reward
//! for running along an edge (dynamic programming, exact). It may run along the lower edge of the picture: no ground.
//! At last each column looks for the strongest edge within a cell of it.
//!
//! A step of the path is dear where the picture has no vertical edge, texture alone does not make what lies below it ground,
//! and what was found must score as land on the mean: no column is cut through a cloud.
//!
//! The weights were set by looking at twelve photographs (mountains, snow, dune, grass, lakes, sea at sunset, cumulus
//! in front of nothing); `tests/oracles/test_segment.py` holds what they give. What stands in front of the sky and has
//! sky below it (a kite, cables) is not ground to this method; very bright snow against cloud may be missed.

use super::blur::blur;
use crate::error::Result;
use crate::job::Job;

const CELLS: usize = 200;
/// Texture counts up to here for what lies below.
const ENOUGH: f32 = 0.5;
/// Mean score of land: our photographs have 0.5 and more, cut clouds seldom above 0.1.
const LAND: f32 = 0.1;
/// Below this fraction of the picture it is a stray, not ground.
const LEAST: f64 = 0.015;

/// Means over one cell.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    rgb: [f32; 3],
    texture: f32,
}

struct Grid {
    h: usize,
    w: usize,
    size: usize,
    cells: Vec<Cell>,
}

/// Square root of the mean of a pixel's channels: about its brightness to the eye.
fn brightness(rgb: &[f32], scale: f32) -> f32 {
    ((rgb[0] + rgb[1] + rgb[2]).max(0.0) * (scale / 3.0)).sqrt()
}

fn clip(x: f32, low: f32, high: f32) -> f32 {
    x.max(low).min(high)
}

impl Grid {
    fn new(job: &Job, rgb: &[f32], h: usize, w: usize, scale: f32) -> Result<Self> {
        let size = h.max(w).div_ceil(CELLS);
        let (gh, gw) = (h.div_ceil(size), w.div_ceil(size));
        let rows = job.map(gh, |gy| {
            let mut row = vec![Cell::default(); gw];
            let mut count = vec![0.0_f32; gw];
            for y in gy * size..((gy + 1) * size).min(h) {
                for x in 0..w {
                    let i = y * w + x;
                    let here = brightness(&rgb[3 * i..], scale);
                    let right = if x + 1 < w { brightness(&rgb[3 * i + 3..], scale) } else { here };
                    let below = if y + 1 < h { brightness(&rgb[3 * (i + w)..], scale) } else { here };
                    let cell = &mut row[x / size];
                    for c in 0..3 {
                        cell.rgb[c] += (rgb[3 * i + c] * scale).max(0.0);
                    }
                    cell.texture += ((right - here).abs() + (below - here).abs()) / (here + 0.1);
                    count[x / size] += 1.0;
                }
            }
            for (cell, n) in row.iter_mut().zip(count) {
                cell.rgb = cell.rgb.map(|v| v / n);
                cell.texture /= n;
            }
            Ok(row)
        })?;
        Ok(Self { h: gh, w: gw, size, cells: rows.into_iter().flatten().collect() })
    }

    /// Mean texture of 5 × 5 cells around one, mostly above it: what lies below must not be felt far up.
    fn texture(&self, y: usize, x: usize) -> f32 {
        let mut sum = 0.0;
        for dy in 0..5 {
            for dx in 0..5 {
                let y = (y + dy).saturating_sub(3).min(self.h - 1);
                let x = (x + dx).saturating_sub(2).min(self.w - 1);
                // Capped: one sharp edge is no texture.
                sum += self.cells[y * self.w + x].texture.min(0.3);
            }
        }
        sum / 25.0
    }

    /// Score in favour of ground of each cell, and the same where texture alone says little.
    fn scores(&self) -> (Vec<f32>, Vec<f32>) {
        let (h, w) = (self.h, self.w);
        let bright = |c: &Cell| brightness(&c.rgb, 1.0);
        let blueness = |c: &Cell| (c.rgb[2] - c.rgb[0]) / (c.rgb[2] + c.rgb[0] + 1e-3);
        let upper = &self.cells[..(h / 2).max(1) * w];
        let blue = upper.iter().filter(|c| blueness(c) > 0.25 && bright(c) > 0.3).count();
        let day = clip((blue as f32 / upper.len() as f32 - 0.15) / 0.2, 0.0, 1.0);
        let mut scores = Vec::with_capacity(h * w);
        // The same where texture alone says little: clouds have it, too.
        let mut plain = Vec::with_capacity(h * w);
        for y in 0..h {
            for x in 0..w {
                let cell = &self.cells[y * w + x];
                let (v, n) = (bright(cell), blueness(cell));
                let [r, g, b] = cell.rgb.map(f32::sqrt);
                let green = (2.0 * g - r - b) / (r + g + b + 1e-3);
                let texture = clip((self.texture(y, x) - 0.05) / 0.035, -0.8, 3.0);
                let mut s = texture;
                s += 1.5 * clip((green - 0.02) / 0.06, 0.0, 1.0);
                s += clip((0.45 - v) / 0.15, -1.0, 1.5);
                s -= 2.0 * clip(n / 0.3, 0.0, 1.0) * clip((v - 0.1) / 0.2, 0.0, 1.0);
                // Warm colours under a blue sky are earth; under a red one they may be the sky.
                s += (0.5 + 1.1 * day) * clip((-n - 0.2) / 0.3, 0.0, 1.0) * clip((0.68 - v) / 0.1, 0.0, 1.0);
                s += 2.5 * day * clip((-n - 0.02) / 0.12, 0.0, 1.0) * clip((0.9 - v) / 0.1, 0.0, 1.0);
                s += 1.5 * ((y as f32 + 0.5) / h as f32 - 0.5) - 0.2;
                scores.push(s);
                plain.push(s - (texture - ENOUGH).max(0.0));
            }
        }
        // Below a row that is ground over a third of the width there is more ground.
        let reach = w / 6;
        let mut most = vec![f32::NEG_INFINITY; w];
        for y in 0..h {
            let row = scores[y * w..][..w].to_vec();
            let bare = &plain[y * w..][..w];
            for x in 0..w {
                let sum: f32 = (0..=2 * reach).map(|d| bare[(x + d).saturating_sub(reach).min(w - 1)]).sum();
                most[x] = most[x].max(sum / (2 * reach + 1) as f32);
                if most[x] > 0.3 {
                    // What is as blue as a clear sky stays sky: the skyline may be steep.
                    scores[y * w + x] = row[x].max((0.7 * most[x]).min(row[x] + 2.5));
                }
            }
        }
        (scores, plain)
    }

    /// Strength of the edge above each cell, in [0, 1]: steps of any channel between the rows around it.
    fn edges(&self) -> Vec<f32> {
        let (h, w) = (self.h, self.w);
        let mut edges = vec![0.0_f32; h * w];
        for c in 0..3 {
            let smooth = |y: usize, x: usize| {
                let near = |d: usize| self.cells[y * w + (x + d).saturating_sub(2).min(w - 1)].rgb[c].sqrt();
                (0..5).map(near).sum::<f32>() / 5.0
            };
            for y in 1..h.saturating_sub(1) {
                for x in 0..w {
                    let edge = &mut edges[y * w + x];
                    *edge = edge.max(step(smooth(y - 1, x), smooth(y + 1, x)));
                }
            }
        }
        edges
    }

    /// Strength of the edge to the left of each cell, in [0, 1]: steps of any channel between the columns around it.
    fn sides(&self) -> Vec<f32> {
        let (h, w) = (self.h, self.w);
        let mut sides = vec![0.0_f32; h * w];
        for c in 0..3 {
            let mean = |y: usize, x: usize| {
                let near = |d: usize| self.cells[(y + d).saturating_sub(1).min(h - 1) * w + x].rgb[c].sqrt();
                (0..3).map(near).sum::<f32>() / 3.0
            };
            for y in 0..h {
                for x in 1..w {
                    let side = &mut sides[y * w + x];
                    *side = side.max(step(mean(y, x.saturating_sub(2)), mean(y, (x + 1).min(w - 1))));
                }
            }
        }
        sides
    }
}

/// Relative step between two brightnesses, in [0, 1].
fn step(a: f32, b: f32) -> f32 {
    (2.0 * (a - b).abs() / (a + b + 0.2)).min(1.0)
}

/// The cheapest path: for each column the first row of the ground, `h` for none. A step is dear where the picture has no
/// `sides` there, edges between a cell and that to its left: ground is no column cut through a cloud.
fn path(scores: &[f32], edges: &[f32], sides: &[f32], h: usize, w: usize) -> Vec<usize> {
    const REWARD: f32 = 6.0;
    const STEP: f32 = 0.5;
    const BARE: f32 = 2.5;
    let rows = h + 1;
    let forbidden = h - h / 40 - 1;
    let mut before = vec![0.0_f32; rows];
    let mut from = vec![0_u16; rows * w];
    for x in 0..w {
        if x > 0 {
            let from = &mut from[x * rows..][..rows];
            for (y, f) in from.iter_mut().enumerate() {
                *f = y as u16;
            }
            // Between rows y and y + 1 lies cell y.
            let price = |y: usize| STEP + BARE * (1.0 - (4.0 * sides[y * w + x]).min(1.0));
            for y in 1..rows {
                if before[y - 1] + price(y - 1) < before[y] {
                    before[y] = before[y - 1] + price(y - 1);
                    from[y] = from[y - 1];
                }
            }
            for y in (0..h).rev() {
                if before[y + 1] + price(y) < before[y] {
                    before[y] = before[y + 1] + price(y);
                    from[y] = from[y + 1];
                }
            }
        }
        let mut above = 0.0;
        for y in 0..rows {
            let edge = if y < h { edges[y * w + x] } else { 0.0 };
            // A sliver of ground along the lower edge would be an artefact of the picture's border.
            let sliver = if y >= forbidden && y < h { 20.0 } else { 0.0 };
            before[y] += above - REWARD * edge + sliver;
            if y < h {
                above += scores[y * w + x];
            }
        }
    }
    let mut y = (0..rows).fold(0, |best, y| if before[y] < before[best] { y } else { best });
    let mut out = vec![0; w];
    for x in (0..w).rev() {
        out[x] = y;
        y = from[x * rows + y] as usize;
    }
    out
}

/// Mask of what is not sky in a linear-light `(h, w, 3)` picture.
pub fn ground(job: &Job, rgb: &[f32], h: usize, w: usize) -> Result<Vec<bool>> {
    let mut mask = vec![false; h * w];
    if h < 8 || w < 8 {
        return Ok(mask);
    }
    // The scores know display-referred brightness; physical units are scaled to it by their brightest percent.
    let mut grid = Grid::new(job, rgb, h, w, 1.0)?;
    let mut levels: Vec<f32> = grid.cells.iter().map(|c| (c.rgb[0] + c.rgb[1] + c.rgb[2]) / 3.0).collect();
    let place = levels.len() * 99 / 100;
    let high = *levels.select_nth_unstable_by(place, f32::total_cmp).1;
    if high > 0.0 && !(0.05..=1.0).contains(&high) {
        // The noise of a dark picture is no texture: means of 5 × 5 pixels.
        let soft = if high < 0.05 { Some(blur(&blur(rgb, [h, w, 3], job)?, [h, w, 3], job)?) } else { None };
        grid = Grid::new(job, soft.as_deref().unwrap_or(rgb), h, w, 0.8 / high)?;
    }
    job.check()?;
    let (scores, plain) = grid.scores();
    let cut = path(&scores, &grid.edges(), &grid.sides(), grid.h, grid.w);
    // What lies below must look like land as a whole.
    let below = |i: &usize| i / grid.w >= cut[i % grid.w];
    let (sum, count) = (0..plain.len()).filter(below).fold((0.0, 0.0), |(s, n), i| (s + plain[i], n + 1.0));
    if count == 0.0 || sum / count < LAND {
        return Ok(mask);
    }
    let scale = if high > 0.0 { 1.0 / high } else { 1.0 };
    let mut total = 0;
    let mut tops = vec![h; w];
    for x in 0..w {
        // The path at this column, between the centres of the cells.
        let at = ((x as f32 + 0.5) / grid.size as f32 - 0.5).max(0.0);
        let (left, fraction) = ((at as usize).min(grid.w - 1), at.fract());
        let right = (left + 1).min(grid.w - 1);
        if cut[left] >= grid.h && cut[right] >= grid.h {
            continue;
        }
        let row = (cut[left] as f32 * (1.0 - fraction) + cut[right] as f32 * fraction) * grid.size as f32;
        tops[x] = refined(rgb, h, w, x, row as usize, grid.size, scale);
        total += h - tops[x];
    }
    // A night is as dark as land: where nothing else is found it is all sky.
    let night = high < 0.1 && total == h * w;
    if night || (total as f64) < LEAST * (h * w) as f64 {
        return Ok(mask);
    }
    for (i, m) in mask.iter_mut().enumerate() {
        *m = i / w >= tops[i % w];
    }
    Ok(mask)
}

/// The row of the strongest edge within a cell and a half of `row`, near ones preferred.
fn refined(rgb: &[f32], h: usize, w: usize, x: usize, row: usize, size: usize, scale: f32) -> usize {
    let reach = size + size / 2;
    let (mut best, mut most) = (row.min(h), 0.0);
    for y in row.saturating_sub(reach).max(2)..=(row + reach).min(h - 2) {
        let value = |y: usize, c: usize| (rgb[3 * (y * w + x) + c] * scale).max(0.0).sqrt();
        let mut edge = 0.0_f32;
        for c in 0..3 {
            edge = edge.max(step(value(y - 2, c) + value(y - 1, c), value(y, c) + value(y + 1, c)));
        }
        let edge = edge * (1.0 - y.abs_diff(row) as f32 / (2 * reach + 1) as f32);
        if edge > most {
            (best, most) = (y, edge);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blue_sky_over_grass_is_cut_at_the_horizon() {
        let (h, w) = (120, 160);
        let rgb: Vec<f32> =
            (0..h * w).flat_map(|i| if i / w < 70 { [0.2, 0.35, 0.7] } else { [0.06, 0.10, 0.02] }).collect();
        let mask = ground(&Job::serial(), &rgb, h, w).expect("runs");
        assert!(mask.iter().enumerate().all(|(i, &g)| g == (i / w >= 70)), "to the pixel");
    }

    #[test]
    fn nothing_but_sky_has_no_ground() {
        for colour in [[0.2_f32, 0.35, 0.7], [0.5, 0.5, 0.5], [0.9, 0.9, 0.9]] {
            let rgb: Vec<f32> = colour.iter().copied().cycle().take(3 * 90 * 130).collect();
            assert!(!ground(&Job::serial(), &rgb, 90, 130).expect("runs").contains(&true), "{colour:?}");
        }
    }
}

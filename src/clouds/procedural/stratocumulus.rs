//! Stratocumulus: a low layer of cells, drawn out into rolls, with a flat base and thin or open seams.
//!
//! Cells are those of points scattered over the plane (Worley 1996): each is a dome, lower towards the seam with its
//! neighbours, where the air sinks. Billowing noise erodes the surface. The layer reaches the side faces of its box, as
//! a layer does; below and above it is clear.

use super::shape::{CloudShape, edge_falloff, margin};
use crate::math::interpolation::smoothstep;
use crate::math::noise::Perlin;
use crate::math::random::Stream;

/// Elongation of cells along the rolls.
const ROLL: f64 = 1.7;

pub(super) struct Stratocumulus {
    size: [usize; 3],
    /// Length of a cell across the rolls, and thickness of the layer [voxels].
    cell: f64,
    thick: f64,
    /// Height of the base [voxels].
    floor: f64,
    along: [f64; 2],
    points: Stream,
    billows: Perlin,
    broad: Perlin,
}

impl Stratocumulus {
    pub(super) fn new(size: [usize; 3], key: u64) -> Self {
        let [nx, ny, nz] = size;
        let margin = margin(nz);
        let room = nz as f64 - 2.0 * margin;
        // A few cells must fit: in a high and narrow box the layer is thinner than the room it has.
        let cell = (1.9 * room).min(0.16 * nx.min(ny) as f64).max(4.0);
        let thick = room.min(0.8 * cell).max(2.0);
        let random = Stream::new(key, 0xD0);
        let heading = std::f64::consts::PI * random.uniform(0);
        Self {
            size,
            cell,
            thick,
            floor: margin + 0.4 * (room - thick).max(0.0),
            along: [heading.cos(), heading.sin()],
            points: Stream::new(key, 0xD1),
            billows: Perlin::new(key, 0xD2),
            broad: Perlin::new(key, 0xD3),
        }
    }

    /// Distances from a point of the plane to the nearest and the second nearest of the scattered points.
    fn nearest(&self, x: f64, y: f64) -> [f64; 2] {
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        let mut best = [f64::INFINITY; 2];
        for b in j - 2..=j + 2 {
            for a in i - 2..=i + 2 {
                let index = (a as u64 & 0xFFFF_FFFF) << 32 | (b as u64 & 0xFFFF_FFFF);
                let dx = a as f64 + 0.15 + 0.7 * self.points.uniform(index) - x;
                let dy = b as f64 + 0.15 + 0.7 * self.points.uniform(!index) - y;
                let d = (dx * dx + dy * dy).sqrt();
                if d < best[0] {
                    best = [d, best[0]];
                } else if d < best[1] {
                    best[1] = d;
                }
            }
        }
        best
    }
}

impl CloudShape for Stratocumulus {
    fn fill_row(&self, j: usize, k: usize, row: &mut [f32]) {
        let open = edge_falloff(k, self.size[2]);
        let height = (k as f64 + 0.5 - self.floor) / self.thick;
        if open == 0.0 || !(-0.1..1.1).contains(&height) {
            return;
        }
        for (i, out) in row.iter_mut().enumerate() {
            let (x, y) = ((i as f64 + 0.5) / self.cell, (j as f64 + 0.5) / self.cell);
            let [c, s] = self.along;
            let (along, across) = ((c * x + s * y) / ROLL, c * y - s * x);
            // Cells are bent by slow noise, so that no row of them is straight.
            let bend = [self.broad.at(along, across, 3.5), self.broad.at(along, across, 8.5)];
            let [first, second] = self.nearest(along + 0.45 * bend[0], across + 0.45 * bend[1]);
            let seam = second - first;
            let patch = self.broad.fbm(0.45 * x, 0.45 * y, 0.5, 3, 0.5);
            // Some regions are closed, in others the seams gape.
            let dome = (1.0 - 0.45 * first * first).max(0.0);
            let body = smoothstep(-0.34, 0.45, seam + 0.75 * patch) * dome;
            if body == 0.0 {
                continue;
            }
            let z = height * self.thick / self.cell;
            let (mut swell, mut weight, mut frequency) = (0.0, 0.22, 2.3);
            for octave in 0..5 {
                let shift = 23.1 * f64::from(octave);
                let n = self.billows.at(x * frequency + shift, y * frequency - shift, z * frequency).abs();
                swell += weight * (0.32 - n);
                weight *= 0.58;
                frequency *= 2.03;
            }
            let top = 0.15 + 0.70 * body * (1.0 + 0.5 * patch);
            let bottom = 0.03 + 0.10 * (1.0 - body) + 0.03 * (1.0 + bend[0]);
            // The roof is knobbly, the base nearly smooth.
            let depth =
                (top - height + swell).min(1.5 * (height - bottom) + 0.25 * swell).min(1.6 * body + swell - 0.10);
            let water = 0.45 + 0.55 * height.clamp(0.0, 1.0);
            *out = (smoothstep(0.0, 0.16, depth) * water * open) as f32;
        }
    }
}

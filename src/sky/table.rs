//! A look-up table of radiance over the sky: coordinates, bicubic (Lagrange) and bilinear interpolation (floor 3).
//!
//! Seen from one point, single scattering without its phase functions is a smooth function of two numbers: the cosine
//! `mu` of the angle to the vertical and the cosine `c` of the azimuth from the sun. Of the fraction `m` of `mu`
//! between the horizon and the top of the table, `p = 1 - sqrt(1 - m)` is smooth in the angle at the zenith, and rows
//! are the mean of `p` and `p (1 + a) / (p + a)`, which crowds half of them near the horizon, where the path is long;
//! columns are even in `c`. Between nodes: four-point Lagrange both ways.
//!
//! A node is a group of four numbers, so that a lookup is sixteen loads of a vector: SIMD runs over the channels. That
//! is `Vec4`'s work: left to itself the compiler would add the numbers one by one.

use glam::Vec4;

use super::model::BLOCK;
use crate::error::Result;
use crate::job::Job;
use crate::math::interpolation::lagrange4;

/// The `p` below which rows crowd.
pub const CROWD: f64 = 0.03;

/// Groups of values over rows and columns.
#[derive(Debug, Clone)]
pub struct Table {
    /// Rows, at least 4.
    pub rows: usize,
    /// Columns, at least 4.
    pub columns: usize,
    groups: Vec<Vec<Vec4>>,
}

/// Where a block of points lies between the nodes: the first node and the weights of four, for rows and columns.
#[derive(Debug, Clone)]
pub struct TableCoords {
    /// Index of the first of sixteen nodes.
    pub first: [u32; BLOCK],
    /// Weights of the rows and columns.
    pub weights: [[[f32; BLOCK]; 4]; 2],
}

impl Default for TableCoords {
    fn default() -> Self {
        Self { first: [0; BLOCK], weights: [[[0.0; BLOCK]; 4]; 2] }
    }
}

/// The row coordinate in `[0, 1]` of a fraction `m`.
#[inline(always)]
pub fn row_of(m: f32) -> f32 {
    let rest = 1.0 - m;
    // Above one the place is beyond the table: so it stays.
    let p = 1.0 - (if rest > 0.0 { rest } else { 0.0 }).sqrt() - if rest < 0.0 { rest } else { 0.0 };
    0.5 * p + 0.5 * p * (1.0 + CROWD as f32) / (p + CROWD as f32)
}

/// The fraction at a row coordinate.
pub fn height_fraction(row: f64) -> f64 {
    let b = 0.5 * (1.0 + 2.0 * CROWD) - row;
    let root = (b * b + 2.0 * row * CROWD).sqrt();
    // Of the two forms of the root the one that does not cancel.
    let p = if b > 0.0 { 2.0 * row * CROWD / (b + root) } else { root - b };
    p * (2.0 - p)
}

/// Four-point Lagrange at `x` in `[0, n - 1]` among nodes at the integers.
#[inline(always)]
fn lagrange(x: f32, n: usize) -> (u32, [f32; 4]) {
    const MAGIC: f32 = 12_582_912.0;
    let last = (n - 4) as f32;
    let first = x - 1.5;
    let first = if first > last { last } else { first };
    let first = if first > 0.0 { first } else { 0.0 };
    // The nearest integer: of the four nodes, two lie on each side except at the ends.
    let shifted = first + MAGIC;
    let first = shifted - MAGIC;
    (shifted.to_bits().wrapping_sub(MAGIC.to_bits()), lagrange4(x - first))
}

impl Table {
    /// A table of nothing, never to be looked up.
    pub fn empty() -> Self {
        Self { rows: 0, columns: 0, groups: Vec::new() }
    }

    /// Values of `evaluate(row, c)`, with `row` in `[0, 1]` and `c` in `[-1, 1]`, in `G` groups.
    pub fn build<const G: usize>(
        job: &Job,
        [rows, columns]: [usize; 2],
        evaluate: impl Fn(f64, f64) -> [Vec4; G] + Sync,
    ) -> Result<Self> {
        let lines = job.map(rows, |i| {
            let row = i as f64 / (rows - 1) as f64;
            Ok((0..columns).map(|j| evaluate(row, 2.0 * j as f64 / (columns - 1) as f64 - 1.0)).collect::<Vec<_>>())
        })?;
        let groups = (0..G).map(|g| lines.iter().flatten().map(|node| node[g]).collect()).collect();
        Ok(Self { rows, columns, groups })
    }

    /// The same of a row at once: `evaluate(row, cosines)`.
    pub fn build_rows<const G: usize>(
        job: &Job,
        [rows, columns]: [usize; 2],
        evaluate: impl Fn(f64, &[f64]) -> Vec<[Vec4; G]> + Sync,
    ) -> Result<Self> {
        let cosines: Vec<f64> = (0..columns).map(|j| 2.0 * j as f64 / (columns - 1) as f64 - 1.0).collect();
        let lines = job.map(rows, |i| Ok(evaluate(i as f64 / (rows - 1) as f64, &cosines)))?;
        let groups = (0..G).map(|g| lines.iter().flatten().map(|node| node[g]).collect()).collect();
        Ok(Self { rows, columns, groups })
    }

    /// The table in steps so fine that it may be interpolated linearly.
    pub fn resample(&self, job: &Job, [rows, columns]: [usize; 2]) -> Result<LinearTable> {
        let mut groups = Vec::with_capacity(self.groups.len());
        for group in 0..self.groups.len() {
            let lines = job.map(rows, |i| {
                let row = [i as f32 / (rows - 1) as f32; BLOCK];
                let mut cosines = [0.0; BLOCK];
                let mut coords = TableCoords::default();
                let mut line = Vec::with_capacity(columns);
                for first in (0..columns).step_by(BLOCK) {
                    let count = BLOCK.min(columns - first);
                    for (k, c) in cosines.iter_mut().enumerate() {
                        *c = 2.0 * (first + k).min(columns - 1) as f32 / (columns - 1) as f32 - 1.0;
                    }
                    self.place(&row, &cosines, &mut coords);
                    line.extend((0..count).map(|k| self.at(group, &coords, k)));
                }
                Ok(line)
            })?;
            groups.push(lines.concat());
        }
        Ok(LinearTable { rows, columns, groups })
    }
}

/// A table with linear interpolation.
#[derive(Debug, Clone)]
pub struct LinearTable {
    rows: usize,
    columns: usize,
    groups: Vec<Vec<Vec4>>,
}

/// Interpolation between nodes.
pub trait Lookup {
    /// Where row coordinates and cosines lie.
    fn place(&self, row: &[f32; BLOCK], c: &[f32; BLOCK], out: &mut TableCoords);

    /// The values of a group at the `i`th place.
    fn at(&self, group: usize, coords: &TableCoords, i: usize) -> Vec4;

    /// The values of a group at one point.
    fn value(&self, group: usize, row: f32, c: f32) -> Vec4 {
        let mut coords = TableCoords::default();
        self.place(&[row; BLOCK], &[c; BLOCK], &mut coords);
        self.at(group, &coords, 0)
    }
}

impl Lookup for Table {
    #[inline(always)]
    fn place(&self, row: &[f32; BLOCK], c: &[f32; BLOCK], out: &mut TableCoords) {
        let (high, wide) = ((self.rows - 1) as f32, 0.5 * (self.columns - 1) as f32);
        for i in 0..BLOCK {
            let (a, u) = lagrange(row[i] * high, self.rows);
            let (b, v) = lagrange((c[i] + 1.0) * wide, self.columns);
            out.first[i] = a.wrapping_mul(self.columns as u32).wrapping_add(b);
            for k in 0..4 {
                out.weights[0][k][i] = u[k];
                out.weights[1][k][i] = v[k];
            }
        }
    }

    #[inline(always)]
    fn at(&self, group: usize, coords: &TableCoords, i: usize) -> Vec4 {
        let nodes = &self.groups[group][coords.first[i] as usize..];
        let [u, v] = &coords.weights;
        let mut sum = Vec4::ZERO;
        for a in 0..4 {
            let line = &nodes[a * self.columns..a * self.columns + 4];
            let across = line[0] * v[0][i] + line[1] * v[1][i] + line[2] * v[2][i] + line[3] * v[3][i];
            sum += across * u[a][i];
        }
        sum
    }
}

/// The integer below `x` in `[0, last]`, as bits, and what is above it.
#[inline(always)]
fn below(x: f32, last: f32) -> (u32, f32) {
    const MAGIC: f32 = 12_582_912.0;
    let nearest = (x + MAGIC) - MAGIC;
    let floor = if nearest > x { nearest - 1.0 } else { nearest };
    let floor = if floor < last { floor } else { last };
    ((floor + MAGIC).to_bits().wrapping_sub(MAGIC.to_bits()), x - floor)
}

impl Lookup for LinearTable {
    #[inline(always)]
    fn place(&self, row: &[f32; BLOCK], c: &[f32; BLOCK], out: &mut TableCoords) {
        let (high, wide) = ((self.rows - 1) as f32, 0.5 * (self.columns - 1) as f32);
        let (last_row, last_column) = ((self.rows - 2) as f32, (self.columns - 2) as f32);
        for i in 0..BLOCK {
            let (a, u) = below(row[i] * high, last_row);
            let (b, v) = below((c[i] + 1.0) * wide, last_column);
            out.first[i] = a.wrapping_mul(self.columns as u32).wrapping_add(b);
            out.weights[0][0][i] = u;
            out.weights[1][0][i] = v;
        }
    }

    #[inline(always)]
    fn at(&self, group: usize, coords: &TableCoords, i: usize) -> Vec4 {
        let first = coords.first[i] as usize;
        let nodes = &self.groups[group][first..first + self.columns + 2];
        let (u, v) = (coords.weights[0][0][i], coords.weights[1][0][i]);
        let low = nodes[0] + (nodes[1] - nodes[0]) * v;
        let high = nodes[self.columns] + (nodes[self.columns + 1] - nodes[self.columns]) * v;
        low + (high - low) * u
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_reproduced_to_the_ends() {
        let f = |u: f64, c: f64| (1.0 + u * (2.0 - u * (1.0 - 3.0 * u))) * (0.5 + c * (1.0 + c * (0.3 - c)));
        let table =
            Table::build(&Job::serial(), [7, 9], |u, c| [Vec4::splat(f(u, c) as f32), Vec4::ONE]).expect("built");
        let linear = table.resample(&Job::serial(), [128, 300]).expect("spread");
        for i in 0..=50 {
            for j in 0..=50 {
                let (u, c) = (f64::from(i) / 50.0, f64::from(j) / 25.0 - 1.0);
                let got = f64::from(table.value(0, u as f32, c as f32)[2]);
                assert!((got - f(u, c)).abs() < 4e-6, "({u}, {c}): {got} against {}", f(u, c));
                let linear = f64::from(linear.value(0, u as f32, c as f32)[1]);
                assert!((linear - f(u, c)).abs() < 2e-3, "({u}, {c}): {linear} against {}", f(u, c));
                assert!((table.value(1, u as f32, c as f32)[0] - 1.0).abs() < 1e-6, "a constant at ({u}, {c})");
            }
        }
    }

    #[test]
    fn rows_and_shares_are_inverse() {
        for i in 0..=20 {
            let u = f64::from(i) / 20.0;
            // Near the zenith a cosine has few digits of the angle.
            assert!((f64::from(row_of(height_fraction(u) as f32)) - u).abs() < 1e-4, "at {u}");
        }
    }
}

//! Free-flight sampling by regular tracking, where delta (Woodcock) tracking would need a majorant: distances to the
//! next collision in a heterogeneous medium, with the optical depth known at every point (floor 3).
//!
//! A ray is walked cell by cell; the density along it in a cell is a cubic, integrated exactly by two-point Gauss
//! (density.rs). Where a flight of given depth ends inside a cell follows from the cubic itself, so the density of
//! collisions is exactly `rho exp(-sigma D)` and `D` is known, as reweighting to other extinctions demands. There is no
//! majorant: a dense core costs nothing elsewhere. Cells without density are skipped by their distance to the next one
//! that has any. Arithmetic in `f32`: positions err by 1e-5 of a voxel, depths by 1e-6 of themselves per cell.

use glam::{DVec3, Vec3};

use super::density::Grid;
use crate::error::Result;
use crate::job::Job;

/// A volume prepared for free flights: bricks of four cells along each axis, those with density stored with all their
/// corners, so that a flight stays within a few lines of the cache.
#[derive(Debug)]
pub struct Tracker {
    /// For each brick where its corners begin, or, negative, how many bricks off the nearest one with density is.
    table: Vec<i32>,
    corners: Vec<f32>,
    /// Bricks along each axis.
    bricks: [usize; 3],
    extent: Vec3,
}

/// Cells along a brick.
const SIDE: usize = 4;
/// Corners along a brick.
const EDGE: usize = SIDE + 1;
/// Corners of a brick, to the next line of the cache.
const BRICK: usize = 128;

/// Where a flight ended.
#[derive(Debug, Clone, Copy)]
pub enum End {
    /// At a point (voxel coordinates), after the wanted depth.
    Inside(Vec3),
    /// Outside, after less depth \[m\].
    Left(f32),
}

/// Longest gap that is told apart: a jump of so many bricks is long enough.
const FAR: u8 = 16;

impl Tracker {
    /// Prepare `grid`.
    pub fn new(grid: &Grid, job: &Job) -> Result<Self> {
        let cells = grid.size.map(|n| n + 1);
        let bricks = cells.map(|n| n.div_ceil(SIDE));
        let plane = bricks[0] * bricks[1];
        let layers = job.map(bricks[2], |bz| {
            let mut layer = (vec![FAR; plane], Vec::new());
            let mut block = [0.0; BRICK];
            for b in 0..plane {
                let low = [b % bricks[0] * SIDE, b / bricks[0] * SIDE, bz * SIDE];
                for i in 0..EDGE.pow(3) {
                    let at = [i % EDGE, i / EDGE % EDGE, i / (EDGE * EDGE)];
                    block[i] = grid.corner(std::array::from_fn(|a| (low[a] + at[a]).min(cells[a])));
                }
                if block.iter().any(|&v| v > 0.0) {
                    layer.0[b] = 0;
                    layer.1.extend_from_slice(&block);
                }
            }
            Ok(layer)
        })?;
        let mut gap: Vec<u8> = layers.iter().flat_map(|l| l.0.iter().copied()).collect();
        let mut table = Vec::with_capacity(gap.len());
        let mut corners = Vec::new();
        for (holds, blocks) in layers {
            for empty in holds {
                table.push(if empty == 0 { corners.len() as i32 / BRICK as i32 } else { 0 });
                if empty == 0 {
                    corners.resize(corners.len() + BRICK, 0.0);
                }
            }
            let end = corners.len();
            corners[end - blocks.len()..].copy_from_slice(&blocks);
        }
        for z in 0..bricks[2] {
            for y in 0..bricks[1] {
                spread_distance(&mut gap[z * plane + y * bricks[0]..], 1, bricks[0]);
            }
            for x in 0..bricks[0] {
                spread_distance(&mut gap[z * plane + x..], bricks[0], bricks[1]);
            }
        }
        for x in 0..plane {
            spread_distance(&mut gap[x..], plane, bricks[2]);
        }
        for (entry, &gap) in table.iter_mut().zip(&gap) {
            if gap > 0 {
                *entry = -i32::from(gap);
            }
        }
        let e = grid.extent();
        Ok(Self { table, corners, bricks, extent: e.as_vec3() })
    }

    /// A point in voxel coordinates, single precision.
    pub fn point(&self, p: DVec3) -> Vec3 {
        Vec3::new(p.x as f32, p.y as f32, p.z as f32).clamp(Vec3::ZERO, self.extent)
    }

    /// Fly from `p` along `d` (voxels per metre) until the density-weighted path reaches `depth` \[m\].
    #[inline(always)]
    pub fn fly(&self, p: Vec3, d: Vec3, depth: f32) -> End {
        let inverse = 1.0 / d;
        let forward = d.cmpgt(Vec3::ZERO);
        let still = d.cmpeq(Vec3::ZERO);
        let never = Vec3::INFINITY;
        let delta = Vec3::select(still, never, inverse.abs());
        let exit = Vec3::select(still, never, (Vec3::select(forward, self.extent, Vec3::ZERO) - p) * inverse);
        let leave = exit.min_element();
        let step = Vec3::select(forward, Vec3::ONE, Vec3::NEG_ONE);
        let hop = delta.min_element();
        let (mut t, mut walked) = (0.0_f32, 0.0_f32);
        'place: while t < leave {
            // The cell that holds the point; one on a face belongs to the cell ahead.
            let q = p + d * t + 0.5;
            let mut cell = q.floor();
            cell = Vec3::select(d.cmplt(Vec3::ZERO) & q.cmpeq(cell), cell - 1.0, cell);
            cell = cell.clamp(Vec3::ZERO, self.extent);
            let bound = cell + Vec3::select(forward, Vec3::splat(0.5), Vec3::splat(-0.5));
            let mut next = Vec3::select(still, never, (bound - p) * inverse);
            loop {
                let nearest = next.min_element();
                let end = nearest.min(leave);
                let c = [cell.x as usize, cell.y as usize, cell.z as usize];
                let brick = c.map(|c| c / SIDE);
                let entry = self.table[(brick[2] * self.bricks[1] + brick[1]) * self.bricks[0] + brick[0]];
                if entry >= 0 {
                    if end > t {
                        let at = (c[2] % SIDE * EDGE + c[1] % SIDE) * EDGE + c[0] % SIDE;
                        let corners = gather(&self.corners[entry as usize * BRICK..][..BRICK], at);
                        let from = p - cell + 0.5;
                        let length = end - t;
                        let place = |s: f32| from + d * (t + s * length);
                        let inside = 0.5 * length * pair(&corners, place(GAUSS), place(1.0 - GAUSS));
                        if walked + inside >= depth {
                            let values = [0.0, GAUSS, 1.0 - GAUSS, 1.0].map(|s| along(&corners, place(s)));
                            let fraction = solve((depth - walked) / length, values, inside / length);
                            let at = p + d * (t + fraction * length);
                            return End::Inside(at.clamp(Vec3::ZERO, self.extent));
                        }
                        walked += inside;
                        t = end;
                    }
                } else if entry < -1 {
                    // Nothing in the bricks around: go as far as any axis may take us there.
                    t += hop * ((-entry - 1) as f32 * SIDE as f32);
                    continue 'place;
                } else {
                    t = t.max(end);
                }
                if nearest >= leave {
                    return End::Left(walked);
                }
                let crossed = next.cmple(Vec3::splat(nearest));
                cell = Vec3::select(crossed, cell + step, cell);
                next = Vec3::select(crossed, next + delta, next);
                if cell.cmplt(Vec3::ZERO).any() || cell.cmpgt(self.extent).any() {
                    return End::Left(walked);
                }
            }
        }
        End::Left(walked)
    }
}

/// Least distance along one line of cells, `count` of them `stride` apart.
fn spread_distance(line: &mut [u8], stride: usize, count: usize) {
    // Chebyshev: a cell at distance `a` off this line and `n` steps along it is max(a, n) away. Candidates are the
    // cells within FAR steps, but only those nearer than what is known can win, so the window shrinks to it.
    let old: Vec<u8> = (0..count).map(|i| line[i * stride]).collect();
    for i in 0..count {
        let mut best = old[i];
        let mut n = 1;
        while n < usize::from(best) {
            if i >= n {
                best = best.min(old[i - n].max(n as u8));
            }
            if i + n < count {
                best = best.min(old[i + n].max(n as u8));
            }
            n += 1;
        }
        line[i * stride] = best;
    }
}

/// Node of two-point Gauss-Legendre on `[0, 1]`.
const GAUSS: f32 = 0.211_324_87;

/// The eight corners of the cell that begins at `at`, x fastest.
#[inline(always)]
fn gather(brick: &[f32], at: usize) -> [f32; 8] {
    let pair = |o: usize| {
        let o = (at + o).min(BRICK - 2);
        [brick[o], brick[o + 1]]
    };
    let (a, b, c, d) = (pair(0), pair(EDGE), pair(EDGE * EDGE), pair(EDGE * EDGE + EDGE));
    [a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]]
}

/// Sum of the densities at two points of a cell.
#[inline(always)]
fn pair(v: &[f32; 8], f: Vec3, g: Vec3) -> f32 {
    const BASE: [[f32; 8]; 3] = [
        [1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0],
        [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    ];
    let mut sum = [0.0; 8];
    for i in 0..8 {
        let weight = |f: Vec3| {
            let one = |base: f32, x: f32| base + (1.0 - 2.0 * base) * x;
            one(BASE[0][i], f.x) * one(BASE[1][i], f.y) * one(BASE[2][i], f.z)
        };
        sum[i] = v[i] * (weight(f) + weight(g));
    }
    ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]))
}

#[inline(always)]
fn along(v: &[f32; 8], f: Vec3) -> f32 {
    let x = |a: f32, b: f32| a + (b - a) * f.x;
    let (y0, y1) = (x(v[0], v[1]), x(v[2], v[3]));
    let (y2, y3) = (x(v[4], v[5]), x(v[6], v[7]));
    let (z0, z1) = (y0 + (y1 - y0) * f.y, y2 + (y3 - y2) * f.y);
    z0 + (z1 - z0) * f.z
}

/// Where in `[0, 1]` the integral of the cubic through `values` at 0, the two Gauss nodes and 1 reaches `wanted`, of
/// `whole` altogether.
#[inline(always)]
fn solve(wanted: f32, values: [f32; 4], whole: f32) -> f32 {
    // In u = 2 s - 1: r(u) = a + b u + c u^2 + e u^3 with nodes at -1, -1/sqrt 3, 1/sqrt 3, 1.
    const ROOT: f32 = 0.577_350_26;
    let [v0, v1, v2, v3] = values;
    let (even, odd) = (0.5 * (v0 + v3), 0.5 * (v3 - v0));
    let (even_in, odd_in) = (0.5 * (v1 + v2), 0.5 * (v2 - v1) / ROOT);
    let c = 1.5 * (even - even_in);
    let a = even - c;
    let e = 1.5 * (odd - odd_in);
    let b = odd - e;
    let integral = |s: f32| {
        // From -1 to u, halved: in units of s. (u^n + 1) / n with u = 2 s - 1 stays a polynomial in s.
        let u = 2.0 * s - 1.0;
        let v = u * u;
        s * a + 0.25 * (v - 1.0) * b + (v * u + 1.0) * c * (1.0 / 6.0) + 0.125 * (v * v - 1.0) * e
    };
    let density = |s: f32| {
        let u = 2.0 * s - 1.0;
        a + u * (b + u * (c + u * e))
    };
    let (mut low, mut high) = (0.0_f32, 1.0_f32);
    let mut s = (wanted / whole).clamp(0.0, 1.0);
    for _ in 0..4 {
        let miss = integral(s) - wanted;
        if miss > 0.0 {
            high = s;
        } else {
            low = s;
        }
        let slope = density(s);
        let newton = s - miss / slope;
        s = if slope > 0.0 && newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn blobs() -> Grid {
        let s = Stream::new(5, 1);
        let size = [23, 17, 31];
        let n: usize = size.iter().product();
        let data: Vec<f32> = (0..n)
            .map(|i| {
                let (x, y, z) = (i % 23, i / 23 % 17, i / 391);
                let far = (x as f32 - 6.0).powi(2) + (y as f32 - 8.0).powi(2) + (z as f32 - 22.0).powi(2) > 30.0;
                if far && z > 3 { 0.0 } else { s.uniform(i as u64) as f32 }
            })
            .collect();
        Grid::new(&data, size, DVec3::new(2.0, 3.0, 5.0), DVec3::ZERO).expect("valid")
    }

    #[test]
    fn a_flight_agrees_with_the_exact_integral() {
        let grid = blobs();
        let tracker = Tracker::new(&grid, &Job::serial()).expect("runs");
        let s = Stream::new(2, 2);
        let (mut ended, mut left) = (0, 0);
        for ray in 0..3000_u64 {
            let u = |k: u64| s.uniform(ray * 8 + k);
            let p = grid.extent() * DVec3::new(u(0), u(1), u(2));
            let mut w = DVec3::new(u(3) - 0.5, u(4) - 0.5, u(5) - 0.5).normalize();
            if ray % 7 == 0 {
                w = [DVec3::X, DVec3::NEG_Y, DVec3::Z][(ray / 7 % 3) as usize];
            }
            let d = w / grid.voxel;
            let start = tracker.point(p);
            let along = Vec3::new(d.x as f32, d.y as f32, d.z as f32);
            let wanted = (30.0 * u(6) * u(6)) as f32;
            let exact_start = start.as_dvec3();
            match tracker.fly(start, along, wanted) {
                End::Inside(x) => {
                    ended += 1;
                    let t = (x.as_dvec3() - exact_start).length() / d.length();
                    let depth = grid.integral(exact_start, along.as_dvec3(), t);
                    assert!((depth - f64::from(wanted)).abs() < 2e-3, "ray {ray}: {depth} for {wanted}");
                }
                End::Left(walked) => {
                    left += 1;
                    let depth = grid.integral(exact_start, along.as_dvec3(), f64::INFINITY);
                    let close = (depth - f64::from(walked)).abs() < 1e-4 * (1.0 + depth);
                    assert!(close && walked <= wanted, "ray {ray}: walked {walked} of {depth}");
                }
            }
        }
        assert!(ended > 400 && left > 400, "both ends are tried: {ended}, {left}");
    }

    #[test]
    fn gaps_are_chebyshev_distances() {
        let grid = blobs();
        let tracker = Tracker::new(&grid, &Job::serial()).expect("runs");
        let cells = tracker.bricks;
        let at = |i: usize| [i % cells[0], i / cells[0] % cells[1], i / (cells[0] * cells[1])].map(|x| x as i64);
        let holds = |b: [i64; 3]| {
            let cell = |i: usize| [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
            (0..SIDE.pow(3)).any(|i| {
                let c: [usize; 3] = std::array::from_fn(|a| b[a] as usize * SIDE + cell(i)[a]);
                (0..3).all(|a| c[a] <= grid.size[a]) && grid.cell(c).iter().any(|&v| v > 0.0)
            })
        };
        let full: Vec<[i64; 3]> = (0..tracker.table.len()).map(at).filter(|&b| holds(b)).collect();
        for (i, &entry) in tracker.table.iter().enumerate() {
            let far = |h: &[i64; 3]| (0..3).map(|a| (h[a] - at(i)[a]).abs()).max().unwrap_or(0);
            let least = full.iter().map(far).min().unwrap_or(i64::MAX).min(16);
            assert_eq!(i64::from(-entry.min(0)), least, "brick {:?}", at(i));
        }
    }

    #[test]
    fn the_point_inside_a_cell_solves_its_cubic() {
        let cubic = |s: f64| 1.0 + 2.0 * s - 5.0 * s * s + 3.0 * s.powi(3);
        let integral = |s: f64| s + s * s - 5.0 / 3.0 * s.powi(3) + 0.75 * s.powi(4);
        let g = f64::from(GAUSS);
        let values = [0.0, g, 1.0 - g, 1.0].map(|s| cubic(s) as f32);
        for i in 0..=20 {
            let s = f64::from(i) / 20.0;
            let got = solve(integral(s) as f32, values, integral(1.0) as f32);
            assert!((f64::from(got) - s).abs() < 2e-3, "{s}: {got}");
            assert!((integral(f64::from(got)) - integral(s)).abs() < 1e-6, "{s}: {got}");
        }
    }
}

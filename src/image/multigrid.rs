//! Multigrid for the graph Laplacian of a set of pixels (floor 1), the engine of [`laplace`](super::laplace).
//!
//! Only unknown pixels are nodes. A level is a weighted graph with at most four neighbours a node; the nodes of one
//! colour of the chessboard stand in one array and have all their neighbours in the other, so a Gauss-Seidel half
//! sweep is one pass with nothing to wait for, in any order and on any number of threads, with the same bits. Each
//! level aggregates 2 × 2 pixels of the one before (piecewise constant, Galerkin: weights are sums), which keeps the
//! graph five-point and needs no special case for bridges, islands or borders. Piecewise constants overestimate the
//! energy of smooth corrections about twofold: they are enlarged 1.8 times (over-correction; 1.5 to 2.0 hardly differ).
//!
//! Vectors hold up to four channels of a node side by side: one gather serves all of them.

use crate::error::Result;
use crate::job::Job;
use crate::math::lanes;

/// Up to four channels of one node.
pub type Node = [f32; 4];

const OVER: f32 = 1.8;
/// Nodes of one band: about 0.1 ms.
const BAND: usize = 1 << 13;
/// Conjugate-gradient steps of one f32 solve: beyond these rounding has eaten what they could gain.
const STEPS: usize = 60;

/// A vector over the nodes of a level: red, then black, each with one zero behind its end, which absent neighbours
/// point to.
#[derive(Debug, Clone)]
pub struct Pair([Vec<Node>; 2]);

impl Pair {
    fn zeros(level: &Level) -> Self {
        Self([0, 1].map(|k| vec![[0.0; 4]; level.len(k) + 1]))
    }

    /// From values without the trailing zeros.
    pub fn from_nodes(mut nodes: [Vec<Node>; 2]) -> Self {
        for side in &mut nodes {
            side.push([0.0; 4]);
        }
        Self(nodes)
    }

    /// The nodes of one colour.
    pub fn nodes(&self, colour: usize) -> &[Node] {
        &self.0[colour][..self.0[colour].len() - 1]
    }

    fn nodes_mut(&mut self, colour: usize) -> &mut [Node] {
        let n = self.0[colour].len() - 1;
        &mut self.0[colour][..n]
    }

    /// Largest magnitude of all.
    pub fn largest(&self) -> f32 {
        let all = self.0.iter().flatten().flatten();
        all.fold(0.0, |m, x| if x.abs() > m { x.abs() } else { m })
    }
}

/// One side of a level: the nodes of one colour.
#[derive(Debug, Clone, Default)]
struct Side {
    /// West, east, north, south among the other colour.
    near: Vec<[u32; 4]>,
    /// Weights of these; empty where all are 1.
    weight: Vec<Node>,
    diagonal: Vec<f32>,
    inverse: Vec<f32>,
    /// Coarse node above each, `2 * index + colour`.
    parent: Vec<u32>,
    /// The two red nodes (of the level below) of each aggregate.
    red_children: Vec<[u32; 2]>,
    /// The two black ones.
    black_children: Vec<[u32; 2]>,
}

#[derive(Debug, Clone)]
struct Level([Side; 2]);

impl Level {
    fn len(&self, colour: usize) -> usize {
        self.0[colour].diagonal.len()
    }
}

/// Weights on a full grid, from which a level is made.
struct Grid {
    w: usize,
    h: usize,
    present: Vec<bool>,
    east: Vec<f32>,
    south: Vec<f32>,
    known: Vec<f32>,
}

impl Grid {
    fn finest(mask: &[bool], w: usize, h: usize) -> Self {
        let present = mask.to_vec();
        let (mut east, mut south, mut known) = (vec![0.0; w * h], vec![0.0; w * h], vec![0.0; w * h]);
        let mut link = |i: usize, j: usize, edge: &mut f32| match (mask[i], mask[j]) {
            (true, true) => *edge = 1.0,
            (true, false) => known[i] += 1.0,
            (false, true) => known[j] += 1.0,
            (false, false) => {}
        };
        for y in 0..h {
            for x in 0..w {
                let i = y * w + x;
                if x + 1 < w {
                    link(i, i + 1, &mut east[i]);
                }
                if y + 1 < h {
                    link(i, i + w, &mut south[i]);
                }
            }
        }
        Self { w, h, present, east, south, known }
    }

    fn coarser(&self) -> Self {
        let (w, h) = (self.w.div_ceil(2), self.h.div_ceil(2));
        let mut present = vec![false; w * h];
        let (mut east, mut south, mut known) = (vec![0.0; w * h], vec![0.0; w * h], vec![0.0; w * h]);
        for y in 0..self.h {
            for x in 0..self.w {
                let (i, j) = (y * self.w + x, (y / 2) * w + x / 2);
                if self.present[i] {
                    present[j] = true;
                    known[j] += self.known[i];
                    // Edges within an aggregate vanish.
                    if x % 2 == 1 {
                        east[j] += self.east[i];
                    }
                    if y % 2 == 1 {
                        south[j] += self.south[i];
                    }
                }
            }
        }
        Self { w, h, present, east, south, known }
    }

    /// Number the nodes colour by colour, row by row.
    fn numbers(&self) -> (Vec<u32>, [Vec<u32>; 2]) {
        let mut number = vec![u32::MAX; self.w * self.h];
        let mut pixels = [Vec::new(), Vec::new()];
        for y in 0..self.h {
            for x in 0..self.w {
                let i = y * self.w + x;
                if self.present[i] {
                    let side = &mut pixels[(x + y) % 2];
                    number[i] = side.len() as u32;
                    side.push(i as u32);
                }
            }
        }
        (number, pixels)
    }

    fn level(&self, number: &[u32], pixels: &[Vec<u32>; 2], unit: bool) -> Level {
        let w = self.w;
        Level([0, 1].map(|colour| {
            let none = pixels[1 - colour].len() as u32;
            let mut side = Side::default();
            for &i in &pixels[colour] {
                let i = i as usize;
                let (x, y) = (i % w, i / w);
                let weight = [
                    if x > 0 { self.east[i - 1] } else { 0.0 },
                    self.east[i],
                    if y > 0 { self.south[i - w] } else { 0.0 },
                    self.south[i],
                ];
                let at = |k: usize, j: usize| if weight[k] > 0.0 { number[j] } else { none };
                side.near.push([at(0, i.wrapping_sub(1)), at(1, i + 1), at(2, i.wrapping_sub(w)), at(3, i + w)]);
                let diagonal = weight.iter().sum::<f32>() + self.known[i];
                side.diagonal.push(diagonal);
                side.inverse.push(1.0 / diagonal);
                if !unit {
                    side.weight.push(weight);
                }
            }
            side
        }))
    }
}

/// The levels, finest first.
#[derive(Debug, Clone)]
pub struct Hierarchy {
    levels: Vec<Level>,
    /// Pixel of each unknown, red and black.
    pub pixels: [Vec<u32>; 2],
}

impl Hierarchy {
    /// Build all levels over the masked pixels of a `w` × `h` picture, at least one of which is not masked.
    pub fn new(job: &Job, mask: &[bool], w: usize, h: usize) -> Result<Self> {
        let mut grid = Grid::finest(mask, w, h);
        let (mut number, pixels) = grid.numbers();
        let mut levels = vec![grid.level(&number, &pixels, true)];
        let mut here = pixels.clone();
        while here[0].len() + here[1].len() > 1 && (grid.w > 1 || grid.h > 1) {
            job.check()?;
            let coarse = grid.coarser();
            let (coarse_number, coarse_pixels) = coarse.numbers();
            let mut level = coarse.level(&coarse_number, &coarse_pixels, false);
            let parent_of = |i: u32| {
                let (x, y) = (i as usize % grid.w / 2, i as usize / grid.w / 2);
                2 * coarse_number[y * coarse.w + x] + ((x + y) % 2) as u32
            };
            if let Some(fine) = levels.last_mut() {
                for colour in 0..2 {
                    fine.0[colour].parent = here[colour].iter().map(|&i| parent_of(i)).collect();
                }
            }
            for colour in 0..2 {
                let side = &mut level.0[colour];
                for &j in &coarse_pixels[colour] {
                    let (x, y) = (2 * (j as usize % coarse.w), 2 * (j as usize / coarse.w));
                    let child = |dx: usize, dy: usize, none: usize| {
                        let inside = x + dx < grid.w && y + dy < grid.h;
                        let n = if inside { number[(y + dy) * grid.w + x + dx] } else { u32::MAX };
                        if n == u32::MAX { none as u32 } else { n }
                    };
                    let (red, black) = (here[0].len(), here[1].len());
                    side.red_children.push([child(0, 0, red), child(1, 1, red)]);
                    side.black_children.push([child(1, 0, black), child(0, 1, black)]);
                }
            }
            levels.push(level);
            (grid, number, here) = (coarse, coarse_number, coarse_pixels);
        }
        Ok(Self { levels, pixels })
    }

    /// `b - A x` in f64 on the finest level.
    pub fn defect(&self, job: &Job, b: &[Vec<[f64; 4]>; 2], x: &[Vec<[f64; 4]>; 2]) -> Result<[Vec<[f64; 4]>; 2]> {
        let mut out = [0, 1].map(|k| vec![[0.0; 4]; x[k].len()]);
        for colour in 0..2 {
            let (side, other) = (&self.levels[0].0[colour], &x[1 - colour]);
            job.bands(&mut out[colour], BAND, |band, out| {
                let start = band * BAND;
                for (k, o) in out.iter_mut().enumerate() {
                    let i = start + k;
                    let mut sum = b[colour][i];
                    for &n in &side.near[i] {
                        if let Some(v) = other.get(n as usize) {
                            for c in 0..4 {
                                sum[c] += v[c];
                            }
                        }
                    }
                    for c in 0..4 {
                        o[c] = sum[c] - f64::from(side.diagonal[i]) * x[colour][i][c];
                    }
                }
                Ok(())
            })?;
        }
        Ok(out)
    }
}

/// All channels of a node. (`array::map` is not inlined into the multiversioned kernels.)
#[inline(always)]
fn four(each: impl Fn(usize) -> f32) -> Node {
    [each(0), each(1), each(2), each(3)]
}

/// Sum of the weighted neighbours of node `i`.
#[inline(always)]
fn around(side: &Side, i: usize, other: &[Node]) -> Node {
    let near = side.near[i];
    let v = [other[near[0] as usize], other[near[1] as usize], other[near[2] as usize], other[near[3] as usize]];
    let mut sum = [0.0; 4];
    if side.weight.is_empty() {
        for c in 0..4 {
            sum[c] = (v[0][c] + v[1][c]) + (v[2][c] + v[3][c]);
        }
    } else {
        let w = side.weight[i];
        for c in 0..4 {
            sum[c] = (v[0][c] * w[0] + v[1][c] * w[1]) + (v[2][c] * w[2] + v[3][c] * w[3]);
        }
    }
    sum
}

/// Write `each(i)` into every node of `out`, in bands.
#[inline(always)]
fn sweep(job: &Job, out: &mut [Node], each: impl Fn(usize, &Node) -> Node + Sync) -> Result<()> {
    job.bands(out, BAND, |band, out| {
        let start = band * BAND;
        lanes::run(
            #[inline(always)]
            || {
                for (k, o) in out.iter_mut().enumerate() {
                    *o = each(start + k, o);
                }
            },
        );
        Ok(())
    })
}

/// Gauss-Seidel on one colour: `z = (b + sum of neighbours) / diagonal`.
fn relax(job: &Job, level: &Level, b: &Pair, z: &mut Pair, colour: usize) -> Result<()> {
    let side = &level.0[colour];
    let [red, black] = &mut z.0;
    let (mine, other) = if colour == 0 { (red, &*black) } else { (black, &*red) };
    let n = mine.len() - 1;
    let b = &b.0[colour];
    sweep(
        job,
        &mut mine[..n],
        #[inline(always)]
        |i, _| {
            let (sum, inverse, b) = (around(side, i, other), side.inverse[i], b[i]);
            four(|c| (b[c] + sum[c]) * inverse)
        },
    )
}

/// Sum of `a[c] * b[c]` over all nodes, in f64, in an order that does not depend on threads, and the largest `|a[c]|`.
fn dot(job: &Job, a: &Pair, b: &Pair) -> Result<([f64; 4], Node)> {
    let (mut total, mut most) = ([0.0; 4], [0.0_f32; 4]);
    for colour in 0..2 {
        let (a, b) = (a.nodes(colour), b.nodes(colour));
        let parts = job.map(a.len().div_ceil(BAND), |band| {
            let range = band * BAND..((band + 1) * BAND).min(a.len());
            Ok(lanes::run(
                #[inline(always)]
                || {
                    let (mut sum, mut most) = ([0.0_f64; 4], [0.0_f32; 4]);
                    for (a, b) in a[range.clone()].iter().zip(&b[range.clone()]) {
                        for c in 0..4 {
                            sum[c] += f64::from(a[c]) * f64::from(b[c]);
                            most[c] = if a[c].abs() > most[c] { a[c].abs() } else { most[c] };
                        }
                    }
                    (sum, most)
                },
            ))
        })?;
        for (sum, high) in parts {
            for c in 0..4 {
                total[c] += sum[c];
                most[c] = if high[c] > most[c] { high[c] } else { most[c] };
            }
        }
    }
    Ok((total, most))
}

/// Work vectors of one hierarchy.
#[derive(Debug)]
pub struct Solver<'a> {
    levels: &'a [Level],
    /// Right-hand side, solution and residual (red only) of each level.
    work: Vec<(Pair, Pair, Pair)>,
}

impl<'a> Solver<'a> {
    /// Work vectors for `hierarchy`.
    pub fn new(hierarchy: &'a Hierarchy) -> Self {
        let work = hierarchy.levels.iter().map(|l| (Pair::zeros(l), Pair::zeros(l), Pair::zeros(l))).collect();
        Self { levels: &hierarchy.levels, work }
    }

    /// A first solution: the right-hand side summed up to the coarsest level, solved there, and carried down with two
    /// sweeps on each level.
    pub fn guess(&mut self, job: &Job, b: Pair) -> Result<Pair> {
        self.work[0].0 = b;
        for l in 1..self.levels.len() {
            let (fine, coarse) = self.work.split_at_mut(l);
            let (b, target) = (&fine[l - 1].0, &mut coarse[0].0);
            for colour in 0..2 {
                let side = &self.levels[l].0[colour];
                sweep(
                    job,
                    target.nodes_mut(colour),
                    #[inline(always)]
                    |i, _| {
                        let ([r0, r1], [b0, b1]) = (side.red_children[i], side.black_children[i]);
                        let (red, black) = (&b.0[0], &b.0[1]);
                        let v = (red[r0 as usize], red[r1 as usize], black[b0 as usize], black[b1 as usize]);
                        four(|c| (v.0[c] + v.1[c]) + (v.2[c] + v.3[c]))
                    },
                )?;
            }
        }
        for l in (0..self.levels.len()).rev() {
            if l + 1 < self.levels.len() {
                let (fine, coarse) = self.work.split_at_mut(l + 1);
                let (z, above) = (&mut fine[l].1, &coarse[0].1);
                for colour in 0..2 {
                    let parent = &self.levels[l].0[colour].parent;
                    sweep(
                        job,
                        z.nodes_mut(colour),
                        #[inline(always)]
                        |i, _| above.0[(parent[i] & 1) as usize][(parent[i] >> 1) as usize],
                    )?;
                }
            }
            let (b, z, _) = &mut self.work[l];
            for colour in [0, 1, 0, 1] {
                relax(job, &self.levels[l], b, z, colour)?;
            }
        }
        Ok(self.work[0].1.clone())
    }

    /// One V(1,1) cycle from zero at level `l`: `work[l].1 = M work[l].0`.
    fn cycle(&mut self, job: &Job, l: usize) -> Result<()> {
        let level = &self.levels[l];
        let last = l + 1 == self.levels.len();
        {
            let (b, z, residual) = &mut self.work[l];
            // First red sweep from zero, then black.
            let (inverse, red) = (&level.0[0].inverse, &b.0[0]);
            sweep(
                job,
                z.nodes_mut(0),
                #[inline(always)]
                |i, _| four(|c| red[i][c] * inverse[i]),
            )?;
            relax(job, level, b, z, 1)?;
            if last {
                // One node, or two without a coarser level: a few more sweeps are exact enough.
                return relax(job, level, b, z, 0);
            }
            // After the black sweep only red nodes have a residual: what their black neighbours have brought.
            let (side, other) = (&level.0[0], &z.0[1]);
            sweep(
                job,
                residual.nodes_mut(0),
                #[inline(always)]
                |i, _| around(side, i, other),
            )?;
        }
        {
            let (fine, coarse) = self.work.split_at_mut(l + 1);
            let (residual, target) = (&fine[l].2.0[0], &mut coarse[0].0);
            for colour in 0..2 {
                let side = &self.levels[l + 1].0[colour];
                sweep(
                    job,
                    target.nodes_mut(colour),
                    #[inline(always)]
                    |i, _| {
                        let [p, q] = side.red_children[i];
                        let (p, q) = (residual[p as usize], residual[q as usize]);
                        four(|c| p[c] + q[c])
                    },
                )?;
            }
        }
        self.cycle(job, l + 1)?;
        {
            // The black nodes are overwritten by the next sweep: only red ones need the correction.
            let (fine, coarse) = self.work.split_at_mut(l + 1);
            let (z, above) = (&mut fine[l].1, &coarse[0].1);
            let parent = &level.0[0].parent;
            sweep(
                job,
                z.nodes_mut(0),
                #[inline(always)]
                |i, z| {
                    let e = above.0[(parent[i] & 1) as usize][(parent[i] >> 1) as usize];
                    four(|c| z[c] + OVER * e[c])
                },
            )?;
        }
        let (b, z, _) = &mut self.work[l];
        relax(job, level, b, z, 1)?;
        relax(job, level, b, z, 0)
    }

    /// Solve `A e = r` by preconditioned conjugate gradients from zero, each channel with its own step lengths, until
    /// a step changes no node by more than `tolerance`.
    pub fn solve(&mut self, job: &Job, r: Pair, tolerance: f64) -> Result<Pair> {
        let level = &self.levels[0];
        let mut e = Pair::zeros(level);
        let (mut p, mut q) = (Pair::zeros(level), Pair::zeros(level));
        let mut before = [0.0_f64; 4];
        self.work[0].0 = r;
        for _ in 0..STEPS {
            job.check()?;
            self.cycle(job, 0)?;
            let (r, z, _) = &mut self.work[0];
            let (now, _) = dot(job, r, z)?;
            let beta = four(|c| if before[c] > 0.0 { (now[c] / before[c]) as f32 } else { 0.0 });
            before = now;
            for colour in 0..2 {
                let z_mine = &z.0[colour];
                sweep(
                    job,
                    p.nodes_mut(colour),
                    #[inline(always)]
                    |i, p| four(|c| z_mine[i][c] + beta[c] * p[c]),
                )?;
            }
            // A z without a product on red: the last sweep has just made it r there.
            let (red, r_red) = (&z.0[0], &r.0[0]);
            sweep(
                job,
                q.nodes_mut(0),
                #[inline(always)]
                |i, q| four(|c| r_red[i][c] + beta[c] * q[c]),
            )?;
            let (side, black) = (&level.0[1], &z.0[1]);
            sweep(
                job,
                q.nodes_mut(1),
                #[inline(always)]
                |i, q| {
                    let (sum, d) = (around(side, i, red), side.diagonal[i]);
                    four(|c| (black[i][c] * d - sum[c]) + beta[c] * q[c])
                },
            )?;
            let (curvature, most) = dot(job, &p, &q)?;
            let alpha = four(|c| {
                let a = now[c] / curvature[c];
                // A channel that is solved exactly has 0 / 0.
                if curvature[c] > 0.0 && a.is_finite() { a as f32 } else { 0.0 }
            });
            for colour in 0..2 {
                let (p, q) = (&p.0[colour], &q.0[colour]);
                sweep(
                    job,
                    e.nodes_mut(colour),
                    #[inline(always)]
                    |i, e| four(|c| e[c] + alpha[c] * p[i][c]),
                )?;
                sweep(
                    job,
                    r.nodes_mut(colour),
                    #[inline(always)]
                    |i, r| four(|c| r[c] - alpha[c] * q[i][c]),
                )?;
            }
            let step = (0..4).fold(0.0, |m, c| f64::from(alpha[c] * most[c]).max(m));
            if step <= tolerance {
                break;
            }
        }
        Ok(e)
    }
}

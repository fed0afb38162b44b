//! Conjugate gradients with a multigrid cycle (floor 1), the engine of [`laplace`](super::laplace).
//!
//! One V(1,1) cycle of red-black Gauss-Seidel over the levels of a [`Hierarchy`] preconditions the iteration; it is
//! symmetric (red, black; black, red), as conjugate gradients need. Piecewise constants overestimate the energy of
//! smooth corrections about twofold, so these are enlarged 1.8 times (over-correction; 1.5 to 2.0 hardly differ). An
//! iteration about halves the error. Everything is f32 but the scalar products, which are summed in f64 in a fixed
//! order.

use super::multigrid::{CHUNK, Hierarchy, Level, Node, Pair, Side};
use crate::error::Result;
use crate::job::Job;
use crate::math::lanes;

const OVER: f32 = 1.8;
/// Conjugate-gradient steps of one f32 solve: beyond these rounding has eaten what they could gain.
const STEPS: usize = 60;

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

/// Write `each(i)` into every node of `out`, in chunks.
#[inline(always)]
fn sweep(job: &Job, out: &mut [Node], each: impl Fn(usize, &Node) -> Node + Sync) -> Result<()> {
    job.chunks(out, CHUNK, |chunk, out| {
        let start = chunk * CHUNK;
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
        let parts = job.map(a.len().div_ceil(CHUNK), |chunk| {
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(a.len());
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
    /// Right-hand side, solution and, of red nodes, residual of each level.
    work: Vec<(Pair, Pair, Vec<Node>)>,
}

impl<'a> Solver<'a> {
    /// Work vectors for `hierarchy`.
    pub fn new(hierarchy: &'a Hierarchy) -> Self {
        let work =
            hierarchy.levels.iter().map(|l| (Pair::zeros(l), Pair::zeros(l), vec![[0.0; 4]; l.len(0) + 1])).collect();
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
            let red = residual.len() - 1;
            sweep(
                job,
                &mut residual[..red],
                #[inline(always)]
                |i, _| around(side, i, other),
            )?;
        }
        {
            let (fine, coarse) = self.work.split_at_mut(l + 1);
            let (residual, target) = (&fine[l].2, &mut coarse[0].0);
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

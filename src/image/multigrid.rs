//! Multigrid for the graph Laplacian of a set of pixels (floor 1), for [`laplace`](super::laplace);
//! [`gradients`](super::gradients) solves on it.
//!
//! Only unknown pixels are nodes. A level is a weighted graph with at most four neighbours a node; the nodes of one
//! colour of the chessboard stand in one array and have all their neighbours in the other, so a Gauss-Seidel half
//! sweep is one pass with nothing to wait for, in any order and on any number of threads, with the same bits. Each
//! level aggregates 2 × 2 pixels of the one before (piecewise constant, Galerkin: weights are sums), which keeps the
//! graph five-point and needs no special case for bridges, islands or borders.
//!
//! Vectors hold up to four channels of a node side by side: one gather serves all of them.

use crate::error::Result;
use crate::job::Job;

/// Up to four channels of one node.
pub type Node = [f32; 4];

/// Nodes of one chunk: about 0.1 ms.
pub(super) const CHUNK: usize = 1 << 13;

/// A vector over the nodes of a level: red, then black, each with one zero behind its end, which absent neighbours
/// point to.
#[derive(Debug, Clone)]
pub struct Pair(pub(super) [Vec<Node>; 2]);

impl Pair {
    pub(super) fn zeros(level: &Level) -> Self {
        Self([0, 1].map(|k| vec![[0.0; 4]; level.len(k) + 1]))
    }

    /// The nodes of one colour.
    pub fn nodes(&self, colour: usize) -> &[Node] {
        &self.0[colour][..self.0[colour].len() - 1]
    }

    pub(super) fn nodes_mut(&mut self, colour: usize) -> &mut [Node] {
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
pub(super) struct Side {
    /// West, east, north, south among the other colour.
    pub(super) near: Vec<[u32; 4]>,
    /// Weights of these; empty where all are 1.
    pub(super) weight: Vec<Node>,
    pub(super) diagonal: Vec<f32>,
    pub(super) inverse: Vec<f32>,
    /// Coarse node above each, `2 * index + colour`.
    pub(super) parent: Vec<u32>,
    /// The two red nodes (of the level below) of each aggregate.
    pub(super) red_children: Vec<[u32; 2]>,
    /// The two black ones.
    pub(super) black_children: Vec<[u32; 2]>,
}

#[derive(Debug, Clone)]
pub(super) struct Level(pub(super) [Side; 2]);

impl Level {
    pub(super) fn len(&self, colour: usize) -> usize {
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
        let hole: Vec<f32> = mask.iter().map(|&m| f32::from(u8::from(m))).collect();
        let (mut east, mut south, mut known) = (vec![0.0; w * h], vec![0.0; w * h], vec![0.0; w * h]);
        // Beyond the border there is neither an edge nor a known neighbour.
        let border = vec![1.0; w];
        for y in 0..h {
            let row = y * w..(y + 1) * w;
            let here = &hole[row.clone()];
            let above = if y > 0 { &hole[row.start - w..row.start] } else { &border[..] };
            let below = if y + 1 < h { &hole[row.end..row.end + w] } else { &border[..] };
            let (east, south, known) = (&mut east[row.clone()], &mut south[row.clone()], &mut known[row]);
            for x in 0..w {
                south[x] = if y + 1 < h { here[x] * below[x] } else { 0.0 };
                known[x] = here[x] * (2.0 - above[x] - below[x]);
            }
            for x in 1..w {
                east[x - 1] = here[x - 1] * here[x];
                known[x] += here[x] * (1.0 - here[x - 1]);
            }
            for x in 1..w {
                known[x - 1] += here[x - 1] * (1.0 - here[x]);
            }
        }
        Self { w, h, present: mask.to_vec(), east, south, known }
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
            let count = pixels[colour].len();
            let mut side = Side {
                near: Vec::with_capacity(count),
                weight: Vec::with_capacity(if unit { 0 } else { count }),
                diagonal: Vec::with_capacity(count),
                inverse: Vec::with_capacity(count),
                ..Side::default()
            };
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

/// Sums of known neighbours at the unknowns that have any, of one colour: few beside a hole's inside.
#[derive(Debug, Default)]
pub struct Boundary {
    at: Vec<u32>,
    sums: Vec<[f64; 4]>,
}

impl Boundary {
    /// Those of a further unknown, in rising order.
    pub fn push(&mut self, unknown: usize, sum: [f64; 4]) {
        self.at.push(unknown as u32);
        self.sums.push(sum);
    }
}

/// The levels, finest first.
#[derive(Debug, Clone)]
pub struct Hierarchy {
    pub(super) levels: Vec<Level>,
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

    /// What the boundary gives, at every unknown.
    pub fn boundary(&self, sides: &[Boundary; 2]) -> Pair {
        let mut out = Pair::zeros(&self.levels[0]);
        for (nodes, side) in out.0.iter_mut().zip(sides) {
            for (&i, sum) in side.at.iter().zip(&side.sums) {
                nodes[i as usize] = sum.map(|x| x as f32);
            }
        }
        out
    }

    /// `b - A x` on the finest level, in f64 and rounded once.
    pub fn defect(&self, job: &Job, b: &[Boundary; 2], x: &[Vec<[f64; 4]>; 2]) -> Result<Pair> {
        let mut out = Pair::zeros(&self.levels[0]);
        for colour in 0..2 {
            let (side, other, b) = (&self.levels[0].0[colour], &x[1 - colour], &b[colour]);
            job.chunks(out.nodes_mut(colour), CHUNK, |chunk, out| {
                let start = chunk * CHUNK;
                let mut next = b.at.partition_point(|&i| (i as usize) < start);
                for (k, o) in out.iter_mut().enumerate() {
                    let i = start + k;
                    let mut sum = [0.0; 4];
                    if b.at.get(next) == Some(&(i as u32)) {
                        sum = b.sums[next];
                        next += 1;
                    }
                    for &n in &side.near[i] {
                        if let Some(v) = other.get(n as usize) {
                            for c in 0..4 {
                                sum[c] += v[c];
                            }
                        }
                    }
                    for c in 0..4 {
                        o[c] = (sum[c] - f64::from(side.diagonal[i]) * x[colour][i][c]) as f32;
                    }
                }
                Ok(())
            })?;
        }
        Ok(out)
    }
}

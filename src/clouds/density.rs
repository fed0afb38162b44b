//! A voxel volume of cloud density, a heterogeneous participating medium, and its exact line integrals (optical depth).
//!
//! Density is given at texel centres `(i + 0.5) * voxel` and interpolated trilinearly; beyond the outermost centres it
//! is constant up to the box, and zero outside. Along a ray inside one cell of eight texels the density is a cubic
//! polynomial of the distance, so two-point Gauss-Legendre integrates it exactly: [`Grid::integral`] has rounding error
//! only (test `a_line_integral_is_exact`). Unit: density \[1\] times metres.

use glam::DVec3;

use crate::error::{Error, Result};

/// Largest number of voxels of a volume (16 GiB of `f32`).
pub const MAX_VOXELS: usize = 1 << 32;

/// Texels along a brick of the map of clear regions: more than a step of the sweep towards the Sun (sun.rs).
const BRICK: usize = 4;

/// Density on a regular grid, padded by one texel on each side so that no lookup needs a bound.
#[derive(Debug, Clone)]
pub struct Grid {
    padded: Vec<f32>,
    /// For bricks of [`BRICK`] texels along each axis: whether they and their neighbours hold no density at all.
    clear: Vec<bool>,
    bricks: [usize; 3],
    /// Largest density.
    pub peak: f32,
    /// Texels along x, y, z.
    pub size: [usize; 3],
    /// Lowest corner of the box \[m\].
    pub low: DVec3,
    /// Edges of a voxel \[m\].
    pub voxel: DVec3,
}

/// One cell crossed by a ray.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// Where the ray enters the cell \[m\].
    pub enter: f64,
    /// Where it leaves it \[m\].
    pub leave: f64,
    /// Integral of density over the cell \[m\].
    pub depth: f64,
    corners: [f64; 8],
    /// Where the ray's origin lies in the cell's own coordinates, and its direction.
    from: DVec3,
    direction: DVec3,
}

impl Crossing {
    /// Integral of density \[m\] over a part `a..b` of the crossing: exact, the density there is a cubic.
    #[inline]
    pub fn depth_between(&self, a: f64, b: f64) -> f64 {
        // Gauss-Legendre nodes on [0, 1].
        const LOW: f64 = 0.211_324_865_405_187_1;
        const HIGH: f64 = 0.788_675_134_594_812_9;
        let length = b - a;
        let at = |s: f64| trilinear(&self.corners, self.from + self.direction * (a + s * length));
        0.5 * length * (at(LOW) + at(HIGH))
    }
}

impl Grid {
    /// Refuse a volume that is empty, absurdly large, of the wrong length, or NaN, infinite or negative anywhere.
    pub fn validate(density: &[f32], size: [usize; 3], voxel: DVec3, low: DVec3) -> Result<()> {
        let [nx, ny, nz] = size;
        let count = nx.checked_mul(ny).and_then(|n| n.checked_mul(nz)).unwrap_or(usize::MAX);
        if count == 0 {
            return Err(Error::Empty { name: "density" });
        }
        if count > MAX_VOXELS {
            return Err(Error::Data { name: "density", reason: format!("{nz} x {ny} x {nx} voxels are too many") });
        }
        if density.len() != count {
            return Err(Error::Shape {
                name: "density",
                expected: format!("({nz}, {ny}, {nx})"),
                got: format!("{} elements", density.len()),
            });
        }
        if let Some(at) = density.iter().position(|&x| !(x >= 0.0 && x.is_finite())) {
            let (x, y, z) = (at % nx, at / nx % ny, at / nx / ny);
            let reason = format!("must be finite and not negative, got {} at (z, y, x) = ({z}, {y}, {x})", density[at]);
            return Err(Error::Data { name: "density", reason });
        }
        let usable = |v: f64| v.is_finite() && v > 0.0;
        if !(usable(voxel.x) && usable(voxel.y) && usable(voxel.z)) {
            let reason = format!("must be finite and above 0 [m], got {voxel}");
            return Err(Error::Data { name: "voxel_size", reason });
        }
        if !low.is_finite() {
            return Err(Error::Data { name: "origin", reason: format!("must be finite [m], got {low}") });
        }
        Ok(())
    }

    /// A grid from `density` in `(z, y, x)` order; see [`validate`](Self::validate) for what is refused.
    pub fn new(density: &[f32], size: [usize; 3], voxel: DVec3, low: DVec3) -> Result<Self> {
        Self::validate(density, size, voxel, low)?;
        let [nx, ny, nz] = size;
        let (px, py, pz) = (nx + 2, ny + 2, nz + 2);
        let mut padded = vec![0.0; px * py * pz];
        for z in 0..pz {
            let from_z = z.saturating_sub(1).min(nz - 1);
            for y in 0..py {
                let from = (from_z * ny + y.saturating_sub(1).min(ny - 1)) * nx;
                let row = &mut padded[(z * py + y) * px..][..px];
                row[1..=nx].copy_from_slice(&density[from..from + nx]);
                row[0] = row[1];
                row[nx + 1] = row[nx];
            }
        }
        let bricks = [px, py, pz].map(|n| n.div_ceil(BRICK));
        let brick = |c: [usize; 3]| (c[2] * bricks[1] + c[1]) * bricks[0] + c[0];
        let mut holds = vec![false; bricks.iter().product()];
        for z in 0..pz {
            for y in 0..py {
                for (bx, part) in padded[(z * py + y) * px..][..px].chunks(BRICK).enumerate() {
                    if part.iter().any(|&v| v > 0.0) {
                        holds[brick([bx, y / BRICK, z / BRICK])] = true;
                    }
                }
            }
        }
        let around = |c: usize, n: usize| c.saturating_sub(1)..(c + 2).min(n);
        let near = |x: usize, y: usize, z: usize| {
            around(z, bricks[2])
                .any(|z| around(y, bricks[1]).any(|y| around(x, bricks[0]).any(|x| holds[brick([x, y, z])])))
        };
        let clear = (0..holds.len())
            .map(|b| !near(b % bricks[0], b / bricks[0] % bricks[1], b / (bricks[0] * bricks[1])))
            .collect();
        let peak = density.iter().copied().fold(0.0, f32::max);
        Ok(Self { padded, clear, bricks, peak, size, low, voxel })
    }

    /// Highest corner of the box \[m\].
    pub fn high(&self) -> DVec3 {
        self.low + self.voxel * self.extent()
    }

    /// Number of voxels along each axis, as a vector: the box in voxel coordinates.
    pub fn extent(&self) -> DVec3 {
        DVec3::new(self.size[0] as f64, self.size[1] as f64, self.size[2] as f64)
    }

    /// A point in voxel coordinates: the box is `0..extent`.
    pub fn to_voxels(&self, point: DVec3) -> DVec3 {
        (point - self.low) / self.voxel
    }

    /// Whether no density is within a few texels of a point of the box (voxel coordinates).
    #[inline]
    pub fn is_clear(&self, p: DVec3) -> bool {
        let c: [usize; 3] = std::array::from_fn(|a| ((p[a] + 0.5) as usize / BRICK).min(self.bricks[a] - 1));
        self.clear[(c[2] * self.bricks[1] + c[1]) * self.bricks[0] + c[0]]
    }

    /// The density at the low corner of cell `c`, that of the texel before it; `c` up to the size plus one.
    #[inline(always)]
    pub fn corner(&self, c: [usize; 3]) -> f32 {
        self.padded[(c[2] * (self.size[1] + 2) + c[1]) * (self.size[0] + 2) + c[0]]
    }

    /// The eight densities around cell `c` (cell 0 lies between the padding and the first texel), x fastest.
    #[inline(always)]
    pub fn cell(&self, c: [usize; 3]) -> [f32; 8] {
        let (px, py) = (self.size[0] + 2, self.size[1] + 2);
        let base = (c[2] * py + c[1]) * px + c[0];
        let plane = px * py;
        let at = |o: usize| self.padded[o];
        [
            at(base),
            at(base + 1),
            at(base + px),
            at(base + px + 1),
            at(base + plane),
            at(base + plane + 1),
            at(base + plane + px),
            at(base + plane + px + 1),
        ]
    }

    /// Walk the cells that the segment `p + t d`, `enter <= t <= leave`, crosses (voxel coordinates, inside the box).
    /// `visit` returns `false` to stop.
    #[inline]
    pub fn walk(&self, p: DVec3, d: DVec3, enter: f64, leave: f64, mut visit: impl FnMut(&Crossing) -> bool) {
        let start = p + d * enter;
        let mut cell = [0_usize; 3];
        let mut next = [f64::INFINITY; 3];
        let mut delta = [f64::INFINITY; 3];
        for axis in 0..3 {
            let limit = self.size[axis];
            // Cell c spans c - 0.5 to c + 0.5. A point on a boundary belongs to the cell ahead.
            let x = start[axis] + 0.5;
            let mut c = x.floor();
            if d[axis] < 0.0 && x == c {
                c -= 1.0;
            }
            cell[axis] = (c.max(0.0) as usize).min(limit);
            if d[axis] != 0.0 {
                delta[axis] = 1.0 / d[axis].abs();
                let bound = cell[axis] as f64 + if d[axis] > 0.0 { 0.5 } else { -0.5 };
                next[axis] = (bound - p[axis]) / d[axis];
            }
        }
        let mut t = enter;
        loop {
            let axis = if next[0] < next[1] {
                if next[0] < next[2] { 0 } else { 2 }
            } else if next[1] < next[2] {
                1
            } else {
                2
            };
            let end = next[axis].min(leave);
            if end > t {
                let corners = self.cell(cell).map(f64::from);
                let low = DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64) - 0.5;
                let mut crossing = Crossing { enter: t, leave: end, depth: 0.0, corners, from: p - low, direction: d };
                if corners.iter().any(|&v| v != 0.0) {
                    crossing.depth = crossing.depth_between(t, end);
                }
                if !visit(&crossing) {
                    return;
                }
                t = end;
            }
            if next[axis] >= leave {
                return;
            }
            if d[axis] > 0.0 {
                cell[axis] += 1;
                if cell[axis] > self.size[axis] {
                    return;
                }
            } else if cell[axis] == 0 {
                return;
            } else {
                cell[axis] -= 1;
            }
            next[axis] += delta[axis];
        }
    }

    /// Integral of density \[m\] along `p + t d`, `t >= 0`, in voxel coordinates; `d` is a unit world direction divided
    /// by the voxel, so `t` is in metres. Outside the box the density is zero.
    pub fn integral(&self, p: DVec3, d: DVec3, leave: f64) -> f64 {
        let Some((a, b)) = crate::math::geometry::clip_to_box(p, d, DVec3::ZERO, self.extent()) else { return 0.0 };
        let mut sum = 0.0;
        if a < leave {
            self.walk(p, d, a, b.min(leave), |c| {
                sum += c.depth;
                true
            });
        }
        sum
    }

    /// Density at a point in voxel coordinates; zero outside the box.
    pub fn at(&self, p: DVec3) -> f64 {
        if p.cmplt(DVec3::ZERO).any() || p.cmpgt(self.extent()).any() {
            return 0.0;
        }
        let q = p + 0.5;
        let mut cell = [0; 3];
        let mut f = DVec3::ZERO;
        for axis in 0..3 {
            cell[axis] = (q[axis] as usize).min(self.size[axis]);
            f[axis] = q[axis] - cell[axis] as f64;
        }
        trilinear(&self.cell(cell).map(f64::from), f)
    }
}

#[inline]
fn trilinear(v: &[f64; 8], f: DVec3) -> f64 {
    let x = |a: f64, b: f64| a + (b - a) * f.x;
    let (y0, y1) = (x(v[0], v[1]), x(v[2], v[3]));
    let (y2, y3) = (x(v[4], v[5]), x(v[6], v[7]));
    let (z0, z1) = (y0 + (y1 - y0) * f.y, y2 + (y3 - y2) * f.y);
    z0 + (z1 - z0) * f.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn random_grid(size: [usize; 3]) -> Grid {
        let s = Stream::new(1, 1);
        let n: usize = size.iter().product();
        let data: Vec<f32> = (0..n as u64).map(|i| s.uniform(i) as f32).collect();
        Grid::new(&data, size, DVec3::new(2.0, 3.0, 5.0), DVec3::new(-1.0, 4.0, 0.5)).expect("valid")
    }

    #[test]
    fn a_line_integral_is_exact() {
        let grid = random_grid([5, 4, 3]);
        let s = Stream::new(2, 2);
        for ray in 0..50_u64 {
            let u = |k: u64| s.uniform(ray * 8 + k) - 0.5;
            let p = grid.extent() * DVec3::new(u(0), u(1), u(2)) + grid.extent() * 0.5;
            let d = DVec3::new(u(3), u(4), u(5)).normalize() / grid.voxel;
            // Midpoint rule with very many steps of the pointwise density.
            let (_, leave) = crate::math::geometry::clip_to_box(p, d, DVec3::ZERO, grid.extent()).expect("inside");
            let n = 200_000;
            let h = leave / f64::from(n);
            let sum: f64 = (0..n).map(|i| grid.at(p + d * ((f64::from(i) + 0.5) * h))).sum::<f64>() * h;
            let exact = grid.integral(p, d, f64::INFINITY);
            assert!((exact - sum).abs() < 1e-8 * (1.0 + sum), "ray {ray}: {exact} against {sum}");
        }
    }

    #[test]
    fn a_constant_box_has_its_length_as_integral() {
        let grid = Grid::new(&[0.5; 24], [2, 3, 4], DVec3::splat(10.0), DVec3::ZERO).expect("valid");
        let through = grid.integral(DVec3::new(-1.0, 1.5, 2.0), DVec3::X / 10.0, f64::INFINITY);
        assert!((through - 10.0).abs() < 1e-12, "20 m at density 0.5, got {through}");
        let down = grid.integral(DVec3::new(1.0, 1.0, 9.0), -DVec3::Z / 10.0, f64::INFINITY);
        assert!((down - 20.0).abs() < 1e-12, "40 m at density 0.5, got {down}");
        let edge = grid.integral(DVec3::new(-1.0, 0.0, 2.0), DVec3::X / 10.0, f64::INFINITY);
        assert_eq!(edge, 0.0, "a ray in the face's plane has no thickness");
    }

    #[test]
    fn bad_volumes_are_refused_by_name() {
        let new = |data: &[f32]| Grid::new(data, [1, 1, data.len()], DVec3::ONE, DVec3::ZERO);
        let text = |r: Result<Grid>| r.expect_err("refused").to_string();
        assert!(text(new(&[0.0, f32::NAN])).contains("(1, 0, 0)"), "names the voxel");
        assert!(text(new(&[-1.0])).contains("not negative"), "negative");
        assert!(text(new(&[])).contains("empty"), "empty");
    }
}

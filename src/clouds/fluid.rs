//! Incompressible air in a closed box: fields on a staggered mesh, conservative advection, vorticity confinement.
//!
//! Velocities stand on the faces of cells and everything else in their middles (Harlow and Welch 1965). Each array has
//! two layers of ghosts on every side, which mirror the inside: walls let slip and let nothing through. A value is
//! moved by fluxes through the faces of its own cell (van Leer 1977, second order in space and time, monotonised
//! central slopes), so a sum over the box changes by rounding alone, and a constant stays one in air without
//! divergence. Stable while the Courant numbers of a cell sum to at most 1; [`fastest`] gives that sum for one second.
//!
//! Every expression is written so that a mirrored box gives the mirrored bits.

use crate::error::Result;
use crate::job::Job;
use crate::math::lanes;

/// Layers of ghosts on each side.
const GHOST: usize = 2;

/// A value per cell or face with its ghosts, `(nz + 4, ny + 4, nx + 4)`.
pub type GridField = Vec<f32>;

/// Where in its cell a value stands: in the middle, or on the lower face across an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stand {
    /// In the middle.
    Cell,
    /// On the lower face across axis 0 (x), 1 (y) or 2 (z).
    Face(usize),
}

/// A box of cells.
#[derive(Debug, Clone, Copy)]
pub struct StaggeredGrid {
    /// Cells along x, y, z.
    pub n: [usize; 3],
    /// Edges of a cell \[m\].
    pub h: [f64; 3],
}

impl StaggeredGrid {
    /// Steps between neighbours along each axis in a [`GridField`].
    pub fn strides(&self) -> [usize; 3] {
        let row = self.n[0] + 2 * GHOST;
        [1, row, row * (self.n[1] + 2 * GHOST)]
    }

    /// A field of zeros.
    pub fn field(&self) -> GridField {
        vec![0.0; self.strides()[2] * (self.n[2] + 2 * GHOST)]
    }

    /// Where the first cell of row `j` of layer `k` is in a [`GridField`].
    #[inline(always)]
    pub fn row(&self, j: usize, k: usize) -> usize {
        let [_, row, plane] = self.strides();
        (k + GHOST) * plane + (j + GHOST) * row + GHOST
    }

    /// Call `work(j, k, start, row)` for each row of cells of `out`; `start` is where the row begins in a
    /// [`GridField`]. Then mirror into the ghosts.
    pub fn rows(
        &self,
        out: &mut GridField,
        stand: Stand,
        job: &Job,
        work: impl Fn(usize, usize, usize, &mut [f32]) + Sync,
    ) -> Result<()> {
        let [_, row, plane] = self.strides();
        let [nx, ny, nz] = self.n;
        job.chunks(out, plane, |chunk, cells| {
            if chunk < GHOST || chunk >= nz + GHOST {
                return Ok(());
            }
            let k = chunk - GHOST;
            for j in 0..ny {
                let inside = (j + GHOST) * row + GHOST;
                work(j, k, chunk * plane + inside, &mut cells[inside..inside + nx]);
            }
            self.mirror_plane(cells, stand);
            Ok(())
        })?;
        self.mirror_ends(out, stand);
        Ok(())
    }

    /// Ghosts of one layer at its four sides.
    fn mirror_plane(&self, cells: &mut [f32], stand: Stand) {
        let [_, row, _] = self.strides();
        let [nx, ny, _] = self.n;
        for j in 0..ny {
            let line = &mut cells[(j + GHOST) * row..(j + GHOST + 1) * row];
            reflect(nx, stand == Stand::Face(0), |to, from, sign| line[to] = sign * line[from]);
        }
        reflect(ny, stand == Stand::Face(1), |to, from, sign| {
            for i in 0..row {
                cells[to * row + i] = sign * cells[from * row + i];
            }
        });
    }

    /// Ghost layers below and above.
    fn mirror_ends(&self, field: &mut GridField, stand: Stand) {
        let plane = self.strides()[2];
        reflect(self.n[2], stand == Stand::Face(2), |to, from, sign| {
            for i in 0..plane {
                field[to * plane + i] = sign * field[from * plane + i];
            }
        });
    }

    /// The cells of a field without ghosts, `(nz, ny, nx)`.
    pub fn inside(&self, field: &GridField) -> Vec<f32> {
        let [nx, ny, nz] = self.n;
        let mut out = Vec::with_capacity(nx * ny * nz);
        for k in 0..nz {
            for j in 0..ny {
                let start = self.row(j, k);
                out.extend_from_slice(&field[start..start + nx]);
            }
        }
        out
    }
}

/// Call `put(to, from, sign)` for the ghosts of a line of `n` values: even about the walls, or, for what stands on the
/// walls, zero on them and odd about them.
fn reflect(n: usize, odd: bool, mut put: impl FnMut(usize, usize, f32)) {
    if odd {
        // The lower wall holds the first value, the upper one the first ghost behind the last.
        put(GHOST, GHOST, 0.0);
        put(GHOST + n, GHOST, 0.0);
        put(1, 3, -1.0);
        put(0, 4, -1.0);
        put(GHOST + n + 1, GHOST + n - 1, -1.0);
    } else {
        put(1, 2, 1.0);
        put(0, 3, 1.0);
        put(GHOST + n, GHOST + n - 1, 1.0);
        put(GHOST + n + 1, GHOST + n - 2, 1.0);
    }
}

/// Monotonised central slope of two differences.
#[inline(always)]
fn slope(a: f32, b: f32) -> f32 {
    let mean = 0.5 * (a + b);
    let (wide, other, middle) = (2.0 * a.abs(), 2.0 * b.abs(), mean.abs());
    let least = if wide < other { wide } else { other };
    let least = if least < middle { least } else { middle };
    let signed = if mean < 0.0 { -least } else { least };
    if a * b > 0.0 { signed } else { 0.0 }
}

/// What passes a face between `b` and `c` in a step of Courant number `courant`, `a` and `d` being their neighbours.
#[inline(always)]
fn flux(courant: f32, [a, b, c, d]: [f32; 4]) -> f32 {
    let from_below = b + 0.5 * (1.0 - courant) * slope(b - a, c - b);
    let from_above = c - 0.5 * (1.0 + courant) * slope(c - b, d - c);
    courant * if courant > 0.0 { from_below } else { from_above }
}

/// Move `field` by the velocities for `dt` seconds, into `out`.
pub fn advect(
    mesh: &StaggeredGrid,
    velocity: &[GridField; 3],
    field: &GridField,
    stand: Stand,
    dt: f64,
    out: &mut GridField,
    job: &Job,
) -> Result<()> {
    let strides = mesh.strides();
    // A face of a shifted cell lies between two faces of the mesh, and is crossed with the mean of their velocities.
    let back = match stand {
        Stand::Cell => 0,
        Stand::Face(axis) => strides[axis],
    };
    let half = [0, 1, 2].map(|axis| (0.5 * dt / mesh.h[axis]) as f32);
    let nx = mesh.n[0];
    mesh.rows(out, stand, job, |_, _, start, to| {
        lanes::run(
            #[inline(always)]
            || {
                to.copy_from_slice(&field[start..start + nx]);
                for axis in 0..3 {
                    sweep(to, field, &velocity[axis], start, strides[axis], back, half[axis]);
                }
            },
        );
    })
}

/// Take the difference of the fluxes along one axis from a row.
#[inline(always)]
fn sweep(to: &mut [f32], field: &[f32], velocity: &[f32], start: usize, stride: usize, back: usize, half: f32) {
    let n = to.len();
    let part = |from: usize| &field[from..from + n];
    let speed = |from: usize| &velocity[from..from + n];
    let (a, b, c) = (part(start - 2 * stride), part(start - stride), part(start));
    let (d, e) = (part(start + stride), part(start + 2 * stride));
    let (low, low_too) = (speed(start - back), speed(start));
    let (high, high_too) = (speed(start + stride - back), speed(start + stride));
    for i in 0..n {
        let enters = flux(half * (low[i] + low_too[i]), [a[i], b[i], c[i], d[i]]);
        let leaves = flux(half * (high[i] + high_too[i]), [b[i], c[i], d[i], e[i]]);
        to[i] -= leaves - enters;
    }
}

/// Largest sum over the axes of a cell's Courant numbers for a step of one second \[1/s\].
pub fn fastest(mesh: &StaggeredGrid, velocity: &[GridField; 3], job: &Job) -> Result<f64> {
    let strides = mesh.strides();
    let scale = [0, 1, 2].map(|axis| (1.0 / mesh.h[axis]) as f32);
    let [nx, ny, nz] = mesh.n;
    let peaks = job.map(nz, |k| {
        let mut peak = 0.0_f32;
        for j in 0..ny {
            let start = mesh.row(j, k);
            for i in start..start + nx {
                let mut sum = 0.0;
                for axis in 0..3 {
                    let (low, high) = (velocity[axis][i].abs(), velocity[axis][i + strides[axis]].abs());
                    sum += scale[axis] * if low > high { low } else { high };
                }
                // Written so that a NaN is found and not lost.
                peak = if sum <= peak { peak } else { sum };
            }
        }
        Ok(peak)
    })?;
    Ok(peaks.into_iter().fold(0.0, |a, b| if b <= a { a } else { b }).into())
}

/// Buffers of [`confine`].
#[derive(Debug)]
pub struct Vorticity {
    curl: [GridField; 3],
    size: GridField,
    force: [GridField; 3],
}

impl Vorticity {
    /// Buffers for a mesh.
    pub fn new(mesh: &StaggeredGrid) -> Self {
        let three = || [mesh.field(), mesh.field(), mesh.field()];
        Self { curl: three(), size: mesh.field(), force: three() }
    }
}

/// Vorticity confinement (Steinhoff and Underhill 1994, Fedkiw et al. 2001): a force along N × ω, where N points to
/// where the vorticity ω is stronger, gives eddies back what the mesh takes from them. Adds `dt` seconds of it. Its
/// size is ε h |ω|² and not ε h |ω|: ε is then a number and not a rate, and means the same in a storm and in a breeze.
pub fn confine(
    mesh: &StaggeredGrid,
    velocity: &mut [GridField; 3],
    strength: f64,
    dt: f64,
    buffers: &mut Vorticity,
    job: &Job,
) -> Result<()> {
    let strides = mesh.strides();
    let nx = mesh.n[0];
    let quarter = [0, 1, 2].map(|axis| (0.25 / mesh.h[axis]) as f32);
    let half = [0, 1, 2].map(|axis| (0.5 / mesh.h[axis]) as f32);
    let Vorticity { curl, size, force } = buffers;
    for (axis, curl) in curl.iter_mut().enumerate() {
        let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
        let (first, second) = (&velocity[p], &velocity[q]);
        mesh.rows(curl, Stand::Cell, job, |_, _, start, to| {
            lanes::run(
                #[inline(always)]
                || {
                    // ∂_p of the second minus ∂_q of the first, both brought to the middle.
                    difference(to, second, start, strides[p], strides[q], quarter[p], 0.0);
                    difference(to, first, start, strides[q], strides[p], -quarter[q], 1.0);
                },
            );
        })?;
    }
    mesh.rows(size, Stand::Cell, job, |_, _, start, to| {
        let [x, y, z] = [0, 1, 2].map(|a| &curl[a][start..start + nx]);
        for i in 0..nx {
            to[i] = (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).sqrt();
        }
    })?;
    let reach = (mesh.h[0] * mesh.h[1] * mesh.h[2]).cbrt();
    let gain = (strength * reach * dt) as f32;
    for (axis, force) in force.iter_mut().enumerate() {
        let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
        let (curl, size) = (&*curl, &*size);
        mesh.rows(force, Stand::Cell, job, |_, _, start, to| {
            let strength = &size[start..start + nx];
            let gradient = |axis: usize| {
                let stride = strides[axis];
                (&size[start + stride..start + stride + nx], &size[start - stride..start - stride + nx])
            };
            let g = [gradient(0), gradient(1), gradient(2)];
            let (wp, wq) = (&curl[p][start..start + nx], &curl[q][start..start + nx]);
            lanes::run(
                #[inline(always)]
                || {
                    for i in 0..nx {
                        let slope = |a: usize| half[a] * (g[a].0[i] - g[a].1[i]);
                        let (gx, gy, gz) = (slope(0), slope(1), slope(2));
                        // In calm air there is no direction, and no force.
                        let length = (gx * gx + gy * gy + gz * gz).sqrt() + 1e-12;
                        to[i] = gain * strength[i] * (slope(p) * wq[i] - slope(q) * wp[i]) / length;
                    }
                },
            );
        })?;
    }
    for (axis, velocity) in velocity.iter_mut().enumerate() {
        let force = &force[axis];
        add_to_faces(mesh, velocity, axis, force, 1.0, job)?;
    }
    Ok(())
}

/// `to = keep * to + scale * difference` of a face value along `along`, between the middles of the cells at both sides.
#[inline(always)]
fn difference(to: &mut [f32], field: &[f32], start: usize, along: usize, own: usize, scale: f32, keep: f32) {
    let n = to.len();
    let part = |from: usize| &field[from..from + n];
    let (a, b) = (part(start + along), part(start + along + own));
    let (c, d) = (part(start - along), part(start - along + own));
    for i in 0..n {
        to[i] = keep * to[i] + scale * ((a[i] + b[i]) - (c[i] + d[i]));
    }
}

/// Add `scale` times a field of the cells to the velocities across one axis.
pub fn add_to_faces(
    mesh: &StaggeredGrid,
    velocity: &mut GridField,
    axis: usize,
    cells: &GridField,
    scale: f32,
    job: &Job,
) -> Result<()> {
    let stride = mesh.strides()[axis];
    mesh.rows(velocity, Stand::Face(axis), job, |_, _, start, to| {
        let n = to.len();
        let (low, high) = (&cells[start - stride..start - stride + n], &cells[start..start + n]);
        for i in 0..n {
            to[i] += 0.5 * scale * (low[i] + high[i]);
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vortex about the middle of the box, from a stream function that vanishes on the walls.
    fn vortex(mesh: &StaggeredGrid) -> [GridField; 3] {
        let [nx, ny, nz] = mesh.n;
        let stream = |i: usize, k: usize| {
            let (x, z) = (i as f64 / nx as f64, k as f64 / nz as f64);
            (std::f64::consts::PI * x).sin() * (std::f64::consts::PI * z).sin() * 100.0
        };
        let mut velocity = [mesh.field(), mesh.field(), mesh.field()];
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    let at = mesh.row(j, k) + i;
                    velocity[0][at] = ((stream(i, k + 1) - stream(i, k)) / mesh.h[2]) as f32;
                    velocity[2][at] = (-(stream(i + 1, k) - stream(i, k)) / mesh.h[0]) as f32;
                }
            }
        }
        for (axis, field) in velocity.iter_mut().enumerate() {
            mesh.rows(field, Stand::Face(axis), &Job::serial(), |_, _, _, _| ()).expect("mirrors");
        }
        velocity
    }

    fn sum(mesh: &StaggeredGrid, field: &GridField) -> f64 {
        mesh.inside(field).iter().map(|&x| f64::from(x)).sum()
    }

    #[test]
    fn a_vortex_keeps_sums_bounds_and_constants() {
        let mesh = StaggeredGrid { n: [20, 9, 16], h: [10.0, 12.0, 8.0] };
        let (velocity, job) = (vortex(&mesh), Job::serial());
        let dt = 0.8 / fastest(&mesh, &velocity, &job).expect("runs");
        let (mut blob, mut flat) = (mesh.field(), mesh.field());
        mesh.rows(&mut flat, Stand::Cell, &job, |_, _, _, row| row.fill(3.5)).expect("runs");
        mesh.rows(&mut blob, Stand::Cell, &job, |_, k, _, row| {
            for (i, x) in row.iter_mut().enumerate() {
                *x = f32::from(u8::from((4..9).contains(&i) && (3..9).contains(&k)));
            }
        })
        .expect("runs");
        let before = sum(&mesh, &blob);
        let mut next = mesh.field();
        for _ in 0..200 {
            for field in [&mut blob, &mut flat] {
                advect(&mesh, &velocity, field, Stand::Cell, dt, &mut next, &job).expect("runs");
                std::mem::swap(field, &mut next);
            }
        }
        assert!((sum(&mesh, &blob) / before - 1.0).abs() < 1e-6, "the sum stays");
        assert!(mesh.inside(&flat).iter().all(|x| (x - 3.5).abs() < 1e-4), "a constant stays");
        let (low, high) = mesh.inside(&blob).iter().fold((0.0_f32, 0.0_f32), |(a, b), &x| (a.min(x), b.max(x)));
        assert!(low > -0.02 && high < 1.02, "no new extremes, {low} {high}");
        assert!(high > 0.3, "and not smeared away, {high}");
    }

    #[test]
    fn second_order_in_space_and_time() {
        // A sine carried along x by a flow that is uniform there: the error falls about fourfold with the mesh.
        let error = |n: usize| {
            let mesh = StaggeredGrid { n: [n, 1 + n / 16, 8], h: [1.0 / n as f64, 1.0, 1.0] };
            let job = Job::serial();
            let mut velocity = [mesh.field(), mesh.field(), mesh.field()];
            velocity[0].fill(1.0);
            let wave = |x: f64| (-((x - 0.35) / 0.1).powi(2)).exp();
            let mut field = mesh.field();
            mesh.rows(&mut field, Stand::Cell, &job, |_, _, _, row| {
                for (i, x) in row.iter_mut().enumerate() {
                    *x = wave((i as f64 + 0.5) / n as f64) as f32;
                }
            })
            .expect("runs");
            let mut next = mesh.field();
            let steps = n / 2;
            for _ in 0..steps {
                advect(&mesh, &velocity, &field, Stand::Cell, 0.3 / steps as f64, &mut next, &job).expect("runs");
                std::mem::swap(&mut field, &mut next);
            }
            let row = &mesh.inside(&field)[..n];
            row.iter()
                .enumerate()
                .map(|(i, &x)| (f64::from(x) - wave((i as f64 + 0.5) / n as f64 - 0.3)).abs())
                .sum::<f64>()
                / n as f64
        };
        let (coarse, fine) = (error(64), error(128));
        assert!(fine < coarse / 3.0, "{coarse} {fine}");
    }
}

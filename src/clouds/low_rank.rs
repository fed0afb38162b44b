//! Denoising of basis images across their nodes, and their low-rank form: least-squares polynomials and a truncated
//! singular value decomposition (floor 3).
//!
//! A basis of inverse_clouds (section 4.3) holds an image of the orders from 2 on for each group of orders, asymmetry
//! and extinction. Between neighbouring nodes light changes smoothly, so each pixel is fitted by Chebyshev polynomials
//! in `atanh g` and `ln sigma`, nodes weighed by their noise ([`fit_nodes`]). The images of all nodes are then nearly
//! combinations of a few ([`factors`]): randomised subspace iteration (Halko, Martinsson and Tropp 2011) with two power
//! iterations from a start of fixed random numbers, the small factor by one-sided Jacobi rotations (Hestenes 1958).
//!
//! All sums are in `f64` and in a fixed order: the same bits for every number of threads and every BLAS. Error against
//! numpy's QR and SVD in double precision: 3e-7 of the largest value of an image
//! (`tests/papers/test_basis_low_rank.py`). Units: images \[1\], extinctions \[1/m\].
//! Cost on two cores: 0.07 s for 432 images of 2118 pixels, 0.26 s for 1584 of them (numpy in single
//! precision: 0.05 and 0.14 s).

use super::phase::henyey_greenstein;
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::lanes;
use crate::math::random::Stream;

/// Independent images of a smoothed basis.
pub const RANK: usize = 32;
/// Columns of the subspace: a few more than are kept.
pub const WIDTH: usize = RANK + 8;
/// Power iterations.
const ITERATIONS: usize = 2;
/// Degrees of the polynomials in `atanh g` and in `ln sigma`.
const DEGREES: [usize; 2] = [5, 7];
/// Sweeps of rotations at most, and the cosine between columns that count as orthogonal.
const SWEEPS: usize = 40;
const ORTHOGONAL: f64 = 1e-14;
/// Purpose of the random numbers of the start.
const START: u64 = 0x10_3A4E;
/// Pixels that are worked on together, and rows of a matrix whose sums are added up by themselves.
const PIXELS: usize = 64;
const ROWS: usize = 2048;

/// One row of a tall matrix of [`WIDTH`] columns.
type Row = [f64; WIDTH];

/// Left vectors, singular values, right vectors, strongest first.
type Svd = (Vec<Vec<f64>>, Vec<f64>, Vec<Row>);

fn check(name: &'static str, got: usize, expected: usize) -> Result<()> {
    if got == expected {
        return Ok(());
    }
    Err(Error::Shape { name, expected: format!("{expected} elements"), got: format!("{got} elements") })
}

/// What the light of nodes is taken from: images of single scattering, and where the pixels of higher orders lie in
/// them.
#[derive(Debug, Clone, Copy)]
pub struct SingleImages<'a> {
    /// Light scattered once, without phase function, image by image.
    pub single_scattering: &'a [f32],
    /// Their extinctions \[1/m\].
    pub sigma: &'a [f64],
    /// Cosine of the scattering angle of each pixel.
    pub cosine: &'a [f32],
    /// Pixels that see the cloud.
    pub pixels: &'a [u32],
}

/// Root mean square of all light of each node `(g, sigma)` over the pixels: single scattering with its phase function,
/// at the nearest extinction, and the groups of higher orders in `multiple` \[1\].
pub fn node_light(once: &SingleImages<'_>, multiple: &[f32], g: &[f64], sigma: &[f64], job: &Job) -> Result<Vec<f64>> {
    let (n, area, nodes) = (once.pixels.len(), once.cosine.len(), g.len() * sigma.len());
    check("scattered", once.single_scattering.len(), area * once.sigma.len())?;
    if nodes * n == 0 || !multiple.len().is_multiple_of(nodes * n) {
        return Err(Error::Empty { name: "multiple" });
    }
    if once.sigma.is_empty() || once.pixels.iter().any(|&p| p as usize >= area) {
        return Err(Error::Data { name: "pixels", reason: "must lie in the images".into() });
    }
    job.map(nodes, |node| {
        let (g, sigma) = (g[node / sigma.len()], sigma[node % sigma.len()]);
        let off = |k: usize| (once.sigma[k] - sigma).abs();
        let nearest = (1..once.sigma.len()).fold(0, |best, k| if off(k) < off(best) { k } else { best });
        let image = &once.single_scattering[nearest * area..(nearest + 1) * area];
        let mut sum = 0.0;
        for (k, &p) in once.pixels.iter().enumerate() {
            let p = p as usize;
            let more: f32 = multiple.chunks_exact(nodes * n).map(|group| group[node * n + k]).sum();
            let phase = henyey_greenstein(g, f64::from(once.cosine[p]), f64::sqrt);
            sum += (f64::from(image[p]) * phase + f64::from(more)).powi(2);
        }
        Ok((sum / n as f64).sqrt())
    })
}

/// Chebyshev polynomials up to `degree` at `x` in `[-1, 1]`.
fn chebyshev(x: f64, degree: usize) -> Vec<f64> {
    let mut out = vec![1.0, x];
    for k in 2..=degree {
        out.push(2.0 * x * out[k - 1] - out[k - 2]);
    }
    out.truncate(degree + 1);
    out
}

/// Products of polynomials at all nodes, one column for each.
fn polynomials(g: &[f64], sigma: &[f64]) -> Vec<Vec<f64>> {
    let along = |x: Vec<f64>, degree: usize| {
        let (low, range) = (x[0], (x[x.len() - 1] - x[0]).max(1e-30));
        let degree = degree.min(x.len() - 1);
        x.iter().map(|x| chebyshev(2.0 * (x - low) / range - 1.0, degree)).collect::<Vec<_>>()
    };
    let by_g = along(g.iter().map(|g| g.atanh()).collect(), DEGREES[0]);
    let by_sigma = along(sigma.iter().map(|s| s.ln()).collect(), DEGREES[1]);
    let mut columns = Vec::new();
    for i in 0..by_g[0].len() {
        for j in 0..by_sigma[0].len() {
            columns.push(by_g.iter().flat_map(|a| by_sigma.iter().map(move |b| a[i] * b[j])).collect());
        }
    }
    columns
}

/// Make columns orthonormal (Gram-Schmidt, twice).
fn gram_schmidt(columns: &mut [Vec<f64>]) {
    for k in 0..columns.len() {
        let (before, rest) = columns.split_at_mut(k);
        let column = &mut rest[0];
        for _ in 0..2 {
            for other in &*before {
                let dot: f64 = other.iter().zip(&*column).map(|(a, b)| a * b).sum();
                column.iter_mut().zip(other).for_each(|(c, o)| *c -= dot * o);
            }
            let norm = column.iter().map(|x| x * x).sum::<f64>().sqrt();
            let scale = if norm > 0.0 { 1.0 / norm } else { 0.0 };
            for c in column.iter_mut() {
                *c *= scale;
            }
        }
    }
}

/// Fit polynomials in `atanh g` and `ln sigma` to every pixel of `images` `(group, g, sigma, pixel)`, in place: noisy
/// nodes learn from their clean neighbours. `error` is the noise of each image; no light is negative.
pub fn fit_nodes(images: &mut [f32], g: &[f64], sigma: &[f64], error: &[f64], job: &Job) -> Result<()> {
    let nodes = g.len() * sigma.len();
    if nodes == 0 || error.is_empty() || !error.len().is_multiple_of(nodes) {
        return Err(Error::Empty { name: "error" });
    }
    let n = images.len() / error.len();
    check("images", images.len(), n * error.len())?;
    let terms = polynomials(g, sigma);
    for (group, error) in images.chunks_exact_mut((nodes * n).max(1)).zip(error.chunks_exact(nodes)) {
        let weight: Vec<f64> = error.iter().map(|e| 1.0 / e.max(1e-30)).collect();
        let mut q: Vec<Vec<f64>> =
            terms.iter().map(|column| column.iter().zip(&weight).map(|(t, w)| t * w).collect()).collect();
        gram_schmidt(&mut q);
        // The projection, undone of its weights.
        let project: Vec<f64> = (0..nodes * nodes)
            .map(|at| {
                let (i, j) = (at / nodes, at % nodes);
                let dot: f64 = q.iter().map(|column| column[i] * column[j]).sum();
                dot * weight[j] / weight[i]
            })
            .collect();
        let from = &*group;
        let blocks = job.map(n.div_ceil(PIXELS), |b| {
            Ok(lanes::run(
                #[inline(always)]
                || combine(from, n, b * PIXELS, &project, nodes),
            ))
        })?;
        for (b, block) in blocks.iter().enumerate() {
            let (first, count) = (b * PIXELS, PIXELS.min(n - b * PIXELS));
            for (row, values) in block.chunks_exact(PIXELS).enumerate() {
                let to = &mut group[row * n + first..][..count];
                to.iter_mut().zip(values).for_each(|(to, &x)| *to = if x > 0.0 { x } else { 0.0 });
            }
        }
    }
    Ok(())
}

/// Rows of a matrix of `columns` columns times the images of some pixels.
#[inline(always)]
fn combine(images: &[f32], n: usize, first: usize, matrix: &[f64], columns: usize) -> Vec<f32> {
    let count = PIXELS.min(n - first);
    let mut block = vec![[0.0_f64; PIXELS]; columns];
    for (j, to) in block.iter_mut().enumerate() {
        for (to, &x) in to.iter_mut().zip(&images[j * n + first..][..count]) {
            *to = f64::from(x);
        }
    }
    let mut out = Vec::with_capacity(matrix.len() / columns * PIXELS);
    for row in matrix.chunks_exact(columns) {
        let mut sum = [0.0_f64; PIXELS];
        for (&m, from) in row.iter().zip(&block) {
            for k in 0..PIXELS {
                sum[k] += m * from[k];
            }
        }
        out.extend(sum.map(|x| x as f32));
    }
    out
}

/// Images as combinations of few.
#[derive(Debug, Clone)]
pub struct Factors {
    /// How much of each component is in each image, component by component.
    pub coefficients: Vec<f32>,
    /// The components, strongest first.
    pub components: Vec<f32>,
    /// How many there are, at most [`RANK`].
    pub rank: usize,
}

/// Root of the summed squares of the pixels of all groups together, for each node and group of `count` images: what
/// images of an unsmoothed basis are weighed by.
pub fn total_light(images: &[f32], groups: usize, nodes: usize) -> Vec<f64> {
    let n = images.len() / (groups * nodes).max(1);
    let of = |node: usize| {
        let all = |k: usize| images.chunks_exact((nodes * n).max(1)).map(|group| group[node * n + k]).sum::<f32>();
        (0..n).map(|k| f64::from(all(k)).powi(2)).sum::<f64>().sqrt()
    };
    let one: Vec<f64> = (0..nodes).map(of).collect();
    one.iter().copied().cycle().take(groups * nodes).collect()
}

/// The strongest components of `light.len()` images, each weighed by its `light`. The start is fixed: the same
/// images give the same factors.
pub fn factors(images: &[f32], light: &[f64], job: &Job) -> Result<Factors> {
    let count = light.len();
    let n = images.len() / count.max(1);
    let width = WIDTH.min(count).min(n);
    if width == 0 {
        return Err(Error::Empty { name: "images" });
    }
    check("images", images.len(), count * n)?;
    let scale: Vec<f32> = light.iter().map(|l| l.max(1e-30) as f32).collect();
    let mut scaled = images.to_vec();
    job.chunks(&mut scaled, n, |i, row| {
        for x in row {
            *x /= scale[i];
        }
        Ok(())
    })?;
    let start = Stream::new(0, START);
    let mut q: Vec<Row> = (0..n)
        .map(|k| std::array::from_fn(|c| if c < width { start.normal3((k * WIDTH + c) as u64) } else { 0.0 }))
        .collect();
    for _ in 0..ITERATIONS {
        let mut y = times(&scaled, n, &q, job)?;
        orthonormal(&mut y, job)?;
        q = transposed_times(&scaled, n, &y, job)?;
        orthonormal(&mut q, job)?;
    }
    let small = times(&scaled, n, &q, job)?;
    let (left, strengths, right) = tall_svd(&small, job)?;
    let rank = RANK.min(width);
    let coefficients = (0..rank * count).map(|at| (left[at / count][at % count] as f32) * scale[at % count]).collect();
    let mut components = vec![0.0; rank * n];
    job.chunks(&mut components, n, |r, out| {
        for (out, row) in out.iter_mut().zip(&q) {
            let dot: f64 = row.iter().zip(&right[r]).map(|(a, b)| a * b).sum();
            *out = (strengths[r] * dot) as f32;
        }
        Ok(())
    })?;
    Ok(Factors { coefficients, components, rank })
}

impl Factors {
    /// The images again, in place of those that the factors are of.
    pub fn multiply(&self, images: &mut [f32], job: &Job) -> Result<()> {
        let n = self.components.len() / self.rank.max(1);
        let count = self.coefficients.len() / self.rank.max(1);
        check("images", images.len(), n * count)?;
        job.chunks(images, n.max(1), |i, out| {
            lanes::run(
                #[inline(always)]
                || {
                    for (first, out) in out.chunks_mut(PIXELS).enumerate().map(|(b, out)| (b * PIXELS, out)) {
                        let mut sum = [0.0_f64; PIXELS];
                        for r in 0..self.rank {
                            let by = f64::from(self.coefficients[r * count + i]);
                            let from = &self.components[r * n + first..][..out.len()];
                            for (s, &x) in sum.iter_mut().zip(from) {
                                *s += by * f64::from(x);
                            }
                        }
                        out.iter_mut().zip(sum).for_each(|(o, s)| *o = s as f32);
                    }
                },
            );
            Ok(())
        })
    }
}

/// Sum of images, each times its weight, never below 0: interpolation across nodes may undershoot where there is
/// hardly any light.
pub fn weighted_sum(weights: &[f32], images: &[f32], job: &Job) -> Result<Vec<f32>> {
    let n = images.len() / weights.len().max(1);
    check("images", images.len(), n * weights.len())?;
    let mut sum = vec![0.0; n];
    job.chunks(&mut sum, PIXELS, |block, out| {
        lanes::run(
            #[inline(always)]
            || {
                let mut total = [0.0_f64; PIXELS];
                for (i, &weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                    let from = &images[i * n + block * PIXELS..][..out.len()];
                    for (t, &x) in total.iter_mut().zip(from) {
                        *t += f64::from(weight) * f64::from(x);
                    }
                }
                out.iter_mut().zip(total).for_each(|(o, t)| *o = t.max(0.0) as f32);
            },
        );
        Ok(())
    })?;
    Ok(sum)
}

/// `a q` for the images `a`, one row each.
fn times(a: &[f32], n: usize, q: &[Row], job: &Job) -> Result<Vec<Row>> {
    job.map(a.len() / n, |i| {
        Ok(lanes::run(
            #[inline(always)]
            || {
                let mut sum = [0.0; WIDTH];
                for (&x, row) in a[i * n..(i + 1) * n].iter().zip(q) {
                    let x = f64::from(x);
                    for c in 0..WIDTH {
                        sum[c] += x * row[c];
                    }
                }
                sum
            },
        ))
    })
}

/// `a^T y`, one row for each pixel.
fn transposed_times(a: &[f32], n: usize, y: &[Row], job: &Job) -> Result<Vec<Row>> {
    let mut out = vec![[0.0; WIDTH]; n];
    job.chunks(&mut out, PIXELS, |b, out| {
        lanes::run(
            #[inline(always)]
            || {
                for (i, row) in y.iter().enumerate() {
                    let row = *row;
                    for (sum, &x) in out.iter_mut().zip(&a[i * n + b * PIXELS..]) {
                        let x = f64::from(x);
                        for c in 0..WIDTH {
                            sum[c] += x * row[c];
                        }
                    }
                }
            },
        );
        Ok(())
    })?;
    Ok(out)
}

/// Make the columns of a tall matrix orthonormal: Cholesky's factor of their products, twice. A column that depends on
/// those before it becomes zero.
fn orthonormal(rows: &mut [Row], job: &Job) -> Result<()> {
    for _ in 0..2 {
        let parts = job.map(rows.len().div_ceil(ROWS), |k| {
            let mut gram = vec![[0.0; WIDTH]; WIDTH];
            lanes::run(
                #[inline(always)]
                || {
                    for row in &rows[k * ROWS..rows.len().min((k + 1) * ROWS)] {
                        for (a, sums) in row.iter().zip(&mut gram) {
                            for c in 0..WIDTH {
                                sums[c] += a * row[c];
                            }
                        }
                    }
                },
            );
            Ok(gram)
        })?;
        let mut gram = vec![[0.0; WIDTH]; WIDTH];
        for part in &parts {
            for (sums, part) in gram.iter_mut().zip(part) {
                for c in 0..WIDTH {
                    sums[c] += part[c];
                }
            }
        }
        let inverse = inverse(&cholesky(&gram));
        job.chunks(rows, ROWS, |_, rows| {
            lanes::run(
                #[inline(always)]
                || {
                    for row in rows {
                        let mut x = [0.0; WIDTH];
                        for (r, line) in row.iter().zip(&inverse) {
                            for c in 0..WIDTH {
                                x[c] += r * line[c];
                            }
                        }
                        *row = x;
                    }
                },
            );
            Ok(())
        })?;
    }
    Ok(())
}

/// The upper triangle `R` with `R^T R` the matrix; rows of dependent columns are zero.
fn cholesky(gram: &[Row]) -> Vec<Row> {
    let mut r = vec![[0.0; WIDTH]; WIDTH];
    for i in 0..WIDTH {
        let rest = gram[i][i] - (0..i).map(|k| r[k][i] * r[k][i]).sum::<f64>();
        if rest <= 1e-14 * gram[i][i] || rest <= 0.0 {
            continue;
        }
        let root = rest.sqrt();
        for j in i..WIDTH {
            let dot: f64 = (0..i).map(|k| r[k][i] * r[k][j]).sum();
            r[i][j] = (gram[i][j] - dot) / root;
        }
        r[i][i] = root;
    }
    r
}

/// The inverse of an upper triangle; zero rows give zero columns.
fn inverse(r: &[Row]) -> Vec<Row> {
    let mut out = vec![[0.0; WIDTH]; WIDTH];
    for c in (0..WIDTH).filter(|&c| r[c][c] > 0.0) {
        out[c][c] = 1.0 / r[c][c];
        for i in (0..c).rev().filter(|&i| r[i][i] > 0.0) {
            let dot: f64 = (i + 1..=c).map(|k| r[i][k] * out[k][c]).sum();
            out[i][c] = -dot / r[i][i];
        }
    }
    out
}

/// Singular value decomposition of a tall matrix: that of its triangular factor, turned.
fn tall_svd(rows: &[Row], job: &Job) -> Result<Svd> {
    let mut basis = rows.to_vec();
    orthonormal(&mut basis, job)?;
    let mut square = vec![[0.0; WIDTH]; WIDTH];
    for (q, row) in basis.iter().zip(rows) {
        for (q, sums) in q.iter().zip(&mut square) {
            for c in 0..WIDTH {
                sums[c] += q * row[c];
            }
        }
    }
    let (turns, strengths, right) = jacobi_svd(&square);
    let dot = |q: &Row, turn: &[f64]| q.iter().zip(turn).map(|(a, b)| a * b).sum::<f64>();
    let left = turns.iter().map(|turn| basis.iter().map(|q| dot(q, turn)).collect()).collect();
    Ok((left, strengths, right))
}

/// Singular value decomposition of a matrix by one-sided Jacobi rotations, strongest first: left vectors, singular
/// values, right vectors; left vectors of zero are zero.
fn jacobi_svd(rows: &[Row]) -> Svd {
    let mut columns: Vec<Vec<f64>> = (0..WIDTH).map(|c| rows.iter().map(|row| row[c]).collect()).collect();
    let mut right: Vec<Row> = (0..WIDTH).map(|c| std::array::from_fn(|k| f64::from(u8::from(k == c)))).collect();
    for _ in 0..SWEEPS {
        let mut still = true;
        for p in 0..WIDTH {
            for q in p + 1..WIDTH {
                let (low, high) = columns.split_at_mut(q);
                let (a, b) = (&mut low[p], &mut high[0]);
                let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
                for (x, y) in a.iter().zip(&*b) {
                    (aa, bb, ab) = (aa + x * x, bb + y * y, ab + x * y);
                }
                if ab.abs() <= ORTHOGONAL * (aa * bb).sqrt() || ab == 0.0 {
                    continue;
                }
                still = false;
                let zeta = (bb - aa) / (2.0 * ab);
                let t = 1.0_f64.copysign(zeta) / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let cos = 1.0 / (1.0 + t * t).sqrt();
                let sin = cos * t;
                let turn = |a: &mut f64, b: &mut f64| (*a, *b) = (cos * *a - sin * *b, sin * *a + cos * *b);
                a.iter_mut().zip(b.iter_mut()).for_each(|(a, b)| turn(a, b));
                let (low, high) = right.split_at_mut(q);
                low[p].iter_mut().zip(&mut high[0]).for_each(|(a, b)| turn(a, b));
            }
        }
        if still {
            break;
        }
    }
    let norm = |column: &Vec<f64>| column.iter().map(|x| x * x).sum::<f64>().sqrt();
    let norms: Vec<f64> = columns.iter().map(norm).collect();
    let mut order: Vec<usize> = (0..WIDTH).collect();
    order.sort_by(|&a, &b| norms[b].total_cmp(&norms[a]));
    for (column, &norm) in columns.iter_mut().zip(&norms) {
        let scale = if norm > 0.0 { 1.0 / norm } else { 0.0 };
        for x in column {
            *x *= scale;
        }
    }
    let left = order.iter().map(|&k| columns[k].clone()).collect();
    (left, order.iter().map(|&k| norms[k]).collect(), order.iter().map(|&k| right[k]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(count: usize, key: u64) -> Vec<f32> {
        let s = Stream::new(key, 7);
        (0..count).map(|i| s.uniform(i as u64) as f32 - 0.5).collect()
    }

    #[test]
    fn images_of_low_rank_come_back_and_a_polynomial_stays() {
        let (count, n) = (60, 150);
        let (left, right) = (random(count * 5, 1), random(5 * n, 2));
        let of = |i: usize, k: usize| (0..5).map(|r| left[i * 5 + r] * right[r * n + k]).sum::<f32>();
        let images: Vec<f32> = (0..count * n).map(|at| of(at / n, at % n)).collect();
        let light: Vec<f64> = (0..count).map(|i| 0.1 + i as f64).collect();
        let job = Job::serial();
        let f = factors(&images, &light, &job).expect("factored");
        assert_eq!(f.rank, RANK, "as many as are kept");
        let mut back = vec![0.0; images.len()];
        f.multiply(&mut back, &job).expect("multiplied");
        for (a, b) in images.iter().zip(&back) {
            assert!((a - b).abs() < 2e-6, "{a} and {b}");
        }
        let (g, sigma): ([f64; 7], [f64; 4]) = ([0.0, 0.3, 0.6, 0.8, 0.9, 0.95, 0.97], [0.01, 0.02, 0.05, 0.1]);
        let smooth = |j: usize, m: usize| 2.0 + g[j].atanh() * 0.3 + sigma[m].ln() * 0.1 + 0.05 * g[j].atanh().powi(5);
        let mut images: Vec<f32> = (0..28).flat_map(|at| [smooth(at / 4, at % 4) as f32; 70]).collect();
        let want = images.clone();
        let error: Vec<f64> = (0..28).map(|i| 0.01 * (1.0 + i as f64)).collect();
        fit_nodes(&mut images, &g, &sigma, &error, &job).expect("fitted");
        for (a, b) in want.iter().zip(&images) {
            assert!((a - b).abs() < 1e-5 * a.abs(), "{a} and {b}");
        }
    }
}

//! CMA-ES, the covariance matrix adaptation of Hansen and Ostermeier (2001) with the constants of Hansen's tutorial
//! (arXiv:1604.00772), in the unit box: the polish of a search whose objective is piecewise constant, because it looks
//! at ranks only. The covariance is used through its Cholesky factor; points outside the box are reflected into it.

use crate::math::random::Stream;

/// Individuals of a generation: Hansen's 4 + 3 ln d, and eight of few parameters.
pub fn population(dimension: usize) -> usize {
    (4 + (3.0 * (dimension.max(1) as f64).ln()) as usize).max(8)
}

/// It has come to rest when no direction is wider, as a fraction of the box.
const REST: f64 = 1e-12;

type Matrix = Vec<Vec<f64>>;

/// Lower factor of a symmetric matrix; `None` unless it is positive definite.
fn cholesky(c: &Matrix) -> Option<Matrix> {
    let d = c.len();
    let mut l = vec![vec![0.0; d]; d];
    for i in 0..d {
        for j in 0..=i {
            let sum = c[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i == j {
                if sum.is_nan() || sum <= 1e-30 {
                    return None;
                }
                l[i][i] = sum.sqrt();
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
    Some(l)
}

/// One normal deviate from two uniforms (Box and Muller).
fn normal(random: Stream, index: u64) -> f64 {
    let (u, v) = (random.uniform(2 * index), random.uniform(2 * index + 1));
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// The state of a run.
#[derive(Debug, Clone)]
pub struct Cma {
    mean: Vec<f64>,
    sigma: f64,
    covariance: Matrix,
    factor: Matrix,
    path: Vec<f64>,
    path_sigma: Vec<f64>,
    points: Vec<Vec<f64>>,
    generations: i32,
}

impl Cma {
    /// Begin where the `elite` is (best first): its first point and its covariance, enlarged until its mean deviation
    /// is at least `least`. Fewer than four points for each dimension say nothing of a covariance: then it is round. None
    /// when all of it is in one place, or there is nothing to move.
    pub fn new(elite: &[Vec<f64>], least: f64) -> Option<Self> {
        let first = elite.first()?;
        let (d, n) = (first.len(), elite.len() as f64);
        let centre: Vec<f64> = (0..d).map(|j| elite.iter().map(|x| x[j]).sum::<f64>() / n).collect();
        let covariance =
            |i: usize, j: usize| elite.iter().map(|x| (x[i] - centre[i]) * (x[j] - centre[j])).sum::<f64>() / n;
        let trace = (0..d).map(|i| covariance(i, i)).sum::<f64>();
        if d == 0 || trace <= 1e-18 {
            return None;
        }
        let size = (trace / d as f64).sqrt();
        // A few points may lie in a plane: a little of the unit matrix keeps every direction open.
        let (of_elite, of_unit) = if elite.len() < 4 * d { (0.0, 1.0) } else { (1.0, 1e-4) };
        let unit =
            |i: usize, j: usize| of_elite * covariance(i, j) / (size * size) + if i == j { of_unit } else { 0.0 };
        let covariance: Matrix = (0..d).map(|i| (0..d).map(|j| unit(i, j)).collect()).collect();
        let factor = cholesky(&covariance)?;
        Some(Self {
            mean: first.clone(),
            sigma: size.max(least),
            covariance,
            factor,
            path: vec![0.0; d],
            path_sigma: vec![0.0; d],
            points: Vec::new(),
            generations: 0,
        })
    }

    /// Draw the next generation from `random`.
    pub fn draw(&mut self, random: Stream) -> &[Vec<f64>] {
        let d = self.mean.len();
        self.points = (0..population(d))
            .map(|i| {
                let z: Vec<f64> = (0..d).map(|j| normal(random, (i * d + j) as u64)).collect();
                (0..d)
                    .map(|r| {
                        let y: f64 = (0..=r).map(|k| self.factor[r][k] * z[k]).sum();
                        let x = (self.mean[r] + self.sigma * y).abs();
                        (1.0 - (1.0 - x).abs()).clamp(0.0, 1.0)
                    })
                    .collect()
            })
            .collect();
        &self.points
    }

    /// Learn from the values of what was drawn (NaN counts as worst). False when the run has come to rest.
    pub fn learn(&mut self, values: &[f64]) -> bool {
        let d = self.mean.len();
        let n = d as f64;
        let (population, parents) = (population(d), population(d) / 2);
        let mut order: Vec<usize> = (0..population).collect();
        let rank = |i: usize| if values[i].is_nan() { f64::INFINITY } else { values[i] };
        order.sort_by(|&a, &b| rank(a).total_cmp(&rank(b)));
        let raw: Vec<f64> = (0..parents).map(|i| (parents as f64 + 0.5).ln() - (i as f64 + 1.0).ln()).collect();
        let total: f64 = raw.iter().sum();
        let weight: Vec<f64> = raw.iter().map(|w| w / total).collect();
        let effective = 1.0 / weight.iter().map(|w| w * w).sum::<f64>();
        let cc = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let cs = (effective + 2.0) / (n + effective + 5.0);
        let c1 = 2.0 / ((n + 1.3).powi(2) + effective);
        let cm = (1.0 - c1).min(2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0).powi(2) + effective));
        let damping = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + cs;
        let expected = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
        let steps: Vec<Vec<f64>> = order[..parents]
            .iter()
            .map(|&i| self.points[i].iter().zip(&self.mean).map(|(x, m)| (x - m) / self.sigma).collect())
            .collect();
        let step: Vec<f64> = (0..d).map(|j| (0..parents).map(|i| weight[i] * steps[i][j]).sum()).collect();
        // The step in the coordinates in which the distribution is round: factor * round = step.
        let mut round = vec![0.0; d];
        for r in 0..d {
            let known: f64 = (0..r).map(|k| self.factor[r][k] * round[k]).sum();
            round[r] = (step[r] - known) / self.factor[r][r];
        }
        self.generations += 1;
        let gain = (cs * (2.0 - cs) * effective).sqrt();
        for j in 0..d {
            self.mean[j] += self.sigma * step[j];
            self.path_sigma[j] = (1.0 - cs) * self.path_sigma[j] + gain * round[j];
        }
        let length = self.path_sigma.iter().map(|p| p * p).sum::<f64>().sqrt();
        let settled = (1.0 - (1.0 - cs).powi(2 * self.generations)).sqrt();
        let moving = length / settled < (1.4 + 2.0 / (n + 1.0)) * expected;
        let n_best = if moving { 0.0 } else { cc * (2.0 - cc) };
        for j in 0..d {
            let push = if moving { (cc * (2.0 - cc) * effective).sqrt() * step[j] } else { 0.0 };
            self.path[j] = (1.0 - cc) * self.path[j] + push;
        }
        for i in 0..d {
            for j in 0..d {
                let many: f64 = (0..parents).map(|k| weight[k] * steps[k][i] * steps[k][j]).sum();
                self.covariance[i][j] = (1.0 - c1 - cm + c1 * n_best) * self.covariance[i][j]
                    + c1 * self.path[i] * self.path[j]
                    + cm * many;
            }
        }
        self.sigma *= ((cs / damping) * (length / expected - 1.0)).min(1.0).exp();
        let widest = (0..d).map(|i| self.covariance[i][i]).fold(0.0, f64::max).sqrt() * self.sigma;
        match cholesky(&self.covariance) {
            Some(factor) if widest > REST && widest.is_finite() => {
                self.factor = factor;
                true
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(f: impl Fn(&[f64]) -> f64, generations: u64) -> f64 {
        let elite = vec![vec![0.2, 0.7, 0.6], vec![0.3, 0.5, 0.5], vec![0.25, 0.75, 0.4], vec![0.1, 0.6, 0.45]];
        let mut cma = Cma::new(&elite, 0.0).expect("has an extent");
        let mut best = f64::INFINITY;
        for g in 0..generations {
            let values: Vec<f64> = cma.draw(Stream::new(5, g)).iter().map(|x| f(x)).collect();
            best = values.iter().copied().fold(best, f64::min);
            if !cma.learn(&values) {
                break;
            }
        }
        best
    }

    #[test]
    fn it_follows_a_narrow_valley_and_stays_in_the_box() {
        let valley = |x: &[f64]| {
            assert!(x.iter().all(|v| (0.0..=1.0).contains(v)), "in the box");
            (x[0] + x[1] - 1.0).powi(2) + 1e-4 * (x[0] - 0.6).powi(2) + (x[2] - 0.3).powi(2)
        };
        let best = run(valley, 150);
        assert!(best < 1e-8, "bottom of the valley: {best}");
        let corner = |x: &[f64]| x.iter().sum::<f64>();
        assert!(run(corner, 150) < 1e-3, "a corner of the box");
    }

    #[test]
    fn it_rests_where_nothing_changes_and_refuses_a_point() {
        assert!(run(|_| f64::NAN, 400).is_infinite(), "NaN is never the best, and ends");
        assert!(Cma::new(&[vec![0.5, 0.5], vec![0.5, 0.5]], 0.0).is_none(), "no extent");
        assert!(Cma::new(&[vec![], vec![]], 0.0).is_none(), "nothing to move");
    }
}

//! NURBS surfaces: points and normals by Cox and de Boor's recursion (Piegl and Tiller, The NURBS Book, A2.2, A2.3,
//! A4.3).
//!
//! Judged by geomdl (rational) and scipy (not rational) in tests/oracles/test_geometry.py, to 1e-12 of the surface's
//! size. The normal is that of the derivatives, `S_u x S_v`; where they vanish or agree, as at a pole, it is the limit
//! from inside, 1e-7 of the parameters away (an error of the order of 1e-7 for a smooth surface).

use glam::{DVec3, DVec4};

use crate::error::{Error, Result, in_range};
use crate::job::Job;

/// Largest degree.
pub const MAX_DEGREE: usize = 15;
/// Places of a chunk of work.
const CHUNK: usize = 4096;
type Basis = [f64; MAX_DEGREE + 1];

/// Degree and knots in one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Degree.
    pub degree: usize,
    /// Knots, not descending; as many as points, and degree + 1 more.
    pub knots: Vec<f64>,
}

/// A rational B-spline surface.
#[derive(Debug, Clone)]
pub struct Nurbs {
    /// Control points times their weights, and the weights; `v` runs fastest.
    points: Vec<DVec4>,
    count: [usize; 2],
    directions: [Direction; 2],
}

impl Direction {
    fn validate(&self, name: &'static str, points: usize) -> Result<()> {
        let p = self.degree;
        in_range("degree", p as f64, 1.0, MAX_DEGREE as f64, "1")?;
        let wrong = |reason: String| Err(Error::Data { name, reason });
        if points <= p {
            return wrong(format!("degree {p} needs at least {} points, got {points}", p + 1));
        }
        let k = &self.knots;
        if k.len() != points + p + 1 {
            return wrong(format!("{points} points of degree {p} need {} knots, got {}", points + p + 1, k.len()));
        }
        if k.iter().any(|x| !x.is_finite()) || k.windows(2).any(|w| w[1] < w[0]) {
            return wrong("must be finite and not descending".into());
        }
        if k[points] <= k[p] {
            return wrong("span no parameters".into());
        }
        // A knot more often than degree + 1 times makes a point without influence and a span without a surface.
        if k.windows(p + 2).any(|w| w[0] == w[p + 1]) {
            return wrong(format!("a knot may come at most {} times", p + 1));
        }
        Ok(())
    }

    /// Parameter of a place in `[0, 1]`, and its span.
    fn span(&self, place: f64) -> (f64, usize) {
        let last = self.knots.len() - self.degree - 1;
        let (low, high) = (self.knots[self.degree], self.knots[last]);
        let u = (low * (1.0 - place) + high * place).clamp(low, high);
        let span = self.knots[..last].partition_point(|&k| k <= u) - 1;
        // The end belongs to the last span that is not empty.
        let end = self.knots[..last].partition_point(|&k| k < high) - 1;
        (u, span.clamp(self.degree, end))
    }

    /// Basis functions of a span and their derivatives by the place in `[0, 1]`.
    fn basis(&self, place: f64) -> (usize, Basis, Basis) {
        let (u, span) = self.span(place);
        let (p, k) = (self.degree, &self.knots);
        let (mut n, mut d): (Basis, Basis) = ([0.0; MAX_DEGREE + 1], [0.0; MAX_DEGREE + 1]);
        n[0] = 1.0;
        for degree in 1..=p {
            let before = n;
            let mut saved = 0.0;
            for r in 0..degree {
                let (right, left) = (k[span + r + 1], k[span + 1 + r - degree]);
                let weight = before[r] / (right - left);
                n[r] = saved + (right - u) * weight;
                saved = (u - left) * weight;
                if degree == p {
                    // N'_i = p (N_i / (k_{i+p} - k_i) - N_{i+1} / (k_{i+p+1} - k_{i+1})) of degree p - 1.
                    d[r] -= p as f64 * weight;
                    d[r + 1] += p as f64 * weight;
                }
            }
            n[degree] = saved;
        }
        let scale = k[k.len() - p - 1] - k[p];
        d = d.map(|x| x * scale);
        (span - p, n, d)
    }
}

impl Nurbs {
    /// A surface from control points `(count[0], count[1])`, their weights and both directions.
    pub fn new(points: &[DVec3], weights: &[f64], count: [usize; 2], directions: [Direction; 2]) -> Result<Self> {
        directions[0].validate("knots_u", count[0])?;
        directions[1].validate("knots_v", count[1])?;
        if points.len() != count[0] * count[1] || weights.len() != points.len() {
            return Err(Error::Shape {
                name: "weights",
                expected: format!("({}, {})", count[0], count[1]),
                got: format!("{} elements", weights.len()),
            });
        }
        if points.iter().any(|p| !p.is_finite()) {
            return Err(Error::Data { name: "points", reason: "must be finite".into() });
        }
        if weights.iter().any(|w| !(*w > 0.0 && w.is_finite())) {
            return Err(Error::Data { name: "weights", reason: "must be finite and above 0".into() });
        }
        let points = points.iter().zip(weights).map(|(p, &w)| (*p * w).extend(w)).collect();
        Ok(Self { points, count, directions })
    }

    /// Point and derivatives at a place in `[0, 1]^2`.
    pub fn derivatives(&self, u: f64, v: f64) -> [DVec3; 3] {
        let (first_u, nu, du) = self.directions[0].basis(u);
        let (first_v, nv, dv) = self.directions[1].basis(v);
        let mut sums = [DVec4::ZERO; 3];
        for i in 0..=self.directions[0].degree {
            let row = &self.points[(first_u + i) * self.count[1] + first_v..];
            let (mut across, mut along) = (DVec4::ZERO, DVec4::ZERO);
            for j in 0..=self.directions[1].degree {
                across += row[j] * nv[j];
                along += row[j] * dv[j];
            }
            sums[0] += across * nu[i];
            sums[1] += across * du[i];
            sums[2] += along * nu[i];
        }
        let [s, su, sv] = sums;
        let point = s.truncate() / s.w;
        [point, (su.truncate() - point * su.w) / s.w, (sv.truncate() - point * sv.w) / s.w]
    }

    /// Point and unit normal at a place in `[0, 1]^2`.
    pub fn at(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let [point, su, sv] = self.derivatives(u, v);
        let normal = |su: DVec3, sv: DVec3| {
            let size = su.abs().max_element().max(sv.abs().max_element());
            let cross = if size > 0.0 { (su / size).cross(sv / size) } else { DVec3::ZERO };
            (cross.length() > 1e-9).then(|| cross.normalize())
        };
        if let Some(n) = normal(su, sv) {
            return (point, n);
        }
        for inwards in [1e-7, 1e-5, 1e-3, 0.1] {
            let [_, su, sv] = self.derivatives(u + (0.5 - u) * inwards, v + (0.5 - v) * inwards);
            if let Some(n) = normal(su, sv) {
                return (point, n);
            }
        }
        // A line or a point has no normal.
        (point, DVec3::Z)
    }

    /// Points and normals at many places.
    pub fn evaluate(&self, places: &[[f64; 2]], job: &Job) -> Result<Vec<(DVec3, DVec3)>> {
        let mut out = vec![(DVec3::ZERO, DVec3::ZERO); places.len()];
        job.chunks(&mut out, CHUNK, |chunk, out| {
            for (&[u, v], out) in places[CHUNK * chunk..].iter().zip(out) {
                *out = self.at(u, v);
            }
            Ok(())
        })?;
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_of_a_cylinder_is_round() {
        let r = std::f64::consts::FRAC_1_SQRT_2;
        let arc = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let points: Vec<DVec3> = arc.iter().flat_map(|[x, y]| [0.0, 2.0].map(|z| DVec3::new(*x, *y, z))).collect();
        let weights = [1.0, 1.0, r, r, 1.0, 1.0];
        let directions = [
            Direction { degree: 2, knots: vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0] },
            Direction { degree: 1, knots: vec![0.0, 0.0, 1.0, 1.0] },
        ];
        let surface = Nurbs::new(&points, &weights, [3, 2], directions).expect("valid");
        for i in 0..=50 {
            let (p, n) = surface.at(f64::from(i) / 50.0, 0.3);
            let flat = DVec3::new(p.x, p.y, 0.0);
            assert!((flat.length() - 1.0).abs() < 1e-14 && (p.z - 0.6).abs() < 1e-14, "{p}");
            assert!((n - flat).length() < 1e-13, "{n} points away from the axis");
        }
    }
}

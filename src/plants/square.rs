//! The nearest square of a quadrilateral (corot paper, IV.3: the first face of a branch is forced planar and square).
//!
//! The corners are projected on the plane through their centroid that is perpendicular to the vector area, and read as
//! complex numbers `z_k`. The term `F1 = (1/4) sum z_k (-i)^k` of their discrete Fourier transform is a square, and by
//! Parseval the one nearest to them in the sum of squared distances. The centroid stays; a square stays as it is.

use glam::DVec3;

/// A square: centre, unit normal, and the arm from the centre to corner 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Square {
    /// Centroid of the quadrilateral.
    pub center: DVec3,
    /// Unit normal; the corners go round it counter-clockwise.
    pub normal: DVec3,
    /// From the centre to corner 0; the edge is `sqrt(2)` times its length.
    pub arm: DVec3,
}

impl Square {
    /// The square nearest to `quad`; none if the corners span no area or the square has no size.
    pub fn nearest(quad: [DVec3; 4]) -> Option<Self> {
        let center = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
        let arms = quad.map(|p| p - center);
        // Tiny and huge quadrilaterals are brought to size 1 first: squares of lengths leave the range of numbers.
        let size = arms.iter().fold(0.0_f64, |m, a| m.max(a.abs().max_element()));
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let arms = arms.map(|a| a / size);
        let area = (arms[2] - arms[0]).cross(arms[3] - arms[1]);
        if area.length() < 1e-12 {
            return None;
        }
        let normal = area.normalize();
        let flat = arms.map(|a| a - normal * a.dot(normal));
        // Multiplication by -i is a turn by -90 degrees about the normal.
        let turn = |v: DVec3, quarter: usize| match quarter {
            0 => v,
            1 => -normal.cross(v),
            2 => -v,
            _ => normal.cross(v),
        };
        let arm = (0..4).fold(DVec3::ZERO, |sum, k| sum + turn(flat[k], k)) * (0.25 * size);
        (arm.length() > 1e-9 * size).then_some(Self { center, normal, arm })
    }

    /// Corners, counter-clockwise about the normal.
    pub fn corners(&self) -> [DVec3; 4] {
        let side = self.normal.cross(self.arm);
        [self.center + self.arm, self.center + side, self.center - self.arm, self.center - side]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_its_own_nearest() {
        let quad = [[1.0, 2.0, 3.0], [3.0, 2.0, 3.0], [3.0, 4.0, 3.0], [1.0, 4.0, 3.0]].map(DVec3::from);
        let square = Square::nearest(quad).expect("has an area");
        for (a, b) in square.corners().iter().zip(quad) {
            assert!((*a - b).length() < 1e-14, "{a} against {b}");
        }
        assert!((square.normal - DVec3::Z).length() < 1e-15, "counter-clockwise from above");
    }

    #[test]
    fn a_rectangle_becomes_the_square_of_its_mean_side() {
        // By hand: F1 of a rectangle of sides a and b is a square of side (a + b) / 2.
        let quad = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 1.0, 0.0], [0.0, 1.0, 0.0]].map(DVec3::from);
        let c = Square::nearest(quad).expect("has an area").corners();
        for k in 0..4 {
            assert!(((c[k] - c[(k + 1) % 4]).length() - 2.5).abs() < 1e-14, "edge {k}");
        }
    }

    #[test]
    fn a_line_is_no_square() {
        assert_eq!(Square::nearest([0.0, 1.0, 2.0, 3.0].map(|x| DVec3::X * x)), None, "collinear");
        assert_eq!(Square::nearest([DVec3::ONE; 4]), None, "one point");
    }
}

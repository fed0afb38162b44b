//! Centripetal Catmull-Rom splines (floor 0): through every point, without loops or cusps between them.

use glam::DVec3;

/// The curve through `points` as a polyline with about `pieces` lines between neighbours. Points that repeat are one; a
/// single point stays one.
pub fn catmull_rom(points: &[DVec3], closed: bool, pieces: usize) -> Vec<DVec3> {
    let mut at: Vec<DVec3> = points.to_vec();
    at.dedup_by(|b, a| (*b - *a).length() < 1e-12);
    if closed && at.len() > 1 && (at[0] - at[at.len() - 1]).length() < 1e-12 {
        at.pop();
    }
    let n = at.len();
    if n < 2 {
        return at;
    }
    let closed = closed && n > 2;
    // Ends are continued by their mirror image.
    let point = |i: isize| {
        if closed {
            at[i.rem_euclid(n as isize) as usize]
        } else if i < 0 {
            at[0] * 2.0 - at[1]
        } else if i as usize >= n {
            at[n - 1] * 2.0 - at[n - 2]
        } else {
            at[i as usize]
        }
    };
    let spans = if closed { n } else { n - 1 };
    let mut out = vec![at[0]];
    for i in 0..spans as isize {
        let p = [point(i - 1), point(i), point(i + 1), point(i + 2)];
        let t = [0, 1, 2].map(|k: usize| (p[k + 1] - p[k]).length().sqrt());
        // Barry and Goldman's pyramid with knots at the square roots of the distances.
        let knots = [-t[0], 0.0, t[1], t[1] + t[2]];
        for k in 1..=pieces {
            let x = t[1] * k as f64 / pieces as f64;
            let blend = |a: DVec3, b: DVec3, i: usize, j: usize| a + (b - a) * ((x - knots[i]) / (knots[j] - knots[i]));
            let (a, b, c) = (blend(p[0], p[1], 0, 1), blend(p[1], p[2], 1, 2), blend(p[2], p[3], 2, 3));
            let (d, e) = (blend(a, b, 0, 2), blend(b, c, 1, 3));
            out.push(blend(d, e, 1, 2));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_meets_its_points_and_keeps_straight_lines() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::new(3.0, 0.0, 0.0), DVec3::new(4.0, 0.0, 0.0)];
        let curve = catmull_rom(&points, false, 8);
        assert_eq!(curve.len(), 25, "8 lines for each of 3 spans");
        for (i, p) in points.iter().enumerate() {
            assert!((curve[8 * i] - *p).length() < 1e-12, "point {i}");
        }
        assert!(curve.iter().all(|p| p.y == 0.0 && p.z == 0.0), "a line stays a line");
        assert!(curve.windows(2).all(|w| w[1].x > w[0].x), "and is not run through twice");
    }

    #[test]
    fn degenerate_curves() {
        assert_eq!(catmull_rom(&[DVec3::X], true, 8), vec![DVec3::X], "one point");
        assert_eq!(catmull_rom(&[DVec3::X; 3], false, 8), vec![DVec3::X], "one point thrice");
        let ring = [DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y, DVec3::X];
        let curve = catmull_rom(&ring, true, 16);
        assert!((curve[0] - curve[curve.len() - 1]).length() < 1e-12, "closed");
        // By hand: the middle between two points is (10 X + 10 Y) / 16.
        assert!((curve[8] - DVec3::new(0.625, 0.625, 0.0)).length() < 1e-12, "middle of the first piece");
        assert!(catmull_rom(&[], false, 8).is_empty(), "nothing");
    }
}

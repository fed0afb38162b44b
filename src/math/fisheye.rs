//! Fisheye cameras, equidistant and equal-area (equisolid) (floor 0): a whole hemisphere, or sphere, in a circle.
//!
//! The angle from the axis goes with the distance from the middle (equidistant), or its half's sine does, so that equal
//! areas are equal solid angles. Outside the circle there is nothing.

use glam::DVec3;

use crate::error::{Error, Result, in_range};

/// A fisheye camera: row 0 at the top, the circle as wide as the shorter side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fisheye {
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Unit vector along the axis.
    pub forward: DVec3,
    /// Half of the field of view \[rad\].
    pub half: f64,
    /// Whether equal areas are equal solid angles.
    pub equal_area: bool,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Fisheye {
    /// Refuse a camera that cannot make a picture.
    pub fn validate(&self) -> Result<()> {
        in_range("fov", 2.0 * self.half, 1e-6, std::f64::consts::TAU, "rad")?;
        if self.width == 0 || self.height == 0 {
            return Err(Error::Empty { name: "camera" });
        }
        Ok(())
    }

    /// Pixels from the middle to the rim.
    pub fn radius(&self) -> f64 {
        0.5 * self.width.min(self.height) as f64
    }

    /// Whether a place of the picture is within the circle.
    pub fn inside(&self, x: f64, y: f64) -> bool {
        // Of centres and corners of pixels all of this is exact.
        let (u, v) = (x - 0.5 * self.width as f64, 0.5 * self.height as f64 - y);
        u * u + v * v <= self.radius() * self.radius()
    }

    /// Unit direction through a place of the picture, pixel edges at integers; none outside the circle.
    pub fn through(&self, x: f64, y: f64) -> Option<DVec3> {
        let (u, v) = ((x - 0.5 * self.width as f64) / self.radius(), (0.5 * self.height as f64 - y) / self.radius());
        if !self.inside(x, y) {
            return None;
        }
        let away = u.hypot(v).min(1.0);
        let angle = if self.equal_area { 2.0 * (away * (0.5 * self.half).sin()).asin() } else { away * self.half };
        let aside = if away > 0.0 { angle.sin() / away } else { 0.0 };
        Some((self.forward * angle.cos() + (self.right * u + self.up * v) * aside).normalize())
    }

    /// Where a direction meets the picture or lies outside it.
    pub fn project(&self, to: DVec3) -> [f64; 2] {
        let (u, v) = (to.dot(self.right), to.dot(self.up));
        let flat = u.hypot(v);
        let angle = flat.atan2(to.dot(self.forward));
        let away = if self.equal_area { (0.5 * angle).sin() / (0.5 * self.half).sin() } else { angle / self.half };
        let scale = if flat > 0.0 { self.radius() * away / flat } else { 0.0 };
        [0.5 * self.width as f64 + u * scale, 0.5 * self.height as f64 - v * scale]
    }
}

/// Sine of half the angle over the distance from the middle, for a distance and half the half field of view: what a
/// block of pixels needs of the equidistant projection.
#[inline(always)]
pub fn half_sine(away: f32, quarter: f32) -> f32 {
    let a = away * quarter;
    let w = a * a;
    let mut sum = 1.0 / 6_227_020_800.0_f32;
    sum = sum * w - 1.0 / 39_916_800.0;
    sum = sum * w + 1.0 / 362_880.0;
    sum = sum * w - 1.0 / 5040.0;
    sum = sum * w + 1.0 / 120.0;
    sum = sum * w - 1.0 / 6.0;
    sum = sum * w + 1.0;
    quarter * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_directions_are_inverse_and_areas_equal() {
        for equal_area in [false, true] {
            for half in [0.3, std::f64::consts::FRAC_PI_2, 3.0] {
                let eye = Fisheye {
                    right: DVec3::X,
                    up: DVec3::Y,
                    forward: -DVec3::Z,
                    half,
                    equal_area,
                    width: 90,
                    height: 60,
                };
                let angle = |t: f64| eye.through(45.0 + 30.0 * t, 30.0).expect("inside").angle_between(-DVec3::Z);
                for t in [0.0, 0.31, 0.77, 1.0] {
                    let to = eye.through(45.0 + 20.0 * t, 30.0 - 20.0 * t).expect("inside");
                    let [x, y] = eye.project(to);
                    assert!((x - 45.0 - 20.0 * t).abs() < 1e-9 && (y - 30.0 + 20.0 * t).abs() < 1e-9, "{x} {y}");
                    // Equidistant: the angle; equal-area: the cap, 2 pi (1 - cos).
                    let (got, whole) =
                        if equal_area { (1.0 - angle(t).cos(), 1.0 - half.cos()) } else { (angle(t), half) };
                    let want = if equal_area { t * t } else { t };
                    assert!((got / whole - want).abs() < 1e-9, "{t}: {got}");
                }
                assert!(eye.through(0.0, 0.0).is_none(), "outside the circle");
                for i in 0..=100 {
                    let t = f64::from(i) / 100.0;
                    let got = f64::from(half_sine(t as f32, (0.5 * half) as f32)) * t;
                    assert!((got - (0.5 * half * t).sin()).abs() < 2e-7, "{t}: {got}");
                }
            }
        }
    }
}

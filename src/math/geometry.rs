//! Rays, boxes (slab test) and the pinhole camera; directions of azimuth and elevation (floor 0).
//!
//! Right-handed, x east, y north, z up; azimuth from north over east. Units: metres and radians; all in `f64`.

use glam::DVec3;

use crate::error::{Error, Result, in_range};

/// One arcsecond \[rad\].
pub const ARCSECOND: f64 = std::f64::consts::TAU / 1_296_000.0;

/// A perspective camera: row 0 at the top, pixel centres at half-integers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pinhole {
    /// Eye \[m\].
    pub position: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Unit vector through the centre of the picture.
    pub forward: DVec3,
    /// Tangent of half the vertical field of view \[1\].
    pub half_tan: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Pinhole {
    /// A camera from angles in radians: azimuth clockwise from north (y), elevation above the horizon, roll clockwise
    /// as seen by the viewer, vertical field of view.
    pub fn new(
        position: DVec3,
        [azimuth, elevation, roll, fov]: [f64; 4],
        [width, height]: [usize; 2],
    ) -> Result<Self> {
        in_range("fov", fov, 1e-6, 179.5_f64.to_radians(), "rad")?;
        let forward = direction(azimuth, elevation);
        let level = DVec3::new(azimuth.cos(), -azimuth.sin(), 0.0);
        let upright = level.cross(forward);
        let (sin, cos) = roll.sin_cos();
        let camera = Self {
            position,
            right: level * cos - upright * sin,
            up: upright * cos + level * sin,
            forward,
            half_tan: (0.5 * fov).tan(),
            width,
            height,
        };
        camera.validate()?;
        Ok(camera)
    }

    /// Refuse a camera that cannot make a picture.
    pub fn validate(&self) -> Result<()> {
        let finite = self.position.is_finite() && self.forward.is_finite() && self.half_tan.is_finite();
        if !finite || self.half_tan <= 0.0 {
            return Err(Error::Data { name: "camera", reason: "position, direction and fov must be finite".into() });
        }
        if self.width == 0 || self.height == 0 {
            return Err(Error::Empty { name: "camera" });
        }
        Ok(())
    }

    /// Unit direction through the centre of pixel `(x, y)`.
    pub fn direction(&self, x: usize, y: usize) -> DVec3 {
        self.through(x as f64 + 0.5, y as f64 + 0.5)
    }

    /// Unit direction through a place of the picture, pixel edges at integers.
    pub fn through(&self, x: f64, y: f64) -> DVec3 {
        let scale = 2.0 * self.half_tan / self.height as f64;
        let u = (x - 0.5 * self.width as f64) * scale;
        let v = (0.5 * self.height as f64 - y) * scale;
        (self.forward + self.right * u + self.up * v).normalize()
    }

    /// Where a direction meets the plane of the picture; none behind the eye.
    pub fn project(&self, to: DVec3) -> Option<[f64; 2]> {
        let depth = to.dot(self.forward);
        if depth <= 0.0 {
            return None;
        }
        let scale = 0.5 * self.height as f64 / (self.half_tan * depth);
        let [x, y] = [to.dot(self.right) * scale, to.dot(self.up) * scale];
        Some([0.5 * self.width as f64 + x, 0.5 * self.height as f64 - y])
    }
}

/// Unit vector at `azimuth` clockwise from north (y) and `elevation` above the horizon \[rad\].
pub fn direction(azimuth: f64, elevation: f64) -> DVec3 {
    let (sin, cos) = azimuth.sin_cos();
    let (up, flat) = elevation.sin_cos();
    DVec3::new(sin * flat, cos * flat, up)
}

/// Angle between two unit vectors of which the square of the distance is known \[rad\], to 6e-7 over the cosine of its
/// half: no cancellation near 0, no arc cosine of more than 1. By a polynomial (Abramowitz and Stegun 4.4.46) that runs
/// in SIMD.
#[inline(always)]
pub fn angle(square: f32) -> f32 {
    let x = 0.5 * square.sqrt();
    let x = if x < 1.0 { x } else { 1.0 };
    // Small angles keep their digits by the series.
    let small = x * (1.0 + x * x * (1.0 / 6.0 + x * x * (3.0 / 40.0 + x * x * (15.0 / 336.0))));
    let mut p = -0.001_262_491_1_f32;
    p = p * x + 0.006_670_090_1;
    p = p * x - 0.017_088_125_6;
    p = p * x + 0.030_891_881_0;
    p = p * x - 0.050_174_304_6;
    p = p * x + 0.088_978_987_4;
    p = p * x - 0.214_598_801_6;
    p = p * x + 1.570_796_305_0;
    2.0 * if x < 0.18 { small } else { std::f32::consts::FRAC_PI_2 - (1.0 - x).sqrt() * p }
}

/// Parameters `(enter, leave)` of the ray `origin + t direction`, `t >= 0`, in the box `low..high`; `None` if it
/// misses. A ray inside a face's plane counts as a miss, so a grazing ray never sees a part of zero thickness.
pub fn clip_to_box(origin: DVec3, direction: DVec3, low: DVec3, high: DVec3) -> Option<(f64, f64)> {
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let (o, d, lo, hi) = (origin[axis], direction[axis], low[axis], high[axis]);
        if d == 0.0 {
            if o <= lo || o >= hi {
                return None;
            }
        } else {
            let (a, b) = ((lo - o) / d, (hi - o) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
    }
    (enter < leave).then_some((enter, leave))
}

/// Projections of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// A pinhole's.
    Perspective,
    /// A fisheye whose distances from the middle are angles.
    Equidistant,
    /// A fisheye whose areas are solid angles.
    EqualArea,
    /// Equirectangular, all around.
    Panorama,
}

impl Projection {
    /// The projection of this name.
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "perspective" => Ok(Self::Perspective),
            "equidistant" => Ok(Self::Equidistant),
            "equal_area" => Ok(Self::EqualArea),
            "panorama" => Ok(Self::Panorama),
            other => Err(Error::Data { name: "projection", reason: format!("is unknown: {other:?}") }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_from_chords() {
        for i in 0..=20_000 {
            let want = std::f64::consts::PI * f64::from(i) / 20_000.0;
            let chord = (2.0 * (0.5 * want).sin()).powi(2) as f32;
            let exact = 2.0 * (0.5 * f64::from(chord).sqrt()).min(1.0).asin();
            // Of a chord near the diameter the angle is not known better.
            let bound = 6e-7 / (0.5 * exact).cos().max(6e-4);
            assert!((f64::from(angle(chord)) - exact).abs() < bound, "{exact}: {}", angle(chord));
        }
        assert_eq!(angle(0.0), 0.0, "the same");
        assert!(angle(4.1).is_finite(), "rounded beyond the opposite");
    }

    #[test]
    fn the_centre_of_the_picture_looks_forward() {
        let camera = Pinhole {
            position: DVec3::ZERO,
            right: DVec3::X,
            up: DVec3::Z,
            forward: DVec3::Y,
            half_tan: 1.0,
            width: 3,
            height: 3,
        };
        assert_eq!(camera.direction(1, 1), DVec3::Y, "centre pixel");
        let corner = camera.direction(0, 0);
        assert!(corner.x < 0.0 && corner.z > 0.0, "pixel (0, 0) is the top left");
    }

    #[test]
    fn angles_are_those_of_the_compass() {
        let camera = |azimuth: f64, elevation: f64, roll: f64| {
            let angles = [azimuth, elevation, roll, 60.0].map(f64::to_radians);
            Pinhole::new(DVec3::ZERO, angles, [5, 5]).expect("valid")
        };
        let close = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} against {b}");
        let east = camera(90.0, 0.0, 0.0);
        close(east.forward, DVec3::X);
        close(east.right, DVec3::NEG_Y);
        close(east.up, DVec3::Z);
        let zenith = camera(0.0, 90.0, 0.0);
        close(zenith.forward, DVec3::Z);
        close(zenith.right, DVec3::X);
        // Rolled clockwise, the viewer's top points to where the right was.
        close(camera(90.0, 0.0, 90.0).up, DVec3::NEG_Y);
        let c = camera(33.0, 12.0, 40.0);
        close(c.right.cross(c.forward), c.up);
    }

    #[test]
    fn a_box_is_entered_and_left() {
        let (lo, hi) = (DVec3::ZERO, DVec3::splat(2.0));
        assert_eq!(clip_to_box(DVec3::new(-1.0, 1.0, 1.0), DVec3::X, lo, hi), Some((1.0, 3.0)), "through");
        assert_eq!(clip_to_box(DVec3::ONE, DVec3::X, lo, hi), Some((0.0, 1.0)), "from inside");
        assert_eq!(clip_to_box(DVec3::new(3.0, 1.0, 1.0), DVec3::X, lo, hi), None, "behind");
        assert_eq!(clip_to_box(DVec3::new(-1.0, 2.0, 1.0), DVec3::X, lo, hi), None, "in a face's plane");
    }
}

//! The Moon's face: its axes and optical libration, a map of its maria, and the Earth's shadow across it (floor 1).
//!
//! Libration by Cassini's laws (Meeus, Astronomical Algorithms, ch. 53): the axis stands 1.54242 degrees off the pole of
//! the ecliptic, its equator meets the ecliptic at the node of the orbit, and it turns with its mean argument of
//! latitude. As seen from the place, not from the Earth's centre. The physical libration, below 0.04 degrees, is left
//! out.
//!
//! Maria: albedo over that of the highlands by 2 degrees, bilinear; a map by Clementine and the USGS (`tables/SOURCES.md`)
//! at the contrast of maria to highlands, 0.54. The whole light of the disc is that of the phase law all the same.
//!
//! The Earth's shadow: what a point of the disc has of the Sun beside an Earth that is 1 % larger for its air (Danjon);
//! the Sun's limb is as bright as its middle.
//!
//! Units: radians. Error: 0.03 degrees, held by `libration_of_meeus` (moon.rs).

use std::f64::consts::PI;

use glam::{DMat3, DVec2, DVec3};

use crate::astro::frames::{FrameOfDate, Site, polynomial};
use crate::astro::tables::MARIA;

/// Inclination of the equator to the ecliptic \[rad\].
const INCLINATION: f64 = 1.542_42 * PI / 180.0;
/// Of the map: step and the longitude of its edge \[deg\], rows and columns.
const STEP: f64 = 2.0;
const EDGE: f64 = 100.0;
const ROWS: usize = 91;
const COLUMNS: usize = 101;
/// Mean radius of the Earth and of the Sun \[km\], and what the first is larger by for its air.
const EARTH: f64 = 6371.0;
const SUN: f64 = 696_000.0;
const DANJON: f64 = 1.01;

/// Columns: where the prime meridian meets the equator, its east, the north pole; on the true equator and equinox.
pub fn axes(frame: &FrameOfDate) -> DMat3 {
    let t = frame.instant.centuries;
    let degrees = |c: &[f64]| polynomial(t, c).rem_euclid(360.0).to_radians();
    let node = degrees(&[125.044_547_9, -1_934.136_289_1, 0.002_075_4, 1.0 / 467_441.0, -1.0 / 60_616_000.0]);
    let latitude = degrees(&[93.272_095_0, 483_202.017_523_3, -0.003_653_9, -1.0 / 3_526_000.0, 1.0 / 863_310_000.0]);
    DMat3::from_rotation_x(frame.obliquity)
        * DMat3::from_rotation_z(node + frame.nutation)
        * DMat3::from_rotation_x(-INCLINATION)
        * DMat3::from_rotation_z(latitude + PI)
}

/// Selenographic longitude and latitude of the point that is seen from a direction, from `towards` the Moon \[rad\].
pub fn libration(axes: &DMat3, towards: DVec3) -> [f64; 2] {
    let from = axes.transpose() * -towards;
    [from.y.atan2(from.x), from.z.clamp(-1.0, 1.0).asin()]
}

/// The axes of [`axes`] of a Moon that is seen `to` a direction, with this libration, its north pole turned from `up`
/// towards the left of who faces it \[rad\].
pub fn seen_axes(to: DVec3, up: DVec3, [longitude, latitude]: [f64; 2], turn: f64) -> DMat3 {
    let (sin, cos) = turn.sin_cos();
    let north = up * cos + up.cross(to) * sin;
    let (sin, cos) = latitude.sin_cos();
    let (pole, out) = (north * cos - to * sin, -to * cos - north * sin);
    let aside = pole.cross(out);
    let (sin, cos) = longitude.sin_cos();
    DMat3::from_cols(out * cos - aside * sin, out * sin + aside * cos, pole)
}

/// Albedo over that of the highlands at a unit vector in the axes of [`axes`].
pub fn albedo(at: DVec3) -> f64 {
    let along = at.y.atan2(at.x).to_degrees();
    let up = at.z.clamp(-1.0, 1.0).asin().to_degrees();
    let place = |x: f64, count: usize| {
        let x = x.clamp(0.0, (count - 1) as f64);
        let i = (x as usize).min(count - 2);
        (i, x - i as f64)
    };
    let ((i, u), (j, v)) = (place((along + EDGE) / STEP, COLUMNS), place((up + 90.0) / STEP, ROWS));
    let map = |j: usize, i: usize| f64::from(MARIA[j * COLUMNS + i]);
    let row = |j: usize| map(j, i) + u * (map(j, i + 1) - map(j, i));
    (row(j) + v * (row(j + 1) - row(j))) / 128.0
}

/// The Earth's shadow on the disc of the Moon; lengths in the Moon's radii.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EarthShadow {
    /// From the disc's middle to the shadow's, in the axes of the place.
    pub middle: DVec3,
    /// Radius of the Earth, from where it would hide a point of a Sun.
    pub earth: f64,
    /// Radius of the Sun.
    pub sun: f64,
}

impl EarthShadow {
    /// From where Sun and Moon are, from the centre of the Earth \[km\], and the Moon's angular radius, on the disc that a
    /// place sees.
    pub fn new([sun, moon]: [DVec3; 2], radius: f64, site: &Site) -> Self {
        let (away, far) = (moon.length(), sun.length());
        let (to, axis) = (moon / away, -sun / far);
        Self {
            middle: site.to_local * (axis - to * axis.dot(to)) / radius,
            earth: (DANJON * (EARTH / away).asin() + EARTH / far) / radius,
            sun: SUN / far / radius,
        }
    }

    /// Share of the Sun that is hidden from a point of the disc, given from its middle.
    pub fn taken(&self, aside: DVec3) -> f64 {
        taken(self.earth, self.sun, (aside - self.middle).length())
    }

    /// Share of the Sun's light on the disc that the Earth takes: the mean over 288 points of equal areas.
    pub fn share(&self) -> f64 {
        let apart = self.middle.length();
        if apart > self.earth + self.sun + 1.0 {
            return 0.0;
        }
        let point = |i: usize, k: usize| {
            let r = ((i as f64 + 0.5) / 12.0).sqrt();
            let turn = (k as f64 + 0.5) / 24.0 * PI;
            taken(self.earth, self.sun, (DVec2::from_angle(turn) * r + DVec2::new(apart, 0.0)).length())
        };
        let sum: f64 = (0..12).map(|i| (0..24).map(|k| point(i, k)).sum::<f64>()).sum();
        (sum / 288.0).clamp(0.0, 1.0)
    }
}

/// Share of a disc of radius `sun` that one of radius `earth` hides, their middles `apart`.
fn taken(earth: f64, sun: f64, apart: f64) -> f64 {
    if apart >= earth + sun {
        return 0.0;
    }
    if apart <= earth - sun {
        return 1.0;
    }
    let angle = |r: f64, s: f64| ((apart * apart + r * r - s * s) / (2.0 * apart * r)).clamp(-1.0, 1.0).acos();
    let (p, q) = (angle(sun, earth), angle(earth, sun));
    let lens = sun * sun * (p - p.sin() * p.cos()) + earth * earth * (q - q.sin() * q.cos());
    lens / (PI * sun * sun)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maria_lie_where_they_are() {
        let at = |latitude: f64, longitude: f64| {
            let ((up, flat), (sin, cos)) = (latitude.to_radians().sin_cos(), longitude.to_radians().sin_cos());
            albedo(DVec3::new(flat * cos, flat * sin, up))
        };
        // Maria Crisium, Serenitatis, Imbrium, Humorum, Nectaris (IAU's gazetteer) against the southern highlands.
        for (latitude, longitude) in [(16.2, 59.1), (27.3, 18.4), (34.7, -14.9), (-24.5, -38.6), (-15.2, 34.6)] {
            assert!(at(latitude, longitude) < 0.72, "{latitude} {longitude}: {}", at(latitude, longitude));
        }
        for (latitude, longitude) in [(-45.0, 5.0), (-35.0, 20.0), (-60.0, -10.0)] {
            assert!(at(latitude, longitude) > 0.85, "{latitude} {longitude}: {}", at(latitude, longitude));
        }
        assert!((at(90.0, 0.0) - at(90.0, 77.0)).abs() < 1e-12, "a pole has one albedo");
        for wild in [DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z, DVec3::new(-0.5, 1e-300, 0.8)] {
            assert!(albedo(wild) > 0.3, "{wild}");
        }
    }
}

//! Celestial frames: precession, nutation, sidereal time, horizon coordinates, parallax (floor 1).
//!
//! Sources: precession and obliquity IAU 2006 in the angles of Fukushima and Williams (Capitaine et al., Astronomy and
//! Astrophysics 412, 567, 2003, with the frame bias); nutation IAU 1980 in its 35 largest terms (Meeus, Astronomical
//! Algorithms, ch. 22); sidereal time IAU 2006; ellipsoid WGS 84; refraction by refraction.rs. Polar motion
//! (0.3") is left out.
//!
//! Units: radians, kilometres; directions x east, y north, z up. Error: 0.6" for a star against astropy (`test_stars`),
//! 4" for the Sun from a place (`test_from_a_place`): the rotation of the Earth in years of no measurement. Cost:
//! 1 µs for a frame.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use crate::astro::refraction::Refraction;
use crate::astro::tables::nutation::NUTATION;
use crate::astro::time::Instant;
use crate::error::{Result, in_range};
use crate::math::geometry::ARCSECOND;

/// The astronomical unit \[km\].
pub const AU: f64 = 149_597_870.7;
/// The speed of light \[km/s\].
pub const LIGHT: f64 = 299_792.458;
/// Semi-major axis of WGS 84 \[km\].
const EQUATOR: f64 = 6378.137;
/// Flattening of WGS 84.
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Rotation of the Earth \[rad/s\].
const SPIN: f64 = 7.292_115e-5;

/// A polynomial, lowest power first.
pub(crate) fn polynomial(t: f64, coefficients: &[f64]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// The axes of a date.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameOfDate {
    /// The instant.
    pub instant: Instant,
    /// Nutation in longitude \[rad\].
    pub nutation: f64,
    /// True obliquity of the ecliptic \[rad\].
    pub obliquity: f64,
    /// Apparent sidereal time of Greenwich in `[0, 2 pi)` \[rad\].
    pub sidereal: f64,
    /// From the ICRS to the true equator and equinox.
    pub from_icrs: DMat3,
}

impl FrameOfDate {
    /// The axes at an instant.
    pub fn new(instant: Instant) -> Self {
        let t = instant.centuries;
        let (nutation, tilt, node) = nutation(t);
        let arc = |c: &[f64]| polynomial(t, c) * ARCSECOND;
        let mean = arc(&[84_381.406, -46.836_769, -1.831e-4, 0.002_003_40, -5.76e-7, -4.34e-8]);
        let obliquity = mean + tilt;
        // Fukushima-Williams angles.
        let gamma = arc(&[-0.052_928, 10.556_378, 0.493_204_4, -3.1238e-4, -2.788e-6, 2.6e-8]);
        let phi = arc(&[84_381.412_819, -46.811_016, 0.051_126_8, 5.3289e-4, -4.4e-7, -1.76e-8]);
        let psi = arc(&[-0.041_775, 5_038.481_484, 1.558_417_5, -1.8522e-4, -2.6452e-5, -1.48e-8]);
        let from_icrs = DMat3::from_rotation_x(obliquity)
            * DMat3::from_rotation_z(psi + nutation)
            * DMat3::from_rotation_x(-phi)
            * DMat3::from_rotation_z(-gamma);
        let equinoxes = nutation * mean.cos() + ARCSECOND * (0.002_64 * node.sin() + 0.000_063 * (2.0 * node).sin());
        let sidereal = (mean_sidereal(instant) + equinoxes).rem_euclid(TAU);
        Self { instant, nutation, obliquity, sidereal, from_icrs }
    }

    /// From true ecliptic longitude and latitude to a unit vector on the true equator.
    pub fn from_ecliptic(&self, longitude: f64, latitude: f64) -> DVec3 {
        let (sin, cos) = longitude.sin_cos();
        let (up, flat) = latitude.sin_cos();
        DMat3::from_rotation_x(self.obliquity) * DVec3::new(cos * flat, sin * flat, up)
    }
}

/// Mean sidereal time of Greenwich (IAU 2006) \[rad\].
pub fn mean_sidereal(instant: Instant) -> f64 {
    let t = instant.centuries;
    let precession = polynomial(t, &[0.014_506, 4_612.156_534, 1.391_581_7, -4.4e-7, -2.9956e-5, -3.68e-8]);
    (instant.rotation() + precession * ARCSECOND).rem_euclid(TAU)
}

/// Nutation in longitude and in obliquity, and the mean longitude of the Moon's node \[rad\].
pub fn nutation(t: f64) -> (f64, f64, f64) {
    let degrees = |c: &[f64]| polynomial(t, c).rem_euclid(360.0).to_radians();
    let arguments = [
        degrees(&[297.850_36, 445_267.111_480, -0.001_914_2, 1.0 / 189_474.0]),
        degrees(&[357.527_72, 35_999.050_340, -0.000_160_3, -1.0 / 300_000.0]),
        degrees(&[134.962_98, 477_198.867_398, 0.008_697_2, 1.0 / 56_250.0]),
        degrees(&[93.271_91, 483_202.017_538, -0.003_682_5, 1.0 / 327_270.0]),
        degrees(&[125.044_52, -1_934.136_261, 0.002_070_8, 1.0 / 450_000.0]),
    ];
    let (mut longitude, mut obliquity) = (0.0, 0.0);
    for (multiples, [psi, psi_rate, eps, eps_rate]) in &NUTATION {
        let angle: f64 = multiples.iter().zip(arguments).map(|(&k, a)| f64::from(k) * a).sum();
        let (sin, cos) = angle.sin_cos();
        longitude += (psi + psi_rate * t) * sin;
        obliquity += (eps + eps_rate * t) * cos;
    }
    (longitude * 1e-4 * ARCSECOND, obliquity * 1e-4 * ARCSECOND, arguments[4])
}

/// Something in the sky of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Unit vector: x east, y north, z up.
    pub direction: DVec3,
    /// Above the horizon \[rad\].
    pub elevation: f64,
    /// Clockwise from north in `[0, 2 pi)` \[rad\].
    pub azimuth: f64,
    /// From the observer \[km\].
    pub distance: f64,
}

/// A place, turned with the Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Rows east, north, up on the true equator and equinox, as columns of the transpose.
    pub to_local: DMat3,
    /// From the centre of the Earth, on the true equator and equinox \[km\].
    pub position: DVec3,
    /// Velocity in units of that of light: aberration of the day.
    pub velocity: DVec3,
    /// Local apparent sidereal time in `[0, 2 pi)` \[rad\].
    pub sidereal: f64,
    /// Altitude above the ellipsoid \[m\].
    pub altitude: f64,
}

impl Site {
    /// The place at latitude, longitude \[rad\] and altitude above the ellipsoid \[m\].
    pub fn new(frame: &FrameOfDate, [latitude, longitude, altitude]: [f64; 3]) -> Result<Self> {
        in_range("latitude", latitude, -0.25 * TAU, 0.25 * TAU, "rad")?;
        in_range("longitude", longitude, -1e6, 1e6, "rad")?;
        in_range("altitude", altitude, -1000.0, 100_000.0, "m")?;
        let sidereal = (frame.sidereal + longitude).rem_euclid(TAU) % TAU;
        let (sin_t, cos_t) = sidereal.sin_cos();
        let (sin, cos) = latitude.sin_cos();
        let polar = (1.0 - FLATTENING) * (1.0 - FLATTENING);
        let normal = EQUATOR / (cos * cos + polar * sin * sin).sqrt();
        let height = 1e-3 * altitude;
        let (out, along) = ((normal + height) * cos, (polar * normal + height) * sin);
        let east = DVec3::new(-sin_t, cos_t, 0.0);
        let up = DVec3::new(cos * cos_t, cos * sin_t, sin);
        Ok(Self {
            to_local: DMat3::from_cols(east, up.cross(east), up).transpose(),
            position: DVec3::new(out * cos_t, out * sin_t, along),
            velocity: east * (SPIN * out / LIGHT),
            sidereal,
            altitude,
        })
    }

    /// What stands at a vector from the centre of the Earth \[km\], on the true equator and equinox.
    pub fn see(&self, geocentric: DVec3, air: Option<&Refraction>) -> Seen {
        let from_here = geocentric - self.position;
        let distance = from_here.length();
        let mut seen = self.look(from_here / distance, air);
        seen.distance = distance;
        seen
    }

    /// What is infinitely far, in a direction on the true equator and equinox.
    pub fn look(&self, direction: DVec3, air: Option<&Refraction>) -> Seen {
        let local = self.to_local * (direction + self.velocity).normalize();
        let flat = local.x.hypot(local.y);
        let truly = local.z.atan2(flat);
        let azimuth = local.x.atan2(local.y).rem_euclid(TAU) % TAU;
        let lift = air.map_or(0.0, |air| air.of_true(truly));
        if lift == 0.0 {
            return Seen { direction: local, elevation: truly, azimuth, distance: f64::INFINITY };
        }
        let elevation = truly + lift;
        let (sin, cos) = elevation.sin_cos();
        let stretch = if flat > 0.0 { cos / flat } else { 0.0 };
        let direction = DVec3::new(local.x * stretch, local.y * stretch, sin);
        Seen { direction, elevation, azimuth, distance: f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hours(radians: f64) -> f64 {
        radians.to_degrees() / 15.0
    }

    #[test]
    fn sidereal_time_of_meeus() {
        // Examples 12.a and 12.b: 1987 April 10, 0h UT1 and 19:21:00 UT1 (no leap second is involved in UT1 itself).
        let at = |days: f64, seconds: f64| {
            FrameOfDate::new(Instant {
                centuries: (days + (seconds + 55.4) / 86_400.0) / 36_525.0,
                rotation_days: days + seconds / 86_400.0,
            })
        };
        let day = 2_446_895.5 - 2_451_545.0;
        let frame = at(day, 0.0);
        let mean = hours(mean_sidereal(frame.instant));
        assert!((mean - (13.0 + 10.0 / 60.0 + 46.3668 / 3600.0)).abs() * 3600.0 < 0.005, "{mean}");
        let apparent = hours(frame.sidereal);
        assert!((apparent - (13.0 + 10.0 / 60.0 + 46.1351 / 3600.0)).abs() * 3600.0 < 0.01, "{apparent}");
        let evening = hours(mean_sidereal(at(day, 69_660.0).instant));
        assert!((evening - (8.0 + 34.0 / 60.0 + 57.0896 / 3600.0)).abs() * 3600.0 < 0.005, "{evening}");
    }

    #[test]
    fn nutation_of_meeus() {
        // Example 22.a: 1987 April 10, 0h TD.
        let (psi, eps, _) = nutation(-0.127_296_372_348);
        assert!((psi / ARCSECOND + 3.788).abs() < 0.006, "{}", psi / ARCSECOND);
        assert!((eps / ARCSECOND - 9.443).abs() < 0.006, "{}", eps / ARCSECOND);
    }

    #[test]
    fn the_observatory_of_meeus() {
        // Example 11.a, Palomar: rho sin phi' 0.546861, rho cos phi' 0.836339.
        let frame = FrameOfDate::new(Instant::from_unix(0.0).expect("valid"));
        let place = [(33.0 + 21.0 / 60.0 + 22.0 / 3600.0_f64).to_radians(), 0.0, 1706.0];
        let site = Site::new(&frame, place).expect("valid");
        // Meeus has the ellipsoid of 1976, 3 m larger.
        assert!((site.position.z / 6378.14 - 0.546_861).abs() < 2e-6, "{}", site.position.z);
        assert!((site.position.truncate().length() / 6378.14 - 0.836_339).abs() < 2e-6, "{}", site.position);
    }
}

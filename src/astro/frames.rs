//! Celestial frames: precession, nutation, sidereal time, horizon coordinates, parallax, refraction (floor 1).
//!
//! Sources: precession and obliquity IAU 2006 in the angles of Fukushima and Williams (Capitaine et al., Astronomy and
//! Astrophysics 412, 567, 2003, with the frame bias); nutation IAU 1980 in its 35 largest terms (Meeus, Astronomical
//! Algorithms, ch. 22); sidereal time IAU 2006; ellipsoid WGS 84; refraction by Saemundsson (Sky and Telescope 72, 70,
//! 1986; Meeus eq. 16.4) and its inverse by Bennett (eq. 16.3), air of the standard atmosphere at the place's altitude.
//!
//! Refraction below -1 degree cannot be observed from the ground: from there it fades to nothing at -5 degrees, with a
//! continuous slope, so that the apparent elevation always rises with the true one. Polar motion (0.3") is left out.
//!
//! Units: radians, kilometres; directions x east, y north, z up. Error: 0.6" for a star against astropy (`test_stars`),
//! 4" for the Sun from a place (`test_from_a_place`): the rotation of the Earth in years of no measurement. Refraction:
//! 10" and 6 % against erfa above 10 degrees (`test_refraction`). Cost: 1 µs for a frame.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use crate::astro::tables::nutation::NUTATION;
use crate::astro::time::Instant;
use crate::error::{Result, in_range};

/// One arcsecond \[rad\].
pub const ARCSECOND: f64 = TAU / 1_296_000.0;
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
    /// Pressure and temperature of the air against those of the refraction formula \[1\].
    pub air: f64,
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
            air: standard_air(altitude),
        })
    }

    /// What stands at a vector from the centre of the Earth \[km\], on the true equator and equinox.
    pub fn see(&self, geocentric: DVec3, refracted: bool) -> Seen {
        let from_here = geocentric - self.position;
        let distance = from_here.length();
        let mut seen = self.look(from_here / distance, refracted);
        seen.distance = distance;
        seen
    }

    /// What is infinitely far, in a direction on the true equator and equinox.
    pub fn look(&self, direction: DVec3, refracted: bool) -> Seen {
        let local = self.to_local * (direction + self.velocity).normalize();
        let flat = local.x.hypot(local.y);
        let truly = local.z.atan2(flat);
        let azimuth = local.x.atan2(local.y).rem_euclid(TAU) % TAU;
        let lift = if refracted { refraction(truly) * self.air } else { 0.0 };
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

/// Density of the standard atmosphere against air of 1010 hPa and 10 °C, by which refraction scales.
pub fn standard_air(altitude: f64) -> f64 {
    let celsius = (15.0 - 0.0065 * altitude).max(-56.5);
    let pressure = if altitude < 11_000.0 {
        1013.25 * (1.0 - 2.255_77e-5 * altitude).powf(5.255_88)
    } else {
        226.32 * (-(altitude - 11_000.0) / 6341.6).exp()
    };
    air(pressure, celsius)
}

/// Refraction of air of some pressure \[hPa\] and temperature \[°C\] against that of 1010 hPa and 10 °C.
pub fn air(pressure: f64, celsius: f64) -> f64 {
    pressure / 1010.0 * 283.0 / (273.0 + celsius)
}

/// Saemundsson's formula, 0 at the zenith: by how much the air lifts what stands at a true elevation \[arcmin,
/// degrees\].
fn saemundsson(degrees: f64) -> f64 {
    1.02 / (degrees + 10.3 / (degrees + 5.11)).to_radians().tan() + 0.001_927_9
}

/// Refraction at a true elevation, to be added to it, for 1010 hPa and 10 °C \[rad\].
pub fn refraction(elevation: f64) -> f64 {
    const EDGE: f64 = -1.0;
    const FADE: f64 = 4.0;
    let degrees = elevation.to_degrees();
    let minutes = if degrees >= EDGE {
        saemundsson(degrees).clamp(0.0, (90.0 - degrees).max(0.0) * 60.0)
    } else if degrees > EDGE - FADE {
        // The cubic with the value and the slope of the formula at the edge, and neither at the end.
        let u = (degrees - (EDGE - FADE)) / FADE;
        let at = EDGE + 10.3 / (EDGE + 5.11);
        let rise = 1.0 - 10.3 / ((EDGE + 5.11) * (EDGE + 5.11));
        let slope = -1.02_f64.to_radians() * rise / at.to_radians().sin().powi(2) * FADE;
        saemundsson(EDGE) * u * u * (3.0 - 2.0 * u) + slope * u * u * (u - 1.0)
    } else {
        0.0
    };
    minutes * 60.0 * ARCSECOND
}

/// Bennett's formula: refraction at an apparent elevation of 0 and more, to be taken from it, for 1010 hPa and 10 °C
/// \[rad\].
pub fn refraction_of_apparent(elevation: f64) -> f64 {
    let degrees = elevation.to_degrees();
    let minutes = 1.0 / (degrees + 7.31 / (degrees + 4.4)).to_radians().tan() + 0.001_351_5;
    minutes.max(0.0) * 60.0 * ARCSECOND
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
    fn refraction_of_meeus_and_its_inverse() {
        // Example 16.a: apparent 0.5 degrees, true 0.5 - 28.754'.
        let lift = refraction_of_apparent(0.5_f64.to_radians()).to_degrees() * 60.0;
        assert!((lift - 28.754).abs() < 0.01, "{lift}");
        let truly = 0.5541_f64;
        let back = refraction(truly.to_radians()).to_degrees() * 60.0;
        // The same example: 24.618' at a true elevation of 33' 15" of the Sun's upper limb.
        assert!((back - 24.618).abs() < 0.05, "{back}");
        for degrees in 0..90 {
            let apparent = f64::from(degrees).to_radians();
            let true_one = apparent - refraction_of_apparent(apparent);
            let error = (true_one + refraction(true_one) - apparent) / ARCSECOND;
            assert!(error.abs() < 6.0, "{degrees}: {error}");
        }
    }

    #[test]
    fn the_apparent_elevation_rises_with_the_true_one() {
        let mut before = f64::NEG_INFINITY;
        let mut lift_before = 0.0;
        for i in 0..=180_000 {
            let truly = (f64::from(i) * 0.001 - 90.0).to_radians();
            let lift = refraction(truly);
            assert!((0.0..0.012).contains(&lift), "{lift}");
            assert!((lift - lift_before).abs() < 20.0 * ARCSECOND / 10.0, "no step at {}", truly.to_degrees());
            assert!(truly + lift > before, "at {}", truly.to_degrees());
            (before, lift_before) = (truly + lift, lift);
        }
        assert!((before - 0.25 * TAU).abs() < 1e-9, "the zenith stays");
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

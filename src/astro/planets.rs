//! The planets that the eye sees: positions of Mercury, Venus, Mars, Jupiter and Saturn by VSOP87, magnitudes by phase
//! (floor 1).
//!
//! Sources: VSOP87D truncated by `scripts/make_astro_tables.py` (Bretagnon and Francou 1988), light-time by iteration, the
//! aberration of the year as for stars; magnitudes V of Mallama and Hilton, Astronomy and Computing 25, 10, 2018, without
//! the spots of Mars (0.1) and with Saturn's ring by its mean tilt; colours B-V of the same.
//!
//! Units: radians, kilometres, magnitudes. Error: 7" against JPL's DE421 by skyfield (`test_planets.py`).
//! Cost: 6 us a planet.

use glam::DVec3;

use crate::astro::frames::{AU, FrameOfDate, LIGHT, Seen};
use crate::astro::observer::Observer;
use crate::astro::sun;
use crate::astro::tables::earth::Series;
use crate::astro::tables::{jupiter, mars, mercury, saturn, venus};

/// A planet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Planet {
    /// The first.
    Mercury,
    /// The brightest.
    Venus,
    /// The red one.
    Mars,
    /// The largest.
    Jupiter,
    /// With its ring.
    Saturn,
}

/// Every planet, outwards.
pub const ALL: [Planet; 5] = [Planet::Mercury, Planet::Venus, Planet::Mars, Planet::Jupiter, Planet::Saturn];

/// A planet as seen from a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenPlanet {
    /// Where.
    pub seen: Seen,
    /// Angle at the planet between the Sun and the observer \[rad\].
    pub phase: f64,
    /// Distance from the Sun \[km\].
    pub sun_distance: f64,
    /// Apparent magnitude V outside the air.
    pub magnitude: f64,
    /// Colour index B-V.
    pub color: f64,
}

fn sum(series: Series, millennia: f64) -> f64 {
    let mut total = 0.0;
    for terms in series.iter().rev() {
        let part: f64 = terms.iter().map(|[size, phase, rate]| size * (phase + rate * millennia).cos()).sum();
        total = total * millennia + part;
    }
    total
}

fn vector(longitude: f64, latitude: f64, distance: f64) -> DVec3 {
    let ((sin, cos), (up, flat)) = (longitude.sin_cos(), latitude.sin_cos());
    DVec3::new(cos * flat, sin * flat, up) * distance
}

impl Planet {
    /// Position from the Sun at the mean ecliptic and equinox of date \[au\].
    pub fn heliocentric(self, centuries: f64) -> DVec3 {
        let [l, b, r] = match self {
            Self::Mercury => [mercury::LONGITUDE, mercury::LATITUDE, mercury::RADIUS],
            Self::Venus => [venus::LONGITUDE, venus::LATITUDE, venus::RADIUS],
            Self::Mars => [mars::LONGITUDE, mars::LATITUDE, mars::RADIUS],
            Self::Jupiter => [jupiter::LONGITUDE, jupiter::LATITUDE, jupiter::RADIUS],
            Self::Saturn => [saturn::LONGITUDE, saturn::LATITUDE, saturn::RADIUS],
        }
        .map(|series| sum(series, 0.1 * centuries));
        vector(l, b, r)
    }

    /// Vectors from the Earth's centre, as light shows it, and from the Sun, both at the mean ecliptic of date \[au\].
    fn geometric(self, centuries: f64) -> (DVec3, DVec3) {
        let [longitude, latitude, distance] = sun::geometric(centuries);
        let to_sun = vector(longitude, latitude, distance);
        let mut from_sun = self.heliocentric(centuries);
        for _ in 0..3 {
            let days = (from_sun + to_sun).length() * AU / LIGHT / 86_400.0;
            from_sun = self.heliocentric(centuries - days / 36_525.0);
        }
        (from_sun + to_sun, from_sun)
    }

    /// The planet as an observer sees it.
    pub fn seen(self, observer: &Observer) -> SeenPlanet {
        let frame = &observer.frame;
        let (from_earth, from_sun) = self.geometric(frame.instant.centuries);
        let distance = from_earth.length();
        let (longitude, latitude) =
            (from_earth.y.atan2(from_earth.x), from_earth.z.atan2(from_earth.x.hypot(from_earth.y)));
        let towards = frame.from_ecliptic(longitude + frame.nutation, latitude);
        // The aberration of the year, then from the place.
        let apparent = (towards + sun::earth_velocity(frame)).normalize() * (distance * AU);
        let seen = observer.site.see(apparent, observer.air.as_deref());
        let phase = from_earth.cross(from_sun).length().atan2(from_earth.dot(from_sun));
        let tilt = if self == Self::Saturn { ring_tilt(frame, towards, from_sun) } else { 0.0 };
        let magnitude = self.magnitude(from_sun.length(), distance, phase.to_degrees(), tilt);
        SeenPlanet { seen, phase, sun_distance: from_sun.length() * AU, magnitude, color: self.color() }
    }

    /// Magnitude by the distances from the Sun and the Earth \[au\], the phase angle \[degrees\] and the sine of the tilt
    /// of Saturn's ring.
    pub fn magnitude(self, r: f64, delta: f64, phase: f64, tilt: f64) -> f64 {
        let a = phase;
        let polynomial = |c: &[f64]| c.iter().rev().fold(0.0, |sum, k| sum * a + k);
        let law = match self {
            Self::Mercury => {
                polynomial(&[-0.613, 6.3280e-2, -1.6336e-3, 3.3644e-5, -3.4265e-7, 1.6893e-9, -3.0334e-12])
            }
            Self::Venus if a < 163.7 => polynomial(&[-4.384, -1.044e-3, 3.687e-4, -2.814e-6, 8.938e-9]),
            Self::Venus => polynomial(&[236.05828, -2.81914, 8.39034e-3]),
            Self::Mars if a <= 50.0 => polynomial(&[-1.601, 2.267e-2, -1.302e-4]),
            Self::Mars => polynomial(&[-0.367, -2.573e-2, 3.445e-4]),
            Self::Jupiter => polynomial(&[-9.395, -3.7e-4, 6.16e-4]),
            Self::Saturn => -8.914 - 1.825 * tilt + 0.026 * a - 0.378 * tilt * (-2.25 * a).exp(),
        };
        law + 5.0 * (r * delta).log10()
    }

    /// Colour index B-V.
    pub fn color(self) -> f64 {
        match self {
            Self::Mercury => 0.97,
            Self::Venus => 0.81,
            Self::Mars => 1.43,
            Self::Jupiter => 0.87,
            Self::Saturn => 1.09,
        }
    }
}

/// Sine of the tilt of Saturn's ring: the geometric mean of those towards the Earth and the Sun, nothing where the Sun
/// lights the other side.
fn ring_tilt(frame: &FrameOfDate, towards: DVec3, from_sun: DVec3) -> f64 {
    let t = frame.instant.centuries;
    let (right, north) = ((40.589 - 0.036 * t).to_radians(), (83.537 - 0.004 * t).to_radians());
    let pole = frame.from_icrs * DVec3::new(right.cos() * north.cos(), right.sin() * north.cos(), north.sin());
    let unit = from_sun.normalize();
    let sunwards = frame.from_ecliptic(unit.y.atan2(unit.x), unit.z.atan2(unit.x.hypot(unit.y)));
    (pole.dot(towards) * pole.dot(sunwards)).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astro::time::Instant;

    #[test]
    fn venus_of_meeus() {
        // Example 32.a: 1992 December 20.0 TD: L 26.11428, B -2.62070, R 0.724603.
        let instant = Instant { centuries: -0.070_321_697_467_5, rotation_days: -2568.5 };
        let at = Planet::Venus.heliocentric(instant.centuries);
        let longitude = at.y.atan2(at.x).to_degrees();
        let latitude = at.z.atan2(at.x.hypot(at.y)).to_degrees();
        assert!((longitude - 26.114_28).abs() * 3600.0 < 3.0, "{longitude}");
        assert!((latitude + 2.620_70).abs() * 3600.0 < 3.0, "{latitude}");
        assert!((at.length() - 0.724_603).abs() < 1e-5, "{}", at.length());
    }

    #[test]
    fn magnitudes_of_well_known_nights() {
        assert!((Planet::Jupiter.magnitude(5.0, 4.0, 0.0, 0.0) + 2.9).abs() < 0.1, "at opposition");
        assert!((Planet::Venus.magnitude(0.72, 0.4, 120.0, 0.0) + 4.9).abs() < 0.1, "at its greatest brightness");
        assert!((Planet::Mars.magnitude(1.38, 0.373, 0.0, 0.0) + 2.9).abs() < 0.2, "in 2003");
        let joined = Planet::Venus.magnitude(1.0, 1.0, 163.699, 0.0) - Planet::Venus.magnitude(1.0, 1.0, 163.701, 0.0);
        assert!(joined.abs() < 0.05, "{joined}");
    }
}

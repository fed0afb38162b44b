//! The position of the Sun: solar ephemeris by VSOP87 (floor 1).
//!
//! Source: VSOP87D (Bretagnon and Francou, Astronomy and Astrophysics 202, 309, 1988), the Earth at the ecliptic and
//! equinox of date, truncated to 180 terms by `scripts/make_astro_tables.py`; corrections as in Meeus, Astronomical
//! Algorithms, ch. 25: to the FK5, aberration, nutation.
//!
//! Units: radians, kilometres. Error: 0.3" and 4e-6 of the distance against astropy from 1950 to 2050, held to 1"
//! (`test_geocentric[sun]`). Cost: 2 µs.

use glam::DVec3;

use crate::astro::frames::{AU, FrameOfDate};
use crate::astro::tables::earth::{LATITUDE, LONGITUDE, RADIUS, Series};
use crate::math::geometry::ARCSECOND;

/// Geometric longitude and latitude of the Sun at the mean ecliptic and equinox of date \[rad\], and distance \[au\].
pub fn geometric(centuries: f64) -> [f64; 3] {
    let millennia = 0.1 * centuries;
    let sum = |series: Series| {
        let mut total = 0.0;
        for terms in series.iter().rev() {
            let part: f64 = terms.iter().map(|[size, phase, rate]| size * (phase + rate * millennia).cos()).sum();
            total = total * millennia + part;
        }
        total
    };
    let longitude = sum(LONGITUDE) + std::f64::consts::PI - 0.090_33 * ARCSECOND;
    [longitude, -sum(LATITUDE), sum(RADIUS)]
}

/// Apparent vector from the centre of the Earth to the Sun on the true equator and equinox \[km\].
pub fn geocentric(frame: &FrameOfDate) -> DVec3 {
    let [longitude, latitude, distance] = geometric(frame.instant.centuries);
    let aberration = -20.4898 * ARCSECOND / distance;
    frame.from_ecliptic(longitude + frame.nutation + aberration, latitude) * (distance * AU)
}

/// Velocity of the Earth in units of that of light, on the true equator and equinox: the aberration of the year.
/// An ellipse that precesses; 0.01" from the truth.
pub fn earth_velocity(frame: &FrameOfDate) -> DVec3 {
    let t = frame.instant.centuries;
    let longitude = geometric(t)[0];
    let eccentricity = 0.016_708_634 - 0.000_042_037 * t;
    let perihelion = (102.937_35 + 1.719_46 * t).to_radians();
    let x = longitude.sin() - eccentricity * perihelion.sin();
    let y = eccentricity * perihelion.cos() - longitude.cos();
    let along = frame.from_ecliptic(0.0, 0.0) * x + frame.from_ecliptic(0.25 * std::f64::consts::TAU, 0.0) * y;
    along * (20.495_52 * ARCSECOND)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astro::time::Instant;

    #[test]
    fn the_sun_of_meeus() {
        // Example 25.b: 1992 October 13.0 TD.
        let instant = Instant { centuries: -0.072_183_436, rotation_days: -2636.5 };
        let [longitude, latitude, distance] = geometric(instant.centuries);
        let degrees = longitude.to_degrees().rem_euclid(360.0);
        assert!((degrees - 199.907_347).abs() * 3600.0 < 1.0, "{degrees}");
        assert!((latitude / ARCSECOND - 0.72).abs() < 0.2, "{}", latitude / ARCSECOND);
        assert!((distance - 0.997_608_53).abs() < 2e-6, "{distance}");
        let to = geocentric(&FrameOfDate::new(instant));
        let right = to.y.atan2(to.x).to_degrees().rem_euclid(360.0) / 15.0;
        let north = to.z.atan2(to.x.hypot(to.y)).to_degrees();
        assert!((right - (13.0 + 13.0 / 60.0 + 30.749 / 3600.0)).abs() * 54_000.0 < 1.0, "{right}");
        assert!((north + (7.0 + 47.0 / 60.0 + 1.74 / 3600.0)).abs() * 3600.0 < 1.0, "{north}");
    }
}

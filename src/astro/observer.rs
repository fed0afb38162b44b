//! Topocentric positions: a place on the Earth at an instant, from which the Sun and the Moon are seen (floor 1).
//!
//! Cost: one Sun and Moon 9 µs (`a_sun_and_a_moon_cost_little`).

use std::sync::Arc;

use super::frames::{FrameOfDate, Seen, Site};
use super::moon::{self, Moon};
use super::refraction::{RefractingAir, Refraction};
use super::sun;
use super::time::Instant;
use crate::error::{Result, in_range};

/// A place at an instant: what positions are computed from.
#[derive(Debug, Clone, PartialEq)]
pub struct Observer {
    /// Axes of the date.
    pub frame: FrameOfDate,
    /// Axes and position of the observer.
    pub site: Site,
    /// The air that directions are seen through.
    pub air: Option<Arc<Refraction>>,
}

impl Observer {
    /// An observer at latitude, longitude \[rad\] and altitude \[m\], at `unix` \[s since 1970 UTC\], who looks through air
    /// of this refractivity over that of the standard atmosphere, or through none.
    pub fn new(unix: f64, place: [f64; 3], refractivity: Option<f64>) -> Result<Self> {
        let frame = FrameOfDate::new(Instant::from_unix(unix)?);
        let site = Site::new(&frame, place)?;
        let air =
            refractivity.map(|scale| in_range("refractivity", scale, 0.0, 3.0, "1").map(|()| scale)).transpose()?;
        let air = air.map(|scale| Refraction::of(RefractingAir { altitude: site.altitude, scale }));
        Ok(Self { frame, site, air })
    }

    /// The Sun; its distance in kilometres.
    pub fn sun(&self) -> Seen {
        self.site.see(sun::geocentric(&self.frame), self.air.as_deref())
    }

    /// The Moon.
    pub fn moon(&self) -> Moon {
        moon::seen(&self.frame, &self.site, self.air.as_deref())
    }

    /// Local apparent sidereal time in `[0, 2 pi)` \[rad\].
    pub fn sidereal_time(&self) -> f64 {
        self.site.sidereal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sun_and_a_moon_cost_little() {
        let start = std::time::Instant::now();
        let count = 2000;
        let mut sum = 0.0;
        for i in 0..count {
            let unix = -6e8 + 1.5e6 * f64::from(i);
            let observer = Observer::new(unix, [0.8, 0.1, 100.0], Some(1.0)).expect("inside 1900-2100");
            sum += observer.sun().elevation + observer.moon().seen.elevation;
        }
        let each = start.elapsed().as_secs_f64() / f64::from(count) * 1e6;
        println!("a Sun and a Moon: {each:.2} µs (checksum {sum:.3})");
        // The goal is 20 µs; ten times that is allowed to a machine that is busy.
        assert!(each < 200.0, "{each} µs");
        assert!(sum.is_finite(), "positions are numbers");
    }

    #[test]
    fn the_eclipse_of_1999_was_one() {
        // 1999-08-11 11:03 UTC, 48.8 N 8 E.
        let observer =
            Observer::new(934_369_380.0, [48.8_f64.to_radians(), 8_f64.to_radians(), 200.0], None).expect("valid");
        let (sun, new) = (observer.sun(), observer.moon());
        let apart = sun.direction.angle_between(new.seen.direction).to_degrees();
        assert!(apart < 0.3, "{apart}");
        assert!(moon::illuminated(new.phase) < 1e-4, "new: {}", new.phase);
    }
}

//! Time: UTC to terrestrial time and to the rotation angle of the Earth (floor 1).
//!
//! Sources: leap seconds of the IERS to 2017; TT - UT1 measured by the IERS from 1972 to 2026 (`tables/rotation.rs`),
//! and before 1972 by the polynomials of Espenak and Meeus (Five Millennium Canon of Solar Eclipses, NASA
//! TP-2006-214141).
//!
//! UTC before 1972 is read as UT1, from which it kept within 0.1 s since 1962; before that civil time was UT1's own.
//! From 2027 on the 37 leap seconds are kept and UT1 is UTC. That deviates from the Espenak-Meeus forecast: it gives
//! 71.0 s for 2024 where 69.2 s was measured, and would turn the Earth by 6 arcminutes in 2050.
//!
//! Units: seconds since 1970-01-01 UTC without leap seconds, days, Julian centuries. Error: UT1 within 0.1 s from 1972
//! to mid 2026 (`test_sidereal_time`). Cost: 10 ns.

use crate::astro::tables::rotation::HALF_YEARS;
use crate::error::{Result, in_range};

/// Seconds of a day.
pub const DAY: f64 = 86_400.0;
/// 2000-01-01 12:00 in seconds since 1970.
const J2000: f64 = 946_728_000.0;
/// 1972-01-01.
const FIRST_LEAP: f64 = 63_072_000.0;
/// First and last instant: 1900-01-01 and 2101-01-01 \[s since 1970 UTC\].
pub const SPAN: [f64; 2] = [-2_208_988_800.0, 4_133_980_800.0];

/// Days since 1970 from which UTC is one second further behind atomic time; 10 s on the first of them.
const LEAPS: [u32; 28] = [
    730, 912, 1096, 1461, 1826, 2191, 2557, 2922, 3287, 3652, 4199, 4564, 4929, 5660, 6574, 7305, 7670, 8217, 8582,
    8947, 9496, 10043, 10592, 13149, 14245, 15522, 16617, 17167,
];

/// An instant on the clocks that astronomy needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// Terrestrial time: Julian centuries since 2000-01-01 12:00.
    pub centuries: f64,
    /// UT1: days since 2000-01-01 12:00.
    pub rotation_days: f64,
}

impl Instant {
    /// From seconds since 1970-01-01 UTC, in [`SPAN`].
    pub fn from_unix(unix: f64) -> Result<Self> {
        in_range("when", unix, SPAN[0], SPAN[1], "s since 1970-01-01 UTC")?;
        let terrestrial = unix + tt_minus_utc(unix);
        let rotation = terrestrial - tt_minus_ut1(unix);
        Ok(Self { centuries: (terrestrial - J2000) / (36_525.0 * DAY), rotation_days: (rotation - J2000) / DAY })
    }

    /// Julian date in terrestrial time \[d\].
    pub fn julian_date(&self) -> f64 {
        2_451_545.0 + 36_525.0 * self.centuries
    }

    /// Rotation angle of the Earth (IAU 2000) in `[0, 2 pi)` \[rad\].
    pub fn rotation(&self) -> f64 {
        let days = self.rotation_days;
        let turns = days.rem_euclid(1.0) + 0.779_057_273_264_0 + 0.002_737_811_911_354_48 * days;
        turns.rem_euclid(1.0) * std::f64::consts::TAU
    }
}

/// Julian date of seconds since 1970-01-01, in the same scale \[d\].
pub fn julian_date(unix: f64) -> f64 {
    2_440_587.5 + unix / DAY
}

/// Terrestrial time less UTC \[s\]; before 1972 less UT1.
pub fn tt_minus_utc(unix: f64) -> f64 {
    if unix < FIRST_LEAP {
        return espenak_meeus(unix);
    }
    let day = (unix / DAY).floor() as u32;
    let leaps = LEAPS.partition_point(|&from| from <= day);
    32.184 + 9.0 + leaps as f64
}

/// Terrestrial time less UT1 \[s\].
pub fn tt_minus_ut1(unix: f64) -> f64 {
    if unix < FIRST_LEAP {
        return espenak_meeus(unix);
    }
    let at = 2.0 * (year(unix) - 1972.0);
    let last = HALF_YEARS.len() - 1;
    let low = (at as usize).min(last);
    let high = (low + 1).min(last);
    HALF_YEARS[low] + (at - low as f64).clamp(0.0, 1.0) * (HALF_YEARS[high] - HALF_YEARS[low])
}

/// Calendar year and its fraction, to a day.
fn year(unix: f64) -> f64 {
    2000.0 + (unix - J2000 + 0.5 * DAY) / (365.25 * DAY)
}

/// The polynomials of Espenak and Meeus, 1900 to 1986.
fn espenak_meeus(unix: f64) -> f64 {
    let y = year(unix);
    if y < 1920.0 {
        let t = y - 1900.0;
        -2.79 + t * (1.494_119 + t * (-0.059_893_9 + t * (0.006_196_6 - 0.000_197 * t)))
    } else if y < 1941.0 {
        let t = y - 1920.0;
        21.20 + t * (0.844_93 + t * (-0.076_1 + 0.002_093_6 * t))
    } else if y < 1961.0 {
        let t = y - 1950.0;
        29.07 + t * (0.407 + t * (-1.0 / 233.0 + t / 2547.0))
    } else {
        let t = y - 1975.0;
        45.45 + t * (1.067 - t * (1.0 / 260.0 + t / 718.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leap_seconds_are_those_of_the_iers() {
        for (unix, want) in [
            (63_072_000.0, 42.184),    // 1972-01-01
            (78_796_799.0, 42.184),    // 1972-06-30 23:59:59
            (78_796_800.0, 43.184),    // 1972-07-01
            (946_684_800.0, 64.184),   // 2000-01-01
            (1_136_073_600.0, 65.184), // 2006-01-01
            (1_483_228_799.0, 68.184), // 2016-12-31 23:59:59
            (1_483_228_800.0, 69.184), // 2017-01-01
            (4_000_000_000.0, 69.184),
        ] {
            assert!((tt_minus_utc(unix) - want).abs() < 1e-9, "{unix}: {} is not {want}", tt_minus_utc(unix));
        }
    }

    #[test]
    fn the_rotation_of_the_earth_joins_up() {
        let mut before = tt_minus_ut1(SPAN[0]);
        let mut unix = SPAN[0];
        while unix < SPAN[1] {
            unix += 10.0 * DAY;
            let now = tt_minus_ut1(unix);
            assert!((now - before).abs() < 0.15, "{unix}: {before} then {now}");
            assert!(unix < FIRST_LEAP || (now - tt_minus_utc(unix)).abs() < 0.95, "UT1 is within 0.9 s of UTC");
            before = now;
        }
    }

    #[test]
    fn julian_dates() {
        assert_eq!(julian_date(0.0), 2_440_587.5, "1970");
        // Meeus, example 7.a: 1957 October 4.81.
        assert!((julian_date(-386_310_816.0) - 2_436_116.31).abs() < 1e-6, "Sputnik");
    }

    #[test]
    fn other_centuries_are_refused() {
        assert!(Instant::from_unix(SPAN[0] - 1.0).is_err(), "1899");
        assert!(Instant::from_unix(SPAN[1] + 1.0).is_err(), "2101");
        assert!(Instant::from_unix(f64::NAN).is_err(), "NaN");
    }
}

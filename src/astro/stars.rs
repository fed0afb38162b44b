//! The star catalogue to V 6.5: positions, magnitudes, colours (floor 1).
//!
//! Source: `tables/stars.bin`, 8 874 stars of Hipparcos by way of d3-celestial (`tables/SOURCES.md`), 8 bytes each:
//! position at J2000 (0.08"; the source is rounded to 0.18"), V, B-V. Precession, nutation, the aberration of the year
//! and of the day, refraction. The source has no proper motions: positions are those of 2000, and about a hundred near
//! stars are more than 20" off in 1950 or 2050 (Rigil Kentaurus 3', Arcturus 2'). No parallax (0.8" at most), no
//! variability. The 4 stars without B-V get the Sun's, 0.65.
//!
//! Units: radians, magnitudes; directions x east, y north, z up. Error: 0.6" for a star that does not move
//! (`test_stars`). Cost: 0.1 µs a star (`eight_thousand_stars_cost_little`).

use std::sync::OnceLock;

use glam::DVec3;

use crate::astro::observer::Observer;
use crate::astro::{light, sun, tables};
use crate::error::{Result, in_range};

/// Faintest magnitude of the table.
pub const FAINTEST: f64 = 6.5;
/// Bits of a star, from the lowest: B-V, V, declination, right ascension.
const BITS: [u32; 4] = [9, 10, 22, 23];

/// A star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CatalogStar {
    /// Unit vector in the ICRS, at the position of 2000.
    pub direction: DVec3,
    /// Apparent magnitude V.
    pub magnitude: f64,
    /// Colour index B-V.
    pub color: f64,
}

/// Every star, brightest first.
pub fn catalogue() -> &'static [CatalogStar] {
    static STARS: OnceLock<Vec<CatalogStar>> = OnceLock::new();
    STARS.get_or_init(|| tables::STARS.as_chunks::<8>().0.iter().map(|b| unpack(u64::from_le_bytes(*b))).collect())
}

fn unpack(mut packed: u64) -> CatalogStar {
    let [color, magnitude, north, right] = BITS.map(|bits| {
        let part = packed & ((1 << bits) - 1);
        packed >>= bits;
        part as f64
    });
    let (sin_a, cos_a) = (right / f64::from(1 << 23) * std::f64::consts::TAU).sin_cos();
    let (sin_d, cos_d) = ((north / f64::from(1 << 22) - 0.5) * std::f64::consts::PI).sin_cos();
    CatalogStar {
        direction: DVec3::new(cos_a * cos_d, sin_a * cos_d, sin_d),
        magnitude: 0.01 * magnitude - 2.0,
        color: if color >= 511.0 { light::SOLAR_COLOR } else { 0.01 * color - 1.0 },
    }
}

/// The stars of a magnitude and brighter.
pub fn brighter(limit: f64) -> Result<&'static [CatalogStar]> {
    in_range("limit", limit, -2.0, FAINTEST, "mag")?;
    let all = catalogue();
    Ok(&all[..all.partition_point(|star| star.magnitude <= limit + 1e-9)])
}

/// Where an observer sees stars, also those below the horizon.
pub fn directions<'a>(observer: &'a Observer, stars: &'a [CatalogStar]) -> impl Iterator<Item = DVec3> + 'a {
    let look = seen(observer);
    stars.iter().map(move |star| look(star.direction))
}

/// Where an observer sees what stands in a direction of the ICRS.
pub fn seen(observer: &Observer) -> impl Fn(DVec3) -> DVec3 + '_ {
    let velocity = sun::earth_velocity(&observer.frame);
    move |direction| {
        let moved = (observer.frame.from_icrs * direction + velocity).normalize();
        observer.site.look(moved, observer.air.as_deref()).direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_whole() {
        let all = catalogue();
        assert_eq!(all.len(), 8874, "stars to V 6.5");
        assert!((all[0].magnitude + 1.44).abs() < 1e-9, "Sirius comes first: {}", all[0].magnitude);
        assert!(all.windows(2).all(|w| w[0].magnitude <= w[1].magnitude), "in order");
        assert!(all.iter().all(|s| (s.direction.length() - 1.0).abs() < 1e-12), "unit vectors");
        assert!(all.iter().all(|s| (-0.4..=4.0).contains(&s.color)), "colours of stars");
        assert!(all.iter().all(|s| s.magnitude <= FAINTEST + 1e-9), "none is fainter than it says");
        assert_eq!(brighter(6.5).expect("valid").len(), 8874, "the limit is inclusive");
        assert!(brighter(-2.0).expect("valid").is_empty(), "none");
        assert!(brighter(7.0).is_err() && brighter(f64::NAN).is_err(), "not in the table");
    }

    #[test]
    fn sirius_stands_where_it_does() {
        // ICRS 6h45m08.9s -16d42'58".
        let sirius = catalogue()[0].direction;
        let right = sirius.y.atan2(sirius.x).to_degrees() / 15.0;
        assert!((right - 6.752_48).abs() < 1e-3, "{right}");
        assert!((sirius.z.asin().to_degrees() + 16.716).abs() < 2e-3, "{sirius}");
    }

    #[test]
    fn eight_thousand_stars_cost_little() {
        let observer = Observer::new(1e9, [0.8, 0.1, 0.0], Some(1.0)).expect("valid");
        let stars = catalogue();
        let start = std::time::Instant::now();
        let sum: DVec3 = directions(&observer, stars).sum();
        let each = start.elapsed().as_secs_f64() / stars.len() as f64 * 1e6;
        println!("a star: {each:.3} µs (checksum {sum})");
        assert!(each < 5.0 && sum.is_finite(), "{each} µs");
    }
}

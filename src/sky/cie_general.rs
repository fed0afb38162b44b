//! The fifteen standard general skies of the CIE (floor 3): CIE S 011/E:2003, ISO 15469:2004.
//!
//! Eqs 6 and 7 of the paper realistic_sky, with `E cos^2 g` for the misread `E c cos^2 g` and the sun's zenith angle in
//! the denominator. They give luminance relative to the zenith's; colour is the user's, or Preetham's as the paper has
//! it. Error against the published golden values 1e-9 (`golden_values`).

use glam::DVec3;

use super::perez::{Formula, Perez, Tint};
use crate::error::{Error, Result, in_range};

/// Coefficients `a` to `e` of the types 1 to 15.
pub const TYPES: [[f64; 5]; 15] = [
    [4.0, -0.7, 0.0, -1.0, 0.0],
    [4.0, -0.7, 2.0, -1.5, 0.15],
    [1.1, -0.8, 0.0, -1.0, 0.0],
    [1.1, -0.8, 2.0, -1.5, 0.15],
    [0.0, -1.0, 0.0, -1.0, 0.0],
    [0.0, -1.0, 2.0, -1.5, 0.15],
    [0.0, -1.0, 5.0, -2.5, 0.3],
    [0.0, -1.0, 10.0, -3.0, 0.45],
    [-1.0, -0.55, 2.0, -1.5, 0.15],
    [-1.0, -0.55, 5.0, -2.5, 0.3],
    [-1.0, -0.55, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 16.0, -3.0, 0.3],
    [-1.0, -0.15, 16.0, -3.0, 0.3],
    [-1.0, -0.15, 24.0, -2.8, 0.15],
];

/// Coefficients of a type.
pub fn perez(kind: usize) -> Result<Perez> {
    in_range("kind", kind as f64, 1.0, 15.0, "1")?;
    Ok(Perez::cie(TYPES[kind - 1]))
}

/// The sky of a type with this luminance at the zenith \[cd/m2\] and this light of the sun's disc.
pub fn sky(kind: usize, sun: DVec3, zenith: f64, tint: Tint, beam: [f64; 3]) -> Result<Formula> {
    in_range("zenith_luminance", zenith, 0.0, 1e9, "cd/m2")?;
    if !sun.is_normalized() || sun.z < -1e-9 {
        return Err(Error::Data { name: "sun", reason: "must be a unit vector not below the horizon".into() });
    }
    Ok(Formula { sun, luminance: Formula::scaled(perez(kind)?, zenith, sun), tint, beam })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geometry::direction;
    use crate::sky::model::SkyModel;

    #[test]
    fn golden_values() {
        // The formula of CIE S 011/E:2003 by hand; the first two of type 12 are colour-science's.
        let golden = [
            (1, [0.832_584_642_8, 0.358_638_308_5, 0.334_857_917_4]),
            (5, [1.0, 1.0, 1.0]),
            (8, [0.341_906_750_2, 0.548_807_228_2, 0.301_903_261_1]),
            (12, [0.454_452_430_7, 1.686_652_289_4, 1.102_436_356_6]),
            (15, [0.286_925_988_4, 1.862_663_489_7, 1.143_528_908_5]),
        ];
        let sun = direction(0.0, 60_f64.to_radians());
        for (kind, want) in golden {
            let sky = sky(kind, sun, 1.0, Tint::Even([0.3127, 0.329]), [0.0; 3]).expect("valid");
            for ((zenith, azimuth), want) in [(45.0_f64, 180.0_f64), (80.0, 0.0), (89.0, 90.0)].into_iter().zip(want) {
                let to = direction(azimuth.to_radians(), (90.0 - zenith).to_radians());
                let got = sky.reference(to);
                let got = 0.212_639_005_9 * got[0] + 0.715_168_678_8 * got[1] + 0.072_192_315_4 * got[2];
                assert!((got - want).abs() < 1e-9, "type {kind} at {zenith}: {got} against {want}");
            }
        }
    }

    #[test]
    fn the_overcast_sky_does_not_know_the_sun() {
        // Moon and Spencer's sky, of which type 1 is a fit: (1 + 2 sin) / 3.
        for elevation in [5.0_f64, 40.0, 90.0] {
            let tint = Tint::Even([0.3127, 0.329]);
            let sky = sky(1, direction(1.0, elevation.to_radians()), 3.0, tint, [0.0; 3]).expect("valid");
            for height in [30.0_f64, 45.0, 60.0, 80.0] {
                let got = sky.reference(direction(2.0, height.to_radians()))[1];
                let moon_spencer = 1.0 + 2.0 * height.to_radians().sin();
                assert!((got / moon_spencer - 1.0).abs() < 0.04, "{elevation} {height}: {got} against {moon_spencer}");
            }
        }
    }
}

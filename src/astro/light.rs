//! Photometry of stars: magnitudes, irradiance, illuminance, colour temperature of B-V, black-body colours (floor 1).
//!
//! Implements equations 10 to 12 of the paper realistic_sky. Equation 11 is printed as `10^(-m - 19)`, which is off by
//! 4 decades for the Sun and 15 for a star of magnitude 6; it must be the inverse of equation 10,
//! `10^((-m - 19) / 2.5)`. Equation 12, `7000 K / (B-V + 0.56)`, is good near the Sun's 0.65 and poor at the ends (26
//! 900 K where a B star has 16 600 K): the default is Ballesteros (Europhysics Letters 97, 34008, 2012).
//!
//! Colours are those of black bodies ([`rgb`]), interpolated in a table of the CIE 1931 observer.
//!
//! Units: magnitudes, W/m² of all light as the paper has it, lx, K. Illuminance: a magnitude of -13.98 is 1 lx outside
//! the air (Allen, Astrophysical Quantities). Error: the Sun's -26.74 gives 1247 W/m² of 1361
//! (`the_sun_by_equation_11`). Cost: one power.

use crate::astro::tables::planck;
use crate::error::{Result, in_range};
use crate::job::Job;
use crate::math::interpolation::lagrange;

/// B-V of the Sun, and of the stars whose colour is not known.
pub const SOLAR_COLOR: f64 = 0.65;
/// Luminance of a star of V 10 spread over a square degree, outside the air \[cd/m²\]: 27.78 mag/arcsec². The 0.69e-6
/// that is quoted too is what air leaves of it at the zenith.
pub const S10: f64 = 8.399e-7;
/// Linear Rec. 709 RGB of XYZ; `color::spaces` has the same.
const XYZ_TO_RGB: [[f64; 3]; 3] = [
    [3.240_969_941_904_521_3, -1.537_383_177_570_093_5, -0.498_610_760_293_003_3],
    [-0.969_243_636_280_879_8, 1.875_967_501_507_720_6, 0.041_555_057_407_175_61],
    [0.055_630_079_696_993_61, -0.203_976_958_888_976_57, 1.056_971_514_242_878_6],
];
/// Range of B-V of which a temperature is given; the bluest star has -0.4.
pub const COLORS: [f64; 2] = [-0.4, 6.0];

/// Equation 10: magnitude of an irradiance \[W/m²\]; infinite for none.
pub fn magnitude(irradiance: f64) -> f64 {
    -(19.0 + 2.5 * irradiance.log10())
}

/// Equation 11, corrected: irradiance of a magnitude \[W/m²\].
pub fn irradiance(magnitude: f64) -> f64 {
    10_f64.powf(-(magnitude + 19.0) / 2.5)
}

/// Illuminance of a magnitude, outside the air and square to the light \[lx\].
pub fn illuminance(magnitude: f64) -> f64 {
    10_f64.powf(-0.4 * (magnitude + 13.98))
}

/// How a colour index becomes a temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Temperature {
    /// Ballesteros 2012.
    Ballesteros,
    /// Equation 12 of the paper.
    Wang,
}

impl Temperature {
    /// Temperature of a star of colour index B-V in [`COLORS`] \[K\].
    pub fn of(self, color: f64) -> Result<f64> {
        in_range("b_v", color, COLORS[0], COLORS[1], "mag")?;
        Ok(match self {
            Self::Ballesteros => 4600.0 * (1.0 / (0.92 * color + 1.7) + 1.0 / (0.92 * color + 0.62)),
            Self::Wang => 7000.0 / (color + 0.56),
        })
    }
}

/// CIE 1931 chromaticity of a black body of a temperature \[K\], from 1000 to 50 000; the end nearest to others.
pub fn chromaticity(temperature: f64) -> [f64; 2] {
    let last = planck::CHROMATICITIES.len() - 1;
    // Rows are even in the reciprocal of temperature, and so nearly in colour.
    let row = (1e6 / (planck::STEP * temperature) - 1.0).clamp(0.0, last as f64);
    let nodes: [f64; planck::CHROMATICITIES.len()] = std::array::from_fn(|i| i as f64);
    let (first, weights) = lagrange(&nodes, row, 4);
    [0, 1].map(|k| weights.iter().zip(&planck::CHROMATICITIES[first..]).map(|(w, xy)| w * xy[k]).sum())
}

/// Linear Rec. 709 colour of luminance 1 of a black body of a temperature \[K\].
///
/// What is redder than the screen's red, below 1900 K, is mixed with white of the same luminance until no channel is
/// negative.
pub fn rgb(temperature: f64) -> [f64; 3] {
    let [x, y] = chromaticity(temperature);
    let xyz = [x / y, 1.0, (1.0 - x - y) / y];
    let rgb = XYZ_TO_RGB.map(|row| row.iter().zip(xyz).map(|(m, c)| m * c).sum::<f64>());
    let least = rgb.into_iter().fold(0.0, f64::min);
    let white = -least / (1.0 - least);
    // The last digit may not pass zero.
    rgb.map(|c| (c + white * (1.0 - c)).max(0.0))
}

/// Fill `out` with `value` of each element.
pub fn each<A: Copy + Sync, B: Send>(
    job: &Job,
    from: &[A],
    out: &mut [B],
    value: impl Fn(A) -> Result<B> + Sync,
) -> Result<()> {
    const CHUNK: usize = 1 << 12;
    job.chunks(out, CHUNK, |k, chunk| {
        chunk.iter_mut().zip(&from[k * CHUNK..]).try_for_each(|(o, &x)| {
            *o = value(x)?;
            Ok(())
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn s10_is_a_star_of_the_tenth_magnitude_in_a_square_degree() {
        let degree = 1_f64.to_radians();
        assert!((illuminance(10.0) / (degree * degree) / S10 - 1.0).abs() < 1e-4, "by the law of the stars");
        // 22 mag/arcsec² are 1.71e-4 cd/m², as observers of dark skies have it.
        assert!((10_f64.powf(-0.4 * (22.0 - 27.78)) * S10 / 1.71e-4 - 1.0).abs() < 0.01, "22 mag/arcsec²");
    }

    #[test]
    fn colours_of_black_bodies() {
        // Illuminant A is Planck's at 2855.5 K of today's constant: (0.44757, 0.40745) (CIE 15).
        let [x, y] = chromaticity(2855.5);
        assert!((x - 0.447_57).abs() < 5e-5 && (y - 0.407_45).abs() < 5e-5, "{x} {y}");
        for t in [0.0, 1000.0, 1386.0, 1899.0, 2500.0, 5778.0, 6504.0, 1e4, 5e4, 1e9] {
            let [r, g, b] = rgb(t);
            assert!(
                (0.212_639_005_9 * r + 0.715_168_678_8 * g + 0.072_192_315_4 * b - 1.0).abs() < 1e-9,
                "luminance at {t}"
            );
            assert!(r >= 0.0 && g >= 0.0 && b >= 0.0, "{t} K: {r} {g} {b}");
        }
        assert!(rgb(3000.0)[0] > rgb(3000.0)[2] && rgb(1e4)[2] > rgb(1e4)[0], "red and blue");
        assert!(rgb(1500.0)[2] == 0.0 && rgb(2000.0)[2] > 0.0, "the end of the screen's colours");
        assert!(chromaticity(f64::NAN)[0].is_nan(), "NaN in, NaN out");
    }

    #[test]
    fn the_sun_by_equation_11() {
        assert!((irradiance(-26.74) - 1247.0).abs() < 1.0, "{}", irradiance(-26.74));
        assert!((irradiance(-26.74) / 1361.0 - 1.0).abs() < 0.09, "within 9 % of the solar constant");
        assert!((irradiance(6.0) - 1e-10).abs() < 1e-15, "a faint star");
        for m in [-26.74, -12.73, 0.0, 6.5] {
            assert!((magnitude(irradiance(m)) - m).abs() < 1e-12, "10 and 11 are inverse at {m}");
        }
        assert_eq!(magnitude(0.0), f64::INFINITY, "no light");
    }

    #[test]
    fn illuminance_of_the_sun_and_the_moon() {
        assert!((illuminance(-26.74) / 127_500.0 - 1.0).abs() < 0.01, "{}", illuminance(-26.74));
        assert!((illuminance(-12.73) - 0.316).abs() < 0.001, "{}", illuminance(-12.73));
    }

    #[test]
    fn temperatures() {
        let at = |law: Temperature, color| law.of(color).expect("in range");
        assert!((at(Temperature::Ballesteros, 0.65) - 5778.0).abs() < 10.0, "the Sun");
        assert!((at(Temperature::Wang, 0.65) - 5785.0).abs() < 1.0, "the Sun");
        assert!((at(Temperature::Ballesteros, -0.3) - 16_600.0).abs() < 100.0, "a B star");
        assert!((at(Temperature::Wang, -0.3) - 26_900.0).abs() < 100.0, "a B star in the paper");
        assert!(Temperature::Wang.of(-0.56).is_err(), "the pole of equation 12");
        assert!(Temperature::Ballesteros.of(f64::NAN).is_err(), "NaN");
    }
}

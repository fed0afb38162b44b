//! How bright and of which colour: magnitudes, irradiance, temperatures (floor 1).
//!
//! Implements equations 10 to 12 of seed 002 (realistic_sky). Equation 11 is printed as `10^(-m - 19)`, which is off by 4
//! decades for the Sun and 15 for a star of magnitude 6; it must be the inverse of equation 10, `10^((-m - 19) / 2.5)`.
//! Equation 12, `7000 K / (B-V + 0.56)`, is good near the Sun's 0.65 and poor at the ends (26 900 K where a B star has
//! 16 600 K): the default is Ballesteros (Europhysics Letters 97, 34008, 2012).
//!
//! Units: magnitudes, W/m² of all light as the paper has it, lx, K. Illuminance: a magnitude of -13.98 is 1 lx outside the
//! air (Allen, Astrophysical Quantities). Error: the Sun's -26.74 gives 1247 W/m² of 1361 (`the_sun_by_equation_11`).
//! Cost: one power.

use crate::error::{Result, in_range};

/// B-V of the Sun, and of the stars whose colour is not known.
pub const SOLAR_COLOR: f64 = 0.65;
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

#[cfg(test)]
mod tests {
    use super::*;

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

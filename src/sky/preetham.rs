//! Preetham's analytic daylight model (Preetham, Shirley and Smits 1999) (floor 3).
//!
//! What the paper realistic_sky means by eqs 7 and 8: luminance and both chromaticities are distributions of their own,
//! each with its own five coefficients (printed, they share one). Coefficients of five digits, as the authors gave
//! them.
//!
//! Limits. The function divides by zero at a turbidity of 1.64 and is negative for some directions up to 1.75:
//! turbidity is held in `[1.8, 10]`. Of a sun on the horizon it keeps 1900 cd/m2, of a sun below it any number: neither
//! is asked. Against a radiative transfer it is some 200 % too bright (facts of the project). Golden values to 1e-6.

use glam::DVec3;

use super::perez::{Formula, Perez, Tint};
use crate::error::{Error, Result, in_range};

/// Turbidities for which no direction has a negative luminance, and whose zenith is not absurd \[1\].
pub const TURBIDITY: [f64; 2] = [1.8, 10.0];

/// Slope and offset in turbidity of `A` to `E`, for Y, x and y.
const COEFFICIENTS: [[[f64; 2]; 5]; 3] = [
    [[0.17872, -1.46303], [-0.35540, 0.42749], [-0.02266, 5.32505], [0.12064, -2.57705], [-0.06696, 0.37027]],
    [[-0.01925, -0.25922], [-0.06651, 0.00081], [-0.00041, 0.21247], [-0.06409, -0.89887], [-0.00325, 0.04517]],
    [[-0.01669, -0.26078], [-0.09495, 0.00921], [-0.00792, 0.21023], [-0.04405, -1.65369], [-0.01092, 0.05291]],
];

/// Chromaticity of the zenith: powers 3 to 0 of the sun's zenith angle for turbidity squared, turbidity and 1.
const ZENITH: [[[f64; 4]; 3]; 2] = [
    [[0.00166, -0.00375, 0.00209, 0.0], [-0.02903, 0.06377, -0.03202, 0.00394], [0.11693, -0.21196, 0.06052, 0.25886]],
    [[0.00275, -0.00610, 0.00317, 0.0], [-0.04214, 0.08970, -0.04153, 0.00516], [0.15346, -0.26756, 0.06670, 0.26688]],
];

/// Luminance of the zenith \[cd/m2\] for a sun at this zenith angle \[rad\].
pub fn zenith_luminance(turbidity: f64, angle: f64) -> f64 {
    let chi = (4.0 / 9.0 - turbidity / 120.0) * (std::f64::consts::PI - 2.0 * angle);
    1e3 * ((4.0453 * turbidity - 4.9710) * chi.tan() - 0.2155 * turbidity + 2.4192)
}

/// Chromaticity of the zenith.
pub fn zenith_chromaticity(turbidity: f64, angle: f64) -> [f64; 2] {
    ZENITH.map(|rows| {
        let [two, one, none] = rows.map(|row| row.into_iter().fold(0.0, |sum, c| sum * angle + c));
        (two * turbidity + one) * turbidity + none
    })
}

fn perez(channel: usize, turbidity: f64) -> Perez {
    Perez::preetham(COEFFICIENTS[channel].map(|[slope, offset]| slope * turbidity + offset))
}

fn valid(turbidity: f64, sun: DVec3) -> Result<()> {
    in_range("turbidity", turbidity, TURBIDITY[0], TURBIDITY[1], "1")?;
    if !sun.is_normalized() || sun.z < -1e-9 {
        return Err(Error::Data { name: "sun", reason: "must be a unit vector not below the horizon".into() });
    }
    Ok(())
}

/// Its chromaticities.
pub fn tint(turbidity: f64, sun: DVec3) -> Result<Tint> {
    valid(turbidity, sun)?;
    let zenith = zenith_chromaticity(turbidity, Formula::sun_zenith(sun));
    Ok(Tint::Varied([0, 1].map(|k| Formula::scaled(perez(k + 1, turbidity), zenith[k], sun))))
}

/// The sky, with this light of the sun's disc.
pub fn sky(turbidity: f64, sun: DVec3, beam: [f64; 3]) -> Result<Formula> {
    valid(turbidity, sun)?;
    let zenith = zenith_luminance(turbidity, Formula::sun_zenith(sun));
    let luminance = Formula::scaled(perez(0, turbidity), zenith, sun);
    Ok(Formula { sun, luminance, tint: tint(turbidity, sun)?, beam })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zenith_is_as_published() {
        for (angle, want) in [(0.0_f64, 23_312.0), (30.0, 8329.0), (60.0, 4374.0), (80.0, 2658.0), (90.0, 1874.0)] {
            let got = zenith_luminance(2.53, angle.to_radians());
            assert!((got - want).abs() < 0.51, "{angle}: {got} against {want}");
        }
    }
}

//! The air in which a simulated cloud grows: saturation vapour pressure, and a sounding (column at rest).
//!
//! From the ground up: a mixed layer of constant static energy and specific humidity, as the sun stirs it in the
//! morning; above it a layer whose temperature falls by `lapse`, and which dries upwards; near the top of the box an
//! inversion that no thermal passes. Pressure is hydrostatic.

use crate::math::elementary::exp;

/// Gravity \[m/s²\].
pub const GRAVITY: f64 = 9.80665;
/// Heat capacity of air at constant pressure [J/kg/K].
pub const HEAT_CAPACITY: f64 = 1004.7;
/// Gas constant of dry air [J/kg/K].
pub const GAS: f64 = 287.05;
/// Latent heat of condensation at 0 °C \[J/kg\]; constant, as in the paper.
pub const LATENT: f64 = 2.5008e6;
/// Ratio of the gas constants of air and vapour.
pub const EPSILON: f64 = 0.622;
/// Buoyancy of vapour: 1 / EPSILON − 1.
pub const LIGHTNESS: f64 = 0.608;
/// Cooling of rising dry air \[K/m\].
pub const DRY_LAPSE: f64 = GRAVITY / HEAT_CAPACITY;
/// Pressure at the ground \[Pa\].
pub const GROUND_PRESSURE: f64 = 101_325.0;
/// Vertical extent of the inversion, as a fraction of the box's height.
pub const INVERSION: f64 = 0.22;

/// Vapour that air can hold, as a mass per mass of moist air \[1\], and its change with temperature [1/K]: Bolton 1980,
/// eq 10, for temperatures in K and pressures in Pa. Not valid below about −60 °C, where there is hardly any vapour.
#[inline(always)]
pub fn saturation(temperature: f32, pressure: f32) -> (f32, f32) {
    let above = temperature - 29.65;
    let above = if above > 60.0 { above } else { 60.0 };
    let vapour = 611.2 * exp(17.67 * (temperature - 273.15) / above);
    let dry = pressure - (1.0 - EPSILON as f32) * vapour;
    // Where the air would boil, it holds what it is given.
    let dry = if dry > 0.1 * pressure { dry } else { 0.1 * pressure };
    let ratio = EPSILON as f32 * vapour / dry;
    let growth = 17.67 * 243.5 / (above * above);
    (ratio, ratio * growth * pressure / dry)
}

/// Levels of a column at rest, at the middles of the cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Sounding {
    /// Pressure \[Pa\].
    pub pressure: Vec<f64>,
    /// Temperature \[K\].
    pub temperature: Vec<f64>,
    /// Mass of vapour per mass of air \[1\].
    pub vapour: Vec<f64>,
    /// Height at which lifted air of the mixed layer condenses \[m\]; infinite where the box ends below it.
    pub base: f64,
}

impl Sounding {
    /// `levels` cells of height `step` \[m\] over ground of the given temperature \[K\] and relative humidity \[1\].
    pub fn new(levels: usize, step: f64, ground: f64, humidity: f64, lapse: f64) -> Self {
        let holds = |t: f64, p: f64| f64::from(saturation(t as f32, p as f32).0);
        let moist = humidity * holds(ground, GROUND_PRESSURE);
        // Lifting without mixing: where does it condense?
        let (fine, top) = ((step / 32.0).min(2.0), levels as f64 * step);
        let (mut z, mut t, mut p) = (0.0, ground, GROUND_PRESSURE);
        while z < top && holds(t, p) > moist {
            p *= (-GRAVITY * fine / (GAS * t * (1.0 + LIGHTNESS * moist))).exp();
            (z, t) = (z + fine, t - DRY_LAPSE * fine);
        }
        let base = if z < top { z } else { f64::INFINITY };
        let mixed = 0.9 * z;
        let inversion = (1.0 - INVERSION) * top;
        let mut column = Self { pressure: vec![], temperature: vec![], vapour: vec![], base };
        let (mut t, mut p, mut q) = (ground, GROUND_PRESSURE, moist);
        let mut at_mixed = 0.0;
        let parts = (step / fine).ceil().max(2.0) as usize / 2 * 2;
        let fine = step / parts as f64;
        for level in 0..levels {
            for part in 0..parts {
                if part == parts / 2 {
                    column.pressure.push(p);
                    column.temperature.push(t);
                    column.vapour.push(q);
                }
                let z = level as f64 * step + part as f64 * fine;
                p *= (-GRAVITY * fine / (GAS * t * (1.0 + LIGHTNESS * q))).exp();
                let cooling = if z < mixed {
                    DRY_LAPSE
                } else if z < inversion {
                    lapse
                } else {
                    -0.008
                };
                // The stratosphere ends every fall.
                t = (t - cooling * fine).max(t.min(200.0));
                if z < mixed {
                    at_mixed = (q / holds(t, p)).min(0.95);
                } else {
                    // Drier by a third in a kilometre, and never moister than below.
                    q = q.min(at_mixed * (-(z - mixed) / 2500.0).exp() * holds(t, p));
                }
            }
        }
        column
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saturation_is_that_of_the_tables() {
        // Vapour pressures over water [hPa], Goff and Gratch 1946 (Smithsonian Meteorological Tables, table 94).
        for (celsius, vapour) in [(-10.0, 2.8627), (0.0, 6.1078), (10.0, 12.272), (20.0, 23.373), (30.0, 42.430)] {
            let (ratio, slope) = saturation(273.15 + celsius, 1e5);
            let exact = 0.622 * vapour / (1000.0 - 0.378 * vapour);
            assert!((ratio / exact - 1.0).abs() < 0.003, "{celsius} °C: {ratio} for {exact}");
            let higher = saturation(273.65 + celsius, 1e5).0;
            assert!(((higher - ratio) / 0.5 / slope - 1.0).abs() < 0.03, "slope at {celsius} °C");
        }
    }

    #[test]
    fn a_column_is_stable_dry_enough_and_hydrostatic() {
        let column = Sounding::new(64, 40.0, 298.0, 0.6, 0.0065);
        for k in 1..64 {
            let fall = (column.temperature[k - 1] - column.temperature[k]) / 40.0;
            assert!(fall < DRY_LAPSE + 1e-6, "not unstable at {k}");
            let (t, p) = (column.temperature[k], column.pressure[k]);
            assert!(column.vapour[k] < f64::from(saturation(t as f32, p as f32).0), "no cloud at {k}");
            let mean = 0.5 * (t * (1.0 + LIGHTNESS * column.vapour[k]) + column.temperature[k - 1]);
            let thickness = GAS * mean / GRAVITY * (column.pressure[k - 1] / p).ln();
            assert!((thickness - 40.0).abs() < 0.5, "hydrostatic at {k}: {thickness}");
        }
        assert!((800.0..1200.0).contains(&column.base), "base at {}", column.base);
    }
}

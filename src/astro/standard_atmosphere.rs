//! The U.S. Standard Atmosphere 1976: number density, pressure and temperature of the air by height (floor 1).
//!
//! Barometric layers of constant lapse rate up to 86 km, above that the standard's table, to 120 km. Units: metres,
//! kelvins; densities and pressures over those on the ground at 1013.25 hPa and 288.15 K. Held to the printed values
//! (`the_standard_atmosphere_is_as_printed`).

/// Layers: geopotential height \[m\], temperature \[K\] there and its change upwards \[K/m\].
const LAYERS: [[f64; 3]; 7] = [
    [0.0, 288.15, -6.5e-3],
    [11e3, 216.65, 0.0],
    [20e3, 216.65, 1e-3],
    [32e3, 228.65, 2.8e-3],
    [47e3, 270.65, 0.0],
    [51e3, 270.65, -2.8e-3],
    [71e3, 214.65, -2.0e-3],
];
/// Radius of the standard's Earth \[m\]; gravity over the gas constant of air \[K/m\].
const RADIUS: f64 = 6_356_766.0;
const HYDROSTATIC: f64 = 9.80665 * 28.9644e-3 / 8.31432;
/// Number density on the ground \[1/m3\], and from 86 km on: height \[m\], number density.
const GROUND: f64 = 2.5470e25;
const HIGH: [[f64; 2]; 8] = [
    [86e3, 1.447e20],
    [90e3, 7.116e19],
    [95e3, 2.920e19],
    [100e3, 1.189e19],
    [105e3, 5.021e18],
    [110e3, 2.144e18],
    [115e3, 9.681e17],
    [120e3, 5.107e17],
];

/// Pressure over that on the ground and temperature \[K\], up to 86 km; below the ground the lowest layer goes on.
pub fn pressure_and_temperature(h: f64) -> (f64, f64) {
    let [mut pressure, mut temperature] = [1.0, LAYERS[0][1]];
    let z = RADIUS * h / (RADIUS + h);
    for (i, [base, start, lapse]) in LAYERS.into_iter().enumerate() {
        let end = LAYERS.get(i + 1).map_or(f64::INFINITY, |next| next[0]).min(z);
        temperature = start + lapse * (end - base);
        pressure *= if lapse == 0.0 {
            (-HYDROSTATIC * (end - base) / start).exp()
        } else {
            (start / temperature).powf(HYDROSTATIC / lapse)
        };
        if z <= end {
            break;
        }
    }
    (pressure, temperature)
}

/// Number density over that on the ground.
pub fn density(h: f64) -> f64 {
    if h >= HIGH[0][0] {
        let i = HIGH.partition_point(|x| x[0] <= h).clamp(1, HIGH.len() - 1);
        let ([a, low], [b, high]) = (HIGH[i - 1], HIGH[i]);
        return (low.ln() + (h - a) / (b - a) * (high / low).ln()).exp() / GROUND;
    }
    let (pressure, temperature) = pressure_and_temperature(h);
    pressure * LAYERS[0][1] / temperature
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_atmosphere_is_as_printed() {
        // Density over that on the ground by the tables of the standard (NOAA-S/T 76-1562).
        for (h, want) in [
            (0.0, 1.0),
            (5e3, 0.60117),
            (11e3, 0.29780),
            (20e3, 7.2580e-2),
            (30e3, 1.5029e-2),
            (40e3, 3.2618e-3),
            (50e3, 8.3827e-4),
            (60e3, 2.5280e-4),
            (70e3, 6.7616e-5),
            (80e3, 1.5068e-5),
        ] {
            let got = density(h);
            assert!((got / want - 1.0).abs() < 1e-3, "at {h} m: {got} against {want}");
        }
        assert!((density(100e3) * GROUND / 1.189e19 - 1.0).abs() < 1e-12, "its table above");
        let step = density(HIGH[0][0] - 1e-3) / density(HIGH[0][0]);
        assert!((step - 1.0).abs() < 5e-3, "where the table begins: {step}");
        let (pressure, temperature) = pressure_and_temperature(5e3);
        assert!((pressure * 1013.25 - 540.48).abs() < 0.1 && (temperature - 255.676).abs() < 0.01, "{pressure}");
    }
}

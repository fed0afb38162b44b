//! The visible spectrum in bands (floor 1): the eye, the Sun above the air, ozone.
//!
//! Rows of 10 nm from 370 to 740: CIE 1931 2-degree observer; irradiance of the Sun above the air \[W/m2/nm\], ASTM
//! G-173 (means of the 20 nm around); ozone cross section at 233 K \[1e-26 m2\], Serdyuchenko et al. 2014 (likewise).

/// Wavelength \[nm\], the three matching functions, the Sun, ozone.
const ROWS: [[f64; 6]; 38] = [
    [370.0, 0.0004149, 1.239e-05, 0.001946, 1.13017, 0.06991],
    [380.0, 0.001368, 3.9e-05, 0.00645, 1.07754, 0.025],
    [390.0, 0.004243, 0.00012, 0.02005, 1.07983, 0.04727],
    [400.0, 0.01431, 0.000396, 0.06785, 1.43741, 0.10953],
    [410.0, 0.04351, 0.00121, 0.2074, 1.7291, 0.2145],
    [420.0, 0.13438, 0.004, 0.6456, 1.70962, 0.41415],
    [430.0, 0.2839, 0.0116, 1.3856, 1.65062, 0.69855],
    [440.0, 0.34828, 0.023, 1.74706, 1.76226, 1.21355],
    [450.0, 0.3362, 0.038, 1.77211, 1.97336, 1.949],
    [460.0, 0.2908, 0.06, 1.6692, 2.02758, 2.9925],
    [470.0, 0.19536, 0.09098, 1.28764, 2.02127, 4.2965],
    [480.0, 0.09564, 0.13902, 0.81295, 1.97795, 6.338],
    [490.0, 0.03201, 0.20802, 0.46518, 1.94593, 8.384],
    [500.0, 0.0049, 0.323, 0.272, 1.93748, 11.908],
    [510.0, 0.0093, 0.503, 0.1582, 1.87333, 15.41],
    [520.0, 0.06327, 0.71, 0.07825, 1.84915, 18.705],
    [530.0, 0.1655, 0.862, 0.04216, 1.8808, 24.47],
    [540.0, 0.2904, 0.954, 0.0203, 1.8723, 29.23],
    [550.0, 0.43345, 0.99495, 0.00875, 1.85095, 32.955],
    [560.0, 0.5945, 0.995, 0.0039, 1.84225, 38.83],
    [570.0, 0.7621, 0.952, 0.0021, 1.8343, 44.69],
    [580.0, 0.9163, 0.87, 0.00165, 1.8246, 45.35],
    [590.0, 1.0263, 0.757, 0.0011, 1.79814, 45.495],
    [600.0, 1.0622, 0.631, 0.0008, 1.76744, 48.6],
    [610.0, 1.0026, 0.503, 0.00034, 1.7249, 46.62],
    [620.0, 0.85445, 0.381, 0.00019, 1.68922, 40.225],
    [630.0, 0.6424, 0.265, 5e-05, 1.66424, 34.775],
    [640.0, 0.4479, 0.175, 2e-05, 1.62567, 29.385],
    [650.0, 0.2835, 0.107, 2.11758e-22, 1.56312, 24.5],
    [660.0, 0.1649, 0.061, 0.0, 1.53883, 20.45],
    [670.0, 0.0874, 0.032, 0.0, 1.53376, 16.625],
    [680.0, 0.04677, 0.017, 0.0, 1.49265, 13.41],
    [690.0, 0.0227, 0.00821, 0.0, 1.4611, 10.7565],
    [700.0, 0.0113592, 0.004102, 0.0, 1.42919, 8.439],
    [710.0, 0.00579035, 0.002091, 0.0, 1.38897, 7.0105],
    [720.0, 0.00289933, 0.001047, 0.0, 1.35481, 5.8355],
    [730.0, 0.00143997, 0.00052, 0.0, 1.32808, 4.6275],
    [740.0, 0.000690079, 0.0002492, 0.0, 1.29866, 4.189],
];

/// Lumens of a watt at the eye's peak.
const LUMENS: f64 = 683.002;

/// One wavelength for each channel, where three must do for a spectrum \[nm\]: in air the light of these is that of Rec. 709's
/// red, green and blue.
pub const CHANNEL_WAVELENGTHS: [f64; 3] = [645.0, 543.0, 441.5];

/// A band of the spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralBand {
    /// Wavelength that stands for it \[nm\]: the mean, weighed by the Sun and the eye.
    pub wavelength: f64,
    /// XYZ of the Sun in this band, above the air \[lx\].
    pub sun: [f64; 3],
    /// Cross section of ozone \[m2\].
    pub ozone: f64,
}

/// The spectrum in `N` bands of two rows each from 380 nm on; what is left at the ends goes to the outermost.
pub fn bands<const N: usize>() -> [SpectralBand; N] {
    let mut out = [SpectralBand { wavelength: 0.0, sun: [0.0; 3], ozone: 0.0 }; N];
    let mut weights = [0.0; N];
    for (k, [wavelength, x, y, z, sun, ozone]) in ROWS.into_iter().enumerate() {
        let band = &mut out[(k.saturating_sub(1) / 2).min(N - 1)];
        let weight = (x + y + z) * sun;
        weights[(k.saturating_sub(1) / 2).min(N - 1)] += weight;
        band.wavelength += weight * wavelength;
        band.ozone += weight * ozone * 1e-26;
        for (to, cmf) in band.sun.iter_mut().zip([x, y, z]) {
            *to += cmf * sun * 10.0 * LUMENS;
        }
    }
    for (band, weight) in out.iter_mut().zip(weights) {
        band.wavelength /= weight;
        band.ozone /= weight;
    }
    out
}

/// The matching functions of `N` bands of one row each from 380 nm on.
pub fn observer<const N: usize>() -> [[f64; 3]; N] {
    std::array::from_fn(|k| {
        let [_, x, y, z, _, _] = ROWS[k + 1];
        [x, y, z]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_above_the_air_is_as_bright_as_it_is() {
        let sum = |k: usize| bands::<16>().iter().map(|b| b.sun[k]).sum::<f64>();
        let (x, y, z) = (sum(0), sum(1), sum(2));
        // The illuminance of the Sun at the mean distance is 133 to 134 klx, its chromaticity (0.323, 0.332) or near.
        assert!((130e3..136e3).contains(&y), "illuminance {y}");
        let total = x + y + z;
        assert!((x / total - 0.323).abs() < 0.004 && (y / total - 0.333).abs() < 0.004, "{} {}", x / total, y / total);
        assert!(bands::<16>().windows(2).all(|w| w[0].wavelength < w[1].wavelength), "ascending");
    }
}

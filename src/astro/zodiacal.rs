//! Luminance of the zodiacal light (floor 1).
//!
//! Implements table 17 of Leinert et al., The 1997 reference of diffuse night sky brightness (Astronomy and
//! Astrophysics Supplement 127, 1, 1998): radiance at 500 nm by ecliptic longitude from the Sun and ecliptic latitude.
//! Table 1 of the paper realistic_sky prints zodiacal light 25 to 36 times darker than this.
//!
//! Between the nodes: the logarithm of the table over a power law of elongation, by cubics in both angles whose
//! tangents are those of the parabola through three nodes; smooth to the first derivative, exact at the nodes. The
//! table ends 14° to 16° from the Sun. Inside, the power law goes on with the exponent -2.25 (of the F corona, from
//! memory: Koutchmy and Lamy 1985; the table itself has -2.0 to -2.4 from 15° to 25°), at each position angle from
//! where the table ends, and is levelled within 1° of the Sun. No night sees that part.
//!
//! Its colour is taken to be the Sun's; it is a little redder. Seasons (10 %, from memory: the Earth leaves the plane
//! of symmetry) are not in the table.
//!
//! Units: radians, cd/m² outside the air. Error: that of the table, 10 to 15 % (from memory); four-point interpolation
//! between samples 0.6° apart is within 1.1e-3 beyond 16° from the Sun (`test_dark_sky.py`). Cost: 0.2 µs.

use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

use crate::error::Result;
use crate::job::Job;
use crate::math::elementary::exp64;
use crate::math::interpolation::hermite_step;

/// Mean luminance of the hemisphere opposite the Sun \[cd/m²\]. It stands for the zenith of a night of unknown hour;
/// the whole sky of one has 0.9e-4 to 1.6e-4, and nearer to the Sun is light that no night has (beyond 15° from it:
/// 2.1e-4).
pub const MEAN: f64 = 8.82e-5;

/// Luminance of a radiance of 1e-8 W/(m² sr µm) at 500 nm with the Sun's spectrum \[cd/m²\]: 683 lm/W times the
/// integral of ASTM G-173 (above the air) and the CIE 1931 observer, over the irradiance from 490 to 510 nm
/// (`test_dark_sky.py`).
const LUMINANCE: f64 = 6.87e-7;
/// Square of the chord within which the light near the Sun is levelled, that of 1°.
const LEVELLED: f64 = 3.046e-4;

/// Ecliptic longitudes from the Sun \[°\].
const LONGITUDES: [f64; 19] = [
    0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 135.0, 150.0, 165.0,
    180.0,
];
/// Ecliptic latitudes \[°\].
const LATITUDES: [f64; 11] = [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 45.0, 60.0, 75.0, 90.0];
/// Radiance at 500 nm \[1e-8 W/(m² sr µm)\]. The eight values within 14° of the Sun are continued, not tabulated.
#[rustfmt::skip]
const TABLE: [[f64; 11]; 19] = [
    [2170000.0, 35600.0, 7740.0, 3140.0, 1610.0, 985.0, 640.0, 275.0, 150.0, 100.0, 77.0],
    [130000.0, 22100.0, 6820.0, 2940.0, 1540.0, 945.0, 625.0, 271.0, 150.0, 100.0, 77.0],
    [28400.0, 12000.0, 4740.0, 2470.0, 1370.0, 865.0, 590.0, 264.0, 148.0, 100.0, 77.0],
    [11500.0, 6780.0, 3440.0, 1860.0, 1110.0, 755.0, 525.0, 251.0, 146.0, 100.0, 77.0],
    [6400.0, 4480.0, 2410.0, 1410.0, 910.0, 635.0, 454.0, 237.0, 141.0, 99.0, 77.0],
    [3840.0, 2830.0, 1730.0, 1100.0, 749.0, 545.0, 410.0, 223.0, 136.0, 97.0, 77.0],
    [2480.0, 1870.0, 1220.0, 845.0, 615.0, 467.0, 365.0, 207.0, 131.0, 95.0, 77.0],
    [1650.0, 1270.0, 910.0, 680.0, 510.0, 397.0, 320.0, 193.0, 125.0, 93.0, 77.0],
    [1180.0, 940.0, 700.0, 530.0, 416.0, 338.0, 282.0, 179.0, 120.0, 92.0, 77.0],
    [910.0, 730.0, 555.0, 442.0, 356.0, 292.0, 250.0, 166.0, 116.0, 90.0, 77.0],
    [505.0, 442.0, 352.0, 292.0, 243.0, 209.0, 183.0, 134.0, 104.0, 86.0, 77.0],
    [338.0, 317.0, 269.0, 227.0, 196.0, 172.0, 151.0, 116.0, 93.0, 82.0, 77.0],
    [259.0, 251.0, 225.0, 193.0, 166.0, 147.0, 132.0, 104.0, 86.0, 79.0, 77.0],
    [212.0, 210.0, 197.0, 170.0, 150.0, 133.0, 119.0, 96.0, 82.0, 77.0, 77.0],
    [188.0, 186.0, 177.0, 154.0, 138.0, 125.0, 113.0, 90.0, 77.0, 74.0, 77.0],
    [179.0, 178.0, 166.0, 147.0, 134.0, 122.0, 110.0, 90.0, 77.0, 73.0, 77.0],
    [179.0, 178.0, 165.0, 148.0, 137.0, 127.0, 116.0, 96.0, 79.0, 72.0, 77.0],
    [196.0, 192.0, 179.0, 165.0, 151.0, 141.0, 131.0, 104.0, 82.0, 72.0, 77.0],
    [230.0, 212.0, 195.0, 178.0, 163.0, 148.0, 134.0, 105.0, 83.0, 72.0, 77.0],
];

/// The power law: the chord to the power -2.25. A chord is a smooth function of direction where an angle is not.
fn near_sun(longitude: f64, latitude: f64) -> f64 {
    let squared = 2.0 - 2.0 * longitude.cos() * latitude.cos() + LEVELLED;
    1.0 / (squared * squared.sqrt().sqrt().sqrt())
}

/// Logarithms of the table in cd/m² over the power law.
fn ratios() -> &'static [[f64; 11]; 19] {
    static RATIOS: OnceLock<[[f64; 11]; 19]> = OnceLock::new();
    RATIOS.get_or_init(|| {
        let mut out = TABLE;
        for (row, longitude) in out.iter_mut().zip(LONGITUDES) {
            for (value, latitude) in row.iter_mut().zip(LATITUDES) {
                *value = (LUMINANCE * *value / near_sun(longitude.to_radians(), latitude.to_radians())).ln();
            }
        }
        out
    })
}

/// The four nodes around `x` and their weights; beyond both ends the table is its mirror image.
fn cubic(nodes: &[f64], x: f64) -> ([usize; 4], [f64; 4]) {
    let last = nodes.len() - 1;
    let i = nodes.partition_point(|&n| n <= x).clamp(1, last) - 1;
    let at = [if i == 0 { 1 } else { i - 1 }, i, i + 1, if i + 1 == last { last - 1 } else { i + 2 }];
    let gap = |a: usize, b: usize| (nodes[at[a]] - nodes[at[b]]).abs();
    let (before, here, after) = (gap(1, 0), gap(2, 1), gap(3, 2));
    let t = (x - nodes[i]) / here;
    let u = 1.0 - t;
    // Hermite's basis: values at both ends, tangents times the gap.
    let (start, end) = ((1.0 + 2.0 * t) * u * u, hermite_step(t));
    let (leave, arrive) = (t * u * u * here, -t * t * u * here);
    // Tangents of the parabola through three nodes.
    let left =
        [-here / (before * (before + here)), (here - before) / (before * here), before / (here * (before + here))];
    let right = [-after / (here * (here + after)), (after - here) / (here * after), here / (after * (here + after))];
    let weights = [
        leave * left[0],
        start + leave * left[1] + arrive * right[0],
        end + leave * left[2] + arrive * right[1],
        arrive * right[2],
    ];
    (at, weights)
}

/// Luminance at an ecliptic longitude from the Sun, any finite angle, and an ecliptic latitude in `[-pi/2, pi/2]`
/// \[cd/m²\].
pub fn luminance(longitude: f64, latitude: f64) -> f64 {
    let longitude = (longitude - TAU * (longitude / TAU).round()).abs().clamp(0.0, PI);
    let latitude = latitude.abs().clamp(0.0, PI / 2.0);
    let (rows, along) = cubic(&LONGITUDES, longitude.to_degrees());
    let (columns, across) = cubic(&LATITUDES, latitude.to_degrees());
    let ratios = ratios();
    let mut sum = 0.0;
    for (i, a) in rows.into_iter().zip(along) {
        sum += a * columns.into_iter().zip(across).map(|(j, w)| w * ratios[i][j]).sum::<f64>();
    }
    exp64(sum) * near_sun(longitude, latitude)
}

/// [`luminance`] at many places.
pub fn luminances(job: &Job, longitude: &[f64], latitude: &[f64], out: &mut [f64]) -> Result<()> {
    const CHUNK: usize = 1 << 12;
    job.chunks(out, CHUNK, |k, chunk| {
        let at = longitude[k * CHUNK..].iter().zip(&latitude[k * CHUNK..]);
        chunk.iter_mut().zip(at).for_each(|(o, (&l, &b))| *o = luminance(l, b));
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_that_of_the_sky_of_a_night() {
        let count = 400;
        let (mut sum, mut area) = (0.0, 0.0);
        for i in 0..count {
            let latitude = PI / 2.0 * (f64::from(i) + 0.5) / f64::from(count);
            for j in 0..2 * count {
                let longitude = PI * (f64::from(j) + 0.5) / f64::from(2 * count);
                if longitude.cos() < 0.0 {
                    sum += luminance(longitude, latitude) * latitude.cos();
                    area += latitude.cos();
                }
            }
        }
        assert!((sum / area / MEAN - 1.0).abs() < 2e-3, "{}", sum / area);
    }

    #[test]
    fn nodes_are_met_and_angles_wrap() {
        for (row, longitude) in TABLE.iter().zip(LONGITUDES) {
            for (value, latitude) in row.iter().zip(LATITUDES) {
                for (l, b) in [(longitude, latitude), (360.0 - longitude, -latitude), (longitude - 720.0, latitude)] {
                    let got = luminance(l.to_radians(), b.to_radians()) / LUMINANCE;
                    assert!((got / value - 1.0).abs() < 1e-9, "{got} at {l}, {b}, not {value}");
                }
            }
        }
    }

    #[test]
    fn it_brightens_towards_the_sun_and_stays_finite() {
        for angle in [0.0_f64, 0.5, 1.0, 1.5] {
            let toward = |away: f64| luminance(away.to_radians() * angle.cos(), away.to_radians() * angle.sin());
            let bright: Vec<f64> = (0..120).map(|i| toward(0.25 * f64::from(i))).collect();
            assert!(bright.windows(2).all(|w| w[1] < w[0]), "at position angle {angle}");
        }
        assert!(luminance(0.0, 0.0) < 10.0, "{} cd/m²", luminance(0.0, 0.0));
        assert!(luminance(f64::NAN, 0.0).is_nan() && luminance(0.0, f64::NAN).is_nan(), "NaN in, NaN out");
    }

    #[test]
    fn a_look_costs_little() {
        let start = std::time::Instant::now();
        let sum: f64 = (0..100_000).map(|i| luminance(f64::from(i), 1e-5 * f64::from(i))).sum();
        let each = start.elapsed().as_secs_f64() / 1e5 * 1e9;
        println!("a look: {each:.0} ns (checksum {sum})");
        assert!(each < 5000.0 && sum.is_finite(), "{each} ns");
    }
}

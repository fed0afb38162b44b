//! Luminance of the starlight that is not drawn as points: the Milky Way, and what lies between the stars elsewhere
//! (floor 1).
//!
//! Shape: five nested isophotes of the Milky Way (`tables/SOURCES.md`: the outermost from a chart for the eye, the
//! others contours of Mellinger's photographic mosaic), each filled, blurred by 1.6° and added; Andromeda and the
//! Clouds of Magellan as exponential discs of their integrated magnitude, blurred likewise; a layer seen from inside
//! for the rest. Nothing in it is finer than about 1.5°. Diffuse galactic light is included, the stars of V ≤ 6.5 are
//! not.
//!
//! Levels: none is in the source. They are chosen from what is commonly quoted for visual light (from memory), and good
//! to a factor of 1.5: near the galactic centre up to 640 S10, Cygnus 290, the plane of the anticentre 110, the
//! galactic poles 28, of which 10 to 15 are diffuse light. Quoted with the stars of V ≤ 6.5: poles 30, equator 160 to
//! 640 S10 (P. Schlyter, Radiometry and photometry in astronomy). The fraction of the stars of V ≤ 6.5, by our table:
//! 41 S10 within 5° of the equator, 16 beyond 60°, 23.2 in the mean of the sphere; it is not in the levels above.
//!
//! Table: galactic longitude and latitude by 1.5°, 16 bits of a logarithm; read as control points of a bicubic
//! B-spline, which is smooth to the second derivative. Around the poles only the smooth layer is left.
//!
//! Units: cd/m², outside the air. Error: four-point interpolation between samples 0.6° apart is within 1e-3
//! (`test_dark_sky.py`). Cost: 0.3 µs.

use std::sync::OnceLock;

use glam::{DMat3, DVec3};

use crate::astro::{light, tables};

/// Mean luminance of all starlight over the sphere \[cd/m²\]: of this field and of the stars of V ≤ 6.5.
pub const MEAN: f64 = 7.752e-5;

/// Galactic axes in the ICRS, transposed: The Hipparcos and Tycho Catalogues, volume 1, equation 1.5.11.
const GALACTIC: DMat3 = DMat3::from_cols_array_2d(&[
    [-0.054_875_560_4, 0.494_109_427_9, -0.867_666_149_0],
    [-0.873_437_090_2, -0.444_829_630_0, -0.198_076_373_4],
    [-0.483_835_015_5, 0.746_982_244_5, 0.455_983_776_2],
]);
/// Points in a circle of latitude and from pole to pole.
const COLUMNS: usize = 240;
const ROWS: usize = 121;

fn control_points() -> &'static [f64] {
    static POINTS: OnceLock<Vec<f64>> = OnceLock::new();
    POINTS.get_or_init(|| {
        let step = 100_f64.ln() / 65535.0;
        let level = |b: &[u8; 2]| 10.0 * light::S10 * (f64::from(u16::from_le_bytes(*b)) * step).exp();
        tables::MILKY_WAY.as_chunks::<2>().0.iter().map(level).collect()
    })
}

/// Weights of a uniform cubic B-spline at `t` of the way from the second of four points to the third.
fn spline(t: f64) -> [f64; 4] {
    let (u, t2) = (1.0 - t, t * t);
    let t3 = t2 * t;
    [u * u * u / 6.0, (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0, (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0) / 6.0, t3 / 6.0]
}

/// Luminance in a direction \[cd/m²\]: a unit vector in the ICRS.
pub fn luminance(to: DVec3) -> f64 {
    let to = GALACTIC * to;
    let longitude = to.y.atan2(to.x).to_degrees().rem_euclid(360.0);
    let latitude = to.z.atan2((to.x * to.x + to.y * to.y).sqrt()).to_degrees();
    let (x, y) = (longitude / 360.0 * COLUMNS as f64, (latitude + 90.0) / 180.0 * (ROWS - 1) as f64);
    let (column, row) = (x.floor(), y.floor().min((ROWS - 2) as f64));
    let (along, across) = (spline(x - column), spline(y - row));
    let (column, row) = (column as usize, row as usize);
    let points = control_points();
    let columns = [0, 1, 2, 3].map(|j| (column + j + COLUMNS - 1) % COLUMNS);
    let turned = columns.map(|j| (j + COLUMNS / 2) % COLUMNS);
    let mut sum = 0.0;
    for (i, a) in across.into_iter().enumerate() {
        // One less than asked, so that the row before the first has a number; beyond a pole lies the other side.
        let (row, columns) = match row + i {
            0 => (1, turned),
            past if past > ROWS => (2 * ROWS - 1 - past, turned),
            inside => (inside - 1, columns),
        };
        let line = &points[row * COLUMNS..][..COLUMNS];
        sum += a * columns.into_iter().zip(along).map(|(j, w)| w * line[j]).sum::<f64>();
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astro::stars;
    use std::f64::consts::PI;

    /// Directions of equal area, a Fibonacci lattice.
    fn everywhere(count: u32) -> impl Iterator<Item = DVec3> {
        (0..count).map(move |i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (sin, cos) = (f64::from(i) * PI * (3.0 - 5_f64.sqrt())).sin_cos();
            let flat = (1.0 - z * z).sqrt();
            DVec3::new(flat * cos, flat * sin, z)
        })
    }

    #[test]
    fn the_mean_is_that_of_the_field_and_the_bright_stars() {
        let count = 200_000;
        let field = everywhere(count).map(luminance).sum::<f64>() / f64::from(count);
        let stars = stars::catalogue().iter().map(|s| light::illuminance(s.magnitude)).sum::<f64>() / (4.0 * PI);
        println!("field {:.2} S10, stars {:.2} S10", field / light::S10, stars / light::S10);
        assert!(((field + stars) / MEAN - 1.0).abs() < 2e-3, "{}", field + stars);
        assert!((stars / light::S10 - 23.2).abs() < 0.05, "the share that the head of this file states");
    }

    #[test]
    fn the_poles_have_one_value_and_no_seam() {
        for pole in [GALACTIC.transpose() * DVec3::Z, -(GALACTIC.transpose() * DVec3::Z)] {
            let side = pole.any_orthonormal_vector();
            let at = luminance(pole);
            assert!((at / light::S10 - 28.0).abs() < 0.1, "{}", at / light::S10);
            for angle in 0..12 {
                let away = side * f64::from(angle).cos() + pole.cross(side) * f64::from(angle).sin();
                let near = luminance((pole + 1e-6 * away).normalize());
                assert!((near / at - 1.0).abs() < 1e-5, "{near} beside {at}");
            }
        }
        // Beside the longitude of the centre.
        let at = |y: f64| luminance(GALACTIC.transpose() * DVec3::new(1.0, y, 0.1).normalize());
        assert!((at(1e-9) / at(-1e-9) - 1.0).abs() < 1e-7, "the circle closes");
    }

    #[test]
    fn a_look_costs_little() {
        let start = std::time::Instant::now();
        let sum: f64 = everywhere(100_000).map(luminance).sum();
        let each = start.elapsed().as_secs_f64() / 1e5 * 1e9;
        println!("a look: {each:.0} ns (checksum {sum})");
        assert!(each < 5000.0 && sum.is_finite(), "{each} ns");
        assert!(luminance(DVec3::NAN).is_nan(), "NaN in, NaN out");
    }
}

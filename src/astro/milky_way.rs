//! Luminance of the starlight that is not drawn as points: the Milky Way with its dust lanes and star clouds, and what lies
//! between the stars elsewhere (floor 1).
//!
//! Shape: A. Mellinger's photographic all-sky panorama (`tables/SOURCES.md`), without its single stars, blurred to 0.6°. It
//! is not photometric: its tone curve is taken as it is, green and blue weighed by `GREEN` and `BLUE` of
//! `scripts/make_astro_tables.py`, and a layer seen from inside added where it is black. Diffuse galactic light is included,
//! the stars of V ≤ 6.5 are not; the Clouds of Magellan and Andromeda are those of the picture.
//!
//! Levels: chosen so that six fields 10° across have, with the stars of V ≤ 6.5, what is commonly quoted (good to 30 %): galactic
//! centre 400 S10, Sagittarius cloud 500, Cygnus 250, Carina 375, anticentre 145, poles 32
//! (`test_the_milky_way_has_its_levels`: within 25 %). The mean of ln luminance in circles of 4° against the light of Gaia's stars of
//! 6.5 < G < 10, which had no part in it, correlates with 0.86 within 30° of the plane
//! (`test_the_milky_way_lies_where_its_stars_are`). The fraction of the stars of V ≤ 6.5, by our table: 23.2 S10 in the mean of
//! the sphere.
//!
//! Stars that are drawn singly to a fainter limit are taken out of the field ([`Drawn`]), smoothed by 1.5°.
//!
//! Table: the picture in galactic longitude and latitude by 0.5°, 8 bits of a logarithm; read as control points of a bicubic
//! B-spline, which is smooth to the second derivative.
//!
//! Units: cd/m², outside the air. Cost: 0.3 µs.

use std::sync::OnceLock;

use glam::{DMat3, DVec3};

use crate::astro::{light, tables};

/// Mean luminance of all starlight over the sphere \[cd/m²\]: of this field and of the stars of V ≤ 6.5.
pub const MEAN: f64 = 7.181e-5;

/// Galactic axes in the ICRS, transposed: The Hipparcos and Tycho Catalogues, volume 1, equation 1.5.11.
const GALACTIC: DMat3 = DMat3::from_cols_array_2d(&[
    [-0.054_875_560_4, 0.494_109_427_9, -0.867_666_149_0],
    [-0.873_437_090_2, -0.444_829_630_0, -0.198_076_373_4],
    [-0.483_835_015_5, 0.746_982_244_5, 0.455_983_776_2],
]);
/// Points in a circle of latitude and from pole to pole.
const COLUMNS: usize = 720;
const ROWS: usize = 361;

/// Light where the picture is black \[S10\]: a layer of stars seen from inside, brighter towards the centre.
fn layer(longitude: f64, latitude: f64) -> f64 {
    let (sin, cos) = latitude.sin_cos();
    20.0 * (1.09 / (sin * sin + 0.09)).sqrt().sqrt() * (1.0 + 0.25 * cos * longitude.cos())
}

fn control_points() -> &'static [f64] {
    static POINTS: OnceLock<Vec<f64>> = OnceLock::new();
    POINTS.get_or_init(|| {
        let step = 81_f64.ln() / 255.0;
        let level = |(i, b): (usize, &u8)| {
            let longitude = (i % COLUMNS) as f64 / COLUMNS as f64 * std::f64::consts::TAU;
            let latitude = ((i / COLUMNS) as f64 / (ROWS - 1) as f64 - 0.5) * std::f64::consts::PI;
            light::S10 * (layer(longitude, latitude) + 10.0 * (f64::from(*b) * step).exp_m1())
        };
        tables::MILKY_WAY.iter().enumerate().map(level).collect()
    })
}

/// Weights of a uniform cubic B-spline at `t` of the way from the second of four points to the third.
fn spline(t: f64) -> [f64; 4] {
    let (u, t2) = (1.0 - t, t * t);
    let t3 = t2 * t;
    [u * u * u / 6.0, (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0, (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0) / 6.0, t3 / 6.0]
}

/// Value in a direction of a field whose points lie in so many columns and rows.
fn look(points: &[f64], [columns, rows]: [usize; 2], to: DVec3) -> f64 {
    let mut sum = 0.0;
    touch([columns, rows], to, |i, weight| sum += weight * points[i]);
    sum
}

/// The sixteen points around a direction in the ICRS, and their weights.
fn touch([columns, rows]: [usize; 2], to: DVec3, mut each: impl FnMut(usize, f64)) {
    let to = GALACTIC * to;
    let longitude = to.y.atan2(to.x).to_degrees().rem_euclid(360.0);
    let latitude = to.z.atan2((to.x * to.x + to.y * to.y).sqrt()).to_degrees();
    let (x, y) = (longitude / 360.0 * columns as f64, (latitude + 90.0) / 180.0 * (rows - 1) as f64);
    let (column, row) = (x.floor(), y.floor().min((rows - 2) as f64));
    let (along, across) = (spline(x - column), spline(y - row));
    let (column, row) = (column as usize, row as usize);
    let straight = [0, 1, 2, 3].map(|j| (column + j + columns - 1) % columns);
    let turned = straight.map(|j| (j + columns / 2) % columns);
    for (i, a) in across.into_iter().enumerate() {
        // One less than asked, so that the row before the first has a number; beyond a pole lies the other side.
        let (row, line) = match row + i {
            0 => (1, turned),
            past if past > rows => (2 * rows - 1 - past, turned),
            inside => (inside - 1, straight),
        };
        for (j, w) in line.into_iter().zip(along) {
            each(row * columns + j, a * w);
        }
    }
}

/// Luminance in a direction \[cd/m²\]: a unit vector in the ICRS.
pub fn luminance(to: DVec3) -> f64 {
    look(control_points(), [COLUMNS, ROWS], to)
}

/// Columns and rows of the light of stars that are drawn.
const COARSE: [usize; 2] = [240, 121];
/// What is left of the field at least: not all of the light there is that of these stars.
const LEAST: f64 = 0.2;

/// Light of stars that are drawn singly although the field holds it.
#[derive(Debug, Clone)]
pub struct Drawn {
    points: Vec<f64>,
}

impl Drawn {
    /// Of stars in these directions of the ICRS with these illuminances \[lx\].
    pub fn new(stars: impl Iterator<Item = (DVec3, f64)>) -> Self {
        let mut points = vec![0.0; COARSE[0] * COARSE[1]];
        for (to, light) in stars {
            touch(COARSE, to, |i, weight| points[i] += weight * light);
        }
        // A point stands for the light over its part of the sphere.
        let step = std::f64::consts::PI / (COARSE[1] - 1) as f64;
        for (row, line) in points.chunks_mut(COARSE[0]).enumerate() {
            let area = if row == 0 || row + 1 == COARSE[1] {
                std::f64::consts::PI * (0.5 * step).powi(2) / COARSE[0] as f64
            } else {
                step * step * (row as f64 * step).sin()
            };
            for x in line {
                *x /= area;
            }
        }
        Self { points }
    }

    /// What is left of the field without them \[cd/m²\].
    pub fn rest(&self, to: DVec3) -> f64 {
        let all = luminance(to);
        (all - look(&self.points, COARSE, to)).max(LEAST * all)
    }
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
            assert!((at / light::S10 - 20.0).abs() < 0.1, "{}", at / light::S10);
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
    fn what_is_drawn_is_taken_out() {
        // Even stars of a third of a level, 20 a square degree.
        let count = 800_000;
        let each = 6.0 * light::S10 * 4.0 * PI / f64::from(count);
        let drawn = Drawn::new(everywhere(count).map(|to| (to, each)));
        for to in everywhere(3000) {
            let galactic = GALACTIC * to;
            if galactic.z.abs() < 0.99 {
                let gone = (luminance(to) - drawn.rest(to)) / light::S10;
                assert!((gone - 6.0).abs() < 0.2, "{to}: {gone} S10");
            }
        }
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

//! Air between the eye and the cloud, and between the Sun and the cloud, that thins out with height (section 6 of
//! inverse_clouds, its failure case of Fig. 16).
//!
//! Eq 3 keeps its form, `exp(-kappa t)`: only `t` is no longer the distance but the optical path in air of density
//! `exp(-z / H)`, divided by its mean over the cloud, so that `kappa` has the same meaning under every convention. In a
//! straight line that climbs from height 0 to `u H` within the distance `d`, the path is `d (1 - exp(-u)) / u`.
//!
//! The paper names as the cause of its failure the colour of the light *that reaches the clouds*, so the same air can
//! dim that too: from height `z` to the Sun the path is `H exp(-z / H)` times the relative air mass (Kasten and Young
//! 1989, finite at the horizon). The light's colour is learnt from the brightest pixels, so the path is counted from
//! that of the cloud's highest pixel, where it is 0. A pixel's height is that of its first density.
//!
//! Heights are taken from the lowest point of all paths: the density there is a factor of every path and cancels.
//! Units: heights, distances \[m\]; paths \[1\].

use glam::DVec3;

use crate::error::{Error, Result, in_range};
use crate::math::geometry::Pinhole;

/// Relative optical paths of each pixel.
#[derive(Debug, Clone)]
pub struct Paths {
    /// From the eye to the cloud, mean 1 over it; infinite where there is no cloud.
    pub far: Vec<f32>,
    /// From the Sun to the cloud, beyond that of its highest pixel; 0 where there is no cloud.
    pub light: Vec<f32>,
}

/// `(exp(-a) - exp(-b)) / (b - a)`: mean density between heights `a` and `b`, in units of the scale height.
fn mean_density(a: f64, b: f64) -> f64 {
    let (low, u) = (a.min(b), (b - a).abs());
    // Below 1e-9 the quotient is 1 to rounding.
    (-low).exp() * if u < 1e-9 { 1.0 } else { -(-u).exp_m1() / u }
}

/// Relative air mass towards a direction of the given elevation, of Kasten and Young; below the horizon that of it.
pub fn air_mass(elevation: f64) -> f64 {
    let e = elevation.max(0.0);
    1.0 / (e.sin() + 0.505_72 * (e.to_degrees() + 6.079_95).powf(-1.636_4))
}

/// Paths from the distance to the first density \[m\] of each pixel, the direction to the Sun and the scale height.
pub fn paths(camera: &Pinhole, distance: &[f32], sun: DVec3, scale_height: f64) -> Result<Paths> {
    in_range("haze_height", scale_height, 1.0, 1e9, "m")?;
    if distance.len() != camera.width * camera.height {
        let (expected, got) =
            (format!("({}, {})", camera.height, camera.width), format!("{} elements", distance.len()));
        return Err(Error::Shape { name: "distance", expected, got });
    }
    // Height of each pixel's first density above the eye.
    let heights: Vec<f64> = (0..distance.len())
        .map(|p| camera.direction(p % camera.width, p / camera.width).z * f64::from(distance[p]))
        .collect();
    let seen = || (0..distance.len()).filter(|&p| distance[p].is_finite());
    let lowest = seen().map(|p| heights[p]).fold(0.0, f64::min);
    let highest = seen().map(|p| heights[p]).fold(f64::NEG_INFINITY, f64::max);
    let level = |height: f64| (height - lowest) / scale_height;
    let mut far = vec![f32::INFINITY; distance.len()];
    let mut light = vec![0.0; distance.len()];
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for p in seen() {
        sum += f64::from(distance[p]) * mean_density(level(0.0), level(heights[p]));
        count += 1.0;
    }
    // From within the cloud every path is 0, and so is their mean.
    let mean = if sum > 0.0 { sum / count } else { 1.0 };
    let slant = air_mass(sun.z.clamp(-1.0, 1.0).asin()) / mean;
    for p in seen() {
        let density = mean_density(level(0.0), level(heights[p]));
        far[p] = (f64::from(distance[p]) * density / mean) as f32;
        let below = highest - heights[p];
        light[p] = (slant * below * mean_density(level(heights[p]), level(highest))) as f32;
    }
    Ok(Paths { far, light })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_has_its_closed_forms() {
        assert!((mean_density(0.0, 0.0) - 1.0).abs() < 1e-15, "level at height 0");
        assert!((mean_density(2.0, 2.0) - (-2.0_f64).exp()).abs() < 1e-15, "level at height 2 H");
        assert!((mean_density(0.0, 50.0) - 0.02).abs() < 1e-12, "all air above: one scale height");
        for (a, b) in [(0.0, 1e-7), (0.3, 4.0), (5.0, 1.0)] {
            let n = 20_000;
            let at = |i: i32| a + (b - a) * (f64::from(i) + 0.5) / f64::from(n);
            let sum: f64 = (0..n).map(|i| (-at(i)).exp()).sum::<f64>() / f64::from(n);
            assert!((mean_density(a, b) / sum - 1.0).abs() < 1e-8, "{a} to {b}");
            assert_eq!(mean_density(a, b), mean_density(b, a), "both ways");
        }
    }

    #[test]
    fn air_mass_is_one_overhead_and_finite_at_the_horizon() {
        assert!((air_mass(std::f64::consts::FRAC_PI_2) - 1.0).abs() < 1e-3, "overhead");
        assert!((air_mass(0.0) - 37.92).abs() < 0.01, "the value Kasten and Young state");
        assert_eq!(air_mass(-0.2), air_mass(0.0), "below the horizon");
    }

    #[test]
    fn nothing_overflows_from_above() {
        let camera = Pinhole::new(DVec3::new(0.0, 0.0, 12e3), [0.0, -1.0, 0.0, 0.7], [4, 3]).expect("valid");
        let mut distance = vec![9e3_f32; 12];
        distance[0] = f32::INFINITY;
        let p = paths(&camera, &distance, DVec3::Z, 1.0).expect("valid");
        assert!(p.far[1..].iter().chain(&p.light).all(|x| x.is_finite()) && p.far[0].is_infinite(), "{p:?}");
        let mean = p.far[1..].iter().sum::<f32>() / 11.0;
        assert!((mean - 1.0).abs() < 1e-5, "mean 1 over the cloud: {mean}");
        assert!(paths(&camera, &distance, DVec3::Z, 0.5).is_err(), "a height without meaning");
    }
}

//! Drops and flakes that fall near the eye: fall speed, streaks of an exposure, their contrast (floor 3).
//!
//! Speed of drops: Atlas, Srivastava and Sekhon 1973, a fit of Gunn and Kinzer's measurements 1949, within .3 m/s. Sizes:
//! Marshall and Palmer 1948; of flakes Gunn and Marshall 1958 (melted), ten times less dense, at 1 m/s. A streak is as long as
//! speed times exposure, and a pixel on it is covered for the share `D / (v T + D)` of the exposure: its contrast (Garg and
//! Nayar 2007). Thinner than a pixel, it covers in proportion. Places are hashes on a lattice that moves with what
//! falls and repeats around the eye: a function of time, for any camera. Units: metres, seconds, pixels.
//! Cost: 60 ns for each drop near the eye and 3 ns a pixel of a streak.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::random::Stream;

/// Purpose of the random numbers of places and sizes.
const PLACES: u64 = 0xd209;

/// Terminal speed of a drop of a diameter \[mm\] in \[m/s\].
pub fn drop_speed(diameter: f64) -> f64 {
    (9.65 - 10.3 * (-0.6 * diameter).exp()).max(0.0)
}

/// What falls, and through what it is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Fall {
    /// Whether flakes, or drops.
    pub flakes: bool,
    /// Number of them in the cube around the eye \[1\].
    pub count: usize,
    /// Least diameter, and mean above it \[m\].
    pub sizes: [f64; 2],
    /// How far they are drawn \[m\].
    pub reach: f64,
    /// Of the air \[m/s\].
    pub wind: [f64; 2],
    /// How long a picture is exposed \[s\].
    pub exposure: f64,
    /// Since when it falls \[s\].
    pub time: f64,
    /// Radiance of one of them.
    pub color: [f32; 3],
    /// Of the places.
    pub seed: u64,
}

/// A streak on the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Streak {
    /// Ends \[px\].
    pub ends: [[f64; 2]; 2],
    /// Width \[px\].
    pub width: f64,
    /// Opacity along its middle \[1\].
    pub opacity: f64,
}

/// Streaks before an eye whose axes are right, up and forward, with a focal length \[px\], in their order.
pub fn streaks(fall: &Fall, eye: DVec3, axes: [DVec3; 3], focal: f64, size: [usize; 2]) -> Vec<Streak> {
    let side = 2.0 * fall.reach;
    let middle = [size[0] as f64 * 0.5, size[1] as f64 * 0.5];
    let mut out = Vec::new();
    let places = Stream::new(fall.seed, PLACES);
    for k in 0..fall.count {
        let random = |j: u64| places.uniform(4 * k as u64 + j);
        let luck = random(3);
        let diameter = fall.sizes[0] - fall.sizes[1] * (1.0 - luck).max(1e-6).ln();
        let speed = if fall.flakes { 0.8 + 0.4 * luck } else { drop_speed(1e3 * diameter) };
        let velocity = DVec3::new(fall.wind[0], fall.wind[1], -speed);
        let lattice = DVec3::new(random(0), random(1), random(2)) * side + velocity * fall.time - eye;
        let at = lattice - (lattice / side).round() * side;
        let (far, forward) = (at.length(), at.dot(axes[2]));
        if far > fall.reach || forward < 0.3 {
            continue;
        }
        let project = |p: DVec3| {
            let z = p.dot(axes[2]).max(0.1);
            [middle[0] + focal * p.dot(axes[0]) / z, middle[1] - focal * p.dot(axes[1]) / z]
        };
        let ends = [project(at), project(at - velocity * fall.exposure)];
        let reach = focal * diameter / forward + 1.0;
        let outside = |axis: usize| {
            let (a, b) = (ends[0][axis], ends[1][axis]);
            a.max(b) < -reach || a.min(b) > size[axis] as f64 + reach
        };
        if outside(0) || outside(1) {
            continue;
        }
        let width = focal * diameter / forward;
        let covered = diameter / (velocity.length() * fall.exposure + diameter);
        // It gives way towards the end of reach, where the curtain takes over.
        let fade = (4.0 * (1.0 - far / fall.reach)).clamp(0.0, 1.0);
        out.push(Streak { ends, width, opacity: covered * width.min(1.0) * fade });
    }
    out
}

/// Draw what falls into a picture of rows of RGB, in place.
pub fn draw(
    job: &Job,
    fall: &Fall,
    eye: DVec3,
    axes: [DVec3; 3],
    focal: f64,
    size: [usize; 2],
    picture: &mut [f32],
) -> Result<()> {
    if picture.len() != 3 * size[0] * size[1] {
        let expected = format!("({}, {}, 3)", size[1], size[0]);
        return Err(Error::Shape { name: "picture", expected, got: format!("({},)", picture.len()) });
    }
    let list = streaks(fall, eye, axes, focal, size);
    let rows = 32;
    job.chunks(picture, 3 * size[0] * rows, |chunk, part| {
        let first = chunk * rows;
        let last = first + part.len() / (3 * size[0]);
        for one in &list {
            let [[ax, ay], [bx, by]] = one.ends;
            let half = 0.5 * one.width.max(1.0);
            let edge = half + 0.5;
            let top = ((ay.min(by) - edge).floor().max(first as f64)) as usize;
            let bottom = ((ay.max(by) + edge).ceil().min(last as f64)).max(0.0) as usize;
            let left = (ax.min(bx) - edge).floor().max(0.0) as usize;
            let right = ((ax.max(bx) + edge).ceil().min(size[0] as f64)).max(0.0) as usize;
            let (dx, dy) = (bx - ax, by - ay);
            let over = 1.0 / (dx * dx + dy * dy).max(1e-12);
            for y in top..bottom {
                for x in left..right {
                    let (px, py) = (x as f64 + 0.5 - ax, y as f64 + 0.5 - ay);
                    let t = ((px * dx + py * dy) * over).clamp(0.0, 1.0);
                    let (qx, qy) = (px - t * dx, py - t * dy);
                    let cover = (edge - (qx * qx + qy * qy).sqrt()).clamp(0.0, 1.0) * one.opacity;
                    if cover > 0.0 {
                        let at = 3 * ((y - first) * size[0] + x);
                        for c in 0..3 {
                            part[at + c] += cover as f32 * (fall.color[c] - part[at + c]);
                        }
                    }
                }
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_gunn_and_kinzers() {
        // Table 2 of Gunn and Kinzer 1949: diameter [mm], speed [m/s].
        for (d, v) in [(0.6, 2.47), (1.0, 4.03), (2.0, 6.49), (3.0, 8.06), (4.0, 8.83), (5.0, 9.09)] {
            assert!((drop_speed(d) - v).abs() < 0.32, "{d} mm: {} for {v}", drop_speed(d));
        }
    }
}

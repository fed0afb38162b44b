//! Fog, haze and curtains of rain or snow before what is seen: optical depth, transmittance and airlight (floor 3).
//!
//! Of a layer that is even up to a top and falls off exponentially above it the optical depth of a ray is a closed form. A
//! curtain stands between two distances, under a cloud's base, within a sector of the horizon, in shafts that lean with the
//! wind. Light that comes through is added to what a lamp sheds in single scattering, `E P (1 - exp(-(1 + m) tau)) / (1 + m)`:
//! `m` goes from 0 before the lamp to 1 opposite it, where light comes in along the way it goes out. What is scattered again
//! is spread evenly, half of it upwards, and its cloud takes half of the rest. From all around comes `ambient`: in a uniform light nothing changes.
//!
//! Units: metres, 1/m, radiance in the sky's unit. Cost: 40 ns a ray. Held by `tests/oracles/test_weather.py`.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::interpolation::smoothstep;
use crate::math::noise::Perlin;

const CHUNK: usize = 2048;

/// Where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Even up to a top, with a scale height above; infinite for one without end.
    Layer {
        /// Height up to which it is even \[m\].
        top: f64,
        /// Scale height above \[m\].
        scale: f64,
    },
    /// Between two distances below a cloud.
    Curtain {
        /// Horizontal distance where it begins \[m\].
        near: f64,
        /// Where it ends \[m\].
        far: f64,
        /// Height of the cloud's base \[m\].
        base: f64,
        /// Of its middle \[rad\].
        azimuth: f64,
        /// To either side \[rad\].
        half: f64,
        /// How far shafts lean for each metre of height \[1\].
        lean: f64,
        /// Contrast of shafts \[1\].
        patchy: f64,
        /// Of the shafts.
        seed: u64,
    },
}

/// A lamp seen by drops.
#[derive(Debug, Clone)]
pub struct Lamp {
    /// Unit vector to it.
    pub to: DVec3,
    /// Of a plane that faces it.
    pub irradiance: [f64; 3],
    /// Phase function at equally spaced angles from 0 to 180 degrees \[1/sr\].
    pub phase: Vec<[f32; 3]>,
}

/// One kind of weather.
#[derive(Debug, Clone)]
pub struct Veil {
    /// Where it is.
    pub shape: Shape,
    /// Extinction where it is densest \[1/m\].
    pub extinction: f64,
    /// Lamps as it sees them.
    pub lamps: Vec<Lamp>,
    /// Mean light from all around.
    pub ambient: [f64; 3],
}

/// Integral of the density of a layer from a height along a slope, \[m\].
fn layer_way(z: f64, slope: f64, far: f64, top: f64, scale: f64) -> f64 {
    let density = |z: f64| if z <= top { 1.0 } else { (-(z - top) / scale).exp() };
    if scale.is_infinite() {
        return far;
    }
    if slope.abs() < 1e-9 {
        return density(z) * far;
    }
    // Way to the top, if it is crossed.
    let cross = (top - z) / slope;
    let above = |from: f64, length: f64| {
        let t = slope * length / scale;
        let share = if length.is_infinite() {
            if slope > 0.0 { scale / slope } else { f64::INFINITY }
        } else if t.abs() < 1e-6 {
            length
        } else {
            -(-t).exp_m1() * scale / slope
        };
        density(from) * share
    };
    if z >= top {
        if slope < 0.0 && cross < far { above(z, cross) + (far - cross) } else { above(z, far) }
    } else if slope > 0.0 && cross < far {
        cross + above(top, far - cross)
    } else {
        far
    }
}

/// Way through a curtain \[m\], with its thinning at the sides.
fn curtain_way(shape: &Shape, noise: Perlin, eye: DVec3, to: DVec3, distance: f64) -> f64 {
    let Shape::Curtain { near, far, base, azimuth, half, lean, patchy, .. } = *shape else { return 0.0 };
    let level = (to.x * to.x + to.y * to.y).sqrt().max(1e-6);
    let mut from = near / level;
    let mut end = (far / level).min(distance);
    // Below the base alone, which fades over a tenth of its height.
    if to.z.abs() > 1e-9 {
        let cross = (base - eye.z) / to.z;
        if to.z > 0.0 { end = end.min(cross) } else { from = from.max(cross) }
    }
    if end <= from {
        return 0.0;
    }
    let turn = (to.x.atan2(to.y) - azimuth + PI).rem_euclid(TAU) - PI;
    let side = if half >= PI { 1.0 } else { smoothstep(0.0, 1.0, (half - turn.abs()) / (0.7 * half)) };
    if side <= 0.0 {
        return 0.0;
    }
    let z = eye.z + to.z * from;
    let shafts = if patchy > 0.0 {
        let at = (turn * near.max(1.0) - lean * z) / (0.12 * base).max(1.0);
        let n = noise.fbm(at, 0.12 * z / base.max(1.0), 0.5, 2, 0.5);
        (1.0 + patchy * 1.6 * n).clamp(0.05, 2.0)
    } else {
        1.0
    };
    side * shafts * (end - from)
}

impl Veil {
    fn noise(&self) -> Perlin {
        Perlin::new(if let Shape::Curtain { seed, .. } = self.shape { seed } else { 0 }, 0x7a1e)
    }

    /// Optical depth along a unit vector to a distance \[1\].
    pub fn depth(&self, eye: DVec3, to: DVec3, distance: f64) -> f64 {
        self.depth_by(self.noise(), eye, to, distance)
    }

    fn depth_by(&self, noise: Perlin, eye: DVec3, to: DVec3, distance: f64) -> f64 {
        if self.extinction <= 0.0 {
            return 0.0;
        }
        let way = match self.shape {
            Shape::Layer { top, scale } => layer_way(eye.z, to.z, distance, top, scale),
            Shape::Curtain { .. } => curtain_way(&self.shape, noise, eye, to, distance),
        };
        self.extinction * way
    }

    /// Share of light that is left and light that is added.
    fn between(&self, noise: Perlin, eye: DVec3, to: DVec3, distance: f64, lit: f64) -> (f64, [f64; 3]) {
        let depth = self.depth_by(noise, eye, to, distance);
        if depth <= 0.0 {
            return (1.0, [0.0; 3]);
        }
        let left = (-depth).exp();
        let mut added = self.ambient.map(|a| a * (1.0 - left));
        let curtain = matches!(self.shape, Shape::Curtain { .. });
        for lamp in &self.lamps {
            let cosine = to.dot(lamp.to).clamp(-1.0, 1.0);
            let back = if curtain { 0.5 * (1.0 - cosine) } else { 0.0 };
            let single = if depth.is_infinite() { 1.0 } else { -(-(1.0 + back) * depth).exp_m1() } / (1.0 + back);
            let even = 0.25 * (1.0 - left - single).max(0.0) / (4.0 * PI);
            // A lamp before the eye is at scattering angle 0.
            let at = cosine.acos() / PI * (lamp.phase.len() - 1) as f64;
            let k = (at as usize).min(lamp.phase.len() - 2);
            let t = at - k as f64;
            for c in 0..3 {
                let (a, b) = (f64::from(lamp.phase[k][c]), f64::from(lamp.phase[k + 1][c]));
                added[c] += lit * lamp.irradiance[c] * ((a + (b - a) * t) * single + even);
            }
        }
        (left, added)
    }

    /// Put it before colours, in place: at places \[m\], or in directions without end. `lit` is the share of the lamps'
    /// light that reaches it, empty for all.
    pub fn before(
        &self,
        job: &Job,
        eye: DVec3,
        rays: &[f64],
        endless: bool,
        lit: &[f32],
        colors: &mut [f32],
        variation: &mut [f32],
    ) -> Result<()> {
        for (name, len) in [("colors", colors.len()), ("variation", variation.len().max(colors.len()))] {
            if len != rays.len() {
                let expected = format!("({},)", rays.len());
                return Err(Error::Shape { name, expected, got: format!("({len},)") });
            }
        }
        if !lit.is_empty() && 3 * lit.len() != rays.len() {
            let expected = format!("({},)", rays.len() / 3);
            return Err(Error::Shape { name: "lit", expected, got: format!("({},)", lit.len()) });
        }
        if self.lamps.iter().any(|lamp| lamp.phase.len() < 2) {
            return Err(Error::Shape { name: "phase", expected: "at least 2 angles".into(), got: "fewer".into() });
        }
        let noise = self.noise();
        let of = |k: usize| {
            let way = DVec3::from_slice(&rays[3 * k..]) - if endless { DVec3::ZERO } else { eye };
            let far = way.length();
            let distance = if endless { f64::INFINITY } else { far };
            let lit = lit.get(k).map_or(1.0, |&v| f64::from(v));
            if far > 0.0 { self.between(noise, eye, way / far, distance, lit) } else { (1.0, [0.0; 3]) }
        };
        // What is left and what is added, once for both.
        let mut both = vec![[0.0_f32; 4]; rays.len() / 3];
        job.chunks(&mut both, CHUNK, |chunk, part| {
            for (k, one) in part.iter_mut().enumerate() {
                let (left, added) = of(chunk * CHUNK + k);
                *one = [left as f32, added[0] as f32, added[1] as f32, added[2] as f32];
            }
            Ok(())
        })?;
        for (rgb, one) in colors.as_chunks_mut::<3>().0.iter_mut().zip(&both) {
            for c in 0..3 {
                // Of what is swallowed nothing is left, were it infinite.
                rgb[c] = if one[0] > 0.0 { rgb[c] * one[0] } else { 0.0 } + one[1 + c];
            }
        }
        for (rgb, one) in variation.as_chunks_mut::<3>().0.iter_mut().zip(&both) {
            for v in rgb {
                *v *= one[0];
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_of_a_layer_is_its_integral() {
        let layer = Shape::Layer { top: 20.0, scale: 60.0 };
        let veil = Veil { shape: layer, extinction: 1e-3, lamps: vec![], ambient: [1.0; 3] };
        for (z, slope, far) in [(2.0, 0.1, 900.0_f64), (200.0, -0.4, 490.0), (90.0, 0.0, 500.0), (2.0, -0.01, 100.0)] {
            let to = DVec3::new((1.0_f64 - slope * slope).sqrt(), 0.0, slope);
            let n = 200_000;
            let sum: f64 = (0..n)
                .map(|k| {
                    let z = z + slope * far * (f64::from(k) + 0.5) / f64::from(n);
                    if z <= 20.0 { 1.0 } else { (-(z - 20.0) / 60.0_f64).exp() }
                })
                .sum::<f64>()
                * far
                / f64::from(n)
                * 1e-3;
            let mine = veil.depth(DVec3::Z * z, to, far);
            assert!((mine - sum).abs() < 1e-6 * sum.max(1e-3), "{z} {slope}: {mine} for {sum}");
        }
    }
}

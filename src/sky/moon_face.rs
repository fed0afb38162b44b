//! The Moon's disc: Lommel and Seeliger's law by its phase, maria, earthshine, the Earth's shadow (floor 3).
//!
//! Whatever is drawn on it, the mean of the disc is the light it is given, which has the phase law: the law times albedo is
//! divided by its own mean, over latitude and longitude from the terminator to the limb, so that of a thin crescent all
//! points are lit. In an eclipse the disc is two: what of the Sun is left at each point, and the copper light that the Earth's
//! air bends to where the Sun is hidden, each with its share of the whole light.
//!
//! Units: radiance over the mean of the disc. Error: 2e-3 of the mean (`the_mean_of_the_disc_is_the_phase_law`). Cost: 0.3 ms once.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat3, DVec3};

use crate::astro::moon::lommel_seeliger;
use crate::astro::selenography::{EarthShadow, albedo};

/// Steps of the mean, each way.
const STEPS: usize = 64;

/// What of a disc in the Earth's shadow is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reached {
    /// No shadow.
    All,
    /// What of the Sun is left.
    Directly(EarthShadow),
    /// What the Earth's air bends to where the Sun is hidden.
    ByAir(EarthShadow),
}

impl Reached {
    fn share(&self, aside: DVec3) -> f64 {
        match self {
            Self::All => 1.0,
            Self::Directly(shadow) => 1.0 - shadow.taken(aside),
            Self::ByAir(shadow) => shadow.taken(aside),
        }
    }
}

/// The face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoonFace {
    /// Unit vector from the Moon to the Sun.
    sun: DVec3,
    /// To the axes of the map.
    to_map: DMat3,
    /// Of an earth-lit disc, over the mean of the lit one and over the map's mean.
    earthshine: f64,
    /// One over the mean of what is lit.
    scale: f64,
    reached: Reached,
}

/// Lommel and Seeliger's law at the cosines of incidence and emission, 1 when full.
fn seeliger(incident: f64, emergent: f64) -> f64 {
    if incident > 0.0 { 2.0 * incident / (incident + emergent) } else { 0.0 }
}

impl MoonFace {
    /// The face of a Moon `truly` there, lit from `sun`, with its axes ([`crate::astro::selenography::axes`]), its earthshine over the light of
    /// the lit part, and what reaches it.
    pub fn new(truly: DVec3, sun: DVec3, axes: DMat3, earthshine: f64, reached: Reached) -> Self {
        let mut face = Self { sun, to_map: axes.transpose(), earthshine: 0.0, scale: 1.0, reached };
        let lit = face.mean(truly, sun);
        face.scale = if lit > 1e-12 { 1.0 / lit } else { 0.0 };
        if earthshine > 0.0 {
            // As a full Moon, for the Earth stands behind the viewer.
            let full = Self { reached: Reached::All, ..face };
            face.earthshine = earthshine / full.mean(truly, -truly);
        }
        face
    }

    /// Mean over the disc of the law times albedo times what reaches it, lit from `sun`.
    fn mean(&self, truly: DVec3, sun: DVec3) -> f64 {
        let view = -truly;
        let phase = view.angle_between(sun);
        let across = (sun - view * sun.dot(view)).try_normalize().unwrap_or_else(|| view.any_orthonormal_vector());
        let pole = view.cross(across);
        let (mut sum, mut whole) = (0.0, 0.0);
        for j in 0..STEPS {
            let (up, flat) = (((j as f64 + 0.5) / STEPS as f64 - 0.5) * 2.0 * FRAC_PI_2).sin_cos();
            for i in 0..STEPS {
                let along = FRAC_PI_2 - (i as f64 + 0.5) / STEPS as f64 * (2.0 * FRAC_PI_2 - phase);
                let (sin, cos) = along.sin_cos();
                let (emergent, incident) = (flat * cos, flat * (along - phase).cos());
                let weight = seeliger(incident, emergent) * emergent * flat;
                let aside = across * (flat * sin) + pole * up;
                whole += weight;
                sum += weight * albedo(self.to_map * (aside + view * emergent)) * self.reached.share(aside);
            }
        }
        // The mean of Lommel and Seeliger's law over the disc is their phase law.
        if whole > 0.0 { lommel_seeliger(phase) * sum / whole } else { 0.0 }
    }

    /// Radiance over the mean of the lit disc at a point `aside` of its middle, in its radii, whose normal has this
    /// cosine.
    pub(crate) fn shape(&self, aside: DVec3, truly: DVec3, emergent: f64) -> f64 {
        let normal = aside - truly * emergent;
        let lit = seeliger(normal.dot(self.sun), emergent) * self.scale;
        if lit + self.earthshine <= 0.0 {
            return 0.0;
        }
        (lit * self.reached.share(aside) + self.earthshine) * albedo(self.to_map * normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::astro::selenography::seen_axes;

    /// Mean of the shape over equal areas of the disc, finely near its edge where a thin crescent lies.
    fn mean_of(face: &MoonFace, to: DVec3) -> f64 {
        let right = to.any_orthonormal_vector();
        let up = right.cross(to);
        let (rings, round) = (200, 720);
        let mut mean = 0.0;
        for i in 0..rings {
            let edge = |k: i32| (f64::from(k) / f64::from(rings) * FRAC_PI_2).sin();
            let (inner, outer) = (edge(i), edge(i + 1));
            let across = (0.5 * (inner * inner + outer * outer)).sqrt();
            for k in 0..round {
                let (sin, cos) = (std::f64::consts::TAU * (f64::from(k) + 0.5) / f64::from(round)).sin_cos();
                let aside = (right * cos + up * sin) * across;
                mean += face.shape(aside, to, (1.0 - across * across).sqrt()) * (outer * outer - inner * inner)
                    / f64::from(round);
            }
        }
        mean
    }

    #[test]
    fn the_mean_of_the_disc_is_the_phase_law() {
        let to = DVec3::new(0.6, 0.0, 0.8);
        for (degrees, libration, turn) in [
            (0.0_f64, [0.0, 0.0], 0.0),
            (30.0, [0.1, -0.1], 1.0),
            (90.0, [-0.13, 0.11], -2.0),
            (150.0, [0.0, 0.1], 0.4),
        ] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let sun = -to * cos + DVec3::Y * sin;
            let axes = seen_axes(to, DVec3::new(-0.8, 0.0, 0.6), libration, turn);
            let face = MoonFace::new(to, sun, axes, 0.0, Reached::All);
            let mean = mean_of(&face, to);
            assert!((mean - 1.0).abs() < 2e-3, "{degrees}: the light of the disc, {mean}");
            // Without maria the scale is one over the phase law.
            let grey = seeliger(0.3, 0.3) * face.scale;
            let law = 1.0 / lommel_seeliger(degrees.to_radians());
            assert!(grey / law > 1.05 && grey / law < 1.4, "{degrees}: highlands over the mean {}", grey / law);
            let shine = mean_of(&MoonFace::new(to, sun, axes, 0.25, Reached::All), to);
            assert!((shine - mean - 0.25).abs() < 1e-3, "{degrees}: earthshine {shine}");
        }
    }

    #[test]
    fn both_parts_of_an_eclipsed_disc_have_their_whole_light() {
        let to = DVec3::Y;
        let axes = seen_axes(to, DVec3::Z, [0.0; 2], 0.0);
        for apart in [0.0, 2.0, 2.9, 3.5] {
            let shadow = EarthShadow { middle: DVec3::new(0.6, 0.0, 0.8) * apart, earth: 3.7, sun: 1.03 };
            for reached in [Reached::Directly(shadow), Reached::ByAir(shadow)] {
                let mean = mean_of(&MoonFace::new(to, -to, axes, 0.0, reached), to);
                let dark = apart == 0.0 && matches!(reached, Reached::Directly(_));
                assert!(if dark { mean == 0.0 } else { (mean - 1.0).abs() < 0.01 }, "{apart}: {reached:?} {mean}");
            }
        }
    }
}

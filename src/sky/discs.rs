//! The discs of Sun and Moon (limb darkening, phase, eclipse), and stars as point sources, antialiased (floor 3).
//!
//! The paper realistic_sky, section 2.2: the Sun with its limb darkening, the Moon by Lommel and Seeliger's law with
//! phase and earthshine, its whole light that of the magnitude law whatever the law of the disc. Both are dimmed by the
//! air line by line, so a Moon on the horizon is redder below; the Moon hides the Sun and the stars.
//!
//! In a picture a disc is averaged over each pixel, and a star is spread over nine pixels so that its flux is exact at
//! any size of the picture. Refraction lifts and flattens the discs: a direction that is looked in is straightened first.
//! The Moon's face: moon_face.rs.

use std::sync::Arc;

use glam::DVec3;

use super::limb::{LIMB, limb};
use super::model::{SparsePixels, ViewRays};
use super::moon_face::MoonFace;
use crate::air::optics::{Optics, Spectrum};
use crate::astro::refraction::{RefractingAir, Refraction};

/// What a disc looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Face {
    /// Darkened at the limb.
    Sun,
    /// What surrounds a Sun of this angular radius.
    Corona(f64),
    /// Lit by the Sun and the Earth, with maria.
    Moon(MoonFace),
}

/// Refraction of an observer, if there is any.
#[derive(Debug, Clone, Default)]
pub struct Lens(Option<Arc<Refraction>>);

impl Lens {
    /// Of air.
    pub fn new(air: Option<RefractingAir>) -> Self {
        Self(air.map(Refraction::of))
    }

    /// Where a body stands for its disc: without refraction, where it is seen.
    pub fn stands(&self, to: DVec3, truly: DVec3) -> DVec3 {
        if self.0.is_some() { truly } else { to }
    }

    /// Where what is seen in a direction stands.
    pub fn straighten(&self, to: DVec3) -> DVec3 {
        let Some(air) = &self.0 else { return to };
        let flat = to.x.hypot(to.y);
        if flat <= 0.0 {
            return to;
        }
        let elevation = to.z.atan2(flat);
        let (sin, cos) = (elevation - air.of_apparent(elevation)).sin_cos();
        DVec3::new(to.x * cos / flat, to.y * cos / flat, sin)
    }
}

/// A disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Direction in which its middle is seen.
    pub to: DVec3,
    /// Where it stands, without refraction.
    pub truly: DVec3,
    /// Angular radius \[rad\].
    pub radius: f64,
    /// Its light above the air, on a plane that faces it.
    pub light: Spectrum,
    /// What it looks like.
    pub face: Face,
}

impl Disc {
    /// Whether a straightened direction meets the disc.
    pub fn covers(&self, to: DVec3) -> bool {
        (to - self.truly).length_squared() < 4.0 * (0.5 * self.radius).sin().powi(2)
    }

    /// Radiance over the mean of the lit disc, of a straightened direction that meets it.
    fn shape(&self, to: DVec3) -> f64 {
        let aside = (to - self.truly * to.dot(self.truly)) / self.radius.sin();
        let square = aside.length_squared().min(1.0);
        let emergent = (1.0 - square).sqrt();
        match self.face {
            Face::Sun => limb(square),
            // It fades to its edge.
            Face::Corona(radius) => corona(square.sqrt() * self.radius.sin() / radius.sin()) * (1.0 - square).powi(2),
            Face::Moon(face) => face.shape(aside, self.truly, emergent),
        }
    }

    /// Radiance \[cd/m2 of each channel\] along a direction that meets the disc, through the air.
    pub fn radiance(&self, to: DVec3, lens: &Lens, optics: &Optics, h: f64) -> [f64; 3] {
        self.shining(self.shape(lens.straighten(to)), to, optics, h)
    }

    /// The same for what [`Self::shape`] gives.
    fn shining(&self, shape: f64, to: DVec3, optics: &Optics, h: f64) -> [f64; 3] {
        let radius = if let Face::Corona(sun) = self.face { sun } else { self.radius };
        let scale = shape / (std::f64::consts::PI * radius.sin().powi(2));
        optics.attenuated(h, to.z, &self.light).map(|x| x * scale)
    }
}

/// Radiance of the corona over that of the Sun's disc, at a distance from its middle in its radii (Baumbach 1937).
fn corona(r: f64) -> f64 {
    if r < 1.0 { 0.0 } else { 1e-6 * (0.0532 * r.powf(-2.5) + 1.425 * r.powi(-7) + 2.565 * r.powi(-17)) }
}

/// Light of the corona over that of the Sun: the integral of Baumbach's law.
pub const CORONA: f64 = 1e-6;
/// Its picture ends at so many radii.
pub const CORONA_RADII: f64 = 6.0;

/// Fraction of a disc of radius `a` that one of radius `b` does not cover, their middles `apart` \[rad\].
pub fn unobscured_area(a: f64, b: f64, apart: f64) -> f64 {
    if apart >= a + b {
        return 1.0;
    }
    if apart <= (a - b).abs() {
        return if b >= a { 0.0 } else { 1.0 - (b / a).powi(2) };
    }
    let angle = |r: f64, s: f64| ((apart * apart + r * r - s * s) / (2.0 * apart * r)).clamp(-1.0, 1.0).acos();
    let (p, q) = (angle(a, b), angle(b, a));
    let lens = a * a * (p - p.sin() * p.cos()) + b * b * (q - q.sin() * q.cos());
    1.0 - lens / (std::f64::consts::PI * a * a)
}

/// Fraction of the light of a Sun of radius `a` that the Moon, of radius `b` and as far as `apart`, leaves \[rad\]:
/// less than that of its area when the limb is left, which is darker. To 3e-4.
pub fn unobscured_light(a: f64, b: f64, apart: f64) -> f64 {
    let by_area = unobscured_area(a, b, apart);
    if by_area <= 0.0 || by_area >= 1.0 {
        return by_area;
    }
    // By rings of the disc, even in the cosine of emission: of each, the arc that lies within the Moon.
    let steps = 4000;
    let mut sum = 0.0;
    for k in 0..steps {
        let emergent = (f64::from(k) + 0.5) / f64::from(steps);
        let r = a * (1.0 - emergent * emergent).sqrt();
        let cos = (apart * apart + r * r - b * b) / (2.0 * apart * r).max(f64::MIN_POSITIVE);
        let open = 1.0 - cos.clamp(-1.0, 1.0).acos() / std::f64::consts::PI;
        sum += 2.0 * emergent * (1.0 - LIMB * (1.0 - emergent)) * open;
    }
    sum / f64::from(steps) / (1.0 - LIMB / 3.0)
}

/// A star: its direction and its light after the air, on a plane that faces it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApparentStar {
    /// Unit vector.
    pub to: DVec3,
    /// \[lx of each channel\].
    pub light: [f64; 3],
}

/// Weights of three pixels around a place between two pixel edges: a quadratic spline, whose sum is 1 and whose middle
/// is the place, so a star that moves does not flicker.
fn bspline_weights(x: f64) -> (i64, [f64; 3]) {
    let middle = x.floor();
    let t = x - middle;
    (middle as i64 - 1, [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t * (1.0 - t), 0.5 * t * t])
}

fn add(out: &mut SparsePixels, index: usize, light: [f64; 3], weight: f64) {
    out.push((index, light.map(|x| (x * weight) as f32)));
}

/// Stars on a picture.
pub fn stars(rays: &ViewRays<'_>, stars: &[ApparentStar], out: &mut SparsePixels) {
    let Some(screen) = rays.screen() else { return };
    for star in stars {
        let Some([x, y]) = screen.project(star.to) else { continue };
        let ((left, across), (top, down)) = (bspline_weights(x), bspline_weights(y));
        let flux = 1.0 / screen.solid_angle(x, y);
        for (j, v) in down.iter().enumerate() {
            for (i, u) in across.iter().enumerate() {
                if let Some(index) = screen.index(left + i as i64, top + j as i64) {
                    add(out, index, star.light, flux * u * v);
                }
            }
        }
    }
}

/// A disc on what is looked at; `behind` is what hides it.
pub fn disc(
    rays: &ViewRays<'_>,
    disc: &Disc,
    lens: &Lens,
    behind: Option<&Disc>,
    horizon: f64,
    optics: &Optics,
    h: f64,
    out: &mut SparsePixels,
) {
    let seen = |to: DVec3| {
        let straight = lens.straighten(to);
        to.z >= horizon && disc.covers(straight) && !behind.is_some_and(|b| b.covers(straight))
    };
    let Some(screen) = rays.screen() else {
        for i in 0..rays.count() {
            let to = rays.at(i);
            if seen(to) {
                add(out, i, disc.radiance(to, lens, optics, h), 1.0);
            }
        }
        return;
    };
    let Some([left, right, top, bottom]) = screen.around(disc.to, disc.radius) else { return };
    for y in top..bottom {
        for x in left..right {
            let Some(index) = screen.index(x, y) else { continue };
            let (px, py) = (x as f64, y as f64);
            // A pixel that lies within needs one look; at an edge, or where the disc is small, many.
            let corners = [(0.02, 0.02), (0.98, 0.02), (0.02, 0.98), (0.98, 0.98), (0.5, 0.5)];
            let inside = corners.iter().filter(|(a, b)| seen(screen.direction(px + a, py + b))).count();
            let pixel = screen.extent(px + 0.5, py + 0.5);
            if inside == 0 && disc.radius > 2.0 * pixel {
                continue;
            }
            let fine = ((12.0 * pixel / disc.radius).ceil() as usize).clamp(16, 192);
            let steps = if inside == 5 && disc.radius > 8.0 * pixel { 2 } else { fine };
            let mut sum = [0.0; 3];
            let mut met = None;
            let (mut shape, mut whole) = (0.0, 0.0);
            for j in 0..steps {
                let at = |k: usize| (k as f64 + 0.5) / steps as f64;
                let weight = screen.weight(py + at(j));
                whole += weight * steps as f64;
                for i in 0..steps {
                    let to = screen.direction(px + at(i), py + at(j));
                    if seen(to) {
                        shape += weight * disc.shape(lens.straighten(to));
                        met = Some(to);
                    }
                }
            }
            if let Some(to) = met {
                // The air is that of one line through the pixel.
                sum = disc.shining(shape / whole, to, optics, h);
            }
            add(out, index, sum, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eclipse_by_areas() {
        assert_eq!(unobscured_area(1.0, 1.0, 2.0), 1.0, "they touch");
        assert_eq!(unobscured_area(1.0, 1.1, 0.05), 0.0, "total");
        assert!((unobscured_area(1.0, 0.9, 0.0) - 0.19).abs() < 1e-12, "annular");
        // Two unit circles a unit apart share 2 pi / 3 - sqrt(3) / 2.
        let lens = 2.0 * std::f64::consts::PI / 3.0 - 0.75_f64.sqrt();
        // The limb that is left of an annular one is darker: the closed form of the ring, with m the cosine at its inner edge.
        let m = 0.19_f64.sqrt();
        let ring = (m * m * (1.0 - LIMB) + LIMB * m.powi(3) * 2.0 / 3.0) / (1.0 - LIMB / 3.0);
        assert!((unobscured_light(1.0, 0.9, 0.0) - ring).abs() < 3e-4, "{} of {ring}", unobscured_light(1.0, 0.9, 0.0));
        assert!(unobscured_light(1.0, 1.1, 0.05) == 0.0 && unobscured_light(1.0, 1.0, 2.0) == 1.0, "total, none");
        assert!((unobscured_light(1.0, 1.0, 1e-3) - unobscured_area(1.0, 1.0, 1e-3)).abs() < 1e-3, "a sliver");
        assert!((unobscured_area(1.0, 1.0, 1.0) - 1.0 + lens / std::f64::consts::PI).abs() < 1e-12, "partial");
        assert!(unobscured_area(1.0, 1.0, 1e-300).is_finite() && unobscured_area(0.5, 1.0, 0.0) == 0.0, "middles meet");
    }
}

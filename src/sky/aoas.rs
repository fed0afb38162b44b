//! Aesthetically-Oriented Atmospheric Scattering (Shen, Mallett, Shkurko 2019): a skydome of single scattering, lit
//! once (floor 3).
//!
//! The dome of any radius anywhere in a scene stands for the air over a ball of `radius_ratio` thicknesses: the viewer
//! is moved along the apex by that ratio (eq 2), the direction stays (eq 1), and light is integrated to the top of the
//! air (eqs 3-4, [`ParticipatingMedium`]). The apex is constant; the printed radial form flips with the viewer's place
//! and has no value at the centre, where it falls back to up.
//!
//! The integral is tabulated by [`ScatteringTable`]; phase functions, disc and patterns are exact for each direction.
//! Relative error below the tolerance (`the_tolerance_holds_by_day_and_in_twilight`); 6 ns a direction.

use glam::DVec3;

use super::model::{BLOCK, Block, SkyModel};
use super::modulation::Modulation;
use super::scattering_table::{HORIZON_EPSILON, PhaseCoefficients, ScatteringTable, Source, View};
use crate::air::shell::Shell;
use crate::air::single::{ParticipatingMedium, Ray, RayMarch, SingleScattering};
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::lanes;

/// Below the horizon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ground {
    /// The sky's horizon goes on.
    Horizon,
    /// A ground of this radiance, behind air where the viewer is above it.
    Color([f64; 3]),
}

/// Parameters of a sky; lengths in the air are in units of O'Neil's thickness.
#[derive(Debug, Clone)]
pub struct AoasParams {
    /// Direction of the sun.
    pub sun: DVec3,
    /// Scattering constants of the channels (the Rayleigh vector) and of the aerosol.
    pub rayleigh: [f64; 3],
    /// Aerosol.
    pub mie: f64,
    /// Asymmetry of the aerosol, positive is forward.
    pub g: f64,
    /// Irradiance of the sun above the air.
    pub intensity: f64,
    /// Radius of the ground.
    pub radius: f64,
    /// Height of the top of the air, for which the dome stands.
    pub thickness: f64,
    /// Scale heights of molecules and aerosol.
    pub scales: [f64; 2],
    /// Viewer in dome radii from the dome's centre.
    pub viewer: DVec3,
    /// Eq 2 as printed.
    pub radial_apex: bool,
    /// The ground hides the sun.
    pub shadow: bool,
    /// Depths by O'Neil's polynomial.
    pub polynomial: bool,
    /// Equal steps instead of quadrature.
    pub march: Option<RayMarch>,
    /// Below the horizon.
    pub ground: Ground,
    /// Angular radius of the sun's disc, 0 for none \[rad\].
    pub disc: f64,
    /// Principles.
    pub modulation: Modulation,
    /// Relative error of the fast method.
    pub tolerance: f64,
}

/// A sky ready to be looked at.
#[derive(Debug)]
pub struct Aoas {
    set: AoasParams,
    air: ParticipatingMedium<3>,
    /// Height of the viewer, and cosine of the sun's angle to the vertical there.
    h: f64,
    mu_sun: f64,
    table: ScatteringTable,
}

impl Aoas {
    /// A sky with these settings.
    pub fn new(set: AoasParams) -> Result<Self> {
        in_range("radius_ratio", set.radius, 1.0, 1e6, "1")?;
        in_range("thickness", set.thickness, 1e-3, 1e3, "1")?;
        for (name, k) in [("rayleigh", set.rayleigh[0]), ("rayleigh", set.rayleigh[1]), ("rayleigh", set.rayleigh[2])] {
            in_range(name, k, 0.0, 1e3, "1")?;
        }
        in_range("mie", set.mie, 0.0, 1e3, "1")?;
        in_range("g", set.g, -0.9999, 0.9999, "1")?;
        in_range("sun_intensity", set.intensity, 0.0, 1e30, "1")?;
        for scale in set.scales {
            in_range("scale_height", scale, 0.01 * set.thickness, 1e3, "1")?;
        }
        in_range("tolerance", set.tolerance, 1e-4, 0.1, "1")?;
        if !set.viewer.is_finite() || set.viewer.length() > f64::MAX.sqrt() || !set.sun.is_normalized() {
            return Err(Error::Data { name: "viewer", reason: "must be finite".into() });
        }
        let shell = Shell { radius: set.radius, thickness: set.thickness };
        // Eq 2, the dome being as high as the air.
        let place = set.viewer * set.thickness;
        let apex = if set.radial_apex { place.try_normalize().unwrap_or(DVec3::Z) } else { DVec3::Z };
        let up = place.dot(apex);
        let aside = place - apex * up;
        let far = apex * (set.radius + up) + aside;
        let zenith = far.try_normalize().unwrap_or(apex);
        // Height without the difference of two radii; below the ground is on it.
        let h = (2.0 * set.radius * up + up * up + aside.length_squared()) / (far.length() + set.radius);
        let h = h.max(0.0);
        let r = set.radius + h;
        // A trifle above the ray that grazes the ground, so that rounding cannot make it hit.
        let dip = -(h * (2.0 * set.radius + h)).sqrt() / r * (1.0 - HORIZON_EPSILON);
        let outside = h - set.thickness;
        let top = if outside > 0.0 { -(outside * (2.0 * set.radius + set.thickness + h)).sqrt() / r } else { 1.0 };
        let full = |k: [f64; 3]| k.map(|k| 4.0 * std::f64::consts::PI * k);
        let scattering = [full(set.rayleigh), full([set.mie; 3])];
        let air = ParticipatingMedium::new(shell, set.scales, scattering, set.shadow, set.polynomial);
        let view = View {
            sun: set.sun,
            zenith,
            horizon: dip,
            top,
            extend_horizon: set.ground == Ground::Horizon,
            weights: [set.rayleigh, [set.mie; 3]].map(|k| k.map(|k| k * set.intensity)),
            g: set.g,
            groups: if set.scales[0] == set.scales[1] { 1 } else { 2 },
            tolerance: set.tolerance,
            at_probes: 0.25,
        };
        Ok(Self { air, h, mu_sun: zenith.dot(set.sun), table: ScatteringTable::new(view), set })
    }

    /// The part of a ray that is in the air; none if it passes the air by.
    fn ray(&self, mu: f64, nu: f64) -> Option<Ray> {
        let ray = Ray { h: self.h, mu, mu_sun: self.mu_sun, nu };
        if self.h <= self.set.thickness {
            return Some(ray);
        }
        if mu > self.table.view.top {
            return None;
        }
        let (r, edge) = (self.set.radius + self.h, self.set.radius + self.set.thickness);
        let gap = (self.h - self.set.thickness) * (r + edge);
        let s = gap / ((r * r * mu * mu - gap).max(0.0).sqrt() - r * mu);
        let sun = (r * self.mu_sun + s * nu) / edge;
        Some(Ray { h: self.set.thickness, mu: (r * mu + s) / edge, mu_sun: sun, nu })
    }

    /// Light without phase functions along a direction given by its cosines.
    #[inline(always)]
    fn scattered(&self, mu: f64, nu: f64, exact: bool) -> SingleScattering<3> {
        match self.ray(mu, nu) {
            None => SingleScattering { transmittance: [1.0; 3], ..Default::default() },
            Some(ray) if exact => match self.set.march {
                Some(march) => self.air.march(&ray, march),
                None => self.air.reference(&ray),
            },
            Some(ray) => match self.set.march {
                Some(march) => self.air.march(&ray, march),
                None => self.air.scatter(&ray),
            },
        }
    }

    /// Radiance of the sun's disc where it is seen, without the ground.
    fn disc_radiance(&self) -> [f64; 3] {
        let area = std::f64::consts::PI * self.set.disc.sin().powi(2);
        let mu = self.mu_sun.max(self.table.view.horizon);
        let through = self.ray(mu, 1.0).map_or([1.0; 3], |ray| self.air.to_the_top(ray.h, ray.mu));
        through.map(|t| self.set.intensity * t / area)
    }

    /// Whether the shadow of the ground crosses the sky, which costs.
    pub fn low_sun(&self) -> bool {
        self.mu_sun < self.table.view.horizon + 0.12
    }

    /// What multiplies the phase functions, and the ground.
    #[inline(always)]
    fn light(&self, mu: f64, nu: f64, exact: bool) -> PhaseCoefficients {
        let s = self.scattered(mu, nu, exact);
        let ground = match self.set.ground {
            Ground::Color(color) if mu < self.table.view.horizon => [0, 1, 2].map(|c| color[c] * s.transmittance[c]),
            _ => [0.0; 3],
        };
        [s.rayleigh, s.mie, ground]
    }

    /// Radiance by quadrature; `above`: the direction was above the horizon before it was disturbed.
    fn radiance(&self, to: DVec3, above: bool, exact: bool) -> [f64; 3] {
        let light = self.table.radiance(|mu, nu| self.light(mu, nu, exact), to, above);
        let near = 0.5 * (to - self.set.sun).length_squared();
        let disc = if above && self.in_disc(near) { self.disc_radiance() } else { [0.0; 3] };
        [0, 1, 2].map(|c| light[c] + disc[c])
    }

    fn in_disc(&self, near: f64) -> bool {
        self.set.disc > 0.0 && near < 2.0 * (0.5 * self.set.disc).sin().powi(2)
    }

    /// The directions of a block after the principles, which of them were above the horizon, and the fragments.
    #[inline(always)]
    fn disturbed(&self, block: &mut Block, fragments: &mut [[f32; BLOCK]; 3]) -> [bool; BLOCK] {
        let above = self.table.above(&block.to);
        let modulation = &self.set.modulation;
        if modulation.moves() || modulation.tints() {
            modulation.fragments(&block.to, fragments);
        }
        if modulation.moves() {
            modulation.disturb(fragments, &mut block.to);
        }
        above
    }
}

impl Source for Aoas {
    #[inline(always)]
    fn parts(&self, mu: f64, nu: f64) -> PhaseCoefficients {
        self.light(mu, nu, false)
    }
}

impl SkyModel for Aoas {
    fn direct_irradiance(&self, radius: f64) -> [f64; 3] {
        let visible = if self.set.shadow { self.table.fraction_above_horizon(radius) } else { 1.0 };
        if visible <= 0.0 {
            return [0.0; 3];
        }
        let mu = if self.set.shadow { self.mu_sun.max(self.table.view.horizon) } else { self.mu_sun };
        match self.ray(mu, 1.0) {
            None => [visible * self.set.intensity; 3],
            Some(ray) => {
                let h = ray.h;
                self.air.to_the_top(h, ray.mu).map(|t| visible * self.set.intensity * t)
            }
        }
    }

    fn table_size(&self) -> Option<[usize; 2]> {
        self.table.table_size()
    }

    fn prepare(&self, job: &Job) -> Result<()> {
        self.table.prepare(job, self)
    }

    fn shade(&self, block: &mut Block, without_table: bool) {
        lanes::run(
            #[inline(always)]
            || {
                let mut fragments = [[0.0; BLOCK]; 3];
                let above = self.disturbed(block, &mut fragments);
                let near = self.table.shade(self, block, &above, without_table);
                if self.set.disc > 0.0 {
                    let disc = self.disc_radiance();
                    for i in 0..BLOCK {
                        if above[i] && self.in_disc(f64::from(near[i])) {
                            for c in 0..3 {
                                block.light[c][i] += disc[c] as f32;
                            }
                        }
                    }
                }
                if self.set.modulation.tints() {
                    self.set.modulation.tint(&fragments, &mut block.light);
                }
            },
        );
    }

    fn reference(&self, to: DVec3) -> [f64; 3] {
        let modulation = &self.set.modulation;
        let mut block = Block::default();
        let v = to.as_vec3().to_array();
        for k in 0..3 {
            block.to[k] = [v[k]; BLOCK];
        }
        let mut fragments = [[0.0; BLOCK]; 3];
        let above = self.disturbed(&mut block, &mut fragments)[0];
        // Patterns are what they are in single precision; without them the direction keeps its digits.
        let to = if modulation.moves() {
            DVec3::from_array([0, 1, 2].map(|k: usize| f64::from(block.to[k][0]))).normalize()
        } else {
            to
        };
        let light = self.radiance(to, above, true);
        if !modulation.tints() {
            return light;
        }
        let factor = f64::from(modulation.saturation(&fragments)[0]);
        let v = light[0].max(light[1]).max(light[2]);
        light.map(|c| v - factor * (v - c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geometry::direction;
    use crate::sky::model::{FLOOR, ViewRays};
    use crate::sky::render::render;
    use crate::sky::scattering_table::LOW_FLOOR;

    fn settings(elevation: f64) -> AoasParams {
        AoasParams {
            sun: direction(0.3, elevation.to_radians()),
            rayleigh: [0.0025 * 5.602, 0.0025 * 9.473, 0.0025 * 19.644],
            mie: 0.001,
            g: 0.99,
            intensity: 20.0,
            radius: 40.0,
            thickness: 1.0,
            scales: [0.25; 2],
            viewer: DVec3::ZERO,
            radial_apex: false,
            shadow: true,
            polynomial: false,
            march: None,
            ground: Ground::Horizon,
            disc: 0.0,
            modulation: Modulation::default(),
            tolerance: 1e-3,
        }
    }

    /// Low-discrepancy directions of the upper half, dense near the horizon.
    fn directions(count: usize) -> Vec<f64> {
        (0..count)
            .flat_map(|i| {
                let i = i as f64 + 0.5;
                let e = (i * 0.754_877_666_246_692_7).fract();
                let azimuth = (i * 0.569_840_290_998_053_2).fract() * std::f64::consts::TAU;
                direction(azimuth, if e < 0.4 { e * 0.2 } else { e } * std::f64::consts::FRAC_PI_2).to_array()
            })
            .collect()
    }

    #[test]
    fn the_tolerance_holds_by_day_and_in_twilight() {
        let job = Job::serial();
        let styles: [fn(&mut AoasParams); 5] = [
            |_| (),
            |s| (s.radius, s.scales) = (106.0, [0.133, 0.02]),
            |s| s.rayleigh = [0.2, 0.1, 0.02],
            |s| s.radius = 8.0,
            |s| s.viewer = DVec3::new(0.3, 0.0, 0.5),
        ];
        let list = directions(1500);
        for (k, style) in styles.iter().enumerate() {
            for (sun, tolerance) in [(90.0, 1e-3), (40.0, 1e-4), (5.0, 1e-2), (0.0, 1e-3), (-1.9, 1e-3), (-7.0, 1e-3)] {
                let mut set = settings(sun);
                style(&mut set);
                set.tolerance = tolerance;
                let sky = Aoas::new(set).expect("valid");
                let mut out = vec![0.0_f32; list.len()];
                render(&job, &sky, &ViewRays::List(&list), &mut out).expect("rendered");
                let exact: Vec<f64> = list
                    .chunks_exact(3)
                    .flat_map(|d| sky.radiance(DVec3::from_slice(d).normalize(), true, false))
                    .collect();
                let top = exact.iter().fold(0.0_f64, |a, &b| a.max(b));
                // Far below the horizon an error is that of the frame.
                let floor = if sun < -2.0 { LOW_FLOOR } else { FLOOR };
                for (i, (a, b)) in out.iter().zip(&exact).enumerate() {
                    let error = (f64::from(*a) - b).abs() / (b + floor * top);
                    assert!(error < tolerance, "style {k}, sun {sun}, {:?}: {a} against {b}", &list[i / 3 * 3..][..3]);
                }
            }
        }
    }

    #[test]
    fn a_viewer_may_be_anywhere() {
        let job = Job::serial();
        let list = directions(1100);
        for (viewer, ground) in [
            (DVec3::new(0.0, 0.0, 3.0), Ground::Color([0.1, 0.2, 0.3])),
            (DVec3::new(0.0, 0.0, 0.5), Ground::Color([0.1, 0.2, 0.3])),
            (DVec3::new(1.0, 0.0, 0.0), Ground::Horizon),
            (DVec3::new(0.0, 0.0, -2.0), Ground::Color([0.0; 3])),
            (DVec3::new(0.0, 0.0, 1.0), Ground::Horizon),
        ] {
            let sky = Aoas::new(AoasParams { viewer, ground, ..settings(20.0) }).expect("valid");
            // Both halves of the sphere.
            let all: Vec<f64> = list.iter().enumerate().map(|(i, &x)| if i % 6 == 5 { -x } else { x }).collect();
            let mut out = vec![0.0_f32; all.len()];
            render(&job, &sky, &ViewRays::List(&all), &mut out).expect("rendered");
            let mut seen = 0.0_f64;
            for (d, got) in all.chunks_exact(3).zip(out.chunks_exact(3)) {
                let to = DVec3::from_slice(d).normalize();
                let want =
                    sky.radiance(to, to.dot(sky.table.view.zenith) as f32 >= sky.table.view.horizon as f32, false);
                let edge = (to.dot(sky.table.view.zenith) - sky.table.view.horizon).abs() < 1e-6
                    || (to.dot(sky.table.view.zenith) - sky.table.view.top).abs() < 1e-4;
                for c in 0..3 {
                    seen = seen.max(want[c]);
                    let error = (f64::from(got[c]) - want[c]).abs() / (want[c] + 0.01);
                    assert!(error < 2e-3 || edge, "{viewer:?} {to:?}: {got:?} against {want:?}");
                }
            }
            assert!(seen > 0.1, "{viewer:?} sees light");
        }
    }
}

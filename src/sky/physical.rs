//! A physically based clear sky in cd/m2, by day and in twilight: Rayleigh, aerosol, ozone, ground, all orders of
//! scattering (floor 3).
//!
//! Sixteen bands of the spectrum, because three cannot tell ozone's blue from Rayleigh's: light scattered once by
//! quadrature ([`ParticipatingMedium`]), with its exact phase functions; the other orders by moments
//! ([`MultipleScattering`]); both projected on RGB along each direction of the table, so a pixel costs three look-ups
//! whatever the number of bands.
//!
//! Units: metres, cd/m2 of each channel such that the luminance of the colour is photometric. Colours outside Rec. 709
//! are negative here; nothing is clipped.

use std::sync::Arc;

use glam::DVec3;

use super::limb::limb;
use super::model::{AUREOLE, BLOCK, Block, SkyModel, Smooth};
use super::scattering_table::{HORIZON_EPSILON, PhaseCoefficients, ScatteringTable, Source, View};
use crate::air::multiple::{C, MultipleScattering, ScatteringMedium};
use crate::air::optics::{AirComposition, Optics, Spectrum, horizon};
use crate::air::phase::CornetteShanks;
use crate::air::single::{ParticipatingMedium, Ray};
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::lanes;
use crate::math::quadrature::adaptive;

/// An atmosphere, with all that does not depend on where the sun stands.
#[derive(Debug)]
pub struct Atmosphere {
    set: AirComposition,
    /// With the full extinction; `delta_scaled` is without the aerosol's forward peak.
    pub optics: Optics,
    scattering: [[f64; C]; 2],
    delta_scaled: ParticipatingMedium<C>,
    multiple: MultipleScattering,
}

/// Legendre coefficient of a phase function of mean 1, over `2 l + 1`.
fn legendre(phase: &CornetteShanks<f64>, l: u32) -> f64 {
    let polynomial = |x: f64| match l {
        1 => x,
        2 => 1.5 * x * x - 0.5,
        _ => (2.5 * x * x - 1.5) * x,
    };
    0.5 * adaptive(&mut |x| phase.at(1.0 - x, 1.0 + x, f64::sqrt) * polynomial(x), -1.0, 1.0, 1e-10)
}

impl Atmosphere {
    /// An atmosphere with these settings; this follows all orders of scattering.
    pub fn new(job: &Job, set: AirComposition) -> Result<Self> {
        let optics = Optics::new(&set)?;
        let [molecules, aerosol] = optics.extinction;
        let scattered = aerosol.map(|k| k * set.aerosol_albedo);
        let phase = CornetteShanks::new(set.g);
        let chi = [1, 2, 3].map(|l| legendre(&phase, l));
        // The peak that goes on as if it were not scattered.
        let forward_peak = chi[2].max(0.0);
        let delta_scaled =
            Optics::air(&set, [molecules, std::array::from_fn(|k| aerosol[k] - forward_peak * scattered[k])]);
        let medium = ScatteringMedium {
            air: delta_scaled.clone(),
            scattering: [molecules, scattered.map(|k| (1.0 - forward_peak) * k)],
            chi: [(chi[0] - forward_peak) / (1.0 - forward_peak), (chi[1] - forward_peak) / (1.0 - forward_peak)],
            albedo: set.ground_albedo,
        };
        let multiple = MultipleScattering::new(job, medium)?;
        Ok(Self { set, optics, scattering: [molecules, scattered], delta_scaled, multiple })
    }

    /// How many orders of scattering were followed.
    pub fn num_orders(&self) -> usize {
        self.multiple.num_orders
    }

    /// Albedo of the ground.
    pub fn ground_albedo(&self) -> f64 {
        self.set.ground_albedo
    }
}

/// The sky of an atmosphere for one sun and one height of the observer.
#[derive(Debug)]
pub struct Physical {
    atmosphere: Arc<Atmosphere>,
    h: f64,
    mu_sun: f64,
    table: ScatteringTable,
    /// The sun's light above the air.
    source: Spectrum,
    /// Angular radius of its drawn disc \[rad\].
    disc: f64,
}

impl Physical {
    /// A sky with the sun, or the Moon, in the direction `sun`, seen from `altitude` \[m\].
    pub fn new(
        atmosphere: Arc<Atmosphere>,
        sun: DVec3,
        source: Spectrum,
        altitude: f64,
        disc: f64,
        tolerance: f64,
    ) -> Result<Self> {
        in_range("altitude", altitude, 0.0, 15_000.0, "m")?;
        in_range("tolerance", tolerance, 1e-4, 0.1, "1")?;
        if !sun.is_normalized() {
            return Err(Error::Data { name: "sun", reason: "must be a unit vector".into() });
        }
        let view = View {
            sun,
            zenith: DVec3::Z,
            horizon: horizon(altitude) * (1.0 - HORIZON_EPSILON),
            top: 1.0,
            extend_horizon: false,
            weights: [[1.0; 3]; 2],
            g: atmosphere.set.g,
            groups: 3,
            tolerance,
        };
        Ok(Self { h: altitude, mu_sun: sun.z, table: ScatteringTable::new(view), source, disc, atmosphere })
    }

    fn parts_by(&self, mu: f64, nu: f64, exact: bool) -> PhaseCoefficients {
        let a = &*self.atmosphere;
        let ray = Ray { h: self.h, mu, mu_sun: self.mu_sun, nu };
        let once = if exact { a.delta_scaled.reference(&ray) } else { a.delta_scaled.scatter(&ray) };
        let source = &self.source;
        let scale = 1.0 / (4.0 * std::f64::consts::PI);
        let of =
            |k: usize, light: &[f64; C]| std::array::from_fn(|c| scale * a.scattering[k][c] * light[c] * source[c]);
        let rest = a.multiple.radiance(self.h, mu, self.mu_sun, nu);
        let rest = std::array::from_fn(|c| rest[c] * source[c]);
        let optics = &a.optics;
        [optics.project(&of(0, &once.rayleigh)), optics.project(&of(1, &once.mie)), optics.project(&rest)]
    }

    fn attenuated(&self, mu: f64) -> [f64; 3] {
        self.atmosphere.optics.attenuated(self.h, mu, &self.source)
    }

    fn disc_radiance(&self, near: f64) -> [f64; 3] {
        let half = (0.5 * self.disc).sin().powi(2);
        if self.disc <= 0.0 || near >= 2.0 * half {
            return [0.0; 3];
        }
        let limb = limb(near / (2.0 * half));
        let area = std::f64::consts::PI * self.disc.sin().powi(2);
        self.attenuated(self.mu_sun.max(self.table.view.horizon)).map(|x| x * limb / area)
    }
}

impl Source for Physical {
    #[inline(always)]
    fn parts(&self, mu: f64, nu: f64) -> PhaseCoefficients {
        self.parts_by(mu, nu, false)
    }
}

impl SkyModel for Physical {
    fn direct_irradiance(&self, radius: f64) -> [f64; 3] {
        let visible = self.table.fraction_above_horizon(radius);
        if visible <= 0.0 {
            return [0.0; 3];
        }
        self.attenuated(self.mu_sun.max(self.table.view.horizon)).map(|x| x * visible)
    }

    fn table_size(&self) -> Option<[usize; 2]> {
        self.table.table_size()
    }

    fn prepare(&self, job: &Job) -> Result<()> {
        self.table.prepare(job, self)
    }

    fn smooth(&self) -> Option<Smooth> {
        let cone = (self.table.view.sun, self.disc.max(AUREOLE).cos());
        Some(Smooth { tolerance: self.table.view.tolerance, horizon: self.table.view.horizon, cones: vec![cone] })
    }

    fn shade(&self, block: &mut Block, without_table: bool) {
        lanes::run(
            #[inline(always)]
            || {
                let above = self.table.above(&block.to);
                let near = self.table.shade(self, block, &above, without_table);
                if self.disc > 0.0 {
                    for i in (0..BLOCK).filter(|&i| above[i]) {
                        let light = self.disc_radiance(f64::from(near[i]));
                        for c in 0..3 {
                            block.light[c][i] += light[c] as f32;
                        }
                    }
                }
            },
        );
    }

    fn reference(&self, to: DVec3) -> [f64; 3] {
        let above = to.z >= self.table.view.horizon;
        let light = self.table.radiance(|mu, nu| self.parts_by(mu, nu, true), to, above);
        let disc = if above { self.disc_radiance(0.5 * (to - self.table.view.sun).length_squared()) } else { [0.0; 3] };
        [0, 1, 2].map(|c| light[c] + disc[c])
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::air::optics::{MOLECULES_PER_AREA, rayleigh_cross_section};
    use crate::math::geometry::direction;
    use crate::sky::model::ViewRays;
    use crate::sky::render::render;

    /// The atmosphere of Bruneton's comparison of clear-sky models.
    pub(crate) fn settings() -> AirComposition {
        AirComposition {
            // Penndorf's 1.162e-5 / m at 550 nm with a scale height of 8 km.
            pressure: 1013.25 * 1.162e-5 * 8000.0 / (rayleigh_cross_section(550.0) * MOLECULES_PER_AREA),
            rayleigh_scale_height: 8000.0,
            beta: 0.04,
            alpha: 0.8,
            aerosol_scale_height: 1200.0,
            aerosol_albedo: 0.8,
            g: 0.7,
            ozone: 0.0,
            ground_albedo: 0.06,
        }
    }

    fn luminance(rgb: [f64; 3]) -> f64 {
        0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
    }

    #[test]
    fn the_zenith_by_day_is_that_of_a_radiative_transfer() {
        let atmosphere = Arc::new(Atmosphere::new(&Job::serial(), settings()).expect("made"));
        // sasktran2, spherical, 40 wavelengths, grass.
        for (zenith, want) in [(20.0_f64, 5177.0), (45.0, 1802.0), (60.0, 1247.0), (75.0, 907.0), (85.0, 591.0)] {
            let sun = direction(0.0, (90.0 - zenith).to_radians());
            let sky = Physical::new(atmosphere.clone(), sun, [1.0; C], 0.0, 0.0, 1e-3).expect("valid");
            let got = luminance(sky.reference(DVec3::Z));
            assert!((got / want - 1.0).abs() < 0.03, "sun at {zenith}: {got} against {want} cd/m2");
        }
    }

    #[test]
    fn the_table_holds_and_twilight_falls_without_a_step() {
        let job = Job::serial();
        let atmosphere = Arc::new(Atmosphere::new(&job, AirComposition { ozone: 300.0, ..settings() }).expect("made"));
        let list: Vec<f64> = (0..1200)
            .flat_map(|i| {
                let i = f64::from(i) + 0.5;
                let e = (i * 0.754_877_666_246_692_7).fract() * std::f64::consts::FRAC_PI_2;
                direction((i * 0.569_840_290_998_053_2).fract() * std::f64::consts::TAU, e).to_array()
            })
            .collect();
        for elevation in [50.0_f64, 2.0, -4.0] {
            let sun = direction(0.4, elevation.to_radians());
            let sky = Physical::new(atmosphere.clone(), sun, [1.0; C], 0.0, 0.0, 1e-3).expect("valid");
            let mut out = vec![0.0_f32; list.len()];
            render(&job, &sky, &ViewRays::List(&list), &mut out).expect("rendered");
            let top = out.iter().fold(0.0_f32, |a, &b| a.max(b));
            for (d, got) in list.chunks_exact(3).zip(out.chunks_exact(3)).step_by(7) {
                let want = sky.table.radiance(|mu, nu| sky.parts_by(mu, nu, false), DVec3::from_slice(d), true);
                for c in 0..3 {
                    let error = (f64::from(got[c]) - want[c]).abs() / (want[c].abs() + 1e-2 * f64::from(top));
                    assert!(error < 1e-3, "sun {elevation}, {d:?}: {got:?} against {want:?}");
                }
            }
        }
        let mut before = f64::INFINITY;
        for i in 0..2800 {
            let sun = direction(0.0, (10.0 - 0.01 * f64::from(i)).to_radians());
            let sky = Physical::new(atmosphere.clone(), sun, [1.0; C], 0.0, 0.0, 1e-3).expect("valid");
            let now = luminance(sky.table.radiance(|mu, nu| sky.parts_by(mu, nu, false), DVec3::Z, true));
            assert!(now > 0.0 && now < before, "sun at {}: {now} after {before}", 10.0 - 0.01 * f64::from(i));
            assert!(now > before.min(1e30) * 0.98 || i == 0, "a step of {} at {i}", now / before);
            before = now;
        }
    }
}

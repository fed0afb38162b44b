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
use crate::air::legendre::Truncated;
use crate::air::monte_carlo::{BATCHES, MonteCarlo};
use crate::air::multiple::{C, Channels, MultipleScattering, ScatteringMedium};
use crate::air::optics::{AirComposition, Optics, Spectrum, horizon};
use crate::air::phase::{CornetteShanks, rayleigh};
use crate::air::scattering::LateralShade;
use crate::air::single::Ray;
use crate::air::stored::DEFAULT_AIR;
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::lanes;

/// Paths of the reference method in a direction.
pub const PATHS: usize = 1024;

/// An atmosphere, with all that does not depend on where the sun stands.
#[derive(Debug)]
pub struct Atmosphere {
    pub(super) set: AirComposition,
    /// What it lets through.
    pub optics: Optics,
    scattering: [[f64; C]; 2],
    /// Extinction of the aerosol without the forward peak, its scattering, and its phase function.
    thinned: [f64; C],
    scattered: [f64; C],
    truncated: Truncated,
    multiple: MultipleScattering,
    monte_carlo: MonteCarlo,
}

impl Atmosphere {
    /// An atmosphere with these settings; this follows all orders of scattering.
    pub fn new(job: &Job, set: AirComposition) -> Result<Self> {
        let optics = Optics::new(job, &set)?;
        let [molecules, aerosol] = optics.extinction;
        let all = aerosol.map(|k| k * set.aerosol_albedo);
        let phase = CornetteShanks::<f64>::new(set.g);
        let truncated = Truncated::new(|x| phase.at(1.0 - x, 1.0 + x, f64::sqrt));
        // The peak that goes on as if it were not scattered.
        let thinned: [f64; C] = std::array::from_fn(|k| aerosol[k] - truncated.peak * all[k]);
        let scattered = all.map(|k| (1.0 - truncated.peak) * k);
        let medium = ScatteringMedium {
            air: optics.air.with_aerosol(thinned),
            scattering: [molecules, scattered],
            phases: [Truncated::new(|x| rayleigh(1.0 - x)), truncated],
            albedo: set.ground_albedo,
        };
        // The default air has been followed before.
        let stored =
            if set == AirComposition::DEFAULT { MultipleScattering::stored(medium.clone(), DEFAULT_AIR) } else { None };
        let multiple = stored.map_or_else(|| MultipleScattering::new(job, medium), Ok)?;
        let air = &optics.air;
        let monte_carlo =
            MonteCarlo::new(air.profile.clone(), air.extinction, set.aerosol_albedo, set.g, set.ground_albedo);
        Ok(Self { set, optics, scattering: [molecules, all], thinned, scattered, truncated, multiple, monte_carlo })
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
    /// The shadow of a moon, and what it leaves of the later orders.
    shade: Option<(LateralShade, f64)>,
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
            at_probes: 0.4,
        };
        Ok(Self {
            h: altitude,
            mu_sun: sun.z,
            table: ScatteringTable::new(view),
            source,
            disc,
            shade: None,
            atmosphere,
        })
    }

    /// In the shadow of a moon, which leaves this fraction of the later orders.
    #[must_use]
    pub fn shaded(mut self, shade: LateralShade, later: f64) -> Self {
        self.shade = Some((shade, later));
        self
    }

    /// Light of the bands along rays of one angle to the vertical: molecules and aerosol without their phase functions, and
    /// later orders.
    #[inline(always)]
    fn bands_of(&self, mu: f64, nus: &[f64]) -> Vec<[Spectrum; 3]> {
        let a = &*self.atmosphere;
        let mut rest: Vec<Channels> = vec![[0.0; C]; nus.len()];
        // What is left of later orders is taken below; of the sun on the ground, what the Moon leaves there.
        let on_ground = |s: f64, nu: f64| {
            self.shade
                .as_ref()
                .map_or(1.0, |(shade, later)| shade.at(s * (1.0 - nu * nu).max(0.0).sqrt()) / later.max(1e-9))
        };
        a.multiple.radiance(self.h, mu, self.mu_sun, nus, on_ground, &mut rest);
        let scale = 1.0 / (4.0 * std::f64::consts::PI);
        let optics = &a.optics;
        let left = self.shade.as_ref().map_or(1.0, |s| s.1);
        // A loop: the closure of a map may be compiled for the lowest SIMD level.
        let mut out = Vec::with_capacity(nus.len());
        for (&nu, rest) in nus.iter().zip(&rest) {
            let ray = Ray { h: self.h, mu, mu_sun: self.mu_sun, nu };
            let once = optics.air.scatter(&ray, &a.thinned, self.shade.as_ref().map(|s| &s.0));
            // Later orders of light that the peak scattered: what the first order has more in thinned air.
            let phases = [scale * rayleigh(1.0 - nu), scale * a.truncated.at(nu)];
            let [mut molecules, mut aerosol, mut later] = [[0.0; C]; 3];
            for c in 0..C {
                let light = self.source[c];
                let [m, p] = once.whole.map(|x| f64::from(x[c]) * light);
                let [more_m, more_p] = once.thinned.map(|x| f64::from(x[c]) * light);
                molecules[c] = scale * a.scattering[0][c] * m;
                aerosol[c] = scale * a.scattering[1][c] * p;
                later[c] = f64::from(rest[c]) * light * left
                    + phases[0] * a.scattering[0][c] * (more_m - m)
                    + phases[1] * a.scattered[c] * (more_p - p);
            }
            out.push([molecules, aerosol, later]);
        }
        out
    }

    /// Parts along rays of one angle to the vertical.
    #[inline(always)]
    fn parts_of(&self, mu: f64, nus: &[f64]) -> Vec<PhaseCoefficients> {
        let optics = &self.atmosphere.optics;
        let mut out = Vec::with_capacity(nus.len());
        for [molecules, aerosol, later] in &self.bands_of(mu, nus) {
            out.push([optics.project(molecules), optics.project(aerosol), optics.project(later)]);
        }
        out
    }

    /// Radiance in the bands along rays of one angle to the vertical, without the disc.
    pub(super) fn spectra(&self, mu: f64, nus: &[f64]) -> Vec<Spectrum> {
        let phase = CornetteShanks::<f64>::new(self.atmosphere.set.g);
        let parts = lanes::run(
            #[inline(always)]
            || self.bands_of(mu, nus),
        );
        let of = |(&nu, [molecules, aerosol, later]): (&f64, &[Spectrum; 3])| {
            let (air, haze) = (rayleigh(1.0 - nu), phase.at(1.0 - nu, 1.0 + nu, f64::sqrt));
            std::array::from_fn(|c| molecules[c] * air + aerosol[c] * haze + later[c])
        };
        nus.iter().zip(&parts).map(of).collect()
    }

    /// The direction of its sun, and what of it comes through the air.
    pub(super) fn beam(&self) -> (DVec3, Spectrum) {
        let clear = self.atmosphere.optics.air.to_the_top(self.h, self.mu_sun);
        (self.table.view.sun, std::array::from_fn(|c| clear[c] * self.source[c]))
    }

    /// Radiance without the disc by a backward Monte Carlo of this many paths, and its standard error.
    pub fn monte_carlo(&self, to: DVec3, paths: usize, key: u64) -> ([f64; 3], [f64; 3]) {
        let a = &*self.atmosphere;
        if self.shade.is_some() {
            // Paths do not know of the Moon.
            let above = to.z >= self.table.view.horizon;
            return (self.table.radiance(|mu, nu| self.parts(mu, nu), to, above), [0.0; 3]);
        }
        let (first, rest, batches) = a.monte_carlo.radiance(self.h, to, self.table.view.sun, paths, key);
        let seen = |bands: [f64; C]| a.optics.project(&std::array::from_fn(|c| bands[c] * self.source[c]));
        let (first, rest) = (seen(first), seen(rest));
        let mut error = [0.0; 3];
        for batch in batches.map(seen) {
            for c in 0..3 {
                error[c] += (batch[c] - rest[c]).powi(2) / (BATCHES * (BATCHES - 1)) as f64;
            }
        }
        ([0, 1, 2].map(|c| first[c] + rest[c]), error.map(f64::sqrt))
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
        self.parts_of(mu, &[nu])[0]
    }

    fn row(&self, mu: f64, nus: &[f64]) -> Vec<PhaseCoefficients> {
        lanes::run(
            #[inline(always)]
            || self.parts_of(mu, nus),
        )
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
        let disc = if to.z >= self.table.view.horizon {
            self.disc_radiance(0.5 * (to - self.table.view.sun).length_squared())
        } else {
            [0.0; 3]
        };
        let (light, _) = self.monte_carlo(to, PATHS, 0);
        [0, 1, 2].map(|c| light[c] + disc[c])
    }

    fn monte_carlo(&self, to: DVec3, paths: usize, key: u64) -> ([f64; 3], [f64; 3]) {
        Self::monte_carlo(self, to, paths, key)
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
            rayleigh_scale_height: Some(8000.0),
            top: 60_000.0,
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

    /// The default air, followed anew: its bits differ from those of the defaults by less than a part in 1e12.
    fn followed() -> Atmosphere {
        let set = AirComposition::DEFAULT;
        let set = AirComposition { ozone: set.ozone * (1.0 + 1e-13), ..set };
        Atmosphere::new(&Job::new(2), set).expect("made")
    }

    #[test]
    #[ignore = "writes src/air/tables/default_air.bin: scripts/make_default_air.py"]
    fn write_default_air() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/air/tables/default_air.bin");
        std::fs::write(path, followed().multiple.to_bytes()).expect("written");
    }

    #[test]
    fn the_stored_air_is_what_was_followed() {
        let start = std::time::Instant::now();
        let stored = Arc::new(Atmosphere::new(&Job::serial(), AirComposition::DEFAULT).expect("made"));
        println!("from the table: {:.0} ms, {} bytes", 1e3 * start.elapsed().as_secs_f64(), DEFAULT_AIR.len());
        assert!(DEFAULT_AIR.len() < 1_000_000, "{} bytes", DEFAULT_AIR.len());
        let followed = Arc::new(followed());
        assert_eq!(stored.num_orders(), followed.num_orders(), "the table is there");
        let mut worst = 0.0_f64;
        for elevation in [60.0_f64, 20.0, 3.0, 0.0, -4.0, -8.0, -12.0] {
            let sun = direction(0.0, elevation.to_radians());
            let skies =
                [&stored, &followed].map(|a| Physical::new(a.clone(), sun, [1.0; C], 0.0, 0.0, 1e-3).expect("valid"));
            for (azimuth, height) in [(0.0, 90.0_f64), (0.0, 10.0), (1.5, 40.0), (3.0, 5.0), (2.2, 70.0), (0.7, 1.0)] {
                let to = direction(azimuth, height.to_radians());
                let [got, want] =
                    [0, 1].map(|k: usize| skies[k].table.radiance(|mu, nu| skies[k].parts(mu, nu), to, true));
                for c in 0..3 {
                    worst = worst.max((got[c] - want[c]).abs() / luminance(want));
                }
            }
        }
        println!("largest error {worst:.1e}");
        assert!(worst < 2e-3, "{worst}");
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
                let want = sky.table.radiance(|mu, nu| sky.parts(mu, nu), DVec3::from_slice(d), true);
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
            let now = luminance(sky.table.radiance(|mu, nu| sky.parts(mu, nu), DVec3::Z, true));
            assert!(now > 0.0 && now < before, "sun at {}: {now} after {before}", 10.0 - 0.01 * f64::from(i));
            assert!(now > before.min(1e30) * 0.98 || i == 0, "a step of {} at {i}", now / before);
            before = now;
        }
    }
}

//! Night sky background: starlight and Milky Way, zodiacal light, airglow, behind the air (floor 3).
//!
//! The paper realistic_sky, section 2.2 and Table 1, gives one number for each of these. Here each is a field:
//! [`milky_way`] and [`zodiacal`] turned to the place and the hour, and airglow that brightens towards the horizon as a
//! thin layer at 90 km does (van Rhijn 1921). Between instants that are unknown, their means over the sphere stand for
//! the first two.
//!
//! Air dims such a field less than it dims a star, because it scatters light of all of it into every line of sight: the
//! radiance is `T L + (1 - T) J`, with a source function `J` that is the same in all the air, the mean radiance over
//! the sphere (half of it ground) times the single-scattering albedo. So the horizon is not black, and the zenith loses
//! 9 % where a star loses 17 (Leinert et al. 1998, section 6, count 0.6 to 1 of the optical depth).
//!
//! What comes from beyond the air is tabulated over the stereographic plane of the hemisphere, by 0.15 to 0.3 degrees; what
//! depends on the height above the horizon over that alone. Stars that are drawn singly and are fainter than those that the
//! Milky Way leaves out are taken out of it. A part that is switched off is not evaluated, a sky without any has no table.
//! Units: cd/m2. Cost: 0.2 s for the table on one core, 10 ns a pixel.

use glam::{DMat3, DVec3, Vec4};

use super::discs::ApparentStar;
use super::model::BLOCK;
use super::perez::rgb;
use super::table::{Lookup, Table, TableCoords, height_fraction, row_of};
use crate::air::optics::{Optics, Spectrum, horizon, spectrum};
use crate::astro::light::{self, S10};
use crate::astro::{Observer, milky_way, stars, sun, zodiacal};
use crate::color::spaces::luminance_of;
use crate::error::{Result, in_range};
use crate::job::Job;

/// Single-scattering albedo of air with aerosol.
const ALBEDO: f64 = 0.95;
/// Radius of the Earth and height of the glowing layer \[km\].
const EARTH: f64 = 6360.0;
const LAYER: f64 = 90.0;
/// Rows of the profile, nodes of the plane each way.
const PROFILE: usize = 1024;
const PLANE: usize = 800;
/// The same of zodiacal light, which is smooth.
const COARSE: usize = 200;
/// Where the plane ends: a little beyond the horizon, for the interpolation.
const EDGE: f64 = 1.02;
/// Chromaticity of airglow: 250 R of oxygen at 557.7 nm, 100 R at 630 nm, 50 R of sodium, 4 R/nm of continuum (levels
/// from memory; together 1.4e-4 cd/m2, as measured).
const AIRGLOW: [f64; 2] = [0.354, 0.393];
/// Powers of the wavelength by which starlight (B-V 0.8) and zodiacal light (a little redder than the Sun) differ from
/// sunlight.
const STARLIGHT: f64 = 0.62;
const ZODIACAL: f64 = 0.3;

/// Which sources shine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NightSources {
    /// Starlight too faint for single stars, and the Milky Way.
    pub milky_way: bool,
    /// Zodiacal light.
    pub zodiacal: bool,
    /// Luminance of the airglow at the zenith, above the air, in stars of magnitude 10 a square degree \[S10\].
    pub airglow: f64,
}

/// From local directions to those of the sources.
#[derive(Debug, Clone, Copy)]
struct Frames {
    /// To the ICRS and to the ecliptic of the date.
    to_icrs: DMat3,
    to_ecliptic: DMat3,
    /// Longitude of the Sun \[rad\].
    sun: f64,
}

/// The dark sky of a place.
#[derive(Debug)]
pub struct NightSky {
    sources: NightSources,
    drawn: Option<milky_way::Drawn>,
    frames: Option<Frames>,
    optics: Optics,
    h: f64,
    horizon: f64,
    /// Colours of unit luminance: starlight, zodiacal light, airglow.
    colors: [[f64; 3]; 3],
    plane: Table,
    /// The source function of the air.
    scattered: [f64; 3],
    /// Transmittance, and airglow with what the air scatters, by row of the cosine to the vertical.
    profile: Vec<[Vec4; 2]>,
    /// What the ground sends back.
    ground: [f64; 3],
}

fn unit(light: [f64; 3]) -> [f64; 3] {
    light.map(|x| x / luminance_of(light))
}

/// The local direction of a place in the plane.
fn unfold(u: f64, v: f64) -> DVec3 {
    let square = u * u + v * v;
    DVec3::new(2.0 * u, 2.0 * v, 1.0 - square) / (1.0 + square)
}

impl NightSky {
    /// The dark sky at `altitude` \[m\] in air of these optics; without an observer it does not know the hour.
    pub fn new(
        job: &Job,
        sources: NightSources,
        observer: Option<&Observer>,
        optics: &Optics,
        altitude: f64,
        ground_albedo: f64,
        stars: &[ApparentStar],
    ) -> Result<Self> {
        in_range("airglow", sources.airglow, 0.0, 1e6, "S10")?;
        let frames = observer.map(|o| {
            let local_to_date = o.site.to_local.transpose();
            let to_ecliptic = DMat3::from_rotation_x(-o.frame.obliquity);
            let towards = to_ecliptic * sun::geocentric(&o.frame);
            Frames {
                to_icrs: o.frame.from_icrs.transpose() * local_to_date,
                to_ecliptic: to_ecliptic * local_to_date,
                sun: towards.y.atan2(towards.x),
            }
        });
        // Stars that the field of the Milky Way holds; a planet is brighter.
        let faint = |s: &&ApparentStar| luminance_of(s.light) < 0.999 * light::illuminance(stars::FAINTEST);
        let drawn = frames.filter(|_| sources.milky_way && stars.iter().any(|s| faint(&s))).map(|f| {
            let faint = stars.iter().filter(faint);
            milky_way::Drawn::new(faint.map(|s| (f.to_icrs * s.to, luminance_of(s.light))))
        });
        let color = |power| unit(optics.extraterrestrial(&spectrum(1.0, power)));
        let glow = rgb(AIRGLOW[0], AIRGLOW[1], 1.0);
        let mut night = Self {
            sources,
            // What the air scatters is of all the light.
            drawn: None,
            frames,
            optics: optics.clone(),
            h: altitude,
            horizon: horizon(altitude),
            colors: [color(STARLIGHT), color(ZODIACAL), glow],
            plane: Table::empty(),
            scattered: [0.0; 3],
            profile: Vec::new(),
            ground: [0.0; 3],
        };
        // Rings of equal solid angles: the mean above the air, then the light on the ground.
        let (rings, round) = (32, 48);
        let sum = |weight: &dyn Fn(f64, DVec3) -> DVec3| {
            let mut sum = DVec3::ZERO;
            for i in 0..rings {
                let mu = (f64::from(i) + 0.5) / f64::from(rings);
                let across = (1.0 - mu * mu).sqrt();
                for k in 0..round {
                    let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(round)).sin_cos();
                    sum += weight(mu, DVec3::new(across * sin, across * cos, mu));
                }
            }
            sum / f64::from(rings * round)
        };
        let above = sum(&|mu, to| DVec3::from(night.beyond(to)) + DVec3::from(night.glow(mu)));
        night.scattered = (above * (0.5 * ALBEDO * (1.0 + ground_albedo))).to_array();
        night.drawn = drawn;
        // Irradiance over pi, times the albedo.
        night.ground = (sum(&|mu, to| DVec3::from(night.reference(to)) * mu) * (2.0 * ground_albedo)).to_array();
        night.profile = job.map(PROFILE, |i| {
            let mu = night.horizon + (1.0 - night.horizon) * height_fraction(i as f64 / (PROFILE - 1) as f64);
            let [clear, mut glow] = night.level(mu);
            if !night.varied() {
                let even = night.beyond(DVec3::Z);
                glow = std::array::from_fn(|c| glow[c] + clear[c] * even[c]);
            }
            Ok([clear, glow].map(|v| Vec4::new(v[0] as f32, v[1] as f32, v[2] as f32, 0.0)))
        })?;
        let place = |row: f64, c: f64| (c * EDGE, (2.0 * row - 1.0) * EDGE);
        if night.varied() {
            let vector = |light: [f64; 3]| Vec4::new(light[0] as f32, light[1] as f32, light[2] as f32, 0.0);
            let smooth = Table::build(job, [COARSE, COARSE], |row, c| {
                let (u, v) = place(row, c);
                [vector(night.zodiacal_light(unfold(u, v)))]
            })?;
            night.plane = Table::build(job, [PLANE, PLANE], |row, c| {
                let (u, v) = place(row, c);
                if u * u + v * v > EDGE * EDGE * EDGE * EDGE {
                    return [Vec4::ZERO];
                }
                [vector(night.starlight(unfold(u, v))) + smooth.value(0, row as f32, c as f32)]
            })?;
        }
        Ok(night)
    }

    /// Whether light from beyond the air depends on more than the height above the horizon.
    fn varied(&self) -> bool {
        self.frames.is_some() && (self.sources.milky_way || self.sources.zodiacal)
    }

    /// Starlight beyond the air.
    fn starlight(&self, to: DVec3) -> [f64; 3] {
        if !self.sources.milky_way {
            return [0.0; 3];
        }
        let there = match (&self.frames, &self.drawn) {
            (None, _) => milky_way::MEAN,
            (Some(f), None) => milky_way::luminance(f.to_icrs * to),
            (Some(f), Some(drawn)) => drawn.rest(f.to_icrs * to),
        };
        self.colors[0].map(|c| c * there)
    }

    /// Zodiacal light beyond the air.
    fn zodiacal_light(&self, to: DVec3) -> [f64; 3] {
        if !self.sources.zodiacal {
            return [0.0; 3];
        }
        let there = self.frames.map_or(zodiacal::MEAN, |f| {
            let d = f.to_ecliptic * to;
            zodiacal::luminance(d.y.atan2(d.x) - f.sun, d.z.atan2(d.x.hypot(d.y)))
        });
        self.colors[1].map(|c| c * there)
    }

    /// Light from beyond the air.
    fn beyond(&self, to: DVec3) -> [f64; 3] {
        let (stars, zodiacal) = (self.starlight(to), self.zodiacal_light(to));
        std::array::from_fn(|c| stars[c] + zodiacal[c])
    }

    /// Airglow above the air at a cosine to the vertical.
    fn glow(&self, mu: f64) -> [f64; 3] {
        let across = EARTH / (EARTH + LAYER);
        let rhijn = 1.0 / (1.0 - across * across * (1.0 - mu * mu)).sqrt();
        self.colors[2].map(|c| c * self.sources.airglow * S10 * rhijn)
    }

    /// Transmittance, and airglow with what the air scatters, at a cosine to the vertical.
    fn level(&self, mu: f64) -> [[f64; 3]; 2] {
        let flat: Spectrum = spectrum(1.0, 0.0);
        let (clear, whole) = (self.optics.attenuated(self.h, mu, &flat), self.optics.extraterrestrial(&flat));
        let clear: [f64; 3] = std::array::from_fn(|c| (clear[c] / whole[c]).max(0.0));
        let glow = self.glow(mu);
        [clear, std::array::from_fn(|c| clear[c] * glow[c] + (1.0 - clear[c]) * self.scattered[c])]
    }

    /// Light of a direction, in `f64`.
    pub fn reference(&self, to: DVec3) -> [f64; 3] {
        if to.z < self.horizon {
            return self.ground;
        }
        let ([clear, glow], beyond) = (self.level(to.z), self.beyond(to));
        std::array::from_fn(|c| clear[c] * beyond[c] + glow[c])
    }

    /// Add the light of a block.
    #[inline(always)]
    pub fn add(&self, to: &[[f32; BLOCK]; 3], light: &mut [[f32; BLOCK]; 3]) {
        let (horizon, range) = (self.horizon as f32, 1.0 / (1.0 - self.horizon) as f32);
        let mut rows = [0.0; BLOCK];
        let (mut u, mut v) = ([0.0; BLOCK], [0.0; BLOCK]);
        for i in 0..BLOCK {
            let z = to[2][i];
            let z = if z > horizon { z } else { horizon };
            let r = row_of((z - horizon) * range);
            rows[i] = if r < 1.0 { r } else { 1.0 } * (PROFILE - 1) as f32;
            let fold = 1.0 / ((1.0 + z) * EDGE as f32);
            (u[i], v[i]) = (to[0][i] * fold, 0.5 + 0.5 * to[1][i] * fold);
        }
        let mut coords = TableCoords::default();
        let plane = self.varied();
        if plane {
            self.plane.place(&v, &u, &mut coords);
        }
        for i in 0..BLOCK {
            let first = (rows[i] as usize).min(PROFILE - 2);
            let part = rows[i] - first as f32;
            let ([clear, glow], [clearer, more]) = (self.profile[first], self.profile[first + 1]);
            let mut value = glow + (more - glow) * part;
            if plane {
                value += (clear + (clearer - clear) * part) * self.plane.at(0, &coords, i);
            }
            let above = to[2][i] >= horizon;
            for c in 0..3 {
                light[c][i] += if above { value[c] } else { self.ground[c] as f32 };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::physical::tests::settings;

    #[test]
    fn the_plane_and_the_profile_hold_a_thousandth() {
        let optics = Optics::new(&Job::serial(), &settings()).expect("valid");
        let observer = Observer::new(1.7e9, [0.5, 0.2, 0.0], None).expect("valid");
        let sources = NightSources { milky_way: true, zodiacal: true, airglow: 1e-4 / S10 };
        let night = NightSky::new(&Job::serial(), sources, Some(&observer), &optics, 0.0, 0.1, &[]).expect("made");
        let mut to = [[0.0_f32; BLOCK]; 3];
        let mut light = [[0.0_f32; BLOCK]; 3];
        for i in 0..BLOCK {
            let t = i as f64 + 0.5;
            let mu = (t * 0.754_877_666_246_692_7).fract().powi(2);
            let (sin, cos) = (t * 2.4).sin_cos();
            let across = (1.0 - mu * mu).sqrt();
            (to[0][i], to[1][i], to[2][i]) = ((across * sin) as f32, (across * cos) as f32, mu as f32);
        }
        night.add(&to, &mut light);
        for i in 0..BLOCK {
            let d = DVec3::from_array([0, 1, 2].map(|k: usize| f64::from(to[k][i]))).normalize();
            let want = night.reference(d);
            for c in 0..3 {
                let error = (f64::from(light[c][i]) / want[c] - 1.0).abs();
                assert!(error < 1e-3, "{d}: {} against {}", light[c][i], want[c]);
            }
        }
    }

    #[test]
    fn a_part_that_is_off_gives_nothing() {
        let optics = Optics::new(&Job::serial(), &settings()).expect("valid");
        let off = NightSources { milky_way: false, zodiacal: false, airglow: 0.0 };
        let night = NightSky::new(&Job::serial(), off, None, &optics, 0.0, 0.1, &[]).expect("made");
        assert_eq!(night.reference(DVec3::Z), [0.0; 3], "black");
        // Van Rhijn's law without air: 6 times at the horizon, for a layer at 90 km.
        let glow = NightSources { airglow: 1.0, ..off };
        let clear = crate::air::optics::AirComposition { pressure: 0.0, beta: 0.0, ozone: 0.0, ..settings() };
        let optics = Optics::new(&Job::serial(), &clear).expect("valid");
        let night = NightSky::new(&Job::serial(), glow, None, &optics, 0.0, 0.0, &[]).expect("made");
        let (up, low) = (night.reference(DVec3::Z)[1], night.reference(DVec3::X)[1]);
        assert!((low / up - 1.0 / (1.0_f64 - (6360.0_f64 / 6450.0).powi(2)).sqrt()).abs() < 1e-9, "{}", low / up);
    }
}

//! The natural sky, day, twilight and night in one (floor 3): the paper realistic_sky as a whole, without its seams.
//!
//! Light adds: sunlight in the air, moonlight in the same air, the sources of the dark sky behind it, and the discs and
//! stars. By day the sunlit part may be a formula (the paper's: CIE luminance with Preetham's chromaticity); it hands
//! over to the atmosphere's while the sun goes from 8 to 2 degrees, before any formula breaks. What is a ten-thousandth
//! of the rest is not computed at all.
//!
//! In an eclipse of the Sun what is left of it at each point beside the line from the viewer to it lights the air there
//! ([`eclipse_shade`]), so totality has its glow along the horizon from outside the shadow; light that was scattered more
//! than once comes from some 50 km around. The corona is a millionth of the Sun.
//!
//! Units: cd/m2. Errors: those of the parts (physical.rs, night.rs); held together by tests/papers/test_natural.py.

use std::sync::Arc;

use glam::DVec3;

use super::discs::{self, ApparentStar, CORONA, CORONA_RADII, Disc, Lens, unobscured_light};
use super::limb::fraction_above_horizon;
use super::model::{AUREOLE, BLOCK, Block, SkyModel, Smooth, SparsePixels, ViewRays};
use super::moon_face::{MoonFace, Reached};
use super::night::{NightSky, NightSources};
use super::overcast::{CloudDeck, Overcast, SkyGlow};
use super::perez::Formula;
use super::physical::{Atmosphere, PATHS, Physical};
use super::{cie_general, preetham};
use crate::air::optics::{Spectrum, horizon, spectrum};
use crate::air::scattering::LateralShade;
use crate::astro::selenography::{EarthShadow, seen_axes};
use crate::color::spaces::luminance_of;
use crate::error::Result;
use crate::job::Job;
use crate::math::interpolation::smoothstep;
use crate::math::lanes;

/// Elevations of the sun between which a formula hands over to the atmosphere \[rad\].
const BLEND_ELEVATIONS: [f64; 2] = [2.0 * std::f64::consts::PI / 180.0, 8.0 * std::f64::consts::PI / 180.0];
/// Light of later orders comes from this far around \[m\].
const AROUND: f64 = 5e4;
/// Steps away from the line to the Sun, and how many \[m\].
const STEP: f64 = 1e4;
const STEPS: usize = 400;
/// Below this fraction of the Sun its corona is drawn.
const DARK: f64 = 1e-3;
/// Radius of the Moon in an eclipse over that by which it is drawn: k = 0.272281, of the valleys of its limb.
const VALLEYS: f64 = 0.272_281 * 6378.137 / 1737.4;
/// Power of the wavelength by which the Moon's light over the Sun's goes: its B-V is 0.92, the Sun's 0.65.
const MOON: f64 = 1.11;
/// The same of light in the Earth's shadow over that: brick red.
const COPPER: f64 = 8.0;
/// The sun lights the sky down to this height, the Moon to that \[rad\].
const SUN_LOW: f64 = -21.0 * std::f64::consts::PI / 180.0;
const MOON_LOW: f64 = -12.0 * std::f64::consts::PI / 180.0;
/// Above this elevation of the sun the dark sky is lost in its light \[rad\].
const SUN_HIGH: f64 = -5.0 * std::f64::consts::PI / 180.0;

/// Sun or Moon: direction, angular radius \[rad\], light above the air.
#[derive(Debug, Clone, Copy)]
pub struct Body {
    /// Unit vector to where it is seen.
    pub to: DVec3,
    /// Unit vector to where it stands, which lights the air.
    pub truly: DVec3,
    /// Angular radius \[rad\].
    pub radius: f64,
    /// Illuminance above the air, of the Sun over its mean and of the Moon in lx.
    pub light: f64,
}

/// The Moon's face.
#[derive(Debug, Clone, Copy)]
pub struct MoonDisc {
    /// As a body.
    pub body: Body,
    /// Unit vector from the Moon to the Sun.
    pub sun: DVec3,
    /// Light of its earth-lit disc against that of the lit part.
    pub earthshine: f64,
    /// Share of its light that has passed the Earth's air.
    pub copper: f64,
    /// Selenographic longitude and latitude of the disc's middle, and the angle of its north pole from the zenith towards
    /// the left of who faces it \[rad\].
    pub libration: [f64; 2],
    /// See `libration`.
    pub axis: f64,
    /// The Earth's shadow on it, where it is known.
    pub shadow: Option<EarthShadow>,
}

impl MoonDisc {
    /// Its light above the air.
    fn spectrum(&self) -> Spectrum {
        let (grey, red) = (spectrum(self.body.light, MOON), spectrum(self.body.light, MOON + COPPER));
        std::array::from_fn(|c| grey[c] + self.copper * (red[c] - grey[c]))
    }

    /// The disc, through a cloud that leaves so much of it; in the Earth's shadow a bright part and a copper one.
    fn discs(&self, truly: DVec3, through: f64) -> Vec<Disc> {
        let Body { to, radius, light, .. } = self.body;
        let east = DVec3::new(truly.y, -truly.x, 0.0).try_normalize().unwrap_or(DVec3::X);
        let axes = seen_axes(truly, east.cross(truly), self.libration, self.axis);
        let disc = |light: Spectrum, earthshine, reached| Disc {
            to,
            truly,
            radius,
            light: light.map(|x| x * through),
            face: discs::Face::Moon(MoonFace::new(truly, self.sun, axes, earthshine, reached)),
        };
        match self.shadow {
            None => vec![disc(self.spectrum(), self.earthshine, Reached::All)],
            Some(shadow) => vec![
                disc(spectrum((1.0 - self.copper) * light, MOON), 0.0, Reached::Directly(shadow)),
                disc(spectrum(self.copper * light, MOON + COPPER), 0.0, Reached::ByAir(shadow)),
            ],
        }
    }
}

/// What shines.
#[derive(Debug)]
pub struct SkyScene {
    /// The Sun.
    pub sun: Body,
    /// The Moon, if there is one.
    pub moon: Option<MoonDisc>,
    /// A formula of the day.
    pub formula: Option<Formula>,
    /// The dark sky, if any of it shines.
    pub night: Option<NightSky>,
    /// Directions of stars and their light above the air \[lx of each channel\].
    pub stars: Vec<ApparentStar>,
    /// Whether discs are drawn.
    pub discs: bool,
    /// Refraction that lifts and flattens them.
    pub lens: Lens,
    /// Light of a city.
    pub glow: Option<SkyGlow>,
    /// An endless cloud over the viewer.
    pub deck: Option<CloudDeck>,
}

/// The sky.
#[derive(Debug)]
pub struct Natural {
    atmosphere: Arc<Atmosphere>,
    h: f64,
    horizon: f64,
    sunlit: Option<Physical>,
    /// A formula and its weight.
    formula: Option<(Formula, f64)>,
    moonlit: Option<Physical>,
    night: Option<NightSky>,
    sun: Disc,
    /// The Moon's disc, of two parts in the Earth's shadow.
    moon: Vec<Disc>,
    stars: Vec<ApparentStar>,
    discs: bool,
    lens: Lens,
    unobscured: f64,
    corona: Option<Disc>,
    tolerance: f64,
    glow: Option<SkyGlow>,
    overcast: Option<Overcast>,
}

/// What gives the sunlit part of a day's sky its radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DayModel {
    /// The atmosphere alone.
    Atmosphere,
    /// A general sky of the CIE (1 to 15), with the zenith luminance of the atmosphere and Preetham's chromaticity.
    CieGeneral(usize),
    /// Preetham's.
    Preetham,
}

/// The formula of a day, where the sun is high enough for one.
pub fn formula(
    atmosphere: &Arc<Atmosphere>,
    day: DayModel,
    turbidity: f64,
    sun: &Body,
    altitude: f64,
) -> Result<Option<Formula>> {
    if day == DayModel::Atmosphere || sun.light <= 0.0 || sun.truly.z <= BLEND_ELEVATIONS[0].sin() {
        return Ok(None);
    }
    let turbidity = turbidity.clamp(preetham::TURBIDITY[0], preetham::TURBIDITY[1]);
    let DayModel::CieGeneral(kind) = day else {
        return preetham::sky(turbidity, sun.truly, [0.0; 3]).map(Some);
    };
    let zenith =
        Physical::new(atmosphere.clone(), sun.truly, [sun.light; 16], altitude, 0.0, 1e-3)?.reference(DVec3::Z);
    cie_general::sky(kind, sun.truly, luminance_of(zenith), preetham::tint(turbidity, sun.truly)?, [0.0; 3]).map(Some)
}

/// What is left of the Sun beside the line from the viewer to it, in rings: the mean around the line.
fn eclipse_shade(sun: &Body, moon: &Body) -> Option<LateralShade> {
    let (apart, radius) = (sun.truly.angle_between(moon.truly), moon.radius * VALLEYS);
    if apart >= sun.radius + radius || sun.light <= 0.0 {
        return None;
    }
    let distance = 1737.4e3 / moon.radius.sin();
    let (round, fine) = (12, 256);
    // Of the distance between the middles alone.
    let contact = sun.radius + radius;
    let table: Vec<f64> =
        (0..=fine).map(|i| unobscured_light(sun.radius, radius, contact * f64::from(i) / f64::from(fine))).collect();
    let left = |apart: f64| {
        let x = (apart / contact).min(1.0) * f64::from(fine);
        let i = (x as usize).min(table.len() - 2);
        table[i] + (x - i as f64) * (table[i + 1] - table[i])
    };
    let ring = |i: usize| {
        let aside = STEP * i as f64 / distance;
        let of = |k: usize| {
            let (sin, cos) = ((k as f64 + 0.5) / round as f64 * std::f64::consts::PI).sin_cos();
            left((apart + aside * cos).hypot(aside * sin))
        };
        if i == 0 {
            unobscured_light(sun.radius, radius, apart)
        } else {
            (0..round).map(of).sum::<f64>() / round as f64
        }
    };
    Some(LateralShade { step: STEP, fractions: (0..STEPS).map(ring).collect() })
}

/// What is left of light that came from around.
fn later_orders(shade: &LateralShade) -> f64 {
    let weight = |i: usize| {
        let x = (i as f64 + 0.5) * STEP / AROUND;
        x * (-x * x).exp()
    };
    let count = (5.0 * AROUND / STEP) as usize;
    let sum: f64 = (0..count).map(|i| weight(i) * shade.at((i as f64 + 0.5) * STEP)).sum();
    sum / (0..count).map(weight).sum::<f64>()
}

/// Whether the dark sky counts beside what the Sun lights: at -5 degrees it is less than 1e-4 of the zenith.
pub fn needs_night_sky(sun: &Body, sources: &NightSources) -> bool {
    (sun.light <= 0.0 || sun.truly.z < SUN_HIGH.sin())
        && (sources.milky_way || sources.zodiacal || sources.airglow > 0.0)
}

impl Natural {
    /// The sky of a scene in an atmosphere, seen from `altitude` \[m\].
    pub fn new(job: &Job, atmosphere: Arc<Atmosphere>, scene: SkyScene, altitude: f64, tolerance: f64) -> Result<Self> {
        let SkyScene { sun, moon, formula, night, stars, discs, lens, glow, deck } = scene;
        let shade = moon.as_ref().and_then(|m| eclipse_shade(&sun, &m.body));
        let left = shade.as_ref().map_or(1.0, |s| s.at(0.0));
        let unobscured = left + if left < 1.0 { CORONA } else { 0.0 };
        let later = shade.as_ref().map_or(1.0, later_orders);
        let seen: Spectrum = [sun.light; 16];
        // A sun without light is as good as one at the nadir.
        let elevation =
            if sun.light > 0.0 { sun.truly.z.clamp(-1.0, 1.0).asin() } else { -std::f64::consts::FRAC_PI_2 };
        // A deck is lit by what is above it.
        let high = deck.map_or(altitude, |deck| deck.top());
        let lit = |to, light| Physical::new(atmosphere.clone(), to, light, high, 0.0, tolerance);
        let sunlit = if elevation > SUN_LOW { Some(lit(sun.truly, seen)?) } else { None };
        let sunlit = sunlit.map(|sky| match shade {
            Some(shade) => sky.shaded(shade, later),
            None => sky,
        });
        let formula_weight = smoothstep(BLEND_ELEVATIONS[0], BLEND_ELEVATIONS[1], elevation);
        let formula = formula.filter(|_| formula_weight > 0.0 && deck.is_none()).map(|mut f| {
            f.luminance.1 *= later.max(left);
            (f, formula_weight)
        });
        let horizon = horizon(altitude);
        // What comes straight through a deck.
        let through = |truly: DVec3| deck.map_or(1.0, |deck| deck.through(truly.z));
        let moon_discs = moon
            .as_ref()
            .map_or_else(Vec::new, |m| m.discs(lens.stands(m.body.to, m.body.truly), through(m.body.truly)));
        // By day moonlight is less than a thousandth of a thousandth.
        let shines = |m: &&MoonDisc| m.body.truly.z > MOON_LOW.sin() && elevation < 0.07;
        let moonlight = moon.as_ref().filter(shines).map(|m| (m.body.truly, m.spectrum()));
        let moonlit = moonlight.map(|(to, light)| lit(to, light)).transpose()?;
        let optics = &atmosphere.optics;
        let white = optics.extraterrestrial(&[1.0; 16]);
        let moon_hides = |to: DVec3| moon_discs.first().is_some_and(|m| m.covers(lens.straighten(to)));
        let stars = stars
            .into_iter()
            .filter(|s| deck.is_none() && s.to.z > horizon && !moon_hides(s.to))
            .map(|s| {
                let clear = optics.attenuated(altitude, s.to.z, &[1.0; 16]);
                ApparentStar { to: s.to, light: std::array::from_fn(|c| s.light[c] * (clear[c] / white[c]).max(0.0)) }
            })
            .collect();
        let sun = Disc {
            to: sun.to,
            truly: lens.stands(sun.to, sun.truly),
            radius: sun.radius,
            light: seen.map(|x| x * through(sun.truly)),
            face: discs::Face::Sun,
        };
        let corona = (left < DARK).then_some(Disc {
            radius: CORONA_RADII * sun.radius,
            face: discs::Face::Corona(sun.radius),
            ..sun
        });
        let overcast = deck
            .map(|deck| {
                let skies: Vec<&Physical> = sunlit.iter().chain(&moonlit).collect();
                Overcast::new(job, &atmosphere, deck, altitude, &skies, night.as_ref(), glow.as_ref())
            })
            .transpose()?;
        Ok(Self {
            glow,
            overcast,
            h: altitude,
            horizon,
            sunlit,
            formula,
            moonlit,
            night,
            sun,
            moon: moon_discs,
            stars,
            discs,
            lens,
            unobscured,
            corona,
            tolerance,
            atmosphere,
        })
    }

    /// The components that are computed, for the user to see.
    pub fn components(&self) -> Vec<&'static str> {
        let mut components = Vec::new();
        let mut add = |there: bool, name| {
            if there {
                components.push(name);
            }
        };
        add(self.sunlit.is_some(), "sunlight");
        add(self.formula.is_some(), "formula");
        add(self.moonlit.is_some(), "moonlight");
        add(self.night.is_some(), "dark sky");
        add(!self.stars.is_empty(), "stars");
        add(self.discs, "discs");
        add(self.glow.is_some(), "sky glow");
        add(self.overcast.is_some(), "overcast");
        components
    }

    /// Light of the Moon's disc on a plane that faces it, and its direction.
    pub fn moonlight(&self) -> Option<(DVec3, [f64; 3])> {
        let moon = self.moon.first()?;
        let visible = fraction_above_horizon(moon.to.z, self.horizon, moon.radius);
        let light = std::array::from_fn(|c| self.moon.iter().map(|part| part.light[c]).sum());
        let light = self.atmosphere.optics.attenuated(self.h, moon.to.z.max(self.horizon), &light);
        Some((moon.to, light.map(|x| x * visible)))
    }

    /// The skies that are looked at: none below a deck.
    fn physicals(&self) -> impl Iterator<Item = &Physical> {
        self.sunlit.iter().chain(&self.moonlit).filter(|_| self.overcast.is_none())
    }
}

impl SkyModel for Natural {
    fn direct_irradiance(&self, radius: f64) -> [f64; 3] {
        let visible = fraction_above_horizon(self.sun.to.z, self.horizon, radius) * self.unobscured;
        if visible <= 0.0 {
            return [0.0; 3];
        }
        let to = self.sun.to.z.max(self.horizon);
        self.atmosphere.optics.attenuated(self.h, to, &self.sun.light).map(|x| x * visible)
    }

    fn table_size(&self) -> Option<[usize; 2]> {
        self.physicals().next().and_then(SkyModel::table_size)
    }

    fn prepare(&self, job: &Job) -> Result<()> {
        self.physicals().try_for_each(|sky| sky.prepare(job))
    }

    fn shade(&self, block: &mut Block, without_table: bool) {
        if let Some(overcast) = &self.overcast {
            lanes::run(
                #[inline(always)]
                || overcast.fill(block, self.horizon),
            );
            return;
        }
        // A formula that has the whole sky to itself leaves nothing of the atmosphere's to be seen above the horizon.
        let horizon = self.horizon as f32;
        let covered = self.formula.as_ref().is_some_and(|(_, formula_weight)| *formula_weight >= 1.0)
            && block.to[2].iter().all(|z| *z >= horizon);
        match self.sunlit.as_ref().filter(|_| !covered) {
            Some(sky) => sky.shade(block, without_table),
            None => block.light = [[0.0; BLOCK]; 3],
        }
        if let Some((formula, formula_weight)) = &self.formula {
            let mut other = Block { to: block.to, ..Block::default() };
            formula.shade(&mut other, without_table);
            let formula_weight = *formula_weight as f32;
            for c in 0..3 {
                for i in 0..BLOCK {
                    let part = if block.to[2][i] >= horizon { formula_weight } else { 0.0 };
                    block.light[c][i] += part * (other.light[c][i] - block.light[c][i]);
                }
            }
        }
        if let Some(moonlit) = &self.moonlit {
            let mut other = Block { to: block.to, ..Block::default() };
            moonlit.shade(&mut other, without_table);
            for c in 0..3 {
                for i in 0..BLOCK {
                    block.light[c][i] += other.light[c][i];
                }
            }
        }
        if let Some(night) = &self.night {
            lanes::run(
                #[inline(always)]
                || night.add(&block.to, &mut block.light),
            );
        }
        if let Some(glow) = &self.glow {
            glow.add(&block.to, &mut block.light, self.horizon);
        }
    }

    fn reference(&self, to: DVec3) -> [f64; 3] {
        let mut light = DVec3::from(SkyModel::monte_carlo(self, to, PATHS, 0).0);
        if self.discs && to.z >= self.horizon {
            let optics = &self.atmosphere.optics;
            let straight = self.lens.straighten(to);
            let moon = self.moon.first().is_some_and(|m| m.covers(straight));
            let sun = Some(&self.sun).filter(|s| !moon && s.covers(straight));
            for disc in self.moon.iter().filter(|_| moon).chain(sun) {
                light += DVec3::from(disc.radiance(to, &self.lens, optics, self.h));
            }
        }
        light.to_array()
    }

    fn monte_carlo(&self, to: DVec3, paths: usize, key: u64) -> ([f64; 3], [f64; 3]) {
        if let Some(overcast) = &self.overcast {
            return (overcast.reference(to, self.horizon), [0.0; 3]);
        }
        let (mut light, mut variance) = (DVec3::ZERO, DVec3::ZERO);
        let square = |error: [f64; 3]| DVec3::from(error) * DVec3::from(error);
        if let Some(sky) = &self.sunlit {
            let (seen, error) = sky.monte_carlo(to, paths, key);
            (light, variance) = (DVec3::from(seen), square(error));
        }
        if let Some((formula, weight)) = self.formula.as_ref().filter(|_| to.z >= self.horizon) {
            light += (DVec3::from(formula.reference(to)) - light) * *weight;
            variance *= (1.0 - weight).powi(2);
        }
        if let Some(sky) = &self.moonlit {
            let (seen, error) = sky.monte_carlo(to, paths, key ^ 1);
            (light, variance) = (light + DVec3::from(seen), variance + square(error));
        }
        light += self.night.as_ref().map_or(DVec3::ZERO, |d| DVec3::from(d.reference(to)));
        light += self.glow.as_ref().map_or(DVec3::ZERO, |g| DVec3::from(g.reference(to, self.horizon)));
        (light.to_array(), variance.to_array().map(f64::sqrt))
    }

    fn overlay(&self, rays: &ViewRays<'_>) -> SparsePixels {
        let optics = &self.atmosphere.optics;
        let mut pixels = SparsePixels::new();
        discs::stars(rays, &self.stars, &mut pixels);
        if self.discs {
            let before = self.moon.first();
            if let Some(corona) = &self.corona {
                discs::disc(rays, corona, &self.lens, before, self.horizon, optics, self.h, &mut pixels);
            }
            discs::disc(rays, &self.sun, &self.lens, before, self.horizon, optics, self.h, &mut pixels);
            for moon in &self.moon {
                discs::disc(rays, moon, &self.lens, None, self.horizon, optics, self.h, &mut pixels);
            }
        }
        pixels
    }

    fn smooth(&self) -> Option<Smooth> {
        // The glow of Sun and Moon bends within their aureoles.
        let around = |to: DVec3| (to, AUREOLE.cos());
        let bodies = [
            self.sunlit.as_ref().map(|_| self.sun.truly),
            self.moonlit.as_ref().and(self.moon.first().map(|m| m.truly)),
        ];
        Some(Smooth {
            tolerance: self.tolerance,
            horizon: self.horizon,
            cones: bodies.into_iter().flatten().filter(|_| self.overcast.is_none()).map(around).collect(),
        })
    }

    fn points(&self) -> Vec<(DVec3, DVec3)> {
        self.stars.iter().map(|s| (s.to, DVec3::from(s.light))).collect()
    }
}

//! The overcast sky by day, in twilight and at night: an endless cloud deck over the ground, lit by Sun, Moon and the sky above
//! it; artificial sky glow (light pollution) below it or in clear air (floor 3).
//!
//! Beyond the paper realistic_sky, which leaves "overcast, clouds and pollution for later". The deck is a homogeneous
//! plane-parallel slab ([`slab`](crate::air::slab)): all orders of scattering in the cloud, in the air between it and
//! the ground, between ground and cloud, and between the cloud and the air above it. Light on it is the beam of Sun and Moon
//! through the spherical air above its top, the light of that air ([`Physical`] seen from the top, by day and in twilight) and that
//! of the dark sky. The cloud is grey, all else is followed in sixteen bands.
//!
//! Sky glow: a city without end whose ground sends up light by Garstang's function (1986) of a reflected share G = 0.15 and a
//! direct upward share F = 0.15, `2 G (1 - F) cos z + 0.554 F z^4` up to 79 degrees from the zenith (what is lower leaves a
//! city of 10 km before it is 2 km high), scaled to the zenith's luminance on a clear night; the air scatters it, and the
//! deck throws it back. Clouds of depth 10 to 60 then brighten a city's sky 8- to 15-fold; Kyba et al. 2011 found 10.1 in Berlin.
//!
//! Simplifications: the sky above the deck is that over a dark ground, but for the air's reflection of the deck's own light;
//! the dark sky's spectrum is that of starlight; below the horizon is the ground, evenly lit.
//! Units: cd/m2, metres. Errors: those of `slab`, 1e-3 of the plane it is looked up in; `tests/papers/test_overcast.py`.
//! Cost: 0.2 s for a sky on one core, 5 ns a pixel.

use glam::{DVec3, Vec4};

use super::model::{BLOCK, Block, SkyModel, Smooth};
use super::night::NightSky;
use super::physical::{Atmosphere, Physical};
use super::table::{Lookup, Table, TableCoords};
use crate::air::optics::{Spectrum, horizon, spectrum};
use crate::air::phase::CornetteShanks;
use crate::air::scattering::C;
use crate::air::slab::{
    Layer, LayerOptics, Level, MOMENTS, Matrix, NODES, STREAMS, Stack, Vector, at_cosine, henyey_greenstein, legendre,
    moments_of, source,
};
use crate::color::spaces::luminance_of;
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::lanes;

/// Heights above the horizon of a profile: their squares are the cosines.
const ROWS: usize = 257;
/// Nodes of the plane each way, and where it ends.
const PLANE: usize = 192;
const EDGE: f64 = 1.02;
/// Azimuths in half a circle at which light on the deck is sampled.
const AROUND: usize = 32;
/// Orders in azimuth below this share of the mean are left out.
const FAINT: f64 = 1e-4;
/// The lowest cosine of a beam: below it its light fades.
const LOW: f64 = 5e-3;
/// Garstang's reflected and direct share of a city's light.
const CITY: [f64; 2] = [0.15, 0.15];
/// Power of the wavelength by which a lamp of 3000 K differs from sunlight.
const LAMPS: f64 = 4.2;
/// The same of a dark sky.
const STARLIGHT: f64 = 0.62;
/// Borders of the clear air above a city \[m\].
const CLEAR: [f64; 3] = [60_000.0, 8_000.0, 1_500.0];
/// Least optical depth: a thinner cloud shows the Sun.
pub const DEPTHS: [f64; 2] = [4.0, 500.0];

/// An endless cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudDeck {
    /// Optical depth.
    pub depth: f64,
    /// Height of its base above the ground and its thickness \[m\].
    pub base: f64,
    /// Thickness \[m\].
    pub thickness: f64,
    /// Asymmetry of its phase function.
    pub g: f64,
    /// Single-scattering albedo.
    pub albedo: f64,
}

impl CloudDeck {
    /// Check what came.
    fn validate(&self, h: f64) -> Result<()> {
        in_range("optical_depth", self.depth, DEPTHS[0], DEPTHS[1], "1")?;
        in_range("base", self.base, 0.0, 8000.0, "m")?;
        in_range("thickness", self.thickness, 1.0, 7000.0, "m")?;
        in_range("g", self.g, 0.0, 0.9, "1")?;
        in_range("albedo", self.albedo, 0.5, 1.0, "1")?;
        if h > self.base {
            return Err(Error::Data { name: "altitude", reason: "must be below the base of the overcast".into() });
        }
        Ok(())
    }

    /// Height of its top \[m\].
    pub fn top(&self) -> f64 {
        self.base + self.thickness
    }

    /// What comes straight through, at a cosine to the vertical.
    pub fn through(&self, mu: f64) -> f64 {
        if mu > 0.0 { (-self.depth / mu).exp() } else { 0.0 }
    }
}

/// Light that falls on layers of air and cloud, or comes from the ground below.
struct Lighting {
    /// Light from above by band, order and direction.
    above: Vec<Vec<Vector>>,
    /// Cosine of a beam and its irradiance.
    beam: Option<(f64, Spectrum)>,
    /// What the ground sends up, by band.
    glow: Option<Vec<Vector>>,
    /// Unit vector of its azimuth.
    towards: [f64; 2],
}

/// Luminance by height and order in azimuth, in each direction of azimuth.
#[derive(Debug)]
struct Solution {
    profiles: Vec<Vec<[f64; 3]>>,
    towards: [f64; 2],
}

/// Weights of four nodes at 0 to 3.
fn lagrange(t: f64) -> [f64; 4] {
    let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
    [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0]
}

fn mu_of(row: usize) -> f64 {
    (row as f64 / (ROWS - 1) as f64).powi(2)
}

impl Solution {
    fn at(&self, to: DVec3) -> [f64; 3] {
        let x = to.z.clamp(0.0, 1.0).sqrt() * (ROWS - 1) as f64;
        let first = ((x - 1.0).floor().max(0.0) as usize).min(ROWS - 4);
        let weights = lagrange(x - first as f64);
        let flat = to.x.hypot(to.y);
        let c = if flat > 1e-12 { (to.x * self.towards[0] + to.y * self.towards[1]) / flat } else { 1.0 };
        let (mut now, mut before, mut light) = (1.0, c, [0.0; 3]);
        for profile in &self.profiles {
            for (k, w) in weights.iter().enumerate() {
                for (light, value) in light.iter_mut().zip(profile[first + k]) {
                    *light += w * now * value;
                }
            }
            (now, before) = (2.0 * c * now - before, now);
        }
        light
    }
}

/// Air of one band between heights.
fn air(atmosphere: &Atmosphere, haze: &[f64; MOMENTS + 1], band: usize, low: f64, high: f64) -> LayerOptics {
    let optics = &atmosphere.optics.air;
    let columns = optics.profile.column(low, high);
    let mut molecules = [0.0; MOMENTS + 1];
    (molecules[0], molecules[2]) = (1.0, 0.1);
    let depth = |k: usize| columns[k] * optics.extinction[k][band];
    LayerOptics::new(&[
        (depth(0), 1.0, molecules),
        (depth(1), atmosphere.set.aerosol_albedo, *haze),
        (depth(2), 0.0, [0.0; MOMENTS + 1]),
    ])
}

fn haze(atmosphere: &Atmosphere) -> [f64; MOMENTS + 1] {
    let phase = CornetteShanks::<f64>::new(atmosphere.set.g);
    moments_of(|c| phase.at(1.0 - c, 1.0 + c, f64::sqrt))
}

/// What is seen upwards through layers with light at their borders: `start` comes in above the first.
fn look_up(
    m: usize,
    start: Option<&Vector>,
    layers: &[LayerOptics],
    levels: &[Level],
    beams: &[Option<(f64, f64)>],
) -> Vec<f64> {
    let sources: Vec<[[f64; MOMENTS]; 2]> =
        (0..layers.len()).map(|k| [0, 1].map(|i| source(&layers[k], m, &levels[k + i], beams[k + i]))).collect();
    let look = |row: usize| {
        let mu = mu_of(row).max(1e-6);
        let functions = legendre(m, mu);
        let mut light = start.map_or(0.0, |v| at_cosine(v, mu));
        for (layer, [above, below]) in layers.iter().zip(&sources) {
            let of = |s: &[f64; MOMENTS]| s.iter().zip(&functions).map(|(a, b)| a * b).sum::<f64>();
            let x = layer.depth / mu;
            if x > 0.0 {
                // The source function is linear in optical depth.
                let (clear, mean) = ((-x).exp(), -(-x).exp_m1() / x);
                light = light * clear + of(below) * (1.0 - mean) + of(above) * (mean - clear);
            }
        }
        light
    };
    (0..ROWS).map(look).collect()
}

fn irradiance(down: &Vector) -> f64 {
    2.0 * std::f64::consts::PI * NODES.iter().zip(down).map(|((mu, w), x)| mu * w * x).sum::<f64>()
}

/// Radiance of a city's ground, whose scale is that of the clear zenith.
fn city() -> Vector {
    let [g, f] = CITY;
    NODES.map(|(mu, _)| if mu < 0.19 { 0.0 } else { 2.0 * g * (1.0 - f) + 0.554 * f * mu.acos().powi(4) / mu })
}

/// Light of a city in clear air.
#[derive(Debug)]
pub struct SkyGlow {
    sky: Solution,
    ground: [f64; 3],
    /// Scale of the ground's light by band.
    scale: Spectrum,
}

impl SkyGlow {
    /// Of this luminance at the zenith of a clear sky, seen from `h` \[m\].
    pub fn new(job: &Job, atmosphere: &Atmosphere, zenith: f64, h: f64) -> Result<Self> {
        in_range("light_pollution", zenith, 0.0, 1.0, "cd/m2")?;
        let haze = haze(atmosphere);
        let albedo = atmosphere.ground_albedo();
        let lamps = spectrum(1.0, LAMPS);
        let city = city();
        let found = job.map(C, |band| {
            let borders = [CLEAR[0], CLEAR[1].max(h + 1.0), CLEAR[2].max(h + 0.5), h, 0.0];
            let optics: Vec<LayerOptics> =
                borders.windows(2).map(|b| air(atmosphere, &haze, band, b[1], b[0])).collect();
            let layers: Vec<Layer> = optics.iter().map(|o| Layer::new(o, 0, &[])).collect();
            let list: Vec<&Layer> = layers.iter().collect();
            let none: (Vector, Matrix) = ([0.0; STREAMS], [[0.0; STREAMS]; STREAMS]);
            let levels = Stack::new(&list, albedo, 0).light(&none.0, &none.1, None, &city);
            Ok((look_up(0, None, &optics[..3], &levels, &[None; 4]), irradiance(&levels[4].0)))
        })?;
        let project = |value: &dyn Fn(usize) -> f64| {
            atmosphere.optics.project(&std::array::from_fn(|band| lamps[band] * value(band)))
        };
        let profile: Vec<[f64; 3]> = (0..ROWS).map(|row| project(&|band| found[band].0[row])).collect();
        let scale = zenith / luminance_of(profile[ROWS - 1]);
        Ok(Self {
            sky: Solution {
                profiles: vec![profile.iter().map(|p| p.map(|x| x * scale)).collect()],
                towards: [0.0, 1.0],
            },
            ground: project(&|band| found[band].1 * albedo / std::f64::consts::PI).map(|x| x * scale),
            scale: lamps.map(|x| x * scale),
        })
    }

    /// Radiance in a direction.
    pub fn reference(&self, to: DVec3, horizon: f64) -> [f64; 3] {
        if to.z < horizon { self.ground } else { self.sky.at(to) }
    }

    /// Add the light of a block.
    pub fn add(&self, to: &[[f32; BLOCK]; 3], light: &mut [[f32; BLOCK]; 3], horizon: f64) {
        let profile = &self.sky.profiles[0];
        for i in 0..BLOCK {
            let z = to[2][i];
            let value = if z < horizon as f32 {
                self.ground
            } else {
                let x = f64::from(if z > 0.0 { z } else { 0.0 }).sqrt() * (ROWS - 1) as f64;
                let first = (x as usize).min(ROWS - 2);
                let part = x - first as f64;
                std::array::from_fn(|c| profile[first][c] + part * (profile[first + 1][c] - profile[first][c]))
            };
            for c in 0..3 {
                light[c][i] += value[c] as f32;
            }
        }
    }
}

/// The sky below a deck.
#[derive(Debug)]
pub struct Overcast {
    /// The deck.
    pub deck: CloudDeck,
    lights: Vec<Solution>,
    plane: Table,
    ground: [f64; 3],
}

/// Light from above of a sky, at the nodes and in orders of azimuth.
fn falling(job: &Job, sky: &Physical) -> Result<Lighting> {
    let (sun, beam) = sky.beam();
    let flat = (1.0 - sun.z * sun.z).max(0.0).sqrt();
    let azimuths: [f64; AROUND] = std::array::from_fn(|k| (k as f64 + 0.5) / AROUND as f64 * std::f64::consts::PI);
    let nodes = job.map(STREAMS, |i| {
        let mu = NODES[i].0;
        let across = (1.0 - mu * mu).sqrt();
        let nus = azimuths.map(|a| (mu * sun.z + across * flat * a.cos()).clamp(-1.0, 1.0));
        Ok(sky.spectra(mu, &nus))
    })?;
    let above = (0..C)
        .map(|band| {
            (0..MOMENTS)
                .map(|m| {
                    let twice = if m == 0 { 1.0 } else { 2.0 } / AROUND as f64;
                    std::array::from_fn(|i| {
                        (0..AROUND).map(|k| twice * nodes[i][k][band] * (m as f64 * azimuths[k]).cos()).sum()
                    })
                })
                .collect()
        })
        .collect();
    let towards = if flat > 1e-12 { [sun.x / flat, sun.y / flat] } else { [0.0, 1.0] };
    // A beam that grazes the deck gives it little: the same light from a little higher.
    let beam = (sun.z > 0.0).then(|| {
        let mu = sun.z.max(LOW);
        (mu, beam.map(|x| x * sun.z / mu))
    });
    Ok(Lighting { above, beam, glow: None, towards })
}

impl Overcast {
    /// Below a deck in an atmosphere, at `h` \[m\]: the skies of Sun and Moon seen from its top, the dark sky there, and a city.
    pub fn new(
        job: &Job,
        atmosphere: &Atmosphere,
        deck: CloudDeck,
        h: f64,
        skies: &[&Physical],
        night: Option<&NightSky>,
        city_glow: Option<&SkyGlow>,
    ) -> Result<Self> {
        deck.validate(h)?;
        let mut lights = skies.iter().map(|sky| falling(job, sky)).collect::<Result<Vec<_>>>()?;
        if let Some(night) = night {
            let starlight = spectrum(1.0, STARLIGHT);
            let mean = |mu: f64| {
                let across = (1.0 - mu * mu).sqrt();
                let at = |k: usize| {
                    let (sin, cos) = ((k as f64 + 0.5) / 24.0 * std::f64::consts::TAU).sin_cos();
                    luminance_of(night.reference(DVec3::new(across * sin, across * cos, mu)))
                };
                (0..24).map(at).sum::<f64>() / 24.0
            };
            let level = NODES.map(|(mu, _)| mean(mu));
            let above = starlight.map(|s| vec![level.map(|x| x * s)]).to_vec();
            lights.push(Lighting { above, beam: None, glow: None, towards: [0.0, 1.0] });
        }
        if let Some(glow) = city_glow {
            let city = city();
            let light = glow.scale.map(|s| city.map(|x| x * s)).to_vec();
            lights.push(Lighting { above: Vec::new(), beam: None, glow: Some(light), towards: [0.0, 1.0] });
        }
        let suns: Vec<f64> = lights.iter().filter_map(|l| l.beam.map(|b| b.0)).collect();
        let cloud = LayerOptics::new(&[(deck.depth, deck.albedo, henyey_greenstein(deck.g))]);
        let clouds = job
            .map(if suns.is_empty() && skies.is_empty() { 1 } else { MOMENTS }, |m| Ok(Layer::new(&cloud, m, &suns)))?;
        let haze = haze(atmosphere);
        let albedo = atmosphere.ground_albedo();
        let found = job.map(C, |band| {
            let part = |low, high| air(atmosphere, &haze, band, low, high);
            let lid = part(deck.top(), atmosphere.set.top);
            let under = [part(h, deck.base), part(0.0, h)];
            let mut profiles: Vec<Vec<Vec<f64>>> = vec![Vec::new(); lights.len()];
            let mut ground = 0.0;
            for (m, cloud) in clouds.iter().enumerate() {
                let airs = under.map(|o| Layer::new(&o, m, &suns));
                let lid = Layer::new(&lid, m, &[]).reflect;
                let list = [cloud, &airs[0], &airs[1]];
                let stack = Stack::new(&list, albedo, m);
                let mut faint = true;
                let mut which = 0;
                for (light, profiles) in lights.iter().zip(&mut profiles) {
                    let none = [0.0; STREAMS];
                    let above = light.above.get(band).and_then(|a| a.get(m)).unwrap_or(&none);
                    let glow = light.glow.as_ref().filter(|_| m == 0).map_or(&none, |g| &g[band]);
                    let beam = light.beam.map(|(mu, bands)| (which, mu, bands[band]));
                    which += usize::from(beam.is_some());
                    let levels = stack.light(above, &lid, beam, glow);
                    let mut left = beam.map(|(_, mu, irradiance)| (mu, irradiance));
                    let mut beams = Vec::new();
                    for layer in list {
                        left = left.map(|(mu, x)| (mu, x * layer.beams[beam.map_or(0, |b| b.0)].2));
                        beams.push(left);
                    }
                    let rows = look_up(m, Some(&levels[1].0), &under[..1], &levels[1..3], &beams[..2]);
                    if m == 0 {
                        let (mu, direct) = beams[2].unwrap_or((0.0, 0.0));
                        ground += (irradiance(&levels[3].0) + mu * direct) * albedo / std::f64::consts::PI;
                    }
                    let largest = |rows: &[f64]| rows.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                    if largest(&rows) > FAINT * profiles.first().map_or(0.0, |first: &Vec<f64>| largest(first)) {
                        faint = false;
                    }
                    profiles.push(rows);
                }
                if faint && m > 2 {
                    break;
                }
            }
            Ok((profiles, ground))
        })?;
        let project = |value: &dyn Fn(usize) -> f64| atmosphere.optics.project(&std::array::from_fn(value));
        let solve = |(l, light): (usize, &Lighting)| {
            let orders = found.iter().map(|f| f.0[l].len()).max().unwrap_or(0);
            let value = |band: usize, m: usize, row: usize| found[band].0[l].get(m).map_or(0.0, |p: &Vec<f64>| p[row]);
            let profiles =
                (0..orders).map(|m| (0..ROWS).map(|row| project(&|band| value(band, m, row))).collect()).collect();
            Solution { profiles, towards: light.towards }
        };
        let lights: Vec<Solution> = lights.iter().enumerate().map(solve).collect();
        let ground = project(&|band| found[band].1);
        let mut sky = Self { deck, lights, plane: Table::empty(), ground };
        sky.plane = Table::build(job, [PLANE, PLANE], |row, c| {
            let (u, v) = (c * EDGE, (2.0 * row - 1.0) * EDGE);
            let square = u * u + v * v;
            let light = sky.sky(DVec3::new(2.0 * u, 2.0 * v, 1.0 - square) / (1.0 + square));
            [Vec4::new(light[0] as f32, light[1] as f32, light[2] as f32, 0.0)]
        })?;
        Ok(sky)
    }

    fn sky(&self, to: DVec3) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for light in &self.lights {
            for (sum, x) in sum.iter_mut().zip(light.at(to)) {
                *sum += x;
            }
        }
        sum
    }

    /// Radiance in a direction, in `f64` and without the plane.
    pub fn reference(&self, to: DVec3, horizon: f64) -> [f64; 3] {
        if to.z < horizon { self.ground } else { self.sky(to) }
    }

    /// Fill a block.
    #[inline(always)]
    pub fn fill(&self, block: &mut Block, horizon: f64) {
        let (mut u, mut v) = ([0.0; BLOCK], [0.0; BLOCK]);
        let horizon = horizon as f32;
        for i in 0..BLOCK {
            let z = block.to[2][i];
            let fold = 1.0 / ((1.0 + if z > 0.0 { z } else { 0.0 }) * EDGE as f32);
            (u[i], v[i]) = (block.to[0][i] * fold, 0.5 + 0.5 * block.to[1][i] * fold);
        }
        let mut coords = TableCoords::default();
        self.plane.place(&v, &u, &mut coords);
        for i in 0..BLOCK {
            let value = self.plane.at(0, &coords, i);
            let above = block.to[2][i] >= horizon;
            for c in 0..3 {
                block.light[c][i] = if above { value[c] } else { self.ground[c] as f32 };
            }
        }
    }
}

/// The sky of one sun below a deck; its disc is not drawn.
#[derive(Debug)]
pub struct OvercastSky {
    sky: Overcast,
    clear: Physical,
    sun: DVec3,
    horizon: f64,
    tolerance: f64,
}

impl OvercastSky {
    /// With the sky of its sun at the deck's top and at the viewer's height `h` \[m\].
    pub fn new(
        job: &Job,
        atmosphere: &Atmosphere,
        deck: CloudDeck,
        [high, clear]: [Physical; 2],
        h: f64,
        tolerance: f64,
    ) -> Result<Self> {
        let sky = Overcast::new(job, atmosphere, deck, h, &[&high], None, None)?;
        Ok(Self { sky, sun: clear.beam().0, clear, horizon: horizon(h), tolerance })
    }
}

impl SkyModel for OvercastSky {
    fn shade(&self, block: &mut Block, _without_table: bool) {
        lanes::run(
            #[inline(always)]
            || self.sky.fill(block, self.horizon),
        );
    }

    fn reference(&self, to: DVec3) -> [f64; 3] {
        self.sky.reference(to, self.horizon)
    }

    fn direct_irradiance(&self, radius: f64) -> [f64; 3] {
        self.clear.direct_irradiance(radius).map(|x| x * self.sky.deck.through(self.sun.z))
    }

    fn smooth(&self) -> Option<Smooth> {
        Some(Smooth { tolerance: self.tolerance, horizon: self.horizon, cones: Vec::new() })
    }
}

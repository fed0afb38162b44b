//! Simulated cumulus: moist air rising over a warm patch of ground, after Miyazaki, Dobashi and Nishita 2002.
//!
//! Boussinesq air in a closed box with the paper's ingredients: advection, buoyancy of warm and of moist air against
//! the weight of droplets (its eq 4), vorticity confinement, condensation with latent heat (eqs 6-8) and a heat source
//! on the ground. What is different, and why:
//!
//! - The fields that are moved are the total water q = vapour + droplets and the static energy s = T + (g z − L q_c) / c_p
//!   in kelvins. Neither changes when water condenses or air rises, so advection in flux form conserves both by
//!   construction; the paper's three fields with a source each do not.
//! - Condensation is in equilibrium (q_c is what is above saturation) where the paper relaxes towards it at a rate α:
//!   droplets take a second, a step is not much shorter, and no rate needs to be chosen.
//! - Saturation and pressure are those of air (Bolton 1980), not fitted constants, so heights are metres.
//! - Fluxes replace semi-Lagrangian steps, which lose water; the step follows the wind, so any `step` is stable.
//!
//! Water is conserved to 1e-5, the flow has no divergence to 1e-5 (`tests/papers/test_cloud_makers.py`). Cost: about
//! 0.1 µs a cell, step and core.

use super::atmosphere::{
    DRY_LAPSE, GAS, GRAVITY, GROUND_PRESSURE, HEAT_CAPACITY, LATENT, LIGHTNESS, Sounding, saturation,
};
use super::fluid::{GridField, StaggeredGrid, Stand, Vorticity, add_to_faces, advect, confine, fastest};
use super::pressure::{Projector, divergence};
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::lanes;
use crate::math::noise::Perlin;

/// Fraction of a cell that air may cross in one step, summed over the axes.
const COURANT: f64 = 0.8;
/// Part of the box's height, at its top, where the air is brought to rest, and how fast \[1/s\].
const SPONGE: (f64, f64) = (0.15, 0.05);
/// Most cells of a box.
const MAX_CELLS: usize = 1 << 27;

/// What to simulate.
#[derive(Debug, Clone)]
pub struct SimulationSettings {
    /// Cells along x, y, z.
    pub size: [usize; 3],
    /// Edges of a cell \[m\].
    pub voxel: [f64; 3],
    /// When to look, rising \[s\].
    pub times: Vec<f64>,
    /// Longest step \[s\].
    pub step: f64,
    /// Heat from the middle of the warm patch [W/m²].
    pub surface_heat_flux: f64,
    /// Distance at which that has fallen to 1/e \[m\].
    pub radius: f64,
    /// Unevenness of the heat \[1\].
    pub perturbation: f64,
    /// Temperature at the ground \[K\].
    pub temperature: f64,
    /// Relative humidity at the ground \[1\].
    pub humidity: f64,
    /// Fall of temperature with height above the mixed layer \[K/m\].
    pub lapse: f64,
    /// Strength of the vorticity confinement \[1\]: from about 0.7 on it gives more than the mesh takes, without end.
    pub confinement: f64,
    /// Key of the random numbers.
    pub key: u64,
    /// Whether to return the air too.
    pub keep_all_fields: bool,
}

impl SimulationSettings {
    /// Warming of the lowest cells in the middle of the patch [K/s].
    fn warming(&self) -> f64 {
        let density = GROUND_PRESSURE / (GAS * self.temperature);
        self.surface_heat_flux / (density * HEAT_CAPACITY * self.voxel[2])
    }

    fn check(&self) -> Result<()> {
        for (name, n) in [("shape[2]", self.size[0]), ("shape[1]", self.size[1]), ("shape[0]", self.size[2])] {
            in_range(name, n as f64, 8.0, 512.0, "1")?;
        }
        if self.size.iter().product::<usize>() > MAX_CELLS {
            return Err(Error::Data { name: "shape", reason: format!("more than {MAX_CELLS} voxels") });
        }
        for edge in self.voxel {
            in_range("voxel_size", edge, 1.0, 1000.0, "m")?;
        }
        let high = self.size[2] as f64 * self.voxel[2];
        in_range("shape[0] * voxel_size[2]", high, 100.0, 16_000.0, "m")?;
        in_range("step", self.step, 0.01, 60.0, "s")?;
        in_range("heat", self.surface_heat_flux, 0.0, 20_000.0, "W/m²")?;
        in_range("radius", self.radius, 1.0, 1e6, "m")?;
        in_range("unevenness", self.perturbation, 0.0, 1.0, "1")?;
        in_range("temperature", self.temperature, 250.0, 320.0, "K")?;
        in_range("humidity", self.humidity, 0.01, 0.95, "1")?;
        in_range("lapse", self.lapse, 0.0, DRY_LAPSE, "K/m")?;
        in_range("confinement", self.confinement, 0.0, 0.5, "1")?;
        let mut before = 0.0;
        for &time in &self.times {
            in_range("times", time, before, 86_400.0, "s")?;
            before = time;
        }
        if self.times.is_empty() { Err(Error::Empty { name: "times" }) } else { Ok(()) }
    }
}

/// A cloud at one time.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Mass of droplets per mass of air \[1\], `(nz, ny, nx)`.
    pub cloud: Vec<f32>,
    /// Steps taken so far.
    pub steps: u64,
    /// The air around it, where asked for.
    pub air: Option<Inside>,
}

/// The air in the box, each `(nz, ny, nx)`.
#[derive(Debug, Clone)]
pub struct Inside {
    /// Mass of vapour and droplets per mass of air \[1\].
    pub water: Vec<f32>,
    /// Temperature \[K\].
    pub temperature: Vec<f32>,
    /// Velocities on the lower faces across x, y, z \[m/s\].
    pub velocity: [Vec<f32>; 3],
    /// Divergence of the velocities \[1/s\].
    pub divergence: Vec<f32>,
}

/// A level of the column at rest, as the kernels take it.
#[derive(Debug, Clone, Copy)]
struct Level {
    /// Pressure \[Pa\].
    pressure: f32,
    /// Temperature of air with the energy of the ground \[K\].
    base: f32,
    /// Virtual temperature at rest \[K\].
    at_rest: f32,
}

struct AirState {
    mesh: StaggeredGrid,
    levels: Vec<Level>,
    velocity: [GridField; 3],
    /// Static energy above that of the ground \[K\].
    energy: GridField,
    water: GridField,
    spare: [GridField; 3],
    /// Buoyant acceleration \[m/s²\] and droplets \[1\] of the cells.
    buoyancy: GridField,
    cloud: GridField,
    vorticity: Vorticity,
    projector: Projector,
    ground: Vec<f32>,
}

/// Grow a cloud and return it at the given times.
pub fn simulate(weather: &SimulationSettings, job: &Job) -> Result<Vec<Snapshot>> {
    weather.check()?;
    let mut air = AirState::new(weather, job)?;
    let end = weather.times.last().copied().unwrap_or(0.0);
    // Progress is told in thousandths: how many steps there will be is not known.
    job.expect(1000);
    let (mut told, mut now, mut steps) = (0, 0.0, 0);
    let mut seen = Vec::with_capacity(weather.times.len());
    for &time in &weather.times {
        while now < time {
            let dt = air.longest_step(weather, job)?.min(weather.step);
            // The last steps before a time are evened out, so that none is tiny.
            let left = time - now;
            let dt = if left > 2.0 * dt { dt } else { left / (left / dt).ceil() };
            air.advance(weather, now, dt, job)?;
            now = if time - now - dt < 1e-9 * time { time } else { now + dt };
            steps += 1;
            let reached = (1000.0 * now / end) as u64;
            job.advance(reached - told)?;
            told = reached;
        }
        seen.push(air.snapshot(steps, weather.keep_all_fields, job)?);
    }
    job.advance(1000 - told)?;
    Ok(seen)
}

impl AirState {
    fn new(weather: &SimulationSettings, job: &Job) -> Result<Self> {
        let mesh = StaggeredGrid { n: weather.size, h: weather.voxel };
        let [_, _, nz] = mesh.n;
        let dz = mesh.h[2];
        let column = Sounding::new(nz, dz, weather.temperature, weather.humidity, weather.lapse);
        let height = |k: usize| (k as f64 + 0.5) * dz;
        let mut air = Self {
            mesh,
            levels: (0..nz)
                .map(|k| Level {
                    pressure: column.pressure[k] as f32,
                    base: (weather.temperature - DRY_LAPSE * height(k)) as f32,
                    at_rest: 1.0,
                })
                .collect(),
            velocity: [0, 1, 2].map(|_| mesh.field()),
            energy: mesh.field(),
            water: mesh.field(),
            spare: [0, 1, 2].map(|_| mesh.field()),
            buoyancy: mesh.field(),
            cloud: mesh.field(),
            vorticity: Vorticity::new(&mesh),
            projector: Projector::new(&mesh),
            ground: vec![0.0; mesh.n[0] * mesh.n[1]],
        };
        let excess: Vec<f32> =
            (0..nz).map(|k| (column.temperature[k] - weather.temperature + DRY_LAPSE * height(k)) as f32).collect();
        mesh.rows(&mut air.energy, Stand::Cell, job, |_, k, _, row| row.fill(excess[k]))?;
        mesh.rows(&mut air.water, Stand::Cell, job, |_, k, _, row| row.fill(column.vapour[k] as f32))?;
        // The virtual temperature at rest is computed by the kernel that will compute it in motion: air at rest then
        // has no buoyancy to the last bit, and stays at rest.
        for (k, level) in air.levels.iter_mut().enumerate() {
            level.at_rest = virtual_temperature(excess[k], column.vapour[k] as f32, 0.0, *level);
        }
        air.settle(job)?;
        Ok(air)
    }

    /// The longest step that is stable \[s\].
    fn longest_step(&self, weather: &SimulationSettings, job: &Job) -> Result<f64> {
        let rate = fastest(&self.mesh, &self.velocity, job)?;
        let [nx, ny, nz] = self.mesh.n;
        let pushes = job.map(nz, |k| {
            let mut peak = 0.0_f32;
            for j in 0..ny {
                let start = self.mesh.row(j, k);
                for x in &self.buoyancy[start..start + nx] {
                    peak = if x.abs() <= peak { peak } else { x.abs() };
                }
            }
            Ok(peak)
        })?;
        let push = f64::from(pushes.into_iter().fold(0.0, |a: f32, b| if b <= a { a } else { b }));
        // What is pushed from rest must not cross a cell within the step either.
        let falls = (2.0 * COURANT * self.mesh.h[2] / push.max(1e-9)).sqrt();
        // Nor what the heat of the step itself pushes, which nobody has felt yet.
        let growth = GRAVITY / weather.temperature * weather.warming();
        let heated = (COURANT * self.mesh.h[2] / growth.max(1e-12)).cbrt();
        let longest = (COURANT / rate.max(1e-9)).min(falls).min(heated);
        if longest.is_finite() && longest > 1e-6 {
            Ok(longest.min(weather.step))
        } else {
            Err(Error::Data { name: "simulation", reason: "the wind grew without bounds; please report it".into() })
        }
    }

    fn advance(&mut self, weather: &SimulationSettings, now: f64, dt: f64, job: &Job) -> Result<()> {
        let mesh = self.mesh;
        for field in [&mut self.energy, &mut self.water] {
            advect(&mesh, &self.velocity, field, Stand::Cell, dt, &mut self.spare[0], job)?;
            std::mem::swap(field, &mut self.spare[0]);
        }
        for axis in 0..3 {
            let field = &self.velocity[axis];
            advect(&mesh, &self.velocity, field, Stand::Face(axis), dt, &mut self.spare[axis], job)?;
        }
        std::mem::swap(&mut self.velocity, &mut self.spare);
        self.warm(weather, now, dt, job)?;
        self.settle(job)?;
        add_to_faces(&mesh, &mut self.velocity[2], 2, &self.buoyancy, dt as f32, job)?;
        if weather.confinement > 0.0 {
            confine(&mesh, &mut self.velocity, weather.confinement, dt, &mut self.vorticity, job)?;
        }
        self.damp(dt, job)?;
        self.projector.project(&mut self.velocity, job)
    }

    /// Heat from the ground into the lowest cells.
    fn warm(&mut self, weather: &SimulationSettings, now: f64, dt: f64, job: &Job) -> Result<()> {
        if weather.surface_heat_flux == 0.0 {
            return Ok(());
        }
        let mesh = self.mesh;
        let [nx, ny, _] = mesh.n;
        let rise = dt * weather.warming();
        let noise = Perlin::new(weather.key, 0x5E);
        job.chunks(&mut self.ground, nx, |j, row| {
            let y = (j as f64 + 0.5 - 0.5 * ny as f64) * mesh.h[1] / weather.radius;
            for (i, to) in row.iter_mut().enumerate() {
                let x = (i as f64 + 0.5 - 0.5 * nx as f64) * mesh.h[0] / weather.radius;
                let patch = (-(x * x + y * y)).exp();
                // Eddies of a few to the patch, which live for some minutes.
                let uneven = 1.0 + 2.0 * weather.perturbation * noise.fbm(2.2 * x, 2.2 * y, now / 200.0, 3, 0.7);
                *to = (rise * patch * if weather.perturbation > 0.0 { uneven.max(0.0) } else { 1.0 }) as f32;
            }
            Ok(())
        })?;
        let ground = &self.ground;
        mesh.rows(&mut self.energy, Stand::Cell, job, |j, k, _, row| {
            if k == 0 {
                for (to, surface_heat_flux) in row.iter_mut().zip(&ground[j * nx..]) {
                    *to += surface_heat_flux;
                }
            }
        })
    }

    /// Droplets and buoyancy from energy and water.
    fn settle(&mut self, job: &Job) -> Result<()> {
        let mesh = self.mesh;
        let nx = mesh.n[0];
        let (energy, water, levels) = (&self.energy, &self.water, &self.levels);
        mesh.rows(&mut self.cloud, Stand::Cell, job, |_, k, start, row| {
            condense(&energy[start..start + nx], &water[start..start + nx], levels[k], row);
        })?;
        let cloud = &self.cloud;
        mesh.rows(&mut self.buoyancy, Stand::Cell, job, |_, k, start, row| {
            for (i, to) in row.iter_mut().enumerate() {
                let at = start + i;
                *to = buoyancy(virtual_temperature(energy[at], water[at], cloud[at], levels[k]), levels[k]);
            }
        })
    }

    /// Bring the air below the lid to rest, so that waves do not come back from it.
    fn damp(&mut self, dt: f64, job: &Job) -> Result<()> {
        let mesh = self.mesh;
        let nz = mesh.n[2] as f64;
        for axis in 0..3 {
            mesh.rows(&mut self.velocity[axis], Stand::Face(axis), job, |_, k, _, row| {
                let middle = if axis == 2 { 0.0 } else { 0.5 };
                let into = ((k as f64 + middle) / nz - (1.0 - SPONGE.0)) / SPONGE.0;
                if into > 0.0 {
                    let keep = (1.0 / (1.0 + dt * SPONGE.1 * into * into)) as f32;
                    for x in row {
                        *x *= keep;
                    }
                }
            })?;
        }
        Ok(())
    }

    fn snapshot(&mut self, steps: u64, keep_all_fields: bool, job: &Job) -> Result<Snapshot> {
        let mesh = self.mesh;
        let cloud = mesh.inside(&self.cloud);
        if !keep_all_fields {
            return Ok(Snapshot { cloud, steps, air: None });
        }
        let mut rest = vec![0.0; mesh.n.iter().product()];
        divergence(&mesh, &self.velocity, &mut rest, job)?;
        let layer = mesh.n[0] * mesh.n[1];
        let mut warmth = mesh.inside(&self.energy);
        for (at, t) in warmth.iter_mut().enumerate() {
            *t = temperature(*t, cloud[at], self.levels[at / layer]);
        }
        let air = Inside {
            water: mesh.inside(&self.water),
            temperature: warmth,
            velocity: [0, 1, 2].map(|axis| mesh.inside(&self.velocity[axis])),
            divergence: rest,
        };
        Ok(Snapshot { cloud, steps, air: Some(air) })
    }
}

/// Temperature \[K\] from static energy and droplets.
#[inline(always)]
fn temperature(energy: f32, cloud: f32, level: Level) -> f32 {
    energy + level.base + (LATENT / HEAT_CAPACITY) as f32 * cloud
}

/// Temperature at which dry air is as heavy \[K\].
#[inline(always)]
fn virtual_temperature(energy: f32, water: f32, cloud: f32, level: Level) -> f32 {
    temperature(energy, cloud, level) * (1.0 + LIGHTNESS as f32 * (water - cloud) - cloud)
}

/// Upward acceleration \[m/s²\].
#[inline(always)]
fn buoyancy(virtual_temperature: f32, level: Level) -> f32 {
    GRAVITY as f32 * (virtual_temperature - level.at_rest) / level.at_rest
}

/// Droplets in a row of one level: what is above saturation once their heat has warmed the air.
///
/// T − T_l − (L/c_p) (q − q_s(T)) = 0 is solved by four steps of Newton's method from T_l. It is convex and rises with
/// T: from below, the first step lands beyond the root and the next ones fall onto it. Where air is not saturated the
/// root lies below T_l, and there are no droplets.
fn condense(energy: &[f32], water: &[f32], level: Level, cloud: &mut [f32]) {
    const HEAT: f32 = (LATENT / HEAT_CAPACITY) as f32;
    let n = cloud.len();
    let (energy, water) = (&energy[..n], &water[..n]);
    lanes::run(
        #[inline(always)]
        || {
            for i in 0..n {
                let dry = energy[i] + level.base;
                let mut warm = dry;
                for _ in 0..4 {
                    let (holds, slope) = saturation(warm, level.pressure);
                    warm += (dry - warm + HEAT * (water[i] - holds)) / (1.0 + HEAT * slope);
                }
                let drops = (warm - dry) * (1.0 / HEAT);
                let drops = if drops > 0.0 { drops } else { 0.0 };
                cloud[i] = if drops < water[i] { drops } else { water[i] };
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weather() -> SimulationSettings {
        SimulationSettings {
            size: [12, 14, 16],
            voxel: [150.0, 130.0, 120.0],
            times: vec![0.0, 900.0],
            step: 10.0,
            surface_heat_flux: 600.0,
            radius: 500.0,
            perturbation: 0.5,
            temperature: 298.0,
            humidity: 0.7,
            lapse: 0.006,
            confinement: 0.15,
            key: 1,
            keep_all_fields: true,
        }
    }

    fn sum(field: &[f32]) -> f64 {
        field.iter().map(|&x| f64::from(x)).sum()
    }

    #[test]
    fn a_cloud_grows_and_no_water_is_lost() {
        let seen = simulate(&weather(), &Job::serial()).expect("runs");
        let water = |s: &Snapshot| sum(&s.air.as_ref().expect("asked for").water);
        assert!(sum(&seen[0].cloud) == 0.0 && sum(&seen[1].cloud) > 0.0, "a cloud");
        assert!((water(&seen[1]) / water(&seen[0]) - 1.0).abs() < 1e-6, "water");
    }

    #[test]
    fn cold_ground_leaves_air_at_rest_and_weather_is_checked() {
        let calm = simulate(&SimulationSettings { surface_heat_flux: 0.0, ..weather() }, &Job::serial()).expect("runs");
        let air = calm[1].air.as_ref().expect("asked for");
        assert!(air.velocity.iter().flatten().all(|&x| x == 0.0), "at rest");
        for wrong in [
            SimulationSettings { step: 0.0, ..weather() },
            SimulationSettings { confinement: 0.6, ..weather() },
            SimulationSettings { humidity: f64::NAN, ..weather() },
            SimulationSettings { times: vec![2.0, 1.0], ..weather() },
            SimulationSettings { size: [7, 8, 8], ..weather() },
        ] {
            assert!(matches!(simulate(&wrong, &Job::serial()), Err(Error::Range { .. })), "refused");
        }
    }
}

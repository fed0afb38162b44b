//! Procedural clouds: heaps of spheres with eroded surfaces (after Ebert et al. 2009, chapter 17).
//!
//! A cumulus is grown as it rises: a few thermals stand on a flat base, smaller puffs sit on their upper sides, and
//! smaller ones on those. The heap is kept as a distance to its surface, which billowing noise pushes in and out at
//! ever finer scales; density rises within a few voxels of the surface and with height, as liquid water does in a
//! rising parcel. Everything is a pure function of (key, shape), whatever the number of threads.

use glam::DVec3;

use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::noise::Perlin;
use crate::math::random::Stream;

/// Kinds of procedural cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A fair-weather heap with a flat base.
    Cumulus,
}

/// Voxels of a row that share one list of spheres.
const BLOCK: usize = 8;
/// Rows of a band of work.
const ROWS: usize = 4;

#[derive(Clone, Copy)]
struct Sphere {
    centre: DVec3,
    radius: f64,
}

/// Spheres of a cumulus in a unit of the box's smaller horizontal edge; the base lies at z = 0.
fn heap(key: u64, across: DVec3) -> Vec<Sphere> {
    let random = Stream::new(key, 0xC0_u64);
    let mut counter = 0;
    let mut draw = |low: f64, high: f64| {
        counter += 1;
        low + (high - low) * random.uniform(counter)
    };
    let mut spheres = Vec::new();
    let reach = 0.5 * across.x.min(across.y);
    // Thermals: a tall one near the middle, lower ones around it along a slightly bent row.
    let heading = draw(0.0, std::f64::consts::TAU);
    let thermals = 7 + (draw(0.0, 3.0) as usize);
    for i in 0..thermals {
        let from_middle = if i == 0 { 0.0 } else { draw(0.34, 0.72) * reach };
        let angle = heading + i as f64 * 2.399_963 + draw(-0.4, 0.4);
        let stretch = 1.0 - 0.45 * (angle - heading).sin().abs();
        let radius = reach * if i == 0 { draw(0.32, 0.38) } else { draw(0.17, 0.29) };
        let lift = if i == 0 { draw(0.75, 1.0) } else { draw(0.3, 0.8) };
        let centre = 0.5 * across.truncate().extend(0.0)
            + DVec3::new(angle.cos(), angle.sin(), 0.0) * (from_middle * stretch)
            + DVec3::Z * (radius * lift);
        spheres.push(Sphere { centre, radius });
        if i == 0 {
            // The tower keeps rising.
            spheres.push(Sphere {
                centre: centre + DVec3::new(draw(-0.15, 0.15), draw(-0.15, 0.15), draw(0.75, 0.95)) * radius,
                radius: radius * draw(0.66, 0.78),
            });
        }
    }
    // Puffs on the upper sides, twice.
    let mut first = 0;
    for generation in 0..3 {
        let last = spheres.len();
        for parent in first..last {
            let parent = spheres[parent];
            let puffs = [11, 6, 3][generation];
            for _ in 0..puffs {
                let up = draw(-0.25, 1.0);
                let around = draw(0.0, std::f64::consts::TAU);
                let flat = (1.0 - up * up).max(0.0).sqrt();
                let out = DVec3::new(around.cos() * flat, around.sin() * flat, up);
                let radius = parent.radius * draw(0.24, 0.50);
                spheres.push(Sphere { centre: parent.centre + out * (parent.radius * draw(0.78, 1.0)), radius });
            }
        }
        first = last;
    }
    spheres
}

/// Density of a procedural cloud, `(nz, ny, nx)` with the largest value 1.
pub fn density(kind: Kind, size: [usize; 3], key: u64, job: &Job) -> Result<Vec<f32>> {
    let Kind::Cumulus = kind;
    let [nx, ny, nz] = size;
    for (name, n) in [("shape[2]", nx), ("shape[1]", ny), ("shape[0]", nz)] {
        in_range(name, n as f64, 8.0, 4096.0, "1")?;
    }
    if nx * ny * nz > super::density::MAX_VOXELS {
        return Err(Error::Data { name: "shape", reason: format!("{nz} x {ny} x {nx} voxels are too many") });
    }
    let cloud = Cumulus::new(size, key);
    let mut out = vec![0.0_f32; nx * ny * nz];
    // A band is a few rows of voxels: short enough to be stopped at once in the largest volumes.
    job.expect((ny * nz) as u64);
    job.bands(&mut out, ROWS * nx, |band, rows| {
        for (r, row) in rows.chunks_exact_mut(nx).enumerate() {
            let (k, j) = ((band * ROWS + r) / ny, (band * ROWS + r) % ny);
            cloud.fill_row(j, k, row);
        }
        job.advance((rows.len() / nx) as u64)
    })?;
    let peak = out.iter().copied().fold(0.0_f32, f32::max);
    if peak > 0.0 {
        job.bands(&mut out, 1 << 20, |_, part| {
            for x in part {
                *x /= peak;
            }
            Ok(())
        })?;
    }
    Ok(out)
}

/// A heap fitted to its box, and the noises that erode it. Lengths are in units of the box's smaller horizontal edge.
struct Cumulus {
    size: [usize; 3],
    unit: f64,
    margin: f64,
    squeeze: f64,
    height: f64,
    /// How far from the spheres' surface billows reach.
    reach: f64,
    /// Frequency of the largest billows.
    scale: f64,
    spheres: Vec<Sphere>,
    billows: Perlin,
    wisps: Perlin,
    base: Perlin,
}

impl Cumulus {
    fn new(size: [usize; 3], key: u64) -> Self {
        let [nx, ny, nz] = size;
        let unit = 1.0 / nx.min(ny) as f64;
        let across = DVec3::new(nx as f64 * unit, ny as f64 * unit, 1.0);
        let mut spheres = heap(key, across);
        let top = spheres.iter().map(|s| s.centre.z + s.radius).fold(0.0, f64::max);
        let margin = 4.0 * unit;
        // Shrink the whole heap about its foot when the box is low.
        let squeeze = ((nz as f64 * unit - 2.0 * margin) / top).clamp(0.05, 1.0);
        let foot = 0.5 * across.truncate().extend(0.0);
        for sphere in &mut spheres {
            sphere.centre = foot + (sphere.centre - foot) * squeeze;
            sphere.radius *= squeeze;
        }
        Self {
            size,
            unit,
            margin,
            squeeze,
            height: top * squeeze,
            reach: 0.12 * squeeze,
            scale: 7.0 / squeeze.max(0.3),
            spheres,
            billows: Perlin::new(key, 0xC1),
            wisps: Perlin::new(key, 0xC2),
            base: Perlin::new(key, 0xC3),
        }
    }

    /// Density of the voxels of row `j` in layer `k`.
    fn fill_row(&self, j: usize, k: usize, row: &mut [f32]) {
        let [nx, ny, nz] = self.size;
        let (y, z) = ((j as f64 + 0.5) * self.unit, (k as f64 + 0.5) * self.unit - self.margin);
        let near: Vec<Sphere> = self
            .spheres
            .iter()
            .copied()
            .filter(|s| {
                let room = s.radius + self.reach;
                (s.centre.z - z).abs() < room && (s.centre.y - y).abs() < room
            })
            .collect();
        if near.is_empty() {
            return;
        }
        // The box's own faces stay clear, so that no cloud ends in a wall.
        let fade = |i: usize, n: usize| smooth(0.0, 4.0, i.min(n - 1 - i) as f64);
        let clear = fade(j, ny) * fade(k, nz);
        let mut close: Vec<Sphere> = Vec::new();
        for (i, out) in row.iter_mut().enumerate() {
            let x = (i as f64 + 0.5) * self.unit;
            if i % BLOCK == 0 {
                // The block's middle stands for its voxels.
                let (middle, half) = (x + 0.5 * (BLOCK - 1) as f64 * self.unit, 0.5 * BLOCK as f64 * self.unit);
                close.clear();
                close.extend(near.iter().filter(|s| {
                    let (dx, room) = (((s.centre.x - middle).abs() - half).max(0.0), s.radius + self.reach);
                    dx.powi(2) + (s.centre.y - y).powi(2) + (s.centre.z - z).powi(2) < room * room
                }));
            }
            if !close.is_empty() {
                *out = (self.at(DVec3::new(x, y, z), &close) * clear * fade(i, nx)) as f32;
            }
        }
    }

    /// Density at a point, of which `close` are the spheres that matter.
    fn at(&self, p: DVec3, close: &[Sphere]) -> f64 {
        let squeeze = self.squeeze;
        // Smooth union: creases between puffs are soft.
        let blend = 0.018 * squeeze;
        let mut distance = f64::INFINITY;
        for s in close {
            let d = (p - s.centre).length() - s.radius;
            let h = (0.5 + 0.5 * (distance - d) / blend).clamp(0.0, 1.0);
            distance = if distance.is_finite() { distance + (d - distance) * h - blend * h * (1.0 - h) } else { d };
        }
        if distance > self.reach {
            return 0.0;
        }
        let q = p * self.scale;
        let deep = distance < -self.reach;
        let (mut swell, mut ragged) = (0.0, 0.0);
        if !deep {
            // Billows: the noise's absolute value is creased inwards, round outwards, like a cauliflower.
            let (mut weight, mut frequency) = (0.050 * squeeze, 1.0);
            for octave in 0..5 {
                let shift = 31.7 * f64::from(octave);
                let n = self.billows.at(q.x * frequency + shift, q.y * frequency, q.z * frequency - shift).abs();
                swell += weight * (0.35 - n);
                weight *= 0.58;
                frequency *= 2.03;
            }
            ragged = self.wisps.fbm(q.x * 3.1, q.y * 3.1, q.z * 3.1, 3, 0.55);
        }
        // A ragged fringe, thinner at the crown than near the base where the cloud evaporates.
        let level = (p.z / self.height).clamp(0.0, 1.0);
        let fringe = (0.012 + 0.020 * (1.0 - level)) * squeeze;
        let edge = smooth(0.0, fringe, swell - distance + 0.3 * fringe * ragged);
        if edge == 0.0 {
            return 0.0;
        }
        // Condensation level: flat, with a slight waviness.
        let level_of_base = 0.012 * (1.0 + self.base.fbm(q.x * 0.8, q.y * 0.8, 0.5, 3, 0.5));
        let above = smooth(0.0, 0.030, p.z - level_of_base);
        // Liquid water grows with height above the base; lumps inside.
        let water = 0.45 + 0.55 * level.sqrt();
        let lumps = 1.0 + 0.25 * self.wisps.fbm(q.x * 1.3, q.y * 1.3, q.z * 1.3, 2, 0.5);
        (edge * above * water * lumps).max(0.0)
    }
}

fn smooth(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cumulus_fills_its_box_without_touching_it() {
        let size = [40, 44, 28];
        let a = density(Kind::Cumulus, size, 3, &Job::serial()).expect("grows");
        let b = density(Kind::Cumulus, size, 4, &Job::serial()).expect("grows");
        assert_ne!(a, b, "another key, another cloud");
        assert!(a.iter().all(|&x| (0.0..=1.0).contains(&x)), "density in [0, 1]");
        let filled = a.iter().filter(|&&x| x > 0.0).count() as f64 / a.len() as f64;
        assert!((0.08..0.5).contains(&filled), "fills {filled} of the box");
        for (at, &x) in a.iter().enumerate() {
            let (i, j, k) = (at % 40, at / 40 % 44, at / 1760);
            let face = i == 0 || j == 0 || k == 0 || i == 39 || j == 43 || k == 27;
            assert!(!face || x == 0.0, "clear at the faces, {x} at {i} {j} {k}");
        }
    }
}

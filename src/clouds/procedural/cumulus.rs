//! Cumulus and cumulonimbus with its anvil: an implicit surface of spheres with billowing noise (after Ebert et al.
//! 2009, chapter 17).
//!
//! A cumulus is grown as it rises: a few thermals stand on a flat base, smaller subthermals sit on their upper sides,
//! and smaller ones on those. The heap is kept as a distance to its surface, which billowing noise pushes in and out at
//! ever finer scales; density rises within a few voxels of the surface and with height, as liquid water does in a
//! rising parcel. A cumulonimbus is a taller heap whose thermals stand on each other up to a level where they are no
//! longer lighter than the air: there ice spreads into a sheet, drawn out by the wind, fibrous above and pouched below.

use glam::DVec3;

use super::shape::{CloudShape, edge_falloff, margin};
use crate::math::interpolation::smoothstep;
use crate::math::noise::Perlin;
use crate::math::random::Stream;

/// Voxels of a row that share one list of spheres.
const BLOCK: usize = 8;
/// Height of a cumulonimbus over the box's smaller horizontal edge, where the box has room for it.
const TALL: f64 = 1.1;

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
    subthermals(&mut spheres, &[11, 6, 3], &mut draw);
    spheres
}

/// Spheres of a cumulonimbus of height 1 and horizontal reach `reach`, about the origin.
fn tower(key: u64, reach: f64) -> Vec<Sphere> {
    let random = Stream::new(key, 0xC8_u64);
    let mut counter = 0;
    let mut draw = |low: f64, high: f64| {
        counter += 1;
        low + (high - low) * random.uniform(counter)
    };
    let mut spheres = Vec::new();
    let wide = (0.42 * reach).min(0.20);
    let heading = draw(0.0, std::f64::consts::TAU);
    // The main updraught, then younger ones in line with it, each lower and narrower.
    let columns = 6;
    for i in 0..columns {
        let age = if i == 0 { 1.0 } else { draw(0.25, 0.62) };
        let away = if i == 0 { 0.0 } else { draw(0.7, 1.55) * wide };
        let angle = heading + std::f64::consts::PI * f64::from(i % 2) + draw(-0.9, 0.9);
        let foot = DVec3::new(angle.cos(), angle.sin(), 0.0) * away;
        let broad = wide * if i == 0 { 1.0 } else { draw(0.45, 0.7) };
        let top = if i == 0 { 0.93 } else { 0.93 * age };
        let mut z = 0.55 * broad;
        while z + 0.7 * broad < top {
            let radius = broad * (1.0 - 0.32 * z / top) * draw(0.85, 1.12);
            let sway = DVec3::new(draw(-0.22, 0.22), draw(-0.22, 0.22), 0.0) * broad;
            spheres.push(Sphere { centre: foot + sway + DVec3::Z * z, radius });
            z += radius * draw(0.55, 0.8);
        }
        let radius = (top - z).max(0.35 * broad);
        spheres.push(Sphere { centre: foot + DVec3::Z * (top - radius), radius });
    }
    subthermals(&mut spheres, &[10, 5], &mut draw);
    spheres
}

/// Subthermals on the sides of spheres, and on theirs, for each generation so many.
fn subthermals(spheres: &mut Vec<Sphere>, generations: &[usize], draw: &mut impl FnMut(f64, f64) -> f64) {
    let mut first = 0;
    for &count in generations {
        let last = spheres.len();
        for parent in first..last {
            let parent = spheres[parent];
            for _ in 0..count {
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
}

/// The spread ice of a cumulonimbus: an ellipse drawn out downwind.
struct Anvil {
    centre: DVec3,
    /// Unit vector downwind.
    wind: DVec3,
    /// Half axes along and across the wind.
    half: [f64; 2],
    thick: f64,
    ice: Perlin,
}

impl Anvil {
    /// Density at a point; `centre.z` is the top.
    fn at(&self, p: DVec3) -> f64 {
        let away = p - self.centre;
        let below = -away.z / self.thick;
        if !(-0.1..1.4).contains(&below) {
            return 0.0;
        }
        let (along, across) = (away.dot(self.wind), away.y * self.wind.x - away.x * self.wind.y);
        let [long, wide] = self.half;
        let (a, b) = (along / long, across / wide);
        // Fibres run downwind and end raggedly.
        let fibres = self.ice.fbm(a * 1.6, b * 8.0, below * 1.2, 5, 0.65);
        let lumps = self.ice.fbm(a * 3.0 + 40.0, b * 3.0, below * 2.0, 4, 0.5);
        let out = (a * a + b * b).sqrt() + 0.28 * fibres + 0.22 * lumps;
        if out >= 1.0 {
            return 0.0;
        }
        // Thick over the tower, thinning outwards from below; pouches hang where it is thick.
        let pouch = self.ice.at(a * 13.0, b * 13.0, 7.5).abs();
        let floor = (1.0 - 0.75 * smoothstep(0.2, 1.1, out)) * (1.05 - 0.22 * pouch) + 0.10 * lumps;
        let roof = 0.04 + 0.10 * smoothstep(0.3, 1.0, out) - 0.05 * fibres;
        let inside = smoothstep(roof, roof + 0.12, below) * smoothstep(0.0, 0.16, floor - below);
        inside * smoothstep(0.0, 0.45, 1.0 - out) * (0.30 + 0.12 * (1.0 - out)) * (1.0 + 0.7 * fibres).max(0.15)
    }
}

/// A heap fitted to its box, and the noises that erode it. Lengths are in units of the box's smaller horizontal edge.
pub(super) struct Cumulus {
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
    anvil: Option<Anvil>,
}

impl Cumulus {
    /// A cumulus.
    pub(super) fn fair_weather(size: [usize; 3], key: u64) -> Self {
        let [nx, ny, nz] = size;
        let unit = 1.0 / nx.min(ny) as f64;
        let across = DVec3::new(nx as f64 * unit, ny as f64 * unit, 1.0);
        let mut spheres = heap(key, across);
        let top = spheres.iter().map(|s| s.centre.z + s.radius).fold(0.0, f64::max);
        let margin = margin(nz) * unit;
        // Shrink the whole heap about its foot when the box is low.
        let squeeze = ((nz as f64 * unit - 2.0 * margin) / top).clamp(0.05, 1.0);
        let foot = 0.5 * across.truncate().extend(0.0);
        for sphere in &mut spheres {
            sphere.centre = foot + (sphere.centre - foot) * squeeze;
            sphere.radius *= squeeze;
        }
        Self {
            height: top * squeeze,
            reach: 0.12 * squeeze,
            scale: 7.0 / squeeze.max(0.3),
            ..Self::around(size, key, margin, squeeze, spheres)
        }
    }

    /// A cumulonimbus, as high as its box.
    pub(super) fn cumulonimbus(size: [usize; 3], key: u64) -> Self {
        let [nx, ny, nz] = size;
        let unit = 1.0 / nx.min(ny) as f64;
        let across = DVec3::new(nx as f64 * unit, ny as f64 * unit, 0.0);
        let margin = margin(nz) * unit;
        let height = (nz as f64 * unit - 2.0 * margin).min(TALL);
        let mut spheres = tower(key, 0.5 / height);
        // The anvil goes downwind along the longer edge, and the tower stands upwind of the middle.
        let random = Stream::new(key, 0xC9);
        let turn = (random.uniform(0) - 0.5) * 0.6;
        let wind =
            if nx >= ny { DVec3::new(turn.cos(), turn.sin(), 0.0) } else { DVec3::new(turn.sin(), turn.cos(), 0.0) };
        let half = [0.44 * across.x.max(across.y).min(2.2), 0.36];
        let foot = 0.5 * across - wind * (0.42 * half[0]);
        for sphere in &mut spheres {
            sphere.centre = foot + sphere.centre * height;
            sphere.radius *= height;
        }
        let thick = 0.22 * height;
        let centre = 0.5 * across + DVec3::Z * (0.93 * height);
        Self {
            height,
            reach: 0.10 * height,
            scale: 8.0 / height.max(0.3),
            anvil: Some(Anvil { centre, wind, half, thick, ice: Perlin::new(key, 0xC4) }),
            ..Self::around(size, key, margin, 0.75 * height, spheres)
        }
    }

    fn around(size: [usize; 3], key: u64, margin: f64, squeeze: f64, spheres: Vec<Sphere>) -> Self {
        Self {
            size,
            unit: 1.0 / size[0].min(size[1]) as f64,
            margin,
            squeeze,
            height: 1.0,
            reach: 0.0,
            scale: 1.0,
            spheres,
            billows: Perlin::new(key, 0xC1),
            wisps: Perlin::new(key, 0xC2),
            base: Perlin::new(key, 0xC3),
            anvil: None,
        }
    }
}

impl CloudShape for Cumulus {
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
        if near.is_empty() && self.anvil.is_none() {
            return;
        }
        let open = edge_falloff(j, ny) * edge_falloff(k, nz);
        if open == 0.0 {
            return;
        }
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
            let p = DVec3::new(x, y, z);
            let drops = if close.is_empty() { 0.0 } else { self.at(p, &close) };
            let ice = self.anvil.as_ref().map_or(0.0, |anvil| anvil.at(p));
            // Where the tower ends in the anvil neither shows a seam.
            *out = ((drops + ice - drops * ice) * open * edge_falloff(i, nx)) as f32;
        }
    }
}

impl Cumulus {
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
        let edge = smoothstep(0.0, fringe, swell - distance + 0.3 * fringe * ragged);
        if edge == 0.0 {
            return 0.0;
        }
        // Condensation level: flat, with a slight waviness.
        let level_of_base = 0.012 * (1.0 + self.base.fbm(q.x * 0.8, q.y * 0.8, 0.5, 3, 0.5));
        let above = smoothstep(0.0, 0.030, p.z - level_of_base);
        // Liquid water grows with height above the base; lumps inside.
        let water = 0.45 + 0.55 * level.sqrt();
        let lumps = 1.0 + 0.25 * self.wisps.fbm(q.x * 1.3, q.y * 1.3, q.z * 1.3, 2, 0.5);
        (edge * above * water * lumps).max(0.0)
    }
}

//! Foliage: leaves as particles in chains that stand for twigs (corot paper, IV.3, Fig. 13 and 14).
//!
//! A vertex of the tree that is not too near the centre or the tip of its stem sprouts with some probability. A sprout
//! is a chain: each particle lies one distance from the one before, in the direction of its own normal. The first
//! normal is at `angle` to the backward direction of the stem, in the plane of that and of the vertex' way out; each
//! step then turns it by a normal angle about a random axis. With `droop` (ours) a chain hangs: each step goes further
//! down than its normal points, and the normal, which is what is lit, stays.
//!
//! Fading (D5): leaves are ranked by their distance from the centre, the outermost first to go. A particle begins to
//! fade at `1 - rank`, moved by a bias and a normal variation, and is gone a length later. `outer < 1` mixes the rank
//! with a random number, which keeps the silhouette better (ours).
//!
//! A particle's draws are keyed by (seed, address of its stem, step, corner), and its label and id by the same, so they
//! stay when other leaves come or go.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::skeleton::{Skeleton, Varied};
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::random::Stream;

/// How leaves are placed and how they fade.
#[derive(Debug, Clone, PartialEq)]
pub struct Foliage {
    /// Lowest step of the trunk that sprouts.
    pub lowest_step: usize,
    /// Topmost steps of the trunk that do not.
    pub trim_top: usize,
    /// First step of a branch that sprouts.
    pub from_center: usize,
    /// Last steps of a branch that do not.
    pub from_tip: usize,
    /// Coarsest level of stems that sprouts: 0 with the trunk.
    pub first_level: usize,
    /// Probability that a vertex sprouts \[1\].
    pub probability: f64,
    /// Angle to the backward direction of the stem \[rad\].
    pub angle: f64,
    /// Distance between particles of a chain \[unit\].
    pub distance: f64,
    /// Particles of a chain.
    pub steps: usize,
    /// Deviation of the turn of a step \[rad\].
    pub wobble: f64,
    /// Turn towards the ground of a step \[rad\].
    pub droop: f64,
    /// Centre of the tree, or the mean of its leaves \[unit\].
    pub center: Option<DVec3>,
    /// Width and height \[unit\].
    pub size: [f64; 2],
    /// Deviation of the size as a fraction of it \[1\].
    pub variance: f64,
    /// Growth of the innermost over the outermost, as a fraction \[1\].
    pub inside_growth: f64,
    /// Whether leaves fade with distance.
    pub fades: bool,
    /// Added to all thresholds \[1\].
    pub bias: f64,
    /// Deviation of the thresholds \[1\].
    pub threshold_sigma: f64,
    /// Length of a fade, in steps of a chain.
    pub fade: Varied,
    /// Shortest fade, in steps of a chain.
    pub fade_min: f64,
    /// Fraction of the place in the order of vanishing, the rest is chance \[1\].
    pub outer: f64,
}

/// Leaves, one element for each.
#[derive(Debug, Clone, Default)]
pub struct Leaves {
    /// Places \[m\].
    pub position: Vec<DVec3>,
    /// Unit normals.
    pub normal: Vec<DVec3>,
    /// Distance along the chain from the vertex it sprouts from \[m\].
    pub branch_distance: Vec<f32>,
    /// Step within the chain, from 0.
    pub order: Vec<u16>,
    /// Stem it belongs to.
    pub stem: Vec<u32>,
    /// Random 32 bits of its own.
    pub label: Vec<u32>,
    /// Random 62 bits of its own.
    pub id: Vec<i64>,
}

/// What depends on the centre and the look alone.
#[derive(Debug, Clone, Default)]
pub struct Dress {
    /// Centre of the tree \[m\].
    pub center: DVec3,
    /// Distance from the centre \[m\].
    pub center_distance: Vec<f32>,
    /// The same from 0 at the nearest to 1 at the farthest.
    pub center_ratio: Vec<f32>,
    /// Distance along the chain over its largest.
    pub branch_ratio: Vec<f32>,
    /// Width and height \[m\].
    pub size: Vec<[f32; 2]>,
    /// Distances at which it begins to fade and is gone.
    pub fade: Vec<[f32; 2]>,
}

/// Fades of what never fades.
pub const NEVER: [f32; 2] = [2.0, 3.0];
/// More leaves than any sensible tree has.
pub const MAX_LEAVES: usize = 1 << 26;

const PURPOSE_LEAF: u64 = 0x6c65_6166;
const PURPOSE_DRESS: u64 = 0x6472_6573;
const SLOTS: u64 = 4;
/// Chains of a chunk of work.
const CHAINS: usize = 256;

/// A vertex that sprouts.
struct Sprout {
    at: DVec3,
    normal: DVec3,
    stem: u32,
    stream: Stream,
}

impl Foliage {
    fn validate(&self) -> Result<()> {
        in_range("probability", self.probability, 0.0, 1.0, "1")?;
        in_range("distance", self.distance, 0.0, 1e9, "unit")?;
        in_range("steps", self.steps as f64, 0.0, 60_000.0, "1")
    }

    /// Whether a vertex of ring `k` of `count` may sprout.
    fn eligible(&self, level: usize, k: usize, count: usize) -> bool {
        if level < self.first_level {
            false
        } else if level == 0 {
            k >= self.lowest_step && k + self.trim_top < count
        } else {
            // Ring 0 of a branch is its step 1.
            k + 1 >= self.from_center && k + self.from_tip < count
        }
    }
}

/// `v` turned towards the unit `t` at a right angle to it.
fn towards(v: DVec3, t: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    v * cos + t * sin
}

fn sprouts(tree: &Skeleton, how: &Foliage, key: u64) -> Vec<Sprout> {
    let mut out = Vec::new();
    for (index, stem) in tree.stems.iter().enumerate() {
        let rings = tree.of(index);
        for (k, ring) in rings.iter().enumerate().filter(|(k, _)| how.eligible(stem.level, *k, rings.len())) {
            for corner in 0..4 {
                let address = Stream::new(stem.address, PURPOSE_LEAF).bits((4 * k + corner) as u64);
                let stream = Stream::new(key, PURPOSE_LEAF ^ address);
                if stream.uniform(0) >= how.probability {
                    continue;
                }
                let at = ring.corners[corner];
                let out_of = at - ring.center;
                let out_of =
                    (out_of - ring.axis * out_of.dot(ring.axis)).normalize_or(ring.axis.any_orthonormal_vector());
                let normal = towards(ring.axis, out_of, PI - how.angle);
                out.push(Sprout { at, normal, stem: index as u32, stream });
            }
        }
    }
    out
}

/// Emit leaves; `unit` in metres.
pub fn emit(tree: &Skeleton, how: &Foliage, unit: f64, key: u64, job: &Job) -> Result<Leaves> {
    how.validate()?;
    let sprouts = sprouts(tree, how, key);
    let n = sprouts.len() * how.steps;
    if n > MAX_LEAVES {
        return Err(Error::Data { name: "leaves", reason: format!("there would be {n}, more than {MAX_LEAVES}") });
    }
    let mut places = vec![(DVec3::ZERO, DVec3::ZERO); n];
    job.chunks(&mut places, CHAINS * how.steps.max(1), |chunk, places| {
        for (sprout, chain) in sprouts[CHAINS * chunk..].iter().zip(places.chunks_exact_mut(how.steps.max(1))) {
            let (mut at, mut normal) = (sprout.at, sprout.normal);
            for (k, place) in chain.iter_mut().enumerate() {
                let index = SLOTS * (k as u64 + 1);
                if how.wobble > 0.0 {
                    let (u, v) = normal.any_orthonormal_pair();
                    let (sin, cos) = (TAU * sprout.stream.uniform(index)).sin_cos();
                    normal = towards(normal, u * cos + v * sin, how.wobble * sprout.stream.normal3(index + 1));
                }
                normal = normal.normalize();
                let mut way = normal;
                if how.droop > 0.0 {
                    let down = DVec3::NEG_Z - normal * -normal.z;
                    // Not past the plumb line.
                    let most = down.length().atan2(-normal.z);
                    if let Some(t) = down.try_normalize() {
                        way = towards(normal, t, (how.droop * (k + 1) as f64).min(most)).normalize();
                    }
                }
                at += way * how.distance;
                *place = (at, normal);
            }
        }
        Ok(())
    })?;
    let mut out = Leaves {
        position: places.iter().map(|p| p.0 * unit).collect(),
        normal: places.iter().map(|p| p.1).collect(),
        ..Leaves::default()
    };
    for sprout in &sprouts {
        for k in 0..how.steps {
            let bits = sprout.stream.bits(SLOTS * (k as u64 + 1) + 2);
            out.branch_distance.push(((k + 1) as f64 * how.distance * unit) as f32);
            out.order.push(k as u16);
            out.stem.push(sprout.stem);
            out.label.push((bits >> 32) as u32);
            out.id.push((bits >> 2) as i64);
        }
    }
    Ok(out)
}

/// Ratios, sizes and fades of leaves for a centre, sizes and thresholds: nothing here moves a leaf.
pub fn dress(leaves: &[DVec3], branch_distance: &[f32], id: &[i64], how: &Foliage, unit: f64) -> Result<Dress> {
    let n = leaves.len();
    if n == 0 {
        return Ok(Dress { center: how.center.unwrap_or_default() * unit, ..Dress::default() });
    }
    let mean = leaves.iter().fold(DVec3::ZERO, |sum, &p| sum + p) / n as f64;
    let center = how.center.map_or(mean, |c| c * unit);
    let far: Vec<f32> = leaves.iter().map(|&p| (p - center).length() as f32).collect();
    let (low, high) = far.iter().fold((f32::INFINITY, 0.0_f32), |(l, h), &d| (l.min(d), h.max(d)));
    let span = if high > low { high - low } else { 1.0 };
    let center_ratio: Vec<f32> = far.iter().map(|&d| (d - low) / span).collect();
    let longest = branch_distance.iter().fold(0.0_f32, |m, &d| m.max(d));
    let branch_ratio = branch_distance.iter().map(|&d| if longest > 0.0 { d / longest } else { 0.0 }).collect();
    let stream = |k: usize| Stream::new(id[k] as u64, PURPOSE_DRESS);
    let size = (0..n)
        .map(|k| {
            let grown = 1.0 + how.inside_growth * f64::from(1.0 - center_ratio[k]);
            let varied = if how.variance > 0.0 { (1.0 + how.variance * stream(k).normal3(0)).max(0.05) } else { 1.0 };
            how.size.map(|s| (s * unit * grown * varied) as f32)
        })
        .collect();
    let fade = if how.fades { fades(&far, how, stream) } else { vec![NEVER; n] };
    Ok(Dress { center, center_distance: far, center_ratio, branch_ratio, size, fade })
}

fn fades(far: &[f32], how: &Foliage, stream: impl Fn(usize) -> Stream) -> Vec<[f32; 2]> {
    let n = far.len();
    let ranked = |keys: &[f32]| {
        let mut order: Vec<u64> =
            keys.iter().enumerate().map(|(k, d)| u64::from(d.to_bits()) << 32 | k as u64).collect();
        // Distances are not negative: their bits sort like numbers; ties by index.
        order.sort_unstable();
        let mut rank = vec![0.0_f32; n];
        for (place, &key) in order.iter().enumerate() {
            rank[(key & 0xffff_ffff) as usize] = (place as f32 + 0.5) / n as f32;
        }
        rank
    };
    let mut rank = ranked(far);
    if how.outer < 1.0 {
        let mixed: Vec<f32> = (0..n)
            .map(|k| (how.outer * f64::from(rank[k]) + (1.0 - how.outer) * stream(k).uniform(1)) as f32)
            .collect();
        rank = ranked(&mixed);
    }
    let steps = how.steps.max(1) as f64;
    (0..n)
        .map(|k| {
            let s = stream(k);
            let noise = Varied { base: how.bias, sigma: how.threshold_sigma }.draw(s, 2);
            let begin = 1.0 - f64::from(rank[k]) + noise;
            let length = how.fade.draw(s, 3).max(how.fade_min).max(0.0) / steps;
            [begin as f32, (begin + length) as f32]
        })
        .collect()
}

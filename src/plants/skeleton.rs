//! Trunk and branches as chains of quadrilateral rings (corot paper, IV.3). This pass takes all the random numbers:
//! meshes of every level of detail are cut from the same rings (cage.rs), and so share one silhouette.
//!
//! A trunk starts as a cube whose top is extruded until it is long enough or has taken its steps. A side face within
//! the right heights grows a branch with some probability: a small first extrusion, made planar and square (square.rs),
//! then extrusions like the trunk's. Each number of a step is a base value and a normal variation cut off at three
//! deviations.
//!
//! Ours: `bend` and `roughness` are the thesis' "general randomness"; `angle`, `tropism`, `profile` and further levels
//! of branches are additions, neutral by default. A turn of one step is held below what would fold the ring through the
//! one before, and the area of a section never grows outwards.
//!
//! Every draw is a pure function of (seed, address of the stem, step): nothing depends on the order of growth, and a
//! stem keeps its shape whatever other stems do. Lengths are in the tree's unit, angles in radians.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_3, TAU};

use glam::DVec3;

use super::square::Square;
use crate::error::{Error, Result, in_range};
use crate::math::random::Stream;

/// A base value and the deviation of its normal variation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Varied {
    /// Base value.
    pub base: f64,
    /// Deviation.
    pub sigma: f64,
}

impl Varied {
    /// The value of one draw.
    pub fn draw(self, stream: Stream, index: u64) -> f64 {
        if self.sigma == 0.0 { self.base } else { self.base + self.sigma * stream.normal3(index) }
    }
}

/// How a stem goes on, step by step.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Most extrusions.
    pub steps: usize,
    /// Length along the axis at which it ends \[unit\].
    pub max_length: Varied,
    /// Length of an extrusion \[unit\].
    pub length: Varied,
    /// Turn of the ring about the axis \[rad\].
    pub twist: Varied,
    /// Factor of the ring's width \[1\].
    pub taper: Varied,
    /// Deviation of the tilt about a random axis in the ring's plane \[rad\].
    pub bend: f64,
    /// Deviation of a corner's place as a fraction of the ring's width \[1\].
    pub roughness: f64,
    /// Turn towards the zenith, if negative to the ground, of a step \[rad\].
    pub tropism: f64,
}

/// A trunk.
#[derive(Debug, Clone, PartialEq)]
pub struct Trunk {
    /// Edge of the first cube \[unit\].
    pub width: Varied,
    /// Height at which it ends \[unit\].
    pub max_height: f64,
    /// Its steps.
    pub growth: Growth,
}

/// One level of branches.
#[derive(Debug, Clone, PartialEq)]
pub struct Branches {
    /// Lowest and highest place of a face that may branch: height of its centroid for branches of the trunk, distance
    /// along the parent for finer ones \[unit\].
    pub range: [f64; 2],
    /// Probability that such a face branches \[1\].
    pub probability: f64,
    /// Height of the first extrusion \[unit\].
    pub joint: Varied,
    /// Width of the first ring as a fraction of the face's \[1\].
    pub joint_taper: Varied,
    /// Angle to the parent's direction that the branch takes within three steps \[rad\].
    pub angle: f64,
    /// Factors of `max_length` at the lowest, middle and highest place, between them a parabola \[1\].
    pub profile: [f64; 3],
    /// Its steps.
    pub growth: Growth,
}

/// A cross-section of a stem.
#[derive(Debug, Clone, Copy)]
pub struct Ring {
    /// Counter-clockwise about the axis.
    pub corners: [DVec3; 4],
    /// Middle of the section.
    pub center: DVec3,
    /// Unit direction of growth.
    pub axis: DVec3,
    /// Distance from the beginning of the stem along its axis.
    pub along: f64,
}

/// Numbers of one extrusion as drawn: length, twist, taper, bend.
pub type Step = [f64; 4];

/// A trunk or a branch.
#[derive(Debug, Clone)]
pub struct Stem {
    /// 0 for the trunk.
    pub level: usize,
    /// Stem it grows from, ring below the face, side of the face.
    pub parent: Option<[usize; 3]>,
    /// First ring in [`Skeleton::rings`] and their number. The face a branch grows from is no ring of its own.
    pub rings: [usize; 2],
    /// What its draws are keyed by.
    pub address: u64,
}

/// A grown tree.
#[derive(Debug, Clone, Default)]
pub struct Skeleton {
    /// Trunk first, then branches level by level in the order of their parents' faces.
    pub stems: Vec<Stem>,
    /// Rings of all stems, in order.
    pub rings: Vec<Ring>,
    /// Numbers drawn for each ring; those of no extrusion (the cube, the joint) are zero.
    pub steps: Vec<Step>,
}

/// More rings than any sensible tree has.
pub const MAX_RINGS: usize = 4_000_000;
/// Largest turn of one step \[rad\].
const MAX_TURN: f64 = FRAC_PI_3;
/// Fraction of its first width at which a stem ends: corners of thinner ones would meet by rounding.
const THINNEST: f64 = 1e-6;
/// Steps that take a branch to its angle.
const TURNS: f64 = 3.0;
/// Draws of one step.
const SLOTS: u64 = 32;

const PURPOSE_TRUNK: u64 = 0x7472_756e;
const PURPOSE_BRANCH: u64 = 0x6272_616e;
const PURPOSE_ADDRESS: u64 = 0x6164_6472;

impl Growth {
    fn validate(&self) -> Result<()> {
        in_range("steps", self.steps as f64, 0.0, 1e6, "1")?;
        in_range("length", self.length.base, 1e-9, 1e9, "unit")?;
        in_range("max_length", self.max_length.base, 0.0, 1e12, "unit")
    }
}

/// `v` turned about the unit `axis`.
fn turned(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

/// Some unit vector at a right angle to a unit one.
fn across(v: DVec3) -> DVec3 {
    let other = if v.x.abs() < 0.6 { DVec3::X } else { DVec3::Y };
    v.cross(other).normalize()
}

/// Twice the area of a section.
fn section(corners: &[DVec3; 4]) -> f64 {
    (corners[2] - corners[0]).cross(corners[3] - corners[1]).length()
}

/// The tip of a growing stem.
struct Tip {
    ring: Ring,
    /// Unit arm of corner 0, at a right angle to the axis.
    arm: DVec3,
    width: f64,
    taken: usize,
}

impl Skeleton {
    /// Grow a tree from seeds of its trunk and of its branches.
    pub fn grow(trunk: &Trunk, branches: &[Branches], [trunk_key, branch_key]: [u64; 2]) -> Result<Self> {
        trunk.growth.validate()?;
        in_range("width", trunk.width.base, 1e-9, 1e9, "unit")?;
        for level in branches {
            level.growth.validate()?;
            in_range("probability", level.probability, 0.0, 1.0, "1")?;
        }
        let mut tree = Self::default();
        tree.trunk(trunk, trunk_key)?;
        let mut parents = 0..1;
        for (index, level) in branches.iter().enumerate() {
            let first = tree.stems.len();
            for parent in parents {
                tree.branch(parent, level, index + 1, branch_key)?;
            }
            parents = first..tree.stems.len();
        }
        Ok(tree)
    }

    /// A tree from lines of others: of each stem its level, the points of its axis and its widths there \[unit\]. Stems
    /// are closed surfaces of their own. Sections are carried along without twist.
    pub fn from_lines(lines: &[(usize, Vec<DVec3>, Vec<f64>)]) -> Result<Self> {
        let wrong =
            |index: usize, what: &str| Err(Error::Data { name: "stems", reason: format!("stem {index} {what}") });
        let mut tree = Self::default();
        for (index, (level, points, widths)) in lines.iter().enumerate() {
            let n = points.len();
            if n < 2 || widths.len() != n {
                return wrong(index, "must have at least two points, and a width for each");
            }
            if points.iter().any(|p| !p.is_finite()) || widths.iter().any(|w| !(*w > 0.0 && w.is_finite())) {
                return wrong(index, "must have finite points and finite widths above 0");
            }
            if points.windows(2).any(|p| p[0] == p[1]) {
                return wrong(index, "repeats a point");
            }
            let first = tree.rings.len();
            let mut axis = (points[1] - points[0]).normalize();
            let mut arm = across(axis);
            let mut along = 0.0;
            for k in 0..n {
                if k > 0 {
                    let back = points[k] - points[k - 1];
                    along += back.length();
                    let ahead = points.get(k + 1).map_or(DVec3::ZERO, |p| (*p - points[k]).normalize());
                    axis = (back.normalize() + ahead).try_normalize().unwrap_or(axis);
                    arm = (arm - axis * axis.dot(arm)).try_normalize().unwrap_or_else(|| across(axis));
                }
                let half = FRAC_1_SQRT_2 * widths[k];
                let (u, v) = (arm * half, axis.cross(arm) * half);
                let corners = [u, v, -u, -v].map(|a| points[k] + a);
                tree.push(Ring { corners, center: points[k], axis, along }, [0.0; 4])?;
            }
            let address = Stream::new(index as u64, PURPOSE_ADDRESS).bits(0);
            tree.stems.push(Stem { level: *level, parent: None, rings: [first, n], address });
        }
        Ok(tree)
    }

    /// Rings of a stem.
    pub fn of(&self, stem: usize) -> &[Ring] {
        let [first, count] = self.stems[stem].rings;
        &self.rings[first..first + count]
    }

    /// The face that a branch grows from, counter-clockwise seen from outside.
    pub fn face(&self, stem: usize, ring: usize, side: usize) -> [DVec3; 4] {
        let rings = self.of(stem);
        let (a, b) = (&rings[ring].corners, &rings[ring + 1].corners);
        let next = (side + 1) % 4;
        [a[side], a[next], b[next], b[side]]
    }

    fn push(&mut self, ring: Ring, step: Step) -> Result<()> {
        if self.rings.len() >= MAX_RINGS {
            return Err(Error::Data {
                name: "params",
                reason: format!("the tree would have more than {MAX_RINGS} rings: fewer steps, levels or branches"),
            });
        }
        self.rings.push(ring);
        self.steps.push(step);
        Ok(())
    }

    fn trunk(&mut self, trunk: &Trunk, key: u64) -> Result<()> {
        let stream = Stream::new(key, PURPOSE_TRUNK);
        // Slots of step 0 belong to the cube.
        let width = trunk.width.draw(stream, 0).max(0.05 * trunk.width.base);
        let max_length = trunk.growth.max_length.draw(stream, 1);
        let arm = DVec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
        let mut tip = Tip {
            ring: Ring { corners: [DVec3::ZERO; 4], center: DVec3::ZERO, axis: DVec3::Z, along: 0.0 },
            arm,
            width,
            taken: 0,
        };
        for along in [0.0, width] {
            let center = DVec3::Z * along;
            let half = 0.5 * width;
            let corners = [(half, half), (-half, half), (-half, -half), (half, -half)];
            tip.ring =
                Ring { corners: corners.map(|(x, y)| center + DVec3::new(x, y, 0.0)), center, axis: DVec3::Z, along };
            self.push(tip.ring, [0.0; 4])?;
        }
        self.extrude(&mut tip, &trunk.growth, stream, max_length, trunk.max_height, None)?;
        self.stems.push(Stem { level: 0, parent: None, rings: [0, self.rings.len()], address: 0 });
        Ok(())
    }

    fn branch(&mut self, parent: usize, kind: &Branches, level: usize, key: u64) -> Result<()> {
        let [first, count] = self.stems[parent].rings;
        let above = self.stems[parent].address;
        let [low, high] = kind.range;
        for ring in 0..count.saturating_sub(1) {
            for side in 0..4 {
                let address = Stream::new(above, PURPOSE_ADDRESS).bits((4 * ring + side) as u64);
                let stream = Stream::new(key, PURPOSE_BRANCH ^ address);
                let quad = self.face(parent, ring, side);
                let (a, b) = (&self.rings[first + ring], &self.rings[first + ring + 1]);
                let middle = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
                let at = if level == 1 { middle.z } else { 0.5 * (a.along + b.along) };
                if !(at >= low && at <= high && stream.uniform(0) < kind.probability) {
                    continue;
                }
                // The direction of the parent, and outwards.
                let forward = (a.axis + b.axis).normalize_or(a.axis);
                let Some(face) = Square::nearest(quad) else { continue };
                // Where in the range, in [0, 1]; an open range is that of the parent.
                let top = high.min(if level == 1 {
                    self.of(parent).iter().fold(0.0_f64, |m, r| m.max(r.center.z))
                } else {
                    self.rings[first + count - 1].along
                });
                let base = low.max(0.0);
                let place = if top > base { ((at - base) / (top - base)).clamp(0.0, 1.0) } else { 0.0 };
                let [p0, p1, p2] = kind.profile;
                let factor = p0 * (1.0 - place) * (1.0 - 2.0 * place)
                    + p1 * 4.0 * place * (1.0 - place)
                    + p2 * place * (2.0 * place - 1.0);
                let max_length = kind.growth.max_length.draw(stream, 1) * factor.max(0.0);
                if max_length <= 0.0 {
                    continue;
                }
                let floor = 1e-3 * kind.joint.base.max(1e-6);
                let joint = kind.joint.draw(stream, 2).max(floor).min(max_length);
                // The square of a long face can have more area than the face: the section may not grow.
                let limit = (0.5 * section(&quad)).sqrt() / (std::f64::consts::SQRT_2 * face.arm.length());
                let taper = kind.joint_taper.draw(stream, 3).clamp(0.01, 1.0) * limit.min(1.0);
                let square = Square { center: face.center + face.normal * joint, arm: face.arm * taper, ..face };
                let start = self.rings.len();
                let first_ring =
                    Ring { corners: square.corners(), center: square.center, axis: square.normal, along: joint };
                self.push(first_ring, [0.0; 4])?;
                let mut tip = Tip {
                    ring: first_ring,
                    arm: square.arm.normalize(),
                    width: square.arm.length() * std::f64::consts::SQRT_2,
                    taken: 1,
                };
                // Towards the angle with the parent, in the plane of the parent's and the branch's directions.
                let hinge = square.normal.cross(forward);
                let now = hinge.length().atan2(square.normal.dot(forward));
                let turn = (hinge.length() > 1e-6).then(|| (hinge.normalize(), now - kind.angle));
                self.extrude(&mut tip, &kind.growth, stream, max_length, f64::INFINITY, turn)?;
                self.stems.push(Stem {
                    level,
                    parent: Some([parent, ring, side]),
                    rings: [start, self.rings.len() - start],
                    address,
                });
            }
        }
        Ok(())
    }

    /// Extrude a tip until it is long or high enough or has taken its steps. `turn`: axis and angle of a turn that the
    /// first steps share.
    fn extrude(
        &mut self,
        tip: &mut Tip,
        growth: &Growth,
        stream: Stream,
        max_length: f64,
        max_height: f64,
        turn: Option<(DVec3, f64)>,
    ) -> Result<()> {
        let mut left = turn.map_or(0.0, |(_, angle)| angle);
        let thinnest = THINNEST * tip.width;
        for _ in 0..growth.steps {
            let rest = max_length - tip.ring.along;
            // What is left after a last step would be a sliver.
            if rest < 0.02 * growth.length.base || tip.ring.center.z >= max_height || tip.width < thinnest {
                break;
            }
            tip.taken += 1;
            let index = SLOTS * tip.taken as u64;
            let step = [
                growth.length.draw(stream, index),
                growth.twist.draw(stream, index + 1),
                growth.taper.draw(stream, index + 2),
                growth.bend * stream.normal3(index + 3),
            ];
            let length = step[0].max(0.05 * growth.length.base).min(rest);
            let taper = step[2].clamp(0.01, 1.0);
            let twist = step[1].clamp(-MAX_TURN, MAX_TURN);
            let old = tip.ring;
            let side = old.axis.cross(tip.arm);
            let (sin, cos) = (TAU * stream.uniform(index + 4)).sin_cos();
            let mut axis = turned(old.axis, tip.arm * cos + side * sin, step[3]);
            if let Some((hinge, whole)) = turn {
                let part = whole / TURNS;
                let part = if part.abs() < left.abs() { part } else { left };
                left -= part;
                axis = turned(axis, hinge, part);
            }
            if growth.tropism != 0.0 {
                let hinge = axis.cross(DVec3::Z);
                let to_zenith = hinge.length().atan2(axis.z);
                let most = if growth.tropism > 0.0 { to_zenith } else { std::f64::consts::PI - to_zenith };
                if hinge.length() > 1e-9 {
                    axis = turned(axis, hinge.normalize(), growth.tropism.signum() * growth.tropism.abs().min(most));
                }
            }
            // Rings must lie on their own sides of each other: sin(turn / 2) < length / (2 radius).
            let radius = old.corners.iter().fold(FRAC_1_SQRT_2 * tip.width, |m, &c| m.max((c - old.center).length()));
            let most = MAX_TURN.min(2.0 * (0.4 * length / radius).min(1.0).asin());
            let hinge = old.axis.cross(axis);
            let bent = hinge.length().atan2(old.axis.dot(axis));
            let bent = bent.min(most);
            let hinge = hinge.try_normalize();
            let go = |v: DVec3, angle: f64| hinge.map_or(v, |h| turned(v, h, angle));
            axis = go(old.axis, bent).normalize();
            let center = old.center + go(old.axis, 0.5 * bent).normalize() * length;
            let arm = turned(go(tip.arm, bent), axis, twist);
            // Rounding must not tilt the arm over many steps.
            tip.arm = (arm - axis * axis.dot(arm)).try_normalize().unwrap_or_else(|| across(axis));
            tip.width *= taper;
            let side = axis.cross(tip.arm);
            let half = FRAC_1_SQRT_2 * tip.width;
            let mut arms = [tip.arm * half, side * half, -tip.arm * half, -side * half];
            if growth.roughness > 0.0 {
                // Along the axis a corner keeps well within the step.
                let reach = growth.roughness * tip.width;
                let along = growth.roughness * tip.width.min(0.5 * length);
                for (k, a) in arms.iter_mut().enumerate() {
                    let slot = index + 5 + 3 * k as u64;
                    *a += tip.arm * (reach * stream.normal3(slot))
                        + side * (reach * stream.normal3(slot + 1))
                        + axis * (along * stream.normal3(slot + 2));
                }
                let (now, before) = (section(&arms), section(&old.corners));
                if now > before {
                    let shrink = (before / now).sqrt();
                    arms = arms.map(|a| a * shrink);
                }
            }
            tip.ring = Ring { corners: arms.map(|a| center + a), center, axis, along: old.along + length };
            self.push(tip.ring, step)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sure(base: f64) -> Varied {
        Varied { base, sigma: 0.0 }
    }

    fn plain(steps: usize) -> Growth {
        Growth {
            steps,
            max_length: sure(1e9),
            length: sure(1.0),
            twist: sure(0.0),
            taper: sure(1.0),
            bend: 0.0,
            roughness: 0.0,
            tropism: 0.0,
        }
    }

    #[test]
    fn a_plain_trunk_is_a_square_prism() {
        let trunk = Trunk { width: sure(2.0), max_height: 1e9, growth: plain(5) };
        let tree = Skeleton::grow(&trunk, &[], [1, 2]).expect("grows");
        assert_eq!(tree.rings.len(), 7, "the cube's two rings and five more");
        for (i, ring) in tree.rings.iter().enumerate() {
            let z = if i == 0 { 0.0 } else { 1.0 + i as f64 };
            let (sin, cos) = std::f64::consts::FRAC_PI_4.sin_cos();
            let first = DVec3::new(cos, sin, 0.0) * std::f64::consts::SQRT_2 + DVec3::Z * z;
            assert!((ring.corners[0] - first).length() < 1e-12, "ring {i}: {}", ring.corners[0]);
        }
    }

    #[test]
    fn no_turn_folds_a_ring_through_the_one_before() {
        let growth = Growth {
            length: Varied { base: 0.3, sigma: 0.3 },
            twist: Varied { base: 0.0, sigma: 2.0 },
            taper: Varied { base: 0.95, sigma: 0.5 },
            bend: 2.0,
            ..plain(200)
        };
        let trunk = Trunk { width: sure(1.0), max_height: 1e9, growth };
        for key in 0..50 {
            let tree = Skeleton::grow(&trunk, &[], [key, 0]).expect("grows");
            for pair in tree.rings.windows(2) {
                let (a, b) = (&pair[0], &pair[1]);
                assert!(b.corners.iter().all(|&c| (c - a.center).dot(a.axis) > 0.0), "the new ring is ahead");
                assert!(a.corners.iter().all(|&c| (c - b.center).dot(b.axis) < 0.0), "the old ring is behind");
                // Corners 60 units away are rounded to 1e-14.
                let [now, before] = [b, a].map(|r| section(&r.corners).sqrt());
                assert!(now <= before + 1e-13, "and no smaller: {now} after {before}");
            }
        }
    }
}

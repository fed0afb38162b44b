//! Modulation of a sky by noise and shapes, the aesthetic principles of AOAS: what may change in a sky that is still
//! read as one (floor 3).
//!
//! A fragment is where a view ray meets the skydome, in units of the dome's radius and from its centre (`P_f` of eq 1).
//! - Ambiguity (eqs 5-6) moves it by a random vector of its cell. The paper draws one for each fragment and frame, which
//!   flickers; here a cell of the dome keeps its vector, so a still sky is still and a moving camera finds it again.
//! - Cloud complexity (eqs 7-8) scales the saturation (HSV, value kept) by improved Perlin noise at the fragment.
//!   The paper's noise in `[-1, 1]` would turn hues over; it is mapped to `[0, 1]` by `(1 + n) / 2`.
//! - Cloud shapes fade saturation out linearly with the distance on the dome to points or splines.
//!
//! Scaling the saturation with hue and value kept is linear: `c -> v - k (v - c)` with `v` the largest channel, so no
//! conversion to HSV is made (`test_aoas.py` holds it against `pa.color`). All in `f32`, the same bits at every SIMD
//! level.

use glam::DVec3;

use super::model::BLOCK;
use crate::error::Result;
use crate::job::Job;
use crate::math::elementary::Real;
use crate::math::noise::{LATTICE, bits, mix32, perlin32};
use crate::math::random::Stream;
use crate::math::spline::catmull_rom;

/// Lines between two points of a spline.
const PIECES: usize = 12;

/// Clouds around points or along lines of the dome.
#[derive(Debug, Clone)]
pub struct Shape {
    /// Ends of its lines on the unit dome; a point is a line of no length.
    lines: Vec<[[f32; 3]; 2]>,
    /// Distance on the dome, in its radii, at which the cloud ends.
    radius: f32,
}

impl Shape {
    /// Around points.
    pub fn points(points: &[DVec3], radius: f64) -> Self {
        let lines = points.iter().map(|p| [p.normalize().as_vec3().to_array(); 2]).collect();
        Self { lines, radius: radius as f32 }
    }

    /// Along a spline through points.
    pub fn spline(points: &[DVec3], closed: bool, radius: f64) -> Self {
        let points: Vec<DVec3> = points.iter().map(|p| p.normalize()).collect();
        let on_dome: Vec<[f32; 3]> = catmull_rom(&points, closed, PIECES)
            .into_iter()
            // Between opposite points the curve may pass through the centre, which is no place on the dome.
            .filter_map(|p| p.try_normalize().map(|p| p.as_vec3().to_array()))
            .collect();
        let lines = match on_dome.as_slice() {
            [one] => vec![[*one; 2]],
            many => many.windows(2).map(|w| [w[0], w[1]]).collect(),
        };
        Self { lines, radius: radius as f32 }
    }

    /// Chord of the arc at which the cloud ends.
    fn reach(&self) -> f32 {
        2.0 * (0.5 * self.radius.min(std::f32::consts::PI)).sin()
    }
}

/// [`fragment`] of directions, `x, y, z` in turn.
pub fn fragments(job: &Job, viewer: DVec3, directions: &[f64], out: &mut [f64]) -> Result<()> {
    const CHUNK: usize = 3 << 14;
    job.chunks(out, CHUNK, |chunk, out| {
        for (to, from) in out.chunks_exact_mut(3).zip(directions[chunk * CHUNK..].chunks_exact(3)) {
            to.copy_from_slice(&fragment(viewer, DVec3::from_slice(from)).to_array());
        }
        Ok(())
    })
}

/// The fragment that one ray meets: the far point of the unit dome.
pub fn fragment(viewer: DVec3, to: DVec3) -> DVec3 {
    let along = viewer.dot(to);
    let square = along * along + 1.0 - viewer.length_squared();
    viewer + to * (square.max(0.0).sqrt() - along)
}

/// All principles of one sky.
#[derive(Debug, Clone, Default)]
pub struct Modulation {
    /// Viewer, in dome radii from the centre.
    pub viewer: [f32; 3],
    /// Size of the neighbourhood `l_pt`, in dome radii.
    pub ambiguity: f32,
    /// Size of a cell that moves as one, in dome radii.
    pub grain: f32,
    /// Noise cells on a dome radius, the paper's `S_noise`.
    pub complexity: f32,
    /// Clouds of given shape.
    pub shapes: Vec<Shape>,
    keys: [u32; 2],
}

impl Modulation {
    /// No principles yet, and the key of the random choices that some will make.
    pub fn new(key: u64) -> Self {
        let stream = Stream::new(key, 0x5B1E);
        Self { keys: std::array::from_fn(|i| (stream.bits(i as u64) >> 32) as u32), ..Default::default() }
    }

    /// Whether directions change.
    pub fn moves(&self) -> bool {
        self.ambiguity > 0.0
    }

    /// Whether colours change.
    pub fn tints(&self) -> bool {
        self.complexity > 0.0 || !self.shapes.is_empty()
    }

    /// Points of the dome that the directions of a block meet: the far one where there are two. A ray that passes the
    /// dome by gets its nearest approach.
    #[inline(always)]
    pub fn fragments(&self, to: &[[f32; BLOCK]; 3], out: &mut [[f32; BLOCK]; 3]) {
        let v = self.viewer;
        let gap = 1.0 - (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for i in 0..BLOCK {
            let along = v[0] * to[0][i] + v[1] * to[1][i] + v[2] * to[2][i];
            let square = along * along + gap;
            let t = (if square > 0.0 { square } else { 0.0 }).sqrt() - along;
            for k in 0..3 {
                out[k][i] = v[k] + t * to[k][i];
            }
        }
    }

    /// Directions to the moved fragments (eqs 5-6).
    #[inline(always)]
    pub fn disturb(&self, fragments: &[[f32; BLOCK]; 3], to: &mut [[f32; BLOCK]; 3]) {
        let (v, scale, size) = (self.viewer, 1.0 / self.grain, self.ambiguity);
        for i in 0..BLOCK {
            let mut h = self.keys[0];
            for k in 0..3 {
                h ^= bits(Real::floor(fragments[k][i] * scale)).wrapping_mul(LATTICE[k]);
            }
            let mut d = [0.0_f32; 3];
            let mut square = 0.0;
            for k in 0..3 {
                // Three draws of one cell.
                h = mix32(h.wrapping_add(0x9E37_79B9));
                let uniform = f32::from_bits((h >> 9) | 0x3F80_0000) - 1.5;
                d[k] = fragments[k][i] + size * uniform - v[k];
                square += d[k] * d[k];
            }
            // A fragment that was moved onto the viewer has no direction.
            let known = square > 1e-12;
            let s = 1.0 / (if known { square } else { 1.0 }).sqrt();
            for k in 0..3 {
                to[k][i] = if known { d[k] * s } else { to[k][i] };
            }
        }
    }

    /// Factors of the saturation.
    #[inline(always)]
    pub fn saturation(&self, fragments: &[[f32; BLOCK]; 3]) -> [f32; BLOCK] {
        let mut factor = [1.0_f32; BLOCK];
        if self.complexity > 0.0 {
            let s = self.complexity;
            for i in 0..BLOCK {
                let p = [fragments[0][i] * s, fragments[1][i] * s, fragments[2][i] * s];
                let n = 0.5 + 0.5 * perlin32(self.keys[1], p);
                let n = if n > 1.0 { 1.0 } else { n };
                factor[i] = if n > 0.0 { n } else { 0.0 };
            }
        }
        if !self.shapes.is_empty() {
            let (centre, spread) = extent(fragments);
            for shape in &self.shapes {
                fade(shape, fragments, centre, spread, &mut factor);
            }
        }
        factor
    }

    /// Scale the saturation of a block.
    #[inline(always)]
    pub fn tint(&self, fragments: &[[f32; BLOCK]; 3], light: &mut [[f32; BLOCK]; 3]) {
        let factor = self.saturation(fragments);
        let [r, g, b] = light;
        for i in 0..BLOCK {
            let v = if r[i] > g[i] { r[i] } else { g[i] };
            let v = if v > b[i] { v } else { b[i] };
            let k = factor[i];
            r[i] = v - k * (v - r[i]);
            g[i] = v - k * (v - g[i]);
            b[i] = v - k * (v - b[i]);
        }
    }
}

/// A ball around the fragments of a block.
#[inline(always)]
fn extent(p: &[[f32; BLOCK]; 3]) -> ([f32; 3], f32) {
    let mut middle = [0.0_f32; 3];
    for k in 0..3 {
        let (mut low, mut high) = (p[k][0], p[k][0]);
        for i in 1..BLOCK {
            low = if p[k][i] < low { p[k][i] } else { low };
            high = if p[k][i] > high { p[k][i] } else { high };
        }
        middle[k] = 0.5 * (low + high);
    }
    let mut far = 0.0_f32;
    for i in 0..BLOCK {
        let d = [0, 1, 2].map(|k: usize| p[k][i] - middle[k]);
        let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        far = if square > far { square } else { far };
    }
    (middle, far.sqrt())
}

/// `asin(x)` for `x` in `[0, 1]`, absolute error 2e-7 (Abramowitz and Stegun 4.4.46).
#[inline(always)]
fn arcsine(x: f32) -> f32 {
    const C: [f32; 8] = [
        std::f32::consts::FRAC_PI_2,
        -0.214_598_8,
        0.088_978_99,
        -0.050_174_305,
        0.030_891_88,
        -0.017_088_126,
        0.006_670_09,
        -0.001_262_491_1,
    ];
    let mut p = C[7];
    for k in (0..7).rev() {
        p = p * x + C[k];
    }
    // Below this the difference of two numbers near pi / 2 has fewer digits than the series.
    let small = x * (1.0 + x * x * (1.0 / 6.0 + x * x * 0.075));
    let rest = 1.0 - x;
    let large = std::f32::consts::FRAC_PI_2 - (if rest > 0.0 { rest } else { 0.0 }).sqrt() * p;
    if x < 0.1 { small } else { large }
}

/// Lower the factors where a shape is near.
#[inline(always)]
fn fade(shape: &Shape, p: &[[f32; BLOCK]; 3], centre: [f32; 3], spread: f32, factor: &mut [f32; BLOCK]) {
    let reach = shape.reach() + spread;
    let mut nearest = [4.0_f32; BLOCK];
    let mut any = false;
    for [a, b] in &shape.lines {
        let along = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let square = along[0] * along[0] + along[1] * along[1] + along[2] * along[2];
        let inverse = if square > 0.0 { 1.0 / square } else { 0.0 };
        let distance = |q: [f32; 3]| {
            let d = [q[0] - a[0], q[1] - a[1], q[2] - a[2]];
            let t = (d[0] * along[0] + d[1] * along[1] + d[2] * along[2]) * inverse;
            let t = if t > 1.0 { 1.0 } else { t };
            let t = if t > 0.0 { t } else { 0.0 };
            let e = [d[0] - t * along[0], d[1] - t * along[1], d[2] - t * along[2]];
            e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
        };
        if distance(centre) > reach * reach {
            continue;
        }
        any = true;
        for i in 0..BLOCK {
            let d = distance([p[0][i], p[1][i], p[2][i]]);
            nearest[i] = if d < nearest[i] { d } else { nearest[i] };
        }
    }
    if any {
        let inverse = 1.0 / shape.radius;
        for i in 0..BLOCK {
            let half = 0.5 * nearest[i].sqrt();
            let arc = 2.0 * arcsine(if half < 1.0 { half } else { 1.0 });
            let m = 1.0 - arc * inverse;
            let m = if m > 0.0 { m } else { 0.0 };
            factor[i] *= 1.0 - m;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arcsine_is_within_its_bound() {
        for i in 0..=100_000_u32 {
            let x = i as f32 / 100_000.0;
            let error = (f64::from(arcsine(x)) - f64::from(x).asin()).abs();
            assert!(error < 4e-7, "{x}: {error:e}");
        }
    }

    fn block(points: &[DVec3]) -> [[f32; BLOCK]; 3] {
        let mut out = [[0.0; BLOCK]; 3];
        for i in 0..BLOCK {
            let p = points[i % points.len()].as_vec3();
            (out[0][i], out[1][i], out[2][i]) = (p.x, p.y, p.z);
        }
        out
    }

    #[test]
    fn clouds_fade_linearly_with_the_distance_on_the_dome() {
        let shape = Shape::points(&[DVec3::Z * 7.0], 0.5);
        let at = |angle: f64| DVec3::new(angle.sin(), 0.0, angle.cos());
        let p = block(&[at(0.0), at(0.1), at(0.25), at(0.5), at(1.0), at(3.0)]);
        let modulation = Modulation { shapes: vec![shape], ..Default::default() };
        let factor = modulation.saturation(&p);
        for (got, want) in factor.iter().zip([0.0, 0.2, 0.5, 1.0, 1.0, 1.0]) {
            assert!((f64::from(*got) - want).abs() < 2e-6, "{got} against {want}");
        }
    }

    #[test]
    fn a_cell_moves_as_one_and_stays_in_its_neighbourhood() {
        let modulation = Modulation { ambiguity: 0.2, grain: 0.05, ..Modulation::new(9) };
        let near = [DVec3::new(0.601, 0.001, 0.799), DVec3::new(0.602, 0.002, 0.798)];
        let p = block(&near);
        let mut to = [[0.0; BLOCK]; 3];
        modulation.disturb(&p, &mut to);
        let moved = |i: usize| DVec3::new(f64::from(to[0][i]), f64::from(to[1][i]), f64::from(to[2][i]));
        assert!((moved(0) - moved(1)).length() < 0.01, "one cell, one vector");
        assert!((moved(0) - near[0]).length() < 0.2, "within the neighbourhood");
        assert!((moved(0) - near[0]).length() > 1e-4, "but moved");
        let still = Modulation { ambiguity: 0.0, grain: 0.05, ..Modulation::new(9) };
        assert!(!still.moves(), "a neighbourhood of nothing");
    }

    #[test]
    fn fragments_lie_on_the_dome_wherever_the_viewer_is() {
        for viewer in [[0.0, 0.0, 0.0], [0.5, -0.2, 0.3], [1.0, 0.0, 0.0], [0.0, 0.0, -0.4]] {
            let modulation = Modulation { viewer, ..Default::default() };
            let to = block(&[DVec3::Z, DVec3::X, DVec3::new(-0.6, 0.0, 0.8), -DVec3::Y]);
            let mut p = [[0.0; BLOCK]; 3];
            modulation.fragments(&to, &mut p);
            for i in 0..4 {
                let length = (p[0][i] * p[0][i] + p[1][i] * p[1][i] + p[2][i] * p[2][i]).sqrt();
                assert!((length - 1.0).abs() < 1e-6, "viewer {viewer:?}, ray {i}: {length}");
                let v = DVec3::from_array(viewer.map(f64::from));
                let one = fragment(v, DVec3::new(f64::from(to[0][i]), f64::from(to[1][i]), f64::from(to[2][i])));
                assert!((one.x - f64::from(p[0][i])).abs() < 1e-6, "one by one");
            }
        }
    }
}

//! Stratified sampling of strokes on a surface: particles in strata (corot paper, IV.7, Fig. 24).
//!
//! The unit square of a surface is cut into `spans[0] x spans[1]` cells of exactly `count` particles each. On a NURBS
//! surface and a heightfield the square is that of the parameters; a mesh has none, so its area, in the order of its
//! faces, is cut into as many equal pieces. A particle is moved along the normal by up to `displacement` either way;
//! its height is 0 lowest and 1 highest. Higher than `fade_from` it is detail: it begins to fade at a random distance
//! and is gone a random length later, before 1. Draws are keyed by (seed, index).

use std::f64::consts::TAU;

use glam::DVec3;

use super::leaves::NEVER;
use super::surface::{Surface, SurfacePoint};
use crate::error::{Error, Result, in_range};
use crate::math::random::Stream;

/// How strokes are strewn.
#[derive(Debug, Clone, PartialEq)]
pub struct Strata {
    /// Cells along u and v.
    pub spans: [usize; 2],
    /// Particles of a cell.
    pub count: usize,
    /// Height above which a particle is detail \[1\].
    pub fade_from: f64,
    /// Longest and shortest fade \[1\].
    pub fade: [f64; 2],
    /// Width and height \[m\].
    pub size: [f64; 2],
    /// Deviation of the size as a fraction of it \[1\].
    pub variance: f64,
    /// Growth of the deepest over the highest, as a fraction \[1\].
    pub inside_growth: f64,
}

/// What is drawn for each particle.
#[derive(Debug, Clone, Default)]
pub struct ScatteredStrokes {
    /// Place in the unit square.
    pub uv: Vec<[f64; 2]>,
    /// Height in `[0, 1)`.
    pub height: Vec<f64>,
    /// A random unit vector (Peterson and Lee 2006).
    pub random: Vec<[f64; 3]>,
    /// Width and height \[m\].
    pub size: Vec<[f32; 2]>,
    /// Distances at which it begins to fade and is gone.
    pub fade: Vec<[f32; 2]>,
    /// Random 32 bits of its own.
    pub label: Vec<u32>,
}

/// More particles than any sensible surface has.
pub const MAX_PARTICLES: usize = 1 << 26;
const PURPOSE_STRATA: u64 = 0x7374_7261;
const SLOTS: u64 = 16;

/// Draw places and looks.
pub fn scatter(how: &Strata, key: u64) -> Result<ScatteredStrokes> {
    let [nu, nv] = how.spans;
    in_range("fade_from", how.fade_from, 0.0, 1.0, "1")?;
    let total = nu.checked_mul(nv).and_then(|c| c.checked_mul(how.count)).filter(|&n| n <= MAX_PARTICLES);
    let Some(total) = total else {
        return Err(Error::Data { name: "spans", reason: format!("more than {MAX_PARTICLES} particles") });
    };
    let stream = Stream::new(key, PURPOSE_STRATA);
    let mut out = ScatteredStrokes::default();
    for index in 0..total {
        let at = |slot: u64| stream.uniform(SLOTS * index as u64 + slot);
        let cell = index / how.count;
        let (i, j) = (cell / nv, cell % nv);
        // Rounding must not carry a place into the next cell.
        let inside =
            |i: usize, n: usize, r: f64| ((i as f64 + r) / n as f64).min(((i + 1) as f64 / n as f64).next_down());
        out.uv.push([inside(i, nu, at(0)), inside(j, nv, at(1))]);
        let height = at(2);
        out.height.push(height);
        let z = 2.0 * at(3) - 1.0;
        let (sin, cos) = (TAU * at(4)).sin_cos();
        let flat = (1.0 - z * z).max(0.0).sqrt();
        out.random.push([flat * cos, flat * sin, z]);
        let varied = (1.0 + how.variance * stream.normal3(SLOTS * index as u64 + 5)).max(0.05);
        let grown = (1.0 + how.inside_growth * (1.0 - height)) * varied;
        out.size.push(how.size.map(|s| (s * grown) as f32));
        let [longest, shortest] = how.fade;
        let length = (shortest + (longest - shortest).max(0.0) * at(6)).min(1.0);
        let begin = at(7) * (1.0 - length);
        out.fade.push(if height > how.fade_from { [begin as f32, (begin + length) as f32] } else { NEVER });
        out.label.push((stream.bits(SLOTS * index as u64 + 8) >> 32) as u32);
    }
    Ok(out)
}

/// Places on the triangles of a grid of `rows` x `columns` vertices, two for each cell split from the low to the high
/// corner: `u` runs along the columns, `v` along the rows.
pub fn on_grid(uv: &[[f64; 2]], rows: usize, columns: usize) -> Vec<SurfacePoint> {
    let within = |x: f64, n: usize| {
        let x = x.clamp(0.0, 1.0) * n as f64;
        let cell = (x as usize).min(n - 1);
        (cell, x - cell as f64)
    };
    uv.iter()
        .map(|&[u, v]| {
            let ((i, x), (j, y)) = (within(u, columns - 1), within(v, rows - 1));
            let cell = 2 * (j * (columns - 1) + i) as u32;
            if x >= y {
                SurfacePoint { face: cell, barycentric: [1.0 - x, x - y, y] }
            } else {
                SurfacePoint { face: cell + 1, barycentric: [1.0 - y, x, y - x] }
            }
        })
        .collect()
}

/// Triangles of such a grid.
pub fn grid_faces(rows: usize, columns: usize) -> Vec<[u32; 3]> {
    let mut faces = Vec::with_capacity(2 * rows.saturating_sub(1) * columns.saturating_sub(1));
    for j in 1..rows {
        for i in 1..columns {
            let [a, b] = [(j - 1) * columns + i - 1, (j - 1) * columns + i];
            let [c, d] = [j * columns + i - 1, j * columns + i];
            faces.push([a as u32, b as u32, d as u32]);
            faces.push([a as u32, d as u32, c as u32]);
        }
    }
    faces
}

/// Places on a mesh: the unit square's cells, in order, are equal pieces of its area in the order of its faces.
pub fn by_area(uv: &[[f64; 2]], [nu, nv]: [usize; 2], surface: &Surface) -> Result<Vec<SurfacePoint>> {
    let sums = surface.sums();
    let whole = sums[sums.len() - 1];
    if !(whole > 0.0 && whole.is_finite()) {
        return Err(Error::Data { name: "surface", reason: format!("its area must be above 0, is {whole} [m²]") });
    }
    let place = |&[u, v]: &[f64; 2]| {
        let (x, y) = (u * nu as f64, v * nv as f64);
        let (i, j) = ((x as usize).min(nu - 1), (y as usize).min(nv - 1));
        let at = whole * ((i * nv + j) as f64 + (x - i as f64).clamp(0.0, 1.0)) / (nu * nv) as f64;
        // The last face that begins at or below; never one without area.
        let face = sums.partition_point(|&s| s <= at).saturating_sub(1).min(sums.len() - 2);
        let area = sums[face + 1] - sums[face];
        let r = if area > 0.0 { ((at - sums[face]) / area).clamp(0.0, 1.0).sqrt() } else { 0.0 };
        let t = (y - j as f64).clamp(0.0, 1.0);
        SurfacePoint { face: face as u32, barycentric: [1.0 - r, r * (1.0 - t), r * t] }
    };
    Ok(uv.iter().map(place).collect())
}

/// Unit normals between those of a surface and random ones, with the fraction `w` of the random (corot paper, IV.7).
/// Where both cancel, the surface's.
pub fn blend(normals: &[[f64; 3]], random: &[[f64; 3]], w: f64) -> Vec<[f64; 3]> {
    let mix = |(&n, &r): (&[f64; 3], &[f64; 3])| {
        let (n, r) = (DVec3::from(n), DVec3::from(r));
        if w == 0.0 {
            return n.to_array();
        }
        let sum = n * (1.0 - w) + r * w;
        if sum.length() > 1e-12 { sum.normalize().to_array() } else { n.to_array() }
    };
    normals.iter().zip(random).map(mix).collect()
}

//! Control meshes of a skeleton, for subdivision and level of detail: one closed surface of quadrilaterals for the
//! trunk and all branches (corot paper, IV.3).
//!
//! Level 0 has every ring. Level L keeps every 2^L-th, the first and the last of each stem, and the two rings below and
//! above a face that a branch grows from, so the surface stays closed and every branch stays where it is.

use glam::DVec3;

use super::skeleton::Skeleton;

/// What a vertex belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Origin {
    /// Stem: 0 the trunk, then the branches.
    pub stem: u32,
    /// Ring of the stem: of the trunk 0 is the ground and 1 the top of the cube, of a branch 1 is the end of the joint.
    pub step: f32,
    /// Place along the stem, 0 at its beginning, 1 at its end.
    pub s: f32,
}

/// A mesh of quadrilaterals.
#[derive(Debug, Clone, Default)]
pub struct QuadMesh {
    /// Corners.
    pub vertices: Vec<DVec3>,
    /// Indices, counter-clockwise seen from outside.
    pub quads: Vec<[u32; 4]>,
    /// What each vertex belongs to; may be empty.
    pub origins: Vec<Origin>,
}

impl Skeleton {
    /// The mesh at a level of detail, times `unit`.
    pub fn mesh(&self, level: u32, unit: f64) -> QuadMesh {
        let stride = 1_usize << level.min(30);
        let mut keep = vec![level == 0; self.rings.len()];
        let mut bears = vec![0_u8; self.rings.len()];
        for stem in &self.stems {
            let [first, count] = stem.rings;
            for k in (0..count).step_by(stride) {
                keep[first + k] = true;
            }
            keep[first + count - 1] = true;
            if let Some([parent, ring, side]) = stem.parent {
                let below = self.stems[parent].rings[0] + ring;
                keep[below] = true;
                keep[below + 1] = true;
                bears[below] |= 1 << side;
            }
        }
        let mut mesh = QuadMesh::default();
        // First vertex of each ring that is kept.
        let mut place = vec![u32::MAX; self.rings.len()];
        for (index, stem) in self.stems.iter().enumerate() {
            let [first, count] = stem.rings;
            let whole = self.rings[first + count - 1].along;
            for k in (0..count).filter(|k| keep[first + k]) {
                let ring = &self.rings[first + k];
                place[first + k] = mesh.vertices.len() as u32;
                let step = k + usize::from(stem.level > 0);
                let s = if whole > 0.0 { (ring.along / whole) as f32 } else { 0.0 };
                mesh.vertices.extend(ring.corners.map(|c| c * unit));
                mesh.origins.extend([Origin { stem: index as u32, step: step as f32, s }; 4]);
            }
        }
        for stem in &self.stems {
            let [first, count] = stem.rings;
            let at = |ring: usize, corner: usize| place[ring] + (corner % 4) as u32;
            if let Some([parent, ring, side]) = stem.parent {
                let a = self.stems[parent].rings[0] + ring;
                let base = [at(a, side), at(a, side + 1), at(a + 1, side + 1), at(a + 1, side)];
                for k in 0..4 {
                    let next = (k + 1) % 4;
                    mesh.quads.push([base[k], base[next], at(first, next), at(first, k)]);
                }
            } else {
                mesh.quads.push([3, 2, 1, 0].map(|k| at(first, k)));
            }
            let mut below = first;
            for above in (first + 1..first + count).filter(|&r| keep[r]) {
                for side in (0..4).filter(|side| bears[below] >> side & 1 == 0) {
                    mesh.quads.push([at(below, side), at(below, side + 1), at(above, side + 1), at(above, side)]);
                }
                below = above;
            }
            mesh.quads.push([0, 1, 2, 3].map(|k| at(below, k)));
        }
        mesh
    }
}

impl QuadMesh {
    /// Unit normals of the vertices: the sums of their faces' areas. A vertex of no area gets the zenith.
    pub fn normals(&self) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; self.vertices.len()];
        for quad in &self.quads {
            let [a, b, c, d] = quad.map(|i| self.vertices[i as usize]);
            let area = (c - a).cross(d - b);
            for &i in quad {
                sums[i as usize] += area;
            }
        }
        sums.into_iter().map(|n| n.try_normalize().unwrap_or(DVec3::Z)).collect()
    }
}

//! What the procedural clouds have in common: a density by rows of voxels, and how it falls off at the box (floor 3).
//!
//! Units: voxels; density \[1\].

use crate::math::interpolation::smoothstep;

/// A kind fitted to its box.
pub(super) trait CloudShape: Sync {
    /// Density of the voxels of row `j` in layer `k`; `row` holds zeros.
    fn fill_row(&self, j: usize, k: usize, row: &mut [f32]);
}

/// Voxels at each end of an axis of `n` over which a cloud falls off.
pub(super) fn margin(n: usize) -> f64 {
    (n as f64 / 4.0).min(4.0)
}

/// From 1 inside to 0 on the faces of an axis of `n` voxels: no cloud ends in a wall.
pub(super) fn edge_falloff(i: usize, n: usize) -> f64 {
    smoothstep(0.0, margin(n), i.min(n - 1 - i) as f64)
}

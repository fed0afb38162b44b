//! Interpolation between the nodes of a table: Lagrange polynomials, and smoothstep (floor 0).

use super::elementary::Real;
use crate::error::{Error, Result, in_range};

/// Lagrange interpolation at `x` through the `points` of the ascending `nodes` that lie around it: the first of them,
/// and their weights.
pub fn lagrange(nodes: &[f64], x: f64, points: usize) -> (usize, Vec<f64>) {
    let points = points.min(nodes.len());
    let above = nodes.partition_point(|&n| n < x);
    let first = above.saturating_sub(points.div_ceil(2)).min(nodes.len() - points);
    let at = &nodes[first..first + points];
    let weight = |i: usize| (0..points).filter(|&j| j != i).map(|j| (x - at[j]) / (at[i] - at[j])).product::<f64>();
    (first, (0..points).map(weight).collect())
}

/// `x` between the ends of `nodes`; one that was rounded there still belongs to the table, others are refused.
pub fn within(name: &'static str, nodes: &[f64], x: f64, unit: &'static str) -> Result<f64> {
    let (Some(&low), Some(&high)) = (nodes.first(), nodes.last()) else { return Err(Error::Empty { name }) };
    let slack = 1e-9 * high.abs().max(low.abs());
    in_range(name, x, low - slack, high + slack, unit)?;
    Ok(x.clamp(low, high))
}

/// Weights of four nodes at 0, 1, 2 and 3 for a place `t` among them (Lagrange).
#[inline(always)]
pub fn lagrange4(t: f32) -> [f32; 4] {
    let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
    let (ab, cd) = (a * b, c * d);
    [-b * cd * (1.0 / 6.0), a * cd * 0.5, -ab * d * 0.5, ab * c * (1.0 / 6.0)]
}

/// The cubic Hermite step `t^2 (3 - 2 t)` of `t` in `[0, 1]` (smoothstep).
#[inline(always)]
pub fn hermite_step<T: Real>(t: T) -> T {
    t * t * (T::of(3.0) - T::of(2.0) * t)
}

/// Cubic step from 0 at `low` to 1 at `high` (smoothstep).
pub fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    hermite_step(((x - low) / (high - low)).clamp(0.0, 1.0))
}

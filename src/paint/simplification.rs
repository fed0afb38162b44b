//! Stochastic simplification: the order in which the strokes of an object vanish (D5, D6; kin: Cook et al. 2007), those
//! first without which the silhouette stays.
//!
//! The thesis' order, the outermost first, eats the outline away, and what has grown in its place stands elsewhere.
//! Here the object is looked at from several sides with the masks of its strokes, and one stroke after the other is
//! taken away: always the one whose loss changes least where at least half of the light is kept away. Among equals it
//! is the outermost, and how much that counts is a choice.
//!
//! A pixel counts by a smooth step of its optical depth about that of one half, `1/2 + u / 2 sqrt(1 + u^2)`; a hard one
//! would not see that a pixel has become poor. What a stroke costs grows as others go, so it is weighed anew when its
//! turn comes, and waits if another has become cheaper.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::level_of_detail::checked;
use super::light::DirectionalLight;
use super::mask::MaskShape;
use super::side_view::orbit_views;
use super::stroke::{Shader, Strokes};
use crate::error::{Result, in_range};
use crate::job::Job;
use crate::math::logarithm::ln;

/// Sides from which an object is looked at, an odd number as opposite ones show the same outline, and the height above
/// the level of every other one \[rad\].
const SIDES: usize = 9;
const ABOVE: f64 = 0.2;
/// Width of the step in depths of one half \[1\].
const SOFT: f32 = 0.5;

/// Indices of the strokes in the order in which they vanish. `outer` is what being the outermost takes off the cost of
/// a stroke, in means of the cost \[1\].
pub fn simplification_order(
    job: &Job,
    strokes: &Strokes<'_>,
    shader: &Shader,
    lights: &[DirectionalLight],
    mask_shape: MaskShape,
    outer: f64,
    pixels: usize,
) -> Result<Vec<u32>> {
    in_range("outer", outer, 0.0, 1e6, "1")?;
    let n = checked(strokes, pixels)?;
    if n == 0 {
        return Ok(Vec::new());
    }
    let crown = Crown::new(job, strokes, shader, lights, mask_shape, pixels)?;
    let mut depth = vec![0.0_f32; SIDES * pixels * pixels];
    for stroke in 0..n {
        for &(at, d) in crown.of(stroke) {
            depth[at as usize] += d;
        }
    }
    // A pixel that is no part of the silhouette has nothing to lose.
    let counts: Vec<f32> = depth.iter().map(|&d| if d > 0.7 * HALF { 1.0 } else { 0.0 }).collect();
    let cost = |depth: &[f32], stroke: usize| {
        let mut sum = 0.0;
        for &(at, d) in crown.of(stroke) {
            let now = depth[at as usize];
            sum += counts[at as usize] * (step(now) - step(now - d));
        }
        sum
    };
    let first: Vec<f32> = (0..n).map(|stroke| cost(&depth, stroke)).collect();
    let place = ranks(n, |stroke| strokes.centre.get(stroke));
    let mean = first.iter().sum::<f32>() / n as f32;
    let bonus = outer as f32 * mean.max(1e-6);
    // Positive, so that bits are in the order of the numbers.
    let key = |cost: f32, stroke: usize| (cost.max(0.0) + bonus * (1.0 - place[stroke])).to_bits();
    let mut heap: BinaryHeap<Reverse<(u32, u32)>> =
        (0..n).map(|stroke| Reverse((key(first[stroke], stroke), stroke as u32))).collect();
    let mut order = Vec::with_capacity(n);
    while let Some(Reverse((_, stroke))) = heap.pop() {
        let now = key(cost(&depth, stroke as usize), stroke as usize);
        if heap.peek().is_some_and(|Reverse((next, _))| now > *next) {
            heap.push(Reverse((now, stroke)));
            continue;
        }
        order.push(stroke);
        for &(at, d) in crown.of(stroke as usize) {
            depth[at as usize] -= d;
        }
        if order.len().is_multiple_of(256) {
            job.check()?;
        }
    }
    Ok(order)
}

const HALF: f32 = std::f32::consts::LN_2;

#[inline(always)]
fn step(depth: f32) -> f32 {
    let u = (depth - HALF) * (1.0 / (SOFT * HALF));
    0.5 + 0.5 * u / (1.0 + u * u).sqrt()
}

/// Ranks of values, from just above 0 to just below 1, ties by index.
fn ranks(n: usize, value: impl Fn(usize) -> f32) -> Vec<f32> {
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| value(a).total_cmp(&value(b)));
    let mut rank = vec![0.0; n];
    for (place, &i) in order.iter().enumerate() {
        rank[i] = (place as f32 + 0.5) / n as f32;
    }
    rank
}

/// For each stroke its pixels from all sides and its optical depths there.
struct Crown {
    first: Vec<usize>,
    pixels: Vec<(u32, f32)>,
}

impl Crown {
    fn new(
        job: &Job,
        strokes: &Strokes<'_>,
        shader: &Shader,
        lights: &[DirectionalLight],
        mask_shape: MaskShape,
        pixels: usize,
    ) -> Result<Self> {
        let n = strokes.count();
        let views = orbit_views(job, strokes, shader, lights, mask_shape, [SIDES, pixels], [0.75, ABOVE])?;
        let opacity = vec![shader.opacity as f32; n];
        let seen = job.map(SIDES, |side| {
            let mut list: Vec<(u32, u32, f32)> = Vec::new();
            let base = (side * pixels * pixels) as u32;
            views[side].each(&opacity, |stroke, at, alpha| {
                // Less than a fiftieth is nothing, more than nineteen twentieths all.
                if alpha > 0.02 {
                    list.push((stroke, base + at, -ln((1.0 - alpha).max(0.05))));
                }
            })?;
            Ok(list)
        })?;
        let mut first = vec![0; n + 1];
        for (stroke, ..) in seen.iter().flatten() {
            first[*stroke as usize + 1] += 1;
        }
        for k in 0..n {
            first[k + 1] += first[k];
        }
        let (mut next, mut list) = (first.clone(), vec![(0, 0.0); first[n]]);
        for &(stroke, at, depth) in seen.iter().flatten() {
            let place = &mut next[stroke as usize];
            list[*place] = (at, depth);
            *place += 1;
        }
        Ok(Self { first, pixels: list })
    }

    fn of(&self, stroke: usize) -> &[(u32, f32)] {
        &self.pixels[self.first[stroke]..self.first[stroke + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_even_and_ties_keep_their_order() {
        let values = [3.0, 1.0, 3.0, 0.0];
        assert_eq!(ranks(4, |i| values[i]), [0.625, 0.375, 0.875, 0.125]);
    }

    #[test]
    fn the_step_is_a_half_at_one_half() {
        assert_eq!(step(HALF), 0.5);
        for k in 0..100 {
            let (a, b) = (k as f32 * 0.05, (k + 1) as f32 * 0.05);
            assert!(step(a) < step(b) && step(b) < 1.0, "rises at {a}");
        }
    }
}

//! Id and depth buffer: which stroke contributes most to a pixel, and how far away: for motion, for picking, for the
//! tests.
//!
//! Depth is the mean over the weights of alpha compositing, front to back; the index is that of the largest weight.
//! Units: metres. Only on demand: it costs a second pass over the masks.

use super::cover::{AREA, Scratch, TileWindow, cover};
use super::mask::{GROUP, Lane};
use super::tile::{Plane, lane};
use super::tile_binning::Event;

/// What is seen in each pixel of a tile: through, weight, largest weight, weight times depth; index of the stroke with
/// the largest.
pub(super) struct IdDepthBuffer {
    pub(super) planes: [Plane; 4],
    pub(super) index: Vec<i32>,
}

impl IdDepthBuffer {
    pub(super) fn new() -> Self {
        let plane = || vec![0.0; AREA];
        Self { planes: [plane(), plane(), plane(), plane()], index: vec![-1; AREA] }
    }

    #[inline(always)]
    pub(super) fn look(&mut self, events: &[Event<'_>], window: &TileWindow, scratch: &mut Scratch) {
        let Self { planes: [transmittance, sum, best, depth], index } = self;
        transmittance.fill(1.0);
        for plane in [&mut *sum, best, depth] {
            plane.fill(0.0);
        }
        index.fill(-1);
        for event in events {
            let sprite = event.sprite;
            let (d, mine) = (sprite.depth as f32, sprite.index as i32);
            cover(
                sprite,
                window,
                scratch,
                #[inline(always)]
                |place: usize, alpha: &[Lane<f32>], _: &[Lane<f32>]| {
                    for (k, alpha) in alpha.iter().enumerate() {
                        let place = place + k * GROUP;
                        let (t, sum, best) = (lane(transmittance, place), lane(sum, place), lane(best, place));
                        let (depth, index) = (lane(depth, place), lane(index, place));
                        let (mut a, mut b, mut c, mut e, mut n) = (*t, *sum, *best, *depth, *index);
                        for i in 0..GROUP {
                            let w = alpha[i] * a[i];
                            a[i] -= w;
                            b[i] += w;
                            e[i] += w * d;
                            let more = w > c[i];
                            c[i] = if more { w } else { c[i] };
                            n[i] = if more { mine } else { n[i] };
                        }
                        (*t, *sum, *best, *depth, *index) = (a, b, c, e, n);
                    }
                },
            );
        }
    }
}

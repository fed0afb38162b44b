//! An object seen from one side (orbit views), as [`level_of_detail`](super::level_of_detail) and
//! [`simplification`](super::simplification) look at it.
//!
//! Where strokes are, how large and with which masks does not depend on distance or light: so a side is projected once,
//! and then painted with any opacities and growth. Transmittance knows no order, and the weights of strokes in the
//! picture no colours, so neither is composited for the sake of the other.

use glam::DVec3;

use super::cover::{AREA, STRIDE, Scratch, cover};
use super::light::DirectionalLight;
use super::mask::{GROUP, Lane, MaskShape};
use super::sprite::{PerStroke, Sprites};
use super::stroke::{LodRanges, ROW, Shader, Strokes, shade};
use super::tile::{Tile, lane};
use super::tile_binning::{Event, HEIGHT, Tiles, WIDTH};
use crate::error::Result;
use crate::job::Job;
use crate::math::geometry::Pinhole;
use crate::math::lanes;

/// Transmittance below which a pixel belongs to the silhouette \[1\].
pub(super) const EDGE: f32 = 0.5;

/// The strokes of one side.
pub(super) struct SideView {
    pixels: usize,
    centre: Vec<f32>,
    size: Vec<f32>,
    depth: Vec<f64>,
    along: Vec<f32>,
    down: Vec<f32>,
    foreshortening: Vec<f32>,
    label: Vec<u32>,
    color: Vec<f32>,
    mask_shape: MaskShape,
}

/// The object from `count` sides, evenly all around from the turn `first`, every other one from `above` \[rad\].
pub(super) fn orbit_views(
    job: &Job,
    strokes: &Strokes<'_>,
    shader: &Shader,
    lights: &[DirectionalLight],
    mask_shape: MaskShape,
    [count, pixels]: [usize; 2],
    [first, above]: [f64; 2],
) -> Result<Vec<SideView>> {
    let n = strokes.count();
    let (mut low, mut high, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0.0_f64);
    for i in 0..n {
        let p = strokes.at(i);
        (low, high) = (low.min(p), high.max(p));
        most = most.max(f64::from(strokes.size[2 * i].max(strokes.size[2 * i + 1])));
    }
    let centre = 0.5 * (low + high);
    let reach = (0..n).fold(0.0_f64, |r, i| r.max((strokes.at(i) - centre).length()));
    // Room for strokes that grow.
    let radius = (reach + 1.5 * most).max(1e-6);
    // Far enough for a nearly parallel view.
    let away = 8.0 * radius;
    let mut shader = shader.clone();
    shader.max_stroke_size = 1e6;
    shader.lod = LodRanges { lod_range: [1e300, 1.1e300], near_fade: [0.0, 0.0] };
    let strokes = Strokes { object: None, centres: &[], tints: &[], size_compensation: &[], ..*strokes };
    job.map(count, |k| {
        let turn = std::f64::consts::TAU * (k as f64 + first) / count as f64;
        let (sin, cos) = turn.sin_cos();
        let (rise, level) = (above * (k % 2) as f64).sin_cos();
        let forward = DVec3::new(level * cos, level * sin, -rise);
        let right = DVec3::new(sin, -cos, 0.0);
        let camera = Pinhole {
            position: centre - forward * away,
            right,
            up: right.cross(forward),
            forward,
            half_tan: radius / (away - radius),
            width: pixels,
            height: pixels,
        };
        let (mut rows, mut depth) = (vec![0.0; ROW * n], vec![0.0; n]);
        shade(&Job::serial(), &strokes, &shader, lights, &camera, &mut rows, &mut depth)?;
        let pick = |from: usize, many: usize| -> Vec<f32> {
            rows.chunks_exact(ROW).flat_map(|row| row[from..from + many].iter().copied()).collect()
        };
        Ok(SideView {
            pixels,
            centre: pick(9, 2),
            size: pick(11, 2),
            depth,
            along: pick(6, 1),
            down: pick(7, 1),
            foreshortening: pick(19, 1),
            label: strokes.label.to_vec(),
            color: vec![0.0; 3 * n],
            mask_shape,
        })
    })
}

impl SideView {
    /// The strokes with these opacities, `size` \[px\] each.
    fn sprites<'a>(&'a self, size: &'a [f32], opacity: &'a [f32]) -> Sprites<'a> {
        Sprites {
            centre: &self.centre,
            size,
            depth: &self.depth,
            color: &self.color,
            variation: None,
            rotation: PerStroke::One(0.0),
            opacity: PerStroke::Many(opacity),
            label: PerStroke::Many(&self.label),
            frequency_s: PerStroke::Many(&self.along),
            frequency_t: PerStroke::Many(&self.down),
            frequency_color: PerStroke::One(0.0),
            fullness: PerStroke::One(self.mask_shape.fullness),
            feather_min: PerStroke::One(self.mask_shape.feather[0]),
            feather_max: PerStroke::One(self.mask_shape.feather[1]),
            foreshortening: PerStroke::Many(&self.foreshortening),
            delta: PerStroke::One(0.0),
            id: None,
        }
    }

    /// Go through the tiles of the strokes grown by `growth`, those of a tile nearest first.
    fn tiles(
        &self,
        growth: f64,
        opacity: &[f32],
        mut work: impl FnMut(&mut Tile, &mut Scratch, &[Event<'_>]),
    ) -> Result<()> {
        let size: Vec<f32> = self.size.iter().map(|x| x * growth as f32).collect();
        let tiles = Tiles::new(&Job::serial(), &self.sprites(&size, opacity), [self.pixels; 2])?;
        let (mut tile, mut scratch, mut events) = (Tile::new(), Scratch::new(), Vec::new());
        for index in 0..tiles.rows * tiles.columns {
            let (x, y) = (index % tiles.columns * WIDTH, index / tiles.columns * HEIGHT);
            tiles.sorted(index, &mut events);
            if !events.is_empty() {
                tile.begin([x, y], [WIDTH.min(self.pixels - x), HEIGHT.min(self.pixels - y)]);
                work(&mut tile, &mut scratch, &events);
            }
        }
        Ok(())
    }

    /// Pixels of the silhouette.
    pub(super) fn area(&self, growth: f64, opacity: &[f32]) -> Result<usize> {
        let mut area = 0;
        self.tiles(growth, opacity, |tile, scratch, events| {
            lanes::run(
                #[inline(always)]
                || {
                    silhouette(events, tile, scratch);
                    area += inside(tile);
                },
            );
        })?;
        Ok(area)
    }

    /// Add to each stroke's weight in the mean colour of the silhouette.
    pub(super) fn weigh(&self, growth: f64, opacity: &[f32], weight: &mut [f64]) -> Result<()> {
        let mut within = vec![0.0; AREA];
        self.tiles(growth, opacity, |tile, scratch, events| {
            lanes::run(
                #[inline(always)]
                || {
                    let columns = tile.size()[0];
                    silhouette(events, tile, scratch);
                    within.fill(0.0);
                    for (to, t) in within.chunks_exact_mut(STRIDE).zip(tile.transmittance.chunks_exact(STRIDE)) {
                        for x in 0..columns {
                            to[x] = if t[x] < EDGE { 1.0 } else { 0.0 };
                        }
                    }
                    tile.transmittance.fill(1.0);
                    tile.open_blocks = u64::MAX;
                    for (k, event) in events.iter().enumerate() {
                        // What a ten thousandth of the light comes from has no part in the mean.
                        if k % 32 == 31 && tile.update_occlusion() {
                            break;
                        }
                        if !tile.shows(event.sprite) {
                            continue;
                        }
                        let transmittance = &mut tile.transmittance;
                        let mut sum = [0.0; GROUP];
                        cover(
                            event.sprite,
                            &tile.window,
                            scratch,
                            #[inline(always)]
                            |place: usize, alpha: &[Lane<f32>], _: &[Lane<f32>]| {
                                for (k, alpha) in alpha.iter().enumerate() {
                                    let t = lane(transmittance, place + k * GROUP);
                                    let mut rest = *t;
                                    let here = lane(&mut within, place + k * GROUP);
                                    for i in 0..GROUP {
                                        let w = alpha[i] * rest[i];
                                        sum[i] += here[i] * w;
                                        rest[i] -= w;
                                    }
                                    *t = rest;
                                }
                            },
                        );
                        weight[event.sprite.index as usize] += sum.iter().map(|&x: &f32| f64::from(x)).sum::<f64>();
                    }
                },
            );
        })
    }

    /// Tell `pixel` of every pixel of every stroke: stroke, place in the picture, opacity.
    pub(super) fn each(&self, opacity: &[f32], mut pixel: impl FnMut(u32, u32, f32)) -> Result<()> {
        self.tiles(1.0, opacity, |tile, scratch, events| {
            lanes::run(
                #[inline(always)]
                || {
                    let ([x0, y0], columns) = (tile.window.at, tile.size()[0]);
                    for event in events {
                        cover(
                            event.sprite,
                            &tile.window,
                            scratch,
                            #[inline(always)]
                            |place: usize, alpha: &[Lane<f32>], _: &[Lane<f32>]| {
                                let (row, first) = (place / STRIDE, place % STRIDE);
                                for (k, &a) in alpha.as_flattened().iter().enumerate() {
                                    if a > 0.0 && first + k < columns {
                                        let at = (y0 + row) * self.pixels + x0 + first + k;
                                        pixel(event.sprite.index, at as u32, a);
                                    }
                                }
                            },
                        );
                    }
                },
            );
        })
    }
}

/// Pixels of a tile that belong to the silhouette.
#[inline(always)]
fn inside(tile: &Tile) -> usize {
    let [columns, rows] = tile.size();
    let mut count = 0_u32;
    for row in tile.transmittance.chunks_exact(STRIDE).take(rows) {
        for &t in &row[..columns] {
            count += u32::from(t < EDGE);
        }
    }
    count as usize
}

/// Find which pixels belong to the silhouette: a block that does needs no more strokes, and the count is the same.
#[inline(always)]
fn silhouette(events: &[Event<'_>], tile: &mut Tile, scratch: &mut Scratch) {
    for (k, event) in events.iter().enumerate() {
        if k % 8 == 7 && tile.close_below(EDGE) {
            break;
        }
        if tile.shows(event.sprite) {
            dim(event, tile, scratch);
        }
    }
}

/// Let less light through where a stroke is.
#[inline(always)]
fn dim(event: &Event<'_>, tile: &mut Tile, scratch: &mut Scratch) {
    let transmittance = &mut tile.transmittance;
    cover(
        event.sprite,
        &tile.window,
        scratch,
        #[inline(always)]
        |place: usize, alpha: &[Lane<f32>], _: &[Lane<f32>]| {
            for (k, alpha) in alpha.iter().enumerate() {
                let t = lane(transmittance, place + k * GROUP);
                for i in 0..GROUP {
                    t[i] -= alpha[i] * t[i];
                }
            }
        },
    );
}

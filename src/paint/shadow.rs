//! Shadows of strokes (S6), a deep shadow map from the light: the fraction of a light that reaches each stroke.
//!
//! Strokes are seen from the light, through their masks, nearest to it first: what stands in a stroke's way is the
//! transmittance of those before it, averaged over its own mask. So a stroke casts by what is painted of it, not by its
//! rectangle, and strokes that only receive are put in between without hiding anything.

use glam::DVec3;

use super::cover::{STRIDE, Scratch, cover};
use super::mask::{GROUP, Lane};
use super::sprite::{Sprites, check_len};
use super::tile::{Tile, lane};
use super::tile_binning::{HEIGHT, Tiles, WIDTH};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::lanes;

/// Project positions and sizes onto a plane across the light, `size` pixels wide and high, that holds all of them.
/// Returns centres and sizes \[px\] and distances towards the light \[m\], smallest nearest to it.
pub fn view(position: &[f64], size: &[f32], to: DVec3, pixels: usize) -> Result<(Vec<f32>, Vec<f32>, Vec<f64>)> {
    let n = position.len() / 3;
    check_len("size", size.len(), n, 2)?;
    let to = to.normalize_or_zero();
    if to == DVec3::ZERO || !position.iter().all(|x| x.is_finite()) {
        return Err(Error::Data { name: "position", reason: "positions and light must be finite".into() });
    }
    let right = to.any_orthonormal_vector();
    let down = to.cross(right);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let place = |i: usize| {
        let p = DVec3::from_slice(&position[3 * i..]);
        DVec3::new(p.dot(right), p.dot(down), -p.dot(to))
    };
    let mut most = 0.0_f64;
    for i in 0..n {
        let p = place(i);
        (low, high) = (low.min(p), high.max(p));
        most = most.max(f64::from(size[2 * i].max(size[2 * i + 1])));
    }
    let wide = (high - low).truncate().max_element() + most;
    let scale = if wide > 0.0 { pixels as f64 / wide } else { 1.0 };
    let (mut centre, mut px, mut depth) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n {
        let p = place(i);
        centre.extend([(p.x - low.x + 0.5 * most) * scale, (p.y - low.y + 0.5 * most) * scale].map(|x| x as f32));
        px.extend([size[2 * i], size[2 * i + 1]].map(|x| (f64::from(x) * scale) as f32));
        depth.push(p.z - low.z);
    }
    Ok((centre, px, depth))
}

/// Visibility: the fraction of the light that reaches each sprite, 1 for one that is nowhere; `casts` says how much of
/// each stands in the way \[1\].
pub fn light_visibility(
    job: &Job,
    sprites: &Sprites<'_>,
    casts: Option<&[f32]>,
    pixels: usize,
    out: &mut [f32],
) -> Result<()> {
    check_len("out", out.len(), sprites.count(), 1)?;
    casts.map_or(Ok(()), |list| check_len("casts", list.len(), sprites.count(), 1))?;
    let tiles = Tiles::new(job, sprites, [pixels, pixels])?;
    job.expect(tiles.rows as u64);
    let parts = job.map(tiles.rows, |row| {
        let (mut tile, mut scratch, mut events) = (Tile::new(), Scratch::new(), Vec::new());
        let mut sums = Vec::new();
        for column in 0..tiles.columns {
            job.check()?;
            let (x, y) = (column * WIDTH, row * HEIGHT);
            tile.begin([x, y], [WIDTH.min(pixels - x), HEIGHT.min(pixels - y)]);
            tiles.sorted(row * tiles.columns + column, &mut events);
            lanes::run(
                #[inline(always)]
                || {
                    // Blocks in which nothing has stood yet: there all of the light is left.
                    let mut bare = u64::MAX;
                    for event in &events {
                        let sprite = event.sprite;
                        let cast = casts.map_or(1.0, |list| list[sprite.index as usize]);
                        let blocks = tile.blocks(sprite);
                        if cast > 0.0 {
                            bare &= !blocks;
                        } else if blocks & !bare == 0 && sprite.pixels([pixels; 2]) == tile.window.pixels(sprite) {
                            // Wholly in this tile and in the open: 1, as it is without a share.
                            continue;
                        }
                        let (mut transmittance, mut whole) = ([0.0; GROUP], [0.0; GROUP]);
                        let right = tile.size()[0];
                        let planes = &mut tile.transmittance;
                        cover(
                            sprite,
                            &tile.window,
                            &mut scratch,
                            #[inline(always)]
                            |place: usize, alpha: &[Lane<f32>], _: &[Lane<f32>]| {
                                let first = place % STRIDE;
                                for (k, alpha) in alpha.iter().enumerate() {
                                    let t = lane(planes, place + k * GROUP);
                                    let mut rest = *t;
                                    for i in 0..GROUP {
                                        // What stands over the border is the neighbour's.
                                        let inside = first + k * GROUP + i < right;
                                        let a = if inside { alpha[i] } else { 0.0 };
                                        transmittance[i] += a * rest[i];
                                        whole[i] += a;
                                        rest[i] -= cast * (a * rest[i]);
                                    }
                                    *t = rest;
                                }
                            },
                        );
                        let sum = |l: &Lane<f32>| l.iter().map(|&x| f64::from(x)).sum::<f64>();
                        sums.push((sprite.index, sum(&transmittance), sum(&whole)));
                    }
                },
            );
        }
        job.advance(1)?;
        Ok(sums)
    })?;
    let mut totals = vec![[0.0_f64; 2]; sprites.count()];
    for (index, transmittance, whole) in parts.into_iter().flatten() {
        let total = &mut totals[index as usize];
        *total = [total[0] + transmittance, total[1] + whole];
    }
    for (out, [transmittance, whole]) in out.iter_mut().zip(totals) {
        *out = if whole > 0.0 { (transmittance / whole) as f32 } else { 1.0 };
    }
    Ok(())
}

//! Per-pixel operators over a picture, in planes of a block so that the loop runs over pixels (floor 2).

use crate::color::spaces::RGB_TO_XYZ;
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::lanes;

/// Pixels of a block, and of a chunk.
pub(super) const BLOCK: usize = 256;
pub(super) const CHUNK: usize = 64 * BLOCK;

pub(super) fn pixels_of(light: &[f32]) -> Result<&[[f32; 3]]> {
    let (pixels, rest) = light.as_chunks::<3>();
    if rest.is_empty() {
        return Ok(pixels);
    }
    Err(Error::Shape { name: "rgb", expected: "(..., 3)".into(), got: format!("{} numbers", light.len()) })
}

/// Luminance of a colour.
#[inline(always)]
pub(super) fn luminance([r, g, b]: [f32; 3]) -> f32 {
    RGB_TO_XYZ[1][0] as f32 * r + RGB_TO_XYZ[1][1] as f32 * g + RGB_TO_XYZ[1][2] as f32 * b
}

/// Whether there is a NaN.
#[inline(always)]
pub(super) fn holes(light: &[f32]) -> bool {
    light.iter().fold(0_u32, |n, x| n | u32::from(x.is_nan())) != 0
}

pub(super) fn hole() -> Error {
    Error::Data { name: "rgb", reason: "must not hold NaN".into() }
}

#[inline(always)]
pub(super) fn same(x: f32) -> f32 {
    x
}

/// Run a kernel over pixels, block by block, and `finish` over its numbers.
pub(super) fn over<T: Copy + Send + Default>(
    job: &Job,
    light: &[f32],
    out: &mut [T],
    kernel: impl Fn([f32; 3]) -> [f32; 3] + Copy + Sync,
    finish: impl Fn(f32) -> T + Copy + Sync,
) -> Result<()> {
    let pixels = pixels_of(light)?;
    if out.len() != light.len() {
        let expected = format!("({},)", light.len());
        return Err(Error::Shape { name: "out", expected, got: format!("({},)", out.len()) });
    }
    job.chunks(out, 3 * CHUNK, |chunk, out| {
        let from = &pixels[chunk * CHUNK..chunk * CHUNK + out.len() / 3];
        for (out, from) in out.as_chunks_mut::<3>().0.chunks_mut(BLOCK).zip(from.chunks(BLOCK)) {
            let holes = lanes::run(
                #[inline(always)]
                || {
                    // Three planes, so that the loop runs over pixels; all local, so that nothing may alias.
                    let (mut planes, mut made) = ([[0.0_f32; BLOCK]; 3], [[0.0_f32; BLOCK]; 3]);
                    for (i, pixel) in from.iter().enumerate() {
                        for c in 0..3 {
                            planes[c][i] = pixel[c];
                        }
                    }
                    for i in 0..BLOCK {
                        let pixel = kernel([planes[0][i], planes[1][i], planes[2][i]]);
                        for c in 0..3 {
                            made[c][i] = pixel[c];
                        }
                    }
                    let mut done = [[T::default(); BLOCK]; 3];
                    for (to, from) in done.iter_mut().zip(&made) {
                        for (to, from) in to.iter_mut().zip(from) {
                            *to = finish(*from);
                        }
                    }
                    for (i, pixel) in out.iter_mut().enumerate() {
                        *pixel = [done[0][i], done[1][i], done[2][i]];
                    }
                    holes(planes.as_flattened())
                },
            );
            if holes {
                return Err(hole());
            }
        }
        Ok(())
    })
}

//! Coordinates of colour (floor 1): the sRGB transfer function, and HSV, XYZ, xyY and Lab.
//!
//! Every conversion is a plain loop in `f32` or `f64` over interleaved pixels, without clipping: values above 1 and
//! below 0 are colours like any other. Pictures are linear light with Rec. 709 primaries and D65; only
//! [`transfer::encode`] and the `encoded` arguments leave linear light. Lengths are in elements, three to a pixel.

pub mod spaces;
pub mod transfer;

use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::elementary::Real;
use crate::math::lanes;

/// Pixels of one band: about 0.2 MB of `f32` in and out, which a second-level cache holds.
const BAND: usize = 8192;

/// Pixels that are separated into channels at a time; their planes stay in the first-level cache.
const BLOCK: usize = 256;

fn same_length<T>(src: &[T], channels_in: usize, dst: &[T], channels_out: usize) -> Result<()> {
    if src.len() % channels_in == 0 && src.len() / channels_in * channels_out == dst.len() {
        return Ok(());
    }
    Err(Error::Shape {
        name: "out",
        expected: format!("of {} elements", src.len() / channels_in * channels_out),
        got: format!("{} elements", dst.len()),
    })
}

/// `dst[i] = f(src[i])`.
fn each<T: Real>(job: &Job, src: &[T], dst: &mut [T], f: impl Fn(T) -> T + Copy + Sync) -> Result<()> {
    same_length(src, 1, dst, 1)?;
    job.bands(dst, 3 * BAND, |index, band| {
        let src = &src[index * 3 * BAND..][..band.len()];
        lanes::run(
            #[inline(always)]
            || {
                for (y, &x) in band.iter_mut().zip(src) {
                    *y = f(x);
                }
            },
        );
        Ok(())
    })
}

/// `dst[pixel] = f(src[pixel])` over interleaved pixels of three channels, into pixels of `N` channels.
fn pixels<T: Real, const N: usize>(
    job: &Job,
    src: &[T],
    dst: &mut [T],
    f: impl Fn([T; 3]) -> [T; N] + Copy + Sync,
) -> Result<()> {
    same_length(src, 3, dst, N)?;
    job.bands(dst, N * BAND, |index, band| {
        let src = &src[index * 3 * BAND..][..band.len() / N * 3];
        lanes::run(
            #[inline(always)]
            || loop_pixels(src, band, f),
        );
        Ok(())
    })
}

#[inline(always)]
fn loop_pixels<T: Real, const N: usize>(src: &[T], dst: &mut [T], f: impl Fn([T; 3]) -> [T; N]) {
    for (q, p) in dst.as_chunks_mut::<N>().0.iter_mut().zip(src.as_chunks::<3>().0) {
        *q = f(*p);
    }
}

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

/// Pixels that a short kernel separates into channels at a time: few, so that arithmetic overlaps with memory. The
/// compiler makes better vectors of three plain loops than of one over interleaved pixels (up to twice the speed).
const SMALL: usize = 32;

/// Pixels that a kernel of several steps separates at a time; their planes stay in the first-level cache.
const BLOCK: usize = 256;

fn same_length<T>(src: &[T], channels_in: usize, dst: &[T], channels_out: usize) -> Result<()> {
    if src.len().is_multiple_of(channels_in) && src.len() / channels_in * channels_out == dst.len() {
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

/// `dst[pixel] = f(src[pixel])` over interleaved pixels of three channels, into pixels of `N` channels. For kernels that
/// fit the registers.
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
    let (whole, rest) = src.as_chunks::<{ 3 * SMALL }>();
    let (head, tail) = dst.split_at_mut(whole.len() * N * SMALL);
    let mut a = [[T::of(0.0); SMALL]; 3];
    let mut b = [[T::of(0.0); SMALL]; N];
    for (q, p) in head.chunks_exact_mut(N * SMALL).zip(whole) {
        for i in 0..SMALL {
            for c in 0..3 {
                a[c][i] = p[3 * i + c];
            }
        }
        for i in 0..SMALL {
            let y = f([a[0][i], a[1][i], a[2][i]]);
            for c in 0..N {
                b[c][i] = y[c];
            }
        }
        for (i, y) in q.as_chunks_mut::<N>().0.iter_mut().enumerate().take(SMALL) {
            for c in 0..N {
                y[c] = b[c][i];
            }
        }
    }
    for (q, p) in tail.as_chunks_mut::<N>().0.iter_mut().zip(rest.as_chunks::<3>().0) {
        *q = f(*p);
    }
}

/// Separated channels of a block of pixels.
type Planes<T> = [[T; BLOCK]; 3];

/// One step of a kernel: `f` of each pixel.
#[inline(always)]
fn mix<T: Real>(planes: &mut Planes<T>, f: impl Fn([T; 3]) -> [T; 3]) {
    let [a, b, c] = planes;
    for i in 0..BLOCK {
        [a[i], b[i], c[i]] = f([a[i], b[i], c[i]]);
    }
}

/// One step of a kernel: `f` of each element. Long functions of one element stay loops of their own, because a loop
/// over all their copies at once would have more live values than there are registers.
#[inline(always)]
fn alone<T: Real>(planes: &mut Planes<T>, f: impl Fn(T) -> T) {
    for plane in planes {
        for x in plane {
            *x = f(*x);
        }
    }
}

/// Run `steps` over interleaved pixels of three channels, a block at a time.
fn staged<T: Real>(job: &Job, src: &[T], dst: &mut [T], steps: impl Fn(&mut Planes<T>) + Copy + Sync) -> Result<()> {
    same_length(src, 3, dst, 3)?;
    job.bands(dst, 3 * BAND, |index, band| {
        let src = &src[index * 3 * BAND..][..band.len()];
        lanes::run(
            #[inline(always)]
            || blocks(src, band, steps),
        );
        Ok(())
    })
}

#[inline(always)]
fn blocks<T: Real>(src: &[T], dst: &mut [T], steps: impl Fn(&mut Planes<T>)) {
    let mut planes = [[T::of(0.0); BLOCK]; 3];
    for (q, p) in dst.chunks_mut(3 * BLOCK).zip(src.chunks(3 * BLOCK)) {
        for (i, x) in p.as_chunks::<3>().0.iter().enumerate().take(BLOCK) {
            for c in 0..3 {
                planes[c][i] = x[c];
            }
        }
        // The last block may be shorter; the steps then work on what the one before left, which nobody reads.
        steps(&mut planes);
        for (i, y) in q.as_chunks_mut::<3>().0.iter_mut().enumerate().take(BLOCK) {
            for c in 0..3 {
                y[c] = planes[c][i];
            }
        }
    }
}

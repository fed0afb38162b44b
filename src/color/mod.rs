//! Coordinates of colour (floor 1): the sRGB transfer function, and HSV, XYZ, xyY and Lab.
//!
//! Every conversion is a plain loop in `f32` or `f64` over interleaved pixels, without clipping: values above 1 and
//! below 0 are colours like any other. Pictures are linear light with Rec. 709 primaries and D65; only
//! [`transfer::encode`] and the `encoded` arguments leave linear light. Lengths are in elements, three to a pixel.

pub mod pigment;
pub mod profile;
pub mod spaces;
pub mod spectrum;
pub mod transfer;

use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::elementary::Real;
use crate::math::lanes;

/// Pixels of one chunk: about 0.2 MB of `f32` in and out, which a second-level cache holds.
const CHUNK: usize = 8192;

/// Pixels whose channels a kernel separates at a time; their planes stay in the first-level cache. One more than a
/// multiple of three, see [`Lanes`].
const BLOCK: usize = 64;

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
    job.chunks(dst, 3 * CHUNK, |index, chunk| {
        let src = &src[index * 3 * CHUNK..][..chunk.len()];
        lanes::run(
            #[inline(always)]
            || {
                for (y, &x) in chunk.iter_mut().zip(src) {
                    *y = f(x);
                }
            },
        );
        Ok(())
    })
}

/// `dst[pixel] = f(src[pixel])` over interleaved pixels of three channels.
fn pixels<T: Real>(job: &Job, src: &[T], dst: &mut [T], f: impl Fn([T; 3]) -> [T; 3] + Copy + Sync) -> Result<()> {
    staged(
        job,
        src,
        dst,
        #[inline(always)]
        |planes| mix(planes, f),
    )
}

/// `dst[pixel] = f(src[pixel])` from interleaved pixels of three channels into one.
fn singles<T: Real>(job: &Job, src: &[T], dst: &mut [T], f: impl Fn([T; 3]) -> T + Copy + Sync) -> Result<()> {
    same_length(src, 3, dst, 1)?;
    job.chunks(dst, CHUNK, |index, chunk| {
        let src = src[index * 3 * CHUNK..][..3 * chunk.len()].as_chunks::<3>().0;
        lanes::run(
            #[inline(always)]
            || {
                for (y, x) in chunk.iter_mut().zip(src) {
                    *y = f(*x);
                }
            },
        );
        Ok(())
    })
}

/// Which of three consecutive elements begins a pixel: -1 in `FIRST` at multiples of three, in `SECOND` one later.
const FIRST: [i32; BLOCK] = every_third(0);
const SECOND: [i32; BLOCK] = every_third(1);

const fn every_third(at: usize) -> [i32; BLOCK] {
    let mut out = [0; BLOCK];
    let mut i = at;
    while i < BLOCK {
        out[i] = -1;
        i += 3;
    }
    out
}

/// The first where `i` is a multiple of three, the second one later, the third two later.
#[inline(always)]
fn choose<T: Real>(i: usize, first: T, second: T, third: T) -> T {
    let other = if SECOND[i] < 0 { second } else { third };
    if FIRST[i] < 0 { first } else { other }
}

/// Separated channels of a block of pixels.
///
/// A block of 3 n elements is three runs of n, and n is one more than a multiple of three: of the elements i, n + i and
/// 2 n + i one is red, one green and one blue. So selections between contiguous runs separate the channels, without the
/// shuffles of a stride of three. The order of the pixels is their own; the green of the red at i is at i + 1 and the
/// blue at i + 2, around the end.
#[repr(align(64))]
struct Lanes<T> {
    r: [T; BLOCK],
    g: [T; BLOCK + 16],
    b: [T; BLOCK + 16],
}

/// The channels at the same index.
type Planes<'a, T> = [&'a mut [T; BLOCK]; 3];

impl<T: Real> Lanes<T> {
    #[inline(always)]
    fn new() -> Self {
        let zero = T::of(0.0);
        Self { r: [zero; BLOCK], g: [zero; BLOCK + 16], b: [zero; BLOCK + 16] }
    }

    #[inline(always)]
    fn read(&mut self, p: &[T; 3 * BLOCK]) {
        let Self { r, g, b } = self;
        let (x, rest) = p.split_at(BLOCK);
        let (y, z) = rest.split_at(BLOCK);
        for i in 0..BLOCK {
            // All three are read before the choice: a choice between addresses would not vectorise.
            let (x, y, z) = (x[i], y[i], z[i]);
            r[i] = choose(i, x, z, y);
            g[i] = choose(i, y, x, z);
            b[i] = choose(i, z, y, x);
        }
        g[BLOCK] = g[0];
        b[BLOCK] = b[0];
        b[BLOCK + 1] = b[1];
    }

    #[inline(always)]
    fn planes(&mut self) -> Planes<'_, T> {
        let Self { r, g, b } = self;
        [r, g[1..].first_chunk_mut().expect("longer"), b[2..].first_chunk_mut().expect("longer")]
    }

    #[inline(always)]
    fn write(&mut self, q: &mut [T; 3 * BLOCK]) {
        let Self { r, g, b } = self;
        g[0] = g[BLOCK];
        b[0] = b[BLOCK];
        b[1] = b[BLOCK + 1];
        let (x, rest) = q.split_at_mut(BLOCK);
        let (y, z) = rest.split_at_mut(BLOCK);
        for i in 0..BLOCK {
            let (r, g, b) = (r[i], g[i], b[i]);
            x[i] = choose(i, r, g, b);
            y[i] = choose(i, g, b, r);
            z[i] = choose(i, b, r, g);
        }
    }
}

/// Run `steps` on the planes of each block of interleaved pixels.
#[inline(always)]
fn blocks<T: Real>(src: &[T], dst: &mut [T], steps: impl Fn(&mut Planes<'_, T>)) {
    let mut lanes = Lanes::new();
    let (whole, rest) = src.as_chunks::<{ 3 * BLOCK }>();
    let (head, tail) = dst.as_chunks_mut::<{ 3 * BLOCK }>();
    for (q, p) in head.iter_mut().zip(whole) {
        lanes.read(p);
        steps(&mut lanes.planes());
        lanes.write(q);
    }
    if !rest.is_empty() {
        let mut padded = [T::of(0.0); 3 * BLOCK];
        padded[..rest.len()].copy_from_slice(rest);
        lanes.read(&padded);
        steps(&mut lanes.planes());
        lanes.write(&mut padded);
        tail.copy_from_slice(&padded[..rest.len()]);
    }
}

/// Run `steps` over interleaved pixels of three channels, a block at a time.
fn staged<T: Real>(
    job: &Job,
    src: &[T],
    dst: &mut [T],
    steps: impl Fn(&mut Planes<'_, T>) + Copy + Sync,
) -> Result<()> {
    same_length(src, 3, dst, 3)?;
    job.chunks(dst, 3 * CHUNK, |index, chunk| {
        let src = &src[index * 3 * CHUNK..][..chunk.len()];
        lanes::run(
            #[inline(always)]
            || blocks(src, chunk, steps),
        );
        Ok(())
    })
}

/// One step of a kernel: `f` of each pixel.
#[inline(always)]
fn mix<T: Real>([a, b, c]: &mut Planes<'_, T>, f: impl Fn([T; 3]) -> [T; 3]) {
    for i in 0..BLOCK {
        [a[i], b[i], c[i]] = f([a[i], b[i], c[i]]);
    }
}

/// One step of a kernel: `f` of each element. Long functions of one element stay loops of their own, because a loop
/// over all their copies at once would have more live values than there are registers.
#[inline(always)]
fn alone<T: Real>(planes: &mut Planes<'_, T>, f: impl Fn(T) -> T) {
    for plane in planes {
        for x in plane.iter_mut() {
            *x = f(*x);
        }
    }
}

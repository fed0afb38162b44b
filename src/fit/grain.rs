//! The noise of a photograph's sky, and the same on what is put into it (floor 5).
//!
//! Normal, in encoded levels, of each channel alone. The deviation is that of the median of absolute differences from the
//! mean of the neighbourhood, which have 8/9 of the variance of white noise: stars, birds and the edges of veils are no
//! grain. Within 10 % of the truth (`test_grain_is_measured`).

use crate::color::transfer::{decode, encode};
use crate::error::{Error, Result};
use crate::image::blur::blur;
use crate::job::Job;
use crate::math::random::Stream;

/// Fewer clear pixels say nothing.
const FEWEST: usize = 64;
/// Median of the absolute value of a normal deviate.
const QUARTILE: f64 = 0.674_489_750_196_081_7;
/// Deviation of [`Stream::normal3`].
const DEVIATION: f64 = 0.986_577;

/// Deviation of the noise where the linear-light picture is `clear`, of each encoded channel \[1\].
pub fn deviation(rgb: &[f32], [height, width]: [usize; 2], clear: &[bool], job: &Job) -> Result<[f64; 3]> {
    if rgb.len() != 3 * height * width || clear.len() != height * width {
        let (expected, got) = (format!("({height}, {width})"), format!("{} elements", clear.len()));
        return Err(Error::Shape { name: "clear", expected, got });
    }
    // The border has neighbours on one side only.
    let inside = |p: usize| (1..height - 1).contains(&(p / width)) && (1..width - 1).contains(&(p % width));
    let pixels: Vec<usize> = (0..clear.len()).filter(|&p| clear[p] && inside(p)).collect();
    if pixels.len() < FEWEST {
        return Ok([0.0; 3]);
    }
    let mut encoded = vec![0.0_f32; rgb.len()];
    job.chunks(&mut encoded, 1 << 15, |chunk, out| {
        for (o, &x) in out.iter_mut().zip(&rgb[chunk << 15..]) {
            *o = encode(x.clamp(0.0, 1.0));
        }
        Ok(())
    })?;
    let soft = blur(&encoded, [height, width, 3], job)?;
    let channel = |c: usize| {
        let mut off: Vec<f32> = pixels.iter().map(|&p| (encoded[3 * p + c] - soft[3 * p + c]).abs()).collect();
        let middle = off.len() / 2;
        let median = *off.select_nth_unstable_by(middle, f32::total_cmp).1;
        Ok(f64::from(median) / QUARTILE * (9.0_f64 / 8.0).sqrt())
    };
    let found = job.map(3, channel)?;
    Ok([found[0], found[1], found[2]])
}

/// A linear-light picture with noise of these deviations in its encoded levels.
pub fn add(picture: &[f32], deviation: [f64; 3], key: u64, job: &Job) -> Result<Vec<f32>> {
    const CHUNK: usize = 3 << 12;
    let random = Stream::new(key, 0);
    let mut out = picture.to_vec();
    job.chunks(&mut out, CHUNK, |chunk, out| {
        for (i, value) in out.iter_mut().enumerate() {
            let noise = random.normal3((chunk * CHUNK + i) as u64) / DEVIATION * deviation[i % 3];
            *value = decode((encode(value.max(0.0)) + noise as f32).max(0.0));
        }
        Ok(())
    })?;
    Ok(out)
}

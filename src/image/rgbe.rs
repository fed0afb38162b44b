//! Radiance RGBE: shared-exponent pixels and the run-length encoding of their scanlines (floor 1).
//!
//! A pixel is three 8-bit mantissas and a common exponent (Ward 1991): each channel to 1/256 of the largest. Scanlines of 8
//! to 32767 pixels store the four components one after the other, as runs (128 + length, value) of 4 and more equal bytes and
//! literals (length, values). Mantissas are rounded, ties to even, and 255 where rounding would overflow: still within 1/256.
//! `tests/oracles/test_hdr_files.py` holds files against OpenCV's and Mitsuba's readers.
//!
//! Cost: 32 million pixels in 0.7 s on one core and a third of the picture in memory (OpenCV: 0.8 s, twice the picture).

use crate::error::{Error, Result};
use crate::job::Job;

/// Widths that have runs.
pub const RUNS: std::ops::Range<usize> = 8..32768;
/// Rows of one piece of work.
const ROWS: usize = 16;

/// Whether all values are finite, and the least and the largest of those that are.
pub fn limits(picture: &[f32], job: &Job) -> Result<(bool, f32, f32)> {
    const CHUNK: usize = 1 << 16;
    let parts = job.map(picture.len().div_ceil(CHUNK), |k| {
        let part = &picture[k * CHUNK..picture.len().min((k + 1) * CHUNK)];
        let each = part.iter().filter(|v| v.is_finite());
        let (low, high) = each.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        Ok((part.iter().all(|v| v.is_finite()), low, high))
    })?;
    Ok(parts
        .into_iter()
        .fold((true, f32::INFINITY, f32::NEG_INFINITY), |a, b| (a.0 && b.0, a.1.min(b.1), a.2.max(b.2))))
}

/// Mantissas and exponent of a pixel that is finite and not negative.
fn pixel(rgb: [f32; 3]) -> [u8; 4] {
    // In f64 every f32 is normal: the exponent is in its bits.
    let wide = rgb.map(f64::from);
    let largest = wide[0].max(wide[1]).max(wide[2]);
    let exponent = ((largest.to_bits() >> 52) & 0x7ff) as i64 - 1022;
    // Below the least exponent there is only zero.
    if largest <= 0.0 || exponent <= -128 {
        return [0; 4];
    }
    let scale = f64::from_bits(((1023 + 8 - exponent) as u64) << 52);
    let mantissa = wide.map(|v| (v * scale).round_ties_even().min(255.0) as u8);
    [mantissa[0], mantissa[1], mantissa[2], (exponent + 128) as u8]
}

/// Append one component of a scanline as runs and literals.
fn pack(row: &[u8], out: &mut Vec<u8>) {
    let literals = |from: usize, to: usize, out: &mut Vec<u8>| {
        for part in row[from..to].chunks(128) {
            out.push(part.len() as u8);
            out.extend_from_slice(part);
        }
    };
    let (mut at, mut done) = (0, 0);
    while at < row.len() {
        let end = row[at..].iter().position(|&v| v != row[at]).map_or(row.len(), |n| at + n);
        if end - at >= 4 {
            literals(done, at, out);
            let mut left = end - at;
            while left > 0 {
                let run = left.min(127);
                out.extend([128 + run as u8, row[at]]);
                left -= run;
            }
            done = end;
        }
        at = end;
    }
    literals(done, row.len(), out);
}

/// The body of a file: scanlines from the top. The picture must be finite, not negative and below 2^127.
pub fn encode(picture: &[f32], width: usize, job: &Job) -> Result<Vec<u8>> {
    if width == 0 || picture.is_empty() || !picture.len().is_multiple_of(3 * width) {
        return Err(Error::Shape {
            name: "picture",
            expected: format!("rows of {width} pixels"),
            got: format!("{} values", picture.len()),
        });
    }
    let height = picture.len() / (3 * width);
    let blocks = job.map(height.div_ceil(ROWS), |k| {
        let rows = k * ROWS..height.min((k + 1) * ROWS);
        let mut out = Vec::with_capacity(rows.len() * (2 * width + 16));
        let mut planes = vec![0; 4 * width];
        for row in rows.map(|y| &picture[3 * y * width..3 * (y + 1) * width]) {
            let pixels = row.chunks_exact(3).map(|p| pixel([p[0], p[1], p[2]]));
            if !RUNS.contains(&width) {
                out.extend(pixels.flatten());
                continue;
            }
            for (x, p) in pixels.enumerate() {
                for (c, v) in p.into_iter().enumerate() {
                    planes[c * width + x] = v;
                }
            }
            out.extend([2, 2, (width >> 8) as u8, (width & 255) as u8]);
            planes.chunks_exact(width).for_each(|plane| pack(plane, &mut out));
        }
        Ok(out)
    })?;
    Ok(blocks.concat())
}

fn damaged(reason: &str) -> Error {
    Error::Data { name: "picture", reason: reason.into() }
}

/// Undo [`pack`] for the four components of a scanline; where the next begins.
fn unpack(body: &[u8], mut at: usize, planes: &mut [u8]) -> Result<usize> {
    const CUT: &str = "its scanlines are damaged";
    let mut filled = 0;
    while filled < planes.len() {
        let count = *body.get(at).ok_or_else(|| damaged(CUT))? as usize;
        let (length, run) = if count > 128 { (count - 128, true) } else { (count, false) };
        let to = planes.get_mut(filled..filled + length).filter(|to| !to.is_empty()).ok_or_else(|| damaged(CUT))?;
        let from = body.get(at + 1..at + 1 + if run { 1 } else { length }).ok_or_else(|| damaged(CUT))?;
        if run {
            to.fill(from[0]);
        } else {
            to.copy_from_slice(from);
        }
        filled += length;
        at += 1 + from.len();
    }
    Ok(at)
}

/// Light of the body of a file, `scale` times too large in each channel.
pub fn decode(body: &[u8], [height, width]: [usize; 2], scale: [f64; 3], job: &Job) -> Result<Vec<f32>> {
    let count = height * width;
    let mut pixels = vec![[0_u8; 4]; count];
    let mark = [2, 2, (width >> 8) as u8, (width & 255) as u8];
    if body.starts_with(&[2, 2]) && body.get(2).is_some_and(|v| *v < 128) && RUNS.contains(&width) {
        let (mut at, mut planes) = (0, vec![0; 4 * width]);
        for row in pixels.chunks_exact_mut(width) {
            job.check()?;
            if body.get(at..at + 4) != Some(&mark) {
                return Err(damaged("its scanlines are damaged"));
            }
            at = unpack(body, at + 4, &mut planes)?;
            for (x, p) in row.iter_mut().enumerate() {
                *p = std::array::from_fn(|c| planes[c * width + x]);
            }
        }
    } else {
        let flat = body.get(..4 * count).ok_or_else(|| damaged("its scanlines are damaged"))?;
        for (p, from) in pixels.iter_mut().zip(flat.chunks_exact(4)) {
            p.copy_from_slice(from);
            if p[..3] == [1, 1, 1] {
                return Err(damaged("its run-length encoding is the one of before 1991"));
            }
        }
    }
    let mut out = vec![0.0; 3 * count];
    job.chunks(&mut out, 3 << 14, |k, out| {
        for (rgb, p) in out.chunks_exact_mut(3).zip(&pixels[k << 14..]) {
            if p[3] > 0 {
                let unit = f64::from_bits(((1023 - 136 + i64::from(p[3])) as u64) << 52);
                for c in 0..3 {
                    rgb[c] = (f64::from(p[c]) * unit / scale[c]) as f32;
                }
            }
        }
        Ok(())
    })?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_comes_back() {
        let job = Job::serial();
        for width in [1, 7, 8, 9, 130, 300] {
            let value = |i: usize| if i % 11 < 6 { 0.25 } else { (i * 7 % 31) as f32 };
            let picture: Vec<f32> = (0..3 * width * 5).map(value).collect();
            let body = encode(&picture, width, &job).expect("encoded");
            let back = decode(&body, [5, width], [1.0; 3], &job).expect("decoded");
            for (a, b) in picture.chunks(3).zip(back.chunks(3)) {
                let largest = a.iter().copied().fold(0.0, f32::max);
                assert!(a.iter().zip(b).all(|(x, y)| (x - y).abs() <= largest / 256.0), "{a:?} and {b:?}");
            }
            for cut in 0..body.len() {
                assert!(decode(&body[..cut], [5, width], [1.0; 3], &job).is_err(), "cut at {cut}");
            }
        }
    }
}

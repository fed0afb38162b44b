//! Area-averaging resize (box filter, INTER_AREA) (floor 1).
//!
//! Each new pixel is the mean of the part of the old picture that it covers, with the old picture constant over its
//! pixels: exact for the light a larger pixel would have received, and the sum of light is kept. Enlarging repeats
//! pixels. Separable; sums in `f64`.

use crate::error::{Error, Result};
use crate::job::Job;

/// For each new element: first old element, and the fraction of it and of those after it.
fn overlap_weights(old: usize, new: usize) -> Vec<(usize, Vec<f64>)> {
    let ratio = old as f64 / new as f64;
    (0..new)
        .map(|i| {
            let (low, high) = (i as f64 * ratio, ((i + 1) as f64 * ratio).min(old as f64));
            let first = (low as usize).min(old - 1);
            let last = ((high - 1e-9).ceil() as usize).clamp(first + 1, old);
            let part = |k: usize| (high.min((k + 1) as f64) - low.max(k as f64)).max(0.0);
            let parts: Vec<f64> = (first..last).map(part).collect();
            let sum: f64 = parts.iter().sum();
            (first, parts.into_iter().map(|p| p / sum).collect())
        })
        .collect()
}

/// Resize `picture` of `(height, width, channels)` to `(new_height, new_width, channels)`.
pub fn resize(
    picture: &[f32],
    [height, width, channels]: [usize; 3],
    [new_height, new_width]: [usize; 2],
    out: &mut [f32],
    job: &Job,
) -> Result<()> {
    if height == 0 || width == 0 || channels == 0 {
        return Err(Error::Empty { name: "picture" });
    }
    if picture.len() != height * width * channels || out.len() != new_height * new_width * channels {
        let (expected, got) = (format!("({height}, {width}, {channels})"), format!("{} elements", picture.len()));
        return Err(Error::Shape { name: "picture", expected, got });
    }
    let (rows, columns) = (overlap_weights(height, new_height), overlap_weights(width, new_width));
    job.chunks(out, new_width * channels, |y, to| {
        let (first, parts) = &rows[y];
        let mut line = vec![0.0_f64; width * channels];
        for (k, part) in parts.iter().enumerate() {
            let from = &picture[(first + k) * width * channels..][..width * channels];
            for (l, &x) in line.iter_mut().zip(from) {
                *l += part * f64::from(x);
            }
        }
        for (x, (first, parts)) in columns.iter().enumerate() {
            for c in 0..channels {
                let sum: f64 = parts.iter().enumerate().map(|(k, p)| p * line[(first + k) * channels + c]).sum();
                to[x * channels + c] = sum as f32;
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_kept_and_whole_ratios_are_plain_means() {
        let picture: Vec<f32> = (0..6 * 8).map(|i| ((i * 7) % 11) as f32).collect();
        let mean = picture.iter().sum::<f32>() / 48.0;
        for size in [[3, 4], [5, 7], [1, 1], [6, 8], [13, 9]] {
            let mut out = vec![0.0; size[0] * size[1]];
            resize(&picture, [6, 8, 1], size, &mut out, &Job::serial()).expect("valid");
            let got = out.iter().sum::<f32>() / out.len() as f32;
            assert!((got - mean).abs() < 1e-5, "{size:?}: mean {got} against {mean}");
        }
        let mut half = vec![0.0; 12];
        resize(&picture, [6, 8, 1], [3, 4], &mut half, &Job::serial()).expect("valid");
        let plain = (picture[0] + picture[1] + picture[8] + picture[9]) / 4.0;
        assert!((half[0] - plain).abs() < 1e-6, "2 x 2 mean");
        let mut same = vec![0.0; 48];
        resize(&picture, [6, 8, 1], [6, 8], &mut same, &Job::serial()).expect("valid");
        assert_eq!(same, picture, "the same size is the same picture");
    }
}

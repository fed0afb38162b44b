//! The mean of a pixel and its eight neighbours, a box filter of 3 × 3 (floor 1).
//!
//! The border repeats. Sums of nine in f32: relative error below 5e-7. Checked against scipy's `uniform_filter`
//! (`test_fit_in_photograph.py`).

use crate::error::{Error, Result};
use crate::job::Job;

/// The filtered `(height, width, channels)` picture.
pub fn blur(values: &[f32], [height, width, channels]: [usize; 3], job: &Job) -> Result<Vec<f32>> {
    let line = width * channels;
    if values.len() != height * line || values.is_empty() {
        let (expected, got) = (format!("({height}, {width}, {channels})"), format!("{} elements", values.len()));
        return Err(Error::Shape { name: "picture", expected, got });
    }
    let mut out = vec![0.0; values.len()];
    job.chunks(&mut out, line, |y, row| {
        let above = &values[y.saturating_sub(1) * line..][..line];
        let here = &values[y * line..][..line];
        let below = &values[(y + 1).min(height - 1) * line..][..line];
        let sums: Vec<f32> = above.iter().zip(here).zip(below).map(|((a, b), c)| a + b + c).collect();
        for x in 0..width {
            let (left, right) = (x.saturating_sub(1) * channels, (x + 1).min(width - 1) * channels);
            for c in 0..channels {
                row[x * channels + c] = (sums[left + c] + sums[x * channels + c] + sums[right + c]) * (1.0 / 9.0);
            }
        }
        Ok(())
    })?;
    Ok(out)
}

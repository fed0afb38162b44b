//! A picture moved and scaled into the frame of another, linear between its pixels (bilinear resampling) (floor 1).
//!
//! Beyond its pixels is a constant, over one pixel of transition. Units: pixels, centres on whole numbers.

use crate::error::{Error, Result};
use crate::job::Job;

/// `out(y, x) = picture((y - to) / scale + middle)` for a `(rows, columns, channels)` picture, `(height, width,
/// channels)` of them.
pub fn warp(
    picture: &[f32],
    [rows, columns, channels]: [usize; 3],
    [height, width]: [usize; 2],
    (scale, middle, to): (f64, [f64; 2], [f64; 2]),
    outside: f32,
    job: &Job,
) -> Result<Vec<f32>> {
    if picture.len() != rows * columns * channels {
        let (expected, got) = (format!("({rows}, {columns}, {channels})"), format!("{} elements", picture.len()));
        return Err(Error::Shape { name: "picture", expected, got });
    }
    // First of the two pixels, counted from one before the picture, and the share of the second.
    let place = |at: usize, axis: usize, size: usize| {
        let place = ((at as f64 - to[axis]) / scale + middle[axis] + 1.0).clamp(0.0, size as f64 + 0.999);
        (place as usize, (place - place.floor()) as f32)
    };
    let across: Vec<(usize, f32)> = (0..width).map(|x| place(x, 1, columns)).collect();
    let value = |y: usize, x: usize, c: usize| {
        let inside = (1..=rows).contains(&y) && (1..=columns).contains(&x);
        if inside { picture[((y - 1) * columns + x - 1) * channels + c] } else { outside }
    };
    let mut out = vec![0.0; height * width * channels];
    job.chunks(&mut out, (width * channels).max(1), |row, out| {
        let (y, down) = place(row, 0, rows);
        for (pixel, &(x, right)) in out.chunks_exact_mut(channels.max(1)).zip(&across) {
            for (c, o) in pixel.iter_mut().enumerate() {
                let upper = value(y, x, c) * (1.0 - right) + value(y, x + 1, c) * right;
                let lower = value(y + 1, x, c) * (1.0 - right) + value(y + 1, x + 1, c) * right;
                *o = upper * (1.0 - down) + lower * down;
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
    fn it_is_the_same_in_place_and_constant_beyond() {
        let picture: Vec<f32> = (0..12).map(|i| i as f32).collect();
        let job = Job::serial();
        let at = |to: [f64; 2]| warp(&picture, [3, 4, 1], [3, 4], (1.0, [0.0; 2], to), -7.0, &job).expect("valid");
        assert_eq!(at([0.0, 0.0]), picture, "in place");
        let moved = at([0.0, 1.5]);
        assert_eq!(moved[..4], [-7.0, -3.5, 0.5, 1.5], "half a pixel between, constant beyond");
        assert!(at([90.0, 0.0]).iter().all(|&x| x == -7.0), "far away");
    }
}

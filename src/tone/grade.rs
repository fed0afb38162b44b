//! The grade of a picture (floor 2): values of sky and land, saturation and the colour of shadows, a painter's choices.
//!
//! Values are factors of light, before the eye: 2^stops of the sky's, between it and land by how much of a pixel is sky, as a
//! photographer dodges and burns. Colours are of what is shown, linear light in [0, 1]: saturation is the distance from grey
//! of equal luminance, and what is darker than a tenth of white goes towards the hue of shadows at equal luminance. Units:
//! stops \[1\], shares in [0, 1] \[1\]. Linear in the picture but for the last: `test_grade.py` holds both in numpy.

use crate::error::{Error, Result};
use crate::job::Job;

/// Luminance of white that shadows end at.
const SHADOW: f32 = 0.1;
const PIXELS: usize = 1 << 14;

fn luminance(p: [f32; 3]) -> f32 {
    0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]
}

/// Light of the sky times 2^`sky`, of the land times 2^`land`, in place; `share` is how much of each pixel is sky.
pub fn values(job: &Job, rgb: &mut [f32], share: &[f32], [sky, land]: [f64; 2]) -> Result<()> {
    if rgb.len() != 3 * share.len() {
        let (expected, got) = (format!("{} pixels", share.len()), format!("{} numbers", rgb.len()));
        return Err(Error::Shape { name: "rgb", expected, got });
    }
    let (sky, land) = (sky.exp2() as f32, land.exp2() as f32);
    job.chunks(rgb, 3 * PIXELS, |chunk, rgb| {
        for (pixel, &s) in rgb.chunks_exact_mut(3).zip(&share[chunk * PIXELS..]) {
            let by = land + s.clamp(0.0, 1.0) * (sky - land);
            for x in pixel {
                *x *= by;
            }
        }
        Ok(())
    })
}

/// Saturation, and the hue of shadows by a share of `tint`, of a shown picture, in place.
pub fn colors(job: &Job, rgb: &mut [f32], saturation: f64, shadows: [f64; 3], tint: f64) -> Result<()> {
    let saturation = saturation as f32;
    let hue = shadows.map(|x| x as f32);
    // Of luminance 1.
    let of_hue = luminance(hue).max(1e-6);
    job.chunks(rgb, 3 * PIXELS, |_, rgb| {
        for pixel in rgb.chunks_exact_mut(3) {
            let y = luminance([pixel[0], pixel[1], pixel[2]]);
            let depth = tint as f32 * (1.0 - y / SHADOW).clamp(0.0, 1.0);
            for (x, h) in pixel.iter_mut().zip(hue) {
                let plain = y + saturation * (*x - y);
                *x = (plain + depth * (y * h / of_hue - plain)).clamp(0.0, 1.0);
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_stops_and_colours_keep_their_luminance() {
        let job = Job::serial();
        let mut rgb = vec![0.1_f32, 0.2, 0.3, 0.1, 0.2, 0.3, 0.1, 0.2, 0.3];
        values(&job, &mut rgb, &[1.0, 0.0, 0.5], [1.0, -1.0]).expect("valid");
        assert!(
            (rgb[0] - 0.2).abs() < 1e-6 && (rgb[3] - 0.05).abs() < 1e-6 && (rgb[6] - 0.125).abs() < 1e-6,
            "{rgb:?}"
        );
        let mut rgb = vec![0.3_f32, 0.5, 0.2, 0.03, 0.05, 0.02];
        let before = [luminance([0.3, 0.5, 0.2]), luminance([0.03, 0.05, 0.02])];
        colors(&job, &mut rgb, 0.5, [0.3, 0.2, 0.1], 0.6).expect("valid");
        for (pixel, y) in rgb.chunks_exact(3).zip(before) {
            assert!((luminance([pixel[0], pixel[1], pixel[2]]) - y).abs() < 1e-6, "equal luminance");
        }
        assert!((rgb[0] - (before[0] + 0.5 * (0.3 - before[0]))).abs() < 1e-6, "half as far from grey");
        assert!(rgb[3] > rgb[5], "shadows are brown");
        assert!(values(&job, &mut rgb, &[1.0], [0.0; 2]).is_err(), "a share for each pixel");
    }
}

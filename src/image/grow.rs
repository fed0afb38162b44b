//! Morphological dilation of a mask by a disc (floor 1).
//!
//! The disc is Euclidean, centre to centre. Running counts along the rows: the cost of a pixel grows with the radius
//! and not with its square. Units: pixels.

use crate::error::{Error, Result};
use crate::job::Job;

/// Set every pixel within `radius` (Euclidean, centre to centre) of a set one. Running counts along the rows make the
/// cost of a pixel proportional to the radius, not to its square.
pub fn dilate(mask: &[bool], [height, width]: [usize; 2], radius: usize, job: &Job) -> Result<Vec<bool>> {
    if mask.len() != height * width {
        let (expected, got) = (format!("({height}, {width})"), format!("{} elements", mask.len()));
        return Err(Error::Shape { name: "mask", expected, got });
    }
    // Set pixels left of each column, row by row.
    let mut before = vec![0_u32; height * (width + 1)];
    for (row, counts) in mask.chunks_exact(width.max(1)).zip(before.chunks_exact_mut(width + 1)) {
        for (x, &set) in row.iter().enumerate() {
            counts[x + 1] = counts[x] + u32::from(set);
        }
    }
    let mut out = vec![false; mask.len()];
    job.chunks(&mut out, width.max(1), |y, row| {
        for from in y.saturating_sub(radius)..(y + radius + 1).min(height) {
            let off = y.abs_diff(from);
            let reach = (((radius * radius - off * off) as f64).sqrt()) as usize;
            let counts = &before[from * (width + 1)..(from + 1) * (width + 1)];
            for (x, set) in row.iter_mut().enumerate() {
                *set |= counts[(x + reach + 1).min(width)] > counts[x.saturating_sub(reach)];
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
    fn a_point_becomes_a_disc() {
        let mut mask = vec![false; 11 * 9];
        mask[5 * 9 + 4] = true;
        for radius in 0..4_usize {
            let out = dilate(&mask, [11, 9], radius, &Job::serial()).expect("valid");
            for (at, &set) in out.iter().enumerate() {
                let (dy, dx) = ((at / 9).abs_diff(5), (at % 9).abs_diff(4));
                assert_eq!(set, dx * dx + dy * dy <= radius * radius, "radius {radius}, {dx}, {dy}");
            }
        }
    }
}

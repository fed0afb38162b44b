//! What a photograph gives the fit (section 4.1 of inverse_clouds): the mean colour and the histograms of its clouds.
//!
//! Linear light in, histograms of sRGB-encoded levels out, each of sum 1 \[1\].

use super::objective::{LevelBins, histogram};
use crate::error::{Error, Result};
use crate::job::Job;

fn check(rgb: &[f32], mask: &[bool]) -> Result<()> {
    if rgb.len() == 3 * mask.len() {
        return Ok(());
    }
    let got = format!("{} pixels", mask.len());
    Err(Error::Shape { name: "mask", expected: format!("{} pixels", rgb.len() / 3), got })
}

/// Mean of the pixels where `mask` is set.
pub fn mean(rgb: &[f32], mask: &[bool]) -> Result<[f64; 3]> {
    check(rgb, mask)?;
    let (mut sum, mut count) = ([0.0_f64; 3], 0_u64);
    for (pixel, _) in rgb.chunks_exact(3).zip(mask).filter(|(_, m)| **m) {
        for c in 0..3 {
            sum[c] += f64::from(pixel[c]);
        }
        count += 1;
    }
    if count == 0 { Err(Error::Empty { name: "mask" }) } else { Ok(sum.map(|s| s / count as f64)) }
}

/// Histograms of the three channels where `mask` is set, `(3, bins)`, each of sum 1, over the bins of the objective.
pub fn histograms(rgb: &[f32], mask: &[bool], bins: usize, job: &Job) -> Result<Vec<f64>> {
    check(rgb, mask)?;
    let bins = LevelBins::new(bins)?;
    let channel = |c: usize| {
        let values = rgb.chunks_exact(3).zip(mask).filter(|(_, m)| **m).map(|(pixel, _)| pixel[c]);
        Ok(histogram(&bins, values))
    };
    Ok(job.map(3, channel)?.concat())
}

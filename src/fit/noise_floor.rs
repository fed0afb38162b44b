//! The noise floor of the objective, by bootstrap: how far two histograms of samples of the same thing are apart.
//!
//! Of 8 resamplings a channel; held to 8 % of the multinomial's expectation
//! (`it_is_that_of_the_multinomial_distribution`).

use crate::error::Result;
use crate::job::Job;
use crate::math::random::Stream;

/// Resamplings whose mean is taken; each is itself a mean over some hundred bins.
const RESAMPLINGS: usize = 8;

/// Mean `O` of eq 2 between the histograms `(3, bins)` of `target`, each of sum 1, and those of `pixels` pixels drawn
/// from them (a bootstrap of pixels). Fits whose objectives differ by less are equally good.
///
/// Neighbouring pixels of a picture are alike, so the floor of a picture is rather higher than that of independent
/// pixels.
pub fn noise_floor(target: &[f64], pixels: usize, key: u64, job: &Job) -> Result<f64> {
    let bins = target.len() / 3;
    let one = |which: usize| {
        let histogram = &target[which % 3 * bins..][..bins];
        let mut sum = 0.0;
        let wheel: Vec<f64> = histogram
            .iter()
            .map(|h| {
                sum += h;
                sum
            })
            .collect();
        let random = Stream::new(key, which as u64);
        let mut counts = vec![0_u64; bins];
        for i in 0..pixels {
            let u = random.uniform(i as u64) * sum;
            counts[wheel.partition_point(|&w| w <= u).min(bins - 1)] += 1;
        }
        job.check()?;
        let scale = 1.0 / pixels.max(1) as f64;
        Ok(counts.iter().zip(histogram).map(|(&n, h)| (n as f64 * scale - h).abs()).sum::<f64>())
    };
    let all = job.map(3 * RESAMPLINGS, one)?;
    Ok(all.iter().sum::<f64>() / all.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_that_of_the_multinomial_distribution() {
        let (bins, pixels) = (64, 2359);
        let target = vec![1.0 / 64.0; 3 * bins];
        let got = noise_floor(&target, pixels, 1, &Job::serial()).expect("runs");
        // The mean deviation of each bin's fraction is sqrt(2 / pi) standard deviations.
        let p = 1.0 / bins as f64;
        let expected = bins as f64 * (2.0 / std::f64::consts::PI * p * (1.0 - p) / pixels as f64).sqrt();
        assert!((got / expected - 1.0).abs() < 0.08, "{got} against {expected}");
        let mut one = vec![0.0; 3 * bins];
        for c in 0..3 {
            one[c * bins + 7] = 1.0;
        }
        assert_eq!(noise_floor(&one, 100, 1, &Job::serial()).expect("runs"), 0.0, "a single bin has none");
    }
}

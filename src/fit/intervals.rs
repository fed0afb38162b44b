//! How far a fit knows its parameters: intervals that hold under misfit (an approximate Bayesian computation).
//!
//! A model never has a photograph's histograms exactly: another cloud, another camera, a tone curve. Parameters that are as
//! good as the best to within the noise of pixels are then an interval that misses the truth. So how wrong the model is on
//! the whole is the measure of what its objective can tell: points that fill the box evenly (a Latin hypercube in the scales of
//! the search, a flat prior) weigh exp(-(O - O_best) / T), with T three tenths of O_best, and no less than the noise floor. The
//! interval is the shortest that holds `level` of the weight (highest density).
//!
//! The share was chosen on 160 targets made by another cloud and another camera, in 8 bits with three tone curves; on another
//! 120 the true value lies in the interval of level 0.9 in 80 % and more (`tests/papers/misfit_targets.py`,
//! docs/papers/inverse_clouds.md).

use super::clouds::evaluate;
use super::objective::Objective;
use super::search::{SearchSettings, latin_hypercube};
use crate::error::Result;
use crate::job::Job;
use crate::math::random::Stream;

/// Objective calls.
pub const CALLS: usize = 1000;
/// T as a fraction of the best objective.
const MISFIT: f64 = 0.3;
/// Purpose of the random numbers, apart from those of searches.
const PURPOSE: u64 = 0x1d7e_57a1;

/// Shortest interval of `places` that holds `level` of the weight.
fn shortest(places: &[f64], weights: &[f64], level: f64) -> (f64, f64) {
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|&a, &b| places[a].total_cmp(&places[b]));
    let whole: f64 = weights.iter().sum();
    let (mut best, mut first, mut held) = ((0.0, 1.0), 0, 0.0);
    for (last, &i) in order.iter().enumerate() {
        held += weights[i];
        while first < last && held - weights[order[first]] >= level * whole {
            held -= weights[order[first]];
            first += 1;
        }
        let (low, high) = (places[order[first]], places[i]);
        if held >= level * whole && high - low < best.1 - best.0 {
            best = (low, high);
        }
    }
    best
}

/// Lowest and highest value of each parameter at this level; `best` is the best objective, `floor` the noise floor.
pub fn intervals(
    objective: &Objective,
    settings: &SearchSettings,
    (best, floor): (f64, f64),
    level: f64,
    job: &Job,
) -> Result<Vec<(f64, f64)>> {
    let bounds = &settings.bounds;
    let unit = latin_hypercube(Stream::new(settings.key, PURPOSE), CALLS, bounds.len());
    let value = |x: &Vec<f64>| (0..x.len()).map(|j| settings.scale(j).value(x[j], bounds[j])).collect();
    let points: Vec<Vec<f64>> = unit.iter().map(value).collect();
    let values = evaluate(objective, &points, job)?;
    let temperature = (MISFIT * best).max(floor).max(f64::MIN_POSITIVE);
    let weight = |o: f64| if o.is_nan() { 0.0 } else { (-(o - best).max(0.0) / temperature).exp() };
    let weights: Vec<f64> = values.iter().map(|v| weight(v.objective)).collect();
    let one = |j: usize| {
        let places: Vec<f64> = unit.iter().map(|x| x[j]).collect();
        let (low, high) = shortest(&places, &weights, level);
        (settings.scale(j).value(low, bounds[j]), settings.scale(j).value(high, bounds[j]))
    };
    Ok((0..bounds.len()).map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_interval_of_a_normal_distribution() {
        let places: Vec<f64> = (0..20_001).map(|i| f64::from(i) / 20_000.0).collect();
        let weights: Vec<f64> = places.iter().map(|x| (-0.5 * ((x - 0.4) / 0.05_f64).powi(2)).exp()).collect();
        let (low, high) = shortest(&places, &weights, 0.9);
        // Of the shortest the width is exact, the place is flat.
        assert!((high - low - 2.0 * 1.644_854 * 0.05).abs() < 1e-4, "{low} {high}");
        assert!((0.5 * (low + high) - 0.4).abs() < 2e-3, "{low} {high}");
        assert_eq!(shortest(&[0.3], &[1.0], 0.9), (0.3, 0.3), "a single point");
        assert_eq!(shortest(&[0.3, 0.5], &[0.0, 0.0], 0.9).0, 0.3, "no weight at all");
    }
}

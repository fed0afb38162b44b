//! Ask-and-tell optimisation: what every search has in common, its settings, its record, its stopping criteria.
//!
//! A search asks for whole populations and is told their objectives, so the objective may be vectorised, parallel, or
//! Python. An objective of NaN is never chosen. Parameters with equal bounds stay where they are.

use crate::error::{Error, Result, in_range};
use crate::math::random::Stream;

/// How a search runs.
#[derive(Debug, Clone)]
pub struct SearchSettings {
    /// Lowest and highest value of each parameter.
    pub bounds: Vec<(f64, f64)>,
    /// In what each parameter is searched; linear where there is none.
    pub scales: Vec<Scale>,
    /// Individuals of a generation; times `generations` it is the number of objective calls that may be spent.
    pub population: usize,
    /// Most generations.
    pub generations: usize,
    /// End when the best objective is not above this.
    pub target: f64,
    /// End when the best has not changed for so many of the method's own generations.
    pub patience: usize,
    /// Individuals to remember.
    pub n_best: usize,
    /// Remembered individuals differ by more than this fraction of a range in at least one parameter.
    pub min_separation: f64,
    /// Key of the random numbers.
    pub key: u64,
}

impl SearchSettings {
    /// Refuse what has no meaning.
    pub fn validate(&self) -> Result<()> {
        if self.bounds.is_empty() {
            return Err(Error::Empty { name: "bounds" });
        }
        for (i, &(low, high)) in self.bounds.iter().enumerate() {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                let reason = format!("must be finite with low <= high, got ({low}, {high}) for parameter {i}");
                return Err(Error::Data { name: "bounds", reason });
            }
        }
        in_range("population", self.population as f64, 2.0, 1e6, "1")?;
        in_range("generations", self.generations as f64, 1.0, 1e9, "1")?;
        in_range("distinct", self.min_separation, 0.0, 1.0, "1")?;
        in_range("patience", self.patience as f64, 1.0, 1e9, "1")?;
        in_range("keep", self.n_best as f64, 1.0, 1e6, "1")
    }

    /// In what a parameter is searched.
    pub fn scale(&self, parameter: usize) -> Scale {
        self.scales.get(parameter).copied().unwrap_or_default()
    }

    /// Objective calls that may be spent.
    pub fn calls(&self) -> usize {
        self.population.saturating_mul(self.generations)
    }
}

/// In what a parameter is searched: equal steps there are equally likely.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// The parameter itself.
    #[default]
    Linear,
    /// Its logarithm: an extinction.
    Log,
    /// Its inverse hyperbolic tangent: an asymmetry.
    Atanh,
}

impl Scale {
    /// The scale of this name.
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "linear" => Ok(Self::Linear),
            "log" => Ok(Self::Log),
            "atanh" => Ok(Self::Atanh),
            other => {
                let reason = format!("must be \"linear\", \"log\" or \"atanh\", got {other:?}");
                Err(Error::Data { name: "scales", reason })
            }
        }
    }

    /// The same where the bounds allow it.
    fn within(self, (low, high): (f64, f64)) -> Self {
        let allowed = match self {
            Self::Linear => true,
            Self::Log => low > 0.0,
            Self::Atanh => low > -1.0 && high < 1.0,
        };
        if allowed { self } else { Self::Linear }
    }

    /// From [0, 1] to the bounds.
    pub fn value(self, unit: f64, (low, high): (f64, f64)) -> f64 {
        let between = |a: f64, b: f64| a + (b - a) * unit;
        let value = match self.within((low, high)) {
            Self::Linear => between(low, high),
            Self::Log => between(low.ln(), high.ln()).exp(),
            Self::Atanh => between(low.atanh(), high.atanh()).tanh(),
        };
        value.clamp(low, high)
    }

    /// From the bounds to [0, 1].
    pub fn unit(self, value: f64, (low, high): (f64, f64)) -> f64 {
        let of = |a: f64, b: f64, x: f64| (x - a) / (b - a);
        let unit = match self.within((low, high)) {
            Self::Linear => of(low, high, value),
            Self::Log => of(low.ln(), high.ln(), value.ln()),
            Self::Atanh => of(low.atanh(), high.atanh(), value.atanh()),
        };
        unit.clamp(0.0, 1.0)
    }
}

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The objective fell below the target.
    Target,
    /// The best did not change for `patience` generations.
    Patience,
    /// All calls were spent.
    Generations,
}

/// A parameter vector and its objective.
#[derive(Debug, Clone, PartialEq)]
pub struct Individual {
    /// Parameters.
    pub x: Vec<f64>,
    /// Objective.
    pub value: f64,
}

/// One population of the history.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Generation {
    /// Best objective so far.
    pub best: f64,
    /// Mean objective of the population (finite ones).
    pub mean: f64,
    /// Objective calls so far.
    pub calls: usize,
}

/// A search that is asked and told until its record has stopped.
pub trait Search {
    /// Parameters to evaluate next, one row for each individual.
    fn ask(&self) -> Vec<Vec<f64>>;
    /// Take the objectives of what was asked.
    fn tell(&mut self, values: &[f64]) -> Result<()>;
    /// What was found so far.
    fn record(&self) -> &Record;
}

/// Evaluated individuals that are remembered: the best of all when there were more.
const MEMORY: usize = 1 << 15;

/// `count` points of the unit box: each parameter visits each of `count` slices once (a Latin hypercube).
pub fn latin_hypercube(random: Stream, count: usize, dimension: usize) -> Vec<Vec<f64>> {
    let mut index = 0;
    let mut draw = || {
        index += 1;
        random.uniform(index)
    };
    let mut points = vec![vec![0.0; dimension]; count];
    for j in 0..dimension {
        let mut slices: Vec<usize> = (0..count).collect();
        for i in (1..count).rev() {
            slices.swap(i, (draw() * (i + 1) as f64) as usize);
        }
        for (point, slice) in points.iter_mut().zip(slices) {
            point[j] = (slice as f64 + draw()) / count as f64;
        }
    }
    points
}

/// What was evaluated, ranked, and whether to go on.
#[derive(Debug, Clone)]
pub struct Record {
    settings: SearchSettings,
    ranked: Vec<Individual>,
    history: Vec<Generation>,
    seen: Vec<Individual>,
    calls: usize,
    unchanged: usize,
    stop: Option<Stop>,
}

impl Record {
    /// An empty record.
    pub fn new(settings: SearchSettings) -> Result<Self> {
        settings.validate()?;
        let (ranked, history, seen) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { settings, ranked, history, seen, calls: 0, unchanged: 0, stop: None })
    }

    /// How the search runs.
    pub fn settings(&self) -> &SearchSettings {
        &self.settings
    }

    /// Take the objectives of what was asked.
    pub fn take(&mut self, asked: &[Vec<f64>], values: &[f64]) -> Result<()> {
        if values.len() != asked.len() {
            let (expected, got) = (format!("({},)", asked.len()), format!("({},)", values.len()));
            return Err(Error::Shape { name: "objective", expected, got });
        }
        let before = self.best();
        for (x, &value) in asked.iter().zip(values) {
            if !value.is_nan() {
                self.rank(x, value);
                self.seen.push(Individual { x: x.clone(), value });
            }
        }
        if self.seen.len() > 2 * MEMORY {
            self.seen.sort_by(|a, b| a.value.total_cmp(&b.value));
            self.seen.truncate(MEMORY);
        }
        let best = self.best();
        let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let mean = finite.iter().sum::<f64>() / finite.len() as f64;
        self.calls += values.len();
        self.history.push(Generation { best, mean, calls: self.calls });
        self.unchanged = if best < before { 0 } else { self.unchanged + 1 };
        self.stop = if best <= self.settings.target {
            Some(Stop::Target)
        } else if self.calls >= self.settings.calls() {
            Some(Stop::Generations)
        } else {
            None
        };
        Ok(())
    }

    /// Rank an individual, unless a better one is alike; worse ones that are alike give way.
    fn rank(&mut self, x: &[f64], value: f64) {
        let at = self.ranked.partition_point(|r| r.value <= value);
        if at == self.settings.n_best {
            return;
        }
        let (bounds, min_separation) = (&self.settings.bounds, self.settings.min_separation);
        let alike = |other: &Individual| {
            let apart = x.iter().zip(&other.x).zip(bounds).any(|((a, b), (low, high))| {
                let range = high - low;
                range > 0.0 && (a - b).abs() > min_separation * range
            });
            !apart
        };
        if self.ranked[..at].iter().any(&alike) {
            return;
        }
        let mut place = 0;
        self.ranked.retain(|r| {
            place += 1;
            place <= at || !alike(r)
        });
        self.ranked.insert(at, Individual { x: x.to_vec(), value });
        self.ranked.truncate(self.settings.n_best);
    }

    /// Best objective so far, infinite before there is one.
    pub fn best(&self) -> f64 {
        self.ranked.first().map_or(f64::INFINITY, |b| b.value)
    }

    /// Whether the best has not changed for `patience` generations.
    pub fn weary(&self) -> bool {
        self.unchanged >= self.settings.patience
    }

    /// End the search.
    pub fn end(&mut self, why: Stop) {
        self.stop = Some(self.stop.unwrap_or(why));
    }

    /// Objective calls so far.
    pub fn calls(&self) -> usize {
        self.calls
    }

    /// Objective calls that are left.
    pub fn left(&self) -> usize {
        self.settings.calls() - self.calls
    }

    /// Why the search has ended, once it has.
    pub fn stopped(&self) -> Option<Stop> {
        self.stop
    }

    /// The best individuals, no two alike, best first.
    pub fn ranked(&self) -> &[Individual] {
        &self.ranked
    }

    /// One row for each population.
    pub fn history(&self) -> &[Generation] {
        &self.history
    }

    /// The `count` best of all that was evaluated and is remembered, best first.
    pub fn elite(&self, count: usize) -> Vec<&Individual> {
        let mut all: Vec<&Individual> = self.seen.iter().collect();
        all.sort_by(|a, b| a.value.total_cmp(&b.value));
        all.truncate(count);
        all
    }

    /// Extent of each parameter among the individuals within `within` of the best, as a fraction of its range: how far
    /// a parameter can be moved, others with it, before the objective tells.
    pub fn spread(&self, within: f64) -> Vec<f64> {
        let limit = self.best() + within;
        let range_fraction = |(j, &(low, high)): (usize, &(f64, f64))| {
            let near = self.seen.iter().filter(|i| i.value <= limit).map(|i| i.x[j]);
            let (least, most) = near.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            if high > low && most > least { (most - least) / (high - low) } else { 0.0 }
        };
        self.settings.bounds.iter().enumerate().map(range_fraction).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> SearchSettings {
        let bounds = vec![(0.0, 10.0), (5.0, 5.0)];
        SearchSettings {
            bounds,
            scales: Vec::new(),
            population: 2,
            generations: 4,
            target: 0.0,
            patience: 9,
            n_best: 3,
            min_separation: 0.0,
            key: 0,
        }
    }

    #[test]
    fn the_spread_is_that_of_what_is_nearly_as_good() {
        let mut record = Record::new(settings()).expect("valid");
        record.take(&[vec![1.0, 5.0], vec![3.0, 5.0]], &[0.30, 0.35]).expect("right shape");
        record.take(&[vec![9.0, 5.0], vec![0.5, 5.0]], &[0.50, f64::NAN]).expect("right shape");
        assert_eq!(record.spread(0.0), [0.0, 0.0], "only the best");
        assert!((record.spread(0.06)[0] - 0.2).abs() < 1e-12, "two of them");
        assert!((record.spread(1.0)[0] - 0.8).abs() < 1e-12, "all, without NaN");
        assert_eq!(record.spread(1.0)[1], 0.0, "a frozen parameter has none");
        assert_eq!(record.elite(2).iter().map(|i| i.value).collect::<Vec<_>>(), [0.30, 0.35], "best first");
        assert_eq!((record.calls(), record.left()), (4, 4), "calls are counted");
    }

    #[test]
    fn memory_is_bounded_and_keeps_the_best() {
        let mut s = settings();
        s.population = 1000;
        s.generations = 1000;
        s.patience = 1_000_000;
        let mut record = Record::new(s).expect("valid");
        for g in 0..100 {
            let values: Vec<f64> = (0..1000).map(|i| f64::from(1 + (i * 7919 + g * 31) % 100_000)).collect();
            let asked: Vec<Vec<f64>> = values.iter().map(|&v| vec![v * 1e-4, 5.0]).collect();
            record.take(&asked, &values).expect("right shape");
        }
        assert!(record.seen.len() <= 2 * MEMORY, "bounded");
        assert_eq!(record.elite(1)[0].value, record.best(), "the best stays");
    }
}

//! Differential evolution (Storn and Price 1997), L-SHADE with linear population size reduction, and a polish.
//!
//! The evolution is L-SHADE (Tanabe and Fukunaga 2014) without its archive: a trial is `x + F (pbest - x) + F (a - b)`,
//! crossed with `x`; scale and crossover rates are drawn around a memory of those that succeeded; the population
//! shrinks as calls are spent. The first population is a Latin hypercube. The last part of the calls is spent by
//! [`Cma`] from the best points found. Population, shrinking, the fraction of the polish and the missing archive were
//! chosen by measurement on cloud fits (`docs/papers/inverse_clouds.md`).

use super::cma::{self, Cma};
use super::search::{Record, Search, SearchSettings, Stop, latin_hypercube};
use crate::error::Result;
use crate::math::random::Stream;

/// Slots of the memory of successful rates.
const SLOTS: usize = 5;
/// The best of which fraction lead the others.
const LEADERS: f64 = 0.11;
/// The population never gets smaller.
const SMALLEST: usize = 6;
/// Best points whose extent the polish begins with.
const ELITE: usize = 20;

/// Individuals of the first population for a number of calls: 20 for 1000, 50 for 4000.
pub fn population(calls: usize) -> usize {
    ((20.0 * (calls as f64 / 1000.0).powf(0.66)) as usize).clamp(8, 200)
}

/// Calls of the polish: 300 of 1000, 800 of 4000, never more than 30 % of few parameters; more than a dozen are not found
/// by evolving them in so few calls, so the polish has up to 80 %.
fn polishing(calls: usize, dimension: usize) -> usize {
    let fraction = (0.3 * (1000.0 / calls as f64).powf(0.3)).min(0.3);
    let many = ((dimension as f64 - 6.0) / 4.0).clamp(0.0, 1.0);
    (calls as f64 * (fraction + many * (0.8 - fraction))) as usize
}

/// The state of a search.
#[derive(Debug, Clone)]
pub struct Differential {
    record: Record,
    free: Vec<usize>,
    /// Calls of the evolution; what follows belongs to the polish.
    budget: usize,
    /// Calls at which the polish ends.
    last: usize,
    first: usize,
    /// Living individuals in the unit box of the free parameters, and their objectives.
    living: Vec<(Vec<f64>, f64)>,
    trials: Vec<Vec<f64>>,
    rates: Vec<(f64, f64)>,
    memory: Vec<(f64, f64)>,
    slot: usize,
    polish: Option<Cma>,
    polishes: u32,
}

impl Differential {
    /// A first population of `first` individuals; with `polish` the last calls refine the best.
    pub fn new(settings: SearchSettings, first: usize, polish: bool) -> Result<Self> {
        let record = Record::new(settings)?;
        let settings = record.settings();
        let free: Vec<usize> =
            (0..settings.bounds.len()).filter(|&j| settings.bounds[j].0 < settings.bounds[j].1).collect();
        let calls = settings.calls();
        let budget = if polish && !free.is_empty() { calls - polishing(calls, free.len()) } else { calls };
        let first = first.clamp(4, calls.max(4));
        let mut trials = latin_hypercube(Stream::new(settings.key, 0), first, free.len());
        trials.truncate(calls);
        Ok(Self {
            record,
            free,
            budget,
            last: calls,
            first,
            living: Vec::new(),
            trials,
            rates: Vec::new(),
            memory: vec![(0.5, 0.5); SLOTS],
            slot: 0,
            polish: None,
            polishes: 0,
        })
    }

    /// Parameters of a point of the unit box.
    fn decode(&self, unit: &[f64]) -> Vec<f64> {
        let bounds = &self.record.settings().bounds;
        let mut x: Vec<f64> = bounds.iter().map(|b| b.0).collect();
        for (&j, u) in self.free.iter().zip(unit) {
            x[j] = self.record.settings().scale(j).value(*u, bounds[j]);
        }
        x
    }

    fn encode(&self, x: &[f64]) -> Vec<f64> {
        let settings = self.record.settings();
        self.free.iter().map(|&j| settings.scale(j).unit(x[j], settings.bounds[j])).collect()
    }

    /// Trials take the places of what they are not worse than; the rates of those that are better are remembered.
    fn select(&mut self, values: &[f64]) {
        let value = |v: f64| if v.is_nan() { f64::INFINITY } else { v };
        if self.living.is_empty() {
            self.living = self.trials.iter().cloned().zip(values.iter().map(|&v| value(v))).collect();
        } else {
            let (mut gain, mut scale, mut scale2, mut cross, mut cross2) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (i, (trial, &v)) in self.trials.iter().zip(values).enumerate() {
                let v = value(v);
                let old = self.living[i].1;
                if v < old {
                    // A first number in place of none counts as one of those that gain little.
                    let w = if old.is_finite() { old - v } else { f64::MIN_POSITIVE };
                    let (f, c) = self.rates[i];
                    gain += w;
                    scale += w * f;
                    scale2 += w * f * f;
                    cross += w * c;
                    cross2 += w * c * c;
                }
                if v <= old {
                    self.living[i] = (trial.clone(), v);
                }
            }
            if gain > 0.0 && gain.is_finite() {
                // Lehmer means, which favour large rates.
                let f = if scale > 0.0 { scale2 / scale } else { 0.5 };
                let c = if cross > 0.0 { cross2 / cross } else { 0.0 };
                self.memory[self.slot] = (f.clamp(0.0, 1.0), c.clamp(0.0, 1.0));
                self.slot = (self.slot + 1) % SLOTS;
            }
        }
        self.living.sort_by(|a, b| a.1.total_cmp(&b.1));
        let spent = (self.record.calls() as f64 / self.budget as f64).min(1.0);
        let smallest = SMALLEST.min(self.first);
        let size = smallest as f64 + (self.first - smallest) as f64 * (1.0 - spent);
        self.living.truncate(size.round() as usize);
    }

    fn evolve(&mut self, left: usize) {
        let random = Stream::new(self.record.settings().key, self.record.history().len() as u64);
        let mut index = 0;
        let mut draw = || {
            index += 1;
            random.uniform(index)
        };
        let n = self.living.len();
        let below = |u: f64, n: usize| ((u * n as f64) as usize).min(n - 1);
        let leaders = ((LEADERS * n as f64).round() as usize).clamp(2, n);
        let dimension = self.free.len();
        (self.trials, self.rates) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for i in 0..n.min(left) {
            let (f0, c0) = self.memory[below(draw(), SLOTS)];
            // Scale: Cauchy around the memory, drawn again below 0. Crossover: normal around the memory.
            let mut f = 0.0;
            while f <= 0.0 {
                f = f0 + 0.1 * (std::f64::consts::PI * (draw() - 0.5)).tan();
            }
            let f = f.min(1.0);
            let normal = (-2.0 * (1.0 - draw()).ln()).sqrt() * (std::f64::consts::TAU * draw()).cos();
            let c = (c0 + 0.1 * normal).clamp(0.0, 1.0);
            let lead = below(draw(), leaders);
            let a = (i + 1 + below(draw(), n - 1)) % n;
            let mut b = below(draw(), n - 2);
            for taken in [i.min(a), i.max(a)] {
                b += usize::from(b >= taken);
            }
            let (x, lead, a, b) = (&self.living[i].0, &self.living[lead].0, &self.living[a].0, &self.living[b].0);
            let forced = below(draw(), dimension.max(1));
            let trial = (0..dimension)
                .map(|j| {
                    if j != forced && draw() >= c {
                        return x[j];
                    }
                    let u = x[j] + f * (lead[j] - x[j]) + f * (a[j] - b[j]);
                    // Outside: half way to the bound.
                    if u < 0.0 {
                        0.5 * x[j]
                    } else if u > 1.0 {
                        0.5 * (1.0 + x[j])
                    } else {
                        u
                    }
                })
                .collect();
            self.trials.push(trial);
            self.rates.push((f, c));
        }
    }

    /// Ask the polish for its next points; begin it, or begin it again wider where it has come to rest.
    fn refine(&mut self, left: usize) {
        if self.polish.is_none() {
            let elite: Vec<Vec<f64>> = self.record.elite(ELITE).iter().map(|i| self.encode(&i.x)).collect();
            // Again after a rest: from the best, but twice as wide each time, out of the place it rests in.
            let least = if self.polishes == 0 { 0.0 } else { 0.05 * f64::from(1 << (self.polishes - 1).min(3)) };
            self.polish = Cma::new(&elite, least);
            self.polishes += 1;
        }
        let random = Stream::new(self.record.settings().key, self.record.history().len() as u64);
        let dimension = self.free.len() as u64;
        self.trials = match &mut self.polish {
            Some(cma) => cma.draw(random).to_vec(),
            None => (0..cma::population(self.free.len()) as u64)
                .map(|i| (0..dimension).map(|j| random.uniform(i * dimension + j)).collect())
                .collect(),
        };
        self.trials.truncate(left);
    }
}

impl Search for Differential {
    fn ask(&self) -> Vec<Vec<f64>> {
        self.trials.iter().map(|t| self.decode(t)).collect()
    }

    fn tell(&mut self, values: &[f64]) -> Result<()> {
        let evolving = self.record.calls() < self.budget;
        self.record.take(&self.ask(), values)?;
        if self.record.stopped().is_some() {
            return Ok(());
        }
        let calls = self.record.calls();
        if evolving && self.record.weary() {
            // Patience ends the evolution; what it found is refined all the same.
            let polish = if self.budget < self.last { polishing(self.last, self.free.len()) } else { 0 };
            if polish == 0 {
                self.record.end(Stop::Patience);
                return Ok(());
            }
            (self.budget, self.last) = (calls, self.last.min(calls + polish));
        }
        if !evolving && calls >= self.last {
            self.record.end(Stop::Patience);
            return Ok(());
        }
        if evolving {
            self.select(values);
        } else if let Some(cma) = &mut self.polish
            && (values.len() < cma::population(self.free.len()) || !cma.learn(values))
        {
            self.polish = None;
        }
        if calls < self.budget {
            self.evolve(self.budget - calls);
        } else {
            self.refine(self.last - calls);
        }
        Ok(())
    }

    fn record(&self) -> &Record {
        &self.record
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(dimension: usize, key: u64) -> SearchSettings {
        SearchSettings {
            bounds: vec![(-5.0, 5.0); dimension],
            scales: Vec::new(),
            population: 20,
            generations: 100,
            target: f64::NEG_INFINITY,
            patience: 1_000_000,
            n_best: 5,
            min_separation: 0.0,
            key,
        }
    }

    fn run(mut search: Differential, f: impl Fn(&[f64]) -> f64) -> Differential {
        while search.record().stopped().is_none() {
            let asked = search.ask();
            let bounds = &search.record().settings().bounds;
            let inside = |x: &Vec<f64>| x.iter().zip(bounds).all(|(v, (low, high))| low <= v && v <= high);
            assert!(asked.iter().all(inside), "in the bounds");
            let values: Vec<f64> = asked.iter().map(|x| f(x)).collect();
            search.tell(&values).expect("right shape");
        }
        search
    }

    #[test]
    fn it_finds_the_bottom_of_a_twisted_valley_within_the_calls() {
        let valley = |x: &[f64]| {
            x.windows(2).map(|w| 10.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum::<f64>() - 7.0
        };
        for (polish, least) in [(false, 0.2), (true, 0.02)] {
            for key in 0..5 {
                let found = run(Differential::new(settings(4, key), 30, polish).expect("valid"), valley);
                assert!(found.record().best() + 7.0 < least, "polish {polish}: {}", found.record().best() + 7.0);
                assert_eq!(found.record().calls(), 2000, "all calls are spent and none more");
                assert_eq!(found.record().stopped(), Some(Stop::Generations), "spent");
            }
        }
    }

    #[test]
    fn frozen_parameters_nan_and_tiny_budgets() {
        let mut s = settings(3, 1);
        s.bounds[1] = (2.0, 2.0);
        let found = run(Differential::new(s.clone(), 20, true).expect("valid"), |x| {
            if x[0] < 0.0 { f64::NAN } else { x[0] + x[2].abs() + x[1] }
        });
        assert!(found.record().best() < 2.01, "NaN is never chosen: {}", found.record().best());
        assert!(found.record().ranked().iter().all(|i| i.x[1] == 2.0), "frozen");
        s.bounds = vec![(1.0, 1.0); 2];
        assert_eq!(run(Differential::new(s.clone(), 20, true).expect("valid"), |x| x[0]).record().best(), 1.0, "all");
        let nothing = run(Differential::new(settings(2, 1), 20, true).expect("valid"), |_| f64::NAN);
        assert!(nothing.record().ranked().is_empty(), "nothing was found");
        for (population, generations) in [(2, 1), (3, 1), (2, 5), (7, 3)] {
            (s.bounds, s.population, s.generations) = (vec![(0.0, 1.0)], population, generations);
            let found = run(Differential::new(s.clone(), 20, true).expect("valid"), |x| x[0]);
            assert_eq!(found.record().calls(), population * generations, "exactly the calls");
        }
    }

    #[test]
    fn the_first_population_grows_with_the_calls() {
        assert_eq!([10, 1000, 4000, 1_000_000].map(population), [8, 20, 49, 200], "bounded");
    }
}

//! The genetic algorithm of section 4.2 (after Goldberg 1989), for any objective that is at least 0.
//!
//! Each parameter is quantised to `bits` bits between its bounds; the strings are joined to one gene. Fitness is
//! `1 / (1 + O)`, selection by roulette wheel, crossover at two points of the whole gene, mutation bit by bit, and the
//! best individual is carried over unchanged. It ends when the objective reaches a target, when the best has not
//! changed for `patience` generations, or after `generations`.
//!
//! The paper leaves open the mutation rate (here by default one bit of a gene on average), the crossover rate (0.9) and
//! the selection (roulette). Two-point crossover and elitism are its own. The algorithm asks for whole populations and
//! is told their values, so the objective may be vectorised, parallel, or Python. An objective of NaN is never chosen.

use crate::error::{Error, Result, in_range};
use crate::math::random::Stream;

/// How the algorithm runs.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Lowest and highest value of each parameter.
    pub bounds: Vec<(f64, f64)>,
    /// Individuals of a generation.
    pub population: usize,
    /// Most generations.
    pub generations: usize,
    /// Bits of a parameter, at most 32.
    pub bits: u32,
    /// Probability that a pair is crossed.
    pub crossover: f64,
    /// Probability that a bit flips.
    pub mutation: f64,
    /// End when the best objective is not above this.
    pub target: f64,
    /// End when the best has not changed for so many generations.
    pub patience: usize,
    /// Individuals to remember.
    pub keep: usize,
    /// Remembered individuals differ by more than this share of a range in at least one parameter.
    pub distinct: f64,
    /// Key of the random numbers.
    pub key: u64,
}

impl Settings {
    fn validate(&self) -> Result<()> {
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
        in_range("bits", f64::from(self.bits), 1.0, 32.0, "1")?;
        in_range("crossover", self.crossover, 0.0, 1.0, "1")?;
        in_range("mutation", self.mutation, 0.0, 1.0, "1")?;
        in_range("distinct", self.distinct, 0.0, 1.0, "1")?;
        in_range("patience", self.patience as f64, 1.0, 1e9, "1")?;
        in_range("keep", self.keep as f64, 1.0, 1e6, "1")
    }
}

/// Why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The objective fell below the target.
    Target,
    /// The best did not change for `patience` generations.
    Patience,
    /// All generations were run.
    Generations,
}

/// A parameter vector and its objective.
#[derive(Debug, Clone, PartialEq)]
pub struct Individual {
    /// Parameters.
    pub x: Vec<f64>,
    /// Objective.
    pub value: f64,
    gene: Vec<u32>,
}

/// One generation of the history.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Generation {
    /// Best objective so far.
    pub best: f64,
    /// Mean objective of the generation (finite ones).
    pub mean: f64,
    /// Objective calls so far.
    pub calls: usize,
}

/// The state of a search: ask, evaluate, tell, until [`stopped`](Genetic::stopped).
#[derive(Debug, Clone)]
pub struct Genetic {
    settings: Settings,
    genes: Vec<Vec<u32>>,
    ranked: Vec<Individual>,
    history: Vec<Generation>,
    unchanged: usize,
    stop: Option<Stop>,
}

impl Genetic {
    /// A random first generation.
    pub fn new(settings: Settings) -> Result<Self> {
        settings.validate()?;
        let random = Stream::new(settings.key, 0);
        let dimension = settings.bounds.len();
        let genes = (0..settings.population)
            .map(|i| (0..dimension).map(|j| (random.bits((i * dimension + j) as u64) >> 32) as u32).collect())
            .map(|gene: Vec<u32>| gene.into_iter().map(|g| g >> (32 - settings.bits)).collect())
            .collect();
        Ok(Self { settings, genes, ranked: Vec::new(), history: Vec::new(), unchanged: 0, stop: None })
    }

    fn decode(&self, gene: &[u32]) -> Vec<f64> {
        let steps = (2.0_f64).powi(self.settings.bits as i32) - 1.0;
        gene.iter()
            .zip(&self.settings.bounds)
            .map(|(&g, &(low, high))| (low + (high - low) * (f64::from(g) / steps)).clamp(low, high))
            .collect()
    }

    /// Parameters of the current generation, one row for each individual.
    pub fn ask(&self) -> Vec<Vec<f64>> {
        self.genes.iter().map(|gene| self.decode(gene)).collect()
    }

    /// Take the objectives of what was asked, and breed.
    pub fn tell(&mut self, values: &[f64]) -> Result<()> {
        if values.len() != self.genes.len() {
            let (expected, got) = (format!("({},)", self.genes.len()), format!("({},)", values.len()));
            return Err(Error::Shape { name: "objective", expected, got });
        }
        if let Some(&bad) = values.iter().find(|&&v| v < 0.0) {
            let reason = format!("must be at least 0 (fitness is 1 / (1 + O)), got {bad}; add a constant");
            return Err(Error::Data { name: "objective", reason });
        }
        let before = self.ranked.first().map_or(f64::INFINITY, |b| b.value);
        for (gene, &value) in self.genes.clone().iter().zip(values) {
            if !value.is_nan() {
                self.remember(gene, value);
            }
        }
        let best = self.ranked.first().map_or(f64::INFINITY, |b| b.value);
        let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let mean = finite.iter().sum::<f64>() / finite.len() as f64;
        let calls = self.history.last().map_or(0, |g| g.calls) + values.len();
        self.history.push(Generation { best, mean, calls });
        self.unchanged = if best < before { 0 } else { self.unchanged + 1 };
        self.stop = if best <= self.settings.target {
            Some(Stop::Target)
        } else if self.unchanged >= self.settings.patience {
            Some(Stop::Patience)
        } else if self.history.len() >= self.settings.generations {
            Some(Stop::Generations)
        } else {
            None
        };
        if self.stop.is_none() {
            self.breed(values);
        }
        Ok(())
    }

    /// Rank an individual, unless a better one is alike; worse ones that are alike give way.
    fn remember(&mut self, gene: &[u32], value: f64) {
        let at = self.ranked.partition_point(|r| r.value <= value);
        if at == self.settings.keep {
            return;
        }
        let x = self.decode(gene);
        let (bounds, distinct) = (&self.settings.bounds, self.settings.distinct);
        let alike = |other: &Individual| {
            let apart = x.iter().zip(&other.x).zip(bounds).any(|((a, b), (low, high))| {
                let range = high - low;
                range > 0.0 && (a - b).abs() > distinct * range
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
        self.ranked.insert(at, Individual { x, value, gene: gene.to_vec() });
        self.ranked.truncate(self.settings.keep);
    }

    fn breed(&mut self, values: &[f64]) {
        let random = Stream::new(self.settings.key, self.history.len() as u64);
        let mut counter = 0;
        let mut draw = || {
            counter += 1;
            random.uniform(counter)
        };
        let mut wheel = Vec::with_capacity(values.len());
        let mut sum = 0.0;
        for &value in values {
            sum += if value.is_nan() { 0.0 } else { 1.0 / (1.0 + value) };
            wheel.push(sum);
        }
        let pick = |u: f64| wheel.partition_point(|&w| w <= u * sum).min(values.len() - 1);
        let dimension = self.settings.bounds.len();
        let length = dimension as u32 * self.settings.bits;
        let mut next: Vec<Vec<u32>> = Vec::with_capacity(values.len());
        if let Some(best) = self.ranked.first() {
            next.push(best.gene.clone());
        }
        while next.len() < values.len() {
            let mut a = self.genes[pick(draw())].clone();
            let mut b = self.genes[pick(draw())].clone();
            if draw() < self.settings.crossover {
                let (p, q) = ((draw() * f64::from(length)) as u32, (draw() * f64::from(length)) as u32);
                swap_bits(&mut a, &mut b, p.min(q), p.max(q), self.settings.bits);
            }
            for gene in [&mut a, &mut b] {
                for word in gene.iter_mut() {
                    for bit in 0..self.settings.bits {
                        if draw() < self.settings.mutation {
                            *word ^= 1 << bit;
                        }
                    }
                }
            }
            next.push(a);
            if next.len() < values.len() {
                next.push(b);
            }
        }
        self.genes = next;
    }

    /// Why the search has ended, once it has.
    pub fn stopped(&self) -> Option<Stop> {
        self.stop
    }

    /// The best individuals, no two with the same gene, best first.
    pub fn ranked(&self) -> &[Individual] {
        &self.ranked
    }

    /// One row for each generation.
    pub fn history(&self) -> &[Generation] {
        &self.history
    }
}

/// Swap the bits `from..to` of two genes, counted from the highest bit of the first parameter.
fn swap_bits(a: &mut [u32], b: &mut [u32], from: u32, to: u32, bits: u32) {
    for (word, (a, b)) in a.iter_mut().zip(b.iter_mut()).enumerate() {
        let start = word as u32 * bits;
        let (low, high) = (from.max(start), to.min(start + bits));
        if low < high {
            // Bits low..high of this word, from its highest: shift counts stay below 32 in 64 bits.
            let mask = ((1_u64 << (start + bits - low)) - (1_u64 << (start + bits - high))) as u32;
            let difference = (*a ^ *b) & mask;
            *a ^= difference;
            *b ^= difference;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(dimension: usize, key: u64) -> Settings {
        Settings {
            bounds: vec![(-5.0, 5.0); dimension],
            population: 40,
            generations: 200,
            bits: 32,
            crossover: 0.9,
            mutation: 1.0 / (32.0 * dimension as f64),
            target: 0.0,
            patience: 200,
            keep: 5,
            distinct: 0.0,
            key,
        }
    }

    fn sphere(x: &[f64]) -> f64 {
        x.iter().map(|v| (v - 1.0).powi(2)).sum()
    }

    fn run(mut ga: Genetic) -> Genetic {
        while ga.stopped().is_none() {
            let values: Vec<f64> = ga.ask().iter().map(|x| sphere(x)).collect();
            ga.tell(&values).expect("right shape");
        }
        ga
    }

    #[test]
    fn it_finds_the_bottom_of_a_bowl_and_never_loses_it() {
        let ga = run(Genetic::new(settings(2, 1)).expect("valid"));
        assert!(ga.ranked()[0].value < 0.2 * ga.history()[0].best, "best {}", ga.ranked()[0].value);
        assert!(ga.history().windows(2).all(|w| w[1].best <= w[0].best), "elitism: the best never worsens");
        assert_eq!(ga.history().last().expect("ran").calls, 8000, "calls are counted");
        assert!(ga.ranked().windows(2).all(|w| w[0].value <= w[1].value && w[0].gene != w[1].gene), "ranked, distinct");
    }

    #[test]
    fn the_three_ways_to_stop() {
        let mut s = settings(2, 1);
        s.target = 1.0;
        assert_eq!(run(Genetic::new(s.clone()).expect("valid")).stopped(), Some(Stop::Target), "target");
        s.target = 0.0;
        s.patience = 3;
        assert_eq!(run(Genetic::new(s.clone()).expect("valid")).stopped(), Some(Stop::Patience), "patience");
        s.patience = 1000;
        s.generations = 4;
        let ga = run(Genetic::new(s).expect("valid"));
        assert_eq!((ga.stopped(), ga.history().len()), (Some(Stop::Generations), 4), "generations");
    }

    #[test]
    fn what_is_remembered_differs_as_asked() {
        let mut s = settings(2, 3);
        s.distinct = 0.1;
        let ga = run(Genetic::new(s).expect("valid"));
        assert_eq!(ga.ranked().len(), 5, "enough are found");
        for (i, a) in ga.ranked().iter().enumerate() {
            for b in &ga.ranked()[i + 1..] {
                let far = a.x.iter().zip(&b.x).any(|(a, b)| (a - b).abs() > 0.1 * 10.0);
                assert!(far && a.value <= b.value, "{a:?} and {b:?}");
            }
        }
        assert_eq!(ga.ranked()[0].value, ga.history().last().expect("ran").best, "the best is always there");
    }

    #[test]
    fn crossover_moves_every_bit_once() {
        for bits in [1, 7, 32] {
            let full = if bits == 32 { u32::MAX } else { (1 << bits) - 1 };
            for from in 0..3 * bits {
                for to in from..=3 * bits {
                    let (mut a, mut b) = (vec![0; 3], vec![full; 3]);
                    swap_bits(&mut a, &mut b, from, to, bits);
                    let ones: u32 = a.iter().map(|w| w.count_ones()).sum();
                    assert_eq!(ones, to - from, "{bits} bits, {from}..{to}");
                    assert!(a.iter().zip(&b).all(|(a, b)| a ^ b == full), "nothing is lost");
                }
            }
        }
    }

    #[test]
    fn nan_is_never_chosen_and_nonsense_is_refused() {
        let mut ga = Genetic::new(settings(1, 2)).expect("valid");
        let mut values = vec![f64::NAN; 40];
        values[7] = 0.5;
        ga.tell(&values).expect("right shape");
        assert_eq!(ga.ranked().len(), 1, "only the number is kept");
        assert!(ga.tell(&[1.0]).is_err(), "wrong length");
        assert!(ga.tell(&[-1.0; 40]).is_err(), "negative objective");
        let mut s = settings(1, 1);
        s.bounds[0] = (1.0, f64::NAN);
        assert!(Genetic::new(s).is_err(), "NaN bound");
    }
}

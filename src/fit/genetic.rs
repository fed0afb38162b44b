//! The genetic algorithm of section 4.2 (after Goldberg 1989), for any objective that is at least 0.
//!
//! Each parameter is quantised to `bits` bits between its bounds; the strings are joined to one gene. Fitness is
//! `1 / (1 + O)`, selection by roulette wheel, crossover at two points of the whole gene, mutation bit by bit, and the
//! best individual is carried over unchanged. It ends when the objective reaches a target, when the best has not
//! changed for `patience` generations, or after `generations`.
//!
//! The paper leaves open the mutation rate (here by default one bit of a gene on average), the crossover rate (0.9) and
//! the selection (roulette). Two-point crossover and elitism are its own.

use super::search::{Record, Search, SearchSettings, Stop};
use crate::error::{Error, Result, in_range};
use crate::math::random::Stream;

/// The rates of the algorithm.
#[derive(Debug, Clone, Copy)]
pub struct Rates {
    /// Bits of a parameter, at most 32.
    pub bits: u32,
    /// Probability that a pair is crossed.
    pub crossover: f64,
    /// Probability that a bit flips.
    pub mutation: f64,
}

impl Rates {
    fn validate(&self) -> Result<()> {
        in_range("bits", f64::from(self.bits), 1.0, 32.0, "1")?;
        in_range("crossover", self.crossover, 0.0, 1.0, "1")?;
        in_range("mutation", self.mutation, 0.0, 1.0, "1")
    }
}

/// The state of a search.
#[derive(Debug, Clone)]
pub struct Genetic {
    rates: Rates,
    genes: Vec<Vec<u32>>,
    best: Option<(Vec<u32>, f64)>,
    record: Record,
}

impl Genetic {
    /// A random first generation.
    pub fn new(settings: SearchSettings, rates: Rates) -> Result<Self> {
        rates.validate()?;
        let random = Stream::new(settings.key, 0);
        let record = Record::new(settings)?;
        let settings = record.settings();
        let dimension = settings.bounds.len();
        let genes = (0..settings.population)
            .map(|i| (0..dimension).map(|j| (random.bits((i * dimension + j) as u64) >> 32) as u32).collect())
            .map(|gene: Vec<u32>| gene.into_iter().map(|g| g >> (32 - rates.bits)).collect())
            .collect();
        Ok(Self { rates, genes, best: None, record })
    }

    fn decode(&self, gene: &[u32]) -> Vec<f64> {
        let steps = (2.0_f64).powi(self.rates.bits as i32) - 1.0;
        gene.iter()
            .zip(&self.record.settings().bounds)
            .map(|(&g, &(low, high))| (low + (high - low) * (f64::from(g) / steps)).clamp(low, high))
            .collect()
    }

    fn breed(&mut self, values: &[f64]) {
        let random = Stream::new(self.record.settings().key, self.record.history().len() as u64);
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
        let dimension = self.record.settings().bounds.len();
        let length = dimension as u32 * self.rates.bits;
        let mut next: Vec<Vec<u32>> = Vec::with_capacity(values.len());
        if let Some((gene, _)) = &self.best {
            next.push(gene.clone());
        }
        while next.len() < values.len() {
            let mut a = self.genes[pick(draw())].clone();
            let mut b = self.genes[pick(draw())].clone();
            if draw() < self.rates.crossover {
                let (p, q) = ((draw() * f64::from(length)) as u32, (draw() * f64::from(length)) as u32);
                swap_bits(&mut a, &mut b, p.min(q), p.max(q), self.rates.bits);
            }
            for gene in [&mut a, &mut b] {
                for word in gene.iter_mut() {
                    for bit in 0..self.rates.bits {
                        if draw() < self.rates.mutation {
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
}

impl Search for Genetic {
    fn ask(&self) -> Vec<Vec<f64>> {
        self.genes.iter().map(|gene| self.decode(gene)).collect()
    }

    fn tell(&mut self, values: &[f64]) -> Result<()> {
        if let Some(&bad) = values.iter().find(|&&v| v < 0.0) {
            let reason = format!("must be at least 0 (fitness is 1 / (1 + O)), got {bad}; add a constant");
            return Err(Error::Data { name: "objective", reason });
        }
        self.record.take(&self.ask(), values)?;
        if self.record.weary() {
            self.record.end(Stop::Patience);
        }
        for (gene, &value) in self.genes.iter().zip(values) {
            if !value.is_nan() && self.best.as_ref().is_none_or(|(_, best)| value < *best) {
                self.best = Some((gene.clone(), value));
            }
        }
        if self.record.stopped().is_none() {
            self.breed(values);
        }
        Ok(())
    }

    fn record(&self) -> &Record {
        &self.record
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

    fn settings(dimension: usize, key: u64) -> SearchSettings {
        SearchSettings {
            bounds: vec![(-5.0, 5.0); dimension],
            scales: Vec::new(),
            population: 40,
            generations: 200,
            target: 0.0,
            patience: 200,
            n_best: 5,
            min_separation: 0.0,
            key,
        }
    }

    fn start(settings: SearchSettings) -> Result<Genetic> {
        let mutation = 1.0 / (32.0 * settings.bounds.len() as f64);
        Genetic::new(settings, Rates { bits: 32, crossover: 0.9, mutation })
    }

    fn sphere(x: &[f64]) -> f64 {
        x.iter().map(|v| (v - 1.0).powi(2)).sum()
    }

    fn run(mut ga: Genetic) -> Genetic {
        while ga.record().stopped().is_none() {
            let values: Vec<f64> = ga.ask().iter().map(|x| sphere(x)).collect();
            ga.tell(&values).expect("right shape");
        }
        ga
    }

    #[test]
    fn it_finds_the_bottom_of_a_bowl_and_never_loses_it() {
        let ga = run(start(settings(2, 1)).expect("valid"));
        assert!(
            ga.record().ranked()[0].value < 0.2 * ga.record().history()[0].best,
            "best {}",
            ga.record().ranked()[0].value
        );
        assert!(ga.record().history().windows(2).all(|w| w[1].best <= w[0].best), "elitism: the best never worsens");
        assert_eq!(ga.record().history().last().expect("ran").calls, 8000, "calls are counted");
        assert!(
            ga.record().ranked().windows(2).all(|w| w[0].value <= w[1].value && w[0].x != w[1].x),
            "ranked, distinct"
        );
    }

    #[test]
    fn the_three_ways_to_stop() {
        let mut s = settings(2, 1);
        s.target = 1.0;
        assert_eq!(run(start(s.clone()).expect("valid")).record().stopped(), Some(Stop::Target), "target");
        s.target = 0.0;
        s.patience = 3;
        assert_eq!(run(start(s.clone()).expect("valid")).record().stopped(), Some(Stop::Patience), "patience");
        s.patience = 1000;
        s.generations = 4;
        let ga = run(start(s).expect("valid"));
        assert_eq!((ga.record().stopped(), ga.record().history().len()), (Some(Stop::Generations), 4), "generations");
    }

    #[test]
    fn what_is_remembered_differs_as_asked() {
        let mut s = settings(2, 3);
        s.min_separation = 0.1;
        let ga = run(start(s).expect("valid"));
        assert_eq!(ga.record().ranked().len(), 5, "enough are found");
        for (i, a) in ga.record().ranked().iter().enumerate() {
            for b in &ga.record().ranked()[i + 1..] {
                let far = a.x.iter().zip(&b.x).any(|(a, b)| (a - b).abs() > 0.1 * 10.0);
                assert!(far && a.value <= b.value, "{a:?} and {b:?}");
            }
        }
        assert_eq!(
            ga.record().ranked()[0].value,
            ga.record().history().last().expect("ran").best,
            "the best is always there"
        );
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
        let mut ga = start(settings(1, 2)).expect("valid");
        let mut values = vec![f64::NAN; 40];
        values[7] = 0.5;
        ga.tell(&values).expect("right shape");
        assert_eq!(ga.record().ranked().len(), 1, "only the number is kept");
        assert!(ga.tell(&[1.0]).is_err(), "wrong length");
        assert!(ga.tell(&[-1.0; 40]).is_err(), "negative objective");
        let mut s = settings(1, 1);
        s.bounds[0] = (1.0, f64::NAN);
        assert!(start(s).is_err(), "NaN bound");
    }
}

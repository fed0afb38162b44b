//! Counter-based random numbers (floor 0): a value is a pure function of (key, purpose, index), so results depend on
//! neither the number of threads nor the order of evaluation.
//!
//! The mixer is SplitMix64's finaliser (Steele, Lea and Flood 2014) applied twice over the combined words: enough for
//! noise lattices and genetic operators, with no state to pass around.

/// A stream of random numbers for one purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stream {
    key: u64,
}

#[inline(always)]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

impl Stream {
    /// The stream of `purpose` under `key`. Different purposes give independent streams.
    #[inline(always)]
    pub fn new(key: u64, purpose: u64) -> Self {
        Self { key: mix(key ^ mix(purpose.wrapping_add(0x9E37_79B9_7F4A_7C15))) }
    }

    /// 64 random bits at `index`.
    #[inline(always)]
    pub fn bits(self, index: u64) -> u64 {
        mix(mix(self.key ^ index.wrapping_mul(0x9E37_79B9_7F4A_7C15)).wrapping_add(index))
    }

    /// Uniform in `[0, 1)` with 53 bits.
    #[inline(always)]
    pub fn uniform(self, index: u64) -> f64 {
        (self.bits(index) >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Uniform integer in `0..below` by multiplication (bias below `below / 2^64`).
    #[inline(always)]
    pub fn below(self, index: u64, below: u64) -> u64 {
        ((u128::from(self.bits(index)) * u128::from(below)) >> 64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_and_correlation_are_those_of_a_uniform() {
        let (a, b) = (Stream::new(7, 1), Stream::new(7, 2));
        let n = 200_000_u64;
        let (mut m, mut v, mut lag, mut cross) = (0.0, 0.0, 0.0, 0.0);
        for i in 0..n {
            let x = a.uniform(i) - 0.5;
            m += x;
            v += x * x;
            lag += x * (a.uniform(i + 1) - 0.5);
            cross += x * (b.uniform(i) - 0.5);
        }
        let n = n as f64;
        // Five standard errors of each statistic.
        assert!((m / n).abs() < 5.0 * (1.0 / 12.0 / n).sqrt(), "mean");
        assert!((v / n - 1.0 / 12.0).abs() < 5.0 * (1.0 / 180.0 / n).sqrt(), "variance");
        assert!((lag / n).abs() < 5.0 / 12.0 / n.sqrt(), "lag-1 correlation");
        assert!((cross / n).abs() < 5.0 / 12.0 / n.sqrt(), "two purposes are independent");
    }

    #[test]
    fn every_bit_is_fair() {
        let s = Stream::new(0, 0);
        let n = 100_000_u64;
        for bit in 0..64 {
            let ones = (0..n).filter(|&i| s.bits(i) >> bit & 1 == 1).count() as f64;
            assert!((ones / n as f64 - 0.5).abs() < 5.0 * 0.5 / (n as f64).sqrt(), "bit {bit}");
        }
    }

    #[test]
    fn below_stays_below_and_reaches_all() {
        let s = Stream::new(3, 9);
        let mut seen = [false; 7];
        for i in 0..1000 {
            seen[s.below(i, 7) as usize] = true;
        }
        assert!(seen.iter().all(|&x| x), "all seven values come up");
    }
}

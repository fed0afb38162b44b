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

    /// Normal with mean 0 and deviation 1, cut off at three deviations (whose own deviation is 0.986577): the quantile
    /// of one uniform, so there is nothing to reject.
    #[inline(always)]
    pub fn normal3(self, index: u64) -> f64 {
        // Probability below -3.
        const TAIL: f64 = 1.349_898_031_630_095e-3;
        normal_quantile(TAIL + (1.0 - 2.0 * TAIL) * self.uniform(index))
    }

    /// Uniform integer in `0..below` by multiplication (bias below `below / 2^64`).
    #[inline(always)]
    pub fn below(self, index: u64, below: u64) -> u64 {
        ((u128::from(self.bits(index)) * u128::from(below)) >> 64) as u64
    }
}

/// Quantile of the normal distribution for a probability in `[1e-10, 1 - 1e-10]`, to 1e-15 relative: algorithm AS 241,
/// PPND16 (Wichura 1988).
pub fn normal_quantile(probability: f64) -> f64 {
    const A: [f64; 8] = [
        3.387_132_872_796_366_608,
        133.141_667_891_784_377_45,
        1_971.590_950_306_551_442_7,
        13_731.693_765_509_461_125,
        45_921.953_931_549_871_457,
        67_265.770_927_008_700_853,
        33_430.575_583_588_128_105,
        2_509.080_928_730_122_672_7,
    ];
    const B: [f64; 8] = [
        1.0,
        42.313_330_701_600_911_252,
        687.187_007_492_057_908_3,
        5_394.196_021_424_751_107_7,
        21_213.794_301_586_595_867,
        39_307.895_800_092_710_61,
        28_729.085_735_721_942_674,
        5_226.495_278_852_854_561,
    ];
    const C: [f64; 8] = [
        1.423_437_110_749_683_577_34,
        4.630_337_846_156_545_295_9,
        5.769_497_221_460_691_405_5,
        3.647_848_324_763_204_605_04,
        1.270_458_252_452_368_382_58,
        0.241_780_725_177_450_611_77,
        0.022_723_844_989_269_184_583_3,
        7.745_450_142_783_414_076_4e-4,
    ];
    const D: [f64; 8] = [
        1.0,
        2.053_191_626_637_758_821_87,
        1.676_384_830_183_803_849_4,
        0.689_767_334_985_100_004_55,
        0.148_103_976_427_480_074_59,
        0.015_198_666_563_616_457_196_6,
        5.475_938_084_995_344_946e-4,
        1.050_750_071_644_416_843_24e-9,
    ];
    let series = |k: &[f64; 8], x: f64| k.iter().rev().fold(0.0, |sum, &c| sum * x + c);
    let q = probability - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180625 - q * q;
        return q * series(&A, r) / series(&B, r);
    }
    let r = (-(if q < 0.0 { probability } else { 1.0 - probability }).ln()).sqrt() - 1.6;
    (series(&C, r) / series(&D, r)).copysign(q)
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
    fn quantiles_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.5 and the usual limits.
        for (p, want) in [
            (0.5, 0.0),
            (0.975, 1.959_963_984_540_054),
            (0.841_344_746_068_542_9, 1.0),
            (1.349_898_031_630_095e-3, -3.0),
            (0.9, 1.281_551_565_544_600_4),
        ] {
            assert!((normal_quantile(p) - want).abs() < 2e-15 * (1.0 + want.abs()), "{p}: {}", normal_quantile(p));
        }
    }

    #[test]
    fn moments_of_the_cut_off_normal() {
        let s = Stream::new(11, 5);
        let n = 200_000_u64;
        let (mut m, mut v, mut largest) = (0.0, 0.0, 0.0_f64);
        for i in 0..n {
            let x = s.normal3(i);
            m += x;
            v += x * x;
            largest = largest.max(x.abs());
        }
        let n = n as f64;
        // Variance 1 - 6 phi(3) / (2 Phi(3) - 1).
        let variance = 1.0 - 6.0 * 0.004_431_848_411_938_008 / 0.997_300_203_936_739_8;
        assert!(largest <= 3.0 + 1e-12, "{largest}");
        assert!((m / n).abs() < 5.0 * (variance / n).sqrt(), "mean");
        assert!((v / n - variance).abs() < 5.0 * (1.9 / n).sqrt(), "variance {}", v / n);
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

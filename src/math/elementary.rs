//! Branch-free elementary functions with a stated error (floor 0).
//!
//! Loops over these vectorise at every SIMD level and give the same bits at each: only add, multiply, square root,
//! compare, select and integer operations are used. The coefficients are Chebyshev interpolants and minimax fits,
//! rounded once; the errors below are the largest seen by the tests of this file against `f64` libm.
//!
//! | function | range | largest relative error |
//! |---|---|---|
//! | [`exp`] | `[-87, 88]` | 1.5e-7 |
//! | [`exp64`] | `[-700, 700]` | 3e-16 |
//! | [`Real::root_12_5`], `f32` and `f64` | positive and normal | 1.8e-7, 7e-16 |
//! | [`Real::power_12_5`], `f32` and `f64` | `[2^-50, MAX]` | 2.3e-7, 1.2e-15 |
//! | [`Real::cbrt`], `f32` and `f64` | all | 1.2e-7, 5e-16 |
//!
//! A power of an `f32` starts from the bits, whose integer is about the logarithm: `z`, within 10 % of a negative power
//! of `x`. Products of `x` and `z` give both a first guess and `1 + d`, the power of its error that needs no root; one
//! polynomial in `d` takes the error away. Six coefficients reach the last bits, because the degree of the root divides
//! the rounding of `d`. The degree is too high for 53 bits: a power of an `f64` is `x^p = m^p 2^(p e)` with `x = m 2^e`
//! and `m` in `[sqrt(1/2), sqrt(2))`: one polynomial in `m - 1` for the given `p`, and no division, unlike a logarithm
//! followed by an exponential. There `p e` is a multiple of 1/12, 1/5 or 1/3, so its fractional part is an exact small
//! integer over that denominator.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `e^x` in single precision: below -87.3 it is 0, above 88.7 infinite, NaN for NaN.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    const LOG2_E: f32 = std::f32::consts::LOG2_E;
    // ln 2 in two pieces: the first has 9 trailing zero bits, so k * HI is exact for |k| < 512.
    const LN2_HI: f32 = 0.693_359_4;
    const LN2_LO: f32 = -2.121_944_4e-4;
    const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23: adding it rounds to an integer kept in the low mantissa bits
    let clamped = if x > 88.8 { 88.8 } else { x };
    let clamped = if clamped < -87.4 { -87.4 } else { clamped };
    let shifted = clamped * LOG2_E + MAGIC;
    let k = shifted - MAGIC;
    let r = (clamped - k * LN2_HI) - k * LN2_LO;
    let mut p = 1.987_569_15e-4_f32;
    p = p * r + 1.398_199_95e-3;
    p = p * r + 8.333_452e-3;
    p = p * r + 4.166_579_6e-2;
    p = p * r + 1.666_666_5e-1;
    p = p * r + 0.5;
    let y = (p * r) * r + r + 1.0;
    // 2^k as two factors, so that the ends of the range neither overflow nor vanish too soon.
    let n = (shifted.to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32);
    let half = n >> 1;
    let a = f32::from_bits(((half + 127) << 23) as u32);
    let b = f32::from_bits(((n - half + 127) << 23) as u32);
    let result = y * a * b;
    let result = if x < -87.336_54 { 0.0 } else { result };
    let result = if x > 88.722_84 { f32::INFINITY } else { result };
    if x.is_nan() { x } else { result }
}

/// `e^x` in double precision; the exponent is clamped to `[-700, 700]`, NaN is kept.
#[inline(always)]
pub fn exp64(x: f64) -> f64 {
    const LN2_HI: f64 = 6.931_471_803_691_238_2e-1;
    const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;
    /// `1 / k!`.
    const C: [f64; 14] = [
        1.0,
        1.0,
        0.5,
        1.666_666_666_666_666_7e-1,
        4.166_666_666_666_666_4e-2,
        8.333_333_333_333_333e-3,
        1.388_888_888_888_889e-3,
        1.984_126_984_126_984e-4,
        2.480_158_730_158_730_2e-5,
        2.755_731_922_398_589e-6,
        2.755_731_922_398_589_3e-7,
        2.505_210_838_544_172e-8,
        2.087_675_698_786_81e-9,
        1.605_904_383_682_161_3e-10,
    ];
    let x = if x > 700.0 { 700.0 } else { x };
    let x = if x < -700.0 { -700.0 } else { x };
    let n = round_small(x * std::f64::consts::LOG2_E);
    let r = (x - n * LN2_HI) - n * LN2_LO;
    series(&C, r) * two_to(n)
}

/// `f32` and `f64` as the kernels see them: arithmetic, comparison and the fixed powers that colour needs.
#[allow(clippy::return_self_not_must_use, reason = "arithmetic, whose results nobody drops")]
pub trait Real:
    Copy
    + Debug
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// Not a number.
    const NAN: Self;

    /// The nearest number of this type.
    fn of(x: f64) -> Self;

    /// The magnitude.
    fn magnitude(self) -> Self;

    /// This magnitude with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// The largest integer not above the number.
    fn floor(self) -> Self;

    /// `x^(5/12)` for positive normal `x`; infinity and NaN are kept. Anything else gives some number.
    fn root_12_5(self) -> Self;

    /// `x^(12/5)` for `x >= 2^-50`, infinite from 0.9 `MAX` on; infinity is kept. Anything else gives some number.
    fn power_12_5(self) -> Self;

    /// The cube root of positive normal `x`; infinity and NaN are kept. Anything else gives some number.
    fn cbrt_normal(self) -> Self;

    /// The cube root of any number: odd, zeros keep their sign.
    fn cbrt(self) -> Self;
}

macro_rules! real {
    ($t:ident, mantissa: $mant:literal) => {
        impl Real for $t {
            const NAN: Self = $t::NAN;

            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }

            #[inline(always)]
            fn magnitude(self) -> Self {
                $t::abs(self)
            }

            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                $t::copysign(self, sign)
            }

            #[inline(always)]
            fn floor(self) -> Self {
                // From here on every number is an integer.
                const INTEGER: $t = (1_u64 << $mant) as $t;
                const MAGIC: $t = 1.5 * INTEGER;
                // The standard floor is a call on the lowest SIMD level, which has no such instruction.
                let rounded = (self + MAGIC) - MAGIC;
                let down = if rounded > self { rounded - 1.0 } else { rounded };
                // NaN is kept too.
                if self.abs() < INTEGER { down } else { self }
            }

            #[inline(always)]
            fn root_12_5(self) -> Self {
                let y = Powers::root(self);
                if self <= $t::MAX { y } else { self }
            }

            #[inline(always)]
            fn power_12_5(self) -> Self {
                Powers::power(self)
            }

            #[inline(always)]
            fn cbrt_normal(self) -> Self {
                let y = Powers::cube_root(self);
                if self <= $t::MAX { y } else { self }
            }

            #[inline(always)]
            fn cbrt(self) -> Self {
                let x = self.abs();
                let small = x < $t::MIN_POSITIVE;
                let y = if small { x * 1_152_921_504_606_846_976.0 } else { x }.cbrt_normal(); // 2^60
                let y = if small { y * (1.0 / 1_048_576.0) } else { y };
                let y = if x == 0.0 { x } else { y };
                y.copysign(self)
            }
        }
    };
}

real!(f32, mantissa: 23);
real!(f64, mantissa: 52);

/// The powers of positive normal numbers; other numbers give anything.
trait Powers {
    /// `x^(5/12)`.
    fn root(self) -> Self;

    /// `x^(12/5)`, which may overflow.
    fn power(self) -> Self;

    /// `x^(1/3)`.
    fn cube_root(self) -> Self;
}

/// `x^(-p)` within 10 %, exactly 1 at 1, for positive normal `x` and `p` in `(0, 1)`: the bits of a float are about its
/// logarithm. `scale` is `-p / 2^9` and `offset` is `2^23 + 127 (1 + p) 2^14`.
#[inline(always)]
fn rough(x: f32, scale: f32, offset: f32) -> f32 {
    // The sum is in [2^23, 2^24), so its low bits are an integer; the shift drops the others.
    f32::from_bits((x.to_bits() as i32 as f32 * scale + offset).to_bits() << 9)
}

impl Powers for f32 {
    #[inline(always)]
    fn root(self) -> Self {
        const C: [f32; 6] = [-0.16666583, 0.09718596, -0.06968682, 0.05193604, -0.03282023, 0.01166367];
        let s = self.sqrt();
        // From x rather than from its root, which takes long.
        let z = rough(self, -1.0 / 6144.0, 10_642_773.0);
        let y = s * z;
        let cube = z * z * z;
        let d = cube * cube * s - 1.0;
        y + (y * d) * short(&C, d)
    }

    #[inline(always)]
    fn power(self) -> Self {
        const C: [f32; 7] = [-0.19999954, 0.11997954, -0.08768678, 0.06807325, -0.04948488, 0.027257605, -0.0077355383];
        let z = rough(self, -0.6 / 512.0, 11_717_837.0);
        let y = self * z;
        let fifth = y * z;
        let d = fifth * fifth * y - 1.0;
        let y = self * self * y;
        // A tenth too large: infinite from 3.0e38 on.
        if y <= f32::MAX { y + (y * d) * short(&C, d) } else { y }
    }

    #[inline(always)]
    fn cube_root(self) -> Self {
        const C: [f32; 6] = [-0.33333284, 0.22219329, -0.17227104, 0.13878495, -0.09922538, 0.04260747];
        let z = rough(self, -2.0 / 1536.0, 11_856_555.0);
        let y = self * z;
        let d = y * z * y - 1.0;
        y + (y * d) * short(&C, d)
    }
}

/// The polynomial with these coefficients, lowest first, as two chains so that the latency halves.
#[inline(always)]
pub(super) fn series<T: Real, const N: usize>(c: &[T; N], x: T) -> T {
    let square = x * x;
    let mut even = c[(N - 1) / 2 * 2];
    let mut odd = c[N / 2 * 2 - 1];
    for k in (0..(N - 1) / 2).rev() {
        even = even * square + c[2 * k];
    }
    for k in (0..N / 2 - 1).rev() {
        odd = odd * square + c[2 * k + 1];
    }
    odd * x + even
}

/// The polynomial with these coefficients, lowest first, by Estrin: a short chain, because these loops wait for it.
#[inline(always)]
fn short<const N: usize>(c: &[f32; N], x: f32) -> f32 {
    let square = x * x;
    let high = if N == 7 { (c[4] + c[5] * x) + square * c[6] } else { c[4] + c[5] * x };
    ((c[0] + c[1] * x) + square * (c[2] + c[3] * x)) + (square * square) * high
}

/// `2^mantissa`.
const INTEGER: f64 = (1_u64 << 52) as f64;
const MAGIC: f64 = 1.5 * INTEGER;

/// The nearest integer of a number below `2^50`.
#[inline(always)]
fn round_small(x: f64) -> f64 {
    (x + MAGIC) - MAGIC
}

/// `x = 2^e (1 + t)` with `1 + t` in `[sqrt(1/2), sqrt(2))`, for positive normal `x`.
#[inline(always)]
fn split(x: f64) -> (f64, f64) {
    const HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    let u = x.to_bits().wrapping_sub(HALF).wrapping_add(1023 << 52);
    // An integer below 2^52 becomes a float by its bits: there is no vector cast from 64 bits.
    let e = f64::from_bits((u >> 52) | INTEGER.to_bits()) - (INTEGER + 1023.0);
    let m = f64::from_bits((u & ((1 << 52) - 1)) + HALF);
    (e, m - 1.0)
}

/// `2^n` for an integer `n` among the exponents.
#[inline(always)]
fn two_to(n: f64) -> f64 {
    f64::from_bits(((n + MAGIC).to_bits() << 52).wrapping_add(1023 << 52))
}

impl Powers for f64 {
    #[inline(always)]
    fn root(self) -> Self {
        /// `((1 + t)^(5/12) - 1) / t`.
        const C: [f64; 18] = [
            0.4166666666666665,
            -0.12152777777777736,
            0.06413966049401684,
            -0.041423530735991795,
            0.02968686365257226,
            -0.022677465225787168,
            0.018087981683649803,
            -0.014884908065281413,
            0.012541771509561242,
            -0.010764699886385723,
            0.009381442016795664,
            -0.008282407849379808,
            0.007343793948116672,
            -0.006477878061534812,
            0.0060509035931921645,
            -0.006427499091663018,
            0.005902025897257344,
            -0.002709956777887483,
        ];
        /// `(2^f - 1) / f` for `f` in `[-1/2, 1/2]`.
        #[allow(clippy::approx_constant, reason = "the first coefficient is the interpolant's, not ln 2")]
        const EXP2: [f64; 11] = [
            0.6931471805599453,
            0.24022650695910097,
            0.0555041086648216,
            0.009618129107606888,
            0.0013333558146416936,
            0.0001540353044173605,
            1.525273382983612e-05,
            1.321544258792169e-06,
            1.0178062445845774e-07,
            7.072585949269223e-09,
            4.4549605981865186e-10,
        ];
        let (e, t) = split(self);
        let e5 = e * 5.0;
        let n = round_small(e5 * (1.0 / 12.0));
        let f = (e5 - 12.0 * n) * (1.0 / 12.0);
        (t * series(&C, t) + 1.0) * (f * series(&EXP2, f) + 1.0) * two_to(n)
    }

    #[inline(always)]
    fn power(self) -> Self {
        /// `((1 + t)^(12/5) - 1) / t`.
        const C: [f64; 17] = [
            2.4,
            1.6799999999999995,
            0.22400000000000367,
            -0.03359999999977378,
            0.010751999999047796,
            -0.00465920002513252,
            0.0023961600975433792,
            -0.0013777907979286871,
            0.0008572879082450809,
            -0.0005658412033983555,
            0.0003910560805254084,
            -0.00027986514446875816,
            0.00020502090804627344,
            -0.0001572719602204409,
            0.0001342416940181128,
            -0.00010729882106679467,
            4.696718071066436e-05,
        ];
        let (e, t) = split(self);
        let n = round_small(e * 2.4);
        let k = e * 12.0 - n * 5.0;
        // Twice 2^(k/5), because half of 2^n is still finite where 2^n is not.
        let c = if k == 1.0 { 2.297_396_709_994_070_013_6 } else { 2.0 };
        let c = if k == 2.0 { 2.639_015_821_545_788_518_7 } else { c };
        let c = if k == -1.0 { 1.741_101_126_592_248_278_3 } else { c };
        let c = if k == -2.0 { 1.515_716_566_510_398_082_3 } else { c };
        let n = n - 1.0;
        // The exponent after the largest is the pattern of infinity.
        let n = if n > 1024.0 { 1024.0 } else { n };
        (t * series(&C, t) + 1.0) * c * two_to(n)
    }

    #[inline(always)]
    fn cube_root(self) -> Self {
        /// `(cbrt(1 + t) - 1) / t`.
        const C: [f64; 18] = [
            0.33333333333333315,
            -0.11111111111111063,
            0.0617283950619464,
            -0.041152263374940594,
            0.03017832642719043,
            -0.02347203159206782,
            0.019001172418191624,
            -0.015834317762024337,
            0.013488329917802503,
            -0.011689518024539405,
            0.010276177085082806,
            -0.009144137058789763,
            0.008164822947875785,
            -0.007246142773494088,
            0.006814695802386982,
            -0.007295354353080822,
            0.006734069752887187,
            -0.003099801045308428,
        ];
        let (e, t) = split(self);
        let n = round_small(e * (1.0 / 3.0));
        let k = e - n * 3.0;
        let c = if k == 1.0 { 1.259_921_049_894_873_164_8 } else { 1.0 };
        let c = if k == -1.0 { 0.793_700_525_984_099_737_38 } else { c };
        (t * series(&C, t) + 1.0) * (c * two_to(n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_within_its_error_bound() {
        let mut worst = 0.0_f64;
        for i in 0..=3_500_000 {
            let x = -87.0_f32 + i as f32 * 5e-5;
            let exact = f64::from(x).exp();
            worst = worst.max((f64::from(exp(x)) - exact).abs() / exact);
        }
        assert!(worst < 1.5e-7, "relative error {worst:e}");
        assert_eq!(exp(0.0), 1.0, "exact at zero");
        assert_eq!(exp(-1e30), 0.0, "vanishes");
        assert_eq!(exp(f32::NEG_INFINITY), 0.0, "vanishes");
        assert_eq!(exp(1e30), f32::INFINITY, "overflows");
        assert!(exp(f32::NAN).is_nan(), "NaN propagates");
    }

    #[test]
    fn double_exp_is_within_its_error_bound() {
        let mut worst = 0.0_f64;
        for i in 0..=1_400_000 {
            let x = f64::from(i) * 1e-3 - 700.0;
            worst = worst.max((exp64(x) / x.exp() - 1.0).abs());
        }
        assert!(worst < 3e-16 * 1.5, "relative error {worst:e}");
        assert_eq!(exp64(0.0), 1.0, "exact at zero");
        assert_eq!(exp64(-1e30), exp64(-700.0), "clamped");
        assert!(exp64(f64::NAN).is_nan(), "NaN propagates");
    }

    /// Largest relative error of `f` against `exact` over `n` numbers spread evenly in exponent over `[2^low, 2^high]`.
    fn worst<T: Real + Into<f64>>(low: f64, high: f64, n: u32, f: impl Fn(T) -> T, exact: impl Fn(f64) -> f64) -> f64 {
        (0..=n)
            .map(|i| {
                let x = T::of((low + (high - low) * f64::from(i) / f64::from(n)).exp2());
                let e = exact(x.into());
                (f(x).into() - e).abs() / e
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn powers_are_within_their_error_bounds() {
        let n = 2_000_000;
        let power = |p: f64| move |x: f64| x.powf(p);
        for (name, got, bound) in [
            ("root f32", worst::<f32>(-125.0, 127.0, n, Real::root_12_5, power(5.0 / 12.0)), 1.8e-7),
            ("power f32", worst::<f32>(-50.0, 53.0, n, Real::power_12_5, power(2.4)), 2.3e-7),
            ("cbrt f32", worst::<f32>(-149.0, 127.9, n, Real::cbrt, f64::cbrt), 1.2e-7),
            ("root f64", worst::<f64>(-20.0, 20.0, n, Real::root_12_5, power(5.0 / 12.0)), 7e-16),
            ("power f64", worst::<f64>(-8.0, 8.0, n, Real::power_12_5, power(2.4)), 1.2e-15),
            ("cbrt f64", worst::<f64>(-1060.0, 1023.9, n, Real::cbrt, f64::cbrt), 5e-16),
        ] {
            println!("{name}: {got:e}");
            assert!(got < bound, "{name}: relative error {got:e}, bound {bound:e}");
        }
    }

    #[test]
    fn powers_keep_the_ends() {
        fn ends<T: Real + Into<f64>>(largest: f64) {
            let get = |f: fn(T) -> T, x: f64| -> f64 { f(T::of(x)).into() };
            for f in [T::root_12_5, T::power_12_5, T::cbrt, T::cbrt_normal] {
                assert_eq!(get(f, 1.0), 1.0, "exact at one");
                assert_eq!(get(f, f64::INFINITY), f64::INFINITY, "infinity");
            }
            for f in [T::root_12_5, T::cbrt, T::cbrt_normal] {
                assert!(get(f, f64::NAN).is_nan(), "NaN propagates");
            }
            assert_eq!(get(T::power_12_5, largest), f64::INFINITY, "overflows");
            assert_eq!(get(T::power_12_5, 32.0), 4096.0, "a power of two");
            assert_eq!(get(T::root_12_5, 4096.0), 32.0, "a power of two");
            assert_eq!(get(T::cbrt, -8.0), -2.0, "odd");
            assert_eq!(get(T::cbrt, f64::NEG_INFINITY), f64::NEG_INFINITY, "odd");
            assert!(get(T::cbrt, -0.0).is_sign_negative(), "the sign of zero");
            assert_eq!(get(T::cbrt, 0.0), 0.0, "zero");
            for (x, floor) in
                [(-0.25, -1.0), (0.75, 0.0), (-3.0, -3.0), (2.5, 2.0), (-1e7, -1e7), (2f64.powi(60), 2f64.powi(60))]
            {
                assert_eq!(get(T::floor, x), f64::from(floor as f32), "floor of {x}");
            }
            assert!(get(T::floor, f64::NAN).is_nan(), "NaN propagates");
        }
        ends::<f32>(3e38);
        ends::<f64>(1e300);
    }
}

//! Improved Perlin noise in three dimensions (Perlin 2002), seeded (floor 0).
//!
//! The lattice gradients are the twelve edge vectors, chosen by a counter-based hash of the lattice point, so the noise
//! does not repeat and needs no permutation table. Range about `[-1, 1]`; zero at lattice points.

use super::random::Stream;

/// Seeded gradient noise.
#[derive(Debug, Clone, Copy)]
pub struct Perlin {
    stream: Stream,
}

#[inline(always)]
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

#[inline(always)]
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

impl Perlin {
    /// Noise of one key and purpose.
    pub fn new(key: u64, purpose: u64) -> Self {
        Self { stream: Stream::new(key, purpose) }
    }

    #[inline(always)]
    fn gradient(self, i: i64, j: i64, k: i64, x: f64, y: f64, z: f64) -> f64 {
        let cell = (i as u64 & 0x1F_FFFF) | (j as u64 & 0x1F_FFFF) << 21 | (k as u64 & 0x1F_FFFF) << 42;
        // Sixteen equally likely choices: the twelve edges of a cube, four of them twice (Perlin 2002).
        match self.stream.bits(cell) >> 60 {
            0 | 12 => x + y,
            1 | 13 => -x + y,
            2 => x - y,
            3 => -x - y,
            4 => x + z,
            5 => -x + z,
            6 => x - z,
            7 => -x - z,
            8 => y + z,
            9 | 14 => -y + z,
            10 => y - z,
            _ => -y - z,
        }
    }

    /// The noise at a point.
    pub fn at(self, x: f64, y: f64, z: f64) -> f64 {
        let (fx, fy, fz) = (x.floor(), y.floor(), z.floor());
        let (i, j, k) = (fx as i64, fy as i64, fz as i64);
        let (x, y, z) = (x - fx, y - fy, z - fz);
        let (u, v, w) = (fade(x), fade(y), fade(z));
        let corner =
            |a: i64, b: i64, c: i64| self.gradient(i + a, j + b, k + c, x - a as f64, y - b as f64, z - c as f64);
        let low = lerp(lerp(corner(0, 0, 0), corner(1, 0, 0), u), lerp(corner(0, 1, 0), corner(1, 1, 0), u), v);
        let high = lerp(lerp(corner(0, 0, 1), corner(1, 0, 1), u), lerp(corner(0, 1, 1), corner(1, 1, 1), u), v);
        lerp(low, high, w)
    }

    /// Fractional Brownian motion: `octaves` of noise, each twice as fine and `gain` times as strong.
    pub fn fbm(self, x: f64, y: f64, z: f64, octaves: u32, gain: f64) -> f64 {
        let (mut sum, mut weight, mut scale) = (0.0, 1.0, 1.0);
        for octave in 0..octaves {
            // Octaves are shifted apart: without it all of them vanish at the same lattice points.
            let shift = 17.17 * f64::from(octave);
            sum += weight * self.at(x * scale + shift, y * scale - shift, z * scale + 0.5 * shift);
            weight *= gain;
            scale *= 2.0;
        }
        sum
    }
}

/// A well mixed hash of 32 bits (Wellons' `lowbias32`).
#[inline(always)]
pub fn mix32(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x7FEB_352D);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846C_A68B);
    h ^ (h >> 16)
}

/// Factors that tell the three coordinates of a lattice point apart.
pub const LATTICE: [u32; 3] = [0x8DA6_B343, 0xD816_3841, 0xCB1A_B31F];

/// An integer below `2^22` in size that is held by a float, as bits.
#[inline(always)]
pub fn bits(integer: f32) -> u32 {
    const MAGIC: f32 = 12_582_912.0; // 1.5 * 2^23
    (integer + MAGIC).to_bits().wrapping_sub(MAGIC.to_bits())
}

/// Improved noise in single precision for SIMD kernels: branch-free, seeded by `key`, coordinates below `2^22` in size.
#[inline(always)]
pub fn perlin32(key: u32, at: [f32; 3]) -> f32 {
    let base = at.map(crate::math::elementary::Real::floor);
    let p = [0, 1, 2].map(|i: usize| at[i] - base[i]);
    let f = p.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let cell = [0, 1, 2].map(|i: usize| bits(base[i]).wrapping_mul(LATTICE[i]));
    let corner = |i: usize, j: usize, k: usize| {
        let offset = [i, j, k];
        let [x, y, z] = [0, 1, 2].map(|c: usize| p[c] - offset[c] as f32);
        let [a, b, c] = [0, 1, 2].map(|c: usize| cell[c].wrapping_add(if offset[c] == 1 { LATTICE[c] } else { 0 }));
        let h = mix32(a ^ b ^ c ^ key) >> 28;
        // Perlin's own choice of the twelve edges, four of them twice, without a branch.
        let u = if h < 8 { x } else { y };
        let v = if h < 4 {
            y
        } else if h == 12 || h == 14 {
            x
        } else {
            z
        };
        let u = if h & 1 == 0 { u } else { -u };
        let v = if h & 2 == 0 { v } else { -v };
        u + v
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let low = mix(mix(corner(0, 0, 0), corner(1, 0, 0), f[0]), mix(corner(0, 1, 0), corner(1, 1, 0), f[0]), f[1]);
    let high = mix(mix(corner(0, 0, 1), corner(1, 0, 1), f[0]), mix(corner(0, 1, 1), corner(1, 1, 1), f[0]), f[1]);
    mix(low, high, f[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_noise_is_noise() {
        let at = |x: f64, y: f64, z: f64| f64::from(perlin32(77, [x as f32, y as f32, z as f32]));
        let (mut sum, mut square, mut peak, n) = (0.0, 0.0, 0.0_f64, 60);
        for i in 0..n * n * n {
            let v =
                at(f64::from(i % n) * 0.377 - 9.0, f64::from(i / n % n) * 0.377 - 3.0, f64::from(i / n / n) * 0.377);
            sum += v;
            square += v * v;
            peak = peak.max(v.abs());
        }
        let n = f64::from(n * n * n);
        assert!((sum / n).abs() < 0.01, "mean {}", sum / n);
        // The mean square of improved noise with Perlin's edges, over a cell and all gradients: about 0.07.
        assert!((0.05..0.09).contains(&(square / n)), "mean square {}", square / n);
        assert!(peak > 0.6 && peak <= 1.04, "range {peak}");
        for i in -3..3 {
            assert_eq!(at(f64::from(i), 4.0, -2.0), 0.0, "zero on the lattice");
            let e = 1e-4;
            let (x, y) = (f64::from(i), 0.3);
            let (left, right) = (at(x, y, 0.7) - at(x - e, y, 0.7), at(x + e, y, 0.7) - at(x, y, 0.7));
            assert!((left - right).abs() < 1e-5, "slopes meet at {x}");
        }
        assert_ne!(perlin32(1, [0.5, 0.3, 0.2]), perlin32(2, [0.5, 0.3, 0.2]), "seeded");
    }

    #[test]
    fn noise_vanishes_on_the_lattice_and_is_smooth_across_it() {
        let noise = Perlin::new(1, 2);
        for i in -3..3 {
            assert_eq!(noise.at(f64::from(i), 4.0, -2.0), 0.0, "lattice point");
        }
        let e = 1e-6;
        for i in -20..20 {
            let x = f64::from(i) * 0.5;
            let step = (noise.at(x + e, 0.3, 0.7) - noise.at(x - e, 0.3, 0.7)).abs();
            assert!(step < 1e-5, "continuous at {x}");
        }
    }

    #[test]
    fn noise_has_zero_mean_and_stays_in_range() {
        let noise = Perlin::new(5, 0);
        let (mut sum, mut peak, n) = (0.0, 0.0_f64, 40);
        for i in 0..n * n * n {
            let at = |k: i32| f64::from(k) * 0.377 + 0.1;
            let v = noise.at(at(i % n), at(i / n % n), at(i / n / n));
            sum += v;
            peak = peak.max(v.abs());
        }
        assert!((sum / f64::from(n * n * n)).abs() < 0.01, "mean");
        assert!(peak > 0.6 && peak <= 1.04, "range {peak}");
    }
}

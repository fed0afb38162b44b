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

#[cfg(test)]
mod tests {
    use super::*;

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

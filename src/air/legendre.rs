//! Legendre moments of phase functions, and the Schmidt semi-normalised associated functions by which a field of light is
//! kept as moments: `P_l(cos angle) = sum over m of S_lm(mu) S_lm(mu') cos(m azimuth)` (addition theorem) (floor 2).
//!
//! Delta-M (Wiscombe 1977): the moment after the last one that is kept is the fraction of the light that goes on as if it
//! had not been scattered.

use crate::math::quadrature::adaptive;

/// Highest degree.
pub const L: usize = 8;
/// Orders in azimuth.
pub const MODES: usize = L + 1;
/// Functions of degrees up to [`L`].
pub const MOMENTS: usize = (L + 1) * (L + 2) / 2;

/// Where order `m` begins: functions lie by order, then by degree.
pub const fn start(m: usize) -> usize {
    m * (2 * L + 3 - m) / 2
}

/// The functions at a cosine.
pub fn schmidt(mu: f64) -> [f32; MOMENTS] {
    let mut out = [0.0; MOMENTS];
    let sine = (1.0 - mu * mu).max(0.0).sqrt();
    let mut diagonal = 1.0;
    for m in 0..=L {
        let order = m as f64;
        if m > 0 {
            diagonal *= sine * if m == 1 { 1.0 } else { ((2.0 * order - 1.0) / (2.0 * order)).sqrt() };
        }
        let (mut before, mut now) = (0.0, diagonal);
        for l in m..=L {
            out[start(m) + l - m] = now as f32;
            let next = (l + 1) as f64;
            let root = |n: f64| (n * n - order * order).max(0.0).sqrt();
            (before, now) = (now, ((2.0 * next - 1.0) * mu * now - root(next - 1.0) * before) / root(next));
        }
    }
    out
}

/// Legendre polynomials up to `L + 1`.
pub fn polynomials(x: f64) -> [f64; L + 2] {
    let mut p = [1.0; L + 2];
    p[1] = x;
    for l in 1..=L {
        let n = l as f64;
        p[l + 1] = ((2.0 * n + 1.0) * x * p[l] - n * p[l - 1]) / (n + 1.0);
    }
    p
}

/// A phase function cut into a forward peak and moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truncated {
    /// Fraction of the light in the peak.
    pub peak: f64,
    /// Moments of the rest, over `2 l + 1`.
    pub chi: [f64; L + 1],
}

impl Truncated {
    /// Of a phase function of mean 1 over the cosine.
    pub fn new(phase: impl Fn(f64) -> f64) -> Self {
        let moment = |l: usize| 0.5 * adaptive(&mut |x| phase(x) * polynomials(x)[l], -1.0, 1.0, 1e-10);
        let peak = moment(L + 1).max(0.0);
        let chi = std::array::from_fn(|l| if l == 0 { 1.0 } else { (moment(l) - peak) / (1.0 - peak) });
        Self { peak, chi }
    }

    /// The rest at a cosine.
    pub fn at(&self, x: f64) -> f64 {
        let p = polynomials(x);
        (0..=L).map(|l| (2 * l + 1) as f64 * self.chi[l] * p[l]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::air::phase::{CornetteShanks, rayleigh};

    #[test]
    fn the_addition_theorem_holds() {
        for (mu, other, azimuth) in [(0.3, -0.7, 1.1_f64), (1.0, 0.2, 0.4), (-0.9, -0.9, 3.0), (0.0, 0.5, 2.0)] {
            let (a, b) = (schmidt(mu), schmidt(other));
            let across = ((1.0 - mu * mu) * (1.0 - other * other)).sqrt();
            let want = polynomials(mu * other + across * azimuth.cos());
            for l in 0..=L {
                let sum: f64 = (0..=l)
                    .map(|m| {
                        let q = start(m) + l - m;
                        f64::from(a[q]) * f64::from(b[q]) * (m as f64 * azimuth).cos()
                    })
                    .sum();
                assert!((sum - want[l]).abs() < 2e-6, "degree {l}: {sum} against {}", want[l]);
            }
        }
    }

    #[test]
    fn molecules_are_kept_whole_and_a_peak_goes_on() {
        let molecules = Truncated::new(|x| rayleigh(1.0 - x));
        assert!(molecules.peak < 1e-9 && (molecules.chi[2] - 0.1).abs() < 1e-9, "{molecules:?}");
        let phase = CornetteShanks::<f64>::new(0.7);
        let aerosol = Truncated::new(|x| phase.at(1.0 - x, 1.0 + x, f64::sqrt));
        // Its mean cosine: g 3 (4 + g2) / (5 (2 + g2)).
        let mean = aerosol.peak + (1.0 - aerosol.peak) * aerosol.chi[1];
        assert!((mean - 0.7 * 3.0 * 4.49 / (5.0 * 2.49)).abs() < 1e-9, "{mean}");
        assert!((0.04..0.1).contains(&aerosol.peak), "{}", aerosol.peak);
    }
}

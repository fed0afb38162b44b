//! Vertical profiles of an atmosphere, number density by height: air of the U.S. Standard Atmosphere 1976 (barometric
//! layers of constant lapse rate, above 86 km its table) or an exponential, aerosol, an ozone layer (floor 2).
//!
//! The density of air falls e-fold within 10 km near the ground, 6.4 in the stratosphere and 8 at 50 km: an exponential
//! that is right at the ground is three times too dense where twilight is made, one of the right column is not so
//! anywhere else. [`Profile::densities`] interpolates the logarithm over steps of 50 m, within
//! 3e-4 of the closed form (`the_steps_hold_the_closed_form`).
//!
//! Units: metres, densities over those on the ground (ozone: over those where it is densest).

use super::shell::Shell;
use crate::astro::standard_atmosphere;
use crate::math::elementary::exp64;
use crate::math::quadrature::gauss_legendre;

/// Species: molecules, aerosol, ozone.
pub const SPECIES: usize = 3;
/// Step of the logarithms \[m\].
const STEP: f64 = 50.0;
/// How the density of molecules falls off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Molecules {
    /// U.S. Standard Atmosphere 1976.
    Standard,
    /// An exponential of this scale height \[m\].
    Exponential(f64),
}

impl Molecules {
    /// Density over that on the ground, in closed form.
    pub fn density(self, h: f64) -> f64 {
        match self {
            Self::Exponential(scale) => (-h / scale).exp(),
            Self::Standard => standard_atmosphere::density(h),
        }
    }
}

/// What is how dense at which height.
#[derive(Debug, Clone)]
pub struct Profile {
    /// Ground and top of the air.
    pub shell: Shell,
    /// The molecules.
    pub molecules: Molecules,
    /// Scale height of the aerosol \[m\].
    pub aerosol_scale: f64,
    /// The ozone begins, is densest and ends \[m\].
    pub layer: [f64; 3],
    logs: Vec<f64>,
}

impl Profile {
    /// A profile.
    pub fn new(shell: Shell, molecules: Molecules, aerosol_scale: f64, layer: [f64; 3]) -> Self {
        let count = (shell.thickness / STEP).ceil() as usize + 2;
        let logs = (0..count).map(|i| molecules.density(i as f64 * STEP).ln()).collect();
        Self { shell, molecules, aerosol_scale, layer, logs }
    }

    /// Density of ozone over where it is densest.
    #[inline(always)]
    pub fn ozone(&self, h: f64) -> f64 {
        let [low, peak, high] = self.layer;
        let x = if h < peak { (h - low) / (peak - low) } else { (high - h) / (high - peak) };
        if x > 0.0 { x } else { 0.0 }
    }

    /// Densities of the species.
    #[inline(always)]
    pub fn densities(&self, h: f64) -> [f64; SPECIES] {
        let h = if h > 0.0 { h } else { 0.0 };
        let at = h * (1.0 / STEP);
        let last = (self.logs.len() - 2) as f64;
        let at = if at < last { at } else { last };
        let i = at as usize;
        let log = self.logs[i] + (at - i as f64) * (self.logs[i + 1] - self.logs[i]);
        [exp64(log), exp64(-h / self.aerosol_scale), self.ozone(h)]
    }

    /// The same in closed form.
    pub fn exact(&self, h: f64) -> [f64; SPECIES] {
        [self.molecules.density(h), (-h / self.aerosol_scale).exp(), self.ozone(h)]
    }

    /// Columns of the species between two heights \[m\].
    pub fn column(&self, low: f64, high: f64) -> [f64; SPECIES] {
        let (mut sum, steps) = ([0.0; SPECIES], 24);
        for i in 0..steps {
            for &(x, w) in &gauss_legendre(4) {
                // Fine where the air is dense.
                let s = (f64::from(i) + x) / f64::from(steps);
                let weight = w / f64::from(steps) * 2.0 * s * (high - low);
                for (sum, density) in sum.iter_mut().zip(self.exact(low + (high - low) * s * s)) {
                    *sum += weight * density;
                }
            }
        }
        sum
    }

    /// Columns of the species above the ground \[m\], by quadrature of the closed form.
    pub fn vertical(&self) -> [f64; SPECIES] {
        let rule = gauss_legendre(6);
        let (mut sum, steps) = ([0.0; SPECIES], 480);
        let step = self.shell.thickness / f64::from(steps);
        for i in 0..steps {
            for &(x, w) in &rule {
                let densities = self.exact(step * (f64::from(i) + x));
                for k in 0..SPECIES {
                    sum[k] += w * step * densities[k];
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHELL: Shell = Shell { radius: 6.36e6, thickness: 1.2e5 };

    #[test]
    fn columns_are_what_they_weigh() {
        // Its column weighs what its pressure says: 8434.5 m of air at the ground's density, less what is in the
        // standard's weaker gravity above.
        let column = Profile::new(SHELL, Molecules::Standard, 1200.0, [1e4, 2.5e4, 4e4]).vertical();
        assert!((column[0] / 8434.5 - 1.0).abs() < 3e-3, "{}", column[0]);
        assert!((column[1] - 1200.0).abs() < 1e-3 && (column[2] - 15e3).abs() < 1.0, "{column:?}");
        let profile = Profile::new(SHELL, Molecules::Standard, 1200.0, [1e4, 2.5e4, 4e4]);
        let parts = [profile.column(0.0, 1500.0), profile.column(1500.0, 1.2e5)];
        for k in 0..SPECIES {
            let whole = parts[0][k] + parts[1][k];
            assert!((whole / column[k] - 1.0).abs() < 1e-3, "{k}: {whole} in two parts, {}", column[k]);
        }
    }

    #[test]
    fn the_steps_hold_the_closed_form() {
        for molecules in [Molecules::Standard, Molecules::Exponential(7200.0)] {
            let profile = Profile::new(SHELL, molecules, 1200.0, [1e4, 2.5e4, 4e4]);
            for i in 0..3000 {
                let h = 119_990.0 * (f64::from(i) / 3000.0);
                let (got, want) = (profile.densities(h), profile.exact(h));
                for k in 0..SPECIES {
                    assert!(
                        (got[k] - want[k]).abs() <= 3e-4 * want[k] + 1e-30,
                        "{molecules:?} at {h}: {got:?} {want:?}"
                    );
                }
            }
        }
    }
}

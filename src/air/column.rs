//! Slant columns of an atmosphere (air mass, Chapman's function for any profile): the integrals of the densities from a
//! point to the top, for optical depth and transmittance towards a sun (floor 2).
//!
//! [`columns`] is a Gauss-Legendre sum from the ray's lowest point outwards, in panels that grow with the height.
//! [`ColumnTable`] keeps its logarithms for rays upwards over height and cosine, bicubic, of the column times
//! `a + sqrt(mu^2 + a^2)`, because it goes as `1 / mu` above the horizon; even in `mu / (a + sqrt(mu^2 + a^2))`. A ray
//! downwards has passed its lowest point: twice the column that is level there, less that of the ray upwards. Level
//! columns are kept in steps of 80 m. Of rays that meet the ground the columns are those of the grazing one. Ozone, whose
//! triangle no table follows, is a sum of its two sides: along a ray, height is a parabola over a layer (Simpson's rule).
//!
//! Error: 1e-4 of a column, 4e-4 beside the tropopause (`the_table_is_the_integral`). Cost: a look-up 20 ns, of rays
//! downwards 30; the table 20 ms.

use std::sync::LazyLock;

use glam::Vec4;

use super::profile::{Profile, SPECIES};
use super::shell::Shell;
use crate::error::Result;
use crate::job::Job;
use crate::math::elementary::exp;
use crate::math::interpolation::lagrange4;
use crate::math::quadrature::gauss_legendre;

/// Nodes over heights and cosines.
const HEIGHTS: usize = 80;
const COSINES: usize = 64;
/// Step of the level columns \[m\].
const STEP: f64 = 80.0;
/// Cosine below which nodes crowd.
const CROWD: f64 = 0.02;
/// Panels from the ground to the top, fine below.
const PANELS: f64 = 26.0;
/// Less of a species is nothing.
const LEAST: f64 = 1e-20;

static RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| gauss_legendre(8));

/// Columns of the species from a height to the top \[m\] by quadrature, as if the ground were air of its density.
pub fn columns(profile: &Profile, h: f64, mu: f64) -> [f64; SPECIES] {
    let shell = &profile.shell;
    let low = if mu < 0.0 { (-(shell.radius + h) * mu).max(0.0) } else { 0.0 };
    let (from, slope) = (shell.height(h, mu, low), if mu < 0.0 { 0.0 } else { mu });
    let mut sum = outwards(profile, from, slope, shell.thickness);
    if low > 0.0 {
        let back = outwards(profile, from, slope, h);
        for k in 0..SPECIES {
            sum[k] += back[k];
        }
    }
    sum
}

/// The same from a height to another one above it, going up.
fn outwards(profile: &Profile, h: f64, mu: f64, end: f64) -> [f64; SPECIES] {
    let shell = &profile.shell;
    let mut sum = [0.0; SPECIES];
    let panels = (((end - h) / shell.thickness).sqrt() * PANELS).ceil().max(1.0) as usize;
    // At a lowest point height grows with the square of the distance: panels do so too.
    let level = |i: usize| h + (end - h) * (i as f64 / panels as f64).powi(2);
    let distance = |top: f64| if top <= h { 0.0 } else { shell.distance_to_top(h, mu, top) };
    let mut before = 0.0;
    for i in 1..=panels {
        let next = distance(level(i));
        for &(x, w) in &*RULE {
            let densities = profile.densities(shell.height(h, mu, before + (next - before) * x));
            for k in 0..SPECIES {
                sum[k] += w * (next - before) * densities[k];
            }
        }
        before = next;
    }
    sum
}

/// Columns over height and cosine.
#[derive(Debug, Clone)]
pub struct ColumnTable {
    shell: Shell,
    layer: [f64; 3],
    nodes: Vec<Vec4>,
    level: Vec<Vec4>,
}

/// What a column is multiplied with, over which a cosine is its coordinate.
#[inline(always)]
fn stretch(mu: f64) -> f64 {
    CROWD + (mu * mu + CROWD * CROWD).sqrt()
}

/// Four-point Lagrange weights at `x` in `[0, n - 1]`, and the first of the nodes.
#[inline(always)]
fn place(x: f64, n: usize) -> (usize, [f32; 4]) {
    let last = (n - 4) as f64;
    let first = x - 1.0;
    let first = if first > last { last } else { first };
    let first = if first > 0.0 { first } else { 0.0 };
    let i = first as usize;
    (i, lagrange4((x - i as f64) as f32))
}

/// Cosine to the vertical of the ray that grazes the ground.
#[inline(always)]
pub fn grazing(shell: &Shell, h: f64) -> f64 {
    -(h * (2.0 * shell.radius + h)).sqrt() / (shell.radius + h)
}

impl ColumnTable {
    /// Of a profile.
    pub fn new(job: &Job, profile: &Profile) -> Result<Self> {
        let shell = profile.shell;
        let node = |h: f64, mu: f64| {
            let found = columns(profile, h, mu).map(|c| (c.max(LEAST) * stretch(mu)).ln() as f32);
            Vec4::new(found[0], found[1], found[2], 0.0)
        };
        let rows = job.map(HEIGHTS, |i| {
            let h = shell.thickness * (i as f64 / (HEIGHTS - 1) as f64).powi(2);
            let row = (0..COSINES).map(|j| {
                let x = j as f64 / (COSINES - 1) as f64 / stretch(1.0);
                node(h, (2.0 * CROWD * x / (1.0 - x * x)).clamp(0.0, 1.0))
            });
            Ok(row.collect::<Vec<_>>())
        })?;
        let count = (shell.thickness / STEP).ceil() as usize + 3;
        let level = job.map(count, |i| Ok(node((i as f64 * STEP).min(shell.thickness), 0.0)))?;
        Ok(Self { shell, layer: profile.layer, nodes: rows.concat(), level })
    }

    /// Columns of the species from a height to the top \[m\].
    #[inline(always)]
    pub fn at(&self, h: f64, mu: f64) -> [f32; SPECIES] {
        let h = if h > 0.0 { h } else { 0.0 };
        let h = if h < self.shell.thickness { h } else { self.shell.thickness };
        let up = self.upwards(h, mu.abs());
        if mu >= 0.0 {
            return up;
        }
        // The height of its lowest point, r (sin - 1) + h sin without cancellation.
        let sine = (1.0 - mu * mu).max(0.0).sqrt();
        let low = h - (self.shell.radius + h) * mu * mu / (1.0 + sine);
        let (i, w) = place(low.max(0.0) / STEP, self.level.len());
        let log = self.level[i] * w[0] + self.level[i + 1] * w[1] + self.level[i + 2] * w[2] + self.level[i + 3] * w[3];
        let twice = (1.0 / CROWD) as f32;
        let ozone = 2.0 * self.ozone(low, 0.0) as f32;
        [twice * exp(log.x) - up[0], twice * exp(log.y) - up[1], ozone - up[2]]
    }

    /// The same for a ray upwards.
    #[inline(always)]
    fn upwards(&self, h: f64, mu: f64) -> [f32; SPECIES] {
        let over = 1.0 / stretch(mu);
        let (i, u) = place((h / self.shell.thickness).sqrt() * (HEIGHTS - 1) as f64, HEIGHTS);
        let (j, v) = place(mu * over * stretch(1.0) * (COSINES - 1) as f64, COSINES);
        let mut log = Vec4::ZERO;
        for a in 0..4 {
            let row = &self.nodes[(i + a) * COSINES + j..][..4];
            log += (row[0] * v[0] + row[1] * v[1] + row[2] * v[2] + row[3] * v[3]) * u[a];
        }
        let over = over as f32;
        [exp(log.x) * over, exp(log.y) * over, self.ozone(h, mu) as f32]
    }

    /// The column of ozone along a ray upwards.
    #[inline(always)]
    fn ozone(&self, h: f64, mu: f64) -> f64 {
        let [low, peak, high] = self.layer;
        if h >= high {
            return 0.0;
        }
        let at = |top: f64| if h < top { self.shell.distance_to_top(h, mu, top) } else { 0.0 };
        let [a, b, c] = self.layer.map(at);
        let density = |h: f64| if h < peak { (h - low) / (peak - low) } else { (high - h) / (high - peak) };
        let start = if h > low { density(h) } else { 0.0 };
        let side = |from: f64, to: f64, first: f64, last: f64| {
            (to - from) / 6.0 * (first + 4.0 * density(self.shell.height(h, mu, 0.5 * (from + to))) + last)
        };
        let rise = if b > 0.0 { side(a, b, start, 1.0) } else { 0.0 };
        rise + side(b, c, if b > 0.0 { 1.0 } else { start }, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::air::profile::Molecules;
    use crate::math::quadrature::adaptive;

    fn profile() -> Profile {
        let shell = Shell { radius: 6.36e6, thickness: 1.2e5 };
        Profile::new(shell, Molecules::Standard, 1200.0, [1e4, 2.5e4, 4e4])
    }

    #[test]
    fn columns_agree_with_adaptive_quadrature() {
        let profile = profile();
        let shell = profile.shell;
        for h in [0.0, 900.0, 11e3, 35e3] {
            for mu in [1.0, 0.3, 0.02, 0.0, 0.5 * grazing(&shell, h), grazing(&shell, h)] {
                let got = columns(&profile, h, mu);
                let low = (-(shell.radius + h) * mu).max(0.0);
                let end = shell.distance_to_top(h, mu, shell.thickness);
                for k in 0..SPECIES {
                    let mut density = |s: f64| profile.exact(shell.height(h, mu, s))[k];
                    let want = adaptive(&mut density, 0.0, low, 1e-3) + adaptive(&mut density, low, end, 1e-3);
                    // Ozone bends where it is densest.
                    assert!(
                        (got[k] - want).abs() < [3e-4, 3e-4, 1e-3][k] * want + 0.1,
                        "{h} {mu} {k}: {} against {want}",
                        got[k]
                    );
                }
            }
        }
        // Air mass of the horizon by Kasten and Young 1989: 38.
        let mass = columns(&profile, 0.0, 0.0)[0] / columns(&profile, 0.0, 1.0)[0];
        assert!((35.0..38.5).contains(&mass), "without refraction a little less: {mass}");
    }

    #[test]
    fn the_table_is_the_integral() {
        let profile = profile();
        let table = ColumnTable::new(&Job::serial(), &profile).expect("made");
        for i in 0..2000 {
            let t = f64::from(i) + 0.5;
            let h = 60e3 * (t * 0.754_877_666_246_692_7).fract().powi(2);
            let low = grazing(&profile.shell, h);
            let mu = low + (1.0 - low) * (t * 0.569_840_290_998_053_2).fract().powi(3);
            let (got, want) = (table.at(h, mu), columns(&profile, h, mu));
            for k in 0..SPECIES {
                // That of ozone by quadrature is off by so much itself.
                let bound = [5e-4, 1e-4, 1e-3][k];
                let error = (f64::from(got[k]) - want[k]).abs();
                assert!(
                    error < bound * want[k] + [1e-2, 1e-2, 1.0][k],
                    "{h} {mu} species {k}: {} against {}",
                    got[k],
                    want[k]
                );
            }
        }
    }
}

//! The fast method of [`Aoas`]: a table of the integrals, exact phase functions.
//!
//! The table is the smallest of a few sizes that holds the tolerance at points between its nodes. With the sun near or
//! below the horizon the edge of the ground's shadow crosses the sky, a kink that no table follows; cells that it passes
//! are marked and their directions integrated one by one.

use glam::{DVec3, Vec4};

use super::{Aoas, GRAZE, Ground};
use crate::air::phase::{CornetteShanks, rayleigh};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::lanes;
use crate::sky::field::{BLOCK, Block};
use crate::sky::table::{Lookup, Places, Sheet, Table, row, share};

/// Integrals for molecules and aerosol, and transmittance; the fourth number of each pads.
type Node = [Vec4; 3];

/// Light above the horizon and, for a viewer above a coloured ground, below.
#[derive(Debug)]
pub(super) struct Tables {
    pub(super) above: Table,
    below: Option<Table>,
    /// Cells of the upper table that do not hold the tolerance: there the edge of the shadow of the ground passes.
    rough: Option<Vec<bool>>,
    /// The upper table for linear interpolation, where that holds the tolerance too.
    sheet: Option<Sheet>,
}

/// Rows and columns of the sheet.
const SHEET: [usize; 2] = [192, 64];

/// What a table is judged by: points, the exact nodes there, the largest light of each channel.
struct Probes {
    places: Vec<(f64, f64)>,
    nodes: Vec<Node>,
    largest: [f32; 3],
}

/// Sizes of the table, tried in turn.
const SIZES: [[usize; 2]; 4] = [[16, 8], [24, 12], [40, 20], [72, 32]];
/// Where the error of a table is measured.
const PROBES: usize = 192;
/// The relative error is that against the value plus this share of the largest.
pub(super) const FLOOR: f64 = 1e-3;

/// What the light of a block depends on.
struct Angles {
    /// Row coordinates, at most 1.
    rows: [f32; BLOCK],
    /// Cosines of the azimuth from the sun.
    cosines: [f32; BLOCK],
    /// Phase functions of molecules and, times its constant, of the aerosol.
    phases: [[f32; BLOCK]; 2],
    /// `1 - cos` of the angle from the sun.
    near: [f32; BLOCK],
    /// 0 where the direction passes the air by.
    visible: [f32; BLOCK],
}

impl Aoas {
    fn mu_above(&self, row: f64) -> f64 {
        self.horizon + (self.top - self.horizon) * share(row)
    }

    fn mu_below(&self, row: f64) -> f64 {
        // Never quite along the horizon, where the ray would pass the ground.
        (self.horizon - (1.0 + self.horizon) * share(row)).clamp(-1.0, self.horizon - 10.0 * GRAZE)
    }

    #[inline(always)]
    fn node(&self, mu: f64, c: f64) -> Node {
        let s = self.scattered(mu, self.towards(mu, c), false);
        let pack = |x: [f64; 3]| Vec4::new(x[0] as f32, x[1] as f32, x[2] as f32, 0.0);
        [pack(s.rayleigh), pack(s.mie), pack(s.transmittance)]
    }

    /// Exact nodes at `places` (row and cosine).
    fn nodes(&self, job: &Job, places: &[(f64, f64)], mu: &(impl Fn(f64) -> f64 + Sync)) -> Result<Vec<Node>> {
        let bands = job.map(places.len().div_ceil(16), |k| {
            let some = &places[16 * k..places.len().min(16 * k + 16)];
            Ok(lanes::run(
                #[inline(always)]
                || some.iter().map(|&(row, c)| self.node(mu(row), c)).collect::<Vec<_>>(),
            ))
        })?;
        Ok(bands.into_iter().flatten().collect())
    }

    /// Relative error of the light at a place, before the phase functions. That of a species counts as far as the other
    /// does not outshine it.
    fn error(&self, got: [Vec4; 2], node: &Node, largest: &[f32; 3], (mu, c): (f64, f64)) -> f64 {
        let set = &self.set;
        // The aerosol's peak may lie beside the place.
        let angle = (self.towards(mu, c).acos() - 0.1).max(0.0);
        let (near, far) = (1.0 - angle.cos(), 1.0 + angle.cos());
        let aerosol = set.mie * CornetteShanks::new(set.g).at(near, far, f64::sqrt);
        let mut worst = 0.0_f64;
        for k in 0..3 {
            let weights = [set.rayleigh[k] * 0.75, aerosol];
            let sum = |x: &dyn Fn(usize) -> f64| weights[0] * x(0) + weights[1] * x(1);
            let off = sum(&|g| f64::from((got[g][k] - node[g][k]).abs()));
            let light = sum(&|g| f64::from(node[g][k]));
            worst = worst.max(off / (light + self.floor() * f64::from(largest[k])));
        }
        worst
    }

    /// Share of the largest light that a relative error is measured against at the least: with the sun far below the
    /// horizon most of the sky is nearly black.
    fn floor(&self) -> f64 {
        if self.mu_sun < self.horizon - 2.0_f64.to_radians().sin() { 1.0 } else { FLOOR }
    }

    /// Points of the R2 sequence (Roberts 2018) and what is there.
    fn probes(&self, job: &Job, mu: &(impl Fn(f64) -> f64 + Sync)) -> Result<Probes> {
        let places: Vec<(f64, f64)> = (0..PROBES)
            .map(|i| {
                let i = i as f64 + 0.5;
                ((i * 0.754_877_666_246_692_8).fract(), 2.0 * (i * 0.569_840_290_998_053_3).fract() - 1.0)
            })
            .collect();
        let nodes = self.nodes(job, &places, mu)?;
        let mut largest = [1e-30_f32; 3];
        for node in &nodes {
            for k in 0..3 {
                let light = 0.75 * self.set.rayleigh[k] as f32 * node[0][k] + self.set.mie as f32 * node[1][k];
                largest[k] = largest[k].max(light);
            }
        }
        Ok(Probes { places, nodes, largest })
    }

    /// Whether a table stays within a share of the tolerance at the probes.
    fn within(&self, table: &impl Lookup, probes: &Probes, mu: &impl Fn(f64) -> f64) -> bool {
        probes.places.iter().zip(&probes.nodes).all(|(&(row, c), node)| {
            let got = [0, 1].map(|g| table.value(g, row as f32, c as f32));
            // The probes do not meet the worst place.
            self.error(got, node, &probes.largest, (mu(row), c)) < 0.4 * self.set.tolerance
        })
    }

    /// The smallest table within the tolerance, or the largest.
    fn table(&self, job: &Job, probes: &Probes, mu: &(impl Fn(f64) -> f64 + Sync)) -> Result<(Table, bool)> {
        let mut found = Err(Error::Empty { name: "table" });
        for size in SIZES {
            let table = Table::build(job, size, |row, c| {
                lanes::run(
                    #[inline(always)]
                    || self.node(mu(row), c),
                )
            })?;
            let good = self.within(&table, probes, mu);
            found = Ok((table, good));
            if good {
                break;
            }
        }
        found
    }

    /// Cells of a table that are not within the tolerance.
    fn rough(&self, job: &Job, table: &Table, probes: &Probes, mu: &(impl Fn(f64) -> f64 + Sync)) -> Result<Vec<bool>> {
        let (high, wide) = (table.rows - 1, table.columns - 1);
        let middles: Vec<(f64, f64)> = (0..high * wide)
            .map(|i| {
                let (row, column) = ((i / wide) as f64 + 0.5, (i % wide) as f64 + 0.5);
                (row / high as f64, 2.0 * column / wide as f64 - 1.0)
            })
            .collect();
        let exact = self.nodes(job, &middles, mu)?;
        let bad = |(&(row, c), node): (&(f64, f64), &Node)| {
            let got = [0, 1].map(|g| table.value(g, row as f32, c as f32));
            self.error(got, node, &probes.largest, (mu(row), c)) > 0.25 * self.set.tolerance
        };
        let bad: Vec<bool> = middles.iter().zip(&exact).map(bad).collect();
        // Neighbours of a bad cell may fail at their edges.
        let near = |i: usize| {
            let (row, column) = (i / wide, i % wide);
            (row.saturating_sub(1)..(row + 2).min(high))
                .any(|a| (column.saturating_sub(1)..(column + 2).min(wide)).any(|b| bad[a * wide + b]))
        };
        Ok((0..high * wide).map(near).collect())
    }

    /// Make the tables.
    pub(super) fn tabulate(&self, job: &Job) -> Result<Tables> {
        let mu = |row: f64| self.mu_above(row);
        let probes = self.probes(job, &mu)?;
        let (above, good) = self.table(job, &probes, &mu)?;
        let rough = if good { None } else { Some(self.rough(job, &above, &probes, &mu)?) };
        let sheet = if good { Some(above.spread(job, SHEET)?) } else { None };
        let sheet = sheet.filter(|sheet| self.within(sheet, &probes, &mu));
        let below = if self.h > 0.0 && self.set.ground != Ground::Horizon {
            let mu = |row: f64| self.mu_below(row);
            Some(self.table(job, &self.probes(job, &mu)?, &mu)?.0)
        } else {
            None
        };
        Ok(Tables { above, below, rough, sheet })
    }

    /// Without a table.
    pub(super) fn shade_few(&self, block: &mut Block, above: &[bool; BLOCK]) {
        for i in 0..BLOCK {
            let to = [0, 1, 2].map(|k: usize| f64::from(block.to[k][i]));
            let light = self.radiance(DVec3::from_array(to).normalize(), above[i], false);
            for c in 0..3 {
                block.light[c][i] = light[c] as f32;
            }
        }
    }

    #[inline(always)]
    fn angles(&self, to: &[[f32; BLOCK]; 3], above: &[bool; BLOCK]) -> Angles {
        let set = &self.set;
        let f = |v: DVec3| v.as_vec3().to_array();
        let (z, s) = (f(self.zenith), f(set.sun));
        let (horizon, range) = (self.horizon as f32, 1.0 / (self.top - self.horizon) as f32);
        let depth = 1.0 / (1.0 + self.horizon).max(1e-12) as f32;
        let mu_sun = self.mu_sun as f32;
        let sun_across = (1.0 - self.mu_sun * self.mu_sun).max(0.0).sqrt() as f32;
        let (colored, limb) = (set.ground != Ground::Horizon, self.h > set.thickness);
        let mie = set.mie as f32;
        let aerosol = CornetteShanks::<f32>::new(set.g);
        // Along the horizon the cosine to the sun is this share of the azimuth's.
        let level = ((1.0 - self.horizon * self.horizon).max(0.0).sqrt()) as f32 * sun_across;
        let level_sun = (self.horizon * self.mu_sun) as f32;
        let zeros = [0.0_f32; BLOCK];
        let mut out = Angles { rows: zeros, cosines: zeros, phases: [zeros; 2], near: zeros, visible: zeros };
        let [x, y, w] = to;
        for i in 0..BLOCK {
            let mu = x[i] * z[0] + y[i] * z[1] + w[i] * z[2];
            let (dx, dy, dz) = (x[i] - s[0], y[i] - s[1], w[i] - s[2]);
            let (ex, ey, ez) = (x[i] + s[0], y[i] + s[1], w[i] + s[2]);
            let near = 0.5 * (dx * dx + dy * dy + dz * dz);
            let far = 0.5 * (ex * ex + ey * ey + ez * ez);
            // Of the cross product with the vertical: no cancellation near it.
            let (cx, cy, cz) = (y[i] * z[2] - w[i] * z[1], w[i] * z[0] - x[i] * z[2], x[i] * z[1] - y[i] * z[0]);
            let across = (cx * cx + cy * cy + cz * cz).sqrt() * sun_across;
            let known = across > 1e-9;
            let c = (1.0 - near - mu * mu_sun) / if known { across } else { 1.0 };
            let c = if known { c } else { 0.0 };
            let c = if c > 1.0 { 1.0 } else { c };
            let c = if c > -1.0 { c } else { -1.0 };
            out.cosines[i] = c;
            let m = if above[i] || !colored { (mu - horizon) * range } else { (horizon - mu) * depth };
            let u = row(if m > 0.0 { m } else { 0.0 });
            out.visible[i] = if limb && u > 1.0 { 0.0 } else { 1.0 };
            out.rows[i] = if u > 1.0 { 1.0 } else { u };
            let goes_on = mu < horizon && (above[i] || !colored);
            out.phases[0][i] = rayleigh(if goes_on { 1.0 - level_sun - level * c } else { near });
            out.phases[1][i] = mie * aerosol.at(near, far, f32::sqrt);
            out.near[i] = near;
        }
        out
    }

    /// Light of a block by the tables.
    #[inline(always)]
    pub(super) fn shade_many(&self, block: &mut Block, above: &[bool; BLOCK], tables: &Tables) {
        let angles = self.angles(&block.to, above);
        match &tables.sheet {
            Some(sheet) => self.shade_above(block, &angles, sheet),
            None => self.shade_above(block, &angles, &tables.above),
        }
        self.shade_rest(block, above, &angles, tables);
    }

    /// Light of the directions above the horizon, or of all where it goes on below.
    #[inline(always)]
    fn shade_above(&self, block: &mut Block, angles: &Angles, table: &impl Lookup) {
        let set = &self.set;
        let alike = set.scales[0] == set.scales[1];
        let mut places = Places::default();
        table.place(&angles.rows, &angles.cosines, &mut places);
        for i in 0..BLOCK {
            let molecules = table.at(0, &places, i);
            let aerosol = if alike { molecules } else { table.at(1, &places, i) };
            let value = self.light(angles, i, molecules, aerosol);
            for c in 0..3 {
                block.light[c][i] = value[c];
            }
        }
    }

    /// Integrals times phase functions.
    #[inline(always)]
    fn light(&self, angles: &Angles, i: usize, molecules: Vec4, aerosol: Vec4) -> Vec4 {
        let [r, g, b] = self.set.rayleigh.map(|k| (k * self.set.intensity) as f32);
        let value = molecules * (Vec4::new(r, g, b, 0.0) * angles.phases[0][i])
            + aerosol * (self.set.intensity as f32 * angles.phases[1][i]);
        value.max(Vec4::ZERO) * angles.visible[i]
    }

    /// Ground, cells that the table does not hold, disc.
    #[inline(always)]
    fn shade_rest(&self, block: &mut Block, above: &[bool; BLOCK], angles: &Angles, tables: &Tables) {
        let set = &self.set;
        let upper = &tables.above;
        let mut places = Places::default();
        if let Ground::Color(color) = set.ground {
            let color = Vec4::new(color[0] as f32, color[1] as f32, color[2] as f32, 0.0);
            if let Some(lower) = &tables.below {
                lower.place(&angles.rows, &angles.cosines, &mut places);
            }
            for i in (0..BLOCK).filter(|&i| !above[i]) {
                let value = match &tables.below {
                    None => color,
                    Some(lower) => {
                        let [molecules, aerosol, clear] = [0, 1, 2].map(|g| lower.at(g, &places, i));
                        self.light(angles, i, molecules, aerosol) + color * clear
                    }
                };
                for c in 0..3 {
                    block.light[c][i] = value[c];
                }
            }
        }
        if let Some(rough) = &tables.rough {
            let (high, wide) = (upper.rows - 1, upper.columns - 1);
            let whole = set.ground == Ground::Horizon;
            for i in (0..BLOCK).filter(|&i| (above[i] || whole) && angles.visible[i] > 0.0) {
                let row = ((angles.rows[i] * high as f32) as usize).min(high - 1);
                let column = ((0.5 * (angles.cosines[i] + 1.0) * wide as f32) as usize).min(wide - 1);
                if rough[row * wide + column] {
                    let to = [0, 1, 2].map(|k: usize| f64::from(block.to[k][i]));
                    let light = self.scattered_light(DVec3::from_array(to).normalize(), above[i], false).0;
                    for c in 0..3 {
                        block.light[c][i] = light[c] as f32;
                    }
                }
            }
        }
        if set.disc > 0.0 {
            let disc = self.disc_radiance();
            for i in 0..BLOCK {
                if above[i] && self.in_disc(f64::from(angles.near[i])) {
                    for c in 0..3 {
                        block.light[c][i] += disc[c] as f32;
                    }
                }
            }
        }
    }
}

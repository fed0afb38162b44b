//! Precomputed scattering table of a sky that one sun lights: single and multiple scattering without the phase
//! functions, which stay exact (floor 3).
//!
//! Seen from one point, what multiplies the phase functions depends on two cosines only (table.rs). [`Source`] gives it
//! by quadrature; [`ScatteringTable`] tabulates it, at the smallest of a few sizes that holds the tolerance at points
//! between the nodes, and shades blocks. With the sun near or below the horizon the edge of the ground's shadow crosses
//! the sky, a kink that no table follows; cells that it passes are marked and their directions integrated one by one.

use std::sync::OnceLock;

use glam::{DVec3, Vec4};

use super::limb::fraction_above_horizon;
use super::model::{BLOCK, Block, FLOOR};
use super::table::{LinearTable, Lookup, Table, TableCoords, height_fraction, row_of};
use crate::air::phase::{CornetteShanks, rayleigh};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::lanes;

/// What multiplies the phase functions of molecules and of aerosol, and light that needs none, for three channels.
pub type PhaseCoefficients = [[f64; 3]; 3];

/// The same in a table; the fourth number of each pads.
type Node = [Vec4; 3];

/// Where light comes from.
pub trait Source: Sync {
    /// Parts along a direction with the cosine `mu` to the vertical and `nu` to the sun.
    fn parts(&self, mu: f64, nu: f64) -> PhaseCoefficients;

    /// The same along directions of one angle to the vertical, which may share work.
    fn row(&self, mu: f64, nus: &[f64]) -> Vec<PhaseCoefficients> {
        lanes::run(
            #[inline(always)]
            || nus.iter().map(|&nu| self.parts(mu, nu)).collect(),
        )
    }
}

/// Relative distance of the lowest ray from the ground, so that rounding cannot make it hit.
pub const HORIZON_EPSILON: f64 = 1e-12;

/// What a viewer sees where, and how the parts are weighed.
#[derive(Debug, Clone, Copy)]
pub struct View {
    /// Direction of the sun.
    pub sun: DVec3,
    /// The vertical.
    pub zenith: DVec3,
    /// Cosine of the lowest ray that passes the ground, a trifle above it.
    pub horizon: f64,
    /// Cosine of the highest ray that meets the air: 1 for a viewer inside.
    pub top: f64,
    /// Below the horizon the sky goes on as it is there; otherwise the parts are those of rays to the ground.
    pub extend_horizon: bool,
    /// Factors of the first two parts.
    pub weights: [[f64; 3]; 2],
    /// Asymmetry of the aerosol.
    pub g: f64,
    /// How many of the parts there are above the horizon; with one, it serves the aerosol too.
    pub groups: usize,
    /// Relative error of the tables.
    pub tolerance: f64,
    /// Fraction of the tolerance that a table may use at the probes, which do not meet the worst place.
    pub at_probes: f64,
}

/// Light above the horizon and, where it does not go on, below.
#[derive(Debug)]
struct Tables {
    above: Table,
    below: Option<Table>,
    /// Cells of both that do not hold the tolerance: there the edge of the shadow of the ground passes, or the horizon
    /// is near.
    refined: [Option<Vec<bool>>; 2],
    /// The upper table for linear interpolation, where that holds the tolerance too.
    linear: Option<LinearTable>,
}

/// Rows and columns of the sheet.
const LINEAR_SIZE: [usize; 2] = [192, 64];

/// What a table is judged by: points, the exact nodes there, the largest light of each channel.
struct Probes {
    coords: Vec<(f64, f64)>,
    nodes: Vec<Node>,
    largest: [f32; 3],
}

/// Sizes of the table, tried in turn.
const SIZES: [[usize; 2]; 4] = [[16, 8], [24, 12], [40, 20], [72, 32]];
/// The same of a table's sheet.
const LINEAR_TOLERANCE: f64 = 0.4;
/// Where the error of a table is measured.
const PROBES: usize = 192;
const PROBES_OF_ROW: usize = 4;
/// The same with the sun more than two degrees below the horizon.
pub const LOW_FLOOR: f64 = 0.03;

/// What the light of a block depends on.
struct Angles {
    /// Row coordinates, at most 1.
    rows: [f32; BLOCK],
    /// Cosines of the azimuth from the sun.
    cosines: [f32; BLOCK],
    /// Phase functions of molecules and of aerosol.
    phases: [[f32; BLOCK]; 2],
    /// `1 - cos` of the angle from the sun.
    near: [f32; BLOCK],
    /// 0 where the direction passes the air by.
    visible: [f32; BLOCK],
}

/// A sky and its tables.
#[derive(Debug)]
pub struct ScatteringTable {
    /// What is seen where.
    pub view: View,
    mu_sun: f64,
    tables: OnceLock<Tables>,
}

/// What a table has at places, in all parts.
fn values(table: &impl Lookup, groups: usize, places: &[(f64, f64)]) -> Vec<Node> {
    let mut out = Vec::with_capacity(places.len());
    let (mut rows, mut cosines, mut coords) = ([0.0; BLOCK], [0.0; BLOCK], TableCoords::default());
    for some in places.chunks(BLOCK) {
        for (k, &(row, c)) in some.iter().enumerate() {
            (rows[k], cosines[k]) = (row as f32, c as f32);
        }
        table.place(&rows, &cosines, &mut coords);
        for k in 0..some.len() {
            let [a, b, rest] = [0, 1, 2].map(|g| if g < groups { table.at(g, &coords, k) } else { Vec4::ZERO });
            out.push(if groups == 1 { [a, a, Vec4::ZERO] } else { [a, b, rest] });
        }
    }
    out
}

impl ScatteringTable {
    /// Without tables yet.
    pub fn new(view: View) -> Self {
        Self { view, mu_sun: view.zenith.dot(view.sun), tables: OnceLock::new() }
    }

    /// Fraction of a sun's disc of angular `radius` \[rad\] that is above the horizon.
    pub fn fraction_above_horizon(&self, radius: f64) -> f64 {
        fraction_above_horizon(self.mu_sun, self.view.horizon, radius)
    }

    /// Rows and columns of the table above the horizon.
    pub fn table_size(&self) -> Option<[usize; 2]> {
        self.tables.get().map(|t| [t.above.rows, t.above.columns])
    }

    /// Cosine of the azimuth from the sun.
    fn relative(&self, mu: f64, nu: f64) -> f64 {
        let across = ((1.0 - mu * mu).max(0.0) * (1.0 - self.mu_sun * self.mu_sun).max(0.0)).sqrt();
        if across < 1e-9 { 0.0 } else { ((nu - mu * self.mu_sun) / across).clamp(-1.0, 1.0) }
    }

    /// The cosine to the sun of a direction with this cosine to the vertical and of the azimuth.
    fn towards(&self, mu: f64, c: f64) -> f64 {
        let across = ((1.0 - mu * mu).max(0.0) * (1.0 - self.mu_sun * self.mu_sun).max(0.0)).sqrt();
        (mu * self.mu_sun + across * c).clamp(-1.0, 1.0)
    }

    fn mu_above(&self, row: f64) -> f64 {
        self.view.horizon + (self.view.top - self.view.horizon) * height_fraction(row)
    }

    fn mu_below(&self, row: f64) -> f64 {
        let horizon = self.view.horizon;
        // Never quite along the horizon, where the ray would pass the ground.
        (horizon - (1.0 + horizon) * height_fraction(row)).clamp(-1.0, horizon - 10.0 * HORIZON_EPSILON)
    }

    /// Light in one direction by quadrature; `above`: it was above the horizon before anything disturbed it.
    #[inline(always)]
    pub fn radiance(&self, parts: impl Fn(f64, f64) -> PhaseCoefficients, to: DVec3, above: bool) -> [f64; 3] {
        let view = &self.view;
        let mu = to.dot(view.zenith).clamp(-1.0, 1.0);
        let nu = to.dot(view.sun).clamp(-1.0, 1.0);
        let clamped = if view.extend_horizon || above {
            mu.max(view.horizon)
        } else {
            mu.min(view.horizon - 10.0 * HORIZON_EPSILON)
        };
        let path = if clamped == mu { nu } else { self.towards(clamped, self.relative(mu, nu)) };
        let part = parts(clamped, path);
        let (near, far) = (0.5 * (to - view.sun).length_squared(), 0.5 * (to + view.sun).length_squared());
        // Where the horizon goes on, so does its phase function; the sun's glow stays round.
        let level = if clamped == mu { near } else { 1.0 - path };
        // But a sun that has set does not glow through the ground.
        let (hid, bared) = if level > near { (level, 2.0 - level) } else { (near, far) };
        let molecules = rayleigh(level);
        let aerosol = CornetteShanks::new(view.g).at(hid, bared, f64::sqrt);
        [0, 1, 2].map(|c| {
            view.weights[0][c] * molecules * part[0][c] + view.weights[1][c] * aerosol * part[1][c] + part[2][c]
        })
    }

    /// Make the tables, if they are not made.
    pub fn prepare(&self, job: &Job, source: &impl Source) -> Result<()> {
        if self.tables.get().is_none() {
            let _ = self.tables.set(self.tabulate(job, source)?);
        }
        Ok(())
    }

    /// Light of a block. `without_table`: without tables.
    #[inline(always)]
    pub fn shade(
        &self,
        source: &impl Source,
        block: &mut Block,
        above: &[bool; BLOCK],
        without_table: bool,
    ) -> [f32; BLOCK] {
        match if without_table { None } else { self.tables.get() } {
            Some(tables) => self.shade_many(source, block, above, tables),
            None => self.shade_few(source, block, above),
        }
    }

    /// Exact nodes of a row.
    fn nodes_of(&self, source: &impl Source, mu: f64, cosines: &[f64]) -> Vec<Node> {
        let nus: Vec<f64> = cosines.iter().map(|&c| self.towards(mu, c)).collect();
        let node = |p: PhaseCoefficients| p.map(|p| Vec4::new(p[0] as f32, p[1] as f32, p[2] as f32, 0.0));
        source.row(mu, &nus).into_iter().map(node).collect()
    }

    /// Exact nodes at `coords` (row and cosine), of which `wide` in turn share their row.
    fn nodes(
        &self,
        job: &Job,
        source: &impl Source,
        coords: &[(f64, f64)],
        wide: usize,
        mu: &(impl Fn(f64) -> f64 + Sync),
    ) -> Result<Vec<Node>> {
        let rows = job.map(coords.len().div_ceil(wide), |k| {
            let some = &coords[wide * k..coords.len().min(wide * (k + 1))];
            let cosines: Vec<f64> = some.iter().map(|s| s.1).collect();
            Ok(self.nodes_of(source, mu(some[0].0), &cosines))
        })?;
        Ok(rows.into_iter().flatten().collect())
    }

    /// Relative error of the light at a place. That of a part counts as far as the others do not outshine it.
    fn error(&self, got: Node, node: &Node, largest: &[f32; 3], (mu, c): (f64, f64)) -> f64 {
        let view = &self.view;
        // The aerosol's peak may lie beside the place.
        let angle = (self.towards(mu, c).acos() - 0.1).max(0.0);
        let (near, far) = (1.0 - angle.cos(), 1.0 + angle.cos());
        let aerosol = CornetteShanks::new(view.g).at(near, far, f64::sqrt);
        let mut worst = 0.0_f64;
        for k in 0..3 {
            let weights = [view.weights[0][k] * 0.75, view.weights[1][k] * aerosol, 1.0];
            let sum = |x: &dyn Fn(usize) -> f64| (0..3).map(|g| weights[g] * x(g)).sum::<f64>();
            let off = sum(&|g| f64::from((got[g][k] - node[g][k]).abs()));
            let light = sum(&|g| f64::from(node[g][k]));
            worst = worst.max(off / (light.abs() + self.floor() * f64::from(largest[k])));
        }
        worst
    }

    /// Fraction of the largest light that a relative error is measured against at the least: with the sun far below the
    /// horizon most of the sky is nearly black, and a frame may show that part alone.
    fn floor(&self) -> f64 {
        if self.mu_sun < self.view.horizon - 2.0_f64.to_radians().sin() { LOW_FLOOR } else { FLOOR }
    }

    /// Points of the R2 sequence (Roberts 2018), several to a row, and what is there.
    fn probes(&self, job: &Job, source: &impl Source, mu: &(impl Fn(f64) -> f64 + Sync)) -> Result<Probes> {
        let coords: Vec<(f64, f64)> = (0..PROBES)
            .map(|i| {
                let (row, k) = ((i / PROBES_OF_ROW) as f64 + 0.5, (i % PROBES_OF_ROW) as f64);
                let shift = (row * 0.569_840_290_998_053_3).fract();
                ((row * 0.754_877_666_246_692_8).fract(), 2.0 * (k + shift) / PROBES_OF_ROW as f64 - 1.0)
            })
            .collect();
        let nodes = self.nodes(job, source, &coords, PROBES_OF_ROW, mu)?;
        let mut largest = [1e-30_f32; 3];
        for node in &nodes {
            for k in 0..3 {
                let [a, b] = [0, 1].map(|g: usize| self.view.weights[g][k] as f32 * node[g][k]);
                largest[k] = largest[k].max(0.75 * a + b + node[2][k]);
            }
        }
        Ok(Probes { coords, nodes, largest })
    }

    /// The largest error of a table at the probes, in tolerances.
    fn worst(&self, table: &impl Lookup, groups: usize, probes: &Probes, mu: &impl Fn(f64) -> f64) -> f64 {
        let mut worst = 0.0_f64;
        let got = values(table, groups, &probes.coords);
        for ((&(row, c), node), got) in probes.coords.iter().zip(&probes.nodes).zip(got) {
            let error = self.error(got, node, &probes.largest, (mu(row), c));
            // What is not a number is too much.
            worst = if error <= worst { worst } else { error };
        }
        worst / self.view.tolerance
    }

    /// The smallest table within the tolerance, or the largest.
    fn table(
        &self,
        job: &Job,
        source: &impl Source,
        groups: usize,
        probes: &Probes,
        mu: &(impl Fn(f64) -> f64 + Sync),
    ) -> Result<(Table, bool)> {
        let mut found = Err(Error::Empty { name: "table" });
        let mut hopeless = [0; 2];
        for size in SIZES {
            let last = size == SIZES[SIZES.len() - 1];
            if !last && size <= hopeless {
                continue;
            }
            let table = Table::build_rows(job, size, |row, cosines| self.nodes_of(source, mu(row), cosines))?;
            let worst = self.worst(&table, groups, probes, mu);
            let good = worst < self.view.at_probes;
            found = Ok((table, good));
            if good {
                break;
            }
            // The error of a cubic falls with the fourth power of its step at best: sizes that fall short even so are not made.
            hopeless = SIZES
                .into_iter()
                .filter(|s| worst * (size[0] as f64 / s[0] as f64).powi(4) > self.view.at_probes)
                .max()
                .unwrap_or(hopeless);
        }
        found
    }

    /// Cells of a table that are not within the tolerance.
    fn refined_cells(
        &self,
        job: &Job,
        source: &impl Source,
        groups: usize,
        table: &Table,
        probes: &Probes,
        mu: &(impl Fn(f64) -> f64 + Sync),
    ) -> Result<Vec<bool>> {
        let (high, wide) = (table.rows - 1, table.columns - 1);
        let middles: Vec<(f64, f64)> = (0..high * wide)
            .map(|i| {
                let (row, column) = ((i / wide) as f64 + 0.5, (i % wide) as f64 + 0.5);
                (row / high as f64, 2.0 * column / wide as f64 - 1.0)
            })
            .collect();
        let exact = self.nodes(job, source, &middles, wide, mu)?;
        let got = values(table, groups, &middles);
        let bad = |((&(row, c), node), got): ((&(f64, f64), &Node), Node)| {
            self.error(got, node, &probes.largest, (mu(row), c)) > self.view.at_probes * self.view.tolerance
        };
        let bad: Vec<bool> = middles.iter().zip(&exact).zip(got).map(bad).collect();
        // Neighbours of a bad cell may fail at their edges.
        let near = |i: usize| {
            let (row, column) = (i / wide, i % wide);
            (row.saturating_sub(1)..(row + 2).min(high))
                .any(|a| (column.saturating_sub(1)..(column + 2).min(wide)).any(|b| bad[a * wide + b]))
        };
        Ok((0..high * wide).map(near).collect())
    }

    fn tabulate(&self, job: &Job, source: &impl Source) -> Result<Tables> {
        let groups = self.view.groups;
        let mu = |row: f64| self.mu_above(row);
        let probes = self.probes(job, source, &mu)?;
        let (above, good) = self.table(job, source, groups, &probes, &mu)?;
        let mut refined = [None, None];
        if !good {
            refined[0] = Some(self.refined_cells(job, source, groups, &above, &probes, &mu)?);
        }
        let linear = if good { Some(above.resample(job, LINEAR_SIZE)?) } else { None };
        let linear = linear.filter(|linear| self.worst(linear, groups, &probes, &mu) < LINEAR_TOLERANCE);
        let mut below = None;
        if !self.view.extend_horizon {
            let mu = |row: f64| self.mu_below(row);
            let probes = self.probes(job, source, &mu)?;
            let (table, good) = self.table(job, source, 3, &probes, &mu)?;
            if !good {
                refined[1] = Some(self.refined_cells(job, source, 3, &table, &probes, &mu)?);
            }
            below = Some(table);
        }
        Ok(Tables { above, below, refined, linear })
    }

    #[inline(always)]
    fn shade_few(&self, source: &impl Source, block: &mut Block, above: &[bool; BLOCK]) -> [f32; BLOCK] {
        let mut near = [0.0; BLOCK];
        for i in 0..BLOCK {
            let to = DVec3::from_array([0, 1, 2].map(|k: usize| f64::from(block.to[k][i]))).normalize();
            let light = self.radiance(|mu, nu| source.parts(mu, nu), to, above[i]);
            for c in 0..3 {
                block.light[c][i] = light[c] as f32;
            }
            near[i] = (0.5 * (to - self.view.sun).length_squared()) as f32;
        }
        near
    }

    #[inline(always)]
    fn angles(&self, to: &[[f32; BLOCK]; 3], above: &[bool; BLOCK]) -> Angles {
        let view = &self.view;
        let f = |v: DVec3| v.as_vec3().to_array();
        let (z, s) = (f(view.zenith), f(view.sun));
        let (horizon, range) = (view.horizon as f32, 1.0 / (view.top - view.horizon) as f32);
        let depth = 1.0 / (1.0 + view.horizon).max(1e-12) as f32;
        let mu_sun = self.mu_sun as f32;
        let sun_across = (1.0 - self.mu_sun * self.mu_sun).max(0.0).sqrt() as f32;
        let (ends, limb) = (!view.extend_horizon, view.top < 1.0);
        let aerosol = CornetteShanks::<f32>::new(view.g);
        // Along the horizon the cosine to the sun is this fraction of the azimuth's.
        let level = ((1.0 - view.horizon * view.horizon).max(0.0).sqrt()) as f32 * sun_across;
        let level_sun = (view.horizon * self.mu_sun) as f32;
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
            let m = if above[i] || !ends { (mu - horizon) * range } else { (horizon - mu) * depth };
            let u = row_of(if m > 0.0 { m } else { 0.0 });
            out.visible[i] = if limb && u > 1.0 { 0.0 } else { 1.0 };
            out.rows[i] = if u > 1.0 { 1.0 } else { u };
            let extend_horizon = mu < horizon && (above[i] || !ends);
            let flat = if extend_horizon { 1.0 - level_sun - level * c } else { near };
            let hidden = flat > near;
            out.phases[0][i] = rayleigh(flat);
            out.phases[1][i] =
                aerosol.at(if hidden { flat } else { near }, if hidden { 2.0 - flat } else { far }, f32::sqrt);
            out.near[i] = near;
        }
        out
    }

    /// Light of a block by the tables; returns `1 - cos` of the angles from the sun.
    #[inline(always)]
    fn shade_many(
        &self,
        source: &impl Source,
        block: &mut Block,
        above: &[bool; BLOCK],
        tables: &Tables,
    ) -> [f32; BLOCK] {
        let angles = self.angles(&block.to, above);
        match (&tables.linear, self.view.groups) {
            (Some(linear), 1) => self.shade_above::<1>(block, &angles, linear),
            (Some(linear), 2) => self.shade_above::<2>(block, &angles, linear),
            (Some(linear), _) => self.shade_above::<3>(block, &angles, linear),
            (None, 1) => self.shade_above::<1>(block, &angles, &tables.above),
            (None, 2) => self.shade_above::<2>(block, &angles, &tables.above),
            (None, _) => self.shade_above::<3>(block, &angles, &tables.above),
        }
        self.shade_rest(source, block, above, &angles, tables);
        angles.near
    }

    /// Light of the directions above the horizon, or of all where it goes on below.
    #[inline(always)]
    fn shade_above<const G: usize>(&self, block: &mut Block, angles: &Angles, table: &impl Lookup) {
        let mut coords = TableCoords::default();
        table.place(&angles.rows, &angles.cosines, &mut coords);
        let weights = self.vectors();
        for i in 0..BLOCK {
            let first = table.at(0, &coords, i);
            let second = if G > 1 { table.at(1, &coords, i) } else { first };
            let mut value = first * (weights[0] * angles.phases[0][i]) + second * (weights[1] * angles.phases[1][i]);
            // Colours beyond the primaries are negative in the third part; without it only interpolation can be.
            value = if G > 2 { value + table.at(2, &coords, i) } else { value.max(Vec4::ZERO) };
            value *= angles.visible[i];
            for c in 0..3 {
                block.light[c][i] = value[c];
            }
        }
    }

    /// The weights of the first two parts.
    fn vectors(&self) -> [Vec4; 2] {
        self.view.weights.map(|w| Vec4::new(w[0] as f32, w[1] as f32, w[2] as f32, 0.0))
    }

    /// What is below a horizon that does not go on, and cells that the table does not hold.
    #[inline(always)]
    fn shade_rest(
        &self,
        source: &impl Source,
        block: &mut Block,
        above: &[bool; BLOCK],
        angles: &Angles,
        tables: &Tables,
    ) {
        if let Some(lower) = &tables.below {
            let mut coords = TableCoords::default();
            lower.place(&angles.rows, &angles.cosines, &mut coords);
            let weights = self.vectors();
            for i in (0..BLOCK).filter(|&i| !above[i]) {
                let [first, second, rest] = [0, 1, 2].map(|g| lower.at(g, &coords, i));
                let value =
                    first * (weights[0] * angles.phases[0][i]) + second * (weights[1] * angles.phases[1][i]) + rest;
                for c in 0..3 {
                    block.light[c][i] = value[c];
                }
            }
        }
        let below = tables.below.as_ref();
        for (side, table) in [(true, Some(&tables.above)), (false, below)] {
            let (Some(refined), Some(table)) = (&tables.refined[usize::from(!side)], table) else { continue };
            let (high, wide) = (table.rows - 1, table.columns - 1);
            for i in (0..BLOCK).filter(|&i| (above[i] || self.view.extend_horizon) == side && angles.visible[i] > 0.0) {
                let row = ((angles.rows[i] * high as f32) as usize).min(high - 1);
                let column = ((0.5 * (angles.cosines[i] + 1.0) * wide as f32) as usize).min(wide - 1);
                if refined[row * wide + column] {
                    let to = DVec3::from_array([0, 1, 2].map(|k: usize| f64::from(block.to[k][i]))).normalize();
                    let light = self.radiance(|mu, nu| source.parts(mu, nu), to, above[i]);
                    for c in 0..3 {
                        block.light[c][i] = light[c] as f32;
                    }
                }
            }
        }
    }

    /// Which directions of a block are above the horizon.
    #[inline(always)]
    pub fn above(&self, to: &[[f32; BLOCK]; 3]) -> [bool; BLOCK] {
        let z = self.view.zenith.as_vec3().to_array();
        let horizon = self.view.horizon as f32;
        let mut above = [true; BLOCK];
        for i in 0..BLOCK {
            above[i] = to[0][i] * z[0] + to[1][i] * z[1] + to[2][i] * z[2] >= horizon;
        }
        above
    }
}

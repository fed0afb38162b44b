//! Aesthetically-Oriented Atmospheric Scattering (Shen, Mallett, Shkurko 2019): a skydome that is lit once (floor 3).
//!
//! The dome of any radius anywhere in a scene stands for the air over a ball of `radius_ratio` thicknesses: the viewer is
//! moved along the apex by that ratio (eq 2), the direction stays (eq 1), and light is integrated to the top of the air
//! (eqs 3-4, [`Air`]). The apex is constant; the printed radial form flips with the viewer's place and has no value at
//! the centre, where it falls back to up.
//!
//! Fast: the integral is a smooth function of two angles, tabulated at the size that holds the tolerance, measured at
//! points between the nodes when the table is made; phase functions, disc and patterns are exact for each direction.

use std::sync::OnceLock;

use glam::{DVec3, Vec4};

use super::field::{BLOCK, Block, Field};
use super::pattern::Pattern;
use super::table::{Places, Table, row, share};
use crate::air::phase::{CornetteShanks, rayleigh};
use crate::air::single::{Air, March, Ray, Scattered};
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::lanes;

/// Below the horizon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ground {
    /// The sky's horizon goes on.
    Horizon,
    /// A ground of this radiance, behind air where the viewer is above it.
    Color([f64; 3]),
}

/// Integrals for molecules and aerosol, and transmittance; the fourth number of each pads.
type Node = [Vec4; 3];

/// Parameters of a sky; lengths in the air are in units of O'Neil's thickness.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Direction of the sun.
    pub sun: DVec3,
    /// Scattering constants of the channels (the Rayleigh vector) and of the aerosol.
    pub rayleigh: [f64; 3],
    /// Aerosol.
    pub mie: f64,
    /// Asymmetry of the aerosol, positive is forward.
    pub g: f64,
    /// Irradiance of the sun above the air.
    pub intensity: f64,
    /// Radius of the ground.
    pub radius: f64,
    /// Height of the top of the air, for which the dome stands.
    pub thickness: f64,
    /// Scale heights of molecules and aerosol.
    pub scales: [f64; 2],
    /// Viewer in dome radii from the dome's centre.
    pub viewer: DVec3,
    /// Eq 2 as printed.
    pub radial_apex: bool,
    /// The ground hides the sun.
    pub shadow: bool,
    /// Depths by O'Neil's polynomial.
    pub polynomial: bool,
    /// Equal steps instead of quadrature.
    pub march: Option<March>,
    /// Below the horizon.
    pub ground: Ground,
    /// Angular radius of the sun's disc, 0 for none \[rad\].
    pub disc: f64,
    /// Principles.
    pub pattern: Pattern,
    /// Relative error of the fast method.
    pub tolerance: f64,
}

/// A sky ready to be looked at.
#[derive(Debug)]
pub struct Aoas {
    set: Settings,
    air: Air,
    /// Height of the viewer, the vertical there, cosine of the sun's angle to it.
    h: f64,
    zenith: DVec3,
    mu_sun: f64,
    /// Cosines of the lowest ray that passes the ground and of the highest that meets the air.
    horizon: f64,
    top: f64,
    /// The table above the horizon and, for a viewer above a coloured ground, below.
    tables: OnceLock<Tables>,
}

/// Light above the horizon and, for a viewer above a coloured ground, below.
#[derive(Debug)]
struct Tables {
    above: Table,
    below: Option<Table>,
    /// Cells of the upper table that do not hold the tolerance: there the edge of the shadow of the ground passes.
    rough: Option<Vec<bool>>,
}

/// Sizes of the table, tried in turn.
const SIZES: [[usize; 2]; 4] = [[16, 8], [24, 12], [40, 20], [72, 32]];
/// Where the error of a table is measured.
const PROBES: usize = 192;
/// Relative distance of the lowest ray from the ground.
const GRAZE: f64 = 1e-12;
/// The relative error is that against the value plus this share of the largest.
pub const FLOOR: f64 = 1e-3;

impl Aoas {
    /// A sky with these settings.
    pub fn new(set: Settings) -> Result<Self> {
        let unbounded = f64::MAX;
        in_range("radius_ratio", set.radius, 1.0, 1e6, "1")?;
        in_range("thickness", set.thickness, 1e-3, 1e3, "1")?;
        for (name, k) in [("rayleigh", set.rayleigh[0]), ("rayleigh", set.rayleigh[1]), ("rayleigh", set.rayleigh[2])] {
            in_range(name, k, 0.0, 1e3, "1")?;
        }
        in_range("mie", set.mie, 0.0, 1e3, "1")?;
        in_range("g", set.g, -0.9999, 0.9999, "1")?;
        in_range("sun_intensity", set.intensity, 0.0, 1e30, "1")?;
        for scale in set.scales {
            in_range("scale_height", scale, 0.01 * set.thickness, 1e3, "1")?;
        }
        in_range("tolerance", set.tolerance, 1e-5, 0.1, "1")?;
        if !set.viewer.is_finite() || set.viewer.length() > unbounded.sqrt() || !set.sun.is_normalized() {
            return Err(Error::Data { name: "viewer", reason: "must be finite".into() });
        }
        let shell = crate::air::shell::Shell { radius: set.radius, thickness: set.thickness };
        // Eq 2, the dome being as high as the air.
        let place = set.viewer * set.thickness;
        let apex = if set.radial_apex { place.try_normalize().unwrap_or(DVec3::Z) } else { DVec3::Z };
        let up = place.dot(apex);
        let aside = place - apex * up;
        let far = apex * (set.radius + up) + aside;
        let zenith = far.try_normalize().unwrap_or(apex);
        // Height without the difference of two radii; below the ground is on it.
        let h = (2.0 * set.radius * up + up * up + aside.length_squared()) / (far.length() + set.radius);
        let h = h.max(0.0);
        let r = set.radius + h;
        // A trifle above the ray that grazes the ground, so that rounding cannot make it hit.
        let dip = -(h * (2.0 * set.radius + h)).sqrt() / r * (1.0 - GRAZE);
        let outside = h - set.thickness;
        let top = if outside > 0.0 { -(outside * (2.0 * set.radius + set.thickness + h)).sqrt() / r } else { 1.0 };
        let air = Air::new(shell, set.scales, set.rayleigh, set.mie, set.shadow, set.polynomial);
        Ok(Self { air, h, zenith, mu_sun: zenith.dot(set.sun), horizon: dip, top, tables: OnceLock::new(), set })
    }

    /// The part of a ray that is in the air; none if it passes the air by.
    fn ray(&self, mu: f64, nu: f64) -> Option<Ray> {
        let ray = Ray { h: self.h, mu, mu_sun: self.mu_sun, nu };
        if self.h <= self.set.thickness {
            return Some(ray);
        }
        if mu > self.top {
            return None;
        }
        let (r, edge) = (self.set.radius + self.h, self.set.radius + self.set.thickness);
        let gap = (self.h - self.set.thickness) * (r + edge);
        let s = gap / ((r * r * mu * mu - gap).max(0.0).sqrt() - r * mu);
        let sun = (r * self.mu_sun + s * nu) / edge;
        Some(Ray { h: self.set.thickness, mu: (r * mu + s) / edge, mu_sun: sun, nu })
    }

    /// Light without phase functions along a direction given by its cosines.
    #[inline(always)]
    fn scattered(&self, mu: f64, nu: f64, exact: bool) -> Scattered {
        match self.ray(mu, nu) {
            None => Scattered { transmittance: [1.0; 3], ..Default::default() },
            Some(ray) if exact => match self.set.march {
                Some(march) => self.air.march(&ray, march),
                None => self.air.reference(&ray),
            },
            Some(ray) => match self.set.march {
                Some(march) => self.air.march(&ray, march),
                None => self.air.scatter(&ray),
            },
        }
    }

    /// Share of the sun's light that reaches the viewer: what comes through the air, and none of what the ground hides of
    /// a disc of `radius` \[rad\].
    pub fn sunlight(&self, radius: f64) -> [f64; 3] {
        let above = (self.mu_sun.asin() - self.horizon.asin()) / radius;
        let visible = if !self.set.shadow || above >= 1.0 {
            1.0
        } else if above <= -1.0 {
            return [0.0; 3];
        } else {
            0.5 + (above * (1.0 - above * above).sqrt() + above.asin()) / std::f64::consts::PI
        };
        let mu = if self.set.shadow { self.mu_sun.max(self.horizon) } else { self.mu_sun };
        match self.ray(mu, 1.0) {
            None => [visible; 3],
            Some(ray) => {
                let h = ray.h;
                self.air.to_the_top(h, ray.mu).map(|t| visible * t)
            }
        }
    }

    /// Radiance of the sun's disc where it is seen, without the ground.
    fn disc_radiance(&self) -> [f64; 3] {
        let area = std::f64::consts::PI * self.set.disc.sin().powi(2);
        let mu = self.mu_sun.max(self.horizon);
        let through = self.ray(mu, 1.0).map_or([1.0; 3], |ray| self.air.to_the_top(ray.h, ray.mu));
        through.map(|t| self.set.intensity * t / area)
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

    /// The smallest table within the tolerance, and its cells that are not.
    fn table(&self, job: &Job, mu: impl Fn(f64) -> f64 + Sync) -> Result<(Table, Option<Vec<bool>>)> {
        // Probes of the R2 sequence (Roberts 2018).
        let probes: Vec<(f64, f64)> = (0..PROBES)
            .map(|i| {
                let i = i as f64 + 0.5;
                ((i * 0.754_877_666_246_692_8).fract(), 2.0 * (i * 0.569_840_290_998_053_3).fract() - 1.0)
            })
            .collect();
        let exact = self.nodes(job, &probes, &mu)?;
        let mut largest = [1e-30_f32; 3];
        for node in &exact {
            for k in 0..3 {
                let light = 0.75 * self.set.rayleigh[k] as f32 * node[0][k] + self.set.mie as f32 * node[1][k];
                largest[k] = largest[k].max(light);
            }
        }
        let error = |table: &Table, (row, c): (f64, f64), node: &Node| {
            let got = [0, 1].map(|g| table.value(g, row as f32, c as f32));
            self.error(got, node, &largest, (mu(row), c))
        };
        // The probes do not meet the worst place.
        let within = |table: &Table| {
            probes.iter().zip(&exact).all(|(&at, node)| error(table, at, node) < 0.4 * self.set.tolerance)
        };
        let mut found = None;
        for size in SIZES {
            let table = Table::build(job, size, |row, c| {
                lanes::run(
                    #[inline(always)]
                    || self.node(mu(row), c),
                )
            })?;
            let good = within(&table);
            found = Some(table);
            if good {
                break;
            }
        }
        let table = found.ok_or(Error::Empty { name: "table" })?;
        if within(&table) {
            return Ok((table, None));
        }
        // Middles of the cells say where the table fails; their neighbours may fail at their edges.
        let (high, wide) = (table.rows - 1, table.columns - 1);
        let middles: Vec<(f64, f64)> = (0..high * wide)
            .map(|i| {
                let (row, column) = ((i / wide) as f64 + 0.5, (i % wide) as f64 + 0.5);
                (row / high as f64, 2.0 * column / wide as f64 - 1.0)
            })
            .collect();
        let exact = self.nodes(job, &middles, &mu)?;
        let bad: Vec<bool> =
            middles.iter().zip(&exact).map(|(&at, node)| error(&table, at, node) > 0.25 * self.set.tolerance).collect();
        let rough = (0..high * wide).map(|i| {
            let (row, column) = (i / wide, i % wide);
            (row.saturating_sub(1)..(row + 2).min(high))
                .any(|a| (column.saturating_sub(1)..(column + 2).min(wide)).any(|b| bad[a * wide + b]))
        });
        let rough = Some(rough.collect());
        Ok((table, rough))
    }

    /// Rows and columns of the table above the horizon.
    pub fn table_size(&self) -> Option<[usize; 2]> {
        self.tables.get().map(|t| [t.above.rows, t.above.columns])
    }

    /// Fragments of directions, for principles that are not of this crate.
    pub fn pattern(&self) -> &Pattern {
        &self.set.pattern
    }

    /// Light scattered into a direction by quadrature, and what comes through; `above`: it was above the horizon before it
    /// was disturbed.
    #[inline(always)]
    fn scattered_light(&self, to: DVec3, above: bool, exact: bool) -> ([f64; 3], [f64; 3]) {
        let set = &self.set;
        let mu = to.dot(self.zenith).clamp(-1.0, 1.0);
        let nu = to.dot(set.sun).clamp(-1.0, 1.0);
        let clamped = match set.ground {
            Ground::Horizon => mu.max(self.horizon),
            Ground::Color(_) if above => mu.max(self.horizon),
            Ground::Color(_) => mu.min(self.horizon - 10.0 * GRAZE),
        };
        let path = if clamped == mu { nu } else { self.towards(clamped, self.relative(mu, nu)) };
        let s = self.scattered(clamped, path, exact);
        let (near, far) = (0.5 * (to - set.sun).length_squared(), 0.5 * (to + set.sun).length_squared());
        let molecules = rayleigh(near);
        let aerosol = set.mie * CornetteShanks::new(set.g).at(near, far, f64::sqrt);
        let light = |c: usize| set.intensity * (set.rayleigh[c] * molecules * s.rayleigh[c] + aerosol * s.mie[c]);
        ([0, 1, 2].map(light), s.transmittance)
    }

    /// Radiance by quadrature.
    fn radiance(&self, to: DVec3, above: bool, exact: bool) -> [f64; 3] {
        let (light, through) = self.scattered_light(to, above, exact);
        let near = 0.5 * (to - self.set.sun).length_squared();
        let disc = if above && self.in_disc(near) { self.disc_radiance() } else { [0.0; 3] };
        let ground = match self.set.ground {
            Ground::Color(color) if !above => color,
            _ => [0.0; 3],
        };
        [0, 1, 2].map(|c| light[c] + disc[c] + ground[c] * through[c])
    }

    fn in_disc(&self, near: f64) -> bool {
        self.set.disc > 0.0 && near < 2.0 * (0.5 * self.set.disc).sin().powi(2)
    }

    /// Without a table.
    fn shade_few(&self, block: &mut Block, above: &[bool; BLOCK]) {
        for i in 0..BLOCK {
            let to = [0, 1, 2].map(|k: usize| f64::from(block.to[k][i]));
            let light = self.radiance(DVec3::from_array(to).normalize(), above[i], false);
            for c in 0..3 {
                block.light[c][i] = light[c] as f32;
            }
        }
    }

    #[inline(always)]
    fn shade_many(&self, block: &mut Block, above: &[bool; BLOCK], tables: &Tables) {
        let set = &self.set;
        let f = |v: DVec3| v.as_vec3().to_array();
        let (z, s) = (f(self.zenith), f(set.sun));
        let (horizon, range) = (self.horizon as f32, 1.0 / (self.top - self.horizon) as f32);
        let depth = 1.0 / (1.0 + self.horizon).max(1e-12) as f32;
        let mu_sun = self.mu_sun as f32;
        let sun_across = (1.0 - self.mu_sun * self.mu_sun).max(0.0).sqrt() as f32;
        let colored = set.ground != Ground::Horizon;
        let mut rows = [0.0_f32; BLOCK];
        let mut cosines = [0.0_f32; BLOCK];
        let mut phases = [[0.0_f32; BLOCK]; 2];
        let mut nears = [0.0_f32; BLOCK];
        let mie = set.mie as f32;
        let aerosol = CornetteShanks::<f32>::new(set.g);
        let [x, y, w] = &block.to;
        for i in 0..BLOCK {
            let mu = x[i] * z[0] + y[i] * z[1] + w[i] * z[2];
            let (dx, dy, dz) = (x[i] - s[0], y[i] - s[1], w[i] - s[2]);
            let (ex, ey, ez) = (x[i] + s[0], y[i] + s[1], w[i] + s[2]);
            let near = 0.5 * (dx * dx + dy * dy + dz * dz);
            let far = 0.5 * (ex * ex + ey * ey + ez * ez);
            // Of the cross product with the vertical: no cancellation near it.
            let (cx, cy, cz) = (y[i] * z[2] - w[i] * z[1], w[i] * z[0] - x[i] * z[2], x[i] * z[1] - y[i] * z[0]);
            let across = (cx * cx + cy * cy + cz * cz).sqrt() * sun_across;
            let nu = 1.0 - near;
            let known = across > 1e-9;
            let c = (nu - mu * mu_sun) / if known { across } else { 1.0 };
            let c = if known { c } else { 0.0 };
            let c = if c > 1.0 { 1.0 } else { c };
            cosines[i] = if c > -1.0 { c } else { -1.0 };
            let m = if above[i] || !colored { (mu - horizon) * range } else { (horizon - mu) * depth };
            let m = if m > 0.0 { m } else { 0.0 };
            // Above one: the direction passes the air by.
            rows[i] = row(m);
            phases[0][i] = rayleigh(near);
            phases[1][i] = mie * aerosol.at(near, far, f32::sqrt);
            nears[i] = near;
        }
        let upper = &tables.above;
        let mut through = [[0.0_f32; BLOCK]; 3];
        let alike = set.scales[0] == set.scales[1];
        let k = set.rayleigh.map(|k| (k * set.intensity) as f32);
        let intensity = set.intensity as f32;
        let ground = match set.ground {
            Ground::Color(color) => color.map(|c| c as f32),
            Ground::Horizon => [0.0; 3],
        };
        // Beyond the top of the table the direction passes the air by.
        let limb = self.h > set.thickness;
        let mut visible = [1.0_f32; BLOCK];
        for i in 0..BLOCK {
            let past = rows[i] > 1.0;
            visible[i] = if past && limb { 0.0 } else { 1.0 };
            rows[i] = if past { 1.0 } else { rows[i] };
        }
        let mut places = Places::default();
        upper.place(&rows, &cosines, &mut places);
        let mut integrals = [[Vec4::ZERO; BLOCK]; 2];
        for g in 0..if alike { 1 } else { 2 } {
            for i in 0..BLOCK {
                integrals[g][i] = upper.at(g, &places, i);
            }
        }
        if colored {
            let lower = tables.below.as_ref();
            if let Some(lower) = lower {
                lower.place(&rows, &cosines, &mut places);
            }
            for i in 0..BLOCK {
                if above[i] {
                    continue;
                }
                let [molecules, particles, clear] = match lower {
                    Some(lower) => [0, 1, 2].map(|g| lower.at(g, &places, i)),
                    None => [Vec4::ZERO, Vec4::ZERO, Vec4::ONE],
                };
                (integrals[0][i], integrals[1][i]) = (molecules, particles);
                for c in 0..3 {
                    through[c][i] = ground[c] * clear[c];
                }
            }
        }
        let k = Vec4::new(k[0], k[1], k[2], 0.0);
        for i in 0..BLOCK {
            let molecules = integrals[0][i];
            let particles = if alike { molecules } else { integrals[1][i] };
            let value = molecules * (k * phases[0][i]) + particles * (intensity * phases[1][i]);
            let value = value.max(Vec4::ZERO) * visible[i];
            for c in 0..3 {
                block.light[c][i] = value[c];
            }
        }
        if colored {
            for c in 0..3 {
                for i in 0..BLOCK {
                    block.light[c][i] += through[c][i];
                }
            }
        }
        if let Some(rough) = &tables.rough {
            let (high, wide) = (upper.rows - 1, upper.columns - 1);
            for i in 0..BLOCK {
                let row = ((rows[i] * high as f32) as usize).min(high - 1);
                let column = ((0.5 * (cosines[i] + 1.0) * wide as f32) as usize).min(wide - 1);
                if rough[row * wide + column] && (above[i] || !colored) && visible[i] > 0.0 {
                    let to = DVec3::new(f64::from(x[i]), f64::from(y[i]), f64::from(w[i])).normalize();
                    let light = self.scattered_light(to, above[i], false).0;
                    for c in 0..3 {
                        block.light[c][i] = light[c] as f32;
                    }
                }
            }
        }
        if set.disc > 0.0 {
            let disc = self.disc_radiance();
            for i in 0..BLOCK {
                if above[i] && self.in_disc(f64::from(nears[i])) {
                    for c in 0..3 {
                        block.light[c][i] += disc[c] as f32;
                    }
                }
            }
        }
    }

    /// The directions of a block after the principles, which of them were above the horizon, and the fragments.
    #[inline(always)]
    fn disturbed(&self, block: &mut Block, fragments: &mut [[f32; BLOCK]; 3]) -> [bool; BLOCK] {
        let z = self.zenith.as_vec3().to_array();
        let horizon = self.horizon as f32;
        let mut above = [true; BLOCK];
        for i in 0..BLOCK {
            above[i] = block.to[0][i] * z[0] + block.to[1][i] * z[1] + block.to[2][i] * z[2] >= horizon;
        }
        let pattern = &self.set.pattern;
        if pattern.moves() || pattern.tints() {
            pattern.fragments(&block.to, fragments);
        }
        if pattern.moves() {
            pattern.disturb(fragments, &mut block.to);
        }
        above
    }
}

impl Field for Aoas {
    fn prepare(&self, job: &Job) -> Result<()> {
        if self.tables.get().is_none() {
            let (above, rough) = self.table(job, |row| self.mu_above(row))?;
            let sees_ground = self.h > 0.0 && self.set.ground != Ground::Horizon;
            let below = if sees_ground { Some(self.table(job, |row| self.mu_below(row))?.0) } else { None };
            let _ = self.tables.set(Tables { above, below, rough });
        }
        Ok(())
    }

    fn shade(&self, block: &mut Block, few: bool) {
        let tables = if few { None } else { self.tables.get() };
        lanes::run(
            #[inline(always)]
            || {
                let mut fragments = [[0.0; BLOCK]; 3];
                let above = self.disturbed(block, &mut fragments);
                match tables {
                    Some(tables) => self.shade_many(block, &above, tables),
                    None => self.shade_few(block, &above),
                }
                if self.set.pattern.tints() {
                    self.set.pattern.tint(&fragments, &mut block.light);
                }
            },
        );
    }

    fn reference(&self, to: DVec3) -> [f64; 3] {
        let pattern = &self.set.pattern;
        let mut block = Block::default();
        let v = to.as_vec3().to_array();
        for k in 0..3 {
            block.to[k] = [v[k]; BLOCK];
        }
        let mut fragments = [[0.0; BLOCK]; 3];
        let above = self.disturbed(&mut block, &mut fragments)[0];
        // Patterns are what they are in single precision; without them the direction keeps its digits.
        let to = if pattern.moves() {
            DVec3::from_array([0, 1, 2].map(|k: usize| f64::from(block.to[k][0]))).normalize()
        } else {
            to
        };
        let light = self.radiance(to, above, true);
        if !pattern.tints() {
            return light;
        }
        let factor = f64::from(pattern.saturation(&fragments)[0]);
        let v = light[0].max(light[1]).max(light[2]);
        light.map(|c| v - factor * (v - c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geometry::direction;
    use crate::sky::field::{Look, render};

    fn settings(elevation: f64) -> Settings {
        Settings {
            sun: direction(0.3, elevation.to_radians()),
            rayleigh: [0.0025 * 5.602, 0.0025 * 9.473, 0.0025 * 19.644],
            mie: 0.001,
            g: 0.99,
            intensity: 20.0,
            radius: 40.0,
            thickness: 1.0,
            scales: [0.25; 2],
            viewer: DVec3::ZERO,
            radial_apex: false,
            shadow: true,
            polynomial: false,
            march: None,
            ground: Ground::Horizon,
            disc: 0.0,
            pattern: Pattern::default(),
            tolerance: 1e-3,
        }
    }

    #[test]
    fn measure() {
        for (name, change) in [
            ("default", Box::new(|_: &mut Settings| ()) as Box<dyn Fn(&mut Settings)>),
            (
                "earth",
                Box::new(|s: &mut Settings| {
                    s.radius = 106.0;
                    s.scales = [0.133, 0.02];
                }),
            ),
            (
                "thick",
                Box::new(|s: &mut Settings| {
                    s.rayleigh = [0.2, 0.1, 0.02];
                }),
            ),
            (
                "small",
                Box::new(|s: &mut Settings| {
                    s.radius = 8.0;
                }),
            ),
            (
                "high",
                Box::new(|s: &mut Settings| {
                    s.viewer = DVec3::new(0.3, 0.0, 0.5);
                }),
            ),
        ] {
            if std::env::var("FRAME").is_ok() {
                continue;
            }
            for sun in [90.0, 40.0, 5.0, 0.0, -0.5, -1.9, -4.0, -7.0, -10.0] {
                let mut set = settings(sun);
                change(&mut set);
                let sky = Aoas::new(set).expect("valid");
                let start = std::time::Instant::now();
                sky.prepare(&Job::serial()).expect("prepared");
                let built = start.elapsed().as_secs_f64() * 1e3;
                let mut list = Vec::new();
                for i in 0..4000 {
                    let i = f64::from(i);
                    let e = (i * 0.7548776662466927).fract();
                    let e = if e < 0.4 { e * 0.2 } else { e };
                    let d = direction((i * 0.5698402909980532).fract() * 6.2831853, e * 1.5707);
                    list.extend(d.to_array());
                }
                let mut out = vec![0.0_f32; list.len()];
                render(&Job::serial(), &sky, &Look::List(&list), &mut out).expect("rendered");
                let mut exact = vec![0.0; list.len()];
                for i in 0..4000 {
                    let d = DVec3::from_slice(&list[3 * i..]);
                    exact[3 * i..3 * i + 3].copy_from_slice(&sky.radiance(d, true, false));
                }
                let top = exact.iter().fold(0.0_f64, |a, &b| a.max(b));
                let (mut rel, mut abs, mut fl) = (0.0_f64, 0.0_f64, 0.0_f64);
                for (a, b) in out.iter().zip(&exact) {
                    let e = (f64::from(*a) - b).abs();
                    rel = rel.max(e / b.max(1e-30));
                    abs = abs.max(e / top);
                    fl = fl.max(e / (b + 1e-3 * top));
                }
                println!(
                    "{name:8} {sun:6} {:?} {built:6.2} ms  rel {rel:.1e} floor {fl:.1e} of max {abs:.1e}",
                    sky.table_size()
                );
            }
        }
        let sky = Aoas::new(settings(30.0)).expect("valid");
        sky.prepare(&Job::serial()).expect("prepared");
        let camera = crate::math::geometry::Pinhole::new(DVec3::ZERO, [0.3, 0.2, 0.0, 1.0], [1280, 720]).expect("c");
        let mut out = vec![0.0_f32; 1280 * 720 * 3];
        for _ in 0..(if std::env::var("FRAME").is_ok() { 100 } else { 5 }) {
            let start = std::time::Instant::now();
            render(&Job::serial(), &sky, &Look::Camera(&camera), &mut out).expect("rendered");
            let t = start.elapsed().as_secs_f64();
            let copy = std::time::Instant::now();
            let again = std::hint::black_box(out.clone());
            let c = copy.elapsed().as_secs_f64();
            println!(
                "frame {:.2} ms, {:.1} ns a pixel, copy {:.2} ms {}",
                t * 1e3,
                t * 1e9 / 921600.0,
                c * 1e3,
                again[5]
            );
        }
    }
}

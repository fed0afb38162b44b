//! The objective of eq 2, fused: composition, haze search and histograms in one pass over the cloud pixels.
//!
//! `O = 1/3 sum over channels of sum over bins |h_cg - h_usr|`, each histogram divided by its own number of cloud
//! pixels. Histograms are of sRGB-encoded levels, which is what a photograph holds; values outside [0, 1] are clipped
//! into the first and last bin, as the photograph clipped them. The cloud pixels of the picture are those whose ray
//! meets any density: a mask that depended on the extinction would make O jump.
//!
//! Eq 2 is a sum over channels and eq 3 couples a channel only to its own haze, so the search over the haze separates
//! into three independent searches. No picture is written: a block of pixels is composed, and for each haze the bin of
//! each pixel is found from its linear value. The bin of a linear value is exact: a table gives the bin of the value's
//! cell, and one comparison with the next bin's edge settles it. Cost: `docs/speed_vs_error.md`.

use crate::clouds::bases::{Conventions, Parts, ambient_factor, henyey_greenstein, phase_factor, weights};
use crate::error::{Error, Result, in_range};
use crate::math::{elementary, lanes};

/// Cells of the table from linear light to bins: narrower than the darkest bin, so a cell holds at most one edge.
const CELLS: usize = 4096;
const BLOCK: usize = 256;

/// From linear light to bins of encoded levels.
#[derive(Debug, Clone)]
pub struct Bins {
    /// Bin of the low end of each cell; cell `i` holds what rounds to `i` after multiplication by `CELLS - 1`.
    cell: Vec<u8>,
    /// Smallest linear value of the next bin.
    next: [f32; 256],
    count: usize,
}

fn encode(x: f64) -> f64 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

fn cell_of(x: f32) -> usize {
    // The same rounding as in the pixel loop.
    ((x * (CELLS - 1) as f32 + 12_582_912.0).to_bits() & 0xFFFF) as usize
}

impl Bins {
    /// `count` equal bins of encoded levels in [0, 1].
    pub fn new(count: usize) -> Result<Self> {
        in_range("bins", count as f64, 2.0, 256.0, "1")?;
        let bin = |x: f32| ((encode(f64::from(x)) * count as f64) as usize).min(count - 1);
        // The smallest f32 of each bin, by bisection over the bits: positive floats are ordered as integers.
        let mut next = [f32::INFINITY; 256];
        for (b, next) in next.iter_mut().enumerate().take(count - 1) {
            let (mut low, mut high) = (0_u32, 1.0_f32.to_bits());
            while low < high {
                let middle = low + (high - low) / 2;
                if bin(f32::from_bits(middle)) > b { high = middle } else { low = middle + 1 }
            }
            *next = f32::from_bits(low);
        }
        let mut cell = vec![0_u8; CELLS];
        let mut b = 0;
        let mut first = 0;
        for (i, cell) in cell.iter_mut().enumerate() {
            // Advance past every edge that lies in an earlier cell.
            while b + 1 < count && cell_of(next[b]) < i {
                b += 1;
            }
            *cell = b as u8;
            debug_assert!(i == 0 || b - first <= 2, "a cell holds at most one edge");
            first = b;
        }
        Ok(Self { cell, next, count })
    }

    /// How many bins.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Bin of a linear value; NaN goes to bin 0.
    pub fn of(&self, x: f32) -> usize {
        let x = clip(x);
        let b = self.cell[cell_of(x)];
        usize::from(b) + usize::from(x >= self.next[usize::from(b)])
    }
}

#[inline(always)]
fn clip(x: f32) -> f32 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < 1.0 { x } else { 1.0 }
}

/// What the genes mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gene {
    /// `L_in`.
    pub intensity: f64,
    /// Asymmetry.
    pub g: f64,
    /// Extinction \[1/m\].
    pub sigma: f64,
    /// Albedo.
    pub albedo: f64,
    /// `L_amb`.
    pub ambient: f64,
}

impl From<&[f64]> for Gene {
    fn from(x: &[f64]) -> Self {
        Self { intensity: x[0], g: x[1], sigma: x[2], albedo: x[3], ambient: x[4] }
    }
}

/// Everything that stays while parameters change: the cloud pixels, gathered once, and the photograph's histogram.
#[derive(Debug, Clone)]
pub struct Objective {
    depth: Vec<f32>,
    cosine: Vec<f32>,
    scattered: Vec<f32>,
    sky: [Vec<f32>; 3],
    haze_distance: Option<Vec<f32>>,
    nodes: Vec<f64>,
    color: [f32; 3],
    haze: Vec<f64>,
    target: Vec<f64>,
    bins: Bins,
    how: Conventions,
}

/// Value of the objective and the haze of each channel that gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// `O` of eq 2.
    pub objective: f64,
    /// Haze of R, G, B.
    pub haze: [f64; 3],
}

/// Buffers of one evaluation.
struct Block {
    cloud: [[f32; BLOCK]; 3],
    blend: [f32; BLOCK],
    cells: [u32; BLOCK],
}

/// Scalars of one evaluation, ready for the pixel loop.
struct Scalars {
    first: usize,
    weight: [f32; 4],
    source: f32,
    ambient: f32,
    g: f32,
    sigma: f32,
}

#[inline(always)]
fn compose(o: &Objective, s: &Scalars, start: usize, count: usize, cloud: &mut [[f32; BLOCK]; 3]) {
    let pixels = o.depth.len();
    let mut light = [0.0_f32; BLOCK];
    for k in 0..4 {
        if s.weight[k] != 0.0 {
            let image = &o.scattered[(s.first + k) * pixels + start..][..count];
            for (l, &j) in light.iter_mut().zip(image) {
                *l += s.weight[k] * j;
            }
        }
    }
    let (depth, cosine) = (&o.depth[start..start + count], &o.cosine[start..start + count]);
    for c in 0..3 {
        let sky = &o.sky[c][start..start + count];
        for i in 0..count {
            let through = elementary::exp(-s.sigma * depth[i]);
            let glow = s.source * henyey_greenstein(s.g, cosine[i]) * light[i] + s.ambient * (1.0 - through);
            cloud[c][i] = o.color[c] * glow + through * sky[i];
        }
    }
}

/// `sky + a (cloud - sky)`, clipped, and the cell of each value.
#[inline(always)]
fn blend(cloud: &[f32], sky: &[f32], clear: f32, out: &mut [f32], cells: &mut [u32]) {
    for i in 0..cloud.len() {
        let x = clip(cloud[i] * clear + (1.0 - clear) * sky[i]);
        out[i] = x;
        cells[i] = (x * (CELLS - 1) as f32 + 12_582_912.0).to_bits() & (CELLS as u32 - 1);
    }
}

/// The same with a clearness for each pixel.
#[inline(always)]
fn blend_far(cloud: &[f32], sky: &[f32], far: &[f32], haze: f32, out: &mut [f32], cells: &mut [u32]) {
    for i in 0..cloud.len() {
        let clear = elementary::exp(-haze * far[i]);
        let x = clip(cloud[i] * clear + (1.0 - clear) * sky[i]);
        out[i] = x;
        cells[i] = (x * (CELLS - 1) as f32 + 12_582_912.0).to_bits() & (CELLS as u32 - 1);
    }
}

impl Objective {
    /// Gather the cloud pixels of `parts`. `target` holds the photograph's three histograms, each of sum 1, and `haze`
    /// the extinctions of the air to try.
    pub fn new(parts: &Parts<'_>, color: [f64; 3], target: &[f64], haze: Vec<f64>, how: Conventions) -> Result<Self> {
        parts.validate()?;
        if !target.len().is_multiple_of(3) {
            let got = format!("{} elements", target.len());
            return Err(Error::Shape { name: "histogram", expected: "(3, bins)".into(), got });
        }
        let bins = Bins::new(target.len() / 3)?;
        if haze.is_empty() {
            return Err(Error::Empty { name: "haze" });
        }
        for &k in &haze {
            in_range("haze", k, 0.0, 1e9, "1")?;
        }
        for c in color {
            in_range("light_color", c, 0.0, 1e30, "1")?;
        }
        let pixels = parts.depth.len();
        let seen: Vec<usize> = (0..pixels).filter(|&p| parts.depth[p] > 0.0).collect();
        if seen.is_empty() {
            let reason = "the camera does not see the cloud: no ray meets any density".into();
            return Err(Error::Data { name: "basis", reason });
        }
        let gather = |image: &[f32]| seen.iter().map(|&p| image[p]).collect::<Vec<f32>>();
        let scattered =
            (0..parts.nodes.len()).flat_map(|m| gather(&parts.scattered[m * pixels..(m + 1) * pixels])).collect();
        let sky = [0, 1, 2].map(|c| seen.iter().map(|&p| parts.sky[3 * p + c]).collect());
        Ok(Self {
            depth: gather(parts.depth),
            cosine: gather(parts.cosine),
            scattered,
            sky,
            haze_distance: parts.haze_distance.map(gather),
            nodes: parts.nodes.to_vec(),
            color: color.map(|c| c as f32),
            haze,
            target: target.to_vec(),
            bins,
            how,
        })
    }

    /// Cloud pixels.
    pub fn pixels(&self) -> usize {
        self.depth.len()
    }

    /// Evaluate one gene. Parameters outside their meaning give NaN, which a search never chooses.
    pub fn evaluate(&self, gene: Gene) -> Value {
        let bins = self.bins.count;
        let counts = self.histograms(gene);
        let Some(counts) = counts else { return Value { objective: f64::NAN, haze: [0.0; 3] } };
        let scale = 1.0 / self.pixels() as f64;
        let mut value = Value { objective: 0.0, haze: [0.0; 3] };
        for c in 0..3 {
            let mut best = f64::INFINITY;
            for (k, &haze) in self.haze.iter().enumerate() {
                let mine = &counts[(c * self.haze.len() + k) * 256..][..bins];
                let theirs = &self.target[c * bins..(c + 1) * bins];
                let distance: f64 = mine.iter().zip(theirs).map(|(&m, &t)| (f64::from(m) * scale - t).abs()).sum();
                if distance < best {
                    best = distance;
                    value.haze[c] = haze;
                }
            }
            value.objective += best / 3.0;
        }
        value
    }

    /// Counts of the cloud pixels, 256 slots for each channel and haze; `None` outside the basis.
    pub fn histograms(&self, gene: Gene) -> Option<Vec<u32>> {
        let (first, weight) = weights(&self.nodes, gene.sigma, self.how.interpolation).ok()?;
        let sane = gene.g.abs() <= 0.999 && gene.intensity >= 0.0 && gene.ambient >= 0.0;
        if !(sane && (0.0..=1.0).contains(&gene.albedo)) {
            return None;
        }
        let scalars = Scalars {
            first,
            weight,
            source: (gene.intensity * gene.albedo * phase_factor(self.how.phase)) as f32,
            ambient: (gene.ambient * ambient_factor(self.how.ambient, gene.sigma)) as f32,
            g: gene.g as f32,
            sigma: gene.sigma as f32,
        };
        let clear: Vec<f32> = self.haze.iter().map(|k| (-k).exp() as f32).collect();
        let haze: Vec<f32> = self.haze.iter().map(|&k| k as f32).collect();
        let hazes = haze.len();
        // Two tables, for even and odd pixels: neighbours often share a bin, and one counter would stall.
        let mut tables = vec![[[0_u32; 256]; 2]; 3 * hazes];
        let mut block = Block { cloud: [[0.0; BLOCK]; 3], blend: [0.0; BLOCK], cells: [0; BLOCK] };
        let cell: &[u8; CELLS] = self.bins.cell.as_slice().try_into().ok()?;
        for start in (0..self.pixels()).step_by(BLOCK) {
            let count = BLOCK.min(self.pixels() - start);
            lanes::run(
                #[inline(always)]
                || compose(self, &scalars, start, count, &mut block.cloud),
            );
            for c in 0..3 {
                let cloud = &block.cloud[c][..count];
                let sky = &self.sky[c][start..start + count];
                for k in 0..hazes {
                    let (out, cells) = (&mut block.blend[..count], &mut block.cells[..count]);
                    match &self.haze_distance {
                        None => lanes::run(
                            #[inline(always)]
                            || blend(cloud, sky, clear[k], out, cells),
                        ),
                        Some(far) => lanes::run(
                            #[inline(always)]
                            || blend_far(cloud, sky, &far[start..start + count], haze[k], out, cells),
                        ),
                    }
                    scatter(
                        &block.blend[..count],
                        &block.cells[..count],
                        cell,
                        &self.bins.next,
                        &mut tables[c * hazes + k],
                    );
                }
            }
        }
        Some(tables.iter().flat_map(|[even, odd]| (0..256).map(|b| even[b] + odd[b])).collect())
    }
}

#[inline]
fn scatter(values: &[f32], cells: &[u32], cell: &[u8; CELLS], next: &[f32; 256], table: &mut [[u32; 256]; 2]) {
    let bin = |x: f32, at: u32| {
        let b = cell[at as usize & (CELLS - 1)];
        b.wrapping_add(u8::from(x >= next[usize::from(b)]))
    };
    let [even, odd] = table;
    for (x, at) in values.chunks_exact(2).zip(cells.chunks_exact(2)) {
        even[usize::from(bin(x[0], at[0]))] += 1;
        odd[usize::from(bin(x[1], at[1]))] += 1;
    }
    if values.len() % 2 == 1 {
        let last = values.len() - 1;
        even[usize::from(bin(values[last], cells[last]))] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clouds::bases::{Ambient, Interpolation, Phase};

    #[test]
    fn bins_are_those_of_the_encoded_level() {
        for count in [2, 11, 64, 100, 255, 256] {
            let bins = Bins::new(count).expect("valid");
            let check = |x: f32| {
                let expected = ((encode(f64::from(x.clamp(0.0, 1.0))) * count as f64) as usize).min(count - 1);
                assert_eq!(bins.of(x), expected, "{count} bins, {x}");
            };
            for i in 0..=200_000 {
                check(i as f32 / 200_000.0);
            }
            // The floats around every edge.
            for b in 0..count - 1 {
                let edge = bins.next[b].to_bits();
                for near in edge - 3..=edge + 3 {
                    check(f32::from_bits(near));
                }
            }
            check(-1.0);
            check(7.0);
            assert_eq!(bins.of(f32::NAN), 0, "NaN is dark");
        }
    }

    /// A small basis with every feature, and the objective computed the slow way.
    #[test]
    fn the_fused_objective_equals_a_plain_one() {
        let pixels = 777;
        let wave = |i: usize, k: f32| 0.5 + 0.5 * (i as f32 * k).sin();
        let depth: Vec<f32> = (0..pixels).map(|i| if i % 5 == 0 { 0.0 } else { 40.0 * wave(i, 0.37) + 0.1 }).collect();
        let cosine: Vec<f32> = (0..pixels).map(|i| wave(i, 0.11) * 1.8 - 0.9).collect();
        let nodes = [0.01, 0.02, 0.04, 0.08, 0.16];
        let scattered: Vec<f32> = (0..5 * pixels).map(|i| 0.3 * wave(i, 0.21)).collect();
        let sky: Vec<f32> = (0..3 * pixels).map(|i| wave(i, 0.05)).collect();
        let far: Vec<f32> = (0..pixels).map(|i| 0.5 + wave(i, 0.3)).collect();
        let target: Vec<f64> = (0..3 * 64).map(|i| f64::from(wave(i, 0.7)) / 32.0).collect();
        for (haze_distance, ambient) in [(None, Ambient::Extinction), (Some(&far[..]), Ambient::Paper)] {
            let parts = Parts {
                depth: &depth,
                cosine: &cosine,
                scattered: &scattered,
                nodes: &nodes,
                sky: &sky,
                haze_distance,
            };
            let how = Conventions { ambient, phase: Phase::MeanOne, interpolation: Interpolation::Cubic };
            let haze = vec![0.0, 0.4, 1.0];
            let objective = Objective::new(&parts, [1.0, 0.9, 0.8], &target, haze.clone(), how).expect("valid");
            let gene = Gene { intensity: 2.0, g: 0.7, sigma: 0.05, albedo: 0.95, ambient: 0.02 };
            let value = objective.evaluate(gene);
            let (first, w) = weights(&nodes, 0.05, Interpolation::Cubic).expect("inside");
            let bins = Bins::new(64).expect("valid");
            let mut expected = 0.0;
            for c in 0..3 {
                let mut best = (f64::INFINITY, 0.0);
                for &k in &haze {
                    let mut counts = vec![0.0; 64];
                    let mut seen = 0.0;
                    for p in (0..pixels).filter(|&p| depth[p] > 0.0) {
                        let light: f32 = (0..4).map(|n| w[n] * scattered[(first + n) * pixels + p]).sum();
                        let through = (-0.05 * depth[p]).exp();
                        let factor = ambient_factor(ambient, 0.05) as f32 * 0.02;
                        let glow = 1.9 * henyey_greenstein(0.7, cosine[p]) * light + factor * (1.0 - through);
                        let cloud = [1.0, 0.9, 0.8][c] * glow + through * sky[3 * p + c];
                        let clear = (-k as f32 * haze_distance.map_or(1.0, |t| t[p])).exp();
                        counts[bins.of(cloud * clear + (1.0 - clear) * sky[3 * p + c])] += 1.0;
                        seen += 1.0;
                    }
                    let d: f64 = counts.iter().zip(&target[c * 64..]).map(|(n, t)| (n / seen - t).abs()).sum();
                    if d < best.0 {
                        best = (d, k);
                    }
                }
                expected += best.0 / 3.0;
                assert_eq!(value.haze[c], best.1, "haze of channel {c}");
            }
            // A pixel within rounding of an edge may change bins.
            assert!((value.objective - expected).abs() < 0.01, "{} against {expected}", value.objective);
            let outside = objective.evaluate(Gene { sigma: 1.0, ..gene });
            assert!(outside.objective.is_nan(), "outside the basis");
        }
    }
}

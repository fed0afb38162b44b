//! The histogram objective of eq 2 (L1 distance of colour histograms), fused: composition, haze search and histograms
//! in one pass over the cloud pixels.
//!
//! `O = 1/3 sum over channels of sum over bins |h_cg - h_usr|`, each histogram divided by its own number of cloud
//! pixels, or by their weight: with [`Objective::with_opacity`] a pixel counts as its opacity, 1 - T, in steps of 1/256, so
//! that sky seen through the rims of a cloud does not count as cloud, and O is smooth in the extinction. Histograms are of sRGB-encoded levels, which is what a photograph holds; values outside [0, 1] are clipped
//! into the first and last bin, as the photograph clipped them. The cloud pixels of the picture are those whose ray
//! meets any density: a mask that depended on the extinction would make O jump.
//!
//! Eq 2 is a sum over channels and eq 3 couples a channel only to its own haze, so the search over the haze separates
//! into three independent searches. No picture is written: the cloud pixels are composed once, and for each haze they
//! are blended, put into fine cells of linear light, and the bin of each cell counted. Cost: `docs/report/`.

use crate::clouds::bases::{BasisImages, CloudParams, Conventions, Scalars};
use crate::clouds::orders::BasisNodes;
use crate::clouds::phase::henyey_greenstein;
use crate::color::transfer::{decode_exact, encode_exact};
use crate::error::{Error, Result, in_range};
use crate::math::{elementary, lanes};

/// Cells of linear light. Neighbouring 8-bit levels never share a cell: the darkest differ by 1.24 cells.
const CELLS: usize = 4096;
const BLOCK: usize = 512;

/// Bins of sRGB-encoded levels, as ranges of cells of linear light.
///
/// The edge of a bin lies at the boundary of cells nearest to the level `k / count`, on the same side of every 8-bit
/// level as that. So the histogram of an 8-bit photograph is exactly that of its levels, and a continuous picture is
/// binned with edges that are off by at most half a cell, 1.2e-4 of linear light.
#[derive(Debug, Clone)]
pub struct LevelBins {
    /// First cell of each bin, and `CELLS` at the end.
    first: Vec<usize>,
    /// Bin of each cell.
    of_cell: Box<[u8; CELLS]>,
}

/// Cell of a linear value, clipped to [0, 1]; NaN is dark.
#[inline(always)]
fn cell(x: f32) -> u16 {
    let x = if x > 0.0 { x } else { 0.0 };
    // Anything in the last cell, and safely below 2 when 1 is added.
    let last = 1.0 - 0.5 / CELLS as f32;
    let x = if x < last { x } else { last };
    // Adding 1 fixes the exponent: the mantissa is then x in fixed point, and its first 12 bits the cell.
    ((x + 1.0).to_bits() >> 11) as u16 & (CELLS - 1) as u16
}

impl LevelBins {
    /// `count` equal bins of encoded levels in [0, 1].
    pub fn new(count: usize) -> Result<Self> {
        in_range("bins", count as f64, 2.0, 256.0, "1")?;
        let level = |code: usize| usize::from(cell(decode_exact(code as f64 / 255.0) as f32));
        let mut first = vec![0];
        for k in 1..count {
            // The 8-bit levels on either side of the edge: code / 255 < k / count <= (code + 1) / 255.
            let above = (255 * k).div_ceil(count);
            let edge = (decode_exact(k as f64 / count as f64) * CELLS as f64).round() as usize;
            first.push(edge.clamp(level(above - 1) + 1, level(above)));
        }
        first.push(CELLS);
        let mut of_cell = Box::new([0_u8; CELLS]);
        for (b, range) in first.windows(2).enumerate() {
            of_cell[range[0]..range[1]].fill(b as u8);
        }
        Ok(Self { first, of_cell })
    }

    /// How many bins.
    pub fn count(&self) -> usize {
        self.first.len() - 1
    }

    /// Bin of a linear value.
    pub fn of(&self, x: f32) -> usize {
        usize::from(self.of_cell[usize::from(cell(x))])
    }

    /// Largest deviation of an edge from its encoded level \[1\].
    pub fn deviation(&self) -> f64 {
        let n = self.count();
        (1..n)
            .map(|k| (encode_exact(self.first[k] as f64 / CELLS as f64) - k as f64 / n as f64).abs())
            .fold(0.0, f64::max)
    }
}

/// Histogram of `values`, one channel of linear light; its sum is 1, or 0 without values.
pub fn histogram(bins: &LevelBins, values: impl Iterator<Item = f32>) -> Vec<f64> {
    let mut counts = vec![0_u64; bins.count()];
    let mut total = 0_u64;
    for x in values {
        counts[bins.of(x)] += 1;
        total += 1;
    }
    counts.iter().map(|&n| n as f64 / total.max(1) as f64).collect()
}

/// Parameters of a gene: intensity, g, extinction, albedo, ambient. Colours of the lights and the haze are not genes.
pub fn look(gene: [f64; 5], color: [f64; 3], ambient_color: [f64; 3]) -> CloudParams {
    let [intensity, g, sigma, albedo, ambient] = gene;
    CloudParams { intensity, color, g, sigma, albedo, ambient, ambient_color, haze: [0.0; 3] }
}

/// Everything that stays while parameters change: the cloud pixels, gathered once, and the photograph's histogram.
#[derive(Debug, Clone)]
pub struct Objective {
    depth: Vec<f32>,
    cosine: Vec<f32>,
    scattered: Vec<f32>,
    orders: BasisNodes,
    /// Images that the light of higher orders is mixed from.
    multiple: Vec<f32>,
    sky: [Vec<f32>; 3],
    haze_distance: Option<Vec<f32>>,
    light_path: Option<Vec<f32>>,
    nodes: Vec<f64>,
    color: [f64; 3],
    ambient_color: [f64; 3],
    haze: Vec<f64>,
    target: Vec<f64>,
    bins: LevelBins,
    how: Conventions,
    /// Whether a pixel counts as its opacity.
    opacity: bool,
}

/// Weight of an opaque pixel.
const OPAQUE: f32 = 256.0;
/// So many opaque pixels can be counted.
const MOST: usize = 1 << 23;

/// Value of the objective and the haze of each channel that gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// `O` of eq 2.
    pub objective: f64,
    /// Haze of R, G, B.
    pub haze: [f64; 3],
}

/// Counts of bins, one table for each of eight neighbouring pixels: neighbours often share a bin, clipped ones always
/// do, and a counter that is hit again before it is stored stalls.
type Tables = [[u32; 256]; 8];

#[inline(always)]
fn compose(o: &Objective, s: &Scalars, mixture: &[f32], start: usize, cloud: &mut [f32], weights: &mut [u16]) {
    let pixels = o.depth.len();
    let count = cloud.len() / o.planes();
    let mut light = [0.0_f32; BLOCK];
    for k in 0..4 {
        if s.weight[k] != 0.0 {
            let image = &o.scattered[(s.first + k) * pixels + start..][..count];
            for (l, &j) in light.iter_mut().zip(image) {
                *l += s.weight[k] * j;
            }
        }
    }
    let mut more = [0.0_f32; BLOCK];
    for (image, &weight) in o.multiple.chunks_exact(pixels).zip(mixture) {
        for (m, &x) in more.iter_mut().zip(&image[start..start + count]) {
            *m += weight * x;
        }
    }
    let mut transmittance = [0.0_f32; BLOCK];
    let (depth, cosine) = (&o.depth[start..start + count], &o.cosine[start..start + count]);
    let [red, green, blue] = [0, 1, 2].map(|c| &o.sky[c][start..start + count]);
    let (r, rest) = cloud.split_at_mut(count);
    let (g, rest) = rest.split_at_mut(count);
    let (b, direct) = rest.split_at_mut(count);
    for i in 0..count {
        let through = elementary::exp(-s.sigma * depth[i]);
        // A smoothed basis may be below zero in the dark: as in pictures, that is no light.
        let higher = if more[i] > 0.0 { more[i] } else { 0.0 };
        more[i] = s.source * henyey_greenstein(s.g, cosine[i], f32::sqrt) * light[i] + s.multiple * higher;
        let (light, opacity) = (more[i], s.opacity(depth[i], through));
        r[i] = s.color[0] * light + s.ambient[0] * opacity + through * red[i];
        g[i] = s.color[1] * light + s.ambient[1] * opacity + through * green[i];
        b[i] = s.color[2] * light + s.ambient[2] * opacity + through * blue[i];
        transmittance[i] = through;
    }
    for (weight, through) in weights.iter_mut().zip(&transmittance) {
        *weight = (OPAQUE * (1.0 - through) + 0.5) as u16;
    }
    if !direct.is_empty() {
        direct.copy_from_slice(&more[..count]);
    }
}

/// Cells of `clear * cloud + (1 - clear) * sky`.
#[inline(always)]
fn blend(cloud: &[f32], sky: &[f32], clear: f32, out: &mut [u16]) {
    let veil = 1.0 - clear;
    for i in 0..out.len() {
        out[i] = cell(cloud[i] * clear + veil * sky[i]);
    }
}

/// The same with a haze distance for each pixel.
#[inline(always)]
fn blend_far(cloud: &[f32], sky: &[f32], far: &[f32], haze: f32, out: &mut [u16]) {
    for i in 0..out.len() {
        let clear = elementary::exp(-haze * far[i]);
        out[i] = cell(cloud[i] * clear + (1.0 - clear) * sky[i]);
    }
}

/// The same with light of `color` that the haze dims before it reaches the cloud.
#[inline(always)]
fn blend_lit(cloud: &[f32], sky: &[f32], far: &[f32], direct: (&[f32], &[f32], f32), haze: f32, out: &mut [u16]) {
    let (light, path, color) = direct;
    for i in 0..out.len() {
        let lost = color * light[i] * (1.0 - elementary::exp(-haze * path[i]));
        let clear = elementary::exp(-haze * far[i]);
        out[i] = cell((cloud[i] - lost) * clear + (1.0 - clear) * sky[i]);
    }
}

// Not part of a SIMD kernel: look-ups and increments are scalar.
#[inline(never)]
fn count(cells: &[u16], bin: &[u8; CELLS], tables: &mut Tables) {
    let of = |cell: u16| usize::from(bin[usize::from(cell) & (CELLS - 1)]);
    let whole = cells.chunks_exact(8);
    for (&cell, table) in whole.remainder().iter().zip(tables.iter_mut()) {
        table[of(cell)] += 1;
    }
    for eight in whole {
        for k in 0..8 {
            tables[k][of(eight[k])] += 1;
        }
    }
}

/// The same with a weight for each pixel.
#[inline(never)]
fn count_weighed(cells: &[u16], weights: &[u16], bin: &[u8; CELLS], tables: &mut Tables) {
    let of = |cell: u16| usize::from(bin[usize::from(cell) & (CELLS - 1)]);
    let (whole, weighed) = (cells.chunks_exact(8), weights.chunks_exact(8));
    let rest = whole.remainder().iter().zip(weighed.remainder());
    for ((&cell, &weight), table) in rest.zip(tables.iter_mut()) {
        table[of(cell)] += u32::from(weight);
    }
    for (eight, weight) in whole.zip(weighed) {
        for k in 0..8 {
            tables[k][of(eight[k])] += u32::from(weight[k]);
        }
    }
}

/// Counts of channel `c` of the composed `cloud` behind `haze`; without `weights` each pixel counts 1.
fn tally(o: &Objective, cloud: &[f32], weights: &[u16], c: usize, haze: f64, counts: &mut [u32]) {
    let clear = (-haze).exp() as f32;
    let mut tables: Tables = [[0; 256]; 8];
    let mut cells = [0_u16; BLOCK];
    let planes = o.planes();
    for (block, all) in cloud.chunks(planes * BLOCK).enumerate() {
        let (n, start) = (all.len() / planes, block * BLOCK);
        let (cloud, sky) = (&all[c * n..(c + 1) * n], &o.sky[c][start..start + n]);
        match (&o.haze_distance, &o.light_path) {
            (None, _) => lanes::run(
                #[inline(always)]
                || blend(cloud, sky, clear, &mut cells[..n]),
            ),
            (Some(far), None) => lanes::run(
                #[inline(always)]
                || blend_far(cloud, sky, &far[start..start + n], haze as f32, &mut cells[..n]),
            ),
            (Some(far), Some(path)) => {
                let direct = (&all[3 * n..], &path[start..start + n], o.color[c] as f32);
                lanes::run(
                    #[inline(always)]
                    || blend_lit(cloud, sky, &far[start..start + n], direct, haze as f32, &mut cells[..n]),
                );
            }
        }
        if weights.is_empty() {
            count(&cells[..n], &o.bins.of_cell, &mut tables);
        } else {
            count_weighed(&cells[..n], &weights[start..start + n], &o.bins.of_cell, &mut tables);
        }
    }
    for (b, count) in counts.iter_mut().enumerate() {
        *count = tables.iter().map(|t| t[b]).sum();
    }
}

impl Objective {
    /// Gather the cloud pixels of `parts`. `target` holds the photograph's three histograms, each of sum 1, and `haze`
    /// the extinctions of the air to try.
    pub fn new(
        parts: &BasisImages<'_>,
        color: [f64; 3],
        target: &[f64],
        haze: Vec<f64>,
        how: Conventions,
    ) -> Result<Self> {
        parts.validate()?;
        if !target.len().is_multiple_of(3) {
            let got = format!("{} elements", target.len());
            return Err(Error::Shape { name: "histogram", expected: "(3, bins)".into(), got });
        }
        let bins = LevelBins::new(target.len() / 3)?;
        if haze.is_empty() {
            return Err(Error::Empty { name: "haze" });
        }
        for &k in &haze {
            in_range("haze", k, 0.0, 1e9, "1")?;
        }
        look([0.0; 5], color, color).validate()?;
        let pixels = parts.column_density.len();
        let seen: Vec<usize> = (0..pixels).filter(|&p| parts.column_density[p] > 0.0).collect();
        if seen.is_empty() {
            let reason = "the camera does not see the cloud: no ray meets any density".into();
            return Err(Error::Data { name: "basis", reason });
        }
        let gather = |image: &[f32]| seen.iter().map(|&p| image[p]).collect::<Vec<f32>>();
        let scattered = (0..parts.nodes.len())
            .flat_map(|m| gather(&parts.single_scattering[m * pixels..(m + 1) * pixels]))
            .collect();
        let sky = [0, 1, 2].map(|c| seen.iter().map(|&p| parts.sky[3 * p + c]).collect());
        Ok(Self {
            depth: gather(parts.column_density),
            cosine: gather(parts.cosine),
            scattered,
            orders: BasisNodes::default(),
            multiple: Vec::new(),
            sky,
            haze_distance: parts.haze_distance.map(gather),
            light_path: parts.light_path.map(gather),
            nodes: parts.nodes.to_vec(),
            color,
            ambient_color: color,
            haze,
            target: target.to_vec(),
            bins,
            how,
            opacity: false,
        })
    }

    /// Count each pixel as its opacity.
    pub fn with_opacity(mut self) -> Result<Self> {
        if self.pixels() > MOST {
            let reason = format!("has {} pixels of cloud, {MOST} at most can be weighed", self.pixels());
            return Err(Error::Data { name: "basis", reason });
        }
        self.opacity = true;
        Ok(self)
    }

    /// Add the light of higher orders: `images` of the cloud pixels, one after the other, that `orders` mixes.
    pub fn with_orders(mut self, orders: BasisNodes, images: Vec<f32>) -> Result<Self> {
        orders.validate()?;
        if images.len() != orders.rank() * self.pixels() {
            let got = format!("{} elements", images.len());
            let expected = format!("({}, {})", orders.rank(), self.pixels());
            return Err(Error::Shape { name: "multiple", expected, got });
        }
        (self.orders, self.multiple) = (orders, images);
        Ok(self)
    }

    /// Give the ambient light a colour of its own.
    pub fn with_ambient(mut self, color: [f64; 3]) -> Result<Self> {
        look([0.0; 5], self.color, color).validate()?;
        self.ambient_color = color;
        Ok(self)
    }

    /// Values of a cloud pixel: three channels, and the light that its own haze still has to dim.
    fn planes(&self) -> usize {
        if self.light_path.is_some() { 4 } else { 3 }
    }

    /// Cloud pixels.
    pub fn pixels(&self) -> usize {
        self.depth.len()
    }

    /// The photograph's histograms, `(3, bins)`.
    pub fn target(&self) -> &[f64] {
        &self.target
    }

    /// Evaluate one gene. Parameters outside their meaning give NaN, which a search never chooses.
    pub fn evaluate(&self, gene: [f64; 5]) -> Value {
        let nothing = Value { objective: f64::NAN, haze: [0.0; 3] };
        let Some(counts) = self.histograms(gene) else { return nothing };
        let bins = self.bins.count();
        let total: u64 = counts[..bins].iter().map(|&n| u64::from(n)).sum();
        if total == 0 {
            return nothing;
        }
        let scale = 1.0 / total as f64;
        let mut value = Value { objective: 0.0, haze: [0.0; 3] };
        for c in 0..3 {
            let mut best = f64::INFINITY;
            for (k, &haze) in self.haze.iter().enumerate() {
                let mine = &counts[(c * self.haze.len() + k) * bins..][..bins];
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

    /// Counts of the cloud pixels, `(3, hazes, bins)`, in units of 1/256 where they count as their opacity; `None` outside the
    /// basis.
    pub fn histograms(&self, gene: [f64; 5]) -> Option<Vec<u32>> {
        let look = look(gene, self.color, self.ambient_color);
        let scalars = Scalars::new(&self.nodes, &look, self.how).ok()?;
        let mixture = self.orders.weights(look.g, look.sigma, look.albedo, self.how.interpolation).ok()?;
        let pixels = self.pixels();
        // Block by block, red, green and blue of a block after each other.
        let planes = self.planes();
        let mut cloud = vec![0.0_f32; planes * pixels];
        let mut weights = vec![0_u16; if self.opacity { pixels } else { 0 }];
        lanes::run(
            #[inline(always)]
            || {
                for (block, cloud) in cloud.chunks_mut(planes * BLOCK).enumerate() {
                    let start = block * BLOCK;
                    let n = cloud.len() / planes;
                    let weights = if self.opacity { &mut weights[start..start + n] } else { &mut [][..] };
                    compose(self, &scalars, &mixture, start, cloud, weights);
                }
            },
        );
        let bins = self.bins.count();
        let mut counts = vec![0_u32; 3 * self.haze.len() * bins];
        for (which, counts) in counts.chunks_exact_mut(bins).enumerate() {
            let (c, haze) = (which / self.haze.len(), self.haze[which % self.haze.len()]);
            tally(self, &cloud, &weights, c, haze, counts);
        }
        Some(counts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clouds::bases::{Ambient, Interpolation, Phase, ambient_factors, weights};

    #[test]
    fn bins_of_8_bit_levels_are_exact() {
        for count in 2..=256 {
            let bins = LevelBins::new(count).expect("valid");
            for code in 0..=255_usize {
                let expected = (code * count / 255).min(count - 1);
                let x = decode_exact(code as f64 / 255.0) as f32;
                assert_eq!(bins.of(x), expected, "{count} bins, level {code}");
            }
            // Half a cell at the darkest edge is 12.92 / 8192 of a level; a nudge across a cell to stay on the right
            // side of an 8-bit level doubles it.
            assert!(bins.deviation() < 2.0 * 12.92 / 8192.0, "{count} bins: {}", bins.deviation());
        }
        let bins = LevelBins::new(64).expect("valid");
        assert_eq!((bins.of(-1.0), bins.of(7.0), bins.of(f32::NAN)), (0, 63, 0), "clipped, NaN is dark");
        assert_eq!(bins.of(1.0), 63, "white is in the last bin");
        assert_eq!(bins.of(0.999_999_9), 63, "nearly white, too");
    }

    #[test]
    fn a_histogram_sums_to_one() {
        let bins = LevelBins::new(17).expect("valid");
        let h = histogram(&bins, (0..1000).map(|i| i as f32 / 900.0));
        assert!((h.iter().sum::<f64>() - 1.0).abs() < 1e-12, "sum");
        assert!(histogram(&bins, std::iter::empty()).iter().all(|&x| x == 0.0), "no pixels, no counts");
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
        let before: Vec<f32> = (0..pixels).map(|i| 2.0 * wave(i, 0.9)).collect();
        let cases = [
            (None, None, Ambient::Extinction),
            (Some(&far[..]), None, Ambient::Paper),
            (Some(&far[..]), Some(&before[..]), Ambient::Extinction),
        ];
        for (haze_distance, light_path, ambient) in cases {
            let parts = BasisImages {
                column_density: &depth,
                cosine: &cosine,
                single_scattering: &scattered,
                nodes: &nodes,
                multiple: None,
                sky: &sky,
                haze_distance,
                light_path,
            };
            let how = Conventions { ambient, phase: Phase::MeanOne, interpolation: Interpolation::Cubic };
            let haze = vec![0.0, 0.4, 1.0];
            let objective = Objective::new(&parts, [1.0, 0.9, 0.8], &target, haze.clone(), how).expect("valid");
            let objective = objective.with_ambient([0.4, 0.6, 1.0]).expect("valid");
            let gene = [2.0, 0.7, 0.05, 0.95, 0.02];
            let value = objective.evaluate(gene);
            let (first, w) = weights(&nodes, 0.05, Interpolation::Cubic).expect("inside");
            let bins = LevelBins::new(64).expect("valid");
            let mut expected = 0.0;
            for c in 0..3 {
                let mut best = (f64::INFINITY, 0.0);
                for &k in &haze {
                    let mut counts = vec![0.0; 64];
                    let mut seen = 0.0;
                    for p in (0..pixels).filter(|&p| depth[p] > 0.0) {
                        let light: f32 = (0..4).map(|n| w[n] * scattered[(first + n) * pixels + p]).sum();
                        let through = (-0.05 * depth[p]).exp();
                        let factor = ambient_factors(ambient, 0.05)[1] * 0.02;
                        let lit = (-k as f32 * light_path.map_or(0.0, |t| t[p])).exp();
                        let glow = lit * 1.9 * henyey_greenstein(0.7, cosine[p], f32::sqrt) * light;
                        let dim = [0.4, 0.6, 1.0][c] * factor * (1.0 - through);
                        let cloud = [1.0, 0.9, 0.8][c] * glow + dim + through * sky[3 * p + c];
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
            let outside = objective.evaluate([2.0, 0.7, 1.0, 0.95, 0.02]);
            assert!(outside.objective.is_nan(), "outside the basis");
        }
    }
}

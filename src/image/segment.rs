//! Cloud or sky, pixel by pixel (floor 1), for the sky part of a photograph ([`skyline`](super::skyline) finds it).
//!
//! Dobashi, Iwasaki, Ono, Yamamoto, Yue, Nishita, An inverse problem approach for automatically adjusting the
//! parameters for rendering clouds using photographs, ACM Transactions on Graphics 31(6), 2012, §4.1, classify
//! "depending on the chroma of each pixel" and let the user correct. [`CloudFeature::Chroma`] is that reading: HSV
//! saturation of the encoded values, Otsu's threshold. The default, [`CloudFeature::Nbr`], deviates: the normalised
//! difference (B - R) / (B + R) of linear light, and Otsu's threshold of its histogram mixed with a prior of two lobes,
//! N(0.12, 0.08) for cloud and N(0.58, 0.10) for sky. Measured on three labelled sets (SWIMSEG, WSISEG, HYTA; mean
//! error): 8.9, 9.6, 7.6 % against 9.6, 14.2, 15.2 % for chroma; 5 % prior, whose weight was chosen on the same sets.
//! The prior matters for overcast and for cloudless pictures, where Otsu alone splits noise.
//!
//! The split at the threshold is always the best guess of the clouds; the verdict says how far it is believed, and does not
//! empty it. It is "mixed" if both classes hold at least 0.5 % of the pixels, their means differ by 0.1, and one of two signs
//! of clouds is there. Edges: over a distance of 2 % of the picture, the median step across the border is at least 0.19 of
//! the difference of the means (haze of a clear horizon and the glow around the Sun have 0.10 to 0.14 in our photographs,
//! clouds 0.24 to 0.65). Structure: what a cubic surface leaves of the feature has a deviation of at least 0.03, in pictures
//! without land, or 0.09 and half as much edge again where a horizon's haze bends the surface; soft clouds and veils have no
//! edges. (Of 116 clear and 99 cloudy pictures of a labelled set, structure misjudges 4 and 2, edges 16 and 24.) Otherwise the
//! picture is overcast where the pixels are grey (9 of 10 below 0.25, and 9 of 10 within 0.4), all of it cloud, and
//! cloudless where they are not; without structure the threshold is then at most 0.15, since the halves of a smooth sky are no
//! classes. A picture whose brightest twentieth is below 0.03 is "night": colour says little there, so it is that of means
//! of 5 × 5 pixels, and the threshold is Otsu's own. Under a low Sun the sky may be redder than its clouds: where the
//! threshold is below 0.2, clouds are the side whose luminance is rougher, by 1.3. The confidence of a verdict, in
//! \[0.5, 1), is the logistic of twice the distance from its limits in octaves.
//!
//! Accuracy on rendered skies whose clouds are known: `tests/papers/test_labelled_skies.py`.

use super::blur::blur;
use super::otsu;
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::least_squares::{NormalEquations, centered};
use crate::math::{elementary, lanes};

/// What a pixel is judged by; larger is bluer in both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CloudFeature {
    /// (B - R) / (B + R) of linear light, in [-1, 1].
    Nbr,
    /// HSV saturation of the sRGB-encoded values, in [0, 1].
    Chroma,
}

impl CloudFeature {
    /// The feature of this name.
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "nbr" => Ok(Self::Nbr),
            "chroma" => Ok(Self::Chroma),
            other => {
                Err(Error::Data { name: "method", reason: format!("must be \"nbr\" or \"chroma\", got {other:?}") })
            }
        }
    }
}

/// What the sky is like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Clouds and sky.
    Mixed,
    /// No cloud that can be told from the sky.
    Cloudless,
    /// Nothing but cloud.
    Overcast,
    /// Too dark for colour to tell.
    Night,
}

impl Verdict {
    /// As Python shows it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mixed => "mixed",
            Self::Cloudless => "cloudless",
            Self::Overcast => "overcast",
            Self::Night => "night",
        }
    }
}

/// The classes of a photograph.
#[derive(Debug, Clone)]
pub struct Classes {
    /// Cloud.
    pub cloud: Vec<bool>,
    /// What the pixels were judged by; also where there is ground.
    pub feature: Vec<f32>,
    /// Sky is `feature > threshold`; below it if `inverted`.
    pub threshold: f64,
    /// Whether the sky is redder than its clouds.
    pub inverted: bool,
    /// Variance between the two sides of the threshold over the variance of the feature.
    pub separability: f64,
    /// Median step across the border over the difference of the means.
    pub contrast: f64,
    /// Deviation of what a cubic surface leaves of the feature.
    pub structure: f64,
    /// Whether that split is believed.
    pub verdict: Verdict,
    /// How clearly, in [0.5, 1).
    pub confidence: f64,
}

const BINS: usize = 256;
/// Histograms span [-1, 1].
const WIDTH: f64 = 2.0 / BINS as f64;
const LEAST_CLASS: f64 = 0.005;
const LEAST_DIFFERENCE: f64 = 0.1;
const LEAST_CONTRAST: f64 = 0.19;
/// Structure of clouds without land, and with it, where edges of so much are wanted as well.
const LEAST_STRUCTURE: [f64; 2] = [0.03, 0.09];
const LEAST_EDGE: f64 = 0.12;
/// Fraction of land from which on a picture has a horizon.
const LAND: f64 = 0.02;
/// Brightest twentieth of a picture of the night.
const NIGHT: f64 = 0.03;
/// What is bluer is sky in a sky without structure.
const EMPTY: f64 = 0.15;
/// Below this threshold the light is red enough for a sky redder than its clouds, where these are rougher by this factor.
const RED: f64 = 0.2;
const INVERTED: f64 = 1.3;
const GREY: f64 = 0.25;
const GREY_SPREAD: f64 = 0.4;

/// (B - R) / (B + R), 0 for black; negative light counts as none.
#[inline(always)]
fn nbr(rgb: &[f32]) -> f32 {
    let r = if rgb[0] > 0.0 { rgb[0] } else { 0.0 };
    let b = if rgb[2] > 0.0 { rgb[2] } else { 0.0 };
    let sum = r + b;
    let out = (b - r) / sum;
    if sum > 0.0 { out } else { 0.0 }
}

/// x^(1/12) for normal x > 0: a guess from the exponent and five Newton steps, relative error below 1e-6.
#[inline(always)]
fn twelfth_root(x: f32) -> f32 {
    const ONE: u32 = 127 << 23;
    let mut y = f32::from_bits(x.to_bits() / 12 + (ONE - ONE / 12));
    for _ in 0..5 {
        let y3 = y * y * y;
        let y6 = y3 * y3;
        y *= (11.0 + x / (y6 * y6)) * (1.0 / 12.0);
    }
    y
}

/// sRGB encoding of one value by five Newton steps: absolute error 2e-6 on `[0, 1]`. A copy of its own, since a room
/// does not see its neighbours (`color::transfer::encode`), and with other bits, on which thresholds stand.
#[inline(always)]
fn encode(x: f32) -> f32 {
    let curve = x > 0.0031308;
    let y = twelfth_root(if curve { x } else { 1.0 });
    let y2 = y * y;
    if curve { 1.055 * (y2 * y2 * y) - 0.055 } else { 12.92 * x }
}

/// (max - min) / max of the encoded values, 0 for black.
#[inline(always)]
fn saturation(rgb: &[f32]) -> f32 {
    let clip = |x: f32| if x > 0.0 { x } else { 0.0 };
    let (r, g, b) = (clip(rgb[0]), clip(rgb[1]), clip(rgb[2]));
    let high = if r > g { r } else { g };
    let high = if high > b { high } else { b };
    let low = if r < g { r } else { g };
    let low = if low < b { low } else { b };
    let out = 1.0 - encode(low) / encode(high);
    if high > 0.0 { out } else { 0.0 }
}

/// The feature of each pixel of a linear-light picture.
pub fn feature(job: &Job, rgb: &[f32], method: CloudFeature) -> Result<Vec<f32>> {
    const CHUNK: usize = 1 << 15;
    let mut out = vec![0.0; rgb.len() / 3];
    job.chunks(&mut out, CHUNK, |chunk, out| {
        let rgb = &rgb[3 * chunk * CHUNK..][..3 * out.len()];
        lanes::run(
            #[inline(always)]
            || match method {
                CloudFeature::Nbr => {
                    for (o, pixel) in out.iter_mut().zip(rgb.chunks_exact(3)) {
                        *o = nbr(pixel);
                    }
                }
                CloudFeature::Chroma => {
                    for (o, pixel) in out.iter_mut().zip(rgb.chunks_exact(3)) {
                        *o = saturation(pixel);
                    }
                }
            },
        );
        Ok(())
    })?;
    Ok(out)
}

/// Bin of a feature.
fn bin(x: f32) -> usize {
    (((f64::from(x) + 1.0) / WIDTH) as usize).min(BINS - 1)
}

/// The histogram as fractions of 2^40, mixed with `weight` of the two-lobe prior.
fn mixed(counts: &[u64], weight: f64) -> Vec<u64> {
    let lobe = |x: f32, mean: f32, sd: f32| {
        let t = (x - mean) / sd;
        f64::from(elementary::exp(-0.5 * t * t) / sd)
    };
    let prior: Vec<f64> = (0..BINS)
        .map(|k| {
            let x = ((k as f64 + 0.5) * WIDTH - 1.0) as f32;
            lobe(x, 0.12, 0.08) + lobe(x, 0.58, 0.10)
        })
        .collect();
    let all: u64 = counts.iter().sum();
    let whole: f64 = prior.iter().sum();
    let one = (1_u64 << 40) as f64;
    (0..BINS)
        .map(|k| (((1.0 - weight) * counts[k] as f64 / all as f64 + weight * prior[k] / whole) * one).round() as u64)
        .collect()
}

/// Smallest bin edge below which at least `fraction` of the counts lie.
fn quantile(counts: &[u64], fraction: f64) -> f64 {
    let all: u64 = counts.iter().sum();
    let mut below = 0;
    for (k, n) in counts.iter().enumerate() {
        below += n;
        if below as f64 >= fraction * all as f64 {
            return (k as f64 + 0.5) * WIDTH - 1.0;
        }
    }
    1.0
}

/// Median step of the feature across the border of the classes, over 2 % of a grid of at most 200 cells.
fn border_step(feature: &[f32], ground: &[bool], h: usize, w: usize, threshold: f32) -> f32 {
    let size = h.max(w).div_ceil(200);
    let (gh, gw) = (h.div_ceil(size), w.div_ceil(size));
    let (mut sum, mut count) = (vec![0.0_f64; gh * gw], vec![0_u32; gh * gw]);
    let mut covered = vec![false; gh * gw];
    for y in 0..h {
        for x in 0..w {
            let (i, j) = (y * w + x, (y / size) * gw + x / size);
            if ground[i] {
                covered[j] = true;
            } else {
                sum[j] += f64::from(feature[i]);
                count[j] += 1;
            }
        }
    }
    let cell = |j: usize| (sum[j] / f64::from(count[j])) as f32;
    let reach = (gh.max(gw) / 50).max(1);
    // The last three cells above the ground may hold some of it.
    let near_ground = |y: usize, x: usize| (y..(y + 3).min(gh)).any(|y| covered[y * gw + x]);
    let mut steps = Vec::new();
    for y in 0..gh {
        for x in 0..gw {
            for (dy, dx) in [(0, reach), (reach, 0)] {
                if y + dy < gh && x + dx < gw && !near_ground(y, x) && !near_ground(y + dy, x + dx) {
                    let (a, b) = (cell(y * gw + x), cell((y + dy) * gw + x + dx));
                    if (a > threshold) != (b > threshold) {
                        steps.push((a - b).abs());
                    }
                }
            }
        }
    }
    if steps.is_empty() {
        return 0.0;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Deviation of what a cubic surface leaves of the feature outside `ground`, on a grid of at most 100 cells.
fn structure(feature: &[f32], ground: &[bool], h: usize, w: usize) -> f64 {
    let size = h.max(w).div_ceil(100);
    let (gh, gw) = (h.div_ceil(size), w.div_ceil(size));
    let (mut sum, mut count) = (vec![0.0_f64; gh * gw], vec![0.0_f64; gh * gw]);
    for (i, (&x, _)) in feature.iter().zip(ground).enumerate().filter(|(_, (_, g))| !**g) {
        let cell = (i / w / size) * gw + i % w / size;
        sum[cell] += f64::from(x);
        count[cell] += 1.0;
    }
    let terms = |cell: usize| {
        let (x, y) = (centered(gw, cell % gw), centered(gh, cell / gw));
        [1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y]
    };
    let filled: Vec<usize> = (0..gh * gw).filter(|&c| count[c] > 0.0).collect();
    let mut equations = NormalEquations::default();
    for &cell in &filled {
        equations.add(count[cell], &terms(cell), sum[cell] / count[cell]);
    }
    // Few cells leave terms open.
    let ridge = 1e-9 * equations.trace();
    let surface = equations.solve(ridge, 0);
    let (mut squares, mut all) = (0.0, 0.0);
    for &cell in &filled {
        let smooth: f64 = terms(cell).iter().zip(surface).map(|(t, s)| t * s).sum();
        squares += count[cell] * (sum[cell] / count[cell] - smooth).powi(2);
        all += count[cell];
    }
    (squares / all).sqrt()
}

/// Deviation of the logarithm of luminance from a smooth surface, on either side of the threshold: clouds are rougher than
/// the sky between them. On a grid of at most 100 cells, those that lie on one side.
fn roughness(rgb: &[f32], feature: &[f32], ground: &[bool], (h, w): (usize, usize), threshold: f32) -> [f64; 2] {
    let size = h.max(w).div_ceil(100);
    let (gh, gw) = (h.div_ceil(size), w.div_ceil(size));
    let mut cells = vec![[0.0_f64; 3]; gh * gw];
    for (i, p) in rgb.chunks_exact(3).enumerate().filter(|(i, _)| !ground[*i]) {
        let cell = &mut cells[(i / w / size) * gw + i % w / size];
        cell[0] += luminance(p);
        cell[1] += 1.0;
        cell[2] += f64::from(u8::from(feature[i] > threshold));
    }
    let terms = |cell: usize| {
        let (x, y) = (centered(gw, cell % gw), centered(gh, cell / gw));
        [1.0, x, y, x * x, x * y, y * y]
    };
    [0.0, 1.0].map(|side| {
        let mine = |c: &[f64; 3]| c[1] > 0.0 && (c[2] / c[1] - side).abs() < 0.1;
        let light: Vec<(usize, f64)> = (0..gh * gw)
            .filter(|&c| mine(&cells[c]))
            .map(|c| (c, (cells[c][0] / cells[c][1]).max(1e-3).ln()))
            .collect();
        let mut equations = NormalEquations::default();
        for &(cell, value) in &light {
            equations.add(1.0, &terms(cell), value);
        }
        let ridge = 1e-9 * equations.trace();
        let surface = equations.solve(ridge, 0);
        let off = |&(cell, value): &(usize, f64)| {
            (value - terms(cell).iter().zip(surface).map(|(t, s)| t * s).sum::<f64>()).powi(2)
        };
        (light.iter().map(off).sum::<f64>() / light.len().max(1) as f64).sqrt()
    })
}

fn luminance(p: &[f32]) -> f64 {
    0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
}

/// Luminance that a twentieth of the pixels outside `ground` exceed, from a histogram of its logarithm.
fn brightest(rgb: &[f32], ground: &[bool]) -> f64 {
    // From 2^-24 on, 16 bins an octave.
    let mut counts = [0_u64; 512];
    for (p, _) in rgb.chunks_exact(3).zip(ground).filter(|(_, g)| !**g) {
        counts[(16.0 * (luminance(p).max(1e-12).log2() + 24.0)).clamp(0.0, 511.0) as usize] += 1;
    }
    let all: u64 = counts.iter().sum();
    let mut above = 0;
    for (k, &n) in counts.iter().enumerate().rev() {
        above += n;
        if 20 * above >= all {
            return ((k as f64 + 0.5) / 16.0 - 24.0).exp2();
        }
    }
    0.0
}

/// Classify the pixels outside `ground` of a linear-light `(h, w, 3)` picture.
pub fn classify(
    job: &Job,
    rgb: &[f32],
    (h, w): (usize, usize),
    ground: &[bool],
    method: CloudFeature,
    prior: f64,
) -> Result<Classes> {
    let light = brightest(rgb, ground);
    let night = light < NIGHT;
    let feature = if night {
        // Little but noise is left of its colours: means of 5 × 5 pixels.
        feature(job, &blur(&blur(rgb, [h, w, 3], job)?, [h, w, 3], job)?, method)?
    } else {
        feature(job, rgb, method)?
    };
    let mut counts = vec![0_u64; BINS];
    for (&x, _) in feature.iter().zip(ground).filter(|&(_, &g)| !g) {
        counts[bin(x)] += 1;
    }
    let all: u64 = counts.iter().sum();
    if all == 0 {
        return Err(Error::Data { name: "ground", reason: "leaves no pixel of the sky: nothing at the top of the picture looks like sky, pass a mask of the ground or None".into() });
    }
    let weight = if method == CloudFeature::Nbr && !night { prior } else { 0.0 };
    let cut = otsu::of_counts(&mixed(&counts, weight), "photo")?;
    let mut threshold = (cut.value + 1.0) * WIDTH - 1.0;

    let (mut low, mut high, mut squares) = ((0.0, 0.0), (0.0, 0.0), 0.0);
    for (&x, _) in feature.iter().zip(ground).filter(|&(_, &g)| !g) {
        let x = f64::from(x);
        let class = if x > threshold { &mut high } else { &mut low };
        class.0 += 1.0;
        class.1 += x;
        squares += x * x;
    }
    let n = all as f64;
    let mean = (low.1 + high.1) / n;
    let variance = squares / n - mean * mean;
    let difference: f64 = if low.0 > 0.0 && high.0 > 0.0 { high.1 / high.0 - low.1 / low.0 } else { 0.0 };
    let between = low.0 * high.0 / (n * n) * difference * difference;
    let separability = if variance > 0.0 { (between / variance).clamp(0.0, 1.0) } else { 0.0 };
    let contrast = if difference > 0.0 {
        f64::from(border_step(&feature, ground, h, w, threshold as f32)) / difference
    } else {
        0.0
    };

    let structure = structure(&feature, ground, h, w);
    let land = usize::from((ground.len() - all as usize) as f64 > LAND * ground.len() as f64);
    let octaves = |value: f64, limit: f64| (value.max(1e-9) / limit).log2();
    let by_structure = if land == 1 {
        octaves(structure, LEAST_STRUCTURE[1]).min(octaves(contrast, LEAST_EDGE))
    } else {
        octaves(structure, LEAST_STRUCTURE[0])
    };
    let two = low.0.min(high.0) >= LEAST_CLASS * n && difference >= LEAST_DIFFERENCE;
    let signs = octaves(contrast, LEAST_CONTRAST).max(by_structure);
    let (grey, spread) = (quantile(&counts, 0.9), quantile(&counts, 0.95) - quantile(&counts, 0.05));
    let colours = octaves(grey, GREY).max(octaves(spread, GREY_SPREAD));
    let (verdict, evidence) = if night {
        (Verdict::Night, octaves(light, NIGHT))
    } else if two && signs >= 0.0 {
        (Verdict::Mixed, signs)
    } else if grey < GREY && spread < GREY_SPREAD {
        (Verdict::Overcast, colours)
    } else {
        (Verdict::Cloudless, if two { signs } else { colours })
    };
    let smooth = verdict == Verdict::Cloudless && structure < LEAST_STRUCTURE[0];
    if smooth {
        // The halves of a smooth sky are no classes.
        threshold = threshold.min(EMPTY);
    }
    // Under a low Sun the sky may be redder than its clouds.
    let split = two && matches!(verdict, Verdict::Mixed | Verdict::Cloudless) && !smooth;
    let inverted = split && threshold < RED && {
        let [low, high] = roughness(rgb, &feature, ground, (h, w), threshold as f32);
        INVERTED * low < high
    };
    let confidence = 1.0 / (1.0 + (-2.0 * evidence.abs()).exp());
    let all_cloud = verdict == Verdict::Overcast;
    let cloud = feature
        .iter()
        .zip(ground)
        .map(|(&x, &g)| !g && (all_cloud || (f64::from(x) <= threshold) != inverted))
        .collect();
    Ok(Classes { cloud, feature, threshold, inverted, separability, contrast, structure, verdict, confidence })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_is_srgb() {
        for k in 0..=1000 {
            let x = k as f32 / 1000.0;
            let exact = if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            assert!((encode(x) - exact).abs() < 2e-6, "{x}: {} {exact}", encode(x));
        }
        assert!((encode(1e6) - (1.055 * 1e6_f32.powf(1.0 / 2.4) - 0.055)).abs() < 1e-3, "far above 1");
    }

    #[test]
    fn features_of_known_colours() {
        let rgb = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.1, 0.2, 0.4, -1.0, 0.0, 1.0];
        let job = Job::serial();
        let f = feature(&job, &rgb, CloudFeature::Nbr).expect("runs");
        assert_eq!(f[..4], [0.0, 0.0, 1.0, -1.0], "black, white, blue, red");
        assert!((f[4] - 0.6).abs() < 1e-6, "(0.4 - 0.1) / 0.5");
        assert_eq!(f[5], 1.0, "negative red is none");
        let s = feature(&job, &rgb, CloudFeature::Chroma).expect("runs");
        assert_eq!(s[..4], [0.0, 0.0, 1.0, 1.0], "black, white, blue, red");
    }
}

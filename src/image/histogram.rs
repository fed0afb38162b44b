//! Exact histograms of interleaved pictures, 1 to 4 channels (floor 1).
//!
//! The bin of `x` is `floor((x - low) * (n / (high - low)))` in f64; the last bin is closed at `high` (numpy's rule).
//! What lies below, above or is NaN is counted beside the bins, so that the counts of a channel always sum to the
//! number of pixels looked at. Counts are u64.
//!
//! Method: blocks of 256 pixels become slot numbers in a branch-free loop that vectorises (under, over and NaN are
//! slots behind the bins), then scatter into four private u32 tables (a constant picture would otherwise wait for its
//! own last store at each pixel), which are added to the u64 counts once a chunk, before they can overflow. Where the
//! scale is a power of two and `low` is 0 the f32 product is already exact and the loop runs in f32: same bins.
//! 8-bit pictures are counted by level and the 256 levels are sorted into the bins afterwards.
//!
//! Cost: `docs/report/`.

use super::{Sample, check_mask};
use crate::error::{Error, Result};
use crate::job::Job;
use crate::math::lanes;

/// Most bins of one histogram: table indices stay far below 2^22, where the f32 rounding trick ends.
pub const MAX_BINS: usize = 1 << 20;
/// Most channels of an interleaved picture.
pub const MAX_CHANNELS: usize = 4;

/// Pixels between two reads of the cancel flag; u32 tables cannot overflow within a chunk.
const CHUNK: usize = 1 << 17;
const BLOCK: usize = 256;
/// Pixels of 8 bits that are looked at for being all the same.
const RUN: usize = 128;
/// Slots of the tables that live on the stack: 256 bins, under, over, NaN. Not a multiple of 1024, so that the twelve
/// tables do not compete for the same lines of the first-level cache.
const SMALL: usize = 272;
const COPIES: usize = 4;

/// Counts of one picture; channel `c` has its bins at `bins[c * n..][..n]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counts {
    /// Samples in each bin, channel after channel.
    pub bins: Vec<u64>,
    /// Samples below the range, per channel.
    pub under: Vec<u64>,
    /// Samples above the range, per channel.
    pub over: Vec<u64>,
    /// Samples that are NaN, per channel.
    pub nan: Vec<u64>,
}

/// `n` bins of equal width over `[low, high]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bins {
    n: usize,
    low: f64,
    high: f64,
    scale: f64,
}

impl Bins {
    /// Bins over a finite range with `low < high`.
    pub fn new(n: usize, low: f64, high: f64) -> Result<Self> {
        if n == 0 || n > MAX_BINS {
            return Err(Error::Range { name: "bins", got: n as f64, low: 1.0, high: MAX_BINS as f64, unit: "1" });
        }
        let scale = n as f64 / (high - low);
        if !(low < high && (high - low).is_finite() && scale.is_finite()) {
            let reason = format!("must rise, and be finite and its width too, got ({low:e}, {high:e})");
            return Err(Error::Data { name: "range", reason });
        }
        let bins = Self { n, low, high, scale };
        // A number of the range's size must be able to tell neighbouring bins apart.
        let step = low.abs().max(high.abs()) * f64::EPSILON;
        if (high - low) / (n as f64) < step && bins.edges().windows(2).any(|e| e[0] >= e[1]) {
            let reason = format!("must be wide enough for {n} bins, got ({low:e}, {high:e})");
            return Err(Error::Data { name: "range", reason });
        }
        Ok(bins)
    }

    /// Edges of the bins: each is the least number that its bin counts, so that no sample lies outside the edges of the
    /// bin it is counted in. They are within two units in the last place of evenly spaced numbers.
    pub fn edges(&self) -> Vec<f64> {
        let even = |k: usize| self.low + k as f64 * ((self.high - self.low) / self.n as f64);
        let bin = |x: f64| (((x - self.low) * self.scale) as usize).min(self.n - 1);
        let mut edges: Vec<f64> = (0..self.n).map(even).collect();
        edges[0] = self.low;
        let near = 8.0 * f64::EPSILON * self.low.abs().max(self.high.abs());
        for k in 1..self.n {
            // Between a number that lies below the bin and one that lies in it: halved until they are neighbours.
            let (mut below, mut within) = ((edges[k] - near).max(self.low), (edges[k] + near).min(self.high));
            loop {
                let middle = below + 0.5 * (within - below);
                if middle <= below || middle >= within {
                    break;
                }
                if bin(middle) >= k {
                    within = middle;
                } else {
                    below = middle;
                }
            }
            edges[k] = if bin(below) >= k { below } else { within };
        }
        edges.push(self.high);
        edges
    }

    /// Slot of one value: the scalar form of the block kernels.
    fn slot(&self, x: f64) -> usize {
        if x.is_nan() {
            self.n + 2
        } else if x > self.high {
            self.n + 1
        } else if x < self.low {
            self.n
        } else {
            (((x - self.low) * self.scale) as usize).min(self.n - 1)
        }
    }

    /// f32 arithmetic gives the f64 slots: the product with a power of two is exact.
    fn single_is_exact(&self) -> bool {
        let bits = self.scale.to_bits();
        let power_of_two = bits & ((1 << 52) - 1) == 0 && (2f64.powi(-60)..2f64.powi(60)).contains(&self.scale);
        self.low == 0.0 && power_of_two && f64::from(self.high as f32) == self.high
    }
}

/// Adding this and taking it away rounds an f32 in `[0, 2^22)` to the nearest integer.
const MAGIC32: f32 = 8388608.0;
/// The same for f64.
const MAGIC64: f64 = 4503599627370496.0;

/// Slots of a block in f32, for [`Bins::single_is_exact`].
#[inline(always)]
fn slots_single<T: Sample>(data: &[T], slots: &mut [u32], bins: &Bins) {
    let (scale, high) = (bins.scale as f32, bins.high as f32);
    let (last, under) = ((bins.n - 1) as f32, bins.n as f32);
    let (over, nan) = (under + 1.0, under + 2.0);
    for (slot, &x) in slots.iter_mut().zip(data) {
        let x = x.single();
        let v = x * scale;
        let near = (v + MAGIC32) - MAGIC32;
        let mut r = near - if near > v { 1.0 } else { 0.0 };
        r = if r > last { last } else { r };
        r = if x > high { over } else { r };
        r = if x < 0.0 { under } else { r };
        r = if x.is_nan() { nan } else { r };
        *slot = (r + MAGIC32).to_bits() & 0x007f_ffff;
    }
}

/// Slots of a block in f64.
#[inline(always)]
fn slots_double<T: Sample>(data: &[T], slots: &mut [u32], bins: &Bins) {
    let Bins { n, low, high, scale } = *bins;
    let (last, under) = ((n - 1) as f64, n as f64);
    let (over, nan) = (under + 1.0, under + 2.0);
    for (slot, &x) in slots.iter_mut().zip(data) {
        let x = x.double();
        let v = (x - low) * scale;
        let near = (v + MAGIC64) - MAGIC64;
        let mut r = near - if near > v { 1.0 } else { 0.0 };
        r = if r > last { last } else { r };
        r = if x > high { over } else { r };
        r = if x < low { under } else { r };
        r = if x.is_nan() { nan } else { r };
        *slot = (r + MAGIC64).to_bits() as u32 & 0x003f_ffff;
    }
}

/// Whether a block is wholly in the mask, wholly out of it, or mixed.
fn coverage(mask: Option<&[bool]>) -> Option<bool> {
    match mask {
        None => Some(true),
        Some(m) => {
            let inside = m.iter().fold(0_usize, |sum, &b| sum + usize::from(b));
            if inside == 0 {
                Some(false)
            } else if inside == m.len() {
                Some(true)
            } else {
                None
            }
        }
    }
}

type Small<const C: usize> = [[[u32; SMALL]; C]; COPIES];

/// Count whole pixels. A function of its own, so that nothing but the tables competes for its registers.
#[inline(never)]
fn count<I: Copy + Into<u64>, const C: usize>(tables: &mut Small<C>, slots: &[I]) {
    let mut four = slots.chunks_exact(C * COPIES);
    for pixels in &mut four {
        for k in 0..COPIES {
            for c in 0..C {
                tables[k][c][pixels[k * C + c].into() as usize] += 1;
            }
        }
    }
    for pixel in four.remainder().chunks_exact(C) {
        for c in 0..C {
            tables[0][c][pixel[c].into() as usize] += 1;
        }
    }
}

/// The same for bytes, eight of them in one load.
#[inline(never)]
fn count_bytes<const C: usize>(tables: &mut Small<C>, data: &[u8]) {
    let (octets, _) = data.as_chunks::<8>();
    for words in octets.chunks_exact(C) {
        for (w, word) in words.iter().enumerate() {
            let word = u64::from_le_bytes(*word);
            for b in 0..8 {
                let at = 8 * w + b;
                tables[at / C % COPIES][at % C][(word >> (8 * b) & 0xFF) as usize] += 1;
            }
        }
    }
    count(tables, &data[data.len() - data.len() % (8 * C)..]);
}

/// Count the pixels of a mask: an increment of 0 or 1 has no branch to mispredict.
#[inline(never)]
fn count_masked<I: Copy + Into<u64>, const C: usize>(tables: &mut Small<C>, slots: &[I], mask: &[bool]) {
    let (mut four, mut inside) = (slots.chunks_exact(C * COPIES), mask.chunks_exact(COPIES));
    for (pixels, inside) in (&mut four).zip(&mut inside) {
        for k in 0..COPIES {
            for c in 0..C {
                tables[k][c][pixels[k * C + c].into() as usize] += u32::from(inside[k]);
            }
        }
    }
    for (pixel, &inside) in four.remainder().chunks_exact(C).zip(inside.remainder()) {
        for c in 0..C {
            tables[0][c][pixel[c].into() as usize] += u32::from(inside);
        }
    }
}

/// Private tables of one chunk.
struct Tables<const C: usize> {
    small: Box<Small<C>>,
    large: Vec<u32>,
    width: usize,
}

impl<const C: usize> Tables<C> {
    fn new(width: usize) -> Self {
        let large = if width > SMALL { vec![0; COPIES * C * width] } else { Vec::new() };
        Self { small: Box::new([[[0; SMALL]; C]; COPIES]), large, width }
    }

    fn scatter(&mut self, slots: &[u32], mask: Option<&[bool]>) {
        if self.large.is_empty() {
            match mask {
                None => count(&mut self.small, slots),
                Some(mask) => count_masked(&mut self.small, slots, mask),
            }
            return;
        }
        for (p, pixel) in slots.chunks_exact(C).enumerate() {
            let inside = u32::from(mask.is_none_or(|m| m[p]));
            for c in 0..C {
                self.large[((p % COPIES) * C + c) * self.width + pixel[c] as usize] += inside;
            }
        }
    }

    /// Add the copies up, slot after slot, channel after channel.
    fn merge_into(&self, sum: &mut [u64]) {
        for k in 0..COPIES {
            for c in 0..C {
                let table = if self.large.is_empty() {
                    &self.small[k][c][..self.width]
                } else {
                    &self.large[(k * C + c) * self.width..][..self.width]
                };
                for (s, &t) in sum[c * self.width..].iter_mut().zip(table) {
                    *s += u64::from(t);
                }
            }
        }
    }
}

fn band_of_samples<T: Sample, const C: usize>(data: &[T], mask: Option<&[bool]>, bins: &Bins, sum: &mut [u64]) {
    let mut tables = Tables::<C>::new(bins.n + 3);
    let mut slots = [0_u32; BLOCK * MAX_CHANNELS];
    let single = T::SINGLE && bins.single_is_exact();
    for (b, block) in data.chunks(BLOCK * C).enumerate() {
        let inside = mask.map(|m| &m[b * BLOCK..][..block.len() / C]);
        let covered = coverage(inside);
        if covered == Some(false) {
            continue;
        }
        let slots = &mut slots[..block.len()];
        if single {
            lanes::run(
                #[inline(always)]
                || slots_single(block, slots, bins),
            );
        } else {
            lanes::run(
                #[inline(always)]
                || slots_double(block, slots, bins),
            );
        }
        tables.scatter(slots, if covered.is_some() { None } else { inside });
    }
    tables.merge_into(sum);
}

/// Levels of 8-bit samples: no arithmetic at all. `sum` holds 256 counts for each channel.
fn band_of_bytes<const C: usize>(data: &[u8], mask: Option<&[bool]>, sum: &mut [u64]) {
    let mut tables = Tables::<C>::new(256);
    if let Some(mask) = mask {
        for (block, mask) in data.chunks(BLOCK * C).zip(mask.chunks(BLOCK)) {
            match coverage(Some(mask)) {
                Some(false) => {}
                Some(true) => count_bytes(&mut tables.small, block),
                None => count_masked(&mut tables.small, block, mask),
            }
        }
    } else {
        for run in data.chunks(RUN * C) {
            // A clear or clipped sky repeats its pixel: a run that equals itself one pixel on is counted at once. The
            // comparison ends at the first difference, so other pictures hardly pay for it.
            if run[C..] == run[..run.len() - C] {
                for c in 0..C {
                    tables.small[0][c][run[c] as usize] += (run.len() / C) as u32;
                }
            } else {
                count_bytes(&mut tables.small, run);
            }
        }
    }
    tables.merge_into(sum);
}

/// Run `one` over chunks of a picture and add up what they counted, `width` slots for each of `C` channels.
fn in_bands<T: Sample, const C: usize>(
    job: &Job,
    data: &[T],
    mask: Option<&[bool]>,
    width: usize,
    one: impl Fn(&[T], Option<&[bool]>, &mut [u64]) + Sync,
) -> Result<Vec<u64>> {
    let pixels = data.len() / C;
    // A chunk should count more pixels than it clears slots.
    let chunk = CHUNK.max(2 * width);
    // Each piece of work adds its chunks into one table: memory does not grow with the picture.
    let pieces = pixels.div_ceil(chunk).min(4 * job.threads());
    let parts = job.map(pieces, |piece| {
        let mut sum = vec![0; C * width];
        for start in (piece * chunk..pixels).step_by(pieces * chunk) {
            job.check()?;
            let end = (start + chunk).min(pixels);
            one(&data[start * C..end * C], mask.map(|m| &m[start..end]), &mut sum);
        }
        Ok(sum)
    })?;
    let mut total = vec![0; C * width];
    for part in parts {
        for (t, p) in total.iter_mut().zip(part) {
            *t += p;
        }
    }
    Ok(total)
}

fn sorted(slots: &[u64], channels: usize, n: usize) -> Counts {
    let width = n + 3;
    let column = |k: usize| (0..channels).map(|c| slots[c * width + k]).collect();
    Counts {
        bins: (0..channels).flat_map(|c| slots[c * width..][..n].iter().copied()).collect(),
        under: column(n),
        over: column(n + 1),
        nan: column(n + 2),
    }
}

fn check<T>(data: &[T], channels: usize, mask: Option<&[bool]>) -> Result<()> {
    if channels == 0 || channels > MAX_CHANNELS || !data.len().is_multiple_of(channels) {
        return Err(Error::Shape {
            name: "img",
            expected: format!("(h, w, c) with 1 <= c <= {MAX_CHANNELS}"),
            got: format!("{} samples, {channels} channels", data.len()),
        });
    }
    check_mask(mask, data.len() / channels)
}

/// Histogram of an interleaved picture of 16-bit or floating-point samples.
pub fn samples<T: Sample>(
    job: &Job,
    data: &[T],
    channels: usize,
    mask: Option<&[bool]>,
    bins: &Bins,
) -> Result<Counts> {
    check(data, channels, mask)?;
    let width = bins.n + 3;
    let slots = match channels {
        1 => in_bands::<T, 1>(job, data, mask, width, |d, m, s| band_of_samples::<T, 1>(d, m, bins, s)),
        2 => in_bands::<T, 2>(job, data, mask, width, |d, m, s| band_of_samples::<T, 2>(d, m, bins, s)),
        3 => in_bands::<T, 3>(job, data, mask, width, |d, m, s| band_of_samples::<T, 3>(d, m, bins, s)),
        _ => in_bands::<T, 4>(job, data, mask, width, |d, m, s| band_of_samples::<T, 4>(d, m, bins, s)),
    }?;
    Ok(sorted(&slots, channels, bins.n))
}

/// Counts of the 256 levels of an 8-bit picture, channel after channel.
pub fn levels(job: &Job, data: &[u8], channels: usize, mask: Option<&[bool]>) -> Result<Vec<u64>> {
    check(data, channels, mask)?;
    match channels {
        1 => in_bands::<u8, 1>(job, data, mask, 256, band_of_bytes::<1>),
        2 => in_bands::<u8, 2>(job, data, mask, 256, band_of_bytes::<2>),
        3 => in_bands::<u8, 3>(job, data, mask, 256, band_of_bytes::<3>),
        _ => in_bands::<u8, 4>(job, data, mask, 256, band_of_bytes::<4>),
    }
}

/// Histogram of an interleaved 8-bit picture.
pub fn bytes(job: &Job, data: &[u8], channels: usize, mask: Option<&[bool]>, bins: &Bins) -> Result<Counts> {
    let levels = levels(job, data, channels, mask)?;
    let width = bins.n + 3;
    let mut slots = vec![0; channels * width];
    for c in 0..channels {
        for level in 0..256 {
            slots[c * width + bins.slot(level as f64)] += levels[c * 256 + level];
        }
    }
    Ok(sorted(&slots, channels, bins.n))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, one sample at a time.
    fn plain<T: Sample>(data: &[T], channels: usize, mask: Option<&[bool]>, bins: &Bins) -> Counts {
        let mut slots = vec![0; channels * (bins.n + 3)];
        for (i, &x) in data.iter().enumerate() {
            if mask.is_none_or(|m| m[i / channels]) {
                slots[(i % channels) * (bins.n + 3) + bins.slot(x.double())] += 1;
            }
        }
        sorted(&slots, channels, bins.n)
    }

    fn noise(n: usize) -> Vec<f32> {
        let mut state = 1_u64;
        (0..n)
            .map(|i| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let x = (state >> 40) as f32 / (1 << 24) as f32 * 1.25 - 0.125;
                match i % 97 {
                    0 => f32::NAN,
                    1 => f32::INFINITY,
                    2 => f32::NEG_INFINITY,
                    3 => 1.0,
                    4 => f32::MAX,
                    5 => f32::from_bits(1),
                    6 => -0.0,
                    _ => x,
                }
            })
            .collect()
    }

    #[test]
    fn blocks_and_bands_count_what_the_definition_counts() {
        let data = noise(3 * 5 * 7 * 11 * 13);
        for channels in [1, 3] {
            let mask: Vec<bool> = (0..data.len() / channels).map(|i| (i / 300) % 3 == 0 || i % 5 == 0).collect();
            for mask in [None, Some(&mask[..])] {
                for (n, low, high) in [(256, 0.0, 1.0), (100, 0.0, 1.0), (300, 0.1, 0.9), (1, -1e300, 1e300)] {
                    let bins = Bins::new(n, low, high).expect("a good range");
                    let ours = samples(&Job::serial(), &data, channels, mask, &bins).expect("counts");
                    assert_eq!(
                        ours,
                        plain(&data, channels, mask, &bins),
                        "{channels} channels, {n} bins, [{low}, {high}]"
                    );
                    let wide: Vec<f64> = data.iter().map(|&x| f64::from(x)).collect();
                    let ours = samples(&Job::serial(), &wide, channels, mask, &bins).expect("counts");
                    assert_eq!(ours, plain(&wide, channels, mask, &bins), "f64, {n} bins");
                }
            }
        }
    }

    #[test]
    fn tables_merge_into_64_bits() {
        // Two tables that each hold 2^32 - 1: a sum in u32 would wrap.
        let mut tables = Tables::<1>::new(256);
        tables.small[0][0][9] = u32::MAX;
        tables.small[3][0][9] = u32::MAX;
        let mut sum = vec![u64::from(u32::MAX); 256];
        tables.merge_into(&mut sum);
        assert_eq!(sum[9], 3 * u64::from(u32::MAX), "no carry is lost");
        assert_eq!(sum[8], u64::from(u32::MAX), "others are untouched");
    }

    #[test]
    fn bytes_are_counted_like_floats() {
        let data: Vec<u8> = (0..30_011_u32).map(|i| (i.wrapping_mul(2654435761) >> 24) as u8).collect();
        let floats: Vec<f32> = data.iter().map(|&x| f32::from(x)).collect();
        for (n, low, high) in [(256, 0.0, 256.0), (255, 0.0, 255.0), (17, 3.0, 200.5)] {
            let bins = Bins::new(n, low, high).expect("a good range");
            let ours = bytes(&Job::serial(), &data, 1, None, &bins).expect("counts");
            assert_eq!(ours, samples(&Job::serial(), &floats, 1, None, &bins).expect("counts"), "{n} bins");
        }
    }
}

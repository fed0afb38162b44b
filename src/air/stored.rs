//! Moments of the light in air as bytes: what all orders of scattering leave in the default air, so that a first sky need not
//! follow them (floor 2).
//!
//! Of a grid point the mean's logarithm in 32 bits; the isotropic moments of the bands over their mean in 16 bits; the other
//! moments over the isotropic one of their band, which none exceeds, in 16 bits up to degree 2 and in 8 above, over the
//! largest of the point. Above some height only degrees up to 2 are kept. Error against what was stored: 5e-4 of the isotropic
//! moment (`what_is_stored_is_what_was_followed` in multiple.rs holds the table to the computation). Written by
//! `scripts/make_default_air.py`.

use super::legendre::{MOMENTS, start};
use super::scattering::{C, Channels};

/// Moments of the light at one grid point.
pub type Moments = [Channels; MOMENTS];
/// Degrees that are kept everywhere, and in 16 bits.
const LOW: usize = 3;

/// The default air's light.
pub static DEFAULT_AIR: &[u8] = include_bytes!("tables/default_air.bin");

/// Light on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Moments over their mean.
    pub moments: Vec<Moments>,
    /// Logarithm of the mean.
    pub logs: Vec<f32>,
    /// Irradiance of the ground.
    pub ground: Vec<Channels>,
    /// How many orders it is made of.
    pub orders: usize,
}

/// Whether a moment is of a low degree, by its place.
fn low() -> [bool; MOMENTS] {
    let mut out = [false; MOMENTS];
    for m in 0..LOW {
        for l in m..LOW {
            out[start(m) + l - m] = true;
        }
    }
    out
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    fn float(&mut self) -> Option<f32> {
        self.bytes().map(f32::from_le_bytes)
    }

    fn short(&mut self) -> Option<f32> {
        self.bytes().map(|b| f32::from(i16::from_le_bytes(b)) / 32767.0)
    }
}

impl Light {
    /// As bytes; the first `rich` points keep all degrees.
    pub fn encode(&self, rich: usize) -> Vec<u8> {
        let mut out = vec![self.orders as u8];
        let short = |x: f32, out: &mut Vec<u8>| out.extend(((x * 32767.0).round() as i16).to_le_bytes());
        for channels in &self.ground {
            out.extend(channels.iter().flat_map(|x| x.to_le_bytes()));
        }
        let low = low();
        for (i, (point, log)) in self.moments.iter().zip(&self.logs).enumerate() {
            out.extend(log.to_le_bytes());
            let most = point[0].iter().fold(1e-30_f32, |a, b| a.max(b.abs()));
            out.extend(most.to_le_bytes());
            for x in &point[0] {
                short(x / most, &mut out);
            }
            let ratio = |q: usize, c: usize| if point[0][c] > 0.0 { point[q][c] / point[0][c] } else { 0.0 };
            for q in (1..MOMENTS).filter(|&q| low[q]) {
                for c in 0..C {
                    short(ratio(q, c).clamp(-1.0, 1.0), &mut out);
                }
            }
            if i < rich {
                let high = || (1..MOMENTS).filter(|&q| !low[q]).flat_map(|q| (0..C).map(move |c| (q, c)));
                let largest = high().fold(1e-30_f32, |a, (q, c)| a.max(ratio(q, c).abs()));
                out.extend(largest.to_le_bytes());
                out.extend(high().map(|(q, c)| (ratio(q, c) / largest * 127.0).round() as i8 as u8));
            }
        }
        out
    }

    /// From bytes, of so many points, of which the first `rich` have all degrees, over so many suns; `None` where they are not
    /// of such a grid.
    pub fn decode(bytes: &[u8], points: usize, rich: usize, suns: usize) -> Option<Self> {
        let mut reader = Reader(bytes);
        let [orders] = reader.bytes::<1>()?;
        let mut ground = vec![[0.0; C]; suns];
        for x in ground.iter_mut().flatten() {
            *x = reader.float()?;
        }
        let low = low();
        let (mut moments, mut logs) = (vec![[[0.0; C]; MOMENTS]; points], vec![0.0; points]);
        for i in 0..points {
            logs[i] = reader.float()?;
            let most = reader.float()?;
            let point = &mut moments[i];
            for c in 0..C {
                point[0][c] = reader.short()? * most;
            }
            for q in (1..MOMENTS).filter(|&q| low[q]) {
                for c in 0..C {
                    point[q][c] = reader.short()? * point[0][c];
                }
            }
            if i < rich {
                let largest = reader.float()? / 127.0;
                for q in (1..MOMENTS).filter(|&q| !low[q]) {
                    let levels = reader.bytes::<C>()?;
                    for c in 0..C {
                        point[q][c] = f32::from(levels[c] as i8) * largest * point[0][c];
                    }
                }
            }
        }
        reader.0.is_empty().then_some(Self { moments, logs, ground, orders: usize::from(orders) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_hold_what_they_are_given() {
        let value = |i: usize, q: usize, c: usize| {
            let isotropic = 1.0 + 0.05 * c as f32;
            let wave = ((i * 7 + q * 3 + c) as f32 * 0.7).sin() * 0.6;
            if q == 0 {
                isotropic
            } else if i < 3 || low()[q] {
                wave * isotropic
            } else {
                0.0
            }
        };
        let light = Light {
            moments: (0..6).map(|i| std::array::from_fn(|q| std::array::from_fn(|c| value(i, q, c)))).collect(),
            logs: (0..6).map(|i| -3.25 * i as f32).collect(),
            ground: vec![[0.25; C]; 2],
            orders: 9,
        };
        let bytes = light.encode(3);
        let got = Light::decode(&bytes, 6, 3, 2).expect("of this grid");
        assert_eq!((&got.logs, &got.ground, got.orders), (&light.logs, &light.ground, 9), "exact");
        for (a, b) in got.moments.iter().flatten().flatten().zip(light.moments.iter().flatten().flatten()) {
            assert!((a - b).abs() < 5e-3, "{a} for {b}");
        }
        assert_eq!(Light::decode(&bytes, 6, 2, 2), None, "another grid");
        assert_eq!(Light::decode(&bytes[1..], 6, 3, 2), None, "cut");
        assert_eq!(Light::decode(&[], 6, 3, 2), None, "nothing");
    }
}

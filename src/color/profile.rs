//! Colour management of pictures: ICC matrix and grey profiles, code points of H.273 (cICP) and PNG's gAMA and cHRM, to linear
//! light with Rec. 709 primaries and D65.
//!
//! A matrix profile (ICC.1:2022, 8.3.3 and F.3) is three transfer curves and a matrix to the profile connection space, XYZ
//! relative to D50; Bradford's adaptation brings that to D65. Nothing is clipped: colours outside Rec. 709 have channels
//! below 0 or above 1, as they must. A profile of look-up tables alone is refused here: littleCMS reads it, in 8 bits.
//! Levels go through a table of one entry each, floats through the curve itself.
//!
//! Error: 2e-4 of white for matrix profiles, whose colorants have 16 binary places; `tests/oracles/test_photographs.py`
//! holds it against colour-science.

use super::spaces::{Matrix, XYZ_TO_RGB, inverse};
use super::transfer;
use crate::error::{Error, Result};
use crate::job::Job;

/// Bradford's cone responses of XYZ (ICC.1:2022, annex E).
const BRADFORD: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];
/// The white of the profile connection space (ICC.1:2022, 7.2.16).
const D50: [f64; 3] = [0.9642, 1.0, 0.8249];
/// Luminance of level 1 of the PQ curve [cd/m²] (SMPTE ST 2084).
const PQ_PEAK: f64 = 1e4;

/// Pixels of one piece of work [1].
const CHUNK: usize = 1 << 14;

/// From encoded values to light.
#[derive(Debug, Clone, PartialEq)]
pub enum Curve {
    /// Linear already.
    Linear,
    /// The sRGB curve, odd below 0.
    Srgb,
    /// A power `[1]`.
    Power(f64),
    /// ICC's parametric curve of type 0 to 4: exponent g and constants a to f.
    Parametric(u16, [f64; 7]),
    /// Evenly spaced values over [0, 1].
    Table(Vec<f64>),
    /// The camera curve of Rec. 709, 601 and 2020, undone.
    Camera,
    /// SMPTE ST 2084, in cd/m².
    Pq,
}

impl Curve {
    /// Light of an encoded value.
    pub fn light(&self, x: f64) -> f64 {
        match self {
            Self::Linear => x,
            Self::Srgb => transfer::decode(x),
            Self::Power(g) => x.abs().powf(*g).copysign(x),
            Self::Parametric(kind, [g, a, b, c, d, e, f]) => {
                let curve = |x: f64| (a * x + b).max(0.0).powf(*g);
                match kind {
                    0 => x.abs().powf(*g).copysign(x),
                    1 => {
                        if x >= -b / a {
                            curve(x)
                        } else {
                            0.0
                        }
                    }
                    2 => {
                        if x >= -b / a {
                            curve(x) + c
                        } else {
                            *c
                        }
                    }
                    3 => {
                        if x >= *d {
                            curve(x)
                        } else {
                            c * x
                        }
                    }
                    _ => {
                        if x >= *d {
                            curve(x) + e
                        } else {
                            c * x + f
                        }
                    }
                }
            }
            Self::Table(values) => {
                let last = values.len() - 1;
                let at = x.clamp(0.0, 1.0) * last as f64;
                let i = (at as usize).min(last - 1);
                values[i] + (at - i as f64) * (values[i + 1] - values[i])
            }
            Self::Camera => {
                let a = x.abs();
                let y = if a < 0.081_242_858 { a / 4.5 } else { ((a + 0.099_296_83) / 1.099_296_83).powf(1.0 / 0.45) };
                y.copysign(x)
            }
            Self::Pq => {
                let p = x.clamp(0.0, 1.0).powf(32.0 / 2523.0);
                let y = (p - 0.8359375).max(0.0) / (18.8515625 - 18.6875 * p);
                PQ_PEAK * y.powf(8192.0 / 1305.0)
            }
        }
    }
}

/// How the numbers of a picture become linear light.
#[derive(Debug, Clone, PartialEq)]
pub struct Encoding {
    /// Of red, green and blue, or all of grey.
    pub curves: [Curve; 3],
    /// From their light to linear Rec. 709, D65.
    pub matrix: Matrix,
}

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn apply(m: &Matrix, x: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// Von Kries' adaptation in Bradford's cones from one white to another.
fn adaptation(from: [f64; 3], to: [f64; 3]) -> Result<Matrix> {
    let (a, b) = (apply(&BRADFORD, from), apply(&BRADFORD, to));
    let scale = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { b[i] / a[i] } else { 0.0 }));
    Ok(times(&inverse(&BRADFORD)?, &times(&scale, &BRADFORD)))
}

fn d65() -> [f64; 3] {
    super::spaces::D65
}

fn refused(reason: impl Into<String>) -> Error {
    Error::Data { name: "profile", reason: reason.into() }
}

impl Encoding {
    /// sRGB.
    pub fn srgb() -> Self {
        let one = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        Self { curves: [Curve::Srgb, Curve::Srgb, Curve::Srgb], matrix: [one(0), one(1), one(2)] }
    }

    /// Linear Rec. 709.
    pub fn linear_light() -> Self {
        Self { curves: [Curve::Linear, Curve::Linear, Curve::Linear], ..Self::srgb() }
    }

    /// A power, by PNG's gAMA, and chromaticities of white, red, green and blue, by its cHRM.
    ///
    /// # Errors
    /// The power is not positive, or the chromaticities are no colour space.
    pub fn power(gamma: f64, chromaticities: Option<[[f64; 2]; 4]>) -> Result<Self> {
        if !(gamma.is_finite() && gamma > 0.0) {
            return Err(refused(format!("its gamma is {gamma}")));
        }
        let curve = Curve::Power(gamma);
        match chromaticities {
            None => Ok(Self { curves: [curve.clone(), curve.clone(), curve], ..Self::srgb() }),
            Some([white, red, green, blue]) => Self::primaries(&curve, white, [red, green, blue]),
        }
    }

    /// Primaries and white by their chromaticities, each encoded by one curve.
    ///
    /// # Errors
    /// The primaries lie on one line, or a chromaticity has y 0.
    pub fn primaries(curve: &Curve, white: [f64; 2], primaries: [[f64; 2]; 3]) -> Result<Self> {
        let xyz = |[x, y]: [f64; 2]| [x / y, 1.0, (1.0 - x - y) / y];
        let columns = primaries.map(xyz);
        let all: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]));
        if all.iter().flatten().any(|v| !v.is_finite()) {
            return Err(refused("a chromaticity has y 0"));
        }
        let white = xyz(white);
        let share = apply(&inverse(&all)?, white);
        let to_xyz = std::array::from_fn(|i| std::array::from_fn(|j| all[i][j] * share[j]));
        let matrix = times(&XYZ_TO_RGB, &times(&adaptation(white, d65())?, &to_xyz));
        Ok(Self { curves: [curve.clone(), curve.clone(), curve.clone()], matrix })
    }

    /// Code points of H.273: primaries, transfer function, matrix and whether the range is full.
    ///
    /// # Errors
    /// A code point that is not read.
    pub fn cicp([primaries, function, matrix, full]: [u8; 4]) -> Result<Self> {
        if matrix != 0 || full != 1 {
            return Err(refused(format!("cICP with matrix {matrix} and range {full}: only RGB of full range is read")));
        }
        let white = [0.3127, 0.329];
        let (white, colors) = match primaries {
            1 => (white, [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]]),
            4 => ([0.31, 0.316], [[0.67, 0.33], [0.21, 0.71], [0.14, 0.08]]),
            5 => (white, [[0.64, 0.33], [0.29, 0.6], [0.15, 0.06]]),
            6 | 7 => (white, [[0.63, 0.34], [0.31, 0.595], [0.155, 0.07]]),
            9 => (white, [[0.708, 0.292], [0.17, 0.797], [0.131, 0.046]]),
            11 => ([0.314, 0.351], [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]]),
            12 => (white, [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]]),
            other => return Err(refused(format!("cICP has primaries {other}, which are not read"))),
        };
        let curve = match function {
            1 | 6 | 14 | 15 => Curve::Camera,
            4 => Curve::Power(2.2),
            5 => Curve::Power(2.8),
            8 => Curve::Linear,
            13 => Curve::Srgb,
            16 => Curve::Pq,
            other => return Err(refused(format!("cICP has transfer function {other}, which is not read"))),
        };
        Self::primaries(&curve, white, colors)
    }

    /// An ICC profile of curves and a matrix, or of one grey curve.
    ///
    /// # Errors
    /// Damage, look-up tables alone, or another colour space than RGB and grey.
    pub fn icc(profile: &[u8]) -> Result<Self> {
        let tags = Tags::new(profile)?;
        match &profile[16..20] {
            b"GRAY" => {
                let curve = tags.curve(*b"kTRC")?;
                Ok(Self { curves: [curve.clone(), curve.clone(), curve], ..Self::srgb() })
            }
            b"RGB " => {
                if &profile[20..24] != b"XYZ " || tags.find(*b"rXYZ").is_none() {
                    return Err(refused("it has look-up tables and no matrix"));
                }
                let columns = [tags.xyz(*b"rXYZ")?, tags.xyz(*b"gXYZ")?, tags.xyz(*b"bXYZ")?];
                let to_xyz = std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]));
                let curves = [tags.curve(*b"rTRC")?, tags.curve(*b"gTRC")?, tags.curve(*b"bTRC")?];
                Ok(Self { curves, matrix: times(&XYZ_TO_RGB, &times(&adaptation(D50, d65())?, &to_xyz)) })
            }
            other => Err(refused(format!("it is of {} and not of RGB or grey", String::from_utf8_lossy(other).trim()))),
        }
    }

    /// Fill linear Rec. 709 from samples whose level `white` is 1; `channels` is 1 or 3, and `stride` samples are a pixel.
    ///
    /// # Errors
    /// Lengths that do not fit, or an interrupt.
    pub fn linear<T: Level>(
        &self,
        job: &Job,
        samples: &[T],
        [channels, stride]: [usize; 2],
        white: f64,
        out: &mut [f32],
    ) -> Result<()> {
        let pixels = out.len() / 3;
        if samples.len() != pixels * stride
            || out.len() != 3 * pixels
            || channels > stride
            || ![1, 3].contains(&channels)
        {
            return Err(Error::Shape {
                name: "samples",
                expected: format!("{pixels} pixels of {stride} samples"),
                got: samples.len().to_string(),
            });
        }
        let tables = T::LEVELS.map(|levels| {
            self.curves.each_ref().map(|c| (0..levels).map(|i| c.light(i as f64 / white)).collect::<Vec<f64>>())
        });
        let light = |channel: usize, x: T| match &tables {
            Some(tables) => tables[channel][x.index()],
            None => self.curves[channel].light(x.number() / white),
        };
        job.chunks(out, 3 * CHUNK, |index, chunk| {
            let pixels = samples[index * CHUNK * stride..].chunks_exact(stride);
            for (to, from) in chunk.chunks_exact_mut(3).zip(pixels) {
                let rgb = if channels == 1 {
                    [light(0, from[0]); 3]
                } else {
                    apply(&self.matrix, [light(0, from[0]), light(1, from[1]), light(2, from[2])])
                };
                to.copy_from_slice(&rgb.map(|v| v as f32));
            }
            Ok(())
        })
    }
}

/// A sample of a picture.
pub trait Level: Copy + Sync {
    /// How many levels there are, if they are few enough for a table.
    const LEVELS: Option<usize>;
    /// Its place in a table.
    fn index(self) -> usize;
    /// Its value.
    fn number(self) -> f64;
}

macro_rules! level {
    ($kind:ty, $levels:expr) => {
        impl Level for $kind {
            const LEVELS: Option<usize> = $levels;
            fn index(self) -> usize {
                self as usize
            }
            fn number(self) -> f64 {
                self as f64
            }
        }
    };
}

level!(u8, Some(1 << 8));
level!(u16, Some(1 << 16));
level!(u32, None);
level!(f32, None);

/// The tags of an ICC profile.
struct Tags<'a>(&'a [u8]);

fn big(data: &[u8], at: usize) -> Result<u32> {
    let bytes = data.get(at..at + 4).ok_or_else(|| refused("it ends too early"))?;
    Ok(u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
}

fn fixed(data: &[u8], at: usize) -> Result<f64> {
    Ok(f64::from(big(data, at)? as i32) / 65536.0)
}

impl<'a> Tags<'a> {
    fn new(data: &'a [u8]) -> Result<Self> {
        if data.len() < 132 || &data[36..40] != b"acsp" {
            return Err(refused("it is no ICC profile"));
        }
        Ok(Self(data))
    }

    fn find(&self, name: [u8; 4]) -> Option<&'a [u8]> {
        let count = (big(self.0, 128).ok()? as usize).min(200);
        let entry = (0..count).map(|k| 132 + 12 * k).find(|&at| self.0.get(at..at + 4) == Some(&name[..]))?;
        let (start, length) = (big(self.0, entry + 4).ok()? as usize, big(self.0, entry + 8).ok()? as usize);
        self.0.get(start..start.checked_add(length)?)
    }

    fn tag(&self, name: [u8; 4], kind: [u8; 4]) -> Result<&'a [u8]> {
        let label = String::from_utf8_lossy(&name).into_owned();
        let data = self.find(name).ok_or_else(|| refused(format!("its tag {label} is missing")))?;
        if data.get(..4) == Some(&kind[..]) {
            Ok(data)
        } else {
            Err(refused(format!("its tag {label} is of another type")))
        }
    }

    fn xyz(&self, name: [u8; 4]) -> Result<[f64; 3]> {
        let data = self.tag(name, *b"XYZ ")?;
        Ok([fixed(data, 8)?, fixed(data, 12)?, fixed(data, 16)?])
    }

    fn curve(&self, name: [u8; 4]) -> Result<Curve> {
        if let Ok(data) = self.tag(name, *b"curv") {
            let count = big(data, 8)? as usize;
            let value = |k: usize| {
                let at = 12 + 2 * k;
                let bytes = data.get(at..at + 2).ok_or_else(|| refused("a curve ends too early"))?;
                Ok(f64::from(u16::from_be_bytes([bytes[0], bytes[1]])))
            };
            return match count {
                0 => Ok(Curve::Linear),
                1 => Ok(Curve::Power(value(0)? / 256.0)),
                2..=65536 => Ok(Curve::Table((0..count).map(|k| Ok(value(k)? / 65535.0)).collect::<Result<_>>()?)),
                _ => Err(refused(format!("a curve has {count} entries"))),
            };
        }
        let data = self.tag(name, *b"para")?;
        let kind = (big(data, 8)? >> 16) as u16;
        let wanted =
            *[1, 3, 4, 5, 7].get(kind as usize).ok_or_else(|| refused(format!("a curve is of type {kind}")))?;
        let mut values = [0.0; 7];
        for (k, value) in values.iter_mut().enumerate().take(wanted) {
            *value = fixed(data, 12 + 4 * k)?;
        }
        if (kind == 1 || kind == 2) && values[1] == 0.0 {
            return Err(refused("a curve divides by zero"));
        }
        Ok(Curve::Parametric(kind, values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_white_in_every_space_of_d65() {
        for primaries in [1, 5, 6, 9, 12] {
            let encoding = Encoding::cicp([primaries, 8, 0, 1]).expect("read");
            for v in apply(&encoding.matrix, [1.0; 3]) {
                assert!((v - 1.0).abs() < 3e-4, "primaries {primaries}: white is {v}");
            }
        }
    }

    #[test]
    fn pq_has_its_published_levels() {
        // ITU-R BT.2408-7, table 1: 203 cd/m² is at 58 %, 100 cd/m² at 51 %.
        assert!((Curve::Pq.light(0.5807) / 203.0 - 1.0).abs() < 2e-3, "reference white");
        assert!((Curve::Pq.light(0.5081) / 100.0 - 1.0).abs() < 2e-3, "a hundred");
        assert!((Curve::Pq.light(1.0) - 1e4).abs() < 1e-6, "peak");
    }

    #[test]
    fn damage_is_an_error() {
        assert!(Encoding::icc(b"").is_err(), "empty");
        let mut data = vec![0; 144];
        data[36..40].copy_from_slice(b"acsp");
        data[16..24].copy_from_slice(b"RGB XYZ ");
        data[128..132].copy_from_slice(&u32::MAX.to_be_bytes());
        assert!(Encoding::icc(&data).is_err(), "a count of tags that is a lie");
    }
}

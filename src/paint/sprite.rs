//! Sprites (billboards), projected strokes: rectangles in the picture, each with its mask, colour and depth.
//!
//! Colours are linear light, depths metres from the eye, sizes pixels. A stroke narrower than a pixel becomes wider and
//! fainter: it would flicker between pixel centres.

use super::mask::{Mask, carried, colour_key, power_of};
use crate::error::{Error, Result, in_range};
use crate::math::noise::mix32;

/// A value for each stroke, or one for all.
#[derive(Debug, Clone, Copy)]
pub enum PerStroke<'a, T> {
    /// One for all.
    One(T),
    /// One for each.
    Many(&'a [T]),
}

impl<T: Copy> PerStroke<'_, T> {
    /// The value of a stroke.
    #[inline]
    pub fn get(&self, index: usize) -> T {
        match self {
            Self::One(x) => *x,
            Self::Many(list) => list[index],
        }
    }

    pub(super) fn expect(&self, name: &'static str, count: usize) -> Result<()> {
        match self {
            Self::One(_) => Ok(()),
            Self::Many(list) => check_len(name, list.len(), count, 1),
        }
    }
}

/// Check that there are `each` numbers for each of `count` strokes.
pub(super) fn check_len(name: &'static str, got: usize, count: usize, each: usize) -> Result<()> {
    if got == count * each {
        return Ok(());
    }
    let expected = if each == 1 { format!("({count},)") } else { format!("({count}, {each})") };
    Err(Error::Shape { name, expected, got: format!("{got} numbers") })
}

/// Key of the mask of a label.
pub fn key(label: u32) -> u32 {
    mix32(label ^ 0x5bd1_e995)
}

/// Projected strokes, one column for each property.
#[derive(Debug, Clone, Copy)]
pub struct Sprites<'a> {
    /// Centre, `x` to the right and `y` down from the picture's top left corner \[px\].
    pub centre: &'a [f32],
    /// Width and height; a stroke without area is not painted \[px\].
    pub size: &'a [f32],
    /// Distance from the eye: the order \[m\].
    pub depth: &'a [f64],
    /// Linear light.
    pub color: &'a [f32],
    /// What a noise of +1 within the stroke adds to its colour.
    pub variation: Option<&'a [f32]>,
    /// Counter-clockwise rotation \[rad\].
    pub rotation: PerStroke<'a, f32>,
    /// Largest opacity, in `[0, 1]` \[1\].
    pub opacity: PerStroke<'a, f32>,
    /// Seed of the mask.
    pub label: PerStroke<'a, u32>,
    /// Cells of noise across the width \[1\].
    pub frequency_s: PerStroke<'a, f32>,
    /// Cells of noise across the height \[1\].
    pub frequency_t: PerStroke<'a, f32>,
    /// Cells of the colour's noise across the sprite \[1\].
    pub frequency_color: PerStroke<'a, f32>,
    /// Bias of the edge, in `(0, 1)` \[1\].
    pub fullness: PerStroke<'a, f32>,
    /// Noise below which there is no paint \[1\].
    pub feather_min: PerStroke<'a, f32>,
    /// Noise above which the paint is full \[1\].
    pub feather_max: PerStroke<'a, f32>,
    /// Fraction of the height that the edge leaves, in `(0, 1]` \[1\].
    pub foreshortening: PerStroke<'a, f32>,
    /// Half thickness of the stroke in depth \[m\], where the order is by slabs.
    pub delta: PerStroke<'a, f64>,
    /// Breaks ties of depth; the index if there is none.
    pub id: Option<&'a [i64]>,
}

impl Sprites<'_> {
    /// How many strokes.
    pub fn count(&self) -> usize {
        self.depth.len()
    }

    /// Refuse columns of different lengths.
    pub fn validate(&self) -> Result<()> {
        let n = self.count();
        if n >= u32::MAX as usize {
            return Err(Error::Data { name: "sprites", reason: format!("at most 4e9 strokes, got {n}") });
        }
        check_len("center", self.centre.len(), n, 2)?;
        check_len("size", self.size.len(), n, 2)?;
        check_len("color", self.color.len(), n, 3)?;
        self.variation.map_or(Ok(()), |v| check_len("variation", v.len(), n, 3))?;
        self.rotation.expect("rotation", n)?;
        self.opacity.expect("opacity", n)?;
        self.label.expect("label", n)?;
        self.frequency_s.expect("frequency", n)?;
        self.frequency_t.expect("frequency", n)?;
        self.frequency_color.expect("frequency_color", n)?;
        self.fullness.expect("fullness", n)?;
        self.feather_min.expect("feather_min", n)?;
        self.feather_max.expect("feather_max", n)?;
        self.foreshortening.expect("squeeze", n)?;
        self.delta.expect("delta", n)?;
        self.id.map_or(Ok(()), |v| check_len("id", v.len(), n, 1))
    }

    /// One stroke, ready to be painted; `None` if it has no area or no opacity.
    pub(super) fn sprite(&self, i: usize, memo: &mut Memo) -> Result<Option<Sprite>> {
        let finite = |name: &'static str, list: &[f32]| {
            if list.iter().all(|x| x.is_finite()) {
                return Ok(());
            }
            Err(Error::Data { name, reason: format!("must be finite, got {list:?} at stroke {i}") })
        };
        let (centre, size) = (&self.centre[2 * i..2 * i + 2], &self.size[2 * i..2 * i + 2]);
        finite("size", size)?;
        let half = [0.5 * size[0], 0.5 * size[1]];
        let opacity = self.opacity.get(i);
        in_range("opacity", f64::from(opacity), 0.0, 1.0, "1")?;
        if !(half[0] > 0.0 && half[1] > 0.0 && opacity > 0.0) {
            return Ok(None);
        }
        finite("center", centre)?;
        let color = &self.color[3 * i..3 * i + 3];
        finite("color", color)?;
        let vary = self.variation.map_or([0.0; 3], |v| [v[3 * i], v[3 * i + 1], v[3 * i + 2]]);
        finite("variation", &vary)?;
        let depth = self.depth[i];
        if !depth.is_finite() {
            return Err(Error::Data { name: "depth", reason: format!("must be finite, got {depth} at stroke {i}") });
        }
        let rotation = self.rotation.get(i);
        finite("rotation", &[rotation])?;
        let (low, high) = (self.feather_min.get(i), self.feather_max.get(i));
        in_range("feather_min", f64::from(low), 0.0, 1e6, "1")?;
        in_range("feather_max", f64::from(high), f64::from(low), 1e6, "1")?;
        let fullness = f64::from(self.fullness.get(i));
        in_range("fullness", fullness, 1e-6, 1.0 - 1e-6, "1")?;
        let foreshortening = self.foreshortening.get(i);
        in_range("squeeze", f64::from(foreshortening), 1e-3, 1.0, "1")?;
        let frequency = [self.frequency_s.get(i), self.frequency_t.get(i)];
        let fine = self.frequency_color.get(i);
        for f in [frequency[0], frequency[1], fine] {
            in_range("frequency", f64::from(f), 0.0, 1e5, "1")?;
        }
        let delta = self.delta.get(i);
        in_range("delta", delta, 0.0, 1e12, "m")?;
        let label = key(self.label.get(i));
        // Thinner strokes become wider and fainter: they would flicker between pixel centres.
        let wide = [half[0].max(NARROWEST), half[1].max(NARROWEST)];
        let opacity = opacity * (half[0] / wide[0]) * (half[1] / wide[1]);
        let cell = |k: usize, f: f32| f64::from(2.0 * wide[k]) / f64::from(f);
        // No noise at frequency zero would be the same noise all over: it varies with the label only.
        let strength = |f: [f32; 2]| carried(cell(0, f[0]).min(cell(1, f[1]))) as f32;
        let (power, inner) = memo.shape(self.fullness.get(i), low);
        let (sin, cos) = if rotation == 0.0 { (0.0, 1.0) } else { rotation.sin_cos() };
        Ok(Some(Sprite {
            x: centre[0],
            y: centre[1],
            half: wide,
            inner: wide.map(|h| h * inner),
            turn: [cos, sin],
            depth,
            delta,
            color: [color[0], color[1], color[2]],
            vary,
            mask: Mask {
                frequency,
                key: label,
                power,
                feather: [low, high - low],
                opacity,
                foreshortening,
                carried: strength(frequency),
            },
            fine,
            fine_key: colour_key(label),
            fine_carried: if vary == [0.0; 3] { 0.0 } else { strength([fine, fine]) },
            id: self.id.map_or(i as i64, |list| list[i]),
            index: i as u32,
        }))
    }
}

/// The last shape of an edge, which most strokes share.
#[derive(Debug, Default)]
pub(super) struct Memo {
    of: [f32; 2],
    is: [f32; 2],
}

impl Memo {
    /// Power of the edge, and the fraction of the sprite's sides within which it is above `low`.
    fn shape(&mut self, fullness: f32, low: f32) -> (f32, f32) {
        if self.of != [fullness, low] {
            let power = f64::from(power_of(f64::from(fullness)));
            // Noise is at most 1, so where sin(pi s)^power <= low there is none; a little more, for rounding.
            let least = f64::from(low).powf(1.0 / power).min(1.0);
            let inner = (least.acos() * std::f64::consts::FRAC_2_PI + 1e-4).min(1.0);
            (self.of, self.is) = ([fullness, low], [power as f32, inner as f32]);
        }
        (self.is[0], self.is[1])
    }
}

/// Half of the least width of a sprite \[px\].
const NARROWEST: f32 = 1.25;

/// One stroke.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sprite {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) half: [f32; 2],
    /// The part of `half` where there can be paint.
    pub(super) inner: [f32; 2],
    /// Cosine and sine of the rotation.
    pub(super) turn: [f32; 2],
    pub(super) depth: f64,
    pub(super) delta: f64,
    pub(super) color: [f32; 3],
    pub(super) vary: [f32; 3],
    pub(super) mask: Mask,
    pub(super) fine: f32,
    pub(super) fine_key: u32,
    pub(super) fine_carried: f32,
    pub(super) id: i64,
    pub(super) index: u32,
}

impl Sprite {
    /// Half the sides of the upright box around it.
    #[inline(always)]
    pub(super) fn reach(&self) -> [f32; 2] {
        let ([w, h], [c, s]) = (self.inner, self.turn.map(f32::abs));
        [w * c + h * s, w * s + h * c]
    }

    /// The pixels whose centres may lie in it, `[first, end)` in columns and rows of a picture of this size.
    #[inline(always)]
    pub(super) fn pixels(&self, size: [usize; 2]) -> [usize; 4] {
        let [w, h] = self.reach();
        let bound = |x: f32, n: usize| (x - 0.5).ceil().clamp(0.0, n as f32) as usize;
        [bound(self.x - w, size[0]), bound(self.x + w, size[0]), bound(self.y - h, size[1]), bound(self.y + h, size[1])]
    }
}

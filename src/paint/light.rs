//! Shading of a stroke (S1-S5): diffuse illumination, its place in the tree, shadow; bias and gain.
//!
//! `L = clamp(sum w max(n · l, 0))`; `L + a_out gain(branch, g_out) - a_in (1 - d) gain(1 - centre, g_in)`, so outer
//! leaves are lighter and inner ones darker, and the darkening goes with distance; times `bias(1/2 + s/2, b)` for a
//! stroke that the fraction `s` of the light reaches. Shadows act here, on what chooses the colour, never on the
//! colour.

/// Which bias and gain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BiasGain {
    /// `x^(ln b / ln 1/2)` (Perlin and Hoffert 1989).
    Perlin,
    /// Rational (Schlick 1994).
    Schlick,
}

/// How far from 0 and 1 the parameter of a curve is kept.
const END: f64 = 1e-6;

impl BiasGain {
    /// 0 and 1 stay, 1/2 becomes `b`; `b = 1/2` changes nothing. Monotone in `x`, which is clamped to `[0, 1]`.
    pub fn bias(self, x: f64, b: f64) -> f64 {
        let (x, b) = (x.clamp(0.0, 1.0), b.clamp(END, 1.0 - END));
        match self {
            _ if b == 0.5 || x == 0.0 || x == 1.0 => x,
            Self::Perlin if x == 0.5 => b,
            Self::Perlin => x.powf(b.ln() / 0.5_f64.ln()),
            Self::Schlick => x / ((1.0 / b - 2.0) * (1.0 - x) + 1.0),
        }
    }

    /// 0, 1/2 and 1 stay; above `g = 1/2` the middle is steeper, below flatter.
    pub fn gain(self, x: f64, g: f64) -> f64 {
        let x = x.clamp(0.0, 1.0);
        if x < 0.5 { 0.5 * self.bias(2.0 * x, 1.0 - g) } else { 1.0 - 0.5 * self.bias(2.0 - 2.0 * x, 1.0 - g) }
    }
}

/// A light from far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionalLight {
    /// Unit vector to it.
    pub to: [f64; 3],
    /// How much lightness it gives a surface that faces it \[1\].
    pub strength: f64,
    /// Its colour, of luminance 1.
    pub color: [f64; 3],
}

/// Parameters of the lightness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Illumination {
    /// Lightness without any light \[1\].
    pub ambient: f64,
    /// Most that is added to outer strokes, and its gain \[1\].
    pub outer: [f64; 2],
    /// Most that is taken from inner ones, and its gain \[1\].
    pub inner: [f64; 2],
    /// Factor of full shadow \[1\].
    pub shadow_bias: f64,
    /// Bias and gain.
    pub curve: BiasGain,
}

/// What a stroke knows of its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadingPoint {
    /// Unit normal.
    pub normal: [f64; 3],
    /// 0 at the centre of the crown, 1 outermost \[1\].
    pub centre: f64,
    /// 0 where its branch begins, 1 at the tip \[1\].
    pub branch: f64,
    /// 0 near, 1 far \[1\].
    pub far: f64,
    /// Visibility: the fraction of the light that reaches it \[1\].
    pub light_visibility: f64,
}

/// Lightness before and after shadow, and the colour of the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lightness {
    /// Of illumination alone (S1).
    pub plain: f64,
    /// With its place in the tree (S2).
    pub placed: f64,
    /// Factor of the shadow (S4).
    pub shadow: f64,
    /// What chooses the colour.
    pub full: f64,
    /// With its place in the tree, as in the foreground: whatever the distance and the shadows.
    pub steady: f64,
    /// Colour of the light, 1 where there is none.
    pub color: [f64; 3],
}

impl Illumination {
    /// The lightness of a stroke.
    pub fn of(&self, lights: &[DirectionalLight], place: &ShadingPoint) -> Lightness {
        let (mut sum, mut color) = (0.0, [0.0; 3]);
        for light in lights {
            let n = &place.normal;
            let cosine = n[0] * light.to[0] + n[1] * light.to[1] + n[2] * light.to[2];
            let received = light.strength * cosine.max(0.0);
            sum += received;
            for k in 0..3 {
                color[k] += received * light.color[k];
            }
        }
        let color = if sum > 0.0 { color.map(|c| c / sum) } else { [1.0; 3] };
        let plain = (self.ambient + sum).clamp(0.0, 1.0);
        let outer = self.outer[0] * self.curve.gain(place.branch, self.outer[1]);
        let inner = self.inner[0] * self.curve.gain(1.0 - place.centre, self.inner[1]);
        let placed = (plain + outer - inner * (1.0 - place.far)).clamp(0.0, 1.0);
        let steady = (plain + outer - inner).clamp(0.0, 1.0);
        let shadow = self.curve.bias(0.5 + 0.5 * place.light_visibility.clamp(0.0, 1.0), self.shadow_bias);
        // bias(1) is 1: what stands in full light keeps its lightness.
        Lightness { plain, placed, shadow, full: placed * shadow, steady, color }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bias_and_gain_keep_their_points() {
        for curve in [BiasGain::Perlin, BiasGain::Schlick] {
            for b in [0.0, 1e-9, 0.1, 0.4, 0.5, 0.9, 1.0] {
                assert_eq!((curve.bias(0.0, b), curve.bias(1.0, b)), (0.0, 1.0), "ends");
                assert_eq!((curve.gain(0.0, b), curve.gain(1.0, b)), (0.0, 1.0), "ends");
                assert!((curve.gain(0.5, b) - 0.5).abs() < 1e-15, "middle");
                assert!((curve.bias(0.5, b) - b.clamp(END, 1.0 - END)).abs() < 1e-12, "bias(1/2, {b})");
                let mut last = [0.0; 2];
                for k in 0..=1000 {
                    let x = f64::from(k) / 1000.0;
                    let now = [curve.bias(x, b), curve.gain(x, b)];
                    assert!((0..2).all(|i| now[i] >= last[i] && now[i] <= 1.0), "monotone at {x}, {b}");
                    last = now;
                }
            }
            assert_eq!(curve.bias(0.3, 0.5), 0.3, "identity");
            assert!((curve.gain(0.3, 0.5) - 0.3).abs() < 1e-15, "identity");
            assert!(curve.gain(0.2, 0.8) < 0.2 && curve.gain(0.2, 0.2) > 0.2, "steeper and flatter middle");
        }
    }

    #[test]
    fn full_shadow_is_the_shadow_bias() {
        let light = DirectionalLight { to: [0.0, 0.0, 1.0], strength: 1.0, color: [1.0; 3] };
        for curve in [BiasGain::Perlin, BiasGain::Schlick] {
            let sum = Illumination { ambient: 0.0, outer: [0.0, 0.5], inner: [0.0, 0.5], shadow_bias: 0.4, curve };
            let mut place =
                ShadingPoint { normal: [0.0, 0.0, 1.0], centre: 1.0, branch: 1.0, far: 0.0, light_visibility: 0.0 };
            let dark = sum.of(&[light], &place);
            assert!((dark.full - 0.4).abs() < 1e-12, "thesis IV.5: {}", dark.full);
            place.light_visibility = 1.0;
            assert_eq!(sum.of(&[light], &place).full, 1.0, "no shadow");
            assert_eq!(sum.of(&[light, light], &place).full, 1.0, "lights add up and are clamped");
            place.normal = [0.0, 0.0, -1.0];
            assert_eq!(sum.of(&[light], &place).full, 0.0, "turned away");
        }
    }

    #[test]
    fn the_inner_darkening_goes_with_distance() {
        let light = DirectionalLight { to: [0.0, 0.0, 1.0], strength: 0.5, color: [1.0; 3] };
        let sum = Illumination {
            ambient: 0.0,
            outer: [0.3, 0.6],
            inner: [0.3, 0.6],
            shadow_bias: 0.5,
            curve: BiasGain::Perlin,
        };
        let of = |centre: f64, branch: f64, far: f64| {
            let place = ShadingPoint { normal: [0.0, 0.0, 1.0], centre, branch, far, light_visibility: 1.0 };
            sum.of(&[light], &place).full
        };
        assert!((of(0.0, 0.0, 0.0) - 0.2).abs() < 1e-12 && (of(1.0, 1.0, 0.0) - 0.8).abs() < 1e-12, "extremes");
        assert!((of(0.0, 0.0, 1.0) - 0.5).abs() < 1e-12, "no darkening far away");
        for k in 0..100 {
            let (a, b) = (f64::from(k) / 100.0, f64::from(k + 1) / 100.0);
            assert!(of(b, 0.5, 0.3) >= of(a, 0.5, 0.3) && of(0.5, b, 0.3) >= of(0.5, a, 0.3), "monotone");
            assert!(of(0.2, 0.5, b) >= of(0.2, 0.5, a), "monotone in distance");
        }
    }
}

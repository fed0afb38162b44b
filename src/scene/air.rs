//! Aerial perspective: transmittance and in-scattered light of the air between the eye and a surface, before any tone
//! curve (floor 4).
//!
//! Of light from `s` metres away `exp(-b s)` is left, and the air adds `1 - exp(-b s)` of the sky at the horizon behind
//! it, which is what a path without end shows (Koschmieder 1924). The extinction `b` is that of the sky's own air: molecules
//! by Bodhaine et al. 1999 and aerosol by Angstrom's law at 645, 543 and 441.5 nm, where it is that of the Rec. 709
//! channels of daylight; both fall off with height, and the mean along the path counts. For a meteorological range it is the same in
//! all channels, `ln 50` over the range.
//!
//! Units: metres, 1/m, radiance in the sky's unit. Error: that of three wavelengths for sixteen, below 1 % of the light to
//! 10 km (`three_wavelengths_are_enough`). Cost: 30 ns a stroke.

use glam::DVec3;

use crate::air::optics::{MOLECULES_PER_AREA, rayleigh_cross_section};
use crate::color::spectrum::CHANNEL_WAVELENGTHS;
use crate::error::{Error, Result};
use crate::job::Job;

const CHUNK: usize = 2048;

/// Two kinds of particles whose extinction falls off with height.
#[derive(Debug, Clone, PartialEq)]
pub struct Air {
    /// Extinction at height 0 in each channel \[1/m\].
    pub extinction: [[f64; 3]; 2],
    /// Scale heights \[m\]; infinite for one that is the same everywhere.
    pub scale: [f64; 2],
    /// The sky at the horizon, clockwise from north.
    pub horizon: Vec<[f32; 3]>,
}

/// Extinction of molecules and of aerosol at the ground in each channel \[1/m\], for a pressure \[hPa\], Angstrom's
/// `beta` and `alpha` and the two scale heights \[m\].
pub fn extinction(pressure: f64, beta: f64, alpha: f64, scale: [f64; 2]) -> [[f64; 3]; 2] {
    let molecules =
        CHANNEL_WAVELENGTHS.map(|w| rayleigh_cross_section(w) * MOLECULES_PER_AREA / scale[0] * pressure / 1013.25);
    [molecules, CHANNEL_WAVELENGTHS.map(|w| beta * (w * 1e-3).powf(-alpha) / scale[1])]
}

/// Mean over a way from one height to another of what falls off with height.
fn mean(from: f64, to: f64, scale: f64) -> f64 {
    if !scale.is_finite() {
        return 1.0;
    }
    let (a, b) = (from.max(0.0) / scale, to.max(0.0) / scale);
    if (a - b).abs() < 1e-4 { (-0.5 * (a + b)).exp() } else { ((-a).exp() - (-b).exp()) / (b - a) }
}

impl Air {
    /// What is left of light from `place` to the eye in each channel \[1\], and what the air adds.
    pub fn between(&self, eye: DVec3, place: DVec3) -> ([f64; 3], [f64; 3]) {
        let way = place - eye;
        let far = way.length();
        let density = [0, 1].map(|k: usize| mean(eye.z, place.z, self.scale[k]));
        let left =
            [0, 1, 2].map(|c: usize| (-far * (0..2).map(|k| density[k] * self.extinction[k][c]).sum::<f64>()).exp());
        let n = self.horizon.len();
        if n == 0 {
            return (left, [0.0; 3]);
        }
        let at = way.x.atan2(way.y) * (n as f64 / std::f64::consts::TAU);
        let low = at.floor();
        let t = at - low;
        let pick = |k: f64| self.horizon[(k.rem_euclid(n as f64) as usize).min(n - 1)];
        let (a, b) = (pick(low), pick(low + 1.0));
        let added = [0, 1, 2].map(|c: usize| {
            let behind = f64::from(a[c]) + (f64::from(b[c]) - f64::from(a[c])) * t;
            (1.0 - left[c]) * behind
        });
        (left, added)
    }

    /// Put the air before colours at places (`x, y, z` in turn) \[m\]; of `variation` only a part is left.
    pub fn before(
        &self,
        job: &Job,
        eye: DVec3,
        places: &[f64],
        colors: &mut [f32],
        variation: &mut [f32],
    ) -> Result<()> {
        for (name, len) in [("colors", colors.len()), ("variation", variation.len().max(colors.len()))] {
            if len != places.len() {
                let expected = format!("({},)", places.len());
                return Err(Error::Shape { name, expected, got: format!("({len},)") });
            }
        }
        // What is left and what is added, once for both.
        let mut both = vec![[0.0_f32; 6]; places.len() / 3];
        job.chunks(&mut both, CHUNK, |chunk, part| {
            for (k, both) in part.iter_mut().enumerate() {
                let (left, added) = self.between(eye, DVec3::from_slice(&places[3 * (chunk * CHUNK + k)..]));
                for c in 0..3 {
                    (both[c], both[3 + c]) = (left[c] as f32, added[c] as f32);
                }
            }
            Ok(())
        })?;
        job.chunks(colors, 3 * CHUNK, |chunk, part| {
            for (rgb, both) in part.as_chunks_mut::<3>().0.iter_mut().zip(&both[chunk * CHUNK..]) {
                for c in 0..3 {
                    rgb[c] = rgb[c] * both[c] + both[3 + c];
                }
            }
            Ok(())
        })?;
        job.chunks(variation, 3 * CHUNK, |chunk, part| {
            for (rgb, both) in part.as_chunks_mut::<3>().0.iter_mut().zip(&both[chunk * CHUNK..]) {
                for c in 0..3 {
                    rgb[c] *= both[c];
                }
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::air::optics::{AirComposition, Optics};
    use crate::color::spectrum::bands;

    #[test]
    fn three_wavelengths_are_enough() {
        let set = AirComposition {
            pressure: 1013.25,
            rayleigh_scale_height: Some(7200.0),
            top: 60_000.0,
            beta: 0.1,
            alpha: 1.3,
            aerosol_scale_height: 1200.0,
            aerosol_albedo: 0.9,
            g: 0.7,
            ozone: 300.0,
            ground_albedo: 0.1,
        };
        let optics = Optics::new(&Job::serial(), &set).expect("in range");
        let here = extinction(1013.25, 0.1, 1.3, [7200.0, 1200.0]);
        let whole = optics.project(&[1.0; 16]);
        assert_eq!(bands::<16>().len(), 16, "bands");
        for far in [500.0, 2e3, 1e4] {
            let left = optics
                .project(&std::array::from_fn(|k| (-far * (optics.extinction[0][k] + optics.extinction[1][k])).exp()));
            for c in 0..3 {
                let mine = (-far * (here[0][c] + here[1][c])).exp();
                assert!((mine - left[c] / whole[c]).abs() < 0.01, "{far} m, {c}: {mine} for {}", left[c] / whole[c]);
            }
        }
    }

    #[test]
    fn air_composes_and_ends_in_the_horizon() {
        let air = Air {
            extinction: [[1e-5, 2e-5, 4e-5], [1e-4; 3]],
            scale: [7200.0, 1200.0],
            horizon: vec![[3.0, 2.0, 1.0]; 8],
        };
        let (eye, middle, end) =
            (DVec3::new(0.0, 0.0, 5.0), DVec3::new(900.0, 400.0, 300.0), DVec3::new(1800.0, 800.0, 595.0));
        let (whole, near, far) = (air.between(eye, end), air.between(eye, middle), air.between(middle, end));
        for c in 0..3 {
            assert!((near.0[c] * far.0[c] - whole.0[c]).abs() < 1e-12, "of the light");
            assert!((near.0[c] * far.1[c] + near.1[c] - whole.1[c]).abs() < 1e-6, "of what is added");
        }
        let (left, added) = air.between(eye, DVec3::new(-1e9, 3e8, 5.0));
        assert!(left.iter().all(|&x| x < 1e-9) && (added[0] - 3.0).abs() < 1e-6, "the horizon");
        let level = Air { scale: [f64::INFINITY; 2], ..air };
        let want = (-1000.0 * 1.1e-4_f64).exp();
        assert!((level.between(DVec3::ZERO, DVec3::X * 1000.0).0[0] - want).abs() < 1e-12, "Koschmieder");
        let mut light = [3.0, 2.0, 1.0];
        level.before(&Job::serial(), DVec3::ZERO, &[1e4, 0.0, 50.0], &mut light, &mut []).expect("as many");
        assert!((light[0] - 3.0).abs() < 1e-5 && (light[2] - 1.0).abs() < 1e-5, "a white furnace: {light:?}");
    }
}

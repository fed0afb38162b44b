//! Relighting a cloud from precomputed basis images: in-scattering, ambient light, transmittance and haze composed for
//! any parameters (eqs 3-5, 8, 9 of inverse_clouds).
//!
//! With the camera and the Sun fixed, one image of the density-weighted path `S` gives the ambient light and the
//! background of any extinction in closed form, and a few images of the single-scattered light `J` at chosen
//! extinctions give the rest by interpolation. The paper's side images for the ambient term and for the transmittance
//! are therefore not needed (their integrals are `(1 - exp(-sigma S)) / sigma` and `exp(-sigma S)`).
//!
//! Deviations, each with the paper's reading beside it: [`Ambient`], [`Phase`], [`Interpolation`].

use super::phase::henyey_greenstein;
use crate::error::{Error, Result, in_range};
use crate::job::Job;
use crate::math::interpolation::{lagrange, within};
use crate::math::{elementary, lanes};

/// The constant ambient term of eq 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ambient {
    /// `L_amb * (1 - exp(-sigma S))`: an opaque cloud shows `L_amb`, whatever the unit of length.
    Extinction,
    /// `L_amb * (1 - exp(-sigma S)) / sigma`, as printed: it falls with extinction.
    Paper,
}

/// Normalisation of the phase function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Mean 1 over the sphere: the paper's range of intensities then reaches white.
    MeanOne,
    /// Integral 1 over the sphere, as in radiative transfer.
    IntegralOne,
}

/// Between the extinctions of a basis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Four-point Lagrange in the logarithm of the extinction.
    Cubic,
    /// Linear in the extinction, as in the paper.
    Linear,
}

/// The parameters of Table 1, without the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudParams {
    /// Intensity of the light on the cloud, `L_in`.
    pub intensity: f64,
    /// Its colour, `c_in`.
    pub color: [f64; 3],
    /// Asymmetry of the Henyey-Greenstein phase function.
    pub g: f64,
    /// Extinction per metre and unit of density \[1/m\].
    pub sigma: f64,
    /// Single-scattering albedo, `beta`.
    pub albedo: f64,
    /// Ambient light, `L_amb`.
    pub ambient: f64,
    /// Its colour.
    pub ambient_color: [f64; 3],
    /// Extinction of the air per unit of haze distance, `kappa_a`.
    pub haze: [f64; 3],
}

impl CloudParams {
    /// Refuse what has no meaning.
    pub fn validate(&self) -> Result<()> {
        in_range("light_intensity", self.intensity, 0.0, 1e30, "1")?;
        in_range("g", self.g, -0.999, 0.999, "1")?;
        in_range("sigma_t", self.sigma, 0.0, super::march::MAX_EXTINCTION, "1/m")?;
        in_range("albedo", self.albedo, 0.0, 1.0, "1")?;
        in_range("ambient", self.ambient, 0.0, 1e30, "1")?;
        for c in 0..3 {
            in_range("light_color", self.color[c], 0.0, 1e30, "1")?;
            in_range("ambient_color", self.ambient_color[c], 0.0, 1e30, "1")?;
            in_range("haze", self.haze[c], 0.0, 1e30, "1")?;
        }
        Ok(())
    }
}

/// Factor that turns a phase function of mean 1 into the wanted normalisation.
pub fn phase_factor(phase: Phase) -> f64 {
    match phase {
        Phase::MeanOne => 1.0,
        Phase::IntegralOne => 1.0 / (4.0 * std::f64::consts::PI),
    }
}

/// Factors of the ambient light: of the column density `S` where a cloud is thin, and of `1 - exp(-sigma S)`.
pub fn ambient_factors(ambient: Ambient, sigma: f64) -> [f32; 2] {
    match ambient {
        Ambient::Extinction => [sigma as f32, 1.0],
        // What is not thin has a sigma whose inverse is finite.
        Ambient::Paper => [1.0, if sigma > 1e-30 { (1.0 / sigma) as f32 } else { 0.0 }],
    }
}

/// First node and weights of the interpolation at `sigma` among ascending `nodes`; weights of unused nodes are zero.
pub fn weights(nodes: &[f64], sigma: f64, how: Interpolation) -> Result<(usize, [f32; 4])> {
    let sigma = within("sigma_t", nodes, sigma, "1/m")?;
    let (first, found) = if how == Interpolation::Linear || nodes.len() < 4 {
        lagrange(nodes, sigma, 2)
    } else {
        lagrange(&nodes.iter().map(|n| n.ln()).collect::<Vec<_>>(), sigma.ln(), 4)
    };
    let mut weights = [0.0; 4];
    for (to, from) in weights.iter_mut().zip(found) {
        *to = from as f32;
    }
    Ok((first, weights))
}

/// Images that a picture is composed from, all of `pixels` elements.
#[derive(Debug, Clone, Copy)]
pub struct BasisImages<'a> {
    /// Density-weighted path `S` \[m\].
    pub column_density: &'a [f32],
    /// Cosine of the scattering angle.
    pub cosine: &'a [f32],
    /// Single-scattered light `J` at the extinctions of `nodes`, one image after the other.
    pub single_scattering: &'a [f32],
    /// Extinctions of the images \[1/m\], ascending.
    pub nodes: &'a [f64],
    /// Light of the orders from 2 on, albedo included, without intensity; `None` is none.
    pub multiple: Option<&'a [f32]>,
    /// Sky behind the cloud, interleaved RGB.
    pub sky: &'a [f32],
    /// Haze distance of each pixel, `t_c`; `None` is 1 everywhere.
    pub haze_distance: Option<&'a [f32]>,
    /// Path of the light through the same haze before it reaches the cloud; `None` is 0 everywhere.
    pub light_path: Option<&'a [f32]>,
}

impl BasisImages<'_> {
    /// Refuse parts of unequal size.
    pub fn validate(&self) -> Result<()> {
        let pixels = self.column_density.len();
        let check = |name: &'static str, got: usize, expected: usize| {
            if got == expected {
                return Ok(());
            }
            Err(Error::Shape { name, expected: format!("{expected} elements"), got: format!("{got} elements") })
        };
        check("cosine", self.cosine.len(), pixels)?;
        check("scattered", self.single_scattering.len(), pixels * self.nodes.len())?;
        check("sky", self.sky.len(), pixels * 3)?;
        check("multiple", self.multiple.map_or(pixels, <[f32]>::len), pixels)?;
        check("haze_distance", self.haze_distance.map_or(pixels, <[f32]>::len), pixels)?;
        check("light_path", self.light_path.map_or(pixels, <[f32]>::len), pixels)?;
        if self.light_path.is_some() && self.haze_distance.is_none() {
            return Err(Error::Data { name: "light_path", reason: "needs a haze distance beside it".into() });
        }
        if self.nodes.windows(2).any(|w| w[0] >= w[1]) {
            return Err(Error::Data { name: "sigma_t", reason: "the extinctions of a basis must ascend".into() });
        }
        Ok(())
    }
}

/// The conventions under which parameters have their meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conventions {
    /// Ambient term.
    pub ambient: Ambient,
    /// Phase normalisation.
    pub phase: Phase,
    /// Interpolation between extinctions.
    pub interpolation: Interpolation,
}

/// A picture and what it is made of.
#[derive(Debug)]
pub struct Composed<'a> {
    /// Picture, interleaved RGB.
    pub rgb: &'a mut [f32],
    /// The light scattered once, without haze, interleaved RGB.
    pub single: &'a mut [f32],
    /// Transmittance of the cloud.
    pub transmittance: &'a mut [f32],
}

const CHUNK: usize = 4096;

/// What a pixel loop needs of a [`CloudParams`]: interpolation weights and products of scalars.
#[derive(Debug, Clone, Copy)]
pub struct Scalars {
    /// First node of the interpolation.
    pub first: usize,
    /// Weights of it and of those after it; zero where there is none.
    pub weight: [f32; 4],
    /// Factor of phase function and `J`.
    pub source: f32,
    /// Factor of the light of higher orders.
    pub multiple: f32,
    /// Ambient light, for R, G, B; multiplied by [`Scalars::opacity`].
    pub ambient: [f32; 3],
    /// Of the ambient term, by [`ambient_factors`].
    pub factors: [f32; 2],
    /// Asymmetry.
    pub g: f32,
    /// Extinction \[1/m\].
    pub sigma: f32,
    /// Colour of the light.
    pub color: [f32; 3],
    /// Extinction of the air.
    pub haze: [f32; 3],
}

impl Scalars {
    /// Refuses parameters without meaning and extinctions outside `nodes`.
    pub fn new(nodes: &[f64], params: &CloudParams, how: Conventions) -> Result<Self> {
        params.validate()?;
        let (first, weight) = weights(nodes, params.sigma, how.interpolation)?;
        Ok(Self {
            first,
            weight,
            source: (params.intensity * params.albedo * phase_factor(how.phase)) as f32,
            multiple: (params.intensity * phase_factor(how.phase)) as f32,
            ambient: params.ambient_color.map(|c| (c * params.ambient) as f32),
            factors: ambient_factors(how.ambient, params.sigma),
            g: params.g as f32,
            sigma: params.sigma as f32,
            color: params.color.map(|c| c as f32),
            haze: params.haze.map(|c| c as f32),
        })
    }
}

impl Scalars {
    /// What multiplies the ambient light of a pixel of this column density: `1 - exp(-tau)`, over sigma by the paper's
    /// letter. Below an optical depth of 0.05 by its series, whose relative error is 6e-8: the difference has lost its digits.
    #[inline(always)]
    pub fn opacity(&self, column_density: f32, transmittance: f32) -> f32 {
        let tau = self.sigma * column_density;
        let series = 1.0 - tau * (0.5 - tau * (1.0 / 6.0 - tau * (1.0 / 24.0)));
        let [thin, thick] = self.factors;
        if tau < 0.05 { thin * column_density * series } else { thick * (1.0 - transmittance) }
    }
}

/// Seven values a pixel: picture, single scattering, transmittance.
#[inline(always)]
fn compose_chunk(parts: &BasisImages<'_>, s: &Scalars, start: usize, out: &mut [f32]) {
    let pixels = parts.column_density.len();
    for (i, out) in out.chunks_exact_mut(7).enumerate() {
        let p = start + i;
        let mut light = 0.0;
        for k in 0..4 {
            if s.weight[k] != 0.0 {
                light += s.weight[k] * parts.single_scattering[(s.first + k) * pixels + p];
            }
        }
        let through = elementary::exp(-s.sigma * parts.column_density[p]);
        let single = s.source * henyey_greenstein(s.g, parts.cosine[p], f32::sqrt) * light;
        let more = s.multiple * parts.multiple.map_or(0.0, |m| m[p]);
        let far = parts.haze_distance.map_or(1.0, |t| t[p]);
        let before = parts.light_path.map_or(0.0, |t| t[p]);
        let opacity = s.opacity(parts.column_density[p], through);
        for c in 0..3 {
            let sky = parts.sky[3 * p + c];
            let lit = if before == 0.0 { 1.0 } else { elementary::exp(-s.haze[c] * before) };
            let cloud = s.color[c] * lit * (single + more) + s.ambient[c] * opacity + through * sky;
            // An infinite distance (a pixel without cloud) is clear where there is no haze.
            let clear = if s.haze[c] == 0.0 { 1.0 } else { elementary::exp(-s.haze[c] * far) };
            out[c] = cloud * clear + (1.0 - clear) * sky;
            out[3 + c] = s.color[c] * single;
        }
        out[6] = through;
    }
}

/// Compose the picture of `params`.
pub fn compose(
    parts: &BasisImages<'_>,
    params: &CloudParams,
    how: Conventions,
    out: &mut Composed<'_>,
    job: &Job,
) -> Result<()> {
    parts.validate()?;
    let pixels = parts.column_density.len();
    if out.rgb.len() != 3 * pixels || out.single.len() != 3 * pixels || out.transmittance.len() != pixels {
        let got = format!("{} elements", out.rgb.len());
        return Err(Error::Shape { name: "out", expected: format!("{pixels} pixels"), got });
    }
    let scalars = Scalars::new(parts.nodes, params, how)?;
    // Three outputs share their chunks: one buffer of seven values a pixel, cut apart below.
    let mut all = vec![0.0_f32; 7 * pixels];
    job.chunks(&mut all, 7 * CHUNK, |chunk, out| {
        lanes::run(
            #[inline(always)]
            || compose_chunk(parts, &scalars, chunk * CHUNK, out),
        );
        Ok(())
    })?;
    for (p, part) in all.chunks_exact(7).enumerate() {
        out.rgb[3 * p..3 * p + 3].copy_from_slice(&part[..3]);
        out.single[3 * p..3 * p + 3].copy_from_slice(&part[3..6]);
        out.transmittance[p] = part[6];
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_phase_function_has_mean_one_and_mean_cosine_g() {
        for g in [-0.9_f32, -0.3, 0.0, 0.5, 0.85, 0.95] {
            let (mut mean, mut cosine) = (0.0, 0.0);
            let n = 400_000;
            for i in 0..n {
                let mu = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n);
                let p = f64::from(henyey_greenstein(g, mu as f32, f32::sqrt));
                mean += p / f64::from(n);
                cosine += p * mu / f64::from(n);
            }
            assert!((mean - 1.0).abs() < 1e-4, "g = {g}: mean {mean}");
            assert!((cosine - f64::from(g)).abs() < 1e-4, "g = {g}: mean cosine {cosine}");
        }
    }

    #[test]
    fn interpolation_is_exact_at_nodes_and_for_what_it_spans() {
        let nodes: Vec<f64> = (0..8).map(|i| 0.01 * 2.0_f64.powi(i)).collect();
        for (i, &node) in nodes.iter().enumerate() {
            let (first, w) = weights(&nodes, node, Interpolation::Cubic).expect("inside");
            for (k, &w) in w.iter().enumerate() {
                let expected = if first + k == i { 1.0 } else { 0.0 };
                assert!((w - expected).abs() < 1e-6, "node {i}, weight {k}: {w}");
            }
        }
        // A cubic in log sigma is reproduced, at the ends too.
        let f = |s: f64| 1.0 + s.ln() - 0.3 * s.ln().powi(2) + 0.05 * s.ln().powi(3);
        for sigma in [0.0101, 0.013, 0.05, 0.3, 1.2] {
            let (first, w) = weights(&nodes, sigma, Interpolation::Cubic).expect("inside");
            let got: f64 = (0..4).map(|k| f64::from(w[k]) * f(nodes[first + k])).sum();
            assert!((got - f(sigma)).abs() < 1e-5, "sigma {sigma}: {got} against {}", f(sigma));
        }
        assert!(weights(&nodes, 2.0, Interpolation::Cubic).is_err(), "outside the basis");
        let (first, w) = weights(&[0.0, 0.1, 0.2], 0.15, Interpolation::Linear).expect("inside");
        assert_eq!((first, w[2]), (1, 0.0), "linear uses two nodes");
        assert!((w[0] - 0.5).abs() < 1e-6, "halfway");
    }

    #[test]
    fn without_a_cloud_the_sky_is_seen_through_any_haze() {
        let sky = [0.2_f32, 0.4, 0.9, 0.1, 0.0, 2.0];
        let parts = BasisImages {
            column_density: &[0.0; 2],
            cosine: &[0.5; 2],
            single_scattering: &[0.0; 2],
            nodes: &[0.3],
            multiple: None,
            sky: &sky,
            haze_distance: None,
            light_path: None,
        };
        let how =
            Conventions { ambient: Ambient::Extinction, phase: Phase::MeanOne, interpolation: Interpolation::Cubic };
        let params = CloudParams {
            intensity: 3.0,
            color: [1.0; 3],
            g: 0.8,
            sigma: 0.3,
            albedo: 0.9,
            ambient: 0.5,
            ambient_color: [1.0; 3],
            haze: [0.0, 0.4, 7.0],
        };
        let (mut rgb, mut single, mut through) = ([0.0; 6], [0.0; 6], [0.0; 2]);
        let mut out = Composed { rgb: &mut rgb, single: &mut single, transmittance: &mut through };
        compose(&parts, &params, how, &mut out, &Job::serial()).expect("composes");
        for (a, b) in rgb.iter().zip(sky) {
            assert!((a - b).abs() < 1e-6, "eq 3 with eq 9: {a} against {b}");
        }
        assert_eq!(through, [1.0; 2], "nothing in the way");
    }
}

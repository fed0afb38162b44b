//! Atmospheric optics: Rayleigh and aerosol extinction and ozone absorption in 16 spectral bands (floor 2).
//!
//! Eqs 2 and 4 of the paper realistic_sky as measured: the cross section of air by Bodhaine et al. 1999 (eq 29),
//! Angstrom's law for aerosol, ozone as a triangle of heights; profiles by profile.rs. What an atmosphere
//! lets through of a source ([`Optics::attenuated`]) is projected on linear Rec. 709.
//!
//! Units: metres, hPa, DU, lx of each channel. Error: `tests/oracles/test_sasktran.py` holds what is made of it.

use crate::air::profile::{Molecules, Profile};
use crate::air::scattering::{C, SphericalAir};
use crate::air::shell::Shell;
use crate::color::spaces::XYZ_TO_RGB;
use crate::color::spectrum::bands;
use crate::error::{Result, in_range};
use crate::job::Job;

/// Radius of the Earth \[m\].
const RADIUS: f64 = 6.36e6;
/// The ozone layer begins, is densest and ends \[m\].
const OZONE: [f64; 3] = [1e4, 2.5e4, 4e4];
/// Molecules above a square metre at 1013.25 hPa, and in one of one Dobson unit.
pub const MOLECULES_PER_AREA: f64 = 2.148e29;
const DOBSON: f64 = 2.687e20;

/// What the air is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirComposition {
    /// Pressure on the ground \[hPa\]: how many molecules there are above it.
    pub pressure: f64,
    /// Scale height of molecules \[m\]; without, they are those of the U.S. Standard Atmosphere 1976.
    pub rayleigh_scale_height: Option<f64>,
    /// Height of the top of the air \[m\].
    pub top: f64,
    /// Optical depth of the aerosol at 1 um, and how fast it falls with wavelength (Ångström's beta and alpha).
    pub beta: f64,
    /// Ångström's exponent.
    pub alpha: f64,
    /// Scale height of the aerosol \[m\].
    pub aerosol_scale_height: f64,
    /// Single-scattering albedo of the aerosol.
    pub aerosol_albedo: f64,
    /// Asymmetry of the aerosol.
    pub g: f64,
    /// Ozone \[DU\].
    pub ozone: f64,
    /// Albedo of the ground.
    pub ground_albedo: f64,
}

impl AirComposition {
    /// That of the defaults: a clear day of turbidity 2.5, by the numbers that Python has.
    pub const DEFAULT: Self = Self {
        pressure: 1013.25,
        rayleigh_scale_height: None,
        top: 100_000.0,
        beta: 0.04608 * 2.5 - 0.04586,
        alpha: 1.3,
        aerosol_scale_height: 1200.0,
        aerosol_albedo: 0.85,
        g: 0.7,
        ozone: 300.0,
        ground_albedo: 0.1,
    };
}

/// How much of its light above the air a source sends in each band, against the Sun at its mean distance.
pub type Spectrum = [f64; C];

/// What an atmosphere lets through.
#[derive(Debug, Clone)]
pub struct Optics {
    pub(crate) air: SphericalAir,
    /// Extinction of molecules and of aerosol on the ground \[1/m\].
    pub(crate) extinction: [[f64; C]; 2],
    /// RGB of a band of sunlight.
    rgb: [[f64; C]; 3],
}

/// Bodhaine et al. 1999, eq 29: cross section of air \[m2\].
pub fn rayleigh_cross_section(wavelength: f64) -> f64 {
    let square = (wavelength * 1e-3).powi(2);
    let top = 1.045_599_6 - 341.290_61 / square - 0.902_308_50 * square;
    let bottom = 1.0 + 0.002_705_988_9 / square - 85.968_563 * square;
    1e-32 * top / bottom
}

impl Optics {
    /// Of an atmosphere with these settings.
    pub fn new(job: &Job, set: &AirComposition) -> Result<Self> {
        in_range("pressure", set.pressure, 0.0, 2000.0, "hPa")?;
        in_range("scale_height", set.rayleigh_scale_height.unwrap_or(8000.0), 4000.0, 15_000.0, "m")?;
        in_range("top", set.top, 50_000.0, 120_000.0, "m")?;
        in_range("beta", set.beta, 0.0, 2.0, "1")?;
        in_range("alpha", set.alpha, -1.0, 4.0, "1")?;
        in_range("aerosol_scale_height", set.aerosol_scale_height, 600.0, 10_000.0, "m")?;
        in_range("aerosol_albedo", set.aerosol_albedo, 0.0, 1.0, "1")?;
        in_range("g", set.g, -0.98, 0.98, "1")?;
        in_range("ozone", set.ozone, 0.0, 2000.0, "DU")?;
        in_range("ground_albedo", set.ground_albedo, 0.0, 1.0, "1")?;
        let bands = bands::<C>();
        let kind = set.rayleigh_scale_height.map_or(Molecules::Standard, Molecules::Exponential);
        let shell = Shell { radius: RADIUS, thickness: set.top };
        let profile = Profile::new(shell, kind, set.aerosol_scale_height, OZONE);
        let [column, _, layer] = profile.vertical();
        // What is above the top is a part in 1e7 of the standard's column.
        let amount = MOLECULES_PER_AREA * set.pressure / 1013.25 / set.rayleigh_scale_height.unwrap_or(column);
        let molecules = bands.map(|b| rayleigh_cross_section(b.wavelength) * amount);
        let aerosol = bands.map(|b| set.beta * (b.wavelength * 1e-3).powf(-set.alpha) / set.aerosol_scale_height);
        let ozone = bands.map(|b| b.ozone * set.ozone * DOBSON / layer);
        let air = SphericalAir::new(job, profile, [molecules, aerosol, ozone])?;
        let rgb = XYZ_TO_RGB.map(|row| bands.map(|b| row[0] * b.sun[0] + row[1] * b.sun[1] + row[2] * b.sun[2]));
        Ok(Self { air, extinction: [molecules, aerosol], rgb })
    }

    /// RGB of what is in the bands.
    pub(crate) fn project(&self, bands: &[f64; C]) -> [f64; 3] {
        self.rgb.map(|row| row.iter().zip(bands).map(|(a, b)| a * b).sum())
    }

    /// What comes through the air to `h` \[m\] at the cosine `mu` to the vertical, of a source's light \[lx\].
    pub fn attenuated(&self, h: f64, mu: f64, source: &Spectrum) -> [f64; 3] {
        let clear = self.air.to_the_top(h, mu);
        self.project(&std::array::from_fn(|k| clear[k] * source[k]))
    }

    /// A source's light above the air \[lx\].
    pub fn extraterrestrial(&self, source: &Spectrum) -> [f64; 3] {
        self.project(source)
    }
}

/// The spectrum of a source of this illuminance \[lx\] whose light over the Sun's goes as this power of the wavelength.
pub fn spectrum(illuminance: f64, power: f64) -> Spectrum {
    let bands = bands::<C>();
    let shape = bands.map(|b| (b.wavelength / 550.0).powf(power));
    let sum: f64 = bands.iter().zip(shape).map(|(b, s)| b.sun[1] * s).sum();
    shape.map(|s| s * illuminance / sum)
}

/// Cosine to the vertical of the horizon at a height \[m\].
pub fn horizon(altitude: f64) -> f64 {
    -(altitude * (2.0 * RADIUS + altitude)).sqrt() / (RADIUS + altitude)
}

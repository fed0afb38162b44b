//! What happens to light in a cloud (floor 3), after Dobashi et al. 2012: [`papers`](crate::papers) maps their
//! equations.
//!
//! A volume of density is marched once for each pixel of a camera ([`march`]); the light of any parameters is then
//! composed from a few precomputed images ([`bases`]), behind air ([`haze`]). Volumes are made by formula
//! ([`procedural`]) or grown in moist air ([`simulated`], on [`fluid`], [`pressure`] and [`atmosphere`]).

pub mod atmosphere;
pub mod bases;
pub mod denoise;
pub mod density;
pub mod fluid;
pub mod haze;
pub mod levels;
pub mod low_rank;
pub mod march;
pub mod multiple;
pub mod openvdb;
pub mod orders;
pub mod phase;
pub mod pressure;
pub mod procedural;
pub mod simulated;
pub mod sun;
pub mod tracking;

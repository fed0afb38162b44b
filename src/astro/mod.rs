//! Where the Sun, the Moon and the stars are, and how bright; the diffuse lights of the dark sky (floor 1).
//!
//! | file | what |
//! |---|---|
//! | [`time`] | UTC to terrestrial time and to the rotation of the Earth |
//! | [`frames`] | precession, nutation, sidereal time, horizon of a place, parallax, refraction |
//! | [`sun`] | VSOP87D truncated: 1" |
//! | [`moon`] | ELP-2000/82 as truncated by Meeus, with what that leaves of DE421: 1.5"; phase, limb, light |
//! | [`observer`] | a place at an instant: what positions are computed from |
//! | [`planets`] | VSOP87D truncated: 7"; magnitudes of Mallama and Hilton |
//! | [`refraction`] | rays through the [`standard_atmosphere`] from any height |
//! | [`stars`] | 8 874 stars to V 6.5 |
//! | [`milky_way`] | luminance of the starlight that is not in that table |
//! | [`zodiacal`] | luminance of the zodiacal light, by Leinert's table |
//! | [`light`] | magnitudes, irradiance, colour temperature: equations 9 to 12 of the paper realistic_sky; colours |
//!
//! The paper realistic_sky, section 2, names VSOP87 for the Sun, the Earth and the Moon; VSOP87 has no Moon.
//!
//! Units: radians, kilometres, astronomical units, seconds since 1970-01-01 UTC. Valid from 1900 to 2100.
//! Error bounds are held by `tests/oracles/test_astropy.py`. Cost: one Sun and Moon 9 µs
//! ([`observer`]).

pub mod frames;
pub mod light;
pub mod milky_way;
pub mod moon;
pub mod observer;
pub mod planets;
pub mod refraction;
pub mod selenography;
pub mod standard_atmosphere;
pub mod stars;
pub mod sun;
mod tables;
pub mod time;
pub mod zodiacal;

pub use frames::{FrameOfDate, Seen, Site};
pub use moon::{Law, Moon};
pub use observer::Observer;
pub use time::Instant;

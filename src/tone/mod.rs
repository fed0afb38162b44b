//! Floor 2: tone reproduction, after the eye or camera.

pub mod dither;
pub mod exposure;
pub mod glare;
pub mod grade;
mod pixels;
pub mod present;
pub mod scotopic;
pub mod tumblin_rushmeier;

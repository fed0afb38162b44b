//! Floor 2: tone reproduction, after the eye or camera.

pub mod exposure;
mod pixels;
pub mod scotopic;
pub mod tumblin_rushmeier;

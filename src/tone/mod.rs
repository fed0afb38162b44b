//! Floor 2: after the eye or camera.

pub mod exposure;
pub mod eye;

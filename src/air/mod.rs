//! Floor 2: what happens to light in air.

pub mod multiple;
pub mod optics;
pub mod phase;
pub mod shell;
pub mod single;

//! Floor 2: what happens to light in air.

pub mod optics;
pub mod orders;
pub mod phase;
pub mod shell;
pub mod single;

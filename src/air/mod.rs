//! Floor 2: what happens to light in air.

pub mod orders;
pub mod phase;
pub mod shell;
pub mod single;

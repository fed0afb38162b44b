//! Weather (floor 3): light of water drops (rainbow, fogbow), fog and rain before what is seen, what falls near the eye, snow.

pub mod drops;
pub mod fall;
pub mod snow;
pub mod veil;

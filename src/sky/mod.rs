//! Floor 3: how bright is that direction?

pub mod aoas;
pub mod field;
pub mod light;
pub mod lit;
pub mod pattern;
pub mod physical;
pub mod table;

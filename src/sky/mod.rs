//! Floor 3: how bright is that direction?

pub mod aoas;
pub mod cie_general;
pub mod dark;
pub mod discs;
pub mod field;
pub mod light;
pub mod lit;
pub mod mesh;
pub mod natural;
pub mod pattern;
pub mod perez;
pub mod physical;
pub mod preetham;
pub mod screen;
pub mod table;

//! Floor 3: how bright is that direction? Sky models behind one trait ([`model`]), tables, and the renderer.

pub mod adaptive_sampling;
pub mod aoas;
pub mod cie_general;
pub mod discs;
pub mod light;
pub mod limb;
pub mod model;
pub mod modulation;
pub mod moon_face;
pub mod natural;
pub mod night;
pub mod overcast;
pub mod perez;
pub mod physical;
pub mod preetham;
pub mod render;
pub mod scattering_table;
pub mod screen;
pub mod table;

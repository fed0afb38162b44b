//! Painterly rendering: what mark is on the canvas (floor 3), after Losure 2008: [`papers`](crate::papers) maps the
//! thesis' statements.
//!
//! Strokes in the world ([`stroke`]) are lit ([`light`]), coloured ([`palette`]) and thinned out with distance
//! ([`level_of_detail`]); projected, they are sprites ([`sprite`]) with a procedural mask ([`mask`]), which are
//! composited front to back ([`composite`]). Strokes come as arrays: where they grow is another room's business.

pub mod composite;
mod cover;
mod id_buffer;
pub mod level_of_detail;
pub mod light;
pub mod mask;
pub mod palette;
pub mod reference;
pub mod shadow;
mod side_view;
pub mod simplification;
mod slab;
pub mod sprite;
pub mod stroke;
mod tile;
mod tile_binning;

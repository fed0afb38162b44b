//! What mark is on the canvas (floor 3), after Losure 2008: [`papers`](crate::papers) maps the thesis' statements.
//!
//! Strokes in the world ([`stroke`]) are lit ([`light`]), coloured ([`palette`]) and thinned out with distance
//! ([`detail`]); projected, they are sprites ([`sprite`]) with a procedural mask ([`mask`]), which are composited front
//! to back ([`composite`]). Strokes come as arrays: where they grow is another room's business.

pub mod composite;
mod cover;
pub mod detail;
mod id_buffer;
pub mod light;
pub mod mask;
pub mod palette;
pub mod reference;
pub mod shadow;
mod side_view;
mod slab;
pub mod sprite;
pub mod stroke;
pub mod thinning;
mod tile;
mod tile_binning;

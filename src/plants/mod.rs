//! Floor 3: shapes of plants and of the ground they stand on. Hands out points, normals and sizes; knows no paint.
//!
//! Source: the corot paper, IV.3 and IV.7. Coordinates are in metres, z up, `f64`; a tree is grown in its own unit and
//! multiplied once, so a `unit` that doubles doubles every coordinate exactly.

pub mod cage;
pub mod leaves;
pub mod nurbs;
pub mod skeleton;
pub mod square;
pub mod strata;
pub mod subdivide;
pub mod surface;

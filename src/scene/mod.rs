//! Floor 4: a scene in the unit of its sky: what lights a point, the air before it, and what is seen.

pub mod air;
pub mod cloud;
pub mod culling;
pub mod light;

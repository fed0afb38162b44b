//! Floor 4: a scene in the unit of its sky: what lights a point, and the air before it.

pub mod air;
pub mod cloud;
pub mod light;

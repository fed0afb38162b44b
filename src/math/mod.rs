//! Floor 0: numbers without meaning. Knows nothing of colour, pictures or skies.

pub mod elementary;
pub mod fisheye;
pub mod geometry;
pub mod interpolation;
pub mod lanes;
pub mod least_squares;
pub mod logarithm;
pub mod noise;
pub mod quadrature;
pub mod random;
pub mod spline;

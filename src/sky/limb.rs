//! The Sun's disc: limb darkening, and the fraction of it that is above a horizon (floor 3).
//!
//! Linear limb darkening of the visible continuum, `1 - 0.6 (1 - cos)`, over its mean. Angles in radians.

/// Fraction of a disc of angular `radius` \[rad\] whose middle has the cosine `mu` to the vertical that is above a
/// horizon.
pub fn fraction_above_horizon(mu: f64, horizon: f64, radius: f64) -> f64 {
    let above = ((mu.asin() - horizon.asin()) / radius).clamp(-1.0, 1.0);
    0.5 + (above * (1.0 - above * above).sqrt() + above.asin()) / std::f64::consts::PI
}

/// Limb darkening of the visible continuum: I = 1 - u (1 - cos), whose mean over the disc is 1 - u / 3.
pub const LIMB: f64 = 0.6;

/// Radiance of the Sun's disc over its mean, at the square of the distance from its middle over its radius.
pub fn limb(square: f64) -> f64 {
    (1.0 - LIMB * (1.0 - (1.0 - square).sqrt())) / (1.0 - LIMB / 3.0)
}
